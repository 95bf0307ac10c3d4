//! The static pixels of a chart, for slides and mails that take no SVG: its own drawing on white, at twice the size.

use super::chart::Chart;
use super::svg;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};
use std::sync::{Arc, OnceLock};

/// Pixels per unit of the drawing: text of 13 units stays sharp on a slide.
const ZOOM: f32 = 2.0;

/// One typeface for all, part of the program, so that the same picture comes out everywhere, with or without fonts installed.
fn fonts() -> Arc<Database> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let load = || {
        let mut fonts = Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        let family = fonts.faces().next().and_then(|f| f.families.first()).map(|f| f.0.clone());
        fonts.set_sans_serif_family(family.unwrap_or_default());
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// The chart as a PNG file; `None` when it cannot be drawn, which no chart of finite size causes.
pub(super) fn png(chart: &Chart) -> Option<Vec<u8>> {
    let options = Options {
        fontdb: fonts(),
        // The drawing takes the colour of the page it stands in; alone it stands on white.
        style_sheet: Some("svg { color: #1d1b18 }".into()),
        ..Options::default()
    };
    let tree = Tree::from_str(&svg::render(chart), &options).ok()?;
    let size = tree.size().to_int_size().scale_by(ZOOM)?;
    let mut pixels = Pixmap::new(size.width(), size.height())?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(ZOOM, ZOOM), &mut pixels.as_mut());
    pixels.encode_png().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{AxisStyle, Series};

    #[test]
    fn lines_and_words_leave_ink() {
        let dark = |chart: &Chart| {
            let pixels = Pixmap::decode_png(&png(chart).unwrap()).unwrap();
            assert_eq!((pixels.width(), pixels.height()), (1520, 940));
            let dark =
                |p: &&resvg::tiny_skia::PremultipliedColorU8| u32::from(p.red()) + u32::from(p.green()) < 200;
            // Left of the plot there is nothing but words.
            let words = pixels.pixels().iter().enumerate().filter(|(k, p)| k % 1520 < 60 && dark(p)).count();
            (words, pixels.pixels().iter().filter(dark).count())
        };
        let axes = |label: &str| [AxisStyle::linear("x", "mm"), AxisStyle::linear(label, "°")];
        let series = vec![Series { points: vec![[0.0, 0.0], [1.0, 2.0]], ..Series::default() }];
        let named = dark(&Chart::series("a", "A", "", axes("direction error"), series.clone()));
        let unnamed = dark(&Chart::series("a", "A", "", [AxisStyle::default(), AxisStyle::default()], series));
        assert!(named.0 > unnamed.0 + 300 && named.1 > 1000, "{named:?} {unnamed:?}");
    }
}

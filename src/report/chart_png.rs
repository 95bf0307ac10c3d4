//! The static pixels of a chart, for slides and mails that take no SVG: its drawing on white, at twice the size.

use super::chart::Chart;
use super::drawing::{Anchor, DASH, Drawing, Element, Ink, Place, TYPE_SIZE};
use super::static_chart;
use crate::formats::Picture;
use crate::text::NARROW_SPACE;
use ab_glyph::{Font, FontRef, OutlineCurve};
use tiny_skia::{
    Color, FillRule, FilterQuality, LineJoin, Paint, Path, PathBuilder, Pattern, Pixmap, Rect, SpreadMode, Stroke,
    StrokeDash, Transform,
};

/// Pixels per unit of the drawing: text of 13 units stays sharp on a slide.
const ZOOM: f32 = 2.0;

/// The colour of text and axes on white.
const TEXT: [u8; 3] = [0x1d, 0x1b, 0x18];

/// Renders the chart on white, at twice the size of its drawing; `None` when it has no size, which no chart causes.
pub(super) fn picture(chart: &Chart) -> Option<Picture> {
    render(&static_chart::draw(chart))
}

/// Renders a drawing; `None` where it has no size.
fn render(drawing: &Drawing) -> Option<Picture> {
    let [width, height] = drawing.size.map(|s| (s as f32 * ZOOM).ceil() as u32);
    let mut pixels = Pixmap::new(width, height)?;
    pixels.fill(Color::WHITE);
    // One typeface for all, part of the program, so that the same picture comes out everywhere, with or without fonts installed.
    let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
    for element in &drawing.elements {
        // An element without extent, such as a line of one point, leaves no ink.
        let _ = paint(&mut pixels, element, &font);
    }
    let rgb = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    Some(Picture { width, height, rgb })
}

/// Paints one element over `pixels`; `None` where it leaves no ink.
fn paint(pixels: &mut Pixmap, element: &Element, font: &FontRef) -> Option<()> {
    let zoom = Transform::from_scale(ZOOM, ZOOM);
    match element {
        Element::Line { points, ink, width, opacity, dashed } => {
            let mut path = PathBuilder::new();
            for (k, [x, y]) in points.iter().map(to_single).enumerate() {
                if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
            let dash = if *dashed { StrokeDash::new(vec![DASH as f32; 2], 0.0) } else { None };
            let stroke = Stroke { width: *width as f32, line_join: LineJoin::Round, dash, ..Stroke::default() };
            pixels.stroke_path(&path.finish()?, &ink_paint(*ink, *opacity), &stroke, zoom, None);
        }
        Element::Rectangle { corner, size, radius, ink } => {
            let ([x, y], [width, height]) = (to_single(corner), to_single(size));
            let path = rounded_rectangle(Rect::from_xywh(x, y, width, height)?, *radius as f32)?;
            pixels.fill_path(&path, &ink_paint(*ink, 1.0), FillRule::Winding, zoom, None);
        }
        Element::Disc { centre, radius, ink, opacity } => {
            let [x, y] = to_single(centre);
            let path = PathBuilder::from_circle(x, y, *radius as f32)?;
            pixels.fill_path(&path, &ink_paint(*ink, *opacity), FillRule::Winding, zoom, None);
        }
        Element::Text { text, place, anchor, opacity, turned, ink } => {
            let [x, y] = to_single(place);
            let turn = if *turned { Transform::from_rotate(-90.0) } else { Transform::identity() };
            let place = turn.post_translate(x, y).post_concat(zoom);
            let path = outline(text, *anchor, font)?;
            pixels.fill_path(&path, &ink_paint(*ink, *opacity), FillRule::Winding, place, None);
        }
        Element::Pixels { corner, size, picture } => {
            let ([x, y], [width, height]) = (to_single(corner), to_single(size));
            let mut source = Pixmap::new(picture.width, picture.height)?;
            for (pixel, rgb) in source.data_mut().chunks_exact_mut(4).zip(picture.rgb.chunks_exact(3)) {
                // Pictures are opaque.
                pixel.copy_from_slice(&[rgb[0], rgb[1], rgb[2], 255]);
            }
            let [across, down] = [width / picture.width as f32, height / picture.height as f32];
            let fit = Transform::from_row(across, 0.0, 0.0, down, x, y);
            // Sharp pixels: a cell is one value, and should not fade into its neighbours.
            let shader = Pattern::new(source.as_ref(), SpreadMode::Pad, FilterQuality::Nearest, 1.0, fit);
            let paint = Paint { shader, anti_alias: false, ..Paint::default() };
            pixels.fill_rect(Rect::from_xywh(x, y, width, height)?, &paint, zoom, None);
        }
    }
    Some(())
}

/// Returns a place in single precision.
fn to_single(place: &Place) -> [f32; 2] {
    place.map(|v| v as f32)
}

/// Returns the paint of an ink on white; `opacity` from 0 to 1.
fn ink_paint(ink: Ink, opacity: f64) -> Paint<'static> {
    let [r, g, b] = if let Ink::Colour(rgb) = ink { rgb } else { TEXT };
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (opacity * 255.0).round() as u8);
    paint
}

/// Returns a rectangle whose corners are quarters of circles, drawn as parabolas: at 2 units the difference does not show. `None` where it
/// has no extent.
fn rounded_rectangle(rect: Rect, radius: f32) -> Option<Path> {
    if radius == 0.0 {
        return Some(PathBuilder::from_rect(rect));
    }
    let [left, top, right, bottom] = [rect.left(), rect.top(), rect.right(), rect.bottom()];
    let mut path = PathBuilder::new();
    path.move_to(left + radius, top);
    path.line_to(right - radius, top);
    path.quad_to(right, top, right, top + radius);
    path.line_to(right, bottom - radius);
    path.quad_to(right, bottom, right - radius, bottom);
    path.line_to(left + radius, bottom);
    path.quad_to(left, bottom, left, bottom - radius);
    path.line_to(left, top + radius);
    path.quad_to(left, top, left + radius, top);
    path.close();
    path.finish()
}

/// Returns the outlines of a line of text around its anchor on the baseline, in units of the drawing; `None` when nothing in it has one.
fn outline(text: &str, anchor: Anchor, font: &FontRef) -> Option<Path> {
    let scale = TYPE_SIZE as f32 / font.units_per_em()?;
    let mut path = PathBuilder::new();
    let mut along = 0.0;
    // Kerning belongs to pairs: the first letter has none.
    let mut before = None;
    // The font has no narrow space, which sets thousands apart; its thin box would stand in the number.
    let narrow = 0.5 * font.h_advance_unscaled(font.glyph_id(' '));
    for id in text.chars().map(|c| (c != NARROW_SPACE).then(|| font.glyph_id(c))) {
        let Some(id) = id else {
            along += narrow;
            before = None;
            continue;
        };
        along += before.map_or(0.0, |b| font.kern_unscaled(b, id));
        before = Some(id);
        // Outlines come piece by piece, upward; where one does not go on from the last, a new contour begins.
        let at = |p: ab_glyph::Point| [(along + p.x) * scale, -p.y * scale];
        let mut end = None;
        for curve in font.outline(id).into_iter().flat_map(|o| o.curves) {
            let (from, to) = match curve {
                OutlineCurve::Line(a, b) | OutlineCurve::Quad(a, _, b) | OutlineCurve::Cubic(a, _, _, b) => {
                    (at(a), at(b))
                }
            };
            if end != Some(from) {
                path.move_to(from[0], from[1]);
            }
            match curve {
                OutlineCurve::Line(..) => path.line_to(to[0], to[1]),
                OutlineCurve::Quad(_, c, _) => path.quad_to(at(c)[0], at(c)[1], to[0], to[1]),
                OutlineCurve::Cubic(_, c, d, _) => {
                    path.cubic_to(at(c)[0], at(c)[1], at(d)[0], at(d)[1], to[0], to[1]);
                }
            }
            end = Some(to);
        }
        along += font.h_advance_unscaled(id);
    }
    let shift = match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * along * scale,
        Anchor::End => -along * scale,
    };
    path.finish()?.transform(Transform::from_translate(shift, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{AxisStyle, Series};

    fn drawn(size: Place, elements: &[Element]) -> Picture {
        render(&Drawing { title: String::new(), size, elements: elements.to_vec() }).unwrap()
    }

    /// Area in units of the drawing that black ink covers, by how dark the pixels are.
    fn inked(picture: &Picture) -> f64 {
        picture.rgb.chunks(3).map(|c| 1.0 - f64::from(c[0]) / 255.0).sum::<f64>() / f64::from(ZOOM * ZOOM)
    }

    #[test]
    fn elements_cover_their_area() {
        const BLACK: Ink = Ink::Colour([0; 3]);
        let line = |points: &[Place], dashed: bool| Element::Line {
            points: points.to_vec(),
            ink: BLACK,
            width: 2.0,
            opacity: 1.0,
            dashed,
        };
        let area = |element: Element| inked(&drawn([60.0, 50.0], &[element]));
        // Coverage is counted in sixteenths of a pixel along every edge.
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.02, "{a} and {b}");
        close(area(line(&[[10.0, 10.0], [40.0, 30.0]], false)), 2.0 * 30f64.hypot(20.0));
        // Two pieces at a right angle: the corner is round, a quarter of a disc of radius 1 instead of a square.
        close(area(line(&[[10.0, 10.0], [40.0, 10.0], [40.0, 40.0]], false)), 120.0 - 1.0 + 0.785);
        close(area(line(&[[10.0, 10.0], [40.0, 10.0]], true)), 2.0 * 15.0);
        // Small discs lack more of a ring of sixteenths than the limit: 2.3 % at a radius of 4.
        let disc = Element::Disc { centre: [20.3, 20.1], radius: 15.0, ink: BLACK, opacity: 1.0 };
        close(area(disc), std::f64::consts::PI * 225.0);
        let rectangle =
            |radius: f64| Element::Rectangle { corner: [5.25, 5.0], size: [20.0, 10.0], radius, ink: BLACK };
        close(area(rectangle(0.0)), 200.0);
        // Parabolas at the corners leave 5/6 of each square of 3 × 3.
        close(area(rectangle(3.0)), 200.0 - 36.0 / 6.0);
        // Half of it lies outside, and nothing breaks.
        let beside = Element::Rectangle { corner: [50.0, -5.0], size: [1e6, 10.0], radius: 0.0, ink: BLACK };
        close(area(beside), 50.0);
    }

    #[test]
    fn thousands_are_set_apart_by_nothing_but_room() {
        let ink = |text: &str| {
            let (text, anchor, ink) = (text.to_owned(), Anchor::Start, Ink::Text);
            let element = Element::Text { text, place: [5.0, 20.0], anchor, opacity: 1.0, turned: false, ink };
            let made = drawn([200.0, 30.0], &[element]);
            let right = (0..made.rgb.len() / 3).filter(|k| made.rgb[3 * k] < 128).map(|k| k % 400).max().unwrap();
            (inked(&made), right)
        };
        let [(together, end), (apart, later)] = ["11111", "11\u{202f}111"].map(ink);
        assert!((apart / together - 1.0).abs() < 0.03 && later > end, "{together} {apart} {end} {later}");
    }

    #[test]
    fn pictures_fill_their_place_and_turned_text_stands_upright() {
        let picture = Picture { width: 2, height: 1, rgb: vec![0, 0, 0, 255, 0, 0] };
        let made = drawn([10.0, 10.0], &[Element::Pixels { corner: [1.0, 2.0], size: [8.0, 4.0], picture }]);
        let pixel = |x: usize, y: usize| &made.rgb[3 * (20 * y + x)..][..3];
        assert_eq!(
            [pixel(2, 4), pixel(9, 11), pixel(10, 4), pixel(17, 11)],
            [[0; 3], [0; 3], [255, 0, 0], [255, 0, 0]]
        );
        assert_eq!([pixel(1, 4), pixel(18, 4), pixel(9, 12)], [[255; 3]; 3]);
        let text = |turned: bool| {
            let text = "llllllll".to_owned();
            let (anchor, ink) = (Anchor::Middle, Ink::Text);
            let element = Element::Text { text, place: [40.0, 40.0], anchor, opacity: 1.0, turned, ink };
            let made = drawn([80.0, 80.0], &[element]);
            let dark: Vec<usize> = (0..made.rgb.len() / 3).filter(|k| made.rgb[3 * k] < 128).collect();
            let extent = |of: fn(usize) -> usize| {
                dark.iter().map(|k| of(*k)).max().unwrap() - dark.iter().map(|k| of(*k)).min().unwrap()
            };
            [extent(|k| k % 160), extent(|k| k / 160)]
        };
        let [upright, turned] = [text(false), text(true)];
        assert!(upright[0] > 2 * upright[1] && turned == [upright[1], upright[0]], "{upright:?} {turned:?}");
    }

    #[test]
    fn lines_and_words_leave_ink() {
        let dark = |chart: &Chart| {
            let made = picture(chart).unwrap();
            assert_eq!((made.width, made.height), (1520, 940));
            let dark = |p: &[u8]| u32::from(p[0]) + u32::from(p[1]) < 200;
            // Left of the plot there is nothing but words.
            let words = made.rgb.chunks(3).enumerate().filter(|(k, p)| k % 1520 < 60 && dark(p)).count();
            (words, made.rgb.chunks(3).filter(|p| dark(p)).count())
        };
        let axes = |label: &str| [AxisStyle::linear("x", "mm"), AxisStyle::linear(label, "°")];
        let series = vec![Series { points: vec![[0.0, 0.0], [1.0, 2.0]], ..Series::default() }];
        let named = dark(&Chart::series("a", "A", "", axes("direction error"), series.clone()));
        let unnamed = dark(&Chart::series("a", "A", "", [AxisStyle::default(), AxisStyle::default()], series));
        assert!(named.0 > unnamed.0 + 300 && named.1 > 1000, "{named:?} {unnamed:?}");
    }
}

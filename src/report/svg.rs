//! The static picture of a chart: SVG in the text colour of wherever it stands, maps as an embedded PNG.

use super::chart::{AxisStyle, Chart, Content, PALETTE, Series, SeriesStyle, colours};
use super::number::figures;
use crate::formats::{ColourMap, Grid, Picture, base64};
use std::fmt::Write;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 470.0;
/// Plot area: left, top, right, bottom.
const AREA: [f64; 4] = [78.0, 16.0, 740.0, 410.0];

/// A data range mapped to a stretch of the picture.
struct Scale {
    low: f64,
    high: f64,
    log: bool,
    from: f64,
    to: f64,
}

impl Scale {
    fn new(values: impl Iterator<Item = f64>, axis: &AxisStyle, [from, to]: [f64; 2], zero: bool) -> Self {
        let usable = values.filter(|v| v.is_finite() && (!axis.log || *v > 0.0));
        let range =
            usable.fold(None, |r: Option<[f64; 2]>, v| Some(r.map_or([v, v], |[lo, hi]| [lo.min(v), hi.max(v)])));
        let [mut low, mut high] = range.unwrap_or(if axis.log { [1.0, 10.0] } else { [0.0, 1.0] });
        if axis.log {
            (low, high) = (low / 1.3, high * 1.3);
        } else {
            if zero {
                low = low.min(0.0);
            }
            let pad = if high > low { 0.04 * (high - low) } else { 0.5 * high.abs().max(1.0) };
            (low, high) = (if zero && low == 0.0 { 0.0 } else { low - pad }, high + pad);
        }
        Self { low, high, log: axis.log, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let part = if self.log {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + part * (self.to - self.from)
    }

    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let decades: Vec<f64> = (self.low.log10().ceil() as i32..=self.high.log10().floor() as i32)
                .map(|e| 10f64.powi(e))
                .collect();
            if decades.len() >= 3 {
                return decades;
            }
            let fine = (self.low.log10().floor() as i32..=self.high.log10().ceil() as i32)
                .flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(e)));
            return fine.filter(|t| (self.low..=self.high).contains(t)).collect();
        }
        let rough = (self.high - self.low) / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let first = (self.low / step).ceil() as i64;
        (first..).map(|k| k as f64 * step).take_while(|t| *t <= self.high).take(20).collect()
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The chart as an SVG document.
pub(super) fn render(chart: &Chart) -> String {
    let height = HEIGHT + more(chart);
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" font-family="system-ui, sans-serif" font-size="13" fill="currentColor"><title>{}</title>"#,
        escape(&chart.title)
    );
    match &chart.content {
        Content::Series(series) => series_chart(&mut svg, chart, series),
        Content::Bars { categories, layers, stacked } => bar_chart(&mut svg, chart, categories, layers, *stacked),
        Content::Map { grid, map } => map_chart(&mut svg, chart, grid, *map),
    }
    svg.push_str("</svg>\n");
    svg
}

fn axes(svg: &mut String, chart: &Chart, x: Option<&Scale>, y: &Scale, right: f64) {
    let [left, top, _, bottom] = AREA;
    for t in y.ticks() {
        let at = y.at(t);
        let _ = write!(
            svg,
            r#"<path d="M{left} {at:.1}H{right}" stroke="currentColor" stroke-opacity=".13"/><text x="{}" y="{:.1}" text-anchor="end" opacity=".75">{}</text>"#,
            left - 7.0,
            at + 4.0,
            figures(t, 3)
        );
    }
    for (t, at) in x.iter().flat_map(|x| x.ticks().into_iter().map(|t| (t, x.at(t)))) {
        let _ = write!(
            svg,
            r#"<path d="M{at:.1} {top}V{bottom}" stroke="currentColor" stroke-opacity=".13"/><text x="{at:.1}" y="{}" text-anchor="middle" opacity=".75">{}</text>"#,
            bottom + 19.0,
            figures(t, 3)
        );
    }
    let (cx, cy) = ((left + right) / 2.0, (top + bottom) / 2.0);
    let _ = write!(
        svg,
        r#"<text x="{cx}" y="{}" text-anchor="middle">{}</text><text transform="translate(17 {cy}) rotate(-90)" text-anchor="middle">{}</text>"#,
        HEIGHT - 16.0 + more(chart),
        escape(&chart.x.title()),
        escape(&chart.y.title())
    );
}

fn legend(svg: &mut String, names: &[(&str, &str)]) {
    let [_, top, right, _] = AREA;
    if names.len() < 2 {
        return;
    }
    for (k, (name, colour)) in names.iter().enumerate() {
        let y = top + 16.0 + 18.0 * k as f64;
        let _ = write!(
            svg,
            r#"<rect x="{}" y="{}" width="10" height="10" rx="2" fill="{colour}"/><text x="{}" y="{y}" text-anchor="end">{}</text>"#,
            right - 14.0,
            y - 9.0,
            right - 20.0,
            escape(name)
        );
    }
}

fn series_chart(svg: &mut String, chart: &Chart, series: &[Series]) {
    let [left, top, right, bottom] = AREA;
    let all = || series.iter().flat_map(|s| &s.points);
    let x = Scale::new(all().map(|p| p[0]), &chart.x, [left, right], false);
    let y = Scale::new(all().map(|p| p[1]), &chart.y, [bottom, top], false);
    axes(svg, chart, Some(&x), &y, right);
    let mut names = Vec::new();
    for (s, colour) in series.iter().zip(colours(series)) {
        if s.style != SeriesStyle::Faint && !s.name.is_empty() {
            names.push((s.name.as_str(), colour));
        }
        let at = |p: &[f64; 2]| -> Option<[f64; 2]> {
            let good = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
            (good(p[0], x.log) && good(p[1], y.log)).then(|| [x.at(p[0]), y.at(p[1])])
        };
        let points: Vec<[f64; 2]> = s.points.iter().filter_map(at).collect();
        if matches!(s.style, SeriesStyle::LineAndPoints | SeriesStyle::Line | SeriesStyle::Dashed) {
            let path: Vec<String> = points.iter().map(|p| format!("{:.1} {:.1}", p[0], p[1])).collect();
            let dash = if s.style == SeriesStyle::Dashed { r#" stroke-dasharray="5 5""# } else { "" };
            let _ = write!(
                svg,
                r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>"#,
                path.join(" ")
            );
        }
        for (p, e) in s.points.iter().zip(&s.errors).filter(|(p, _)| at(p).is_some()) {
            let (px, low, high) = (x.at(p[0]), y.at(p[1] - e), y.at(p[1] + e));
            let _ = write!(svg, r#"<path d="M{px:.1} {low:.1}V{high:.1}" stroke="{colour}"/>"#);
        }
        if matches!(s.style, SeriesStyle::LineAndPoints | SeriesStyle::Points | SeriesStyle::Faint) {
            let opacity = if s.style == SeriesStyle::Faint { 0.3 } else { 1.0 };
            for p in &points {
                let _ = write!(
                    svg,
                    r#"<circle cx="{:.1}" cy="{:.1}" r="4" fill="{colour}" opacity="{opacity}"/>"#,
                    p[0], p[1]
                );
            }
        }
    }
    legend(svg, &names);
}

/// Distance of lines of text.
const LINE: f64 = 15.0;

/// A name in lines that fit under a bar, broken at spaces; a letter takes about half the size of the type.
fn wrapped(name: &str, width: f64) -> Vec<String> {
    let most = ((width - 4.0) / 6.8).max(3.0) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in name.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// What the drawing needs below for names of several lines.
fn more(chart: &Chart) -> f64 {
    let Content::Bars { categories, .. } = &chart.content else { return 0.0 };
    let slot = (AREA[2] - AREA[0]) / categories.len().max(1) as f64;
    let lines = categories.iter().map(|c| wrapped(c, slot).len()).max().unwrap_or(1);
    LINE * lines.saturating_sub(1) as f64
}

fn bar_chart(svg: &mut String, chart: &Chart, categories: &[String], layers: &[(String, Vec<f64>)], stacked: bool) {
    let [left, top, right, bottom] = AREA;
    let heights = |c: usize| layers.iter().map(move |(_, v)| v.get(c).copied().unwrap_or(0.0).max(0.0));
    let tallest = |c: usize| if stacked { heights(c).sum::<f64>() } else { heights(c).fold(0.0, f64::max) };
    // Parts of a whole add up on a linear axis only; rivals may stand on a logarithmic one.
    let log = chart.y.log && !stacked;
    let axis = AxisStyle { log, ..chart.y.clone() };
    let y = if log {
        Scale::new((0..categories.len()).flat_map(heights), &axis, [bottom, top], false)
    } else {
        Scale::new((0..categories.len()).map(tallest), &axis, [bottom, top], true)
    };
    axes(svg, chart, None, &y, right);
    let slot = (right - left) / categories.len().max(1) as f64;
    let width = slot * 0.7 / if stacked { 1.0 } else { layers.len().max(1) as f64 };
    for (c, category) in categories.iter().enumerate() {
        let mut base = 0.0;
        for (k, value) in heights(c).enumerate() {
            let (low, high) = if log {
                (bottom, if value > 0.0 { y.at(value) } else { bottom })
            } else {
                (y.at(base), y.at(base + value))
            };
            let shift = if stacked { 0.0 } else { k as f64 * width };
            let _ = write!(
                svg,
                r#"<rect x="{:.1}" y="{high:.1}" width="{:.1}" height="{:.1}" fill="{}"/>"#,
                left + slot * (c as f64 + 0.15) + shift,
                width * 0.96,
                (low - high).max(0.0),
                PALETTE[k % PALETTE.len()]
            );
            base += if stacked { value } else { 0.0 };
        }
        for (k, line) in wrapped(category, slot).iter().enumerate() {
            let _ = write!(
                svg,
                r#"<text x="{:.1}" y="{}" text-anchor="middle" opacity=".75">{}</text>"#,
                left + slot * (c as f64 + 0.5),
                bottom + 19.0 + LINE * k as f64,
                escape(line)
            );
        }
    }
    let names: Vec<(&str, &str)> =
        layers.iter().enumerate().map(|(k, (n, _))| (n.as_str(), PALETTE[k % PALETTE.len()])).collect();
    legend(svg, &names);
}

fn map_chart(svg: &mut String, chart: &Chart, grid: &Grid, map: ColourMap) {
    let [left, top, right, bottom] = AREA;
    let right = right - 74.0;
    let plain =
        |range: [f64; 2], to: [f64; 2]| Scale { low: range[0], high: range[1], log: false, from: to[0], to: to[1] };
    let (x, y) = (plain(grid.axes[0].range, [left, right]), plain(grid.axes[1].range, [bottom, top]));
    if let Ok(png) = Picture::of_grid(grid, map, 1, 1.0).to_png() {
        let _ = write!(
            svg,
            r#"<image x="{left}" y="{top}" width="{}" height="{}" preserveAspectRatio="none" style="image-rendering:pixelated" href="data:image/png;base64,{}"/>"#,
            right - left,
            bottom - top,
            base64(&png)
        );
    }
    axes(svg, chart, Some(&x), &y, right);
    let [low, high] = grid.extremes().map_or([0.0, 1.0], |[lo, hi]| [lo.min(0.0), hi]);
    let steps = 64;
    for k in 0..steps {
        let [r, g, b] = map.at((k as f64 + 0.5) / f64::from(steps));
        let h = (bottom - top) / f64::from(steps);
        let _ = write!(
            svg,
            r#"<rect x="{}" y="{:.1}" width="14" height="{:.1}" fill="rgb({r},{g},{b})"/>"#,
            right + 12.0,
            bottom - (f64::from(k) + 1.0) * h,
            h + 0.3
        );
    }
    let bar = plain([low, high], [bottom, top]);
    for t in bar.ticks() {
        let _ = write!(
            svg,
            r#"<text x="{}" y="{:.1}" opacity=".75">{}</text>"#,
            right + 30.0,
            bar.at(t) + 4.0,
            figures(t, 3)
        );
    }
    let _ = write!(
        svg,
        r#"<text x="{}" y="{}" text-anchor="middle">{}</text>"#,
        right + 30.0,
        bottom + 19.0,
        escape(&grid.unit)
    );
}

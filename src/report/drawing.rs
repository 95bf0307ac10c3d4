//! A drawing as a list of elements: the static picture of a chart, before it becomes SVG or pixels.

use crate::formats::{Picture, base64};
use std::fmt::Write;

/// A point or a size in units of the drawing, y downward.
pub(super) type Place = [f64; 2];

/// Colour with which an element is filled or drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ink {
    /// The colour of the text around the drawing.
    Text,
    /// Red, green, blue.
    Colour([u8; 3]),
}

/// Which end of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// One piece of a drawing; opacities go from 0 to 1.
#[derive(Clone, Debug)]
pub(super) enum Element {
    /// Straight pieces from point to point.
    Line { points: Vec<Place>, ink: Ink, width: f64, opacity: f64, dashed: bool },
    /// An upright rectangle with rounded corners.
    Rectangle { corner: Place, size: Place, radius: f64, ink: Ink },
    /// A filled circle.
    Disc { centre: Place, radius: f64, ink: Ink, opacity: f64 },
    /// A line of text on its baseline; a turned one reads upward.
    Text { text: String, place: Place, anchor: Anchor, opacity: f64, turned: bool, ink: Ink },
    /// A picture whose pixels stay sharp.
    Pixels { corner: Place, size: Place, picture: Picture },
}

/// Shapes on a surface of some size, the first at the bottom.
#[derive(Clone, Debug)]
pub(super) struct Drawing {
    /// The alternative text for readers who cannot see it.
    pub(super) title: String,
    pub(super) size: Place,
    pub(super) elements: Vec<Element>,
}

/// Height of the type.
pub(super) const TYPE_SIZE: f64 = 13.0;

/// Lengths of a dash and of the gap behind it.
pub(super) const DASH: f64 = 5.0;

/// Returns the text with the four characters that XML reserves written as entities.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Writes a coordinate to a tenth of a unit, without a zero that says nothing.
fn in_tenths(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

impl Ink {
    /// Reads a colour written as `#rrggbb`; the colour of the text for anything else.
    pub(super) fn hex(text: &str) -> Self {
        let part = |k: usize| text.get(1 + 2 * k..3 + 2 * k).and_then(|h| u8::from_str_radix(h, 16).ok());
        match [part(0), part(1), part(2)] {
            [Some(r), Some(g), Some(b)] => Self::Colour([r, g, b]),
            // A colour that is none is drawn like the text, and stays visible.
            _ => Self::Text,
        }
    }

    /// Writes it as a CSS colour.
    fn svg(self) -> String {
        match self {
            Self::Text => "currentColor".into(),
            Self::Colour([r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

/// Writes ` name=".75"`, or nothing for an opacity of 1.
fn opacity_attribute(name: &str, opacity: f64) -> String {
    if opacity < 1.0 { format!(r#" {name}="{opacity}""#) } else { String::new() }
}

impl Drawing {
    /// Writes the drawing as an SVG document; text has the colour and the typeface of wherever it stands.
    pub(super) fn svg(&self) -> String {
        let [width, height] = self.size;
        let mut svg = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" font-family="system-ui, sans-serif" font-size="{TYPE_SIZE}" fill="currentColor"><title>{}</title>"#,
            escape(&self.title)
        );
        for element in &self.elements {
            // Writing to a string cannot fail.
            let _ = element.write_svg(&mut svg);
        }
        svg.push_str("</svg>\n");
        svg
    }
}

impl Element {
    /// Appends the element as SVG; a picture without pixels is left out.
    fn write_svg(&self, svg: &mut String) -> std::fmt::Result {
        match self {
            Self::Line { points, ink, width, opacity, dashed } => {
                let points: Vec<String> =
                    points.iter().map(|[x, y]| format!("{} {}", in_tenths(*x), in_tenths(*y))).collect();
                let dash = if *dashed { format!(r#" stroke-dasharray="{DASH} {DASH}""#) } else { String::new() };
                write!(
                    svg,
                    r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="{width}"{}{dash}/>"#,
                    points.join(" "),
                    ink.svg(),
                    opacity_attribute("stroke-opacity", *opacity)
                )
            }
            Self::Rectangle { corner: [x, y], size: [width, height], radius, ink } => {
                let round = if *radius > 0.0 { format!(r#" rx="{radius}""#) } else { String::new() };
                let [x, y, width, height] = [x, y, width, height].map(|v| in_tenths(*v));
                let fill = ink.svg();
                write!(svg, r#"<rect x="{x}" y="{y}" width="{width}" height="{height}"{round} fill="{fill}"/>"#)
            }
            Self::Disc { centre: [x, y], radius, ink, opacity } => {
                let opacity = opacity_attribute("opacity", *opacity);
                let [x, y, fill] = [in_tenths(*x), in_tenths(*y), ink.svg()];
                write!(svg, r#"<circle cx="{x}" cy="{y}" r="{radius}" fill="{fill}"{opacity}/>"#)
            }
            Self::Text { text, place: [x, y], anchor, opacity, turned, ink } => {
                let anchor = match anchor {
                    Anchor::Start => "",
                    Anchor::Middle => r#" text-anchor="middle""#,
                    Anchor::End => r#" text-anchor="end""#,
                };
                let [x, y] = [in_tenths(*x), in_tenths(*y)];
                let place = if *turned {
                    format!(r#"transform="translate({x} {y}) rotate(-90)""#)
                } else {
                    format!(r#"x="{x}" y="{y}""#)
                };
                let opacity = opacity_attribute("opacity", *opacity);
                // Text has the colour of what is around the drawing unless it says otherwise.
                let fill = if *ink == Ink::Text { String::new() } else { format!(r#" fill="{}""#, ink.svg()) };
                write!(svg, "<text {place}{anchor}{fill}{opacity}>{}</text>", escape(text))
            }
            Self::Pixels { corner: [x, y], size: [width, height], picture } => {
                // A picture without pixels leaves its place empty.
                let Ok(png) = picture.to_png() else { return Ok(()) };
                write!(
                    svg,
                    r#"<image x="{x}" y="{y}" width="{width}" height="{height}" preserveAspectRatio="none" style="image-rendering:pixelated" href="data:image/png;base64,{}"/>"#,
                    base64(&png)
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_escaped_and_opacities_written_only_where_they_count() {
        let text = |opacity: f64| Element::Text {
            text: "a < b & \"c\"".into(),
            place: [1.0, 2.25],
            anchor: Anchor::End,
            opacity,
            turned: false,
            ink: Ink::Text,
        };
        let drawing =
            |element: Element| Drawing { title: "<t>".into(), size: [3.0, 4.0], elements: vec![element] }.svg();
        assert!(drawing(text(1.0)).contains(
            r#"<title>&lt;t&gt;</title><text x="1" y="2.2" text-anchor="end">a &lt; b &amp; &quot;c&quot;</text>"#
        ));
        assert!(drawing(text(0.5)).contains(r#" opacity="0.5">"#));
    }

    #[test]
    fn colours_are_read_from_hex() {
        assert_eq!(Ink::hex("#d97706"), Ink::Colour([0xd9, 0x77, 0x06]));
        assert_eq!(Ink::hex("#d97706").svg(), "#d97706");
    }
}

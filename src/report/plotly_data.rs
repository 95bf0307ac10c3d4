//! Numbers, colours, light and texts as plotly.js takes them. Arrays go in as base64 of their bytes (`bdata`), a quarter of the size of
//! decimal text.

use super::number::with_unit;
use crate::formats::{Axis, ColourMap, base64};
use serde_json::{Value, json};

/// Returns what plotly says of a place on a map: a line for each axis.
pub(super) fn hover_place([a, b]: &[Axis; 2]) -> String {
    let [x, y] = [("%{x:.4g}", a), ("%{y:.4g}", b)].map(|(number, axis)| with_unit(number, &axis.unit));
    format!("{} {x}<br>{} {y}", a.label, b.label)
}

/// Packs numbers as plotly's typed array of single precision.
pub(super) fn singles(values: impl Iterator<Item = f32>) -> Value {
    let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    json!({"dtype": "f4", "bdata": base64(&bytes)})
}

/// Packs numbers as plotly's typed array of double precision.
pub(super) fn doubles(values: impl Iterator<Item = f64>) -> Value {
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    json!({"dtype": "f8", "bdata": base64(&bytes)})
}

/// Packs whole numbers as plotly's typed array of 32 bits.
pub(super) fn indices(values: impl Iterator<Item = u32>) -> Value {
    let bytes: Vec<u8> = values.flat_map(u32::to_le_bytes).collect();
    json!({"dtype": "u4", "bdata": base64(&bytes)})
}

/// Returns the map as plotly's list of 17 stops.
pub(super) fn colour_scale(map: ColourMap) -> Value {
    let stop = |k: u32| {
        let [r, g, b] = map.colour(f64::from(k) / 16.0);
        json!([f64::from(k) / 16.0, format!("rgb({r},{g},{b})")])
    };
    (0..=16).map(stop).collect()
}

/// Writes red, green and blue, from 0 to 1, as a CSS colour.
pub(super) fn css([r, g, b]: [f64; 3]) -> String {
    let byte = |c: f64| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
    format!("rgb({},{},{})", byte(r), byte(g), byte(b))
}

/// Returns how a surface is lit. Ambient and diffuse light of more than 1 together would make bright parts white on every side. plotly
/// takes triangles whose doubled area, squared, is below its epsilon as having no normal: narrow ones of a flat face stood black in it.
pub(super) fn lighting(ambient: f64, diffuse: f64, specular: f64) -> Value {
    json!({"ambient": ambient, "diffuse": diffuse, "specular": specular, "roughness": 0.6, "facenormalsepsilon": 0.0})
}

/// Returns a text as plotly shows it letter by letter: names of parts and receivers are data, and it reads them as HTML.
pub(super) fn plain(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns plotly's name of a side of a point, right and down.
pub(super) fn text_position([right, down]: [i8; 2]) -> String {
    let [row, column] =
        [["top", "middle", "bottom"][(down + 1) as usize], ["left", "center", "right"][(right + 1) as usize]];
    format!("{row} {column}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_on_its_side() {
        assert_eq!([[1, -1], [-1, 0], [0, 1]].map(text_position), ["top right", "middle left", "bottom center"]);
    }
}

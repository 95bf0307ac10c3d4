//! What the eye sees of a receiver that counts CIE X, Y, Z: a picture in the colours of a screen.

use super::Chart;
use super::framing::lit_part;
use crate::formats::{Grid, Picture, file_stem};
use crate::optics::{linear_srgb, srgb_byte};
use crate::text::figures;

/// Least pixels on the longer side of a picture that is a file.
const FILE_PIXELS: usize = 800;

/// Cells as pixels, and the exposure that they were given.
struct Exposed {
    picture: Picture,
    /// Y of the brightest white that the picture can show.
    white: f64,
    unit: String,
}

/// Makes the colours of a grid with layers X, Y and Z, each cell `zoom` pixels wide; `None` for another one, and where all is dark.
///
/// One exposure for all cells: the largest of red, green and blue over the picture is full, so that no cell is brighter than the screen.
/// Colours that a screen has not are cut to the nearest value of each part.
fn expose(grid: &Grid, zoom: usize) -> Option<Exposed> {
    let layer = |name: &str| grid.layers.iter().find(|l| l.quantity == name);
    let (x, y, z) = (layer("X")?, layer("Y")?, layer("Z")?);
    let linear: Vec<[f64; 3]> =
        (0..grid.values.len()).map(|k| linear_srgb([x.values[k], y.values[k], z.values[k]])).collect();
    // `max` passes over cells that are none, as beyond the rim of a disc: NaN.
    let white = linear.iter().flatten().copied().fold(0.0, f64::max);
    if white == 0.0 {
        return None;
    }
    let columns = grid.axes[0].cells;
    let mut rgb = Vec::with_capacity(3 * linear.len() * zoom * zoom);
    // Pictures start at the top, the second axis at the bottom.
    for row in linear.chunks(columns).rev() {
        let pixels: Vec<u8> = (row.iter())
            .flat_map(|cell| {
                let byte = |part: f64| if part.is_nan() { NO_CELL } else { srgb_byte(part / white) };
                std::iter::repeat_n(cell.map(byte), zoom).flatten()
            })
            .collect();
        (0..zoom).for_each(|_| rgb.extend(&pixels));
    }
    let (width, height) = ((columns * zoom) as u32, (grid.axes[1].cells * zoom) as u32);
    Some(Exposed { picture: Picture { width, height, rgb }, white, unit: y.unit.clone() })
}

/// Grey where there is no cell, as in maps.
const NO_CELL: u8 = 128;

/// Returns the picture of all cells for a file; `None` without layers X, Y and Z, and where all is dark.
pub fn colour_picture(grid: &Grid) -> Option<Picture> {
    let longer = grid.axes[0].cells.max(grid.axes[1].cells).max(1);
    expose(grid, FILE_PIXELS.div_ceil(longer)).map(|exposed| exposed.picture)
}

/// Returns the picture as a chart, framed around its light; `None` without layers X, Y and Z, and where all is dark.
pub(super) fn colour_chart(grid: &Grid) -> Option<Chart> {
    let framed = lit_part(grid);
    let grid = framed.as_ref().unwrap_or(grid);
    let Exposed { picture, white, unit } = expose(grid, 1)?;
    let caption = format!(
        "The colours that a screen shows (sRGB, white is D65), all cells exposed alike, so that the brightest part of any is full: {} {unit} \
         of white. Colours beyond those of a screen are cut.",
        figures(white, 3)
    );
    let title = format!("{}: colours", grid.name);
    Some(Chart::picture(
        &format!("{}-colours", file_stem(&grid.name)),
        &title,
        &caption,
        grid.axes.clone(),
        picture,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Axis, Layer};

    /// Four cells: D65 white, half of it, equal-energy light (reddish on such a screen), nothing, from the lower left.
    #[test]
    fn cells_have_their_colours_where_they_are() {
        let axis = |cells| Axis { label: "x".into(), unit: "mm".into(), range: [0.0, 1.0], cells };
        let layer = |name: &str, values: [f64; 4]| Layer {
            quantity: name.into(),
            unit: "lx".into(),
            values: values.to_vec(),
            error: vec![0.0; 4],
            geometric: None,
        };
        let white = [0.3127 / 0.3290, 1.0, 0.3583 / 0.3290].map(|part| 40.0 * part);
        let cells = [white, white.map(|part| 0.5 * part), [10.0; 3], [0.0; 3]];
        let layers = [("X", 0), ("Y", 1), ("Z", 2)].map(|(name, k)| layer(name, cells.map(|c| c[k])));
        let grid = Grid {
            name: "wall".into(),
            quantity: "irradiance".into(),
            unit: "W/m2".into(),
            axes: [axis(2), axis(2)],
            values: vec![1.0; 4],
            error: None,
            geometric: None,
            layers: layers.into(),
        };
        let Exposed { picture, white, .. } = expose(&grid, 1).unwrap();
        assert!((white / 40.0 - 1.0).abs() < 2e-3, "{white}");
        let pixel = |k: usize| [0, 1, 2].map(|c| i32::from(picture.rgb[3 * k + c]));
        // The top row first: equal energy and nothing, then white and half of it.
        let near =
            |found: [i32; 3], expected: [i32; 3]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1);
        assert!(near(pixel(2), [255; 3]) && near(pixel(3), [188; 3]), "{:?}", picture.rgb);
        assert!(near(pixel(1), [0; 3]) && pixel(0)[0] > pixel(0)[1] && pixel(0)[1] > pixel(0)[2], "{:?}", pixel(0));
        assert!(expose(&Grid { layers: Vec::new(), ..grid }, 1).is_none());
    }
}

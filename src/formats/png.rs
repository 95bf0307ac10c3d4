//! Pictures of 8-bit colours: grids through a colour map, and PNG files.

use super::{Error, ErrorKind, Grid, write_atomic};
use std::io;
use std::path::Path;

/// How values become colours: perceptually even, readable in print and with colour blindness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// Black through red to pale yellow: light on a screen.
    #[default]
    Inferno,
    /// Blue to yellow: errors and other quantities without a sign.
    Viridis,
}

impl ColourMap {
    /// The sRGB colour at `x` in `[0, 1]`; values outside are clamped, NaN is grey.
    pub fn colour(self, x: f64) -> [u8; 3] {
        // NaN passes through `clamp`.
        if x.is_nan() {
            return [128; 3];
        }
        let map = match self {
            Self::Inferno => colorous::INFERNO,
            Self::Viridis => colorous::VIRIDIS,
        };
        map.eval_continuous(x.clamp(0.0, 1.0)).into_array()
    }
}

/// A picture of 8-bit red, green, blue, the top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Draws a grid as a picture, one cell `zoom` pixels wide and high, the second axis upward, colours from 0 (or the smallest value when
    /// negative) to the largest, NaN and cells that have no value in grey; `exponent` below 1 lifts the dark parts.
    pub fn of_grid(grid: &Grid, map: ColourMap, zoom: u32, exponent: f64) -> Self {
        let (nx, ny) = (grid.axes[0].cells, grid.axes[1].cells);
        let [low, high] = grid.colour_range();
        let zoom = zoom.max(1) as usize;
        let mut rgb = Vec::with_capacity(3 * nx * ny * zoom * zoom);
        // Pictures start at the top, the second axis at the bottom.
        let mut last: Option<(u64, [u8; 3])> = None;
        for j in (0..ny).rev() {
            let start = rgb.len();
            for i in 0..nx {
                let value = grid.values.get(j * nx + i).copied().unwrap_or(f64::NAN);
                // Most cells are as dark as the one before.
                let colour = match last {
                    Some((bits, colour)) if bits == value.to_bits() => colour,
                    _ => map.colour(((value - low) / (high - low)).powf(exponent)),
                };
                last = Some((value.to_bits(), colour));
                (0..zoom).for_each(|_| rgb.extend_from_slice(&colour));
            }
            let row = start..rgb.len();
            (1..zoom).for_each(|_| rgb.extend_from_within(row.clone()));
        }
        Self { width: (nx * zoom) as u32, height: (ny * zoom) as u32, rgb }
    }

    /// Encodes the picture as the bytes of a PNG file.
    ///
    /// # Errors
    /// When the picture has no pixels or its bytes do not fit its size.
    pub fn to_png(&self) -> io::Result<Vec<u8>> {
        if self.rgb.len() != 3 * self.width as usize * self.height as usize || self.rgb.is_empty() {
            return Err(io::Error::other("a picture without pixels"));
        }
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        // A report waits for its pictures: speed counts more than size.
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        let mut writer = encoder.write_header().map_err(io::Error::other)?;
        writer.write_image_data(&self.rgb).map_err(io::Error::other)?;
        writer.finish().map_err(io::Error::other)?;
        Ok(bytes)
    }
}

/// Writes a picture as PNG.
///
/// # Errors
/// When the picture has no pixels and when the file cannot be written.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), Error> {
    let bytes = picture.to_png().map_err(|e| Error::new(path, ErrorKind::Write(e)))?;
    write_atomic(path, |w| w.write_all(&bytes))
}

/// Writes a grid as a PNG of at least 800 pixels on its longer side, the second axis upward, in [`ColourMap::Inferno`], linear from 0
/// (or the smallest value when negative) to the largest.
///
/// # Errors
/// When the grid is empty, when values do not fill it and when the file cannot be written.
pub fn write_grid_png(path: &Path, grid: &Grid) -> Result<(), Error> {
    grid.check_filled(path)?;
    let cells = grid.axes[0].cells.max(grid.axes[1].cells).max(1);
    let too_many = || {
        ErrorKind::Malformed(format!("a grid of {cells} cells along one side has more than a picture has pixels"))
    };
    let longer = u32::try_from(cells).map_err(|_| Error::new(path, too_many()))?;
    write_png(path, &Picture::of_grid(grid, ColourMap::Inferno, 800u32.div_ceil(longer), 1.0))
}

//! Triangles and lines on a picture with a depth buffer, four samples a pixel, drawn band by band: a band stays in the processor's cache,
//! where the samples of the whole picture (61 MB) would be fetched from memory for every facet.

use crate::formats::Picture;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Width of the picture, pixels.
const WIDTH: usize = 1200;
/// Height of the picture, pixels.
const HEIGHT: usize = 800;
/// Samples a pixel in each direction.
const FINE: usize = 2;
/// Rows of samples that are drawn together, whole pixels: 614 kB, less than the second cache of a core.
const BAND_ROWS: usize = 16;

/// What is drawn, with corners in samples and their depth, in the order in which it was added.
#[derive(Default)]
pub(super) struct Canvas {
    primitives: Vec<Primitive>,
}

/// One thing on the canvas.
struct Primitive {
    shape: PrimitiveShape,
    colour: [f32; 3],
    /// One above 0.5 hides what is behind.
    opacity: f32,
}

enum PrimitiveShape {
    Triangle([Vec3; 3]),
    Line {
        ends: [Vec3; 2],
        /// Half of its width, samples.
        half_width: f32,
    },
}

impl Canvas {
    /// Number of samples along the width and the height.
    pub(super) const SAMPLES: [usize; 2] = [WIDTH * FINE, HEIGHT * FINE];

    /// Adds a triangle, its corners in samples with their depth as z; one seen from its edge covers no sample.
    pub(super) fn triangle(&mut self, corners: [Vec3; 3], colour: [f32; 3], opacity: f32) {
        self.primitives.push(Primitive { shape: PrimitiveShape::Triangle(corners), colour, opacity });
    }

    /// Adds a line between ends in samples, with their depth as z, as squares of its width, pixels.
    pub(super) fn line(&mut self, ends: [Vec3; 2], width: f32, colour: [f32; 3], opacity: f32) {
        let half_width = (width * FINE as f32 / 2.0).max(0.5);
        self.primitives.push(Primitive { shape: PrimitiveShape::Line { ends, half_width }, colour, opacity });
    }

    /// Draws everything and returns the picture, of which each pixel is the mean of its samples.
    pub(super) fn picture(&self) -> Picture {
        let bands = Self::SAMPLES[1].div_ceil(BAND_ROWS);
        let mut primitives_of_band = vec![Vec::new(); bands];
        for (k, primitive) in (0u32..).zip(&self.primitives) {
            let rows = primitive.rows();
            if !rows.is_empty() {
                for band in &mut primitives_of_band[rows.start / BAND_ROWS..=(rows.end - 1) / BAND_ROWS] {
                    band.push(k);
                }
            }
        }
        let mut rgb = Vec::with_capacity(3 * WIDTH * HEIGHT);
        let mut band = Band::default();
        for (i, own) in primitives_of_band.iter().enumerate() {
            band.clear(i * BAND_ROWS);
            for &k in own {
                band.draw(&self.primitives[k as usize]);
            }
            band.append_pixels(&mut rgb);
        }
        Picture { width: WIDTH as u32, height: HEIGHT as u32, rgb }
    }
}

impl Primitive {
    /// Returns the rows of samples outside of which it draws nothing.
    fn rows(&self) -> Range<usize> {
        let height = Canvas::SAMPLES[1];
        match self.shape {
            PrimitiveShape::Triangle([a, b, c]) => {
                cells_between(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), height)
            }
            PrimitiveShape::Line { ends: [a, b], half_width } => {
                let reach = half_width + row_rounding(a, b);
                cells_between(a.y.min(b.y) - reach, a.y.max(b.y) + reach, height)
            }
        }
    }
}

/// Returns the samples, of `n`, that an interval touches: none where it ends before them.
fn cells_between(low: f32, high: f32, n: usize) -> Range<usize> {
    (low.max(0.0) as usize)..((high.max(-1.0) + 1.0) as usize).min(n)
}

/// Returns how far, samples, a point between two others may be from its row by rounding, and one for the rounding to whole samples.
fn row_rounding(a: Vec3, b: Vec3) -> f32 {
    1.0 + 8.0 * f32::EPSILON * a.y.abs().max(b.y.abs())
}

/// Some rows of samples with the depth of what they show; colours apart from each other, so that several samples are blended at once.
#[derive(Default)]
struct Band {
    /// The first row.
    top: usize,
    rgb: [Vec<f32>; 3],
    depth: Vec<f32>,
}

impl Band {
    /// Makes it background alone, with nothing in front of it, from the row `top` on.
    fn clear(&mut self, top: usize) {
        let [width, height] = Canvas::SAMPLES;
        self.top = top;
        let rows = top..(top + BAND_ROWS).min(height);
        // That of paper, on which a dark picture would be a block of ink.
        for plane in &mut self.rgb {
            plane.clear();
            plane.resize(rows.len() * width, 1.0);
        }
        self.depth.clear();
        self.depth.resize(rows.len() * width, f32::INFINITY);
    }

    /// Draws what of a primitive lies in this band.
    fn draw(&mut self, primitive: &Primitive) {
        match primitive.shape {
            PrimitiveShape::Triangle(corners) => self.triangle(corners, primitive),
            PrimitiveShape::Line { ends, half_width } => self.line(ends, half_width, primitive),
        }
    }

    /// Returns those of some rows of samples, counted from the top of the picture, that lie in this band.
    fn own_rows(&self, rows: Range<usize>) -> Range<usize> {
        rows.start.max(self.top)..rows.end.min(self.top + self.depth.len() / Canvas::SAMPLES[0])
    }

    /// Draws the rows of a triangle that lie in this band.
    fn triangle(&mut self, [a, b, c]: [Vec3; 3], primitive: &Primitive) {
        let [p, q, r] = [a.truncate(), b.truncate(), c.truncate()];
        let area = (q - p).perp_dot(r - p);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let [width, _] = Canvas::SAMPLES;
        let columns = cells_between(low.x, high.x, width);
        // Two barycentric coordinates and the depth change by the same step from each sample of a row to the next.
        let [u_step, v_step] = [(r.y - p.y) / area, (p.y - q.y) / area];
        let [to_b, to_c] = [b.z - a.z, c.z - a.z];
        for y in self.own_rows(primitive.rows()) {
            let s = Vec2::new(columns.start as f32 + 0.5, y as f32 + 0.5);
            let (u, v) = ((s - p).perp_dot(r - p) / area, (q - p).perp_dot(s - p) / area);
            let inside =
                span_of_positive([[u, u_step], [v, v_step], [1.0 - u - v, -u_step - v_step]], columns.len());
            let first = inside.start;
            let depth = |k: usize| {
                // Through i32, which vectors convert: columns are few.
                let k = (first + k) as i32 as f32;
                a.z + (u + k * u_step) * to_b + (v + k * v_step) * to_c
            };
            self.blend(y, columns.start + inside.start..columns.start + inside.end, depth, primitive);
        }
    }

    /// Draws what of a line lies in this band: a square at each step of a sample.
    fn line(&mut self, [a, b]: [Vec3; 2], half: f32, primitive: &Primitive) {
        let [width, height] = Canvas::SAMPLES;
        // What runs far out of the picture is not followed for ever.
        let steps = (b - a).truncate().abs().max_element().ceil().clamp(1.0, 8000.0) as usize;
        let span = |c: f32, n: usize| {
            ((c - half).max(0.0).round() as usize)..((c + half).max(0.0).round() as usize).min(n)
        };
        for k in self.steps_inside([a, b], half, steps) {
            let p = a.lerp(b, k as f32 / steps as f32);
            for y in self.own_rows(span(p.y, height)) {
                self.blend(y, span(p.x, width), |_| p.z, primitive);
            }
        }
    }

    /// Returns those of the `steps` + 1 even steps of a line whose squares may reach into this band.
    fn steps_inside(&self, [a, b]: [Vec3; 2], half: f32, steps: usize) -> Range<usize> {
        let rows = self.own_rows(0..Canvas::SAMPLES[1]);
        let reach = half + row_rounding(a, b);
        let a_step = (b.y - a.y) / steps as f32;
        let [from, to] = [rows.start as f32 - reach - a.y, rows.end as f32 + reach - a.y].map(|y| y / a_step);
        // A level line, or one that is no number, is followed as a whole.
        if !(from.is_finite() && to.is_finite()) {
            return 0..steps + 1;
        }
        from.min(to).floor().max(0.0) as usize..(from.max(to).ceil().max(-1.0) as usize + 1).min(steps + 1)
    }

    /// Blends a primitive's colour into the samples of row `y` in some columns, where nothing nearer stands, and keeps its depth there if
    /// it hides what is behind; `depth` returns that at the k-th of them.
    #[inline(always)]
    fn blend(&mut self, y: usize, columns: Range<usize>, depth: impl Fn(usize) -> f32, primitive: &Primitive) {
        if columns.is_empty() {
            return;
        }
        let row = (y - self.top) * Canvas::SAMPLES[0];
        let samples = row + columns.start..row + columns.end;
        let [red, green, blue] = self.rgb.each_mut().map(|plane| &mut plane[samples.clone()]);
        let depths = &mut self.depth[samples.clone()];
        let ([r, g, b], opacity) = (primitive.colour, primitive.opacity);
        // Glass hides nothing behind it.
        let hides = opacity > 0.5;
        let blended = |old: f32, new: f32, near: bool| if near { old + (new - old) * opacity } else { old };
        for (k, (((red, green), blue), old_depth)) in red.iter_mut().zip(green).zip(blue).zip(depths).enumerate() {
            let depth = depth(k);
            // At equal depth the later one wins, as lines along facets must show.
            let near = depth <= *old_depth;
            *red = blended(*red, r, near);
            *green = blended(*green, g, near);
            *blue = blended(*blue, b, near);
            *old_depth = if near & hides { depth } else { *old_depth };
        }
    }

    /// Appends the band's pixels, the means of their samples.
    fn append_pixels(&self, rgb: &mut Vec<u8>) {
        let [width, _] = Canvas::SAMPLES;
        for first in (0..self.depth.len()).step_by(FINE * width) {
            let start = rgb.len();
            rgb.resize(start + 3 * WIDTH, 0);
            for (channel, plane) in self.rgb.iter().enumerate() {
                let (upper, lower) = plane[first..first + FINE * width].split_at(width);
                let pixels = rgb[start + channel..].iter_mut().step_by(3);
                for ((pixel, upper), lower) in
                    pixels.zip(upper.as_chunks::<FINE>().0).zip(lower.as_chunks::<FINE>().0)
                {
                    let sum: f32 = upper.iter().chain(lower).sum();
                    *pixel = rounded_byte(sum / (FINE * FINE) as f32 * 255.0);
                }
            }
        }
    }
}

/// Rounds to the nearest whole number from 0 to 255, halves up, without the call that `f32::round` is.
fn rounded_byte(x: f32) -> u8 {
    let x = x.clamp(0.0, 255.0);
    let whole = x as i32;
    (whole + i32::from(x - whole as f32 >= 0.5)) as u8
}

/// Returns the indices below `n` at which all of some linear functions, each given by its value at 0 and its step, are positive or zero.
fn span_of_positive<const N: usize>(functions: [[f32; 2]; N], n: usize) -> Range<usize> {
    let (mut first, mut last) = (0.0f32, n as f32 - 1.0);
    for [value, step] in functions {
        let root = -value / step;
        if step > 0.0 {
            first = first.max(root.ceil());
        } else if step < 0.0 {
            last = last.min(root.floor());
        } else if value < 0.0 {
            return 0..0;
        }
    }
    // A sum below zero becomes zero: an empty range.
    first as usize..(last + 1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles tile a square without a gap and do not leave it; of two, the nearer is seen.
    #[test]
    fn triangles_cover_their_samples_and_no_others() {
        let mut canvas = Canvas::default();
        let empty = canvas.picture().rgb;
        let corners = [[100.2, 50.7], [140.2, 50.7], [140.2, 90.7], [100.2, 90.7]];
        let [a, b, c, d] = corners.map(|[x, y]| Vec3::new(x, y, 1.0));
        for (z, colour) in [(0.0, [1.0, 0.0, 0.0]), (2.0, [0.0, 1.0, 0.0])] {
            for triangle in [[a, b, c], [c, a, d]] {
                canvas.triangle(triangle.map(|p| p.with_z(z)), colour, 1.0);
            }
        }
        // The samples 100 to 139 and 51 to 90: 20 pixels in x, and in y 19 and two that are half covered, across four bands.
        let picture = canvas.picture().rgb;
        let red = picture.as_chunks::<3>().0.iter().filter(|&&p| p == [255, 0, 0]).count();
        let changed =
            picture.as_chunks::<3>().0.iter().zip(empty.as_chunks::<3>().0).filter(|(p, e)| p != e).count();
        assert_eq!([red, changed], [20 * 19, 20 * 21]);
    }

    /// A line one sample wide marks one sample a row, whatever bands it crosses, and nothing beyond its ends.
    #[test]
    fn lines_are_whole_across_bands() {
        let mut canvas = Canvas::default();
        canvas.line([Vec3::new(100.5, 40.5, 0.0), Vec3::new(160.5, 100.5, 0.0)], 0.0, [1.0; 3], 1.0);
        let mut samples = Vec::new();
        let mut band = Band::default();
        for top in (0..Canvas::SAMPLES[1]).step_by(BAND_ROWS) {
            band.clear(top);
            band.draw(&canvas.primitives[0]);
            let drawn = band.depth.iter().enumerate().filter(|(_, d)| d.is_finite());
            samples.extend(drawn.map(|(k, _)| [k % Canvas::SAMPLES[0], top + k / Canvas::SAMPLES[0]]));
        }
        assert_eq!(samples, (0..=60).map(|k| [100 + k, 40 + k]).collect::<Vec<_>>());
    }

    /// It is printed with the report, also with one that was read in the dark.
    #[test]
    fn the_background_is_that_of_paper() {
        assert!(Canvas::default().picture().rgb.iter().all(|byte| *byte == 255));
    }

    #[test]
    fn bytes_round_as_numbers_do() {
        for k in 0..=255_000u32 {
            let x = k as f32 / 1000.0;
            assert_eq!(rounded_byte(x), x.round() as u8, "{x}");
        }
        assert_eq!([rounded_byte(0.499_999_97), rounded_byte(-3.0), rounded_byte(1e9)], [0, 0, 255]);
    }

    #[test]
    fn spans_of_linear_functions() {
        assert_eq!(span_of_positive([[-2.0, 1.0], [5.0, -1.0]], 10), 2..6);
        assert_eq!(span_of_positive([[-2.5, 1.0], [5.5, -1.0]], 5), 3..5);
        assert!(span_of_positive([[-3.0, 1.0], [1.0, -1.0]], 10).is_empty());
        assert!(span_of_positive([[-1.0, 0.0]], 10).is_empty());
        assert_eq!(span_of_positive([[1.0, 0.0]], 10), 0..10);
    }
}

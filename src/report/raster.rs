//! The static picture of a 3-D view: parallel projection, depth buffer, light from over the left shoulder, four samples a pixel.

use super::view::{Shape, View};
use crate::formats::Picture;
use glam::{Vec2, Vec3};
use std::ops::Range;

/// Width of the picture, pixels.
const WIDTH: usize = 1200;
/// Height of the picture, pixels.
const HEIGHT: usize = 800;
/// Samples a pixel in each direction.
const FINE: usize = 2;

/// Samples of a picture with the depth of what they show.
struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<[f32; 3]>,
    depth: Vec<f32>,
}

impl Canvas {
    /// Makes a canvas of background alone, with nothing in front of it.
    fn new() -> Self {
        let (width, height) = (WIDTH * FINE, HEIGHT * FINE);
        // A background that reads on a white and on a dark page.
        let mut rgb = Vec::with_capacity(width * height);
        for y in 0..height {
            let shade = y as f32 / height as f32;
            rgb.resize((y + 1) * width, [0.10 + 0.05 * shade, 0.11 + 0.05 * shade, 0.14 + 0.06 * shade]);
        }
        Self { width, height, rgb, depth: vec![f32::INFINITY; width * height] }
    }

    /// Blends a colour into the sample at `x`, `y`, unless something nearer stands there. An opacity above 0.5 hides what is behind.
    fn blend_sample(&mut self, x: usize, y: usize, depth: f32, colour: [f32; 3], opacity: f32) {
        let at = y * self.width + x;
        // At equal depth the later one wins, as lines along facets must show.
        if depth <= self.depth[at] {
            for (old, new) in self.rgb[at].iter_mut().zip(colour) {
                *old += (new - *old) * opacity;
            }
            // Glass hides nothing behind it.
            if opacity > 0.5 {
                self.depth[at] = depth;
            }
        }
    }

    /// Draws a triangle whose corners are in samples, with their depth, where nothing nearer stands; nothing of one seen from its edge.
    fn triangle(&mut self, [a, b, c]: [Vec3; 3], colour: [f32; 3], opacity: f32) {
        let [p, q, r] = [a.truncate(), b.truncate(), c.truncate()];
        let area = (q - p).perp_dot(r - p);
        // A facet seen from its edge covers no sample.
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        // A triangle far outside has an empty range: both ends are cut to the picture.
        let range = |lo: f32, hi: f32, n: usize| (lo.max(0.0) as usize)..((hi.max(-1.0) + 1.0) as usize).min(n);
        let columns = range(low.x, high.x, self.width);
        // Two barycentric coordinates and the depth change by the same step from each sample of a row to the next.
        let [u_step, v_step] = [(r.y - p.y) / area, (p.y - q.y) / area];
        let [to_b, to_c] = [b.z - a.z, c.z - a.z];
        for y in range(low.y, high.y, self.height) {
            let s = Vec2::new(columns.start as f32 + 0.5, y as f32 + 0.5);
            let (u, v) = ((s - p).perp_dot(r - p) / area, (q - p).perp_dot(s - p) / area);
            let inside =
                span_of_positive([[u, u_step], [v, v_step], [1.0 - u - v, -u_step - v_step]], columns.len());
            for k in inside {
                let (u, v) = (u + k as f32 * u_step, v + k as f32 * v_step);
                self.blend_sample(columns.start + k, y, a.z + u * to_b + v * to_c, colour, opacity);
            }
        }
    }

    /// Draws a line between points in samples, as squares of its width in pixels.
    fn line(&mut self, a: Vec3, b: Vec3, width: f32, colour: [f32; 3], opacity: f32) {
        // A step a pixel; what runs far out of the picture is not followed for ever.
        let steps = (b - a).truncate().abs().max_element().ceil().clamp(1.0, 8000.0) as usize;
        let half = (width * FINE as f32 / 2.0).max(0.5);
        for k in 0..=steps {
            let p = a.lerp(b, k as f32 / steps as f32);
            let span = |c: f32, n: usize| {
                ((c - half).max(0.0).round() as usize)..((c + half).max(0.0).round() as usize).min(n)
            };
            for y in span(p.y, self.height) {
                for x in span(p.x, self.width) {
                    self.blend_sample(x, y, p.z, colour, opacity);
                }
            }
        }
    }

    /// Returns the picture, of which each pixel is the mean of its samples.
    fn picture(&self) -> Picture {
        let mut rgb = Vec::with_capacity(3 * WIDTH * HEIGHT);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let mut sum = [0f32; 3];
                for k in 0..FINE * FINE {
                    let sample = self.rgb[(y * FINE + k / FINE) * self.width + x * FINE + k % FINE];
                    sum.iter_mut().zip(sample).for_each(|(s, c)| *s += c);
                }
                rgb.extend(sum.map(|s| (s / (FINE * FINE) as f32 * 255.0).clamp(0.0, 255.0).round() as u8));
            }
        }
        Picture { width: WIDTH as u32, height: HEIGHT as u32, rgb }
    }
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

/// Where the camera stands, as a direction towards it: the same as that of the interactive view.
pub(super) const EYE: [f64; 3] = [0.75, -1.25, 0.85];

/// A view of a single point is drawn as if it reached so far, mm.
const LEAST_REACH_MM: f32 = 1e-6;

/// Draws the view as a picture of 1200 × 800 pixels; the background alone where there is nothing to show.
pub(super) fn render(view: &View) -> Picture {
    let mut canvas = Canvas::new();
    let Some([low, high]) = view.bounds().map(|b| b.map(Vec3::from)) else { return canvas.picture() };
    let back = Vec3::from(EYE.map(|x| x as f32)).normalize();
    // Z is up in the picture as it is in CAD; the eye is never straight above.
    let right = Vec3::Z.cross(back).normalize();
    let up = back.cross(right);
    // The eight corners of the box decide the scale, so that nothing is cut off.
    let middle = (low + high) * 0.5;
    let mut reach = Vec2::splat(LEAST_REACH_MM);
    for k in 0..8 {
        let corner =
            Vec3::new([low.x, high.x][k & 1], [low.y, high.y][k >> 1 & 1], [low.z, high.z][k >> 2]) - middle;
        reach = reach.max(Vec2::new(corner.dot(right), corner.dot(up)).abs());
    }
    // Twice 0.46: a margin of 4 % on each side.
    let scale = (0.46 * canvas.width as f32 / reach.x).min(0.46 * canvas.height as f32 / reach.y);
    let (cx, cy) = (canvas.width as f32 / 2.0, canvas.height as f32 / 2.0);
    let project = |p: &[f32; 3]| {
        let d = Vec3::from(*p) - middle;
        Vec3::new(cx + scale * d.dot(right), cy - scale * d.dot(up), -scale * d.dot(back))
    };
    let light = (back + 0.6 * up - 0.4 * right).normalize();
    let [lo, hi] = common_range(&view.shapes);
    // What is clear comes last, so that what lies behind it is there to be seen through it.
    let clear = |s: &Shape| matches!(s, Shape::Surface { opacity, .. } if *opacity < 1.0);
    let (behind, before): (Vec<&Shape>, Vec<&Shape>) = view.shapes.iter().partition(|s| !clear(s));
    for shape in behind.into_iter().chain(before) {
        match shape {
            Shape::Surface { points, triangles, colour, opacity, values, .. } => {
                for (t, corners) in triangles.iter().enumerate() {
                    let [a, b, c] = corners.map(|k| Vec3::from(points[k as usize]));
                    let normal = (b - a).cross(c - a).normalize_or_zero();
                    // Colours that are to be read keep their brightness on every side.
                    let dim = if values.is_some() { 0.75 } else { 0.3 };
                    // Facets may look either way; both sides are lit.
                    let shade = dim + (1.0 - dim) * normal.dot(light).abs();
                    let base = match values {
                        Some(v) => v
                            .map
                            .colour(f64::from((v.values[t] - lo) / (hi - lo).max(f32::MIN_POSITIVE)))
                            .map(|x| f32::from(x) / 255.0),
                        None => colour.map(|c| c as f32),
                    };
                    canvas.triangle(
                        corners.map(|k| project(&points[k as usize])),
                        base.map(|c| c * shade),
                        *opacity as f32,
                    );
                }
            }
            Shape::Lines { lines, colour, width, .. } => {
                for line in lines {
                    for pair in line.windows(2) {
                        let colour = colour.map(|c| c as f32);
                        canvas.line(project(&pair[0]), project(&pair[1]), *width as f32 * 0.7, colour, 0.75);
                    }
                }
            }
            Shape::Points { points, colour, .. } => {
                for p in points.iter().map(project) {
                    canvas.line(p, p, 5.0, colour.map(|c| c as f32), 1.0);
                }
            }
        }
    }
    canvas.picture()
}

/// Returns the smallest and largest of all finite values that colour something: one scale for the whole view; 0 to 1 without any.
pub(super) fn common_range(shapes: &[Shape]) -> [f32; 2] {
    let of = |s: &Shape| match s {
        Shape::Surface { values, .. } => values.as_ref().map(|v| v.values.clone()),
        _ => None,
    };
    let finite = shapes.iter().filter_map(of).flatten().filter(|v| v.is_finite());
    finite
        .fold(None, |r, v| Some(r.map_or([v, v], |[lo, hi]: [f32; 2]| [lo.min(v), hi.max(v)])))
        .unwrap_or([0.0, 1.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles tile a square without a gap and do not leave it; of two, the nearer is seen.
    #[test]
    fn triangles_cover_their_samples_and_no_others() {
        let mut canvas = Canvas::new();
        let empty = canvas.rgb.clone();
        let corners = [[100.2, 50.7], [140.2, 50.7], [140.2, 90.7], [100.2, 90.7]];
        let [a, b, c, d] = corners.map(|[x, y]| Vec3::new(x, y, 1.0));
        for (z, colour) in [(0.0, [1.0, 0.0, 0.0]), (2.0, [0.0, 1.0, 0.0])] {
            for triangle in [[a, b, c], [c, a, d]] {
                canvas.triangle(triangle.map(|p| p.with_z(z)), colour, 1.0);
            }
        }
        let (mut red, mut changed) = (0, 0);
        for (sample, before) in canvas.rgb.iter().zip(&empty) {
            red += usize::from(*sample == [1.0, 0.0, 0.0]);
            changed += usize::from(sample != before);
        }
        assert_eq!([red, changed], [40 * 40; 2]);
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

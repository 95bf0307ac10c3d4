//! The static picture of a 3-D view: parallel projection, light from over the left shoulder.

use super::canvas::Canvas;
use super::view::{Shape, View};
use crate::formats::Picture;
use glam::{Vec2, Vec3};

/// Where the camera stands, as a direction towards it: the same as that of the interactive view.
pub(super) const EYE: [f64; 3] = [0.75, -1.25, 0.85];

/// A view of a single point is drawn as if it reached so far, mm.
const LEAST_REACH_MM: f32 = 1e-6;

/// Draws the view as a picture of 1200 × 800 pixels; the background alone where there is nothing to show.
pub(super) fn render(view: &View) -> Picture {
    let mut canvas = Canvas::default();
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
    let [width, height] = Canvas::SAMPLES.map(|n| n as f32);
    let scale = (0.46 * width / reach.x).min(0.46 * height / reach.y);
    let (cx, cy) = (width / 2.0, height / 2.0);
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
                        canvas.line([&pair[0], &pair[1]].map(project), *width as f32 * 0.7, colour, 0.75);
                    }
                }
            }
            Shape::Points { points, colour, .. } => {
                for p in points.iter().map(project) {
                    canvas.line([p, p], 5.0, colour.map(|c| c as f32), 1.0);
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

//! The point of a trimmed face that is nearest to a point.

use crate::math::polygon::is_inside_polygons;
use crate::math::{Aabb, BoxTree, Point, Uv};
use crate::model::Face;
use crate::nurbs::Surface;

/// Samples across a face in each direction.
const SAMPLES: usize = 24;

/// Steps of Gauss–Newton. It contracts by distance over radius of curvature: so many are enough for points nearer than 0.8 of it, and
/// points on the face take five.
const GAUSS_NEWTON_STEPS: usize = 100;

/// Determinant of the normal equations, over its largest possible value, below which both derivatives point the same way: 1e-7 rad
/// apart, where solving would lose all digits.
const SINGULAR: f64 = 1e-14;

/// Steps shorter than this share of the coordinates are rounding, some fifty of it: over a plane they went to and fro until the last.
const STILL: f64 = 1e-14;

/// Boxes around the pieces of a surface, unless it has more patches: their sides are an eighth of it and less, and they are made in less
/// time than one foot is found.
const PIECES: usize = 128;

/// Share of its distance that a rounded box may lie too far away.
pub(crate) const BOX_ROUNDING: f64 = 1e-9;

/// Boxes around the pieces of a surface: they show at once that most points, also those within a reflector, are far from it.
///
/// As a tree: tested one by one, the boxes of a reflector around a luminous chip took six times as long as all else of its rays.
#[derive(Clone, Debug)]
pub(crate) struct PieceBoxes {
    tree: BoxTree,
    /// The longest diagonal of a box.
    longest: f64,
}

impl PieceBoxes {
    /// Makes boxes around the patches of a surface, halved until there are [`PIECES`], in the coordinates of its part.
    pub(crate) fn new(surface: &Surface) -> Self {
        let mut patches = surface.bezier_patches();
        let mut direction = 0;
        while !patches.is_empty() && 2 * patches.len() <= PIECES {
            patches = patches.iter().flat_map(|patch| patch.halves(direction)).collect();
            direction = 1 - direction;
        }
        let boxes: Vec<Aabb> = patches.iter().map(|patch| patch.bounds()).collect();
        Self { tree: BoxTree::new(&boxes), longest: boxes.iter().map(Aabb::diagonal).fold(0.0, f64::max) }
    }

    /// Whether a box is within `limit` of a point, both in the coordinates of the part; without one the surface is farther away.
    pub(crate) fn are_within(&self, local: Point, limit: f64) -> bool {
        let rounding = BOX_ROUNDING * (local.length() + self.longest);
        self.tree.any_meeting(&Aabb::from_points([local]).grown(limit + rounding), |_| true)
    }
}

/// A point of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestOnFace {
    /// How far it is, mm.
    pub(crate) distance: f64,
    /// Where it is, in the parameters of the face's surface.
    pub(crate) uv: Uv,
}

/// Where searches for the nearest point of a trimmed face begin: computed once for all queries of the face.
#[derive(Clone, Debug)]
pub(crate) struct FaceSamples {
    /// The trims as polygons in parameters.
    loops: Vec<Vec<Uv>>,
    /// Corners of these, and a grid over the whole surface, in the coordinates of the part.
    border: Vec<(Uv, Point)>,
    grid: Vec<(Uv, Point)>,
}

impl FaceSamples {
    /// Takes the samples of a face with these trims.
    pub(crate) fn new(face: &Face, loops: Vec<Vec<Uv>>) -> Self {
        let surface = &face.surface;
        let sample = |uv: Uv| (uv, surface.evaluate(uv));
        let [[u0, u1], [v0, v1]] = surface.domain();
        let middle = |k: usize, a: f64, b: f64| a + (b - a) * (k as f64 + 0.5) / SAMPLES as f64;
        let grid = (0..SAMPLES * SAMPLES)
            .map(|i| sample(Uv::new(middle(i / SAMPLES, u0, u1), middle(i % SAMPLES, v0, v1))))
            .collect();
        Self { border: loops.iter().flatten().map(|&uv| sample(uv)).collect(), grid, loops }
    }

    /// Finds the point of the face that is nearest to `p`, both in the coordinates of the part; `face` is the one that the samples are of.
    /// `None` only where there is no sample inside the trims and no border.
    pub(crate) fn nearest(&self, face: &Face, p: Point) -> Option<NearestOnFace> {
        let at = |&(uv, point): &(Uv, Point)| NearestOnFace { distance: point.distance(p), uv };
        let nearer = |a: &NearestOnFace, b: &NearestOnFace| a.distance.total_cmp(&b.distance);
        let is_inside = |uv: Uv| is_inside_polygons(&self.loops, uv);
        // The nearest point is a foot inside the trims or lies on them.
        let border = self.border.iter().map(at).min_by(nearer);
        // Whether a sample lies inside costs more than its distance: only those nearer than all before are tested.
        let mut start: Option<NearestOnFace> = None;
        for sample in self.grid.iter().map(at) {
            if start.is_none_or(|nearest| nearer(&sample, &nearest).is_lt()) && is_inside(sample.uv) {
                start = Some(sample);
            }
        }
        let foot = foot_from(face, is_inside, p, start.or(border)?);
        Some(border.filter(|border| nearer(border, &foot).is_lt()).unwrap_or(foot))
    }
}

/// Goes from a point of the face towards the foot of the perpendicular from `p` by Gauss–Newton; returns the nearest point inside the
/// trims, by `is_inside`, that it came by, or the one it began with.
pub(crate) fn foot_from(
    face: &Face,
    is_inside: impl Fn(Uv) -> bool,
    p: Point,
    start: NearestOnFace,
) -> NearestOnFace {
    let s = &face.surface;
    let mut best = start;
    let mut uv = start.uv;
    for _ in 0..GAUSS_NEWTON_STEPS {
        let d = s.derivatives(uv);
        let r = p - d.point;
        let (a, b, c) = (d.du.length_squared(), d.du.dot(d.dv), d.dv.length_squared());
        let det = a * c - b * b;
        if det.is_nan() || det <= SINGULAR * a * c {
            break;
        }
        let (g, h) = (d.du.dot(r), d.dv.dot(r));
        // A foot beyond the domain is held at its border, where the next step may still move along.
        let next = s.clamp(uv + Uv::new(c * g - b * h, a * h - b * g) / det);
        let step = next - uv;
        let rounding = STILL * (p.abs() + d.point.abs() + (d.du * uv.x).abs() + (d.dv * uv.y).abs()).max_element();
        if (d.du * step.x + d.dv * step.y).abs().max_element() <= rounding {
            break;
        }
        uv = next;
        let distance = s.evaluate(uv).distance(p);
        if distance < best.distance && is_inside(uv) {
            best = NearestOnFace { distance, uv };
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// The distance from the centre decides whether a point is near a sphere of radius 5; boxes may call a farther one near.
    #[test]
    fn boxes_hold_all_that_is_near() {
        let boxes = PieceBoxes::new(&sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]));
        for k in 0..1000 {
            let (sin, cos) = f64::from(k).sin_cos();
            let way = Point::new(cos, sin, (0.7 * f64::from(k)).sin()).normalize();
            for (radius, near) in [(2.5, false), (4.9995, true), (5.0, true), (5.0005, true), (8.0, false)] {
                assert_eq!(boxes.are_within(way * radius, 1e-3), near, "{radius} {way}");
            }
        }
    }
}

//! The mesh as rays see it from far: the box they must enter, and the point about which nodes and blocks are given.

use crate::math::{Aabb, Point, Ray};

/// Twice the two roundings of `(bound − origin) · inverse`, relative, and some more: how wrong a crossing of the mesh's box may be.
const CROSSING_ERROR: f64 = 8.0 * f64::EPSILON;

/// What rays need of the mesh, in four lanes of which the last means nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshBox {
    /// The point about which nodes and blocks are given, mm.
    pub(super) center: [f64; 4],
    /// Corners of the box, mm.
    pub(super) low: [f64; 4],
    pub(super) high: [f64; 4],
    /// Four times the size of the box, mm: what an f32 box test is wrong by, in roundings.
    pub(super) reach: [f32; 4],
    /// How far before a place in the box a ray may start and still be near the mesh, mm, negative.
    farthest_back: f64,
}

/// Where a ray enters and leaves the mesh, wide enough for the rounding; `near` beyond `far` where it passes the mesh by.
pub(super) struct Passage {
    /// mm along the ray.
    pub(super) near: f64,
    pub(super) far: f64,
}

impl MeshBox {
    /// Spreads `center` and `bounds`, mm, over four lanes as they are: the caller has grown the box by the margin that rays need.
    pub(super) fn new(center: Point, bounds: &Aabb) -> Self {
        let lanes = |p: Point, last: f64| [p.x, p.y, p.z, last];
        Self {
            center: lanes(center, 0.0),
            low: lanes(bounds.min, f64::NEG_INFINITY),
            high: lanes(bounds.max, f64::INFINITY),
            reach: lanes(bounds.size() * 4.0, 0.0).map(|x| x as f32),
            farthest_back: -bounds.diagonal(),
        }
    }

    /// Whether a point is inside the box around the mesh.
    #[inline(always)]
    pub(super) fn holds(&self, point: [f64; 4]) -> bool {
        let mut inside = true;
        for a in 0..4 {
            inside &= (point[a] >= self.low[a]) & (point[a] <= self.high[a]);
        }
        inside
    }

    /// From where on a ray whose origin is inside the box needs no move to the mesh, mm along it; `None` where its range begins so far
    /// before the origin that it does.
    #[inline(always)]
    pub(super) fn inner_start(&self, ray: &Ray) -> Option<f64> {
        (ray.t_min >= self.farthest_back).then_some(ray.t_min.min(0.0))
    }

    /// Where a ray with this origin and inverse direction, in four lanes of which the last does not count, passes the mesh within the range
    /// of `ray`.
    #[inline(always)]
    pub(super) fn passage(&self, ray: &Ray, origin: [f64; 4], inverse: [f64; 4]) -> Passage {
        let mut enter = [0.0; 4];
        let mut leave = [0.0; 4];
        for a in 0..4 {
            let low = (self.low[a] - origin[a]) * inverse[a];
            let high = (self.high[a] - origin[a]) * inverse[a];
            let first = ordered_min(low, high);
            let last = ordered_max(low, high);
            // Outward by the rounding of both crossings.
            enter[a] = first - first.abs() * CROSSING_ERROR;
            leave[a] = last + last.abs() * CROSSING_ERROR;
        }
        let near = ordered_max(ordered_max(enter[0], enter[1]), ordered_max(enter[2], ray.t_min));
        let far = ordered_min(ordered_min(leave[0], leave[1]), ordered_min(leave[2], ray.t_max));
        Passage { near, far }
    }
}

/// The least of two numbers in one instruction, the second where one is no number: `f64::min` takes three for the sake of NaN.
#[inline(always)]
pub(super) fn ordered_min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greatest of two numbers in one instruction.
#[inline(always)]
pub(super) fn ordered_max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

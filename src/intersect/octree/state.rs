//! A ray on its way through the tree.

use super::Octree;
use super::node::Link;
use crate::intersect::facet::{FacetRay, Nearest};
use crate::math::Ray;

/// Places on a stack: seven for each of 32 levels of cells and 30 of packing, and one.
pub(super) const STACK: usize = 448;

/// What box tests need of a ray, in f32 about the middle of the mesh.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct BoxRay {
    pub(super) origin: [f32; 4],
    pub(super) inverse: [f32; 4],
    /// By how much a crossing may be wrong.
    pub(super) slack: [f32; 4],
    /// Rows of [`super::node::Node::bounds`] where the ray enters.
    pub(super) near: [u8; 3],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
}

/// What blocks need of a ray.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct SiftRay {
    pub(super) high: [f32; 4],
    /// What `high` lost in rounding.
    pub(super) low: [f32; 4],
    pub(super) slopes: [f32; 2],
    pub(super) slack: f32,
    pub(super) axes: [u8; 3],
}

/// How wrong the lateral position of a corner may be against the ray, mm, and the edge functions of a facet that is hit.
///
/// Corners are rounded to half a step an axis, to which sheared coordinates add the same along the main axis;
/// f32 arithmetic on lengths up to `far + 65536 step` adds less than nine roundings. The corners of a facet that is hit
/// lie within its sheared diameter, at most 2·65535 steps, of the ray; a product of two of them is wrong by four times
/// that and the error of one, and the rounding of the products is below a tenth of it.
#[inline(always)]
pub(super) fn edge_error(step: f32, far: f32, slack: f32) -> f32 {
    let lateral = 1.1 * step + 6e-7 * far + slack;
    4.5 * (131_072.0 * step + lateral) * lateral
}

/// One ray under way.
pub(super) struct State {
    pub(super) boxes: BoxRay,
    pub(super) sift: SiftRay,
    pub(super) facets: FacetRay,
    pub(super) best: Nearest,
    /// Where box distances start, mm along the ray.
    shift: f64,
    pub(super) at: Link,
    /// Facets of the block at hand that wait for their corners.
    pub(super) waiting: u32,
    pub(super) top: usize,
    pub(super) index: usize,
    pub(super) stack: [(f32, u32); STACK],
}

impl State {
    pub(super) fn idle() -> Self {
        let ray = Ray::new(crate::math::Point::ZERO, crate::math::Vector::Z);
        Self {
            boxes: BoxRay::default(),
            sift: SiftRay::default(),
            facets: FacetRay::new(&ray),
            best: Nearest::before(0.0),
            shift: 0.0,
            at: Link(0),
            waiting: 0,
            top: 0,
            index: usize::MAX,
            stack: [(0.0, 0); STACK],
        }
    }

    /// Puts a ray on its way; `false` when it passes by the whole mesh.
    #[inline(always)]
    pub(super) fn start(&mut self, tree: &Octree, root: Link, ray: &Ray, index: usize) -> bool {
        // Far origins are moved to where they enter, since f32 is good only near the mesh.
        self.shift = 0.0;
        if !(ray.t_min >= 0.0 && tree.bounds.contains(ray.origin)) {
            match tree.bounds.clip(ray) {
                Some((enter, _)) if enter.is_finite() => self.shift = enter,
                _ => return false,
            }
        }
        let origin = (ray.origin - tree.center + ray.direction * self.shift).to_array();
        let moved = (tree.around.slack(ray) + self.shift.abs() * 1e-15) as f32;
        let half = (tree.bounds.size() * 0.5).to_array();
        let b = &mut self.boxes;
        for a in 0..3 {
            let d = ray.direction[a];
            let inverse = if d.abs() < 1e-18 { 1e18f64.copysign(d) } else { 1.0 / d } as f32;
            let o = origin[a] as f32;
            b.origin[a] = o;
            b.inverse[a] = inverse;
            b.slack[a] = ((4.0 * o.abs() + 6.0 * half[a] as f32) * 6e-8 + moved) * inverse.abs();
            b.near[a] = 2 * a as u8 + u8::from(inverse < 0.0);
            self.sift.high[a] = o;
            self.sift.low[a] = (origin[a] - f64::from(o)) as f32;
        }
        b.t_min = (((ray.t_min - self.shift) * (1.0 - 1e-6)) as f32).max(0.0);
        self.facets = FacetRay::new(ray);
        self.sift.slopes = self.facets.slopes().map(|s| s as f32);
        self.sift.axes = self.facets.axes().map(|a| a as u8);
        self.sift.slack = moved;
        self.best = Nearest::before(ray.t_max);
        self.cap();
        self.at = root;
        self.waiting = 0;
        self.top = 0;
        self.index = index;
        true
    }

    /// Boxes that begin after the nearest hit are of no interest; rounded up, so that ties are seen.
    #[inline(always)]
    pub(super) fn cap(&mut self) {
        self.boxes.t_max = ((self.best.t - self.shift) * (1.0 + 1e-6)) as f32;
    }

    /// Goes on with the nearest box on the stack; `false` when none is left.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> bool {
        while self.top > 0 {
            self.top -= 1;
            let (enter, link) = self.stack[self.top];
            if enter <= self.boxes.t_max {
                self.at = Link(link);
                return true;
            }
        }
        false
    }
}

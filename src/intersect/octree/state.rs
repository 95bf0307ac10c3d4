//! A ray on its way through the tree.

use super::Octree;
use super::engine::Lanes;
use super::node::{Link, Node};
use crate::intersect::facet::{FacetRay, Nearest};
use crate::math::{Aabb, Point, Ray};
use std::hint::select_unpredictable;

/// Places on a stack: seven for each of 32 levels of cells and 30 of packing, eight written beyond the top, and the
/// ground.
const STACK: usize = 464;
/// Places below the first entry, so that sixteen can be looked at at once; all lead to the end of the ray.
const GROUND: usize = 16;

/// What box tests need of a ray, in f32 about the middle of the mesh.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct BoxRay {
    /// Inverse direction, then the same negated.
    pub(super) inverse: [f32; 8],
    pub(super) origin: [f32; 4],
    /// By how much a crossing may be wrong.
    pub(super) slack: [f32; 4],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// One bit an axis: set where the ray runs against it and enters by upper bounds.
    pub(super) octant: u8,
}

impl BoxRay {
    /// The row of [`super::node::Node::bounds`] where the ray enters along an axis; the other is where it leaves.
    #[inline(always)]
    pub(super) fn near(&self, axis: usize) -> usize {
        2 * axis + usize::from(self.octant >> axis & 1)
    }
}

/// What blocks need of a ray.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct SiftRay {
    pub(super) high: [f32; 4],
    /// What `high` lost in rounding.
    pub(super) low: [f32; 4],
    /// Slopes against the main axis, and the inverse of the direction along it.
    pub(super) shear: [f32; 3],
    pub(super) slack: f32,
    pub(super) axes: [u8; 3],
}

/// How wrong the position of a corner may be against the ray, mm.
///
/// Corners are rounded to half a step an axis, to which sheared coordinates add the same along the main axis;
/// f32 arithmetic on lengths up to `far + 65536 step` adds less than nine roundings.
#[inline(always)]
pub(super) fn corner_error(step: f32, far: f32, slack: f32) -> f32 {
    1.1 * step + 6e-7 * far + slack
}

/// How wrong the edge functions of a facet that is hit may be, from the error of a corner.
///
/// The corners of a facet that is hit lie within its sheared diameter, at most 2·65535 steps, of the ray; a product of
/// two of them is wrong by four times that and the error of one, and the rounding of the products is below a tenth of it.
#[inline(always)]
pub(super) fn edge_error(step: f32, corner: f32) -> f32 {
    4.5 * (131_072.0 * step + corner) * corner
}

/// What rays need of the mesh, in four lanes of which the last means nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    center: [f64; 4],
    /// Around all facets, grown a little.
    low: [f64; 4],
    high: [f64; 4],
    /// Three times the size: what an f32 box test is wrong by, in roundings.
    reach: [f32; 4],
}

impl Frame {
    pub(super) fn new(center: Point, bounds: &Aabb) -> Self {
        let lanes = |p: Point, last: f64| [p.x, p.y, p.z, last];
        Self {
            center: lanes(center, 0.0),
            low: lanes(bounds.min, f64::NEG_INFINITY),
            high: lanes(bounds.max, f64::INFINITY),
            reach: lanes(bounds.size() * 3.0, 0.0).map(|x| x as f32),
        }
    }

    /// Where the ray enters and leaves the mesh, wide enough for the rounding, and whether it starts inside.
    #[inline(always)]
    fn passage(&self, ray: &Ray, origin: [f64; 4], inverse: [f64; 4]) -> (f64, f64, bool) {
        let mut enter = [0.0; 4];
        let mut leave = [0.0; 4];
        let mut inside = true;
        for a in 0..4 {
            let low = (self.low[a] - origin[a]) * inverse[a];
            let high = (self.high[a] - origin[a]) * inverse[a];
            let (first, last) = (lesser(low, high), greater(low, high));
            enter[a] = first - first.abs() * (8.0 * f64::EPSILON);
            leave[a] = last + last.abs() * (8.0 * f64::EPSILON);
            inside &= (origin[a] >= self.low[a]) & (origin[a] <= self.high[a]);
        }
        let near = greater(greater(enter[0], enter[1]), greater(enter[2], ray.t_min));
        let far = lesser(lesser(leave[0], leave[1]), lesser(leave[2], ray.t_max));
        (near, far, inside)
    }
}

/// The least of two numbers in one instruction: `f64::min` takes three for the sake of NaN, after which nothing is met here.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// One ray under way.
///
/// The size is no multiple of a page, so that the rays under way do not fight for the same sets of the cache.
#[repr(C, align(64))]
pub(super) struct State {
    pub(super) boxes: BoxRay,
    pub(super) sift: SiftRay,
    pub(super) at: Link,
    /// The facet that the ray leaves where it is known not to meet it, else one that no block has.
    pub(super) own: u32,
    /// Facets of `block` that wait for their corners.
    pub(super) waiting: u32,
    pub(super) block: u32,
    /// Where box distances start, mm along the ray.
    shift: f64,
    pub(super) index: usize,
    pub(super) facets: FacetRay,
    pub(super) best: Nearest,
    top: usize,
    enters: [f32; STACK],
    links: [u32; STACK],
    spread: [u64; 40],
}

impl State {
    pub(super) fn idle() -> Self {
        let ray = Ray::new(crate::math::Point::ZERO, crate::math::Vector::Z);
        Self {
            boxes: BoxRay::default(),
            sift: SiftRay::default(),
            facets: FacetRay::new(&ray),
            best: Nearest::up_to(0.0),
            shift: 0.0,
            at: Link::END,
            own: u32::MAX,
            waiting: 0,
            block: 0,
            top: GROUND,
            index: usize::MAX,
            enters: [f32::NEG_INFINITY; STACK],
            links: [Link::END.0; STACK],
            spread: [0; 40],
        }
    }

    /// Puts a ray on its way, at once to the end when it passes by the whole mesh. What differs from ray to ray is
    /// chosen without branches.
    #[inline(always)]
    pub(super) fn start(&mut self, tree: &Octree, root: Link, ray: &Ray, index: usize) {
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z, 1.0];
        let origin = [ray.origin.x, ray.origin.y, ray.origin.z, 0.0];
        let inverse = direction.map(|d| 1.0 / if d.abs() < 1e-18 { 1e-18f64.copysign(d) } else { d });
        let frame = &tree.frame;
        // Far origins are moved to where they enter, since f32 is good only near the mesh.
        let (near, far, inside) = frame.passage(ray, origin, inverse);
        let inside = inside & (ray.t_min >= 0.0);
        let meets = inside | ((near <= far) & near.is_finite());
        self.shift = select_unpredictable(inside, 0.0, near);
        let moved = (tree.around.slack(ray) + self.shift.abs() * 1e-15) as f32;
        let b = &mut self.boxes;
        let mut octant = 0;
        for a in 0..4 {
            let inverse = inverse[a] as f32;
            let exact = (origin[a] - frame.center[a]) + direction[a] * self.shift;
            let o = exact as f32;
            b.origin[a] = o;
            b.inverse[a] = inverse;
            b.inverse[a + 4] = -inverse;
            b.slack[a] = ((4.0 * o.abs() + frame.reach[a]) * 6e-8 + moved) * inverse.abs();
            self.sift.high[a] = o;
            self.sift.low[a] = (exact - f64::from(o)) as f32;
            octant |= u8::from(inverse < 0.0) << a;
        }
        b.octant = octant & 7;
        // Adding zero makes −0.0 positive: distances are sorted by their bits.
        b.t_min = (((ray.t_min - self.shift) * (1.0 - 1e-6)) as f32).max(0.0) + 0.0;
        self.facets = FacetRay::new(ray);
        self.sift.shear = self.facets.shear().map(|s| s as f32);
        self.sift.axes = self.facets.axes().map(|a| a as u8);
        self.sift.slack = moved;
        self.best = Nearest::up_to(ray.t_max);
        self.cap();
        self.at = Link(select_unpredictable(meets, root.0, Link::END.0));
        self.own = tree.own_of(ray);
        self.waiting = 0;
        self.top = GROUND;
        self.index = index;
    }

    /// Boxes that begin after the nearest hit are of no interest; rounded up, so that ties are seen, and never to zero, since the lowest
    /// bits of a distance are not its own.
    #[inline(always)]
    pub(super) fn cap(&mut self) {
        self.boxes.t_max = (((self.best.t - self.shift) * (1.0 + 1e-6)) as f32).max(1e-30);
    }

    /// Writes the children of a node that the ray may meet above the top of the stack; gives their number.
    #[inline(always)]
    pub(super) fn enter<L: Lanes, const ALONE: bool>(&mut self, node: &Node) -> usize {
        let base = self.top.min(STACK - 8);
        let enters = self.enters[base..base + 8].first_chunk_mut();
        let links = self.links[base..base + 8].first_chunk_mut();
        match (enters, links) {
            (Some(enters), Some(links)) => L::enter::<ALONE>(node, &self.boxes, enters, links),
            _ => unreachable!("eight places"),
        }
    }

    /// Goes to the nearest of `count` entries that were just written and keeps the others.
    #[inline(always)]
    pub(super) fn nearest(&mut self, count: usize) -> Link {
        self.top = (self.top + count - 1).min(STACK - 9);
        Link(self.links[self.top])
    }

    /// Goes on with the topmost entry that is not beyond `t_max`.
    #[inline(always)]
    pub(super) fn pop(&mut self, t_max: f32) -> Link {
        while self.top > GROUND {
            self.top -= 1;
            if self.enters[self.top] <= t_max {
                return Link(self.links[self.top]);
            }
        }
        Link::END
    }

    /// The nearest of `count` entries that were just written, else the topmost that is not beyond `t_max`: no branch
    /// depends on which.
    #[inline(always)]
    pub(super) fn next<L: Lanes>(&mut self, count: usize) -> Link {
        let mut top = self.top.clamp(GROUND, STACK - 8);
        let open = loop {
            let upper = self.enters[top - GROUND..].first_chunk();
            let open = upper.map_or(1, |upper| L::open(upper, self.boxes.t_max));
            // The ground is open to all.
            if open != 0 || top == GROUND {
                break open | 1;
            }
            if count > 0 {
                break 1;
            }
            top = (top - GROUND).max(GROUND);
        };
        let below = top - 1 - (open << 16).leading_zeros() as usize;
        let above = top + count - 1;
        self.top = select_unpredictable(count > 0, above, below).min(STACK - 9);
        Link(self.links[self.top])
    }

    /// Looks again at what was next, after `t_max` has come nearer.
    #[inline(always)]
    pub(super) fn reconsider<L: Lanes>(&mut self) {
        self.top += usize::from(self.at != Link::END);
        self.at = self.next::<L>(0);
    }
}

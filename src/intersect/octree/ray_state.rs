//! A ray on its way through the tree.

use super::lanes::Lanes;
use super::node::{CHILDREN, Link, Node};
use super::quad_edges::QuadRay;
use super::ray::{BoxRay, SieveRay};
use super::tree::Tree;
use crate::intersect::facet::{FacetRay, Nearest};
use crate::math::{Point, Ray, Vector};
use std::hint::select_unpredictable;

/// Places below the first entry, so that sixteen can be looked at at once; all lead to the end of the ray.
const GROUND: usize = 16;

/// Places on the stack of a ray in a tree of so many levels of nodes: of each level all children of one node and all but one of another
/// may be left where two are entered at a time; then those written beyond the top, and the ground. With what makes the size of a
/// [`RayState`] as it should be.
pub(super) const fn stack_places(levels: usize) -> usize {
    ((2 * CHILDREN - 1) * levels + CHILDREN + GROUND).next_multiple_of(16) + 8
}

/// Smallest component of a direction that is divided by: along it a ray moves by less than the room around boxes in 10⁵ scene
/// sizes, and 1e12 mm times its inverse is still a number in f32.
const LEAST_COMPONENT: f64 = 1e-18;
/// What a start that was moved along its ray is wrong by, relative to the way: four roundings in f64.
const SHIFT_ERROR: f64 = 1e-15;
/// Rounding of f32, 2⁻²⁴, rounded up.
const ROUNDING: f32 = 6e-8;
/// By how much limits in f32 are widened: sixteen roundings, so that ties are seen.
const LIMIT_ROOM: f64 = 1e-6;
/// The least `t_max` of box tests: the lowest bits of a distance are not its own.
const LEAST_LIMIT: f32 = 1e-30;

/// One ray under way, with a stack of `STACK` places.
///
/// The size is an odd number of lines of the cache, so that the rays under way do not fight for the same sets of it.
#[repr(C, align(64))]
pub(super) struct RayState<const STACK: usize> {
    pub(super) boxes: BoxRay,
    pub(super) sieve: SieveRay,
    /// Where the ray goes next.
    pub(super) next: Link,
    /// As [`Tree::unmet_facet`].
    pub(super) unmet_facet: u32,
    /// Triangles of `block` that the sieve left, to be tested.
    pub(super) candidates: u32,
    /// Index of the block that was sifted.
    pub(super) block: u32,
    /// Where box distances start, mm along the ray.
    shift: f64,
    /// Which of the batch's rays it is.
    pub(super) index: usize,
    pub(super) facets: FacetRay,
    pub(super) quads: QuadRay,
    /// The facet that the ray leaves, else one that no block has.
    pub(super) departed: u32,
    pub(super) best: Nearest,
    /// Where the stack ends; of each entry, where the ray enters and what is there.
    top: usize,
    enters: [f32; STACK],
    links: [u32; STACK],
}

impl<const STACK: usize> RayState<STACK> {
    /// A state without a ray, which is at its end.
    pub(super) fn idle() -> Self {
        const { assert!(size_of::<Self>() / 64 % 2 == 1, "states of rays would share sets of the cache") };
        let ray = Ray::new(Point::ZERO, Vector::Z);
        Self {
            boxes: BoxRay::default(),
            sieve: SieveRay::default(),
            facets: FacetRay::new(&ray),
            quads: QuadRay::default(),
            departed: u32::MAX,
            best: Nearest::up_to(0.0),
            shift: 0.0,
            next: Link::END,
            unmet_facet: u32::MAX,
            candidates: 0,
            block: 0,
            top: GROUND,
            index: usize::MAX,
            enters: [f32::NEG_INFINITY; STACK],
            links: [Link::END.0; STACK],
        }
    }

    /// Puts a ray, in the mesh's coordinates, on its way and replaces the one before: next is `root`, or the end when it passes by the
    /// whole mesh. `index` tells whose hit it will be. What differs from ray to ray is chosen without branches.
    #[inline(always)]
    pub(super) fn start(&mut self, tree: &Tree, root: Link, ray: &Ray, index: usize) {
        self.unmet_facet = tree.unmet_facet(ray);
        let lifted;
        let ray = if ray.departure.is_some() & (self.unmet_facet == u32::MAX) {
            lifted = lift(tree, ray);
            &lifted
        } else {
            ray
        };
        let direction = [ray.direction.x, ray.direction.y, ray.direction.z, 1.0];
        let origin = [ray.origin.x, ray.origin.y, ray.origin.z, 0.0];
        let inverse =
            direction.map(|d| 1.0 / if d.abs() < LEAST_COMPONENT { LEAST_COMPONENT.copysign(d) } else { d });
        let mesh_box = &tree.mesh_box;
        // Far origins are moved to where they enter, since f32 is good only near the mesh. Rays of one kind mostly start all inside
        // or all outside.
        let mut meets = true;
        self.shift = 0.0;
        if !(mesh_box.holds(origin) & (ray.t_min >= 0.0)) {
            let passage = mesh_box.passage(ray, origin, inverse);
            meets = (passage.near <= passage.far) & passage.near.is_finite();
            self.shift = passage.near;
        }
        let moved = (tree.surroundings.slack(ray) + self.shift.abs() * SHIFT_ERROR) as f32;
        let b = &mut self.boxes;
        let mut octant = 0;
        for a in 0..4 {
            let inverse = inverse[a] as f32;
            let exact = (origin[a] - mesh_box.center[a]) + direction[a] * self.shift;
            let o = exact as f32;
            b.origin[a] = o;
            b.inverse[a] = inverse;
            b.slack[a] = ((4.0 * o.abs() + mesh_box.reach[a]) * ROUNDING + moved) * inverse.abs();
            self.sieve.high[a] = o;
            self.sieve.low[a] = (exact - f64::from(o)) as f32;
            octant |= u8::from(inverse < 0.0) << a;
        }
        b.octant = octant & 7;
        // Adding zero makes −0.0 positive: distances are sorted by their bits.
        b.t_min = (((ray.t_min - self.shift) * (1.0 - LIMIT_ROOM)) as f32).max(0.0) + 0.0;
        // What is asked again is taken before it is written: what was written in parts is read as a whole only after a wait.
        let facets = FacetRay::new(ray);
        let (axes, shear) = (facets.axes(), facets.shear());
        self.quads.take_ray(&facets, axes, origin, tree.surroundings.reach);
        self.departed = ray.departure.map_or(u32::MAX, |departure| departure.primitive);
        self.sieve.shear = shear.map(|s| s as f32);
        self.sieve.axes = axes.map(|a| a as u8);
        self.facets = facets;
        self.sieve.slack = moved;
        self.best = Nearest::up_to(ray.t_max);
        self.limit_to_hit();
        self.next = Link(select_unpredictable(meets, root.0, Link::END.0));
        self.candidates = 0;
        self.top = GROUND;
        self.index = index;
    }

    /// Ends box tests at the nearest hit so far, or at the end of the ray's range: rounded up, so that ties are seen, and never to zero,
    /// since the lowest bits of a distance are not its own.
    #[inline(always)]
    pub(super) fn limit_to_hit(&mut self) {
        let t_max = (((self.best.t - self.shift) * (1.0 + LIMIT_ROOM)) as f32).max(LEAST_LIMIT);
        self.boxes.t_max = t_max;
    }

    /// Writes the children of a node that the ray may meet above the top of the stack, which stays where it is: [`Self::take_nearest`],
    /// [`Self::keep_all`] or [`Self::advance`] takes them.
    #[inline(always)]
    pub(super) fn enter<L: Lanes>(&mut self, node: &Node) -> Children {
        let base = self.top.min(STACK - CHILDREN);
        let enters = self.enters[base..base + CHILDREN].first_chunk_mut();
        let links = self.links[base..base + CHILDREN].first_chunk_mut();
        let met = match (enters, links) {
            (Some(enters), Some(links)) => L::enter(node, &self.boxes, enters, links),
            _ => unreachable!("sixteen places"),
        };
        // The link of the nearest is read from the node: on the stack it was written just now.
        let lane = met.leading_zeros() ^ 31;
        let nearest = node.children[((15 ^ lane ^ node.slot_order(self.boxes.octant)) & 15) as usize];
        Children { count: met.count_ones() as usize, nearest }
    }

    /// Returns the nearest of the children that were just written, at least one, and keeps the others on the stack.
    #[inline(always)]
    pub(super) fn take_nearest(&mut self, children: Children) -> Link {
        self.top = (self.top + children.count - 1).min(STACK - CHILDREN);
        Link(children.nearest)
    }

    /// Keeps all children that were just written on the stack.
    #[inline(always)]
    pub(super) fn keep_all(&mut self, children: Children) {
        self.top = (self.top + children.count).min(STACK - CHILDREN);
    }

    /// The topmost entry of the stack, which keeps it; the end of the ray where it is empty.
    #[inline(always)]
    pub(super) fn peek(&self) -> Link {
        Link(self.links[(self.top - 1) % STACK])
    }

    /// Takes the topmost entry off the stack if it is a node that is not beyond the ray's limit, and returns the node's index; else `None`,
    /// and the stack stays.
    #[inline(always)]
    pub(super) fn take_open_node(&mut self) -> Option<usize> {
        let (top, link) = ((self.top - 1) % STACK, self.peek());
        let is_open = (link.kind() == 0) & (self.enters[top] <= self.boxes.t_max);
        if is_open {
            self.top = top;
        }
        is_open.then(|| link.as_node())
    }

    /// Takes entries off the stack up to one that is not beyond `t_max`, and returns it; [`Link::END`] when there is none.
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

    /// Returns the nearest of the children that were just written and keeps the others; where there are none, the topmost entry that is not
    /// beyond the ray's limit, taken off the stack with all above it. No branch depends on which.
    #[inline(always)]
    pub(super) fn advance<L: Lanes>(&mut self, children: Children) -> Link {
        let mut top = self.top.clamp(GROUND, STACK - CHILDREN);
        let mut open = self.open_below::<L>(top);
        // The ground is open to all. One test of both: whether there are children cannot be foretold, that there is anything can.
        while open | children.count as u32 == 0 {
            top = (top - GROUND).max(GROUND);
            open = self.open_below::<L>(top);
        }
        let below = top - 1 - ((open | 1) << 16).leading_zeros() as usize;
        let above = top + children.count - 1;
        let older = self.links[below % STACK];
        self.top = select_unpredictable(children.count > 0, above, below).min(STACK - CHILDREN);
        Link(select_unpredictable(children.count > 0, children.nearest, older))
    }

    /// Which of the sixteen entries below `top` are not beyond the ray's limit, one bit each, the topmost highest.
    #[inline(always)]
    fn open_below<L: Lanes>(&self, top: usize) -> u32 {
        match self.enters[top - GROUND..].first_chunk() {
            Some(entries) => L::open(entries, self.boxes.t_max),
            None => 1,
        }
    }

    /// Puts `next` back on the stack and takes the topmost entry that is not beyond the limit, which a hit has brought nearer.
    #[inline(always)]
    pub(super) fn recheck_next<L: Lanes>(&mut self) {
        self.top += usize::from(self.next != Link::END);
        self.next = self.advance::<L>(Children::NONE);
    }
}

/// Children of a node that were written above the top of the stack.
#[derive(Clone, Copy)]
pub(super) struct Children {
    pub(super) count: usize,
    /// The link of the nearest.
    nearest: u32,
}

impl Children {
    pub(super) const NONE: Self = Self { count: 0, nearest: 0 };
}

/// Calls [`crate::intersect::facet::Surroundings::lifted`] out of line, for few rays graze the facet that they leave.
#[cold]
#[inline(never)]
fn lift(tree: &Tree, ray: &Ray) -> Ray {
    tree.surroundings.lifted(ray)
}

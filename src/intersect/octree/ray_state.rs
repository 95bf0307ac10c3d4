//! A ray on its way through the tree.

use super::lanes::Lanes;
use super::node::Link;
use super::ray::{BoxRay, Entry, SieveRay};
use super::ray_stack::{Children, RayStack};
use super::tree::Tree;
use crate::intersect::facet::{FacetRay, Nearest};
use crate::math::{Point, Ray, Vector};

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
    /// The facet that the ray leaves, else one that no block has.
    pub(super) departed: u32,
    pub(super) best: Nearest,
    pub(super) stack: RayStack<STACK>,
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
            departed: u32::MAX,
            best: Nearest::up_to(0.0),
            shift: 0.0,
            next: Link::END,
            unmet_facet: u32::MAX,
            candidates: 0,
            block: 0,
            index: usize::MAX,
            stack: RayStack::EMPTY,
        }
    }

    /// Puts a ray, in the mesh's coordinates, on its way and replaces the one before: next is `root`, or the end when it passes by the
    /// whole mesh. `index` says whose hit it will be. What differs from ray to ray within the mesh is chosen without branches.
    #[inline(always)]
    pub(super) fn start<L: Lanes>(&mut self, tree: &Tree, root: Link, ray: &Ray, index: usize) {
        self.unmet_facet = tree.unmet_facet(ray);
        let lifted;
        let ray = if ray.departure.is_some() & (self.unmet_facet == u32::MAX) {
            lifted = lift(tree, ray);
            &lifted
        } else {
            ray
        };
        self.index = index;
        self.best = Nearest::up_to(ray.t_max);
        let slack = tree.surroundings.slack(ray);
        let Some(shift) = L::start(ray, &tree.mesh_box, slack, &mut self.boxes, &mut self.sieve) else {
            self.next = Link::END;
            return;
        };
        self.shift = shift;
        let b = &mut self.boxes;
        b.t_min = (((ray.t_min - self.shift) * (1.0 - LIMIT_ROOM)) as f32).max(0.0);
        // What is read again is taken before it is written: what was written in parts is read as a whole only after a wait.
        let facets = FacetRay::new(ray);
        let (axes, shear) = (facets.axes(), facets.shear());
        self.departed = ray.departure.map_or(u32::MAX, |departure| departure.primitive);
        self.sieve.shear = shear.map(|s| s as f32);
        self.sieve.axes = axes.map(|a| a as u8);
        self.facets = facets;
        self.limit_to_hit();
        self.next = root;
        self.candidates = 0;
        self.stack.clear();
    }

    /// Ends box tests at the nearest hit so far, or at the end of the ray's range: rounded up, so that ties are seen, and never to zero,
    /// since the lowest bits of a distance are not its own.
    #[inline(always)]
    pub(super) fn limit_to_hit(&mut self) {
        let t_max = (((self.best.t - self.shift) * (1.0 + LIMIT_ROOM)) as f32).max(LEAST_LIMIT);
        self.boxes.t_max = t_max;
    }

    /// Writes the children of a node that the ray may meet above the top of its stack, and returns which they are, as [`Lanes::enter`].
    #[inline(always)]
    pub(super) fn enter<L: Lanes>(&mut self, entry: &Entry) -> u32 {
        self.stack.enter::<L>(entry, &self.boxes)
    }

    /// Goes on to the nearest of the children that were just written, or where there are none to what else is nearest.
    #[inline(always)]
    pub(super) fn advance<L: Lanes>(&mut self, children: Children) {
        self.next = self.stack.advance::<L>(children, self.boxes.t_max);
    }

    /// Puts `next`, which came from the stack, back and takes the topmost entry that is not beyond the limit, which a hit has brought
    /// nearer.
    #[inline(always)]
    pub(super) fn recheck_next<L: Lanes>(&mut self) {
        self.stack.put_back();
        self.advance::<L>(Children::NONE);
    }
}

/// Calls [`crate::intersect::facet::Surroundings::lifted`] out of line, because few rays graze the facet that they leave.
#[cold]
#[inline(never)]
fn lift(tree: &Tree, ray: &Ray) -> Ray {
    tree.surroundings.lifted(ray)
}

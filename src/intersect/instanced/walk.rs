//! The rays of a batch on their way through the places of parts.

use crate::intersect::{Certainty, Hit};
use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{BoxTree, BoxWalk, Departure, Ray, Vector};
use smallvec::SmallVec;

/// A ray under way.
pub(super) struct Walk<'t> {
    /// The ray, up to the nearest hit so far.
    pub(super) ray: Ray,
    /// What the ray leaves, as its owner knows it.
    pub(super) departure: Option<OwnDeparture>,
    /// The boxes still to be entered; none where the hit so far is known to be the nearest.
    pub(super) boxes: BoxWalk<'t>,
    /// Of the first group, or of a placement.
    pub(super) best: Option<(Option<u32>, Hit)>,
    /// The placement to query next; `None` once it has passed all boxes.
    pub(super) next: Option<u32>,
    /// Whether some structure fell back on it: what that missed may be nearer.
    pub(super) fell_back: bool,
}

/// A point that a ray leaves, in its group.
#[derive(Clone, Copy)]
pub(super) struct OwnDeparture {
    /// `None` for the first group.
    pub(super) place: Option<u32>,
    /// With the face's number in the group.
    pub(super) departure: Departure,
}

/// The rays of a batch under way, in memory that all batches of a call share.
pub(super) struct Workspace<'t> {
    pub(super) walks: Few<Walk<'t>>,
    /// Indices of walks that have not ended.
    pub(super) open: Few<usize>,
    pub(super) queries: Few<Query>,
    /// Rays in the coordinates of a group, and what they hit there.
    pub(super) local: Few<Ray>,
    pub(super) found: Few<Option<Hit>>,
}

/// A list that allocates no memory where a ray is alone.
type Few<T> = SmallVec<[T; 1]>;

/// A ray that is traced in a placement.
pub(super) struct Query {
    pub(super) group: usize,
    pub(super) place: u32,
    /// Index of the ray's walk.
    pub(super) walk: usize,
}

impl<'t> Workspace<'t> {
    /// Makes room for this many rays under way through the boxes of a tree.
    pub(super) fn new(tree: &'t BoxTree, rays: usize) -> Self {
        let ended = || Walk {
            ray: Ray::new(Vector::ZERO, Vector::Z),
            departure: None,
            boxes: tree.ended_walk(),
            best: None,
            next: None,
            fell_back: false,
        };
        let mut walks = Few::with_capacity(rays);
        walks.resize_with(rays, ended);
        Self { walks, open: Few::new(), queries: Few::new(), local: Few::new(), found: Few::new() }
    }

    /// Takes the open walks to the next box that each enters before its hit, and drops from `open` those that have passed all.
    pub(super) fn advance(&mut self) {
        simd::dispatch(Advance { walks: &mut self.walks, open: &mut self.open });
    }
}

/// A ray as it leaves the first group or one placement: where its face is of another, it leaves none.
pub(super) fn leaving(ray: &Ray, departure: Option<OwnDeparture>, place: Option<u32>) -> Ray {
    let own = departure.filter(|from| from.place == place);
    Ray { departure: own.map(|from| from.departure), ..*ray }
}

/// Walks that are to be taken to their next boxes: the four children of a node are tried at once.
struct Advance<'a, 't> {
    walks: &'a mut [Walk<'t>],
    open: &'a mut Few<usize>,
}

impl Kernel for Advance<'_, '_> {
    type Output = ();

    /// A loop, not a closure, which would be compiled without the caller's instruction set.
    #[inline(always)]
    fn run<I: Instructions>(self) {
        let mut kept = 0;
        for k in 0..self.open.len() {
            let walk = self.open[k];
            if self.walks[walk].advance() {
                self.open[kept] = walk;
                kept += 1;
            }
        }
        self.open.truncate(kept);
    }
}

impl Walk<'_> {
    /// Sets `next` to the placement of the next box that the ray enters before its hit; false where there is none. The placement that the
    /// ray leaves is passed over, because it was queried first.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        let own = self.departure.and_then(|from| from.place);
        self.next = self.boxes.next(self.ray.t_max);
        if own.is_some() && self.next == own {
            self.next = self.boxes.next(self.ray.t_max);
        }
        self.next.is_some()
    }

    /// The ray as it leaves the first group or one placement: where its face is of another, it leaves none.
    pub(super) fn local_ray(&self, place: Option<u32>) -> Ray {
        leaving(&self.ray, self.departure, place)
    }

    /// Its hit with the certainty that it has among all structures queried: a miss that is not proved may hide a nearer one.
    pub(super) fn qualified(&self, hit: Hit) -> Hit {
        let is_doubtful = self.fell_back && hit.certainty == Certainty::Certified;
        Hit { certainty: if is_doubtful { Certainty::Uncertified } else { hit.certainty }, ..hit }
    }

    /// Keeps the nearer hit, of equal ones that of the first group or placement, and ends the ray there.
    pub(super) fn take(&mut self, place: Option<u32>, hit: Option<Hit>) {
        let Some(hit) = hit else { return };
        let is_nearer = self.best.is_none_or(|(other, best)| hit.t < best.t || (hit.t == best.t && place < other));
        if is_nearer {
            self.ray.t_max = hit.t;
            self.best = Some((place, hit));
        }
    }
}

//! One ray under way: its frame, what it left, the roots it has met.

use super::geometry::Geometry;
use super::leaf::Leaf;
use super::patch::project;
use super::slabs::RaySlabs;
use super::tolerances::{SAME_PARAMETER, SAME_START, TANGENT, contact_distance};
use super::tree::Tree;
use crate::intersect::Certainty;
use crate::math::{Point, Ray, Uv, Vector, orthonormal_pair};
use crate::model::EdgeId;
use smallvec::SmallVec;

/// Ulps of its largest coordinate by which a ray's origin may miss the point it leaves: it is a rounded `origin + t·direction`
/// of a ray that may have come sixty times as far as the origin lies from zero.
const ORIGIN_ROUNDING: f64 = 64.0;
/// A ray whose origin is off its surface point meets its own root within this many times that distance, unless it leaves at a
/// sine below a sixteenth.
const NEAR_DEPARTURE: f64 = 16.0;
/// By how much the square of a direction's length may miss 1 and count as that: a thousand bounces round by as much.
const UNIT_ROUNDING: f64 = 1e-12;
/// Largest share of a patch by which a departure on its border may lie beyond it, however narrow it is.
const LARGEST_BEYOND: f64 = 0.1;
/// Share of a surface's domain within which parameters lie on its border, where seams and poles make one point of several: a
/// micrometre on a metre.
const BORDER: f64 = 1e-6;

/// A point of the spline on the ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    /// mm along the ray.
    pub(super) t: f64,
    /// Index into the leaves of the model.
    pub(super) leaf: u32,
    /// Local parameters of the leaf.
    pub(super) local: [f64; 2],
    pub(super) certainty: Certainty,
    /// Within the band of a trimming curve.
    pub(super) near_trim: bool,
    /// Its surface parameters where the surface as given settled it: nothing is left to refine.
    pub(super) settled: Option<Uv>,
}

/// The surface point that the ray leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeparturePoint {
    /// Indices into [`Geometry::faces`] and [`Geometry::patches`], and parameters of the surface.
    pub(super) face: u32,
    pub(super) patch: u32,
    pub(super) uv: Uv,
    /// Distance from the ray's origin to the stated surface point, mm.
    pub(super) off: f64,
    /// Below this, mm, the origin is taken to be that point.
    tolerance: f64,
    /// Bound of what its origin, rounded where it stands, is off, mm.
    rounding: f64,
    /// [`contact_distance`] of the patch that it lies on.
    contact: f64,
}

/// The start of a ray that leaves a face of a closed shell in the gap of an edge: it may lie beyond the other face there.
#[derive(Clone, Debug)]
pub(super) struct GapStart {
    /// How far from its start, mm, the other face may be met.
    pub(super) reach: f64,
    /// Whether it leaves its own face outward.
    pub(super) outward: bool,
    /// The edges nearby, and the ways from them into its own face.
    pub(super) edges: SmallVec<[(EdgeId, Vector); 2]>,
}

/// A ray with everything that each leaf needs of it.
pub(super) struct Query {
    /// Origin.
    pub(super) o: Vector,
    /// Direction, of unit length.
    pub(super) d: Vector,
    /// How long the ray's own direction is, by which its range was multiplied: 1 but for rounding coarser than `f64`'s.
    pub(super) length: f64,
    /// Two directions across the ray, which complete a frame with `d`.
    pub(super) n1: Vector,
    pub(super) n2: Vector,
    /// The ray as the hierarchy needs it.
    pub(super) slabs: RaySlabs,
    /// The ray's own least t.
    pub(super) t_min: f64,
    /// Roots before are of no interest: `t_min`, and less for a ray with a `gap_start`.
    pub(super) from: f64,
    /// Roots beyond are of no interest; shrinks with each root found in a search for the first.
    pub(super) t_max: f64,
    /// The ray's own largest t.
    pub(super) limit: f64,
    /// The point that the ray leaves.
    pub(super) departure: Option<DeparturePoint>,
    /// Of a ray that leaves it in the gap of an edge.
    pub(super) gap_start: Option<GapStart>,
    /// The nearest root so far, in a search for the first.
    pub(super) best: Option<Root>,
    /// Whether every root is looked for, not the first alone.
    pub(super) collects_all: bool,
    /// Every root, in a search for all.
    pub(super) all: Vec<Root>,
    /// The least t from which on a region of the ray stayed undecided; infinite where all is decided.
    pub(super) undecided_from: f64,
    /// The t of the nearest root that a trim within its band turned away; infinite without one.
    pub(super) nearest_rejected: f64,
    /// Every such root, in a search for all.
    pub(super) all_rejected: Vec<f64>,
    /// Clipping steps left.
    pub(super) budget: u32,
    /// What it has cost so far.
    pub(super) leaves_tested: u32,
    pub(super) nodes: u32,
    pub(super) clips: u32,
}

impl Query {
    /// No ray yet.
    pub(super) const IDLE: Self = Self {
        o: Vector::ZERO,
        d: Vector::X,
        length: 1.0,
        n1: Vector::Y,
        n2: Vector::Z,
        slabs: RaySlabs::IDLE,
        t_min: 0.0,
        from: 0.0,
        t_max: 0.0,
        limit: 0.0,
        departure: None,
        gap_start: None,
        best: None,
        collects_all: false,
        all: Vec::new(),
        undecided_from: f64::INFINITY,
        nearest_rejected: f64::INFINITY,
        all_rejected: Vec::new(),
        budget: 0,
        leaves_tested: 0,
        nodes: 0,
        clips: 0,
    };

    /// Takes up a ray and forgets the one before, but for what a search for all has collected. Field by field, since building it elsewhere
    /// and moving it here cost 8 % of a ray.
    #[inline(always)]
    pub(super) fn restart(&mut self, ray: &Ray, geometry: &Geometry, tree: &Tree, budget: u32) {
        // Perpendiculars of a direction that is not of unit length would lie across another one.
        let square = ray.direction.length_squared();
        self.length = if (square - 1.0).abs() > UNIT_ROUNDING { square.sqrt() } else { 1.0 };
        let [t_min, t_max] = [ray.t_min, ray.t_max].map(|t| t * self.length);
        let ray = &Ray { direction: ray.direction / self.length, ..*ray }.with_range(t_min, t_max);
        self.o = ray.origin;
        self.d = ray.direction;
        (self.n1, self.n2) = orthonormal_pair(ray.direction);
        self.slabs.restart(ray, tree);
        self.t_min = ray.t_min;
        self.from = ray.t_min;
        self.t_max = ray.t_max;
        self.limit = ray.t_max;
        self.departure = None;
        self.gap_start = None;
        if let Some(from) = ray.departure {
            self.departure = DeparturePoint::new(ray, from.face, from.uv, geometry);
        }
        self.best = None;
        self.undecided_from = f64::INFINITY;
        self.nearest_rejected = f64::INFINITY;
        self.budget = budget;
        self.leaves_tested = 0;
        self.nodes = 0;
        self.clips = 0;
    }

    /// Looks for roots from before the ray's range on, as its start needs.
    pub(super) fn look_back(&mut self, start: GapStart, tree: &Tree) {
        self.from = self.t_min.min(-start.reach);
        self.gap_start = Some(start);
        self.slabs.restart(&Ray::new(self.o, self.d).with_range(self.from, self.t_max), tree);
    }

    /// Whether a root at `t` lies where roots are looked for and before the nearest root so far.
    #[inline(always)]
    pub(super) fn is_in_range(&self, t: f64) -> bool {
        t >= self.from && (t < self.t_max || (t == self.t_max && self.best.is_none()))
    }

    /// Remembers the `t` of a root that a trim within its band has turned away.
    pub(super) fn reject_at_trim(&mut self, t: f64) {
        // What lies before the range is looked at for its gap alone.
        if t < self.t_min {
            return;
        }
        self.nearest_rejected = self.nearest_rejected.min(t);
        if self.collects_all {
            self.all_rejected.push(t);
        }
    }

    /// Keeps a root: in a search for all beside the others, else in place of the one before, and the ray then ends there.
    pub(super) fn accept(&mut self, root: Root) {
        if self.collects_all {
            self.all.push(root);
            return;
        }
        self.t_max = root.t;
        self.slabs.end_at(root.t);
        self.best = Some(root);
    }
}

impl DeparturePoint {
    /// The point at parameters `uv` of a face; `None` where that face is not traced or `uv` is not finite.
    fn new(ray: &Ray, face: crate::math::FaceId, uv: Uv, geometry: &Geometry) -> Option<Self> {
        let face = *geometry.by_id.get(&face)?;
        if !uv.is_finite() {
            return None;
        }
        let patch = geometry.patch_at(&geometry.faces[face as usize], uv);
        let p = &geometry.patches[patch as usize];
        let (s, ..) = project(&geometry.jet(p, p.local(uv)));
        let off = (ray.origin - p.center - s).length();
        let reach = ray.origin.abs().max_element().max(geometry.farthest_start);
        let rounding = ORIGIN_ROUNDING * f64::EPSILON * reach;
        let tolerance = TANGENT.min(SAME_START * p.size()) + rounding;
        Some(Self { face, patch, uv, off, tolerance, rounding, contact: contact_distance(p.size()) })
    }

    /// The departure in the leaf's parameters, which may lie far outside of it; `None` on another face, and on another patch unless it lies
    /// on the common border and that patch goes on there as its own does. `origin` is the ray's.
    pub(super) fn local_to(&self, leaf: &Leaf, origin: Point, geometry: &Geometry) -> Option<[f64; 2]> {
        // Parameters of another face say nothing here; seams and poles are recognised by position, in `is_same_point`.
        if leaf.face != self.face {
            return None;
        }
        let mut local = geometry.patches[leaf.patch as usize].local(self.uv);
        if leaf.patch != self.patch {
            let beyond = local.map(|x| (x - x.clamp(0.0, 1.0)).abs());
            if !beyond.iter().all(|&x| x <= LARGEST_BEYOND) {
                return None;
            }
            local = local.map(|x| x.clamp(0.0, 1.0));
            let patch = &geometry.patches[leaf.patch as usize];
            let (border, du, dv) = project(&geometry.jet(patch, local));
            // On a narrow patch a contact is a large share of it: beside a knot line near the tip of a cone, a root within one counts as
            // on both sides of the line, and so does the departure.
            let way = beyond[0] * du.length() + beyond[1] * dv.length();
            let is_on_border = beyond.iter().all(|&x| x <= SAME_PARAMETER);
            if !is_on_border && !(way <= self.contact + self.rounding + self.off) {
                return None;
            }
            // Beyond a crease the departure is no point of the patch: a ray that starts beside a wall meets it, however far ahead.
            let beside = (origin - patch.center - border).dot(du.cross(dv).normalize_or_zero());
            if beside.abs() > self.tolerance + self.off {
                return None;
            }
        }
        Some(leaf.leaf_parameters(local))
    }

    /// Whether a root that is known to be the only one near the departure, `t` mm along the ray, is the departure itself: always where the
    /// ray starts on it, else within [`NEAR_DEPARTURE`] times the distance by which it starts off it.
    pub(super) fn is_root_at(&self, t: f64) -> bool {
        // An origin that is not where the departure says can be a facet's; its own root is then as near as it is off.
        self.off <= self.tolerance || t.abs() <= NEAR_DEPARTURE * self.off
    }

    /// Whether a root of a leaf, `t` mm along the ray, is the departure under other parameters: across a seam, or at a pole.
    pub(super) fn is_same_point(&self, leaf: &Leaf, local: [f64; 2], t: f64, geometry: &Geometry) -> bool {
        if leaf.face != self.face || t.abs() > NEAR_DEPARTURE * (self.contact + self.rounding + self.off) {
            return false;
        }
        let grid = &geometry.grids[geometry.faces[self.face as usize].grid as usize];
        let patch = &geometry.patches[leaf.patch as usize];
        let uv = patch.uv(leaf.patch_parameters(local));
        // Across a seam or at a pole one point has several parameters, all of them on the border.
        let on_border = |p: Uv| {
            (0..2).any(|d| {
                let b = &grid.breaks[d];
                let (first, last) = (b[0], b[b.len() - 1]);
                let reach = BORDER * (last - first);
                p[d] <= first + reach || p[d] >= last - reach
            })
        };
        on_border(uv) && on_border(self.uv)
    }
}

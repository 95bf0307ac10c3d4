//! What a search has found, as a hit with its certificate, and the searches that callers request.

use super::leaf_test;
use super::patch::{self, Patch};
use super::query::{Query, Root};
use super::structure::Exact;
use super::tolerances::{CONTACT_LENGTH, contact_distance};
use super::{net, traversal};
use crate::intersect::{Certainty, Cost, Footprint, Hit, Intersector};
use crate::math::{Ray, Uv, Vector};

/// The first hit with everything that is known about it; also a miss has a certainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The first hit; `None` for a miss.
    pub hit: Option<Hit>,
    /// Of the hit or of the miss: a miss is `Certified` or `Uncertified`.
    pub certainty: Certainty,
    /// Whether a trim lies within the band of the hit, or of a nearer root that the trim turned away.
    pub near_trim: bool,
}

/// All crossings of a ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// The crossings in order of t.
    pub crossings: Vec<Hit>,
    /// The t, in order, of crossings with a trim within its band, and of those that such a trim turned away.
    pub near_trims: Vec<f64>,
    /// The t from which on crossings may be missing, as the budget ended or a place stayed undecided; infinite where all are found.
    pub undecided_from: f64,
}

/// A search for all crossings may take so many times the budget of one for the first.
const BUDGET_OF_ALL: u32 = 4;
/// Crossings of one face are one that lie within a contact of each other along the ray, and this share of their distance: 450 ulps.
const SAME_CROSSING_FAR: f64 = 1e-13;
/// Ulps of the origin's largest coordinate within which they are one too: leaves far from the origin of the model are placed to some.
const SAME_CROSSING_PLACED: f64 = 64.0;
/// A correction that moves a root farther is not one: where the search went by the net in the ray's frame, rounding may say
/// otherwise, and its word stands.
const LARGEST_CORRECTION: f64 = 1e-6;
/// A derivative of the surface as given is trusted when it is longer than this many times the rounding of the net's points: it is
/// not rounded itself, the points it comes from are.
const GIVEN_ROUNDING: f64 = 4.0;
/// A normal is taken where the next step is below this, as a share of a leaf: with 2e-12 the angular momentum of a ray in a mirror
/// ball drifted by 5e-10 in 20,000 bounces.
const UNBIASED: f64 = 2e-15;
/// By how much the square of a direction's length may miss 1: normalised in `f32`, and some.
const SINGLE_ROUNDING: f64 = 1e-5;
/// Corrections before a hit is named; steps square, so that the second is mostly the last.
const CORRECTIONS: usize = 4;

impl Exact {
    /// Finds the first hit with `t` in the range of the ray, in the model's coordinates, and says whether it or the miss is proved. A ray
    /// whose origin is not finite, direction not of unit length or range not a number misses, uncertified. The point that the ray leaves
    /// does not count.
    pub fn first(&self, ray: &Ray, cost: &mut Cost) -> Answer {
        let mut query = Query::IDLE;
        self.restart(&mut query, ray, self.settings.budget);
        traversal::search(self, &mut query);
        self.answer(&query, cost)
    }

    /// Finds every crossing in the range of the ray, in order of t; one found from both sides of a patch border counts once. Whether any
    /// may be missing is reported by [`Self::passage`] alone.
    pub fn crossings(&self, ray: &Ray, cost: &mut Cost) -> Vec<Hit> {
        self.passage(ray, cost).crossings
    }

    /// Finds every crossing in the range of the ray, in order of t, and where trims were near. Crossings from
    /// [`Passage::undecided_from`] on are [`Certainty::Uncertified`].
    pub fn passage(&self, ray: &Ray, cost: &mut Cost) -> Passage {
        let mut query = Query::IDLE;
        self.restart(&mut query, ray, self.settings.budget.saturating_mul(BUDGET_OF_ALL));
        // Else the first root would end the search.
        query.collects_all = true;
        traversal::search(self, &mut query);
        cost.rays += 1;
        cost.nodes += u64::from(query.nodes);
        cost.tests += u64::from(query.leaves_tested);
        let mut roots = std::mem::take(&mut query.all);
        roots.sort_by(|a, b| a.t.total_cmp(&b.t));
        let mut near_trims = query.all_rejected.clone();
        near_trims.extend(roots.iter().filter(|r| r.near_trim).map(|r| r.t));
        near_trims.sort_by(f64::total_cmp);
        let mut hits: Vec<Hit> = Vec::new();
        // In order of t, so that the two crossings of a border between patches, one from either side, are found by
        // looking back.
        for root in roots {
            let mut hit = self.hit(&query, &root);
            // From where the budget ended on crossings may be missing: none behind that is known to be the next
            // one.
            if root.t >= query.undecided_from {
                hit.certainty = Certainty::Uncertified;
            }
            let patch = &self.geometry.patches[hit.primitive as usize];
            if !repeats(&hits, &hit, root.certainty, ray, patch) {
                hits.push(hit);
            }
        }
        near_trims.iter_mut().for_each(|t| *t /= query.length);
        Passage { crossings: hits, near_trims, undecided_from: query.undecided_from / query.length }
    }

    /// Takes up a ray with this budget of clipping steps; one that is not sound will miss, undecided.
    #[inline(always)]
    pub(super) fn restart(&self, query: &mut Query, ray: &Ray, budget: u32) {
        query.restart(ray, &self.geometry, &self.tree, budget);
        // NaN falls through every test of a box: an unsound ray is not searched, and its miss is no certified one.
        if !is_sound(ray) {
            query.slabs.misses = true;
            query.undecided_from = f64::NEG_INFINITY;
        } else if let Some(start) = self.gap_start(query) {
            query.look_back(start, &self.tree);
        }
    }

    /// Turns what a search for the first has found into an answer, and adds its work to `cost`.
    #[inline(always)]
    pub(super) fn answer(&self, query: &Query, cost: &mut Cost) -> Answer {
        cost.rays += 1;
        cost.nodes += u64::from(query.nodes);
        cost.tests += u64::from(query.leaves_tested);
        let Some(root) = &query.best else {
            // A miss is proved only where nothing was left undecided.
            let undecided = query.undecided_from < f64::INFINITY;
            let certainty = if undecided { Certainty::Uncertified } else { Certainty::Certified };
            cost.fallbacks += u64::from(certainty == Certainty::Uncertified);
            return Answer { hit: None, certainty, near_trim: query.nearest_rejected < f64::INFINITY };
        };
        // What was left undecided behind the hit does not touch it.
        let certainty = if query.undecided_from <= root.t { Certainty::Uncertified } else { root.certainty };
        cost.fallbacks += u64::from(certainty == Certainty::Uncertified);
        let near_trim = root.near_trim || query.nearest_rejected <= root.t;
        let hit = Some(Hit { certainty, ..self.hit(query, root) });
        Answer { hit, certainty, near_trim }
    }

    /// Turns a root into a hit: refines a certified one by Newton's method, and finds parameters, normal, face and patch.
    #[inline(always)]
    fn hit(&self, query: &Query, root: &Root) -> Hit {
        let (leaf, label) = (&self.linearizations[root.leaf as usize], &self.labels[root.leaf as usize]);
        let control = leaf.net(&self.geometry.nets);
        let mut t = root.t;
        let mut local = root.local;
        let mut jet = net::evaluate(control, leaf.degree, local[0], local[1]);
        // Certified roots alone: at a contact the Jacobian is singular and a step could go anywhere, and what 32
        // digits have settled gains nothing.
        if root.certainty == Certainty::Certified && root.settled.is_none() {
            let oc = query.o - leaf.center;
            let mut last = f64::INFINITY;
            for _ in 0..CORRECTIONS {
                let (step, t_after) = leaf_test::newton_step(query, oc, &jet);
                let size = step[0].abs().max(step[1].abs());
                if !(size < LARGEST_CORRECTION) {
                    break;
                }
                t = t_after;
                local = [local[0] - step[0], local[1] - step[1]];
                // The normal is that of the point before the step, always on the side that Newton's method comes from.
                if size < UNBIASED || size > 0.5 * last {
                    break;
                }
                last = size;
                jet = net::evaluate(control, leaf.degree, local[0], local[1]);
            }
        }
        // Into the ray's own range, before which roots lie that gaps have moved; `t_max` has come down to the root by now.
        t = t.min(query.limit).max(query.t_min);
        // A root may lie beyond its leaf by the margin of Newton's method, but the parameters of a hit are in the
        // domain.
        let inside = local.map(|x| x.clamp(0.0, 1.0));
        let uv = root.settled.unwrap_or_else(|| label.uv(inside));
        // On an ill-scaled patch the derivatives of the net have lost the digits that a normal needs.
        let regular = if label.ill_scaled { None } else { patch::regular_normal(&jet, label.rounding) };
        let normal = label.sign * regular.unwrap_or_else(|| self.delicate_normal(root.leaf, uv, inside));
        let (face, primitive, certainty) = (label.face, label.patch, root.certainty);
        Hit {
            t: t / query.length,
            normal,
            geometric_normal: normal,
            face,
            primitive,
            triangle: None,
            uv,
            certainty,
        }
    }

    /// The unit normal along `Su × Sv` on a leaf where `f64` leaves too little of it: of the surface as given, and its limit at singular
    /// points of that. `uv` and `local` are the same place, on the surface and in the leaf.
    #[cold]
    fn delicate_normal(&self, index: u32, uv: Uv, local: [f64; 2]) -> Vector {
        let leaf = &self.leaves[index as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        // On other patches only poles and cusps come here, where control points that should coincide differ by their own rounding:
        // with them 23 of 800 rays at the poles of a ball had a wrong normal. The limit does not see it.
        let given = patch.ill_scaled.then(|| self.geometry.reference(patch).tangents(uv));
        given.and_then(|[du, dv]| patch::cross_normal(du, dv, GIVEN_ROUNDING * patch.rounding)).unwrap_or_else(
            || patch::limit_normal(leaf.net(&self.geometry.nets), leaf.degree, local, patch.rounding),
        )
    }
}

/// Whether a crossing on this patch repeats one of `hits`, in order of t: the same face at the same place with the same side towards the
/// ray; where both are uncertified they may lie farther apart. `certainty` is that of the crossing's root.
fn repeats(hits: &[Hit], hit: &Hit, certainty: Certainty, ray: &Ray, patch: &Patch) -> bool {
    let direction = ray.direction;
    let placed = SAME_CROSSING_PLACED * f64::EPSILON * ray.origin.abs().max_element();
    let contact = contact_distance(patch.size());
    let sine = hit.geometric_normal.dot(direction).abs();
    // What is off across the ray is that over the sine along it: by the rounding of control points where both are certified. At a pole
    // clipping ends on boxes a contact wide, as often as patches meet there.
    let along = |across: f64| (across / sine).min(CONTACT_LENGTH * contact);
    let apart = contact + SAME_CROSSING_FAR * hit.t.abs() + placed;
    let (close, smeared) = (apart + along(patch.rounding), apart + along(2.0 * contact));
    let open = |c: Certainty| c == Certainty::Uncertified;
    let leaves = |h: &Hit| h.geometric_normal.dot(direction) > 0.0;
    hits.iter().rev().take_while(|h| hit.t - h.t <= smeared).any(|h| {
        h.face == hit.face
            && (hit.t - h.t <= close || open(certainty) && open(h.certainty))
            && leaves(h) == leaves(hit)
    })
}

/// Whether a ray has a finite origin, a direction of unit length but for rounding, and no NaN as an end of its range.
fn is_sound(ray: &Ray) -> bool {
    // NaN is beyond any bound.
    let is_unit = (ray.direction.length_squared() - 1.0).abs() <= SINGLE_ROUNDING;
    ray.origin.is_finite() && is_unit && !ray.t_min.is_nan() && !ray.t_max.is_nan()
}

impl Intersector for Exact {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.first(ray, cost).hit
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        traversal::search_batch(self, rays, hits, cost);
    }

    fn footprint(&self) -> Footprint {
        Footprint {
            bytes: self.bytes(),
            primitives: self.geometry.patches.len(),
            build_seconds: self.build_seconds,
        }
    }
}

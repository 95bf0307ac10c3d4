//! What pilot rays find on the faces of a model, and the tolerances that follow from radius and incidence there.

use crate::intersect::Hit;
use crate::math::{FaceId, Ray};
use crate::model::{Face, Model};
use crate::study::tolerance_plan::{RelativeTolerance, TolerancePlan};
use rustc_hash::FxHashMap;

/// Least |cos| of the incidence of a pilot: beyond 89.94° a mirrored ray errs by more than any tolerance mends.
const GRAZING: f64 = 1e-3;
/// Least 2·tan i of a place: hits within 0.03° of the normal ask for no tolerance of their own.
const LEAST_TILT: f64 = 1e-3;
/// Least radius of curvature that a tolerance follows is kept within these, mm.
const RADII_MM: [f64; 2] = [1e-9, 1e9];
/// Largest radius, mm: flat.
const FLATTEST_MM: f64 = 1e12;
/// Least and largest factor of one correction.
const STEPS: [f64; 2] = [1e-3, 30.0];

/// What is known of one pilot's hit; the radius of curvature in mm.
#[derive(Clone, Copy, Debug)]
struct PilotHit {
    /// Index of the face among the distinct ones.
    face: usize,
    radius: f64,
    /// 2·tan i: the mirrored ray errs by that times sag over radius.
    tilt: f64,
}

/// The pilots' hits, face by face.
pub(super) struct Survey {
    /// The placed faces of each distinct face.
    faces: Vec<Vec<FaceId>>,
    /// Index of the distinct face of each placed one; `None` for ready meshes.
    of: Vec<Option<usize>>,
    /// Whether each placed face is a plane or a ready mesh, of which facets have the normals.
    flat: Vec<bool>,
    pilots: Vec<PilotHit>,
}

/// Hits that a face needs for a plan of its own.
const ENOUGH: usize = 100;
/// Hits that it needs for its own 99th percentile to be worth following.
const MANY: usize = 400;

impl Survey {
    /// Numbers the distinct faces of a model, and notes radius and tilt where rays hit them; `truth` are their exact hits.
    pub(super) fn new(model: &Model, rays: &[Ray], truth: &[Option<Hit>]) -> Self {
        let placed: Vec<_> = model.placed_faces().collect();
        let mut names: FxHashMap<*const Face, usize> = FxHashMap::default();
        let flat = placed.iter().map(|p| p.face.is_none_or(Face::is_plane)).collect();
        let mut survey = Self { faces: Vec::new(), of: Vec::with_capacity(placed.len()), flat, pilots: Vec::new() };
        for p in &placed {
            survey.of.push(p.face.map(|face| {
                // One face of a part in many placements is one face: its rays are counted together.
                let k = *names.entry(std::ptr::from_ref(face)).or_insert(survey.faces.len());
                if k == survey.faces.len() {
                    survey.faces.push(Vec::new());
                }
                survey.faces[k].push(p.id);
                k
            }));
        }
        for (ray, hit) in rays.iter().zip(truth) {
            let Some(h) = hit else { continue };
            let i = h.face.index();
            let (Some(&Some(face)), Some(p)) = (survey.of.get(i), placed.get(i)) else { continue };
            let Some(forms) = p.face.and_then(|f| f.surface.forms(h.uv)) else { continue };
            // The largest curvature is what bends the mirrored light most.
            let radius = p.placement.scale / forms.largest_curvature();
            let cos = h.normal.dot(ray.direction).abs().clamp(GRAZING, 1.0);
            if radius > 0.0 {
                survey.pilots.push(PilotHit { face, radius, tilt: 2.0 * (1.0 - cos * cos).sqrt() / cos });
            }
        }
        survey
    }

    /// Whether facets of a face have its normals however coarse they are, so that hits on it show no error.
    pub(super) fn is_flat(&self, face: FaceId) -> bool {
        self.flat.get(face.index()).copied().unwrap_or(false)
    }

    /// Makes the plan by the formulas, for an angle of `epsilon` rad: sag ≤ ε·R/(2·tan i) for interpolated normals, 1 − cos(ε/2) of R for
    /// `flat` ones, each for 99 % of a face's hits. Faces with fewer than [`ENOUGH`] hits share one tolerance.
    pub(super) fn plan(&self, epsilon: f64, flat: bool, [finest_mm, coarsest_mm]: [f64; 2]) -> TolerancePlan {
        let of = |faces: Vec<FaceId>, pilots: &mut [PilotHit]| {
            pilots.sort_by(|a, b| a.tilt.total_cmp(&b.tilt));
            let count = pilots.len();
            let at = |share: f64| ((count as f64 * share) as usize).min(count.saturating_sub(1));
            let tilt = pilots.get(at(0.99)).map_or(1.0, |p| p.tilt.max(LEAST_TILT));
            // 1 − cos(ε/2), which the cosine itself would round to none below 1e-6°.
            let of_radius = if flat { 2.0 * (0.25 * epsilon).sin().powi(2) } else { epsilon / tilt };
            // The radii without their outermost 2 %: a few rays at a sharp end should not set the scale.
            pilots.sort_by(|a, b| a.radius.total_cmp(&b.radius));
            let end = |k: usize| pilots.get(k).map_or(1.0, |p| p.radius);
            // Beyond the radius at which the coarsest tolerance is reached nothing changes; infinity is no length.
            let least = end(at(0.02)).clamp(RADII_MM[0], RADII_MM[1]);
            RelativeTolerance { faces, of_radius, radii_mm: [least, end(at(0.98)).clamp(least, FLATTEST_MM)] }
        };
        let mut own: Vec<Vec<PilotHit>> = vec![Vec::new(); self.faces.len()];
        for p in &self.pilots {
            own[p.face].push(*p);
        }
        let mut places = Vec::new();
        // With fewer hits a 99th percentile is one or two rays.
        for (faces, pilots) in self.faces.iter().zip(&mut own).filter(|(_, pilots)| pilots.len() >= ENOUGH) {
            places.push(of(faces.clone(), pilots));
        }
        TolerancePlan { other: of(Vec::new(), &mut self.pilots.clone()), places, coarsest_mm, finest_mm }
    }

    /// Returns for each placed face the index of its place in the plan; `None` where it shares the common tolerance.
    fn place_of(&self, plan: &TolerancePlan) -> Vec<Option<usize>> {
        let mut all = vec![None; self.of.len()];
        for (k, place) in plan.places.iter().enumerate() {
            for f in &place.faces {
                all[f.index()] = Some(k);
            }
        }
        all
    }

    /// Estimates the facets that a plan makes, from those that `other` made (`made`, the face of each): on each face they go with the
    /// inverse of the tolerance, and are half of those at least.
    pub(super) fn expected_facets(&self, plan: &TolerancePlan, other: &TolerancePlan, made: &[FaceId]) -> f64 {
        let places = self.place_of(plan);
        let mean = |plan: &TolerancePlan, k: Option<usize>| {
            let [a, b] = plan.range(k.and_then(|k| plan.places.get(k)).unwrap_or(&plan.other)).0;
            // The geometric mean: between its ends a tolerance follows the radius.
            (a * b).sqrt()
        };
        // Both plans stand on the same survey, so their places are the same.
        let ratio = |k: Option<usize>| mean(other, k) / mean(plan, k);
        let ratios: Vec<f64> = (0..plan.places.len()).map(|k| ratio(Some(k))).collect();
        let rest = ratio(None);
        let of = |f: &FaceId| places.get(f.index()).copied().flatten().map_or(rest, |k| ratios[k]);
        // Borders alone keep a coarse face from having fewer facets still.
        made.iter().map(|f| of(f).max(0.5)).sum()
    }

    /// Tightens or loosens every place of `plan` with [`MANY`] measured errors, degrees, and the common tolerance, so that p99 comes to
    /// `epsilon_deg`: the error goes with the sag to the power `order`.
    pub(super) fn adapt(&self, plan: &mut TolerancePlan, errors: &[(FaceId, f64)], epsilon_deg: f64, order: f64) {
        let places = self.place_of(plan);
        let mut own: Vec<Vec<f64>> = vec![Vec::new(); plan.places.len()];
        for &(face, error) in errors {
            if let Some(k) = places.get(face.index()).copied().flatten() {
                own[k].push(error);
            }
        }
        for (place, errors) in plan.places.iter_mut().zip(&mut own).filter(|(_, e)| e.len() >= MANY) {
            place.of_radius *= p99(errors).map_or(1.0, |error| tolerance_factor(error, epsilon_deg, order));
        }
        let mut all: Vec<f64> = errors.iter().map(|e| e.1).collect();
        plan.other.of_radius *= p99(&mut all).map_or(1.0, |error| tolerance_factor(error, epsilon_deg, order));
    }
}

/// Returns what to multiply a tolerance with so that `error` becomes `wanted`, within [`STEPS`]: the power law holds near where it was
/// measured.
pub(super) fn tolerance_factor(error: f64, wanted: f64, order: f64) -> f64 {
    (wanted / error.max(f64::MIN_POSITIVE)).powf(1.0 / order).clamp(STEPS[0], STEPS[1])
}

/// Returns the 99th percentile, `None` of nothing; puts `errors` into another order.
pub(super) fn p99(errors: &mut [f64]) -> Option<f64> {
    if errors.is_empty() {
        return None;
    }
    let k = ((errors.len() as f64 * 0.99).ceil() as usize).clamp(1, errors.len()) - 1;
    Some(*errors.select_nth_unstable_by(k, f64::total_cmp).1)
}

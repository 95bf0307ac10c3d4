//! A part in all its places: which tolerance its faces are held to there.

use super::face_surface::FaceSurface;
use super::proof_steps::ProofSteps;
use super::settings::{FaceSelector, Settings, ToleranceField};
use crate::math::FaceId;
use crate::model::{Face, Model, Part, PartId};

/// A part with the places at which its instances stand.
pub(super) struct PlacedPart<'m> {
    pub(super) part: &'m Part,
    /// The first placed face of each instance.
    pub(super) firsts: Vec<u32>,
    /// Largest scale of a placement; 0 without one.
    pub(super) scale: f64,
}

impl<'m> PlacedPart<'m> {
    /// Looks up the instances of a part; without one it has no places and scale 0.
    pub(super) fn new(model: &'m Model, part: PartId) -> Self {
        let uses = (0..model.instances.len()).filter(|&i| model.instances[i].part == part);
        let scale = uses.clone().map(|i| model.instances[i].placement.scale.abs()).fold(0.0, f64::max);
        Self { part: model.part(part), firsts: uses.map(|i| model.first_face(i).0).collect(), scale }
    }

    /// Whether the part has an instance.
    pub(super) fn is_placed(&self) -> bool {
        !self.firsts.is_empty()
    }

    /// Returns the tolerance (mm of the scene, tightest and loosest as given) and radii of the `k`-th face; an override for any of its
    /// places holds for all.
    fn tolerance(&self, settings: &Settings, k: usize, face: &Face) -> ([f64; 2], [f64; 2]) {
        let placed: Vec<FaceId> = self.firsts.iter().map(|first| FaceId(first + k as u32)).collect();
        placed_tolerance(settings, self.part, face, &placed)
    }

    /// Returns the tightest tolerance of the `k`-th face in the part's own lengths, angles not considered.
    pub(super) fn tightest_tolerance(&self, settings: &Settings, k: usize, face: &Face) -> f64 {
        let (tolerance, radii) = self.tolerance(settings, k, face);
        ToleranceField::new(tolerance, radii, settings.law, self.scale).tightest()
    }

    /// Returns the surface of the `k`-th face with its tolerance in the part's lengths; `None` where a control point, weight or knot is no
    /// usable number.
    pub(super) fn surface(&self, settings: &Settings, k: usize, face: &'m Face) -> Option<FaceSurface<'m>> {
        let (tolerance, radii) = self.tolerance(settings, k, face);
        is_finite(face).then(|| {
            let field =
                ToleranceField::new(tolerance, radii, settings.law, self.scale).with_angle(settings.angle_deg);
            // Faces that were not read from a file have a gap of zero whether it was measured or not.
            let mut surface = FaceSurface::new(&face.surface, face.reversed, field);
            surface.steps = ProofSteps::new(settings.most_steps);
            surface.gap = Some(face.gap).filter(|&g| g > 0.0);
            surface
        })
    }
}

/// Whether a face's control points are finite, its weights positive and its domain a finite rectangle.
fn is_finite(face: &Face) -> bool {
    let s = &face.surface;
    let [[u0, u1], [v0, v1]] = s.domain();
    let points = s.points.iter().all(|p| p.is_finite() && p.w > 0.0);
    points && u0 < u1 && v0 < v1 && (u1 - u0).is_finite() && (v1 - v0).is_finite()
}

/// Returns the tolerances and radii, mm, of a face at its places by the last override that matches, else those of the settings.
fn placed_tolerance(settings: &Settings, part: &Part, face: &Face, placed: &[FaceId]) -> ([f64; 2], [f64; 2]) {
    let matches = |place: &FaceSelector| match place {
        FaceSelector::Part(name) => *name == part.name,
        FaceSelector::Face(name) => *name == face.name,
        FaceSelector::Entity(id) => face.entity == Some(*id),
        FaceSelector::Placed(ids) => placed.iter().any(|f| ids.contains(f)),
    };
    // The last override that matches counts, as with rules in a style sheet.
    let last = settings.overrides.iter().rev().find(|o| matches(&o.place));
    last.map_or((settings.tolerance, settings.radii), |o| (o.tolerance, o.radii.unwrap_or(settings.radii)))
}

//! A part in all its places: which tolerance its faces are held to there.

use super::expected_cells::angle_within_budget;
use super::face_surface::FaceSurface;
use super::proof_steps::ProofSteps;
use super::settings::{Settings, ToleranceField, ToleranceScope};
use crate::math::FaceId;
use crate::model::{Face, Model, Part};

/// A part with the places at which its instances stand.
pub(super) struct PlacedPart<'m> {
    pub(super) part: &'m Part,
    /// The first placed face of each instance.
    pub(super) firsts: Vec<u32>,
    /// Largest scale of a placement; 0 without one.
    pub(super) scale: f64,
}

impl<'m> PlacedPart<'m> {
    /// Looks up the instances of all parts, by part; one without any has no places and scale 0.
    pub(super) fn all(model: &'m Model) -> Vec<Self> {
        let mut placed: Vec<Self> =
            model.parts.iter().map(|part| Self { part, firsts: Vec::new(), scale: 0.0 }).collect();
        for (instance, first) in model.instances.iter().zip(model.first_faces()) {
            let part = &mut placed[instance.part.0 as usize];
            part.firsts.push(first.0);
            // A part is meshed once for all of its places: for the largest of them, or its facets there would be too
            // coarse.
            part.scale = part.scale.max(instance.placement.scale.abs());
        }
        placed
    }

    /// Whether the part has an instance.
    pub(super) fn is_placed(&self) -> bool {
        !self.firsts.is_empty()
    }

    /// Returns the tolerance (mm of the scene, tightest and loosest as given) and radii, mm, of the `k`-th face, by the last override that
    /// matches, else those of the settings; an override for any of its places holds for all.
    fn tolerance(&self, settings: &Settings, k: usize, face: &Face) -> ([f64; 2], [f64; 2]) {
        let matches = |scope: &ToleranceScope| match scope {
            ToleranceScope::Part(name) => *name == self.part.name,
            ToleranceScope::Face(name) => *name == face.name,
            ToleranceScope::Entity(id) => face.entity == Some(*id),
            ToleranceScope::Placed(ids) => self.firsts.iter().any(|first| ids.contains(&FaceId(first + k as u32))),
        };
        // The last override that matches counts, as with rules in a style sheet.
        let last = settings.overrides.iter().rev().find(|o| matches(&o.scope));
        last.map_or((settings.tolerance, settings.radii), |o| (o.tolerance, o.radii.unwrap_or(settings.radii)))
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
            let field = ToleranceField::new(tolerance, radii, settings.law, self.scale);
            // Faces that were not read from a file have a gap of zero whether it was measured or not.
            let mut surface = FaceSurface::new(&face.surface, face.reversed, field);
            let angle = settings.angle_deg.map(f64::to_radians);
            surface.field.angle = angle.map(|asked| angle_within_budget(face, &surface, settings.budget, asked));
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

//! How many facets a model will have, foretold from the curvature of its faces before any is made.

use crate::math::Uv;
use crate::model::{Face, Model};

/// Samples across a face in each direction: within a tenth for a sphere, and it is the order of size that counts.
const SAMPLES: usize = 8;

/// Returns about how many facets the faces of a model that bend in two directions need within a tolerance, mm. Those that bend in one alone
/// are left out: their facets may be as long as they are.
///
/// A square of side s lies up to s² κ / 4 off a sphere of curvature κ; of other surfaces κ is √|κ₁ κ₂|.
pub(super) fn expected_facets(model: &Model, tolerance_mm: f64) -> f64 {
    let bent = |face: &Face, scale: f64| scale * root_curvature_integral(face) / (4.0 * tolerance_mm);
    model.placed_faces().filter_map(|placed| Some(bent(placed.face?, placed.placement.scale))).sum()
}

/// Returns √|κ₁ κ₂| summed over the area of a face, mm: over the box around its trims in parameters.
fn root_curvature_integral(face: &Face) -> f64 {
    let [[mut u0, mut u1], [mut v0, mut v1]] = face.surface.domain();
    let loops = face.bounding_loops();
    let ends: Vec<Uv> = loops.iter().flat_map(|l| &l.uses).flat_map(|u| [u.start(), middle(u), u.end()]).collect();
    // A file's sphere of a kilometre may be there for a lens of 20 mm.
    if !ends.is_empty() {
        let [low, high] =
            [ends.iter().fold(ends[0], |a, b| a.min(*b)), ends.iter().fold(ends[0], |a, b| a.max(*b))];
        (u0, u1, v0, v1) = (low.x.max(u0), high.x.min(u1), low.y.max(v0), high.y.min(v1));
    }
    let size = Uv::new(u1 - u0, v1 - v0) / SAMPLES as f64;
    let at = |k: usize| Uv::new(u0, v0) + size * Uv::new((k / SAMPLES) as f64 + 0.5, (k % SAMPLES) as f64 + 0.5);
    let share = |k: usize| {
        // At a pole, which has no area, there are no forms.
        let forms = face.surface.forms(at(k))?;
        let ([e, f, g], [one, other]) = (forms.first, forms.principal());
        Some((e * g - f * f).max(0.0).sqrt() * (one * other).abs().sqrt())
    };
    (0..SAMPLES * SAMPLES).filter_map(share).filter(|share| share.is_finite()).sum::<f64>()
        * size.x.max(0.0)
        * size.y.max(0.0)
}

/// Returns the parameters half-way along a use of an edge.
fn middle(edge: &crate::model::EdgeUse) -> Uv {
    let [t0, t1] = edge.uv.domain();
    edge.uv.evaluate(0.5 * (t0 + t1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Vector};
    use crate::model::{Part, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// A sphere of radius R has 4 π R² of area and a square s² = 4 t R on it: π R / t squares. A cylinder has none that counts.
    #[test]
    fn a_sphere_needs_as_many_as_squares_cover_it() {
        let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, 5000.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]));
        let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 5000.0, [0.0, TAU], [0.0, 1e5]));
        let shell = Shell { faces: vec![ball, tube], ..Shell::default() };
        let mut model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        model.instances[0].placement = Frame { scale: 2.0, ..Frame::translation(Vector::X) };
        let squares = PI * 10_000.0 / 0.2;
        assert!((expected_facets(&model, 0.2) / squares - 1.0).abs() < 0.1, "{}", expected_facets(&model, 0.2));
    }
}

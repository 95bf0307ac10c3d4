//! How many cells the curvature of a face foretells, for its tolerance and for an angle.

use super::border::polygons;
use super::face_surface::FaceSurface;
use crate::math::Uv;
use crate::math::polygon::is_inside_sides;
use crate::model::Face;
use crate::nurbs::FundamentalForms;
use std::f64::consts::FRAC_PI_2;

/// Places along each side of a face's parameter box at which its curvature is evaluated.
const PLACES: usize = 12;
/// Share of the places, those of sharpest curvature, that are left out: near a pole or a kink one place says nothing of its surroundings.
const SHARPEST_PLACES: f64 = 0.1;
/// Pieces in which a curve of a trim is looked at.
const TRIM_STEPS: u32 = 8;
/// How many times the cells that a face is expected to need it may have: [`expected_cells`] estimates from below, and halving makes each
/// side of a cell as short as half the necessary length, as on a torus, which takes 4.2 times.
pub(super) const TIMES_EXPECTED: f64 = 8.0;
/// How many times the cells that are expected of an angle a face may take: diagonals turn farther than sides, halving makes cells smaller
/// than necessary, and the border takes some.
const TIMES_OF_ANGLE: f64 = 10.0;
/// Cells that any face may have for an angle.
const LEAST_GRANTED: f64 = 2000.0;
/// An angle, radians, below which none is considered: rounding turns the normals of small facets by as much.
const LEAST_ANGLE: f64 = 1e-9;
/// By how much an angle grows at least that takes too many cells.
const ANGLE_STEP: f64 = 1.01;

/// Estimates from below how many cells a face needs for its tolerance, not whole: see [`cells_of_chords`], of chords of √(8ξ / k). 1 for a
/// plane.
pub(super) fn expected_cells(face: &Face, surface: &FaceSurface<'_>) -> f64 {
    cells_of_chords(face, surface, |forms, along, tolerance| {
        (forms.normal_curvature(along).abs() / (8.0 * tolerance)).sqrt()
    })
}

/// Returns the least angle, radians and not below the one that was `asked` for, to which a face can be held within a budget of cells: the
/// normals of a chord turn by twice the angle at most.
///
/// Where cells of a smaller one end the budget midway, coarse ones are left beside fine ones, with facets between them that stand upright
/// within the tolerance: at 0.03° a lens got three quarters more area.
pub(super) fn angle_within_budget(face: &Face, surface: &FaceSurface<'_>, budget: usize, asked: f64) -> f64 {
    // A plane has one normal.
    if surface.affine {
        return asked;
    }
    let cells = budget as f64 / TIMES_OF_ANGLE;
    let mut angle = asked.max(LEAST_ANGLE);
    loop {
        let times_too_many = cells_of_angle(face, surface, angle) / cells;
        // Beyond a right angle there is nothing to gain, however few cells there may be.
        if times_too_many <= 1.0 || angle > FRAC_PI_2 {
            return if angle > LEAST_ANGLE { angle } else { asked };
        }
        // Of a ball the square of it decides, of a tube, which takes more rounds, the angle itself.
        angle *= times_too_many.sqrt().max(ANGLE_STEP);
    }
}

/// Returns how many cells a face is granted for its tolerance and an angle, radians, together: more only a fold or a pole asks for.
pub(super) fn cells_granted_for_angle(face: &Face, surface: &FaceSurface<'_>, angle: f64) -> usize {
    (LEAST_GRANTED + TIMES_OF_ANGLE * (cells_of_angle(face, surface, angle) + expected_cells(face, surface)))
        as usize
}

/// Estimates from below how many cells a face needs for an angle, radians, alone, as [`expected_cells`] does for its tolerance: normals
/// turn by twice the angle along the chord of an arc, and by the angle about a straight line of a saddle, where a facet has the normal of
/// one end.
fn cells_of_angle(face: &Face, surface: &FaceSurface<'_>, angle: f64) -> f64 {
    cells_of_chords(face, surface, |forms, along, _| {
        (0.5 * forms.normal_curvature(along).abs()).max(forms.saddle_torsion(along)) / angle
    })
}

/// The mean over a grid of places inside a face's border, the sharpest tenth left out, of its chords along u times those along v, as many
/// as `per_mm` says for the forms there, a direction in parameters and a tolerance, mm. 1 for a plane.
fn cells_of_chords(
    face: &Face,
    surface: &FaceSurface<'_>,
    per_mm: impl Fn(&FundamentalForms, Uv, f64) -> f64,
) -> f64 {
    if surface.affine {
        return 1.0;
    }
    let border: Vec<[Uv; 2]> = polygons::loops(face)
        .iter()
        .flat_map(|l| &l.uses)
        .flat_map(|u| {
            let [t0, t1] = u.uv.domain();
            let at = move |i: u32| u.uv.evaluate(t0 + (t1 - t0) * f64::from(i) / f64::from(TRIM_STEPS));
            (0..TRIM_STEPS).map(move |i| [at(i), at(i + 1)]).collect::<Vec<_>>()
        })
        .collect();
    let ends = border.iter().flatten();
    let (lo, hi) = ends.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let [[u0, u1], [v0, v1]] = surface.spline.domain();
    let (lo, hi) = (lo.max(Uv::new(u0, v0)), hi.min(Uv::new(u1, v1)));
    let size = hi - lo;
    // How many cells the whole box would take if it were everywhere as it is at one place.
    let cells_if_alike = |uv: Uv| -> Option<f64> {
        let d = surface.second_derivatives(uv);
        let forms = FundamentalForms::new(&d)?;
        let tolerance = surface.tolerance(uv);
        let chords = |along: Uv, length: f64| (per_mm(&forms, along, tolerance) * length).max(1.0);
        let along_u = chords(Uv::X, d.du.length() * size.x);
        let along_v = chords(Uv::Y, d.dv.length() * size.y);
        Some(along_u * along_v).filter(|cells| cells.is_finite())
    };
    let inside = |uv: &Uv| is_inside_sides(border.iter().copied(), *uv);
    let place = |k: usize| lo + (Uv::new((k / PLACES) as f64, (k % PLACES) as f64) + 0.5) / PLACES as f64 * size;
    let places = (0..PLACES * PLACES).map(place).filter(inside);
    let mut cells: Vec<f64> = places.filter_map(cells_if_alike).collect();
    cells.sort_by(f64::total_cmp);
    let kept = cells.len() - (SHARPEST_PLACES * cells.len() as f64) as usize;
    cells[..kept].iter().sum::<f64>() / (PLACES * PLACES) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use crate::tessellate::settings::ToleranceField;
    use std::f64::consts::PI;

    #[test]
    fn cells_of_a_ball_and_a_tube_are_those_of_their_chords() {
        let (radius, tolerance) = (1000.0, 0.01);
        let field = ToleranceField::new([tolerance; 2], [1.0, 10.0], Default::default(), 1.0);
        let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]));
        let cells = expected_cells(&ball, &FaceSurface::new(&ball.surface, false, field));
        // Squares of side s sag by s²/8R along each side: 4πR² / 8Rξ of them.
        let exact = FRAC_PI_2 * radius / tolerance;
        assert!(cells > 0.7 * exact && cells < 1.1 * exact, "{cells} {exact}");
        let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, radius, [0.0, PI], [0.0, 1e4]));
        let cells = expected_cells(&tube, &FaceSurface::new(&tube.surface, false, field));
        let exact = PI * radius / (8.0 * radius * tolerance).sqrt();
        assert!(cells > 0.7 * exact && cells < 1.1 * exact, "{cells} {exact}");
    }

    /// On a ball cells of an angle a are squares of side 2aR, π / a² of them, on half a tube strips, π / 2a.
    #[test]
    fn an_angle_is_the_least_that_the_budget_allows() {
        let field = ToleranceField::new([0.01; 2], [1.0, 10.0], Default::default(), 1.0);
        let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]));
        let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 50.0, [0.0, PI], [0.0, 1e4]));
        let plane = Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 1.0]; 2]));
        let of = |face: &Face, budget: usize, asked: f64| {
            angle_within_budget(face, &FaceSurface::new(&face.surface, false, field), budget, asked)
        };
        for asked in [0.0, 1e-12, 1e-5] {
            let (on_ball, on_tube) = (of(&ball, 1_000_000, asked), of(&tube, 100_000, asked));
            let [ball_exact, tube_exact] = [(PI / 100_000.0).sqrt(), PI / 2.0 / 10_000.0];
            assert!(on_ball > 0.8 * ball_exact && on_ball < 1.05 * ball_exact, "{on_ball} {ball_exact}");
            assert!(on_tube > 0.8 * tube_exact && on_tube < 1.05 * tube_exact, "{on_tube} {tube_exact}");
            assert_eq!(of(&plane, 4, asked), asked);
        }
        assert_eq!(of(&ball, 1_000_000, 0.01), 0.01);
    }
}

//! What a model may cost to mesh, in counted work: facets that its faces are expected to need, and steps of their proofs.
//!
//! A number in a file can ask for any number of facets: a lens whose unit is the kilometre, a ball of a million kilometres. Faces that are
//! sure to need more than the model may have are not begun, the largest first, and the rest goes on. What cannot be foreseen, such as a
//! wild patch of degree 25, ends when its proofs have taken more steps than any real face takes. Nothing looks at a clock, so the outcome
//! is the same on any machine and for any number of threads.

use super::expected_cells::{TIMES_EXPECTED, expected_cells};
use super::face_surface::FaceSurface;
use super::placed_part::PlacedPart;
use super::report::{FailureCause, Report};
use super::settings::Settings;
use crate::model::{Face, Model};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Largest size of a face in tolerances up to which it is not looked at: a ball of this size needs half as many
/// cells. Each face of a file has that much to itself, so that the limit grows with the file.
const FREE_SIZE: f64 = 20_000.0;

/// Cells that the faces of any model may have at the default tolerance: those of a ball of 25 m, some eight seconds of one core.
const CELLS_OF_ANY: f64 = 200_000.0;

/// Returns the settings with no more cells, for a face and for all together, than a model of this size may have: at the default tolerance
/// they follow its control points, and of a finer one as many more are granted as it takes.
///
/// A damaged coordinate turns a file of 17 kB into a face of 667 m: it took a minute and a gigabyte. None of 948 real files is cut.
pub(super) fn within_size(model: &Model, settings: &Settings) -> Settings {
    let faces = model.parts.iter().flat_map(|p| &p.shells).flat_map(|s| &s.faces);
    let points: usize = faces.map(|face| face.surface.points.len()).sum();
    let tolerances = settings.overrides.iter().map(|o| o.tolerance).chain([settings.tolerance]);
    let finer = tolerances.filter(|t| t.iter().all(|t| *t > 0.0)).map(times_finer).fold(1.0, f64::max);
    let cells = ((CELLS_OF_ANY + settings.cells_of_point * points as f64) * finer) as u64;
    Settings {
        most_cells: settings.most_cells.min(cells),
        budget: settings.budget.min(usize::try_from(cells).unwrap_or(usize::MAX)),
        ..settings.clone()
    }
}

/// How many times the cells of the default tolerance one that is finer at the sharpest or the flattest places, mm, needs: in inverse
/// proportion. At least 1. A fuselage of 46 m, flat nearly everywhere, needs four times as many at 0.05 mm as at 0.05 to 0.2 mm.
fn times_finer([tightest, loosest]: [f64; 2]) -> f64 {
    let [tight, loose] = Settings::default().tolerance;
    (tight / tightest).max(loose / loosest).max(1.0)
}

/// Cells that a face too large to be meant may have at the default tolerance: some seconds of one core.
const CELLS_OF_LARGE_FACE: f64 = 50_000.0;

/// Returns the cells that a face may have, at most those that the settings grant each: of a large one by its control points and its
/// curvature. All of them where an angle is requested, few where the tolerance is within the rounding of coordinates.
///
/// Where no facet fits, as along a fold that a damaged coordinate makes, cells are halved until the budget ends, however few the curvature
/// of the rest foretells. A small face with a fold may be a real one, and keeps its budget.
pub(super) fn face_budget(face: &Face, surface: &FaceSurface<'_>, settings: &Settings) -> usize {
    let tightest = surface.field.tightest();
    // No division reaches a tolerance within the rounding of coordinates, which a closed face that is nearly a point has.
    if tightest <= surface.rounding {
        return settings.budget.min(CELLS_OF_LARGE_FACE as usize);
    }
    // What an angle needs follows no tolerance.
    if settings.angle_deg.is_some() || surface.size <= FREE_SIZE * tightest {
        return settings.budget;
    }
    let finer = times_finer([tightest, surface.field.loosest()]);
    let of_points = settings.cells_of_point * surface.spline.points.len() as f64;
    let any = CELLS_OF_LARGE_FACE.max(of_points) * finer;
    if settings.budget as f64 <= any {
        return settings.budget;
    }
    settings.budget.min(any.max(TIMES_EXPECTED * expected_cells(face, surface)) as usize)
}

/// Faces of parts that are not begun, with the cells they would need: by part, and by the face's place in the part.
pub(super) type TooLarge = FxHashMap<(usize, usize), f64>;

/// Returns the faces that are left out, the most expensive first, so that the cells expected of all others are at most
/// [`Settings::most_cells`]. Faces small for their tolerance cost nothing here and are never left out.
pub(super) fn faces_beyond(parts: &[PlacedPart<'_>], settings: &Settings) -> TooLarge {
    let faces = parts.iter().enumerate().filter(|(_, p)| p.is_placed()).flat_map(|(i, part)| {
        let faces = part.part.shells.iter().flat_map(|s| &s.faces).enumerate();
        faces.map(move |(k, face)| (i, part, k, face))
    });
    let large: Vec<(usize, &PlacedPart<'_>, usize, &Face)> = faces
        .filter(|(_, part, k, face)| {
            let tightest = part.tightest_tolerance(settings, *k, face);
            face.surface.bounds().diagonal() > FREE_SIZE * tightest
        })
        .collect();
    let mut expected: Vec<((usize, usize), f64)> = large
        .into_par_iter()
        .filter_map(|(i, part, k, face)| {
            let surface = part.surface(settings, k, face)?;
            Some(((i, k), expected_cells(face, &surface)))
        })
        .collect();
    let mut all: f64 = expected.iter().map(|(_, cells)| cells).sum();
    // The largest go first; of equal ones the last.
    expected.sort_by(|a, b| b.1.total_cmp(&a.1).then(b.0.cmp(&a.0)));
    let mut beyond = TooLarge::default();
    for (key, cells) in expected {
        if all <= settings.most_cells as f64 {
            break;
        }
        all -= cells;
        beyond.insert(key, cells);
    }
    beyond
}

/// Sets the cause of the failed faces of a report. `cause` is called with the part and the face's place in it; where it knows none, the
/// default stays.
pub(super) fn name_causes(
    report: &mut Report,
    model: &Model,
    cause: impl Fn(usize, usize) -> Option<FailureCause>,
) {
    if report.failed.is_empty() {
        return;
    }
    let firsts = model.first_faces();
    for failed in &mut report.failed {
        // Instances are in the order of their faces.
        let after = firsts.partition_point(|first| first.0 <= failed.face);
        if let Some(i) = after.checked_sub(1) {
            let k = (failed.face - firsts[i].0) as usize;
            failed.cause = cause(model.instances[i].part.0 as usize, k).unwrap_or_default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Point};
    use crate::model::{Part, Shell};
    use crate::nurbs::{Surface, sweep};
    use crate::tessellate::settings::ToleranceField;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn ball(radius: f64) -> Model {
        let surface = sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
        let shell = Shell { faces: vec![Face::whole(surface)], ..Shell::default() };
        Model::from_part(Part { shells: vec![shell], ..Part::default() })
    }

    /// A tolerance of a tenth needs ten times the cells on the same ball, and is granted them; that of the flattest places everywhere is
    /// what any model has.
    #[test]
    fn limits_follow_the_size_of_the_model_and_its_tolerance() {
        let ball = ball(1.0);
        let points = ball.parts[0].shells[0].faces[0].surface.points.len();
        let of = |tolerance: f64, cells_of_point: f64| {
            let asked = Settings { most_cells: u64::MAX, cells_of_point, ..Settings::uniform(tolerance) };
            within_size(&ball, &asked).most_cells
        };
        assert_eq!([of(0.05, 0.0), of(0.2, 0.0), of(0.005, 0.0)], [800_000, 200_000, 8_000_000]);
        assert_eq!(of(0.05, 1e4), 4 * (200_000 + 10_000 * points as u64));
        // A smaller requested value stays.
        let few = Settings { most_cells: 10, budget: 20, ..Settings::default() };
        assert_eq!(within_size(&ball, &few), few);
    }

    /// What a ball of 20 m needs is known from its curvature, π / 2 · R / ξ cells, and it may have several times as many; a tube of that
    /// length has what any large face has, at a tolerance of a tenth ten times that. A small one keeps its budget, and one that is nearly
    /// a point has no use for it.
    #[test]
    fn the_budget_of_a_large_face_follows_its_curvature_its_points_and_its_tolerance() {
        let of = |surface: Surface, tolerance: f64, cells_of_point: f64| {
            let asked = Settings { budget: 10_000_000, cells_of_point, ..Settings::uniform(tolerance) };
            let field = ToleranceField::new([tolerance; 2], [1.0, 10.0], Default::default(), 1.0);
            let face = Face::whole(surface);
            face_budget(&face, &FaceSurface::new(&face.surface, false, field), &asked)
        };
        let ball =
            |frame: &Frame, radius: f64| sweep::sphere(frame, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
        let tube = || sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, PI], [0.0, 2e4]);
        assert_eq!(
            [of(tube(), 0.05, 0.0), of(tube(), 0.2, 0.0), of(tube(), 0.005, 0.0)],
            [200_000, 50_000, 2_000_000]
        );
        assert_eq!(of(tube(), 0.05, 1e5), 4 * 100_000 * tube().points.len());
        let needed = (FRAC_PI_2 * 2e4 / 0.05) as usize;
        let large = of(ball(&Frame::IDENTITY, 2e4), 0.05, 0.0);
        assert!(large > 4 * needed && large < 10 * needed, "{large} {needed}");
        assert_eq!(of(ball(&Frame::IDENTITY, 1.0), 0.05, 0.0), 10_000_000);
        // Closed, so that its tolerance follows its size, which is less than a rounding of where it is.
        assert_eq!(of(ball(&Frame::translation(Point::new(5.0, 6.0, 3.0)), 1e-300), 0.05, 0.0), 50_000);
    }
}

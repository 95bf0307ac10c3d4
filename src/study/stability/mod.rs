//! Numerical stability: generated models with rays whose right answer is known in closed form.
//!
//! Each [`Case`] is one difficulty (grazing rays, poles, knot lines, ratios of weights, cusps, sheets that cross, starts on
//! the surface, slivers, thin gaps, ten thousand reflections …). Each is traced in place, moved by a kilometre, a thousand times
//! smaller and larger, and turned by an odd angle ([`Variant`]). An answer is *right*, *flagged* (the intersector says that
//! it is not sure) or *wrong* (in silence).
//!
//! Guarantee: truths come from how the rays were built or from the surface's equation, never from an intersector.
//! Facets are right when their hit lies within their sag of the true surface and no full crossing of that band was missed.
//! Known weakness: where the truth itself depends on the last bits of the input ([`Scene::resolution`]) any answer near it
//! is accepted.

mod case;
mod curves;
mod grade;
mod practice;
mod solids;
mod spheres;

pub use case::{Case, Geometry, Scene, Variant};
pub use grade::{Grade, Row};

/// Writes one sentence: what is wrong in silence, by intersector.
pub fn answer(rows: &[Row]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for r in rows {
        if !names.contains(&r.intersector.as_str()) {
            names.push(&r.intersector);
        }
    }
    let part = |name: &&str| {
        let own = || rows.iter().filter(|r| r.intersector == *name);
        let sum = |of: fn(&Row) -> u64| own().map(of).sum::<u64>();
        let (rays, flagged, wrong) = (sum(|r| r.rays), sum(|r| r.flagged), sum(|r| r.wrong));
        let mut cases: Vec<&str> = own().filter(|r| r.wrong > 0).map(|r| r.case.as_str()).collect();
        cases.dedup();
        let flags = if flagged > 0 { format!(", {flagged} more said to be unproved") } else { String::new() };
        match wrong {
            0 => format!("**{name} none** of {rays}{flags}"),
            _ => format!("{name} {wrong} of {rays} in {} of the cases{flags}", cases.len()),
        }
    };
    format!(
        "Rays through edges, corners, poles and silhouettes, the truth known by construction. Answered wrongly without a warning: {}.",
        names.iter().map(part).collect::<Vec<_>>().join("; ")
    )
}

/// Makes all cases; the first thirteen are the hard cases of spline intersection, the others belong to facets and trees, and to what users
/// do.
pub fn cases() -> Vec<Case> {
    let mut all = spheres::cases();
    all.extend(curves::cases());
    all.extend(solids::cases());
    all.extend(practice::cases());
    all
}

#[cfg(test)]
mod tests {
    use super::case::Question;
    use super::*;
    use crate::intersect::{Certainty, Cost, Footprint, Hit, Intersector, exact};
    use crate::math::{Frame, Point, Ray, Vector};
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// Finds what a ray from nowhere meets, with this certainty, and loses what leaves it in silence.
    struct Blind(exact::Exact, Certainty);

    impl Intersector for Blind {
        fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
            let hit = self.0.intersect(ray, cost).filter(|_| ray.departure.is_none())?;
            Some(Hit { certainty: self.1, ..hit })
        }

        fn footprint(&self) -> Footprint {
            Footprint::default()
        }
    }

    /// Grades a chord of a ball of 1 mm, at this sine to the surface that it leaves, where the intersector finds only its start.
    fn grade_of_lost_chord(sine: f64, certainty: Certainty) -> Grade {
        let toward = Ray::new(Point::ZERO, Vector::X);
        let direction = Vector::new(-sine, (1.0 - sine * sine).sqrt(), 0.0);
        let case = Case {
            name: "chord",
            surfaces: vec![sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2])],
            loops: Vec::new(),
            divisions: 4,
            slack: 0.0,
            distance: Box::new(|p| p.length() - 1.0),
            questions: vec![Question::Chord { toward, direction, radius: 1.0 }],
        };
        let scene = case.scene(Variant::Home);
        let intersector = Blind(exact::Exact::build(&scene.model, &exact::Settings::default()), certainty);
        scene.grades(&intersector, Geometry::Spline)[0]
    }

    #[test]
    fn a_lost_end_is_graded_by_its_start_and_by_its_truth() {
        assert_eq!(grade_of_lost_chord(0.5, Certainty::Certified), Grade::Wrong);
        // From a hit that is not sure the chord may run another way, whether it is met or lost.
        assert_eq!(grade_of_lost_chord(0.5, Certainty::Uncertified), Grade::Flagged);
        // So flat that the surface would hide it by a move of 5e-19 mm: undecided.
        assert_eq!(grade_of_lost_chord(1e-9, Certainty::Certified), Grade::Right);
    }
}

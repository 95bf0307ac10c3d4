//! Cases of what users do: trims, sheets that lie almost in an axis plane, weights that shape a curve, starts on edges of facets.

use super::case::{Case, Question, Truth};
use super::curves::{bezier_knots, paraboloid, ray_down, swept_curve};
use super::solids::{block, block_distance};
use crate::math::{Point, Ray, Uv, Vector};
use crate::model::{EdgeUse, TrimLoop};
use crate::nurbs::UvCurve;
use crate::study::Random;
use std::f64::consts::{SQRT_2, TAU};

/// Makes the cases of what users do.
pub(super) fn cases() -> Vec<Case> {
    vec![
        trimmed_case(),
        almost_flat_case(),
        weighted_arc_case("weight of 100", 100.0),
        weighted_arc_case("weight of 0.01", 0.01),
        edge_starts_case(),
    ]
}

/// Makes the case of rays beside the trim of a curved face, which has no mesh.
fn trimmed_case() -> Case {
    // A bowl z = a·x² + b·y² of which |x| + |y| < 40 is left: the loop runs in straight lines over the parameters.
    let (a, b, half) = (0.01, 0.015, 40.0);
    let corners =
        [(half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)].map(|(x, y)| Uv::new(x + 50.0, y + 50.0) / 100.0);
    let side = |k: usize| EdgeUse {
        edge: None,
        reversed: false,
        uv: UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]),
    };
    let question = |i: u64| {
        let mut random = Random::new(61, i);
        // A tenth of the rays pass within ten times the band of 1e-6 mm that is flagged.
        let beside = if i.is_multiple_of(2) { 1.0 } else { -1.0 } * 10f64.powf(random.between(-5.0, 1.0));
        let along = random.between(1.0, half - 1.0);
        let (sx, sy) = ([1.0, -1.0][i as usize / 2 % 2], [1.0, -1.0][i as usize / 4 % 2]);
        // From the side of the diamond outward, or inward where the number is negative.
        let shift = beside / SQRT_2;
        let (x, y) = (sx * (along + shift), sy * (half - along + shift));
        let z = a * x * x + b * y * y;
        let n = Vector::new(-2.0 * a * x, -2.0 * b * y, 1.0).normalize();
        let d = Vector::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), -1.0).normalize();
        let ray = Ray::new(Point::new(x, y, z) - d * 60.0, d);
        // What lies inside the bowl's surface is convex: a ray from there meets it once.
        let truth =
            if beside < 0.0 { Truth::hit(60.0, d.dot(n), -beside).with_normal(n) } else { Truth::miss(beside) };
        Question::First { ray, truth }
    };
    Case {
        name: "trims",
        surfaces: vec![paraboloid(a, b)],
        loops: vec![TrimLoop { uses: (0..4).map(side).collect() }],
        divisions: 1,
        slack: 0.0,
        distance: Box::new(move |p| p.z - a * p.x * p.x - b * p.y * p.y),
        questions: (0..400).map(question).collect(),
    }
}

/// Makes the case of rays along a sheet that stands a hair aslant of an axis plane, with a wall behind.
fn almost_flat_case() -> Case {
    // A sheet of 100 mm that rises by 1e-12, and a wall behind: rays along the sheet meet it at x, or the wall where x is beyond its end.
    let (slope, pivot) = (1e-12, 20.0);
    let sheet = swept_curve(
        &[(-50.0, slope * (-50.0 - pivot), 1.0), (50.0, slope * (50.0 - pivot), 1.0)],
        1,
        bezier_knots(1),
    );
    let wall = block(Point::new(-61.0, -100.0, -100.0), Point::new(-60.0, 100.0, 100.0));
    let question = |i: u64| {
        let mut random = Random::new(62, i);
        let x = if i.is_multiple_of(2) { random.between(-40.0, 40.0) } else { random.between(51.0, 90.0) };
        let ray = Ray::new(Point::new(200.0, random.between(-40.0, 40.0), slope * (x - pivot)), -Vector::X);
        let depth = slope * (50.0 - x).abs();
        let truth = if x < 50.0 { Truth::hit(200.0 - x, slope, depth) } else { Truth::hit(260.0, 1.0, depth) };
        Question::First { ray, truth }
    };
    let wall_distance = block_distance(Point::new(-61.0, -100.0, -100.0), Point::new(-60.0, 100.0, 100.0));
    Case {
        name: "sheet almost in an axis plane",
        surfaces: [vec![sheet], wall].concat(),
        loops: Vec::new(),
        divisions: 4,
        slack: 0.0,
        distance: Box::new(move |p| {
            let z = p.z - slope * (p.x - pivot);
            let to_sheet = Vector::new((p.x.abs() - 50.0).max(0.0), (p.y.abs() - 50.0).max(0.0), z).length();
            to_sheet.min(wall_distance(p).abs())
        }),
        questions: (0..400).map(question).collect(),
    }
}

/// Makes a case of rays on a conic arc over x in [−40, 40] mm, whose middle control point at z = 20 has this weight.
fn weighted_arc_case(name: &'static str, weight: f64) -> Case {
    let (half, top) = (40.0, 20.0);
    let surface = swept_curve(&[(-half, 0.0, 1.0), (0.0, top, weight), (half, 0.0, 1.0)], 2, bezier_knots(2));
    // With barycentric coordinates l of the control points the arc is l₁² = 4w²·l₀·l₂; for x = 40·p, l₁ = m solves
    // m²(1 − w²) + 2w²·m = w²(1 − p²).
    let w2 = weight * weight;
    let share = move |x: f64| {
        let rest = 1.0 - (x / half).powi(2);
        weight * rest / (weight + (w2 + (1.0 - w2) * rest).max(0.0).sqrt())
    };
    let slope = move |x: f64| -w2 * (x / half) / (share(x) * (1.0 - w2) + w2) * top / half;
    let question = move |i| {
        let mut random = Random::new(63, i);
        let x = if i % 3 == 0 { random.between(-0.1, 0.1) } else { random.between(-39.0, 39.0) };
        let (ray, t, cos) = ray_down(&mut random, x, top * share(x));
        let truth = Truth::hit(t, cos / slope(x).hypot(1.0), 1.0);
        Question::First { ray, truth }
    };
    Case {
        name,
        surfaces: vec![surface],
        loops: Vec::new(),
        divisions: 48,
        slack: 0.0,
        distance: Box::new(move |p| {
            let x = p.x.clamp(-half, half);
            (p.z - top * share(x)) / slope(x).hypot(1.0)
        }),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays that start on edges, diagonals and corners of a box's facets and go on to the next wall.
fn edge_starts_case() -> Case {
    // In a box, from edges, diagonals and corners of its facets, at sines down to 1e-9.
    let size = 64.0;
    let question = |i: u64| {
        let mut random = Random::new(64, i);
        let eighth = |r: &mut Random| ((r.unit() * 7.0).floor() + 1.0) * 8.0;
        let (axis, high) = (i as usize % 3, i.is_multiple_of(2));
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut target = Point::splat(if high { size } else { 0.0 });
        target[x] = eighth(&mut random);
        target[y] = match i % 5 {
            0 => eighth(&mut random),
            // On a diagonal of the facet one way or the other.
            1 => target[x],
            2 => size - target[x],
            _ => random.between(1.0, size - 1.0),
        };
        if i % 5 == 1 || i % 5 == 2 {
            let along = random.between(-0.9, 0.9) * 4.0;
            target[x] += along;
            target[y] += if i % 5 == 1 { along } else { -along };
        }
        let from = Point::splat(0.5 * size) + random.direction() * (0.3 * size * random.unit());
        let sine = 10f64.powf(random.between(-9.0, -0.1));
        // No wall is met at less than 11°.
        let turn = (random.unit() * 4.0).floor() * 0.25 * TAU + random.between(0.2, 0.25 * TAU - 0.2);
        let mut direction = Vector::ZERO;
        direction[axis] = if high { -sine } else { sine };
        direction[x] = turn.cos() * (1.0 - sine * sine).sqrt();
        direction[y] = turn.sin() * (1.0 - sine * sine).sqrt();
        let toward = Ray::new(from, (target - from).normalize());
        Question::Onward { toward, direction: direction.normalize(), size: Vector::splat(size) }
    };
    Case {
        name: "start on a facet's edge",
        surfaces: block(Point::ZERO, Point::splat(size)),
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(block_distance(Point::ZERO, Point::splat(size))),
        questions: (0..600).map(question).collect::<Vec<Question>>(),
    }
}

//! Cases on spheres and tori: grazing, silhouettes, poles, knot lines, thin tubes, weights, starts on the surface.

use super::case::{Case, Question, Truth};
use crate::math::{Frame, Homogeneous, Point, Ray, Vector, orthonormal_pair};
use crate::nurbs::{BezierPatch, Surface, sweep};
use crate::study::Random;
use std::f64::consts::{FRAC_PI_2, PI};

/// Radius of the balls, mm.
const R: f64 = 50.0;
/// Stands for the cosine 0 of a ray that touches a ball, which would divide the tolerance.
const TOUCHING_COS: f64 = 1e-9;
/// All around.
const FULL: [f64; 2] = [0.0, 2.0 * PI];

/// Makes the cases on spheres and tori.
pub(super) fn cases() -> Vec<Case> {
    vec![
        graze_case(),
        silhouette_case(),
        pole_case(),
        knots_case(),
        thin_torus_case(),
        weights_case(),
        on_surface_case(),
        far_origin_case(),
        from_inside_case(),
        facet_features_case(),
    ]
}

/// Makes a sphere about the origin with its poles on the z axis; `radius` in mm.
pub(super) fn sphere(radius: f64) -> Surface {
    sweep::sphere(&Frame::IDENTITY, radius, FULL, [-FRAC_PI_2, FRAC_PI_2])
}

/// Makes a case about a sphere of radius `R`.
fn ball_case(name: &'static str, questions: Vec<Question>) -> Case {
    Case {
        name,
        surfaces: vec![sphere(R)],
        loops: Vec::new(),
        divisions: 12,
        slack: 0.0,
        distance: Box::new(|p| p.length() - R),
        questions,
    }
}

/// Makes a ray at impact parameter `b`, mm, about the origin, in a random direction, from 150 mm before its nearest point.
fn ray_past_origin(random: &mut Random, b: f64) -> Ray {
    let d = random.direction();
    let (a, c) = orthonormal_pair(d);
    // Around the origin by chance, so that no plane of the tree is favoured.
    let (sin, cos) = random.between(0.0, 2.0 * PI).sin_cos();
    Ray::new((a * cos + c * sin) * b - d * 150.0, d)
}

/// Returns both crossings, by a ray of [`ray_past_origin`], of the sphere into which it dips `depth` mm deep: exact for the shortest chords
/// too.
fn ball_crossings(depth: f64) -> [Truth; 2] {
    // 2·√(R² − b²) by the difference R − b: squares would lose what is left of a grazing chord.
    let half = (depth * (2.0 * R - depth)).sqrt();
    [150.0 - half, 150.0 + half].map(|t| Truth::hit(t, half / R, depth))
}

/// Makes the case of rays that touch a ball, or miss or cut it by ever less.
fn graze_case() -> Case {
    let mut questions = Vec::new();
    for k in 1..=12 {
        for sign in [-1.0, 1.0] {
            for i in 0..40 {
                let mut random = Random::new(1, k * 1000 + i + if sign > 0.0 { 500 } else { 0 });
                // From a tenth of a millimetre to 1e-12 mm on both sides of touching.
                let delta = sign * 10f64.powi(-(k as i32));
                let truth = if sign < 0.0 { ball_crossings(-delta)[0] } else { Truth::miss(delta) };
                questions.push(Question::First { ray: ray_past_origin(&mut random, R + delta), truth });
            }
        }
    }
    let touch = |i| Question::First {
        ray: ray_past_origin(&mut Random::new(2, i), R),
        truth: Truth::hit(150.0, TOUCHING_COS, 0.0),
    };
    questions.extend((0..40).map(touch));
    ball_case("grazing sphere", questions)
}

/// Makes the case of rays that cut a ball near its outline, both crossings traced.
fn silhouette_case() -> Case {
    let question = |i| {
        let mut random = Random::new(3, i);
        let half = random.between(2.0, 4.0);
        let depth = R - (R * R - half * half).sqrt();
        Question::All { ray: ray_past_origin(&mut random, R - depth), truths: ball_crossings(depth).to_vec() }
    };
    ball_case("near-silhouette entry", (0..400).map(question).collect())
}

/// Makes the case of rays at and beside the poles of a ball.
fn pole_case() -> Case {
    let mut questions = Vec::new();
    for (k, offset) in [0.0, 1e-12, 1e-9, 1e-6, 1e-3].into_iter().enumerate() {
        for i in 0..80 {
            let mut random = Random::new(4, 1000 * k as u64 + i);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let (sin, cos) = random.between(0.0, 2.0 * PI).sin_cos();
            let z = (R * R - offset * offset).sqrt();
            let target = Point::new(offset * cos, offset * sin, side * z);
            let d = if i < 20 { Vector::Z * -side } else { random.hemisphere(Vector::Z * -side) };
            // Rays flatter than 6° would make the second crossing ill-conditioned.
            let d = if d.z.abs() < 0.1 { Vector::Z * -side } else { d };
            let n = target / R;
            let cos_i = -d.dot(n);
            let first = Truth::hit(150.0, cos_i, R).with_normal(n);
            let second = Truth::hit(150.0 + 2.0 * R * cos_i, cos_i, R);
            let ray = Ray::new(target - d * 150.0, d);
            questions.push(Question::First { ray, truth: first });
            questions.push(Question::All { ray, truths: vec![first, second] });
        }
    }
    ball_case("pole", questions)
}

/// Returns a point of the torus about z at the two angles, rad, and the outward normal there.
fn torus_point(major: f64, minor: f64, u: f64, v: f64) -> (Point, Vector) {
    let n = Vector::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin());
    (Point::new(major * u.cos(), major * u.sin(), 0.0) + n * minor, n)
}

/// Returns the function of the signed distance from a torus about z, mm, negative inside.
fn torus_distance(major: f64, minor: f64) -> Box<dyn Fn(Point) -> f64 + Send + Sync> {
    Box::new(move |p| (p.x.hypot(p.y) - major).hypot(p.z) - minor)
}

/// Makes the case of rays at knots and seams of a torus.
fn knots_case() -> Case {
    let (major, minor) = (R, 15.0);
    let mut questions = Vec::new();
    for i in 0..400 {
        let mut random = Random::new(5, i);
        // Knots and the seam lie at multiples of 90°; the outer half of the tube is met first from outside.
        let quarter = |r: &mut Random| (r.unit() * 5.0).floor() * FRAC_PI_2;
        let u = if i % 3 == 0 { random.between(0.0, 2.0 * PI) } else { quarter(&mut random) };
        let v = if i % 3 == 1 {
            random.between(-1.5, 1.5)
        } else {
            (random.unit() * 3.0).floor() * FRAC_PI_2 - FRAC_PI_2
        };
        let (p, n) = torus_point(major, minor, u, v);
        let truth = Truth::hit(100.0, 1.0, minor).with_normal(n);
        questions.push(Question::First { ray: Ray::new(p + n * 100.0, -n), truth });
    }
    Case {
        name: "knot line, corner, seam",
        surfaces: vec![sweep::torus(&Frame::IDENTITY, major, minor, FULL, FULL)],
        loops: Vec::new(),
        divisions: 12,
        slack: 0.0,
        distance: torus_distance(major, minor),
        questions,
    }
}

/// Makes the case of rays that cut short chords of a ring as thin as a hair.
fn thin_torus_case() -> Case {
    let (major, minor) = (R, 0.01);
    let question = |i: u64| {
        let mut random = Random::new(6, i);
        let u = random.between(0.0, 2.0 * PI);
        let v = random.between(-1.2, 1.2);
        let (_, n) = torus_point(major, minor, u, v);
        // In the meridian plane the tube is a circle: a ray at distance b from its centre has the chord 2√(r² − b²).
        // Chords from twenty micrometres down to a hundredth of one.
        let half = 0.5 * 10f64.powf(random.between(-5.0, -1.71));
        let b = (minor * minor - half * half).sqrt();
        let side = Vector::new(-v.sin() * u.cos(), -v.sin() * u.sin(), v.cos());
        let centre = Point::new(major * u.cos(), major * u.sin(), 0.0);
        let depth = half * half / (minor + b);
        let truth = Truth::hit(100.0 - half, half / minor, depth);
        Question::First { ray: Ray::new(centre + side * b + n * 100.0, -n), truth }
    };
    Case {
        name: "torus of radius 0.01",
        surfaces: vec![sweep::torus(&Frame::IDENTITY, major, minor, FULL, FULL)],
        loops: Vec::new(),
        divisions: 24,
        slack: 0.0,
        distance: torus_distance(major, minor),
        questions: (0..400).map(question).collect(),
    }
}

/// Returns the patch with another parametrisation: weights times `lambda^i · mu^j` leave the set of points as it is.
fn reweighted(patch: &BezierPatch, lambda: f64, mu: f64) -> Surface {
    let [p, q] = patch.degree;
    let points = (0..=p).flat_map(|i| (0..=q).map(move |j| (i, j))).map(|(i, j)| {
        let c: Homogeneous = patch.points[i * (q + 1) + j];
        c * (lambda.powi(i as i32) * mu.powi(j as i32))
    });
    let knots = |d: usize| [vec![0.0; d + 1], vec![1.0; d + 1]].concat();
    Surface { degree: [p, q], knots: [knots(p), knots(q)], points: points.collect() }
}

/// Makes the case of rays on a ball whose patches have weights four powers of ten apart.
fn weights_case() -> Case {
    // λ²μ² = 1e4 between opposite corners of a biquadratic patch.
    let surfaces = sphere(R).bezier_patches().iter().map(|p| reweighted(p, 10.0, 10.0)).collect();
    let question = |i| {
        let mut random = Random::new(7, i);
        let depth = random.between(0.1, R);
        Question::First { ray: ray_past_origin(&mut random, R - depth), truth: ball_crossings(depth)[0] }
    };
    Case { surfaces, divisions: 24, ..ball_case("weights up to 1e4", (0..400).map(question).collect()) }
}

/// Makes the case of chords of a ball from a hit on it, some of them flat and short.
fn on_surface_case() -> Case {
    let question = |i| {
        let mut random = Random::new(8, i);
        let toward = Ray::new(random.direction() * random.between(0.0, 20.0), random.direction());
        let half = {
            let b = toward.origin.dot(toward.direction);
            // The far crossing of a sphere from a point inside it.
            -b + (b * b + R * R - toward.origin.length_squared()).sqrt()
        };
        let n = toward.point_at(half) / R;
        // A third of the chords is shorter than 6 mm.
        let flat = if i % 3 == 0 { random.between(0.005, 0.06) } else { random.between(0.06, 1.0) };
        let (a, c) = orthonormal_pair(n);
        let (sin, cos) = random.between(0.0, 2.0 * PI).sin_cos();
        let direction = ((a * cos + c * sin) * (1.0 - flat * flat).sqrt() - n * flat).normalize();
        Question::Chord { toward, direction, radius: R }
    };
    ball_case("start on the surface", (0..400).map(question).collect())
}

/// Makes the case of rays on a ball from a kilometre off.
fn far_origin_case() -> Case {
    let distance: f64 = 1e6;
    let question = |i| {
        let mut random = Random::new(9, i);
        let depth = random.between(1.0, R);
        let near = ray_past_origin(&mut random, R - depth);
        let truth = ball_crossings(depth)[0];
        let ray = Ray::new(near.origin - near.direction * distance, near.direction);
        Question::First { ray, truth: Truth { t: truth.t.map(|t| t + distance), ..truth } }
    };
    ball_case("origin 1e6 mm away", (0..400).map(question).collect())
}

/// Makes the case of rays from within a ball, a quarter of them along the axes.
fn from_inside_case() -> Case {
    let question = |i| {
        let mut random = Random::new(10, i);
        let o = random.direction() * (R * 0.98 * random.unit().cbrt());
        // A quarter along the axes, where a ray stays within planes of the tree.
        let d = if i % 4 == 0 {
            [Vector::X, Vector::Y, Vector::Z, -Vector::X][i as usize / 4 % 4]
        } else {
            random.direction()
        };
        let b = o.dot(d);
        let root = (b * b + R * R - o.length_squared()).sqrt();
        let truth = Truth::hit(root - b, root / R, R - o.length());
        Question::All { ray: Ray::new(o, d), truths: vec![truth] }
    };
    ball_case("from inside", (0..400).map(question).collect())
}

/// Makes the case of rays at corners and edge middles of the facets of a ball, on the axes of the tree too.
fn facet_features_case() -> Case {
    let divisions = 12;
    let case = ball_case("facet edge and vertex", Vec::new());
    let mesh =
        crate::study::sample_models::grid_mesh(&crate::study::sample_models::model("ball", [sphere(R)]), divisions);
    let mut questions = Vec::new();
    for i in 0..600 {
        let mut random = Random::new(11, i);
        let corners = mesh.corners((random.unit() * mesh.facets.len() as f64) as usize);
        let target = match i % 3 {
            0 => corners[0],
            1 => 0.5 * (corners[0] + corners[1]),
            _ => 0.5 * (corners[0] + corners[2]),
        };
        let n = target.normalize();
        let d = if i % 5 == 0 { -n } else { -random.hemisphere(n) };
        let d = if d.dot(n) > -0.2 { -n } else { d };
        let o = target - d * 150.0;
        let (b, c) = (o.dot(d), o.length_squared() - R * R);
        let root = (b * b - c).sqrt();
        // The nearer root in the form without cancellation.
        let truth = Truth::hit(c / (-b + root), root / R, R);
        questions.push(Question::First { ray: Ray::new(o, d), truth });
    }
    Case { divisions, questions, ..case }
}

//! Cases on surfaces swept from plane curves and on polynomial graphs: creases, cusps, crossing sheets, rulings, tangents,
//! collapsed edges, huge radii.

use super::case::{Case, Question, Truth};
use crate::math::{Frame, Homogeneous, Point, Ray, Vector};
use crate::nurbs::{ControlPoint, Curve, Surface, sweep};
use crate::study::Random;
use std::f64::consts::PI;

/// Stands for the cosine 0 of a ray that runs along the surface, which would divide the tolerance.
const LEAST_COS: f64 = 1e-12;

/// Makes the cases on swept curves and graphs.
pub(super) fn cases() -> Vec<Case> {
    vec![
        crease_case(),
        cusp_case(),
        crossing_sheets_case(),
        ruling_case(),
        tangent_case(),
        collapsed_case(),
        apex_case(),
        huge_radius_case(),
    ]
}

/// Makes the surface of a curve in the x–z plane, with control points (x, z, weight), swept from y = −50 to 50 mm.
pub(super) fn swept_curve(points: &[(f64, f64, f64)], degree: usize, knots: Vec<f64>) -> Surface {
    let points = points.iter().map(|&(x, z, w)| Homogeneous::weighted(Point::new(x, 0.0, z), w)).collect();
    sweep::extrusion(&Curve { degree, knots, points }, Vector::Y, [-50.0, 50.0])
}

/// Returns the knots of one Bézier span over `[0, 1]`.
pub(super) fn bezier_knots(degree: usize) -> Vec<f64> {
    [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat()
}

/// Makes a ray in a plane of constant x, from z = 100 down onto `(x, y, z)` for a random y, inclined along y; returns it with its distance
/// to there, mm, and its cosine to the vertical.
pub(super) fn ray_down(random: &mut Random, x: f64, z: f64) -> (Ray, f64, f64) {
    // Inclined along y, in which nothing changes: depth and cosine stay those of the profile.
    let slope = random.between(-0.6, 0.6);
    let d = Vector::new(0.0, slope, -1.0).normalize();
    let t = (100.0 - z) / -d.z;
    let target = Point::new(x, random.between(-10.0, 10.0), z);
    (Ray::new(target - d * t, d), t, -d.z)
}

/// Makes the case of rays on a crease that lies inside of a face, half of them on the crease itself.
fn crease_case() -> Case {
    // z = −0.8·|x| as one cubic with a triple knot, so that the crease lies inside the face.
    let side = |k: usize| 50.0 * k as f64 / 3.0;
    let points: Vec<_> = (0..7).map(|k| side(k) - 50.0).map(|x| (x, -0.8 * x.abs(), 1.0)).collect();
    let knots = [vec![0.0; 4], vec![0.5; 3], vec![1.0; 4]].concat();
    let question = |i| {
        let mut random = Random::new(21, i);
        // Half of the rays meet the crease itself.
        let x = if i % 2 == 0 { 0.0 } else { random.between(-40.0, 40.0) };
        let (ray, t, cos) = ray_down(&mut random, x, -0.8 * x.abs());
        Question::First { ray, truth: Truth::hit(t, cos / 0.64f64.hypot(1.0), 10.0) }
    };
    Case {
        name: "crease inside a face",
        surfaces: vec![swept_curve(&points, 3, knots)],
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(|p| p.z + 0.8 * p.x.abs()),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays at a cusp, where the surface turns back and its normal is lost.
fn cusp_case() -> Case {
    // (x, z) = 40·(s³, s²) for s in [−1, 1]: Bernstein coefficients of s² and s³ with s = 2u − 1.
    let points: Vec<_> = [(-1.0, 1.0), (1.0, -1.0 / 3.0), (-1.0, -1.0 / 3.0), (1.0, 1.0)]
        .map(|(x, z)| (40.0 * x, 40.0 * z, 1.0))
        .into();
    let height = |x: f64| 40.0 * (x.abs() / 40.0).powf(2.0 / 3.0);
    let question = |i| {
        let mut random = Random::new(22, i);
        let x = match i % 3 {
            0 => 0.0,
            1 => random.between(-1e-3, 1e-3),
            _ => random.between(-39.0, 39.0),
        };
        let (ray, t, cos) = ray_down(&mut random, x, height(x));
        // dx/dz on the curve is 3/2·(|x|/40)^(1/3): the cosine of a vertical ray.
        let across = 1.5 * (x.abs() / 40.0).cbrt();
        // At the cusp a vertical ray runs along the surface.
        let steep = across / across.hypot(1.0);
        Question::First {
            ray,
            truth: Truth::hit(t, (cos * steep).max(LEAST_COS), if x == 0.0 { 0.0 } else { x.abs() }),
        }
    };
    Case {
        name: "cusp",
        surfaces: vec![swept_curve(&points, 3, bezier_knots(3))],
        loops: Vec::new(),
        divisions: 16,
        slack: 0.0,
        // Along x, which is the shorter way near the cusp's upright flanks.
        distance: Box::new(move |p| {
            let flank = 40.0 * (p.z.max(0.0) / 40.0).powf(1.5);
            let dx = (p.x.abs() - flank).abs();
            (p.z - height(p.x)).signum() * dx.min((p.z - height(p.x)).abs())
        }),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays through all sheets of a surface that crosses itself.
fn crossing_sheets_case() -> Case {
    // (x, z) = 20·(s³ − s, s²) for s in [−1.5, 1.5]: the curve crosses itself at s = ±1.
    let a: f64 = 1.5;
    // Bernstein coefficients of s, s² and s³ for s = a(2u − 1), degree 3.
    let (s1, s2, s3) =
        ([-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0], [1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0], [-1.0, 1.0, -1.0, 1.0]);
    let points: Vec<_> =
        (0..4).map(|k| (20.0 * (a.powi(3) * s3[k] - a * s1[k]), 20.0 * a * a * s2[k], 1.0)).collect();
    // Parameters where the curve has the abscissa x: s³ − s = x/20 (Viète, or the one real root by Cardano).
    let roots = |x: f64| -> Vec<f64> {
        let q = x / 20.0;
        let m = 2.0 / 3f64.sqrt();
        let c = 3.0 * q / m;
        if c.abs() <= 1.0 {
            (0..3).map(|k| m * (c.acos() / 3.0 - 2.0 * PI * k as f64 / 3.0).cos()).collect()
        } else {
            vec![m * c.signum() * (c.abs().acosh() / 3.0).cosh()]
        }
    };
    let question = |i| {
        let mut random = Random::new(23, i);
        let x = if i % 4 == 0 { random.between(-0.01, 0.01) } else { random.between(-7.0, 7.0) };
        let mut sheets: Vec<(f64, f64)> =
            // The height and the slope dx/dz of the sheet with parameter s.
            roots(x).iter().map(|s| (20.0 * s * s, (3.0 * s * s - 1.0) / (2.0 * s))).collect();
        sheets.sort_by(|p, q| q.0.total_cmp(&p.0));
        let (ray, t, cos) = ray_down(&mut random, x, sheets[0].0);
        let truths = sheets.iter().map(|&(z, across)| {
            let t = t + (sheets[0].0 - z) / cos;
            Truth::hit(t, cos * across.abs() / across.hypot(1.0), f64::MAX)
        });
        Question::All { ray, truths: truths.collect() }
    };
    Case {
        name: "sheets that cross",
        surfaces: vec![swept_curve(&points, 3, bezier_knots(3))],
        loops: Vec::new(),
        divisions: 24,
        slack: 0.0,
        distance: Box::new(move |p| {
            // The implicit equation (x/20)² = (z/20)·(z/20 − 1)², over its gradient.
            let (x, z) = (p.x / 20.0, p.z / 20.0);
            let f = x * x - z * (z - 1.0).powi(2);
            let gradient = (2.0 * x).hypot((z - 1.0) * (3.0 * z - 1.0));
            20.0 * f / gradient.max(f.abs().sqrt())
        }),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays that run along a straight line of the surface: any answer within rounding is right.
fn ruling_case() -> Case {
    // Rays in the surface itself, along its straight lines: whether they meet it is a matter of rounding.
    let questions = (0..100).map(|i| {
        let mut random = Random::new(24, i);
        let x = random.between(-40.0, 40.0);
        let ray = Ray::new(Point::new(x, -150.0, 0.5 * x), Vector::Y);
        // On the ruling the ray lies in the surface.
        Question::First { ray, truth: Truth::hit(100.0, LEAST_COS, 0.0) }
    });
    Case {
        name: "ray along a ruling",
        surfaces: vec![swept_curve(&[(-50.0, -25.0, 1.0), (50.0, 25.0, 1.0)], 1, bezier_knots(1))],
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(|p| p.z - 0.5 * p.x),
        questions: questions.collect(),
    }
}

/// Makes z = a·x² + b·y² over [−50, 50]² mm as one biquadratic patch.
pub(super) fn paraboloid(a: f64, b: f64) -> Surface {
    // Bernstein coefficients of s² for s = 50(2u − 1), degree 2: 50²·(1, −1, 1).
    let (s1, s2) = ([-50.0, 0.0, 50.0], [2500.0, -2500.0, 2500.0]);
    let at = |i: usize, j: usize| Homogeneous::weighted(Point::new(s1[i], s1[j], a * s2[i] + b * s2[j]), 1.0);
    let points = (0..3).flat_map(|i| (0..3).map(move |j| at(i, j))).collect();
    Surface { degree: [2, 2], knots: [bezier_knots(2), bezier_knots(2)], points }
}

/// Makes the case of rays along a bowl, a micrometre down to a picometre above touching, which hit, or below, which miss.
fn tangent_case() -> Case {
    let (a, b) = (0.01, 0.015);
    let mut questions = Vec::new();
    // A micrometre, a nanometre and a picometre above and below.
    for (k, delta) in [1e-3, -1e-3, 1e-6, -1e-6, 1e-9, -1e-9].into_iter().enumerate() {
        for i in 0..60 {
            let mut random = Random::new(25, 100 * k as u64 + i);
            let (x, y) = (random.between(-20.0, 20.0), random.between(-20.0, 20.0));
            let p = Point::new(x, y, a * x * x + b * y * y);
            let n = Vector::new(-2.0 * a * x, -2.0 * b * y, 1.0).normalize();
            let d = n.cross(random.direction()).normalize();
            // Below the bowl's tangent plane the ray misses; above it cuts a short chord.
            let ray = Ray::new(p + n * delta - d * 60.0, d);
            let curvature = a * d.x * d.x + b * d.y * d.y;
            // F(p + s·d + δ·n) = 0 with F = z − a·x² − b·y²: −c·s² − 2·e·δ·s + g·δ − h·δ² = 0.
            let e = a * d.x * n.x + b * d.y * n.y;
            let g = n.z - 2.0 * (a * x * n.x + b * y * n.y);
            let h = a * n.x * n.x + b * n.y * n.y;
            let root = ((e * delta).powi(2) + curvature * (g * delta - h * delta * delta)).max(0.0).sqrt();
            let s = (-e * delta - root) / curvature;
            let cos = root / g;
            let truth = if delta > 0.0 { Truth::hit(60.0 + s, cos, delta) } else { Truth::miss(-delta) };
            questions.push(Question::First { ray, truth });
        }
    }
    Case {
        name: "tangent to a free form",
        surfaces: vec![paraboloid(a, b)],
        loops: Vec::new(),
        divisions: 48,
        slack: 0.0,
        distance: Box::new(move |p| p.z - a * p.x * p.x - b * p.y * p.y),
        questions,
    }
}

/// Makes the case of rays near a corner into which one side of a patch has collapsed, inside and outside of the patch.
fn collapsed_case() -> Case {
    // A plane triangle as a bilinear patch whose side u = 1 is one point.
    let tip = Point::new(50.0, 0.0, 0.0);
    let corners = [Point::new(-50.0, -40.0, 0.0), Point::new(-50.0, 40.0, 0.0), tip, tip];
    let points = corners.map(|p| Homogeneous::weighted(p, 1.0)).into();
    let surface = Surface { degree: [1, 1], knots: [bezier_knots(1), bezier_knots(1)], points };
    let question = |i| {
        let mut random = Random::new(26, i);
        // Mostly near the tip, over seven powers of ten.
        let back = if i % 4 == 0 { random.between(0.1, 90.0) } else { 10f64.powf(random.between(-6.0, 1.5)) };
        let x = 50.0 - back;
        let half = 0.4 * back;
        let y = half * random.between(-1.3, 1.3);
        let d = random.hemisphere(-Vector::Z);
        // Not flatter than 11°: the sides would be met at too flat an angle for a clear truth.
        let d = if d.z > -0.2 { -Vector::Z } else { d };
        let target = Point::new(x, y, 0.0);
        // The distance from the slanted sides, y = ±0.4 (50 − x).
        let inside = (half - y.abs()) / 0.4f64.hypot(1.0);
        let truth = if inside > 0.0 { Truth::hit(100.0, d.z, inside) } else { Truth::miss(-inside * d.z.abs()) };
        Question::First { ray: Ray::new(target - d * 100.0, d), truth }
    };
    Case {
        name: "collapsed edge",
        surfaces: vec![surface],
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(|p| p.z),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays at and beside the tip of a cone.
fn apex_case() -> Case {
    // A cone with its tip at the origin, opening downwards: radius = −z.
    let cone = sweep::cone(&Frame::IDENTITY, 0.0, -PI / 4.0, [0.0, 2.0 * PI], [-50.0, 0.0]);
    let question = |i| {
        let mut random = Random::new(27, i);
        // A third at the apex itself, the others from a picometre to a centimetre away.
        let r = if i % 3 == 0 { 0.0 } else { 10f64.powf(random.between(-9.0, 1.0)) };
        let (sin, cos) = random.between(0.0, 2.0 * PI).sin_cos();
        let d = Vector::new(random.between(-0.4, 0.4), random.between(-0.4, 0.4), -1.0).normalize();
        let target = Point::new(r * cos, r * sin, -r);
        let n = Vector::new(cos, sin, 1.0).normalize();
        Question::First { ray: Ray::new(target - d * 100.0, d), truth: Truth::hit(100.0, d.dot(n), 10.0) }
    };
    Case {
        name: "apex of a cone",
        surfaces: vec![cone],
        loops: Vec::new(),
        divisions: 12,
        slack: 0.0,
        distance: Box::new(|p| (p.x.hypot(p.y) + p.z) * std::f64::consts::FRAC_1_SQRT_2),
        questions: (0..300).map(question).collect(),
    }
}

/// Makes the case of rays on a cylinder whose axis is a thousand kilometres off.
fn huge_radius_case() -> Case {
    // A cylinder of radius 1e9 with its crest along y through the origin, ±50 mm wide; heights by half angles, without
    // the cancellation of R·cos − R.
    let r: f64 = 1e9;
    let h = (50.0 / r).asin();
    let drop = 2.0 * r * (0.5 * h).sin().powi(2);
    let points = [(-50.0, -drop, 1.0), (0.0, drop / h.cos(), h.cos()), (50.0, -drop, 1.0)];
    let height = move |x: f64| -x * x / (r + (r * r - x * x).sqrt());
    let question = move |i| {
        let mut random = Random::new(28, i);
        let x = random.between(-45.0, 45.0);
        let (ray, t, cos) = ray_down(&mut random, x, height(x));
        Question::First { ray, truth: Truth::hit(t, cos, 10.0) }
    };
    Case {
        name: "radius 1e9",
        surfaces: vec![swept_curve(&points, 2, bezier_knots(2))],
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(move |p| p.z - height(p.x)),
        questions: (0..300).map(question).collect(),
    }
}

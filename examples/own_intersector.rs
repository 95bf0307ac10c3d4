//! An intersector of your own: anything that answers `Intersector` can be traced. Here a sphere in closed form, a ball lens,
//! against the facets of the same sphere.
//!
//! `cargo run --release --example own_intersector`

use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Certainty, Cost, Footprint, Hit, Intersector};
use lampyris::math::{FaceId, Frame, Ray, Uv, quadratic_roots};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::sweep;
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::tessellate;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

/// A sphere around the origin, its radius in mm.
struct Sphere(f64);

impl Intersector for Sphere {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        cost.tests += 1;
        let (near, far) = quadratic_roots(
            ray.direction.length_squared(),
            2.0 * ray.origin.dot(ray.direction),
            ray.origin.length_squared() - self.0 * self.0,
        );
        // A ray that leaves the sphere must not meet the point it starts on: of its two roots that one is the smaller in size.
        let own = |t: f64, other: Option<f64>| ray.departure.is_some() && other.is_some_and(|o| t.abs() < o.abs());
        let candidates = [near.filter(|&t| !own(t, far)), far.filter(|&t| !own(t, near))];
        let t = candidates.into_iter().flatten().find(|&t| t >= ray.t_min && t <= ray.t_max)?;
        let normal = ray.point_at(t) / self.0;
        Some(Hit {
            t,
            normal,
            geometric_normal: normal,
            face: FaceId(0),
            primitive: 0,
            triangle: None,
            uv: Uv::ZERO,
            certainty: Certainty::Certified,
        })
    }

    fn footprint(&self) -> Footprint {
        Footprint { bytes: size_of::<Self>(), primitives: 1, build_seconds: 0.0 }
    }
}

const SCENE: &str = r#"
    [[model]]
    file = "ball.stp"
    [[medium]]
    name = "glass"
    index = 1.5
    [[material]]
    part = "*"
    medium = "glass"
    [[source]]
    kind = "collimated"
    at = [0, 0, -20]
    direction = [0, 0, 1]
    radius = 3
    power = 1
    [[receiver]]
    name = "focus"
    kind = "plane"
    at = [0, 0, 14.5]
    normal = [0, 0, 1]
    size = [6, 6]
    cells = [30, 30]
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface = sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]);
    let shell = Shell { faces: vec![Face::whole(surface)], closed: true, ..Shell::default() };
    let model = Model::from_part(Part { name: "ball".into(), shells: vec![shell], ..Part::default() });
    let scene = Scene::parse(SCENE, "ball.toml", Path::new("."))?.bind(&model)?;
    let run = RunSettings { rays: 50_000, ..RunSettings::default() };

    let mesh = tessellate::tessellate(&model, &tessellate::Settings::uniform(0.001)).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let powers = [&Sphere(10.0) as &dyn Intersector, &octree].map(|intersector| {
        let results = simulate(&scene, intersector, &run, &|_| true);
        println!("power {:.5}, spot {:.4} mm", results.receivers[0].power, results.receivers[0].rms[0]);
        assert!(results.power.imbalance() < 1e-9);
        results.receivers[0].power
    });
    assert!((powers[0] - powers[1]).abs() < 1e-3);
    Ok(())
}

//! Spheres and rectangles intersected in closed form, with the models that go with them: scenes whose answer is known;
//! and the scenes of the fixtures, ready to run.

use crate::files::fixture;
use lampyris::intersect::{Certainty, Cost, Footprint, Hit, Intersector};
use lampyris::math::{FaceId, Frame, Point, Ray, Uv, Vector};
use lampyris::model::{Face, Instance, Model, Part, PartId, Shell};
use lampyris::nurbs::sweep;
use lampyris::simulate::scene::ModelUse;
use lampyris::simulate::{BoundScene, KernelChoice, Results, RunSettings, Scene, simulate};
use lampyris::step;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Outward normal points away from the centre when `outward`.
    Sphere { centre: Point, radius: f64, outward: bool },
    /// Normal along the frame's z.
    Rectangle { frame: Frame, half: [f64; 2] },
}

/// Parts with a name and faces, each face also as a closed-form shape.
#[derive(Default)]
pub(crate) struct World {
    pub(crate) shapes: Vec<Shape>,
    pub(crate) model: Model,
}

fn face(name: &str, shape: &Shape) -> Face {
    let (surface, reversed) = match *shape {
        Shape::Sphere { centre, radius, outward } => {
            let frame = Frame::translation(centre);
            (sweep::sphere(&frame, radius, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]), !outward)
        }
        Shape::Rectangle { frame, half: [a, b] } => (sweep::plane(&frame, [[-a, a], [-b, b]]), false),
    };
    Face { name: name.into(), reversed, ..Face::whole(surface) }
}

impl World {
    /// Adds an instance with the given faces.
    pub(crate) fn part(&mut self, name: &str, closed: bool, faces: &[(&str, Shape)]) -> &mut Self {
        self.shapes.extend(faces.iter().map(|f| f.1));
        let faces = faces.iter().map(|(n, s)| face(n, s)).collect();
        let shells = vec![Shell { faces, closed, ..Shell::default() }];
        self.model.parts.push(Part { name: name.into(), shells, ..Part::default() });
        let part = PartId(self.model.parts.len() as u32 - 1);
        self.model.instances.push(Instance {
            name: name.into(),
            path: String::new(),
            part,
            placement: Frame::IDENTITY,
            colour: None,
        });
        self
    }

    /// Adds a closed box with faces named x0, x1, y0, y1, z0, z1.
    pub(crate) fn cuboid(&mut self, name: &str, min: Point, max: Point) -> &mut Self {
        let (c, h) = (0.5 * (min + max), 0.5 * (max - min));
        let side = |axis: Vector, x: Vector, y: Vector| {
            let frame = Frame { x, y, z: axis, ..Frame::translation(c + axis * h.dot(axis.abs())) };
            Shape::Rectangle { frame, half: [h.dot(x.abs()), h.dot(y.abs())] }
        };
        let faces = [
            ("x0", side(-Vector::X, Vector::Z, Vector::Y)),
            ("x1", side(Vector::X, Vector::Y, Vector::Z)),
            ("y0", side(-Vector::Y, Vector::X, Vector::Z)),
            ("y1", side(Vector::Y, Vector::Z, Vector::X)),
            ("z0", side(-Vector::Z, Vector::Y, Vector::X)),
            ("z1", side(Vector::Z, Vector::X, Vector::Y)),
        ];
        self.part(name, true, &faces)
    }

    pub(crate) fn sphere(&mut self, name: &str, centre: Point, radius: f64) -> &mut Self {
        self.part(name, true, &[("sphere", Shape::Sphere { centre, radius, outward: true })])
    }

    /// Runs a scene given as text.
    pub(crate) fn run(&self, text: &str, change: impl Fn(&mut RunSettings)) -> Results {
        let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&self.model).unwrap();
        let mut settings = RunSettings { threads: 2, ..RunSettings::from(&scene.run) };
        change(&mut settings);
        let results = simulate(&bound, self, &settings, &|_| true);
        assert!(results.power.imbalance() < 1e-9, "energy: {:?}", results.power);
        let ends: Vec<u128> = results.tallies.ends.iter().map(|s| s.total).collect();
        assert_eq!(ends[0], ends[1..].iter().sum::<u128>(), "energy closes to the last quantum");
        let full = RunSettings { kernel: KernelChoice::Full, threads: 3, ..settings };
        let full = simulate(&bound, self, &full, &|_| true);
        assert_eq!(results.digest, full.digest, "the full kernel gives the same bits");
        results
    }
}

impl Shape {
    /// Nearest crossing behind `t_min`; `leaving` when the ray starts on this very shape.
    fn hit(&self, ray: &Ray, leaving: bool) -> Option<(f64, Vector)> {
        match *self {
            Self::Rectangle { frame, half } => {
                let along = ray.direction.dot(frame.z);
                if along == 0.0 || leaving {
                    return None;
                }
                let t = (frame.origin - ray.origin).dot(frame.z) / along;
                let p = frame.local_point(ray.point_at(t));
                let inside = p.x.abs() <= half[0] && p.y.abs() <= half[1];
                (inside && t >= ray.t_min && t <= ray.t_max).then_some((t, frame.z))
            }
            Self::Sphere { centre, radius, outward } => {
                let o = ray.origin - centre;
                let b = o.dot(ray.direction);
                let roots = if leaving {
                    [-2.0 * b, f64::NAN]
                } else {
                    let foot = o - ray.direction * b;
                    let root = (radius * radius - foot.length_squared()).sqrt();
                    [-b - root, -b + root]
                };
                let t = roots.into_iter().find(|&t| t > 0.0 && t >= ray.t_min && t <= ray.t_max)?;
                let n = (ray.point_at(t) - centre) / radius;
                Some((t, if outward { n } else { -n }.normalize()))
            }
        }
    }
}

impl Intersector for World {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let hit = |(i, s): (usize, &Shape)| {
            let leaving = ray.departure.is_some_and(|d| d.primitive == i as u32);
            s.hit(ray, leaving).map(|(t, normal)| Hit {
                t,
                normal,
                geometric_normal: normal,
                face: FaceId(i as u32),
                primitive: i as u32,
                triangle: None,
                uv: Uv::ZERO,
                certainty: Certainty::Certified,
            })
        };
        self.shapes.iter().enumerate().filter_map(hit).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.shapes.len(), ..Footprint::default() }
    }
}

/// A scene of the fixtures with text added, its model, and the two together.
pub(crate) fn fixture_scene(file: &str, extra: &str) -> (Scene, Model, BoundScene) {
    let folder = fixture("scenes");
    let text = std::fs::read_to_string(folder.join(file)).unwrap() + extra;
    let scene = Scene::parse(&text, file, &folder).unwrap();
    let read = |m: &ModelUse| step::read(&scene.resolve(&m.file), &step::Settings::default()).unwrap().model;
    let model = scene.assemble(scene.models.iter().map(read).collect()).unwrap();
    let bound = scene.bind(&model).unwrap();
    (scene, model, bound)
}

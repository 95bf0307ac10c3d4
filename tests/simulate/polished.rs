//! Light in closed bodies whose facet hits are moved to the spline: none is lost, however often it is reflected inside.

use crate::files::fixture;
use crate::support::{Shape, World};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::{Face, Instance, Model, Part, PartId, Shell};
use lampyris::nurbs::sweep;
use lampyris::simulate::{Results, RunSettings, Scene, simulate};
use lampyris::step;
use lampyris::tessellate::{self, tessellate};
use std::f64::consts::TAU;
use std::path::Path;

fn run(model: &Model, text: &str) -> Results {
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(model).unwrap();
    let settings = tessellate::Settings { measure: false, ..Default::default() };
    let mesh = tessellate(model, &settings).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let exact = Exact::build(model, &exact::Settings::default());
    let polished = Polished::new(&octree, &mesh, &exact);
    let settings = RunSettings { threads: 2, ..RunSettings::from(&scene.run) };
    let results = simulate(&bound, &polished, &settings, &|_| true);
    assert!(results.power.imbalance() < 1e-9, "{:?}", results.power);
    results
}

const GUIDE: &str = "[[medium]]\nname = 'core'\nindex = 1.6\n[[material]]\npart = '*'\nmedium = 'core'\n";

/// Light that runs round in a ring by total reflection, a thousand times and flat along its wall: it never gets out.
#[test]
fn light_that_runs_round_in_a_ring_stays_in_it() {
    let surface = sweep::torus(&Frame::IDENTITY, 20.0, 2.0, [0.0, TAU], [0.0, TAU]);
    let shells = vec![Shell { faces: vec![Face::whole(surface)], closed: true, ..Shell::default() }];
    let part = Part { name: "ring".into(), shells, ..Part::default() };
    let placed = Instance {
        name: "ring".into(),
        path: String::new(),
        part: PartId(0),
        placement: Frame::IDENTITY,
        colour: None,
    };
    let model = Model { parts: vec![part], instances: vec![placed], ..Model::default() };
    let text = format!(
        "[run]\nrays = 500\nmax_bounces = 1000\ncaught_after = inf\n{GUIDE}
        [[source]]\nkind = 'cone'\nhalf_angle_deg = 40\nat = [20.1, 0.05, 0.3]\ndirection = [0, 1, 0]"
    );
    let results = run(&model, &text);
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
    assert!(results.power.cut_off > 0.9, "{:?}", results.power);
}

/// Beside the edges of a lens the spline stands out over the facets on both sides: light that is reflected there goes on to the
/// next face all the same.
#[test]
fn light_reflected_beside_the_edges_of_a_lens_is_not_lost() {
    let file = fixture("step/lens_planoconvex_analytic.stp");
    let model = step::read(&file, &step::Settings::default()).unwrap().model;
    let text = format!("[run]\nrays = 20000\nmax_bounces = 300\n{GUIDE}[[source]]\nkind = 'point'\nat = [3, 2, 1]");
    let results = run(&model, &text);
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
}

/// A ball in a shell with a gap of 5 µm between them, a twentieth of the sag, the facets of the one turned against those of the other and
/// through them: light finds both faces.
#[test]
fn a_ball_in_a_shell_that_nearly_fits_loses_no_light() {
    let mut world = World::default();
    let sphere = |radius: f64, outward: bool| Shape::Sphere { centre: Point::ZERO, radius, outward };
    world.part("shell", true, &[("out", sphere(10.0, true)), ("in", sphere(6.0, false))]);
    world.sphere("ball", Point::ZERO, 5.995);
    world.model.instances[1].placement = Frame::from_axis(Point::ZERO, Vector::new(1.0, 1.0, 1.0), None);
    let text = "[run]\nrays = 5000\nmax_bounces = 300
        [[medium]]\nname = 'a'\nindex = 1.5\n[[material]]\npart = 'shell'\nmedium = 'a'
        [[medium]]\nname = 'b'\nindex = 1.7\n[[material]]\npart = 'ball'\nmedium = 'b'
        [[source]]\nkind = 'point'\nat = [3, 2, 1]";
    let results = run(&world.model, text);
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
}

/// Light from outside is not found inside an opaque solid, whose facets it passes beside an edge.
#[test]
fn light_that_meets_an_opaque_solid_beside_its_edges_meets_it_from_outside() {
    let (_, model, bound) = crate::support::fixture_scene("s3_reflector.toml", "");
    let mesh = tessellate(&model, &tessellate::Settings { measure: false, ..Default::default() }).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let exact = Exact::build(&model, &exact::Settings::default());
    let settings = RunSettings { rays: 50_000, threads: 2, ..Default::default() };
    let results = simulate(&bound, &Polished::new(&octree, &mesh, &exact), &settings, &|_| true);
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
}

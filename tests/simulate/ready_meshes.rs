//! Faces that a file gives as ready meshes beside faces with a surface: the spline is queried where there is one, the mesh where there is
//! none, and only what has no true surface is without an error.

use crate::support::{Shape, World};
use lampyris::math::{FaceId, Frame, Point, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use lampyris::model::{Model, TessellatedFace};
use lampyris::pipeline::{
    IntersectorKind, LoadedModel, PreparedScene, SceneJob, SceneResults, Silent, TraceRequest, TracingSettings,
};
use lampyris::simulate::Scene;
use std::path::Path;

/// Light through a ball of glass, turned aside by a flat mirror behind it.
const TEXT: &str = "[run]\nrays = 60_000\n\
    [[source]]\nkind = 'collimated'\nat = [0, 0, 20]\ndirection = [0, 0, -1]\nradius = 2\n\
    [[material]]\npart = 'plate'\nsurface = 'mirror'\n\
    [[receiver]]\nname = 'wall'\nat = [-12, 0, -12]\nnormal = [1, 0, 0]\nsize = [10, 10]\ncells = [8, 8]\n";
const BALL: &str = "[[material]]\npart = 'ball'\nmedium = 'N-BK7'\n";

/// A mirror of 16 mm at 45° to the light, as a surface.
fn plate() -> World {
    let x = Vector::new(1.0, 0.0, 1.0).normalize();
    let frame = Frame { x, y: Vector::Y, z: x.cross(Vector::Y), ..Frame::translation(Point::new(0.0, 0.0, -12.0)) };
    let mut world = World::default();
    world.part("plate", false, &[("flat", Shape::Rectangle { frame, half: [8.0, 8.0] })]);
    world
}

/// The same with the plate as the file's own mesh of one quad.
fn with_ready_plate(mut world: World) -> Model {
    let plate = &mut world.model.parts[0];
    let surface = plate.shells.remove(0).faces[0].surface.clone();
    let [[u0, u1], [v0, v1]] = surface.domain();
    let corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(|[u, v]| surface.evaluate(Uv::new(u, v)));
    let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
    let vertices = (0..4).map(|position| MeshVertex { position, normal, uv: Uv::ZERO }).collect();
    let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }];
    let mesh = FacetMesh { positions: corners.to_vec(), vertices, facets, sag: vec![0.0] };
    let ready = TessellatedFace { name: "net".into(), entity: Some(7), colour: None, layer: None, mesh };
    plate.tessellated.push(ready);
    world.model
}

fn with_ball() -> World {
    let mut world = plate();
    world.sphere("ball", Point::ZERO, 5.0);
    world
}

fn run(model: Model, text: &str, intersector: Option<IntersectorKind>) -> (PreparedScene, SceneResults) {
    let scene = Scene::parse(text, "mesh.toml", Path::new(".")).unwrap();
    let tracing = TracingSettings { intersector, threads: Some(2), ..TracingSettings::default() };
    let loaded = LoadedModel { model, ..LoadedModel::default() };
    let prepared = PreparedScene::new(SceneJob { tracing, ..SceneJob::new(scene, loaded) }, &Silent).unwrap();
    let traced = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    (prepared, traced)
}

/// The mirror is flat, so that a mesh of it is the mirror itself: the spline run with either gives the same light.
#[test]
fn the_spline_and_a_ready_mesh_answer_together() {
    let text = format!("{TEXT}{BALL}");
    let (_, surfaces) = run(with_ball().model, &text, Some(IntersectorKind::Exact));
    let (prepared, meshes) = run(with_ready_plate(with_ball()), &text, Some(IntersectorKind::Exact));
    let [expected, found] = [surfaces, meshes].map(|run| run.results.receivers[0].clone());
    assert!(expected.power > 0.5, "{}", expected.power);
    assert!((found.power - expected.power).abs() < 1e-9, "{} for {}", found.power, expected.power);
    // Places are counted in steps of half the side by 65,536.
    assert!((found.rms[0] - expected.rms[0]).abs() < 1e-4, "{:?} for {:?}", found.rms, expected.rms);
    let note = prepared.bound.notes().iter().find(|note| note.contains("ready mesh")).expect("a note");
    assert!(note.contains("'net' (#7)") && note.contains("not known"), "{note}");
}

/// A source on the ball and the mesh of 16 × 16 mm shines from the ball alone, and says so.
#[test]
fn a_ready_mesh_does_not_shine() {
    let text = "[[source]]\nkind = 'lambertian'\non = { part = '*' }\n";
    let scene = Scene::parse(text, "mesh.toml", Path::new(".")).unwrap();
    let notes = scene.bind(&with_ready_plate(with_ball())).unwrap().notes().join("\n");
    assert!(notes.contains("1 of the 2 faces that [[source]] 1 names do not shine"), "{notes}");
    assert!(notes.contains("(256 mm²)"), "{notes}");
}

/// The ball is round: facets change its light, whatever else the model holds.
#[test]
fn a_ready_mesh_takes_no_error_from_curved_faces() {
    let (prepared, run) = run(with_ready_plate(with_ball()), &format!("{TEXT}{BALL}"), None);
    let chosen = prepared.chosen.as_ref().unwrap();
    assert!(chosen.pilot_rays > 0, "{}", chosen.because);
    let facets = &chosen.alternatives[0];
    assert!(facets.intersector == "octree" && facets.geometric_to_statistical > 0.0, "{facets:?}");
    assert!(chosen.intersector == "exact" || chosen.geometric.as_ref().is_some_and(|g| g.rays > 0), "{chosen:?}");
    let figures = run.figures(&prepared);
    assert!(figures[0].power.value > 0.5 && figures[0].power.geometric.is_some(), "{:?}", figures[0]);
}

#[test]
fn flat_faces_and_ready_meshes_alone_are_what_was_given() {
    let (prepared, run) = run(with_ready_plate(plate()), TEXT, None);
    let chosen = prepared.chosen.as_ref().unwrap();
    assert_eq!((chosen.intersector, chosen.pilot_rays), ("octree", 0));
    assert!(chosen.because.contains("from its own original is not known"), "{}", chosen.because);
    assert_eq!(run.figures(&prepared)[0].power.geometric, Some(0.0));
}

//! Scenes of parts that are placed often: the same light as through one mesh of everything.

use crate::files::fixture;
use crate::support::World;
use lampyris::intersect::NormalMode;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Intersector, polish::Polished};
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::{Analytic, Instance, Model};
use lampyris::pipeline::{
    IntersectorKind, LoadedModel, MeshingSettings, PreparedScene, SceneJob, Silent, TraceRequest, TracingSettings,
};
use lampyris::simulate::{Results, Scene, simulate};
use lampyris::step;
use lampyris::tessellate::{self, tessellate};
use std::path::Path;

const RAYS: u64 = 6000;

/// The first instance of a model `count` × `count` times, about the origin.
fn repeated(mut model: Model, count: usize, pitch: f64) -> Model {
    let first = model.instances.remove(0);
    let place = |k: usize| pitch * (k as f64 - 0.5 * (count as f64 - 1.0));
    for k in 0..count * count {
        let shift = Frame::translation(Vector::new(place(k % count), place(k / count), 0.0));
        let placement = shift.compose(&first.placement);
        model.instances.push(Instance { name: format!("{} {k}", first.name), placement, ..first.clone() });
    }
    model
}

fn prepared(model: &Model, text: &str, intersector: IntersectorKind, normals: NormalMode) -> PreparedScene {
    let scene = Scene::parse(text, "array.toml", Path::new(".")).unwrap();
    let loaded = LoadedModel { model: model.clone(), reports: Vec::new(), seconds: 0.0 };
    let tracing = TracingSettings {
        intersector: Some(intersector),
        normals: Some(normals),
        threads: Some(2),
        ..TracingSettings::default()
    };
    let meshing = MeshingSettings { tolerance: Some([0.05, 0.2]), ..MeshingSettings::default() };
    PreparedScene::new(SceneJob { tracing, meshing, ..SceneJob::new(scene, loaded) }, &Silent).unwrap()
}

/// The same run on structures over the whole model.
fn in_one_piece(prepared: &PreparedScene) -> Results {
    let (model, settings) = (&prepared.job.loaded.model, &prepared.mesh_settings);
    let mesh = tessellate(model, settings).mesh;
    let exact = || Exact::build(model, &exact::Settings::for_few_rays());
    let normals = prepared.choice.normals.on_facets();
    let octree = Octree::build(&mesh, &octree::Settings { normals, ..Default::default() });
    let trace = |who: &dyn Intersector| simulate(&prepared.bound, who, &prepared.run_settings(), &|_| true);
    match (prepared.choice.intersector, prepared.choice.normals) {
        (IntersectorKind::Exact, _) => trace(&exact()),
        (_, NormalMode::Exact) => trace(&Polished::new(&octree, &mesh, &exact())),
        _ => trace(&octree),
    }
}

fn are_close(one: &Results, other: &Results, share: f64) {
    let powers = |r: &Results| [r.power.received, r.power.absorbed, r.power.escaped, r.power.lost];
    for (a, b) in powers(one).into_iter().zip(powers(other)) {
        assert!((a - b).abs() <= share, "{:?} {:?}", one.power, other.power);
    }
    for (a, b) in one.receivers.iter().zip(&other.receivers) {
        assert!((a.rms[0] - b.rms[0]).abs() <= 10.0 * share * b.rms[0], "{:?} {:?}", a.rms, b.rms);
    }
    assert_eq!((one.lost_rays, other.lost_rays), (0, 0));
}

fn array_scene(material: &str) -> String {
    format!(
        "[run]\nrays = {RAYS}\n[[medium]]\nname = 'glass'\nindex = 1.5168\nabsorption_per_mm = 1e-3\n{material}\
         [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\ndirection = [0, 0, 1]\nsize = [400, 400]\npower = 1\n\
         [[receiver]]\nname = 'wall'\nat = [0, 0, 60]\nsize = [500, 500]\ncells = [20, 20]\n"
    )
}

#[test]
fn an_array_of_lenses_gives_the_light_of_one_mesh() {
    let lens = step::read(&fixture("step/lens_planoconvex_nurbs.stp"), &step::Settings::default()).unwrap().model;
    let model = repeated(lens, 9, 45.0);
    let text = array_scene("[[material]]\npart = '*'\nmedium = 'glass'\n");
    for (intersector, normals) in [
        (IntersectorKind::Octree, NormalMode::Bilinear),
        (IntersectorKind::Cwbvh, NormalMode::Flat),
        (IntersectorKind::Exact, NormalMode::Exact),
        (IntersectorKind::Octree, NormalMode::Exact),
    ] {
        let prepared = prepared(&model, &text, intersector, normals);
        let instancing = prepared.facets.instancing.as_ref().expect("81 lenses that stand apart");
        assert_eq!((instancing.placements.len(), instancing.groups[0].instances.len()), (81, 0));
        let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
        if normals != NormalMode::Flat {
            are_close(&run.results, &in_one_piece(&prepared), 1e-6);
        }
        // Light absorbed in every lens, by its own name, and differences from the spline explained lens by lens.
        let absorbed = run.results.absorbed.iter().filter(|a| a.r#in == "glass").count();
        assert_eq!(absorbed, 81);
        let check = run.check.expect("rays are asked again");
        assert_eq!((check.facets_vs_exact.unexplained, check.octree_vs_bvh.disagree), (0, 0), "{check:?}");
        assert!(check.hits > 1000);
    }
}

/// Dies that stand on a plate: their plane faces touch, and light crosses from one medium into the other there.
#[test]
fn light_passes_from_instances_into_what_they_stand_on() {
    let mut world = World::default();
    world.cuboid("die", Point::new(-4.0, -4.0, 0.0), Point::new(4.0, 4.0, 3.0));
    world.cuboid("plate", Point::new(-60.0, -60.0, 3.0), Point::new(60.0, 60.0, 8.0));
    let mut model = world.model.clone();
    for face in model.parts.iter_mut().flat_map(|p| &mut p.shells).flat_map(|s| &mut s.faces) {
        face.analytic = Analytic::Plane { frame: Frame::IDENTITY };
    }
    let model = repeated(model, 9, 12.0);
    let text =
        array_scene("[[material]]\npart = ['die', 'plate']\nmedium = 'glass'\n").replace("400, 400", "100, 100");
    for intersector in [IntersectorKind::Octree, IntersectorKind::Exact] {
        let prepared = prepared(&model, &text, intersector, NormalMode::Bilinear);
        let instancing = prepared.facets.instancing.as_ref().expect("plane faces are not glued");
        assert_eq!((instancing.placements.len(), instancing.groups[0].instances.len()), (81, 1));
        let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
        are_close(&run.results, &in_one_piece(&prepared), 1e-5);
        // Bare glass on both ends of die and plate as of one block, at normal incidence.
        let reflected = (0.5168f64 / 2.5168).powi(2);
        let (through, path) = ((1.0 - reflected).powi(2), 8.0);
        let block =
            |length: f64| through * (-1e-3 * length).exp() / (1.0 - (reflected * (-1e-3 * length).exp()).powi(2));
        let filled = 81.0 * 64.0 / 1e4;
        let expected = filled * block(path) + (1.0 - filled) * block(5.0);
        let received = run.results.receivers[0].power;
        assert!((received - expected).abs() < 2e-3, "{received} for {expected}");
    }
}

/// What is drawn of very many stays small, and all of few is drawn.
#[test]
fn instances_are_drawn_in_the_room_there_is() {
    let lens = step::read(&fixture("step/lens_planoconvex_nurbs.stp"), &step::Settings::default()).unwrap().model;
    let text = array_scene("[[material]]\npart = '*'\nmedium = 'glass'\n");
    let model = repeated(lens, 20, 45.0);
    let prepared = prepared(&model, &text, IntersectorKind::Octree, NormalMode::Bilinear);
    let facets = &prepared.facets;
    let flat = tessellate(&model, &tessellate::Settings { tolerance: [0.05, 0.2], ..Default::default() }).mesh;
    let whole = facets.whole();
    assert_eq!((facets.facet_count(), whole.facets.len()), (flat.facets.len(), flat.facets.len()));
    assert!(
        (whole.area() / flat.area() - 1.0).abs() < 1e-12 && (whole.volume() / flat.volume() - 1.0).abs() < 1e-9
    );
    let count = |face: u32| flat.facets.iter().filter(|f| f.face.0 == face).count();
    assert!((0..3).all(|f| whole.facets.iter().filter(|x| x.face.0 == f).count() == count(f)));
    assert!(facets.bytes() < 200_000 && facets.bounds().contains(flat.bounds().max));
    let some = facets.drawn(1500);
    assert!((1000..2200).contains(&some.facets.len()), "{}", some.facets.len());
    assert_eq!(some.topology(0..some.facets.len()).open_edges, 0);
}

//! Scenes of parts that are placed often: the same light as through one mesh of everything.

use crate::files::fixture;
use crate::support::{Shape, World};
use lampyris::intersect::NormalMode;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Intersector, polish::Polished};
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::{Analytic, Instance, Model, PartId};
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
    let loaded = LoadedModel { model: model.clone(), ..LoadedModel::default() };
    let tracing = TracingSettings {
        intersector: Some(intersector),
        // The spline has normals of its own.
        normals: (intersector != IntersectorKind::Exact).then_some(normals),
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
    let exact = || Exact::build(model, &exact::Settings::for_rays(10_000));
    let normals = prepared.choice.normals.on_facets();
    let octree = Octree::build(&mesh, &octree::Settings { normals, ..Default::default() });
    let trace =
        |intersector: &dyn Intersector| simulate(&prepared.bound, intersector, &prepared.run_settings(), &|_| true);
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

/// A product that holds another one at these places, mm, each turned by half a turn about z or not.
type Assembly = Vec<([f64; 3], bool)>;

/// The file of the lens with assemblies around it, the innermost first.
fn assembled(levels: &[Assembly]) -> Model {
    let lens = std::fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    // The lens' product and shape, its axes and units: entities of the fixture.
    let (mut child, mut shape) = (5, 10);
    let mut lines = "#9000=DIRECTION('',(-1.,0.,0.));\n".to_owned();
    for (level, places) in levels.iter().enumerate() {
        let product = 10_000 * (level + 1);
        let own = product + 1;
        lines += &format!(
            "#{product}=PRODUCT_DEFINITION('','',$,#9);\n#{own}=SHAPE_REPRESENTATION('',(#11),#185);\n\
             #{}=PRODUCT_DEFINITION_SHAPE('','',#{product});\n#{}=SHAPE_DEFINITION_REPRESENTATION(#{},#{own});\n",
            product + 2,
            product + 3,
            product + 2
        );
        for (k, ([x, y, z], turned)) in places.iter().enumerate() {
            let id = |entity: usize| product + 10 * (k + 1) + entity;
            let x_axis = if *turned { 9000 } else { 14 };
            lines += &format!(
                "#{}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));\n#{}=AXIS2_PLACEMENT_3D('',#{},#13,#{x_axis});\n\
                 #{}=ITEM_DEFINED_TRANSFORMATION('','',#11,#{});\n\
                 #{}=(REPRESENTATION_RELATIONSHIP('','',#{shape},#{own})\
                 REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{})SHAPE_REPRESENTATION_RELATIONSHIP());\n\
                 #{}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#{product},#{child},$);\n\
                 #{}=PRODUCT_DEFINITION_SHAPE('','',#{});\n\
                 #{}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{},#{});\n",
                id(0),
                id(1),
                id(0),
                id(2),
                id(1),
                id(3),
                id(2),
                id(4),
                id(5),
                id(4),
                id(6),
                id(3),
                id(5)
            );
        }
        (child, shape) = (product, own);
    }
    let end = lens.rfind("ENDSEC;").unwrap();
    let text = format!("{}{lines}{}", &lens[..end], &lens[end..]);
    step::read_bytes("array.stp", text.as_bytes(), &step::Settings::default()).unwrap().model
}

/// Ten rows of nine lenses, every other row turned about: as rows in an array, and as ninety lenses in one.
#[test]
fn nested_assemblies_give_the_bits_of_one_level() {
    let pitch = 45.0;
    let [across, along] = [9, 10].map(|n: usize| move |k: usize| pitch * (k as f64 - 0.5 * (n as f64 - 1.0)));
    let row: Assembly = (0..9).map(|k| ([across(k), 0.0, 0.0], false)).collect();
    let rows: Assembly = (0..10).map(|k| ([0.0, along(k), 0.0], k % 2 == 1)).collect();
    let place = |k: usize| {
        let is_turned = k / 9 % 2 == 1;
        let x = if is_turned { -across(k % 9) } else { across(k % 9) };
        ([x, along(k / 9), 0.0], is_turned)
    };
    let [nested, flat] = [assembled(&[row, rows]), assembled(&[(0..90).map(place).collect()])];
    assert_eq!((nested.instances.len(), nested.parts.len()), (90, 1));
    let text = array_scene("[[material]]\npart = '*'\nmedium = 'glass'\n");
    for (intersector, normals) in
        [(IntersectorKind::Octree, NormalMode::Bilinear), (IntersectorKind::Exact, NormalMode::Exact)]
    {
        let [nested, flat] = [&nested, &flat].map(|model| prepared(model, &text, intersector, normals));
        let groups = |p: &PreparedScene| p.facets.instancing.as_ref().map(|i| (i.groups.len(), i.placements.len()));
        assert_eq!((groups(&nested), groups(&flat)), (Some((2, 90)), Some((2, 90))));
        let [one, two] = [&nested, &flat].map(|p| p.trace(TraceRequest::default(), &Silent).unwrap().results);
        assert_eq!(one.digest, two.digest);
        are_close(&one, &in_one_piece(&nested), 1e-6);
    }
}

/// A black dome over an array, which stands once, and whose box holds all lenses.
#[test]
fn a_cover_stands_beside_what_is_placed_often() {
    let lens = step::read(&fixture("step/lens_planoconvex_nurbs.stp"), &step::Settings::default()).unwrap().model;
    let mut model = repeated(lens, 9, 45.0);
    let glass = format!("[[material]]\npart = '{}'\nmedium = 'glass'\n", model.parts[0].name);
    let mut dome = World::default();
    dome.part("dome", false, &[("inside", Shape::Sphere { centre: Point::ZERO, radius: 320.0, outward: false })]);
    model.parts.extend(dome.model.parts);
    model.instances.push(Instance { part: PartId(1), ..dome.model.instances[0].clone() });
    let text = array_scene(&glass).replace("size = [500, 500]", "size = [400, 400]");
    let prepared = prepared(&model, &text, IntersectorKind::Octree, NormalMode::Bilinear);
    let instancing = prepared.facets.instancing.as_ref().expect("the dome touches no lens");
    assert_eq!((instancing.placements.len(), instancing.groups[0].instances.len()), (81, 1));
    let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    are_close(&run.results, &in_one_piece(&prepared), 1e-6);
}

/// Where nothing is said, a pilot of the run's own rays chooses, as for a model in one piece.
#[test]
fn a_pilot_chooses_for_what_is_placed_often() {
    let lens = step::read(&fixture("step/lens_planoconvex_nurbs.stp"), &step::Settings::default()).unwrap().model;
    let text = array_scene("[[material]]\npart = '*'\nmedium = 'glass'\n").replace("rays = 6000", "rays = 60000");
    // Clear: what each lens absorbs would be a figure of its own, of which one has more.
    let text = text.replace("absorption_per_mm = 1e-3\n", "");
    // One lens fewer than are placed in groups, and so many: what facets change is the same.
    let [apart, grouped] = [7, 8].map(|columns| {
        let mut model = repeated(lens.clone(), 8, 45.0);
        model.instances.truncate(8 * columns + 7);
        let scene = Scene::parse(&text, "array.toml", Path::new(".")).unwrap();
        let loaded = LoadedModel { model, ..LoadedModel::default() };
        PreparedScene::new(SceneJob::new(scene, loaded), &Silent).unwrap()
    });
    assert!(apart.facets.instancing.is_none() && grouped.facets.instancing.is_some());
    let [apart, grouped] = [apart, grouped].map(|p| p.chosen.expect("nothing was asked"));
    assert_eq!((apart.pilot_rays, grouped.pilot_rays), (4096, 4096));
    assert_eq!((apart.intersector, apart.normals), (grouped.intersector, grouped.normals));
    assert_eq!(apart.tolerance_mm, grouped.tolerance_mm);
    assert_eq!(apart.alternatives.len(), grouped.alternatives.len());
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

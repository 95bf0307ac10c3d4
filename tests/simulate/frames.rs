//! Sources and receivers in the frames of parts: the same light as in those of the scene, wherever the part stands.

use crate::support::World;
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::{Instance, PartId};
use lampyris::simulate::{RunSettings, Scene, simulate};
use std::path::Path;

/// A lamp that stands turned and moved.
fn lamp() -> (World, Frame) {
    let mut world = World::default();
    world.cuboid("lamp", Point::splat(-1.0), Point::splat(1.0));
    let placement = Frame::from_axis(Point::new(30.0, -20.0, 10.0), Vector::new(1.0, 2.0, 2.0), None);
    world.model.instances[0].placement = placement;
    (world, placement)
}

fn powers(world: &World, text: &str) -> Vec<f64> {
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    // Nothing stands in the way: the World knows the unmoved part alone.
    let empty = World::default();
    let settings = RunSettings { threads: 2, ..RunSettings::from(&scene.run) };
    simulate(&bound, &empty, &settings, &|_| true).receivers.iter().map(|r| r.power).collect()
}

/// All kinds that stand somewhere, with sizes at which each gets a part of the light.
const RECEIVERS: [&str; 4] = [
    "kind = 'plane'\nat = [0, 0, 40]\nnormal = [0, 0, -1]\nx = [0, 1, 0]\nsize = [20, 60]\nabsorbs = false",
    "kind = 'disc'\nat = [5, 0, 50]\nnormal = [0, 0.2, -1]\nradius = 12\nabsorbs = false",
    "kind = 'sphere'\nat = [0, 9, 60]\nradius = 12\nabsorbs = false",
    "kind = 'far_field'\nh_deg = [-5, 20]\nv_deg = [0, 9]",
];

fn scene(frame: &str) -> String {
    let receivers: String =
        RECEIVERS.iter().enumerate().map(|(k, r)| format!("[[receiver]]\nname = 'r{k}'\n{frame}{r}\n")).collect();
    format!(
        "[run]\nrays = 40_000\n[[source]]\nkind = 'cone'\nhalf_angle_deg = 25\nsize = [4, 1]\ndirection = [0, 0.1, 1]\n{frame}{receivers}"
    )
}

#[test]
fn what_stands_in_a_frame_goes_with_it() {
    let (world, _) = lamp();
    let (placed, unplaced) = (powers(&world, &scene("frame = 'lamp'\n")), powers(&world, &scene("")));
    for (a, b) in placed.iter().zip(&unplaced) {
        // The same rays from the same numbers, but for rounding at borders: a few of 40,000.
        assert!(*b > 0.01 && (a - b).abs() < 2e-4, "{placed:?} {unplaced:?}");
    }
}

/// Mixed, as a lamp that is aimed at a fixed wall: a ray along the lamp's axis meets the wall where the placement says.
#[test]
fn a_source_in_a_frame_is_seen_from_the_scene() {
    let (world, placement) = lamp();
    let target = placement.point(Point::new(0.0, 0.0, 90.0));
    let text = |at: Point| {
        format!(
            "[run]\nrays = 1000\n[[source]]\nkind = 'collimated'\nframe = 'lamp'\n
            [[receiver]]\nname = 'wall'\nkind = 'disc'\nradius = 0.001\nnormal = [0, 0, 1]\nat = [{}, {}, {}]\n",
            at.x, at.y, at.z
        )
    };
    assert!((powers(&world, &text(target))[0] - 1.0).abs() < 1e-9);
    assert_eq!(powers(&world, &text(target + Vector::X)), [0.0]);
}

#[test]
fn a_frame_must_be_one() {
    let (mut world, placement) = lamp();
    let bind = |world: &World, source: &str| {
        let text = format!("[[source]]\n{source}\n[[receiver]]\nname = 'r'\nkind = 'sphere'\nradius = 90\n");
        let error = Scene::parse(&text, "test.toml", Path::new(".")).and_then(|s| s.bind(&world.model)).err();
        error.map(|e| e.to_string()).unwrap_or_default()
    };
    let message = bind(&world, "frame = 'lomp'");
    assert!(message.contains("'lomp'") && message.contains("did you mean 'lamp'"), "{message}");
    let message = bind(&world, "on = { part = 'lamp' }\nframe = 'lamp'");
    assert!(message.contains("`frame` belongs to a source with `at`"), "{message}");
    // A second place of the part, under a name of its own: the part's name no longer says which, the instances' do.
    world.model.instances[0].name = "left".into();
    world.model.instances.push(Instance {
        name: "right".into(),
        path: String::new(),
        part: PartId(0),
        placement,
        colour: None,
    });
    world.model.parts[0].name = "headlamp".into();
    let message = bind(&world, "frame = 'headlamp'");
    assert!(message.contains("placed 2 times"), "{message}");
    assert_eq!(bind(&world, "frame = 'right'"), "");
    assert_eq!(bind(&world, "frame = 'r*t'"), "");
    let message = bind(&world, "frame = '*t'");
    assert!(message.contains("'*t' is placed 2 times"), "{message}");
}

/// Where the file's parts stand in an assembly of their own, the model's coordinates are those of its file.
#[test]
fn a_model_is_a_frame_by_its_name() {
    let text = "[[model]]\nfile = 'a.stp'\nname = 'module'\nplacement = { at = [0, 0, 50] }\n\
        [run]\nrays = 1024\n[[source]]\nkind = 'collimated'\nframe = 'module'\n\
        [[receiver]]\nname = 'below'\nkind = 'disc'\nradius = 1\nat = [0, 0, 49]\nabsorbs = false\n\
        [[receiver]]\nname = 'above'\nkind = 'disc'\nradius = 1\nat = [0, 0, 51]\nabsorbs = false\n";
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let (mut world, _) = lamp();
    world.model = scene.assemble(vec![world.model]).unwrap();
    assert_eq!(powers(&world, text), [0.0, 1.0]);
}

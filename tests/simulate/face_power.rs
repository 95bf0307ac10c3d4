//! Power by face: against the closed forms of a plate and a ball, in parts, and without a trace elsewhere.

use crate::support::World;
use lampyris::math::Point;
use lampyris::simulate::{FaceResult, Hooks, PartialRun, Results, RunSettings, Scene, trace};
use std::path::Path;

/// Faces of the first cuboid of a world.
const BELOW: u32 = 4;
const ABOVE: u32 = 5;

fn of(results: &Results, face: u32) -> FaceResult {
    let found = results.faces.as_ref().unwrap();
    *found.first.iter().find(|f| f.face == face).unwrap()
}

fn plate() -> World {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    world
}

/// With T the internal transmittance of a plate and R = 0.04 the reflectance of each side, (1 − R)/(1 − R²T²) of the light enters it from
/// outside or is thrown back inside, (1 − R)²T/(1 − R²T²) leaves it behind and R(1 − R)²T²/(1 − R²T²) before.
#[test]
fn a_plate_lets_out_what_airy_sums_say() {
    let transmittance = (-0.3f64).exp();
    let text = "[run]\nrays = 4000\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 0\nfaces = 10
        [[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 0.1\n[[material]]\npart = 'glass'\nmedium = 'glass'
        [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 5\n";
    let r = plate().run(text, |_| ());
    let (back, turns) = (0.04, 1.0 - (0.04 * transmittance).powi(2));
    let expected = [
        (BELOW, 1.0 - back, back * ((1.0 - back) * transmittance).powi(2) / turns),
        (ABOVE, 0.0, (1.0 - back).powi(2) * transmittance / turns),
    ];
    let faces = r.faces.as_ref().unwrap();
    assert_eq!(faces.count, 2);
    assert!(faces.rest_left == 0.0 && faces.rest_left.is_sign_positive(), "no rest is 0, not −0");
    for (face, entered, left) in expected {
        let found = of(&r, face);
        assert!((found.entered - entered).abs() < 1e-9, "{face}: {} {entered}", found.entered);
        assert!((found.left - left).abs() < 1e-9, "{face}: {} {left}", found.left);
        assert_eq!(found.absorbed, 0.0);
    }
}

/// A point in the middle of a ball without absorption: all of its light leaves through the one face, once; on black walls around it each
/// absorbs a sixth.
#[test]
fn a_ball_in_a_black_box_sheds_all_its_light() {
    let mut world = World::default();
    world.sphere("ball", Point::ZERO, 2.0).cuboid("wall", Point::splat(-9.0), Point::splat(9.0));
    // Seen from inside: the box is open for light only as walls that absorb.
    let text = "[run]\nrays = 64_000\nfaces = 2
        [[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'ball'\nmedium = 'glass'
        [[medium]]\nname = 'air'\nindex = 1\n[[material]]\npart = 'wall'\nmedium = 'air'\nsurface = 'absorber'
        [[source]]\npower = 3\n";
    let r = world.run(text, |_| ());
    let faces = r.faces.as_ref().unwrap();
    assert_eq!((faces.count, faces.first.len(), faces.first[0].face), (7, 2, 0));
    let ball = of(&r, 0);
    // As many rays in each of the 128 replicates: all of it is no sample, and has no error.
    assert!((ball.left - 3.0).abs() < 1e-9 && ball.left_error < 1e-6 && ball.entered == 0.0, "{ball:?}");
    let wall = faces.first[1];
    assert!((wall.absorbed - 0.5).abs() < 4.0 * wall.absorbed_error, "{wall:?}");
    // Five walls are not listed.
    assert!((wall.absorbed + faces.rest_absorbed - 3.0).abs() < 1e-9 && faces.rest_left == 0.0);
}

/// What faces let through changes no other sum, and is the same in parts as in one run.
#[test]
fn counting_by_face_changes_nothing_and_merges() {
    let world = plate();
    let text = "[run]\nrays = 20_000\nreplicates = 8\nfaces = 6
        [[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'
        [[source]]\nkind = 'lambertian'\nat = [0, 0, -10]\nradius = 5
        [[receiver]]\nname = 'sky'\nkind = 'far_field'\n";
    let whole = world.run(text, |_| ());
    let without = world.run(&text.replace("faces = 6", ""), |_| ());
    assert_eq!(whole.digest, without.digest);
    assert!(without.faces.is_none() && without.tallies.left.is_empty());

    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let mut sum: Option<PartialRun> = None;
    for shard in 0..3 {
        let settings = RunSettings { threads: 2, shard: [shard, 3], ..RunSettings::from(&scene.run) };
        let part = trace(&bound, &world, &settings, None, &Hooks::with_progress(&|_| true)).partial;
        // Through a file, as parts of other machines come.
        let mut bytes = Vec::new();
        part.write(&(), &mut bytes).unwrap();
        let part = PartialRun::read::<()>(&bytes, |_| Ok(()), &bound).unwrap();
        // Without the scene too, as in a process that only adds parts up.
        assert_eq!(PartialRun::read_alone::<()>(&bytes).unwrap().1, part);
        match &mut sum {
            Some(sum) => sum.merge(&part).unwrap(),
            None => sum = Some(part),
        }
    }
    let merged = sum.unwrap().tallies;
    assert_eq!((&merged.entered, &merged.left), (&whole.tallies.entered, &whole.tallies.left));
}

/// Two points on one face name one face: a wall that takes all light takes 1 W of 1 W.
#[test]
fn a_face_that_two_points_name_absorbs_once() {
    let mut world = World::default();
    world.cuboid("wall", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    let text = "[run]\nrays = 1000\n[[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 5
        [[receiver]]\nname = 'wall'\nkind = 'absorbed'\non = { at = [[0, 0, 0], [1, 0, 0]] }\n";
    assert_eq!(world.run(text, |_| ()).receivers[0].power, 1.0);
}

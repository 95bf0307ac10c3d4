//! Solids whose faces are flush: dots on a guide of light, solids of one part that end in one plane, gaps as wide as the glue distance.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};

const FAR: &str = "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\n";

/// Strips 30 µm wide and 8 µm thick under every 100 µm of a guide, lit from inside at 80° over ten of them: 0.3 of the light ends on black
/// ones, none beside them at their walls, and that on mirrors goes on.
#[test]
fn strips_on_a_guide_take_the_light_that_lands_on_them() {
    let mut world = World::default();
    world.cuboid("guide", Point::new(-20.0, -5.0, 0.0), Point::new(40.0, 5.0, 4.0));
    for k in 0..10 {
        let x = -0.5 + 0.1 * f64::from(k);
        world.cuboid(&format!("strip {k}"), Point::new(x, -4.0, -0.008), Point::new(x + 0.03, 4.0, 0.0));
    }
    let [sin, cos] = [80f64.to_radians().sin(), 80f64.to_radians().cos()];
    // The beam is 1 mm wide where it meets the strips, about x = 0, after half a millimetre of height.
    let source = format!(
        "[[source]]\nkind = 'collimated'\nat = [{}, 0, 0.5]\ndirection = [{sin}, 0, {}]\nx = [{cos}, 0, {sin}]\nsize = [{cos}, 1]\n",
        -0.5 * sin / cos,
        -cos
    );
    let run = |surface: &str| {
        let text = format!(
            "[run]\nrays = 10_000\n[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'guide'\nmedium = 'glass'
            [[material]]\npart = 'strip *'\n{surface}\n{source}{FAR}"
        );
        world.run(&text, |_| ())
    };
    let black = run("surface = 'absorber'");
    let sigma = (0.3 * 0.7 / 10_000.0_f64).sqrt();
    assert_eq!(black.lost_rays, 0, "{:?}", black.ledger.first());
    assert!((black.power.absorbed - 0.3).abs() <= 4.0 * sigma, "{:?}", black.power);
    let bright = run("surface = 'mirror'\nreflectance = 1");
    assert_eq!((bright.lost_rays, bright.power.absorbed), (0, 0.0), "{:?}", bright.ledger.first());
}

/// A mirror within the glue distance of a block, turned by 5 mrad against its face: light in the block is reflected by the mirror's normal,
/// to 1 mm aside at a distance of 100.
#[test]
fn light_is_reflected_about_the_normal_of_the_face_that_it_meets() {
    let [sin, cos] = [0.005f64.sin(), 0.005f64.cos()];
    let frame = Frame {
        x: Vector::new(cos, 0.0, sin),
        z: Vector::new(-sin, 0.0, cos),
        ..Frame::translation(Point::new(0.0, 0.0, -6e-4))
    };
    let mut world = World::default();
    world.cuboid("block", Point::new(-3.0, -3.0, 0.0), Point::new(3.0, 3.0, 1.0));
    world.part("mirror", false, &[("front", Shape::Rectangle { frame, half: [0.05, 2.0] })]);
    let text =
        "[run]\nrays = 1000\n[[medium]]\nname = 'clear'\nindex = 1\n[[material]]\npart = 'block'\nmedium = 'clear'
        [[material]]\npart = 'mirror'\nsurface = 'mirror'\nreflectance = 1
        [[source]]\nkind = 'collimated'\nat = [0, 0, 50]\ndirection = [0, 0, -1]\nradius = 0.02
        [[receiver]]\nname = 'aside'\nat = [-1, 0, 100]\nsize = [0.5, 0.5]\n";
    let results = world.run(text, |_| ());
    assert!((results.receivers[0].power - 1.0).abs() < 1e-9, "{:?}", results.power);
}

/// A block and a post that stands through it, both with their bottom in z = 0: two parts, or two solids of one.
fn post_through_block(in_one_part: bool) -> World {
    let mut world = World::default();
    world.cuboid("block", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 5.0));
    world.cuboid("post", Point::new(-1.0, -2.5, 0.0), Point::new(3.0, 1.5, 8.0));
    if in_one_part {
        let second = world.model.parts[1].shells.remove(0);
        world.model.parts[0].shells.push(second);
        world.model.parts.truncate(1);
        world.model.instances.truncate(1);
    }
    world
}

fn through_all(index: f64) -> String {
    format!(
        "[run]\nrays = 6000\nmax_bounces = 200\n[[medium]]\nname = 'clear'\nindex = {index:?}\n[[material]]\npart = '*'\nmedium = 'clear'
        [[source]]\nkind = 'lambertian'\nat = [0.3, 0.2, -20]\ndirection = [0, 0, 1]\nradius = 4
        [[source]]\nkind = 'lambertian'\nat = [0.3, 0.2, 20]\ndirection = [0, 0, -1]\nradius = 4
        [[source]]\nkind = 'point'\nat = [0.3, 0.2, 2.15]\n{FAR}"
    )
}

/// Where nothing refracts all light comes out of solids of one part that end in one plane.
#[test]
fn light_passes_solids_of_one_part_that_end_in_one_plane() {
    let results = post_through_block(true).run(&through_all(1.0), |_| ());
    let power = &results.power;
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
    assert!((power.received - power.emitted).abs() < 1e-9 * power.emitted, "{power:?}");
}

/// Solids of one part that end in one plane are to light what two parts there are.
#[test]
fn solids_of_one_part_that_end_in_one_plane_are_as_two_parts() {
    let [one, two] =
        [true, false].map(|in_one_part| post_through_block(in_one_part).run(&through_all(1.5), |_| ()));
    assert_eq!((one.lost_rays, two.lost_rays), (0, 0), "{:?} {:?}", one.ledger.first(), two.ledger.first());
    let share = |power: f64| power / one.power.emitted;
    let [a, b] = [&one, &two].map(|results| share(results.power.received));
    assert!((a - b).abs() < 0.01, "{a} {b}");
}

/// Two blocks as far apart as the default glue distance, a micrometre: rounding puts their faces nearer or farther, and all rays take them
/// for one interface.
#[test]
fn a_gap_as_wide_as_the_glue_distance_is_closed_for_all_rays() {
    for k in 1..10 {
        let top = 0.7 * f64::from(k);
        let mut world = World::default();
        world.cuboid("low", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, top));
        world.cuboid("high", Point::new(-5.0, -5.0, top + 1e-3), Point::new(5.0, 5.0, 9.0));
        let results = world.run(&through_all(1.0), |_| ());
        let power = &results.power;
        assert_eq!(results.lost_rays, 0, "{top}: {:?}", results.ledger.first());
        assert!((power.received - power.emitted).abs() < 1e-9 * power.emitted, "{top}: {power:?}");
        assert!(!results.notes.iter().any(|note| note.contains("two touching faces")), "{:?}", results.notes);
    }
}

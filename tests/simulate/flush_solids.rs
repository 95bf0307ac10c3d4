//! Solids whose faces are flush: dots on a guide of light, and mirrors that lie nearly in a face.

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

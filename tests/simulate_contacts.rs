//! Sources inside, on and between bodies, and bodies against opaque solids: no light is lost, and what a scene leaves out is
//! found from geometry.

mod simulate_support;

use lampyris::math::Point;
use simulate_support::World;

const MEDIA: &str =
    "[[medium]]\nname = 'glass'\nindex = 1.5\n[[medium]]\nname = 'wet'\nindex = 1.3333333333333333\n";
const FAR: &str = "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\n";

fn nest() -> World {
    let mut world = World::default();
    world.sphere("outer", Point::ZERO, 10.0).sphere("inner", Point::ZERO, 4.0);
    world
}

/// What a source lies in is found, and is what the scene would have said.
#[test]
fn a_source_finds_the_bodies_around_it() {
    for (at, inside) in [("[0, 0, 1]", "['outer', 'inner']"), ("[0, 0, 7]", "'outer'"), ("[0, 0, 20]", "[]")] {
        let text = |inside: &str| {
            format!(
                "[run]\nrays = 5000\nmax_bounces = 200\n{MEDIA}[[material]]\npart = 'outer'\nmedium = 'glass'\n[[material]]\npart = 'inner'\nmedium = 'wet'
                [[source]]\nkind = 'point'\nat = {at}\n{inside}\n{FAR}"
            )
        };
        let (found, said) =
            (nest().run(&text(""), |_| ()), nest().run(&text(&format!("inside = {inside}")), |_| ()));
        assert_eq!((found.lost_rays, &found.digest), (0, &said.digest), "{at}");
    }
}

/// Of a source exactly on a surface, or one that reaches from outside into a body, each ray is asked.
#[test]
fn a_source_on_a_surface_or_across_one_loses_nothing() {
    for source in [
        "kind = 'point'\nat = [0, 0, 10]",
        "kind = 'lambertian'\nat = [0, 0, 10]\nradius = 8",
        "kind = 'collimated'\nat = [9, 0, 0]\ndirection = [0, 0, 1]\nsize = [6, 6]",
        "kind = 'lambertian'\non = { part = 'inner' }",
    ] {
        let text = format!(
            "[run]\nrays = 5000\nmax_bounces = 200\n{MEDIA}[[material]]\npart = 'outer'\nmedium = 'glass'\n[[material]]\npart = 'inner'\nmedium = 'wet'
            [[source]]\n{source}\n{FAR}"
        );
        let r = nest().run(&text, |_| ());
        assert_eq!(r.lost_rays, 0, "{source}: {:?}", r.ledger.first());
    }
}

/// Glass on a black or reflecting block, touching exactly or within the glue distance: light at 60°, beyond the critical angle,
/// meets the block all the same.
#[test]
fn glass_in_contact_with_an_opaque_solid() {
    for gap in [0.0, 5e-4, -5e-4, 1e-13, -1e-13] {
        let mut world = World::default();
        world.cuboid("glass", Point::new(-500.0, -5.0, 0.0), Point::new(500.0, 5.0, 3.0));
        world.cuboid("block", Point::new(-400.0, -5.0, -2.0), Point::new(400.0, 5.0, -gap));
        let text = |surface: &str| {
            format!(
                "[run]\nrays = 500\nmax_bounces = 500\n{MEDIA}[[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'block'\n{surface}
                [[source]]\nkind = 'collimated'\nat = [0, 0, 2]\ndirection = [0.8660254, 0, -0.5]\nradius = 0.5\n{FAR}"
            )
        };
        let black = world.run(&text("surface = 'absorber'"), |_| ());
        assert_eq!((black.power.absorbed, black.lost_rays), (1.0, 0), "gap {gap}");
        let bright = world.run(&text("surface = 'mirror'\nreflectance = 0.9"), |_| ());
        // Total reflection above, 0.9 below: after some 30 turns it leaves by the end beyond the block.
        assert_eq!(bright.lost_rays, 0, "gap {gap}: {:?}", bright.ledger.first());
        assert!(bright.power.absorbed > 0.9, "gap {gap}: {:?}", bright.power);
        let rough = world.run(&text("surface = 'diffuse'\nreflectance = 0.5"), |_| ());
        assert_eq!(rough.lost_rays, 0, "gap {gap}: {:?}", rough.ledger.first());
    }
}

/// A medium that is given to one face is that of the solid behind it.
#[test]
fn a_medium_fills_its_solid() {
    let mut world = World::default();
    world.cuboid("slab", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    let text = |rule: &str| {
        format!(
            "[run]\nrays = 2000\n{MEDIA}[[material]]\n{rule}\nmedium = 'glass'\n[[source]]\nkind = 'point'\nat = [0, 0, -9]\n{FAR}"
        )
    };
    let (whole, face, point) = (
        world.run(&text("part = 'slab'"), |_| ()),
        world.run(&text("face = 'z1'"), |_| ()),
        world.run(&text("at = [1, 2, 3]"), |_| ()),
    );
    assert_eq!(whole.lost_rays, 0);
    assert_eq!((&whole.digest, &whole.digest), (&face.digest, &point.digest));
}

/// A run so long that a word of 64 bits would not hold the quanta of a 128th of it is divided further.
#[test]
fn a_replicate_never_overflows() {
    let world = World::default();
    let text = format!("[run]\nrays = 1e10\n[[source]]\nkind = 'point'\n{FAR}");
    let scene = lampyris::simulate::Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let settings = lampyris::simulate::RunSettings::from(&scene.run);
    let replicates = lampyris::simulate::replicates(&bound, &settings);
    assert!(1e10 / f64::from(replicates) * (1u64 << 40) as f64 * 1.1 < 2f64.powi(63), "{replicates}");
}

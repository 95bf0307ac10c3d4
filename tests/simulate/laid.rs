//! Sources laid exactly on faces, edges and corners of solids: their light starts on the side it goes to, and none is lost.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};
use lampyris::simulate::{LostCause, Scene};
use std::path::Path;

const FAR: &str = "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\n";

/// A black block, as wide as the glass that lies on it.
fn black() -> World {
    let mut world = World::default();
    world.cuboid("die", Point::new(-1e3, -1e3, -1.0), Point::new(1e3, 1e3, 0.0));
    world
}

#[test]
fn light_of_a_disc_on_an_opaque_solid_goes_out() {
    for (source, out) in [
        ("kind = 'lambertian'\nat = [0, 0, 0]\nradius = 0.5", 1.0),
        ("kind = 'lambertian'\nat = [0.1, 0.2, 0]\nsize = [1, 1]", 1.0),
        ("kind = 'point'\nat = [0.1, 0.3, 0]", 0.5),
        ("kind = 'point'\nat = [-1e3, 0.3, 0]", 0.75),
    ] {
        let text = format!(
            "[run]\nrays = 4000\n[[material]]\npart = 'die'\nsurface = 'absorber'\n[[source]]\n{source}\n{FAR}"
        );
        let r = black().run(&text, |_| ());
        assert_eq!(r.lost_rays, 0, "{source}: {:?}", r.ledger.first());
        assert!((r.power.received - out).abs() < 2e-3, "{source}: {:?}", r.power);
    }
}

/// A source in a face of an opaque solid that shines into it alone stands inside, as one a millimetre further in does: none of its light
/// comes out on the outer side, and all of it is reported as lost there. Turned round it shines out; with a medium of index 1 it lights the
/// room.
#[test]
fn light_of_a_source_in_the_wall_of_a_solid_room_is_told_as_inside() {
    let mut world = World::default();
    world.cuboid("room", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 60.0));
    let run = |source: &str, material: &str| {
        let text = format!(
            "[run]\nrays = 2000\n[[material]]\npart = 'room'\nsurface = 'diffuse'\nreflectance = 0.6\n{material}\n[[source]]\n{source}\n{FAR}"
        );
        world.run(&text, |_| ())
    };
    for (kind, z) in [("lambertian", 0.0), ("lambertian", 1e-6), ("lambertian", 1.0), ("collimated", 0.0)] {
        let source =
            |up: f64| format!("kind = '{kind}'\nat = [0, 0, {z}]\ndirection = [0, 0, {up}]\nsize = [50, 50]");
        let inwards = run(&source(1.0), "");
        assert_eq!(inwards.lost_rays, 2000, "{kind} {z}: {:?}", inwards.power);
        assert!(inwards.ledger.iter().all(|l| l.cause == LostCause::InsideSolid), "{kind} {z}");
        if z < 1.0 {
            let outwards = run(&source(-1.0), "");
            assert_eq!((outwards.lost_rays, outwards.power.escaped), (0, 0.0), "{kind} {z}");
            assert!((outwards.power.received - 1.0).abs() < 1e-9, "{kind} {z}: {:?}", outwards.power);
        }
    }
    // Drawn around a hollow: all light stays in the room, whose walls take it.
    let hollow = run(
        "kind = 'lambertian'\nat = [0, 0, 0]\nsize = [50, 50]",
        "medium = 'hollow'\n[[medium]]\nname = 'hollow'\nindex = 1",
    );
    assert_eq!((hollow.lost_rays, hollow.power.received), (0, 0.0), "{:?}", hollow.power);
    // Of the light of a point half goes out, and the wall takes of the other half what it does not send out too.
    let point = run("kind = 'point'\nat = [0.1, 0.3, 0]", "");
    assert_eq!(point.lost_rays, 0, "{:?}", point.ledger.first());
    assert!((point.power.received - 0.8).abs() < 2e-3, "{:?}", point.power);
}

/// Glass glued on a black die that shines: its light starts in the glass. Of diffuse light inside, Walsh's 0.596346 is reflected at
/// the far face and ends on the die.
#[test]
fn a_die_shines_into_what_is_glued_on_it() {
    for (source, gap) in [
        ("kind = 'lambertian'\nat = [0, 0, 0]\nradius = 0.5", 0.0),
        ("kind = 'lambertian'\non = { part = 'die', face = 'z1' }", 0.0),
        ("kind = 'lambertian'\non = { part = 'die', face = 'z1' }", 5e-4),
        ("kind = 'lambertian'\non = { part = 'die', face = 'z1' }", -5e-4),
    ] {
        let mut world = black();
        world.cuboid("glass", Point::new(-1e3, -1e3, gap), Point::new(1e3, 1e3, 1.0));
        let text = format!(
            "[run]\nrays = 10000\n[[medium]]\nname = 'glass'\nindex = 1.5
            [[material]]\npart = 'die'\nsurface = 'absorber'\n[[material]]\npart = 'glass'\nmedium = 'glass'
            [[source]]\n{source}\n{FAR}"
        );
        let r = world.run(&text, |_| ());
        assert_eq!(r.lost_rays, 0, "{source} {gap}: {:?}", r.ledger.first());
        // 1σ of random rays is 0.005; near the rim of the slab, some 1e-3 of it, light leaves by the sides.
        assert!((r.power.absorbed - 0.596346).abs() < 0.012, "{source} {gap}: {:?}", r.power);
    }
}

/// From the middle of a face half of an isotropic source goes out at once, and of what goes in, as from anywhere in the block,
/// `3 cos θc − 2` is caught; from an edge a quarter goes in, from a corner an eighth.
#[test]
fn a_point_on_a_clear_block_shines_in_and_out() {
    let caught = 3.0 * (1.0 - 1.0 / 2.25f64).sqrt() - 2.0;
    for (at, inside) in [("[5, 5, 10]", 0.5), ("[4, 6, 0]", 0.5), ("[0, 0, 5]", 0.25), ("[10, 10, 10]", 0.125)] {
        let mut world = World::default();
        world.cuboid("block", Point::ZERO, Point::splat(10.0));
        let text = format!(
            "[run]\nrays = 2000\n[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'block'\nmedium = 'glass'
            [[source]]\nkind = 'point'\nat = {at}\n{FAR}"
        );
        let r = world.run(&text, |_| ());
        assert_eq!(r.lost_rays, 0, "{at}: {:?}", r.ledger.first());
        assert!((r.power.cut_off - inside * caught).abs() < 0.015, "{at}: {:?}", r.power);
    }
}

/// A kilometre from the origin the plane of a receiver is rounded by 1e-10 mm, and a grazing ray meets it a hundred times as far off
/// the face that it lies in.
#[test]
fn a_receiver_in_a_black_face_far_away_counts_all_light() {
    for k in 0..12 {
        let centre = Point::new(1e6, -0.7e6, 0.9e6) + Vector::splat(0.37 * f64::from(k));
        let frame = Frame::from_axis(centre, Vector::new(0.3, 0.5, 0.8), None);
        let mut world = World::default();
        world.part("plate", false, &[("top", Shape::Rectangle { frame, half: [100.0, 100.0] })]);
        let beside = centre + frame.x * (3.1 + f64::from(k)) - frame.y * 7.3;
        let list = |v: Vector| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let down = frame.x - frame.z * 0.01;
        let text = format!(
            "[run]\nrays = 200\n[[material]]\npart = 'plate'\nsurface = 'absorber'
            [[source]]\nkind = 'collimated'\nat = {}\ndirection = {}\nradius = 0.05
            [[receiver]]\nname = 'on the plate'\nat = {}\nnormal = {}\nsize = [60, 60]\n",
            list(centre - down * 50.0),
            list(down),
            list(beside),
            list(frame.z),
        );
        let r = world.run(&text, |_| ());
        assert!((r.power.received - 1.0).abs() < 1e-9, "{k}: {:?}", r.power);
    }
}

/// Faces without a `kind` shine evenly in every direction, which few mean; where the kind is written it is meant.
#[test]
fn faces_that_shine_as_points_do_are_told_of() {
    let mut world = World::default();
    world.cuboid("chip", Point::new(-1.0, -1.0, 0.0), Point::new(1.0, 1.0, 1.0));
    for (kind, is_told) in [("", true), ("kind = 'point'", false), ("kind = 'lambertian'", false)] {
        let text = format!("[run]\nrays = 100\n[[source]]\n{kind}\non = {{ part = 'chip', face = 'z1' }}\n{FAR}");
        let notes = world.run(&text, |_| ()).notes;
        assert_eq!(notes.iter().any(|n| n.contains("the same intensity in every direction")), is_told, "{notes:?}");
    }
    // Of many the others are counted, by what they do.
    let source = "[[source]]\non = { part = 'chip', face = 'z1' }\n";
    let notes = world.run(&format!("[run]\nrays = 100\n{}{FAR}", source.repeat(11)), |_| ()).notes;
    assert_eq!(
        notes.iter().filter(|n| n.contains("the same intensity in every direction")).count(),
        8,
        "{notes:?}"
    );
    assert!(notes.iter().any(|n| n.starts_with("3 more sources shine evenly")), "{notes:?}");
}

/// A chip of 2 × 2 × 1 mm lying on a wide black board with all its faces named: the one it lies on does not shine. Of the power a third
/// leaves by the top, none of which meets the board, and two thirds by the sides, half of which does.
#[test]
fn a_chip_on_its_board_shines_from_what_is_free() {
    let run = |world: &World, source: &str| {
        let text = format!(
            "[run]\nrays = 30000\n[[material]]\npart = '*'\nsurface = 'absorber'\n[[source]]\nkind = 'lambertian'\n\
             power = 6\non = {source}\n{FAR}"
        );
        world.run(&text, |_| ())
    };
    for gap in [0.0, 5e-4] {
        let mut world = black();
        world.cuboid("chip", Point::new(-1.0, -1.0, gap), Point::new(1.0, 1.0, 1.0));
        let r = run(&world, "{ part = 'chip' }");
        assert_eq!(r.lost_rays, 0, "{gap}: {:?}", r.ledger.first());
        // The chip's own faces see none of the light. The board ends at 1 m, 1e-3 of its form factor.
        assert!((r.power.absorbed - 2.0).abs() < 0.05, "{gap}: {:?}", r.power);
        let note = r.notes.iter().find(|n| n.contains("does not shine")).expect("a note");
        assert!(note.contains("25.0 % of the area") && note.contains("face 'z0' of 'chip'"), "{note}");
    }

    // A black block stands on a quarter of the top: half as wide as the chip, and as high as nothing.
    let mut world = black();
    world.cuboid("chip", Point::new(-1.0, -1.0, 0.0), Point::new(1.0, 1.0, 1.0));
    world.cuboid("cap", Point::new(0.0, 0.0, 1.0), Point::new(2.0, 2.0, 1.0 + 1e-6));
    let r = run(&world, "{ part = 'chip', face = 'z1' }");
    assert_eq!(r.power.absorbed, 0.0, "{:?}", r.power);
    assert!(r.notes.iter().any(|n| n.contains("25.0 % of the area")), "{:?}", r.notes);
}

/// Nothing gets out of faces that are covered throughout: the scene is refused, naming them.
#[test]
fn faces_that_are_covered_throughout_are_refused() {
    let mut world = black();
    world.cuboid("chip", Point::new(-1.0, -1.0, 0.0), Point::new(1.0, 1.0, 1.0));
    let text = format!("[[source]]\nkind = 'lambertian'\non = {{ part = 'chip', face = 'z0' }}\n{FAR}");
    let error = Scene::parse(&text, "test.toml", Path::new(".")).unwrap().bind(&world.model).unwrap_err();
    assert!(error.to_string().contains("lie against all of these faces"), "{error}");
    // Light goes on in what lets it in.
    let clear = text + "[[material]]\npart = 'die'\nmedium = 'N-BK7'\n";
    Scene::parse(&clear, "test.toml", Path::new(".")).unwrap().bind(&world.model).unwrap();
}

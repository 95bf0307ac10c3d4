//! Sources inside, on and between bodies, and bodies against opaque solids: no light is lost, and what a scene leaves out is
//! found from geometry.

use crate::support::World;
use lampyris::math::Point;

const MEDIA: &str =
    "[[medium]]\nname = 'glass'\nindex = 1.5\n[[medium]]\nname = 'wet'\nindex = 1.3333333333333333\n";
const GREY: &str = "[[medium]]\nname = 'grey'\nindex = 1.5\nabsorption_per_mm = 0.03\n";
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

/// A box of glass without its lid does not lie around a source above it, though light comes in by the opening and leaves by the floor; nor
/// around one beside it. Each ray of a source in its box is probed, and the answer says so.
#[test]
fn a_source_beside_an_open_body_is_not_in_it() {
    let mut world = World::default();
    world.cuboid("tub", Point::new(-2.0, -2.0, -1.0), Point::new(2.0, 2.0, 1.0));
    world.shapes.pop();
    let tub = &mut world.model.parts[0].shells[0];
    tub.closed = false;
    tub.faces.pop();
    for (source, asked) in [
        ("kind = 'cone'\nhalf_angle_deg = 40\nat = [0, 0, 5]\ndirection = [0, 0, -1]", false),
        ("kind = 'point'\nat = [3, 1, 0.5]", false),
        ("kind = 'point'\nat = [0.5, 1, 0.5]", true),
    ] {
        let text = |inside: &str| {
            format!(
                "[run]\nrays = 5000\n{MEDIA}[[material]]\npart = 'tub'\nmedium = 'glass'\n[[source]]\n{source}\n{inside}\n{FAR}"
            )
        };
        let [found, said] = ["", "inside = []"].map(|inside| world.run(&text(inside), |_| ()));
        assert_eq!(found.digest == said.digest, !asked, "{source}");
        let told = |notes: &[String]| notes.iter().any(|n| n.contains("each ray is probed"));
        assert_eq!((told(&found.notes), told(&said.notes)), (asked, false), "{source}: {:?}", found.notes);
    }
}

/// Each ray of a source exactly on a surface, or of one that reaches from outside into a body, is probed.
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

/// Light that is totally reflected at the wall of a glass, nearer than the glue distance to its edge on a black board: all of it ends
/// there.
#[test]
fn light_reflected_just_above_an_edge_meets_the_board() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    world.cuboid("board", Point::new(-9.0, -9.0, -1.0), Point::new(9.0, 9.0, 0.0));
    // Along (−0.36, 0, −0.933) it comes to the wall x = −5 between 0.1 and 0.5 µm above the board, at 69°.
    let text = format!(
        "[run]\nrays = 2000\n{MEDIA}[[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'board'\nsurface = 'absorber'
        [[source]]\nkind = 'collimated'\nat = [-4.28, 0, 1.8663]\ndirection = [-0.36, 0, -0.933]\nradius = 7e-5\n{FAR}"
    );
    let r = world.run(&text, |_| ());
    assert_eq!((r.lost_rays, r.power.absorbed), (0, 1.0), "{:?}", r.ledger.first());
}

/// A coating that lets half of the light into a black block without a medium: half is lost, and the note says by what.
#[test]
fn light_let_into_a_solid_without_a_medium_is_told() {
    let mut world = World::default();
    world.cuboid("slab", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 1.0));
    let half = "[[0, 400, 0.1, 0.1, 0.5, 0.5], [0, 700, 0.1, 0.1, 0.5, 0.5], [90, 400, 0.1, 0.1, 0.5, 0.5], [90, 700, 0.1, 0.1, 0.5, 0.5]]";
    let text = format!(
        "[run]\nrays = 20_000\n[[material]]\npart = 'slab'\nsurface = 'absorber'\n[[material]]\nat = [0, 0, 0]\nsurface = 'coating'\ncoating = {half}
        [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\nradius = 1\n{FAR}"
    );
    let r = world.run(&text, |_| ());
    assert!((r.power.lost - 0.5).abs() < 0.02, "{:?}", r.power);
    assert!(r.notes.iter().any(|note| note.contains("what is behind has no medium")), "{:?}", r.notes);
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

/// A black bar that covers only a strip along the rim of a glass, 0.2 mm of 6 or less: of a beam twice as wide, up to the rim, the bar
/// takes the half, and all of one as wide as the strip; no light is lost.
#[test]
fn glass_that_an_opaque_solid_touches_along_a_narrow_strip() {
    for (strip, z) in [(0.2, 2.25), (0.02, 2.25), (0.2, 2.2495)] {
        let mut world = World::default();
        world.cuboid("glass", Point::new(-3.0, -3.0, 0.0), Point::new(3.0, 3.0, 2.25));
        world.cuboid("bar", Point::new(3.0 - strip, -5.0, z), Point::new(5.0, 5.0, 3.25));
        let text = |width: f64| {
            format!(
                "[run]\nrays = 10_000\n{MEDIA}[[material]]\npart = 'glass'\nmedium = 'glass'
                [[source]]\nkind = 'collimated'\nat = [{}, 0, 1]\nsize = [{width}, {width}]\n{FAR}",
                3.0 - 0.5 * width
            )
        };
        // What does not meet the bar goes up and down at right angles to both faces of the glass, beside the bar.
        for share in [0.5, 1.0] {
            let r = world.run(&text(strip / share), |_| ());
            assert_eq!(r.lost_rays, 0, "strip {strip}, z {z}: {:?}", r.ledger.first());
            let sigma = (share * (1.0 - share) / 10_000.0_f64).sqrt();
            assert!((r.power.absorbed - share).abs() <= 4.0 * sigma, "strip {strip}, z {z}: {:?}", r.power);
        }
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

/// Two slabs of one glass, glued, two parts or two solids of one, the coating given to the face of either or of both: it is met once,
/// whichever face rounding puts first. Light to and fro between three partly reflecting planes adds up as power.
#[test]
fn a_coating_between_glued_bodies_is_met_once_whosever_face_it_is_on() {
    for in_one_part in [false, true] {
        coat_between(in_one_part);
    }
}

fn coat_between(in_one_part: bool) {
    let along_z = |from: f64, to: f64| [Point::new(-50.0, -50.0, from), Point::new(50.0, 50.0, to)];
    for (surface, r, t) in [
        ("surface = 'coating'\nreflectance = 0.3\ntransmittance = 0.6", 0.3, 0.6),
        ("surface = 'mirror'\nreflectance = 0.9", 0.9, 0.0),
        ("surface = 'absorber'", 0.0, 0.0),
    ] {
        let (front, through) = (0.04, 0.96);
        let echo = 1.0 - front * r;
        let behind = r + t * t * front / echo;
        let to = through * t / echo;
        let expected = [to * through / (1.0 - behind * front), {
            let before = front + through * through * r / echo;
            before + to * to * front / (1.0 - behind * front)
        }];
        for on in [&["low"][..], &["high"], &["low", "high"]] {
            for (gap, z, direction) in
                [(0.0, -10.0, 1.0), (0.0, 20.0, -1.0), (2e-4, -10.0, 1.0), (-2e-4, 20.0, -1.0)]
            {
                let mut world = World::default();
                let ([a, b], [c, d]) = (along_z(0.0, 3.3), along_z(3.3 + gap, 7.7));
                world.cuboid("low", a, b).cuboid("high", c, d);
                if in_one_part {
                    let second = world.model.parts[1].shells.remove(0);
                    world.model.parts[0].shells.push(second);
                    world.model.parts.truncate(1);
                    world.model.instances.truncate(1);
                }
                let mut text = format!("[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\n{MEDIA}");
                for (solid, (part, face)) in [("low", "z1"), ("high", "z0")].into_iter().enumerate() {
                    let body = if in_one_part { format!("solid = {solid}") } else { format!("part = '{part}'") };
                    if !in_one_part || solid == 0 {
                        text += &format!("[[material]]\npart = '{part}'\nmedium = 'glass'\n");
                    }
                    if on.contains(&part) {
                        text += &format!("[[material]]\non = {{ {body}, face = '{face}' }}\n{surface}\n");
                    }
                }
                text += &format!(
                    "[[source]]\nkind = 'collimated'\nat = [0, 0, {z:?}]\ndirection = [0.02, 0.01, {direction:?}]\nradius = 5\n"
                );
                for (name, at) in [("above", 30.0), ("below", -30.0)] {
                    text += &format!("[[receiver]]\nname = '{name}'\nat = [0, 0, {at:?}]\nsize = [90, 90]\n");
                }
                let results = world.run(&text, |_| ());
                let [above, below] = [0, 1].map(|k| results.receivers[k].power);
                let found = if direction > 0.0 { [above, below] } else { [below, above] };
                // Fresnel at 1.3° differs from 0.04 by less than 1e-5; light below the power floor of 1e-6 is cut off.
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < 3e-5,
                        "{surface} on {on:?}, one part {in_one_part}, {gap} {direction}: {found} {expected}"
                    );
                }
                assert_eq!(results.lost_rays, 0);
            }
        }
    }
}

/// A mirror on one of two glued slabs, black on the other: the face that the light is leaving says what happens.
#[test]
fn of_two_coatings_between_glued_bodies_that_counts_which_the_light_leaves() {
    let slab = |from: f64, to: f64| [Point::new(-50.0, -50.0, from), Point::new(50.0, 50.0, to)];
    let (front, through) = (0.04, 0.96);
    let mirrored = front + through * through * 0.9 / (1.0 - front * 0.9);
    for (gap, z, direction, expected) in [
        (0.0, -10.0, 1.0, mirrored),
        (2e-4, -10.0, 1.0, mirrored),
        (0.0, 20.0, -1.0, front),
        (2e-4, 20.0, -1.0, front),
    ] {
        let mut world = World::default();
        let ([a, b], [c, d]) = (slab(0.0, 3.3), slab(3.3 + gap, 7.7));
        world.cuboid("low", a, b).cuboid("high", c, d);
        let text = format!(
            "[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\n{MEDIA}
            [[material]]\npart = 'low'\nmedium = 'glass'\n[[material]]\npart = 'high'\nmedium = 'glass'
            [[material]]\npart = 'low'\nface = 'z1'\nsurface = 'mirror'\nreflectance = 0.9
            [[material]]\npart = 'high'\nface = 'z0'\nsurface = 'absorber'
            [[source]]\nkind = 'collimated'\nat = [0, 0, {z:?}]\ndirection = [0.02, 0.01, {direction:?}]\nradius = 5
            [[receiver]]\nname = 'above'\nat = [0, 0, 30]\nsize = [90, 90]
            [[receiver]]\nname = 'below'\nat = [0, 0, -30]\nsize = [90, 90]\n"
        );
        let results = world.run(&text, |_| ());
        let [above, below] = [0, 1].map(|k| results.receivers[k].power);
        let [back, on] = if direction > 0.0 { [below, above] } else { [above, below] };
        assert!((back - expected).abs() < 3e-5 && on == 0.0, "{gap} {direction}: {back} back, {on} on");
    }
}

/// Eight glued blocks are one block, also for light that passes within the glue distance of the edges where four of them meet.
#[test]
fn light_along_the_edges_of_glued_blocks_is_not_lost() {
    let mut results = Vec::new();
    for parts in [1, 2] {
        let mut world = World::default();
        let mut text = format!("[run]\nrays = 4000\ninterfaces = 'split'\nsplit_floor = 0\n{MEDIA}");
        let size = 20.0 / f64::from(parts);
        for k in 0..parts * parts * parts {
            let at =
                Point::new(f64::from(k % parts), f64::from(k / parts % parts), f64::from(k / parts / parts)) * size;
            world.cuboid(&format!("block {k}"), at, at + Point::splat(size));
            text += &format!("[[material]]\npart = 'block {k}'\nmedium = 'glass'\n");
        }
        // Near the edge from (10, 10, 0) to (10, 10, 20): straight along it, and slanted through it at (10, 10, 10).
        for (at, direction) in
            [("[10, 10, -5]", "[0, 0, 1]"), ("[8.5, 9.4, -5]", "[0.1, 0.04, 1]"), ("[-5, 10, 10]", "[1, 0, 0]")]
        {
            text += &format!(
                "[[source]]\nkind = 'collimated'\nat = {at}\ndirection = {direction}\nsize = [0.006, 0.006]\n"
            );
        }
        text += FAR;
        results.push(world.run(&text, |_| ()));
    }
    let [whole, glued] = &results[..] else { panic!() };
    assert_eq!((whole.lost_rays, glued.lost_rays), (0, 0), "{:?}", glued.ledger.first());
    assert!((whole.power.escaped + whole.power.received - glued.power.escaped - glued.power.received).abs() < 1e-4);
}

/// Twenty-seven glued blocks are one block, for light that slips past an edge of four and goes on through further blocks.
#[test]
fn light_that_slips_past_an_edge_goes_on_through_further_blocks() {
    let mut results = Vec::new();
    for parts in [1, 3] {
        let mut world = World::default();
        let mut text = format!("[run]\nrays = 3000\npower_floor = 1e-3\n{GREY}");
        let size = 21.0 / f64::from(parts);
        for k in 0..parts * parts * parts {
            let at =
                Point::new(f64::from(k % parts), f64::from(k / parts % parts), f64::from(k / parts / parts)) * size;
            world.cuboid(&format!("block {k}"), at, at + Point::splat(size));
            text += &format!("[[material]]\npart = 'block {k}'\nmedium = 'grey'\n");
        }
        // Towards (7, 7, 10), (7, 9, 7) and (8, 7, 7), on edges where four of the 27 meet, from 4 mm before.
        for (edge, direction) in [
            ([7.0, 7.0, 10.0], [1.0, 0.6, 0.3]),
            ([7.0, 9.0, 7.0], [0.4, 0.2, 1.1]),
            ([8.0, 7.0, 7.0], [0.3, -1.0, 0.8]),
            ([7.0, 7.0, 10.0], [0.3, -0.02, 1.0]),
        ] {
            let (edge, direction) = (Point::from_array(edge), Point::from_array(direction));
            let at = edge - 4.0 * direction;
            text += &format!(
                "[[source]]\nkind = 'collimated'\nat = {:?}\ndirection = {:?}\nsize = [0.005, 0.005]\n",
                at.to_array(),
                direction.to_array()
            );
        }
        text += FAR;
        results.push(world.run(&text, |_| ()));
    }
    let [whole, glued] = &results[..] else { panic!() };
    assert_eq!((whole.lost_rays, glued.lost_rays), (0, 0), "{:?}", glued.ledger.first());
    let [a, b] = [whole, glued].map(|r| r.power.absorbed);
    assert!((a - b).abs() < 0.02 * a, "{a} {b}");
}

/// Solids of one part that touch or overlap are one block of glass, as are solids of several parts.
#[test]
fn solids_of_one_part_that_touch_or_overlap_are_one_block() {
    let mut results = Vec::new();
    for blocks in
        [&[(0.0, 15.0)][..], &[(0.0, 6.0), (6.0, 15.0)], &[(6.1, 15.0), (0.0, 6.1)], &[(0.0, 9.0), (4.0, 15.0)]]
    {
        let mut world = World::default();
        for (k, &(from, to)) in blocks.iter().enumerate() {
            // The inner block is narrower, so that no sides share a plane.
            let side = 10.0 - k as f64;
            world.cuboid("glass", Point::new(-side, -side, from), Point::new(side, side, to));
        }
        // All in one part, shell by shell.
        let shells: Vec<_> = world.model.parts.iter_mut().flat_map(|p| std::mem::take(&mut p.shells)).collect();
        world.model.parts.truncate(1);
        world.model.instances.truncate(1);
        world.model.parts[0].shells = shells;
        let text = format!(
            "[run]\nrays = 20000\n{MEDIA}[[material]]\npart = 'glass'\nmedium = 'glass'
            [[source]]\nkind = 'cone'\nhalf_angle_deg = 20\nat = [1, 2, -12]
            [[source]]\nkind = 'cone'\nhalf_angle_deg = 20\nat = [1, 2, 30]\ndirection = [0, 0, -1]
            [[source]]\nkind = 'cone'\nhalf_angle_deg = 20\nat = [0.5, 0.2, 5]\n{FAR}"
        );
        results.push(world.run(&text, |_| ()));
    }
    let [whole, others @ ..] = &results[..] else { panic!() };
    for other in others {
        assert_eq!(other.lost_rays, 0, "{:?}", other.ledger.first());
        let [a, b] = [whole, other].map(|r| r.receivers[0].power);
        assert!((a - b).abs() < 0.01, "{a} {b}");
    }
}

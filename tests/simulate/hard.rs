//! Scenes that are hard on geometry rather than on light: touching layers, tiny and huge units, grazing light, receivers inside parts.

use crate::support::{Shape, World};
use lampyris::intersect::exact::{self, Exact};
use lampyris::math::{Frame, Point, Vector};
use lampyris::simulate::{Results, RunSettings, Scene, simulate};
use std::path::Path;

const LAYERS: [f64; 3] = [1.5, 1.7, 1.33];

/// Three slabs, each 3 mm thick and touching the next, in mm times `scale`, lit along their normal.
fn layers(scale: f64, glue: f64) -> Results {
    let mut world = World::default();
    let mut text = format!("[run]\nrays = 2000\ninterfaces = 'split'\nsplit_floor = 0\nglue_mm = {glue:e}\n");
    for (k, index) in LAYERS.iter().enumerate() {
        let (name, z) = (format!("layer {k}"), 3.0 * k as f64 * scale);
        let side = 50.0 * scale;
        world.cuboid(&name, Point::new(-side, -side, z), Point::new(side, side, 3.0 * (k + 1) as f64 * scale));
        text += &format!(
            "[[medium]]\nname = 'm{k}'\nindex = {index:?}\n[[material]]\npart = '{name}'\nmedium = 'm{k}'\n"
        );
    }
    text +=
        &format!("[[source]]\nkind = 'collimated'\nat = [0, 0, {:?}]\nradius = {:?}\n", -10.0 * scale, 5.0 * scale);
    for (name, z) in [("behind", 20.0), ("before", -20.0)] {
        let (z, size) = (z * scale, 20.0 * scale);
        text += &format!("[[receiver]]\nname = '{name}'\nat = [0, 0, {z:?}]\nsize = [{size:?}, {size:?}]\n");
    }
    world.run(&text, |_| ())
}

/// Light to and fro between layers adds up as power: `T = T₁T₂/(1 − R₁R₂)`, `R = R₁ + T₁²R₂/(1 − R₁R₂)`.
fn of_stack(indices: &[f64]) -> [f64; 2] {
    let (mut t, mut r_front, mut r_back) = (1.0, 0.0, 0.0);
    for pair in indices.windows(2) {
        let r: f64 = ((pair[0] - pair[1]) / (pair[0] + pair[1])).powi(2);
        let echo = 1.0 - r_back * r;
        (r_front, r_back) = (r_front + t * t * r / echo, r + (1.0 - r).powi(2) * r_back / echo);
        t = t * (1.0 - r) / echo;
    }
    [t, r_front]
}

#[test]
fn touching_layers_from_microns_to_kilometres() {
    let [t, r] = of_stack(&[1.0, LAYERS[0], LAYERS[1], LAYERS[2], 1.0]);
    assert!((t + r - 1.0).abs() < 1e-14);
    for (scale, glue) in [(1.0, 1e-3), (1e-3, 1e-6), (1e6, 1e-3), (1e6, 1.0)] {
        let results = layers(scale, glue);
        let [behind, before] = &results.receivers[..] else { panic!() };
        // Below the power floor of 1e-6 light is cut off.
        assert!(
            (behind.power - t).abs() < 1e-5 && (before.power - r).abs() < 1e-5,
            "{scale}: {} {}",
            behind.power,
            t
        );
        assert!(results.lost_rays == 0 && results.power.cut_off < 1e-5, "{scale}: {:?}", results.ledger.first());
    }
}

/// What passes the middle of a slab, either way, is all that fell on it: `(1 − R)(1 + R)/(1 − R²) = 1` at any index.
#[test]
fn a_receiver_inside_a_slab_sees_light_pass_to_and_fro() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    for index in [1.2, 1.5, 2.5] {
        let text = format!(
            "[run]\nrays = 2000\ninterfaces = 'split'\nsplit_floor = 0
            [[medium]]\nname = 'glass'\nindex = {index}\n[[material]]\npart = 'glass'\nmedium = 'glass'
            [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 5
            [[receiver]]\nname = 'middle'\nat = [0, 0, 1.5]\nsize = [20, 20]\nabsorbs = false"
        );
        let results = world.run(&text, |_| ());
        assert!((results.receivers[0].power - 1.0).abs() < 1e-5, "{index}: {}", results.receivers[0].power);
    }
}

/// At 89.9° a plate of 0.01 mm reflects nearly all; to and fro between two faces of reflectance R it lets `(1 − R)/(1 + R)` through.
#[test]
fn grazing_light_on_a_thin_plate() {
    let (n, angle) = (1.5f64, 89.9f64.to_radians());
    let (cos_i, cos_t) = (angle.cos(), (1.0 - (angle.sin() / n).powi(2)).sqrt());
    let s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    let r = 0.5 * (s * s + p * p);
    let mut world = World::default();
    world.cuboid("glass", Point::new(-500.0, -500.0, 0.0), Point::new(500.0, 500.0, 0.01));
    let text = format!(
        "[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 1e-9
        [[medium]]\nname = 'glass'\nindex = {n}\n[[material]]\npart = 'glass'\nmedium = 'glass'
        [[source]]\nkind = 'collimated'\nat = [{:?}, 0, {:?}]\ndirection = [{:?}, 0, {:?}]\nradius = 0.01
        [[receiver]]\nname = 'behind'\nat = [0, 0, 1]\nsize = [4000, 4000]",
        -angle.tan() * 0.5,
        -0.5,
        angle.sin(),
        angle.cos()
    );
    let results = world.run(&text, |_| ());
    let through = (1.0 - r) / (1.0 + r);
    assert!((results.receivers[0].power - through).abs() < 1e-6, "{} {through}", results.receivers[0].power);
    assert_eq!(results.lost_rays, 0);
}

/// From inside, 10⁻⁹ degrees below the critical angle, `1 − (Rs + Rp)/2` gets out; as much above it nothing does.
#[test]
fn light_at_the_critical_angle() {
    let (n, critical) = (1.5f64, (1.0f64 / 1.5).asin());
    for side in [-1.0, 1.0] {
        let less = side * 1e-9f64.to_radians();
        // 1 − n² sin²(critical − less), without cancellation.
        let below = 2.0 * (0.5 * less).sin().powi(2) + n * critical.cos() * less.sin();
        let (cos_t, cos_i) = ((below * (2.0 - below)).max(0.0).sqrt(), (critical - less).cos());
        let s = (n * cos_i - cos_t) / (n * cos_i + cos_t);
        let p = (cos_i - n * cos_t) / (cos_i + n * cos_t);
        let out = 1.0 - 0.5 * (s * s + p * p);
        let mut world = World::default();
        world.cuboid("glass", Point::new(-500.0, -500.0, 0.0), Point::new(500.0, 500.0, 10.0));
        // Light that is reflected at the top is cut off at the bottom.
        let text = format!(
            "[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 0\nmax_bounces = 2
            [[medium]]\nname = 'glass'\nindex = {n}\n[[material]]\npart = 'glass'\nmedium = 'glass'
            [[source]]\nkind = 'collimated'\nat = [0, 0, 5]\ndirection = [{:?}, 0, {cos_i:?}]\nradius = 0.1\ninside = 'glass'",
            (critical - less).sin()
        );
        let results = world.run(&text, |_| ());
        let power = &results.power;
        assert!((power.escaped - out).abs() < 1e-9, "{side}: {} {out}", power.escaped);
        assert!((power.escaped > 0.0) == (side > 0.0) && results.lost_rays == 0, "{side}: {power:?}");
    }
}

/// On the spline light that is reflected less than the glue distance from the edge of two glued blocks goes on into the other block, and
/// out of it at its far side.
#[test]
fn light_reflected_beside_a_glued_edge_is_not_lost() {
    let mut world = World::default();
    world.cuboid("left", Point::new(-10.0, -10.0, 0.0), Point::new(0.0, 10.0, 20.0));
    world.cuboid("right", Point::new(0.0, -10.0, 0.0), Point::new(10.0, 10.0, 20.0));
    let exact = Exact::build(&world.model, &exact::Settings::default());
    let (d, far) = (Vector::new(0.49, 0.57, -0.66).normalize(), 3.0);
    let at = Point::new(-5e-4, 0.0, 0.0) - d * far;
    let text = format!(
        "[run]\nrays = 4000\nmax_bounces = 200
        [[medium]]\nname = 'a'\nindex = 1.5\n[[material]]\npart = 'left'\nmedium = 'a'
        [[medium]]\nname = 'b'\nindex = 1.7\n[[material]]\npart = 'right'\nmedium = 'b'
        [[source]]\nkind = 'collimated'\nat = [{:?}, {:?}, {:?}]\ndirection = [{:?}, {:?}, {:?}]\nradius = 4e-4\ninside = 'left'",
        at.x, at.y, at.z, d.x, d.y, d.z
    );
    let scene = Scene::parse(&text, "edge.toml", std::path::Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let results = simulate(&bound, &exact, &RunSettings::from(&scene.run), &|_| true);
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
    assert!(results.power.imbalance() < 1e-12, "{:?}", results.power);
}

/// A film that is not thicker than the glue is named; it loses nothing, and transmits what it must, where the glue is thinner.
#[test]
fn a_film_thinner_than_the_glue_is_named() {
    for (glue, named) in [(1e-3, true), (1e-5, false)] {
        let mut world = World::default();
        world.cuboid("film", Point::new(-50.0, -50.0, -1e-3), Point::new(50.0, 50.0, 0.0));
        world.cuboid("glass", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
        let text = format!(
            "[run]\nrays = 2000\ninterfaces = 'split'\nsplit_floor = 0\nglue_mm = {glue:e}
            [[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'
            [[medium]]\nname = 'coat'\nindex = 1.7\n[[material]]\npart = 'film'\nmedium = 'coat'
            [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 5
            [[receiver]]\nname = 'behind'\nat = [0, 0, 20]\nsize = [20, 20]"
        );
        let results = world.run(&text, |_| ());
        let said = results.notes.iter().any(|n| n.contains("'film'") && n.contains("glue_mm"));
        assert_eq!(said, named, "{:?}", results.notes);
        if !named {
            let [t, _] = of_stack(&[1.0, 1.7, 1.5, 1.0]);
            assert!((results.receivers[0].power - t).abs() < 1e-5, "{} {t}", results.receivers[0].power);
            assert_eq!(results.lost_rays, 0);
        }
    }
}

/// Receivers in the faces of a tilted plate far from the origin: one that ends light is met before its face, one that lets it pass
/// counts what comes to its face once, wherever rounding puts the two.
#[test]
fn receivers_that_lie_in_faces_are_met_once() {
    let (n, sin_i) = (1.5, 0.3 / 1.09f64.sqrt());
    let (cos_i, cos_t) = ((1.0 - sin_i * sin_i).sqrt(), (1.0 - (sin_i / n).powi(2)).sqrt());
    let rs = ((cos_i - n * cos_t) / (cos_i + n * cos_t)).powi(2);
    let rp = ((cos_t - n * cos_i) / (cos_t + n * cos_i)).powi(2);
    let r = 0.5 * (rs + rp);
    for (z, at) in [([0.3, -0.4, 0.7], [211.0, -97.0, 33.0]), ([-0.9, 0.1, 0.2], [-5e4, 12.0, 7e3])] {
        let z = Vector::from_array(z).normalize();
        let x = z.cross(Vector::X).normalize();
        let y = z.cross(x);
        let place = |p: [f64; 3]| Point::from_array(at) + x * p[0] + y * p[1] + z * p[2];
        let way = |d: [f64; 3]| (x * d[0] + y * d[1] + z * d[2]).to_array();
        let side = |p: [f64; 3], frame: [Vector; 3], half: [f64; 2]| {
            let [x, y, z] = frame;
            Shape::Rectangle { frame: Frame { x, y, z, ..Frame::translation(place(p)) }, half }
        };
        let mut world = World::default();
        world.part(
            "slab",
            true,
            &[
                ("z0", side([0.0, 0.0, 0.0], [y, x, -z], [50.0, 50.0])),
                ("z1", side([0.0, 0.0, 10.0], [x, y, z], [50.0, 50.0])),
                ("x0", side([-50.0, 0.0, 5.0], [z, y, -x], [5.0, 50.0])),
                ("x1", side([50.0, 0.0, 5.0], [y, z, x], [50.0, 5.0])),
                ("y0", side([0.0, -50.0, 5.0], [x, z, -y], [50.0, 5.0])),
                ("y1", side([0.0, 50.0, 5.0], [z, x, y], [5.0, 50.0])),
            ],
        );
        for (height, absorbs, expected) in [
            (0.0, true, 1.0),
            (10.0, true, 1.0 - r),
            (0.0, false, 1.0 + (1.0 - r) * r / (1.0 - r * r)),
            (10.0, false, (1.0 - r) / (1.0 - r * r)),
        ] {
            let text = format!(
                "[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 1e-9\n[[medium]]\nname = 'glass'\nindex = 1.5
                [[material]]\npart = 'slab'\nmedium = 'glass'
                [[source]]\nkind = 'collimated'\nat = {:?}\ndirection = {:?}\nsize = [5, 5]
                [[receiver]]\nname = 'in the face'\nat = {:?}\nnormal = {:?}\nsize = [90, 90]\nabsorbs = {absorbs}\n",
                place([-6.0, 0.0, -20.0]).to_array(),
                way([0.3, 0.0, 1.0]),
                place([0.0, 0.0, height]).to_array(),
                z.to_array()
            );
            let results = world.run(&text, |_| ());
            let found = results.receivers[0].power;
            assert!((found - expected).abs() < 1e-8, "{at:?} {height} {absorbs}: {found} {expected}");
            assert_eq!(results.lost_rays, 0);
        }
    }
}

/// Two overlapping blocks of one glass with sides in the same planes are one block.
#[test]
fn blocks_that_overlap_and_share_planes_are_one_block() {
    let mut results = Vec::new();
    for blocks in [&[(0.0, 15.0)][..], &[(0.0, 10.0), (5.0, 15.0)], &[(5.0, 15.0), (0.0, 10.0)]] {
        let mut world = World::default();
        let mut text = String::from("[run]\nrays = 20000\n[[medium]]\nname = 'glass'\nindex = 1.5\n");
        for (k, &(from, to)) in blocks.iter().enumerate() {
            world.cuboid(&format!("block {k}"), Point::new(-10.0, -10.0, from), Point::new(10.0, 10.0, to));
            text += &format!("[[material]]\npart = 'block {k}'\nmedium = 'glass'\n");
        }
        text += "[[source]]\nkind = 'point'\nat = [1, 2, -12]\n[[source]]\nkind = 'point'\nat = [25, 3, 6]
            [[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\n";
        results.push(world.run(&text, |_| ()));
    }
    let [whole, others @ ..] = &results[..] else { panic!() };
    for other in others {
        assert_eq!(other.lost_rays, 0, "{:?}", other.ledger.first());
        for axis in 0..2 {
            let [a, b] = [whole, other].map(|r| r.receivers[0].rms[axis]);
            assert!((a - b).abs() < 0.01 * a, "{axis}: {a} {b}");
        }
    }
}

/// A box of absorbing glass without its lid: what goes out by the opening is lost, not absorbed on an endless way, and a receiver
/// outside does not take it for light in the open; one inside the body counts as ever.
#[test]
fn light_that_leaves_by_an_opening_is_lost_and_not_absorbed_or_received() {
    let mut world = World::default();
    world.cuboid("cup", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 10.0));
    world.model.parts[0].shells[0].faces.retain(|f| f.name != "z1");
    world.model.parts[0].shells[0].closed = false;
    world.shapes.remove(5);
    let text = |receiver: &str| {
        format!(
            "[run]\nrays = 500\ninterfaces = 'split'\nsplit_floor = 0\n[[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 0.01
            [[material]]\npart = 'cup'\nmedium = 'glass'
            [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 5\n{receiver}"
        )
    };
    let plane = |z: f64| format!("[[receiver]]\nname = 'r'\nat = [0, 0, {z:?}]\nsize = [90, 90]\n");
    let bare = world.run(&text(""), |_| ());
    assert!((bare.power.lost - 0.96).abs() < 1e-9 && bare.power.absorbed == 0.0, "{:?}", bare.power);
    let outside = world.run(&text(&plane(30.0)), |_| ());
    assert!(outside.receivers[0].power == 0.0 && outside.power.lost > 0.7, "{:?}", outside.power);
    // Closed, the same plane in the glass receives what Beer leaves.
    let mut whole = World::default();
    whole.cuboid("cup", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 10.0));
    let inside = whole.run(&text(&plane(5.0)), |_| ());
    assert!((inside.receivers[0].power - 0.96 * (-0.05f64).exp()).abs() < 1e-9, "{:?}", inside.power);
    // A body that is open elsewhere: in it, with a wall behind, the receiver counts.
    let mut open = World::default();
    open.cuboid("cup", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 10.0));
    open.model.parts[0].shells[0].faces.retain(|f| f.name != "x1");
    open.model.parts[0].shells[0].closed = false;
    open.shapes.remove(1);
    let inside = open.run(&text(&plane(5.0)), |_| ());
    assert!((inside.receivers[0].power - 0.96 * (-0.05f64).exp()).abs() < 1e-9, "{:?}", inside.power);
}

/// A film of 0.5 µm on a block is named, and how to keep its sides apart; a sheet below the block has but one side.
#[test]
fn the_thinnest_body_is_named_and_no_sheet() {
    let mut world = World::default();
    let flat = Shape::Rectangle { frame: Frame::IDENTITY, half: [1.0, 1.0] };
    world
        .cuboid("block", Point::new(-2.0, -2.0, 0.0), Point::new(2.0, 2.0, 1.0))
        .cuboid("film", Point::new(-2.0, -2.0, 1.0), Point::new(2.0, 2.0, 1.0005))
        .part("sheet", false, &[("face", flat)]);
    let rule = |part: &str| format!("[[material]]\npart = '{part}'\nmedium = 'glass'\n");
    let text = format!(
        "[run]\nrays = 100\n[[medium]]\nname = 'glass'\nindex = 1.5\n{}{}{}[[source]]\nkind = 'point'\nat = [0, 0, 9]\n",
        rule("block"),
        rule("film"),
        rule("sheet")
    );
    let scene = Scene::parse(&text, "film.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let told: Vec<&String> = bound.notes().iter().filter(|note| note.contains("mm thick")).collect();
    assert!(matches!(&told[..], [note] if note.starts_with("'film'")), "{told:?}");
    assert!(told[0].ends_with("set glue_mm to 5e-5"), "{told:?}");
}

//! Light that is caught in clear bodies by total reflection, and what of an isotropic source in glass gets out: closed forms.

use crate::support::World;
use crate::touching::on_facets;
use crate::turned::{arc, assembly, lines, turned};
use lampyris::math::Point;
use lampyris::model::Model;
use lampyris::simulate::Results;
use lampyris::study::figures::{TracedGeometry, figures};
use std::f64::consts::FRAC_PI_2;

const N: f64 = 1.5;

/// A block of 20 × 30 × 40 mm with an isotropic source in it, cut into bricks that touch or overlap.
fn block(parts: [u32; 3], overlap: f64, source: &str) -> Results {
    let mut world = World::default();
    let mut text =
        format!("[run]\nrays = 500\nmax_bounces = 100000\n[[medium]]\nname = 'glass'\nindex = {N}\n{source}\n");
    let size = Point::new(20.0, 30.0, 40.0) / Point::from_array(parts.map(f64::from));
    let number = parts.iter().product::<u32>();
    for k in 0..number {
        let at = [k % parts[0], k / parts[0] % parts[1], k / parts[0] / parts[1]].map(f64::from);
        let low = size * Point::from_array(at);
        let name = format!("brick {k}");
        world.cuboid(&name, low, (low + size + Point::splat(overlap)).min(Point::new(20.0, 30.0, 40.0)));
        text += &format!("[[material]]\npart = '{name}'\nmedium = 'glass'\n");
    }
    text += "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\n";
    world.run(&text, |_| ())
}

/// In a block a direction keeps the size of its three components: what is within no critical cone about an axis never gets out. The
/// six cones do not meet: `3 cos θc − 2` of an isotropic source is caught, with `cos θc = √(1 − 1/n²)`; the same for a block glued
/// of bricks, whose bounds light passes straight.
#[test]
fn what_a_block_of_glued_bricks_keeps_is_what_the_block_keeps() {
    let caught = 3.0 * (1.0 - 1.0 / (N * N)).sqrt() - 2.0;
    let mut first = None;
    for (parts, overlap) in [([1, 1, 1], 0.0), ([2, 2, 2], 0.0), ([1, 1, 2], 0.5)] {
        let r = block(parts, overlap, "[[source]]\nkind = 'point'\nat = [7.1, 8.3, 9.7]");
        assert_eq!((r.lost_rays, r.cut_off_rays), (0, r.caught_rays), "{parts:?}: {:?}", r.ledger.first());
        // Of 500 rays; 1σ of random ones is 0.019. The same rays are caught in all blocks.
        let whole = *first.get_or_insert(r.power.cut_off);
        assert!(
            (whole - caught).abs() < 0.038 && (r.power.cut_off - whole).abs() < 1e-3,
            "{parts:?}: {:?}",
            r.power
        );
        assert!((r.power.received + r.power.cut_off - 1.0).abs() < 1e-9, "{parts:?}: {:?}", r.power);
    }
}

/// A pin of radius 2 from z = 0 to 10.5 whose upper end is rounded off by 0.5.
fn rounded_pin() -> Model {
    let mut pin = lines(&[[0.0, 0.0], [2.0, 0.0], [2.0, 10.0]]);
    pin.push(arc([1.5, 10.0], 0.5, [0.0, FRAC_PI_2]));
    pin.extend(lines(&[[1.5, 10.5], [0.0, 10.5]]));
    assembly(vec![turned("pin", &pin, 0.0)])
}

/// Both facets at an edge have the same interpolated normals there, and a ray nearly along them goes to and fro between them, nearer to
/// the edge each time. It is let out before it is so near that it passes the edge: out of a closed pin of glass, or of mirrors, light gets
/// by its faces alone.
#[test]
fn light_does_not_pass_the_edge_between_two_facets() {
    let glass = "[run]\nrays = 20000\n[[medium]]\nname = 'glass'\nindex = 1.5
        [[material]]\npart = 'pin'\nmedium = 'glass'
        [[source]]\nkind = 'lambertian'\nat = [0, 0, -0.3]\ndirection = [0, 0, 1]\nradius = 2";
    let r = on_facets(&rounded_pin(), glass);
    assert_eq!((r.lost_rays, r.cut_off_rays - r.caught_rays), (0, 0), "{:?}", r.ledger.first());
    let mirrors = "[run]\nrays = 5000\nmax_bounces = 40\n[[medium]]\nname = 'room'\nindex = 1
        [[material]]\npart = 'pin'\nmedium = 'room'\nsurface = 'mirror'\nreflectance = 1
        [[source]]\nkind = 'point'\nat = [-1.38, 1.17, 5.45]";
    let r = on_facets(&rounded_pin(), mirrors);
    assert_eq!((r.power.escaped, r.cut_off_rays), (0.0, 5000), "{:?}", r.power);
}

/// Bricks of one index of which one absorbs: no light is cut off, because it ends there by its power.
#[test]
fn light_that_is_caught_beside_a_brick_that_absorbs_is_absorbed() {
    let mut world = World::default();
    world.cuboid("clear", Point::ZERO, Point::new(20.0, 20.0, 20.0));
    world.cuboid("grey", Point::new(0.0, 0.0, 20.0), Point::new(20.0, 20.0, 21.0));
    let text = "[run]\nrays = 2000\nmax_bounces = 100000\npower_floor = 1e-4
        [[medium]]\nname = 'glass'\nindex = 1.5\n[[medium]]\nname = 'grey'\nindex = 1.5\nabsorption_per_mm = 0.003
        [[material]]\npart = 'clear'\nmedium = 'glass'\n[[material]]\npart = 'grey'\nmedium = 'grey'
        [[source]]\nkind = 'point'\nat = [7.1, 8.3, 9.7]";
    let r = world.run(text, |_| ());
    assert_eq!((r.lost_rays, r.caught_rays), (0, 0));
    let caught = 3.0 * (1.0 - 1.0 / (N * N)).sqrt() - 2.0;
    assert!((r.power.absorbed - caught).abs() < 0.03 && r.power.cut_off < 1e-3, "{:?}", r.power);
}

/// Blocks of different media that overlap are named after the run; blocks that touch, lie in each other or are of one medium are not.
#[test]
fn blocks_of_different_media_that_overlap_are_named() {
    for (second, index, named) in [
        (([2.0, 2.0, 8.0], [6.0, 6.0, 14.0]), 1.6, true),
        (([2.0, 2.0, 8.0], [6.0, 6.0, 14.0]), 1.5, false),
        (([0.0, 0.0, 10.0], [10.0, 10.0, 14.0]), 1.6, false),
        (([2.0, 2.0, 2.0], [6.0, 6.0, 8.0]), 1.6, false),
    ] {
        let mut world = World::default();
        let (low, high) = (Point::from_array(second.0), Point::from_array(second.1));
        world.cuboid("first", Point::ZERO, Point::splat(10.0)).cuboid("second", low, high);
        let text = format!(
            "[run]\nrays = 500\n[[medium]]\nname = 'm'\nindex = 1.5\n[[medium]]\nname = 'n'\nindex = {index}
            [[material]]\npart = 'first'\nmedium = 'm'\n[[material]]\npart = 'second'\nmedium = 'n'
            [[source]]\nkind = 'point'\nat = [4, 4, -3]"
        );
        let r = world.run(&text, |_| ());
        let note = r.notes.iter().find(|n| n.contains("overlap"));
        assert_eq!(note.is_some(), named, "{second:?} {index}: {:?}", r.notes);
        assert!(note.is_none_or(|n| n.contains("'first' (m)") && n.contains("'second' (n)")), "{note:?}");
    }
}

/// Of a solid that the file calls closed and that has a face too few it is said where its light was lost.
#[test]
fn where_light_was_lost_is_said() {
    let mut world = World::default();
    world.cuboid("whole", Point::splat(20.0), Point::splat(30.0)).cuboid("cup", Point::ZERO, Point::splat(10.0));
    world.model.parts[1].shells[0].faces.retain(|f| f.name != "z1");
    world.shapes.pop();
    let text = "[run]\nrays = 500\n[[medium]]\nname = 'm'\nindex = 1.5\n[[material]]\npart = '*'\nmedium = 'm'
        [[source]]\nkind = 'cone'\nhalf_angle_deg = 20\nat = [4, 4, -3]";
    let r = world.run(text, |_| ());
    let note = r.notes.iter().find(|n| n.contains("were lost")).expect("a note");
    assert!(
        r.lost_rays > 400 && note.starts_with(&format!("{} paths", r.lost_rays)) && note.contains("in 'cup' (m)")
    );
}

/// Half of a beam is lost in a cup that is open, the left half falls on a screen: its mean, 5 mm beside that of the whole, has an error
/// that says so, and its width too, 5.77 mm about the middle as that of the whole beam.
#[test]
fn lost_light_is_an_error_of_places_too() {
    let mut world = World::default();
    world.cuboid("cup", Point::ZERO, Point::splat(10.0));
    world.model.parts[0].shells[0].faces.retain(|f| f.name != "z1");
    world.model.parts[0].shells[0].closed = false;
    world.shapes.remove(5);
    let text = "[run]\nrays = 5000\n[[medium]]\nname = 'm'\nindex = 1.0\n[[material]]\npart = '*'\nmedium = 'm'
        [[source]]\nkind = 'collimated'\nat = [0, 5, -3]\nsize = [20, 2]\ninside = []
        [[receiver]]\nname = 'screen'\nat = [0, 5, 30]\nsize = [40, 20]\ncells = [4, 2]";
    let r = world.run(text, |_| ());
    assert!((r.power.lost - 0.5).abs() < 0.01, "{:?}", r.power);
    let figures = &figures(&r, TracedGeometry::Spline, "W")[0];
    let [centroid, rms] = [&figures.centroid_1, &figures.rms_1].map(|figure| figure.as_ref().unwrap());
    assert!((centroid.value + 5.0).abs() < 0.1, "{centroid:?}");
    assert!(
        (4.0..10.0).contains(&centroid.geometric.unwrap()) && rms.geometric.unwrap() > 4.0,
        "{centroid:?} {rms:?}"
    );
}

//! Where the kernel does less than a scene requests: it is counted and reported.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point};

/// The facets of this face lie 0.5 mm, then 5 mm above it, as coarse ones may: farther than 1 mm they are not looked for, light that starts
/// on the surface meets them from behind, and that is reported.
#[test]
fn starts_that_are_not_on_their_facets_are_counted() {
    for (height, misplaced) in [(0.5, 0), (5.0, 1000)] {
        let mut world = World::default();
        let at =
            |z: f64| Shape::Rectangle { frame: Frame::translation(Point::new(0.0, 0.0, z)), half: [50.0, 50.0] };
        world.part("led", false, &[("top", at(0.0))]);
        world.shapes[0] = at(height);
        let text = "[run]\nrays = 1000\n[[source]]\nkind = 'lambertian'\non = { part = 'led' }\n";
        let found = world.run(text, |_| ());
        assert_eq!(found.tallies.counts.misplaced_starts, misplaced);
        assert_eq!(found.notes.iter().any(|note| note.contains("started on the spline")), misplaced > 0);
    }
}

/// Facets of a round face end at chords within its border: here at 1.9 of 2 mm from the middle, where a tenth of its light starts beside
/// them. It is moved onto them, and none of it starts on the surface.
#[test]
fn starts_beside_the_border_of_facets_are_moved_onto_them() {
    let mut world = World::default();
    let square = |half: f64| Shape::Rectangle { frame: Frame::IDENTITY, half: [half, half] };
    world.part("led", false, &[("top", square(2.0))]);
    world.shapes[0] = square(1.9);
    let text = "[run]\nrays = 1000\n[[source]]\nkind = 'lambertian'\non = { part = 'led' }\n\
        [[receiver]]\nname = 'all'\nkind = 'disc'\nat = [0, 0, 1]\nnormal = [0, 0, -1]\nradius = 1000\n";
    let found = world.run(text, |_| ());
    assert_eq!((found.tallies.counts.misplaced_starts, found.lost_rays), (0, 0));
    assert!((found.receivers[0].power - 1.0).abs() < 1e-5, "{}", found.receivers[0].power);
}

/// A sheet of oil that is but one face, glued under glass: light from below comes from no oil, and can only go into the glass.
#[test]
fn a_touching_face_that_bounds_no_body_there_is_counted() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let sheet = Shape::Rectangle { frame: Frame::IDENTITY, half: [5.0, 5.0] };
    world.part("oil", false, &[("sheet", sheet)]);
    let text = "[run]\nrays = 1000\n[[medium]]\nname = 'glass'\nindex = 1.5\n[[medium]]\nname = 'oil'\nindex = 1.4\n\
        [[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'oil'\nmedium = 'oil'\n\
        [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\ndirection = [0, 0, 1]\nradius = 1\n";
    let results = world.run(text, |_| ());
    let refused = results.tallies.counts.refused_contacts;
    assert!(refused >= results.rays, "{refused} {:?}", results.notes);
    assert!(results.notes.iter().any(|note| note.contains("crossed the first alone")), "{:?}", results.notes);
}

/// A source in glass below a stack of 1050 sheets: the way out through these is given up, and two ways beside them show that it is in
/// the glass, where e⁻⁵ of its light passes the 5 mm before the first sheet.
#[test]
fn a_way_out_that_was_given_up_decides_nothing() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-10.0, -10.0, -10.0), Point::new(10.0, 10.0, 20.0));
    let sheet = |k: usize| Shape::Rectangle {
        frame: Frame::translation(Point::new(0.0, 0.0, 0.01 * k as f64)),
        half: [0.05, 0.05],
    };
    let sheets: Vec<(&str, Shape)> = (0..1050).map(|k| ("sheet", sheet(k))).collect();
    world.part("stack", false, &sheets);
    let text = "[run]\nrays = 200\n[[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 1\n\
        [[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'stack'\nsurface = 'absorber'\n\
        [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\ndirection = [0, 0, 1]\nradius = 0.01\npower = 1\n";
    let results = world.run(text, |_| ());
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
    let medium = results.absorbed.iter().find(|a| a.r#in == "glass").map_or(0.0, |a| a.power);
    assert!((medium - (1.0 - (-5f64).exp())).abs() < 1e-3, "{:?}", results.absorbed);
}

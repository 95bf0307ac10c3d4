//! A body that stands twice in one place is reported, as a copy that a file should not hold.

use crate::support::World;
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::Model;
use lampyris::simulate::Scene;
use std::path::Path;

fn notes(model: &Model) -> Vec<String> {
    let text = "[[source]]\nkind = 'point'\nat = [50, 0, 0]\n";
    Scene::parse(text, "scene.toml", Path::new(".")).unwrap().bind(model).unwrap().notes().to_vec()
}

/// A block of 2 × 3 × 4 mm, and others of these corners.
fn blocks(others: &[[Point; 2]]) -> Model {
    let mut world = World::default();
    world.cuboid("block 0", Point::ZERO, Point::new(2.0, 3.0, 4.0));
    for (k, [min, max]) in (1..).zip(others) {
        world.cuboid(&format!("block {k}"), *min, *max);
    }
    world.model
}

#[test]
fn solids_that_stand_twice_in_one_place_are_named() {
    let whole = [Point::ZERO, Point::new(2.0, 3.0, 4.0)];
    let told = notes(&blocks(&[whole]));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains("solid 0 of 'block 0' and solid 0 of 'block 1' have the same faces"), "{told:?}");
    // By rounding no other place, as of a part that is placed there; a hundredth of a micrometre is one.
    let moved = |shift: f64| {
        let mut model = blocks(&[whole.map(|p| p + Vector::X)]);
        model.instances[1].placement = Frame::translation(Vector::X * (shift - 1.0));
        notes(&model)
    };
    assert_eq!([1e-12, 1e-5].map(|shift| moved(shift).len()), [1, 0]);
    // In one part, by their numbers.
    let mut model = blocks(&[whole]);
    let shells = std::mem::take(&mut model.parts[1].shells);
    model.parts[0].shells.extend(shells);
    model.instances.pop();
    let told = notes(&model);
    assert!(told.len() == 1 && told[0].contains("solid 0 of 'block 0' and solid 1 of 'block 0'"), "{told:?}");
    // Seven copies are six pairs.
    let told = notes(&blocks(&[whole; 6]));
    assert!(told.len() == 4 && told[3].contains("for 3 more pairs of solids"), "{told:?}");
}

/// A larger block, one in it, one beside it and one that is shut against it are others.
#[test]
fn other_solids_are_no_copies() {
    let others = [
        [Point::ZERO, Point::new(2.0, 3.0, 5.0)],
        [Point::splat(0.5), Point::splat(1.5)],
        [Point::new(2.0, 0.0, 0.0), Point::new(4.0, 3.0, 4.0)],
    ];
    assert_eq!(notes(&blocks(&others)), Vec::<String>::new());
    // An open shell is no solid.
    let mut model = blocks(&[[Point::ZERO, Point::new(2.0, 3.0, 4.0)]]);
    model.parts[1].shells[0].closed = false;
    assert_eq!(notes(&model), Vec::<String>::new());
}

//! Faces whose cells or triangles are more than they may have.

use lampyris::math::Homogeneous;
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::Surface;
use lampyris::tessellate::{Repair, Settings, tessellate};

/// A quarter of a hull of 46 m: from a blunt nose to a tube of 3 m along which x runs unevenly, the cross-section one cubic.
fn hull() -> Model {
    let columns = [(0.0, 0.0), (0.0, 2500.0), (3000.0, 3000.0), (9000.0, 3000.0)];
    let tube = [(14_000.0, 3000.0), (32_000.0, 3000.0), (46_000.0, 2990.0)];
    // Control points of a quarter of a circle.
    const QUARTER: f64 = 0.552_284_75;
    let section = [(1.0, 0.0), (1.0, QUARTER), (QUARTER, 1.0), (0.0, 1.0)];
    let columns = columns.into_iter().chain(tube);
    let points = columns.flat_map(|(x, r)| section.map(|(y, z)| Homogeneous::new(x, r * y, r * z, 1.0)));
    let knots =
        [vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0], vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]];
    let surface = Surface { degree: [3, 3], knots, points: points.collect() };
    let shell = Shell { faces: vec![Face::whole(surface)], ..Shell::default() };
    Model::from_part(Part { shells: vec![shell], ..Part::default() })
}

/// However few cells a face may have: where its facets do not all hold, the report says that its budget ended.
#[test]
fn a_face_whose_budget_ended_is_named() {
    let model = hull();
    for budget in [200, 500, 1000, 1500, 2000, 3000] {
        let made = tessellate(&model, &Settings { budget, ..Settings::uniform(0.02) });
        let report = &made.report;
        let is_whole = report.certified == report.facets;
        let named: Vec<Repair> = report.repaired.iter().map(|r| r.how).collect();
        assert_eq!(named, if is_whole { vec![] } else { vec![Repair::CoarserCells] });
    }
}

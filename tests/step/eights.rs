//! Faces whose loop crosses itself like an eight of equal lobes, whose signed areas cancel.

use crate::faces::{close, points, read, square};
use crate::silence;
use lampyris::step::Import;
use lampyris::tessellate::{Settings, tessellate};

/// The area of the facets of the only face: that of a face is signed, and its lobes cancel.
fn area(import: &Import) -> f64 {
    let faces = import.report.faces;
    assert_eq!((faces.converted, faces.refused), (1, 0), "{:?}", import.report.refusals);
    tessellate(&import.model, &Settings::default()).mesh.area()
}

/// The unit square of [`square`] with two corners exchanged: its border crosses itself in the middle.
fn eight() -> String {
    let whole = square([".T."; 4], [0, 1, 2, 3]);
    let corners = points(&[(10, [0., 0., 0.]), (11, [1., 0., 0.]), (12, [1., 1., 0.]), (13, [0., 1., 0.])]);
    let exchanged = points(&[(10, [0., 0., 0.]), (11, [1., 1., 0.]), (12, [0., 1., 0.]), (13, [1., 0., 0.])]);
    assert!(whole.starts_with(&corners));
    whole.replace(&corners, &exchanged)
}

/// Two triangles of base 1 and height 1/2, and not the patch of 16 mm² that they lie on.
#[test]
fn an_eight_of_equal_lobes_bounds_both() {
    let patch = points(&[(70, [-2., -2., 0.]), (71, [-2., 2., 0.]), (72, [2., -2., 0.]), (73, [2., 2., 0.])])
        + "#21=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#70,#71),(#72,#73)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),\
           .UNSPECIFIED.);";
    for surface in ["#21=PLANE('',#20);", &patch] {
        let import = read(&eight().replace("#21=PLANE('',#20);", surface));
        close(area(&import), 0.5, 1e-6);
        assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
    }
}

/// A corner moved by 1e-8 mm along a side of length 1 changes the signed area by half of that, either way: rounding, which turns no loop.
#[test]
fn an_eight_runs_as_it_does_whatever_its_signed_area_rounds_to() {
    for off in [-1e-8, 1e-8] {
        let corner = format!("({:?},1.0,0.0)", 1.0 + off);
        let file = eight();
        assert!(file.contains("(1.0,1.0,0.0)"));
        let import = read(&file.replace("(1.0,1.0,0.0)", &corner));
        close(area(&import), 0.5, 1e-6);
        assert_eq!(import.report.faces.repaired, 0, "{off}: {:?}", import.report.repairs);
        let trim = &import.model.parts[0].shells[0].faces[0].loops[0];
        assert_eq!(trim.uses.iter().filter(|u| u.reversed).count(), 0, "{off}");
    }
}

/// A plate of 100 mm² with the eight of two triangles of 1 mm² for a hole. A corner moved by 1e-8 mm makes its signed area as much, either
/// way, which turns nothing.
#[test]
fn a_hole_like_an_eight_stays_open() {
    for off in [-1e-8, 0.0, 1e-8] {
        let corners = [[4.0, 4.0], [6.0 + off, 6.0], [4.0, 6.0], [6.0, 4.0]];
        let point = |k: usize| format!("#8{k}=CARTESIAN_POINT('',({:?},{:?},0.));\n", corners[k][0], corners[k][1]);
        let points: String = (0..4).map(point).collect();
        let whole = silence::plate(0.0).replace("#68=EDGE_LOOP('',(#69))", "#68=POLY_LOOP('',(#80,#81,#82,#83))");
        let import = silence::read(&(points + &whole));
        close(area(&import), 98.0, 1e-6);
        assert_eq!(import.report.faces.repaired, 0, "{off}: {:?}", import.report.repairs);
    }
}

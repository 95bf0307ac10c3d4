//! Faces whose loop crosses itself like an eight: named, both lobes meshed, with one corner where the edges cross.

use crate::repairs::{face, flat, measured, plane};
use lampyris::math::{Frame, Point};
use lampyris::nurbs::sweep;
use lampyris::tessellate::{Repair, Tessellation, tessellate};

/// Whether facets have a corner in the plane z = 0 at these coordinates, mm.
fn has_corner(made: &Tessellation, [x, y]: [f64; 2]) -> bool {
    let at = Point::new(x, y, 0.0);
    (0..made.mesh.facets.len()).flat_map(|f| made.mesh.corners(f)).any(|p| p.distance(at) < 1e-12)
}

/// Triangles of base 10 and x, of height 10 together, meet where the sides cross: their heights are 100 / (x + 10) and 10 x / (x + 10).
/// Filled by parity, they are 5 (100 + x²) / (x + 10) mm²: 42.5 for 6, where one triangle over three of the corners has 50. Run the other
/// way the loop is a hole, in a face of 100 mm².
#[test]
fn a_loop_that_crosses_itself_is_named() {
    for x in [10.0, 6.0, 2.0] {
        let lobes = 5.0 * (100.0 + x * x) / (x + 10.0);
        let around = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0], [x, 10.0]];
        let mut back = around;
        back.reverse();
        for (corners, area) in [(around, lobes), (back, 100.0 - lobes)] {
            let made = tessellate(&face(plane(), &[flat(&corners)]), &measured(0.1));
            let r = &made.report;
            assert_eq!((r.faces.failed, r.faces.repaired, r.certified), (0, 1, 0), "{corners:?}");
            assert_eq!(r.repaired[0].how, Repair::CrossingBorder, "{corners:?}");
            assert!(r.repaired[0].reached_mm < 1e-9, "{corners:?}: {:?}", r.repaired);
            assert!((r.area_mm2 - area).abs() < 1e-9, "{corners:?}: {} {area}", r.area_mm2);
            let crossing = [10.0 * x / (x + 10.0), 100.0 / (x + 10.0)];
            for corner in corners.into_iter().chain([crossing]) {
                assert!(has_corner(&made, corner), "{corners:?}: {corner:?}");
            }
        }
    }
}

/// A square metre with a lobe of 0.6 mm² in a corner, which its area does not show. Where a vertex lies half a tolerance above the plane,
/// the edges pass each other in space: one is left out, whose end is 0.6 / √1.04 mm from the other in the plane.
#[test]
fn where_edges_that_cross_have_no_common_corner_nothing_is_certified() {
    let way = [[0.0, 1.0], [5.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0], [0.0, 1000.0], [0.0, 10.0], [2.0, 0.0]];
    for above in [0.0, 0.05] {
        let mut corners = flat(&way);
        corners[6].1.z = above;
        let surface = sweep::plane(&Frame::IDENTITY, [[0.0, 1000.0]; 2]);
        let made = tessellate(&face(surface, &[corners]), &measured(0.1));
        let r = &made.report;
        assert_eq!((r.faces.failed, r.faces.repaired), (0, 1), "{above}");
        assert_eq!(r.repaired[0].how, Repair::CrossingBorder, "{above}");
        // 10 − 5 x = 1 − x / 5.
        assert_eq!(has_corner(&made, [1.875, 0.625]), above == 0.0);
        if above > 0.0 {
            let depth = (0.36 / 1.04 + above * above).sqrt();
            assert!((r.repaired[0].reached_mm - depth).abs() < 1e-9, "{:?} {depth}", r.repaired);
            assert_eq!(r.certified, 0, "of {}", r.facets);
        }
    }
}

/// A loop like an eight, with corners near its crossing: around its smaller lobe it runs clockwise, and neighbours meet facets that run
/// along it.
#[test]
fn facets_run_along_a_loop_that_crosses_itself() {
    let way = [[0.0, 0.0], [8.0, 0.0], [3.1, 3.5], [1.7, 4.5], [1.0, 5.0], [3.0, 5.0], [2.7, 4.5], [2.1, 3.5]];
    let corners = flat(&way);
    let made = tessellate(&face(plane(), std::slice::from_ref(&corners)), &measured(0.01));
    assert_eq!(made.report.repaired[0].how, Repair::CrossingBorder);
    let number = |p: Point| corners.iter().position(|(_, q)| *q == p);
    let (mut along, mut against) = (0, 0);
    for f in 0..made.mesh.facets.len() {
        let c = made.mesh.corners(f).map(number);
        for (a, b) in (0..4).filter_map(|k| c[k].zip(c[(k + 1) % 4])) {
            along += usize::from(b == (a + 1) % corners.len());
            against += usize::from(a == (b + 1) % corners.len());
        }
    }
    // The two chords that cross are divided there.
    assert!(along == corners.len() - 2 && against == 0, "{along} {against}");
}

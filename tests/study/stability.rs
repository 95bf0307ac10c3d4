//! Every hard case in every variant, as a contract that each intersector signs.

use crate::support::Brute;
use lampyris::intersect::bvh::{self, Bvh, Kind};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::study::stability::{Geometry, Row, Variant, cases};

fn table(rows: &[Row]) -> String {
    let line = |r: &Row| {
        format!(
            "{:28} {:8} {:8} {:5} {:5} {:5} {:5}\n",
            r.case, r.variant, r.intersector, r.rays, r.right, r.flagged, r.wrong
        )
    };
    rows.iter().map(line).collect()
}

#[test]
fn brute_force_over_the_facets_signs() {
    let mut rows = Vec::new();
    for case in cases() {
        for variant in Variant::ALL {
            // Ten thousand reflections are for the trees; needles a million times longer than wide, turned, are beyond
            // this test's plain arithmetic.
            let guide = case.name.starts_with("guide") && variant != Variant::Home;
            if guide || (case.name == "slivers" && variant == Variant::Rotated) {
                continue;
            }
            let scene = case.scene(variant);
            rows.push(scene.ask("brute", &Brute(&scene.mesh), Geometry::Facets));
        }
    }
    let bad: Vec<Row> = rows.iter().filter(|r| r.wrong > 0).cloned().collect();
    assert!(bad.is_empty(), "{}", table(&bad));
}

/// The contract: every case in every variant, right within the ground's accuracy, or flagged, and never wrong in silence.
macro_rules! signs {
    ($name:ident, $ground:expr, |$scene:ident| $build:expr) => {
        #[test]
        fn $name() {
            let mut rows = Vec::new();
            for case in cases() {
                for variant in Variant::ALL {
                    let $scene = case.scene(variant);
                    rows.push($scene.ask(stringify!($name), &$build, $ground));
                }
            }
            println!("{}", table(&rows));
            let bad: Vec<Row> = rows.iter().filter(|r| r.wrong > 0).cloned().collect();
            assert!(bad.is_empty(), "{}", table(&bad));
        }
    };
}

signs!(exact_spline, Geometry::Spline, |s| Exact::build(&s.model, &exact::Settings::default()));
signs!(octree_of_facets, Geometry::Facets, |s| Octree::build(&s.mesh, &octree::Settings::default()));
signs!(textbook_octree, Geometry::Facets, |s| Octree::build(&s.mesh, &octree::Settings::textbook()));
signs!(cwbvh, Geometry::Facets, |s| Bvh::build(&s.mesh, &bvh::Settings::default()));
signs!(bvh2, Geometry::Facets, |s| Bvh::build(
    &s.mesh,
    &bvh::Settings { kind: Kind::Bvh2, ..bvh::Settings::default() }
));

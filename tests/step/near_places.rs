//! Which places of one thing are two, and which are one that the file prints with other digits: only what it says within the parent counts,
//! wherever that stands.

use crate::assemblies::{assembly, assert_places, read};
use crate::products::{NEXT, placed_usage, product, relation, usage};

/// A placement #`id` at this x, and #`id` + 1.
fn placement(id: u32, x: &str) -> String {
    format!("#{id}=AXIS2_PLACEMENT_3D('',#{},#13,#14);\n#{}=CARTESIAN_POINT('',({x},0.,0.));\n", id + 1, id + 1)
}

/// The assembly #200 in another one, a kilometre from its origin, and in one that takes the coordinates of its part back. In it a usage
/// and a mapped item put the part to these places.
#[test]
fn digits_count_within_the_parent() {
    for (outer, [used, mapped], expected) in [
        ("1.E6", ["12.5", "13."], &[1_000_012.5, 1_000_013.0][..]),
        ("1.E6", ["12.5", "12.5"], &[1_000_012.5]),
        ("-1234.568", ["1234.568", "1234.56784"], &[0.0]),
    ] {
        let data = [
            &placement(40, used),
            &placement(50, mapped),
            &placement(60, outer),
            "#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#50);\n",
            &placed_usage(400, [200, 100], [110, 300], [20, 40]),
            &product(500, "top", 510),
            "#510=SHAPE_REPRESENTATION('',(#60),#1);\n",
            &placed_usage(600, [500, 200], [300, 510], [20, 60]),
        ]
        .concat();
        assert_places(&assembly("#31,", &data), expected, &format!("{used} and {mapped} at {outer}"));
    }
}

/// Whatever says twice where a thing stands, the second time with seven digits.
#[test]
fn a_place_with_fewer_digits_is_no_second_one() {
    let places = placement(40, "1234.56784") + &placement(50, "1234.568");
    let twice =
        |child: [u32; 2]| relation(430, [child[0], 300], [20, 40]) + &relation(440, [child[1], 300], [20, 50]);
    // Two relationships of one shape.
    let related = assembly("", &(places.clone() + &twice([110, 110])));
    assert_places(&related, &[1234.56784], "relationships");
    // Two mapped items of the usage's own shape.
    let items = "#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#40);\n#34=MAPPED_ITEM('',#30,#50);\n\
                 #32=SHAPE_REPRESENTATION('place',(#31,#34),#1);\n#33=SHAPE_DEFINITION_REPRESENTATION(#401,#32);\n";
    let used = assembly("", &(places.clone() + &usage(400, NEXT, "#200,#100,$") + items));
    assert_places(&used, &[1234.56784], "mapped items");
    // Two representations of the same solid.
    let shapes = "#300=SHAPE_REPRESENTATION('',(#20,#40,#50),#1);\n#111=SHAPE_REPRESENTATION('',(#24,#20),#1);\n\
                  #112=SHAPE_REPRESENTATION('',(#24,#20),#1);\n";
    let shared = read(&(product(200, "asm", 300) + shapes + &places + &twice([111, 112])));
    assert_eq!(shared.model.placed_face_count(), 6, "{:?}", shared.report.problems);
}

/// A usage that is not in the file, beside one that puts the part to the same place: what is known of it is that place.
#[test]
fn a_lost_usage_in_the_place_of_another_adds_nothing() {
    let placed = placed_usage(400, [200, 100], [110, 300], [20, 21]);
    for (to, expected) in [(21, &[10.0][..]), (22, &[10.0, 20.0])] {
        let lost = relation(430, [110, 300], [20, to]) + "#440=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#430,$);\n";
        let import = assembly("", &format!("{placed}{lost}"));
        let mut x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
        x.sort_by(f64::total_cmp);
        let problems = &import.report.problems;
        assert_eq!(x, expected, "{problems:?}");
        let told = "usage #400 puts product #100 where its relationship #430 does: it counts once";
        assert_eq!(problems.iter().any(|p| p.ends_with(told)), to == 21, "{problems:?}");
    }
}

/// Two usages that are not in the file put the part to the same place, the second by what is no usage.
#[test]
fn a_lost_usage_in_the_place_of_another_lost_one_adds_nothing() {
    let lost = |id: u32| {
        relation(id, [110, 300], [20, 21])
            + &format!("#{}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{id},$);\n", id + 10)
    };
    let import = assembly("", &(lost(410) + &lost(430)));
    let x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
    let problems = &import.report.problems;
    assert_eq!(x, [10.0], "{problems:?}");
    let told = "; CONTEXT_DEPENDENT_SHAPE_REPRESENTATION #420 puts product #100 where its relationship #430 does: it counts once";
    assert!(problems.iter().any(|p| p.contains("#440: ") && p.ends_with(told)), "{problems:?}");
}

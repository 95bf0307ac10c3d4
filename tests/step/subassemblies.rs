//! What a file says of assemblies within assemblies in rare forms: usages that a higher assembly sees, promises, and places without usages.

use crate::assemblies::{assembly, assert_places, read};
use crate::products::{NEXT, contextual, placed_usage, product, relation, usage};

/// A chain of assemblies, #600 in #500 in #200, each at x = 10, with the part at x = 10 in the last. A higher usage sees #600 from #200,
/// another one the part by that: whichever comes first, and whether the first has a place of its own or not.
#[test]
fn a_higher_usage_of_a_later_one_is_where_their_usages_put_it() {
    let higher = "SPECIFIED_HIGHER_USAGE_OCCURRENCE";
    let chain = [
        product(500, "sub", 510) + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n",
        product(600, "inner", 610) + "#610=SHAPE_REPRESENTATION('',(#20,#21),#1);\n",
        placed_usage(700, [200, 500], [510, 300], [20, 21]),
        placed_usage(710, [500, 600], [610, 510], [20, 21]),
        placed_usage(720, [600, 100], [110, 610], [20, 21]),
    ]
    .concat();
    let upper = usage(730, higher, "#200,#600,$,#700,#710");
    let upper_place = relation(732, [610, 300], [20, 22]) + &contextual(734, 732, 730);
    let seen = |to: u32| {
        usage(740, higher, "#200,#100,$,#730,#720")
            + &relation(742, [110, 300], [20, to])
            + &contextual(744, 742, 740)
    };
    for data in [
        [&upper, &upper_place, &seen(23)].map(String::as_str).concat(),
        [&seen(23), &upper, &upper_place].map(String::as_str).concat(),
        [&upper, &seen(23)].map(String::as_str).concat(),
    ] {
        assert_places(&assembly("", &(chain.clone() + &data)), &[30.0], &data);
    }
    let told = assembly("", &(chain + &upper + &seen(22))).report.problems;
    assert!(told.len() == 1 && told[0].contains("#744: usage #740 has another place than the usages"), "{told:?}");
}

/// The part is promised to #200, which may hold the assembly #500 at x = 20, in which a usage puts the part to x = 10.
#[test]
fn a_promise_counts_unless_usages_below_keep_it() {
    let other = product(500, "other", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &placed_usage(600, [500, 100], [110, 510], [20, 21]);
    let below = placed_usage(610, [200, 500], [510, 300], [20, 22]);
    let promise = usage(620, "PROMISSORY_USAGE_OCCURRENCE", "#200,#100,$");
    let place = relation(622, [110, 300], [20, 22]) + &contextual(624, 622, 620);
    let elsewhere = format!("{other}{promise}");
    assert_places(&assembly("", &elsewhere), &[10.0], "without a place, used elsewhere");
    assert_places(&assembly("", &format!("{elsewhere}{place}")), &[10.0, 20.0], "with a place, used elsewhere");
    assert_places(&assembly("", &format!("{elsewhere}{below}")), &[30.0], "without a place, used below");
    let kept = assembly("", &format!("{elsewhere}{below}{place}"));
    let x: Vec<f64> = kept.model.instances.iter().map(|i| i.placement.origin.x).collect();
    let told = &kept.report.problems;
    assert_eq!((x, told.len()), (vec![30.0], 1), "{told:?}");
    assert!(
        told[0].ends_with("#620: promises product #100, which other usages put into #200: only these are used")
    );
}

/// The assembly #500, in which a usage puts the part to x = 10, in #200 at x = 20 by a relationship or a mapped item; #200 may stand in
/// another one at x = 30. Beside it there may be a usage without a place, or with the same.
#[test]
fn an_assembly_stands_where_a_relationship_or_a_mapped_item_puts_it() {
    let sub = product(500, "sub", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n#30=REPRESENTATION_MAP(#20,#510);\n#31=MAPPED_ITEM('',#30,#22);\n"
        + &placed_usage(600, [500, 100], [110, 510], [20, 21]);
    let top = product(800, "top", 810)
        + "#810=SHAPE_REPRESENTATION('',(#23),#1);\n"
        + &placed_usage(820, [800, 200], [300, 810], [20, 23]);
    let related = relation(610, [510, 300], [20, 22]);
    let unplaced = usage(620, NEXT, "#200,#500,$");
    let placed = relation(622, [510, 300], [20, 22]) + &contextual(624, 622, 620);
    for (items, data) in [("", &related), ("#31,", &String::new())] {
        for usages in [String::new(), unplaced.clone(), unplaced.clone() + &placed] {
            let data = format!("{sub}{data}{usages}");
            assert_places(&assembly(items, &data), &[30.0], &data);
            assert_places(&assembly(items, &format!("{data}{top}")), &[60.0], &data);
        }
    }
    // One that moves nothing.
    let still = format!("{sub}{}{top}", relation(610, [510, 300], [20, 20]));
    assert_places(&assembly("", &still), &[40.0], "still");
    // What holds an assembly by a relationship is one, and stands in another one.
    let middle = product(700, "middle", 710)
        + "#710=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &relation(720, [510, 710], [20, 21])
        + &relation(730, [710, 300], [20, 22]);
    assert_places(&assembly("", &format!("{sub}{middle}")), &[40.0], "a chain");
}

/// The assembly #500, in which a usage puts the part to x = 10, in #200 at x = 20 by a mapped item beside a usage without a place, and in
/// #800 at x = 30: by another one, or by a usage.
#[test]
fn an_assembly_that_two_others_use_stands_in_both() {
    let sub = product(500, "sub", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n#30=REPRESENTATION_MAP(#20,#510);\n#31=MAPPED_ITEM('',#30,#22);\n"
        + &placed_usage(600, [500, 100], [110, 510], [20, 21])
        + &usage(620, NEXT, "#200,#500,$");
    let other = product(800, "other", 810) + &usage(820, NEXT, "#800,#500,$");
    let mapped = "#810=SHAPE_REPRESENTATION('',(#32,#23),#1);\n#32=MAPPED_ITEM('',#30,#23);\n".to_owned();
    let placed = "#810=SHAPE_REPRESENTATION('',(#23),#1);\n".to_owned()
        + &relation(822, [510, 810], [20, 23])
        + &contextual(824, 822, 820);
    for by in [mapped, placed] {
        assert_places(&assembly("#31,", &format!("{sub}{other}{by}")), &[30.0, 40.0], &by);
    }
}

/// The assembly #500, in which a usage puts the part to x = 10, unmoved by relationships alone in #700 and in #800, which usages put to
/// x = 20 and to x = 30.
#[test]
fn an_assembly_stands_unmoved_in_each_of_two_that_usages_place() {
    let placed = |id: u32, rep: u32, at: u32| placed_usage(id, [200, rep - 10], [rep, 300], [20, at]);
    let data = product(500, "sub", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &placed_usage(600, [500, 100], [110, 510], [20, 21])
        + &product(700, "first", 710)
        + &product(800, "second", 810)
        + "#710=SHAPE_REPRESENTATION('',(#20,#21),#1);\n#810=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &placed(720, 710, 22)
        + &placed(820, 810, 23)
        + &relation(740, [510, 710], [20, 20])
        + &relation(840, [510, 810], [20, 20]);
    assert_places(&assembly("", &data), &[30.0, 40.0], "unmoved");
}

/// The assembly #500, in which a usage puts the part to x = 10, by relationships alone in #200 and in #700. Unmoved in both it stands once;
/// moved it stands in each, which is reported where usages do not show that both are assemblies.
#[test]
fn an_assembly_that_relationships_put_into_several_products() {
    let places = |[first, second]: [u32; 2], usages: &str| {
        let data = product(500, "sub", 510)
            + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
            + &placed_usage(600, [500, 100], [110, 510], [20, 21])
            + &product(700, "other", 710)
            + "#710=SHAPE_REPRESENTATION('',(#21,#22),#1);\n"
            + &relation(610, [510, 300], [20, first])
            + &relation(720, [510, 710], [20, second])
            + usages;
        assembly("", &data)
    };
    assert_places(&places([20, 20], ""), &[10.0], "unmoved");
    for (to, expected) in [([22, 21], [20.0, 30.0]), ([20, 21], [10.0, 20.0])] {
        let import = places(to, "");
        let mut x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
        x.sort_by(f64::total_cmp);
        let problems = &import.report.problems;
        assert_eq!((x.as_slice(), problems.len()), (expected.as_slice(), 1), "{problems:?}");
        assert!(
            problems[0].contains("#610: puts product #500 into #200, as others put it into 1 more"),
            "{problems:?}"
        );
    }
    let both = usage(630, NEXT, "#200,#100,$") + &usage(640, NEXT, "#700,#100,$");
    assert_places(&places([22, 21], &both), &[0.0, 0.0, 20.0, 30.0], "two assemblies");
}

/// The assembly #200 uses #500 at x = 20, which uses the part at x = 10. A relationship that puts #200 into the part has its ends swapped,
/// for the part would hold itself.
#[test]
fn a_relationship_that_puts_an_assembly_into_its_part_is_told() {
    let chain = product(500, "sub", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &placed_usage(600, [200, 500], [510, 300], [20, 22])
        + &placed_usage(610, [500, 100], [110, 510], [20, 21]);
    let import = assembly("", &(chain + &relation(620, [300, 110], [21, 20])));
    let x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
    let told = &import.report.problems;
    assert_eq!((x, told.len()), (vec![30.0], 1), "{told:?}");
    assert!(
        told[0].ends_with("#620: puts product #200 into #100, which usages put into #200: only these are used")
    );
}

/// The shape of the part, #111, is no product's and related to that of the part, #112: a relationship of a usage may name either, at either
/// end, and the usage may not be in the file.
#[test]
fn a_relationship_of_a_usage_may_name_a_related_shape() {
    let shapes = product(150, "part", 112)
        + "#112=SHAPE_REPRESENTATION('',(#20),#1);\n#26=CSG_SOLID('',#25);\n#111=SHAPE_REPRESENTATION('',(#26,#20),#1);\n\
           #113=SHAPE_REPRESENTATION_RELATIONSHIP('','',#112,#111);\n#300=SHAPE_REPRESENTATION('',(#21,#22),#1);\n"
        + &product(200, "asm", 300)
        + &usage(600, NEXT, "#200,#150,$");
    for shape in [111, 112] {
        // The placement of the first representation comes to lie on that of the second, wherever the part is.
        for related in [relation(610, [shape, 300], [20, 21]), relation(610, [300, shape], [21, 20])] {
            let placed = read(&(shapes.clone() + &related + &contextual(620, 610, 600)));
            assert_places(&placed, &[10.0], &related);
        }
        let lost = shapes.clone() + &relation(610, [shape, 300], [20, 21]);
        let lost = read(&(lost + "#620=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#610,#99999);\n"));
        let x: Vec<f64> = lost.model.instances.iter().map(|i| i.placement.origin.x).collect();
        assert_eq!(x, [10.0], "{shape}: {:?}", lost.report.problems);
        assert!(lost.report.problems.iter().any(|p| p.contains("usage #600, which has no place, takes that")));
    }
}

//! What a file says of assemblies within assemblies in rare forms: usages that a higher assembly sees, promises, and places without usages.

use crate::assemblies::{NEXT, assembly, assert_places, product, relation, usage};

/// The place of usage #`usage` by the relationship #`relation`.
fn contextual(id: u32, relation: u32, usage: u32) -> String {
    format!("#{id}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{});\n", usage + 1)
}

/// A chain of assemblies, #600 in #500 in #200, each at x = 10, with the part at x = 10 in the last. A higher usage sees #600 from #200,
/// another one the part by that: whichever comes first, and whether the first has a place of its own or not.
#[test]
fn a_higher_usage_of_a_later_one_is_where_their_usages_put_it() {
    let higher = "SPECIFIED_HIGHER_USAGE_OCCURRENCE";
    let chain = [
        product(500, "sub", 510) + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n",
        product(600, "inner", 610) + "#610=SHAPE_REPRESENTATION('',(#20,#21),#1);\n",
        usage(700, NEXT, "#200,#500,$") + &relation(702, [510, 300], [20, 21]) + &contextual(704, 702, 700),
        usage(710, NEXT, "#500,#600,$") + &relation(712, [610, 510], [20, 21]) + &contextual(714, 712, 710),
        usage(720, NEXT, "#600,#100,$") + &relation(722, [110, 610], [20, 21]) + &contextual(724, 722, 720),
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
        + &usage(600, NEXT, "#500,#100,$")
        + &relation(602, [110, 510], [20, 21])
        + &contextual(604, 602, 600);
    let below = usage(610, NEXT, "#200,#500,$") + &relation(612, [510, 300], [20, 22]) + &contextual(614, 612, 610);
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
    assert!(told[0].ends_with("#620: promises product #100, which other usages put into #200: these count alone"));
}

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

//! How often, and where, a part of an assembly stands that several entities of the file speak of.

use crate::files::{MILLIMETRES, part21};
use crate::products::{NEXT, contextual, placed_usage, product, relation, usage};
use lampyris::step::{ErrorKind, Import, Settings, read_bytes};

/// Placements #20 at the origin, #21 at x = 10, #22 at x = 20 and #23 at x = 30, and a block #24 of 1 mm at the origin.
pub(crate) fn read(data: &str) -> Import {
    let text = part21(&format!(
        "{MILLIMETRES}\
         #10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=CARTESIAN_POINT('',(10.,0.,0.));\n#12=CARTESIAN_POINT('',(20.,0.,0.));\n\
         #13=DIRECTION('',(0.,0.,1.));\n#14=DIRECTION('',(1.,0.,0.));\n#15=CARTESIAN_POINT('',(30.,0.,0.));\n\
         #20=AXIS2_PLACEMENT_3D('',#10,#13,#14);\n#21=AXIS2_PLACEMENT_3D('',#11,#13,#14);\n\
         #22=AXIS2_PLACEMENT_3D('',#12,#13,#14);\n#23=AXIS2_PLACEMENT_3D('',#15,#13,#14);\n\
         #25=BLOCK('',#20,1.,1.,1.);\n#24=CSG_SOLID('',#25);\n\
         {data}"
    ));
    read_bytes("assemblies.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// An assembly #200, whose representation #300 has `items`, #21 and #22, and a part #100, whose representation #110 is the block.
pub(crate) fn assembly(items: &str, data: &str) -> Import {
    let products = product(200, "asm", 300) + &product(100, "part", 110);
    read(&format!(
        "{products}#300=SHAPE_REPRESENTATION('',({items}#21,#22),#1);\n\
         #110=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#24,#20),#1);\n{data}"
    ))
}

/// The place of the part in the assembly by usage #400, at x = 10.
const PLACED: &str = "#420=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#410,#401);\n";

/// Asserts the x of all places, in any order, and that nothing is reported.
pub(crate) fn assert_places(import: &Import, expected: &[f64], case: &str) {
    let mut x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
    x.sort_by(f64::total_cmp);
    assert_eq!(x, expected, "{case}");
    assert_eq!(import.report.problems, Vec::<String>::new(), "{case}");
}

#[test]
fn several_ways_of_relationships_lead_to_one_shape() {
    let linked = |relations: &str| {
        read(&format!(
            "{}#110=SHAPE_REPRESENTATION('',(#20),#1);\n#111=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#24,#20),#1);\n\
             #112=SHAPE_REPRESENTATION('third',(#20),#1);\n#120=SHAPE_REPRESENTATION_RELATIONSHIP('','',#110,#111);\n{relations}",
            product(100, "part", 110)
        ))
    };
    for relations in [
        "#121=SHAPE_REPRESENTATION_RELATIONSHIP('','',#110,#111);\n",
        "#121=SHAPE_REPRESENTATION_RELATIONSHIP('','',#111,#110);\n",
        "#121=SHAPE_REPRESENTATION_RELATIONSHIP('','',#110,#112);\n#122=SHAPE_REPRESENTATION_RELATIONSHIP('','',#111,#112);\n",
    ] {
        let import = linked(relations);
        assert_places(&import, &[0.0], relations);
        assert_eq!(import.model.placed_face_count(), 6, "{relations}");
    }
}

/// The mapped item at x = 10 says what the usage says; that at x = 20 is another place of the part.
#[test]
fn a_usage_and_a_mapped_item_in_one_place_are_one() {
    let mapped = "#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#21);\n#32=MAPPED_ITEM('',#30,#22);\n";
    let data = [mapped, &placed_usage(400, [200, 100], [110, 300], [20, 21])].concat();
    assert_places(&assembly("#31,", &data), &[10.0], "one place");
    assert_places(&assembly("#31,#32,", &data), &[10.0, 20.0], "two places");
}

/// The usage and the mapped item give one place with other numbers of digits; a thousandth of a millimetre, or of a radian, is another.
#[test]
fn a_place_that_is_printed_with_few_digits_is_one() {
    let placement = |id: u32, x: &str, axis: &str| {
        let [point, direction] = [id + 1, id + 2];
        format!(
            "#{id}=AXIS2_PLACEMENT_3D('',#{point},#13,#{direction});\n#{point}=CARTESIAN_POINT('',({x},0.,0.));\n\
             #{direction}=DIRECTION('',({axis},0.));\n"
        )
    };
    // Cosine and sine of 30°, and of a milliradian more.
    let [axis, turned] = ["0.86602540378443865,0.5", "0.86552497066,0.50086577541"];
    for (x, axis, instances) in
        [("123.456726", axis, 1), ("123.4567", axis, 1), ("123.4577", axis, 2), ("123.456726", turned, 2)]
    {
        let data = [
            "#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#50);\n",
            &placement(40, "123.4567", "0.8660254,0.5"),
            &placement(50, x, axis),
            &placed_usage(400, [200, 100], [110, 300], [20, 40]),
        ]
        .concat();
        let import = assembly("#31,", &data);
        assert_eq!(import.model.instances.len(), instances, "{x} {axis}: {:?}", import.report.problems);
    }
}

#[test]
fn every_usage_of_a_component_places_it() {
    for (kind, ends) in [
        (NEXT, "#200,#100,$"),
        ("ASSEMBLY_COMPONENT_USAGE", "#200,#100,$"),
        ("PROMISSORY_USAGE_OCCURRENCE", "#200,#100,$"),
        ("QUANTIFIED_ASSEMBLY_COMPONENT_USAGE", "#200,#100,$,#430"),
    ] {
        let unit = "#430=MEASURE_WITH_UNIT(COUNT_MEASURE(1.),#431);\n#431=CONTEXT_DEPENDENT_UNIT(#432,'each');\n\
                    #432=DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.);\n";
        let data = usage(400, kind, ends) + &relation(410, [110, 300], [20, 21]) + PLACED + unit;
        assert_places(&assembly("", &data), &[10.0], kind);
    }
    // What is promised adds nothing to what is used.
    let promised = usage(440, "PROMISSORY_USAGE_OCCURRENCE", "#200,#100,$");
    let data = placed_usage(400, [200, 100], [110, 300], [20, 21]) + &promised;
    assert_places(&assembly("", &data), &[10.0], "a promise");
}

/// What counts a component, or is of no stated kind, means the occurrence beside it, which is placed or stands with its parent.
#[test]
fn a_usage_that_counts_a_component_adds_nothing_to_its_occurrences() {
    let placed = placed_usage(400, [200, 100], [110, 300], [20, 21]);
    let unplaced = usage(400, NEXT, "#200,#100,$");
    for (kind, ends) in
        [("QUANTIFIED_ASSEMBLY_COMPONENT_USAGE", "#200,#100,$,$"), ("ASSEMBLY_COMPONENT_USAGE", "#200,#100,$")]
    {
        let counted = usage(440, kind, ends);
        for data in [format!("{placed}{counted}"), format!("{counted}{placed}")] {
            let import = assembly("", &data);
            assert_places(&import, &[10.0], kind);
            // Of one occurrence there is nothing to be numbered.
            assert_eq!(import.model.instances[0].name, "part");
        }
        assert_places(&assembly("", &format!("{unplaced}{counted}")), &[0.0], kind);
        // One that is placed, or stands in another assembly, is an occurrence of its own.
        let own = usage(440, kind, ends) + &relation(450, [110, 300], [20, 22]) + &contextual(460, 450, 440);
        assert_places(&assembly("", &format!("{placed}{own}")), &[10.0, 20.0], kind);
        let elsewhere = product(500, "other", 510)
            + "#510=SHAPE_REPRESENTATION('',(#20),#1);\n"
            + &usage(440, kind, &ends.replace("#200", "#500"));
        assert_places(&assembly("", &format!("{placed}{elsewhere}")), &[0.0, 10.0], kind);
    }
}

/// Two items in two places are two occurrences; one that is listed in its place again is no third.
#[test]
fn each_mapped_item_of_a_usage_is_an_occurrence() {
    let placed_by = |items: &str| {
        let used = usage(400, NEXT, "#200,#100,$");
        let data = format!(
            "{used}#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#21);\n#34=MAPPED_ITEM('',#30,#22);\n\
             #35=MAPPED_ITEM('',#30,#22);\n#36=MAPPED_ITEM('',#30,#10);\n#32=SHAPE_REPRESENTATION('place',({items}),#1);\n\
             #33=SHAPE_DEFINITION_REPRESENTATION(#401,#32);\n"
        );
        assembly("", &data)
    };
    for items in ["#31,#34", "#34,#31,#35"] {
        let import = placed_by(items);
        assert_places(&import, &[10.0, 20.0], items);
        let mut names: Vec<&str> = import.model.instances.iter().map(|i| i.name.as_str()).collect();
        names.sort_unstable();
        assert_eq!(names, ["part:1", "part:2"]);
    }
    // One that cannot be read is reported, and the other stands.
    let broken = placed_by("#36,#34");
    assert_eq!(broken.model.instances.iter().map(|i| i.placement.origin.x).collect::<Vec<_>>(), [20.0]);
    let problems = &broken.report.problems;
    assert!(problems.iter().any(|p| p.contains("#36: its placement cannot be read")), "{problems:?}");
    // With nothing but that the part stands nowhere.
    assert_eq!(placed_by("#36").model.instances.len(), 0);
}

#[test]
fn a_placement_in_a_rare_form_counts() {
    let used = usage(400, NEXT, "#200,#100,$");
    let own_shape = "#30=REPRESENTATION_MAP(#20,#110);\n#31=MAPPED_ITEM('',#30,#21);\n#32=SHAPE_REPRESENTATION('place',(#31),#1);\n\
                     #33=SHAPE_DEFINITION_REPRESENTATION(#401,#32);\n";
    let simple = "#411=ITEM_DEFINED_TRANSFORMATION('','',#20,#21);\n\
                  #410=REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION('','',#110,#300,#411);\n";
    let swapped = relation(410, [300, 110], [20, 21]);
    let swapped_of_usage = [swapped.as_str(), PLACED].concat();
    let of_shapes = simple.replace("=REPRESENTATION_", "=SHAPE_REPRESENTATION_");
    for data in [own_shape, simple, &of_shapes, &swapped, &swapped_of_usage] {
        assert_places(&assembly("", &format!("{used}{data}")), &[10.0], data);
    }
    assert_places(&assembly("", &used), &[0.0], "without a placement");
}

/// An assembly #200 at x = 30 in #500; relationships put the part into it, one of which moves nothing. Placements that turn, as #27 by 30°,
/// leave rounding where they are taken back.
#[test]
fn a_transformation_that_moves_nothing_places_as_others_do() {
    let outer = product(500, "top", 510)
        + "#510=SHAPE_REPRESENTATION('',(#23),#1);\n"
        + &placed_usage(400, [500, 200], [300, 510], [20, 23]);
    let turned = "#26=DIRECTION('',(0.866025403784,0.5,0.));\n#27=AXIS2_PLACEMENT_3D('',#12,#13,#26);\n";
    let still = relation(430, [110, 300], [21, 21]);
    for (still, case) in
        [(still.clone(), "still"), (turned.to_owned() + &relation(430, [110, 300], [27, 27]), "turned")]
    {
        let inner = assembly("", &format!("{outer}{still}"));
        assert_eq!(inner.model.instances.len(), 1, "{case}");
        assert!((inner.model.instances[0].placement.origin.x - 30.0).abs() < 1e-12, "{case}");
        assert_eq!((inner.model.parts[0].name.as_str(), inner.report.problems.len()), ("part", 0), "{case}");
    }
    let both = still.clone() + &relation(440, [110, 300], [20, 21]);
    assert_places(&assembly("", &both), &[0.0, 10.0], "two relationships");
    // Beside a usage without a placement it says what the usage does, which gives the name.
    let named = "#400=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','lens','',#200,#100,$);\n";
    let import = assembly("", &format!("{named}{still}"));
    assert_places(&import, &[0.0], "a usage");
    assert_eq!(import.model.instances[0].name, "lens");
}

/// The relationship of a usage that is not in the file still says where its component stands, with all that is in it.
#[test]
fn a_relationship_without_its_usage_places_the_component() {
    let lost = "#401=PRODUCT_DEFINITION_SHAPE('','',#400);\n";
    let part = [lost, &relation(410, [110, 300], [20, 21]), PLACED].concat();
    let sub = product(500, "sub", 510)
        + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
        + &placed_usage(450, [500, 100], [110, 510], [20, 21])
        + lost
        + &relation(410, [510, 300], [20, 22])
        + PLACED;
    // A representation of no product stands by its relationship alone, the part with its assembly.
    let no_product = "#26=CSG_SOLID('',#25);\n#111=SHAPE_REPRESENTATION('',(#26,#20),#1);\n";
    let alone =
        [no_product, &usage(430, NEXT, "#200,#100,$"), lost, &relation(410, [111, 300], [20, 21]), PLACED].concat();
    let another = usage(400, NEXT, "#200,#100,$") + &relation(410, [110, 300], [20, 21]) + PLACED;
    let twice = another + "#421=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#410,#403);\n";
    let unrelated = usage(400, NEXT, "#200,#100,$") + "#420=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#410,#401);\n";
    for (data, expected, told) in [
        (
            &part,
            &[10.0][..],
            "#420: its usage #400 is not in the file; its relationship #410 places product #100 in #200 all the same",
        ),
        (
            &sub,
            &[30.0][..],
            "#420: its usage #400 is not in the file; its relationship #410 places product #500 in #200 all the same",
        ),
        (
            &alone,
            &[0.0, 10.0][..],
            "#420: its usage #400 is not in the file; its relationship #410 counts without it",
        ),
        (
            &twice,
            &[10.0][..],
            "#421: its PRODUCT_DEFINITION_SHAPE #403 is not in the file; its relationship #410 is that of another usage, which is used",
        ),
        (&unrelated, &[0.0][..], "#420: its relationship #410 is not in the file: it places nothing"),
    ] {
        let import = assembly("", data);
        let mut x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
        x.sort_by(f64::total_cmp);
        let problems = &import.report.problems;
        assert_eq!(x, expected, "{problems:?}");
        assert_eq!(problems.iter().filter(|p| p.ends_with(told)).count(), 1, "{told}: {problems:?}");
    }
}

/// The assembly #200 uses #500 at x = 20, which uses the part at x = 10: #440 sees the part from #200.
#[test]
fn a_higher_usage_adds_nothing() {
    let data = |to: u32| {
        product(500, "sub", 510)
            + "#510=SHAPE_REPRESENTATION('',(#20,#21),#1);\n"
            + &placed_usage(400, [200, 500], [510, 300], [20, 22])
            + &placed_usage(450, [500, 100], [110, 510], [20, 21])
            + &usage(440, "SPECIFIED_HIGHER_USAGE_OCCURRENCE", "#200,#100,$,#400,#450")
            + &relation(480, [110, 300], [20, to])
            + &contextual(490, 480, 440)
    };
    assert_places(&assembly("", &data(23)), &[30.0], "the same place");
    let other = assembly("", &data(21));
    assert_eq!(other.model.instances.len(), 1);
    let problems = &other.report.problems;
    assert!(
        problems.len() == 1 && problems[0].starts_with("assemblies.stp: #490: usage #440 has another place"),
        "{problems:?}"
    );
}

/// A part in so many assemblies around each other, each of which moves what is in it by 10 mm.
fn nested(levels: u32) -> Import {
    let mut data = product(100, "part", 110) + "#110=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#24,#20),#1);\n";
    let [mut child, mut inner] = [100, 110];
    for level in 0..levels {
        let id = 1000 + 20 * level;
        let [whole, target] = [id + 5, id + 6];
        data += &product(id, &format!("a{level}"), whole);
        data += &format!("#{whole}=SHAPE_REPRESENTATION('',(#20,#{target}),#1);\n");
        data += &format!("#{target}=AXIS2_PLACEMENT_3D('',#11,#13,#14);\n");
        data += &placed_usage(id + 7, [id, child], [inner, whole], [20, target]);
        [child, inner] = [id, whole];
    }
    read(&data)
}

#[test]
fn deep_assemblies_are_no_cycles() {
    for levels in [70, 1000] {
        assert_places(&nested(levels), &[10.0 * f64::from(levels)], &format!("{levels} levels"));
    }
    // Beyond the limit what is left out is reported, and stands nowhere else.
    let import = nested(1100);
    assert_eq!(import.model.instances.len(), 0);
    let told = import.report.problems.iter().filter(|p| p.contains("nested more than 1024 deep")).count();
    assert_eq!(told, 1, "{:?}", import.report.problems);
}

#[test]
fn products_in_a_circle_are_told() {
    let data = product(500, "b", 510) + "#510=SHAPE_REPRESENTATION('',(#24),#1);\n";
    let data = data + &usage(600, NEXT, "#200,#500,$") + &usage(602, NEXT, "#500,#200,$");
    let problems = assembly("", &data).report.problems;
    assert!(problems.iter().any(|p| p.ends_with("products contain each other")), "{problems:?}");
}

/// A part stands once, and the mapped item that would show it in itself is reported, as its own or by way of another representation.
#[test]
fn representations_in_a_circle_are_told() {
    let part = product(100, "part", 110)
        + "#110=SHAPE_REPRESENTATION('',(#24,#31,#20),#1);\n#31=MAPPED_ITEM('',#30,#21);\n";
    let direct = "#30=REPRESENTATION_MAP(#20,#110);\n";
    let indirect = "#30=REPRESENTATION_MAP(#20,#120);\n#120=SHAPE_REPRESENTATION('',(#33,#20),#1);\n\
        #32=REPRESENTATION_MAP(#20,#110);\n#33=MAPPED_ITEM('',#32,#21);\n";
    for (maps, item) in [(direct, 31), (indirect, 33)] {
        let import = read(&format!("{part}{maps}"));
        assert_eq!(import.model.instances.len(), 1, "{maps}");
        let told = format!("assemblies.stp: #{item}: this MAPPED_ITEM shows #110 in itself; that is left out");
        assert_eq!(import.report.problems, [told], "{maps}");
    }
}

/// So many products that each use all the others, each with a block of its own.
fn knot(products: u32) -> String {
    let mut data = String::new();
    for a in 0..products {
        let id = 1000 + 100 * a;
        let [shape, solid] = [id + 5, id + 6];
        data += &product(id, &format!("p{a}"), shape);
        data += &format!("#{shape}=SHAPE_REPRESENTATION('',(#{solid}),#1);\n#{solid}=CSG_SOLID('',#25);\n");
        for b in (0..products).filter(|b| *b != a) {
            data += &usage(id + 10 + 2 * b, NEXT, &format!("#{id},#{},$", 1000 + 100 * b));
        }
    }
    data
}

/// From the first of four there are 1 + 3 + 3·2 + 3·2·1 ways that meet no product twice, each of which places a block. Those of fourteen
/// are more than 10¹⁰: the walk ends at the first visit beyond the limit.
#[test]
fn products_in_circles_are_placed_on_every_way_to_them() {
    let import = read(&knot(4));
    assert_eq!(import.model.instances.len(), 16);
    let told = import.report.problems.iter().filter(|p| p.ends_with("products contain each other")).count();
    assert_eq!((told, import.report.problems.len()), (4, 4), "{:?}", import.report.problems);
    let text = part21(&format!("{MILLIMETRES}#24=CSG_SOLID('',#25);\n{}", knot(14)));
    let settings = Settings { max_placed: 10_000, ..Settings::default() };
    let refused = read_bytes("knot.stp", text.as_bytes(), &settings).expect_err("too many");
    assert!(matches!(refused.kind(), ErrorKind::TooManyPlaced { count: 10_001, .. }), "{refused}");
}

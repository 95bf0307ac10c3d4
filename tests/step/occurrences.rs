//! Where the parts of assemblies stand that files describe in rare forms, or in part, and what colour each place shows.

use crate::files::{MILLIMETRES, part21};
use crate::products::{contextual, definition, relation};
use lampyris::step::{Import, Settings, read_bytes};

/// Two products: #101 with representation #103, which has `items` and two placements, #21 at x = 100 and #22 at x = 200; #102, `part`, with
/// representation #106 of a block of 10 mm at the origin, #24. `data` relates them.
fn read(items: &str, data: &str) -> Import {
    let text = part21(&format!(
        "{MILLIMETRES}\
         #10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=CARTESIAN_POINT('',(100.,0.,0.));\n#12=CARTESIAN_POINT('',(200.,0.,0.));\n\
         #13=DIRECTION('',(0.,0.,1.));\n#14=DIRECTION('',(1.,0.,0.));\n#20=AXIS2_PLACEMENT_3D('',#10,#13,#14);\n\
         #21=AXIS2_PLACEMENT_3D('',#11,#13,#14);\n#22=AXIS2_PLACEMENT_3D('',#12,#13,#14);\n#23=BLOCK('',#20,10.,10.,10.);\n\
         #24=CSG_SOLID('',#23);\n#101=PRODUCT_DEFINITION('','',#121,$);\n#121=PRODUCT_DEFINITION_FORMATION('','',#131);\n\
         #131=PRODUCT('asm','asm','',());\n#103=SHAPE_REPRESENTATION('',({items}#21,#22),#1);\n#104=PRODUCT_DEFINITION_SHAPE('','',#101);\n\
         #105=SHAPE_DEFINITION_REPRESENTATION(#104,#103);\n\
         #102=PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS('','',#122,$,());\n#122=PRODUCT_DEFINITION_FORMATION('','',#132);\n\
         #132=PRODUCT('part','part','',());\n#106=SHAPE_REPRESENTATION('',(#24,#20),#1);\n#107=PRODUCT_DEFINITION_SHAPE('','',#102);\n\
         {data}"
    ));
    read_bytes("assembly.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// The shape of the part; a usage of it, #110, whose shape is #111; a relation that puts it at x = 100, #109; and that it does for the
/// usage.
const SHAPE: &str = "#108=SHAPE_DEFINITION_REPRESENTATION(#107,#106);\n";
const USAGE: &str =
    "#110=NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','u','',#101,#102,$);\n#111=PRODUCT_DEFINITION_SHAPE('','',#110);\n";
const RELATION: &str = "#112=ITEM_DEFINED_TRANSFORMATION('','',#20,#21);\n\
                        #109=(REPRESENTATION_RELATIONSHIP('','',#106,#103)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#112)\
                        SHAPE_REPRESENTATION_RELATIONSHIP());\n";
const PLACED: &str = "#113=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#109,#111);\n";

/// Asserts the x of all places of the block, in any order.
fn assert_places(import: &Import, expected: &[f64]) {
    let mut x: Vec<f64> = import.model.instances.iter().map(|i| i.placement.origin.x).collect();
    x.sort_by(f64::total_cmp);
    assert_eq!(x, expected, "{:?} {:?}", import.report.problems, import.report.names);
}

#[test]
fn complex_usages_and_shape_definitions_place_as_simple_ones_do() {
    let usage = "#110=(ASSEMBLY_COMPONENT_USAGE($)NEXT_ASSEMBLY_USAGE_OCCURRENCE()PRODUCT_DEFINITION_RELATIONSHIP('1','u','',#101,#102)\
                 PRODUCT_DEFINITION_USAGE());\n#111=PRODUCT_DEFINITION_SHAPE('','',#110);\n";
    let shape = "#108=(PROPERTY_DEFINITION_REPRESENTATION(#107,#106)SHAPE_DEFINITION_REPRESENTATION());\n";
    for (usage, shape) in [(USAGE, SHAPE), (usage, SHAPE), (USAGE, shape)] {
        let import = read("", &[shape, usage, RELATION, PLACED].concat());
        assert_places(&import, &[100.0]);
        assert_eq!(import.report.problems, Vec::<String>::new());
        let names = (import.model.instances[0].name.as_str(), import.model.parts[0].name.as_str());
        assert_eq!(names, ("u", "part"));
    }
}

/// AP214 places by mapped items and lists the usages beside them, without places of their own.
#[test]
fn a_usage_beside_a_mapped_item_places_nothing_more() {
    let mapped = "#30=REPRESENTATION_MAP(#20,#106);\n#31=MAPPED_ITEM('',#30,#21);\n#32=MAPPED_ITEM('',#30,#22);\n\
                  #114=NEXT_ASSEMBLY_USAGE_OCCURRENCE('2','v','',#101,#102,$);\n";
    assert_places(&read("#31,#32,", &[SHAPE, USAGE, mapped].concat()), &[100.0, 200.0]);
    // Where nothing maps it, it stands where its parent does.
    assert_places(&read("", &[SHAPE, USAGE].concat()), &[0.0]);
}

/// A relationship that moves the part places it, with a usage that names it or without one.
#[test]
fn what_a_relationship_places_stands_once() {
    assert_places(&read("", &[SHAPE, RELATION].concat()), &[100.0]);
    assert_places(&read("", &[SHAPE, USAGE, RELATION].concat()), &[100.0]);
    for (broken, told) in [
        (PLACED.replace("#109", "#9999"), "#113: its relationship #9999 is not in the file: it places nothing"),
        (
            PLACED.replace("#111", "$"),
            "#113: it names no PRODUCT_DEFINITION_SHAPE; usage #110, which has no place, takes that of its relationship #109",
        ),
    ] {
        let import = read("", &[SHAPE, USAGE, RELATION, &broken].concat());
        assert_places(&import, &[100.0]);
        assert!(import.report.problems.iter().any(|p| p.ends_with(told)), "{:?}", import.report.problems);
    }
}

#[test]
fn a_second_place_of_one_usage_is_told() {
    let second = relation(209, [106, 103], [20, 22]) + &contextual(213, 209, 110);
    let import = read("", &[SHAPE, USAGE, RELATION, PLACED, &second].concat());
    assert_places(&import, &[100.0]);
    assert!(
        import.report.problems.iter().any(|p| p.starts_with("assembly.stp: #213: usage #110")),
        "{:?}",
        import.report.problems
    );
}

/// A second place of the part, which is green.
const SECOND_PLACE: &str = "#210=NEXT_ASSEMBLY_USAGE_OCCURRENCE('2','v','',#101,#102,$);\n#211=PRODUCT_DEFINITION_SHAPE('','',#210);\n\
    #212=ITEM_DEFINED_TRANSFORMATION('','',#20,#22);\n\
    #209=(REPRESENTATION_RELATIONSHIP('','',#106,#103)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#212)\
    SHAPE_REPRESENTATION_RELATIONSHIP());\n#213=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#209,#211);\n\
    #300=STYLED_ITEM('',(#301),#24);\n#301=PRESENTATION_STYLE_ASSIGNMENT((#302));\n#302=COLOUR_RGB('',0.,1.,0.);\n";

/// A green part in two places, the second of which is red: as translators of OpenCASCADE write it.
#[test]
fn a_colour_of_one_occurrence_is_not_that_of_all() {
    let second = "#310=OVER_RIDING_STYLED_ITEM('',(#311),#24,#300);\n#312=COLOUR_RGB('',1.,0.,0.);\n";
    let by_shape = "#311=PRESENTATION_STYLE_BY_CONTEXT((#312),#320);\n#320=SHAPE_REPRESENTATION('',(#22),#1);\n\
                    #321=SHAPE_DEFINITION_REPRESENTATION(#211,#320);\n";
    let by_place = "#311=PRESENTATION_STYLE_BY_CONTEXT((#312),#213);\n";
    for context in [by_shape, by_place] {
        let import = read("", &[SHAPE, USAGE, RELATION, PLACED, SECOND_PLACE, second, context].concat());
        let model = &import.model;
        let colour_at = |x: f64| {
            let here = |f: &lampyris::model::PlacedFace<'_>| f.placement.origin.x == x;
            model.placed_faces().find(here).and_then(|f| f.colour(model)).map(|c| c.0)
        };
        assert_eq!(colour_at(100.0), Some([0.0, 1.0, 0.0]));
        assert_eq!(colour_at(200.0), Some([1.0, 0.0, 0.0]));
    }
}

/// A part in two places, of which a path of relationships gives one another colour: as Autodesk's translators write it. Another solid of
/// the part, #26, stands in a representation that is related to the part's own.
#[test]
fn a_colour_of_a_path_is_that_of_one_occurrence() {
    let second = "#311=PRESENTATION_STYLE_ASSIGNMENT((#312));\n#312=COLOUR_RGB('',1.,0.,0.);\n\
                  #313=STYLED_ITEM('',(#314),#315);\n#314=PRESENTATION_STYLE_ASSIGNMENT((NULL_STYLE(.NULL.)));\n\
                  #25=BLOCK('',#20,5.,5.,20.);\n#26=CSG_SOLID('',#25);\n#303=STYLED_ITEM('',(#301),#26);\n\
                  #127=SHAPE_REPRESENTATION_RELATIONSHIP('','',#106,#126);\n";
    let simple = "#126=CSG_SHAPE_REPRESENTATION('',(#26),#1);\n";
    let complex = "#126=(CSG_SHAPE_REPRESENTATION()REPRESENTATION('',(#26),#1)SHAPE_REPRESENTATION());\n";
    // The path leads to the second place; one through a relationship that is not around it leads nowhere. The style may name either
    // representation.
    let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    for (styled, shape, path, expected) in [
        ("#106", simple, "#209", red),
        ("#106", simple, "#109,#209", green),
        ("#126", simple, "#209", red),
        ("#126", complex, "#209", red),
    ] {
        let style = format!("#310=CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM('',(#311),{styled},#313,({path}));\n");
        let model = read("", &[SHAPE, USAGE, RELATION, PLACED, SECOND_PLACE, second, shape, &style].concat()).model;
        for (x, expected) in [(100.0, green), (200.0, expected)] {
            let here = model.placed_faces().filter(|f| f.placement.origin.x == x);
            let colours: Vec<_> = here.map(|f| f.colour(&model).map(|c| c.0)).collect();
            assert_eq!(colours, [Some(expected); 12], "{styled} {shape} {path} {x}");
        }
    }
}

/// A shape that no product names is placed where it is, whatever its representation calls itself.
#[test]
fn shapes_of_no_product_are_placed() {
    let orphan = "#400=AXIS2_PLACEMENT_3D('',#12,#13,#14);\n#401=BLOCK('',#400,10.,10.,10.);\n";
    for kind in ["SHAPE_REPRESENTATION", "SHAPE_REPRESENTATION_WITH_PARAMETERS"] {
        let import =
            read("", &[SHAPE, USAGE, RELATION, PLACED, orphan, &format!("#402={kind}('',(#401),#1);\n")].concat());
        assert_eq!(
            (import.model.placed_face_count(), import.report.bbox_mm.map(|b| b[1][0])),
            (12, Some(210.0)),
            "{kind}"
        );
    }
}

/// Each place has a path of its own through the assemblies around it; alike ones are numbered in the file's order.
#[test]
fn places_have_paths_of_their_own() {
    let sub = "#210=NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','A','',#101,#201,$);\n\
               #211=NEXT_ASSEMBLY_USAGE_OCCURRENCE('2','B','',#101,#201,$);\n\
               #212=NEXT_ASSEMBLY_USAGE_OCCURRENCE('3','b1','',#201,#102,$);\n\
               #213=NEXT_ASSEMBLY_USAGE_OCCURRENCE('4','b1','',#201,#102,$);\n";
    let import = read("", &[SHAPE, &definition(201, "sub"), sub].concat());
    let paths: Vec<&str> = import.model.instances.iter().map(|i| i.path.as_str()).collect();
    assert_eq!(paths, ["A/b1", "A/b1:2", "B/b1", "B/b1:2"]);
    assert_eq!(import.model.labels(), paths);
}

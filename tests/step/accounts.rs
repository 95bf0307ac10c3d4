//! What an import says of its file: faces one by one, and what is no shape of a product.

use crate::faces::{import, read, square};
use crate::files::{MILLIMETRES, part21};
use crate::products::{NEXT, contextual, product, usage};
use lampyris::model::SurfaceKind;
use lampyris::step::{Import, Settings, read_bytes};

const FORWARD: [&str; 4] = [".T."; 4];
const IN_ORDER: [usize; 4] = [0, 1, 2, 3];

#[test]
fn a_face_tells_its_layer_kind_area_and_a_point_on_it() {
    let import = import(&(square(FORWARD, IN_ORDER) + "#100=PRESENTATION_LAYER_ASSIGNMENT('glass','',(#900));\n"));
    let account = import.model.account();
    assert_eq!((account.len(), account[0].instances, account[0].solids.len()), (1, 1, 1));
    let solid = &account[0].solids[0];
    let face = &solid.faces[0];
    assert_eq!((solid.index, solid.closed, solid.faces.len()), (0, false, 1));
    assert_eq!((face.id, face.kind, face.layer.as_deref()), (Some(900), SurfaceKind::Plane, Some("glass")));
    assert!((face.area_mm2 - 1.0).abs() < 1e-12 && face.radius_mm.is_none());
    let [x, y, z] = face.at;
    assert!(x > 0.1 && x < 0.9 && y > 0.1 && y < 0.9 && z == 0.0, "{:?}", face.at);
    let placed = import.model.placed_faces().next().expect("a face");
    assert_eq!((placed.solid, placed.layer(), placed.kind()), (0, Some("glass"), SurfaceKind::Plane));
    let text = serde_json::to_value(&account).expect("JSON");
    assert_eq!(text[0]["solids"][0]["faces"][0]["kind"], "plane");
}

/// A file whose instances all come again, with the same numbers, has each of them once.
#[test]
fn instances_that_come_again_are_placed_once() {
    let data = square(FORWARD, IN_ORDER) + &product(100, "part", 6);
    let once = import(&data);
    let twice = read(&format!("{data}{data}"));
    assert_eq!([once.model.placed_face_count(), twice.model.placed_face_count()], [1, 1]);
    assert!(twice.report.problems.iter().any(|p| p.contains("#900") && p.contains("earlier instance")));
}

#[test]
fn the_shape_of_an_aspect_is_no_second_face() {
    let aspect = "#103=SHAPE_ASPECT('','',#113,.T.);\n#104=PROPERTY_DEFINITION('','Geometry of datum',#103);\n\
                  #105=SHAPE_REPRESENTATION('',(#900),#1);\n#106=SHAPE_DEFINITION_REPRESENTATION(#104,#105);\n";
    let import = import(&(square(FORWARD, IN_ORDER) + &product(110, "part", 6) + aspect));
    assert_eq!(import.model.placed_face_count(), 1);
    let left: Vec<(u64, &str)> = import.report.left_out.iter().map(|n| (n.id, n.entity.as_str())).collect();
    assert_eq!(left, [(105, "SHAPE_REPRESENTATION")]);
    assert!(import.report.left_out[0].reason.contains("#103 SHAPE_ASPECT"), "{:?}", import.report.left_out);
}

#[test]
fn parts_of_edges_and_faces_have_the_geometry_of_their_parents() {
    // The lower half of the square: its sides are parts of the square's, its bounds are its own.
    let half = "#14=CARTESIAN_POINT('',(0.,0.5,0.));\n#15=CARTESIAN_POINT('',(1.,0.5,0.));\n\
                #34=VERTEX_POINT('',#14);\n#35=VERTEX_POINT('',#15);\n\
                #101=SUBEDGE('',#31,#35,#41);\n#102=EDGE_CURVE('',#35,#34,$,.T.);\n#103=SUBEDGE('',#34,#30,#43);\n\
                #111=ORIENTED_EDGE('',*,*,#101,.T.);\n#112=ORIENTED_EDGE('',*,*,#102,.T.);\n#113=ORIENTED_EDGE('',*,*,#103,.T.);\n\
                #120=EDGE_LOOP('',(#50,#111,#112,#113));\n#121=FACE_OUTER_BOUND('',#120,.T.);\n#900=SUBFACE('',(#121),#901);\n";
    let import = import(&(square(FORWARD, IN_ORDER).replace("#900=", "#901=") + half));
    let account = import.model.account();
    let face = &account[0].solids[0].faces[0];
    assert!((face.area_mm2 - 0.5).abs() < 1e-12, "{} {:?}", face.area_mm2, import.report.refusals);
    // Its four edges meet in the four corners, each in the one that it names.
    let part = &import.model.parts[0];
    let mut ends: Vec<_> =
        part.edges.iter().flat_map(|e| e.vertices).map(|v| part.vertices[v.0 as usize]).collect();
    ends.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    let corner = |x: f64, y: f64| lampyris::math::Point::new(x, y, 0.0);
    let corners = [corner(0.0, 0.0), corner(0.0, 0.5), corner(1.0, 0.0), corner(1.0, 0.5)];
    assert_eq!(ends, corners.map(|c| [c, c]).concat());
}

#[test]
fn a_colour_is_found_beside_a_reference_that_leads_nowhere() {
    let style = "#100=STYLED_ITEM('',(#101),#900);\n#101=PRESENTATION_STYLE_ASSIGNMENT((#999,#102));\n\
                 #102=COLOUR_RGB('',0.25,0.5,0.75);\n";
    let import = read(&(square(FORWARD, IN_ORDER) + style));
    let part = &import.model.parts[0];
    let face = &part.shells[0].faces[0];
    assert_eq!(face.colour.map(|c| c.0), Some([0.25, 0.5, 0.75]));
    assert_eq!(crate::support::violations(part, face), Vec::<String>::new());
    // The reference is reported, and nothing else.
    let problems = &import.report.problems;
    assert!(problems.len() == 1 && problems[0].contains("#999"), "{problems:?}");
}

/// Scaled 2.5 times, mirrored in y and moved to (1, 1, 0), with the name and description of a transformation and without.
#[test]
fn an_operator_places_what_a_relationship_names() {
    for names in ["''", "'',''", "'','',$"] {
        let axes =
            "#120=DIRECTION('',(1.,0.,0.));\n#121=DIRECTION('',(0.,-1.,0.));\n#122=DIRECTION('',(0.,0.,1.));\n";
        let operator = format!("CARTESIAN_TRANSFORMATION_OPERATOR_3D({names},#120,#121,#12,2.5,#122)");
        assert_square_in_box(&placed_by(axes, &operator), [1.0, -1.5, 0.0, 3.5, 1.0, 0.0]);
    }
}

/// ISO 10303-42, `first_proj_axis`: without its first axis an operator takes the space's X, projected, also where the third is nearly along
/// it. The axes are x = (0.28, −0.96, 0), y = −Z, z = (0.96, 0.28, 0).
#[test]
fn an_operator_without_a_first_axis_takes_the_projection_of_x() {
    let operator = "CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#12,1.,#122)";
    let placed = placed_by("#122=DIRECTION('',(0.96,0.28,0.));\n", operator);
    assert_square_in_box(&placed, [1.0, 0.04, -1.0, 1.28, 1.0, 0.0]);
}

#[test]
fn an_operator_of_two_dimensions_is_refused_in_either_form() {
    for operator in [
        "CARTESIAN_TRANSFORMATION_OPERATOR_2D('','',$,$,$,#12,2.)",
        "(CARTESIAN_TRANSFORMATION_OPERATOR($,$,#12,2.)CARTESIAN_TRANSFORMATION_OPERATOR_2D()\
         GEOMETRIC_REPRESENTATION_ITEM()REPRESENTATION_ITEM(''))",
    ] {
        let problems = read(&placed_text("", operator)).report.problems;
        assert!(problems[0].contains(": #109: its transformation cannot be read"), "{problems:?}");
    }
}

/// Reads the square as a part that an operator places in an assembly; `axes` are the statements that it names.
fn placed_by(axes: &str, operator: &str) -> Import {
    import(&placed_text(axes, operator))
}

/// The square as a part that an operator places in an assembly.
fn placed_text(axes: &str, operator: &str) -> String {
    let assembly = format!(
        "{axes}#108={operator};\n#100=AXIS2_PLACEMENT_3D('',#12,$,$);\n#103=SHAPE_REPRESENTATION('',(#100),#1);\n\
         #109=(REPRESENTATION_RELATIONSHIP('','',#6,#103)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#108)\
         SHAPE_REPRESENTATION_RELATIONSHIP());\n"
    );
    let products = product(130, "asm", 103) + &product(140, "part", 6);
    let used = usage(110, NEXT, "#130,#140,$") + &contextual(112, 109, 110);
    square(FORWARD, IN_ORDER) + &assembly + &products + &used
}

/// Asserts that the file had no problems, and that its shape fills a box, given by both corners, mm.
fn assert_square_in_box(placed: &Import, expected: [f64; 6]) {
    assert_eq!(placed.report.problems, Vec::<String>::new());
    let [lo, hi] = placed.report.bbox_mm.expect("a face");
    for (got, expected) in lo.into_iter().chain(hi).zip(expected) {
        assert!((got - expected).abs() < 1e-12, "{lo:?} {hi:?}");
    }
}

#[test]
fn what_a_broken_transformation_places_is_named_and_left_out() {
    // The square as a child in an assembly; the second placement of the transformation is #100, or none at all.
    let assembly = |to: &str| {
        let related = format!(
            "#100=AXIS2_PLACEMENT_3D('',#12,$,$);\n#103=SHAPE_REPRESENTATION('',(#100),#1);\n\
             #108=ITEM_DEFINED_TRANSFORMATION('','',#20,{to});\n\
             #109=(REPRESENTATION_RELATIONSHIP('','',#6,#103)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#108)\
             SHAPE_REPRESENTATION_RELATIONSHIP());\n"
        );
        product(130, "asm", 103) + &related
    };
    let used = product(140, "part", 6) + &usage(110, NEXT, "#130,#140,$") + &contextual(112, 109, 110);
    // By the usage of a product, and by the relationship alone.
    for usage in [used.as_str(), ""] {
        let whole = import(&(square(FORWARD, IN_ORDER) + &assembly("#100") + usage));
        assert_eq!(whole.report.bbox_mm, Some([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0]]));
        for to in ["#999", "$"] {
            let broken = read(&(square(FORWARD, IN_ORDER) + &assembly(to) + usage));
            let problems = &broken.report.problems;
            assert!(
                problems.iter().any(|p| p.contains(": #109: its transformation cannot be read")),
                "{problems:?}"
            );
            assert_eq!(broken.model.placed_face_count(), 0);
        }
    }
}

/// Two places of a lens and one of a ring, under names that say nothing (blank, a translator's default, one for all) and under good ones.
#[test]
fn places_without_a_name_of_their_own_are_named_by_their_products() {
    let products = "#101=PRODUCT_DEFINITION('','',$,$);\n#102=PRODUCT_DEFINITION('','',#122,$);\n#103=PRODUCT_DEFINITION('','',#123,$);\n\
                    #122=PRODUCT_DEFINITION_FORMATION('','',#132);\n#132=PRODUCT('7','lens ','',());\n\
                    #123=PRODUCT_DEFINITION_FORMATION('','',#133);\n#133=PRODUCT('ring',' ','',());\n\
                    #104=PRODUCT_DEFINITION_SHAPE('','',#102);\n#105=SHAPE_DEFINITION_REPRESENTATION(#104,#6);\n\
                    #106=PRODUCT_DEFINITION_SHAPE('','',#103);\n#107=SHAPE_DEFINITION_REPRESENTATION(#106,#206);\n\
                    #206=SHAPE_REPRESENTATION('',(#901),#1);\n";
    let text = square(FORWARD, IN_ORDER);
    let face = text.lines().find_map(|l| l.strip_prefix("#900=")).expect("the face");
    let by_product = ["lens:1", "lens:2", "ring"];
    for (names, expected) in [
        ([" ", "", " "], by_product),
        (["Next assembly relationship"; 3], by_product),
        (["part"; 3], by_product),
        (["front", "back", "rim "], ["front", "back", "rim"]),
        (["Next assembly relationship", "back", "rim"], ["lens", "back", "rim"]),
    ] {
        let usages: String = [102, 102, 103]
            .iter()
            .zip(names)
            .enumerate()
            .map(|(k, (child, name))| {
                format!("#{}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('{k}','{name}','',#101,#{child},$);\n", 300 + k)
            })
            .collect();
        let import = import(&format!("{text}#901={face}\n{products}{usages}"));
        let found: Vec<&str> = import.model.instances.iter().map(|i| i.name.as_str()).collect();
        assert_eq!(found, expected, "{names:?}");
        let parts: Vec<&str> = import.model.parts.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(parts, ["lens", "ring"]);
    }
}

/// An assembly whose parts are in files of their own names them; drawings and the file itself hold no shapes of it.
#[test]
fn files_that_hold_shapes_of_an_assembly_are_named() {
    let others = "#100=DOCUMENT_FILE('Lens.STP','','',#103,'',$);\n#101=DOCUMENT_FILE('lens.pdf','','',#103,'',$);\n\
                  #102=DOCUMENT_FILE('face.stp','','',#103,'',$);\n#103=DOCUMENT_TYPE('geometry');\n";
    let import = import(&(square(FORWARD, IN_ORDER) + others));
    let left: Vec<u64> = import.report.left_out.iter().map(|n| n.id).collect();
    assert_eq!(left, [100]);
    assert!(import.report.left_out[0].reason.contains("shapes are in Lens.STP"), "{:?}", import.report.left_out);
}

/// Extent in x of each instance, rising, of a block #10 that the representations #20 and #21 both name, where `mapped` are the items of the
/// root.
fn places_of_blocks(mapped: &str) -> Vec<[f64; 2]> {
    let text = part21(&format!(
        "{MILLIMETRES}\
         #5=CARTESIAN_POINT('',(0.,0.,0.));\n#6=DIRECTION('',(0.,0.,1.));\n#7=DIRECTION('',(1.,0.,0.));\n\
         #8=AXIS2_PLACEMENT_3D('',#5,#6,#7);\n#9=AXIS2_PLACEMENT_3D('',#15,#6,#7);\n#15=CARTESIAN_POINT('',(100.,0.,0.));\n\
         #10=BLOCK('',#8,10.,10.,10.);\n\
         #20=SHAPE_REPRESENTATION('A',(#8,#10),#1);\n#21=SHAPE_REPRESENTATION('B',(#8,#10),#1);\n\
         #22=REPRESENTATION_MAP(#8,#20);\n#23=REPRESENTATION_MAP(#8,#21);\n\
         #30=MAPPED_ITEM('',#22,#8);\n#31=MAPPED_ITEM('',#23,#8);\n#32=MAPPED_ITEM('',#23,#9);\n\
         #40=SHAPE_REPRESENTATION('',({mapped}),#1);\n"
    ));
    let import = read_bytes("blocks.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
    assert_eq!(import.report.faces_placed.found, import.report.faces_placed.converted);
    let mut boxes: Vec<[f64; 2]> = import
        .model
        .instances
        .iter()
        .map(|i| {
            let part = import.model.part(i.part);
            assert_eq!(part.face_count(), 6);
            let xs = part.vertices.iter().map(|v| i.placement.point(*v).x);
            xs.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
        })
        .collect();
    boxes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    boxes
}

#[test]
fn a_shape_that_two_representations_name_stands_once_in_each_place() {
    let (here, there) = ([0.0, 10.0], [100.0, 110.0]);
    // Twice in one place and once elsewhere, in any order; the second representation alone elsewhere; the first twice.
    for mapped in ["#30,#31,#32", "#30,#32,#31", "#32,#31,#30", "#31,#32,#30", "#30,#32"] {
        assert_eq!(places_of_blocks(mapped), [here, there], "{mapped}");
    }
    assert_eq!(places_of_blocks("#30,#31"), [here]);
    assert_eq!(places_of_blocks("#31,#32"), [here, there]);
}

//! What files say in rare forms, or wrongly, is read right or refused by name: nothing is lost, added or moved in silence.

use crate::files::{MILLIMETRES, part21};
use crate::support::measure_model;
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::PI;

/// A representation of item #900 in millimetres and radians; #10 is the origin, #11 to #13 are x, y and z, #14 is a placement there.
pub(crate) fn read(data: &str) -> Import {
    read_sections("", "#900", data)
}

/// The same of these items, in a file with other sections before its data.
pub(crate) fn read_sections(sections: &str, items: &str, data: &str) -> Import {
    let text = part21(&format!(
        "{MILLIMETRES}\
         #6=SHAPE_REPRESENTATION('',({items}),#1);\n#10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=DIRECTION('',(1.,0.,0.));\n\
         #12=DIRECTION('',(0.,1.,0.));\n#13=DIRECTION('',(0.,0.,1.));\n#14=AXIS2_PLACEMENT_3D('',#10,#13,#11);\n\
         {data}"
    ));
    let text = text.replacen("DATA;", &format!("{sections}DATA;"), 1);
    read_bytes("silence.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// The area of what is read, of which nothing is refused.
pub(crate) fn area(import: &Import) -> f64 {
    assert_eq!(import.report.faces.refused, 0, "{:?}", import.report.refusals);
    measure_model(&import.model).area
}

pub(crate) fn close(a: f64, b: f64, relative: f64) {
    assert!((a / b - 1.0).abs() < relative, "{a} for {b}");
}

/// Asserts that all there is was refused, for this reason.
pub(crate) fn assert_refused(data: &str, reason: &str) {
    let import = read(data);
    assert_eq!(import.model.placed_face_count(), 0, "{data}");
    let refusals = &import.report.refusals;
    assert!(refusals.iter().any(|r| r.reason.contains(reason)), "{data}: {refusals:?}");
}

/// Surface #20 of `record` between its parameters.
pub(crate) fn trimmed(record: &str, ranges: &str) -> String {
    format!("{record}#900=GEOMETRIC_SET('',(#901));\n#901=RECTANGULAR_TRIMMED_SURFACE('',#20,{ranges},.T.,.T.);\n")
}

/// A line through (10, 0, 5) that is turned about z, or moved along it by three for each unit of v.
fn swept_line(direction: &str, revolved: bool) -> String {
    let surface =
        if revolved { "SURFACE_OF_REVOLUTION('',#24,#25)" } else { "SURFACE_OF_LINEAR_EXTRUSION('',#24,#26)" };
    format!(
        "#20={surface};\n#21=CARTESIAN_POINT('',(10.,0.,5.));\n#22=DIRECTION('',({direction}));\n#23=VECTOR('',#22,2.);\n\
         #24=LINE('',#21,#23);\n#25=AXIS1_PLACEMENT('',#10,#13);\n#26=VECTOR('',#13,3.);\n"
    )
}

/// The parameter of a swept line counts its vector from its own point, whatever the surface is else (ISO 10303-42).
#[test]
fn surfaces_swept_by_a_line_lie_where_its_parameters_say() {
    let cylinder = read(&trimmed(&swept_line("0.,0.,1.", true), "0.,3.141592653589793,0.,1.5"));
    close(area(&cylinder), 30.0 * PI, 1e-9);
    let [lo, hi] = cylinder.report.bbox_mm.expect("a face");
    assert!((lo[2] - 5.0).abs() < 1e-9 && (hi[2] - 8.0).abs() < 1e-9, "{lo:?} {hi:?}");
    // Half a frustum of radii 10 and 13.6 and slant 6.
    let cone = read(&trimmed(&swept_line("0.6,0.,0.8", true), "0.,3.141592653589793,0.,3."));
    close(area(&cone), 0.5 * PI * 23.6 * 6.0, 1e-9);
    let plane = read(&trimmed(&swept_line("1.,0.,0.", false), "0.,4.,0.,2."));
    close(area(&plane), 48.0, 1e-9);
    assert_eq!(plane.report.bbox_mm, Some([[10.0, 0.0, 5.0], [18.0, 0.0, 11.0]]));
    let bare = swept_line("1.,0.,0.", false).replace("#20=", "#900=");
    assert_refused(&bare, "it has no ends");
}

/// The parameter of a polyline counts its points: 0 to 2 is all of two sides of 10 mm.
#[test]
fn a_swept_polyline_is_trimmed_by_its_points() {
    let wall = "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#21=CARTESIAN_POINT('',(10.,0.,0.));\n#22=CARTESIAN_POINT('',(10.,10.,0.));\n\
                #24=POLYLINE('',(#10,#21,#22));\n#26=VECTOR('',#13,3.);\n";
    close(area(&read(&trimmed(wall, "0.,2.,0.,2."))), 120.0, 1e-9);
    close(area(&read(&trimmed(wall, "0.5,1.5,0.,2."))), 60.0, 1e-9);
}

/// Degrees in a file of radians would wind a sphere 28 times; values that were rounded at the pole are the pole.
#[test]
fn trimming_parameters_beyond_a_sphere_are_refused() {
    let sphere = "#20=SPHERICAL_SURFACE('',#14,5.);\n";
    close(area(&read(&trimmed(sphere, "0.,6.283185307179586,-1.570797,1.570797"))), 100.0 * PI, 1e-6);
    assert_refused(&trimmed(sphere, "0.,360.,-90.,90."), "leave the surface");
    assert_refused(&trimmed(sphere, "0.,6.283185307179586,0.,1.E10"), "leave the surface");
    let lemon = "#20=DEGENERATE_TOROIDAL_SURFACE('',#14,3.,5.,.F.);\n";
    assert_refused(&trimmed(lemon, "0.,1.,2.541592653589793,3.3415926535897933"), "cannot be taken over");
}

#[test]
fn a_curve_whose_weights_are_no_numbers_is_no_polynomial() {
    let curve = |weight: &str| {
        format!(
            "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#21=CARTESIAN_POINT('',(5.,10.,0.));\n#22=CARTESIAN_POINT('',(10.,0.,0.));\n\
             #24=(BOUNDED_CURVE()B_SPLINE_CURVE(2,(#10,#21,#22),.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.)\
             CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE((1.,{weight},1.))REPRESENTATION_ITEM(''));\n\
             #26=VECTOR('',#13,3.);\n"
        )
    };
    // From (0, 0) by (5, 10) to (10, 0), 3 mm high: a parabola of 10 mm and a rise of 5 has the length 5·(√5 + ½·asinh 2). Areas of
    // accounts are sums over a few nodes.
    close(area(&read(&trimmed(&curve("1."), "0.,1.,0.,1."))), 15.0 * (5f64.sqrt() + 0.5 * 2f64.asinh()), 1e-8);
    assert_refused(&trimmed(&curve("$"), "0.,1.,0.,1."), "weights are no numbers");
    assert_refused(&trimmed(&curve("1.,1."), "0.,1.,0.,1."), "the number of weights does not fit");
}

/// A square of 10 mm with a round hole of radius 2 whose edge has two vertices, `apart` mm from each other; #70 is the hole's bound, #68
/// its loop.
pub(crate) fn plate(apart: f64) -> String {
    let y = 2.0 * (apart / 2.0).sin();
    let x = 5.0 + 2.0 * (apart / 2.0).cos();
    let corners = [[0., 0.], [10., 0.], [10., 10.], [0., 10.]];
    let points: String = (0..4)
        .map(|k| {
            let [x, y] = corners[k];
            format!("#{}=CARTESIAN_POINT('',({x:?},{y:?},0.));\n", 30 + k)
        })
        .collect();
    points
        + &format!(
            "#40=POLY_LOOP('',(#30,#31,#32,#33));\n#41=FACE_OUTER_BOUND('',#40,.T.);\n\
             #60=CARTESIAN_POINT('',({x:?},5.,0.));\n#61=CARTESIAN_POINT('',({x:?},{:?},0.));\n#62=VERTEX_POINT('',#60);\n#63=VERTEX_POINT('',#61);\n\
             #64=CARTESIAN_POINT('',(5.,5.,0.));\n#65=AXIS2_PLACEMENT_3D('',#64,#13,#11);\n#66=CIRCLE('',#65,2.);\n\
             #67=EDGE_CURVE('',#62,#63,#66,.T.);\n#68=EDGE_LOOP('',(#69));\n#69=ORIENTED_EDGE('',*,*,#67,.F.);\n#70=FACE_BOUND('',#68,.T.);\n\
             #71=PLANE('',#14);\n#72=ADVANCED_FACE('',(#41,#70),#71,.T.);\n#73=OPEN_SHELL('',(#72));\n\
             #900=SHELL_BASED_SURFACE_MODEL('',(#73));\n",
            5.0 + y
        )
}

/// The only edge of a loop goes all around, though its vertices were written twice and rounded.
#[test]
fn a_hole_whose_vertices_differ_by_rounding_stays_open() {
    for apart in [0.0, 1e-12, 1e-8, -1e-8, 1e-6, -1e-6] {
        let import = read(&plate(apart));
        // The quadrature walks a polygon.
        close(area(&import), 100.0 - 4.0 * PI, 1e-4);
        let part = &import.model.parts[0];
        let hole = part.edges.iter().find(|e| e.entity == Some(67)).expect("the hole's edge");
        assert_eq!(hole.vertices[0], hole.vertices[1], "{apart:e}");
    }
}

/// A plate whose lower side is moved up to the hole, which reaches down to 3, and half a millimetre into it.
#[test]
fn a_hole_that_stands_out_of_its_face_is_told() {
    for (bottom, repaired) in [("0.", 0), ("2.9", 0), ("3.5", 1)] {
        let data = plate(0.0)
            .replace("(0.0,0.0,0.)", &format!("(0.,{bottom},0.)"))
            .replace("(10.0,0.0,0.)", &format!("(10.,{bottom},0.)"));
        let import = read(&data);
        let report = &import.report;
        assert_eq!(
            (report.faces.converted, report.faces.repaired),
            (1, repaired),
            "{bottom}: {:?}",
            report.repairs
        );
        assert!(
            report.repairs.iter().all(|r| r.reason.contains("reaches beyond the outer loop")),
            "{:?}",
            report.repairs
        );
    }
}

/// A few writers give the names of entities in small letters.
#[test]
fn names_of_entities_in_small_letters_are_read() {
    let import = read(&plate(0.0).to_ascii_lowercase());
    close(area(&import), 100.0 - 4.0 * PI, 1e-4);
    assert_eq!(import.report.problems, Vec::<String>::new());
}

#[test]
fn faces_in_a_set_of_surfaces_are_told() {
    let data =
        plate(0.0).replace("#900=", "#901=") + "#900=GEOMETRIC_SET('',(#72,#30));\n#902=BLOCK('',#14,1.,1.,1.);\n";
    // In the set alone, and in the model of #901 too.
    for (items, faces, told) in [("#900,#902", 6, vec![900]), ("#900,#901", 1, vec![])] {
        let import = read_sections("", items, &data);
        let left_out: Vec<u64> = import.report.left_out.iter().map(|note| note.id).collect();
        assert_eq!((import.model.placed_face_count(), left_out), (faces, told), "{items}");
    }
    // In the model it is refused, and reported by that alone.
    let refused = read_sections("", "#900,#901", &data.replace("#71=PLANE('',#14);\n", "")).report;
    assert_eq!((refused.faces.refused, refused.left_out.len()), (1, 0), "{:?}", refused.left_out);
}

#[test]
fn a_face_that_lacks_a_bound_is_refused() {
    let whole = plate(0.0);
    for (from, to, reason) in [
        ("(#41,#70)", "(#41,#9999)", "a bound of it is missing"),
        ("(#41,#70)", "(#41,$)", "a bound of it is missing"),
        ("FACE_BOUND('',#68", "FACE_BOUND('',#9999", "its loop is missing"),
    ] {
        assert_refused(&whole.replace(from, to), reason);
    }
}

/// Corners #50 of a right triangle of 50 mm².
const TRIANGLE: &str = "#50=COORDINATES_LIST('',3,((0.,0.,0.),(10.,0.,0.),(0.,10.,0.)));\n";

/// A shell may list itself: each mesh stands in its place once, and reading comes to an end.
#[test]
fn a_mesh_that_is_listed_again_is_no_second_one() {
    let itself = vec!["#900"; 100].join(",");
    let shell = format!(
        "{TRIANGLE}#51=TRIANGULATED_FACE('',#50,3,((0.,0.,1.)),$,(),((1,2,3)));\n#900=TESSELLATED_SHELL('',(#51,{itself},#51),$);\n"
    );
    let import = read(&shell);
    assert_eq!(import.model.placed_face_count(), 1);
    close(area(&import), 50.0, 1e-12);
}

/// A triangle that cannot be read would be a hole through which light passes; in a strip it would turn the others around.
#[test]
fn a_mesh_with_a_broken_triangle_is_refused() {
    let corners = "#50=COORDINATES_LIST('',4,((0.,0.,0.),(10.,0.,0.),(0.,10.,0.),(10.,10.,0.)));\n";
    let set = |kind: &str, lists: &str| {
        format!("{corners}#900=TESSELLATED_SHELL('',(#51),$);\n#51={kind}('',#50,4,((0.,0.,1.)),$,(),{lists});\n")
    };
    let listed = |rows: &str| set("TRIANGULATED_FACE", rows);
    close(area(&read(&listed("((1,2,3),(2,4,3))"))), 100.0, 1e-12);
    for rows in ["((1,2,3),(2,4))", "((1,2,3),(2,4,3,1))", "((1,2,3),(2,$,3))", "((1,2,3),$)", "((1,2,3),(2,-4,3))"]
    {
        assert_refused(&listed(rows), "three points");
    }
    let unrolled = |strips: &str, fans: &str| set("COMPLEX_TRIANGULATED_FACE", &format!("{strips},{fans}"));
    close(area(&read(&unrolled("((1,2,3,4))", "()"))), 100.0, 1e-12);
    close(area(&read(&unrolled("()", "((1,2,4,3))"))), 100.0, 1e-12);
    for (strips, fans) in
        [("((1,2,$,3,4))", "()"), ("((1,2,3,4),(2,4))", "()"), ("()", "((1,$,2,4,3))"), ("()", "((1,2,4,3),(1,2))")]
    {
        assert_refused(&unrolled(strips, fans), "three points");
    }
}

/// A mesh that names the exact face which it shows stands there no second time; one that names a surface bounds it. #901 is the model of
/// the face: where that does not stand, the mesh does.
#[test]
fn a_mesh_linked_to_a_face_is_its_picture() {
    let linked = |items: &str, to: &str| {
        let data = plate(0.0).replace("#900=", "#901=")
            + &format!(
                "{TRIANGLE}#51=TRIANGULATED_FACE('',#50,3,((0.,0.,1.)),{to},(),((1,2,3)));\n#900=TESSELLATED_SHELL('',(#51),$);\n"
            );
        let import = read_sections("", items, &data);
        (import.report.by_surface.plane, import.report.by_surface.tessellated)
    };
    assert_eq!(linked("#900,#901", "#72"), (1, 0));
    assert_eq!(linked("#900,#901", "#71"), (1, 1));
    assert_eq!(linked("#900", "#72"), (0, 1));
    assert_eq!(linked("#900", "#71"), (0, 1));
}

/// Meshes in forms that are not read are named.
#[test]
fn a_mesh_with_a_place_of_its_own_is_refused() {
    let mesh = format!(
        "{TRIANGLE}#51=TRIANGULATED_FACE('',#50,3,((0.,0.,1.)),$,(),((1,2,3)));\n\
         #900=(GEOMETRIC_REPRESENTATION_ITEM()REPOSITIONED_TESSELLATED_ITEM(#14)REPRESENTATION_ITEM('')TESSELLATED_GEOMETRIC_SET((#51))\
         TESSELLATED_ITEM());\n"
    );
    assert_refused(&mesh, "place of its own");
    let in_complex_form = mesh.replace("REPOSITIONED_TESSELLATED_ITEM(#14)", "");
    assert_eq!(read(&in_complex_form).model.placed_face_count(), 1);
    assert_refused("#900=CUBIC_BEZIER_TRIANGULATED_FACE('',$,3,$,$,$);\n", "not converted");
}

#[test]
fn kinds_of_shapes_that_are_not_read_are_refused() {
    for item in [
        "SURFACE_REPLICA('',#71,#14)",
        "BOXED_HALF_SPACE('',#71,.T.,$)",
        "SPHERICAL_VOLUME('',#14,2.)",
        "ORIENTED_FACE('',*,#72,.T.)",
        "TRIMMED_VOLUME('',$,0.,1.,0.,1.,0.,1.)",
    ] {
        assert_refused(&format!("{}#900={item};\n", plate(0.0).replace("#900=", "#901=")), "not converted");
    }
    // Points, curves and what they stand in are no shapes, and no loss.
    for item in [
        "CARTESIAN_POINT('',(1.,2.,3.))",
        "AXIS2_PLACEMENT_3D('',#10,$,$)",
        "CIRCLE('',#14,2.)",
        "GEOMETRIC_CURVE_SET('',(#66))",
    ] {
        let import = read(&format!("{}#900={item};\n", plate(0.0).replace("#900=", "#901=")));
        assert_eq!(import.report.refusals.len(), 0, "{item}");
    }
}

/// A face of a shell that only turns another is refused as one that lacks it, not for its kind.
#[test]
fn an_oriented_face_without_a_face_is_refused() {
    let oriented =
        |face: &str| plate(0.0).replace("(#72));", &format!("(#74));\n#74=ORIENTED_FACE('',*,{face},.F.);"));
    close(area(&read(&oriented("#72"))), 100.0 - 4.0 * PI, 1e-4);
    assert_refused(&oriented("$"), "its face is missing");
}

/// Composite curves of composite curves, eight to eight: counted before they are read.
#[test]
fn composite_curves_that_multiply_are_refused() {
    let nested = |levels: usize| {
        let mut data = String::from(
            "#30=CARTESIAN_POINT('',(10.,0.,0.));\n#31=CARTESIAN_POINT('',(0.,10.,0.));\n#32=POLYLINE('',(#10,#30,#31,#10));\n\
             #40=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#32);\n#41=COMPOSITE_CURVE('',(#40),.F.);\n",
        );
        for level in 1..levels {
            let (segment, curve) = (40 + 2 * level, 41 + 2 * level);
            let list = vec![format!("#{segment}"); 8].join(",");
            data += &format!("#{segment}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{});\n", curve - 2);
            data += &format!("#{curve}=COMPOSITE_CURVE('',({list}),.F.);\n");
        }
        let last = 41 + 2 * (levels - 1);
        data + &format!(
            "#80=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{last});\n#81=BOUNDARY_CURVE('',(#80),.F.);\n#71=PLANE('',#14);\n\
             #900=CURVE_BOUNDED_SURFACE('',#71,(#81),.F.);\n"
        )
    };
    close(area(&read(&nested(1))), 50.0, 1e-9);
    assert_refused(&nested(8), "too many segments");
}

/// What has no length as a double's square has a direction all the same.
#[test]
fn a_tiny_direction_is_a_direction() {
    let block = "#20=DIRECTION('',(0.,1.E-170,0.));\n#21=AXIS2_PLACEMENT_3D('',#10,#20,#11);\n#900=BLOCK('',#21,1.,2.,3.);\n";
    let [lo, hi] = read(block).report.bbox_mm.expect("a block");
    for (got, expected) in lo.into_iter().chain(hi).zip([0.0, 0.0, -2.0, 1.0, 3.0, 0.0]) {
        assert!((got - expected).abs() < 1e-9, "{lo:?} {hi:?}");
    }
}

/// What a list lacks would be a hole, a shape of other corners or a void that is glass.
#[test]
fn a_list_with_an_entry_that_is_no_reference_is_refused() {
    let reason = "an entry of its list is no reference";
    let whole = plate(0.0);
    assert_refused(&whole.replace("(#30,#31,#32,#33)", "(#30,#31,$,#32,#33)"), reason);
    let wall = "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#21=CARTESIAN_POINT('',(10.,0.,0.));\n#22=CARTESIAN_POINT('',(10.,10.,0.));\n\
                #26=VECTOR('',#13,3.);\n";
    for curve in [
        "POLYLINE('',(#10,$,#21,#22))",
        "B_SPLINE_CURVE_WITH_KNOTS('',1,(#10,7,#22),.UNSPECIFIED.,.F.,.F.,(2,2),(0.,1.),.UNSPECIFIED.)",
    ] {
        assert_refused(&trimmed(&format!("{wall}#24={curve};\n"), "0.,1.,0.,2."), reason);
    }
    let bounded = "#30=CARTESIAN_POINT('',(10.,0.,0.));\n#31=CARTESIAN_POINT('',(0.,10.,0.));\n#32=POLYLINE('',(#10,#30,#31,#10));\n\
                   #40=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#32);\n#81=BOUNDARY_CURVE('',(#40),.F.);\n#71=PLANE('',#14);\n";
    assert_refused(&format!("{bounded}#900=CURVE_BOUNDED_SURFACE('',#71,(#81,$),.F.);\n"), reason);
    let area = format!("{bounded}#70=CURVE_BOUNDED_SURFACE('',#71,($,#81),.F.);\n");
    assert_refused(&format!("{area}#900=EXTRUDED_AREA_SOLID('',#70,#13,5.);\n"), reason);
    let net = "#20=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#10,#30),(#31,$)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n";
    assert_refused(&format!("{bounded}{}", trimmed(net, "0.,1.,0.,1.")), reason);
}

/// Where each entry stands by itself, the others are kept, and the list is named.
#[test]
fn what_is_beside_an_entry_that_is_no_reference_stands() {
    let whole = plate(0.0);
    let mesh = format!("{TRIANGLE}#51=TRIANGULATED_FACE('',#50,3,((0.,0.,1.)),$,(),((1,2,3)));\n");
    for (data, entity) in [
        (whole.replace("('',(#72))", "('',($,#72))"), "OPEN_SHELL"),
        (whole.replace("('',(#73))", "('',(#73,.T.))"), "SHELL_BASED_SURFACE_MODEL"),
        (
            trimmed("#20=SPHERICAL_SURFACE('',#14,5.);\n", "0.,1.,0.,1.").replace("(#901)", "(#901,$)"),
            "GEOMETRIC_SET",
        ),
        (format!("{mesh}#900=TESSELLATED_SHELL('',($,#51),$);\n"), "TESSELLATED_SHELL"),
    ] {
        let import = read(&data);
        let said: Vec<(&str, &str)> =
            import.report.refusals.iter().map(|r| (r.entity.as_str(), r.reason.as_str())).collect();
        assert_eq!(said, [(entity, "an entry of its list is no reference")], "{data}");
        assert_eq!((import.model.placed_face_count(), import.report.faces.refused), (1, 1), "{data}");
    }
    let items = read_sections("", "$,#900", &whole);
    assert_eq!(items.model.placed_face_count(), 1);
    let problems = &items.report.problems;
    assert!(problems.len() == 1 && problems[0].contains("#6: an entry of its list of items"), "{problems:?}");
}

/// As of splines: where doubles are a millimetre apart no triangle has a shape.
#[test]
fn a_mesh_with_a_corner_that_is_too_far_is_refused() {
    let mesh = |x: &str| {
        format!(
            "#50=COORDINATES_LIST('',3,((0.,0.,0.),({x},0.,0.),(0.,10.,0.)));\n#900=TESSELLATED_SHELL('',(#51),$);\n\
             #51=TRIANGULATED_FACE('net',#50,3,((0.,0.,1.)),$,(),((1,2,3)));\n"
        )
    };
    close(area(&read(&mesh("1.E12"))), 5e12, 1e-9);
    assert_refused(&mesh("1.E13"), "1e12 mm");
    let refusals = read(&mesh("1.E13")).report.refusals;
    assert_eq!((refusals[0].id, refusals[0].entity.as_str()), (51, "TRIANGULATED_FACE"));
}

#[test]
fn references_that_lead_nowhere_are_told() {
    let import = read(&(plate(0.0) + "#80=PRODUCT('','','',(#9999));\n#81=PRODUCT('','','',(#9998,#9999));\n"));
    let problems = &import.report.problems;
    assert!(problems.len() == 1 && problems[0].contains("2 such") && problems[0].contains("#9998"), "{problems:?}");
    assert_eq!(read(&plate(0.0)).report.problems, Vec::<String>::new());
    let one = read(&(plate(0.0) + "#80=PRODUCT('','','',(#9999));\n")).report.problems;
    assert!(one.len() == 1 && one[0].ends_with("#9999 is referred to but is not in the file"), "{one:?}");
    // The statement is skipped, and reported as well.
    let broken = read(&(plate(0.0) + "#80=PRODUCT('','','',(#81));\n#81=VECTOR('',#11;\n")).report.problems;
    assert!(broken.iter().any(|p| p.ends_with("#81 is referred to but could not be read")), "{broken:?}");
}

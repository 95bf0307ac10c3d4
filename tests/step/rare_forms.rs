//! More of what files say in rare forms: what a standard leaves to its defaults, what is hidden, listed twice or stands elsewhere.

use crate::faces;
use crate::silence::{area, assert_refused, close, plate, read, read_sections, trimmed};
use lampyris::step::Import;
use std::f64::consts::PI;

fn assert_box(import: &Import, low: [f64; 3], high: [f64; 3]) {
    let [lo, hi] = import.report.bbox_mm.expect("a shape");
    for (got, expected) in lo.into_iter().chain(hi).zip(low.into_iter().chain(high)) {
        assert!((got - expected).abs() < 1e-9, "{lo:?} {hi:?}");
    }
}

/// ISO 10303-42, `first_proj_axis`: the space's X, projected, also where the axis is nearly along it.
#[test]
fn a_placement_without_a_reference_takes_the_projection_of_x() {
    let block = "#20=DIRECTION('',(0.96,0.28,0.));\n#21=AXIS2_PLACEMENT_3D('',#10,#20,$);\n#900=BLOCK('',#21,10.,20.,30.);\n";
    // The axes: x = (0.28, −0.96, 0), y = −Z, z = (0.96, 0.28, 0).
    assert_box(&read(block), [0.0, -9.6, -20.0], [2.8 + 28.8, 8.4, 0.0]);
}

#[test]
fn directions_that_point_nowhere_are_told() {
    let block =
        "#20=DIRECTION('',(0.,0.,0.));\n#21=AXIS2_PLACEMENT_3D('',#10,#20,#11);\n#900=BLOCK('',#21,1.,2.,3.);\n";
    let import = read(block);
    assert_box(&import, [0.0; 3], [1.0, 2.0, 3.0]);
    let problems = &import.report.problems;
    assert!(problems.len() == 1 && problems[0].contains("#20 DIRECTION points nowhere"), "{problems:?}");
}

/// A quarter of a circle of radius 5 as a rational spline, moved along z by three for each unit of v.
#[test]
fn a_swept_rational_spline_keeps_its_parameter() {
    let quarter = "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#21=CARTESIAN_POINT('',(5.,0.,0.));\n#22=CARTESIAN_POINT('',(5.,5.,0.));\n\
                   #23=CARTESIAN_POINT('',(0.,5.,0.));\n#26=VECTOR('',#13,3.);\n\
                   #24=(BOUNDED_CURVE()B_SPLINE_CURVE(2,(#21,#22,#23),.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.)\
                   CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE((1.,0.7071067811865476,1.))REPRESENTATION_ITEM(''));\n";
    close(area(&read(&trimmed(quarter, "0.,1.,0.,2."))), 15.0 * PI, 1e-9);
    // By symmetry half of the parameter is half of the arc.
    close(area(&read(&trimmed(quarter, "0.,0.5,0.,2."))), 7.5 * PI, 1e-9);
    let circle = quarter.replace("#24=(", "#24=CIRCLE('',#14,5.);\n#25=(");
    assert_refused(&trimmed(&circle, "0.,1.,0.,2."), "cannot be taken over");
}

/// Two sides of 10 mm: lines that are cut from 5 to 15 of their parameter; all of it begins at 0.
#[test]
fn a_swept_composite_curve_counts_its_segments_from_zero() {
    let sides = "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#26=VECTOR('',#13,3.);\n#21=CARTESIAN_POINT('',(10.,-5.,0.));\n\
                 #30=VECTOR('',#11,1.);\n#31=LINE('',#40,#30);\n#40=CARTESIAN_POINT('',(-5.,0.,0.));\n\
                 #32=VECTOR('',#12,1.);\n#33=LINE('',#21,#32);\n\
                 #34=TRIMMED_CURVE('',#31,(PARAMETER_VALUE(5.)),(PARAMETER_VALUE(15.)),.T.,.PARAMETER.);\n\
                 #35=TRIMMED_CURVE('',#33,(PARAMETER_VALUE(5.)),(PARAMETER_VALUE(15.)),.T.,.PARAMETER.);\n\
                 #36=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#34);\n#37=COMPOSITE_CURVE_SEGMENT(.DISCONTINUOUS.,.T.,#35);\n\
                 #24=COMPOSITE_CURVE('',(#36,#37),.F.);\n";
    close(area(&read(&trimmed(sides, "0.,20.,0.,1."))), 60.0, 1e-9);
    let import = read(&trimmed(sides, "0.,10.,0.,1."));
    assert_box(&import, [0.0; 3], [10.0, 0.0, 3.0]);
    let polyline = sides.replace("#35=TRIMMED_CURVE", "#38=CARTESIAN_POINT('',(10.,0.,0.));\n#39=CARTESIAN_POINT('',(10.,10.,0.));\n#35=POLYLINE('',(#38,#39));\n#41=TRIMMED_CURVE");
    assert_refused(&trimmed(&polyline, "0.,20.,0.,1."), "cannot be taken over");
}

/// Straight pieces over 0 to 1 and 1 to 2: the second begins where the first ends, or elsewhere.
#[test]
fn a_spline_in_two_pieces_is_refused_where_they_part() {
    let surface = |begin: f64| {
        format!(
            "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#26=VECTOR('',#13,3.);\n#21=CARTESIAN_POINT('',(4.,0.,0.));\n\
             #22=CARTESIAN_POINT('',({begin:?},0.,0.));\n#23=CARTESIAN_POINT('',(10.,0.,0.));\n\
             #24=B_SPLINE_CURVE_WITH_KNOTS('',1,(#10,#21,#22,#23),.UNSPECIFIED.,.F.,.F.,(2,2,2),(0.,1.,2.),.UNSPECIFIED.);\n"
        )
    };
    close(area(&read(&trimmed(&surface(4.0), "0.,2.,0.,1."))), 30.0, 1e-9);
    assert_refused(&trimmed(&surface(6.0), "0.,2.,0.,1."), "its pieces lie apart");
}

/// #73 is the shell of the model #900, #72 its only face.
#[test]
fn what_another_item_holds_stands_once() {
    for items in ["#900", "#900,#73", "#73,#900", "#900,#72", "#72,#73", "#72,#900,#73"] {
        let import = read_sections("", items, &plate(0.0));
        close(area(&import), 100.0 - 4.0 * PI, 1e-4);
        assert_eq!(import.report.faces.found, 1, "{items}");
    }
}

#[test]
fn what_a_file_hides_is_named() {
    let data = plate(0.0)
        + "#80=STYLED_ITEM('',(),#900);\n#81=STYLED_ITEM('',(),#66);\n#82=PRESENTATION_LAYER_ASSIGNMENT('','',(#72,#71));\n\
           #83=(OVER_RIDING_STYLED_ITEM(#80)REPRESENTATION_ITEM('')STYLED_ITEM((),#900));\n";
    let hidden = |record: &str| -> Vec<u64> {
        let import = read(&format!("{data}{record}"));
        assert_eq!(import.report.faces.converted, 1);
        import.report.hidden.iter().map(|note| note.id).collect()
    };
    assert!(hidden("").is_empty());
    assert_eq!(hidden("#90=INVISIBILITY((#80));\n#91=INVISIBILITY((#83));\n"), [900]);
    assert_eq!(hidden("#90=(CONTEXT_DEPENDENT_INVISIBILITY(#6)INVISIBILITY((#83)));\n"), [900]);
    assert_eq!(hidden("#90=INVISIBILITY((#82,#6));\n"), [72, 6]);
    // A curve is nothing that light could meet.
    assert!(hidden("#90=INVISIBILITY((#81));\n").is_empty());
}

/// Edition 3: names for other files, instances of other files, and signatures.
#[test]
fn sections_besides_the_data_are_no_damage() {
    let sections = "ANCHOR;\n<a1>=#14;\n<b-2>=$;\n<c>=('x',#13);\nENDSEC;\nREFERENCE;\n#5000=<other.stp#abc>;\n@6000=<x.stp#7>;\nENDSEC;\n";
    let block = "#900=BLOCK('',#14,1.,2.,3.);\n";
    let import = read_sections(sections, "#900", block);
    assert_eq!(import.report.faces.converted, 6);
    let problems = &import.report.problems;
    let told = "silence.stp: line 11: #5000: stands in another file, which is not read with this one";
    assert_eq!(problems.as_slice(), [told]);
    let import = read_sections("", "#900", &format!("{block}ENDSEC;\nSIGNATURE;\nMIIBg6=#(;)\nab'c\n"));
    assert_eq!(
        (import.report.faces.converted, import.report.problems.len()),
        (6, 0),
        "{:?}",
        import.report.problems
    );
}

/// The outer upper quarter of a tube of radius 10, bent by a quarter turn of radius 50; its edges run counter-clockwise from outside.
fn bend(radii: &str, flag: &str) -> String {
    faces::points(&[
        (10, [0., 0., 0.]),
        (11, [0., 0., 10.]),
        (12, [0., 50., 0.]),
        (13, [50., 0., 0.]),
        (14, [60., 0., 0.]),
        (15, [0., 60., 0.]),
        (16, [0., 50., 10.]),
        (17, [50., 0., 10.]),
    ]) + &format!(
        "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,1.,0.));\n#23=DIRECTION('',(0.,-1.,0.));\n\
         #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=TOROIDAL_SURFACE('',#30,{radii});\n#32=CIRCLE('',#30,60.);\n\
         #33=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#34=CIRCLE('',#33,50.);\n\
         #35=AXIS2_PLACEMENT_3D('',#12,#21,#22);\n#36=CIRCLE('',#35,10.);\n\
         #37=AXIS2_PLACEMENT_3D('',#13,#23,#21);\n#38=CIRCLE('',#37,10.);\n\
         #40=VERTEX_POINT('',#14);\n#41=VERTEX_POINT('',#15);\n#42=VERTEX_POINT('',#16);\n#43=VERTEX_POINT('',#17);\n\
         #50=EDGE_CURVE('',#40,#41,#32,.T.);\n#51=EDGE_CURVE('',#41,#42,#36,.T.);\n\
         #52=EDGE_CURVE('',#43,#42,#34,.T.);\n#53=EDGE_CURVE('',#40,#43,#38,.T.);\n\
         #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.T.);\n\
         #62=ORIENTED_EDGE('',*,*,#52,.F.);\n#63=ORIENTED_EDGE('',*,*,#53,.F.);\n\
         #70=EDGE_LOOP('',(#60,#61,#62,#63));\n#71=FACE_OUTER_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#71),#31,{flag});\n"
    )
}

/// ISO 10303-42 asks for positive radii; by its formula a negative major one turns the normal inwards, a negative minor one does not.
#[test]
fn a_torus_of_negative_radii_has_the_normal_of_its_formula() {
    for (radii, flag) in [("50.,10.", ".T."), ("50.,-10.", ".T."), ("-50.,10.", ".F."), ("-50.,-10.", ".F.")] {
        let import = faces::import(&bend(radii, flag));
        close(faces::area(&import), 0.5 * PI * (50.0 * 10.0 * 0.5 * PI + 100.0), 1e-5);
        assert_eq!(import.report.faces.repaired, 0, "{radii}: {:?}", import.report.repairs);
        assert!(!import.model.parts[0].shells[0].faces[0].reversed, "{radii}");
    }
    let trimmed_by_angles =
        |radii: &str| trimmed(&format!("#20=TOROIDAL_SURFACE('',#14,{radii});\n"), "0.,1.,0.,1.");
    close(area(&read(&trimmed_by_angles("50.,10."))), 500.0 + 100.0 * 1f64.sin(), 1e-6);
    // Their angles count from elsewhere.
    for radii in ["50.,-10.", "-50.,10."] {
        assert_refused(&trimmed_by_angles(radii), "cannot be taken over");
    }
    assert_refused(&trimmed_by_angles("50.,0."), "minor radius is zero");
}

/// A square of 10 mm with u along x and v along y, and a bound without an edge.
const SQUARE: &str = "#20=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#10,#21),(#22,#23)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n\
    #21=CARTESIAN_POINT('',(0.,10.,0.));\n#22=CARTESIAN_POINT('',(10.,0.,0.));\n#23=CARTESIAN_POINT('',(10.,10.,0.));\n\
    #30=VERTEX_POINT('',#10);\n#31=VERTEX_LOOP('',#30);\n#32=FACE_OUTER_BOUND('',#31,.T.);\n";

#[test]
fn a_face_without_a_loop_ends_where_its_surface_is_trimmed() {
    let half = "#40=RECTANGULAR_TRIMMED_SURFACE('',#20,0.,0.5,0.,1.,.T.,.T.);\n";
    let triangle = "#40=CURVE_BOUNDED_SURFACE('',#20,(#41),.F.);\n#41=OUTER_BOUNDARY_CURVE('',(#42),.F.);\n\
                    #42=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#43);\n#43=POLYLINE('',(#10,#44,#45,#10));\n\
                    #44=CARTESIAN_POINT('',(5.,0.,0.));\n#45=CARTESIAN_POINT('',(5.,5.,0.));\n";
    // Without their trims these two have no end.
    let on_plane = triangle.replace("#20", "#46") + "#46=PLANE('',#14);\n";
    let tube = "#40=RECTANGULAR_TRIMMED_SURFACE('',#46,0.,6.283185307179586,0.,10.,.T.,.T.);\n\
                #46=CYLINDRICAL_SURFACE('',#14,2.5);\n";
    for (surface, expected) in [(half, 50.0), (triangle, 12.5), (on_plane.as_str(), 12.5), (tube, 50.0 * PI)] {
        for (bounds, sense, reversed) in [("", ".T.", false), ("#32", ".T.", false), ("#32", ".F.", true)] {
            let record = format!("#900=ADVANCED_FACE('window',({bounds}),#40,{sense});\n");
            let import = read(&format!("{SQUARE}{surface}{record}"));
            close(area(&import), expected, 1e-4);
            let faces = &import.model.parts[0].shells[0].faces;
            assert_eq!(faces.len(), 1);
            assert_eq!((faces[0].name.as_str(), faces[0].entity), ("window", Some(900)));
            assert_eq!(faces[0].reversed, reversed, "{surface}{record}");
            let repairs = &import.report.repairs;
            assert!(!repairs.iter().any(|r| r.reason.contains("ran against")), "{repairs:?}");
            assert_eq!(crate::support::violations(&import.model.parts[0], &faces[0]), Vec::<String>::new());
        }
    }
    let outside = half.replace("0.5", "1.5");
    assert_refused(&format!("{SQUARE}{outside}#900=ADVANCED_FACE('',(#32),#40,.T.);\n"), "leave the surface");
}

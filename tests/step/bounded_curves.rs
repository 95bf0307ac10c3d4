//! Curves cut by parameters or vertices: parts of offset, composite and placed curves, and edges against their curve, against closed forms.

use crate::faces::{self, square};
use crate::files::{MILLIMETRES, part21};
use crate::silence::{area, close};
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::PI;

/// The part of the plane z = 0 on the left of the curve #80 of `record` and of a polyline through `corners`, from its end to its start.
/// #10 is the origin, #11 to #13 are x, y and z, #14 is a placement there.
fn enclosed_in(units: &str, record: &str, corners: &[[f64; 2]]) -> Import {
    let points: String = corners
        .iter()
        .enumerate()
        .map(|(k, [x, y])| format!("#{}=CARTESIAN_POINT('',({x:?},{y:?},0.));\n", 200 + k))
        .collect();
    let list: Vec<String> = (0..corners.len()).map(|k| format!("#{}", 200 + k)).collect();
    let text = part21(&format!(
        "{units}\
         #6=SHAPE_REPRESENTATION('',(#900),#1);\n#10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=DIRECTION('',(1.,0.,0.));\n\
         #12=DIRECTION('',(0.,1.,0.));\n#13=DIRECTION('',(0.,0.,1.));\n#14=AXIS2_PLACEMENT_3D('',#10,#13,#11);\n\
         {record}{points}#70=POLYLINE('',({}));\n\
         #71=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#80);\n#72=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#70);\n\
         #73=BOUNDARY_CURVE('',(#71,#72),.F.);\n#74=PLANE('',#14);\n#75=CURVE_BOUNDED_SURFACE('',#74,(#73),.F.);\n\
         #900=GEOMETRIC_SET('',(#75));\n",
        list.join(",")
    ));
    read_bytes("enclosed.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

fn enclosed(record: &str, corners: &[[f64; 2]]) -> Import {
    enclosed_in(MILLIMETRES, record, corners)
}

/// The context of [`MILLIMETRES`] with angles in degrees.
pub(crate) fn degrees() -> String {
    let radian = "#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n";
    let degree = "#3=(CONVERSION_BASED_UNIT('DEGREE',#4)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
                  #4=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.017453292519943295),#5);\n";
    let units = MILLIMETRES.replace(radian, degree);
    assert_ne!(units, MILLIMETRES);
    units + &radian.replace("#3=", "#5=")
}

#[test]
fn an_offset_of_a_part_of_a_circle_is_as_long_as_the_part() {
    let half = "#80=OFFSET_CURVE_3D('',#81,1.,.F.,#13);\n#82=CIRCLE('',#14,5.);\n\
                #81=TRIMMED_CURVE('',#82,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.141592653589793)),.T.,.PARAMETER.);\n";
    close(area(&enclosed(half, &[[-4., 0.], [4., 0.]])), 8.0 * PI, 1e-4);
    // Run the other way, the circle has its outside on the left: a rectangle without half a disc of radius 6.
    let back = half.replace(
        "(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.141592653589793)),.T.",
        "(PARAMETER_VALUE(3.141592653589793)),(PARAMETER_VALUE(0.)),.F.",
    );
    let rectangle = [[6., 0.], [6., 8.], [-6., 8.], [-6., 0.]];
    close(area(&enclosed(&back, &rectangle)), 96.0 - 18.0 * PI, 1e-4);
}

#[test]
fn an_offset_of_a_part_of_a_line_is_bounded() {
    // Reference direction × tangent = z × x = y.
    let line = "#80=OFFSET_CURVE_3D('',#81,2.,.F.,#13);\n#82=LINE('',#10,#83);\n#83=VECTOR('',#11,1.);\n\
                #81=TRIMMED_CURVE('',#82,(PARAMETER_VALUE(2.)),(PARAMETER_VALUE(5.)),.T.,.PARAMETER.);\n";
    close(area(&enclosed(line, &[[5., 2.], [5., 6.], [2., 6.], [2., 2.]])), 12.0, 1e-9);
}

/// Steiner: half an ellipse grows by its length times the distance, and by half a disc.
#[test]
fn an_offset_of_a_part_of_an_ellipse_is_fitted_to_the_part() {
    let half = "#80=OFFSET_CURVE_3D('',#81,-1.,.F.,#13);\n#82=ELLIPSE('',#14,5.,3.);\n\
                #81=TRIMMED_CURVE('',#82,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.141592653589793)),.T.,.PARAMETER.);\n";
    // Gauss and Kummer: π (a + b) (1 + h/4 + h²/64 + h³/256 + …) around an ellipse.
    let h = (2.0f64 / 8.0).powi(2);
    let around = 8.0 * PI * (1.0 + h / 4.0 + h * h / 64.0 + h.powi(3) / 256.0);
    let expected = 0.5 * (15.0 * PI + around + PI);
    close(area(&enclosed(half, &[[-6., 0.], [6., 0.]])), expected, 1e-4);
}

/// Five units of a line from its parameter 5 on, and three of another: 0 to 8, of which 2 to 8 are the lower and right sides of a square.
const TWO_LINES: &str = "#20=VECTOR('',#11,1.);\n#21=LINE('',#10,#20);\n#22=CARTESIAN_POINT('',(10.,0.,0.));\n#23=VECTOR('',#12,1.);\n#24=LINE('',#22,#23);\n\
    #25=TRIMMED_CURVE('',#21,(PARAMETER_VALUE(5.)),(PARAMETER_VALUE(10.)),.T.,.PARAMETER.);\n\
    #26=TRIMMED_CURVE('',#24,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.)),.T.,.PARAMETER.);\n\
    #27=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#25);\n#28=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#26);\n\
    #29=COMPOSITE_CURVE('',(#27,#28),.F.);\n\
    #80=TRIMMED_CURVE('',#29,(PARAMETER_VALUE(2.)),(PARAMETER_VALUE(8.)),.T.,.PARAMETER.);\n";
const REST_OF_SQUARE: [[f64; 2]; 3] = [[10., 3.], [7., 3.], [7., 0.]];

/// ISO 10303-42, `composite_curve`: its parameter runs through the ranges of its segments' from 0 on.
#[test]
fn a_composite_curve_is_trimmed_by_a_parameter_that_begins_at_zero() {
    close(area(&enclosed(TWO_LINES, &REST_OF_SQUARE)), 9.0, 1e-9);
    // A replica twice the size has the same parameter.
    let replica = TWO_LINES.replace("#80=TRIMMED_CURVE('',#29", "#80=TRIMMED_CURVE('',#30")
        + "#30=CURVE_REPLICA('',#29,#31);\n#31=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',#11,#12,#10,2.,#13);\n";
    close(area(&enclosed(&replica, &REST_OF_SQUARE.map(|[x, y]| [2.0 * x, 2.0 * y]))), 36.0, 1e-9);
}

#[test]
fn a_composite_curve_whose_parameter_counts_points_is_trimmed_by_points_alone() {
    let polyline = TWO_LINES.replace(
        "#26=TRIMMED_CURVE",
        "#30=CARTESIAN_POINT('',(10.,3.,0.));\n#26=POLYLINE('',(#22,#30));\n#31=TRIMMED_CURVE",
    );
    let import = enclosed(&polyline, &REST_OF_SQUARE);
    assert_eq!(import.model.placed_face_count(), 0);
    let refusals = &import.report.refusals;
    assert!(refusals.iter().any(|r| r.reason.contains("cannot be taken over")), "{refusals:?}");
    let by_points = polyline.replace(
        "(PARAMETER_VALUE(2.)),(PARAMETER_VALUE(8.))",
        "(#32,PARAMETER_VALUE(2.)),(#30,PARAMETER_VALUE(6.))",
    ) + "#32=CARTESIAN_POINT('',(7.,0.,0.));\n";
    close(area(&enclosed(&by_points, &REST_OF_SQUARE)), 9.0, 1e-9);
}

/// The part of a circle of radius 5 about the origin, placed by #83, from 0 to `end`.
fn arc_of_replica(end: &str) -> String {
    format!(
        "#80=TRIMMED_CURVE('',#81,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE({end})),.T.,.PARAMETER.);\n\
         #81=CURVE_REPLICA('',#82,#83);\n#82=CIRCLE('',#14,5.);\n"
    )
}

#[test]
fn a_replica_of_a_circle_is_trimmed_by_angles() {
    let (sin, cos) = 1f64.sin_cos();
    let same = "#83=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#10,1.,$);\n";
    let chord = [[5.0 * cos, 5.0 * sin], [5.0, 0.0]];
    let by_radians = enclosed(&(arc_of_replica("1.") + same), &chord);
    close(area(&by_radians), 12.5 * (1.0 - sin), 1e-4);
    let by_degrees = enclosed_in(&degrees(), &(arc_of_replica("57.29577951308232") + same), &chord);
    close(area(&by_degrees), 12.5 * (1.0 - sin), 1e-4);
    // Twice the size and mirrored in y: what lies between the arc and the corner outside.
    let mirrored =
        "#83=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',#11,#84,#10,2.,#13);\n#84=DIRECTION('',(0.,-1.,0.));\n";
    let corner = [[10.0 * cos, -10.0 * sin], [10.0, -10.0 * sin], [10.0, 0.0]];
    let outside = enclosed(&(arc_of_replica("1.") + mirrored), &corner);
    close(area(&outside), 100.0 * sin - 50.0 * sin * cos - 50.0, 1e-4);
}

#[test]
fn a_replica_has_the_parameter_and_the_ends_of_its_parent() {
    let twice = "#82=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',#11,#12,#10,2.,#13);\n";
    let square = [[6., 6.], [0., 6.], [0., 0.]];
    // From the second to the fourth point.
    let polyline = "#80=TRIMMED_CURVE('',#81,(PARAMETER_VALUE(1.)),(PARAMETER_VALUE(3.)),.T.,.PARAMETER.);\n\
                    #81=CURVE_REPLICA('',#83,#82);\n#83=POLYLINE('',(#20,#10,#21,#22));\n#20=CARTESIAN_POINT('',(-7.,0.,0.));\n\
                    #21=CARTESIAN_POINT('',(3.,0.,0.));\n#22=CARTESIAN_POINT('',(3.,3.,0.));\n";
    close(area(&enclosed(&format!("{polyline}{twice}"), &square)), 36.0, 1e-9);
    // Of a line, and of a part of it: both run from 0 to 3 vectors.
    let line = "#80=TRIMMED_CURVE('',#81,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.)),.T.,.PARAMETER.);\n\
                #81=CURVE_REPLICA('',#83,#82);\n#83=LINE('',#10,#84);\n#84=VECTOR('',#11,1.);\n";
    let part = "#80=CURVE_REPLICA('',#81,#82);\n#83=LINE('',#10,#84);\n#84=VECTOR('',#11,1.);\n\
                #81=TRIMMED_CURVE('',#83,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(3.)),.T.,.PARAMETER.);\n";
    for record in [line, part] {
        let sides = [[6., 0.], [6., 6.], [0., 6.], [0., 0.]];
        close(area(&enclosed(&format!("{record}{twice}"), &sides)), 36.0, 1e-9);
    }
}

/// The first side of a square along a line, which an edge runs along or, as its flag says, against.
#[test]
fn an_edge_whose_sense_is_wrong_is_told() {
    for (sense, repaired) in [(".T.", 0), (".F.", 1)] {
        let edge = format!("#40=EDGE_CURVE('',#30,#31,#80,{sense})");
        let data = square([".T."; 4], [0, 1, 2, 3]).replace("#40=EDGE_CURVE('',#30,#31,$,.T.)", &edge)
            + "#80=LINE('',#10,#81);\n#81=VECTOR('',#82,1.);\n#82=DIRECTION('',(1.,0.,0.));\n";
        let import = faces::import(&data);
        close(faces::area(&import), 1.0, 1e-9);
        let repairs = &import.report.repairs;
        assert_eq!(import.report.faces.repaired, repaired, "{repairs:?}");
        assert!(repairs.iter().all(|r| r.reason.contains("contradicts its vertices")), "{repairs:?}");
    }
}

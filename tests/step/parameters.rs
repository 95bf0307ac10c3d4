//! Parameters and senses of geometry that stands on other geometry, by the closed forms of ISO 10303-42.

use crate::bounded_curves::degrees;
use crate::faces::points;
use crate::files::part21;
use crate::offsets::QUARTER;
use crate::silence::{area, close, read, trimmed};
use crate::support::measure_model;
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::{PI, SQRT_2};

/// Asserts between which heights, mm, a shape lies.
fn assert_heights(import: &Import, expected: [f64; 2], within: f64) {
    let [lo, hi] = import.report.bbox_mm.expect("a shape");
    let got = [lo[2], hi[2]];
    assert!(got.iter().zip(expected).all(|(g, e)| (g - e).abs() < within), "{got:?} for {expected:?}");
}

/// A point of the offset stands beside the basis's point at the same u and v: 3 mm from a cone of half angle 30°, by 3·cos 30° outwards
/// and by 3·sin 30° down.
#[test]
fn an_offset_of_a_cone_has_the_parameters_of_its_basis() {
    let cone = "#20=OFFSET_SURFACE('',#21,3.,.F.);\n#21=CONICAL_SURFACE('',#14,10.,0.5235987755982988);\n";
    let import = read(&trimmed(cone, "0.,3.141592653589793,0.,4."));
    assert_heights(&import, [-1.5, 2.5], 1e-9);
    let root = 3f64.sqrt();
    let low = 10.0 + 1.5 * root;
    // Half a frustum of height 4 and slant 8/√3.
    close(area(&import), 0.5 * PI * (2.0 * low + 4.0 / root) * 8.0 / root, 1e-9);
    // Radius 1 at height 0, half angle 45°, 2√2 mm inwards: radius v − 1 at height v + 2, below whose apex v = 0 lies.
    let inner =
        "#20=OFFSET_SURFACE('',#21,-2.8284271247461903,.F.);\n#21=CONICAL_SURFACE('',#14,1.,0.7853981633974483);\n";
    let import = read(&trimmed(inner, "0.,3.141592653589793,2.,4."));
    assert_heights(&import, [4.0, 6.0], 1e-9);
    close(area(&import), 0.5 * PI * (1.0 + 3.0) * 2.0 * SQRT_2, 1e-9);
}

/// A quarter of the same cone between curves that are given in its parameters alone, in a file of degrees.
#[test]
fn curves_in_the_parameters_of_an_offset_cone_lie_beside_its_basis() {
    let corners = [[0.0, 0.0], [90.0, 0.0], [90.0, 4.0], [0.0, 4.0]];
    let mut data = String::from(
        "#20=OFFSET_SURFACE('',#21,3.,.F.);\n#21=CONICAL_SURFACE('',#14,10.,30.);\n#900=GEOMETRIC_SET('',(#22));\n\
         #22=CURVE_BOUNDED_SURFACE('',#20,(#23),.F.);\n#23=BOUNDARY_CURVE('',(#60,#61,#62,#63),.F.);\n",
    );
    for (k, [u, v]) in corners.into_iter().enumerate() {
        data += &format!(
            "#3{k}=CARTESIAN_POINT('',({u:?},{v:?}));\n#4{k}=POLYLINE('',(#3{k},#3{}));\n\
             #5{k}=DEFINITIONAL_REPRESENTATION('',(#4{k}),$);\n#7{k}=PCURVE('',#20,#5{k});\n\
             #6{k}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#7{k});\n",
            (k + 1) % 4
        );
    }
    let text = part21(&format!(
        "{}#6=SHAPE_REPRESENTATION('',(#900),#1);\n#10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=DIRECTION('',(1.,0.,0.));\n\
         #13=DIRECTION('',(0.,0.,1.));\n#14=AXIS2_PLACEMENT_3D('',#10,#13,#11);\n{data}",
        degrees()
    ));
    let import = read_bytes("degrees.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
    let root = 3f64.sqrt();
    close(area(&import), 0.25 * PI * (20.0 + 3.0 * root + 4.0 / root) * 8.0 / root, 1e-5);
    assert_heights(&import, [-1.5, 2.5], 1e-5);
}

/// A square at height 2 whose loop runs clockwise as seen from above, on a line that is run along −x and moved along y.
#[test]
fn an_extruded_line_that_is_run_backwards_turns_the_normal() {
    let wrapped = "#24=SURFACE_CURVE('',#25,(),.CURVE_3D.);\n#25=TRIMMED_CURVE";
    for profile in [wrapped, "#24=TRIMMED_CURVE"] {
        let import = read(&format!(
            "#20=SURFACE_OF_LINEAR_EXTRUSION('',#24,#26);\n#26=VECTOR('',#12,1.);\n#27=LINE('',#30,#28);\n#28=VECTOR('',#11,1.);\n\
             {profile}('',#27,(PARAMETER_VALUE(1.)),(PARAMETER_VALUE(0.)),.F.,.PARAMETER.);\n\
             #30=CARTESIAN_POINT('',(0.,0.,2.));\n#31=CARTESIAN_POINT('',(0.,1.,2.));\n#32=CARTESIAN_POINT('',(1.,1.,2.));\n\
             #33=CARTESIAN_POINT('',(1.,0.,2.));\n#40=POLY_LOOP('',(#30,#31,#32,#33));\n#41=FACE_OUTER_BOUND('',#40,.T.);\n\
             #72=ADVANCED_FACE('',(#41),#20,.T.);\n#73=OPEN_SHELL('',(#72));\n#900=SHELL_BASED_SURFACE_MODEL('',(#73));\n"
        ));
        assert_eq!((import.report.faces.converted, import.report.faces.repaired), (1, 0), "{profile}");
        // The flux of the position over three: height 2 through an area of 1, downwards.
        let flux = measure_model(&import.model).volume;
        assert!((flux + 2.0 / 3.0).abs() < 1e-9, "{profile}: {flux}");
    }
}

/// A quarter of a cylinder of radius 7 and height 4 that a line along −z, run backwards, makes about z: its normal is outwards.
#[test]
fn a_revolved_line_that_is_run_backwards_turns_the_normal() {
    let places = points(&[
        (10, [0., 0., 0.]),
        (11, [0., 0., 4.]),
        (12, [7., 0., 0.]),
        (13, [0., 7., 0.]),
        (14, [0., 7., 4.]),
        (15, [7., 0., 4.]),
    ]);
    let wrapped = "#26=SURFACE_CURVE('',#25,(),.CURVE_3D.);\n#25=TRIMMED_CURVE";
    for profile in [wrapped, "#26=TRIMMED_CURVE"] {
        let import = crate::faces::import(&format!(
            "{places}#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,0.,-1.));\n\
             #23=VECTOR('',#22,1.);\n#24=LINE('',#15,#23);\n#27=AXIS1_PLACEMENT('',#10,#20);\n\
             {profile}('',#24,(PARAMETER_VALUE(4.)),(PARAMETER_VALUE(0.)),.F.,.PARAMETER.);\n\
             #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n\
             #34=SURFACE_OF_REVOLUTION('',#26,#27);\n#35=CIRCLE('',#30,7.);\n#36=CIRCLE('',#31,7.);\n{QUARTER}"
        ));
        assert_eq!((import.report.faces.converted, import.report.faces.repaired), (1, 0), "{profile}");
        close(measure_model(&import.model).volume, 7.0 * 14.0 * PI / 3.0, 1e-6);
    }
}

/// ISO 10303-42, `base_axis`: without its second axis an operator takes the space's Y, and mirrors where the others ask for that.
#[test]
fn an_operator_without_a_second_axis_may_mirror() {
    // A line of length 5 to (3, 4, 0), 3 mm high.
    let wall = "#20=SURFACE_OF_LINEAR_EXTRUSION('',#21,#26);\n#26=VECTOR('',#13,3.);\n#21=CURVE_REPLICA('',#22,#23);\n\
               #22=TRIMMED_CURVE('',#27,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);\n\
               #27=LINE('',#10,#28);\n#28=VECTOR('',#29,5.);\n#29=DIRECTION('',(0.6,0.8,0.));\n\
               #23=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',#11,$,#10,1.,#24);\n#24=DIRECTION('',(0.,0.,-1.));\n";
    let import = read(&trimmed(wall, "0.,1.,0.,1."));
    close(area(&import), 15.0, 1e-9);
    let [lo, hi] = import.report.bbox_mm.expect("a shape");
    assert!(lo[1].abs() < 1e-9 && (hi[1] - 4.0).abs() < 1e-9, "{lo:?} {hi:?}");
}

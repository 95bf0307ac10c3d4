//! Composite curves whose segments do not meet: gaps are bridged or refused where an edge runs over them, overlaps are cut off. The same
//! decisions in files of any unit.

use crate::files::part21;
use crate::silence::{area, assert_refused, close, plate, read};
use lampyris::math::{Point, Vector};
use lampyris::nurbs::Curve;
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::PI;

/// A unit of length in which a file is written.
#[derive(Clone, Copy)]
struct Unit {
    name: &'static str,
    /// Its size.
    mm: f64,
    /// Its record #2 and those that this refers to.
    records: &'static str,
}

const UNITS: [Unit; 3] = [
    Unit { name: "mm", mm: 1.0, records: "#2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n" },
    Unit {
        name: "inch",
        mm: 25.4,
        records: "#2=(CONVERSION_BASED_UNIT('INCH',#5)LENGTH_UNIT()NAMED_UNIT(*));\n\
                  #5=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#7);\n#7=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n",
    },
    Unit { name: "m", mm: 1e3, records: "#2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));\n" },
];

/// Accuracies that files state, mm: a thousandth of an inch, and next to nothing.
const COARSE: f64 = 0.0254;
const FINE: f64 = 1e-6;

/// Half a disc of radius 5 whose second quarter stands `gap` to the left, along edge #40 and the straight one back, in a file that states
/// its accuracy. The curve of the edge goes on with a line that begins `beyond` below its end, where that is given. All lengths are in mm.
fn half_disc(unit: Unit, accuracy: f64, gap: f64, beyond: Option<f64>) -> Import {
    let records = unit.records;
    let real = |mm: f64| format!("{:.18}", mm / unit.mm);
    let place = |x: f64, y: f64| format!("CARTESIAN_POINT('',({},{},0.))", real(x), real(y));
    let radius = real(5.0);
    let end = -5.0 - gap;
    let more = beyond.map_or_else(String::new, |beyond| {
        format!(
            "#50={};\n#51={};\n#52=POLYLINE('',(#50,#51));\n#53=COMPOSITE_CURVE_SEGMENT(.DISCONTINUOUS.,.T.,#52);\n",
            place(end, -beyond),
            place(end, -beyond - 3.0)
        )
    });
    let list = if beyond.is_some() { "#26,#27,#53" } else { "#26,#27" };
    let text = part21(&format!(
        "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#4))GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
         {records}#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n#4=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),#2,'','');\n\
         #6=SHAPE_REPRESENTATION('',(#900),#1);\n#10={};\n#11=DIRECTION('',(1.,0.,0.));\n#13=DIRECTION('',(0.,0.,1.));\n\
         #14=AXIS2_PLACEMENT_3D('',#10,#13,#11);\n#20=CIRCLE('',#14,{radius});\n#22={};\n#23=AXIS2_PLACEMENT_3D('',#22,#13,#11);\n\
         #24=CIRCLE('',#23,{radius});\n\
         #21=TRIMMED_CURVE('',#20,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.5707963267948966)),.T.,.PARAMETER.);\n\
         #25=TRIMMED_CURVE('',#24,(PARAMETER_VALUE(1.5707963267948966)),(PARAMETER_VALUE(3.141592653589793)),.T.,.PARAMETER.);\n\
         #26=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#21);\n#27=COMPOSITE_CURVE_SEGMENT(.DISCONTINUOUS.,.T.,#25);\n\
         {more}#28=COMPOSITE_CURVE('',({list}),.F.);\n#30={};\n#31={};\n\
         #32=VERTEX_POINT('',#30);\n#33=VERTEX_POINT('',#31);\n#40=EDGE_CURVE('',#32,#33,#28,.T.);\n#41=EDGE_CURVE('',#33,#32,$,.T.);\n\
         #42=ORIENTED_EDGE('',*,*,#40,.T.);\n#43=ORIENTED_EDGE('',*,*,#41,.T.);\n#44=EDGE_LOOP('',(#42,#43));\n\
         #45=FACE_OUTER_BOUND('',#44,.T.);\n#71=PLANE('',#14);\n#72=ADVANCED_FACE('',(#45),#71,.T.);\n#73=OPEN_SHELL('',(#72));\n\
         #900=SHELL_BASED_SURFACE_MODEL('',(#73));\n",
        real(accuracy),
        place(0.0, 0.0),
        place(-gap, 0.0),
        place(5.0, 0.0),
        place(end, 0.0),
    ));
    read_bytes("joints.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// The curve of edge #40.
fn arc(import: &Import) -> &Curve {
    &import.model.parts[0].edges.iter().find(|e| e.entity == Some(40)).expect("the edge").curve
}

/// Asserts that the face is there, of this area, and was repaired for this reason or not at all.
fn assert_read(import: &Import, reason: Option<&str>, expected: f64, what: &str) {
    let faces = &import.report.faces;
    assert_eq!((faces.converted, faces.repaired), (1, usize::from(reason.is_some())), "{what}");
    let repairs = &import.report.repairs;
    assert!(repairs.iter().all(|r| reason.is_some_and(|reason| r.reason.contains(reason))), "{what}: {repairs:?}");
    // The quadrature walks a polygon of chords.
    close(area(import), expected, 1e-4);
}

#[test]
fn segments_that_lie_apart_keep_their_shapes_and_are_told() {
    for (gap, reason) in [(0.0, None), (0.005, Some("lie apart"))] {
        let import = half_disc(UNITS[0], FINE, gap, None);
        assert_read(&import, reason, 12.5 * PI + 5.0 * gap, &format!("{gap}"));
        let curve = arc(&import);
        let [a, b] = curve.domain();
        for k in 0..=200 {
            let p = curve.evaluate(a + (b - a) * f64::from(k) / 200.0);
            let off = if p.x > 0.0 {
                p.length() - 5.0
            } else if p.x < -gap {
                (p + gap * Vector::X).length() - 5.0
            } else {
                p.y - 5.0
            };
            assert!(off.abs() < 1e-9, "{gap}: {p}");
        }
    }
}

/// The widest gap is 1 % of the curve, 0.11 mm here, or what the file states.
#[test]
fn a_gap_within_what_a_writer_may_miss_is_bridged_in_any_unit() {
    for unit in UNITS {
        for (accuracy, gap) in [(COARSE, 0.02), (FINE, 0.02), (FINE, 0.09), (0.3, 0.2)] {
            let import = half_disc(unit, accuracy, gap, None);
            assert_read(&import, Some("lie apart"), 12.5 * PI + 5.0 * gap, &format!("{} {gap}", unit.name));
        }
        for accuracy in [FINE, COARSE] {
            // 5 % of the curve.
            let import = half_disc(unit, accuracy, 0.6, None);
            assert_eq!(import.report.faces.converted, 0, "{}", unit.name);
            let refusals = &import.report.refusals;
            let told = "#28 COMPOSITE_CURVE: its segments are 6.000e-1 mm apart";
            assert!(refusals.iter().any(|r| r.reason.contains(told)), "{}: {refusals:?}", unit.name);
        }
    }
}

/// A file that states an accuracy of its own size would join anything.
#[test]
fn an_accuracy_of_metres_bridges_no_curve() {
    assert_eq!(half_disc(UNITS[0], 1e3, 2.0, None).report.faces.converted, 0);
}

#[test]
fn a_gap_beyond_the_edge_is_neither_refused_nor_told() {
    for unit in UNITS {
        for beyond in [0.005, 0.05, 1.0] {
            let import = half_disc(unit, FINE, 0.0, Some(beyond));
            assert_read(&import, None, 12.5 * PI, &format!("{} {beyond}", unit.name));
        }
        // A gap that it does run over is still reported.
        let both = half_disc(unit, FINE, 0.02, Some(1.0));
        assert_read(&both, Some("lie apart"), 12.5 * PI + 0.1, unit.name);
    }
}

/// The second quarter begins before the end of the first: without a step back from the one to the other the edge runs counter-clockwise
/// throughout.
#[test]
fn an_edge_over_segments_that_overlap_does_not_double_back() {
    for unit in UNITS {
        let name = unit.name;
        let import = half_disc(unit, FINE, -0.005, None);
        assert_read(&import, Some("overlap"), 12.5 * PI - 0.025, name);
        let curve = arc(&import);
        let [a, b] = curve.domain();
        for k in 0..=4000 {
            let d = curve.derivatives(a + (b - a) * f64::from(k) / 4000.0);
            assert!(d.point.cross(d.first).z > 0.0, "{name}: back at {}", d.point);
            let off = [0.0, 0.005].map(|x| ((d.point - Point::new(x, 0.0, 0.0)).length() - 5.0).abs());
            // The quarters are 2.5e-6 mm apart where the one passes the end of the other.
            assert!(off[0].min(off[1]) < 5e-6, "{name}: {}", d.point);
        }
    }
}

/// A disc of radius 5 along two half circles of a composite curve, the second of which ends `gap` before the start of the first and with
/// this transition, between vertices at these angles on it; a straight edge leads back to the first vertex where `is_slit`.
fn disc(gap: f64, transition: &str, angles: &[f64], is_slit: bool) -> Import {
    read(&disc_data(gap, transition, angles, is_slit))
}

/// The data of [`disc`]: edges from #50 on, the plane #71, the face #73.
fn disc_data(gap: f64, transition: &str, angles: &[f64], is_slit: bool) -> String {
    let end = 2.0 * PI - gap / 5.0;
    let mut data = format!(
        "#20=CIRCLE('',#14,5.);\n#21=TRIMMED_CURVE('',#20,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE({PI:?})),.T.,.PARAMETER.);\n\
         #22=TRIMMED_CURVE('',#20,(PARAMETER_VALUE({PI:?})),(PARAMETER_VALUE({end:?})),.T.,.PARAMETER.);\n\
         #23=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#21);\n#24=COMPOSITE_CURVE_SEGMENT(.{transition}.,.T.,#22);\n\
         #25=COMPOSITE_CURVE('',(#23,#24),.F.);\n"
    );
    let mut uses = Vec::new();
    for (k, angle) in angles.iter().enumerate() {
        let (sin, cos) = angle.sin_cos();
        let next = (k + 1) % angles.len();
        let curve = if is_slit && next == 0 { "$" } else { "#25" };
        data += &format!(
            "#3{k}=CARTESIAN_POINT('',({:?},{:?},0.));\n#4{k}=VERTEX_POINT('',#3{k});\n#5{k}=EDGE_CURVE('',#4{k},#4{next},{curve},.T.);\n\
             #6{k}=ORIENTED_EDGE('',*,*,#5{k},.T.);\n",
            5.0 * cos,
            5.0 * sin
        );
        uses.push(format!("#6{k}"));
    }
    let list = uses.join(",");
    format!(
        "{data}#70=EDGE_LOOP('',({list}));\n#71=PLANE('',#14);\n#72=FACE_OUTER_BOUND('',#70,.T.);\n\
         #73=ADVANCED_FACE('',(#72),#71,.T.);\n#74=OPEN_SHELL('',(#73));\n#900=SHELL_BASED_SURFACE_MODEL('',(#74));\n"
    )
}

/// By one edge from a vertex to the same, whatever the file says of the curve's end, and by two of which one runs over it.
#[test]
fn a_composite_curve_whose_ends_nearly_meet_is_closed_and_told() {
    for (gap, reason) in
        [(0.0, None), (2e-3, Some("lie apart")), (0.05, Some("lie apart")), (-0.05, Some("overlap"))]
    {
        for transition in ["CONTINUOUS", "DISCONTINUOUS"] {
            let what = format!("{gap} {transition}");
            assert_read(&disc(gap, transition, &[0.0], false), reason, 25.0 * PI, &what);
        }
        let halves = disc(gap, "CONTINUOUS", &[0.5 * PI, 1.5 * PI], false);
        assert_read(&halves, reason, 25.0 * PI, &format!("{gap}, two edges"));
    }
}

/// 5 % of the curve.
#[test]
fn an_edge_over_ends_too_far_apart_is_refused() {
    for angles in [&[0.0][..], &[0.5 * PI, 1.5 * PI]] {
        let import = disc(0.5, "CONTINUOUS", angles, false);
        assert_eq!(import.report.faces.converted, 0, "{angles:?}");
        let refusals = &import.report.refusals;
        assert!(refusals.iter().any(|r| r.reason.contains("it runs over the ends of its curve")), "{refusals:?}");
    }
}

/// A segment of 225° of the disc whose arc has the wrong sense, and nothing else on its curve: gaps of 0.3, 3.5 and 7 % of the curve are no
/// part of it. The area is that of a sector without its triangle.
#[test]
fn an_edge_of_wrong_sense_does_not_run_over_ends_that_lie_apart() {
    for gap in [0.05, 0.5, 1.0] {
        let data = disc_data(gap, "CONTINUOUS", &[0.25 * PI, 1.5 * PI], true);
        let right = "#50=EDGE_CURVE('',#40,#41,#25,.T.)";
        assert!(data.contains(right));
        let import = read(&data.replace(right, "#50=EDGE_CURVE('',#40,#41,#25,.F.)"));
        let angle = 1.25 * PI;
        assert_read(&import, Some("sense of an edge contradicts"), 12.5 * (angle - angle.sin()), &format!("{gap}"));
    }
}

/// The rest of the disc of [`disc_data`] with two edges, the first along its curve, the second straight: a face #85, whose arc has this
/// curve and sense.
fn rest_of_disc(curve: &str) -> String {
    format!(
        "#80=EDGE_CURVE('',#41,#40,{curve});\n#81=ORIENTED_EDGE('',*,*,#80,.T.);\n#82=ORIENTED_EDGE('',*,*,#51,.F.);\n\
         #83=EDGE_LOOP('',(#81,#82));\n#84=FACE_OUTER_BOUND('',#83,.T.);\n#85=ADVANCED_FACE('',(#84),#71,.T.);\n"
    )
}

/// Asserts that so many faces are there, of this area together, all but one of which were repaired for this reason.
fn assert_all_but_one_repaired(import: &Import, reason: &str, faces: usize, expected: f64) {
    let report = &import.report;
    assert_eq!((report.faces.converted, report.faces.repaired), (faces, faces - 1), "{:?}", report.repairs);
    assert!(report.repairs.iter().all(|r| r.reason.contains(reason)), "{:?}", report.repairs);
    close(area(import), expected, 1e-4);
}

/// The disc cut by a chord into two faces: the arc of the one takes what is between the vertices, that of the other runs over the ends. The
/// former may name a curve that runs against the other's, with the sense turned as well.
#[test]
fn an_edge_runs_over_ends_beside_another_along_the_rest_of_its_curve() {
    let trimmed =
        "#86=TRIMMED_CURVE('',#25,(PARAMETER_VALUE(2.)),(PARAMETER_VALUE(0.)),.F.,.PARAMETER.);\n".to_owned();
    for (curve, more) in [("#25,.T.", String::new()), ("#86,.F.", trimmed)] {
        let one = disc_data(0.05, "CONTINUOUS", &[1.5 * PI, 0.25 * PI], true);
        let data = one.replace("'',(#73))", "'',(#73,#85))") + &rest_of_disc(curve) + &more;
        assert_all_but_one_repaired(&read(&data), "lie apart", 2, 25.0 * PI);
    }
}

/// The segment of 225° whose arc has the wrong sense, beside the same 20 mm below: the arc of that one takes this part of a replica, and
/// none of the curve.
#[test]
fn an_edge_along_a_replica_takes_no_part_of_the_curve() {
    let [first, second] = [0.25 * PI, 1.5 * PI];
    let one = disc_data(0.05, "CONTINUOUS", &[first, second], true);
    let right = "#50=EDGE_CURVE('',#40,#41,#25,.T.)";
    assert!(one.contains(right) && one.contains("'',(#73))"));
    let mut data = one.replace(right, "#50=EDGE_CURVE('',#40,#41,#25,.F.)").replace("'',(#73))", "'',(#73,#94))");
    for (k, angle) in [first, second].into_iter().enumerate() {
        let (sin, cos) = angle.sin_cos();
        data += &format!(
            "#8{k}=CARTESIAN_POINT('',({:?},{:?},0.));\n#8{}=VERTEX_POINT('',#8{k});\n",
            5.0 * cos,
            5.0 * sin - 20.0,
            k + 2
        );
    }
    data += "#84=CARTESIAN_POINT('',(0.,-20.,0.));\n#85=CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,$,#84,1.,$);\n\
             #86=CURVE_REPLICA('',#25,#85);\n#87=EDGE_CURVE('',#82,#83,#86,.T.);\n#88=EDGE_CURVE('',#83,#82,$,.T.);\n\
             #90=ORIENTED_EDGE('',*,*,#87,.T.);\n#91=ORIENTED_EDGE('',*,*,#88,.T.);\n#92=EDGE_LOOP('',(#90,#91));\n\
             #93=FACE_OUTER_BOUND('',#92,.T.);\n#94=ADVANCED_FACE('',(#93),#71,.T.);\n";
    let angle = second - first;
    let reason = "sense of an edge contradicts";
    assert_all_but_one_repaired(&read(&data), reason, 2, 25.0 * (angle - angle.sin()));
}

/// Segments of the disc over one another, each of 135° less twice its number times 0.01 rad, with arcs over the ends: the edge along the
/// rest of the curve is the last of all.
#[test]
fn each_of_many_edges_along_a_curve_counts() {
    const SEGMENTS: u32 = 70;
    let mut data = disc_data(0.05, "CONTINUOUS", &[1.5 * PI, 0.25 * PI], true);
    let mut faces = String::from("#73,");
    let mut expected = 25.0 * PI;
    for k in 1..=SEGMENTS {
        let [point, vertex, edge, used, border] = [1000, 1002, 1004, 1006, 1008].map(|id| id + 20 * k);
        let (bound, face) = (border + 1, border + 2);
        let angle = 0.01 * f64::from(k);
        for (n, angle) in (0..).zip([1.5 * PI + angle, 0.25 * PI - angle]) {
            let (sin, cos) = angle.sin_cos();
            let curve = if n == 0 { "#25" } else { "$" };
            let (from, to) = (vertex + n, vertex + 1 - n);
            data += &format!(
                "#{}=CARTESIAN_POINT('',({:?},{:?},0.));\n#{from}=VERTEX_POINT('',#{});\n\
                 #{}=EDGE_CURVE('',#{from},#{to},{curve},.T.);\n#{}=ORIENTED_EDGE('',*,*,#{},.T.);\n",
                point + n,
                5.0 * cos,
                5.0 * sin,
                point + n,
                edge + n,
                used + n,
                edge + n
            );
        }
        data += &format!(
            "#{border}=EDGE_LOOP('',(#{used},#{}));\n#{bound}=FACE_OUTER_BOUND('',#{border},.T.);\n\
             #{face}=ADVANCED_FACE('',(#{bound}),#71,.T.);\n",
            used + 1
        );
        faces += &format!("#{face},");
        let turn = 0.75 * PI - 2.0 * angle;
        expected += 12.5 * (turn - turn.sin());
    }
    let data = data.replace("'',(#73))", &format!("'',({faces}#85))")) + &rest_of_disc("#25,.T.");
    assert_all_but_one_repaired(&read(&data), "lie apart", SEGMENTS as usize + 2, expected);
}

/// A slit of 5 µm between the ends of a curve along which one edge runs from the one to the other.
#[test]
fn an_edge_between_the_ends_of_its_curve_does_not_close_it() {
    for transition in ["CONTINUOUS", "DISCONTINUOUS"] {
        let import = disc(0.005, transition, &[0.0, 2.0 * PI - 0.001], true);
        assert_read(&import, None, 25.0 * PI, transition);
        let edge = import.model.parts[0].edges.iter().find(|e| e.entity == Some(50)).expect("the edge");
        let [a, b] = edge.curve.domain();
        assert!((edge.curve.evaluate(b) - edge.curve.evaluate(a)).length() > 4.9e-3, "{transition}");
    }
}

/// A hole along a straight spline from its vertex on, of a length in mm: no larger than a vertex it is none, and a longer one is refused.
#[test]
fn a_hole_no_larger_than_its_vertex_is_none() {
    let with_spline = |length: f64| {
        let end = format!("#80=CARTESIAN_POINT('',({:?},5.0,0.));\n", 7.0 + length);
        let spline =
            "#66=B_SPLINE_CURVE_WITH_KNOTS('',1,(#60,#80),.UNSPECIFIED.,.F.,.F.,(2,2),(0.,1.),.UNSPECIFIED.);";
        end + &plate(0.0).replace("#66=CIRCLE('',#65,2.);", spline)
    };
    for length in [0.002, 0.005, 0.02] {
        close(area(&read(&with_spline(length))), 100.0, 1e-9);
    }
    assert_refused(&with_spline(1.0), "it runs over the ends of its curve");
}

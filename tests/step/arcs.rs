//! Arcs whose vertices stand in the wrong order in the file: the loops beside them decide which part of the circle is meant.

use crate::files::{MILLIMETRES, part21};
use crate::support::{Measure, measure};
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::FRAC_PI_3;
use std::fmt::Write;

const RADIUS: f64 = 5.0;
const HEIGHT: f64 = 8.0;
/// Half the angle of the arc.
const HALF: f64 = FRAC_PI_3;

/// The part of a cylinder beyond a chord, its arc around the x axis. `swapped` are the arcs, at the bottom and at the top, whose vertices
/// stand in the wrong order; `turned` is whether the flag of the bottom's use of its arc is wrong.
fn segment(swapped: [bool; 2], turned: bool) -> Import {
    let mut data = String::from(
        "#11=DIRECTION('',(0.,0.,1.));#12=DIRECTION('',(1.,0.,0.));#13=DIRECTION('',(0.,1.,0.));#14=DIRECTION('',(-1.,0.,0.));\n\
         #20=CARTESIAN_POINT('',(0.,0.,0.));#21=AXIS2_PLACEMENT_3D('',#20,#11,#12);#22=CYLINDRICAL_SURFACE('',#21,5.);\n",
    );
    let (x, y) = (RADIUS * HALF.cos(), RADIUS * HALF.sin());
    for (k, z) in [0.0, HEIGHT].into_iter().enumerate() {
        let n = 100 * (k + 1);
        // The chord's vertices are 1 and 2: the arc runs from the first to the second, the line back.
        let [first, last] = if swapped[k] { [2, 1] } else { [1, 2] };
        writeln!(
            data,
            "#{n}=CARTESIAN_POINT('',(0.,0.,{z:?}));#{a}=AXIS2_PLACEMENT_3D('',#{n},#11,#12);#{c}=CIRCLE('',#{a},{RADIUS:?});\
             #{p}=CARTESIAN_POINT('',({x:?},{0:?},{z:?}));#{q}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));\
             #{v}1=VERTEX_POINT('',#{p});#{v}2=VERTEX_POINT('',#{q});\
             #{d}=VECTOR('',#13,1.);#{l}=LINE('',#{p},#{d});#{s}=PLANE('',#{a});\
             #{arc}=EDGE_CURVE('',#{v}{first},#{v}{last},#{c},.T.);#{line}=EDGE_CURVE('',#{v}1,#{v}2,#{l},.T.);",
            -y,
            a = n + 1,
            c = n + 2,
            p = n + 3,
            q = n + 4,
            v = n + 5,
            d = n + 6,
            l = n + 7,
            s = n + 8,
            arc = n + 10,
            line = n + 11,
        )
        .unwrap();
    }
    for (edge, end, point) in [(30, 1, 103), (31, 2, 104)] {
        writeln!(
            data,
            "#4{end}=VECTOR('',#11,1.);#5{end}=LINE('',#{point},#4{end});#{edge}=EDGE_CURVE('',#105{end},#205{end},#5{end},.T.);"
        )
        .unwrap();
    }
    writeln!(data, "#60=AXIS2_PLACEMENT_3D('',#103,#14,#13);#61=PLANE('',#60);").unwrap();
    // Counter-clockwise from outside; what is minus runs against its edge.
    let bottom_arc = if turned { 110 } else { -110 };
    let faces: [(i32, &str, &[i32]); 4] = [
        (108, ".F.", &[111, bottom_arc]),
        (208, ".T.", &[210, -211]),
        (22, ".T.", &[110, 31, -210, -30]),
        (61, ".T.", &[30, 211, -31, -111]),
    ];
    for (k, (surface, sense, edges)) in faces.iter().enumerate() {
        let n = 1000 + 100 * (k + 1);
        let uses: Vec<String> = (1..=edges.len()).map(|i| format!("#{}", n + 10 + i)).collect();
        for (name, edge) in uses.iter().zip(*edges) {
            let flag = if *edge > 0 { ".T." } else { ".F." };
            writeln!(data, "{name}=ORIENTED_EDGE('',*,*,#{},{flag});", edge.abs()).unwrap();
        }
        writeln!(
            data,
            "#{n}=EDGE_LOOP('',({}));#{}=FACE_OUTER_BOUND('',#{n},.T.);#{}=ADVANCED_FACE('',(#{}),#{surface},{sense});",
            uses.join(","),
            n + 1,
            n + 2,
            n + 1
        )
        .unwrap();
    }
    data += "#90=CLOSED_SHELL('',(#1102,#1202,#1302,#1402));#91=MANIFOLD_SOLID_BREP('',#90);\
             #92=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#91),#1);";
    read_bytes("segment.stp", part21(&format!("{MILLIMETRES}{data}")).as_bytes(), &Settings::default())
        .expect("Part 21")
}

/// Asserts the area and volume of a segment: sector less triangle, arc and chord. The measure goes along 400 chords of an arc, 5e-6 less.
fn assert_whole(import: &Import, what: &str) {
    assert!(import.report.refusals.is_empty(), "{what}: {:?}", import.report.refusals);
    let end = 0.5 * RADIUS * RADIUS * (2.0 * HALF - (2.0 * HALF).sin());
    let area = 2.0 * end + HEIGHT * RADIUS * (2.0 * HALF + 2.0 * HALF.sin());
    let faces = &import.model.parts[0].shells[0].faces;
    let all = faces
        .iter()
        .map(measure)
        .fold(Measure::default(), |a, b| Measure { area: a.area + b.area, volume: a.volume + b.volume });
    assert!((all.area / area - 1.0).abs() < 1e-5, "{what}: {} for {area}", all.area);
    assert!((all.volume / (end * HEIGHT) - 1.0).abs() < 1e-5, "{what}: {} for {}", all.volume, end * HEIGHT);
}

#[test]
fn arcs_run_as_both_their_loops_say() {
    let plain = segment([false; 2], false);
    assert!(plain.report.repairs.is_empty(), "{:?}", plain.report.repairs);
    assert_whole(&plain, "as it should be");
    for swapped in [[true, false], [false, true], [true, true]] {
        let import = segment(swapped, false);
        assert_whole(&import, &format!("{swapped:?}"));
        let repaired: Vec<u64> = import.report.repairs.iter().map(|r| r.id).collect();
        let arcs: Vec<u64> = [110, 210].into_iter().zip(swapped).filter(|(_, s)| *s).map(|(id, _)| id).collect();
        assert_eq!(repaired, arcs, "{:?}", import.report.repairs);
    }
}

/// Where one of an arc's loops alone finds it against its neighbours, the flag of that use is wrong.
#[test]
fn an_arc_that_one_loop_runs_the_wrong_way_stays() {
    assert_whole(&segment([false; 2], true), "one flag");
}

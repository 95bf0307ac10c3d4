//! Rims whose vertices lie anywhere on them: the seams between them run straight.

use crate::faces::{area, close, import, points};
use crate::files::{MILLIMETRES, part21};
use lampyris::math::Point;
use lampyris::step::{Settings, read_bytes};
use std::f64::consts::PI;
use std::fmt::Write;

/// A stepped shaft without seams, as a shell of cylinders and rings: rims at the given heights and radii, each with its vertex at an
/// azimuth.
fn shaft(rims: &[[f64; 3]]) -> String {
    let mut data = String::from(
        "#10=CARTESIAN_POINT('',(0.,0.,0.));#11=DIRECTION('',(0.,0.,1.));#12=DIRECTION('',(1.,0.,0.));\n\
         #13=AXIS2_PLACEMENT_3D('',#10,#11,#12);\n",
    );
    for (k, &[z, r, azimuth]) in rims.iter().enumerate() {
        let n = 100 * (k + 1);
        let (sin, cos) = azimuth.sin_cos();
        writeln!(
            data,
            "#{n}=CARTESIAN_POINT('',(0.,0.,{z:?}));#{}=AXIS2_PLACEMENT_3D('',#{n},#11,#12);#{}=CIRCLE('',#{},{r:?});\n\
             #{}=CARTESIAN_POINT('',({:?},{:?},{z:?}));#{}=VERTEX_POINT('',#{});#{}=EDGE_CURVE('',#{},#{},#{},.T.);",
            n + 1,
            n + 2,
            n + 1,
            n + 3,
            r * cos,
            r * sin,
            n + 4,
            n + 3,
            n + 5,
            n + 4,
            n + 4,
            n + 2
        )
        .unwrap();
    }
    let mut faces = Vec::new();
    for k in 0..rims.len() - 1 {
        let n = 10_000 + 100 * k;
        let ([z0, r0, _], [z1, r1, _]) = (rims[k], rims[k + 1]);
        let surface = if z0 == z1 {
            format!("#{}=AXIS2_PLACEMENT_3D('',#{},#11,#12);#{n}=PLANE('',#{});", n + 9, 100 * (k + 1), n + 9)
        } else {
            assert_eq!(r0, r1);
            format!("#{n}=CYLINDRICAL_SURFACE('',#13,{r0:?});")
        };
        writeln!(data, "{surface}").unwrap();
        for (i, (rim, sense)) in [(k, ".T."), (k + 1, ".F.")].into_iter().enumerate() {
            let b = n + 10 * (i + 1);
            writeln!(
                data,
                "#{b}=ORIENTED_EDGE('',*,*,#{},{sense});#{}=EDGE_LOOP('',(#{b}));#{}=FACE_BOUND('',#{},.T.);",
                100 * (rim + 1) + 5,
                b + 1,
                b + 2,
                b + 1
            )
            .unwrap();
        }
        // A ring below the wider part looks down.
        let sense = if z0 == z1 { ".F." } else { ".T." };
        writeln!(data, "#{}=ADVANCED_FACE('',(#{},#{}),#{n},{sense});", n + 50, n + 12, n + 22).unwrap();
        faces.push(format!("#{}", n + 50));
    }
    writeln!(
        data,
        "#90=OPEN_SHELL('',({}));#91=SHELL_BASED_SURFACE_MODEL('',(#90));#92=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#91),#1);",
        faces.join(",")
    )
    .unwrap();
    part21(&format!("{MILLIMETRES}{data}"))
}

/// A shaft of two cylinders with a ring between: each cylinder's seam is a line along the axis, and a rim that moved keeps its circle.
#[test]
fn seams_between_rims_are_straight() {
    let rims = [[0.0, 5.0, 0.0], [20.0, 5.0, 3.0], [20.0, 7.0, -1.2], [26.0, 7.0, 2.2]];
    let import = read_bytes("shaft.stp", shaft(&rims).as_bytes(), &Settings::default()).expect("Part 21");
    let report = &import.report;
    assert!(report.refusals.is_empty() && report.repairs.is_empty(), "{:?} {:?}", report.refusals, report.repairs);
    let part = &import.model.parts[0];
    let seams: Vec<_> = part.edges.iter().filter(|edge| edge.entity.is_none()).collect();
    assert_eq!(seams.len(), 2);
    for (seam, height) in seams.iter().zip([20.0, 6.0]) {
        let [a, b] = seam.curve.domain();
        let place = |f: f64| seam.curve.evaluate(a + (b - a) * f);
        let chord = place(1.0) - place(0.0);
        assert!((chord.length() - height).abs() < 1e-12 && chord.x.hypot(chord.y) < 1e-12, "{chord}");
        for f in [0.2, 0.5, 0.9] {
            let p: Point = place(f);
            assert!((p.x - place(0.0).x).hypot(p.y - place(0.0).y) < 1e-12, "{p}");
        }
    }
    for edge in part.edges.iter().filter(|edge| edge.entity.is_some()) {
        let [a, b] = edge.curve.domain();
        let ends = edge.vertices.map(|v| part.vertices[v.0 as usize]);
        assert!((ends[0] - edge.curve.evaluate(a)).length() < 1e-12 && ends[0] == ends[1]);
        let (radius, z) = (ends[0].x.hypot(ends[0].y), ends[0].z);
        assert!(rims.iter().any(|rim| (rim[0] - z).abs() < 1e-12 && (rim[1] - radius).abs() < 1e-12));
        let opposite = edge.curve.evaluate(0.5 * (a + b));
        assert!((opposite - Point::new(-ends[0].x, -ends[0].y, z)).length() < 1e-12);
    }
}

/// A face of `surface`, at the origin, between two circles of this radius that both run the same way: a bound of its own for each, which
/// has `flag` and the given centre, axis and start of its circle.
fn between_rings(surface: &str, radius: f64, rings: [[[f64; 3]; 3]; 2], flag: &str) -> String {
    let mut data = points(&[(10, [0.0; 3])])
        + &format!(
            "#11=DIRECTION('',(0.,0.,1.));#12=DIRECTION('',(1.,0.,0.));#13=AXIS2_PLACEMENT_3D('',#10,#11,#12);#14={surface};\n"
        );
    for (n, [center, axis, start]) in [100, 200].into_iter().zip(rings) {
        let vertex = [0, 1, 2].map(|d| center[d] + radius * start[d]);
        data += &points(&[(n, center), (n + 1, vertex)]);
        let [x, y, z] = axis;
        let [a, b, c] = start;
        writeln!(
            data,
            "#{}=DIRECTION('',({x:?},{y:?},{z:?}));#{}=DIRECTION('',({a:?},{b:?},{c:?}));",
            n + 2,
            n + 3
        )
        .unwrap();
        writeln!(
            data,
            "#{placement}=AXIS2_PLACEMENT_3D('',#{n},#{},#{});#{circle}=CIRCLE('',#{placement},{radius:?});\
             #{vertex}=VERTEX_POINT('',#{});#{edge}=EDGE_CURVE('',#{vertex},#{vertex},#{circle},.T.);\
             #{oriented}=ORIENTED_EDGE('',*,*,#{edge},.T.);#{ring}=EDGE_LOOP('',(#{oriented}));#{}=FACE_BOUND('',#{ring},{flag});",
            n + 2,
            n + 3,
            n + 1,
            n + 10,
            placement = n + 4,
            circle = n + 5,
            vertex = n + 6,
            edge = n + 7,
            oriented = n + 8,
            ring = n + 9,
        )
        .unwrap();
    }
    data + "#900=ADVANCED_FACE('',(#110,#210),#14,.T.);\n"
}

/// A tube of radius 2 and height 3; and three quarters of a torus of radii 5 and 1.5, or the quarter that its first ring has on its left.
#[test]
fn the_second_of_two_rings_that_run_alike_is_turned_around() {
    let told = |data: &str, expected: f64| {
        let import = import(data);
        close(area(&import), expected, 1e-5);
        assert_eq!(import.report.faces.repaired, 1, "{:?}", import.report.repairs);
    };
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let ends = [[[0.0; 3], z, x], [[0.0, 0.0, 3.0], z, x]];
    for flag in [".T.", ".F."] {
        told(&between_rings("CYLINDRICAL_SURFACE('',#13,2.)", 2.0, ends, flag), 12.0 * PI);
    }
    // Both run up on the outside, where the face is on their left at smaller azimuths.
    let first = [[5.0, 0.0, 0.0], [0.0, -1.0, 0.0], x];
    let second = [[0.0, 5.0, 0.0], x, y];
    let whole = 4.0 * PI * PI * 5.0 * 1.5;
    for (rings, flag, share) in [
        ([first, second], ".T.", 0.75),
        ([second, first], ".T.", 0.25),
        ([first, second], ".F.", 0.25),
        ([second, first], ".F.", 0.75),
    ] {
        told(&between_rings("TOROIDAL_SURFACE('',#13,5.,1.5)", 1.5, rings, flag), share * whole);
    }
}

/// A tube of radius 2 and height 3 in one loop along its seam, whose rims are run with these senses: right where they differ.
#[test]
fn a_rim_that_runs_the_wrong_way_is_turned_and_told() {
    for (rims, repaired) in [(["T", "F"], 0), (["T", "T"], 1), (["F", "F"], 1)] {
        let [bottom, top] = rims;
        let data = points(&[(10, [0.0; 3]), (11, [0., 0., 3.]), (12, [2., 0., 0.]), (13, [2., 0., 3.])])
            + &format!(
                "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n\
                 #23=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#24=CYLINDRICAL_SURFACE('',#22,2.);\n#25=CIRCLE('',#22,2.);\n\
                 #26=CIRCLE('',#23,2.);\n#30=VERTEX_POINT('',#12);\n#31=VERTEX_POINT('',#13);\n\
                 #40=EDGE_CURVE('',#30,#30,#25,.T.);\n#41=EDGE_CURVE('',#31,#31,#26,.T.);\n#42=EDGE_CURVE('',#30,#31,$,.T.);\n\
                 #50=ORIENTED_EDGE('',*,*,#40,.{bottom}.);\n#51=ORIENTED_EDGE('',*,*,#42,.T.);\n\
                 #52=ORIENTED_EDGE('',*,*,#41,.{top}.);\n#53=ORIENTED_EDGE('',*,*,#42,.F.);\n\
                 #60=EDGE_LOOP('',(#50,#51,#52,#53));\n#61=FACE_OUTER_BOUND('',#60,.T.);\n#900=ADVANCED_FACE('',(#61),#24,.T.);\n"
            );
        let import = import(&data);
        close(area(&import), 12.0 * PI, 1e-5);
        assert_eq!(import.report.faces.repaired, repaired, "{rims:?}");
        let repairs = &import.report.repairs;
        assert!(repairs.iter().all(|r| r.reason.contains("one of its two rims was turned around")), "{repairs:?}");
    }
}

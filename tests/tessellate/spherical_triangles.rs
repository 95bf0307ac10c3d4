//! Triangles of great circles with a corner near a pole, where what is straight in parameters bows far from the circle.

use crate::files::{MILLIMETRES, part21};
use lampyris::math::{Point, Vector};
use lampyris::step::{self, read_bytes};
use lampyris::tessellate::{Settings, tessellate};
use std::fmt::Write;

const RADIUS: f64 = 0.5;

/// A place on the unit sphere.
fn place([longitude, latitude]: [f64; 2]) -> Vector {
    let ((sin_u, cos_u), (sin_v, cos_v)) = (longitude.sin_cos(), latitude.sin_cos());
    Point::new(cos_v * cos_u, cos_v * sin_u, sin_v)
}

/// A triangle on the sphere about the origin, with corners counter-clockwise as seen from outside, as a STEP file.
fn triangle(corners: [Vector; 3]) -> String {
    let triple = |p: Vector| format!("({:?},{:?},{:?})", p.x, p.y, p.z);
    let mut data = format!(
        "{MILLIMETRES}#10=CARTESIAN_POINT('',(0.,0.,0.));#11=DIRECTION('',(0.,0.,1.));#12=DIRECTION('',(1.,0.,0.));\
         #13=AXIS2_PLACEMENT_3D('',#10,#11,#12);#14=SPHERICAL_SURFACE('',#13,{RADIUS:?});\n"
    );
    for (k, corner) in corners.iter().enumerate() {
        let (n, next) = (100 * (k + 1), 100 * ((k + 1) % 3 + 1));
        let axis = corner.cross(corners[(k + 1) % 3]).normalize();
        writeln!(
            data,
            "#{n}=VERTEX_POINT('',#{a});#{a}=CARTESIAN_POINT('',{});#{b}=DIRECTION('',{});#{c}=DIRECTION('',{});\
             #{d}=AXIS2_PLACEMENT_3D('',#10,#{b},#{c});#{e}=CIRCLE('',#{d},{RADIUS:?});\
             #{f}=EDGE_CURVE('',#{n},#{next},#{e},.T.);#{g}=ORIENTED_EDGE('',*,*,#{f},.T.);",
            triple(*corner * RADIUS),
            triple(axis),
            triple(*corner),
            a = n + 1,
            b = n + 2,
            c = n + 3,
            d = n + 4,
            e = n + 5,
            f = n + 6,
            g = n + 7,
        )
        .unwrap();
    }
    part21(&format!(
        "{data}#20=EDGE_LOOP('',(#107,#207,#307));#21=FACE_OUTER_BOUND('',#20,.T.);#22=ADVANCED_FACE('',(#21),#14,.T.);\
         #23=OPEN_SHELL('',(#22));#24=SHELL_BASED_SURFACE_MODEL('',(#23));\
         #25=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#24),#1);"
    ))
}

/// Two long sides, 7° apart at the equator, into a corner 10° from the pole: the chords of one crossed those of the other, by more than
/// both sag.
#[test]
fn narrow_triangles_into_a_corner_near_a_pole_need_no_repair() {
    for turn in 0..24 {
        let turn = 0.27 * f64::from(turn);
        let corners = [[7.45032, 0.0], [7.85398, 0.0], [5.88131, 1.39088]].map(|[u, v]| place([u + turn, v]));
        let text = triangle(corners);
        let model = read_bytes("triangle.stp", text.as_bytes(), &step::Settings::default()).expect("Part 21").model;
        // The solid angle of three directions.
        let [a, b, c] = corners;
        let (volume, cosines) = (a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let area = 2.0 * volume.atan2(cosines) * RADIUS * RADIUS;
        for tolerance in [[0.05, 0.2], [0.02, 0.02]] {
            let settings = Settings { measure: true, tolerance, ..Settings::default() };
            let report = tessellate(&model, &settings).report;
            assert_eq!(report.repaired, [], "{turn}, {tolerance:?}");
            assert_eq!(report.over_tolerance, Some(0), "{turn}, {tolerance:?}");
            assert!(
                (report.area_mm2 / area - 1.0).abs() < 0.15,
                "{turn}, {tolerance:?}: {} {area}",
                report.area_mm2
            );
        }
    }
}

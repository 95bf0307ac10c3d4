//! Conics turned about their own axis, as reflectors are made of: every place of such a surface comes twice, with opposite normals, and
//! only the loops of a face decide which is meant. Areas are those of quadrature over the profile.

use crate::faces::{area, close, import, points};
use lampyris::math::{Uv, Vector};
use std::f64::consts::PI;

/// A conic with its vertex in the origin and its axis along z: its record, the placement's origin height and direction of x along z, its
/// rim (radius and height), and the area of the cap up to there.
struct Conic {
    record: &'static str,
    origin: f64,
    along: f64,
    rim: [f64; 2],
    area: f64,
}

/// The area of a profile (radius and height by parameter, with derivatives) turned about z, from 0 to `end`, by Simpson's rule.
fn turned(profile: impl Fn(f64) -> [f64; 3], end: f64) -> f64 {
    let n = 2000;
    let at = |k: i32| {
        let [r, dr, dz] = profile(end * f64::from(k) / f64::from(n));
        2.0 * PI * r * dr.hypot(dz) * if k == 0 || k == n { 1.0 } else { f64::from(2 + 2 * (k % 2)) }
    };
    (0..=n).map(at).sum::<f64>() * end / f64::from(n) / 3.0
}

fn conics() -> [Conic; 3] {
    let t = 1.2f64;
    let (sin, cos) = t.sin_cos();
    let (sinh, cosh) = (t.sinh(), t.cosh());
    [
        Conic {
            record: "ELLIPSE('',#30,30.,20.)",
            origin: 30.0,
            along: -1.0,
            rim: [20.0 * sin, 30.0 - 30.0 * cos],
            area: turned(|x| [20.0 * x.sin(), 20.0 * x.cos(), 30.0 * x.sin()], t),
        },
        Conic {
            record: "PARABOLA('',#30,5.)",
            origin: 0.0,
            along: 1.0,
            rim: [10.0 * t, 5.0 * t * t],
            area: 8.0 * PI / 3.0 * 25.0 * ((1.0 + t * t).powf(1.5) - 1.0),
        },
        Conic {
            record: "HYPERBOLA('',#30,12.,7.)",
            origin: -12.0,
            along: 1.0,
            rim: [7.0 * sinh, 12.0 * cosh - 12.0],
            area: turned(|x| [7.0 * x.sinh(), 7.0 * x.cosh(), 12.0 * x.sinh()], t),
        },
    ]
}

/// A face on the turned conic, from its vertex to its rim: a whole turn cut open at a seam, or a quarter of a turn. `side` is 1 where its
/// first meridian runs along growing parameters, at x > 0, and −1 at x < 0; `sense` and `bound` are the flags of the face and its bound.
fn cap(conic: &Conic, quarter: bool, side: f64, sense: &str, bound: &str) -> String {
    let [r, z] = conic.rim;
    let meridian_sense = if side > 0.0 { ".T." } else { ".F." };
    let mut data = points(&[
        (10, [0., 0., conic.origin]),
        (11, [0., 0., 0.]),
        (12, [side * r, 0., z]),
        (13, [0., 0., z]),
        (14, [0., side * r, z]),
    ]);
    // y of the profile's placement is x of space, so that growing parameters run to x > 0; of the second meridian it is y.
    let along = conic.along;
    data += &format!(
        "#20=DIRECTION('',(0.,{along:?},0.));\n#21=DIRECTION('',(0.,0.,{along:?}));\n#22=DIRECTION('',(0.,0.,1.));\n\
         #23=DIRECTION('',({side:?},0.,0.));\n#24=DIRECTION('',({:?},0.,0.));\n\
         #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31={};\n#32=AXIS1_PLACEMENT('',#11,#22);\n#33=SURFACE_OF_REVOLUTION('',#31,#32);\n\
         #34=AXIS2_PLACEMENT_3D('',#13,#22,#23);\n#35=CIRCLE('',#34,{r:?});\n\
         #36=AXIS2_PLACEMENT_3D('',#10,#24,#21);\n#37={};\n\
         #40=VERTEX_POINT('',#11);\n#41=VERTEX_POINT('',#12);\n#42=VERTEX_POINT('',#14);\n\
         #50=EDGE_CURVE('',#40,#41,#31,{meridian_sense});\n",
        -along,
        conic.record,
        conic.record.replace("#30", "#36")
    );
    // About the outward normal the rim runs against the turn.
    data += if quarter {
        "#51=EDGE_CURVE('',#41,#42,#35,.T.);\n#52=EDGE_CURVE('',#40,#42,#37,SENSE);\n\
         #60=ORIENTED_EDGE('',*,*,#52,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n#62=ORIENTED_EDGE('',*,*,#50,.F.);\n"
    } else {
        "#51=EDGE_CURVE('',#41,#41,#35,.T.);\n\
         #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n#62=ORIENTED_EDGE('',*,*,#50,.F.);\n"
    };
    data.replace("SENSE", meridian_sense)
        + &format!(
            "#70=EDGE_LOOP('',(#60,#61,#62));\n#71=FACE_BOUND('',#70,{bound});\n#900=ADVANCED_FACE('',(#71),#33,{sense});\n"
        )
}

#[test]
fn faces_of_turned_conics_are_what_their_loops_enclose_on_either_half() {
    for conic in conics() {
        for quarter in [true, false] {
            // Where the meridian runs to x < 0 the file's normal points inwards: its face is turned, or its loop runs the other way.
            for (side, sense, bound, outward) in [
                (1.0, ".T.", ".T.", 1.0),
                (-1.0, ".F.", ".T.", 1.0),
                (1.0, ".F.", ".F.", -1.0),
                (-1.0, ".T.", ".F.", -1.0),
            ] {
                let which = format!("{} {quarter} {side} {sense} {bound}", conic.record);
                let import = import(&cap(&conic, quarter, side, sense, bound));
                let expected = conic.area * if quarter { 0.25 } else { 1.0 };
                assert!((area(&import) / expected - 1.0).abs() < 1e-4, "{which}: {} for {expected}", area(&import));
                assert_eq!(import.report.faces.repaired, 0, "{which}: {:?}", import.report.repairs);
                let face = &import.model.parts[0].shells[0].faces[0];
                let [u, v] = face.surface.domain().map(|[a, b]| 0.5 * (a + b));
                let d = face.surface.derivatives(Uv::new(u, v));
                let normal = d.du.cross(d.dv) * if face.reversed { -1.0 } else { 1.0 };
                let across = Vector::new(d.point.x, d.point.y, 0.0);
                assert!(normal.dot(across) * outward > 0.0, "{which}");
            }
        }
    }
}

#[test]
fn an_offset_of_a_turned_conic_lies_where_its_edges_are() {
    // A sphere of radius 10 as a turned circle, which is no ellipse in closed form where a trimmed curve says so, 2 mm farther out on its
    // one half and farther in on the other: the face, a quarter of a cap of radius 12, decides which half is meant.
    let rim = [12.0 * 0.8f64, 12.0 * 0.4];
    let list = [
        (10, [0., 0., 10.]),
        (11, [0., 0., -2.]),
        (12, [rim[0], 0., 10.0 - 12.0 * 0.6]),
        (13, [0., 0., 10.0 - 12.0 * 0.6]),
        (14, [0., rim[0], 10.0 - 12.0 * 0.6]),
    ];
    // The normal of the half that turns inwards is the face's too.
    for (distance, sense) in [(2.0, ".T."), (-2.0, ".F.")] {
        let data = points(&list)
            + &format!(
                "#20=DIRECTION('',(0.,-1.,0.));\n#21=DIRECTION('',(0.,0.,-1.));\n#22=DIRECTION('',(0.,0.,1.));\n\
                 #23=DIRECTION('',(1.,0.,0.));\n\
                 #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=ELLIPSE('',#30,10.,10.000000001);\n#32=AXIS1_PLACEMENT('',#11,#22);\n\
                 #33=SURFACE_OF_REVOLUTION('',#31,#32);\n#39=OFFSET_SURFACE('',#33,{distance:?},.F.);\n\
                 #34=AXIS2_PLACEMENT_3D('',#13,#22,#23);\n#35=CIRCLE('',#34,{:?});\n\
                 #36=CIRCLE('',#30,12.);\n#37=AXIS2_PLACEMENT_3D('',#10,#23,#21);\n#38=CIRCLE('',#37,12.);\n\
                 #40=VERTEX_POINT('',#11);\n#41=VERTEX_POINT('',#12);\n#42=VERTEX_POINT('',#14);\n\
                 #50=EDGE_CURVE('',#40,#41,#36,.T.);\n#51=EDGE_CURVE('',#41,#42,#35,.T.);\n#52=EDGE_CURVE('',#40,#42,#38,.T.);\n\
                 #60=ORIENTED_EDGE('',*,*,#52,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n#62=ORIENTED_EDGE('',*,*,#50,.F.);\n\
                 #70=EDGE_LOOP('',(#60,#61,#62));\n#71=FACE_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#71),#39,{sense});\n",
                rim[0]
            );
        close(area(&import(&data)), 0.25 * 2.0 * PI * 12.0 * 12.0 * 0.4, 1e-4);
    }
}

//! Offset surfaces against the closed forms that they are.

use crate::faces::{area, close, import, points};
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

/// A face #900 on #34 between the arcs #35 and #36, with corners #12 to #15, and straight edges between them.
pub(crate) const QUARTER: &str = "\
          #40=VERTEX_POINT('',#12);\n#41=VERTEX_POINT('',#13);\n#42=VERTEX_POINT('',#14);\n#43=VERTEX_POINT('',#15);\n\
          #50=EDGE_CURVE('',#40,#41,#35,.T.);\n#51=EDGE_CURVE('',#41,#42,$,.T.);\n\
          #52=EDGE_CURVE('',#43,#42,#36,.T.);\n#53=EDGE_CURVE('',#43,#40,$,.T.);\n\
          #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.T.);\n\
          #62=ORIENTED_EDGE('',*,*,#52,.F.);\n#63=ORIENTED_EDGE('',*,*,#53,.T.);\n\
          #70=EDGE_LOOP('',(#60,#61,#62,#63));\n#80=FACE_OUTER_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#80),#34,.T.);\n";

#[test]
fn an_offset_of_an_extrusion_without_end_is_an_extrusion() {
    // A circle of radius 5 extruded along z, 2 mm farther out: a quarter of a cylinder of radius 7 and height 4.
    let d = points(&[
        (10, [0., 0., 0.]),
        (11, [0., 0., 4.]),
        (12, [7., 0., 0.]),
        (13, [0., 7., 0.]),
        (14, [0., 7., 4.]),
        (15, [7., 0., 4.]),
    ]) + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=VECTOR('',#20,1.);\n\
          #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n\
          #32=CIRCLE('',#30,5.);\n#33=SURFACE_OF_LINEAR_EXTRUSION('',#32,#22);\n#34=OFFSET_SURFACE('',#33,2.,.F.);\n\
          #35=CIRCLE('',#30,7.);\n#36=CIRCLE('',#31,7.);\n"
        + QUARTER;
    close(area(&import(&d)), 7.0 * 0.5 * PI * 4.0, 1e-6);
}

#[test]
fn an_offset_of_a_cone_may_have_its_apex_beyond_the_origin() {
    // Half angle 45°, radius 1 at z = 0, 2√2 mm inwards: the radius is z − 3, from 1 to 3 on a quarter of a frustum.
    let d = points(&[
        (9, [0., 0., 0.]),
        (10, [0., 0., 4.]),
        (11, [0., 0., 6.]),
        (12, [1., 0., 4.]),
        (13, [0., 1., 4.]),
        (14, [0., 3., 6.]),
        (15, [3., 0., 6.]),
    ]) + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#29=AXIS2_PLACEMENT_3D('',#9,#20,#21);\n\
          #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n\
          #33=CONICAL_SURFACE('',#29,1.,0.7853981633974483);\n#34=OFFSET_SURFACE('',#33,-2.8284271247461903,.F.);\n\
          #35=CIRCLE('',#30,1.);\n#36=CIRCLE('',#31,3.);\n"
        + QUARTER;
    close(area(&import(&d)), 0.25 * PI * (1.0 + 3.0) * 2.0 * SQRT_2, 1e-6);
}

/// An octant of a sphere of radius 5 as a rational spline whose pole row is as round as rounding leaves it.
fn octant(noise: f64) -> String {
    let arc = [([1.0, 0.0], 1.0), ([1.0, 1.0], FRAC_1_SQRT_2), ([0.0, 1.0], 1.0)];
    let mut list = Vec::new();
    let mut weights = Vec::new();
    for (i, ([x, y], wu)) in arc.iter().enumerate() {
        let mut row = Vec::new();
        for (j, ([r, z], wv)) in arc.iter().enumerate() {
            let off = if j == 2 { noise * (i as f64 - 1.0) } else { 0.0 };
            list.push((300 + 3 * i as u32 + j as u32, [5.0 * x * r + off, 5.0 * y * r - 2.0 * off, 5.0 * z]));
            row.push(format!("{:?}", wu * wv));
        }
        weights.push(format!("({})", row.join(",")));
    }
    let rows = "((#300,#301,#302),(#303,#304,#305),(#306,#307,#308))";
    points(&list)
        + &format!(
            "#33=(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,{rows},.UNSPECIFIED.,.F.,.F.,.F.)\
             B_SPLINE_SURFACE_WITH_KNOTS((3,3),(3,3),(0.,1.),(0.,1.),.UNSPECIFIED.)GEOMETRIC_REPRESENTATION_ITEM()\
             RATIONAL_B_SPLINE_SURFACE(({}))REPRESENTATION_ITEM('')SURFACE());\n",
            weights.join(",")
        )
}

#[test]
fn an_offset_of_a_spline_has_its_pole() {
    for noise in [0.0, 3e-16, 1e-15] {
        let d = octant(noise)
            + &points(&[(10, [0., 0., 0.]), (12, [6., 0., 0.]), (13, [0., 6., 0.]), (14, [0., 0., 6.])])
            + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,1.,0.));\n\
               #34=OFFSET_SURFACE('',#33,1.,.F.);\n\
               #35=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#36=CIRCLE('',#35,6.);\n\
               #37=AXIS2_PLACEMENT_3D('',#10,#21,#22);\n#38=CIRCLE('',#37,6.);\n\
               #39=AXIS2_PLACEMENT_3D('',#10,#22,#20);\n#49=CIRCLE('',#39,6.);\n\
               #40=VERTEX_POINT('',#12);\n#41=VERTEX_POINT('',#13);\n#42=VERTEX_POINT('',#14);\n\
               #50=EDGE_CURVE('',#40,#41,#36,.T.);\n#51=EDGE_CURVE('',#41,#42,#38,.T.);\n#52=EDGE_CURVE('',#42,#40,#49,.T.);\n\
               #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.T.);\n#62=ORIENTED_EDGE('',*,*,#52,.T.);\n\
               #70=EDGE_LOOP('',(#60,#61,#62));\n#80=FACE_OUTER_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#80),#34,.T.);\n";
        close(area(&import(&d)), 18.0 * PI, 1e-5);
    }
}

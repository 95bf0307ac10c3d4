//! Faces as real exporters write them, in the smallest file that shows the trait, against closed forms.

use crate::files::{MILLIMETRES, part21};
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::PI;

/// A shell of face #900 in a file in millimetres and radians; `data` defines the face.
pub(crate) fn read(data: &str) -> Import {
    let text = part21(&format!(
        "{MILLIMETRES}#4=OPEN_SHELL('',(#900));\n#5=SHELL_BASED_SURFACE_MODEL('',(#4));\n\
         #6=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#5),#1);\n{data}"
    ));
    read_bytes("face.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// The same of a file without a fault, all of whose loops are in order.
pub(crate) fn import(data: &str) -> Import {
    let import = read(data);
    assert_eq!(import.report.problems, Vec::<String>::new());
    for part in &import.model.parts {
        for face in part.shells.iter().flat_map(|s| &s.faces) {
            assert_eq!(crate::support::violations(part, face), Vec::<String>::new());
        }
    }
    import
}

/// The area of the only face.
pub(crate) fn area(import: &Import) -> f64 {
    let faces = import.report.faces;
    assert_eq!((faces.converted, faces.refused), (1, 0), "{:?}", import.report.refusals);
    crate::support::measure_model(&import.model).area
}

pub(crate) fn close(a: f64, b: f64, relative: f64) {
    assert!((a / b - 1.0).abs() < relative, "{a} for {b}");
}

/// Points by id.
pub(crate) fn points(list: &[(u32, [f64; 3])]) -> String {
    list.iter().map(|(id, [x, y, z])| format!("#{id}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));\n")).collect()
}

/// A quarter of a torus tube around a rim, as its exporter cuts it open: along one edge that the loop uses twice.
fn rim(flag: &str) -> String {
    points(&[(10, [0., 0., 3.]), (11, [7., 0., 3.]), (12, [0., 0., 0.]), (13, [10., 0., 3.]), (14, [7., 0., 0.])])
        + &format!(
            "#20=DIRECTION('',(0.,0.,-1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,1.,0.));\n#23=DIRECTION('',(0.,0.,1.));\n\
             #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=TOROIDAL_SURFACE('',#30,7.,3.);\n\
             #32=AXIS2_PLACEMENT_3D('',#11,#22,#21);\n#33=CIRCLE('',#32,3.);\n\
             #34=AXIS2_PLACEMENT_3D('',#10,#23,#21);\n#35=CIRCLE('',#34,10.);\n\
             #36=AXIS2_PLACEMENT_3D('',#12,#23,#21);\n#37=CIRCLE('',#36,7.);\n\
             #40=VERTEX_POINT('',#13);\n#41=VERTEX_POINT('',#14);\n\
             #50=EDGE_CURVE('',#40,#41,#33,.T.);\n#51=EDGE_CURVE('',#40,#40,#35,.T.);\n#52=EDGE_CURVE('',#41,#41,#37,.T.);\n\
             #60=ORIENTED_EDGE('',*,*,#50,.F.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n\
             #62=ORIENTED_EDGE('',*,*,#50,.T.);\n#63=ORIENTED_EDGE('',*,*,#52,.T.);\n\
             #70=EDGE_LOOP('',(#60,#61,#62,#63));\n#71=FACE_BOUND('',#70,{flag});\n#900=ADVANCED_FACE('',(#71),#31,.T.);\n"
        )
}

#[test]
fn a_loop_that_runs_along_its_seam_bounds_the_face_whichever_way_it_runs() {
    // Pappus: the quarter circle of length 3π/2 has its centroid at 7 + 6/π.
    let expected = 2.0 * PI * (7.0 * 1.5 * PI + 9.0);
    for (flag, repaired) in [(".T.", 0), (".F.", 1)] {
        let import = import(&rim(flag));
        close(area(&import), expected, 1e-4);
        assert_eq!(import.report.faces.repaired, repaired, "{:?}", import.report.repairs);
    }
}

/// A unit square in the plane z = 0; orientation flags of the four uses and their order.
pub(crate) fn square(flags: [&str; 4], order: [usize; 4]) -> String {
    let mut d = points(&[(10, [0., 0., 0.]), (11, [1., 0., 0.]), (12, [1., 1., 0.]), (13, [0., 1., 0.])]);
    d += "#20=AXIS2_PLACEMENT_3D('',#10,$,$);\n#21=PLANE('',#20);\n";
    for k in 0..4 {
        d += &format!("#3{k}=VERTEX_POINT('',#1{k});\n#4{k}=EDGE_CURVE('',#3{k},#3{},$,.T.);\n", (k + 1) % 4);
        d += &format!("#5{k}=ORIENTED_EDGE('',*,*,#4{k},{});\n", flags[k]);
    }
    let list = order.map(|k| format!("#5{k}")).join(",");
    d + &format!(
        "#60=EDGE_LOOP('',({list}));\n#61=FACE_OUTER_BOUND('',#60,.T.);\n#900=ADVANCED_FACE('',(#61),#21,.T.);\n"
    )
}

#[test]
fn edges_against_their_neighbours_and_out_of_order_are_put_right() {
    let (t, f) = (".T.", ".F.");
    let order = [0, 1, 2, 3];
    for (flags, order, repaired) in [
        ([t; 4], order, 0),
        ([t, t, f, t], order, 1),
        ([f, t, t, t], order, 1),
        ([t; 4], [0, 2, 1, 3], 1),
        ([t, f, t, t], [2, 0, 1, 3], 1),
    ] {
        let import = import(&square(flags, order));
        close(area(&import), 1.0, 1e-12);
        assert_eq!(import.report.faces.repaired, repaired, "{flags:?} {order:?} {:?}", import.report.repairs);
        let uses = &import.model.parts[0].shells[0].faces[0].loops[0].uses;
        assert_eq!(uses.len(), 4, "steps between edges: {uses:?}");
    }
}

/// A bilinear patch over the unit square whose face has an edge that bulges over the border of the patch.
#[test]
fn an_edge_beside_the_border_of_its_surface_stays_in_the_domain() {
    let corners = [(10, [0., 0., 0.]), (11, [1., 0., 0.]), (12, [1., 1., 0.]), (13, [0., 1., 0.])];
    let mut d = points(&corners) + &points(&[(14, [0.3, -0.004, 0.]), (15, [0.7, 0.004, 0.])]);
    d += "#20=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#10,#13),(#11,#12)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n\
          #21=B_SPLINE_CURVE_WITH_KNOTS('',3,(#10,#14,#15,#11),.UNSPECIFIED.,.F.,.F.,(4,4),(0.,1.),.UNSPECIFIED.);\n";
    for k in 0..4 {
        let curve = if k == 0 { "#21" } else { "$" };
        d += &format!("#3{k}=VERTEX_POINT('',#1{k});\n#4{k}=EDGE_CURVE('',#3{k},#3{},{curve},.T.);\n", (k + 1) % 4);
        d += &format!("#5{k}=ORIENTED_EDGE('',*,*,#4{k},.T.);\n");
    }
    d += "#60=EDGE_LOOP('',(#50,#51,#52,#53));\n#61=FACE_OUTER_BOUND('',#60,.T.);\n#900=ADVANCED_FACE('',(#61),#20,.T.);\n";
    let import = import(&d);
    close(area(&import), 1.0, 1e-3);
    let face = &import.model.parts[0].shells[0].faces[0];
    // The cubic swings 4·10⁻³·√3/6 to the side.
    assert!((face.gap - 4e-3 * 3f64.sqrt() / 6.0).abs() < 2e-5, "{:e}", face.gap);
    for u in &face.loops[0].uses {
        let [a, b] = u.uv.domain();
        for k in 0..=400 {
            let uv = u.uv.evaluate(a + (b - a) * f64::from(k) / 400.0);
            assert!(uv.min_element() >= -2e-7 && uv.max_element() <= 1.0 + 2e-7, "{uv}");
        }
    }
}

/// A quarter of a tube of radius 0.7 bent at 0.625: it passes through the axis of the bend.
fn elbow(surface: &str) -> String {
    let list = [
        (10, [0.625, 0., 0.]),
        (11, [0., 0.625, 0.]),
        (12, [0., 0., 0.]),
        (13, [1.325, 0., 0.]),
        (14, [0., 1.325, 0.]),
    ];
    points(&list)
        + "#20=DIRECTION('',(0.,-1.,0.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,1.,0.));\n#23=DIRECTION('',(0.,0.,1.));\n\
           #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=CIRCLE('',#30,0.7);\n#32=AXIS2_PLACEMENT_3D('',#11,#21,#22);\n#33=CIRCLE('',#32,0.7);\n\
           #34=AXIS2_PLACEMENT_3D('',#12,#23,#21);\n#35=CIRCLE('',#34,1.325);\n#36=AXIS1_PLACEMENT('',#12,#23);\n"
        + surface
        + "#40=VERTEX_POINT('',#13);\n#41=VERTEX_POINT('',#14);\n\
           #50=EDGE_CURVE('',#40,#40,#31,.T.);\n#51=EDGE_CURVE('',#41,#41,#33,.T.);\n#52=EDGE_CURVE('',#40,#41,#35,.T.);\n\
           #60=ORIENTED_EDGE('',*,*,#52,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.T.);\n\
           #62=ORIENTED_EDGE('',*,*,#52,.F.);\n#63=ORIENTED_EDGE('',*,*,#50,.F.);\n\
           #70=EDGE_LOOP('',(#60,#61,#62,#63));\n#71=FACE_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#71),#39,.T.);\n"
}

#[test]
fn a_tube_bent_tighter_than_its_radius_is_one_face() {
    let (major, minor) = (0.625f64, 0.7f64);
    let v0 = (-major / minor).acos();
    let expected = 0.5 * PI * minor * (4.0 * minor * v0.sin() + 2.0 * major * (2.0 * v0 - PI));
    for surface in ["#39=SURFACE_OF_REVOLUTION('',#31,#36);\n", "#39=TOROIDAL_SURFACE('',#34,0.625,0.7);\n"] {
        // The quadrature takes the kink of the area at the axis in its stride up to 1e-3.
        close(area(&import(&elbow(surface))), expected, 1e-3);
    }
}

/// Part of a surface between a meridian arc, a parallel and another meridian arc, a quarter turn around z.
///
/// `top` is a point on the axis, `side` one at (r, 0, 0); the arcs have the given center height, radius and sense.
fn gore(surface: &str, top: f64, r: f64, center: [f64; 2], radius: f64) -> String {
    let [cx, cz] = center;
    points(&[
        (10, [0., 0., 0.]),
        (11, [r, 0., 0.]),
        (12, [0., r, 0.]),
        (13, [0., 0., top]),
        (14, [cx, 0., cz]),
        (15, [0., cx, cz]),
    ]) + &format!(
        "#20=DIRECTION('',(0.,-1.,0.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=DIRECTION('',(0.,1.,0.));\n#23=DIRECTION('',(0.,0.,1.));\n\
         #30=AXIS2_PLACEMENT_3D('',#14,#20,#21);\n#31=CIRCLE('',#30,{radius:?});\n\
         #32=AXIS2_PLACEMENT_3D('',#15,#21,#22);\n#33=CIRCLE('',#32,{radius:?});\n\
         #34=AXIS2_PLACEMENT_3D('',#10,#23,#21);\n#35=CIRCLE('',#34,{r:?});\n#36=AXIS1_PLACEMENT('',#10,#23);\n{surface}\
         #40=VERTEX_POINT('',#11);\n#41=VERTEX_POINT('',#12);\n#42=VERTEX_POINT('',#13);\n\
         #50=EDGE_CURVE('',#40,#41,#35,.T.);\n#51=EDGE_CURVE('',#41,#42,#33,.T.);\n#52=EDGE_CURVE('',#40,#42,#31,.T.);\n\
         #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.T.);\n#62=ORIENTED_EDGE('',*,*,#52,.F.);\n\
         #70=EDGE_LOOP('',(#60,#61,#62));\n#71=FACE_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#71),#39,.T.);\n"
    )
}

#[test]
fn a_circle_turned_about_its_own_diameter_is_a_sphere_on_the_side_where_it_starts() {
    for surface in [
        "#39=SURFACE_OF_REVOLUTION('',#31,#36);\n",
        // The same circle with its start on the other side of the axis, and one that starts on the axis.
        "#24=DIRECTION('',(-1.,0.,0.));\n#37=AXIS2_PLACEMENT_3D('',#10,#22,#24);\n#38=CIRCLE('',#37,2.);\n#39=SURFACE_OF_REVOLUTION('',#38,#36);\n",
        "#24=DIRECTION('',(0.,0.,-1.));\n#37=AXIS2_PLACEMENT_3D('',#10,#20,#24);\n#38=CIRCLE('',#37,2.);\n#39=SURFACE_OF_REVOLUTION('',#38,#36);\n",
    ] {
        let import = import(&gore(surface, 2.0, 2.0, [0.0, 0.0], 2.0));
        close(area(&import), 2.0 * PI, 1e-4);
        assert_eq!((import.report.by_surface.sphere, import.report.faces.repaired), (1, 0), "{:?}", import.report);
        assert!(!import.model.parts[0].shells[0].faces[0].reversed, "{surface}");
    }
}

#[test]
fn a_plain_torus_may_mean_the_inner_part_of_one_that_touches_itself() {
    // A lemon: arcs of radius 5 about (-3, 0, 0) and its like, from (2, 0, 0) to the axis at height 4. In the torus's own
    // parameters its normal points inwards there, so the face with the loop about the outside turns it around.
    let torus = "#39=TOROIDAL_SURFACE('',#34,3.,5.);\n";
    let import = import(&gore(torus, 4.0, 2.0, [-3.0, 0.0], 5.0).replace("#39,.T.", "#39,.F."));
    let v0 = 0.6f64.acos();
    close(area(&import), 0.5 * PI * 5.0 * (5.0 * v0.sin() - 3.0 * v0), 1e-4);
    assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
}

#[test]
fn a_canal_with_a_pole_at_both_ends_in_one_point_is_closed_at_the_right_one() {
    // A circle of radius 1 turned about its own tangent by a quarter, as a rational spline: both ends of v are the origin. The face
    // is the half above z = 0, which ends at the upper end of v.
    let circle = [(0., 0.), (0., -1.), (1., -1.), (2., -1.), (2., 0.), (2., 1.), (1., 1.), (0., 1.), (0., 0.)];
    let half = 0.5f64.sqrt();
    let (mut list, mut rows, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (along_x, along_y)) in [(1., 0.), (1., 1.), (0., 1.)].into_iter().enumerate() {
        let first = 100 + 9 * i as u32;
        list.extend((first..).zip(circle.map(|(r, z)| [r * along_x, r * along_y, z])));
        rows.push((first..first + 9).map(|k| format!("#{k}")).collect::<Vec<_>>().join(","));
        let weight = |j: usize| [1.0, half][i % 2] * [1.0, half][j % 2];
        weights.push((0..9).map(|j| format!("{:?}", weight(j))).collect::<Vec<_>>().join(","));
    }
    let surface = points(&list)
        + &format!(
            "#39=(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,(({})),.UNSPECIFIED.,.F.,.F.,.F.)\
             B_SPLINE_SURFACE_WITH_KNOTS((3,3),(3,2,2,2,3),(0.,1.),(0.,0.25,0.5,0.75,1.),.UNSPECIFIED.)\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE((({})))REPRESENTATION_ITEM('')SURFACE());\n",
            rows.join("),("),
            weights.join("),(")
        );
    let import = import(&gore(&surface, 0.0, 2.0, [1.0, 0.0], 1.0));
    // Half of the tube of a torus whose radii are both 1, over a quarter turn.
    close(area(&import), 0.5 * PI * PI, 1e-4);
    assert_eq!((import.report.faces.converted, import.report.faces.repaired), (1, 0), "{:?}", import.report);
}

/// The unit square with other geometry for its first edge.
fn square_along(curve: &str) -> String {
    square([".T."; 4], [0, 1, 2, 3])
        .replace("#40=EDGE_CURVE('',#30,#31,$,.T.)", "#40=EDGE_CURVE('',#30,#31,#80,.T.)")
        + curve
}

#[test]
fn a_line_that_passes_a_vertex_by_gives_way_to_both() {
    // Of the edge from (0, 0, 0) to (1, 0, 0): half a millimetre beside it and 0.4 above; from its start, and 0.05 beside its end.
    for (from, along) in [("(0.3,-0.5,0.4)", "(1.,0.,0.)"), ("(0.,0.,0.)", "(1.,-0.05,0.)")] {
        let line = format!(
            "#80=LINE('',#81,#82);\n#81=CARTESIAN_POINT('',{from});\n#82=VECTOR('',#83,1.);\n#83=DIRECTION('',{along});\n"
        );
        let import = import(&square_along(&line));
        close(area(&import), 1.0, 1e-12);
        assert_eq!(import.report.faces.refused, 0, "{:?}", import.report.refusals);
        assert_eq!(import.report.faces.repaired, 1, "{:?}", import.report.repairs);
    }
    // By as little as files state that points may be apart, nothing is reported.
    let line = "#80=LINE('',#81,#82);\n#81=CARTESIAN_POINT('',(0.,0.,0.));\n#82=VECTOR('',#83,1.);\n#83=DIRECTION('',(1.,-0.005,0.));\n";
    let import = import(&square_along(line));
    close(area(&import), 1.0, 1e-12);
    assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
}

#[test]
fn edges_given_only_in_a_parameter_plane_or_as_an_offset_are_converted() {
    let plane = "#81=PCURVE('',#21,#82);\n#82=DEFINITIONAL_REPRESENTATION('',(#83),$);\n#83=LINE('',#84,#85);\n\
                 #84=CARTESIAN_POINT('',(0.,0.));\n#85=VECTOR('',#86,1.);\n#86=DIRECTION('',(1.,0.));\n";
    let arc = "#81=PCURVE('',#21,#82);\n#82=DEFINITIONAL_REPRESENTATION('',(#83),$);\n\
               #83=B_SPLINE_CURVE_WITH_KNOTS('',2,(#84,#85,#86),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);\n\
               #84=CARTESIAN_POINT('',(0.,0.));\n#85=CARTESIAN_POINT('',(0.5,-0.3));\n#86=CARTESIAN_POINT('',(1.,0.));\n";
    // A parabola of sagitta 0.15 adds two thirds of its box.
    for (curve, expected) in [
        (format!("#80=SURFACE_CURVE('',$,(#81),.PCURVE_S1.);\n{arc}"), 1.1),
        (arc.replace("#81=", "#80="), 1.1),
        // Three corners in the parameter plane, 0.2 and 0.1 below the square: trapezoids and triangles by the rule.
        ("#80=PCURVE('',#21,#82);\n#82=DEFINITIONAL_REPRESENTATION('',(#83),$);\n#83=POLYLINE('',(#84,#85,#86,#87,#88));\n\
          #84=CARTESIAN_POINT('',(0.,0.));\n#85=CARTESIAN_POINT('',(0.25,-0.2));\n#86=CARTESIAN_POINT('',(0.5,-0.2));\n\
          #87=CARTESIAN_POINT('',(0.75,-0.1));\n#88=CARTESIAN_POINT('',(1.,0.));\n".into(), 1.0 + 0.25 * (0.1 + 0.2 + 0.15 + 0.05)),
        (format!("#80=TRIMMED_CURVE('',#89,(0.),(1.),.T.,.PARAMETER.);\n#89=SURFACE_CURVE('',#87,(#81),.CURVE_3D.);\n#87=LINE('',#10,#88);\n#88=VECTOR('',#90,1.);\n#90=DIRECTION('',(1.,0.,0.));\n{plane}"), 1.0),
        // A line 2 mm aside, moved back along reference direction × tangent = z × x = y.
        ("#80=OFFSET_CURVE_3D('',#81,2.,.F.,#82);\n#81=LINE('',#83,#84);\n#82=DIRECTION('',(0.,0.,1.));\n#83=CARTESIAN_POINT('',(0.,-2.,0.));\n\
          #84=VECTOR('',#85,1.);\n#85=DIRECTION('',(1.,0.,0.));\n".into(), 1.0),
        // A circle of radius 1.5 about (0.5, 0, 0), 1 mm towards its center: half a disc of radius 0.5 more.
        ("#80=OFFSET_CURVE_3D('',#81,1.,.F.,#82);\n#81=CIRCLE('',#83,1.5);\n#82=DIRECTION('',(0.,0.,1.));\n#83=AXIS2_PLACEMENT_3D('',#84,#82,#85);\n\
          #84=CARTESIAN_POINT('',(0.5,0.,0.));\n#85=DIRECTION('',(1.,0.,0.));\n".into(), 1.0 + PI / 8.0),
        // The same circle as a spline would have it: a composite of one segment.
        ("#80=OFFSET_CURVE_3D('',#86,1.,.F.,#82);\n#86=COMPOSITE_CURVE('',(#87),.F.);\n#87=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#88);\n\
          #88=TRIMMED_CURVE('',#81,(3.141592653589793),(6.283185307179586),.T.,.PARAMETER.);\n#81=CIRCLE('',#83,1.5);\n#82=DIRECTION('',(0.,0.,1.));\n\
          #83=AXIS2_PLACEMENT_3D('',#84,#82,#85);\n#84=CARTESIAN_POINT('',(0.5,0.,0.));\n#85=DIRECTION('',(1.,0.,0.));\n".into(), 1.0 + PI / 8.0),
        // A straight line 2 mm aside whose spline begins and ends with its point twice: it stands still there.
        ("#80=OFFSET_CURVE_3D('',#81,2.,.F.,#82);\n#82=DIRECTION('',(0.,0.,1.));\n\
          #81=B_SPLINE_CURVE_WITH_KNOTS('',3,(#83,#83,#84,#84),.UNSPECIFIED.,.F.,.F.,(4,4),(0.,1.),.UNSPECIFIED.);\n\
          #83=CARTESIAN_POINT('',(0.,-2.,0.));\n#84=CARTESIAN_POINT('',(1.,-2.,0.));\n".into(), 1.0),
        // From the second to the fourth point of a polyline, whose parameter counts points: a triangle 0.4 high below the square.
        ("#80=COMPOSITE_CURVE('',(#87),.F.);\n#87=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#88);\n\
          #88=TRIMMED_CURVE('',#81,(PARAMETER_VALUE(1.)),(PARAMETER_VALUE(3.)),.T.,.PARAMETER.);\n#81=POLYLINE('',(#82,#83,#84,#85,#86));\n\
          #82=CARTESIAN_POINT('',(-3.,0.,0.));\n#83=CARTESIAN_POINT('',(0.,0.,0.));\n#84=CARTESIAN_POINT('',(0.5,-0.4,0.));\n\
          #85=CARTESIAN_POINT('',(1.,0.,0.));\n#86=CARTESIAN_POINT('',(2.,0.,0.));\n".into(), 1.2),
    ] {
        close(area(&import(&square_along(&curve))), expected, 1e-4);
    }
}

/// Aside of a corner the two sides of a curve part: what would bridge them is not in the file.
#[test]
fn the_offset_of_a_curve_with_a_corner_is_refused() {
    let curve = "#80=OFFSET_CURVE_3D('',#81,1.,.F.,#82);\n#82=DIRECTION('',(0.,0.,1.));\n\
        #81=B_SPLINE_CURVE_WITH_KNOTS('',1,(#83,#84,#85),.UNSPECIFIED.,.F.,.F.,(2,1,2),(0.,0.5,1.),.UNSPECIFIED.);\n\
        #83=CARTESIAN_POINT('',(0.,-1.,0.));\n#84=CARTESIAN_POINT('',(0.5,-1.2,0.));\n#85=CARTESIAN_POINT('',(1.,-1.,0.));\n";
    let import = import(&square_along(curve));
    assert_eq!(import.report.faces.refused, 1);
    let reason = &import.report.refusals[0].reason;
    assert!(reason.contains("#80 OFFSET_CURVE_3D") && reason.contains("no curve follows it"), "{reason}");
}

#[test]
fn every_context_has_its_own_units() {
    let own = |k: u32, unit: &str| {
        square([".T."; 4], [0, 1, 2, 3]).replace('#', &format!("#{k}"))
            + &format!(
                "#{k}01=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{k}02))REPRESENTATION_CONTEXT('',''));\n{}\n\
                 #{k}04=OPEN_SHELL('',(#{k}900));\n#{k}05=SHELL_BASED_SURFACE_MODEL('',(#{k}04));\n\
                 #{k}06=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{k}05),#{k}01);\n",
                unit.replace("@", &format!("#{k}0"))
            )
    };
    let units = [
        ("@2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MICRO.,.METRE.));", 1e-3),
        ("@2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));", 1e3),
        (
            "@2=(CONVERSION_BASED_UNIT('FOOT',@3)LENGTH_UNIT()NAMED_UNIT(@9));@3=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(12.),@7);\
          @7=(CONVERSION_BASED_UNIT('INCH',@8)LENGTH_UNIT()NAMED_UNIT(@9));@8=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),@10);\
          @10=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));@9=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);",
            304.8,
        ),
        ("@2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));", 10.0),
    ];
    let data: String = units.iter().enumerate().map(|(k, (u, _))| own(k as u32 + 1, u)).collect();
    let text = part21(&data);
    let import = read_bytes("units.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
    assert_eq!(import.report.faces.converted, 4, "{:?} {:?}", import.report.refusals, import.report.problems);
    let mut sides: Vec<f64> =
        import.model.parts.iter().map(|p| crate::support::measure(&p.shells[0].faces[0]).area.sqrt()).collect();
    sides.sort_by(f64::total_cmp);
    for (side, expected) in sides.into_iter().zip([1e-3, 10.0, 304.8, 1e3]) {
        close(side, expected, 1e-9);
    }
}

/// A bicubic sheet of 40 × 40 spans whose only dip is one control point in the middle of nowhere.
#[test]
fn the_box_finds_a_dip_between_coarse_samples() {
    let n = 43;
    let (mut data, mut rows) = (String::new(), Vec::new());
    for i in 0..n {
        let mut row = Vec::new();
        for j in 0..n {
            let id = 1000 + i * n + j;
            let z = if (i, j) == (29, 18) { -9.0 } else { 0.0 };
            data += &format!("#{id}=CARTESIAN_POINT('',({i}.,{j}.,{z:?}));\n");
            row.push(format!("#{id}"));
        }
        rows.push(format!("({})", row.join(",")));
    }
    let knots: Vec<String> = (0..=40).map(|k| format!("{k}.")).collect();
    let multiplicities = format!("(4,{}4)", "1,".repeat(39));
    data += &format!(
        "#900=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,({}),.UNSPECIFIED.,.F.,.F.,.F.,{multiplicities},{multiplicities},({k}),({k}),.UNSPECIFIED.);\n\
         #7=GEOMETRIC_SET('',(#900));\n#8=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#7),#1);\n",
        rows.join(","),
        k = knots.join(",")
    );
    let import = import(&data);
    // A uniform cubic reaches 4/9 of a lone control point: (2/3)² of it.
    let [lo, hi] = import.report.bbox_mm.expect("a face");
    assert!((lo[2] + 4.0).abs() < 1e-6 && hi[2] == 0.0, "{lo:?} {hi:?}");
}

#[test]
fn rectangles_of_parameters_are_in_the_units_of_their_context() {
    // A belt of a sphere from 0° to 90° around and from 30° up to the pole, in degrees and centimetres.
    let data = "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
        #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));\n\
        #3=(CONVERSION_BASED_UNIT('DEGREE',#4)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
        #4=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#5);\n\
        #5=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
        #10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=AXIS2_PLACEMENT_3D('',#10,$,$);\n#12=SPHERICAL_SURFACE('',#11,2.);\n\
        #13=RECTANGULAR_TRIMMED_SURFACE('',#12,0.,90.,30.,90.,.T.,.T.);\n#14=GEOMETRIC_SET('',(#13));\n\
        #15=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#14),#1);\n";
    let text = part21(data);
    let import = read_bytes("belt.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
    // A zone's area is that of the cylinder around it: a quarter of 2π·20·(20 − 10) mm².
    close(area(&import), 100.0 * PI, 1e-4);
    let [lo, hi] = import.report.bbox_mm.expect("a face");
    let side = 20.0 * 30f64.to_radians().cos();
    for (got, expected) in lo.into_iter().chain(hi).zip([0.0, 0.0, 10.0, side, side, 20.0]) {
        assert!((got - expected).abs() < 1e-6, "{lo:?} {hi:?}");
    }
}

/// ISO 10303-42: each flag says whether a parameter runs with that of the basis surface; the normal is ∂u × ∂v of the parameters as they
/// run. One that runs against it starts where it otherwise ends.
#[test]
fn a_rectangle_that_runs_against_one_parameter_has_the_other_normal() {
    for [with_u, with_v] in [[true, true], [false, true], [true, false], [false, false]] {
        let range = |with: bool, [a, b]: [&str; 2]| if with { format!("{a},{b}") } else { format!("{b},{a}") };
        let flag = |with: bool| if with { ".T." } else { ".F." };
        let data = format!(
            "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
            #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
            #3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
            #10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=AXIS2_PLACEMENT_3D('',#10,$,$);\n#12=SPHERICAL_SURFACE('',#11,20.);\n\
            #13=RECTANGULAR_TRIMMED_SURFACE('',#12,{},{},{},{});\n#14=GEOMETRIC_SET('',(#13));\n\
            #15=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#14),#1);\n",
            range(with_u, ["0.", "1.5"]),
            range(with_v, ["0.5", "1."]),
            flag(with_u),
            flag(with_v),
        );
        let text = part21(&data);
        let import = read_bytes("zone.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
        close(area(&import), 1.5 * 20.0 * 20.0 * (1f64.sin() - 0.5f64.sin()), 1e-4);
        let mesh = lampyris::tessellate::tessellate(&import.model, &Default::default()).mesh;
        let outward = mesh.vertices.iter().map(|v| v.normal.dot(mesh.positions[v.position as usize]).signum());
        let expected = if with_u == with_v { 1.0 } else { -1.0 };
        assert!(outward.clone().count() > 0 && outward.clone().all(|side| side == expected), "{with_u} {with_v}");
    }
}

/// From one end of the period back to the other, with the sense of the parameter: all around, as the other way.
#[test]
fn a_rectangle_from_the_end_of_a_period_to_its_start_is_all_of_it() {
    for around in ["0.,6.283185307179586", "6.283185307179586,0.", "6.28318530718,0."] {
        let data = format!(
            "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
            #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
            #3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
            #10=CARTESIAN_POINT('',(0.,0.,0.));\n#11=AXIS2_PLACEMENT_3D('',#10,$,$);\n#12=CYLINDRICAL_SURFACE('',#11,5.);\n\
            #13=RECTANGULAR_TRIMMED_SURFACE('',#12,{around},0.,10.,.T.,.T.);\n#14=GEOMETRIC_SET('',(#13));\n\
            #15=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#14),#1);\n"
        );
        let text = part21(&data);
        let import = read_bytes("tube.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
        assert_eq!(import.report.faces.refused, 0, "{around}: {:?}", import.report.refusals);
        close(area(&import), 100.0 * PI, 1e-4);
    }
}

/// A sphere whose points are all at the origin, and whose radius is where doubles are a millimetre apart.
#[test]
fn a_face_that_reaches_beyond_all_rounding_is_refused_by_name() {
    let sphere = |radius: &str| {
        points(&[(10, [0.0; 3])])
            + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n"
            + &format!("#39=SPHERICAL_SURFACE('',#30,{radius});\n")
            + "#40=VERTEX_POINT('',#10);\n#50=VERTEX_LOOP('',#40);\n#51=FACE_BOUND('',#50,.T.);\n#900=ADVANCED_FACE('',(#51),#39,.T.);\n"
    };
    close(area(&import(&sphere("5."))), 100.0 * PI, 1e-5);
    let far = import(&sphere("1.E16"));
    assert_eq!((far.report.faces.converted, far.report.faces.refused), (0, 1));
    let reason = &far.report.refusals[0].reason;
    assert!(reason.contains("#39 SPHERICAL_SURFACE") && reason.contains("1e12 mm"), "{reason}");
}

/// A solid whose shell is written inside out is turned, and a void is left as it is.
#[test]
fn the_shell_of_a_solid_that_is_inside_out_is_turned() {
    let path = crate::files::fixture("step/lens_planoconvex_analytic.stp");
    let text = std::fs::read_to_string(path).unwrap();
    let solid = text.find("MANIFOLD_SOLID_BREP(").expect("a solid");
    let shell = solid + text[solid..].find('#').unwrap();
    let end = shell + text[shell..].find(')').unwrap();
    let turned = format!("#900000=ORIENTED_CLOSED_SHELL('',*,{},.F.);\nENDSEC;\nEND-ISO", &text[shell..end]);
    let other = format!("{}#900000{}", &text[..shell], &text[end..]);
    let place = other.rfind("ENDSEC;").unwrap();
    let other = format!("{}{turned}{}", &other[..place], &other[place..].split_once("END-ISO").unwrap().1);
    let read = |text: &str| read_bytes("lens.stp", text.as_bytes(), &Settings::default()).expect("Part 21");
    let (good, mended) = (read(&text), read(&other));
    let sides = |i: &Import| -> Vec<bool> {
        i.model.parts.iter().flat_map(|p| &p.shells).flat_map(|s| &s.faces).map(|f| f.reversed).collect()
    };
    assert_eq!(sides(&good), sides(&mended));
    assert!(!good.report.repairs.iter().any(|r| r.reason.contains("inside out")));
    assert_eq!(mended.report.repairs.iter().filter(|r| r.reason.contains("inside out")).count(), 1);
    // A shell is no face.
    assert_eq!(mended.report.faces.repaired, 0);
}

//! Solids given as a recipe: areas, volumes and closed shells against their formulas.

use crate::files::{MILLIMETRES, part21};
use crate::support::{measure_model, violations};
use lampyris::math::{Point, Vector};
use lampyris::step::{Import, Settings, read_bytes};
use std::f64::consts::{PI, TAU};

/// Common points, directions and placements, and one solid #900.
fn import(data: &str) -> Import {
    import_with(data, &Settings::default())
}

/// The same with other settings.
fn import_with(data: &str, settings: &Settings) -> Import {
    let text = part21(&format!(
        "{MILLIMETRES}\
         #6=SHAPE_REPRESENTATION('',(#900),#1);\n\
         #10=CARTESIAN_POINT('',(1.,2.,3.));\n#11=DIRECTION('',(0.,0.6,0.8));\n#12=DIRECTION('',(1.,0.,0.));\n\
         #13=AXIS2_PLACEMENT_3D('',#10,#11,#12);\n#14=AXIS1_PLACEMENT('',#10,#11);\n{data}"
    ));
    read_bytes("recipe.stp", text.as_bytes(), settings).expect("Part 21")
}

/// Area and volume of the only solid, whose every edge is used twice, once each way.
fn closed_solid(data: &str) -> [f64; 2] {
    let import = import(data);
    assert_eq!(import.report.faces.refused, 0, "{data}: {:?}", import.report.refusals);
    let part = &import.model.parts[0];
    assert!(part.shells.len() == 1 && part.shells[0].closed, "{data}");
    let mut uses = vec![0i32; part.edges.len()];
    let mut count = vec![0; part.edges.len()];
    for face in &part.shells[0].faces {
        assert_eq!(violations(part, face), Vec::<String>::new(), "{data}");
        for u in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(edge) = u.edge {
                uses[edge.0 as usize] += if u.reversed != face.reversed { -1 } else { 1 };
                count[edge.0 as usize] += 1;
            }
        }
    }
    assert!(count.iter().all(|n| *n == 2 || *n == 0) && uses.iter().all(|n| *n == 0), "{data}: {count:?} {uses:?}");
    let measure = measure_model(&import.model);
    [measure.area, measure.volume]
}

fn check(data: &str, area: f64, volume: f64) {
    let [a, v] = closed_solid(data);
    assert!((a / area - 1.0).abs() < 1e-4 && (v / volume - 1.0).abs() < 1e-4, "{data}: {a} {area}, {v} {volume}");
}

#[test]
fn csg_primitives_have_the_areas_and_volumes_of_their_formulas() {
    check("#900=BLOCK('',#13,2.,3.,4.);\n", 52.0, 24.0);
    check("#900=CSG_SOLID('',#20);\n#20=BLOCK('',#13,2.,3.,4.);\n", 52.0, 24.0);
    let slant = 5f64.hypot(0.0).hypot(3.0);
    check("#900=RIGHT_ANGULAR_WEDGE('',#13,6.,3.,4.,1.);\n", 21.0 + 4.0 * (6.0 + 3.0 + 1.0 + slant), 42.0);
    check("#900=RIGHT_ANGULAR_WEDGE('',#13,4.,3.,2.,0.);\n", 12.0 + 2.0 * 12.0, 12.0);
    check("#900=SPHERE('',2.,#10);\n", 16.0 * PI, 32.0 * PI / 3.0);
    check("#900=TORUS('',#14,5.,2.);\n", 40.0 * PI * PI, 40.0 * PI * PI);
    check("#900=RIGHT_CIRCULAR_CYLINDER('',#14,4.,2.);\n", 8.0 * PI + 16.0 * PI, 16.0 * PI);
    // A cone from its apex: radius 3 at height 4; a frustum from 1 to 1 + 4 tan.
    let angle = 0.75f64.atan();
    check(&format!("#900=RIGHT_CIRCULAR_CONE('',#14,4.,0.,{angle:?});\n"), 9.0 * PI + 15.0 * PI, 12.0 * PI);
    let frustum = format!("#900=RIGHT_CIRCULAR_CONE('',#14,4.,1.,{angle:?});\n");
    check(&frustum, PI * (1.0 + 16.0) + PI * 5.0 * 5.0, PI * 4.0 / 3.0 * (1.0 + 4.0 + 16.0));
}

#[test]
fn the_base_of_a_cone_lies_behind_its_placement() {
    let angle = 0.75f64.atan();
    let import = import(&format!("#900=RIGHT_CIRCULAR_CONE('',#14,4.,0.,{angle:?});\n"));
    let (tip, axis) = (Point::new(1.0, 2.0, 3.0), Vector::new(0.0, 0.6, 0.8));
    let vertices = &import.model.parts[0].vertices;
    assert!(!vertices.is_empty());
    for v in vertices {
        let height = (*v - tip).dot(axis);
        let radius = (*v - tip - height * axis).length();
        let is_on_base = (height + 4.0).abs() < 1e-12 && ((radius - 3.0).abs() < 1e-12 || radius < 1e-12);
        assert!(is_on_base || (*v - tip).length() < 1e-12, "{v}");
    }
}

#[test]
fn solids_of_recipes_that_are_not_built_are_refused_by_name() {
    let solids = [
        ("ELLIPSOID", "#13,5.,4.,3."),
        ("ECCENTRIC_CONE", "#13,5.,4.,3.,0.,0.,0.5"),
        ("RECTANGULAR_PYRAMID", "#13,5.,4.,3."),
        ("FACETED_PRIMITIVE", "(#10)"),
        ("CONVEX_HEXAHEDRON", "(#10)"),
        ("CYCLIDE_SEGMENT_SOLID", "#13,5.,4.,3.,0.5,0.5"),
    ];
    for (name, attributes) in solids {
        let import = import(&format!("#900={name}('',{attributes});\n"));
        let refusals = &import.report.refusals;
        assert!(refusals.len() == 1 && refusals[0].entity.contains(name), "{name}: {refusals:?}");
    }
}

/// A rectangle of 2 × 4 with a round hole of radius 0.5, in the plane of x and z, 3 mm from the z axis.
const AREA: &str = "#20=DIRECTION('',(0.,-1.,0.));\n#21=DIRECTION('',(0.,0.,1.));\n#22=CARTESIAN_POINT('',(3.,0.,0.));\n\
                    #23=AXIS2_PLACEMENT_3D('',#22,#20,#12);\n#24=PLANE('',#23);\n\
                    #25=CARTESIAN_POINT('',(5.,0.,0.));\n#26=CARTESIAN_POINT('',(5.,0.,4.));\n#27=CARTESIAN_POINT('',(3.,0.,4.));\n\
                    #28=POLYLINE('',(#22,#25));\n#29=POLYLINE('',(#25,#26));\n#30=POLYLINE('',(#26,#27));\n#31=POLYLINE('',(#27,#22));\n\
                    #32=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#28);\n#33=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#29);\n\
                    #34=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#30);\n#35=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#31);\n\
                    #36=OUTER_BOUNDARY_CURVE('',(#32,#33,#34,#35),.F.);\n\
                    #37=CARTESIAN_POINT('',(4.,0.,2.));\n#38=AXIS2_PLACEMENT_3D('',#37,#20,#12);\n#39=CIRCLE('',#38,0.5);\n\
                    #40=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#39);\n#41=BOUNDARY_CURVE('',(#40),.F.);\n\
                    #42=CURVE_BOUNDED_SURFACE('',#24,(#36,#41),.F.);\n\
                    #43=CARTESIAN_POINT('',(0.,0.,0.));\n#44=AXIS1_PLACEMENT('',#43,#21);\n";

#[test]
fn areas_are_swept_along_and_around_either_way() {
    let hole = 0.25 * PI;
    let (area, border) = (8.0 - hole, 12.0 + PI);
    for direction in ["(0.,1.,0.)", "(0.,-1.,0.)", "(0.,-0.8,0.6)"] {
        let data = format!("{AREA}#50=DIRECTION('',{direction});\n#900=EXTRUDED_AREA_SOLID('',#42,#50,5.);\n");
        if direction.contains("0.8") {
            let [_, volume] = closed_solid(&data);
            assert!((volume / (area * 4.0) - 1.0).abs() < 1e-4, "{volume}");
        } else {
            check(&data, 2.0 * area + 5.0 * border, 5.0 * area);
        }
    }
    // Pappus: the centroids of rectangle, hole and both borders are at radius 4.
    for angle in [TAU, 1.2] {
        let ends = if angle == TAU { 0.0 } else { 2.0 * area };
        let data = format!("{AREA}#900=REVOLVED_AREA_SOLID('',#42,#44,{angle:?});\n");
        check(&data, ends + 4.0 * angle * border, 4.0 * angle * area);
    }
}

#[test]
fn a_boolean_is_refused_by_name() {
    let import =
        import("#900=CSG_SOLID('',#20);\n#20=BOOLEAN_RESULT('',.UNION.,#21,#21);\n#21=BLOCK('',#13,2.,3.,4.);\n");
    assert_eq!((import.report.faces.converted, import.report.faces.refused), (0, 1));
    assert_eq!(import.report.refusals[0].entity, "BOOLEAN_RESULT");
}

/// Edges of a full circle about #13 in `count` arcs, as a loop numbered `id`; statements from `id` on.
fn circle_loop(id: usize, radius: f64, count: usize) -> String {
    // The axes of #13, by hand.
    let (x, y) = (Vector::X, Vector::new(0.0, 0.8, -0.6));
    let mut text = format!("#{}=CIRCLE('',#13,{radius:?});\n", id + 1);
    let (vertex, edge) = (|k: usize| id + 10 + 3 * (k % count), |k: usize| id + 12 + 3 * k);
    for k in 0..count {
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        let p = Point::new(1.0, 2.0, 3.0) + radius * (cos * x + sin * y);
        text += &format!("#{}=VERTEX_POINT('',#{});\n", vertex(k), vertex(k) + 1);
        text += &format!("#{}=CARTESIAN_POINT('',({:?},{:?},{:?}));\n", vertex(k) + 1, p.x, p.y, p.z);
        text += &format!("#{}=EDGE_CURVE('',#{},#{},#{},.T.);\n", edge(k), vertex(k), vertex(k + 1), id + 1);
        text += &format!("#{}=ORIENTED_EDGE('',*,*,#{},.T.);\n", id + 100 + k, edge(k));
    }
    let uses: Vec<String> = (0..count).map(|k| format!("#{}", id + 100 + k)).collect();
    text + &format!("#{id}=EDGE_LOOP('',({}));\n", uses.join(","))
}

#[test]
fn walls_of_tubes_may_be_thinner_than_the_sag_of_their_circles_arcs() {
    for [outer, inner] in [[1, 1], [1, 3], [3, 1]] {
        let data = circle_loop(1000, 50.0, outer)
            + &circle_loop(2000, 49.5, inner)
            + "#20=PLANE('',#13);\n#21=FACE_OUTER_BOUND('',#1000,.T.);\n#22=FACE_BOUND('',#2000,.F.);\n\
               #23=ADVANCED_FACE('',(#21,#22),#20,.T.);\n#900=EXTRUDED_FACE_SOLID('',#23,#11,20.);\n";
        let ends = PI * (50.0 * 50.0 - 49.5 * 49.5);
        let [area, volume] = closed_solid(&data);
        // The measure's chords leave out 6e-6 of a disc, which is a hundred times as much of a wall of R/100; inside out nothing is left.
        assert!(
            (area / (2.0 * ends + 20.0 * TAU * 99.5) - 1.0).abs() < 1e-3,
            "{outer} and {inner} edges: {area} mm²"
        );
        assert!((volume / (20.0 * ends) - 1.0).abs() < 1e-3, "{outer} and {inner} edges: {volume} mm³");
    }
}

/// A tolerance above that of vertices, or one that is no number, is a setting like any other.
#[test]
fn no_tolerance_of_uv_curves_makes_reading_panic() {
    for uv_tolerance in [1e-6, 0.01, f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let settings = Settings { uv_tolerance, face_budget: 10_000, ..Settings::default() };
        let import = import_with("#900=BLOCK('',#13,2.,3.,4.);\n", &settings);
        assert_eq!(import.report.faces.found, if import.model.parts.is_empty() { 1 } else { 6 }, "{uv_tolerance}");
    }
}

//! Facets look the way their surface does, also where a border's chord sags along the surface.

use crate::files::{MILLIMETRES, part21};
use lampyris::math::{Point, Vector};
use lampyris::step::{self, read_bytes};
use lampyris::tessellate::{Settings, tessellate};

/// The cap of a ball of `radius` about the origin beyond a plane across `axis`, of unit length, at `height`, as a STEP file.
fn cap(radius: f64, axis: Vector, height: f64) -> String {
    let triple = |p: Vector| format!("({:?},{:?},{:?})", p.x, p.y, p.z);
    let side = axis.cross(Vector::Z).normalize();
    let rim = (radius * radius - height * height).sqrt();
    part21(&format!(
        "{MILLIMETRES}#10=CARTESIAN_POINT('',(0.,0.,0.));#11=DIRECTION('',(0.,0.,1.));#12=DIRECTION('',(1.,0.,0.));\n\
         #13=AXIS2_PLACEMENT_3D('',#10,#11,#12);#14=SPHERICAL_SURFACE('',#13,{radius:?});\n\
         #20=CARTESIAN_POINT('',{});#21=DIRECTION('',{});#22=DIRECTION('',{});#23=AXIS2_PLACEMENT_3D('',#20,#21,#22);\n\
         #24=CIRCLE('',#23,{rim:?});#25=CARTESIAN_POINT('',{});#26=VERTEX_POINT('',#25);\n\
         #27=EDGE_CURVE('',#26,#26,#24,.T.);#28=ORIENTED_EDGE('',*,*,#27,.T.);#29=EDGE_LOOP('',(#28));\n\
         #30=FACE_OUTER_BOUND('',#29,.T.);#31=ADVANCED_FACE('',(#30),#14,.T.);#32=OPEN_SHELL('',(#31));\n\
         #33=SHELL_BASED_SURFACE_MODEL('',(#32));#34=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#33),#1);",
        triple(axis * height),
        triple(axis),
        triple(side),
        triple(axis * height + side * rim),
    ))
}

/// Caps whose rims bend by up to the tolerance between their corners, along the ball more than across it: 8 to 47 triangles of each looked
/// inwards.
#[test]
fn no_facet_of_a_cap_is_turned_over() {
    let caps = [
        (100.0, Vector::new(-31.186, -24.278, 45.837), 0.6055),
        (100.0, Vector::new(-0.1305, -31.105, -79.121), 0.85),
        (50.0, Vector::new(-11.842, 12.925, -34.04), 0.768),
    ];
    for (radius, axis, height) in caps {
        let text = cap(radius, axis.normalize(), height * radius);
        let model = read_bytes("cap.stp", text.as_bytes(), &step::Settings::default()).expect("Part 21").model;
        for tolerance in [0.05, 0.2] {
            let made = tessellate(&model, &Settings::uniform(tolerance));
            let mut seen = 0;
            for f in 0..made.mesh.facets.len() {
                let [a, b, c, d]: [Point; 4] = made.mesh.corners(f);
                for [p, q, r] in [[a, b, c], [a, c, d]] {
                    let across = (q - p).cross(r - p);
                    // Outwards from the middle of the ball; what is thinner than a thousandth of the tolerance looks nowhere.
                    let longest = (q - p).length().max((r - q).length()).max((p - r).length());
                    let thin = across.length() <= 1e-3 * tolerance * longest;
                    assert!(thin || across.dot(p + q + r) > 0.0, "{radius} {tolerance}: {p} {q} {r}");
                    seen += usize::from(!thin);
                }
            }
            assert!(seen > 100, "{seen}");
            assert_eq!(made.report.certified, made.report.facets);
        }
    }
}

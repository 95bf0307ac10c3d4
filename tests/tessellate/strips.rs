//! Narrow strips whose borders cross in their parameters, but not in space.

use crate::support::trimmed::{chain, face};
use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, UvCurve, sweep};
use lampyris::step;
use lampyris::tessellate::{Settings, tessellate};

/// On `(u, v, 300 (v − 4 (u − ½)²))` mm, between the curve at z = 0 and the one at z = 0.12 u (1 − u): 0.03 mm high along a parabola.
const STRIP: &str = "ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
#1=CARTESIAN_POINT('',(0.,0.,-300.));
#2=CARTESIAN_POINT('',(0.,1.,0.));
#3=CARTESIAN_POINT('',(0.5,0.,300.));
#4=CARTESIAN_POINT('',(0.5,1.,600.));
#5=CARTESIAN_POINT('',(1.,0.,-300.));
#6=CARTESIAN_POINT('',(1.,1.,0.));
#7=B_SPLINE_SURFACE_WITH_KNOTS('',2,1,((#1,#2),(#3,#4),(#5,#6)),.UNSPECIFIED.,.F.,.F.,.F.,(3,3),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);
#10=VERTEX_POINT('',#2);
#11=VERTEX_POINT('',#6);
#12=CARTESIAN_POINT('',(0.5,-1.,0.));
#13=B_SPLINE_CURVE_WITH_KNOTS('',2,(#2,#12,#6),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);
#14=CARTESIAN_POINT('',(0.5,-0.9998,0.06));
#15=B_SPLINE_CURVE_WITH_KNOTS('',2,(#2,#14,#6),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);
#16=EDGE_CURVE('',#10,#11,#13,.T.);
#17=EDGE_CURVE('',#10,#11,#15,.T.);
#18=ORIENTED_EDGE('',*,*,#16,.T.);
#19=ORIENTED_EDGE('',*,*,#17,.F.);
#20=EDGE_LOOP('',(#18,#19));
#21=FACE_OUTER_BOUND('',#20,.T.);
#22=ADVANCED_FACE('',(#21),#7,.T.);
#23=OPEN_SHELL('',(#22));
#24=SHELL_BASED_SURFACE_MODEL('',(#23));
#25=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#26=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#27=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#25,#26))REPRESENTATION_CONTEXT('',''));
#28=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#24),#27);
ENDSEC;
END-ISO-10303-21;
";

/// Its area: ∫ 0.12 u (1 − u) √(1 + 64 (u − ½)²) du from 0 to 1, mm².
const AREA: f64 = 0.037_934_848_428;

#[test]
fn a_strip_whose_border_crosses_in_parameters_is_whole() {
    let model = step::read_bytes("strip", STRIP.as_bytes(), &step::Settings::default()).unwrap().model;
    for tolerance in [[0.05, 0.2], [0.02, 0.02]] {
        let made = tessellate(&model, &Settings { tolerance, measure: true, ..Settings::default() });
        let report = &made.report;
        assert_eq!((report.faces.failed, report.over_tolerance), (0, Some(0)));
        assert!(report.repaired.is_empty(), "{:?}", report.repaired);
        assert!((report.area_mm2 / AREA - 1.0).abs() < 1e-3, "{}", report.area_mm2);
    }
}

/// Two edges that cross each other four times by 0.2 µm, as fitted edges of real files do.
#[test]
fn a_strip_that_is_nowhere_wide_is_proved() {
    let surface = sweep::cylinder(&Frame::IDENTITY, 10.0, [-1.0, 2.0], [-1.0, 6.0]);
    let beside = |f: f64| {
        let step = (5.0 * f).round() as i32;
        let off = if step % 5 == 0 { 0.0 } else { 2e-5 * f64::from(1 - step % 2 * 2) };
        Uv::new(0.5 * (1.0 - f) + off, 5.0 * (1.0 - f))
    };
    let model = face(surface, &[vec![chain(8, |f| Uv::new(0.5 * f, 5.0 * f)), chain(5, beside)]]);
    for tolerance in [0.02, 0.05, 0.1, 0.2] {
        let report = tessellate(&model, &Settings::uniform(tolerance)).report;
        assert!(report.repaired.is_empty(), "{tolerance}: {:?}", report.repaired);
        assert_eq!(report.certified, report.facets, "{tolerance}");
    }
}

/// Where the parameters of a strip are one line, but for rounding to one side or the other, they do not even show which side is outside:
/// its loop does.
#[test]
fn a_face_of_its_border_alone_runs_along_its_edges_as_its_loops_do() {
    let corners = [[0.0, 0.0], [5.0, -0.01], [10.0, 0.0], [5.0, 0.01]];
    let place = |k: usize| Point::new(corners[k % 4][0], corners[k % 4][1], 0.0);
    let edge = |k: usize| Edge {
        curve: Curve::line(place(k), place(k + 1), [0.0, 1.0]),
        vertices: [k, (k + 1) % 4].map(|v| VertexId(v as u32)),
        entity: None,
    };
    let rim = |uv: &dyn Fn(Point) -> Uv| {
        let edge_use = |k: usize| EdgeUse {
            edge: Some(EdgeId(k as u32)),
            reversed: false,
            uv: UvCurve::line(uv(place(k)), uv(place(k + 1)), [0.0, 1.0]),
        };
        TrimLoop { uses: (0..4).map(edge_use).collect() }
    };
    let cases = [-1.0, 1.0].map(|up| [-1e-17, 0.0, 1e-17].map(|noise| [false, true].map(|r| (up, noise, r))));
    for (up, noise, reversed) in cases.into_iter().flatten().flatten() {
        let frame = |z: f64| Frame { y: Vector::Y * z, z: Vector::Z * z, ..Frame::IDENTITY };
        let extents = [[-1.0, 11.0], [-1.0, 1.0]];
        // Counter-clockwise seen from above: outside is there, and below for the other face.
        let lost = Face {
            loops: vec![rim(&|p| Uv::new(p.x, noise * p.y.signum()))],
            reversed: false,
            ..Face::whole(sweep::plane(&frame(up), extents))
        };
        let whole = Face {
            loops: vec![rim(&|p| Uv::new(p.x, p.y))],
            reversed: true,
            ..Face::whole(sweep::plane(&Frame::IDENTITY, extents))
        };
        let mut faces = vec![lost, whole];
        if reversed {
            faces.iter_mut().for_each(|face| face.reversed ^= true);
        }
        let shell = Shell { faces, closed: true, ..Shell::default() };
        let model = Model::from_part(Part {
            vertices: (0..4).map(place).collect(),
            edges: (0..4).map(edge).collect(),
            shells: vec![shell],
            ..Part::default()
        });
        let report = tessellate(&model, &Settings::uniform(0.1)).report;
        assert_eq!(report.repaired.len(), 1, "{:?}", report.repaired);
        assert_eq!(
            (report.open_edges, report.nonmanifold_edges, report.shells.closed),
            (0, 0, 1),
            "{up} {noise} {reversed}"
        );
    }
}

//! Shapes with closed forms: closed meshes, true areas and volumes, nothing over its tolerance.

use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Instance, Model, Part, PartId, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Surface, UvCurve, conic, sweep};
use lampyris::tessellate::{Settings, Tessellation, tessellate};
use std::f64::consts::PI;

fn face(surface: Surface, reversed: bool, loops: Vec<TrimLoop>) -> Face {
    Face { reversed, loops, ..Face::whole(surface) }
}

fn whole(surface: Surface) -> Model {
    let shell = Shell { faces: vec![face(surface, false, Vec::new())], closed: true, ..Shell::default() };
    Model::from_part(Part { shells: vec![shell], ..Part::default() })
}

fn measured(tolerance: f64) -> Settings {
    Settings { measure: true, ..Settings::uniform(tolerance) }
}

fn assert_sound(made: &Tessellation, what: &str) {
    let r = &made.report;
    assert_eq!(r.faces.failed, 0, "{what}");
    assert_eq!(r.over_tolerance, Some(0), "{what}: {:?}", r.sag_mm);
    assert_eq!(r.certified, r.facets, "{what}: {:?}", r.not_certified);
    assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.open), (0, 0, 0), "{what}");
}

#[test]
fn a_whole_sphere_is_closed_and_certified() {
    for xi in [2.0, 0.2, 0.05] {
        let s = sweep::sphere(
            &Frame::translation(Vector::new(5.0, 1.0, 0.0)),
            50.0,
            [0.0, 2.0 * PI],
            [-PI / 2.0, PI / 2.0],
        );
        let made = tessellate(&whole(s), &measured(xi));
        assert_sound(&made, "sphere");
        let volume = made.report.volume_mm3.unwrap();
        let exact = 4.0 / 3.0 * PI * 50f64.powi(3);
        assert!(volume < exact && exact - volume < 4.0 * PI * 2500.0 * xi, "{volume} {exact}");
    }
}

/// With the rim of its parameters as it is, and with a seam that is an edge of the file used twice, from pole to pole.
#[test]
fn a_sphere_smaller_than_the_tolerance_still_is_one() {
    for r in [0.04, 1e-4] {
        let surface = sweep::sphere(&Frame::IDENTITY, r, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        let made = tessellate(&whole(surface.clone()), &measured(0.1));
        assert_sound(&made, "whole");
        let [[u0, u1], [v0, v1]] = surface.domain();
        let corner = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(Uv::from);
        let side = |edge: Option<EdgeId>, reversed: bool, [a, b]: [usize; 2], t: [f64; 2]| EdgeUse {
            edge,
            reversed,
            uv: UvCurve::line(corner[a], corner[b], t),
        };
        let seam = Some(EdgeId(0));
        let uses = vec![
            side(None, false, [0, 1], [u0, u1]),
            side(seam, false, [1, 2], [v0, v1]),
            side(None, false, [2, 3], [u0, u1]),
            side(seam, true, [0, 3], [v0, v1]),
        ];
        let ball = face(surface.clone(), false, vec![TrimLoop { uses }]);
        let part = Part {
            vertices: vec![surface.evaluate(corner[0]), surface.evaluate(corner[3])],
            edges: vec![Edge { curve: surface.isoline(0, u0), vertices: [VertexId(0), VertexId(1)], entity: None }],
            shells: vec![Shell { faces: vec![ball], closed: true, ..Shell::default() }],
            ..Part::default()
        };
        assert_sound(&tessellate(&Model::from_part(part), &measured(0.1)), "seam");
    }
}

/// A sector of angle 2α strays r·(1 − cos α) from its triangle, so acos(1 − ξ/r) says how many there must be.
#[test]
fn the_tip_of_a_cone_has_as_many_facets_as_its_rim() {
    let (r, xi) = (10_000.0, 1.0);
    let surface = sweep::cone(&Frame::IDENTITY, r, PI / 4.0, [0.0, 2.0 * PI], [-r, 0.0]);
    let shell = Shell { faces: vec![face(surface, false, Vec::new())], ..Shell::default() };
    let made = tessellate(&Model::from_part(Part { shells: vec![shell], ..Part::default() }), &measured(xi));
    assert_sound(&made, "cone");
    let sectors = PI / (1.0 - xi / r).acos();
    // Two sectors may be a quad; the chords of a rim without an edge take 0.48 of the tolerance.
    let facets = made.report.facets as f64;
    assert!(facets >= 0.5 * sectors && facets <= 1.5 * sectors, "{facets} facets, {sectors} sectors");
}

/// The ends of its circles differ by a last bit, so the line through them points anywhere.
#[test]
fn a_tube_that_starts_a_last_bit_beyond_its_seam_gets_strips() {
    for start in [0.0, f64::EPSILON, 1e-15, 1e-12] {
        let axis = Frame::translation(Vector::new(15.24, -50.8, 0.0));
        let tube = sweep::cylinder(&axis, 0.254, [start, 2.0 * PI], [-3.68, 0.0]);
        let made = tessellate(&whole(tube), &measured(0.05));
        assert!(made.mesh.facets.len() <= 16, "{start}: {}", made.mesh.facets.len());
        assert_eq!((made.report.over_tolerance, made.report.certified), (Some(0), made.mesh.facets.len()));
    }
}

#[test]
fn a_whole_torus_is_closed_and_certified() {
    let s = sweep::torus(&Frame::IDENTITY, 40.0, 12.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
    let made = tessellate(&whole(s), &measured(0.05));
    assert_sound(&made, "torus");
    let exact = 2.0 * PI * PI * 40.0 * 144.0;
    assert!((made.report.volume_mm3.unwrap() - exact).abs() < 0.05 * 4.0 * PI * PI * 40.0 * 12.0);
}

/// The outer half of a spring's wire of radius 0.25, twelve turns of radius 3 that rise by 0.5 each; by Pappus π·r·2π·(R + 2r/π) a turn, but
/// for a share of 4e-4 by which it rises.
#[test]
fn the_turns_of_a_spring_are_cut_along_it() {
    let (wire, radius, rise, turns) = (0.25, 3.0, 0.5, 12);
    let turn =
        [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]];
    let section =
        [[radius, -wire], [radius + wire, -wire], [radius + wire, 0.0], [radius + wire, wire], [radius, wire]];
    let weight = |k: usize| if k.is_multiple_of(2) { 1.0 } else { 0.5f64.sqrt() };
    let corner = |i: usize, j: usize| {
        let ([x, y], [r, z], w) = (turn[i % 8], section[j], weight(i) * weight(j));
        (Point::new(r * x, r * y, z + rise * i as f64 / 8.0) * w).extend(w)
    };
    let knots = |spans: usize| (0..=spans).flat_map(|k| [k as f64; 2]).chain([spans as f64]).collect::<Vec<_>>();
    let knots = [4 * turns, 2].map(|spans| [vec![0.0], knots(spans)].concat());
    let points = (0..=8 * turns).flat_map(|i| (0..5).map(move |j| corner(i, j))).collect();
    let model = whole(Surface { degree: [2, 2], knots, points });
    // Cut across alone, it takes more cells than that.
    let made = tessellate(&model, &Settings { budget: 10_000, ..measured(0.01) });
    let r = &made.report;
    assert!(r.repaired.is_empty(), "{:?}", r.repaired);
    assert_eq!((r.certified, r.over_tolerance), (r.facets, Some(0)));
    let area = turns as f64 * PI * wire * 2.0 * PI * (radius + 2.0 * wire / PI);
    assert!((r.area_mm2 / area - 1.0).abs() < 0.03, "{} for {area}, {} facets", r.area_mm2, r.facets);
}

/// A cylinder of radius `r` and height `h` with two caps; the seam is a real edge used twice.
fn can(r: f64, h: f64, hole: Option<f64>) -> Part {
    let turn = [0.0, 2.0 * PI];
    let up = Frame::translation(Vector::Z * h);
    let mut part = Part {
        vertices: vec![Point::new(r, 0.0, 0.0), Point::new(r, 0.0, h)],
        edges: vec![
            Edge { curve: conic::arc(&Frame::IDENTITY, r, turn), vertices: [VertexId(0); 2], entity: None },
            Edge { curve: conic::arc(&up, r, turn), vertices: [VertexId(1); 2], entity: None },
            Edge {
                curve: lampyris::nurbs::Curve::line(Point::new(r, 0.0, 0.0), Point::new(r, 0.0, h), [0.0, h]),
                vertices: [VertexId(0), VertexId(1)],
                entity: None,
            },
        ],
        ..Part::default()
    };
    let line = |a: [f64; 2], b: [f64; 2], t| UvCurve::line(Uv::from(a), Uv::from(b), t);
    let wall = vec![
        EdgeUse { edge: Some(EdgeId(0)), reversed: false, uv: line([0.0, 0.0], [2.0 * PI, 0.0], turn) },
        EdgeUse { edge: Some(EdgeId(2)), reversed: false, uv: line([2.0 * PI, 0.0], [2.0 * PI, h], [0.0, h]) },
        EdgeUse { edge: Some(EdgeId(1)), reversed: true, uv: line([0.0, h], [2.0 * PI, h], turn) },
        EdgeUse { edge: Some(EdgeId(2)), reversed: true, uv: line([0.0, 0.0], [0.0, h], [0.0, h]) },
    ];
    let flat = |c: &lampyris::nurbs::Curve| UvCurve {
        degree: c.degree,
        knots: c.knots.clone(),
        points: c.points.iter().map(|p| glam::DVec3::new(p.x, p.y, p.w)).collect(),
    };
    let cap = |edge: u32, part: &Part| {
        let uv = flat(&part.edges[edge as usize].curve);
        vec![TrimLoop { uses: vec![EdgeUse { edge: Some(EdgeId(edge)), reversed: false, uv }] }]
    };
    let square = [[-2.0 * r, 2.0 * r]; 2];
    let mut faces =
        vec![face(sweep::cylinder(&Frame::IDENTITY, r, turn, [0.0, h]), false, vec![TrimLoop { uses: wall }])];
    let mut loops = cap(0, &part);
    if let Some(q) = hole {
        part.vertices.push(Point::new(q, 0.0, 0.0));
        part.edges.push(Edge {
            curve: conic::arc(&Frame::IDENTITY, q, turn),
            vertices: [VertexId(2); 2],
            entity: None,
        });
        let uv = flat(&part.edges[3].curve);
        loops.push(TrimLoop { uses: vec![EdgeUse { edge: Some(EdgeId(3)), reversed: true, uv }] });
    }
    faces.push(face(sweep::plane(&Frame::IDENTITY, square), true, loops));
    faces.push(face(sweep::plane(&up, square), false, cap(1, &part)));
    part.shells = vec![Shell { faces, closed: hole.is_none(), ..Shell::default() }];
    part
}

#[test]
fn a_can_shares_its_edges_and_gets_strips() {
    let made = tessellate(&Model::from_part(can(10.0, 80.0, None)), &measured(0.05));
    assert_sound(&made, "can");
    let exact = PI * 100.0 * 80.0;
    let volume = made.report.volume_mm3.unwrap();
    assert!(volume < exact && volume > exact - 0.05 * 2.0 * PI * 10.0 * 80.0);
    // A chord of sag 0.05 on r = 10 spans 0.2 rad: 32 strips; the two caps take about as many triangles, in pairs.
    assert!(made.report.facets < 32 + 2 * 24, "{}", made.report.facets);
    let wall = made.mesh.facets.iter().filter(|f| f.face.0 == 0);
    assert!(wall.clone().count() < 36 && wall.clone().all(|f| !f.is_triangle()), "{}", wall.count());
}

#[test]
fn measured_figures_of_a_can_have_closed_forms() {
    let made = tessellate(&Model::from_part(can(10.0, 80.0, None)), &measured(0.05));
    // A chord from p to q lies r − |p + q| / 2 below the wall, at its middle; caps are flat.
    let wall = (0..made.mesh.facets.len()).filter(|&f| made.mesh.facets[f].face.0 == 0);
    let flat = |p: Point| Vector::new(p.x, p.y, 0.0);
    let depth = wall.map(|f| made.mesh.corners(f).map(flat)).map(|p| {
        let below = |k: usize| 10.0 - 0.5 * (p[k] + p[(k + 1) % 4]).length();
        (0..4).map(below).fold(0.0, f64::max)
    });
    let depth = depth.fold(0.0, f64::max);
    let sampled = made.report.sag_mm.sampled_max.unwrap();
    assert!(depth > 0.02 && (sampled - depth).abs() < 1e-9, "{sampled} {depth}");
    // On a chord between two radial unit normals the interpolated one is radial too: no error, on the cap that is turned
    // about as well.
    let errors = made.report.normal_error_deg.unwrap();
    assert!(errors.max < 1e-4, "{errors:?}");
}

#[test]
fn measured_normals_of_a_sphere_stay_within_the_cone_of_a_facet() {
    let turn = [[0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]];
    for reversed in [false, true] {
        let s = sweep::sphere(&Frame::IDENTITY, 50.0, turn[0], turn[1]);
        let shell = Shell { faces: vec![face(s, reversed, Vec::new())], closed: true, ..Shell::default() };
        let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        let made = tessellate(&model, &measured(0.2));
        // Radial normals of two points of a facet differ by less than its longest chord spans: twice acos(1 − sag / r).
        let sag = made.report.sag_mm.sampled_max.unwrap();
        let cone = 2.0 * (1.0 - sag / 50.0).acos().to_degrees();
        let errors = made.report.normal_error_deg.unwrap();
        assert!(errors.max < cone, "reversed {reversed}: {errors:?} {cone}");
    }
}

#[test]
fn a_mirrored_and_scaled_instance_stays_turned_outward() {
    let mut model = Model::from_part(can(10.0, 30.0, None));
    let placement = Frame { x: -Vector::X, scale: 2.0, ..Frame::translation(Vector::X * 100.0) };
    model.instances.push(Instance {
        name: String::new(),
        path: String::new(),
        part: PartId(0),
        placement,
        colour: None,
    });
    let made = tessellate(&model, &measured(0.1));
    assert_sound(&made, "mirrored");
    let exact = PI * 100.0 * 30.0 * 9.0;
    assert!((made.report.volume_mm3.unwrap() - exact).abs() < 0.02 * exact);
    let errors = made.report.normal_error_deg.unwrap();
    assert!(errors.max < 1e-4, "{errors:?}");
    for f in 0..made.mesh.facets.len() {
        let [a, b, c, _] = made.mesh.corners(f);
        let n = made.mesh.vertices[made.mesh.facets[f].vertices[0] as usize].normal;
        assert!((b - a).cross(c - a).dot(n) > 0.0, "facet {f}");
    }
}

#[test]
fn a_hole_stays_a_hole() {
    let made = tessellate(&Model::from_part(can(10.0, 5.0, Some(4.0))), &measured(0.01));
    let plate: f64 = (0..made.mesh.facets.len())
        .filter(|&f| made.mesh.facets[f].face.0 == 1)
        .map(|f| made.mesh.facet_area(f))
        .sum();
    assert!((plate - PI * (100.0 - 16.0)).abs() < 0.01 * 2.0 * PI * 14.0);
    assert_eq!(made.report.over_tolerance, Some(0));
}

#[test]
fn threads_do_not_matter() {
    let s = sweep::torus(&Frame::IDENTITY, 40.0, 12.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
    let model = whole(s);
    let run = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| tessellate(&model, &Settings::uniform(0.2)))
    };
    assert_eq!(run(1).mesh, run(4).mesh);
}

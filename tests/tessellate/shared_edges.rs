//! Every edge of the mesh belongs to two facets, at every tolerance: also where faces share more than an edge, where rims nearly touch,
//! and where a crease runs beside a trim.

use crate::support::trimmed::{chain, face};
use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Instance, Model, Part, PartId, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, conic, sweep};
use lampyris::tessellate::{Settings, tessellate};
use std::collections::HashMap;
use std::f64::consts::PI;

const TOLERANCES: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// Both sides of a flat polygon as one closed shell: every diagonal of one side could be one of the other.
fn both_sides_of(corners: &[[f64; 2]]) -> Model {
    let plane = sweep::plane(&Frame::IDENTITY, [[-10.0, 10.0]; 2]);
    let uv: Vec<Uv> = corners.iter().map(|&[x, y]| Uv::new(x, y)).collect();
    let place = |k: usize| Point::new(uv[k].x, uv[k].y, 0.0);
    let n = uv.len();
    let edge = |k: usize| Edge {
        curve: Curve::line(place(k), place((k + 1) % n), [0.0, 1.0]),
        vertices: [VertexId(k as u32), VertexId(((k + 1) % n) as u32)],
        entity: None,
    };
    let edge_use = |k: usize| EdgeUse {
        edge: Some(EdgeId(k as u32)),
        reversed: false,
        uv: UvCurve::line(uv[k], uv[(k + 1) % n], [0.0, 1.0]),
    };
    let side = |reversed: bool| {
        let rim = TrimLoop { uses: (0..n).map(edge_use).collect() };
        Face { loops: vec![rim], reversed, ..Face::whole(plane.clone()) }
    };
    let shell = Shell { faces: vec![side(false), side(true)], closed: true, ..Shell::default() };
    Model::from_part(Part {
        vertices: (0..n).map(place).collect(),
        edges: (0..n).map(edge).collect(),
        shells: vec![shell],
        ..Part::default()
    })
}

#[test]
fn no_diagonal_is_in_two_faces() {
    for n in [5, 6, 8, 13] {
        let corners: Vec<[f64; 2]> = (0..n)
            .map(|k| 2.0 * PI * f64::from(k) / f64::from(n))
            .map(|angle| [6.0 * angle.cos(), 4.0 * angle.sin()])
            .collect();
        let made = tessellate(&both_sides_of(&corners), &Settings::uniform(0.1));
        let r = &made.report;
        assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.closed), (0, 0, 1), "{n} corners");
        assert_eq!(r.certified, r.facets);
        // Twice the area of the polygon, by the formula of the ellipse's inscribed polygon.
        let area = 6.0 * 4.0 * f64::from(n) * (2.0 * PI / f64::from(n)).sin();
        assert!((r.area_mm2 / area - 1.0).abs() < 1e-12, "{n} corners: {}", r.area_mm2);
    }
}

/// What one face has given up for the other it does not take back when something is glued to it.
#[test]
fn no_diagonal_is_in_two_faces_where_another_solid_lies_on_one() {
    for n in [5, 6, 8, 13] {
        let angle = |k: i32| 2.0 * PI * f64::from(k) / f64::from(n);
        let corners: Vec<[f64; 2]> = (0..n).map(|k| [6.0 * angle(k).cos(), 4.0 * angle(k).sin()]).collect();
        let mut model = both_sides_of(&corners);
        let mut sheet = model.parts[0].clone();
        sheet.shells[0].faces.pop();
        sheet.shells[0].closed = false;
        model.parts.push(sheet);
        model.instances.push(Instance { part: PartId(1), ..model.instances[0].clone() });
        let made = tessellate(&model, &Settings { glue_mm: 1e-3, ..Settings::uniform(0.1) });
        let r = &made.report;
        assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.closed), (0, 0, 1), "{n} corners");
    }
}

/// A prism of height 2 over a polygon: two lids and a wall over each side.
fn prism_over(corners: &[[f64; 2]]) -> Model {
    let n = corners.len();
    let place = |k: usize, z: f64| Point::new(corners[k % n][0], corners[k % n][1], z);
    // Vertices and sides of the bottom, then of the top, then the upright edges.
    let vertices: Vec<Point> = [0.0, 2.0].iter().flat_map(|&z| (0..n).map(move |k| place(k, z))).collect();
    let ends = |k: usize| match k / n {
        2 => [k % n, k % n + n],
        lid => [k, lid * n + (k + 1) % n],
    };
    let edge = |k: usize| Edge {
        curve: Curve::line(vertices[ends(k)[0]], vertices[ends(k)[1]], [0.0, 1.0]),
        vertices: ends(k).map(|v| VertexId(v as u32)),
        entity: None,
    };
    let uses = |edges: &[(usize, bool)], uv: &dyn Fn(Point) -> Uv| {
        let one = |&(k, reversed): &(usize, bool)| EdgeUse {
            edge: Some(EdgeId(k as u32)),
            reversed,
            uv: UvCurve::line(uv(vertices[ends(k)[0]]), uv(vertices[ends(k)[1]]), [0.0, 1.0]),
        };
        vec![TrimLoop { uses: edges.iter().map(one).collect() }]
    };
    let extents = [[-20.0, 20.0]; 2];
    let lid = |top: usize| {
        let rim: Vec<(usize, bool)> = (0..n).map(|k| (top * n + k, false)).collect();
        let frame = Frame { origin: Vector::Z * (2 * top) as f64, ..Frame::IDENTITY };
        let loops = uses(&rim, &|p| Uv::new(p.x, p.y));
        Face { loops, reversed: top == 0, ..Face::whole(sweep::plane(&frame, extents)) }
    };
    let wall = |k: usize| {
        let x = (place(k + 1, 0.0) - place(k, 0.0)).normalize();
        let frame = Frame { origin: place(k, 0.0), x, y: Vector::Z, z: x.cross(Vector::Z), ..Frame::IDENTITY };
        let uv = |p: Point| Uv::new((p - frame.origin).dot(x), p.z);
        let rim = [(k, false), (2 * n + (k + 1) % n, false), (n + k, true), (2 * n + k, true)];
        Face { loops: uses(&rim, &uv), ..Face::whole(sweep::plane(&frame, extents)) }
    };
    let faces = [0, 1].map(lid).into_iter().chain((0..n).map(wall)).collect();
    let shell = Shell { faces, closed: true, ..Shell::default() };
    let edges = (0..3 * n).map(edge).collect();
    Model::from_part(Part { vertices, edges, shells: vec![shell], ..Part::default() })
}

/// A side that runs back along another: between them a lid has no area, but its walls have other corners.
#[test]
fn a_border_that_runs_back_along_itself_leaves_no_gap() {
    for off in [0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-4, -1e-4] {
        let made =
            tessellate(&prism_over(&[[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [3.0, off]]), &Settings::uniform(0.1));
        let r = &made.report;
        assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.closed), (0, 0, 1), "{off}");
        let volume = r.volume_mm3.expect("of a closed shell");
        assert!((volume - 9.0).abs() <= 12.0 * off.abs() + 1e-9, "{volume} for {off}");
    }
}

/// A bond wire: two facets around it would be enough for the tolerance, and would have all their corners in two places.
#[test]
fn a_tube_thinner_than_its_tolerance_does_not_fold_flat() {
    for radius in [0.0125, 0.005, 0.001] {
        let wire = sweep::torus(&Frame::IDENTITY, 1.0, radius, [0.0, 0.5 * PI], [0.0, 2.0 * PI]);
        let shell = Shell { faces: vec![Face::whole(wire)], ..Shell::default() };
        let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        for tolerance in TOLERANCES {
            let mesh = tessellate(&model, &Settings::uniform(tolerance)).mesh;
            let t = mesh.topology(0..mesh.facets.len());
            assert_eq!((t.nonmanifold_edges, t.touching_edges, t.turned_edges), (0, 0, 0), "{radius} {tolerance}");
        }
    }
}

/// Two rims nearer than a chord's sag: chords cross until they are short enough.
#[test]
fn rings_thinner_than_the_tolerance_are_faces() {
    let plane = || sweep::plane(&Frame::IDENTITY, [[-10.0, 10.0]; 2]);
    let at = |r: f64, turn: f64| Uv::new(r * (PI * turn).cos(), r * (PI * turn).sin());
    let radius = 5.25;
    for width in [0.1, 0.01, 0.002] {
        let inner = radius - width;
        let half = vec![vec![
            chain(4000, |f| at(radius, f)),
            chain(1, |f| at(radius - width * f, 1.0)),
            chain(4000, |f| at(inner, 1.0 - f)),
            chain(1, |f| at(inner + width * f, 0.0)),
        ]];
        let ring = vec![vec![chain(4000, |f| at(radius, 2.0 * f))], vec![chain(4000, |f| at(inner, -2.0 * f))]];
        let area = 0.5 * PI * (radius * radius - inner * inner);
        for (loops, area) in [(half, area), (ring, 2.0 * area)] {
            for tolerance in TOLERANCES {
                let made = tessellate(&face(plane(), &loops), &Settings::uniform(tolerance));
                let r = &made.report;
                assert_eq!((r.faces.failed, r.faces.repaired), (0, 0), "{width} {tolerance}");
                // Chords leave of the area at most what both rims sag.
                assert!((r.area_mm2 / area - 1.0).abs() < 1.0, "{width} {tolerance}: {} {area}", r.area_mm2);
                let topology = made.mesh.topology(0..made.mesh.facets.len());
                assert_eq!((topology.nonmanifold_edges, topology.turned_edges), (0, 0), "{width} {tolerance}");
            }
        }
    }
}

/// A roof whose trim ends a few roundings beyond its ridge: no facet lies between the two.
#[test]
fn a_trim_a_rounding_beside_a_crease_leaves_no_folded_facets() {
    let points =
        [[0.0, 0.0, 0.0], [0.0, 5.0, 3.0], [0.0, 10.0, 0.0], [10.0, 0.0, 0.0], [10.0, 5.0, 3.0], [10.0, 10.0, 0.0]];
    // Bent along u, so that it is cut into cells.
    let row = |x: f64, lift: f64| {
        points[..3].iter().map(move |p| Point::new(x, p[1], p[2] + lift).extend(1.0)).collect::<Vec<_>>()
    };
    let roof = Surface {
        degree: [2, 1],
        knots: [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 2.0, 2.0]],
        points: [row(0.0, 0.0), row(5.0, 2.0), row(10.0, 0.0)].concat(),
    };
    let beyond = 1.0 + 6.0 * f64::EPSILON;
    let c = [Uv::new(0.0, 0.0), Uv::new(1.0, 0.0), Uv::new(1.0, beyond), Uv::new(0.0, beyond)];
    let sides = (0..4).map(|k| chain(64, |f| c[k].lerp(c[(k + 1) % 4], f))).collect();
    let model = face(roof, &[sides]);
    for tolerance in TOLERANCES {
        let made = tessellate(&model, &Settings::uniform(tolerance));
        let n = made.mesh.facets.len();
        let topology = made.mesh.topology(0..n);
        assert_eq!((topology.nonmanifold_edges, topology.turned_edges), (0, 0), "{tolerance}");
        let smallest = (0..n).map(|f| made.mesh.facet_area(f)).fold(f64::INFINITY, f64::min);
        assert!(smallest > 1e-6, "{tolerance}: a facet of {smallest} mm²");
    }
}

/// A trim that slants by one to two hundred-millionths of its face beside the end of a cell: no cell takes in what lies beyond it.
#[test]
fn no_cell_reaches_beyond_a_trim_that_slants_a_little() {
    let wall = sweep::cylinder(&Frame::IDENTITY, 5.0, [0.0, 1.0], [0.0, 20.0]);
    // In units of the height; the other end is that of the box around the trims.
    for slant in [0.5e-7, 1.2e-7, 1.6e-7, 1.9e-7, 2.5e-7] {
        let high = 10.0 * slant;
        let c = [[0.1, 0.0], [0.5, 0.45 * high], [0.9, high], [0.9, 10.0], [0.1, 10.0]].map(Uv::from);
        let sides: Vec<Vec<Uv>> = (0..5).map(|k| chain(64, |f| c[k].lerp(c[(k + 1) % 5], f))).collect();
        for tolerance in TOLERANCES {
            let mesh =
                tessellate(&face(wall.clone(), std::slice::from_ref(&sides)), &Settings::uniform(tolerance)).mesh;
            let topology = mesh.topology(0..mesh.facets.len());
            assert_eq!((topology.nonmanifold_edges, topology.turned_edges), (0, 0), "{slant} {tolerance}");
        }
    }
}

/// A slot in a disc's rim, both of whose ends lie on the chord of the arc between the disc's flat sides: the chord is led over them, and
/// the tube outside does not know them.
#[test]
fn the_chord_of_an_arc_passes_over_no_other_corner() {
    let (sag, half) = (0.02f64, 1.5f64);
    let radius = (half * half + sag * sag) / (2.0 * sag);
    let angle = (half / radius).asin();
    // The arc runs below the chord from (0, 0) to (3, 0), around the frame's z axis.
    let frame =
        Frame { origin: Point::new(half, radius - sag, 0.0), x: -Vector::Y, y: Vector::X, ..Frame::IDENTITY };
    let corners = [[0.0, 0.0], [3.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let n = corners.len();
    let uv = |k: usize| Uv::from(corners[k % n]);
    let place = |k: usize| uv(k).extend(0.0);
    let mut vertices: Vec<Point> = (0..n).map(place).collect();
    vertices.extend([place(0), place(1)].map(|p| p + Vector::Z));
    let vertex_ids = |ends: [usize; 2]| ends.map(|v| VertexId(v as u32));
    let arc = conic::arc(&frame, radius, [-angle, angle]);
    let mut edges = vec![Edge { curve: arc.clone(), vertices: vertex_ids([0, 1]), entity: None }];
    for k in 1..n {
        let curve = Curve::line(place(k), place(k + 1), [0.0, 1.0]);
        edges.push(Edge { curve, vertices: vertex_ids([k, (k + 1) % n]), entity: None });
    }
    let above = conic::arc(&Frame { origin: frame.origin + Vector::Z, ..frame }, radius, [-angle, angle]);
    edges.push(Edge { curve: above, vertices: vertex_ids([n, n + 1]), entity: None });
    for (from, to) in [(0, n), (1, n + 1)] {
        let curve = Curve::line(vertices[from], vertices[to], [0.0, 1.0]);
        edges.push(Edge { curve, vertices: vertex_ids([from, to]), entity: None });
    }
    let edge_use =
        |edge: usize, reversed: bool, uv: UvCurve| EdgeUse { edge: Some(EdgeId(edge as u32)), reversed, uv };
    // The flat side, seen from above; its plane has the coordinates x and y.
    let flat_arc = UvCurve {
        degree: arc.degree,
        knots: arc.knots.clone(),
        points: arc.points.iter().map(|p| Uv::new(p.x, p.y).extend(p.w)).collect(),
    };
    let mut rim = vec![edge_use(0, false, flat_arc)];
    rim.extend((1..n).map(|k| edge_use(k, false, UvCurve::line(uv(k), uv(k + 1), [0.0, 1.0]))));
    let flat = Face {
        loops: vec![TrimLoop { uses: rim }],
        ..Face::whole(sweep::plane(&Frame::IDENTITY, [[-1.0, 4.0]; 2]))
    };
    let line = |from: [f64; 2], to: [f64; 2]| UvCurve::line(Uv::from(from), Uv::from(to), [0.0, 1.0]);
    let along = |z: f64| UvCurve::line(Uv::new(-angle, z), Uv::new(angle, z), [-angle, angle]);
    let wall = vec![
        edge_use(0, false, along(0.0)),
        edge_use(n + 2, false, line([angle, 0.0], [angle, 1.0])),
        edge_use(n, true, along(1.0)),
        edge_use(n + 1, true, line([-angle, 0.0], [-angle, 1.0])),
    ];
    let tube = Face {
        loops: vec![TrimLoop { uses: wall }],
        ..Face::whole(sweep::cylinder(&frame, radius, [-angle, angle], [0.0, 1.0]))
    };
    let shells = vec![Shell { faces: vec![flat, tube], ..Shell::default() }];
    let made =
        tessellate(&Model::from_part(Part { vertices, edges, shells, ..Part::default() }), &Settings::uniform(0.1));
    assert!(made.report.repaired.is_empty(), "{:?}", made.report.repaired);
    // All that the two share is the arc: what one of them alone has below is the slot and the two pieces beside it, of length 1.
    let mut uses: HashMap<[u32; 2], usize> = HashMap::new();
    let mesh = &made.mesh;
    for k in 0..mesh.facets.len() {
        let c = mesh.corner_positions(k);
        for [a, b] in [[c[0], c[1]], [c[1], c[2]], [c[2], c[3]], [c[3], c[0]]].into_iter().filter(|[a, b]| a != b) {
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let place = |p: u32| mesh.positions[p as usize];
    let open = uses.into_iter().filter(|(_, count)| *count == 1).map(|(ends, _)| ends.map(place));
    for [a, b] in open.filter(|ends| ends.iter().all(|p| p.z == 0.0)) {
        assert!(((b - a).length() - 1.0).abs() < 1e-9, "{a} {b}");
    }
}

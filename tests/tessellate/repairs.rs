//! Faces that cannot be meshed as requested still get a mesh, and are named with the distance that was reached.

use lampyris::math::{Frame, Point, Uv};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, sweep};
use lampyris::tessellate::{Repair, Settings, Tessellation, tessellate};
use std::collections::HashMap;
use std::f64::consts::PI;

/// A face between polygons, each corner given in the parameter plane and in space, each side an edge.
pub(crate) fn face(surface: Surface, loops: &[Vec<(Uv, Point)>]) -> Model {
    let mut part = Part::default();
    let mut trims = Vec::new();
    for corners in loops {
        let first = part.vertices.len() as u32;
        let n = corners.len() as u32;
        let line = |a: Point, b: Point| Curve {
            degree: 1,
            knots: vec![0.0, 0.0, 1.0, 1.0],
            points: vec![a.extend(1.0), b.extend(1.0)],
        };
        let mut uses = Vec::new();
        for k in 0..n {
            let (a, b) = (corners[k as usize], corners[((k + 1) % n) as usize]);
            part.vertices.push(a.1);
            let edge = Some(EdgeId(part.edges.len() as u32));
            uses.push(EdgeUse { edge, reversed: false, uv: UvCurve::line(a.0, b.0, [0.0, 1.0]) });
            let vertices = [VertexId(first + k), VertexId(first + (k + 1) % n)];
            part.edges.push(Edge { curve: line(a.1, b.1), vertices, entity: None });
        }
        trims.push(TrimLoop { uses });
    }
    part.shells = vec![Shell { faces: vec![Face { loops: trims, ..Face::whole(surface) }], ..Shell::default() }];
    Model::from_part(part)
}

pub(crate) fn plane() -> Surface {
    sweep::plane(&Frame::IDENTITY, [[0.0, 10.0]; 2])
}

/// Corners in the plane z = 0, whose parameters are lengths.
pub(crate) fn flat(corners: &[[f64; 2]]) -> Vec<(Uv, Point)> {
    corners.iter().map(|&[x, y]| (Uv::new(x, y), Point::new(x, y, 0.0))).collect()
}

fn square(lo: f64, hi: f64) -> Vec<[f64; 2]> {
    vec![[lo, lo], [hi, lo], [hi, hi], [lo, hi]]
}

pub(crate) fn measured(tolerance: f64) -> Settings {
    Settings { measure: true, ..Settings::uniform(tolerance) }
}

/// The sides that have one facet, each as its two places.
fn rim(made: &Tessellation) -> Vec<[[f64; 3]; 2]> {
    let mut sides: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    for f in 0..made.mesh.facets.len() {
        let c = made.mesh.corners(f).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
        for k in (0..4).filter(|&k| c[k] != c[(k + 1) % 4]) {
            let (a, b) = (c[k], c[(k + 1) % 4]);
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    assert!(sides.values().all(|&n| n <= 2));
    sides.into_iter().filter(|s| s.1 == 1).map(|s| s.0.map(|p| p.map(f64::from_bits))).collect()
}

/// Every side of the polygons is a side of one facet, and no other side is.
fn assert_rim(made: &Tessellation, loops: &[Vec<(Uv, Point)>]) {
    let sides = |c: &Vec<(Uv, Point)>| -> Vec<[[f64; 3]; 2]> {
        (0..c.len()).map(|k| [c[k].1.to_array(), c[(k + 1) % c.len()].1.to_array()]).collect()
    };
    let wanted: Vec<_> = loops.iter().flat_map(sides).collect();
    let found = rim(made);
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    for [a, b] in wanted {
        assert!(found.contains(&[a, b]) || found.contains(&[b, a]), "{a:?} to {b:?}");
    }
}

/// A sphere that would take ten times the facets it may have: cells grow instead, all of them alike.
#[test]
fn a_face_beyond_its_budget_has_coarser_cells() {
    let (radius, budget) = (1000.0, 20_000);
    let ball = sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
    let shell = Shell { faces: vec![Face::whole(ball)], closed: true, ..Shell::default() };
    let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    let made = tessellate(&model, &Settings { budget, ..measured(0.01) });
    let r = &made.report;
    assert_eq!((r.faces.failed, r.faces.repaired, r.shells.closed), (0, 1, 1));
    assert!(r.facets < 3 * budget, "{}", r.facets);
    let repaired = r.repaired[0];
    let sampled = r.sag_mm.sampled_max.unwrap();
    assert_eq!((repaired.face, repaired.how), (0, Repair::CoarserCells));
    assert!((repaired.reached_mm - sampled).abs() <= 1e-9 * sampled, "{repaired:?} {sampled}");
    // N squares of side a cover 4 π R²; a square's diagonal a √2 sags a² / (4 R), so π R / N at best. Halving may leave the
    // worst facet with four times the area of the mean, and the last steps coarsen by two.
    let best = PI * radius / budget as f64;
    assert!(sampled < 16.0 * best, "{sampled} {best}");
}

/// Trims that lie beside the surface's domain: no parameters there, but the border is in space.
#[test]
fn trims_beside_the_surface_leave_the_border() {
    let loops = [flat(&[[12.0, 0.0], [20.0, 0.0], [20.0, 10.0], [12.0, 10.0]])];
    let made = tessellate(&face(plane(), &loops), &measured(0.1));
    let r = &made.report;
    assert_eq!((r.faces.failed, r.faces.repaired, r.certified), (0, 1, 0));
    assert!((r.area_mm2 - 80.0).abs() < 1e-9);
    assert_rim(&made, &loops);
    let repaired = r.repaired[0];
    // The farthest corner is 10 mm from the side of the domain.
    assert_eq!(repaired.how, Repair::BorderOnly);
    assert!((repaired.reached_mm - 10.0).abs() < 1e-9, "{repaired:?}");
    // Seen from outside the facets run counter-clockwise, as the normals of the plane say.
    let normal = made.mesh.vertices[made.mesh.facets[0].vertices[0] as usize].normal;
    let [a, b, c, _] = made.mesh.corners(0);
    assert!((b - a).cross(c - a).dot(normal) > 0.0 && normal.z == 1.0);
}

#[test]
fn trims_that_leave_the_domain_keep_the_border_and_say_how_far_it_is() {
    let loops = [flat(&[[5.0, 0.0], [15.0, 0.0], [15.0, 10.0], [5.0, 10.0]])];
    let made = tessellate(&face(plane(), &loops), &measured(0.1));
    let r = &made.report;
    assert_eq!((r.faces.failed, r.certified), (0, 0));
    assert!((r.area_mm2 - 100.0).abs() < 1e-9);
    assert_rim(&made, &loops);
    assert!((r.sag_mm.sampled_max.unwrap() - 5.0).abs() < 1e-9, "{:?}", r.sag_mm);
}

/// Trims that are one line, one point or no numbers at all in the parameter plane, on a border that is a square in space, flat or not.
#[test]
fn trims_without_area_or_numbers_leave_the_border() {
    for lift in [0.0, 3.0] {
        let places = [[2.0, 2.0, lift], [8.0, 2.0, 0.0], [8.0, 8.0, lift], [2.0, 8.0, 0.0]].map(Point::from_array);
        let line = |k: usize| Uv::new(2.0 + k as f64, 2.0);
        let back = |k: usize| Uv::new(4.0 + (k % 2) as f64, 4.0);
        let nothing = |k: usize| if k.is_multiple_of(2) { Uv::NAN } else { Uv::new(2.0, 2.0) };
        for uv in [line as fn(usize) -> Uv, back, nothing] {
            let loops = [(0..4).map(|k| (uv(k), places[k])).collect::<Vec<_>>()];
            let made = tessellate(&face(plane(), &loops), &measured(0.1));
            let r = &made.report;
            assert_eq!(
                (r.faces.failed, r.faces.repaired, r.facets),
                (0, 1, 2),
                "lift {lift} {:?} {:?}",
                uv(2),
                r.repaired
            );
            assert_rim(&made, &loops);
            let reached = r.repaired[0].reached_mm;
            assert!((reached - lift).abs() < 1e-9, "{reached} {lift}");
        }
    }
}

#[test]
fn a_face_of_one_point_is_the_only_one_that_fails() {
    let point = (Uv::new(1.0, 1.0), Point::new(1.0, 1.0, 0.0));
    let made = tessellate(&face(plane(), &[vec![point; 3]]), &measured(0.1));
    assert_eq!((made.report.faces.failed, made.report.facets), (1, 0));
}

/// Holes that touch the outer loop in a corner, and each other; a loop that passes one point twice.
#[test]
fn trims_that_touch_themselves_need_no_repair() {
    let hole = |c: [[f64; 2]; 3]| flat(&c);
    let touching = [
        (vec![flat(&square(0.0, 10.0)), hole([[10.0, 10.0], [4.0, 6.0], [6.0, 4.0]])], 100.0 - 10.0),
        (
            vec![
                flat(&square(0.0, 10.0)),
                hole([[5.0, 5.0], [3.0, 7.0], [2.0, 4.0]]),
                hole([[5.0, 5.0], [7.0, 3.0], [8.0, 6.0]]),
            ],
            100.0 - 8.0,
        ),
        (vec![flat(&[[0.0, 0.0], [10.0, 0.0], [5.0, 5.0], [10.0, 10.0], [0.0, 10.0], [5.0, 5.0]])], 50.0),
    ];
    for (loops, area) in touching {
        let made = tessellate(&face(plane(), &loops), &measured(0.1));
        let r = &made.report;
        assert_eq!((r.faces.failed, r.faces.repaired, r.over_tolerance), (0, 0, Some(0)), "{:?}", r.repaired);
        assert!((r.area_mm2 - area).abs() < 1e-9, "{} {area}", r.area_mm2);
        assert_rim(&made, &loops);
    }
}

/// A loop that passes a vertex twice, each time with trims that end half a micrometre beside it, on the far side of the others: 2 × 25 mm².
#[test]
fn trims_that_end_beside_a_vertex_do_not_cross_there() {
    let mut corners = flat(&[[0.0, 0.0], [10.0, 0.0], [5.0, 5.0], [10.0, 10.0], [0.0, 10.0], [5.0, 5.0]]);
    corners[2].0.x -= 5e-4;
    corners[5].0.x += 5e-4;
    let mut model = face(plane(), &[corners]);
    for vertex in model.parts[0].edges.iter_mut().flat_map(|e| &mut e.vertices) {
        if *vertex == VertexId(5) {
            *vertex = VertexId(2);
        }
    }
    let made = tessellate(&model, &measured(0.1));
    let r = &made.report;
    assert_eq!((r.faces.failed, r.faces.repaired, r.certified), (0, 0, r.facets), "{:?}", r.repaired);
    assert!((r.area_mm2 - 50.0).abs() < 1e-9, "{}", r.area_mm2);
}

/// A hole that stands out of its face: by parity what stands out is inside, and nothing of such a face is proved. Two faces in one, each
/// with its own loop, are no such case, whichever way the loops run.
#[test]
fn facets_that_cover_more_than_the_border_bounds_are_not_certified() {
    let outer = flat(&square(0.0, 6.0));
    let mut hole = square(5.0, 9.0);
    hole.reverse();
    let made = tessellate(&face(plane(), &[outer.clone(), flat(&hole)]), &measured(0.1));
    let r = &made.report;
    assert_eq!((r.faces.failed, r.faces.repaired, r.certified), (0, 1, 0), "{:?}", r.repaired);
    for second in [square(7.0, 9.0), square(7.0, 9.0).into_iter().rev().collect()] {
        let made = tessellate(&face(plane(), &[outer.clone(), flat(&second)]), &measured(0.1));
        let r = &made.report;
        assert_eq!((r.faces.failed, r.faces.repaired, r.certified), (0, 0, r.facets), "{:?}", r.repaired);
        assert!((r.area_mm2 - 40.0).abs() < 1e-9, "{}", r.area_mm2);
    }
}

/// Slivers far thinner than the tolerance, straight and around a cylinder.
#[test]
fn slivers_are_faces() {
    for width in [1e-3, 1e-6, 1e-9] {
        let loops = [flat(&[[0.0, 3.0], [10.0, 3.0], [10.0, 3.0 + width], [0.0, 3.0 + width]])];
        let made = tessellate(&face(plane(), &loops), &measured(0.1));
        let r = &made.report;
        assert_eq!((r.faces.failed, r.faces.repaired, r.over_tolerance), (0, 0, Some(0)), "{width}");
        assert_rim(&made, &loops);
        assert!((r.area_mm2 / (10.0 * width) - 1.0).abs() < 1e-5, "{width}: {}", r.area_mm2);
    }
}

/// An arc of a circle that touches the x axis from above in the origin, up to an angle about its centre: the curve in space, and in a
/// plane whose parameters are lengths.
fn touching_arc(radius: f64, angle: f64) -> (Curve, UvCurve) {
    let weight = (0.5 * angle).cos();
    let middle = Point::new(radius * (0.5 * angle).tan(), 0.0, 0.0);
    let end = Point::new(radius * angle.sin(), radius * (1.0 - angle.cos()), 0.0);
    let points = vec![Point::ZERO.extend(1.0), (middle * weight).extend(weight), end.extend(1.0)];
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let flat = points.iter().map(|p| Point::new(p.x, p.y, p.w)).collect();
    (Curve { degree: 2, knots: knots.clone(), points }, UvCurve { degree: 2, knots, points: flat })
}

/// A plane face between two arcs that touch in a corner of it, and a line; its area with chords of both that sag alike.
fn face_between_touching_arcs() -> (Model, f64) {
    face_between_touching_arcs_on(sweep::plane(&Frame::IDENTITY, [[-1.0, 40.0], [-1.0, 10.0]]))
}

/// The same on another surface that has x and y as its parameters.
fn face_between_touching_arcs_on(surface: Surface) -> (Model, f64) {
    // Circles of 66 and 65 mm: near the cusp they are nearer to each other than any chord to its arc.
    let (radii, angles) = ([66.0, 65.0], [0.5, 0.45]);
    let [(outer, outer_uv), (inner, inner_uv)] = [0, 1].map(|k| touching_arc(radii[k], angles[k]));
    let [a, b] = [outer.evaluate(1.0), inner.evaluate(1.0)];
    let line = Curve { degree: 1, knots: vec![0.0, 0.0, 1.0, 1.0], points: vec![a.extend(1.0), b.extend(1.0)] };
    let line_uv = UvCurve::line(a.truncate(), b.truncate(), [0.0, 1.0]);
    let edge = |curve, [from, to]: [u32; 2]| Edge { curve, vertices: [VertexId(from), VertexId(to)], entity: None };
    let side = |edge, reversed, uv| EdgeUse { edge: Some(EdgeId(edge)), reversed, uv };
    let uses = vec![side(0, false, outer_uv), side(1, false, line_uv), side(2, true, inner_uv)];
    let face = Face { loops: vec![TrimLoop { uses }], ..Face::whole(surface) };
    let part = Part {
        vertices: vec![Point::ZERO, a, b],
        edges: vec![edge(outer, [0, 1]), edge(line, [1, 2]), edge(inner, [0, 2])],
        shells: vec![Shell { faces: vec![face], ..Shell::default() }],
        ..Part::default()
    };
    // The triangle of the chords of both, with the segments beyond them.
    let segment = |k: usize| 0.5 * radii[k] * radii[k] * (angles[k] - angles[k].sin());
    let expected = 0.5 * a.truncate().perp_dot(b.truncate()) + segment(0) - segment(1);
    (Model::from_part(part), expected)
}

#[test]
fn chords_of_two_arcs_that_touch_do_not_cross() {
    let (model, expected) = face_between_touching_arcs();
    for tolerance in [0.2, 0.1, 0.05, 0.02] {
        let made = tessellate(&model, &measured(tolerance));
        assert_eq!(made.report.repaired, [], "{tolerance}");
        assert_eq!(made.report.certified, made.report.facets, "{tolerance}");
        // Chords of both sag alike; what is left is less than a tolerance along the line.
        assert!((made.report.area_mm2 - expected).abs() < 0.05 * expected, "{} {expected}", made.report.area_mm2);
    }
}

/// Where two sides of a face cross in the file, shorter chords would cross as well: they stay as long as their tolerance lets them be.
#[test]
fn sides_that_cross_themselves_are_not_divided_for_it() {
    // Two parabolas, the second the mirror image of the first, that pass each other by 60 µm in a corner, and the lines between their ends.
    let bent = |p: [[f64; 2]; 3]| {
        let points = p.map(|[x, y]| Point::new(x, y, 0.0).extend(1.0)).to_vec();
        let flat = p.map(|[x, y]| Point::new(x, y, 1.0)).to_vec();
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        (Curve { degree: 2, knots: knots.clone(), points }, UvCurve { degree: 2, knots, points: flat })
    };
    let straight = |a: [f64; 2], b: [f64; 2]| bent([a, [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])], b]);
    let corners = [[0.0, 0.0], [10.0, 5.06], [10.0, 4.94], [0.0, 10.0]];
    let sides = [
        bent([corners[0], [7.0, 0.5], corners[1]]),
        straight(corners[1], corners[2]),
        bent([corners[2], [7.0, 9.5], corners[3]]),
        straight(corners[3], corners[0]),
    ];
    let (mut edges, mut uses) = (Vec::new(), Vec::new());
    for (k, (curve, uv)) in (0u32..).zip(sides) {
        edges.push(Edge { curve, vertices: [VertexId(k), VertexId((k + 1) % 4)], entity: None });
        uses.push(EdgeUse { edge: Some(EdgeId(k)), reversed: false, uv });
    }
    let face =
        Face { loops: vec![TrimLoop { uses }], ..Face::whole(sweep::plane(&Frame::IDENTITY, [[-1.0, 11.0]; 2])) };
    let part = Part {
        vertices: corners.map(|[x, y]| Point::new(x, y, 0.0)).to_vec(),
        edges,
        shells: vec![Shell { faces: vec![face], ..Shell::default() }],
        ..Part::default()
    };
    let tolerance: f64 = 0.01;
    let made = tessellate(&Model::from_part(part), &measured(tolerance));
    assert_eq!(made.report.repaired[0].how, Repair::CrossingBorder);
    // A parabola of n equal pieces lies |p₀ − 2p₁ + p₂| / 4n² off its chords.
    let chords = (4.0f64.hypot(4.06) / 4.0 / tolerance).sqrt();
    let vertices = made.mesh.vertices.len() as f64;
    assert!(vertices > chords && vertices < 4.0 * chords + 8.0, "{vertices} for two arcs of {chords} chords");
}

/// A face that has been meshed into as many facets as its work allows keeps the border that it has, and says so.
#[test]
fn a_face_is_not_meshed_again_beyond_its_work() {
    let (model, _) = face_between_touching_arcs();
    // A plane takes no proofs: its facets alone are counted, 10,000 steps each.
    let made = tessellate(&model, &Settings { most_steps: 10_000, ..measured(0.2) });
    assert_eq!(made.report.faces.failed, 0);
    assert_eq!(made.report.repaired[0].how, Repair::CrossingBorder);
}

/// On a face whose cells have used up their budget chords that cross get the corners of those across, and no shorter ones: four rounds of
/// these took a second each on a face of 80,000 facets, and mended nothing.
#[test]
fn crossing_chords_are_not_halved_on_a_face_beyond_its_budget() {
    // Bent by 10 µm, or it would be one plane without cells.
    let [x, y] = [[-1.0, 40.0], [-1.0, 10.0]];
    let points = [(x[0], 0.0), (0.5 * (x[0] + x[1]), 0.02), (x[1], 0.0)];
    let points = points.into_iter().flat_map(|(x, z)| y.map(|y| Point::new(x, y, z).extend(1.0))).collect();
    let knots = [[[x[0]; 3], [x[1]; 3]].concat(), [[y[0]; 2], [y[1]; 2]].concat()];
    let (model, _) = face_between_touching_arcs_on(Surface { degree: [2, 1], knots, points });
    let made = |budget| tessellate(&model, &Settings { budget, ..measured(0.2) });
    assert_eq!(made(1000).report.repaired, []);
    let short = made(0);
    assert_eq!(short.report.repaired[0].how, Repair::CoarserCells);
    // Arcs of radius r and angle a whose chords sag by 0.2 mm at most.
    let chords: f64 = [(66.0f64, 0.5), (65.0, 0.45)].map(|(r, a)| (a * (r / 1.6).sqrt()).ceil()).iter().sum();
    let vertices = short.mesh.vertices.len() as f64;
    assert!(vertices < 4.0 * chords, "{vertices} for two arcs of {chords} chords");
}

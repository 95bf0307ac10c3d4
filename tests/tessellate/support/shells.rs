//! Random closed shells of trimmed rational faces: two sheets over one rim, the upper one cut into faces by random trims.

use super::knots;
use super::sheets::two_sheets;
use lampyris::math::{Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve};
use proptest::prelude::*;

/// How the upper sheet is cut.
#[derive(Clone, Debug)]
pub(crate) struct Cuts {
    /// A hole with a lid of its own: centre, radius and waves in shares of the domain.
    pub(crate) hole: Option<[f64; 5]>,
    /// A cut from side to side: where it starts and ends, and its waves.
    pub(crate) across: Option<[f64; 4]>,
}

/// Two sheets whose control points and weights agree on the border and nowhere else, the first above; and how that is cut.
pub(crate) fn sheets() -> impl Strategy<Value = ([Surface; 2], Cuts)> {
    // At least one control point off the rim: without, the sheets would lie on each other.
    let inner =
        |degree: usize| (Just(degree), proptest::collection::vec(any::<(u8, u8)>(), usize::from(degree == 1)..3));
    let side = || (1usize..=5).prop_flat_map(inner);
    let noise = proptest::collection::vec((-1f64..1.0, -1f64..1.0, -1f64..1.0, -1f64..1.0), 512);
    // Scale and place: from a micrometre to a hundred metres, up to a thousand sizes off the origin.
    let place = (-4.5f64..3.3, prop_oneof![Just(0f64), 0f64..3.0], any::<bool>());
    (side(), side(), noise, place, cuts()).prop_map(|((p, inner_u), (q, inner_v), noise, place, cuts)| {
        let knots = [knots(p, &inner_u), knots(q, &inner_v)];
        let (scale, off) = (10f64.powf(place.0), 10f64.powf(place.1) - 1.0);
        let wild_rim = if place.2 { 2.0 } else { 0.5 };
        let placed = |at: Point| (at + Vector::new(30.0, -20.0, 10.0) * off) * scale;
        (two_sheets([p, q], &knots, &noise, wild_rim, placed), cuts)
    })
}

fn cuts() -> impl Strategy<Value = Cuts> {
    let hole = (0.3f64..0.7, 0.55f64..0.75, -2.5f64..-0.75, 0f64..0.4, 1f64..6.0);
    let hole = hole.prop_map(|(x, y, r, wave, times)| [x, y, 10f64.powf(r), wave, times.floor()]);
    // From the very corner, from near to it, or from anywhere: slivers beside the rim.
    let start = prop_oneof![Just(0f64), (-4f64..-1.0).prop_map(|e| 10f64.powf(e)), 0.05f64..0.35];
    let across = (start.clone(), start, 0f64..0.9, 1f64..5.0).prop_map(|(a, b, wave, times)| [a, b, wave, times]);
    (proptest::option::of(hole), proptest::option::of(across)).prop_map(|(hole, across)| Cuts { hole, across })
}

/// A part under construction.
#[derive(Default)]
struct Builder {
    part: Part,
}

impl Builder {
    fn vertex(&mut self, p: Point) -> VertexId {
        self.part.vertices.push(p);
        VertexId(self.part.vertices.len() as u32 - 1)
    }

    fn edge(&mut self, curve: Curve, vertices: [VertexId; 2]) -> EdgeId {
        self.part.edges.push(Edge { curve, vertices, entity: None });
        EdgeId(self.part.edges.len() as u32 - 1)
    }
}

/// A curve of the parameter plane over `[0, 1]` as a polyline so fine that, on the surface, its chords stray less than
/// `gap` if 2^14 of them are enough, and how far they stray.
pub(crate) fn fine(surface: &Surface, at: impl Fn(f64) -> Uv, gap: f64) -> (Vec<f64>, Vec<Uv>, f64) {
    let (mut t, mut most) = (vec![0.0], 0f64);
    let mut stack: Vec<(f64, f64, u32)> =
        (0..32).rev().map(|k| (k as f64 / 32.0, (k + 1) as f64 / 32.0, 0)).collect();
    while let Some((a, b, depth)) = stack.pop() {
        let (x, y) = (at(a), at(b));
        let (p, q) = (surface.evaluate(x), surface.evaluate(y));
        let off = [0.25, 0.5, 0.75].map(|f| (surface.evaluate(x.lerp(y, f)) - p.lerp(q, f)).length());
        if depth < 9 && off.iter().any(|&o| o > gap) {
            let m = 0.5 * (a + b);
            stack.extend([(m, b, depth + 1), (a, m, depth + 1)]);
        } else {
            most = off.into_iter().fold(most, f64::max);
            t.push(b);
        }
    }
    let uv = t.iter().map(|&t| at(t)).collect();
    (t, uv, most)
}

/// The closed shell, whose trims are to stray less than `gap` from their edges, and how far they do.
pub(crate) fn pillow([above, below]: &[Surface; 2], cuts: &Cuts, gap: f64) -> (Model, f64) {
    let mut strays = 0f64;
    let [[u0, u1], [v0, v1]] = above.domain();
    let place = |x: f64, y: f64| Uv::new(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
    let mut b = Builder::default();
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| place(x, y));
    let ids = corners.map(|c| b.vertex(above.evaluate(c)));
    let line = |a: Uv, b: Uv, t: [f64; 2]| UvCurve::line(a, b, t);
    // Sides in ascending parameters: bottom, right, top, left; the right and left ones in two where a cut ends there.
    let [bottom, top] = [(v0, [0, 1]), (v1, [3, 2])].map(|(at, ends)| {
        let edge = b.edge(above.isoline(1, at), ends.map(|k: usize| ids[k]));
        let on = Uv::new(0.0, at);
        vec![(edge, line(on.with_x(u0), on.with_x(u1), [u0, u1]))]
    });
    let mut side = |x: f64, cut: Option<f64>, ends: [usize; 2]| {
        let level = place(x, 0.0).x;
        let whole = above.isoline(0, level);
        let uses = |from: f64, to: f64| line(Uv::new(level, from), Uv::new(level, to), [from, to]);
        let Some(at) = cut.filter(|&c| c > 0.0).map(|c| place(0.0, c).y) else {
            let middle = cut.map(|_| ids[ends[0]]);
            return (vec![(b.edge(whole, ends.map(|k| ids[k])), uses(v0, v1))], middle);
        };
        let middle = b.vertex(above.evaluate(Uv::new(level, at)));
        let low = b.edge(whole.restricted(v0, at), [ids[ends[0]], middle]);
        let high = b.edge(whole.restricted(at, v1), [middle, ids[ends[1]]]);
        (vec![(low, uses(v0, at)), (high, uses(at, v1))], Some(middle))
    };
    let (right, right_cut) = side(1.0, cuts.across.map(|c| c[1]), [1, 2]);
    let (left, left_cut) = side(0.0, cuts.across.map(|c| c[0]), [0, 3]);
    let uses =
        |(edge, uv): &(EdgeId, UvCurve), reversed: bool| EdgeUse { edge: Some(*edge), reversed, uv: uv.clone() };
    let mut faces = Vec::new();
    let mut trimmed = |uses: Vec<EdgeUse>, more: Vec<EdgeUse>| {
        let loops = [uses, more].into_iter().filter(|u| !u.is_empty()).map(|uses| TrimLoop { uses }).collect();
        faces.push(Face { loops, ..Face::whole(above.clone()) });
    };
    // The hole: one edge around, its lid inside.
    let mut around = None;
    if let Some([x, y, r, wave, times]) = cuts.hole {
        let ring = |t: f64| {
            let angle = std::f64::consts::TAU * (if t == 1.0 { 0.0 } else { t });
            let r = r * (1.0 + wave * (times * angle).cos());
            place(x + r * angle.cos(), y + r * angle.sin())
        };
        let (t, uv, off) = fine(above, ring, gap);
        strays = strays.max(off);
        let points: Vec<Point> = uv.iter().map(|&x| above.evaluate(x)).collect();
        let vertex = b.vertex(points[0]);
        let edge = (b.edge(Curve::polyline(&t, &points), [vertex; 2]), UvCurve::polyline(&t, &uv));
        trimmed(vec![uses(&edge, false)], Vec::new());
        around = Some(vec![uses(&edge, true)]);
    }
    let hole = around.unwrap_or_default();
    match (cuts.across, left_cut, right_cut) {
        (Some([from, to, wave, times]), Some(start), Some(end)) => {
            // From the left side to the right one, below the hole, waving by less than its height.
            let cut = |t: f64| {
                let y = from + (to - from) * t;
                let hump = (std::f64::consts::PI * t).sin() * (0.06 + 0.05 * wave * (6.0 * times * t).sin());
                place(t, y + hump)
            };
            let (t, uv, off) = fine(above, cut, gap);
            strays = strays.max(off);
            let points: Vec<Point> = uv.iter().map(|&x| above.evaluate(x)).collect();
            let edge = (b.edge(Curve::polyline(&t, &points), [start, end]), UvCurve::polyline(&t, &uv));
            let mut low = vec![uses(&bottom[0], false)];
            low.extend(right.iter().take(right.len() - 1).map(|e| uses(e, false)));
            low.push(uses(&edge, true));
            low.extend(left.iter().take(left.len() - 1).rev().map(|e| uses(e, true)));
            let high = vec![
                uses(&edge, false),
                uses(&right[right.len() - 1], false),
                uses(&top[0], true),
                uses(&left[left.len() - 1], true),
            ];
            trimmed(low, Vec::new());
            trimmed(high, hole);
        }
        _ => trimmed(
            vec![uses(&bottom[0], false), uses(&right[0], false), uses(&top[0], true), uses(&left[0], true)],
            hole,
        ),
    }
    // Counter-clockwise in the parameters of its own surface, whichever way its normal looks.
    let mut rim = vec![uses(&bottom[0], false)];
    rim.extend(right.iter().map(|e| uses(e, false)));
    rim.push(uses(&top[0], true));
    rim.extend(left.iter().rev().map(|e| uses(e, true)));
    let lower = Face { reversed: true, loops: vec![TrimLoop { uses: rim }], ..Face::whole(below.clone()) };
    faces.push(lower);
    b.part.shells = vec![Shell { faces, closed: true, ..Shell::default() }];
    (Model::from_part(b.part), strays)
}

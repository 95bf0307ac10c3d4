//! Pieces of trimming curves, monotone in v: what the in/out test counts.

use crate::math::Uv;
use glam::DVec3;
use smallvec::{SmallVec, smallvec};

/// The height of a trim is solved to this step of the piece's parameter, nine ulps of its middle.
const HEIGHT_STEP: f64 = 1e-15;
/// Steps after which halving alone has come down to an ulp.
const HEIGHT_STEPS: usize = 60;
/// The nearest point of a piece is sought to this step of its parameter: its distance is then right to the square.
const NEAREST_STEP: f64 = 1e-12;
/// Steps to the nearest point of a piece, which is monotone and short.
const NEAREST_STEPS: usize = 8;
/// How often a piece is halved for being long.
pub(super) const SHORTENED: u32 = 8;

/// Homogeneous control points `(w·u, w·v, w)` of one piece, on the stack up to degree seven.
pub(super) type ControlPoints = SmallVec<[DVec3; 8]>;

/// The pieces of all trims of a face, in the order of its loops, with their control points in one list: trims are most of what a model of
/// many curved borders takes.
#[derive(Debug, Default)]
pub(super) struct TrimPieces {
    records: Vec<PieceRecord>,
    /// `(u, v)` of the points of a polynomial piece, `(w·u, w·v, w)` of a rational one. Where a piece begins with the last point of the
    /// one before it, both have it from the same place.
    coordinates: Vec<f64>,
}

/// What is kept of a piece beside its control points.
#[derive(Clone, Debug)]
struct PieceRecord {
    /// v at the two ends in order of the curve's parameter; bit-equal with the neighbours of the loop.
    v: [f64; 2],
    /// Least and largest u of the control points.
    u: [f64; 2],
    /// The edge's parameters at the ends.
    range: [f64; 2],
    /// Index of its first coordinate.
    first: u32,
    /// Index of the use it belongs to, in the order of the face's loops.
    owner: u32,
    degree: u8,
    /// Whether its weights are not all 1.
    rational: bool,
    /// Whether the loop runs against the piece.
    reversed: bool,
}

/// A rational Bézier piece of a trimming curve in the parameter plane, monotone in v as far as it could be cut so. Its weights are
/// positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrimPiece<'a> {
    record: &'a PieceRecord,
    coordinates: &'a [f64],
}

/// The use of an edge in a loop that a piece comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopSide {
    /// Index of the use, in the order of the face's loops.
    pub(super) owner: u32,
    /// Whether the loop runs against the edge.
    pub(super) reversed: bool,
}

impl TrimPieces {
    /// Pieces by their index.
    #[inline]
    pub(super) fn get(&self, index: u32) -> TrimPiece<'_> {
        TrimPiece { record: &self.records[index as usize], coordinates: &self.coordinates }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = TrimPiece<'_>> {
        self.records.iter().map(|record| TrimPiece { record, coordinates: &self.coordinates })
    }

    pub(super) fn len(&self) -> usize {
        self.records.len()
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.records) + size_of_val(&*self.coordinates)
    }

    /// Adds a piece of homogeneous control points over the parameters `range` of the edge of `side`.
    pub(super) fn push(&mut self, points: &[DVec3], range: [f64; 2], side: LoopSide) {
        let LoopSide { owner, reversed } = side;
        let at = |p: &DVec3| p.truncate() / p.z;
        let last = points.len() - 1;
        let (least, most) = points
            .iter()
            .map(|p| at(p).x)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(u), b.max(u)));
        let rational = points.iter().any(|p| p.z != 1.0);
        let width = width(rational);
        let coordinates = |p: &DVec3| p.to_array().into_iter().take(width);
        // The halves of a piece meet in one point, as the pieces of a spline mostly do.
        let tail = self.coordinates.len().checked_sub(width);
        let same = |t: usize| {
            let tail = self.coordinates[t..].iter().map(|x| x.to_bits());
            tail.eq(coordinates(&points[0]).map(f64::to_bits))
        };
        let continues = self.records.last().is_some_and(|r| r.rational == rational) && tail.is_some_and(same);
        let first = if continues { self.coordinates.len() - width } else { self.coordinates.len() };
        self.coordinates.extend(points[usize::from(continues)..].iter().flat_map(coordinates));
        self.records.push(PieceRecord {
            v: [at(&points[0]).y, at(&points[last]).y],
            u: [least, most],
            range,
            first: first as u32,
            owner,
            degree: last as u8,
            rational,
            reversed,
        });
    }

    /// Turns the order of the pieces from `start` on around.
    pub(super) fn reverse_from(&mut self, start: usize) {
        self.records[start..].reverse();
    }

    /// Makes a loop of the pieces from `first` on: each begins at the very height where the one before it ends, so that parity never slips
    /// through.
    pub(super) fn join_from(&mut self, first: usize) {
        let n = self.len() - first;
        for k in 0..n {
            let piece = &self.records[first + k];
            let end = piece.v[usize::from(!piece.reversed)];
            let next = &mut self.records[first + (k + 1) % n];
            next.v[usize::from(next.reversed)] = end;
        }
    }

    /// Gives back the room for further pieces.
    pub(super) fn shrink_to_fit(&mut self) {
        self.records.shrink_to_fit();
        self.coordinates.shrink_to_fit();
    }
}

/// Coordinates that are kept of a control point.
fn width(rational: bool) -> usize {
    if rational { 3 } else { 2 }
}

/// Place and derivative at `t` in `[0, 1]` of the curve of these homogeneous control points.
fn evaluate(points: &[DVec3], t: f64) -> (Uv, Uv) {
    let n = points.len() - 1;
    let mut w: ControlPoints = points.into();
    for r in 1..n {
        for k in 0..=n - r {
            w[k] = w[k] + (w[k + 1] - w[k]) * t;
        }
    }
    let d = (w[1] - w[0]) * n as f64;
    let a = w[0] + (w[1] - w[0]) * t;
    let p = a.truncate() / a.z;
    (p, (d.truncate() - p * d.z) / a.z)
}

impl TrimPiece<'_> {
    /// Index of the use it belongs to, in the order of the face's loops.
    pub(super) fn owner(self) -> u32 {
        self.record.owner
    }

    /// Whether the loop runs against the piece.
    pub(super) fn is_reversed(self) -> bool {
        self.record.reversed
    }

    /// Whether it has one height, so that it crosses no half-line towards +u.
    pub(super) fn is_level(self) -> bool {
        self.record.v[0] == self.record.v[1]
    }

    /// The edge's parameter at `t` in `[0, 1]` of the piece.
    pub(super) fn edge_parameter(self, t: f64) -> f64 {
        let [from, to] = self.record.range;
        from + (to - from) * t
    }

    /// Its control points, `(w·u, w·v, w)`.
    fn points(self) -> ControlPoints {
        let PieceRecord { first, degree, rational, .. } = *self.record;
        let count = usize::from(degree) + 1;
        let kept = &self.coordinates[first as usize..][..count * width(rational)];
        if rational {
            kept.chunks_exact(3).map(DVec3::from_slice).collect()
        } else {
            kept.chunks_exact(2).map(|p| DVec3::new(p[0], p[1], 1.0)).collect()
        }
    }

    /// Least and largest u of the box around its control points.
    #[inline]
    pub(super) fn u_range(self) -> [f64; 2] {
        self.record.u
    }

    /// Least and largest v of the box around its control points and the ends.
    pub(super) fn v_range(self) -> [f64; 2] {
        let [from, to] = self.record.v;
        let heights = self.points().into_iter().map(|p| p.y / p.z);
        heights.fold([from.min(to), from.max(to)], |[lo, hi], v| [lo.min(v), hi.max(v)])
    }

    /// Boxes, by their low and high corners, that together hold the piece, each no longer than `longest` in u and v unless that took too
    /// many: the bounding box of a curve, which was cut so short, and those of parts of a line.
    pub(super) fn boxes(self, longest: Uv) -> SmallVec<[[Uv; 2]; 1]> {
        let (us, vs) = (self.u_range(), self.v_range());
        let [min, max] = [0, 1].map(|end| Uv::new(us[end], vs[end]));
        let mut boxes: SmallVec<[[Uv; 2]; 1]> = smallvec![[min, max]];
        let [from, to] = self.points()[..] else { return boxes };
        boxes.clear();
        let mut stack: SmallVec<[(DVec3, DVec3, u32); 16]> = smallvec![(from, to, 0)];
        while let Some((from, to, depth)) = stack.pop() {
            let [a, b] = [from, to].map(|p| p.truncate() / p.z);
            let size = (b - a).abs();
            if (size.x <= longest.x && size.y <= longest.y) || depth >= SHORTENED {
                // Joints move by rounding only, which the reach of a query covers.
                boxes.push([a.min(b).max(min), a.max(b).min(max)]);
                continue;
            }
            let middle = 0.5 * (from + to);
            stack.push((middle, to, depth + 1));
            stack.push((from, middle, depth + 1));
        }
        boxes
    }

    /// Surface parameters and their derivative at `t` in `[0, 1]`.
    pub(super) fn evaluate(self, t: f64) -> (Uv, Uv) {
        evaluate(&self.points(), t)
    }

    /// The u at which the piece crosses the height `v`, which must lie in its range and the piece not be level.
    pub(super) fn u_at(self, v: f64) -> f64 {
        let points = self.points();
        if let [from, to] = points[..] {
            // A line in closed form, by its own ends: those of the piece may be moved to its neighbours' by rounding.
            let (before, behind) = (v * from.z - from.y, to.y - v * to.z);
            let t = before / (before + behind);
            return evaluate(&points, if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }).0.x;
        }
        // Newton's method inside of a bracket, which a monotone piece allows: it ends whatever the slope.
        let (mut lo, mut hi) = (0.0, 1.0);
        let [from, to] = self.record.v;
        let rising = to > from;
        let mut t = ((v - from) / (to - from)).clamp(0.0, 1.0);
        let mut u = 0.0;
        for _ in 0..HEIGHT_STEPS {
            let (p, d) = evaluate(&points, t);
            u = p.x;
            let error = p.y - v;
            if error == 0.0 {
                break;
            }
            if (error > 0.0) == rising {
                hi = t
            } else {
                lo = t
            }
            let newton = t - error / d.y;
            let next = if newton > lo && newton < hi { newton } else { 0.5 * (lo + hi) };
            if (next - t).abs() <= HEIGHT_STEP {
                break;
            }
            t = next;
        }
        u
    }

    /// Whether the height `v` lies between the ends of the piece, the upper end excluded, so that a joint counts once.
    #[inline]
    pub(super) fn spans(self, v: f64) -> bool {
        let [from, to] = self.record.v;
        let (low, high) = if from < to { (from, to) } else { (to, from) };
        low <= v && v < high
    }

    /// Whether the half-line from `q` towards +u crosses the piece; heights are half-open, so that a joint counts once.
    #[inline]
    pub(super) fn crosses(self, q: Uv) -> bool {
        let [least, most] = self.u_range();
        if !self.spans(q.y) || q.x > most {
            return false;
        }
        q.x < least || q.x < self.u_at(q.y)
    }

    /// The parameter, in `[0, 1]`, of the piece's point nearest to `q` and the distance there, mm, by the first fundamental form with the
    /// coefficients `[E, F, G]`. By Gauss–Newton steps the nearest from the foot on the chord, which on a short piece is the nearest of
    /// all.
    pub(super) fn nearest(self, q: Uv, metric: [f64; 3]) -> (f64, f64) {
        let [e, f, g] = metric;
        let inner = |a: Uv, b: Uv| e * a.x * b.x + f * (a.x * b.y + a.y * b.x) + g * a.y * b.y;
        let points = self.points();
        let n = points.len() - 1;
        let at = |k: usize| points[k].truncate() / points[k].z;
        let chord = at(n) - at(0);
        // From the foot on the chord, which is exact for lines and near for pieces as short as a cell.
        let mut t = (inner(q - at(0), chord) / inner(chord, chord).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        if n > 1 {
            for _ in 0..NEAREST_STEPS {
                let (p, d) = evaluate(&points, t);
                let next = (t + inner(q - p, d) / inner(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let done = (next - t).abs() < NEAREST_STEP;
                t = next;
                if done {
                    break;
                }
            }
        }
        let off = q - evaluate(&points, t).0;
        (t, inner(off, off).max(0.0).sqrt())
    }
}

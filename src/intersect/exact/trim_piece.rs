//! Pieces of trimming curves that are monotone in v, as far as splitting them may go: what the in/out test counts.

use crate::math::Uv;
use crate::model::Face;
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
/// A piece that rises by less than this share of a cell and of its height need not be monotone: to split it would only sort rounding.
const FLAT: f64 = 1e-11;
/// How often a piece is halved for being long.
const SHORTENED: u32 = 8;
/// How often a piece is halved for not being monotone: its turn is then within 6e-8 of the piece.
const DEEPEST: u32 = 24;
/// Most pieces that one Bézier piece of a trim is split into.
const MOST_PIECES: usize = 4096;

/// A rational Bézier piece of a trimming curve in the parameter plane, monotone in v but where [`split`] met its limits.
#[derive(Clone, Debug)]
pub(super) struct TrimPiece {
    /// Homogeneous control points `(w·u, w·v, w)`, weights positive.
    pub(super) points: SmallVec<[DVec3; 4]>,
    /// v at the two ends in order of the curve's parameter; bit-equal with the neighbours of the loop.
    pub(super) v: [f64; 2],
    /// Bounding box of the control points and the ends.
    pub(super) min: Uv,
    pub(super) max: Uv,
    /// Index of the use it belongs to, in the order of the face's loops.
    pub(super) owner: u32,
    /// Whether the loop runs against the piece.
    pub(super) reversed: bool,
    /// The edge's parameters at the ends.
    pub(super) range: [f64; 2],
}

/// The use of an edge in a loop that a piece comes from.
#[derive(Clone, Copy, Debug)]
struct LoopSide {
    /// Index of the use, in the order of the face's loops.
    owner: u32,
    /// Whether the loop runs against the edge.
    reversed: bool,
}

impl TrimPiece {
    /// Makes a piece of homogeneous control points, `(w·u, w·v, w)`, over the parameters `range` of the edge of `side`.
    fn new(points: SmallVec<[DVec3; 4]>, range: [f64; 2], side: LoopSide) -> Self {
        let LoopSide { owner, reversed } = side;
        let at = |p: &DVec3| p.truncate() / p.z;
        let v = [at(&points[0]).y, at(&points[points.len() - 1]).y];
        let (min, max) = (Uv::INFINITY, Uv::NEG_INFINITY);
        let mut piece = Self { points, v, min, max, owner, reversed, range };
        piece.update_bounds();
        piece
    }

    /// Sets the bounding box anew from the control points and the heights of the ends.
    fn update_bounds(&mut self) {
        self.min = Uv::new(f64::INFINITY, self.v[0].min(self.v[1]));
        self.max = Uv::new(f64::NEG_INFINITY, self.v[0].max(self.v[1]));
        for p in &self.points {
            let q = p.truncate() / p.z;
            self.min = self.min.min(q);
            self.max = self.max.max(q);
        }
    }

    /// Boxes, by their low and high corners, that together hold the piece, each no longer than `longest` in u and v unless that took too
    /// many: the bounding box of a curve, which was cut so short, and those of parts of a line.
    pub(super) fn boxes(&self, longest: Uv) -> SmallVec<[[Uv; 2]; 1]> {
        let mut boxes: SmallVec<[[Uv; 2]; 1]> = smallvec![[self.min, self.max]];
        let [from, to] = self.points[..] else { return boxes };
        boxes.clear();
        let mut stack: SmallVec<[(DVec3, DVec3, u32); 16]> = smallvec![(from, to, 0)];
        while let Some((from, to, depth)) = stack.pop() {
            let [a, b] = [from, to].map(|p| p.truncate() / p.z);
            let size = (b - a).abs();
            if (size.x <= longest.x && size.y <= longest.y) || depth >= SHORTENED {
                // Joints move by rounding only, which the reach of a query covers.
                boxes.push([a.min(b).max(self.min), a.max(b).min(self.max)]);
                continue;
            }
            let middle = 0.5 * (from + to);
            stack.push((middle, to, depth + 1));
            stack.push((from, middle, depth + 1));
        }
        boxes
    }

    /// Surface parameters and their derivative at `t` in `[0, 1]`.
    pub(super) fn evaluate(&self, t: f64) -> (Uv, Uv) {
        let n = self.points.len() - 1;
        let mut w: SmallVec<[DVec3; 8]> = self.points.as_slice().into();
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

    /// The u at which the piece crosses the height `v`, which must lie in its range and the piece not be level.
    pub(super) fn u_at(&self, v: f64) -> f64 {
        if let [from, to] = self.points[..] {
            // A line in closed form, by its own ends: those of the piece may be moved to its neighbours' by rounding.
            let (before, behind) = (v * from.z - from.y, to.y - v * to.z);
            let t = before / (before + behind);
            return self.evaluate(if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }).0.x;
        }
        // Newton's method inside of a bracket, which a monotone piece allows: it ends whatever the slope.
        let (mut lo, mut hi) = (0.0, 1.0);
        let rising = self.v[1] > self.v[0];
        let mut t = ((v - self.v[0]) / (self.v[1] - self.v[0])).clamp(0.0, 1.0);
        let mut u = 0.0;
        for _ in 0..HEIGHT_STEPS {
            let (p, d) = self.evaluate(t);
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
    pub(super) fn spans(&self, v: f64) -> bool {
        let (low, high) = if self.v[0] < self.v[1] { (self.v[0], self.v[1]) } else { (self.v[1], self.v[0]) };
        low <= v && v < high
    }

    /// Whether the half-line from `q` towards +u crosses the piece; heights are half-open, so that a joint counts once.
    #[inline]
    pub(super) fn crosses(&self, q: Uv) -> bool {
        if !self.spans(q.y) || q.x > self.max.x {
            return false;
        }
        q.x < self.min.x || q.x < self.u_at(q.y)
    }

    /// The parameter, in `[0, 1]`, of the piece's point nearest to `q` and the distance there, mm, by the first fundamental form with the
    /// coefficients `[E, F, G]`. By Gauss–Newton steps the nearest from the foot on the chord, which on a short piece is the nearest of
    /// all.
    pub(super) fn nearest(&self, q: Uv, metric: [f64; 3]) -> (f64, f64) {
        let [e, f, g] = metric;
        let inner = |a: Uv, b: Uv| e * a.x * b.x + f * (a.x * b.y + a.y * b.x) + g * a.y * b.y;
        let n = self.points.len() - 1;
        let at = |k: usize| self.points[k].truncate() / self.points[k].z;
        let chord = at(n) - at(0);
        // From the foot on the chord, which is exact for lines and near for pieces as short as a cell.
        let mut t = (inner(q - at(0), chord) / inner(chord, chord).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        if n > 1 {
            for _ in 0..NEAREST_STEPS {
                let (p, d) = self.evaluate(t);
                let next = (t + inner(q - p, d) / inner(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let done = (next - t).abs() < NEAREST_STEP;
                t = next;
                if done {
                    break;
                }
            }
        }
        let off = q - self.evaluate(t).0;
        (t, inner(off, off).max(0.0).sqrt())
    }
}

/// Cuts all loops of a face into pieces monotone in v and, but for straight ones, no longer than `longest` in u and v, with bit-equal
/// heights at joints. Pieces that are not finite or not positive in weight are left out; absurdly long or wild ones stay as they are.
pub(super) fn trim_pieces(face: &Face, longest: Uv) -> Vec<TrimPiece> {
    let mut all = Vec::new();
    let mut owner = 0;
    for trim in &face.loops {
        let first = all.len();
        for edge_use in &trim.uses {
            let start = all.len();
            let breaks = edge_use.uv.breakpoints();
            for (points, range) in edge_use.uv.bezier_pieces().into_iter().zip(breaks.windows(2)) {
                if points.iter().all(|p| p.is_finite() && p.z > 0.0) {
                    let whole = CurvePart { points: points.into(), range: [range[0], range[1]], depth: 0 };
                    split(&mut all, whole, longest, LoopSide { owner, reversed: edge_use.reversed });
                }
            }
            // Pieces follow the loop, so that the end of one is the start of the next.
            if edge_use.reversed {
                all[start..].reverse();
            }
            owner += 1;
        }
        // Each piece begins at the very height where the one before it ends, so that parity never slips through.
        let n = all.len() - first;
        for k in 0..n {
            let end = {
                let piece: &TrimPiece = &all[first + k];
                piece.v[if piece.reversed { 0 } else { 1 }]
            };
            let next: &mut TrimPiece = &mut all[first + (k + 1) % n];
            next.v[if next.reversed { 1 } else { 0 }] = end;
            next.update_bounds();
        }
    }
    all.shrink_to_fit();
    all
}

/// A part of a Bézier piece of a trim.
struct CurvePart {
    /// As [`TrimPiece::points`].
    points: SmallVec<[DVec3; 4]>,
    /// The edge's parameters at the ends.
    range: [f64; 2],
    /// How often it was halved.
    depth: u32,
}

/// Halves a Bézier piece until its parts are monotone in v and no longer than `longest` in u and v, or limits are reached, and adds them
/// to `out` in the order of the curve.
fn split(out: &mut Vec<TrimPiece>, whole: CurvePart, longest: Uv, side: LoopSide) {
    let first = out.len();
    let mut stack = vec![whole];
    while let Some(CurvePart { points, range, depth }) = stack.pop() {
        let at = |k: usize| points[k].truncate() / points[k].z;
        let n = points.len() - 1;
        let rising = at(n).y >= at(0).y;
        // A curve changes direction no more often than its control polygon does (variation diminishing), so a monotone polygon proves a
        // monotone piece, of which parity needs the ends alone.
        let monotone = (0..n).all(|k| if rising { at(k + 1).y >= at(k).y } else { at(k + 1).y <= at(k).y });
        let bounds = (0..=n).fold((at(0), at(0)), |(lo, hi), k| (lo.min(at(k)), hi.max(at(k))));
        let size = bounds.1 - bounds.0;
        let flat = size.y < FLAT * (longest.y + bounds.1.y.abs());
        // Of a line the height and the foot are closed forms at any length. Curves far longer than the domain, and more pieces than any
        // real trim has, stay as they are: no input may cost more than this.
        let short = n == 1 || (size.x <= longest.x && size.y <= longest.y) || depth >= SHORTENED;
        if ((monotone || flat) && short) || depth >= DEEPEST || out.len() > first + MOST_PIECES {
            out.push(TrimPiece::new(points, range, side));
            continue;
        }
        let (mut low, mut high) = (points.clone(), points.clone());
        let mut w = points;
        // De Casteljau at one half.
        for r in 0..=n {
            low[r] = w[0];
            for k in 0..n - r {
                w[k] = 0.5 * (w[k] + w[k + 1]);
            }
        }
        high.copy_from_slice(&w);
        let middle = 0.5 * (range[0] + range[1]);
        // The low part comes off the stack first, so that parts come out in the order of the curve.
        stack.push(CurvePart { points: high, range: [middle, range[1]], depth: depth + 1 });
        stack.push(CurvePart { points: low, range: [range[0], middle], depth: depth + 1 });
    }
}

/// Pieces by what they are near, a row or a cell, one list behind the other: of a thousand small faces hash tables took a fifth of all.
#[derive(Debug, Default)]
pub(super) struct PieceLists {
    /// Rows or cells that have pieces, rising.
    pub(super) keys: Vec<u32>,
    /// Where the list of each begins, and the end of the last.
    starts: Vec<u32>,
    pieces: Vec<u32>,
}

impl PieceLists {
    /// Sorts pairs of a row or cell and a piece, some of which may be there more than once.
    pub(super) fn new(mut pairs: Vec<(u32, u32)>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let mut lists = Self { pieces: pairs.iter().map(|&(_, piece)| piece).collect(), ..Self::default() };
        let runs = pairs.chunk_by(|a, b| a.0 == b.0);
        let count = runs.clone().count();
        (lists.keys, lists.starts) = (Vec::with_capacity(count), Vec::with_capacity(count + 1));
        lists.starts.push(0);
        let mut end = 0;
        for run in runs {
            end += run.len() as u32;
            lists.keys.push(run[0].0);
            lists.starts.push(end);
        }
        lists
    }

    /// Bytes that the lists hold.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.keys) + size_of_val(&*self.starts) + size_of_val(&*self.pieces)
    }

    /// The pieces of a row or cell, rising; empty where it has none.
    #[inline]
    pub(super) fn pieces_of(&self, key: u32) -> &[u32] {
        match self.keys.binary_search(&key) {
            Ok(k) => &self.pieces[self.starts[k] as usize..self.starts[k + 1] as usize],
            Err(_) => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::trim::{Region, Trim};
    use super::*;
    use crate::math::Frame;
    use crate::model::{EdgeUse, TrimLoop};
    use crate::nurbs::{UvCurve, sweep};

    #[test]
    fn straight_trims_stay_whole_and_decide_as_their_lines_do() {
        // A square on its corner: |u − 5| + |v − 5| < 4.5.
        let mut face = Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 10.0]; 2]));
        let corners = [Uv::new(5.0, 0.5), Uv::new(9.5, 5.0), Uv::new(5.0, 9.5), Uv::new(0.5, 5.0)];
        let side = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
        let uses = (0..4).map(|k| EdgeUse { edge: None, reversed: false, uv: side(k) }).collect();
        face.loops = vec![TrimLoop { uses }];
        assert_eq!(trim_pieces(&face, Uv::splat(0.1)).len(), 4);
        let trim = Trim::new(&face, [false; 2], 1e-6, &[]);
        let mut borders = 0;
        for (i, j) in (0..=211).flat_map(|i| (0..=197).map(move |j| (i, j))) {
            let q = Uv::new(10.0 * f64::from(i) / 211.0, 10.0 * f64::from(j) / 197.0);
            let inside = (q.x - 5.0).abs() + (q.y - 5.0).abs() < 4.5;
            let region = trim.cell_at(q);
            let expected = if inside { Region::Inside } else { Region::Outside };
            assert!(
                region == expected || region == Region::Border && trim.is_inside(q) == inside,
                "{q} {region:?}"
            );
            borders += usize::from(region == Region::Border);
        }
        // Of 24 cells a side the lines pass four or five in each row, not all that lie in the boxes around them.
        assert!(borders < 212 * 198 / 4, "{borders}");
        // The nearest points within a band are those of the closed form.
        let off = Uv::new(7.0, 2.4999999);
        let place = trim.locate(off, [1.0, 0.0, 1.0], 1e-6);
        assert!(!place.inside && place.near.len() == 1 && place.near[0].owner == 0);
        assert!((place.near[0].distance - 1e-7 * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-14);
    }
}

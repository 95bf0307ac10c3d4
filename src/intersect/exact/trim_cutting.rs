//! Cutting trimming curves into pieces that are monotone in v, as far as that may go.

use super::trim_piece::{ControlPoints, LoopSide, SHORTENED, TrimPieces};
use crate::math::Uv;
use crate::model::Face;

/// A piece that rises by less than this share of a cell and of its height need not be monotone: to split it would only sort rounding.
const FLAT: f64 = 1e-11;
/// How often a piece is halved for not being monotone: its turn is then within 6e-8 of the piece.
const DEEPEST: u32 = 24;
/// Most pieces that one Bézier piece of a trim is split into.
const MOST_PIECES: usize = 4096;

/// Cuts all loops of a face into pieces monotone in v and, but for straight ones, no longer than `longest` in u and v, with bit-equal
/// heights at joints. Pieces that are not finite or not positive in weight are left out; absurdly long or wild ones stay as they are.
pub(super) fn trim_pieces(face: &Face, longest: Uv) -> TrimPieces {
    let mut all = TrimPieces::default();
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
                all.reverse_from(start);
            }
            owner += 1;
        }
        all.join_from(first);
    }
    all.shrink_to_fit();
    all
}

/// A part of a Bézier piece of a trim.
struct CurvePart {
    /// As [`TrimPiece::points`].
    points: ControlPoints,
    /// The edge's parameters at the ends.
    range: [f64; 2],
    /// How often it was halved.
    depth: u32,
}

/// Halves a Bézier piece until its parts are monotone in v and no longer than `longest` in u and v, or limits are reached, and adds them
/// to `out` in the order of the curve.
fn split(out: &mut TrimPieces, whole: CurvePart, longest: Uv, side: LoopSide) {
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
            out.push(&points, range, side);
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

#[cfg(test)]
mod tests {
    use super::super::trim::{Region, Trim};
    use super::*;
    use crate::math::Frame;
    use crate::model::{EdgeUse, TrimLoop};
    use crate::nurbs::{UvCurve, sweep};
    use glam::DVec3;

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

    #[test]
    fn halves_of_a_cubic_keep_their_common_point_once() {
        // From (1, 1) to (9, 1) by a hump, and straight back below it.
        let mut face = Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 10.0]; 2]));
        let points = [[1.0, 1.0], [1.0, 9.0], [9.0, 9.0], [9.0, 1.0]].map(|[u, v]| DVec3::new(u, v, 1.0));
        let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let hump = UvCurve { degree: 3, knots, points: points.to_vec() };
        let back = UvCurve::line(Uv::new(9.0, 1.0), Uv::new(1.0, 1.0), [0.0, 1.0]);
        let uses = [hump.clone(), back].map(|uv| EdgeUse { edge: None, reversed: false, uv }).to_vec();
        face.loops = vec![TrimLoop { uses }];
        let pieces = trim_pieces(&face, Uv::splat(0.2));
        let cubics = pieces.len() - 1;
        assert!(cubics > 40, "{cubics}");
        // Three new points of two coordinates each, and what is kept beside them.
        assert!(
            pieces.bytes() <= (cubics + 1) * (6 * size_of::<f64>() + 64) + 4 * size_of::<f64>(),
            "{}",
            pieces.bytes()
        );
        // Each runs as its part of the whole does.
        for (k, piece) in pieces.iter().take(cubics).enumerate() {
            for t in [0.0, 0.3, 1.0] {
                let off = piece.evaluate(t).0 - hump.evaluate(piece.edge_parameter(t));
                assert!(off.length() < 1e-13, "{k} {t} {off}");
            }
        }
    }
}

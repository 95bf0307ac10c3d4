//! One face: chart, loops in its plane, spline, and edges' uv curves.

use super::boundary::{Boundary, bound_region};
use super::fit::{Fit, Overrun};
use super::lobes::cancelling_lobes;
use super::loops::{Chain, Piece, Source, close_loop};
use super::region::Region;
use super::seams::{Seam, Seams};
use super::task::FaceTask;
use super::tolerances::{EMPTY_RANGE, LARGEST_GAP_SHARE, SEAM_SLACK, SMALLEST_ACCURACY, WHOLE_PERIOD_SLACK};
use crate::math::Uv;
use crate::math::polygon::signed_area;
use crate::model::{Analytic, EdgeId, EdgeUse, TrimLoop};
use crate::nurbs::{ControlPoint, Surface, UvCurve};
use crate::step::chart::{Chart, offset};
use crate::text::figures;
use rustc_hash::FxHashMap;

/// Most periods that a face beside a pole may span: azimuths there mean little.
const MAX_TURNS: f64 = 4.0;
/// Most periods that a face without a pole may span: the flank of a thread has as many turns as the thread.
const MAX_THREAD_TURNS: f64 = 256.0;

/// A built face, mm; seams are numbered from 0, edges as in the task.
pub(crate) struct BuiltFace {
    pub(crate) surface: Surface,
    pub(crate) analytic: Analytic,
    pub(crate) reversed: bool,
    pub(crate) loops: Vec<Vec<FaceUse>>,
    pub(crate) seams: Vec<Seam>,
    /// Largest distance between edges and surface, mm, the moves of ends in the parameter plane included.
    pub(crate) gap: f64,
    /// What was done to it, in words.
    pub(crate) repairs: Vec<String>,
}

/// A use of an edge or seam that has no number in the part yet.
pub(crate) struct FaceUse {
    pub(crate) source: Source,
    pub(crate) reversed: bool,
    pub(crate) uv: UvCurve,
}

impl From<Overrun> for &'static str {
    fn from(_: Overrun) -> Self {
        "the work budget of the face is used up"
    }
}

impl From<Overrun> for String {
    fn from(overrun: Overrun) -> Self {
        <&'static str>::from(overrun).into()
    }
}

/// Builds a face, mm: fits its edges in the chart's parameters, closes its loops to a bounded region, with seams where they wind, and
/// cuts the spline over it. A sphere may be turned first. Fails with a reason in words where edges lie off the surface, loops bound no
/// region (nothing, too many turns, holes that leave no seam), or the work budget is used up.
pub(crate) fn build_face(mut task: FaceTask<'_>) -> Result<BuiltFace, String> {
    // Edges in the parameters of the chart.
    task.turn_sphere();
    let task = task;
    let chart = &task.chart;
    let mut fits = task.fit_edges()?;
    task.keep_to_sheets(&mut fits)?;
    let mut gap = fits.values().fold(0f64, |g, f| g.max(f.gap));
    if !(gap <= LARGEST_GAP_SHARE * task.extent()) {
        return Err("its edges were not found on its surface".into());
    }
    let mut repairs: Vec<String> = Vec::new();
    if chart.error > offset::TOLERANCE {
        repairs.push(format!("its offset surface is fitted to {:.1e} mm", chart.error));
    }

    // Loops in the unwrapped plane, then the boundary of a region without periods.
    let tolerance = task.accuracy.max(2.0 * gap).max(SMALLEST_ACCURACY);
    let same_sense = task.same_sense != chart.flipped;
    let (chains, same_sense) = chain_in_sense(&task, &fits, same_sense, tolerance);
    let bridged = bridged_step(&chains);
    let Boundary { mut loops, mut seams, repairs: turned } = bound_chains(&task, chains, bridged.as_deref())?;
    repairs.extend(bridged);
    repairs.extend(turned.into_iter().map(String::from));
    let (domain, shift) = domain_of(&loops, chart)?;
    loops.iter_mut().for_each(|l| l.shift(shift));
    seams.iter_mut().flatten().for_each(|p| *p += shift);

    // The spline over the region, and every use in its parameters.
    let region = Region::new(&task, domain);
    let mut seams = Seams::new(&region, seams);
    let mut built = Vec::with_capacity(loops.len());
    for chain in loops {
        let mut uses = Vec::with_capacity(chain.pieces.len());
        for piece in chain.pieces {
            let (source, reversed) = (piece.source, piece.reversed != seams.is_turned(piece.source));
            let uv = match source {
                Source::Nothing => region.line(&piece),
                Source::Seam(k) => {
                    let fit = seams.uv(k, &piece)?;
                    gap = gap.max(fit.gap);
                    fit.curve
                }
                // The spline has the chart's parameters.
                Source::Edge(_) if chart.angular_directions() == [false, false] => piece.curve,
                Source::Edge(edge) => {
                    let fit = region.refit(&piece, task.edges[&edge])?;
                    gap = gap.max(fit.gap);
                    fit.curve
                }
            };
            uses.push(FaceUse { source, reversed, uv });
        }
        gap = gap.max(join_ends(&mut uses, &region.surface));
        built.push(uses);
    }
    let seams = seams.finish();
    let fitted = matches!(chart.analytic, Analytic::Offset);
    Ok(BuiltFace {
        analytic: chart.analytic,
        reversed: !same_sense,
        seams,
        gap,
        repairs,
        surface: if fitted { part_around(&region.surface, &built) } else { region.surface },
        loops: built,
    })
}

/// Returns the spans of a surface that hold the loops, and one more on each side, so that no trim comes to run along an end that the
/// surface did not have: a fit has more spans than its face needs.
fn part_around(surface: &Surface, loops: &[Vec<FaceUse>]) -> Surface {
    let points = loops.iter().flatten().flat_map(|u| u.uv.points.iter().map(|p| p.position()));
    let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let kept = [0, 1].map(|d: usize| {
        let breaks = surface.breakpoints(d);
        let first = breaks.partition_point(|&t| t <= lo[d]).saturating_sub(2);
        let last = (breaks.partition_point(|&t| t < hi[d]) + 1).min(breaks.len() - 1);
        [breaks[first.min(last - 1)], breaks[last]]
    });
    surface.restricted(kept)
}

/// Returns the loops with the material on their left in the chart's plane, each closed up to whole periods. `tolerance` is the distance,
/// mm, within which ends are one.
fn chain_loops(task: &FaceTask<'_>, fits: &FxHashMap<usize, Fit>, same_sense: bool, tolerance: f64) -> Vec<Chain> {
    let piece = |&(edge, reversed): &(usize, bool)| Piece {
        source: Source::Edge(edge),
        reversed,
        curve: fits[&edge].curve.clone(),
        accuracy: task.edges[&edge].accuracy.max(2.0 * fits[&edge].gap).max(SMALLEST_ACCURACY),
    };
    let mut chains = Vec::with_capacity(task.loops.len());
    for uses in &task.loops {
        let mut pieces: Vec<Piece> = uses.iter().map(piece).collect();
        // Against the surface's normal, what was on the left is on the right.
        if !same_sense {
            pieces.reverse();
            pieces.iter_mut().for_each(|p| p.reversed = !p.reversed);
        }
        chains.push(close_loop(pieces, &task.chart, tolerance));
    }
    chains
}

/// Chains the edges to loops, and returns whether the face has the normal of its surface: where the chart has two, not always as stated.
fn chain_in_sense(
    task: &FaceTask<'_>,
    fits: &FxHashMap<usize, Fit>,
    same_sense: bool,
    tolerance: f64,
) -> (Vec<Chain>, bool) {
    let chains = chain_loops(task, fits, same_sense, tolerance);
    if !task.chart.has_two_normals {
        return (chains, same_sense);
    }
    let turned = chain_loops(task, fits, !same_sense, tolerance);
    let misfits = |chains: &[Chain]| chains.iter().any(|c| c.is_winding() || c.is_against_sense);
    // Of two normals the one is meant about which the outer loop has the face on its left; about the other one a loop through a pole
    // goes around the rest of the surface, if it closes at all.
    if misfits(&chains) && !misfits(&turned) || runs_clockwise(&chains) {
        (turned, !same_sense)
    } else {
        (chains, same_sense)
    }
}

/// Tells of the largest step between edges of loops that had to be bridged; `None` where all meet.
fn bridged_step(chains: &[Chain]) -> Option<String> {
    let bridged = chains.iter().fold(0f64, |b, c| b.max(c.bridged));
    (bridged > 0.0).then(|| format!("edges of a loop are {} mm apart", figures(bridged, 3)))
}

/// Arranges the chains of a face by [`bound_region`]; where they bound nothing, a step between their edges may be why, and is reported too.
fn bound_chains(task: &FaceTask<'_>, chains: Vec<Chain>, step: Option<&str>) -> Result<Boundary, String> {
    bound_region(chains, &task.chart, task.implicit_outer, &task.budget).map_err(|reason| match step {
        Some(step) => format!("{reason}; {step}"),
        None => reason.into(),
    })
}

/// Whether the largest of loops that do not wind around the surface runs clockwise; false where one winds, and where the lobes of the
/// largest cancel.
fn runs_clockwise(chains: &[Chain]) -> bool {
    if chains.iter().any(Chain::is_winding) {
        return false;
    }
    let areas = chains.iter().map(|chain| {
        let polygon = chain.polygon();
        cancelling_lobes(chain, &polygon).unwrap_or_else(|| signed_area(&polygon))
    });
    areas.max_by(|a, b| a.abs().total_cmp(&b.abs())).is_some_and(|area| area < 0.0)
}

/// Returns the rectangle of all loops, moved into the base period, and the shift by whole periods that takes the loops there. Fails with a
/// reason in words where it is empty, infinite or winds too often.
fn domain_of(loops: &[Chain], chart: &Chart) -> Result<([[f64; 2]; 2], Uv), &'static str> {
    let points = loops.iter().flat_map(|l| &l.pieces).flat_map(|p| p.curve.points.iter().map(|q| q.position()));
    let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    if !(lo.is_finite() && hi.is_finite()) {
        return Err("its loops have no places in the parameters of its surface");
    }
    let mut domain = [[0.0; 2]; 2];
    let mut shift = Uv::ZERO;
    for d in 0..2 {
        let mut a = lo[d];
        let mut b = hi[d];
        let natural = chart.range[d];
        match chart.period[d] {
            Some(period) => {
                let turns = if chart.poles.is_empty() { MAX_THREAD_TURNS } else { MAX_TURNS };
                if !(b - a <= turns * period) {
                    return Err("its loops wind too often around its surface");
                }
                let base = if natural[0].is_finite() { natural[0] } else { 0.0 };
                // By whole periods, so that the region begins in the base period.
                shift[d] = -((a - base) / period + WHOLE_PERIOD_SLACK).floor() * period;
                a += shift[d];
                b += shift[d];
                // A loop that ends on the seam up to rounding ends on it.
                let near = SEAM_SLACK * period;
                if natural[0].is_finite() && a > natural[0] - near && b < natural[1] + near {
                    [a, b] = natural;
                }
            }
            None => {
                a = a.clamp(natural[0], natural[1]);
                b = b.clamp(natural[0], natural[1]);
                // Where the spline has the chart's own parameters it is kept whole.
                if natural.iter().all(|x| x.is_finite()) && !chart.angular_directions()[d] {
                    [a, b] = natural;
                }
            }
        }
        if !(b - a > EMPTY_RANGE * (1.0 + a.abs().max(b.abs()))) {
            return Err("its loops enclose nothing");
        }
        domain[d] = [a, b];
    }
    Ok((domain, shift))
}

/// Moves ends of uv curves so that each use begins exactly where the one before ends; returns the largest move, mm.
fn join_ends(uses: &mut [FaceUse], surface: &Surface) -> f64 {
    let mut moved = 0f64;
    let n = uses.len();
    let end_index = |u: &FaceUse, end: bool| if end != u.reversed { u.uv.points.len() - 1 } else { 0 };
    for i in 0..n {
        let j = (i + 1) % n;
        let (a, b) = (end_index(&uses[i], true), end_index(&uses[j], false));
        let (p, q) = (uses[i].uv.points[a].position(), uses[j].uv.points[b].position());
        // Steps follow their neighbours, neighbours meet half way.
        let to = match (uses[i].source, uses[j].source) {
            (Source::Nothing, Source::Nothing) => p,
            (Source::Nothing, _) => q,
            (_, Source::Nothing) => p,
            _ => 0.5 * (p + q),
        };
        for (k, at) in [(i, a), (j, b)] {
            let from = uses[k].uv.points[at].position();
            if from != to {
                moved = moved.max((surface.evaluate(from) - surface.evaluate(to)).length());
            }
            let w = uses[k].uv.points[at].z;
            uses[k].uv.points[at] = (to * w).extend(w);
        }
    }
    moved
}

/// Returns the loops as the model has them; `id` gives the edge of a source, `None` for sides without one.
pub(crate) fn trim_loops(loops: Vec<Vec<FaceUse>>, id: impl Fn(Source) -> Option<EdgeId>) -> Vec<TrimLoop> {
    let numbered = |u: FaceUse| EdgeUse { edge: id(u.source), reversed: u.reversed, uv: u.uv };
    loops.into_iter().map(|l| TrimLoop { uses: l.into_iter().map(numbered).collect() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An eight of two triangles of 25 with a corner off by 1e-8 either way, and beside it a square of 9 that runs clockwise.
    #[test]
    fn an_eight_whose_lobes_cancel_runs_neither_way() {
        let chain = |corners: &[[f64; 2]]| {
            let next = |k: usize| corners[(k + 1) % corners.len()];
            Chain::closed((0..corners.len()).map(|k| Piece::straight(corners[k].into(), next(k).into())).collect())
        };
        let square = chain(&[[0.0, 0.0], [0.0, 3.0], [3.0, 3.0], [3.0, 0.0]]);
        assert!(runs_clockwise(std::slice::from_ref(&square)));
        for off in [-1e-8, 1e-8] {
            let eight = chain(&[[0.0, 0.0], [10.0 + off, 10.0], [0.0, 10.0], [10.0, 0.0]]);
            assert!(!runs_clockwise(std::slice::from_ref(&eight)), "{off}");
            assert!(!runs_clockwise(&[eight, square.clone()]), "{off}");
        }
    }
}

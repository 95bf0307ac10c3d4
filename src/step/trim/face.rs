//! One face: chart, loops in its plane, spline, and edges' uv curves.

use super::boundary::{Boundary, bound_region};
use super::fit::{Budget, Fit, Overrun, Target, project};
use super::loops::{Chain, Piece, Source, close_loop};
use super::seams::{Seam, Seams};
use crate::math::{Uv, Vector};
use crate::model::{Analytic, EdgeUse, TrimLoop};
use crate::nurbs::{ControlPoint, Curve, Surface};
use crate::step::chart::offset;
use crate::step::chart::{Chart, Kind, Pole};
use rustc_hash::FxHashMap;

/// Most periods that a face may span.
const MAX_TURNS: f64 = 4.0;

/// What a face needs to know of an edge.
pub(crate) struct EdgeShape<'e> {
    pub(crate) curve: &'e Curve,
}

/// A face to be built.
pub(crate) struct FaceTask<'e> {
    pub(crate) chart: Chart,
    /// Whether the face's normal is `Su × Sv`.
    pub(crate) same_sense: bool,
    /// Loops as the file runs them: edge and whether it is run against its parameter.
    pub(crate) loops: Vec<Vec<(usize, bool)>>,
    pub(crate) edges: FxHashMap<usize, EdgeShape<'e>>,
    /// Allowed error of uv curves, mm.
    pub(crate) tolerance: f64,
    /// Distance below which points of the file are the same, mm.
    pub(crate) accuracy: f64,
    /// Evaluations that the face may take.
    pub(crate) budget: u64,
    /// Whether the natural border of the surface is the outer loop.
    pub(crate) implicit_outer: bool,
}

/// A built face; seams are numbered from 0, edges as in the task.
pub(crate) struct BuiltFace {
    pub(crate) surface: Surface,
    pub(crate) analytic: Analytic,
    pub(crate) reversed: bool,
    pub(crate) loops: Vec<Vec<FaceUse>>,
    pub(crate) seams: Vec<Seam>,
    pub(crate) gap: f64,
    pub(crate) repairs: Vec<String>,
}

/// An edge use whose edge is not numbered yet.
pub(crate) struct FaceUse {
    pub(crate) source: Source,
    pub(crate) reversed: bool,
    pub(crate) uv: crate::nurbs::UvCurve,
}

impl FaceUse {
    /// The use with its edge's number.
    pub(crate) fn numbered(self, id: impl Fn(Source) -> Option<crate::model::EdgeId>) -> EdgeUse {
        EdgeUse { edge: id(self.source), reversed: self.reversed, uv: self.uv }
    }
}

impl From<Overrun> for &'static str {
    fn from(_: Overrun) -> Self {
        "the work budget of the face is used up"
    }
}

/// Builds a face, or says why not.
pub(crate) fn build_face(mut task: FaceTask<'_>) -> Result<BuiltFace, &'static str> {
    let budget = Budget::new(task.budget);
    turn_sphere(&mut task);
    let chart = &task.chart;
    let same_sense = task.same_sense != chart.flipped;
    let mut fits: FxHashMap<usize, Fit> = FxHashMap::default();
    for &(edge, _) in task.loops.iter().flatten() {
        if let std::collections::hash_map::Entry::Vacant(slot) = fits.entry(edge) {
            slot.insert(fit_edge(chart, task.edges[&edge].curve, &task, &budget)?);
        }
    }
    let mut gap = fits.values().fold(0f64, |g, f| g.max(f.gap));
    if !(gap <= 0.2 * chart_extent(&task)) {
        return Err("its edges do not lie on its surface");
    }
    let tolerance = task.accuracy.max(2.0 * gap).max(1e-6);
    let mut repairs: Vec<String> = Vec::new();
    if chart.error > offset::TOLERANCE {
        repairs.push(format!("its offset surface is fitted to {:.1e} mm", chart.error));
    }
    let chains: Vec<Chain> = task
        .loops
        .iter()
        .map(|uses| {
            let mut pieces: Vec<Piece> = uses
                .iter()
                .map(|&(edge, reversed)| Piece {
                    source: Source::Edge(edge),
                    reversed,
                    curve: fits[&edge].curve.clone(),
                })
                .collect();
            if !same_sense {
                pieces.reverse();
                pieces.iter_mut().for_each(|p| p.reversed = !p.reversed);
            }
            close_loop(pieces, chart, tolerance)
        })
        .collect();
    let bridged = chains.iter().fold(0f64, |b, c| b.max(c.bridged));
    if bridged > 0.0 {
        repairs.push(format!("edges of a loop are {bridged:.3e} mm apart"));
    }
    let Boundary { mut loops, seams, repairs: turned } = bound_region(chains, chart, task.implicit_outer)?;
    repairs.extend(turned.into_iter().map(String::from));
    let (domain, shift) = domain_of(&loops, chart).ok_or("its loops enclose nothing")?;
    loops.iter_mut().for_each(|l| l.shift(shift));
    let surface = chart.surface(domain);
    let mut seams = Seams::new(&surface, chart, domain, seams.into_iter().map(|s| s.map(|p| p + shift)).collect());
    let mut built = Vec::with_capacity(loops.len());
    for chain in loops {
        let mut uses = Vec::with_capacity(chain.pieces.len());
        for piece in chain.pieces {
            let uv = match piece.source {
                Source::Nothing => mapped_line(chart, domain, &piece),
                Source::Seam(k) => seams.uv(k, &piece, &task, &budget)?,
                Source::Edge(edge) if chart.angular_directions() == [false, false] => {
                    let _ = edge;
                    piece.curve
                }
                Source::Edge(edge) => {
                    let fit = refit(chart, &surface, domain, &piece, task.edges[&edge].curve, &task, &budget)?;
                    gap = gap.max(fit.gap);
                    fit.curve
                }
            };
            uses.push(FaceUse {
                source: piece.source,
                reversed: piece.reversed != seams.is_turned(piece.source),
                uv,
            });
        }
        gap = gap.max(snap(&mut uses, &surface));
        built.push(uses);
    }
    Ok(BuiltFace {
        analytic: chart.analytic,
        reversed: !same_sense,
        loops: built,
        seams: seams.finish(),
        gap,
        repairs,
        surface,
    })
}

/// Size of the face by its edges, or of its surface.
fn chart_extent(task: &FaceTask<'_>) -> f64 {
    let edges = task.edges.values().map(|e| e.curve.bounds());
    let all = edges.reduce(|a, b| a.union(b));
    all.map_or(task.chart.size, |b| b.diagonal()).max(1e-6)
}

/// Turns the poles of a sphere away from the edges, unless the file cut it open itself.
fn turn_sphere(task: &mut FaceTask<'_>) {
    let Kind::Torus { frame, major: 0.0, minor } = task.chart.kind else { return };
    let mut count: FxHashMap<usize, usize> = FxHashMap::default();
    for &(edge, _) in task.loops.iter().flatten() {
        *count.entry(edge).or_default() += 1;
    }
    if count.is_empty() || count.values().any(|&n| n > 1) {
        return;
    }
    let mut directions: Vec<Vector> = Vec::new();
    for edge in task.edges.values() {
        let [a, b] = edge.curve.domain();
        let samples = (0..=32).map(|i| edge.curve.evaluate(a + (b - a) * f64::from(i) / 32.0));
        directions.extend(samples.filter_map(|p| (p - frame.origin).try_normalize()));
    }
    let clearance = |axis: Vector| directions.iter().map(|d| 1.0 - d.dot(axis).abs()).fold(1.0, f64::min);
    let own = clearance(frame.z);
    if own > 2e-3 {
        return;
    }
    let _ = minor;
    let middle = directions.iter().sum::<Vector>().try_normalize().unwrap_or(frame.x);
    let mut best = (own, frame.z);
    for i in -1..=1 {
        for j in -1..=1 {
            for k in -1..=1 {
                let axis = f64::from(i) * frame.x + f64::from(j) * frame.y + f64::from(k) * frame.z;
                let Some(axis) = axis.try_normalize() else { continue };
                // Poles far from the edges, and rather outside the patch.
                let score = clearance(axis);
                if score > best.0 + 1e-9 {
                    best = (score, axis);
                }
            }
        }
    }
    if let Some(turned) = task.chart.with_axis(best.1, middle) {
        task.chart = turned;
    }
}

/// The edge in the chart's own parameters.
fn fit_edge(chart: &Chart, curve: &Curve, task: &FaceTask<'_>, budget: &Budget) -> Result<Fit, Overrun> {
    if let Kind::Plane { frame } = &chart.kind {
        return Ok(project(curve, |p| {
            let q = frame.local_point(p);
            (Uv::new(q.x, q.y), q.z)
        }));
    }
    let target = Target {
        locate: &|_, p, hint| chart.locate(p, hint),
        derivatives: &|uv| chart.derivatives(uv),
        poles: &chart.poles,
        range: [0, 1]
            .map(|d| if chart.period[d].is_some() { [f64::NEG_INFINITY, f64::INFINITY] } else { chart.range[d] }),
        pole_tolerance: task.accuracy,
        tolerance: task.tolerance,
        budget,
    };
    let mut fit = target.fit(curve)?;
    // Cubics between points of the border may swing over it.
    for p in &mut fit.curve.points {
        for d in 0..2 {
            if chart.period[d].is_none() {
                // Farther out lie the control points of curves that touch the border, which themselves stay inside.
                let [a, b] = chart.range[d];
                let inside = p[d].clamp(a, b);
                if (p[d] - inside).abs() <= 1e-6 * (b - a) {
                    p[d] = inside;
                }
            }
        }
    }
    Ok(fit)
}

/// The edge in the spline's parameters, following the piece in the chart's.
pub(crate) fn refit(
    chart: &Chart,
    surface: &Surface,
    domain: [[f64; 2]; 2],
    piece: &Piece,
    curve: &Curve,
    task: &FaceTask<'_>,
    budget: &Budget,
) -> Result<Fit, Overrun> {
    let poles: Vec<Pole> = chart
        .poles
        .iter()
        .map(|p| {
            let mut native = Uv::new(domain[0][0], domain[1][0]);
            native[p.fixed] = p.at.clamp(domain[p.fixed][0], domain[p.fixed][1]);
            Pole { at: chart.to_surface(domain, native)[p.fixed], ..*p }
        })
        .collect();
    let target = Target {
        locate: &|t, p, _| chart.to_surface(domain, chart.locate(p, Some(piece.curve.evaluate(t)))),
        derivatives: &|uv| surface.derivatives(uv),
        poles: &poles,
        range: surface.domain(),
        pole_tolerance: task.accuracy,
        tolerance: task.tolerance,
        budget,
    };
    target.fit(curve)
}

/// A straight step in the spline's parameters.
fn mapped_line(chart: &Chart, domain: [[f64; 2]; 2], piece: &Piece) -> crate::nurbs::UvCurve {
    let n = piece.curve.points.len() - 1;
    let [a, b] = [0, n].map(|i| chart.to_surface(domain, piece.curve.points[i].position()));
    crate::nurbs::UvCurve::line(a, b, piece.curve.domain())
}

/// The rectangle of all loops, and the shift by whole periods that moves it into the base period.
fn domain_of(loops: &[Chain], chart: &Chart) -> Option<([[f64; 2]; 2], Uv)> {
    let points = loops.iter().flat_map(|l| &l.pieces).flat_map(|p| p.curve.points.iter().map(|q| q.position()));
    let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    if !(lo.is_finite() && hi.is_finite()) {
        return None;
    }
    let mut domain = [[0.0; 2]; 2];
    let mut shift = Uv::ZERO;
    for d in 0..2 {
        let (mut a, mut b) = (lo[d], hi[d]);
        let natural = chart.range[d];
        match chart.period[d] {
            Some(period) => {
                // Not even a loop on a seam comes near; slopes beside a pole that no longer mean anything do.
                if !(b - a <= MAX_TURNS * period) {
                    return None;
                }
                let base = if natural[0].is_finite() { natural[0] } else { 0.0 };
                shift[d] = -((a - base) / period + 1e-6).floor() * period;
                a += shift[d];
                b += shift[d];
                // A loop that ends on the seam up to rounding ends on it.
                let near = 1e-9 * period;
                if natural[0].is_finite() && a > natural[0] - near && b < natural[1] + near {
                    [a, b] = natural;
                }
            }
            None => {
                a = a.clamp(natural[0], natural[1]);
                b = b.clamp(natural[0], natural[1]);
                if natural.iter().all(|x| x.is_finite()) && !chart.angular_directions()[d] {
                    [a, b] = natural;
                }
            }
        }
        if !(b - a > 1e-12 * (1.0 + a.abs().max(b.abs()))) {
            return None;
        }
        domain[d] = [a, b];
    }
    Some((domain, shift))
}

/// Lets each use begin exactly where the one before ends; the largest move of an end, mm.
fn snap(uses: &mut [FaceUse], surface: &Surface) -> f64 {
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

/// Loops of numbered uses.
pub(crate) fn trim_loops(
    loops: Vec<Vec<FaceUse>>,
    id: impl Fn(Source) -> Option<crate::model::EdgeId>,
) -> Vec<TrimLoop> {
    loops.into_iter().map(|l| TrimLoop { uses: l.into_iter().map(|u| u.numbered(&id)).collect() }).collect()
}

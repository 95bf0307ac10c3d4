//! Samples that edges of faces in contact must have: those of each other where they run together, and where a guest's border crosses the
//! carrier's seam.

use super::trimmed::TrimmedFace;
use crate::math::{Point, Uv};
use crate::model::EdgeId;
use crate::tessellate::border::edges::Division;
use rustc_hash::FxHashMap;

/// Halvings that find where a border crosses a seam: to the spacing of numbers.
const CROSSING_HALVINGS: usize = 52;
/// Share of the domain within which a place is on the seam.
const ON_SEAM: f64 = 1e-7;

/// Further parameters of edges, by instance.
pub(super) type FurtherSamples = FxHashMap<usize, Vec<Vec<f64>>>;

/// One face's edges with what is asked of them so far.
pub(super) struct EdgeSamples<'f, 'm> {
    pub(super) face: &'f TrimmedFace<'m>,
    pub(super) divisions: &'f [Division],
}

impl EdgeSamples<'_, '_> {
    /// All parameters of an edge so far, ascending.
    fn parameters(&self, edge: EdgeId, further: &FurtherSamples) -> Vec<f64> {
        let mut t = self.divisions[edge.0 as usize].t.clone();
        t.extend(further.get(&self.face.key.instance).map_or(&[][..], |f| &f[edge.0 as usize]));
        t.sort_by(f64::total_cmp);
        t
    }

    fn place(&self, edge: EdgeId, t: f64) -> Point {
        self.face.frame.point(self.face.part.edges[edge.0 as usize].curve.evaluate(t))
    }

    /// Asks for a parameter unless a sample is within `glue` of it.
    fn ask(&self, edge: EdgeId, t: f64, glue: f64, further: &mut FurtherSamples) {
        let p = self.place(edge, t);
        let known = self.parameters(edge, further);
        if known.iter().all(|&s| (self.place(edge, s) - p).length() > glue) {
            let all = further
                .entry(self.face.key.instance)
                .or_insert_with(|| vec![Vec::new(); self.face.part.edges.len()]);
            all[edge.0 as usize].push(t);
        }
    }

    /// Asks for the samples of another face's edges that lie on this one's.
    pub(super) fn take_over(&self, other: &EdgeSamples<'_, '_>, glue: f64, further: &mut FurtherSamples) {
        for theirs in other.face.edges() {
            let places: Vec<Point> =
                other.parameters(theirs, further).into_iter().map(|t| other.place(theirs, t)).collect();
            // Every edge of either: two faces may touch along edges that are divided quite differently.
            for ours in self.face.edges() {
                for &p in &places {
                    let (t, away) = self.face.nearest_on_edge(ours, p);
                    if away <= glue {
                        self.ask(ours, t, glue, further);
                    }
                }
            }
        }
    }

    /// Asks for samples where edges of this face cross the seam of its carrier.
    pub(super) fn cross_seams(&self, carrier: &TrimmedFace<'_>, glue: f64, further: &mut FurtherSamples) {
        for edge in self.face.edges() {
            let t = self.parameters(edge, further);
            for pair in t.windows(2) {
                for d in (0..2).filter(|&d| carrier.surface.closed[d]) {
                    let at = |t: f64| carrier.project(self.place(edge, t)).0;
                    if let Some(crossing) = crossing(carrier, d, [pair[0], pair[1]], at) {
                        self.ask(edge, crossing, glue, further);
                    }
                }
            }
        }
    }
}

/// Where between two parameters a curve on the carrier crosses its seam in direction `d`; `at` gives the carrier's parameters.
pub(super) fn crossing(
    carrier: &TrimmedFace<'_>,
    d: usize,
    [mut lo, mut hi]: [f64; 2],
    at: impl Fn(f64) -> Uv,
) -> Option<f64> {
    let [a, b] = carrier.surface.spline.domain()[d];
    let share = |t: f64| (at(t)[d] - a) / (b - a);
    let (from, to) = (share(lo), share(hi));
    // Across a seam the share of the period jumps by nearly one; a point on it may count on either side.
    let on_seam = |x: f64| x.min(1.0 - x) <= ON_SEAM;
    // A jump of less than half a period is the curve's own way.
    if on_seam(from) || on_seam(to) || (from - to).abs() <= 0.5 {
        return None;
    }
    for _ in 0..CROSSING_HALVINGS {
        let m = 0.5 * (lo + hi);
        if (share(m) > 0.5) == (from > 0.5) { lo = m } else { hi = m }
    }
    Some(0.5 * (lo + hi))
}

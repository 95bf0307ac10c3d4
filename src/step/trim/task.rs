//! A face to be built, and its edges in the parameters of its chart.

use super::fit::{Budget, Fit, Overrun, Target, project_to_plane};
use super::tolerances::{BORDER_SLACK, POLE_CLEARANCE, SCORE_NOISE, SMALLEST_EXTENT};
use crate::math::{Uv, Vector};
use crate::nurbs::Curve;
use crate::step::chart::{Chart, Kind};
use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;

/// An edge of a face to be built.
#[derive(Clone, Copy)]
pub(crate) struct TaskEdge<'e> {
    /// In space, mm.
    pub(crate) curve: &'e Curve,
    /// Distance within which its ends are those of its neighbours, or a pole, mm.
    pub(crate) accuracy: f64,
}

/// A face to be built.
pub(crate) struct FaceTask<'e> {
    pub(crate) chart: Chart,
    /// Whether the face's normal is `Su × Sv`.
    pub(crate) same_sense: bool,
    /// Loops as the file runs them: edge and whether it is run against its parameter.
    pub(crate) loops: Vec<Vec<(usize, bool)>>,
    /// By the numbers of the loops.
    pub(crate) edges: FxHashMap<usize, TaskEdge<'e>>,
    /// Allowed error of uv curves, mm.
    pub(crate) tolerance: f64,
    /// Distance below which points of the file are the same, mm: the largest of its edges, or more.
    pub(crate) accuracy: f64,
    /// Work that the face may take.
    pub(crate) budget: Budget,
    /// Whether the natural border of the surface is the outer loop, which the loops leave out.
    pub(crate) implicit_outer: bool,
}

impl FaceTask<'_> {
    /// Returns the diagonal of the box around its edges, or without any the size of its surface, mm; never below [`SMALLEST_EXTENT`].
    pub(super) fn extent(&self) -> f64 {
        let edges = self.edges.values().map(|edge| edge.curve.bounds());
        let all = edges.reduce(|a, b| a.union(b));
        all.map_or(self.chart.size, |b| b.diagonal()).max(SMALLEST_EXTENT)
    }

    /// Fits every edge of the loops, once, in the chart's own parameters; by number. Fails when the budget is used up.
    pub(super) fn fit_edges(&self) -> Result<FxHashMap<usize, Fit>, Overrun> {
        let mut fits: FxHashMap<usize, Fit> = FxHashMap::default();
        for &(edge, _) in self.loops.iter().flatten() {
            // An edge that is run twice, along a seam, is fitted once.
            if let Entry::Vacant(slot) = fits.entry(edge) {
                slot.insert(self.fit_edge(self.edges[&edge], None)?);
            }
        }
        Ok(fits)
    }

    /// Fits an edge in the chart's own parameters: exact on a plane, else within the tolerance, and put on the border where it swings just
    /// over it. `start` is where it is expected to begin, if known.
    pub(super) fn fit_edge(&self, edge: TaskEdge<'_>, start: Option<Uv>) -> Result<Fit, Overrun> {
        let chart = &self.chart;
        if let Kind::Plane { frame } = &chart.kind {
            return Ok(project_to_plane(edge.curve, |p| {
                let q = frame.local_point(p);
                (Uv::new(q.x, q.y), q.z)
            }));
        }
        let target = Target {
            locate: &|_, p, hint| chart.locate(p, hint),
            derivatives: &|uv| chart.derivatives(uv),
            poles: &chart.poles,
            range: [0, 1].map(|d| {
                if chart.period[d].is_some() { [f64::NEG_INFINITY, f64::INFINITY] } else { chart.range[d] }
            }),
            period: chart.period,
            pole_tolerance: edge.accuracy,
            tolerance: self.tolerance,
            budget: &self.budget,
        };
        let mut fit = target.fit(edge.curve, start)?;
        // Cubics between points of the border may swing over it.
        for p in &mut fit.curve.points {
            for d in 0..2 {
                if chart.period[d].is_none() {
                    // Farther out lie the control points of curves that touch the border, which themselves stay inside.
                    let [a, b] = chart.range[d];
                    let inside = p[d].clamp(a, b);
                    if (p[d] - inside).abs() <= BORDER_SLACK * (b - a) {
                        p[d] = inside;
                    }
                }
            }
        }
        Ok(fit)
    }

    /// Turns the axis of a sphere so that its poles are away from the edges, unless they are, or the file cut it open itself. Does nothing
    /// on other surfaces.
    pub(super) fn turn_sphere(&mut self) {
        // A sphere is a torus without a large radius.
        let Kind::Torus { frame, major: 0.0, .. } = self.chart.kind else { return };
        let mut count: FxHashMap<usize, usize> = FxHashMap::default();
        for &(edge, _) in self.loops.iter().flatten() {
            *count.entry(edge).or_default() += 1;
        }
        if count.is_empty() || count.values().any(|&n| n > 1) {
            // Run twice, an edge is a seam that the file has cut itself: the poles are where it wants them.
            return;
        }
        let mut directions: Vec<Vector> = Vec::new();
        for edge in self.edges.values() {
            let [a, b] = edge.curve.domain();
            let samples = (0..=32).map(|i| edge.curve.evaluate(a + (b - a) * f64::from(i) / 32.0));
            directions.extend(samples.filter_map(|p| (p - frame.origin).try_normalize()));
        }
        let clearance = |axis: Vector| directions.iter().map(|d| 1.0 - d.dot(axis).abs()).fold(1.0, f64::min);
        let own = clearance(frame.z);
        if own > POLE_CLEARANCE {
            return;
        }
        let middle = directions.iter().sum::<Vector>().try_normalize().unwrap_or(frame.x);
        let mut best = (own, frame.z);
        for i in -1..=1 {
            for j in -1..=1 {
                for k in -1..=1 {
                    let axis = f64::from(i) * frame.x + f64::from(j) * frame.y + f64::from(k) * frame.z;
                    let Some(axis) = axis.try_normalize() else { continue };
                    // Poles far from the edges, and rather outside the patch.
                    let score = clearance(axis);
                    if score > best.0 + SCORE_NOISE {
                        best = (score, axis);
                    }
                }
            }
        }
        if let Some(turned) = self.chart.with_axis(best.1, middle) {
            self.chart = turned;
        }
    }
}

//! The rectangle of a chart that a face covers, as a spline: how places in the chart become parameters of the spline.

use super::fit::{Fit, Overrun, Target};
use super::loops::Piece;
use super::task::{FaceTask, TaskEdge};
use crate::math::Uv;
use crate::nurbs::{ControlPoint, Surface, UvCurve};
use crate::step::chart::Pole;

/// A face under construction: its chart, the rectangle of it that the loops cover, and the spline over that rectangle.
pub(super) struct Region<'t, 'e> {
    pub(super) task: &'t FaceTask<'e>,
    pub(super) domain: [[f64; 2]; 2],
    pub(super) surface: Surface,
}

impl<'t, 'e> Region<'t, 'e> {
    /// Makes the spline over `domain`, a rectangle of the chart's parameters.
    pub(super) fn new(task: &'t FaceTask<'e>, domain: [[f64; 2]; 2]) -> Self {
        Self { task, domain, surface: task.chart.surface(domain) }
    }

    /// Returns the spline's parameters of a place in the chart; places beyond the domain are not clamped.
    pub(super) fn parameters(&self, uv: Uv) -> Uv {
        self.task.chart.spline_parameters(self.domain, uv)
    }

    /// Fits an edge in the spline's parameters, following `piece`, the same edge in the chart's; fails when the budget is used up.
    pub(super) fn refit(&self, piece: &Piece, edge: TaskEdge<'_>) -> Result<Fit, Overrun> {
        let chart = &self.task.chart;
        let pole_here = |pole: &Pole| {
            let mut native = Uv::new(self.domain[0][0], self.domain[1][0]);
            native[pole.fixed] = pole.parameter.clamp(self.domain[pole.fixed][0], self.domain[pole.fixed][1]);
            Pole { parameter: self.parameters(native)[pole.fixed], ..*pole }
        };
        let poles: Vec<Pole> = chart.poles.iter().map(pole_here).collect();
        let target = Target {
            locate: &|t, p, _| self.parameters(chart.locate(p, Some(piece.curve.evaluate(t)))),
            derivatives: &|uv| self.surface.derivatives(uv),
            poles: &poles,
            range: self.surface.domain(),
            // The piece in the chart's parameters says which period is meant.
            period: [None; 2],
            pole_tolerance: edge.accuracy,
            tolerance: self.task.tolerance,
            budget: &self.task.budget,
        };
        target.fit(edge.curve, None)
    }

    /// Returns the straight line between the ends of a piece, in the spline's parameters and over the piece's own.
    pub(super) fn line(&self, piece: &Piece) -> UvCurve {
        let last = piece.curve.points.len() - 1;
        let [a, b] = [0, last].map(|i| self.parameters(piece.curve.points[i].position()));
        UvCurve::line(a, b, piece.curve.domain())
    }
}

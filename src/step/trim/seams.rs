//! Seams that were added to a face: curves in space for straight lines in its parameter plane.

use super::fit::{Fit, Overrun};
use super::loops::{Piece, Source};
use super::region::Region;
use super::task::TaskEdge;
use super::tolerances::{ISOLINE_SLACK, SEAM_ERROR_MM};
use crate::math::{Point, Uv};
use crate::nurbs::{Curve, UvCurve, fit_cubic};

/// A seam in space.
#[derive(Clone, Debug)]
pub(crate) struct Seam {
    pub(crate) curve: Curve,
    /// Where it starts and ends, mm.
    pub(crate) ends: [Point; 2],
}

/// The seams of a face under construction.
pub(super) struct Seams<'r, 't, 'e> {
    region: &'r Region<'t, 'e>,
    curves: Vec<SeamCurve>,
}

/// A seam in space and how it goes with its line.
struct SeamCurve {
    curve: Curve,
    /// The parameter that varies, when the seam is an isoline.
    varies: Option<usize>,
    /// Whether the curve runs against the line it was made of.
    turned: bool,
    /// Largest distance of the curve from the surface over its line, mm, where it was fitted.
    error: f64,
}

impl<'r, 't, 'e> Seams<'r, 't, 'e> {
    /// Makes the seams in space, fitted now, of straight lines from end to end in the chart's parameters; seam `k` is that of `lines[k]`.
    pub(super) fn new(region: &'r Region<'t, 'e>, lines: Vec<[Uv; 2]>) -> Self {
        Self { region, curves: lines.into_iter().map(|line| seam_curve(region, line)).collect() }
    }

    /// Whether the curve of a source runs against the line it was made of; false for edges.
    pub(super) fn is_turned(&self, source: Source) -> bool {
        matches!(source, Source::Seam(k) if self.curves[k].turned)
    }

    /// Returns the uv curve of a use of seam `k`, over the seam's own parameter, and how far the seam is from the surface there; fails when
    /// the budget is used up.
    pub(super) fn uv(&mut self, k: usize, piece: &Piece) -> Result<Fit, Overrun> {
        let seam = &self.curves[k];
        let ends = [0, piece.curve.points.len() - 1].map(|i| piece.curve.points[i].truncate());
        let [a, b] = ends.map(|p| self.region.parameters(p));
        // An isoline has the spline's own parameter.
        if seam.varies.is_some() {
            let [a, b] = if seam.turned { [b, a] } else { [a, b] };
            return Ok(Fit { curve: UvCurve::line(a, b, seam.curve.domain()), gap: 0.0 });
        }
        // An oblique line stays a line only where the spline has the chart's parameters.
        if self.region.task.chart.angular_directions() == [false, false] {
            return Ok(Fit { curve: UvCurve::line(a, b, [0.0, 1.0]), gap: seam.error });
        }
        self.region.refit(piece, TaskEdge { curve: &seam.curve, accuracy: self.region.task.accuracy })
    }

    /// Hands over the seams in space, in the order of their numbers, with their ends.
    pub(super) fn finish(self) -> Vec<Seam> {
        self.curves
            .into_iter()
            .map(|m| {
                let [a, b] = m.curve.domain();
                Seam { ends: [m.curve.evaluate(a), m.curve.evaluate(b)], curve: m.curve }
            })
            .collect()
    }
}

/// Returns the curve of a seam in space: an isoline of the spline where it can be one, else a fitted cubic. `a` and `b` are in the chart's
/// parameters.
fn seam_curve(region: &Region<'_, '_>, [a, b]: [Uv; 2]) -> SeamCurve {
    let Region { task, domain, surface } = region;
    let p = region.parameters(a);
    let q = region.parameters(b);
    let extent = [0, 1].map(|d| (domain[d][1] - domain[d][0]).abs());
    // Along a parameter line the seam is a curve of the spline itself, and so exact.
    for fixed in 0..2 {
        if (p[fixed] - q[fixed]).abs() > ISOLINE_SLACK * extent[fixed] {
            continue;
        }
        let varies = 1 - fixed;
        let (lo, hi) = (p[varies].min(q[varies]), p[varies].max(q[varies]));
        let line = surface.isoline(fixed, p[fixed]);
        let [l0, l1] = line.domain();
        let (lo, hi) = (lo.clamp(l0, l1), hi.clamp(l0, l1));
        if hi - lo > ISOLINE_SLACK * extent[varies] {
            return SeamCurve {
                curve: line.restricted(lo, hi),
                varies: Some(varies),
                turned: p[varies] > q[varies],
                error: 0.0,
            };
        }
    }
    // Oblique: a cubic that follows the surface.
    let step = b - a;
    let at = |t: f64| {
        let d = task.chart.derivatives(a + step * t);
        (d.point, d.du * step.x + d.dv * step.y)
    };
    let (curve, error) = fit_cubic([0.0, 1.0], at, SEAM_ERROR_MM);
    SeamCurve { curve, varies: None, turned: false, error }
}

//! Seams that were added to a face: curves in space for straight lines in its parameter plane.

use super::face::{FaceTask, refit};
use super::fit::{Budget, Overrun};
use super::loops::{Piece, Source};
use crate::math::{Point, Uv};
use crate::nurbs::{Curve, Surface, UvCurve};
use crate::step::chart::Chart;
use crate::step::geometry::pcurves::fit_cubic;

/// A seam in space.
#[derive(Clone, Debug)]
pub(crate) struct Seam {
    pub(crate) curve: Curve,
    /// Where it starts and ends, mm.
    pub(crate) ends: [Point; 2],
}

/// The seams of a face under construction.
pub(crate) struct Seams<'s> {
    surface: &'s Surface,
    chart: &'s Chart,
    domain: [[f64; 2]; 2],
    made: Vec<SeamCurve>,
}

struct SeamCurve {
    curve: Curve,
    /// The parameter that varies, when the seam is an isoline.
    varies: Option<usize>,
    /// Whether the curve runs against the line it was made of.
    turned: bool,
}

impl<'s> Seams<'s> {
    pub(crate) fn new(surface: &'s Surface, chart: &'s Chart, domain: [[f64; 2]; 2], lines: Vec<[Uv; 2]>) -> Self {
        let made = lines.into_iter().map(|line| seam_curve(surface, chart, domain, line)).collect();
        Self { surface, chart, domain, made }
    }

    /// Whether the curve of a source runs against the line it was made of.
    pub(crate) fn is_turned(&self, source: Source) -> bool {
        matches!(source, Source::Seam(k) if self.made[k].turned)
    }

    /// The uv curve of a use of a seam, over the seam's own parameter.
    pub(crate) fn uv(
        &mut self,
        k: usize,
        piece: &Piece,
        task: &FaceTask<'_>,
        budget: &Budget,
    ) -> Result<UvCurve, Overrun> {
        let made = &self.made[k];
        let ends = [0, piece.curve.points.len() - 1].map(|i| piece.curve.points[i].truncate());
        let mapped = ends.map(|p| self.chart.to_surface(self.domain, p));
        match made.varies {
            Some(_) => {
                let [a, b] = if made.turned { [mapped[1], mapped[0]] } else { mapped };
                Ok(UvCurve::line(a, b, made.curve.domain()))
            }
            None if self.chart.angular_directions() == [false, false] => {
                Ok(UvCurve::line(mapped[0], mapped[1], [0.0, 1.0]))
            }
            None => {
                refit(self.chart, self.surface, self.domain, piece, &made.curve, task, budget).map(|fit| fit.curve)
            }
        }
    }

    pub(crate) fn finish(self) -> Vec<Seam> {
        self.made
            .into_iter()
            .map(|m| {
                let [a, b] = m.curve.domain();
                Seam { ends: [m.curve.evaluate(a), m.curve.evaluate(b)], curve: m.curve }
            })
            .collect()
    }
}

fn seam_curve(surface: &Surface, chart: &Chart, domain: [[f64; 2]; 2], [a, b]: [Uv; 2]) -> SeamCurve {
    let (p, q) = (chart.to_surface(domain, a), chart.to_surface(domain, b));
    let extent = [0, 1].map(|d| (domain[d][1] - domain[d][0]).abs());
    for fixed in 0..2 {
        if (p[fixed] - q[fixed]).abs() > 1e-9 * extent[fixed] {
            continue;
        }
        let varies = 1 - fixed;
        let (lo, hi) = (p[varies].min(q[varies]), p[varies].max(q[varies]));
        let line = surface.isoline(fixed, p[fixed]);
        let [l0, l1] = line.domain();
        let (lo, hi) = (lo.clamp(l0, l1), hi.clamp(l0, l1));
        if hi - lo > 1e-9 * extent[varies] {
            return SeamCurve {
                curve: line.restricted(lo, hi),
                varies: Some(varies),
                turned: p[varies] > q[varies],
            };
        }
    }
    // Oblique: a cubic that follows the surface to 1e-7 mm.
    let step = b - a;
    let at = |t: f64| {
        let d = chart.derivatives(a + step * t);
        (d.point, d.du * step.x + d.dv * step.y)
    };
    SeamCurve { curve: fit_cubic([0.0, 1.0], at, 1e-7).0, varies: None, turned: false }
}

//! Surfaces of the file as charts.

use super::curves::{explicit_knots, knot_form};
use super::extent::FaceExtent;
use super::tolerances::EQUAL_WEIGHTS;
use super::{GeometryReader, Outcome, Refusal};
use crate::math::Point;
use crate::model::Analytic;
use crate::nurbs::sanitise;
use crate::step::chart::{Chart, Kind, SplineChart, offset};
use crate::step::part21::{Args, Entity};

/// Deepest chain of surfaces that refer to surfaces.
pub(crate) const MAX_DEPTH: usize = 8;

/// Names of splines whose geometry the record or complex instance holds itself.
const SPLINES: [&str; 5] = [
    "B_SPLINE_SURFACE",
    "B_SPLINE_SURFACE_WITH_KNOTS",
    "BEZIER_SURFACE",
    "UNIFORM_SURFACE",
    "QUASI_UNIFORM_SURFACE",
];

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads a surface as a chart, mm and radians, of as much as a face of this extent needs; trims of the surface itself are passed over.
    /// Refuses kinds that are not supported, and chains of more than [`MAX_DEPTH`] references.
    pub(crate) fn chart(&self, id: u64, extent: FaceExtent<'_>, depth: usize) -> Outcome<Chart> {
        let e = self.entity(id)?;
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "surfaces refer to each other too deeply"));
        }
        if let Some(chart) = self.elementary_surface(e, extent) {
            return chart;
        }
        if let Some(a) = e.attributes("SURFACE_OF_REVOLUTION", 1) {
            return self.revolution(e, a, extent, depth);
        }
        if let Some(a) = e.attributes("SURFACE_OF_LINEAR_EXTRUSION", 1) {
            return self.extrusion(e, a, extent, depth);
        }
        if let Some(a) = e.attributes("CURVE_BOUNDED_SURFACE", 1) {
            let basis = self.resolve(e, a.id(0), "basis surface")?;
            return self.chart(basis.id, extent, depth + 1);
        }
        if let Some(a) = e.attributes("RECTANGULAR_TRIMMED_SURFACE", 1) {
            let basis = self.resolve(e, a.id(0), "basis surface")?;
            let range = |d: usize| [a.real(1 + 2 * d), a.real(2 + 2 * d)];
            let extent = extent.over_parameters([range(0), range(1)]);
            let mut chart = self.chart(basis.id, extent, depth + 1)?;
            // One parameter turned around turns the normal, which is ∂u × ∂v; both leave it (ISO 10303-42, usense and vsense).
            chart.flipped ^= a.flag(5).is_some_and(|u| a.flag(6) == Some(!u));
            return Ok(chart);
        }
        if let Some(a) = e.attributes("OFFSET_SURFACE", 1) {
            return self.offset_surface(e, a, extent, depth);
        }
        if e.is_one_of(&SPLINES) {
            return self.spline_surface(e);
        }
        Err(Refusal::new(e, "this kind of surface is not supported"))
    }

    /// Reads an OFFSET_SURFACE with attributes `a`; refused where the offset leaves nothing of its basis.
    fn offset_surface(
        &self,
        e: Entity<'f, 'a>,
        a: Args<'f, 'a>,
        extent: FaceExtent<'_>,
        depth: usize,
    ) -> Outcome<Chart> {
        let basis = self.resolve(e, a.id(0), "basis surface")?;
        let distance = a.real(1).map(|d| d * self.units.length).filter(|d| d.is_finite());
        let distance = distance.ok_or_else(|| Refusal::new(e, "its distance is missing"))?;
        let basis = self.chart(basis.id, extent.grown_by(distance.abs()), depth + 1)?;
        // Along the normal of the file's surface, which the chart's may oppose.
        let signed = if basis.flipped { -distance } else { distance };
        let along = offset::offset(&basis, signed);
        let chart = if basis.has_two_normals {
            let against = offset::offset(&basis, -signed).map(|c| Chart { flipped: !c.flipped, ..c });
            nearest_to(extent.points, [along, against])
        } else {
            along
        };
        chart.ok_or_else(|| Refusal::new(e, "the offset leaves nothing of its basis"))
    }

    /// Reads a B-spline surface in any of its forms; small faults of knots and weights are mended, others refused.
    fn spline_surface(&self, e: Entity<'f, 'a>) -> Outcome<Chart> {
        let base = e.attributes("B_SPLINE_SURFACE", 1).unwrap_or_else(|| e.args());
        let shift = usize::from(!e.keyword().is_empty() && e.keyword() != "B_SPLINE_SURFACE");
        let (Some(p), Some(q)) = (base.count(shift), base.count(shift + 1)) else {
            return Err(Refusal::new(e, "a degree is missing"));
        };
        let degree = [p, q];
        let rows = base.list(shift + 2);
        let nu = rows.len();
        let nv = rows.list(0).len();
        // Counts in a file are claims: no more is reserved than a usual surface needs.
        let mut points = Vec::with_capacity(nu.saturating_mul(nv).min(1 << 16));
        for i in 0..nu {
            let row = self.points(e, rows.list(i))?;
            if row.len() != nv {
                return Err(Refusal::new(e, "rows of control points differ in length"));
            }
            points.extend(row);
        }
        let weights = e.attributes("RATIONAL_B_SPLINE_SURFACE", 8).map(|a| {
            let rows = a.list(0);
            (0..rows.len()).map(|i| rows.list(i).reals()).collect::<Option<Vec<_>>>().map(|w| w.concat())
        });
        let weights = match weights {
            Some(None) => return Err(Refusal::new(e, "weights are no numbers")),
            Some(w) => w,
            None => None,
        };
        let form = knot_form(e, "SURFACE");
        let knots = match e.attributes("B_SPLINE_SURFACE_WITH_KNOTS", 8) {
            Some(a) => (explicit_knots(a.list(0), a.list(2)), explicit_knots(a.list(1), a.list(3))),
            None => (form.knots(degree[0], nu), form.knots(degree[1], nv)),
        };
        let (Some(ku), Some(kv)) = knots else {
            return Err(Refusal::new(e, "knots and multiplicities do not fit"));
        };
        // Equal weights divide out: such a surface is reported as a plain B-spline.
        let rational =
            weights.as_ref().is_some_and(|w| w.iter().any(|x| (x - w[0]).abs() > EQUAL_WEIGHTS * w[0].abs()));
        let (surface, _) = sanitise::surface(degree, [ku, kv], [nu, nv], &points, weights.as_deref())
            .map_err(|d| Refusal::new(e, d.to_string()))?;
        let analytic = if rational { Analytic::Rational } else { Analytic::Bspline };
        Ok(Chart::new(Kind::Spline(SplineChart::new(surface)), analytic))
    }
}

/// Returns that of two charts that lies nearer to the points of a face, the first of equal ones; the other where one is missing.
fn nearest_to(points: &[Point], charts: [Option<Chart>; 2]) -> Option<Chart> {
    let miss = |chart: &Chart| -> f64 {
        points.iter().map(|&p| chart.derivatives(chart.locate(p, None)).point.distance(p)).sum()
    };
    charts.into_iter().flatten().min_by(|a, b| miss(a).total_cmp(&miss(b)))
}

//! Offset surfaces: exact where the basis is analytic, otherwise a bicubic fitted to 1e-6 mm; of an extrusion only its profile is
//! fitted, since the offset is an extrusion too and has no end.
//!
//! The fit interpolates position, both first and the mixed derivative (a bicubic Hermite spline) on a grid over the basis' own domain
//! that is refined until the middles of all cells agree. At the knots of the basis it has derivatives of its own on each side. Known
//! weakness: an offset beyond a radius of curvature folds; it is fitted as it is.

use super::tolerances::{
    CLOSED_SHARE, DIFFERENCE_STEP, PARALLEL_DERIVATIVES, POLE_STEP, SIDE_SHARE, VANISHING_RATIO, WORST_FIT_MM,
};
use super::{Chart, Kind, SplineChart};
use crate::math::{Homogeneous, Point, Uv, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, Surface, fit_cubic};

/// Stated error of fitted offsets, mm.
pub(crate) const TOLERANCE: f64 = 1e-6;
/// Most cells in one direction.
const MAX_CELLS: usize = 256;

/// Returns the chart of the surface at `distance`, mm, along Su × Sv of `basis`. `None` where nothing is left of a radius, the basis
/// has no ends, or no fit within [`WORST_FIT_MM`] is found; the error of a fit is in the chart.
pub(crate) fn offset(basis: &Chart, distance: f64) -> Option<Chart> {
    let mut chart = match &basis.kind {
        // Elementary surfaces stay what they are, and exact.
        Kind::Plane { frame } => {
            let mut frame = *frame;
            frame.origin += distance * frame.z;
            Chart::new(Kind::Plane { frame }, Analytic::Plane { frame })
        }
        Kind::Cone { frame, radius, half_angle } => {
            let (mut frame, half_angle) = (*frame, *half_angle);
            // Seen across the axis a step along the tilted normal is longer by 1/cos: the moved slant line cuts the radius there.
            let mut radius = radius + distance / half_angle.cos();
            if !(radius > 0.0) {
                if half_angle == 0.0 || radius.is_nan() {
                    return None;
                }
                // The apex has passed the origin: what is left of the cone is counted from there.
                frame.origin -= radius / half_angle.tan() * frame.z;
                radius = 0.0;
            }
            let analytic = match half_angle {
                0.0 => Analytic::Cylinder { frame, radius },
                _ => Analytic::Cone { frame, radius, half_angle },
            };
            Chart::new(Kind::Cone { frame, radius, half_angle }, analytic)
        }
        Kind::Torus { frame, major, minor } => {
            let (frame, major, minor) = (*frame, *major, minor + distance);
            if !(minor > 0.0) {
                return None;
            }
            let analytic = match major {
                0.0 => Analytic::Sphere { frame, radius: minor },
                _ => Analytic::Torus { frame, major, minor },
            };
            Chart::new(Kind::Torus { frame, major, minor }, analytic)
        }
        Kind::Extrusion { base, direction } => {
            let (base, error) = offset_profile(base, *direction, distance)?;
            let kind = Kind::Extrusion { base, direction: *direction };
            Chart { error, ..Chart::new(kind, Analytic::Offset) }
        }
        // The offset of a spline is no spline in general: it is fitted.
        _ => {
            let domain = basis_domain(basis)?;
            let (surface, error) = fit_bicubic(&basis.surface(domain), distance)?;
            Chart { error, ..Chart::new(Kind::Spline(SplineChart::new(surface)), Analytic::Offset) }
        }
    };
    chart.flipped = basis.flipped;
    Some(chart)
}

/// Returns the profile of an extrusion moved along the normals of its surface, and the error of the fit, mm. `None` where it is torn at a
/// corner, has no normal, or the fit is worse than [`WORST_FIT_MM`].
fn offset_profile(base: &Curve, direction: Vector, distance: f64) -> Option<(Curve, f64)> {
    let mut whole: Option<Curve> = None;
    let mut worst = 0f64;
    for span in base.breakpoints().windows(2) {
        let piece = base.restricted(span[0], span[1]);
        let moved = |t: f64| {
            let d = piece.derivatives(t);
            // Where profile and direction are parallel there is no normal; what is no number fails the fit below.
            d.point + distance * d.first.cross(direction).try_normalize().unwrap_or(Vector::NAN)
        };
        // A central difference of the moved curve: its own derivative would need the curve's second one.
        let step = DIFFERENCE_STEP * (span[1] - span[0]);
        let jet = |t: f64| {
            let lo = (t - step).max(span[0]);
            let hi = (t + step).min(span[1]);
            (moved(t), (moved(hi) - moved(lo)) / (hi - lo))
        };
        let (fitted, error) = fit_cubic([span[0], span[1]], jet, TOLERANCE);
        if !(error <= WORST_FIT_MM) {
            return None;
        }
        worst = worst.max(error);
        whole = match whole {
            None => Some(fitted),
            Some(head) => {
                // At a corner of the profile the offsets of both sides part: no one curve joins them.
                let tear = (head.evaluate(span[0]) - fitted.evaluate(span[0])).length();
                if !(tear <= CLOSED_SHARE * head.bounds().diagonal() + TOLERANCE) {
                    return None;
                }
                Some(head.joined_with(&fitted))
            }
        };
    }
    Some((whole?, worst))
}

/// Returns the rectangle of parameters of a basis, one period where it has no ends; `None` where it is endless.
fn basis_domain(basis: &Chart) -> Option<[[f64; 2]; 2]> {
    let mut domain = basis.range;
    for d in 0..2 {
        // Angles have no ends but a period; that of a chart begins at zero.
        if let (Some(p), true) = (basis.period[d], domain[d][0].is_infinite()) {
            domain[d] = [0.0, p];
        }
    }
    domain.iter().flatten().all(|x| x.is_finite()).then_some(domain)
}

/// Position, first and mixed derivatives of the offset at one place.
#[derive(Clone, Copy)]
struct Jet {
    point: Point,
    du: Vector,
    dv: Vector,
    duv: Vector,
}

/// Returns the position and first derivatives of the offset, by the derivatives of the unit normal; `None` at a pole and where the
/// derivatives are parallel.
fn first_order(basis: &Surface, distance: f64, uv: Uv) -> Option<(Point, Vector, Vector)> {
    let s = basis.second_derivatives(uv);
    let n = s.du.cross(s.dv);
    // Weingarten: the unit normal's derivative is that of `n`, without its part along `n`, over its length.
    let length = n.length();
    // At a pole one derivative is what rounding left of it, in any direction.
    let [[u0, u1], [v0, v1]] = basis.domain();
    let across_u = s.du.length() * (u1 - u0);
    let across_v = s.dv.length() * (v1 - v0);
    let singular = across_u.min(across_v) <= VANISHING_RATIO * across_u.max(across_v);
    if singular || !(length > PARALLEL_DERIVATIVES * s.du.length() * s.dv.length()) {
        return None;
    }
    let unit = n / length;
    let turn = |d: Vector| (d - unit * unit.dot(d)) / length;
    let nu = turn(s.duu.cross(s.dv) + s.du.cross(s.duv));
    let nv = turn(s.duv.cross(s.dv) + s.du.cross(s.dvv));
    Some((s.point + distance * unit, s.du + distance * nu, s.dv + distance * nv))
}

/// Returns the jet at a grid point, its derivatives as they are on one side of the grid lines (−1, 1) or, where there is no corner, on them
/// (0). `None` where there is no normal.
fn jet(basis: &Surface, distance: f64, uv: Uv, sides: [f64; 2]) -> Option<Jet> {
    let domain = basis.domain();
    let extent = Uv::new(domain[0][1] - domain[0][0], domain[1][1] - domain[1][0]);
    let Some((point, ..)) = first_order(basis, distance, uv) else {
        return jet_at_pole(basis, distance, uv, sides, extent);
    };
    let at = uv + extent * Uv::from_array(sides) * SIDE_SHARE;
    let (_, du, dv) = first_order(basis, distance, at)?;
    // The mixed derivative by differences of du, without looking over the line.
    let step = DIFFERENCE_STEP * extent.y;
    let lo = if sides[1] > 0.0 { at.y } else { (at.y - step).max(domain[1][0]) };
    let hi = if sides[1] < 0.0 { at.y } else { (at.y + step).min(domain[1][1]) };
    let below = first_order(basis, distance, Uv::new(at.x, lo)).map_or(du, |d| d.1);
    let above = first_order(basis, distance, Uv::new(at.x, hi)).map_or(du, |d| d.1);
    Some(Jet { point, du, dv, duv: (above - below) / (hi - lo) })
}

/// Returns the jet at a collapsed row: the limit normal, and derivatives extrapolated linearly from two places inside. `extent` is the size
/// of the domain.
fn jet_at_pole(basis: &Surface, distance: f64, uv: Uv, sides: [f64; 2], extent: Uv) -> Option<Jet> {
    let domain = basis.domain();
    let s = basis.derivatives(uv);
    // Inside lies across the row, along which the surface stands still.
    let inward = if s.du.length() * extent.x < s.dv.length() * extent.y { 1 } else { 0 };
    let along = 1 - inward;
    let middle = 0.5 * (domain[inward][0] + domain[inward][1]);
    let step = POLE_STEP * extent[inward] * (middle - uv[inward]).signum();
    let mut place = uv;
    place[along] += SIDE_SHARE * extent[along] * sides[along];
    place[inward] += step;
    let (_, du1, dv1) = first_order(basis, distance, place)?;
    place[inward] += step;
    let (_, du2, dv2) = first_order(basis, distance, place)?;
    let mixed = if inward == 1 { du2 - du1 } else { dv2 - dv1 };
    Some(Jet {
        point: s.point + distance * basis.normal(uv)?,
        du: 2.0 * du1 - du2,
        dv: 2.0 * dv1 - dv2,
        duv: mixed / step,
    })
}

/// Grid lines in one direction, ascending, and which of them are knots of the basis, where the offset of a C¹ spline has a corner in its
/// derivatives.
struct GridLines {
    at: Vec<f64>,
    is_knot: Vec<bool>,
}

/// A row of control points: on or beside which line, how far off in the parameter, and on which side of a corner (−1, 1; 0 without one).
#[derive(Clone, Copy)]
struct ControlRow {
    line: usize,
    off: f64,
    side: f64,
}

impl GridLines {
    /// Makes grid lines at the knots `breaks` of the basis, with `per_span - 1` lines evenly between each two.
    fn new(breaks: &[f64], per_span: usize) -> Self {
        let mut lines = Self { at: Vec::new(), is_knot: Vec::new() };
        for w in breaks.windows(2) {
            for k in 0..per_span {
                lines.at.push(w[0] + (w[1] - w[0]) * k as f64 / per_span as f64);
                lines.is_knot.push(k == 0);
            }
        }
        lines.at.extend(breaks.last());
        lines.is_knot.push(true);
        lines
    }

    /// Returns the rows of control points: a third of the neighbouring cells off each line, and on the lines that may be corners.
    fn control_rows(&self) -> Vec<ControlRow> {
        let mut rows = Vec::with_capacity(3 * self.at.len());
        for (line, &x) in self.at.iter().enumerate() {
            let corner = self.is_knot[line];
            let side = f64::from(u8::from(corner));
            if line > 0 {
                rows.push(ControlRow { line, off: (self.at[line - 1] - x) / 3.0, side: -side });
            }
            if corner {
                // On the line itself; at the ends from inside.
                let side = if line == 0 { 1.0 } else { -1.0 };
                rows.push(ControlRow { line, off: 0.0, side });
            }
            if let Some(next) = self.at.get(line + 1) {
                rows.push(ControlRow { line, off: (next - x) / 3.0, side });
            }
        }
        rows
    }

    /// Returns the knots of a cubic whose pieces end at the lines, with a corner where the basis has a knot.
    fn knots(&self) -> Vec<f64> {
        let last = self.at.len() - 1;
        let mut knots = Vec::with_capacity(3 * self.at.len() + 2);
        for (line, &x) in self.at.iter().enumerate() {
            let end = line == 0 || line == last;
            // Two knots of a cubic leave C¹, which is what values and slopes give; three leave a corner, four an
            // end.
            let times = if end { 4 } else { 2 + usize::from(self.is_knot[line]) };
            knots.extend(std::iter::repeat_n(x, times));
        }
        knots
    }
}

/// Returns the bicubic Hermite spline of the offset, and its error in the middles of cells, mm. `None` where the basis has no normal or the
/// finest grid leaves more than [`WORST_FIT_MM`].
fn fit_bicubic(basis: &Surface, distance: f64) -> Option<(Surface, f64)> {
    // Knots of the basis stay grid lines, so that its breaks stay breaks.
    let breaks = |d: usize| {
        let mut b = basis.knots[d][basis.degree[d]..=basis.counts()[d]].to_vec();
        b.dedup();
        b
    };
    let base = [breaks(0), breaks(1)];
    let mut per_span = 2usize;
    loop {
        let lines = [0, 1].map(|d| GridLines::new(&base[d], per_span));
        let surface = hermite_surface(basis, distance, &lines)?;
        let mut error = 0f64;
        for u in lines[0].at.windows(2) {
            for v in lines[1].at.windows(2) {
                // The error of Hermite interpolation goes with t²(1 − t)²: it is largest in the middle of a cell.
                let uv = Uv::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
                let (p, ..) = first_order(basis, distance, uv)?;
                error = error.max((surface.evaluate(uv) - p).length());
            }
        }
        let longest = lines.iter().map(|l| l.at.len()).max()?;
        // What the largest grid gives is taken with its error, up to WORST_FIT_MM.
        let full = 2 * longest > MAX_CELLS.max(2 * base[0].len().max(base[1].len()));
        if error <= TOLERANCE || full {
            return (error <= WORST_FIT_MM).then_some((surface, error));
        }
        per_span *= 2;
    }
}

/// Returns the bicubic surface with the offset's values, slopes and twists where lines cross; `None` where one of them does not exist.
fn hermite_surface(basis: &Surface, distance: f64, lines: &[GridLines; 2]) -> Option<Surface> {
    let [rows, columns] = [lines[0].control_rows(), lines[1].control_rows()];
    let mut points = Vec::with_capacity(rows.len() * columns.len());
    for row in &rows {
        let u = lines[0].at[row.line];
        for column in &columns {
            let uv = Uv::new(u, lines[1].at[column.line]);
            let jet = jet(basis, distance, uv, [row.side, column.side])?;
            // Control points of a cubic Hermite patch: a third of the cell along each derivative, and the twist
            // along both.
            let p = jet.point + row.off * jet.du + column.off * jet.dv + (row.off * column.off) * jet.duv;
            points.push(Homogeneous::new(p.x, p.y, p.z, 1.0));
        }
    }
    Some(Surface { degree: [3, 3], knots: [lines[0].knots(), lines[1].knots()], points })
}

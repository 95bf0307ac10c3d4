//! Offset surfaces: exact where the basis is analytic, otherwise a bicubic fitted to 1e-6 mm; of an extrusion only its profile is
//! fitted, since the offset is an extrusion too and has no end.
//!
//! The fit interpolates position, both first and the mixed derivative (a C¹ bicubic Hermite spline) on a grid over the
//! basis' own domain that is refined until the middles of all cells agree. Known weakness: an offset beyond a radius of
//! curvature folds; it is fitted as it is.

use super::tolerances::{
    CLOSED_SHARE, DIFFERENCE_STEP, INSIDE_SHARE, PARALLEL_DERIVATIVES, VANISHING_RATIO, WORST_FIT_MM,
};
use super::{Chart, Kind, SplineChart};
use crate::math::{Homogeneous, Point, Uv, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, Surface, fit_cubic};

/// Stated error of fitted offsets, mm.
pub(crate) const TOLERANCE: f64 = 1e-6;
/// Most cells in one direction.
const MAX_CELLS: usize = 256;

/// The chart of the surface at `distance` along the normals of `basis`; `None` where nothing is left.
pub(crate) fn offset(basis: &Chart, distance: f64) -> Option<Chart> {
    let mut chart = match &basis.kind {
        Kind::Plane { frame } => {
            let mut frame = *frame;
            frame.origin += distance * frame.z;
            Chart::new(Kind::Plane { frame }, Analytic::Plane { frame })
        }
        Kind::Cone { frame, radius, half_angle } => {
            let (frame, half_angle) = (*frame, *half_angle);
            let radius = radius + distance / half_angle.cos();
            if !(radius > 0.0) {
                return None;
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
        _ => {
            let domain = basis_domain(basis)?;
            let (surface, error) = fit(&basis.surface(domain), distance)?;
            Chart { error, ..Chart::new(Kind::Spline(SplineChart::new(surface)), Analytic::Offset) }
        }
    };
    chart.flipped = basis.flipped;
    Some(chart)
}

/// The profile of an extrusion moved along the normals of its surface, and the error of the fit; `None` where it is torn at a corner.
fn offset_profile(base: &Curve, direction: Vector, distance: f64) -> Option<(Curve, f64)> {
    let mut whole: Option<Curve> = None;
    let mut worst = 0f64;
    for span in base.breakpoints().windows(2) {
        let piece = base.restricted(span[0], span[1]);
        let moved = |t: f64| {
            let d = piece.derivatives(t);
            d.point + distance * d.first.cross(direction).try_normalize().unwrap_or(Vector::NAN)
        };
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

fn basis_domain(basis: &Chart) -> Option<[[f64; 2]; 2]> {
    let mut domain = basis.range;
    for d in 0..2 {
        if let (Some(p), true) = (basis.period[d], domain[d][0].is_infinite()) {
            domain[d] = [0.0, p];
        }
    }
    domain.iter().flatten().all(|x| x.is_finite()).then_some(domain)
}

/// Position and derivatives of the offset at one point.
#[derive(Clone, Copy)]
struct Jet {
    point: Point,
    du: Vector,
    dv: Vector,
    duv: Vector,
}

/// First-order part of the jet, by the derivatives of the unit normal.
fn first_order(basis: &Surface, distance: f64, uv: Uv) -> Option<(Point, Vector, Vector)> {
    let s = basis.second_derivatives(uv);
    let n = s.du.cross(s.dv);
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

fn jet(basis: &Surface, distance: f64, uv: Uv, [[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> Option<Jet> {
    // At a pole the limit from just inside.
    let inner = Uv::new(
        uv.x.clamp(u0 + INSIDE_SHARE * (u1 - u0), u1 - INSIDE_SHARE * (u1 - u0)),
        uv.y.clamp(v0 + INSIDE_SHARE * (v1 - v0), v1 - INSIDE_SHARE * (v1 - v0)),
    );
    let (at, (point, du, dv)) = match first_order(basis, distance, uv) {
        Some(found) => (uv, found),
        None => (inner, first_order(basis, distance, inner)?),
    };
    let step = DIFFERENCE_STEP * (v1 - v0);
    let (lo, hi) = ((at.y - step).max(v0), (at.y + step).min(v1));
    let below = first_order(basis, distance, Uv::new(at.x, lo)).map_or(du, |d| d.1);
    let above = first_order(basis, distance, Uv::new(at.x, hi)).map_or(du, |d| d.1);
    Some(Jet { point, du, dv, duv: (above - below) / (hi - lo) })
}

/// The bicubic Hermite spline of the offset, and its error.
fn fit(basis: &Surface, distance: f64) -> Option<(Surface, f64)> {
    let domain = basis.domain();
    // Knots of the basis stay grid lines, so that its breaks stay breaks.
    let breaks = |d: usize| {
        let mut b = basis.knots[d][basis.degree[d]..=basis.counts()[d]].to_vec();
        b.dedup();
        b
    };
    let base = [breaks(0), breaks(1)];
    let mut per_span = 2usize;
    loop {
        let lines = [0, 1].map(|d| {
            let mut l: Vec<f64> = Vec::new();
            for w in base[d].windows(2) {
                l.extend((0..per_span).map(|k| w[0] + (w[1] - w[0]) * k as f64 / per_span as f64));
            }
            l.push(domain[d][1]);
            l
        });
        let surface = hermite(basis, distance, domain, &lines)?;
        let mut error = 0f64;
        for u in lines[0].windows(2) {
            for v in lines[1].windows(2) {
                let uv = Uv::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
                let (p, ..) = first_order(basis, distance, uv)?;
                error = error.max((surface.evaluate(uv) - p).length());
            }
        }
        let full = lines.iter().any(|l| 2 * l.len() > MAX_CELLS.max(2 * base[0].len().max(base[1].len())));
        if error <= TOLERANCE || full {
            return (error <= WORST_FIT_MM).then_some((surface, error));
        }
        per_span *= 2;
    }
}

fn hermite(basis: &Surface, distance: f64, domain: [[f64; 2]; 2], lines: &[Vec<f64>; 2]) -> Option<Surface> {
    let [us, vs] = lines;
    // Along each direction a node gives two control points, at minus and plus a third of the neighbouring cells.
    let offsets = |l: &[f64], i: usize| -> Vec<f64> {
        let mut o = Vec::with_capacity(2);
        if i > 0 {
            o.push(-(l[i] - l[i - 1]) / 3.0);
        } else {
            o.push(0.0);
        }
        o.push(if i + 1 < l.len() { (l[i + 1] - l[i]) / 3.0 } else { 0.0 });
        o
    };
    let mut points = Vec::with_capacity(4 * us.len() * vs.len());
    for (i, &u) in us.iter().enumerate() {
        let row: Vec<Jet> =
            vs.iter().map(|&v| jet(basis, distance, Uv::new(u, v), domain)).collect::<Option<_>>()?;
        for a in offsets(us, i) {
            for (j, jet) in row.iter().enumerate() {
                for b in offsets(vs, j) {
                    let p = jet.point + a * jet.du + b * jet.dv + (a * b) * jet.duv;
                    points.push(Homogeneous::new(p.x, p.y, p.z, 1.0));
                }
            }
        }
    }
    let knots = [0, 1].map(|d| {
        let l = &lines[d];
        let last = l.len() - 1;
        let mut k = vec![l[0]; 4];
        k.extend(l[1..last].iter().flat_map(|&x| [x, x]));
        k.extend([l[last]; 4]);
        k
    });
    Some(Surface { degree: [3, 3], knots, points })
}

//! One truck face → one [`Face`]: its surface over the parameters it uses, its wires as closed uv loops.

use super::geometry::{bspline_surface, nurbs_surface, point, vector};
use super::modeling::{Plane, Surface as TruckSurface};
use super::revolve::{Revolved, Side};
use super::trace::{ACCEPTED, EdgeTracer};
use crate::math::{Frame, Point, Uv};
use crate::model::{Analytic, EdgeId, EdgeUse, Face, TrimLoop};
use crate::nurbs::{ControlPoint, Curve, Surface, UvCurve, sweep};

/// Gaps in the parameter plane below this share of the domain are closed by moving an end; above, a pole must explain them.
const SNAP: f64 = 1e-6;

/// An edge of a wire, in the wire's direction: counter-clockwise about truck's normal.
#[derive(Clone, Copy)]
pub(super) struct WireEdge<'a> {
    pub(super) id: EdgeId,
    pub(super) curve: &'a Curve,
    pub(super) reversed: bool,
}

/// Makes a face of a truck surface, in mm, and its wires; `oriented` is whether the face looks as its surface does. Fails with the reason
/// where edges lie off the surface or do not close, or it is of a kind that has no form here.
pub(super) fn convert_face<'a>(
    surface: &TruckSurface,
    oriented: bool,
    wires: &[Vec<WireEdge<'a>>],
) -> Result<Face, String> {
    let (surface, analytic, flipped, loops, gap) = match surface {
        TruckSurface::Plane(p) => plane_parts(p, wires)?,
        TruckSurface::BSplineSurface(s) => {
            spline_parts(bspline_surface(s)?, Analytic::Bspline, false, wires, None)?
        }
        TruckSurface::NurbsSurface(s) => spline_parts(nurbs_surface(s)?, Analytic::Rational, false, wires, None)?,
        TruckSurface::RevolutedCurve(s) => {
            let revolved = Revolved::new(s)?;
            let flipped = revolved.flipped;
            // The material has to be on the left of our own parameters.
            let sides: Vec<Vec<Side>> = wires
                .iter()
                .map(|w| {
                    let side = |e: &WireEdge<'a>| Side { curve: e.curve, reversed: e.reversed != flipped };
                    // Turned to the other side, the wire is run backwards too.
                    if flipped { w.iter().rev().map(side).collect() } else { w.iter().map(side).collect() }
                })
                .collect();
            let cut = revolved.cut_to_loops(&sides)?;
            let middles = cut
                .middles
                .into_iter()
                .map(|m| if flipped { m.into_iter().rev().collect() } else { m })
                .collect::<Vec<Vec<f64>>>();
            spline_parts(cut.surface, Analytic::Revolution, flipped, wires, Some(&middles))?
        }
    };
    // Our normal is Su × Sv, truck's may be its opposite; and a face may be turned against its surface.
    let reversed = flipped == oriented;
    Ok(Face { analytic, reversed, loops, gap, ..Face::whole(surface) })
}

/// A surface, what it was in truck, whether Su × Sv is against truck's normal, its trims, and how far edges lie from it, mm.
type Parts = (Surface, Analytic, bool, Vec<TrimLoop>, f64);

/// Returns a plane's surface, sized by its wires, and its trims, which an affine map gives exactly; fails for edges more than [`ACCEPTED`]
/// off it.
fn plane_parts(p: &Plane, wires: &[Vec<WireEdge>]) -> Result<Parts, String> {
    let (x, normal) = (vector(p.u_axis()), vector(p.normal()));
    if !(x.is_finite() && normal.is_finite() && normal.length() > 0.5) {
        return Err("a plane without a normal".into());
    }
    let frame = Frame::from_axis(point(p.origin()), normal, Some(x));
    let mut gap = 0f64;
    let mut loops = Vec::new();
    for wire in wires {
        let mut uses = Vec::new();
        for e in wire {
            gap = e.curve.points.iter().fold(gap, |g, q| g.max(frame.local_point(q.position()).z.abs()));
            // An affine map of the control points maps the curve.
            let flat = |q: Point| Uv::new(q.x, q.y);
            let points = e.curve.points.iter();
            let points =
                points.map(|q| ControlPoint::weighted(flat(frame.local_point(q.position())), q.w)).collect();
            let uv = UvCurve { degree: e.curve.degree, knots: e.curve.knots.clone(), points };
            uses.push(EdgeUse { edge: Some(e.id), reversed: e.reversed, uv });
        }
        loops.push(TrimLoop { uses });
    }
    // Truck's wires may run beside their plane by its own tolerance.
    if gap > ACCEPTED {
        return Err(format!("an edge lies {gap:.3e} mm off its plane; at most {ACCEPTED:e} mm is accepted"));
    }
    let corners =
        loops.iter().flat_map(|l: &TrimLoop| &l.uses).flat_map(|u| u.uv.points.iter().map(|p| p.position()));
    let (mut low, mut high) = (Uv::INFINITY, Uv::NEG_INFINITY);
    for c in corners {
        (low, high) = (low.min(c), high.max(c));
    }
    if !(low.x < high.x && low.y < high.y) {
        return Err("a plane face without an extent".into());
    }
    // The plane goes no farther than its loops, because a domain must be finite.
    let surface = sweep::plane(&frame, [[low.x, high.x], [low.y, high.y]]);
    let loops = oriented_loops(&surface, loops)?;
    Ok((surface, Analytic::Plane { frame }, false, loops, gap))
}

/// Returns a spline with its trims, which are traced on it; `middles` are u in the middle of each edge, which show on which side of a seam
/// it runs. Edges without length are left out: they are poles.
fn spline_parts(
    surface: Surface,
    analytic: Analytic,
    flipped: bool,
    wires: &[Vec<WireEdge>],
    middles: Option<&[Vec<f64>]>,
) -> Result<Parts, String> {
    let tracer = EdgeTracer::new(&surface);
    let mut gap = 0f64;
    let mut loops = Vec::new();
    for (i, wire) in wires.iter().enumerate() {
        let mut uses = Vec::new();
        for (k, e) in wire.iter().enumerate() {
            if e.curve.bounds().diagonal() < ACCEPTED {
                continue; // An edge without length is a pole; it is put in again below.
            }
            let traced = tracer.trace(e.curve, middles.map(|m| m[i][k]))?;
            gap = gap.max(traced.gap);
            let mut uv = traced.uv;
            for p in &mut uv.points {
                // A step of rounding beyond the domain would be outside of the face.
                *p = ControlPoint::weighted(surface.clamp(p.position()), p.weight());
            }
            uses.push(EdgeUse { edge: Some(e.id), reversed: e.reversed, uv });
        }
        loops.push(TrimLoop { uses });
    }
    let loops = oriented_loops(&surface, loops)?;
    Ok((surface, analytic, flipped, loops, gap))
}

/// Returns the loops closed in the parameter plane, the outer one, which comes first, counter-clockwise and the others clockwise.
fn oriented_loops(surface: &Surface, loops: Vec<TrimLoop>) -> Result<Vec<TrimLoop>, String> {
    let mut closed = loops.into_iter().map(|l| close_loop(surface, l)).collect::<Result<Vec<_>, _>>()?;
    let areas: Vec<f64> = closed.iter().map(TrimLoop::signed_area).collect();
    // In the plane of parameters the largest loop holds the others.
    let outer = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()));
    for (i, l) in closed.iter_mut().enumerate() {
        if (areas[i] > 0.0) != (Some(i) == outer) {
            l.uses.reverse();
            l.uses.iter_mut().for_each(|u| u.reversed = !u.reversed);
        }
    }
    if let Some(outer) = outer {
        closed.swap(0, outer);
    }
    Ok(closed)
}

/// Returns the loop with uses along poles put in and its ends joined to the bit; fails for gaps that no pole explains.
fn close_loop(surface: &Surface, l: TrimLoop) -> Result<TrimLoop, String> {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let extent = Uv::new(u1 - u0, v1 - v0);
    let mut uses: Vec<EdgeUse> = Vec::new();
    let count = l.uses.len();
    let first = l.uses.first().map(EdgeUse::start).ok_or("a wire without edges")?;
    for (i, next) in l.uses.into_iter().enumerate() {
        if i > 0 {
            bridge_pole(surface, extent, &mut uses, next.start())?;
        }
        let start = uses.last().map(EdgeUse::end);
        uses.push(next);
        // The ends of neighbours agree to rounding and must agree to the bit.
        if let (Some(start), Some(last)) = (start, uses.last_mut()) {
            move_end(last, true, start);
        }
    }
    debug_assert!(uses.len() >= count);
    bridge_pole(surface, extent, &mut uses, first)?;
    if let Some(last) = uses.last_mut() {
        move_end(last, false, first);
    }
    Ok(TrimLoop { uses })
}

/// Adds the line of a pole where the chain does not reach `to`; nothing for a step of rounding. `extent` is the size of the domain.
fn bridge_pole(surface: &Surface, extent: Uv, uses: &mut Vec<EdgeUse>, to: Uv) -> Result<(), String> {
    let Some(from) = uses.last().map(EdgeUse::end) else { return Ok(()) };
    if ((to - from) / extent).abs().max_element() <= SNAP {
        return Ok(());
    }
    let off = |s: f64| (surface.evaluate(from + (to - from) * s) - surface.evaluate(from)).length();
    // Only a pole lets the parameters jump while the point stays.
    if [0.25, 0.5, 0.75, 1.0].map(off).into_iter().fold(0.0, f64::max) > ACCEPTED {
        return Err("edges that do not meet in the parameters of their surface".into());
    }
    uses.push(EdgeUse { edge: None, reversed: false, uv: UvCurve::line(from, to, [0.0, 1.0]) });
    Ok(())
}

/// Moves the start (or end) of a use, in the loop's direction, to a point that is the same but for rounding.
fn move_end(u: &mut EdgeUse, start: bool, to: Uv) {
    let last = u.uv.points.len() - 1;
    let p = &mut u.uv.points[if start != u.reversed { 0 } else { last }];
    *p = ControlPoint::weighted(to, p.weight());
}

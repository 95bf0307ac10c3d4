//! Chords of one edge: within the tolerance of each of its faces in space, and by the edge's curve in their parameter planes.

use super::curve_chords::{self, Effort, bisect_all, bisect_coarse};
use crate::math::{Point, Uv, Vector};
use crate::model::EdgeUse;
use crate::nurbs::{Curve, FundamentalForms};
use crate::tessellate::face_surface::{CREASE, FaceSurface};
use crate::tessellate::proof::border_chord::STRAIGHT_EDGE;
use crate::tessellate::proof::flat_triangle::distance_to_chord;

/// Share of the tolerance that chords of edges may take; the rest is left to rounding and to the proof's slack.
const EDGE_SHARE: f64 = 0.96;
/// Share of the surface's size that facets beside an edge are taken to reach into the face, where their sag is guessed.
const FACET_REACH: f64 = 0.25;
/// Distance, mm, and share of the curve's size, within which its ends are one: the readers of files make them one vertex then.
const CLOSED_CURVE: f64 = 1e-9;
/// Tolerances by which the uv chord may leave the curve.
const UV_SLACK: f64 = 2.0;
/// The same where the chord of an edge that is straight in space runs outside of the face.
const HOLLOW_SLACK: f64 = 1.0;
/// Share of a chord's length by which it may leave the curve where no facet beside it is known to need more.
const UV_SHARE: f64 = 0.02;
/// Share of the angle by which normals may turn about a chord: by all of it the facet beside it keeps the angle only where its third corner
/// stands between the ends of the chord.
const TWIST_SHARE: f64 = 0.75;
/// The file's own gaps by which the uv chord may leave the curve further.
const GAP_SLACK: f64 = 2.0;
/// Where along a chord the curve is compared with it.
pub(in crate::tessellate) const PLACES: [f64; 3] = [0.25, 0.5, 0.75];
/// Share of the tightest tolerance within which two places on an edge are one.
const SAME_PLACE: f64 = 1e-3;
/// Halvings that find where an edge crosses a crease: down to the spacing of numbers.
const CROSSING_HALVINGS: usize = 60;

/// An edge as one face uses it, with the surface of that face.
pub(in crate::tessellate) struct EdgeSide<'s, 'a> {
    pub(in crate::tessellate) surface: &'s FaceSurface<'a>,
    pub(in crate::tessellate) edge_use: &'s EdgeUse,
}

/// Returns the tolerance, mm of the part, for a chord along `along` (any length, not zero) at parameter `t` of an edge of a face: all of
/// the face's tolerance where the surface is straight across the chord, down to half of it where it bends that way; never more than the
/// greatest turn of normals allows.
fn chord_tolerance(side: &EdgeSide<'_, '_>, t: f64, along: Vector) -> f64 {
    let surface = side.surface;
    if surface.affine {
        return surface.field.loosest();
    }
    let uv = surface.spline.clamp(side.edge_use.uv.evaluate(t));
    let xi = surface.tolerance(uv);
    let d = surface.second_derivatives(uv);
    // At poles and cusps the curvature is unknown; half of it is what a surface that bends across is given at least.
    let Some(forms) = FundamentalForms::new(&d) else { return 0.5 * xi };
    // The direction across, in parameters: orthogonal to `along` in the tangent plane.
    let across = forms.normal.cross(along);
    let ([e, f, g], det) = (forms.first, forms.first[0] * forms.first[2] - forms.first[1] * forms.first[1]);
    let (x, y) = (across.dot(d.du), across.dot(d.dv));
    // The inverse of the first fundamental form takes a tangent vector to its parameters.
    let direction = Uv::new((g * x - f * y) / det, (e * y - f * x) / det);
    let sag = forms.normal_curvature(direction).abs() * (FACET_REACH * surface.size).powi(2) / 8.0;
    // Where normals must not turn far, that limits the chord as a sag would.
    let xi = xi.min(surface.field.sag_at_angle(forms.largest_curvature()));
    xi * (1.0 - (sag / xi).min(0.5))
}

/// Returns the tolerance, mm, for a chord of an edge at its parameter `t` in direction `along` (not zero, of any length): [`EDGE_SHARE`]
/// of the least that its faces give, quartered for each `denser`. Infinite without sides.
fn edge_tolerance(sides: &[EdgeSide<'_, '_>], denser: u32, t: f64, along: Vector) -> f64 {
    let each = sides.iter().map(|s| chord_tolerance(s, t, along));
    // Half the length is a quarter of the sag: each denser round asks for chords half as long.
    EDGE_SHARE * each.fold(f64::INFINITY, f64::min) / 4f64.powi(denser as i32)
}

/// Returns the parameters, ascending and with both ends, at which an edge is divided so that its chords hold for all of its `sides`, in
/// space and in their parameter planes, and normals do not turn too far about them. Each `denser` asks for chords half as long. A closed
/// edge gets at least three chords, a straight one as few as one.
pub(super) fn edge_parameters(curve: &Curve, sides: &[EdgeSide<'_, '_>], denser: u32) -> Vec<f64> {
    // A straight edge sags nowhere, whatever tolerance its faces ask for.
    let t = if curve.degree == 1 && curve.points.len() == 2 {
        curve.domain().to_vec()
    } else {
        curve_chords::chord_parameters(
            &curve_chords::breaks(curve),
            Effort::new(curve),
            |t| curve.evaluate(t),
            |t, along| edge_tolerance(sides, denser, t, along),
        )
    };
    let mut t = follow_in_parameters(curve, sides, denser, t);
    follow_twist(curve, sides, &mut t);
    let (first, last) = (curve.evaluate(t[0]), curve.evaluate(t[t.len() - 1]));
    let closed = (first - last).length() <= CLOSED_CURVE + CLOSED_CURVE * curve.bounds().diagonal();
    // A closed curve of two chords would enclose nothing.
    let fewest = if closed { 3 } else { 1 };
    while t.len() <= fewest {
        bisect_all(&mut t);
    }
    t
}

/// Returns the parameters `t` with further ones where their chords are too long for the edge's `sides`; none is taken away.
pub(super) fn divide_further(curve: &Curve, sides: &[EdgeSide<'_, '_>], denser: u32, mut t: Vec<f64>) -> Vec<f64> {
    curve_chords::halve_long_chords(
        &mut t,
        Effort::new(curve),
        |t| curve.evaluate(t),
        |t, along| edge_tolerance(sides, denser, t, along),
    );
    follow_in_parameters(curve, sides, denser, t)
}

/// Adds parameters where the edge crosses creases, and where the straight line between two samples in the parameter plane of a face strays
/// from the edge in space: by more than some tolerances and, at `denser` 0, a share of the chord; by more than the tolerance where it runs
/// outside of the face beside an edge that is straight in space, so that facets do. A gap that the file itself has between edge and surface
/// is allowed on top: one of 9 mm once made 67,000 chords.
fn follow_in_parameters(curve: &Curve, sides: &[EdgeSide<'_, '_>], denser: u32, mut t: Vec<f64>) -> Vec<f64> {
    cross_creases(curve, sides, &mut t);
    let at = |t: f64| curve.evaluate(t);
    let shorter = 0.25f64.powi(denser as i32);
    let tightest = sides.iter().map(|s| s.surface.field.tightest()).fold(f64::INFINITY, f64::min);
    bisect_coarse(&mut t, Effort::new(curve), |a, b| {
        let chord = [at(a), at(b)];
        let is_straight = distance_to_chord(at(0.5 * (a + b)), &chord) <= STRAIGHT_EDGE * tightest;
        let places = PLACES.map(|f| {
            let t = a + (b - a) * f;
            (f, t, at(t))
        });
        sides.iter().any(|s| {
            let FaceSurface { spline, field, affine, .. } = s.surface;
            let (ua, ub) = (s.edge_use.uv.evaluate(a), s.edge_use.uv.evaluate(b));
            places.iter().any(|&(f, t, here)| {
                let curve_uv = || s.edge_use.uv.evaluate(t);
                // The face lies to the left: a curve on that side of its chord leaves a strip beside the face to the facets.
                let hollow =
                    is_straight && !affine && ((ub - ua).perp_dot(curve_uv() - ua) > 0.0) != s.edge_use.reversed;
                let slack = if hollow { HOLLOW_SLACK } else { UV_SLACK } * field.tightest() * shorter;
                let on = s.surface.point(spline.clamp(ua.lerp(ub, f)));
                // At the same parameter it is usually close enough; only else is the nearest point looked for.
                if (on - here).length() <= slack {
                    return false;
                }
                let near = nearest_on(&at, a, b, on);
                let off = (on - near).length();
                // Chords in the parameter plane need not be closer than that as long as nothing fails for it; in
                // denser rounds they must.
                let loose = denser == 0 && !hollow && off <= UV_SHARE * (chord[1] - chord[0]).length();
                let curve_uv = spline.clamp(curve_uv());
                if off <= slack || loose || hollow && off <= HOLLOW_SLACK * s.surface.tolerance(curve_uv) * shorter
                {
                    return false;
                }
                let gap = (s.surface.point(curve_uv) - here).length();
                off > slack + GAP_SLACK * gap
            })
        })
    });
    t
}

/// Halves chords about which the normals of a face turn by more than [`TWIST_SHARE`] of its angle: those of a twisted face turn about its
/// straight edges too. Without an angle nothing is halved.
fn follow_twist(curve: &Curve, sides: &[EdgeSide<'_, '_>], t: &mut Vec<f64>) {
    if sides.iter().all(|s| s.surface.affine || s.surface.field.angle.is_none()) {
        return;
    }
    bisect_coarse(t, Effort::new(curve), |a, b| {
        let length = (curve.evaluate(b) - curve.evaluate(a)).length();
        sides.iter().any(|s| twists_too_far(s, [a, b], length))
    });
}

/// Whether normals turn by more than [`TWIST_SHARE`] of the angle of a face about its chord between the parameters `a` and `b`, of this
/// `length`, mm. False without an angle and for a chord too short to be divided for it.
fn twists_too_far(side: &EdgeSide<'_, '_>, [a, b]: [f64; 2], length: f64) -> bool {
    let FaceSurface { spline, field, affine, .. } = side.surface;
    let Some(angle) = field.angle.filter(|_| !affine && length > field.least_of_angle()) else { return false };
    let uv = |t: f64| side.edge_use.uv.evaluate(t);
    let along = uv(b) - uv(a);
    let turn = |f: f64| {
        let d = side.surface.second_derivatives(spline.clamp(uv(a + (b - a) * f)));
        FundamentalForms::new(&d).map_or(0.0, |forms| forms.saddle_torsion(along) * length)
    };
    PLACES.into_iter().any(|f| turn(f) > TWIST_SHARE * angle)
}

/// Adds to the ascending `t` the parameters at which the edge crosses sharp creases of its faces, except next to samples that are there.
fn cross_creases(curve: &Curve, sides: &[EdgeSide<'_, '_>], t: &mut Vec<f64>) {
    let mut found: Vec<f64> = Vec::new();
    for s in sides.iter().filter(|s| s.surface.is_sharp()) {
        for (d, creases) in s.surface.sharp.iter().enumerate() {
            // Ends that lie on the crease already are corners enough.
            let near = CREASE * s.surface.extent()[d];
            let at = |t: f64| s.edge_use.uv.evaluate(t)[d];
            for (pair, &crease) in t.windows(2).flat_map(|pair| creases.iter().map(move |c| (pair, c))) {
                let (mut lo, mut hi) = (pair[0], pair[1]);
                let (x, y) = (at(lo) - crease, at(hi) - crease);
                if x * y >= 0.0 || x.abs() <= near || y.abs() <= near {
                    continue;
                }
                for _ in 0..CROSSING_HALVINGS {
                    let m = 0.5 * (lo + hi);
                    if (at(m) < crease) == (x < 0.0) { lo = m } else { hi = m }
                }
                // Uneven weights crowd parameters: far from both ends there, it may be in the very place of one.
                let (m, least) = (0.5 * (lo + hi), SAME_PLACE * s.surface.field.tightest());
                let p = curve.evaluate(m);
                if pair.iter().all(|&end| (curve.evaluate(end) - p).length() > least) {
                    found.push(m);
                }
            }
        }
    }
    // Both faces may have the same crease there.
    found.sort_by(f64::total_cmp);
    let least = sides.iter().map(|s| SAME_PLACE * s.surface.field.tightest()).fold(f64::INFINITY, f64::min);
    found.dedup_by(|b, a| (curve.evaluate(*a) - curve.evaluate(*b)).length() <= least);
    t.extend(found);
    t.sort_by(f64::total_cmp);
}

/// Returns the point of the curve over `[a, b]` nearest to `p`, by sampling three times around the best, so that it is never nearer than
/// the true one.
fn nearest_on(at: &impl Fn(f64) -> Point, a: f64, b: f64, p: Point) -> Point {
    /// Steps of one look, and how many looks there are, each around the nearest place of the last.
    const STEPS: i32 = 6;
    const LOOKS: usize = 3;
    let (mut lo, mut hi) = (a, b);
    let mut best = at(0.5 * (a + b));
    for _ in 0..LOOKS {
        let step = (hi - lo) / f64::from(STEPS);
        let away = |k: i32| (at(lo + (hi - lo) * f64::from(k) / f64::from(STEPS)) - p).length();
        let nearest = (1..=STEPS).fold((0, away(0)), |best, k| {
            let here = away(k);
            if here.total_cmp(&best.1).is_lt() { (k, here) } else { best }
        });
        let x = lo + step * f64::from(nearest.0);
        best = at(x);
        lo = (x - step).max(a);
        hi = (x + step).min(b);
    }
    best
}

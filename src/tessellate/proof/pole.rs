//! Facets at a pole, where a whole side of the parameter rectangle is one point.
//!
//! A triangle between a pole and two corners `a` and `b` stands for the piece between the parameter lines from `a` and from `b`
//! into the pole, not for its own triangle of parameters: the straight line of parameters from `b` to another place on the pole
//! bows sideways by a quarter of the facet's width, the parameter line does not. Neighbours around a pole share such lines, so
//! their pieces meet; a triangle with two corners on one pole has no piece. On the tip of a cone of 10 m that is 320 facets in place
//! of 160 000. A triangle from pole to pole and to a corner `x` stands for what lies between its own line from pole to pole and the
//! parameter line through `x`.
//!
//! Why the bound of `prover.rs` holds: all it requires of a piece is that it is the image of a disc of parameters whose boundary falls into
//! curves between the corners, and here the disc is the quadrilateral of corners and feet. It is convex, as its two sides along the pole
//! (or the poles) are parallel, so the two parameter triangles that it is cut into cover it, and P to T is their larger bound. For T to P
//! each boundary curve is shrunk onto its own edge: the lines into the pole onto the sides there, the base or what the trim puts in its
//! place onto its chord, and the side along the pole onto the one point that it is, which it leaves by no more than the size of the pole. A
//! border that runs aslant into the pole ends the piece in place of the parameter line: its chord's deviation and the hull around what lies
//! between chord and curve are in its own bound, and its foot is the pole's corner itself. Corners stay where they are while curves shrink,
//! the file's gap between corner and surface being in what `side` and `piece` measure, from the corner's place in space. Where two corners
//! lie in one direction from the pole the piece has no width and the sides decide alone.

use super::border_chord::BorderChord;
use super::prover::Prover;
use crate::math::{Point, Uv};
use crate::tessellate::face_surface::FaceSurface;

/// Share of the domain by which a border that runs into a pole may leave its parameter line.
const ASLANT: f64 = 1e-9;

/// Returns the point of the pole `pole` on the parameter line through `x`; `across` is the parameter that is constant along the pole, 0 for
/// u or 1 for v.
fn foot(x: Uv, pole: Uv, across: usize) -> Uv {
    let mut f = x;
    f[across] = pole[across];
    f
}

/// Returns the index of the corner at a pole, and the parameter that is constant along that pole; `None` unless exactly one corner is at a
/// pole.
fn pole_corner(surface: &FaceSurface<'_>, uv: &[Uv; 3]) -> Option<(usize, usize)> {
    let mut found = None;
    for (k, &x) in uv.iter().enumerate() {
        if let Some(across) = surface.pole(x)
            // A second corner at the pole: no sector, but a triangle that has come to nothing.
            && found.replace((k, across)).is_some()
        {
            return None;
        }
    }
    found
}

/// Whether two corners, both at poles along which parameter `across` is constant, are at opposite ones.
fn at_opposite_poles(surface: &FaceSurface<'_>, a: Uv, b: Uv, across: usize) -> bool {
    // Poles lie at the ends of the domain: half of it apart is the other one.
    (a[across] - b[across]).abs() > 0.5 * surface.extent()[across]
}

/// Returns the index of the corner off the poles, of a triangle whose other two are at opposite poles, and the parameter constant along
/// these; `None` for others.
fn spindle_corner(surface: &FaceSurface<'_>, uv: &[Uv; 3]) -> Option<(usize, usize)> {
    let at = uv.map(|x| surface.pole(x));
    let k = (0..3).find(|&k| at[k].is_none())?;
    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
    let across = at[a]?;
    (at[b] == Some(across) && at_opposite_poles(surface, uv[a], uv[b], across)).then_some((k, across))
}

/// Returns the parameters in the middle of each side, the one from corner 0 to 1 first; on sides into a pole, along the parameter line of
/// the other corner.
pub(in crate::tessellate) fn side_middles(surface: &FaceSurface<'_>, uv: [Uv; 3]) -> [Uv; 3] {
    let mut at = [0, 1, 2].map(|i| 0.5 * (uv[i] + uv[(i + 1) % 3]));
    if let Some((k, across)) = pole_corner(surface, &uv) {
        let (a, b) = (uv[(k + 1) % 3], uv[(k + 2) % 3]);
        at[k] = 0.5 * (a + foot(a, uv[k], across));
        at[(k + 2) % 3] = 0.5 * (b + foot(b, uv[k], across));
    }
    if let Some((k, across)) = spindle_corner(surface, &uv) {
        let x = uv[k];
        at[k] = 0.5 * (x + foot(x, uv[(k + 1) % 3], across));
        at[(k + 2) % 3] = 0.5 * (x + foot(x, uv[(k + 2) % 3], across));
    }
    at
}

/// Returns the index of the first corner of a triangle or quad at a pole, with parameters there that keep each of its triangles within its
/// sector: opposite the diagonal those of the diagonal's other end, else those between its neighbours. `None` without a pole.
pub(in crate::tessellate) fn facet_parameters(surface: &FaceSurface<'_>, uv: &[Uv]) -> Option<(usize, Uv)> {
    let n = uv.len();
    let (k, across) = uv.iter().enumerate().find_map(|(k, &x)| Some((k, surface.pole(x)?)))?;
    let from = if n == 4 && k % 2 == 0 { uv[(k + 2) % 4] } else { 0.5 * (uv[(k + 1) % n] + uv[(k + n - 1) % n]) };
    Some((k, foot(from, uv[k], across)))
}

/// Whether the proof of a triangle includes all that lies beside it up to parameter lines into a pole, or from pole to pole.
pub(in crate::tessellate) fn covers_to_meridians(surface: &FaceSurface<'_>, uv: [Uv; 3]) -> bool {
    is_sector(surface, uv) || spindle_corner(surface, &uv).is_some()
}

/// Whether a triangle is proved as a sector: exactly one corner is at a pole.
pub(in crate::tessellate) fn is_sector(surface: &FaceSurface<'_>, uv: [Uv; 3]) -> bool {
    pole_corner(surface, &uv).is_some()
}

/// Returns a bound, mm, for a triangle with one corner at a pole or with two at opposite ones; `None` for others. `sides` are what its
/// sides follow, the one from corner 0 to 1 first, `None` where no edge; above `limit` the value proves nothing.
pub(in crate::tessellate) fn sector_bound(
    prover: &mut Prover<'_, '_>,
    uv: [Uv; 3],
    xyz: [Point; 3],
    sides: [Option<&BorderChord>; 3],
    limit: f64,
) -> Option<f64> {
    if let Some((k, across)) = spindle_corner(prover.surface, &uv) {
        return Some(spindle_bound(prover, uv, xyz, sides, limit, (k, across)));
    }
    let (k, across) = pole_corner(prover.surface, &uv)?;
    let [p, a, b] = [0, 1, 2].map(|i| uv[(k + i) % 3]);
    let [xp, xa, xb] = [0, 1, 2].map(|i| xyz[(k + i) % 3]);
    let [of_a, of_base, of_b] = [0, 1, 2].map(|i| sides[(k + i) % 3]);
    // A border that runs into the pole aslant ends the piece itself.
    let foot_a = if of_a.is_some() { p } else { foot(a, p, across) };
    let foot_b = if of_b.is_some() { p } else { foot(b, p, across) };
    let lines = [
        (of_a, [a, foot_a], [xa, xp]),
        (of_base, [a, b], [xa, xb]),
        (of_b, [b, foot_b], [xb, xp]),
        (None, [foot_a, foot_b], [xp, xp]),
    ];
    // Where the corners run back around the pole the piece is folded; the argument of `prover.rs` does not ask for more.
    Some(quadrilateral_bound(prover, lines, [a, b, foot_b, foot_a], xyz, limit))
}

/// Returns a bound, mm, for a triangle between opposite poles, constant in parameter `across`, whose corner `k` is off them. Other
/// arguments as for [`sector_bound`].
fn spindle_bound(
    prover: &mut Prover<'_, '_>,
    uv: [Uv; 3],
    xyz: [Point; 3],
    sides: [Option<&BorderChord>; 3],
    limit: f64,
    (k, across): (usize, usize),
) -> f64 {
    let [x, a, b] = [0, 1, 2].map(|i| uv[(k + i) % 3]);
    let [at, xa, xb] = [0, 1, 2].map(|i| xyz[(k + i) % 3]);
    let [of_a, of_base, of_b] = [0, 1, 2].map(|i| sides[(k + i) % 3]);
    let foot_a = if of_a.is_some() { a } else { foot(x, a, across) };
    let foot_b = if of_b.is_some() { b } else { foot(x, b, across) };
    let lines = [
        (of_a, [x, foot_a], [at, xa]),
        (of_base, [a, b], [xa, xb]),
        (of_b, [x, foot_b], [at, xb]),
        (None, [foot_a, a], [xa, xa]),
        (None, [foot_b, b], [xb, xb]),
    ];
    let whole = quadrilateral_bound(prover, lines, [a, b, foot_b, foot_a], xyz, limit);
    if of_a.is_none() && of_b.is_none() {
        return whole;
    }
    // A border in place of a parameter line leaves a triangle between the feet.
    whole.max(prover.triangle_bound([x, foot_a, foot_b], xyz, limit))
}

/// Returns a bound, mm, for a triangle `xyz` whose piece is a convex quadrilateral of parameters; each boundary line is measured from its
/// chord, or by the edge that stands in its place. Above `limit` it proves nothing.
fn quadrilateral_bound<const N: usize>(
    prover: &mut Prover<'_, '_>,
    lines: [(Option<&BorderChord>, [Uv; 2], [Point; 2]); N],
    [a, b, c, d]: [Uv; 4],
    xyz: [Point; 3],
    limit: f64,
) -> f64 {
    let mut worst = 0f64;
    for (trim, uv, ends) in lines {
        worst = worst.max(match trim {
            Some(trim) => trim.bound(prover, xyz, limit),
            // Each line is measured from its own edge, or from the trim that stands in its place.
            None => prover.side_bound(uv, ends, limit),
        });
        // A line above the limit decides already, and is cheaper than the inside.
        if worst > limit {
            return worst;
        }
    }
    for piece in [[a, b, c], [a, c, d]] {
        if worst <= limit {
            worst = worst.max(prover.triangle_bound(piece, xyz, limit));
        }
    }
    worst
}

/// Returns a bound, mm, for a triangle with two corners on one pole, which stands for no piece: the size of the pole. `None` for others,
/// and where an edge runs aslant into the pole. `sides` as for [`sector_bound`].
pub(in crate::tessellate) fn collapsed_bound(
    surface: &FaceSurface<'_>,
    uv: [Uv; 3],
    sides: [Option<&BorderChord>; 3],
) -> Option<f64> {
    let k = (0..3).find(|&k| surface.pole(uv[k]).is_none())?;
    let [a, b] = [(k + 1) % 3, (k + 2) % 3];
    let across = surface.pole(uv[a])?;
    if surface.pole(uv[b]) != Some(across) || at_opposite_poles(surface, uv[a], uv[b], across) {
        return None;
    }
    let extent = surface.extent()[1 - across];
    // The side from `k` to `a` is the one that starts at `k`; that from `b` to `k` starts at `b`.
    let aslant = [(a, sides[k]), (b, sides[b])].into_iter().any(|(j, side)| {
        let off = (uv[j][1 - across] - uv[k][1 - across]).abs();
        // The two ends of the side are one point in space, up to the size of the pole.
        side.is_some() && off > ASLANT * extent
    });
    (!aslant).then_some(surface.pole_size)
}

//! Facets at a pole, where a whole side of the parameter rectangle is one point.
//!
//! A triangle between a pole and two corners `a` and `b` stands for the piece between the parameter lines from `a` and from `b`
//! into the pole, not for its own triangle of parameters: the straight line of parameters from `b` to another place on the pole
//! bows sideways by a quarter of the facet's width, the parameter line does not. Neighbours around a pole share such lines, so
//! their pieces meet; a triangle with two corners on the pole has no piece. On the tip of a cone of 10 m that is 320 facets in place
//! of 160 000.

use super::super::border::trim::Trim;
use super::super::proof::bound::Prover;
use super::super::sheet::Sheet;
use super::delaunay::key;
use crate::math::{Point, Uv};
use rustc_hash::FxHashMap;

/// Where the parameter line of `x` meets the pole at `pole`, whose parameter `across` it keeps.
fn foot(x: Uv, pole: Uv, across: usize) -> Uv {
    let mut f = x;
    f[across] = pole[across];
    f
}

/// The corner at a pole, and the parameter that is constant along the pole; `None` unless it is the only one.
fn corner(sheet: &Sheet<'_>, uv: &[Uv; 3]) -> Option<(usize, usize)> {
    let mut found = None;
    for (k, &x) in uv.iter().enumerate() {
        if let Some(across) = sheet.pole(x)
            && found.replace((k, across)).is_some()
        {
            return None;
        }
    }
    found
}

/// Middles of the sides of a triangle, those into a pole along parameter lines.
pub(in crate::tessellate) fn middles(sheet: &Sheet<'_>, uv: [Uv; 3]) -> [Uv; 3] {
    let mut at = [0, 1, 2].map(|i| 0.5 * (uv[i] + uv[(i + 1) % 3]));
    if let Some((k, across)) = corner(sheet, &uv) {
        let (a, b) = (uv[(k + 1) % 3], uv[(k + 2) % 3]);
        at[k] = 0.5 * (a + foot(a, uv[k], across));
        at[(k + 2) % 3] = 0.5 * (b + foot(b, uv[k], across));
    }
    at
}

/// The corner of a facet at a pole, with parameters there that keep each of its triangles within its sector: opposite the
/// diagonal those of the diagonal's other end, else those between its neighbours.
pub(in crate::tessellate) fn seen(sheet: &Sheet<'_>, uv: &[Uv]) -> Option<(usize, Uv)> {
    let n = uv.len();
    let (k, across) = uv.iter().enumerate().find_map(|(k, &x)| Some((k, sheet.pole(x)?)))?;
    let from = if n == 4 && k % 2 == 0 { uv[(k + 2) % 4] } else { 0.5 * (uv[(k + 1) % n] + uv[(k + n - 1) % n]) };
    Some((k, foot(from, uv[k], across)))
}

/// Whether a triangle is proved by its sector.
pub(in crate::tessellate) fn applies(sheet: &Sheet<'_>, uv: [Uv; 3]) -> bool {
    corner(sheet, &uv).is_some()
}

/// Bound for a triangle at a pole; `None` for others. `sides` are what its sides follow, the one from corner 0 to 1 first.
pub(in crate::tessellate) fn bound(
    prover: &mut Prover<'_, '_>,
    uv: [Uv; 3],
    xyz: [Point; 3],
    sides: [Option<&Trim>; 3],
    limit: f64,
) -> Option<f64> {
    let (k, across) = corner(prover.sheet, &uv)?;
    let [p, a, b] = [0, 1, 2].map(|i| uv[(k + i) % 3]);
    let [xp, xa, xb] = [0, 1, 2].map(|i| xyz[(k + i) % 3]);
    let [of_a, of_base, of_b] = [0, 1, 2].map(|i| sides[(k + i) % 3]);
    // A border that runs into the pole aslant ends the piece itself.
    let foot_a = if of_a.is_some() { p } else { foot(a, p, across) };
    let foot_b = if of_b.is_some() { p } else { foot(b, p, across) };
    let mut worst = 0f64;
    let lines = [
        (of_a, [a, foot_a], [xa, xp]),
        (of_base, [a, b], [xa, xb]),
        (of_b, [b, foot_b], [xb, xp]),
        (None, [foot_a, foot_b], [xp, xp]),
    ];
    for (trim, uv, ends) in lines {
        worst = worst.max(match trim {
            Some(trim) => trim.bound(prover, xyz, limit),
            None => prover.side(uv, ends, limit),
        });
        if worst > limit {
            return Some(worst);
        }
    }
    // Where the corners run back around the pole the piece is folded; the argument of `bound.rs` does not ask for more.
    for piece in [[a, b, foot_b], [a, foot_b, foot_a]] {
        if worst <= limit {
            worst = worst.max(prover.piece(piece, xyz, limit));
        }
    }
    Some(worst)
}

/// Bound for a triangle with two corners on one pole: nothing, but where a border runs aslant into it.
pub(in crate::tessellate) fn line(
    sheet: &Sheet<'_>,
    uv: [Uv; 3],
    t: [u32; 3],
    trims: &FxHashMap<[u32; 2], Trim>,
) -> Option<f64> {
    let k = (0..3).find(|&k| sheet.pole(uv[k]).is_none())?;
    let across = sheet.pole(uv[(k + 1) % 3])?;
    if sheet.pole(uv[(k + 2) % 3]) != Some(across) {
        return None;
    }
    let extent = sheet.extent()[1 - across];
    let aslant = [(k + 1) % 3, (k + 2) % 3].into_iter().any(|j| {
        let off = (uv[j][1 - across] - uv[k][1 - across]).abs();
        trims.contains_key(&key(t[j], t[k])) && off > 1e-9 * extent
    });
    (!aslant).then_some(sheet.pole_size)
}

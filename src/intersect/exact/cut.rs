//! Cutting patches into leaves: what lies outside the trims goes first, then halves until leaves are flat and their boxes close.
//!
//! A face is often a small part of its surface, and a flat strip across the axes fills little of its box. Cutting the patch
//! down to its trims and halving large loose boxes took a valve of 424 patches from 7.0 leaf tests a ray to 1.3, a wing from
//! 10.5 to 2.9, and both to twice the rate; cutting leaves that many rays meet flatter gave the valve another fifth.

use super::geometry::{Geometry, Patch};
use super::leaf::{Described, Leaf, border_sides, describe, deviation, steeper, widen, xyz};
use super::net::{self, Net, V4};
use super::probe::Probe;
use super::trim::Region;
use super::wide;
use crate::math::{Aabb, Uv, Vector};
use rayon::prelude::*;

/// Leaves and their control points.
#[derive(Debug, Default)]
pub(super) struct Leaves {
    pub(super) leaves: Vec<Leaf>,
    pub(super) probes: Vec<Probe>,
    pub(super) pool: Vec<V4>,
}

/// When to stop cutting.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cutting {
    pub(super) flatness: f64,
    pub(super) depth: u32,
}

/// A part of a patch.
struct Part {
    net: Net,
    /// Of the patch's local domain.
    rect: [[f64; 2]; 2],
    /// How often it was halved.
    depth: u32,
    /// How many more times a coordinate was rounded.
    shrunk: u32,
}

/// Cuts every patch.
pub(super) fn cut_all(geometry: &Geometry, cutting: Cutting) -> Vec<Leaves> {
    let parts: Vec<Option<Part>> = geometry
        .patches
        .par_iter()
        .map(|p| shrunk(geometry, p, Part { net: p.net.clone(), rect: [[0.0, 1.0]; 2], depth: 0, shrunk: 0 }))
        .collect();
    let corners = geometry.patches.iter().zip(&parts).filter_map(|(patch, part)| {
        let (lo, hi) = extent(&part.as_ref()?.net);
        Some([patch.center + lo, patch.center + hi])
    });
    let scene = Aabb::around(corners.flatten()).half_area();
    parts
        .into_par_iter()
        .enumerate()
        .map(|(p, part)| part.map(|part| cut(geometry, p as u32, part, (cutting, scene))).unwrap_or_default())
        .collect()
}

/// A part without what lies outside the trims on its sides; `None` when nothing is left.
fn shrunk(geometry: &Geometry, patch: &Patch, mut part: Part) -> Option<Part> {
    let trim = &geometry.trims[geometry.faces[patch.face as usize].trim as usize];
    let kept = trim.kept(in_surface(patch, part.rect))?;
    let (lo, hi) = (patch.local(Uv::new(kept[0][0], kept[1][0])), patch.local(Uv::new(kept[0][1], kept[1][1])));
    for d in 0..2 {
        let [a, b] = part.rect[d];
        let [low, high] = [(lo[d] - a) / (b - a), (hi[d] - a) / (b - a)];
        // Less is not worth the rounding.
        let low = if low > WORTH { low } else { 0.0 };
        let high = if high < 1.0 - WORTH { high } else { 1.0 };
        if (low, high) != (0.0, 1.0) && high > 1e-6 && low < high {
            net::restrict(&mut part.net, patch.degree, d, [low, high]);
            let end = |x: f64, whole: f64| if x == whole { part.rect[d][whole as usize] } else { a + (b - a) * x };
            part.rect[d] = [end(low, 0.0), end(high, 1.0)];
            part.shrunk += RESTRICTED;
        }
    }
    Some(part)
}

/// Share of a part's side that must lie outside for it to be cut off.
const WORTH: f64 = 0.05;
/// A restriction rounds each coordinate three times a step in two passes, where a halving does once in one.
const RESTRICTED: u32 = 6;
/// Leaves whose boxes are a larger part of the scene's are cut flatter: they are met often, and by many rays at a slant.
const MET: f64 = 5e-3;
/// A leaf whose box is a larger part of the scene's is halved further as long as the boxes of its halves are together smaller
/// by a quarter: strips that lie across the axes were met by ten times as many rays as touch them.
const LARGE: f64 = 1e-3;
/// How often a flat leaf may be halved for the sake of its box.
const SPLITS: u32 = 8;

/// Cuts one patch into leaves; those that lie outside the trims are dropped.
fn cut(geometry: &Geometry, index: u32, whole: Part, (cutting, scene): (Cutting, f64)) -> Leaves {
    let patch = &geometry.patches[index as usize];
    let trim = &geometry.trims[geometry.faces[patch.face as usize].trim as usize];
    let mut out = Leaves::default();
    let mut stack = vec![whole];
    while let Some(part) = stack.pop() {
        let Some(part) = shrunk(geometry, patch, part) else { continue };
        let region = trim.region(in_surface(patch, part.rect));
        if region == Region::Outside {
            continue;
        }
        let Part { net: piece, rect, depth, shrunk } = part;
        let Described { mut leaf, slopes, net: centred } = describe(patch, &piece, rect, depth + shrunk);
        let weights = centred.iter().fold((f64::INFINITY, 0f64), |(lo, hi), p| (lo.min(p[3]), hi.max(p[3])));
        let area = leaf.bounds().half_area();
        let finer = if area > MET * scene && depth < cutting.depth { 0.4 } else { 1.0 };
        let flat = deviation(&leaf, &slopes) < finer * cutting.flatness && weights.1 < 1.5 * weights.0;
        let large = area > LARGE * scene && depth < cutting.depth + SPLITS;
        let tighter = if large { halved_box(&piece, patch.degree, 0.75 * area) } else { None };
        if (flat || depth >= cutting.depth) && tighter.is_none() {
            leaf.whole = region == Region::Inside;
            leaf.patch = index;
            leaf.face = patch.face;
            let face = &geometry.faces[patch.face as usize];
            if !trim.whole && !leaf.whole {
                widen(
                    &mut leaf,
                    &slopes,
                    border_sides(&geometry.grids[face.grid as usize], patch, rect),
                    face.band,
                );
            }
            leaf.net = out.pool.len() as u32;
            let middle = wide::evaluate(&centred, patch.degree, 0.5, 0.5).s;
            out.pool.extend(centred);
            out.probes.push(Probe::new(&leaf, &slopes, &middle));
            out.leaves.push(leaf);
            continue;
        }
        let direction = match tighter {
            Some(direction) if flat || depth >= cutting.depth => direction,
            _ => steeper(&leaf, &slopes, &centred, depth),
        };
        let [low, high] = net::halves(&piece, patch.degree, direction);
        let middle = 0.5 * (rect[direction][0] + rect[direction][1]);
        let (mut a, mut b) = (rect, rect);
        a[direction][1] = middle;
        b[direction][0] = middle;
        stack.push(Part { net: high, rect: b, depth: depth + 1, shrunk });
        stack.push(Part { net: low, rect: a, depth: depth + 1, shrunk });
    }
    out
}

/// The direction whose halves have the smaller boxes, when these together are smaller than `area`.
fn halved_box(piece: &[V4], degree: [u8; 2], area: f64) -> Option<usize> {
    let halves = |d: usize| -> f64 {
        let boxes = net::halves(piece, degree, d).map(|half| extent(&half));
        boxes.map(|(min, max)| Aabb { min, max }.half_area()).iter().sum()
    };
    let areas = [halves(0), halves(1)];
    let best = usize::from(areas[1] < areas[0]);
    (areas[best] < area).then_some(best)
}

/// Corners of the box around a net's points.
fn extent(net: &[V4]) -> (Vector, Vector) {
    net.iter()
        .map(|p| xyz(p) / p[3])
        .fold((Vector::INFINITY, Vector::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
}

/// The rectangle of the surface's domain for one of a patch's local domain.
fn in_surface(patch: &Patch, [u, v]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let (from, to) = (patch.uv([u[0], v[0]]), patch.uv([u[1], v[1]]));
    [[from.x, to.x], [from.y, to.y]]
}

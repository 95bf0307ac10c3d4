//! Cutting patches into leaves: what lies outside the trims goes first, then halves until leaves are flat and their boxes close.
//!
//! A face is often a small part of its surface, and a flat strip across the axes fills little of its box. Cutting the patch
//! down to its trims and halving large loose boxes took a valve of 424 patches from 7.0 leaf tests a ray to 1.3, a wing from
//! 10.5 to 2.9, and both to twice the rate; cutting leaves that many rays meet flatter gave the valve another fifth.

use super::geometry::{Geometry, make_room};
use super::leaf::{
    Described, Leaf, WHOLE_PATCH, border_sides, describe, deviation, flattening_direction, widen, xyz,
};
use super::linearization::Linearization;
use super::net::{self, Net, V4};
use super::patch::Patch;
use super::trim::{Region, Trim};
use crate::math::{Aabb, Uv, Vector};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Share of a part's side that must lie outside the trims for it to be cropped: less is not worth the rounding.
const WORTH_CROPPING: f64 = 0.05;
/// Crops that leave less than this share at the low end divide by next to nothing, and are not made.
const LEAST_CROP: f64 = 1e-6;
/// A restriction rounds each coordinate three times a step in two passes, where a halving does once in one.
const ROUNDINGS_OF_CROP: u32 = 6;
/// Leaves whose boxes are a larger part of the scene's are cut flatter: they are met often, and by many rays at a slant.
const OFTEN_MET: f64 = 5e-3;
/// How much flatter.
const FLATTER: f64 = 0.4;
/// A leaf whose box is a larger part of the scene's is halved further as long as the boxes of its halves are together smaller
/// by a quarter: strips that lie across the axes were met by ten times as many rays as touch them.
const LARGE: f64 = 1e-3;
/// What is left of a box's area by such a halving.
const TIGHTER: f64 = 0.75;
/// How often a flat leaf may be halved for the sake of its box.
const BOX_HALVINGS: u32 = 8;
/// Deviation from which a part has no tangent plane to speak of, and how often in a row it is halved in spite of it. Beside a pole the
/// deviation is a few units however small the part is; a patch that is a line or a point has none, and was cut into a million leaves.
const NO_TANGENT_PLANE: f64 = 1e6;
const VAIN_HALVINGS: u32 = 4;
/// Largest ratio of two weights of a flat leaf.
const WEIGHT_RATIO: f64 = 1.5;

/// The leaves of one patch or of many, and their control points.
#[derive(Debug, Default)]
pub(super) struct PatchLeaves {
    pub(super) leaves: Vec<Leaf>,
    pub(super) linearizations: Vec<Linearization>,
    /// The axis-parallel box around each leaf, in the world.
    pub(super) boxes: Vec<Aabb>,
    /// Of the leaves whose nets are not their patches': they come to stand behind [`Geometry::nets`], and leaves name them so.
    pub(super) nets: Vec<V4>,
}

impl PatchLeaves {
    /// Room for so many leaves: of lists that grow step by step the allocator keeps what they have left behind.
    fn with_capacity(leaves: usize) -> Self {
        Self {
            leaves: Vec::with_capacity(leaves),
            linearizations: Vec::with_capacity(leaves),
            boxes: Vec::with_capacity(leaves),
            nets: Vec::new(),
        }
    }

    /// Makes room for those of further patches.
    fn make_room(&mut self, more: &[Self]) {
        let count = |of: fn(&Self) -> usize| more.iter().map(of).sum();
        make_room(&mut self.leaves, count(|one| one.leaves.len()));
        make_room(&mut self.linearizations, count(|one| one.linearizations.len()));
        make_room(&mut self.boxes, count(|one| one.boxes.len()));
        make_room(&mut self.nets, count(|one| one.nets.len()));
    }

    /// Appends those of a further patch, whose nets come to stand behind its own; `patch_points` is the length of [`Geometry::nets`].
    fn append(&mut self, other: Self, patch_points: u32) {
        let offset = self.nets.len() as u32;
        let moved = |net: u32| if net < patch_points { net } else { net + offset };
        let first = self.leaves.len();
        self.leaves.extend(other.leaves);
        self.linearizations.extend(other.linearizations);
        self.leaves[first..].iter_mut().for_each(|leaf| leaf.net = moved(leaf.net));
        self.linearizations[first..].iter_mut().for_each(|leaf| leaf.net = moved(leaf.net));
        self.boxes.extend(other.boxes);
        self.nets.extend(other.nets);
    }
}

/// When a part of a patch is flat enough to be a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flatness {
    /// Largest deviation of its Jacobian: [`super::Settings::flatness`].
    pub(super) deviation: f64,
    /// How often a patch may be halved for it.
    pub(super) depth: u32,
}

/// A part of a patch.
struct SubPatch {
    net: Net,
    /// Of the patch's local domain.
    rect: [[f64; 2]; 2],
    /// How often it was halved.
    depth: u32,
    /// How many more times a coordinate was rounded.
    crop_roundings: u32,
    /// How many of the last parts that it is a half of had no tangent plane.
    vain: u32,
}

/// One patch under subdivision.
struct Subdivision<'a> {
    index: u32,
    patch: &'a Patch,
    geometry: &'a Geometry,
    trim: &'a Trim,
    flatness: Flatness,
    /// Half the area of the box around everything.
    scene_area: f64,
}

/// Patches that are cut at a time: their leaves stand in memory twice, 1 kB each, until they are joined to the others.
const BLOCK: usize = 256;

/// Cuts every patch into leaves, in parallel, and returns all in the order of the patches; none where all is outside the trims.
pub(super) fn subdivide_all(geometry: &Geometry, flatness: Flatness) -> PatchLeaves {
    subdivide_up_to(geometry, flatness, usize::MAX).expect("memory ends before so many leaves")
}

/// As [`subdivide_all`]; `None` where there would be more than `most` leaves, found out before there are many more.
pub(super) fn subdivide_up_to(geometry: &Geometry, flatness: Flatness, most: usize) -> Option<PatchLeaves> {
    let cropped = |patch: &Patch| {
        let whole = SubPatch {
            net: Net::from_slice(geometry.net(patch)),
            rect: WHOLE_PATCH,
            depth: 0,
            crop_roundings: 0,
            vain: 0,
        };
        crop(geometry.trim_of(patch), patch, whole)
    };
    // Only now, from what the trims leave: a small face on a large surface must not make the scene look large. Cropped once more below,
    // for nets of all patches at once took 50 MB of a model of 86,000.
    let box_of = |patch: &Patch| {
        let (lo, hi) = extent(&cropped(patch)?.net);
        Some(Aabb::from_points([patch.center + lo, patch.center + hi]))
    };
    let boxes: Vec<Option<Aabb>> = geometry.patches.par_iter().map(box_of).collect();
    let scene_area = boxes.into_iter().flatten().fold(Aabb::EMPTY, Aabb::union).half_area();
    let leaves = AtomicUsize::new(0);
    let leaves_of = |(index, patch): (usize, &Patch)| {
        // A patch that lies outside its trims has no leaves.
        let Some(part) = cropped(patch) else { return PatchLeaves::default() };
        let trim = geometry.trim_of(patch);
        // When there are too many already, the rest is not cut: whether there are does not depend on the order.
        let left = most.saturating_sub(leaves.load(Ordering::Relaxed));
        let cut =
            Subdivision { index: index as u32, patch, geometry, trim, flatness, scene_area }.leaves(part, left);
        leaves.fetch_add(cut.leaves.len(), Ordering::Relaxed);
        cut
    };
    let mut all = PatchLeaves::with_capacity(geometry.patches.len().min(most));
    for (k, block) in geometry.patches.chunks(BLOCK).enumerate() {
        let numbered = block.par_iter().enumerate().map(|(i, patch)| (k * BLOCK + i, patch));
        let cut: Vec<PatchLeaves> = numbered.map(leaves_of).collect();
        if leaves.load(Ordering::Relaxed) > most {
            return None;
        }
        all.make_room(&cut);
        cut.into_iter().for_each(|one| all.append(one, geometry.nets.len() as u32));
    }
    all.leaves.shrink_to_fit();
    all.linearizations.shrink_to_fit();
    Some(all)
}

/// Cuts off from a part's sides what lies outside the trims, where that is worth it; `None` when nothing is left.
fn crop(trim: &Trim, patch: &Patch, mut part: SubPatch) -> Option<SubPatch> {
    let kept = trim.bounds_within(in_surface(patch, part.rect))?;
    let from = patch.local(Uv::new(kept[0][0], kept[1][0]));
    let to = patch.local(Uv::new(kept[0][1], kept[1][1]));
    for d in 0..2 {
        let [a, b] = part.rect[d];
        let low = (from[d] - a) / (b - a);
        let high = (to[d] - a) / (b - a);
        // Little gain is not worth the rounding of a restriction, which the leaf must answer for.
        let low = if low > WORTH_CROPPING { low } else { 0.0 };
        let high = if high < 1.0 - WORTH_CROPPING { high } else { 1.0 };
        if (low, high) != (0.0, 1.0) && high > LEAST_CROP && low < high {
            net::restrict(&mut part.net, patch.degree, d, [low, high]);
            // An end that stays is not rounded.
            let end = |x: f64, whole: f64| if x == whole { part.rect[d][whole as usize] } else { a + (b - a) * x };
            part.rect[d] = [end(low, 0.0), end(high, 1.0)];
            part.crop_roundings += ROUNDINGS_OF_CROP;
        }
    }
    Some(part)
}

impl Subdivision<'_> {
    /// Cuts `whole`, the patch or what a crop left of it, into leaves; parts that lie outside the trims are dropped. Ends when
    /// there are more than `most` leaves.
    fn leaves(&self, whole: SubPatch, most: usize) -> PatchLeaves {
        let degree = self.patch.degree;
        let mut out = PatchLeaves::default();
        let mut stack = vec![whole];
        while let Some(part) = stack.pop().filter(|_| out.leaves.len() <= most) {
            // Cropped anew at each level: halves of a part may lie outside the trims where the part does not.
            let Some(part) = crop(self.trim, self.patch, part) else { continue };
            let region = self.trim.region(in_surface(self.patch, part.rect));
            if region == Region::Outside {
                continue;
            }
            let SubPatch { net: piece, rect, depth, crop_roundings, vain } = part;
            let described = describe(self.patch, &piece, rect, depth + crop_roundings);
            let area = described.bounds.half_area();
            let has_plane = deviation(&described.leaf, &described.slopes) < NO_TANGENT_PLANE;
            let vain = if has_plane { 0 } else { vain + 1 };
            let deepest = depth >= self.flatness.depth || vain > VAIN_HALVINGS;
            let flat = self.is_flat(&described, area, deepest);
            // The box of a slanted leaf is mostly empty and met by many rays in vain: a large one is halved beyond what flatness requires,
            // where that shrinks the boxes.
            let large = has_plane && area > LARGE * self.scene_area && depth < self.flatness.depth + BOX_HALVINGS;
            let tighter = if large { tightening_direction(&piece, degree, TIGHTER * area) } else { None };
            let direction = match tighter {
                None if flat || deepest => {
                    self.add_leaf(described, region, rect, &mut out);
                    continue;
                }
                // Flatness requires nothing more: it is halved for its box alone, in the direction that tightens
                // it.
                Some(direction) if flat || deepest => direction,
                _ => flattening_direction(&described.leaf, &described.slopes, &described.net, depth),
            };
            let [low, high] = net::halves(&piece, degree, direction);
            let middle = 0.5 * (rect[direction][0] + rect[direction][1]);
            let mut low_rect = rect;
            let mut high_rect = rect;
            low_rect[direction][1] = middle;
            high_rect[direction][0] = middle;
            // The low half comes off the stack first, so that leaves that follow each other in memory follow each
            // other on the patch.
            stack.push(SubPatch { net: high, rect: high_rect, depth: depth + 1, crop_roundings, vain });
            stack.push(SubPatch { net: low, rect: low_rect, depth: depth + 1, crop_roundings, vain });
        }
        out
    }

    /// Whether a part is so flat that the one-step test decides on it most of the time; large parts, by the half area of their box, must be
    /// flatter unless they are the deepest.
    fn is_flat(&self, part: &Described, area: f64, deepest: bool) -> bool {
        let (least, most) =
            part.net.iter().fold((f64::INFINITY, 0f64), |(least, most), p| (least.min(p[3]), most.max(p[3])));
        let flatter = if area > OFTEN_MET * self.scene_area && !deepest { FLATTER } else { 1.0 };
        deviation(&part.leaf, &part.slopes) < flatter * self.flatness.deviation && most < WEIGHT_RATIO * least
    }

    /// Makes a part a leaf and adds it to `out`, with its net and linearization.
    fn add_leaf(&self, mut part: Described, region: Region, rect: [[f64; 2]; 2], out: &mut PatchLeaves) {
        let leaf = &mut part.leaf;
        leaf.whole = region == Region::Inside;
        leaf.has_pole = self.geometry.has_pole(self.patch);
        leaf.patch = self.index;
        leaf.face = self.patch.face;
        let face = &self.geometry.faces[self.patch.face as usize];
        // Only for a leaf that a trim passes is the side of the shared edge evaluated on which a root lies.
        if !self.trim.whole && !part.leaf.whole {
            let border = border_sides(&self.geometry.grids[face.grid as usize], self.patch, rect);
            widen(&mut part, border, face.deciding_distance);
        }
        let Described { mut leaf, bounds, slopes, net: control } = part;
        let middle = net::evaluate(&control, self.patch.degree, 0.5, 0.5).s;
        leaf.net = if rect == WHOLE_PATCH {
            self.patch.net
        } else {
            let net = self.geometry.nets.len() + out.nets.len();
            out.nets.extend(control);
            net as u32
        };
        out.linearizations.push(Linearization::new(&leaf, &slopes, &middle, self.patch.ill_scaled));
        out.boxes.push(bounds);
        out.leaves.push(leaf);
    }
}

/// The direction whose halves have the smaller boxes; `None` unless half areas of these add up to less than `area`.
fn tightening_direction(piece: &[V4], degree: [u8; 2], area: f64) -> Option<usize> {
    let halves = |d: usize| -> f64 {
        let boxes = net::halves(piece, degree, d).map(|half| extent(&half));
        boxes.map(|(min, max)| Aabb { min, max }.half_area()).iter().sum()
    };
    let areas = [halves(0), halves(1)];
    let best = usize::from(areas[1] < areas[0]);
    (areas[best] < area).then_some(best)
}

/// Lower and upper corner, mm, of the box around a net's points.
fn extent(net: &[V4]) -> (Vector, Vector) {
    net.iter()
        .map(|p| xyz(p) / p[3])
        .fold((Vector::INFINITY, Vector::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
}

/// Turns a rectangle of a patch's local domain into one of the surface's.
fn in_surface(patch: &Patch, [u, v]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let (from, to) = (patch.uv([u[0], v[0]]), patch.uv([u[1], v[1]]));
    [[from.x, to.x], [from.y, to.y]]
}

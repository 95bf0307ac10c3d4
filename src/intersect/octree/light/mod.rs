//! What a source sees: the first facets that rays from one point, or along one direction, may meet.
//!
//! All rays of a point source start at one place, and those of a collimated one run one way: which facet such a ray meets first
//! depends on two numbers alone. A map of squares over these two, on the six sides of a cube around the point or in a plane across
//! the direction, keeps for each square the facets that a ray through it may meet, the nearest first, without those behind a facet
//! that fills the square. A ray looks its square up and tests the one or two facets there, and does not walk the tree.
//!
//! Source: Haines, Greenberg, *The Light Buffer: A Shadow-Testing Accelerator*, IEEE CG&A 6(9), 1986, here for nearest hits, with
//! squares that are divided where many facets meet.
//!
//! Guarantee: the hits of the walk, bit by bit; facets are put into squares with room for rounding, and the facet's own test
//! decides. Weakness: a source with an extent has no such map.

pub(super) mod pair;
mod raster;
mod slot;

use super::Octree;
use super::engine::Lanes;
use crate::intersect::facet::{FacetHit, FacetRay, Line, Nearest};
use crate::intersect::prefetch::prefetch;
use crate::intersect::{Beam, Cost, ExpectedRays};
use crate::math::{Point, Ray, Vector, orthonormal_pair};
use pair::Edges;
use slot::Slot;
use std::hint::select_unpredictable;

/// Rays for each facet from which on a map pays: a facet costs some 5 µs to draw, and a ray that need not walk saves 0.06 µs.
const WORTH: u64 = 200;
/// Facets above which no map is drawn: drawing takes 500 bytes for each.
const LARGEST: usize = 1 << 18;
/// Most maps that are kept.
const MOST: usize = 16;
/// Squares along each side of a divided square.
const FINE: usize = 4;
/// Set in [`Square::count`] where the square is divided.
const DIVIDED: u32 = 1 << 31;

/// The facets of a square, or where its own squares begin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Square {
    first: u32,
    count: u32,
}

/// A facet that a ray may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    /// It lies nowhere nearer than this, in the depth of the map.
    near: f32,
    slot: u32,
}

/// How places are seen from a source.
#[derive(Clone, Copy, Debug, PartialEq)]
enum View {
    /// From a point, on the sides of a cube around it.
    Point([f64; 3]),
    /// Along a direction, in units of half the side of a square around all facets, from a plane at the depth `start`, which rays
    /// may miss by `stray`.
    Along { origin: Point, direction: Vector, across: [Vector; 2], middle: [f64; 2], start: f64, stray: f64 },
}

/// The maps of one source.
#[derive(Clone, Debug)]
pub(super) struct Map {
    view: View,
    /// Squares along each side of the map.
    side: usize,
    /// Those of the map, side after side of the cube, then those of divided squares.
    squares: Vec<Square>,
    entries: Vec<Entry>,
    slots: Vec<Slot>,
}

/// Where a ray looks.
#[derive(Clone, Copy)]
struct Look {
    index: u16,
    map: u16,
    square: u32,
    /// Place in the square.
    rest: [f64; 2],
    /// From distances along the ray to depths of the map.
    scale: f64,
    shift: f64,
    line: Line,
}

impl Look {
    const IDLE: Self = Self {
        index: 0,
        map: 0,
        square: 0,
        rest: [0.0; 2],
        scale: 1.0,
        shift: 0.0,
        line: Line { origin: [0.0; 3], shear: [0.0; 3], t_min: 0.0 },
    };
}

/// Rays that are looked up together.
const TOGETHER: usize = 32;

impl View {
    fn of(beam: &Beam, tree: &Octree) -> Option<Self> {
        match beam {
            Beam::Point(origin) => origin.is_finite().then(|| Self::Point(origin.to_array())),
            Beam::Collimated { origin, direction } => {
                let (x, y) = orthonormal_pair(*direction);
                let span = |axis: Vector| {
                    let along = tree.around.bounds.corners().map(|p| p.dot(axis));
                    let (low, high) =
                        along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
                    (0.5 * (low + high), 0.5 * (high - low) * (1.0 + 1e-6))
                };
                let ((a, width), (b, height)) = (span(x), span(y));
                let half = width.max(height);
                // Rounding must stay small against a square.
                let fits = half > 0.0 && (a.abs() + b.abs()) < 1e6 * half && direction.is_normalized();
                let start = origin.dot(*direction);
                let stray = 1e-9 * (start.abs() + half);
                let (across, middle) = ([x / half, y / half], [a / half, b / half]);
                (fits && origin.is_finite()).then_some(Self::Along {
                    origin: *origin,
                    direction: *direction,
                    across,
                    middle,
                    start,
                    stray,
                })
            }
        }
    }

    /// Number of maps.
    fn sides(&self) -> usize {
        if matches!(self, Self::Point(_)) { 6 } else { 1 }
    }

    /// Whether a ray that starts on no face is one of those that are seen.
    #[inline(always)]
    fn sees(&self, ray: &Ray) -> bool {
        match self {
            Self::Point(origin) => ray.origin.to_array() == *origin,
            Self::Along { direction, start, stray, .. } => {
                ray.direction == *direction && (ray.origin.dot(*direction) - start).abs() <= *stray
            }
        }
    }
}

/// The maps for these sources, as far as they pay; those that are there already are kept.
pub(super) fn find(tree: &Octree, expected: &ExpectedRays<'_>, mut there: Vec<Map>) -> Vec<Map> {
    let mut maps: Vec<Map> = Vec::new();
    let facets = tree.around.mesh.facets.len();
    let worth = |rays: u64| facets <= LARGEST && rays / WORTH >= facets as u64;
    let views = expected.beams.iter().filter(|(_, rays)| worth(*rays)).filter_map(|(beam, _)| View::of(beam, tree));
    for view in views {
        if maps.len() < MOST && maps.iter().all(|m| m.view != view) {
            let own = there.iter().position(|m| m.view == view).map(|k| there.swap_remove(k));
            maps.push(own.unwrap_or_else(|| raster::draw(tree.around.mesh, view, expected.threads)));
        }
    }
    maps
}

impl Map {
    /// Where a ray looks first; `false` when it passes all facets by. Without closures, which would be compiled without the caller's
    /// instruction set.
    #[inline(always)]
    fn look(&self, (index, map): (usize, usize), ray: &Ray, look: &mut Look) -> bool {
        let prepared = FacetRay::new(ray);
        look.line = prepared.line();
        let (side, [x, y], scale, shift) = match &self.view {
            View::Point(_) => {
                let [sx, sy, sz] = look.line.shear;
                // Slopes are against the main axis as it points; the sides of the cube look outward.
                let sign = 1f64.copysign(sz);
                let main = prepared.axes()[2];
                (2 * main + usize::from(sz < 0.0), [sx * sign, sy * sign], ray.direction[main].abs(), 0.0)
            }
            View::Along { direction, across: [x, y], middle, .. } => {
                let place = [ray.origin.dot(*x) - middle[0], ray.origin.dot(*y) - middle[1]];
                (0, place, 1.0, ray.origin.dot(*direction))
            }
        };
        let n = self.side as f64;
        let (x, y) = ((0.5 * x + 0.5) * n, (0.5 * y + 0.5) * n);
        // False for NaN too.
        let inside = (x >= 0.0) & (x <= n) & (y >= 0.0) & (y <= n);
        let (i, j) = ((x as usize).min(self.side - 1), (y as usize).min(self.side - 1));
        look.square = select_unpredictable(inside, (side * self.side + j) * self.side + i, 0) as u32;
        look.rest = [x - i as f64, y - j as f64];
        (look.scale, look.shift) = (scale, shift);
        (look.index, look.map) = (index as u16, map as u16);
        inside
    }

    /// The facets that a ray may meet.
    #[inline(always)]
    fn entries(&self, look: &Look) -> &[Entry] {
        let mut square = self.squares[look.square as usize];
        let [mut x, mut y] = look.rest;
        while square.count & DIVIDED != 0 {
            (x, y) = (x * FINE as f64, y * FINE as f64);
            let (i, j) = ((x as usize).min(FINE - 1), (y as usize).min(FINE - 1));
            (x, y) = (x - i as f64, y - j as f64);
            square = self.squares[square.first as usize + j * FINE + i];
        }
        &self.entries[square.first as usize..(square.first + square.count) as usize]
    }
}

/// The map that shows a ray; `last` is the first to be looked at.
#[inline(always)]
fn map_of(maps: &[Map], last: usize, ray: &Ray) -> Option<usize> {
    if ray.from.is_some() | (ray.t_min != 0.0) {
        return None;
    }
    if maps[last].view.sees(ray) {
        return Some(last);
    }
    let mut k = 0;
    while k < maps.len() {
        if maps[k].view.sees(ray) {
            return Some(k);
        }
        k += 1;
    }
    None
}

/// Answers the rays that are on a map; gives the number of the others, whose places come first in `rest`.
#[inline(always)]
pub(super) fn answer<L: Lanes>(
    maps: &[Map],
    rays: &[Ray],
    hits: &mut [Option<FacetHit>],
    rest: &mut [u16],
    cost: &mut Cost,
) -> usize {
    let (mut others, mut next, mut last) = (0, 0, 0);
    let mut looks = [Look::IDLE; TOGETHER];
    let mut edges = Edges::default();
    let mut found: [(&[Entry], u8); TOGETHER] = [(&[], 0); TOGETHER];
    while next < rays.len() {
        let mut n = 0;
        while n < TOGETHER && next < rays.len() {
            let ray = &rays[next];
            if let Some(map) = map_of(maps, last, ray) {
                last = map;
                let inside = maps[map].look((next, map), ray, &mut looks[n]);
                prefetch(&maps[map].squares, looks[n].square as usize);
                n += usize::from(inside);
            } else {
                rest[others] = next as u16;
                others += 1;
            }
            next += 1;
        }
        // Which rays find nothing is not to be guessed.
        let mut full = 0;
        for (k, look) in looks[..n].iter().enumerate() {
            let entries = maps[usize::from(look.map)].entries(look);
            prefetch(entries, 0);
            found[full] = (entries, k as u8);
            full += usize::from(!entries.is_empty());
        }
        for (entries, k) in &found[..full] {
            let map = &maps[usize::from(looks[usize::from(*k) % TOGETHER].map)];
            for entry in entries.iter().take(2) {
                prefetch(&map.slots, entry.slot as usize);
            }
        }
        for (entries, k) in &found[..full] {
            let look = &looks[usize::from(*k) % TOGETHER];
            let slots = &maps[usize::from(look.map)].slots;
            let index = usize::from(look.index);
            let mut best = Nearest::up_to(rays[index].t_max);
            let mut first = 0;
            while first < entries.len() {
                if f64::from(entries[first].near) > best.t * look.scale + look.shift {
                    break;
                }
                let other = entries.get(first + 1);
                cost.tests += 1 + u64::from(other.is_some());
                let one = &slots[entries[first].slot as usize];
                let other = other.map(|e| &slots[e.slot as usize]);
                pair::test::<L>(one, other, &look.line, &mut edges, &mut best);
                first += 2;
            }
            hits[index] = best.hit();
        }
    }
    others
}

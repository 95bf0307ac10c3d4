//! What a source sees: the first facets that rays from one point, or along one direction, may meet.
//!
//! All rays of a point source start at one place, and those of a collimated one run one way: which facet such a ray meets first
//! depends on two numbers alone. A light buffer is a grid of squares over these two, on the six sides of a cube around the point or
//! in a plane across the direction. Each square keeps the facets that a ray through it may meet, the nearest first, without those
//! behind a facet that fills the square. A ray looks its square up and tests the one or two facets there, and does not walk the tree.
//!
//! Source: Haines, Greenberg, *The Light Buffer: A Shadow-Testing Accelerator*, IEEE CG&A 6(9), 1986, here for nearest hits, with
//! squares that are divided where many facets meet.
//!
//! Guarantee: the hits of the walk, bit by bit; facets are put into squares with room for rounding, and the facet's own test
//! decides. Weakness: a source with an extent has no light buffer.

mod buffer_facet;
mod pair;
mod raster;

use super::facet_pair::Edges;
use super::lanes::Lanes;
use super::tree::Tree;
use crate::intersect::facet::{FacetHit, FacetRay, Line, Nearest};
use crate::intersect::prefetch::prefetch;
use crate::intersect::{Beam, Cost, ExpectedRays};
use crate::math::{Ray, Vector, orthonormal_pair};
use buffer_facet::BufferFacet;
use std::cmp::{Ordering, Reverse};
use std::hint::select_unpredictable;

/// Rays for each facet from which on a light buffer pays: a facet costs some 5 µs to draw, and a ray that need not walk saves 0.06 µs.
const LEAST_RAYS_PER_FACET: u64 = 200;
/// Facets above which none is drawn: one takes 500 bytes for each.
const MOST_FACETS: usize = 1 << 18;
/// By how much the grid of a collimated source is wider than the mesh, relative to it: sixteen roundings of f32, far above those of f64.
const SPAN_ROOM: f64 = 1e-6;
/// Distance of the mesh from the origin, in half widths of the grid, above which none is drawn: a place is then wrong by up to
/// 2⁻⁵³·10⁶ ≈ 1e-10 of the grid, a hundredth of the room around its squares.
const FARTHEST_MIDDLE: f64 = 1e6;
/// By how much starts may stray from the plane of a collimated source, relative to its place and the mesh: a million roundings, so that
/// starts which were computed in any way are taken.
const PLANE_ROOM: f64 = 1e-9;
/// Most buffers that are kept.
const MOST_BUFFERS: usize = 16;
/// Squares along each side of a divided square.
const DIVISIONS: usize = 4;
/// Set in [`Square::count`] where the square is divided.
const DIVIDED: u32 = 1 << 31;

/// The facets of a square, or where its own squares begin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Square {
    /// Where its entries or squares begin, and how many there are.
    first: u32,
    count: u32,
}

/// A facet that a ray may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    /// It lies nowhere nearer than this, in the depth of the buffer.
    near: f32,
    /// Index into [`LightBuffer::facets`].
    facet: u32,
}

/// How places are seen from a source.
#[derive(Clone, Copy, Debug, PartialEq)]
enum View {
    /// From a point, on the sides of a cube around it.
    Point([f64; 3]),
    /// Along a direction, in units of half the side of a square around all facets, from a plane at the depth `start`, which rays
    /// may miss by `stray`.
    Along { direction: Vector, across: [Vector; 2], middle: [f64; 2], start: f64, stray: f64 },
}

/// The buffers of one source.
#[derive(Clone, Debug)]
pub(super) struct LightBuffer {
    view: View,
    /// Squares along an edge of each grid.
    side: usize,
    /// Those of the buffer, side after side of the cube, then those of divided squares.
    squares: Vec<Square>,
    entries: Vec<Entry>,
    facets: Vec<BufferFacet>,
}

impl LightBuffer {
    /// Bytes of its arrays.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.squares) + size_of_val(&*self.entries) + size_of_val(&*self.facets)
    }
}

/// Where a ray looks.
#[derive(Clone, Copy)]
struct Lookup {
    /// Which ray it is, which buffer has its beam, and which square of it the ray passes.
    index: u16,
    buffer: u16,
    square: u32,
    /// Place in the square.
    rest: [f64; 2],
    /// From distances along the ray to depths of the buffer.
    scale: f64,
    shift: f64,
    line: Line,
}

impl Lookup {
    const IDLE: Self = Self {
        index: 0,
        buffer: 0,
        square: 0,
        rest: [0.0; 2],
        scale: 1.0,
        shift: 0.0,
        line: Line { origin: [0.0; 3], shear: [0.0; 3], t_min: 0.0 },
    };
}

/// Rays that are looked up together.
const LOOKUP_BATCH: usize = 32;

impl View {
    /// The view of a beam; `None` where it is not finite, a direction is not of unit length, the mesh has no extent across it, or lies so
    /// far off that rounding would not be small against a square.
    fn from_beam(beam: &Beam, tree: &Tree) -> Option<Self> {
        match beam {
            Beam::Point(origin) => origin.is_finite().then(|| Self::Point(origin.to_array())),
            Beam::Collimated { origin, direction } => {
                let (x, y) = orthonormal_pair(*direction);
                let span = |axis: Vector| {
                    // The grid must hold the shadow of the whole mesh, which lies between those of its box's
                    // corners.
                    let along = tree.surroundings.bounds.corners().map(|p| p.dot(axis));
                    let (low, high) =
                        along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
                    (0.5 * (low + high), 0.5 * (high - low) * (1.0 + SPAN_ROOM))
                };
                // A little wider, so that a place on the border is not rounded out of the grid.
                let ((a, width), (b, height)) = (span(x), span(y));
                let half = width.max(height);
                // Rounding must stay small against a square.
                let fits = half > 0.0 && (a.abs() + b.abs()) < FARTHEST_MIDDLE * half && direction.is_normalized();
                let start = origin.dot(*direction);
                let stray = PLANE_ROOM * (start.abs() + half);
                let (across, middle) = ([x / half, y / half], [a / half, b / half]);
                (fits && origin.is_finite()).then_some(Self::Along {
                    direction: *direction,
                    across,
                    middle,
                    start,
                    stray,
                })
            }
        }
    }

    /// Whether it shows the rays of `other` too, whose starts may lie in their plane to within rounding.
    fn serves(&self, other: &Self) -> bool {
        match (self, other) {
            // The half of its room that is not for the starts of one source is for the planes of others.
            (
                Self::Along { direction, start, stray, .. },
                Self::Along { direction: other_direction, start: other_start, .. },
            ) => direction == other_direction && (start - other_start).abs() <= 0.5 * stray,
            _ => self == other,
        }
    }

    /// By point or direction, and then by depth: views that share a buffer follow one another.
    fn order(&self, other: &Self) -> Ordering {
        let key = |view: &Self| match view {
            Self::Point(origin) => (0, origin.map(f64::to_bits), 0.0),
            Self::Along { direction, start, .. } => (1, direction.to_array().map(f64::to_bits), *start),
        };
        let ((a, a_bits, a_start), (b, b_bits, b_start)) = (key(self), key(other));
        (a, a_bits).cmp(&(b, b_bits)).then(a_start.total_cmp(&b_start))
    }

    /// Number of grids: the six sides of a cube, or one.
    fn sides(&self) -> usize {
        if matches!(self, Self::Point(_)) { 6 } else { 1 }
    }

    /// Whether a ray that starts on no face is one of those that the buffer shows, by origin or by direction and plane.
    #[inline(always)]
    fn shows(&self, ray: &Ray) -> bool {
        match self {
            Self::Point(origin) => ray.origin.to_array() == *origin,
            Self::Along { direction, start, stray, .. } => {
                ray.direction == *direction && (ray.origin.dot(*direction) - start).abs() <= *stray
            }
        }
    }
}

/// Returns the views of the beams, each with the number of its rays: one for all beams that share a point, or a direction and a plane. The
/// one with most rays comes first.
fn shared_views(tree: &Tree, beams: &[(Beam, u64)]) -> Vec<(View, u64)> {
    let view = |(beam, rays): &(Beam, u64)| Some((View::from_beam(beam, tree)?, *rays));
    let mut views: Vec<_> = beams.iter().filter_map(view).collect();
    views.sort_by(|(a, _), (b, _)| a.order(b));
    views.dedup_by(|(next, rays), (first, all)| {
        let shared = first.serves(next);
        if shared {
            *all = all.saturating_add(*rays);
        }
        shared
    });
    views.sort_by_key(|(_, rays)| Reverse(*rays));
    views
}

/// Draws light buffers for the expected beams for which they pay, at most [`MOST_BUFFERS`]; takes those that `kept` has already, and
/// drops the rest of it.
pub(super) fn draw_expected(
    tree: &Tree,
    expected: &ExpectedRays<'_>,
    mut kept: Vec<LightBuffer>,
) -> Vec<LightBuffer> {
    let mut buffers: Vec<LightBuffer> = Vec::new();
    let facets = tree.surroundings.mesh.facets.len();
    if facets > MOST_FACETS {
        return buffers;
    }
    let views = shared_views(tree, expected.beams);
    let worth = views.into_iter().filter(|(_, rays)| rays / LEAST_RAYS_PER_FACET >= facets as u64);
    for (view, _) in worth.take(MOST_BUFFERS) {
        let drawn = kept.iter().position(|m| m.view == view).map(|k| kept.swap_remove(k));
        buffers.push(drawn.unwrap_or_else(|| raster::draw(tree.surroundings.mesh, view, expected.threads)));
    }
    buffers
}

impl LightBuffer {
    /// Fills `lookup` with the square that a ray passes; returns `false` when it passes all facets by, with a square of no meaning.
    /// Without closures, which would be compiled without the caller's instruction set.
    #[inline(always)]
    fn locate(&self, ray: &Ray, lookup: &mut Lookup) -> bool {
        let prepared = FacetRay::new(ray);
        lookup.line = prepared.line();
        let (side, [x, y], scale, shift) = match &self.view {
            View::Point(_) => {
                let [sx, sy, sz] = lookup.line.shear;
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
        // An index is always formed, if only to be thrown away: a branch on whether rays pass by cannot be
        // foretold.
        lookup.square = select_unpredictable(inside, (side * self.side + j) * self.side + i, 0) as u32;
        lookup.rest = [x - i as f64, y - j as f64];
        lookup.scale = scale;
        lookup.shift = shift;
        inside
    }

    /// The facets that the ray of a lookup may meet, the nearest first; empty where it meets none.
    #[inline(always)]
    fn entries(&self, lookup: &Lookup) -> &[Entry] {
        let mut square = self.squares[lookup.square as usize];
        let [mut x, mut y] = lookup.rest;
        // Four or so levels at most, and none for most squares.
        while square.count & DIVIDED != 0 {
            (x, y) = (x * DIVISIONS as f64, y * DIVISIONS as f64);
            let (i, j) = ((x as usize).min(DIVISIONS - 1), (y as usize).min(DIVISIONS - 1));
            (x, y) = (x - i as f64, y - j as f64);
            square = self.squares[square.first as usize + j * DIVISIONS + i];
        }
        &self.entries[square.first as usize..(square.first + square.count) as usize]
    }
}

/// The index of the buffer that shows a ray, `last` tried first; `None` where it leaves a face, its range does not begin at 0, or no
/// buffer has its source. `buffers` must not be empty.
#[inline(always)]
fn buffer_showing(buffers: &[LightBuffer], last: usize, ray: &Ray) -> Option<usize> {
    // A ray that leaves a face starts elsewhere, and one whose range begins later must not be told of facets
    // before.
    if ray.departure.is_some() | (ray.t_min != 0.0) {
        return None;
    }
    if buffers[last].view.shows(ray) {
        return Some(last);
    }
    // The rays of a batch mostly come from one source, so that this loop is rare.
    let mut k = 0;
    while k < buffers.len() {
        if buffers[k].view.shows(ray) {
            return Some(k);
        }
        k += 1;
    }
    None
}

/// Answers the rays that a buffer shows, and writes their `hits`; those that pass all facets by keep theirs. Returns the number of the
/// other rays, whose places are then the first of `rest`. There must be a buffer; rays are not counted.
#[inline(always)]
pub(super) fn answer<L: Lanes>(
    buffers: &[LightBuffer],
    rays: &[Ray],
    hits: &mut [Option<FacetHit>],
    rest: &mut [u16],
    cost: &mut Cost,
) -> usize {
    let mut others = 0;
    let mut next = 0;
    let mut last = 0;
    let mut lookups = [Lookup::IDLE; LOOKUP_BATCH];
    let mut edges = Edges::default();
    let mut found: [(&[Entry], u8); LOOKUP_BATCH] = [(&[], 0); LOOKUP_BATCH];
    while next < rays.len() {
        // In rounds, each of which asks for the memory that the next one needs: first squares, then entries,
        // facets, and at last the tests.
        let mut n = 0;
        while n < LOOKUP_BATCH && next < rays.len() {
            let ray = &rays[next];
            if let Some(buffer) = buffer_showing(buffers, last, ray) {
                last = buffer;
                let inside = buffers[buffer].locate(ray, &mut lookups[n]);
                lookups[n].index = next as u16;
                lookups[n].buffer = buffer as u16;
                prefetch(&buffers[buffer].squares, lookups[n].square as usize);
                n += usize::from(inside);
            } else {
                rest[others] = next as u16;
                others += 1;
            }
            next += 1;
        }
        // Which rays find nothing is not to be guessed.
        let mut full = 0;
        for (k, lookup) in lookups[..n].iter().enumerate() {
            let entries = buffers[usize::from(lookup.buffer)].entries(lookup);
            prefetch(entries, 0);
            found[full] = (entries, k as u8);
            full += usize::from(!entries.is_empty());
        }
        for (entries, k) in &found[..full] {
            let buffer = &buffers[usize::from(lookups[usize::from(*k) % LOOKUP_BATCH].buffer)];
            for entry in entries.iter().take(2) {
                prefetch(&buffer.facets, entry.facet as usize);
            }
        }
        for (entries, k) in &found[..full] {
            let lookup = &lookups[usize::from(*k) % LOOKUP_BATCH];
            let shown = &buffers[usize::from(lookup.buffer)].facets;
            let index = usize::from(lookup.index);
            let mut best = Nearest::up_to(rays[index].t_max);
            let mut first = 0;
            while first < entries.len() {
                // Entries are in order of depth: from here on all lie behind the hit.
                if f64::from(entries[first].near) > best.t * lookup.scale + lookup.shift {
                    break;
                }
                let other = entries.get(first + 1);
                cost.tests += 1 + u64::from(other.is_some());
                let one = &shown[entries[first].facet as usize];
                let other = other.map(|e| &shown[e.facet as usize]);
                pair::test_facet_pair::<L>(one, other, &lookup.line, &mut edges, &mut best);
                first += 2;
            }
            hits[index] = best.hit();
        }
    }
    others
}

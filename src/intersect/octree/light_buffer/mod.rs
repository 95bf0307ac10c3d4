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
mod squares;
mod view;

use super::facet_pair::Edges;
use super::lanes::Lanes;
use super::tree::Tree;
use crate::intersect::facet::{FacetHit, FacetRay, Line, Nearest};
use crate::intersect::prefetch::prefetch;
use crate::intersect::{Cost, ExpectedRays};
use crate::math::Ray;
use squares::Entry;
pub(super) use squares::LightBuffer;
use std::hint::select_unpredictable;
use view::{View, shared_views};

/// Rays for each facet from which on a light buffer pays: a facet costs some 5 µs to draw, and a ray that need not walk saves 0.06 µs.
const LEAST_RAYS_PER_FACET: u64 = 200;
/// Facets above which none is drawn: one takes 500 bytes for each.
const MOST_FACETS: usize = 1 << 18;
/// Most buffers that are kept.
const MOST_BUFFERS: usize = 16;
/// Rays that are looked up together.
const LOOKUP_BATCH: usize = 32;

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

    /// Takes the square of a buffer that a ray passes; returns `false` when it passes all facets by, with a square of no meaning. Without
    /// closures, which would be compiled without the caller's instruction set.
    #[inline(always)]
    fn locate(&mut self, buffer: &LightBuffer, ray: &Ray) -> bool {
        let prepared = FacetRay::new(ray);
        self.line = prepared.line();
        let (side, [x, y], scale, shift) = match &buffer.view {
            View::Point(_) => {
                let [sx, sy, sz] = self.line.shear;
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
        let n = buffer.side as f64;
        let (x, y) = ((0.5 * x + 0.5) * n, (0.5 * y + 0.5) * n);
        // False for NaN too.
        let inside = (x >= 0.0) & (x <= n) & (y >= 0.0) & (y <= n);
        let (i, j) = ((x as usize).min(buffer.side - 1), (y as usize).min(buffer.side - 1));
        // An index is always formed, if only to be thrown away: a branch on whether rays pass by cannot be
        // foretold.
        self.square = select_unpredictable(inside, (side * buffer.side + j) * buffer.side + i, 0) as u32;
        self.rest = [x - i as f64, y - j as f64];
        self.scale = scale;
        self.shift = shift;
        inside
    }
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

/// The index of the buffer that shows a ray, `last` tried first; `None` where it leaves a face, its range does not begin at 0, or no
/// buffer has its source. `buffers` must not be empty.
#[inline(always)]
fn buffer_showing(buffers: &[LightBuffer], last: usize, ray: &Ray) -> Option<usize> {
    // A ray that leaves a face starts elsewhere, and one whose range begins later must not be given facets
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
        // In rounds, each of which prefetches the memory that the next one needs: first squares, then entries,
        // facets, and at last the tests.
        let mut n = 0;
        while n < LOOKUP_BATCH && next < rays.len() {
            let ray = &rays[next];
            if let Some(buffer) = buffer_showing(buffers, last, ray) {
                last = buffer;
                let inside = lookups[n].locate(&buffers[buffer], ray);
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
            let entries = buffers[usize::from(lookup.buffer)].entries(lookup.square, lookup.rest);
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

//! The walk of a batch: [`WIDTH`] rays are under way, and all steps of a kind are done in a row, without branches that depend on a ray:
//! what the processor guesses wrong about a ray costs as much as a whole node. After a step the memory of the ray's next one is prefetched.

use super::facet_lanes::{FacetLanes, LANES, Verdict};
use super::lanes::Lanes;
use super::node::Link;
use super::ray::{Entry, SieveLimits};
use super::ray_stack::Children;
use super::ray_state::RayState;
use super::step_queues::{Rays, StepQueues, WIDTH, Ways};
use super::steps::{Arrays, prefetch_step, sift, test_with_care};
use super::tree::Tree;
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::intersect::prefetch::prefetch;
use crate::math::Ray;
use std::mem::take;

/// Rays before its start at which what a ray needs of the facet that it leaves is prefetched; it itself as many before.
const AHEAD: usize = 8;

/// Rays under way.
pub(super) type States<const STACK: usize> = [RayState<STACK>; WIDTH];

/// Walks the rays of a batch whose places are in `order`, all steps of a kind in a row, and writes their hits; other entries of `hits`
/// stay, and so may those of rays without one.
#[inline(always)]
pub(super) fn walk_batch<L: Lanes, const STACK: usize>(
    tree: &Tree,
    root: Link,
    states: &mut States<STACK>,
    (rays, order): (&[Ray], &[u16]),
    hits: &mut [Option<FacetHit>],
    cost: &mut Cost,
) {
    let arrays = Arrays::new(tree);
    let mut queues = StepQueues::default();
    let mut lanes = FacetLanes::new();
    let (mut entries, mut met) = ([Entry::IDLE; WIDTH], [0; WIDTH]);
    let mut limits = [SieveLimits::default(); WIDTH];
    let mut live = order.len().min(WIDTH);
    let mut next = live;
    // As many as fit are under way; a ray that ends hands its place to the next.
    let mut ways = Ways::default();
    for (ray, (state, &place)) in states.iter_mut().zip(order).enumerate().take(live) {
        let place = usize::from(place);
        state.start::<L>(tree, root, &rays[place], place);
        ways.note(ray, state.next);
    }
    queues.put(Rays::first(live), &ways);
    while live > 0 {
        let entering = take(&mut queues.node);
        cost.nodes += entering.count() as u64;
        let ways = enter_nodes::<L, STACK>(&arrays, states, entering, (&mut entries, &mut met));
        queues.put(entering, &ways);
        // Here, not last: a ray that is started and whose first node is visited at once waits until what was written of it has left the
        // processor's store buffer, which took an eighth of the walk.
        let (mut started, mut ways) = (Rays::default(), Ways::default());
        for ray in take(&mut queues.end) {
            let s = &mut states[ray];
            hits[s.index] = s.best.hit();
            if start_next::<L, STACK>(tree, root, s, (rays, order), &mut next) {
                started.add_if(true, ray);
                ways.note(ray, s.next);
            } else {
                live -= 1;
            }
        }
        queues.put(started, &ways);
        let sifting = take(&mut queues.block);
        for ray in sifting {
            let s = &states[ray];
            limits[ray] = L::sieve_limits(&arrays.blocks[s.next.index()], &s.sieve, &s.boxes);
        }
        let mut ways = Ways::default();
        let mut tests = 0;
        for ray in sifting {
            let s = &mut states[ray];
            // The sieve knows rounded corners only; the true ones of what it leaves are prefetched first.
            let (index, count) = (s.next.index(), s.next.facets());
            tests += count as u64;
            s.block = index as u32;
            s.candidates = sift::<L, STACK>(&arrays.blocks[index], count, s, &limits[ray]);
            s.advance::<L>(Children::NONE);
            prefetch_step(&arrays, s.next);
            queues.corners.add_if(s.candidates != 0, ray);
            ways.note(ray, s.next);
        }
        cost.tests += tests;
        queues.put(sifting.without(queues.corners), &ways);
        test_waiting::<L, STACK>(tree, &arrays, states, &mut queues, &mut lanes);
        queues.exact.0 |= queues.corners.0;
        for ray in take(&mut queues.corners) {
            prefetch_corners(&arrays, &states[ray]);
        }
    }
}

/// Enters the next nodes of some rays, with room for what they are against them and for which children they meet, and notes where they go
/// on to.
#[inline(always)]
fn enter_nodes<'t, L: Lanes, const STACK: usize>(
    arrays: &Arrays<'t>,
    states: &mut States<STACK>,
    entering: Rays,
    (entries, met): (&mut [Entry<'t>; WIDTH], &mut [u32; WIDTH]),
) -> Ways {
    for ray in entering {
        let s = &states[ray];
        L::prepare(&mut entries[ray], &arrays.nodes[s.next.index()], &s.boxes);
    }
    for ray in entering {
        met[ray] = states[ray].enter::<L>(&entries[ray]);
    }
    let mut ways = Ways::default();
    for ray in entering {
        let s = &mut states[ray];
        let children = Children::new(&entries[ray], met[ray]);
        s.advance::<L>(children);
        prefetch_step(arrays, s.next);
        ways.note(ray, s.next);
    }
    ways
}

/// Starts in a free place the first ray from `next` on that does not pass by the mesh; `false` where none is left. What passes by is
/// answered at once, and leaves no hit: most rays of a source that shines all around do.
#[inline(always)]
fn start_next<L: Lanes, const STACK: usize>(
    tree: &Tree,
    root: Link,
    s: &mut RayState<STACK>,
    (rays, order): (&[Ray], &[u16]),
    next: &mut usize,
) -> bool {
    while let Some(&place) = order.get(*next) {
        let place = usize::from(place);
        // Long before its turn, for neither a ray nor what is known of the facet that it leaves is in the cache.
        if let Some(&place) = order.get(*next + 2 * AHEAD) {
            prefetch(rays, usize::from(place));
        }
        if let Some(from) = order.get(*next + AHEAD).and_then(|&place| rays[usize::from(place)].departure) {
            prefetch(&tree.slopes, from.primitive as usize);
        }
        s.start::<L>(tree, root, &rays[place], place);
        *next += 1;
        if s.next != Link::END {
            return true;
        }
    }
    false
}

/// Prefetches the memory of the corners of the facets that the sieve left, at least one; nearly always it is one.
#[inline(always)]
fn prefetch_corners<const STACK: usize>(arrays: &Arrays, s: &RayState<STACK>) {
    let block = &arrays.blocks[s.block as usize];
    let mut mask = (s.candidates | s.candidates >> 4) & 15;
    loop {
        let k = (mask.trailing_zeros() & 3) as usize;
        mask &= mask.wrapping_sub(1);
        for p in block.positions[k] {
            prefetch(arrays.positions, p as usize);
        }
        if mask == 0 {
            return;
        }
    }
}

/// Does the exact tests of rays that wait for one, eight at once, as long as others have something to do meanwhile, and sets for the rays
/// what is next.
#[inline(always)]
fn test_waiting<L: Lanes, const STACK: usize>(
    tree: &Tree,
    arrays: &Arrays,
    states: &mut States<STACK>,
    queues: &mut StepQueues,
    lanes: &mut FacetLanes,
) {
    loop {
        let waiting = queues.exact.count();
        if waiting < LANES && (waiting == 0 || queues.node.0 | queues.block.0 != 0) {
            return;
        }
        // The first eight.
        let mut later = queues.exact;
        for _ in 0..LANES {
            later.next();
        }
        let tested = queues.exact.without(later);
        queues.exact = later;
        test_in_lanes(tree, arrays, states, tested, lanes);
        let mut ways = Ways::default();
        for ray in tested {
            let s = &mut states[ray];
            s.limit_to_hit();
            // What was next may lie beyond the new hit. Where more is to be tested it stays next.
            s.recheck_next::<L>();
            prefetch_step(arrays, s.next);
            queues.exact.add_if(s.candidates != 0, ray);
            ways.note(ray, s.next);
        }
        queues.put(tested.without(queues.exact), &ways);
    }
}

/// Tests one facet that the sieve left for each of some rays, at most [`LANES`], in f64, and keeps the nearest hits; what is left in the
/// rays' candidates is still to be tested.
#[inline(always)]
fn test_in_lanes<const STACK: usize>(
    tree: &Tree,
    arrays: &Arrays,
    states: &mut States<STACK>,
    tested: Rays,
    lanes: &mut FacetLanes,
) {
    let mut lane_facets = [(0, 0); LANES];
    for (lane, ray) in tested.enumerate().take(LANES) {
        let s = &mut states[ray];
        let block = &arrays.blocks[s.block as usize];
        let k = ((s.candidates | s.candidates >> 4).trailing_zeros() & 3) as usize;
        let triangles = block.triangles(k, s.candidates);
        let corners = block.positions[k].map(|p| arrays.positions[p as usize].as_ref());
        lanes.put(lane, (block.facets[k], triangles, corners), &s.facets, (s.departed, &s.best));
        s.candidates &= !(0x11 << k);
        lane_facets[lane] = (k, triangles);
    }
    lanes.test(tree.surroundings.reach);
    for (lane, ray) in tested.enumerate().take(LANES) {
        let s = &mut states[ray];
        let (k, triangles) = lane_facets[lane];
        let block = &arrays.blocks[s.block as usize];
        let verdict = lanes.verdict(lane);
        if verdict & Verdict::CARE != 0 {
            let corners = block.positions[k].map(|p| &arrays.positions[p as usize]);
            test_with_care(tree, s, block.facets[k], triangles, corners);
        } else {
            s.best.keep_if(verdict & Verdict::HIT != 0, lanes.hit(lane, block.facets[k]));
        }
    }
}

//! The walk, written once for all instruction sets.
//!
//! Each step of a ray is one node, the sifting of one block, or the exact test of what the sieve left. A batch keeps
//! [`WIDTH`] rays under way and does all steps of one kind in a row, without branches that depend on a ray: what the
//! processor guesses wrong about a ray costs as much as a whole node. After a step the ray asks for the memory of its next one.

use super::facet_lanes::{FacetLanes, LANES, Verdict};
use super::lanes::Lanes;
use super::light_buffer::{self, LightBuffer};
use super::node::{Block, Link, Node, Target};
use super::ray_state::{Children, RayState, stack_places};
use super::step_queues::{BLOCK, CORNERS, END, EXACT, NODE, Queue, StepQueues, WIDTH};
use super::tree::Tree;
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::intersect::prefetch::{prefetch, prefetch_either};
use crate::math::{Point, Ray};
use std::cell::RefCell;
use std::hint::select_unpredictable;
use std::thread::LocalKey;

/// Rays walked before their hits are described: 16 rays that end late cost 2 % of it.
pub(super) const BATCH: usize = 512;

/// Rays before its start at which what a ray needs of the facet that it leaves is asked for; it itself as many before.
const AHEAD: usize = 8;

/// Rays under way.
type States<const STACK: usize> = [RayState<STACK>; WIDTH];

/// Levels of nodes up to which a tree is shallow, as nearly all are: its stacks take few pages of memory, which a walk is 4 % faster by.
const SHALLOW: usize = 8;
/// Levels of nodes that no tree goes beyond: 32 of cells and 30 of packing, less the one that both share.
const DEEPEST: usize = 64;

/// Where a thread keeps states from one walk to the next.
type KeptStates<const STACK: usize> = LocalKey<RefCell<Option<Box<States<STACK>>>>>;

thread_local! {
    static SHALLOW_STATES: RefCell<Option<Box<States<{ stack_places(SHALLOW) }>>>> = const { RefCell::new(None) };
    static DEEP_STATES: RefCell<Option<Box<States<{ stack_places(DEEPEST) }>>>> = const { RefCell::new(None) };
}

/// Allocates states without rays. Not inlined: its frame of 100 kB and more would be probed page by page at each walk.
#[cold]
#[inline(never)]
fn idle_states<const STACK: usize>() -> Box<States<STACK>> {
    let states: Vec<RayState<STACK>> = (0..WIDTH).map(|_| RayState::idle()).collect();
    match states.try_into() {
        Ok(states) => states,
        Err(_) => unreachable!("as many as asked for"),
    }
}

/// Finds the nearest hit of each ray and overwrites `hits`, which is as long as `rays`; `None` for a miss. `light_buffers`, which may be
/// empty, answer batches only, never a single ray.
#[inline(always)]
pub(super) fn walk<L: Lanes>(
    tree: &Tree,
    light_buffers: &[LightBuffer],
    rays: &[Ray],
    hits: &mut [Option<FacetHit>],
    cost: &mut Cost,
) {
    cost.rays += rays.len() as u64;
    hits.fill(None);
    let Some(root) = tree.root else { return };
    if tree.levels <= SHALLOW {
        walk_with::<L, _>((tree, root), &SHALLOW_STATES, light_buffers, (rays, hits), cost);
    } else {
        walk_with::<L, _>((tree, root), &DEEP_STATES, light_buffers, (rays, hits), cost);
    }
}

/// As [`walk`], from the root, with the states that a thread keeps.
#[inline(always)]
fn walk_with<L: Lanes, const STACK: usize>(
    (tree, root): (&Tree, Link),
    kept: &'static KeptStates<STACK>,
    light_buffers: &[LightBuffer],
    (rays, hits): (&[Ray], &mut [Option<FacetHit>]),
    cost: &mut Cost,
) {
    // Taken out, not borrowed by a closure: a closure would be compiled without the caller's instruction set.
    let mut states = kept.take().unwrap_or_else(idle_states);
    if let [ray] = rays {
        let state = &mut states[0];
        state.start(tree, root, ray, 0);
        walk_one::<L, STACK>(tree, state, cost);
        hits[0] = state.best.hit();
    } else {
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            let mut order: [u16; BATCH] = std::array::from_fn(|i| i as u16);
            let walkers = if light_buffers.is_empty() {
                rays.len()
            } else {
                light_buffer::answer::<L>(light_buffers, rays, hits, &mut order, cost)
            };
            walk_batch::<L, STACK>(tree, root, &mut states, (rays, &order[..walkers]), hits, cost);
        }
    }
    kept.set(Some(states));
}

/// The arrays of a tree. Read once for many rays: that writing the state of a ray leaves where they lie as it was is more than a
/// compiler can tell.
#[derive(Clone, Copy)]
struct Arrays<'t> {
    nodes: &'t [Node],
    blocks: &'t [Block],
    positions: &'t [Point],
}

impl<'t> Arrays<'t> {
    #[inline(always)]
    fn new(tree: &'t Tree) -> Self {
        Self { nodes: &tree.nodes, blocks: &tree.blocks, positions: &tree.surroundings.mesh.positions }
    }
}

/// Walks one ray that was started to its end; its hit is in `s.best`.
#[inline(always)]
fn walk_one<L: Lanes, const STACK: usize>(tree: &Tree, s: &mut RayState<STACK>, cost: &mut Cost) {
    let arrays = Arrays::new(tree);
    loop {
        match s.next.target() {
            Target::Node(index) => {
                cost.nodes += 1;
                // Two at a time: one waits for its memory and its own arithmetic most of the time, and the second is mostly needed.
                if let Some(second) = s.take_open_node() {
                    cost.nodes += 1;
                    let children = s.enter::<L>(&arrays.nodes[second]);
                    s.keep_all(children);
                }
                let children = s.enter::<L>(&arrays.nodes[index]);
                s.next = if children.count > 0 { s.take_nearest(children) } else { s.pop(s.boxes.t_max) };
                prefetch_step(arrays, s.next);
                prefetch_step(arrays, s.peek());
            }
            Target::Block(index, count) => {
                cost.tests += count as u64;
                s.block = index as u32;
                s.candidates = sift::<L, STACK>(&arrays.blocks[index], s) & used_lanes(count);
                if s.candidates != 0 {
                    test_candidates::<L, STACK>(tree, arrays, s);
                }
                s.next = s.pop(s.boxes.t_max);
            }
            Target::End => return,
        }
    }
}

/// Walks the rays of a batch whose places are in `order`, all steps of a kind in a row, and writes their hits; other entries of `hits`
/// stay.
#[inline(always)]
fn walk_batch<L: Lanes, const STACK: usize>(
    tree: &Tree,
    root: Link,
    states: &mut States<STACK>,
    (rays, order): (&[Ray], &[u16]),
    hits: &mut [Option<FacetHit>],
    cost: &mut Cost,
) {
    let arrays = Arrays::new(tree);
    let mut queues = StepQueues::EMPTY;
    let mut lanes = FacetLanes::new();
    let mut live = order.len().min(WIDTH);
    let mut next = live;
    // As many as fit are under way; whoever ends hands its place to the next.
    for (ray, (state, &place)) in states.iter_mut().zip(order).enumerate().take(live) {
        let place = usize::from(place);
        state.start(tree, root, &rays[place], place);
        queues.put(state.next.kind(), ray as u8);
    }
    while live > 0 {
        let queue = queues.take(NODE);
        cost.nodes += queue.count as u64;
        for &ray in queue.rays() {
            let s = &mut states[usize::from(ray) % WIDTH];
            let children = s.enter::<L>(&arrays.nodes[s.next.as_node()]);
            s.next = s.advance::<L>(children);
            prefetch_step(arrays, s.next);
            queues.put(s.next.kind(), ray);
        }
        // Here, not last: a ray that is started and at once asked for its first node waits until what was written of it has left the
        // processor's store buffer, which took an eighth of the walk.
        let queue = queues.take(END);
        for &ray in queue.rays() {
            let s = &mut states[usize::from(ray) % WIDTH];
            hits[s.index] = s.best.hit();
            if let Some(&place) = order.get(next) {
                let place = usize::from(place);
                // Long before its turn, for neither a ray nor what is known of the facet that it leaves is in the cache.
                if let Some(&place) = order.get(next + 2 * AHEAD) {
                    prefetch(rays, usize::from(place));
                }
                if let Some(from) = order.get(next + AHEAD).and_then(|&place| rays[usize::from(place)].departure) {
                    prefetch(&tree.slopes, from.primitive as usize);
                }
                s.start(tree, root, &rays[place], place);
                queues.put(s.next.kind(), ray);
                next += 1;
            } else {
                live -= 1;
            }
        }
        let queue = queues.take(BLOCK);
        for &ray in queue.rays() {
            let s = &mut states[usize::from(ray) % WIDTH];
            // The sieve knows rounded corners only; what it leaves asks for its true ones first.
            let (index, count) = s.next.as_block();
            cost.tests += count as u64;
            s.block = index as u32;
            s.candidates = sift::<L, STACK>(&arrays.blocks[index], s) & used_lanes(count);
            s.next = s.advance::<L>(Children::NONE);
            prefetch_step(arrays, s.next);
            queues.put(select_unpredictable(s.candidates != 0, CORNERS, s.next.kind()), ray);
        }
        test_waiting::<L, STACK>(tree, arrays, states, &mut queues, &mut lanes);
        let queue = queues.take(CORNERS);
        for &ray in queue.rays() {
            let s = &states[usize::from(ray) % WIDTH];
            prefetch_corners(arrays, s);
            queues.put(EXACT, ray);
        }
    }
}

/// Returns the triangles of a block that the ray may meet, bits as in [`Lanes::sift`], without those of the facet that it leaves and is
/// known not to meet.
#[inline(always)]
fn sift<L: Lanes, const STACK: usize>(block: &Block, s: &RayState<STACK>) -> u32 {
    let mut own = 0;
    for k in 0..4 {
        own |= u32::from(block.facets[k] == s.unmet_facet) << k;
    }
    L::sift(block, &s.sieve, &s.boxes) & !(own * 0x11)
}

/// The bits of both triangles of the first `count` lanes of a block.
#[inline(always)]
fn used_lanes(count: usize) -> u32 {
    ((1 << count) - 1) * 0x11
}

/// Asks for the memory of a node or block; at the end for the first block.
#[inline(always)]
fn prefetch_step(arrays: Arrays, link: Link) {
    let block = select_unpredictable(link == Link::END, 0, link.as_block().0);
    prefetch_either(link.kind() != NODE, (arrays.blocks, block), (arrays.nodes, link.as_node()));
}

/// Asks for the memory of the corners of the facets that the sieve left, at least one; nearly always it is one.
#[inline(always)]
fn prefetch_corners<const STACK: usize>(arrays: Arrays, s: &RayState<STACK>) {
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

/// Does the exact tests of rays that wait for one, eight at once, as long as others have something to do meanwhile, and tells the rays what
/// is next.
#[inline(always)]
fn test_waiting<L: Lanes, const STACK: usize>(
    tree: &Tree,
    arrays: Arrays,
    states: &mut States<STACK>,
    queues: &mut StepQueues,
    lanes: &mut FacetLanes,
) {
    loop {
        let waiting = queues.count(EXACT);
        if waiting < LANES && (waiting == 0 || queues.count(NODE) + queues.count(BLOCK) > 0) {
            return;
        }
        let queue = queues.take_last(EXACT, LANES);
        test_in_lanes(tree, arrays, states, &queue, lanes);
        for &ray in queue.rays() {
            let s = &mut states[usize::from(ray) % WIDTH];
            s.limit_to_hit();
            if s.candidates != 0 {
                queues.put(EXACT, ray);
                continue;
            }
            // What was next may lie beyond the new hit.
            s.recheck_next::<L>();
            prefetch_step(arrays, s.next);
            queues.put(s.next.kind(), ray);
        }
    }
}

/// Tests one facet that the sieve left for each ray of a queue, at most [`LANES`], in f64, and keeps the nearest hits; what is left in the
/// rays' candidates is still to be tested.
#[inline(always)]
fn test_in_lanes<const STACK: usize>(
    tree: &Tree,
    arrays: Arrays,
    states: &mut States<STACK>,
    queue: &Queue,
    lanes: &mut FacetLanes,
) {
    let mut asked = [(0, 0); LANES];
    for (lane, &ray) in queue.rays().iter().enumerate().take(LANES) {
        let s = &mut states[usize::from(ray) % WIDTH];
        let block = &arrays.blocks[s.block as usize];
        let k = ((s.candidates | s.candidates >> 4).trailing_zeros() & 3) as usize;
        let triangles = block.triangles(k, s.candidates);
        let corners = block.positions[k].map(|p| arrays.positions[p as usize].as_ref());
        lanes.put(lane, (block.facets[k], triangles, corners), (&s.quads, s.sieve.axes), (s.departed, &s.best));
        s.candidates &= !(0x11 << k);
        asked[lane] = (k, triangles);
    }
    lanes.test(tree.surroundings.reach);
    for (lane, &ray) in queue.rays().iter().enumerate().take(LANES) {
        let s = &mut states[usize::from(ray) % WIDTH];
        let (k, triangles) = asked[lane];
        let block = &arrays.blocks[s.block as usize];
        let verdict = lanes.verdict(lane);
        if verdict & Verdict::CARE != 0 {
            let corners = block.positions[k].map(|p| &arrays.positions[p as usize]);
            test_with_care(tree, s, block.facets[k], triangles, corners);
        } else if verdict & Verdict::HIT != 0 {
            s.best.keep_nearer(lanes.hit(lane, block.facets[k]));
        }
    }
}

/// Tests the triangles that the sieve left in f64, keeps the nearest hit and limits the boxes to it. There must be at least one.
#[inline(always)]
fn test_candidates<L: Lanes, const STACK: usize>(tree: &Tree, arrays: Arrays, s: &mut RayState<STACK>) {
    let block = &arrays.blocks[s.block as usize];
    let candidates = s.candidates;
    let mut mask = (candidates | candidates >> 4) & 15;
    loop {
        let k = (mask.trailing_zeros() & 3) as usize;
        mask &= mask.wrapping_sub(1);
        let corners = block.positions[k].map(|p| &arrays.positions[p as usize]);
        let triangles = block.triangles(k, candidates);
        let facet = block.facets[k];
        let arrays = [corners[0].as_ref(), corners[1].as_ref(), corners[2].as_ref(), corners[3].as_ref()];
        let edges = L::quad_edges(arrays, &s.quads);
        // Often the facet is the one that the ray leaves, or a neighbour of it, and passed by far from the start.
        if ((s.departed != u32::MAX) & edges.near) | (s.departed == facet) {
            if !edges.misses_clearly(triangles, arrays, &s.quads) {
                test_with_care(tree, s, facet, triangles, corners);
            }
        } else if !edges.keep_hits(facet, triangles, &s.quads, &mut s.best) {
            test_with_care(tree, s, facet, triangles, corners);
        }
        if mask == 0 {
            break;
        }
    }
    s.limit_to_hit();
}

/// Tests a facet by [`crate::intersect::facet::FacetRay::test`], where more than the signs of its edge functions decides.
#[cold]
#[inline(never)]
fn test_with_care<const STACK: usize>(
    tree: &Tree,
    s: &mut RayState<STACK>,
    facet: u32,
    triangles: u32,
    corners: [&Point; 4],
) {
    s.facets.test(facet, triangles, corners, &tree.surroundings, &mut s.best);
}

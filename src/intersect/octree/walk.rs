//! The walk, written once for all instruction sets.
//!
//! Each step of a ray is one node, the sifting of one block, or the exact test of what the sieve left. A batch keeps
//! [`WIDTH`] rays under way and does all steps of one kind in a row, without branches that depend on a ray: what the
//! processor guesses wrong about a ray costs as much as a whole node. After a step the ray asks for the memory of its next one.

use super::facet_lanes::{FacetLanes, LANES, Verdict};
use super::lanes::Lanes;
use super::light_buffer::{self, LightBuffer};
use super::node::{Block, Link, Node, Target};
use super::ray_stack::{Children, stack_places};
use super::ray_state::RayState;
use super::step_queues::{Rays, StepQueues, WIDTH, Ways};
use super::tree::Tree;
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::intersect::prefetch::{prefetch, prefetch_lines};
use crate::math::{Point, Ray};
use std::cell::RefCell;
use std::mem::take;
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
    /// Where the nodes or blocks begin that a link leads to, by its kind; at the end of a ray any.
    starts: [*const u8; 4],
}

impl<'t> Arrays<'t> {
    #[inline(always)]
    fn new(tree: &'t Tree) -> Self {
        let (nodes, blocks) = (tree.nodes.as_ptr().cast(), tree.blocks.as_ptr().cast());
        Self {
            nodes: &tree.nodes,
            blocks: &tree.blocks,
            positions: &tree.surroundings.mesh.positions,
            starts: [nodes, nodes, blocks, nodes],
        }
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
                if let Some(second) = s.stack.take_open_node(s.boxes.t_max) {
                    cost.nodes += 1;
                    let children = s.enter::<L>(&arrays.nodes[second.index()]);
                    s.stack.keep_all(children);
                }
                let children = s.enter::<L>(&arrays.nodes[index]);
                s.next =
                    if children.count > 0 { s.stack.take_nearest(children) } else { s.stack.pop(s.boxes.t_max) };
                prefetch_step(&arrays, s.next);
                prefetch_step(&arrays, s.stack.peek());
            }
            Target::Block(index, count) => {
                cost.tests += count as u64;
                s.block = index as u32;
                s.candidates = sift::<L, STACK>(&arrays.blocks[index], count, s);
                if s.candidates != 0 {
                    test_candidates::<L, STACK>(tree, &arrays, s);
                }
                s.next = s.stack.pop(s.boxes.t_max);
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
    let mut queues = StepQueues::default();
    let mut lanes = FacetLanes::new();
    let mut live = order.len().min(WIDTH);
    let mut next = live;
    // As many as fit are under way; whoever ends hands its place to the next.
    let mut ways = Ways::default();
    for (ray, (state, &place)) in states.iter_mut().zip(order).enumerate().take(live) {
        let place = usize::from(place);
        state.start(tree, root, &rays[place], place);
        ways.note(ray, state.next);
    }
    queues.put(&ways);
    while live > 0 {
        let entering = take(&mut queues.node);
        cost.nodes += entering.count() as u64;
        let mut ways = Ways::default();
        for ray in entering {
            let s = &mut states[ray];
            let children = s.enter::<L>(&arrays.nodes[s.next.index()]);
            s.advance::<L>(children);
            prefetch_step(&arrays, s.next);
            ways.note(ray, s.next);
        }
        queues.put(&ways);
        // Here, not last: a ray that is started and at once asked for its first node waits until what was written of it has left the
        // processor's store buffer, which took an eighth of the walk.
        let mut ways = Ways::default();
        for ray in take(&mut queues.end) {
            let s = &mut states[ray];
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
                ways.note(ray, s.next);
                next += 1;
            } else {
                live -= 1;
            }
        }
        queues.put(&ways);
        let mut ways = Ways::default();
        let mut tests = 0;
        for ray in take(&mut queues.block) {
            let s = &mut states[ray];
            // The sieve knows rounded corners only; what it leaves asks for its true ones first.
            let (index, count) = (s.next.index(), s.next.facets());
            tests += count as u64;
            s.block = index as u32;
            s.candidates = sift::<L, STACK>(&arrays.blocks[index], count, s);
            s.advance::<L>(Children::NONE);
            prefetch_step(&arrays, s.next);
            queues.corners.add_if(s.candidates != 0, ray);
            ways.note_if(s.candidates == 0, ray, s.next);
        }
        cost.tests += tests;
        queues.put(&ways);
        test_waiting::<L, STACK>(tree, &arrays, states, &mut queues, &mut lanes);
        queues.exact.0 |= queues.corners.0;
        for ray in take(&mut queues.corners) {
            prefetch_corners(&arrays, &states[ray]);
        }
    }
}

/// Returns the triangles of a block of `count` facets that the ray may meet, bits as in [`Lanes::sift`], without those of the facet that it
/// leaves and is known not to meet.
#[inline(always)]
fn sift<L: Lanes, const STACK: usize>(block: &Block, count: usize, s: &RayState<STACK>) -> u32 {
    L::sift(block, &s.sieve, &s.boxes, s.unmet_facet) & used_lanes(count)
}

/// The bits of both triangles of the first `count` lanes of a block.
#[inline(always)]
fn used_lanes(count: usize) -> u32 {
    ((1 << count) - 1) * 0x11
}

/// Asks for the memory of a node or block, three lines of the cache each; at the end for the first node.
#[inline(always)]
fn prefetch_step(arrays: &Arrays, link: Link) {
    const { assert!(size_of::<Node>() == size_of::<Block>(), "one stride for both") };
    let start = arrays.starts[link.kind()].wrapping_add(link.index() * size_of::<Node>());
    prefetch_lines::<{ size_of::<Node>() / 64 }>(start);
}

/// Asks for the memory of the corners of the facets that the sieve left, at least one; nearly always it is one.
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

/// Does the exact tests of rays that wait for one, eight at once, as long as others have something to do meanwhile, and tells the rays what
/// is next.
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
        let tested = Rays(queues.exact.0 & !later.0);
        queues.exact = later;
        test_in_lanes(tree, arrays, states, tested, lanes);
        let mut ways = Ways::default();
        for ray in tested {
            let s = &mut states[ray];
            s.limit_to_hit();
            if s.candidates != 0 {
                queues.exact.add_if(true, ray);
                continue;
            }
            // What was next may lie beyond the new hit.
            s.recheck_next::<L>();
            prefetch_step(arrays, s.next);
            ways.note(ray, s.next);
        }
        queues.put(&ways);
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
    let mut asked = [(0, 0); LANES];
    for (lane, ray) in tested.enumerate().take(LANES) {
        let s = &mut states[ray];
        let block = &arrays.blocks[s.block as usize];
        let k = ((s.candidates | s.candidates >> 4).trailing_zeros() & 3) as usize;
        let triangles = block.triangles(k, s.candidates);
        let corners = block.positions[k].map(|p| arrays.positions[p as usize].as_ref());
        lanes.put(lane, (block.facets[k], triangles, corners), &s.facets, (s.departed, &s.best));
        s.candidates &= !(0x11 << k);
        asked[lane] = (k, triangles);
    }
    lanes.test(tree.surroundings.reach);
    for (lane, ray) in tested.enumerate().take(LANES) {
        let s = &mut states[ray];
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
fn test_candidates<L: Lanes, const STACK: usize>(tree: &Tree, arrays: &Arrays, s: &mut RayState<STACK>) {
    let block = &arrays.blocks[s.block as usize];
    let (candidates, reach) = (s.candidates, tree.surroundings.reach);
    let mut mask = (candidates | candidates >> 4) & 15;
    loop {
        let k = (mask.trailing_zeros() & 3) as usize;
        mask &= mask.wrapping_sub(1);
        let corners = block.positions[k].map(|p| &arrays.positions[p as usize]);
        let triangles = block.triangles(k, candidates);
        let facet = block.facets[k];
        let arrays = [corners[0].as_ref(), corners[1].as_ref(), corners[2].as_ref(), corners[3].as_ref()];
        let edges = L::quad_edges(arrays, &s.facets, reach);
        // Often the facet is the one that the ray leaves, or a neighbour of it, and passed by far from the start.
        if ((s.departed != u32::MAX) & edges.near) | (s.departed == facet) {
            if !edges.misses_clearly(triangles, arrays, &s.facets, reach) {
                test_with_care(tree, s, facet, triangles, corners);
            }
        } else if !edges.keep_hits(facet, triangles, &s.facets, &mut s.best) {
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

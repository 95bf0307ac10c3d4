//! The walk, written once for all instruction sets.
//!
//! Each step of a ray is one node, the sifting of one block, or the exact test of what the sieve left.

use super::batch_walk::{States, walk_batch};
use super::lanes::Lanes;
use super::light_buffer::{self, LightBuffer};
use super::node::{Link, Node, Target};
use super::ray::Entry;
use super::ray_stack::{Children, stack_places};
use super::ray_state::RayState;
use super::step_queues::WIDTH;
use super::steps::{Arrays, prefetch_step, sift, test_with_care};
use super::tree::{DEEPEST, Tree};
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::math::Ray;
use std::cell::RefCell;
use std::thread::LocalKey;

/// Rays walked before their hits are described: 16 rays that end late cost 2 % of it.
pub(super) const BATCH: usize = 512;

/// Levels of nodes up to which a tree is shallow, as nearly all are: its stacks take few pages of memory, which a walk is 4 % faster by.
const SHALLOW: usize = 8;

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
        Err(_) => unreachable!("as many as requested"),
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
        state.start::<L>(tree, root, ray, 0);
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
                    let children = enter::<L, STACK>(s, &arrays.nodes[second.index()]);
                    s.stack.keep_all(children);
                }
                let children = enter::<L, STACK>(s, &arrays.nodes[index]);
                s.next =
                    if children.count > 0 { s.stack.take_nearest(children) } else { s.stack.pop(s.boxes.t_max) };
                prefetch_step(&arrays, s.next);
                prefetch_step(&arrays, s.stack.peek());
            }
            Target::Block(index, count) => {
                cost.tests += count as u64;
                s.block = index as u32;
                let block = &arrays.blocks[index];
                s.candidates = sift::<L, STACK>(block, count, s, &L::sieve_limits(block, &s.sieve, &s.boxes));
                if s.candidates != 0 {
                    test_candidates::<L, STACK>(tree, &arrays, s);
                }
                s.next = s.stack.pop(s.boxes.t_max);
            }
            Target::End => return,
        }
    }
}

/// Writes the children of a node that a ray may meet above the top of its stack, and returns them.
#[inline(always)]
fn enter<L: Lanes, const STACK: usize>(s: &mut RayState<STACK>, node: &Node) -> Children {
    let mut entry = Entry::IDLE;
    L::prepare(&mut entry, node, &s.boxes);
    Children::new(&entry, s.enter::<L>(&entry))
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

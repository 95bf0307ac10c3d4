//! The walk, written once for all instruction sets.
//!
//! Each step of a ray is one node, the sifting of one block, or the exact test of what the sieve left. A batch keeps
//! [`WIDTH`] rays under way and does all steps of one kind in a row, without branches that depend on a ray: what the
//! processor guesses wrong about a ray costs as much as a whole node. After a step the ray asks for the memory of its next one.

use super::light::pair::{Corners, Edges};
use super::node::{Block, Link, Node, Target};
use super::state::{BoxRay, SiftRay, State};
use super::{BATCH, Octree, light};
use crate::intersect::Cost;
use crate::intersect::facet::{FacetHit, Line};
use crate::intersect::prefetch::{prefetch, prefetch_either};
use crate::math::Ray;
use std::cell::RefCell;
use std::hint::select_unpredictable;
use std::sync::PoisonError;

/// Rays under way at a time.
pub(super) const WIDTH: usize = 32;

/// Rays before its start at which what a ray needs of the facet that it leaves is asked for.
const AHEAD: usize = 8;

/// What is done eight at a time. Implementations may round differently: boxes and sieve keep more than needed.
pub(super) trait Lanes {
    /// Where the ray enters the children that it may meet before `t_max`, and their links, the farthest first; gives
    /// their number. What lies beyond it is of no meaning. `ALONE` is for a ray that nothing else is done beside: it
    /// rather guesses that one child is met than wait for a network to sort it.
    fn enter<const ALONE: bool>(node: &Node, ray: &BoxRay, enters: &mut [f32; 8], links: &mut [u32; 8]) -> usize;
    /// Which triangles of the block the ray may meet: bits 0–3 the first ones of its facets, 4–7 the second.
    fn sift(block: &Block, ray: &SiftRay, boxes: &BoxRay) -> u32;
    /// The edge functions of two facets, all with the same bits.
    #[inline(always)]
    fn edges(corners: [&Corners; 2], line: &Line, edges: &mut Edges) {
        edges.set(corners, line);
    }
    /// Which distances do not lie beyond `t_max`, one bit each.
    fn open(enters: &[f32; 16], t_max: f32) -> u32;
}

/// Kinds of steps; the first three are those of [`Link::kind`].
const NODE: usize = 0;
const BLOCK: usize = 1;
const END: usize = 2;
/// Asking for the corners of facets that the sieve left, and testing them.
const CORNERS: usize = 3;
const EXACT: usize = 4;

/// Rays by the kind of their next step.
#[derive(Default)]
struct Agenda {
    rays: [[u8; WIDTH]; 8],
    count: [usize; 8],
}

impl Agenda {
    #[inline(always)]
    fn put(&mut self, kind: usize, ray: u8) {
        let kind = kind & 7;
        self.rays[kind][self.count[kind] % WIDTH] = ray;
        self.count[kind] += 1;
    }

    #[inline(always)]
    fn take(&mut self, kind: usize) -> ([u8; WIDTH], usize) {
        (self.rays[kind], std::mem::take(&mut self.count[kind]).min(WIDTH))
    }
}

type States = [State; WIDTH];

thread_local! {
    static STATES: RefCell<Option<Box<States>>> = const { RefCell::new(None) };
}

/// Not inlined: its frame of 150 kB would be probed page by page at each walk.
#[cold]
#[inline(never)]
fn idle() -> Box<States> {
    let states: Vec<State> = (0..WIDTH).map(|_| State::idle()).collect();
    match states.try_into() {
        Ok(states) => states,
        Err(_) => unreachable!("as many as asked for"),
    }
}

/// Finds the nearest hit of each ray.
#[inline(always)]
pub(super) fn walk<L: Lanes>(tree: &Octree, rays: &[Ray], hits: &mut [Option<FacetHit>], cost: &mut Cost) {
    cost.rays += rays.len() as u64;
    hits.fill(None);
    let Some(root) = tree.root else { return };
    // Taken out, not borrowed by a closure: a closure would be compiled without the caller's instruction set.
    let mut states = STATES.take().unwrap_or_else(idle);
    if let [ray] = rays {
        let state = &mut states[0];
        state.start(tree, root, ray, 0);
        alone::<L>(tree, state, cost);
        hits[0] = state.best.hit();
    } else {
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            let mut order: [u16; BATCH] = std::array::from_fn(|i| i as u16);
            let maps = tree.maps.read().unwrap_or_else(PoisonError::into_inner);
            let walkers = match maps.is_empty() {
                true => rays.len(),
                false => light::answer::<L>(&maps, rays, hits, &mut order, cost),
            };
            together::<L>(tree, root, &mut states, (rays, &order[..walkers]), hits, cost);
        }
    }
    STATES.set(Some(states));
}

/// One ray from its start to its end.
#[inline(always)]
fn alone<L: Lanes>(tree: &Octree, s: &mut State, cost: &mut Cost) {
    loop {
        match s.at.target() {
            Target::Node(index) => {
                cost.nodes += 1;
                let t_max = s.boxes.t_max;
                let count = s.enter::<L, true>(&tree.nodes[index]);
                s.at = if count > 0 { s.nearest(count) } else { s.pop(t_max) };
            }
            Target::Block(index, count) => {
                cost.tests += count as u64;
                s.block = index as u32;
                s.waiting = sift::<L>(&tree.blocks[index], s) & mask(count);
                if s.waiting != 0 {
                    test(tree, s);
                }
                s.at = s.pop(s.boxes.t_max);
            }
            Target::End => return,
        }
    }
}

/// Many rays, all steps of a kind in a row.
#[inline(always)]
fn together<L: Lanes>(
    tree: &Octree,
    root: Link,
    states: &mut States,
    (rays, order): (&[Ray], &[u16]),
    hits: &mut [Option<FacetHit>],
    cost: &mut Cost,
) {
    let mut agenda = Agenda::default();
    let mut live = order.len().min(WIDTH);
    let mut next = live;
    for (ray, (state, &place)) in states.iter_mut().zip(order).enumerate().take(live) {
        let place = usize::from(place);
        state.start(tree, root, &rays[place], place);
        agenda.put(state.at.kind(), ray as u8);
    }
    while live > 0 {
        let (list, n) = agenda.take(NODE);
        cost.nodes += n as u64;
        for &ray in &list[..n] {
            let s = &mut states[usize::from(ray) % WIDTH];
            let count = s.enter::<L, false>(&tree.nodes[s.at.as_node()]);
            s.at = s.next::<L>(count);
            fetch(tree, s.at);
            agenda.put(s.at.kind(), ray);
        }
        let (list, n) = agenda.take(BLOCK);
        for &ray in &list[..n] {
            let s = &mut states[usize::from(ray) % WIDTH];
            let (index, count) = s.at.as_block();
            cost.tests += count as u64;
            s.block = index as u32;
            s.waiting = sift::<L>(&tree.blocks[index], s) & mask(count);
            s.at = s.next::<L>(0);
            fetch(tree, s.at);
            agenda.put(select_unpredictable(s.waiting != 0, CORNERS, s.at.kind()), ray);
        }
        let (list, n) = agenda.take(EXACT);
        for &ray in &list[..n] {
            let s = &mut states[usize::from(ray) % WIDTH];
            test(tree, s);
            // What was next may lie beyond the new hit.
            s.reconsider::<L>();
            fetch(tree, s.at);
            agenda.put(s.at.kind(), ray);
        }
        let (list, n) = agenda.take(CORNERS);
        for &ray in &list[..n] {
            let s = &states[usize::from(ray) % WIDTH];
            fetch_corners(tree, s);
            agenda.put(EXACT, ray);
        }
        let (list, n) = agenda.take(END);
        for &ray in &list[..n] {
            let s = &mut states[usize::from(ray) % WIDTH];
            hits[s.index] = s.best.hit();
            if let Some(&place) = order.get(next) {
                let place = usize::from(place);
                if let Some(from) = order.get(next + AHEAD).and_then(|&place| rays[usize::from(place)].from) {
                    prefetch(&tree.slopes, from.primitive as usize);
                }
                s.start(tree, root, &rays[place], place);
                agenda.put(s.at.kind(), ray);
                next += 1;
            } else {
                live -= 1;
            }
        }
    }
}

/// The triangles of a block that are left without those of the facet that the ray leaves.
#[inline(always)]
fn sift<L: Lanes>(block: &Block, s: &State) -> u32 {
    let mut own = 0;
    for k in 0..4 {
        own |= u32::from(block.facets[k] == s.own) << k;
    }
    L::sift(block, &s.sift, &s.boxes) & !(own * 0x11)
}

/// The lanes of a block that hold facets.
#[inline(always)]
fn mask(count: usize) -> u32 {
    ((1 << count) - 1) * 0x11
}

/// Asks for the memory of a node or block; at the end for the first block.
#[inline(always)]
fn fetch(tree: &Octree, link: Link) {
    let block = select_unpredictable(link == Link::END, 0, link.as_block().0);
    prefetch_either(link.kind() != NODE, (&tree.blocks, block), (&tree.nodes, link.as_node()));
}

/// Asks for the corners of the facets that wait; nearly always it is one.
#[inline(always)]
fn fetch_corners(tree: &Octree, s: &State) {
    let block = &tree.blocks[s.block as usize];
    let mut mask = (s.waiting | s.waiting >> 4) & 15;
    loop {
        let k = (mask.trailing_zeros() & 3) as usize;
        mask &= mask.wrapping_sub(1);
        for p in block.positions[k] {
            prefetch(&tree.around.mesh.positions, p as usize);
        }
        if mask == 0 {
            return;
        }
    }
}

/// Tests the facets that wait.
#[inline(always)]
fn test(tree: &Octree, s: &mut State) {
    let positions = &tree.around.mesh.positions;
    let block = &tree.blocks[s.block as usize];
    let waiting = s.waiting;
    let mut mask = (waiting | waiting >> 4) & 15;
    loop {
        let k = (mask.trailing_zeros() & 3) as usize;
        mask &= mask.wrapping_sub(1);
        let corners = block.positions[k].map(|p| &positions[p as usize]);
        // The second triangle of a triangle is a line: it is never hit, but to see that takes exact arithmetic.
        let is_quad = u32::from(block.positions[k][2] != block.positions[k][3]);
        let triangles = waiting >> k & 1 | waiting >> (k + 3) & (is_quad << 1);
        s.facets.test(block.facets[k], triangles, corners, &tree.around, &mut s.best);
        if mask == 0 {
            break;
        }
    }
    s.cap();
}

//! What a ray has still to visit: where it enters each node or block, and which that is.

use super::lanes::Lanes;
use super::node::{CHILDREN, Link};
use super::ray::{BoxRay, Entry};
use std::hint::select_unpredictable;

/// Places below the first entry, so that sixteen can be looked at at once; all lead to the end of the ray.
const GROUND: usize = 16;

/// Places on the stack of a ray in a tree of so many levels of nodes: of each level all children of one node and all but one of another
/// may be left where two are entered at a time, a power of two, to which numbers of entries are cut; then those written beyond the top, and
/// the ground.
pub(super) const fn stack_places(levels: usize) -> usize {
    ((2 * CHILDREN - 1) * levels).next_power_of_two() + CHILDREN + GROUND
}

/// A stack of so many places, as [`stack_places`] has it.
pub(super) struct RayStack<const PLACES: usize> {
    /// Entries, counted from the ground on; one less where the ground itself was taken.
    count: usize,
    enters: [f32; PLACES],
    links: [u32; PLACES],
}

/// Children of a node that were written above the top of a stack.
#[derive(Clone, Copy)]
pub(super) struct Children {
    pub(super) count: usize,
    /// The link of the nearest.
    nearest: u32,
}

impl Children {
    pub(super) const NONE: Self = Self { count: 0, nearest: 0 };

    /// Those of a node that a ray meets, as [`Lanes::enter`] returned them.
    #[inline(always)]
    pub(super) fn new(entry: &Entry, met: u32) -> Self {
        // The link of the nearest is read from the node: on the stack it was written just now.
        let lane = met.leading_zeros() ^ 31;
        let nearest = entry.node.children[((15 ^ lane ^ entry.order) & 15) as usize];
        Self { count: met.count_ones() as usize, nearest }
    }
}

impl<const PLACES: usize> RayStack<PLACES> {
    pub(super) const EMPTY: Self =
        Self { count: 0, enters: [f32::NEG_INFINITY; PLACES], links: [Link::END.0; PLACES] };

    /// What numbers of entries are cut to, by which no place can lie beyond the last.
    const MASK: usize = (1 << (PLACES - CHILDREN - GROUND).ilog2()) - 1;

    /// Takes everything off.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Writes the children of a node that a ray may meet above the top, which stays where it is, and returns which they are, as
    /// [`Lanes::enter`]: [`Self::take_nearest`], [`Self::keep_all`] or [`Self::advance`] takes them.
    #[inline(always)]
    pub(super) fn enter<L: Lanes>(&mut self, entry: &Entry, ray: &BoxRay) -> u32 {
        let top = (self.count & Self::MASK) + GROUND;
        let enters = self.enters[top..top + CHILDREN].first_chunk_mut();
        let links = self.links[top..top + CHILDREN].first_chunk_mut();
        match (enters, links) {
            (Some(enters), Some(links)) => L::enter(entry, ray, enters, links),
            _ => unreachable!("sixteen places"),
        }
    }

    /// Returns the nearest of the children that were just written, at least one, and keeps the others.
    #[inline(always)]
    pub(super) fn take_nearest(&mut self, children: Children) -> Link {
        self.count += children.count - 1;
        Link(children.nearest)
    }

    /// Keeps all children that were just written.
    #[inline(always)]
    pub(super) fn keep_all(&mut self, children: Children) {
        self.count += children.count;
    }

    /// Puts the entry that was taken last back on its place.
    #[inline(always)]
    pub(super) fn put_back(&mut self) {
        self.count = self.count.wrapping_add(1);
    }

    /// The place of the topmost entry.
    #[inline(always)]
    fn topmost(&self) -> usize {
        (self.count & Self::MASK) + GROUND - 1
    }

    /// The topmost entry, which stays; the end of the ray where there is none.
    #[inline(always)]
    pub(super) fn peek(&self) -> Link {
        Link(self.links[self.topmost()])
    }

    /// Takes the topmost entry if it is a node that is not beyond `t_max`, and returns it; else `None`, and the stack stays.
    #[inline(always)]
    pub(super) fn take_open_node(&mut self, t_max: f32) -> Option<Link> {
        let link = self.peek();
        let is_open = link.is_node() & (self.enters[self.topmost()] <= t_max);
        if is_open {
            self.count -= 1;
        }
        is_open.then_some(link)
    }

    /// Takes entries off up to one that is not beyond `t_max`, and returns it; [`Link::END`] when there is none.
    #[inline(always)]
    pub(super) fn pop(&mut self, t_max: f32) -> Link {
        loop {
            let top = self.topmost();
            self.count = self.count.wrapping_sub(1);
            if self.enters[top] <= t_max {
                return Link(self.links[top]);
            }
        }
    }

    /// Returns the nearest of the children that were just written and keeps the others; where there are none, the topmost entry that is not
    /// beyond `t_max`, taken off with all above it. No branch depends on which.
    #[inline(always)]
    pub(super) fn advance<L: Lanes>(&mut self, children: Children, t_max: f32) -> Link {
        let mut count = self.count & Self::MASK;
        let mut open = self.open_below::<L>(count, t_max);
        // The ground is open to all. One test of both: whether there are children cannot be foretold, that there is anything can.
        while open | children.count as u32 == 0 {
            count = count.saturating_sub(GROUND);
            open = self.open_below::<L>(count, t_max);
        }
        let below = count + ((open | 1).leading_zeros() ^ 31) as usize;
        let above = count + children.count;
        let older = self.links[below];
        // What is taken is the last of those written, or the one at `below`, which counts the ground.
        let taken = select_unpredictable(children.count > 0, above, below.wrapping_sub(GROUND - 1));
        self.count = taken.wrapping_sub(1);
        Link(select_unpredictable(children.count > 0, children.nearest, older))
    }

    /// Which of the sixteen entries below the first `count` are not beyond `t_max`, one bit each, the topmost highest.
    #[inline(always)]
    fn open_below<L: Lanes>(&self, count: usize, t_max: f32) -> u32 {
        let count = count & Self::MASK;
        match self.enters[count..count + GROUND].first_chunk() {
            Some(entries) => L::open(entries, t_max),
            None => unreachable!("sixteen places"),
        }
    }
}

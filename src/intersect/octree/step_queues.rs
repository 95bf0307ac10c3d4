//! The rays of a batch under way, by what each does next.

use super::node::Link;

/// Rays under way at a time, one bit each in a queue. 64 are no faster: their states leave less of the first cache to the tree.
pub(super) const WIDTH: usize = 32;

/// Some of the rays under way, one bit each, by their places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Rays(pub(super) u32);

impl Rays {
    #[inline(always)]
    pub(super) fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The first so many, up to all of them.
    #[inline(always)]
    pub(super) fn first(count: usize) -> Self {
        Self(((1u64 << count) - 1) as u32)
    }

    /// These but those others.
    #[inline(always)]
    pub(super) fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Adds a ray where `is_in`.
    #[inline(always)]
    pub(super) fn add_if(&mut self, is_in: bool, ray: usize) {
        self.0 |= u32::from(is_in) << (ray % WIDTH);
    }
}

/// Their places, in rising order.
impl Iterator for Rays {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let ray = self.0.trailing_zeros() as usize % WIDTH;
        let found = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        found.then_some(ray)
    }
}

/// Rays by the kind of their next step.
///
/// Bits of numbers that stay in registers: a list in memory, to which rays are added by what was just computed of them, makes the processor
/// wait for each before it can know where the next belongs.
#[derive(Default)]
pub(super) struct StepQueues {
    /// To enter a node.
    pub(super) node: Rays,
    /// To sift a block.
    pub(super) block: Rays,
    /// To prefetch the corners of facets that the sieve left.
    pub(super) corners: Rays,
    /// To test them.
    pub(super) exact: Rays,
    /// At their ends.
    pub(super) end: Rays,
}

impl StepQueues {
    /// Adds these rays by where they go next, of each of which `ways` has a note.
    #[inline(always)]
    pub(super) fn put(&mut self, rays: Rays, ways: &Ways) {
        let Ways { blocks_or_ends, ends } = *ways;
        self.node.0 |= rays.0 & !blocks_or_ends;
        self.block.0 |= rays.0 & blocks_or_ends & !ends;
        self.end.0 |= rays.0 & ends;
    }
}

/// Where rays go next, one bit each.
#[derive(Default)]
pub(super) struct Ways {
    blocks_or_ends: u32,
    ends: u32,
}

impl Ways {
    /// Notes where a ray goes next.
    #[inline(always)]
    pub(super) fn note(&mut self, ray: usize, link: Link) {
        let ray = ray % WIDTH;
        self.blocks_or_ends |= (link.kind() as u32 >> 1) << ray;
        self.ends |= (link.kind() as u32 & 1) << ray;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_queued_by_where_they_go_next() {
        let mut ways = Ways::default();
        let links = [Link::node(7), Link::block(3, 4), Link::END, Link::block(0, 1), Link::node(0), Link::END];
        for (ray, link) in links.into_iter().enumerate() {
            ways.note(6 * ray, link);
        }
        let mut queues = StepQueues::default();
        queues.node.add_if(true, 31);
        queues.node.add_if(false, 1);
        // All but the last.
        queues.put(Rays(0b1_000001_000001_000001_000001), &ways);
        assert_eq!(queues.node.collect::<Vec<_>>(), [0, 24, 31]);
        assert_eq!(queues.block.collect::<Vec<_>>(), [6, 18]);
        assert_eq!(queues.end.collect::<Vec<_>>(), [12]);
        assert_eq!([queues.node, queues.block, queues.corners].map(Rays::count), [3, 2, 0]);
    }
}

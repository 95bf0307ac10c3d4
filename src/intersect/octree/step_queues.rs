//! The rays of a batch under way, by what each does next.

/// Rays under way at a time: a power of two, so that places are cut to it by a mask. With 64 their states leave less of the first cache to
/// the tree, and a walk takes 5 % longer.
pub(super) const WIDTH: usize = 32;

/// Kinds of steps; the first three are those of [`super::node::Link::kind`].
pub(super) const NODE: usize = 0;
pub(super) const BLOCK: usize = 1;
pub(super) const END: usize = 2;
/// Asking for the corners of facets that the sieve left, and testing them.
pub(super) const CORNERS: usize = 3;
pub(super) const EXACT: usize = 4;

/// Rays by the kind of their next step.
pub(super) struct StepQueues {
    rays: [[u8; WIDTH]; 8],
    count: [usize; 8],
}

impl StepQueues {
    pub(super) const EMPTY: Self = Self { rays: [[0; WIDTH]; 8], count: [0; 8] };

    /// Adds a ray, by its place among those under way, to the queue of a kind.
    #[inline(always)]
    pub(super) fn put(&mut self, kind: usize, ray: u8) {
        let kind = kind & 7;
        self.rays[kind][self.count[kind] % WIDTH] = ray;
        self.count[kind] += 1;
    }

    /// Rays in the queue of a kind.
    #[inline(always)]
    pub(super) fn count(&self, kind: usize) -> usize {
        self.count[kind]
    }

    /// Empties the queue of a kind and returns what was in it.
    #[inline(always)]
    pub(super) fn take(&mut self, kind: usize) -> Queue {
        Queue { rays: self.rays[kind], count: std::mem::take(&mut self.count[kind]).min(WIDTH) }
    }

    /// Takes up to `most` rays out of the queue of a kind, those that came last.
    #[inline(always)]
    pub(super) fn take_last(&mut self, kind: usize, most: usize) -> Queue {
        let count = self.count[kind].min(most);
        self.count[kind] -= count;
        let mut rays = [0; WIDTH];
        for (k, ray) in rays.iter_mut().enumerate().take(count) {
            *ray = self.rays[kind][(self.count[kind] + k) % WIDTH];
        }
        Queue { rays, count }
    }
}

/// Rays whose next steps are of one kind.
pub(super) struct Queue {
    rays: [u8; WIDTH],
    /// How many of them mean something.
    pub(super) count: usize,
}

impl Queue {
    #[inline(always)]
    pub(super) fn rays(&self) -> &[u8] {
        &self.rays[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_are_taken_and_the_others_stay() {
        let mut queues = StepQueues::EMPTY;
        (0..11).for_each(|ray| queues.put(EXACT, ray));
        queues.put(NODE, 31);
        assert_eq!(queues.take_last(EXACT, 8).rays(), [3, 4, 5, 6, 7, 8, 9, 10]);
        queues.put(EXACT, 20);
        assert_eq!(queues.count(EXACT), 4);
        assert_eq!(queues.take_last(EXACT, 8).rays(), [0, 1, 2, 20]);
        assert_eq!(queues.take(NODE).rays(), [31]);
        assert_eq!([EXACT, NODE, END].map(|kind| queues.count(kind)), [0; 3]);
    }
}

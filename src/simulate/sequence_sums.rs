//! Power by sequence, of a bounded number of sequences.
//!
//! Where light is scattered in a cavity nearly every ray takes a way of its own. Then fewer steps are distinguished: of 32, 16, 8, 4, 2, 1
//! and 0 the most at which the run has at most [`MOST_SEQUENCES`] sequences.
//!
//! Which that is hangs on the rays of the run alone, and not on how it is divided. Sequences that are the same stay the same when both
//! are cut, so a run has no more of them at a lower limit, and a part of it has no more than the whole. Hence no part ends at a lower
//! limit than the whole does, and whatever is dropped on the way to it the whole would have dropped too.
//!
//! The square of a sum over a replicate does not follow from those of its parts, and errors are made of such squares. So sums hold each
//! sequence at every limit that it may yet be cut to: one limit is given up by dropping what is longer than the next.

use super::sequence::{MOST_STEPS, Sequence};
use super::tally::Sum;
use std::collections::BTreeMap;

/// Most sequences that are distinguished: with all that they may be cut to they take some 40 MB.
const MOST_SEQUENCES: usize = 1 << 15;

/// Power by sequence, quanta of one replicate.
#[derive(Debug)]
pub(crate) struct SequenceTally {
    /// Steps of a sequence that are distinguished.
    limit: usize,
    quanta: BTreeMap<Sequence, u128>,
}

impl Default for SequenceTally {
    fn default() -> Self {
        Self { limit: MOST_STEPS, quanta: BTreeMap::new() }
    }
}

impl SequenceTally {
    /// Adds light that took this way.
    pub(super) fn add(&mut self, sequence: Sequence, quanta: u64) {
        *self.quanta.entry(sequence.cut(self.limit)).or_default() += u128::from(quanta);
        while self.quanta.len() > MOST_SEQUENCES && self.limit > 0 {
            self.limit /= 2;
            self.quanta = cut_all(std::mem::take(&mut self.quanta), self.limit);
        }
    }
}

/// Cuts sequences to so many steps and adds up those that are then the same.
fn cut_all(sequences: impl IntoIterator<Item = (Sequence, u128)>, limit: usize) -> BTreeMap<Sequence, u128> {
    let mut cut = BTreeMap::new();
    for (sequence, quanta) in sequences {
        *cut.entry(sequence.cut(limit)).or_default() += quanta;
    }
    cut
}

/// Power by sequence over replicates.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceSums {
    /// Steps of a sequence that are distinguished.
    limit: usize,
    /// Those of at most as many steps, and what longer ones are cut to at lower limits.
    sums: BTreeMap<Sequence, Sum>,
}

impl Default for SequenceSums {
    fn default() -> Self {
        Self { limit: MOST_STEPS, sums: BTreeMap::new() }
    }
}

impl SequenceSums {
    /// Returns how many steps of a sequence are distinguished: [`MOST_STEPS`], or fewer where there would be too many sequences.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Goes through the sequences in their order, with the power of each.
    pub fn iter(&self) -> impl Iterator<Item = (&Sequence, &Sum)> {
        self.sums.iter().filter(|(sequence, _)| self.tells(sequence))
    }

    /// Goes through the sequences of one receiver in their order.
    pub(super) fn of_receiver(&self, receiver: u32) -> impl Iterator<Item = (&Sequence, &Sum)> {
        let first = |receiver| Sequence { receiver, source: 0, steps: Vec::new(), more: false };
        let sums = self.sums.range(first(receiver)..first(receiver + 1));
        sums.filter(|(sequence, _)| self.tells(sequence))
    }

    /// Whether a sequence is none that is held for a lower limit.
    fn tells(&self, sequence: &Sequence) -> bool {
        !sequence.more || sequence.steps.len() == self.limit
    }

    /// Adds what a whole replicate gathered, and empties it.
    pub(super) fn take(&mut self, replicate: &mut SequenceTally) {
        let SequenceTally { limit, quanta } = std::mem::take(replicate);
        self.lower_limit(limit);
        let mut limit = self.limit;
        let mut cut = cut_all(quanta, limit);
        let mut add = |(sequence, quanta): (&Sequence, &u128)| {
            self.sums.entry(sequence.clone()).or_default().add_replicate(*quanta);
        };
        // Each sequence once at every limit: a replicate is one sample of all of them.
        cut.iter().for_each(&mut add);
        while limit > 0 {
            limit /= 2;
            cut = cut_all(cut, limit);
            // Those that are no longer than this are held already.
            cut.iter().filter(|(sequence, _)| sequence.more && sequence.steps.len() == limit).for_each(&mut add);
        }
        self.make_room();
    }

    /// Adds the sums of other replicates of the same run.
    pub(super) fn merge(&mut self, other: &Self) {
        self.lower_limit(other.limit);
        for (sequence, sum) in other.sums.iter().filter(|(sequence, _)| sequence.steps.len() <= self.limit) {
            self.sums.entry(sequence.clone()).or_default().merge(sum);
        }
        self.make_room();
    }

    /// Lowers the limit until there are few enough sequences.
    fn make_room(&mut self) {
        // The number held bounds the number reported, so that these are seldom counted.
        while self.limit > 0 && self.sums.len() > MOST_SEQUENCES && self.iter().count() > MOST_SEQUENCES {
            self.lower_limit(self.limit / 2);
        }
    }

    /// Lowers the limit to this one; does nothing where it is as low.
    fn lower_limit(&mut self, limit: usize) {
        if limit < self.limit {
            self.limit = limit;
            self.sums.retain(|sequence, _| sequence.steps.len() <= limit);
        }
    }

    /// Returns all that is held, as [`Self::restored`] takes it.
    pub(super) fn held(&self) -> impl Iterator<Item = (&Sequence, &Sum)> {
        self.sums.iter()
    }

    /// Makes sums of a limit and of all that they [held](Self::held); `None` for a limit that no sums have.
    pub(super) fn restored(limit: usize, held: Vec<(Sequence, Sum)>) -> Option<Self> {
        let is_limit = limit == 0 || (limit.is_power_of_two() && limit <= MOST_STEPS);
        is_limit.then(|| Self { limit, sums: held.into_iter().collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::outcome::Event;
    use crate::simulate::sequence::SequenceStep;

    /// Faces that a way of the test below may meet at a step.
    const FACES: u32 = 8;
    /// Replicates of the test below, and rays of each.
    const REPLICATES: u32 = 8;
    const RAYS: u32 = 8192;

    /// The way of a ray that meets of eight faces those of its octal digits, six steps that distinguish all rays, then `further` ones.
    fn way(ray: u32, further: usize) -> Sequence {
        let faces = (0..6).map(|k| ray / FACES.pow(k) % FACES).chain(std::iter::repeat_n(0, further));
        let steps = faces.map(|face| SequenceStep { face: Some(face), event: Event::Reflected });
        Sequence::new(0, 0, steps.collect())
    }

    /// The sums of these replicates, added one by one.
    fn sums(replicates: impl IntoIterator<Item = u32>, further: usize) -> SequenceSums {
        let mut sums = SequenceSums::default();
        for replicate in replicates {
            let mut tally = SequenceTally::default();
            (0..RAYS).for_each(|k| tally.add(way(replicate * RAYS + k, further), 1 << 20));
            sums.take(&mut tally);
        }
        sums
    }

    /// 65,536 ways that differ within six steps are too many; those of four steps are 4096, each of two rays in every replicate: the digits
    /// of a ray beyond the fourth are its replicate, and its place in it.
    #[test]
    fn too_many_ways_are_told_apart_by_fewer_steps_in_any_order_and_parts() {
        for further in [0, 40] {
            let whole = sums(0..REPLICATES, further);
            assert_eq!((whole.limit(), whole.iter().count()), (4, 4096));
            let unit = 1u128 << 10;
            for (sequence, sum) in whole.iter() {
                assert!(sequence.more && sequence.steps.len() == 4);
                // Of 2·2²⁰ quanta in each of eight replicates, not of sixteen times 2²⁰.
                assert_eq!((sum.total, sum.squares), (16 << 20, 8 * (2 * unit) * (2 * unit)));
            }
            assert_eq!(sums((0..REPLICATES).rev(), further), whole);
            for parts in [[0..1, 1..8], [0..4, 4..8], [0..8, 8..8], [0..7, 7..8]] {
                let [mut a, b] = parts.map(|replicates| sums(replicates, further));
                assert!(a.limit() >= whole.limit() && b.limit() >= whole.limit());
                a.merge(&b);
                assert_eq!(a, whole);
            }
        }
    }

    /// A replicate that has too many by itself is cut by itself: 4·8192 ways fit, one more does not.
    #[test]
    fn a_replicate_is_bounded_too() {
        let mut tally = SequenceTally::default();
        (0..MOST_SEQUENCES as u32).for_each(|ray| tally.add(way(ray, 0), 1));
        assert_eq!((tally.limit, tally.quanta.len()), (MOST_STEPS, MOST_SEQUENCES));
        tally.add(way(MOST_SEQUENCES as u32, 0), 1);
        assert_eq!((tally.limit, tally.quanta.len()), (4, 4096));
        assert_eq!(tally.quanta.values().sum::<u128>(), MOST_SEQUENCES as u128 + 1);
        let mut sums = SequenceSums::default();
        sums.take(&mut tally);
        assert_eq!((sums.limit(), sums.iter().count(), tally.limit), (4, 4096, MOST_STEPS));
        assert_eq!(sums.of_receiver(0).count(), 4096);
        assert_eq!(sums.of_receiver(1).count(), 0);
    }

    #[test]
    fn few_ways_keep_all_their_steps_and_short_ones_are_not_cut() {
        let mut sums = SequenceSums::default();
        let mut tally = SequenceTally::default();
        for steps in [0, 1, 3, MOST_STEPS] {
            tally.add(Sequence::new(1, 0, way(0, MOST_STEPS).steps[..steps].to_vec()), 5);
        }
        tally.add(way(0, 44), 7);
        sums.take(&mut tally);
        let told: Vec<_> = sums.iter().map(|(s, sum)| (s.receiver, s.steps.len(), s.more, sum.total)).collect();
        assert_eq!(
            told,
            [(0, 32, true, 7), (1, 0, false, 5), (1, 1, false, 5), (1, 3, false, 5), (1, 32, false, 5)]
        );
        let held = sums.held().map(|(s, sum)| (s.clone(), *sum)).collect::<Vec<_>>();
        assert_eq!(SequenceSums::restored(32, held.clone()), Some(sums));
        assert_eq!(SequenceSums::restored(33, held.clone()), None);
        assert_eq!(SequenceSums::restored(5, held), None);
    }
}

//! What a run found out about the ways of light, in the units of the scene.

use super::bind::BoundScene;
use super::power_scale::PowerScale;
use super::sequence::{MOST_STEPS, Sequence, SequenceStep};
use super::sequence_sums::SequenceSums;
use super::tallies::Tallies;
use super::tally::Sum;
use crate::text::count_of;
use serde::Serialize;

/// One sequence in a table of results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SequenceResult {
    /// Power that came to the receiver this way, in the unit of the sources.
    pub power: f64,
    /// Its standard error.
    pub power_error: f64,
    /// The source, by its place in the scene.
    pub source: u32,
    /// Its name, or its number from 1 where it has none.
    pub source_name: String,
    /// What happened on the way.
    pub steps: Vec<SequenceStep>,
    /// Whether more steps followed than are distinguished.
    pub more: bool,
}

/// The sequences of a receiver.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReceiverSequences {
    /// How many there are.
    pub count: usize,
    /// The sequences of most power, most first.
    pub first: Vec<SequenceResult>,
    /// Power of all others together.
    pub rest: f64,
}

impl ReceiverSequences {
    /// Makes the table of one receiver: as many sequences of the most power as the scene asks for, and the rest as a sum.
    pub(crate) fn new(bound: &BoundScene, tallies: &Tallies, receiver: u32, scale: &PowerScale) -> Self {
        let most = bound.scene.run.sequences as usize;
        let mut of_receiver: Vec<(&Sequence, &Sum)> = tallies.sequences.of_receiver(receiver).collect();
        // Equal powers stay in the order of the sequences, so that the table is the same however the run was divided.
        of_receiver.sort_by_key(|(_, sum)| std::cmp::Reverse(sum.total));
        let count = of_receiver.len();
        let rest = of_receiver.iter().skip(most).map(|(_, sum)| sum.total).sum::<u128>() as f64 * scale.quantum;
        let result = |(s, sum): (&Sequence, &Sum)| SequenceResult {
            power: scale.power(sum),
            power_error: scale.error(sum),
            source: s.source,
            source_name: source_name(bound, s.source),
            steps: s.steps.clone(),
            more: s.more,
        };
        Self { count, first: of_receiver.into_iter().take(most).map(result).collect(), rest }
    }
}

/// Returns a sentence about sequences of which fewer steps than usual are distinguished; `None` where it is as many.
pub(super) fn cut_sequences_note(sums: &SequenceSums) -> Option<String> {
    let by = match sums.limit() {
        MOST_STEPS => return None,
        0 => "source alone".to_owned(),
        1 => "source and first step alone".to_owned(),
        limit => format!("source and first {} alone", count_of(limit as u64, "step")),
    };
    Some(format!(
        "light took so many ways to its receivers that `sequences` distinguishes them by {by}, in place of {MOST_STEPS} steps"
    ))
}

/// Returns a source as tables name it: by its name, or by its number from 1.
fn source_name(bound: &BoundScene, source: u32) -> String {
    let name = bound.scene.sources.get(source as usize).map_or("", |s| s.name.as_str());
    if name.is_empty() { format!("source {}", source + 1) } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_below_the_usual_one_is_told() {
        let note = |limit| cut_sequences_note(&SequenceSums::restored(limit, Vec::new()).unwrap());
        assert_eq!(note(MOST_STEPS), None);
        for (limit, by) in [(16, "first 16 steps alone"), (1, "first step alone"), (0, "source alone")] {
            assert!(note(limit).unwrap().contains(by), "{limit}");
        }
    }
}

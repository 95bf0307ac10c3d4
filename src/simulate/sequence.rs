//! Sequences: light grouped by the faces it met and what happened there, so that "which path makes this spot" is one look.

use super::bind::BoundScene;
use super::outcome::{Event, PathVertex};
use super::random::split_parents;
use super::receiver::Shape;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Most steps of a sequence that are distinguished; fewer in runs of very many sequences, see [`SequenceSums`](super::SequenceSums). Light
/// that went on, caught in a guide or a cavity, is in the sequence of its first steps: without a limit nearly every path of such a scene
/// would be a sequence of its own.
pub const MOST_STEPS: usize = 32;

/// One thing that happened to light on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SequenceStep {
    /// The placed face; `None` where light was scattered inside a medium.
    pub face: Option<u32>,
    /// What happened there.
    pub event: Event,
}

/// A way from a source to a receiver.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Sequence {
    /// The receiver, by its place in the scene.
    pub receiver: u32,
    /// The source, by its place in the scene.
    pub source: u32,
    /// What happened in between.
    pub steps: Vec<SequenceStep>,
    /// Whether more steps followed than are distinguished.
    pub more: bool,
}

impl Sequence {
    /// Makes the way of light that a receiver counted after these steps.
    pub(super) fn new(receiver: u32, source: u32, steps: Vec<SequenceStep>) -> Self {
        Self { receiver, source, steps, more: false }.cut(MOST_STEPS)
    }

    /// Makes the way of light that a face took after these steps.
    pub(super) fn absorbed(receiver: u32, source: u32, mut steps: Vec<SequenceStep>, face: u32) -> Self {
        steps.push(SequenceStep { face: Some(face), event: Event::Absorbed });
        Self::new(receiver, source, steps)
    }

    /// Returns the sequence of so many first steps that it belongs to where no more are distinguished.
    pub(super) fn cut(mut self, limit: usize) -> Self {
        if self.steps.len() > limit {
            self.steps.truncate(limit);
            // Of a long path the room that the others took would stay.
            self.steps.shrink_to_fit();
            self.more = true;
        }
        self
    }
}

/// Where some light of a recorded path was counted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DepositPlace {
    /// On a plane, disc or sphere, or in the far field.
    Receiver(u32),
    /// In a face, which receivers of absorbed power may name.
    Face(u32),
}

/// Some light of a recorded path that was counted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deposit {
    pub(crate) branch: u32,
    /// Hits before it.
    pub(crate) bounce: u32,
    pub(crate) place: DepositPlace,
    pub(crate) quanta: u64,
}

/// The vertices of one ray by the path that split off it; each list in the order of the path.
pub(super) struct RayPaths<'v>(FxHashMap<u32, Vec<&'v PathVertex>>);

impl<'v> RayPaths<'v> {
    /// Groups the vertices of one ray by branch.
    pub(super) fn new(vertices: &'v [PathVertex]) -> Self {
        let mut by_branch: FxHashMap<u32, Vec<&PathVertex>> = FxHashMap::default();
        vertices.iter().for_each(|v| by_branch.entry(v.branch).or_default().push(v));
        Self(by_branch)
    }

    /// Returns what happened to the light of a branch before its hit of this number, from the source on, as far as steps are distinguished
    /// and one step more; empty for a branch without vertices.
    pub(super) fn steps(&self, branch: u32, bounce: u32) -> Vec<SequenceStep> {
        let Some(vertices) = self.0.get(&branch) else { return Vec::new() };
        let mut steps = match vertices.first() {
            Some(first) if first.event == Event::Split => self.steps_before_split(branch, first.bounce),
            _ => Vec::new(),
        };
        let happened = vertices.iter().filter(|v| v.bounce < bounce);
        let further = happened.filter_map(|v| {
            let event = match v.event {
                // What splits off is what the face reflects.
                Event::Split => Event::Reflected,
                Event::Reflected | Event::Transmitted | Event::Scattered => v.event,
                _ => return None,
            };
            Some(SequenceStep { face: v.face, event })
        });
        // One too many says that there are more.
        steps.extend(further.take((MOST_STEPS + 1).saturating_sub(steps.len())));
        steps
    }

    /// Returns the steps of the path that a branch split off from, up to there; empty where that path was not recorded. Branches are
    /// numbered by the splits before alone.
    fn steps_before_split(&self, branch: u32, bounce: u32) -> Vec<SequenceStep> {
        let parent = split_parents(branch, bounce).find(|p| *p != branch && self.0.contains_key(p));
        parent.map_or_else(Vec::new, |p| self.steps(p, bounce))
    }
}

/// Calls `add` with the sequence and the quanta of all light of one ray, counted at `deposits`. `vertices` are all of its paths.
pub(crate) fn add_ray(
    bound: &BoundScene,
    source: u32,
    vertices: &[PathVertex],
    deposits: &[Deposit],
    mut add: impl FnMut(Sequence, u64),
) {
    if deposits.is_empty() {
        return;
    }
    // Light that is counted several times on its way, as by receivers that let it pass, is in a sequence of each.
    let paths = RayPaths::new(vertices);
    for deposit in deposits {
        let steps = paths.steps(deposit.branch, deposit.bounce);
        match deposit.place {
            DepositPlace::Receiver(receiver) => add(Sequence::new(receiver, source, steps), deposit.quanta),
            DepositPlace::Face(face) => {
                for (r, receiver) in (0..).zip(&bound.receivers) {
                    if matches!(&receiver.shape, Shape::Absorbed { faces } if faces.binary_search(&face).is_ok()) {
                        add(Sequence::absorbed(r, source, steps.clone(), face), deposit.quanta);
                    }
                }
            }
        }
    }
}

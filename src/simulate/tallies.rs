//! Where light ended: the tally of one replicate, and the sums over replicates.

use super::bind::BoundScene;
use super::grid::Grid;
use super::outcome::{Counts, LostRay, PathSink, PathVertex};
use super::path_sample::PathSample;
use super::plan::Plan;
use super::receiver::Shape;
use super::sequence::Deposit;
use super::sequence_sums::{SequenceSums, SequenceTally};
use super::tally::{MomentSpread, Moments, Sum, quanta_as_integer};
use crate::math::FaceId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most lost rays that are kept; those of the lowest index.
pub(crate) const MOST_LOST_KEPT: usize = 1000;

/// The sums of one replicate.
#[derive(Debug)]
pub struct ReplicateTally {
    /// The cells of each receiver, with those of its channels behind them, in quanta.
    pub(crate) receivers: Vec<Grid>,
    pub(crate) receiver_totals: Vec<u128>,
    pub(crate) moments: Vec<Moments>,
    /// Quanta absorbed by each face, and inside each body.
    pub(crate) absorbed: Grid,
    /// Power through each face, if requested.
    pub(crate) crossings: Option<FaceCrossings>,
    pub(crate) bulk: Grid,
    pub(crate) ends: Ends,
    pub(crate) counts: Counts,
    pub(crate) ledger: Vec<LostRay>,
    pub(crate) paths: Vec<PathVertex>,
    /// What is kept of the paths when all of them are streamed.
    pub(crate) sample: Vec<PathVertex>,
    /// Where the light of recorded paths was counted, if requested.
    pub(crate) deposits: Option<Vec<Deposit>>,
    /// Power by sequence, where that is asked for.
    pub(crate) sequences: SequenceTally,
}

/// Light that passes each face, by the way that it goes.
#[derive(Debug)]
pub(crate) struct FaceCrossings {
    /// Into the body that the face bounds.
    pub(crate) entered: Grid,
    /// Out of it.
    pub(crate) left: Grid,
}

/// Power by how it ended, quanta of one replicate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ends {
    pub(crate) emitted: u64,
    pub(crate) received: u64,
    pub(crate) absorbed: u64,
    pub(crate) escaped: u64,
    pub(crate) cut_off: u64,
    pub(crate) lost: u64,
}

impl ReplicateTally {
    /// Makes an empty tally with the cells, faces and bodies of a scene; deposits are not asked for.
    pub(crate) fn new(bound: &BoundScene) -> Self {
        Self {
            receivers: bound.receivers.iter().map(|r| Grid::new(r.sum_count())).collect(),
            receiver_totals: vec![0; bound.receivers.len()],
            moments: vec![Moments::default(); bound.receivers.len()],
            absorbed: Grid::new(bound.faces.len()),
            crossings: bound.counts_faces().then(|| FaceCrossings {
                entered: Grid::new(bound.faces.len()),
                left: Grid::new(bound.faces.len()),
            }),
            bulk: Grid::new(bound.bodies.len()),
            ends: Ends::default(),
            counts: Counts::default(),
            ledger: Vec::new(),
            paths: Vec::new(),
            sample: Vec::new(),
            deposits: None,
            sequences: SequenceTally::default(),
        }
    }

    /// Empties it without adding it to any sums: after a trace whose counts are not wanted.
    pub(crate) fn discard(&mut self) {
        // Grids know their touched cells: clearing costs what was counted, not what there is.
        self.receivers.iter_mut().chain([&mut self.absorbed, &mut self.bulk]).for_each(Grid::clear);
        self.crossings.iter_mut().flat_map(|c| [&mut c.entered, &mut c.left]).for_each(Grid::clear);
        self.receiver_totals.fill(0);
        self.moments.fill(Moments::default());
        self.ends = Ends::default();
        self.counts = Counts::default();
        self.ledger.clear();
        self.paths.clear();
        self.sample.clear();
        self.deposits.iter_mut().for_each(Vec::clear);
        self.sequences = SequenceTally::default();
    }

    /// Fills the receivers of absorbed power from their faces and adds what waits, so that it can be read; once for each replicate, or that
    /// power is counted twice.
    pub(crate) fn finish(&mut self, bound: &BoundScene) {
        for (i, receiver) in bound.receivers.iter().enumerate() {
            if let Shape::Absorbed { faces } = &receiver.shape {
                for &face in faces {
                    let quanta = self.absorbed.get(face as usize);
                    // No face takes more than is emitted, which fits.
                    self.receivers[i].add_integer(0, quanta as u64);
                    self.receiver_totals[i] += quanta;
                }
            }
            self.receivers[i].add_pending();
        }
    }

    /// Hands the vertices gathered so far to `sink`, moves those of the sample to `sample`, and drops the others.
    pub(crate) fn stream_paths(&mut self, sink: PathSink<'_>, plan: &Plan) {
        sink(&self.paths);
        self.sample.extend(self.paths.drain(..).filter(|v| plan.samples(v.ray)));
    }

    /// Returns the power of a receiver, in quanta.
    pub fn power(&self, receiver: usize) -> u128 {
        self.receiver_totals[receiver]
    }

    /// Returns the moments of where light fell on a receiver.
    pub fn moments(&self, receiver: usize) -> &Moments {
        &self.moments[receiver]
    }

    /// Goes through the cells of a receiver that hold something, each once and in no particular order, with their quanta; those of its
    /// channels follow those of its power.
    pub fn cells(&self, receiver: usize) -> impl Iterator<Item = (usize, u128)> {
        self.receivers[receiver].touched()
    }

    /// Returns the faces that it reached, rising, with the quanta that they absorbed, that entered their body through them and that left
    /// it; none where the scene does not request the power through each face.
    pub(crate) fn face_quanta(&self) -> Vec<(u32, [u128; 3])> {
        let Some(crossings) = &self.crossings else { return Vec::new() };
        let grids = [&self.absorbed, &crossings.entered, &crossings.left];
        let mut faces: Vec<usize> = grids.iter().flat_map(|grid| grid.touched()).map(|(face, _)| face).collect();
        faces.sort_unstable();
        faces.dedup();
        faces.into_iter().map(|face| (face as u32, grids.map(|grid| grid.get(face)))).collect()
    }

    /// Returns the quanta that each instance took, then each body inside, as [`Tallies::model_sums`] counts them: those that took any,
    /// rising.
    pub(crate) fn model_quanta(&self, bound: &BoundScene) -> Vec<(u32, u128)> {
        let mut taken = BTreeMap::new();
        for (face, quanta) in self.absorbed.touched() {
            *taken.entry(bound.instance_of_face[face]).or_insert(0) += quanta;
        }
        let bodies = self.bulk.touched().map(|(body, quanta)| ((bound.instances.len() + body) as u32, quanta));
        taken.extend(bodies);
        taken.into_iter().collect()
    }

    /// Returns the quanta that were received, absorbed, escaped and were cut off.
    pub(crate) fn end_quanta(&self) -> [u64; 4] {
        [self.ends.received, self.ends.absorbed, self.ends.escaped, self.ends.cut_off]
    }

    /// Books power that a face takes, a whole number of quanta.
    #[inline]
    pub(crate) fn absorb(&mut self, face: FaceId, quanta: f64) {
        self.ends.absorbed += quanta_as_integer(quanta);
        self.absorbed.add(face.index(), quanta);
    }

    /// Notes power that passes a face, where that is asked for.
    #[inline]
    pub(crate) fn cross(&mut self, face: FaceId, entering: bool, quanta: f64) {
        if let Some(crossings) = &mut self.crossings {
            let grid = if entering { &mut crossings.entered } else { &mut crossings.left };
            grid.add(face.index(), quanta);
        }
    }

    /// Books a lost ray.
    #[cold]
    pub(crate) fn lose(&mut self, lost: LostRay) {
        self.ends.lost += lost.quanta;
        self.counts.lost += 1;
        self.ledger.push(lost);
        // Cut at twice what is kept, so that sorting happens seldom however many rays are lost.
        if self.ledger.len() >= 2 * MOST_LOST_KEPT {
            trim_ledger(&mut self.ledger);
        }
    }
}

/// Sorts lost rays by index and keeps the first [`MOST_LOST_KEPT`].
fn trim_ledger(ledger: &mut Vec<LostRay>) {
    ledger.sort_by_key(|l| (l.ray, l.branch));
    ledger.truncate(MOST_LOST_KEPT);
}

/// All sums of a run, or of the replicates of one shard.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tallies {
    /// Number of replicates summed.
    pub replicates: u32,
    /// Cells of each receiver.
    pub cells: Vec<Vec<Sum>>,
    /// Power of each receiver.
    pub receivers: Vec<Sum>,
    /// Moments of where light fell on each receiver.
    pub moments: Vec<Moments>,
    /// How that differs between replicates.
    pub spreads: Vec<MomentSpread>,
    /// All cells of each channel of each receiver together.
    pub channels: Vec<Vec<Sum>>,
    /// Power absorbed on each placed face.
    pub faces: Vec<Sum>,
    /// Power that entered a body through each placed face; empty where that was not asked for.
    pub entered: Vec<Sum>,
    /// Power that left a body through each placed face; empty where that was not asked for.
    pub left: Vec<Sum>,
    /// Power absorbed on each instance: its faces share the replicates' ups and downs, so their errors do not simply add up.
    pub instances: Vec<Sum>,
    /// Power absorbed inside each body, the surroundings first.
    pub bulk: Vec<Sum>,
    /// Emitted, received, absorbed, escaped, cut off, lost.
    pub ends: [Sum; 6],
    /// Counts of rays, segments and what went wrong.
    pub counts: Counts,
    /// The lost rays of the lowest index.
    pub ledger: Vec<LostRay>,
    /// Vertices of the recorded paths.
    pub paths: PathSample,
    /// Power by sequence, where that was asked for.
    #[serde(skip)]
    pub sequences: SequenceSums,
}

impl Tallies {
    /// Makes empty sums with the cells, faces and bodies of a scene, of no replicate.
    pub(crate) fn new(bound: &BoundScene) -> Self {
        let crossed = if bound.counts_faces() { bound.faces.len() } else { 0 };
        Self {
            cells: bound.receivers.iter().map(|r| vec![Sum::default(); r.sum_count()]).collect(),
            receivers: vec![Sum::default(); bound.receivers.len()],
            moments: vec![Moments::default(); bound.receivers.len()],
            spreads: vec![MomentSpread::default(); bound.receivers.len()],
            channels: bound.receivers.iter().map(|r| vec![Sum::default(); r.channels.count()]).collect(),
            faces: vec![Sum::default(); bound.faces.len()],
            entered: vec![Sum::default(); crossed],
            left: vec![Sum::default(); crossed],
            instances: vec![Sum::default(); bound.instances.len()],
            bulk: vec![Sum::default(); bound.bodies.len()],
            ..Self::default()
        }
    }

    /// Returns the share of the emitted power that was left on paths that were lost; NaN where none was emitted.
    pub fn lost_share(&self) -> f64 {
        let [emitted, .., lost] = self.ends;
        lost.total as f64 / emitted.total as f64
    }

    /// Adds what a whole replicate gathered, once it is [finished](ReplicateTally::finish), and empties it; paths are left unsorted.
    pub(crate) fn take(&mut self, replicate: &mut ReplicateTally, bound: &BoundScene) {
        self.replicates += 1;
        // One replicate is one sample of each figure: squares are added once a replicate, or the errors would be
        // those of something else.
        for (i, receiver) in bound.receivers.iter().enumerate() {
            let mut channels = vec![0; self.channels[i].len()];
            if !channels.is_empty() {
                let further = replicate.receivers[i].touched().filter(|(cell, _)| *cell >= receiver.cell_count());
                further.for_each(|(cell, quanta)| channels[cell / receiver.cell_count() - 1] += quanta);
            }
            self.channels[i].iter_mut().zip(channels).for_each(|(sum, quanta)| sum.add_replicate(quanta));
            replicate.receivers[i].flush(&mut self.cells[i]);
            let (power, moments) =
                (std::mem::take(&mut replicate.receiver_totals[i]), std::mem::take(&mut replicate.moments[i]));
            self.receivers[i].add_replicate(power);
            self.spreads[i].add_replicate(power, &moments);
            self.moments[i].merge(&moments);
        }
        let mut instances = vec![0; self.instances.len()];
        // Faces of an instance are added up first, since their errors are not independent.
        replicate.absorbed.touched().for_each(|(face, quanta)| {
            instances[bound.instance_of_face[face] as usize] += quanta;
        });
        let filled = self.instances.iter_mut().zip(instances).filter(|(_, quanta)| *quanta > 0);
        // Only what got something: a replicate that adds nothing changes neither sum nor square.
        filled.for_each(|(sum, quanta)| sum.add_replicate(quanta));
        replicate.absorbed.flush(&mut self.faces);
        if let Some(crossings) = &mut replicate.crossings {
            crossings.entered.flush(&mut self.entered);
            crossings.left.flush(&mut self.left);
        }
        replicate.bulk.flush(&mut self.bulk);
        let e = std::mem::take(&mut replicate.ends);
        let ends = [e.emitted, e.received, e.absorbed, e.escaped, e.cut_off, e.lost];
        self.ends.iter_mut().zip(ends).for_each(|(s, e)| s.add_replicate(u128::from(e)));
        self.counts.add(&std::mem::take(&mut replicate.counts));
        self.ledger.append(&mut replicate.ledger);
        trim_ledger(&mut self.ledger);
        self.sequences.take(&mut replicate.sequences);
        self.paths.append(&mut replicate.sample);
        self.paths.append(&mut replicate.paths);
    }

    /// Adds the sums of other replicates of the same run, and sorts the paths. Parts of runs with other receivers or faces are not refused:
    /// what has no counterpart is left out.
    pub fn merge(&mut self, o: &Self) {
        self.replicates += o.replicates;
        self.cells.iter_mut().zip(&o.cells).for_each(|(a, b)| merge_sums(a, b));
        merge_sums(&mut self.receivers, &o.receivers);
        self.moments.iter_mut().zip(&o.moments).for_each(|(a, b)| a.merge(b));
        self.spreads.iter_mut().zip(&o.spreads).for_each(|(a, b)| a.merge(b));
        self.channels.iter_mut().zip(&o.channels).for_each(|(a, b)| merge_sums(a, b));
        merge_sums(&mut self.faces, &o.faces);
        merge_sums(&mut self.entered, &o.entered);
        merge_sums(&mut self.left, &o.left);
        merge_sums(&mut self.instances, &o.instances);
        merge_sums(&mut self.bulk, &o.bulk);
        self.ends.iter_mut().zip(&o.ends).for_each(|(a, b)| a.merge(b));
        self.counts.add(&o.counts);
        self.ledger.extend(o.ledger.iter().cloned());
        trim_ledger(&mut self.ledger);
        self.sequences.merge(&o.sequences);
        self.paths.merge(&o.paths);
        self.sort_paths();
    }

    /// Goes through what the model took: the faces of each instance, then the inside of each body.
    pub fn model_sums(&self) -> impl Iterator<Item = &Sum> {
        self.instances.iter().chain(&self.bulk)
    }

    /// Sorts the vertices of paths by ray, branch, bounce and event.
    pub(crate) fn sort_paths(&mut self) {
        self.paths.sort();
    }
}

/// Merges sums into those of the same index; what one list has beyond the other is left out.
fn merge_sums(into: &mut [Sum], from: &[Sum]) {
    into.iter_mut().zip(from).for_each(|(a, b)| a.merge(b));
}

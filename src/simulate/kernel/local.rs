use super::Context;
use crate::math::{FaceId, Point, Vector};
use crate::simulate::bind::BoundScene;
use crate::simulate::tally::{Grid, Moments, Spread, Sum, count};
use serde::{Deserialize, Serialize};

/// Why a ray was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Cause {
    /// It left the scene while inside a medium: a crack, or an open shell with a medium.
    NoExit,
    /// It left a body that it was not inside of, or entered one while inside another that stands apart.
    ImpossibleMedium,
    /// It hit a closed opaque solid from inside.
    InsideSolid,
    /// More bodies inside each other than a ray can carry.
    TooDeep,
    /// A direction or distance that is not a number.
    NotANumber,
}

/// A ray that was lost, with all that is needed to trace it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostRay {
    /// Index of the ray.
    pub ray: u64,
    /// Which path of a ray that was split.
    pub branch: u32,
    /// Hits before it was lost.
    pub bounce: u32,
    /// Why.
    pub cause: Cause,
    /// Its power, in quanta.
    pub quanta: u64,
    /// Start of its last segment, mm.
    pub origin: Point,
    /// Direction of its last segment.
    pub direction: Vector,
    /// The face where it happened, if it was at one.
    pub face: Option<u32>,
    /// The body it was in, as [`BoundScene::body`](crate::simulate::BoundScene::body) names it; 0 for the surroundings.
    pub body: u16,
}

/// A vertex of a recorded path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathVertex {
    /// Index of the ray.
    pub ray: u64,
    /// Which path of a ray that was split; a new branch starts where it split off.
    pub branch: u32,
    /// Hits before this vertex.
    pub bounce: u32,
    /// Where, mm.
    pub point: Point,
    /// Power that arrives here, as a share of an average ray.
    pub power: f64,
    /// What happens here.
    pub event: Event,
}

/// Takes vertices of paths as they come, from any thread.
pub type PathSink<'a> = &'a (dyn Fn(&[PathVertex]) + Sync);

/// What happens at a vertex of a path. Files of numbers count from 0 in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event {
    /// It starts at a source.
    Emitted,
    /// It splits off another path.
    Split,
    /// Reflected at a face.
    Reflected,
    /// Transmitted at a face.
    Transmitted,
    /// Scattered at a face.
    Scattered,
    /// It ends in a face or medium.
    Absorbed,
    /// It ends on a receiver.
    Received,
    /// It leaves the scene.
    Escaped,
    /// It is cut off by a limit.
    CutOff,
    /// It is lost.
    Lost,
}

/// Most lost rays that are kept; those of the lowest index.
pub(crate) const LEDGER: usize = 1000;

/// Where the power of one replicate ends.
#[derive(Debug)]
pub(crate) struct Local {
    pub(crate) receivers: Vec<Grid>,
    pub(crate) receiver_totals: Vec<u64>,
    pub(crate) moments: Vec<Moments>,
    pub(crate) absorbed: Grid,
    pub(crate) bulk: Grid,
    pub(crate) ends: Ends,
    pub(crate) counts: Counts,
    pub(crate) ledger: Vec<LostRay>,
    pub(crate) paths: Vec<PathVertex>,
    /// What is kept of the paths when all of them are streamed.
    pub(crate) sample: Vec<PathVertex>,
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

/// Things that happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Rays that left a source.
    pub rays: u64,
    /// Nearest-hit queries, the last of each path included.
    pub segments: u64,
    /// Hits whose interpolated normal would have sent the ray through the wrong side, and that used the facet's own instead.
    pub corrected_normals: u64,
    /// Paths that were lost.
    pub lost: u64,
    /// Paths that a limit cut off.
    pub cut_off: u64,
    /// Those of them that went round by total reflection without end.
    pub caught: u64,
    /// Times that light left a body below the one it had come into later, of another index: two bodies that overlap.
    pub overlaps: u64,
    /// The two bodies of one of them, those of the lowest numbers; zeros where there are none.
    pub overlapping: [u16; 2],
}

impl Counts {
    fn add(&mut self, o: &Self) {
        self.rays += o.rays;
        self.segments += o.segments;
        self.corrected_normals += o.corrected_normals;
        self.lost += o.lost;
        self.cut_off += o.cut_off;
        self.caught += o.caught;
        self.overlap(o.overlapping, o.overlaps);
    }

    /// Notes that these bodies overlap, met so many times.
    pub(crate) fn overlap(&mut self, pair: [u16; 2], times: u64) {
        self.overlaps += times;
        if self.overlapping == [0; 2] || (pair != [0; 2] && pair < self.overlapping) {
            self.overlapping = pair;
        }
    }
}

impl Local {
    pub(crate) fn new(bound: &BoundScene) -> Self {
        Self {
            receivers: bound.receivers.iter().map(|r| Grid::new(r.sum_count())).collect(),
            receiver_totals: vec![0; bound.receivers.len()],
            moments: vec![Moments::default(); bound.receivers.len()],
            absorbed: Grid::new(bound.faces.len()),
            bulk: Grid::new(bound.bodies.len()),
            ends: Ends::default(),
            counts: Counts::default(),
            ledger: Vec::new(),
            paths: Vec::new(),
            sample: Vec::new(),
        }
    }

    /// Empties it, as [`Tallies::take`] does, of what nobody asks about.
    pub(crate) fn forget(&mut self) {
        self.receivers.iter_mut().chain([&mut self.absorbed, &mut self.bulk]).for_each(Grid::forget);
        self.receiver_totals.fill(0);
        self.moments.fill(Moments::default());
        (self.ends, self.counts) = (Ends::default(), Counts::default());
        self.ledger.clear();
        self.paths.clear();
        self.sample.clear();
    }

    /// Hands the vertices gathered so far to whoever wants them all, and keeps the sample.
    pub(crate) fn stream(&mut self, context: &Context<'_>) {
        if let Some(sink) = context.paths {
            sink(&self.paths);
            self.sample.extend(self.paths.drain(..).filter(|v| context.plan.samples(v.ray)));
        }
    }

    #[inline]
    pub(crate) fn absorb(&mut self, face: FaceId, quanta: f64) {
        self.ends.absorbed += count(quanta);
        self.absorbed.add(face.index(), quanta);
    }

    #[cold]
    pub(crate) fn lose(&mut self, lost: LostRay) {
        self.ends.lost += lost.quanta;
        self.counts.lost += 1;
        self.ledger.push(lost);
        if self.ledger.len() >= 2 * LEDGER {
            trim(&mut self.ledger);
        }
    }
}

fn trim(ledger: &mut Vec<LostRay>) {
    ledger.sort_by_key(|l| (l.ray, l.branch));
    ledger.truncate(LEDGER);
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
    /// Where light fell on each receiver.
    pub moments: Vec<Moments>,
    /// How that differs between replicates.
    pub spreads: Vec<Spread>,
    /// All cells of each channel of each receiver together.
    pub channels: Vec<Vec<Sum>>,
    /// Power absorbed on each placed face.
    pub faces: Vec<Sum>,
    /// Power absorbed on each instance: its faces share the replicates' ups and downs, so their errors do not simply add up.
    pub instances: Vec<Sum>,
    /// Power absorbed inside each body, the surroundings first.
    pub bulk: Vec<Sum>,
    /// Emitted, received, absorbed, escaped, cut off, lost.
    pub ends: [Sum; 6],
    /// Things counted.
    pub counts: Counts,
    /// The lost rays of the lowest index.
    pub ledger: Vec<LostRay>,
    /// Vertices of the recorded paths.
    pub paths: Vec<PathVertex>,
}

impl Tallies {
    pub(crate) fn new(bound: &BoundScene) -> Self {
        Self {
            cells: bound.receivers.iter().map(|r| vec![Sum::default(); r.sum_count()]).collect(),
            receivers: vec![Sum::default(); bound.receivers.len()],
            moments: vec![Moments::default(); bound.receivers.len()],
            spreads: vec![Spread::default(); bound.receivers.len()],
            channels: bound.receivers.iter().map(|r| vec![Sum::default(); r.channels.count()]).collect(),
            faces: vec![Sum::default(); bound.faces.len()],
            instances: vec![Sum::default(); bound.instances.len()],
            bulk: vec![Sum::default(); bound.bodies.len()],
            ..Self::default()
        }
    }

    /// Takes in what a whole replicate gathered, and empties it.
    pub(crate) fn take(&mut self, local: &mut Local, context: &Context<'_>) {
        self.replicates += 1;
        for (i, receiver) in context.bound.receivers.iter().enumerate() {
            if let crate::simulate::receiver::Shape::Absorbed { faces } = &receiver.shape {
                let sum: u64 = faces.iter().map(|&f| local.absorbed.get(f as usize)).sum();
                local.receivers[i].add(0, sum as f64);
                local.receiver_totals[i] += sum;
            }
            let mut channels = vec![0; self.channels[i].len()];
            if !channels.is_empty() {
                let further = local.receivers[i].touched().filter(|(cell, _)| *cell >= receiver.cell_count());
                further.for_each(|(cell, quanta)| channels[cell / receiver.cell_count() - 1] += quanta);
            }
            self.channels[i].iter_mut().zip(channels).for_each(|(sum, quanta)| sum.add_replicate(quanta));
            local.receivers[i].flush(&mut self.cells[i]);
            let (power, moments) =
                (std::mem::take(&mut local.receiver_totals[i]), std::mem::take(&mut local.moments[i]));
            self.receivers[i].add_replicate(power);
            self.spreads[i].add_replicate(power, &moments);
            self.moments[i].merge(&moments);
        }
        let mut instances = vec![0; self.instances.len()];
        local.absorbed.touched().for_each(|(face, quanta)| {
            instances[context.bound.instance_of_face[face] as usize] += quanta;
        });
        let filled = self.instances.iter_mut().zip(instances).filter(|(_, quanta)| *quanta > 0);
        filled.for_each(|(sum, quanta)| sum.add_replicate(quanta));
        local.absorbed.flush(&mut self.faces);
        local.bulk.flush(&mut self.bulk);
        let e = std::mem::take(&mut local.ends);
        let ends = [e.emitted, e.received, e.absorbed, e.escaped, e.cut_off, e.lost];
        self.ends.iter_mut().zip(ends).for_each(|(s, e)| s.add_replicate(e));
        self.counts.add(&std::mem::take(&mut local.counts));
        self.ledger.append(&mut local.ledger);
        trim(&mut self.ledger);
        local.stream(context);
        self.paths.append(&mut local.sample);
        self.paths.append(&mut local.paths);
    }

    /// Adds the sums of other replicates of the same run.
    pub fn merge(&mut self, o: &Self) {
        let pairs = |a: &mut Vec<Sum>, b: &[Sum]| a.iter_mut().zip(b).for_each(|(a, b)| a.merge(b));
        self.replicates += o.replicates;
        self.cells.iter_mut().zip(&o.cells).for_each(|(a, b)| pairs(a, b));
        pairs(&mut self.receivers, &o.receivers);
        self.moments.iter_mut().zip(&o.moments).for_each(|(a, b)| a.merge(b));
        self.spreads.iter_mut().zip(&o.spreads).for_each(|(a, b)| a.merge(b));
        self.channels.iter_mut().zip(&o.channels).for_each(|(a, b)| pairs(a, b));
        pairs(&mut self.faces, &o.faces);
        pairs(&mut self.instances, &o.instances);
        pairs(&mut self.bulk, &o.bulk);
        self.ends.iter_mut().zip(&o.ends).for_each(|(a, b)| a.merge(b));
        self.counts.add(&o.counts);
        self.ledger.extend(o.ledger.iter().cloned());
        trim(&mut self.ledger);
        self.paths.extend(o.paths.iter().cloned());
        self.sort();
    }

    /// Brings what was gathered in any order into the one order.
    pub(crate) fn sort(&mut self) {
        self.paths.sort_by_key(|v| (v.ray, v.branch, v.bounce, v.event));
    }
}

//! What facets change of every figure of a run: the same rays once more on facets and on the spline.
//!
//! Random numbers are keyed by ray and bounce, so both runs follow the same paths until the facets turn them away, and most of the
//! noise cancels in the differences. Each difference comes with its own standard error, from replicate to replicate. Cells that
//! too few rays reach are judged together with their neighbours, in squares of cells, and the size of the squares is reported.
//!
//! Guarantee: the same scene, seed and rays give the same bits for any number of threads.
//! Known weakness: a change by facets that none of these rays meets is not seen; the standard error of a difference says how much
//! rays of this number can resolve.

mod cells;
mod ends;
mod estimate;
mod faces;
mod model_powers;
mod paired;
mod replicates;

pub use cells::MapError;
pub use ends::EndErrors;
pub use faces::FaceError;
pub use model_powers::AbsorbedError;
pub use paired::Paired;

use cells::CellPairs;
pub(in crate::study) use replicates::{MOST_CELLS, ReplicatedRun, trace_replicates};

use crate::intersect::Intersector;
use crate::simulate::{BoundScene, RunSettings};
use serde::Serialize;

/// Changes of a run's figures by facets.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct GeometricError {
    /// Rays from the sources, traced on both.
    pub rays: u64,
    /// Share of the emitted power that was lost, on facets and on the spline.
    pub lost: [f64; 2],
    /// Nearest-hit queries a ray on the spline.
    pub segments_per_ray: f64,
    /// Seconds of tracing, on facets and on the spline.
    pub seconds: [f64; 2],
    /// Where all light ended.
    pub power: EndErrors,
    /// Every receiver of the scene.
    pub receivers: Vec<ReceiverError>,
    /// Bodies and media that took light.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub absorbed: Vec<AbsorbedError>,
    /// The faces that these rays met, by their number; empty unless the scene asks for the power by face.
    #[serde(skip)]
    pub faces: Vec<FaceError>,
}

/// Changes of one receiver's light by facets.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReceiverError {
    /// Name of the receiver.
    pub name: String,
    /// Unit of positions and widths: `mm`, or `deg` of far fields and spheres; empty where only power is counted.
    pub unit: &'static str,
    /// Power counted.
    pub power: Paired,
    /// Mean position along both axes; 0 along one that is cyclic, as the other places and their errors, see
    /// [`ReceiverResult::is_cyclic`](crate::simulate::ReceiverResult::is_cyclic).
    pub centroid: [Paired; 2],
    /// Root mean square distance from the receiver's centre along both axes.
    pub rms: [Paired; 2],
    /// Root mean square distance from the mean position along both axes: the width of the light.
    pub width: [Paired; 2],
    /// The brightest place, in the receiver's unit, over [`Self::peak_cells`] × as many cells.
    pub peak: Paired,
    /// Cells a side that the brightest place was judged over; 0 where there are too many cells to keep apart.
    pub peak_cells: usize,
    /// All cells together.
    pub map: MapError,
    /// Most cells a side that one cell was judged with.
    pub pooled_cells: usize,
    /// Standard errors on the spline, from these rays alone.
    pub statistical: Statistical,
    /// Geometric error of each cell, in the receiver's unit; empty where cells were not compared.
    #[serde(skip)]
    pub cells: Vec<f64>,
    /// Its further channels, in the order of the results.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<ChannelError>,
}

/// Changes of a further channel of a receiver by facets.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChannelError {
    /// Name of the channel.
    pub name: String,
    /// Sum over the receiver.
    pub total: Paired,
    /// Standard error of that on the spline, from these rays alone.
    pub statistical: f64,
    /// Geometric error of each cell, in the channel's unit; empty where there are too many.
    #[serde(skip)]
    pub cells: Vec<f64>,
}

/// Standard errors of the figures of one receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Statistical {
    /// Standard error of power.
    pub power: f64,
    /// Standard errors of the mean positions.
    pub centroid: [f64; 2],
    /// Standard errors of the root mean squares.
    pub rms: [f64; 2],
    /// Standard error of one cell at the brightest place.
    pub peak: f64,
    /// Standard error of all cells: root of the sum of squares, as [`MapError::geometric`].
    pub map: f64,
}

impl GeometricError {
    /// Returns the error of facets that are the surface itself: none, from no rays.
    pub(in crate::study) fn of_exact_facets(bound: &BoundScene) -> Self {
        let unchanged =
            |name: &String| ReceiverError { name: name.clone(), peak_cells: 1, ..ReceiverError::default() };
        Self { receivers: bound.receivers.iter().map(|r| unchanged(&r.name)).collect(), ..Self::default() }
    }

    /// The error of a power that facets changed on none of these rays: that of one of them, as one in so many may differ. Of a hemisphere
    /// that reflects all light facets let pass what no such ray met, and the error was reported as none. 0 for facets that are the surface.
    pub(in crate::study) fn unseen_power(&self, emitted: f64) -> f64 {
        if self.rays > 0 { emitted / self.rays as f64 } else { 0.0 }
    }

    /// How many of these rays brought a power, of which `emitted` left the sources: for weak rays, as behind a filter, by the spread.
    fn rays_of(&self, power: &Paired, statistical: f64, emitted: f64) -> f64 {
        let by_power = power.spline * self.rays as f64 / emitted.max(f64::MIN_POSITIVE);
        let by_spread = if statistical > 0.0 { (power.spline / statistical).powi(2) } else { 0.0 };
        // Rays of a net spread less than independent ones, and look like more.
        by_power.max(by_spread.min(self.rays as f64))
    }

    /// Returns a receiver that so few of these rays came to that a run of `scale` times as many will know its light better than they know
    /// what facets change of it: one ray in `n` is unseen among `n`, a share of `1/n`, where the run's error is one of `1/√(n·scale)`.
    /// What bodies absorb is no reason for the spline: it is no requested figure, and its error says how little is known.
    pub(in crate::study) fn unjudged(&self, scale: f64, emitted: f64) -> Option<&str> {
        let is_unjudged = |r: &&ReceiverError| self.rays_of(&r.power, r.statistical.power, emitted) < scale;
        self.receivers.iter().find(is_unjudged).map(|r| r.name.as_str())
    }

    /// The share of the light of receiver `k` that rays may change which are too rare to be among these: one of those that came there.
    pub fn unseen_share(&self, k: usize, emitted: f64) -> f64 {
        let r = &self.receivers[k];
        1.0 / self.rays_of(&r.power, r.statistical.power, emitted).max(1.0)
    }

    /// Adds to every figure but those of cells what rays may change of it that are too rare to be among these, at a receiver one of those
    /// that came there: rays without a difference show none at all, and yet one more may pass a silhouette.
    pub fn with_unseen_rays(mut self, emitted: f64) -> Self {
        let shares: Vec<f64> = (0..self.receivers.len()).map(|k| self.unseen_share(k, emitted)).collect();
        for (r, share) in self.receivers.iter_mut().zip(shares) {
            let totals = r.channels.iter_mut().map(|c| &mut c.total);
            let figures = [&mut r.power, &mut r.peak].into_iter().chain(&mut r.rms).chain(&mut r.width);
            figures.chain(totals).for_each(|figure| figure.add_unseen(share));
            // A mean position is moved by how far such a ray lies off it: about the width of the light.
            for (place, width) in r.centroid.iter_mut().zip(&r.width) {
                place.error = place.error.hypot(share * width.spline);
            }
        }
        // All other figures get the share of one ray of all light, and one ray more where they are reported.
        let share = 1.0 / self.rays.max(1) as f64;
        self.power.each_mut().into_iter().for_each(|end| end.add_unseen(share));
        self.absorbed.iter_mut().for_each(|a| a.power.add_unseen(share));
        for face in &mut self.faces {
            let powers = [&mut face.absorbed, &mut face.entered, &mut face.left];
            powers.into_iter().for_each(|figure| figure.add_unseen(share));
        }
        self
    }
}

/// Traces the run of these settings on facets and on the spline and compares every figure, with what rarer rays may change of it.
pub fn geometric_error(
    bound: &BoundScene,
    [facets, spline]: [&dyn Intersector; 2],
    settings: &RunSettings,
) -> GeometricError {
    // Of grids of millions the cells of both runs would be most of what the program holds.
    let facets = trace_replicates(bound, facets, settings).without_cells();
    let spline = trace_replicates(bound, spline, settings).without_cells();
    compare(bound, [&facets, &spline]).with_unseen_rays(spline.results.power.emitted)
}

/// Compares every figure of two runs of the same rays, the first on facets, the second on the spline; rays and
/// statistical errors are those of the second.
pub(in crate::study) fn compare(bound: &BoundScene, runs: [&ReplicatedRun; 2]) -> GeometricError {
    let results = runs.map(|run| &run.results);
    GeometricError {
        rays: results[1].rays,
        lost: results.map(|r| r.power.lost / r.power.emitted),
        segments_per_ray: results[1].segments as f64 / results[1].rays.max(1) as f64,
        seconds: results.map(|r| r.seconds.trace),
        power: ends::end_errors(runs),
        receivers: (0..results[1].receivers.len()).map(|k| receiver_error(bound, runs, k)).collect(),
        absorbed: model_powers::absorbed_errors(bound, runs),
        faces: faces::face_errors(runs),
    }
}

/// Finds what facets change of receiver `k`, from paired runs on facets and on the spline; of too many cells only power and places.
fn receiver_error(bound: &BoundScene, runs: [&ReplicatedRun; 2], k: usize) -> ReceiverError {
    let result = &runs[1].results.receivers[k];
    let power = estimate::power(runs, k);
    let mut statistical = Statistical { power: result.power_error, ..Statistical::default() };
    let channels = (0..result.channels.len()).map(|c| channel_error(bound, runs, k, c)).collect();
    // Absorbed power is one number: it has neither places nor cells.
    if result.kind == "absorbed" {
        return ReceiverError {
            name: result.name.clone(),
            power,
            statistical,
            channels,
            ..ReceiverError::default()
        };
    }
    // Where an axis is cyclic there is no mean position that facets could move.
    let moments = |axis| {
        if result.is_cyclic(axis) { [Paired::default(); 3] } else { estimate::moments(runs, k, axis) }
    };
    let [first, second] = [0, 1].map(moments);
    // What few rays leave open falls much faster with their number than the spread: the whole run will have none of it.
    [statistical.centroid, statistical.rms] = result
        .spread_errors
        .map(|errors| [0, 1].map(|axis| if result.is_cyclic(axis) { 0.0 } else { errors[axis] }));
    let mut error = ReceiverError {
        name: result.name.clone(),
        unit: if matches!(result.kind, "plane" | "disc") { "mm" } else { "deg" },
        power,
        centroid: [first[0], second[0]],
        rms: [first[1], second[1]],
        width: [first[2], second[2]],
        statistical,
        channels,
        ..ReceiverError::default()
    };
    if let Some(cells) = CellPairs::new(bound, runs, k, 0) {
        error.set_cells(&cells);
    }
    error
}

/// Finds what facets change of one channel of receiver `k`: its total and its cells, which are left out where they are too many.
fn channel_error(bound: &BoundScene, runs: [&ReplicatedRun; 2], k: usize, channel: usize) -> ChannelError {
    let result = &runs[1].results.receivers[k].channels[channel];
    let worth = bound.receivers[k].channels.worth();
    ChannelError {
        name: result.name.clone(),
        total: estimate::channel(runs, k, channel, worth),
        statistical: result.error,
        cells: CellPairs::new(bound, runs, k, 1 + channel).map_or_else(Vec::new, |cells| cells.cell_errors().0),
    }
}

impl ReceiverError {
    /// Puts in the brightest place, the map and the cells' errors, from the cells of both runs.
    fn set_cells(&mut self, cells: &CellPairs<'_>) {
        let peak = cells.peak();
        self.peak = peak.density;
        self.peak_cells = peak.cells;
        self.map = cells.map();
        self.statistical.peak = peak.statistical;
        self.statistical.map = self.map.statistical;
        (self.cells, self.pooled_cells) = cells.cell_errors();
    }

    /// Whether the cells were compared; those of absorbed power, and of grids of millions, are not.
    pub fn has_cells(&self) -> bool {
        self.peak_cells > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hundred rays resolve a share of a hundredth at best, which a run of a hundred times as many rays knows as well as by its own; few
    /// that bring little each are as many as their spread says.
    #[test]
    fn a_receiver_that_few_rays_reach_is_not_judged() {
        let receiver = |rays: f64, statistical: f64| ReceiverError {
            name: "spot".into(),
            power: Paired { facets: rays, spline: rays, error: 0.0 },
            statistical: Statistical { power: statistical, ..Statistical::default() },
            ..ReceiverError::default()
        };
        let unjudged = |rays: f64, statistical: f64, scale: f64| {
            let receivers = vec![receiver(rays, statistical)];
            let found = GeometricError { rays: 65_536, receivers, ..GeometricError::default() };
            found.unjudged(scale, 65_536.0).is_some()
        };
        assert!(unjudged(0.0, 0.0, 32.0) && unjudged(99.0, 9.95, 100.0) && !unjudged(101.0, 10.05, 100.0));
        assert!(!unjudged(1.0, 0.01, 100.0));
    }

    #[test]
    fn a_ray_that_no_replicate_saw_may_have_moved_every_figure() {
        let same = |x: f64| Paired { facets: x, spline: x, error: 0.0 };
        let receiver = ReceiverError {
            power: same(3.0),
            centroid: [same(0.0), same(100.0)],
            rms: [same(2.0), same(101.0)],
            width: [same(2.0), same(5.0)],
            peak: same(7.0),
            ..ReceiverError::default()
        };
        let found = GeometricError { rays: 30, receivers: vec![receiver], ..GeometricError::default() };
        // A third of what was emitted: ten rays came.
        let r = &found.with_unseen_rays(9.0).receivers[0];
        // One ray of ten, at a standard deviation from the mean, moves that by a tenth of the deviation wherever the mean is.
        let errors = [r.power, r.centroid[0], r.centroid[1], r.rms[0], r.width[1], r.peak].map(|p| p.geometric());
        for (error, expected) in errors.into_iter().zip([0.3, 0.2, 0.5, 0.2, 0.5, 0.7]) {
            assert!((error - expected).abs() < 1e-12, "{errors:?}");
        }
    }
}

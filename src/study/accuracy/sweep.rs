//! The sweep itself: meshes, structures, alternating rounds, and a forecast of the time left.

use super::{Accuracy, Row, Settings, front, sentence, slopes};
use crate::intersect::{Hit, Intersector, NormalMode};
use crate::math::Ray;
use crate::study::hit_errors::HitErrors;
use crate::study::mesh_source::{FacetTree, MeasuredMesh, MeshSource, answer, with_intersectors};
use crate::study::rays::{RaySource, Uniform};
use crate::study::timing::Countdown;
use crate::study::{Progress, Rounds, Timing};
use std::sync::Mutex;
use std::time::Instant;

/// Sweeps the tolerances, kinds of normals and trees of the settings over one model, against the exact hits of the same rays. Runs on the
/// current rayon pool; calls `progress` with a forecast of the time left.
pub fn accuracy(
    name: &str,
    mesh_source: &dyn MeshSource,
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Accuracy {
    let mut countdown = Countdown::new(progress);
    countdown.stage("the exact spline", None);
    // Any facets give the box that rays are shot through.
    let coarse = mesh_source.mesh(settings.tolerances.first().copied().unwrap_or([0.2, 0.2]));
    let source = Uniform::new(&coarse.mesh.bounds(), settings.seed, settings.rays);
    let rays = source.rays(0..source.len());
    let mut study =
        Sweep { name, mesh_source, settings, rays: &rays, truth: Vec::new(), rows: Vec::new(), countdown };
    study.time_spline();
    // Facets in either structure take about four fifths of the spline's time, all kinds of normals and meshing taken together.
    let combinations = (settings.trees.len() * settings.normals.len() * (settings.rounds + 1)) as f64;
    let guess = 0.8 * combinations * study.rows.iter().map(|r| r.seconds_trace_median).sum::<f64>();
    let mut ahead = Forecast { tolerances: settings.tolerances.clone(), known: Vec::new(), guess };
    let mut blocks: Vec<(usize, Vec<Row>)> = vec![(0, std::mem::take(&mut study.rows))];
    // One in the middle, which is quick and predicts most of the rest, then the finest, whose facets cost most, then coarse to fine.
    let mut order: Vec<usize> = (0..settings.tolerances.len()).collect();
    order.sort_by(|&a, &b| ahead.log_tolerance(b).total_cmp(&ahead.log_tolerance(a)));
    let first: Vec<usize> = order.get(order.len() / 2).into_iter().chain(order.last()).copied().collect();
    order.retain(|k| !first.contains(k));
    for k in first.iter().copied().take(settings.tolerances.len()).chain(order) {
        if ahead.known.iter().any(|x| x.0 == k) {
            continue;
        }
        let [low, high] = settings.tolerances[k];
        let range = if low == high { format!("{low} mm") } else { format!("{low}..{high} mm") };
        // Known at least is the guess, of as many tolerances as there are.
        let left = ahead.seconds() + settings.seconds_after;
        study.countdown.stage(&format!("tolerance {range}"), Some(left));
        let start = Instant::now();
        let prepare = study.time_tolerance([low, high]);
        ahead.known.push((k, [prepare, start.elapsed().as_secs_f64() - prepare]));
        blocks.push((k + 1, std::mem::take(&mut study.rows)));
    }
    study.countdown.stage("done", Some(settings.seconds_after));
    // Rows are reported from coarse to fine, whichever came first.
    blocks.sort_by_key(|b| b.0);
    let rows: Vec<Row> = blocks.into_iter().flat_map(|b| b.1).collect();
    let answer = sentence(&rows, 0.05);
    Accuracy { slopes: slopes(&rows), front: front(&rows), answer, rows }
}

/// Seconds of the tolerances still to come.
struct Forecast {
    tolerances: Vec<[f64; 2]>,
    /// Those done, with their seconds of meshing and building, and of tracing and judging.
    known: Vec<(usize, [f64; 2])>,
    /// Seconds of one tolerance while none is known.
    guess: f64,
}

impl Forecast {
    /// Returns the logarithm of the geometric middle of the `k`-th range of tolerances.
    fn log_tolerance(&self, k: usize) -> f64 {
        0.5 * (self.tolerances[k][0] * self.tolerances[k][1]).ln()
    }

    /// Forecasts the seconds of all tolerances to come. Meshing and building go with the facets, that is with 1/tolerance; tracing grows
    /// evenly with its logarithm, by about a tenth per halving where only one tolerance is known.
    fn seconds(&self) -> f64 {
        let mut known: Vec<(f64, [f64; 2])> = self.known.iter().map(|&(k, s)| (self.log_tolerance(k), s)).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(&first), Some(&last)) = (known.first(), known.last()) else {
            return self.guess * self.tolerances.len() as f64;
        };
        let left = (0..self.tolerances.len()).filter(|k| !self.known.iter().any(|x| x.0 == *k));
        let alone = |(at, [prepare, trace]): (f64, [f64; 2]), x: f64| {
            let halvings = (at - x) / std::f64::consts::LN_2;
            let slower = if halvings > 0.0 { 1.0 + 0.1 * halvings } else { 1.0 / (1.0 - 0.1 * halvings) };
            prepare * (at - x).exp() + trace * slower
        };
        let one = |k: usize| {
            let x = self.log_tolerance(k);
            let i = known.partition_point(|p| p.0 < x);
            // Between two that are known, along the two laws; beyond them, by the laws from the nearest one.
            match (i.checked_sub(1).map(|j| known[j]), known.get(i)) {
                (Some(a), Some(b)) => {
                    let share = |f: fn(f64) -> f64| (f(x) - f(a.0)) / (f(b.0) - f(a.0));
                    let along = |m: usize, s: f64| a.1[m] + (b.1[m] - a.1[m]) * s;
                    along(0, share(|x| (-x).exp())) + along(1, share(|x| x))
                }
                (None, _) => alone(first, x),
                (Some(_), None) => alone(last, x),
            }
        };
        left.map(one).sum()
    }
}

/// The study under way: rays, their truth, and the rows so far.
struct Sweep<'a> {
    name: &'a str,
    mesh_source: &'a dyn MeshSource,
    settings: &'a Settings,
    rays: &'a [Ray],
    truth: Vec<Option<Hit>>,
    rows: Vec<Row>,
    countdown: Countdown<'a>,
}

/// One structure in the race, with its latest hits.
struct Runner<'a> {
    intersector: &'a dyn Intersector,
    hits: Mutex<Vec<Option<Hit>>>,
}

impl Sweep<'_> {
    /// Times the runners on all rays in alternating rounds, in seconds and in their order; each is left with its hits.
    fn time_alternating(&self, runners: &[Runner<'_>], threads: usize) -> Vec<Timing> {
        let mut rounds = Rounds::default();
        for runner in runners {
            rounds.add("", || {
                self.countdown.tick();
                if let Ok(mut hits) = runner.hits.lock() {
                    answer(runner.intersector, self.rays, threads, &mut hits);
                }
            });
        }
        rounds.run(self.settings.rounds).into_iter().map(|r| r.1).collect()
    }

    /// Makes a structure ready to race, without hits yet.
    fn runner<'a>(&self, intersector: &'a dyn Intersector) -> Runner<'a> {
        Runner { intersector, hits: Mutex::new(vec![None; self.rays.len()]) }
    }

    /// Times the exact spline, adds its rows, and keeps its hits as the truth of all that follows.
    fn time_spline(&mut self) {
        let intersector = self.mesh_source.exact();
        let runners = [self.runner(intersector)];
        for &threads in &self.settings.threads {
            let timing = self.time_alternating(&runners, threads)[0];
            let footprint = intersector.footprint();
            let row = Row { facets: footprint.primitives, bytes: footprint.bytes, ..Row::default() };
            let row = Row {
                normals: "exact".into(),
                intersector: "exact".into(),
                seconds_build: footprint.build_seconds,
                ..row
            };
            self.push_row(row, timing, threads);
        }
        let [runner] = runners;
        self.truth = runner.hits.into_inner().unwrap_or_else(|e| e.into_inner());
    }

    /// Makes facets of a tolerance `[min, max]`, mm, times every tree and kind of normals on them, and adds their rows; returns the seconds
    /// of meshing and building.
    fn time_tolerance(&mut self, tolerance: [f64; 2]) -> f64 {
        let start = Instant::now();
        let meshed = self.mesh_source.mesh(tolerance);
        let settings = self.settings;
        let mesh_source = self.mesh_source;
        with_intersectors(mesh_source, &meshed.mesh, &settings.trees, &settings.normals, |combinations| {
            let prepare = start.elapsed().as_secs_f64();
            // All kinds in one race: a slow phase of the machine meets them alike.
            let runners: Vec<Runner<'_>> = combinations.iter().map(|c| self.runner(c.2)).collect();
            for &threads in &settings.threads {
                let timings = self.time_alternating(&runners, threads);
                for ((combination, runner), timing) in combinations.iter().zip(&runners).zip(timings) {
                    // Hits are the same in every round; those of the last one are judged.
                    let hits = runner.hits.lock().unwrap_or_else(|e| e.into_inner()).clone();
                    let row = self.facet_row(tolerance, &meshed, *combination, &hits);
                    self.push_row(row, timing, threads);
                }
            }
            prepare
        })
    }

    /// Returns the row of a tree on a mesh, with the errors of its hits against the truth; what tracing took is left out.
    fn facet_row(
        &self,
        tolerance: [f64; 2],
        meshed: &MeasuredMesh,
        (tree, normals, intersector): (FacetTree, NormalMode, &dyn Intersector),
        hits: &[Option<Hit>],
    ) -> Row {
        let errors = HitErrors::between(self.rays, hits, &self.truth);
        let footprint = intersector.footprint();
        Row {
            tolerance_mm: Some(tolerance[0]),
            adaptive: tolerance[0] != tolerance[1],
            normals: normals.name().into(),
            intersector: tree.name().into(),
            facets: meshed.mesh.facets.len(),
            bytes: footprint.bytes + meshed.mesh.bytes(),
            sag_mean_mm: Some(meshed.sag_mean),
            sag_max_mm: Some(meshed.sag_max),
            seconds_tessellate: Some(meshed.seconds),
            seconds_build: footprint.build_seconds,
            hit_error_mm_p50: errors.position.quantile(0.5),
            hit_error_mm_p99: errors.position.quantile(0.99),
            direction_error_deg_p50: errors.reflected.quantile(0.5),
            direction_error_deg_rms: errors.reflected.rms(),
            direction_error_deg_p99: errors.reflected.quantile(0.99),
            direction_error_deg_max: errors.reflected.max(),
            refracted_error_deg_rms: errors.refracted.rms(),
            refracted_error_deg_p99: errors.refracted.quantile(0.99),
            flips: errors.flips,
            ..Row::default()
        }
    }

    /// Adds a row with the times of its rounds.
    fn push_row(&mut self, row: Row, timing: Timing, threads: usize) {
        self.rows.push(Row {
            model: self.name.into(),
            threads,
            seconds_trace_min: timing.min,
            seconds_trace_median: timing.median,
            seconds_trace_p90: timing.p90,
            rays: self.rays.len() as u64,
            ..row
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forecasts_are_right_after_the_first_tolerance() {
        let uniform = [1.6, 0.8, 0.4, 0.2, 0.1, 0.05, 0.025, 0.0125].map(|t| [t, t]);
        let tolerances: Vec<[f64; 2]> = uniform.into_iter().chain([[0.05, 0.2]]).collect();
        // Seconds as on a lamp: meshing and building with 1/tolerance and a little for the borders, tracing with its logarithm.
        for (growth, share) in [(0.02, 0.1), (0.06, 0.1), (0.15, 0.1), (0.06, 0.3), (0.06, 1.0)] {
            let seconds = |t: [f64; 2]| {
                let middle = (t[0] * t[1]).sqrt();
                [share * (0.1 / middle + 0.3), 2.0 * (1.0 + growth * (0.1 / middle).log2())]
            };
            let mut ahead = Forecast { tolerances: tolerances.clone(), known: Vec::new(), guess: 0.0 };
            for k in [4, 7, 0, 1, 2] {
                ahead.known.push((k, seconds(tolerances[k])));
                let left = |k: &usize| !ahead.known.iter().any(|x| x.0 == *k);
                let truth: f64 =
                    (0..tolerances.len()).filter(left).map(|k| seconds(tolerances[k]).iter().sum::<f64>()).sum();
                let ratio = ahead.seconds() / truth;
                assert!((ratio - 1.0).abs() < 0.3, "{growth}, {share}: {ratio} with {} known", ahead.known.len());
            }
        }
    }
}

//! The sweep itself: meshes, structures, alternating rounds, and a forecast of the time left.

use super::{Accuracy, Row, Settings, front, sentence, slopes};
use crate::intersect::{Hit, Intersector, NormalMode};
use crate::math::Ray;
use crate::study::errors::Errors;
use crate::study::rays::{RaySource, Uniform};
use crate::study::timing::Countdown;
use crate::study::workshop::{Meshed, Tree, Workshop, answer, with_all};
use crate::study::{Progress, Rounds, Timing};
use std::sync::Mutex;
use std::time::Instant;

/// Sweeps a model. Runs on the current rayon pool.
pub fn accuracy(
    name: &str,
    workshop: &dyn Workshop,
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Accuracy {
    let mut countdown = Countdown::new(progress);
    countdown.stage("the exact spline", None);
    let coarse = workshop.mesh(settings.tolerances.first().copied().unwrap_or([0.2, 0.2]));
    let source = Uniform::new(&coarse.mesh.bounds(), settings.seed, settings.rays);
    let rays = source.rays(0..source.len());
    let mut study = Sweep { name, workshop, settings, rays: &rays, truth: Vec::new(), rows: Vec::new(), countdown };
    study.exact();
    let mut ahead = Forecast { tolerances: settings.tolerances.clone(), known: Vec::new() };
    let mut blocks: Vec<(usize, Vec<Row>)> = vec![(0, std::mem::take(&mut study.rows))];
    // The finest first, then the coarsest: all that is left lies between, and so does its time.
    let mut order: Vec<usize> = (0..settings.tolerances.len()).collect();
    order.sort_by(|&a, &b| ahead.fineness(a).total_cmp(&ahead.fineness(b)));
    order.get_mut(1..).into_iter().for_each(|rest| rest.reverse());
    for k in order {
        let [low, high] = settings.tolerances[k];
        let range = if low == high { format!("{low} mm") } else { format!("{low}..{high} mm") };
        let left = ahead.seconds().map(|s| s + settings.seconds_after);
        study.countdown.stage(&format!("tolerance {range}"), left);
        let start = Instant::now();
        study.tolerance([low, high]);
        ahead.known.push((k, start.elapsed().as_secs_f64()));
        blocks.push((k + 1, std::mem::take(&mut study.rows)));
    }
    study.countdown.stage("done", Some(settings.seconds_after));
    blocks.sort_by_key(|b| b.0);
    let rows: Vec<Row> = blocks.into_iter().flat_map(|b| b.1).collect();
    let answer = sentence(&rows, 0.05);
    Accuracy { slopes: slopes(&rows), front: front(&rows), answer, rows }
}

/// Seconds of the tolerances still to come.
struct Forecast {
    tolerances: Vec<[f64; 2]>,
    /// Those done, with their seconds.
    known: Vec<(usize, f64)>,
}

impl Forecast {
    /// Logarithm of the middle of a range of tolerances.
    fn fineness(&self, k: usize) -> f64 {
        0.5 * (self.tolerances[k][0] * self.tolerances[k][1]).ln()
    }

    /// Between two known tolerances time is a power of the tolerance; on one side of all known ones it stays as it is there.
    fn seconds(&self) -> Option<f64> {
        let mut known: Vec<(f64, f64)> =
            self.known.iter().map(|&(k, s)| (self.fineness(k), s.max(1e-9).ln())).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (*known.first()?, *known.last()?);
        let left = (0..self.tolerances.len()).filter(|k| !self.known.iter().any(|x| x.0 == *k));
        let one = |k: usize| {
            let x = self.fineness(k);
            let i = known.partition_point(|p| p.0 <= x);
            match (i.checked_sub(1).map(|j| known[j]), known.get(i)) {
                (Some(a), Some(b)) => (a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)).exp(),
                (None, _) => first.1.exp(),
                // Coarser than all known: fewer facets are traced a little faster.
                _ if known.len() == 1 => 0.75 * last.1.exp(),
                _ => last.1.exp(),
            }
        };
        Some(left.map(one).sum())
    }
}

struct Sweep<'a> {
    name: &'a str,
    workshop: &'a dyn Workshop,
    settings: &'a Settings,
    rays: &'a [Ray],
    truth: Vec<Option<Hit>>,
    rows: Vec<Row>,
    countdown: Countdown<'a>,
}

/// One structure in the race, with its latest hits.
struct Runner<'a> {
    who: &'a dyn Intersector,
    hits: Mutex<Vec<Option<Hit>>>,
}

impl Sweep<'_> {
    fn race(&self, runners: &[Runner<'_>], threads: usize) -> Vec<Timing> {
        let mut rounds = Rounds::default();
        for runner in runners {
            rounds.add("", || {
                self.countdown.tick();
                if let Ok(mut hits) = runner.hits.lock() {
                    answer(runner.who, self.rays, threads, &mut hits);
                }
            });
        }
        rounds.run(self.settings.rounds).into_iter().map(|r| r.1).collect()
    }

    fn runner<'a>(&self, who: &'a dyn Intersector) -> Runner<'a> {
        Runner { who, hits: Mutex::new(vec![None; self.rays.len()]) }
    }

    fn exact(&mut self) {
        let who = self.workshop.exact();
        let runners = [self.runner(who)];
        for &threads in &self.settings.threads {
            let timing = self.race(&runners, threads)[0];
            let footprint = who.footprint();
            let row = Row { facets: footprint.primitives, bytes: footprint.bytes, ..Row::default() };
            let row = Row {
                normals: "exact".into(),
                intersector: "exact".into(),
                seconds_build: footprint.build_seconds,
                ..row
            };
            self.push(row, timing, threads);
        }
        let [runner] = runners;
        self.truth = runner.hits.into_inner().unwrap_or_default();
    }

    fn tolerance(&mut self, tolerance: [f64; 2]) {
        let meshed = self.workshop.mesh(tolerance);
        let settings = self.settings;
        let workshop = self.workshop;
        with_all(workshop, &meshed.mesh, &settings.trees, &settings.normals, |combinations| {
            let runners: Vec<Runner<'_>> = combinations.iter().map(|c| self.runner(c.2)).collect();
            for &threads in &settings.threads {
                let timings = self.race(&runners, threads);
                for ((combination, runner), timing) in combinations.iter().zip(&runners).zip(timings) {
                    let hits = runner.hits.lock().map(|h| h.clone()).unwrap_or_default();
                    let row = self.row(tolerance, &meshed, *combination, &hits);
                    self.push(row, timing, threads);
                }
            }
        });
    }

    fn row(
        &self,
        tolerance: [f64; 2],
        meshed: &Meshed,
        (tree, normals, who): (Tree, NormalMode, &dyn Intersector),
        hits: &[Option<Hit>],
    ) -> Row {
        let errors = Errors::of(self.rays, hits, &self.truth);
        let footprint = who.footprint();
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
            hit_error_mm_p50: errors.position.at(0.5),
            hit_error_mm_p99: errors.position.at(0.99),
            direction_error_deg_p50: errors.reflected.at(0.5),
            direction_error_deg_rms: errors.reflected.rms(),
            direction_error_deg_p99: errors.reflected.at(0.99),
            direction_error_deg_max: errors.reflected.max(),
            refracted_error_deg_rms: errors.refracted.rms(),
            refracted_error_deg_p99: errors.refracted.at(0.99),
            flips: errors.flips,
            ..Row::default()
        }
    }

    fn push(&mut self, row: Row, timing: Timing, threads: usize) {
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

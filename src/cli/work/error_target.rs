//! `--until-error P%@RECEIVER`: as many rays as the error asks for.
//!
//! Runs of growing length are traced, each from its beginning, until one is good enough; so the result is the very one of
//! `--rays N`, whatever number of threads found the N. The runs before the last cost about half of it at most.

use super::scene_run::{PreparedScene, TraceRequest};
use crate::cli::arguments::suggest;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::report::{figures, grouped};
use crate::simulate::{PartialRun, ReceiverResult, Results, Scene};
use serde::Serialize;

/// Rays of the first run.
const FIRST_RAYS: u64 = 50_000;
/// The most rays, when the options do not say.
const MOST_RAYS: u64 = 10_000_000_000;

/// Growth of the rays from one run to the next where nothing arrived.
const GROWTH_FROM_NOTHING: f64 = 16.0;
/// More rays than the error asks for, for the error has an error.
const GROWTH_MARGIN: f64 = 1.1;
/// Least and greatest growth: fewer would be a run for little, more would trust a poor first error too much.
const GROWTH_RANGE: [f64; 2] = [2.0, 64.0];

/// What is asked for.
#[derive(Debug, PartialEq)]
pub(crate) struct ErrorTarget {
    percent: f64,
    receiver: String,
    cells: bool,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TargetResult {
    pub(crate) receiver: String,
    #[serde(rename = "of")]
    quantity: &'static str,
    asked_percent: f64,
    found_percent: Option<f64>,
    pub(crate) rays: u64,
    pub(crate) reached: bool,
}

impl ErrorTarget {
    pub(crate) fn new(text: &str, scene: &Scene) -> Result<Self, Failure> {
        let form = || {
            Failure::arguments(format!("--until-error {text}: write P%@RECEIVER, as in 0.5%@wall or 3%@wall:cells"))
        };
        let (percent, receiver) = text.split_once('@').ok_or_else(form)?;
        let percent = percent.trim().trim_end_matches('%').trim().parse::<f64>().map_err(|_| form())?;
        if !(percent > 0.0 && percent < 100.0) {
            return Err(Failure::arguments(format!(
                "--until-error {text}: {percent} % is not above 0 and below 100"
            )));
        }
        let (receiver, cells) = match receiver.strip_suffix(":cells") {
            Some(name) => (name, true),
            None => (receiver, false),
        };
        let names: Vec<&str> = scene.receivers.iter().map(|r| r.name.as_str()).collect();
        if !names.contains(&receiver) {
            let failure = Failure::arguments(format!("--until-error: the scene has no receiver '{receiver}'"));
            return Err(failure.with_help(suggest::closest_name("its receivers are", receiver, &names)));
        }
        Ok(Self { percent, receiver: receiver.into(), cells })
    }

    /// The relative error of a run, percent; `None` where nothing arrived.
    fn error(&self, results: &Results) -> Option<f64> {
        let r = results.receivers.iter().find(|r| r.name == self.receiver)?;
        let (power, error) = if self.cells { light_weighted_error(r) } else { (r.power, r.power_error) };
        (power > 0.0).then(|| 100.0 * error / power)
    }

    /// Traces until the error is small enough, the most rays are traced, or a signal asks to stop: then not all is traced.
    pub(crate) fn trace(&self, prepared: &mut PreparedScene, console: &Console) -> (PartialRun, TargetResult) {
        let most = prepared.job.tracing.rays().unwrap_or(MOST_RAYS);
        let mut rays = FIRST_RAYS.min(most);
        loop {
            prepared.rays = Some(rays);
            let (portion, found) = self.attempt(prepared, console);
            let reached = found.is_some_and(|e| e <= self.percent);
            let is_stopped = !portion.is_whole();
            if reached || is_stopped || rays >= most {
                let quantity = if self.cells { "cells" } else { "power" };
                let result = TargetResult {
                    receiver: self.receiver.clone(),
                    quantity,
                    asked_percent: self.percent,
                    found_percent: found,
                    rays,
                    reached,
                };
                return (portion, result);
            }
            // The error falls at least as the root of the rays.
            let growth = found.map_or(GROWTH_FROM_NOTHING, |e| {
                (GROWTH_MARGIN * (e / self.percent).powi(2)).clamp(GROWTH_RANGE[0], GROWTH_RANGE[1])
            });
            rays = ((rays as f64 * growth) as u64).min(most);
            console.say(format_args!(
                "{} %: going on with {} rays",
                found.map_or("nothing arrives".into(), |e| figures(e, 2)),
                grouped(rays)
            ));
        }
    }

    fn attempt(&self, prepared: &PreparedScene, console: &Console) -> (PartialRun, Option<f64>) {
        let settings = prepared.run_settings();
        prepared.with_intersector(console, |intersector, _| {
            let request = TraceRequest { is_saveable: true, ..TraceRequest::default() };
            let traced = prepared.run(intersector, &settings, request, console);
            let portion = traced.partial.clone();
            (portion, self.error(&Results::new(&prepared.bound, &settings, traced)))
        })
    }

    /// What came of it, in words.
    pub(crate) fn sentence(&self, result: &TargetResult) -> String {
        let found = result.found_percent.map_or("nothing arrived".into(), |e| format!("{} %", figures(e, 2)));
        let what = if self.cells { "the cells" } else { "the power" };
        let verdict = if result.reached { "reached" } else { "**not reached**" };
        format!(
            "Asked for a statistical error of {} % of {what} on {}: {verdict} with {} rays ({found}).",
            self.percent,
            self.receiver,
            grouped(result.rays)
        )
    }
}

/// Sums over the cells of the light, and of the error, each weighted by the light.
fn light_weighted_error(r: &ReceiverResult) -> (f64, f64) {
    let sum = |x: &mut dyn Iterator<Item = f64>| x.sum::<f64>();
    (sum(&mut r.cells.iter().map(|c| c * c)), sum(&mut r.cells.iter().zip(&r.errors).map(|(c, e)| c * e)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_words_are_understood_or_explained() {
        let text = "[[source]]\nkind = 'point'\n[[receiver]]\nname = 'wall'\nsize = [1, 1]\n";
        let scene = Scene::parse(text, "s.toml", Path::new(".")).unwrap();
        let ok = |t: &str| ErrorTarget::new(t, &scene).unwrap();
        assert_eq!(ok("0.5%@wall"), ErrorTarget { percent: 0.5, receiver: "wall".into(), cells: false });
        assert_eq!(ok("3@wall:cells"), ErrorTarget { percent: 3.0, receiver: "wall".into(), cells: true });
        for (wrong, says) in
            [("5%", "P%@RECEIVER"), ("x%@wall", "P%@RECEIVER"), ("0@wall", "above 0"), ("1%@wal", "'wal'")]
        {
            assert!(ErrorTarget::new(wrong, &scene).unwrap_err().to_string().contains(says), "{wrong}");
        }
    }
}

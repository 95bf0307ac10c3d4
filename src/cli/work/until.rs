//! `--until-error P%@RECEIVER`: as many rays as the error asks for.
//!
//! Runs of growing length are traced, each from its beginning, until one is good enough; so the result is the very one of
//! `--rays N`, whatever number of threads found the N. The runs before the last cost about half of it at most.

use super::engine;
use super::job::{Prepared, Ways};
use crate::cli::Failure;
use crate::cli::arguments::suggest;
use crate::cli::context::Context;
use crate::report::{figures, grouped};
use crate::simulate::{Portion, ReceiverResult, Results, Scene};
use serde::Serialize;

/// Rays of the first run.
const FIRST: u64 = 50_000;
/// The most rays, when the options do not say.
const MOST: u64 = 10_000_000_000;

/// What is asked for.
#[derive(Debug, PartialEq)]
pub(crate) struct Until {
    percent: f64,
    receiver: String,
    cells: bool,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Answer {
    pub(crate) receiver: String,
    of: &'static str,
    asked_percent: f64,
    found_percent: Option<f64>,
    rays: u64,
    pub(crate) reached: bool,
}

impl Until {
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
            return Err(failure.help(suggest::names("its receivers are", receiver, &names)));
        }
        Ok(Self { percent, receiver: receiver.into(), cells })
    }

    /// The relative error of a run, percent; `None` where nothing arrived.
    fn error(&self, results: &Results) -> Option<f64> {
        let r = results.receivers.iter().find(|r| r.name == self.receiver)?;
        let (power, error) = if self.cells { weighted(r) } else { (r.power, r.power_error) };
        (power > 0.0).then(|| 100.0 * error / power)
    }

    /// Traces until the error is small enough.
    pub(crate) fn trace(&self, prepared: &mut Prepared, context: &Context) -> (Portion, Answer) {
        let most = prepared.job.tracing.rays.unwrap_or(MOST);
        let mut rays = FIRST.min(most);
        loop {
            prepared.rays = Some(rays);
            let (portion, found) = self.attempt(prepared, context);
            let reached = found.is_some_and(|e| e <= self.percent);
            if reached || rays >= most {
                let of = if self.cells { "cells" } else { "power" };
                let (receiver, asked_percent) = (self.receiver.clone(), self.percent);
                return (portion, Answer { receiver, of, asked_percent, found_percent: found, rays, reached });
            }
            // The error falls at least as the root of the rays; a tenth more, for the error has an error.
            let more = found.map_or(16.0, |e| (1.1 * (e / self.percent).powi(2)).clamp(2.0, 64.0));
            rays = ((rays as f64 * more) as u64).min(most);
            context.say(format_args!(
                "{} %: going on with {} rays",
                found.map_or("nothing arrives".into(), |e| figures(e, 2)),
                grouped(rays)
            ));
        }
    }

    fn attempt(&self, prepared: &Prepared, context: &Context) -> (Portion, Option<f64>) {
        let (model, mesh) = (&prepared.job.loaded.model, &prepared.tessellation.mesh);
        let settings = prepared.run_settings();
        engine::with_intersector(prepared.choice, model, mesh, context, |intersector, _| {
            let traced = prepared.run(intersector, &settings, Ways::default(), context);
            let portion = traced.portion.clone();
            (portion, self.error(&Results::of(&prepared.bound, &settings, traced)))
        })
    }

    /// What came of it, in words.
    pub(crate) fn sentence(&self, answer: &Answer) -> String {
        let found = answer.found_percent.map_or("nothing arrived".into(), |e| format!("{} %", figures(e, 2)));
        let what = if self.cells { "the cells" } else { "the power" };
        let verdict = if answer.reached { "reached" } else { "**not reached**" };
        format!(
            "Asked for a statistical error of {} % of {what} on {}: {verdict} with {} rays ({found}).",
            self.percent,
            self.receiver,
            grouped(answer.rays)
        )
    }
}

/// Sums over the cells of the light, and of the error, each weighted by the light.
fn weighted(r: &ReceiverResult) -> (f64, f64) {
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
        let ok = |t: &str| Until::new(t, &scene).unwrap();
        assert_eq!(ok("0.5%@wall"), Until { percent: 0.5, receiver: "wall".into(), cells: false });
        assert_eq!(ok("3@wall:cells"), Until { percent: 3.0, receiver: "wall".into(), cells: true });
        for (wrong, says) in
            [("5%", "P%@RECEIVER"), ("x%@wall", "P%@RECEIVER"), ("0@wall", "above 0"), ("1%@wal", "'wal'")]
        {
            assert!(Until::new(wrong, &scene).unwrap_err().to_string().contains(says), "{wrong}");
        }
    }
}

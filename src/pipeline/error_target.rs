//! `P%@RECEIVER`: as many rays as the error asks for.
//!
//! Runs of growing length are traced, each from its beginning, until one is good enough; so the result is the very one of
//! `--rays N`, whatever number of threads found the N. The runs before the last cost together about as much as it at most, and an octree
//! each where there is no cache.

use super::error::Error;
use super::growing_search::{GrowingSearch, growth_margin, most_rays, next_rays};
use super::monitor::Monitor;
use super::prepared_scene::PreparedScene;
use crate::simulate::{GROWING_REPLICATE, PartialRun, ReceiverResult, Results, Scene};
use crate::study::figures::{cell_errors, light_weighted_error};
use crate::text::nearest_or_listed;
use serde::Serialize;

/// Rays of the first run.
const FIRST_RAYS: u64 = 50_000;
/// Growth of the rays from one run to the next where nothing arrived, or no error is known.
const GROWTH_FROM_NOTHING: f64 = 16.0;
/// No answer asks for more rays than these: a machine's word holds them.
const MOST_WANTED: f64 = 1e18;

/// The error to reach.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorTarget {
    /// Relative error, percent.
    pub percent: f64,
    /// Name of the receiver.
    pub receiver: String,
    /// Whether it is the error of the cells, weighted by their light ([`light_weighted_error`]), and not that of the power.
    pub cells: bool,
}

/// The outcome.
#[derive(Clone, Debug, Serialize)]
pub struct TargetResult {
    /// Name of the receiver.
    pub receiver: String,
    /// `power` or `cells`.
    #[serde(rename = "of")]
    pub quantity: &'static str,
    /// Error that was asked for, percent.
    pub asked_percent: f64,
    /// Error that was found, percent; absent where nothing arrived.
    pub found_percent: Option<f64>,
    /// Rays of the run.
    pub rays: u64,
    /// Whether the error found is at most the one asked for.
    pub reached: bool,
    /// Rays that are still missing, by the error found, in whole replicates of a run that grows; 0 where it is reached, and where
    /// all of the error is the rounding of each ray, which more of them do not lessen.
    pub missing_rays: u64,
}

impl ErrorTarget {
    /// Parses `P%@RECEIVER` or `P%@RECEIVER:cells`, whatever receivers there are.
    ///
    /// # Errors
    /// When the text is neither, or P is not above 0 and below 100.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let about = |message: String| Error::setting("until_error", format!("{text}: {message}"));
        let form = || about("write P%@RECEIVER, as in 0.5%@wall or 3%@wall:cells".into());
        let (percent, receiver) = text.split_once('@').ok_or_else(form)?;
        let percent = percent.trim().trim_end_matches('%').trim().parse::<f64>().map_err(|_| form())?;
        if !(percent > 0.0 && percent < 100.0) {
            return Err(about(format!("{percent} % is not above 0 and below 100")));
        }
        let (receiver, cells) = match receiver.strip_suffix(":cells") {
            Some(name) => (name, true),
            None => (receiver, false),
        };
        if receiver.is_empty() {
            return Err(form());
        }
        Ok(Self { percent, receiver: receiver.into(), cells })
    }

    /// Parses `P%@RECEIVER` or `P%@RECEIVER:cells` for a scene.
    ///
    /// # Errors
    /// As [`Self::parse`], and when the scene has no such receiver, or a source of it has `rays` of its own.
    pub fn new(text: &str, scene: &Scene) -> Result<Self, Error> {
        let target = Self::parse(text)?;
        let about = |message: String| Error::setting("until_error", format!("{text}: {message}"));
        let receiver = target.receiver.as_str();
        let names: Vec<&str> = scene.receivers.iter().map(|r| r.name.as_str()).collect();
        if !names.contains(&receiver) {
            let error = about(format!("the scene has no receiver '{receiver}'"));
            let advice = nearest_or_listed(receiver, names);
            return Err(error.help(advice.unwrap_or_else(|| "it has no receivers: add a [[receiver]]".into())));
        }
        // Rays of its own do not grow with the run: more would be asked for than are ever traced.
        if scene.sources.iter().any(|s| s.rays.is_some()) {
            let error = about("a source with `rays` of its own does not grow".into());
            return Err(error.help("take `rays` out of the [[source]]s"));
        }
        Ok(target)
    }

    /// Returns the relative statistical error of the receiver's power or cells, percent; `None` where nothing arrived.
    fn error(&self, results: &Results) -> Option<f64> {
        let r = results.receivers.iter().find(|r| r.name == self.receiver)?;
        let share = if self.cells {
            light_weighted_error(&r.cells, &cell_errors(r))
        } else {
            (r.power > 0.0).then(|| r.power_error / r.power)
        };
        share.map(|share| 100.0 * share)
    }

    /// Traces runs of growing length, each from its first ray, until the error is small enough, the most rays are traced, or the monitor
    /// asks to stop: then not all is traced. Sets `prepared.rays` to the number of the last.
    pub fn trace(
        &self,
        prepared: &mut PreparedScene,
        search: GrowingSearch<'_>,
        monitor: &dyn Monitor,
    ) -> (PartialRun, TargetResult) {
        let most = most_rays(prepared);
        let mut rays = search.first_rays(FIRST_RAYS, most);
        loop {
            prepared.rays = Some(rays);
            let (partial, results) = search.trace(prepared, monitor);
            let result = self.result(&results);
            if result.missing_rays == 0 || !partial.is_whole() || rays >= most {
                return (partial, result);
            }
            rays = next_rays(rays, self.growth(result.found_percent, results.replicates), most);
            monitor.grows(result.found_percent, rays);
        }
    }

    /// Returns what the run of these results has reached of this target, and how many rays are missing.
    pub fn result(&self, results: &Results) -> TargetResult {
        let (found, rays) = (self.error(results), results.rays);
        let reached = found.is_some_and(|e| e <= self.percent);
        TargetResult {
            receiver: self.receiver.clone(),
            quantity: if self.cells { "cells" } else { "power" },
            asked_percent: self.percent,
            found_percent: found,
            rays,
            reached,
            missing_rays: if reached || self.is_rounding(results) {
                0
            } else {
                self.missing_rays(found, rays, results.replicates)
            },
        }
    }

    /// Whether all of the error of the power is what rounding to whole quanta may change of each ray.
    fn is_rounding(&self, results: &Results) -> bool {
        let is_asked = |r: &&ReceiverResult| !self.cells && r.name == self.receiver && r.power > 0.0;
        results.receivers.iter().find(is_asked).is_some_and(|r| r.power_error <= results.rounding())
    }

    /// Returns how many rays a run of so many rays and replicates lacks whose error, `found` percent, is too large.
    fn missing_rays(&self, found: Option<f64>, rays: u64, replicates: u32) -> u64 {
        let wanted = (rays as f64 * self.growth(found, replicates)).min(MOST_WANTED) as u64;
        // A run that grows goes by whole replicates.
        wanted.saturating_sub(rays).next_multiple_of(GROWING_REPLICATE).max(GROWING_REPLICATE)
    }

    /// Returns how many times as many rays the target asks for, by an error that falls with their root, and a margin more; may be below 1.
    /// `found` is that error, percent, of so many replicates; without one, as nothing arrived, or of a single replicate, which has none,
    /// the factor is [`GROWTH_FROM_NOTHING`].
    fn growth(&self, found: Option<f64>, replicates: u32) -> f64 {
        // The error falls with the root of the rays, so that they go with the square of what is missing.
        let known = found.filter(|_| replicates > 1);
        known.map_or(GROWTH_FROM_NOTHING, |e| growth_margin(replicates) * (e / self.percent).powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// Twice the error asks for four times the rays, and a third more where it is of 145 replicates (4/√144), in whole replicates.
    #[test]
    fn missing_rays_follow_from_the_error() {
        let target = ErrorTarget { percent: 1.0, receiver: "wall".into(), cells: false };
        let missing = |found: Option<f64>| target.missing_rays(found, 90_000, 145);
        assert_eq!((missing(Some(2.0)), missing(None)), (390_000, 1_350_000));
        // Of one replicate the error counts as the whole light, 10,000 times the rays.
        assert_eq!(target.missing_rays(Some(100.0), 5_000, 1), 75_000);
        // At the very error the margin alone, and of many replicates nearly nothing: still one more.
        let of_many = target.missing_rays(Some(1.001), 90_000, 1_000_001);
        assert_eq!((missing(Some(1.001)), of_many), (35_000, 5_000));
        // However many: 400 times and a third more.
        assert_eq!(missing(Some(20.0)), 47_910_000);
    }

    #[test]
    fn a_source_with_rays_of_its_own_has_no_error_to_reach() {
        let text = "[[source]]\nkind = 'point'\nrays = 1000\n[[receiver]]\nname = 'wall'\nsize = [1, 1]\n";
        let scene = Scene::parse(text, "s.toml", Path::new(".")).unwrap();
        let error = ErrorTarget::new("1%@wall", &scene).unwrap_err();
        assert!(error.to_string().contains("`rays` of its own"), "{error}");
    }

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

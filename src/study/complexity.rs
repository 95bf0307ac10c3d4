//! Table 1 of the seed paper (Dong, Xue, Zhao): three lamps, the time before and after.
//!
//! *Before* is the traditional way, every ray against every spline surface; *after* is facets and tree with the time to make
//! them. Beside them stands the certified spline. All trace the same light with the same random numbers, and the receivers
//! must agree. Preparing and tracing are both timed in alternating rounds; the traditional method is charged its own preparing
//! too. It is given fewer rays, because its time is in proportion to them.

use super::lamp::{Lamp, lamps};
use super::timing::Clock;
use super::{Progress, Rounds, Timing};
use crate::intersect::Intersector;
use crate::model::Model;
use crate::simulate::{BoundScene, Error, RunSettings, Scene, simulate};
use crate::text::grouped;
use serde::Serialize;
use std::cell::Cell;
use std::path::Path;
use std::time::Instant;

/// Called with the intersector that a method has prepared, and its number of facets; `None` on the spline.
pub type OnPrepared<'u> = dyn FnMut(&dyn Intersector, Option<usize>) + 'u;

/// A way to find hits that is timed.
pub struct Method<'a> {
    /// `traditional`, `octree`, `bvh` or `exact`.
    pub name: &'static str,
    /// Prepares an intersector for a model and passes it to the callback, within whose call it lives. Its time, with a callback that does
    /// nothing, is the time to prepare.
    #[expect(clippy::type_complexity, reason = "one callback in, one out")]
    pub prepare: Box<dyn Fn(&Model, &mut OnPrepared<'_>) + 'a>,
}

/// Settings: how many rays, and for how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Rays from the sources for the fast methods.
    pub rays: u64,
    /// Seconds that one run of the traditional method may take; it gets as many rays as that allows.
    pub traditional_seconds: f64,
    /// Timed rounds, beside one that is not timed.
    pub rounds: usize,
    /// Threads; 0 for all.
    pub threads: usize,
    /// Seed of the rays.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { rays: 500_000, traditional_seconds: 4.0, rounds: 3, threads: 0, seed: 1 }
    }
}

/// One method on one lamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// `simple`, `moderate`, `intricate`; the paper's rows are marked.
    pub model: String,
    /// Bézier patches of the lamp.
    pub patches: Option<usize>,
    /// Facets, for facets.
    pub facets: Option<usize>,
    /// `traditional`, `octree`, `bvh`, `exact`.
    pub method: String,
    /// Meshing and building, the middle of the rounds.
    pub seconds_prepare: Option<f64>,
    /// The fastest of the rounds.
    pub seconds_prepare_min: Option<f64>,
    /// Seconds of the fastest round for all rays of this row.
    pub seconds_trace_min: Option<f64>,
    /// Seconds of the middle round for all rays of this row.
    pub seconds_trace_median: Option<f64>,
    /// Seconds that 90 % of the rounds stayed below, for all rays of this row.
    pub seconds_trace_p90: Option<f64>,
    /// Rays from the sources.
    pub rays: Option<u64>,
    /// Seconds of the traditional method for as many rays (its preparing, and its trace in proportion to the rays), over
    /// preparing plus tracing; medians.
    pub ratio_to_traditional: Option<f64>,
    /// Power on the wall for the rays of the traditional run.
    pub receiver_power: Option<f64>,
    /// Its relative difference from the traditional method's.
    pub receiver_difference: Option<f64>,
}

/// The rows of the study, and its answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Complexity {
    /// Our rows, then the paper's.
    pub rows: Vec<Row>,
    /// The answer in one sentence.
    pub answer: String,
}

/// The paper's savings of time on its simple, moderate and intricate lamp.
const PAPER: [(&str, f64); 3] =
    [("paper: simple", 0.1875), ("paper: moderate", 0.2545), ("paper: intricate", 0.4665)];

/// A method that is prepared to trace a lamp.
#[derive(Clone, Copy)]
struct Ready<'r> {
    name: &'static str,
    intersector: &'r dyn Intersector,
    facets: Option<usize>,
}

/// Times all methods on the three generated lamps, and checks that they light the wall alike; appends the paper's rows. Without a method
/// called `traditional` no ratio is known.
///
/// # Errors
/// Those of binding the generated scenes.
pub fn complexity(
    methods: &[Method<'_>],
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Complexity, Error> {
    let clock = Clock::new(progress);
    let mut rows = Vec::new();
    // Shares of the work, about: the traditional method has the same budget on every lamp, facets and rays grow.
    let shares = [0.0, 0.25, 0.5];
    for (lamp, share) in lamps().iter().zip(shares) {
        clock.report(lamp.name, share);
        let bound = Scene::parse(&lamp.scene, "lamp.toml", Path::new("."))?.bind(&lamp.model)?;
        let mut rounds = Rounds::default();
        // Times of preparing come from rounds of their own: while tracing all methods must live at once.
        for method in methods {
            rounds.add(method.name, || (method.prepare)(&lamp.model, &mut |_, _| ()));
        }
        let prepare: Vec<Timing> = rounds.run(settings.rounds).into_iter().map(|t| t.1).collect();
        prepare_all(methods, &lamp.model, &[], &mut |ready| {
            rows.extend(time_ready(lamp, &bound, (ready, &prepare), settings));
        });
    }
    clock.report("done", 1.0);
    let answer = sentence(&rows);
    // The paper prints savings: a share s of the time saved makes 1/(1 − s) times as fast.
    rows.extend(PAPER.map(|(model, saved)| Row {
        model: model.into(),
        method: "octree".into(),
        ratio_to_traditional: Some(1.0 / (1.0 - saved)),
        ..Row::default()
    }));
    Ok(Complexity { rows, answer })
}

/// Prepares all methods, one inside the other, then calls `then` with all of them, behind those that are `ready`: so all are alive at once
/// and rounds can alternate.
fn prepare_all(methods: &[Method<'_>], model: &Model, ready: &[Ready<'_>], then: &mut dyn FnMut(&[Ready<'_>])) {
    // An intersector lives within the call that it is handed to: to have all at once, each is prepared inside of the
    // one before.
    let Some((first, rest)) = methods.split_first() else { return then(ready) };
    (first.prepare)(model, &mut |intersector, facets| {
        let mut more = ready.to_vec();
        more.push(Ready { name: first.name, intersector, facets });
        prepare_all(rest, model, &more, then);
    });
}

/// Times what is ready on one lamp, and returns a row for each; the traditional method has as many rays as its time allows, at least 1024.
fn time_ready(
    lamp: &Lamp,
    bound: &BoundScene,
    (ready, prepare): (&[Ready<'_>], &[Timing]),
    settings: &Settings,
) -> Vec<Row> {
    let run = |intersector: &dyn Intersector, rays: u64| {
        let settings =
            RunSettings { rays, seed: settings.seed, threads: settings.threads, ..RunSettings::default() };
        simulate(bound, intersector, &settings, &|_| true)
    };
    let traditional = ready.iter().find(|r| r.name == "traditional");
    let few = traditional.map_or(settings.rays, |t| {
        // A short run first shows how many rays the time allows.
        let start = Instant::now();
        run(t.intersector, 1024);
        let affordable = 1024.0 * settings.traditional_seconds / start.elapsed().as_secs_f64();
        (affordable as u64).max(1024).min(settings.rays)
    });
    let count = |r: &Ready<'_>| if r.name == "traditional" { few } else { settings.rays };
    let mut rounds = Rounds::default();
    for r in ready {
        let (intersector, rays) = (r.intersector, count(r));
        let run = &run;
        rounds.add(r.name, move || {
            run(intersector, rays);
        });
    }
    let timings: Vec<Timing> = rounds.run(settings.rounds).into_iter().map(|t| t.1).collect();
    // All with the same few rays: a receiver's power is only comparable at the same number.
    let power = |r: &Ready<'_>| run(r.intersector, few).receivers.first().map_or(0.0, |x| x.power);
    let before = Cell::new(None);
    if let Some(i) = ready.iter().position(|r| r.name == "traditional") {
        before.set(Some((timings[i].median / few as f64, power(&ready[i]), prepare[i].median)));
    }
    let row = |((r, t), p): ((&Ready<'_>, &Timing), &Timing)| {
        let own = power(r);
        // The traditional trace is in proportion to its rays: every ray is put to every patch.
        let traditional = before.get().map(|b: (f64, f64, f64)| b.2 + b.0 * count(r) as f64);
        Row {
            model: lamp.name.into(),
            patches: Some(lamp.patches),
            facets: r.facets,
            method: r.name.into(),
            seconds_prepare: Some(p.median),
            seconds_prepare_min: Some(p.min),
            seconds_trace_min: Some(t.min),
            seconds_trace_median: Some(t.median),
            seconds_trace_p90: Some(t.p90),
            rays: Some(count(r)),
            ratio_to_traditional: traditional.map(|s| s / (p.median + t.median)),
            receiver_power: Some(own),
            receiver_difference: before.get().map(|b| (own - b.1).abs() / b.1),
        }
    };
    ready.iter().zip(&timings).zip(prepare).map(row).collect()
}

/// Writes the answer of the study; says so where the traditional method or the octree was not run.
fn sentence(rows: &[Row]) -> String {
    let of = |method: &str| -> Vec<&Row> { rows.iter().filter(|r| r.method == method).collect() };
    let (octree, exact) = (of("octree"), of("exact"));
    let ratios = |rows: &[&Row]| {
        let each = rows.iter().filter_map(|r| r.ratio_to_traditional).map(|x| format!("{x:.0}"));
        each.collect::<Vec<_>>().join(" / ")
    };
    // The last is the intricate lamp.
    let compared = octree.last().and_then(|r| Some((r, r.rays?, r.receiver_difference?)));
    let Some((row, rays, difference)) = compared else {
        return "Nothing to compare: the traditional method or the octree was not run.".into();
    };
    let patches: Vec<String> = octree.iter().filter_map(|r| r.patches).map(|n| grouped(n as u64)).collect();
    let beside = if exact.is_empty() {
        String::new()
    } else {
        format!(" The certified spline tracer, which needs no facets, is {} times as fast.", ratios(&exact))
    };
    // Less than half of the last digit that is printed.
    let same = match 100.0 * difference {
        none if none < 5e-4 => "the same".to_owned(),
        percent => format!("the same within {percent:.3} %"),
    };
    format!(
        "Facets in an octree, meshing included, are **{} times** as fast as the traditional way of intersecting every spline surface \
         with every ray, on lamps of {} patches and for {} rays. The light on the wall of the {} lamp is {same}.{beside} \
         The seed paper's savings make 1.23 / 1.34 / 1.87 times on its own three lamps.",
        ratios(&octree),
        patches.join(" / "),
        grouped(rays),
        row.model
    )
}

//! The main job: a scene that is read, bound, faceted, traced, checked and written down. `trace` and `demo` share it.

use super::engine::{self, Choice};
use super::ledger;
use super::load::Loaded;
use super::paths::Paths;
use super::witness::Witness;
use crate::cli::Failure;
use crate::cli::arguments::options::{IntersectorKind, Meshing, Tracing};
use crate::cli::context::Context;
use crate::cli::output::{cells, files, look};
use crate::formats::{ColourMap, Facets, Polylines, write_facets, write_vtp};
use crate::intersect::bvh::Bvh;
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::Octree;
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::report::{Cell, Light, Report, Table, View, file_stem, path_lines};
use crate::simulate::{
    BoundScene, Hooks, PathSink, PathVertex, Portion, Progress, Results, RunSettings, Scene, Traced, Verification,
    arrivals, replay, trace, verify_pruning,
};
use crate::study::accuracy_target::AccuracyPlan;
use crate::study::cross_check::{self, CrossCheck, Intersectors, cross_check};
use crate::study::faceting::{Faceting, faceting};
use crate::tessellate::{self, Tessellation};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What to do beside tracing.
pub(crate) struct Job<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) loaded: &'a Loaded,
    pub(crate) meshing: &'a Meshing,
    pub(crate) tracing: &'a Tracing,
    /// Rays of the run to ask again of BVH and spline; 0 for none.
    pub(crate) recheck: usize,
    /// How an accuracy that was asked for was reached.
    pub(crate) aimed: Option<&'a AccuracyPlan>,
}

/// A job whose scene fits its model and whose facets are made.
pub(crate) struct Prepared<'a> {
    pub(crate) job: Job<'a>,
    pub(crate) bound: BoundScene,
    pub(crate) tessellation: Tessellation,
    pub(crate) mesh_settings: tessellate::Settings,
    pub(crate) seconds: f64,
    pub(crate) choice: Choice,
    pub(crate) threads: usize,
    /// Rays to trace in place of what the options and the scene say.
    pub(crate) rays: Option<u64>,
}

/// How to trace beside the settings.
#[derive(Clone, Default)]
pub(crate) struct Ways<'a> {
    /// With the full kernel too.
    pub(crate) verify: bool,
    /// What is done already.
    pub(crate) from: Option<Portion>,
    /// Which part of how many, from 0.
    pub(crate) shard: Option<[u32; 2]>,
    /// Told of all that is done, each thread after so long.
    pub(crate) finished: Option<&'a (dyn Fn(&Portion) + Sync)>,
    pub(crate) every: Duration,
    /// Takes every path.
    pub(crate) paths: Option<&'a Paths>,
}

/// What came of it.
pub(crate) struct Outcome {
    pub(crate) results: Results,
    pub(crate) check: Option<CrossCheck>,
    /// What the facets change of the light, where the run was on facets.
    pub(crate) faceting: Option<Faceting>,
    /// The pruned kernel against the full one, when asked for.
    pub(crate) verification: Option<Verification>,
}

/// Binds the scene (so that its mistakes come before any work) and makes the facets.
pub(crate) fn prepare<'a>(job: Job<'a>, context: &Context) -> Result<Prepared<'a>, Failure> {
    let threads = engine::threads(job.tracing.threads)?;
    let choice = Choice::new(job.tracing, Some(job.scene))?;
    let bound = job.scene.bind(&job.loaded.model)?;
    let mesh_settings = engine::mesh_settings(job.meshing, Some(job.scene), &job.loaded.model)?;
    let (tessellation, seconds) = engine::facets(&job.loaded.model, &mesh_settings, context);
    Ok(Prepared { job, bound, tessellation, mesh_settings, seconds, choice, threads, rays: None })
}

impl Prepared<'_> {
    /// The run's settings: the scene's, with the options over them.
    pub(crate) fn run_settings(&self) -> RunSettings {
        let mut settings = RunSettings::from(&self.job.scene.run);
        settings.rays = self.rays.or(self.job.tracing.rays).unwrap_or(settings.rays);
        settings.seed = self.job.tracing.seed.unwrap_or(settings.seed);
        settings.threads = self.threads;
        settings.path_samples = 2000.min(settings.rays);
        settings
    }

    /// Number of independent parts that the run is divided into.
    pub(crate) fn replicates(&self) -> u32 {
        crate::simulate::replicates(&self.bound, &self.run_settings())
    }

    /// Traces the scene, and asks a sample of its rays again.
    pub(crate) fn trace(&self, ways: Ways, context: &Context) -> Outcome {
        let (model, mesh) = (&self.job.loaded.model, &self.tessellation.mesh);
        let settings = self.run_settings();
        engine::with_intersector(self.choice, model, mesh, context, |intersector, footprint| {
            let done = ways.from.as_ref().is_some_and(Portion::is_whole);
            let traced = if done { settings.rays.min(self.job.recheck as u64) } else { settings.rays };
            // Scenes differ in segments a ray; four is what lamps have, and a small sample only has fewer rays to check.
            let witness = Witness::new(intersector, self.job.recheck as u64, 4 * traced);
            let asked: &dyn Intersector = if self.job.recheck > 0 { &witness } else { intersector };
            let (mut results, verification) = if ways.verify {
                let (results, verification) = verify_pruning(&self.bound, asked, &settings, &|_| true);
                (results, Some(verification))
            } else {
                (Results::of(&self.bound, &settings, self.run(asked, &settings, ways, context)), None)
            };
            self.stamp(&mut results, footprint.build_seconds);
            if done {
                // Nothing was left to trace: some rays of the run for the check alone.
                let step = (settings.rays / traced.max(1)).max(1);
                replay(&self.bound, &witness, &settings, &(0..traced).map(|k| k * step).collect::<Vec<_>>());
            }
            let rays = witness.rays(self.job.recheck, model, 4.0 * self.mesh_settings.loosest());
            let exact = (!rays.is_empty()).then(|| {
                let spinner = context.spinner("building the spline for the cross-check");
                let exact = Exact::build(model, &exact::Settings::for_few_rays());
                spinner.finish_and_clear();
                exact
            });
            let check = exact.as_ref().map(|exact| self.cross_check(intersector, exact, &rays, context));
            let faceting = exact.as_ref().and_then(|exact| self.faceting(&results, [intersector, exact]));
            Outcome { results, check, faceting, verification }
        })
    }

    /// Traces the replicates of a shard.
    pub(crate) fn portion(&self, ways: Ways, context: &Context) -> Portion {
        let (model, mesh) = (&self.job.loaded.model, &self.tessellation.mesh);
        let settings = RunSettings { shard: ways.shard.unwrap_or([0, 1]), ..self.run_settings() };
        engine::with_intersector(self.choice, model, mesh, context, |intersector, _| {
            self.run(intersector, &settings, ways, context).portion
        })
    }

    pub(crate) fn run(
        &self,
        intersector: &dyn Intersector,
        settings: &RunSettings,
        ways: Ways,
        context: &Context,
    ) -> Traced {
        let bar = context.bar("tracing", "rays", settings.rays);
        let progress = |p: Progress| {
            bar.set_length(p.total);
            bar.set_position(p.rays);
            ways.paths.is_none_or(|paths| !paths.failed())
        };
        let take = ways.paths.map(|paths| |vertices: &[PathVertex]| paths.take(vertices));
        let hooks = Hooks {
            progress: &progress,
            finished: ways.finished,
            every: ways.every,
            paths: take.as_ref().map(|take| take as PathSink<'_>),
        };
        let traced = trace(&self.bound, intersector, settings, ways.from, &hooks);
        bar.finish_and_clear();
        traced
    }

    /// Completes results by what was done before tracing.
    fn stamp(&self, results: &mut Results, build_seconds: f64) {
        results.seconds.read = self.job.loaded.seconds;
        results.seconds.tessellate = self.seconds;
        results.seconds.build = build_seconds;
    }

    /// Some rays of the run once more, on facets and on the spline.
    fn faceting(&self, results: &Results, both: [&dyn Intersector; 2]) -> Option<Faceting> {
        let on_facets =
            self.choice.intersector != IntersectorKind::Exact && self.choice.normals != NormalMode::Exact;
        if !on_facets || self.tessellation.mesh.facets.is_empty() {
            return None;
        }
        // Some 16,000 rays tell widths within a few per cent; where rays are long, as many as take a tenth of a second on the spline.
        let segments = results.segments as f64 / results.rays.max(1) as f64;
        let rays = (100_000.0 / segments.max(1.0)).clamp(1000.0, 16_384.0) as u64;
        let own = self.run_settings();
        let settings = RunSettings { rays: rays.min(own.rays), replicates: 64, path_samples: 0, ..own };
        Some(faceting(&self.bound, both, &settings))
    }

    fn cross_check(
        &self,
        octree: &dyn Intersector,
        exact: &Exact,
        rays: &Vec<Ray>,
        context: &Context,
    ) -> CrossCheck {
        let (model, mesh) = (&self.job.loaded.model, &self.tessellation.mesh);
        let spinner = context.spinner("building BVH for the cross-check");
        let bvh = Bvh::build(mesh, &Default::default());
        // The cross-check is about facets: a run on the spline, or polished to it, says nothing of the octree.
        let facets = self.choice.intersector == IntersectorKind::Octree && self.choice.normals != NormalMode::Exact;
        let own = (!facets).then(|| Octree::build(mesh, &Default::default()));
        let octree = own.as_ref().map_or(octree, |own| own as &dyn Intersector);
        spinner.finish_and_clear();
        let bar = context.bar("checking", "rays", rays.len() as u64);
        let intersectors = Intersectors { model, mesh, octree, bvh: &bvh, exact };
        let settings = cross_check::Settings {
            fallback_band_mm: self.mesh_settings.loosest(),
            ..cross_check::Settings::default()
        };
        let total = rays.len() as f64;
        let found = cross_check(&intersectors, rays, &settings, &|p| bar.set_position((p.done * total) as u64));
        bar.finish_and_clear();
        found
    }

    /// Writes everything into a folder; the report comes last, so that a folder with a report is complete. Gives the document of
    /// `results.json`.
    pub(crate) fn write(
        &self,
        folder: &Path,
        outcome: &mut Outcome,
        comparison: Vec<String>,
        context: &Context,
    ) -> Result<(serde_json::Value, Report), Failure> {
        let spinner = context.spinner("writing");
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::running(format!("{}: cannot be made: {e}", folder.display())))?;
        for k in 0..outcome.results.receivers.len() {
            let rays = arrivals(&self.bound, k, &outcome.results);
            outcome.results.receivers[k].files = files::write(folder, &outcome.results.receivers[k], rays)?;
        }
        let (paths, _) = path_lines(&outcome.results.paths);
        write_vtp(&folder.join("paths.vtp"), &paths)?;
        let mesh = &self.tessellation.mesh;
        let bounds = mesh.bounds();
        let near: Polylines = paths.inside(&bounds.grown(0.35 * bounds.diagonal().max(1.0)));
        let mut facets = look::facets(&self.job.loaded.model, mesh, Some(self.job.scene));
        facets.paths = Some(&near);
        write_facets(&folder.join("facets.glb"), &facets)?;
        facets.paths = None;
        let ledger = ledger::write(folder, &outcome.results, self)?;
        let mut document = serde_json::to_value(&outcome.results).map_err(|e| Failure::running(e.to_string()))?;
        if ledger {
            document["ledger"] = ledger::LEDGER.into();
        }
        if let Some(v) = &outcome.verification {
            document["pruning"] = serde_json::to_value(v).map_err(|e| Failure::running(e.to_string()))?;
        }
        if let Some(check) = &outcome.check {
            document["check"] = serde_json::to_value(check).map_err(|e| Failure::running(e.to_string()))?;
        }
        if let Some(faceting) = &outcome.faceting {
            document["faceting"] = serde_json::to_value(faceting).map_err(|e| Failure::running(e.to_string()))?;
        }
        if let Some(aimed) = self.job.aimed {
            document["accuracy"] = serde_json::to_value(aimed).map_err(|e| Failure::running(e.to_string()))?;
        }
        let provenance = context.provenance(Some(self.run_settings().seed), self.threads);
        document["provenance"] = serde_json::to_value(&provenance).map_err(|e| Failure::running(e.to_string()))?;
        let text = serde_json::to_string_pretty(&document).map_err(|e| Failure::running(e.to_string()))? + "\n";
        crate::formats::write_atomic(&folder.join("results.json"), |w| w.write_all(text.as_bytes()))?;
        let title = match self.job.scene.title.as_str() {
            "" => self.job.loaded.model.name.clone(),
            title => title.to_owned(),
        };
        let light = Light {
            title,
            results: &outcome.results,
            facets: &facets,
            unit: match self.job.scene.run.unit {
                crate::simulate::scene::PowerUnit::Lumen => "lm",
                _ => "W",
            },
            check: outcome.check.as_ref(),
            faceting: outcome.faceting.as_ref(),
            views: self.views(&facets),
            tables: self.tables(),
            comparison,
            provenance,
        };
        let report = light.report();
        report.write(folder)?;
        spinner.finish_and_clear();
        Ok((document, report))
    }

    /// How finely the facets follow the surface, and how the octree sorts them.
    fn views(&self, facets: &Facets) -> Vec<View> {
        let mesh = facets.mesh;
        let (title, label) = ("Distance of the facets from the surface", "proved distance (mm)");
        let sag = View::of_values("sag", title, facets, label, &mesh.sag, ColourMap::Viridis);
        let sag = sag.caption(
            "No point of a facet is farther from the true surface than its colour says; grey is not proved.",
        );
        let octree = (self.choice.intersector == IntersectorKind::Octree)
            .then(|| cells::drawn(&cells::Shape::of(&Octree::build(mesh, &Default::default()))));
        std::iter::once(sag).chain(octree).collect()
    }

    /// What was read and what the facets are.
    fn tables(&self) -> Vec<Table> {
        let mut model = Table::new(
            "model",
            "Model",
            &[("file", ""), ("parts", ""), ("instances", ""), ("faces", ""), ("repaired", ""), ("refused", "")],
        );
        for r in &self.job.loaded.reports {
            model.row([
                r.file.as_str().into(),
                r.parts.into(),
                r.instances.into(),
                r.faces.found.into(),
                r.faces.repaired.into(),
                r.faces.refused.into(),
            ]);
        }
        let mesh = &self.tessellation.mesh;
        let mut facets = Table::new("facets", "Facets", &[("", ""), ("value", ""), ("unit", "")]);
        let [low, high] = self.mesh_settings.tolerance;
        let proved: Vec<f64> = mesh.sag.iter().copied().filter(|s| s.is_finite()).collect();
        let rows: [(&str, Cell, &str); 7] = [
            ("facets", mesh.facets.len().into(), ""),
            ("of these quads", mesh.quad_count().into(), ""),
            ("tolerance where sharply curved", low.into(), "mm"),
            ("tolerance where nearly flat", high.into(), "mm"),
            ("largest proved distance to the spline", proved.iter().copied().fold(0.0, f64::max).into(), "mm"),
            ("facets without a proof", (mesh.sag.len() - proved.len()).into(), ""),
            ("memory of the mesh", Cell::Number(mesh.bytes() as f64 / 1e6, 3), "MB"),
        ];
        for (name, value, unit) in rows {
            facets.row([name.into(), value, unit.into()]);
        }
        vec![model, facets]
    }
}

/// The files of a result folder that a person wants to know of.
pub(crate) fn highlights(folder: &Path, results: &Results) -> Vec<(PathBuf, String)> {
    let mut list = vec![
        (folder.join("report.html"), "open this in a browser: pictures, tables, cross-check".to_owned()),
        (folder.join("results.json"), "every number of the run".into()),
    ];
    for r in results.receivers.iter().filter(|r| !r.files.is_empty()) {
        let stem = file_stem(&r.name);
        list.push((
            folder.join(format!("{stem}.csv")),
            format!("{} cell by cell (also .npz .png .vti and more)", r.name),
        ));
    }
    if !results.ledger.is_empty() {
        list.push((
            folder.join(ledger::LEDGER),
            "the lost rays; `lampyris trace` shows their paths with --replay".into(),
        ));
    }
    list.push((folder.join("facets.glb"), "facets and ray paths in 3-D, for any glTF viewer".into()));
    list
}

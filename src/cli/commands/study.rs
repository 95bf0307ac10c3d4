//! `lampyris study`: rows to study.json, a report, pictures and tables; the small tables and one sentence on the terminal.

use super::bvh_benchmark::BvhCommand;
use super::demo;
use super::study_options::{StudyCommand, refuse_unused_options};
use crate::cli::arguments::command::{PlacedLimit, StudyKind};
use crate::cli::console::{Console, print, show_progress};
use crate::cli::output::json::{json_text, json_value};
use crate::cli::output::sentences::plain_sentence_lines;
use crate::cli::output::{octree_shape, terminal_tables};
use crate::cli::work::input_files::{self, Input};
use crate::cli::work::output_place::{OutputPlace, require_report_space};
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::threads;
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::{ColourMap, write_atomic};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{
    Exact,
    traditional::{Seeds, Traditional},
};
use crate::intersect::octree::{self, Octree};
use crate::model::Model;
use crate::pipeline::{
    IntersectorChoice, LoadedModel, mesh_settings, refuse_facet_normals, tessellate_model, with_intersector,
};
use crate::report::{Section, View, study_report, tolerance_text};
use crate::simulate::{RunSettings, Scene};
use crate::study::complexity::Method;
use crate::study::{
    self, MeshSource, ModelMeshSource, Progress, accuracy, complexity, effects, interpolation, stability,
};
use crate::tessellate::tessellate;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Rays of a scene in the study of its accuracy: enough that the geometric error of a coarse mesh stands above the noise.
const SCENE_RAYS: u64 = 200_000;

/// Timed rounds of the study of effects.
const EFFECT_ROUNDS: usize = 5;

/// Rows with the sentence that the study made of them.
struct StudyResult {
    rows: Value,
    answer: String,
    /// More rows, by name.
    extra_rows: Vec<(&'static str, Value)>,
    /// The seed that a scene traced with; `None` for that of the command.
    seed: Option<u64>,
}

/// The model of a study.
struct StudyModel {
    /// `None` for a STEP file alone.
    scene: Option<Scene>,
    loaded: LoadedModel,
    /// For the rows.
    name: String,
}

impl StudyResult {
    /// Makes the result of rows and the sentence about them; fails where rows have no form as JSON.
    fn new(rows: &impl Serialize, answer: impl Into<String>) -> Result<Self, Failure> {
        let rows = json_value(rows)?;
        Ok(Self { rows, answer: answer.into(), extra_rows: Vec::new(), seed: None })
    }

    /// Adds a further table under a name of its own.
    fn with_rows(mut self, name: &'static str, rows: &impl Serialize) -> Result<Self, Failure> {
        self.extra_rows.push((name, json_value(rows)?));
        Ok(self)
    }
}

/// Runs a study and writes `study.json`, and the report if wanted, into its folder; prints the document, or its small tables and the
/// answer. Fails on options that the study would not look at.
pub(crate) fn run(command: &StudyCommand, console: &Console) -> Result<Completion, Failure> {
    refuse_unused_options(command)?;
    let threads = threads::set_threads(command.tracing.threads)?;
    let seed = command.tracing.seed.unwrap_or(1);
    // Tried before the work, which may take minutes.
    let folder: PathBuf =
        command.output.cloned().unwrap_or_else(|| format!("lampyris-study-{}", command.kind.name()).into());
    let _owned = OutputPlace::folder(&folder)?;
    require_report_space(&folder, command.report.is_wanted())?;
    let bar = console.stage_bar(command.kind.name());
    let progress = |p: Progress| show_progress(&bar, &p);
    let (mut completion, mut shapes, mut shown) = (Completion::Complete, Vec::new(), None);
    let mut read = || -> Result<StudyModel, Failure> {
        let model = read_model(command.file, console)?;
        // Before the bar is drawn.
        completion = input_files::report_refusals(&model.loaded, 0.0, console);
        Ok(model)
    };
    let found = match command.kind {
        StudyKind::Accuracy => study_accuracy(command, shown.insert(read()?), seed, &progress)?,
        StudyKind::Interpolation => study_interpolation(command, &read()?, seed, &progress)?,
        StudyKind::Complexity => study_complexity(command, seed, threads, &progress)?,
        StudyKind::Stability => study_stability(&progress)?,
        StudyKind::Bvh => {
            let benchmark = BvhCommand {
                file: command.file,
                rays_in: command.rays_in,
                embree: command.embree,
                folder: &folder,
                meshing: &command.meshing,
                tracing: &command.tracing,
            };
            let benchmark = super::bvh_benchmark::run(&benchmark, console, &progress)?;
            (completion, shapes) = (benchmark.completion, benchmark.shapes);
            StudyResult::new(&benchmark.rows, benchmark.answer)?
        }
        StudyKind::Effects => study_effects(command, &read()?, threads, console, &progress)?,
    };
    bar.finish_and_clear();
    let seed = found.seed.unwrap_or(seed);
    let provenance = console.provenance(Some(seed), threads);
    let mut document = json!({
        "study": command.kind.name(),
        "command": provenance.command,
        "time": provenance.time,
        "version": provenance.version,
        "commit": provenance.commit,
        "hardware": provenance.hardware,
        "seed": seed,
        "answer": found.answer,
        "rows": found.rows,
    });
    for (name, rows) in found.extra_rows {
        document[name] = rows;
    }
    let text = json_text(&document)?;
    write_atomic(&folder.join("study.json"), |w| w.write_all(text.as_bytes()))?;
    let mut report = study_report(&document, provenance);
    if let Some(model) = &shown {
        // Behind the front, before the times.
        report.sections.insert(1, error_view(command, model, console)?);
    }
    if command.kind == StudyKind::Bvh {
        report.sections.insert(1, octree_shape::octree_section(&shapes));
        octree_shape::write_octree_files(&folder, &shapes)?;
    }
    if command.report.is_wanted() {
        report.write(&folder)?;
    }
    if console.json {
        print(&text)?;
    } else {
        let tables = terminal_tables::study_tables(&report, console.width());
        let answer = plain_sentence_lines(&report.answer, console.width());
        print(&format!("{tables}\n{answer}\n"))?;
        if command.report.is_wanted() {
            console.say(format_args!("  {}", console.bold(&folder.join("report.html").display().to_string())));
        }
        console.say(format_args!("  {}", folder.join("study.json").display()));
    }
    Ok(completion)
}

/// Reads the model of the file; the built-in lamp without one.
fn read_model(file: Option<&Path>, console: &Console) -> Result<StudyModel, Failure> {
    let Some(path) = file else {
        let (scene, loaded) = demo::lamp()?;
        return Ok(StudyModel { scene: Some(scene), loaded, name: "three-cavity lamp".into() });
    };
    let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok(match input_files::scene_or_model(path, PlacedLimit::default(), console)? {
        Input::Step(loaded) => StudyModel { scene: None, loaded, name },
        Input::Scene(scene, loaded) => StudyModel { scene: Some(*scene), loaded, name },
    })
}

/// Takes reports of progress.
type Report<'a> = &'a (dyn Fn(Progress) + Sync);

/// Measures cost and accuracy over tolerances, normals and intersectors; for a scene, also what facets change of each receiver.
fn study_accuracy(
    command: &StudyCommand,
    StudyModel { scene, loaded, name }: &StudyModel,
    seed: u64,
    progress: Report,
) -> Result<StudyResult, Failure> {
    // Measured, because the study reports the sag reached and not the one asked for.
    let product = ModelMeshSource::measuring(&loaded.model);
    let mut settings = accuracy::Settings { seed, ..Default::default() };
    if let Some(range) = command.meshing.tolerance {
        settings.tolerances = vec![range];
    }
    settings.rays = command.tracing.rays().unwrap_or(settings.rays);
    let Some(scene) = scene else {
        let study = accuracy::accuracy(name, &product, &settings, progress);
        return StudyResult::new(&study.rows, study.answer)?.with_rows("slopes", &study.slopes);
    };
    let bound = scene.bind(&loaded.model)?;
    let own = RunSettings::from(&scene.run);
    // More rays would make the study long; fewer would hide the facets behind the noise.
    let run = RunSettings { rays: own.rays.min(SCENE_RAYS), seed, threads: 0, path_samples: 0, ..own };
    // Light needs no sag, and measuring takes as long as meshing.
    let plain = ModelMeshSource::new(&loaded.model);
    let (study, light) = study::scene_accuracy(name, [&product, &plain], (&bound, &run), &settings, progress);
    StudyResult::new(&study.rows, study.answer)?.with_rows("slopes", &study.slopes)?.with_rows("receivers", &light)
}

/// Makes the section with a view of where on the surface the normals err, on facets of the tolerance asked for: meshes the model again.
fn error_view(command: &StudyCommand, model: &StudyModel, console: &Console) -> Result<Section, Failure> {
    let StudyModel { scene, loaded, .. } = model;
    let settings = mesh_settings(&command.meshing, scene.as_ref(), &loaded.model)?;
    let (made, _) = tessellate_model(&loaded.model, &settings, &TerminalMonitor::new(console));
    let (errors, _) = study::facet_errors(&loaded.model, &made.mesh);
    let bound = scene.as_ref().map(|s| s.bind(&loaded.model)).transpose()?;
    let facets = crate::cli::output::appearance::grouped_facets(&loaded.model, &made.mesh, bound.as_ref());
    let text = format!(
        "Largest angle between the bilinear normal and the spline's on each of {} facets within {}.",
        made.mesh.facets.len(),
        tolerance_text(settings.range())
    );
    let view =
        View::of_values("error", "Error of the normal", &facets, "normal error (°)", &errors, ColourMap::Viridis);
    Ok(Section::new("Where the error sits").with_block(view.caption(&text)))
}

/// Measures the kinds of normals on the model of the file or, without one, on all built-in ones.
fn study_interpolation(
    command: &StudyCommand,
    StudyModel { loaded, name, .. }: &StudyModel,
    seed: u64,
    progress: Report,
) -> Result<StudyResult, Failure> {
    // Without a file all models that are built in, to show how the ratios vary.
    let lamps = if command.file.is_none() { study::lamp::lamps() } else { Vec::new() };
    let mut models: Vec<(String, &Model)> = vec![(name.clone(), &loaded.model)];
    models.extend(lamps.iter().map(|l| (format!("{} lamp", l.name), &l.model)));
    let products: Vec<ModelMeshSource> = models.iter().map(|(_, m)| ModelMeshSource::new(m)).collect();
    let named: Vec<(&str, &dyn MeshSource)> =
        models.iter().zip(&products).map(|((n, _), p)| (n.as_str(), p as &dyn MeshSource)).collect();
    let mut settings = interpolation::Settings { seed, ..Default::default() };
    settings.rays = command.tracing.rays().unwrap_or(settings.rays);
    let study = interpolation::interpolation(&named, &settings, progress);
    StudyResult::new(&study.rows, study.answer)
}

/// Compares the spline, traced the traditional way and ours, with facets on three built-in lamps.
fn study_complexity(
    command: &StudyCommand,
    seed: u64,
    threads: usize,
    progress: Report,
) -> Result<StudyResult, Failure> {
    let mesh_settings = crate::tessellate::Settings {
        tolerance: command.meshing.tolerance.unwrap_or([0.05, 0.2]),
        ..Default::default()
    };
    let methods = [
        Method {
            name: "traditional",
            prepare: Box::new(|model, then| {
                // The traditional way stands on the spline's patches, and is charged with making them.
                let exact = Exact::build(model, &Default::default());
                then(&Traditional::new(model, &exact, Seeds::Sampled(4)), None);
            }),
        },
        Method {
            name: "octree",
            prepare: Box::new(|model, then| {
                let made = tessellate(model, &mesh_settings);
                then(&Octree::build(&made.mesh, &octree::Settings::default()), Some(made.mesh.facets.len()));
            }),
        },
        Method {
            name: "bvh",
            prepare: Box::new(|model, then| {
                let made = tessellate(model, &mesh_settings);
                then(&Bvh::build(&made.mesh, &bvh::Settings::default()), Some(made.mesh.facets.len()));
            }),
        },
        Method {
            name: "exact",
            prepare: Box::new(|model, then| then(&Exact::build(model, &Default::default()), None)),
        },
    ];
    let mut settings = complexity::Settings { seed, threads, ..Default::default() };
    settings.rays = command.tracing.rays().unwrap_or(settings.rays);
    let study = complexity::complexity(&methods, &settings, progress)?;
    StudyResult::new(&study.rows, study.answer)
}

/// Asks octree, BVH and spline the awkward rays of the built-in cases, each in all its variants.
fn study_stability(progress: Report) -> Result<StudyResult, Failure> {
    use stability::{Geometry, Variant, cases};
    let all = cases();
    let mut rows = Vec::new();
    for (k, case) in all.iter().enumerate() {
        for variant in Variant::ALL {
            let scene = case.scene(variant);
            let octree = Octree::build(&scene.mesh, &octree::Settings::default());
            let cured = Bvh::build(&scene.mesh, &bvh::Settings::default());
            let shipped = Bvh::build(&scene.mesh, &bvh::Settings { cured: false, ..Default::default() });
            let exact = Exact::build(&scene.model, &Default::default());
            rows.push(scene.ask("octree", &octree, Geometry::Facets));
            rows.push(scene.ask("cwbvh", &cured, Geometry::Facets));
            rows.push(scene.ask("cwbvh as shipped", &shipped, Geometry::Facets));
            rows.push(scene.ask("exact", &exact, Geometry::Spline));
            let newton = Traditional::new(&scene.model, &exact, Seeds::Middle);
            rows.push(scene.ask("plain newton", &newton, Geometry::Spline));
        }
        for variant in Variant::EXTREME {
            let scene = case.scene(variant);
            let octree = Octree::build(&scene.mesh, &octree::Settings::default());
            rows.push(scene.ask("octree", &octree, Geometry::Facets));
            let shipped = Bvh::build(&scene.mesh, &bvh::Settings { cured: false, ..Default::default() });
            rows.push(scene.ask("cwbvh as shipped", &shipped, Geometry::Facets));
            let exact = Exact::build(&scene.model, &Default::default());
            rows.push(scene.ask("exact", &exact, Geometry::Spline));
        }
        let done = (k + 1) as f64 / all.len() as f64;
        progress(Progress { stage: case.name.into(), done, remaining_seconds: None });
    }
    StudyResult::new(&rows, stability::answer(&rows))
}

/// Measures what each optical effect costs on a scene, with at most a million rays unless `--rays` says more; fails for a bare model.
fn study_effects(
    command: &StudyCommand,
    StudyModel { scene, loaded, name }: &StudyModel,
    threads: usize,
    console: &Console,
    progress: Report,
) -> Result<StudyResult, Failure> {
    let Some(scene) = scene else {
        let failure = Failure::arguments("study effects needs a scene: a STEP file alone has no light");
        return Err(failure.with_help("give a scene file (.toml), or nothing for the built-in lamp"));
    };
    let bound = scene.bind(&loaded.model)?;
    let settings = mesh_settings(&command.meshing, Some(scene), &loaded.model)?;
    let (made, _) = tessellate_model(&loaded.model, &settings, &TerminalMonitor::new(console));
    let choice = IntersectorChoice::new(&command.tracing, Some(scene))?;
    refuse_facet_normals(&command.tracing, Some(scene))?;
    let mut run = RunSettings { threads, ..RunSettings::from(&scene.run) };
    run.rays = command.tracing.rays().unwrap_or(run.rays.min(1_000_000));
    run.seed = command.tracing.seed.unwrap_or(run.seed);
    let rows =
        with_intersector(choice, &loaded.model, &made.mesh, &TerminalMonitor::new(console), |intersector, _| {
            effects::effects(name, (&bound, &run), intersector, EFFECT_ROUNDS, progress)
        });
    Ok(StudyResult { seed: Some(run.seed), ..StudyResult::new(&rows, effects::answer(&rows))? })
}

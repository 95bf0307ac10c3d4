//! `lampyris study`: rows to study.json, a page, pictures and tables; the small tables and one sentence on the terminal.

use super::demo;
use crate::cli::arguments::args::StudyKind;
use crate::cli::arguments::options::{Meshing, Tracing};
use crate::cli::context::{Context, print, show};
use crate::cli::output::{cells, tables};
use crate::cli::work::engine::{self, Choice};
use crate::cli::work::load::{self, Input, Loaded};
use crate::cli::{Failure, Outcome};
use crate::formats::{ColourMap, write_atomic};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{
    Exact,
    traditional::{Seeds, Traditional},
};
use crate::intersect::octree::{self, Octree};
use crate::model::Model;
use crate::report::{Section, View, study_report};
use crate::simulate::{RunSettings, Scene};
use crate::study::complexity::Method;
use crate::study::{
    self, MeshSource, ModelMeshSource, Progress, accuracy, complexity, effects, interpolation, stability,
};
use crate::tessellate::tessellate;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What `study` was asked for.
pub(crate) struct Asked<'a> {
    pub(crate) kind: StudyKind,
    pub(crate) file: Option<&'a Path>,
    pub(crate) output: Option<&'a PathBuf>,
    pub(crate) meshing: &'a Meshing,
    pub(crate) tracing: &'a Tracing,
}

/// Rays of a scene in the study of its accuracy: enough that the geometric error of a coarse mesh stands above the noise.
const LIT_RAYS: u64 = 200_000;

/// Rows with the sentence that the study made of them.
struct Found {
    rows: Value,
    answer: String,
    /// More rows, by name.
    beside: Vec<(&'static str, Value)>,
}

impl Found {
    fn new(rows: &impl Serialize, answer: impl Into<String>) -> Result<Self, Failure> {
        let rows = serde_json::to_value(rows).map_err(|e| Failure::running(e.to_string()))?;
        Ok(Self { rows, answer: answer.into(), beside: Vec::new() })
    }

    fn beside(mut self, name: &'static str, rows: &impl Serialize) -> Result<Self, Failure> {
        self.beside.push((name, serde_json::to_value(rows).map_err(|e| Failure::running(e.to_string()))?));
        Ok(self)
    }
}

/// Options that a study would not look at are refused: whoever gives one believes that it changes the rows.
fn refuse_idle(asked: &Asked) -> Result<(), Failure> {
    use StudyKind::{Accuracy, Bvh, Complexity, Effects, Stability};
    let (kind, m, t) = (asked.kind, asked.meshing, asked.tracing);
    let lit = matches!(kind, Effects);
    let faceted = matches!(kind, Effects | Bvh | Accuracy);
    let given = [
        ("--intersector", t.intersector.is_some(), lit, "it compares those that it is about"),
        ("--normals", t.normals.is_some(), lit, "it compares those that it is about"),
        ("--rays", t.rays.is_some(), kind != Stability, "its questions are fixed"),
        ("--seed", t.seed.is_some(), kind != Stability, "its questions are fixed"),
        ("--tolerance", m.tolerance.is_some(), faceted || kind == Complexity, "it goes through several of its own"),
        ("--angle", m.angle.is_some(), faceted, "it goes through facets of its own"),
        ("--part", !m.part.is_empty(), faceted, "it goes through facets of its own"),
    ];
    let idle = given.iter().find(|(_, given, used, _)| *given && !used);
    let Some((option, _, _, why)) = idle else { return Ok(()) };
    let failure = Failure::arguments(format!("study {} does not take {option}: {why}", kind.name()));
    Err(failure.help("leave it out"))
}

pub(crate) fn run(asked: &Asked, context: &Context) -> Result<Outcome, Failure> {
    refuse_idle(asked)?;
    let threads = engine::threads(asked.tracing.threads)?;
    let seed = asked.tracing.seed.unwrap_or(1);
    let bar = context.stages(asked.kind.name());
    let progress = |p: Progress| show(&bar, &p);
    let mut shapes = Vec::new();
    let found = match asked.kind {
        StudyKind::Accuracy => accuracy_of(asked, seed, context, &progress)?,
        StudyKind::Interpolation => interpolation_of(asked, seed, context, &progress)?,
        StudyKind::Complexity => complexity_of(asked, seed, threads, &progress)?,
        StudyKind::Stability => stability_of(&progress)?,
        StudyKind::Bvh => {
            let race = super::race::run(asked.file, asked.meshing, asked.tracing, context, &progress)?;
            shapes = race.shapes;
            Found::new(&race.rows, race.answer)?
        }
        StudyKind::Effects => effects_of(asked, threads, context)?,
    };
    bar.finish_and_clear();
    let provenance = context.provenance(Some(seed), threads);
    let mut document = json!({
        "study": asked.kind.name(),
        "command": provenance.command,
        "version": provenance.version,
        "commit": provenance.commit,
        "hardware": provenance.hardware,
        "seed": seed,
        "answer": found.answer,
        "rows": found.rows,
    });
    for (name, rows) in found.beside {
        document[name] = rows;
    }
    let folder = asked.output.cloned().unwrap_or_else(|| format!("lampyris-study-{}", asked.kind.name()).into());
    std::fs::create_dir_all(&folder)
        .map_err(|e| Failure::running(format!("{}: cannot be made: {e}", folder.display())))?;
    let text = format!("{document:#}\n");
    write_atomic(&folder.join("study.json"), |w| w.write_all(text.as_bytes()))?;
    let mut report = study_report(&document, provenance);
    if asked.kind == StudyKind::Accuracy {
        report.sections.insert(1, error_view(asked, context)?);
    }
    if asked.kind == StudyKind::Bvh {
        report.sections.insert(1, cells::section(&shapes));
        cells::write(&folder, &shapes)?;
    }
    report.write(&folder)?;
    if context.json {
        print(&text)?;
    } else {
        context.say(format_args!("{}", tables::of_study(&report, context.width())));
        context.say(format_args!("  {}\n", report.answer.replace("**", "")));
        context.say(format_args!("  {}", context.strong(&folder.join("report.html").display().to_string())));
        context.say(format_args!("  {}", folder.join("study.json").display()));
    }
    Ok(Outcome::Done)
}

/// The model of the file, or the built-in lamp.
fn model_of(file: Option<&Path>, context: &Context) -> Result<(Option<Scene>, Loaded, String), Failure> {
    let Some(path) = file else {
        let (scene, loaded) = demo::lamp()?;
        return Ok((Some(scene), loaded, "three-cavity lamp".into()));
    };
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(match load::either(path, context)? {
        Input::Step(loaded) => (None, loaded, name),
        Input::Scene(scene, loaded) => (Some(*scene), loaded, name),
    })
}

type Report<'a> = &'a (dyn Fn(Progress) + Sync);

fn accuracy_of(asked: &Asked, seed: u64, context: &Context, progress: Report) -> Result<Found, Failure> {
    let (scene, loaded, name) = model_of(asked.file, context)?;
    let product = ModelMeshSource::measuring(&loaded.model);
    let mut settings = accuracy::Settings { seed, ..Default::default() };
    if let Some(range) = asked.meshing.tolerance {
        settings.tolerances = vec![range];
    }
    settings.rays = asked.tracing.rays.unwrap_or(settings.rays);
    let Some(scene) = scene else {
        let study = accuracy::accuracy(&name, &product, &settings, progress);
        return Found::new(&study.rows, study.answer)?.beside("slopes", &study.slopes);
    };
    let bound = scene.bind(&loaded.model)?;
    let own = RunSettings::from(&scene.run);
    let run = RunSettings { rays: own.rays.min(LIT_RAYS), seed, threads: 0, path_samples: 0, ..own };
    let plain = ModelMeshSource::new(&loaded.model);
    let (study, light) = study::scene_accuracy(&name, [&product, &plain], (&bound, &run), &settings, progress);
    Found::new(&study.rows, study.answer)?.beside("slopes", &study.slopes)?.beside("receivers", &light)
}

/// Where on the surface the normals err, on facets of the tolerance asked for.
fn error_view(asked: &Asked, context: &Context) -> Result<Section, Failure> {
    let (scene, loaded, _) = model_of(asked.file, context)?;
    let settings = engine::mesh_settings(asked.meshing, scene.as_ref(), &loaded.model)?;
    let (made, _) = engine::facets(&loaded.model, &settings, context);
    let (errors, _) = super::facet::per_facet(&loaded.model, &made.mesh);
    let facets = crate::cli::output::look::facets(&loaded.model, &made.mesh, scene.as_ref());
    let [low, high] = settings.tolerance;
    let text = format!(
        "Largest angle between the bilinear normal and the spline's on each of {} facets within {low}..{high} mm.",
        made.mesh.facets.len()
    );
    let view =
        View::of_values("error", "Error of the normal", &facets, "normal error (°)", &errors, ColourMap::Viridis);
    Ok(Section::new("Where the error sits").with(view.caption(&text)))
}

fn interpolation_of(asked: &Asked, seed: u64, context: &Context, progress: Report) -> Result<Found, Failure> {
    let (_, loaded, name) = model_of(asked.file, context)?;
    let mut models: Vec<(String, Model)> = vec![(name, loaded.model)];
    if asked.file.is_none() {
        models.extend(study::lamp::lamps().into_iter().map(|l| (format!("{} lamp", l.name), l.model)));
    }
    let products: Vec<ModelMeshSource> = models.iter().map(|(_, m)| ModelMeshSource::new(m)).collect();
    let named: Vec<(&str, &dyn MeshSource)> =
        models.iter().zip(&products).map(|((n, _), p)| (n.as_str(), p as &dyn MeshSource)).collect();
    let mut settings = interpolation::Settings { seed, ..Default::default() };
    settings.rays = asked.tracing.rays.unwrap_or(settings.rays);
    let study = interpolation::interpolation(&named, &settings, progress);
    Found::new(&study.rows, study.answer)
}

fn complexity_of(asked: &Asked, seed: u64, threads: usize, progress: Report) -> Result<Found, Failure> {
    let mesh_settings = crate::tessellate::Settings {
        tolerance: asked.meshing.tolerance.unwrap_or([0.05, 0.2]),
        ..Default::default()
    };
    let methods = [
        Method {
            name: "traditional",
            with: Box::new(|model, then| {
                let exact = Exact::build(model, &Default::default());
                then(&Traditional::new(model, &exact, Seeds::Sampled(4)), None);
            }),
        },
        Method {
            name: "octree",
            with: Box::new(|model, then| {
                let made = tessellate(model, &mesh_settings);
                then(&Octree::build(&made.mesh, &octree::Settings::default()), Some(made.mesh.facets.len()));
            }),
        },
        Method {
            name: "bvh",
            with: Box::new(|model, then| {
                let made = tessellate(model, &mesh_settings);
                then(&Bvh::build(&made.mesh, &bvh::Settings::default()), Some(made.mesh.facets.len()));
            }),
        },
        Method {
            name: "exact",
            with: Box::new(|model, then| then(&Exact::build(model, &Default::default()), None)),
        },
    ];
    let mut settings = complexity::Settings { seed, threads, ..Default::default() };
    settings.rays = asked.tracing.rays.unwrap_or(settings.rays);
    let study = complexity::complexity(&methods, &settings, progress)?;
    Found::new(&study.rows, study.answer)
}

fn stability_of(progress: Report) -> Result<Found, Failure> {
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
        let done = (k + 1) as f64 / all.len() as f64;
        progress(Progress { stage: case.name.into(), done, remaining_seconds: None });
    }
    Found::new(&rows, stability::answer(&rows))
}

fn effects_of(asked: &Asked, threads: usize, context: &Context) -> Result<Found, Failure> {
    let (scene, loaded, name) = model_of(asked.file, context)?;
    let Some(scene) = scene else {
        let failure = Failure::arguments("study effects needs a scene: a STEP file alone has no light");
        return Err(failure.help("give a scene file (.toml), or nothing for the built-in lamp"));
    };
    let bound = scene.bind(&loaded.model)?;
    let settings = engine::mesh_settings(asked.meshing, Some(&scene), &loaded.model)?;
    let (made, _) = engine::facets(&loaded.model, &settings, context);
    let choice = Choice::new(asked.tracing, Some(&scene))?;
    let mut run = RunSettings { threads, ..RunSettings::from(&scene.run) };
    run.rays = asked.tracing.rays.unwrap_or(run.rays.min(1_000_000));
    run.seed = asked.tracing.seed.unwrap_or(run.seed);
    let rows = engine::with_intersector(choice, &loaded.model, &made.mesh, context, |who, _| {
        effects::effects(&name, &bound, who, &run, 5)
    });
    Found::new(&rows, effects::answer(&rows))
}

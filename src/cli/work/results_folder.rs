//! The folder that a traced scene leaves: receiver files, ray paths, facets, `results.json` and the report.

use super::input_guard::InputGuard;
use super::lost_rays;
use super::output_place::{REPORT_BYTES, make_folder, require_space, rescue_folders};
use super::run_commands::RunCommands;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::machine;
use crate::cli::output::closing::{LOST_RAYS_FILE, target_sentence};
use crate::cli::output::face_tables;
use crate::cli::output::json::{json_text, json_value};
use crate::cli::output::sentences::plain_sentence;
use crate::cli::output::{appearance, octree_shape, receiver_files, rule_table, sequence_tables};
use crate::formats::{ColourMap, Facets, Polylines, read_text, try_write, write_atomic, write_facets, write_vtp};
use crate::intersect::octree::Octree;
use crate::mesh::FacetMesh;
use crate::pipeline::{IntersectorKind, PreparedScene, SceneResults, TargetResult};
use crate::regulation::Assessment;
use crate::report::{Cell, Provenance, SimulationReport, Table, View, file_stem, path_lines};
use crate::simulate::{Scene, arrivals};
use crate::study::figures::ReceiverFigures;
use crate::study::model_figures::PowerFigures;
use crate::text::grouped;
use serde_json::Value;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// What a cell of a receiver takes at least in all its files, bytes: its number as text, twice in binary.
const CELL_BYTES: u64 = 40;
/// Facets that are drawn where parts are placed often; the rest of their places are boxes, or nothing: three seconds of a viewer.
pub(crate) const MOST_DRAWN: usize = 24_000;
/// What a facet takes at least in the model of the folder, bytes: corners and normals in single precision.
const FACET_BYTES: u64 = 50;

/// Files of every folder of results.
const OWN_FILES: [&str; 5] = ["results.json", "report.html", "facets.glb", "paths.vtp", LOST_RAYS_FILE];
/// Folders of the report's pictures and tables, with the extensions of the files in them.
const REPORT_FOLDERS: [(&str, &[&str]); 2] = [("figures", &["svg", "png"]), ("tables", &["csv"])];

/// Tries, before anything is traced, whether the folder can hold the results: room, and a file of every receiver's name.
///
/// # Errors
/// When it cannot.
pub(crate) fn try_folder(prepared: &PreparedScene, folder: &Path, with_report: bool) -> Result<(), Failure> {
    let scene = &prepared.job.scene;
    let cells: u64 = scene.receivers.iter().map(|r| r.cells.iter().map(|&n| n as u64).product::<u64>()).sum();
    let facets = prepared.facets.drawn(MOST_DRAWN).facets.len() as u64;
    let report = if with_report { REPORT_BYTES } else { 0 };
    require_space(folder, report + cells.saturating_mul(CELL_BYTES) + facets * FACET_BYTES)?;
    for receiver in &scene.receivers {
        // By the names of the results: one may be too long or forbidden.
        try_write(&folder.join(format!("{}.csv", file_stem(&receiver.name))))?;
    }
    Ok(())
}

/// Refuses, before any work, a folder in which results would replace the scene or a file that it names.
///
/// # Errors
/// When they would.
pub(crate) fn refuse_inputs(scene: &Scene, scene_file: &Path, folder: &Path) -> Result<(), Failure> {
    let receivers: HashSet<String> = scene.receivers.iter().flat_map(receiver_files::names).collect();
    // The folders of the report are its own: what they hold goes with the run that made it.
    let is_written = |name: &Path| {
        is_of_report(name)
            || name.to_str().is_some_and(|name| OWN_FILES.contains(&name) || receivers.contains(name))
    };
    InputGuard::new([scene_file]).with_scene(scene).refuse_folder(folder, is_written)
}

/// Whether a file, named relative to a folder of results, is a picture or table of its report by its folder and extension.
fn is_of_report(name: &Path) -> bool {
    let extension = name.extension().and_then(|e| e.to_str()).unwrap_or("");
    REPORT_FOLDERS
        .iter()
        .any(|(folder, kinds)| name.parent() == Some(Path::new(folder)) && kinds.contains(&extension))
}

/// Removes what an earlier run left in the folder, as far as its `results.json` and the names of its own show, so that no file of it stands
/// beside those of this run. Files that the scene names stay; a failure is passed over, because what is written next replaces most of them.
fn remove_earlier(prepared: &PreparedScene, folder: &Path) {
    let Some(earlier) = read_text(&folder.join("results.json")).ok() else { return };
    let Ok(earlier) = serde_json::from_str::<Value>(&earlier) else { return };
    // Only what lampyris wrote has one.
    if earlier["digest"].is_null() {
        return;
    }
    let listed =
        earlier["receivers"].as_array().into_iter().flatten().filter_map(|r| r["files"].as_array()).flatten();
    let mut names: Vec<PathBuf> = listed.filter_map(|file| file.as_str().map(PathBuf::from)).collect();
    // A document that somebody changed names files of the folder alone.
    names.retain(|name| name.file_name() == Some(name.as_os_str()));
    names.extend(OWN_FILES.map(PathBuf::from));
    for (inner, _) in REPORT_FOLDERS {
        let entries = std::fs::read_dir(folder.join(inner)).into_iter().flatten().flatten();
        names.extend(
            entries.map(|entry| Path::new(inner).join(entry.file_name())).filter(|name| is_of_report(name)),
        );
    }
    let scene = &prepared.job.scene;
    let guard = InputGuard::new([Path::new(&scene.origin.file)]).with_scene(scene);
    for file in names.iter().map(|name| folder.join(name)).filter(|file| guard.refuse("-o", file).is_ok()) {
        let _ = std::fs::remove_file(file);
    }
}

/// Remarks on a run beside its figures.
#[derive(Clone, Debug)]
pub(crate) struct RunRemarks {
    /// Sentences of the report that compare the run with what was asked for or others found, in Markdown.
    pub(crate) sentences: Vec<String>,
    /// The outcome of the error target, if one was set.
    pub(crate) target: Option<TargetResult>,
    /// The commands that traced it.
    pub(crate) commands: RunCommands,
}

impl RunRemarks {
    /// Puts what came of an error that was asked for into a sentence, which leads the closing lines; says it here where there are none,
    /// quiet or not where it is why the exit code is not 0. Nothing where none was.
    pub(crate) fn say_target(target: Option<TargetResult>, commands: RunCommands, console: &Console) -> Self {
        let sentences: Vec<String> = target.iter().map(target_sentence).collect();
        let is_missed = target.as_ref().is_some_and(|target| !target.reached);
        for sentence in sentences.iter().filter(|_| !console.has_closing_lines()) {
            console.say_or_insist(is_missed, plain_sentence(sentence));
        }
        Self { sentences, target, commands }
    }
}

/// Writes the results into a new folder wherever one can be, when they cannot be written where they should; returns the folder, `None` if
/// nowhere.
pub(crate) fn write_anywhere(
    prepared: &PreparedScene,
    run: &mut SceneResults,
    remarks: &RunRemarks,
    with_report: bool,
    console: &Console,
) -> Option<PathBuf> {
    let name = format!("lampyris-rescued-{}", machine::process_name());
    let mut places = rescue_folders().into_iter().map(|folder| folder.join(&name));
    places.find(|folder| {
        let written = write(prepared, folder, run, remarks, with_report, console);
        if written.is_err() {
            // Half of the results is of no use.
            let _ = std::fs::remove_dir_all(folder);
        }
        written.is_ok()
    })
}

/// Writes everything into a folder, which is made; the report, if wanted, comes last, so that a folder with one is complete. Notes in
/// `run` which files each receiver got. Returns the document of `results.json` and the answer in words.
pub(crate) fn write(
    prepared: &PreparedScene,
    folder: &Path,
    run: &mut SceneResults,
    remarks: &RunRemarks,
    with_report: bool,
    console: &Console,
) -> Result<(Value, String), Failure> {
    let spinner = console.spinner("writing");
    make_folder(folder)?;
    remove_earlier(prepared, folder);
    let settings = prepared.run_settings();
    for k in 0..run.results.receivers.len() {
        let sample = receiver_files::SampledRays {
            rays: arrivals(&prepared.bound, &settings, k, &run.results),
            wavelength_nm: prepared.bound.single_wavelength_nm(),
        };
        let receiver = &run.results.receivers[k];
        let geometric = [vec![run.geometric_cells(prepared, k)], run.geometric_channel_cells(prepared, k)].concat();
        run.results.receivers[k].files = receiver_files::write(folder, receiver, geometric, sample)?;
    }
    let all_figures = run.figures(prepared);
    let power = run.power_figures(prepared);
    let (paths, _) = path_lines(&run.results.paths);
    write_vtp(&folder.join("paths.vtp"), &paths)?;
    let mesh = &*prepared.facets.drawn(MOST_DRAWN);
    let near: Polylines = paths.near(&prepared.facets.bounds());
    let mut facets = appearance::grouped_facets(&prepared.job.loaded.model, mesh, Some(&prepared.bound));
    facets.paths = Some(&near);
    write_facets(&folder.join("facets.glb"), &facets)?;
    // The report shows paths as lines of its own.
    facets.paths = None;
    let has_lost_rays = lost_rays::write(folder, &run.results, prepared)?;
    let provenance = remarks.commands.provenance(prepared.run_settings().seed, run.results.threads, console);
    let mut document = run.document(prepared).map_err(|e| Failure::running(e.to_string()))?;
    sequence_tables::add_ways(&mut document, &run.results, &prepared.job.loaded.model);
    face_tables::add_selectors(&mut document, &run.results, &prepared.job.loaded.model);
    document["provenance"] = json_value(&provenance)?;
    let verdicts = run.verdicts(prepared).map_err(|e| Failure::running(e.to_string()))?;
    if !verdicts.is_empty() {
        document["regulations"] = verdicts.iter().map(|v| v.assessment.document()).collect();
    }
    let verdicts: Vec<(usize, Assessment)> = verdicts.into_iter().map(|v| (v.receiver, v.assessment)).collect();
    if let Some(target) = &remarks.target {
        document["until_error"] = json_value(target)?;
    }
    let left_out = &prepared.job.loaded.left_out;
    if !left_out.is_empty() {
        document["left_out"] = rule_table::left_out_document(left_out);
    }
    if has_lost_rays {
        document["ledger"] = LOST_RAYS_FILE.into();
    }
    let text = json_text(&document)?;
    write_atomic(&folder.join("results.json"), |w| w.write_all(text.as_bytes()))?;
    // Labels are for the report, where a click names a face.
    if with_report {
        facets.labels = rule_table::face_labels(&prepared.job.loaded.model);
    }
    let found = (all_figures.as_slice(), &power, verdicts.as_slice());
    let report = scene_report(prepared, run, found, &facets, remarks.sentences.clone(), provenance);
    let answer = report.answer();
    if with_report {
        report.with_views(facet_views(prepared, &facets)).report().write(folder)?;
    }
    spinner.finish_and_clear();
    let asked = remarks.target.as_ref().map_or_else(String::new, |target| target_sentence(target) + " ");
    Ok((document, asked + &answer))
}

/// Returns the report of a traced scene; `sentences` compare it with what was asked for or others found.
fn scene_report<'a>(
    prepared: &'a PreparedScene,
    run: &'a SceneResults,
    (all_figures, power, verdicts): (&'a [ReceiverFigures], &'a PowerFigures, &'a [(usize, Assessment)]),
    facets: &'a Facets,
    sentences: Vec<String>,
    provenance: Provenance,
) -> SimulationReport<'a> {
    let scene = &prepared.job.scene;
    // A report without a title says nothing to those who only hear it.
    let file = crate::formats::file_name(Path::new(&scene.origin.file));
    let titles = [scene.title.as_str(), prepared.job.loaded.model.name.as_str(), file.as_str()];
    let title = titles.into_iter().find(|t| !t.trim().is_empty()).unwrap_or("light through a scene").to_owned();
    SimulationReport {
        title,
        results: &run.results,
        facets,
        facet_count: prepared.facets.facet_count(),
        on_spline: prepared.choice.intersector == IntersectorKind::Exact,
        drawn: drawn_note(
            facets.mesh.facets.len(),
            prepared.facets.facet_count(),
            prepared.choice.intersector == IntersectorKind::Exact,
        ),
        unit: prepared.power_unit(),
        check: run.check.as_ref(),
        figures: all_figures,
        geometric: run.geometric.as_ref(),
        power,
        chosen: prepared.chosen.as_ref(),
        verdicts,
        sections: sequence_tables::sequence_section(prepared, &run.results, facets)
            .into_iter()
            .chain(face_tables::face_section(run, prepared))
            .collect(),
        views: Vec::new(),
        tables: [
            (!prepared.bound.rules().is_empty())
                .then(|| rule_table::rule_table(&prepared.bound, &prepared.job.loaded.model)),
            rule_table::left_out_table(&prepared.job.loaded.left_out),
            Some(model_table(prepared)),
            Some(facet_table(prepared)),
        ]
        .into_iter()
        .flatten()
        .collect(),
        comparison: sentences,
        provenance,
    }
}

/// Returns the views of how finely the facets follow the surface and, for runs that use one, of how the octree sorts them.
fn facet_views(prepared: &PreparedScene, facets: &Facets) -> Vec<View> {
    let mesh = facets.mesh;
    let title = "Distance of the facets from the surface";
    let sag = View::of_values("sag", title, facets, "proved distance (mm)", &mesh.sag, ColourMap::Viridis);
    let sag = sag
        .caption("No point of a facet is farther from the true surface than its colour says; grey is not proved.");
    // A run on the spline is cross-checked on the octree.
    let on_octree = matches!(prepared.choice.intersector, IntersectorKind::Octree | IntersectorKind::Exact);
    let octree = on_octree.then(|| {
        octree_shape::octree_view(&octree_shape::OctreeShape::new(&Octree::build(mesh, &Default::default())))
    });
    std::iter::once(sag).chain(octree).collect()
}

/// Makes a table of the files that were read, a row each.
fn model_table(prepared: &PreparedScene) -> Table {
    let columns =
        [("file", ""), ("parts", ""), ("instances", ""), ("faces", ""), ("repaired", ""), ("refused", "")];
    let mut table = Table::new("model", "Model", &columns);
    for r in &prepared.job.loaded.reports {
        table.row([
            r.file.as_str().into(),
            r.parts.into(),
            r.instances.into(),
            r.faces.found.into(),
            r.faces.repaired.into(),
            r.faces.refused.into(),
        ]);
    }
    table
}

/// Returns a table of what the facets are, each counted in all places of its part.
fn facet_table(prepared: &PreparedScene) -> Table {
    let facets = &prepared.facets;
    let sum =
        |of: &dyn Fn(&FacetMesh) -> usize| facets.counted().map(|(mesh, count)| count * of(mesh)).sum::<usize>();
    let mut table = Table::new("facets", "Facets", &[("", ""), ("value", ""), ("unit", "")]);
    let [finest, loosest] = prepared.mesh_settings.tolerance;
    let proved = facets.meshes().flat_map(|m| &m.sag).copied().filter(|s| s.is_finite());
    let megabytes = facets.bytes() as f64 / 1_000_000.0;
    let rows: [(&str, Cell, &str); 7] = [
        ("facets", facets.facet_count().into(), ""),
        ("of these quads", sum(&FacetMesh::quad_count).into(), ""),
        ("tolerance where sharply curved", finest.into(), "mm"),
        ("tolerance where nearly flat", loosest.into(), "mm"),
        ("largest proved distance to the spline", proved.fold(0.0, f64::max).into(), "mm"),
        ("facets without a proof", sum(&|m| m.sag.iter().filter(|s| !s.is_finite()).count()).into(), ""),
        ("memory of the mesh", Cell::Number(megabytes, 3), "MB"),
    ];
    for (name, value, unit) in rows {
        table.row([name.into(), value, unit.into()]);
    }
    table
}

/// Returns what the view of the facets shows, in words, by the numbers of those drawn and of all, which were traced unless the run was on
/// the spline.
fn drawn_note(drawn: usize, all: usize, on_spline: bool) -> String {
    if drawn == all {
        let shown = if on_spline { "Facets of the surfaces that were traced" } else { "Facets as traced" };
        return format!("{shown}, parts in their colours, with some ray paths of the run.");
    }
    let which = if on_spline { "of the surfaces that were traced" } else { "that were traced" };
    format!(
        "Of {} facets {which} {} are shown: a part that is placed often is drawn once, its other places are boxes, of very many \
         some; with some ray paths of the run.",
        grouped(all as u64),
        grouped(drawn as u64)
    )
}

//! `lampyris check`: octree against BVH against exact spline, ray by ray, and how fast each is.

use crate::cli::arguments::command::CheckCommand;
use crate::cli::arguments::options::TracingOptions;
use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::appearance;
use crate::cli::output::json::{json_text, json_value};
use crate::cli::output::sentences::plain_sentence_lines;
use crate::cli::output::terminal_tables::blank_table;
use crate::cli::work::contenders::{Contenders, Structures};
use crate::cli::work::input_files;
use crate::cli::work::input_guard::InputGuard;
use crate::cli::work::output_place::{OutputPlace, require_report_space, try_file, try_folder};
use crate::cli::work::ray_input::read_rays;
use crate::cli::work::results_folder::MOST_DRAWN;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::{paired_receivers, threads};
use crate::formats::{file_name, write_atomic};
use crate::intersect::{Cost, Intersector, NormalMode};
use crate::math::{Aabb, Ray};
use crate::model::Model;
use crate::pipeline::{
    AccurateSettings, IntersectorChoice, RayRecorder, TracingSettings, angle_note, mesh_settings,
    settings_for_accuracy, tessellate_by_part,
};
use crate::report::{CheckReport, unexplained, verdict};
use crate::simulate::{RunSettings, Scene, simulate};
use crate::study::accuracy_target::AccuracyResult;
use crate::study::cross_check::{self, CrossCheck};
use crate::study::rays::mixed_rays;
use crate::study::receivers::PowerComparison;
use crate::study::{Lift, Progress, Quantiles, Summary, records};
use crate::text::{count_of, figures, grouped};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Rays by default: a second or two on a lamp.
const RAYS: u64 = 100_000;
/// Fewest rays of a scene's run that the sample is taken from.
const FEWEST_SCENE_RAYS: u64 = 64;
/// Columns of the table of rates.
const TABLE_WIDTH: usize = 100;

/// Asks octree, BVH and spline the same rays, of the scene, a file or its own, and prints how their answers differ and how fast they are.
///
/// Writes the files that were asked for. Incomplete where there are no facets, answers differ on the same facets or without a cause, or too
/// many faces were refused.
pub(crate) fn run(command: &CheckCommand, console: &Console) -> Result<Completion, Failure> {
    refuse_intersector(&command.tracing)?;
    // Before any work: a folder that cannot be made would cost it.
    let outputs = outputs_of(command);
    let guard = InputGuard::new(command.rays_in.iter().map(PathBuf::as_path).chain([command.file.as_path()]));
    outputs.iter().try_for_each(|(option, path)| guard.refuse(option, path).and_then(|()| try_file(path)))?;
    command.output.as_deref().map_or(Ok(()), try_folder)?;
    let threads = threads::set_threads(command.tracing.threads)?;
    let given = command.rays_in.as_deref().map(read_rays).transpose()?;
    let input = input_files::scene_or_model(&command.file, command.placed, console)?;
    let (scene, loaded) = (input.scene(), input.loaded());
    // Which files a scene names is known when it is read.
    let guard = scene.map(|scene| guard.with_scene(scene));
    outputs.iter().try_for_each(|(option, path)| guard.as_ref().map_or(Ok(()), |g| g.refuse(option, path)))?;
    if given.is_some() && scene.is_none() {
        refuse_unused_options(&command.tracing)?;
    }
    let _owned = claim_output(command)?;
    let model = &loaded.model;
    let monitor = TerminalMonitor::new(console);
    let requested = (command.meshing.settings(), command.tracing.settings());
    let AccurateSettings { meshing, tracing, plan: reached } =
        settings_for_accuracy(command.precision.accuracy, requested, scene, model, &monitor)?;
    let settings = mesh_settings(&meshing, scene, model)?;
    // Parts that are placed often are meshed, built and queried once, in their own coordinates.
    let facets = tessellate_by_part(model, &settings, &monitor);
    angle_note(&facets, model, &settings).into_iter().for_each(|note| console.say(note));
    let normals = IntersectorChoice::new(&tracing, scene)?.normals;
    let count = given.as_ref().map_or(tracing.rays().unwrap_or(RAYS), |rays| rays.len() as u64);
    let structures = Structures::build(model, &facets, normals.on_facets(), count, console);
    let contenders = structures.contenders();
    let (octree, exact) = (&*contenders.octree, &*contenders.exact);
    // The same rays through all three, and a cause for every difference.
    let rays = match given {
        Some(rays) => rays,
        None => own_rays(scene, model, &facets.bounds(), octree, &tracing, settings.loosest())?,
    };
    let mut found = judge(&contenders, &rays, settings.loosest(), console);
    // Only now, as it takes no part in the comparison.
    let polish = structures.polished();
    if normals == NormalMode::Exact {
        measure_polished(&mut found, [&*polish, exact], &rays, settings.loosest());
    }
    structures.time_all(&mut found, &contenders, &*polish, &rays, console);
    // All that stand in the scene, as every other command counts them.
    found.scene.facets = facets.facet_count();
    write_rays(command, &found, octree, &rays, console)?;
    // What the facets change of the light, which only a scene has.
    let on_facets = if normals == NormalMode::Exact { &*polish } else { octree };
    let bound = scene.map(|s| s.bind(model)).transpose()?;
    let receivers = scene.zip(bound.as_ref()).map_or_else(Vec::new, |(scene, bound)| {
        paired_receivers::trace_both(scene, bound, [on_facets, exact], &tracing, console)
    });
    let unit = scene.map(|scene| scene.run.unit).unwrap_or_default();
    let text = json_text(&json_document(&found, normals, scene.map(|_| &receivers[..]), reached.as_ref())?)?;
    if let Some(folder) = &command.output {
        let drawn = facets.drawn(MOST_DRAWN);
        let report = CheckReport {
            title: file_name(&command.file),
            check: &found,
            facets: &appearance::grouped_facets(model, &drawn, bound.as_ref()),
            normals: &normals.to_string(),
            tables: if receivers.is_empty() { Vec::new() } else { vec![paired_receivers::table(&receivers, unit)] },
            also: reached.iter().map(|a| a.answer.clone()).collect(),
            provenance: console.provenance(Some(tracing.seed.or(scene.map(|s| s.run.seed)).unwrap_or(1)), threads),
        };
        write_folder(folder, &report, command.report.is_wanted(), &text)?;
    }
    if console.json {
        print(&text)?;
    } else {
        print(&(check_summary(&found, normals, console.width()) + &paired_receivers::summary(&receivers)))?;
        say_files(command, &found, console);
    }
    // Last, because the answer counts although faces are missing.
    Ok(input_files::report_refusals(loaded, command.limits.max_refused, console)
        .and(report_defects(&found, console)))
}

/// The files that were asked for, by their options.
fn outputs_of(command: &CheckCommand) -> Vec<(&'static str, &Path)> {
    let outputs = [("--rays-out", &command.rays_out), ("--disagreements", &command.disagreements)];
    outputs.into_iter().filter_map(|(option, path)| path.as_deref().map(|path| (option, path))).collect()
}

/// Claims the folder of results, if one was asked for.
fn claim_output(command: &CheckCommand) -> Result<Option<OutputPlace>, Failure> {
    let Some(folder) = &command.output else { return Ok(None) };
    let owned = OutputPlace::folder(folder)?;
    require_report_space(folder, command.report.is_wanted())?;
    Ok(Some(owned))
}

/// Measures hits moved to the spline by themselves, because those on the facets say nothing of them: `polish` against `exact`.
fn measure_polished(found: &mut CrossCheck, [polish, exact]: [&dyn Intersector; 2], rays: &[Ray], loosest: f64) {
    let [distance, angle] = polished_errors(polish, exact, rays, loosest);
    found.facets_vs_exact.t_error_mm = distance;
    found.facets_vs_exact.normal_error_deg = angle;
}

/// Asks every ray of octree, BVH and spline, and finds the causes of differences. `loosest` is the largest tolerance of the facets, mm.
fn judge(contenders: &Contenders<'_>, rays: &[Ray], loosest: f64, console: &Console) -> CrossCheck {
    let bar = console.progress_bar("judging", "rays", rays.len() as u64);
    let band = cross_check::Settings { fallback_band_mm: loosest, ..Default::default() };
    let total = rays.len() as f64;
    let progress = |p: Progress| bar.set_position((p.done * total) as u64);
    let found = cross_check::cross_check_groups(&contenders.compared(), rays, &band, &progress);
    bar.finish_and_clear();
    found
}

/// Writes `check.json`, which is `text`, and the report if it is wanted, into a folder.
fn write_folder(folder: &Path, report: &CheckReport, with_report: bool, text: &str) -> Result<(), Failure> {
    if with_report {
        report.report().write(folder)?;
    }
    Ok(write_atomic(&folder.join("check.json"), |w| w.write_all(text.as_bytes()))?)
}

/// Refuses options of rays where a file has all of them; a scene is traced with rays of its own besides.
fn refuse_unused_options(tracing: &TracingOptions) -> Result<(), Failure> {
    let given = [("--rays", tracing.ray_range.is_some()), ("--seed", tracing.seed.is_some())];
    let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
    let failure = Failure::arguments(format!(
        "check --rays-in does not take {option}: the file of --rays-in has all of them"
    ));
    Err(failure.with_help("leave it out"))
}

/// Refuses a choice of the intersector: all of them are checked.
fn refuse_intersector(tracing: &TracingOptions) -> Result<(), Failure> {
    if tracing.intersector.is_none() {
        return Ok(());
    }
    let message = "check does not take --intersector: it compares octree, BVH and exact spline";
    Err(Failure::arguments(message).with_help("leave it out; `lampyris trace` takes it"))
}

/// Says what no check may find (no facets, answers that differ on the same facets, differences without a cause); incomplete if any was
/// found.
fn report_defects(found: &CrossCheck, console: &Console) -> Completion {
    let disagreements = found.octree_vs_bvh.disagree;
    let defects = [
        (found.scene.facets == 0, verdict(found)),
        (disagreements > 0, format!("octree and BVH answer {} differently", count_of(disagreements, "ray"))),
        (found.facets_vs_exact.unexplained > 0, unexplained(found)),
    ];
    let mut completion = Completion::Complete;
    for (_, defect) in defects.iter().filter(|(is_found, _)| *is_found) {
        console.insist(defect);
        completion = Completion::Incomplete;
    }
    completion
}

/// Returns what `--json` prints. `receivers` are those of a scene, `None` without one; `reached` is the outcome of `--accuracy`.
fn json_document(
    found: &CrossCheck,
    normals: NormalMode,
    receivers: Option<&[PowerComparison]>,
    reached: Option<&AccuracyResult>,
) -> Result<Value, Failure> {
    let mut document = json_value(found)?;
    document["normals"] = normals.to_string().into();
    if let Some(receivers) = receivers {
        document["receivers"] = json_value(&receivers)?;
    }
    if let Some(reached) = reached {
        document["accuracy"] = json_value(reached)?;
    }
    Ok(document)
}

/// Writes the files of rays that were asked for, in mm: all with the octree's answers, and those that were answered differently.
fn write_rays(
    command: &CheckCommand,
    found: &CrossCheck,
    octree: &dyn Intersector,
    rays: &[Ray],
    console: &Console,
) -> Result<(), Failure> {
    if let Some(path) = &command.rays_out {
        let mut hits = vec![None; rays.len()];
        octree.intersect_batch(rays, &mut hits, &mut Cost::default());
        write_atomic(path, |mut w| {
            records::write(&mut w, rays.iter().copied().zip(hits.iter().map(|h| h.map(|h| h.t))))
        })?;
        console.say(format_args!("wrote {}", path.display()));
    }
    if let Some(path) = &command.disagreements {
        let kept = found.disagreements.iter().map(|d| (d.ray, d.octree.map(|h| h.t)));
        write_atomic(path, |mut w| records::write(&mut w, kept.clone()))?;
        console.say(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

/// Says which files were written, or how to get them.
fn say_files(command: &CheckCommand, found: &CrossCheck, console: &Console) {
    match &command.output {
        Some(folder) => {
            if command.report.is_wanted() {
                console
                    .say(format_args!("\n  {}", console.bold(&folder.join("report.html").display().to_string())));
            }
            console.say(format_args!("  {}", folder.join("check.json").display()));
        }
        None if !found.disagreements.is_empty() => {
            console.say(console.dim("  -o DIR writes a report with the rays that differ in 3-D"));
        }
        None => {}
    }
}

/// Returns the rays of a scene's own run, or a camera's, random and bouncing ones for a bare model, which begin above the
/// facet that they leave; `loosest` is the largest tolerance, mm.
fn own_rays(
    scene: Option<&Scene>,
    model: &Model,
    bounds: &Aabb,
    octree: &dyn Intersector,
    tracing: &TracingSettings,
    loosest: f64,
) -> Result<Vec<Ray>, Failure> {
    let count = tracing.rays().unwrap_or(RAYS);
    let Some(scene) = scene else {
        return Ok(mixed_rays(bounds, octree, loosest, tracing.seed.unwrap_or(1), count));
    };
    let bound = scene.bind(model)?;
    // About four segments a ray; a few more rays, so that there are enough.
    let settings = RunSettings {
        rays: count.div_ceil(2).max(FEWEST_SCENE_RAYS),
        seed: tracing.seed.unwrap_or(scene.run.seed),
        ..RunSettings::from(&scene.run)
    };
    let recorder = RayRecorder::new(octree, count, count);
    simulate(&bound, &recorder, &settings, &|_| true);
    let lift = Lift::new(octree, loosest);
    Ok(recorder.rays(count as usize, model, |ray, up| lift.start(ray, up)))
}

/// Returns how far hits moved to the spline are from it, along the ray in mm and in the normal in degrees. Beyond `near` mm it is another
/// crossing, which the facets' own verdict counts.
fn polished_errors(polish: &dyn Intersector, exact: &dyn Intersector, rays: &[Ray], near: f64) -> [Summary; 2] {
    let ask = |intersector: &dyn Intersector| {
        let mut hits = vec![None; rays.len()];
        intersector.intersect_batch(rays, &mut hits, &mut Cost::default());
        hits
    };
    let (mut distance, mut angle) = (Quantiles::default(), Quantiles::default());
    for (p, e) in ask(polish).into_iter().zip(ask(exact)).filter_map(|(p, e)| p.zip(e)) {
        let apart = (p.t - e.t).abs();
        // On another face, or farther away, it is another crossing.
        if p.face == e.face && apart <= near {
            distance.add(apart);
            angle.add(p.normal.cross(e.normal).length().atan2(p.normal.dot(e.normal)).to_degrees());
        }
    }
    [distance.summary(), angle.summary()]
}

/// Returns the quantiles of errors in words, each with the unit.
fn spread_text(q: &Summary, unit: &str) -> String {
    let [p50, p99, max] = [q.p50, q.p99, q.max].map(|x| figures(x, 2));
    format!("off by {p50}{unit} (median), {p99}{unit} (99 %), {max}{unit} (largest)")
}

/// Returns what was found, for people: the verdict, differences by cause, errors, and a table of rates.
fn check_summary(c: &CrossCheck, normals: NormalMode, width: usize) -> String {
    let f = &c.facets_vs_exact;
    let e = &f.explained;
    let mut text = plain_sentence_lines(&verdict(c), width) + "\n";
    let mut line = |name: &str, what: String| text += &format!("  {name:<12} {what}\n");
    line(
        "rays",
        format!(
            "{} asked, {} hit; {} facets, {} patches",
            grouped(c.rays),
            grouped(c.hits),
            grouped(c.scene.facets as u64),
            grouped(c.scene.patches as u64)
        ),
    );
    line(
        "differences",
        format!("{} hit or miss, {} another face, {} unexplained", f.hit_miss, f.other_face, f.unexplained),
    );
    line(
        "explained",
        format!(
            "{} within sag, {} silhouette, {} trim edge, {} coincident, {} tangent, {} unproved facet, {} without facets or surface",
            e.within_sag,
            e.silhouette,
            e.trim_edge,
            e.coincident,
            e.tangent,
            e.unproved,
            e.unmeshed + e.no_surface
        ),
    );
    let moved = if normals == NormalMode::Exact { "moved to the spline, " } else { "" };
    line("distance", format!("{moved}{}", spread_text(&f.t_error_mm, " mm")));
    line("normals", format!("{normals}, {}", spread_text(&f.normal_error_deg, "°")));
    line(
        "spline",
        format!(
            "{} hits certified, {} tangent, {} uncertified",
            grouped(c.exact.certified),
            c.exact.tangent,
            c.exact.uncertified
        ),
    );
    let mut table = blank_table(TABLE_WIDTH);
    table.set_header(["", "Mrays/s, 1 thread", "build", "bytes per facet"]);
    let rates = c.mrays_per_s.named().into_iter();
    for (((name, rate), (_, build)), (_, size)) in rates.zip(c.build_seconds.named()).zip(c.bytes_per_facet.named())
    {
        let shown = |x: Option<f64>| x.map_or("–".into(), |x| figures(x, 3));
        let time = build.map_or("–".into(), crate::report::seconds);
        table.add_row([name.to_owned(), shown(rate), time, shown(size)]);
    }
    text += &format!("\n{table}\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_that_finds_a_defect_does_not_end_well() {
        let console = Console::new(false, true, 0, &[]);
        let sound = || {
            let mut found = CrossCheck::default();
            found.scene.facets = 12;
            found
        };
        assert_eq!(report_defects(&sound(), &console), Completion::Complete);
        let mut found = sound();
        found.octree_vs_bvh.disagree = 1;
        assert_eq!(report_defects(&found, &console), Completion::Incomplete);
        let mut found = sound();
        found.facets_vs_exact.unexplained = 1;
        assert_eq!(report_defects(&found, &console), Completion::Incomplete);
        assert_eq!(report_defects(&CrossCheck::default(), &console), Completion::Incomplete);
    }
}

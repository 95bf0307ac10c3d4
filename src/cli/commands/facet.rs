//! `lampyris facet`: quad facets within a proved tolerance, written in as many formats as asked for.

use crate::cli::arguments::command::FacetCommand;
use crate::cli::console::{Console, print};
use crate::cli::output::appearance;
use crate::cli::output::json::json_text;
use crate::cli::work::input_guard::InputGuard;
use crate::cli::work::output_place::try_file;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::{input_files, threads};
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::{ErrorKind, FACET_EXTENSIONS, is_facet_file, lower_extension, write_facets};
use crate::math::Point;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::pipeline::{mesh_settings, settings_for_accurate_facets, tessellate_model};
use crate::report::{bytes, seconds, tolerance_text};
use crate::step::peak_bytes;
use crate::study::facet_errors;
use crate::tessellate::{Report, sampled_sag};
use crate::text::{count_of, figures, grouped};
use crate::truck::baseline;
use serde::Serialize;
use std::path::Path;

/// Faces without facets that are named with their cause; `--json` has all of them.
const NAMED_FAILURES: usize = 10;

/// Meshes a STEP file, writes the facets into all files that were asked for, and prints the report. Incomplete where the share of
/// refused faces, or the share of placed faces without facets, is above `--max-refused`.
pub(crate) fn run(command: &FacetCommand, console: &Console) -> Result<Completion, Failure> {
    // A wrong extension is said before any work is done.
    if let Some(path) = command.output.iter().find(|p| !is_facet_file(p)) {
        let kind = ErrorKind::Extension { given: lower_extension(path), known: FACET_EXTENSIONS };
        return Err(crate::formats::Error::new(path, kind).into());
    }
    let guard = InputGuard::new([command.file.as_path()]);
    for path in &command.output {
        guard.refuse("-o", path)?;
        try_file(path)?;
    }
    threads::set_threads(command.threads)?;
    let loaded = input_files::model_file(&command.file, command.placed, console)?;
    let monitor = TerminalMonitor::new(console);
    let (meshing, reached) = settings_for_accurate_facets(
        command.precision.accuracy,
        command.meshing.settings(),
        &loaded.model,
        &monitor,
    )?;
    let mut settings = mesh_settings(&meshing, None, &loaded.model)?;
    // The report states what was reached, measured by other code than the prover's.
    settings.measure = true;
    let (mut made, _) = tessellate_model(&loaded.model, &settings, &monitor);
    made.report.seconds.read = loaded.seconds;
    made.report.peak_bytes = peak_bytes();
    // The faces have tolerances of their own; that of the settings is for those without.
    if let Some(plan) = &meshing.plan {
        [made.report.tolerance_mm.min, made.report.tolerance_mm.max] = plan.tolerance_mm();
    }
    let mut facets = appearance::grouped_facets(&loaded.model, &made.mesh, None);
    // Only VTU has a place for them, and they cost a look at every facet.
    if command.output.iter().any(|path| lower_extension(path) == "vtu") {
        (facets.normal_error_deg, facets.curvature_per_mm) = facet_errors(&loaded.model, &made.mesh);
    }
    for path in &command.output {
        let spinner = console.spinner(&format!("writing {}", path.display()));
        write_facets(path, &facets)?;
        spinner.finish_and_clear();
        console.say(format_args!("wrote {}", path.display()));
        say_rounding(path, &made.mesh, made.report.tolerance_mm.min, console);
    }
    let baseline = command.baseline.then(|| Baseline::run(&loaded.model, made.report.tolerance_mm.min));
    if console.json {
        #[derive(Serialize)]
        struct Both<'r> {
            #[serde(flatten)]
            report: &'r Report,
            #[serde(skip_serializing_if = "Option::is_none")]
            baseline: Option<Baseline>,
            #[serde(skip_serializing_if = "Option::is_none")]
            accuracy: Option<crate::study::accuracy_target::AccuracyResult>,
        }
        let both = Both { report: &made.report, baseline, accuracy: reached };
        print(&json_text(&both)?)?;
    } else {
        print(&meshing_summary(&made.report))?;
        if command.output.is_empty() {
            console.say(console.dim("  no facets were written: -o NAME.glb does (.obj .ply .stl .vtu .data2 too)"));
        }
        if let Some(b) = baseline {
            print(&b.comparison(&made.report))?;
        }
    }
    let refused = input_files::report_refusals(&loaded, command.limits.max_refused, console);
    let placed = made.report.faces.meshed + made.report.faces.failed;
    let missing = made.report.missing_faces();
    let over = missing as f64 > command.limits.max_refused * placed as f64;
    if made.report.faces.failed > 0 {
        say_failed_faces(&made.report, over, console);
    }
    Ok(refused.and(Completion::incomplete_if(over)))
}

/// Says that corners in an STL file are rounded by more than the tolerance, mm, where they are.
fn say_rounding(path: &Path, mesh: &FacetMesh, tolerance_mm: f64, console: &Console) {
    if lower_extension(path) == "stl"
        && let Some(moved) = single_precision_beyond(mesh, tolerance_mm)
    {
        console.say(format_args!(
            "{}: STL has single precision, which moves corners this far from the origin by up to {} mm, more than the tolerance of {} mm; \
             .ply, .obj and .vtu keep them",
            path.display(),
            figures(moved, 2),
            figures(tolerance_mm, 4)
        ));
    }
}

/// Returns by how much rounding to single precision may move a corner, mm, where that is more than `tolerance_mm`.
fn single_precision_beyond(mesh: &FacetMesh, tolerance_mm: f64) -> Option<f64> {
    let farthest = mesh.positions.iter().map(|p| p.abs()).fold(Point::ZERO, Point::max);
    // Half of the spacing along each axis.
    let moved = farthest.length() * f64::from(f32::EPSILON) / 2.0;
    (moved > tolerance_mm).then_some(moved)
}

/// Says how many faces got no facets, insisting where they are more than may be missing, and why the first of them got none.
fn say_failed_faces(report: &Report, is_over_limit: bool, console: &Console) {
    let failed = report.faces.failed;
    let placed = report.faces.meshed + failed;
    let why = if report.missing_faces() == 0 { ", for they have no area: nothing is missing" } else { "" };
    console.say_or_insist(is_over_limit, format!("{failed} of {placed} faces got no facets{why}"));
    for face in report.failed.iter().take(NAMED_FAILURES) {
        let entity = face.entity.map_or(format!("face {}", face.face), |id| format!("#{id}"));
        console.say(format_args!("  {entity}: {}", face.cause));
    }
}

/// What truck-meshalgo makes of the same model; `facet --json` has it under `baseline`.
#[derive(Serialize)]
struct Baseline {
    mesher: &'static str,
    tolerance_mm: f64,
    facets: usize,
    sampled_max_mm: f64,
    sampled_mean_mm: f64,
    failed_faces: usize,
    seconds: f64,
}

impl Baseline {
    /// Meshes the model by truck at one tolerance, mm, and samples how far its triangles lie from the splines.
    fn run(model: &Model, tolerance_mm: f64) -> Self {
        let made = baseline::mesh(model, tolerance_mm);
        let [sampled_max_mm, sampled_mean_mm] = sampled_sag(&made.mesh, model);
        Self {
            mesher: "truck-meshalgo",
            tolerance_mm,
            facets: made.mesh.facets.len(),
            sampled_max_mm,
            sampled_mean_mm,
            failed_faces: made.failed.len(),
            seconds: made.seconds,
        }
    }

    /// Returns a table, as text, with our mesher and the baseline one below the other; `r` is our report.
    fn comparison(&self, r: &Report) -> String {
        let shown = |x: Option<f64>, digits| x.map_or("–".to_owned(), |x| figures(x, digits));
        let sag = |max, mean| format!("{} ({})", shown(max, 4), shown(mean, 3));
        let rows = [
            (
                "lampyris",
                r.facets,
                sag(r.sag_mm.sampled_max, r.sag_mm.sampled_mean),
                r.faces.failed,
                r.seconds.tessellate,
            ),
            (
                self.mesher,
                self.facets,
                sag(Some(self.sampled_max_mm), Some(self.sampled_mean_mm)),
                self.failed_faces,
                self.seconds,
            ),
        ];
        let mut text = format!(
            "\n  {:<15} {:>10} {:>24} {:>14} {:>10}\n",
            "mesher", "facets", "sag mm (mean)", "faces without", "time"
        );
        for (name, facets, sag, failed, time) in rows {
            let facets = grouped(facets as u64);
            text += &format!("  {name:<15} {facets:>10} {sag:>24} {failed:>14} {:>10}\n", seconds(time));
        }
        text
    }
}

/// Returns how far the facets lie from the surface: what is proved, and what was sampled.
fn distance_text(r: &Report) -> String {
    let of = if r.certified < r.facets { " on the certified ones" } else { "" };
    let mut sag = format!("proved at most {} mm{of}", figures(r.sag_mm.bound_max, 4));
    if let (Some(max), Some(mean)) = (r.sag_mm.sampled_max, r.sag_mm.sampled_mean) {
        sag += &format!("; sampled: at most {} mm, mean {} mm", figures(max, 4), figures(mean, 3));
    }
    if let Some(over) = r.over_tolerance {
        sag += &format!("; {} over the tolerance", count_of(over as u64, "facet"));
    }
    if r.unsampled > 0 {
        let n = |x: usize| grouped(x as u64);
        sag += &format!("; sampled on {} of {} facets", n(r.facets - r.unsampled), n(r.facets));
    }
    sag
}

/// Returns how many facets turn farther from the surface normals than the angle asked for; `None` where none was.
fn angle_text(r: &Report) -> Option<String> {
    let steep = r.over_angle.as_ref()?;
    let count: usize = steep.iter().map(|s| s.facets).sum();
    let largest = steep.iter().map(|s| s.largest_deg).fold(0.0, f64::max);
    Some(match count {
        0 => "kept by all facets".to_owned(),
        _ => format!(
            "{} of {} turn farther, at most {}°",
            count_of(count as u64, "facet"),
            count_of(steep.len() as u64, "face"),
            figures(largest, 3)
        ),
    })
}

/// Returns the report of a meshing as lines for people.
fn meshing_summary(r: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, what: String| text += &format!("  {name:<10} {what}\n");
    let n = |x: usize| grouped(x as u64);
    let [quads, triangles] =
        [(r.quads, "quad"), (r.triangles, "triangle")].map(|(n, what)| count_of(n as u64, what));
    line("facets", format!("{}: {quads}, {triangles}; {} vertices", n(r.facets), n(r.vertices)));
    line("quads", format!("{} % of the area", figures(100.0 * r.quad_area_share, 4)));
    line("tolerance", tolerance_text([r.tolerance_mm.min, r.tolerance_mm.max]));
    line(
        "certified",
        format!("{} of {} facets are proved to be within their tolerance", n(r.certified), n(r.facets)),
    );
    line("distance", distance_text(r));
    if let Some(e) = r.normal_error_deg {
        line(
            "normals",
            format!(
                "off by {}° (median), {}° (99 %), {}° (largest)",
                figures(e.p50, 2),
                figures(e.p99, 2),
                figures(e.max, 2)
            ),
        );
    }
    if let Some(angle) = angle_text(r) {
        line("angle", angle);
    }
    let volume = r.volume_mm3.map_or("open".to_owned(), |v| format!("{} mm³", figures(v, 6)));
    line("size", format!("area {} mm², volume {volume}", figures(r.area_mm2, 6)));
    let sheets = match r.shells.sheets as u64 {
        0 => String::new(),
        n => format!("; {}, which {} no volume", count_of(n, "sheet"), if n == 1 { "bounds" } else { "bound" }),
    };
    line(
        "shells",
        format!(
            "{} closed, {} not; {} open and {} ambiguous edges{sheets}",
            r.shells.closed, r.shells.open, r.open_edges, r.nonmanifold_edges
        ),
    );
    let mended = r.repaired.iter().map(|f| f.reached_mm).fold(0.0, f64::max);
    let mended = match r.repaired.len() {
        0 => String::new(),
        count => format!("; {count} repaired, at most {} mm from the surface", figures(mended, 3)),
    };
    line("faces", format!("{} with facets, {} without{mended}", n(r.faces.meshed), r.faces.failed));
    let peak = r.peak_bytes.map_or(String::new(), |b| format!("; {} at most", bytes(b)));
    line("time", format!("read {}, tessellate {}{peak}", seconds(r.seconds.read), seconds(r.seconds.tessellate)));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_is_named_where_it_moves_corners_beyond_the_tolerance() {
        let at =
            |x: f64| FacetMesh { positions: vec![Point::ZERO, Point::new(-x, 0.0, 0.0)], ..FacetMesh::default() };
        // Numbers of 2^20 are 1/8 apart in 24 bits.
        assert_eq!(single_precision_beyond(&at(1048576.0), 0.05), Some(0.0625));
        assert_eq!(single_precision_beyond(&at(1048576.0), 0.0625), None);
        assert_eq!(single_precision_beyond(&at(1000.0), 0.05), None);
    }
}

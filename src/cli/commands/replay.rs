//! `trace --replay`: single rays of a run once more, with every vertex of their paths.

use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::closing::LOST_RAYS_FILE;
use crate::cli::output::json::json_text;
use crate::cli::work::lost_rays::COLUMNS;
use crate::cli::work::output_place::make_folder;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::formats::{read_text, write_vtp};
use crate::pipeline::PreparedScene;
use crate::report::path_lines;
use crate::simulate::{MOST_RAYS, PathVertex, Results, RunSettings, replay};
use crate::text::figures;
use serde_json::{Value, json};
use std::path::Path;

/// What `--replay` asks for: rays by number, and the run of a ledger.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct ReplayRequest {
    /// Ascending, each once, counted from 0.
    pub(crate) rays: Vec<u64>,
    /// The ledger's run; `None` where no ledger was given.
    run: Option<LedgerRun>,
}

/// The values that determine the numbering of a run's rays.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LedgerRun {
    seed: u64,
    rays: u64,
    /// Whether it is divided into replicates of a fixed size.
    grows: bool,
}

impl ReplayRequest {
    pub(crate) fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }
}

/// Reads words that are numbers of rays or paths of ledgers; fails on ledgers of different runs. Empty words make an empty request.
pub(crate) fn parse_request(words: &[String]) -> Result<ReplayRequest, Failure> {
    let mut request = ReplayRequest::default();
    for word in words {
        if let Ok(ray) = word.parse() {
            request.rays.push(ray);
            continue;
        }
        let text = read_text(Path::new(word)).map_err(|e| {
            Failure::input(format!("--replay {word}: {e}"))
                .with_help(format!("give the number of a ray, or a {LOST_RAYS_FILE} of an earlier run"))
        })?;
        read_ledger(&text, &mut request).map_err(|m| Failure::input(format!("--replay {word}: {m}")))?;
    }
    // Traced once each, in the order of the run.
    request.rays.sort_unstable();
    request.rays.dedup();
    Ok(request)
}

/// Adds the rays of a ledger of lost rays to the request, and its run; fails, with a message, if it is none or of another run.
fn read_ledger(text: &str, request: &mut ReplayRequest) -> Result<(), String> {
    let mut lines = text.lines();
    if lines.next() != Some(COLUMNS) {
        return Err(format!("not a ledger of lost rays: its first line is not \"{COLUMNS}\""));
    }
    for (k, line) in lines.enumerate().filter(|(_, l)| !l.is_empty()) {
        let number = |s: Option<&str>| {
            s.and_then(|s| s.parse::<u64>().ok()).ok_or(format!("line {}: a number is missing", k + 2))
        };
        request.rays.push(number(line.split(',').next())?);
        // From the end: names, which may hold commas, stand before these.
        let mut last = line.rsplit(',');
        let grows = last.next().and_then(|s| s.parse().ok());
        let grows = grows.ok_or(format!("line {}: the last cell must be true or false", k + 2))?;
        let (rays, seed) = (number(last.next())?, number(last.next())?);
        if rays == 0 || rays > MOST_RAYS {
            return Err(format!("line {}: no run has {rays} rays", k + 2));
        }
        let run = LedgerRun { seed, rays, grows };
        // One ledger is of one run; with two the seed would be ambiguous.
        if request.run.replace(run).is_some_and(|other| other != run) {
            return Err(format!("line {}: another seed, number of rays or plan than the lines before", k + 2));
        }
    }
    Ok(())
}

/// Traces the rays again, prints every vertex of their paths, and writes these as `replay.vtp` into the folder, which is made. Fails for
/// rays beyond the run's last.
pub(crate) fn run(
    prepared: &PreparedScene,
    request: &ReplayRequest,
    folder: &Path,
    console: &Console,
) -> Result<(), Failure> {
    let settings = prepared.run_settings();
    let RunSettings { seed, rays, grows, .. } = settings;
    // A ray is traced again only by the seed, the number of rays and the plan of its own run.
    let LedgerRun { seed, rays, grows } = request.run.unwrap_or(LedgerRun { seed, rays, grows });
    let settings = RunSettings { seed, rays, grows, ..settings };
    let found = prepared.with_intersector(&TerminalMonitor::new(console), |intersector, _| {
        replay(&prepared.bound, intersector, &settings, &request.rays)
    });
    // Rays beyond the last are not traced.
    if found.rays < request.rays.len() as u64 {
        let message = format!("--replay: the run has {rays} rays, counted from 0");
        return Err(Failure::arguments(message).with_help("give the number of rays that the run had with --rays"));
    }
    make_folder(folder)?;
    let (lines, _) = path_lines(&found.paths);
    write_vtp(&folder.join("replay.vtp"), &lines)?;
    if console.json {
        let rays: Vec<Value> =
            found.paths.chunk_by(|a, b| a.ray == b.ray).map(|p| document_of(p, &found)).collect();
        return Ok(print(&json_text(&json!({"seed": seed, "rays": rays}))?)?);
    }
    print_paths(prepared, &found)?;
    console.say(format_args!("wrote {}", folder.join("replay.vtp").display()));
    Ok(())
}

/// Head of the powers of vertices.
const POWER: &str = "power [of an average ray]";

/// Prints every vertex of every path, in mm and scene coordinates, and where and why a ray was lost.
fn print_paths(prepared: &PreparedScene, found: &Results) -> Result<(), Failure> {
    // Branches of a split ray follow each other.
    for path in found.paths.chunk_by(|a, b| (a.ray, a.branch) == (b.ray, b.branch)) {
        print(&format!("ray {}, branch {}\n", path[0].ray, path[0].branch))?;
        // Widths as those of the rows.
        print(&format!(
            "  {:<6}  {:<12} {:>14} {:>14} {:>14}  {}\n",
            "bounce", "event", "x [mm]", "y [mm]", "z [mm]", POWER
        ))?;
        for v in path {
            let p = v.point;
            let event = v.event.name().replace('_', " ");
            print(&format!(
                "  {:>6}  {event:<12} {:>14.6} {:>14.6} {:>14.6}  {}\n",
                v.bounce,
                p.x,
                p.y,
                p.z,
                figures(v.power, 6)
            ))?;
        }
        for l in found.ledger.iter().filter(|l| (l.ray, l.branch) == (path[0].ray, path[0].branch)) {
            let [instance, medium] = prepared.bound.body_names(l.body).unwrap_or(["", ""]);
            print(&format!("  lost: {}, in {medium} of {instance}\n", l.cause.name().replace('_', " ")))?;
        }
    }
    Ok(())
}

/// Makes the JSON object of one ray: its vertices, of all branches, and what was lost of it. `path` must not be empty.
fn document_of(path: &[PathVertex], found: &Results) -> Value {
    let lost: Vec<Value> = (found.ledger.iter())
        .filter(|l| l.ray == path[0].ray)
        .map(|l| {
            json!({"branch": l.branch, "bounce": l.bounce, "cause": l.cause.name(), "face": l.face,
            "origin": l.origin.to_array(), "direction": l.direction.to_array()})
        })
        .collect();
    let vertices: Vec<Value> = (path.iter())
        .map(|v| json!({"branch": v.branch, "bounce": v.bounce, "event": v.event, "point": v.point.to_array(), "power": v.power}))
        .collect();
    json!({"ray": path[0].ray, "vertices": vertices, "lost": lost})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_gives_its_rays_and_its_run() {
        let line =
            |ray: u64, seed: u64| format!("{ray},0,1,no_exit,1,0,0,0,0,0,1,\"a,b\",\"g\",,\"\",{seed},100,true\n");
        let text = format!("{COLUMNS}\n{}{}", line(7, 3), line(9, 3));
        let mut request = ReplayRequest::default();
        read_ledger(&text, &mut request).unwrap();
        let run = LedgerRun { seed: 3, rays: 100, grows: true };
        assert_eq!((&request.rays, request.run), (&vec![7, 9], Some(run)));
        assert!(read_ledger(&format!("{text}{}", line(1, 4)), &mut request).unwrap_err().contains("line 4"));
        assert!(read_ledger("ray\n1\n", &mut request).unwrap_err().contains("not a ledger"));
    }
}

//! The lost-ray ledger: one line a lost ray, with all that is needed to trace it again, and `trace --replay`.

use super::engine;
use super::job::Prepared;
use crate::cli::Failure;
use crate::cli::context::{Context, print};
use crate::formats::{write_atomic, write_vtp};
use crate::report::path_lines;
use crate::simulate::{Cause, LostRay, PathVertex, Results, RunSettings, replay};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the ledger in a folder of results.
pub(crate) const LEDGER: &str = "lost_rays.csv";
const COLUMNS: &str =
    "ray,branch,bounce,cause,power,x_mm,y_mm,z_mm,dx,dy,dz,instance,medium,face,hit_instance,seed,rays";

/// Writes the ledger, when a ray was lost. Text in quotes, as instance names may hold commas.
pub(crate) fn write(folder: &Path, results: &Results, prepared: &Prepared) -> Result<bool, Failure> {
    if results.ledger.is_empty() {
        return Ok(false);
    }
    let settings = prepared.run_settings();
    write_atomic(&folder.join(LEDGER), |w| {
        writeln!(w, "{COLUMNS}")?;
        for l in &results.ledger {
            let power = l.quanta as f64 * results.quantum;
            let (o, d) = (l.origin, l.direction);
            let [instance, medium] = prepared.bound.body(l.body).unwrap_or(["", ""]).map(quoted);
            let face = l.face.map(|f| f.to_string()).unwrap_or_default();
            let hit = quoted(l.face.and_then(|f| prepared.bound.instance(f)).unwrap_or(""));
            writeln!(
                w,
                "{},{},{},{},{power},{},{},{},{},{},{},{instance},{medium},{face},{hit},{},{}",
                l.ray,
                l.branch,
                l.bounce,
                cause(l),
                o.x,
                o.y,
                o.z,
                d.x,
                d.y,
                d.z,
                settings.seed,
                settings.rays
            )?;
        }
        Ok(())
    })?;
    Ok(true)
}

/// Says what is open in the scene, or beyond its tables.
pub(crate) fn warn(prepared: &Prepared, context: &Context) {
    prepared.bound.notes().iter().for_each(|note| context.say(note));
}

/// Why rays were lost and where, the most frequent first.
pub(crate) fn reasons(results: &Results, prepared: &Prepared) -> String {
    let mut count: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for l in &results.ledger {
        let at = l.face.and_then(|f| prepared.bound.instance(f));
        let inside = || prepared.bound.body(l.body).map(|[instance, _]| instance);
        *count.entry((meaning(l.cause), at.or_else(inside).unwrap_or(""))).or_default() += 1;
    }
    let mut all: Vec<_> = count.into_iter().collect();
    all.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let some: Vec<String> = all.iter().take(3).map(|((why, at), n)| format!("{n} {why} at '{at}'")).collect();
    let of = if results.lost_rays as usize > results.ledger.len() { "of the first 1000: " } else { "" };
    format!("{of}{}", some.join("; "))
}

fn meaning(cause: Cause) -> &'static str {
    match cause {
        Cause::NoExit => "left the scene inside a medium, as by a gap or an open shell,",
        Cause::ImpossibleMedium => "met a body from the wrong side, as through a gap or an open shell,",
        Cause::InsideSolid => "hit an opaque solid from inside, as through a gap,",
        Cause::TooDeep => "were in more than 7 bodies at once, as after entering an open shell again and again,",
        _ => "had a distance or direction that is no number",
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

fn cause(l: &LostRay) -> String {
    let name = serde_json::to_value(l.cause).ok();
    name.and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

/// What `--replay` asks for: rays by number, and the seed and number of rays of a ledger.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Asked {
    pub(crate) rays: Vec<u64>,
    run: Option<[u64; 2]>,
}

impl Asked {
    pub(crate) fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }
}

/// Rays given by number, or all those of a ledger.
pub(crate) fn asked(words: &[String]) -> Result<Asked, Failure> {
    let mut asked = Asked::default();
    for word in words {
        if let Ok(ray) = word.parse() {
            asked.rays.push(ray);
            continue;
        }
        let text = std::fs::read_to_string(word).map_err(|e| {
            Failure::input(format!("--replay {word}: {e}"))
                .help(format!("give the number of a ray, or a {LEDGER} of an earlier run"))
        })?;
        read(&text, &mut asked).map_err(|m| Failure::input(format!("--replay {word}: {m}")))?;
    }
    asked.rays.sort_unstable();
    asked.rays.dedup();
    Ok(asked)
}

fn read(text: &str, asked: &mut Asked) -> Result<(), String> {
    let mut lines = text.lines();
    if lines.next() != Some(COLUMNS) {
        return Err(format!("not a ledger of lost rays: its first line is not \"{COLUMNS}\""));
    }
    for (k, line) in lines.enumerate().filter(|(_, l)| !l.is_empty()) {
        let number = |s: Option<&str>| {
            s.and_then(|s| s.parse::<u64>().ok()).ok_or(format!("line {}: a number is missing", k + 2))
        };
        asked.rays.push(number(line.split(',').next())?);
        let mut last = line.rsplit(',');
        let (rays, seed) = (number(last.next())?, number(last.next())?);
        if asked.run.replace([seed, rays]).is_some_and(|r| r != [seed, rays]) {
            return Err(format!("line {}: another seed or number of rays than the lines before", k + 2));
        }
    }
    Ok(())
}

/// Traces the rays again and shows every vertex of their paths; they are written as `replay.vtp` too.
pub(crate) fn run(prepared: &Prepared, asked: &Asked, folder: &Path, context: &Context) -> Result<(), Failure> {
    let own = prepared.run_settings();
    let [seed, rays] = asked.run.unwrap_or([own.seed, own.rays]);
    let settings = RunSettings { seed, rays, ..own };
    let (model, mesh) = (&prepared.job.loaded.model, &prepared.tessellation.mesh);
    let found = engine::with_intersector(prepared.choice, model, mesh, context, |intersector, _| {
        replay(&prepared.bound, intersector, &settings, &asked.rays)
    });
    if found.rays < asked.rays.len() as u64 {
        let message = format!("--replay: the run has {rays} rays, counted from 0");
        return Err(Failure::arguments(message).help("give the number of rays that the run had with --rays"));
    }
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::running(format!("{}: cannot be made: {e}", folder.display())))?;
    let (lines, _) = path_lines(&found.paths);
    write_vtp(&folder.join("replay.vtp"), &lines)?;
    if context.json {
        let rays: Vec<Value> = found.paths.chunk_by(|a, b| a.ray == b.ray).map(|p| described(p, &found)).collect();
        return Ok(print(&format!("{:#}\n", json!({"seed": seed, "rays": rays})))?);
    }
    for path in found.paths.chunk_by(|a, b| (a.ray, a.branch) == (b.ray, b.branch)) {
        print(&format!("ray {}, branch {}\n", path[0].ray, path[0].branch))?;
        for v in path {
            let p = v.point;
            let event = format!("{:?}", v.event);
            print(&format!(
                "  {:>5}  {event:<12} {:>22} {:>22} {:>22}  power {}\n",
                v.bounce, p.x, p.y, p.z, v.power
            ))?;
        }
        for l in found.ledger.iter().filter(|l| (l.ray, l.branch) == (path[0].ray, path[0].branch)) {
            let [instance, medium] = prepared.bound.body(l.body).unwrap_or(["", ""]);
            print(&format!("  lost: {}, in {medium} of {instance}\n", cause(l).replace('_', " ")))?;
        }
    }
    context.say(format_args!("wrote {}", folder.join("replay.vtp").display()));
    Ok(())
}

fn described(path: &[PathVertex], found: &Results) -> Value {
    let lost: Vec<Value> = (found.ledger.iter())
        .filter(|l| l.ray == path[0].ray)
        .map(|l| {
            json!({"branch": l.branch, "bounce": l.bounce, "cause": cause(l), "face": l.face,
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
            |ray: u64, seed: u64| format!("{ray},0,1,no_exit,1,0,0,0,0,0,1,\"a,b\",\"g\",,\"\",{seed},100\n");
        let text = format!("{COLUMNS}\n{}{}", line(7, 3), line(9, 3));
        let mut asked = Asked::default();
        read(&text, &mut asked).unwrap();
        assert_eq!(asked, Asked { rays: vec![7, 9], run: Some([3, 100]) });
        assert!(read(&format!("{text}{}", line(1, 4)), &mut asked).unwrap_err().contains("line 4"));
        assert!(read("ray\n1\n", &mut asked).unwrap_err().contains("not a ledger"));
    }
}

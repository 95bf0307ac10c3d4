//! How long does meshing alone take, warm? The half of `against_occt.py` that runs in this program: one request a line on standard
//! input, one answer in JSON a line on standard output, so that rounds of both programs can alternate.
//!
//! A request is `path<TAB>tolerance_mm<TAB>rounds<TAB>measure` (measure 0 or 1: sample the sag once, beside the clock). A file is
//! read when its name changes; each answer has the least wall and processor time of its rounds.
//!
//! ```text
//! cargo bench --bench against_occt --no-run    # says where the program lies
//! ```

use lampyris::step::{Settings as Reading, read};
use lampyris::tessellate::{Settings, tessellate};
use std::io::{BufRead, Write};
use std::path::Path;

/// Processor seconds of this process.
#[cfg(target_os = "linux")]
fn processor() -> f64 {
    // The two clocks of `/proc/self/stat` tick in hundredths of a second; the scheduler's own sum is in nanoseconds, thread by thread.
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let one = |t: std::fs::DirEntry| {
        let text = std::fs::read_to_string(t.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    tasks.filter_map(one).sum::<f64>() * 1e-9
}

#[cfg(not(target_os = "linux"))]
fn processor() -> f64 {
    f64::NAN
}

fn main() {
    let mut held = None;
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let parts: Vec<&str> = line.split('\t').collect();
        let [path, tolerance, rounds, measure] = parts.as_slice() else { continue };
        let (Ok(tolerance), Ok(rounds)) = (tolerance.parse::<f64>(), rounds.parse::<usize>()) else { continue };
        if held.as_ref().is_none_or(|(name, _)| name != path) {
            held = read(Path::new(path), &Reading::default()).ok().map(|i| (path.to_string(), i.model));
        }
        let answer = match &held {
            None => serde_json::json!({ "unread": true }),
            Some((_, model)) => {
                let settings = Settings::uniform(tolerance);
                let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
                let mut made = Default::default();
                for _ in 0..rounds {
                    let before = processor();
                    made = tessellate(model, &settings);
                    wall = wall.min(made.report.seconds.tessellate);
                    cpu = cpu.min(processor() - before);
                }
                if *measure == "1" {
                    made = tessellate(model, &Settings { measure: true, ..settings });
                }
                let r = &made.report;
                serde_json::json!({
                    "seconds": wall, "processor_seconds": cpu, "facets": r.facets, "certified": r.certified,
                    "quad_area_share": r.quad_area_share, "faces_failed": r.faces.failed,
                    "shells_open": r.shells.open, "sag_mm": r.sag_mm.sampled_max, "over_tolerance": r.over_tolerance,
                })
            }
        };
        let mut out = std::io::stdout().lock();
        if writeln!(out, "{answer}").and_then(|()| out.flush()).is_err() {
            return;
        }
    }
}

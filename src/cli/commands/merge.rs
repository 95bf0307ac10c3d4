//! `lampyris merge`: the results of all parts of a run.

use crate::cli::completion::Completion;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::closing;
use crate::cli::work::cross_check;
use crate::cli::work::scene_run::{self, PreparedScene, SceneJob, TraceRequest};
use crate::cli::work::tally_file::{TallyHeader, fingerprint};
use crate::cli::work::{input_files, results_folder};
use crate::simulate::Portion;
use std::path::{Path, PathBuf};

/// Puts the parts together and writes the results of the whole run.
pub(crate) fn run(parts: &[PathBuf], folder: &Path, console: &Console) -> Result<Completion, Failure> {
    let [first, ..] = parts else { return Err(Failure::arguments("merge: no parts given")) };
    let header: TallyHeader = Portion::header(&read(first)?).map_err(|m| unreadable(first, m))?;
    let (scene, loaded) = input_files::scene_file(&header.scene, console)?;
    let (meshing, tracing) = (header.meshing(), header.tracing());
    let job = SceneJob { scene: &scene, loaded: &loaded, meshing: &meshing, tracing: &tracing, accuracy: None };
    let prepared = scene_run::prepare(job, console)?;
    let whole = sum(parts, &header, &prepared)?;
    if !whole.is_whole() {
        return Err(Failure::input(missing_parts(&whole, header.shard)).with_help("merge all parts at once"));
    }
    let request = TraceRequest { from: Some(whole), ..TraceRequest::default() };
    let mut run = cross_check::trace_and_check(&prepared, request, console);
    let (document, report) = results_folder::write(&prepared, folder, &mut run, Vec::new(), console)?;
    closing::print_results(&document, &report.answer, folder, &run.results, console)?;
    Ok(Completion::Complete)
}

fn unreadable(path: &Path, message: impl std::fmt::Display) -> Failure {
    Failure::input(format!("{}: {message}", path.display()))
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|e| unreadable(path, e))
}

/// The sum of all parts, each of which must be of the run that the first one's header names.
fn sum(parts: &[PathBuf], header: &TallyHeader, prepared: &PreparedScene) -> Result<Portion, Failure> {
    let expected = fingerprint(prepared)?.0;
    let check = |h: &TallyHeader| {
        if h.fingerprint == expected {
            return Ok(());
        }
        Err(if h.fingerprint == header.fingerprint {
            format!("the scene {} or the program has changed since this part was traced", h.scene.display())
        } else {
            format!("it is part of another run ({}) than {}", h.command, parts[0].display())
        })
    };
    let mut sum: Option<Portion> = None;
    for path in parts {
        let part = Portion::read(&read(path)?, check, &prepared.bound).map_err(|m| unreadable(path, m))?;
        match &mut sum {
            Some(sum) => sum.merge(&part).map_err(|m| unreadable(path, m))?,
            None => sum = Some(part),
        }
    }
    sum.ok_or_else(|| Failure::arguments("merge: no parts given"))
}

/// Which shards are not there.
fn missing_parts(whole: &Portion, shard: Option<[u32; 2]>) -> String {
    let absent = |r: &u32| whole.done.binary_search(r).is_err();
    let count = (0..whole.replicates).filter(absent).count();
    let mut text = format!("{count} of the {} replicates of the run are missing", whole.replicates);
    if let Some([_, n]) = shard {
        let first = |k: u32| (u64::from(whole.replicates) * u64::from(k) / u64::from(n)) as u32;
        let shards: Vec<String> = (0..n)
            .filter(|&k| (first(k)..first(k + 1)).any(|r| absent(&r)))
            .map(|k| format!("{}/{n}", k + 1))
            .collect();
        text += &format!(": those of shard {}", shards.join(", "));
    }
    text
}

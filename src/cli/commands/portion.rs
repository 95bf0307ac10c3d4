//! Parts of a run on disk: shards, checkpoints, `--resume` and `merge`.

use crate::cli::Failure;
use crate::cli::arguments::options::{IntersectorKind, Meshing, Tracing};
use crate::cli::context::{Context, print};
use crate::cli::work::job::{self, Job, Prepared, Ways};
use crate::cli::work::load;
use crate::formats::write_atomic;
use crate::intersect::NormalMode;
use crate::report::grouped;
use crate::simulate::{Fingerprint, Portion, RunSettings};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Name of the file that an interrupted run leaves in its folder.
pub(crate) const CHECKPOINT: &str = "checkpoint.tally";

/// What stands at the head of a tally file: enough to write the results of the whole run. Lengths and angles as bits of `f64`.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Header {
    fingerprint: String,
    scene: PathBuf,
    tolerance: Option<[u64; 2]>,
    angle: Option<u64>,
    part: Vec<(String, [u64; 2])>,
    #[serde(default)]
    face: Vec<(String, [u64; 2])>,
    #[serde(default)]
    role: Vec<(String, [u64; 2])>,
    rays: Option<u64>,
    seed: Option<u64>,
    intersector: Option<String>,
    normals: Option<String>,
    shard: Option<[u32; 2]>,
    command: String,
}

impl Header {
    fn new(prepared: &Prepared, scene: &Path, shard: Option<[u32; 2]>, context: &Context) -> Result<Self, Failure> {
        let (m, t) = (prepared.job.meshing, prepared.job.tracing);
        let bits = |x: [f64; 2]| x.map(f64::to_bits);
        Ok(Self {
            fingerprint: fingerprint(prepared)?.0,
            scene: std::path::absolute(scene).unwrap_or_else(|_| scene.to_path_buf()),
            tolerance: m.tolerance.map(bits),
            angle: m.angle.map(f64::to_bits),
            part: m.part.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            face: m.face.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            role: m.role.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            rays: t.rays,
            seed: t.seed,
            intersector: t.intersector.map(|i| i.to_string()),
            normals: t.normals.map(|n| n.to_string()),
            shard,
            command: context.command.clone(),
        })
    }

    fn meshing(&self) -> Meshing {
        let back = |x: [u64; 2]| x.map(f64::from_bits);
        Meshing {
            tolerance: self.tolerance.map(back),
            angle: self.angle.map(f64::from_bits),
            part: self.part.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            face: self.face.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            role: self.role.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            // Parts are not traced with an accuracy asked for.
            plan: None,
        }
    }

    fn tracing(&self) -> Tracing {
        Tracing {
            rays: self.rays,
            seed: self.seed,
            threads: None,
            intersector: self.intersector.as_ref().and_then(|n| IntersectorKind::from_str(n, true).ok()),
            normals: self.normals.as_ref().and_then(|n| NormalMode::from_str(n, true).ok()),
        }
    }
}

/// A hash of all that decides the bits of a run: program, scene, its files, facets, intersector, settings.
fn fingerprint(prepared: &Prepared) -> Result<Fingerprint, Failure> {
    let scene = prepared.job.scene;
    let defaults = RunSettings::default();
    let settings = RunSettings {
        threads: 0,
        batch: 0,
        kernel: defaults.kernel,
        shard: [0, 1],
        path_samples: 0,
        ..prepared.run_settings()
    };
    let words = format!(
        "{} {} {:?} {:?} {settings:?}",
        env!("CARGO_PKG_VERSION"),
        env!("LAMPYRIS_COMMIT"),
        prepared.mesh_settings,
        prepared.choice
    );
    let mut pieces = vec![words.into_bytes(), scene.origin.text.as_deref().unwrap_or("").as_bytes().to_vec()];
    let files = scene.models.iter().map(|m| &m.file).chain(scene.sources.iter().filter_map(|s| s.file.as_ref()));
    for file in files {
        let path = scene.resolve(file);
        let read = std::fs::read(&path).map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
        pieces.push(read);
    }
    let pieces: Vec<&[u8]> = pieces.iter().map(Vec::as_slice).collect();
    Ok(Fingerprint::of(&pieces))
}

/// `I/N` as it is typed, both counted from 1; from 0 inside.
pub(crate) fn shard(text: &str) -> Result<[u32; 2], Failure> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((i, n)) if (1..=n).contains(&i) && n <= 1 << 16 => Ok([i - 1, n]),
        _ => Err(Failure::arguments(format!("--shard {text}: write I/N with I from 1 to N, as in 2/8"))),
    }
}

/// Where the tally of a shard goes: the file that was asked for, or one in the folder that was.
pub(crate) fn shard_file(output: &Path, [i, n]: [u32; 2]) -> PathBuf {
    match output.extension().is_some_and(|e| e.eq_ignore_ascii_case("tally")) {
        true => output.to_path_buf(),
        false => output.join(format!("shard-{}-of-{n}.tally", i + 1)),
    }
}

/// A file that a run is saved to while it goes on.
pub(crate) struct Checkpoint<'a> {
    prepared: &'a Prepared<'a>,
    header: Mutex<Option<Header>>,
    scene: &'a Path,
    shard: Option<[u32; 2]>,
    file: PathBuf,
    every: Duration,
    last: Mutex<Instant>,
    context: &'a Context,
}

impl<'a> Checkpoint<'a> {
    pub(crate) fn new(
        prepared: &'a Prepared<'a>,
        scene: &'a Path,
        file: PathBuf,
        shard: Option<[u32; 2]>,
        every: f64,
        context: &'a Context,
    ) -> Self {
        let every = Duration::try_from_secs_f64(every).unwrap_or(Duration::MAX);
        let (header, last) = (Mutex::new(None), Mutex::new(Instant::now()));
        Self { prepared, header, scene, shard, file, every, last, context }
    }

    /// How often to look whether it is time to save.
    pub(crate) fn often(&self) -> Duration {
        self.every.min(Duration::from_millis(250))
    }

    /// What an earlier run left behind; `None` when there is nothing.
    pub(crate) fn read(&self) -> Result<Option<Portion>, Failure> {
        let bytes = match std::fs::read(&self.file) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Failure::input(format!("{}: {e}", self.file.display()))),
        };
        let own = fingerprint(self.prepared)?.0;
        let same = |h: &Header| match h.fingerprint == own {
            true => Ok(()),
            false => Err(format!("it was left by another run: {}", h.command)),
        };
        Portion::read(&bytes, same, &self.prepared.bound).map(Some).map_err(|m| {
            Failure::arguments(format!("{}: cannot go on from here: {m}", self.file.display()))
                .help("run with the same scene, files, options and program, or without --resume")
        })
    }

    /// Saves the run, when it is time to.
    pub(crate) fn finished(&self, portion: &Portion) {
        let mut last = self.last.lock().unwrap_or_else(|e| e.into_inner());
        if last.elapsed() < self.every {
            return;
        }
        if let Err(failure) = self.write(portion) {
            // A run that cannot be saved goes on all the same.
            self.context.say(format_args!("not saved: {failure}"));
        }
        *last = Instant::now();
    }

    /// Saves the run now.
    pub(crate) fn write(&self, portion: &Portion) -> Result<(), Failure> {
        let mut header = self.header.lock().unwrap_or_else(|e| e.into_inner());
        let header = match &mut *header {
            Some(header) => header,
            none => none.insert(Header::new(self.prepared, self.scene, self.shard, self.context)?),
        };
        if let Some(folder) = self.file.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)
                .map_err(|e| Failure::running(format!("{}: cannot be made: {e}", folder.display())))?;
        }
        Ok(write_atomic(&self.file, |w| portion.write(header, w))?)
    }

    /// Removes the file of a run that is over.
    pub(crate) fn remove(&self) {
        let _ = std::fs::remove_file(&self.file);
    }
}

/// Says what a finished shard holds.
pub(crate) fn say_shard(
    file: &Path,
    portion: &Portion,
    [i, n]: [u32; 2],
    context: &Context,
) -> Result<(), Failure> {
    let counts = &portion.tallies.counts;
    if context.json {
        let document = json!({"shard": [i + 1, n], "replicates": portion.done.len(), "of": portion.replicates,
            "rays": counts.rays, "segments": counts.segments, "lost_rays": counts.lost,
            "seconds": {"trace": portion.seconds}, "file": file.display().to_string()});
        return Ok(print(&format!("{document:#}\n"))?);
    }
    context.say(format_args!(
        "shard {} of {n}: {} rays in {}; `lampyris merge` puts all {n} together",
        i + 1,
        grouped(counts.rays),
        file.display()
    ));
    Ok(())
}

/// `lampyris merge`: the results of all parts of a run.
pub(crate) fn merge(parts: &[PathBuf], folder: &Path, context: &Context) -> Result<crate::cli::Outcome, Failure> {
    let wrong = |path: &Path, m: String| Failure::input(format!("{}: {m}", path.display()));
    let read = |path: &PathBuf| std::fs::read(path).map_err(|e| wrong(path, e.to_string()));
    let [first, others @ ..] = parts else { return Err(Failure::arguments("merge: no parts given")) };
    let header: Header = Portion::header(&read(first)?).map_err(|m| wrong(first, m))?;
    let (scene, loaded) = load::scene_file(&header.scene, context)?;
    let (meshing, tracing) = (header.meshing(), header.tracing());
    let prepared = job::prepare(
        Job {
            scene: &scene,
            loaded: &loaded,
            meshing: &meshing,
            tracing: &tracing,
            recheck: super::trace::RECHECKED,
            aimed: None,
        },
        context,
    )?;
    let own = fingerprint(&prepared)?.0;
    let same = |h: &Header| match h.fingerprint == own {
        true => Ok(()),
        false if h.fingerprint == header.fingerprint => {
            Err(format!("the scene {} or the program has changed since this part was traced", h.scene.display()))
        }
        false => Err(format!("it is part of another run ({}) than {}", h.command, first.display())),
    };
    let mut whole = Portion::read(&read(first)?, same, &prepared.bound).map_err(|m| wrong(first, m))?;
    for path in others {
        let part = Portion::read(&read(path)?, same, &prepared.bound).map_err(|m| wrong(path, m))?;
        whole.merge(&part).map_err(|m| wrong(path, m))?;
    }
    if !whole.is_whole() {
        return Err(Failure::input(missing(&whole, header.shard)).help("merge all parts at once"));
    }
    let mut outcome = prepared.trace(Ways { from: Some(whole), ..Ways::default() }, context);
    let (document, report) = prepared.write(folder, &mut outcome, Vec::new(), context)?;
    super::trace::tell(&document, &report.answer, folder, &outcome.results, context)?;
    Ok(crate::cli::Outcome::Done)
}

/// Which shards are not there.
fn missing(whole: &Portion, shard: Option<[u32; 2]>) -> String {
    let absent = |r: &u32| whole.done.binary_search(r).is_err();
    let count = (0..whole.replicates).filter(absent).count();
    let mut text = format!("{count} of the {} replicates of the run are missing", whole.replicates);
    if let Some([_, n]) = shard {
        let at = |k: u32| (u64::from(whole.replicates) * u64::from(k) / u64::from(n)) as u32;
        let shards: Vec<String> =
            (0..n).filter(|&k| (at(k)..at(k + 1)).any(|r| absent(&r))).map(|k| format!("{}/{n}", k + 1)).collect();
        text += &format!(": those of shard {}", shards.join(", "));
    }
    text
}

/// Traces a shard, or goes on with it, into its file.
pub(crate) fn trace_shard(
    prepared: &Prepared,
    checkpoint: &Checkpoint,
    from: Option<Portion>,
    shard: [u32; 2],
    context: &Context,
) -> Result<(), Failure> {
    let finished = |p: &Portion| checkpoint.finished(p);
    let ways =
        Ways { from, shard: Some(shard), finished: Some(&finished), every: checkpoint.often(), ..Ways::default() };
    let portion = prepared.portion(ways, context);
    checkpoint.write(&portion)?;
    say_shard(&checkpoint.file, &portion, shard, context)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(shard("2/8").unwrap(), [1, 8]);
        assert_eq!(shard("1/1").unwrap(), [0, 1]);
        for wrong in ["0/8", "9/8", "8", "a/b", "-1/2", "1/0", "1/70000"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_shard_goes_to_its_file_or_into_its_folder() {
        assert_eq!(shard_file(Path::new("a.tally"), [1, 4]), Path::new("a.tally"));
        assert_eq!(shard_file(Path::new("out"), [1, 4]), Path::new("out/shard-2-of-4.tally"));
    }
}

//! The file that a run is saved to while it goes on, for `--resume`.

use super::scene_run::PreparedScene;
use super::tally_file::{TallyHeader, fingerprint};
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::formats::write_atomic;
use crate::simulate::Portion;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Name of the file that an interrupted run leaves in its folder.
pub(crate) const CHECKPOINT: &str = "checkpoint.tally";

/// Each thread looks this often, at least, whether it is time to save: a saved run lacks no more than this of each.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// A file that a run is saved to while it goes on.
pub(crate) struct Checkpoint<'a> {
    prepared: &'a PreparedScene<'a>,
    header: Mutex<Option<TallyHeader>>,
    scene: &'a Path,
    shard: Option<[u32; 2]>,
    pub(crate) file: PathBuf,
    every: Duration,
    last: Mutex<Instant>,
    console: &'a Console,
}

impl<'a> Checkpoint<'a> {
    pub(crate) fn new(
        prepared: &'a PreparedScene<'a>,
        scene: &'a Path,
        file: PathBuf,
        shard: Option<[u32; 2]>,
        every_seconds: f64,
        console: &'a Console,
    ) -> Self {
        let every = Duration::try_from_secs_f64(every_seconds).unwrap_or(Duration::MAX);
        let (header, last) = (Mutex::new(None), Mutex::new(Instant::now()));
        Self { prepared, header, scene, shard, file, every, last, console }
    }

    /// How often to look whether it is time to save.
    pub(crate) fn interval(&self) -> Duration {
        self.every.min(LOOK_EVERY)
    }

    /// What an earlier run left behind; `None` when there is nothing.
    pub(crate) fn read(&self) -> Result<Option<Portion>, Failure> {
        let bytes = match std::fs::read(&self.file) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Failure::input(format!("{}: {e}", self.file.display()))),
        };
        let expected = fingerprint(self.prepared)?.0;
        let same = |h: &TallyHeader| {
            if h.fingerprint == expected {
                Ok(())
            } else {
                Err(format!("it was left by another run: {}", h.command))
            }
        };
        Portion::read(&bytes, same, &self.prepared.bound).map(Some).map_err(|m| {
            Failure::arguments(format!("{}: cannot go on from here: {m}", self.file.display()))
                .with_help("run with the same scene, files, options and program, or without --resume")
        })
    }

    /// Saves the run, when it is time to.
    pub(crate) fn save_when_due(&self, portion: &Portion) {
        let mut last = self.last.lock().unwrap_or_else(|e| e.into_inner());
        if last.elapsed() < self.every {
            return;
        }
        if let Err(failure) = self.save(portion) {
            // A run that cannot be saved goes on all the same.
            self.console.say(format_args!("not saved: {failure}"));
        }
        *last = Instant::now();
    }

    /// Saves the run now.
    pub(crate) fn save(&self, portion: &Portion) -> Result<(), Failure> {
        let mut header = self.header.lock().unwrap_or_else(|e| e.into_inner());
        let header = match &mut *header {
            Some(header) => header,
            none => none.insert(TallyHeader::new(self.prepared, self.scene, self.shard, self.console)?),
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

//! The file that a run is saved to while it goes on, for `--resume`.

use super::output_place::{folder_of, make_folder, rescue_folders};
use super::part_sum::PartOrigins;
use super::run_commands::RunCommands;
use super::shards::is_shard_done;
use super::tally_file::TallyHeader;
use super::usage::Usage;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::machine;
use crate::formats::{read_bytes, remove_stale, write_atomic};
use crate::pipeline::{PreparedScene, RayRange, TracingSettings};
use crate::simulate::{PartialRun, shard_replicates};
use crate::text::grouped;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Name of the file that an interrupted run leaves in its folder.
pub(crate) const CHECKPOINT: &str = "checkpoint.tally";

/// Each thread looks this often, at least, whether it is time to save: a saved run lacks no more than this of each.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Where a process saves what it traces of a scene, and what an earlier one left there. A search saves all its runs in one place, each with
/// a [`Checkpoint`] of its own: whichever of them read what was left, all know what they go on from.
pub(crate) struct SavePlace<'a> {
    /// The file of the scene.
    scene: &'a Path,
    pub(crate) file: PathBuf,
    /// The part that is traced, as index from 0 and count; `None` for whole runs.
    shard: Option<[u32; 2]>,
    /// What is searched for with runs of growing length; `None` for a single run.
    search: Option<String>,
    /// Least time between two saves.
    every: Duration,
    /// The header of an earlier process's file, where this one continues it.
    earlier: Mutex<Option<TallyHeader>>,
    pub(crate) console: &'a Console,
}

impl<'a> SavePlace<'a> {
    /// Makes the place of a whole run of the scene file `scene`, which is saved at most every so many seconds.
    pub(crate) fn new(scene: &'a Path, file: PathBuf, every_seconds: f64, console: &'a Console) -> Self {
        // Seconds without end mean never.
        let every = Duration::try_from_secs_f64(every_seconds).unwrap_or(Duration::MAX);
        Self { scene, file, shard: None, search: None, every, earlier: Mutex::default(), console }
    }

    /// Returns the place for a shard, index from 0 and count, of the run.
    pub(crate) fn with_shard(self, shard: [u32; 2]) -> Self {
        Self { shard: Some(shard), ..self }
    }

    /// Returns the place for the runs of a search, which the text distinguishes from others.
    pub(crate) fn with_search(self, search: Option<String>) -> Self {
        Self { search, ..self }
    }

    /// Locks the head of what an earlier process left.
    fn earlier(&self) -> MutexGuard<'_, Option<TallyHeader>> {
        self.earlier.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// The file of one run, with what stands at its head.
pub(crate) struct Checkpoint<'a> {
    pub(crate) prepared: &'a PreparedScene,
    header: TallyHeader,
    pub(crate) place: &'a SavePlace<'a>,
    /// When it was saved last, or made.
    last: Mutex<Instant>,
}

impl<'a> Checkpoint<'a> {
    /// Makes the checkpoint of a run that is about to be traced into the file of `place`. Nothing is written yet, and what dead processes
    /// left half saved there is removed.
    ///
    /// # Errors
    /// When a file of the scene can no longer be read.
    pub(crate) fn new(prepared: &'a PreparedScene, place: &'a SavePlace<'a>) -> Result<Self, Failure> {
        let commands = RunCommands::new(place.search.clone(), place.console);
        // Made before tracing: the files of the scene may be gone when it ends.
        let header = TallyHeader::new(prepared, place.scene, place.shard, commands)?;
        // Here, because a run that is short or done saves nothing, which would remove them too.
        remove_stale(&place.file);
        Ok(Self { prepared, header, place, last: Mutex::new(Instant::now()) })
    }

    /// Returns how often to look whether it is time to save: at least every [`LOOK_EVERY`].
    pub(crate) fn interval(&self) -> Duration {
        // Looking is cheap; to look seldom would save late.
        self.place.every.min(LOOK_EVERY)
    }

    /// Reads what an earlier run of the same scene, files, options and program left behind, and notes what it took for later saves; `None`
    /// when there is no file.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged or is of another run.
    pub(crate) fn read(&self) -> Result<Option<PartialRun>, Failure> {
        let file = &self.place.file;
        let bytes = match read_bytes(file) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Failure::input(format!("{}: {e}", file.display()))),
        };
        // Of the scene as it is now: a run of a changed scene cannot be continued.
        let expected = self.prepared.fingerprint()?.0;
        let same = |h: &TallyHeader| {
            if h.fingerprint == expected {
                *self.place.earlier() = Some(h.clone());
                Ok(())
            } else if let Some(other) = h.other_program() {
                Err(format!("it was traced {other}"))
            } else {
                Err(format!("it was left by another run: {}", h.commands.command))
            }
        };
        let refuse = |m: String| {
            Failure::arguments(format!("{}: cannot go on from here: {m}", file.display()))
                .with_help("run with the same scene, files, options and program, remove this file, or run into another place with -o")
        };
        let saved = PartialRun::read(&bytes, same, &self.prepared.bound).map_err(|e| refuse(e.to_string()))?;
        // The fingerprint of a run that grows leaves its length open: a longer or shorter one would add up to no run.
        let [there, asked] = [saved.replicates, self.prepared.replicate_range().end];
        if there != asked {
            return Err(refuse(format!("it is of a run of {there} replicates, and this one has {asked}")));
        }
        Ok(Some(saved))
    }

    /// Refuses to add a shard (index from 0, count) of the replicates `all` to what is saved of the run, where that is another part of it.
    ///
    /// # Errors
    /// With the part that is saved there, when it has nothing of the shard.
    pub(crate) fn refuse_other_part(
        &self,
        saved: &PartialRun,
        all: &Range<u32>,
        shard: [u32; 2],
    ) -> Result<(), Failure> {
        let is_done = |r: u32| saved.done.binary_search(&r).is_ok();
        if saved.done.is_empty() || shard_replicates(all.clone(), shard).any(is_done) {
            return Ok(());
        }
        let other = self.place.earlier().as_ref().and_then(|header| header.shard).filter(|[_, count]| *count > 1);
        let part = other.map_or_else(
            || "other rays of this run".to_owned(),
            |[index, count]| {
                let is_whole = is_shard_done(saved, all.clone(), [index, count]);
                let state = if is_whole { "finished" } else { "interrupted" };
                format!("shard {}/{count} of this run, {state}", index + 1)
            },
        );
        let failure = Failure::arguments(format!("{}: it holds {part}", self.place.file.display()));
        Err(failure.with_help("give another place with -o, or remove the file"))
    }

    /// Returns the commands that traced the run: those of the continued file, as far as it is the same run.
    pub(crate) fn commands(&self) -> RunCommands {
        let earlier = self.place.earlier();
        earlier.as_ref().map_or_else(|| self.header.commands.clone(), |earlier| self.header.commands_after(earlier))
    }

    /// Reads what an interrupted run left behind, and says how much that is.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub(crate) fn read_and_say(&self) -> Result<Option<PartialRun>, Failure> {
        let saved = self.read()?;
        let folder = folder_of(&self.place.file);
        self.place.console.say(match &saved {
            Some(p) => format!("going on from {} of {} replicates", p.done.len(), p.replicates),
            None => format!("{} holds no interrupted run: starting from the beginning", folder.display()),
        });
        Ok(saved)
    }

    /// Saves the run if it is time to; a failure is said and the run goes on.
    pub(crate) fn save_when_due(&self, partial: &PartialRun) {
        let mut last = self.last.lock().unwrap_or_else(|e| e.into_inner());
        if last.elapsed() < self.place.every {
            return;
        }
        if let Err(failure) = self.save(partial) {
            // A run that cannot be saved goes on all the same.
            self.place.console.say(format_args!("not saved: {failure}"));
        }
        // After saving, for saving may take long and must not follow itself.
        *last = Instant::now();
    }

    /// Saves the run now, in place of what was saved before; makes the folder.
    pub(crate) fn save(&self, partial: &PartialRun) -> Result<(), Failure> {
        let file = &self.place.file;
        make_folder(&folder_of(file))?;
        let header = self.header_now();
        Ok(write_atomic(file, |w| partial.write(&header, w))?)
    }

    /// Saves the sum of other parts, with what made these.
    pub(crate) fn save_sum(&self, sum: &PartialRun, origins: PartOrigins) -> Result<(), Failure> {
        let file = &self.place.file;
        make_folder(&folder_of(file))?;
        let commands = self.header.commands.clone().with_parts(origins.traced_by);
        let header = self.header.with_usage(origins.usage).with_commands(commands);
        Ok(write_atomic(file, |w| sum.write(&header, w))?)
    }

    /// Returns the header with what the run took so far, earlier processes included, and the commands that traced it.
    fn header_now(&self) -> TallyHeader {
        let wall_seconds = self.place.console.started.elapsed().as_secs_f64();
        let of_process = Usage::of_process(wall_seconds, self.prepared.threads);
        // A run that goes on counts what it took before.
        let usage = match self.place.earlier().as_ref() {
            Some(earlier) => of_process.continue_from(&earlier.usage),
            None => of_process,
        };
        self.header.with_usage(usage).with_commands(self.commands())
    }

    /// Saves the run in its own file or, where that cannot be written, in a new one wherever one can be; returns the file.
    ///
    /// # Errors
    /// When none of the places can be written.
    pub(crate) fn save_anywhere(&self, partial: &PartialRun) -> Result<PathBuf, Failure> {
        let reason = match self.save(partial) {
            Ok(()) => return Ok(self.place.file.clone()),
            Err(failure) => failure,
        };
        let name = format!("lampyris-rescued-{}.tally", machine::process_name());
        let mut places = rescue_folders().into_iter().map(|folder| folder.join(&name));
        let header = self.header_now();
        places.find(|file| write_atomic(file, |w| partial.write(&header, w)).is_ok()).ok_or(reason)
    }

    /// Saves a run that stopped before its end, interrupted or because something `failed`, and returns the failure that says so, and that
    /// `again` goes on from there.
    pub(crate) fn save_stopped(&self, partial: &PartialRun, failed: Option<&str>, again: &str) -> Failure {
        // A failure is a sentence of its own, with its own colons.
        let because = failed.map_or_else(|| "interrupted: ".to_owned(), |failure| format!("{failure}. "));
        let share = format!("{} of {} replicates", partial.done.len(), partial.replicates);
        match self.save_anywhere(partial) {
            Ok(file) if file == self.place.file => {
                Failure::running(format!("{because}{share} are saved in {}", file.display()))
                    .with_help(format!("{again} goes on from there"))
            }
            Ok(file) => Failure::running(format!("{because}{share} are saved in {}", file.display()))
                .with_help(format!("copy it to {}, and {again} goes on from there", self.place.file.display())),
            Err(failure) => Failure::running(format!("{because}{share} could not be saved: {failure}")),
        }
    }

    /// Removes the file of a run that is over. A failure is passed over: a file left behind only makes the next run there ask for
    /// `--resume`.
    pub(crate) fn remove(&self) {
        let _ = std::fs::remove_file(&self.place.file);
    }
}

/// Returns the settings of a run that goes on from `file`: those that are `asked` for, with the saved number of rays or range where none is
/// given; unchanged where no run is saved there.
///
/// # Errors
/// When other rays are asked for than those of the saved run.
pub(crate) fn continued_settings(file: &Path, asked: &TracingSettings) -> Result<TracingSettings, Failure> {
    // What cannot be read is refused when all of it is, with its reason.
    let Some(header) = saved_header(file) else { return Ok(asked.clone()) };
    let saved = header.ray_range();
    match asked.ray_range {
        None => Ok(TracingSettings { ray_range: header.tracing().ray_range, ..asked.clone() }),
        Some(range) if range == saved => Ok(asked.clone()),
        Some(range) => {
            let [saved_rays, asked_rays] = [saved, range].map(rays_text);
            let message = format!(
                "{}: the run that is saved there has {saved_rays}, and --rays asks for {asked_rays}",
                file.display()
            );
            let help = format!(
                "give --rays {} or leave it out to go on with that run; another run goes into another place with -o",
                saved.first.map_or_else(|| saved.end.to_string(), |first| format!("{first}..{}", saved.end))
            );
            Err(Failure::arguments(message).with_help(help))
        }
    }
}

/// Returns rays in words: how many, or from which to which.
fn rays_text(range: RayRange) -> String {
    match range.first {
        Some(first) => format!("the rays {}..{}", first, range.end),
        None => format!("{} rays", grouped(range.end)),
    }
}

/// Reads the head of what is saved in a file; `None` where nothing that can be read is.
pub(crate) fn saved_header(file: &Path) -> Option<TallyHeader> {
    PartialRun::header(&read_bytes(file).ok()?).ok()
}

/// Refuses to write over what an interrupted run left in `file`.
///
/// # Errors
/// When the file is there.
pub(crate) fn refuse_overwriting(file: &Path) -> Result<(), Failure> {
    if !file.exists() {
        return Ok(());
    }
    let whose = saved_header(file).map_or(String::new(), |h| format!(" ({})", h.commands.command));
    let failure = Failure::arguments(format!("{}: an interrupted run{whose} is saved there", file.display()));
    Err(failure.with_help("--resume goes on with it; else give another place with -o, or remove the file"))
}

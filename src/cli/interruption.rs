//! What SIGINT, SIGTERM and SIGHUP do: a run that can be saved is stopped and saved; anything else says so and ends at once, without
//! unfinished files or locks left behind. SIGXFSZ, of a file beyond its limit of size, does nothing: that write fails, and is answered as
//! on a full disk.

use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Time for a line on stderr: a terminal takes a millisecond.
#[cfg(unix)]
const LONGEST_WRITE: std::time::Duration = std::time::Duration::from_millis(200);

/// Runs that are being traced and can be saved.
static SAVEABLE_RUNS: AtomicUsize = AtomicUsize::new(0);
/// Whether a signal asked such a run to stop.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// A run that stops by itself and is saved when a signal comes, for as long as this value lives.
pub(crate) struct SaveableRun(());

impl SaveableRun {
    /// Counts a run that can be saved until this value is dropped: meanwhile the first signal asks it to stop and does not end the command.
    pub(crate) fn begin() -> Self {
        SAVEABLE_RUNS.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for SaveableRun {
    fn drop(&mut self) {
        SAVEABLE_RUNS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Files that are removed when a signal ends the command.
static LOCKS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The lock file of a place that is written, removed too where a signal ends the command while this value lives.
#[derive(Debug)]
pub(crate) struct WatchedLock(PathBuf);

impl WatchedLock {
    /// Has the file removed when a signal ends the command.
    pub(crate) fn new(file: PathBuf) -> Self {
        LOCKS.lock().unwrap_or_else(|e| e.into_inner()).push(file.clone());
        Self(file)
    }

    /// Returns the file.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for WatchedLock {
    fn drop(&mut self) {
        LOCKS.lock().unwrap_or_else(|e| e.into_inner()).retain(|file| *file != self.0);
    }
}

/// Whether a signal asked the run to stop.
pub(crate) fn is_requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Listens to SIGINT, SIGTERM and SIGHUP from now on, in a thread of its own; where the system refuses, they end the command as usual.
#[cfg(unix)]
pub(crate) fn watch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    // It would end the command without a word. The flag is for having a handler alone.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
    // Without a listener the signals end the command at once, as they do anyway.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else { return };
    let listen = move || {
        for signal in &mut signals {
            // The second signal ends the command at once, whatever is being saved.
            let is_first = !REQUESTED.swap(true, Ordering::SeqCst);
            if is_first && SAVEABLE_RUNS.load(Ordering::SeqCst) > 0 {
                say("\nstopping: what is being traced is finished and saved; once more stops at once\n");
                continue;
            }
            // Who writes results owns the place where they go.
            let writes = !LOCKS.lock().unwrap_or_else(|e| e.into_inner()).is_empty();
            say(if writes { "\ninterrupted: what was not saved is lost\n" } else { "\ninterrupted\n" });
            // Files that were begun are named by the process: they would stay for ever.
            crate::formats::remove_unfinished_files();
            for lock in LOCKS.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
                let _ = std::fs::remove_file(lock);
            }
            // As the signal would have done: the shell sees a process that was stopped.
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    };
    let _ = std::thread::Builder::new().name("signals".into()).spawn(listen);
}

/// Writes to stderr, and waits no longer than [`LONGEST_WRITE`]: a reader that has stopped must not keep the command alive.
#[cfg(unix)]
fn say(message: &'static str) {
    let (done, written) = std::sync::mpsc::channel();
    let write = move || {
        let _ = std::io::Write::write_all(&mut std::io::stderr(), message.as_bytes());
        let _ = done.send(());
    };
    if std::thread::Builder::new().spawn(write).is_ok() {
        let _ = written.recv_timeout(LONGEST_WRITE);
    }
}

#[cfg(not(unix))]
pub(crate) fn watch() {}

/// Whether the command was started with the signal ignored, as by `nohup`; known on Linux alone.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return false };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let bits = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    bits.is_some_and(|bits| bits >> (signal - 1) & 1 == 1)
}

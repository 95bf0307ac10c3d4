//! Which of the processes that start at once makes an entry of the cache: one, while the others wait for it.
//!
//! The lock is one of the operating system on a file beside the entry, and goes with the process that holds it however that ends. Known
//! weakness: on file systems without locks each process makes the entry for itself.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two looks for the entry.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Time after which a process that makes an entry is taken to hang, and those that wait make their own.
const LONGEST_WAIT: Duration = Duration::from_secs(1800);

/// The right to make an entry, held until it is dropped; without a lock where nothing can be locked.
#[derive(Debug, Default)]
pub(super) struct Turn(Option<(PathBuf, File)>);

impl Turn {
    /// Waits until no other process has the lock file of this name, in a folder that is made when missing, and takes it; after
    /// [`LONGEST_WAIT`], and where nothing can be locked, returns a turn without a lock.
    pub(super) fn wait(lock: &Path) -> Self {
        let made = lock.parent().is_none_or(|folder| fs::create_dir_all(folder).is_ok());
        // Not cut: what it holds means nothing.
        let file = File::options().write(true).create(true).truncate(false).open(lock);
        let Some(file) = file.ok().filter(|_| made) else { return Self::default() };
        let start = Instant::now();
        loop {
            match file.try_lock() {
                Ok(()) => return Self(Some((lock.to_path_buf(), file))),
                Err(TryLockError::WouldBlock) if start.elapsed() < LONGEST_WAIT => sleep(LOOK_EVERY),
                Err(_) => return Self::default(),
            }
        }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if let Some((lock, _)) = &self.0 {
            // Those that wait have it open, and look for the entry first.
            let _ = fs::remove_file(lock);
        }
    }
}

//! Files that hold for a while what memory should not: in the folder for temporary files, gone with their owner.

use super::atomic::{Unfinished, remove_stale, unfinished};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::PathBuf;

/// How the names of such files begin; what follows names the process that writes them.
const NAME: &str = "lampyris-rays";

/// A file that no one needs by name; removed when it is dropped or, if its process was killed, by the next process that makes one.
#[derive(Debug)]
pub(super) struct ScratchFile {
    pub(super) file: File,
    path: PathBuf,
    _registered: Unfinished,
}

impl ScratchFile {
    /// Makes an empty file for writing and reading in the folder for temporary files, which `TMPDIR` may name.
    pub(super) fn create() -> io::Result<Self> {
        let name = std::env::temp_dir().join(NAME);
        remove_stale(&name);
        let path = unfinished(&name);
        let _registered = Unfinished::register(&path);
        // The folder is everybody's: a file or a link that somebody else put there is not written.
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path)?;
        // Where an open file needs no name, nothing stays of a process that is killed.
        #[cfg(unix)]
        fs::remove_file(&path)?;
        Ok(Self { file, path, _registered })
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        // Nothing more can be done when the removal fails.
        let _ = fs::remove_file(&self.path);
    }
}

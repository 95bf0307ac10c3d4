//! Where results go: tried before any work is done, and owned by one process at a time.

use crate::cli::failure::Failure;
use crate::cli::interruption::WatchedLock;
use crate::cli::machine;
use crate::formats::{self, file_name, try_write};
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Name of the lock of a folder of results.
const FOLDER_LOCK: &str = ".lampyris.lock";
/// Longest content of a lock file that is read: the number of a process and the name of its machine.
const LOCK_BYTES: u64 = 300;
/// What a report takes at least, bytes: plotly.js and a few pictures.
pub(crate) const REPORT_BYTES: u64 = 5_000_000;
/// What the document of a study or check takes at least, bytes: the smallest of a study is about so large.
const DOCUMENT_BYTES: u64 = 4_000;

/// A folder, or a file, that no other lampyris writes while this value lives.
///
/// The lock is one of the operating system on a file beside the results, which also names the process: it goes with the process
/// however that ends, so that no lock outlives its owner. Known weakness: network file systems without locks.
#[derive(Debug)]
pub(crate) struct OutputPlace {
    lock: WatchedLock,
    // Held for its lock alone.
    _file: File,
}

impl OutputPlace {
    /// Claims a folder for results, made when missing, in which files can be made.
    ///
    /// # Errors
    /// When the folder cannot be made or written, or another process writes into it.
    pub(crate) fn folder(folder: &Path) -> Result<Self, Failure> {
        Self::claim(folder, folder, folder.join(FOLDER_LOCK))
    }

    /// Claims a single file, whose folder is made when missing; the file is not touched.
    ///
    /// # Errors
    /// As [`OutputPlace::folder`].
    pub(crate) fn file(path: &Path) -> Result<Self, Failure> {
        let name = file_name(path);
        Self::claim(path, &folder_of(path), path.with_file_name(format!(".{name}.lock")))
    }

    /// Takes the lock file of a place in a folder, which is made when missing, or says who has it. Where the file system has no locks, it
    /// takes it without one.
    fn claim(place: &Path, folder: &Path, lock: PathBuf) -> Result<Self, Failure> {
        make_folder(folder)?;
        let unwritable = |e: std::io::Error| unwritable(folder, &e);
        // The owner before may remove its lock file between opening and locking: then once more.
        loop {
            let mut file = File::options()
                .read(true)
                .write(true)
                .create(true)
                // Not cut: until the lock is held its content names another owner.
                .truncate(false)
                .open(&lock)
                .map_err(unwritable)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(owned_by_another(place, &mut file)),
                // A file system without locks: nothing can be known of others.
                Err(TryLockError::Error(_)) => {}
            }
            if !is_file_at(&file, &lock) {
                continue;
            }
            let written = file.set_len(0).and_then(|()| write!(file, "{} {}", std::process::id(), machine::name()));
            written.map_err(unwritable)?;
            return Ok(Self { lock: WatchedLock::new(lock), _file: file });
        }
    }
}

impl Drop for OutputPlace {
    fn drop(&mut self) {
        // Where it cannot be removed it is stale, which the next owner notices.
        let _ = fs::remove_file(self.lock.path());
    }
}

/// Returns the failure that names the process that stands in the lock file.
fn owned_by_another(place: &Path, file: &mut File) -> Failure {
    let mut owner = String::new();
    let read = file.rewind().and_then(|()| file.take(LOCK_BYTES).read_to_string(&mut owner));
    // On a shared folder the number of a process says nothing without its machine.
    let process = match (read, owner.trim().split_once(' ')) {
        (Ok(_), Some((id, machine))) => format!(" (process {id} on {machine})"),
        _ => String::new(),
    };
    Failure::running(format!("{}: another lampyris{process} is writing there", place.display()))
        .with_help("wait until it has ended, or give another place with -o")
}

/// Whether the open file is still the one of that name, and not one removed or replaced meanwhile.
#[cfg(unix)]
fn is_file_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: fs::Metadata| (m.dev(), m.ino());
    // Device and inode: a file of the same name may be another one.
    match (file.metadata(), fs::metadata(path)) {
        (Ok(opened), Ok(named)) => identity(opened) == identity(named),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_file_at(_: &File, _: &Path) -> bool {
    true
}

/// Makes a folder and those above it; one that is there is left as it is.
///
/// # Errors
/// When that fails.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder).map_err(|e| {
        let in_the_way = nearest_there(folder).filter(|there| !there.is_dir());
        let why = in_the_way.map_or_else(|| reason(&e), |there| obstacle(folder, there));
        unmakeable(folder, &why)
    })
}

/// Returns what is there already, be it a link to nothing, of a folder and those above it: itself, or else the nearest; `None` where that
/// is the working folder.
fn nearest_there(folder: &Path) -> Option<&Path> {
    folder.ancestors().find(|path| path.symlink_metadata().is_ok())
}

/// Returns why a folder cannot be made where `there`, which is itself or a name above it, is no folder.
fn obstacle(folder: &Path, there: &Path) -> String {
    // Only a link that leads nowhere is there and does not exist.
    let what = if there.exists() { "a file" } else { "a link to nothing" };
    if there == folder {
        return format!("it is {what}, and a folder is needed");
    }
    format!("{} is {what}", there.display())
}

/// Returns the failure of a folder that cannot be made.
fn unmakeable(folder: &Path, why: &str) -> Failure {
    Failure::running(format!("{}: cannot be made: {why}", folder.display())).with_help("give another folder")
}

/// Returns the failure of a folder that is there and cannot be written.
fn unwritable(folder: &Path, error: &std::io::Error) -> Failure {
    Failure::running(format!("{}: cannot be written: {}", folder.display(), reason(error)))
        .with_help("nothing was traced; give another folder with -o")
}

/// Tries, before any work, whether [`OutputPlace::folder`] could claim a folder. One that is missing is not made: the work may yet be
/// refused.
///
/// # Errors
/// As [`OutputPlace::folder`].
pub(crate) fn try_folder(folder: &Path) -> Result<(), Failure> {
    if folder.is_dir() { OutputPlace::folder(folder).map(drop) } else { try_making(folder) }
}

/// Tries, before any work, whether [`OutputPlace::file`] could claim a file; makes nothing.
///
/// # Errors
/// As [`OutputPlace::file`].
pub(crate) fn try_claim(file: &Path) -> Result<(), Failure> {
    let folder = folder_of(file);
    // The folder itself is not claimed, for other parts are written beside this one.
    if folder.is_dir() { OutputPlace::file(file).map(drop) } else { try_making(&folder) }
}

/// Tries, before any work, whether a file can be written, as [`try_file`] does; makes nothing.
///
/// # Errors
/// When it cannot.
pub(crate) fn try_new_file(file: &Path) -> Result<(), Failure> {
    let folder = folder_of(file);
    if folder.is_dir() { try_file(file) } else { try_making(&folder) }
}

/// Tries whether a folder that is missing can be made, by a file in the one that it would be made in.
fn try_making(folder: &Path) -> Result<(), Failure> {
    let there = nearest_there(folder).unwrap_or(Path::new("."));
    if !there.is_dir() {
        return Err(unmakeable(folder, &obstacle(folder, there)));
    }
    try_write(&there.join(FOLDER_LOCK)).map_err(|e| match e.kind() {
        formats::ErrorKind::Write(error) => unmakeable(folder, &reason(error)),
        _ => e.into(),
    })
}

/// Returns why a place cannot be written, in words where the system has but a number for it.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::PermissionDenied => "there is no permission to write there".into(),
        ErrorKind::ReadOnlyFilesystem => "it is on a file system that is read-only".into(),
        ErrorKind::StorageFull => "no space is left there".into(),
        _ => error.to_string(),
    }
}

/// Tries, before any work, whether a file can be written; makes its folder. What is there stays as it is.
///
/// # Errors
/// When it cannot.
pub(crate) fn try_file(file: &Path) -> Result<(), Failure> {
    make_folder(&folder_of(file))?;
    if file.is_dir() {
        let failure = Failure::running(format!("{}: cannot be written: it is a folder", file.display()));
        return Err(failure.with_help("give the name of a file, in that folder or elsewhere"));
    }
    // Pipes and devices are opened when they are written: their readers may come late.
    if file.exists() && !file.is_file() {
        return Ok(());
    }
    Ok(try_write(file)?)
}

/// Returns the folder that a file is in; `.` for a bare name.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_path_buf()
}

/// Refuses a place with less free space than needed; one with unknown space is taken.
///
/// # Errors
/// When the file system says that it has less.
pub(crate) fn require_space(folder: &Path, needed_bytes: u64) -> Result<(), Failure> {
    match free_bytes(folder) {
        Some(free) if free < needed_bytes => {
            let [needed, free] = [needed_bytes, free].map(crate::report::bytes);
            let message = format!("{}: {free} are free, and the results need {needed} at least", folder.display());
            Err(Failure::running(message)
                .with_help("nothing was traced; make room, or give another folder with -o"))
        }
        _ => Ok(()),
    }
}

/// Refuses a folder without room for a document of rows and, where it is wanted, a report.
///
/// # Errors
/// As [`require_space`].
pub(crate) fn require_report_space(folder: &Path, with_report: bool) -> Result<(), Failure> {
    require_space(folder, DOCUMENT_BYTES + if with_report { REPORT_BYTES } else { 0 })
}

/// Returns the bytes that are left on the folder's file system; `None` where it does not report them.
#[cfg(unix)]
fn free_bytes(folder: &Path) -> Option<u64> {
    let system = rustix::fs::statvfs(folder).ok()?;
    // File systems that do not count their blocks say 0 of 0.
    (system.f_blocks > 0).then(|| system.f_bavail.saturating_mul(system.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}

/// Returns the folders for what could not be written where it should, best first: the working folder, that of temporary files, and the
/// home.
pub(crate) fn rescue_folders() -> Vec<PathBuf> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    [std::env::current_dir().ok(), Some(std::env::temp_dir()), home].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_owner_and_a_stale_lock_is_taken_over() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("a/b");
        let first = OutputPlace::folder(&folder).unwrap();
        let refused = OutputPlace::folder(&folder).unwrap_err().to_string();
        let owner = format!("process {} on {}", std::process::id(), machine::name());
        assert!(refused.contains(&owner), "{refused}");
        // Files in the folder are claimed apart: shards write beside one another.
        let shard = OutputPlace::file(&folder.join("1.tally")).unwrap();
        let refused = OutputPlace::file(&folder.join("1.tally")).unwrap_err().to_string();
        assert!(refused.contains("1.tally: another lampyris"), "{refused}");
        drop(OutputPlace::file(&folder.join("2.tally")).unwrap());
        drop((first, shard));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        // Left by a process that was killed: its lock is free.
        fs::write(folder.join(FOLDER_LOCK), "4294967295").unwrap();
        drop(OutputPlace::folder(&folder).unwrap());
    }

    #[test]
    fn a_folder_is_tried_without_being_made() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("a/b");
        try_folder(&folder).unwrap();
        try_claim(&folder.join("1.tally")).unwrap();
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0);
        let owned = OutputPlace::folder(&folder).unwrap();
        assert!(try_folder(&folder).unwrap_err().to_string().contains("another lampyris"));
        // Parts stand beside what others write.
        try_claim(&folder.join("1.tally")).unwrap();
        drop(owned);
        try_folder(&folder).unwrap();
        let file = parent.path().join("file");
        fs::write(&file, "").unwrap();
        for place in [file.clone(), file.join("out")] {
            let [tried, made] = [try_folder(&place), make_folder(&place)].map(|done| done.unwrap_err().to_string());
            assert!(tried == made && tried.contains("a file"), "{tried}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_link_to_nothing_is_named() {
        let parent = tempfile::tempdir().unwrap();
        let link = parent.path().join("link");
        std::os::unix::fs::symlink(parent.path().join("nothing"), &link).unwrap();
        for (place, why) in
            [(link.clone(), "it is a link to nothing"), (link.join("out"), "link is a link to nothing")]
        {
            let [tried, made] = [try_folder(&place), make_folder(&place)].map(|done| done.unwrap_err().to_string());
            assert!(tried == made && tried.contains(why), "{tried}");
        }
    }

    #[test]
    fn space_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        assert!(require_space(folder.path(), 1).is_ok());
        #[cfg(unix)]
        assert!(require_space(folder.path(), u64::MAX).is_err());
    }
}

//! Files that are whole or not there, and names that are safe in a path.

use super::file_names::file_name;
use super::writer::Writer;
use super::{Error, ErrorKind};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Tells files that one process writes at a time apart.
static SERIAL: AtomicU32 = AtomicU32::new(0);

/// Files that this process has begun and not finished.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file beside its final name and renames it when `write` has succeeded, so that the name never holds half a file. An older
/// file or link of that name is replaced, with its permissions kept, and parts that dead processes left of it are removed. A pipe or
/// device, or a link to one, is written as it is.
///
/// # Errors
/// When the folder cannot be written or `write` fails; the unfinished file is removed and an older file of that name stays.
pub fn write_atomic(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    if is_stream(path) {
        return write_stream(path, write).map_err(|e| Error::new(path, ErrorKind::Write(e)));
    }
    let beside = unfinished(path);
    // Before its own file is made: a run that was killed must not leave a part for ever.
    remove_stale(path);
    let attempt = || -> io::Result<()> {
        // Known before it exists: an interruption between the two finds no file, which is no harm.
        let _registered = Unfinished::register(&beside);
        let mut out = BufWriter::with_capacity(1 << 18, File::create(&beside)?);
        write(&mut out)?;
        // Dropping the buffer would hide that its last bytes found no place on the disk.
        out.into_inner().map_err(|e| e.into_error())?;
        // What its owner alone may read stays so; where the system refuses, the file is as readable as any new one.
        if let Ok(older) = fs::metadata(path) {
            let _ = fs::set_permissions(&beside, older.permissions());
        }
        // On one file system a rename replaces the old file at once: a reader sees either.
        fs::rename(&beside, path)
    };
    attempt().map_err(|e| {
        // Nothing more can be done when even the removal fails.
        let _ = fs::remove_file(&beside);
        Error::new(path, ErrorKind::Write(e))
    })
}

/// Tries whether [`write_atomic`] could write a file: makes an empty one beside it, under the name of an unfinished one, and removes it.
///
/// # Errors
/// When the folder cannot be written or no file can have such a name.
pub fn try_write(path: &Path) -> Result<(), Error> {
    let beside = unfinished(path);
    let attempt = || -> io::Result<()> {
        let _registered = Unfinished::register(&beside);
        File::create(&beside)?;
        fs::remove_file(&beside)
    };
    attempt().map_err(|e| Error::new(path, ErrorKind::Write(e)))
}

/// Whether something is there, by its links, that is neither a file nor a folder: a rename would put a file in the place of a device, and
/// whoever reads a pipe would wait for ever.
fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// Writes into what [`is_stream`]; a pipe waits for its reader.
fn write_stream(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 18, File::options().write(true).open(path)?);
    write(&mut out)?;
    out.into_inner().map_err(|e| e.into_error())?;
    Ok(())
}

/// A file that is removed when the process is stopped while it is being written.
#[derive(Debug)]
pub(super) struct Unfinished(PathBuf);

impl Unfinished {
    /// Lists a path for [`remove_unfinished_files`] until the value is dropped, which does not remove the file.
    pub(super) fn register(path: &Path) -> Self {
        // A thread that failed while it held the lock left the list whole.
        UNFINISHED.lock().unwrap_or_else(|e| e.into_inner()).push(path.to_path_buf());
        Self(path.to_path_buf())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        UNFINISHED.lock().unwrap_or_else(|e| e.into_inner()).retain(|path| *path != self.0);
    }
}

/// Removes the files that this process has begun to write and not finished; for a process that is about to end. Failures are ignored.
pub fn remove_unfinished_files() {
    for path in UNFINISHED.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
        let _ = fs::remove_file(path);
    }
}

/// What the names of all unfinished files of a file begin with: its own name, or of a long one a part that leaves room for what follows.
fn unfinished_prefix(path: &Path) -> String {
    let name = file_name(path);
    if name.len() <= LONGEST_WHOLE {
        return format!(".{name}.");
    }
    format!(".{}.", file_stem(&name))
}

/// A name in the same folder (renaming across devices is a copy) that no other machine, process or thread uses.
pub(super) fn unfinished(path: &Path) -> PathBuf {
    // Threads of one process may write the same name: each takes a number of its own.
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!("{}{}-{serial}.part", unfinished_prefix(path), Writer::this()))
}

/// Removes the unfinished files of this path that dead processes have left, as [`write_atomic`] does. Where the system does not report
/// whether a process lives, as of another machine, a file that was not written to for a day counts as left. Failures are ignored.
pub fn remove_stale(path: &Path) {
    static LAST: Mutex<Option<PartListing>> = Mutex::new(None);
    let name = unfinished_prefix(path);
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut last = LAST.lock().unwrap_or_else(|e| e.into_inner());
    for file in PartListing::current(&mut last, folder).parts.iter().filter(|file| file.starts_with(&name)) {
        let Some(writer) = Writer::parse(&file[name.len()..]) else { continue };
        let file = folder.join(file);
        let written = fs::metadata(&file).and_then(|m| m.modified());
        if writer.is_gone(written.ok().and_then(|t| t.elapsed().ok())) {
            // Another process may have been quicker, or this one a moment ago.
            let _ = fs::remove_file(file);
        }
    }
}

/// How long a listing of a folder is believed: runs of a thousand receivers write thousands of files in a second or two, and reading the
/// folder anew for each of them took nearly all of their time.
const LISTING_AGE: Duration = Duration::from_secs(1);

/// The unfinished files of a folder, as they were a moment ago.
struct PartListing {
    folder: PathBuf,
    read: Instant,
    parts: Vec<String>,
}

impl PartListing {
    /// Returns the last listing if it is of this folder and young enough, or else makes a new one of it.
    fn current<'a>(last: &'a mut Option<Self>, folder: &Path) -> &'a Self {
        let kept = last.take().filter(|l| l.folder == folder && l.read.elapsed() < LISTING_AGE);
        last.insert(kept.unwrap_or_else(|| {
            let entries = fs::read_dir(folder).into_iter().flatten().flatten();
            let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
            let parts = names.filter(|name| name.ends_with(".part")).collect();
            Self { folder: folder.to_path_buf(), read: Instant::now(), parts }
        }))
    }
}

/// Longest file name, bytes, that stands whole in those of its unfinished files: some thirty bytes say who writes it, and file systems take
/// 255.
const LONGEST_WHOLE: usize = 200;

/// Longest stem of a file name, bytes: file systems take 255, of which extensions and the names of unfinished files need some.
const LONGEST_STEM: usize = 120;

/// Turns a name into one that is safe in a path: what is no letter, digit, `-` or `_` becomes `_`. One of more than 120 bytes is cut,
/// and ends in a hash of the whole, so that long names that begin alike stay apart. An empty one becomes `unnamed`.
///
/// ```
/// assert_eq!(lampyris::formats::file_stem("far field"), "far_field");
/// ```
pub fn file_stem(name: &str) -> String {
    let mut safe: String =
        // Letters of any script stay: only what file systems or shells read as more than a letter goes.
        name.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect();
    if safe.len() > LONGEST_STEM {
        // FNV-1a (Fowler, Noll, Vo), 64 bits: the same on every machine, so that names stay what they were.
        let hash =
            name.bytes().fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
        // The hash with its dash takes 17 bytes.
        let kept = safe.floor_char_boundary(LONGEST_STEM - 17);
        safe.truncate(kept);
        safe += &format!("-{hash:016x}");
    }
    if safe.is_empty() { "unnamed".into() } else { safe }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        write_atomic(&path, |w| w.write_all(b"whole")).unwrap();
        let error = write_atomic(&path, |w| {
            w.write_all(b"ha")?;
            Err(io::Error::other("disk gone"))
        });
        assert!(error.unwrap_err().to_string().contains("disk gone"));
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// No process has the largest number a process can have, so that both leftovers of this machine are of none that runs.
    #[test]
    #[cfg(target_os = "linux")]
    fn what_a_killed_run_left_is_removed_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let this = Writer::this().to_string();
        let dead = this.replace(&format!(".{}", std::process::id()), ".4294967295");
        // No write of the tests beside this one is ever of that number.
        let own = format!(".a.csv.{this}-999999999.part");
        let elsewhere = ".a.csv.00000000.4294967295-0.part";
        let other = format!(".b.csv.{dead}-0.part");
        for name in
            [&format!(".a.csv.{dead}-0.part"), &format!(".a.csv.{dead}.point.part"), &other, &own, elsewhere]
        {
            fs::write(at(name), b"ha").unwrap();
        }
        write_atomic(&at("a.csv"), |w| w.write_all(b"whole")).unwrap();
        let mut left: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        left.sort();
        let mut kept = [own.as_str(), elsewhere, other.as_str(), "a.csv"];
        kept.sort();
        assert_eq!(left, kept);
    }

    #[test]
    fn a_folder_is_not_read_for_each_file_that_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let mut last = None;
        let mut listed = |name: &str| {
            fs::write(folder.path().join(name), b"").unwrap();
            PartListing::current(&mut last, folder.path()).parts.clone()
        };
        assert_eq!(listed(".a.part"), [".a.part"]);
        assert_eq!(listed(".b.part"), [".a.part"]);
        last.as_mut().unwrap().read -= LISTING_AGE;
        let mut anew = PartListing::current(&mut last, folder.path()).parts.clone();
        anew.sort();
        assert_eq!(anew, [".a.part", ".b.part"]);
        assert!(PartListing::current(&mut last, &folder.path().join("none")).parts.is_empty());
    }

    /// A terminal is a device that any user has one of; a pipe one that any user can make.
    #[test]
    #[cfg(unix)]
    fn a_pipe_is_written_and_stays_a_pipe() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt};
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link, file] = ["pipe", "link", "file"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        // Open for both, the pipe keeps what is written without waiting for anybody.
        let mut reader = File::options().read(true).write(true).open(&pipe).unwrap();
        for path in [&pipe, &link] {
            write_atomic(path, |w| w.write_all(b"whole")).unwrap();
            let mut bytes = [0; 5];
            io::Read::read_exact(&mut reader, &mut bytes).unwrap();
            assert_eq!(&bytes, b"whole");
        }
        assert!(fs::symlink_metadata(&pipe).unwrap().file_type().is_fifo());
        // A file that its owner alone may read stays one.
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        write_atomic(&file, |w| w.write_all(b"whole")).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[test]
    fn stems_fit_any_file_system_and_stay_apart() {
        let long = |last: char| format!("{}{last}", "ä".repeat(300));
        let [a, b] = [file_stem(&long('a')), file_stem(&long('b'))];
        assert!(a.len() <= LONGEST_STEM && b.len() <= LONGEST_STEM && a != b, "{a} {b}");
        assert_eq!(file_stem("../a b\u{1b}"), "___a_b_");
    }

    #[test]
    fn a_name_as_long_as_the_system_takes_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("{}.obj", "a".repeat(251)));
        write_atomic(&path, |w| w.write_all(b"whole")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = write_atomic(Path::new("/nowhere/at/all.obj"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/at/all.obj: cannot write"), "{error}");
    }
}

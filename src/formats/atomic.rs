use super::{Error, ErrorKind};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

static SERIAL: AtomicU32 = AtomicU32::new(0);

/// Writes a file beside its final name and renames it when `write` has succeeded, so that the name never holds half a file.
///
/// # Errors
/// When the folder cannot be written or `write` fails; the unfinished file is removed and an older file of that name stays.
pub fn write_atomic(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    let beside = unfinished(path);
    remove_stale(path);
    let attempt = || -> io::Result<()> {
        let mut out = BufWriter::with_capacity(1 << 18, File::create(&beside)?);
        write(&mut out)?;
        out.into_inner().map_err(|e| e.into_error())?;
        fs::rename(&beside, path)
    };
    attempt().map_err(|e| {
        // Nothing more can be done when even the removal fails.
        let _ = fs::remove_file(&beside);
        Error::new(path, ErrorKind::Write(e))
    })
}

/// A name in the same folder (renaming across devices is a copy) that no other process or thread uses.
fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(".{name}.{}-{serial}.part", std::process::id()))
}

/// Removes what processes that are no more have left unfinished of this file. Where the system does not tell which processes are,
/// after a day.
pub(super) fn remove_stale(path: &Path) {
    let Some(name) = path.file_name().map(|n| format!(".{}.", n.to_string_lossy())) else { return };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let file = entry.file_name();
        let file = file.to_string_lossy();
        let Some(rest) = file.strip_prefix(&name).and_then(|f| f.strip_suffix(".part")) else { continue };
        let digits = rest.split(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
        let Ok(process) = digits.parse::<u32>() else { continue };
        let gone = match fs::exists("/proc/self") {
            Ok(true) => matches!(fs::exists(format!("/proc/{process}")), Ok(false)),
            _ => (entry.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok()))
                .is_some_and(|age| age.as_secs() > 86_400),
        };
        if gone {
            // Another process may have been quicker.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A name that is safe in a path: what is no letter, digit, `-` or `_` becomes `_`.
pub fn file_stem(name: &str) -> String {
    let safe: String =
        name.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect();
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

    /// No process has the largest number a process can have, so that both leftovers are of none that runs.
    #[test]
    #[cfg(target_os = "linux")]
    fn what_a_killed_run_left_is_removed_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let own = format!(".a.csv.{}-7.part", std::process::id());
        for name in
            [".a.csv.4294967295-0.part", ".a.csv.4294967295.point.part", ".b.csv.4294967295-0.part", own.as_str()]
        {
            fs::write(at(name), b"ha").unwrap();
        }
        write_atomic(&at("a.csv"), |w| w.write_all(b"whole")).unwrap();
        let mut left: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        left.sort();
        assert_eq!(left, [own.as_str(), ".b.csv.4294967295-0.part", "a.csv"]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = write_atomic(Path::new("/nowhere/at/all.obj"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/at/all.obj: cannot write"), "{error}");
    }
}

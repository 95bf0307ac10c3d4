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

    #[test]
    fn a_missing_folder_is_named() {
        let error = write_atomic(Path::new("/nowhere/at/all.obj"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.starts_with("/nowhere/at/all.obj: cannot write"), "{error}");
    }
}

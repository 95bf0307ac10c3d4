//! Files from elsewhere: what is no ordinary file is refused before it is opened, because a pipe or a device may have no end.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Opens an ordinary file, or a link to one, for reading.
///
/// # Errors
/// When it is missing, or a folder, pipe, socket or device.
pub fn open_file(path: &Path) -> io::Result<File> {
    // Asked before opening: to open a pipe waits until somebody writes.
    let kind = fs::metadata(path)?.file_type();
    if kind.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file"));
    }
    if !kind.is_file() {
        let message = "it is a pipe or a device, not an ordinary file; copy what it gives into a file first";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    File::open(path)
}

/// Reads the bytes of a file, at most as many as it had when it was opened.
///
/// # Errors
/// As [`open_file`], and when reading fails.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let file = open_file(path)?;
    let size = file.metadata()?.len();
    let mut bytes = Vec::new();
    // A file that grows while it is read, such as a log, would else never end.
    file.take(size).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads the text of a file in UTF-8; a byte order mark stays at its start.
///
/// # Errors
/// As [`read_bytes`], and when the bytes are no UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read_bytes(path)?)
        .map_err(|e| io::Error::new(io::ErrorKind::InvalidData, format!("it is no UTF-8 text: {e}")))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::os::fd::AsRawFd;

    #[test]
    fn what_has_no_end_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        for path in [Path::new("/dev/zero"), folder.path()] {
            assert!(read_bytes(path).is_err(), "{}", path.display());
        }
        // A pipe, as standard input often is, whose writer never ends it.
        let (reader, _writer) = io::pipe().unwrap();
        let pipe = format!("/proc/self/fd/{}", reader.as_raw_fd());
        assert_eq!(read_bytes(Path::new(&pipe)).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        let path = folder.path().join("a.txt");
        fs::write(&path, "text").unwrap();
        assert_eq!(read_text(&path).unwrap(), "text");
    }
}

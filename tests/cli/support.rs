//! The real binary as a user starts it.

use assert_cmd::Command;
use std::path::Path;

/// Exit code, stdout and stderr, started in `folder`, without colour and on a wide terminal.
pub(crate) fn lampyris_in(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("lampyris").unwrap();
    let command = command.current_dir(folder).args(arguments).env("NO_COLOR", "1").env("COLUMNS", "200");
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// The same, started in the project.
pub(crate) fn lampyris(arguments: &[&str]) -> (i32, String, String) {
    lampyris_in(Path::new(env!("CARGO_MANIFEST_DIR")), arguments)
}

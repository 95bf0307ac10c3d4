//! Notes the commit that a release build comes from, so that every report can name it, and what tells this build from others, so that only
//! parts of runs that the same code traced are added up.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What the program is built from: a change elsewhere does not change it.
const SOURCES: [&str; 3] = ["src", "Cargo.toml", "Cargo.lock"];

/// What stands behind a commit from which files differ.
const CHANGES: &str = "+changes";

/// Sets for the crate `LAMPYRIS_COMMIT`: that of the environment, of the package or of the repository, else `unknown`; and `LAMPYRIS_BUILD`:
/// the same, and behind it a hash of the sources where no commit tells what they are.
fn main() {
    println!("cargo::rerun-if-changed=src/build.rs");
    println!("cargo::rerun-if-env-changed=LAMPYRIS_COMMIT");
    // Only release builds look at git: otherwise every commit would rebuild the crate of everyone who works on it.
    let release = std::env::var("PROFILE").is_ok_and(|p| p == "release");
    let commit =
        std::env::var("LAMPYRIS_COMMIT").ok().or_else(packaged_commit).or_else(|| release.then(git_commit)?);
    // A file that is changed and not committed is a change to tell, and a change of the crate anyway.
    for path in SOURCES {
        println!("cargo::rerun-if-changed={path}");
    }
    let tells_sources = commit.as_ref().is_some_and(|commit| !commit.ends_with(CHANGES));
    let commit = commit.unwrap_or_else(|| "unknown".into());
    let build = if tells_sources { commit.clone() } else { format!("{commit} {:016x}", sources_hash()) };
    println!("cargo::rustc-env=LAMPYRIS_COMMIT={commit}");
    println!("cargo::rustc-env=LAMPYRIS_BUILD={build}");
}

/// Returns a hash (FNV-1a, 64 bits) of the paths and bytes of all files of [`SOURCES`], the same with the line ends of any system.
fn sources_hash() -> u64 {
    let mut files: Vec<PathBuf> = SOURCES.iter().flat_map(|path| files_below(Path::new(path))).collect();
    files.sort();
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    for file in files {
        let name = file.to_string_lossy().replace('\\', "/");
        let bytes = std::fs::read(&file).unwrap_or_default();
        // No text has a zero: it parts names and contents.
        let line_ends_alike = bytes.iter().filter(|byte| **byte != b'\r');
        for byte in name.as_bytes().iter().chain(&[0]).chain(line_ends_alike).chain(&[0]) {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

/// Returns the file, or all files in the folder and its folders, in no order.
fn files_below(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.to_path_buf()] };
    entries.flatten().flat_map(|entry| files_below(&entry.path())).collect()
}

/// Returns the first 12 digits of the commit that `cargo publish` wrote into the package; `None` outside of a package.
fn packaged_commit() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let after = text.split("\"sha1\"").nth(1)?;
    after.split('"').nth(1).map(|sha| sha.chars().take(12).collect())
}

/// Returns the first 12 digits of the commit that is checked out, with [`CHANGES`] behind them where a tracked file of [`SOURCES`] differs
/// from it; `None` without git or outside of a repository. Tells cargo to ask anew when another commit is checked out.
fn git_commit() -> Option<String> {
    let git = |args: &[&str]| {
        let out = Command::new("git").args(args).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&out.stdout).trim().to_owned())
    };
    let place = |name: &str| git(&["rev-parse", "--git-path", name]).filter(|p| Path::new(p).exists());
    // Without a log of HEAD, HEAD itself changes with the branch, and the branch with each commit.
    let moves = place("logs/HEAD").map_or_else(|| [place("HEAD"), place("refs/heads")], |log| [Some(log), None]);
    for path in moves.iter().flatten() {
        println!("cargo::rerun-if-changed={path}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let status = ["--no-optional-locks", "status", "--porcelain", "--untracked-files=no", "--"];
    let changed = !git(&[&status[..], &SOURCES].concat())?.is_empty();
    Some(if changed { format!("{commit}{CHANGES}") } else { commit })
}

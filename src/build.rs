//! Notes the commit that a release build comes from, so that every report can name it, and what distinguishes this build from others, so
//! that only parts of runs that the same code traced are added up.

use std::fs::DirEntry;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the program is built from, the files that it has in it for its demo too: a change elsewhere does not change it.
const SOURCES: [&str; 5] =
    ["src", "Cargo.toml", "Cargo.lock", "fixtures/step/lamp_multicavity.stp", "fixtures/scenes/demo.toml"];

/// What stands for an unknown commit.
const UNKNOWN: &str = "unknown";

/// What stands behind a commit from which files differ.
const CHANGES: &str = "+changes";

/// Odd, with its bits in no order: 2⁶⁴ over the golden ratio.
const MULTIPLIER: u64 = 0x9e37_79b9_7f4a_7c15;

/// Sets for the crate `LAMPYRIS_COMMIT`: that of the environment, of the package or of the repository, else [`UNKNOWN`]; and
/// `LAMPYRIS_BUILD`: the commit, and behind it, or alone, a hash of the sources where no commit identifies them.
fn main() {
    println!("cargo::rerun-if-changed=src/build.rs");
    println!("cargo::rerun-if-env-changed=LAMPYRIS_COMMIT");
    // Only release builds look at git: otherwise every commit would rebuild the crate of everyone who works on it.
    let release = std::env::var("PROFILE").is_ok_and(|p| p == "release");
    let given = std::env::var("LAMPYRIS_COMMIT").ok().filter(|commit| !commit.is_empty() && commit != UNKNOWN);
    let commit = given.or_else(packaged_commit).or_else(|| release.then(git_commit)?);
    // A file that is changed and not committed is a change to note, and a change of the crate anyway.
    for path in SOURCES {
        println!("cargo::rerun-if-changed={path}");
    }
    let sources = || format!("(sources {:016x})", hash_of_files(&SOURCES));
    let build = match &commit {
        Some(commit) if !commit.ends_with(CHANGES) => commit.clone(),
        Some(commit) => format!("{commit} {}", sources()),
        None => sources(),
    };
    println!("cargo::rustc-env=LAMPYRIS_COMMIT={}", commit.as_deref().unwrap_or(UNKNOWN));
    println!("cargo::rustc-env=LAMPYRIS_BUILD={build}");
}

/// Returns a hash of the paths and bytes of these files, and of all in these folders, the same with the line ends of any system.
pub(crate) fn hash_of_files(paths: &[impl AsRef<Path>]) -> u64 {
    let mut files: Vec<PathBuf> = paths.iter().flat_map(|path| files_below(path.as_ref())).collect();
    files.sort();
    let mut hash = 0;
    for file in files {
        let name = file.to_string_lossy().replace('\\', "/");
        let bytes = std::fs::read(&file).unwrap_or_default();
        hash = hash_with(hash, name.as_bytes());
        hash = hash_with(hash, &without_carriage_returns(&bytes));
    }
    hash
}

/// Returns the file, or all files in the folder and its folders, in no order. Names that begin with `.` or end with `~` are passed over:
/// systems and editors leave them, and they are not compiled.
fn files_below(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.to_path_buf()] };
    let is_source = |entry: &DirEntry| {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        !name.starts_with('.') && !name.ends_with('~')
    };
    entries.flatten().filter(is_source).flat_map(|entry| files_below(&entry.path())).collect()
}

/// Returns the bytes without carriage returns. From one to the next at once: cargo does not optimize build scripts, in which a step for
/// each byte takes long.
fn without_carriage_returns(mut bytes: &[u8]) -> Vec<u8> {
    let mut kept = Vec::with_capacity(bytes.len());
    while bytes.read_until(b'\r', &mut kept).is_ok_and(|read| read > 0) {
        kept.pop_if(|byte| *byte == b'\r');
    }
    kept
}

/// Returns a hash with these bytes added, eight at a time.
fn hash_with(hash: u64, bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    // Their number first: it parts names from contents, and what is short from what ends with zeros.
    let mut hash = mixed(hash, bytes.len() as u64);
    for word in words {
        hash = mixed(hash, u64::from_le_bytes(*word));
    }
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    mixed(hash, u64::from_le_bytes(last))
}

/// Returns a hash with a word added. No two words, and no two hashes before, give the same: another word alone always changes it.
fn mixed(hash: u64, word: u64) -> u64 {
    let product = (hash ^ word).wrapping_mul(MULTIPLIER);
    // Products carry upwards alone.
    product ^ (product >> 32)
}

/// Returns the first 12 digits of the commit that `cargo publish` wrote into the package, with [`CHANGES`] behind them where files of it
/// differed from that; `None` outside of a package.
fn packaged_commit() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let after = text.split("\"sha1\"").nth(1)?;
    let commit: String = after.split('"').nth(1)?.chars().take(12).collect();
    let changed = text.split_whitespace().collect::<String>().contains("\"dirty\":true");
    Some(if changed { commit + CHANGES } else { commit })
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
    Some(if changed { commit + CHANGES } else { commit })
}

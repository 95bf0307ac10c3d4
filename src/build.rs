//! Notes the commit that a release build comes from, so that every report can name it.

use std::path::Path;
use std::process::Command;

/// What the program is built from: a change elsewhere does not change it.
const SOURCES: [&str; 3] = ["src", "Cargo.toml", "Cargo.lock"];

/// Sets `LAMPYRIS_COMMIT` for the crate: that of the environment, of the package or of the repository, else `unknown`.
fn main() {
    println!("cargo::rerun-if-changed=src/build.rs");
    println!("cargo::rerun-if-env-changed=LAMPYRIS_COMMIT");
    // Only release builds look at git: otherwise every commit would rebuild the crate of everyone who works on it.
    let release = std::env::var("PROFILE").is_ok_and(|p| p == "release");
    let commit =
        std::env::var("LAMPYRIS_COMMIT").ok().or_else(packaged_commit).or_else(|| release.then(git_commit)?);
    if release {
        // A file that is changed and not committed is a change to tell.
        for path in SOURCES {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    println!("cargo::rustc-env=LAMPYRIS_COMMIT={}", commit.as_deref().unwrap_or("unknown"));
}

/// Returns the first 12 digits of the commit that `cargo publish` wrote into the package; `None` outside of a package.
fn packaged_commit() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let after = text.split("\"sha1\"").nth(1)?;
    after.split('"').nth(1).map(|sha| sha.chars().take(12).collect())
}

/// Returns the first 12 digits of the commit that is checked out, with `+changes` behind them where a tracked file of [`SOURCES`] differs
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
    Some(if changed { format!("{commit}+changes") } else { commit })
}

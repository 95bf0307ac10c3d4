//! Notes the commit that a release build comes from, so that every report can name it.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=src/build.rs");
    println!("cargo::rerun-if-env-changed=LAMPYRIS_COMMIT");
    // Only release builds look at git: otherwise every commit would rebuild the crate of everyone who works on it.
    let release = std::env::var("PROFILE").is_ok_and(|p| p == "release");
    let commit = std::env::var("LAMPYRIS_COMMIT").ok().or_else(packaged).or_else(|| release.then(checked_out)?);
    if release {
        // A file that is changed and not committed is a change to tell.
        for path in ["src", "Cargo.toml", "Cargo.lock"] {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    println!("cargo::rustc-env=LAMPYRIS_COMMIT={}", commit.as_deref().unwrap_or("unknown"));
}

/// The commit that `cargo publish` wrote into the package.
fn packaged() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let after = text.split("\"sha1\"").nth(1)?;
    after.split('"').nth(1).map(|sha| sha.chars().take(12).collect())
}

/// The commit of the working tree, with a mark when files differ from it.
fn checked_out() -> Option<String> {
    let git = |args: &[&str]| {
        let out = Command::new("git").args(args).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&out.stdout).trim().to_owned())
    };
    if let Some(head) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|p| Path::new(p).exists()) {
        println!("cargo::rerun-if-changed={head}");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if changed { format!("{commit}+changes") } else { commit })
}

//! A run has no more threads than are asked for, from the reading of its files on, and one that listens to signals.
#![cfg(target_os = "linux")]

use crate::files::fixture;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Names of the threads of a process, as the system has them; none once it has ended.
fn threads(process: u32) -> Vec<String> {
    let Ok(folder) = fs::read_dir(format!("/proc/{process}/task")) else { return Vec::new() };
    folder.flatten().filter_map(|task| fs::read_to_string(task.path().join("comm")).ok()).collect()
}

/// A command that writes no results says that it was interrupted, and of nothing that it is lost.
#[test]
fn an_interrupted_check_loses_nothing() {
    let mut check = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .args(["check", "--tolerance", "0.002"])
        .arg(fixture("step/lamp_multicavity.stp"))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let listens = |process: u32| threads(process).iter().any(|name| name.trim() == "signals");
    while check.try_wait().unwrap().is_none() && !listens(check.id()) {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-TERM", &check.id().to_string()]).status().unwrap().success());
    let output = check.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.signal(), Some(15), "{err}");
    assert!(err.contains("interrupted") && !err.contains("lost"), "{err}");
}

#[test]
fn one_thread_is_all_that_works() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .args(["trace", "--rays", "30000", "--threads", "1", "--no-report", "-q", "-o", "out"])
        .arg(fixture("scenes/s2_lamp.toml"))
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let (mut crowded, mut looks) = (0, 0);
    while run.try_wait().unwrap().is_none() {
        // The thread that waits for signals has a name of its own, but not from its first moment on.
        let workers = threads(run.id()).iter().filter(|name| name.trim() == "lampyris").count();
        crowded += usize::from(workers > 1);
        looks += 1;
    }
    assert!(run.wait().unwrap().success());
    assert!(looks > 10 && crowded < looks / 4, "more than one thread in {crowded} of {looks} looks");
}

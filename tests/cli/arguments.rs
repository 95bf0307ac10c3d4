//! Arguments, help and the commands about the command, with the real binary.

use crate::support::lampyris;

#[test]
fn help_and_version_go_to_stdout() {
    let (code, out, err) = lampyris(&["--help"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for command in ["demo", "info", "facet", "trace", "check", "study", "merge", "schema", "completions", "man"] {
        assert!(out.contains(command), "{command} is missing in {out}");
    }
    assert!(lampyris(&["--version"]).1.starts_with("lampyris 0."));
}

#[test]
fn wrong_arguments_end_with_2_and_say_what_to_write() {
    for (arguments, says) in [
        (&["facet", "a.stp", "--tolerance", "-0.1"][..], "a tolerance is a positive length in mm, not -0.1"),
        (&["facet", "a.stp", "--tolerance=0.2..0.05"], "0.05..0.2"),
        (&["facet", "a.stp", "--part", "cover"], "cover=0.01..0.05"),
        (&["facet", "a.stp", "--tolerance", "0.1", "--accuracy", "1deg"], "--accuracy"),
        (&["trace", "a.toml", "--rays", "-5"], "from 1 to 2e13"),
        (&["trace", "a.toml", "--rays", "1e30"], "from 1 to 2e13"),
        (&["demo", "--intersector", "exact", "--normals", "flat"], "the spline has normals of its own"),
        (&["trace", "a.toml", "--normals", "smooth"], "bilinear"),
        (
            &["trace", "a.toml", "--intersector", "exact", "--normals", "bilinear"],
            "--normals bilinear with the intersector exact: the spline has normals of its own",
        ),
        // No such scene: what is wrong with an option is said before anything is read.
        (&["trace", "a.toml", "--until-error", "1%"], "P%@RECEIVER"),
        (&["trace", "a.toml", "--until-error", "1%@"], "P%@RECEIVER"),
        (&["merge", "parts", "-o", "out", "--until-error", "one@wall"], "P%@RECEIVER"),
        (&["trace", "a.toml", "--paths", "p.foo"], "--paths paths.npz"),
        (&["trace", "a.toml", "--ends", "e.foo"], "--ends ends.npz"),
        (&["trace", "a.toml", "--threads", "x"], "a whole number from 1 to 18446744073709551615"),
        (&["trace", "a.toml", "--threads", "0"], "a whole number from 1 to"),
        (&["trace", "a.toml", "--seed", "-1"], "a whole number from 0 to 18446744073709551615"),
        (&["trace", "a.toml", "--sequences", "many"], "a whole number from 0 to"),
        (&["trace", "a.toml", "--checkpoint", "-1"], "a number of seconds"),
        (&["info", "s.stp", "--max-placed", "-1"], "a whole number from 0 to"),
        (&["info", "s.stp", "--max-refused", "2"], "a share is a number from 0 to 1"),
        (&["info", "s.stp", "--max-refused", "-1"], "a share is a number from 0 to 1"),
        (&["merge", "parts", "-o", "out", "--max-lost", "-0.5"], "a share is a number from 0 to 1"),
        (&["facet", "a.stp", "--role", "mirror"], "write ROLE=MIN..MAX, as in mirror="),
        (&["facet", "a.stp", "--face", "x"], "as in 17="),
        (&["study", "everything"], "accuracy"),
        (&["study", "accuracy", "--normals", "flat"], "study accuracy does not take --normals"),
        (&["study", "bvh", "--intersector", "exact"], "does not take --intersector"),
        (&["study", "stability", "--rays", "5"], "its rays are fixed"),
        (&["study", "accuracy", "--rays-in", "a.csv"], "study accuracy does not take --rays-in"),
        (&["study", "effects", "--embree", "libembree4.so"], "study effects does not take --embree"),
        (&["study", "bvh", "--embree", "no/such/library.so"], "no/such/library.so cannot be used as Embree"),
        (&["study", "bvh", "--rays-in", "a.csv", "--rays", "5"], "the file of --rays-in has all of them"),
        (&["study", "bvh", "--angle", "5"], "study bvh does not take --angle"),
        (&["study", "bvh", "--part", "lens=0.1"], "study bvh does not take --part"),
        (&["study", "stability", "--face", "#7=0.1"], "study stability does not take --face"),
        (&["study", "interpolation", "--role", "mirror=0.1"], "study interpolation does not take --role"),
        (&["study", "interpolation", "--tolerance", "0.1"], "tolerances of its own"),
        (&["trace", "s.toml", "--max-lost", "nan"], "a share is a number"),
        (&["info", "s.stp", "--max-refused", "nan"], "a share is a number"),
        (&["study", "accuracy", "--angle", "5"], "study accuracy does not take --angle"),
        (&["study", "accuracy", "--role", "mirror=0.1"], "study accuracy does not take --role"),
        (&["man", "--json"], "man has no JSON document"),
        (&["tarce"], "trace"),
        (&[], "Usage"),
    ] {
        let (code, out, err) = lampyris(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
        assert!(err.contains(says), "{arguments:?}: {err}");
        assert!(!err.contains('\x1b'), "NO_COLOR is respected");
    }
}

/// A device that is full takes neither help nor results, and the message says what could not be written.
#[test]
#[cfg(target_os = "linux")]
fn help_and_results_that_could_not_be_written_are_failures() {
    for (arguments, says) in [(&["--help"][..], "error: "), (&["media", "--json"], "error: standard output")] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let program = assert_cmd::cargo::cargo_bin("lampyris");
        let ended = std::process::Command::new(program).args(arguments).stdout(full).output().unwrap();
        assert_eq!(ended.status.code(), Some(1), "{ended:?}");
        assert!(String::from_utf8_lossy(&ended.stderr).starts_with(says), "{ended:?}");
    }
}

#[test]
fn completions_and_manual() {
    for shell in ["bash", "zsh", "fish"] {
        let (code, out, _) = lampyris(&["completions", shell]);
        assert!(code == 0 && out.contains("lampyris") && out.contains("tolerance"), "{shell}");
    }
    let (code, page, _) = lampyris(&["man"]);
    assert!(code == 0 && page.contains(".TH lampyris"), "{page}");
    let folder = tempfile::tempdir().unwrap();
    let (code, out, _) = lampyris(&["man", "-o", folder.path().to_str().unwrap()]);
    assert_eq!((code, out.as_str()), (0, ""));
    let page = std::fs::read_to_string(folder.path().join("lampyris-trace.1")).unwrap();
    assert!(page.contains("verify\\-pruning"), "{page}");
}

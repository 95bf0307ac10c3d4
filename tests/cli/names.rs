//! Names are data: whatever a file calls its parts, nothing that a terminal obeys reaches an output.

use crate::files::fixture;
use crate::support::lampyris_in;
use lampyris::formats::is_unprintable;
use std::fs;
use std::path::Path;

/// ESC and CSI, an OSC that sets the title, BEL, C1's CSI, a carriage return, a right-to-left override and NUL, as Part 21
/// writes them.
const IN_STEP: &str = r"=1+1\X\1B[31m\X\1B]0;t\X\07\X\9B2J\X\0D\X2\202E\X0\\X\00end";
/// The same in TOML.
const IN_TOML: &str = r"=1+1\u001b[31m\u001b]0;t\u0007\u009b2J\r\u202e\u0000end";

/// The text files in a folder and those below it.
fn texts(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            texts(&path, found);
            continue;
        }
        let binary = ["png", "npz", "glb", "vti", "vtp", "vtu", "tally", "tm25ray"];
        if path.extension().is_none_or(|e| !binary.iter().any(|b| e == *b)) {
            let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
            found.push((path.display().to_string(), text));
        }
    }
}

fn obeyed(text: &str) -> Vec<char> {
    text.chars().filter(|c| is_unprintable(*c)).collect()
}

#[test]
fn terminal_codes_in_names_reach_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let model = fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    let at = model.find("PRODUCT('").unwrap() + "PRODUCT('".len();
    let end = at + model[at..].find('\'').unwrap();
    // Its id and its name are one text.
    let own = format!("'{}'", &model[at..end]);
    fs::write(path.join("model.stp"), model.replace(&own, &format!("'{IN_STEP}'"))).unwrap();
    let scene = fs::read_to_string(fixture("scenes/s1_lens.toml")).unwrap();
    let scene = scene.replace("../step/lens_planoconvex_nurbs.stp", "model.stp").replace("1_000_000", "5_000");
    let scene =
        scene.replace("\"focus\"", &format!("\"{IN_TOML}\"")).replace("\"glass\"", &format!("\"{IN_TOML}\""));
    fs::write(path.join("scene.toml"), scene.replace("S1: plano-convex lens", IN_TOML)).unwrap();
    let hostile = "no\u{1b}[31m\u{9b}2J\u{202e}";
    let commands: [(&[&str], i32); 11] = [
        (&["info", "model.stp"], 0),
        (&["info", "model.stp", "--json"], 0),
        (&["info", "model.stp", "--faces"], 0),
        (&["init", "model.stp", "-o", "out/new.toml"], 0),
        (&["trace", "out/new.toml", "--dry-run"], 0),
        (&["facet", "model.stp", "-o", "a.ply", "-o", "a.obj", "-v"], 0),
        (&["trace", "scene.toml", "-o", "out"], 0),
        (&["trace", "scene.toml", "-o", "out", "--json"], 0),
        (&["facet", "model.stp", "--part", &format!("{hostile}=0.1")], 2),
        (&["info", hostile], 3),
        (&[hostile], 2),
    ];
    fs::create_dir(path.join("out")).unwrap();
    for (arguments, expected) in commands {
        let (code, out, err) = lampyris_in(path, arguments);
        assert_eq!(code, expected, "{arguments:?}: {err}");
        for text in [&out, &err] {
            assert!(obeyed(text).is_empty(), "{arguments:?}: {:?}", obeyed(text));
        }
    }
    let mut files = Vec::new();
    texts(&path.join("out"), &mut files);
    // The library in the report holds marks of its own; it is not part of any name.
    let library = "<script>/**";
    for (file, text) in &mut files {
        if let Some(at) = text.find(library) {
            text.truncate(at);
        }
        assert!(obeyed(text).is_empty(), "{file}: {:?}", obeyed(text));
    }
    assert!(files.len() > 8, "{}", files.len());
    for (file, end) in [("a.ply", "end_header"), ("a.obj", "\nf ")] {
        let bytes = fs::read(path.join(file)).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let head = &text[..text.find(end).unwrap()];
        assert!(obeyed(head).is_empty(), "{file}: {:?}", obeyed(head));
    }
}

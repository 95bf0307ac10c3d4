//! The floors of the house: a room imports only rooms on lower floors, third-party doors stay shut, files stay small.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms and their floors; rooms of one floor do not see each other.
const FLOORS: &[(&str, u32)] = &[
    ("math", 0),
    ("nurbs", 1),
    ("mesh", 1),
    ("formats", 2),
    ("model", 2),
    ("step", 3),
    ("kernel", 3),
    ("tessellate", 3),
    ("intersect", 3),
    ("optics", 3),
    ("simulate", 4),
    ("study", 5),
    ("report", 6),
    ("cli", 7),
];

/// Large rooms have rooms of their own, each of which sees only those before it.
const INNER: &[(&str, &[&str])] = &[
    ("step", &["part21", "chart", "geometry", "trim", "product"]),
    ("tessellate", &["proof", "border", "strip", "cells"]),
];

/// Crates that only one room may name.
const DOORS: &[(&str, &[&str])] = &[
    ("truck_modeling", &["kernel"]),
    ("truck_meshalgo", &["kernel"]),
    ("truck_polymesh", &["kernel", "formats"]),
    ("obvhs", &["intersect"]),
    ("spade", &["tessellate"]),
    ("clap", &["cli"]),
    ("miette", &["cli"]),
    ("indicatif", &["cli"]),
    ("comfy_table", &["cli", "report"]),
    ("maud", &["report"]),
    ("plotly", &["report"]),
    ("image", &["formats"]),
    ("npyz", &["formats"]),
    ("zip", &["formats"]),
    ("eulumdat", &["formats"]),
];

/// Longest file that still reads as one idea.
const LONGEST: usize = 400;

fn sources() -> Vec<PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("readable source folder") {
            let path = entry.expect("readable entry").path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    found
}

/// The room of a source file; `None` for `lib.rs` and `main.rs`, which may see all.
fn room(path: &Path) -> Option<String> {
    let inside = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).expect("inside src");
    let mut parts = inside.components().map(|c| c.as_os_str().to_string_lossy().into_owned());
    let first = parts.next()?;
    parts.next().map(|_| first)
}

/// The code of a file without comments, so that links in docs do not count as imports.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("readable source");
    text.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// Rooms named as `crate::room` or inside `crate::{room, …}`.
fn imported_rooms(code: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut start = true;
            let mut word = String::new();
            for c in group.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => start = true,
                    c if start && (c.is_alphanumeric() || c == '_') => word.push(c),
                    _ => {}
                }
                let in_name = c.is_alphanumeric() || c == '_' || c.is_whitespace() || c == ',';
                if !in_name && !word.is_empty() {
                    start = false;
                }
                if (c == ',' || c == ':' || c == '}') && !word.is_empty() {
                    rooms.push(std::mem::take(&mut word));
                }
            }
            if !word.is_empty() {
                rooms.push(word);
            }
        } else {
            rooms.push(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect());
        }
    }
    rooms
}

#[test]
fn rooms_import_only_lower_floors() {
    let floors: BTreeMap<&str, u32> = FLOORS.iter().copied().collect();
    let mut broken = Vec::new();
    for path in sources() {
        let Some(room) = room(&path) else { continue };
        let Some(&floor) = floors.get(room.as_str()) else {
            broken.push(format!("{}: the room '{room}' has no floor", path.display()));
            continue;
        };
        for other in imported_rooms(&code(&path)) {
            match floors.get(other.as_str()) {
                Some(_) if other == room => {}
                Some(&f) if f < floor => {}
                Some(&f) => broken
                    .push(format!("{}: '{room}' (floor {floor}) imports '{other}' (floor {f})", path.display())),
                None => broken.push(format!("{}: '{other}' is no room", path.display())),
            }
        }
    }
    assert!(broken.is_empty(), "walls broken:\n{}", broken.join("\n"));
}

#[test]
fn inner_rooms_import_only_those_before_them() {
    let mut broken = Vec::new();
    for (room, inner) in INNER {
        let inside = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(room);
        for (floor, own) in inner.iter().enumerate() {
            let files = sources().into_iter().filter(|p| p.starts_with(inside.join(own)));
            for path in files {
                let code = code(&path);
                for later in &inner[floor + 1..] {
                    if code.contains(&format!("crate::{room}::{later}")) {
                        broken.push(format!("{}: '{own}' imports '{later}'", path.display()));
                    }
                }
            }
        }
    }
    assert!(broken.is_empty(), "inner walls broken:\n{}", broken.join("\n"));
}

#[test]
fn third_party_crates_come_in_through_their_doors() {
    let mut broken = Vec::new();
    for path in sources() {
        let Some(room) = room(&path) else { continue };
        let code = code(&path);
        for (name, allowed) in DOORS {
            let named = code
                .match_indices(&format!("{name}::"))
                .any(|(at, _)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'));
            if named && !allowed.contains(&room.as_str()) {
                broken.push(format!("{}: '{room}' names '{name}'", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "side doors:\n{}", broken.join("\n"));
}

#[test]
fn no_file_is_longer_than_one_idea() {
    let long: Vec<String> = sources()
        .iter()
        .filter_map(|p| {
            let lines = fs::read_to_string(p).expect("readable source").lines().count();
            (lines > LONGEST).then(|| format!("{}: {lines} lines", p.display()))
        })
        .collect();
    assert!(long.is_empty(), "longer than {LONGEST} lines:\n{}", long.join("\n"));
}

#[test]
fn the_reader_of_imports_sees_every_spelling() {
    let seen = imported_rooms("use crate::math::Ray; use crate::{mesh::{Facet, FacetMesh}, nurbs, model::Part};");
    assert_eq!(seen, ["math", "mesh", "nurbs", "model"]);
}

//! The deliberate faults of `tests/mutants`: each must be one that can still be put in.

use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::Path;

#[derive(Deserialize)]
struct List {
    fault: Vec<Fault>,
}

#[derive(Deserialize)]
struct Fault {
    name: String,
    file: String,
    text: String,
}

#[test]
fn every_deliberate_fault_has_its_place_in_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = std::fs::read_to_string(root.join("tests/mutants/faults.toml")).unwrap();
    let List { fault: faults } = toml::from_str(&listed).unwrap();
    let names: BTreeSet<&str> = faults.iter().map(|fault| fault.name.as_str()).collect();
    assert_eq!(names.len(), faults.len(), "names are given once");
    let mut stale = Vec::new();
    for Fault { name, file, text } in &faults {
        let marks = ['«', '»'].map(|mark| text.matches(mark).count());
        // A checkout may have turned the ends of lines.
        let source = std::fs::read_to_string(root.join(file)).unwrap_or_default().replace("\r\n", "\n");
        let count = source.matches(&text.replace(['«', '»'], "")).count();
        if marks != [1, 1] || count != 1 {
            stale.push(format!("{name}: {file} holds its text {count} times, and the text has {marks:?} marks"));
        }
    }
    assert!(stale.is_empty(), "deliberate faults follow the code that they change:\n{}", stale.join("\n"));
}

//! The hash that identifies builds without a commit: another source gives another one, and nothing else does.

use crate::build_script::hash_of_files;
use std::fs;

#[test]
fn the_hash_of_sources_changes_with_these_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("inner")).unwrap();
    let hash_with = |name: &str, text: &str| {
        fs::write(path.join(name), text).unwrap();
        hash_of_files(&[path])
    };
    // Of more than a word of eight bytes, and of less.
    let text = "fn a() {\n    1\n}\n";
    hash_with("inner/b.rs", "//");
    let hash = hash_with("a.rs", text);
    assert_eq!(hash_with("a.rs", &text.replace('\n', "\r\n")), hash);
    for left in [".DS_Store", "inner/.b.rs.swp", "a.rs~"] {
        assert_eq!(hash_with(left, "left by another program"), hash, "{left}");
    }
    for other in [text.replace('1', "2"), text.replace("fn", "gn"), format!("{text}\n"), format!("{text}\0")] {
        assert_ne!(hash_with("a.rs", &other), hash, "{other:?}");
    }
    assert_eq!(hash_with("a.rs", text), hash);
    fs::rename(path.join("inner/b.rs"), path.join("inner/c.rs")).unwrap();
    assert_ne!(hash_of_files(&[path]), hash);
}

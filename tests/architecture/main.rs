//! The architecture: a module uses only modules of lower layers, third-party crates come in through their doors, no circle of
//! files is larger than one idea, and files stay small.

mod build_hash;
#[allow(dead_code, reason = "only cargo runs it")]
#[path = "../../src/build.rs"]
mod build_script;
mod faults;
mod graph;
mod layers;
mod source;

use graph::{Graph, Module, Use, circles};
use layers::{DOORS, INNER, LAYERS};
use source::SourceFile;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Longest file that still reads as one idea.
const LONGEST: usize = 400;

/// A folder with more files than this states the order of its modules in [`INNER`].
const LARGEST_UNORDERED: usize = 8;

fn sources() -> Vec<SourceFile> {
    source::files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

fn spelled(module: &[String]) -> String {
    if module.is_empty() { "lib".to_owned() } else { module.join("/") }
}

fn uses() -> BTreeMap<Module, BTreeSet<Use>> {
    Graph::new(&sources()).uses()
}

#[test]
fn modules_use_only_lower_layers() {
    let layers: BTreeMap<&str, u32> = LAYERS.iter().copied().collect();
    let mut broken = Vec::new();
    for (module, uses) in uses() {
        let Some(own) = module.first() else { continue };
        let Some(&layer) = layers.get(own.as_str()) else {
            broken.push(format!("{own} has no layer"));
            continue;
        };
        for other in uses.iter().flat_map(|u| [&u.named, &u.defined]).filter_map(|m| m.first()) {
            match layers.get(other.as_str()) {
                Some(_) if other == own => {}
                Some(&lower) if lower < layer => {}
                found => broken.push(format!("{}: layer {layer} uses {other}, layer {found:?}", spelled(&module))),
            }
        }
    }
    broken.dedup();
    assert!(broken.is_empty(), "modules use only lower layers:\n{}", broken.join("\n"));
}

/// The place of a module in its folder's order; modules of one group share a place.
fn place(order: &[&str], name: &str) -> Option<usize> {
    order.iter().position(|group| group.split(' ').any(|m| m == name))
}

#[test]
fn inner_modules_use_only_those_before_them() {
    let uses = uses();
    let mut broken = Vec::new();
    for (folder, order) in INNER {
        let folder: Module = folder.split('/').map(str::to_owned).collect();
        // The entry of a module in this folder: a file, a folder, or `mod` for the folder's own file.
        let entry = |m: &Module| {
            m.starts_with(&folder).then(|| m.get(folder.len()).map_or("mod", |e| e.as_str()).to_owned())
        };
        for (module, uses) in &uses {
            let Some(own) = entry(module) else { continue };
            let at = match place(order, &own) {
                Some(at) => at,
                // The folder's own file gathers what is in it.
                None if own == "mod" => order.len(),
                None => {
                    broken.push(format!("{} has no place in its folder", spelled(module)));
                    continue;
                }
            };
            for other in uses.iter().filter_map(|u| entry(&u.defined)).filter(|e| *e != own) {
                if place(order, &other).is_none_or(|lower| lower > at) {
                    broken.push(format!(
                        "{} uses {other}, which comes later in {}",
                        spelled(module),
                        spelled(&folder)
                    ));
                }
            }
        }
        for name in order.iter().flat_map(|group| group.split(' ')).filter(|name| *name != "mod") {
            if !uses.keys().any(|m| entry(m).is_some_and(|e| e == name)) {
                broken.push(format!("{} has no module {name}", spelled(&folder)));
            }
        }
    }
    broken.dedup();
    assert!(broken.is_empty(), "inner modules use only those before them:\n{}", broken.join("\n"));
}

/// The folders below `src` with the number of files in each, those of its own folders included.
fn folders() -> BTreeMap<String, usize> {
    let mut sizes: BTreeMap<String, usize> = BTreeMap::new();
    for file in sources() {
        let inside = file.path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).expect("inside src");
        for folder in inside.ancestors().skip(1).filter(|f| !f.as_os_str().is_empty()) {
            *sizes.entry(folder.to_string_lossy().replace('\\', "/")).or_default() += 1;
        }
    }
    sizes
}

#[test]
fn every_large_folder_states_its_order() {
    let stated: BTreeSet<&str> = INNER.iter().map(|(folder, _)| *folder).collect();
    let missing: Vec<String> = folders()
        .iter()
        .filter(|(folder, files)| **files > LARGEST_UNORDERED && !stated.contains(folder.as_str()))
        .map(|(folder, files)| format!("{folder}: {files} files"))
        .collect();
    assert!(missing.is_empty(), "folders without an order of their modules:\n{}", missing.join("\n"));
}

#[test]
#[ignore = "prints an order that each large folder could state, with circles as groups"]
fn propose_orders() {
    let uses = uses();
    for folder in folders().into_iter().filter(|(_, files)| *files > LARGEST_UNORDERED).map(|(folder, _)| folder) {
        let path: Module = folder.split('/').map(str::to_owned).collect();
        let entry = |m: &Module| {
            m.starts_with(&path).then(|| vec![m.get(path.len()).map_or("mod", |e| e.as_str()).to_owned()])
        };
        let mut edges: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
        for (module, uses) in &uses {
            if let Some(own) = entry(module) {
                let others = uses.iter().filter_map(|u| entry(&u.defined)).filter(|e| *e != own);
                edges.entry(own.clone()).or_default().extend(others);
            }
        }
        let mut groups = circles(&edges);
        let single = edges.keys().filter(|m| !groups.iter().any(|g| g.contains(m))).map(|m| vec![m.clone()]);
        groups.extend(single.collect::<Vec<_>>());
        let mut order = Vec::new();
        while let Some(next) = groups.iter().position(|g| {
            let below = |m: &Module| g.contains(m) || !groups.iter().any(|other| other.contains(m));
            g.iter().all(|m| edges[m].iter().all(below))
        }) {
            order.push(groups.remove(next).concat().join(" "));
        }
        println!("(\"{folder}\", &{order:?}),");
    }
}

#[test]
fn no_files_name_each_other_in_a_circle() {
    let edges: BTreeMap<Module, BTreeSet<Module>> =
        uses().into_iter().map(|(m, uses)| (m, uses.into_iter().map(|u| u.defined).collect())).collect();
    let lists: Vec<String> = circles(&edges)
        .iter()
        .filter(|c| c.len() > 1)
        .map(|c| format!("{}: {}", c.len(), c.iter().map(|m| spelled(m)).collect::<Vec<_>>().join(" ")))
        .collect();
    assert!(lists.is_empty(), "circles of files:\n{}", lists.join("\n"));
}

#[test]
fn third_party_crates_come_in_through_their_doors() {
    let mut broken = Vec::new();
    for file in sources() {
        let Some(own) = file.module.first() else { continue };
        for (name, allowed) in DOORS {
            let named = file.tokens.windows(2).enumerate().any(|(at, pair)| {
                let begins = at == 0 || !file.tokens[at - 1].is("::");
                begins && pair[0].is(name) && pair[1].is("::")
            });
            if named && !allowed.contains(&own.as_str()) {
                broken.push(format!("{} names {name}", spelled(&file.module)));
            }
        }
    }
    assert!(broken.is_empty(), "crates outside their doors:\n{}", broken.join("\n"));
}

/// Asserts that no file has more than `most` of these units, as `measure` counts them.
fn assert_none_above(most: usize, units: &str, measure: impl Fn(&SourceFile) -> usize) {
    let above: Vec<String> = sources()
        .iter()
        .filter(|f| measure(f) > most)
        .map(|f| format!("{}: {} {units}", f.path.display(), measure(f)))
        .collect();
    assert!(above.is_empty(), "more than {most} {units}:\n{}", above.join("\n"));
}

#[test]
fn no_file_is_longer_than_one_idea() {
    assert_none_above(LONGEST, "lines", |f| f.lines);
}

/// Columns that a line of comment may have; `cargo fmt` wraps none.
const COMMENT_COLUMNS: usize = 140;

#[test]
fn comments_end_where_code_does() {
    assert_none_above(COMMENT_COLUMNS, "columns of comment", |f| f.longest_comment);
}

#[test]
fn every_file_says_what_it_is_for() {
    let without: Vec<String> =
        sources().iter().filter(|f| !f.has_header).map(|f| f.path.display().to_string()).collect();
    assert!(without.is_empty(), "{} files without a header:\n{}", without.len(), without.join("\n"));
}

/// The guard itself: how paths are read.
mod reading {
    use super::*;
    use source::tokens;

    fn file(module: &str, text: &str) -> SourceFile {
        let module: Module = module.split('/').filter(|m| !m.is_empty()).map(str::to_owned).collect();
        SourceFile {
            path: module.iter().collect(),
            module,
            tokens: tokens(text),
            lines: 0,
            longest_comment: 0,
            has_header: true,
        }
    }

    fn used(files: &[SourceFile], module: &str) -> Vec<String> {
        let key: Module = module.split('/').map(str::to_owned).collect();
        Graph::new(files).uses()[&key].iter().map(|u| spelled(&u.defined)).collect()
    }

    #[test]
    fn quotes_comments_and_lifetimes_hold_no_names() {
        let text = r##"fn f<'a>(x: &'a str) { /* crate::a /* nested */ */ "crate::b"; r#"crate::"c"#; '"'; '\''; crate::d } // crate::e"##;
        let names: Vec<_> = tokens(text).iter().filter_map(|t| t.word().map(str::to_owned)).collect();
        assert_eq!(names, ["fn", "f", "a", "x", "a", "str", "crate", "d"]);
    }

    #[test]
    fn every_spelling_of_a_path_is_seen() {
        let files = [
            file("", "pub use mesh::Facet;"),
            file("mesh", "pub struct Facet; pub fn area() {}"),
            file("math", "pub use ray::Ray; pub mod ray;"),
            file("math/ray", "pub struct Ray;"),
            file("nurbs", "pub const DEGREE: usize = 3;"),
            file("user/grouped", "use crate::{math::{Ray as Line, ray}, mesh::{self}}; fn f() { mesh::area(); }"),
            file(
                "user/inline",
                "fn f() { let r: crate::math::Ray; super::helper::help(super::super::nurbs::DEGREE) }",
            ),
            file("user/exported", "use crate::Facet;"),
            file("user/helper", "pub fn help() {}"),
            file("user", "pub use crate::nurbs::DEGREE; mod grouped; mod inline; mod exported; mod helper;"),
        ];
        assert_eq!(used(&files, "user/grouped"), ["math/ray", "mesh"]);
        assert_eq!(used(&files, "user/inline"), ["math/ray", "nurbs", "user/helper"]);
        assert_eq!(used(&files, "user/exported"), ["mesh"]);
        assert!(used(&files, "user").is_empty(), "a re-export is no use");
    }

    #[test]
    fn circles_are_found_whole() {
        let name = |c: char| vec![c.to_string()];
        let edges = ["ab", "bc", "ca", "cd", "de", "ed", "f"].map(|e| e.chars().collect::<Vec<_>>());
        let mut map: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
        for edge in &edges {
            map.entry(name(edge[0])).or_default().extend(edge.get(1).map(|c| name(*c)));
        }
        let sizes: Vec<usize> = circles(&map).iter().map(Vec::len).collect();
        assert_eq!(sizes, [3, 2]);
    }
}

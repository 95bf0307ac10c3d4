//! Names of the places of parts: what a usage is called, or its product where the usage's name tells nothing.
//!
//! Writers often leave the name of a NEXT_ASSEMBLY_USAGE_OCCURRENCE blank, or give the same one to all.

use super::relations::usage_attributes;
use crate::step::part21::File;
use rustc_hash::{FxHashMap, FxHashSet};

/// What a common translator calls every usage.
const DEFAULT_NAME: &str = "Next assembly relationship";

/// A child of a product: its definition, what its place is called, and the `#id` of the usage.
pub(super) struct Usage {
    pub(super) child: u64,
    pub(super) name: String,
    pub(super) id: u64,
}

/// Returns the product's name, or else its id, without blanks around it; empty where it cannot be found: what uses it names it then.
pub(super) fn product_name(file: &File<'_>, definition: u64) -> String {
    let product = || {
        let definition = file.entity(definition)?;
        // A subtype, such as one with documents, writes the same attributes first.
        let own = definition.attributes("PRODUCT_DEFINITION", 0).unwrap_or_else(|| definition.args());
        let formation = own.entity(2)?;
        let product = formation.args().entity(2)?;
        let args = product.attributes("PRODUCT", 0)?;
        [1, 0].into_iter().filter_map(|i| args.text(i)).map(|n| n.trim().to_owned()).find(|n| !n.is_empty())
    };
    product().unwrap_or_default()
}

/// Names the usages in one product. A name that is blank, a writer's default, or given to several children is none: then the child's
/// product names the usage, numbered from 1 where it is used several times, or else the usage's description or id does.
pub(super) fn name_usages(file: &File<'_>, usages: &mut [Usage]) {
    let text = |usage: &Usage, i: usize| {
        let args = file.entity(usage.id).and_then(usage_attributes);
        args.map_or_else(String::new, |a| a.name(i).trim().to_owned())
    };
    let mut children: FxHashMap<String, FxHashSet<u64>> = FxHashMap::default();
    for usage in usages.iter_mut() {
        usage.name = text(usage, 1);
        children.entry(usage.name.clone()).or_default().insert(usage.child);
    }
    let mut unnamed: FxHashMap<String, Vec<usize>> = FxHashMap::default();
    for (k, usage) in usages.iter_mut().enumerate() {
        let tells = !usage.name.is_empty() && usage.name != DEFAULT_NAME && children[&usage.name].len() == 1;
        if !tells {
            let others = [product_name(file, usage.child), text(usage, 2)];
            usage.name = others.into_iter().find(|n| !n.is_empty()).unwrap_or_else(|| text(usage, 0));
            unnamed.entry(usage.name.clone()).or_default().push(k);
        }
    }
    // A selector must be able to mean one of several places.
    let repeated = unnamed.into_iter().filter(|(name, places)| !name.is_empty() && places.len() > 1);
    for (name, places) in repeated {
        for (number, k) in places.into_iter().enumerate() {
            usages[k].name = format!("{name}:{}", number + 1);
        }
    }
}

/// Returns what the occurrences of these usages are called in paths, by the `#id` of the usage: by its name, or by its product where that
/// tells nothing.
pub(super) fn occurrence_names<'u>(
    file: &File<'_>,
    usages: impl Iterator<Item = &'u Usage>,
) -> FxHashMap<u64, String> {
    let name = |usage: &Usage| match usage.name.as_str() {
        // `=>[0:1:1:2]` is a label of OpenCASCADE's document, not a name.
        own if own.is_empty() || own.starts_with("=>[") => product_name(file, usage.child),
        own => own.to_owned(),
    };
    usages.map(|usage| (usage.id, name(usage))).collect()
}

/// Returns the path of what these entities own, the outermost first: the names of the usages among them, joined by `/`.
pub(super) fn occurrence_path(names: &FxHashMap<u64, String>, owners: &[u64]) -> String {
    let path: Vec<&str> = owners.iter().filter_map(|id| names.get(id).map(String::as_str)).collect();
    path.join("/")
}

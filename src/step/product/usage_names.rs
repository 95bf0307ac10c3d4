//! Names of the places of parts: what a usage is called, or its product where the usage's name says nothing.
//!
//! Writers often leave the name of a NEXT_ASSEMBLY_USAGE_OCCURRENCE blank, or give the same one to all.

use super::relations::usage_attributes;
use crate::math::Frame;
use crate::step::part21::File;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Name that a common translator gives every usage.
const DEFAULT_NAME: &str = "Next assembly relationship";

/// A child of a product: its definition, what its place is called, the `#id` of the usage, and where it stands.
pub(super) struct Usage {
    pub(super) child: u64,
    pub(super) name: String,
    pub(super) id: u64,
    pub(super) placement: UsagePlacement,
}

/// Where a usage puts its child in the parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum UsagePlacement {
    /// The file does not say: where the parent stands, unless a representation of the parent places the child.
    Unstated,
    /// The file says it in a form that cannot be read.
    Unreadable,
    /// In the coordinates of the parent.
    Stated(Frame),
}

/// Name of a placed representation, and what places it.
#[derive(Clone, Copy)]
pub(super) struct Occurrence<'o> {
    /// Name of the usage, empty when it had none.
    pub(super) name: &'o str,
    /// Names of the usages from the outermost down to its own, joined by `/`; of those without a name that of their product. `None` where
    /// no usage places it.
    pub(super) path: Option<&'o str>,
    /// Name of the product, empty when it had none.
    pub(super) product: &'o str,
    /// Entities that may carry a style for it, the outermost first.
    pub(super) owners: &'o [u64],
}

impl Occurrence<'_> {
    /// What no usage places, and what has no name.
    pub(super) const ROOT: Self = Self { name: "", path: None, product: "", owners: &[] };
}

/// Names of products by their definitions; each is read once.
#[derive(Default)]
pub(super) struct ProductNames(FxHashMap<u64, Arc<str>>);

impl ProductNames {
    /// Returns the product's name, or else its id, without blanks around it; empty where it cannot be found: what uses it names it then.
    pub(super) fn name(&mut self, file: &File<'_>, definition: u64) -> Arc<str> {
        self.0.entry(definition).or_insert_with(|| product_name(file, definition).into()).clone()
    }
}

/// Returns the name of a product, as [`ProductNames::name`].
fn product_name(file: &File<'_>, definition: u64) -> String {
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
pub(super) fn name_usages(file: &File<'_>, products: &mut ProductNames, usages: &mut [Usage]) {
    let text = |usage: &Usage, i: usize| {
        let args = file.entity(usage.id).and_then(usage_attributes);
        args.map_or_else(String::new, |a| a.name(i).trim().to_owned())
    };
    usages.iter_mut().for_each(|usage| usage.name = text(usage, 1));
    // The child that a name is given to; `None` for several.
    let mut children: FxHashMap<&str, Option<u64>> = FxHashMap::default();
    for usage in &*usages {
        let child = children.entry(&usage.name).or_insert(Some(usage.child));
        *child = child.filter(|c| *c == usage.child);
    }
    let tells = |u: &Usage| !u.name.is_empty() && u.name != DEFAULT_NAME && children[u.name.as_str()].is_some();
    let unnamed: Vec<usize> = (0..usages.len()).filter(|&k| !tells(&usages[k])).collect();
    for &k in &unnamed {
        let usage = &mut usages[k];
        let product = products.name(file, usage.child);
        let others = [product.to_string(), text(usage, 2)];
        usage.name = others.into_iter().find(|n| !n.is_empty()).unwrap_or_else(|| text(usage, 0));
    }
    // A selector must be able to mean one of several places.
    let mut places: FxHashMap<&str, Vec<usize>> = FxHashMap::default();
    unnamed.iter().for_each(|&k| places.entry(&usages[k].name).or_default().push(k));
    let repeated = places.into_iter().filter(|(name, places)| !name.is_empty() && places.len() > 1);
    let repeated: Vec<Vec<usize>> = repeated.map(|(_, places)| places).collect();
    for (number, k) in repeated.iter().flat_map(|places| (1..).zip(places)) {
        usages[*k].name += &format!(":{number}");
    }
}

/// Returns what the occurrence of a usage is called in paths: by its name, or by its product where that says nothing.
pub(super) fn name_in_path<'u>(usage: &'u Usage, product: &'u str) -> &'u str {
    // `=>[0:1:1:2]` is a label of OpenCASCADE's document, not a name.
    if usage.name.is_empty() || usage.name.starts_with("=>[") { product } else { &usage.name }
}

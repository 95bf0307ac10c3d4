//! Which module takes names from which: paths in code and imports, re-exports followed to the file that defines the name.

use super::source::{SourceFile, Token, closing};
use std::collections::{BTreeMap, BTreeSet};

pub(crate) type Module = Vec<String>;

/// A name that a module takes from another.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Use {
    /// The module as the path spells it.
    pub(crate) named: Module,
    /// The module whose file defines the name.
    pub(crate) defined: Module,
}

/// One leaf of a `use` declaration.
struct Import {
    path: Vec<String>,
    /// What it is called here.
    alias: String,
    is_public: bool,
}

#[derive(Default)]
struct Contents {
    definitions: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in code, outside `use`.
    paths: Vec<Vec<String>>,
}

/// The modules of a crate with what each defines, imports and names.
pub(crate) struct Graph {
    modules: BTreeMap<Module, Contents>,
}

impl Graph {
    pub(crate) fn new(files: &[SourceFile]) -> Self {
        Self { modules: files.iter().map(|f| (f.module.clone(), contents(&f.tokens))).collect() }
    }

    /// What each module takes from others. Re-exports are no use of their own: they count where somebody takes the name.
    pub(crate) fn uses(&self) -> BTreeMap<Module, BTreeSet<Use>> {
        self.modules.iter().map(|(module, contents)| (module.clone(), self.uses_of(module, contents))).collect()
    }

    fn uses_of(&self, module: &Module, contents: &Contents) -> BTreeSet<Use> {
        let mut found = BTreeSet::new();
        let mut aliases: BTreeMap<&str, Module> = BTreeMap::new();
        for import in &contents.imports {
            match self.resolve(module, &import.path, 0) {
                // An import of a module makes its name known; the use is where a path goes through it.
                Some((imported, None)) => {
                    aliases.insert(&import.alias, imported.defined);
                }
                Some((taken, Some(_))) if !import.is_public => {
                    found.insert(taken);
                }
                _ => {}
            }
        }
        for path in &contents.paths {
            let through_alias = aliases.get(path[0].as_str()).map(|base| {
                let absolute = base.iter().chain(&path[1..]).cloned();
                std::iter::once("crate".to_owned()).chain(absolute).collect::<Vec<_>>()
            });
            let resolved = match through_alias {
                Some(absolute) => self.resolve(&Module::new(), &absolute, 0),
                None => self.resolve(module, path, 0),
            };
            if let Some((taken, Some(_))) = resolved {
                found.insert(taken);
            }
        }
        found.retain(|u| u.defined != *module || u.named != *module);
        found
    }

    /// The module and the item that a path names, seen from `here`; `None` for paths into other crates.
    fn resolve(&self, here: &Module, path: &[String], depth: usize) -> Option<(Use, Option<String>)> {
        // Longer chains of re-exports than this are circles.
        const LONGEST_CHAIN: usize = 8;
        if depth > LONGEST_CHAIN {
            return None;
        }
        let mut base = here.clone();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => {
                base.clear();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|s| s == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            first => {
                let child: Module = here.iter().cloned().chain([first.to_owned()]).collect();
                if !self.modules.contains_key(&child) {
                    return None;
                }
            }
        }
        while let Some(segment) = rest.first() {
            let child: Module = base.iter().cloned().chain([segment.clone()]).collect();
            if !self.modules.contains_key(&child) {
                break;
            }
            base = child;
            rest = &rest[1..];
        }
        let item = match rest.first() {
            None => return Some((Use { named: base.clone(), defined: base }, None)),
            Some(word) if word == "self" => return Some((Use { named: base.clone(), defined: base }, None)),
            Some(item) => item,
        };
        let contents = self.modules.get(&base)?;
        if !contents.definitions.contains(item)
            && let Some(import) = contents.imports.iter().find(|i| i.alias == *item)
            && let Some((origin, name)) = self.resolve(&base, &import.path, depth + 1)
        {
            return Some((Use { named: base, defined: origin.defined }, name.or_else(|| rest.get(1).cloned())));
        }
        Some((Use { named: base.clone(), defined: base }, Some(item.clone())))
    }
}

/// What a file defines at its top level, imports anywhere and names in its code.
fn contents(tokens: &[Token]) -> Contents {
    let mut found = Contents::default();
    let mut depth = 0;
    let mut at = 0;
    while at < tokens.len() {
        match &tokens[at] {
            Token::Mark('{') => depth += 1,
            Token::Mark('}') => depth -= 1,
            Token::Word(word) if word == "use" && !tokens.get(at + 1).is_some_and(|t| t.is("<")) => {
                let end = (at..tokens.len()).find(|k| tokens[*k].is(";")).unwrap_or(tokens.len());
                let is_public = at > 0 && (tokens[at - 1].is("pub") || tokens[at - 1].is(")"));
                leaves(&tokens[at + 1..end], &mut Vec::new(), is_public, &mut found.imports);
                at = end;
            }
            Token::Word(word) if depth == 0 && defines(word) => {
                let name = tokens[at + 1..].iter().take(3).filter_map(Token::word).find(|w| !defines(w));
                found.definitions.extend(name.map(str::to_owned));
                // Its own name is no path.
                at += 1;
            }
            Token::Word(first) if tokens.get(at + 1) == Some(&Token::Scope) => {
                let mut path = vec![first.clone()];
                while tokens.get(at + 1) == Some(&Token::Scope)
                    && let Some(word) = tokens.get(at + 2).and_then(Token::word)
                {
                    path.push(word.to_owned());
                    at += 2;
                }
                if path.len() > 1 {
                    found.paths.push(path);
                }
            }
            _ => {}
        }
        at += 1;
    }
    found
}

fn defines(word: &str) -> bool {
    ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "macro_rules", "mut"].contains(&word)
}

/// The leaves of a use tree: `a::{b, c::d as e}` is `a::b` and `a::c::d` called `e`.
fn leaves(tree: &[Token], prefix: &mut Vec<String>, is_public: bool, out: &mut Vec<Import>) {
    let depth = prefix.len();
    let mut alias = None;
    let mut at = 0;
    while at < tree.len() {
        match &tree[at] {
            Token::Word(word) if word == "as" => {
                alias = tree.get(at + 1).and_then(Token::word).map(str::to_owned);
                at += 1;
            }
            Token::Word(word) => prefix.push(word.clone()),
            Token::Mark('*') => prefix.push("*".to_owned()),
            Token::Mark('{') => {
                let end = closing(tree, at);
                for branch in branches(&tree[at + 1..end]) {
                    leaves(branch, prefix, is_public, out);
                }
                prefix.truncate(depth);
                return;
            }
            _ => {}
        }
        at += 1;
    }
    let own = if prefix.last().is_some_and(|w| w == "self") {
        prefix.len().checked_sub(2)
    } else {
        prefix.len().checked_sub(1)
    };
    if let Some(last) = own.and_then(|k| prefix.get(k)) {
        out.push(Import { alias: alias.unwrap_or_else(|| last.clone()), path: prefix.clone(), is_public });
    }
    prefix.truncate(depth);
}

/// The parts between the commas of a group.
fn branches(group: &[Token]) -> Vec<&[Token]> {
    let mut parts = Vec::new();
    let mut depth = 0;
    let mut start = 0;
    for (at, token) in group.iter().enumerate() {
        match token {
            Token::Mark('{') => depth += 1,
            Token::Mark('}') => depth -= 1,
            Token::Mark(',') if depth == 0 => {
                parts.push(&group[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&group[start..]);
    parts.retain(|p| !p.is_empty());
    parts
}

/// Groups of more than one module of which each can be reached from each other (Tarjan 1972), the largest first.
pub(crate) fn circles(edges: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<Vec<Module>> {
    let mut search = Search { edges, order: BTreeMap::new(), stack: Vec::new(), circles: Vec::new() };
    for module in edges.keys() {
        if !search.order.contains_key(module) {
            search.visit(module);
        }
    }
    let mut circles = search.circles;
    circles.sort_by_key(|c| std::cmp::Reverse(c.len()));
    circles
}

struct Search<'a> {
    edges: &'a BTreeMap<Module, BTreeSet<Module>>,
    /// When a module was first met; `None` once its circle is known.
    order: BTreeMap<&'a Module, Option<usize>>,
    stack: Vec<&'a Module>,
    circles: Vec<Vec<Module>>,
}

impl<'a> Search<'a> {
    /// The earliest module on the stack that can be reached from here.
    fn visit(&mut self, module: &'a Module) -> usize {
        let met = self.order.len();
        let depth = self.stack.len();
        self.order.insert(module, Some(met));
        self.stack.push(module);
        let mut earliest = met;
        for next in self.edges.get(module).into_iter().flatten() {
            let Some((next, _)) = self.edges.get_key_value(next) else { continue };
            match self.order.get(next) {
                None => earliest = earliest.min(self.visit(next)),
                Some(Some(order)) => earliest = earliest.min(*order),
                Some(None) => {}
            }
        }
        if earliest == met {
            let circle: Vec<&Module> = self.stack.drain(depth..).collect();
            for member in &circle {
                self.order.insert(member, None);
            }
            if circle.len() > 1 {
                self.circles.push(circle.into_iter().cloned().collect());
            }
        }
        earliest
    }
}

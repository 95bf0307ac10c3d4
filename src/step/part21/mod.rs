//! The Part 21 clear text: statements, records and values, without knowing any schema.
//!
//! One pass over the bytes fills an arena of 16-byte [`Value`]s; names and texts stay spans of the source. Source:
//! ISO 10303-21:2016. Guarantee: a statement that cannot be read costs that statement alone and is listed with
//! its line; nesting, memory and time are bounded by the length of the input. Known weakness: one thread, and
//! sources beyond 4 GiB are refused, because spans are 32 bits.

mod blanks;
mod capitals;
mod faults;
mod index;
mod number;
mod parser;
mod sections;
mod short_names;
mod span;
mod text;

pub(super) use capitals::in_capitals;
pub(super) use parser::parse;

use index::{Index, Instance, Kinds};
use short_names::Keyword;
use span::Span;
use std::borrow::Cow;

/// Reals below this that stand for a count are exact: 2⁵³ is 9e15.
const EXACT_COUNT: f64 = 1e15;

/// One parameter of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    /// `#12`.
    Ref(u64),
    /// An integer that fits.
    Integer(i64),
    /// A real, or an integer that does not fit 64 bits.
    Real(f64),
    /// `'…'`, still encoded.
    Text(Span),
    /// `.NAME.`.
    Enum(Span),
    /// `"…"`.
    Binary,
    /// `( … )`, a range of the arena.
    List(Span),
    /// `NAME( … )`, an index into the table of typed values.
    Typed(u32),
    /// `$`.
    Null,
    /// `*`.
    Derived,
}

/// A name with its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    name: Keyword,
    values: Span,
}

/// A statement that was not understood and was skipped.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    /// Line in the file, from 1.
    pub(super) line: usize,
    /// The `#id` of its instance, when it had come that far.
    pub(super) id: Option<u64>,
    /// The fault.
    pub(super) what: &'static str,
}

/// A parsed file.
#[derive(Debug)]
pub(super) struct File<'a> {
    source: &'a [u8],
    values: Vec<Value>,
    typed: Vec<Record>,
    records: Vec<Record>,
    instances: Vec<Instance>,
    header: Vec<Record>,
    index: Index,
    kinds: Kinds<'a>,
    /// The first statements that were skipped.
    pub(super) faults: Vec<Fault>,
    /// How many were skipped.
    pub(super) fault_count: usize,
    /// Whether the word stands in it that ends a file: one that was cut off lacks it.
    pub(super) is_ended: bool,
}

impl<'a> File<'a> {
    fn bytes(&self, span: Span) -> &'a [u8] {
        &self.source[span.range()]
    }

    /// Returns the long name of a record.
    fn name(&self, record: &Record) -> &'a [u8] {
        record.name.bytes(self.source)
    }

    /// Returns the instance with an id; `None` when the file has none such.
    pub(super) fn entity(&self, id: u64) -> Option<Entity<'_, 'a>> {
        self.index.position(id).map(|position| self.instance(position as usize))
    }

    /// Returns the instance at a place in the file's order.
    fn instance(&self, position: usize) -> Entity<'_, 'a> {
        let i = self.instances[position];
        Entity { file: self, id: i.id, records: &self.records[i.first as usize..(i.first + i.count) as usize] }
    }

    /// Returns the name of the instance with an id, empty when the file has none such.
    pub(super) fn entity_name(&self, id: u64) -> String {
        self.entity(id).map_or_else(String::new, |e| e.name())
    }

    /// Returns all instances in the order of the file.
    pub(super) fn entities(&self) -> impl Iterator<Item = Entity<'_, 'a>> {
        (0..self.instances.len()).map(|i| self.instance(i))
    }

    /// Returns the instances with a record of one of these names, in the order of the file.
    pub(super) fn entities_named(&self, names: &[&str]) -> impl Iterator<Item = Entity<'_, 'a>> {
        self.entities_of_kind(|name| names.contains(&name))
    }

    /// Returns the instances with a record whose name is meant, in the order of the file; each name is tested once.
    pub(super) fn entities_of_kind(&self, is_meant: impl Fn(&str) -> bool) -> impl Iterator<Item = Entity<'_, 'a>> {
        let positions = self.kinds.positions(|name| std::str::from_utf8(name).is_ok_and(&is_meant));
        positions.into_iter().map(|position| self.instance(position as usize))
    }

    /// Whether some entity has a name in small letters, by which nothing finds it.
    pub(super) fn has_small_names(&self) -> bool {
        self.entities_of_kind(|name| name.bytes().any(|c| c.is_ascii_lowercase())).next().is_some()
    }

    /// Returns the parameters of the first header record of this name, such as `FILE_SCHEMA`.
    pub(super) fn header(&self, name: &str) -> Option<Args<'_, 'a>> {
        let record = self.header.iter().find(|r| self.name(r).eq_ignore_ascii_case(name.as_bytes()))?;
        Some(self.args(record.values))
    }

    /// Returns the ids that are referred to but that no instance has, each once, ascending.
    pub(super) fn missing_ids(&self) -> Vec<u64> {
        let ids = self.values.iter().filter_map(|value| if let Value::Ref(id) = value { Some(*id) } else { None });
        let mut missing: Vec<u64> = ids.filter(|id| self.index.position(*id).is_none()).collect();
        missing.sort_unstable();
        missing.dedup();
        missing
    }

    fn args(&self, span: Span) -> Args<'_, 'a> {
        Args { file: self, values: &self.values[span.range()] }
    }
}

/// An instance of a file.
#[derive(Clone, Copy)]
pub(super) struct Entity<'f, 'a> {
    file: &'f File<'a>,
    /// The `#id`.
    pub(super) id: u64,
    records: &'f [Record],
}

impl<'f, 'a> Entity<'f, 'a> {
    /// Returns the name; for a complex instance, the names of its records joined by `+`.
    pub(super) fn name(&self) -> String {
        let names = self.records.iter().map(|r| String::from_utf8_lossy(self.file.name(r)));
        names.collect::<Vec<_>>().join("+")
    }

    /// Returns the name of a simple instance; empty for a complex one, which has several.
    pub(super) fn keyword(&self) -> &'a str {
        match self.records {
            [r] => std::str::from_utf8(self.file.name(r)).unwrap_or(""),
            _ => "",
        }
    }

    /// Returns the names of all records.
    pub(super) fn keywords(&self) -> impl Iterator<Item = &'a str> + use<'f, 'a> {
        let file = self.file;
        self.records.iter().map(move |r| std::str::from_utf8(file.name(r)).unwrap_or(""))
    }

    /// Whether one of the records has this name.
    pub(super) fn is_a(&self, name: &str) -> bool {
        self.records.iter().any(|r| self.file.name(r) == name.as_bytes())
    }

    /// Whether one of the records has one of these names.
    pub(super) fn is_one_of(&self, names: &[&str]) -> bool {
        names.iter().any(|name| self.is_a(name))
    }

    /// Returns the parameters that the record `name` adds: all of them in a complex instance, those after the `inherited` first ones in a
    /// simple instance. `None` without such a record, empty where it has no more than are inherited.
    pub(super) fn attributes(&self, name: &str, inherited: usize) -> Option<Args<'f, 'a>> {
        let record = self.records.iter().find(|r| self.file.name(r) == name.as_bytes())?;
        let args = self.file.args(record.values);
        // A complex instance has each type's attributes in its own record; a simple one writes those of its
        // supertypes first.
        let skip = if self.records.len() == 1 { inherited } else { 0 };
        Some(Args { values: args.values.get(skip..).unwrap_or(&[]), ..args })
    }

    /// Returns all parameters of a simple instance, or of the first record of a complex one.
    pub(super) fn args(&self) -> Args<'f, 'a> {
        match self.records.first() {
            Some(r) => self.file.args(r.values),
            None => Args { file: self.file, values: &[] },
        }
    }

    /// Returns the parameters of every record.
    pub(super) fn all_args(&self) -> impl Iterator<Item = Args<'f, 'a>> + use<'f, 'a> {
        let file = self.file;
        self.records.iter().map(move |r| file.args(r.values))
    }
}

/// A list of parameters.
#[derive(Clone, Copy)]
pub(super) struct Args<'f, 'a> {
    file: &'f File<'a>,
    values: &'f [Value],
}

impl<'f, 'a> Args<'f, 'a> {
    /// Returns the number of parameters.
    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns the parameter at a position; `None` beyond the last.
    pub(super) fn value(&self, i: usize) -> Option<Value> {
        self.values.get(i).copied()
    }

    /// Returns a number, whether written as an integer or a real, also inside a typed parameter; `None` for anything else.
    pub(super) fn real(&self, i: usize) -> Option<f64> {
        match self.value(i)? {
            Value::Real(x) => Some(x),
            Value::Integer(x) => Some(x as f64),
            Value::Typed(_) => self.typed(i)?.1.real(0),
            // `LENGTH_MEASURE(1.0)` is a number too: selects of measures name their type.
            _ => None,
        }
    }

    /// Returns a non-negative integer, also when written as a real; `None` for anything else.
    pub(super) fn count(&self, i: usize) -> Option<usize> {
        match self.value(i)? {
            Value::Integer(x) => usize::try_from(x).ok(),
            // Some writers give integers with a point.
            Value::Real(x) if x >= 0.0 && x.fract() == 0.0 && x < EXACT_COUNT => Some(x as usize),
            _ => None,
        }
    }

    /// Returns the id of the instance that parameter `i` refers to; `None` for what is no reference.
    pub(super) fn id(&self, i: usize) -> Option<u64> {
        match self.value(i)? {
            Value::Ref(id) => Some(id),
            _ => None,
        }
    }

    /// Returns the instance that is referred to; `None` for what is no reference or leads nowhere.
    pub(super) fn entity(&self, i: usize) -> Option<Entity<'f, 'a>> {
        self.file.entity(self.id(i)?)
    }

    /// Returns a decoded text, also inside a typed parameter; `None` for anything else.
    pub(super) fn text(&self, i: usize) -> Option<String> {
        match self.value(i)? {
            Value::Text(span) => Some(text::decode(self.file.bytes(span))),
            Value::Typed(_) => self.typed(i)?.1.text(0),
            _ => None,
        }
    }

    /// Returns a decoded text, empty where the file gives none, as the schemas allow.
    pub(super) fn name(&self, i: usize) -> String {
        self.text(i).unwrap_or_default()
    }

    /// Returns an enumeration value in capitals, without its dots; `None` for anything else.
    pub(super) fn word(&self, i: usize) -> Option<Cow<'a, str>> {
        let Value::Enum(span) = self.value(i)? else { return None };
        let written = std::str::from_utf8(self.file.bytes(span)).ok()?;
        // Part 21 has capitals alone; a few writers give small letters.
        let is_small = written.bytes().any(|c| c.is_ascii_lowercase());
        Some(if is_small { Cow::Owned(written.to_ascii_uppercase()) } else { Cow::Borrowed(written) })
    }

    /// Returns a truth value, `.T.` or `.F.`; `None` for anything else, `.U.` too.
    pub(super) fn flag(&self, i: usize) -> Option<bool> {
        match &*self.word(i)? {
            "T" | "TRUE" => Some(true),
            "F" | "FALSE" => Some(false),
            _ => None,
        }
    }

    /// Returns the parameters of a list; empty when the parameter is no list.
    pub(super) fn list(&self, i: usize) -> Args<'f, 'a> {
        match self.value(i) {
            Some(Value::List(span)) => self.file.args(span),
            _ => Args { file: self.file, values: &[] },
        }
    }

    /// Returns a typed parameter: its name and what it holds; `None` for anything else.
    pub(super) fn typed(&self, i: usize) -> Option<(&'a str, Args<'f, 'a>)> {
        match self.value(i)? {
            Value::Typed(t) => {
                // A typed value is a record without an id: a name and what stands in its brackets.
                let record = self.file.typed[t as usize];
                Some((std::str::from_utf8(self.file.name(&record)).ok()?, self.file.args(record.values)))
            }
            _ => None,
        }
    }

    /// Returns all numbers of the list; `None` when one is no number.
    pub(super) fn reals(&self) -> Option<Vec<f64>> {
        (0..self.len()).map(|i| self.real(i)).collect()
    }

    /// Returns the ids of all references of the list; `None` when an entry is no reference.
    pub(super) fn refs(&self) -> Option<Vec<u64>> {
        (0..self.len()).map(|i| self.id(i)).collect()
    }

    /// Returns the ids of the references of the list; what is no reference is left out.
    pub(super) fn ids(&self) -> Vec<u64> {
        (0..self.len()).filter_map(|i| self.id(i)).collect()
    }

    /// Appends every id in the list, in lists inside it and in typed parameters to `found`.
    pub(super) fn deep_ids(&self, found: &mut Vec<u64>) {
        for (i, value) in self.values.iter().enumerate() {
            match value {
                Value::Ref(id) => found.push(*id),
                Value::List(_) => self.list(i).deep_ids(found),
                Value::Typed(_) => {
                    if let Some((_, inner)) = self.typed(i) {
                        inner.deep_ids(found)
                    }
                }
                _ => {}
            }
        }
    }
}

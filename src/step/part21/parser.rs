//! The one pass over the text: statements into the arena of values, faults noted and stepped over.

use super::blanks::skip_blanks;
use super::faults::{Faults, next_statement, stray_length};
use super::index::{Index, Instance, Kinds};
use super::number::{TOO_LARGE, number, unsigned};
use super::sections::{is_section_end, section_besides_data, signature_length};
use super::short_names::Keyword;
use super::span::Span;
use super::{File, Record, Value};
use crate::step::{Error, ErrorKind};

/// Deepest nesting of lists; schemas need 3, real files have shown 4.
const MAX_DEPTH: usize = 32;
/// Stands for the byte behind the last one; a NUL in the text is an unexpected byte as well.
const END: u8 = 0;

/// Parses a whole file, `name` being for messages. Fails only for 4 GiB and more, and for bytes that are no Part 21 file at all.
pub(in crate::step) fn parse<'a>(name: &str, source: &'a [u8]) -> Result<File<'a>, Error> {
    if u32::try_from(source.len()).is_err() {
        return Err(Error::new(ErrorKind::TooLarge { file: name.into() }));
    }
    if source.is_empty() {
        return Err(Error::new(ErrorKind::Empty { file: name.into() }));
    }
    let mut p = Parser {
        source,
        at: if source.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 },
        // What CAD systems write: a value in a dozen bytes, an instance in some sixty; a wrong guess costs a copy of the tables.
        values: Vec::with_capacity(source.len() / 12),
        typed: Vec::new(),
        records: Vec::with_capacity(source.len() / 64),
        instances: Vec::with_capacity(source.len() / 64),
        header: Vec::new(),
        stack: Vec::new(),
        faults: Faults::new(source),
        rewound: 0,
        open_comment: None,
        is_ended: false,
    };
    let marked = p.statements();
    // A missing first line is accepted in a file that continues with instances.
    if !marked && p.instances.is_empty() {
        return Err(Error::new(ErrorKind::NotStep { file: name.into() }));
    }
    if let Some(start) = p.open_comment {
        p.faults.note(start, None, "a comment that begins here does not end");
    }
    let (index, repeated) = Index::take_repeated(&mut p.instances);
    for instance in repeated {
        let start = p.records[instance.first as usize].name.start as usize;
        p.faults.note(
            start,
            Some(instance.id),
            "its number stands for an earlier instance already; this one is left out",
        );
    }
    let names = (0u32..).zip(&p.instances).flat_map(|(position, i)| {
        let records = &p.records[i.first as usize..][..i.count as usize];
        records.iter().map(move |record| (record.name.bytes(source), position))
    });
    let kinds = Kinds::new(names);
    Ok(File {
        source,
        values: p.values,
        typed: p.typed,
        records: p.records,
        instances: p.instances,
        header: p.header,
        index,
        kinds,
        faults: p.faults.first,
        fault_count: p.faults.count,
        is_ended: p.is_ended,
    })
}

struct Parser<'a> {
    source: &'a [u8],
    at: usize,
    values: Vec<Value>,
    typed: Vec<Record>,
    records: Vec<Record>,
    instances: Vec<Instance>,
    header: Vec<Record>,
    /// Values of the lists that are still open.
    stack: Vec<Value>,
    faults: Faults<'a>,
    /// Bytes read again because of faults; bounded, so that time stays linear in the input.
    rewound: usize,
    /// Where the first comment begins that does not end.
    open_comment: Option<usize>,
    /// See [`File::is_ended`].
    is_ended: bool,
}

type Parsed<T> = Result<T, &'static str>;

impl Parser<'_> {
    /// Reads all statements; returns whether the file said that it is Part 21.
    fn statements(&mut self) -> bool {
        let mut marked = false;
        loop {
            let c = self.peek();
            let start = self.at;
            match c {
                END if self.at >= self.source.len() => return marked,
                b'#' => {
                    let (values, records, typed) = (self.values.len(), self.records.len(), self.typed.len());
                    let mut id = None;
                    if let Err(what) = self.instance(&mut id) {
                        // Of a damaged instance nothing stays; reading goes on behind it.
                        self.values.truncate(values);
                        self.records.truncate(records);
                        self.typed.truncate(typed);
                        self.fault(start, id, what);
                    }
                }
                c if c.is_ascii_alphabetic() => {
                    let name = Keyword::new(self.source, self.identifier());
                    marked |= name.bytes(self.source).eq_ignore_ascii_case(b"ISO-10303-21");
                    if name.bytes(self.source).eq_ignore_ascii_case(b"END-ISO-10303-21") {
                        self.finish(start);
                        return marked;
                    }
                    // A long word at the very beginning is some other kind of file.
                    if !marked && self.instances.is_empty() && self.at - start > 64 {
                        return false;
                    }
                    if let Some(section) = section_besides_data(name.bytes(self.source), &self.source[self.at..]) {
                        for (at, id) in section.elsewhere {
                            self.faults.note(
                                self.at + at,
                                Some(id),
                                "stands in another file, which is not read with this one",
                            );
                        }
                        self.at += section.length;
                        continue;
                    }
                    if self.peek() == b'(' {
                        let outcome = self.list(0).map(|values| self.header.push(Record { name, values }));
                        if let Err(what) = outcome.and_then(|()| self.end()) {
                            self.fault(start, None, what);
                        }
                    } else if let Err(what) = self.end() {
                        if is_section_end(name.bytes(self.source)) {
                            // The next word may end the file.
                            self.faults.note(start, None, what);
                        } else {
                            self.pass_stray(start, what);
                        }
                    }
                }
                b';' => self.at += 1,
                // Section delimiters of edition 3, stray bytes.
                _ => {
                    if !marked && self.instances.is_empty() {
                        return false;
                    }
                    self.pass_stray(start, "a statement starts with neither '#' nor a letter");
                }
            }
        }
    }

    /// Reads on from the word at `start` that ends the file: its ';' and signatures. Anything else is noted and left, as a second file is.
    fn finish(&mut self, start: usize) {
        self.is_ended = true;
        if let Err(what) = self.end() {
            self.faults.note(start, None, what);
        }
        while self.peek() != END {
            let Some(length) = signature_length(&self.source[self.at..]) else {
                self.faults.note(self.at, None, "text behind the end of the file is not read");
                return;
            };
            self.at += length;
        }
    }

    /// Notes a fault of the statement that began at `start`, and goes on behind that statement.
    #[cold]
    fn fault(&mut self, start: usize, id: Option<u64>, what: &'static str) {
        self.stack.clear();
        self.faults.note(start, id, what);
        let next = next_statement(self.source, start, self.at);
        self.rewound += self.at.saturating_sub(next);
        // More than 8 passes over the file: it is damaged on purpose.
        self.at = if self.rewound > 8 * self.source.len() { self.source.len() } else { next };
    }

    /// Notes bytes from `start` on that belong to no statement, and goes on where the next one may start.
    #[cold]
    fn pass_stray(&mut self, start: usize, what: &'static str) {
        self.faults.note(start, None, what);
        self.at += stray_length(&self.source[self.at..]);
    }

    /// Skips whitespace, comments and print directives.
    fn skip(&mut self) {
        let (next, open_comment) = skip_blanks(self.source, self.at);
        self.at = next;
        self.open_comment = self.open_comment.or(open_comment);
    }

    /// Skips blanks, comments and print directives and returns the next byte without taking it; [`END`] at the end.
    fn peek(&mut self) -> u8 {
        // Most bytes are no blanks: the test before the call is what reading costs.
        if let Some(&c) = self.source.get(self.at)
            && c > b' '
            && c != b'/'
            && c != b'\\'
        {
            return c;
        }
        self.skip();
        self.source.get(self.at).copied().unwrap_or(END)
    }

    /// Takes the ';' at the end of a statement; fails without one.
    fn end(&mut self) -> Parsed<()> {
        if self.peek() != b';' {
            return Err("';' is missing at the end of the statement");
        }
        self.at += 1;
        Ok(())
    }

    /// Takes a name of letters, digits, '_', '-' and '!'; empty where none stands here.
    fn identifier(&mut self) -> Span {
        let start = self.at;
        while let Some(c) = self.source.get(self.at) {
            if !(c.is_ascii_alphanumeric() || matches!(c, b'_' | b'-' | b'!')) {
                break;
            }
            self.at += 1;
        }
        Span { start: start as u32, len: (self.at - start) as u32 }
    }

    /// Reads the digits of an id behind '#'; numbers beyond 64 bits are damage and become [`TOO_LARGE`]. Fails where there is no digit.
    fn unsigned(&mut self) -> Parsed<u64> {
        let (id, next) = unsigned(self.source, self.at).ok_or("digits are missing behind '#'")?;
        self.at = next;
        Ok(id)
    }

    /// Reads an instance, simple or complex, from its '#' on; sets `id_out` once its number is known. A missing ';' before '#' is forgiven.
    fn instance(&mut self, id_out: &mut Option<u64>) -> Parsed<()> {
        self.at += 1;
        let id = self.unsigned()?;
        if id == TOO_LARGE {
            return Err("its number is too large");
        }
        *id_out = Some(id);
        if self.peek() != b'=' {
            return Err("'=' is missing behind the instance's number");
        }
        self.at += 1;
        let first = self.records.len() as u32;
        if self.peek() == b'(' {
            self.at += 1;
            while self.peek() != b')' {
                self.record()?;
            }
            self.at += 1;
        } else {
            self.record()?;
        }
        let count = self.records.len() as u32 - first;
        if count == 0 {
            return Err("a complex instance without records");
        }
        let ended = self.end();
        self.instances.push(Instance { id, first, count });
        if ended.is_err() {
            // The record itself is whole: real files lose a ';' now and then. Go on where the next statement starts.
            if self.peek() == b'#' || self.at >= self.source.len() {
                return Ok(());
            }
            self.instances.pop();
        }
        ended
    }

    /// Reads a record, NAME( … ), and appends it to the table.
    fn record(&mut self) -> Parsed<()> {
        let c = self.peek();
        if !(c.is_ascii_alphabetic() || c == b'!' || c == b'_') {
            return Err("a record's name is missing");
        }
        let name = Keyword::new(self.source, self.identifier());
        if self.peek() != b'(' {
            return Err("'(' is missing behind a record's name");
        }
        let values = self.list(0)?;
        self.records.push(Record { name, values });
        Ok(())
    }

    /// Reads a list from its '(' to behind its ')'; a missing comma, or one behind the last value, is forgiven.
    fn list(&mut self, depth: usize) -> Parsed<Span> {
        if depth > MAX_DEPTH {
            return Err("lists are nested too deeply");
        }
        self.at += 1;
        // Values wait on a stack until their list is whole, so that lists inside it do not tear it apart.
        let base = self.stack.len();
        loop {
            match self.peek() {
                b')' => break,
                // Left out in silence, it would shift all values behind it.
                b',' => return Err("a value is missing before a comma"),
                END => return Err("the file ends inside a list"),
                c => {
                    let value = self.value(c, depth)?;
                    self.stack.push(value);
                    self.at += usize::from(self.peek() == b',');
                }
            }
        }
        self.at += 1;
        let span = Span { start: self.values.len() as u32, len: (self.stack.len() - base) as u32 };
        self.values.extend_from_slice(&self.stack[base..]);
        self.stack.truncate(base);
        Ok(span)
    }

    /// Reads the value that begins with byte `c`, in a list of this depth; a binary is stepped over, as nothing asks for what it holds.
    fn value(&mut self, c: u8, depth: usize) -> Parsed<Value> {
        Ok(match c {
            b'#' => {
                self.at += 1;
                Value::Ref(self.unsigned()?)
            }
            b'\'' => Value::Text(self.text()?),
            b'(' => Value::List(self.list(depth + 1)?),
            b'$' => {
                self.at += 1;
                Value::Null
            }
            b'*' => {
                self.at += 1;
                Value::Derived
            }
            // `.5` is a number, `.T.` an enumeration.
            b'.' if !self.source.get(self.at + 1).is_some_and(u8::is_ascii_digit) => {
                self.at += 1;
                let name = self.identifier();
                if self.source.get(self.at) != Some(&b'.') {
                    return Err("'.' is missing behind an enumeration value");
                }
                self.at += 1;
                Value::Enum(name)
            }
            b'"' => {
                let rest = &self.source[self.at + 1..];
                self.at += 2 + rest.iter().position(|&b| b == b'"').ok_or("'\"' is missing behind a binary")?;
                Value::Binary
            }
            b'0'..=b'9' | b'-' | b'+' | b'.' => {
                let (value, next) = number(self.source, self.at).ok_or("a number cannot be read")?;
                self.at = next;
                value
            }
            c if c.is_ascii_alphabetic() || c == b'!' => {
                let name = Keyword::new(self.source, self.identifier());
                if self.peek() != b'(' {
                    return Err("'(' is missing behind the name of a typed value");
                }
                let values = self.list(depth + 1)?;
                self.typed.push(Record { name, values });
                Value::Typed(self.typed.len() as u32 - 1)
            }
            _ => return Err("a value starts with an unexpected byte"),
        })
    }

    /// Takes a text in apostrophes, two of which are one inside of it; returns the span between them, not decoded.
    fn text(&mut self) -> Parsed<Span> {
        self.at += 1;
        let start = self.at;
        loop {
            let rest = self.source.get(self.at..).unwrap_or(&[]);
            let end = rest.iter().position(|&b| b == b'\'').ok_or("an apostrophe is missing behind a text")?;
            self.at += end + 1;
            if self.source.get(self.at) != Some(&b'\'') {
                break;
            }
            self.at += 1;
        }
        Ok(Span { start: start as u32, len: (self.at - 1 - start) as u32 })
    }
}

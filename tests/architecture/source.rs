//! Rust source as a list of tokens: enough to see who names whom, without a compiler.

use std::fs;
use std::path::{Path, PathBuf};

/// What code is made of once comments, text in quotes and lifetimes are gone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Token {
    /// A name, keyword or number.
    Word(String),
    /// `::`
    Scope,
    /// Any other character.
    Mark(char),
}

impl Token {
    pub(crate) fn word(&self) -> Option<&str> {
        if let Self::Word(word) = self { Some(word) } else { None }
    }

    pub(crate) fn is(&self, text: &str) -> bool {
        match self {
            Self::Word(word) => word == text,
            Self::Scope => text == "::",
            Self::Mark(c) => text.chars().eq([*c]),
        }
    }
}

/// A file of `src/` and the module that it is.
pub(crate) struct SourceFile {
    pub(crate) path: PathBuf,
    /// `["step", "trim", "fit"]` for `src/step/trim/fit.rs`, empty for `lib.rs`.
    pub(crate) module: Vec<String>,
    /// The tokens outside test modules.
    pub(crate) tokens: Vec<Token>,
    pub(crate) lines: usize,
    /// Columns of its longest line that is a comment.
    pub(crate) longest_comment: usize,
    pub(crate) has_header: bool,
}

impl SourceFile {
    fn read(path: PathBuf, src: &Path) -> Self {
        let text = fs::read_to_string(&path).expect("readable source");
        let inside = path.strip_prefix(src).expect("inside src").with_extension("");
        let mut module: Vec<String> =
            inside.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
        if module.last().is_some_and(|m| m == "mod" || m == "lib") {
            module.pop();
        }
        let tokens = without_tests(tokens(&text));
        let comments = text.lines().filter(|line| line.trim_start().starts_with("//"));
        let longest_comment = comments.map(|line| line.chars().count()).max().unwrap_or_default();
        Self {
            path,
            module,
            tokens,
            lines: text.lines().count(),
            longest_comment,
            has_header: text.starts_with("//!"),
        }
    }
}

/// The files of a `src` folder that belong to the library, by path; `main.rs` and the build script see all and are left out.
pub(crate) fn files(src: &Path) -> Vec<SourceFile> {
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
    let mut paths = Vec::new();
    walk(src, &mut paths);
    paths.retain(|p| *p != src.join("main.rs") && *p != src.join("build.rs"));
    paths.sort();
    paths.into_iter().map(|p| SourceFile::read(p, src)).collect()
}

/// The tokens of a text.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let mut out = Vec::new();
    let mut at = 0;
    while let Some(&c) = chars.get(at) {
        let next = chars.get(at + 1).copied();
        if c == '/' && next == Some('/') {
            at += chars[at..].iter().take_while(|c| **c != '\n').count();
        } else if c == '/' && next == Some('*') {
            at = after_comment(&chars, at);
        } else if c == '"' {
            at = after_quotes(&chars, at);
        } else if c == '\'' {
            at = after_tick(&chars, at);
        } else if c.is_alphanumeric() || c == '_' {
            let word: String = chars[at..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').collect();
            let end = at + word.chars().count();
            let hashes = chars[end..].iter().take_while(|c| **c == '#').count();
            let opens = chars.get(end + hashes) == Some(&'"');
            if opens && ["r", "br", "cr"].contains(&word.as_str()) {
                at = after_raw(&chars, end + hashes + 1, hashes);
            } else {
                at = end;
                out.push(Token::Word(word));
            }
        } else if c == ':' && next == Some(':') {
            out.push(Token::Scope);
            at += 2;
        } else {
            if !c.is_whitespace() {
                out.push(Token::Mark(c));
            }
            at += 1;
        }
    }
    out
}

/// Comments nest.
fn after_comment(chars: &[char], start: usize) -> usize {
    let mut depth = 0;
    let mut at = start;
    while at < chars.len() {
        match (chars[at], chars.get(at + 1)) {
            ('/', Some('*')) => depth += 1,
            ('*', Some('/')) => depth -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
        if depth == 0 {
            break;
        }
    }
    at
}

fn after_quotes(chars: &[char], start: usize) -> usize {
    let mut at = start + 1;
    while at < chars.len() && chars[at] != '"' {
        at += if chars[at] == '\\' { 2 } else { 1 };
    }
    at + 1
}

/// Behind a raw string that ends with a quote and as many hashes.
fn after_raw(chars: &[char], start: usize, hashes: usize) -> usize {
    let ends = |at: &usize| chars[*at] == '"' && chars[at + 1..].iter().take(hashes).all(|c| *c == '#');
    (start..chars.len()).find(ends).map_or(chars.len(), |at| at + 1 + hashes)
}

/// Behind a character in quotes; behind the tick alone where it begins a lifetime.
fn after_tick(chars: &[char], start: usize) -> usize {
    if chars.get(start + 1) == Some(&'\\') {
        // The escaped character itself may be a tick.
        let close = chars[start + 3..].iter().position(|c| *c == '\'');
        return close.map_or(chars.len(), |k| start + 4 + k);
    }
    if chars.get(start + 2) == Some(&'\'') { start + 3 } else { start + 1 }
}

/// Where the bracket that opens at `open` closes.
pub(crate) fn closing(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        match token {
            Token::Mark('{' | '(' | '[') => depth += 1,
            Token::Mark('}' | ')' | ']') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at;
        }
    }
    tokens.len() - 1
}

/// Drops every `#[cfg(test)] mod … { … }`.
fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    let mut out = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while at < tokens.len() {
        let attribute = tokens[at].is("#") && tokens.get(at + 1).is_some_and(|t| t.is("["));
        if attribute && tokens.get(at + 2).is_some_and(|t| t.is("cfg")) {
            let end = closing(&tokens, at + 1);
            let for_tests =
                tokens[at..end].iter().any(|t| t.is("test")) && !tokens[at..end].iter().any(|t| t.is("not"));
            let is_module =
                tokens[end + 1..].iter().take(6).take_while(|t| !t.is("{") && !t.is(";")).any(|t| t.is("mod"));
            if for_tests && is_module {
                let open = (end..tokens.len()).find(|k| tokens[*k].is("{") || tokens[*k].is(";")).unwrap_or(end);
                at = closing(&tokens, open) + 1;
                continue;
            }
        }
        out.push(tokens[at].clone());
        at += 1;
    }
    out
}

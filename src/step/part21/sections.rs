//! Sections of edition 3 that stand beside the data: anchors, references to other files, signatures. None holds an instance.

/// The word at the end of every section.
const END: &[u8] = b"ENDSEC";

/// A section, by its bytes from behind its first word on.
pub(super) struct Section {
    /// How many there are, up to its last word or the end of the file.
    pub(super) length: usize,
    /// Instances that stand in other files: where each is named, and its id.
    pub(super) elsewhere: Vec<(usize, u64)>,
}

/// Whether a word ends a section.
pub(super) fn is_section_end(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(END)
}

/// Returns what the section whose first word is `name` holds of `rest`, the bytes behind that word; `None` for any other word.
pub(super) fn section_besides_data(name: &[u8], rest: &[u8]) -> Option<Section> {
    if ![&b"ANCHOR"[..], b"REFERENCE", b"SIGNATURE"].iter().any(|word| name.eq_ignore_ascii_case(word)) {
        return None;
    }
    let length = last_word(rest);
    let mut elsewhere = Vec::new();
    if name.eq_ignore_ascii_case(b"REFERENCE") {
        let mut at = 0;
        // Each statement is `#12 = <other.stp#name>;`, or begins with `@` for a value.
        for statement in rest[..length].split_inclusive(|c| *c == b';') {
            let blanks = statement.iter().take_while(|c| **c <= b' ').count();
            let id = statement[blanks..].strip_prefix(b"#").and_then(|digits| {
                let count = digits.iter().take_while(|c| c.is_ascii_digit()).count();
                std::str::from_utf8(&digits[..count]).ok()?.parse().ok()
            });
            elsewhere.extend(id.map(|id| (at + blanks, id)));
            at += statement.len();
        }
    }
    Some(Section { length, elsewhere })
}

/// Returns the length of the signature that `rest` begins with, up to the ';' at its end; `None` for anything else. Signatures are all that
/// follows the end of a file (ISO 10303-21:2016).
pub(super) fn signature_length(rest: &[u8]) -> Option<usize> {
    const NAME: &[u8] = b"SIGNATURE";
    if !rest.get(..NAME.len())?.eq_ignore_ascii_case(NAME) {
        return None;
    }
    let last = last_word(rest);
    let semicolon = rest[last..].iter().position(|c| *c == b';');
    Some(semicolon.map_or(rest.len(), |offset| last + offset + 1))
}

/// Returns where the word that ends a section stands in `bytes`; their end where it is missing.
fn last_word(bytes: &[u8]) -> usize {
    bytes.windows(END.len()).position(|w| w.eq_ignore_ascii_case(END)).unwrap_or(bytes.len())
}

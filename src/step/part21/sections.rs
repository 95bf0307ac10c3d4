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

/// Returns what the section whose first word is `name` holds of `rest`, the bytes behind that word; `None` for any other word.
pub(super) fn section_besides_data(name: &[u8], rest: &[u8]) -> Option<Section> {
    if ![&b"ANCHOR"[..], b"REFERENCE", b"SIGNATURE"].iter().any(|word| name.eq_ignore_ascii_case(word)) {
        return None;
    }
    let length = rest.windows(END.len()).position(|w| w.eq_ignore_ascii_case(END)).unwrap_or(rest.len());
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

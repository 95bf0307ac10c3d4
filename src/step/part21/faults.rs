//! Faults of a text, with their lines.

use super::Fault;

/// Faults that are kept with their lines; the rest is counted.
const MAX_FAULTS: usize = 100;

/// Faults found in a source so far.
pub(super) struct Faults<'a> {
    source: &'a [u8],
    /// The first ones.
    pub(super) first: Vec<Fault>,
    /// How many there are in all.
    pub(super) count: usize,
    /// A position and its line, so that lines are counted once.
    lines: (usize, usize),
}

impl<'a> Faults<'a> {
    /// Returns an empty list for a source.
    pub(super) fn new(source: &'a [u8]) -> Self {
        Self { source, first: Vec::new(), count: 0, lines: (0, 1) }
    }

    /// Counts a fault at byte `start`, and lists it with its line while there are at most [`MAX_FAULTS`].
    pub(super) fn note(&mut self, start: usize, id: Option<u64>, what: &'static str) {
        self.count += 1;
        if self.first.len() < MAX_FAULTS {
            // Faults come in the order of the file but for a few, which are found at the end.
            let (from, line) = if self.lines.0 <= start { self.lines } else { (0, 1) };
            let newlines = self.source[from..start].iter().filter(|&&b| b == b'\n').count();
            self.lines = (start, line + newlines);
            self.first.push(Fault { line: line + newlines, id, what });
        }
    }
}

/// Returns where to go on behind a fault in the statement that began at `start` and was read up to `at`: the next ';' that ends a line or a
/// statement, because an open text must not swallow the statements after it.
pub(super) fn next_statement(source: &[u8], start: usize, at: usize) -> usize {
    let mut i = start;
    while let Some(offset) = source[i..].iter().position(|&b| b == b';') {
        i += offset + 1;
        let next = source[i..].iter().position(|b| *b > b' ').map(|k| source[i + k]);
        // Behind the place of the fault any ';' will do.
        if matches!(next, None | Some(b'#' | b'E' | b'/' | b'D')) || i >= at {
            return i;
        }
    }
    if i == start { source.len() } else { i }
}

/// Returns how many bytes of `rest`, which belong to no statement, stand before the next one: up to a '#' or ';', or behind a stray `*/`.
pub(super) fn stray_length(rest: &[u8]) -> usize {
    // What ends a comment that none began costs nothing else, as the word behind it may end the file.
    if rest.starts_with(b"*/") {
        return 2;
    }
    rest.iter().position(|b| matches!(b, b'#' | b';')).unwrap_or(rest.len())
}

#[cfg(test)]
mod tests {
    use crate::step::part21::parse;

    /// Asserts which instances are read of a file with these statements, whether it is whole, and which lines have a fault of which words.
    fn assert_read(statements: &str, ids: &[u64], is_ended: bool, faults: &[(usize, &str)]) {
        let text = format!("ISO-10303-21;\nDATA;\n{statements}");
        let file = parse("faults.stp", text.as_bytes()).unwrap();
        let said: Vec<(usize, &str)> = file.faults.iter().map(|fault| (fault.line, fault.what)).collect();
        assert_eq!(file.entities().map(|e| e.id).collect::<Vec<_>>(), ids, "{text}: {said:?}");
        assert_eq!((file.is_ended, said.len()), (is_ended, faults.len()), "{text}: {said:?}");
        for ((line, what), (expected_line, words)) in said.iter().zip(faults) {
            assert!(line == expected_line && what.contains(words), "{text}: {said:?}");
        }
    }

    #[test]
    fn keywords_in_small_letters_are_keywords() {
        assert_read("#1=A();\nendsec;\nend-iso-10303-21;\n", &[1], true, &[]);
        assert_read("#1=A();\nendsec;\n", &[1], false, &[]);
        assert_read(
            "reference;\n#2=<b.stp#x>;\nendsec;\n#1=A();\nEnd-Iso-10303-21;\n",
            &[1],
            true,
            &[(4, "another file")],
        );
    }

    #[test]
    fn nothing_behind_the_end_of_a_file_is_read() {
        let file = "#1=A();\nENDSEC;\nEND-ISO-10303-21;\n";
        assert_read(&format!("{file} /* blanks and #2=B(); */\n\x1a"), &[1], true, &[]);
        assert_read(&format!("{file}SIGNATURE;\nMIIB#2=(;)\nENDSEC;\n"), &[1], true, &[]);
        let second = format!("{file}ISO-10303-21;\nDATA;\n#1=A();\n#2=B();\nENDSEC;\nEND-ISO-10303-21;\n");
        assert_read(&second, &[1], true, &[(6, "behind the end")]);
    }

    #[test]
    fn the_end_of_a_section_without_its_semicolon_costs_nothing() {
        let fault = &[(4, "';' is missing")];
        assert_read("#1=A();\nENDSEC\nEND-ISO-10303-21;\n", &[1], true, fault);
        assert_read("#1=A();\nendsec\nDATA;\n#2=B();\nENDSEC;\nEND-ISO-10303-21;\n", &[1, 2], true, fault);
    }

    #[test]
    fn what_ends_no_comment_costs_no_instance() {
        let stray = &[(4, "neither '#' nor a letter")];
        assert_read("#1=A();\n/* a /* b */ */\n#2=B();\nEND-ISO-10303-21;\n", &[1, 2], true, stray);
        assert_read("#1=A();\n/* a /* b */ */\nEND-ISO-10303-21;\n", &[1], true, stray);
        assert_read(
            "#1=A();\n/* /* */ b */\n#2=B();\nEND-ISO-10303-21;\n",
            &[1, 2],
            true,
            &[(4, "';' is missing")],
        );
        assert_read("#1=A();\n) $\n#2=B();\nEND-ISO-10303-21;\n", &[1, 2], true, stray);
    }

    #[test]
    fn a_comment_that_does_not_end_is_told() {
        assert_read("#1=A();\n\n/* open\n#2=B();\nEND-ISO-10303-21;\n", &[1], false, &[(5, "does not end")]);
        let faults = [(4, "inside a list"), (4, "does not end")];
        assert_read("#1=A();\n#2=B(/* open\n#3=C();\nEND-ISO-10303-21;\n", &[1], true, &faults);
    }

    #[test]
    fn a_number_beyond_64_bits_is_no_instance() {
        let statements = "#99999999999999999999=A();\n#88888888888888888888=B();\n#18446744073709551614=C(#99999999999999999999);\n";
        let faults = [(3, "too large"), (4, "too large")];
        assert_read(&format!("{statements}END-ISO-10303-21;\n"), &[u64::MAX - 1], true, &faults);
    }
}

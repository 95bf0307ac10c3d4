//! Names are data: what a terminal, an editor or a spreadsheet would obey is written out as text.

use std::borrow::Cow;

/// Whether a terminal or a viewer would act on the character rather than show it: control characters (C0 without line end and
/// tabulator, DEL, C1), the marks that turn the direction of writing, the separators of lines and paragraphs, byte order
/// marks, the marks of annotations, invisible tags, and what has no width: soft hyphens, joiners and the like.
pub fn is_unprintable(c: char) -> bool {
    match c {
        // Line ends and tabulators lay text out; a viewer that shows them does no harm.
        '\n' | '\t' => false,
        // Arabic letter mark, left-to-right and right-to-left marks, embeddings, overrides and isolates.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        // Line and paragraph separators, the byte order mark, interlinear annotations, tags.
        '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}' => true,
        // Nothing is seen of them, so that two names that differ by them look alike: the soft hyphen, the Mongolian vowel separator, blanks
        // without width, joiners, invisible operators.
        '\u{ad}' | '\u{180e}' | '\u{200b}'..='\u{200d}' | '\u{2060}'..='\u{2064}' => true,
        c => c.is_control(),
    }
}

/// Writes the unprintable characters of a text of any number of lines as `\u{1b}`; one without any is borrowed.
///
/// ```
/// use lampyris::formats::printable;
/// assert_eq!(printable("cover\u{1b}[2J"), "cover\\u{1b}[2J");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unprintable) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        // As Rust writes them: readable, and nothing a terminal obeys.
        if is_unprintable(c) { shown.extend(c.escape_unicode()) } else { shown.push(c) }
    }
    Cow::Owned(shown)
}

/// As [`printable`], on one line: line ends and tabulators become blanks.
pub fn printable_line(text: &str) -> Cow<'_, str> {
    if text.contains(['\n', '\t']) {
        let line = text.replace(['\n', '\t'], " ");
        return Cow::Owned(printable(&line).into_owned());
    }
    printable(text)
}

/// Replaces every unprintable character by a printable one of as many bytes, so that places in the text stay where they are; a text
/// without any is borrowed.
pub fn printable_in_place(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unprintable) {
        return Cow::Borrowed(text);
    }
    let replaced = |c: char| match (is_unprintable(c), c.len_utf8()) {
        // By length: messages point into the text by bytes.
        (false, _) => c,
        (true, 1) => '?',
        (true, 2) => '¿',
        (true, 3) => '\u{fffd}',
        (true, _) => '\u{10ffff}',
    };
    Cow::Owned(text.chars().map(replaced).collect())
}

/// Writes the unprintable characters of a JSON text, which stand in its strings, as escapes; it reads back the same.
pub fn printable_json(text: String) -> String {
    if !text.contains(is_unprintable) {
        return text;
    }
    let mut shown = String::with_capacity(text.len() + 64);
    for c in text.chars() {
        if is_unprintable(c) {
            // They stand within strings alone, where JSON takes UTF-16 units as escapes.
            let mut units = [0u16; 2];
            c.encode_utf16(&mut units).iter().for_each(|unit| shown += &format!("\\u{unit:04x}"));
        } else {
            shown.push(c);
        }
    }
    shown
}

/// As [`printable_json`], for a JSON text that TOML takes as it is but for unprintable characters, such as a string, a number or a list.
pub fn printable_toml(text: String) -> String {
    if !text.contains(is_unprintable) {
        return text;
    }
    let mut shown = String::with_capacity(text.len() + 64);
    for c in text.chars() {
        // TOML takes characters, not units of UTF-16, as escapes, and refuses DEL as it is.
        match (is_unprintable(c), u32::from(c)) {
            (false, _) => shown.push(c),
            (true, code @ ..=0xffff) => shown += &format!("\\u{code:04x}"),
            (true, code) => shown += &format!("\\U{code:08x}"),
        }
    }
    shown
}

/// Writes text as a cell of CSV: unprintable characters as by [`printable`], quoted where it must be, and never taken for a formula by a
/// spreadsheet, which an apostrophe in front prevents.
///
/// ```
/// use lampyris::formats::csv_text;
/// assert_eq!(csv_text("=1+1"), "'=1+1");
/// assert_eq!(csv_text("a, b"), "\"a, b\"");
/// assert_eq!(csv_text("-0.5"), "-0.5");
/// ```
pub fn csv_text(text: &str) -> String {
    let text = printable(text);
    // Spreadsheets obey what starts so, but a negative number is one.
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t']) && text.parse::<f64>().is_err();
    let safe = if is_formula { format!("'{text}") } else { text.into_owned() };
    if safe.contains([',', ';', '"', '\n', '\t']) { quoted(&safe) } else { safe }
}

/// As [`csv_text`], always in quotes.
pub fn csv_quoted_text(text: &str) -> String {
    let cell = csv_text(text);
    if cell.starts_with('"') { cell } else { quoted(&cell) }
}

/// Puts text into quotes and doubles those inside.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ESC, an OSC that would set the title, BEL, CSI as one C1 character, a right-to-left override, NUL, CR.
    const HOSTILE: &str = "a\u{1b}[31mb\u{1b}]0;title\u{7}c\u{9b}2Jd\u{202e}e\0f\rg";

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        for shown in [printable(HOSTILE), printable_line(HOSTILE), printable_in_place(HOSTILE)] {
            assert!(!shown.contains(is_unprintable), "{shown:?}");
        }
        assert_eq!(printable("Straße\u{202f}µ\tok\n"), "Straße\u{202f}µ\tok\n");
        assert_eq!(printable_line("a\r\nb"), "a\\u{d} b");
        assert_eq!(printable_in_place(HOSTILE).len(), HOSTILE.len());
    }

    /// Names that differ by what nobody sees are one name to a reader.
    #[test]
    fn what_is_not_seen_is_written_out() {
        for c in ['\u{ad}', '\u{180e}', '\u{200b}', '\u{200c}', '\u{200d}', '\u{2060}', '\u{2064}'] {
            assert_eq!(printable(&format!("le{c}ns")), format!("le\\u{{{:x}}}ns", u32::from(c)));
            assert_eq!(printable_in_place(&format!("le{c}ns")).len(), 4 + c.len_utf8());
        }
    }

    #[test]
    fn documents_read_back_the_same() {
        let text = printable_json(serde_json::to_string(&[HOSTILE, "\u{e0041}"]).unwrap());
        assert!(!text.contains(is_unprintable), "{text:?}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&text).unwrap(), [HOSTILE, "\u{e0041}"]);
    }

    #[test]
    fn strings_of_scenes_read_back_the_same() {
        let text = printable_toml(serde_json::to_string(&[HOSTILE, "a\u{7f}\u{e0041}\n"]).unwrap());
        assert!(!text.contains(is_unprintable), "{text:?}");
        let back: toml::Table = format!("x = {text}").parse().unwrap();
        let back: Vec<&str> = back["x"].as_array().unwrap().iter().filter_map(|v| v.as_str()).collect();
        assert_eq!(back, [HOSTILE, "a\u{7f}\u{e0041}\n"]);
    }

    #[test]
    fn spreadsheets_take_text_as_text() {
        for (text, cell) in [
            ("=HYPERLINK(\"http://x\")", "\"'=HYPERLINK(\"\"http://x\"\")\""),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
            ("-", "'-"),
            ("-1e-3", "-1e-3"),
            ("plain", "plain"),
        ] {
            assert_eq!(csv_text(text), cell);
        }
        assert_eq!(csv_quoted_text("plain"), "\"plain\"");
    }
}

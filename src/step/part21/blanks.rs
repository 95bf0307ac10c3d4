//! What may stand between any two symbols: whitespace, comments and print directives.

/// Returns the position behind the blanks that begin at byte `at`, and where a comment among them begins that does not end.
pub(super) fn skip_blanks(source: &[u8], mut at: usize) -> (usize, Option<usize>) {
    loop {
        while at < source.len() && source[at] <= b' ' {
            at += 1;
        }
        let rest = &source[at..];
        if rest.starts_with(b"/*") {
            let Some(offset) = rest[2..].windows(2).position(|w| w == b"*/") else {
                return (source.len(), Some(at));
            };
            at += offset + 4;
        } else if rest.starts_with(b"\\N\\") || rest.starts_with(b"\\F\\") {
            at += 3;
        } else {
            return (at, None);
        }
    }
}

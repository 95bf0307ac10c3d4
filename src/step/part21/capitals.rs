//! Names of entities in small letters, as a few writers give them: Part 21 has capitals alone.

/// Returns a source in capitals but for what stands in texts and comments.
pub(in crate::step) fn in_capitals(source: &[u8]) -> Vec<u8> {
    let mut capitals = source.to_vec();
    let mut at = 0;
    while at < source.len() {
        let rest = &source[at..];
        at += if rest.starts_with(b"/*") {
            rest[2..].windows(2).position(|w| w == b"*/").map_or(rest.len(), |offset| offset + 4)
        } else if rest[0] == b'\'' {
            // Of the two apostrophes that are one inside of a text, the second begins another one.
            rest[1..].iter().position(|c| *c == b'\'').map_or(rest.len(), |offset| offset + 2)
        } else {
            capitals[at].make_ascii_uppercase();
            1
        };
    }
    capitals
}

#[cfg(test)]
mod tests {
    use super::in_capitals;

    #[test]
    fn texts_and_comments_stay_as_they_are() {
        for (written, expected) in [
            ("#1=a('It''s a',.t.);/* it's b */#2=b();", "#1=A('It''s a',.T.);/* it's b */#2=B();"),
            ("#1=a('open", "#1=A('open"),
            ("a/* open", "A/* open"),
            ("a/", "A/"),
        ] {
            assert_eq!(in_capitals(written.as_bytes()), expected.as_bytes(), "{written}");
        }
    }
}

//! The order in which people list texts with numbers in them.

use std::cmp::Ordering;

/// A piece of a text, numbers before all else.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Piece<'a> {
    /// A whole number: how many digits it has without leading zeros, and these.
    Number(usize, &'a str),
    /// A character that is no digit.
    Character(char),
}

/// Compares texts by their characters, but whole numbers in them by their values: `2/12` comes before `10/12`. Only what differs in leading
/// zeros alone is compared by these; nothing but the same text is equal.
pub(crate) fn natural_order(a: &str, b: &str) -> Ordering {
    pieces(a).cmp(pieces(b)).then_with(|| a.cmp(b))
}

/// Goes through the numbers of a text and the characters between them.
fn pieces(text: &str) -> impl Iterator<Item = Piece<'_>> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let behind = rest.trim_start_matches(|c: char| c.is_ascii_digit());
        if behind.len() < rest.len() {
            let digits = rest[..rest.len() - behind.len()].trim_start_matches('0');
            rest = behind;
            return Some(Piece::Number(digits.len(), digits));
        }
        let first = rest.chars().next()?;
        rest = &rest[first.len_utf8()..];
        Some(Piece::Character(first))
    })
}

#[cfg(test)]
mod tests {
    use super::natural_order;

    #[test]
    fn numbers_in_texts_are_compared_by_their_values() {
        let sorted = [
            "",
            "7",
            "a",
            "a 2",
            "a 2/3",
            "a 2/12",
            "a 10/3",
            "a 010/12",
            "a 10/12",
            "a 18446744073709551616",
            "a b",
        ];
        for (i, a) in sorted.iter().enumerate() {
            for (j, b) in sorted.iter().enumerate() {
                assert_eq!(natural_order(a, b), i.cmp(&j), "{a:?} {b:?}");
            }
        }
    }
}

//! Names in the legends of 3-D views.

/// Most characters of a name: of 27, up to 7.5 pixels each, and 46 beside them an entry takes 249 of the 254 pixels that a view has in a
/// window of 320. What does not fit would be cut at its end, where names differ.
const MOST_CHARACTERS: usize = 28;

/// Returns a name as a legend shows it: of a long one both ends.
pub(super) fn legend_name(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= MOST_CHARACTERS {
        return name.to_owned();
    }
    let half = (MOST_CHARACTERS - 1) / 2;
    let text = |part: &[char]| part.iter().collect::<String>();
    format!("{}…{}", text(&letters[..half]), text(&letters[letters.len() - half..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_shows_both_its_ends() {
        assert_eq!(legend_name("lens"), "lens");
        let shown = legend_name(&format!("first {} last", "ä".repeat(200)));
        assert!(shown.starts_with("first ä") && shown.ends_with("ä last") && shown.contains('…'), "{shown}");
        assert!(shown.chars().count() <= MOST_CHARACTERS, "{shown}");
    }
}

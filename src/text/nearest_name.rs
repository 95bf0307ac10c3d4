//! The name that was probably meant.

/// Letters of a word that are compared: no input makes the comparison long.
const COMPARED: usize = 64;

/// Returns the candidate nearest to a word, in any case of letters; `None` for no word, and where all differ in more than a third of the
/// longer one's letters and one more, or in all of them.
pub(crate) fn nearest_name<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let letters = |text: &str| text.chars().take(COMPARED).count();
    let longer = |c: &str| letters(c).max(letters(&word));
    candidates
        .into_iter()
        .map(|c| (edit_distance(&word, &c.to_lowercase()), c))
        // A third of the letters, and one more for short words: what differs more is another word.
        .filter(|(d, c)| !word.is_empty() && *d <= 1 + longer(c) / 3 && *d < longer(c))
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Names that advice lists at most: a line or two of them.
const LISTED: usize = 12;

/// Returns the question whether the nearest candidate was meant; `None` where none is near.
pub(crate) fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest_name(word, candidates).map(|near| format!("did you mean '{near}'?"))
}

/// Returns advice that names the nearest name, or the first in alphabetical order where none is near; `None` without names. Empty ones are
/// sorted out.
pub(crate) fn nearest_or_listed<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let mut names: Vec<&str> = names.into_iter().filter(|name| !name.is_empty()).collect();
    let asked = did_you_mean(word, names.iter().copied());
    if asked.is_some() {
        return asked;
    }
    names.sort_unstable();
    names.dedup();
    match names.len() {
        0 => None,
        n if n <= LISTED => Some(format!("there are: {}", names.join(", "))),
        n => Some(format!("there are {n}, among them: {}", names[..LISTED].join(", "))),
    }
}

/// Returns the edit distance (Levenshtein 1966), which is case-sensitive. Quadratic, so that words are cut at
/// [`COMPARED`] letters.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(COMPARED).collect(), b.chars().take(COMPARED).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            // The row above is overwritten as it is read: one row holds the whole table.
            let change = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_other_words_are_not() {
        let keys = ["reflectance", "transmittance", "medium", "part"];
        assert_eq!(nearest_name("reflectence", keys), Some("reflectance"));
        assert_eq!(nearest_name("Medum", keys), Some("medium"));
        assert_eq!(nearest_name("wavelength", keys), None);
        // No word is like any; and letters count, of which some take two bytes.
        assert_eq!(nearest_name("", ["A"]), None);
        assert_eq!(nearest_name("änäöü", ["äbcdü"]), None);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        // However long, and not where no letter is the same.
        assert_eq!(nearest_name(&"x".repeat(300), ["Open CASCADE STEP translator 7.8 2"]), None);
        assert_eq!(nearest_name("g", ["1"]), None);
        assert_eq!(nearest_name("G", ["g"]), Some("g"));
    }

    #[test]
    fn without_a_near_name_some_are_listed() {
        let advice = |word, names: &[&'static str]| nearest_or_listed(word, names.iter().copied());
        assert_eq!(advice("huosing", &["cover", "housing"]).unwrap(), "did you mean 'housing'?");
        assert_eq!(advice("xyz", &["housing", "", "cover", "cover"]).unwrap(), "there are: cover, housing");
        assert_eq!(advice("xyz", &[""]), None);
        let many: Vec<String> = (10..40).map(|k| format!("part {k}")).collect();
        let listed = nearest_or_listed("xyz", many.iter().map(String::as_str)).unwrap();
        assert!(
            listed.starts_with("there are 30, among them: part 10, ") && listed.ends_with(", part 21"),
            "{listed}"
        );
    }
}

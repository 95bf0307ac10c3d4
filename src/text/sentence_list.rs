//! Lists of similar sentences that are too long to print in full.

/// Returns the first `most` of these sentences and, where there are more, the one that `rest` makes of how many more.
pub(crate) fn first_sentences(
    sentences: impl IntoIterator<Item = String>,
    most: usize,
    rest: impl FnOnce(usize) -> String,
) -> Vec<String> {
    let mut sentences = sentences.into_iter();
    let mut first: Vec<String> = sentences.by_ref().take(most).collect();
    let further = sentences.count();
    if further > 0 {
        first.push(rest(further));
    }
    first
}

#[cfg(test)]
mod tests {
    use super::first_sentences;

    #[test]
    fn sentences_beyond_the_first_are_counted() {
        let list = |count: usize| {
            first_sentences((0..count).map(|k| k.to_string()), 3, |further| format!("{further} more")).join(" ")
        };
        assert_eq!([0, 1, 3, 4, 1000].map(list), ["", "0", "0 1 2", "0 1 2 1 more", "0 1 2 997 more"]);
    }
}

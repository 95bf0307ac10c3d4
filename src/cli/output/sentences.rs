//! Sentences in lines that fit a terminal.

use crate::text::belong_together;

/// Returns the words of a text; those that [`belong_together`] are one, as far as it has at most `width` characters.
fn words(text: &str, width: usize) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = "";
    // At spaces and line breaks alone: the narrow one within a number does not break it.
    for word in text.split([' ', '\n']).filter(|word| !word.is_empty()) {
        match words.last_mut() {
            Some(last)
                if belong_together(before, word) && last.chars().count() + 1 + word.chars().count() <= width =>
            {
                last.push(' ');
                last.push_str(word);
            }
            _ => words.push(word.to_owned()),
        }
        before = word;
    }
    words
}

/// Breaks a text into lines of at most `width` characters; a longer word has a line to itself. An empty text is one empty line.
fn wrapped_lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in words(text, width) {
        let line = lines.last_mut().map(|l| (l.chars().count(), l));
        match line {
            Some((0, line)) => line.push_str(&word),
            Some((n, line)) if n + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// Returns a sentence in lines of at most `width` characters, each with its end: the first begins with `label`, no longer than `indent`
/// columns, the others with as many blanks.
pub(crate) fn sentence_lines(label: &str, indent: usize, sentence: &str, width: usize) -> String {
    let lines = wrapped_lines(sentence, width.saturating_sub(indent).max(indent));
    label.to_owned() + &lines.join(&format!("\n{:indent$}", "")) + "\n"
}

/// Returns a sentence of Markdown without its emphasis.
pub(crate) fn plain_sentence(markdown: &str) -> String {
    markdown.replace("**", "")
}

/// Returns a sentence of Markdown in such lines below one another, without its emphasis, set in by two columns.
pub(crate) fn plain_sentence_lines(markdown: &str, width: usize) -> String {
    sentence_lines("  ", 2, &plain_sentence(markdown), width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_does_not_break_within_a_number() {
        let text = format!("of  {} rays\nand more", crate::text::grouped(16_384));
        assert_eq!(wrapped_lines(&text, 7), ["of", crate::text::grouped(16_384).as_str(), "rays", "and", "more"]);
    }

    #[test]
    fn a_number_keeps_its_unit_and_an_angle_its_name() {
        let lines = |text: &str| wrapped_lines(text, 12).join("|");
        assert_eq!(lines("the share (75.57 %) of it"), "the share|(75.57 %) of|it");
        assert_eq!(lines("no more than H 0.45° is"), "no more than|H 0.45° is");
        assert_eq!(lines("power is 3.1 ± 0.2 lm."), "power is|3.1 ± 0.2|lm.");
        // A short word is no unit.
        assert_eq!(lines("between 5 and 7 of them"), "between 5|and 7 of|them");
    }

    #[test]
    fn lines_stand_behind_the_label_and_keep_to_the_width() {
        let how = "turned by H 0.12°, V −0.34°, so that the elbow of its cut-off lies at 0.57° below the horizon";
        let text = sentence_lines("  aim     ", 10, how, 50);
        assert!(text.starts_with("  aim     turned by") && text.lines().count() == 3, "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 50), "{text}");
        assert!(
            text.lines().skip(1).all(|line| line.starts_with("          ") && !line.starts_with("           "))
        );
    }
}

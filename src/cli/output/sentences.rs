//! Sentences in lines that fit a terminal.

/// Breaks a text into lines of at most `width` characters; a longer word has a line to itself. An empty text is one empty line.
fn wrapped_lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    // At spaces and line breaks alone: the narrow one within a number does not break it.
    for word in text.split([' ', '\n']).filter(|word| !word.is_empty()) {
        let line = lines.last_mut().map(|l| (l.chars().count(), l));
        match line {
            Some((0, line)) => line.push_str(word),
            Some((n, line)) if n + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
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

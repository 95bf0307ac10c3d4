//! Names close to a mistyped one.

/// Writes a sentence with the closest known name first, and up to twenty of all: `did you mean "cover"? its parts are cover, housing`.
pub(super) fn closest_name(intro: &str, given: &str, known: &[&str]) -> String {
    let mut unique: Vec<&str> = Vec::new();
    for name in known {
        if !unique.contains(name) {
            unique.push(name);
        }
    }
    let close =
        unique.iter().map(|n| (edit_distance(given, n), *n)).min().filter(|(d, n)| *d <= 2 + n.chars().count() / 3);
    // A screen of names; files may have thousands of parts.
    let shown = unique.iter().take(20).copied().collect::<Vec<_>>().join(", ");
    let rest = if unique.len() > 20 { format!(" and {} more", unique.len() - 20) } else { String::new() };
    match close {
        Some((_, name)) => format!("did you mean \"{name}\"? {intro} {shown}{rest}"),
        None if unique.is_empty() => "no part of the model has a name".into(),
        None => format!("{intro} {shown}{rest}"),
    }
}

/// Returns the edit distance (Levenshtein 1966), case ignored, over at most 60 characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let fold = |s: &str| s.to_lowercase().chars().take(60).collect::<Vec<char>>();
    let (a, b) = (fold(a), fold(b));
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let cost = if x == y { corner } else { 1 + corner.min(row[j]).min(row[j + 1]) };
            corner = row[j + 1];
            row[j + 1] = cost;
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_comes_first() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(
            closest_name("parts:", "huosing", &["cover", "housing", "cover"]),
            "did you mean \"housing\"? parts: cover, housing"
        );
        assert_eq!(closest_name("parts:", "xyz", &["cover"]), "parts: cover");
    }
}

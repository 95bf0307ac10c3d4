//! Names close to a mistyped one.

use crate::text::nearest_name;

/// Writes a sentence with the closest known name first, and up to twenty of all: `did you mean 'cover'? its parts are cover, housing`.
/// Without known names it is `otherwise`, what to do instead.
pub(super) fn closest_name(intro: &str, given: &str, known: &[&str], otherwise: &str) -> String {
    if known.is_empty() {
        return otherwise.into();
    }
    let mut unique: Vec<&str> = Vec::new();
    for name in known {
        if !unique.contains(name) {
            unique.push(name);
        }
    }
    // A screen of names; files may have thousands of parts.
    let shown = unique.iter().take(20).copied().collect::<Vec<_>>().join(", ");
    let rest = if unique.len() > 20 { format!(" and {} more", unique.len() - 20) } else { String::new() };
    match nearest_name(given, unique.iter().copied()) {
        Some(name) => format!("did you mean '{name}'? {intro} {shown}{rest}"),
        None => format!("{intro} {shown}{rest}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_comes_first() {
        assert_eq!(
            closest_name("parts:", "huosing", &["cover", "housing", "cover"], "use --face"),
            "did you mean 'housing'? parts: cover, housing"
        );
        assert_eq!(closest_name("parts:", "xyz", &["cover"], "use --face"), "parts: cover");
        assert_eq!(closest_name("parts:", "xyz", &[], "use --face"), "use --face");
    }
}

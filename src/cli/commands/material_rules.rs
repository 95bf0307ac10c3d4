//! The rules of a new scene: a line for each part, or solids of it that look alike, with what may be said of it in a comment.

use crate::formats::printable_toml;
use crate::model::{Model, PartAccount, SolidAccount};
use crate::text::{count_of, figures};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Rules that are written; of more, a comment says how many there are.
const MOST_RULES: usize = 40;
/// Rules up to which all stand in the scene; of more the most stay what no rule says too, black, and stand in comments.
const MOST_LIVE_RULES: usize = 6;
/// Numbers of solids that look alike up to which a rule lists them; more of them it selects by their part alone.
const MOST_NUMBERS: usize = 8;
/// Places of a part that are named.
pub(super) const MOST_PLACES: usize = 6;

/// Returns the rules as the list of the scene, which begins a line: those of few parts as they are, those of many in comments.
pub(super) fn material_text(rules: &[String]) -> String {
    let rest = rules.len().saturating_sub(MOST_RULES);
    let more = if rest > 0 {
        format!("    # … and {}: `lampyris info FILE --faces` names them\n", count_of(rest as u64, "more solid"))
    } else {
        String::new()
    };
    let (mark, hint) = if rules.len() > MOST_LIVE_RULES {
        ("# ", "# There are many: each rule is commented out; take away the # of those that are not black.\n")
    } else {
        ("", "")
    };
    let shown: String = rules.iter().take(MOST_RULES).map(|rule| format!("    {mark}{rule}\n")).collect();
    format!("{hint}material = [\n{shown}{more}]\n")
}

/// Returns for each part the names that select its instances one by one; none where a name selects others too or nothing.
pub(super) fn instance_names(model: &Model) -> Vec<Vec<String>> {
    let mut uses: HashMap<&str, usize> = HashMap::new();
    for instance in &model.instances {
        // The path of an instance that stands in no assembly is its name.
        for name in instance.names().collect::<BTreeSet<_>>() {
            *uses.entry(name).or_default() += 1;
        }
    }
    let selects_one = |label: &String| !label.contains('*') && uses.get(label.as_str()) == Some(&1);
    let of_part = |labels: Vec<String>| if labels.iter().all(selects_one) { labels } else { Vec::new() };
    model.labels_of_parts().into_iter().map(of_part).collect()
}

/// A part with the names that select its instances one by one.
type NamedPart<'a> = (&'a PartAccount, &'a [String]);

/// Returns the parts of one name in groups of equal numbers of faces and equal sizes.
fn looks<'a>(parts: &[NamedPart<'a>]) -> Vec<Vec<NamedPart<'a>>> {
    let look = |part: &PartAccount| -> Vec<(usize, [String; 3])> {
        part.solids.iter().map(|s| (s.faces.len(), s.size_mm().map(toml_number))).collect()
    };
    let mut found = HashMap::new();
    let mut groups: Vec<Vec<NamedPart<'a>>> = Vec::new();
    for &part in parts {
        let group = *found.entry(look(part.0)).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(part);
    }
    groups
}

/// Returns the rules for all parts that are placed: one for each name, or where a part of that name has several solids one for those that
/// look alike; none for solids without faces. Parts of one name that look different are distinguished by their instances, as `instances`
/// has them for each part.
pub(super) fn rule_texts(parts: &[PartAccount], instances: &[Vec<String>]) -> Vec<String> {
    // A selector by name means all parts of that name: what the first one is like is said of all.
    let mut names: Vec<(&str, Vec<NamedPart<'_>>)> = Vec::new();
    for part in parts.iter().zip(instances.iter().map(Vec::as_slice)).filter(|(part, _)| part.instances > 0) {
        match names.iter_mut().find(|(name, _)| *name == part.0.name) {
            Some((_, alike)) => alike.push(part),
            None => names.push((&part.0.name, vec![part])),
        }
    }
    // Parts without a name are selected by `*`, which means the others too: these stand below, where they win.
    names.sort_by_key(|(name, _)| !name.is_empty());
    let mut rules = Vec::new();
    for (name, parts) in names {
        let looks = looks(&parts);
        let few = |alike: &Vec<NamedPart<'_>>| {
            let count: usize = alike.iter().map(|(_, labels)| labels.len()).sum();
            alike.iter().all(|(_, labels)| !labels.is_empty()) && count <= MOST_PLACES
        };
        if looks.len() > 1 && looks.iter().all(few) {
            for alike in looks {
                let labels: Vec<String> =
                    alike.iter().flat_map(|(_, labels)| *labels).map(|l| toml_string(l)).collect();
                let value = if let [one] = &labels[..] { one.clone() } else { format!("[{}]", labels.join(", ")) };
                rules.extend(solid_rules(&format!("instance = {value}"), &alike));
            }
            continue;
        }
        let name = if name.is_empty() { "\"*\"".to_owned() } else { toml_string(name) };
        rules.extend(solid_rules(&format!("part = {name}"), &parts));
    }
    rules
}

/// Returns the rules for parts that a selector means: one, or where a part has several solids one for those of each look.
fn solid_rules(selector: &str, parts: &[NamedPart<'_>]) -> Vec<String> {
    let mut numbered: BTreeMap<usize, Vec<&SolidAccount>> = BTreeMap::new();
    let solids = |part: &PartAccount| part.solids.iter().filter(|s| !s.faces.is_empty()).count();
    let is_whole = parts.iter().all(|(part, _)| solids(part) < 2);
    for solid in parts.iter().flat_map(|(part, _)| &part.solids).filter(|s| !s.faces.is_empty()) {
        numbered.entry(if is_whole { 0 } else { solid.index }).or_default().push(solid);
    }
    if is_whole {
        let first =
            if parts.len() > 1 { format!("the first of {} of this name: ", parts.len()) } else { String::new() };
        return numbered.values().map(|solids| rule_text(selector, &first, solids[0])).collect();
    }
    let mut found = HashMap::new();
    let mut groups: Vec<Vec<Vec<&SolidAccount>>> = Vec::new();
    for solids in numbered.into_values() {
        let group = *found.entry(description(solids[0])).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(solids);
    }
    // The most alike, where they are too many to list, are what the first rule says of the whole part and others below of their own.
    let most = (0..groups.len())
        .rev()
        .max_by_key(|&group| groups[group].len())
        .filter(|&k| groups[k].len() > MOST_NUMBERS);
    if let Some(most) = most {
        groups[..=most].rotate_right(1);
    }
    let names = parts.iter().flat_map(|(part, _)| &part.solids).map(|solid| (solid.name.as_str(), solid.index));
    let names: BTreeSet<(&str, usize)> = names.collect();
    let rule = |(place, alike): (usize, &Vec<Vec<&SolidAccount>>)| {
        if most.is_some() && place == 0 {
            return rule_text(selector, &format!("{} alike, each ", alike.len()), alike[0][0]);
        }
        let numbers: Vec<String> = alike.iter().map(|solids| solids[0].index.to_string()).collect();
        let (solid, first) = match &alike[..] {
            [solids] => {
                let first =
                    if solids.len() > 1 { format!("the first of {}: ", solids.len()) } else { String::new() };
                (solid_name(solids, &names).unwrap_or_else(|| numbers[0].clone()), first)
            }
            _ => (format!("[{}]", numbers.join(", ")), format!("{} alike, each ", alike.len())),
        };
        rule_text(&format!("{selector}, solid = {solid}"), &first, alike[0][0])
    };
    groups.iter().enumerate().map(rule).collect()
}

/// Returns the name of solids of one number as TOML, where all of them have it and no other solid among all `names` and numbers has.
fn solid_name(solids: &[&SolidAccount], names: &BTreeSet<(&str, usize)>) -> Option<String> {
    let name = solids[0].name.as_str();
    let is_own = names.range((name, 0)..=(name, usize::MAX)).count() == 1 && solids.iter().all(|s| s.name == name);
    // A star stands for anything in a selector.
    (is_own && !name.is_empty() && !name.contains('*')).then(|| toml_string(name))
}

/// Returns a rule for one solid, or for several that look like it, with what may be said of it in a comment after `first`.
fn rule_text(selector: &str, first: &str, solid: &SolidAccount) -> String {
    format!("{{ {selector}, surface = \"absorber\" }},  # {first}{}", description(solid))
}

/// Returns what may be said of a solid by its looks.
fn description(solid: &SolidAccount) -> String {
    let closed = if solid.closed { "closed" } else { "open: a medium would have a gap" };
    let size = solid.size_mm().map(toml_number).join(" × ");
    let colour = solid.colour().map_or(String::new(), |c| format!(", {c}"));
    format!("{closed}, {}, {size} mm{colour}", count_of(solid.faces.len() as u64, "face"))
}

/// Returns a number of five digits as TOML takes it; what has no such form keeps all digits.
pub(super) fn toml_number(value: f64) -> String {
    // As `figures` writes for people: TOML knows neither their minus nor their spaces.
    let digits = figures(value, 5).replace('−', "-").replace('\u{202f}', "");
    digits.parse::<f64>().map_or_else(|_| value.to_string(), |_| digits)
}

/// Returns a text as a TOML string on one line.
pub(super) fn toml_string(text: &str) -> String {
    printable_toml(serde_json::Value::from(text).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{FaceAccount, SurfaceKind};

    /// A part of so many solids, each of one face of this width, mm.
    fn part(name: &str, instances: usize, solids: usize, width: f64) -> PartAccount {
        let face = FaceAccount {
            id: None,
            name: String::new(),
            colour: None,
            layer: None,
            kind: SurfaceKind::Plane,
            radius_mm: None,
            area_mm2: 1.0,
            bbox_mm: [[0.0; 3], [width, 1.0, 1.0]],
            at: [0.0; 3],
        };
        let solid = |index| SolidAccount { index, name: String::new(), closed: true, faces: vec![face.clone()] };
        PartAccount { name: name.into(), instances, solids: (0..solids).map(solid).collect() }
    }

    #[test]
    fn one_face_is_a_face() {
        let text = description(&part("glass", 1, 1, 9.0).solids[0]);
        assert!(text.starts_with("closed, 1 face, "), "{text}");
    }

    #[test]
    fn parts_of_one_name_that_look_different_are_told_apart_by_their_instances() {
        let parts = [part("glass", 1, 1, 9.0), part("glass", 1, 1, 2.5), part("glass", 1, 1, 9.0)];
        let labels = ["a/glass", "a/glass:2", "a/glass:3"].map(|label| vec![label.to_owned()]);
        let selectors = |labels: &[Vec<String>]| -> Vec<String> {
            let selector = |rule: String| Some(rule.split_once("{ ")?.1.split_once(", surface")?.0.to_owned());
            rule_texts(&parts, labels).into_iter().filter_map(selector).collect()
        };
        assert_eq!(selectors(&labels), ["instance = [\"a/glass\", \"a/glass:3\"]", "instance = \"a/glass:2\""]);
        assert_eq!(selectors(&vec![Vec::new(); 3]), ["part = \"glass\""], "no name selects one alone");
    }

    #[test]
    fn parts_of_one_name_get_one_rule_and_those_without_a_name_stand_above() {
        let part = |name: &str, instances: usize, solids: usize| part(name, instances, solids, 1.0);
        let parts =
            [part("led", 1, 1), part("led", 2, 1), part("", 1, 1), part("board", 1, 2), part("spare", 0, 1)];
        let rules = rule_texts(&parts, &vec![Vec::new(); parts.len()]);
        assert_eq!(rules.len(), 3, "{rules:?}");
        assert!(rules[0].contains("{ part = \"*\", surface"), "{rules:?}");
        assert!(rules[1].contains("{ part = \"led\", surface") && rules[1].contains("first of 2"), "{rules:?}");
        assert!(
            rules[2].contains("{ part = \"board\", solid = [0, 1], surface") && rules[2].contains("2 alike"),
            "{rules:?}"
        );
    }

    /// Forty-eight LEDs take no line of forty-eight numbers: their rule is that of the part, and comes before the board's, which wins.
    #[test]
    fn many_solids_alike_are_what_is_said_of_their_part() {
        let mut ring = part("ring", 1, 49, 1.0);
        ring.solids[0].faces[0].bbox_mm[1][0] = 94.0;
        let rules = rule_texts(&[ring], &[Vec::new()]);
        assert_eq!(rules.len(), 2, "{rules:?}");
        assert!(
            rules[0].starts_with("{ part = \"ring\", surface") && rules[0].contains("48 alike, each"),
            "{rules:?}"
        );
        assert!(rules[1].starts_with("{ part = \"ring\", solid = 0, surface"), "{rules:?}");
    }

    /// A solid alone in its look is called by its name where no other solid has it, else by its number.
    #[test]
    fn solids_are_called_by_names_of_their_own() {
        let selectors = |names: [&str; 3]| -> Vec<String> {
            let mut lamp = part("lamp", 1, 3, 1.0);
            for (k, (solid, name)) in lamp.solids.iter_mut().zip(names).enumerate() {
                solid.name = name.into();
                solid.faces[0].bbox_mm[1][0] = [5.0, 5.0, 7.0][k];
            }
            let selector =
                |rule: &String| rule.split_once("solid = ").unwrap().1.split_once(", surface").unwrap().0.into();
            rule_texts(&[lamp], &[Vec::new()]).iter().map(selector).collect()
        };
        assert_eq!(selectors(["chip", "chip", "lens"]), ["[0, 1]", "\"lens\""]);
        for taken in ["chip", "le*", ""] {
            assert_eq!(selectors(["chip", "chip", taken]), ["[0, 1]", "2"], "{taken}");
        }
    }

    /// Of many parts a scene keeps the lines of those alone that somebody takes the `#` from; TOML reads the comment behind it too.
    #[test]
    fn many_rules_stand_in_comments() {
        let text = |count: usize| {
            let parts: Vec<PartAccount> = (0..count).map(|k| part(&format!("p{k}"), 1, 1, 1.0)).collect();
            material_text(&rule_texts(&parts, &vec![Vec::new(); count]))
        };
        let rules = |text: &str| text.parse::<toml::Table>().unwrap()["material"].as_array().unwrap().len();
        assert_eq!(rules(&text(6)), 6);
        let many = text(50);
        assert_eq!((rules(&many), many.matches("# { part").count()), (0, 40));
        assert!(many.contains("and 10 more solids"), "{many}");
        assert_eq!(rules(&many.replace("    # { part = \"p3\"", "    { part = \"p3\"")), 1);
    }

    #[test]
    fn numbers_and_names_are_toml() {
        assert_eq!(
            [toml_number(-1234567.0), toml_number(1e-7), toml_number(0.1 + 0.2)],
            ["-1234567", "1e-7", "0.3"]
        );
        let text = "a\"\\\u{1b}\nb";
        let back: toml::Table = format!("x = {}", toml_string(text)).parse().unwrap();
        assert_eq!(back["x"].as_str(), Some(text));
    }
}

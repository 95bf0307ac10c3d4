//! `lampyris init`: a commented scene for a STEP file, ready to be traced and to be changed.

use crate::cli::arguments::command::PlacedLimit;
use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::cli::work::input_files;
use crate::cli::work::output_place::{folder_of, make_folder};
use crate::formats::{file_name, printable_line, printable_toml, write_atomic};
use crate::model::{Model, PartAccount, SolidAccount};
use crate::pipeline::LoadedModel;
use crate::report::figures;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Solids that get a rule of their own; of more, a comment says how many there are.
const MOST_RULES: usize = 40;
/// Rules up to which all stand in the scene; of more the most stay what no rule says too, black, and stand in comments.
const MOST_LIVE_RULES: usize = 6;
/// Parts that are placed several times, and places of each, that are named in a comment.
const MOST_PLACED_PARTS: usize = 10;
const MOST_PLACES: usize = 6;
/// Distance of source and receiver from the model, and margin of the beam, as shares of the box' diagonal.
const DISTANCE: f64 = 0.5;
const BEAM_MARGIN: f64 = 1.05;
/// Coordinates below this share of the diagonal are rounding of the file's twelve digits.
const ROUNDING: f64 = 1e-9;
/// The receiver is so many times as wide as the beam.
const RECEIVER_WIDTHS: f64 = 4.0;

/// Writes a scene for a STEP file and says so; a file that is there is never written over, but refused.
pub(crate) fn run(file: &Path, output: Option<&Path>, console: &Console) -> Result<Completion, Failure> {
    let loaded = input_files::model_file(file, PlacedLimit::default(), console)?;
    let scene_file = match output {
        Some(path) => path.to_path_buf(),
        None => PathBuf::from(last_component(file)).with_extension("toml"),
    };
    // A scene has work in it: it is never written over.
    if scene_file.exists() {
        let failure = Failure::arguments(format!("{}: is there already", scene_file.display()));
        return Err(failure.with_help("give another name with -o"));
    }
    make_folder(&folder_of(&scene_file))?;
    let Some(reference) = model_reference(file, &scene_file) else {
        let failure = Failure::arguments(format!("{}: no scene can name this file", file.display()));
        return Err(failure.with_help("its path is no UTF-8 text, as TOML is; give the file another name"));
    };
    let text = scene_text(file, &reference, &loaded);
    write_atomic(&scene_file, |w| w.write_all(text.as_bytes()))?;
    if console.json {
        print(&json_text(&json!({"scene": scene_file.display().to_string()}))?)?;
    } else {
        console.say(format_args!("wrote {}", scene_file.display()));
        console.say(
            console
                .dim(&format!("  say what the parts are made of, then `lampyris trace {}`", scene_file.display())),
        );
    }
    Ok(Completion::Complete)
}

/// Returns the name of a file without its folder; a path that ends in no name is left whole.
fn last_component(file: &Path) -> &OsStr {
    file.file_name().unwrap_or(file.as_os_str())
}

/// Returns the model's path as the scene names it: its bare name where both are in one folder, else absolute. `None` where it is no UTF-8.
fn model_reference(file: &Path, scene_file: &Path) -> Option<String> {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let is_beside = folder_of(&absolute(file)) == folder_of(&absolute(scene_file));
    // A path beside the scene moves with it; any other must be absolute, for the scene may be read from elsewhere.
    let path = if is_beside { PathBuf::from(last_component(file)) } else { absolute(file) };
    path.into_os_string().into_string().ok()
}

/// Returns the whole scene as TOML, a line for each thing. `file` is for its heading, `reference` the path of the model in it.
fn scene_text(file: &Path, reference: &str, loaded: &LoadedModel) -> String {
    let model = &loaded.model;
    let name = file_name(file);
    let material = material_text(&rule_texts(&model.account(), &instance_names(model)));
    let light = light_text(model);
    format!(
        "# A scene for {}: lengths in mm, powers in W. `lampyris schema --text` says what else may stand here.\n\
         title = {}\n\
         # Parts are left out by what selects them: {{ file = …, without = [{{ part = \"helper*\" }}] }}.\n\
         model = [{{ file = {} }}]\n\n\
         # A face that no rule names absorbs all light that meets it. Rules select by part, instance, solid, face, entity (the #id\n\
         # of the file), layer, kind, radius_mm, colour or at (a point near the face); a later rule wins. `lampyris info FILE --faces`\n\
         # shows what selects each face. In place of surface = \"absorber\" stands what it is: medium = \"PMMA\" (`lampyris media` lists\n\
         # the media that have names), or surface = \"mirror\", reflectance = 0.9.\n\
         {material}{}\n{light}",
        printable_line(&name),
        toml_string(&name),
        toml_string(reference),
        places_text(model)
    )
}

/// Returns the rules as the list of the scene, which begins a line: those of few parts as they are, those of many in comments.
fn material_text(rules: &[String]) -> String {
    let rest = rules.len().saturating_sub(MOST_RULES);
    let more = if rest > 0 {
        format!("    # … and {rest} more solids: `lampyris info --faces` names them\n")
    } else {
        String::new()
    };
    let (mark, hint) = if rules.len() > MOST_LIVE_RULES {
        ("# ", "# Of so many each begins with a #, which is to be taken from those that are not black.\n")
    } else {
        ("", "")
    };
    let shown: String = rules.iter().take(MOST_RULES).map(|rule| format!("    {mark}{rule}\n")).collect();
    format!("{hint}material = [\n{shown}{more}]\n")
}

/// Returns comments that say what selects one place of a part that has several, of the first such parts; empty where no part has.
fn places_text(model: &Model) -> String {
    let places = model.labels_of_parts();
    let line = |labels: &Vec<String>| {
        let first: Vec<String> = labels.iter().take(MOST_PLACES).map(|label| toml_string(label)).collect();
        let more = if labels.len() > MOST_PLACES { ", …" } else { "" };
        format!("#   instance = {}{more}\n", first.join(" or "))
    };
    let mut distinct = places.iter().filter(|labels| labels.len() > 1 && labels.iter().any(|l| l != &labels[0]));
    let lines: String = distinct.by_ref().take(MOST_PLACED_PARTS).map(line).collect();
    if lines.is_empty() {
        return lines;
    }
    format!("# Of parts that are placed several times each place has a name of its own:\n{lines}")
}

/// Returns for each part the names that select its instances one by one; none where a name selects others too or nothing.
fn instance_names(model: &Model) -> Vec<Vec<String>> {
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

/// Returns the rules for all parts that are placed: one for each name, or one for each solid where a part of that name has several; none
/// for solids without faces. Parts of one name that look different are told apart by their instances, as `instances` has them for each
/// part.
fn rule_texts(parts: &[PartAccount], instances: &[Vec<String>]) -> Vec<String> {
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

/// Returns the rules for parts that a selector means: one, or one for each solid where a part has several.
fn solid_rules(selector: &str, parts: &[NamedPart<'_>]) -> Vec<String> {
    let mut numbered: BTreeMap<usize, Vec<&SolidAccount>> = BTreeMap::new();
    let solids = |part: &PartAccount| part.solids.iter().filter(|s| !s.faces.is_empty()).count();
    let is_whole = parts.iter().all(|(part, _)| solids(part) < 2);
    for solid in parts.iter().flat_map(|(part, _)| &part.solids).filter(|s| !s.faces.is_empty()) {
        numbered.entry(if is_whole { 0 } else { solid.index }).or_default().push(solid);
    }
    let rule = |(index, solids): (usize, Vec<&SolidAccount>)| {
        let number = if is_whole { String::new() } else { format!(", solid = {index}") };
        rule_text(&format!("{selector}{number}"), solids[0], if is_whole { parts.len() } else { solids.len() })
    };
    numbered.into_iter().map(rule).collect()
}

/// Returns a rule for one solid, or the first of `alike` that the selector means, with what may be said of it in a comment.
fn rule_text(selector: &str, solid: &SolidAccount, alike: usize) -> String {
    let first = if alike > 1 { format!("the first of {alike} of this name: ") } else { String::new() };
    let closed = if solid.closed { "closed" } else { "open: a medium would have a gap" };
    let size = solid.size_mm().map(toml_number).join(" × ");
    let colour = solid.colour().map_or(String::new(), |c| format!(", {c}"));
    let faces = solid.faces.len();
    format!("{{ {selector}, surface = \"absorber\" }},  # {first}{closed}, {faces} faces, {size} mm{colour}")
}

/// Sides of a box that differ by less than this share are equal: a round part fills its box to the rounding of its splines.
const EQUAL_SIDES: f64 = 0.01;

/// Returns the axis, 0 to 2, about which a box of these half sides is square, as that of a lens or a reflector is; z where no axis is alone
/// in that.
fn optical_axis(half: [f64; 3]) -> usize {
    let is_square = |k: &usize| {
        let [a, b] = [half[(k + 1) % 3], half[(k + 2) % 3]];
        (a - b).abs() < EQUAL_SIDES * a.max(b)
    };
    let square: Vec<usize> = (0..3).filter(is_square).collect();
    if let [axis] = square[..] { axis } else { 2 }
}

/// Returns the TOML of a beam along the axis of the model that covers it, a plane behind it, and a far field; for an empty model, about a
/// box of 2 mm.
fn light_text(model: &Model) -> String {
    let bounds = model.bounds();
    // A model without faces still gets a scene that can be read.
    let [low, high] =
        if bounds.is_empty() { [[-1.0; 3], [1.0; 3]] } else { [bounds.min.to_array(), bounds.max.to_array()] };
    let half = [0, 1, 2].map(|k| 0.5 * (high[k] - low[k]));
    let diagonal = 2.0 * half.iter().map(|h| h * h).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    // What is off by rounding alone stands at 0.
    let still = |x: f64| if x.abs() < ROUNDING * diagonal { 0.0 } else { x };
    let [low, high] = [low, high].map(|corner| corner.map(still));
    let middle = [0, 1, 2].map(|k| still(0.5 * (low[k] + high[k])));
    let axis = optical_axis(half);
    let across = half[(axis + 1) % 3].hypot(half[(axis + 2) % 3]);
    // A model that is a rod along the axis still gets a beam.
    let radius = BEAM_MARGIN * across.max(DISTANCE * diagonal / 10.0);
    let at = |along: f64| {
        let place: [String; 3] = std::array::from_fn(|k| toml_number(if k == axis { along } else { middle[k] }));
        format!("[{}]", place.join(", "))
    };
    let direction = ["[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"][axis];
    let up = ["[0, 0, 1]", "[0, 0, 1]", "[0, 1, 0]"][axis];
    let letter = ["x", "y", "z"][axis];
    let width = toml_number(RECEIVER_WIDTHS * radius);
    let parts = model.parts.len();
    format!(
        "# The model ({parts} part{}) lies within x {} … {}, y {} … {}, z {} … {} mm. A parallel beam along {letter} covers it.\n\
         # Other kinds: point, cone, lambertian, cosine, ies, eulumdat, rays. Faces of the model that shine, as an LED's chip:\n\
         # {{ kind = \"lambertian\", on = {{ entity = 17 }}, power = 2.5 }}, without at, direction and radius.\n\
         source = [\n    {{ kind = \"collimated\", at = {}, direction = {direction}, radius = {} }},\n]\n\n\
         # What comes out on the other side, cell by cell; and the light distribution: intensity by direction of all that leaves the\n\
         # model, with its polar diagram and IES file.\n\
         receiver = [\n    \
         {{ name = \"behind\", at = {}, normal = {direction}, size = [{width}, {width}], absorbs = false }},\n    \
         {{ name = \"distribution\", kind = \"far_field\", normal = {direction}, up = {up}, angles = \"C\", cells = [72, 90] }},\n]\n\n\
         [run]\nrays = 1_000_000  # unit = \"lm\" counts lumens, lux and candela\n",
        if parts == 1 { "" } else { "s" },
        toml_number(low[0]),
        toml_number(high[0]),
        toml_number(low[1]),
        toml_number(high[1]),
        toml_number(low[2]),
        toml_number(high[2]),
        at(low[axis] - DISTANCE * diagonal),
        toml_number(radius),
        at(high[axis] + DISTANCE * diagonal),
    )
}

/// Returns a number of five digits as TOML takes it; what has no such form keeps all digits.
fn toml_number(value: f64) -> String {
    // As `figures` writes for people: TOML knows neither their minus nor their spaces.
    let digits = figures(value, 5).replace('−', "-").replace('\u{202f}', "");
    digits.parse::<f64>().map_or_else(|_| value.to_string(), |_| digits)
}

/// Returns a text as a TOML string on one line.
fn toml_string(text: &str) -> String {
    printable_toml(serde_json::Value::from(text).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{FaceAccount, SurfaceKind};

    #[test]
    fn the_axis_is_that_about_which_the_box_is_square() {
        let halves = [[3.0, 5.0, 5.01], [5.0, 3.0, 5.0], [5.0, 5.0, 3.0], [5.0, 5.0, 5.0], [1.0, 2.0, 3.0]];
        assert_eq!(halves.map(optical_axis), [0, 1, 2, 2, 2]);
    }

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
        assert_eq!(rules.len(), 4, "{rules:?}");
        assert!(rules[0].contains("{ part = \"*\", surface"), "{rules:?}");
        assert!(rules[1].contains("{ part = \"led\", surface") && rules[1].contains("first of 2"), "{rules:?}");
        for (k, rule) in rules[2..].iter().enumerate() {
            assert!(rule.contains(&format!("{{ part = \"board\", solid = {k}, surface")), "{rule}");
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

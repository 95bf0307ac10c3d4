//! `lampyris init`: a commented scene for a STEP file, ready to be traced and to be changed.

use super::material_rules::{MOST_PLACES, instance_names, material_text, rule_texts, toml_number, toml_string};
use crate::cli::arguments::command::{PlacedLimit, RefusalLimit};
use crate::cli::completion::Completion;
use crate::cli::console::{Console, print, shell_word};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::cli::work::input_files;
use crate::cli::work::output_place::{folder_of, make_folder};
use crate::cli::work::threads::set_threads;
use crate::formats::{file_name, lower_extension, printable_line, write_atomic};
use crate::model::Model;
use crate::pipeline::LoadedModel;
use crate::step;
use crate::text::count_of;
use serde_json::json;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Parts that are placed several times that are named in a comment.
const MOST_PLACED_PARTS: usize = 10;
/// Distance of source and receiver from the model, and margin of the beam, as shares of the box' diagonal.
const DISTANCE: f64 = 0.5;
const BEAM_MARGIN: f64 = 1.05;
/// Coordinates below this share of the diagonal are rounding of the file's twelve digits.
const ROUNDING: f64 = 1e-9;
/// The receiver is so many times as wide as the beam.
const RECEIVER_WIDTHS: f64 = 4.0;

/// Writes a scene for a STEP file, and says so and what could not be read; a file that is there is never written over, but refused.
/// Incomplete where more faces were refused than the limit allows.
pub(crate) fn run(
    file: &Path,
    output: Option<&Path>,
    limits: RefusalLimit,
    placed: PlacedLimit,
    console: &Console,
) -> Result<Completion, Failure> {
    set_threads(None)?;
    let usual_name = PathBuf::from(last_component(file)).with_extension("toml");
    let scene_file = output.unwrap_or(&usual_name).to_path_buf();
    // Readers of the file go by its extension.
    if lower_extension(&scene_file) != "toml" {
        let failure = Failure::arguments(format!("-o {}: the name of a scene ends in .toml", scene_file.display()));
        let is_folder = scene_file.is_dir() || scene_file.file_name().is_none();
        let named = if is_folder { scene_file.join(&usual_name) } else { scene_file.with_extension("toml") };
        return Err(failure.with_help(format!("write -o {}", shell_word(&named.display().to_string()))));
    }
    let loaded = input_files::model_file(file, placed, console)?;
    // A scene has work in it: it is never written over.
    if scene_file.exists() {
        let failure = Failure::arguments(format!("{} already exists", scene_file.display()));
        return Err(failure.with_help("give another name with -o"));
    }
    make_folder(&folder_of(&scene_file))?;
    let Some(reference) = model_reference(file, &scene_file) else {
        let failure = Failure::arguments(format!("{}: no scene can name this file", file.display()));
        return Err(failure.with_help("its path is no UTF-8 text, as TOML is; give the file another name"));
    };
    let text = scene_text(file, &model_entry(&reference, placed), &loaded);
    write_atomic(&scene_file, |w| w.write_all(text.as_bytes()))?;
    if console.json {
        print(&json_text(&json!({"scene": scene_file.display().to_string()}))?)?;
    } else {
        console.say(format_args!("wrote {}", scene_file.display()));
        let scene = shell_word(&scene_file.display().to_string());
        console.say(console.dim(&format!("  say what the parts are made of, then `lampyris trace {scene}`")));
    }
    // Last, because the scene counts although faces are missing.
    Ok(input_files::report_refusals(&loaded, limits.max_refused, console))
}

/// Returns the model's entry in the scene, as TOML: its path, and the limit of what it may place where that is not the usual one.
fn model_entry(reference: &str, placed: PlacedLimit) -> String {
    let [asked, usual] = [placed.settings(), step::Settings::default()].map(|settings| settings.max_placed);
    let limit = if asked == usual { String::new() } else { format!(", max_placed = {asked}") };
    format!("{{ file = {}{limit} }}", toml_string(reference))
}

/// Returns the name of a file without its folder; a path that ends in no name is left whole.
fn last_component(file: &Path) -> &OsStr {
    file.file_name().unwrap_or(file.as_os_str())
}

/// Returns the model's path as the scene names it: its bare name where both are in one folder, else absolute. `None` where it is no UTF-8.
fn model_reference(file: &Path, scene_file: &Path) -> Option<String> {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let is_beside = folder_of(&absolute(file)) == folder_of(&absolute(scene_file));
    // A path beside the scene moves with it; any other must be absolute, because the scene may be read from elsewhere.
    let path = if is_beside { PathBuf::from(last_component(file)) } else { absolute(file) };
    path.into_os_string().into_string().ok()
}

/// Returns the whole scene as TOML, a line for each thing. `file` is for its heading, `entry` what names the model in it.
fn scene_text(file: &Path, entry: &str, loaded: &LoadedModel) -> String {
    let model = &loaded.model;
    let name = file_name(file);
    let material = material_text(&rule_texts(&model.account(), &instance_names(model)));
    let light = light_text(model);
    format!(
        "# A scene for {}: lengths in mm, powers in W. `lampyris schema --text` says what else may stand here.\n\
         title = {}\n\
         # Parts are left out by what selects them: {{ file = …, without = [{{ part = \"helper*\" }}] }}.\n\
         model = [{entry}]\n\n\
         # A face that no rule names absorbs all light that meets it. Rules select by part, instance, solid, face, entity (the #id\n\
         # of the file), layer, kind, radius_mm, colour or at (a point near the face); a later rule wins, for medium and surface apart.\n\
         # `lampyris info FILE --faces` shows what selects each face. In place of surface = \"absorber\" stands what it is:\n\
         # medium = \"PMMA\" (`lampyris media` lists the media that have names), or surface = \"mirror\", reflectance = 0.9.\n\
         {material}{}\n{light}",
        printable_line(&name),
        toml_string(&name),
        places_text(model)
    )
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

/// Sides of a box that differ by less than this share are equal: a round part fills its box to the rounding of its splines.
const EQUAL_SIDES: f64 = 0.01;

/// A box thinner than this share of its other sides is a flat sheet: a beam along it would meet nothing.
const FLAT_SHARE: f64 = 1e-6;

/// Returns the axis, 0 to 2, across a flat sheet that fills a box of these half sides, else that about which the box is square, as that of
/// a lens or a reflector is; z where no axis is alone in that.
fn optical_axis(half: [f64; 3]) -> usize {
    let is_across = |k: &usize| half[*k] < FLAT_SHARE * half[(k + 1) % 3].min(half[(k + 2) % 3]);
    if let Some(axis) = (0..3).find(is_across) {
        return axis;
    }
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
    format!(
        "# The model ({}) lies within x {} … {}, y {} … {}, z {} … {} mm. A parallel beam along {letter} covers it.\n\
         # Other kinds: point, cone, lambertian, cosine, ies, eulumdat, rays. Faces of the model that shine, as an LED's chip:\n\
         # {{ kind = \"lambertian\", on = {{ entity = 17 }}, power = 2.5 }}, without at, direction and radius.\n\
         source = [\n    {{ kind = \"collimated\", at = {}, direction = {direction}, radius = {} }},\n]\n\n\
         # What comes out on the other side, cell by cell; and the light distribution: intensity by direction of all that leaves the\n\
         # model, with its polar diagram and IES file.\n\
         receiver = [\n    \
         {{ name = \"behind\", at = {}, normal = {direction}, size = [{width}, {width}], absorbs = false }},\n    \
         {{ name = \"distribution\", kind = \"far_field\", normal = {direction}, up = {up}, angles = \"C\", cells = [72, 90] }},\n]\n\n\
         [run]\nrays = 1_000_000  # unit = \"lm\" counts lumens, lux and candela\n",
        count_of(model.parts.len() as u64, "part"),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_is_that_across_a_flat_sheet() {
        let halves = [[0.0, 5.0, 3.0], [5.0, 2e-15, 3.0], [5.0, 0.0, 5.0], [3.0, 3.0, 0.0], [0.0, 0.0, 3.0]];
        assert_eq!(halves.map(optical_axis), [0, 1, 1, 2, 2]);
    }

    #[test]
    fn the_axis_is_that_about_which_the_box_is_square() {
        let halves = [[3.0, 5.0, 5.01], [5.0, 3.0, 5.0], [5.0, 5.0, 3.0], [5.0, 5.0, 5.0], [1.0, 2.0, 3.0]];
        assert_eq!(halves.map(optical_axis), [0, 1, 2, 2, 2]);
    }
}

//! `lampyris info --faces`: parts, solids and faces as a tree, each face with what a rule of a scene can select it by.

use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::{json_text, json_value};
use crate::model::{FaceAccount, Model, PartAccount, PlacedFace, SolidAccount, are_shared};
use crate::simulate::face_selectors;
use crate::step::ImportReport;
use crate::text::{count_of, figures};
use serde_json::json;

/// Faces of a solid that are listed without -v; of more, the first ones and how many there are.
const SHOWN_FACES: usize = 60;

/// Places of a part that are listed.
const SHOWN_PLACES: usize = 12;

/// Coordinates below this are rounding of what the file has as 0, mm.
const ROUNDING_MM: f64 = 1e-9;

/// Prints the parts, solids and faces of a model as a tree; with `--json` the document that holds the same, with the report's
/// refusals and problems.
pub(crate) fn print_faces(model: &Model, report: &ImportReport, console: &Console) -> Result<(), Failure> {
    let parts = model.account();
    let mut selectors = part_selectors(model).into_iter();
    if console.json {
        let mut document = json!({
            "parts": json_value(&parts)?,
            "refusals": json_value(&report.refusals)?,
            "problems": json_value(&report.problems)?,
        });
        for (k, places) in model.labels_of_parts().into_iter().enumerate() {
            document["parts"][k]["places"] = places.into();
        }
        let solids =
            document["parts"].as_array_mut().into_iter().flatten().flat_map(|part| part["solids"].as_array_mut());
        for face in solids.flatten().flat_map(|solid| solid["faces"].as_array_mut()).flatten() {
            face["select"] = selectors.next().flatten().into();
        }
        return Ok(print(&json_text(&document)?)?);
    }
    let most = if console.verbose > 0 { usize::MAX } else { SHOWN_FACES };
    let places = model.labels_of_parts();
    let shared = are_shared(parts.iter().map(|part| part.name.as_str()));
    let tree: String = parts
        .iter()
        .zip(places.iter().zip(shared))
        .map(|(part, (places, shared))| part_text(part, (places, shared), most, &mut selectors))
        .collect();
    print(&tree)?;
    console.say(console.dim(
        "  behind each face: what selects it in a rule of a scene; rules also take solid, layer, kind, radius_mm, colour and at (a point)",
    ));
    Ok(())
}

/// Returns, for each face in the order of the account, the selector that means it, wherever its part stands; `None` for a part that stands
/// nowhere.
fn part_selectors(model: &Model) -> Vec<Option<String>> {
    let mut first: Vec<Option<usize>> = vec![None; model.parts.len()];
    for (k, instance) in model.instances.iter().enumerate() {
        // Where the part stands first: one face of a part has the same keys everywhere.
        first[instance.part.0 as usize].get_or_insert(k);
    }
    let mut faces: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    faces.retain(|f| first[f.part.0 as usize] == Some(f.instance));
    // The account goes by parts, the model by instances.
    faces.sort_by_key(|f| (f.part.0, f.id));
    let mut texts = face_selectors(model, &faces).into_iter().map(|s| Some(s.as_key()));
    let mut selectors = Vec::new();
    for (part, first) in model.parts.iter().zip(first) {
        match first {
            Some(_) => selectors.extend(texts.by_ref().take(part.face_count())),
            None => selectors.extend(std::iter::repeat_n(None, part.face_count())),
        }
    }
    selectors
}

/// Returns the lines of a part: its name, how often it is placed and as which instances (also of one place, where other parts share the
/// name), and its solids with at most `most` faces each. Takes a selector for each of its faces.
fn part_text(
    part: &PartAccount,
    (places, is_shared): (&[String], bool),
    most: usize,
    selectors: &mut impl Iterator<Item = Option<String>>,
) -> String {
    let placed = match places {
        [place] if is_shared => format!(", instance = {}", quoted_name(place)),
        [_] => String::new(),
        [] => ", placed nowhere".into(),
        _ => {
            let named: Vec<String> = places.iter().take(SHOWN_PLACES.min(most)).map(|p| quoted_name(p)).collect();
            let more = if places.len() > named.len() { ", …" } else { "" };
            format!(", placed {} times: instance = {}{more}", part.instances, named.join(", "))
        }
    };
    let mut text = format!("part {}{placed}\n", quoted_name(&part.name));
    for solid in &part.solids {
        text += &solid_text(solid, most, selectors);
    }
    text
}

/// Returns the lines of a solid and at most `most` of its faces, one a line. Takes a selector for each of its faces, shown or not.
fn solid_text(solid: &SolidAccount, most: usize, selectors: &mut impl Iterator<Item = Option<String>>) -> String {
    let closed = if solid.closed { "closed" } else { "open" };
    let name = if solid.name.is_empty() { String::new() } else { format!(" {}", quoted_name(&solid.name)) };
    let area: f64 = solid.faces.iter().map(|f| f.area_mm2).sum();
    let count = count_of(solid.faces.len() as u64, "face");
    let size = solid.size_mm().map(|x| figures(x, 4)).join(" × ");
    let colour = solid.colour().map_or(String::new(), |c| format!(", {c}"));
    let area = figures(area, 5);
    let mut text = format!("  solid {}{name}: {closed}, {count}, {area} mm², in {size} mm{colour}\n", solid.index);
    // Every selector is taken, shown or not, or the next solid would get those of this one.
    for (k, (face, selector)) in solid.faces.iter().zip(selectors).enumerate() {
        if k < most {
            text += &face_text(face, selector.as_deref());
        }
    }
    let rest = solid.faces.len().saturating_sub(most);
    if rest > 0 {
        text += &format!("    and {}; -v shows all, --json too\n", count_of(rest as u64, "more face"));
    }
    text
}

/// Returns the line of a face: entity, kind, area, a point on it, colour, layer, name and selector, if it has one.
fn face_text(face: &FaceAccount, selector: Option<&str>) -> String {
    let id = face.id.map_or_else(|| "–".to_owned(), |id| format!("#{id}"));
    let kind = face.kind.word();
    let radius = face.radius_mm.map_or(String::new(), |r| format!(" r {} mm", figures(r, 5)));
    let point = face.at.map(|x| figures(if x.abs() < ROUNDING_MM { 0.0 } else { x }, 6)).join(", ");
    let colour = face.colour.map_or(String::new(), |c| format!("  {c}"));
    let name = if face.name.is_empty() { String::new() } else { format!("  {}", quoted_name(&face.name)) };
    let layer = face.layer.as_ref().map_or(String::new(), |l| format!("  layer {}", quoted_name(l)));
    let selector = selector.map_or(String::new(), |s| format!("  {s}"));
    format!(
        "    {id:>8}  {:<22} {:>12} mm²  at [{point}]{colour}{layer}{name}{selector}\n",
        format!("{kind}{radius}"),
        figures(face.area_mm2, 5)
    )
}

/// Returns a name in quotes, or that there is none.
fn quoted_name(name: &str) -> String {
    if name.is_empty() { "without a name".into() } else { format!("\"{name}\"") }
}

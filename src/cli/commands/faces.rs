//! `lampyris info --faces`: parts, solids and faces as a tree, each face with what a rule of a scene can select it by.

use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::{json_text, json_value};
use crate::model::{FaceAccount, Model, PartAccount, SolidAccount};
use crate::report::{figures, grouped};
use serde_json::json;

/// Faces of a solid that are listed without -v; of more, the first ones and how many there are.
const SHOWN_FACES: usize = 60;

/// Prints the tree; with `--json` the document that holds the same.
pub(crate) fn print_faces(model: &Model, console: &Console) -> Result<(), Failure> {
    let parts = model.account();
    if console.json {
        return Ok(print(&json_text(&json!({"parts": json_value(&parts)?}))?)?);
    }
    let most = if console.verbose > 0 { usize::MAX } else { SHOWN_FACES };
    let tree: String = parts.iter().map(|part| part_text(part, most)).collect();
    print(&tree)?;
    console.say(console.dim(
        "  a rule of a scene selects by part, face (name), entity (the #id), colour or at (a point near the face)",
    ));
    Ok(())
}

fn part_text(part: &PartAccount, most: usize) -> String {
    let placed = if part.instances == 1 { String::new() } else { format!(", placed {} times", part.instances) };
    let mut text = format!("part {}{placed}\n", named(&part.name));
    for solid in &part.solids {
        text += &solid_text(solid, most);
    }
    text
}

fn solid_text(solid: &SolidAccount, most: usize) -> String {
    let closed = if solid.closed { "closed" } else { "open" };
    let name = if solid.name.is_empty() { String::new() } else { format!(" {}", named(&solid.name)) };
    let area: f64 = solid.faces.iter().map(|f| f.area_mm2).sum();
    let count = grouped(solid.faces.len() as u64);
    let mut text = format!("  solid {}{name}: {closed}, {count} faces, {} mm²\n", solid.index, figures(area, 5));
    for face in solid.faces.iter().take(most) {
        text += &face_text(face);
    }
    if solid.faces.len() > most {
        text += &format!("    and {} more faces; -v shows all, --json too\n", solid.faces.len() - most);
    }
    text
}

fn face_text(face: &FaceAccount) -> String {
    let id = face.id.map_or_else(|| "–".to_owned(), |id| format!("#{id}"));
    let kind = serde_json::to_value(face.kind).ok().and_then(|k| k.as_str().map(str::to_owned)).unwrap_or_default();
    let radius = face.radius_mm.map_or(String::new(), |r| format!(" r {} mm", figures(r, 5)));
    let point = face.at.map(|x| figures(x, 6)).join(", ");
    let colour = face.colour.map_or(String::new(), |c| format!("  {c}"));
    let name = if face.name.is_empty() { String::new() } else { format!("  {}", named(&face.name)) };
    let layer = face.layer.as_ref().map_or(String::new(), |l| format!("  layer {}", named(l)));
    format!(
        "    {id:>8}  {:<22} {:>12} mm²  at [{point}]{colour}{layer}{name}\n",
        format!("{kind}{radius}"),
        figures(face.area_mm2, 5)
    )
}

/// A name in quotes, or that there is none.
fn named(name: &str) -> String {
    if name.is_empty() { "without a name".into() } else { format!("\"{name}\"") }
}

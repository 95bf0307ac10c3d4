//! `lampyris media`: the media that a scene may name without describing them.

use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::cli::output::terminal_tables::blank_table;
use crate::optics::{catalogue, line};
use serde_json::{Value, json};

/// Wavelength at which an index is shown, nm: the yellow line of helium, for which glass is named.
const SHOWN_WAVELENGTH_NM: f64 = line::D;

/// Prints every medium that a scene may name, with its index at [`SHOWN_WAVELENGTH_NM`].
pub(crate) fn run(console: &Console) -> Result<Completion, Failure> {
    let index = |name: &str| Some(catalogue::medium(name)?.index.value(SHOWN_WAVELENGTH_NM));
    if console.json {
        let media: Vec<Value> = catalogue::names()
            .map(|name| {
                json!({"name": name, "index": index(name), "wavelength_nm": SHOWN_WAVELENGTH_NM,
                    "range_nm": catalogue::range_nm(name), "source": catalogue::source(name)})
            })
            .collect();
        print(&json_text(&json!({"media": media}))?)?;
        return Ok(Completion::Complete);
    }
    let mut table = blank_table(console.width());
    table.set_header(["medium", "index at 587.56 nm", "nm", "source"]);
    for name in catalogue::names() {
        let [shortest, longest] = catalogue::range_nm(name).unwrap_or([f64::NAN; 2]);
        table.add_row([
            name.to_owned(),
            index(name).map_or_else(|| "–".into(), |n| format!("{n:.5}")),
            format!("{shortest} … {longest}"),
            catalogue::source(name).unwrap_or("–").to_owned(),
        ]);
    }
    print(&format!(
        "{table}\n\n  in a scene: medium = \"PMMA\" in a [[material]]; others are described by a [[medium]]\n"
    ))?;
    Ok(Completion::Complete)
}

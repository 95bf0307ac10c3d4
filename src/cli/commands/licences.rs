//! `lampyris licences`: the licences of what the binary holds.

use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use serde_json::{Value, json};

/// Works that stand in the binary as they are: what they are for, under which licence, and its text.
const EMBEDDED: [(&str, &str, &str); 2] = [
    (
        "Ubuntu Light, the typeface of the static pictures",
        "Ubuntu Font Licence 1.0",
        include_str!("../licences/ubuntu-font.txt"),
    ),
    ("plotly.js 3, the interactive pictures of the report", "MIT", include_str!("../../report/plotly-licence.txt")),
];

/// Libraries compiled in, `name version licence` a line, as `cargo tree -e normal` lists them.
const LIBRARIES: &str = include_str!("../licences/libraries.txt");

/// Prints the licences of the program, of what stands in it, and of the libraries compiled in; with `--json` as a document.
pub(crate) fn run(console: &Console) -> Result<Completion, Failure> {
    if console.json {
        let work =
            |(work, licence, text): &(&str, &str, &str)| json!({"work": work, "licence": licence, "text": text});
        let works: Vec<Value> = EMBEDDED.iter().map(work).collect();
        let document = json!({"version": env!("CARGO_PKG_VERSION"), "licence": "MIT OR Apache-2.0",
            "works": works, "libraries": LIBRARIES.lines().collect::<Vec<_>>()});
        print(&json_text(&document)?)?;
        return Ok(Completion::Complete);
    }
    let mut text = format!(
        "lampyris {} is licensed under MIT or Apache-2.0, at your choice.\n\n\
         It holds these works as they are:\n",
        env!("CARGO_PKG_VERSION")
    );
    for (work, licence, _) in EMBEDDED {
        text += &format!("  {work}: {licence}\n");
    }
    text += "\nand is compiled with these libraries (name, version, licence):\n";
    for library in LIBRARIES.lines() {
        text += &format!("  {library}\n");
    }
    for (work, licence, terms) in EMBEDDED {
        text += &format!("\n{work}: {licence}\n\n{terms}");
    }
    print(&text)?;
    Ok(Completion::Complete)
}

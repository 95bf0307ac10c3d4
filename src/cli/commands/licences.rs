//! `lampyris licences`: the licences of what the binary holds.

use crate::cli::completion::Completion;
use crate::cli::console::print;
use crate::cli::failure::Failure;

/// Works that stand in the binary as they are: what they are for, under which licence, and its text.
const EMBEDDED: [(&str, &str, &str); 2] = [
    (
        "Ubuntu Light, the typeface of the static pictures",
        "Ubuntu Font Licence 1.0",
        include_str!("../licences/ubuntu-font.txt"),
    ),
    ("plotly.js 3, the interactive pictures of the page", "MIT", include_str!("../../report/plotly-licence.txt")),
];

/// Libraries compiled in, `name version licence` a line, as `cargo tree -e normal` lists them.
const LIBRARIES: &str = include_str!("../licences/libraries.txt");

/// Prints the licences of the program, of what stands in it, and of the libraries compiled in.
pub(crate) fn run() -> Result<Completion, Failure> {
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

//! A report as one page of HTML.

use super::document::{Block, Report, Section};
use super::provenance::Provenance;
use super::table::{Cell, Table};
use super::view::View;
use super::{plotly, static_chart};
use crate::formats::{base64, printable, printable_json};
use crate::text::{count_of, unbroken};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

/// The page's own script.
const PAGE_SCRIPT: &str = include_str!("page.js");

/// Gives the picture of a view as the bytes of a PNG file, or why it could not be drawn.
pub(super) type PngOf<'a> = &'a dyn Fn(&View) -> Result<Vec<u8>, String>;

/// Stands for the scripts until the rest of the page is made; no text of a report can hold it, because its marks are escaped there.
const SCRIPTS_GO_HERE: &str = "<!--scripts-->";

/// Writes the policy for the browser: nothing may be loaded from anywhere, and no script may run but these, which it knows by their hash
/// (Content Security Policy Level 3, 2.3.1); text never becomes code.
fn policy(scripts: &[&str]) -> String {
    let hash = |script: &&str| format!("'sha256-{}'", base64(&Sha256::digest(script.as_bytes())));
    let hashes: Vec<String> = scripts.iter().map(hash).collect();
    format!(
        "default-src 'none'; script-src {}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; \
         base-uri 'none'; form-action 'none'",
        hashes.join(" ")
    )
}

/// Writes the page, complete: styles, scripts, data, static twins; `png` draws the views. The library of plots goes only into a page that
/// has a picture.
pub(super) fn page(report: &Report, png: PngOf) -> String {
    // The library weighs more than all the rest: a page of text and tables goes without.
    let interactive =
        report.sections.iter().flat_map(|s| &s.blocks).any(|b| !matches!(b, Block::Text(_) | Block::Table(_)));
    let library = if interactive { plotly::script() } else { String::new() };
    let scripts: Vec<&str> = [library.as_str(), PAGE_SCRIPT].into_iter().filter(|s| !s.is_empty()).collect();
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(policy(&scripts));
                title { (report.title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                a.skip href="#answer" { "Skip to the answer" }
                header {
                    span.mark { "lampyris" }
                    nav aria-label="Sections" {
                        @for section in &report.sections { a href={ "#" (anchor(&section.title)) } { (section.title) } }
                    }
                    button #theme type="button" title="Light or dark" aria-label="Switch between light and dark" { "◐" }
                }
                main {
                    h1 { (report.title) }
                    p #answer.answer tabindex="-1" { (emphasised(&report.answer)) }
                    @for section in &report.sections { (section_markup(section, png)) }
                    (provenance_markup(&report.provenance))
                }
                (PreEscaped(SCRIPTS_GO_HERE))
            }
        }
    };
    // Names are data; the scripts, whose every character counts for their hash, come after that.
    let page = printable(&markup.into_string()).into_owned();
    let scripts: String = scripts.iter().map(|script| format!("<script>{script}</script>")).collect();
    page.replacen(SCRIPTS_GO_HERE, &scripts, 1)
}

/// Writes a section of the page; neighbouring pictures share a row, at most two.
fn section_markup(section: &Section, png: PngOf) -> Markup {
    let mut rows: Vec<Vec<&Block>> = Vec::new();
    for block in &section.blocks {
        let picture = |b: &Block| matches!(b, Block::Chart(_) | Block::View(_));
        match rows.last_mut() {
            Some(row) if row.len() == 1 && picture(row[0]) && picture(block) => row.push(block),
            _ => rows.push(vec![block]),
        }
    }
    html! {
        section id=(anchor(&section.title)) {
            h2 { (section.title) }
            @for row in rows {
                @if row.len() == 2 { div.pair { @for block in row { (block_markup(block, png)) } } }
                @else { @for block in row { (block_markup(block, png)) } }
            }
        }
    }
}

/// Writes a block of the page; a picture stands as SVG or PNG until the script makes it interactive.
fn block_markup(block: &Block, png: PngOf) -> Markup {
    match block {
        Block::Text(text) => html! { p { (emphasised(text)) } },
        Block::Table(table) => table_markup(table),
        Block::Chart(chart) => {
            let drawing = PreEscaped(static_chart::draw(chart).svg());
            figure_markup(&chart.name, &chart.title, &chart.caption, drawing, &plotly::chart(chart), false)
        }
        Block::View(view) => {
            let drawing = match png(view) {
                Ok(png) => html! { img src={ "data:image/png;base64," (base64(&png)) } alt=(view.title); },
                Err(e) => html! { p { "This view could not be drawn: " (e) } },
            };
            figure_markup(&view.name, &view.title, &view.caption, drawing, &plotly::view(view), true)
        }
    }
}

/// Writes a picture with its data for the script and links to its files; `solid` says that it is a 3-D view.
fn figure_markup(
    name: &str,
    title: &str,
    caption: &str,
    drawing: Markup,
    data: &serde_json::Value,
    solid: bool,
) -> Markup {
    // '<' would let a name end the script element.
    let json = printable_json(data.to_string()).replace('<', "\\u003c");
    let (kind, files): (_, &[&str]) = if solid { ("view", &["png"]) } else { ("chart", &["svg", "png"]) };
    html! {
        figure {
            h3 { (title) }
            div class={ "plot " (kind) } id={ "fig-" (name) } tabindex="0" role="group" aria-label=(title) { (drawing) }
            script type="application/json" data-for={ "fig-" (name) } { (PreEscaped(json)) }
            figcaption {
                (emphasised(caption))
                @if solid { span.keys { " Drag or arrow keys turn, wheel or + and − zoom, 0 resets." } }
                " Static picture:"
                @for kind in files { " " a href={ "figures/" (name) "." (kind) } { (kind.to_uppercase()) } }
            }
        }
    }
}

/// Returns how the style sheet calls a cell: `num` and `brief` do not break, `words` are given room for some in a line.
fn cell_class(cell: &Cell) -> &'static str {
    if cell.is_numeric() {
        "num"
    } else if cell.is_brief() {
        "brief"
    } else if cell.is_sentence() {
        "words"
    } else {
        ""
    }
}

/// Rows up to which a table is shown whole, all that regulations have among them; one of more is scrolled in a frame.
const MOST_WHOLE_ROWS: usize = 40;

/// Writes a table that can be sorted, copied and fetched as CSV.
fn table_markup(table: &Table) -> Markup {
    html! {
        div.table id={ "table-" (table.name) } {
            div.head {
                h3 { (table.title) }
                div {
                    button type="button" data-copy={ "table-" (table.name) } { "Copy" }
                    a.button href={ "tables/" (table.name) ".csv" } { "CSV" }
                }
            }
            div.scroll.whole[table.rows.len() <= MOST_WHOLE_ROWS] tabindex="0" role="region" aria-label=(table.title) {
                table {
                    thead { tr { @for column in &table.columns {
                        th scope="col" { button type="button" title="Sort" {
                            (column.title) @if !column.unit.is_empty() { " " span.unit { (column.unit) } }
                        } }
                    } } }
                    tbody { @for row in &table.rows { tr { @for cell in row {
                        td class=(cell_class(cell)) data-v=(cell.plain()) { (unbroken(&cell.shown())) }
                    } } } }
                }
            }
            @if !table.caption.is_empty() { p.caption { (emphasised(&table.caption)) } }
        }
    }
}

/// Commands of a merged run's parts that the page shows: of a thousand parts each has its own.
const SHOWN_COMMANDS: usize = 8;

/// Writes the section that states command, program, machine and seed.
fn provenance_markup(p: &Provenance) -> Markup {
    let seed = p.seed.map_or("none used".to_owned(), |s| s.to_string());
    let further = p.traced_by.len().saturating_sub(SHOWN_COMMANDS);
    html! {
        section #origin {
            h2 { "Where these numbers come from" }
            dl {
                dt { "Command" } dd { code { (p.command) } }
                @if !p.traced_by.is_empty() {
                    dt { "Traced by" }
                    dd {
                        @for command in p.traced_by.iter().take(SHOWN_COMMANDS) { div { code { (command) } } }
                        @if further > 0 { "and " (count_of(further as u64, "further command")) ", all in results.json" }
                    }
                }
                dt { "Time" } dd { (p.time) }
                dt { "Program" } dd { "lampyris " (p.version) ", commit " code { (p.commit) } }
                dt { "Hardware" } dd { (p.hardware) }
                dt { "Threads" } dd { (p.threads) }
                dt { "Seed" } dd { (seed) }
                dt { "Units" } dd { "mm, degrees, seconds, W or lm as written at each number" }
            }
        }
    }
}

/// Writes text with `**words**` as strong and words between backticks as code; everything else in it is escaped.
fn emphasised(text: &str) -> Markup {
    html! { @for (k, piece) in text.split("**").enumerate() {
        @if k % 2 == 1 { strong { (with_code(piece)) } } @else { (with_code(piece)) }
    } }
}

/// Writes text with words between backticks as code, where spaces stay what they are; a backtick without another after it stays.
fn with_code(text: &str) -> Markup {
    let last = text.split('`').count() - 1;
    html! { @for (k, piece) in text.split('`').enumerate() {
        @if k % 2 == 0 { (unbroken(piece)) } @else if k < last { code { (piece) } } @else { "`" (piece) }
    } }
}

/// Makes a title a name for links: lower case, words joined by hyphens; alike titles have one name.
fn anchor(title: &str) -> String {
    let lower = title.to_lowercase();
    lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Axis, Grid};
    use crate::report::Chart;
    use serde_json::Value;

    /// On paper, dark colours would print pale words on white.
    #[test]
    fn dark_colours_are_those_of_the_screen() {
        let dark: Vec<&str> =
            include_str!("page.css").lines().filter(|line| line.contains("color-scheme: dark;")).collect();
        assert!(dark.len() == 2 && dark.iter().all(|line| line.starts_with("@media screen ")), "{dark:?}");
    }

    #[test]
    fn words_between_backticks_are_code() {
        let written = emphasised("**Note:** add `medium = \"<PMMA>\"` or `rays`; a ` stays.").into_string();
        let wanted = "<strong>Note:</strong> add <code>medium = &quot;&lt;PMMA&gt;&quot;</code> or <code>rays</code>; a ` stays.";
        assert_eq!(written, wanted);
    }

    /// A note of a verdict beside ten other columns had one word in a line, and a table of 17 rows was cut at 12.
    #[test]
    fn notes_have_room_and_short_tables_no_frame() {
        let note = "18 500 instead where LED modules are driven by an electronic control gear";
        let classes = [Cell::Number(1.0, 2), "3.43L 0.57U".into(), note.into(), "Lateral variations".into()];
        assert_eq!(classes.each_ref().map(cell_class), ["num", "brief", "words", ""]);
        let mut table = Table::new("rows", "Rows", &[("row", "")]);
        (0..MOST_WHOLE_ROWS).for_each(|k| table.row([k.into()]));
        let is_whole = |table: &Table| table_markup(table).into_string().contains("class=\"scroll whole\"");
        assert!(is_whole(&table));
        table.row(["one more".into()]);
        assert!(!is_whole(&table));
    }

    /// An evenly lit disc, whose corners have no cells, is evenly bright: its darkest cell is not black.
    #[test]
    fn colours_of_a_map_begin_at_darkness() {
        let axes = [0; 2].map(|_| Axis { label: "x".into(), unit: "mm".into(), range: [-1.0, 1.0], cells: 2 });
        let (name, quantity, unit) = (String::new(), String::new(), "lx".into());
        let values = vec![f64::NAN, 1400.0, 1450.0, 1390.0];
        let grid = Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
        let heat = &plotly::chart(&Chart::map("disc", "", "", grid))["data"][0];
        assert_eq!([&heat["zmin"], &heat["zmax"]].map(Value::as_f64), [Some(0.0), Some(1450.0)]);
    }
}

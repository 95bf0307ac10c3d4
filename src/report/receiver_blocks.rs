//! What the report shows of one receiver: its map, and what people of the trade read beside it.

use super::colour_picture::colour_chart;
use super::framing::{LIT_PART_SHOWN, joined_cells, lit_part};
use super::lamp_figures::{Counted, encircled_power, lamp_table};
use super::maps::reading;
use super::number::unit_in_words;
use super::polar::polar;
use super::{Block, Chart};
use crate::formats::file_stem;
use crate::regulation::Assessment;
use crate::simulate::Results;

/// Draws the map of a receiver, framed around its light; the caption says where that is a part of it.
pub(super) fn framed_map(counted: &Counted<'_>) -> Chart {
    let Counted { receiver: r, figures, grid } = *counted;
    let title = format!("{}: {} ({})", r.name, grid.quantity, grid.unit);
    let stem = file_stem(&r.name);
    // Candela and lux beside watts: the unit distinguishes the files.
    let name = if grid.unit == unit_in_words(r.unit) { stem } else { format!("{stem}-{}", grid.unit) };
    let mut caption = reading(r, grid, figures.max.as_ref());
    let part = lit_part(grid);
    if part.is_some() {
        caption += LIT_PART_SHOWN;
    }
    let shown = part.unwrap_or_else(|| grid.clone());
    match joined_cells(&shown) {
        Some((joined, [a, b])) => {
            caption += &format!(" Shown: means of {a} × {b} cells; the files hold each.");
            Chart::map(&name, &title, &caption, joined)
        }
        None => Chart::map(&name, &title, &caption, shown),
    }
}

/// Returns those that apply of: the colours of a receiver that counts them, the polar diagram of a luminaire, the encircled power of a
/// spot, the figures of a lamp.
pub(super) fn trade_figures(counted: &Counted<'_>, results: &Results, judged: Option<&Assessment>) -> Vec<Block> {
    let Counted { receiver: r, grid, .. } = *counted;
    let in_candela = r.kind == "far_field" && grid.unit == "cd";
    let charts =
        [colour_chart(grid), polar(&r.name, grid), encircled_power(r, grid)].into_iter().flatten().map(Block::from);
    charts.chain(in_candela.then(|| Block::Table(lamp_table(counted, results, judged)))).collect()
}

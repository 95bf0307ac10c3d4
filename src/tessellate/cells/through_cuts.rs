//! Cuts through cells that do not hold with the nodes that hang on their sides.
//!
//! Where parameters run unevenly along a long cell, a triangle from a hanging node to a far corner leaves the surface beside it, and a quad
//! from side to side does not. What a cut meets on the other side is a hanging node for the cell there, which may have to be cut too: a
//! fuselage of 46 m, straight over half its length, fell apart into half a million triangles without.

use super::cell::{Cell, ProvedCell, Subdivision};
use super::cell_facets::CellFacets;
use super::grid_lines::{FACING, GridLines};
use crate::tessellate::nodes::edge_key;

/// Cells in a row that are cut at most.
const MAX_CELLS_IN_A_ROW: usize = 64;

/// A node to be added: on which side of the cell, and at which parameter along it.
type Counterpart = (usize, f64);

/// Adds to `lines` the nodes that let cells fall into quads from side to side: first the `open` ones, which do not hold with their hanging
/// nodes, then those on which the new nodes hang. A cell whose quads do not hold either, or that would be cut at the face's border, stays
/// as it is. Returns whether there are any.
pub(super) fn add_through_cuts(
    builder: &mut CellFacets<'_, '_, '_, '_>,
    cells: &Subdivision,
    corners: &[[u32; 4]],
    lines: &mut GridLines,
    open: Vec<usize>,
) -> bool {
    let (mut todo, mut any) = (open, false);
    for row in 0..MAX_CELLS_IN_A_ROW {
        let mut added: Vec<([usize; 2], f64)> = Vec::new();
        for k in todo {
            let proved = &cells.inside[k];
            let hanging = lines.hanging_nodes(&proved.cell);
            // Of the open ones it is known that they do not.
            if row > 0 && builder.holds(proved, &corners[k], &hanging) {
                continue;
            }
            let cut = counterparts(builder, &proved.cell, &hanging);
            if cut.is_empty() || !holds_when_cut(builder, proved, &corners[k], &hanging, &cut) {
                continue;
            }
            for (side, at) in cut {
                let uv = proved.cell.on_side(side, at);
                let node = builder.input.nodes.push_own(uv, builder.prover.surface.point(uv));
                added.push((lines.add_node(&proved.cell, side, at, node), at));
            }
        }
        if added.is_empty() {
            break;
        }
        any = true;
        added.sort_unstable_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
        let has_one_more = |cell: &Cell| {
            (0..4).any(|side| {
                let (line, d) = (lines.line_of_side(cell, side), side % 2);
                let next = added.partition_point(|(on, at)| (on, at) <= (&line, &cell.lo[d]));
                added.get(next).is_some_and(|(on, at)| *on == line && *at < cell.hi[d])
            })
        };
        todo = (0..cells.inside.len()).filter(|&k| has_one_more(&cells.inside[k].cell)).collect();
    }
    any
}

/// Returns the nodes that a cell lacks: one for each hanging node that none faces on the opposite side.
fn counterparts(builder: &CellFacets<'_, '_, '_, '_>, cell: &Cell, hanging: &[Vec<u32>; 4]) -> Vec<Counterpart> {
    let mut out = Vec::new();
    for side in 0..2 {
        let near = FACING * (cell.hi - cell.lo)[side];
        let ascending = |side: usize| -> Vec<f64> {
            let mut at: Vec<f64> = hanging[side].iter().map(|&n| builder.input.nodes[n].uv[side % 2]).collect();
            at.sort_by(f64::total_cmp);
            at
        };
        let [here, there] = not_faced([&ascending(side), &ascending(side + 2)], near);
        out.extend(here.into_iter().map(|at| (side + 2, at)));
        out.extend(there.into_iter().map(|at| (side, at)));
    }
    out
}

/// Returns, of two ascending lists of places, those that none of the other list faces within `near`. A place faces one other, and leaves it
/// to the next of its own list where that is nearer.
fn not_faced([here, there]: [&[f64]; 2], near: f64) -> [Vec<f64>; 2] {
    let mut alone = [Vec::new(), Vec::new()];
    let (mut i, mut j) = (0, 0);
    while i < here.len() || j < there.len() {
        let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(f64::INFINITY);
        let (a, b) = (at(here, i), at(there, j));
        let nearer_comes = if a < b { at(here, i + 1) - b } else { at(there, j + 1) - a }.abs() < (a - b).abs();
        if (a - b).abs() <= near && !nearer_comes {
            (i, j) = (i + 1, j + 1);
        } else if a < b {
            alone[0].push(a);
            i += 1;
        } else {
            alone[1].push(b);
            j += 1;
        }
    }
    alone
}

/// Whether a cell holds as quads once it has the nodes of `cut`, none of which may divide a side of the border.
fn holds_when_cut(
    builder: &mut CellFacets<'_, '_, '_, '_>,
    proved: &ProvedCell,
    corners: &[u32; 4],
    hanging: &[Vec<u32>; 4],
    cut: &[Counterpart],
) -> bool {
    let mark = builder.input.nodes.mark();
    let mut hanging = hanging.clone();
    let mut holds = true;
    for &(side, at) in cut {
        let d = side % 2;
        let uv = proved.cell.on_side(side, at);
        let nodes = &mut *builder.input.nodes;
        // Sides run counter-clockwise: those of the top and the left descend.
        let is_before = |n: u32| if side < 2 { nodes[n].uv[d] < at } else { nodes[n].uv[d] > at };
        let place = hanging[side].partition_point(|&n| is_before(n));
        let before = place.checked_sub(1).map_or(corners[side], |i| hanging[side][i]);
        let after = hanging[side].get(place).copied().unwrap_or(corners[(side + 1) % 4]);
        holds &= !builder.input.chords.contains_key(&edge_key(before, after));
        hanging[side].insert(place, nodes.push_own(uv, builder.prover.surface.point(uv)));
    }
    holds = holds && builder.cut_across(proved.slack, corners, &hanging).is_some();
    builder.input.nodes.rewind(mark);
    holds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_faces_the_nearest_of_the_other_side() {
        let none = [Vec::<f64>::new(), vec![]];
        assert_eq!(not_faced([&[], &[]], 0.2), none);
        assert_eq!(not_faced([&[1.0, 2.0], &[1.1, 1.9]], 0.2), none);
        assert_eq!(not_faced([&[1.0, 2.0], &[1.5]], 0.2), [vec![1.0, 2.0], vec![1.5]]);
        // As wide apart as places may be that face each other: the first one is alone, and no other has two in its place.
        assert_eq!(not_faced([&[1.0, 1.2, 1.4], &[0.8, 1.0, 1.2, 1.4]], 0.3), [vec![], vec![0.8]]);
        assert_eq!(not_faced([&[0.8, 1.0, 1.2], &[1.0, 1.2, 1.4]], 0.3), [vec![0.8], vec![1.4]]);
    }
}

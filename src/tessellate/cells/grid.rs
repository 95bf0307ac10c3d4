//! Whole cells as facets, and how their hanging vertices are resolved without cracks.

use super::cell::{Cell, Subdivision};
use super::cell_facets::{CellFacets, Grid, GridInput, nodes_around};
use super::grid_lines::GridLines;
use super::through_cuts::add_through_cuts;
use crate::math::Uv;
use crate::tessellate::nodes::{Nodes, ProvedFacet, edge_key};
use crate::tessellate::proof::prover::Prover;
use rustc_hash::FxHashMap;

/// Makes facets of the cells inside; a cell with nodes on its sides becomes several, and one that does not hold so is cut through. What
/// does not hold then stays open, for the transition to fill. Adds nodes to those of the border.
pub(in crate::tessellate) fn build(prover: &mut Prover<'_, '_>, cells: &Subdivision, input: GridInput<'_>) -> Grid {
    let border = input.nodes.len();
    // Nodes of the border and corners of cells come onto the lines first, bridges then: what hangs on a side is
    // known only when all are there.
    let mut lines = GridLines::new(cells, input.resolution);
    let corners = corners_of_cells(cells, &mut lines, input.nodes);
    lines.sort();
    add_bridges(prover, cells, &corners, &mut lines, input.nodes);
    let mut builder = CellFacets { prover, input };
    let (grid, open) = facets_of_cells(&mut builder, cells, &corners, &lines, border);
    // Nodes inside of cells that are made anew are left over; no facet has them.
    if add_through_cuts(&mut builder, cells, &corners, &mut lines, open) {
        facets_of_cells(&mut builder, cells, &corners, &lines, border).0
    } else {
        grid
    }
}

/// Makes facets of the cells inside, and returns with them the indices of those that stay open. `corners` are by cell, nodes before
/// `border` are the border's.
fn facets_of_cells(
    builder: &mut CellFacets<'_, '_, '_, '_>,
    cells: &Subdivision,
    corners: &[[u32; 4]],
    lines: &GridLines,
    border: u32,
) -> (Grid, Vec<usize>) {
    let (mut grid, mut open) = (Grid::default(), Vec::new());
    // Sides of facets in the order in which they were met, so that the outline is the same bits every time.
    let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut order: Vec<[u32; 2]> = Vec::new();
    for (i, (proved, corners)) in cells.inside.iter().zip(corners).enumerate() {
        // A node on a side that belongs to the neighbours alone would be a crack; the cell must be cut from it.
        let hanging = lines.hanging_nodes(&proved.cell);
        let polygon = nodes_around(corners, &hanging);
        let at_border = polygon.iter().any(|&n| n < border);
        let made = if polygon.len() > 4 {
            builder.with_hanging_nodes(proved, corners, &hanging, &mut grid)
        } else if at_border {
            // The border's points are not quite where the cell's corners were proved to be.
            builder.at_border(proved, corners).map(|quad| grid.quads.push(quad))
        } else {
            let nodes = std::array::from_fn(|k| corners[(k + proved.first) % 4]);
            grid.quads.push(ProvedFacet { nodes, bound: proved.bound, tolerance: proved.tolerance });
            Some(())
        };
        // Not made: its place is left open, and the outline lets the transition fill it.
        if made.is_none() {
            open.push(i);
            continue;
        }
        for (i, &a) in polygon.iter().enumerate() {
            let name = edge_key(a, polygon[(i + 1) % polygon.len()]);
            let count = uses.entry(name).or_insert(0);
            if *count == 0 {
                order.push(name);
            }
            *count += 1;
        }
    }
    // A side that two facets share is inside; what is used once must be met by the transition.
    grid.outline = order.into_iter().filter(|name| uses[name] % 2 == 1).collect();
    (grid, open)
}

/// Returns the nodes at the corners of each cell inside, in the order of [`Cell::corners`]: a node of the border where one stands there,
/// else a new one. Puts them, and all border nodes that lie on a line, on `lines`, unsorted.
fn corners_of_cells(cells: &Subdivision, lines: &mut GridLines, nodes: &mut Nodes) -> Vec<[u32; 4]> {
    let mut at_crossing: FxHashMap<[usize; 2], u32> = FxHashMap::default();
    for (id, n) in (0..).zip(nodes.iter()) {
        let crossing = match [lines.find(0, n.uv.x), lines.find(1, n.uv.y)] {
            // Where the border passes through a corner of cells its node is taken, so that both meet in one point.
            [Some(i), Some(j)] => {
                // The first one stands for all in its place.
                if at_crossing.contains_key(&[i, j]) {
                    continue;
                }
                at_crossing.insert([i, j], id);
                [Some(i), Some(j)]
            }
            other => other,
        };
        for d in 0..2 {
            if let Some(i) = crossing[d] {
                lines.nodes[d][i].push((n.uv[1 - d], id));
            }
        }
    }
    let mut corner = |uv: Uv, place| {
        let crossing = [lines.side_line(0, uv.x), lines.side_line(1, uv.y)];
        *at_crossing.entry(crossing).or_insert_with(|| {
            let id = nodes.push_own(uv, place);
            lines.nodes[0][crossing[0]].push((uv.y, id));
            lines.nodes[1][crossing[1]].push((uv.x, id));
            id
        })
    };
    cells
        .inside
        .iter()
        .map(|proved| {
            let uv = proved.cell.corners();
            [0, 1, 2, 3].map(|k| corner(uv[k], proved.places[k]))
        })
        .collect()
}

/// Adds the nodes of [`GridLines::bridges`] to `nodes` and to the sorted `lines`, so that hanging vertices on opposite sides of cells face
/// each other.
fn add_bridges(
    prover: &Prover<'_, '_>,
    cells: &Subdivision,
    corners: &[[u32; 4]],
    lines: &mut GridLines,
    nodes: &mut Nodes,
) {
    let named: Vec<(Cell, [u32; 4])> = cells.inside.iter().map(|l| l.cell).zip(corners.iter().copied()).collect();
    for bridge in lines.bridges(&named, nodes) {
        let (cell, _) = named[bridge.cell];
        let uv = cell.on_side(bridge.side, bridge.at);
        lines.add_node(&cell, bridge.side, bridge.at, nodes.push_own(uv, prover.surface.point(uv)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Homogeneous;
    use crate::nurbs::Surface;
    use crate::tessellate::cells::candidate_facet::CandidateFacet;
    use crate::tessellate::cells::cell::ProvedCell;
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::proof::border_chord::BorderChords;
    use crate::tessellate::settings::{Acceptance, ToleranceField};
    use crate::tessellate::taken_chords::NO_CHORDS;

    /// On the sheet (1000 u², 0.8 v, 0) mm a straight line across parameters is none in space: half of a long cell reaches 0.16 mm
    /// beyond its diagonal, more than the tolerance.
    #[test]
    fn a_long_cell_with_a_hanging_node_is_cut_through() {
        let points = [0.0, 0.0, 1000.0].map(|x| [0.0, 0.8].map(|y| Homogeneous::new(x, y, 0.0, 1.0)));
        let knots = [[vec![0.0; 3], vec![1.0; 3]].concat(), [vec![0.0; 2], vec![1.0; 2]].concat()];
        let spline = Surface { degree: [2, 1], knots, points: points.as_flattened().to_vec() };
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(&spline, false, field);
        let mut prover = Prover::new(&surface, Acceptance::default());
        let mut prove = |lo: [f64; 2], hi: [f64; 2]| {
            let cell = Cell { lo: lo.into(), hi: hi.into() };
            let candidate = CandidateFacet::new(&surface, cell);
            let bound = candidate.bound(&mut prover, cell, 0.1);
            let (first, places) = (candidate.first_corner(), candidate.places());
            ProvedCell { cell, bound, tolerance: 0.1, slack: 1.0, first, places }
        };
        // The long cell, one beyond it, and two before it that share a node on its side.
        let inside = vec![
            prove([0.1, 0.0], [0.9, 1.0]),
            prove([0.9, 0.0], [1.0, 1.0]),
            prove([0.0, 0.0], [0.1, 0.9]),
            prove([0.0, 0.9], [0.1, 1.0]),
        ];
        assert!(inside.iter().all(|cell| cell.bound <= 0.1));
        let cells = Subdivision { inside, ..Subdivision::default() };
        let (mut nodes, chords) = (Nodes::default(), BorderChords::default());
        let input =
            GridInput { nodes: &mut nodes, chords: &chords, resolution: Uv::splat(1e-9), taken: &NO_CHORDS };
        let grid = build(&mut prover, &cells, input);
        // Two before, two of the long one; the short one beyond holds as three triangles.
        assert_eq!((grid.quads.len(), grid.triangles.len()), (4, 3));
        assert!(grid.quads.iter().all(|quad| quad.bound <= 0.1));
        assert!(grid.triangles.iter().all(|triangle| triangle.bound <= 0.1));
        // No cell is open: the outline is that of the sheet, three sides along either edge of u, two and one along those of v.
        assert_eq!(grid.outline.len(), 9);
    }
}

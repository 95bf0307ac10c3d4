//! From cells to nodes and blocks: cells merged into full nodes, children next to each other.

use super::cell::{Cell, Content};
use super::clip::Box32;
use super::node::{Block, CHILDREN, Link, Node};
use super::node_areas::{NodeAreas, shares};
use super::{Settings, Statistics};
use crate::math::{Point, huge_pages};
use crate::mesh::FacetMesh;
use rayon::prelude::*;

/// The tree as it is walked.
pub(super) struct Flat {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) root: Link,
}

/// Nodes and the facets of blocks, with links into both.
#[derive(Default)]
struct Draft {
    nodes: Vec<Node>,
    /// Count and facets of each.
    blocks: Vec<(u8, [u32; 4])>,
    stats: Statistics,
}

/// Levels from the top whose children are drafted in parallel.
const PARALLEL_LEVELS: u32 = 2;

/// Lays cells out as arrays of nodes and blocks relative to `center`, and counts them in `stats`, of which only `left_out` is kept.
pub(super) fn flatten(
    mesh: &FacetMesh,
    center: Point,
    cell: Cell,
    settings: &Settings,
    stats: &mut Statistics,
) -> Flat {
    let mut draft = Draft::default();
    let root = draft.add(cell, settings.collapse, 0, None);
    assert!(draft.blocks.len() <= Link::MOST_BLOCKS, "more blocks than links can name");
    let mut blocks = huge_pages::with_capacity(draft.blocks.len());
    (draft.blocks.par_iter())
        .map(|(count, facets)| Block::new(mesh, center, &facets[..usize::from(*count)]))
        .collect_into_vec(&mut blocks);
    let mut nodes = huge_pages::with_capacity(draft.nodes.len());
    nodes.extend_from_slice(&draft.nodes);
    // What was left out is counted while cells grow; the draft knows of nodes and blocks alone.
    let left_out = stats.left_out;
    *stats = draft.stats;
    stats.left_out = left_out;
    Flat { nodes, blocks, root }
}

impl Draft {
    /// Adds a cell with all below it and returns its link. A node goes to the place `reserved`, or to the end where none is.
    fn add(&mut self, cell: Cell, collapse: bool, depth: u32, reserved: Option<usize>) -> Link {
        match cell.content {
            Content::Block(count, facets) => {
                self.stats.count_block(depth, count);
                self.blocks.push((count, facets));
                Link::block(self.blocks.len() - 1, count)
            }
            Content::Cells(inner) => {
                let me = reserved.unwrap_or_else(|| self.reserve(1));
                self.stats.nodes += 1;
                // Cells have eight octants of which a surface meets four or so; grandchildren fill the empty
                // places.
                let children = if collapse { open_cells(inner.cells) } else { inner.cells };
                let mut node = Node::bounding(&cell.bounds);
                let boxes: Vec<_> = children.iter().map(|c| c.bounds).collect();
                let links = if depth < PARALLEL_LEVELS {
                    self.add_parallel(children, collapse, depth)
                } else {
                    self.add_in_turn(children, collapse, depth)
                };
                let (long_axis, slots) = slots(&boxes);
                node.long_axis = long_axis as u32;
                for ((bounds, link), slot) in boxes.iter().zip(links).zip(slots) {
                    node.set_child(slot, bounds, link);
                }
                self.nodes[me] = node;
                Link::node(me)
            }
        }
    }

    /// Makes room for nodes; returns where it begins.
    fn reserve(&mut self, count: usize) -> usize {
        self.nodes.resize(self.nodes.len() + count, Node::EMPTY);
        self.nodes.len() - count
    }

    /// Adds children one after the other, sibling nodes next to each other and sibling blocks too, and returns the links to them.
    fn add_in_turn(&mut self, children: Vec<Cell>, collapse: bool, depth: u32) -> Vec<Link> {
        // Room for the nodes first, so that siblings lie side by side while whatever hangs below them goes behind.
        let inner = children.iter().filter(|c| matches!(c.content, Content::Cells(_))).count();
        let mut place = self.reserve(inner);
        let mut links = vec![Link::node(0); children.len()];
        let mut waiting = Vec::with_capacity(inner);
        for (slot, child) in children.into_iter().enumerate() {
            if matches!(child.content, Content::Cells(_)) {
                waiting.push((slot, child));
            } else {
                links[slot] = self.add(child, collapse, depth + 1, None);
            }
        }
        for (slot, child) in waiting {
            links[slot] = self.add(child, collapse, depth + 1, Some(place));
            place += 1;
        }
        links
    }

    /// Adds children, drafted in parallel, in their order, and returns the links to them.
    fn add_parallel(&mut self, children: Vec<Cell>, collapse: bool, depth: u32) -> Vec<Link> {
        // Each child into arrays of its own, put together in the order of the children: the tree is the same for
        // any number of threads.
        let drafts: Vec<(Draft, Link)> = children
            .into_par_iter()
            .map(|child| {
                let mut draft = Draft::default();
                let link = draft.add(child, collapse, depth + 1, None);
                (draft, link)
            })
            .collect();
        drafts.into_iter().map(|(draft, link)| self.append(draft, link)).collect()
    }

    /// Puts a draft behind this one, with its counts; `link`, which leads into it, is returned as it now is.
    fn append(&mut self, draft: Draft, link: Link) -> Link {
        let (nodes, blocks) = (self.nodes.len(), self.blocks.len());
        self.blocks.extend(draft.blocks);
        self.nodes.extend(draft.nodes.into_iter().map(|mut node| {
            // Of slots that are in use alone: a zero that is moved would lead back up the tree, for ever.
            for slot in node.slots() {
                node.children[slot] = Link(node.children[slot]).moved(nodes, blocks).0;
            }
            node
        }));
        self.stats.add(&draft.stats);
        link.moved(nodes, blocks)
    }
}

/// Opens those of the cells in a cell that do not become nodes, so that what is left are the children of its node: [`CHILDREN`] at most.
fn open_cells(cells: Vec<Cell>) -> Vec<Cell> {
    let mut children = Vec::with_capacity(CHILDREN);
    open_into(cells, CHILDREN, &mut children);
    children
}

/// Opens cells within so many places, at least one for each, and adds what is left to `children`.
fn open_into(cells: Vec<Cell>, places: usize, children: &mut Vec<Cell>) {
    let areas: Vec<NodeAreas> = cells.iter().map(|cell| *cell.node_areas()).collect();
    for ((cell, areas), share) in cells.into_iter().zip(&areas).zip(shares(&areas, places)) {
        match cell.content {
            Content::Cells(inner) if areas.is_opened(share) => open_into(inner.cells, share, children),
            content => children.push(Cell { content, ..cell }),
        }
    }
}

/// Returns the axis along which up to sixteen boxes lie farthest apart, and slots for them: those of the upper half along it, from eight
/// on, and within each half by octant, so that [`Node::slot_order`] gives the order in which rays mostly meet them.
fn slots(boxes: &[Box32]) -> (usize, Vec<usize>) {
    let middles: Vec<[f32; 3]> = boxes.iter().map(|b| std::array::from_fn(|a| b.low[a] + b.high[a])).collect();
    let spread = |axis: usize| {
        let along = || middles.iter().map(|m| m[axis]);
        along().fold(f32::NEG_INFINITY, f32::max) - along().fold(f32::INFINITY, f32::min)
    };
    let long_axis = (1..3).fold(0, |longest, a| if spread(a) > spread(longest) { a } else { longest });
    let mut order: Vec<usize> = (0..middles.len()).collect();
    order.sort_by(|&i, &k| middles[i][long_axis].total_cmp(&middles[k][long_axis]));
    let mut slots = vec![0; middles.len()];
    let (lower, upper) = order.split_at(middles.len() / 2);
    for (first, half) in [(0, lower), (CHILDREN / 2, upper)] {
        let middles: Vec<[f32; 3]> = half.iter().map(|&child| middles[child]).collect();
        for (&child, slot) in half.iter().zip(octant_slots(&middles)) {
            slots[child] = first + slot;
        }
    }
    (long_axis, slots)
}

/// Places for up to eight boxes with these middles such that the one at place `p ^ octant` is mostly met before those of larger `p` by
/// rays of an octant: each box stands at the corner of a cube that it is nearest to, as far as that is free.
///
/// Source: Ylitie, Karras, Laine, HPG 2017, section 3.3, with the greedy choice in place of the auction.
fn octant_slots(middles: &[[f32; 3]]) -> [usize; 8] {
    let mut mean = [0.0; 3];
    for middle in middles {
        for a in 0..3 {
            mean[a] += middle[a] / middles.len() as f32;
        }
    }
    let mut slots = [0; 8];
    let mut open = [true; 8];
    let mut placed = [false; 8];
    for _ in 0..middles.len().min(8) {
        let mut best = (f32::NEG_INFINITY, 0, 0);
        for (child, middle) in middles.iter().enumerate().filter(|(child, _)| !placed[*child]) {
            let [x, y, z] = std::array::from_fn(|a| middle[a] - mean[a]);
            for slot in (0..8).filter(|&slot| open[slot]) {
                let toward = |a: usize, x: f32| if slot >> a & 1 == 1 { x } else { -x };
                let gain = toward(0, x) + toward(1, y) + toward(2, z);
                if gain > best.0 {
                    best = (gain, child, slot);
                }
            }
        }
        let (_, child, slot) = best;
        slots[child] = slot;
        open[slot] = false;
        placed[child] = true;
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box whose half area is this.
    fn bounds(area: f32) -> Box32 {
        Box32 { low: [0.0; 3], high: [area, 1.0, 0.0] }
    }

    /// A cell of so many blocks, divided at random into two to eight, with areas that are whole numbers, so that sums are exact.
    fn cell(blocks: usize, random: &mut impl FnMut(usize) -> usize) -> Cell {
        if blocks == 1 {
            return Cell { bounds: bounds(1.0), content: Content::Block(1, [0, u32::MAX, u32::MAX, u32::MAX]) };
        }
        let mut counts = vec![1; (2 + random(7)).min(blocks)];
        for _ in counts.len()..blocks {
            let k = random(counts.len());
            counts[k] += 1;
        }
        let cells = counts.into_iter().map(|count| cell(count, random)).collect();
        Cell::of_cells(bounds((1 + random(1000)) as f32), cells)
    }

    /// The least area of the node of a cell and those below it, by trying all ways to open cells.
    fn least_area(cell: &Cell) -> f32 {
        let Content::Cells(inner) = &cell.content else { return 0.0 };
        let mut least = f32::INFINITY;
        let mut ways = vec![(inner.cells.iter().collect::<Vec<&Cell>>(), Vec::<&Cell>::new())];
        while let Some((mut waiting, closed)) = ways.pop() {
            if waiting.len() + closed.len() > CHILDREN {
                continue;
            }
            let Some(next) = waiting.pop() else {
                least = least.min(closed.iter().map(|cell| least_area(cell)).sum());
                continue;
            };
            if let Content::Cells(inner) = &next.content {
                ways.push((waiting.iter().copied().chain(&inner.cells).collect(), closed.clone()));
            }
            ways.push((waiting, closed.into_iter().chain([next]).collect()));
        }
        cell.bounds.half_area() + least
    }

    /// The area of the node of a cell and of those below it, as they come of [`open_cells`], and the blocks under them.
    fn opened(cell: Cell) -> (f32, usize) {
        let Content::Cells(inner) = cell.content else { return (0.0, 1) };
        let children = open_cells(inner.cells);
        assert!((2..=CHILDREN).contains(&children.len()));
        children.into_iter().map(opened).fold((cell.bounds.half_area(), 0), |(a, b), (area, n)| (a + area, b + n))
    }

    #[test]
    fn nodes_have_the_least_area_of_all_ways_to_open_cells() {
        let mut state = 1u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for blocks in (2..=22).chain([22; 30]) {
            let cell = cell(blocks, &mut random);
            let least = least_area(&cell);
            assert_eq!(opened(cell), (least, blocks));
        }
    }

    /// Boxes without area, of facets on a line, still fill nodes.
    #[test]
    fn cells_without_area_are_opened() {
        let block = || Cell { bounds: bounds(0.0), content: Content::Block(1, [0, u32::MAX, u32::MAX, u32::MAX]) };
        let chain = (0..15).fold(block(), |inner, _| Cell::of_cells(bounds(0.0), vec![block(), inner]));
        let Content::Cells(inner) = chain.content else { unreachable!("of cells") };
        assert_eq!(open_cells(inner.cells).len(), CHILDREN);
    }
}

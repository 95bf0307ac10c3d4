//! From cells to nodes and blocks: sparse octants merged into full nodes, children next to each other.

use super::cell::{Cell, Content};
use super::clip::Box32;
use super::node::{Block, CHILDREN, Link, Node};
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
            Content::Cells(cells) => {
                let me = reserved.unwrap_or_else(|| self.reserve(1));
                self.stats.nodes += 1;
                // Cells have eight octants of which a surface meets four or so; grandchildren fill the empty
                // places.
                let children = if collapse { merge(cells) } else { cells };
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
            // An unused child stays zero, by which vector instructions tell it: its box means nothing, and a moved zero led them back up
            // the tree for ever.
            for slot in node.slots() {
                node.children[slot] = Link(node.children[slot]).moved(nodes, blocks).0;
            }
            node
        }));
        self.stats.add(&draft.stats);
        link.moved(nodes, blocks)
    }
}

/// Replaces the largest inner child by its own children, as long as no more than [`CHILDREN`] come of it.
fn merge(mut children: Vec<Cell>) -> Vec<Cell> {
    loop {
        let mut best: Option<(f32, usize)> = None;
        for (i, child) in children.iter().enumerate() {
            if let Content::Cells(inner) = &child.content
                && children.len() - 1 + inner.len() <= CHILDREN
            // Opening a child takes one place away and adds as many as it has.
            {
                let area = child.bounds.half_area();
                // Of equal ones the last, so that the result does not depend on how children were swapped before.
                if best.is_none_or(|(a, _)| area >= a) {
                    best = Some((area, i));
                }
            }
        }
        let Some((_, i)) = best else { return children };
        if let Content::Cells(inner) = children.swap_remove(i).content {
            children.extend(inner);
        }
    }
}

/// Returns the axis along which up to sixteen boxes lie farthest apart, and slots for them: those of the upper half along it, from eight
/// on, and within each half by octant, so that [`Node::slot_order`] tells the order in which rays mostly meet them.
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

//! Whether what was read is a tree of its mesh, in one pass over the nodes and one over the blocks.
//!
//! Guarantee: each node and block but the root hangs in one place, so that a walk comes to each once at most; levels, blocks and facets are
//! as many as the statistics say; what a link says that a block holds are facets of the mesh with their corners. Weakness: boxes and
//! rounded corners, which only building anew would prove, may be false, and facets may be left out: hits are missed there.

use super::Statistics;
use super::node::{Block, CHILDREN, Link, Node, Target};
use super::tree::DEEPEST;
use crate::math::simd::{self, Instructions, Kernel};
use crate::mesh::FacetMesh;

/// Takes the nodes of a tree in their order, then its blocks, and notes what is wrong with them.
pub(super) struct TreeCheck<'m> {
    mesh: &'m FacetMesh,
    /// The level of each node: 1 for the root, 0 until a link leads to it.
    levels: Vec<u8>,
    /// The number of facets of each block by its link, 0 until one leads to it.
    fills: Vec<u8>,
    /// Nodes that were taken, and blocks that links lead to.
    counted: Statistics,
    /// Blocks that were taken.
    blocks: usize,
    is_broken: bool,
}

impl<'m> TreeCheck<'m> {
    /// Begins with the root of a tree of as many nodes and blocks as it is said to have, for each of which a byte is set aside.
    pub(super) fn new(mesh: &'m FacetMesh, root: Option<Link>, expected: &Statistics) -> Self {
        let mut check = Self {
            mesh,
            levels: vec![0; expected.nodes],
            fills: vec![0; expected.blocks],
            counted: Statistics::default(),
            blocks: 0,
            is_broken: false,
        };
        if let Some(root) = root {
            check.take_link(root, 0);
        }
        check
    }

    /// Takes a link from a node of this level; 0 for that to the root.
    #[inline]
    fn take_link(&mut self, link: Link, level: u8) {
        let (place, mark) = match link.target() {
            Target::Node(index) => (self.levels.get_mut(index), level.saturating_add(1)),
            Target::Block(index, facets) => {
                self.counted.count_block(u32::from(level), facets as u8);
                (self.fills.get_mut(index), facets as u8)
            }
            Target::End => (None, 0),
        };
        match place {
            Some(place) if *place == 0 => *place = mark,
            // There is none, or another link leads there.
            _ => self.is_broken = true,
        }
    }

    /// Takes further nodes.
    pub(super) fn take_nodes(&mut self, nodes: &[Node]) {
        for node in nodes {
            // A node lies behind the one that links it, else its level is not known yet; so no link leads back to one that was taken.
            let level = self.levels.get(self.counted.nodes).copied().unwrap_or(0);
            // Without a child its level would not be that of a block.
            let is_childless = node.children == [Link::NONE.0; CHILDREN];
            self.is_broken |= level == 0 || usize::from(level) > DEEPEST || is_childless;
            self.counted.nodes += 1;
            for link in node.children.map(Link) {
                if link != Link::NONE {
                    self.take_link(link, level);
                }
            }
        }
    }

    /// Takes further blocks, after all nodes.
    pub(super) fn take_blocks(&mut self, blocks: &[Block]) {
        let first = self.blocks;
        self.blocks += blocks.len();
        let Some(fills) = self.fills.get(first..self.blocks) else {
            self.is_broken = true;
            return;
        };
        let facets = self.mesh.facets.len();
        let is_whole =
            simd::dispatch(LaneScan { facets, blocks, fills }) && have_own_corners(self.mesh, blocks, fills);
        self.is_broken |= !is_whole;
    }

    /// Whether all that was taken is a tree with these statistics; facets that were left out are not counted again.
    pub(super) fn holds(self, expected: &Statistics) -> bool {
        let counted = Statistics { left_out: expected.left_out, ..self.counted };
        !self.is_broken && self.blocks == expected.blocks && counted == *expected
    }
}

/// Whether the lanes of blocks that their links count, `fills` of each, have the corners of the facets that they name; these must be of
/// the mesh.
fn have_own_corners(mesh: &FacetMesh, blocks: &[Block], fills: &[u8]) -> bool {
    blocks.iter().zip(fills).all(|(block, &fill)| {
        let mut lanes = block.facets.iter().zip(&block.positions).take(usize::from(fill));
        lanes.all(|(&facet, positions)| *positions == mesh.corner_positions(facet as usize))
    })
}

/// Whether blocks name, of so many facets, as many as their links say.
struct LaneScan<'a> {
    facets: usize,
    blocks: &'a [Block],
    /// By block.
    fills: &'a [u8],
}

impl Kernel for LaneScan<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Instructions>(self) -> bool {
        let Self { facets, blocks, fills } = self;
        let facet_count = u32::try_from(facets).unwrap_or(u32::MAX);
        // Lane by lane, which are compared at once.
        let mut wrong = [0; 4];
        for (block, &fill) in blocks.iter().zip(fills) {
            for lane in 0..4 {
                // All bits or none.
                let facet = block.facets[lane];
                let [is_counted, is_named, is_none] =
                    [(lane as u32) < u32::from(fill), facet < facet_count, facet == u32::MAX]
                        .map(|is| u32::from(is).wrapping_neg());
                wrong[lane] |= !((is_counted & is_named) | (!is_counted & is_none));
            }
        }
        wrong == [0; 4]
    }
}

#[cfg(test)]
mod tests {
    use super::super::stored::tests::strip;
    use super::super::tree::Tree;
    use super::super::{Octree, Settings};
    use super::*;
    use crate::math::Point;

    /// Whether nodes and blocks are a tree of these statistics.
    fn is_held(
        mesh: &FacetMesh,
        root: Option<Link>,
        (nodes, blocks): (&[Node], &[Block]),
        expected: &Statistics,
    ) -> bool {
        let mut check = TreeCheck::new(mesh, root, expected);
        // Where one part ends and the next begins does not count.
        nodes.chunks(3).for_each(|nodes| check.take_nodes(nodes));
        blocks.chunks(3).for_each(|blocks| check.take_blocks(blocks));
        check.holds(expected)
    }

    /// Whether the tree over a strip of a hundred squares is still held to be one after a change to it and to its statistics.
    fn is_held_after(change: impl FnOnce(&mut Tree, &mut Statistics)) -> bool {
        let mesh = strip(100);
        let octree = Octree::build(&mesh, &Settings::textbook());
        let (mut tree, mut expected) = (octree.tree.clone(), octree.statistics().clone());
        change(&mut tree, &mut expected);
        is_held(&mesh, tree.root, (&tree.nodes, &tree.blocks), &expected)
    }

    fn is_block(link: Link) -> bool {
        matches!(link.target(), Target::Block(..))
    }

    /// The node and slot of the first link that is wanted.
    fn place_of(tree: &Tree, is_wanted: impl Fn(Link) -> bool) -> (usize, usize) {
        let mut places = (0..tree.nodes.len()).flat_map(|node| (0..CHILDREN).map(move |slot| (node, slot)));
        let link = |(node, slot): (usize, usize)| Link(tree.nodes[node].children[slot]);
        places.find(|&place| link(place) != Link::NONE && is_wanted(link(place))).unwrap()
    }

    /// Replaces the first link that is wanted.
    fn relink(tree: &mut Tree, is_wanted: impl Fn(Link) -> bool, to: Link) {
        let (node, slot) = place_of(tree, is_wanted);
        tree.nodes[node].children[slot] = to.0;
    }

    /// Hangs one more child below a node.
    fn add_child(tree: &mut Tree, node: usize, child: Link) {
        let free = tree.nodes[node].children.iter().position(|&link| link == Link::NONE.0).unwrap();
        tree.nodes[node].children[free] = child.0;
    }

    #[test]
    fn trees_that_were_built_are_held() {
        for count in [0, 1, 4, 5, 100, 5000] {
            let mesh = strip(count);
            for settings in [Settings::default(), Settings::textbook()] {
                let octree = Octree::build(&mesh, &settings);
                let tree = &octree.tree;
                assert!(is_held(&mesh, tree.root, (&tree.nodes, &tree.blocks), octree.statistics()), "{count}");
            }
        }
        assert!(is_held_after(|_, _| ()));
    }

    /// Where all links of a node lead to the next one, a walk has sixteen times as many steps with each level.
    #[test]
    fn what_hangs_in_several_places_is_detected() {
        // In place of another, so that there are as many links as before.
        assert!(!is_held_after(|tree, _| {
            let last = Link::node(tree.nodes.len() - 1);
            relink(tree, |link| link.is_node() && link != last, last);
        }));
        assert!(!is_held_after(|tree, _| {
            let last = tree.blocks.len() - 1;
            let (node, slot) = place_of(tree, |link| is_block(link) && link.index() == last);
            let last = Link(tree.nodes[node].children[slot]);
            relink(tree, |link| is_block(link) && link != last, last);
        }));
        // Besides all others.
        for kind in [Link::is_node, is_block] {
            assert!(!is_held_after(|tree, _| {
                let (node, slot) = place_of(tree, kind);
                let child = Link(tree.nodes[node].children[slot]);
                add_child(tree, node, child);
            }));
        }
    }

    #[test]
    fn links_that_lead_back_or_out_are_detected() {
        for to in [Link::END, Link::node(1 << 20), Link::block(1 << 20, 1), Link::NONE] {
            assert!(!is_held_after(|tree, _| relink(tree, Link::is_node, to)), "{to:?}");
            assert!(!is_held_after(|tree, _| relink(tree, is_block, to)), "{to:?}");
            // The root is the first node, which no link below it can name.
            assert_eq!(is_held_after(|tree, _| tree.root = Some(to)), to == Link::node(0), "{to:?}");
        }
        assert!(!is_held_after(|tree, _| tree.root = Some(Link::node(1))));
        assert!(!is_held_after(|tree, _| tree.root = None));
        // To the node itself, and to the one above it.
        assert!(!is_held_after(|tree, _| {
            let last = tree.nodes.len() - 1;
            tree.nodes[last].children = [Link::node(last).0; CHILDREN];
        }));
        assert!(!is_held_after(|tree, _| {
            let last = tree.nodes.len() - 1;
            let (above, _) = place_of(tree, |link| link == Link::node(last));
            tree.nodes[last].children = [Link::node(above).0; CHILDREN];
        }));
    }

    #[test]
    fn what_hangs_nowhere_or_holds_nothing_is_detected() {
        assert!(!is_held_after(|tree, expected| {
            tree.blocks.push(tree.blocks[0]);
            expected.blocks += 1;
        }));
        assert!(!is_held_after(|tree, expected| {
            tree.nodes.push(tree.nodes[0]);
            expected.nodes += 1;
        }));
        assert!(!is_held_after(|tree, expected| {
            let added = Link::node(tree.nodes.len());
            add_child(tree, 0, added);
            tree.nodes.push(Node::EMPTY);
            expected.nodes += 1;
        }));
    }

    #[test]
    fn statistics_of_another_tree_are_detected() {
        let changes: [fn(&mut Statistics); 6] = [
            |expected| expected.nodes += 1,
            |expected| expected.blocks -= 1,
            |expected| expected.references += 1,
            |expected| expected.fill[0] += 1,
            // Stacks for more levels than there are, and for fewer.
            |expected| expected.depths.push(0),
            |expected| expected.depths.truncate(1),
        ];
        for (k, change) in changes.into_iter().enumerate() {
            assert!(!is_held_after(|_, expected| change(expected)), "{k}");
        }
    }

    /// A chain of nodes, each with the next as its only child, over a block.
    #[test]
    fn trees_deeper_than_stacks_are_detected() {
        let mesh = strip(1);
        for (length, is_tree) in [(1, true), (DEEPEST, true), (DEEPEST + 1, false), (300, false)] {
            let node = |next: usize| {
                let mut node = Node::EMPTY;
                node.children[3] = if next < length { Link::node(next).0 } else { Link::block(0, 1).0 };
                node
            };
            let nodes: Vec<Node> = (1..=length).map(node).collect();
            let blocks = [Block::new(&mesh, Point::ZERO, &[0])];
            let mut expected = Statistics { nodes: length, ..Statistics::default() };
            expected.count_block(length as u32, 1);
            assert_eq!(is_held(&mesh, Some(Link::node(0)), (&nodes, &blocks), &expected), is_tree, "{length}");
        }
    }

    /// One block alone, of which its link says so many facets.
    #[test]
    fn lanes_that_are_counted_name_facets_of_the_mesh_and_their_corners() {
        const NONE: u32 = u32::MAX;
        let mesh = strip(2);
        let is_block_held = |count: u8, facets: [u32; 4], corner: u32| {
            let mut block = Block::new(&mesh, Point::ZERO, &[0, 1]);
            block.facets = facets;
            block.positions[1][3] = corner;
            let mut expected = Statistics::default();
            expected.count_block(0, count);
            is_held(&mesh, Some(Link::block(0, count)), (&[], &[block]), &expected)
        };
        // The second square has the corners 2, 4, 5 and 3 of six.
        assert!(is_block_held(2, [0, 1, NONE, NONE], 3));
        for (count, facets) in [
            (1, [0, 1, NONE, NONE]),
            (3, [0, 1, NONE, NONE]),
            (2, [0, NONE, NONE, NONE]),
            (2, [NONE; 4]),
            (2, [0, 2, NONE, NONE]),
            (2, [0, NONE - 1, NONE, NONE]),
            (2, [0, 1, NONE, 1]),
        ] {
            assert!(!is_block_held(count, facets, 3), "{count} of {facets:?}");
        }
        // Those of the other square alone, a corner twice, and none of the mesh.
        for corner in [1, 4, 6] {
            assert!(!is_block_held(2, [0, 1, NONE, NONE], corner), "{corner}");
        }
        // Each square with the corners of the other.
        assert!(!is_block_held(2, [1, 0, NONE, NONE], 3));
    }
}

//! A tree as bytes and back, to be kept from one run to the next: what is read is walked only where every link leads down and
//! every index lies within the mesh.

use super::node::{Block, CHILDREN, Link, Node, Target};
use super::statistics::Statistics;
use super::tree::Tree;
use crate::intersect::facet::Surroundings;
use crate::intersect::slopes::Slopes;
use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Aabb, Point};
use crate::mesh::FacetMesh;
use crate::mesh::arrays::{ArrayReader, invalid, write_array};
use std::io::{self, Write};

impl<'m> Tree<'m> {
    /// Writes the tree and its statistics without the mesh.
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub(super) fn write_arrays(&self, statistics: &Statistics, to: &mut dyn Write) -> io::Result<()> {
        let Statistics { nodes, blocks, references, left_out, depths, fill } = statistics;
        let counts: Vec<u64> =
            [nodes, blocks, references, left_out].into_iter().chain(fill).map(|n| *n as u64).collect();
        write_array(to, &counts)?;
        let bounds = self.surroundings.bounds;
        write_array(to, &[bounds.min, bounds.max])?;
        write_array(to, &depths.iter().map(|n| *n as u64).collect::<Vec<u64>>())?;
        write_array(to, &self.root.iter().map(|link| link.0).collect::<Vec<u32>>())?;
        write_array(to, &self.nodes)?;
        write_array(to, &self.blocks)?;
        write_array(to, &self.slopes)
    }

    /// Reads a tree of `mesh`, and its statistics.
    ///
    /// # Errors
    /// When it cannot be read, or its links could lead nowhere or beyond the mesh. That its boxes hold the facets is not checked, nor the
    /// box around the mesh and the depth: walks of a tree that is deeper than it says miss facets, but end.
    pub(super) fn read_arrays(mesh: &'m FacetMesh, from: &mut ArrayReader) -> io::Result<(Self, Statistics)> {
        let (statistics, bounds) = read_head(from)?;
        let root = from.array::<u32>()?.first().map(|&link| Link(link));
        let mut links = LinkCheck::default();
        let nodes: Vec<Node> = from.array_with(|nodes| links.take(nodes))?;
        let mut corners = CornerCheck::default();
        let blocks: Vec<Block> = from.array_with(|blocks| corners.take(blocks))?;
        let slopes: Vec<Slopes> = from.array()?;
        let is_tree = slopes.len() == mesh.facets.len()
            && links.hold(root, [nodes.len(), blocks.len()])
            && corners.hold(mesh);
        if !is_tree {
            return Err(invalid("no octree of this mesh"));
        }
        let surroundings = Surroundings::with_bounds(mesh, bounds);
        Ok((Self::new(surroundings, nodes, blocks, (root, statistics.depth()), slopes), statistics))
    }
}

/// Reads what is at the head of a tree: its statistics and the box around the usable positions of its mesh; an error where the number of
/// numbers is wrong.
fn read_head(from: &mut ArrayReader) -> io::Result<(Statistics, Aabb)> {
    let counts: Vec<u64> = from.array()?;
    let bounds: Vec<Point> = from.array()?;
    let depths: Vec<u64> = from.array()?;
    let (Ok(counts), Ok([min, max])) = (<[u64; 8]>::try_from(counts), <[Point; 2]>::try_from(bounds)) else {
        return Err(invalid("no octree"));
    };
    let [nodes, blocks, references, left_out, fill @ ..] = counts.map(|n| n as usize);
    let depths = depths.into_iter().map(|n| n as usize).collect();
    Ok((Statistics { nodes, blocks, references, left_out, depths, fill }, Aabb { min, max }))
}

/// Whether every link leads to a later node or to a block, so that every walk ends: as far as nodes were taken.
#[derive(Default)]
struct LinkCheck {
    /// Nodes that were taken.
    count: u32,
    /// Whether a link of this slot leads back or nowhere.
    is_broken: [bool; CHILDREN],
    /// One more than the largest index of the nodes, and of the blocks, that links of this slot lead to.
    nodes: [u32; CHILDREN],
    blocks: [u32; CHILDREN],
}

impl LinkCheck {
    /// Takes further nodes.
    fn take(&mut self, nodes: &[Node]) {
        simd::dispatch(LinkScan { check: self, nodes });
    }

    /// Whether the links of all nodes, and that to the root, are those of a tree of so many nodes and blocks.
    fn hold(self, root: Option<Link>, [nodes, blocks]: [usize; 2]) -> bool {
        let is_within = |ends: [u32; CHILDREN], count: usize| ends.iter().all(|&end| end as usize <= count);
        let is_root = |root: Link| match root.target() {
            Target::Node(index) => index < nodes,
            Target::Block(index, _) => index < blocks,
            Target::End => false,
        };
        !self.is_broken.contains(&true)
            && is_within(self.nodes, nodes)
            && is_within(self.blocks, blocks)
            && root.is_none_or(is_root)
    }
}

/// What [`LinkCheck::take`] does, for [`simd::dispatch`].
struct LinkScan<'a> {
    check: &'a mut LinkCheck,
    nodes: &'a [Node],
}

impl Kernel for LinkScan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let Self { check, nodes } = self;
        // Slot by slot, which are compared at once: one by one they took a tenth of reading a tree.
        let (mut broken, mut node_ends, mut block_ends) = ([0; CHILDREN], check.nodes, check.blocks);
        for node in nodes {
            check.count += 1;
            for slot in 0..CHILDREN {
                // All bits or none.
                let link = Link(node.children[slot]);
                let used = u32::from(link != Link::NONE).wrapping_neg();
                let [to_node, to_block] =
                    [link.is_node(), link.is_block()].map(|is| u32::from(is).wrapping_neg() & used);
                let index = link.index() as u32;
                let leads_back = u32::from(index < check.count).wrapping_neg();
                broken[slot] |= used & !to_block & (!to_node | leads_back);
                node_ends[slot] = node_ends[slot].max(to_node & (index + 1));
                block_ends[slot] = block_ends[slot].max(to_block & (index + 1));
            }
        }
        for slot in 0..CHILDREN {
            check.is_broken[slot] |= broken[slot] != 0;
        }
        (check.nodes, check.blocks) = (node_ends, block_ends);
    }
}

/// Whether blocks name facets and corners of the mesh alone: as far as they were taken.
#[derive(Default)]
struct CornerCheck {
    /// One more than the largest facet; lanes without a facet name none.
    facets: u32,
    /// The largest corner; `None` before the first block.
    corner: Option<u32>,
}

impl CornerCheck {
    /// Takes further blocks.
    fn take(&mut self, blocks: &[Block]) {
        simd::dispatch(CornerScan { check: self, blocks });
    }

    /// Whether all indices lie within the mesh.
    fn hold(&self, mesh: &FacetMesh) -> bool {
        self.facets as usize <= mesh.facets.len() && self.corner.is_none_or(|p| (p as usize) < mesh.positions.len())
    }
}

/// What [`CornerCheck::take`] does, for [`simd::dispatch`].
struct CornerScan<'a> {
    check: &'a mut CornerCheck,
    blocks: &'a [Block],
}

impl Kernel for CornerScan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let Self { check, blocks } = self;
        // Lane by lane, which are compared at once: one by one they took a fifth of the instructions of reading a tree.
        let (mut facets, mut corners) = ([0; 4], [[0; 4]; 4]);
        for block in blocks {
            for lane in 0..4 {
                // One more than the name of no facet is zero.
                facets[lane] = block.facets[lane].wrapping_add(1).max(facets[lane]);
                for corner in 0..4 {
                    corners[lane][corner] = block.positions[lane][corner].max(corners[lane][corner]);
                }
            }
        }
        check.facets = facets.into_iter().fold(check.facets, u32::max);
        if !blocks.is_empty() {
            check.corner = check.corner.max(corners.into_iter().flatten().max());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{Octree, Settings};
    use crate::intersect::{Cost, Intersector};
    use crate::math::{FaceId, Point, Ray, Uv, Vector};
    use crate::mesh::{Facet, MeshVertex};

    /// A strip of unit squares along x.
    fn strip(count: u32) -> FacetMesh {
        let positions: Vec<Point> =
            (0..=count).flat_map(|i| [0.0, 1.0].map(|y| Point::new(f64::from(i), y, 0.0))).collect();
        let vertices = (0..positions.len() as u32)
            .map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO })
            .collect();
        let square = |i: u32| Facet { vertices: [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1], face: FaceId(0) };
        FacetMesh { positions, vertices, facets: (0..count).map(square).collect(), sag: vec![] }
    }

    fn stored(mesh: &FacetMesh) -> Vec<u8> {
        let mut bytes = Vec::new();
        mesh.write_arrays(&mut bytes).unwrap();
        Octree::build(mesh, &Settings::default()).write_arrays(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_stored_tree_gives_the_hits_of_a_built_one() {
        let mesh = strip(100);
        let bytes = stored(&mesh);
        let mut from = &bytes[..];
        let mut reader = ArrayReader::new(&mut from, bytes.len() as u64);
        let again = FacetMesh::read_arrays(&mut reader, 1).unwrap();
        assert_eq!(again, mesh);
        let read = Octree::read_arrays(&again, &Settings::default(), &mut reader).unwrap();
        let built = Octree::build(&mesh, &Settings::default());
        assert_eq!(read.statistics(), built.statistics());
        for i in 0..120 {
            let ray = Ray::new(Point::new(f64::from(i) + 0.25, 0.5, 3.0), -Vector::Z);
            let [a, b] = [&read, &built].map(|tree| tree.intersect(&ray, &mut Cost::default()));
            assert_eq!(a, b);
            assert_eq!(a.is_some(), i < 100);
        }
        assert_eq!(read.tree.surroundings.bounds, mesh.bounds());
    }

    /// Stacks of rays are as deep as the statistics say that the tree is.
    #[test]
    fn statistics_know_the_levels_of_nodes() {
        for count in [1, 4, 5, 100, 5000] {
            let mesh = strip(count);
            for settings in [Settings::default(), Settings::textbook()] {
                let octree = Octree::build(&mesh, &settings);
                let deepest = octree.boxes().into_iter().map(|(depth, _)| depth).max();
                assert_eq!(octree.tree.levels, deepest.unwrap_or(0), "{count}");
            }
        }
    }

    #[test]
    fn links_that_lead_back_or_out_are_told() {
        let node = |link: Link| Node {
            children: std::array::from_fn(|k| if k == 0 { link.0 } else { Link::NONE.0 }),
            ..Node::EMPTY
        };
        let are_held = |children: [Link; 2], root: Link| {
            let mut links = LinkCheck::default();
            children.into_iter().for_each(|child| links.take(&[node(child)]));
            links.hold(Some(root), [2, 1])
        };
        let is_held = |first: Link, root: Link| are_held([first, Link::block(0, 1)], root);
        assert!(is_held(Link::node(1), Link::node(0)) && is_held(Link::block(0, 4), Link::block(0, 2)));
        for wrong in [Link::node(2), Link::block(1, 1), Link::END] {
            assert!(!is_held(wrong, Link::node(0)), "{wrong:?}");
        }
        for wrong in [Link::node(2), Link::block(1, 1), Link::END] {
            assert!(!is_held(Link::node(1), wrong), "{wrong:?}");
        }
        assert!(!are_held([Link::node(1), Link::node(1)], Link::node(0)));
    }

    #[test]
    fn corners_beyond_the_mesh_are_told() {
        let mesh = strip(1);
        let is_held = |facet: u32, corner: u32| {
            let mut block = Block::new(&mesh, Point::ZERO, &[0]);
            (block.facets[0], block.positions[0][3]) = (facet, corner);
            let mut corners = CornerCheck::default();
            corners.take(&[Block::new(&mesh, Point::ZERO, &[0]), block]);
            corners.hold(&mesh)
        };
        assert!(is_held(0, 3) && is_held(u32::MAX, 3) && CornerCheck::default().hold(&FacetMesh::default()));
        assert!(!is_held(1, 3) && !is_held(0, 4) && !is_held(u32::MAX - 1, 3));
    }

    /// Of how many bytes one is bent: all, but for Miri, which takes most of a second for each; prime, so that all parts of words are hit.
    const EVERY: usize = if cfg!(miri) { 37 } else { 1 };

    /// Bytes that are wrong anywhere are refused or walked to an end; no index leaves its array.
    #[test]
    fn wrong_links_are_refused() {
        let mesh = strip(40);
        let bytes = stored(&mesh);
        let ray = Ray::new(Point::new(7.25, 0.5, 3.0), -Vector::Z);
        let mut refused = 0;
        for i in (0..bytes.len()).step_by(EVERY) {
            let mut bent = bytes.clone();
            bent[i] ^= 0x85;
            let mut from = &bent[..];
            let mut reader = ArrayReader::new(&mut from, bytes.len() as u64);
            let Ok(mesh) = FacetMesh::read_arrays(&mut reader, 1) else {
                refused += 1;
                continue;
            };
            match Octree::read_arrays(&mesh, &Settings::default(), &mut reader) {
                Ok(tree) => drop(tree.intersect(&ray, &mut Cost::default())),
                Err(_) => refused += 1,
            }
        }
        assert!(refused * EVERY > 200, "{refused}");
    }
}

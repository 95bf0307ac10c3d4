//! A tree as bytes and back, to be kept from one run to the next: what is read is walked only where every link leads down and
//! every index lies within the mesh.

use super::node::{Block, Link, Node};
use super::statistics::Statistics;
use super::tree::Tree;
use crate::intersect::facet::Surroundings;
use crate::intersect::slopes::Slopes;
use crate::math::simd::{self, Instructions, Kernel};
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
        write_array(to, &depths.iter().map(|n| *n as u64).collect::<Vec<u64>>())?;
        write_array(to, &self.root.iter().map(|link| link.0).collect::<Vec<u32>>())?;
        write_array(to, &self.nodes)?;
        write_array(to, &self.blocks)?;
        write_array(to, &self.slopes)
    }

    /// Reads a tree of `mesh`, and its statistics.
    ///
    /// # Errors
    /// When it cannot be read, or its links could lead nowhere or beyond the mesh. That its boxes hold the facets is not checked.
    pub(super) fn read_arrays(mesh: &'m FacetMesh, from: &mut ArrayReader) -> io::Result<(Self, Statistics)> {
        let statistics = read_statistics(from)?;
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
        Ok((Self::new(Surroundings::new(mesh), nodes, blocks, root, slopes), statistics))
    }
}

/// Reads the statistics at the head of a tree; an error where their number is wrong.
fn read_statistics(from: &mut ArrayReader) -> io::Result<Statistics> {
    let counts: Vec<u64> = from.array()?;
    let depths: Vec<u64> = from.array()?;
    let counts: [u64; 8] = counts.try_into().map_err(|_| invalid("no octree"))?;
    let [nodes, blocks, references, left_out, fill @ ..] = counts.map(|n| n as usize);
    let depths = depths.into_iter().map(|n| n as usize).collect();
    Ok(Statistics { nodes, blocks, references, left_out, depths, fill })
}

/// Whether every link leads to a later node or to a block, so that every walk ends: as far as nodes were taken.
#[derive(Default)]
struct LinkCheck {
    /// Nodes that were taken.
    count: u32,
    /// Whether a link leads back or nowhere.
    is_broken: bool,
    /// One more than the largest index of the nodes that links lead to, and of the blocks.
    ends: [u32; 2],
}

impl LinkCheck {
    /// Takes further nodes, and sets the links of their children that are not in use to zero, by which walks tell them: their boxes mean
    /// nothing.
    fn take(&mut self, nodes: &mut [Node]) {
        simd::dispatch(LinkScan { check: self, nodes });
    }

    /// Takes a link, which may lead to nodes from `least` on.
    #[inline(always)]
    fn follow(&mut self, link: Link, least: u32) {
        // Without branches, so that the links of a node are followed at once: one by one they took a tenth of reading a tree.
        let (is_node, is_block, index) = (link.is_node(), link.is_block(), link.index() as u32);
        self.is_broken |= !(is_node | is_block) | (is_node & (index < least));
        self.ends[0] = self.ends[0].max(if is_node { index + 1 } else { 0 });
        self.ends[1] = self.ends[1].max(if is_block { index + 1 } else { 0 });
    }

    /// Whether the links of all nodes, and that to the root, are those of a tree of so many nodes and blocks.
    fn hold(mut self, root: Option<Link>, [nodes, blocks]: [usize; 2]) -> bool {
        root.into_iter().for_each(|root| self.follow(root, 0));
        !self.is_broken && self.ends[0] as usize <= nodes && self.ends[1] as usize <= blocks
    }
}

/// What [`LinkCheck::take`] does, for [`simd::dispatch`].
struct LinkScan<'a> {
    check: &'a mut LinkCheck,
    nodes: &'a mut [Node],
}

impl Kernel for LinkScan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let Self { check, nodes } = self;
        for node in nodes {
            check.count += 1;
            let least = check.count;
            for (slot, child) in node.children.iter_mut().enumerate() {
                let is_used = node.used >> slot & 1 != 0;
                // For a child that is not in use the first block, which every tree with nodes has.
                check.follow(if is_used { Link(*child) } else { Link::block(0, 1) }, least);
                *child = if is_used { *child } else { 0 };
            }
        }
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
    }

    #[test]
    fn links_that_lead_back_or_out_are_told() {
        let node = |link: Link| Node {
            used: 1,
            children: std::array::from_fn(|k| if k == 0 { link.0 } else { 7 * u32::from(k == 1) }),
            ..Node::EMPTY
        };
        let is_held = |first: Link, root: Link| {
            let mut nodes = [node(first), node(Link::block(0, 1))];
            let mut links = LinkCheck::default();
            nodes.iter_mut().for_each(|node| links.take(std::slice::from_mut(node)));
            assert_eq!(nodes[1].children[1..], [0; 15]);
            links.hold(Some(root), [2, 1])
        };
        assert!(is_held(Link::node(1), Link::node(0)) && is_held(Link::block(0, 4), Link::block(0, 2)));
        for wrong in [Link::node(0), Link::node(2), Link::block(1, 1), Link::END] {
            assert!(!is_held(wrong, Link::node(0)), "{wrong:?}");
        }
        for wrong in [Link::node(2), Link::block(1, 1), Link::END] {
            assert!(!is_held(Link::node(1), wrong), "{wrong:?}");
        }
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

//! A tree as bytes and back, to be kept from one run to the next: what is read is walked only where every link leads down and
//! every index lies within the mesh.

use super::node::{Block, Link, Node, Target};
use super::statistics::Statistics;
use super::{huge_pages, tree::Tree};
use crate::intersect::slopes::Slopes;
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
        let mut nodes: Vec<Node> = from.array_in(huge_pages::with_capacity)?;
        nodes.iter_mut().for_each(forget_unused);
        let blocks: Vec<Block> = from.array_in(huge_pages::with_capacity)?;
        let slopes: Vec<Slopes> = from.array_in(huge_pages::with_capacity)?;
        if slopes.len() != mesh.facets.len() || !is_tree(mesh, root, &nodes, &blocks) {
            return Err(invalid("no octree of this mesh"));
        }
        Ok((Self::new(mesh, nodes, blocks, root, slopes), statistics))
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

/// Sets the links of children that are not in use to zero, by which walks that meet their empty boxes tell them.
fn forget_unused(node: &mut Node) {
    for (slot, child) in node.children.iter_mut().enumerate() {
        if node.used >> slot & 1 == 0 {
            *child = 0;
        }
    }
}

/// Whether every link leads to a later node or to a block, and every block to facets and corners of the mesh: then every walk ends.
fn is_tree(mesh: &FacetMesh, root: Option<Link>, nodes: &[Node], blocks: &[Block]) -> bool {
    let leads_on = |link: Link, least: usize| match link.target() {
        Target::Node(index) => (least..nodes.len()).contains(&index),
        Target::Block(index, _) => index < blocks.len(),
        Target::End => false,
    };
    let children = |(i, node): (usize, &Node)| {
        (0..8).filter(|slot| node.used >> slot & 1 == 1).all(|slot| leads_on(Link(node.children[slot]), i + 1))
    };
    let (facets, positions) = (mesh.facets.len() as u32, mesh.positions.len() as u32);
    // Lanes without a facet name none.
    let corners = |block: &Block| {
        block.facets.iter().all(|&f| f < facets || f == u32::MAX)
            && block.positions.iter().flatten().all(|&p| p < positions)
    };
    root.is_none_or(|root| leads_on(root, 0))
        && nodes.iter().enumerate().all(children)
        && blocks.iter().all(corners)
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

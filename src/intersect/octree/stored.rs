//! A tree as bytes and back, to be kept from one run to the next: what is read is walked only where it is a tree whose every index lies
//! within the mesh.

use super::node::{Block, Link, Node};
use super::statistics::Statistics;
use super::tree::Tree;
use super::tree_check::TreeCheck;
use crate::intersect::facet::Surroundings;
use crate::intersect::slopes::Slopes;
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
    /// When it cannot be read, or is no tree of this mesh, as [`TreeCheck`] finds. That its boxes hold the facets is not checked, nor the
    /// box around the mesh and the slopes: rays may miss facets then, but their walks come to each node and block once at most.
    pub(super) fn read_arrays(mesh: &'m FacetMesh, from: &mut ArrayReader) -> io::Result<(Self, Statistics)> {
        let (statistics, bounds) = read_head(from)?;
        let root = match from.array::<u32>()?[..] {
            [] => None,
            [link] => Some(Link(link)),
            _ => return Err(invalid("an octree of several roots")),
        };
        // Before room is made for as many.
        if statistics.nodes > from.most_left::<Node>() || statistics.blocks > from.most_left::<Block>() {
            return Err(invalid("an octree that is cut short"));
        }
        let mut check = TreeCheck::new(mesh, root, &statistics);
        let nodes: Vec<Node> = from.array_with(|nodes| check.take_nodes(nodes))?;
        let blocks: Vec<Block> = from.array_with(|blocks| check.take_blocks(blocks))?;
        let slopes: Vec<Slopes> = from.array()?;
        if slopes.len() != mesh.facets.len() || !check.holds(&statistics) {
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::intersect::octree::{Octree, Settings};
    use crate::intersect::{Cost, Intersector};
    use crate::math::{FaceId, Point, Ray, Uv, Vector};
    use crate::mesh::{Facet, MeshVertex};

    /// A strip of unit squares along x.
    pub(crate) fn strip(count: u32) -> FacetMesh {
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

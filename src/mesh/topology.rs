//! Edges of a mesh: which are open, shared or used more than twice.

use super::FacetMesh;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// How the facets of a mesh, or of some of its faces, hang together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Edges with a facet on one side only.
    pub open_edges: usize,
    /// Edges with more than two facets.
    pub nonmanifold_edges: usize,
    /// Edges whose two facets run along them in the same direction: one of the two is turned inside out.
    pub turned_edges: usize,
}

impl Topology {
    /// Whether every edge has two facets that agree which side is outside; true without facets too.
    pub fn is_closed(&self) -> bool {
        *self == Self::default()
    }
}

impl FacetMesh {
    /// Counts the edges of a range of facets (those of a shell stand together) by kind. Edges are the same where their position indices
    /// are: equal points under two indices stay apart.
    pub fn topology(&self, facets: Range<usize>) -> Topology {
        // Uses along and against the edge's order of positions.
        let mut edges: FxHashMap<[u32; 2], [u32; 2]> = FxHashMap::default();
        for f in facets {
            let p = self.corner_positions(f);
            for k in 0..4 {
                let (a, b) = (p[k], p[(k + 1) % 4]);
                // A triangle's last side has no length.
                if a != b {
                    edges.entry([a.min(b), a.max(b)]).or_default()[(a > b) as usize] += 1;
                }
            }
        }
        let mut t = Topology::default();
        for [along, against] in edges.into_values() {
            match along + against {
                1 => t.open_edges += 1,
                // Neighbours that are turned alike use their edge in opposite directions.
                2 if along != against => t.turned_edges += 1,
                2 => {}
                _ => t.nonmanifold_edges += 1,
            }
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{FaceId, Point, Uv, Vector};
    use crate::mesh::{Facet, MeshVertex};

    fn topology(faces: &[[u32; 3]]) -> Topology {
        let mesh = tetrahedron(faces);
        mesh.topology(0..mesh.facets.len())
    }

    fn tetrahedron(faces: &[[u32; 3]]) -> FacetMesh {
        let positions = vec![Point::ZERO, Point::X, Point::Y, Point::Z];
        let vertices = (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
        let facets = faces.iter().map(|&[a, b, c]| Facet { vertices: [a, b, c, c], face: FaceId(0) }).collect();
        FacetMesh { positions, vertices, facets, sag: Vec::new() }
    }

    #[test]
    fn a_tetrahedron_is_closed_until_a_side_is_missing_or_turned() {
        let sides = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert!(topology(&sides).is_closed());
        assert_eq!(topology(&sides[1..]).open_edges, 3);
        let turned = [[0, 1, 2], sides[1], sides[2], sides[3]];
        assert_eq!(topology(&turned).turned_edges, 3);
    }
}

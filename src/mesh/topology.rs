//! Edges of a mesh: which are open, shared or used more than twice.

use super::FacetMesh;
use crate::math::{FaceId, Uv};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// How the facets of a mesh, or of some of its faces, hang together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Edges with a facet on one side only.
    pub open_edges: usize,
    /// Edges with more than two facets, but for `touching_edges`.
    pub nonmanifold_edges: usize,
    /// Edges along which a closed surface touches itself: four facets or more, half of them each way, at each of which a face ends: all of
    /// different faces, or of one with its seam there. Around such an edge the facets pair off, and what is inside is as clear as
    /// elsewhere.
    pub touching_edges: usize,
    /// Edges whose two facets run along them in the same direction: one of the two is turned inside out.
    pub turned_edges: usize,
}

impl Topology {
    /// Whether every edge has two facets that agree which side is outside, or pairs of such facets where the surface touches itself; true
    /// without facets too.
    pub fn is_closed(&self) -> bool {
        self.open_edges + self.nonmanifold_edges + self.turned_edges == 0
    }
}

impl FacetMesh {
    /// Counts the edges of a range of facets (those of a shell stand together) by kind. Edges are the same where their position indices
    /// are: equal points under two indices stay apart.
    pub fn topology(&self, facets: Range<usize>) -> Topology {
        // Uses along and against the edge's order of positions.
        let mut edges: FxHashMap<[u32; 2], [u32; 2]> = FxHashMap::default();
        for f in facets.clone() {
            for side in self.sides(f) {
                edges.entry(side.positions).or_default()[side.is_against as usize] += 1;
            }
        }
        let mut t = Topology::default();
        let mut paired: FxHashMap<[u32; 2], Vec<(FaceId, [Uv; 2])>> = FxHashMap::default();
        for (edge, [along, against]) in edges {
            match along + against {
                1 => t.open_edges += 1,
                // Neighbours that are turned alike use their edge in opposite directions.
                2 if along != against => t.turned_edges += 1,
                2 => {}
                _ if along == against => {
                    paired.insert(edge, Vec::new());
                }
                _ => t.nonmanifold_edges += 1,
            }
        }
        // Faces are looked up only for these few: kept for all edges they would double the memory.
        let asked = if paired.is_empty() { 0..0 } else { facets };
        for f in asked {
            for side in self.sides(f) {
                if let Some(uses) = paired.get_mut(&side.positions) {
                    uses.push((self.facets[f].face, side.uv));
                }
            }
        }
        for uses in paired.into_values() {
            // A face that runs on across it has it inside: it is no edge of the file, and should be no edge of other faces. Along its seam
            // a face ends on either side, at other parameters.
            let runs_on = |(face, [a, b]): &(FaceId, [Uv; 2]), (other, [c, d]): &(FaceId, [Uv; 2])| {
                face == other && (a == c || b == d)
            };
            if (1..uses.len()).any(|i| uses[..i].iter().any(|before| runs_on(before, &uses[i]))) {
                t.nonmanifold_edges += 1;
            } else {
                t.touching_edges += 1;
            }
        }
        t
    }

    /// Returns the sides of a facet that have a length.
    fn sides(&self, facet: usize) -> impl Iterator<Item = Side> {
        let (p, vertices) = (self.corner_positions(facet), self.facets[facet].vertices);
        // A triangle's last side has no length.
        (0..4).map(move |k| [k, (k + 1) % 4]).filter(move |[a, b]| p[*a] != p[*b]).map(move |ends| {
            let is_against = p[ends[0]] > p[ends[1]];
            let [a, b] = if is_against { [ends[1], ends[0]] } else { ends };
            let uv = [a, b].map(|k| self.vertices[vertices[k] as usize].uv);
            Side { positions: [p[a], p[b]], uv, is_against }
        })
    }
}

/// A side of a facet.
struct Side {
    /// Those of its ends, the smaller index first.
    positions: [u32; 2],
    /// The facet's parameters there.
    uv: [Uv; 2],
    /// Whether the facet runs from the second to the first.
    is_against: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::mesh::{Facet, MeshVertex};

    /// Triangles on six positions, each with its face.
    fn mesh(triangles: impl Iterator<Item = ([u32; 3], u32)>) -> FacetMesh {
        let positions = vec![Point::ZERO, Point::X, Point::Y, Point::Z, -Point::Y, -Point::Z];
        let vertices = (0..6).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
        let facets =
            triangles.map(|([a, b, c], face)| Facet { vertices: [a, b, c, c], face: FaceId(face) }).collect();
        FacetMesh { positions, vertices, facets, sag: Vec::new() }
    }

    fn topology(triangles: &[[u32; 3]]) -> Topology {
        let mesh = mesh(triangles.iter().map(|t| (*t, 0)));
        mesh.topology(0..mesh.facets.len())
    }

    #[test]
    fn a_tetrahedron_is_closed_until_a_side_is_missing_or_turned() {
        let sides = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert!(topology(&sides).is_closed());
        assert_eq!(topology(&sides[1..]).open_edges, 3);
        let turned = [[0, 1, 2], sides[1], sides[2], sides[3]];
        assert_eq!(topology(&turned).turned_edges, 3);
    }

    #[test]
    fn two_tetrahedra_that_touch_along_an_edge_are_closed_if_it_bounds_four_faces() {
        // The second is the first turned by half a turn about the edge from 0 to 1.
        let sides = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 1], [0, 1, 5], [0, 5, 4], [1, 4, 5]];
        let of_faces = |faces: [u32; 8]| {
            let mesh = mesh(sides.into_iter().zip(faces));
            mesh.topology(0..8)
        };
        let all = of_faces([0, 1, 2, 3, 4, 5, 6, 7]);
        assert!(all.is_closed() && all.touching_edges == 1, "{all:?}");
        // A face that runs on across it does not end there.
        let across = of_faces([0, 0, 2, 3, 4, 5, 6, 7]);
        assert_eq!((across.nonmanifold_edges, across.touching_edges), (1, 0));
        // Two facets of one face at other parameters are its seam.
        let mut seam = mesh(sides.into_iter().zip([0, 0, 2, 3, 4, 5, 6, 7]));
        let shifted = seam.vertices.len() as u32;
        seam.vertices.extend([0, 1].map(|k: usize| MeshVertex { uv: Uv::new(1.0, 0.0), ..seam.vertices[k] }));
        seam.facets[1].vertices = [shifted, shifted + 1, 3, 3];
        assert_eq!((seam.topology(0..8).nonmanifold_edges, seam.topology(0..8).touching_edges), (0, 1));
        // One facet more on it does not pair off; its other two sides have three facets too.
        assert_eq!(topology(&[&sides[..], &[[0, 1, 2]]].concat()).nonmanifold_edges, 3);
    }
}

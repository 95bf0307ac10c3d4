//! Lobes of a border that crosses itself. It runs around them the other way than around the rest of the face: facets that are turned over
//! there run along their sides of the border as all others do, and so against the neighbours' facets.

use super::nodes::{Nodes, Position};
use super::transition::pairing::TransitionFacet;
use crate::math::Enclosure;
use crate::math::polygon::signed_area;
use rustc_hash::FxHashMap;

/// How often facets are gone through that run against their sides of the border: each may let one beside it follow.
const MOST_ROUNDS: usize = 32;

/// Turns over those of `facets`, all counter-clockwise, around which the border runs the other way than around most of what they cover, and
/// those that then run against more of their sides than along; `border` are pairs of nodes in the direction of the loops.
pub(super) fn turn_lobes(nodes: &Nodes, border: &[[u32; 2]], facets: &mut [TransitionFacet]) {
    let enclosure = Enclosure::new(border.iter().map(|side| side.map(|n| nodes[n].uv)).collect());
    let (mut covered, mut winding) = (0.0, Vec::with_capacity(facets.len()));
    for facet in facets.iter() {
        let uv = facet.facet.nodes.map(|n| nodes[n].uv);
        let turns = enclosure.winding_number(0.25 * (uv[0] + uv[1] + uv[2] + uv[3]));
        covered += f64::from(turns.signum()) * signed_area(&uv).abs();
        winding.push(turns);
    }
    let others = facets.iter_mut().zip(winding).filter(|(_, turns)| f64::from(*turns) * covered < 0.0);
    others.for_each(|(facet, _)| facet.turn_over());
    // A lobe as narrow as numbers are rounded has nothing around which the border runs.
    let forwards = if covered < 0.0 { -1 } else { 1 };
    turn_towards_neighbours(&mut Sides::new(nodes, border, facets, forwards), facets);
}

/// Turns over facets as long as fewer sides are run along twice for it.
fn turn_towards_neighbours(sides: &mut Sides<'_>, facets: &mut [TransitionFacet]) {
    for _ in 0..MOST_ROUNDS {
        let mut turned = false;
        for facet in facets.iter_mut() {
            let against = sides.missing(facet);
            sides.run_along(facet, 2);
            if sides.missing(facet) < against {
                facet.turn_over();
                turned = true;
            } else {
                sides.run_along(facet, -2);
            }
        }
        if !turned {
            break;
        }
    }
}

/// How facets and the border run along each side between two positions.
struct Sides<'n> {
    nodes: &'n Nodes,
    /// By positions in ascending order: how many more facets should run from the first to the second, less those back.
    missing: FxHashMap<[Position; 2], i32>,
}

impl<'n> Sides<'n> {
    /// Counts the sides of the border, against its direction where `forwards` is −1, and of all facets.
    fn new(nodes: &'n Nodes, border: &[[u32; 2]], facets: &[TransitionFacet], forwards: i32) -> Self {
        let mut sides = Self { nodes, missing: FxHashMap::default() };
        border.iter().for_each(|side| sides.add(*side, forwards));
        facets.iter().for_each(|facet| sides.run_along(facet, -1));
        sides
    }

    fn add(&mut self, side: [u32; 2], times: i32) {
        let [a, b] = side.map(|n| self.nodes[n].position);
        *self.missing.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { times } else { -times };
    }

    /// Adds so many times to what is missing along the sides of a facet.
    fn run_along(&mut self, facet: &TransitionFacet, times: i32) {
        facet.sides().into_iter().for_each(|side| self.add(side, times));
    }

    /// Returns how much is missing along the sides of a facet, in either direction.
    fn missing(&self, facet: &TransitionFacet) -> i32 {
        let along = facet.sides().map(|side| {
            let [a, b] = side.map(|n| self.nodes[n].position);
            if a == b { 0 } else { self.missing.get(&[a.min(b), a.max(b)]).map_or(0, |missing| missing.abs()) }
        });
        along.into_iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Uv;
    use crate::tessellate::nodes::ProvedFacet;

    /// A square of side 4 at whose end a border like an eight leaves a triangle, either way round. Each of the three facets in that has one
    /// side of the border, so that none runs better alone.
    #[test]
    fn facets_run_along_the_border_of_both_lobes() {
        let mut nodes = Nodes::default();
        for (u, v) in [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (5.0, 3.0), (5.0, 5.0), (4.7, 4.0)] {
            nodes.push_own(Uv::new(u, v), Uv::new(u, v).extend(0.0));
        }
        // Around the square from node 2 to node 2, and then around the triangle clockwise.
        let way = [2, 3, 0, 1, 2, 5, 4];
        let border: Vec<[u32; 2]> = (0..way.len()).map(|k| [way[k], way[(k + 1) % way.len()]]).collect();
        let backwards: Vec<[u32; 2]> = border.iter().map(|&[a, b]| [b, a]).collect();
        for (border, forwards) in [(border, true), (backwards, false)] {
            let facet = |nodes: [u32; 4]| {
                let facet = ProvedFacet { nodes, bound: 0.0, tolerance: 0.1 };
                TransitionFacet { facet, pole: Some((1, Uv::new(5.0, 3.0))) }
            };
            let mut facets = [[0, 1, 2, 3], [2, 4, 6, 6], [4, 5, 6, 6], [5, 2, 6, 6]].map(facet);
            turn_lobes(&nodes, &border, &mut facets);
            let turned = [[0, 1, 2, 3], [2, 6, 4, 4], [4, 6, 5, 5], [5, 6, 2, 2]];
            assert_eq!(facets.map(|f| f.facet.nodes), turned, "{forwards}");
            assert_eq!(facets.map(|f| f.pole.map(|(at, _)| at)), [1, 2, 2, 2].map(Some));
        }
    }

    /// Beside a square, a lobe of two facets without width, on the line v = 5.
    #[test]
    fn facets_without_width_run_along_the_border() {
        let mut nodes = Nodes::default();
        for (u, v) in [(0.0, 0.0), (4.0, 0.0), (4.0, 5.0), (0.0, 5.0), (7.0, 5.0), (6.0, 5.0), (5.0, 5.0)] {
            nodes.push_own(Uv::new(u, v), Uv::new(u, v).extend(0.0));
        }
        let way = [0, 1, 2, 5, 4, 6, 3];
        let border: Vec<[u32; 2]> = (0..way.len()).map(|k| [way[k], way[(k + 1) % way.len()]]).collect();
        for reversed in [false, true] {
            let facet = |nodes: [u32; 4]| TransitionFacet::from(ProvedFacet { nodes, bound: 0.0, tolerance: 0.1 });
            let mut facets = [[0, 1, 2, 3], [2, 6, 3, 3], [2, 6, 5, 5], [6, 4, 5, 5]].map(facet);
            let mut border = border.clone();
            if reversed {
                border.iter_mut().for_each(|side| side.reverse());
            }
            turn_lobes(&nodes, &border, &mut facets);
            assert_eq!(facets.map(|f| f.facet.nodes), [[0, 1, 2, 3], [2, 6, 3, 3], [2, 5, 6, 6], [6, 5, 4, 4]]);
        }
    }
}

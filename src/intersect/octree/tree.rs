//! The tree as rays walk it, and what its walkers need of the mesh.

use super::mesh_box::MeshBox;
use super::node::{Block, Link, Node, Target};
use super::subdivision::subdivide;
use super::{Settings, Statistics, flatten};
use crate::intersect::facet::Surroundings;
use crate::intersect::slopes::Slopes;
use crate::math::{Aabb, Point, Ray, huge_pages};
use crate::mesh::FacetMesh;
use rayon::prelude::*;

/// Levels of nodes that no tree goes beyond: 61, of which cells have 32 and packing 30, with one that both share; rounded up.
pub(super) const DEEPEST: usize = 64;
/// By how much the box around the mesh is grown, in diagonals: far more than the rounding of where a ray enters it.
const BOUNDS_ROOM: f64 = 1e-6;

/// The nodes and blocks of an octree with the mesh that they are of.
#[derive(Clone)]
pub(super) struct Tree<'m> {
    pub(super) surroundings: Surroundings<'m>,
    /// Middle of the mesh, about which nodes and blocks are given.
    pub(super) center: Point,
    pub(super) mesh_box: MeshBox,
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    /// `None` without facets.
    pub(super) root: Option<Link>,
    /// Nodes on the longest way down.
    pub(super) levels: usize,
    /// Of all facets.
    pub(super) slopes: Vec<Slopes>,
}

impl<'m> Tree<'m> {
    /// Builds the tree with the threads of the current rayon pool and overwrites `statistics`.
    pub(super) fn build(mesh: &'m FacetMesh, settings: &Settings, statistics: &mut Statistics) -> Self {
        let surroundings = Surroundings::new(mesh);
        let center = middle(&surroundings);
        let cell = subdivide(mesh, center, settings, statistics);
        let flat = cell.map(|cell| flatten::flatten(mesh, center, cell, settings, statistics));
        let (nodes, blocks, root) = match flat {
            Some(flat) => (flat.nodes, flat.blocks, Some(flat.root)),
            None => (Vec::new(), Vec::new(), None),
        };
        let mut slopes = huge_pages::with_capacity(mesh.facets.len());
        (0..mesh.facets.len()).into_par_iter().map(|f| Slopes::new(mesh.corners(f))).collect_into_vec(&mut slopes);
        Self::new(surroundings, nodes, blocks, (root, statistics.depth()), slopes)
    }

    /// Joins nodes and blocks, given relative to the middle of the mesh, the root with the levels of nodes below it, and the slopes of all
    /// facets with what walks need of the mesh; checks nothing.
    pub(super) fn new(
        surroundings: Surroundings<'m>,
        nodes: Vec<Node>,
        blocks: Vec<Block>,
        (root, levels): (Option<Link>, usize),
        slopes: Vec<Slopes>,
    ) -> Self {
        let (finite, center) = (surroundings.bounds, middle(&surroundings));
        let bounds = if finite.is_empty() { Aabb::EMPTY } else { finite.grown(finite.diagonal() * BOUNDS_ROOM) };
        let mesh_box = MeshBox::new(center, &bounds);
        Self { surroundings, center, mesh_box, nodes, blocks, root, levels, slopes }
    }

    /// The facet that a ray leaves where it is known not to meet it again, else `u32::MAX`, which no facet has.
    #[inline(always)]
    pub(super) fn unmet_facet(&self, ray: &Ray) -> u32 {
        let Some(from) = ray.departure else { return u32::MAX };
        match self.slopes.get(from.primitive as usize) {
            Some(slopes) if slopes.leaves(ray.direction) => from.primitive,
            _ => u32::MAX,
        }
    }

    /// The boxes of all nodes and blocks but the root, mm in the mesh's coordinates, with their depth; the root's children have depth 1.
    pub(super) fn boxes(&self) -> Vec<(usize, Aabb)> {
        let mut boxes = Vec::new();
        let mut open: Vec<(Link, usize)> = self.root.iter().map(|&root| (root, 1)).collect();
        while let Some((link, depth)) = open.pop() {
            let Target::Node(index) = link.target() else { continue };
            let node = &self.nodes[index];
            for slot in node.slots() {
                let b = node.child(slot);
                boxes.push((depth, Aabb { min: b.min + self.center, max: b.max + self.center }));
                open.push((Link(node.children[slot]), depth + 1));
            }
        }
        boxes
    }

    /// Bytes held, without the mesh.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.blocks) + size_of_val(&*self.slopes)
    }
}

/// The middle of a mesh; the origin of one without points.
fn middle(surroundings: &Surroundings) -> Point {
    if surroundings.bounds.is_empty() { Point::ZERO } else { surroundings.bounds.center() }
}

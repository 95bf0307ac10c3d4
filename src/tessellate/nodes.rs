//! Corners of a face's facets while it is meshed: parameters, place in space and the point that facets share there.

use crate::math::{Point, Uv};
use std::ops::Index;

/// A point that facets meet in, by its index in one of two lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Position {
    /// One of the part's: a vertex, or a sample of an edge. Other faces may have corners there.
    Shared(u32),
    /// One that the face made itself.
    Own(u32),
}

/// A corner: several lie at one position where the parameters differ, as on both sides of a seam or along a pole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Parameters of the surface.
    pub(super) uv: Uv,
    /// In the part's coordinates.
    pub(super) place: Point,
    pub(super) position: Position,
}

/// The nodes of a face, named by their index, and the places of the positions that are its own.
#[derive(Clone, Default)]
pub(super) struct Nodes {
    all: Vec<Node>,
    own: Vec<Point>,
}

/// How many nodes and own positions there were.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    nodes: usize,
    own: usize,
}

impl Nodes {
    /// No nodes yet, and own positions that are known already.
    pub(super) fn with_own(own: Vec<Point>) -> Self {
        Self { all: Vec::new(), own }
    }

    pub(super) fn len(&self) -> u32 {
        self.all.len() as u32
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Node> {
        self.all.iter()
    }

    /// Adds a node at a position that exists, and returns its number.
    pub(super) fn push(&mut self, node: Node) -> u32 {
        self.all.push(node);
        self.len() - 1
    }

    /// Adds a node at a new position of its own, and returns the node's number; `place` is in the part's coordinates.
    pub(super) fn push_own(&mut self, uv: Uv, place: Point) -> u32 {
        self.own.push(place);
        self.push(Node { uv, place, position: Position::Own(self.own.len() as u32 - 1) })
    }

    /// Returns the state to which `rewind` goes back.
    pub(super) fn mark(&self) -> Mark {
        Mark { nodes: self.all.len(), own: self.own.len() }
    }

    /// Takes back all nodes and own positions made after the mark.
    pub(super) fn rewind(&mut self, mark: Mark) {
        self.all.truncate(mark.nodes);
        self.own.truncate(mark.own);
    }

    /// Hands over the nodes and the places of own positions.
    pub(super) fn into_parts(self) -> (Vec<Node>, Vec<Point>) {
        (self.all, self.own)
    }
}

impl Index<u32> for Nodes {
    type Output = Node;

    fn index(&self, node: u32) -> &Node {
        &self.all[node as usize]
    }
}

/// A facet of `N` nodes, counter-clockwise in parameters, and how it stands to its tolerance.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProvedFacet<const N: usize> {
    pub(super) nodes: [u32; N],
    /// Distance between the facet and its piece of the surface, mm of the part: proved where it is at most the tolerance, without meaning
    /// above it.
    pub(super) bound: f64,
    /// The tolerance at its place, mm of the part.
    pub(super) tolerance: f64,
}

/// Returns the key of the edge between two nodes, whichever way it runs.
pub(super) fn edge_key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

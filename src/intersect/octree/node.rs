//! What is walked: nodes of up to sixteen children and blocks of up to four facets, three lines of the cache each.

use super::clip::{Box32, round_down};
use crate::math::{Aabb, Point};
use crate::mesh::FacetMesh;
use bytemuck::{Pod, Zeroable};

/// By how much steps are made larger, so that the last bound reaches the far side whatever their rounding to f32: sixteen roundings.
const STEP_ROOM: f64 = 1.0 + 1e-6;
/// Least step of a node relative to its origin: the spacing of f32 there, below which `origin + bound · step` would stand still.
const LEAST_RELATIVE_STEP: f32 = 1e-7;
/// Least step of a node, mm: its product with the inverse of a direction stays a normal number.
const LEAST_NODE_STEP: f32 = 1e-20;
/// Least step of a block, mm: squares of it vanish, but the sieve keeps what is not above its error.
const LEAST_BLOCK_STEP: f32 = 1e-30;

/// Where a child is: a node, or a block with its number of facets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link(pub(super) u32);

/// What a [`Link`] points at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Node(usize),
    /// Index and number of facets.
    Block(usize, usize),
    /// Nothing left to visit.
    End,
}

impl Link {
    /// What the two highest bits say; with none of them a link leads to a node.
    const BLOCK: u32 = 2 << 30;
    /// The bits of an index with the number of facets below it.
    const PLACE: u32 = (1 << 30) - 1;
    /// Blocks, and nodes, that links can distinguish.
    pub(super) const MOST_BLOCKS: usize = 1 << 28;
    /// Of a slot that is not in use: no child is the node at the root.
    pub(super) const NONE: Self = Self(0);
    /// Where a ray goes that has nothing left to visit.
    pub(super) const END: Self = Self(3 << 30);

    pub(super) fn node(index: usize) -> Self {
        Self((index as u32) << 2)
    }

    /// Names a block of `count` facets, one to four.
    pub(super) fn block(index: usize, count: u8) -> Self {
        Self(Self::BLOCK | (index as u32) << 2 | u32::from(count - 1))
    }

    /// What the link points at.
    #[inline(always)]
    pub(super) fn target(self) -> Target {
        match self.kind() {
            0 => Target::Node(self.index()),
            2 => Target::Block(self.index(), self.facets()),
            _ => Target::End,
        }
    }

    #[inline(always)]
    pub(super) fn is_node(self) -> bool {
        self.kind() == 0
    }

    /// The index of a node or block; 0 at the end.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        ((self.0 & Self::PLACE) >> 2) as usize
    }

    /// The number of facets of a block; of other links it is of no meaning.
    #[inline(always)]
    pub(super) fn facets(self) -> usize {
        (self.0 & 3) as usize + 1
    }

    /// 0 for a node, 2 for a block, 3 for the end.
    #[inline(always)]
    pub(super) fn kind(self) -> usize {
        (self.0 >> 30) as usize
    }

    /// The same link after its target moved up by so many nodes or blocks, whichever it is; not defined for [`Self::END`].
    pub(super) fn moved(self, nodes: usize, blocks: usize) -> Self {
        Self(self.0 + ((if self.is_node() { nodes } else { blocks } as u32) << 2))
    }
}

/// Children of a node.
pub(super) const CHILDREN: usize = 16;

/// Up to sixteen children with boxes in eight bits a bound, `origin + bound · step`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Lower and upper bounds along x, y, z.
    pub(super) bounds: [[u8; CHILDREN]; 6],
    pub(super) origin: [f32; 3],
    pub(super) step: [f32; 3],
    /// 1: what is loaded with the steps as a fourth must be a normal number, because those below take a hundred times as long.
    pub(super) one: f32,
    /// The axis along which the children of slots from eight on lie above the others.
    pub(super) long_axis: u32,
    /// Links, by slot; [`Link::NONE`] where a slot is not in use, and its box means nothing.
    pub(super) children: [u32; CHILDREN],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        bounds: [[255; CHILDREN], [0; CHILDREN], [255; CHILDREN], [0; CHILDREN], [255; CHILDREN], [0; CHILDREN]],
        origin: [0.0; 3],
        step: [0.0; 3],
        one: 1.0,
        long_axis: 0,
        children: [Link::NONE.0; CHILDREN],
    };

    /// What slots are to be combined with, bit by bit, for the order in which a ray of an octant mostly meets children.
    #[inline(always)]
    pub(super) fn slot_order(&self, octant: u8) -> u32 {
        let octant = u32::from(octant);
        octant | (octant >> (self.long_axis & 3) & 1) << 3
    }

    /// The slots in use.
    #[inline]
    pub(super) fn slots(&self) -> impl Iterator<Item = usize> + use<> {
        let children = self.children;
        (0..CHILDREN).filter(move |&slot| Link(children[slot]) != Link::NONE)
    }

    /// A node without children whose grid spans the box `all`, relative to the middle of the mesh.
    pub(super) fn bounding(all: &Box32) -> Self {
        let mut node = Self::EMPTY;
        for a in 0..3 {
            let origin = all.low[a].next_down();
            // A step below the spacing of f32 at the origin would be lost in `origin + bound · step`.
            let step = ((f64::from(all.high[a]) - f64::from(origin)) / 254.0 * STEP_ROOM) as f32;
            node.origin[a] = origin;
            node.step[a] = step.max(origin.abs() * LEAST_RELATIVE_STEP).max(LEAST_NODE_STEP);
        }
        node
    }

    /// Fills a slot, below sixteen, with a child and its box, rounded outward to the node's grid; the box must lie within the node.
    pub(super) fn set_child(&mut self, slot: usize, bounds: &Box32, link: Link) {
        for a in 0..3 {
            let (origin, step) = (f64::from(self.origin[a]), f64::from(self.step[a]));
            let low = (f64::from(bounds.low[a]) - origin) / step;
            let high = (f64::from(bounds.high[a]) - origin) / step;
            // Casts cut off and saturate; `floor` and `ceil` are calls on processors without SSE4.1.
            let whole = high as u8;
            self.bounds[2 * a][slot] = low as u8;
            self.bounds[2 * a + 1][slot] = whole.saturating_add(u8::from(f64::from(whole) < high));
        }
        self.children[slot] = link.0;
    }
}

impl Node {
    /// The box of a child relative to the middle of the mesh, mm; of a slot that is not used it means nothing.
    pub(super) fn child(&self, slot: usize) -> Aabb {
        let corner = |row: usize| {
            Point::from_array(std::array::from_fn(|a| {
                f64::from(self.origin[a]) + f64::from(self.bounds[2 * a + row][slot]) * f64::from(self.step[a])
            }))
        };
        Aabb { min: corner(0), max: corner(1) }
    }
}

/// Up to four facets; corners in 16 bits, `origin + corner · step`, to sort out what a ray cannot hit.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// x, y, z of corners 0 (lanes 0–3), 2 (4–7), 1 (8–11) and 3 (12–15) of the four facets.
    pub(super) corners: [[u16; 16]; 3],
    pub(super) origin: [f32; 3],
    pub(super) step: f32,
    /// Indices in the mesh; lanes that are not used name none.
    pub(super) facets: [u32; 4],
    /// Indices of the exact corners in the mesh.
    pub(super) positions: [[u32; 4]; 4],
}

impl Block {
    /// The triangles of a facet (bits 0 and 1) among those that the sieve left.
    #[inline(always)]
    pub(super) fn triangles(&self, facet: usize, candidates: u32) -> u32 {
        // The second triangle of a triangle is a line: it is never hit, but to see that takes exact arithmetic.
        let is_quad = u32::from(self.positions[facet][2] != self.positions[facet][3]);
        candidates >> facet & 1 | candidates >> (facet + 3) & (is_quad << 1)
    }

    /// A block of these facets, one to four, with corners relative to `center`; further ones must not be given.
    pub(super) fn new(mesh: &FacetMesh, center: Point, facets: &[u32]) -> Self {
        let mut corners = [[Point::ZERO; 4]; 4];
        let (mut low, mut high) = (Point::INFINITY, Point::NEG_INFINITY);
        for (corners, &facet) in corners.iter_mut().zip(facets) {
            *corners = mesh.corners(facet as usize);
            for p in corners {
                *p -= center;
                low = low.min(*p);
                high = high.max(*p);
            }
        }
        let origin = low.to_array().map(round_down);
        let largest = (0..3).map(|a| high[a] - f64::from(origin[a])).fold(0.0, f64::max);
        let step = ((largest / 65535.0 * STEP_ROOM) as f32).max(LEAST_BLOCK_STEP);
        let mut block = Self { corners: [[0; 16]; 3], origin, step, facets: [u32::MAX; 4], positions: [[0; 4]; 4] };
        let per_step = 1.0 / f64::from(step);
        for (lane, &facet) in facets.iter().enumerate().take(4) {
            block.facets[lane] = facet;
            block.positions[lane] = mesh.corner_positions(facet as usize);
            for (place, k) in [0, 2, 1, 3].into_iter().enumerate() {
                let p = corners[lane][k].to_array();
                for a in 0..3 {
                    // Rounded to the nearest, since casts cut off; half a step is what the sieve allows for.
                    block.corners[a][4 * place + lane] = ((p[a] - f64::from(origin[a])) * per_step + 0.5) as u16;
                }
            }
        }
        block
    }
}

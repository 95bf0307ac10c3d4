//! What box tests and sieves need of a ray in f32, and how wrong they may be.

use super::node::{Block, CHILDREN, Node};

/// By how much the distance at which a ray leaves a box is stretched, so that rounding never closes a box that is met: a fused
/// multiply-add, the far slack and a product, each wrong by half of 2⁻²³, and a factor of three.
pub(super) const LEAVE_STRETCH: f32 = 1.0 + 5e-7;

/// Roundings of f32 arithmetic on lengths up to `far` in the coordinates of a corner: below nine, of 2⁻²⁴ each, and one more.
const CORNER_ROUNDING: f32 = 6e-7;

/// What box tests need of a ray, in f32 about the middle of the mesh.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct BoxRay {
    /// The inverse direction.
    pub(super) inverse: [f32; 4],
    pub(super) origin: [f32; 4],
    /// By how much the distance of a crossing may be wrong, by axis, mm along the ray.
    pub(super) slack: [f32; 4],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    pub(super) rows: Rows,
}

/// Which bounds of a node a ray of an octant meets first.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(8))]
pub(super) struct Rows {
    /// One bit an axis: set where the ray runs against it.
    pub(super) octant: u8,
    /// By axis, the first byte in [`Node::bounds`] of those that the ray enters by, and of those that it leaves by.
    pub(super) near: [u8; 3],
    pub(super) far: [u8; 3],
}

impl Rows {
    /// By octant.
    pub(super) const ALL: [Self; 8] = {
        let mut all = [Self { octant: 0, near: [0; 3], far: [0; 3] }; 8];
        let mut octant = 0;
        while octant < 8 {
            all[octant].octant = octant as u8;
            let mut axis = 0;
            while axis < 3 {
                let against = octant >> axis & 1;
                all[octant].near[axis] = (CHILDREN * (2 * axis + against)) as u8;
                all[octant].far[axis] = (CHILDREN * (2 * axis + 1 - against)) as u8;
                axis += 1;
            }
            octant += 1;
        }
        all
    };
}

/// What a ray is against a node: which, and what crossings of the bounds of its children are computed with, by axis. A bound is crossed at
/// `bound · scale + near` where the ray enters by it, with `far` where it leaves. The fourth numbers mean nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Entry<'t> {
    pub(super) scale: [f32; 4],
    pub(super) near: [f32; 4],
    pub(super) far: [f32; 4],
    pub(super) node: &'t Node,
    /// [`Node::slot_order`] of the ray.
    pub(super) order: u32,
}

/// Of no ray.
static NO_NODE: Node = Node::EMPTY;

impl<'t> Entry<'t> {
    pub(super) const IDLE: Self = Self { scale: [0.0; 4], near: [0.0; 4], far: [0.0; 4], node: &NO_NODE, order: 0 };

    /// Overwrites all with what a ray is against a node, in plain Rust.
    #[inline(always)]
    pub(super) fn prepare(&mut self, node: &'t Node, ray: &BoxRay) {
        self.node = node;
        self.order = node.slot_order(ray.rows.octant);
        for a in 0..3 {
            // Entering is made earlier and leaving later by what `f32` may be wrong by: boxes may be met in vain but never missed.
            let base = (node.origin[a] - ray.origin[a]) * ray.inverse[a];
            self.scale[a] = node.step[a] * ray.inverse[a];
            self.near[a] = base - ray.slack[a];
            self.far[a] = base + ray.slack[a];
        }
    }
}

/// What the sieve of a block needs of a ray.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct SieveRay {
    /// The origin about the middle of the mesh.
    pub(super) high: [f32; 4],
    /// What `high` lost in rounding.
    pub(super) low: [f32; 4],
    /// Slopes against the main axis, and the inverse of the direction along it.
    pub(super) shear: [f32; 3],
    /// By how much the start may be moved or wrong, mm.
    pub(super) slack: f32,
    /// Two lateral axes, then the main one.
    pub(super) axes: [u8; 3],
}

/// Where a ray is against a block, and how wrong its sieve may be.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct SieveLimits {
    /// The origin of the block against that of the ray, mm; the fourth number means nothing.
    pub(super) to: [f32; 4],
    /// As [`edge_error`].
    pub(super) error: f32,
    /// The ray's range, wider by how wrong the corners may be, mm.
    pub(super) t_min: f32,
    pub(super) t_max: f32,
}

impl SieveLimits {
    /// In plain Rust.
    #[inline(always)]
    pub(super) fn new(block: &Block, ray: &SieveRay, boxes: &BoxRay) -> Self {
        let mut to = [0.0; 4];
        for a in 0..3 {
            // In two parts: of a start far from the block one `f32` would lose the digits that distinguish the corners.
            to[a] = (block.origin[a] - ray.high[a]) - ray.low[a];
        }
        let far = to[0].abs().max(to[1].abs()).max(to[2].abs());
        Self::with_place(block, ray, boxes, (to, far))
    }

    /// With the place of the block against the ray, and the largest of its sizes.
    #[inline(always)]
    pub(super) fn with_place(block: &Block, ray: &SieveRay, boxes: &BoxRay, (to, far): ([f32; 4], f32)) -> Self {
        let corner = corner_error(block.step, far, ray.slack);
        let error = edge_error(block.step, corner);
        Self { to, error, t_min: boxes.t_min - 2.0 * corner, t_max: boxes.t_max + 2.0 * corner }
    }
}

/// How wrong the position of a corner may be against the ray, mm, in a block whose farthest coordinate from the start is `far`.
///
/// Corners are rounded to half a step an axis, to which sheared coordinates add the same along the main axis;
/// f32 arithmetic on lengths up to `far + 65536 step` adds less than nine roundings.
#[inline(always)]
fn corner_error(step: f32, far: f32, slack: f32) -> f32 {
    1.1 * step + CORNER_ROUNDING * far + slack
}

/// How wrong the edge functions of a facet that is hit may be, mm², from the error of a corner, mm.
///
/// The corners of a facet that is hit lie within its sheared diameter, at most 2·65535 steps, of the ray; a product of
/// two of them is wrong by four times that and the error of one, and the rounding of the products is below a tenth of it.
#[inline(always)]
fn edge_error(step: f32, corner: f32) -> f32 {
    4.5 * (131_072.0 * step + corner) * corner
}

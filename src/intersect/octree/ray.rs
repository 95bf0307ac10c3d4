//! What box tests and sieves need of a ray in f32, and how wrong they may be.

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
    /// By how much the distance of a crossing may be wrong, by axis, mm along the ray, with the sign of the direction: what is taken from
    /// the crossing of a lower bound and added to that of an upper one, whichever is met first.
    pub(super) slack: [f32; 4],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// One bit an axis: set where the ray runs against it.
    pub(super) octant: u8,
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

/// How wrong the position of a corner may be against the ray, mm, in a block whose farthest coordinate from the start is `far`.
///
/// Corners are rounded to half a step an axis, to which sheared coordinates add the same along the main axis;
/// f32 arithmetic on lengths up to `far + 65536 step` adds less than nine roundings.
#[inline(always)]
pub(super) fn corner_error(step: f32, far: f32, slack: f32) -> f32 {
    1.1 * step + CORNER_ROUNDING * far + slack
}

/// How wrong the edge functions of a facet that is hit may be, mm², from the error of a corner, mm.
///
/// The corners of a facet that is hit lie within its sheared diameter, at most 2·65535 steps, of the ray; a product of
/// two of them is wrong by four times that and the error of one, and the rounding of the products is below a tenth of it.
#[inline(always)]
pub(super) fn edge_error(step: f32, corner: f32) -> f32 {
    4.5 * (131_072.0 * step + corner) * corner
}

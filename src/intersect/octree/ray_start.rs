//! Where a ray starts against the boxes of a mesh.

use super::mesh_box::MeshBox;
use super::ray::{BoxRay, Rows, SieveRay};
use crate::math::Ray;

/// Smallest component of a direction that is divided by: along it a ray moves by less than the room around boxes in 10⁵ scene
/// sizes, and 1e12 mm times its inverse is still a number in f32.
pub(super) const LEAST_COMPONENT: f64 = 1e-18;
/// What a start that was moved along its ray is wrong by, relative to the way: four roundings in f64.
pub(super) const SHIFT_ERROR: f64 = 1e-15;
/// Rounding of f32, 2⁻²⁴, rounded up.
pub(super) const ROUNDING: f32 = 6e-8;

/// Overwrites what box tests and sieves need of a ray, in the mesh's coordinates, but for its range and shear, in plain Rust. Returns where
/// box distances start, mm along the ray; `None` where it passes by the whole mesh. `slack` is how wrong its start may be, mm.
///
/// Far origins are moved to where they enter, since f32 is good only near the mesh. Rays of one kind mostly start all inside or all
/// outside.
#[inline(always)]
pub(super) fn start(
    ray: &Ray,
    mesh_box: &MeshBox,
    slack: f64,
    boxes: &mut BoxRay,
    sieve: &mut SieveRay,
) -> Option<f64> {
    let direction = [ray.direction.x, ray.direction.y, ray.direction.z, 1.0];
    let origin = [ray.origin.x, ray.origin.y, ray.origin.z, 0.0];
    let inverse = direction.map(|d| 1.0 / if d.abs() < LEAST_COMPONENT { LEAST_COMPONENT.copysign(d) } else { d });
    let is_inside = mesh_box.holds(origin) & (ray.t_min >= 0.0);
    let shift = if is_inside { 0.0 } else { enter_mesh(ray, mesh_box, origin, inverse)? };
    let moved = moved(slack, shift);
    let mut octant = 0;
    for a in 0..4 {
        let inverse = inverse[a] as f32;
        let exact = (origin[a] - mesh_box.center[a]) + direction[a] * shift;
        let o = exact as f32;
        boxes.origin[a] = o;
        boxes.inverse[a] = inverse;
        boxes.slack[a] = ((4.0 * o.abs() + mesh_box.reach[a]) * ROUNDING + moved) * inverse.abs();
        sieve.high[a] = o;
        sieve.low[a] = (exact - f64::from(o)) as f32;
        octant |= usize::from(inverse < 0.0) << a;
    }
    boxes.rows = Rows::ALL[octant & 7];
    sieve.slack = moved;
    Some(shift)
}

/// How wrong a start may be that was moved along its ray, mm.
#[inline(always)]
pub(super) fn moved(slack: f64, shift: f64) -> f32 {
    (slack + shift.abs() * SHIFT_ERROR) as f32
}

/// Where a ray that starts outside enters the box around the mesh, mm along it; `None` where it passes by. The last of four lanes does not
/// count.
#[inline(always)]
pub(super) fn enter_mesh(ray: &Ray, mesh_box: &MeshBox, origin: [f64; 4], inverse: [f64; 4]) -> Option<f64> {
    let passage = mesh_box.passage(ray, origin, inverse);
    // Guessed wrong at times, but most rays of a source that shines all around end here.
    ((passage.near <= passage.far) & passage.near.is_finite()).then_some(passage.near)
}

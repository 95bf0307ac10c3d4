//! Points, rays, boxes, frames and roots: what every other module stands on.
//!
//! Lengths are millimetres, angles radians, all numbers `f64`. The vector types are glam's; the module adds
//! nothing to them but names that say what a triple means.

mod aabb;
mod box_tree;
mod distance;
mod enclosure;
mod frame;
pub(crate) mod huge_pages;
mod maximum;
mod near_points;
pub(crate) mod polygon;
pub(crate) mod quadrature;
mod ray;
mod roots;
pub(crate) mod simd;
mod spread;
mod threads;
pub mod units;

use bytemuck::{AnyBitPattern, NoUninit};

pub use aabb::Aabb;
pub use box_tree::{BoxTree, BoxWalk};
pub(crate) use distance::{distance_to_segment, distance_to_triangle, squared_distance_to_segment};
pub(crate) use enclosure::Enclosure;
pub use frame::Frame;
pub(crate) use maximum::{error_of_maximum, largest_distance};
pub(crate) use near_points::NearPoints;
pub use ray::{Departure, QuadHalf, Ray};
pub use roots::{quadratic_roots, safe_newton};
use serde::{Deserialize, Serialize};
pub(crate) use spread::{
    error_beside_unseen_ray, error_of_mean, error_of_sum, variance_from_residuals, variance_of_sum,
};
pub(crate) use threads::run_on_threads;

/// A position, mm.
pub type Point = glam::DVec3;
/// A direction or difference of positions; unit length where the name says `normal` or `direction`.
pub type Vector = glam::DVec3;
/// A pair of surface parameters.
pub type Uv = glam::DVec2;
/// A homogeneous point `(w·x, w·y, w·z, w)`.
pub type Homogeneous = glam::DVec4;

/// Identifies one placed face of a model: its position in [`crate::model::Model::placed_faces`].
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, NoUninit, AnyBitPattern, Serialize, Deserialize,
)]
#[repr(transparent)]
pub struct FaceId(pub u32);

impl FaceId {
    /// The id as an index into a slice of placed faces.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Returns two unit vectors `a`, `b` that complete the unit vector `n` to a right-handed frame `(a, b, n)`.
///
/// Branch-free and continuous except at `n.z = 0⁻`: Duff et al., *Building an Orthonormal Basis, Revisited*, JCGT 2017.
pub fn orthonormal_pair(n: Vector) -> (Vector, Vector) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vector::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vector::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orthonormal_pair_is_right_handed() {
        for n in [Vector::Z, -Vector::Z, Vector::X, Vector::new(0.6, -0.48, 0.64), Vector::new(0.6, 0.8, -0.0)] {
            let (a, b) = orthonormal_pair(n);
            assert!((a.cross(b) - n).length() < 1e-15, "{n}");
            assert!(a.dot(n).abs() < 1e-15 && b.dot(n).abs() < 1e-15);
        }
    }
}

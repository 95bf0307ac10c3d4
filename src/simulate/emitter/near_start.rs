//! Rays that start far away from the scene, moved along their directions to beside it.

use crate::math::{Point, Ray};

/// Where the rays of a far source start.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearStart {
    /// Middle of the scene, mm.
    pub(super) centre: Point,
    /// Distance before the point nearest to the centre, mm: as far as the scene reaches.
    pub(super) before: f64,
    /// Distance from the centre from which on a start is moved, mm.
    pub(super) far: f64,
}

impl NearStart {
    /// Moves the origin of a ray that starts more than `far` from the centre along its direction to beside the scene; leaves one that
    /// starts nearer, or goes away from the scene.
    #[inline(always)]
    pub(super) fn bring_near(&self, ray: &mut Ray) {
        let to_centre = self.centre - ray.origin;
        // Squares, as most rays start near and need no root.
        if to_centre.length_squared() > self.far * self.far {
            let t = to_centre.dot(ray.direction) - self.before;
            if t > 0.0 {
                let [o, d] = [ray.origin, ray.direction];
                ray.origin = Point::new(d.x.mul_add(t, o.x), d.y.mul_add(t, o.y), d.z.mul_add(t, o.z));
            }
        }
    }
}

//! Where a ray that leaves a surface begins, so that facets and spline get the same query.

use crate::intersect::{Cost, Intersector};
use crate::math::{Point, Ray, Vector};

/// Tolerances above the surface that a ray left: clear of facets and spline alike.
const LIFT_IN_TOLERANCES: f64 = 4.0;
/// That height at most, as a share of the way to the next surface above: a ray within a wall thinner than that begins within it.
const LIFT_IN_WALLS: f64 = 0.25;

/// Begins rays in free space above the surface that they leave, whatever an intersector takes for it.
#[derive(Clone, Copy)]
pub struct Lift<'a> {
    guide: &'a dyn Intersector,
    height: f64,
}

impl<'a> Lift<'a> {
    /// `guide` finds the next surface above; `tolerance` is the loosest of the facets, mm.
    pub fn new(guide: &'a dyn Intersector, tolerance: f64) -> Self {
        Self { guide, height: LIFT_IN_TOLERANCES * tolerance }
    }

    /// Returns where a ray begins that starts on a surface: along `up`, the unit normal on the side that it goes to.
    pub fn start(&self, ray: &Ray, up: Vector) -> Point {
        let upwards = Ray { direction: up, ..*ray };
        let next = self.guide.intersect(&upwards, &mut Cost::default()).map_or(f64::INFINITY, |hit| hit.t);
        ray.origin + self.height.min(LIFT_IN_WALLS * next) * up
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::{self, Exact};
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use crate::study::sample_models;

    #[test]
    fn a_ray_begins_clear_of_its_surface_and_within_its_wall() {
        let ray = Ray::new(Point::new(1.0, 2.0, 3.0), Vector::new(0.6, 0.0, 0.8));
        for (ceiling, height) in [(None, 0.8), (Some(10.0), 0.8), (Some(3.2), 0.8), (Some(1.0), 0.25)] {
            // So far over the start.
            let above = ceiling.map(|z| sweep::plane(&Frame::translation((3.0 + z) * Vector::Z), [[-5.0, 5.0]; 2]));
            let ceiling_model = sample_models::model("ceiling", above);
            let exact = Exact::build(&ceiling_model, &exact::Settings::default());
            let start = Lift::new(&exact, 0.2).start(&ray, Vector::Z);
            assert!((start - ray.origin - height * Vector::Z).length() < 1e-15, "{ceiling:?}: {start}");
        }
    }
}

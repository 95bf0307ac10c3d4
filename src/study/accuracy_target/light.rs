//! The light that a model is meshed for.

use crate::intersect::{Hit, Intersector};
use crate::math::Ray;

/// Rays of a job on these surfaces, by seed and number.
pub type RayGenerator<'r> = dyn Fn(&dyn Intersector, u64, u64) -> Vec<Ray> + Sync + 'r;

/// The light of a job.
#[derive(Clone, Copy)]
pub struct JobLight<'r> {
    /// Its rays.
    pub rays: &'r RayGenerator<'r>,
    /// The refractive index before the place where a ray meets the spline over that behind it; `None` where no light passes.
    pub index_ratio: &'r (dyn Fn(&Ray, &Hit) -> Option<f64> + Sync),
}

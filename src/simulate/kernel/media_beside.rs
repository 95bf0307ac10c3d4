//! The media on both sides of a face that a ray meets, from geometry: for studies of what a face does to light, which follow no path.

use super::contact::{FaceHit, touching_body};
use super::context::Context;
use super::media_at::media_at;
use crate::intersect::{Hit, Intersector};
use crate::math::Ray;
use crate::simulate::bind::BoundScene;
use crate::simulate::body::AMBIENT;
use crate::simulate::settings::RunSettings;

/// Finds the media on both sides of the faces of a scene.
pub struct MediaBeside<'a> {
    context: Context<'a>,
}

impl<'a> MediaBeside<'a> {
    /// Looks for other bodies with `intersector`, which must know the faces of the scene.
    pub fn new(bound: &'a BoundScene, intersector: &'a dyn Intersector, settings: &'a RunSettings) -> Self {
        Self { context: Context::without_media(bound, intersector, settings) }
    }

    /// Returns the refractive index before the face that a ray meets over that behind it, at the wavelength of the scene; `None` where no
    /// light passes.
    pub fn index_ratio(&self, ray: &Ray, hit: &Hit) -> Option<f64> {
        let bound = self.context.bound;
        let inside = bound.entered_body(hit.face)?;
        let leaves = ray.direction.dot(hit.geometric_normal) > 0.0;
        let [inside, outside] =
            [inside, self.body_outside(ray, hit, leaves)?].map(|body| bound.relative_index(body));
        Some(if leaves { inside / outside } else { outside / inside })
    }

    /// Returns the body before the outer side of a face; `None` where it lies on a face of another body that lets no light in.
    fn body_outside(&self, ray: &Ray, hit: &Hit, leaves: bool) -> Option<u32> {
        let context = &self.context;
        if !context.bound.nested {
            return Some(AMBIENT);
        }
        let point = ray.point_at(hit.t);
        let face = *context.bound.faces.get(hit.face.index())?;
        let partner =
            if face.touches_body { touching_body(context, ray, &FaceHit { hit: *hit, face, point }) } else { None };
        if let Some(partner) = partner {
            return context.bound.entered_body(partner.hit.face);
        }
        let outward = if leaves { ray.direction } else { -ray.direction };
        let bodies = media_at(context, &Ray::new(point, outward).with_departure(hit.departure()));
        Some(bodies.last().copied().unwrap_or(AMBIENT))
    }
}

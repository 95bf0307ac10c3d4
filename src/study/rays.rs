//! Rays to trace through a model, each a pure function of its index: a camera's, random ones through the box, and bounces.

use super::{Lift, Random};
use crate::intersect::{Cost, Intersector};
use crate::math::{Aabb, Point, Ray, Vector, orthonormal_pair};
use std::ops::Range;

/// A numbered family of rays.
pub trait RaySource: Sync {
    /// Returns how many rays there are.
    fn len(&self) -> u64;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Makes the rays of a range of indices, which must lie below `len`; always the same for the same index.
    fn rays(&self, range: Range<u64>) -> Vec<Ray>;
}

impl RaySource for [Ray] {
    fn len(&self) -> u64 {
        <[Ray]>::len(self) as u64
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        self[range.start as usize..range.end as usize].to_vec()
    }
}

impl RaySource for Vec<Ray> {
    fn len(&self) -> u64 {
        self.as_slice().len() as u64
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        self.as_slice().rays(range)
    }
}

/// Coherent rays: pixel by pixel from one eye that sees the whole bounding sphere.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    eye: Point,
    /// From the eye to a corner of the picture, and its two sides from there.
    corner: Vector,
    across: Vector,
    up: Vector,
    side: u64,
    count: u64,
}

impl Camera {
    /// Looks at a box (mm) from an odd direction, so that no axis of the model is favoured: the first `count` pixels of a square picture.
    pub fn new(bounds: &Aabb, count: u64) -> Self {
        // Some direction that is along no axis, diagonal or plane of symmetry.
        let view = Vector::new(0.48, -0.62, 0.39).normalize();
        let radius = (0.5 * bounds.diagonal()).max(f64::MIN_POSITIVE);
        let (across, up) = orthonormal_pair(view);
        let side = (count as f64).sqrt().ceil().max(1.0) as u64;
        let eye = bounds.center() + view * (3.0 * radius);
        // The tangent cone of the sphere seen from 3 radii has tangent 1/√8.
        let half = radius * 3.0 / 8f64.sqrt();
        let corner = bounds.center() - across * half - up * half - eye;
        Self { eye, corner, across: across * (2.0 * half), up: up * (2.0 * half), side, count }
    }
}

impl RaySource for Camera {
    fn len(&self) -> u64 {
        self.count
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        let pixel = |i: u64| {
            let at = |k: u64| (k as f64 + 0.5) / self.side as f64;
            let d = self.corner + self.across * at(i % self.side) + self.up * at(i / self.side);
            Ray::new(self.eye, d.normalize())
        };
        range.map(pixel).collect()
    }
}

/// Random rays: direction uniform, through a uniform point of the box grown by a fortieth of its diagonal, from outside the bounding
/// sphere.
#[derive(Clone, Copy, Debug)]
pub struct Uniform {
    bounds: Aabb,
    seed: u64,
    count: u64,
}

impl Uniform {
    /// Makes `count` rays through a box, mm.
    pub fn new(bounds: &Aabb, seed: u64, count: u64) -> Self {
        // Grown, so that some rays pass by: what is missed must be missed by all.
        let margin = 0.025 * bounds.diagonal();
        Self { bounds: bounds.grown(margin), seed, count }
    }

    /// Makes the ray of an index: through a point of the grown box, evenly spread, from outside.
    fn ray(&self, index: u64) -> Ray {
        let mut random = Random::new(self.seed, index);
        let size = self.bounds.size();
        let target = self.bounds.min + size * Vector::new(random.unit(), random.unit(), random.unit());
        let d = random.direction();
        // From outside of everything, wherever the point lies.
        Ray::new(target - d * (1.1 * self.bounds.diagonal()), d)
    }
}

impl RaySource for Uniform {
    fn len(&self) -> u64 {
        self.count
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        range.map(|i| self.ray(i)).collect()
    }
}

/// Rays of one path: the first comes from outside, the others from where the one before it hit.
pub const RAYS_PER_PATH: u64 = 8;

/// Incoherent rays: paths of up to eight rays that leave each hit in a random direction on the side they came from.
///
/// A ray starts above the surface, in free space, so that all intersectors get the very same query whatever they take for the
/// surface. A path that leaves the model begins anew.
#[derive(Clone, Copy)]
pub struct Bounces<'a> {
    first: Uniform,
    guide: &'a dyn Intersector,
    lift: Lift<'a>,
}

impl<'a> Bounces<'a> {
    /// Makes `count` rays through a box, mm; `guide` finds the points they leave, and `tolerance` is the loosest of the facets, mm.
    pub fn new(bounds: &Aabb, guide: &'a dyn Intersector, tolerance: f64, seed: u64, count: u64) -> Self {
        // Another stream than that of `Uniform` with this seed, whose rays may be traced beside these.
        Self {
            first: Uniform::new(bounds, seed ^ 0x9e6c_63d0_876a_9a47, count),
            guide,
            lift: Lift::new(guide, tolerance),
        }
    }

    /// Makes all eight rays of a path: each leaves the hit of the one before in a random direction on the side it came from, or begins
    /// anew.
    fn path_rays(&self, path: u64) -> Vec<Ray> {
        // Another stream than that of the first rays, which are keyed by the same numbers.
        let mut random = Random::new(self.first.seed ^ 0x5851_f42d_4c95_7f2d, path);
        let mut cost = Cost::default();
        let mut rays = Vec::with_capacity(RAYS_PER_PATH as usize);
        let mut ray = self.first.ray(path * RAYS_PER_PATH);
        for k in 1..=RAYS_PER_PATH {
            rays.push(ray);
            ray = match self.guide.intersect(&ray, &mut cost) {
                Some(hit) => {
                    let side = if hit.geometric_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
                    let n = hit.geometric_normal * side;
                    let left = Ray::new(ray.point_at(hit.t), n).with_departure(hit.departure());
                    Ray::new(self.lift.start(&left, n), random.hemisphere(n))
                }
                None => self.first.ray(path * RAYS_PER_PATH + k),
            };
        }
        rays
    }
}

impl RaySource for Bounces<'_> {
    fn len(&self) -> u64 {
        self.first.count
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        // Whole paths are made, because a ray follows from those before it; what was not asked for is dropped.
        let mut rays = Vec::with_capacity((range.end - range.start) as usize);
        let mut path = range.start / RAYS_PER_PATH;
        while path * RAYS_PER_PATH < range.end {
            let begin = path * RAYS_PER_PATH;
            let wanted = |k: usize| range.contains(&(begin + k as u64));
            rays.extend(self.path_rays(path).into_iter().enumerate().filter(|(k, _)| wanted(*k)).map(|(_, r)| r));
            path += 1;
        }
        rays
    }
}

/// Several families one after the other.
pub struct Chain<'a>(pub Vec<&'a dyn RaySource>);

impl RaySource for Chain<'_> {
    fn len(&self) -> u64 {
        self.0.iter().map(|s| s.len()).sum()
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        let (mut rays, mut begin) = (Vec::new(), 0);
        for source in &self.0 {
            let end = begin + source.len();
            let (a, b) = (range.start.clamp(begin, end), range.end.clamp(begin, end));
            if a < b {
                rays.extend(source.rays(a - begin..b - begin));
            }
            begin = end;
        }
        rays
    }
}

/// Makes a third each of a camera's, random and bouncing rays: coherent and incoherent ones find different faults. Of fewer than three rays
/// the camera's come first. `guide` finds the points that bounces leave; `tolerance` is the loosest of the facets, mm.
pub fn mixed_rays(bounds: &Aabb, guide: &dyn Intersector, tolerance: f64, seed: u64, count: u64) -> Vec<Ray> {
    let third = (count / 3).max(1);
    let camera = Camera::new(bounds, third.min(count));
    let uniform = Uniform::new(bounds, seed, third.min(count - camera.len()));
    let bounces = Bounces::new(bounds, guide, tolerance, seed, count - camera.len() - uniform.len());
    let chain = Chain(vec![&camera, &uniform, &bounces]);
    chain.rays(0..chain.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;

    #[test]
    fn rays_do_not_depend_on_the_range_they_are_asked_in() {
        let bounds = Aabb { min: Point::new(-1.0, -2.0, -3.0), max: Point::new(1.0, 2.0, 3.0) };
        let (camera, uniform) = (Camera::new(&bounds, 100), Uniform::new(&bounds, 3, 50));
        let chain = Chain(vec![&camera, &uniform]);
        let all = chain.rays(0..chain.len());
        assert_eq!(all.len(), 150);
        let pieces: Vec<Ray> = [0..7, 7..120, 120..150].into_iter().flat_map(|r| chain.rays(r)).collect();
        assert_eq!(all, pieces);
        assert!(all.iter().all(|r| (r.direction.length() - 1.0).abs() < 1e-15));
        assert!(all[100..].iter().all(|r| bounds.grown(0.2).clip(r).is_some()), "random rays pass through the box");
    }

    #[test]
    fn bounces_repeat_no_random_ray_of_the_same_seed() {
        let bounds = Aabb { min: Point::new(-1.0, -2.0, -3.0), max: Point::new(1.0, 2.0, 3.0) };
        let nothing = FacetMesh::default();
        let guide = Octree::build(&nothing, &octree::Settings::default());
        // No ray hits, so that each bounce begins anew.
        let bounces = Bounces::new(&bounds, &guide, 0.1, 3, 64).rays(0..64);
        let uniform = Uniform::new(&bounds, 3, 64).rays(0..64);
        assert!(bounces.iter().all(|ray| !uniform.contains(ray)));
    }
}

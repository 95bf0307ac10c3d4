//! A fair sample of a run's own rays, to be traced again by other intersectors.

use crate::intersect::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::{Point, Ray, Vector};
use crate::model::{Model, PlacedFace};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Rays noted over rays wanted: a fifth more, as some cannot be traced again.
const SPARE: f64 = 1.2;
/// Rays kept over rays wanted, where many more come than were expected, as in an integrating sphere.
const KEPT: usize = 4;

/// Passes every question on and notes some segments of paths: those whose hash is smallest, so that neither threads nor batches decide
/// which.
pub struct RayRecorder<'a> {
    inner: &'a dyn Intersector,
    /// Largest hash that is noted; falls where too many are.
    threshold: AtomicU64,
    /// Rays kept.
    most: usize,
    sample: Mutex<Vec<(u64, Ray)>>,
}

impl<'a> RayRecorder<'a> {
    /// Notes about `wanted` and a fifth more of `expected` rays, all where fewer come than are wanted, and at most four times as many as
    /// are wanted.
    pub fn new(inner: &'a dyn Intersector, wanted: u64, expected: u64) -> Self {
        let share = (SPARE * wanted as f64 / expected.max(1) as f64).min(1.0);
        // Hashes are even over 64 bits: their share below the threshold is the share of the rays noted.
        Self {
            inner,
            threshold: ((share * u64::MAX as f64) as u64).into(),
            most: KEPT * wanted.max(1) as usize,
            sample: Mutex::new(Vec::new()),
        }
    }

    /// Keeps the ray where its hash is among the chosen ones.
    fn note(&self, ray: &Ray) {
        let hash = hash(ray);
        if hash > self.threshold.load(Ordering::Relaxed) {
            return;
        }
        let mut sample = self.sample.lock().unwrap_or_else(|e| e.into_inner());
        sample.push((hash, *ray));
        // Twice as many, so that it happens seldom.
        if sample.len() >= 2 * self.most {
            let (_, largest_kept, _) = sample.select_nth_unstable_by_key(self.most - 1, |(hash, _)| *hash);
            self.threshold.store(largest_kept.0, Ordering::Relaxed);
            sample.truncate(self.most);
        }
    }

    /// Returns at most `wanted` of the noted rays, in an order that depends on the rays alone. A ray that left a surface starts above it,
    /// in free space, so that all intersectors get the same query whatever they take for the surface: where `start` says of the
    /// ray and the unit normal to the side that it goes to. One that left a ready mesh, which has no surface, is left out.
    pub fn rays(self, wanted: usize, model: &Model, start: impl Fn(&Ray, Vector) -> Point) -> Vec<Ray> {
        let faces: Vec<PlacedFace> = model.placed_faces().collect();
        let mut noted = self.sample.into_inner().unwrap_or_else(|e| e.into_inner());
        // By the hash: an order that no thread and no batch decides, and that mixes sources and bounces.
        noted.sort_by_key(|(hash, _)| *hash);
        // What is kept beyond these depends on when the threshold fell.
        noted.truncate(self.most);
        noted.into_iter().filter_map(|(_, ray)| lift_off(ray, &faces, &start)).take(wanted).collect()
    }
}

/// Moves the start of a ray above the surface that it left, to where `start` says; unchanged where it left none, `None` where that has no
/// surface or no normal there.
fn lift_off(ray: Ray, faces: &[PlacedFace], start: &impl Fn(&Ray, Vector) -> Point) -> Option<Ray> {
    let Some(departure) = ray.departure else { return Some(ray) };
    let placed = faces.get(departure.face.index())?;
    let normal = placed.placement.normal(placed.face?.surface.normal(departure.uv)?);
    // To the side on which it goes on.
    let up = normal * 1f64.copysign(normal.dot(ray.direction));
    Some(Ray::new(start(&ray, up), ray.direction))
}

/// Mixes the bits of origin and direction (the finaliser of SplitMix64, Steele et al. 2014).
fn hash(ray: &Ray) -> u64 {
    // By the bits: two rays that differ at all are two.
    let mix = |p: Point, h: u64| p.to_array().into_iter().fold(h, |h, x| h.rotate_left(17) ^ x.to_bits());
    let mut z = mix(ray.direction, mix(ray.origin, 0x9e37_79b9_7f4a_7c15)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Intersector for RayRecorder<'_> {
    /// Single queries are no segments of a path: they find what sources lie in, or the face that a ray starts from.
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.inner.intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        rays.iter().for_each(|r| self.note(r));
        self.inner.intersect_batch(rays, hits, cost);
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        self.inner.prepare_for(expected);
    }

    /// A ray that escapes gets no further query: it is noted here.
    fn escapes(&self, ray: &Ray) -> bool {
        // Queried first: the recorder must not change the queries that the intersector gets.
        let escapes = self.inner.escapes(ray);
        if escapes {
            self.note(ray);
        }
        escapes
    }

    fn footprint(&self) -> Footprint {
        self.inner.footprint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;
    impl Intersector for Nothing {
        fn intersect(&self, _: &Ray, _: &mut Cost) -> Option<Hit> {
            None
        }
        fn footprint(&self) -> Footprint {
            Footprint::default()
        }
    }

    #[test]
    fn the_sample_does_not_depend_on_the_order_of_questions() {
        let rays: Vec<Ray> =
            (0..20_000).map(|k| Ray::new(Point::splat(f64::from(k)), Vector::new(0.6, 0.0, 0.8))).collect();
        let sample = |rays: &[Ray], expected: u64| {
            let recorder = RayRecorder::new(&Nothing, 500, expected);
            recorder.intersect_batch(rays, &mut vec![None; rays.len()], &mut Cost::default());
            recorder.rays(500, &Model::default(), |ray, up| ray.origin + 0.1 * up)
        };
        let back: Vec<Ray> = rays.iter().rev().copied().collect();
        let (forward, backward) = (sample(&rays, 20_000), sample(&back, 20_000));
        assert_eq!(forward.len(), 500);
        assert_eq!(forward, backward);
        // Of forty times as many rays as were expected the same are taken, and few are kept.
        assert_eq!(sample(&rays, 500), forward);
        assert_eq!(sample(&back, 500), forward);
        let recorder = RayRecorder::new(&Nothing, 500, 500);
        recorder.intersect_batch(&rays, &mut vec![None; rays.len()], &mut Cost::default());
        assert!(recorder.sample.into_inner().unwrap().len() < 2 * KEPT * 500);
        let mean = forward.iter().map(|r| r.origin.x).sum::<f64>() / 500.0;
        // The mean of 500 uniform draws from 0..20,000 has a standard error of 258.
        assert!((mean - 10_000.0).abs() < 1300.0, "{mean}");
    }
}

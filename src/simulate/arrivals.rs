//! The rays that recorded paths brought to a receiver.

use super::bind::BoundScene;
use super::emitter::{Portion, RaySampler};
use super::kernel::in_front;
use super::outcome::{Event, PathVertex};
use super::plan::Plan;
use super::receiver::Receiver;
use super::results::Results;
use super::settings::RunSettings;
use crate::formats::LightRay;
use crate::math::{Point, Ray, Vector};

/// Returns one ray for each time a recorded path crossed a plane, disc or sphere that counts it: the point (mm, scene coordinates), the
/// direction, and a power scaled so that the sum over all recorded paths is what the run emitted: an estimate of what the receiver counted.
/// Of a receiver that lets light pass the sum is what it counted.
///
/// In a run of several wavelengths each ray has its own, in a run of one none. `settings` are those of the run. Empty for a number without
/// a receiver, a far field or faces, and for results without recorded paths.
pub fn arrivals(bound: &BoundScene, settings: &RunSettings, receiver: usize, results: &Results) -> Vec<LightRay> {
    let plan = Plan::new(bound, settings);
    let Some((receiver, counted)) = bound.receivers.get(receiver).zip(results.receivers.get(receiver)) else {
        return Vec::new();
    };
    let emitted: f64 = results.paths.iter().filter(|v| v.event == Event::Emitted).map(|v| v.power).sum();
    // The sample stands for all: what its paths emitted, scaled to what the run did.
    let share = results.power.emitted / emitted.max(f64::MIN_POSITIVE);
    let mut rays = Vec::new();
    for path in results.paths.chunk_by(|a, b| (a.ray, a.branch) == (b.ray, b.branch)) {
        let crossings = crossings(receiver, path);
        if crossings.is_empty() {
            continue;
        }
        // On its way light keeps the wavelength that its source gave it.
        let wavelength_nm = wavelength(bound, settings, &plan, path[0].ray);
        rays.extend(crossings.iter().map(|crossing| {
            let [a, b] = crossing.segment;
            // A receiver that lets light pass counts what the medium leaves up to it, before the next face takes its part.
            let arriving =
                if receiver.absorbs { b.power } else { a.power * crossing.transmittance(bound, wavelength_nm) };
            let (origin, direction) = (crossing.point(), crossing.ray.direction);
            LightRay { origin, direction, power: arriving * share, wavelength_nm }
        }));
    }
    // Of a sample of the paths the sum is by chance another one: that of the receiver is known.
    let sum: f64 = rays.iter().map(|ray| ray.power).sum();
    if !receiver.absorbs && sum > 0.0 {
        rays.iter_mut().for_each(|ray| ray.power *= counted.power / sum);
    }
    rays
}

/// Where a recorded path crosses a receiver.
pub(super) struct Crossing<'p> {
    /// Place in the path of the vertex before it.
    pub(super) first: usize,
    /// The vertices before it and after it.
    pub(super) segment: [&'p PathVertex; 2],
    /// The way from the one to the other.
    ray: Ray,
    /// Distance from the vertex before, mm.
    distance: f64,
}

impl Crossing<'_> {
    /// Where it is, mm.
    pub(super) fn point(&self) -> Point {
        self.ray.point_at(self.distance)
    }

    /// Returns the share of the light from the vertex before that the medium leaves of it here, at `wavelength`, nm, or, for `None`, at
    /// that of the scene (Beer's law).
    fn transmittance(&self, bound: &BoundScene, wavelength: Option<f64>) -> f64 {
        // A vertex names the body that light came to it through.
        let body = bound.bodies.get(self.segment[1].body as usize);
        let absorption = body.map_or(0.0, |body| body.absorption(wavelength));
        // Where nothing absorbs the way may be endless.
        if absorption > 0.0 { (-absorption * self.distance).exp() } else { 1.0 }
    }
}

/// Returns the crossings of a recorded path with a plane, disc or sphere that counts them; none for any other receiver.
pub(super) fn crossings<'p>(receiver: &Receiver, path: &'p [PathVertex]) -> Vec<Crossing<'p>> {
    let mut found = Vec::new();
    for (first, pair) in path.windows(2).enumerate() {
        let segment @ [a, b] = [&pair[0], &pair[1]];
        // Vertices may coincide, as where a path splits.
        let Some(direction) = (b.point - a.point).try_normalize() else { continue };
        // The filters of the receiver itself: bounces that it counts, and, where it ends light, segments that end on it.
        if receiver.interactions.is_some_and(|n| n != b.bounce) || receiver.absorbs && b.event != Event::Received {
            continue;
        }
        let ray = Ray::new(a.point, direction);
        let [mut after, end] = counted_range(&ray, a, b, receiver.absorbs);
        // A sphere may be crossed twice by one segment.
        while let Some(distance) = receiver.crossing(&ray, after, end) {
            found.push(Crossing { first, segment, ray, distance });
            after = distance;
        }
    }
    found
}

/// Returns the wavelength of a ray, nm, drawn again as its source did; `None` in a run of one wavelength, or for a ray that it does not
/// have.
fn wavelength(bound: &BoundScene, settings: &RunSettings, plan: &Plan, ray: u64) -> Option<f64> {
    let (source, replicate) = plan.locate(ray).filter(|_| bound.light.coloured)?;
    let emitter = &bound.emitters[source];
    let [first, last] = plan.range(source, replicate);
    let lattice = plan.lattice(replicate);
    let portion = Portion { replicate, source: source as u32, rays: last - first, lattice };
    let mut sampler = RaySampler::new(emitter, settings.seed, settings.sampling, portion, first);
    // Its start does not matter.
    let mut start = Ray::new(Point::ZERO, Vector::Z);
    sampler.single_ray(emitter, (ray - first) as u32, &mut start).1.wavelength
}

/// Returns between which distances from `a`, mm, a recorded segment to `b` meets a receiver as the kernel has it: one that lies in a face
/// is in front of it, and light that it ends is recorded as much before it.
fn counted_range(ray: &Ray, a: &PathVertex, b: &PathVertex, absorbs: bool) -> [f64; 2] {
    let length = (b.point - a.point).length();
    let end = match b.event {
        Event::Escaped => f64::INFINITY,
        // Twice, because the way back is rounded too.
        Event::Received => length + 2.0 * in_front(ray, length),
        _ => length + in_front(ray, length),
    };
    [if absorbs { 0.0 } else { in_front(ray, 0.0) }, end]
}

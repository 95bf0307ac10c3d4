//! Rays as they leave their sources, source by source.

use super::contact::emit_into_contact;
use super::context::{Context, StartingMedia};
use super::media_at::media_at;
use super::path::{Path, RaySelection};
use super::payload::RayPayload;
use super::receivers::clip_segment;
use super::start::start_on_face;
use super::starting_media::{start_behind_glue, start_clear_of_faces};
use super::stated_start::start_in_stated_media;
use super::tracer::Tracer;
use crate::intersect::prefetch;
use crate::math::Ray;
use crate::optics::polarised::Stokes;
use crate::simulate::emitter::{Emission, MixedPacket, MixedRay, Portion, RaySampler};
use crate::simulate::outcome::{Event, LostCause};
use crate::simulate::scene::Sampling;
use crate::simulate::tally::quanta_as_integer;

/// Sources before its turn at which one is asked for, where each has few rays: half a kilobyte each, they fill more than a second cache.
const AHEAD: usize = 8;

/// Goes through the rays of one replicate, source by source.
pub(super) struct SourceQueue {
    replicate: u32,
    source: usize,
    /// Number in the run of the next ray, and of the first and past the last of this source in this replicate.
    next: u64,
    range: [u64; 2],
    /// Quanta of each ray of this source in this replicate.
    quanta: f64,
    sampler: Option<RaySampler>,
    /// The rays that start next, where many sources have few in this replicate.
    mixed: Option<Box<MixedPacket>>,
    /// Whether the rays of the present source belong there.
    mixes: bool,
    /// The source at which the queue ends: one past the last, or 0 for rays asked for by their numbers, after which no source follows.
    last: usize,
    /// Whether rays are asked for by their numbers.
    single: bool,
    /// Number of the next of several such rays, how far apart they are, and how many are left.
    spread: [u64; 3],
    /// The ray of a list that is asked for.
    listed: Option<u64>,
}

impl SourceQueue {
    /// Makes the queue of a replicate, of rays that are traced again, or of one ray of a source's list; rays that the run does not have are
    /// passed over.
    pub(super) fn new(context: &Context<'_>, rays: RaySelection) -> Self {
        let last = context.plan.shares.len();
        let single = !matches!(rays, RaySelection::Replicate(_));
        let (range, quanta, sampler, listed) = ([0, 0], 0.0, None, None);
        let (mixed, mixes, spread) = (None, false, [0; 3]);
        let mut queue = Self {
            replicate: 0,
            source: 0,
            next: 0,
            range,
            quanta,
            sampler,
            mixed,
            mixes,
            last,
            single,
            spread,
            listed,
        };
        match rays {
            RaySelection::Replicate(replicate) => {
                queue.replicate = replicate;
                queue.enter_source(context, 0);
            }
            RaySelection::Ray(ray) => {
                queue.last = 0;
                queue.seek(context, ray);
            }
            RaySelection::Spread { first, step, count } => (queue.last, queue.spread) = (0, [first, step, count]),
            RaySelection::Listed { source, ray } => {
                (queue.last, queue.source, queue.listed) = (0, source as usize, Some(ray));
                // Independent numbers: by its place in the list a ray has no place in a net.
                let portion = Portion { replicate: 0, source, rays: 1, lattice: [0, 1] };
                if let Some(emitter) = context.bound.emitters.get(source as usize) {
                    let seed = context.settings.seed;
                    queue.sampler = Some(RaySampler::new(emitter, seed, Sampling::Random, portion, ray));
                    (queue.range, queue.quanta) = ([0, 1], context.plan.quanta(source as usize, 1));
                }
            }
        }
        queue
    }

    /// Turns to one ray of the run; leaves the queue at its end where the run does not have it.
    fn seek(&mut self, context: &Context<'_>, ray: u64) {
        if let Some((source, replicate)) = context.plan.locate(ray) {
            self.replicate = replicate;
            self.enter_source(context, source);
            // It is alone: the range is cut to its one index.
            (self.next, self.range[1]) = (ray, ray + 1);
        }
    }

    /// Turns to the next of the rays that are asked for by their numbers; `false` where none is left. After `true` the queue may still be
    /// at its end: the run may not have that ray.
    #[cold]
    fn seek_next(&mut self, context: &Context<'_>) -> bool {
        let [ray, step, left] = self.spread;
        if left == 0 {
            return false;
        }
        self.spread = [ray + step, step, left - 1];
        self.seek(context, ray);
        true
    }

    /// Turns to the rays of a source in this replicate, from the first on, and makes or restarts the sampler, unless they are to be mixed
    /// with those of other sources; past the last source only notes that it is there, which ends the queue.
    #[inline(always)]
    fn enter_source(&mut self, context: &Context<'_>, source: usize) {
        self.source = source;
        let Some(emitter) = context.bound.emitters.get(source) else { return };
        self.range = context.plan.range(source, self.replicate);
        self.next = self.range[0];
        let portion = self.portion(context);
        self.quanta = context.plan.quanta(source, portion.rays);
        self.mixes = !self.single && MixedPacket::takes(emitter, context.settings.sampling, portion.rays);
        if !self.mixes {
            self.make_sampler(context, portion);
        }
    }

    /// Returns the rays of the present source in this replicate.
    #[inline(always)]
    fn portion(&self, context: &Context<'_>) -> Portion {
        Portion {
            replicate: self.replicate,
            source: self.source as u32,
            rays: self.range[1] - self.range[0],
            lattice: context.plan.lattice(self.replicate),
        }
    }

    /// Fills the mixed packet with rays of the present source and of those after it that belong there.
    #[inline(never)]
    fn mix(&mut self, context: &Context<'_>) {
        let mut mixed = self.mixed.take().unwrap_or_else(|| MixedPacket::boxed(context.settings.seed));
        mixed.clear();
        while self.mixes && !mixed.is_full() && self.source < self.last {
            let emitter = &context.bound.emitters[self.source];
            // Its rays start out of turn, so that no pattern lets the processor prefetch.
            prefetch(&context.bound.emitters, self.source + AHEAD);
            mixed.add(emitter, self.portion(context), (self.range[0], self.quanta), &mut self.next);
            if self.next >= self.range[1] {
                self.enter_source(context, self.source + 1);
            }
        }
        mixed.draw(self.replicate);
        self.mixed = Some(mixed);
    }

    /// Makes or restarts the sampler of the present source.
    fn make_sampler(&mut self, context: &Context<'_>, portion: Portion) {
        let emitter = &context.bound.emitters[self.source];
        match &mut self.sampler {
            Some(sampler) => sampler.restart(emitter, portion, self.range[0]),
            None => {
                let s = context.settings;
                self.sampler = Some(RaySampler::new(emitter, s.seed, s.sampling, portion, self.range[0]));
            }
        }
    }

    /// Writes the next ray that can start to `path` and `ray`; `false` at the end of the queue, of a replicate or of the rays asked for:
    /// both then hold what was tried last. Rays that cannot start are booked as lost and passed over.
    #[inline(always)]
    pub(super) fn start_next<C: RayPayload>(
        &mut self,
        tracer: &mut Tracer<'_, '_, C>,
        path: &mut Path<C>,
        ray: &mut Ray,
    ) -> bool {
        let context = tracer.context;
        loop {
            if let Some(mixed) = &mut self.mixed
                && let Some(MixedRay { source, index, quanta, emission }) =
                    mixed.next_ray(&context.bound.emitters, ray)
            {
                *path = Path::at_source(index, quanta, C::in_surroundings());
                if tracer.start_path(source, &emission, path, ray) {
                    return true;
                }
                continue;
            }
            // A source may have no ray in this replicate.
            while self.next >= self.range[1] {
                if self.source < self.last {
                    self.enter_source(context, self.source + 1);
                } else if !self.seek_next(context) {
                    return false;
                }
            }
            if self.mixes {
                self.mix(context);
                continue;
            }
            let Some(sampler) = &mut self.sampler else { return false };
            let emitter = &context.bound.emitters[self.source];
            let started = (self.next - self.range[0]) as u32;
            self.next += 1;
            // A single ray draws its numbers alone; in order they are drawn in packets. Both give the same bits.
            let (index, emission) = if let Some(listed) = self.listed {
                sampler.listed_ray(emitter, listed, ray)
            } else if self.single {
                sampler.single_ray(emitter, started, ray)
            } else {
                sampler.next_ray(emitter, started, ray)
            };
            *path = Path::at_source(index, self.quanta, C::in_surroundings());
            if tracer.start_path(self.source, &emission, path, ray) {
                return true;
            }
        }
    }
}

impl<C: RayPayload> Tracer<'_, '_, C> {
    /// Puts a ray that leaves its source on its way: finds its face and media, books it as emitted and clips its first segment. `false`
    /// when it is in more bodies than it can carry, or could not be read; it is then booked as lost.
    #[inline(always)]
    fn start_path(&mut self, source: usize, emission: &Emission, path: &mut Path<C>, ray: &mut Ray) -> bool {
        let context = self.context;
        let mut into_contact = None;
        // Luminous faces emit from the spline; the ray starts from the intersector's own idea of that face.
        if let Some((face, normal)) = emission.from {
            start_on_face(context, face, normal, ray, &mut self.tally.counts);
            // Light into what is glued on the face starts behind the glue; only then is it known to lie in that
            // body.
            into_contact = if C::MEDIA { emit_into_contact(context, face, normal, ray) } else { None };
        }
        // Booked before anything can go wrong, so that a ray which cannot start is in both sums, emitted and lost.
        self.tally.counts.rays += 1;
        self.tally.ends.emitted += quanta_as_integer(path.quanta);
        if emission.failed {
            self.lose(path, ray, LostCause::Unreadable, None);
            return false;
        }
        let Some(mut payload) = self.payload_at_start(source, into_contact.as_ref(), ray) else {
            self.lose(path, ray, LostCause::TooDeep, None);
            return false;
        };
        // In closures and behind a constant: kernels without colour or polarisation carry no trace of it.
        if C::COLOURED {
            payload.set_light(emission.wavelength, || match context.bound.emitters[source].polarised {
                Some(field) => Stokes::linear(1.0, ray.direction, field),
                None => Stokes::unpolarised(1.0, ray.direction),
            });
        }
        path.payload = payload;
        self.record(path, ray.origin, Event::Emitted, None);
        clip_segment(context, path, ray);
        true
    }

    /// Returns the payload of a ray with the media that it starts in; `None` when it cannot carry so many. Moves the start of a ray of a
    /// source that lies on a face of a solid clear of it, and counts those that pass a face by that.
    #[inline(always)]
    fn payload_at_start(&mut self, source: usize, into_contact: Option<&Ray>, ray: &mut Ray) -> Option<C> {
        let context = self.context;
        match &context.starting_media[source] {
            StartingMedia::Same(bodies) => C::inside(bodies),
            StartingMedia::OnFace => {
                let start = start_clear_of_faces(context, ray);
                let emitter = &context.bound.emitters[source];
                let asks_geometry = C::MEDIA && !emitter.media_stated;
                if asks_geometry && let Some(face) = start.as_ref().and_then(|start| start.passed_face) {
                    self.tally.counts.add_flush_starts([source as u32, face.0], 1);
                }
                // Through an edge or a corner a ray may pass without a hit.
                *ray = start.map_or_else(|| start_behind_glue(context, ray), |start| start.ray);
                if asks_geometry { C::inside(&media_at(context, ray)) } else { C::inside(&emitter.inside) }
            }
            StartingMedia::Stated => {
                let inside = &context.bound.emitters[source].inside;
                *ray = start_in_stated_media(context, inside, ray);
                C::inside(inside)
            }
            StartingMedia::InSolid => {
                *ray = start_behind_glue(context, ray);
                C::inside(&[])
            }
            // Light that is emitted into a touching body starts behind the contact: its media are those there.
            StartingMedia::PerRay if C::MEDIA => C::inside(&media_at(context, into_contact.unwrap_or(ray))),
            StartingMedia::PerRay => Some(C::in_surroundings()),
        }
    }
}

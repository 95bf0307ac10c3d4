//! The path kernel: wavefronts of rays through an intersector, one `match` on the surface at each hit.
//!
//! A replicate is traced in batches that are topped up with new rays as paths end, so that the intersector always has many
//! rays to interleave. What a ray carries is a type parameter ([`Carry`]): a scene without media does not pay for
//! them. Everything else is arithmetic behind the `match`.

mod carry;
mod local;
mod step;
mod surface;

pub(crate) use carry::{Carry, Coloured, Everything, Nothing, OneBody, Stack};
pub(crate) use local::Local;
pub use local::{Cause, Counts, Event, LostRay, PathVertex, Tallies};

use super::bind::BoundScene;
use super::emitter::{Stream, Ticket};
use super::run::{Plan, RunSettings};
use crate::intersect::{Cost, Hit, Intersector};
use crate::math::{Departure, FaceId, Ray, Vector};
use crate::optics::polarised::Stokes;

/// What all replicates share.
pub(crate) struct Context<'a> {
    pub(crate) bound: &'a BoundScene,
    pub(crate) intersector: &'a dyn Intersector,
    pub(crate) settings: &'a RunSettings,
    pub(crate) plan: Plan,
    /// Receivers that stand in space and end light.
    pub(crate) blocking: Vec<u32>,
    /// Receivers that count light passing through.
    pub(crate) passing: Vec<u32>,
    pub(crate) far: Vec<u32>,
}

/// A path under way; its ray is kept apart, in the slice that the intersector reads.
#[derive(Clone, Copy)]
pub(crate) struct Path<C> {
    pub(crate) ray: u64,
    pub(crate) branch: u32,
    pub(crate) bounce: u32,
    /// Power, a whole number of quanta.
    pub(crate) quanta: f64,
    /// Power at the source.
    pub(crate) first: f64,
    /// mm so far.
    pub(crate) length: f64,
    /// The receiver that ends the segment unless a face comes first; `u32::MAX` for none.
    pub(crate) receiver: u32,
    pub(crate) carry: C,
}

/// No receiver ahead.
pub(crate) const NO_RECEIVER: u32 = u32::MAX;
/// The ray scatters inside its body at the end of its segment.
pub(crate) const SCATTERS: u32 = u32::MAX - 1;

impl Context<'_> {
    /// Whether the polarisation of rays is followed.
    #[inline]
    pub(crate) fn polarised(&self) -> bool {
        self.bound.scene.run.polarisation
    }
}

/// Traces the rays of one replicate and adds them to `local`. Returns the intersector's work.
pub(crate) fn trace<C: Carry>(context: &Context<'_>, replicate: u32, local: &mut Local) -> Cost {
    let batch = context.settings.batch.max(1);
    let mut cost = Cost::default();
    let mut wave = Wave::<C>::with_capacity(batch);
    let mut sources = Sources::new(context, replicate);
    loop {
        while wave.paths.len() < batch {
            match wave.pending.pop() {
                Some((path, ray)) => wave.push(path, ray),
                None => match sources.next(context) {
                    Some(start) => wave.start(context, start, local),
                    None => break,
                },
            }
        }
        if wave.paths.is_empty() {
            return cost;
        }
        wave.hits.clear();
        wave.hits.resize(wave.rays.len(), None);
        context.intersector.intersect_batch(&wave.rays, &mut wave.hits, &mut cost);
        local.counts.segments += wave.rays.len() as u64;
        let mut kept = 0;
        for i in 0..wave.paths.len() {
            let (mut path, mut ray) = (wave.paths[i], wave.rays[i]);
            if step::step(context, &mut path, &mut ray, wave.hits[i].as_ref(), local, &mut wave.pending) {
                wave.paths[kept] = path;
                wave.rays[kept] = ray;
                kept += 1;
            }
        }
        wave.paths.truncate(kept);
        wave.rays.truncate(kept);
    }
}

/// Rays under way in one batch.
struct Wave<C> {
    paths: Vec<Path<C>>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Paths that split off and wait for room.
    pending: Vec<(Path<C>, Ray)>,
}

impl<C: Carry> Wave<C> {
    fn with_capacity(batch: usize) -> Self {
        let (paths, rays, hits) = (Vec::with_capacity(batch), Vec::with_capacity(batch), Vec::with_capacity(batch));
        Self { paths, rays, hits, pending: Vec::new() }
    }

    fn push(&mut self, path: Path<C>, ray: Ray) {
        self.paths.push(path);
        self.rays.push(ray);
    }

    #[inline]
    fn start(&mut self, context: &Context<'_>, start: Start, local: &mut Local) {
        let emitter = &context.bound.emitters[start.source];
        let emission = emitter.emit(&start.stream, start.ticket);
        let mut ray = emission.ray;
        if let Some((face, normal)) = emission.from {
            settle(context, face, normal, &mut ray);
        }
        local.counts.rays += 1;
        local.ends.emitted += start.quanta as u64;
        let Some(mut carry) = C::inside(&emitter.inside) else {
            return local.lose(LostRay {
                ray: start.ticket.ray,
                branch: 0,
                bounce: 0,
                cause: Cause::TooDeep,
                quanta: start.quanta as u64,
                origin: ray.origin,
                direction: ray.direction,
                face: None,
            });
        };
        if C::COLOURED {
            carry.light(emission.wavelength, || match emitter.polarised {
                Some(field) => Stokes::linear(1.0, ray.direction, field),
                None => Stokes::unpolarised(1.0, ray.direction),
            });
        }
        let mut path = Path {
            ray: start.ticket.ray,
            branch: 0,
            bounce: 0,
            quanta: start.quanta,
            first: start.quanta,
            length: 0.0,
            receiver: NO_RECEIVER,
            carry,
        };
        step::record(context, &path, ray.origin, Event::Emitted, local);
        step::aim(context, &mut path, &mut ray);
        self.push(path, ray);
    }
}

/// A ray about to start.
struct Start {
    source: usize,
    ticket: Ticket,
    quanta: f64,
    stream: Stream,
}

/// Goes through the rays of one replicate, source by source.
struct Sources {
    replicate: u32,
    source: usize,
    next: u64,
    range: [u64; 2],
    stream: Option<Stream>,
}

impl Sources {
    fn new(context: &Context<'_>, replicate: u32) -> Self {
        let mut sources = Self { replicate, source: 0, next: 0, range: [0, 0], stream: None };
        sources.enter(context, 0);
        sources
    }

    fn enter(&mut self, context: &Context<'_>, source: usize) {
        self.source = source;
        let Some(share) = context.plan.shares.get(source) else { return };
        self.range = share.range(self.replicate, context.plan.replicates);
        self.next = self.range[0];
        let s = context.settings;
        let which = [self.replicate, context.plan.replicates];
        let rays = self.range[1] - self.range[0];
        self.stream = Some(Stream::new(s.seed, s.sampling, which, source as u32, rays));
    }

    #[inline]
    fn next(&mut self, context: &Context<'_>) -> Option<Start> {
        while self.next >= self.range[1] {
            if self.source >= context.plan.shares.len() {
                return None;
            }
            self.enter(context, self.source + 1);
        }
        let ray = self.next;
        self.next += 1;
        let ticket = Ticket { ray, index: (ray - self.range[0]) as u32 };
        let quanta = context.plan.shares[self.source].quanta;
        Some(Start { source: self.source, ticket, quanta, stream: self.stream? })
    }
}

/// Moves the start of a ray from the spline of a face to where the intersector has that face, and marks it as leaving it.
///
/// Facets lie up to their sag off the spline: a ray that started there could hit its own facet. Looked for within 1 mm, less
/// where another face is in between; a ray whose face is not found starts on the spline.
fn settle(context: &Context<'_>, face: FaceId, normal: Vector, ray: &mut Ray) {
    for reach in [1.0, 0.1, 0.01, 1e-3] {
        let probe = Ray::new(ray.origin + normal * reach, -normal).within(0.0, 2.0 * reach);
        let Some(hit) = context.intersector.intersect(&probe, &mut Cost::default()) else { continue };
        if hit.face == face {
            let from = Departure { face, primitive: hit.primitive, uv: hit.uv };
            *ray = Ray::new(probe.at(hit.t), ray.direction).leaving(from);
            return;
        }
    }
}

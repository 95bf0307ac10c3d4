//! The path kernel: wavefronts of rays through an intersector, one `match` on the surface at each hit.
//!
//! A replicate is traced in batches that are topped up with new rays as paths end, so that the intersector always has many
//! rays to interleave. What a ray carries is a type parameter ([`Carry`]): a scene without media does not pay for
//! them. Everything else is arithmetic behind the `match`.

mod around;
mod carry;
mod local;
mod step;
mod surface;
mod wide;

pub(crate) use around::{Around, sources as around_sources};
pub(crate) use carry::{Carry, Coloured, Everything, Nothing, OneBody, Stack};
pub(crate) use local::Local;
pub use local::{Cause, Counts, Event, LostRay, PathSink, PathVertex, Tallies};
pub(crate) use wide::trace;

use super::bind::BoundScene;
use super::emitter::{Stream, Ticket};
use super::run::{Plan, RunSettings};
use super::tally::count;
use crate::intersect::{Cost, Hit, Intersector};
use crate::math::{Aabb, Departure, FaceId, Ray, Vector};
use crate::optics::polarised::Stokes;
use crate::optics::reflect;

/// What all replicates share.
pub(crate) struct Context<'a> {
    pub(crate) bound: &'a BoundScene,
    pub(crate) intersector: &'a dyn Intersector,
    pub(crate) settings: &'a RunSettings,
    pub(crate) plan: Plan,
    /// Receivers that stand among the faces and end light.
    pub(crate) blocking: Vec<u32>,
    /// Receivers that end light and do not meet `region`.
    pub(crate) outside: Vec<u32>,
    /// A box around all faces and sources; only how fast a path is followed depends on it.
    pub(crate) region: Aabb,
    /// Receivers that count light passing through.
    pub(crate) passing: Vec<u32>,
    pub(crate) far: Vec<u32>,
    /// What the rays of each source start in.
    pub(crate) around: Vec<Around>,
    /// Takes the vertices of all paths as they come; without, a sample is kept.
    pub(crate) paths: Option<PathSink<'a>>,
}

/// Which rays to trace.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Which {
    /// All rays of a replicate.
    Replicate(u32),
    /// One ray of the run.
    Ray(u64),
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

/// Traces these rays and adds them to `local`. Returns the intersector's work.
#[inline(always)]
fn trace_rays<C: Carry>(context: &Context<'_>, which: Which, local: &mut Local) -> Cost {
    let batch = context.settings.batch.max(1);
    let mut cost = Cost::default();
    let mut wave = Wave::<C>::with_capacity(batch);
    let mut sources = Sources::new(context, which);
    while wave.paths.len() < batch
        && let Some((path, ray)) = sources.begin(context, local)
    {
        wave.paths.push(path);
        wave.rays.push(ray);
    }
    wave.hits.resize(wave.rays.len(), None);
    while !wave.paths.is_empty() {
        let n = wave.rays.len();
        context.intersector.intersect_batch(&wave.rays, &mut wave.hits[..n], &mut cost);
        local.counts.segments += n as u64;
        let mut i = 0;
        while i < wave.paths.len() {
            let (path, ray) = (&mut wave.paths[i], &mut wave.rays[i]);
            if !step::step(context, path, ray, wave.hits[i].as_ref(), local, &mut wave.pending) {
                // A path that ends leaves its place to another.
                match wave.pending.pop().or_else(|| sources.begin(context, local)) {
                    Some(next) => (*path, *ray) = next,
                    None => {
                        wave.drop(i);
                        continue;
                    }
                }
            }
            i += 1;
        }
        while wave.paths.len() < batch
            && let Some((path, ray)) = wave.pending.pop()
        {
            wave.paths.push(path);
            wave.rays.push(ray);
        }
        if wave.hits.len() < wave.rays.len() {
            wave.hits.resize(wave.rays.len(), None);
        }
        if local.paths.len() >= STREAMED {
            local.stream(context);
        }
    }
    cost
}

/// Vertices that are gathered before they are streamed: 1.3 MB.
const STREAMED: usize = 1 << 14;

/// Rays under way in one batch.
struct Wave<C> {
    paths: Vec<Path<C>>,
    rays: Vec<Ray>,
    /// As long as `rays` or longer.
    hits: Vec<Option<Hit>>,
    /// Paths that split off and wait for room.
    pending: Vec<(Path<C>, Ray)>,
}

impl<C: Carry> Wave<C> {
    fn with_capacity(batch: usize) -> Self {
        let (paths, rays, hits) = (Vec::with_capacity(batch), Vec::with_capacity(batch), Vec::with_capacity(batch));
        Self { paths, rays, hits, pending: Vec::new() }
    }

    /// Takes out a path that has ended; the last one of the wave, with the hit it has not been through yet, takes its place.
    fn drop(&mut self, i: usize) {
        self.hits.swap(i, self.paths.len() - 1);
        self.paths.swap_remove(i);
        self.rays.swap_remove(i);
    }
}

/// Goes through the rays of one replicate, source by source.
struct Sources {
    replicate: u32,
    source: usize,
    next: u64,
    range: [u64; 2],
    stream: Option<Stream>,
    /// Number of sources to go through.
    last: usize,
}

impl Sources {
    fn new(context: &Context<'_>, which: Which) -> Self {
        let last = context.plan.shares.len();
        let mut sources = Self { replicate: 0, source: 0, next: 0, range: [0, 0], stream: None, last };
        match which {
            Which::Replicate(replicate) => {
                sources.replicate = replicate;
                sources.enter(context, 0);
            }
            Which::Ray(ray) => {
                let place = context.plan.place(ray);
                sources.last = 0;
                if let Some((source, replicate)) = place {
                    sources.replicate = replicate;
                    sources.enter(context, source);
                    (sources.next, sources.range[1]) = (ray, ray + 1);
                }
            }
        }
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
        let pairs = context.bound.emitters[source].pairs();
        self.stream = Some(Stream::new(s.seed, s.sampling, which, source as u32, rays, pairs));
    }

    /// Starts the next ray that can start; `None` at the end of the replicate.
    #[inline]
    fn begin<C: Carry>(&mut self, context: &Context<'_>, local: &mut Local) -> Option<(Path<C>, Ray)> {
        loop {
            while self.next >= self.range[1] {
                if self.source >= self.last {
                    return None;
                }
                self.enter(context, self.source + 1);
            }
            let ray = self.next;
            self.next += 1;
            let ticket = Ticket { ray, index: (ray - self.range[0]) as u32 };
            let quanta = context.plan.shares[self.source].quanta;
            let stream = self.stream.as_mut()?;
            stream.prepare(ticket);
            if let Some(started) = start(context, self.source, stream, ticket, quanta, local) {
                return Some(started);
            }
        }
    }
}

/// A ray as it leaves its source; `None` when it cannot start.
#[inline]
fn start<C: Carry>(
    context: &Context<'_>,
    source: usize,
    stream: &Stream,
    ticket: Ticket,
    quanta: f64,
    local: &mut Local,
) -> Option<(Path<C>, Ray)> {
    let emitter = &context.bound.emitters[source];
    let emission = emitter.emit(stream, ticket);
    let mut ray = emission.ray;
    if let Some((face, normal)) = emission.from {
        local.counts.corrected_normals += u64::from(settle(context, face, normal, &mut ray));
    }
    local.counts.rays += 1;
    local.ends.emitted += count(quanta);
    let inside = match context.around.get(source) {
        Some(Around::Same(bodies)) => C::inside(bodies),
        _ if C::MEDIA => C::inside(&around::bodies(context, &ray)),
        _ => C::inside(&[]),
    };
    let Some(mut carry) = inside else {
        local.lose(LostRay {
            ray: ticket.ray,
            branch: 0,
            bounce: 0,
            cause: Cause::TooDeep,
            quanta: count(quanta),
            origin: ray.origin,
            direction: ray.direction,
            face: None,
            body: 0,
        });
        return None;
    };
    if C::COLOURED {
        carry.light(emission.wavelength, || match emitter.polarised {
            Some(field) => Stokes::linear(1.0, ray.direction, field),
            None => Stokes::unpolarised(1.0, ray.direction),
        });
    }
    let receiver = NO_RECEIVER;
    let mut path =
        Path { ray: ticket.ray, branch: 0, bounce: 0, quanta, first: quanta, length: 0.0, receiver, carry };
    step::record(context, &path, ray.origin, Event::Emitted, local);
    step::aim(context, &mut path, &mut ray);
    Some((path, ray))
}

/// Moves the start of a ray from the spline of a face to where the intersector has that face, and marks it as leaving it.
///
/// Facets lie up to their sag off the spline: a ray that started there could hit its own facet. Looked for within 1 mm, less
/// where another face is in between; a ray whose face is not found starts on the spline.
///
/// A ray that would go below the facet is turned to above it; tells whether it was.
fn settle(context: &Context<'_>, face: FaceId, normal: Vector, ray: &mut Ray) -> bool {
    for reach in [1.0, 0.1, 0.01, 1e-3] {
        let probe = Ray::new(ray.origin + normal * reach, -normal).within(0.0, 2.0 * reach);
        let Some(hit) = context.intersector.intersect(&probe, &mut Cost::default()) else { continue };
        if hit.face == face {
            let from = Departure { face, primitive: hit.primitive, uv: hit.uv };
            let below = ray.direction.dot(hit.geometric_normal) <= 0.0;
            let going = if below { reflect(ray.direction, hit.geometric_normal) } else { ray.direction };
            *ray = Ray::new(probe.at(hit.t), going).leaving(from);
            return below;
        }
    }
    false
}

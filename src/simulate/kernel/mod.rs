//! The path kernel: wavefronts of rays through an intersector, one `match` on the surface at each hit.
//!
//! A replicate is traced in batches that are topped up with new rays as paths end, so that the intersector always has many
//! rays to interleave. What a ray carries is a type parameter ([`payload::RayPayload`]): a scene without media does not pay for
//! them. Everything else is arithmetic behind the `match`. A surface returns what becomes of light ([`interaction::Interaction`]); the
//! tracer books it.
//!
//! Inner modules, each of which sees only those before it: `payload`, `context`, `path`, `tolerances`, `contact`, `interaction`,
//! `media_at`, `crossing`, `start`, `starting_media`, `surface`, `tracer`, `receivers`, `emission`, `step`, `wavefront`, `simd_dispatch`.

mod contact;
mod context;
mod crossing;
mod emission;
mod interaction;
mod media_at;
mod path;
pub(crate) mod payload;
mod receivers;
mod simd_dispatch;
mod start;
mod starting_media;
mod step;
mod surface;
mod tolerances;
mod tracer;
mod wavefront;

<<<<<<< HEAD
pub(crate) use around::{Around, sources as around_sources};
pub(crate) use carry::{Carry, Coloured, Everything, Mirrors, Nothing, OneBody, Plain, Stack};
pub(crate) use local::Local;
pub use local::{Cause, Counts, Event, LostRay, PathSink, PathVertex, Tallies};
pub(crate) use wide::trace;

use super::bind::BoundScene;
use super::emitter::{Leaving, Stream, Ticket};
use super::plan::Plan;
use super::random::Key;
use super::receiver::Receiver;
use super::run::RunSettings;
use super::tally::count;
use crate::intersect::{Cost, Hit, Intersector};
use crate::math::{Aabb, Departure, FaceId, Point, Ray, Vector};
use crate::optics::polarised::Stokes;
use crate::optics::reflect;

/// What all replicates share.
#[derive(Clone)]
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
    /// Length up to the last hit that was no total reflection, mm.
    pub(crate) free: f32,
    pub(crate) carry: C,
}

/// The key of the random numbers of a path at its present vertex.
#[inline(always)]
fn key<C>(context: &Context<'_>, path: &Path<C>) -> Key {
    Key { seed: context.settings.seed, ray: path.ray, branch: path.branch, bounce: path.bounce }
}

/// No receiver ahead.
pub(crate) const NO_RECEIVER: u32 = u32::MAX;
/// The ray scatters inside its body at the end of its segment.
pub(crate) const SCATTERS: u32 = u32::MAX - 1;

impl Context<'_> {
    /// Whether nothing is asked about a ray on its way but where it ends.
    pub(crate) fn plain(&self) -> bool {
        let extra = |r: &Receiver| r.interactions.is_some() || r.channels.count() > 0;
        self.passing.is_empty() && !self.plan.records_any() && !self.bound.receivers.iter().any(extra)
    }

    /// Whether the polarisation of rays is followed.
    #[inline]
    pub(crate) fn polarised(&self) -> bool {
        self.bound.scene.run.polarisation
    }
}

/// Traces these rays and adds them to `local`. Returns the intersector's work.
#[inline(always)]
fn trace_rays<C: Carry>(context: &Context<'_>, which: Which, local: &mut Local) -> Cost {
    let mut cost = Cost::default();
    let mut sources = Sources::new(context, which);
    let Some(mut wave) = Wave::<C>::idle(context.settings.batch.max(1)) else { return cost };
    loop {
        wave.fill(context, &mut sources, local);
        if wave.paths.is_empty() {
            return cost;
        }
        context.intersector.intersect_batch(&wave.rays, &mut wave.hits, &mut cost);
        local.counts.segments += wave.rays.len() as u64;
        for (i, (path, ray)) in wave.paths.iter_mut().zip(&mut wave.rays).enumerate() {
            let on = step::step(context, path, ray, wave.hits[i].as_ref(), local, &mut wave.pending)
                && !(context.intersector.escapes(ray) && step::go(context, path, ray, local));
            if !on {
                wave.ended.push(i as u32);
            }
        }
        if !C::PLAIN && local.paths.len() >= STREAMED {
            local.stream(context);
        }
    }
}

/// Vertices that are gathered before they are streamed: 1.3 MB.
const STREAMED: usize = 1 << 14;

/// Rays under way in one batch.
struct Wave<C> {
    paths: Vec<Path<C>>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Places of paths that have ended, ascending.
    ended: Vec<u32>,
    /// Paths that split off and wait for room.
    pending: Vec<(Path<C>, Ray)>,
}

impl<C: Carry> Wave<C> {
    /// Places for `batch` paths, all of them free.
    fn idle(batch: usize) -> Option<Self> {
        let carry = C::inside(&[])?;
        let receiver = NO_RECEIVER;
        let path =
            Path { ray: 0, branch: 0, bounce: 0, quanta: 0.0, first: 0.0, length: 0.0, receiver, free: 0.0, carry };
        let ray = Ray::new(Point::ZERO, Vector::Z);
        Some(Self {
            paths: vec![path; batch],
            rays: vec![ray; batch],
            hits: vec![None; batch],
            ended: (0..batch as u32).collect(),
            pending: Vec::new(),
        })
    }

    /// Puts paths that wait, then new ones, into the places of those that have ended; places without a taker go.
    #[inline(always)]
    fn fill(&mut self, context: &Context<'_>, sources: &mut Sources, local: &mut Local) {
        let mut taken = 0;
        for &i in &self.ended {
            let (path, ray) = (&mut self.paths[i as usize], &mut self.rays[i as usize]);
            if let Some(next) = self.pending.pop() {
                (*path, *ray) = next;
            } else if !sources.begin(context, path, ray, local) {
                break;
            }
            taken += 1;
        }
        for &i in self.ended[taken..].iter().rev() {
            self.paths.swap_remove(i as usize);
            self.rays.swap_remove(i as usize);
            self.hits.pop();
        }
        self.ended.clear();
        // Near the end paths that split off find the wave short.
        while self.paths.len() < context.settings.batch
            && let Some((path, ray)) = self.pending.pop()
        {
            self.paths.push(path);
            self.rays.push(ray);
            self.hits.push(None);
        }
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
    /// Whether one ray alone is asked for, by its number.
    alone: bool,
}

impl Sources {
    fn new(context: &Context<'_>, which: Which) -> Self {
        let last = context.plan.shares.len();
        let alone = matches!(which, Which::Ray(_));
        let mut sources = Self { replicate: 0, source: 0, next: 0, range: [0, 0], stream: None, last, alone };
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
        let stream = Stream::new(s.seed, s.sampling, which, source as u32, rays);
        self.stream = Some(stream.of(&context.bound.emitters[source]));
    }

    /// Starts the next ray that can start; `false` at the end of the replicate.
    #[inline(always)]
    fn begin<C: Carry>(
        &mut self,
        context: &Context<'_>,
        path: &mut Path<C>,
        ray: &mut Ray,
        local: &mut Local,
    ) -> bool {
        loop {
            while self.next >= self.range[1] {
                if self.source >= self.last {
                    return false;
                }
                self.enter(context, self.source + 1);
            }
            let Some(stream) = &mut self.stream else { return false };
            let (emitter, first) = (&context.bound.emitters[self.source], self.range[0]);
            let started = (self.next - first) as u32;
            self.next += 1;
            let (ticket, leaving) = match self.alone {
                true => emitter.alone(stream, first, started, ray),
                false => emitter.next(stream, first, started, ray),
            };
            let quanta = context.plan.shares[self.source].quanta;
            if start(context, self.source, &leaving, (ticket, quanta), path, ray, local) {
                return true;
            }
        }
    }
}

/// Puts a ray that leaves its source on its way; `false` when it cannot start.
#[inline(always)]
fn start<C: Carry>(
    context: &Context<'_>,
    source: usize,
    leaving: &Leaving,
    (ticket, quanta): (Ticket, f64),
    path: &mut Path<C>,
    ray: &mut Ray,
    local: &mut Local,
) -> bool {
    let mut within = None;
    if let Some((face, normal)) = leaving.from {
        local.counts.corrected_normals += u64::from(settle(context, face, normal, ray));
        within = if C::MEDIA { contact::lit_from(context, face, normal, ray) } else { None };
    }
    local.counts.rays += 1;
    local.ends.emitted += count(quanta);
    let inside = match context.around.get(source) {
        Some(Around::Same(bodies)) => C::inside(bodies),
        Some(Around::OnFace) => {
            // Through an edge or a corner a ray may pass without a hit.
            *ray = around::laid(context, ray).unwrap_or_else(|| around::behind(context, ray));
            let emitter = &context.bound.emitters[source];
            if C::MEDIA && !emitter.stated {
                C::inside(&around::bodies(context, ray))
            } else {
                C::inside(&emitter.inside)
            }
        }
        _ if C::MEDIA => C::inside(&around::bodies(context, within.as_ref().unwrap_or(ray))),
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
        return false;
    };
    if C::COLOURED {
        carry.light(leaving.wavelength, || match context.bound.emitters[source].polarised {
            Some(field) => Stokes::linear(1.0, ray.direction, field),
            None => Stokes::unpolarised(1.0, ray.direction),
        });
    }
    let receiver = NO_RECEIVER;
    let (ray_number, first) = (ticket.ray, quanta);
    *path = Path { ray: ray_number, branch: 0, bounce: 0, quanta, first, length: 0.0, receiver, free: 0.0, carry };
    step::record(context, path, ray.origin, Event::Emitted, local);
    arrive::aim(context, path, ray);
    true
}

/// Moves the start of a ray from the spline of a face to where the intersector has that face, and marks it as leaving it.
///
/// Facets lie up to their sag off the spline: a ray that started there could hit its own facet. Looked for within 1 mm, less
/// where another face is in between; a ray whose face is not found starts on the spline.
///
/// A ray that would go below the facet is turned to above it; tells whether it was.
#[inline(never)]
fn settle(context: &Context<'_>, face: FaceId, normal: Vector, ray: &mut Ray) -> bool {
    for reach in [1.0, 0.1, 0.01, 1e-3] {
        let probe = Ray::new(ray.origin + normal * reach, -normal).with_range(0.0, 2.0 * reach);
        let Some(mut hit) = context.intersector.intersect(&probe, &mut Cost::default()) else { continue };
        let mut point = probe.point_at(hit.t);
        if hit.face != face {
            // A face of a body that lies on it may come first.
            let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
            let behind =
                Ray::new(point, -normal).with_range(0.0, context.bound.scene.run.glue_mm).with_departure(from);
            let Some(next) = context.intersector.intersect(&behind, &mut Cost::default()) else { continue };
            (point, hit) = (behind.point_at(next.t), next);
        }
        if hit.face == face {
            let from = Departure { face, primitive: hit.primitive, uv: hit.uv };
            let below = ray.direction.dot(hit.geometric_normal) <= 0.0;
            let going = if below { reflect(ray.direction, hit.geometric_normal) } else { ray.direction };
            *ray = Ray::new(point, going).with_departure(from);
            return below;
        }
    }
    false
}
=======
pub(crate) use context::Context;
pub(crate) use path::RaySelection;
pub(crate) use simd_dispatch::trace;
>>>>>>> 0d58269 (Untie simulate: surfaces return what becomes of light, one place books it)

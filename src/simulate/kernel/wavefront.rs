//! Wavefronts: batches of rays that are topped up with new ones as paths end, so that the intersector always has many to interleave.

use super::context::Context;
use super::emission::SourceQueue;
use super::path::{Path, RaySelection};
use super::payload::RayPayload;
use super::tracer::Tracer;
use crate::intersect::{Cost, Hit};
use crate::math::{Point, Ray, Vector};
use crate::simulate::emitter::RayIndex;
use crate::simulate::tallies::ReplicateTally;

/// Vertices that are gathered before they are streamed: 1.3 MB.
const STREAMED: usize = 1 << 14;

/// Traces these rays to their ends, adds what becomes of them to `tally`, and returns the intersector's work. Recorded paths go to the
/// context's sink, if it has one.
#[inline(always)]
pub(super) fn trace_rays<C: RayPayload>(
    context: &Context<'_>,
    rays: RaySelection,
    tally: &mut ReplicateTally,
) -> Cost {
    let mut cost = Cost::default();
    let mut sources = SourceQueue::new(context, rays);
    let mut wave = Wavefront::<C>::idle(context.settings.batch.max(1));
    let mut tracer = Tracer { context, tally, pending: Vec::new() };
    loop {
        wave.fill(&mut tracer, &mut sources);
        if wave.paths.is_empty() {
            break;
        }
        context.intersector.intersect_batch(&wave.rays, &mut wave.hits, &mut cost);
        tracer.tally.counts.segments += wave.rays.len() as u64;
        for (i, (path, ray)) in wave.paths.iter_mut().zip(&mut wave.rays).enumerate() {
            let goes_on = tracer.advance(path, ray, wave.hits[i].as_ref())
                // Most of the light of a reflector escapes by rays that its horizon knows to be free: they are
                // ended without a walk.
                && !(context.intersector.escapes(ray) && tracer.finish_escaping(path, ray));
            if !goes_on {
                wave.ended.push(i as u32);
            }
        }
        if !C::ENDS_ONLY && tracer.tally.paths.len() >= STREAMED {
            stream_paths(context, tracer.tally);
        }
    }
    if !C::ENDS_ONLY {
        stream_paths(context, tally);
    }
    cost
}

/// Hands the vertices in `tally` to the context's sink; does nothing without one.
fn stream_paths(context: &Context<'_>, tally: &mut ReplicateTally) {
    if let Some(sink) = context.paths {
        tally.stream_paths(sink, &context.plan);
    }
}

/// Rays under way in one batch.
struct Wavefront<C> {
    paths: Vec<Path<C>>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Places of paths that have ended, ascending.
    ended: Vec<u32>,
}

impl<C: RayPayload> Wavefront<C> {
    /// Makes a wavefront with places for `batch` paths, all of them free.
    fn idle(batch: usize) -> Self {
        Self {
            paths: vec![Path::at_source(RayIndex::FIRST, 0.0, C::in_surroundings()); batch],
            rays: vec![Ray::new(Point::ZERO, Vector::Z); batch],
            hits: vec![None; batch],
            ended: (0..batch as u32).collect(),
        }
    }

    /// Puts paths that wait, then new ones, into the places of those that have ended; removes places without a taker.
    #[inline(always)]
    fn fill(&mut self, tracer: &mut Tracer<'_, '_, C>, sources: &mut SourceQueue) {
        let mut taken = 0;
        for &i in &self.ended {
            let (path, ray) = (&mut self.paths[i as usize], &mut self.rays[i as usize]);
            if let Some(next) = tracer.pending.pop() {
                (*path, *ray) = next;
            } else if !sources.start_next(tracer, path, ray) {
                break;
            }
            taken += 1;
        }
        // From the back: `swap_remove` fills a hole with the last path, which must not be one that goes too.
        for &i in self.ended[taken..].iter().rev() {
            self.paths.swap_remove(i as usize);
            self.rays.swap_remove(i as usize);
            self.hits.pop();
        }
        self.ended.clear();
        // Near the end paths that split off find the wave short.
        while self.paths.len() < tracer.context.settings.batch
            && let Some((path, ray)) = tracer.pending.pop()
        {
            self.paths.push(path);
            self.rays.push(ray);
            self.hits.push(None);
        }
    }
}

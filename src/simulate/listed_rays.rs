//! What became of each ray of a list: every one is traced once, by itself, whatever share of the power it has.
//!
//! Guarantee: the same rows for any number of threads. The run itself draws rays in proportion to their power, some of them several times
//! and some never; this is another trace, which changes none of its sums.

use super::bind::BoundScene;
use super::dispatch::{self, kernel_kind};
use super::emitter::ListCursor;
use super::kernel::{Context, RaySelection};
use super::outcome::{Event, PathVertex};
use super::settings::RunSettings;
use super::tallies::ReplicateTally;
use crate::intersect::Intersector;
use crate::math::{Point, Ray, Vector, run_on_threads};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most rays of all lists together whose ends are reported: they take half a gigabyte.
pub const MOST_LISTED_RAYS: u64 = 5_000_000;

/// Rays that a thread takes at a time.
const BLOCK: u64 = 4096;

/// Where a ray of a list ended, or one of the paths that it was split into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ListedEnd {
    /// The source, by its place in the scene.
    pub source: u32,
    /// The ray, by its place in the list.
    pub ray: u64,
    /// Which path of a ray that was split; 0 for one that was not.
    pub branch: u32,
    /// How it ended.
    pub event: Event,
    /// The placed face where it ended, if it was at one.
    pub face: Option<u32>,
    /// Hits before.
    pub bounces: u32,
    /// Where it ended, mm; for light that left the scene, a point on its way.
    pub point: Point,
    /// Unit direction in which it came there; zero where it ended as it began.
    pub direction: Vector,
    /// Power that came there, in the unit of the run: that of the ray less what faces and media had taken.
    pub power: f64,
}

/// The sources that are lists of rays, by their place in the scene, and how many rays each has.
pub fn ray_lists(bound: &BoundScene) -> Vec<(u32, u64)> {
    let lists = bound.emitters.iter().enumerate();
    lists.filter_map(|(k, e)| Some((k as u32, e.list()?.len()))).collect()
}

/// Traces every ray of every list by itself; rows in the order of sources, rays and branches. A ray
/// that cannot be read any more has no row.
pub fn listed_ends(bound: &BoundScene, intersector: &dyn Intersector, settings: &RunSettings) -> Vec<ListedEnd> {
    // Each ray is traced alone, so that a wavefront needs a single place.
    let single = RunSettings { batch: 1, ..settings.clone() };
    let mut context = Context::new(bound, intersector, &single);
    context.plan.record_all();
    let mut ends = Vec::new();
    for (source, rays) in ray_lists(bound) {
        let next = AtomicU64::new(0);
        let blocks: Mutex<Vec<(u64, Vec<ListedEnd>)>> = Mutex::new(Vec::new());
        let work = || {
            let mut tracer = ListTracer::new(&context, source);
            loop {
                let first = BLOCK * next.fetch_add(1, Ordering::Relaxed);
                if first >= rays {
                    break;
                }
                let block = (first..rays.min(first + BLOCK)).flat_map(|ray| tracer.ends(ray)).collect();
                blocks.lock().unwrap_or_else(|e| e.into_inner()).push((first, block));
            }
        };
        run_on_threads(settings.thread_count(), work);
        let mut blocks = blocks.into_inner().unwrap_or_else(|e| e.into_inner());
        // Blocks are done in any order.
        blocks.sort_by_key(|(first, _)| *first);
        ends.extend(blocks.into_iter().flat_map(|(_, block)| block));
    }
    ends
}

/// Traces rays of one list.
struct ListTracer<'c, 'a> {
    context: &'c Context<'a>,
    source: u32,
    tally: ReplicateTally,
    /// Power of the source over that of its list.
    scale: f64,
    cursor: ListCursor,
}

impl<'c, 'a> ListTracer<'c, 'a> {
    /// Makes a tracer of the rays of a source's list; `context` must record every ray.
    fn new(context: &'c Context<'a>, source: u32) -> Self {
        let emitter = &context.bound.emitters[source as usize];
        let scale = emitter.list().map_or(1.0, |list| emitter.power / list.power());
        Self { context, source, tally: ReplicateTally::new(context.bound), scale, cursor: ListCursor::default() }
    }

    /// Traces a ray, by its place in the list, and returns where each of its paths ended, by branch; empty where the ray cannot be read.
    fn ends(&mut self, ray: u64) -> Vec<ListedEnd> {
        let kind = kernel_kind(self.context.bound, self.context.settings);
        let selection = RaySelection::Listed { source: self.source, ray };
        dispatch::trace(kind, self.context, selection, &mut self.tally);
        let mut vertices = std::mem::take(&mut self.tally.paths);
        // What it counted is no part of the run.
        self.tally.discard();
        // Vertices of a path are noted in its order; those of several paths are mixed.
        vertices.sort_by_key(|v| v.branch);
        let emitter = &self.context.bound.emitters[self.source as usize];
        let cursor = &mut self.cursor;
        let Some(measured) = emitter.list().and_then(|list| list.ray(ray, cursor)) else { return Vec::new() };
        let power = measured.power * self.scale;
        let Some(emitted) = vertices.first().map(|v| v.power) else {
            // It could not start: nothing is known but where it should have.
            let event = Event::Lost;
            let Ray { origin: point, direction, .. } = emitter.in_scene(&measured);
            let source = self.source;
            return vec![ListedEnd {
                source,
                ray,
                branch: 0,
                event,
                face: None,
                bounces: 0,
                point,
                direction,
                power,
            }];
        };
        let end = |path: &[PathVertex]| {
            let last = &path[path.len() - 1];
            let before = path.iter().rev().find(|v| v.point != last.point);
            ListedEnd {
                source: self.source,
                ray,
                branch: last.branch,
                event: last.event,
                face: last.face,
                bounces: last.bounce,
                point: last.point,
                direction: before.map_or(Vector::ZERO, |v| (last.point - v.point).normalize()),
                power: power * last.power / emitted,
            }
        };
        vertices.chunk_by(|a, b| a.branch == b.branch).map(end).collect()
    }
}

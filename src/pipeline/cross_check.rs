//! The checks of a run beside its results: a sample of its rays traced again on BVH and spline, and what the facets
//! change of its light.

use super::intersectors::{groups_in_one_scene, octrees_in_one_scene, true_intersector};
use super::monitor::{Monitor, Stage, in_stage};
use super::prepared_scene::{PreparedScene, TraceRequest};
use super::ray_recorder::RayRecorder;
use super::scene_results::SceneResults;
use super::settings::IntersectorKind;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::simulate::{PartialRun, ReceiverResult, Results, RunSettings, ask_again, verify_pruning};
use crate::study::cross_check::{self, CrossCheck, GroupedIntersectors, cross_check_groups};
use crate::study::geometric_error::{GeometricError, geometric_error};
use crate::study::{Lift, Progress};
use std::time::Instant;

/// Most segments of a run that are traced again on BVH and spline.
const MOST_RECHECKED: u64 = 10_000;
/// The share of their segments that short runs trace again: a check of 10,000 took a sixth of the time of a run of as many rays.
const RECHECKED_SHARE: f64 = 0.1;
/// The fewest, even of the shortest run.
const FEWEST_RECHECKED: u64 = 2000;
/// The fewest rays whose segments these are: 2000 paths are as many places, directions and depths, however long each is.
const FEWEST_REPLAYED: u64 = 2000;

/// Rays traced on facets and on the spline: some 16,000 give widths within a few per cent.
const FACETING_RAYS: f64 = 16_384.0;
/// The fewest of these, however long they are.
const FEWEST_FACETING_RAYS: f64 = 1000.0;
/// Segments of these: as many as take a tenth of a second on the spline.
const FACETING_SEGMENTS: f64 = 100_000.0;
/// Replicates of these rays: enough for the error of a difference.
const FACETING_REPLICATES: u32 = 64;

impl PreparedScene {
    /// Traces the scene, traces some of its rays again on BVH and spline, and measures what facets change of its light. Ignores the
    /// request's shard; where it asks for kernels to be verified, ignores all else of it, and the monitor.
    ///
    /// # Errors
    /// What was traced, when that is not the whole run: the monitor ended it early, or a range of rays was asked for.
    pub fn trace(&self, request: TraceRequest<'_>, monitor: &dyn Monitor) -> Result<SceneResults, Box<PartialRun>> {
        self.with_intersector(monitor, |intersector, build_seconds| {
            let settings = self.run_settings();
            // Verifying traces twice, and keeps no sums that could be merged.
            let (mut results, verification, sums) = if request.verify_pruning {
                let (results, verification) = verify_pruning(&self.bound, intersector, &settings, &|_| true);
                (results, Some(verification), None)
            } else {
                let mut traced = self.run(intersector, &settings, request, monitor);
                // A run that was ended early has no results, but sums to go on with.
                if !traced.partial.is_whole() {
                    return Err(Box::new(traced.partial));
                }
                // The results keep the cells.
                let cells = std::mem::take(&mut traced.partial.tallies.cells);
                let sums = traced.partial.clone();
                traced.partial.tallies.cells = cells;
                (Results::new(&self.bound, &settings, traced), None, Some(sums))
            };
            // What was done before tracing.
            results.seconds.read = self.job.loaded.seconds;
            results.seconds.tessellate = self.tessellation_seconds;
            results.seconds.build = build_seconds;
            let started = Instant::now();
            let (check, geometric) = recheck(self, &results, intersector, monitor);
            results.seconds.check = started.elapsed().as_secs_f64();
            results.notes.extend(geometric.iter().flat_map(|error| unknown_cells_notes(error, &results.receivers)));
            Ok(SceneResults { results, check, geometric, verification, sums_without_cells: sums })
        })
    }
}

/// Returns one sentence for each receiver of so many cells that facets and spline were compared without them.
fn unknown_cells_notes(error: &GeometricError, receivers: &[ReceiverResult]) -> Vec<String> {
    let compared = error.receivers.iter().zip(receivers);
    let without = compared.filter(|(error, receiver)| !error.has_cells() && receiver.kind != "absorbed");
    let sentence = |(_, receiver): (_, &ReceiverResult)| {
        format!(
            "the {} cells of '{}' are too many to compare on facets and spline: what facets change of each, and of the largest, is not known; \
             take fewer cells, or trace on the spline (`intersector = \"exact\"`)",
            receiver.cells.len(),
            receiver.name
        )
    };
    without.map(sentence).collect()
}

/// Checks a sample of the run's rays, and traces some of them on facets and on the spline where no pilot has. The check is `None` where
/// no ray can be traced again; the error too, unless a pilot measured it, and for a run on the spline.
///
/// The rays depend on the run alone, not on how it was divided: a merged or resumed run has the figures of an undivided one.
fn recheck(
    prepared: &PreparedScene,
    results: &Results,
    intersector: &dyn Intersector,
    monitor: &dyn Monitor,
) -> (Option<CrossCheck>, Option<GeometricError>) {
    // What the pilot found need not be measured again.
    let pilot = prepared.chosen.as_ref().and_then(|chosen| chosen.geometric.clone());
    let rays = sample_segments(prepared, results, intersector);
    if rays.is_empty() {
        return (None, pilot);
    }
    let surfaces = in_stage(monitor, Stage::BuildingCheck("the spline"), || prepared.surfaces_of_choice());
    let exact = true_intersector(prepared.facets.instancing.as_deref(), surfaces);
    let check = check_rays(prepared, intersector, &*exact, &rays, monitor);
    (Some(check), pilot.or_else(|| facet_effects(prepared, results, [intersector, &*exact])))
}

/// Traces some rays of the run once more, spread evenly over it, and returns up to [`MOST_RECHECKED`] of their segments, lifted off the
/// surfaces that they leave.
fn sample_segments(prepared: &PreparedScene, results: &Results, intersector: &dyn Intersector) -> Vec<Ray> {
    let settings = prepared.run_settings();
    let segments_a_ray = results.segments as f64 / results.rays.max(1) as f64;
    // Twice the segments that are traced again, as rays differ in how many they have; of long paths more, so that few rays do not dominate.
    let asked = ((RECHECKED_SHARE * results.segments as f64) as u64).clamp(FEWEST_RECHECKED, MOST_RECHECKED);
    let rays = (2.0 * asked as f64 / segments_a_ray.max(1.0)) as u64;
    // No more than the run has.
    let count = rays.clamp(FEWEST_REPLAYED, MOST_RECHECKED).min(settings.rays);
    let step = (settings.rays / count.max(1)).max(1);
    let expected = (count as f64 * segments_a_ray) as u64;
    let recorder = RayRecorder::new(intersector, asked, expected);
    ask_again(&prepared.bound, &recorder, &settings, (step, count));
    let lift = Lift::new(intersector, prepared.mesh_settings.loosest());
    recorder.rays(asked as usize, &prepared.job.loaded.model, |ray, up| lift.start(ray, up))
}

/// Builds what the run has not of BVH and octree, and compares both and the spline on these rays.
fn check_rays(
    prepared: &PreparedScene,
    intersector: &dyn Intersector,
    exact: &dyn Intersector,
    rays: &[Ray],
    monitor: &dyn Monitor,
) -> CrossCheck {
    let instancing = prepared.facets.instancing.as_deref();
    monitor.begin(Stage::BuildingCheck("BVH"));
    // With the normals of the run: those of facets with others differ without a fault.
    let normals = prepared.choice.normals.on_facets();
    let bvh = groups_in_one_scene(&prepared.facets, |mesh, farthest_start| {
        Box::new(Bvh::build(mesh, &bvh::Settings { normals, farthest_start, ..Default::default() }))
    });
    // The check is about facets: a run on the spline, or polished to it, says nothing about the octree.
    let on_octree =
        prepared.choice.intersector == IntersectorKind::Octree && prepared.choice.normals != NormalMode::Exact;
    // A tree of its own where the run had another intersector.
    let built = (!on_octree).then(|| octrees_in_one_scene(&prepared.facets, normals));
    let octree = built.as_deref().unwrap_or(intersector);
    monitor.end();
    monitor.begin(Stage::Checking(rays.len() as u64));
    let groups = prepared.models().iter().zip(prepared.facets.meshes()).collect();
    let intersectors = GroupedIntersectors { groups, instancing, octree, bvh: &*bvh, exact };
    let settings =
        cross_check::Settings { fallback_band_mm: prepared.mesh_settings.loosest(), ..Default::default() };
    let total = rays.len() as f64;
    let progress = |p: Progress| {
        monitor.advance((p.done * total) as u64, rays.len() as u64);
    };
    let found = cross_check_groups(&intersectors, rays, &settings, &progress);
    monitor.end();
    found
}

/// Traces some rays of the run once more, on facets and on the spline, and compares every figure; `None` where the run was not on facets.
fn facet_effects(
    prepared: &PreparedScene,
    results: &Results,
    facets_and_spline: [&dyn Intersector; 2],
) -> Option<GeometricError> {
    if prepared.choice.intersector == IntersectorKind::Exact || prepared.facets.is_empty() {
        // On the spline, and without facets, there is nothing to compare.
        return None;
    }
    let segments_a_ray = results.segments as f64 / results.rays.max(1) as f64;
    // Long paths cost more a ray: fewer of them give as much information in the same time.
    let rays = (FACETING_SEGMENTS / segments_a_ray.max(1.0)).clamp(FEWEST_FACETING_RAYS, FACETING_RAYS) as u64;
    let run = prepared.run_settings();
    // In replicates of their own, however the run itself is divided.
    let settings = RunSettings {
        rays: rays.min(run.rays),
        first_ray: 0,
        sequences: false,
        grows: false,
        replicates: FACETING_REPLICATES,
        path_samples: 0,
        ..run
    };
    Some(geometric_error(&prepared.bound, facets_and_spline, &settings))
}

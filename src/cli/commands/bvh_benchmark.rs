//! `lampyris study bvh`: the octree against the hierarchies of obvhs, parry3d and bvh, and Embree's where its library is named, on the
//! same facets and rays, its own or those of a file, in alternating rounds, on one thread and on all; answers that differ are judged
//! with twice the digits, and the rays are kept for other programs.

use super::demo;
use crate::cli::arguments::command::PlacedLimit;
use crate::cli::completion::Completion;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::octree_shape::OctreeShape;
use crate::cli::work::output_place::{folder_of, make_folder};
use crate::cli::work::ray_input::read_leaving_rays;
use crate::cli::work::{input_files, threads};
use crate::formats::{NpyArray, write_npz};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::contenders::{BinaryBvh, Embree, EmbreeError, EmbreeLibrary, Parry, Primitives};
use crate::intersect::octree::{self, Octree};
use crate::intersect::{Cost, Footprint, Hit, Intersector};
use crate::math::{Aabb, Ray};
use crate::mesh::FacetMesh;
use crate::pipeline::{MeshingSettings, TracingSettings};
use crate::study::arbiter::{Arbitration, arbitrate, same_distance};
use crate::study::cross_check::{TimedIntersector, measure};
use crate::study::rays::{Bounces, Camera, RaySource, Uniform};
use crate::study::surface_rays::SurfacePaths;
use crate::study::{Progress, Timing};
use crate::tessellate::{self, tessellate};
use crate::text::{figures, grouped};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// Tolerances, mm: about 20 thousand, 200 thousand and 1.5 million facets on the lamp.
const TOLERANCES: [f64; 3] = [0.02, 0.0018, 0.000125];
/// Rays of a round, and rounds.
const RAYS: u64 = 50_000;
const ROUNDS: usize = 11;

/// Rows, the sentence that answers, and what the octrees look like.
pub(crate) struct BvhBenchmark {
    pub(crate) rows: Vec<Value>,
    pub(crate) answer: String,
    pub(crate) shapes: Vec<OctreeShape>,
    /// Whether all of the model was read.
    pub(crate) completion: Completion,
}

/// Arguments of the benchmark.
pub(crate) struct BvhCommand<'a> {
    pub(crate) file: Option<&'a Path>,
    /// Rays to trace in place of its own.
    pub(crate) rays_in: Option<&'a Path>,
    /// The library of Embree to compare with; `None` leaves Embree out.
    pub(crate) embree: Option<&'a Path>,
    /// The folder of results, in whose `rays/` the traced rays are written.
    pub(crate) folder: &'a Path,
    pub(crate) meshing: &'a MeshingSettings,
    pub(crate) tracing: &'a TracingSettings,
}

/// Measures all intersectors on meshes of one tolerance after the other, the loose end of a tolerance that is asked for left out. Writes
/// the rays of each kind; fails on files that cannot be read or written, and libraries that are no Embree.
pub(crate) fn run(
    command: &BvhCommand,
    console: &Console,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<BvhBenchmark, Failure> {
    // Read first: a file that is no list of rays must not cost the time of meshing.
    let given = command.rays_in.map(read_leaving_rays).transpose()?;
    let embree = command.embree.map(open_embree).transpose()?;
    let loaded = match command.file {
        None => demo::lamp()?.1,
        Some(path) => match input_files::scene_or_model(path, PlacedLimit::default(), console)? {
            input_files::Input::Step(loaded) | input_files::Input::Scene(_, loaded) => loaded,
        },
    };
    let name = command.file.map_or("three-cavity lamp".into(), |p| p.display().to_string());
    let threads = threads::set_threads(command.tracing.threads)?;
    // A tolerance that is asked for is the only one.
    let tolerances = command.meshing.tolerance.map_or(TOLERANCES.to_vec(), |[finest, _]| vec![finest]);
    let completion = input_files::report_refusals(&loaded, 0.0, console);
    let mut benchmark = BvhBenchmark { rows: Vec::new(), answer: String::new(), shapes: Vec::new(), completion };
    for (k, &tolerance) in tolerances.iter().enumerate() {
        let done = k as f64 / tolerances.len() as f64;
        progress(Progress { stage: format!("{tolerance} mm"), done, remaining_seconds: None });
        let mesh = tessellate(&loaded.model, &tessellate::Settings::uniform(tolerance)).mesh;
        let octree = Octree::build(&mesh, &octree::Settings::default());
        let kinds = match &given {
            Some(rays) => vec![(GIVEN, rays.on_mesh(&mesh))],
            None => own_rays(&mesh, &octree, tolerance, command.tracing),
        };
        for (kind, rays) in &kinds {
            write_rays(&command.folder.join(format!("rays/{kind}-{}.npz", mesh.facets.len())), rays)?;
        }
        benchmark.measure_mesh((&name, &mesh), &octree, &kinds, embree.as_ref(), threads)?;
    }
    benchmark.answer = answer_text(&benchmark.rows);
    Ok(benchmark)
}

/// A library of Embree and where it lies.
type OpenEmbree<'p> = (&'p Path, Arc<EmbreeLibrary>);

/// Opens a library of Embree 4 by its path; its code then runs in this process.
///
/// # Errors
/// As a wrong argument, with help, when it cannot be loaded, lacks a function, gives no device, or is not version 4.
fn open_embree(path: &Path) -> Result<OpenEmbree<'_>, Failure> {
    Ok((path, EmbreeLibrary::open(path).map_err(unusable_embree)?))
}

/// Says that Embree cannot be used, and what to give instead.
fn unusable_embree(error: EmbreeError) -> Failure {
    Failure::arguments(error.to_string()).with_help(
        "name the library of Embree 4, such as libembree4.so.4, by its whole path, or leave --embree out",
    )
}

/// The kind of rays that come from a file.
const GIVEN: &str = "given";

/// Rays by their kind.
type Kinds = Vec<(&'static str, Vec<Ray>)>;

/// Returns the benchmark's own rays by kind, as many of each as were asked for, else [`RAYS`]. `tolerance` is that of the mesh, mm.
fn own_rays(mesh: &FacetMesh, octree: &Octree, tolerance: f64, tracing: &TracingSettings) -> Kinds {
    let count = tracing.rays().unwrap_or(RAYS);
    let seed = tracing.seed.unwrap_or(1);
    let bounds = mesh.bounds();
    let bounces = Bounces::new(&bounds, octree, tolerance, seed, count);
    let surface = SurfacePaths::new(mesh, octree, seed, count);
    vec![
        ("coherent", Camera::new(&bounds, count).rays(0..count)),
        ("incoherent", bounces.rays(0..count)),
        ("surface", surface.rays(0..count)),
        ("adversarial", edge_rays(mesh, &bounds, seed, count)),
    ]
}

/// Writes rays as arrays that NumPy opens: where they start, mm, their directions, and the facet that each leaves, −1 for none. Makes the
/// folder.
fn write_rays(path: &Path, rays: &[Ray]) -> Result<(), Failure> {
    make_folder(&folder_of(path))?;
    let origin: Vec<f64> = rays.iter().flat_map(|ray| ray.origin.to_array()).collect();
    let direction: Vec<f64> = rays.iter().flat_map(|ray| ray.direction.to_array()).collect();
    let facet: Vec<f64> = rays.iter().map(|ray| ray.departure.map_or(-1.0, |d| f64::from(d.primitive))).collect();
    let n = rays.len();
    Ok(write_npz(
        path,
        &[
            NpyArray { name: "origin", shape: vec![n, 3], data: &origin },
            NpyArray { name: "direction", shape: vec![n, 3], data: &direction },
            NpyArray { name: "facet", shape: vec![n], data: &facet },
        ],
    )?)
}

/// One of those that race.
struct Contender<'a> {
    name: &'static str,
    build: &'a str,
    intersector: &'a dyn Intersector,
}

/// Rays of one kind on one mesh.
struct Question<'a> {
    model: &'a str,
    mesh: &'a FacetMesh,
    kind: &'a str,
    rays: &'a [Ray],
}

impl BvhBenchmark {
    /// Measures all intersectors on one mesh and appends their rows, and the octree's shape with its cost for each kind of rays.
    fn measure_mesh(
        &mut self,
        (model, mesh): (&str, &FacetMesh),
        octree: &Octree,
        kinds: &Kinds,
        embree: Option<&OpenEmbree>,
        threads: usize,
    ) -> Result<(), Failure> {
        let textbook = Octree::build(mesh, &octree::Settings::textbook());
        let binary = Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..Default::default() });
        let cured = Bvh::build(mesh, &bvh::Settings::default());
        let shipped = Bvh::build(mesh, &bvh::Settings { cured: false, ..Default::default() });
        let slow = Bvh::build(mesh, &bvh::Settings { quality: bvh::Quality::VerySlow, ..Default::default() });
        let (parry, f64_bvh) = (Parry::build(mesh), BinaryBvh::build(mesh));
        let [ours, of_books] = [octree::Settings::default(), octree::Settings::textbook()]
            .map(|settings| format!("{} facets a cell", settings.threshold));
        let mut contenders = vec![
            Contender { name: "octree", build: &ours, intersector: octree },
            Contender { name: "octree, textbook", build: &of_books, intersector: &textbook },
            Contender { name: "bvh2", build: "medium build", intersector: &binary },
            Contender { name: "cwbvh", build: "medium build", intersector: &cured },
            Contender { name: "cwbvh", build: "slowest build", intersector: &slow },
            Contender { name: "cwbvh as shipped", build: "medium build", intersector: &shipped },
            Contender { name: "parry3d", build: "binned", intersector: &parry },
            Contender { name: "bvh", build: "f64", intersector: &f64_bvh },
        ];
        let of_embree = |primitives| {
            let built = embree.map(|(path, library)| Embree::build(library, path, mesh, primitives));
            built.transpose().map_err(unusable_embree)
        };
        let (triangles, quads) = (of_embree(Primitives::Triangles)?, of_embree(Primitives::Quads)?);
        for (build, built) in [("triangles", &triangles), ("quads", &quads)] {
            contenders.extend(built.as_ref().map(|intersector| Contender { name: "embree", build, intersector }));
        }
        let mut shape = OctreeShape::new(octree);
        for (kind, rays) in kinds {
            let cost = self.measure_rays(&Question { model, mesh, kind, rays }, &contenders, threads);
            shape.costs.push(((*kind).into(), cost));
        }
        self.shapes.push(shape);
        Ok(())
    }

    /// Measures all intersectors on rays of one kind and appends a row for each of three calls: batches and single rays on one thread,
    /// batches on `threads`. Returns the work of the octree, which must be the first of `contenders`, for the rays traced once, before any
    /// is timed.
    fn measure_rays(&mut self, question: &Question, contenders: &[Contender], threads: usize) -> Cost {
        let Question { mesh, kind, rays, .. } = *question;
        // The octree's answers are what others are compared with; the arbiter decides who is right.
        let truth = ask_rays(contenders[0].intersector, rays).0;
        let hits = truth.iter().flatten().count();
        let mut judged: Vec<(Comparison, Cost)> = (contenders.iter())
            .map(|contender| {
                let (hits, cost) = ask_rays(contender.intersector, rays);
                (Comparison::new(mesh, rays, &truth, &hits), cost)
            })
            .collect();
        // The octree errs where any other is right against it; it is one of those that are judged, so that there is a largest.
        judged[0].0.wrong = judged.iter().map(|(j, _)| j.octree_wrong).max().unwrap_or(0);
        for (call, batch, threads) in [("batch", true, 1), ("single", false, 1), ("batch", true, threads)] {
            // With one thread in all the second batch would be the first once more.
            if call == "batch" && threads == 1 && self.has_row(mesh, kind, call, 1) {
                continue;
            }
            // As many rays for each thread as for one: waking the threads took a tenth of a shorter round.
            let crowd = rays.repeat(threads);
            let shared: Vec<ParallelBatches> = contenders.iter().map(|e| ParallelBatches(e.intersector)).collect();
            let timed: Vec<TimedIntersector> = (contenders.iter().zip(&shared))
                .map(|(contender, shared)| {
                    let intersector: &dyn Intersector = if threads > 1 { shared } else { contender.intersector };
                    TimedIntersector { name: contender.name, intersector, batch }
                })
                .collect();
            let timings = measure(&timed, &crowd, ROUNDS);
            for ((contender, (_, timing)), judgement) in contenders.iter().zip(timings).zip(&judged) {
                let mut row = timing_row(question, contender, (call, threads), timing, judgement);
                row["hits"] = hits.into();
                self.rows.push(row);
            }
        }
        judged[0].1
    }

    /// Whether there is a row for a mesh of as many facets, these rays, this call and this number of threads, of whichever intersector.
    fn has_row(&self, mesh: &FacetMesh, kind: &str, call: &str, threads: usize) -> bool {
        self.rows.iter().any(|r| {
            r["facets"] == mesh.facets.len()
                && r["rays_kind"] == kind
                && r["call"] == call
                && r["threads"] == threads
        })
    }
}

/// Returns the row of what one intersector did with one call on so many threads; its `hits` are 0, for the caller to set.
fn timing_row(
    question: &Question,
    contender: &Contender,
    (call, threads): (&str, usize),
    timing: Timing,
    (comparison, cost): &(Comparison, Cost),
) -> Value {
    let Question { model, mesh, kind, rays } = *question;
    let footprint = contender.intersector.footprint();
    let rate = |seconds: f64| Timing::mrays_per_s(rays.len() * threads, seconds);
    let per_ray = |n: u64| n as f64 / rays.len().max(1) as f64;
    json!({
        "model": model, "facets": mesh.facets.len(), "intersector": contender.name, "build": contender.build,
        "rays_kind": kind, "call": call, "threads": threads,
        // A rate is fast where the time is short: the percentiles change places.
        "mrays_per_s_min": rate(timing.p90), "mrays_per_s_median": rate(timing.median), "mrays_per_s_p90": rate(timing.min),
        "build_seconds": footprint.build_seconds,
        "bytes_per_facet": footprint.bytes as f64 / mesh.facets.len().max(1) as f64,
        "nodes_per_ray": per_ray(cost.nodes), "tests_per_ray": per_ray(cost.tests), "rays": rays.len(), "hits": 0,
        "wrong": comparison.wrong, "differs": comparison.differs, "undecided": comparison.undecided,
    })
}

/// An intersector whose batches all threads share.
struct ParallelBatches<'a>(&'a dyn Intersector);

/// Rays that a thread takes at a time; few, so that all threads end together.
const RAYS_AT_A_TIME: usize = 512;

impl Intersector for ParallelBatches<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.0.intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], _: &mut Cost) {
        (rays.par_chunks(RAYS_AT_A_TIME).zip(hits.par_chunks_mut(RAYS_AT_A_TIME)))
            .for_each(|(rays, hits)| self.0.intersect_batch(rays, hits, &mut Cost::default()));
    }

    fn footprint(&self) -> Footprint {
        self.0.footprint()
    }
}

/// Returns random rays aimed at corners and at middles of edges, where careless tests leak; without facets, random ones. At most `count`.
fn edge_rays(mesh: &FacetMesh, bounds: &Aabb, seed: u64, count: u64) -> Vec<Ray> {
    let random = Uniform::new(bounds, seed ^ 0xad5e, count).rays(0..count);
    let facets = mesh.facets.len().max(1);
    (random.into_iter().enumerate())
        .filter_map(|(k, ray)| {
            if mesh.facets.is_empty() {
                return Some(ray);
            }
            // A prime step goes through the facets without following their order.
            let corners = mesh.corners(k.wrapping_mul(7919) % facets);
            let target = if k % 2 == 0 { corners[k % 4] } else { 0.5 * (corners[k % 4] + corners[(k + 1) % 4]) };
            // A ray from a point to itself has no direction.
            Ray::from_points(ray.origin, target)
        })
        .collect()
}

/// Asks a structure all rays as one batch; returns its answers in their order, and what that cost.
fn ask_rays(intersector: &dyn Intersector, rays: &[Ray]) -> (Vec<Option<Hit>>, Cost) {
    let mut hits = vec![None; rays.len()];
    let mut cost = Cost::default();
    intersector.intersect_batch(rays, &mut hits, &mut cost);
    (hits, cost)
}

/// How the answers of one structure stand to those of the octree, in rays.
struct Comparison {
    /// Rays that hit only one of the two, or at distances that differ by more than single precision explains.
    differs: usize,
    /// Of those, the ones where this structure is wrong by arithmetic of twice the digits.
    wrong: usize,
    /// Of those, the ones where the octree is.
    octree_wrong: usize,
    /// Of those, the ones that the arbiter could not decide.
    undecided: usize,
}

impl Comparison {
    /// Counts where hits of one structure differ from the octree's, and has the arbiter decide which of the two is wrong.
    fn new(mesh: &FacetMesh, rays: &[Ray], octree: &[Option<Hit>], hits: &[Option<Hit>]) -> Self {
        let same = |a: &Option<Hit>, b: &Option<Hit>| match (a, b) {
            (None, None) => true,
            (Some(a), Some(b)) => same_distance(a.t, b.t),
            _ => false,
        };
        let differing: Vec<usize> = (0..rays.len()).filter(|&i| !same(&octree[i], &hits[i])).collect();
        let verdicts: Vec<Arbitration> = (differing.par_iter())
            .map(|&i| arbitrate(mesh, &rays[i], octree[i].as_ref(), hits[i].as_ref()))
            .collect();
        let count = |which: Arbitration| verdicts.iter().filter(|v| **v == which).count();
        Self {
            differs: differing.len(),
            wrong: count(Arbitration::First),
            octree_wrong: count(Arbitration::Second),
            undecided: count(Arbitration::Undecided),
        }
    }
}

/// Returns the answer of the benchmark in words: rates of the octree, queried in batches, and of CwBvh as shipped, by the faster call,
/// on the finest mesh and one thread, and their ratio.
fn answer_text(rows: &[Value]) -> String {
    let most = rows.iter().filter_map(|r| r["facets"].as_u64()).max().unwrap_or(0);
    let kind = if rows.iter().any(|r| r["rays_kind"] == GIVEN) { GIVEN } else { "incoherent" };
    let rate = |name: &str, call: &str| {
        let fits = |r: &&Value| {
            r["facets"] == most
                && r["intersector"] == name
                && r["call"] == call
                && r["rays_kind"] == kind
                && r["threads"] == 1
        };
        rows.iter().find(fits).and_then(|r| r["mrays_per_s_median"].as_f64()).unwrap_or(f64::NAN)
    };
    let octree = rate("octree", "batch");
    let cwbvh = f64::max(rate("cwbvh as shipped", "single"), rate("cwbvh as shipped", "batch"));
    format!(
        "With {} facets and {kind} rays on one thread the octree, queried in batches, answers **{} million rays/s**; obvhs' CwBvh as \
         shipped, by the faster of its two calls, answers {} million rays/s: **{} ×** (medians of {ROUNDS} alternating rounds).",
        grouped(most),
        figures(octree, 3),
        figures(cwbvh, 3),
        figures(octree / cwbvh, 3)
    )
}

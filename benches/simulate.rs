//! How fast are whole simulations, receivers included, and where does the time go? Scenes S1, S2, S3.
//!
//! `cargo bench --bench simulate -- [key=value…]` prints one JSON row for each scene, in turns over the kernels so that a machine
//! that slows down slows down all of them. Keys: `scenes=s1,s2,s3`, `rays=1000000`, `threads=1`, `tolerance=0.1` (mm; `exact` for
//! the spline), `repeats=3`, `batch=1024`.
//!
//! `share` is the part of the pruned kernel's time that is spent in the intersector; `of_raw` compares its segments per second with
//! those of the bare octree on the scene's own rays, asked in shuffled order without normals.

use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Footprint, Hit, Intersector};
use lampyris::math::Ray;
use lampyris::mesh::FacetMesh;
use lampyris::simulate::{BoundScene, KernelChoice, Results, RunSettings, Scene, simulate};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Measures the time inside an intersector, or keeps its rays.
struct Probe<'a> {
    inner: &'a dyn Intersector,
    nanoseconds: AtomicU64,
    keep: usize,
    kept: Mutex<Vec<Ray>>,
}

impl<'a> Probe<'a> {
    fn new(inner: &'a dyn Intersector, keep: usize) -> Self {
        Self { inner, nanoseconds: AtomicU64::new(0), keep, kept: Mutex::default() }
    }
}

impl Intersector for Probe<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.inner.intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        if self.keep > 0 {
            let mut kept = self.kept.lock().expect("no panic");
            let room = self.keep.saturating_sub(kept.len()).min(rays.len());
            kept.extend(&rays[..room]);
        }
        let start = Instant::now();
        self.inner.intersect_batch(rays, hits, cost);
        self.nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }

    fn expect(&self, rays: u64, threads: usize) {
        self.inner.expect(rays, threads);
    }

    fn is_gone(&self, ray: &Ray) -> bool {
        self.inner.is_gone(ray)
    }

    fn footprint(&self) -> Footprint {
        self.inner.footprint()
    }
}

/// Million rays a second that the octree answers alone, on `threads` threads.
fn raw(octree: &Octree, rays: &[Ray], threads: usize) -> f64 {
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| octree.closest(rays, &mut vec![None; rays.len()], &mut Cost::default()));
        }
    });
    (rays.len() * threads) as f64 / start.elapsed().as_secs_f64() / 1e6
}

/// Rays of a run, shuffled by a linear congruential sequence.
fn own_rays(bound: &BoundScene, engine: &dyn Intersector, settings: &RunSettings) -> Vec<Ray> {
    let probe = Probe::new(engine, 400_000);
    let settings = RunSettings { rays: settings.rays.min(400_000), threads: 1, ..settings.clone() };
    simulate(bound, &probe, &settings, &|_| true);
    let mut rays = probe.kept.into_inner().expect("no panic");
    let mut state = 1u64;
    for i in (1..rays.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        rays.swap(i, ((state >> 33) % (i as u64 + 1)) as usize);
    }
    rays
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let value = |key: &str| args.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str, or: f64| value(key).and_then(|v| v.parse().ok()).unwrap_or(or);
    let (rays, threads) = (number("rays", 1e6) as u64, number("threads", 1.0) as usize);
    let (repeats, batch) = (number("repeats", 3.0) as usize, number("batch", 0.0) as usize);
    let tolerance = number("tolerance", 0.1);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes");
    for short in value("scenes").unwrap_or("s1,s2,s3").split(',') {
        let names = ["s1_lens", "s2_lamp", "s3_reflector"];
        let name = names.into_iter().find(|n| n.starts_with(short)).expect("a scene");
        let scene = Scene::read(&folder.join(format!("{name}.toml"))).expect("scene");
        let read = |m: &lampyris::simulate::scene::ModelUse| {
            lampyris::step::read(&scene.resolve(&m.file), &Default::default()).expect("model").model
        };
        let model = scene.assemble(scene.models.iter().map(read).collect()).expect("one model");
        let bound = scene.bind(&model).expect("bound");
        let mut settings = RunSettings { rays, threads, ..RunSettings::from(&scene.run) };
        if batch > 0 {
            settings.batch = batch;
        }
        if value("tolerance") == Some("exact") {
            let exact = Exact::build(&model, &exact::Settings::default());
            report(name, &bound, &exact, &settings, repeats, None);
        } else {
            let settings_of_facets =
                lampyris::tessellate::Settings { tolerance: [tolerance; 2], ..Default::default() };
            let mesh: FacetMesh = lampyris::tessellate::tessellate(&model, &settings_of_facets).mesh;
            let octree = Octree::build(&mesh, &octree::Settings::default());
            report(name, &bound, &octree, &settings, repeats, Some(&octree));
        }
    }
}

fn report(
    name: &str,
    bound: &BoundScene,
    engine: &dyn Intersector,
    settings: &RunSettings,
    repeats: usize,
    octree: Option<&Octree>,
) {
    let with = |engine: &dyn Intersector, kernel| {
        simulate(bound, engine, &RunSettings { kernel, ..settings.clone() }, &|_| true)
    };
    let rays = octree.map(|_| own_rays(bound, engine, settings));
    let (mut pruned, mut full, mut bare, mut inside) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut last: Option<Results> = None;
    for _ in 0..repeats {
        let results = with(engine, KernelChoice::Pruned);
        pruned.push(results.seconds.trace);
        let other = with(engine, KernelChoice::Full);
        assert_eq!(results.digest, other.digest, "pruned against full");
        full.push(other.seconds.trace);
        if let (Some(octree), Some(rays)) = (octree, &rays) {
            bare.push(raw(octree, rays, settings.threads));
        }
        let probe = Probe::new(engine, 0);
        let results = with(&probe, KernelChoice::Pruned);
        let whole = results.seconds.trace * settings.threads as f64;
        inside.push(probe.nanoseconds.into_inner() as f64 * 1e-9 / whole);
        last = Some(results);
    }
    let least = |x: &[f64]| x.iter().copied().fold(f64::INFINITY, f64::min);
    let Some(r) = last else { return };
    let (w, seconds) = (&r.receivers[0], least(&pruned));
    let per_second = |n: u64| n as f64 / seconds / 1e6;
    let raw = bare.iter().copied().fold(0.0, f64::max);
    println!(
        "{{\"scene\":\"{name}\",\"facets\":{},\"threads\":{},\"rays\":{},\"mrays_per_s\":{:.3},\"msegments_per_s\":{:.3},\
         \"full_over_pruned\":{:.3},\"share\":{:.3},\"raw_mrays_per_s\":{raw:.3},\"of_raw\":{:.3},\"segments_per_ray\":{:.4},\
         \"power\":{:.6},\"power_error\":{:.6},\"rms\":{:?},\"centroid\":{:?},\"centre_cell\":{:.5e},\"corrected\":{},\"lost\":{},\
         \"digest\":\"{}\"}}",
        engine.footprint().primitives,
        settings.threads,
        r.rays,
        per_second(r.rays),
        per_second(r.segments),
        least(&full) / seconds,
        least(&inside),
        per_second(r.segments) / raw,
        r.segments as f64 / r.rays as f64,
        w.power,
        w.power_error,
        w.rms,
        w.centroid,
        w.cell(99, 99).max(w.cell(100, 100)) * w.half[0] * w.half[1] * 1e-10,
        r.corrected_normals,
        r.lost_rays,
        r.digest
    );
}

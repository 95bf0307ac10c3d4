//! How fast are whole simulations, receivers included, and where does the time go? Scenes S1, S2, S3.
//!
//! `cargo bench --bench simulate -- [key=value…]` prints one JSON row for each scene and number of threads, in turns over the kernels
//! so that a machine that slows down slows down all of them. Keys: `scenes=s1,s2,s3`, `rays=1000000`, `threads=1,4`, `tolerance=0.1`
//! (mm; `exact` for the spline), `repeats=3`, `batch=1024`.
//!
//! Rates are those of a run on an octree just built, with all that it works out about sources and facets on the way. The kernels are
//! compared on one octree that has done so before: `full_over_pruned`.
//!
//! `share` is the part of the pruned kernel's time that is spent in the intersector; `of_raw` compares its segments per second with
//! those of the bare octree on the scene's own rays, asked in shuffled order without normals. `walk_share` is the time that the bare
//! octree takes for the same rays in the order of the run, against the whole: no kernel can be faster than that.
//!
//! With several numbers of threads a last row has what the most of them gain over one, `scaling`, beside what the machine gives at that
//! time: `processes`, as many programs of one thread each against one alone, and `arithmetic`, loops in registers.

use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use lampyris::math::Ray;
use lampyris::mesh::FacetMesh;
use lampyris::simulate::{BoundScene, KernelChoice, Results, RunSettings, Scene, simulate};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
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

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        self.inner.prepare_for(expected);
    }

    fn escapes(&self, ray: &Ray) -> bool {
        self.inner.escapes(ray)
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

/// Rays of a run in its order.
fn own_rays(bound: &BoundScene, engine: &dyn Intersector, settings: &RunSettings) -> Vec<Ray> {
    let probe = Probe::new(engine, 400_000);
    let settings = RunSettings { rays: settings.rays.min(400_000), threads: 1, ..settings.clone() };
    simulate(bound, &probe, &settings, &|_| true);
    probe.kept.into_inner().expect("no panic")
}

/// The same, shuffled by a linear congruential sequence.
fn shuffled(mut rays: Vec<Ray>) -> Vec<Ray> {
    let mut state = 1u64;
    for i in (1..rays.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        rays.swap(i, ((state >> 33) % (i as u64 + 1)) as usize);
    }
    rays
}

/// Seconds of a loop in registers on each of so many threads.
fn arithmetic(threads: usize) -> f64 {
    let turn = || {
        let mut x = std::hint::black_box(1.5f64);
        (0..200_000_000).for_each(|_| x = x * 0.999_999 + 1e-6);
        std::hint::black_box(x);
    };
    let start = Instant::now();
    std::thread::scope(|scope| {
        (1..threads).for_each(|_| drop(scope.spawn(turn)));
        turn();
    });
    start.elapsed().as_secs_f64()
}

/// Rays per second of so many programs of one thread each, at the same time.
fn processes(count: usize, name: &str, args: &[String]) -> f64 {
    let program = std::env::current_exe().expect("own path");
    let start = |_| {
        let mut child = Command::new(&program);
        child.args(args).arg(format!("child={name}"));
        child.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("a process")
    };
    let mut children: Vec<Child> = (0..count).map(start).collect();
    let mut lines: Vec<_> =
        children.iter_mut().map(|c| BufReader::new(c.stdout.take().expect("piped")).lines()).collect();
    // All are ready before any begins.
    lines.iter_mut().for_each(|l| drop(l.next()));
    children.iter_mut().for_each(|c| drop(c.stdin.take()));
    let rates = lines.iter_mut().filter_map(|l| l.next()?.ok()?.parse::<f64>().ok()).sum();
    children.iter_mut().for_each(|c| drop(c.wait()));
    rates
}

/// What is asked for.
struct Asked {
    args: Vec<String>,
    rays: u64,
    threads: Vec<usize>,
    repeats: usize,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let value = |key: &str| args.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str, or: f64| value(key).and_then(|v| v.parse().ok()).unwrap_or(or);
    let threads = value("threads").unwrap_or("1,4").split(',').filter_map(|n| n.parse().ok()).collect();
    let (rays, repeats) = (number("rays", 1e6) as u64, number("repeats", 3.0) as usize);
    let asked = Asked { args: args.clone(), rays, threads, repeats };
    let (batch, tolerance) = (number("batch", 0.0) as usize, number("tolerance", 0.1));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes");
    let child = value("child");
    for short in child.or(value("scenes")).unwrap_or("s1,s2,s3").split(',') {
        let names = ["s1_lens", "s2_lamp", "s3_reflector"];
        let name = names.into_iter().find(|n| n.starts_with(short)).expect("a scene");
        let scene = Scene::read(&folder.join(format!("{name}.toml"))).expect("scene");
        let read = |m: &lampyris::simulate::scene::ModelUse| {
            lampyris::step::read(&scene.resolve(&m.file), &Default::default()).expect("model").model
        };
        let model = scene.assemble(scene.models.iter().map(read).collect()).expect("one model");
        let bound = scene.bind(&model).expect("bound");
        let mut settings = RunSettings { rays: asked.rays, threads: 1, ..RunSettings::from(&scene.run) };
        if batch > 0 {
            settings.batch = batch;
        }
        let run = |engine: &dyn Intersector, octree: Option<&Octree>| match child {
            Some(_) => as_child(&bound, engine, &settings),
            None => report(name, (&bound, engine, octree), &settings, &asked),
        };
        if value("tolerance") == Some("exact") {
            let exact = Exact::build(&model, &exact::Settings::default());
            run(&exact, None);
        } else {
            let settings_of_facets =
                lampyris::tessellate::Settings { tolerance: [tolerance; 2], ..Default::default() };
            let mesh: FacetMesh = lampyris::tessellate::tessellate(&model, &settings_of_facets).mesh;
            let octree = Octree::build(&mesh, &octree::Settings::default());
            run(&octree, Some(&octree));
        }
    }
}

/// Waits for the end of its input, then prints its rate.
fn as_child(bound: &BoundScene, engine: &dyn Intersector, settings: &RunSettings) {
    println!("ready");
    let _ = std::io::stdin().read_to_end(&mut Vec::new());
    let results = simulate(bound, engine, settings, &|_| true);
    println!("{}", results.rays as f64 / results.seconds.trace);
}

fn report(
    name: &str,
    (bound, engine, octree): (&BoundScene, &dyn Intersector, Option<&Octree>),
    one: &RunSettings,
    asked: &Asked,
) {
    let rays = octree.map(|_| own_rays(bound, engine, one)).unwrap_or_default();
    let mixed = shuffled(rays.clone());
    let all: Vec<RunSettings> =
        asked.threads.iter().map(|&threads| RunSettings { threads, ..one.clone() }).collect();
    let mut rows: Vec<Row> = all.iter().map(|_| Row::default()).collect();
    let fresh = |settings: &RunSettings| match octree {
        Some(octree) => simulate(bound, &octree.without_preparation(), settings, &|_| true),
        None => simulate(bound, engine, settings, &|_| true),
    };
    let (mut scaling, most) = (Vec::new(), asked.threads.iter().copied().max().unwrap_or(1));
    for _ in 0..asked.repeats {
        for (settings, row) in all.iter().zip(&mut rows) {
            row.cold.push(fresh(settings).seconds.trace);
            row.measure(bound, engine, settings);
        }
        if let Some(octree) = octree {
            for (settings, row) in all.iter().zip(&mut rows) {
                row.raw.push(raw(octree, &mixed, settings.threads));
                row.in_order.push(raw(octree, &rays, settings.threads));
            }
        }
        if most > 1 {
            let ours = |threads| fresh(&RunSettings { threads, ..one.clone() }).seconds.trace;
            let [alone, together] = [1, most].map(ours);
            let [single, many] = [1, most].map(|n| processes(n, name, &asked.args));
            let [lone, full] = [1, most].map(|n| n as f64 / arithmetic(n));
            scaling.push([alone / together, many / single, full / lone]);
        }
    }
    for (settings, row) in all.iter().zip(&rows) {
        row.print(name, engine, settings.threads);
    }
    if most > 1 {
        let [ours, processes, arithmetic] = [0, 1, 2].map(|k| {
            let mut of: Vec<f64> = scaling.iter().map(|s| s[k]).collect();
            of.sort_by(f64::total_cmp);
            of[of.len() / 2]
        });
        println!(
            "{{\"scene\":\"{name}\",\"threads\":{most},\"scaling\":{ours:.3},\"processes\":{processes:.3},\
             \"arithmetic\":{arithmetic:.3},\"of_processes\":{:.3}}}",
            ours / processes
        );
    }
}

/// What is measured with one number of threads.
#[derive(Default)]
struct Row {
    cold: Vec<f64>,
    pruned: Vec<f64>,
    full: Vec<f64>,
    inside: Vec<f64>,
    raw: Vec<f64>,
    in_order: Vec<f64>,
    last: Option<Results>,
}

impl Row {
    fn measure(&mut self, bound: &BoundScene, engine: &dyn Intersector, settings: &RunSettings) {
        let with = |engine: &dyn Intersector, kernel| {
            simulate(bound, engine, &RunSettings { kernel, ..settings.clone() }, &|_| true)
        };
        let results = with(engine, KernelChoice::Pruned);
        self.pruned.push(results.seconds.trace);
        let other = with(engine, KernelChoice::Full);
        assert_eq!(results.digest, other.digest, "pruned against full");
        self.full.push(other.seconds.trace);
        let probe = Probe::new(engine, 0);
        let results = with(&probe, KernelChoice::Pruned);
        let whole = results.seconds.trace * settings.threads as f64;
        self.inside.push(probe.nanoseconds.into_inner() as f64 * 1e-9 / whole);
        self.last = Some(results);
    }

    fn print(&self, name: &str, engine: &dyn Intersector, threads: usize) {
        let least = |x: &[f64]| x.iter().copied().fold(f64::INFINITY, f64::min);
        let most = |x: &[f64]| x.iter().copied().fold(0.0, f64::max);
        let Some(r) = &self.last else { return };
        let (w, seconds, warm) = (&r.receivers[0], least(&self.cold), least(&self.pruned));
        let per_second = |n: u64| n as f64 / seconds / 1e6;
        let (raw, in_order) = (most(&self.raw), most(&self.in_order));
        println!(
            "{{\"scene\":\"{name}\",\"facets\":{},\"threads\":{threads},\"rays\":{},\"mrays_per_s\":{:.3},\
             \"msegments_per_s\":{:.3},\"full_over_pruned\":{:.3},\"share\":{:.3},\"walk_share\":{:.3},\
             \"raw_mrays_per_s\":{raw:.3},\"of_raw\":{:.3},\"segments_per_ray\":{:.4},\"power\":{:.6},\"power_error\":{:.6},\
             \"rms\":{:?},\"centroid\":{:?},\"centre_cell\":{:.5e},\"corrected\":{},\"lost\":{},\"digest\":\"{}\"}}",
            engine.footprint().primitives,
            r.rays,
            per_second(r.rays),
            per_second(r.segments),
            least(&self.full) / warm,
            least(&self.inside),
            r.cost.rays as f64 / in_order / 1e6 / warm,
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
}

//! The main job from the library: what it is told to stop is gone on with, and it does not matter who listens.

use lampyris::pipeline::{
    ErrorTarget, IntersectorKind, Monitor, PreparedScene, RayRange, SceneJob, Silent, Stage, TraceRequest,
    TracingSettings, read_scene,
};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The lens of the fixtures, traced on the spline.
fn lens(rays: u64) -> PreparedScene {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes/s1_lens.toml");
    let (scene, loaded) = read_scene(&scene, &Silent).unwrap();
    let tracing = TracingSettings {
        ray_range: Some(RayRange { first: None, end: rays }),
        threads: Some(2),
        intersector: Some(IntersectorKind::Exact),
        ..TracingSettings::default()
    };
    PreparedScene::new(SceneJob { tracing, ..SceneJob::new(scene, loaded) }, &Silent).unwrap()
}

/// Stops tracing after some rays, and notes the stages.
#[derive(Default)]
struct Stopwatch {
    after: u64,
    most: AtomicU64,
    stages: Mutex<Vec<String>>,
}

impl Monitor for Stopwatch {
    fn begin(&self, stage: Stage<'_>) {
        self.stages.lock().unwrap().push(format!("{stage:?}"));
    }

    fn advance(&self, done: u64, _total: u64) -> bool {
        self.most.fetch_max(done, Ordering::Relaxed);
        done < self.after
    }
}

#[test]
fn a_run_that_was_stopped_goes_on_to_the_same_bits() {
    let prepared = lens(3000);
    let whole = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    let stopwatch = Stopwatch { after: 500, ..Stopwatch::default() };
    let partial = prepared.trace(TraceRequest::default(), &stopwatch).unwrap_err();
    let done = stopwatch.most.load(Ordering::Relaxed);
    assert!((500..3000).contains(&done) && !partial.is_whole(), "{done}");
    assert!(stopwatch.stages.lock().unwrap().contains(&"Tracing(3000)".to_owned()));
    let rest = prepared.trace(TraceRequest { from: Some(*partial), ..TraceRequest::default() }, &Silent).unwrap();
    assert_eq!(rest.results.digest, whole.results.digest);
    assert_eq!(rest.figures(&prepared), whole.figures(&prepared));
}

#[test]
fn every_figure_has_both_errors_and_the_document_holds_them() {
    let prepared = lens(3000);
    let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    let figures = run.figures(&prepared);
    assert!(
        figures.iter().flat_map(|f| f.named()).all(|(_, f)| f.statistical.is_finite() && f.geometric == Some(0.0))
    );
    assert_eq!(run.geometric_cells(&prepared, 0).unwrap().len(), run.results.receivers[0].cells.len());
    let document = run.document(&prepared).unwrap();
    assert_eq!(document["digest"], run.results.digest.as_str());
    assert_eq!(document["receivers"][0]["figures"]["power"]["value"], figures[0].power.value);
}

#[test]
fn requests_that_cannot_be_met_say_what_to_do() {
    let prepared = lens(3000);
    let text = |e: lampyris::pipeline::Error| e.to_string();
    let scene = &prepared.job.scene;
    assert!(text(ErrorTarget::new("1%@fokus", scene).unwrap_err()).contains("did you mean \"focus\"?"));
    let job = |tracing| SceneJob { tracing, ..prepared.job.clone() };
    let none = TracingSettings { threads: Some(0), ..TracingSettings::default() };
    assert!(text(PreparedScene::new(job(none), &Silent).unwrap_err()).contains("threads 0: at least one"));
    let step = scene.resolve(&scene.models[0].file);
    assert!(text(read_scene(&step, &Silent).unwrap_err()).contains("a STEP file, where a scene (.toml) is needed"));
    assert!(text("quadtree".parse::<IntersectorKind>().unwrap_err()).contains("octree, bvh2, cwbvh, exact"));
}

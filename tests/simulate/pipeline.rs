//! The main job from the library: a stopped run can be continued, and monitors change no result.

use lampyris::model::Model;
use lampyris::pipeline::{
    Cache, ErrorTarget, IntersectorKind, LoadedModel, MeshingSettings, Monitor, PreparedScene, RayRange, SceneJob,
    Silent, Stage, TraceRequest, TracingSettings, normal_mode, read_scene, refuse_facet_normals,
};
use lampyris::regulation::Verdict;
use lampyris::simulate::Scene;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The lens of the fixtures, traced on the spline.
fn lens(rays: u64) -> PreparedScene {
    changed_lens(rays, IntersectorKind::Exact, |_| ())
}

/// The lens of the fixtures with its scene changed.
fn changed_lens(rays: u64, intersector: IntersectorKind, change: impl Fn(&mut Scene)) -> PreparedScene {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes/s1_lens.toml");
    let (mut scene, loaded) = read_scene(&scene, &Silent).unwrap();
    change(&mut scene);
    let tracing = TracingSettings {
        ray_range: Some(RayRange { first: None, end: rays }),
        threads: Some(2),
        intersector: Some(intersector),
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

/// Of more than 2²² cells facets and spline are compared without them: what has no error says why.
#[test]
fn cells_that_are_too_many_to_compare_are_named() {
    let run = |cells: [u32; 2]| {
        let prepared = changed_lens(1000, IntersectorKind::Octree, |scene| {
            scene.receivers.truncate(1);
            scene.receivers[0].cells = cells;
        });
        let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
        let max = run.figures(&prepared)[0].max.clone().expect("a map");
        let said = run.results.notes.iter().filter(|note| note.contains("too many to compare")).count();
        (max.geometric.is_some(), said)
    };
    assert_eq!(run([2048, 2049]), (false, 1));
    assert_eq!(run([64, 64]), (true, 0));
}

/// A receiver beside all light has the error of a ray in those that compared: that facets send it none on these is no proof.
#[test]
fn facets_that_changed_no_ray_may_change_one_in_so_many() {
    let prepared = changed_lens(20_000, IntersectorKind::Octree, |scene| {
        scene.receivers.truncate(1);
        scene.receivers[0].at = [0.0, 5000.0, 107.0];
    });
    let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    let power = run.figures(&prepared)[0].power.clone();
    assert_eq!(power.value, 0.0);
    // The source has 1 W; what was lost on the way is far less.
    assert!(power.geometric.is_some_and(|g| (1.0 / 20_000.0..1e-3).contains(&g)), "{power:?}");
}

#[test]
fn requests_that_cannot_be_met_say_what_to_do() {
    let prepared = lens(3000);
    let text = |e: lampyris::pipeline::Error| e.to_string();
    let scene = &prepared.job.scene;
    assert!(text(ErrorTarget::new("1%@fokus", scene).unwrap_err()).contains("did you mean 'focus'?"));
    let dark = Scene { receivers: Vec::new(), ..(**scene).clone() };
    assert!(text(ErrorTarget::new("1%@focus", &dark).unwrap_err()).contains("add a [[receiver]]"));
    let job = |tracing| SceneJob { tracing, ..prepared.job.clone() };
    let none = TracingSettings { threads: Some(0), ..TracingSettings::default() };
    assert!(text(PreparedScene::new(job(none), &Silent).unwrap_err()).contains("threads 0: at least one"));
    let step = scene.resolve(&scene.models[0].file);
    assert!(text(read_scene(&step, &Silent).unwrap_err()).contains("a STEP file, where a scene (.toml) is needed"));
    assert!(text("quadtree".parse::<IntersectorKind>().unwrap_err()).contains("octree, bvh2, cwbvh, exact"));
}

/// One ray of the bright source in a test point would break its limit: that none arrived among a thousand decides nothing.
#[test]
fn a_dark_test_point_is_judged_by_what_one_ray_adds() {
    let text = "[run]\nunit = 'lm'\n\
        [[source]]\nkind = 'cone'\ndirection = [0, 0, -1]\nhalf_angle_deg = 5\npower = 1\nrays = 100_000\n\
        [[source]]\nkind = 'cone'\ndirection = [0, 0, -1]\nhalf_angle_deg = 5\npower = 10\nrays = 1000\n\
        [[receiver]]\nname = 'road'\nkind = 'far_field'\nnormal = [0, 0, 1]\nh_deg = [-12, 12]\nv_deg = [-6, 6]\n\
        cells = [240, 120]\n[[regulation]]\nid = 'UN R112 B passing'\nas_placed = true\n";
    let scene = Scene::parse(text, "dark.toml", Path::new(".")).unwrap();
    let loaded = LoadedModel { model: Model::default(), ..LoadedModel::default() };
    let prepared = PreparedScene::new(SceneJob::new(scene, loaded), &Silent).unwrap();
    let run = prepared.trace(TraceRequest::default(), &Silent).unwrap();
    let verdicts = run.verdicts(&prepared).unwrap();
    let row = verdicts[0].assessment.rows.iter().find(|row| row.row.id == "B50L").unwrap();
    let reading = row.reading.unwrap();
    // 0.01 lm over a photometer of 0.149° are about 1,500 cd, where at most 350 are allowed.
    assert_eq!(reading.value, 0.0);
    assert!(reading.statistical > 1000.0, "{reading:?}");
    assert_eq!(row.verdict, Some(Verdict::Unsure));
}

/// A scene that a program made or changed has no text of its own, and a model that it made no file: parts of one run are known by what was
/// traced.
#[test]
fn parts_of_other_scenes_and_models_are_told_apart_without_text() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes/s1_lens.toml");
    let (scene, loaded) = read_scene(&path, &Silent).unwrap();
    let of = |change: &dyn Fn(&mut Scene), loaded: &LoadedModel| {
        let mut scene = scene.clone();
        change(&mut scene);
        let meshing = MeshingSettings { tolerance: Some([0.5, 0.5]), ..MeshingSettings::default() };
        let job = SceneJob { meshing, ..SceneJob::new(scene, loaded.clone()) };
        PreparedScene::new(job, &Silent).unwrap().fingerprint().unwrap()
    };
    let as_read = of(&|_| {}, &loaded);
    assert_eq!(as_read, of(&|scene| scene.origin.file = "elsewhere/lens.toml".into(), &loaded));
    assert_ne!(as_read, of(&|scene| scene.sources[0].power = Some(2.5), &loaded), "with the text of another");
    let without_text = |scene: &mut Scene| scene.origin.text = None;
    let brighter = |scene: &mut Scene| {
        without_text(scene);
        scene.sources[0].power = Some(2.5);
    };
    assert_ne!(of(&without_text, &loaded), of(&brighter, &loaded));

    let in_memory = LoadedModel { reports: Vec::new(), ..loaded.clone() };
    let mut moved = in_memory.clone();
    moved.model.instances[0].placement.origin.z += 0.125;
    let [first, second] = [&in_memory, &moved].map(|model| of(&without_text, model));
    assert_ne!(first, second);
    assert_eq!(first, of(&without_text, &in_memory));
}

/// Parts that were traced from copies of the files, as on another machine, belong to the run: files count by what they hold.
#[test]
fn copies_of_the_files_make_the_same_run() {
    let folder = tempfile::tempdir().unwrap();
    let lens = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_planoconvex_nurbs.stp");
    let rays = "x,y,z,dx,dy,dz,power\n0,0,-9,0,0,1,1\n";
    let fingerprint = |files: [&str; 3], rays: &str| {
        let [first, second, list] = files;
        for file in [first, second] {
            std::fs::create_dir_all(folder.path().join(file).parent().unwrap()).unwrap();
            std::fs::copy(&lens, folder.path().join(file)).unwrap();
        }
        std::fs::write(folder.path().join(list), rays).unwrap();
        let text = format!(
            "[run]\nrays = 1000\n[accuracy]\ntolerance_mm = 0.2\n[[model]]\nfile = '{first}'\n[[model]]\nfile = '{second}'\n\
            placement = {{ at = [0, 0, 50] }}\n[[source]]\nkind = 'rays'\nfile = '{list}'\n[[receiver]]\nname = 'wall'\n\
            kind = 'plane'\nat = [0, 0, 99]\nnormal = [0, 0, 1]\nsize = [9, 9]\ncells = [2, 2]\n"
        );
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text).unwrap();
        let (scene, loaded) = read_scene(&file, &Silent).unwrap();
        PreparedScene::new(SceneJob::new(scene, loaded), &Silent).unwrap().fingerprint().unwrap()
    };
    let here = fingerprint(["lens.stp", "lens.stp", "rays.csv"], rays);
    assert_eq!(here, fingerprint(["there/a.step", "there/a.step", "there/b.csv"], rays));
    // Another file at the same path; and two files are not one part that is placed twice.
    assert_ne!(here, fingerprint(["lens.stp", "lens.stp", "rays.csv"], &rays.replace(",1\n", ",2\n")));
    assert_ne!(here, fingerprint(["lens.stp", "lens2.stp", "rays.csv"], rays));
}

/// Of four threads that start at once on an empty cache one traces a pilot: the seconds that it took are the same for all, to the bit.
#[test]
fn who_starts_at_once_waits_for_one_pilot() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes/s1_lens.toml");
    let (scene, loaded) = read_scene(&scene, &Silent).unwrap();
    let tracing = TracingSettings {
        ray_range: Some(RayRange { first: None, end: 40_000 }),
        threads: Some(1),
        ..TracingSettings::default()
    };
    let cache = Some(Cache::new(folder.path().join("kept")));
    let job = SceneJob { tracing, cache, ..SceneJob::new(scene, loaded) };
    let prepare = || PreparedScene::new(job.clone(), &Silent).unwrap().chosen.unwrap();
    let chosen: Vec<_> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..4).map(|_| scope.spawn(prepare)).collect();
        started.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(chosen[0].pilot_rays > 0 && chosen.iter().all(|c| c == &chosen[0]), "{chosen:?}");
    // Nothing is left but the entries.
    let names = std::fs::read_dir(folder.path().join("kept")).unwrap().map(|e| e.unwrap().file_name());
    assert!(names.into_iter().all(|name| !name.to_str().unwrap().ends_with(".part")));
}

/// A file that is saved anew after it was read, as people do beside an open notebook: its facets are not kept as those of the new one.
#[test]
fn facets_of_a_file_that_changed_since_are_not_taken_for_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let lens = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_planoconvex_nurbs.stp");
    let file = folder.path().join("lens.stp");
    std::fs::copy(&lens, &file).unwrap();
    let text = "[run]\nrays = 1000\n[accuracy]\ntolerance_mm = 0.2\n[[model]]\nfile = 'lens.stp'\n[[medium]]\nname = 'glass'\n\
        index = 1.5\n[[material]]\npart = '*'\nmedium = 'glass'\n[[source]]\nkind = 'collimated'\nat = [0, 0, -3]\n\
        direction = [0, 0, 1]\nradius = 5\npower = 1\n[[receiver]]\nname = 'wall'\nkind = 'plane'\nat = [0, 0, 99]\n\
        normal = [0, 0, 1]\nsize = [9, 9]\ncells = [2, 2]\n";
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let read = || read_scene(&folder.path().join("scene.toml"), &Silent).unwrap();
    let cache = Some(Cache::new(folder.path().join("kept")));
    let prepare = |(scene, loaded): (Scene, LoadedModel)| {
        let prepared =
            PreparedScene::new(SceneJob { cache: cache.clone(), ..SceneJob::new(scene, loaded) }, &Silent);
        let prepared = prepared.unwrap();
        let height = |mesh: &lampyris::mesh::FacetMesh| mesh.bounds().max.z;
        (prepared.facets.meshes().map(height).fold(f64::NEG_INFINITY, f64::max), prepared.fingerprint().unwrap())
    };
    let before = read();
    // The same lens in metres: every face is there, a thousand times as large.
    let metres = std::fs::read_to_string(&lens).unwrap().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)");
    std::fs::write(&file, metres).unwrap();
    let (height, fingerprint) = prepare(before);
    let (new_height, new_fingerprint) = prepare(read());
    assert!((new_height / height - 1000.0).abs() < 1e-6, "{new_height} after {height}");
    assert_ne!(fingerprint, new_fingerprint);
}

/// A lens of kilometres, of which facets of the default tolerance are too many to be tried: its choice is cached under the key that
/// the next run looks up.
#[test]
fn a_choice_on_coarser_facets_is_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_planoconvex_nurbs.stp");
    let text = format!(
        "[run]\nrays = 40_000\n[[model]]\nfile = {model:?}\nunit_mm = 30_000\n[[medium]]\nname = 'glass'\nindex = 1.5\n\
         [[material]]\npart = '*'\nmedium = 'glass'\n[[source]]\nkind = 'collimated'\nat = [0, 0, -3e5]\n\
         direction = [0, 0, 1]\nradius = 3e5\npower = 1\n[[receiver]]\nname = 'wall'\nkind = 'plane'\nat = [0, 0, 2e6]\n\
         normal = [0, 0, 1]\nsize = [1e6, 1e6]\ncells = [2, 2]\n"
    );
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let (scene, loaded) = read_scene(&folder.path().join("scene.toml"), &Silent).unwrap();
    let cache = Some(Cache::new(folder.path().join("kept")));
    let job = SceneJob { cache, ..SceneJob::new(scene, loaded) };
    let [first, second] = [(); 2].map(|()| PreparedScene::new(job.clone(), &Silent).unwrap().chosen.unwrap());
    assert!(first.because.contains("coarser ones were tried"), "{}", first.because);
    assert_eq!(first, second, "with the seconds of the pilot");
}

/// Normals that do not go with the spline are named as they were asked for: by the keys of the scene, or by settings beside it.
#[test]
fn normals_beside_the_spline_are_named_where_they_stand() {
    let text = "[accuracy]\nintersector = 'exact'\nnormals = 'flat'\n[[source]]\n";
    let scene = Scene::parse(text, "s.toml", Path::new(".")).unwrap();
    let said = |normals: Option<&str>, intersector: Option<IntersectorKind>, scene: Option<&Scene>| {
        let normals = normals.map(|name| normal_mode(name).unwrap());
        let tracing = TracingSettings { normals, intersector, ..TracingSettings::default() };
        refuse_facet_normals(&tracing, scene).unwrap_err().to_string()
    };
    let of_scene = said(None, None, Some(&scene));
    assert!(of_scene.contains("`normals = \"flat\"` with `intersector = \"exact\"`"), "{of_scene}");
    assert!(of_scene.contains("[accuracy]") && !of_scene.contains("--normals"), "{of_scene}");
    let of_both = said(Some("nearest"), None, Some(&scene));
    assert!(of_both.contains("nearest with `intersector = \"exact\"` in [accuracy]"), "{of_both}");
    let of_settings = said(Some("flat"), Some(IntersectorKind::Exact), None);
    assert!(of_settings.contains("flat with the intersector exact"), "{of_settings}");
}

//! A scene file traced as `lampyris trace` does it: a pilot chooses facets or the spline, and every figure has both its errors.
//!
//! `cargo run --release --example scene_with_errors [SCENE]`

use lampyris::pipeline::{PreparedScene, RayRange, SceneJob, Silent, TraceRequest, TracingSettings, read_scene};
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lamp = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes/s2_lamp.toml");
    let file = std::env::args_os().nth(1).map_or(lamp, PathBuf::from);

    // What is not said here the scene says, and what neither says is chosen. A monitor in place of `Silent` hears of progress.
    let (scene, loaded) = read_scene(&file, &Silent)?;
    let tracing =
        TracingSettings { ray_range: Some(RayRange { first: None, end: 100_000 }), ..TracingSettings::default() };
    let prepared = PreparedScene::new(SceneJob { tracing, ..SceneJob::new(scene, loaded) }, &Silent)?;
    if let Some(choice) = &prepared.chosen {
        println!("{} with {} normals: {}", choice.intersector, choice.normals, choice.because);
    }
    let run = prepared.trace(TraceRequest::default(), &Silent).map_err(|_| "the run was stopped")?;

    for (receiver, figures) in run.results.receivers.iter().zip(run.figures(&prepared)) {
        let power = &figures.power;
        let geometric = power.geometric.map_or("unknown".to_owned(), |error| format!("{error:.1e}"));
        println!(
            "{}: {:.5} {}, standard error {:.1e} from the rays and {geometric} from the facets",
            receiver.name, power.value, power.unit, power.statistical
        );
    }
    for note in &run.results.notes {
        println!("note: {note}");
    }
    assert!(run.results.power.imbalance().abs() < 1e-9);
    Ok(())
}

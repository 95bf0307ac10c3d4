//! A STEP file and a scene of a few lines give the luminous intensity of a lamp, cell by cell, with its standard error.
//!
//! `cargo run --release --example step_to_candela`

use lampyris::intersect::octree::{self, Octree};
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::{step, tessellate};
use std::path::Path;

const SCENE: &str = r#"
    [run]
    unit = "lm"
    [[model]]
    file = "reflector_freeform_trimmed.stp"
    [[material]]            # the reflecting face, by a point on it
    at = [40, 20, 18.377825]
    surface = "mirror"
    reflectance = 0.95
    [[source]]
    kind = "point"
    at = [0, 0, 26]
    power = 1000
    [[receiver]]
    name = "far field"
    kind = "far_field"
    normal = [0, 0, 1]
    angles = "A"
    h_deg = [-40, 40]
    v_deg = [-40, 40]
    cells = [40, 40]
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
    let import = step::read(&folder.join("reflector_freeform_trimmed.stp"), &step::Settings::default())?;
    let facets = tessellate::tessellate(&import.model, &tessellate::Settings::default());
    let octree = Octree::build(&facets.mesh, &octree::Settings::default());

    let scene = Scene::parse(SCENE, "lamp.toml", &folder)?.bind(&import.model)?;
    let run = RunSettings { rays: 200_000, ..RunSettings::default() };
    let results = simulate(&scene, &octree, &run, &|_| true);

    let far = &results.receivers[0];
    let brightest = (0..far.cells.len()).max_by(|&a, &b| far.cells[a].total_cmp(&far.cells[b])).unwrap_or(0);
    println!("{} facets, {} rays", facets.mesh.facets.len(), results.rays);
    println!("{:.1} ± {:.1} lm in the far field", far.power, far.power_error);
    println!("brightest cell {:.0} ± {:.0} {}", far.cells[brightest], far.errors[brightest], far.unit);
    assert_eq!(far.unit, "cd");
    // 1000 lm into the whole sphere, of which the reflector catches a part and keeps 95 %.
    assert!(far.power > 100.0 && far.power < 1000.0 && results.power.imbalance() < 1e-9);
    Ok(())
}

//! A lens built with the truck kernel, without any file: its focus on facets and on the exact spline.
//!
//! `cargo run --release --example truck_to_light`

use lampyris::intersect::Intersector;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::tessellate;
use lampyris::truck::{Conic, Lens};
use std::path::Path;

/// A flat front and a hyperboloid of K = −n² behind focus light that comes along the axis without aberration, at
/// R/(n − 1) = 50 mm behind the back vertex.
const SCENE: &str = r#"
    [[model]]
    file = "built.stp"
    [[medium]]
    name = "glass"
    index = 1.5
    [[material]]
    part = "*"
    medium = "glass"
    [[source]]
    kind = "collimated"
    at = [0, 0, -10]
    direction = [0, 0, 1]
    radius = 10
    power = 1
    [[receiver]]
    name = "focus"
    kind = "plane"
    at = [0, 0, 58]
    normal = [0, 0, 1]
    size = [10, 10]
    cells = [50, 50]
    interactions = 2
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let back = Conic { radius: -25.0, conic: -2.25 };
    let lens = Lens { front: Conic::FLAT, back, thickness: 8.0, half_aperture: 12.0 };
    let built = lens.model("lens")?;
    assert!(built.refused.is_empty());
    let scene = Scene::parse(SCENE, "lens.toml", Path::new("."))?.bind(&built.model)?;
    let run = RunSettings { rays: 50_000, ..RunSettings::default() };

    let facets = tessellate::tessellate(&built.model, &tessellate::Settings::uniform(0.01));
    let octree = Octree::build(&facets.mesh, &octree::Settings::default());
    let spline = Exact::build(&built.model, &exact::Settings::default());
    let spot = |name: &str, intersector: &dyn Intersector| {
        let focus = simulate(&scene, intersector, &run, &|_| true).receivers.swap_remove(0);
        println!("{name:7} power {:.4}, spot {:.3e} mm (rms)", focus.power, focus.rms[0]);
        focus.rms[0]
    };
    let on_facets = spot("facets", &octree);
    let on_spline = spot("spline", &spline);
    // Of light refracted twice alone: what is reflected within the lens reaches the plane too, spread over it.
    assert!(on_spline < 1e-6 && on_facets > 1e-4, "{on_facets} {on_spline}");
    Ok(())
}

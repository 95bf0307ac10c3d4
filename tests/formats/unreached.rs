//! What is stated where no ray arrived.

use lampyris::intersect::octree::{self, Octree};
use lampyris::mesh::FacetMesh;
use lampyris::model::Model;
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::study::figures::{Limit, Surface, cell_errors, figures};
use std::path::Path;

/// Of 1 W in 10,000 rays one is 0.1 mW, on a cell of 1 cm² 1 W/m².
#[test]
fn what_no_ray_reached_is_not_stated_as_exactly_dark() {
    let source = "kind = 'collimated'\nat = [-5, 0, -1]\ndirection = [0, 0, 1]\nradius = 1\npower = 1";
    let receiver = |name: &str, x: f64| {
        format!(
            "[[receiver]]\nname = '{name}'\nat = [{x}, 0, 0]\nsize = [20, 10]\ncells = [2, 1]\nabsorbs = false\n"
        )
    };
    let text = format!(
        "[run]\nrays = 10000\n[[source]]\n{source}\n{}{}",
        receiver("half lit", 0.0),
        receiver("dark", 100.0)
    );
    let scene = Scene::parse(&text, "dark.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&Model::default()).unwrap();
    let no_facets = FacetMesh::default();
    let nothing = Octree::build(&no_facets, &octree::Settings::default());
    let results = simulate(&bound, &nothing, &RunSettings::from(&scene.run), &|_| true);
    let close =
        |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-3, "{found} for {expected}");
    // All light falls into the first cell: replicates differ by one ray in 78 alone.
    let lit = cell_errors(&results.receivers[0]);
    assert!(lit[0] < 1e-3 * results.receivers[0].cells[0], "{lit:?}");
    close(lit[1], 1.0);
    cell_errors(&results.receivers[1]).into_iter().for_each(|error| close(error, 1.0));
    let dark = &figures(&results, Surface::Spline, "W")[1];
    close(dark.power.statistical, 1e-4);
    close(dark.max.as_ref().unwrap().statistical, 1.0);
    assert_eq!((dark.power.value, dark.power.limited_by), (0.0, Limit::Statistics));
}

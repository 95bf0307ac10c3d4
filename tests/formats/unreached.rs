//! What is stated where no ray arrived.

use lampyris::intersect::octree::{self, Octree};
use lampyris::mesh::FacetMesh;
use lampyris::model::Model;
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::study::figures::{Limit, TracedGeometry, cell_errors, figures};
use std::path::Path;

/// Of 1 W in 10,000 rays one is 0.1 mW, on a cell of 1 cm² 1 W/m²; in replicates of 78 rays, for 78.125 in the mean, a little more.
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
        |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} for {expected}");
    // All light falls into the first cell, as much of it in each replicate.
    let lit = cell_errors(&results.receivers[0]);
    assert!(lit[0] < 1e-3 * results.receivers[0].cells[0], "{lit:?}");
    let heaviest = 78.125 / 78.0;
    close(lit[1], heaviest);
    cell_errors(&results.receivers[1]).into_iter().for_each(|error| close(error, heaviest));
    let dark = &figures(&results, TracedGeometry::Spline, "W")[1];
    close(dark.power.statistical, 1e-4 * heaviest);
    close(dark.max.as_ref().unwrap().statistical, heaviest);
    assert_eq!((dark.power.value, dark.power.limited_by), (0.0, Limit::Statistics));
    assert!(dark.centroid_1.is_none() && dark.rms_2.is_none(), "no light has no place: {dark:?}");
}

/// A receiver of 20 mm beside the beam of a point far away, evenly lit: its centroid is 0, its width 20 mm / √12, up to 1e-3 of them.
#[test]
fn places_of_few_rays_have_honest_errors() {
    let text = "[run]\nrays = 3000\n[[source]]\nkind = 'point'\nat = [0, 0, -200]\npower = 1
        [[receiver]]\nname = 'small'\nsize = [20, 20]\ncells = [2, 2]\n";
    let scene = Scene::parse(text, "few.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&Model::default()).unwrap();
    let no_facets = FacetMesh::default();
    let nothing = Octree::build(&no_facets, &octree::Settings::default());
    let (mut told, mut missed) = (0, Vec::new());
    for seed in 0..400 {
        let settings = RunSettings { seed, threads: 1, ..RunSettings::from(&scene.run) };
        let results = simulate(&bound, &nothing, &settings, &|_| true);
        let all = &figures(&results, TracedGeometry::Spline, "W")[0];
        let places = all.named().filter(|(name, _)| name.starts_with("rms") || name.starts_with("centroid"));
        for (name, figure) in places {
            let truth = if name.starts_with("rms") { 20.0 / 12f64.sqrt() } else { 0.0 };
            told += 1;
            if (figure.value - truth).abs() > 3.0 * figure.statistical {
                missed.push((seed, figure.clone()));
            }
        }
    }
    // One to five rays a run, as 2.4 are expected; nothing is known of the runs without.
    assert!((1200..=1600).contains(&told), "{told}");
    assert!(missed.len() as f64 <= 0.02 * f64::from(told), "{} of {told}: {missed:?}", missed.len());
}

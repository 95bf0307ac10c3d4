//! Light through curved faces of two bodies that touch, on facets of the default tolerance: none is lost or misled between them.

use crate::turned::{ball_in_cup, doublet, ring_in_groove, rod_in_hole};
use lampyris::intersect::Intersector;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::model::Model;
use lampyris::simulate::{Results, RunSettings, Scene, simulate};
use lampyris::tessellate::{self, tessellate};
use std::path::Path;

/// Traces a scene on facets of the default tolerance, and on the spline.
fn both(model: &Model, text: &str) -> [Results; 2] {
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(model).unwrap();
    let mesh = tessellate(model, &tessellate::Settings { glue_mm: scene.run.glue_mm, ..Default::default() }).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let exact = Exact::build(model, &exact::Settings::default());
    let settings = RunSettings { threads: 2, ..RunSettings::from(&scene.run) };
    let run = |on: &dyn Intersector| simulate(&bound, on, &settings, &|_| true);
    [run(&octree), run(&exact)]
}

fn scene(parts: [(&str, f64); 2], source: &str) -> String {
    let medium = |(part, index): (&str, f64)| {
        format!(
            "[[medium]]\nname = 'of {part}'\nindex = {index}\n[[material]]\npart = '{part}'\nmedium = 'of {part}'\n"
        )
    };
    let receiver =
        "[[receiver]]\nname = 'far'\nat = [0, 0, 60]\nnormal = [0, 0, 1]\nsize = [60, 60]\ncells = [4, 4]\n";
    let [a, b] = parts.map(medium);
    format!("[run]\nrays = 20000\n{a}{b}{receiver}[[source]]\n{source}\n")
}

/// What is lost, as a share of what is emitted, and how far the receiver's power is from that on the spline.
fn check(name: &str, model: &Model, text: &str) {
    let [facets, spline] = both(model, text);
    let emitted = facets.power.emitted;
    assert!(facets.power.lost <= 1e-6 * emitted, "{name}: {:?} {:?}", facets.power, facets.ledger.first());
    assert!(facets.notes.is_empty(), "{name}: {:?}", facets.notes);
    let [on_facets, on_spline] = [&facets, &spline].map(|r| r.receivers[0].power / emitted);
    assert!((on_facets - on_spline).abs() < 0.01, "{name}: {on_facets} on facets, {on_spline} on the spline");
}

#[test]
fn light_passes_a_cemented_doublet() {
    let text = scene(
        [("crown", 1.517), ("flint", 1.62)],
        "kind = 'collimated'\nat = [0, 0, -10]\ndirection = [0, 0, 1]\nradius = 9\npower = 1",
    );
    check("doublet", &doublet(12.0, 0.7), &text);
}

#[test]
fn light_passes_a_rod_in_its_hole() {
    let text = scene(
        [("rod", 1.5), ("block", 1.6)],
        "kind = 'cone'\nhalf_angle_deg = 40\nat = [0.3, 0.2, 4]\ndirection = [0, 0, 1]",
    );
    check("rod", &rod_in_hole(0.4), &text);
}

#[test]
fn light_passes_a_ball_in_its_cup() {
    let text = scene(
        [("ball", 1.5), ("cup", 1.6)],
        "kind = 'collimated'\nat = [0, 0, -20]\ndirection = [0, 0, 1]\nradius = 7\npower = 1",
    );
    check("ball", &ball_in_cup(1.1), &text);
}

#[test]
fn light_passes_a_ring_in_its_groove() {
    let text = scene(
        [("ring", 1.4), ("groove", 1.6)],
        "kind = 'collimated'\nat = [20, 0, -8]\ndirection = [0, 0, 1]\nradius = 1.5\npower = 1",
    );
    check("ring", &ring_in_groove(0.9), &text);
}

//! The fixtures against the closed forms they were made from: units, placements, volumes, orientation, invariants.

use crate::files::fixture;
use lampyris::step::{Import, Settings, read};
use std::path::PathBuf;

fn folder() -> PathBuf {
    fixture("step")
}

fn import(name: &str) -> Import {
    read(&folder().join(name), &Settings::default()).expect("a fixture is readable")
}

fn expected() -> serde_json::Map<String, serde_json::Value> {
    let text = std::fs::read_to_string(folder().join("expected.json")).expect("expected.json");
    serde_json::from_str(&text).expect("expected.json is JSON")
}

fn names() -> Vec<String> {
    let files = std::fs::read_dir(folder()).expect("fixtures").map(|e| e.expect("entry").file_name());
    let mut names: Vec<String> =
        files.map(|n| n.to_string_lossy().into_owned()).filter(|n| n.ends_with(".stp")).collect();
    names.sort();
    names
}

#[test]
fn every_face_is_converted_and_keeps_the_promises_of_the_model() {
    for name in names() {
        let import = import(&name);
        let faces = import.report.faces;
        assert_eq!((faces.found, faces.refused, faces.repaired), (faces.converted, 0, 0), "{name}");
        assert!(import.report.problems.is_empty(), "{name}: {:?}", import.report.problems);
        for part in &import.model.parts {
            for face in part.shells.iter().flat_map(|s| &s.faces) {
                let violations = crate::support::violations(part, face);
                assert!(violations.is_empty(), "{name} #{:?}: {violations:?}", face.entity);
            }
        }
    }
}

#[test]
fn areas_and_volumes_are_those_of_the_closed_forms() {
    for (name, figures) in expected() {
        let Some(volume) = figures["volume_mm3"].as_f64() else { continue };
        let m = crate::support::measure_model(&import(&name).model);
        // A spline asphere follows the true one to 1e-6; the quadrature's polygon costs as much.
        assert!((m.volume / volume - 1.0).abs() < 5e-6, "{name}: volume {} for {volume}", m.volume);
        if let Some(area) = figures["area_mm2"].as_f64() {
            assert!((m.area / area - 1.0).abs() < 1e-4, "{name}: area {} for {area}", m.area);
        }
    }
}

#[test]
fn inches_and_millimetres_give_the_same_lamp() {
    let (mm, inch) = (import("lamp_multicavity.stp"), import("lamp_multicavity_inch.stp"));
    assert_eq!(mm.report.units.length, ["MILLI METRE"]);
    assert_eq!(inch.report.units.length, ["INCH"]);
    let (a, b) = (mm.report.bbox_mm.expect("faces"), inch.report.bbox_mm.expect("faces"));
    for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((x - y).abs() < 1e-6, "{a:?} {b:?}");
    }
}

#[test]
fn the_lamp_is_assembled_as_it_was_made() {
    let import = import("lamp_multicavity.stp");
    assert_eq!((import.report.parts, import.report.instances), (3, 5));
    assert_eq!(import.report.faces_placed.found, 62);
    let leds: Vec<_> = import.model.instances.iter().filter(|i| i.name.starts_with("led_")).collect();
    assert_eq!(leds.len(), 3);
    let figures = &expected()["lamp_multicavity.stp"]["cavities"];
    for (k, led) in leds.iter().enumerate() {
        let focus: Vec<f64> = (0..3).map(|i| figures[k]["focus"][i].as_f64().expect("focus")).collect();
        assert!((led.placement.origin - lampyris::math::Point::from_slice(&focus)).length() < 1e-9, "{}", led.name);
        let part = import.model.part(led.part);
        assert_eq!(part.name, "led");
        let colour = part.colour.or(part.shells[0].colour).expect("a colour");
        // Made as linear (1, 0.9, 0.2); the file holds the sRGB values.
        let close = colour.0.iter().zip([1.0, 0.954687, 0.484529]).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close, "{colour:?}");
    }
}

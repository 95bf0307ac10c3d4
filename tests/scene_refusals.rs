//! What a scene file says wrong is refused with its line, and what it says of a model is obeyed.

use lampyris::simulate::Scene;
use lampyris::step;
use std::path::Path;

const REST: &str = r#"
    [[source]]
    kind = "point"
    at = [0, 0, 0]
    power = 1
"#;

fn refusal(head: &str) -> String {
    let text = format!("{head}\n{REST}");
    Scene::parse(&text, "scene.toml", Path::new(".")).expect_err(head).to_string()
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    for (head, key) in [
        ("[accuracy]\ntolerance_mm = [-0.1, 0.2]", "tolerance_mm"),
        ("[accuracy]\ntolerance_mm = [0.2, 0.05]", "tolerance_mm"),
        ("[accuracy]\nangle_deg = 95", "angle_deg"),
        ("[[model]]\nfile = \"x.stp\"\nunit_mm = 0", "unit_mm"),
        ("[[model]]\nfile = \"x.stp\"\nplacement = { scale = -1 }", "scale"),
        ("[run]\nrays = 0", "rays"),
        ("[run]\nray = 10", "ray"),
    ] {
        let said = refusal(head);
        assert!(said.contains(key), "{head}: {said}");
        assert!(said.contains("scene.toml"), "{head}: {said}");
    }
}

#[test]
fn a_unit_given_by_the_user_replaces_that_of_the_file() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_planoconvex_nurbs.stp");
    let box_of = |unit: Option<f64>| {
        let settings = step::Settings { length_unit_mm: unit, ..step::Settings::default() };
        step::read(&file, &settings).expect("the lens reads").report.bbox_mm.expect("a box")
    };
    let (own, inches) = (box_of(None), box_of(Some(25.4)));
    for corner in 0..2 {
        for axis in 0..3 {
            assert!((inches[corner][axis] - 25.4 * own[corner][axis]).abs() < 1e-6);
        }
    }
}

//! Prints what a file gives; for looking at single files: `STEP_FILE=… cargo test --release --test step_probe -- --ignored --nocapture`.

mod step_support;

use lampyris::step::{Settings, read};

#[test]
#[ignore = "prints one file given by STEP_FILE"]
fn probe() {
    let path = std::env::var("STEP_FILE").expect("STEP_FILE");
    for path in path.split(':') {
        let import = read(std::path::Path::new(&path), &Settings::default()).expect("readable");
        let mut r = import.report.clone();
        r.refusals.truncate(20);
        r.repairs.truncate(10);
        r.names.truncate(10);
        println!("{}", serde_json::to_string(&r).expect("json"));
        let m = step_support::measure_model(&import.model);
        println!("area {} volume {}", m.area, m.volume);
        let mut shown = 0;
        for part in &import.model.parts {
            for face in part.shells.iter().flat_map(|s| &s.faces) {
                let v = step_support::violations(part, face);
                if !v.is_empty() && shown < 20 {
                    shown += 1;
                    println!("face #{:?} {:?}: {:?}", face.entity, face.analytic, v);
                }
                if std::env::var("STEP_FACES").is_ok() {
                    let m = step_support::measure(face);
                    println!("FACE {} {} {:?}", face.entity.unwrap_or(0), m.area, face.surface.domain());
                }
            }
        }
    }
}

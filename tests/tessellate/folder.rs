//! Every STEP file under a folder, read, meshed, measured: a row per file and one of totals; a file that is not read, a face
//! without facets, an open shell show there. Fails when a facet that was proved samples over its tolerance.
//!
//! ```text
//! LAMPYRIS_CORPUS=models LAMPYRIS_MEASURE=1 cargo test --release --test tessellate folder -- --ignored --nocapture
//! ```
//!
//! `LAMPYRIS_CORPUS` names the folder (default: `../shared/step-corpus` beside the project; nothing is done when it is absent),
//! `LAMPYRIS_ONLY` and `LAMPYRIS_SKIP` are parts of paths with commas between, `LAMPYRIS_EVERY` takes each n-th file from
//! `LAMPYRIS_START` on, `LAMPYRIS_TOLERANCE` is a uniform tolerance in mm (default: the adaptive one, and where the folder has a
//! `reference.json` its deflection), `LAMPYRIS_MEASURE` samples sags, `LAMPYRIS_DETAIL` names faces and facets.
//!
//! Columns: faces with and without facets and with something given up; shells that the file calls closed, closed and not;
//! their open and non-manifold edges; facets, the area's share in quads, facets without proof, facets whose samples exceed
//! their tolerance, those of them with proof, the worst in tolerances; seconds to read and to mesh.

use crate::files::corpus;
use lampyris::model::Model;
use lampyris::step;
use lampyris::tessellate::{Settings, Tessellation, tessellate};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.filter_map(|e| e.ok().map(|e| e.path())) {
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| ["stp", "step", "STEP", "STP"].iter().any(|x| e == *x)) {
            found.push(path);
        }
    }
}

fn number(name: &str) -> Option<f64> {
    std::env::var(name).ok().and_then(|t| t.parse().ok())
}

#[derive(Default)]
struct Totals {
    files: usize,
    faces: usize,
    failed: usize,
    repaired: usize,
    closed: usize,
    open: usize,
    facets: usize,
    unproved: usize,
    over: usize,
    over_proved: usize,
    slowest: Vec<(f64, String)>,
    unread: usize,
}

fn one(path: &Path, settings: &Settings, totals: &mut Totals) {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let start = Instant::now();
    let import = match step::read(path, &step::Settings::default()) {
        Ok(import) => import,
        Err(e) => {
            totals.unread += 1;
            return println!("{name:44} not read: {e}");
        }
    };
    let read = start.elapsed().as_secs_f64();
    let made = tessellate(&import.model, &Settings { measure: false, ..settings.clone() });
    let seconds = made.report.seconds.tessellate;
    let made = if settings.measure && made.mesh.facets.len() < 3_000_000 {
        tessellate(&import.model, settings)
    } else {
        made
    };
    let r = &made.report;
    let proved = r.over.iter().filter(|(f, _)| made.quality[*f as usize].certified).count();
    let worst = r.over.iter().map(|o| o.1 / made.quality[o.0 as usize].tolerance).fold(0.0, f64::max);
    println!(
        "{name:44} faces {} failed {} repaired {} shells {}/{} edges {}/{} facets {} quads {:.3} unproved {} over {} proved {} worst {worst:.2} read {read:.2} mesh {seconds:.2}",
        r.faces.meshed,
        r.faces.failed,
        r.faces.repaired,
        r.shells.closed,
        r.shells.open,
        r.open_edges,
        r.nonmanifold_edges,
        r.facets,
        r.quad_area_share,
        r.facets - r.certified,
        r.over.len(),
        proved,
    );
    totals.files += 1;
    totals.faces += r.faces.meshed + r.faces.failed;
    totals.failed += r.faces.failed;
    totals.repaired += r.faces.repaired;
    totals.closed += r.shells.closed;
    totals.open += r.shells.open;
    totals.facets += r.facets;
    totals.unproved += r.facets - r.certified;
    totals.over += r.over.len();
    totals.over_proved += proved;
    totals.slowest.push((read + seconds, name));
    if std::env::var("LAMPYRIS_DETAIL").is_ok() {
        detail(&import.model, &made);
    }
}

/// Faces without facets, the worst facets over their tolerance, faces at the open edges.
fn detail(model: &Model, made: &Tessellation) {
    let faces: Vec<_> = model.placed_faces().collect();
    let mut with = vec![0usize; faces.len()];
    made.mesh.facets.iter().for_each(|f| with[f.face.index()] += 1);
    let show = |i: usize| {
        let f = &faces[i];
        let Some(face) = f.face else { return format!("face {i} is a mesh") };
        format!(
            "face {i} #{:?} {:?} degree {:?} loops {:?} gap {:.1e} domain {:?} facets {}",
            f.entity(),
            face.analytic,
            face.surface.degree,
            face.loops.iter().map(|l| l.uses.len()).collect::<Vec<_>>(),
            face.gap,
            face.surface.domain(),
            with[i]
        )
    };
    for i in (0..faces.len()).filter(|&i| with[i] == 0) {
        println!("  without facets: {}", show(i));
    }
    let mut worst: std::collections::BTreeMap<usize, (usize, usize, f64, u32)> = Default::default();
    for &(f, sag) in &made.report.over {
        let q = made.quality[f as usize];
        let w = worst.entry(made.mesh.facets[f as usize].face.index()).or_default();
        w.0 += 1;
        w.1 += q.certified as usize;
        if sag / q.tolerance > w.2 {
            (w.2, w.3) = (sag / q.tolerance, f);
        }
    }
    for (i, (n, proved, ratio, f)) in worst.iter().take(30) {
        println!("  over: {n}, proved {proved}, worst {ratio:.3} of {}", show(*i));
        facet(made, *f as usize);
    }
    for n in made.report.not_certified.iter().take(30) {
        println!("  unproved: {} of {}", n.facets, show(n.face as usize));
        let mine = |i: &usize| made.mesh.facets[*i].face.0 == n.face && !made.quality[*i].certified;
        (0..made.mesh.facets.len()).filter(mine).take(3).for_each(|f| facet(made, f));
    }
    open_edges(model, made, &show);
}

fn facet(made: &Tessellation, f: usize) {
    let v = made.mesh.facets[f].vertices.map(|v| made.mesh.vertices[v as usize]);
    println!(
        "      facet {f} {:?} uv {:?} xyz {:?}",
        made.quality[f],
        v.map(|v| [v.uv.x, v.uv.y]),
        made.mesh.corners(f).map(|p| p.to_array())
    );
}

fn open_edges(model: &Model, made: &Tessellation, show: &dyn Fn(usize) -> String) {
    let mut first = 0;
    for (i, instance) in model.instances.iter().enumerate() {
        let mut face = model.first_face(i).0;
        for shell in &model.part(instance.part).shells {
            let next = face + shell.faces.len() as u32;
            let range = face..next;
            face = next;
            if !shell.closed {
                continue;
            }
            let mut edges: std::collections::BTreeMap<[u32; 2], Vec<(u32, bool)>> = Default::default();
            for f in (0..made.mesh.facets.len()).filter(|&f| range.contains(&made.mesh.facets[f].face.0)) {
                let p = made.mesh.corner_positions(f);
                for k in 0..4 {
                    let (a, b) = (p[k], p[(k + 1) % 4]);
                    if a != b {
                        edges.entry([a.min(b), a.max(b)]).or_default().push((f as u32, a > b));
                    }
                }
            }
            for (e, uses) in edges.iter().filter(|(_, u)| u.len() != 2 || u[0].1 == u[1].1).take(8) {
                let p = e.map(|p| made.mesh.positions[p as usize].to_array());
                println!("  edge {e:?} {p:?} with {}", uses.len());
                for (f, _) in uses.iter().take(4) {
                    println!("    {}", show(made.mesh.facets[*f as usize].face.index()));
                    facet(made, *f as usize);
                }
                first += 1;
                if first > 40 {
                    return;
                }
            }
        }
    }
}

#[test]
#[ignore = "reads a folder of files, minutes"]
fn folder() {
    let folder = corpus();
    let reference: serde_json::Value = std::fs::read_to_string(folder.join("reference.json"))
        .ok()
        .and_then(|t| serde_json::from_str(&t).ok())
        .unwrap_or_default();
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let skip = std::env::var("LAMPYRIS_SKIP").unwrap_or_default();
    let measure = std::env::var("LAMPYRIS_MEASURE").is_ok();
    let mut found = Vec::new();
    files(&folder, &mut found);
    found.sort();
    let every = number("LAMPYRIS_EVERY").unwrap_or(1.0) as usize;
    let mut totals = Totals::default();
    for path in found.iter().skip(number("LAMPYRIS_START").unwrap_or(0.0) as usize).step_by(every.max(1)) {
        let text = path.to_string_lossy();
        let skipped = skip.split(',').any(|o| !o.is_empty() && text.contains(o));
        if skipped || !only.split(',').any(|o| text.contains(o)) {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let deflection = reference["files"][&*name]["linear_deflection_mm"].as_f64();
        let uniform = number("LAMPYRIS_TOLERANCE").or(deflection);
        let settings = uniform.map_or_else(Settings::default, Settings::uniform);
        one(path, &Settings { measure, ..settings }, &mut totals);
    }
    totals.slowest.sort_by(|a, b| b.0.total_cmp(&a.0));
    let t = &totals;
    println!("files {} not read {}", t.files, t.unread);
    println!("faces {} failed {} repaired {}", t.faces, t.failed, t.repaired);
    println!("shells closed {} of {}", t.closed, t.closed + t.open);
    let certified = 1.0 - t.unproved as f64 / t.facets.max(1) as f64;
    println!("facets {} certified {:.4} %", t.facets, 100.0 * certified);
    if measure {
        println!("over tolerance {} of them proved {}", t.over, t.over_proved);
    }
    t.slowest.iter().take(5).for_each(|(seconds, name)| println!("slowest {seconds:.2} s {name}"));
    assert_eq!(t.over_proved, 0, "a proved facet samples over its tolerance");
}

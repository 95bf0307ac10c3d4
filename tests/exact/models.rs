//! The exact intersector on trimmed models from STEP files: against pure clipping, and through edges of closed shells.

use crate::files::{corpus, fixture, step_files};
use crate::support::*;
use lampyris::intersect::exact::audit::Audit;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{Aabb, Point, Ray, Vector};
use lampyris::model::Model;
use std::path::{Path, PathBuf};

fn fixtures() -> Vec<PathBuf> {
    step_files(&fixture("step"))
}

/// Reads a number from the environment.
fn number(name: &str, or: u64) -> u64 {
    std::env::var(name).ok().and_then(|x| x.parse().ok()).unwrap_or(or)
}

fn read(path: &Path) -> Model {
    lampyris::step::read(path, &lampyris::step::Settings::default()).expect("readable").model
}

fn bounds(model: &Model) -> Aabb {
    model.placed_faces().filter_map(|p| p.face.map(|f| (f, p.placement))).fold(Aabb::EMPTY, |b, (f, place)| {
        b.union(Aabb::from_points(f.surface.points.iter().map(|p| place.point(p.project()))))
    })
}

/// A model on both paths.
struct Judged {
    name: String,
    exact: Exact,
    audit: Audit,
    bounds: Aabb,
}

/// Of rays: hits, flagged by the exact intersector, left open by clipping, and wrong.
type Counts = [usize; 4];

impl Judged {
    fn new(path: &Path) -> Self {
        let model = read(path);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let exact = Exact::build(&model, &Settings::default());
        Self { name, exact, audit: Audit::new(&model), bounds: bounds(&model) }
    }

    /// Rays that certainty and trims leave undisputed must find the same first hit as clipping does.
    fn against_audit(&self, n: usize, seed: u64) -> Counts {
        let mut s = Random(seed);
        let [mut hits, mut flagged, mut undecided, mut wrong] = Counts::default();
        for _ in 0..n {
            let ray = s.ray(self.bounds.center(), 0.5 * self.bounds.size());
            let answer = self.exact.first(&ray, &mut Cost::default());
            if answer.certainty != Certainty::Certified || answer.near_trim {
                flagged += 1;
                continue;
            }
            hits += usize::from(answer.hit.is_some());
            let clipped = self.audit.first(&ray);
            match (answer.hit, clipped.first) {
                // Where clipping itself is in doubt it can neither confirm nor refute.
                _ if !clipped.decided => undecided += 1,
                (None, None) => {}
                (Some(a), Some(b)) if (a.t - b.t).abs() < 1e-7 => {}
                (a, b) => {
                    println!("{}: {a:?} against {b:?} for {ray:?}", self.name);
                    wrong += 1;
                }
            }
        }
        [hits, flagged, undecided, wrong]
    }
}

#[test]
fn fixtures_against_clipping() {
    for path in fixtures() {
        let judged = Judged::new(&path);
        let n = 2000;
        let [hits, flagged, undecided, wrong] = judged.against_audit(n, 5);
        assert_eq!(wrong, 0, "{}", judged.name);
        assert!(hits > n / 10, "{}: {hits} hits", judged.name);
        assert!(flagged <= 1 && undecided <= 1, "{}: {flagged} flagged, {undecided} undecided", judged.name);
    }
}

#[test]
#[ignore = "half an hour for 1e8: LAMPYRIS_RAYS rays over the fixtures, 100,000 by default, from LAMPYRIS_SEED on"]
fn fixtures_against_clipping_at_length() {
    use rayon::prelude::*;
    let models: Vec<_> = fixtures().iter().map(|p| Judged::new(p)).collect();
    let (chunk, seed) = (500, number("LAMPYRIS_SEED", 1000));
    let chunks = number("LAMPYRIS_RAYS", 100_000) / chunk;
    let [hits, flagged, undecided, wrong] = (0..chunks)
        .into_par_iter()
        .map(|k| models[(k % models.len() as u64) as usize].against_audit(chunk as usize, seed + k))
        .reduce(Counts::default, |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
    let rays = chunks * chunk;
    println!("{rays} rays from seed {seed}: {hits} hits, {flagged} flagged, {undecided} undecided, {wrong} wrong");
    assert_eq!(wrong, 0);
    assert!(
        flagged as u64 * 1000 <= rays && undecided as u64 * 1000 <= rays,
        "{flagged} flagged, {undecided} undecided"
    );
}

#[test]
#[ignore = "minutes: every corpus model that reads, LAMPYRIS_RAYS rays each, 100,000 by default"]
fn corpus_against_clipping() {
    use rayon::prelude::*;
    let folder = corpus();
    if !folder.is_dir() {
        println!("no corpus at {}: nothing tested", folder.display());
        return;
    }
    let (rays, chunk, mut all) = (number("LAMPYRIS_RAYS", 100_000), 1000, 0);
    for path in step_files(&folder) {
        let Ok(import) = lampyris::step::read(&path, &lampyris::step::Settings::default()) else { continue };
        if Exact::build(&import.model, &Settings::default()).patch_count() == 0 {
            continue;
        }
        let judged = Judged::new(&path);
        let [hits, flagged, undecided, wrong] = (0..rays.div_ceil(chunk))
            .into_par_iter()
            .map(|k| judged.against_audit(chunk as usize, 7000 + k))
            .reduce(Counts::default, |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
        println!("{}: {hits} hits, {flagged} flagged, {undecided} undecided, {wrong} wrong", judged.name);
        all += wrong;
    }
    assert_eq!(all, 0);
}

/// Rays through random points of edges of closed shells, and through their vertices.
fn through_edges(name: &str, model: &Model, n: usize) -> (usize, usize, usize) {
    let exact = Exact::build(model, &Settings::default());
    let mut s = Random(17);
    let closed =
        |part: usize| model.parts[part].shells.iter().all(|s| s.closed) && !model.parts[part].shells.is_empty();
    let mut edges = Vec::new();
    for instance in &model.instances {
        let part = instance.part.0 as usize;
        if closed(part) {
            edges.extend(model.parts[part].edges.iter().map(|e| (e, &instance.placement)));
        }
    }
    if edges.is_empty() {
        return (0, 0, 0);
    }
    let reach = 4.0 * bounds(model).diagonal();
    let (mut odd, mut flagged) = (0, 0);
    for k in 0..n {
        let (edge, placement) = edges[(s.unit() * edges.len() as f64) as usize];
        let [a, b] = edge.curve.domain();
        let target: Point = placement.point(edge.curve.evaluate(s.within(a, b)));
        // A third passes by at distances down to a micrometre's thousandth.
        let off: Vector = if k % 3 == 0 { s.direction() * 10f64.powf(s.within(-12.0, -5.0)) } else { Vector::ZERO };
        let d = s.direction();
        let ray = Ray::new(target + off - d * reach, d);
        let crossings = exact.crossings(&ray, &mut Cost::default());
        if crossings.iter().any(|h| h.certainty != Certainty::Certified) {
            flagged += 1;
        } else if crossings.len() % 2 == 1 {
            odd += 1;
            if std::env::var("SHOW").is_ok() {
                println!("{name}: target {target:?} off {off:?} d {d:?} edge #{:?}", edge.entity);
                for c in &crossings {
                    println!("   t {:.9} face {:?} uv {:?} n.d {:.4}", c.t - reach, c.face, c.uv, c.normal.dot(d));
                }
            }
        }
    }
    (n, odd, flagged)
}

#[test]
fn rays_through_edges_of_closed_shells_find_exactly_one_face() {
    let mut worst = Vec::new();
    for path in fixtures() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let (n, odd, flagged) = through_edges(&name, &read(&path), 3000);
        println!("{name}: {n} rays, {odd} odd, {flagged} flagged");
        if odd > 0 || flagged * 20 > n {
            worst.push(format!("{name}: {odd} of {n} odd, {flagged} flagged"));
        }
    }
    assert!(worst.is_empty(), "{worst:?}");
}

#[test]
#[ignore = "minutes: every corpus model that reads, 20,000 rays each"]
fn corpus_certificates() {
    let folder = corpus();
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("no corpus at {}: nothing tested", folder.display());
        return;
    };
    let mut files: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    let only = std::env::var("ONLY").unwrap_or_default();
    let (mut rays, mut flagged, mut edge_rays, mut odd) = (0, 0, 0, 0);
    for path in files.iter().filter(|p| p.extension().is_some_and(|e| e == "stp" || e == "step")) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.contains(&only) {
            continue;
        }
        let Ok(import) = lampyris::step::read(path, &lampyris::step::Settings::default()) else { continue };
        let model = import.model;
        if model.placed_face_count() == 0 {
            continue;
        }
        let exact = Exact::build(&model, &Settings::default());
        if exact.patch_count() == 0 {
            // Ready meshes alone: nothing to be exact about.
            continue;
        }
        let b = bounds(&model);
        let mut s = Random(3);
        let start = std::time::Instant::now();
        let mut cost = Cost::default();
        let n = 20_000;
        let mut bad = 0;
        for _ in 0..n {
            let ray = s.ray(b.center(), 0.5 * b.size());
            let answer = exact.first(&ray, &mut cost);
            if answer.certainty == Certainty::Uncertified {
                bad += 1;
                if std::env::var("SHOW").is_ok() && bad < 4 {
                    println!("   {:?} {ray:?}", answer.hit);
                }
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        let (m, o, f) = through_edges(&name, &model, 2000);
        println!(
            "{name:44} faces {:6} patches {:6} leaves {:7} build {:6.2} s {:8.0} rays/s tests {:5.2} uncertified {bad} | edges {m}: odd {o}, flagged {f}",
            model.placed_face_count(),
            exact.patch_count(),
            exact.leaf_count(),
            exact_seconds(&exact),
            n as f64 / seconds,
            cost.tests as f64 / n as f64
        );
        rays += n;
        flagged += bad;
        edge_rays += m;
        odd += o;
    }
    println!("{flagged} of {rays} uncertified; {odd} of {edge_rays} rays through edges of closed shells odd");
    assert!(flagged * 100_000 <= rays, "{flagged} of {rays} uncertified");
}

fn exact_seconds(exact: &Exact) -> f64 {
    use lampyris::intersect::Intersector;
    exact.footprint().build_seconds
}

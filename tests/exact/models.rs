//! The exact intersector on trimmed models from STEP files, against pure clipping; and the share of rays that it certifies.

use crate::files::{corpus, fixture, read_model, step_files};
use crate::support::*;
use lampyris::intersect::exact::audit::Audit;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost, Intersector};
use lampyris::math::{Aabb, Ray};
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

/// Of rays: how many, uncertified, tangent, and beside a trim.
type Flags = [usize; 4];

/// Rays toward a model from all around, and from each place that they meet one to every side.
fn flags_on_model(exact: &Exact, b: Aabb, rays: u64, seed: u64) -> Flags {
    let shows = std::env::var("LAMPYRIS_SHOW").is_ok();
    let (mut s, mut flags) = (Random(seed), Flags::default());
    for _ in 0..rays.div_ceil(2) {
        let first = s.ray(b.center(), 0.5 * b.size());
        let mut next = Some(first);
        for _ in 0..2 {
            let Some(ray) = next.take() else { continue };
            let answer = exact.first(&ray, &mut Cost::default());
            let is = |certainty| answer.certainty == certainty;
            let [open, tangent] = [is(Certainty::Uncertified), is(Certainty::Tangent)];
            let found = [true, open, tangent, answer.near_trim];
            flags = std::array::from_fn(|k| flags[k] + usize::from(found[k]));
            if shows && open {
                println!("   {:?} {ray:?}", answer.hit);
            }
            next =
                answer.hit.map(|hit| Ray::new(ray.point_at(hit.t), s.direction()).with_departure(hit.departure()));
        }
    }
    flags
}

#[test]
#[ignore = "minutes: every corpus model that reads, LAMPYRIS_RAYS rays each, 20,000 by default, from LAMPYRIS_SEED on"]
fn corpus_rays_are_certified() {
    use rayon::prelude::*;
    let folder = corpus();
    if !folder.is_dir() {
        println!("no corpus at {}: nothing tested", folder.display());
        return;
    }
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let (wanted, seed, chunk) = (number("LAMPYRIS_RAYS", 20_000), number("LAMPYRIS_SEED", 3), 1000);
    let sum = |a: Flags, b: Flags| std::array::from_fn(|k| a[k] + b[k]);
    let mut all = Flags::default();
    for path in step_files(&folder).iter().filter(|path| path.to_string_lossy().contains(&only)) {
        let Some(model) = read_model(path) else { continue };
        let exact = Exact::build(&model, &Settings::default());
        if exact.patch_count() == 0 {
            // Ready meshes alone: nothing to be exact about.
            continue;
        }
        let b = bounds(&model);
        let start = std::time::Instant::now();
        let flags = (0..wanted.div_ceil(chunk))
            .into_par_iter()
            .map(|k| flags_on_model(&exact, b, chunk, seed + k))
            .reduce(Flags::default, sum);
        let [rays, open, tangent, near_trim] = flags;
        println!(
            "{:44} faces {:6} patches {:6} build {:6.2} s {:8.0} rays/s: of {rays} rays {open} uncertified, {tangent} tangent, {near_trim} \
             beside a trim",
            path.file_name().unwrap().to_string_lossy(),
            model.placed_face_count(),
            exact.patch_count(),
            exact.footprint().build_seconds,
            rays as f64 / start.elapsed().as_secs_f64(),
        );
        all = sum(all, flags);
    }
    let [rays, open, tangent, near_trim] = all;
    println!("of {rays} rays {open} uncertified, {tangent} tangent, {near_trim} beside a trim");
    assert!(open * 100_000 <= rays, "{open} of {rays} uncertified");
}

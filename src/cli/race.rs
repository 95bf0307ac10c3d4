//! `lampyris study bvh`: the octree against obvhs' hierarchies on the same facets and rays, in alternating rounds.

use super::context::Context;
use super::options::Tracing;
use super::{Failure, demo, load};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::octree::{self, Octree};
use crate::intersect::{Cost, Hit, Intersector};
use crate::math::Ray;
use crate::report::{figures, grouped};
use crate::study::Progress;
use crate::study::check::{Competitor, measure};
use crate::study::rays::{Bounces, Camera, RaySource, Uniform};
use crate::tessellate::{self, tessellate};
use serde_json::{Value, json};
use std::path::Path;

/// Tolerances, mm: some thousand, ten thousand and hundred thousand facets on a lamp.
const TOLERANCES: [f64; 3] = [0.1, 0.01, 0.001];
/// Rays of a round, and rounds.
const RAYS: u64 = 50_000;
const ROUNDS: usize = 5;

pub(super) fn run(
    file: Option<&Path>,
    tracing: &Tracing,
    context: &Context,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(Vec<Value>, String), Failure> {
    let loaded = match file {
        None => demo::lamp()?.1,
        Some(path) => match load::either(path, context)? {
            load::Input::Step(loaded) | load::Input::Scene(_, loaded) => loaded,
        },
    };
    let name = file.map_or("three-cavity lamp".into(), |p| p.display().to_string());
    let count = tracing.rays.unwrap_or(RAYS);
    let seed = tracing.seed.unwrap_or(1);
    let mut rows = Vec::new();
    for (k, tolerance) in TOLERANCES.into_iter().enumerate() {
        let done = k as f64 / TOLERANCES.len() as f64;
        progress(Progress { stage: format!("{tolerance} mm"), done, remaining_seconds: None });
        let mesh = tessellate(&loaded.model, &tessellate::Settings::uniform(tolerance)).mesh;
        let octree = Octree::build(&mesh, &octree::Settings::default());
        let textbook = Octree::build(&mesh, &octree::Settings::textbook());
        let binary = Bvh::build(&mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..Default::default() });
        let cured = Bvh::build(&mesh, &bvh::Settings::default());
        let shipped = Bvh::build(&mesh, &bvh::Settings { cured: false, ..Default::default() });
        let slow = bvh::Settings { quality: bvh::Quality::VerySlow, ..Default::default() };
        let slow = Bvh::build(&mesh, &slow);
        let entrants: [(&str, &str, &dyn Intersector); 6] = [
            ("octree", "T = 128", &octree),
            ("octree, textbook", "T = 8", &textbook),
            ("bvh2", "medium", &binary),
            ("cwbvh", "medium", &cured),
            ("cwbvh", "very slow", &slow),
            ("cwbvh as shipped", "medium", &shipped),
        ];
        let bounds = mesh.bounds();
        let bounces = Bounces::new(&bounds, &octree, 4.0 * tolerance, seed, count);
        let kinds: [(&str, Vec<Ray>); 3] = [
            ("coherent", Camera::new(&bounds, count).rays(0..count)),
            ("incoherent", bounces.rays(0..count)),
            ("adversarial", edges(&mesh, &bounds, seed, count)),
        ];
        for (kind, rays) in &kinds {
            let truth = answers(&octree, rays);
            for (call, batch) in [("batch", true), ("single", false)] {
                let competitors: Vec<Competitor> =
                    entrants.iter().map(|(name, _, who)| Competitor { name, who: *who, batch }).collect();
                let timings = measure(&competitors, rays, ROUNDS);
                for ((name_of, build, who), (_, t)) in entrants.iter().zip(timings) {
                    let mut cost = Cost::default();
                    let mut hits = vec![None; rays.len()];
                    who.intersect_batch(rays, &mut hits, &mut cost);
                    let footprint = who.footprint();
                    let rate = |seconds: f64| rays.len() as f64 / seconds.max(1e-12) / 1e6;
                    rows.push(json!({
                        "model": name, "facets": mesh.facets.len(), "intersector": name_of, "build": build,
                        "rays_kind": kind, "call": call, "threads": 1,
                        "mrays_per_s_min": rate(t.p90), "mrays_per_s_median": rate(t.median), "mrays_per_s_p90": rate(t.min),
                        "build_seconds": footprint.build_seconds,
                        "bytes_per_facet": footprint.bytes as f64 / mesh.facets.len().max(1) as f64,
                        "nodes_per_ray": cost.nodes as f64 / rays.len() as f64,
                        "tests_per_ray": cost.tests as f64 / rays.len() as f64,
                        "wrong": differing(&truth, &hits),
                    }));
                }
            }
        }
    }
    let answer = sentence(&rows);
    Ok((rows, answer))
}

/// Random rays aimed at corners and at points of edges, where careless tests leak.
fn edges(mesh: &crate::mesh::FacetMesh, bounds: &crate::math::Aabb, seed: u64, count: u64) -> Vec<Ray> {
    let random = Uniform::new(bounds, seed ^ 0xad5e, count).rays(0..count);
    let facets = mesh.facets.len().max(1);
    (random.into_iter().enumerate())
        .filter_map(|(k, ray)| {
            if mesh.facets.is_empty() {
                return Some(ray);
            }
            let corners = mesh.corners(k.wrapping_mul(7919) % facets);
            let target = if k % 2 == 0 { corners[k % 4] } else { 0.5 * (corners[k % 4] + corners[(k + 1) % 4]) };
            Ray::through(ray.origin, target)
        })
        .collect()
}

fn answers(who: &dyn Intersector, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    who.intersect_batch(rays, &mut hits, &mut Cost::default());
    hits
}

/// Rays that hit only one of the two, or at distances that differ by more than single precision explains.
fn differing(truth: &[Option<Hit>], hits: &[Option<Hit>]) -> usize {
    let same = |(a, b): &(&Option<Hit>, &Option<Hit>)| match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => (a.t - b.t).abs() <= 1e-4 * (1.0 + a.t.abs()),
        _ => false,
    };
    truth.iter().zip(hits).filter(|pair| !same(pair)).count()
}

fn sentence(rows: &[Value]) -> String {
    let most = rows.iter().filter_map(|r| r["facets"].as_u64()).max().unwrap_or(0);
    let rate = |name: &str, build: &str, call: &str| {
        let fits = |r: &&Value| {
            r["facets"] == most
                && r["intersector"] == name
                && r["build"] == build
                && r["call"] == call
                && r["rays_kind"] == "incoherent"
        };
        rows.iter().find(fits).and_then(|r| r["mrays_per_s_median"].as_f64()).unwrap_or(f64::NAN)
    };
    let (octree, cwbvh) = (rate("octree", "T = 128", "batch"), rate("cwbvh as shipped", "medium", "single"));
    format!(
        "With {} facets and incoherent rays on one thread the octree answers **{} million rays/s**, obvhs' CwBvh as shipped {}: \
         **{} ×** (medians of {ROUNDS} alternating rounds).",
        grouped(most),
        figures(octree, 3),
        figures(cwbvh, 3),
        figures(octree / cwbvh, 3)
    )
}

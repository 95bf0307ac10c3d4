//! How does the time of a ray grow with the number of facets? One lamp, its facets cut finer and finer, the same rays.
//!
//! One element is one ray of a path of three to eight bounces inside the lamp, answered in a batch. The largest size, 20 million
//! facets, takes 7 GB: it is run when `LAMPYRIS_LARGE` is set.

// The bench uses a part of what the tests share.
#[allow(dead_code)]
#[path = "../tests/intersect/support.rs"]
mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lampyris::intersect::octree::{Octree, Settings};
use lampyris::intersect::{Cost, Hit, Intersector};
use support::{lamp, paths, refined};

fn growth(c: &mut Criterion) {
    let (coarse, sources) = lamp(20_000);
    let rays = paths(&Octree::build(&coarse, &Settings::default()), &sources, 100_000);
    let mut group = c.benchmark_group("growth");
    group.throughput(Throughput::Elements(rays.len() as u64)).sample_size(10);
    let large = std::env::var_os("LAMPYRIS_LARGE").is_some();
    for cuts in [1, 3, 10, 32] {
        if cuts == 32 && !large {
            continue;
        }
        let mesh = refined(&coarse, cuts);
        let octree = Octree::build(&mesh, &Settings::default());
        let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
        let mut cost = Cost::default();
        octree.intersect_batch(&rays, &mut hits, &mut cost);
        let per_ray = |n: u64| n as f64 / rays.len() as f64;
        let footprint = octree.footprint();
        println!(
            "{} facets: built in {:.2} s, {:.0} B a facet, {:.2} nodes and {:.2} tests a ray",
            mesh.facets.len(),
            footprint.build_seconds,
            footprint.bytes as f64 / mesh.facets.len() as f64,
            per_ray(cost.nodes),
            per_ray(cost.tests)
        );
        group.bench_function(BenchmarkId::new("octree", mesh.facets.len()), |b| {
            b.iter(|| octree.intersect_batch(&rays, &mut hits, &mut Cost::default()));
        });
    }
    group.finish();
}

criterion_group!(benches, growth);
criterion_main!(benches);

//! How many incoherent rays a second: octree against obvhs' CwBvh on the same facets of a lamp and the same rays?
//!
//! One element is one ray of a path of three to eight bounces; all structures answer with normals. Larger lamps, Embree and all
//! threads: `lampyris study bvh`.

// The bench uses a part of what the tests share.
#[allow(dead_code)]
#[path = "../tests/intersect/support.rs"]
mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{Octree, Settings};
use lampyris::intersect::{Cost, Hit, Intersector};
use support::{lamp, paths};

fn incoherent(c: &mut Criterion) {
    for facets in [20_000, 200_000] {
        let (mesh, sources) = lamp(facets);
        let octree = Octree::build(&mesh, &Settings::default());
        let shipped = Bvh::build(&mesh, &bvh::Settings { cured: false, ..Default::default() });
        let cured = Bvh::build(&mesh, &bvh::Settings::default());
        let rays = paths(&octree, &sources, 50_000);
        let mut group = c.benchmark_group("incoherent");
        group.throughput(Throughput::Elements(rays.len() as u64)).sample_size(10);
        let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
        let entrants: [(&str, &dyn Intersector); 3] =
            [("octree", &octree), ("CwBvh as shipped", &shipped), ("CwBvh cured", &cured)];
        for (name, structure) in entrants {
            group.bench_function(BenchmarkId::new(name, mesh.facets.len()), |b| {
                b.iter(|| structure.intersect_batch(&rays, &mut hits, &mut Cost::default()));
            });
        }
        group.bench_function(BenchmarkId::new("octree, one by one", mesh.facets.len()), |b| {
            b.iter(|| rays.iter().filter_map(|r| octree.intersect(r, &mut Cost::default())).count());
        });
        group.finish();
    }
}

criterion_group!(benches, incoherent);
criterion_main!(benches);

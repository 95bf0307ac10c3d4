//! What do long thin facets and very different sizes cost? A pot of centimetres in a stadium of hundreds of metres, with rows of
//! seats and cables across: octree against obvhs' CwBvh as shipped.
//!
//! One element is one ray of a path of three to eight bounces.

// The bench uses a part of what the tests share.
#[allow(dead_code)]
#[path = "../tests/intersect/support.rs"]
mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{Octree, Settings};
use lampyris::intersect::{Cost, Hit, Intersector};
use support::{paths, stadium};

fn uneven(c: &mut Criterion) {
    let (mesh, sources) = stadium(200_000);
    let octree = Octree::build(&mesh, &Settings::default());
    let thin = Octree::build(&mesh, &Settings { threshold: 64, ..Settings::default() });
    let shipped = Bvh::build(&mesh, &bvh::Settings { cured: false, ..Default::default() });
    let rays = paths(&octree, &sources, 20_000);
    let mut group = c.benchmark_group("uneven");
    group.throughput(Throughput::Elements(rays.len() as u64)).sample_size(10);
    let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
    let entrants: [(&str, &dyn Intersector); 3] =
        [("octree", &octree), ("octree, T = 64", &thin), ("CwBvh as shipped", &shipped)];
    for (name, structure) in entrants {
        let footprint = structure.footprint();
        let bytes = footprint.bytes as f64 / mesh.facets.len() as f64;
        println!("{name}: built in {:.2} s, {bytes:.0} B a facet", footprint.build_seconds);
        group.bench_function(BenchmarkId::new(name, mesh.facets.len()), |b| {
            b.iter(|| structure.intersect_batch(&rays, &mut hits, &mut Cost::default()));
        });
    }
    group.finish();
}

criterion_group!(benches, uneven);
criterion_main!(benches);

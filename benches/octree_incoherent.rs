//! How many incoherent rays a second: octree against obvhs' CwBvh on the same facets of a lamp and the same rays?
//!
//! One element is one ray of a path of three to eight bounces; all structures answer with normals. Larger lamps, Embree and all
//! threads: `lampyris study bvh`.

#[path = "../tests/intersector_common/mod.rs"]
mod intersector_common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use intersector_common::{Random, lamp};
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{Octree, Settings};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Departure, Point, Ray};

/// Paths from the sources: each ray leaves the hit before it to a random side.
fn paths(tree: &dyn Intersector, sources: &[Point], count: usize) -> Vec<Ray> {
    let mut r = Random(0x9E37_79B9_7F4A_7C15);
    let mut rays = Vec::with_capacity(count);
    let mut path = 0;
    while rays.len() < count {
        let mut ray = Ray::new(sources[path % sources.len()] + r.direction() * 0.3, r.direction());
        path += 1;
        for _ in 0..3 + r.below(6) {
            rays.push(ray);
            let Some(hit) = tree.intersect(&ray, &mut Cost::default()) else { break };
            let side = if hit.geometric_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
            let n = hit.geometric_normal * if r.unit() < 0.6 { side } else { -side };
            let direction = (n + r.direction() * 0.999).normalize();
            let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
            ray = Ray::new(ray.at(hit.t), direction).leaving(from);
        }
    }
    rays.truncate(count);
    rays
}

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

//! Hierarchies of other authors see the facets that the octree sees, up to their own precision.

use crate::support::*;
use lampyris::intersect::contenders::{BinaryBvh, Embree, EmbreeLibrary, Parry, Primitives};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Point, Ray};
use lampyris::mesh::FacetMesh;
use lampyris::study::rays::RaySource;
use lampyris::study::surface_rays::SurfacePaths;
use std::path::Path;

/// Half the size of the heap, mm.
const SIZE: f64 = 10.0;
/// What f32 leaves of a distance, in its own size: starts, directions and corners are rounded, and grazing hits are less accurate.
const SINGLE: f64 = 1e-4;

/// Rays that hit otherwise than the octree's, which are `rays` long.
fn differing(octree: &Octree, other: &dyn Intersector, rays: &[Ray]) -> usize {
    let ask = |intersector: &dyn Intersector| -> Vec<Option<Hit>> {
        let mut hits = vec![None; rays.len()];
        intersector.intersect_batch(rays, &mut hits, &mut Cost::default());
        hits
    };
    let same = |(a, b): &(&Option<Hit>, &Option<Hit>)| match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let normals = a.geometric_normal.dot(b.geometric_normal);
            (a.t - b.t).abs() <= SINGLE * (SIZE + a.t) && (a.facet() != b.facet() || (normals - 1.0).abs() < SINGLE)
        }
        _ => false,
    };
    let (ours, theirs) = (ask(octree), ask(other));
    ours.iter().zip(&theirs).filter(|pair| !same(pair)).count()
}

trait FacetOfHit {
    fn facet(&self) -> (u32, bool);
}

impl FacetOfHit for Hit {
    fn facet(&self) -> (u32, bool) {
        (self.primitive, self.triangle == Some(lampyris::math::QuadHalf::Second))
    }
}

/// Rays from all around into the heap.
fn outer_rays(count: usize) -> Vec<Ray> {
    let mut random = Random(5);
    (0..count)
        .map(|_| {
            let target =
                Point::new(random.within(-SIZE, SIZE), random.within(-SIZE, SIZE), random.within(-SIZE, SIZE));
            Ray::from_points(random.direction() * (3.0 * SIZE), target).unwrap()
        })
        .collect()
}

/// Asks rays from outside and such that start on facets, and says which share of either is answered otherwise than by the octree.
fn shares_that_differ(mesh: &FacetMesh, other: &dyn Intersector) -> [f64; 2] {
    let octree = Octree::build(mesh, &octree::Settings::default());
    let surface = SurfacePaths::new(mesh, &octree, 9, 4000).rays(0..4000);
    [outer_rays(4000), surface].map(|rays| differing(&octree, other, &rays) as f64 / rays.len() as f64)
}

#[test]
fn they_answer_as_the_octree_but_for_rounding() {
    let mesh = heap(700, SIZE, 1.5, 7);
    // In f64 none may differ from outside. Starts on facets it takes for what they are, rounded: a neighbour at a concave edge is met
    // or not by a hair, as in f32.
    let [outside, surface] = shares_that_differ(&mesh, &BinaryBvh::build(&mesh));
    assert!(outside == 0.0 && surface < 5e-3, "{outside} {surface}");
    let [outside, surface] = shares_that_differ(&mesh, &Parry::build(&mesh));
    assert!(outside < 1e-3 && surface < 5e-3, "{outside} {surface}");
}

#[test]
fn they_answer_nothing_over_nothing() {
    let mesh = FacetMesh::default();
    let ray = outer_rays(1)[0];
    assert_eq!(BinaryBvh::build(&mesh).intersect(&ray, &mut Cost::default()), None);
    assert_eq!(Parry::build(&mesh).intersect(&ray, &mut Cost::default()), None);
}

#[test]
fn a_file_that_is_no_library_is_refused_by_name() {
    let error = EmbreeLibrary::open(Path::new("Cargo.toml")).err().unwrap().to_string();
    assert!(error.contains("Cargo.toml cannot be used as Embree"), "{error}");
}

#[test]
#[ignore = "needs Embree 4: LAMPYRIS_EMBREE names its library"]
fn embree_answers_as_the_octree_but_for_rounding() {
    let path = std::env::var_os("LAMPYRIS_EMBREE").expect("LAMPYRIS_EMBREE, the path of libembree4");
    let library = EmbreeLibrary::open(path.as_ref()).unwrap();
    let mesh = heap(700, SIZE, 1.5, 7);
    for primitives in [Primitives::Triangles, Primitives::Quads] {
        let embree = Embree::build(&library, path.as_ref(), &mesh, primitives).unwrap();
        let [outside, surface] = shares_that_differ(&mesh, &embree);
        assert!(outside < 1e-3 && surface < 5e-3, "{primitives:?}: {outside} {surface}");
        assert!(embree.footprint().bytes > 0);
    }
}

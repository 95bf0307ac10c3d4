//! Parts that are placed often answer as the same facets in one mesh.

use crate::support::*;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::instanced::Instanced;
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Cost, ExpectedRays, Hit, Intersector};
use lampyris::math::{Frame, Point, Ray, Vector};
use lampyris::model::{Face, Instance, Instancing, Model, Part, PartId, Shell};
use lampyris::nurbs::sweep;
use lampyris::tessellate::{GroupedFacets, Settings, tessellate};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Half a torus of two faces with its ends open, so that rays pass into it, and a ball.
fn parts() -> Vec<Part> {
    let frame = Frame::IDENTITY;
    let part = |name: &str, surfaces: Vec<_>| {
        let shell = Shell { faces: surfaces.into_iter().map(Face::whole).collect(), ..Shell::default() };
        Part { name: name.into(), shells: vec![shell], ..Part::default() }
    };
    let arch = |u: [f64; 2]| sweep::torus(&frame, 2.0, 0.7, u, [0.0, TAU]);
    vec![
        part("arch", vec![arch([0.0, 1.5]), arch([1.5, 3.0])]),
        part("ball", vec![sweep::sphere(&frame, 1.5, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2])]),
    ]
}

/// Where parts stand so close that their boxes meet, some in each other.
const CLOSE: f64 = 5.0;
/// Where no box meets another.
const APART: f64 = 25.0;

/// Parts on a grid, turned anyhow, some mirrored, some of double size, and a few that stand once.
fn array(middle: Point, pitch: f64, count: usize) -> Model {
    let mut r = Random(5);
    let mut model = Model { parts: parts(), ..Model::default() };
    for k in 0..count {
        let at = middle + pitch * Vector::new((k % 6) as f64, (k / 6 % 6) as f64, (k / 36) as f64);
        let (axis, hint) = (r.direction(), r.direction());
        let mut placement = Frame::from_axis(at, axis, Some(hint));
        if k % 5 == 0 {
            placement.x = -placement.x;
        }
        // Each size often enough, but for a few.
        placement.scale = if k % 50 == 7 { 1.3 } else { [1.0, 2.0][k / 2 % 2] };
        let part = PartId((k % 2) as u32);
        model.instances.push(Instance { name: String::new(), path: String::new(), part, placement, colour: None });
    }
    model
}

struct Scene {
    model: Model,
    instancing: Arc<Instancing>,
    settings: Settings,
}

impl Scene {
    fn new(middle: Point) -> Self {
        let scene = Self::of_model(array(middle, APART, 400), 1e-3);
        assert_eq!((scene.instancing.groups.len(), scene.instancing.groups[0].instances.len()), (5, 8));
        scene
    }

    fn of_model(model: Model, glue_mm: f64) -> Self {
        let instancing = Arc::new(Instancing::new(&model, glue_mm).unwrap());
        Self { model, instancing, settings: Settings::uniform(0.05) }
    }

    fn facets(&self) -> GroupedFacets {
        let groups = self.instancing.groups.iter().enumerate();
        let mesh = |(k, group)| tessellate(group, &self.settings.of_group(&self.instancing, k));
        GroupedFacets { groups: groups.map(mesh).collect(), instancing: Some(self.instancing.clone()) }
    }

    fn octrees<'m>(&'m self, facets: &'m GroupedFacets) -> Vec<Octree<'m>> {
        let octree = |(k, mesh)| {
            let settings = octree::Settings { farthest_start: self.instancing.reach(k), ..Default::default() };
            Octree::build(mesh, &settings)
        };
        facets.meshes().enumerate().map(octree).collect()
    }

    fn splines(&self) -> Vec<Exact> {
        let spline = |(k, group)| {
            let settings = exact::Settings { farthest_start: self.instancing.reach(k), ..Default::default() };
            Exact::build(group, &settings)
        };
        self.instancing.groups.iter().enumerate().map(spline).collect()
    }

    fn instanced<'a, T: Intersector + 'a>(&'a self, groups: impl IntoIterator<Item = T>) -> Instanced<'a> {
        let boxed = |g| Box::new(g) as Box<dyn Intersector>;
        Instanced::new(&self.instancing, groups.into_iter().map(boxed).collect())
    }

    fn rays(&self, count: usize) -> Vec<Ray> {
        let mut r = Random(17);
        let places: Vec<Point> = self.model.instances.iter().map(|i| i.placement.origin).collect();
        (0..count)
            .map(|k| {
                // On no surface: the radii are 1.5, 1.95 and 3.
                let spot = |r: &mut Random| places[r.below(places.len())] + r.direction() * 2.7;
                let origin = spot(&mut r) + r.direction() * [0.0, 30.0, 300.0][k % 3];
                let ray = Ray::from_points(origin, spot(&mut r)).unwrap();
                if k % 7 == 0 { ray.with_range(2.0, 20.0) } else { ray }
            })
            .collect()
    }
}

/// One by one and in a batch: the same bits.
fn ask(intersector: &dyn Intersector, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    let mut cost = Cost::default();
    intersector.intersect_batch(rays, &mut hits, &mut cost);
    assert_eq!(cost.rays, rays.len() as u64);
    for (ray, hit) in rays.iter().zip(&hits) {
        assert_eq!(intersector.intersect(ray, &mut Cost::default()), *hit, "{ray:?}");
    }
    hits
}

/// Rays on which two answers differ by more than rounding; those that pass an edge within it may.
fn differences(rays: &[Ray], one: &[Option<Hit>], other: &[Option<Hit>], size: f64) -> usize {
    let differ = |((ray, a), b): ((&Ray, &Option<Hit>), &Option<Hit>)| match (a, b) {
        (None, None) => false,
        (Some(a), Some(b)) => {
            let sine = a.geometric_normal.dot(ray.direction).abs().max(1e-3);
            let is_near = (a.t - b.t).abs() <= 1e-12 * size / sine;
            !is_near || a.face != b.face || a.normal.distance(b.normal) > 1e-10 * size / sine
        }
        _ => true,
    };
    rays.iter().zip(one).zip(other).filter(|x| differ(*x)).count()
}

#[test]
fn instances_answer_as_one_mesh() {
    for middle in [Point::ZERO, Point::new(3e4, -2e4, 1e4)] {
        let size = 300.0 + middle.length();
        let scene = Scene::new(middle);
        let facets = scene.facets();
        let flat = facets.whole();
        assert_eq!(facets.facet_count(), flat.facets.len());
        assert!(facets.bytes() < flat.bytes() / 10);
        let instanced = scene.instanced(scene.octrees(&facets));
        let rays = scene.rays(3000);
        let [ours, one] = [ask(&instanced, &rays), ask(&Octree::build(&flat, &Default::default()), &rays)];
        assert!(ours.iter().flatten().count() > 1500);
        assert_eq!(differences(&rays, &ours, &one, size), 0);
        // And on from there, along the mirrored ray.
        let on: Vec<[Ray; 2]> = (rays.iter().zip(ours.iter().zip(&one)))
            .filter_map(|(ray, (a, b))| Some([(*a)?, (*b)?].map(|hit| reflected(ray, &hit))))
            .collect();
        let [from_ours, from_one] = [0, 1].map(|k| on.iter().map(|rays| rays[k]).collect::<Vec<_>>());
        let [ours, one] = [ask(&instanced, &from_ours), ask(&Octree::build(&flat, &Default::default()), &from_one)];
        assert_eq!(differences(&from_ours, &ours, &one, 10.0 * size), 0);
    }
}

/// Rays that leave parts among others, and which of them a structure knows to be free once it expects rays.
#[test]
fn what_leaves_a_part_meets_what_it_meets_in_one_mesh() {
    for (pitch, every_size_is_frequent) in [(CLOSE, false), (CLOSE, true), (APART, true)] {
        let mut model = array(Point::new(20.0, -7.0, 3.0), pitch, 400);
        if every_size_is_frequent {
            model.instances.iter_mut().for_each(|i| i.placement.scale = 1.0);
        }
        let scene = Scene::of_model(model, 0.0);
        let (facets, size) = (scene.facets(), 300.0);
        let whole = facets.whole();
        let flat = Octree::build(&whole, &Default::default());
        let [instanced, expecting] = [0, 1].map(|_| scene.instanced(scene.octrees(&facets)));
        expecting.prepare_for(&ExpectedRays { rays: u64::MAX, threads: 1, beams: &[], sag: 0.0 });
        let mut rays = scene.rays(2000);
        // A ray leaves a facet, which has another number in one mesh.
        let mut in_one_mesh = rays.clone();
        let mut escaped = 0;
        for bounce in 0..5 {
            let [ours, one] = [ask(&instanced, &rays), ask(&flat, &in_one_mesh)];
            assert_eq!(differences(&rays, &ours, &one, 10.0 * size), 0, "bounce {bounce} at {pitch} mm");
            // Often enough that free cones are laid.
            for _ in 0..10 {
                for (ray, hit) in rays.iter().zip(&ours).filter(|(ray, _)| expecting.escapes(ray)) {
                    assert!(hit.is_none(), "{ray:?} meets {hit:?}");
                    escaped += 1;
                }
            }
            assert_eq!(ours, ask(&expecting, &rays), "what is known beforehand changes no answer");
            let on = rays.iter().zip(&in_one_mesh).zip(ours.iter().zip(&one));
            let on = on.filter_map(|((a, b), (x, y))| Some((reflected(a, &(*x)?), reflected(b, &(*y)?))));
            (rays, in_one_mesh) = on.unzip();
        }
        // Whatever leaves may meet what stands once.
        assert_eq!(escaped > 0, every_size_is_frequent && pitch == APART, "{escaped} at {pitch} mm");
    }
}

fn reflected(ray: &Ray, hit: &Hit) -> Ray {
    let (d, n) = (ray.direction, hit.geometric_normal);
    Ray::new(ray.point_at(hit.t), (d - n * (2.0 * d.dot(n))).normalize()).with_departure(hit.departure())
}

#[test]
fn splines_and_polished_hits_are_those_of_the_whole_model() {
    let scene = Scene::new(Point::new(300.0, 20.0, -100.0));
    let (facets, splines) = (scene.facets(), scene.splines());
    let rays = scene.rays(700);
    let whole = Exact::build(&scene.model, &exact::Settings::default());
    let truth = ask(&whole, &rays);
    let exact = ask(&scene.instanced(&splines), &rays);
    assert_eq!(differences(&rays, &exact, &truth, 1e4), 0);
    let octrees = scene.octrees(&facets);
    let polished = (octrees.iter().zip(facets.meshes()).zip(&splines)).map(|((o, m), s)| Polished::new(o, m, s));
    let found = ask(&scene.instanced(polished), &rays);
    let apart = differences(&rays, &found, &truth, 1e4);
    // Facets at a silhouette may be missed that the spline has.
    assert!(apart <= 7, "{apart}");
}

/// Lets rays bounce about inside balls: none gets out or meets the surface that it leaves. Every other time they leave it flat, at any sine
/// down to `least`.
fn bounce_inside(scene: &Scene, instanced: &dyn Intersector, least: f64) {
    let mut r = Random(3);
    let balls: Vec<usize> = (0..scene.model.instances.len()).filter(|k| k % 2 == 1).collect();
    let mut rays: Vec<Ray> = (0..1500)
        .map(|_| {
            let at = scene.model.instances[balls[r.below(balls.len())]].placement.origin;
            Ray::new(at + r.direction() * 0.5, r.direction())
        })
        .collect();
    for bounce in 0..6 {
        let hits = ask(instanced, &rays);
        for (ray, hit) in rays.iter_mut().zip(&hits) {
            let hit = hit.unwrap_or_else(|| panic!("bounce {bounce}: {ray:?} slipped out"));
            assert!(hit.geometric_normal.dot(ray.direction) > 0.0, "bounce {bounce}: {ray:?} is outside");
            *ray = reflected(ray, &hit);
            if bounce % 2 == 1 {
                let inward = -hit.geometric_normal;
                let along = inward.cross(r.direction()).normalize();
                ray.direction = (along + inward * least.powf(r.unit())).normalize();
            }
        }
    }
}

#[test]
fn nothing_slips_out_of_instances() {
    for distance in [0.0, 1e6, 1e9] {
        let scene = Scene::new(distance * Point::new(1.0, -0.3, 0.2));
        let facets = scene.facets();
        bounce_inside(&scene, &scene.instanced(scene.octrees(&facets)), 1e-9);
    }
}

#[test]
fn nothing_slips_out_of_instances_on_the_spline() {
    for distance in [0.0, 1e6, 1e8, 1e9] {
        let scene = Scene::new(distance * Point::new(1.0, -0.3, 0.2));
        let (facets, splines) = (scene.facets(), scene.splines());
        let octrees = scene.octrees(&facets);
        // Where a start is rounded by ρ outward, a ball of radius R is truly missed at sines below √(2ρ/R).
        let least = 10.0 * (f64::EPSILON * (distance + 300.0)).sqrt();
        bounce_inside(&scene, &scene.instanced(&splines), least);
        let polished = octrees.iter().zip(facets.meshes()).zip(&splines).map(|((o, m), s)| Polished::new(o, m, s));
        bounce_inside(&scene, &scene.instanced(polished), least);
    }
}

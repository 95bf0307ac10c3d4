//! Starts of polished rays: which are known to be free of the whole model, and which must look for facets behind them.

use crate::polish::{bounds, mesh};
use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Certainty, Cost, ExpectedRays, Footprint, Hit, Intersector};
use lampyris::math::{Departure, FaceId, Frame, Point, Ray, Vector};
use lampyris::model::{Model, Part, Shell};
use lampyris::nurbs::sweep;
use lampyris::tessellate;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bundles of rays from polished hits, the places often beside the border of a facet: what is known to be free of the model is a miss of
/// the facets and of the spline. One model has a second sheet so near to the first that they lie within each other's sag.
#[test]
fn a_ray_that_escapes_the_spline_meets_nothing() {
    let tilted = |z: f64| Frame::translation(Vector::new(0.0, 0.0, z));
    let cap = |z: f64, r: f64| sweep::sphere(&tilted(z), r, [0.0, TAU], [-FRAC_PI_2, -0.9]);
    let models = [
        ("sphere", model([sphere(50.0)]), 0.3, 1000),
        ("torus", model([torus(50.0, 15.0)]), 0.1, 1000),
        ("reflector", model([reflector(6)]), 0.3, 1000),
        ("bowl", model([cap(0.0, 50.0)]), 0.15, 1000),
        // The spline is queried for all hits but those on the flattest facets.
        ("two sheets", model([cap(0.0, 50.0), cap(0.15, 50.0)]), 0.0, 50),
    ];
    for (name, model, least_share, least_free) in models {
        let mesh = mesh(&model, 0.2);
        let exact = Exact::build(&model, &Settings::default());
        let octree = Octree::build(&mesh, &octree::Settings::default());
        let asked = Polished::new(&octree, &mesh, &exact);
        let judge = octree.without_preparation();
        let judge = Polished::new(&judge, &mesh, &exact);
        asked.prepare_for(&ExpectedRays { rays: u64::MAX, threads: 1, beams: &[], sag: 0.0 });
        let (b, mut s) = (bounds(&mesh), Random(19));
        let (mut rays, mut free, mut known) = (0, 0, 0);
        let mut last_known = 0;
        for _ in 0..60_000 {
            let Some(hit) = judge.intersect(&s.ray(b.center(), 0.4 * b.size()), &mut Cost::default()) else {
                continue;
            };
            let from = hit.departure();
            let uv = exact.normal_at(from.face, from.uv);
            let Some(normal) = uv.filter(|_| hit.certainty == Certainty::Polished) else { continue };
            // Its own way for each facet, on both sides of the sheets and mostly along their normals.
            let mut of_facet = Random(u64::from(from.primitive));
            let side = if of_facet.unit() < 0.5 { -1.0 } else { 1.0 };
            let way = (side * normal + of_facet.direction() * 0.8 + s.direction() * 0.15).normalize();
            let place = model.parts[0].shells[0].faces[from.face.index()].surface.evaluate(from.uv);
            let ray = Ray::new(place, way).with_departure(from);
            rays += 1;
            let met = judge.intersect(&ray, &mut Cost::default());
            free += usize::from(met.is_none());
            if asked.escapes(&ray) {
                known += 1;
                assert!(met.is_none(), "{name}: {ray:?} meets {met:?}");
                let truth = exact.first(&ray, &mut Cost::default()).hit;
                assert!(truth.is_none(), "{name}: {ray:?} meets {truth:?} of the spline");
                // Nothing is known of a place that the facet does not stand for.
                let beside = Departure { primitive: last_known, ..from };
                assert!(last_known == from.primitive || !asked.escapes(&ray.with_departure(beside)), "{name}");
                last_known = from.primitive;
            }
        }
        println!("{name}: {known} known of {free} free of {rays}");
        assert!(
            known as f64 >= least_share * free as f64 && free > least_free,
            "{name}: {known} of {free} free rays known"
        );
    }
}

/// Facets that count their queries.
struct CountedAsks<'a>(&'a Octree<'a>, AtomicUsize);

impl Intersector for CountedAsks<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        self.1.fetch_add(rays.len(), Ordering::Relaxed);
        self.0.intersect_batch(rays, hits, cost);
    }

    fn footprint(&self) -> Footprint {
        self.0.footprint()
    }
}

/// Light of a chip starts a hundredth of a millimetre over it: the flat chip behind gets no query. Of a ball the facet behind a start
/// hides the piece of it that lies ahead.
#[test]
fn only_curved_facets_are_looked_for_behind_a_start() {
    let chip = sweep::plane(&Frame::IDENTITY, [[-0.5, 0.5], [-0.5, 0.5]]);
    let model = model([sphere(50.0), chip]);
    let mesh = mesh(&model, 0.2);
    let exact = Exact::build(&model, &Settings::default());
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let facets = CountedAsks(&octree, AtomicUsize::new(0));
    let polished = Polished::new(&facets, &mesh, &exact);
    let mut s = Random(23);
    let up = |s: &mut Random| (s.direction() * 0.9 + Vector::Z).normalize();
    let over_chip: Vec<Ray> = (0..1000)
        .map(|_| Ray::new(Point::new(s.within(-0.4, 0.4), s.within(-0.4, 0.4), 0.01), up(&mut s)))
        .collect();
    let mut hits = vec![None; over_chip.len()];
    polished.intersect_batch(&over_chip, &mut hits, &mut Cost::default());
    let of_ball = |h: &Option<Hit>| h.is_some_and(|h| h.face == FaceId(0));
    assert!(hits.iter().filter(|h| of_ball(h)).count() > 950);
    let asked = facets.1.load(Ordering::Relaxed);
    assert!(asked < 1100, "{asked} questions for 1000 rays");
    // In the middle of facets, between them and the ball.
    let mut hidden = 0;
    for f in (0..mesh.facets.len()).filter(|&f| mesh.facets[f].face == FaceId(0) && !mesh.facets[f].is_triangle()) {
        let out = mesh.corners(f).iter().sum::<Point>().normalize();
        let ray = Ray::new(out * (50.0 - 0.01), out);
        let is_hidden = octree.intersect(&ray, &mut Cost::default()).is_none();
        hidden += usize::from(is_hidden);
        let mut hits = [None; 2];
        polished.intersect_batch(&[ray, ray], &mut hits, &mut Cost::default());
        assert!(hits[0].is_some_and(|h| (h.t - 0.01).abs() < 1e-9), "{ray:?} {hits:?}");
    }
    assert!(hidden > 100, "{hidden}");
}

/// Light that begins between facets and spline, of a source or where it was scattered, in all directions.
#[test]
fn light_that_begins_within_the_sag_of_a_ball_comes_to_its_wall() {
    let model = model([sphere(5.0)]);
    let exact = Exact::build(&model, &Settings::default());
    let mesh = mesh(&model, 0.2);
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let polished = Polished::new(&octree, &mesh, &exact);
    let mut s = Random(29);
    for depth in [0.001, 0.01, 0.03, 0.1, 0.15] {
        let rays: Vec<Ray> = (0..4000)
            .map(|_| Ray::new(s.direction().normalize() * (5.0 - depth), s.direction().normalize()))
            .collect();
        let mut hits = vec![None; rays.len()];
        polished.intersect_batch(&rays, &mut hits, &mut Cost::default());
        for (ray, hit) in rays.iter().zip(&hits) {
            // The chord of a sphere from a point within.
            let along = ray.origin.dot(ray.direction);
            let truth = (along * along + 25.0 - ray.origin.length_squared()).sqrt() - along;
            assert!(hit.is_some_and(|h| (h.t - truth).abs() < 1e-7), "{depth}: {ray:?} {hit:?}, not {truth}");
        }
    }
}

/// A model with its facets, polished; its queries are counted by `ask`.
fn with_polished<T>(model: &Model, tolerance: f64, ask: impl FnOnce(&Polished<'_>) -> T) -> T {
    let mesh = mesh(model, tolerance);
    let exact = Exact::build(model, &Settings::default());
    let octree = Octree::build(&mesh, &octree::Settings::default());
    ask(&Polished::new(&octree, &mesh, &exact))
}

/// What a ray goes on from, once it has come to a face.
fn departure_at(polished: &Polished<'_>, ray: &Ray) -> Departure {
    polished.intersect(ray, &mut Cost::default()).unwrap().departure()
}

/// Light that leaves the floor of a bore beside its wall, nearer to it than its facets are, and runs up along it: behind the facets all the
/// way, and still it meets the wall.
#[test]
fn light_that_starts_between_a_wall_and_its_facets_meets_the_wall() {
    let wall = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, TAU], [0.0, 40.0]);
    let floor = sweep::plane(&Frame::IDENTITY, [[-12.0, 12.0], [-12.0, 12.0]]);
    with_polished(&model([wall, floor]), 0.1, |polished| {
        let mut s = Random(29);
        for _ in 0..2000 {
            let out = Vector::new(s.within(-1.0, 1.0), s.within(-1.0, 1.0), 0.0).normalize();
            let gap = s.within(0.002, 0.3);
            let place = out * (10.0 - gap);
            let from = departure_at(polished, &Ray::new(place + 5.0 * Vector::Z, -Vector::Z));
            assert_eq!(from.face, FaceId(1));
            // It has come near the wall by `gap` after `gap / 0.01`.
            let up = Vector::Z * (1.0f64 - 0.01 * 0.01).sqrt() + out * 0.01;
            let hit = polished.intersect(&Ray::new(place, up).with_departure(from), &mut Cost::default());
            let met = hit.filter(|hit| hit.face == FaceId(0) && (hit.t - gap / 0.01).abs() < 1e-7);
            assert!(met.is_some(), "{gap} mm from the wall: {hit:?}");
        }
    });
}

/// Light that meets a post just below the lid on it: where it comes to the facets of the post, which lie farther in, the lid is already
/// behind it, and still it meets the post.
#[test]
fn light_that_passes_over_the_facets_of_a_post_meets_the_post() {
    let post = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, TAU], [0.0, 40.0]);
    let lid = sweep::plane(&Frame::translation(40.0 * Vector::Z), [[-12.0, 12.0], [-12.0, 12.0]]);
    with_polished(&model([post, lid]), 0.1, |polished| {
        let mut s = Random(37);
        for _ in 0..2000 {
            let out = Vector::new(s.within(-1.0, 1.0), s.within(-1.0, 1.0), 0.0).normalize();
            let met = 10.0 * out + (40.0 - s.within(0.001, 0.05)) * Vector::Z;
            let way = (Vector::Z - out).normalize();
            let hit = polished.intersect(&Ray::new(met - 20.0 * way, way), &mut Cost::default());
            assert!(hit.is_some_and(|h| h.face == FaceId(0) && (h.t - 20.0).abs() < 1e-9), "{met}: {hit:?}");
        }
    });
}

/// Light that passes a wall just before it comes to a dome over it, whose facets are met before those of the wall: it meets the wall.
#[test]
fn light_that_meets_a_wall_before_a_dome_meets_the_wall() {
    // A bore of 10 mm, and a dome about its axis that it reaches into, at a height of 30 mm: both as seen from inside.
    let wall = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, TAU], [0.0, 40.0]);
    let radius = 10f64.hypot(30.0);
    let dome = sweep::sphere(&Frame::IDENTITY, radius, [0.0, TAU], [0.3, FRAC_PI_2]);
    with_polished(&model([wall, dome]), 0.1, |polished| {
        let mut s = Random(41);
        for _ in 0..4000 {
            let out = Vector::new(s.within(-1.0, 1.0), s.within(-1.0, 1.0), 0.0).normalize();
            let met = 10.0 * out + (30.0 - s.within(0.001, 0.05)) * Vector::Z;
            let way = (out + s.within(-0.15, 0.5) * Vector::Z).normalize();
            let hit = polished.intersect(&Ray::new(met - 8.0 * way, way), &mut Cost::default());
            assert!(hit.is_some_and(|h| h.face == FaceId(0) && (h.t - 8.0).abs() < 1e-9), "{met}: {hit:?}");
        }
    });
}

/// Chords inside a rod, whose facets are as long as itself and a millimetre wide: to which side a ray leaves is decided across the strip.
#[test]
fn chords_of_a_rod_of_long_facets_are_found() {
    let rod = sweep::cylinder(&Frame::IDENTITY, 3.0, [0.0, TAU], [0.0, 400.0]);
    with_polished(&model([rod]), 0.05, |polished| {
        let mut s = Random(31);
        for _ in 0..20_000 {
            let (sin, cos) = s.within(0.0, TAU).sin_cos();
            let (out, along) = (Vector::new(cos, sin, 0.0), Vector::new(-sin, cos, 0.0));
            let place = Point::new(3.0 * cos, 3.0 * sin, 200.0);
            let from = departure_at(polished, &Ray::new(place - 3.0 * out, out));
            let inward = s.within(0.01, 0.9);
            let across = s.within(0.05, 1.0) * (1.0 - inward * inward).sqrt();
            let rest = (1.0 - inward * inward - across * across).max(0.0).sqrt();
            let ray = Ray::new(place, along * across - out * inward + Vector::Z * rest).with_departure(from);
            // A circle's chord at a sine of `inward` in space, seen along the axis.
            let chord = 2.0 * 3.0 * inward / (inward * inward + across * across);
            if chord * rest > 199.0 {
                continue;
            }
            let hit = polished.intersect(&ray, &mut Cost::default());
            assert!(hit.is_some_and(|hit| (hit.t - chord).abs() < 1e-7), "{chord} mm: {ray:?} {hit:?}");
        }
    });
}

/// Light that starts inside a ball is answered by the spline, as none has entered it; what it leaves from there on, facets answer.
#[test]
fn light_goes_on_by_facets_after_the_spline_answered() {
    let shell = Shell { faces: vec![face(sphere(50.0))], closed: true, ..Shell::default() };
    let ball = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    with_polished(&ball, 0.05, |polished| {
        let mut s = Random(43);
        for _ in 0..2000 {
            let start = s.direction() * 20.0;
            let ray = Ray::new(start, s.direction());
            let (mut cost, mut further) = (Cost::default(), Cost::default());
            let first = polished.intersect(&ray, &mut cost).unwrap();
            assert_eq!((cost.doubtful, first.certainty), (1, Certainty::Certified));
            let from = ray.point_at(first.t);
            let way = (s.direction() - from.normalize()).normalize();
            let chord = -2.0 * way.dot(from);
            // At a sine below 0.3 the next root may hide from the facets.
            if chord < 30.0 {
                continue;
            }
            let ray = Ray::new(from, way).with_departure(first.departure());
            let hit = polished.intersect(&ray, &mut further).unwrap();
            assert!((hit.t - chord).abs() < 1e-9 && hit.certainty == Certainty::Polished, "{chord}: {hit:?}");
            assert_eq!(further.doubtful, 0);
        }
    });
}

/// Light in a thread of one face, thinner than the sag beside it: no facet of its far side is taken for that of a place that the spline
/// answered.
#[test]
fn light_in_a_thread_thinner_than_the_largest_sag_meets_its_wall() {
    let thread = face(sweep::cylinder(&Frame::IDENTITY, 0.05, [0.0, TAU], [0.0, 10.0]));
    let beside = face(sweep::sphere(
        &Frame::translation(Vector::new(90.0, 0.0, 0.0)),
        60.0,
        [0.0, TAU],
        [-FRAC_PI_2, FRAC_PI_2],
    ));
    let shells = [thread, beside].map(|face| Shell { faces: vec![face], closed: true, ..Shell::default() });
    let both = Model::from_part(Part { shells: shells.to_vec(), ..Part::default() });
    let settings = tessellate::Settings { tolerance: [0.002, 0.2], measure: false, ..Default::default() };
    let mesh = tessellate::tessellate(&both, &settings).mesh;
    let exact = Exact::build(&both, &Settings::default());
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let polished = Polished::new(&octree, &mesh, &exact);
    let mut s = Random(47);
    for _ in 0..2000 {
        let (sin, cos) = s.within(0.0, TAU).sin_cos();
        let out = Vector::new(cos, sin, 0.0);
        let start = Ray::new(Point::new(0.0, 0.0, s.within(4.0, 6.0)), out);
        let first = polished.intersect(&start, &mut Cost::default()).unwrap();
        assert!((first.t - 0.05).abs() < 1e-9, "{first:?}");
        let turn = s.within(-1.0, 1.0);
        let way = -out * f64::cos(turn) + Vector::new(-sin, cos, 0.0) * f64::sin(turn);
        let ray = Ray::new(start.point_at(first.t), way).with_departure(first.departure());
        let hit = polished.intersect(&ray, &mut Cost::default());
        // 2 r cos θ to the far wall.
        assert!(hit.is_some_and(|h| (h.t - 0.1 * turn.cos()).abs() < 1e-9), "{turn}: {hit:?}");
    }
}

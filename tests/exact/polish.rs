//! Facet hits polished to the spline: on it, where the exact model has its first hit, and never lost when a ray leaves the spline.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Beam, Certainty, Cost, ExpectedRays, Footprint, Hit, Intersector};
use lampyris::math::{Aabb, Departure, FaceId, Frame, Point, Ray, Uv, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::model::Model;
use lampyris::tessellate::{self, tessellate};

/// Every facet, each as its two triangles: slow and plain.
struct EveryFacet<'a>(&'a FacetMesh);

impl Intersector for EveryFacet<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        for (k, facet) in self.0.facets.iter().enumerate() {
            let [a, b, c, d] = self.0.corners(k);
            let uv = facet.vertices.map(|v| self.0.vertices[v as usize].uv);
            for (p, q, r, s, t) in [(a, b, c, uv[1], uv[2]), (a, c, d, uv[2], uv[3])] {
                let (e, f) = (q - p, r - p);
                let n = e.cross(f);
                let det = n.dot(ray.direction);
                if det == 0.0 {
                    continue;
                }
                let o = p - ray.origin;
                let distance = n.dot(o) / det;
                let m = o.cross(ray.direction);
                let (x, y) = (m.dot(f) / det, -m.dot(e) / det);
                let inside = x >= -1e-12 && y >= -1e-12 && x + y <= 1.0 + 1e-12;
                if !inside || distance < ray.t_min || distance > best.map_or(ray.t_max, |h| h.t) {
                    continue;
                }
                let normal = n.normalize();
                let uv: Uv = uv[0] + (s - uv[0]) * x + (t - uv[0]) * y;
                best = Some(Hit {
                    t: distance,
                    normal,
                    geometric_normal: normal,
                    face: facet.face,
                    primitive: k as u32,
                    triangle: None,
                    uv,
                    certainty: Certainty::Facet,
                });
            }
        }
        best
    }

    fn footprint(&self) -> Footprint {
        Footprint::default()
    }
}

pub(crate) fn mesh(model: &Model, tolerance: f64) -> FacetMesh {
    let settings = tessellate::Settings { tolerance: [tolerance; 2], measure: false, ..Default::default() };
    tessellate(model, &settings).mesh
}

pub(crate) fn bounds(mesh: &FacetMesh) -> Aabb {
    mesh.bounds()
}

#[test]
fn polished_hits_are_the_first_hits_of_the_spline() {
    for (name, surface) in [("sphere", sphere(50.0)), ("torus", torus(50.0, 15.0)), ("bicubic", bicubic())] {
        let model = model([surface]);
        let mesh = mesh(&model, 0.2);
        let exact = Exact::build(&model, &Settings::default());
        let facets = EveryFacet(&mesh);
        let polished = Polished::new(&facets, &mesh, &exact);
        let b = bounds(&mesh);
        let mut s = Random(8);
        let (mut hits, mut other, mut flips, mut cost) = (0, 0, 0, Cost::default());
        for _ in 0..3000 {
            let ray = s.ray(b.center(), 0.5 * b.size());
            let want = exact.intersect(&ray, &mut Cost::default());
            match (polished.intersect(&ray, &mut cost), want) {
                (Some(a), Some(b)) => {
                    hits += 1;
                    if a.certainty == Certainty::Polished && (a.t - b.t).abs() < 1e-9 {
                        assert!((a.normal - b.normal).length() < 1e-7, "{name}: {} {}", a.normal, b.normal);
                        assert_eq!(a.face, b.face);
                    } else {
                        other += 1;
                    }
                }
                (None, None) => {}
                _ => flips += 1,
            }
        }
        println!("{name}: {hits} hits, {other} elsewhere, {flips} flips, {} fallbacks", cost.fallbacks);
        // At 0.2 mm up to 0.3 % of the rays flip at silhouettes; polishing cannot see those.
        assert!(other <= hits / 200 && flips <= hits / 250, "{name}: {other} elsewhere, {flips} flips of {hits}");
        assert!(cost.fallbacks <= 15, "{name}: {} fallbacks", cost.fallbacks);
    }
}

/// Rays that leave the spline at a polished hit, in all directions and nearly along the surface.
#[test]
fn a_departure_from_the_spline_is_never_lost() {
    for (name, surface) in [("sphere", sphere(50.0)), ("torus", torus(50.0, 15.0)), ("bicubic", bicubic())] {
        let model = model([surface]);
        let mesh = mesh(&model, 0.2);
        let exact = Exact::build(&model, &Settings::default());
        let facets = EveryFacet(&mesh);
        let polished = Polished::new(&facets, &mesh, &exact);
        let b = bounds(&mesh);
        let mut s = Random(9);
        let (mut asked, mut differ, mut own, mut lost) = (0, 0, 0, 0);
        for k in 0..3000 {
            let ray = s.ray(b.center(), 0.4 * b.size());
            let Some(first) = polished.intersect(&ray, &mut Cost::default()) else { continue };
            if first.certainty != Certainty::Polished {
                continue;
            }
            let from = first.departure();
            let o: Point = ray.point_at(first.t);
            let along: Vector = first.normal.cross(s.direction()).normalize();
            let side = if s.unit() < 0.5 { -1.0 } else { 1.0 };
            let d = if k % 3 == 0 {
                (along + side * first.normal * 10f64.powf(s.within(-4.0, -0.5))).normalize()
            } else {
                s.direction()
            };
            let ray = Ray::new(o, d).with_departure(from);
            asked += 1;
            let (a, b) = (polished.intersect(&ray, &mut Cost::default()), exact.first(&ray, &mut Cost::default()));
            if a.is_some_and(|h| h.t < 1e-6 && b.hit.is_none_or(|x| x.t > 1e-6)) {
                own += 1;
            }
            let same = match (a, b.hit) {
                (Some(a), Some(b)) => (a.t - b.t).abs() < 1e-6,
                (None, None) => true,
                _ => false,
            };
            lost += usize::from(a.is_none() && b.hit.is_some());
            if !same {
                differ += 1;
                if std::env::var("LAMPYRIS_SHOW").is_ok() {
                    println!(
                        "{name}: sine {:.2e} polished {:?} exact {:?}",
                        d.dot(first.normal),
                        a.map(|h| (h.t, h.certainty)),
                        b.hit.map(|h| h.t)
                    );
                }
            }
        }
        println!("{name}: {asked} departures, {differ} differ, {own} found their own point, {lost} lost");
        assert_eq!(own, 0, "{name}: its own point found");
        assert_eq!(lost, 0, "{name}: lost");
        assert!(asked > 2000 && differ <= asked / 1000, "{name}: {differ} of {asked} differ");
    }
}

/// A ray shorter than the sag that grazes a sphere, as one that looks for a second face at the same place: the facet that belongs to
/// its hit lies ten times the sag away, but the hit is found.
#[test]
fn short_flat_rays_meet_the_sphere() {
    let plate = lampyris::nurbs::sweep::plane(&Frame::IDENTITY, [[40.0, 50.0], [-5.0, 5.0]]);
    let model = model([sphere(20.0), plate]);
    let mesh = mesh(&model, 0.1);
    let exact = Exact::build(&model, &Settings::default());
    let facets = EveryFacet(&mesh);
    let polished = Polished::new(&facets, &mesh, &exact);
    let other = mesh.facets.iter().position(|f| f.face == FaceId(1)).unwrap() as u32;
    let from = Departure { face: FaceId(1), primitive: other, uv: Uv::new(45.0, 0.0), triangle: None };
    let mut random = Random(11);
    for _ in 0..300 {
        let out = random.direction();
        let along = out.cross(random.direction()).normalize();
        let d = (along - 0.1 * out).normalize();
        let ray = Ray::new(Point::ZERO + 20.0 * out - 1e-3 * d, d).with_range(0.0, 2e-3).with_departure(from);
        let hit = polished.intersect(&ray, &mut Cost::default());
        assert!(hit.is_some_and(|h| (h.t - 1e-3).abs() < 1e-9 && h.face == FaceId(0)), "{ray:?} {hit:?}");
    }
}

/// What `rays` meet, bit by bit.
/// Where the ray meets a facet on one patch and the spline on the next, nothing is in doubt: a sphere of 2 × 4 patches, met beside each of
/// the lines between them.
#[test]
fn a_root_on_the_next_patch_is_moved_to() {
    let model = model([sphere(50.0)]);
    let mesh = mesh(&model, 0.2);
    let exact = Exact::build(&model, &Settings::default());
    let facets = EveryFacet(&mesh);
    let polished = Polished::new(&facets, &mesh, &exact);
    let mut s = Random(12);
    let mut cost = Cost::default();
    for k in 0..400 {
        // Just before a meridian or the equator, met at 60° from the side: the facet below lies behind it.
        let along = 1.2 * s.unit() - 0.6;
        let (normal, line) = match k % 3 {
            0 => (Vector::new(along.cos(), 0.0, along.sin()), Vector::Y),
            1 => (Vector::new(0.0, -along.cos(), along.sin()), Vector::X),
            _ => (Vector::new((along + 0.8).cos(), (along + 0.8).sin(), 0.0), Vector::Z),
        };
        let side = if s.unit() < 0.5 { -1.0 } else { 1.0 };
        let target = Point::ZERO + (normal - 1e-5 * side * s.unit() * line).normalize() * 50.0;
        let direction = (-0.5 * normal + side * 0.75f64.sqrt() * line).normalize();
        let ray = Ray::new(target - 100.0 * direction, direction);
        let hit = polished.intersect(&ray, &mut cost).unwrap();
        assert!(hit.certainty == Certainty::Polished && (hit.t - 100.0).abs() < 1e-9, "{ray:?} {hit:?}");
    }
    assert_eq!(cost.doubtful, 0);
}

fn bits(hits: &[Option<Hit>]) -> Vec<Option<(u32, [u64; 6])>> {
    let of = |h: &Hit| (h.face.0, [h.t, h.uv.x, h.uv.y, h.normal.x, h.normal.y, h.normal.z].map(f64::to_bits));
    hits.iter().map(|h| h.as_ref().map(of)).collect()
}

/// Rays of a point and of a disc, others from all around, and what goes on from where they hit: a batch answers them as if each were
/// traced alone, and whether or not it was prepared for the sources.
#[test]
fn a_batch_gives_the_bits_of_rays_asked_alone() {
    for (name, surface) in [("sphere", sphere(50.0)), ("torus", torus(50.0, 15.0)), ("freeform", reflector(6))] {
        let model = model([surface]);
        let mesh = mesh(&model, 0.2);
        let exact = Exact::build(&model, &Settings::default());
        let octree = Octree::build(&mesh, &octree::Settings::default());
        let polished = Polished::new(&octree, &mesh, &exact);
        let (b, mut s) = (bounds(&mesh), Random(10));
        let lamp = b.center() + 3.0 * b.size();
        let down = (b.center() - lamp).normalize();
        let mut rays: Vec<Ray> = (0..2000)
            .map(|k| match k % 3 {
                0 => Ray::from_points(lamp, b.center() + 0.4 * s.direction() * b.size()).unwrap(),
                1 => Ray::new(lamp + 0.4 * down.cross(s.direction()) * b.size().max_element(), down),
                _ => s.ray(b.center(), 0.5 * b.size()),
            })
            .collect();
        let mut hits = vec![None; rays.len()];
        polished.intersect_batch(&rays, &mut hits, &mut Cost::default());
        for k in 0..rays.len() {
            if let Some(h) = hits[k] {
                let from = h.departure();
                rays.push(Ray::new(rays[k].point_at(h.t), s.direction()).with_departure(from));
            }
        }
        hits.resize(rays.len(), None);
        polished.intersect_batch(&rays, &mut hits, &mut Cost::default());
        let alone: Vec<_> = rays.iter().map(|r| polished.intersect(r, &mut Cost::default())).collect();
        assert_eq!(bits(&hits), bits(&alone), "{name}");
        let met = hits.iter().flatten().filter(|h| h.certainty == Certainty::Polished).count();
        assert!(met > rays.len() / 4, "{name}: {met} of {}", rays.len());
        let beams = [(Beam::Point(lamp), 1 << 40), (Beam::Collimated { origin: lamp, direction: down }, 1 << 40)];
        polished.prepare_for(&ExpectedRays { rays: 1 << 40, threads: 2, beams: &beams, sag: 0.0 });
        let mut prepared = vec![None; rays.len()];
        polished.intersect_batch(&rays, &mut prepared, &mut Cost::default());
        assert_eq!(bits(&prepared), bits(&alone), "{name}");
    }
}

#[test]
fn a_point_that_newton_has_not_reached_is_none() {
    let exact = Exact::build(&model([sphere(50.0)]), &Settings::default());
    let mut s = Random(41);
    let mut points = [0; 4];
    for k in 0..2000 {
        let (d, target) = (s.direction(), s.direction() * 50.0);
        let ray = Ray::new(target - d * 150.0, d);
        // From a tenth of a turn away, with too few steps for most.
        let uv = exact.first(&ray, &mut Cost::default()).hit.unwrap().uv
            + Uv::new(s.within(-0.1, 0.1), s.within(-0.1, 0.1));
        let steps = k % 4;
        if let Some(point) = exact.converge(&ray, FaceId(0), uv, steps) {
            points[steps as usize] += 1;
            let off = ray.point_at(point.t).length() - 50.0;
            assert!(
                off.abs() < 2e-9 / ray.direction.dot(point.normal).abs().max(1e-3),
                "{off:e} off after {steps} steps"
            );
        }
    }
    assert!(points[0] < points[3] && points[3] > 100, "{points:?}");
}

#[test]
fn a_reversed_face_has_its_normals_turned() {
    let mut model = model([sphere(50.0)]);
    model.parts[0].shells[0].faces[0].reversed = true;
    let exact = Exact::build(&model, &Settings::default());
    let mesh = tessellate(&model, &tessellate::Settings { measure: false, ..Default::default() }).mesh;
    let facets = EveryFacet(&mesh);
    let polished = Polished::new(&facets, &mesh, &exact);
    let mut s = Random(43);
    for _ in 0..50 {
        let ray = Ray::new(s.direction() * 20.0, s.direction());
        for (name, ground) in [("polished", &polished as &dyn Intersector), ("spline", &exact)] {
            let hit = ground.intersect(&ray, &mut Cost::default()).unwrap();
            let inward = -ray.point_at(hit.t) / 50.0;
            assert!(hit.normal.distance(inward) < 1e-9, "{name}: {} for {inward}", hit.normal);
        }
        let hit = exact.first(&ray, &mut Cost::default()).hit.unwrap();
        let point = exact.converge(&ray, hit.face, hit.uv, 4).unwrap();
        assert!(point.normal.distance(hit.normal) < 1e-9, "{} for {}", point.normal, hit.normal);
    }
}

#[test]
fn newton_goes_on_across_the_seam_of_a_closed_surface() {
    let surface = sphere(50.0);
    let [[first, last], [low, high]] = surface.domain();
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    let mut s = Random(47);
    for k in 0..200 {
        let aside = 0.01 * (last - first);
        let (near, far) = (first + aside * s.unit(), last - aside * s.unit());
        let (at, seed) = if k % 2 == 0 { (near, far) } else { (far, near) };
        let v = s.within(low + 0.2 * (high - low), high - 0.2 * (high - low));
        let target = surface.evaluate(Uv::new(at, v));
        let d = (s.direction() * 0.3 - target / 50.0).normalize();
        let point = exact.converge(&Ray::new(target - d * 150.0, d), FaceId(0), Uv::new(seed, v), 20);
        assert!(point.is_some_and(|p| (p.t - 150.0).abs() < 1e-9), "{point:?} from {seed} to {at}");
    }
}

#[test]
fn a_chord_shorter_than_a_micrometre_is_no_start() {
    let exact = Exact::build(&model([sphere(50.0)]), &Settings::default());
    let mut s = Random(53);
    for _ in 0..300 {
        let first = Ray::new(s.direction() * 20.0, s.direction());
        let hit = exact.first(&first, &mut Cost::default()).hit.unwrap();
        let start = first.point_at(hit.t);
        let chord = s.within(7e-4, 9.9e-4);
        // Of a ball of radius R a chord at sine s is 2Rs long.
        let (n, sine) = (start.normalize(), chord / 100.0);
        let d = (n.cross(s.direction()).normalize() * (1.0 - sine * sine).sqrt() - n * sine).normalize();
        let ray = Ray::new(start, d).with_departure(hit.departure());
        let next = exact.first(&ray, &mut Cost::default()).hit;
        assert!(next.is_some_and(|h| (h.t - chord).abs() < 1e-6), "{next:?} for {chord} by {ray:?}");
    }
}

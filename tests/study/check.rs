//! The cross-check with intersectors that are obviously right, and with defects planted in them.

use crate::support::{Balls, Brute, Changed};
use lampyris::intersect::instanced::Instanced;
use lampyris::intersect::{Hit, Intersector};
use lampyris::math::{Aabb, FaceId, Frame, Point, Ray};
use lampyris::mesh::FacetMesh;
use lampyris::model::{Instancing, Model, Placement};
use lampyris::nurbs::sweep;
use lampyris::study::cross_check::{
    Cause, CrossCheck, Defect, GroupedIntersectors, Intersectors, Settings, cross_check, cross_check_groups,
};
use lampyris::study::rays::{Camera, Chain, RaySource, Uniform};
use lampyris::study::{records, sample_models};
use std::f64::consts::PI;

const FULL: [f64; 2] = [0.0, 2.0 * PI];

fn balls(at: &[(Point, f64)]) -> Model {
    let ball = |&(p, r): &(Point, f64)| sweep::sphere(&Frame::translation(p), r, FULL, [-PI / 2.0, PI / 2.0]);
    sample_models::model("balls", at.iter().map(ball))
}

fn rays(mesh: &FacetMesh, count: u64) -> Vec<Ray> {
    let (camera, uniform) = (Camera::new(&mesh.bounds(), count / 2), Uniform::new(&mesh.bounds(), 5, count / 2));
    let chain = Chain(vec![&camera, &uniform]);
    chain.rays(0..chain.len())
}

fn run(subjects: &Intersectors<'_>, rays: &[Ray]) -> CrossCheck {
    cross_check(subjects, rays, &Settings::default(), &|_| ())
}

#[test]
fn every_difference_of_a_faceted_ball_is_explained() {
    let at = [(Point::ZERO, 50.0)];
    let model = balls(&at);
    let mesh = sample_models::grid_mesh(&model, 8);
    let (facets, exact) = (Brute(&mesh), Balls(at.to_vec()));
    let subjects = Intersectors { model: &model, mesh: &mesh, octree: &facets, bvh: &facets, exact: &exact };
    let rays = rays(&mesh, 20_000);
    let found = run(&subjects, &rays);
    assert_eq!(found.rays, 20_000);
    assert_eq!(found.octree_vs_bvh.disagree, 0);
    let f = &found.facets_vs_exact;
    assert_eq!(f.unexplained, 0, "{f:?}");
    // Facets lie inside the sphere: a flip is always a missed silhouette, and some rays must do so.
    assert!(f.hit_miss > 10 && f.explained.silhouette == f.hit_miss, "{f:?}");
    assert!(f.explained.within_sag > 5_000 && f.explained.trim_edge == 0 && f.explained.coincident == 0, "{f:?}");
    assert_eq!(
        found.exact.certified,
        rays.iter().filter(|r| (r.origin - r.direction * r.origin.dot(r.direction)).length() < 50.0).count() as u64
    );
}

#[test]
fn two_balls_that_touch_within_their_sag_swap_as_coincident() {
    // Two balls 0.01 mm apart, the facets of one turned by half a facet: the sag of 0.2 mm decides which is hit first.
    let at = [(Point::ZERO, 50.0), (Point::new(0.01, 0.0, 0.0), 50.0)];
    let turned = [PI / 32.0, PI / 32.0 + 2.0 * PI];
    let second = sweep::sphere(&Frame::translation(at[1].0), 50.0, turned, [-PI / 2.0, PI / 2.0]);
    let first = sweep::sphere(&Frame::IDENTITY, 50.0, FULL, [-PI / 2.0, PI / 2.0]);
    let model = sample_models::model("balls", [first, second]);
    let mesh = sample_models::grid_mesh(&model, 8);
    let (facets, exact) = (Brute(&mesh), Balls(at.to_vec()));
    let subjects = Intersectors { model: &model, mesh: &mesh, octree: &facets, bvh: &facets, exact: &exact };
    let found = run(&subjects, &rays(&mesh, 4_000)).facets_vs_exact;
    assert_eq!(found.unexplained, 0, "{found:?}");
    assert!(found.other_face > 100 && found.explained.coincident > 100, "{found:?}");
}

#[test]
fn balls_of_two_placements_that_touch_swap_as_coincident() {
    // As above, but each ball is a part of its own coordinates, which is placed.
    let at = [Point::ZERO, Point::new(0.01, 0.0, 0.0)];
    let ball = |first: f64| {
        let surface = sweep::sphere(&Frame::IDENTITY, 50.0, [first, first + 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        sample_models::model("ball", [surface])
    };
    let groups = vec![Model::default(), ball(0.0), ball(PI / 32.0)];
    let meshes: Vec<FacetMesh> = groups.iter().map(|group| sample_models::grid_mesh(group, 8)).collect();
    let place = |(k, p): (usize, &Point)| Placement {
        group: k as u32 + 1,
        frame: Frame::translation(*p),
        bounds: Aabb::from_points([*p]).grown(51.0),
        first_face: FaceId(k as u32),
    };
    let placements = at.iter().enumerate().map(place).collect();
    let instancing = Instancing::from_placements(groups.clone(), placements);
    let structures = meshes.iter().map(|mesh| Box::new(Brute(mesh)) as Box<dyn Intersector>).collect();
    let (facets, exact) = (Instanced::new(&instancing, structures), Balls(at.map(|p| (p, 50.0)).to_vec()));
    let subjects = GroupedIntersectors {
        groups: groups.iter().zip(&meshes).collect(),
        instancing: Some(&instancing),
        octree: &facets,
        bvh: &facets,
        exact: &exact,
    };
    let found = cross_check_groups(&subjects, &rays(&meshes[1], 4_000), &Settings::default(), &|_| ());
    let found = found.facets_vs_exact;
    assert_eq!(found.unexplained, 0, "{found:?}");
    assert!(found.other_face > 100 && found.explained.coincident > 100, "{found:?}");
}

#[test]
fn an_open_shell_differs_at_its_border() {
    // The upper half of a ball: facets end on a polygon, the spline on a circle.
    let surface = sweep::sphere(&Frame::IDENTITY, 50.0, FULL, [0.0, PI / 2.0]);
    let model = sample_models::model("dome", [surface]);
    let mesh = sample_models::grid_mesh(&model, 6);
    let whole = Balls(vec![(Point::ZERO, 50.0)]);
    let dome = Changed(&whole, |ray: &Ray, first: Option<Hit>| {
        let first = first?;
        if ray.point_at(first.t).z >= 0.0 {
            return Some(first);
        }
        // The second crossing, by symmetry about the point nearest to the centre.
        let t = -2.0 * ray.origin.dot(ray.direction) - first.t;
        let n = ray.point_at(t) / 50.0;
        (t >= ray.t_min && n.z >= 0.0).then_some(Hit { t, normal: n, geometric_normal: n, ..first })
    });
    let facets = Brute(&mesh);
    let subjects = Intersectors { model: &model, mesh: &mesh, octree: &facets, bvh: &facets, exact: &dome };
    let found = run(&subjects, &rays(&mesh, 10_000)).facets_vs_exact;
    assert_eq!(found.unexplained, 0, "{found:?}");
    assert!(found.explained.trim_edge > 0 && found.explained.silhouette > 0, "{found:?}");
}

#[test]
fn planted_defects_are_found() {
    let at = [(Point::ZERO, 50.0)];
    let model = balls(&at);
    let mesh = sample_models::grid_mesh(&model, 8);
    let (facets, exact) = (Brute(&mesh), Balls(at.to_vec()));
    let honest = Intersectors { model: &model, mesh: &mesh, octree: &facets, bvh: &facets, exact: &exact };
    let rays = rays(&mesh, 4_000);
    let hits = run(&honest, &rays).hits;
    let unexplained = |c: &CrossCheck, d: Defect| {
        c.disagreements.iter().filter(|x| x.cause == Some(Cause::Unexplained(d))).count() as u64
    };

    let dropped = |ray: &Ray| ray.direction.x > 0.9;
    let leaky = Changed(&facets, |ray: &Ray, h: Option<Hit>| h.filter(|_| !dropped(ray)));
    let found = run(&Intersectors { octree: &leaky, ..honest }, &rays);
    assert_eq!(found.octree_vs_bvh.disagree, hits - found.hits);
    assert!(found.octree_vs_bvh.disagree > 20);
    let missed = unexplained(&found, Defect::MissedCrossing);
    assert!(missed > 20 && missed == found.facets_vs_exact.unexplained, "{:?}", found.facets_vs_exact);

    let swollen = Balls(vec![(Point::ZERO, 52.0)]);
    let found = run(&Intersectors { exact: &swollen, ..honest }, &rays);
    assert!(unexplained(&found, Defect::OffTheSurface) > hits / 2);

    let turned = Changed(&exact, |_: &Ray, h: Option<Hit>| h.map(|h| Hit { geometric_normal: -h.normal, ..h }));
    let found = run(&Intersectors { exact: &turned, ..honest }, &rays);
    assert!(unexplained(&found, Defect::Orientation) > hits / 2);

    let mut torn = mesh.clone();
    torn.facets.remove(37);
    torn.sag.remove(37);
    let with_hole = Brute(&torn);
    let found = run(&Intersectors { mesh: &torn, octree: &with_hole, bvh: &with_hole, ..honest }, &rays);
    assert_eq!(found.octree_vs_bvh.disagree, 0, "both have the same hole");
    assert!(unexplained(&found, Defect::MissedCrossing) > 0);

    // What was found can be written out and traced again.
    let mut bytes = Vec::new();
    let defects = found.disagreements.iter().filter(|d| matches!(d.cause, Some(Cause::Unexplained(_))));
    records::write(&mut bytes, defects.map(|d| (d.ray, d.octree.map(|h| h.t)))).unwrap();
    let again: Vec<Ray> = records::read(&mut bytes.as_slice()).unwrap().into_iter().map(|r| r.0).collect();
    let replayed = run(&Intersectors { mesh: &torn, octree: &with_hole, bvh: &with_hole, ..honest }, &again);
    assert_eq!(replayed.facets_vs_exact.unexplained, again.len() as u64);
}

#[test]
fn verdicts_do_not_depend_on_threads_and_serialise_as_promised() {
    let at = [(Point::new(3.0, 1.0, -2.0), 20.0)];
    let model = balls(&at);
    let mesh = sample_models::grid_mesh(&model, 4);
    let (facets, exact) = (Brute(&mesh), Balls(at.to_vec()));
    let subjects = Intersectors { model: &model, mesh: &mesh, octree: &facets, bvh: &facets, exact: &exact };
    let rays = rays(&mesh, 20_000);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| serde_json::to_value(run(&subjects, &rays)).unwrap())
    };
    let one = on(1);
    assert_eq!(one, on(3));
    for path in [
        "/rays",
        "/hits",
        "/scene/facets",
        "/scene/patches",
        "/octree_vs_bvh/disagree",
        "/facets_vs_exact/hit_miss",
        "/facets_vs_exact/other_face",
        "/facets_vs_exact/t_error_mm/p99",
        "/facets_vs_exact/normal_error_deg/max",
        "/facets_vs_exact/explained/within_sag",
        "/facets_vs_exact/explained/silhouette",
        "/facets_vs_exact/explained/trim_edge",
        "/facets_vs_exact/explained/coincident",
        "/facets_vs_exact/explained/tangent",
        "/facets_vs_exact/unexplained",
        "/exact/certified",
        "/exact/tangent",
        "/exact/uncertified",
        "/mrays_per_s/cwbvh_as_shipped",
        "/build_seconds/octree",
        "/bytes_per_facet/bvh2",
    ] {
        assert!(one.pointer(path).is_some(), "{path}");
    }
}

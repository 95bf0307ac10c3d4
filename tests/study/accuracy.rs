//! The accuracy study against theory: closed-form surfaces, facets of a plain grid, a plain tree of boxes.

use crate::support::{Balls, Bowl, Boxes};
use lampyris::intersect::{Certainty, Cost, Intersector, NormalMode};
use lampyris::math::{Frame, Homogeneous, Point, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::model::Model;
use lampyris::nurbs::{ControlPoint, Surface, sweep};
use lampyris::study::accuracy::{Settings, accuracy, sentence};
use lampyris::study::rays::{RaySource, Uniform};
use lampyris::study::{FacetTree, MeasuredMesh, MeshSource, ModelMeshSource, sample_models};
use std::f64::consts::PI;

struct Plain {
    model: Model,
    exact: Box<dyn Intersector>,
}

/// The product's mesher, octree and polish, judged by the closed form.
struct Ours<'a> {
    product: ModelMeshSource<'a>,
    plain: &'a Plain,
}

impl MeshSource for Ours<'_> {
    fn mesh(&self, tolerance: [f64; 2]) -> MeasuredMesh {
        self.product.mesh(tolerance)
    }
    fn build<'m>(&'m self, mesh: &'m FacetMesh, tree: FacetTree, normals: NormalMode) -> Box<dyn Intersector + 'm> {
        self.product.build(mesh, tree, normals)
    }
    fn polish<'m>(&'m self, facets: &'m dyn Intersector, mesh: &'m FacetMesh) -> Box<dyn Intersector + 'm> {
        self.product.polish(facets, mesh)
    }
    fn exact(&self) -> &dyn Intersector {
        &*self.plain.exact
    }
}

impl MeshSource for Plain {
    /// The coarsest grid of 2, 4, 8 … facets a side that keeps the tolerance.
    fn mesh(&self, tolerance: [f64; 2]) -> MeasuredMesh {
        let sag = |m: &FacetMesh| m.sag.iter().copied().fold(0.0, f64::max) / 1.15;
        let halvings =
            (sag(&sample_models::grid_mesh(&self.model, 2)) / tolerance[1]).sqrt().log2().ceil().max(0.0);
        let divisions = 2 << halvings as usize;
        let mesh = sample_models::grid_mesh(&self.model, divisions);
        let sag_mean = mesh.sag.iter().sum::<f64>() / mesh.sag.len() as f64 / 1.15;
        MeasuredMesh { sag_max: sag(&mesh), mesh, seconds: 1e-3 * divisions as f64, sag_mean }
    }
    fn build<'m>(&'m self, mesh: &'m FacetMesh, _: FacetTree, normals: NormalMode) -> Box<dyn Intersector + 'm> {
        Box::new(Boxes::new(mesh, normals))
    }
    fn polish<'m>(&'m self, _: &'m dyn Intersector, mesh: &'m FacetMesh) -> Box<dyn Intersector + 'm> {
        Box::new(Boxes::new(mesh, NormalMode::Bilinear))
    }
    fn exact(&self) -> &dyn Intersector {
        &*self.exact
    }
}

fn ball(radius: f64) -> Plain {
    let s = sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
    Plain { model: sample_models::model("ball", [s]), exact: Box::new(Balls(vec![(Point::ZERO, radius)])) }
}

fn bowl(focus: f64, half: f64) -> Plain {
    let (s1, s2) = ([-half, 0.0, half], [half * half, -half * half, half * half]);
    let at =
        |i: usize, j: usize| Homogeneous::weighted(Point::new(s1[i], s1[j], (s2[i] + s2[j]) / (4.0 * focus)), 1.0);
    let knots = vec![-half, -half, -half, half, half, half];
    let points = (0..3).flat_map(|i| (0..3).map(move |j| at(i, j))).collect();
    let surface = Surface { degree: [2, 2], knots: [knots.clone(), knots], points };
    Plain { model: sample_models::model("bowl", [surface]), exact: Box::new(Bowl { focus, half }) }
}

fn settings() -> Settings {
    Settings {
        // Five halvings of the facets' length.
        tolerances: [2.0, 0.5, 0.125, 0.031, 0.0078].map(|t| [t, t]).into(),
        normals: vec![NormalMode::Flat, NormalMode::Bilinear],
        trees: vec![FacetTree::Octree],
        rays: 10_000,
        rounds: 1,
        threads: vec![1],
        seed: 3,
        seconds_after: 0.0,
    }
}

#[test]
fn slopes_on_ball_and_paraboloid_are_those_of_theory() {
    for (name, mesh_source) in
        [("ball lens", ball(50.0)), ("sphere mirror", ball(200.0)), ("paraboloid", bowl(25.0, 40.0))]
    {
        let study = accuracy(name, &mesh_source, &settings(), &|_| ());
        assert_eq!(study.rows.len(), 1 + 5 * 2);
        assert!(study.slopes.len() == 2);
        for s in &study.slopes {
            let theory = s.theory_in_sag.unwrap();
            assert!(s.points >= 5, "{name}: {s:?}");
            assert!((s.in_sag - theory).abs() < 0.1, "{name}: {s:?}");
            assert!((s.in_length - 2.0 * theory).abs() < 0.1, "{name}: {s:?}");
        }
    }
}

#[test]
fn slopes_of_the_products_own_facets_are_those_of_theory() {
    for (name, plain) in
        [("ball lens", ball(50.0)), ("sphere mirror", ball(200.0)), ("paraboloid", bowl(25.0, 40.0))]
    {
        let ours = Ours { product: ModelMeshSource::measuring(&plain.model), plain: &plain };
        // Four halvings of the facets' length.
        let coarse = if name == "sphere mirror" { 8.0 } else { 2.0 };
        let tolerances = [1.0, 0.25, 0.0625, 0.0156, 0.0039].map(|t| [coarse * t; 2]).into();
        let study = accuracy(name, &ours, &Settings { tolerances, ..settings() }, &|_| ());
        for s in &study.slopes {
            println!("{name}: {s:?}");
            let theory = s.theory_in_sag.unwrap();
            assert!(s.points >= 5, "{name}: {s:?}");
            assert!((s.in_sag - theory).abs() < 0.1, "{name}: {s:?}");
            assert!((s.in_length - 2.0 * theory).abs() < 0.1, "{name}: {s:?}");
        }
    }
}

#[test]
fn polished_hits_and_normals_are_the_true_ones() {
    let round = |at: Point| (at.length(), at.normalize());
    let bowl_at = |at: Point| {
        let n = Vector::new(-at.x / 50.0, -at.y / 50.0, 1.0);
        (at.z - (at.x * at.x + at.y * at.y) / 100.0, n.normalize())
    };
    for (name, plain, level, truth) in [
        ("ball lens", ball(50.0), 50.0, &round as &dyn Fn(Point) -> (f64, Vector)),
        ("sphere mirror", ball(200.0), 200.0, &round),
        ("paraboloid", bowl(25.0, 40.0), 0.0, &bowl_at),
    ] {
        let ours = Ours { product: ModelMeshSource::new(&plain.model), plain: &plain };
        let meshed = ours.mesh([0.1; 2]);
        let facets = ours.build(&meshed.mesh, FacetTree::Octree, NormalMode::Bilinear);
        let polished = ours.polish(&*facets, &meshed.mesh);
        let source = Uniform::new(&meshed.mesh.bounds(), 5, 20_000);
        let (mut hits, mut fallen, mut off, mut turned) = (0, 0, 0f64, 0f64);
        for ray in source.rays(0..source.len()) {
            let Some(hit) = polished.intersect(&ray, &mut Cost::default()) else { continue };
            hits += 1;
            if hit.certainty != Certainty::Polished {
                fallen += 1;
                continue;
            }
            let (height, normal) = truth(ray.point_at(hit.t));
            off = off.max((height - level).abs());
            turned = turned.max(hit.normal.cross(normal).length());
        }
        println!("{name}: {hits} hits, {fallen} fell back; {off:.1e} mm off, normals turned by {turned:.1e}");
        // Rays that pass the border or the silhouette within the sag have no root to be moved to.
        assert!(hits > 3000 && fallen * 100 < hits, "{name}: {fallen} of {hits} fell back");
        assert!(off < 1e-9 && turned < 1e-9, "{name}: {off} mm, {turned}");
    }
}

#[test]
fn bilinear_normals_on_a_mirror_ball_stay_within_the_formula() {
    // 2·s·tan i/R bounds the error; over isotropic chords p99 of tan i is √(0.99/0.01).
    let study = accuracy("ball", &ball(50.0), &settings(), &|_| ());
    for r in study.rows.iter().filter(|r| r.normals == "bilinear") {
        let bound = (2.0 * r.sag_max_mm.unwrap() * (99f64).sqrt() / 50.0).to_degrees();
        assert!(r.direction_error_deg_p99 < bound, "{r:?}");
        assert!(r.direction_error_deg_rms > 0.0 && r.direction_error_deg_rms < r.direction_error_deg_max);
    }
    assert!(study.answer.starts_with("For 0.05° take"), "{}", study.answer);
    // The spline is taken where it costs less than all facets that are good enough, and is no advice where it costs more.
    for (seconds, taken) in [(0.0, true), (1e9, false)] {
        let mut rows = study.rows.clone();
        for r in rows.iter_mut().filter(|r| r.tolerance_mm.is_none()) {
            r.seconds_trace_median = seconds;
        }
        let answer = sentence(&rows, 0.05);
        assert_eq!(answer.starts_with("For 0.05° take the exact spline"), taken, "{answer}");
    }
    // The front falls in error and rises in time.
    let key = |&i: &usize| (study.rows[i].seconds(), study.rows[i].direction_error_deg_p99);
    assert!(study.front.windows(2).all(|w| key(&w[0]).0 <= key(&w[1]).0 && key(&w[0]).1 > key(&w[1]).1));
}

#[test]
fn progress_rises_to_one() {
    let seen = std::sync::Mutex::new(Vec::new());
    accuracy("ball", &ball(50.0), &Settings { rays: 500, ..settings() }, &|p| seen.lock().unwrap().push(p.done));
    let seen = seen.into_inner().unwrap();
    assert_eq!(seen.last(), Some(&1.0));
    assert!(seen.iter().all(|d| (0.0..=1.0).contains(d)), "{seen:?}");
}

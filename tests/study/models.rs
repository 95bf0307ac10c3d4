//! The cross-check, and accuracy asked for as an angle, on real files: fixtures always, the corpus where it is.

use crate::files::{corpus, fixture, read_model, step_files};
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{self, Octree};
use lampyris::math::{Point, Vector};
use lampyris::model::Model;
use lampyris::nurbs::{Curve, sweep};
use lampyris::study::accuracy_target::{AccuracyTarget, meet_target};
use lampyris::study::cross_check::{Cause, CrossCheck, Intersectors, Settings, cross_check};
use lampyris::study::rays::{Bounces, Camera, Chain, RaySource, Uniform};
use lampyris::study::{MeshSource, ModelMeshSource, Progress, interpolation, sample_models};
use lampyris::tessellate;
use std::f64::consts::FRAC_PI_2;
use std::sync::Mutex;

/// A third of the rays from a camera, a third at random, a third bouncing inside.
fn cross_checked(model: &Model, rays: u64) -> CrossCheck {
    let made = tessellate::tessellate(model, &tessellate::Settings::default());
    let octree = Octree::build(&made.mesh, &octree::Settings::default());
    let bvh = Bvh::build(&made.mesh, &bvh::Settings::default());
    let product = ModelMeshSource::new(model);
    let bounds = made.mesh.bounds();
    let camera = Camera::new(&bounds, rays / 3);
    let uniform = Uniform::new(&bounds, 1, rays / 3);
    let bounces = Bounces::new(&bounds, &octree, 0.2, 2, rays / 3);
    let chain = Chain(vec![&camera, &uniform, &bounces]);
    let subjects = Intersectors { model, mesh: &made.mesh, octree: &octree, bvh: &bvh, exact: product.exact() };
    assert_eq!(chain.len(), rays / 3 * 3);
    cross_check(&subjects, &chain, &Settings::default(), &|_| ())
}

/// The rounds on one model take seconds, and are reported one by one.
#[test]
fn the_study_of_normals_tells_how_far_it_is_within_a_model() {
    let model = read_model(&fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    let source = ModelMeshSource::new(&model);
    let settings = interpolation::Settings { facets: 300, rays: 100, repetitions: 3, ..Default::default() };
    let told = Mutex::new(Vec::new());
    let tell = |progress: Progress| told.lock().unwrap().push(progress.done);
    interpolation::interpolation(&[("lens", &source as &dyn MeshSource)], &settings, &tell);
    let told = told.into_inner().unwrap();
    let within = told.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
    assert!(told.is_sorted() && within == 4 && told.last() == Some(&1.0), "{told:?}");
}

fn line(name: &str, c: &CrossCheck) -> String {
    let f = &c.facets_vs_exact;
    let mut text = format!(
        "{name}: {} rays, {} hits, {} facets; octree/bvh {} ({} ties); flips {}, other face {}, unexplained {}; {:?}; uncertified {}\n",
        c.rays,
        c.hits,
        c.scene.facets,
        c.octree_vs_bvh.disagree,
        c.octree_vs_bvh.ties,
        f.hit_miss,
        f.other_face,
        f.unexplained,
        f.explained,
        c.exact.uncertified
    );
    let odd = |d: &&lampyris::study::cross_check::Disagreement| {
        d.facets_differ || matches!(d.cause, Some(Cause::Unexplained(_)))
    };
    for d in c.disagreements.iter().filter(odd).take(4) {
        let show = |h: Option<lampyris::intersect::Hit>| {
            h.map(|h| format!("t {} face {} n {:.3} {:?}", h.t, h.face.0, h.geometric_normal, h.certainty))
        };
        text += &format!(
            "    ray {} {} {}: {:?}\n      octree {:?}\n      bvh {:?}\n      exact {:?}\n",
            d.index,
            d.ray.origin,
            d.ray.direction,
            d.cause,
            show(d.octree),
            show(d.bvh),
            show(d.exact)
        );
    }
    text
}

/// A sheet that runs along a quarter of a circle, around a loop, and back 0.01 mm beside itself, closer than the sag of its facets: these
/// may be met in the other order than the two sides, which face opposite ways.
#[test]
fn the_sides_of_a_hairpin_change_their_order() {
    let on_arc = |angle: f64, radius: f64, way: f64| {
        let (sin, cos) = angle.sin_cos();
        (radius * Point::new(cos, sin, 0.0), way * Vector::new(-sin, cos, 0.0))
    };
    let there = (0..=6).map(|k| on_arc(f64::from(k) / 6.0 * FRAC_PI_2, 10.0, 1.0));
    let around = [([-3.0, 11.5], Vector::Y), ([-2.0, 13.0], Vector::X), ([-1.0, 11.5], -Vector::Y)];
    let around = around.map(|([x, y], along)| (Point::new(x, y, 0.0), along));
    // In other steps on the way back, so that facets of one side don't lie beside those of the other.
    let back = (0..=9).map(|k| on_arc((1.0 - f64::from(k) / 9.0) * FRAC_PI_2, 10.01, -1.0));
    let places: Vec<(Point, Vector)> = there.chain(around).chain(back).collect();
    let mut parameters = vec![0.0];
    parameters.extend(places.windows(2).scan(0.0, |way, pair| {
        *way += pair[0].0.distance(pair[1].0);
        Some(*way)
    }));
    let (positions, derivatives): (Vec<Point>, Vec<Vector>) = places.into_iter().unzip();
    let curve = Curve::hermite(&parameters, &positions, &derivatives);
    let sheet = sweep::extrusion(&curve, Vector::Z, [0.0, 5.0]);
    let found = cross_checked(&sample_models::model("hairpin", [sheet]), 30_000);
    let f = &found.facets_vs_exact;
    assert!(f.unexplained == 0 && f.explained.coincident > 0, "{}", line("hairpin", &found));
}

#[test]
fn fixtures_have_no_unexplained_difference() {
    let folder = fixture("step");
    let mut bad = String::new();
    for path in step_files(&folder) {
        let model = read_model(&path).expect("fixtures are readable");
        let found = cross_checked(&model, 30_000);
        let text = line(&path.file_name().unwrap_or_default().to_string_lossy(), &found);
        println!("{text}");
        assert!(found.hits > 1000, "{text}");
        if found.facets_vs_exact.unexplained + found.octree_vs_bvh.disagree > 0 {
            bad += &text;
        }
    }
    assert!(bad.is_empty(), "{bad}");
}

#[test]
#[ignore = "minutes: the whole corpus, LAMPYRIS_RAYS rays a file"]
fn corpus_cross_checked() {
    let folder = corpus();
    let rays = std::env::var("LAMPYRIS_RAYS").ok().and_then(|r| r.parse().ok()).unwrap_or(30_000);
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let all = step_files(&folder);
    if all.is_empty() {
        println!("no corpus at {}: nothing judged", folder.display());
    }
    for path in all.iter().filter(|p| p.to_string_lossy().contains(&only)) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let start = std::time::Instant::now();
        match read_model(path) {
            Some(model) if model.placed_face_count() > 0 => {
                let text = line(&name, &cross_checked(&model, rays));
                println!("{:.1} s {text}", start.elapsed().as_secs_f64());
            }
            _ => println!("{name}: not read"),
        }
    }
}

#[test]
fn an_angle_asked_for_is_reached() {
    let path = fixture("step/lens_planoconvex_nurbs.stp");
    let model = read_model(&path).expect("fixtures are readable");
    let product = ModelMeshSource::new(&model);
    for degrees in [0.5, 0.02] {
        let ask = AccuracyTarget { check_rays: 20_000, ..AccuracyTarget::for_angle_deg(degrees) };
        let found = meet_target(&model, &product, &ask, &|_| ()).unwrap();
        assert!(found.kept && found.reached_deg.unwrap() <= degrees && found.checked > 1000, "{found:?}");
    }
}

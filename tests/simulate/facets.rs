//! What facets change of the three scenes of the fixtures, against the spline with the same rays: the spot widens as the square
//! root of the sag with flat normals; with interpolated ones its size changes in proportion to the sag or faster.

use crate::support::fixture_scene;
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Intersector, NormalMode};
use lampyris::model::Model;
use lampyris::simulate::scene::Interfaces;
use lampyris::simulate::{BoundScene, Results, RunSettings, simulate};
use lampyris::study::geometric_error::{ReceiverError, geometric_error};
use lampyris::study::receivers::compare_power;
use lampyris::tessellate::{self, tessellate};

struct Case {
    bound: BoundScene,
    model: Model,
    settings: RunSettings,
    exact: Exact,
}

fn case(file: &str, extra: &str, rays: u64) -> Case {
    let (scene, model, bound) = fixture_scene(file, extra);
    let settings = RunSettings { rays, threads: 2, interfaces: Interfaces::Split, ..RunSettings::from(&scene.run) };
    Case { exact: Exact::build(&model, &exact::Settings::default()), bound, model, settings }
}

impl Case {
    fn run(&self, intersector: &dyn Intersector) -> Results {
        let r = simulate(&self.bound, intersector, &self.settings, &|_| true);
        assert!(r.power.imbalance() < 1e-9 && r.lost_rays == 0, "{:?} {:?}", r.power, r.ledger.first());
        r
    }

    /// On facets of a uniform tolerance: results, and the mean sag that they reach, mm.
    fn facets(&self, tolerance: f64, normals: NormalMode) -> (Results, f64) {
        let settings =
            tessellate::Settings { tolerance: [tolerance; 2], measure: true, ..tessellate::Settings::default() };
        let made = tessellate(&self.model, &settings);
        let octree = Octree::build(&made.mesh, &octree::Settings { normals, ..Default::default() });
        (self.run(&octree), made.report.sag_mm.sampled_mean.expect("measured"))
    }
}

/// What facets change of the size of a spot: with flat normals, which throw light aside at random, the root of the difference of
/// squares; with interpolated ones, whose small errors go along with the spot's own aberrations, the difference itself.
fn change(facets: &Results, exact: &Results, receiver: usize, normals: NormalMode) -> f64 {
    let size = |r: &Results| r.receivers[receiver].rms[0].hypot(r.receivers[receiver].rms[1]);
    let (f, e) = (size(facets), size(exact));
    if normals == NormalMode::Flat { (f * f - e * e).abs().sqrt() } else { (f - e).abs() }
}

const TWO: &str = "[[receiver]]\nname = 'two'\nat = [0, 0, 107.026853]\nsize = [40, 40]\ncells = [4, 4]\nabsorbs = false\ninteractions = 2\n";
const ONE: &str =
    "[[receiver]]\nname = 'one'\nat = [0, 0, 1000]\nsize = [2000, 2000]\nabsorbs = false\ninteractions = 1\n";

/// Least-squares slope of the logarithm of the second over that of the first. Two tolerances would not do: the change of a size has
/// a sign, and near where it turns any order could be read off.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|p| (p.0.ln(), p.1.ln())).collect();
    let (x, y) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let across: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    across / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

#[test]
fn the_error_falls_with_the_sag_at_the_order_of_theory() {
    for (file, extra, rays, receiver) in
        [("s1_lens.toml", TWO, 1 << 15, 1), ("s2_lamp.toml", "", 40_000, 0), ("s3_reflector.toml", ONE, 1 << 15, 1)]
    {
        let case = case(file, extra, rays);
        let exact = case.run(&case.exact);
        let at = |tolerance: f64, normals: NormalMode| {
            let (found, sag) = case.facets(tolerance, normals);
            (sag, change(&found, &exact, receiver, normals))
        };
        // At 0.2 mm a lens has too few facets for its order.
        let all = |normals: NormalMode| [0.1, 0.05, 0.03, 0.02, 0.01].map(|tolerance| at(tolerance, normals));
        let order = slope(&all(NormalMode::Flat));
        assert!((0.4..0.6).contains(&order), "{file}, flat normals: order {order}");
        let changes = all(NormalMode::Bilinear);
        if file.starts_with("s2") {
            // What is left is below the noise of the beam's far tails.
            let (coarse, fine) = (changes[0].1, at(0.005, NormalMode::Bilinear).1);
            assert!(fine < 0.2 * coarse && fine < 0.003 * 690.0, "{file}: {coarse} and {fine} mm");
            continue;
        }
        let order = slope(&changes);
        assert!((0.8..2.2).contains(&order), "{file}, bilinear normals: order {order} of {changes:?}");
    }
}

/// The same rays on facets and on the spline: the difference of the flux is known better than the flux itself, and lies within
/// three of its own errors of what separate, longer runs differ by.
#[test]
fn paired_differences_are_sharper_than_the_flux() {
    let case = case("demo.toml", "", 60_000);
    let case = Case { settings: RunSettings { interfaces: Interfaces::Roulette, ..case.settings.clone() }, ..case };
    let made = tessellate(&case.model, &tessellate::Settings { tolerance: [0.05, 0.2], ..Default::default() });
    let octree = Octree::build(&made.mesh, &octree::Settings::default());
    let found = compare_power(&case.bound, &octree, &case.exact, &case.settings);
    let (facets, exact) = (case.run(&octree), case.run(&case.exact));
    for (pair, (f, e)) in found.iter().zip(facets.receivers.iter().zip(&exact.receivers)) {
        assert_eq!((pair.power_facets, pair.power_exact), (f.power, e.power), "the very same runs");
        assert!((pair.difference - (f.power - e.power)).abs() < 1e-9 * e.power);
        assert!(pair.difference_error < pair.power_error && pair.difference_error > 0.0, "{pair:?}");
        // Other seeds must agree within the stated error.
        let settings = RunSettings { seed: 77, ..case.settings.clone() };
        let again = compare_power(&case.bound, &octree, &case.exact, &settings);
        let other = again.iter().find(|p| p.name == pair.name).unwrap();
        let error = pair.difference_error.hypot(other.difference_error);
        assert!((pair.difference - other.difference).abs() < 4.0 * error, "{pair:?} {other:?}");
    }
}

/// A run on facets says how much wider they make the spot of S1, whose width on the spline is known in closed form: 0.800607 mm of
/// light that meets the lens twice.
#[test]
fn a_run_says_what_its_facets_do_to_a_spot() {
    let case = case("s1_lens.toml", TWO, 16_384);
    let measured = |tolerance: f64, normals: NormalMode| -> ReceiverError {
        let made =
            tessellate(&case.model, &tessellate::Settings { tolerance: [tolerance; 2], ..Default::default() });
        let octree = Octree::build(&made.mesh, &octree::Settings { normals, ..Default::default() });
        let found = geometric_error(&case.bound, [&octree, &case.exact], &case.settings);
        found.receivers.into_iter().find(|r| r.name == "two").unwrap()
    };
    let coarse = measured(0.1, NormalMode::Flat);
    let facets = coarse.width[0].facets.hypot(coarse.width[1].facets);
    let spline = coarse.width[0].spline.hypot(coarse.width[1].spline);
    assert!((spline / 0.800607 - 1.0).abs() < 2e-3, "{spline}");
    // Others find 1.2205 on facets of theirs at this tolerance.
    assert!(facets > 1.1 * spline && coarse.width[0].is_significant(), "{coarse:?}");
    assert!((coarse.power.spline / 0.917198 - 1.0).abs() < 1e-3 && coarse.power.geometric() < 1e-3, "{coarse:?}");
    let fine = measured(0.001, NormalMode::Bilinear);
    let [coarse, fine] = [coarse, fine].map(|r| r.width[0].geometric() / r.width[0].spline);
    assert!(fine < 0.01 && coarse > 10.0 * fine, "{coarse} {fine}");
}

/// The two maps of a run on facets and on the spline differ in the brightest cell, in all cells together and in power by what the
/// two whole runs differ by, within the errors that are reported.
#[test]
fn errors_of_maps_are_what_whole_runs_differ_by() {
    let case = case("s3_reflector.toml", "", 1 << 15);
    let made = tessellate(&case.model, &tessellate::Settings { tolerance: [0.2; 2], ..Default::default() });
    let octree = Octree::build(&made.mesh, &octree::Settings::default());
    let few = RunSettings { rays: 1 << 13, seed: 5, ..case.settings.clone() };
    let found = geometric_error(&case.bound, [&octree, &case.exact], &few);
    let (facets, exact) = (case.run(&octree), case.run(&case.exact));
    for (r, (f, e)) in found.receivers.iter().zip(facets.receivers.iter().zip(&exact.receivers)) {
        let off = |paired: &lampyris::study::geometric_error::Paired, difference: f64| {
            (paired.facets - paired.spline - difference).abs() / paired.error.max(1e-12)
        };
        assert!(off(&r.power, f.power - e.power) < 4.0, "{:?} {} {}", r.power, f.power, e.power);
        assert!(off(&r.rms[0], f.rms[0] - e.rms[0]) < 4.0, "{:?} {} {}", r.rms[0], f.rms[0], e.rms[0]);
        let norm = |cells: &mut dyn Iterator<Item = f64>| cells.map(|c| c * c).sum::<f64>().sqrt();
        let difference =
            norm(&mut f.cells.iter().zip(&e.cells).map(|(a, b)| a - b)) / norm(&mut e.cells.iter().copied());
        // The difference of the whole runs holds what is left of their noise.
        let told = r.map.geometric.hypot(r.map.noise);
        assert!(told < 1.5 * difference + r.map.noise, "{told} {difference} {:?}", r.map);
        assert_eq!(r.cells.len(), f.cells.len());
    }
}

/// Of light of one wavelength lumens are power times a number, and so are the errors of their cells: pooled by the rays that came,
/// not by how much each counts.
#[test]
fn errors_of_lumens_are_pooled_as_those_of_power() {
    let lumens = "[[receiver]]\nname = 'lumens'\nat = [0, 0, 990]\nsize = [2000, 2000]\ncells = [32, 32]\n\
                  absorbs = false\nchannels = 'photometric'\n";
    let case = case("s3_reflector.toml", lumens, 1 << 15);
    let made = tessellate(&case.model, &tessellate::Settings { tolerance: [0.2; 2], ..Default::default() });
    let octree = Octree::build(&made.mesh, &octree::Settings::default());
    let found = geometric_error(&case.bound, [&octree, &case.exact], &case.settings);
    let receiver = found.receivers.iter().find(|r| r.name == "lumens").unwrap();
    let channel = &receiver.channels[0];
    let efficacy = channel.total.spline / receiver.power.spline;
    for (of_power, of_lumens) in receiver.cells.iter().zip(&channel.cells) {
        assert!((of_power * efficacy - of_lumens).abs() <= 1e-4 * of_lumens, "{of_power} {efficacy} {of_lumens}");
    }
    assert!(receiver.pooled_cells < 32 && efficacy > 0.0, "{} {efficacy}", receiver.pooled_cells);
}

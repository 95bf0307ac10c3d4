//! Round receivers: solid angles and view factors in closed form, and maps that end at the rim; receivers at one place.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};
use lampyris::simulate::{ReceiverResult, Results, RunSettings, Scene, arrivals};
use std::f64::consts::PI;
use std::path::Path;

/// Standard errors that a figure may be off.
const SIGMAS: f64 = 4.0;

fn trace(scene: &str) -> Results {
    World::default().run(&format!("[run]\nrays = 200_000\n{scene}"), |_| {})
}

fn assert_near(receiver: &ReceiverResult, expected: f64) {
    let (found, error) = (receiver.power, receiver.power_error);
    assert!(error > 0.0 && (found - expected).abs() < SIGMAS * error, "{}: {found} ± {error}", receiver.name);
}

/// A point at the height h over the middle of a disc of radius a sends it (1 − h/√(h² + a²))/2 of its power, from either side, and to a
/// one-sided disc from before it only.
#[test]
fn a_disc_gets_its_solid_angle() {
    let disc = |name: &str, more: &str| {
        format!("[[receiver]]\nname = '{name}'\nkind = 'disc'\nradius = 3\ncells = [20, 20]\n{more}\n")
    };
    let receivers = [
        disc("front", "at = [0, 0, -4]"),
        disc("aside", "at = [4, 0, 0]\nnormal = [1, 0, 0]"),
        disc("passed", "at = [0, 4, 0]\nnormal = [0, -1, 0]\nabsorbs = false\none_sided = true"),
        disc("behind", "at = [0, -4, 0]\nnormal = [0, -1, 0]\none_sided = true"),
    ];
    let r = trace(&format!("[[source]]\n{}", receivers.concat()));
    for receiver in &r.receivers[..3] {
        assert_near(receiver, 0.5 * (1.0 - 4.0 / 5.0));
    }
    assert_eq!(r.receivers[3].power, 0.0);
}

/// What one disc takes the surroundings lack: both have the error of one and the same spread, near the binomial one of rays by chance or,
/// for rays drawn evenly, below it.
#[test]
fn what_escapes_has_the_error_of_what_is_received() {
    // As many rays in each of 128 replicates, so that each has its whole share.
    let rays = 128.0 * 1600.0;
    let scene = "[[receiver]]\nname = 'disc'\nkind = 'disc'\nradius = 3\nat = [0, 0, -4]\ncells = [20, 20]\n";
    let r = World::default().run(&format!("[run]\nrays = {rays}\n[[source]]\n{scene}"), |_| {});
    let errors = r.power_errors;
    assert_eq!(errors.emitted, 0.0);
    assert!((errors.escaped / errors.received - 1.0).abs() < 1e-3, "{errors:?}");
    let by_chance = (0.1f64 * 0.9 / rays).sqrt();
    assert!(errors.received > 0.05 * by_chance && errors.received < 1.5 * by_chance, "{errors:?} {by_chance}");
    assert!((r.power.escaped - 0.9).abs() < SIGMAS * errors.escaped, "{} {errors:?}", r.power.escaped);
    // 23 or 24 rays in each: where all light escapes, that is no error of it.
    let all = World::default().run("[run]\nrays = 3000\n[[source]]\n", |_| {});
    assert!((all.power.escaped - 1.0).abs() < 1e-12 && all.power_errors.escaped < 1e-6, "{:?}", all.power_errors);
}

/// Of two sources whose rays do not divide evenly the one has a ray more in the replicates in which the other has one fewer. What a zone of
/// 80° gets of both, 3·sin² 80° of 3 W, is off by as much as its error says.
#[test]
fn the_error_of_light_of_several_sources_is_that_of_the_seeds() {
    let expected = 3.0 * 80f64.to_radians().sin().powi(2);
    let seeds = 1..=24;
    let off = |seed: u32| {
        let scene = format!(
            "[run]\nrays = 10240\nseed = {seed}\n[[source]]\nkind = 'lambertian'\npower = 2\n\
             [[source]]\nkind = 'lambertian'\nat = [20, 0, 0]\npower = 1\n\
             [[receiver]]\nname = 'zone'\nkind = 'far_field'\nangles = 'C'\nh_deg = [0, 360]\nv_deg = [0, 80]\ncells = [1, 1]\n"
        );
        let run = World::default().run(&scene, |_| {});
        let zone = &run.receivers[0];
        ((zone.power - expected) / zone.power_error).powi(2)
    };
    let squares = seeds.clone().map(off).sum::<f64>() / seeds.count() as f64;
    assert!((0.3..2.5).contains(&squares), "{squares}");
}

/// Light of unequal replicates that all falls on a receiver is known; of light that nearly all does, the error is that of the rays beside
/// it, a binomial one: not 2.7 rays of 5000, which is what 39 or 40 rays in each of 128 replicates spread by.
#[test]
fn unequal_replicates_are_no_error_of_a_receiver() {
    let screen = |size: f64| {
        format!(
            "[run]\nrays = 5000\nsampling = 'random'\n[[source]]\nkind = 'collimated'\nradius = 1\n\
             [[receiver]]\nname = 'screen'\nat = [0, 0, 5]\nsize = [{size}, 4]\ncells = [2, 2]\n\
             [[receiver]]\nname = 'behind'\nkind = 'far_field'\ncells = [2, 2]\n"
        )
    };
    let whole = World::default().run(&screen(4.0), |_| {});
    let all = &whole.receivers[0];
    assert!((all.power - 1.0).abs() < 1e-12 && all.power_error < 1e-9, "{} {}", all.power, all.power_error);
    // Two segments are beside a screen of half width h: 2·(acos h − h·√(1 − h²))/π of the disc.
    let h = 0.98f64;
    let missed = 2.0 * (h.acos() - h * (1.0 - h * h).sqrt()) / PI;
    let expected = (missed * (1.0 - missed) / 5000.0).sqrt();
    let nearly = World::default().run(&screen(2.0 * h), |_| {});
    let error = nearly.receivers[0].power_error;
    assert!(error > 0.5 * expected && error < 1.6 * expected, "{error} {expected}");
    assert!((nearly.receivers[0].power - (1.0 - missed)).abs() < SIGMAS * error);
}

/// Between parallel coaxial discs of radii a and b at the distance h the view factor is (S − √(S² − 4b²/a²))/2 with
/// S = 1 + (h² + b²)/a² (Howell, C-41).
#[test]
fn a_disc_gets_its_view_factor_of_another() {
    let (a, b, h) = (2.0f64, 3.0f64, 5.0f64);
    let s = 1.0 + (h * h + b * b) / (a * a);
    let expected = 0.5 * (s - (s * s - 4.0 * b * b / (a * a)).sqrt());
    let r = trace(
        "[[source]]\nkind = 'lambertian'\nradius = 2\n[[receiver]]\nname = 'disc'\nkind = 'disc'\nat = [0, 0, 5]\nradius = 3\n",
    );
    assert_near(&r.receivers[0], expected);
}

/// Parallel light of 1 W on a disc of 2 mm falls on a detector of 4 mm, and on one of 1 mm, which gets a quarter evenly: 1/4π W/mm²
/// everywhere, ½ mm from the middle along each axis in the mean square.
#[test]
fn a_map_ends_at_the_rim() {
    let r = trace(
        "[[source]]\nkind = 'collimated'\nradius = 2\n[[receiver]]\nname = 'whole'\nkind = 'disc'\nat = [0, 0, 1]\nradius = 4\nabsorbs = false
        [[receiver]]\nname = 'part'\nkind = 'disc'\nat = [0, 0, 2]\nradius = 1\ncells = [11, 10]\n",
    );
    let [whole, part] = [&r.receivers[0], &r.receivers[1]];
    assert!((whole.power - 1.0).abs() < 1e-12 && (whole.farthest - 2.0).abs() < 1e-3, "{}", whole.farthest);
    assert_near(part, 0.25);
    assert!((part.farthest - 1.0).abs() < 1e-3 && part.farthest <= 1.0, "{}", part.farthest);
    for axis in 0..2 {
        assert!((part.rms[axis] - 0.5).abs() < SIGMAS * part.rms_error[axis], "{:?}", part.rms);
    }
    // Every cell on the disc has the same irradiance, none off it has any, and the least is that of the light.
    let expected = 1e6 / (4.0 * PI);
    let off = |k: &usize| part.off.contains(k);
    for k in (0..110).filter(|k| !off(k)) {
        let (found, error) = (part.cells[k], part.errors[k]);
        assert!((found - expected).abs() < 5.0 * error, "{k}: {found} ± {error}");
    }
    assert!(part.min > 0.5 * expected && part.off.iter().all(|&k| part.cells[k] == 0.0));
    // Those whose middles are off it.
    let middle = |k: usize| [((k % 11) as f64 - 5.0) / 5.5, ((k / 11) as f64 - 4.5) / 5.0];
    let beyond = |k: &usize| middle(*k)[0].hypot(middle(*k)[1]) > 1.0;
    assert_eq!(part.off, (0..110).filter(beyond).collect::<Vec<_>>());
}

/// Light of 587.56 nm is in a bin from 500 to 600 nm, and in none from 600 nm on.
#[test]
fn light_that_no_channel_counts_is_told() {
    let is_told = |bins: &str| {
        let scene = format!(
            "[run]\nrays = 1000\n[[source]]\nkind = 'collimated'\nradius = 1\n\
             [[receiver]]\nname = 'screen'\nat = [0, 0, 5]\nsize = [4, 4]\ncells = [2, 2]\nbins_nm = {bins}\n"
        );
        let run = World::default().run(&scene, |_| {});
        run.notes.iter().any(|note| note.contains("came to 'screen' is of wavelengths"))
    };
    assert!(is_told("[600, 700]") && !is_told("[500, 600]"));
}

/// Two receivers at one place of which one ends light and the other lets it pass.
fn coinciding(passing: &str, ending: &str, passing_first: bool) -> String {
    let passing = format!("[[receiver]]\nname = 'passing'\n{passing}\nabsorbs = false\n");
    let ending = format!("[[receiver]]\nname = 'ending'\n{ending}\n");
    if passing_first { passing + &ending } else { ending + &passing }
}

/// All light of a watt comes to both receivers of a scene, and every ray that was recorded.
fn assert_both_count_all(world: &World, text: &str) {
    let results = world.run(text, |s| s.path_samples = s.rays);
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    for (k, receiver) in results.receivers.iter().enumerate() {
        assert!((receiver.power - 1.0).abs() < 1e-9, "{}: {} W of\n{text}", receiver.name, receiver.power);
        let arrived = arrivals(&bound, &RunSettings::from(&scene.run), k, &results).len();
        assert_eq!(arrived, 1000, "{} of\n{text}", receiver.name);
    }
}

/// Light that ends on a receiver has come to its place: one there that lets light pass counts all of it, whichever stands first in the
/// scene, turned to either side, and in the box around the scene (the beam of radius 10) or outside of it (9.9).
#[test]
fn a_receiver_that_lets_light_pass_counts_it_at_one_that_ends_it() {
    let (small, large) = ("kind = 'disc'\nradius = 80", "kind = 'disc'\nradius = 90");
    let (square, wide) = ("size = [160, 160]", "size = [180, 180]");
    for (passing, ending) in [(small, large), (square, wide), (small, wide), (square, large)] {
        for [normal, other] in [["[0, 0, 1]"; 2], ["[0.1, 0.3, 1]"; 2], ["[-0.1, -0.3, -1]", "[0.1, 0.3, 1]"]] {
            let place = |shape: &str, normal: &str| format!("{shape}\nat = [0, 0, 40]\nnormal = {normal}");
            for (radius, passing_first) in [(10.0, true), (10.0, false), (9.9, true), (9.9, false)] {
                let text = format!(
                    "[run]\nrays = 1000\n[[source]]\nkind = 'collimated'\nat = [0, 0, 50]\ndirection = [0, 0, -1]\nradius = {radius}\n{}",
                    coinciding(&place(passing, normal), &place(ending, other), passing_first)
                );
                assert_both_count_all(&World::default(), &text);
            }
        }
    }
}

/// The same behind a flat mirror that turns the beam by a right angle, within its box and outside of it.
#[test]
fn receivers_at_one_place_count_what_a_mirror_sends_there() {
    let mut world = World::default();
    let frame = Frame::from_axis(Point::ZERO, Vector::new(1.0, 0.0, 1.0), Some(Vector::Y));
    world.part("mirror", false, &[("front", Shape::Rectangle { frame, half: [10.0, 10.0] })]);
    for (x, passing_first) in [(3.0, true), (3.0, false), (400.0, true), (400.0, false)] {
        let place = |shape: &str| format!("{shape}\nat = [{x}, 0, 0]\nnormal = [1, 0, 0]");
        for (passing, ending) in
            [("kind = 'disc'\nradius = 2", "size = [5, 5]"), ("size = [3, 3]", "kind = 'disc'\nradius = 2.5")]
        {
            let text = format!(
                "[run]\nrays = 1000\n[[material]]\npart = 'mirror'\nsurface = 'mirror'\nreflectance = 1\n\
                 [[source]]\nkind = 'collimated'\nat = [0, 0, 50]\ndirection = [0, 0, -1]\nradius = 1\n{}",
                coinciding(&place(passing), &place(ending), passing_first)
            );
            assert_both_count_all(&world, &text);
        }
    }
}

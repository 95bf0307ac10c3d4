//! Sources flush with the face of a body: they start in what the scene says that they are inside of, in the face and within the glue
//! distance to either side of it; where it says nothing they start inside, and a note says so.

use crate::support::{Shape, World};
use lampyris::formats::{LightRay, write_rays};
use lampyris::math::{Frame, Point, Vector};
use lampyris::simulate::{Hooks, PartialRun, Results, RunSettings, Scene, trace};
use std::path::Path;

/// Heights over a face, mm: in it, as rounding puts it, and up to the glue distance of 1e-3 to either side.
const HEIGHTS: [f64; 7] = [0.0, 1e-9, -1e-9, 5e-4, -5e-4, 9.9e-4, -9.9e-4];

/// All light that is reflected is followed; what goes up ends on the first receiver, what goes down on the second.
const SPLIT: &str = "[run]\nrays = 2000\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 0\n
    [[receiver]]\nname = 'above'\nat = [0, 0, 20]\nsize = [500, 500]
    [[receiver]]\nname = 'below'\nat = [0, 0, -20]\nsize = [500, 500]\n";

/// A wide plate of index 1.5, 3 mm thick, that stands on z = 0.
fn plate() -> World {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-1e3, -1e3, 0.0), Point::new(1e3, 1e3, 3.0));
    world
}

/// The medium of a part.
fn medium(part: &str, index: f64) -> String {
    format!(
        "[[medium]]\nname = 'of {part}'\nindex = {index}\n[[material]]\npart = '{part}'\nmedium = 'of {part}'\n"
    )
}

/// Returns what an interface reflects of unpolarised light, by the sines on both sides.
fn reflectance(sin_i: f64, n1: f64, n2: f64) -> f64 {
    let sin_t = sin_i * n1 / n2;
    let [cos_i, cos_t] = [sin_i, sin_t].map(|sin| (1.0 - sin * sin).sqrt());
    let s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t);
    let p = (n2 * cos_i - n1 * cos_t) / (n2 * cos_i + n1 * cos_t);
    0.5 * (s * s + p * p)
}

/// Of a plate whose faces reflect r, (1 − r)/(1 + r) comes through from outside, and 1/(1 + r) of what starts up inside of it. That holds
/// up to 60° off the normal, where the face lies twice as far along the ray as across.
#[test]
fn a_flush_source_starts_in_what_the_scene_says() {
    for sin_outside in [0.0, 0.75f64.sqrt()] {
        let r = reflectance(sin_outside, 1.0, 1.5);
        let cases = [
            ("inside = []", sin_outside, [(1.0 - r) / (1.0 + r), 2.0 * r / (1.0 + r)]),
            ("inside = 'plate'", sin_outside / 1.5, [1.0 / (1.0 + r), r / (1.0 + r)]),
        ];
        for (inside, sin, expected) in cases {
            let cos = (1.0 - sin * sin).sqrt();
            for height in HEIGHTS {
                let text = format!(
                    "{SPLIT}{}[[source]]\nkind = 'collimated'\nat = [0, 0, {height:?}]\ndirection = [{sin:?}, 0, {cos:?}]\n{inside}\n",
                    medium("plate", 1.5)
                );
                let results = plate().run(&text, |_| ());
                assert_eq!(results.lost_rays, 0, "{inside} {sin} {height}: {:?}", results.ledger.first());
                for (receiver, expected) in results.receivers.iter().zip(expected) {
                    let power = receiver.power;
                    assert!((power - expected).abs() < 1e-5, "{inside} {sin} {height}: {power}, not {expected}");
                }
            }
        }
    }
}

/// The same where light goes out of the plate by its upper face: from inside a part of it is reflected there, from outside none.
#[test]
fn a_source_in_the_face_by_which_its_light_goes_out_starts_where_the_scene_says() {
    let r = reflectance(0.0, 1.0, 1.5);
    for (inside, above) in [("inside = []", 1.0), ("inside = 'plate'", 1.0 / (1.0 + r))] {
        for height in HEIGHTS {
            let text = format!(
                "{SPLIT}{}[[source]]\nkind = 'collimated'\nat = [0, 0, {:?}]\nradius = 2\n{inside}\n",
                medium("plate", 1.5),
                3.0 + height
            );
            let results = plate().run(&text, |_| ());
            assert_eq!(results.lost_rays, 0, "{inside} {height}: {:?}", results.ledger.first());
            let power = results.receivers[0].power;
            assert!((power - above).abs() < 1e-5, "{inside} {height}: {power}, not {above}");
        }
    }
}

/// Of diffuse light glass reflects Walsh's 0.091778; its far side is black. Grazing rays have the face far along their way.
#[test]
fn diffuse_sources_of_any_shape_may_be_flush() {
    let black = "[[material]]\nface = 'z1'\nsurface = 'absorber'\n";
    for shape in ["", "radius = 2", "size = [3, 4]"] {
        for height in HEIGHTS {
            let text = format!(
                "[run]\nrays = 4000\ninterfaces = 'split'\n{}{black}
                [[source]]\nkind = 'lambertian'\nat = [0, 0, {height:?}]\ninside = []\n{shape}\n",
                medium("plate", 1.5)
            );
            let results = plate().run(&text, |_| ());
            assert_eq!(results.lost_rays, 0, "{shape} {height}: {:?}", results.ledger.first());
            // Shares of rays spread by 0.13: 1σ of independent ones is 0.002.
            let reflected = results.power.escaped;
            assert!((reflected - 0.091778).abs() < 0.008, "{shape} {height}: {reflected}");
        }
    }
}

/// Two plates that touch: light starts in the one that the scene names, through the face between them or behind it. With a and b the shares
/// of light going up in the lower and in the upper one: b = t + r₃ D, with what comes back down, D = b (r₂ + (1 − r₂)² r₁/(1 − r₁ r₂)).
#[test]
fn a_source_between_touching_bodies_starts_in_the_one_that_is_named() {
    let [r1, r2, r3] = [(1.0, 1.5), (1.5, 1.7), (1.7, 1.0)].map(|(n1, n2)| reflectance(0.0, n1, n2));
    let back = r2 + (1.0 - r2).powi(2) * r1 / (1.0 - r1 * r2);
    let upper = (1.0 - r3) / (1.0 - r3 * back);
    let lower = upper * (1.0 - r2) / (1.0 - r1 * r2);
    let mut world = World::default();
    world.cuboid("lower", Point::new(-1e3, -1e3, -3.0), Point::new(1e3, 1e3, 0.0)).cuboid(
        "upper",
        Point::new(-1e3, -1e3, 0.0),
        Point::new(1e3, 1e3, 3.0),
    );
    for (inside, expected) in [("'lower'", Some(lower)), ("'upper'", Some(upper)), ("[]", None)] {
        for height in HEIGHTS {
            let text = format!(
                "{SPLIT}{}{}[[source]]\nkind = 'collimated'\nat = [0, 0, {height:?}]\nradius = 2\ninside = {inside}\n",
                medium("lower", 1.5),
                medium("upper", 1.7)
            );
            let results = world.run(&text, |_| ());
            assert_eq!(results.lost_rays, 0, "{inside} {height}: {:?}", results.ledger.first());
            let power = results.receivers[0].power;
            let is_right = expected.is_none_or(|expected| (power - expected).abs() < 1e-5);
            assert!(is_right, "{inside} {height}: {power}, not {expected:?}");
        }
    }
}

/// A plate half as thick as the glue distance, of which light that goes away from it, drawn on either side, crosses nothing, and light that
/// goes towards it both faces, wherever within the glue distance of one or both it is drawn; inside of it starts what is stated to.
#[test]
fn sources_beside_a_thin_plate_stay_on_their_side() {
    let r = reflectance(0.0, 1.0, 1.5);
    let mut world = World::default();
    world.cuboid("plate", Point::new(-1e3, -1e3, -2.5e-4), Point::new(1e3, 1e3, 2.5e-4));
    for offset in [0.0, 1e-4, 6e-4, 9e-4, 1.1e-3] {
        for (side, direction) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            // What goes on along its direction, and what comes back.
            let outside = if side == direction { [1.0, 0.0] } else { [(1.0 - r) / (1.0 + r), 2.0 * r / (1.0 + r)] };
            for (inside, expected) in [("[]", outside), ("'plate'", [1.0 / (1.0 + r), r / (1.0 + r)])] {
                if inside == "'plate'" && offset > 6e-4 {
                    continue;
                }
                let height = side * (2.5e-4 + offset);
                let text = format!(
                    "{SPLIT}{}[[source]]\nkind = 'collimated'\nat = [0, 0, {height:?}]\ndirection = [0, 0, {direction:?}]\nradius = 2
                    inside = {inside}\n",
                    medium("plate", 1.5)
                );
                let results = world.run(&text, |_| ());
                assert_eq!(results.lost_rays, 0, "{inside} {height} {direction}: {:?}", results.ledger.first());
                let [above, below] = [results.receivers[0].power, results.receivers[1].power];
                let powers = if direction > 0.0 { [above, below] } else { [below, above] };
                for (power, expected) in powers.into_iter().zip(expected) {
                    assert!(
                        (power - expected).abs() < 1e-5,
                        "{inside} {height} {direction}: {power}, not {expected}"
                    );
                }
            }
        }
    }
}

/// Light that is drawn at the outer face of a film on a plate, nearer to it than to the plate, and shines away has both behind it.
#[test]
fn a_source_on_a_film_shines_away_from_it() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-1e3, -1e3, -3.0), Point::new(1e3, 1e3, -5e-4)).cuboid(
        "film",
        Point::new(-1e3, -1e3, -5e-4),
        Point::new(1e3, 1e3, 0.0),
    );
    for height in [0.0, 1e-9, -1e-9, 1e-4, -1e-4, 6e-4, 1.2e-3] {
        let text = format!(
            "{SPLIT}{}{}[[source]]\nkind = 'collimated'\nat = [0, 0, {height:?}]\nradius = 2\ninside = []\n",
            medium("plate", 1.5),
            medium("film", 1.7)
        );
        let results = world.run(&text, |_| ());
        assert_eq!(results.lost_rays, 0, "{height}: {:?}", results.ledger.first());
        let power = results.receivers[0].power;
        assert!((power - 1.0).abs() < 1e-9, "{height}: {power}");
    }
}

/// A black sheet half a glue distance over a plate, and beside it, takes all light of a source that lies in the face of the plate and
/// reaches beyond its edge: starts are moved past no sheet, and those that nothing else is near not at all.
#[test]
fn flush_sources_stay_before_a_sheet() {
    let mut world = World::default();
    let frame = Frame::translation(Point::new(0.0, 0.0, 5e-4));
    world.cuboid("plate", Point::new(-1e3, -1e3, -3.0), Point::new(0.0, 1e3, 0.0)).part(
        "sheet",
        false,
        &[("up", Shape::Rectangle { frame, half: [1e3, 1e3] })],
    );
    let text = format!(
        "{SPLIT}{}[[material]]\npart = 'sheet'\nsurface = 'absorber'\n
        [[source]]\nkind = 'collimated'\nat = [0, 0, 0]\nsize = [2, 2]\ninside = []\n",
        medium("plate", 1.5)
    );
    let results = world.run(&text, |_| ());
    assert_eq!(results.lost_rays, 0, "{:?}", results.ledger.first());
    assert_eq!((results.receivers[0].power, results.receivers[1].power), (0.0, 0.0));
}

/// Rays that were recorded in the plane of a face come through both faces where the scene says that they are in no body, and through one
/// where it says nothing.
#[test]
fn recorded_rays_may_start_in_a_face() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("list.csv");
    let ray = |k: u32| LightRay {
        origin: Point::new(f64::from(k), 0.0, 0.0),
        direction: Vector::Z,
        power: 1.0,
        wavelength_nm: None,
    };
    write_rays(&file, &(0..8).map(ray).collect::<Vec<_>>()).unwrap();
    for (inside, expected) in [("inside = []", 0.96 / 1.04), ("", 1.0 / 1.04)] {
        let text = format!(
            "{SPLIT}{}[[source]]\nkind = 'rays'\npower = 1\nfile = '{}'\n{inside}\n",
            medium("plate", 1.5),
            file.display()
        );
        let results = plate().run(&text, |_| ());
        assert_eq!(results.lost_rays, 0, "{inside}: {:?}", results.ledger.first());
        let power = results.receivers[0].power;
        assert!((power - expected).abs() < 1e-5, "{inside}: {power}, not {expected}");
        assert_eq!(is_told(&results), inside.is_empty(), "{inside}: {:?}", results.notes);
    }
}

/// Whether a note says that a source lies in a face that it shines into.
fn is_told(results: &Results) -> bool {
    results.notes.iter().any(|note| note.contains("shines into it"))
}

/// Light that starts in the face of a plate comes through one of its faces where the scene does not say what it is in, and a note says so,
/// with the face. Clear of the glue distance it comes through two.
#[test]
fn a_flush_source_of_which_nothing_is_said_is_told() {
    let mut world = plate();
    world.model.parts[0].shells[0].faces[4].entity = Some(109);
    let through = [0.96 / 1.04, 1.0 / 1.04];
    for (height, told) in [(0.0, true), (5e-4, true), (-5e-4, true), (-2e-3, false)] {
        let source = format!("[[source]]\nkind = 'collimated'\nat = [0, 0, {height:?}]\nradius = 2\n");
        let results = world.run(&format!("{SPLIT}{}{source}", medium("plate", 1.5)), |_| ());
        let (power, expected) = (results.receivers[0].power, through[usize::from(told)]);
        assert!((power - expected).abs() < 1e-5, "{height}: {power}, not {expected}");
        let words = "[[source]] 1 lies in face #109 of 'plate' and shines into it: light that starts so, 2000 rays in all, is taken";
        assert_eq!(results.notes.iter().any(|note| note.starts_with(words)), told, "{height}: {:?}", results.notes);
    }
}

/// No note is given for light that goes away from the face, of a face that shines itself, where the scene says what the source is in, and
/// where the face does nothing to light or lets none in.
#[test]
fn flush_sources_that_are_meant_so_are_not_told() {
    let glass = medium("plate", 1.5);
    let hollow = medium("plate", 1.0);
    let opaque = format!("{glass}[[material]]\npart = 'plate'\nsurface = 'absorber'\n");
    for (media, source, told) in [
        (&glass, "kind = 'point'", true),
        (&glass, "kind = 'lambertian'\nsize = [1, 1]", true),
        (&glass, "kind = 'lambertian'\ndirection = [0, 0, -1]\nsize = [1, 1]", false),
        (&glass, "kind = 'lambertian'\nat = [0, 0, 3]\nsize = [1, 1]", false),
        (&glass, "kind = 'lambertian'\non = { part = 'plate', face = 'z0' }", false),
        (&glass, "kind = 'lambertian'\ninside = []", false),
        (&glass, "kind = 'lambertian'\ninside = 'plate'", false),
        (&hollow, "kind = 'lambertian'", false),
        (&opaque, "kind = 'lambertian'", false),
    ] {
        let results = plate().run(&format!("[run]\nrays = 500\n{media}[[source]]\n{source}\n"), |_| ());
        assert_eq!(is_told(&results), told, "{media} {source}: {:?}", results.notes);
    }
    // On a black die, glued under the plate.
    let mut world = plate();
    world.cuboid("die", Point::new(-1.0, -1.0, -1.0), Point::new(1.0, 1.0, 0.0));
    let text = format!(
        "[run]\nrays = 500\n{glass}[[material]]\npart = 'die'\nsurface = 'absorber'
        [[source]]\nkind = 'lambertian'\nradius = 0.5\n"
    );
    let results = world.run(&text, |_| ());
    assert!(!is_told(&results), "{:?}", results.notes);
}

/// In the contact of two plates light goes from one into the other: that is reported where their indices differ, and not where they are the
/// same, whatever is around them.
#[test]
fn a_source_between_plates_is_told_where_they_differ() {
    let mut world = plate();
    world.cuboid("lower", Point::new(-1e3, -1e3, -3.0), Point::new(1e3, 1e3, 0.0));
    for (index, told) in [(1.5, false), (1.7, true)] {
        let media = medium("plate", 1.5) + &medium("lower", index);
        let source = "[[source]]\nkind = 'collimated'\nradius = 2\n";
        let results = world.run(&format!("[run]\nrays = 500\n{media}{source}"), |_| ());
        assert_eq!(is_told(&results), told, "{index}: {:?}", results.notes);
    }
}

/// Whether too few rays start in a face for a note is judged by the rays of their source, however many others send.
#[test]
fn flush_sources_are_told_by_their_own_rays() {
    let text = format!(
        "[run]\nrays = 40_000\nreplicates = 8\n{}[[source]]\nkind = 'collimated'\nrays = 2\n
        [[source]]\nkind = 'collimated'\nat = [0, 0, 9]\n",
        medium("plate", 1.5)
    );
    let results = plate().run(&text, |_| ());
    assert!(is_told(&results), "{:?}", results.notes);
}

/// What a source of fewer rays than replicates lies in is found wherever its rays are: of 128 replicates every other one was probed.
#[test]
fn sources_of_few_rays_know_what_they_lie_in() {
    for rays in [1, 2, 32, 100] {
        let text = format!(
            "{}{}[[source]]\nkind = 'collimated'\nat = [0, 0, 1]\nrays = {rays}\n
            [[source]]\nkind = 'collimated'\nat = [0, 0, 9]\n",
            SPLIT.replace("rays = 2000", "rays = 4000"),
            medium("plate", 1.5)
        );
        let results = plate().run(&text, |_| ());
        assert_eq!(results.lost_rays, 0, "{rays}: {:?}", results.ledger.first());
        // Half of the light starts in the plate, and all of what comes down has gone through its lower face.
        assert!(results.receivers[1].power > 1e-3, "{rays}: {}", results.receivers[1].power);
    }
}

/// What is known of flush sources outlives the file of a part of a run and the sum of two.
#[test]
fn parts_of_a_run_know_of_flush_sources() {
    let world = plate();
    let text = format!("[run]\nrays = 2000\n{}[[source]]\nkind = 'collimated'\n", medium("plate", 1.5));
    let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let part = |shard: u32| {
        let settings = RunSettings { threads: 1, shard: [shard, 2], ..RunSettings::from(&scene.run) };
        let partial = trace(&bound, &world, &settings, None, &Hooks::with_progress(&|_| true)).partial;
        let mut bytes = Vec::new();
        partial.write(&(), &mut bytes).unwrap();
        let (_, read) = PartialRun::read_alone::<()>(&bytes).unwrap();
        assert_eq!(read.tallies.counts, partial.tallies.counts);
        read
    };
    let mut sum = part(0);
    sum.merge(&part(1)).unwrap();
    let counts = sum.tallies.counts;
    assert_eq!((counts.flush_starts, counts.flush_place), (2000, [0, 4]));
}

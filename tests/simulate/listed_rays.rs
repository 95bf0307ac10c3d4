//! What became of each ray of a list: ends, faces and powers that can be computed by hand.

use crate::support::World;
use lampyris::formats::{Flux, LightRay, Tm25, write_rays, write_tm25};
use lampyris::math::{Point, Vector};
use lampyris::simulate::{Event, ListedEnd, LostCause, RunSettings, Scene, listed_ends, simulate};

/// The face of the first cuboid that looks down.
const BLACK: u32 = 4;

fn ray(x: f64, direction: Vector, power: f64) -> LightRay {
    LightRay { origin: Point::new(x, 0.0, 0.0), direction: direction.normalize(), power, wavelength_nm: None }
}

#[test]
fn every_ray_of_a_list_tells_where_it_ended() {
    let mut world = World::default();
    world.cuboid("black", Point::new(9.0, -1.0, 5.0), Point::new(11.0, 1.0, 6.0)).cuboid(
        "mirror",
        Point::new(19.0, -1.0, 5.0),
        Point::new(21.0, 1.0, 6.0),
    );
    let slanted = Vector::new(0.6, 0.0, 0.8);
    let rays = [
        ray(0.0, Vector::Z, 1.0),
        ray(10.0, Vector::Z, 2.0),
        ray(20.0 - 3.75, slanted, 4.0),
        ray(0.0, -Vector::Y, 3.0),
        // Too weak to be drawn in the run below.
        ray(10.0, Vector::Z, 0.0),
    ];
    let folder = tempfile::tempdir().unwrap();
    write_rays(&folder.path().join("list.csv"), &rays).unwrap();
    let text = "[run]\nrays = 64
        [[source]]\nkind = 'rays'\nfile = 'list.csv'\npower = 20
        [[material]]\npart = 'mirror'\nsurface = 'mirror'\nreflectance = 0.75
        [[receiver]]\nname = 'wall'\nat = [0, 0, 30]\nsize = [2, 2]\n";
    let scene = Scene::parse(text, "test.toml", folder.path()).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let settings = |threads| RunSettings { threads, ..RunSettings::from(&scene.run) };
    let found = listed_ends(&bound, &world, &settings(1));
    assert_eq!(found, listed_ends(&bound, &world, &settings(3)));
    // Twice the powers of the list, as the source has 20 of its 10.
    let end = |ray: u64, event: Event, face: Option<u32>, power: f64| ListedEnd {
        source: 0,
        ray,
        branch: 0,
        event,
        face,
        bounces: 0,
        point: Point::new(10.0, 0.0, 5.0),
        direction: Vector::Z,
        power,
    };
    // Light that leaves is reported 100 mm on its way.
    let expected = [
        ListedEnd { point: Point::new(0.0, 0.0, 30.0), ..end(0, Event::Received, None, 2.0) },
        end(1, Event::Absorbed, Some(BLACK), 4.0),
        ListedEnd {
            bounces: 1,
            point: Point::new(80.0, 0.0, -75.0),
            direction: Vector::new(0.6, 0.0, -0.8),
            ..end(2, Event::Escaped, None, 0.75 * 8.0)
        },
        ListedEnd {
            point: Point::new(0.0, -100.0, 0.0),
            direction: -Vector::Y,
            ..end(3, Event::Escaped, None, 6.0)
        },
        end(4, Event::Absorbed, Some(BLACK), 0.0),
    ];
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(&expected) {
        assert!((a.point - b.point).length() < 1e-9 && (a.direction - b.direction).length() < 1e-9, "{a:?}");
        assert!((a.power - b.power).abs() < 1e-9, "{a:?}");
        let rounded = ListedEnd { point: b.point, direction: b.direction, power: b.power, ..*a };
        assert_eq!(rounded, *b);
    }
    // The mirror took the rest, as the run says too.
    let run = simulate(&bound, &world, &settings(1), &|_| true);
    let mirror = run.absorbed.iter().find(|a| a.name == "mirror").unwrap();
    assert!((mirror.power - 2.0).abs() < 0.6, "{}", mirror.power);
}

/// A ray that cannot start, because it is in more bodies than it can carry, is reported where it stands in the scene.
#[test]
fn a_ray_that_cannot_start_is_placed_in_the_scene() {
    let mut world = World::default();
    let mut text =
        "[run]\nrays = 64\n[[source]]\nkind = 'rays'\nfile = 'list.csv'\nat = [100, 0, 0]\ndirection = [0, 1, 0]\n\
        [[medium]]\nname = 'glass'\nindex = 1.5\n"
            .to_owned();
    for k in 0..40 {
        let (name, half) = (format!("shell{k}"), Vector::splat(1.0 + 0.1 * f64::from(k)));
        let middle = Point::new(100.0, 0.0, 0.0);
        world.cuboid(&name, middle - half, middle + half);
        text += &format!("[[material]]\npart = '{name}'\nmedium = 'glass'\n");
    }
    let folder = tempfile::tempdir().unwrap();
    write_rays(&folder.path().join("list.csv"), &[ray(0.0, Vector::Z, 1.0)]).unwrap();
    let scene = Scene::parse(&text, "test.toml", folder.path()).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    // As many threads as the machine has.
    let found = listed_ends(&bound, &world, &RunSettings { threads: 0, ..RunSettings::from(&scene.run) });
    assert_eq!((found.len(), found[0].event), (1, Event::Lost));
    assert_eq!((found[0].point, found[0].direction), (Point::new(100.0, 0.0, 0.0), Vector::Y));
}

/// Of light at 100 1/mm nothing is left after a millimetre: it ends in the block, not behind it, and not at the face that it would meet.
#[test]
fn light_that_a_medium_swallows_ends_there() {
    let mut world = World::default();
    world.cuboid("block", Point::new(-1.0, -1.0, 5.0), Point::new(1.0, 1.0, 6.0));
    let folder = tempfile::tempdir().unwrap();
    write_rays(&folder.path().join("list.csv"), &[ray(0.0, Vector::Z, 1.0)]).unwrap();
    let text = "[run]\nrays = 64\n[[source]]\nkind = 'rays'\nfile = 'list.csv'
        [[medium]]\nname = 'ink'\nindex = 1\nabsorption_per_mm = 100
        [[material]]\npart = 'block'\nmedium = 'ink'
        [[receiver]]\nname = 'wall'\nat = [0, 0, 30]\nsize = [2, 2]\n";
    let scene = Scene::parse(text, "test.toml", folder.path()).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let settings = RunSettings { path_samples: 8, ..RunSettings::from(&scene.run) };
    let [end] = &listed_ends(&bound, &world, &settings)[..] else { panic!("one end") };
    assert_eq!((end.event, end.face, end.bounces, end.power), (Event::Absorbed, None, 1, 0.0));
    assert!((end.point - Point::new(0.0, 0.0, 6.0)).length() < 1e-9, "{end:?}");
    // Paths that are drawn end there too.
    let run = simulate(&bound, &world, &settings, &|_| true);
    for path in run.paths.chunk_by(|a, b| a.ray == b.ray) {
        let events: Vec<Event> = path.iter().map(|v| v.event).collect();
        assert_eq!(events, [Event::Emitted, Event::Transmitted, Event::Absorbed]);
    }
    assert!(!run.paths.is_empty() && run.power.absorbed == run.power.emitted);
}

/// A ray that is split has a row for each of its parts, and their powers add up.
#[test]
fn parts_of_a_ray_have_rows_of_their_own() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-5.0, -5.0, 5.0), Point::new(5.0, 5.0, 8.0));
    let folder = tempfile::tempdir().unwrap();
    write_rays(&folder.path().join("list.npz"), &[ray(0.0, Vector::Z, 1.0), ray(50.0, Vector::Z, 1.0)]).unwrap();
    let text = "[run]\nrays = 64\ninterfaces = 'split'\nsplit_floor = 0.001
        [[source]]\nkind = 'rays'\nfile = 'list.npz'
        [[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'\n";
    let scene = Scene::parse(text, "test.toml", folder.path()).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let found = listed_ends(&bound, &world, &RunSettings { threads: 2, ..RunSettings::from(&scene.run) });
    let [split, alone]: [Vec<&ListedEnd>; 2] = [0, 1].map(|k| found.iter().filter(|e| e.ray == k).collect());
    assert_eq!((alone.len(), alone[0].power), (1, 1.0));
    assert!(split.len() >= 3, "{split:?}");
    let sum: f64 = split.iter().map(|e| e.power).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    // What the first side throws back, and what goes straight through both.
    for power in [0.04, 0.96 * 0.96] {
        assert!(split.iter().any(|e| (e.power - power).abs() < 1e-9), "{power}: {split:?}");
    }
}

/// Of 25 independent rays half arrive to ±10 % of the light: runs that draw each ray of a list twice or more print less, which a note says
/// once. One that draws as many has the list's own scatter in its errors.
#[test]
fn what_a_short_list_leaves_open_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for (name, rays) in [("short.csv", 25), ("long.csv", 400)] {
        write_rays(&folder.path().join(name), &vec![ray(0.0, Vector::Z, 1.0); rays]).unwrap();
    }
    let notes = |rays: u32| {
        let text = format!(
            "[[source]]\nname = 'long'\nkind = 'rays'\nfile = 'long.csv'\nrays = {rays}
            [[source]]\nname = 'short'\nkind = 'rays'\nfile = 'short.csv'\nrays = {rays}\n"
        );
        let scene = Scene::parse(&text, "test.toml", folder.path()).unwrap();
        let bound = scene.bind(&World::default().model).unwrap();
        let results = simulate(&bound, &World::default(), &RunSettings::from(&scene.run), &|_| true);
        results.notes.into_iter().filter(|note| note.contains("from a list of")).collect::<Vec<String>>()
    };
    assert_eq!(notes(25), [""; 0]);
    let one = notes(400);
    assert!(
        one.len() == 1 && one[0].starts_with("the source 'short' draws 400 rays from a list of 25: "),
        "{one:?}"
    );
    assert!(one[0].contains("about 10 % of its light where half of it arrives"), "{one:?}");
    assert_eq!(notes(799).len(), 1);
    let both = notes(800);
    assert!(
        both.len() == 1 && both[0].contains("from a list of 25 (2 lists are drawn from so often): "),
        "{both:?}"
    );
}

/// A hundred rays of power 1 and one of 100 leave as much open as 200²/10,100 = 3.96 even ones: half arrives to ±25 % of the light, which
/// eight draws, not seven, make more than their own scatter.
#[test]
fn what_a_list_of_unequal_powers_leaves_open_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut rays = vec![ray(0.0, Vector::Z, 1.0); 100];
    rays.push(ray(0.0, Vector::Z, 100.0));
    write_rays(&folder.path().join("list.csv"), &rays).unwrap();
    let note = |rays: u32| {
        let text = format!("[[source]]\nname = 'uneven'\nkind = 'rays'\nfile = 'list.csv'\nrays = {rays}\n");
        let scene = Scene::parse(&text, "test.toml", folder.path()).unwrap();
        let bound = scene.bind(&World::default().model).unwrap();
        let results = simulate(&bound, &World::default(), &RunSettings::from(&scene.run), &|_| true);
        results.notes.into_iter().find(|note| note.contains("from a list of"))
    };
    assert_eq!(note(7), None);
    let told = note(8).unwrap();
    assert!(told.contains("draws 8 rays from a list of 101, as good as 3.96 of equal power: "), "{told}");
    assert!(told.contains("about 25 % of its light where half of it arrives"), "{told}");
}

/// A ray whose file was cut while it was in use is lost for that reason, and for no number of its own.
#[test]
fn rays_of_a_file_that_went_are_lost_as_unreadable() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("list.tm25ray");
    // More than are kept in memory.
    let rays = vec![ray(0.0, Vector::Z, 1.0); (1 << 17) + 1];
    write_tm25(&file, &Tm25::from_rays(&rays, Flux::Radiant)).unwrap();
    let text = "[run]\nrays = 64\n[[source]]\nkind = 'rays'\nfile = 'list.tm25ray'\n";
    let scene = Scene::parse(text, "test.toml", folder.path()).unwrap();
    let world = World::default();
    let bound = scene.bind(&world.model).unwrap();
    std::fs::OpenOptions::new().write(true).open(&file).unwrap().set_len(8).unwrap();
    let results = simulate(&bound, &world, &RunSettings::from(&scene.run), &|_| true);
    assert_eq!(results.lost_rays, 64);
    assert!(results.ledger.iter().all(|lost| lost.cause == LostCause::Unreadable), "{:?}", results.ledger[0]);
    assert!(results.notes.iter().any(|note| note.contains("the ray file was changed")), "{:?}", results.notes);
}

//! Light grouped by the faces it met: against closed forms, to the last quantum, and in parts.

use crate::support::World;
use lampyris::math::Point;
use lampyris::simulate::{
    Event, Hooks, MOST_STEPS, PartialRun, Results, RunSettings, Scene, SequenceResult, arrivals, recorded_ways,
    trace,
};
use std::collections::BTreeSet;
use std::path::Path;

const GLASS: &str = "[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'\n";

/// Faces of the first cuboid of a world, below and above.
const BELOW: u32 = 4;
const ABOVE: u32 = 5;

fn steps(sequence: &SequenceResult) -> Vec<(u32, Event)> {
    sequence.steps.iter().map(|s| (s.face.unwrap(), s.event)).collect()
}

/// The first orders of a plate at normal incidence: R = ((n − 1)/(n + 1))² = 0.04 and T = 0.96 at each face.
#[test]
fn orders_of_a_plate_have_the_powers_of_fresnel() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    let text = [
        "[run]\nrays = 2000\ninterfaces = 'split'\nsplit_floor = 0\nsequences = 2\n",
        GLASS,
        "[[source]]\nname = 'beam'\nkind = 'collimated'\nat = [0, 0, -10]\ndirection = [0, 0, 1]\nradius = 5\n",
        "[[receiver]]\nname = 'behind'\nat = [0, 0, 20]\nsize = [20, 20]\n",
        "[[receiver]]\nname = 'before'\nat = [0, 0, -20]\nsize = [20, 20]\n",
    ]
    .concat();
    let found = world.run(&text, |_| ()).sequences;
    use Event::{Reflected, Transmitted};
    let (r, t) = (0.04, 0.96);
    let [behind, before] = [&found[0].first, &found[1].first];
    let expected =
        [(behind, vec![(BELOW, Transmitted), (ABOVE, Transmitted)], t * t), (before, vec![(BELOW, Reflected)], r)];
    for (first, way, power) in expected {
        assert_eq!((steps(&first[0]), first[0].source_name.as_str()), (way, "beam"));
        assert!((first[0].power / power - 1.0).abs() < 1e-9, "{} {power}", first[0].power);
    }
    let ghost = vec![(BELOW, Transmitted), (ABOVE, Reflected), (BELOW, Reflected), (ABOVE, Transmitted)];
    assert_eq!(steps(&behind[1]), ghost);
    assert!((behind[1].power / (t * t * r * r) - 1.0).abs() < 1e-6, "{}", behind[1].power);
    assert_eq!(steps(&before[1]), [(BELOW, Transmitted), (ABOVE, Reflected), (BELOW, Transmitted)]);
    assert!((before[1].power / (t * t * r) - 1.0).abs() < 1e-6, "{}", before[1].power);
}

/// A ball and a mirror, a source of parallel light and a point, and every kind of receiver.
fn world() -> (World, String) {
    let mut world = World::default();
    world.sphere("glass", Point::ZERO, 5.0).cuboid("plate", Point::new(-9.0, -9.0, 8.0), Point::new(9.0, 9.0, 9.0));
    let text = [
        "[run]\nrays = 20000\nreplicates = 8\nsequences = 5\n",
        GLASS,
        "[[material]]\npart = 'plate'\nsurface = 'mirror'\nreflectance = 0.9\n",
        "[[source]]\nkind = 'collimated'\nat = [0, 0, -20]\ndirection = [0, 0, 1]\nradius = 6\n",
        "[[source]]\nkind = 'point'\nat = [20, 0, 0]\npower = 0.5\n",
        "[[receiver]]\nname = 'behind'\nat = [0, 0, 30]\nsize = [50, 50]\n",
        "[[receiver]]\nname = 'passed'\nat = [0, 0, -7]\nsize = [50, 50]\nabsorbs = false\n",
        "[[receiver]]\nname = 'ball'\nkind = 'sphere'\nat = [0, 0, 0]\nradius = 40\n",
        "[[receiver]]\nname = 'mirror'\nkind = 'absorbed'\npart = 'plate'\n",
    ];
    (world, text.concat())
}

#[test]
fn sequences_add_up_to_their_receiver_and_change_nothing_else() {
    let (world, text) = world();
    for interfaces in ["roulette", "split"] {
        let text = text.replace("[run]", &format!("[run]\ninterfaces = '{interfaces}'\nsplit_floor = 0.01"));
        let with = world.run(&text, |_| ());
        let without = world.run(&text.replace("sequences = 5", ""), |_| ());
        assert_eq!((&with.digest, with.segments), (&without.digest, without.segments));
        assert!(without.sequences.is_empty() && with.sequences.len() == 4);
        for (k, sum) in with.tallies.receivers.iter().enumerate() {
            let parts = with.tallies.sequences.iter().filter(|(s, _)| s.receiver == k as u32);
            assert_eq!(
                parts.map(|(_, p)| p.total).sum::<u128>(),
                sum.total,
                "{} {interfaces}",
                with.receivers[k].name
            );
            let listed: f64 = with.sequences[k].first.iter().map(|s| s.power).sum();
            assert!((listed + with.sequences[k].rest - with.receivers[k].power).abs() < 1e-12);
        }
    }
}

/// A ray belongs to a source and a replicate by its number alone, also where a source has a ray in few of the replicates.
#[test]
fn sequences_of_sources_of_a_ray_or_ten_add_up_too() {
    let (world, text) = world();
    let points: String =
        (0..90).map(|k| format!("[[source]]\nkind = 'point'\nat = [{}, 20, 0]\n", k % 7)).collect();
    let faint = "[[source]]\nkind = 'point'\nat = [0, -20, 0]\npower = 1e-6\n";
    let text = text.replace("rays = 20000\nreplicates = 8", "rays = 1000") + &points + faint;
    let results = world.run(&text, |_| ());
    for (k, sum) in results.tallies.receivers.iter().enumerate() {
        let parts = results.tallies.sequences.iter().filter(|(s, _)| s.receiver == k as u32);
        assert_eq!(parts.map(|(_, p)| p.total).sum::<u128>(), sum.total, "{}", results.receivers[k].name);
    }
}

#[test]
fn parts_of_a_run_have_the_sequences_of_the_whole() {
    let (world, text) = world();
    let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let part = |shard: [u32; 2], threads: usize| -> PartialRun {
        let settings = RunSettings { threads, shard, ..RunSettings::from(&scene.run) };
        let partial = trace(&bound, &world, &settings, None, &Hooks::with_progress(&|_| true)).partial;
        // By way of its file.
        let mut bytes = Vec::new();
        partial.write(&"", &mut bytes).unwrap();
        let part = PartialRun::read::<String>(&bytes, |_| Ok(()), &bound).unwrap();
        assert_eq!(PartialRun::read_alone::<String>(&bytes).unwrap().1, part);
        part
    };
    let whole = part([0, 1], 3);
    let mut sum = part([2, 3], 1);
    sum.merge(&part([0, 3], 2)).unwrap();
    sum.merge(&part([1, 3], 1)).unwrap();
    let count = whole.tallies.sequences.iter().count();
    assert!(count > 20, "{count}");
    assert_eq!(whole.tallies.sequences, sum.tallies.sequences);
    let results = |partial: PartialRun| {
        let traced = lampyris::simulate::TracedRun { partial, ..Default::default() };
        Results::new(&bound, &RunSettings::from(&scene.run), traced).sequences
    };
    assert_eq!(results(whole), results(sum));
}

/// Scattering inside a body is a step as a hit of a face is: in the order of the path, and noted for light that is counted right after it.
#[test]
fn scattering_in_a_body_is_a_step_in_its_place() {
    let mut world = World::default();
    world.sphere("fog", Point::ZERO, 10.0);
    let text = "[run]\nrays = 500\n[[medium]]\nname = 'fog'\nindex = 1.5\nscatter_per_mm = 0.1\n\
                [[material]]\npart = 'fog'\nmedium = 'fog'\n[[source]]\nkind = 'point'\nat = [0, 0, 0]\n\
                [[receiver]]\nname = 'all'\nkind = 'sphere'\nat = [0, 0, 0]\nradius = 40\n";
    let results = world.run(text, |s| s.path_samples = s.rays);
    let paths = &results.paths;
    assert!(paths.iter().filter(|v| v.event == Event::Scattered).count() > 200);
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let ways = recorded_ways(&scene.bind(&world.model).unwrap(), &RunSettings::from(&scene.run), 0, &results);
    assert_eq!(ways.len(), 500);
    for (path, way) in paths.chunk_by(|a, b| a.ray == b.ray).zip(&ways) {
        let [first, hits @ .., last] = path else { panic!("{path:?}") };
        // The source, then the hits by their number, then the receiver: outside the ball, so that the last hit is of its face.
        assert_eq!((first.bounce, last.bounce as usize, last.event), (0, hits.len(), Event::Received));
        assert!(hits.iter().enumerate().all(|(k, hit)| hit.bounce as usize == k), "{hits:?}");
        assert_eq!(hits.last().unwrap().event, Event::Transmitted);
        let told: Vec<_> = hits.iter().map(|hit| (hit.face, hit.event)).take(MOST_STEPS).collect();
        assert_eq!(way.sequence.steps.iter().map(|s| (s.face, s.event)).collect::<Vec<_>>(), told);
    }
}

/// Where every ray is recorded its ways are the sequences that were counted: those of each receiver, from their source, and no others.
#[test]
fn recorded_ways_are_the_sequences_that_were_counted() {
    let (world, text) = world();
    let far =
        "[[receiver]]\nname = 'up'\nkind = 'far_field'\nnormal = [0, 1, 0]\nh_deg = [-80, 80]\nv_deg = [-80, 80]\n";
    let ball = text.find("[[receiver]]\nname = 'ball'").unwrap();
    let mirror = text.find("[[receiver]]\nname = 'mirror'").unwrap();
    let open = [&text[..ball], far, &text[mirror..]].concat();
    for (text, interfaces) in [(&text, "roulette"), (&text, "split"), (&open, "roulette"), (&open, "split")] {
        let text = text
            .replace("[run]", &format!("[run]\ninterfaces = '{interfaces}'\nsplit_floor = 0.01"))
            .replace("rays = 20000", "rays = 3000");
        let results = world.run(&text, |s| s.path_samples = s.rays);
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let settings = RunSettings::from(&scene.run);
        let ways = |r| recorded_ways(&bound, &settings, r, &results);
        let recorded: BTreeSet<_> = (0..4).flat_map(ways).map(|way| way.sequence).collect();
        let counted: BTreeSet<_> = results.tallies.sequences.iter().map(|(sequence, _)| sequence.clone()).collect();
        assert!(counted.len() > 20 && recorded == counted, "{interfaces}: {} {}", recorded.len(), counted.len());
        // They end where they were counted: the planes stand across z.
        for (r, z) in [(0, 30.0), (1, -7.0)] {
            assert!(ways(r).iter().all(|way| (way.points.last().unwrap().z - z).abs() < 1e-9));
        }
    }
}

/// What splits off at a face was there before: a face that takes a tenth of each ray that it splits ends one way for each.
#[test]
fn a_ray_that_splits_at_an_absorbing_face_has_one_way_there() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 1.0));
    let text = "[run]\nrays = 100\ninterfaces = 'split'\n\
                [[material]]\npart = 'plate'\nsurface = 'coating'\nreflectance = 0.3\ntransmittance = 0.6\n\
                [[source]]\nkind = 'collimated'\nat = [0, 0, -20]\ndirection = [0, 0, 1]\n\
                [[receiver]]\nname = 'taken'\nkind = 'absorbed'\non = { part = 'plate', face = 'z0' }\n";
    let results = world.run(text, |s| s.path_samples = s.rays);
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let ways = recorded_ways(&scene.bind(&world.model).unwrap(), &RunSettings::from(&scene.run), 0, &results);
    let straight = ways.iter().filter(|way| way.sequence.steps.len() == 1).count();
    assert!(straight == 100 && ways.iter().all(|way| way.points.len() > 1), "{straight} of {}", ways.len());
}

/// What recorded paths brought to a receiver that lets light pass is what it counted, whatever the medium and the faces after it take.
#[test]
fn arrivals_at_a_passing_receiver_have_the_power_that_it_counted() {
    let mut world = World::default();
    world.sphere("glass", Point::ZERO, 5.0).cuboid("plate", Point::new(-9.0, -9.0, 8.0), Point::new(9.0, 9.0, 9.0));
    let text = [
        "[run]\nrays = 1000\n[[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 0.1\n",
        "[[material]]\npart = 'glass'\nmedium = 'glass'\n",
        "[[material]]\npart = 'plate'\nsurface = 'mirror'\nreflectance = 0.8\n",
        "[[source]]\nkind = 'collimated'\nat = [0, 0, -20]\ndirection = [0, 0, 1]\nradius = 4\n",
        "[[receiver]]\nname = 'before'\nat = [0, 0, -7]\nsize = [50, 50]\nabsorbs = false\n",
        "[[receiver]]\nname = 'within'\nat = [0, 0, 0]\nsize = [8, 8]\nabsorbs = false\n",
        "[[receiver]]\nname = 'mirror'\nat = [0, 0, 7]\nsize = [50, 50]\nabsorbs = false\n",
        "[[receiver]]\nname = 'end'\nkind = 'sphere'\nat = [0, 0, 0]\nradius = 40\n",
    ];
    for interfaces in ["roulette", "split"] {
        let text = text.concat().replace("[run]", &format!("[run]\ninterfaces = '{interfaces}'"));
        let results = world.run(&text, |s| s.path_samples = s.rays);
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let settings = RunSettings::from(&scene.run);
        for (k, receiver) in results.receivers.iter().enumerate() {
            let arrived: f64 = arrivals(&bound, &settings, k, &results).iter().map(|ray| ray.power).sum();
            assert!((arrived / receiver.power - 1.0).abs() < 1e-9, "{} {interfaces}: {arrived}", receiver.name);
        }
        // Before the glass nothing was absorbed yet: a ray of the source is the thousandth part of its watt, and in the replicates of 16
        // rays, as 62 have 16.13 in the mean, as much more.
        let strongest = arrivals(&bound, &settings, 0, &results).iter().map(|ray| ray.power).fold(0.0, f64::max);
        assert!((strongest * 62.0 * 16.0 - 1.0).abs() < 1e-10, "{interfaces}: {strongest}");
    }
}

/// In an absorbing medium every ray has what Beer's law leaves of it on its own way to a plane: oblique ones less.
#[test]
fn arrivals_within_a_medium_have_what_it_left_of_each() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 10.0));
    // Of the index of the surroundings: nothing is reflected or bent.
    let text = "[run]\nrays = 1000\n[[medium]]\nname = 'grey'\nindex = 1.0\nabsorption_per_mm = 0.5\n\
                [[material]]\npart = 'plate'\nmedium = 'grey'\n\
                [[source]]\nkind = 'cone'\nhalf_angle_deg = 40\nat = [0, 0, -1]\n\
                [[receiver]]\nname = 'within'\nat = [0, 0, 9]\nsize = [90, 90]\nabsorbs = false\n";
    let results = world.run(text, |s| s.path_samples = s.rays);
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let rays = arrivals(&bound, &RunSettings::from(&scene.run), 0, &results);
    assert_eq!(rays.len(), 1000);
    for ray in rays {
        let left = (-0.5 * 9.0 / ray.direction.z).exp();
        // The thousandth part of a watt, but for the few rays that a replicate has more or fewer than others: up to 1 of 16.
        let share = ray.power * 1000.0 / left;
        assert!((share - 1.0).abs() < 0.07, "{} at {}", ray.power, ray.direction);
    }
}

/// A receiver ends light a rounding before itself: rays that come from a tenth of a millimetre before it arrive all the same, near the
/// origin and a kilometre off.
#[test]
fn arrivals_right_before_a_receiver_are_all_there() {
    for x in [0.0, 1e6] {
        let text = format!(
            "[run]\nrays = 1000\n[[source]]\nkind = 'cone'\nhalf_angle_deg = 20\nat = [{x}, 0, 0]\n\
             [[receiver]]\nname = 'near'\nat = [{x}, 0, 0.1]\nsize = [1, 1]\n"
        );
        let world = World::default();
        let results = world.run(&text, |s| s.path_samples = s.rays);
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let rays = arrivals(&bound, &RunSettings::from(&scene.run), 0, &results);
        let arrived: f64 = rays.iter().map(|ray| ray.power).sum();
        assert!(rays.len() == 1000 && (arrived - 1.0).abs() < 1e-9, "{x}: {} rays, {arrived} W", rays.len());
    }
}

/// Where every ray is recorded those of a wavelength bring what its bin counted, from two sources of three lines.
#[test]
fn arrivals_have_the_wavelengths_that_were_counted() {
    let text = "[run]\nrays = 1000\n[[source]]\nkind = 'collimated'\nat = [0, 0, -20]\nradius = 4\n\
        spectrum = { kind = 'lines', values = [[450, 3], [600, 1]] }\n\
        [[source]]\nkind = 'point'\nat = [0, 0, -9]\npower = 0.5\n\
        [[receiver]]\nname = 'wall'\nat = [0, 0, 5]\nsize = [20, 20]\nbins_nm = [400, 500, 595, 700]\n";
    let world = World::default();
    let results = world.run(text, |s| s.path_samples = s.rays);
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    let rays = arrivals(&bound, &RunSettings::from(&scene.run), 0, &results);
    for (nm, bin) in [450.0, 587.5618, 600.0].into_iter().zip(&results.receivers[0].channels) {
        let sum: f64 = rays.iter().filter(|ray| ray.wavelength_nm == Some(nm)).map(|ray| ray.power).sum();
        assert!(bin.total > 0.0 && (sum / bin.total - 1.0).abs() < 1e-9, "{nm}: {sum} {}", bin.total);
    }
}

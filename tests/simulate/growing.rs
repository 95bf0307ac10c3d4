//! Runs that grow: further rays join those that were traced, and the bits are those of one run of all of them.

use crate::support::World;
use lampyris::intersect::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use lampyris::math::{Point, Ray};
use lampyris::simulate::{
    BoundScene, Hooks, PartialRun, PartialRunError, Results, RunSettings, Scene, ask_again, replay, trace,
};
use std::path::Path;
use std::sync::Mutex;

/// A glass ball between two sources of unequal power, one of them weak, and a screen.
fn ball() -> (World, BoundScene) {
    let mut world = World::default();
    world.sphere("ball", Point::ZERO, 5.0);
    let text = "[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'ball'\nmedium = 'glass'\n\
        [[source]]\nkind = 'collimated'\nat = [0, 0, -20]\nradius = 4\npower = 3\n\
        [[source]]\nkind = 'point'\nat = [0, 9, -9]\npower = 1e-5\n\
        [[receiver]]\nname = 'screen'\nat = [0, 0, 12]\nsize = [20, 20]\ncells = [8, 8]\n\
        [[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [8, 8]\n";
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&world.model).unwrap();
    (world, bound)
}

fn part(rays: [u64; 2], shard: [u32; 2], from: Option<PartialRun>) -> PartialRun {
    let (world, bound) = ball();
    let settings =
        RunSettings { rays: rays[1], first_ray: rays[0], grows: true, shard, threads: 2, ..RunSettings::default() };
    trace(&bound, &world, &settings, from, &Hooks::with_progress(&|_| true)).partial
}

fn results(partial: PartialRun) -> Results {
    let (_, bound) = ball();
    let settings = RunSettings { rays: 20_000, grows: true, ..RunSettings::default() };
    let traced = lampyris::simulate::TracedRun { partial, ..Default::default() };
    Results::new(&bound, &settings, traced)
}

#[test]
fn further_rays_give_the_bits_of_one_run() {
    let whole = part([0, 60_000], [0, 1], None);
    assert!(whole.is_whole());
    // The later rays first, in three shards, then the earlier ones.
    let mut sum = part([20_000, 60_000], [2, 3], None);
    assert!(!sum.is_whole());
    for piece in [part([0, 20_000], [0, 1], None), part([20_000, 60_000], [0, 3], None)] {
        sum.merge(&piece).unwrap();
    }
    let again = sum.merge(&part([0, 5_000], [0, 1], None));
    assert!(matches!(again, Err(PartialRunError::RepeatedReplicate(_))), "rays count once: {again:?}");
    sum.merge(&part([20_000, 60_000], [1, 3], None)).unwrap();
    assert_eq!((sum.is_whole(), &sum.done, &sum.tallies), (true, &whole.done, &whole.tallies));
    let [a, b] = [results(sum), results(whole.clone())];
    assert_eq!(a.digest, b.digest);
    for (a, b) in a.receivers.iter().zip(&b.receivers) {
        assert_eq!((a.power, a.power_error, &a.cells, &a.errors), (b.power, b.power_error, &b.cells, &b.errors));
    }
    // What was done is continued.
    let grown = part([0, 60_000], [0, 1], Some(part([0, 25_000], [0, 1], None)));
    assert_eq!(grown.tallies, whole.tallies);
}

/// A weak source has a ray in every replicate, of its own small power, so that no power is lost or made up.
#[test]
fn every_replicate_emits_the_power_of_all_sources() {
    let r = results(part([0, 20_000], [0, 1], None));
    assert!((r.power.emitted / 3.00001 - 1.0).abs() < 1e-12 && r.power.imbalance() < 1e-12, "{:?}", r.power);
    assert_eq!(r.tallies.replicates, 4);
    assert_eq!(r.tallies.ends[0].error(4), 0.0, "all replicates emit the same");
}

/// More shards than replicates: some hold nothing, and together they hold everything once.
#[test]
fn there_may_be_more_shards_than_replicates() {
    let mut sum = part([0, 10_000], [0, 7], None);
    for k in 1..7 {
        sum.merge(&part([0, 10_000], [k, 7], None)).unwrap();
    }
    assert_eq!(sum.tallies, part([0, 10_000], [0, 1], None).tallies);
}

/// A shard of which a part was done on another machine is continued here, and has nothing of that part.
#[test]
fn what_is_done_elsewhere_is_left_out() {
    let (_, bound) = ball();
    let whole = part([0, 60_000], [0, 1], None);
    let mut sum = part([0, 60_000], [1, 5], None);
    let elsewhere = sum.done.clone();
    for k in 0..2 {
        let from = PartialRun::done_elsewhere(&bound, whole.replicates, elsewhere.clone());
        let mut rest = part([0, 60_000], [k, 2], Some(from));
        rest.leave_out(&elsewhere);
        sum.merge(&rest).unwrap();
    }
    assert_eq!((sum.is_whole(), &sum.done, &sum.tallies), (true, &whole.done, &whole.tallies));
}

/// Lengths that no scene has are refused before memory is taken for them.
#[test]
fn parts_of_false_lengths_are_refused() {
    let mut bytes = Vec::new();
    let huge = PartialRun { replicates: 1, ..PartialRun::default() };
    huge.write(&(), &mut bytes).unwrap();
    assert_eq!(PartialRun::read_alone::<()>(&bytes).unwrap().1, huge);
    // The number of receivers stands behind header, replicates, whether it grows, what is done, and seconds.
    let receivers = b"lampyris tally 12\n".len() + 8 + "null".len() + 3 * 4 + 8;
    bytes[receivers..receivers + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(PartialRun::read_alone::<()>(&bytes).unwrap_err(), PartialRunError::WrongChecksum);
    let body = bytes.len() - 16;
    let sum = lampyris::simulate::Fingerprint::new(&[&bytes[..body]]).0;
    let sum = u128::from_str_radix(&sum, 16).unwrap().to_le_bytes();
    bytes[body..].copy_from_slice(&sum);
    let error = PartialRun::read_alone::<()>(&bytes).unwrap_err();
    assert!(error.to_string().contains("more sums than any scene"), "{error}");
}

#[test]
fn a_ray_of_a_run_that_grows_can_be_traced_again() {
    let (world, bound) = ball();
    let settings = RunSettings { rays: 20_000, grows: true, ..RunSettings::default() };
    for ray in [0, 4_999, 5_000, 12_345] {
        let r = replay(&bound, &world, &settings, &[ray]);
        assert!(r.rays == 1 && r.paths.iter().all(|v| v.ray == ray) && !r.paths.is_empty(), "{ray}");
    }
    assert_eq!(replay(&bound, &world, &settings, &[30_000]).rays, 0);
}

/// Round numbers of many rays are divided so by default.
#[test]
fn large_round_runs_can_grow() {
    let (world, bound) = ball();
    let run = |rays: u64| {
        let settings = RunSettings { rays, threads: 2, ..RunSettings::default() };
        trace(&bound, &world, &settings, None, &Hooks::with_progress(&|_| true)).partial
    };
    let large = run(640_000);
    assert!(large.grows && large.replicates == 128);
    assert_eq!(part([0, 640_000], [0, 1], None).tallies, large.tallies);
    assert!(!run(20_000).grows);
}

/// Records the queries in batches, and passes them on.
struct Noted<'w> {
    world: &'w World,
    rays: Mutex<Vec<[u64; 6]>>,
}

impl Intersector for Noted<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.world.intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let bits = |ray: &Ray| {
            let (o, d) = (ray.origin, ray.direction);
            [o.x, o.y, o.z, d.x, d.y, d.z].map(f64::to_bits)
        };
        self.rays.lock().unwrap().extend(rays.iter().map(bits));
        self.world.intersect_batch(rays, hits, cost);
    }

    fn footprint(&self) -> Footprint {
        self.world.footprint()
    }
}

/// Traced once more together, rays of all sources make the queries that each makes by itself; the run lacks the last of them.
#[test]
fn rays_that_are_asked_again_ask_the_same() {
    let (world, bound) = ball();
    let (step, count, rays) = (7, 3000, 20_000);
    for grows in [false, true] {
        let settings = RunSettings { rays, grows, ..RunSettings::default() };
        let asked = |ask: &dyn Fn(&Noted<'_>)| {
            let noted = Noted { world: &world, rays: Mutex::default() };
            ask(&noted);
            let mut rays = noted.rays.into_inner().unwrap();
            rays.sort_unstable();
            rays
        };
        let numbers: Vec<u64> = (0..count).map(|k| step * k).collect();
        let alone = asked(&|noted| drop(replay(&bound, noted, &settings, &numbers)));
        let together = asked(&|noted| ask_again(&bound, noted, &settings, (step, count)));
        assert!(numbers.last() > Some(&rays) && alone.len() > numbers.len(), "{}", alone.len());
        assert_eq!(alone, together);
    }
}

/// Keeps what it is given to expect: all rays, and those of each beam.
struct Told<'a>(&'a World, Mutex<Vec<u64>>);

impl Intersector for Told<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.0.intersect(ray, cost)
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        let beams = expected.beams.iter().map(|(_, rays)| *rays);
        self.1.lock().unwrap().extend(std::iter::once(expected.rays).chain(beams));
    }

    fn footprint(&self) -> Footprint {
        self.0.footprint()
    }
}

/// What an intersector works out beforehand must pay for the rays that are left, not for those of other ranges, shards and earlier runs.
#[test]
fn rays_that_are_announced_are_those_left_to_trace() {
    let (world, bound) = ball();
    let told = |rays: [u64; 2], shard, from| {
        let told = Told(&world, Mutex::default());
        let settings = RunSettings {
            rays: rays[1],
            first_ray: rays[0],
            grows: true,
            shard,
            threads: 2,
            ..RunSettings::default()
        };
        trace(&bound, &told, &settings, from, &Hooks::with_progress(&|_| true));
        told.1.into_inner().unwrap()
    };
    // Four replicates of 5000 rays, each with one of the weak source beside them.
    let expected = [20_004, 20_000, 4];
    assert_eq!(told([40_000, 60_000], [0, 1], None), expected);
    assert_eq!(told([0, 60_000], [1, 3], None), expected);
    let done = part([0, 40_000], [0, 1], None);
    assert_eq!(told([0, 60_000], [0, 1], Some(done)), expected);
}

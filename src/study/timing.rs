//! Timing for studies: repeated alternating rounds, and progress with the time left.

use serde::Serialize;
use std::time::Instant;

/// Progress of a study, passed to its progress callback.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Current step, in a few words.
    pub stage: String,
    /// Share of the whole study that is done, 0 to 1.
    pub done: f64,
    /// Seconds left, from the pace so far; `None` before anything is known.
    pub remaining_seconds: Option<f64>,
}

/// Seconds of repeated runs: never a single one.
///
/// ```
/// let timing = lampyris::study::Timing::from_seconds(vec![3.0, 1.0, 2.0]);
/// assert_eq!((timing.min, timing.median, timing.runs), (1.0, 2.0, 3));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Timing {
    /// The fastest run.
    pub min: f64,
    /// The middle run.
    pub median: f64,
    /// 90 % of the runs were faster.
    pub p90: f64,
    /// Number of runs.
    pub runs: usize,
}

impl Timing {
    /// Shortest time of a round that a rate is made of, s: below it the clock is too coarse.
    pub const SHORTEST: f64 = 1e-12;

    /// Returns million rays a second, of so many rays in these seconds, [`Self::SHORTEST`] at least.
    pub fn mrays_per_s(rays: usize, seconds: f64) -> f64 {
        rays as f64 / seconds.max(Self::SHORTEST) / 1e6
    }

    /// Works out minimum, median and 90th percentile of the seconds of each run; all zero without any.
    pub fn from_seconds(mut seconds: Vec<f64>) -> Self {
        if seconds.is_empty() {
            return Self::default();
        }
        seconds.sort_by(f64::total_cmp);
        let n = seconds.len();
        Self {
            min: seconds[0],
            // Of an even number the mean of the two in the middle.
            median: 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]),
            p90: seconds[((n as f64 * 0.9).ceil() as usize).clamp(1, n) - 1],
            runs: n,
        }
    }
}

/// Longest time that a contender repeats its run for in a round, s: a busy machine gives and takes slices of a few ms.
const LONGEST_TURN: f64 = 0.02;

/// Contenders timed in alternating rounds: A B C, then C B A, and so on, so that a slow phase of the machine meets all
/// of them alike.
///
/// In a round each repeats its run for as long as the slowest needs for one, 20 ms at most: with one run each, a busy machine would
/// interrupt the slowest most often, and make it look slower still.
#[derive(Default)]
pub struct Rounds<'a> {
    contenders: Vec<(String, Box<dyn FnMut() + 'a>)>,
}

impl<'a> Rounds<'a> {
    /// Adds a contender; `run` does the same whenever it is called.
    pub fn add(&mut self, name: impl Into<String>, run: impl FnMut() + 'a) {
        self.contenders.push((name.into(), Box::new(run)));
    }

    /// Runs every contender once untimed and then in so many `rounds`; the seconds of a run, a figure a round, in the order of adding.
    pub fn run(self, rounds: usize) -> Vec<(String, Timing)> {
        self.run_telling(rounds, |_| ())
    }

    /// As [`Self::run`], and calls `tell` with the share that is done after each round, the untimed one among them.
    pub(super) fn run_telling(mut self, rounds: usize, tell: impl Fn(f64)) -> Vec<(String, Timing)> {
        let tell_rounds = |done: usize| tell(done as f64 / (rounds + 1) as f64);
        let mut seconds = vec![Vec::with_capacity(rounds); self.contenders.len()];
        let mut slowest = 0.0f64;
        // Not among the figures: caches, pages and clock frequencies settle.
        for (_, run) in &mut self.contenders {
            slowest = slowest.max(seconds_of_run(0.0, run));
        }
        let turn = slowest.min(LONGEST_TURN);
        tell_rounds(1);
        for round in 0..rounds {
            let order: Vec<usize> = if round % 2 == 0 {
                (0..self.contenders.len()).collect()
            } else {
                (0..self.contenders.len()).rev().collect()
            };
            for i in order {
                seconds[i].push(seconds_of_run(turn, &mut self.contenders[i].1));
            }
            tell_rounds(round + 2);
        }
        self.contenders.into_iter().zip(seconds).map(|((name, _), s)| (name, Timing::from_seconds(s))).collect()
    }
}

/// Repeats `run` for `turn` seconds, once at least; returns the seconds of one run.
fn seconds_of_run(turn: f64, mut run: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut runs = 0u32;
    loop {
        run();
        runs += 1;
        let elapsed = start.elapsed().as_secs_f64();
        if elapsed >= turn {
            return elapsed / f64::from(runs);
        }
    }
}

/// Reports progress with the time left.
pub(super) struct Clock<'a> {
    start: Instant,
    report: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> Clock<'a> {
    /// Starts the clock.
    pub(super) fn new(report: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { start: Instant::now(), report }
    }

    /// Tells how far the work is; `done` is the share of the expected work, not of the number of steps.
    pub(super) fn report(&self, stage: &str, done: f64) {
        let elapsed = self.start.elapsed().as_secs_f64();
        // Before a hundredth is done any forecast is a guess.
        let remaining_seconds = (done > 0.01).then(|| elapsed * (1.0 - done).max(0.0) / done);
        (self.report)(Progress { stage: stage.into(), done, remaining_seconds });
    }
}

/// Reports progress from a forecast that is renewed stage by stage and runs down in between.
pub(super) struct Countdown<'a> {
    start: Instant,
    report: &'a (dyn Fn(Progress) + Sync),
    stage: String,
    /// When the stage began, and the seconds then forecast.
    since: Instant,
    ahead: Option<f64>,
}

impl<'a> Countdown<'a> {
    /// Makes a countdown, without a forecast yet, for work that begins now.
    pub(super) fn new(report: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self::since(Instant::now(), report)
    }

    /// Makes a countdown, without a forecast yet, for work that began at `start`.
    pub(super) fn since(start: Instant, report: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { start, report, stage: String::new(), since: start, ahead: None }
    }

    /// Begins a stage, with the seconds of it and all after it; `None` for "not known yet". Reports it.
    pub(super) fn stage(&mut self, stage: &str, ahead: Option<f64>) {
        (self.stage, self.since, self.ahead) = (stage.into(), Instant::now(), ahead);
        self.tick();
    }

    /// Reports the time that is left of the last forecast.
    pub(super) fn tick(&self) {
        let elapsed = self.start.elapsed().as_secs_f64();
        let left = self.ahead.map(|a| (a - self.since.elapsed().as_secs_f64()).max(0.0));
        // Nothing left is all done, also where nothing took any time.
        let done = left.map_or(0.0, |left| if left > 0.0 { elapsed / (elapsed + left) } else { 1.0 });
        (self.report)(Progress { stage: self.stage.clone(), done, remaining_seconds: left });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn figures_of_ten_runs() {
        let t = Timing::from_seconds((1..=10).rev().map(f64::from).collect());
        assert_eq!((t.min, t.median, t.p90, t.runs), (1.0, 5.5, 9.0, 10));
        assert_eq!(Timing::from_seconds(Vec::new()).runs, 0);
    }

    #[test]
    fn rounds_alternate() {
        let log = RefCell::new(String::new());
        let mut rounds = Rounds::default();
        rounds.add("a", || log.borrow_mut().push('a'));
        rounds.add("b", || log.borrow_mut().push('b'));
        let told = RefCell::new(Vec::new());
        let timings = rounds.run_telling(2, |share| told.borrow_mut().push(share));
        assert_eq!(told.into_inner(), [1.0 / 3.0, 2.0 / 3.0, 1.0]);
        let mut order: Vec<char> = log.borrow().chars().collect();
        // However often each repeats its run.
        order.dedup();
        assert_eq!(order, ['a', 'b', 'a', 'b', 'a']);
        assert_eq!(timings[1].0, "b");
        assert_eq!(timings[1].1.runs, 2);
    }

    /// Beside one of 5 ms another of nothing runs for as long in each round.
    #[test]
    fn what_is_short_is_repeated_for_as_long_as_the_slowest_takes() {
        let runs = std::cell::Cell::new(0);
        let mut rounds = Rounds::default();
        rounds.add("slow", || std::thread::sleep(std::time::Duration::from_millis(5)));
        rounds.add("short", || runs.set(runs.get() + 1));
        let timings = rounds.run(2);
        assert!(runs.get() > 10 && timings[1].1.min < 5e-4, "{} runs, {timings:?}", runs.get());
    }

    #[test]
    fn short_runs_are_repeated_for_a_whole_turn() {
        let mut runs = 0;
        let seconds = seconds_of_run(0.005, || runs += 1);
        // With a single run the product would be some nanoseconds.
        assert!(seconds * f64::from(runs) >= 0.005 * (1.0 - 1e-9), "{seconds} s, {runs} runs");
        let mut runs = 0;
        seconds_of_run(0.0, || runs += 1);
        assert_eq!(runs, 1);
    }
}

//! Times of the parts of a run, machine by machine.

use crate::cli::machine;
use crate::simulate::{MergedSeconds, Results};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Times of parts, by the name of the machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Usage(BTreeMap<String, MachineUsage>);

/// Times of the parts of one machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct MachineUsage {
    parts: u32,
    /// Of all threads of all parts; absent where the system does not report it.
    cpu_seconds: Option<f64>,
    /// Of the slowest part, from the start of its process.
    slowest_seconds: f64,
    /// Of the part that had most; absent of parts of earlier versions.
    #[serde(default)]
    threads: Option<u32>,
}

impl Usage {
    /// Returns what this process took so far on so many threads, as one part on this machine.
    pub(crate) fn of_process(wall_seconds: f64, threads: usize) -> Self {
        let usage = MachineUsage {
            parts: 1,
            cpu_seconds: cpu_seconds(),
            slowest_seconds: wall_seconds,
            threads: u32::try_from(threads).ok(),
        };
        Self(BTreeMap::from([(machine::name(), usage)]))
    }

    /// Adds what other parts took, machine by machine: their number and times of threads add up; of their durations the longest counts, and
    /// of their numbers of threads the largest.
    pub(crate) fn add(&mut self, other: &Self) {
        for (machine, theirs) in &other.0 {
            let Some(mine) = self.0.get_mut(machine) else {
                self.0.insert(machine.clone(), *theirs);
                continue;
            };
            mine.parts += theirs.parts;
            // Unknown of one is unknown of the sum.
            mine.cpu_seconds = mine.cpu_seconds.zip(theirs.cpu_seconds).map(|(a, b)| a + b);
            mine.slowest_seconds = mine.slowest_seconds.max(theirs.slowest_seconds);
            mine.threads = mine.threads.max(theirs.threads);
        }
    }

    /// Returns the usage with what an earlier process took for this same part: on one machine times add up, and the part counts where it
    /// ends.
    pub(crate) fn continue_from(mut self, other: &Self) -> Self {
        for (machine, theirs) in &other.0 {
            match self.0.get_mut(machine) {
                Some(mine) => {
                    mine.cpu_seconds = mine.cpu_seconds.zip(theirs.cpu_seconds).map(|(a, b)| a + b);
                    // One after the other on the same machine.
                    mine.slowest_seconds += theirs.slowest_seconds;
                    mine.threads = mine.threads.max(theirs.threads);
                }
                // The part counts where it ends.
                None => drop(self.0.insert(machine.clone(), MachineUsage { parts: 0, ..*theirs })),
            }
        }
        self
    }

    /// Notes in the results of a merged run what its parts took, and the threads of these in place of its own, on which nothing was traced.
    pub(crate) fn note_in(&self, results: &mut Results) {
        results.seconds.merged = self.total();
        let threads = results.seconds.merged.and_then(|merged| merged.threads);
        results.threads = threads.map_or(results.threads, |threads| threads as usize);
    }

    /// Returns the whole usage in five numbers; `None` where nothing is known, and no time of threads where one machine's is not.
    fn total(&self) -> Option<MergedSeconds> {
        let machines = u32::try_from(self.0.len()).ok().filter(|n| *n > 0)?;
        Some(MergedSeconds {
            parts: self.0.values().map(|m| m.parts).sum(),
            machines,
            cpu: self.0.values().map(|m| m.cpu_seconds).sum(),
            slowest: self.0.values().fold(0.0, |slowest, m| m.slowest_seconds.max(slowest)),
            threads: self.0.values().filter_map(|m| m.threads).max(),
        })
    }
}

/// Returns the seconds that all threads of this process took so far; `None` where the system does not report them.
#[cfg(unix)]
fn cpu_seconds() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    /// Nanoseconds in a second.
    const NANOSECONDS: f64 = 1e9;
    Some(time.tv_sec as f64 + time.tv_nsec as f64 / NANOSECONDS)
}

#[cfg(not(unix))]
fn cpu_seconds() -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part that took `cpu` seconds on as many threads.
    fn part(machine: &str, cpu: f64, wall: f64) -> Usage {
        let usage =
            MachineUsage { parts: 1, cpu_seconds: Some(cpu), slowest_seconds: wall, threads: Some(cpu as u32) };
        Usage(BTreeMap::from([(machine.into(), usage)]))
    }

    #[test]
    fn parts_add_up_and_the_slowest_counts() {
        let mut sum = Usage::default();
        assert_eq!(sum.total(), None);
        for usage in [part("a", 3.0, 2.0), part("b", 1.0, 5.0), part("a", 4.0, 1.0)] {
            sum.add(&usage);
        }
        let total = MergedSeconds { parts: 3, machines: 2, cpu: Some(8.0), slowest: 5.0, threads: Some(4) };
        assert_eq!(sum.total(), Some(total));
        // One part that was stopped and continued, on the same machine and on another.
        let resumed = part("a", 3.0, 2.0).continue_from(&part("a", 1.0, 4.0));
        let total = MergedSeconds { parts: 1, machines: 1, cpu: Some(4.0), slowest: 6.0, threads: Some(3) };
        assert_eq!(resumed.total(), Some(total));
        let moved = part("a", 3.0, 2.0).continue_from(&part("b", 1.0, 4.0)).total();
        assert_eq!(moved.map(|m| (m.parts, m.machines)), Some((1, 2)));
        // A part of an earlier version does not record its threads.
        let old: Usage =
            serde_json::from_str(r#"{"a":{"parts":1,"cpu_seconds":1.0,"slowest_seconds":1.0}}"#).unwrap();
        assert_eq!(old.total().map(|m| (m.parts, m.threads)), Some((1, None)));
    }
}

//! Running sums of what weighs something, searched for the place that a sum falls on.
//!
//! Above the sums stands every sixteenth of them, above those every sixteenth again, and so on: a search reads one run of sixteen of
//! each level. A plain bisection of millions of sums would jump to another line of memory at most steps, and no cache holds them all.

/// Sums of a run: two lines of a cache.
const RUN: usize = 16;

/// Sums that never fall.
#[derive(Clone, Debug, Default)]
pub(super) struct RunningSums {
    /// The sums, then the last of each run of the level before, to a level of one run at most.
    levels: Vec<Box<[f64]>>,
}

impl RunningSums {
    /// Takes sums in their order.
    pub(super) fn new(sums: Vec<f64>) -> Self {
        let mut levels = vec![sums.into_boxed_slice()];
        while let Some(below) = levels.last().filter(|level| level.len() > RUN) {
            levels.push(below.chunks(RUN).filter_map(|run| run.last().copied()).collect());
        }
        Self { levels }
    }

    /// The last sum, 0 where there is none.
    pub(super) fn total(&self) -> f64 {
        self.levels.first().and_then(|sums| sums.last()).copied().unwrap_or(0.0)
    }

    /// The sum of all before the `k`-th place; 0 for the first.
    pub(super) fn sum_before(&self, k: usize) -> f64 {
        if k == 0 { 0.0 } else { self.levels[0][k - 1] }
    }

    /// Returns the first place whose sum is above `at`, the last where none is.
    pub(super) fn place(&self, at: f64) -> usize {
        let mut place = 0;
        for level in self.levels.iter().rev() {
            let run = &level[place * RUN..level.len().min((place + 1) * RUN)];
            place = place * RUN + run.partition_point(|sum| *sum <= at).min(run.len().saturating_sub(1));
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a walk from the first sum on finds it, for numbers of sums about those at which a level begins, with sums that stand still.
    #[test]
    fn a_search_finds_what_a_walk_finds() {
        for n in [1, 2, 15, 16, 17, 255, 256, 257, 4095, 4097, 5000] {
            let sums: Vec<f64> = (0..n).map(|k| f64::from(k / 3 * 2)).collect();
            let searched = RunningSums::new(sums.clone());
            assert_eq!(searched.total(), sums[sums.len() - 1]);
            for at in -1..=n {
                let at = f64::from(at);
                let expected = sums.iter().position(|s| *s > at).unwrap_or(sums.len() - 1);
                assert_eq!(searched.place(at), expected, "{at} of {n}");
            }
        }
        assert_eq!((RunningSums::default().total(), RunningSums::new(vec![3.0, 4.0]).sum_before(1)), (0.0, 3.0));
    }
}

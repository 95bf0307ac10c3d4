//! Quantiles of millions of values in fixed memory: a histogram with logarithmic bins.

use serde::Serialize;

/// Bins per factor of two: a quantile is read off with a relative error of at most 0.6 %.
const PER_OCTAVE: f64 = 64.0;
/// Values below `2^LOWEST` count as zero.
const LOWEST: f64 = -80.0;
/// Bins of a histogram: 120 octaves.
const BINS: usize = 64 * 120;

/// Counts of non-negative values in logarithmic bins: quantiles of any number of values in fixed memory, the same for
/// any order of adding and merging. Maximum and the sums are exact (sums up to rounding).
///
/// ```
/// use lampyris::study::Quantiles;
/// let mut errors = Quantiles::default();
/// (1..=1000).for_each(|k| errors.add(f64::from(k)));
/// assert_eq!((errors.count(), errors.max(), errors.mean()), (1000, 1000.0, 500.5));
/// assert!((errors.quantile(0.99) / 990.0 - 1.0).abs() < 0.006);
/// ```
#[derive(Clone, Debug)]
pub struct Quantiles {
    bins: Vec<u64>,
    /// Values below the lowest bin.
    zeros: u64,
    count: u64,
    max: f64,
    sum: f64,
    squares: f64,
}

/// The usual figures of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest value.
    pub max: f64,
}

impl Default for Quantiles {
    fn default() -> Self {
        Self { bins: Vec::new(), zeros: 0, count: 0, max: 0.0, sum: 0.0, squares: 0.0 }
    }
}

impl Quantiles {
    /// Counts one value; anything that is not a number counts as infinite, a negative one as 0.
    pub fn add(&mut self, value: f64) {
        // An error that is no number is the worst there is; it must not vanish from the histogram.
        let value = if value.is_nan() { f64::INFINITY } else { value.max(0.0) };
        self.count += 1;
        self.max = self.max.max(value);
        self.sum += value;
        self.squares += value * value;
        if value < LOWEST.exp2() {
            self.zeros += 1;
            return;
        }
        // An empty histogram takes no memory: its bins are 60 kB.
        if self.bins.is_empty() {
            self.bins = vec![0; BINS];
        }
        let bin = ((value.log2() - LOWEST) * PER_OCTAVE) as usize;
        self.bins[bin.min(BINS - 1)] += 1;
    }

    /// Adds the values that another has counted.
    pub fn merge(&mut self, other: &Self) {
        if self.bins.is_empty() {
            self.bins.clone_from(&other.bins);
        } else {
            for (a, b) in self.bins.iter_mut().zip(&other.bins) {
                *a += b;
            }
        }
        self.zeros += other.zeros;
        self.count += other.count;
        self.max = self.max.max(other.max);
        self.sum += other.sum;
        self.squares += other.squares;
    }

    /// Returns the number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the largest value, 0 without any.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Returns the mean, 0 without any value.
    pub fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum / self.count as f64 }
    }

    /// Returns the root of the mean square, 0 without any value.
    pub fn rms(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.squares / self.count as f64).sqrt() }
    }

    /// Returns the value below which a share (0 to 1) of the values lies, within 0.6 % up to 2⁴⁰; 0 without any value.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = (share.clamp(0.0, 1.0) * self.count as f64).ceil().max(1.0) as u64;
        let mut seen = self.zeros;
        if self.count == 0 || seen >= wanted {
            return 0.0;
        }
        for (bin, &n) in self.bins.iter().enumerate() {
            seen += n;
            if seen >= wanted {
                // The middle of the bin; not beyond the largest value, which is known exactly.
                return (LOWEST + (bin as f64 + 0.5) / PER_OCTAVE).exp2().min(self.max);
            }
        }
        self.max
    }

    /// Returns median, 99th percentile and maximum; zeros without any value.
    pub fn summary(&self) -> Summary {
        Summary { p50: self.quantile(0.5), p99: self.quantile(0.99), max: self.max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_thousand_numbers() {
        let (mut low, mut high) = (Quantiles::default(), Quantiles::default());
        for i in 1..=1000 {
            if i % 2 == 0 { &mut low } else { &mut high }.add(i as f64 * 1e-6);
        }
        low.merge(&high);
        assert!((low.quantile(0.5) / 500e-6 - 1.0).abs() < 0.006);
        assert!((low.quantile(0.99) / 990e-6 - 1.0).abs() < 0.006);
        assert_eq!(low.max(), 1e-3);
        assert!((low.mean() / 500.5e-6 - 1.0).abs() < 1e-12);
        let mut zeros = Quantiles::default();
        zeros.add(0.0);
        assert_eq!(zeros.quantile(0.9), 0.0);
        assert_eq!(Quantiles::default().summary(), Summary::default());
    }
}

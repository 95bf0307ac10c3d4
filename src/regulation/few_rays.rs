//! The uncertainty of a reading from few rays: the spread of replicates does not cover rays that did not arrive.
//!
//! Rays that land in an opening are counts. If each adds `a` candela and they are `m`, the truth may lie as far above as the upper limit of
//! a Poisson count of `m`, times `a`: 6.6 rays at three standard errors where none came, by root and skewness where many did. Rays of
//! several weights count as `m = V/a²` of the heaviest weight that may land there, with `V` the variance of the reading: by that the root
//! of `V` stays what it is, and what heavy rays might add that did not come is added.
//!
//! Which weight may land is read off the map. Around the opening lies a window so large that light of the heaviest rays of all, as bright
//! there as the limit lies beside the reading, would have been met in it with the same confidence; what landed in it weighs as `a = V/P`,
//! the ratio of variance to flux. Of the heaviest, `A`, no more than V/A of the flux can be there, for between many light ones they lower
//! that ratio little seen. As few as they are, all of them may be missing from the opening; of many, no more than the spread of their
//! number: that is added. (Rays of one weight from a net spread less than by chance, so that their ratio looks like that of a mixture.) All
//! this trusts the rays of each weight to be no denser in the opening than on the mean of the window. Where the window is dark, or larger
//! than the map, `A` itself is taken.

/// What is known of a run's rays where few of them landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySample {
    /// Flux of a ray of the source whose rays carry most, lm.
    pub heaviest_flux: f64,
    /// Number of replicates from which the errors were estimated.
    pub replicates: u32,
}

/// Combined standard errors that make sure: between a value and its limit for a verdict, between an edge and another place that might be
/// it, and around the place of an edge.
pub(super) const SIGMAS: f64 = 3.0;

/// From so many replicates on an error of three is as good as that of endlessly many: beyond it lie 0.16 % for 0.135 %.
pub(super) const MANY_REPLICATES: u32 = 100;

/// Flux below so much of the heaviest ray's is what rounding leaves of none in differences of sums over a map of 10⁷ rays.
const CANCELLED_SHARE: f64 = 1e-9;
/// Exponents are held below this: the quantile of one degree of freedom must not become endless.
const LARGEST_EXPONENT: f64 = 100.0;

/// Returns the upper limit of the mean of a Poisson count, at the one-sided confidence of so many normal standard errors (Wilson and
/// Hilferty, PNAS 17, 1931): of none at three 6.7, exactly −ln 0.00135 = 6.6.
pub(super) fn upper_count(count: f64, sigmas: f64) -> f64 {
    let next = count + 1.0;
    next * (1.0 - 1.0 / (9.0 * next) + sigmas / (3.0 * next.sqrt())).powi(3)
}

/// Returns Student's t that is exceeded as seldom as so many normal standard errors, for the spread of so many replicates (Wallace, Ann.
/// Math. Stat. 30, 1959, turned round): 4.1 for 3 of ten, never too small.
pub(super) fn student_t(sigmas: f64, replicates: u32) -> f64 {
    if replicates >= MANY_REPLICATES {
        return sigmas;
    }
    let freedom = f64::from(replicates.max(2) - 1);
    let z = sigmas * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    (freedom * (z * z / freedom).min(LARGEST_EXPONENT).exp_m1()).sqrt()
}

/// Light that may land in a cell and is not seen there.
#[derive(Clone, Copy, Debug)]
pub(super) struct LandingRay {
    /// Flux of a ray, lm.
    pub(super) flux: f64,
    /// Flux of the heaviest of all, lm.
    pub(super) heaviest: f64,
    /// Intensity by those, cd.
    pub(super) hidden: f64,
}

/// Largest distance of the truth from a reading, towards its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// What the heaviest ray that may land adds to the reading, cd; 0 where the truth lies towards fewer rays, or nothing is known of them.
    pub(super) ray_cd: f64,
    /// What heavier rays may add on the mean, cd, so few that they are not distinguished from the others.
    pub(super) hidden: f64,
    /// What one of these adds, cd.
    pub(super) hidden_ray_cd: f64,
    /// Variance of what more rays would bring nearer to the limit, cd².
    pub(super) counted: f64,
    /// Variance of the rest, cd².
    pub(super) other: f64,
    /// Replicates whose spread these are.
    pub(super) replicates: u32,
}

impl Noise {
    /// Returns the distance, cd, within which the truth lies at the one-sided confidence of so many standard errors, after `growth` times
    /// the rays.
    pub(super) fn reach(&self, sigmas: f64, growth: f64) -> f64 {
        let t = student_t(sigmas, self.replicates);
        let [counted, other] = [self.counted, self.other].map(|variance| (variance / growth).sqrt());
        let mut reach = t * counted;
        if self.ray_cd > 0.0 {
            let ray = self.ray_cd / growth;
            let count = (counted / ray).powi(2);
            // The spread's own doubt comes on top of that of the count.
            reach =
                ray * (upper_count(count, sigmas) - count) + self.missing(sigmas, growth) + (t - sigmas) * counted;
        }
        reach.hypot(t * other)
    }

    /// Returns how much of the light of hidden rays, cd, may be missing from the reading: of few all, of many the spread of their number.
    /// With more rays each is lighter, and their light stays.
    fn missing(&self, sigmas: f64, growth: f64) -> f64 {
        let spread = (self.hidden * self.hidden_ray_cd / growth).sqrt();
        self.hidden.min(sigmas * spread)
    }
}

/// The flux of the cells of a map and its variance, summed over rows and columns so that those of any box of cells take four look-ups.
#[derive(Clone, Debug)]
pub(super) struct LandedRays {
    pub(super) sample: RaySample,
    columns: usize,
    rows: usize,
    /// Flux, lm, its variance, lm², and solid angle, sr, of the cells before a row and a column; a row and a column more than cells.
    sums: Vec<[f64; 3]>,
    /// How many cells windows reach to each side of their middle one, each a quarter farther than the one before; the last one reaches from
    /// any cell over the whole map.
    reaches: Vec<usize>,
}

impl LandedRays {
    /// Sums up cells of intensity and error, cd, and solid angle, sr, row after row.
    pub(super) fn new(sample: RaySample, columns: usize, cells: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut sums = vec![[0.0; 3]; columns + 1];
        let mut row = [0.0; 3];
        for (index, [intensity, error, angle]) in cells.enumerate() {
            if index % columns == 0 {
                row = [0.0; 3];
                sums.push([0.0; 3]);
            }
            // A dark cell's error is stated and not spread.
            let error = if intensity > 0.0 { error } else { 0.0 };
            let cell = [intensity * angle, (error * angle).powi(2), angle];
            let above = sums[sums.len() - columns - 1];
            row = [0, 1, 2].map(|k| row[k] + cell[k]);
            sums.push([0, 1, 2].map(|k| above[k] + row[k]));
        }
        let rows = sums.len() / (columns + 1) - 1;
        let mut reaches = vec![1];
        while let Some(&last) = reaches.last().filter(|last| **last < columns.max(rows)) {
            reaches.push(last + last.div_ceil(4));
        }
        Self { sample, columns, rows, sums, reaches }
    }

    /// Returns flux, variance and solid angle of the cells of a box of half-open ranges: the first cell is in it, the end is not.
    fn box_sums(&self, [left, right]: [usize; 2], [low, high]: [usize; 2]) -> [f64; 3] {
        let at = |row: usize, column: usize| self.sums[row * (self.columns + 1) + column];
        let corners = [at(high, right), at(low, right), at(high, left), at(low, left)];
        [0, 1, 2].map(|k| corners[0][k] - corners[1][k] - corners[2][k] + corners[3][k])
    }

    /// Returns the heaviest rays that may land, unseen, in a cell (counted row after row) of a reading that is |`margin`| cd from its
    /// limit, at the one-sided confidence of `sigmas` standard errors; the heaviest of all where the window is dark or larger than the map.
    /// `size` is which window is looked at first and becomes the one that was taken: that of a cell nearby is about as large.
    pub(super) fn landing_ray(&self, cell: usize, margin: f64, sigmas: f64, size: &mut usize) -> LandingRay {
        let heaviest = self.sample.heaviest_flux;
        let unknown = LandingRay { flux: heaviest, heaviest, hidden: 0.0 };
        // Light of the heaviest rays, as bright as the margin, brings so many to the window that none is met as seldom as asked for.
        let wanted = upper_count(0.0, sigmas) * heaviest / margin.abs();
        let (row, column) = (cell / self.columns, cell % self.columns);
        let window = |reach: usize| {
            let across = [column.saturating_sub(reach), (column + reach + 1).min(self.columns)];
            let along = [row.saturating_sub(reach), (row + reach + 1).min(self.rows)];
            self.box_sums(across, along)
        };
        // The smallest one that is large enough.
        let is_large = |size: usize| window(self.reaches[size])[2] >= wanted;
        while *size > 0 && is_large(*size - 1) {
            *size -= 1;
        }
        while *size < self.reaches.len() && !is_large(*size) {
            *size += 1;
        }
        let Some([flux, variance, angle]) = self.reaches.get(*size).map(|reach| window(*reach)) else {
            return unknown;
        };
        // What is left of nothing is not to be divided by.
        if flux <= heaviest * CANCELLED_SHARE || variance <= 0.0 {
            return unknown;
        }
        let landed = (variance / flux).min(heaviest);
        let hidden = variance / (heaviest * angle) * (1.0 - landed / heaviest);
        LandingRay { flux: landed, heaviest, hidden }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_counts_are_those_of_the_tables() {
        // Exact upper limits at 99.865 %: −ln 0.00135, and by the incomplete gamma function.
        for (count, exact) in [(0.0, 6.608), (1.0, 8.900), (3.0, 12.68), (10.0, 23.65), (100.0, 133.8)] {
            assert!((upper_count(count, 3.0) / exact - 1.0).abs() < 0.025, "{count}: {}", upper_count(count, 3.0));
        }
    }

    #[test]
    fn few_replicates_ask_for_more_errors() {
        // Student's t at 99.865 % one-sided, from tables.
        for (replicates, exact) in [(3, 19.21), (10, 4.09), (31, 3.27), (64, 3.119)] {
            let found = student_t(3.0, replicates);
            assert!(found >= exact * 0.999 && found < exact * 1.25, "{replicates}: {found}");
        }
        assert!(student_t(3.0, 2) > 235.0 && student_t(3.0, 2).is_finite());
        assert_eq!(student_t(3.0, 128), 3.0);
    }

    /// Nets of 10⁴ and 10⁶ rays of one weight that bring 1000 cd, with a fifth of the variance of chance: what may be missing falls with
    /// the root of the rays, and a lone heavy ray may be missing altogether.
    #[test]
    fn light_that_might_be_missing_falls_with_more_rays() {
        let reach = |rays: f64, growth: f64| {
            let ray = 1000.0 / rays;
            let (landed, hidden) = (0.2 * ray, 0.2 * 0.8 * 1000.0);
            let counted = 0.2 * ray * 1000.0;
            Noise { ray_cd: landed, hidden, hidden_ray_cd: ray, counted, other: 0.0, replicates: 128 }
                .reach(3.0, growth)
        };
        // By chance alone the error would be 10 cd and 1 cd.
        assert!(reach(1e4, 1.0) < 3.0 * 2.0 * 10.0 && reach(1e6, 1.0) < 3.0 * 2.0, "{}", reach(1e6, 1.0));
        // What a hundred times the rays promise is what they give.
        assert!((reach(1e4, 100.0) / reach(1e6, 1.0) - 1.0).abs() < 1e-9);
        let few =
            Noise { ray_cd: 1e-3, hidden: 2.0, hidden_ray_cd: 5.0, counted: 0.0, other: 0.0, replicates: 128 };
        assert!((few.reach(3.0, 1.0) - 2.0).abs() < 0.01);
    }

    /// A field of rays of 1 lm in each of 100 cells, and one of 50 lm in the corner.
    #[test]
    fn the_weight_of_rays_is_that_of_the_neighbourhood() {
        let cells = (0..100).map(|k| if k == 99 { [50.0, 50.0, 1.0] } else { [1.0, 1.0, 1.0] });
        let landed = LandedRays::new(RaySample { heaviest_flux: 50.0, replicates: 128 }, 10, cells);
        assert_eq!(landed.box_sums([0, 10], [0, 10]), [149.0, 2599.0, 100.0]);
        // 6.7 rays of 50 lm at 40 cd take 8.4 cells: a window of nine holds only light ones, of which 9/50 lm may hide heavy ones.
        let ray = |cell: usize, margin: f64| {
            let first = landed.landing_ray(cell, margin, 3.0, &mut 0);
            // Whichever window is looked at first, the same is taken.
            for mut size in 0..=landed.reaches.len() {
                assert_eq!(landed.landing_ray(cell, margin, 3.0, &mut size).flux, first.flux);
            }
            first
        };
        let beside = ray(0, 100.0);
        assert!((beside.flux - 1.0).abs() < 1e-9 && (beside.hidden - 0.98 / 50.0).abs() < 1e-9, "{beside:?}");
        let near = ray(99, 100.0);
        assert!(near.flux > 45.0, "{near:?}");
        // No window is large enough to show that there is none.
        assert_eq!(ray(0, 1.0).flux, 50.0);
    }
}

//! Directions drawn from a measured luminous intensity.

use super::error::{Error, ErrorKind, require};
use crate::formats::{PhotometricType, Photometry};
use crate::math::{Vector, safe_newton};

/// What an angle may lie beyond its range, radians or as a share of a cell, as the rounding of degrees in files puts it.
const ROUNDING: f64 = 1e-9;
/// What a whole turn may be above 360°, radians: files written from f32 have seven digits.
const TURN_ROUNDING: f64 = 1e-7;

/// How near an angle from the pole is found, radians: fifty ulps of 1.
const QUANTILE_TOLERANCE: f64 = 1e-14;

/// Draws directions in proportion to a measured intensity, bilinear in its two angles, exactly: every ray carries the same flux.
///
/// Directions have the components of [`PhotometricType::direction`].
#[derive(Clone, Debug, PartialEq)]
pub struct IntensitySampler {
    kind: PhotometricType,
    /// Angle from the pole, and angle about it, radians.
    polar: Vec<f64>,
    turning: Vec<f64>,
    /// Intensity, `polar.len()` values per turning angle.
    intensity: Vec<f64>,
    /// Flux up to the end of each cell, cell by cell along the polar angle; starts with 0.
    sums: Vec<f64>,
}

impl IntensitySampler {
    /// Prepares a distribution for sampling; symmetry is expanded.
    ///
    /// # Errors
    /// When intensities do not fill at least two planes of two angles or are negative, angles do not ascend or leave the sphere, or there
    /// is no light.
    pub fn new(photometry: &Photometry) -> Result<Self, Error> {
        let p = photometry.expanded();
        let (columns, rows) = (p.horizontal_deg.len(), p.vertical_deg.len());
        if p.candela.len() != rows * columns || rows < 2 || columns < 2 {
            let (found, expected) = (p.candela.len(), rows.max(2) * columns.max(2));
            return Err(ErrorKind::WrongCount { what: "intensity", found, expected }.into());
        }
        for angles in [&p.horizontal_deg, &p.vertical_deg] {
            super::table::check_increasing("intensity", angles)?;
        }
        for &cd in &p.candela {
            require("an intensity", cd, cd >= 0.0, "zero or more")?;
        }
        let radians = |angles: &[f64], offset: f64| angles.iter().map(|a| (a + offset).to_radians()).collect();
        let by_row = |h: usize, v: usize| p.candela[h * rows + v];
        // Each type turns about an axis of its own: all become an angle from the pole and one about it. For type B the horizontal angle
        // is the one from the pole.
        let (polar, turning, intensity): (Vec<f64>, Vec<f64>, Vec<f64>) = match p.kind {
            PhotometricType::C => {
                (radians(&p.vertical_deg, 0.0), radians(&p.horizontal_deg, 0.0), p.candela.clone())
            }
            PhotometricType::A => {
                (radians(&p.vertical_deg, 90.0), radians(&p.horizontal_deg, 0.0), p.candela.clone())
            }
            PhotometricType::B => {
                let turned = (0..rows).flat_map(|v| (0..columns).map(move |h| by_row(h, v))).collect();
                (radians(&p.horizontal_deg, 90.0), radians(&p.vertical_deg, 0.0), turned)
            }
        };
        let within = |x: f64| (-ROUNDING..=std::f64::consts::PI + ROUNDING).contains(&x);
        for &x in &polar {
            require("an angle from the pole", x.to_degrees(), within(x), "from 0 to 180 degrees")?;
        }
        let turn = turning[turning.len() - 1] - turning[0];
        require(
            "the range of the angle about the pole",
            turn.to_degrees(),
            turn <= std::f64::consts::TAU + TURN_ROUNDING,
            "at most 360 degrees",
        )?;
        // Flux up to each cell, by which cells are chosen.
        let mut sampler = Self { kind: p.kind, polar, turning, intensity, sums: vec![0.0] };
        let mut sum = 0.0;
        for t in 0..sampler.turning.len() - 1 {
            for i in 0..sampler.polar.len() - 1 {
                let [low, high] = sampler.marginal(t, i);
                sum += sampler.ring(i, low, high, sampler.polar[i + 1])
                    * (sampler.turning[t + 1] - sampler.turning[t]);
                sampler.sums.push(sum);
            }
        }
        if sum > 0.0 { Ok(sampler) } else { Err(ErrorKind::NoPower { what: "the intensity distribution" }.into()) }
    }

    /// Flux of the whole distribution, lumens.
    pub fn flux(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// Draws a unit direction; `u` uniform in `[0, 1)²`.
    pub fn sample(&self, u: [f64; 2]) -> Vector {
        // Below the whole, so that rounding never ends in a cell without light.
        let wanted = (u[0] * self.flux()).min(self.flux().next_down());
        let cell = self.sums.partition_point(|&s| s <= wanted).clamp(1, self.sums.len() - 1) - 1;
        let (t, i) = (cell / (self.polar.len() - 1), cell % (self.polar.len() - 1));
        let [low, high] = self.marginal(t, i);
        let width = self.turning[t + 1] - self.turning[t];
        let missing = (wanted - self.sums[cell]) / width;
        let (a, b) = (self.polar[i], self.polar[i + 1]);
        // First the angle from the pole, by inverting the flux of the cell's rings, which holds the sine of the sphere…
        let x = safe_newton(
            |x| {
                let s = (x - a) / (b - a);
                (self.ring(i, low, high, x) - missing, (low + s * (high - low)) * x.sin())
            },
            a,
            b,
            QUANTILE_TOLERANCE,
        )
        .unwrap_or(b);
        let s = (x - a) / (b - a);
        // …then the one about it, linear between the sides of the ring that was found.
        let along = |t: usize| {
            let (y0, y1) = (self.node(t, i), self.node(t, i + 1));
            y0 + s * (y1 - y0)
        };
        let turned = self.turning[t] + width * linear_quantile(along(t), along(t + 1), u[1]);
        self.direction(x, turned)
    }

    /// Share of the flux per steradian in a direction of any length; zero outside the measured angles.
    pub fn density(&self, d: Vector) -> f64 {
        let [h, v] = self.kind.angles_deg(d).map(f64::to_radians);
        let quarter = std::f64::consts::FRAC_PI_2;
        let (x, turned) = match self.kind {
            PhotometricType::C => (v, h),
            PhotometricType::A => (v + quarter, h),
            PhotometricType::B => (h + quarter, v),
        };
        let (Some((i, s)), Some((t, r))) = (find_interval(&self.polar, x), find_interval(&self.turning, turned))
        else {
            return 0.0;
        };
        let along = |t: usize| self.node(t, i) + s * (self.node(t, i + 1) - self.node(t, i));
        (along(t) + r * (along(t + 1) - along(t))) / self.flux()
    }

    /// Intensity at the `t`-th turning and the `i`-th polar angle.
    fn node(&self, t: usize, i: usize) -> f64 {
        self.intensity[t * self.polar.len() + i]
    }

    /// Mean intensity over the turning angle of a cell, at its two polar angles.
    fn marginal(&self, t: usize, i: usize) -> [f64; 2] {
        [0.5 * (self.node(t, i) + self.node(t + 1, i)), 0.5 * (self.node(t, i + 1) + self.node(t + 1, i + 1))]
    }

    /// Returns the integral, cd rad, of intensity times the sine of the polar angle, from the start of polar interval `i` up to the polar
    /// angle `x`, radians; the intensity is linear over the interval, from `low` to `high`.
    fn ring(&self, i: usize, low: f64, high: f64, x: f64) -> f64 {
        let (a, b) = (self.polar[i], self.polar[i + 1]);
        let slope = (high - low) / (b - a);
        // cos a − cos x and sin x − sin a − (x − a) cos x, both by half the sum and half the difference, without cancellation.
        let (mean, half) = (0.5 * (x + a), 0.5 * (x - a));
        let fall = 2.0 * mean.sin() * half.sin();
        low * fall + slope * 2.0 * (mean.cos() * sine_less_h_cosine(half) + mean.sin() * half * half.sin())
    }

    /// Returns the unit direction at an angle from the pole and one about it, radians, in the axes of [`PhotometricType::direction`].
    fn direction(&self, x: f64, turned: f64) -> Vector {
        let (h, v) = match self.kind {
            PhotometricType::C => (turned.to_degrees(), x.to_degrees()),
            PhotometricType::A => (turned.to_degrees(), x.to_degrees() - 90.0),
            PhotometricType::B => (x.to_degrees() - 90.0, turned.to_degrees()),
        };
        self.kind.direction(h, v).normalize()
    }
}

/// Returns sin h − h cos h, which begins with h³/3.
fn sine_less_h_cosine(h: f64) -> f64 {
    if h.abs() > 0.1 {
        return h.sin() - h * h.cos();
    }
    // The terms of the series left out are below 1e-14 of the first.
    let square = h * h;
    h * square * (1.0 / 3.0 - square * (1.0 / 30.0 - square * (1.0 / 840.0 - square / 45_360.0)))
}

/// The interval of ascending nodes, at least two, that holds `x` and the fraction in it; `None` outside by more than rounding.
fn find_interval(nodes: &[f64], x: f64) -> Option<(usize, f64)> {
    let i = nodes.partition_point(|&a| a <= x).clamp(1, nodes.len() - 1) - 1;
    let s = (x - nodes[i]) / (nodes[i + 1] - nodes[i]);
    (-ROUNDING..=1.0 + ROUNDING).contains(&s).then_some((i, s))
}

/// The fraction of an interval below which lies the share `u` of a density that runs linearly from `y0` to `y1`, both zero or more; `u`
/// itself where both are zero.
pub(super) fn linear_quantile(y0: f64, y1: f64, u: f64) -> f64 {
    // The root of the quadratic cumulative, in the form that does not cancel when both ends are equal.
    let root = (y0 * y0 + (y1 * y1 - y0 * y0) * u).max(0.0).sqrt();
    if y0 + root > 0.0 { ((y0 + y1) * u / (y0 + root)).clamp(0.0, 1.0) } else { u }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::testing::pairs;
    use std::f64::consts::PI;

    fn photometry(kind: PhotometricType, h: &[f64], v: &[f64], f: impl Fn(f64, f64) -> f64) -> Photometry {
        Photometry {
            kind,
            horizontal_deg: h.to_vec(),
            vertical_deg: v.to_vec(),
            candela: h.iter().flat_map(|&h| v.iter().map(move |&v| (h, v))).map(|(h, v)| f(h, v)).collect(),
            lamp_lumens: None,
            watts: 0.0,
            opening_mm: [0.0; 3],
            keywords: Vec::new(),
        }
    }

    fn nodes(a: f64, b: f64, n: usize) -> Vec<f64> {
        (0..=n).map(|i| a + (b - a) * i as f64 / n as f64).collect()
    }

    #[test]
    fn flux_between_angles_a_hair_apart_is_that_of_the_series() {
        // At 30° and 1e-9 rad more the integral of (x − a) sin x is sin a · d²/2, next d³/3 · cos a.
        let (a, d) = (PI / 6.0, 1e-9f64);
        let angles = [0.0, 30.0, 30.0 + d.to_degrees(), 180.0];
        let s = IntensitySampler::new(&photometry(PhotometricType::C, &[0.0, 360.0], &angles, |_, _| 1.0)).unwrap();
        let width = s.polar[2] - s.polar[1];
        let exact = 0.5 * a.sin() * width * width;
        assert!((s.ring(1, 0.0, 1.0, s.polar[2]) * width / exact - 1.0).abs() < 1e-6);
        // Wider ones against the plain form, on both sides of where the series ends.
        for h in [0.05, 0.0999, 0.1001, 0.7] {
            assert!((sine_less_h_cosine(h) - (f64::sin(h) - h * h.cos())).abs() < 1e-16, "{h}");
        }
    }

    #[test]
    fn an_even_distribution_is_the_uniform_sphere() {
        for (kind, h, v) in [
            (PhotometricType::C, nodes(0.0, 360.0, 5), nodes(0.0, 180.0, 7)),
            (PhotometricType::A, nodes(-180.0, 180.0, 6), nodes(-90.0, 90.0, 5)),
            (PhotometricType::B, nodes(-90.0, 90.0, 6), nodes(-180.0, 180.0, 5)),
        ] {
            let s = IntensitySampler::new(&photometry(kind, &h, &v, |_, _| 2.0)).unwrap();
            assert!((s.flux() - 8.0 * PI).abs() < 1e-12);
            let n = 100_000;
            let mut sums = [Vector::ZERO; 2];
            for u in pairs(n) {
                let d = s.sample(u);
                sums = [sums[0] + d, sums[1] + d * d];
                assert!((s.density(d) - 0.25 / PI).abs() < 1e-12);
            }
            let within = 5.0 / (3.0 * n as f64).sqrt();
            assert!((sums[0] / n as f64).abs().max_element() < within, "{kind:?}: {sums:?}");
            assert!((sums[1] / n as f64 - 1.0 / 3.0).abs().max_element() < within, "{kind:?}: {sums:?}");
        }
    }

    #[test]
    fn samples_follow_a_headlamp_like_beam() {
        let f = |h: f64, v: f64| 2e4 * (-(h / 8.0).powi(2) - ((v + 1.0) / 2.0).powi(2)).exp();
        for kind in [PhotometricType::A, PhotometricType::B] {
            let (h, v) = (nodes(-30.0, 30.0, 40), nodes(-10.0, 10.0, 40));
            let p = photometry(kind, &h, &v, f);
            let s = IntensitySampler::new(&p).unwrap();
            assert!((s.flux() / p.flux() - 1.0).abs() < 1e-12);
            // χ² over 12 × 10 cells of the angles, expectations by midpoints of the density.
            let (n, cells, fine) = (100_000, [12usize, 10], 20);
            let mut count = vec![0.0; cells[0] * cells[1]];
            for u in pairs(n) {
                let [h, v] = kind.angles_deg(s.sample(u));
                let i = ((h + 30.0) / 60.0 * cells[0] as f64) as usize;
                let j = ((v + 10.0) / 20.0 * cells[1] as f64) as usize;
                count[i.min(cells[0] - 1) * cells[1] + j.min(cells[1] - 1)] += 1.0;
            }
            let (mut chi2, mut used) = (0.0, 0.0);
            for (k, c) in count.iter().enumerate() {
                let corner = [k / cells[1], k % cells[1]];
                let mut expected = 0.0;
                for a in 0..fine * fine {
                    let at = |c: usize, cells: usize, a: usize| {
                        (c as f64 + (a as f64 + 0.5) / fine as f64) / cells as f64
                    };
                    let h = -30.0 + 60.0 * at(corner[0], cells[0], a / fine);
                    let v = -10.0 + 20.0 * at(corner[1], cells[1], a % fine);
                    let weight = if kind == PhotometricType::A { v } else { h }.to_radians().cos();
                    expected += s.density(kind.direction(h, v)) * weight;
                }
                let area = (60.0 / cells[0] as f64).to_radians() * (20.0 / cells[1] as f64).to_radians();
                expected *= n as f64 * area / (fine * fine) as f64;
                if expected > 20.0 {
                    chi2 += (c - expected) * (c - expected) / expected;
                    used += 1.0;
                }
            }
            assert!(used > 30.0 && chi2 < used + 5.0 * (2.0f64 * used).sqrt(), "{kind:?}: {chi2} over {used}");
        }
    }

    #[test]
    fn a_rotational_cosine_has_the_mean_of_lamberts_law() {
        let p = photometry(PhotometricType::C, &[0.0], &nodes(0.0, 90.0, 900), |_, v| v.to_radians().cos());
        let s = IntensitySampler::new(&p).unwrap();
        let n = 100_000;
        let mean = pairs(n).map(|u| s.sample(u).z).sum::<f64>() / n as f64;
        assert!((mean - 2.0 / 3.0).abs() < 5.0 * 0.236 / (n as f64).sqrt(), "{mean}");
        assert_eq!(s.density(-Vector::Z), 0.0);
    }

    #[test]
    fn nonsense_is_refused() {
        let none = photometry(PhotometricType::C, &[0.0], &[0.0, 90.0], |_, _| 0.0);
        assert!(IntensitySampler::new(&none).unwrap_err().to_string().contains("no power"));
        let wide = photometry(PhotometricType::A, &[0.0, 10.0], &[0.0, 100.0], |_, _| 1.0);
        assert!(IntensitySampler::new(&wide).is_err());
        let short = Photometry { candela: vec![1.0], ..none };
        assert!(IntensitySampler::new(&short).is_err());
    }
}

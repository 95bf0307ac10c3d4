//! Spectra of sources, and wavelengths drawn from them.

use super::cie_daylight;
use super::cie_observer::{observer_range, xyz_of_watt};
use super::error::{Error, ErrorKind, require};
use super::intensity::linear_quantile;
use super::table::Table;
use crate::math::units::WAVELENGTHS_NM;

/// The power of a source over the wavelength, up to a factor.
///
/// ```
/// use lampyris::optics::{MAX_EFFICACY, Spectrum};
/// // The lumen is defined at 540 THz, 555 nm in air, where the eye sees most.
/// assert!((Spectrum::line(555.0).sampler()?.efficacy() / MAX_EFFICACY - 1.0).abs() < 1e-3);
/// # Ok::<(), lampyris::optics::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Spectrum {
    /// Separate lines: wavelength in nm and relative power.
    Lines(Vec<[f64; 2]>),
    /// Relative power per nm over the wavelength in nm; zero beyond the table.
    Table(Table),
    /// Planck's law between two wavelengths.
    BlackBody {
        /// Temperature, kelvin.
        kelvin: f64,
        /// First and last wavelength, nm.
        range_nm: [f64; 2],
    },
    /// The CIE's daylight D65, 360 to 830 nm.
    D65,
    /// Blue chip and yellow phosphor.
    WhiteLed(WhiteLed),
}

/// A white LED as two Gaussians over the wavelength: the chip and its phosphor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteLed {
    /// Peak of the chip, nm.
    pub blue_nm: f64,
    /// Full width of the chip's peak at half its height, nm.
    pub blue_width_nm: f64,
    /// Peak of the phosphor, nm.
    pub phosphor_nm: f64,
    /// Full width of the phosphor's peak at half its height, nm.
    pub phosphor_width_nm: f64,
    /// Share of the power in the chip's peak.
    pub blue_share: f64,
}

impl Default for WhiteLed {
    /// A lamp of some 5000 K: 450 nm chip 20 nm wide, 570 nm phosphor 120 nm wide, 22 % of the power blue.
    fn default() -> Self {
        Self { blue_nm: 450.0, blue_width_nm: 20.0, phosphor_nm: 570.0, phosphor_width_nm: 120.0, blue_share: 0.22 }
    }
}

impl Spectrum {
    /// A single line at a vacuum wavelength.
    pub fn line(wavelength_nm: f64) -> Self {
        Self::Lines(vec![[wavelength_nm, 1.0]])
    }

    /// The wavelength, nm, of a spectrum of one line; `None` for every other.
    pub fn single_line(&self) -> Option<f64> {
        match self {
            Self::Lines(lines) => match lines[..] {
                [[nm, _]] => Some(nm),
                _ => None,
            },
            _ => None,
        }
    }

    /// Makes the spectrum ready to draw wavelengths from.
    ///
    /// # Errors
    /// When a number is out of range or the spectrum carries no power, as a table of one point.
    pub fn sampler(&self) -> Result<Wavelengths, Error> {
        match self {
            Self::Lines(lines) => Wavelengths::lines(lines),
            Self::Table(table) => Wavelengths::continuous(table.clone()),
            Self::D65 => {
                let rows = cie_daylight::DAYLIGHT.iter().enumerate();
                let table = Table::new(
                    "D65",
                    rows.map(|(i, &p)| (cie_daylight::DAYLIGHT_START + cie_daylight::STEP * i as f64, p)),
                )?;
                Wavelengths::continuous(table)
            }
            Self::BlackBody { kelvin, range_nm: [a, b] } => {
                require("the temperature", *kelvin, *kelvin > 0.0, "positive, in kelvin")?;
                require_wavelength("the first wavelength", *a)?;
                require_wavelength("the last wavelength", *b)?;
                require("the last wavelength", *b, b > a, "above the first")?;
                Wavelengths::continuous(Table::sampled([*a, *b], steps(*b - *a), |nm| planck(nm, *kelvin)))
            }
            Self::WhiteLed(led) => {
                require("the blue share", led.blue_share, (0.0..=1.0).contains(&led.blue_share), "from 0 to 1")?;
                for nm in [led.blue_nm, led.phosphor_nm, led.blue_width_nm, led.phosphor_width_nm] {
                    require("a wavelength or width of the LED", nm, nm > 0.0 && nm < 1e4, "positive, in nm")?;
                }
                let parts = [
                    (led.blue_nm, led.blue_width_nm, led.blue_share),
                    (led.phosphor_nm, led.phosphor_width_nm, 1.0 - led.blue_share),
                ];
                let power =
                    |nm: f64| parts.iter().map(|&(at, width, share)| share * gaussian(nm - at, width)).sum();
                Wavelengths::continuous(Table::sampled([380.0, 780.0], 800, power))
            }
        }
    }
}

/// Refuses what is no wavelength of light in nm.
fn require_wavelength(what: &'static str, nm: f64) -> Result<f64, Error> {
    require(what, nm, WAVELENGTHS_NM.contains(&nm), "from 1 to 1e6 nm; 0.55 µm are 550 nm")
}

/// Number of steps over a range of wavelengths: of at most 1 nm, but from 64 to 4000.
fn steps(range_nm: f64) -> usize {
    (range_nm.ceil() as usize).clamp(64, 4000)
}

/// Spectral exitance per wavelength at a wavelength by Planck's law, up to a factor; c₂ of the SI since 2019.
fn planck(nm: f64, kelvin: f64) -> f64 {
    (nm * 1e-3).powi(-5) / (1.438_776_877e7 / (nm * kelvin)).exp_m1()
}

/// A Gaussian of area 1 about 0 with this full width at half height, at `x`.
fn gaussian(x: f64, width: f64) -> f64 {
    // The full width at half height is √(8 ln 2) deviations.
    let sigma = width / (8.0 * 2f64.ln()).sqrt();
    (-x * x / (2.0 * sigma * sigma)).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt())
}

/// A spectrum normalised to power 1, ready to draw wavelengths from by inversion.
#[derive(Clone, Debug, PartialEq)]
pub struct Wavelengths {
    kind: Kind,
    /// Power up to and including each line, or up to each point of the table; the last is the whole, before normalisation.
    sums: Vec<f64>,
}

/// Wavelengths of lines, nm; or points of wavelength, nm, and power between which it is linear.
#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Lines(Vec<f64>),
    Continuous(Vec<[f64; 2]>),
}

impl Wavelengths {
    /// The spectrum of lines, each a wavelength, nm, and a relative power; refused unless these are positive, and powers 0 or more.
    fn lines(lines: &[[f64; 2]]) -> Result<Self, Error> {
        let mut sum = 0.0;
        let mut sums = Vec::with_capacity(lines.len());
        for &[nm, power] in lines {
            require_wavelength("a wavelength", nm)?;
            sum += require("the power of a line", power, power >= 0.0, "zero or more")?;
            sums.push(sum);
        }
        Self::with_power(Kind::Lines(lines.iter().map(|l| l[0]).collect()), sums)
    }

    /// The spectrum of a table of wavelength, nm, and relative power, linear between its points; refused without power, as with one point,
    /// or with a wavelength that is not positive or a negative power.
    fn continuous(table: Table) -> Result<Self, Error> {
        let points: Vec<[f64; 2]> = table.points().map(|(x, y)| [x, y]).collect();
        let [low, _] = table.extremes();
        require("the power of a spectrum", low, low >= 0.0, "zero or more at every wavelength")?;
        require_wavelength("the first wavelength", points[0][0])?;
        require_wavelength("the last wavelength", points[points.len() - 1][0])?;
        let mut sums = vec![0.0];
        for p in points.windows(2) {
            // Linear between its points, so that trapezia are exact.
            sums.push(sums[sums.len() - 1] + 0.5 * (p[1][0] - p[0][0]) * (p[0][1] + p[1][1]));
        }
        Self::with_power(Kind::Continuous(points), sums)
    }

    /// Joins both; refuses sums that are none, or end in no power or not in a finite one.
    fn with_power(kind: Kind, sums: Vec<f64>) -> Result<Self, Error> {
        match sums.last() {
            Some(&total) if total > 0.0 && total.is_finite() => Ok(Self { kind, sums }),
            _ => Err(ErrorKind::NoPower { what: "the spectrum" }.into()),
        }
    }

    /// Power of the whole, before normalisation.
    fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// Draws a wavelength in nm in proportion to power; `u` uniform in `[0, 1)`. It rises with `u`, for lines where these ascend.
    pub fn sample(&self, u: f64) -> f64 {
        // Below the whole, so that rounding never ends in a piece without power.
        let wanted = (u * self.total()).min(self.total().next_down());
        let i = self.sums.partition_point(|&s| s <= wanted);
        match &self.kind {
            Kind::Lines(nm) => nm[i.min(nm.len() - 1)],
            Kind::Continuous(points) => {
                let i = i.clamp(1, points.len() - 1);
                let ([x0, y0], [x1, y1]) = (points[i - 1], points[i]);
                let share = (wanted - self.sums[i - 1]) / (self.sums[i] - self.sums[i - 1]);
                x0 + (x1 - x0) * linear_quantile(y0, y1, share)
            }
        }
    }

    /// Wavelengths, nm, of the lines that have power; `None` for a continuous spectrum.
    pub(crate) fn lit_lines(&self) -> Option<Vec<f64>> {
        let Kind::Lines(nm) = &self.kind else { return None };
        let is_lit = |&i: &usize| self.sums[i] > i.checked_sub(1).map_or(0.0, |before| self.sums[before]);
        Some((0..nm.len()).filter(is_lit).map(|i| nm[i]).collect())
    }

    /// Share of power per nm at a wavelength; zero beyond the table, and for lines, whose density is not a function.
    pub fn density(&self, wavelength_nm: f64) -> f64 {
        match &self.kind {
            Kind::Lines(_) => 0.0,
            Kind::Continuous(points) => {
                let i = points.partition_point(|p| p[0] <= wavelength_nm);
                if i == 0 || wavelength_nm > points[points.len() - 1][0] {
                    return 0.0;
                }
                let ([x0, y0], [x1, y1]) = (points[i - 1], points[i.min(points.len() - 1)]);
                let s = if x1 > x0 { (wavelength_nm - x0) / (x1 - x0) } else { 0.0 };
                (y0 + s * (y1 - y0)) / self.total()
            }
        }
    }

    /// Least and greatest wavelength of its lines or points, nm, also where these carry no power.
    pub fn range_nm(&self) -> [f64; 2] {
        match &self.kind {
            Kind::Lines(nm) => nm.iter().fold([f64::INFINITY, 0.0], |[a, b], &x| [a.min(x), b.max(x)]),
            Kind::Continuous(points) => [points[0][0], points[points.len() - 1][0]],
        }
    }

    /// CIE XYZ of one watt of this light, Y in lumens; zero where the eye sees nothing of it.
    pub fn xyz(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |nm: f64, weight: f64| {
            for (s, v) in sum.iter_mut().zip(xyz_of_watt(nm)) {
                *s += weight * v;
            }
        };
        match &self.kind {
            Kind::Lines(lines) => {
                let mut before = 0.0;
                for (&nm, &s) in lines.iter().zip(&self.sums) {
                    add(nm, (s - before) / self.total());
                    before = s;
                }
            }
            Kind::Continuous(_) => {
                let [a, b] = self.range_nm();
                // Simpson on quarter nanometres: exact where table and observer are linear, so but for their corners.
                let n = 8 * steps(b - a);
                let h = (b - a) / n as f64;
                for i in 0..=n {
                    let weight = if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i as u32 % 2)) };
                    let nm = a + h * i as f64;
                    add(nm, weight * h / 3.0 * self.density(nm));
                }
            }
        }
        sum
    }

    /// The same light by its lumens in place of its watts: what wavelengths are drawn from where power is counted in lumens. The product
    /// with V(λ) is taken every nanometre and at every point of the spectrum.
    ///
    /// # Errors
    /// When the eye sees nothing of it.
    pub fn photometric(&self) -> Result<Self, Error> {
        match &self.kind {
            Kind::Lines(nm) => {
                // Powers of lines are kept as running sums, from which they are recovered.
                let before = std::iter::once(0.0).chain(self.sums.iter().copied());
                let watts = self.sums.iter().zip(before).map(|(s, before)| s - before);
                Self::lines(&nm.iter().zip(watts).map(|(&nm, w)| [nm, w * xyz_of_watt(nm)[1]]).collect::<Vec<_>>())
            }
            Kind::Continuous(points) => {
                let [first, last] = observer_range();
                let [a, b] = self.range_nm().map(|nm| nm.clamp(first, last));
                let steps = (0..=(b - a).ceil() as usize).map(|k| (a + k as f64).min(b));
                // Between its own points the spectrum is linear: with these and every nanometre the product is followed closely.
                let own = points.iter().map(|p| p[0]).filter(|nm| (a..=b).contains(nm));
                let mut nm: Vec<f64> = steps.chain(own).collect();
                nm.sort_by(f64::total_cmp);
                nm.dedup();
                let lumens = |nm: f64| (nm, self.density(nm) * xyz_of_watt(nm)[1]);
                Self::continuous(Table::new("spectrum", nm.into_iter().map(lumens))?)
            }
        }
    }

    /// Lumens per watt.
    pub fn efficacy(&self) -> f64 {
        self.xyz()[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::chromaticity;
    use crate::optics::testing::numbers;

    fn xy(s: &Spectrum) -> [f64; 2] {
        chromaticity(s.sampler().unwrap().xyz()).unwrap()
    }

    fn near(a: [f64; 2], b: [f64; 2], within: f64) -> bool {
        (a[0] - b[0]).abs() < within && (a[1] - b[1]).abs() < within
    }

    #[test]
    fn published_chromaticities() {
        // CIE 015: D65, equal energy, and illuminant A (a black body of 2855.54 K with today's c₂).
        assert!(near(xy(&Spectrum::D65), [0.31272, 0.32903], 5e-5), "{:?}", xy(&Spectrum::D65));
        let flat = Spectrum::Table(Table::new("spectrum", [(380.0, 1.0), (780.0, 1.0)]).unwrap());
        assert!(near(xy(&flat), [1.0 / 3.0, 1.0 / 3.0], 5e-5), "{:?}", xy(&flat));
        let a = Spectrum::BlackBody { kelvin: 2855.54, range_nm: [360.0, 830.0] };
        assert!(near(xy(&a), [0.44757, 0.40745], 5e-5), "{:?}", xy(&a));
    }

    #[test]
    fn the_default_led_is_white() {
        // Within 0.01 of the Planckian locus at 5000 K, (0.3451, 0.3516).
        let led = Spectrum::WhiteLed(WhiteLed::default());
        assert!(near(xy(&led), [0.3451, 0.3516], 0.012), "{:?}", xy(&led));
        let efficacy = led.sampler().unwrap().efficacy();
        assert!((280.0..360.0).contains(&efficacy), "{efficacy}");
    }

    #[test]
    fn a_watt_of_green_is_683_lumens() {
        let green = Spectrum::line(555.0).sampler().unwrap();
        assert_eq!(green.efficacy(), 683.0);
        assert_eq!((green.sample(0.0), green.sample(0.999)), (555.0, 555.0));
        assert_eq!(xyz_of_watt(300.0), [0.0; 3]);
        assert_eq!(Spectrum::line(555.0).single_line(), Some(555.0));
    }

    #[test]
    fn a_black_body_peaks_where_wien_says() {
        // b = 2.897771955e6 nm·K; the peak of the density lies within a step of it.
        let w = Spectrum::BlackBody { kelvin: 5000.0, range_nm: [300.0, 1500.0] }.sampler().unwrap();
        let peak = 2.897771955e6 / 5000.0;
        assert!(w.density(peak) > w.density(peak - 3.0) && w.density(peak) > w.density(peak + 3.0));
        // Stefan–Boltzmann: 25.0 % of the power lies below the peak wavelength of the whole spectrum.
        let all = Spectrum::BlackBody { kelvin: 5000.0, range_nm: [100.0, 100_000.0] }.sampler().unwrap();
        let below = (0..4000).filter(|i| all.sample((*i as f64 + 0.5) / 4000.0) < peak).count() as f64 / 4000.0;
        assert!((below - 0.25).abs() < 0.01, "{below}");
    }

    #[test]
    fn samples_follow_the_density() {
        let table = Table::new("spectrum", [(400.0, 0.0), (500.0, 2.0), (550.0, 2.0), (700.0, 0.5)]).unwrap();
        let w = Spectrum::Table(table).sampler().unwrap();
        let total = 100.0 + 100.0 + 187.5;
        assert!((w.density(450.0) - 1.0 / total).abs() < 1e-15);
        // Quantiles at the corners, by hand.
        assert!((w.sample(100.0 / total) - 500.0).abs() < 1e-9);
        assert!((w.sample(25.0 / total) - 450.0).abs() < 1e-9);
        assert!((w.sample(200.0 / total) - 550.0).abs() < 1e-9);
        let (n, bins) = (100_000, 15);
        let mut count = vec![0.0; bins];
        for u in numbers(n) {
            count[((w.sample(u) - 400.0) / 20.0) as usize] += 1.0;
        }
        let chi2: f64 = count
            .iter()
            .enumerate()
            .map(|(i, c)| {
                // Simpson on pieces that end at the corners: 500 and 550 lie on or halfway between bin borders.
                let a = 400.0 + 20.0 * i as f64;
                let half = |a: f64| 10.0 / 6.0 * (w.density(a) + 4.0 * w.density(a + 5.0) + w.density(a + 10.0));
                let e = n as f64 * (half(a) + half(a + 10.0));
                (c - e) * (c - e) / e
            })
            .sum();
        assert!(chi2 < 14.0 + 5.0 * 28f64.sqrt(), "{chi2}");
    }

    #[test]
    fn lines_are_drawn_by_their_power() {
        let w = Spectrum::Lines(vec![[486.1, 1.0], [587.6, 2.0], [656.3, 1.0]]).sampler().unwrap();
        assert_eq!([0.0, 0.2499, 0.25, 0.74, 0.76].map(|u| w.sample(u)), [486.1, 486.1, 587.6, 587.6, 656.3]);
        assert!(Spectrum::Lines(vec![]).sampler().is_err());
        assert!(Spectrum::Lines(vec![[500.0, 0.0]]).sampler().unwrap_err().to_string().contains("no power"));
        assert!(Spectrum::BlackBody { kelvin: -1.0, range_nm: [400.0, 700.0] }.sampler().is_err());
    }
}

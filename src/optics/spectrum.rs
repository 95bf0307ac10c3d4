//! Spectra of sources, and wavelengths drawn from them.

use super::cie_daylight;
use super::error::{Error, require, require_wavelength};
use super::table::Table;
use super::wavelengths::{MOST_EVEN_NM, Wavelengths, steps};

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
                let power = |nm: f64| planck(nm, *kelvin);
                if *b - *a <= MOST_EVEN_NM {
                    return Wavelengths::continuous(Table::sampled([*a, *b], steps(*b - *a), power));
                }
                // Even steps over so much would be wider than what the eye sees of it; even ratios are fine where the light is.
                let at = |i: usize| if i == RATIOS { *b } else { *a * (*b / *a).powf(i as f64 / RATIOS as f64) };
                Wavelengths::continuous(Table::new("black body", (0..=RATIOS).map(|i| (at(i), power(at(i)))))?)
            }
            Self::WhiteLed(led) => {
                require("the blue share", led.blue_share, (0.0..=1.0).contains(&led.blue_share), "from 0 to 1")?;
                let [first, last] = LED_RANGE_NM;
                for nm in [led.blue_nm, led.phosphor_nm] {
                    require("a peak of the LED", nm, (first..=last).contains(&nm), "from 380 to 780 nm")?;
                }
                for nm in [led.blue_width_nm, led.phosphor_width_nm] {
                    require("a width of the LED", nm, (1.0..1e4).contains(&nm), "1 nm or more, below 10,000")?;
                }
                let sampled = |power: &dyn Fn(f64) -> f64| {
                    Wavelengths::continuous(Table::sampled(LED_RANGE_NM, LED_STEPS, power))
                };
                let [blue, phosphor] = [(led.blue_nm, led.blue_width_nm), (led.phosphor_nm, led.phosphor_width_nm)]
                    .map(|(at, width)| move |nm: f64| gaussian(nm - at, width));
                // What lies beyond the range is missing from it, and each peak is to have its share all the same.
                let (in_blue, in_phosphor) = (sampled(&blue)?.total(), sampled(&phosphor)?.total());
                sampled(&|nm| {
                    led.blue_share * blue(nm) / in_blue + (1.0 - led.blue_share) * phosphor(nm) / in_phosphor
                })
            }
        }
    }
}

/// What the light of a white LED is cut to, nm, and the even steps of its table.
const LED_RANGE_NM: [f64; 2] = [380.0, 780.0];
const LED_STEPS: usize = 800;

/// Ratios that a wider one is divided into: of 0.3 % at most.
const RATIOS: usize = 4000;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::testing::numbers;
    use crate::optics::{chromaticity, xyz_of_watt};

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
    fn the_blue_of_an_led_has_its_share_though_the_phosphor_reaches_out_of_the_table() {
        // Half of the phosphor's Gaussian lies above 780 nm.
        let led = WhiteLed { phosphor_nm: 780.0, blue_share: 0.22, ..WhiteLed::default() };
        let sampler = Spectrum::WhiteLed(led).sampler().unwrap();
        let blue = (0..4000).filter(|i| sampler.sample((*i as f64 + 0.5) / 4000.0) < 560.0).count();
        assert!((blue as f64 / 4000.0 - 0.22).abs() < 1e-3, "{blue}");
        for wrong in [WhiteLed { phosphor_nm: 800.0, ..led }, WhiteLed { blue_width_nm: 0.5, ..led }] {
            assert!(Spectrum::WhiteLed(wrong).sampler().is_err());
        }
    }

    #[test]
    fn a_watt_of_green_is_683_lumens() {
        let green = Spectrum::line(555.0).sampler().unwrap();
        assert_eq!(green.efficacy(), 683.0);
        assert_eq!((green.sample(0.0), green.sample(0.999)), (555.0, 555.0));
        assert_eq!(xyz_of_watt(300.0), [0.0; 3]);
        assert_eq!(Spectrum::line(555.0).single_line(), Some(555.0));
    }

    /// A laser of 0.05 nm has its lumens wherever it lies between the steps of a nanometre, and however dark the table is beside it.
    #[test]
    fn the_eye_sees_a_narrow_peak_of_a_wide_table() {
        for at in [532.0, 531.93, 532.0625, 532.5] {
            let peak = [(at - 0.05, 0.0), (at, 1.0), (at + 0.05, 0.0)];
            let wide = [(400.0, 0.0)].into_iter().chain(peak).chain([(700.0, 0.0)]);
            for table in [Table::new("spectrum", wide), Table::new("spectrum", peak)] {
                let ratio = Spectrum::Table(table.unwrap()).sampler().unwrap().efficacy() / xyz_of_watt(at)[1];
                assert!((ratio - 1.0).abs() < 1e-3, "{at} nm: {ratio}");
            }
        }
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
        // Planck's law: 6.67 % of what lies between 100 nm and 1 mm comes below 400 nm, 9.46 % between that and 500 nm.
        let wide = Spectrum::BlackBody { kelvin: 5000.0, range_nm: [100.0, 1e6] }.sampler().unwrap();
        let share = |from: f64, to: f64| {
            let drawn = (0..100_000).map(|i| wide.sample((i as f64 + 0.5) / 1e5));
            drawn.filter(|nm| (from..to).contains(nm)).count() as f64 / 1e5
        };
        assert!((share(0.0, 400.0) - 0.0667).abs() < 2e-4, "{}", share(0.0, 400.0));
        assert!((share(400.0, 500.0) - 0.0946).abs() < 2e-4, "{}", share(400.0, 500.0));
        // The eye sees the same of a watt of it as of what lies in its range, by its share.
        let seen = Spectrum::BlackBody { kelvin: 5000.0, range_nm: [360.0, 830.0] }.sampler().unwrap();
        let ratio = wide.xyz()[1] / (seen.xyz()[1] * share(360.0, 830.0));
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
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

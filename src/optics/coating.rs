//! What a coated interface reflects and transmits, by angle and wavelength.

use super::error::{Error, ErrorKind, require, require_wavelength};
use super::fresnel::{self, PowerShares};
use super::refraction::cos_transmitted;
use super::table::{bracket, check_increasing};

/// By what two shares may add up to more than one: each was rounded to three digits or more.
const SUM_ROUNDING: f64 = 1e-3;

/// Range of each share.
const SHARE: &str = "from 0 to 1, as 0.95 for 95 %";
/// Limit of their sum.
const AT_MOST_ONE: &str = "at most 1 (a thousandth more is taken for rounding)";

/// How an interface divides the incident power.
///
/// ```
/// use lampyris::optics::Coating;
/// // Straight onto bare glass of index 1.5: R = ((n − 1)/(n + 1))².
/// let split = Coating::Bare.split(1.0, 1.0, 1.5, 550.0);
/// assert!((split.reflected.unpolarised() - 0.04).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Coating {
    /// A bare interface of two media: Fresnel's equations.
    #[default]
    Bare,
    /// Constant shares; the rest is absorbed. `(0, 1)` is a perfect antireflection coating, `(1, 0)` a perfect mirror,
    /// `(0, 0)` black.
    Ideal {
        /// Share reflected.
        reflectance: f64,
        /// Share transmitted.
        transmittance: f64,
    },
    /// An opaque metal of index `n + i·k`; what is not reflected is absorbed.
    Metal {
        /// Real part of the index.
        n: f64,
        /// Extinction coefficient.
        k: f64,
    },
    /// Measured or computed shares over angle and wavelength.
    Table(CoatingTable),
}

/// Shares of the incident power, by polarisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Reflected.
    pub reflected: PowerShares,
    /// Transmitted.
    pub transmitted: PowerShares,
}

impl Split {
    /// Absorbed share of unpolarised light.
    pub fn absorbed(&self) -> f64 {
        1.0 - self.reflected.unpolarised() - self.transmitted.unpolarised()
    }
}

impl Coating {
    /// Constant shares; up to a thousandth by which both are more than 1 together, as rounded figures are, is taken off the transmittance.
    ///
    /// # Errors
    /// When one is not from 0 to 1, or both are more than 1 together.
    pub fn ideal(reflectance: f64, transmittance: f64) -> Result<Self, Error> {
        let share = |x: f64| (0.0..=1.0).contains(&x);
        require("a reflectance", reflectance, share(reflectance), SHARE)?;
        require("a transmittance", transmittance, share(transmittance), SHARE)?;
        let sum = reflectance + transmittance;
        require("reflectance plus transmittance", sum, sum <= 1.0 + SUM_ROUNDING, AT_MOST_ONE)?;
        // Light must not become more.
        Ok(Self::Ideal { reflectance, transmittance: transmittance.min(1.0 - reflectance) })
    }

    /// Shares at `cos_i = |d·n|`, with the index `n1` on the side of arrival and `n2` on the other, which a metal does not ask for.
    ///
    /// Where Snell's law has no refracted ray, what would have been transmitted is reflected.
    pub fn split(&self, cos_i: f64, n1: f64, n2: f64, wavelength_nm: f64) -> Split {
        let eta = n1 / n2;
        let split = match self {
            Self::Bare => {
                let reflected = fresnel::dielectric(cos_i, eta);
                // What bare glass does not reflect it lets through, in each polarisation by itself.
                let transmitted = PowerShares { rs: 1.0 - reflected.rs, rp: 1.0 - reflected.rp };
                return Split { reflected, transmitted };
            }
            Self::Metal { n, k } => {
                return Split { reflected: fresnel::conductor(cos_i, n1, *n, *k), transmitted: PowerShares::NONE };
            }
            Self::Ideal { reflectance: r, transmittance: t } => {
                Split { reflected: PowerShares { rs: *r, rp: *r }, transmitted: PowerShares { rs: *t, rp: *t } }
            }
            Self::Table(table) => table.shares(table.angle_deg(cos_i, eta), wavelength_nm),
        };
        // A table or a pair of shares knows nothing of the angle of total reflection; energy is kept by reflecting what cannot go on.
        if cos_transmitted(cos_i, eta).is_some() {
            return split;
        }
        let (r, t) = (split.reflected, split.transmitted);
        Split { reflected: PowerShares { rs: r.rs + t.rs, rp: r.rp + t.rp }, transmitted: PowerShares::NONE }
    }

    /// Whether the shares depend on the wavelength beyond what the media's indices do.
    pub fn is_dispersive(&self) -> bool {
        matches!(self, Self::Table(t) if t.wavelengths_nm.len() > 1)
    }

    /// Whether nothing is ever transmitted, at any angle and wavelength.
    pub fn is_opaque(&self) -> bool {
        match self {
            Self::Bare => false,
            Self::Ideal { transmittance, .. } => *transmittance == 0.0,
            Self::Metal { .. } => true,
            Self::Table(t) => t.is_opaque(),
        }
    }

    /// Whether nothing is ever reflected, apart from total internal reflection.
    pub fn is_reflectionless(&self) -> bool {
        match self {
            Self::Bare | Self::Metal { .. } => false,
            Self::Ideal { reflectance, .. } => *reflectance == 0.0,
            Self::Table(t) => t.cells.iter().all(|c| c.reflected == PowerShares::NONE),
        }
    }
}

/// Shares over angle and wavelength, bilinear between the points and constant beyond them.
///
/// The angle is measured in the rarer of the two media, so that one table serves light from both sides; an opaque coating is
/// read at the angle of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatingTable {
    angles_deg: Vec<f64>,
    wavelengths_nm: Vec<f64>,
    /// `cells[i * wavelengths + j]`.
    cells: Vec<Split>,
}

impl CoatingTable {
    /// A table from cells angle by angle, in each wavelength by wavelength (nm); shares together above 1 as in [`Coating::ideal`].
    ///
    /// # Errors
    /// When an axis is empty or not strictly increasing, angles leave 0 to 90° or wavelengths 1 to 1e6 nm, there are more or fewer cells,
    /// or a share is not from 0 to 1 or two are more than 1 together.
    pub fn new(angles_deg: Vec<f64>, wavelengths_nm: Vec<f64>, mut cells: Vec<Split>) -> Result<Self, Error> {
        let what = "coating";
        if angles_deg.is_empty() || wavelengths_nm.is_empty() {
            return Err(ErrorKind::EmptyTable { what }.into());
        }
        check_increasing("angle", &angles_deg)?;
        check_increasing("wavelength", &wavelengths_nm)?;
        for &nm in &wavelengths_nm {
            require_wavelength("a wavelength", nm)?;
        }
        for &angle in &angles_deg {
            require("an angle", angle, (0.0..=90.0).contains(&angle), "from 0 to 90 degrees")?;
        }
        let expected = angles_deg.len() * wavelengths_nm.len();
        if cells.len() != expected {
            return Err(ErrorKind::WrongCount { what, found: cells.len(), expected }.into());
        }
        let columns = wavelengths_nm.len();
        for (k, c) in cells.iter_mut().enumerate() {
            for (r, t) in [(c.reflected.rs, c.transmitted.rs), (c.reflected.rp, c.transmitted.rp)] {
                require("a reflectance", r, (0.0..=1.0).contains(&r), SHARE)?;
                require("a transmittance", t, (0.0..=1.0).contains(&t), SHARE)?;
                if r + t > 1.0 + SUM_ROUNDING {
                    let [angle_deg, wavelength_nm] = [angles_deg[k / columns], wavelengths_nm[k % columns]];
                    return Err(ErrorKind::CoatingGain { angle_deg, wavelength_nm, sum: r + t }.into());
                }
            }
            // Light must not become more.
            c.transmitted.rs = c.transmitted.rs.min(1.0 - c.reflected.rs);
            c.transmitted.rp = c.transmitted.rp.min(1.0 - c.reflected.rp);
        }
        Ok(Self { angles_deg, wavelengths_nm, cells })
    }

    /// The shares at an angle of the table, which is measured in the rarer medium, and a wavelength; constant beyond the ends.
    pub fn shares(&self, angle_deg: f64, wavelength_nm: f64) -> Split {
        let (i, s) = bracket(&self.angles_deg, angle_deg);
        let (j, t) = bracket(&self.wavelengths_nm, wavelength_nm);
        let columns = self.wavelengths_nm.len();
        let mut sum = Split { reflected: PowerShares::NONE, transmitted: PowerShares::NONE };
        for (row, a) in [(i, 1.0 - s), (i + 1, s)] {
            for (column, b) in [(j, 1.0 - t), (j + 1, t)] {
                let weight = a * b;
                // At the table's ends the next cell does not exist, and its weight is zero.
                if weight > 0.0 {
                    let cell = &self.cells[row * columns + column];
                    sum.reflected.add(cell.reflected, weight);
                    sum.transmitted.add(cell.transmitted, weight);
                }
            }
        }
        sum
    }

    /// Whether no cell transmits anything.
    fn is_opaque(&self) -> bool {
        self.cells.iter().all(|c| c.transmitted == PowerShares::NONE)
    }

    /// The angle that the table is read at, degrees: in the rarer medium, 90 beyond the critical angle, that of incidence if it is opaque.
    fn angle_deg(&self, cos_i: f64, eta: f64) -> f64 {
        // Beyond the critical angle no ray is refracted: the table is read at its end, grazing in the rarer medium.
        let cos = if eta <= 1.0 || self.is_opaque() { cos_i } else { cos_transmitted(cos_i, eta).unwrap_or(0.0) };
        cos.clamp(0.0, 1.0).acos().to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn same(x: f64) -> PowerShares {
        PowerShares { rs: x, rp: x }
    }

    fn table() -> Coating {
        let cell = |r: f64, t: f64| Split { reflected: same(r), transmitted: same(t) };
        let cells = vec![cell(0.01, 0.99), cell(0.03, 0.95), cell(0.05, 0.93), cell(0.09, 0.85)];
        Coating::Table(CoatingTable::new(vec![0.0, 60.0], vec![450.0, 650.0], cells).unwrap())
    }

    #[test]
    fn bare_and_ideal_close_to_the_last_bit() {
        for i in 0..=90 {
            let cos_i = f64::from(i).to_radians().cos();
            let s = Coating::Bare.split(cos_i, 1.0, 1.5168, 550.0);
            assert_eq!(s.reflected.rs + s.transmitted.rs, 1.0);
            assert_eq!(s.reflected.rp + s.transmitted.rp, 1.0);
        }
        let half = Coating::ideal(0.3, 0.6).unwrap().split(0.7, 1.0, 1.5, 550.0);
        assert!((half.absorbed() - 0.1).abs() < 1e-15);
        assert!(Coating::ideal(0.6, 0.5).is_err() && Coating::ideal(-0.1, 0.5).is_err());
    }

    #[test]
    fn a_table_is_bilinear_and_serves_both_sides() {
        let c = table();
        let middle = c.split(30f64.to_radians().cos(), 1.0, 1.5, 550.0);
        assert!((middle.reflected.rs - 0.045).abs() < 1e-12);
        assert!((middle.transmitted.rp - 0.93).abs() < 1e-12);
        // From inside at the refracted angle the same cell answers.
        let inside = (0.5f64 / 1.5).asin();
        let back = c.split(inside.cos(), 1.5, 1.0, 550.0);
        assert!((back.reflected.rs - middle.reflected.rs).abs() < 1e-12);
        // Beyond the last angle the table is constant.
        assert_eq!(c.split(0.0, 1.0, 1.5, 450.0).reflected.rs, 0.05);
    }

    #[test]
    fn what_cannot_be_transmitted_is_reflected() {
        let s = Coating::ideal(0.0, 1.0).unwrap().split(0.5, 1.5, 1.0, 550.0);
        assert_eq!((s.reflected, s.transmitted), (same(1.0), PowerShares::NONE));
        let s = table().split(0.5, 1.5, 1.0, 450.0);
        assert!((s.reflected.rs - 0.98).abs() < 1e-12 && s.transmitted == PowerShares::NONE);
        let mirror = Coating::ideal(0.95, 0.0).unwrap().split(0.5, 1.5, 1.0, 550.0);
        assert_eq!(mirror.reflected, same(0.95));
    }

    /// Vendors print shares with four digits, whose roundings add up.
    #[test]
    fn rounded_shares_lose_what_is_too_much() {
        let row = |rs: f64, ts: f64| Split {
            reflected: PowerShares { rs, rp: 0.1 },
            transmitted: PowerShares { rs: ts, rp: 0.9 },
        };
        let table = |row| CoatingTable::new(vec![0.0, 30.0], vec![500.0, 550.0], vec![row; 4]);
        let read = table(row(0.0274, 0.9727)).unwrap().shares(30.0, 500.0);
        assert!((read.transmitted.rs - 0.9726).abs() < 1e-15 && read.absorbed().abs() < 1e-15, "{read:?}");
        let mut cells = vec![row(0.5, 0.4); 4];
        cells[3] = row(0.5, 0.52);
        let e = CoatingTable::new(vec![0.0, 30.0], vec![500.0, 550.0], cells).unwrap_err().to_string();
        assert!(e.contains("at 30° and 550 nm") && e.contains("1.02"), "{e}");
        assert!(Coating::ideal(0.0274, 0.9727).is_ok() && Coating::ideal(0.03, 0.98).is_err());
    }

    #[test]
    fn tables_without_sense_are_refused() {
        let cell = Split { reflected: same(0.6), transmitted: same(0.6) };
        assert!(CoatingTable::new(vec![0.0], vec![550.0], vec![cell]).is_err());
        let e = CoatingTable::new(vec![0.0, 10.0], vec![550.0], vec![]).unwrap_err();
        assert_eq!(e.to_string(), "the coating table has 0 values where 2 belong");
        assert!(CoatingTable::new(vec![0.0, 95.0], vec![550.0], vec![]).is_err());
    }
}

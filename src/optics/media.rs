//! What light travels through: refractive index and absorption over the wavelength.

use super::dispersion::Dispersion;
use super::error::{Error, require, require_wavelength};
use super::phase::BulkScatter;
use super::table::Table;
use std::ops::RangeInclusive;

/// What light travels through.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// As reports name it.
    pub name: String,
    /// Refractive index.
    pub index: Index,
    /// Loss along the way.
    pub absorption: Absorption,
    /// Scattering along the way.
    pub scatter: Option<BulkScatter>,
}

impl Medium {
    /// A medium of that index that neither absorbs nor scatters.
    pub fn clear(name: impl Into<String>, index: Index) -> Self {
        Self { name: name.into(), index, absorption: Absorption::None, scatter: None }
    }

    /// Vacuum, and air where its index of 1.00028 does not matter.
    pub fn vacuum() -> Self {
        Self::clear("vacuum", Index::Constant(1.0))
    }
}

/// Refractive index over the vacuum wavelength.
///
/// The formulas take λ in µm inside, as their sources print the coefficients.
///
/// ```
/// use lampyris::optics::Index;
/// // Cauchy: n = a + b/λ², λ in µm.
/// assert!((Index::Cauchy(vec![1.5, 0.005]).value(500.0) - 1.52).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Index {
    /// The same at every wavelength.
    Constant(f64),
    /// `n² = 1 + Σ B λ²/(λ² − C)` with pairs `[B, C]`, C in µm² (already squared). Also the one-term form that
    /// Sultanova et al. (Acta Phys. Pol. A 116, 585, 2009) fit to plastics.
    Sellmeier(Vec<[f64; 2]>),
    /// `n = A + B/λ² + C/λ⁴ + …`.
    Cauchy(Vec<f64>),
    /// `n² = A₀ + A₁λ² + A₂λ⁻² + A₃λ⁻⁴ + A₄λ⁻⁶ + A₅λ⁻⁸`: the form of Schott's catalogues before 1992.
    Schott([f64; 6]),
    /// A sum of powers and poles, as further formulas of glass catalogues are.
    Sum(Dispersion),
    /// Points over the wavelength in nm, linear between them.
    Table(Table),
}

impl Index {
    /// Indices at vacuum wavelengths in nm: linear between them, constant beyond the ends.
    ///
    /// # Errors
    /// When there are none, the wavelengths do not increase strictly or are not from 1 to 1e6 nm, or an index is not finite.
    pub fn table(points: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, Error> {
        spectral_table("index", points).map(Self::Table)
    }

    /// The index at a vacuum wavelength.
    ///
    /// NaN where a formula has no real value, far outside the range it was fitted to; see [`Index::checked`].
    pub fn value(&self, wavelength_nm: f64) -> f64 {
        let um = wavelength_nm * 1e-3;
        let l2 = um * um;
        match self {
            Self::Constant(n) => *n,
            Self::Sellmeier(terms) => terms.iter().fold(1.0, |n2, [b, c]| n2 + b * l2 / (l2 - c)).sqrt(),
            // By Horner's rule from the last term, in powers of 1/λ².
            Self::Cauchy(terms) => terms.iter().rev().fold(0.0, |n, a| n / l2 + a),
            Self::Schott([a0, a1, rest @ ..]) => {
                (a0 + a1 * l2 + rest.iter().rev().fold(0.0, |n, a| (n + a) / l2)).sqrt()
            }
            Self::Sum(dispersion) => dispersion.value(um),
            Self::Table(table) => table.value(wavelength_nm),
        }
    }

    /// Whether the index depends on the wavelength, by its coefficients or points.
    pub fn is_dispersive(&self) -> bool {
        match self {
            Self::Constant(_) => false,
            Self::Sellmeier(terms) => terms.iter().any(|t| t[0] != 0.0),
            Self::Cauchy(terms) => terms.iter().skip(1).any(|&a| a != 0.0),
            Self::Schott([_, rest @ ..]) => rest.iter().any(|&a| a != 0.0),
            Self::Sum(dispersion) => dispersion.is_dispersive(),
            Self::Table(table) => !table.is_constant(),
        }
    }

    /// Indices of media that light is traced through.
    pub const RANGE: RangeInclusive<f64> = 0.1..=10.0;

    /// Returns the same index.
    ///
    /// # Errors
    /// When it is not between 0.1 and 10 at one of the vacuum wavelengths, NaN included; without wavelengths it is never refused.
    pub fn checked(self, wavelengths_nm: &[f64]) -> Result<Self, Error> {
        for &nm in wavelengths_nm {
            let n = self.value(nm);
            require(
                "a refractive index",
                n,
                Self::RANGE.contains(&n),
                "between 0.1 and 10 at every wavelength in use",
            )?;
        }
        Ok(self)
    }

    /// The Abbe number `(n_d − 1)/(n_F − n_C)`; infinite without dispersion.
    pub fn abbe_number(&self) -> f64 {
        (self.value(line::D) - 1.0) / (self.value(line::F) - self.value(line::C))
    }
}

/// Makes a table over the wavelength in nm; refuses what [`Table::new`] does, and wavelengths that light does not have in nm.
fn spectral_table(what: &'static str, points: impl IntoIterator<Item = (f64, f64)>) -> Result<Table, Error> {
    let table = Table::new(what, points)?;
    for nm in table.range() {
        require_wavelength("a wavelength", nm)?;
    }
    Ok(table)
}

/// Vacuum wavelengths of spectral lines, nm.
pub mod line {
    /// Hydrogen, blue.
    pub const F: f64 = 486.1327;
    /// Mercury, green.
    pub const E: f64 = 546.074;
    /// Helium, yellow.
    pub const D: f64 = 587.5618;
    /// Helium–neon laser.
    pub const HE_NE: f64 = 632.8;
    /// Hydrogen, red.
    pub const C: f64 = 656.2725;
}

/// Loss of power along the way, by Beer and Lambert's law.
///
/// ```
/// use lampyris::optics::Absorption;
/// // Beer and Lambert: what halves the light in 1 mm leaves an eighth of it in 3 mm.
/// let dye = Absorption::per_mm(std::f64::consts::LN_2)?;
/// assert!((dye.transmittance(3.0, 550.0) - 0.125).abs() < 1e-15);
/// # Ok::<(), lampyris::optics::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Absorption {
    /// None.
    #[default]
    None,
    /// Napierian coefficient, per mm.
    Constant(f64),
    /// Napierian coefficient per mm over the wavelength in nm.
    Table(Table),
}

impl Absorption {
    /// A constant Napierian coefficient, per mm.
    ///
    /// # Errors
    /// When it is negative or not finite.
    pub fn per_mm(coefficient: f64) -> Result<Self, Error> {
        Ok(Self::Constant(require("an absorption coefficient", coefficient, coefficient >= 0.0, "zero or more")?))
    }

    /// Napierian coefficients per mm at wavelengths in nm: linear between them, constant beyond the ends.
    ///
    /// # Errors
    /// When there are none, the wavelengths do not increase strictly or are not from 1 to 1e6 nm, a number is not finite, or a coefficient
    /// is negative.
    pub fn table(points: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, Error> {
        let table = spectral_table("absorption", points)?;
        let [low, _] = table.extremes();
        require("an absorption coefficient", low, low >= 0.0, "zero or more")?;
        Ok(Self::Table(table))
    }

    /// Coefficients from internal transmittances at wavelengths in nm over a sample of `thickness_mm`, as glass sheets give them.
    ///
    /// # Errors
    /// When the thickness is not positive, a transmittance not above 0 and at most 1, or wavelengths do not ascend.
    pub fn from_transmittance(
        thickness_mm: f64,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Result<Self, Error> {
        require("a thickness", thickness_mm, thickness_mm > 0.0, "positive")?;
        let rows = points.into_iter().map(|(nm, t)| {
            require("an internal transmittance", t, t > 0.0 && t <= 1.0, "above 0 and at most 1")?;
            // The law of Beer and Lambert, solved for its coefficient.
            Ok((nm, -t.ln() / thickness_mm))
        });
        Self::table(rows.collect::<Result<Vec<_>, Error>>()?)
    }

    /// The Napierian coefficient at a vacuum wavelength, per mm; beyond a table that of its nearer end.
    pub fn coefficient(&self, wavelength_nm: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Constant(a) => *a,
            Self::Table(table) => table.value(wavelength_nm),
        }
    }

    /// Share of power left after a way of `length` mm at a vacuum wavelength.
    pub fn transmittance(&self, length: f64, wavelength_nm: f64) -> f64 {
        match self {
            Self::None => 1.0,
            _ => (-self.coefficient(wavelength_nm) * length).exp(),
        }
    }

    /// Whether nothing is absorbed at any wavelength.
    pub fn is_none(&self) -> bool {
        match self {
            Self::None => true,
            Self::Constant(a) => *a == 0.0,
            Self::Table(table) => table.extremes()[1] == 0.0,
        }
    }

    /// Whether the loss depends on the wavelength.
    pub fn is_dispersive(&self) -> bool {
        matches!(self, Self::Table(table) if !table.is_constant())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_agree_with_hand_evaluation() {
        // λ = 0.5 µm, λ² = 0.25.
        assert!((Index::Cauchy(vec![1.5, 0.004, 0.0001]).value(500.0) - (1.5 + 0.016 + 0.0016)).abs() < 1e-15);
        let schott = Index::Schott([2.25, -0.01, 0.01, 0.001, 0.0001, 0.00001]);
        let n2 = 2.25 - 0.0025 + 0.04 + 0.016 + 0.0064 + 0.00256;
        assert!((schott.value(500.0) - f64::sqrt(n2)).abs() < 1e-15);
        assert!(
            (Index::Sellmeier(vec![[1.25, 0.05]]).value(500.0) - f64::sqrt(1.0 + 1.25 * 0.25 / 0.2)).abs() < 1e-15
        );
        assert!(schott.is_dispersive() && !Index::Cauchy(vec![1.5, 0.0]).is_dispersive());
        assert_eq!(Index::Constant(1.5).abbe_number(), f64::INFINITY);
    }

    #[test]
    fn schott_n_bk7_of_the_old_catalogue_agrees_with_sellmeier() {
        // Constants of BK7 in Schott's power series, catalogue of 1980; n_d = 1.51680, n_F = 1.52238, n_C = 1.51432.
        let old =
            Index::Schott([2.2718929, -1.0108077e-2, 1.0592509e-2, 2.0816965e-4, -7.6472538e-6, 4.9240991e-7]);
        for (nm, n) in [(line::D, 1.51680), (line::F, 1.52238), (line::C, 1.51432)] {
            assert!((old.value(nm) - n).abs() < 1e-5, "{nm}: {}", old.value(nm));
        }
    }

    #[test]
    fn beer_and_lambert() {
        // 0.1 per cm over 3 cm.
        let a = Absorption::per_mm(0.01).unwrap();
        assert!((a.transmittance(30.0, 550.0) - 0.740818).abs() < 1e-6);
        assert!((a.transmittance(10.0, 550.0) * a.transmittance(20.0, 550.0) - (-0.3f64).exp()).abs() < 1e-15);
        assert_eq!(Absorption::None.transmittance(1e9, 550.0), 1.0);
        let glass = Absorption::from_transmittance(25.0, [(400.0, 0.992), (500.0, 0.994)]).unwrap();
        assert!((glass.transmittance(25.0, 400.0) - 0.992).abs() < 1e-15);
        assert!((glass.transmittance(50.0, 500.0) - 0.994 * 0.994).abs() < 1e-15);
        assert!(glass.is_dispersive() && !a.is_dispersive());
    }

    #[test]
    fn nonsense_is_refused_with_a_reason() {
        assert!(Absorption::per_mm(-1.0).is_err());
        let e = Absorption::from_transmittance(10.0, [(400.0, 1.2)]).unwrap_err();
        assert!(e.to_string().contains("internal transmittance is 1.2"), "{e}");
        assert!(Index::Sellmeier(vec![[1.2, 0.3]]).checked(&[450.0]).is_err());
    }
}

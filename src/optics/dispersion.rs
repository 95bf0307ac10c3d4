//! Dispersion formulas of glass catalogues as sums of powers and poles in the wavelength.
//!
//! What OpticStudio numbers 3 to 13 are such sums for n or n²: those of Herzberger, Conrady, the Handbook of Optics, and the extended ones.

/// A sum of terms in the vacuum wavelength λ, µm, that is n or n².
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dispersion {
    /// Whether the sum is n² and not n.
    pub is_square: bool,
    /// `c λ^(h/2)` as `[c, h]`: exponents are whole or half numbers.
    pub powers: Vec<(f64, i32)>,
    /// Terms with a pole.
    pub poles: Vec<Pole>,
}

/// The term `B λ^p / (λ² − C)^q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// B.
    pub strength: f64,
    /// p.
    pub power: i32,
    /// C, µm².
    pub at: f64,
    /// q.
    pub order: i32,
}

impl Dispersion {
    /// Returns the index at a vacuum wavelength, µm; NaN where n² is negative, far outside the range that the formula was fitted to.
    ///
    /// ```
    /// use lampyris::optics::Dispersion;
    /// // Conrady: n = 1.5 + 0.01/λ + 0.0005/λ^3.5, at 1 µm.
    /// let conrady = Dispersion { powers: vec![(1.5, 0), (0.01, -2), (0.0005, -7)], ..Dispersion::default() };
    /// assert!((conrady.value(1.0) - 1.5105).abs() < 1e-15);
    /// ```
    pub fn value(&self, um: f64) -> f64 {
        let power = |halves: i32| um.powi(halves.div_euclid(2)) * if halves % 2 == 0 { 1.0 } else { um.sqrt() };
        let of_powers: f64 = self.powers.iter().map(|(c, halves)| c * power(*halves)).sum();
        let of_poles: f64 =
            self.poles.iter().map(|p| p.strength * um.powi(p.power) / (um * um - p.at).powi(p.order)).sum();
        let sum = of_powers + of_poles;
        if self.is_square { sum.sqrt() } else { sum }
    }

    /// Whether the index depends on the wavelength, by its coefficients.
    pub fn is_dispersive(&self) -> bool {
        self.powers.iter().any(|(c, halves)| *c != 0.0 && *halves != 0)
            || self.poles.iter().any(|p| p.strength != 0.0)
    }
}

//! Why optical data was refused.

use crate::math::units::WAVELENGTHS_NM;
use crate::text::typed_number;
use thiserror::Error;

/// Why optical data was refused; the message says what is wrong and what to give instead.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{kind}")]
pub struct Error {
    kind: ErrorKind,
}

/// The kinds of refusal.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A table without rows.
    #[error("the {what} table is empty; give at least one row")]
    EmptyTable {
        /// What the table holds.
        what: &'static str,
    },
    /// Rows out of order.
    #[error(
        "row {row} of the {what} table does not come after the one before it; sort by the first column and remove duplicates"
    )]
    NotIncreasing {
        /// What the table holds.
        what: &'static str,
        /// Counted from 1.
        row: usize,
    },
    /// Columns of different length.
    #[error("the {what} table has {found} values where {expected} belong")]
    WrongCount {
        /// What the table holds.
        what: &'static str,
        /// Values given.
        found: usize,
        /// Values needed.
        expected: usize,
    },
    /// A number that means nothing.
    #[error("{what} is {}, but must be {allowed}", typed(.value))]
    OutOfRange {
        /// What the number is.
        what: &'static str,
        /// As given.
        value: f64,
        /// What would be accepted.
        allowed: &'static str,
    },
    /// A cell of a coating's table that gives more light than comes.
    #[error(
        "reflectance plus transmittance of the coating is {sum} at {angle_deg}° and {wavelength_nm} nm, but must be at most 1 (a thousandth \
         more is taken for rounding)"
    )]
    CoatingGain {
        /// Angle of the cell, degrees.
        angle_deg: f64,
        /// Wavelength of the cell, nm.
        wavelength_nm: f64,
        /// Both shares together.
        sum: f64,
    },
    /// A spectrum or lobe that carries no power.
    #[error("{what} carries no power; give at least one positive value")]
    NoPower {
        /// What it is.
        what: &'static str,
    },
}

impl Error {
    /// The kind of refusal.
    pub fn kind(&self) -> &ErrorKind {
        &self.kind
    }
}

impl From<ErrorKind> for Error {
    fn from(kind: ErrorKind) -> Self {
        Self { kind }
    }
}

/// Writes a number as it is typed.
fn typed(value: &f64) -> String {
    typed_number(*value)
}

/// Returns `value` when it is `good` and finite, else the refusal that names it and what is `allowed`.
pub(super) fn require(what: &'static str, value: f64, good: bool, allowed: &'static str) -> Result<f64, Error> {
    if good && value.is_finite() { Ok(value) } else { Err(ErrorKind::OutOfRange { what, value, allowed }.into()) }
}

/// Refuses what is no wavelength of light in nm.
pub(super) fn require_wavelength(what: &'static str, nm: f64) -> Result<f64, Error> {
    require(what, nm, WAVELENGTHS_NM.contains(&nm), "from 1 to 1e6 nm; 0.55 µm are 550 nm")
}

//! The key `spectrum` of a source.

use super::PowerUnit;
use crate::optics::{ErrorKind, Spectrum, Table, Wavelengths, WhiteLed};
use crate::simulate::wavelength_text::wavelength_range_text;
use crate::text::typed_number;
use serde::{Deserialize, Serialize};

/// The spectrum of a source: `{ kind = … }` with the keys of that kind.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SpectrumKey {
    /// Which spectrum.
    pub kind: SpectrumName,
    /// Pairs `[nm, relative power]` of lines, or `[nm, relative power per nm]` of a table.
    pub values: Option<Vec<[f64; 2]>>,
    /// Temperature of a black body.
    pub kelvin: Option<f64>,
    /// Wavelengths a black body is cut to, nm; 360 to 830 unless said otherwise.
    pub range_nm: Option<[f64; 2]>,
    /// Share of a white LED's power in the blue peak; 0.22 unless said otherwise.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 1)))]
    pub blue_share: Option<f64>,
    /// Peak of a white LED's phosphor, nm; 570 unless said otherwise.
    #[cfg_attr(feature = "schema", schemars(range(min = 380, max = 780)))]
    pub phosphor_nm: Option<f64>,
}

/// The spectra there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SpectrumName {
    /// Separate lines, in `values`.
    #[default]
    Lines,
    /// A table, in `values`.
    Table,
    /// Planck's law at `kelvin`.
    BlackBody,
    /// The CIE's daylight.
    D65,
    /// A blue chip with a yellow phosphor.
    WhiteLed,
}

impl SpectrumKey {
    /// Returns the spectrum in the form that the laws of light read.
    ///
    /// # Errors
    /// When a key is missing or belongs to another kind, or its values are no spectrum.
    pub(crate) fn optics(&self) -> Result<Spectrum, String> {
        let values = || self.values.clone().ok_or("this spectrum needs `values`, pairs of nm and power");
        let allowed: &[&str] = match self.kind {
            SpectrumName::Lines | SpectrumName::Table => &["values"],
            SpectrumName::BlackBody => &["kelvin", "range_nm"],
            SpectrumName::D65 => &[],
            SpectrumName::WhiteLed => &["blue_share", "phosphor_nm"],
        };
        for (key, given) in [
            ("values", self.values.is_some()),
            ("kelvin", self.kelvin.is_some()),
            ("range_nm", self.range_nm.is_some()),
            ("blue_share", self.blue_share.is_some()),
            ("phosphor_nm", self.phosphor_nm.is_some()),
        ] {
            // A key of another kind is a slip, and to ignore it would trace another spectrum than the one meant.
            if given && !allowed.contains(&key) {
                return Err(format!("`{key}` does not belong to this kind of spectrum"));
            }
        }
        let spectrum = match self.kind {
            SpectrumName::Lines => Spectrum::Lines(values()?),
            SpectrumName::Table => {
                let values = values()?;
                if values.len() == 1 {
                    return Err("a table of one wavelength has no width: give two, or `kind = \"lines\"`".into());
                }
                let points = values.into_iter().map(|[nm, p]| (nm, p));
                Spectrum::Table(Table::new("spectrum", points).map_err(|e| e.to_string())?)
            }
            SpectrumName::BlackBody => Spectrum::BlackBody {
                kelvin: self.kelvin.ok_or("a black body needs `kelvin`")?,
                range_nm: self.range_nm.unwrap_or([360.0, 830.0]),
            },
            SpectrumName::D65 => Spectrum::D65,
            SpectrumName::WhiteLed => {
                let unset = WhiteLed::default();
                Spectrum::WhiteLed(WhiteLed {
                    blue_share: self.blue_share.unwrap_or(unset.blue_share),
                    phosphor_nm: self.phosphor_nm.unwrap_or(unset.phosphor_nm),
                    ..unset
                })
            }
        };
        // Made once and thrown away: what cannot be sampled is refused where it is written.
        let Err(fault) = spectrum.sampler() else { return Ok(spectrum) };
        Err(match (&spectrum, fault.kind()) {
            (Spectrum::BlackBody { kelvin, range_nm }, ErrorKind::NoPower { .. }) => {
                let range = wavelength_range_text(*range_nm);
                let kelvin = typed_number(*kelvin);
                format!("a black body of {kelvin} K has no light in {range}: give another `kelvin` or `range_nm`")
            }
            _ => fault.to_string(),
        })
    }

    /// Returns what wavelengths are drawn from: the watts of the spectrum, or its lumens where the run counts these.
    ///
    /// # Errors
    /// When the spectrum is wrong, or has no lumens that a run could count.
    pub(crate) fn wavelengths(&self, unit: PowerUnit) -> Result<Wavelengths, String> {
        let watts = self.optics()?.sampler().map_err(|e| e.to_string())?;
        match unit {
            PowerUnit::Watt => Ok(watts),
            PowerUnit::Lumen => watts
                .photometric()
                .map_err(|_| "this run counts lumens, and the eye sees nothing of this spectrum".into()),
        }
    }
}

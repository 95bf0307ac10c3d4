//! How the powers of a measured list become powers in the unit of the run.

use crate::formats::RayFile;
use crate::optics::{Spectrum, Table, Wavelengths};
use crate::simulate::scene::{PowerUnit, Source};
use crate::simulate::wavelength_text::wavelength_range_text;

/// What there is to do about a file whose powers can be taken as proportions, because all its light has one spectrum.
pub(super) const GIVE_POWER: &str =
    "give the source's `power` in watts, for the file's powers to be proportions alone";

/// What makes power in the unit of a run of the power that a file gives.
#[derive(Clone, Copy, Debug)]
pub(super) enum Conversion {
    /// One factor for all rays.
    Factor(f64),
    /// Lumens of watts, by what the eye sees at each ray's own wavelength.
    LumensOfEachRay,
    /// Watts of lumens, likewise.
    WattsOfEachRay,
}

/// What is wrong with a ray file, and what to do about it.
pub(super) struct Fault {
    pub(super) message: String,
    pub(super) help: String,
}

impl Fault {
    pub(super) fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { message: message.into(), help: help.into() }
    }
}

/// Returns the spectrum that a file gives for all its rays, by its watts; `None` where it gives none.
///
/// # Errors
/// When its rows are no spectrum.
pub(super) fn file_spectrum(file: &RayFile) -> Result<Option<Wavelengths>, Fault> {
    let Some(pairs) = &file.spectrum else { return Ok(None) };
    let spectrum = match pairs[..] {
        [[nm, _]] => Ok(Spectrum::line(nm)),
        _ => Table::new("the spectrum of this file", pairs.iter().map(|p| (p[0], p[1]))).map(Spectrum::Table),
    };
    let sampler = spectrum.and_then(|s| s.sampler());
    sampler.map(Some).map_err(|e| Fault::new(e.to_string(), "give the source a `spectrum` and mend the file's"))
}

/// Returns what makes lumens of a file's watts, or watts of its lumens, whichever `unit` is: the lumens to a watt of the scene's spectrum,
/// else of the file's, else of each ray's own wavelength, and a note that says so; `None` where the powers are proportions alone, as the
/// scene gives the source's power, and there are no wavelengths, or the eye sees nothing of the spectrum of all rays.
///
/// # Errors
/// When nothing can be converted, and the scene does not give such a power.
pub(super) fn conversion(
    file: &RayFile,
    table: Option<&Wavelengths>,
    source: &Source,
    unit: PowerUnit,
) -> Result<Option<(Conversion, String)>, Fault> {
    let [from, to, other] = match unit {
        PowerUnit::Lumen => ["watts", "lumens", "W"],
        PowerUnit::Watt => ["lumens", "watts", "lm"],
    };
    let of_scene = source.spectrum.as_ref().and_then(|key| key.optics().ok()?.sampler().ok());
    if let Some(spectrum) = of_scene.as_ref().or(table) {
        let lumens = spectrum.xyz()[1];
        let whose = if of_scene.is_some() { "the scene's" } else { "the file's" };
        if unit == PowerUnit::Watt && lumens == 0.0 {
            // One spectrum for all leaves the proportions as they are.
            let fault = unseen_lumens(&format!("{whose} spectrum"), spectrum.range_nm(), GIVE_POWER);
            return if source.power.is_some() { Ok(None) } else { Err(fault) };
        }
        let factor = if unit == PowerUnit::Lumen { lumens } else { 1.0 / lumens };
        let note = format!("its {from} were made {to} by {whose} spectrum, {lumens:.4} lm/W");
        return Ok(Some((Conversion::Factor(factor), note)));
    }
    if file.spectral_rays() == file.len() {
        let conversion = match unit {
            PowerUnit::Lumen => Conversion::LumensOfEachRay,
            PowerUnit::Watt => Conversion::WattsOfEachRay,
        };
        return Ok(Some((conversion, format!("its {from} were made {to}, each ray by its wavelength"))));
    }
    // The brightness of a watt of this light is unknown; the scene's own power makes that a matter of proportion.
    if source.power.is_some() {
        return Ok(None);
    }
    Err(Fault::new(
        format!("this file gives {from} and no wavelengths, but the run counts {to}"),
        format!("set `unit = \"{other}\"` in [run], or give the source's `spectrum`, or its `power` in {to}"),
    ))
}

/// Returns the clause that the eye sees nothing of some light, called `what`, of wavelengths from the first to the second, nm.
pub(super) fn unseen_light(what: &str, range_nm: [f64; 2]) -> String {
    format!("the eye sees nothing of {what}, {}", wavelength_range_text(range_nm))
}

/// Returns why lumens of some light that the eye sees nothing of, as [`unseen_light`] names it, are refused where watts are counted.
/// `way_out` is what there is to do besides counting lumens.
pub(super) fn unseen_lumens(what: &str, range_nm: [f64; 2], way_out: &str) -> Fault {
    Fault::new(
        format!("this file gives lumens, of which no watts can be made: {}", unseen_light(what, range_nm)),
        format!("{way_out}, or set `unit = \"lm\"` in [run]"),
    )
}

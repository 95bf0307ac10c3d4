//! Measured rays as a source draws them, in the unit that the run counts.

use crate::formats::{Flux, LightRay, RaySet};
use crate::optics::{Spectrum, Table, Wavelengths, xyz_of_watt};
use crate::simulate::scene::{PowerUnit, Source};

/// Measured rays, to be drawn in proportion to their power; at least one, and one with power.
#[derive(Clone, Debug)]
pub(crate) struct RayList {
    pub(crate) rays: Vec<LightRay>,
    /// Spectrum that the file gives for all its rays, in the unit of the run; no ray has a wavelength of its own then.
    pub(crate) spectrum: Option<Wavelengths>,
    /// What the reader changed or supposed, for people.
    pub(crate) notes: Vec<String>,
    /// Power up to and including each ray.
    sums: Vec<f64>,
}

/// What is wrong with a ray file, and what to do about it.
pub(super) struct Fault {
    pub(super) message: String,
    pub(super) help: String,
}

impl Fault {
    fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { message: message.into(), help: help.into() }
    }
}

impl RayList {
    /// Makes the rays of a file the source of a run that counts in `unit`.
    ///
    /// Watts become lumens where the file or the scene gives wavelengths; a note says so.
    ///
    /// # Errors
    /// When the unit cannot be converted and the scene does not give the source's power (with it, the file's powers are relative), when the
    /// eye sees nothing of the file's spectrum, or when the powers add up to 0 or to no finite number.
    pub(super) fn new(mut set: RaySet, source: &Source, unit: PowerUnit) -> Result<Self, Fault> {
        let mut notes = std::mem::take(&mut set.notes);
        let table = file_spectrum(&set)?;
        match (set.flux, unit) {
            (Some(Flux::Radiant), PowerUnit::Lumen) => notes.extend(to_lumens(&mut set, table.as_ref(), source)?),
            // Relative powers will do where the scene says how much the source emits.
            (Some(Flux::Luminous), PowerUnit::Watt) if source.power.is_none() => {
                return Err(Fault::new(
                    "this file gives lumens, but the run counts watts",
                    "set `unit = \"lm\"` in [run], or give the source's `power` in watts",
                ));
            }
            _ => {}
        }
        let spectrum = match unit {
            PowerUnit::Watt => table,
            PowerUnit::Lumen => table.map(|t| t.photometric()).transpose().map_err(|_| {
                let message = "this run counts lumens, and the eye sees nothing of the spectrum of this file";
                Fault::new(message, "set `unit = \"W\"` in [run]")
            })?,
        };
        let mut sum = 0.0;
        let add = |r: &LightRay| {
            sum += r.power;
            sum
        };
        let sums: Vec<f64> = set.rays.iter().map(add).collect();
        if !sum.is_finite() {
            let message = "the powers of this list add up to no finite number";
            return Err(Fault::new(message, "give powers in the unit of the run"));
        }
        if sum <= 0.0 {
            return Err(Fault::new("the rays of this list carry no power", "give another file"));
        }
        Ok(Self { rays: set.rays, spectrum, notes, sums })
    }

    pub(crate) fn power(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// Returns the ray at which the running sum of powers passes `share`, from 0 to 1, of the whole.
    pub(crate) fn ray_at_share(&self, share: f64) -> &LightRay {
        // The running sum is searched: each ray is drawn in proportion to its power.
        let at = share * self.power();
        &self.rays[self.sums.partition_point(|s| *s <= at).min(self.rays.len() - 1)]
    }

    /// Returns the wavelengths, nm, that single rays have of their own, ascending and each once; empty where none has.
    pub(crate) fn own_wavelengths(&self) -> Vec<f64> {
        let mut all: Vec<f64> = self.rays.iter().filter_map(|r| r.wavelength_nm).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

/// Returns the spectrum that a file gives for all its rays, by its watts; `None` where it gives none.
///
/// # Errors
/// When its rows are no spectrum.
fn file_spectrum(set: &RaySet) -> Result<Option<Wavelengths>, Fault> {
    let Some(pairs) = &set.spectrum else { return Ok(None) };
    let spectrum = match pairs[..] {
        [[nm, _]] => Ok(Spectrum::line(nm)),
        _ => Table::new("the spectrum of this file", pairs.iter().map(|p| (p[0], p[1]))).map(Spectrum::Table),
    };
    let sampler = spectrum.and_then(|s| s.sampler());
    sampler.map(Some).map_err(|e| Fault::new(e.to_string(), "give the source a `spectrum` and mend the file's"))
}

/// Multiplies the powers in `set` by lm/W: of the scene's spectrum, else the file's, else each ray's own wavelength. Returns a note of what
/// was done; `None`, and powers unchanged, where there are no wavelengths but the scene gives the source's power.
///
/// # Errors
/// When there are neither wavelengths nor such a power.
fn to_lumens(set: &mut RaySet, table: Option<&Wavelengths>, source: &Source) -> Result<Option<String>, Fault> {
    let of_scene = source.spectrum.as_ref().and_then(|key| key.optics().ok()?.sampler().ok());
    if let Some(spectrum) = of_scene.as_ref().or(table) {
        let efficacy = spectrum.xyz()[1];
        set.rays.iter_mut().for_each(|r| r.power *= efficacy);
        let whose = if of_scene.is_some() { "the scene's" } else { "the file's" };
        return Ok(Some(format!("its watts were made lumens by {whose} spectrum, {efficacy:.4} lm/W")));
    }
    if set.rays.iter().all(|r| r.wavelength_nm.is_some()) {
        for ray in &mut set.rays {
            ray.power *= ray.wavelength_nm.map_or(0.0, |nm| xyz_of_watt(nm)[1]);
        }
        return Ok(Some("its watts were made lumens, each ray by its wavelength".into()));
    }
    // Nothing tells how bright the light of a watt is; the scene's own power makes that a matter of proportion.
    if source.power.is_some() {
        return Ok(None);
    }
    Err(Fault::new(
        "this file gives watts and no wavelengths, but the run counts lumens",
        "set `unit = \"W\"` in [run], or give the source's `spectrum`, or its `power` in lumens",
    ))
}

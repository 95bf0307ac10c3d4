//! Ray sets of measured light sources, as vendors publish them: IES TM-25 (read and written), Zemax binary and LightTools binary (read).
//!
//! A file is recognised by its first bytes, never by its name, for `.ray` and `.dat` mean a dozen things. Rays come in the unit of flux
//! that the caller counts in where the file holds both. Where the header's total disagrees with the sum of the rays, as it does in files
//! whose rays carry relative weights, the rays are scaled to the header's total and a note says so.
//!
//! Guarantee: a TM-25 file that is read and written again has the same bytes, unknown header values included, but for what a note names
//! and what stands behind the end of a text.
//! Known weakness: Stokes columns and tristimulus columns are kept by [`Tm25`] but not traced.

mod bytes;
mod lighttools;
mod tm25;
mod tm25_header;
mod zemax;

pub use tm25::{Tm25, Tm25Reader, read_tm25, write_tm25};
pub use tm25_header::{SpectralData, Tm25Columns, Tm25Header};

use super::input::open_file;
use super::{Error, ErrorKind, LightRay};
use std::io::Read;
use std::path::Path;

/// The quantity that the power of a ray stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flux {
    /// Radiant flux, watts.
    Radiant,
    /// Luminous flux, lumens.
    Luminous,
}

impl std::fmt::Display for Flux {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if *self == Self::Radiant { "watts" } else { "lumens" })
    }
}

/// The rays of a measured source.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// Origin in mm, unit direction, power in the unit of `flux`, wavelength where the file gives one for the ray.
    pub rays: Vec<LightRay>,
    /// What the powers stand for; `None` where the file does not say (CSV and NPZ).
    pub flux: Option<Flux>,
    /// Pairs of nm and relative radiant power per nm that hold for all rays, where the file gives such a table.
    pub spectrum: Option<Vec<[f64; 2]>>,
    /// What the reader changed or supposed, for people.
    pub notes: Vec<String>,
}

/// Disagreement of header and rays that single precision explains, relative: rays of f32 added up by their writer in f32.
const TOTAL_ROUNDING: f64 = 1e-4;

impl RaySet {
    /// Scales the rays to the total flux that a header states, and adds a note, where they differ by more than rounding; does nothing where
    /// it states none, no positive one, or the rays are dark.
    fn scale_to(&mut self, stated: Option<f64>) {
        let sum: f64 = self.rays.iter().map(|r| r.power).sum();
        let Some(stated) = stated.filter(|s| *s > 0.0) else { return };
        // Dark sets cannot be scaled, and differences of rounding should not be.
        if sum <= 0.0 || (sum / stated - 1.0).abs() <= TOTAL_ROUNDING {
            return;
        }
        for ray in &mut self.rays {
            ray.power *= stated / sum;
        }
        let unit = self.flux.unwrap_or(Flux::Radiant);
        self.notes.push(format!(
            "the header states {stated} {unit} but the rays add up to {sum}: they were scaled to the header"
        ));
    }
}

/// Reads the rays of a file in any format there is: TM-25, Zemax binary and LightTools binary by their first bytes, else a list as
/// [`read_rays`](super::read_rays) knows it. `preferred` chooses the flux where the file holds both.
///
/// # Errors
/// When the file cannot be read or is not what its first bytes promise; the message names the byte or the ray.
pub fn read_ray_set(path: &Path, preferred: Flux) -> Result<RaySet, Error> {
    let mut start = [0; 4];
    let mut file = open_file(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    // A file of fewer than four bytes is none of the binary formats; the reader of lists says what it lacks.
    let binary = file.read_exact(&mut start).is_ok();
    match &start {
        b"TM25" if binary => Tm25Reader::open(path)?.into_rays(preferred),
        b"LTRF" if binary => lighttools::read(path),
        // The identifier of the other binary format is a number, not letters.
        start if binary && i32::from_le_bytes(*start) == zemax::IDENTIFIER => zemax::read(path),
        _ => {
            let rays = super::read_rays(path)?;
            Ok(RaySet { rays, flux: None, spectrum: None, notes: Vec::new() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};

    #[test]
    fn rays_with_relative_weights_take_the_flux_of_the_header() {
        let ray = |power| LightRay { origin: Point::ZERO, direction: Vector::Z, power, wavelength_nm: None };
        let mut set = RaySet {
            rays: vec![ray(1.0), ray(3.0)],
            flux: Some(Flux::Luminous),
            spectrum: None,
            notes: Vec::new(),
        };
        set.scale_to(Some(2.0));
        assert_eq!([set.rays[0].power, set.rays[1].power], [0.5, 1.5]);
        assert!(set.notes[0].contains("2 lumens") && set.notes[0].contains('4'), "{}", set.notes[0]);
        set.scale_to(None);
        set.scale_to(Some(2.0 * (1.0 + 1e-6)));
        assert_eq!(set.rays[1].power, 1.5);
        assert_eq!(set.notes.len(), 1);
    }

    #[test]
    fn files_of_other_kinds_are_read_as_lists() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "0,0,0,0,0,1,2\n").unwrap();
        let set = read_ray_set(&path, Flux::Radiant).unwrap();
        assert_eq!((set.rays.len(), set.flux), (1, None));
        std::fs::write(&path, "1").unwrap();
        assert!(read_ray_set(&path, Flux::Radiant).unwrap_err().to_string().contains("1 columns"));
    }
}

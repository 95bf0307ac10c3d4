//! Ray sets of measured light sources, as vendors publish them: IES TM-25 (read and written), Zemax binary and LightTools binary (read);
//! and lists of rays in NPZ and CSV.
//!
//! A measured set is recognised by its first bytes, never by its name, for `.ray` and `.dat` mean a dozen things; lists are recognised by
//! their extension. Rays come in the unit of flux that the caller counts in where the file holds both. Where the header's total disagrees
//! with the sum of the rays, as it does in files whose rays carry relative weights, the rays are scaled to the header's total and a note
//! says so.
//!
//! Guarantee: a TM-25 file that is read and written again has the same bytes, unknown header values included, but for what a note names
//! and what stands behind the end of a text.
//! Known weakness: Stokes columns and tristimulus columns are kept by [`Tm25`] but not traced.

mod bytes;
mod lighttools;
mod ray_collector;
mod ray_file;
mod tm25;
mod tm25_header;
mod zemax;

pub use ray_file::{Flux, RayBlock, RayFile, RaySet};
pub use tm25::{Tm25, Tm25Reader, read_tm25, write_tm25};
pub use tm25_header::{SpectralData, Tm25Columns, Tm25Header};

use super::file_names::lower_extension;
use super::input::open_file;
use super::ray_csv::read_csv;
use super::ray_npz::{OPTIONAL_OF_LIGHT, OPTIONAL_OF_PATHS, read_facets, read_npz};
use super::{Error, ErrorKind, LightRay};
use ray_collector::RayCollector;
use ray_file::MOST_IN_MEMORY;
use std::io::Read;
use std::path::Path;

impl RayFile {
    /// Opens a file of rays in any format there is: TM-25, Zemax binary and LightTools binary by their first bytes, else a list as
    /// [`read_rays`] knows it, and looks at each ray once. `preferred` chooses the flux where the file holds both.
    ///
    /// # Errors
    /// When the file cannot be read, holds no rays or is not what its first bytes promise, the message names the byte or the ray; when a
    /// long list of text or packed arrays finds no place in the folder for temporary files.
    pub fn open(path: &Path, preferred: Flux) -> Result<Self, Error> {
        Self::open_within(path, preferred, MOST_IN_MEMORY)
    }

    /// As [`RayFile::open`], with at most `most_in_memory` rays of a list in memory; further ones go to a scratch file.
    fn open_within(path: &Path, preferred: Flux, most_in_memory: u64) -> Result<Self, Error> {
        let file = Self::open_any(path, preferred, most_in_memory)?;
        if file.is_empty() {
            return Err(Error::new(path, ErrorKind::Malformed("no rays in it".into())));
        }
        Ok(file)
    }

    /// As [`RayFile::open_within`]; a file without rays is no error.
    fn open_any(path: &Path, preferred: Flux, most_in_memory: u64) -> Result<Self, Error> {
        let mut start = [0; 4];
        let mut file = open_file(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
        // A file of fewer than four bytes is none of the binary formats; the reader of lists says what it lacks.
        let binary = file.read_exact(&mut start).is_ok();
        match &start {
            b"TM25" if binary => Tm25Reader::open(path)?.into_ray_file(preferred, most_in_memory),
            b"LTRF" if binary => lighttools::read(path, most_in_memory),
            // The identifier of the other binary format is a number, not letters.
            start if binary && zemax::IDENTIFIERS.contains(&i32::from_le_bytes(*start)) => {
                zemax::read(path, most_in_memory)
            }
            start => {
                let mut head = start.to_vec();
                file.take(TEXT_HEAD).read_to_end(&mut head).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
                // Of a file shorter than the buffer, the missing bytes are not part of the file.
                if binary && !is_npz(path) {
                    refuse_bytes(path, &head)?;
                }
                refuse_text(path, &head)?;
                let mut rays = RayCollector::new(path, most_in_memory);
                read_list(path, |ray| rays.add(ray))?;
                rays.finish(None)
            }
        }
    }
}

/// Bytes in which a text file says whose it is: a few lines.
const TEXT_HEAD: u64 = 4096;

/// Refuses what begins with bytes that no text has, which a reader of lists would take for a text in another encoding.
fn refuse_bytes(path: &Path, head: &[u8]) -> Result<(), Error> {
    // Of control characters a text has tabs, ends of lines and at most form feeds.
    if head.iter().all(|&b| b >= b' ' || matches!(b, b'\t' | b'\n' | b'\r' | 0x0c)) {
        return Ok(());
    }
    let message = "no file of rays: neither IES TM-25 nor Zemax or LightTools binary, by its first bytes, nor .npz, by its name, nor a CSV \
                   text in UTF-8";
    Err(Error::new(path, ErrorKind::Malformed(message.into())))
}

/// Refuses a text that begins so where it is another program's, which a reader of lists would take for a list with wrong columns.
fn refuse_text(path: &Path, head: &[u8]) -> Result<(), Error> {
    let (kind, program) = if lighttools::is_text(head) {
        ("LightTools ray data", "LightTools")
    } else if zemax::is_text(head) {
        ("Zemax source", "Zemax")
    } else {
        return Ok(());
    };
    let message = format!("a {kind} file as text; export it as {program} binary or IES TM-25, which are read");
    Err(Error::new(path, ErrorKind::Malformed(message)))
}

/// Reads the rays of a file into memory, in any format that [`RayFile::open`] knows.
///
/// # Errors
/// As [`RayFile::open`].
pub fn read_ray_set(path: &Path, preferred: Flux) -> Result<RaySet, Error> {
    RayFile::open_within(path, preferred, u64::MAX)?.into_set()
}

/// Reads a list of rays, by the file's extension: `.npz` with arrays `origin` (n × 3), `direction` (n × 3), `power` (n) and optionally
/// `wavelength_nm` (n), of f64 or f32; anything else as CSV with columns `x, y, z, dx, dy, dz, power` and optionally `wavelength_nm`, in
/// this order or as a header names them. Positions are mm, directions of any length are normalised, powers are in whatever unit the list
/// uses. Lines that start with `#` are comments.
///
/// # Errors
/// When the file cannot be read or its content makes no rays; the message names the line, or the array or ray of an NPZ.
pub fn read_rays(path: &Path) -> Result<Vec<LightRay>, Error> {
    let mut rays = Vec::new();
    read_list(path, |ray| {
        rays.push(ray);
        Ok(())
    })?;
    Ok(rays)
}

/// Reads rays of which only the hits are needed, in any format that [`RayFile::open`] knows: an NPZ list may lack `power`, and
/// its rays have 1 each.
///
/// # Errors
/// As [`RayFile::open`].
pub fn read_ray_paths(path: &Path) -> Result<Vec<LightRay>, Error> {
    if !is_npz(path) {
        return Ok(read_ray_set(path, Flux::Radiant)?.rays);
    }
    let mut rays = Vec::new();
    read_npz(path, OPTIONAL_OF_PATHS, |ray| {
        rays.push(ray);
        Ok(())
    })?;
    Ok(rays)
}

/// Reads which facet each of so many rays leaves, by an array `facet` beside them in an NPZ file; below zero it leaves none. Empty where
/// the file has none.
///
/// # Errors
/// When the file cannot be read, or the array has no number for each ray.
pub fn read_ray_facets(path: &Path, rays: usize) -> Result<Vec<f64>, Error> {
    if is_npz(path) { read_facets(path, rays) } else { Ok(Vec::new()) }
}

/// Whether a file is an archive of arrays, by its name.
fn is_npz(path: &Path) -> bool {
    lower_extension(path) == "npz"
}

/// Reads a list of rays in NPZ or CSV and hands each to `add`.
fn read_list(path: &Path, add: impl FnMut(LightRay) -> Result<(), Error>) -> Result<(), Error> {
    if is_npz(path) { read_npz(path, OPTIONAL_OF_LIGHT, add) } else { read_csv(path, add) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};

    #[test]
    fn rays_with_relative_weights_take_the_flux_of_the_header() {
        let ray = |power| LightRay { origin: Point::ZERO, direction: Vector::Z, power, wavelength_nm: None };
        let scaled = |stated| {
            let mut file = RayFile::from_rays(Path::new("a"), vec![ray(1.0), ray(3.0)]);
            file.flux = Some(Flux::Luminous);
            file.scale_to(stated);
            let set = file.into_set().unwrap();
            ([set.rays[0].power, set.rays[1].power], set.notes)
        };
        let (powers, notes) = scaled(Some(2.0));
        assert_eq!(powers, [0.5, 1.5]);
        assert!(notes[0].contains("2 lumens") && notes[0].contains('4'), "{}", notes[0]);
        for stated in [None, Some(4.0 * (1.0 + 1e-6))] {
            assert_eq!(scaled(stated), ([1.0, 3.0], Vec::new()));
        }
    }

    /// Wherever the rays of a file are kept, each is the same to the bit, its power too, and the file says the same of itself.
    #[test]
    fn rays_on_the_disk_are_those_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let rays = crate::formats::rays::tests::some_rays(1000, true);
        let at = |name: &str| folder.path().join(name);
        crate::formats::write_rays(&at("a.csv"), &rays).unwrap();
        crate::formats::write_rays(&at("a.npz"), &rays).unwrap();
        let mut tm25 = Tm25::from_rays(&rays, Flux::Radiant);
        tm25.header.radiant_flux *= 3.0;
        write_tm25(&at("scaled.tm25ray"), &tm25).unwrap();
        // A table per ray, whose wavelengths depend on the rays before: the power is followed by the table's number.
        let mut tables = tm25.clone();
        tables.header.columns = Tm25Columns { radiant: true, spectrum_index: true, ..Tm25Columns::default() };
        tables.header.spectral = SpectralData::TablePerRay;
        tables.header.spectra = vec![vec![[450.0, 1.0], [500.0, 2.0]]];
        tables.rows.chunks_exact_mut(8).for_each(|row| row[7] = 1.0);
        write_tm25(&at("tables.tm25ray"), &tables).unwrap();
        // Lengths in cm and inches, and weights beside the mean one: places and powers are worked out as each ray is read.
        let numbers = |nm: f64| -> Vec<f32> {
            let wavelength = |ray: &LightRay| nm * ray.wavelength_nm.expect("rays with wavelengths");
            let row = |ray: &LightRay| {
                [&ray.origin.to_array()[..], &ray.direction.to_array(), &[ray.power, wavelength(ray)]].concat()
            };
            rays.iter().flat_map(row).map(|x| x as f32).collect()
        };
        std::fs::write(at("weights.ray"), lighttools::tests::file([3, 0, 0, 0, 2, 2], 7.0, &numbers(1.0))).unwrap();
        let micrometres = zemax::tests::file_of_rays(1000, [1, 2, 0], 0.0, &numbers(1e-3));
        std::fs::write(at("inches.sdf"), micrometres).unwrap();
        for name in ["a.csv", "a.npz", "scaled.tm25ray", "tables.tm25ray", "weights.ray", "inches.sdf"] {
            let expected = read_ray_set(&at(name), Flux::Radiant).unwrap();
            let file = RayFile::open_within(&at(name), Flux::Radiant, 10).unwrap();
            assert!(file.is_on_disk() && file.len() == 1000 && file.spectral_rays() == 1000, "{name}");
            let mut block = RayBlock::default();
            for first in [990, 0, 500, 1003] {
                file.read_block(first, 64, &mut block).unwrap();
                assert_eq!(block.len() as u64, 1000u64.saturating_sub(first).min(64), "{name}");
                for k in 0..block.len() {
                    let expected = expected.rays[first as usize + k];
                    assert_eq!(file.ray(&block, k).unwrap(), expected, "{name}");
                    assert_eq!(file.power(&block, k), expected.power, "{name}");
                }
            }
            let set = file.into_set().unwrap();
            assert_eq!((set.rays, set.notes), (expected.rays, expected.notes), "{name}");
        }
    }

    #[test]
    fn files_of_other_kinds_are_read_as_lists() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "0,0,0,0,0,1,2\n").unwrap();
        let set = read_ray_set(&path, Flux::Radiant).unwrap();
        assert_eq!((set.rays.len(), set.flux), (1, None));
        std::fs::write(&path, b"\x00\x01\xff\xfe\x02").unwrap();
        assert!(read_ray_set(&path, Flux::Radiant).unwrap_err().to_string().contains("no file of rays"));
        std::fs::write(&path, "").unwrap();
        assert!(read_ray_set(&path, Flux::Radiant).unwrap_err().to_string().contains("no rays in it"));
        std::fs::write(&path, "1").unwrap();
        assert!(read_ray_set(&path, Flux::Radiant).unwrap_err().to_string().contains("1 columns"));
    }
}

//! LightTools binary ray data files (`.ray`, `LTRF`), versions 2 and 3.

use super::bytes::ByteReader;
use super::ray_collector::RayCollector;
use super::ray_file::{Flux, RayFile, RowLayout, RowWavelength};
use crate::formats::Error;
use std::path::Path;

/// Length of a unit in mm, by its number; 0 is the unit of the system that wrote the file, which the file does not record.
const UNITS_MM: [Option<f64>; 8] =
    [None, Some(1.0), Some(10.0), Some(1000.0), Some(25.4), Some(304.8), Some(1e-3), Some(1e-6)];

/// Version that has a field for polarisation.
const POLARISED_VERSION: u32 = 3;

/// The key that stands in ray data files of text.
const TEXT_KEY: &[u8] = b"lt_rdf_version";

/// What stands behind the last ray.
const END: &[u8; 7] = b"LTRFEND";

/// Whether a text that begins so is a ray data file of LightTools.
pub(super) fn is_text(head: &[u8]) -> bool {
    head.windows(TEXT_KEY.len()).any(|word| word == TEXT_KEY)
}

/// Reads the rays of a binary ray data file; an error for far-field, tristimulus and polarised data.
pub(super) fn read(path: &Path, most_in_memory: u64) -> Result<RayFile, Error> {
    let mut file = ByteReader::open(path)?;
    file.read_array::<4>("the signature")?;
    let major = file.read_u32("the major version")?;
    file.read_u32("the minor version")?;
    if !(2..=POLARISED_VERSION).contains(&major) {
        return Err(file.malformed(format!("version {major} of LightTools' ray files; 2 and 3 are known")));
    }
    let flux = match file.read_u32("the type of data")? {
        0 => Flux::Radiant,
        1 => Flux::Luminous,
        other => return Err(file.malformed(format!("type of data {other} at byte 12; 0 (W) and 1 (lm) are known"))),
    };
    if file.read_u32("the far-field mark")? != 0 {
        return Err(file.malformed("its rays have directions only (far-field data); positions are needed"));
    }
    let columns = match file.read_u32("the colour information")? {
        0 => 7,
        2 => 8,
        1 => return Err(file.malformed("tristimulus values instead of wavelengths; write it with wavelengths")),
        other => return Err(file.malformed(format!("colour information {other} at byte 20; 0 and 2 are known"))),
    };
    let mut notes = Vec::new();
    let unit = file.read_u32("the unit of length")?;
    let scale = match UNITS_MM.get(unit as usize) {
        Some(Some(scale)) => *scale,
        Some(None) => {
            notes.push("the file counts in the unit of the system that wrote it: taken to be mm".to_owned());
            1.0
        }
        None => return Err(file.malformed(format!("unit of length {unit} at byte 24; 0 to 7 are known"))),
    };
    let mut origin = [0.0; 3];
    file.read_row(&mut origin, "the origin")?;
    // Whether rays are listed about it or from it, the format does not say.
    if origin != [0.0; 3] {
        notes.push(format!("the origin of the data, {origin:?}, is not applied: rays stand as they are listed"));
    }
    let stated = file.read_f32("the flux")?;
    if major == POLARISED_VERSION && file.read_u32("the polarisation mark")? != 0 {
        return Err(file.malformed("polarised rays (Stokes vectors) are not read; write it without polarisation"));
    }

    // The number of rays is not stated: it follows from the length, of which the end mark is no ray.
    let bytes = file.length().saturating_sub(file.position() + END.len() as u64);
    let row = 4 * columns as u64;
    if bytes % row != 0 {
        let message = format!("{bytes} bytes of rays are no whole number of rows of {row} bytes; it was cut short");
        return Err(file.malformed(message));
    }
    let wavelength = if columns == 8 { RowWavelength::Column(7, 1.0) } else { RowWavelength::Common(None) };
    let layout = RowLayout { columns, scale, power: 6, wavelength };
    let mut rays = RayCollector::new(path, most_in_memory).with_rows(file.file_handle()?, file.position(), layout);
    file.read_rays(bytes / row, columns, &mut rays, |row| layout.ray(|column| row[column]))?;
    // A file cut between two rows would else pass.
    if file.read_array::<7>("the end mark")? != *END {
        return Err(file.malformed("LTRFEND is missing behind the rays; it was cut short"));
    }
    let mut set = rays.finish(Some(flux))?;
    // The rays' numbers average to the total: each says how much its ray weighs beside the mean one.
    if !(stated > 0.0 && stated.is_finite()) {
        notes.push(format!(
            "the header states a flux of {stated}: its rays' weights are taken for {flux}; `power` sets it"
        ));
    }
    set.notes = notes;
    set.scale_to(Some(f64::from(stated)));
    Ok(set)
}

#[cfg(test)]
pub(super) mod tests {
    use crate::formats::ray_files::{Flux, read_ray_set};

    /// The bytes of a file: version, its minor, type of data, far field, colour and unit; the flux, and the numbers of all rays.
    pub(crate) fn file(header: [u32; 6], stated: f32, rays: &[f32]) -> Vec<u8> {
        let mut bytes = b"LTRF".to_vec();
        bytes.extend(header.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0.0, 0.0, 0.0, stated].iter().flat_map(|x: &f32| x.to_le_bytes()));
        if header[0] == 3 {
            bytes.extend(0u32.to_le_bytes());
        }
        bytes.extend(rays.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(b"LTRFEND");
        bytes
    }

    const RAYS: [f32; 14] = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.5, 4.0, 5.0, 6.0, 0.0, 1.0, 0.0, 1.5];

    #[test]
    fn weights_of_rays_become_shares_of_the_total() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.ray");
        for version in [2, 3] {
            std::fs::write(&path, file([version, 0, 1, 0, 0, 2], 1.0, &RAYS)).unwrap();
            let set = read_ray_set(&path, Flux::Radiant).unwrap();
            assert_eq!(set.flux, Some(Flux::Luminous));
            assert_eq!(set.rays[1].origin.to_array(), [40.0, 50.0, 60.0]);
            assert_eq!([set.rays[0].power, set.rays[1].power], [0.25, 0.75]);
            assert_eq!(set.notes.len(), 1);
        }
        let spectral = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.5, 550.0];
        std::fs::write(&path, file([2, 0, 0, 0, 2, 1], 0.5, &spectral)).unwrap();
        let set = read_ray_set(&path, Flux::Radiant).unwrap();
        assert_eq!((set.rays[0].wavelength_nm, set.rays[0].power), (Some(550.0), 0.5));
        assert!(set.notes.is_empty());
    }

    #[test]
    fn a_flux_that_is_none_is_told_of() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.ray");
        for stated in [0.0, f32::NAN, f32::INFINITY] {
            std::fs::write(&path, file([2, 0, 1, 0, 0, 1], stated, &RAYS)).unwrap();
            let set = read_ray_set(&path, Flux::Radiant).unwrap();
            assert_eq!([set.rays[0].power, set.rays[1].power], [0.5, 1.5]);
            assert!(set.notes[0].contains("taken for lumens"), "{:?}", set.notes);
        }
    }

    #[test]
    fn text_files_are_refused_as_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.ray");
        let text =
            "# LightTools 8.7.0\n# Ray Data Export File\nlt_rdf_version: 2.0\nlt_startofdata\n 0 0 0 0 0 1 1\n";
        std::fs::write(&path, text).unwrap();
        let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
        assert!(error.contains("LightTools") && error.contains("TM-25"), "{error}");
    }

    #[test]
    fn what_is_not_read_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.ray");
        let whole = file([2, 0, 1, 0, 0, 1], 1.0, &RAYS);
        let mut unfinished = whole.clone();
        *unfinished.last_mut().unwrap() = b'X';
        for (bytes, message) in [
            (file([1, 0, 1, 0, 0, 1], 1.0, &RAYS), "version 1"),
            (file([2, 0, 2, 0, 0, 1], 1.0, &RAYS), "type of data 2"),
            (file([2, 0, 1, 1, 0, 1], 1.0, &RAYS), "far-field"),
            (file([2, 0, 1, 0, 1, 1], 1.0, &RAYS), "tristimulus"),
            (file([2, 0, 1, 0, 0, 8], 1.0, &RAYS), "unit of length 8"),
            (whole[..whole.len() - 9].to_vec(), "cut short"),
            (unfinished, "LTRFEND is missing"),
            (whole[..30].to_vec(), "cut short"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }
}

//! Zemax OpticStudio binary source files (`.dat`, `.sdf`), layout as the program's help gives it under "Binary Source File format".

use super::bytes::ByteReader;
use super::ray_collector::RayCollector;
use super::ray_file::{Flux, RayFile, RowLayout, RowWavelength};
use crate::formats::Error;
use std::path::Path;

/// The first number of a file: the version of the format, or the number that files have in its place that other programs write.
pub(super) const IDENTIFIERS: [i32; 2] = [1010, 8_675_309];

/// Length of a unit in mm, by `DimensionUnits`.
const UNITS_MM: [f64; 5] = [1000.0, 25.4, 10.0, 304.8, 1.0];

/// Micrometres, in which the format counts wavelengths, in nm.
const MICROMETRE: f64 = 1000.0;

/// Whether a text that begins so is a source file of Zemax: its first line holds the number of rays, the unit of length, and zeros in the
/// other columns, which no ray has for its direction.
pub(super) fn is_text(head: &[u8]) -> bool {
    let first = head.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let words = str::from_utf8(first).unwrap_or_default().split_whitespace();
    let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
    match numbers.as_deref() {
        Ok([rays, unit, others @ ..]) => {
            *rays >= 1.0
                && rays.fract() == 0.0
                && (0..UNITS_MM.len()).any(|known| *unit == known as f64)
                && [0, 5, 6].contains(&others.len())
                && others.iter().all(|number| *number == 0.0)
        }
        _ => false,
    }
}

/// Reads the rays of a binary source file. Location, rotation and scale of the header are not applied: OpticStudio itself uses only
/// the number of rays, the unit, the ray format and the flux type.
pub(super) fn read(path: &Path, most_in_memory: u64) -> Result<RayFile, Error> {
    let mut file = ByteReader::open(path)?;
    file.read_i32("the identifier")?;
    let count = file.read_u32("the number of rays")?;
    file.read_array::<100>("the description")?;
    // Read over: of the two fluxes that of the ray set is what its rays add up to.
    file.read_f32("the flux of the source")?;
    let stated = file.read_f32("the flux of the ray set")?;
    let composite = file.read_f32("the wavelength")?;
    file.read_array::<16>("the angular range")?;
    let unit = file.read_u32("the unit of length")?;
    file.read_array::<52>("the placement")?;
    let format = file.read_i32("the ray format")?;
    let flux = file.read_i32("the flux type")?;
    file.read_array::<8>("the reserved numbers")?;

    let scale = UNITS_MM.get(unit as usize).copied();
    let scale = scale.ok_or_else(|| {
        file.malformed(format!("unit of length {unit} at byte 136; 0 to 4 (m, inch, cm, foot, mm) are known"))
    })?;
    let columns = match format {
        0 => 7,
        2 => 8,
        other => {
            return Err(
                file.malformed(format!("ray format {other} at byte 192; 0 (flux) and 2 (spectral) are known"))
            );
        }
    };
    let flux = match flux {
        0 => Flux::Radiant,
        1 => Flux::Luminous,
        other => return Err(file.malformed(format!("flux type {other} at byte 196; 0 (W) and 1 (lm) are known"))),
    };
    // Without a wavelength per ray, the header may give one for all; 0 stands for a composite.
    let common = (composite > 0.0).then(|| f64::from(composite) * MICROMETRE);
    // Each ray's own wavelength goes before that of the header.
    let wavelength =
        if columns == 8 { RowWavelength::Column(7, MICROMETRE) } else { RowWavelength::Common(common) };
    let layout = RowLayout { columns, scale, power: 6, wavelength };
    let mut rays = RayCollector::new(path, most_in_memory).with_rows(file.file_handle()?, file.position(), layout);
    file.read_rays(u64::from(count), columns, &mut rays, |row| layout.ray(|column| row[column]))?;
    let mut set = rays.finish(Some(flux))?;
    // Nothing may stand behind the rays: a count that is too small would leave light out unseen.
    let (behind, row) = (file.length() - file.position(), 4 * columns as u64);
    if behind > 0 {
        let rays = behind / row;
        set.notes.push(format!(
            "the header counts {count} rays, and {behind} bytes behind them ({rays} rays more) were not read"
        ));
    }
    set.scale_to(Some(f64::from(stated)));
    Ok(set)
}

#[cfg(test)]
pub(super) mod tests {
    use crate::formats::ray_files::{Flux, read_ray_set};

    /// A file of one ray, made field by field as the help describes it.
    fn file(unit: u32, format: i32, flux_type: i32, stated: f32, ray: &[f32]) -> Vec<u8> {
        file_of_rays(1, [unit as i32, format, flux_type], stated, ray)
    }

    /// A file of these numbers of all rays, with its unit, format and type of flux.
    pub(crate) fn file_of_rays(
        count: u32,
        [unit, format, flux_type]: [i32; 3],
        stated: f32,
        numbers: &[f32],
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend(1010i32.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend([0; 100]);
        bytes.extend([stated, stated, 0.633, 0.0, 0.0, 0.0, 0.0].iter().flat_map(|x: &f32| x.to_le_bytes()));
        bytes.extend(unit.to_le_bytes());
        bytes.extend([0; 52]);
        bytes.extend(format.to_le_bytes());
        bytes.extend(flux_type.to_le_bytes());
        bytes.extend([0; 8]);
        assert_eq!(bytes.len(), 208);
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        bytes
    }

    #[test]
    fn units_wavelengths_and_flux_are_brought_to_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.sdf");
        std::fs::write(&path, file(1, 2, 0, 0.0, &[1.0, -2.0, 0.5, 0.0, 0.0, -1.0, 0.25, 0.5])).unwrap();
        let set = read_ray_set(&path, Flux::Luminous).unwrap();
        assert_eq!(set.rays[0].origin.to_array(), [25.4, -50.8, 12.7]);
        assert_eq!(set.rays[0].direction.to_array(), [0.0, 0.0, -1.0]);
        assert_eq!((set.rays[0].power, set.rays[0].wavelength_nm), (0.25, Some(500.0)));
        assert_eq!(set.flux, Some(Flux::Radiant));

        std::fs::write(&path, file(4, 0, 1, 2.0, &[1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 4.0])).unwrap();
        let set = read_ray_set(&path, Flux::Luminous).unwrap();
        assert_eq!((set.rays[0].origin.x, set.rays[0].power, set.flux), (1.0, 2.0, Some(Flux::Luminous)));
        assert!((set.rays[0].wavelength_nm.unwrap() - 633.0).abs() < 1e-4);
        assert_eq!(set.notes.len(), 1);

        // The other identifier, with the same layout.
        let mut bytes = file(4, 0, 1, 2.0, &[1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 4.0]);
        bytes[..4].copy_from_slice(&8_675_309i32.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let set = read_ray_set(&path, Flux::Luminous).unwrap();
        assert_eq!((set.rays[0].origin.x, set.rays[0].power, set.flux), (1.0, 2.0, Some(Flux::Luminous)));

        // One ray of two is counted.
        let two = [[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]; 2].concat();
        std::fs::write(&path, file_of_rays(1, [4, 0, 0], 0.0, &two)).unwrap();
        let set = read_ray_set(&path, Flux::Radiant).unwrap();
        assert!(set.rays.len() == 1 && set.notes[0].contains("28 bytes behind them"), "{:?}", set.notes);
    }

    #[test]
    fn damaged_files_are_refused_by_the_byte() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.dat");
        let whole = file(4, 0, 0, 0.0, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
        for (cut, message) in [
            (10, "the file ends in the middle of"),
            (207, "(1 byte missing): it was cut short"),
            (208, "the file ends before ray 1 at byte 208 (28 bytes missing): it was cut short"),
            (232, "the file ends in the middle of ray 1 at byte 208 (4 bytes missing): it was cut short"),
        ] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        for (bytes, message) in [
            (file(9, 0, 0, 0.0, &[0.0; 7]), "unit of length 9 at byte 136"),
            (file(4, 1, 0, 0.0, &[0.0; 7]), "ray format 1 at byte 192"),
            (file(4, 0, 7, 0.0, &[0.0; 7]), "flux type 7 at byte 196"),
            (file(4, 0, 0, 0.0, &[0.0; 7]), "ray 1: the direction has no length"),
            (file(4, 0, 0, 0.0, &[0.0, 0.0, f32::NAN, 0.0, 0.0, 1.0, 1.0]), "ray 1: NaN is no finite number"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }

    /// The first line of a text file names the number of rays and the unit; a list's first line is a ray.
    #[test]
    fn text_files_are_refused_as_what_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.dat");
        for head in ["2 4", "2.0\t4.0\t0 0 0 0 0", "2 4 0 0 0 0 0 0"] {
            std::fs::write(&path, format!("{head}\n0 0 0 0 0 1 1 0.5\n0 0 0 0 0 1 1 0.5\n")).unwrap();
            let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
            assert!(error.contains("Zemax") && error.contains("TM-25"), "{head}: {error}");
        }
        std::fs::write(&path, "2 4 0 0 0 1 1\n").unwrap();
        assert_eq!(read_ray_set(&path, Flux::Radiant).unwrap().rays.len(), 1);
    }
}

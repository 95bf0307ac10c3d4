//! IES TM-25 ray files: rows of f32 behind a header, streamed or whole.

use super::bytes::ByteReader;
use super::ray_collector::RayCollector;
use super::ray_file::{Flux, RayFile, RowLayout, RowWavelength};
use super::tm25_header::{ColumnPlaces, SpectralData, Tm25Columns, Tm25Header};
use crate::formats::rays::stored_direction;
use crate::formats::{Error, LightRay, write_atomic};
use std::path::Path;

/// A TM-25 file in memory.
#[derive(Clone, Debug)]
pub struct Tm25 {
    /// Everything before the rays.
    pub header: Tm25Header,
    /// The rows, one behind the other: position in mm, unit direction, then the columns that the header names.
    pub rows: Vec<f32>,
}

impl Tm25 {
    /// Makes a file of traced rays whose powers are `flux`, rounded to f32, with wavelengths when every ray has one and the flux is
    /// radiant.
    pub fn from_rays(rays: &[LightRay], flux: Flux) -> Self {
        // The standard allows a wavelength per ray with the radiant flux alone.
        let spectral = flux == Flux::Radiant && !rays.is_empty() && rays.iter().all(|r| r.wavelength_nm.is_some());
        let columns = Tm25Columns {
            radiant: flux == Flux::Radiant,
            luminous: flux == Flux::Luminous,
            wavelength: spectral,
            ..Tm25Columns::default()
        };
        let identifier = if spectral { SpectralData::PerRay } else { SpectralData::None };
        let mut header = Tm25Header::of_simulation(rays.len() as u64, columns, identifier);
        if spectral {
            let range = |nearer: fn(f64, f64) -> f64, start| {
                rays.iter().filter_map(|r| r.wavelength_nm).fold(start, nearer)
            };
            let [least, greatest] = [range(f64::min, f64::INFINITY), range(f64::max, 0.0)];
            // The first is that of a file with one wavelength.
            header.wavelengths = [f32::NAN, least as f32, greatest as f32];
        }
        // Of the powers as they are written: read and written again, the file states the same.
        let total: f64 = rays.iter().map(|r| f64::from(r.power as f32)).sum();
        match flux {
            Flux::Radiant => header.radiant_flux = total as f32,
            Flux::Luminous => header.luminous_flux = total as f32,
        }
        let mut rows = Vec::with_capacity(rays.len() * header.places().count);
        for ray in rays {
            let [x, y, z, .., power] = ray.numbers().map(|x| x as f32);
            let [dx, dy, dz] = stored_direction(ray.direction);
            rows.extend([x, y, z, dx, dy, dz, power]);
            rows.extend(ray.wavelength_nm.filter(|_| spectral).map(|w| w as f32));
        }
        Self { header, rows }
    }
}

/// Reads a whole TM-25 file.
///
/// # Errors
/// When the file cannot be read or is not of the standard's form; the message names the byte.
pub fn read_tm25(path: &Path) -> Result<Tm25, Error> {
    let Tm25Reader { mut file, header, places, .. } = Tm25Reader::open(path)?;
    // The header was checked against the length of the file, so that this is no more than the file itself.
    let mut rows = vec![0.0; header.rays as usize * places.count];
    file.read_row(&mut rows, "the rays")?;
    Ok(Tm25 { header, rows })
}

/// Writes a TM-25 file; that rows and header agree is up to the caller.
///
/// # Errors
/// When the file cannot be written.
pub fn write_tm25(path: &Path, tm25: &Tm25) -> Result<(), Error> {
    write_atomic(path, |out| {
        out.write_all(&tm25.header.bytes())?;
        for number in &tm25.rows {
            // Number by number: a file of rays may be larger than what memory has left.
            out.write_all(&number.to_le_bytes())?;
        }
        Ok(())
    })
}

/// A TM-25 file read row by row, in memory that does not grow with the number of rays.
pub struct Tm25Reader {
    file: ByteReader,
    /// Everything before the rays.
    pub header: Tm25Header,
    /// What the reader supposed, for people.
    pub notes: Vec<String>,
    places: ColumnPlaces,
}

/// Fractional part of the golden ratio: multiples of it fill the unit interval evenly, however many are taken.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Tm25Reader {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// When the file cannot be read or its header is not of the standard's form.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = ByteReader::open(path)?;
        let mut notes = Vec::new();
        let header = Tm25Header::read(&mut file, &mut notes)?;
        let places = header.places();
        Ok(Self { file, header, notes, places })
    }

    /// Makes the rays of it, looked at once each, their powers in the preferred flux where the file has both and scaled to the header's
    /// total; where they are more than `most_in_memory` they are read from the disk as they are drawn.
    ///
    /// A file with a spectral table per ray gives each ray one wavelength of its table, spread so that the rays of a table together
    /// have its spectrum.
    ///
    /// # Errors
    /// When the file ends early or a row makes no ray; the message names the ray.
    pub(super) fn into_ray_file(mut self, preferred: Flux, most_in_memory: u64) -> Result<RayFile, Error> {
        let flux = match (self.places.radiant, self.places.luminous) {
            (Some(_), Some(_)) => preferred,
            (Some(_), None) => Flux::Radiant,
            (None, _) => Flux::Luminous,
        };
        let power = if flux == Flux::Radiant { self.places.radiant } else { self.places.luminous };
        let power = power.ok_or_else(|| self.file.malformed("no column of the flux"))?;
        // Zero or no number stands for unknown. By its decimals in single precision, 587.5618 nm are those of other sources.
        let single = self.header.wavelengths[0].to_string().parse::<f64>().ok().filter(|w| *w > 0.0);

        let columns = self.places.count;
        let wavelength = match (self.header.spectral, self.places.wavelength) {
            (SpectralData::Single, _) => RowWavelength::Common(single),
            (SpectralData::PerRay, Some(place)) => RowWavelength::Column(place, 1.0),
            _ => RowWavelength::Common(None),
        };
        let layout = RowLayout { columns, scale: 1.0, power, wavelength };
        let mut rays = RayCollector::new(self.file.path(), most_in_memory);
        if self.header.spectral == SpectralData::TablePerRay {
            // Not read from the file again: the wavelength depends on how many rays of a table came before.
            let mut drawn = TableWavelengths::new(&self.header, self.places.spectrum_index);
            self.file.read_rays(self.header.rays, columns, &mut rays, |row| {
                let nm = Some(drawn.next(row)?);
                RowLayout { wavelength: RowWavelength::Common(nm), ..layout }.ray(|column| row[column])
            })?;
        } else {
            rays = rays.with_rows(self.file.file_handle()?, self.file.position(), layout);
            self.file.read_rays(self.header.rays, columns, &mut rays, |row| layout.ray(|column| row[column]))?;
        }

        let mut set = rays.finish(Some(flux))?;
        set.spectrum = (self.header.spectral == SpectralData::Table)
            .then(|| self.header.spectra[0].iter().map(|pair| pair.map(f64::from)).collect());
        set.notes = self.notes;
        if self.header.spectral == SpectralData::TablePerRay {
            set.notes.push("each ray was given one wavelength of its spectral table".to_owned());
        }
        if self.header.columns.stokes {
            set.notes.push("Stokes vectors are not traced: its light is taken as unpolarised".to_owned());
        }
        let stated = if flux == Flux::Radiant { self.header.radiant_flux } else { self.header.luminous_flux };
        set.scale_to(Some(f64::from(stated)));
        Ok(set)
    }
}

/// Wavelengths drawn from the spectral tables of a file, ray by ray.
struct TableWavelengths {
    /// `None` for an empty one.
    tables: Vec<Option<Spectrum>>,
    /// Rays of each table so far.
    drawn: Vec<u64>,
    /// Column of the number of a ray's table.
    place: Option<usize>,
}

impl TableWavelengths {
    /// Prepares the tables of a header, of which nothing is drawn yet; `place` is the column with the number of a ray's table.
    fn new(header: &Tm25Header, place: Option<usize>) -> Self {
        let tables: Vec<Option<Spectrum>> = header.spectra.iter().map(|t| Spectrum::new(t)).collect();
        Self { drawn: vec![0; tables.len()], tables, place }
    }

    /// Returns the wavelength of the next row's ray, nm; an error, for people, where it names no table or an empty one.
    fn next(&mut self, row: &[f32]) -> Result<f64, String> {
        // Numbered from 1; what lies outside is damage, and must not become another table's spectrum.
        let number = self.place.map_or(0.0, |p| row[p]);
        let table = (number as usize).checked_sub(1).filter(|t| *t < self.tables.len());
        let table = table.ok_or_else(|| format!("spectral table {number}, of {}", self.tables.len()))?;
        let spectrum = self.tables[table].as_ref();
        let spectrum = spectrum.ok_or_else(|| format!("spectral table {number}, which is empty"))?;
        // Multiples of the golden ratio are spread evenly over [0, 1), however many of them there will be.
        self.drawn[table] += 1;
        Ok(spectrum.wavelength((self.drawn[table] as f64 * GOLDEN).fract()))
    }
}

/// A spectral table as a density that is linear between its wavelengths, ready to be inverted.
struct Spectrum {
    /// Wavelength, nm, and density; at least one.
    pairs: Vec<[f64; 2]>,
    /// Power up to each wavelength.
    sums: Vec<f64>,
    /// Power of the whole table.
    total: f64,
}

impl Spectrum {
    /// Sorts and integrates a table; `None` for an empty one.
    fn new(table: &[[f32; 2]]) -> Option<Self> {
        let mut pairs: Vec<[f64; 2]> = table.iter().map(|pair| pair.map(f64::from)).collect();
        // Sorted: nothing in the standard promises that the pairs rise.
        pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut total = 0.0;
        let mut sums = vec![total];
        for pair in pairs.windows(2) {
            // Trapezia: the density is linear between its pairs.
            total += 0.5 * (pair[0][1] + pair[1][1]) * (pair[1][0] - pair[0][0]);
            sums.push(total);
        }
        (!pairs.is_empty()).then_some(Self { pairs, sums, total })
    }

    /// The wavelength below which `share`, in `[0, 1)`, of the power lies, nm; a table of no power gives its least wavelength.
    fn wavelength(&self, share: f64) -> f64 {
        let wanted = share * self.total;
        // The first node beyond the wanted power: it is reached in the interval before.
        let k = self.sums.partition_point(|s| *s <= wanted);
        if k == 0 || k >= self.pairs.len() {
            return self.pairs[0][0];
        }
        let ([a, fa], [b, fb]) = (self.pairs[k - 1], self.pairs[k]);
        // The area below x is fa·x + (fb − fa)/(b − a)·x²/2; this form of the root has no cancellation.
        let rest = wanted - self.sums[k - 1];
        // On a node itself: below, where the density is zero too, the root would be 0/0.
        if rest <= 0.0 {
            return a;
        }
        let slope = (fb - fa) / (b - a);
        let root = (fa * fa + 2.0 * slope * rest).max(0.0).sqrt();
        // Clamped, for rounding may carry the root a little beyond its interval.
        (a + 2.0 * rest / (fa + root)).clamp(a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_ray_set;
    use crate::math::Vector;

    /// A file with every part a TM-25 file may have, and columns that are not traced.
    fn sample() -> Tm25 {
        let columns = Tm25Columns { radiant: true, stokes: true, spectrum_index: true, ..Tm25Columns::default() };
        let mut header = Tm25Header::of_simulation(3, columns, SpectralData::TablePerRay);
        header.radiant_flux = 6.0;
        header.descriptions[0] = "LED für Scheinwerfer".into();
        header.descriptions[8] = "光源".into();
        header.spectra = vec![vec![[450.0, 1.0], [460.0, 1.0]], vec![[600.0, 0.0], [620.0, 2.0], [640.0, 0.0]]];
        header.column_names = vec!["path length".into()];
        header.text = "one more text".into();
        header.text_bytes = 64;
        let row = |x: f32, power: f32, table: f32| {
            [x, 2.0, 3.0, 0.0, 0.6, 0.8, power, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, table, 7.5]
        };
        let rows = [row(1.0, 1.0, 1.0), row(-1.0, 2.0, 2.0), row(0.5, 3.0, 2.0)].concat();
        Tm25 { header, rows }
    }

    #[test]
    fn every_byte_of_a_file_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["a.tm25ray", "b.tm25ray"].map(|n| folder.path().join(n));
        write_tm25(&first, &sample()).unwrap();
        let back = read_tm25(&first).unwrap();
        assert_eq!(back.header.descriptions[8], "光源");
        assert_eq!(back.header.column_names, ["path length"]);
        assert_eq!(back.header.text, "one more text");
        write_tm25(&second, &back).unwrap();
        let bytes = std::fs::read(&first).unwrap();
        assert_eq!(bytes, std::fs::read(&second).unwrap());
        // 36,288 bytes up to the tables; 4 + 16 + 4 + 24 padded to 64; a name; the text; three rows.
        assert_eq!(bytes.len(), 36_288 + 64 + 512 + 64 + 3 * 4 * 15);
    }

    #[test]
    fn tables_of_rays_become_wavelengths() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tm25ray");
        write_tm25(&path, &sample()).unwrap();
        let set = read_ray_set(&path, Flux::Luminous).unwrap();
        assert_eq!(set.flux, Some(Flux::Radiant));
        assert!((set.rays.iter().map(|r| r.power).sum::<f64>() - 6.0).abs() < 1e-12);
        let nm = |k: usize| set.rays[k].wavelength_nm.unwrap();
        assert!((450.0..460.0).contains(&nm(0)) && (600.0..640.0).contains(&nm(1)));
        assert_eq!(set.notes.len(), 2, "{:?}", set.notes);
        // A triangle of wavelengths: the median is its peak, an eighth of the power lies below its lower quarter.
        let spectrum = Spectrum::new(&[[600.0, 0.0], [620.0, 2.0], [640.0, 0.0]]).unwrap();
        for (share, expected) in [(0.0, 600.0), (0.125, 610.0), (0.5, 620.0), (0.875, 630.0)] {
            assert!((spectrum.wavelength(share) - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn traced_rays_are_written_and_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tm25ray");
        for (flux, spectral) in [(Flux::Radiant, true), (Flux::Radiant, false), (Flux::Luminous, true)] {
            let rays = crate::formats::rays::tests::some_rays(50, spectral);
            write_tm25(&path, &Tm25::from_rays(&rays, flux)).unwrap();
            let set = read_ray_set(&path, flux).unwrap();
            assert_eq!(set.flux, Some(flux));
            // With wavelengths the header must say their range (4.7.1.11 and 12).
            let [_, least, greatest] = read_tm25(&path).unwrap().header.wavelengths;
            assert_eq!(least.is_nan(), !(spectral && flux == Flux::Radiant));
            let mut nm = rays.iter().filter_map(|r| r.wavelength_nm).map(|nm| nm as f32);
            assert!(least.is_nan() || nm.all(|nm| (least..=greatest).contains(&nm)), "{least} {greatest}");
            assert!(set.notes.is_empty(), "{:?}", set.notes);
            for (a, b) in rays.iter().zip(&set.rays) {
                assert!((a.origin - b.origin).length() <= 1e-7 * a.origin.length().max(1.0));
                assert!((a.power / b.power - 1.0).abs() < 1e-6);
                let kept = spectral && flux == Flux::Radiant;
                assert_eq!(b.wavelength_nm, a.wavelength_nm.filter(|_| kept));
            }
        }
    }

    /// Of directions all around, along axes and next to them, what is read and written again is the same file, and nowhere farther from
    /// what was traced than single precision makes it.
    #[test]
    fn rays_that_are_read_and_written_again_make_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["a.tm25ray", "b.tm25ray"].map(|name| folder.path().join(name));
        let mut state = 1u64;
        let mut next = || {
            // A linear congruential generator (Knuth, MMIX).
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let rays: Vec<LightRay> = (0..200_000)
            .map(|k| {
                let flat = [1.0, 1e-3, 1e-9, 0.0][k % 4];
                let given = Vector::new(next(), flat * next(), if k % 7 == 0 { flat } else { next() });
                let origin = crate::math::Point::new(1e3 * next(), next(), next());
                LightRay { origin, direction: given.normalize(), power: next().abs(), wavelength_nm: None }
            })
            .collect();
        write_tm25(&first, &Tm25::from_rays(&rays, Flux::Radiant)).unwrap();
        let set = read_ray_set(&first, Flux::Radiant).unwrap();
        // Half a unit in the last place of each component, and one more of where the nearest would not keep its bits.
        let farthest = rays.iter().zip(&set.rays).map(|(a, b)| (a.direction - b.direction).length());
        assert!(farthest.fold(0.0, f64::max) < 1.5 * f64::from(f32::EPSILON));
        write_tm25(&second, &Tm25::from_rays(&set.rays, Flux::Radiant)).unwrap();
        assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(), "the files differ");
        assert_eq!(read_ray_set(&second, Flux::Radiant).unwrap().rays, set.rays);
    }

    #[test]
    fn damaged_files_are_refused_with_the_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tm25ray");
        write_tm25(&path, &sample()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let changed = |byte: usize, value: i32| {
            let mut bytes = whole.clone();
            bytes[byte..byte + 4].copy_from_slice(&value.to_le_bytes());
            bytes
        };
        for (bytes, message) in [
            (changed(4, 2020), "version 2020"),
            (changed(20, i32::MAX), "cut short"),
            (changed(60, 9), "spectral identifier 9 at byte 60"),
            (changed(76, 1 << 30), "spectral tables at byte 76"),
            (changed(84, -5), "additional text of -5"),
            (changed(256, 0), "no position"),
            (changed(264, 0), "neither radiant nor luminous"),
            (changed(272, 1), "radiant flux alone"),
            (changed(268, 5), "flag 4"),
            (changed(36_288, 1 << 28), "a spectral table at byte"),
            (changed(36_292, f32::NAN.to_bits() as i32), "spectral table 1"),
            (changed(whole.len() - 8, 9f32.to_bits() as i32), "ray 3: spectral table 9, of 2"),
            (whole[..whole.len() - 1].to_vec(), "start at byte"),
            (whole[..100].to_vec(), "cut short"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let error = read_ray_set(&path, Flux::Radiant).unwrap_err().to_string();
            assert!(error.contains(message), "{message}: {error}");
        }
    }
}

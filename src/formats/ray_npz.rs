//! Lists of rays in NPZ, whose arrays are unpacked side by side in memory that does not grow with the list.

use super::input::open_file;
use super::rays::misnamed_wavelength;
use super::{Error, ErrorKind, LightRay};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::read::{ZipArchive, ZipFile};

/// Arrays of an NPZ file may unpack to this many times its size: directions, half of the numbers of a ray, hardly shrink.
const MOST_INFLATION: u64 = 50;
/// Bytes that they may unpack to whatever its size: small files of equal rays shrink far.
const LEAST_BUDGET: u64 = 1 << 26;

/// Bytes of an array that are unpacked at a time.
const BUFFER: usize = 1 << 16;

/// Arrays of a list of rays and the numbers that a ray has in each, in the order of [`LightRay::from_numbers`].
const ARRAYS: [(&str, usize); 4] = [("origin", 3), ("direction", 3), ("power", 1), ("wavelength_nm", 1)];

/// Numbers of a ray without a wavelength.
const NUMBERS_OF_RAY: usize = 7;
/// What the numbers of a ray are before any is read: of a list without powers each ray has 1.
const POWER_ONE: [f64; 8] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Arrays of [`ARRAYS`] that a list of light may lack.
pub(super) const OPTIONAL_OF_LIGHT: &[&str] = &["wavelength_nm"];
/// Columns that a list may lack if only its hits are needed; each ray then has power 1.
pub(super) const OPTIONAL_OF_PATHS: &[&str] = &["power", "wavelength_nm"];

/// Reads the arrays `origin`, `direction`, `power` and `wavelength_nm`, of which those named in `optional` may be missing, and hands each
/// ray to `add`, in their order.
///
/// # Errors
/// When the file cannot be read, the arrays are not those of a list, or numbers make no ray; those of `add`.
pub(super) fn read_npz(
    path: &Path,
    optional: &[&str],
    mut add: impl FnMut(LightRay) -> Result<(), Error>,
) -> Result<(), Error> {
    let malformed = |m: String| Error::new(path, ErrorKind::Malformed(m));
    let unreadable = |e| Error::new(path, ErrorKind::Read(e));
    let size = open_file(path).and_then(|f| f.metadata()).map_err(unreadable)?.len();
    // A few kilobytes may unpack to gigabytes: what all arrays take together is bounded by the size of the file.
    let mut budget = LEAST_BUDGET.max(MOST_INFLATION.saturating_mul(size));
    // An archive unpacks one array at a time: each has its own.
    let mut archives = Vec::new();
    for _ in ARRAYS {
        let file = open_file(path).map_err(unreadable)?;
        let archive = ZipArchive::new(BufReader::new(file));
        archives.push(archive.map_err(|e| malformed(format!("not an NPZ file: {e}")))?);
    }
    let names: Vec<_> = archives[0].file_names().filter_map(Result::ok).collect();
    if let Some(refusal) = misnamed_wavelength(names.iter().map(|name| name.trim_end_matches(".npy"))) {
        return Err(malformed(format!("array {refusal}")));
    }
    let mut arrays = Vec::new();
    let mut numbers = POWER_ONE;
    let (mut end, mut known) = (0, 0);
    for (archive, (name, width)) in archives.iter_mut().zip(ARRAYS) {
        let place = end;
        end += width;
        let entry = match archive.by_name(&format!("{name}.npy")) {
            Ok(entry) => entry,
            Err(zip::result::ZipError::FileNotFound) if optional.contains(&name) => continue,
            Err(zip::result::ZipError::FileNotFound) => {
                return Err(malformed(format!("no array '{name}'; a ray list has origin, direction, power")));
            }
            Err(e) => return Err(malformed(format!("array '{name}': {e}"))),
        };
        let array = ArrayReader::open(entry, width, &mut budget);
        arrays.push((name, place..end, array.map_err(|m| malformed(format!("array '{name}': {m}")))?));
        known = end.max(NUMBERS_OF_RAY);
    }
    let rows = arrays[0].2.rows;
    if arrays.iter().any(|(_, _, array)| array.rows != rows) {
        return Err(malformed("the arrays origin, direction, power and wavelength_nm differ in length".into()));
    }
    for ray in 0..rows {
        for (name, places, array) in &mut arrays {
            array.read_row(&mut numbers[places.clone()]).map_err(|m| malformed(format!("array '{name}': {m}")))?;
        }
        add(LightRay::from_numbers(&numbers[..known]).map_err(|m| malformed(format!("ray {}: {m}", ray + 1)))?)?;
    }
    for (name, _, array) in &mut arrays {
        // The sum of an entry's bytes is compared where it ends.
        array.entry.read(&mut [0]).map_err(|e| malformed(format!("array '{name}': {e}")))?;
    }
    Ok(())
}

/// Reads the array `facet` beside so many rays, a number each; empty where there is none.
///
/// # Errors
/// When the file cannot be read, or the array has no number for each ray.
pub(super) fn read_facets(path: &Path, rays: usize) -> Result<Vec<f64>, Error> {
    let malformed = |m: String| Error::new(path, ErrorKind::Malformed(m));
    let unusable = |m: String| malformed(format!("array 'facet': {m}"));
    let file = open_file(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    let archive = ZipArchive::new(BufReader::new(file));
    let mut archive = archive.map_err(|e| malformed(format!("not an NPZ file: {e}")))?;
    let entry = match archive.by_name("facet.npy") {
        Ok(entry) => entry,
        Err(zip::result::ZipError::FileNotFound) => return Ok(Vec::new()),
        Err(e) => return Err(unusable(e.to_string())),
    };
    // No more of it is unpacked than there are rays.
    let mut budget = u64::MAX;
    let mut array = ArrayReader::open(entry, 1, &mut budget).map_err(unusable)?;
    if array.rows != rays as u64 {
        return Err(unusable(format!("it has {} rows, where there are {rays} rays", array.rows)));
    }
    let mut facets = vec![0.0; rays];
    for facet in facets.chunks_mut(1) {
        array.read_row(facet).map_err(unusable)?;
    }
    Ok(facets)
}

/// How the numbers of an NPY array are written: its name there, their bytes, and how they are read.
type Numbers = (&'static str, u64, fn([u8; 8]) -> f64);
/// Numbers that are read, little-endian; NumPy counts, as facets are counted, in whole ones.
const NUMBERS: [Numbers; 6] = [
    ("<f8", 8, f64::from_le_bytes),
    ("<f4", 4, |raw| f64::from(f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]))),
    ("<i8", 8, |raw| i64::from_le_bytes(raw) as f64),
    ("<i4", 4, |raw| f64::from(i32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]))),
    ("<u8", 8, |raw| u64::from_le_bytes(raw) as f64),
    ("<u4", 4, |raw| f64::from(u32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]))),
];

/// An NPY array of numbers, read row by row.
struct ArrayReader<'a> {
    entry: BufReader<ZipFile<'a, BufReader<File>>>,
    numbers: Numbers,
    rows: u64,
    /// Rows that were read.
    done: u64,
}

impl<'a> ArrayReader<'a> {
    /// Reads the head of an array of shape `(n, width)`, or `(n,)` for a width of 1; its bytes are taken off `budget`, and more than that
    /// is an error.
    fn open(entry: ZipFile<'a, BufReader<File>>, width: usize, budget: &mut u64) -> Result<Self, String> {
        let mut entry = BufReader::with_capacity(BUFFER, entry);
        let cut = |e: std::io::Error| e.to_string();
        let mut start = [0u8; 10];
        entry.read_exact(&mut start).map_err(cut)?;
        if &start[..6] != b"\x93NUMPY" {
            return Err("not an NPY array".into());
        }
        // Versions 2 and 3 have a header length of four bytes. A header of this kind never needs the upper two, which are zero.
        if start[6] > 1 {
            entry.read_exact(&mut [0u8; 2]).map_err(cut)?;
        }
        let mut header = vec![0u8; usize::from(u16::from_le_bytes([start[8], start[9]]))];
        entry.read_exact(&mut header).map_err(cut)?;
        // Python writes the dictionary with blanks and quotes of either kind.
        let header = String::from_utf8_lossy(&header).replace([' ', '"'], "");
        let is_written = |(name, ..): &Numbers| header.contains(&format!("'descr':'{name}'"));
        let Some(numbers) = NUMBERS.into_iter().find(is_written) else {
            return Err("its numbers are not little-endian f64, f32 or whole ones of 32 or 64 bits".into());
        };
        let (_, bytes, _) = numbers;
        let Some((shape, _)) = header.split_once("'shape':(").and_then(|(_, s)| s.split_once(')')) else {
            return Err("its header gives no shape".into());
        };
        let dims: Vec<u64> = shape.split(',').filter(|d| !d.is_empty()).map_while(|d| d.parse().ok()).collect();
        let fits = match width {
            1 => dims.len() == 1,
            _ => dims.len() == 2 && dims[1] == width as u64,
        };
        if !fits || !header.contains("'fortran_order':False") {
            let needed = if width == 1 { "(n,)".to_owned() } else { format!("(n, {width})") };
            return Err(format!("shape ({shape}), where {needed} in C order is needed"));
        }
        // Saturating: a shape of 2⁶⁰ rows must be refused, not wrapped.
        let wanted = dims[0].saturating_mul(width as u64).saturating_mul(bytes);
        *budget = budget.checked_sub(wanted).ok_or_else(|| {
            format!("shape ({shape}) takes {wanted} bytes, more than a file of this size can hold of rays; written without \
                 compression (numpy.savez) it is read")
        })?;
        Ok(Self { entry, numbers, rows: dims[0], done: 0 })
    }

    /// Fills `row`, as long as the array is wide, with the numbers of the next row. The error, for people, names the row but not the array.
    fn read_row(&mut self, row: &mut [f64]) -> Result<(), String> {
        let (_, bytes, read) = self.numbers;
        for number in row {
            let mut raw = [0; 8];
            // What is read grows with what is there, whatever the head says.
            self.entry.read_exact(&mut raw[..bytes as usize]).map_err(|e| {
                format!(
                    "it ends or is damaged within row {} of the {} that its header states: {e}",
                    self.done + 1,
                    self.rows
                )
            })?;
            *number = read(raw);
        }
        self.done += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{NpyArray, read_ray_facets, read_ray_paths, read_rays, write_npz};

    /// Rays count from 1, as lines of other files do.
    #[test]
    fn refusals_count_rays_from_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let array = |name, width: usize, data| NpyArray { name, shape: [2, width][..width.min(2)].to_vec(), data };
        let power = array("power", 1, &[1.0, -1.0]);
        let direction = array("direction", 3, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        write_npz(&path, &[array("origin", 3, &[0.0; 6]), direction, power]).unwrap();
        let refusal = read_rays(&path).unwrap_err().to_string();
        assert!(refusal.contains("ray 2: a power of -1"), "{refusal}");
    }

    #[test]
    fn wavelengths_of_another_name_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let array = |name, width: usize, data| NpyArray { name, shape: [1, width][..width.min(2)].to_vec(), data };
        let ray =
            [array("origin", 3, &[0.0; 3]), array("direction", 3, &[0.0, 0.0, 1.0]), array("power", 1, &[1.0])];
        let wavelength = |name, nm| [&ray[..], &[array(name, 1, nm)]].concat();
        write_npz(&path, &wavelength("wavelength", &[550.0])).unwrap();
        let refusal = read_rays(&path).unwrap_err().to_string();
        assert!(
            refusal.contains("array 'wavelength' is not read; call wavelengths in nm 'wavelength_nm'"),
            "{refusal}"
        );
        write_npz(&path, &wavelength("wavelength_nm", &[550.0])).unwrap();
        assert_eq!(read_rays(&path).unwrap()[0].wavelength_nm, Some(550.0));
    }

    /// Whoever only asks where rays hit needs no power; a source does.
    #[test]
    fn rays_without_power_are_paths_and_no_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let array = |name, width: usize, data| NpyArray { name, shape: [2, width][..width.min(2)].to_vec(), data };
        let direction = array("direction", 3, &[0.0, 0.0, 1.0, 0.0, 2.0, 0.0]);
        let origin = array("origin", 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let (wavelength, facet) = (array("wavelength_nm", 1, &[500.0, 600.0]), array("facet", 1, &[-1.0, 7.0]));
        write_npz(&path, &[origin, direction, wavelength, facet]).unwrap();
        assert_eq!(read_ray_facets(&path, 2).unwrap(), [-1.0, 7.0]);
        assert!(read_ray_facets(&path, 3).unwrap_err().to_string().contains("2 rows"));
        assert!(read_rays(&path).unwrap_err().to_string().contains("no array 'power'"));
        let rays = read_ray_paths(&path).unwrap();
        let found: Vec<_> = rays.iter().map(|ray| (ray.numbers(), ray.wavelength_nm)).collect();
        assert_eq!(
            found,
            [
                ([1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 1.0], Some(500.0)),
                ([4.0, 5.0, 6.0, 0.0, 1.0, 0.0, 1.0], Some(600.0))
            ]
        );
    }

    #[test]
    fn what_is_no_list_of_rays_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        std::fs::write(&path, b"PK no zip").unwrap();
        assert!(read_rays(&path).unwrap_err().to_string().contains("not an NPZ file"));
        write_npz(&path, &[NpyArray { name: "origin", shape: vec![6], data: &[0.0; 6] }]).unwrap();
        assert!(read_rays(&path).unwrap_err().to_string().contains("shape (6,)"));
    }
}

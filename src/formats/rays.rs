//! Lists of light rays: origin, direction, power and wavelength, as CSV or NPZ.

use super::file_names::lower_extension;
use super::input::{open_file, read_text};
use super::{Error, ErrorKind, NpyArray, write_atomic, write_npz};
use crate::math::{Point, Vector};
use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;

/// One ray of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRay {
    /// Where it starts, mm.
    pub origin: Point,
    /// Unit length.
    pub direction: Vector,
    /// Watts or lumens, as the whole list.
    pub power: f64,
    /// Vacuum wavelength, nm, if the list says.
    pub wavelength_nm: Option<f64>,
}

/// The first so many columns are needed; the wavelength may be missing.
const REQUIRED_COLUMNS: usize = 7;

/// A length this near to 1 is 1 but for rounding: a few units in the last place of a double.
const UNIT_ROUNDING: f64 = 1e-15;

/// Arrays of an NPZ file may unpack to this many times its size: directions, half of the numbers of a ray, hardly shrink.
const MOST_INFLATION: u64 = 50;
/// And to this much whatever its size, bytes: small files of equal rays shrink far.
const LEAST_BUDGET: u64 = 1 << 26;

/// Names of the columns of a CSV file, in the order they are written.
const COLUMNS: [&str; 8] = ["x", "y", "z", "dx", "dy", "dz", "power", "wavelength_nm"];

impl LightRay {
    /// Makes a ray of seven or eight numbers: origin (mm), direction, power and, if given, wavelength (nm); the direction is brought to
    /// unit length. An error, for people, where one is not finite, the direction zero, the power negative or the wavelength not positive.
    pub(super) fn from_numbers(numbers: &[f64]) -> Result<Self, String> {
        let triple = |k: usize| Vector::new(numbers[k], numbers[k + 1], numbers[k + 2]);
        if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
            return Err(format!("{bad} is no finite number"));
        }
        let given = triple(3);
        let length = given.length();
        if length == 0.0 || !length.is_finite() {
            return Err("the direction has no length".into());
        }
        // A direction that is already of unit length keeps its bits.
        let direction = if (length - 1.0).abs() < UNIT_ROUNDING { given } else { given / length };
        let power = numbers[6];
        if power < 0.0 {
            return Err(format!("a power of {power}; powers must be zero or more"));
        }
        let wavelength_nm = numbers.get(7).copied();
        if wavelength_nm.is_some_and(|w| w <= 0.0) {
            return Err("a wavelength must be positive, in nm".into());
        }
        Ok(Self { origin: triple(0), direction, power, wavelength_nm })
    }

    /// Origin, direction and power, as files list them.
    pub(super) fn numbers(&self) -> [f64; 7] {
        let ([x, y, z], [dx, dy, dz]) = (self.origin.to_array(), self.direction.to_array());
        [x, y, z, dx, dy, dz, self.power]
    }
}

/// Reads a list of rays; `.npz` by arrays `origin` (n × 3), `direction` (n × 3), `power` (n) and, if wanted,
/// `wavelength_nm` (n), of f64 or f32; anything else as CSV with columns `x, y, z, dx, dy, dz, power` and, if wanted,
/// `wavelength_nm`. Positions are mm. A CSV header may name the columns in any order; lines that start with `#` are comments.
///
/// # Errors
/// When the file cannot be read or its content makes no rays; the message names the line.
pub fn read_rays(path: &Path) -> Result<Vec<LightRay>, Error> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npz")) {
        return read_npz(path);
    }
    let text = read_text(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    parse_csv(path, &text)
}

/// Writes a list of rays as NPZ (`.npz`) or CSV (`.csv`, `.txt`); wavelengths when the first ray has one, then NaN for rays without.
///
/// # Errors
/// When the extension is another, or the file cannot be written.
pub fn write_rays(path: &Path, rays: &[LightRay]) -> Result<(), Error> {
    // Lists have a wavelength for all rays or for none; the first tells.
    let spectral = rays.first().is_some_and(|r| r.wavelength_nm.is_some());
    let extension = lower_extension(path);
    match extension.as_str() {
        "npz" => {
            let origin: Vec<f64> = rays.iter().flat_map(|r| r.origin.to_array()).collect();
            let direction: Vec<f64> = rays.iter().flat_map(|r| r.direction.to_array()).collect();
            let power: Vec<f64> = rays.iter().map(|r| r.power).collect();
            let wavelength: Vec<f64> = rays.iter().map(|r| r.wavelength_nm.unwrap_or(f64::NAN)).collect();
            let n = rays.len();
            let mut arrays = vec![
                NpyArray { name: "origin", shape: vec![n, 3], data: &origin },
                NpyArray { name: "direction", shape: vec![n, 3], data: &direction },
                NpyArray { name: "power", shape: vec![n], data: &power },
            ];
            if spectral {
                arrays.push(NpyArray { name: "wavelength_nm", shape: vec![n], data: &wavelength });
            }
            write_npz(path, &arrays)
        }
        "csv" | "txt" => write_atomic(path, |w| {
            writeln!(w, "{}", COLUMNS[..if spectral { 8 } else { 7 }].join(","))?;
            let mut line = String::new();
            for ray in rays {
                line.clear();
                for (i, x) in ray.numbers().iter().enumerate() {
                    // Writing to a string cannot fail.
                    let _ = write!(line, "{}{x}", if i > 0 { "," } else { "" });
                }
                if spectral {
                    let _ = write!(line, ",{}", ray.wavelength_nm.unwrap_or(f64::NAN));
                }
                writeln!(w, "{line}")?;
            }
            Ok(())
        }),
        _ => Err(Error::new(path, ErrorKind::Extension { given: extension, known: ".csv, .npz" })),
    }
}

/// Reads rays from lines of numbers, with a header that tells the order of columns or without one; none from a text without lines.
fn parse_csv(path: &Path, text: &str) -> Result<Vec<LightRay>, Error> {
    let mut rays = Vec::new();
    // Position of each of `COLUMNS` in a line.
    let mut order: Vec<usize> = Vec::new();
    let mut wanted = 0;
    // Spreadsheets put a byte order mark in front.
    for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fail = |message: String| Error::at_line(path, n + 1, message);
        // Where semicolons part the cells, a comma is a decimal point.
        let (separators, points): (&[char], bool) =
            if line.contains(';') { (&[';'], true) } else { (&[','], false) };
        let mut cells: Vec<&str> = if line.contains(separators) {
            line.split(separators).map(str::trim).collect()
        } else {
            line.split_whitespace().collect()
        };
        // Spreadsheets end lines by empty cells.
        while cells.last().is_some_and(|c| c.is_empty()) {
            cells.pop();
        }
        // The first line that is no comment says how many columns there are and, if it is a header, in which order.
        if order.is_empty() {
            let header = cells.iter().any(|c| COLUMNS.contains(&c.to_lowercase().as_str()));
            order = columns(&cells, header).map_err(&fail)?;
            wanted = cells.len();
            if header {
                continue;
            }
        }
        // Cells beyond those that are asked for may be missing, but no line may have more than the first.
        let last = order.iter().max().map_or(0, |k| k + 1);
        if cells.len() < last || cells.len() > wanted {
            let message = match cells.len() {
                1 => "1 value in this line".to_owned(),
                n => format!("{n} values in this line"),
            };
            return Err(fail(format!("{message}, but {wanted} in the first one")));
        }
        let numbers: Vec<f64> = order
            .iter()
            .map(|&k| {
                let cell = cells[k];
                let number = if points { cell.replace(',', ".").parse::<f64>() } else { cell.parse() };
                number.map_err(|_| fail(format!("'{cell}' is not a number (column {})", k + 1)))
            })
            .collect::<Result<_, Error>>()?;
        rays.push(LightRay::from_numbers(&numbers).map_err(fail)?);
    }
    Ok(rays)
}

/// Where each of [`COLUMNS`] stands in a line: by the names of a header, or in that order without one. An error, for people, where a
/// needed one is missing or one stands twice.
fn columns(cells: &[&str], header: bool) -> Result<Vec<usize>, String> {
    if !header {
        return match cells.len() {
            7 | 8 => Ok((0..cells.len()).collect()),
            n => Err(format!("{n} columns; a ray has {} and, if wanted, wavelength_nm", COLUMNS[..7].join(", "))),
        };
    }
    let mut order = Vec::new();
    for (k, name) in COLUMNS.iter().enumerate() {
        // Looked for twice: of two columns of one name either may be meant.
        let mut places = (0..cells.len()).filter(|&i| cells[i].eq_ignore_ascii_case(name));
        match (places.next(), places.next()) {
            (_, Some(again)) => {
                return Err(format!("column '{name}' stands twice, the second time as column {}", again + 1));
            }
            (Some(place), None) => order.push(place),
            (None, None) if k < REQUIRED_COLUMNS => {
                return Err(format!("no column '{name}'; needed are {}", COLUMNS[..REQUIRED_COLUMNS].join(", ")));
            }
            (None, None) => {}
        }
    }
    Ok(order)
}

/// Reads rays from an NPZ file's arrays origin, direction, power and, where there is one, wavelength_nm.
fn read_npz(path: &Path) -> Result<Vec<LightRay>, Error> {
    let malformed = |m: String| Error::new(path, ErrorKind::Malformed(m));
    let file = open_file(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    let size = file.metadata().map_err(|e| Error::new(path, ErrorKind::Read(e)))?.len();
    // A few kilobytes may unpack to gigabytes: what all arrays take together is bounded by the size of the file.
    let mut budget = LEAST_BUDGET.max(MOST_INFLATION.saturating_mul(size));
    let mut zip = zip::ZipArchive::new(file).map_err(|e| malformed(format!("not an NPZ file: {e}")))?;
    let mut array = |name: &str, width: usize| -> Result<Option<Vec<f64>>, Error> {
        let entry = match zip.by_name(&format!("{name}.npy")) {
            // An array that may be missing is no error here; whether it may be is the caller's to say.
            Ok(entry) => entry,
            Err(zip::result::ZipError::FileNotFound) => return Ok(None),
            Err(e) => return Err(malformed(format!("array '{name}': {e}"))),
        };
        read_array(entry, width, &mut budget).map(Some).map_err(|m| malformed(format!("array '{name}': {m}")))
    };
    let mut needed = |name: &str, width: usize| {
        array(name, width)?
            .ok_or_else(|| malformed(format!("no array '{name}'; a ray list has origin, direction, power")))
    };
    let (origin, direction, power) = (needed("origin", 3)?, needed("direction", 3)?, needed("power", 1)?);
    let wavelength = array("wavelength_nm", 1)?;
    // By the powers, one a ray.
    let n = power.len();
    if origin.len() != 3 * n || direction.len() != 3 * n || wavelength.as_ref().is_some_and(|w| w.len() != n) {
        return Err(malformed("the arrays origin, direction, power and wavelength_nm differ in length".into()));
    }
    (0..n)
        .map(|i| {
            let (o, d) = (&origin[3 * i..3 * i + 3], &direction[3 * i..3 * i + 3]);
            let mut numbers = vec![o[0], o[1], o[2], d[0], d[1], d[2], power[i]];
            numbers.extend(wavelength.as_ref().map(|w| w[i]));
            LightRay::from_numbers(&numbers).map_err(|m| malformed(format!("ray {i}: {m}")))
        })
        .collect()
}

/// Reads the values of an NPY array of f64 or f32 of shape `(n, width)`, or `(n,)` for a width of 1; their bytes are taken off `budget`,
/// and more than that is an error.
fn read_array(mut entry: impl Read, width: usize, budget: &mut u64) -> Result<Vec<f64>, String> {
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
    let bytes = if header.contains("'descr':'<f8'") {
        8
    } else if header.contains("'descr':'<f4'") {
        4
    } else {
        return Err("its numbers are not little-endian f64 or f32".into());
    };
    let Some((shape, _)) = header.split_once("'shape':(").and_then(|(_, s)| s.split_once(')')) else {
        return Err("its header tells no shape".into());
    };
    let dims: Vec<u64> = shape.split(',').filter(|d| !d.is_empty()).map_while(|d| d.parse().ok()).collect();
    let fits = match width {
        1 => dims.len() == 1,
        _ => dims.len() == 2 && dims[1] == width as u64,
    };
    if !fits || !header.contains("'fortran_order':False") {
        return Err(format!("shape ({shape}), where (n, {width}) in C order is needed"));
    }
    // Saturating: a shape of 2⁶⁰ rows must be refused, not wrapped.
    let wanted = dims[0].saturating_mul(width as u64).saturating_mul(bytes);
    *budget = budget.checked_sub(wanted).ok_or_else(|| {
        format!("shape ({shape}) takes {wanted} bytes, more than a file of this size can hold of rays")
    })?;
    // What is read grows with what is there, whatever the header says.
    let mut raw = Vec::new();
    entry.take(wanted).read_to_end(&mut raw).map_err(cut)?;
    // A file that ends early would else give fewer rays than it promises.
    if raw.len() as u64 != wanted {
        return Err(format!("{} bytes where shape ({shape}) needs {wanted}", raw.len()));
    }
    Ok(match bytes {
        8 => raw.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i]))).collect(),
        _ => raw.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(std::array::from_fn(|i| b[i])))).collect(),
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::formats) fn some_rays(n: usize, spectral: bool) -> Vec<LightRay> {
        (0..n)
            .map(|i| {
                let t = i as f64;
                LightRay {
                    origin: Point::new(t, 0.1 * t, 1.0 / 3.0),
                    direction: Vector::new(t.sin(), t.cos(), 0.1).normalize(),
                    power: 1.0 / (1.0 + t),
                    wavelength_nm: spectral.then_some(450.0 + t),
                }
            })
            .collect()
    }

    #[test]
    fn both_formats_keep_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv", "a.npz"] {
            for spectral in [false, true] {
                let (path, rays) = (folder.path().join(name), some_rays(100, spectral));
                write_rays(&path, &rays).unwrap();
                let back = read_rays(&path).unwrap();
                assert_eq!(back.len(), rays.len());
                for (a, b) in rays.iter().zip(&back) {
                    assert_eq!((a.origin, a.power, a.wavelength_nm), (b.origin, b.power, b.wavelength_nm));
                    assert!((a.direction - b.direction).length() < 2e-16);
                }
            }
        }
        assert!(write_rays(&folder.path().join("a.ray"), &[]).unwrap_err().to_string().contains(".csv, .npz"));
    }

    #[test]
    fn columns_may_come_in_any_order() {
        let text = "# from elsewhere\nPower;dx;dy;dz;x;y;z;note\n2;0;0;4;1;2;3;hello\n";
        let rays = parse_csv(Path::new("r.csv"), text).unwrap();
        let expected =
            LightRay { origin: Point::new(1.0, 2.0, 3.0), direction: Vector::Z, power: 2.0, wavelength_nm: None };
        assert_eq!(rays, [expected]);
        for text in [
            "1 2 3 0 0 2 2\n1 2 3 0 0 1 2\n",
            // As spreadsheets write them.
            "\u{feff}x,y,z,dx,dy,dz,power\r\n1,2,3,0,0,2,2\r\n\r\n1,2,3,0,0,1,2\r\n",
            "x;y;z;dx;dy;dz;power\n1,0;2,0;3,0;0,0;0,0;1,5;2,0\n1;2;3;0;0;1;2e0\n",
            "1,2,3,0,0,1,2,\n1,2,3,0,0,1,2,\n",
        ] {
            assert_eq!(parse_csv(Path::new("r.csv"), text).unwrap(), [expected; 2], "{text}");
        }
    }

    #[test]
    fn refusals_name_the_line() {
        for (text, message) in [
            ("x,y,z,dx,dy,dz\n", "r.csv:1: no column 'power'"),
            ("0,0,0,0,0,1,1\n0,0,0,0,0,0,1\n", "r.csv:2: the direction has no length"),
            ("0,0,0,0,0,1,1\n\n0,0,0,0,0,1,-1\n", "r.csv:3: a power of -1"),
            ("0,0,0,0,0,1,one\n", "r.csv:1: 'one' is not a number"),
            ("0,0,0,0,0,1,1\n0,0,0,0,1\n", "r.csv:2: 5 values in this line, but 7 in the first one"),
            ("0,0,0,0,0,1,1\n0,0,0,0,1,0,0,5\n", "r.csv:2: 8 values in this line, but 7 in the first one"),
            ("0,0,0\n", "r.csv:1: 3 columns"),
            ("0,0,0,0,0,1,inf\n", "r.csv:1: inf is no finite number"),
            ("x,y,z,dx,dy,dz,power,X\n", "r.csv:1: column 'x' stands twice, the second time as column 8"),
        ] {
            let e = parse_csv(Path::new("r.csv"), text).unwrap_err().to_string();
            assert!(e.starts_with(message), "{e}");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        std::fs::write(&path, b"PK no zip").unwrap();
        assert!(read_rays(&path).unwrap_err().to_string().contains("not an NPZ file"));
        write_npz(&path, &[NpyArray { name: "origin", shape: vec![6], data: &[0.0; 6] }]).unwrap();
        assert!(read_rays(&path).unwrap_err().to_string().contains("shape (6,)"));
    }
}

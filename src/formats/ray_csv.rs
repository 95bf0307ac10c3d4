//! Lists of rays in CSV, read line by line in memory that does not grow with the list.

use super::input::open_file;
use super::rays::{COLUMNS, misnamed_wavelength};
use super::{Error, ErrorKind, LightRay};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// The first so many columns are needed; the wavelength may be missing.
const REQUIRED_COLUMNS: usize = 7;

/// Bytes of one read from the disk.
const BUFFER: usize = 1 << 18;

/// Bytes that a line may have: some hundred times those of eight numbers with all their digits. What has more is no list of rays.
const LONGEST_LINE: u64 = 1 << 16;

/// Reads a file of rays and hands each to `add`, in the order of the lines.
///
/// # Errors
/// When the file cannot be read or a line makes no ray, which the message names; those of `add`.
pub(super) fn read_csv(path: &Path, mut add: impl FnMut(LightRay) -> Result<(), Error>) -> Result<(), Error> {
    let unreadable = |e| Error::new(path, ErrorKind::Read(e));
    let file = open_file(path).map_err(unreadable)?;
    let size = file.metadata().map_err(unreadable)?.len();
    // A file that grows while it is read, such as a log, would else never end.
    let mut file = BufReader::with_capacity(BUFFER, file).take(size);
    let mut rows = RowReader { path, order: Vec::new(), wanted: 0 };
    let mut bytes = Vec::new();
    for number in 1.. {
        bytes.clear();
        let length = (&mut file).take(LONGEST_LINE).read_until(b'\n', &mut bytes).map_err(unreadable)?;
        if length == 0 {
            break;
        }
        if length as u64 == LONGEST_LINE && bytes.last() != Some(&b'\n') {
            let message = format!("more than {LONGEST_LINE} bytes in one line; this is no list of rays");
            return Err(Error::at_line(path, number, message));
        }
        let line = std::str::from_utf8(&bytes)
            .map_err(|e| Error::at_line(path, number, format!("it is no UTF-8 text: {e}")))?;
        // Spreadsheets put a byte order mark in front.
        let line = if number == 1 { line.trim_start_matches('\u{feff}') } else { line };
        if let Some(ray) = rows.ray(number, line)? {
            add(ray)?;
        }
    }
    Ok(())
}

/// Parses rays from lines of numbers, with or without a header that gives the order of columns.
struct RowReader<'a> {
    path: &'a Path,
    /// Position of each of [`COLUMNS`] in a line; empty before the first.
    order: Vec<usize>,
    /// Cells of the first line.
    wanted: usize,
}

impl RowReader<'_> {
    /// Returns the ray of a line, whose number from 1 errors name; `None` for a comment, an empty line or the header. The first line that
    /// is none of the former two sets the order and number of columns for all others.
    fn ray(&mut self, number: usize, line: &str) -> Result<Option<LightRay>, Error> {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return Ok(None);
        }
        let path = self.path;
        let fail = |message: String| Error::at_line(path, number, message);
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
        if self.order.is_empty() {
            let header = cells.iter().any(|c| COLUMNS.contains(&c.to_lowercase().as_str()));
            self.order = columns(&cells, header).map_err(&fail)?;
            self.wanted = cells.len();
            if header {
                return Ok(None);
            }
        }
        // Cells beyond the required ones may be missing, but no line may have more than the first.
        let last = self.order.iter().max().map_or(0, |k| k + 1);
        if cells.len() < last || cells.len() > self.wanted {
            let message = match cells.len() {
                1 => "1 value in this line".to_owned(),
                n => format!("{n} values in this line"),
            };
            return Err(fail(format!("{message}, but {} in the first one", self.wanted)));
        }
        let mut numbers = [0.0; COLUMNS.len()];
        for (value, &k) in numbers.iter_mut().zip(&self.order) {
            let cell = cells[k];
            let number = if points { cell.replace(',', ".").parse::<f64>() } else { cell.parse() };
            *value = number.map_err(|_| fail(format!("'{cell}' is not a number (column {})", k + 1)))?;
        }
        LightRay::from_numbers(&numbers[..self.order.len()]).map(Some).map_err(fail)
    }
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
    if let Some(refusal) = misnamed_wavelength(cells.iter().copied()) {
        return Err(format!("column {refusal}"));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};

    fn parse_csv(text: &str) -> Result<Vec<LightRay>, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.csv");
        std::fs::write(&path, text).unwrap();
        let mut rays = Vec::new();
        read_csv(&path, |ray| {
            rays.push(ray);
            Ok(())
        })?;
        Ok(rays)
    }

    #[test]
    fn columns_may_come_in_any_order() {
        let text = "# from elsewhere\nPower;dx;dy;dz;x;y;z;note\n2;0;0;4;1;2;3;hello\n";
        let rays = parse_csv(text).unwrap();
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
            assert_eq!(parse_csv(text).unwrap(), [expected; 2], "{text}");
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
            (&"7".repeat(1 << 17), "r.csv:1: more than 65536 bytes in one line"),
            (
                "x,y,z,dx,dy,dz,power,Wavelength\n",
                "r.csv:1: column 'Wavelength' is not read; call wavelengths in nm",
            ),
            ("x,y,z,dx,dy,dz,power,lambda_um,note\n", "r.csv:1: column 'lambda_um' is not read"),
            ("0,0,0,0,0,1,1,0.55\n", "r.csv:1: a wavelength of 0.55 nm; from 1 to 1e6 nm"),
            ("x,y,z,dx,dy,dz,power,X\n", "r.csv:1: column 'x' stands twice, the second time as column 8"),
        ] {
            let e = parse_csv(text).unwrap_err().to_string();
            assert!(e.contains(message), "{e}");
        }
    }
}

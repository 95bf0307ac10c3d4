//! The result part of the seed paper's file format (Data_3): `Results[n][n]` and the rays that arrived.
//!
//! The first line holds the two sizes of the grid, rows first; then follows each row of `Results` on a line; then the number of
//! rays and the rays as in Data_1: origin (the point of arrival), direction, power.

use super::data1::{Lines, write_ray_block};
use super::grid::NumberWriter;
use super::input::read_text;
use super::rays::LightRay;
use super::{Error, ErrorKind, write_atomic};
use std::path::Path;

/// What a Data_3 file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data3 {
    /// Rows and columns of `results`.
    pub size: [usize; 2],
    /// `Results[i][j]` at `i * size[1] + j`.
    pub results: Vec<f64>,
    /// The rays that arrived.
    pub rays: Vec<LightRay>,
}

/// Writes a Data_3 file; wavelengths of rays have no place in it.
///
/// # Errors
/// When the results do not fill their size or the file cannot be written.
pub fn write_data3(path: &Path, data: &Data3) -> Result<(), Error> {
    let [rows, columns] = data.size;
    if data.results.len() != rows * columns {
        let message = format!("{} results do not fill {rows} rows of {columns}", data.results.len());
        return Err(Error::new(path, ErrorKind::Malformed(message)));
    }
    write_atomic(path, |w| {
        writeln!(w, "{rows} {columns}")?;
        let (mut line, mut numbers) = (Vec::new(), NumberWriter::default());
        for i in 0..rows {
            for (j, x) in data.results[i * columns..(i + 1) * columns].iter().enumerate() {
                line.extend((j > 0).then_some(b' '));
                numbers.append(&mut line, *x)?;
            }
            line.push(b'\n');
            w.write_all(&line)?;
            line.clear();
        }
        write_ray_block(w, &data.rays)
    })
}

/// Reads a Data_3 file; directions of rays are brought to unit length.
///
/// # Errors
/// When the file cannot be read or is not laid out as [`write_data3`] does; the message names the line.
pub fn read_data3(path: &Path) -> Result<Data3, Error> {
    let text = read_text(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    let mut lines = Lines::new(path, &text);
    let [rows, columns] = lines.read_counts("rows and columns of the results")?;
    let mut results = Vec::new();
    // Rows without columns have no lines.
    if columns > 0 {
        for _ in 0..rows {
            results.extend(lines.read_numbers(columns, "a row of results")?);
        }
    }
    let rays = lines.read_rays()?;
    lines.expect_end()?;
    Ok(Data3 { size: [rows, columns], results, rays })
}

#[cfg(test)]
mod tests {
    use super::super::rays::tests::some_rays;
    use super::*;

    #[test]
    fn results_and_rays_survive() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.data3");
        let results = (0..12).map(|i| f64::from(i) / 7.0).collect();
        let data = Data3 { size: [3, 4], results, rays: some_rays(5, false) };
        write_data3(&path, &data).unwrap();
        let back = read_data3(&path).unwrap();
        assert_eq!((back.size, &back.results, back.rays.len()), (data.size, &data.results, 5));
        write_data3(&path, &Data3::default()).unwrap();
        assert_eq!(read_data3(&path).unwrap(), Data3::default());
        assert!(write_data3(&path, &Data3 { size: [2, 2], ..Data3::default() }).is_err());
    }

    #[test]
    fn a_short_row_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.data3");
        for (text, message) in [
            ("2 3\n1 2 3\n4 5\n0\n", "data3:3: 3 finite numbers"),
            ("99999999 99999999\n", "data3:1: the file ends"),
            ("1 1\n5\n", "data3:2: the file ends where the number of rays"),
        ] {
            std::fs::write(&path, text).unwrap();
            let e = read_data3(&path).unwrap_err().to_string();
            assert!(e.contains(message), "{e}");
        }
    }
}

//! The light part of the seed paper's file format (Data_1): the number of rays, then for each ray its origin in mm, its direction
//! and its power, one ray a line, seven numbers separated by blanks.

use super::input::read_text;
use super::rays::LightRay;
use super::{Error, ErrorKind, write_atomic};
use std::io::{self, Write};
use std::path::Path;

/// Writes rays as a Data_1 file; wavelengths have no place in it.
///
/// # Errors
/// When the file cannot be written.
pub fn write_data1(path: &Path, rays: &[LightRay]) -> Result<(), Error> {
    write_atomic(path, |w| write_ray_block(w, rays))
}

/// Reads the rays of a Data_1 file, without wavelengths; directions are brought to unit length.
///
/// # Errors
/// When the file cannot be read, a line does not hold a ray, or the count is not that of the lines.
pub fn read_data1(path: &Path) -> Result<Vec<LightRay>, Error> {
    let text = read_text(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    let mut lines = Lines::new(path, &text);
    let rays = lines.read_rays()?;
    lines.expect_end()?;
    Ok(rays)
}

/// Writes the number of rays, then each on a line: origin (mm), direction, power.
pub(super) fn write_ray_block(w: &mut dyn Write, rays: &[LightRay]) -> io::Result<()> {
    writeln!(w, "{}", rays.len())?;
    for ray in rays {
        let [x, y, z, dx, dy, dz, power] = ray.numbers();
        writeln!(w, "{x} {y} {z} {dx} {dy} {dz} {power}")?;
    }
    Ok(())
}

/// Largest number of lines that a head may promise: doubles count singly up to 9e15, no disk holds that many lines.
const MOST_COUNTED: f64 = 1e15;

/// The lines of a seed file that are not blank, with their numbers.
pub(super) struct Lines<'a> {
    path: &'a Path,
    lines: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    /// Number of the line read last, from 1; 0 before any.
    at: usize,
}

impl<'a> Lines<'a> {
    /// Stands before the first line of `text`; `path` is what errors name. Blank lines are passed over, but counted.
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        // Some editors put a byte order mark in front.
        let text = text.trim_start_matches('\u{feff}');
        let lines = text.lines().enumerate().map(|(n, l)| (n + 1, l.trim())).filter(|(_, l)| !l.is_empty());
        Self { path, lines: Box::new(lines), at: 0 }
    }

    /// An error at the line read last, or the first before any.
    pub(super) fn error(&self, message: impl Into<String>) -> Error {
        // Before the first line the file is at fault as a whole; places count from one.
        Error::at_line(self.path, self.at.max(1), message)
    }

    /// Reads the next line, which must hold `count` finite numbers and nothing else; `what` names them in the error.
    pub(super) fn read_numbers(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Error> {
        let Some((n, line)) = self.lines.next() else {
            return Err(self.error(format!("the file ends where {what} should follow")));
        };
        self.at = n;
        let numbers: Vec<f64> =
            line.split_whitespace().map_while(|w| w.parse::<f64>().ok()).filter(|x| x.is_finite()).collect();
        // Counted twice: words that are no number must not make a shorter list look whole.
        if numbers.len() != count || line.split_whitespace().count() != count {
            return Err(self.error(format!("{count} finite numbers must stand here: {what}")));
        }
        Ok(numbers)
    }

    /// Reads the next line, which must hold `N` whole numbers of zero or more; `what` names them in the error.
    pub(super) fn read_counts<const N: usize>(&mut self, what: &str) -> Result<[usize; N], Error> {
        let numbers = self.read_numbers(N, what)?;
        if numbers.iter().any(|x| *x < 0.0 || x.fract() != 0.0 || *x > MOST_COUNTED) {
            return Err(self.error(format!("whole numbers must stand here: {what}")));
        }
        Ok(std::array::from_fn(|i| numbers[i] as usize))
    }

    /// Reads the number of rays and then so many lines of a ray each; an error where one is missing or holds none.
    pub(super) fn read_rays(&mut self) -> Result<Vec<LightRay>, Error> {
        let [count] = self.read_counts("the number of rays")?;
        // No capacity from the count: a file may lie about it.
        let mut rays = Vec::new();
        for _ in 0..count {
            let numbers = self.read_numbers(7, "origin, direction and power of a ray")?;
            rays.push(LightRay::from_numbers(&numbers).map_err(|m| self.error(m))?);
        }
        Ok(rays)
    }

    /// Checks that no line that is not blank is left, and refuses it by its number.
    pub(super) fn expect_end(&mut self) -> Result<(), Error> {
        // More lines than promised mean that the count or the file is wrong; which, is unknown.
        match self.lines.next() {
            None => Ok(()),
            Some((n, _)) => Err(Error::at_line(self.path, n, "more lines than the number of rays says")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rays::tests::some_rays;
    use super::*;

    #[test]
    fn rays_survive() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.data1");
        let rays = some_rays(50, false);
        write_data1(&path, &rays).unwrap();
        let back = read_data1(&path).unwrap();
        assert!(rays.iter().zip(&back).all(|(a, b)| a.origin == b.origin
            && a.power == b.power
            && (a.direction - b.direction).length() < 2e-16));
        assert_eq!(back.len(), 50);
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().next(), Some("50"));
    }

    #[test]
    fn a_byte_order_mark_is_no_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.data1");
        std::fs::write(&path, "\u{feff}1\n0 0 0 0 0 1 1\n").unwrap();
        assert_eq!(read_data1(&path).unwrap().len(), 1);
    }

    #[test]
    fn refusals_name_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.data1");
        for (text, line, message) in [
            ("", 1, "the file ends"),
            ("two\n", 1, "1 finite numbers"),
            ("2\n0 0 0 0 0 1 1\n", 2, "the file ends"),
            ("1\n\n0 0 0 0 0 1\n", 3, "7 finite numbers"),
            ("1\n0 0 0 0 0 1 1\n0 0 0 0 0 1 1\n", 3, "more lines"),
            ("1\n0 0 0 0 0 0 1\n", 2, "no length"),
            ("1e14\n", 1, "the file ends"),
            ("-1\n", 1, "whole numbers"),
        ] {
            std::fs::write(&path, text).unwrap();
            let e = read_data1(&path).unwrap_err().to_string();
            assert!(e.contains(&format!("data1:{line}: ")) && e.contains(message), "{text:?}: {e}");
        }
    }
}

//! Light rays: origin, direction, power and wavelength; lists of them written as CSV or NPZ.

use super::file_names::lower_extension;
use super::npz::write_plain_npz;
use super::{Error, ErrorKind, NpyArray, write_atomic};
use crate::math::units::WAVELENGTHS_NM;
use crate::math::{Point, Vector};
use std::fmt::Write as _;
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

/// Largest components of a direction whose squares neither vanish nor overflow.
const SQUARABLE: std::ops::Range<f64> = 1e-100..1e100;
/// A length this near to 1 is 1 but for rounding: a few units in the last place of a double.
const UNIT_ROUNDING: f64 = 1e-15;

/// Returns a unit direction in single precision that keeps its bits when it is read and written again: the nearest such one within a unit
/// in the last place of each component.
pub(super) fn stored_direction(direction: Vector) -> [f32; 3] {
    let nearest = direction.to_array().map(|x| x as f32);
    // What is read is brought to unit length, in double precision. Of two hundred directions one then rounds to another than was written.
    let read = |stored: &[f32; 3]| unit_direction(Vector::from_array(stored.map(f64::from)));
    let keeps_its_bits =
        |stored: &[f32; 3]| read(stored).is_some_and(|d| d.to_array().map(|x| x as f32) == *stored);
    if keeps_its_bits(&nearest) {
        return nearest;
    }
    let steps = |x: f32| if x == 0.0 { [x; 3] } else { [x.next_down(), x, x.next_up()] };
    let [xs, ys, zs] = nearest.map(steps);
    let neighbours = (0..27).map(|k| [xs[k % 3], ys[k / 3 % 3], zs[k / 9]]);
    let off = |stored: &[f32; 3]| read(stored).map_or(f64::INFINITY, |d| d.distance_squared(direction));
    neighbours.filter(keeps_its_bits).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(nearest)
}

/// Returns the refusal, for people, of a column or array that is named as if it held the wavelength but is not read; `None` where there is
/// none, or the wavelength is there.
pub(super) fn misnamed_wavelength<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let names: Vec<&str> = names.into_iter().collect();
    let [.., known] = COLUMNS;
    if names.iter().any(|name| name.eq_ignore_ascii_case(known)) {
        return None;
    }
    let is_meant = |name: &&&str| {
        let name = name.to_lowercase();
        ["wave", "lambda", "wl", "λ"].iter().any(|start| name.starts_with(start))
    };
    let name = names.iter().find(is_meant)?;
    Some(format!("'{name}' is not read; call wavelengths in nm '{known}', or leave them out"))
}

/// Names of the columns of a CSV file, in the order they are written.
pub(super) const COLUMNS: [&str; 8] = ["x", "y", "z", "dx", "dy", "dz", "power", "wavelength_nm"];

impl LightRay {
    /// Makes a ray of seven or eight numbers: origin (mm), direction, power and, if given, wavelength (nm); the direction is brought to
    /// unit length. An error, for people, where one is not finite, the direction zero, the power negative or the wavelength none of light.
    pub(super) fn from_numbers(numbers: &[f64]) -> Result<Self, String> {
        let triple = |k: usize| Vector::new(numbers[k], numbers[k + 1], numbers[k + 2]);
        if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
            return Err(format!("{bad} is no finite number"));
        }
        let given = triple(3);
        let direction = unit_direction(given).ok_or("the direction has no length")?;
        let power = numbers[6];
        if power < 0.0 {
            return Err(format!("a power of {power}; powers must be zero or more"));
        }
        let wavelength_nm = numbers.get(7).copied();
        if let Some(wavelength) = wavelength_nm.filter(|w| !WAVELENGTHS_NM.contains(w)) {
            return Err(format!(
                "a wavelength of {wavelength} nm; from 1 to 1e6 nm are read, and 0.55 µm are 550 nm"
            ));
        }
        Ok(Self { origin: triple(0), direction, power, wavelength_nm })
    }

    /// Origin, direction and power, as files list them.
    pub(super) fn numbers(&self) -> [f64; 7] {
        let ([x, y, z], [dx, dy, dz]) = (self.origin.to_array(), self.direction.to_array());
        [x, y, z, dx, dy, dz, self.power]
    }
}

/// Returns a direction of any length at unit length, as all readers of rays make it; `None` where it has none. One that is of unit length
/// already keeps its bits.
pub(super) fn unit_direction(given: Vector) -> Option<Vector> {
    let largest = given.abs().max_element();
    if !(largest > 0.0 && given.is_finite()) {
        return None;
    }
    // Of numbers near the ends of what a double holds the squares would be none.
    let given = if SQUARABLE.contains(&largest) { given } else { given / largest };
    let length = given.length();
    Some(if (length - 1.0).abs() < UNIT_ROUNDING { given } else { given / length })
}

/// Returns the wavelengths of a list, nm, none where no ray has one; an error, for people, where only some do.
fn listed_wavelengths(rays: &[LightRay]) -> Result<Vec<f64>, String> {
    let known: Vec<f64> = rays.iter().filter_map(|r| r.wavelength_nm).collect();
    match rays.iter().position(|r| r.wavelength_nm.is_none()) {
        Some(ray) if !known.is_empty() => Err(format!(
            "ray {} has no wavelength, where others have one; a list states it for all of its rays or for none",
            ray + 1
        )),
        _ => Ok(known),
    }
}

/// Writes a list of rays as NPZ (`.npz`) or CSV (`.csv`, `.txt`), with wavelengths where the rays have them.
///
/// # Errors
/// When the extension is another, only some rays have a wavelength, or the file cannot be written.
pub fn write_rays(path: &Path, rays: &[LightRay]) -> Result<(), Error> {
    let wavelengths = listed_wavelengths(rays).map_err(|m| Error::new(path, ErrorKind::Malformed(m)))?;
    let spectral = !wavelengths.is_empty();
    let extension = lower_extension(path);
    match extension.as_str() {
        "npz" => {
            let origin: Vec<f64> = rays.iter().flat_map(|r| r.origin.to_array()).collect();
            let direction: Vec<f64> = rays.iter().flat_map(|r| r.direction.to_array()).collect();
            let power: Vec<f64> = rays.iter().map(|r| r.power).collect();
            let n = rays.len();
            let mut arrays = vec![
                NpyArray { name: "origin", shape: vec![n, 3], data: &origin },
                NpyArray { name: "direction", shape: vec![n, 3], data: &direction },
                NpyArray { name: "power", shape: vec![n], data: &power },
            ];
            if spectral {
                arrays.push(NpyArray { name: "wavelength_nm", shape: vec![n], data: &wavelengths });
            }
            // A compressed list of rays that are all alike would be taken for one made to fill the memory.
            write_plain_npz(path, &arrays)
        }
        "csv" | "txt" => write_atomic(path, |w| {
            writeln!(w, "{}", COLUMNS[..if spectral { 8 } else { 7 }].join(","))?;
            let mut line = String::new();
            for (k, ray) in rays.iter().enumerate() {
                line.clear();
                for (i, x) in ray.numbers().iter().enumerate() {
                    // Writing to a string cannot fail.
                    let _ = write!(line, "{}{x}", if i > 0 { "," } else { "" });
                }
                if let Some(wavelength) = wavelengths.get(k) {
                    let _ = write!(line, ",{wavelength}");
                }
                writeln!(w, "{line}")?;
            }
            Ok(())
        }),
        _ => Err(Error::new(path, ErrorKind::Extension { given: extension, known: ".csv, .npz, .txt" })),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::read_rays;

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
        assert!(
            write_rays(&folder.path().join("a.ray"), &[]).unwrap_err().to_string().contains(".csv, .npz, .txt")
        );
    }

    #[test]
    fn directions_of_any_length_come_to_unit_length() {
        for scale in [1e-300, 1e-162, 1e-30, 1.0, 1e30, 1e200, 5e307] {
            let unit = unit_direction(scale * Vector::new(3.0, 0.0, -2.0)).unwrap();
            assert!((unit - Vector::new(3.0, 0.0, -2.0) / 13f64.sqrt()).length() < 3e-16, "{scale}: {unit}");
        }
        assert_eq!(unit_direction(Vector::ZERO), None);
        assert_eq!(unit_direction(Vector::new(f64::INFINITY, 0.0, 0.0)), None);
        assert_eq!(unit_direction(Vector::new(f64::NAN, 0.0, 1.0)), None);
    }

    /// A list in which only some rays have a wavelength could not be read back, or would lose those that are there.
    #[test]
    fn wavelengths_of_some_rays_alone_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for first in [true, false] {
            let rays = [some_rays(2, first), some_rays(1, !first)].concat();
            for name in ["a.csv", "a.txt", "a.npz"] {
                let path = folder.path().join(name);
                let refusal = write_rays(&path, &rays).unwrap_err().to_string();
                let ray = if first { "ray 3 has no wavelength" } else { "ray 1 has no wavelength" };
                assert!(refusal.contains(ray) && !path.exists(), "{refusal}");
            }
        }
    }
}

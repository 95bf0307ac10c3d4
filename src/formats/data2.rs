//! The facet part of the seed paper's file format (Data_2): the number of facets, then for each facet its unit normal, its four
//! corners in mm and the refractive-index ratio, one facet a line, sixteen numbers separated by blanks.

use super::facets::{Facets, flat_normal};
use super::input::read_text;
use super::{Error, ErrorKind, write_atomic};
use crate::math::{Point, Vector};
use std::path::Path;

/// One facet of a Data_2 file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Data2Facet {
    /// Unit normal of the flat facet.
    pub normal: Vector,
    /// Corners, mm; the last two are the same for a triangle.
    pub corners: [Point; 4],
    /// Refractive index in front of the facet over the one behind it.
    pub index_ratio: f64,
}

/// Writes the number of facets and each facet, in mm, on a line; numbers read back bit for bit.
pub(super) fn write(path: &Path, facets: &Facets) -> Result<(), Error> {
    let mesh = facets.mesh;
    write_atomic(path, |w| {
        writeln!(w, "{}", mesh.facets.len())?;
        for (i, facet) in mesh.facets.iter().enumerate() {
            let normal = flat_normal(mesh, i);
            write!(w, "{} {} {}", normal.x, normal.y, normal.z)?;
            for p in mesh.corners(i) {
                write!(w, " {} {} {}", p.x, p.y, p.z)?;
            }
            writeln!(w, " {}", facets.groups[facets.group_of(facet.face)].index_ratio)?;
        }
        Ok(())
    })
}

/// Reads the facets of a Data_2 file as they stand: normals are neither checked nor brought to unit length.
///
/// # Errors
/// When the file cannot be read, a line does not hold sixteen finite numbers, or the count is not that of the lines.
pub fn read_data2(path: &Path) -> Result<Vec<Data2Facet>, Error> {
    let text = read_text(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    // Some editors put a byte order mark in front.
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let (first, count) = lines
        .next()
        .and_then(|(n, l)| l.trim().parse::<usize>().ok().map(|c| (n, c)))
        // The first line is looked at by itself: without a count no later line has a meaning.
        .ok_or_else(|| Error::at_line(path, 1, "the first line must be the number of facets"))?;
    let mut facets = Vec::new();
    for (n, line) in lines {
        let numbers: Vec<f64> =
            line.split_whitespace().map_while(|w| w.parse::<f64>().ok()).filter(|x| x.is_finite()).collect();
        if numbers.len() != 16 || line.split_whitespace().count() != 16 {
            let message = "a facet is sixteen finite numbers: normal, four corners, refractive-index ratio";
            return Err(Error::at_line(path, n + 1, message));
        }
        let triple = |k: usize| Vector::new(numbers[k], numbers[k + 1], numbers[k + 2]);
        facets.push(Data2Facet {
            normal: triple(0),
            corners: [triple(3), triple(6), triple(9), triple(12)],
            index_ratio: numbers[15],
        });
    }
    // A file that was cut at the end of a line shows by its count alone.
    if facets.len() != count {
        let message = format!("the first line promises {count} facets, the file holds {}", facets.len());
        return Err(Error::at_line(path, first + 1, message));
    }
    Ok(facets)
}

//! Binary STL: the triangles as traced (each quad is two that share its diagonal), single precision.

use super::facets::Facets;
use super::{Error, ErrorKind, write_atomic};
use crate::math::{Point, Vector};
use std::path::Path;

/// Writes the triangles of all facets, mm; groups and vertex normals have no place in the format.
pub(super) fn write(path: &Path, facets: &Facets) -> Result<(), Error> {
    let mesh = facets.mesh;
    let mut triangles: Vec<[Point; 3]> = Vec::with_capacity(2 * mesh.facets.len());
    for (i, facet) in mesh.facets.iter().enumerate() {
        let [a, b, c, d] = mesh.corners(i);
        triangles.push([a, b, c]);
        if !facet.is_triangle() {
            triangles.push([a, c, d]);
        }
    }
    let count = triangle_count(triangles.len()).map_err(|m| Error::new(path, ErrorKind::Malformed(m)))?;
    write_atomic(path, |w| {
        // Readers take a header that starts with "solid" for the text form.
        let mut header = [b' '; 80];
        let title = format!("lampyris {} binary STL, mm", env!("CARGO_PKG_VERSION"));
        header[..title.len()].copy_from_slice(title.as_bytes());
        w.write_all(&header)?;
        w.write_all(&count.to_le_bytes())?;
        for [a, b, c] in &triangles {
            // Readers use the normal for shading only; zero is what the format gives to a facet without area.
            let normal: Vector = (*b - *a).cross(*c - *a).normalize_or_zero();
            for x in [normal, *a, *b, *c].iter().flat_map(|p| p.to_array()) {
                w.write_all(&(x as f32).to_le_bytes())?;
            }
            // No attributes.
            w.write_all(&[0, 0])?;
        }
        Ok(())
    })
}

/// Returns the count of triangles as the format holds it; an error, for people, where 32 bits do not.
fn triangle_count(count: usize) -> Result<u32, String> {
    u32::try_from(count)
        .map_err(|_| format!("{count} triangles; an STL file holds at most {}: export as PLY or VTU", u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_triangles_than_the_format_counts_are_refused() {
        assert_eq!(triangle_count(u32::MAX as usize), Ok(u32::MAX));
        assert!(triangle_count(u32::MAX as usize + 1).unwrap_err().starts_with("4294967296 triangles"));
    }
}

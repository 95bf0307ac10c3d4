//! Wavefront OBJ: shared positions, one normal a corner, quads as quads, a group for every part.

use super::facets::Facets;
use super::{Error, printable_line, write_atomic};
use std::path::Path;

/// Writes positions (mm), normals, quads and triangles, by group; numbers read back bit for bit. Groups without facets are left out.
pub(super) fn write(path: &Path, facets: &Facets) -> Result<(), Error> {
    let mesh = facets.mesh;
    // Rust prints the shortest decimals that read back the same bits.
    write_atomic(path, |w| {
        writeln!(w, "# lampyris {}: {} facets, mm", env!("CARGO_PKG_VERSION"), mesh.facets.len())?;
        for p in &mesh.positions {
            writeln!(w, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for v in &mesh.vertices {
            writeln!(w, "vn {} {} {}", v.normal.x, v.normal.y, v.normal.z)?;
        }
        for (group, list) in facets.groups.iter().zip(facets.by_group()) {
            if list.is_empty() {
                continue;
            }
            // A name with blanks would read as several groups.
            writeln!(w, "g {}", printable_line(&group.name).split_whitespace().collect::<Vec<_>>().join("_"))?;
            for i in list {
                let facet = &mesh.facets[i];
                let corners = if facet.is_triangle() { 3 } else { 4 };
                write!(w, "f")?;
                for &v in &facet.vertices[..corners] {
                    // Counted from one; the empty place between the slashes is for textures.
                    write!(w, " {}//{}", mesh.vertices[v as usize].position + 1, v + 1)?;
                }
                writeln!(w)?;
            }
        }
        Ok(())
    })
}

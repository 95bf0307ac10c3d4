//! Stanford PLY, binary little-endian: a vertex for every corner (position, normal, u, v in doubles), quads as quads,
//! face id, sag and part of every facet.

use super::facets::Facets;
use super::{Error, printable_line, write_atomic};
use std::path::Path;

/// Writes all vertices and facets as the head of the file says; sags only where there is one for each facet.
pub(super) fn write(path: &Path, facets: &Facets) -> Result<(), Error> {
    let mesh = facets.mesh;
    let sag = mesh.sag.len() == mesh.facets.len();
    write_atomic(path, |w| {
        writeln!(w, "ply\nformat binary_little_endian 1.0\ncomment lampyris {}, mm", env!("CARGO_PKG_VERSION"))?;
        for (k, group) in facets.groups.iter().enumerate() {
            writeln!(w, "comment part {k} {}", printable_line(&group.name))?;
        }
        writeln!(w, "element vertex {}", mesh.vertices.len())?;
        for name in ["x", "y", "z", "nx", "ny", "nz", "u", "v"] {
            writeln!(w, "property double {name}")?;
        }
        writeln!(w, "element face {}", mesh.facets.len())?;
        writeln!(w, "property list uchar uint vertex_indices\nproperty uint face_id\nproperty uint part")?;
        if sag {
            writeln!(w, "property double sag")?;
        }
        writeln!(w, "end_header")?;
        for v in &mesh.vertices {
            let p = mesh.positions[v.position as usize];
            for x in [p.x, p.y, p.z, v.normal.x, v.normal.y, v.normal.z, v.uv.x, v.uv.y] {
                w.write_all(&x.to_le_bytes())?;
            }
        }
        for (i, facet) in mesh.facets.iter().enumerate() {
            let corners = if facet.is_triangle() { 3 } else { 4 };
            w.write_all(&[corners as u8])?;
            for v in &facet.vertices[..corners] {
                w.write_all(&v.to_le_bytes())?;
            }
            w.write_all(&facet.face.0.to_le_bytes())?;
            w.write_all(&(facets.group_of(facet.face) as u32).to_le_bytes())?;
            if sag {
                w.write_all(&mesh.sag[i].to_le_bytes())?;
            }
        }
        Ok(())
    })
}

//! A mesh as bytes and back, to be kept from one run to the next.

use super::arrays::{ArrayReader, invalid, write_array, write_records};
use super::{Facet, FacetMesh, MeshVertex};
use crate::math::{FaceId, Point, Uv, Vector};
use std::io::{self, Write};

impl FacetMesh {
    /// Writes the mesh as arrays of this machine's numbers, for [`Self::read_arrays`].
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub(crate) fn write_arrays(&self, to: &mut dyn Write) -> io::Result<()> {
        write_array(to, &self.positions)?;
        write_records(to, &self.vertices, |v| {
            let ([x, y, z], [s, t]) = (v.normal.to_array(), v.uv.to_array());
            [x.to_bits(), y.to_bits(), z.to_bits(), s.to_bits(), t.to_bits(), u64::from(v.position)]
        })?;
        write_records(to, &self.facets, |&Facet { vertices: [a, b, c, d], face }| [a, b, c, d, face.0])?;
        write_array(to, &self.sag)
    }

    /// Reads a mesh written by [`Self::write_arrays`] whose face ids lie below `faces`. Numbers themselves are not checked: positions may
    /// be anything.
    ///
    /// # Errors
    /// When it cannot be read, or an index lies outside its array.
    pub(crate) fn read_arrays(from: &mut ArrayReader, faces: usize) -> io::Result<Self> {
        let positions: Vec<Point> = from.array()?;
        // The largest index of each kind is found while its record is at hand.
        let (mut last_position, mut last_vertex, mut last_face) = (0, 0, 0);
        let vertices: Vec<MeshVertex> = from.records(|&[x, y, z, s, t, position]: &[u64; 6]| {
            last_position = position.max(last_position);
            let [x, y, z, s, t] = [x, y, z, s, t].map(f64::from_bits);
            MeshVertex { position: position as u32, normal: Vector::new(x, y, z), uv: Uv::new(s, t) }
        })?;
        let facets: Vec<Facet> = from.records(|&[a, b, c, d, face]: &[u32; 5]| {
            last_vertex = a.max(b).max(c).max(d).max(last_vertex);
            last_face = face.max(last_face);
            Facet { vertices: [a, b, c, d], face: FaceId(face) }
        })?;
        let sag: Vec<f64> = from.array()?;
        // Told here once for all who index by these numbers later.
        let is_whole = (sag.is_empty() || sag.len() == facets.len())
            && (vertices.is_empty() || last_position < positions.len() as u64)
            && (facets.is_empty() || ((last_vertex as usize) < vertices.len() && (last_face as usize) < faces));
        if !is_whole {
            return Err(invalid("no mesh of this model"));
        }
        Ok(Self { positions, vertices, facets, sag })
    }
}

//! A mesh as bytes and back, to be kept from one run to the next.

use super::arrays::{ArrayReader, invalid, write_array};
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
        write_array(to, &self.vertices.iter().map(|v| v.position).collect::<Vec<u32>>())?;
        write_array(to, &self.vertices.iter().map(|v| v.normal).collect::<Vec<Vector>>())?;
        write_array(to, &self.vertices.iter().map(|v| v.uv).collect::<Vec<Uv>>())?;
        let facets: Vec<[u32; 5]> =
            (self.facets.iter()).map(|&Facet { vertices: [a, b, c, d], face }| [a, b, c, d, face.0]).collect();
        write_array(to, &facets)?;
        write_array(to, &self.sag)
    }

    /// Reads a mesh written by [`Self::write_arrays`] whose face ids lie below `faces`. Numbers themselves are not checked: positions may
    /// be anything.
    ///
    /// # Errors
    /// When it cannot be read, or an index lies outside its array.
    pub(crate) fn read_arrays(from: &mut ArrayReader, faces: usize) -> io::Result<Self> {
        let positions: Vec<Point> = from.array()?;
        let (indices, normals, uvs) = (from.array::<u32>()?, from.array::<Vector>()?, from.array::<Uv>()?);
        let facets: Vec<[u32; 5]> = from.array()?;
        let sag: Vec<f64> = from.array()?;
        // Told here once for all who index by these numbers later.
        let is_whole = normals.len() == indices.len()
            && uvs.len() == indices.len()
            && (sag.is_empty() || sag.len() == facets.len())
            && indices.iter().all(|&i| (i as usize) < positions.len())
            && facets.iter().all(|[corners @ .., face]| {
                corners.iter().all(|&v| (v as usize) < indices.len()) && (*face as usize) < faces
            });
        if !is_whole {
            return Err(invalid("no mesh of this model"));
        }
        let vertices = (indices.iter().zip(normals).zip(uvs))
            .map(|((&position, normal), uv)| MeshVertex { position, normal, uv })
            .collect();
        let facets =
            facets.iter().map(|&[a, b, c, d, face]| Facet { vertices: [a, b, c, d], face: FaceId(face) }).collect();
        Ok(Self { positions, vertices, facets, sag })
    }
}

//! A mesh as bytes and back, to be kept from one run to the next.

use super::arrays::{ArrayReader, invalid, write_array, write_records};
use super::{Facet, FacetMesh, MeshVertex};
use crate::math::Point;
use crate::math::simd::{self, Instructions, Kernel};
use bytemuck::{AnyBitPattern, NoUninit};
use std::io::{self, Write};

/// The bytes of a [`MeshVertex`], with those that it leaves between its members.
#[derive(Clone, Copy, NoUninit, AnyBitPattern)]
#[repr(C)]
struct VertexRecord {
    position: u32,
    between: u32,
    normal: [f64; 3],
    uv: [f64; 2],
}

/// The largest vertex of these facets at each corner, and their largest face.
struct LargestNumbers<'a> {
    facets: &'a [Facet],
}

impl Kernel for LargestNumbers<'_> {
    type Output = [u32; 5];

    #[inline(always)]
    fn run<I: Instructions>(self) -> [u32; 5] {
        /// Numbers of eight facets, which are compared at once.
        const LANES: usize = 40;
        let (chunks, rest) = bytemuck::cast_slice::<Facet, u32>(self.facets).as_chunks::<LANES>();
        let mut lanes = [0; LANES];
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] = chunk[lane].max(lanes[lane]);
            }
        }
        let mut largest = [0; 5];
        for (lane, number) in lanes.iter().chain(rest).enumerate() {
            largest[lane % 5] = largest[lane % 5].max(*number);
        }
        largest
    }
}

impl FacetMesh {
    /// Writes the mesh as arrays of this machine's numbers, for [`Self::read_arrays`].
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub(crate) fn write_arrays(&self, to: &mut dyn Write) -> io::Result<()> {
        write_array(to, &self.positions)?;
        write_records(to, &self.vertices, |&MeshVertex { position, normal, uv }| VertexRecord {
            position,
            between: 0,
            normal: normal.to_array(),
            uv: uv.to_array(),
        })?;
        write_array(to, &self.facets)?;
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
        let vertices: Vec<MeshVertex> = from.records_as(|vertices: &mut [VertexRecord]| {
            last_position = vertices.iter().map(|v| v.position).fold(last_position, u32::max);
        })?;
        let facets: Vec<Facet> = from.array_with(|facets: &mut [Facet]| {
            let [vertices @ .., face] = simd::dispatch(LargestNumbers { facets });
            last_vertex = vertices.into_iter().fold(last_vertex, u32::max);
            last_face = face.max(last_face);
        })?;
        let sag: Vec<f64> = from.array()?;
        // Checked here once, so that all code behind may index by these numbers.
        let is_whole = (sag.is_empty() || sag.len() == facets.len())
            && (vertices.is_empty() || (last_position as usize) < positions.len())
            && (facets.is_empty() || ((last_vertex as usize) < vertices.len() && (last_face as usize) < faces));
        if !is_whole {
            return Err(invalid("no mesh of this model"));
        }
        Ok(Self { positions, vertices, facets, sag })
    }
}

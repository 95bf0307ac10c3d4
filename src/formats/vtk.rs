//! VTK's XML files: facets as VTU, polylines as VTP, grids as VTI. Arrays are inline base64 with a 64-bit length in front,
//! little-endian, uncompressed, so that every reader of the format takes them.

use super::base64::base64;
use super::facets::Facets;
use super::{Error, ErrorKind, Grid, Polylines, printable_line, write_atomic};
use std::io::{self, Write};
use std::path::Path;

/// A typed array of a VTK file.
enum Array<'a> {
    F64(&'a [f64]),
    U32(&'a [u32]),
    I64(&'a [i64]),
    U8(&'a [u8]),
}

/// Writes a `DataArray` element, its numbers, `components` to a point or cell, in base64 behind their length in bytes.
fn write_data_array(w: &mut dyn Write, name: &str, components: usize, data: Array) -> io::Result<()> {
    let (kind, bytes) = match data {
        Array::F64(v) => ("Float64", with_length(v, f64::to_le_bytes)),
        Array::U32(v) => ("UInt32", with_length(v, u32::to_le_bytes)),
        Array::I64(v) => ("Int64", with_length(v, i64::to_le_bytes)),
        Array::U8(v) => ("UInt8", with_length(v, u8::to_le_bytes)),
    };
    let name = escape(name);
    write!(w, r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">"#)?;
    w.write_all(base64(&bytes).as_bytes())?;
    writeln!(w, "</DataArray>")
}

/// Returns the bytes of numbers behind their length, of eight bytes as `header_type` says.
fn with_length<T: Copy, const N: usize>(numbers: &[T], bytes_of: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    let length = N * numbers.len();
    let mut bytes = Vec::with_capacity(size_of::<u64>() + length);
    bytes.extend_from_slice(&(length as u64).to_le_bytes());
    numbers.iter().for_each(|&x| bytes.extend_from_slice(&bytes_of(x)));
    bytes
}

/// Text on one line as it may stand in an attribute of XML.
fn escape(text: &str) -> String {
    // Attributes of XML: the quote would end them.
    printable_line(text).replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Writes the head of a VTK file of this kind, such as `PolyData`; the caller closes it.
fn write_head(w: &mut dyn Write, kind: &str) -> io::Result<()> {
    writeln!(w, r#"<?xml version="1.0"?>"#)?;
    writeln!(w, r#"<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#)
}

/// Writes facets with normals and surface parameters of vertices, and cell data: sag (mm), normal error (degrees) and curvature (1/mm)
/// where there is one for each facet, face id, part.
pub(super) fn write_vtu(path: &Path, facets: &Facets) -> Result<(), Error> {
    let mesh = facets.mesh;
    let count = mesh.facets.len();
    let points: Vec<f64> =
        mesh.vertices.iter().flat_map(|v| mesh.positions[v.position as usize].to_array()).collect();
    let normals: Vec<f64> = mesh.vertices.iter().flat_map(|v| v.normal.to_array()).collect();
    let uv: Vec<f64> = mesh.vertices.iter().flat_map(|v| v.uv.to_array()).collect();
    let (mut corners, mut offsets, mut types) = (Vec::new(), Vec::with_capacity(count), Vec::with_capacity(count));
    for facet in &mesh.facets {
        let n = if facet.is_triangle() { 3 } else { 4 };
        corners.extend(facet.vertices[..n].iter().map(|&v| i64::from(v)));
        offsets.push(corners.len() as i64);
        // VTK_TRIANGLE and VTK_QUAD.
        types.push(if n == 3 { 5u8 } else { 9 });
    }
    let faces: Vec<u32> = mesh.facets.iter().map(|f| f.face.0).collect();
    let parts: Vec<u32> = mesh.facets.iter().map(|f| facets.group_of(f.face) as u32).collect();
    write_atomic(path, |w| {
        write_head(w, "UnstructuredGrid")?;
        let vertices = mesh.vertices.len();
        writeln!(w, r#"<UnstructuredGrid><Piece NumberOfPoints="{vertices}" NumberOfCells="{count}">"#)?;
        writeln!(w, r#"<PointData Normals="normal">"#)?;
        write_data_array(w, "normal", 3, Array::F64(&normals))?;
        write_data_array(w, "uv", 2, Array::F64(&uv))?;
        let scalars = if mesh.sag.len() == count { r#" Scalars="sag_mm""# } else { "" };
        writeln!(w, "</PointData><CellData{scalars}>")?;
        for (name, data) in [
            ("sag_mm", &mesh.sag),
            ("normal_error_deg", &facets.normal_error_deg),
            ("curvature_per_mm", &facets.curvature_per_mm),
        ] {
            // What was not measured is empty and left out.
            if data.len() == count {
                write_data_array(w, name, 1, Array::F64(data))?;
            }
        }
        write_data_array(w, "face_id", 1, Array::U32(&faces))?;
        write_data_array(w, "part", 1, Array::U32(&parts))?;
        writeln!(w, "</CellData><Points>")?;
        write_data_array(w, "Points", 3, Array::F64(&points))?;
        writeln!(w, "</Points><Cells>")?;
        write_data_array(w, "connectivity", 1, Array::I64(&corners))?;
        write_data_array(w, "offsets", 1, Array::I64(&offsets))?;
        write_data_array(w, "types", 1, Array::U8(&types))?;
        writeln!(w, "</Cells></Piece></UnstructuredGrid></VTKFile>")
    })
}

/// Writes polylines as VTP, their values as cell data, of which there must be one a line.
///
/// # Errors
/// When there are not as many values as lines, and when the file cannot be written.
pub fn write_vtp(path: &Path, lines: &Polylines) -> Result<(), Error> {
    if let Some((name, values)) = lines.values.iter().find(|(_, values)| values.len() != lines.ends.len()) {
        let message = format!("{} values of {name} for {} lines", values.len(), lines.ends.len());
        return Err(Error::new(path, ErrorKind::Malformed(message)));
    }
    let points: Vec<f64> = lines.points.iter().flat_map(|p| p.to_array()).collect();
    let connectivity: Vec<i64> = (0..lines.points.len() as i64).collect();
    let offsets: Vec<i64> = lines.ends.iter().map(|&e| e as i64).collect();
    write_atomic(path, |w| {
        write_head(w, "PolyData")?;
        writeln!(
            w,
            r#"<PolyData><Piece NumberOfPoints="{}" NumberOfVerts="0" NumberOfLines="{}" NumberOfStrips="0" NumberOfPolys="0">"#,
            lines.points.len(),
            lines.ends.len()
        )?;
        writeln!(w, "<PointData></PointData><CellData>")?;
        for (name, values) in &lines.values {
            write_data_array(w, name, 1, Array::F64(values))?;
        }
        writeln!(w, "</CellData><Points>")?;
        write_data_array(w, "Points", 3, Array::F64(&points))?;
        writeln!(w, "</Points><Lines>")?;
        write_data_array(w, "connectivity", 1, Array::I64(&connectivity))?;
        write_data_array(w, "offsets", 1, Array::I64(&offsets))?;
        writeln!(w, "</Lines></Piece></PolyData></VTKFile>")
    })
}

/// Writes a grid as VTI: one layer of cells, values and errors as cell data (a layer of no thickness has no cells to some
/// readers).
///
/// # Errors
/// When values do not fill the grid, and when the file cannot be written.
pub fn write_vti(path: &Path, grid: &Grid) -> Result<(), Error> {
    grid.check_filled(path)?;
    let [a, b] = &grid.axes;
    write_atomic(path, |w| {
        write_head(w, "ImageData")?;
        // One cell thick in z, for the readers that the doc names.
        let extent = format!("0 {} 0 {} 0 1", a.cells, b.cells);
        writeln!(
            w,
            r#"<ImageData WholeExtent="{extent}" Origin="{} {} 0" Spacing="{} {} 1"><Piece Extent="{extent}">"#,
            a.range[0],
            b.range[0],
            a.step(),
            b.step()
        )?;
        let name = grid.column();
        writeln!(w, r#"<PointData></PointData><CellData Scalars="{}">"#, escape(&name))?;
        write_data_array(w, &name, 1, Array::F64(&grid.values))?;
        if let Some(error) = &grid.error {
            write_data_array(w, "standard_error", 1, Array::F64(error))?;
        }
        for layer in &grid.layers {
            write_data_array(w, &layer.column(), 1, Array::F64(&layer.values))?;
            write_data_array(w, &format!("{}_standard_error", layer.column()), 1, Array::F64(&layer.error))?;
        }
        for (name, values) in grid.error_layers() {
            write_data_array(w, &name, 1, Array::F64(values))?;
        }
        writeln!(w, "</CellData></Piece></ImageData></VTKFile>")
    })
}

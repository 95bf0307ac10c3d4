//! glTF 2.0 in its binary form: a mesh for every part in its colour, ray paths as lines. The root node turns z up into y
//! up and millimetres into metres, as the standard asks; positions are relative to the middle of the model, so that single precision
//! costs at most 1e-7 of its size.

use super::facets::Facets;
use super::{Error, ErrorKind, printable_json, write_atomic};
use crate::math::{Point, Vector};
use serde_json::{Value, json};
use std::path::Path;

/// glTF counts in metres.
const METRES_PER_MM: f64 = 1e-3;

/// The binary chunk and what describes it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds bytes, padded to four, as a view of the buffer; `target` is glTF's code for vertices or indices. Returns the view's number.
    fn add_view(&mut self, bytes: impl Iterator<Item = u8>, target: u32) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        // Accessors must start at multiples of their number's size: four bytes.
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length, "target": target}));
        self.views.len() - 1
    }

    /// Adds vectors, at least one, one a vertex, with their bounds; returns the number of their accessor.
    fn add_vectors(&mut self, list: &[[f32; 3]]) -> usize {
        let view = self.add_view(list.iter().flatten().flat_map(|x| x.to_le_bytes()), 34962);
        // The standard asks for the bounds of positions; for normals they do no harm.
        let bound = |pick: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
            (0..3).map(|k| list.iter().fold(start, |m, p| pick(m, p[k]))).collect()
        };
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5126, "count": list.len(), "type": "VEC3",
            "min": bound(f32::min, f32::INFINITY), "max": bound(f32::max, f32::NEG_INFINITY),
        }));
        self.accessors.len() - 1
    }

    /// Adds indices of vertices; returns the number of their accessor.
    fn add_indices(&mut self, list: &[u32]) -> usize {
        let view = self.add_view(list.iter().flat_map(|x| x.to_le_bytes()), 34963);
        self.accessors
            .push(json!({"bufferView": view, "componentType": 5125, "count": list.len(), "type": "SCALAR"}));
        self.accessors.len() - 1
    }
}

/// A vector in single precision.
fn to_f32(p: Vector) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

/// Turns a display value (sRGB) in `[0, 1]` into the linear one that glTF wants.
fn linear_from_srgb(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Adds the facets of `list` to the buffer, positions relative to `middle`, vertices numbered anew; returns their mesh for the document.
fn group_mesh(buffer: &mut Buffer, facets: &Facets, list: &[usize], middle: Point, material: usize) -> Value {
    let mesh = facets.mesh;
    // Vertices that a group does not use would be sent with every group.
    let mut local = rustc_hash::FxHashMap::default();
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for &i in list {
        let corners = mesh.facets[i].vertices.map(|v| {
            *local.entry(v).or_insert_with(|| {
                // Subtracted in double precision: what is rounded to single precision is the small rest.
                let vertex = &mesh.vertices[v as usize];
                positions.push(to_f32(mesh.positions[vertex.position as usize] - middle));
                normals.push(to_f32(vertex.normal));
                positions.len() as u32 - 1
            })
        });
        triangles.extend([corners[0], corners[1], corners[2]]);
        if !mesh.facets[i].is_triangle() {
            // glTF knows triangles only; the diagonal is the one the tracer uses.
            triangles.extend([corners[0], corners[2], corners[3]]);
        }
    }
    let (position, normal) = (buffer.add_vectors(&positions), buffer.add_vectors(&normals));
    let indices = buffer.add_indices(&triangles);
    json!({"primitives": [{
        "attributes": {"POSITION": position, "NORMAL": normal}, "indices": indices, "material": material, "mode": 4
    }]})
}

/// Writes a mesh of triangles for each group that has facets, and ray paths of two points and more as lines; without both a document of
/// empty nodes.
pub(super) fn write(path: &Path, facets: &Facets) -> Result<(), Error> {
    let bounds = facets.mesh.bounds();
    // About the model's middle, where single precision has most to give; the node's translation puts it back.
    let middle = if bounds.is_empty() { Point::ZERO } else { bounds.center() };
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for (group, list) in facets.groups.iter().zip(facets.by_group()) {
        if list.is_empty() {
            continue;
        }
        let [r, g, b] = group.colour.map(linear_from_srgb);
        materials.push(json!({"name": group.name, "doubleSided": true,
            "alphaMode": if group.opacity < 1.0 { "BLEND" } else { "OPAQUE" },
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, group.opacity], "metallicFactor": 0.1, "roughnessFactor": 0.5}}));
        meshes.push(group_mesh(&mut buffer, facets, &list, middle, materials.len() - 1));
        nodes.push(json!({"name": group.name, "mesh": meshes.len() - 1}));
    }
    if let Some(paths) = facets.paths.filter(|p| p.lines().any(|line| line.len() > 1)) {
        let points: Vec<[f32; 3]> = paths.points.iter().map(|&p| to_f32(p - middle)).collect();
        let mut segments = Vec::new();
        let mut start = 0;
        for &end in &paths.ends {
            // Mode 1 draws separate lines, a pair of points each.
            segments.extend((start + 1..end).flat_map(|k| [k as u32 - 1, k as u32]));
            start = end;
        }
        materials.push(json!({"name": "ray paths", "extensions": {"KHR_materials_unlit": {}},
            "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.6, 0.1, 1.0]}}));
        let (position, indices) = (buffer.add_vectors(&points), buffer.add_indices(&segments));
        meshes.push(json!({"primitives": [{
            "attributes": {"POSITION": position}, "indices": indices, "material": materials.len() - 1, "mode": 1}]}));
        nodes.push(json!({"name": "ray paths", "mesh": meshes.len() - 1}));
    }
    let children: Vec<usize> = (0..nodes.len()).collect();
    // x → x, y → −z, z → y, and mm → m: a quarter turn about x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let shift = Vector::new(middle.x, middle.z, -middle.y) * METRES_PER_MM;
    nodes.push(json!({"name": "millimetres, z up", "children": children, "scale": [METRES_PER_MM, METRES_PER_MM, METRES_PER_MM],
        "rotation": [-half, 0.0, 0.0, half], "translation": shift.to_array()}));
    let mut document = json!({
        "asset": {"version": "2.0", "generator": concat!("lampyris ", env!("CARGO_PKG_VERSION"))},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0, "scenes": [{"nodes": [nodes.len() - 1]}], "nodes": nodes,
    });
    // The standard forbids empty arrays.
    if !meshes.is_empty() {
        document["meshes"] = meshes.into();
        document["materials"] = materials.into();
        document["buffers"] = json!([{"byteLength": buffer.bytes.len()}]);
        document["bufferViews"] = buffer.views.into();
        document["accessors"] = buffer.accessors.into();
    } else {
        remove_children_of_root(&mut document);
    }
    write_container(path, &document, &buffer.bytes)
}

/// Removes the list of children of the first node, which glTF forbids to be empty.
fn remove_children_of_root(document: &mut Value) {
    if let Some(node) = document["nodes"][0].as_object_mut() {
        node.remove("children");
    }
}

/// Bytes of the head of a GLB file: its name, version and size.
const HEAD: usize = 12;
/// Bytes in front of each chunk: its length and kind.
const CHUNK_HEAD: usize = 8;

/// Returns the size of a file whose chunks have these lengths, bytes; an error, for people, where 32 bits do not hold it.
fn container_size(lengths: impl Iterator<Item = usize>) -> Result<u32, String> {
    let size = lengths.fold(HEAD, |size, length| size.saturating_add(CHUNK_HEAD).saturating_add(length));
    u32::try_from(size)
        .map_err(|_| format!("{size} bytes; a GLB file holds at most {}: export fewer facets, or as VTU", u32::MAX))
}

/// Writes a GLB file: the document, padded here to four bytes, and the binary chunk, which the caller has padded and which is left out when
/// empty.
fn write_container(path: &Path, document: &Value, binary: &[u8]) -> Result<(), Error> {
    let mut text = printable_json(document.to_string()).into_bytes();
    while !text.len().is_multiple_of(4) {
        text.push(b' ');
    }
    let chunks: &[(&[u8], &[u8; 4])] =
        if binary.is_empty() { &[(&text, b"JSON")] } else { &[(&text, b"JSON"), (binary, b"BIN\0")] };
    let total = container_size(chunks.iter().map(|(chunk, _)| chunk.len()))
        .map_err(|m| Error::new(path, ErrorKind::Malformed(m)))?;
    write_atomic(path, |w| {
        w.write_all(b"glTF")?;
        w.write_all(&2u32.to_le_bytes())?;
        w.write_all(&total.to_le_bytes())?;
        for (chunk, kind) in chunks {
            // A chunk is shorter than the file.
            w.write_all(&(chunk.len() as u32).to_le_bytes())?;
            w.write_all(*kind)?;
            w.write_all(chunk)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_beyond_their_own_size_field_are_refused() {
        assert_eq!(container_size([100, 200].into_iter()), Ok(12 + 108 + 208));
        let largest = u32::MAX as usize - 12 - 108 - 8;
        assert_eq!(container_size([100, largest].into_iter()), Ok(u32::MAX));
        assert!(container_size([100, largest + 1].into_iter()).unwrap_err().contains("4294967296 bytes"));
        assert!(container_size([100, usize::MAX].into_iter()).is_err());
    }
}

//! Which facets turn farther from the surface normals than the requested angle.

use super::settings::Settings;
use crate::mesh::FacetMesh;
use crate::model::Model;
use serde::Serialize;

/// Share of the angle by which a facet may be above it: rounding.
const ROUNDING: f64 = 1e-9;

/// Facets of a face that break [`Settings::angle_deg`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SteepFace {
    /// Index of the placed face.
    pub face: u32,
    /// The `#id` in the file.
    pub entity: Option<u64>,
    /// How many of its facets.
    pub facets: usize,
    /// The largest angle between one of their triangles and the normal at one of its corners, degrees.
    pub largest_deg: f64,
}

/// Lists the placed faces with facets that turn farther from the surface normals at their corners than [`Settings::angle_deg`], in the
/// mesh's order; `None` when no angle was requested. Quads count by the steeper triangle; triangles without area and faces that are meshes
/// in the file are passed over.
pub(super) fn steep_faces(mesh: &FacetMesh, model: &Model, settings: &Settings) -> Option<Vec<SteepFace>> {
    let most = settings.angle_deg?;
    let faces: Vec<_> = model.placed_faces().collect();
    let mut out: Vec<SteepFace> = Vec::new();
    for (f, facet) in mesh.facets.iter().enumerate() {
        let placed = &faces[facet.face.index()];
        // Faces that are meshes in the file are as they are.
        if placed.face.is_none() {
            continue;
        }
        let (p, normal) = (mesh.corners(f), facet.vertices.map(|v| mesh.vertices[v as usize].normal));
        let cuts: &[[usize; 3]] = if facet.is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
        // A quad is traced as two triangles, and either may be the steep one.
        let steepest = |t: &[usize; 3]| {
            let flat = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).try_normalize()?;
            Some(t.iter().map(|&k| flat.angle_between(normal[k]).to_degrees()).fold(0.0, f64::max))
        };
        let angle = cuts.iter().filter_map(steepest).fold(0.0, f64::max);
        if angle <= most * (1.0 + ROUNDING) {
            continue;
        }
        // Facets of a face stand together, so that the last entry is the one to count in.
        match out.last_mut().filter(|s| s.face == facet.face.0) {
            Some(last) => {
                last.facets += 1;
                last.largest_deg = last.largest_deg.max(angle);
            }
            None => {
                out.push(SteepFace { face: facet.face.0, entity: placed.entity(), facets: 1, largest_deg: angle })
            }
        }
    }
    Some(out)
}

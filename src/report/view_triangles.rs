//! The triangles of a 3-D view: made of facets, and fewer where a report cannot show all.

use crate::formats::Facets;
use rustc_hash::FxHashMap;

/// Points, and triangles by their numbers.
type Triangles = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// Triangles whose points know their faces.
pub(super) struct FaceTriangles {
    pub(super) points: Vec<[f32; 3]>,
    /// The face of each point; 0 for all where faces do not matter.
    pub(super) faces: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Cells along the longest side of a surface when corners are first merged.
const FIRST_CELLS: f32 = 400.0;
/// By how much cells grow while triangles are too many, and how often: to ninety times the surface.
const ENLARGEMENT: f32 = 1.3;
const ENLARGEMENTS: usize = 40;

/// Makes triangles of some facets. Points are shared by position; with `by_face` within each face alone, and face comes after face.
pub(super) fn triangles_of(facets: &Facets, wanted: &[usize], by_face: bool) -> FaceTriangles {
    let mesh = facets.mesh;
    let mut wanted = wanted.to_vec();
    if by_face {
        wanted.sort_by_key(|&i| mesh.facets[i].face);
    }
    let mut index = FxHashMap::default();
    let (mut points, mut faces, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for i in wanted {
        let facet = &mesh.facets[i];
        let face = if by_face { facet.face.0 } else { 0 };
        let [a, b, c, d] = mesh.corner_positions(i).map(|p| {
            *index.entry((p, face)).or_insert_with(|| {
                points.push(mesh.positions[p as usize].as_vec3().to_array());
                faces.push(face);
                points.len() as u32 - 1
            })
        });
        triangles.push([a, b, c]);
        if !facet.is_triangle() {
            triangles.push([a, c, d]);
        }
    }
    FaceTriangles { points, faces, triangles }
}

/// Returns the points that triangles use, and no others, with the triangles by their new numbers.
pub(super) fn used_points(points: &[[f32; 3]], triangles: &[[u32; 3]]) -> Triangles {
    let mut index = FxHashMap::default();
    let mut kept = Vec::new();
    let mut of = |k: u32| {
        *index.entry(k).or_insert_with(|| {
            kept.push(points[k as usize]);
            kept.len() as u32 - 1
        })
    };
    let triangles = triangles.iter().map(|t| t.map(&mut of)).collect();
    (kept, triangles)
}

/// Merges corners of a face that lie in one cell of a grid, and enlarges the cells until at most `limit` triangles remain.
///
/// Opens no holes within a face, unlike leaving triangles out; between faces cracks of about a cell may open. Returns the size of the
/// cells too, mm: 0 where the triangles came back as they were: few enough, all in one point or, after [`ENLARGEMENTS`], too many.
pub(super) fn merge_corners(traced: FaceTriangles, limit: usize) -> (FaceTriangles, f64) {
    if traced.triangles.len() <= limit {
        return (traced, 0.0);
    }
    let FaceTriangles { points, faces, triangles } = traced;
    let span = (0..3).fold(0f32, |s, k| {
        let (lo, hi) = points.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        s.max(hi - lo)
    });
    if span == 0.0 {
        return (FaceTriangles { points, faces, triangles }, 0.0);
    }
    let mut cell = span / FIRST_CELLS;
    for _ in 0..ENLARGEMENTS {
        let mut index = FxHashMap::default();
        let mut merged: Vec<[f32; 3]> = Vec::new();
        let mut merged_faces = Vec::new();
        let of: Vec<u32> = (points.iter().zip(&faces))
            .map(|(p, face)| {
                *index.entry((p.map(|x| (x / cell).floor() as i64), *face)).or_insert_with(|| {
                    merged.push(*p);
                    merged_faces.push(*face);
                    merged.len() as u32 - 1
                })
            })
            .collect();
        let kept: Vec<[u32; 3]> = (triangles.iter())
            .map(|t| t.map(|v| of[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        if kept.len() <= limit {
            let simplified = FaceTriangles { points: merged, faces: merged_faces, triangles: kept };
            return (simplified, f64::from(cell));
        }
        cell *= ENLARGEMENT;
    }
    (FaceTriangles { points, faces, triangles }, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simplifying_keeps_the_extent_within_a_cell() {
        let n = 200u32;
        let points: Vec<[f32; 3]> = (0..n * n).map(|k| [(k % n) as f32 * 0.1, (k / n) as f32 * 0.1, 0.0]).collect();
        let quads = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
        let triangles: Vec<[u32; 3]> = quads.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        let faces = vec![0; points.len()];
        let (FaceTriangles { points: merged, triangles: kept, .. }, cell) =
            merge_corners(FaceTriangles { points, faces, triangles }, 5000);
        assert!(kept.len() <= 5000 && kept.len() > 1000 && cell > 0.0);
        let far = merged.iter().map(|p| p[0]).fold(0f32, f32::max);
        assert!(f64::from(far) > 19.9 - cell);
    }
}

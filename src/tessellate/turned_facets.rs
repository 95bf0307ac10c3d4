//! Facets that look the other way than the surface. A chord of the border that sags along the surface may pass a corner that lies
//! between it and its curve, and the facet of the three is turned over: within its tolerance, but light meets its back.

use super::face_mesh::FaceMesh;
use super::nodes::{Nodes, Position, edge_key};
use super::proof::border_chord::BorderChords;

/// Share of the tolerance below which a triangle is too thin to look anywhere.
const THIN: f64 = 1e-3;

/// Returns the chords of the border beside turned facets with a corner inside the face; `facets` are the nodes of those in `made`, in its
/// order, and `is_flipped` means that what runs counter-clockwise there is seen from inside. Some come twice; chords of edges that do not
/// bend are left out, for shorter ones would not help.
pub(super) fn turned_chords(
    made: &FaceMesh,
    facets: &[[u32; 4]],
    is_flipped: bool,
    nodes: &Nodes,
    chords: &BorderChords,
) -> Vec<[u32; 2]> {
    let mut turned = Vec::new();
    for (facet, t) in made.facets.iter().zip(facets) {
        let normals = facet.corners.map(|k| made.corners[k as usize].normal);
        let looks_back = |[a, b, c]: [u32; 3]| {
            let [p, q, r] = [a, b, c].map(|n| nodes[n].place);
            let across = if is_flipped { (r - p).cross(q - p) } else { (q - p).cross(r - p) };
            let longest = (q - p).length().max((r - q).length()).max((p - r).length());
            normals.iter().all(|n| n.dot(across) < 0.0) && across.length() > THIN * facet.tolerance * longest
        };
        // Between two edges that nearly touch, shorter chords of the one cross those of the other.
        let has_inner_corner = t.iter().any(|&n| matches!(nodes[n].position, Position::Own(_)));
        if !has_inner_corner || !looks_back([t[0], t[1], t[2]]) && !looks_back([t[0], t[2], t[3]]) {
            continue;
        }
        let sides = (0..4).map(|k| edge_key(t[k], t[(k + 1) % 4]));
        let bends = |side: &[u32; 2]| chords.get(side).is_some_and(|chord| chord.deviation > 2.0 * chord.gap);
        turned.extend(sides.filter(bends));
    }
    turned
}

//! A part under construction: faces come in with their seams and vertices numbered, and every refusal is kept.

use super::styles::Styles;
use crate::model::{Edge, EdgeId, Face, Part, VertexId};
use crate::step::geometry::Refusal;
use crate::step::part21::File;
use crate::step::trim::face::{BuiltFace, trim_loops};
use crate::step::trim::loops::Source;

/// Ends of a seam this near to a vertex of the face are that vertex, mm; gaps of the file add to it.
const SEAM_END_MM: f64 = 1e-5;
/// How many gaps they may lie apart, and the largest gap that counts, mm.
const SEAM_END_GAPS: f64 = 4.0;
/// See [`SEAM_END_GAPS`].
const LARGEST_SEAM_END_GAP_MM: f64 = 0.1;

/// A part with the account of its conversion.
#[derive(Debug, Default)]
pub(crate) struct ConvertedPart {
    pub(crate) part: Part,
    /// Faces that the file has, distinct, the refused ones included.
    pub(crate) found: usize,
    /// Why faces were refused.
    pub(crate) refused: Vec<Refusal>,
    /// Faces that were repaired, and how.
    pub(crate) repaired: Vec<Refusal>,
}

/// Names an instance of the file with a reason, for a repair.
pub(super) fn repair_note(file: &File<'_>, id: u64, reason: String) -> Refusal {
    Refusal { id, entity: file.entity_name(id), reason }
}

/// Makes a face of a built one: adds its seams as edges, and vertices for their ends where none of the face is near, to the part. `numbers`
/// are the part's edges by those of the built face, `None` for one without length.
pub(crate) fn add_face(
    built: BuiltFace,
    id: u64,
    name: String,
    part: &mut Part,
    numbers: &[Option<EdgeId>],
    styles: &Styles,
) -> Face {
    // Vertices that the face knows; ends of seams are looked up among them.
    let sources = || {
        built.loops.iter().flatten().filter_map(|u| if let Source::Edge(e) = u.source { numbers[e] } else { None })
    };
    let mut known: Vec<VertexId> = sources().flat_map(|e| part.edges[e.0 as usize].vertices).collect();
    known.sort();
    known.dedup();
    // A seam ends on edges, and these may miss their vertices themselves.
    let missed = sources().map(|e| distance_to_vertices(part, e)).fold(0.0, f64::max);
    let near = SEAM_END_MM + SEAM_END_GAPS * built.gap.max(missed).min(LARGEST_SEAM_END_GAP_MM);
    // A seam ends at vertices of the face, or shells would have a crack there.
    let seams: Vec<EdgeId> = built
        .seams
        .into_iter()
        .map(|seam| {
            // The nearest vertex: two of them may lie within the tolerance at a sliver.
            let vertices = seam.ends.map(|p| {
                let distance = |v: &VertexId| (part.vertices[v.0 as usize] - p).length();
                let found = known.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                match found.filter(|v| distance(v) <= near) {
                    Some(v) => v,
                    None => {
                        part.vertices.push(p);
                        let v = VertexId(part.vertices.len() as u32 - 1);
                        known.push(v);
                        v
                    }
                }
            });
            part.edges.push(Edge { curve: seam.curve, vertices, entity: None });
            EdgeId(part.edges.len() as u32 - 1)
        })
        .collect();
    let loops = trim_loops(built.loops, |source| match source {
        Source::Edge(e) => numbers[e],
        Source::Seam(k) => Some(seams[k]),
        Source::Nothing => None,
    });
    Face {
        name,
        entity: Some(id),
        colour: styles.colour(id),
        layer: styles.layer(id),
        surface: built.surface,
        analytic: built.analytic,
        reversed: built.reversed,
        loops,
        gap: built.gap,
    }
}

/// Returns how far the ends of an edge's curve are from its vertices at most, mm.
fn distance_to_vertices(part: &Part, edge: EdgeId) -> f64 {
    let Edge { curve, vertices, .. } = &part.edges[edge.0 as usize];
    let [a, b] = curve.domain();
    let distance = |t: f64, v: VertexId| (curve.evaluate(t) - part.vertices[v.0 as usize]).length();
    distance(a, vertices[0]).max(distance(b, vertices[1]))
}

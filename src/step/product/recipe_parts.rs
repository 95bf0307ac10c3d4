//! Solids of recipes in a part: their faces trimmed, their edges shared.

use super::numbering::{ConvertedPart, add_face};
use super::solid_recipes::{RecipeFace, SolidRecipe};
use super::styles::Styles;
use super::topology::ShapeItems;
use crate::math::{NearPoints, Point};
use crate::model::{Edge, EdgeId, Face, Part, Shell, VertexId};
use crate::nurbs::Curve;
use crate::step::geometry::{GeometryReader, Outcome, Refusal};
use crate::step::settings::Settings;
use crate::step::trim::face::{BuiltFace, build_face};
use crate::step::trim::fit::Budget;
use crate::step::trim::task::{FaceTask, TaskEdge};

/// Ends of edges of one recipe this near are one vertex, mm: the curves of a profile meet as loosely as its file says.
const SAME_VERTEX_MM: f64 = 1e-3;

/// Converts the recipes of a representation: each becomes a closed shell of the part. Counts and refusals go to `out`.
pub(super) fn convert_recipes(
    geometry: &GeometryReader<'_, '_>,
    items: &ShapeItems,
    styles: &Styles,
    settings: &Settings,
    part: &mut Part,
    out: &mut ConvertedPart,
) {
    for &id in &items.recipes {
        let solid = geometry.entity(id).and_then(|e| geometry.solid_recipe(e));
        match solid.and_then(|solid| trim_faces(geometry, id, solid, settings)) {
            // A recipe counts by its faces once they are known; one that fails counts as one.
            Ok((edges, built)) => {
                out.found += built.len();
                let name = geometry.entity(id).map_or_else(|_| String::new(), |e| e.args().name(0));
                let numbers = add_edges(edges, part);
                let faces: Vec<Face> = built
                    .into_iter()
                    // The file names the solid; its faces have no entities.
                    .map(|b| Face { entity: None, ..add_face(b, id, name.clone(), part, &numbers, styles) })
                    .collect();
                part.shells.push(Shell {
                    faces,
                    closed: true,
                    colour: styles.colour(id),
                    name,
                    ..Shell::default()
                });
            }
            Err(refusal) => {
                out.found += 1;
                out.refused.push(refusal);
            }
        }
    }
}

/// Trims every face of the solid `id`, and returns its edges and faces; one face that cannot be trimmed refuses the solid.
fn trim_faces(
    geometry: &GeometryReader<'_, '_>,
    id: u64,
    solid: SolidRecipe,
    settings: &Settings,
) -> Outcome<(Vec<Curve>, Vec<BuiltFace>)> {
    let SolidRecipe { edges, faces } = solid;
    // No `clamp`, which panics where the one setting is above the other, or no number.
    let stated = geometry.units.accuracy.unwrap_or(settings.uv_tolerance);
    let accuracy = stated.min(SAME_VERTEX_MM).max(settings.uv_tolerance);
    let mut built = Vec::with_capacity(faces.len());
    for RecipeFace { chart, same_sense, loops } in faces {
        let task = FaceTask {
            chart,
            same_sense,
            edges: loops
                .iter()
                .flatten()
                .map(|&(edge, _)| (edge, TaskEdge { curve: &edges[edge], accuracy }))
                .collect(),
            loops,
            tolerance: settings.uv_tolerance,
            accuracy,
            budget: Budget::new(settings.face_budget),
            implicit_outer: false,
        };
        let refused = |reason: String| Refusal { id, entity: geometry.file.entity_name(id), reason };
        built.push(build_face(task).map_err(refused)?);
    }
    Ok((edges, built))
}

/// Adds edges, curves in the part's coordinates, to the part, and their vertices, which are one where two lie within [`SAME_VERTEX_MM`];
/// earlier vertices of the part are not shared. Returns the edges' ids, each `Some`.
fn add_edges(edges: Vec<Curve>, part: &mut Part) -> Vec<Option<EdgeId>> {
    // Only among the vertices of this solid: another one that touches it keeps its own.
    let mut known = NearPoints::within(SAME_VERTEX_MM);
    let mut vertex = |p: Point| {
        let near = known.first(p, |k| part.vertices[k as usize], |_| true);
        let number = near.unwrap_or_else(|| {
            let next = part.vertices.len() as u32;
            known.insert(p, next);
            part.vertices.push(p);
            next
        });
        VertexId(number)
    };
    let mut numbers = Vec::with_capacity(edges.len());
    for curve in edges {
        let vertices = curve.domain().map(|t| vertex(curve.evaluate(t)));
        numbers.push(Some(EdgeId(part.edges.len() as u32)));
        part.edges.push(Edge { curve, vertices, entity: None });
    }
    numbers
}

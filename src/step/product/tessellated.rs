//! AP242 tessellated shapes: ready meshes, taken as they are.

use crate::math::{FaceId, Point, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::TessellatedFace;
use crate::step::geometry::{GeometryReader, Outcome, Refusal, within_reach};
use crate::step::part21::{Args, Entity};
use rustc_hash::FxHashSet;

/// Deepest nesting of tessellated items.
pub(super) const DEEPEST_MESHES: usize = 8;

/// What the leaves of a tessellated item gave.
#[derive(Default)]
pub(crate) struct TessellatedItems {
    pub(crate) faces: Vec<TessellatedFace>,
    pub(crate) refused: Vec<Refusal>,
    /// Items that were met: a mesh that is listed again in its place is no second one.
    visited: FxHashSet<u64>,
}

/// Names of the items that hold other tessellated items.
const SETS: [&str; 3] = ["TESSELLATED_SOLID", "TESSELLATED_SHELL", "TESSELLATED_GEOMETRIC_SET"];

/// Where a kind of leaf keeps its indices, and how triangles are listed.
struct Layout {
    /// Position, among the attributes, of the one of this name.
    pnindex: usize,
    /// Position of the link to an exact face or a surface, of a leaf that has one.
    link: Option<usize>,
    /// Whether triangles are listed as strips and fans.
    strips: bool,
}

/// Returns the layout of a leaf by its keyword; `None` for what is no leaf.
fn leaf_layout(keyword: &str) -> Option<Layout> {
    // A face has its link to an exact face before the indices, a set has none (ISO 10303-42).
    Some(match keyword {
        "TRIANGULATED_FACE" => Layout { pnindex: 5, link: Some(4), strips: false },
        "COMPLEX_TRIANGULATED_FACE" => Layout { pnindex: 5, link: Some(4), strips: true },
        "TRIANGULATED_SURFACE_SET" => Layout { pnindex: 4, link: None, strips: false },
        "COMPLEX_TRIANGULATED_SURFACE_SET" => Layout { pnindex: 4, link: None, strips: true },
        _ => return None,
    })
}

/// Returns the exact shape, or the surface, that a tessellated item says it shows; `None` where it says nothing.
pub(super) fn shown_shape<'f, 'a>(e: Entity<'f, 'a>) -> Option<Entity<'f, 'a>> {
    if let Some(layout) = leaf_layout(e.keyword()) {
        return layout.link.and_then(|at| e.args().entity(at));
    }
    SETS.iter().find_map(|kind| e.attributes(kind, 1))?.entity(1)
}

/// Returns the list of a tessellated item that holds others; `None` of any other.
pub(super) fn inner_items<'f, 'a>(e: Entity<'f, 'a>) -> Option<Args<'f, 'a>> {
    SETS.iter().find_map(|kind| e.attributes(kind, 1)).map(|set| set.list(0))
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Collects the triangulated faces of a tessellated item, and refusals of those that are broken, in `into`, each once. Points and wires
    /// give nothing.
    pub(crate) fn collect_meshes(&self, id: u64, depth: usize, into: &mut TessellatedItems) {
        let Ok(e) = self.entity(id) else { return };
        // A kilobyte can list a shell in itself a hundred times to any depth.
        if !into.visited.insert(id) {
            return;
        }
        if e.is_a("REPOSITIONED_TESSELLATED_ITEM") {
            into.refused.push(Refusal::new(e, "a mesh with a place of its own is not converted"));
        } else if let Some(layout) = leaf_layout(e.keyword()) {
            match self.triangles(e, &layout) {
                Ok(mesh) => {
                    let name = e.args().name(0);
                    into.faces.push(TessellatedFace { name, entity: Some(id), colour: None, layer: None, mesh });
                }
                Err(refusal) => into.refused.push(refusal),
            }
        } else if let Some(list) = inner_items(e) {
            if depth >= DEEPEST_MESHES {
                into.refused.push(Refusal::new(e, "meshes are nested too deeply"));
            } else {
                let items = list.refs().unwrap_or_else(|| {
                    into.refused.push(Refusal::no_reference(e));
                    list.ids()
                });
                for item in items {
                    self.collect_meshes(item, depth + 1, into);
                }
            }
        } else if e.keywords().any(|k| k.contains("TRIANGULATED")) {
            into.refused.push(Refusal::new(e, "this kind of mesh is not converted"));
        }
    }

    /// Returns the triangles of a leaf as a mesh, mm, with the file's normals where it gives them, else flat ones; triangles without area
    /// are left out, and a leaf without others is refused, as is one with a triangle that cannot be read or a corner that is too far away.
    fn triangles(&self, e: Entity<'f, 'a>, layout: &Layout) -> Outcome<FacetMesh> {
        let args = e.args();
        let list = self.resolve(e, args.id(1), "list of coordinates")?;
        let rows = list.attributes("COORDINATES_LIST", 1).map(|a| a.list(1));
        let Some(rows) = rows else { return Err(Refusal::new(list, "is no list of coordinates")) };
        let triple = |rows: Args<'f, 'a>, i: usize| -> Option<Vector> {
            let row = rows.list(i);
            Some(Vector::new(row.real(0)?, row.real(1)?, row.real(2)?)).filter(|v| v.is_finite())
        };
        let index = args.list(layout.pnindex);
        // The local number of a point, from 1, to the row of its coordinates, from 0.
        let row_of = |local: usize| -> Option<usize> {
            let row = if index.len() == 0 { local } else { index.count(local.checked_sub(1)?)? };
            row.checked_sub(1).filter(|r| *r < rows.len())
        };
        let corners = corner_numbers(args, layout)
            .ok_or_else(|| Refusal::new(e, "a triangle, strip or fan is not a list of three points or more"))?;
        let normals = args.list(3);
        let normal_of = |local: usize| -> Option<Vector> {
            // One normal for all means a flat face.
            let at = if normals.len() == 1 { 0 } else { local.checked_sub(1)? };
            triple(normals, at)?.try_normalize()
        };
        let mut mesh = FacetMesh::default();
        let mut position_of = rustc_hash::FxHashMap::<usize, u32>::default();
        for triangle in corners {
            let mut found = [None; 3];
            for (slot, local) in found.iter_mut().zip(triangle) {
                *slot = row_of(local).and_then(|row| Some((row, triple(rows, row)? * self.units.length)));
            }
            let [Some(a), Some(b), Some(c)] = found else {
                return Err(Refusal::new(e, "a triangle refers to a point that is not in the list"));
            };
            for (_, corner) in [a, b, c] {
                within_reach(e, corner)?;
            }
            // A triangle without an area shades nothing and has no normal to give.
            let Some(flat) = (b.1 - a.1).cross(c.1 - a.1).try_normalize() else { continue };
            let first = mesh.vertices.len() as u32;
            // Positions are shared by the row of the file, vertices are not: each has the normal of its triangle.
            for ((row, p), local) in [a, b, c].into_iter().zip(triangle) {
                let position = *position_of.entry(row).or_insert_with(|| {
                    mesh.positions.push(p as Point);
                    mesh.positions.len() as u32 - 1
                });
                let normal = normal_of(local).unwrap_or(flat);
                mesh.vertices.push(MeshVertex { position, normal, uv: Uv::ZERO });
            }
            // A triangle is a facet whose last corner stands twice.
            mesh.facets.push(Facet { vertices: [first, first + 1, first + 2, first + 2], face: FaceId(0) });
        }
        if mesh.facets.is_empty() {
            return Err(Refusal::new(e, "holds no triangle with an area"));
        }
        Ok(mesh)
    }
}

/// Returns the local point numbers, from 1, of all triangles: listed, or unrolled from strips and fans. `None` where a triangle, strip or
/// fan is broken: what is left out would be a hole, and what follows in a strip would be turned around.
fn corner_numbers(args: Args<'_, '_>, layout: &Layout) -> Option<Vec<[usize; 3]>> {
    let numbers = |list: Args<'_, '_>| -> Option<Vec<usize>> {
        let all: Option<Vec<usize>> = (0..list.len()).map(|i| list.count(i)).collect();
        // An empty one is no loss.
        all.filter(|numbers| numbers.is_empty() || numbers.len() >= 3)
    };
    let rows = |at: usize| -> Option<Vec<Vec<usize>>> {
        let list = args.list(at);
        (0..list.len()).map(|i| numbers(list.list(i))).collect()
    };
    if !layout.strips {
        return rows(layout.pnindex + 1)?.into_iter().map(|row| row.try_into().ok()).collect();
    }
    let mut triangles = Vec::new();
    for strip in rows(layout.pnindex + 1)? {
        for (k, w) in strip.windows(3).enumerate() {
            // Every other triangle of a strip turns the other way.
            triangles.push(if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
        }
    }
    for fan in rows(layout.pnindex + 2)? {
        if let [hub, rim @ ..] = &fan[..] {
            triangles.extend(rim.windows(2).map(|w| [*hub, w[0], w[1]]));
        }
    }
    Some(triangles)
}

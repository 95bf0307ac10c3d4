//! Parts: shells of faces over common edges and vertices.

use super::edge::{Edge, EdgeId};
use super::{Analytic, Colour, Face, TessellatedFace};
use crate::math::Point;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Index into [`super::Model::parts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PartId(pub u32);

/// A shape in its own coordinates: faces share its edges and vertices.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Part {
    /// Name of the product, empty when it had none.
    pub name: String,
    /// Colour of the whole part.
    pub colour: Option<Colour>,
    /// Positions of the vertices, mm.
    pub vertices: Vec<Point>,
    /// Edges, each used by one, two or more faces.
    pub edges: Vec<Edge>,
    /// Connected sets of faces.
    pub shells: Vec<Shell>,
    /// Faces that are meshes in the file.
    pub tessellated: Vec<TessellatedFace>,
}

/// A set of faces.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Shell {
    /// The faces, in the file's order.
    pub faces: Vec<Face>,
    /// Whether the file says that the shell is closed (bounds a solid or a void).
    pub closed: bool,
    /// Whether it bounds a void of the solid whose shell comes before it.
    pub void: bool,
    /// Colour of the shell or solid.
    pub colour: Option<Colour>,
    /// Name of the shell or solid, empty when it had none.
    pub name: String,
}

/// Share of a surface's size within which control points are the same: far more than rounding, far less than any wall is thick.
const SAME: f64 = 1e-9;

impl Shell {
    /// Whether all faces lie on each other, two and two, back to back, so that there is nothing between them: they have the same edges, and
    /// are planes or have one surface. False where other faces enclose nothing either.
    pub fn encloses_nothing(&self) -> bool {
        let mut alone: FxHashMap<Vec<(EdgeId, bool)>, Vec<&Face>> = FxHashMap::default();
        for face in &self.faces {
            let own = border(face, false);
            if own.is_empty() {
                return false;
            }
            let facing = alone.get_mut(&border(face, true));
            let back = facing.and_then(|others| {
                let k = others.iter().position(|other| are_surfaces_one(face, other))?;
                Some(others.swap_remove(k))
            });
            if back.is_none() {
                alone.entry(own).or_default().push(face);
            }
        }
        !self.faces.is_empty() && alone.values().all(Vec::is_empty)
    }
}

/// Returns the edges of a face, sorted, each with whether the face, seen from outside, or from inside if `turned`, runs against it.
fn border(face: &Face, turned: bool) -> Vec<(EdgeId, bool)> {
    let uses = face.loops.iter().flat_map(|l| &l.uses);
    let mut border: Vec<(EdgeId, bool)> =
        uses.filter_map(|u| Some((u.edge?, (u.reversed != face.reversed) != turned))).collect();
    border.sort_unstable();
    border
}

/// Whether two faces with one border, of which they lie on different sides, are on one surface: planes always are.
fn are_surfaces_one(a: &Face, b: &Face) -> bool {
    let are_planes = [a, b].iter().all(|face| matches!(face.analytic, Analytic::Plane { .. }));
    let (p, q) = (&a.surface.points, &b.surface.points);
    let same = SAME * a.surface.bounds().diagonal();
    let are_points_one = || p.len() == q.len() && p.iter().zip(q).all(|(p, q)| (*p - *q).length() <= same);
    are_planes || a.reversed != b.reversed && a.surface.degree == b.surface.degree && are_points_one()
}

impl Part {
    /// Ranges of [`Part::shells`], one a solid (its shell and those of its voids) or sheet; empty without shells. Ready meshes count as one
    /// more solid behind these, which is not in the list.
    pub fn solids(&self) -> Vec<Range<usize>> {
        let mut solids: Vec<Range<usize>> = Vec::new();
        for (i, shell) in self.shells.iter().enumerate() {
            match solids.last_mut() {
                // A void belongs to the solid before it; one without a solid before it stands alone.
                Some(solid) if shell.void => solid.end = i + 1,
                _ => solids.push(i..i + 1),
            }
        }
        solids
    }

    /// Number of faces, tessellated ones included.
    pub fn face_count(&self) -> usize {
        self.shells.iter().map(|s| s.faces.len()).sum::<usize>() + self.tessellated.len()
    }
}

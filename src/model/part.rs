//! Parts: shells of faces over common edges and vertices.

use super::edge::Edge;
use super::{Colour, Face, TessellatedFace};
use crate::math::Point;
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
    /// Whether the shell is closed: it bounds a solid or a void, or the file calls it closed and it has no border.
    pub closed: bool,
    /// Whether it bounds a void of the solid whose shell comes before it.
    pub void: bool,
    /// Colour of the shell or solid.
    pub colour: Option<Colour>,
    /// Name of the shell or solid, empty when it had none.
    pub name: String,
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

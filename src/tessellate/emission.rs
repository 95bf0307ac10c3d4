//! Facets of nodes become facets of corners: outward normals, and corners apart where a crease or a pole has several normals.

use super::face_mesh::{Corner, FaceMesh, MeshedFacet};
use super::face_surface::FaceSurface;
use super::nodes::{Nodes, ProvedFacet};
use crate::math::{Uv, Vector};
use rustc_hash::FxHashMap;

/// Turns facets of nodes into facets of corners with outward normals.
pub(super) struct Emission<'e, 's, 'a> {
    surface: &'s FaceSurface<'a>,
    nodes: &'e Nodes,
    /// Corners by node and the side of each crease on which their facet lies.
    corners: FxHashMap<(u32, [CreaseSide; 2]), u32>,
    made: FaceMesh,
}

/// Where a facet lies beside a crease that one of its corners is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum CreaseSide {
    NoCrease,
    Below,
    Above,
}

impl<'e, 's, 'a> Emission<'e, 's, 'a> {
    /// Begins the facets of a face, none so far; `nodes` are those that facets will name.
    pub(super) fn new(surface: &'s FaceSurface<'a>, nodes: &'e Nodes) -> Self {
        Self { surface, nodes, corners: FxHashMap::default(), made: FaceMesh::default() }
    }

    /// Returns the corners and facets made; what else a face's mesh holds is left empty for the caller.
    pub(super) fn finish(self) -> FaceMesh {
        self.made
    }

    /// Adds a facet, turned around on a flipped surface; a triangle repeats its last node. `pole` is the index of the corner at a pole,
    /// which is not shared with other facets, and the parameters that it gets there.
    pub(super) fn add_facet(&mut self, facet: &ProvedFacet<4>, pole: Option<(usize, Uv)>) {
        let nodes = facet.nodes;
        let uv = nodes.map(|n| self.nodes[n].uv);
        let inside = 0.25 * (uv[0] + uv[1] + uv[2] + uv[3]);
        // At a pole every facet has a corner of its own, for normals there differ from facet to facet.
        let mut corner = |k: usize| match pole {
            Some((at, uv)) if k == at => self.new_corner(nodes[at], uv, inside),
            _ => self.shared_corner(nodes[k], inside),
        };
        let [a, b, c] = [0, 1, 2].map(&mut corner);
        let d = if nodes[3] == nodes[2] { c } else { corner(3) };
        // On a flipped surface what runs counterclockwise in parameters runs clockwise seen from outside.
        let corners = if !self.surface.is_flipped() {
            [a, b, c, d]
        } else if c == d {
            [a, c, b, b]
        } else {
            [a, d, c, b]
        };
        self.fill_normals(corners);
        self.made.facets.push(MeshedFacet { corners, bound: facet.bound, tolerance: facet.tolerance });
    }

    /// Returns the corner at a node for facets on one side of its creases, made at first use. `inside` are parameters within the facet.
    fn shared_corner(&mut self, node: u32, inside: Uv) -> u32 {
        let uv = self.nodes[node].uv;
        let sides = crease_sides(self.surface, uv, inside);
        if let Some(&known) = self.corners.get(&(node, sides)) {
            return known;
        }
        let corner = self.new_corner(node, uv, inside);
        self.corners.insert((node, sides), corner);
        corner
    }

    /// Adds a corner with the surface's normal on the side of `inside`, or [`NO_NORMAL`] where it has none; returns its number.
    fn new_corner(&mut self, node: u32, uv: Uv, inside: Uv) -> u32 {
        let normal = self.surface.normal_towards(uv, inside).unwrap_or(NO_NORMAL);
        self.made.corners.push(Corner { position: self.nodes[node].position, normal, uv });
        (self.made.corners.len() - 1) as u32
    }

    /// Gives corners without a normal that of the facet `corners`, +z for one without area.
    fn fill_normals(&mut self, corners: [u32; 4]) {
        if corners.iter().all(|&n| self.made.corners[n as usize].normal != NO_NORMAL) {
            return;
        }
        // From the corners' places on the surface, not from those of the border, which may be off by the file's
        // gap.
        let p = corners.map(|n| self.surface.point(self.made.corners[n as usize].uv));
        let n = (p[1] - p[0]).cross(p[2] - p[0]) + (p[2] - p[0]).cross(p[3] - p[0]);
        // A facet without area shades nothing: any normal will do.
        let n = n.try_normalize().unwrap_or(Vector::Z);
        for k in corners {
            let normal = &mut self.made.corners[k as usize].normal;
            if *normal == NO_NORMAL {
                *normal = n;
            }
        }
    }
}

/// Stands for a normal that the surface does not have, until the corner's first facet gives one.
const NO_NORMAL: Vector = Vector::ZERO;

/// Tells for the creases of constant u and of constant v through `uv` on which side `inside` lies.
fn crease_sides(surface: &FaceSurface<'_>, uv: Uv, inside: Uv) -> [CreaseSide; 2] {
    if !surface.is_creased() {
        return [CreaseSide::NoCrease; 2];
    }
    let on = surface.on_creases(uv);
    [0, 1].map(|d| match on[d] {
        None => CreaseSide::NoCrease,
        Some(crease) if inside[d] < crease => CreaseSide::Below,
        Some(_) => CreaseSide::Above,
    })
}

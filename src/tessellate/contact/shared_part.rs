//! A guest that lies on its carrier in part: the carrier's facets where both are, its own elsewhere.

use super::closure::SideCounts;
use super::guest::Guest;
use crate::math::Point;
use crate::tessellate::assemble::PartMesh;
use crate::tessellate::face_mesh::{FaceMesh, MeshedFacet};
use crate::tessellate::nodes::Position;
use rustc_hash::FxHashMap;

/// Joins a guest's own facets, which keep to the carrier's border, with those it takes over. `None` where the two do not meet side on side.
pub(super) fn joined(
    guest: &Guest<'_, '_>,
    carrier: &Guest<'_, '_>,
    own: &FaceMesh,
    taken: &FaceMesh,
    mesh: &PartMesh,
    glue: f64,
) -> Option<FaceMesh> {
    let mut out = Union { made: FaceMesh::default(), own: FxHashMap::default(), shared: &mesh.shared };
    let is_outside = |f: &&MeshedFacet| {
        let places = f.corners.map(|c| out.place(own, own.corners[c as usize].position));
        let count = if f.corners[2] == f.corners[3] { 3 } else { 4 };
        let middle = places[..count].iter().sum::<Point>() / count as f64;
        let middle = guest.face.frame.point(middle);
        let (uv, away) = carrier.face.project(middle);
        // As for what is taken over: the facet's own sag and the glue distance lie between its middle and the other face.
        let (_, sag) = guest.face.project(middle);
        away > sag + glue || !carrier.contains(uv)
    };
    let outside: Vec<MeshedFacet> = own.facets.iter().filter(is_outside).copied().collect();
    out.add(own, &outside);
    out.add(taken, &taken.facets);
    // The border is what it was, and inside it all facets meet two by two.
    let border = SideCounts::of_facets(own).border(|p| out.position(own, p))?;
    let is_whole = SideCounts::of_facets(&out.made).fill(&border);
    is_whole.then(|| FaceMesh { coincident: own.coincident.clone(), ..out.made })
}

/// Facets of several meshes of one face; own positions in one place are one.
struct Union<'s> {
    made: FaceMesh,
    /// Own positions by the bits of their places: both meshes have the imprinted corners from the same points of the other face.
    own: FxHashMap<[u64; 3], u32>,
    shared: &'s [Point],
}

impl Union<'_> {
    /// Returns the place of a position of `mesh`, in the part's coordinates.
    fn place(&self, mesh: &FaceMesh, position: Position) -> Point {
        match position {
            Position::Shared(p) => self.shared[p as usize],
            Position::Own(p) => mesh.own[p as usize],
        }
    }

    /// Returns the position here for one of `mesh`; `None` for one of its own that was not added.
    fn position(&self, mesh: &FaceMesh, position: Position) -> Option<Position> {
        match position {
            Position::Shared(_) => Some(position),
            Position::Own(p) => {
                self.own.get(&mesh.own[p as usize].to_array().map(f64::to_bits)).map(|&p| Position::Own(p))
            }
        }
    }

    /// Adds facets of `mesh` with the corners that they have; bounds and tolerances stay.
    fn add(&mut self, mesh: &FaceMesh, facets: &[MeshedFacet]) {
        let mut corners: FxHashMap<u32, u32> = FxHashMap::default();
        for facet in facets {
            let moved = facet.corners.map(|c| *corners.entry(c).or_insert_with(|| self.add_corner(mesh, c)));
            self.made.facets.push(MeshedFacet { corners: moved, ..*facet });
        }
    }

    /// Copies a corner of `mesh` and returns its number here; positions that belong to a face alone are merged where they are bitwise
    /// equal.
    fn add_corner(&mut self, mesh: &FaceMesh, corner: u32) -> u32 {
        let mut corner = mesh.corners[corner as usize];
        if let Position::Own(p) = corner.position {
            let place = mesh.own[p as usize];
            let next = self.made.own.len() as u32;
            let here = *self.own.entry(place.to_array().map(f64::to_bits)).or_insert(next);
            if here == next {
                self.made.own.push(place);
            }
            corner.position = Position::Own(here);
        }
        self.made.corners.push(corner);
        self.made.corners.len() as u32 - 1
    }
}

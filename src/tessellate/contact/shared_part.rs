//! A guest that lies on its carriers in part: their facets where both are, its own elsewhere.

use super::closure::SideCounts;
use super::guest::Guest;
use crate::math::Point;
use crate::tessellate::assemble::PartMesh;
use crate::tessellate::face_mesh::{FaceMesh, MeshedFacet};
use crate::tessellate::nodes::Position;
use rustc_hash::FxHashMap;

/// Joins a guest's own facets, which keep to its carriers' borders, with those it takes over from each, in the same order. `None` where
/// they do not meet side on side.
pub(super) fn joined(
    guest: &Guest<'_, '_>,
    carriers: &[Guest<'_, '_>],
    own: &FaceMesh,
    taken: &[FaceMesh],
    mesh: &PartMesh,
    glue: f64,
) -> Option<FaceMesh> {
    let mut out = Union {
        made: FaceMesh::default(),
        own: FxHashMap::default(),
        same: same_places(guest, carriers, glue),
        shared: &mesh.shared,
    };
    let is_outside = |f: &&MeshedFacet| {
        let places = f.corners.map(|c| out.place(own, own.corners[c as usize].position));
        let count = if f.corners[2] == f.corners[3] { 3 } else { 4 };
        let middle = places[..count].iter().sum::<Point>() / count as f64;
        let middle = guest.face.frame.point(middle);
        let (_, sag) = guest.face.project(middle);
        carriers.iter().all(|carrier| {
            let (uv, away) = carrier.face.project(middle);
            // As for what is taken over: the facet's own sag and the glue distance lie between its middle and the other face.
            away > sag + glue || !carrier.contains(uv)
        })
    };
    let outside: Vec<MeshedFacet> = own.facets.iter().filter(is_outside).copied().collect();
    out.add(own, &outside);
    taken.iter().for_each(|taken| out.add(taken, &taken.facets));
    // The border is what it was, and inside it all facets meet two by two.
    let border = SideCounts::of_facets(own).border(|p| out.position(own, p))?;
    let is_whole = SideCounts::of_facets(&out.made).fill(&border);
    is_whole.then(|| FaceMesh { coincident: own.coincident.clone(), ..out.made })
}

/// Returns, by the bits of its place on the guest, the place of the corner of another carrier that stands for a carrier's corner within
/// `glue` mm of it: the first, as in the guest's own facets.
fn same_places(guest: &Guest<'_, '_>, carriers: &[Guest<'_, '_>], glue: f64) -> FxHashMap<[u64; 3], Point> {
    let mut same = FxHashMap::default();
    let local = |c: &Guest<'_, '_>, p: &Point| guest.face.frame.local_point(c.face.frame.point(*p));
    let mut known: Vec<Point> = Vec::new();
    let near = glue / guest.face.frame.scale.abs();
    for carrier in carriers.iter().filter(|_| carriers.len() > 1) {
        let places: Vec<Point> = carrier.places.iter().map(|p| local(carrier, p)).collect();
        for &p in &places {
            let first = known.iter().copied().filter(|q| (*q - p).length() <= near);
            if let Some(first) = first.min_by(|a, b| (*a - p).length().total_cmp(&(*b - p).length())) {
                same.insert(bits(p), first);
            }
        }
        known.extend(places.into_iter().filter(|p| !same.contains_key(&bits(*p))));
    }
    same
}

/// Names a place.
fn bits(p: Point) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

/// Facets of several meshes of one face; own positions in one place are one.
struct Union<'s> {
    made: FaceMesh,
    /// Own positions by the bits of their places: both meshes have the imprinted corners from the same points of the other face.
    own: FxHashMap<[u64; 3], u32>,
    /// Places that stand for others, by the bits of these.
    same: FxHashMap<[u64; 3], Point>,
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
                self.own.get(&bits(self.standing_for(mesh.own[p as usize]))).map(|&p| Position::Own(p))
            }
        }
    }

    /// Returns the place that stands for another: mostly itself.
    fn standing_for(&self, place: Point) -> Point {
        self.same.get(&bits(place)).copied().unwrap_or(place)
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
            let place = self.standing_for(mesh.own[p as usize]);
            let next = self.made.own.len() as u32;
            let here = *self.own.entry(bits(place)).or_insert(next);
            if here == next {
                self.made.own.push(place);
            }
            corner.position = Position::Own(here);
        }
        self.made.corners.push(corner);
        self.made.corners.len() as u32 - 1
    }
}

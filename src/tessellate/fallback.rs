//! The last resort for a face whose parameter plane gives nothing, such as one whose chords lie beside its surface or on one line
//! there: its border alone, seen along its mean normal in space.
//!
//! The border's own points are kept, so that neighbours still meet it. Nothing is proved; how far it lies from the surface is
//! sampled ([`super::RepairedFace::reached_mm`]).

use super::border::edge_chords::PLACES;
use super::border::edges::Division;
use super::border::polygons;
use super::face::FaceInput;
use super::face_mesh::{Corner, FaceMesh, MeshedFacet};
use super::flooding::faces_inside;
use super::foot_search;
use super::nodes::{Position, edge_key};
use crate::math::{Point, Uv, Vector};
use crate::model::{Face, Part};
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use rustc_hash::FxHashMap;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::iter;

/// Coordinates below this, which spade refuses, are zero.
const ZERO: f64 = 1e-30;

/// A corner of the border.
#[derive(Clone, Copy)]
struct BorderCorner {
    position: Position,
    place: Point,
    uv: Uv,
    /// Where it is seen in the plane.
    at: Point2<f64>,
}

impl HasPosition for BorderCorner {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Meshes a face from its border alone, without a proof: every bound is infinite. `None` when no loop has three different places, or none
/// of the two ways below gives triangles.
pub(super) fn border_alone(input: &FaceInput<'_, '_>) -> Option<FaceMesh> {
    filled_border(input, |loops| planar_triangulation(loops).or_else(|| zigzag_triangles(loops)))
}

/// Meshes a face from its border alone, its loops filled by `fill` with triangles that run around as they do.
fn filled_border(
    input: &FaceInput<'_, '_>,
    fill: impl Fn(&mut [Vec<BorderCorner>]) -> Option<Vec<[BorderCorner; 3]>>,
) -> Option<FaceMesh> {
    let FaceInput { part, face, surface, divisions, shared, .. } = *input;
    let border =
        polygons::build(part, &polygons::loops(face), surface, divisions, &polygons::ImprintedPoints::NONE);
    let corner = |v: &polygons::PolygonVertex| {
        let place = match v.position {
            Position::Shared(p) => shared[p as usize],
            Position::Own(p) => border.own[p as usize],
        };
        let corner = || {
            let is_there = surface.point(v.uv).distance(place) <= surface.tolerance(v.uv);
            let uv = if is_there { v.uv } else { foot_search::nearest_parameters(surface.spline, place) };
            BorderCorner { position: v.position, place, uv, at: Point2::new(0.0, 0.0) }
        };
        place.is_finite().then(corner)
    };
    // Corners that fall together would be sides of no length, which the triangulation refuses.
    let mut loops: Vec<Vec<BorderCorner>> =
        border.polygons.iter().map(|r| r.iter().filter_map(corner).collect()).collect();
    for ring in &mut loops {
        ring.dedup_by_key(|c| c.place);
        if ring.len() > 1 && ring[0].place == ring[ring.len() - 1].place {
            ring.pop();
        }
    }
    loops.retain(|r| r.len() > 2);
    let triangles = fill(&mut loops).filter(|triangles| !triangles.is_empty())?;
    let mut out = FaceMesh { own: border.own, coincident: border.coincident, ..FaceMesh::default() };
    for mut t in triangles {
        // Outside is decided by the loops, along which neighbours run the other way: a fold between chords that cross has other normals.
        if surface.is_flipped() {
            t.swap(1, 2);
        }
        // Where the surface has no normal the triangle's does, so that corners are not shared; one without area shades
        // nothing.
        let flat = (t[1].place - t[0].place).cross(t[2].place - t[0].place).try_normalize().unwrap_or(Vector::Z);
        let first = out.corners.len() as u32;
        out.corners.extend(t.map(|c| {
            let normal = surface.normal(c.uv).unwrap_or(flat);
            Corner { position: c.position, normal, uv: c.uv }
        }));
        let tolerance = t.iter().map(|c| surface.tolerance(c.uv)).fold(f64::INFINITY, f64::min);
        let corners = [first, first + 1, first + 2, first + 2];
        out.facets.push(MeshedFacet { corners, bound: f64::INFINITY, tolerance });
    }
    Some(out)
}

/// As [`border_alone`], where the facets lie within the tolerance of the surface, judged by samples; `None` elsewhere, and where no
/// plane shows the border without a crossing, unless it is that of a strip between two edges.
pub(super) fn border_within_tolerance(input: &FaceInput<'_, '_>) -> Option<FaceMesh> {
    let FaceInput { part, face, surface, divisions, shared, .. } = *input;
    let is_strip = matches!(&face.loops[..], [only] if only.uses.len() == 2);
    let mesh = filled_border(input, |loops| {
        planar_triangulation(loops).or_else(|| if is_strip { zigzag_triangles(loops) } else { None })
    })?;
    let position = |corner: u32| mesh.corners[corner as usize].position;
    let place = |corner: u32| match position(corner) {
        Position::Shared(p) => shared[p as usize],
        Position::Own(p) => mesh.own[p as usize],
    };
    let sides = |facet: &MeshedFacet| {
        let [a, b, c, _] = facet.corners;
        [[a, b, c], [b, c, a], [c, a, b]]
    };
    let sags = chord_sags(part, face, divisions);
    let is_near = |facet: &MeshedFacet| {
        // What is low over a chord of the border is near to its edge, and so to the surface, also where no foot is found on it.
        let is_low = |[a, b, c]: [u32; 3]| {
            let (Position::Shared(from), Position::Shared(to)) = (position(a), position(b)) else { return false };
            let height = distance_to_chord(place(c), &[place(a), place(b)]);
            sags.get(&edge_key(from, to)).is_some_and(|sag| sag + height <= facet.tolerance)
        };
        let is_foot = |uv: Uv, p: Point| surface.point(uv).distance(p) <= facet.tolerance;
        let corners = facet.corners;
        let of_surface = |p: Point| {
            // Mostly found from a corner; a search from everywhere takes far longer.
            let starts = corners.iter().map(|&corner| mesh.corners[corner as usize].uv);
            starts.map(|uv| foot_search::project(surface.spline, p, uv)).any(|uv| is_foot(uv, p))
                || is_foot(foot_search::nearest_parameters(surface.spline, p), p)
        };
        let [a, b, c] = [0, 1, 2].map(|k: usize| place(corners[k]));
        sides(facet).into_iter().any(is_low)
            || [a + b, b + c, c + a].into_iter().all(|sum| of_surface(0.5 * sum)) && of_surface((a + b + c) / 3.0)
    };
    mesh.facets.iter().all(is_near).then_some(mesh)
}

/// Returns how far the edges of a face lie from their chords at most, mm, at [`PLACES`] of each, by the shared positions of its ends.
fn chord_sags(part: &Part, face: &Face, divisions: &[Division]) -> FxHashMap<[u32; 2], f64> {
    let mut sags = FxHashMap::default();
    for id in face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge) {
        let (edge, Division { t, first }) = (&part.edges[id.0 as usize], &divisions[id.0 as usize]);
        let inner = (0..t.len() as u32 - 2).map(|k| first + k);
        let [from, to] = edge.vertices.map(|v| v.0);
        let positions: Vec<u32> = iter::once(from).chain(inner).chain(iter::once(to)).collect();
        for (ends, t) in positions.windows(2).zip(t.windows(2)) {
            let at = |f: f64| edge.curve.evaluate(t[0] + f * (t[1] - t[0]));
            let chord = [at(0.0), at(1.0)];
            let sag = PLACES.map(|f| distance_to_chord(at(f), &chord)).into_iter().fold(0.0, f64::max);
            sags.insert(edge_key(ends[0], ends[1]), sag);
        }
    }
    sags
}

/// Triangulates (constrained Delaunay) what `loops` hold in the plane across their mean normal. Sets where corners are seen; `None` where
/// sides cross or corners coincide there, or there is no mean normal.
fn planar_triangulation(loops: &mut [Vec<BorderCorner>]) -> Option<Vec<[BorderCorner; 3]>> {
    let area = |r: &Vec<BorderCorner>| -> Vector {
        let o = r[0].place;
        (0..r.len()).map(|k| (r[k].place - o).cross(r[(k + 1) % r.len()].place - o)).sum()
    };
    // The vector area of a loop does not depend on what is spanned in it: its direction is the loop's mean normal.
    let z = loops.iter().map(area).sum::<Vector>().try_normalize()?;
    let x = z.any_orthonormal_vector();
    let (y, o) = (z.cross(x), loops.first()?[0].place);
    let mut cdt = ConstrainedDelaunayTriangulation::<BorderCorner>::new();
    for ring in loops.iter_mut() {
        let mut handles = Vec::new();
        for c in ring.iter_mut() {
            let clean = |x: f64| if x.abs() < ZERO { 0.0 } else { x };
            c.at = Point2::new(clean((c.place - o).dot(x)), clean((c.place - o).dot(y)));
            let before = cdt.num_vertices();
            handles.push(cdt.insert(*c).ok()?);
            // Two corners fall together in this plane.
            if cdt.num_vertices() == before {
                return None;
            }
        }
        for k in 0..ring.len() {
            let (a, b) = (handles[k], handles[(k + 1) % ring.len()]);
            // None: it would cross another side; several: it passes through a corner.
            if cdt.try_add_constraint(a, b).len() != 1 {
                return None;
            }
        }
    }
    let (inside, _) = faces_inside(&cdt, |side| side.is_constraint_edge());
    let enclosed = cdt.inner_faces().filter(|face| inside[face.index()] == Some(true));
    Some(enclosed.map(|face| face.vertices().map(|v| *v.data())).collect())
}

/// Fills a single loop that no plane shows with triangles between its two sides, beginning at its first corner and always with the shorter
/// of both chords across; `None` for several loops.
fn zigzag_triangles(loops: &[Vec<BorderCorner>]) -> Option<Vec<[BorderCorner; 3]>> {
    let [ring] = loops else { return None };
    let (mut i, mut j) = (0, ring.len() - 1);
    let across = |i: usize, j: usize| ring[i].place.distance(ring[j].place);
    let mut out = Vec::new();
    while j > i + 1 {
        if across(i + 1, j) <= across(i, j - 1) {
            out.push([ring[i], ring[i + 1], ring[j]]);
            i += 1;
        } else {
            out.push([ring[i], ring[j - 1], ring[j]]);
            j -= 1;
        }
    }
    Some(out)
}

//! The last resort for a face whose parameter plane gives nothing, such as one whose chords lie beside its surface or on one line
//! there: its border alone, seen along its mean normal in space.
//!
//! The border's own points are kept, so that neighbours still meet it. Nothing is proved; how far it lies from the surface is
//! sampled ([`super::RepairedFace::reached_mm`]).

use super::border::edges::Division;
use super::border::polygons;
use super::face_mesh::{Corner, FaceMesh, MeshedFacet};
use super::face_surface::FaceSurface;
use super::foot_search;
use super::nodes::Position;
use crate::math::polygon::is_inside_sides;
use crate::math::{Point, Uv, Vector};
use crate::model::{Face, Part};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

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
pub(super) fn border_alone(
    part: &Part,
    face: &Face,
    surface: &FaceSurface<'_>,
    divisions: &[Division],
    shared: &[Point],
) -> Option<FaceMesh> {
    let border =
        polygons::build(part, &polygons::loops(face), surface, divisions, &polygons::ImprintedPoints::NONE);
    // The trims' own parameters gave nothing.
    let corner = |v: &polygons::PolygonVertex| {
        let place = match v.position {
            Position::Shared(p) => shared[p as usize],
            Position::Own(p) => border.own[p as usize],
        };
        let corner = || {
            let uv = foot_search::nearest_parameters(surface.spline, place);
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
    // By the surface's own normals, for the mean normal of the loops alone does not tell outside from inside.
    let up = loops.iter().flatten().filter_map(|c| surface.normal(c.uv)).sum::<Vector>();
    let triangles = match planar_triangulation(&mut loops, up).or_else(|| zigzag_triangles(&loops)) {
        Some(triangles) if !triangles.is_empty() => triangles,
        _ => return None,
    };
    let mut out = FaceMesh { own: border.own, ..FaceMesh::default() };
    for t in triangles {
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

/// Triangulates (constrained Delaunay) what `loops` hold in the plane across their mean normal, turned towards `up`. Sets where corners
/// are seen; `None` where sides cross or corners coincide there, or there is no mean normal.
fn planar_triangulation(loops: &mut [Vec<BorderCorner>], up: Vector) -> Option<Vec<[BorderCorner; 3]>> {
    let area = |r: &Vec<BorderCorner>| -> Vector {
        let o = r[0].place;
        (0..r.len()).map(|k| (r[k].place - o).cross(r[(k + 1) % r.len()].place - o)).sum()
    };
    // The vector area of a loop does not depend on what is spanned in it: its direction is the loop's mean normal.
    let mean: Vector = loops.iter().map(area).sum();
    let mean = if mean.dot(up) < 0.0 { -mean } else { mean };
    let z = mean.try_normalize()?;
    let x = z.any_orthonormal_vector();
    let (y, o) = (z.cross(x), loops.first()?[0].place);
    let mut cdt = ConstrainedDelaunayTriangulation::<BorderCorner>::new();
    let mut segments = Vec::new();
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
            segments.push([ring[k].at, ring[(k + 1) % ring.len()].at].map(|p| Uv::new(p.x, p.y)));
        }
    }
    // The triangulation fills the convex hull: even–odd at the centroid tells what the loops hold.
    let inside = |t: &[BorderCorner; 3]| {
        let [a, b, c] = t.map(|corner| Uv::new(corner.at.x, corner.at.y));
        is_inside_sides(segments.iter().copied(), (a + b + c) / 3.0)
    };
    Some(cdt.inner_faces().map(|f| f.vertices().map(|v| *v.data())).filter(inside).collect())
}

/// Fills a single loop that no plane shows with triangles, from one of its sides to the other and back; `None` for several loops.
fn zigzag_triangles(loops: &[Vec<BorderCorner>]) -> Option<Vec<[BorderCorner; 3]>> {
    let [ring] = loops else { return None };
    let (mut i, mut j) = (0, ring.len() - 1);
    let mut out = Vec::new();
    while j > i + 1 {
        out.push([ring[i], ring[i + 1], ring[j]]);
        i += 1;
        if j > i + 1 {
            out.push([ring[i], ring[j - 1], ring[j]]);
            j -= 1;
        }
    }
    Some(out)
}

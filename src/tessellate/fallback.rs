//! The last resort for a face whose parameter plane gives nothing, such as one whose trims lie beside its surface or on one line
//! there: its border alone, seen along its mean normal in space.
//!
//! The border's own points are kept, so that neighbours still meet it. Nothing is proved; how far it lies from the surface is
//! sampled ([`super::RepairedFace::reached_mm`]).

use super::border::edges::Division;
use super::border::rings;
use super::face::FaceMesh;
use super::repairs::Repair;
use super::sample;
use super::sheet::Sheet;
use crate::math::{Point, Uv, Vector};
use crate::model::{Face, Part};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A corner of the border.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    place: Point,
    uv: Uv,
    at: Point2<f64>,
}

impl HasPosition for Corner {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Meshes a face by its border; `None` when that has no three points.
pub(super) fn boundary(
    part: &Part,
    face: &Face,
    sheet: &Sheet<'_>,
    divisions: &[Division],
    shared: &[Point],
) -> Option<FaceMesh> {
    let rings = rings::build(part, &rings::loops(face), sheet, divisions, shared);
    let place = |p: u32| shared.get(p as usize).or_else(|| rings.own.get(p as usize - shared.len())).copied();
    // The trims' own parameters gave nothing.
    let corner = |v: &rings::RingVertex| {
        let place = place(v.position).filter(|p| p.is_finite())?;
        let uv = sample::nearest(sheet.surface, place);
        Some(Corner { position: v.position, place, uv, at: Point2::new(0.0, 0.0) })
    };
    let mut loops: Vec<Vec<Corner>> = rings.rings.iter().map(|r| r.iter().filter_map(corner).collect()).collect();
    for ring in &mut loops {
        ring.dedup_by_key(|c| c.place);
        if ring.len() > 1 && ring[0].place == ring[ring.len() - 1].place {
            ring.pop();
        }
    }
    loops.retain(|r| r.len() > 2);
    let up = loops.iter().flatten().filter_map(|c| sheet.normal(c.uv)).sum::<Vector>();
    let triangles = match flat(&mut loops, up).or_else(|| zigzag(&loops)) {
        Some(triangles) if !triangles.is_empty() => triangles,
        _ => return None,
    };
    let mut out = FaceMesh { own: rings.own, repaired: Some(Repair::BorderOnly), ..FaceMesh::default() };
    for t in triangles {
        let n = (t[1].place - t[0].place).cross(t[2].place - t[0].place).try_normalize().unwrap_or(Vector::Z);
        let first = out.corners.len() as u32;
        out.corners.extend(t.map(|c| (c.position, sheet.normal(c.uv).unwrap_or(n), c.uv)));
        out.facets.push([first, first + 1, first + 2, first + 2]);
        out.bounds.push(f64::INFINITY);
        out.tolerances.push(t.iter().map(|c| sheet.tolerance(c.uv)).fold(f64::INFINITY, f64::min));
    }
    Some(out)
}

/// Constrained Delaunay in the plane across the loops' mean normal; `None` where they cross there. `up` tells its sides apart.
fn flat(loops: &mut [Vec<Corner>], up: Vector) -> Option<Vec<[Corner; 3]>> {
    let around = |r: &Vec<Corner>| -> Vector {
        let o = r[0].place;
        (0..r.len()).map(|k| (r[k].place - o).cross(r[(k + 1) % r.len()].place - o)).sum()
    };
    let mean: Vector = loops.iter().map(around).sum();
    let mean = if mean.dot(up) < 0.0 { -mean } else { mean };
    let z = mean.try_normalize()?;
    let x = z.any_orthonormal_vector();
    let (y, o) = (z.cross(x), loops.first()?[0].place);
    let mut cdt = ConstrainedDelaunayTriangulation::<Corner>::new();
    let mut segments = Vec::new();
    for ring in loops.iter_mut() {
        let mut handles = Vec::new();
        for c in ring.iter_mut() {
            let clean = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
            c.at = Point2::new(clean((c.place - o).dot(x)), clean((c.place - o).dot(y)));
            let before = cdt.num_vertices();
            handles.push(cdt.insert(*c).ok()?);
            if cdt.num_vertices() == before {
                return None;
            }
        }
        for k in 0..ring.len() {
            let (a, b) = (handles[k], handles[(k + 1) % ring.len()]);
            if cdt.try_add_constraint(a, b).len() != 1 {
                return None;
            }
            segments.push([ring[k].at, ring[(k + 1) % ring.len()].at]);
        }
    }
    let inside = |t: &[Corner; 3]| {
        let p = t.map(|c| [c.at.x, c.at.y]);
        let (px, py) = ((p[0][0] + p[1][0] + p[2][0]) / 3.0, (p[0][1] + p[1][1] + p[2][1]) / 3.0);
        let crosses = |[a, b]: &[Point2<f64>; 2]| {
            (a.y > py) != (b.y > py) && px < a.x + (py - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        segments.iter().filter(|s| crosses(s)).count() % 2 == 1
    };
    Some(cdt.inner_faces().map(|f| f.vertices().map(|v| *v.data())).filter(inside).collect())
}

/// One loop that no plane shows: triangles from one of its sides to the other and back.
fn zigzag(loops: &[Vec<Corner>]) -> Option<Vec<[Corner; 3]>> {
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

//! Models built here, whose every answer is known: single surfaces, and a plain mesher for them that shares nothing with
//! the product's.

use crate::math::{Aabb, Frame, Point, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{Face, Model, Part, PlacedFace, Shell};
use crate::nurbs::Surface;
use rustc_hash::FxHashMap;

/// Points this near, as a share of the model's diagonal, are one: far above rounding, far below any facet.
const WELD: f64 = 1e-9;

/// Makes a face that is the whole domain of its surface.
pub fn face(surface: Surface) -> Face {
    Face::whole(surface)
}

/// Makes a model of one part with one open shell, whose faces are these untrimmed surfaces, mm.
pub fn model(name: &str, surfaces: impl IntoIterator<Item = Surface>) -> Model {
    let faces = surfaces.into_iter().map(face).collect();
    let shell = Shell { faces, ..Shell::default() };
    Model::from_part(Part { name: name.into(), shells: vec![shell], ..Part::default() })
}

/// Returns the model with all its instances moved by another placement, applied after their own.
pub fn placed(mut model: Model, frame: &Frame) -> Model {
    for instance in &mut model.instances {
        instance.placement = frame.compose(&instance.placement);
    }
    model
}

/// Makes a uniform grid of facets over every knot rectangle of every face, `divisions` a side (0 counts as 1); trims are not heeded, and
/// ready meshes are left out.
///
/// Points that agree within 1e-9 of the model's size become one position, so closed surfaces come out closed; points up to 3e-8 of it apart
/// may. The sag is the largest
/// distance at equal parameters over 30 samples of each facet, plus 15 %: measured, not proved.
pub fn grid_mesh(model: &Model, divisions: usize) -> FacetMesh {
    let divisions = divisions.max(1);
    let bounds =
        Aabb::from_points(model.placed_faces().filter_map(|p| p.face.map(|f| (p, f))).flat_map(|(p, f)| {
            let b = f.surface.bounds().corners();
            b.map(|c| p.placement.point(c))
        }));
    // Cells of the search are 16 of these wide, so that few points lie at a side.
    let cell = (WELD * bounds.diagonal()).max(f64::MIN_POSITIVE);
    let mut weld = Weld { origin: bounds.min, cell, seen: FxHashMap::default() };
    let mut mesh = FacetMesh::default();
    for placed in model.placed_faces() {
        if let Some(face) = placed.face {
            grid_face(&mut mesh, &mut weld, &placed, face, divisions);
        }
    }
    mesh
}

/// Finds positions that agree by the cells that they lie in.
struct Weld {
    origin: Point,
    cell: f64,
    seen: FxHashMap<[i64; 3], u32>,
}

impl Weld {
    /// Returns the index of a position: that of an earlier one in the same cell, or close beside it, else of a new one, appended to
    /// `positions`.
    fn position(&mut self, p: Point, positions: &mut Vec<Point>) -> u32 {
        let scaled = (p - self.origin) / (16.0 * self.cell);
        // A point near a cell's side is looked for in both cells.
        let near = |x: f64| [(x - 0.1).floor() as i64, (x + 0.1).floor() as i64];
        let [xs, ys, zs] = [near(scaled.x), near(scaled.y), near(scaled.z)];
        for x in xs {
            for y in ys {
                for z in zs {
                    if let Some(&i) = self.seen.get(&[x, y, z]) {
                        return i;
                    }
                }
            }
        }
        let i = positions.len() as u32;
        positions.push(p);
        self.seen.insert([scaled.x, scaled.y, scaled.z].map(|x| x.floor() as i64), i);
        i
    }
}

/// Returns the knots along a direction, 0 or 1, within the domain, each span divided.
fn breaks(surface: &Surface, direction: usize, divisions: usize) -> Vec<f64> {
    let [a, b] = surface.domain()[direction];
    // Knots stay grid lines: facets across a break would have the break's error.
    let mut knots: Vec<f64> = surface.knots[direction].iter().copied().filter(|k| (a..=b).contains(k)).collect();
    knots.dedup();
    let inner = knots
        .windows(2)
        .flat_map(|w| (0..divisions).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / divisions as f64));
    inner.chain([b]).collect()
}

/// Adds a face to `mesh` as a grid of facets, `divisions` a side of each knot rectangle; facets without area are left out.
fn grid_face(mesh: &mut FacetMesh, weld: &mut Weld, placed: &PlacedFace<'_>, face: &Face, divisions: usize) {
    let (us, vs) = (breaks(&face.surface, 0, divisions), breaks(&face.surface, 1, divisions));
    let mirrored = placed.placement.is_mirrored();
    let first = mesh.vertices.len() as u32;
    for &u in &us {
        for &v in &vs {
            let uv = Uv::new(u, v);
            let position = weld.position(placed.placement.point(face.surface.evaluate(uv)), &mut mesh.positions);
            // Only facets without area meet at a point where the surface has no normal.
            let n = placed.placement.normal(face.surface.normal(uv).unwrap_or(Vector::Z));
            mesh.vertices.push(MeshVertex { position, normal: if face.reversed { -n } else { n }, uv });
        }
    }
    let at = |i: usize, j: usize| first + (i * vs.len() + j) as u32;
    for i in 0..us.len() - 1 {
        for j in 0..vs.len() - 1 {
            let mut corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // A mirrored placement turns facets around once more.
            if mirrored != face.reversed {
                corners.reverse();
            }
            let position = |k: u32| mesh.vertices[k as usize].position;
            // Facets at a pole lose the corner that falls on its neighbour.
            let keep: Vec<u32> = (0..4)
                .filter(|&k| position(corners[k]) != position(corners[(k + 1) % 4]))
                .map(|k| corners[k])
                .collect();
            let vertices = match keep[..] {
                [a, b, c, d] => [a, b, c, d],
                [a, b, c] => [a, b, c, c],
                _ => continue,
            };
            mesh.facets.push(Facet { vertices, face: placed.id });
            let sag = sampled_sag(mesh, mesh.facets.len() - 1, placed, face);
            mesh.sag.push(sag);
        }
    }
}

/// Returns the largest distance of samples of a facet from the surface at equal parameters, mm, with some room for what lies between them.
fn sampled_sag(mesh: &FacetMesh, facet: usize, placed: &PlacedFace<'_>, face: &Face) -> f64 {
    let corners = mesh.corners(facet);
    let uv = mesh.facets[facet].vertices.map(|v| mesh.vertices[v as usize].uv);
    let mut worst = 0.0f64;
    for triangle in [[0, 1, 2], [0, 2, 3]] {
        for i in 0..=4 {
            for j in 0..=4 - i {
                // Four steps a side: the worst is seldom at a corner.
                let b = [i, j, 4 - i - j].map(|k| k as f64 / 4.0);
                let mix = |k: usize| triangle[k];
                let p = corners[mix(0)] * b[0] + corners[mix(1)] * b[1] + corners[mix(2)] * b[2];
                let q = uv[mix(0)] * b[0] + uv[mix(1)] * b[1] + uv[mix(2)] * b[2];
                worst = worst.max(p.distance(placed.placement.point(face.surface.evaluate(q))));
            }
        }
    }
    1.15 * worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    #[test]
    fn a_gridded_sphere_is_closed_and_as_large_as_its_sag_allows() {
        let s = sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        let mesh = grid_mesh(&model("ball", [s]), 8);
        let n = mesh.positions.len() as i64;
        let triangles: i64 = mesh.facets.iter().map(|f| f.triangle_count() as i64).sum();
        assert_eq!(2 * n - 4, triangles, "Euler's formula of a closed genus-0 surface");
        let worst = mesh.sag.iter().copied().fold(0.0, f64::max);
        let full = 4.0 / 3.0 * PI * 1000.0;
        assert!(mesh.volume() < full && mesh.volume() > 4.0 / 3.0 * PI * (10.0 - worst).powi(3));
        let mirrored = placed(
            model("ball", [sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0])]),
            &Frame { z: -Vector::Z, ..Frame::IDENTITY },
        );
        assert!(grid_mesh(&mirrored, 8).volume() > 0.0, "a mirrored placement keeps normals outward");
    }
}

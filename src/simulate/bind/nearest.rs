//! The face nearest to a point.

use crate::math::{Aabb, Point, Uv, Vector, distance_to_triangle};
use crate::model::{Model, PlacedFace};
use crate::nurbs::Surface;
use crate::simulate::face_foot::{BOX_ROUNDING, FaceSamples, PieceBoxes};
use crate::simulate::trim_loops::trim_polygons;

/// Finds the placed face nearest to a point, on the spline itself: samples inside the trimming loops, then Gauss–Newton. Faces are named by
/// their index in the model; points and distances are in scene coordinates, mm.
///
/// Exact for points on a face; between faces, good to the spacing of the samples (1/24 of a face) where the foot of the perpendicular lies
/// outside a trimming loop. The search data of a face are computed at its first query and kept.
pub(super) struct Nearest<'a> {
    faces: Vec<PlacedFace<'a>>,
    bounds: Vec<Aabb>,
    samples: Vec<Option<FaceSamples>>,
    /// Of each face with a surface that was asked for, in the coordinates of its part.
    slabs: Vec<Option<Slab>>,
    /// Boxes around the pieces of these surfaces.
    pieces: Vec<Option<PieceBoxes>>,
}

/// The space between two parallel planes around a surface: no more than the face itself where that is plane.
#[derive(Clone, Copy)]
struct Slab {
    normal: Vector,
    /// Distances of both planes from the origin along the normal, mm.
    range: [f64; 2],
}

impl Slab {
    /// Returns the slab around a surface's control points whose planes are parallel to both diagonals between its corners; all of space
    /// where the diagonals are parallel.
    fn new(surface: &Surface) -> Self {
        let points = || surface.points.iter().map(|p| p.project());
        let [[u0, u1], [v0, v1]] = surface.domain();
        let corner = |u, v| surface.evaluate(Uv::new(u, v));
        let normal = (corner(u1, v1) - corner(u0, v0)).cross(corner(u0, v1) - corner(u1, v0));
        let normal = normal.try_normalize().unwrap_or(Vector::ZERO);
        let along = points().map(|p| p.dot(normal));
        let range = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], d| [lo.min(d), hi.max(d)]);
        Self { normal, range }
    }

    /// Returns a distance that no point of the surface is nearer than, mm.
    fn distance_below(&self, p: Point) -> f64 {
        let ([low, high], along) = (self.range, p.dot(self.normal));
        let rounding = BOX_ROUNDING * (low.abs() + high.abs() + p.length());
        (low - along).max(along - high) - rounding
    }
}

/// Cosine above which two planes count as parallel: 8°. Planes at a larger angle are within a distance of each other on a strip 7 times as
/// wide at most, which is an edge and no contact.
const PARALLEL: f64 = 0.99;

impl<'a> Nearest<'a> {
    pub(super) fn new(model: &'a Model) -> Self {
        let faces: Vec<_> = model.placed_faces().collect();
        let bounds = faces.iter().map(PlacedFace::bounds).collect();
        let samples = vec![None; faces.len()];
        let slabs = vec![None; faces.len()];
        let pieces = vec![None; faces.len()];
        Self { faces, bounds, samples, slabs, pieces }
    }

    /// Returns a box around these faces; empty without any.
    pub(super) fn bounds(&self, faces: &[usize]) -> Aabb {
        faces.iter().fold(Aabb::EMPTY, |b, &f| b.union(self.bounds[f]))
    }

    /// Returns the nearest of the candidate faces, of equals the one with the lowest index; `None` where none has an extent.
    pub(super) fn nearest_face(&mut self, p: Point, candidates: &[usize]) -> Option<usize> {
        // Distance to the box, 0 inside: no face is nearer than its box.
        let away = |b: &Aabb| (b.min - p).max(p - b.max).max(Point::ZERO).length();
        let mut order: Vec<(f64, usize)> = candidates.iter().map(|&c| (away(&self.bounds[c]), c)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: Option<(f64, usize)> = None;
        for (low, c) in order {
            // Boxes come in order: what lies in a farther one is farther.
            if best.is_some_and(|(d, _)| low * (1.0 - BOX_ROUNDING) > d) {
                break;
            }
            let d = self.distance(c, p);
            if best.is_none_or(|(b, f)| d < b || d == b && c < f) {
                best = Some((d, c));
            }
        }
        best.filter(|(d, _)| d.is_finite()).map(|(_, c)| c)
    }

    /// Whether a point is within `limit`, mm, of a placed face.
    pub(super) fn is_within(&mut self, index: usize, p: Point, limit: f64) -> bool {
        let placed = self.faces[index];
        if let Some(face) = placed.face {
            let slab = self.slabs[index].get_or_insert_with(|| Slab::new(&face.surface));
            let local = placed.placement.local_point(p);
            // Two planes cost a hundredth of the search for the foot, and rule out most points that are far.
            if slab.distance_below(local) * placed.placement.scale > limit {
                return false;
            }
            // Within a reflector planes rule out nothing; what lies in no box around a piece is far from all of them.
            let pieces = self.pieces[index].get_or_insert_with(|| PieceBoxes::new(&face.surface));
            if !pieces.are_within(local, limit / placed.placement.scale) {
                return false;
            }
        }
        self.distance(index, p) <= limit
    }

    /// Whether both placed faces are flat to within `limit`, mm, parallel, and no farther than `limit` apart somewhere in a box, trims left
    /// out.
    pub(super) fn are_in_one_plane(&mut self, faces: [usize; 2], around: Aabb, limit: f64) -> bool {
        let [Some((a, normal_a)), Some((b, normal_b))] = faces.map(|f| self.plane(f, limit)) else { return false };
        let cosine = normal_a.dot(normal_b);
        if cosine.abs() < PARALLEL {
            return false;
        }
        // From the one plane to the other: linear in the point, so that the corners have the extremes.
        let apart = |p: Point| (p - a).dot(normal_a) - cosine.signum() * (p - b).dot(normal_b);
        let [low, high] = (around.corners().into_iter().map(apart))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| [low.min(d), high.max(d)]);
        let reach = limit + BOX_ROUNDING * (a.length() + b.length());
        low <= reach && high >= -reach
    }

    /// Returns a point of the plane of a placed face, in scene coordinates, and its normal; `None` where the face is not flat to `limit`,
    /// mm.
    fn plane(&mut self, index: usize, limit: f64) -> Option<(Point, Vector)> {
        let placed = self.faces[index];
        let face = placed.face?;
        let slab = *self.slabs[index].get_or_insert_with(|| Slab::new(&face.surface));
        let [low, high] = slab.range;
        let is_flat = slab.normal != Vector::ZERO && (high - low) * placed.placement.scale <= limit;
        let middle = slab.normal * (0.5 * (low + high));
        is_flat.then(|| (placed.placement.point(middle), placed.placement.direction(slab.normal)))
    }

    /// Returns the distance from a point to a placed face, mm; infinite for a face that has neither a surface nor facets.
    pub(super) fn distance(&mut self, index: usize, p: Point) -> f64 {
        let placed = self.faces[index];
        let local = placed.placement.local_point(p);
        let in_part = match (placed.face, placed.tessellated) {
            (Some(face), _) => {
                let samples =
                    self.samples[index].get_or_insert_with(|| FaceSamples::new(face, trim_polygons(face)));
                samples.nearest(face, local).map_or(f64::INFINITY, |nearest| nearest.distance)
            }
            (None, Some(t)) => (0..t.mesh.facets.len())
                .flat_map(|f| {
                    let [a, b, c, d] = t.mesh.corners(f);
                    [distance_to_triangle(local, [a, b, c]), distance_to_triangle(local, [a, c, d])]
                })
                .fold(f64::INFINITY, f64::min),
            (None, None) => f64::INFINITY,
        };
        in_part * placed.placement.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::model::{Face, Part, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn distances_to_a_sphere_and_a_plane() {
        let face = Face::whole;
        let sphere = sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]);
        let plane = sweep::plane(&Frame::translation(Vector::Z * 20.0), [[-1.0, 1.0], [-1.0, 1.0]]);
        let shell = Shell { faces: vec![face(sphere), face(plane)], ..Shell::default() };
        let mut model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        model.instances[0].placement = Frame { scale: 2.0, ..Frame::translation(Vector::X * 100.0) };
        let mut nearest = Nearest::new(&model);
        let p = Point::new(100.0, 0.0, 0.0) + Vector::new(3.0, -4.0, 12.0).normalize() * 17.0;
        assert!((nearest.distance(0, p) - 7.0).abs() < 1e-9);
        assert!((nearest.distance(1, Point::new(100.5, 0.5, 41.0)) - 1.0).abs() < 1e-12);
        for (face, distance) in [(0, 7.0), (1, nearest.distance(1, p))] {
            let within = [distance - 1e-6, distance + 1e-6].map(|limit| nearest.is_within(face, p, limit));
            assert_eq!(within, [false, true], "face {face}");
        }
        assert_eq!(nearest.nearest_face(Point::new(100.0, 0.0, 35.0), &[0, 1]), Some(1));
        assert_eq!(nearest.nearest_face(Point::new(100.0, 0.0, 24.0), &[0, 1]), Some(0));
    }
}

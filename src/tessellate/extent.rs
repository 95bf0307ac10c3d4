//! Faces without an area: points and lines, to the rounding of their coordinates, such as the tips that programs for wings write.
//!
//! Facets of them are rounding noise, as many as the tolerance of a closed surface of this size asks for.

use crate::model::{EdgeId, Face};
use crate::nurbs::Surface;
use rustc_hash::{FxHashMap, FxHashSet};

/// Share of the farthest coordinate within which two are the same: two units in the last of 15 digits whose first is a 1, which is what
/// files are mostly written with, and as much for the change of their unit.
const SAME: f64 = 4e-14;
/// Share by which products of weights may differ that are the same.
const SAME_WEIGHTS: f64 = 1e-12;

/// Returns the distance, in the surface's lengths, within which places on it are the same.
fn same_place(surface: &Surface) -> f64 {
    let bounds = surface.bounds();
    SAME * bounds.min.abs().max(bounds.max.abs()).max_element()
}

/// Whether all of a surface is one point.
pub(super) fn is_point(surface: &Surface) -> bool {
    surface.bounds().diagonal() <= same_place(surface)
}

/// Whether a surface is a point or a line, so that no face on it has an area.
pub(super) fn has_no_area(surface: &Surface) -> bool {
    let same = same_place(surface);
    // One that is no surface at all is refused for that.
    if !surface.points.iter().all(|p| p.is_finite() && p.w > 0.0) {
        return false;
    }
    is_point(surface) || is_straight(surface, same) || (0..2).any(|direction| is_curve(surface, direction, same))
}

/// Whether all control points, and with them the surface, lie within `same` of one line.
fn is_straight(surface: &Surface, same: f64) -> bool {
    let mut points = surface.points.iter().map(|p| p.project());
    let Some(first) = points.next() else { return false };
    let farther = |a, b| if first.distance_squared(b) > first.distance_squared(a) { b } else { a };
    let along = (points.clone().fold(first, farther) - first).normalize_or_zero();
    points.all(|p| (p - first).cross(along).length() <= same)
}

/// Whether the surface is a curve, as it is constant in `direction`: control points along it are the same within `same`, and so are the
/// ratios of their weights.
fn is_curve(surface: &Surface, direction: usize, same: f64) -> bool {
    let [nu, nv] = surface.counts();
    let (along, across) = if direction == 0 { (nu, nv) } else { (nv, nu) };
    let at = |i: usize, k: usize| surface.points[if direction == 0 { k * nv + i } else { i * nv + k }];
    (0..across).all(|i| {
        (1..along).all(|k| {
            let (first, other) = (at(i, 0), at(i, k));
            let (w, expected) = (other.w * at(0, 0).w, first.w * at(0, k).w);
            first.project().distance(other.project()) <= same && (w - expected).abs() <= SAME_WEIGHTS * w.abs()
        })
    })
}

/// Returns the places, ascending, of faces that have no area and no edge in common with another: what they are beside stays as closed
/// as it is without them.
pub(super) fn lone_faces_without_area(faces: &[&Face]) -> Vec<usize> {
    let mut found: Vec<usize> = (0..faces.len()).filter(|&k| has_no_area(&faces[k].surface)).collect();
    // Mostly there is none, and edges need not be looked at.
    if found.is_empty() {
        return found;
    }
    let edges =
        |face: &Face| -> Vec<EdgeId> { face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge).collect() };
    let mut users: FxHashMap<EdgeId, usize> = FxHashMap::default();
    let mut shared: FxHashSet<EdgeId> = FxHashSet::default();
    for (k, face) in faces.iter().enumerate() {
        for edge in edges(face) {
            if *users.entry(edge).or_insert(k) != k {
                shared.insert(edge);
            }
        }
    }
    found.retain(|&k| !edges(faces[k]).iter().any(|edge| shared.contains(edge)));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Point, Uv, Vector};
    use crate::model::{EdgeUse, TrimLoop};
    use crate::nurbs::{UvCurve, sweep};

    /// The surface of degree 1 over four corners.
    fn bilinear(corners: [Point; 4]) -> Surface {
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        Surface { degree: [1, 1], knots: [knots(), knots()], points: corners.map(|p| p.extend(1.0)).to_vec() }
    }

    #[test]
    fn points_and_lines_have_no_area_and_narrow_faces_have() {
        let (a, b) = (Point::new(4985.8, 0.0, 3340.6), Point::new(9774.2, 15240.0, 0.0));
        // One more in the 15th digit, as files are rounded.
        let noise = Vector::new(1e-11, 0.0, 0.0);
        assert!(is_point(&bilinear([a, a, a + noise, a])) && has_no_area(&bilinear([a; 4])));
        for line in [[a, a, b, b], [a, b, a, b], [a, b, b, a + noise]] {
            assert!(has_no_area(&bilinear(line)) && !is_point(&bilinear(line)), "{line:?}");
        }
        // A millionth of a millimetre is written as such.
        let width = Vector::new(0.0, 0.0, 1e-6);
        assert!(!has_no_area(&bilinear([a, a + width, b, b + width])));
        assert!(!has_no_area(&bilinear([a, a + width, a + Vector::new(1e-6, 0.0, 0.0), a])));
        // A tube of no height is a circle, one of no radius a straight line.
        let tube = |radius: f64, height: f64| {
            let mut tube = sweep::cylinder(&Frame::IDENTITY, 1.0, [0.0, 6.0], [0.0, 1.0]);
            tube.points.iter_mut().for_each(|p| *p *= Vector::new(radius, radius, height).extend(1.0));
            tube
        };
        assert!(has_no_area(&tube(3.0, 0.0)) && has_no_area(&tube(0.0, 3.0)) && !has_no_area(&tube(3.0, 1e-6)));
    }

    #[test]
    fn faces_without_area_that_close_others_are_not_alone() {
        let edge = |edge: u32| EdgeUse {
            edge: Some(EdgeId(edge)),
            reversed: false,
            uv: UvCurve::line(Uv::ZERO, Uv::X, [0.0, 1.0]),
        };
        let face = |corners: [Point; 4], edges: &[u32]| Face {
            loops: vec![TrimLoop { uses: edges.iter().map(|&id| edge(id)).collect() }],
            ..Face::whole(bilinear(corners))
        };
        let (point, square) = ([Point::X; 4], [Point::ZERO, Point::X, Point::Y, Point::ONE]);
        let faces = [face(point, &[0, 1]), face(square, &[1, 2]), face(point, &[3]), face(square, &[4])];
        assert_eq!(lone_faces_without_area(&faces.each_ref()), [2]);
    }
}

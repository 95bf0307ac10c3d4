//! A box around a trimmed face that certainly holds it: of pieces of its Bézier patches, not of whole ones.

use super::{Face, Part};
use crate::math::{Aabb, Frame, Uv};
use crate::nurbs::BezierPatch;

/// Times that a patch is halved each way: a third of a circle as one arc, whose control point lies a radius outside it, is then held within
/// a hundredth of the radius.
const HALVINGS: usize = 3;
/// Room around the range of the trims, as a share of the domain: loops end on it within the rounding of a file's twelve digits.
const ROOM: f64 = 1e-6;

impl Part {
    /// A box around everything of the part in its coordinates times `scale`, mm, with edges that stray from their faces and vertices that
    /// stray from their edges.
    pub(super) fn tight_box(&self, scale: f64) -> Aabb {
        let frame = Frame { scale, ..Frame::IDENTITY };
        let faces = self.shells.iter().flat_map(|s| &s.faces).map(Face::tight_box);
        let ready = self.tessellated.iter().map(|t| t.mesh.bounds());
        let vertices = Aabb::from_points(self.vertices.iter().copied());
        let whole = faces.chain(ready).fold(vertices, Aabb::union);
        whole.placed(&frame)
    }
}

impl Face {
    /// A box around the face in its part's coordinates, with its edges where they stray from the surface.
    pub(super) fn tight_box(&self) -> Aabb {
        let range = self.trim_range();
        let mut bounds = Aabb::EMPTY;
        for patch in self.surface.bezier_patches() {
            bounds = bounds.union(tight_box(&patch, &range, 2 * HALVINGS));
        }
        // Trims that lie beside their surface say nothing.
        if bounds.is_empty() { self.surface.bounds() } else { bounds.grown(self.gap) }
    }

    /// Ranges of u and v that the loops go through, by their control points; the whole domain of a parameter where there are no loops or
    /// they reach beyond it.
    fn trim_range(&self) -> [[f64; 2]; 2] {
        let domain = self.surface.domain();
        let loops = self.bounding_loops();
        let uses = loops.iter().flat_map(|l| &l.uses);
        let points = uses.flat_map(|u| &u.uv.points).map(|p| Uv::new(p.x, p.y) / p.z);
        let (low, high) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        [0, 1].map(|d: usize| {
            let [first, last] = domain[d];
            let room = ROOM * (last - first);
            let is_inside = low[d] >= first - room && high[d] <= last + room && low[d] <= high[d];
            // Beyond the domain a loop has gone around a closed surface.
            if is_inside { [low[d] - room, high[d] + room] } else { domain[d] }
        })
    }
}

/// A box around the part of a patch over ranges of the surface's parameters, halved `halvings` times in turn; empty where it has none.
fn tight_box(patch: &BezierPatch, range: &[[f64; 2]; 2], halvings: usize) -> Aabb {
    if (0..2).any(|d| patch.domain[d][1] < range[d][0] || patch.domain[d][0] > range[d][1]) {
        return Aabb::EMPTY;
    }
    if halvings == 0 {
        return patch.bounds();
    }
    let [low, high] = patch.halves(halvings % 2);
    tight_box(&low, range, halvings - 1).union(tight_box(&high, range, halvings - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::model::{EdgeUse, TrimLoop};
    use crate::nurbs::{UvCurve, sweep};
    use std::f64::consts::{PI, TAU};

    #[test]
    fn boxes_hold_what_the_trims_leave() {
        let frame = Frame::from_axis(Point::new(1.0, 2.0, 3.0), Vector::new(1.0, -2.0, 0.5), None);
        let ball = Face::whole(sweep::sphere(&frame, 20.0, [0.0, TAU], [-PI / 2.0, PI / 2.0]));
        let bounds = ball.tight_box();
        assert!(
            (bounds.size() - 40.0).min_element() >= 0.0 && (bounds.size() - 40.0).max_element() < 0.8,
            "{bounds:?}"
        );
        // The cap above v = 1, whatever the surface goes on to.
        let corners = [Uv::new(0.0, 1.0), Uv::new(TAU, 1.0), Uv::new(TAU, PI / 2.0), Uv::new(0.0, PI / 2.0)];
        let side = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
        let uses = (0..4).map(|k| EdgeUse { edge: None, reversed: false, uv: side(k) }).collect();
        let surface = sweep::sphere(&Frame::IDENTITY, 20.0, [0.0, TAU], [-PI / 2.0, PI / 2.0]);
        let cap = Face { loops: vec![TrimLoop { uses }], ..Face::whole(surface) };
        let bounds = cap.tight_box();
        let (low, radius) = (20.0 * 1f64.sin(), 20.0 * 1f64.cos());
        assert!(bounds.min.z <= low && bounds.min.z > low - 4.0 && bounds.max.z >= 20.0, "{bounds:?}");
        assert!(bounds.max.x >= radius && bounds.max.x < 1.3 * radius, "{bounds:?}");
    }

    #[test]
    fn a_hole_alone_takes_nothing_off_the_box() {
        let corners = [Uv::new(-1.0, -1.0), Uv::new(-1.0, 1.0), Uv::new(1.0, 1.0), Uv::new(1.0, -1.0)];
        let side = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
        let uses = (0..4).map(|k| EdgeUse { edge: None, reversed: false, uv: side(k) }).collect();
        let plane = sweep::plane(&Frame::IDENTITY, [[-5.0, 5.0]; 2]);
        let face = Face { loops: vec![TrimLoop { uses }], ..Face::whole(plane) };
        assert_eq!(face.tight_box(), Aabb { min: Point::new(-5.0, -5.0, 0.0), max: Point::new(5.0, 5.0, 0.0) });
    }
}

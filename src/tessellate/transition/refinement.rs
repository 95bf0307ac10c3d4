//! Where the transition's triangles are divided further.

use super::delaunay::DelaunayMesh;
use crate::math::Uv;
use crate::tessellate::nodes::{ProvedFacet, edge_key};
use crate::tessellate::proof::border_chord::BorderChords;
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use crate::tessellate::proof::pole;
use rustc_hash::FxHashSet;
use spade::handles::FixedVertexHandle;

/// Share of the tolerance within which places are one.
const SAME_PLACE: f64 = 1e-6;
/// Share of the tolerance from which the sag of a side is what a triangle fails for.
const SAGGING: f64 = 0.2;

/// Share of the surface's domain that a triangle is wide whose corners do not stand on one line: trims meet lines no better.
const LEAST_WIDTH: f64 = 1e-7;

/// A point that a triangle asks for.
struct Wish {
    triangle: ProvedFacet<3>,
    /// Where it is wanted, and where it may be if that is taken.
    places: [Uv; 2],
}

impl DelaunayMesh<'_, '_> {
    /// Returns the first side of a triangle (from corner k to k + 1), not on the outline, that is a taken chord; `None` without one.
    pub(super) fn taken_side(&self, t: [u32; 3]) -> Option<usize> {
        if self.taken.is_empty() {
            return None;
        }
        let is_taken = |a: u32, b: u32| {
            self.is_inner(a, b) && self.taken.contains([self.nodes[a].position, self.nodes[b].position])
        };
        (0..3).find(|&k| is_taken(t[k], t[(k + 1) % 3]))
    }

    /// Returns the side, not on the outline and long enough to be divided for an angle, whose ends' normals differ most, if a normal breaks
    /// the angle condition and that side turns by more than it; `None` otherwise, without a condition, for a triangle on a chord of the
    /// outline that turns by more than twice the angle, and for one without width in parameters, which stands between a chord and its own
    /// arc, as do all that it could be divided into.
    pub(super) fn steep_side(&self, t: [u32; 3]) -> Option<usize> {
        let most = self.surface.field.angle?;
        let n = t.map(|i| self.nodes[i]);
        if !self.has_width(n.map(|x| x.uv)) {
            return None;
        }
        let flat = (n[1].place - n[0].place).cross(n[2].place - n[0].place).try_normalize()?;
        let normals = n.map(|x| self.surface.spline.normal(x.uv));
        // Either side of the triangle may be meant: which way it is turned is decided later.
        let steep = normals.iter().flatten().any(|x| flat.angle_between(*x).min((-flat).angle_between(*x)) > most);
        let turn = |k: usize| match (normals[k], normals[(k + 1) % 3]) {
            (Some(a), Some(b)) => a.angle_between(b),
            _ => 0.0,
        };
        // No facet has both normals of such a chord within the angle, and one that reaches less far from it stands more upright.
        if (0..3).any(|k| !self.is_inner(t[k], t[(k + 1) % 3]) && turn(k) > 2.0 * most) {
            return None;
        }
        let is_long = |k: usize| n[k].place.distance(n[(k + 1) % 3].place) > self.surface.field.least_of_angle();
        let free = (0..3).filter(|&k| self.is_inner(t[k], t[(k + 1) % 3]) && is_long(k));
        let side = free.max_by(|&a, &b| turn(a).total_cmp(&turn(b)))?;
        (steep && turn(side) > most).then_some(side)
    }

    /// Whether a triangle is wider, in shares of the surface's domain, than trims are fitted to their curves; at a pole its sector is.
    fn has_width(&self, mut uv: [Uv; 3]) -> bool {
        if let Some((corner, at_pole)) = pole::facet_parameters(self.surface, &uv) {
            uv[corner] = at_pole;
        }
        let [a, b, c] = uv.map(|uv| uv / self.surface.extent());
        let longest = [b - a, c - b, a - c].into_iter().map(Uv::length).fold(0.0, f64::max);
        (b - a).perp_dot(c - a).abs() > LEAST_WIDTH * longest
    }

    /// Whether an edge is not on the outline.
    fn is_inner(&self, a: u32, b: u32) -> bool {
        !self.border.contains_key(&edge_key(a, b))
    }

    /// Inserts a point for each failing triangle that can gain: on its worst side inside the outline, or at its centre. Returns whether any
    /// was inserted.
    pub(super) fn refine(&mut self, failing: &[ProvedFacet<3>], chords: &BorderChords) -> bool {
        // Sides are shared by two triangles, which both may request one: one point a side and round is enough.
        let mut divided: FxHashSet<[u32; 2]> = FxHashSet::default();
        let wishes: Vec<Wish> = failing
            .iter()
            .filter(|f| self.can_gain(f, chords))
            .filter_map(|f| self.wish(f, &mut divided))
            .collect();
        let mut done = false;
        for Wish { triangle, places } in wishes {
            // From the last corner the way led over some with thousands of edges, and took nine tenths of the time on a lens of kilometres.
            let place_near = |uv: Uv| Some((uv, self.corner_near(triangle.nodes, uv)?));
            let mut near = places.into_iter().filter_map(place_near);
            // The middle of a parameter line into a pole may be a corner already.
            let Some((uv, corner)) = near.find(|&(uv, corner)| self.can_insert(uv, corner)) else { continue };
            let place = self.surface.point(uv);
            // What does not hold down to such a size does not for its size.
            let near = SAME_PLACE * triangle.tolerance;
            if triangle.nodes.iter().any(|&n| (self.nodes[n].place - place).length() <= near) {
                continue;
            }
            let mark = self.nodes.mark();
            let node = self.nodes.push_own(uv, place);
            match self.insert_node(node, Some(corner)) {
                Some(handle) => {
                    self.handles.push(Some(handle));
                    done = true;
                }
                None => self.nodes.rewind(mark),
            }
        }
        done
    }

    /// Returns the corner of a triangle that is nearest to a place in the coordinates of the triangulation; `None` for one without corners
    /// in it.
    fn corner_near(&self, t: [u32; 3], uv: Uv) -> Option<FixedVertexHandle> {
        let away = |n: &u32| ((self.nodes[*n].uv - uv) * self.scale).length_squared();
        let nearest = t.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        self.handles[nearest as usize]
    }

    /// Whether more points can make a triangle hold: neither an edge strays by more than its tolerance, nor a corner lies that far off the
    /// surface.
    fn can_gain(&self, f: &ProvedFacet<3>, chords: &BorderChords) -> bool {
        let t = f.nodes;
        // A chord stays as it is: no triangle on it can hold whose tolerance it strays beyond. Shorter chords are requested instead, which
        // at a cone's apex, where the tolerance tightens, takes a tenth of the facets that rings of places between took.
        let strays = |k: usize| {
            let chord = chords.get(&edge_key(t[k], t[(k + 1) % 3]));
            chord.is_some_and(|chord| chord.deviation > f.tolerance)
        };
        // Nor does a corner move that the file puts beside the surface.
        let off = |&n: &u32| (self.surface.point(self.nodes[n].uv) - self.nodes[n].place).length();
        !(0..3).any(strays) && !t.iter().any(|n| off(n) > f.tolerance)
    }

    /// Returns the point that a triangle asks for: in the middle of its worst side, or its centre where no side sags much. `None` where
    /// `divided`, to which the side is added, has it already.
    fn wish(&self, f: &ProvedFacet<3>, divided: &mut FxHashSet<[u32; 2]>) -> Option<Wish> {
        let t = f.nodes;
        let end = |k: usize| t[(k + 1) % 3];
        let middles = pole::side_middles(self.surface, t.map(|n| self.nodes[n].uv));
        // Near enough to the surface, it is divided for one of its sides.
        if let Some(k) = self.steep_side(t).or_else(|| self.taken_side(t)).filter(|_| f.bound <= f.tolerance) {
            return divided
                .insert(edge_key(t[k], end(k)))
                .then_some(Wish { triangle: *f, places: [middles[k]; 2] });
        }
        let sag = |k: usize| {
            let ends = [self.nodes[t[k]].place, self.nodes[end(k)].place];
            distance_to_chord(self.surface.point(middles[k]), &ends)
        };
        let free = (0..3).filter(|&k| self.is_inner(t[k], end(k)));
        let worst = free.map(|k| (k, sag(k))).max_by(|a, b| a.1.total_cmp(&b.1));
        let uv = t.map(|n| self.nodes[n].uv);
        let center = (uv[0] + uv[1] + uv[2]) / 3.0;
        // Little sag on all sides means that the inside is to blame.
        match worst {
            Some((k, sag)) if sag > SAGGING * f.tolerance => divided
                .insert(edge_key(t[k], end(k)))
                .then_some(Wish { triangle: *f, places: [middles[k], center] }),
            _ => Some(Wish { triangle: *f, places: [center; 2] }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::{Surface, sweep};
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::nodes::Nodes;
    use crate::tessellate::settings::ToleranceField;
    use crate::tessellate::taken_chords::NO_CHORDS;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Whether a triangle, its corners in shares of the surface's domain, is divided for an angle of 3°.
    fn is_divided(spline: &Surface, corners: [[f64; 2]; 3]) -> bool {
        let mut field = ToleranceField::new([0.2; 2], [1.0, 10.0], Default::default(), 1.0);
        field.angle = Some(0.05);
        let surface = FaceSurface::new(spline, false, field);
        let mut nodes = Nodes::default();
        let [[u0, _], [v0, _]] = spline.domain();
        for share in corners {
            let uv = Uv::new(u0, v0) + Uv::from_array(share) * surface.extent();
            nodes.push_own(uv, surface.point(uv));
        }
        DelaunayMesh::new(&surface, nodes, Uv::ONE, &NO_CHORDS).steep_side([0, 1, 2]).is_some()
    }

    /// All of these stand upright on the surface: between a chord of 36° and its arc, or the wider one beside it.
    #[test]
    fn triangles_without_width_are_not_divided_for_an_angle() {
        let tube = sweep::cylinder(&Frame::IDENTITY, 5.0, [0.0, PI], [0.0, 10.0]);
        assert!(is_divided(&tube, [[0.1, 0.5], [0.3, 0.5], [0.2, 0.6]]));
        assert!(!is_divided(&tube, [[0.1, 0.5], [0.3, 0.5], [0.2, 0.5 + 1e-8]]));
        // At a pole its parameter across says nothing of a width.
        let cap = sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, FRAC_PI_2], [0.0, FRAC_PI_2]);
        assert!(is_divided(&cap, [[0.2, 0.6], [0.5, 0.8], [0.9, 1.0]]));
        assert!(!is_divided(&cap, [[0.2, 0.6], [0.2 + 1e-8, 0.8], [0.9, 1.0]]));
    }
}

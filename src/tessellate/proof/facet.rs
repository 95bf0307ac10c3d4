//! The entry of the proof: a triangle of nodes, the border's own deviation from its chords included.
//!
//! What is proved, and why it holds, stands in `prover.rs`; at poles, in `pole.rs`. A side that follows an edge of the model is measured by
//! its [`BorderChord`] in place of the straight line of parameters.

use super::border_chord::BorderChords;
use super::pole;
use super::prover::Prover;
use crate::tessellate::nodes::{Nodes, ProvedFacet, edge_key};

/// Bounds one triangle of nodes, in mm, and takes the tightest tolerance of its corners and middle. A bound above `slack` tolerances is
/// none: it only says that none was found.
pub(in crate::tessellate) fn prove_triangle(
    prover: &mut Prover<'_, '_>,
    nodes: &Nodes,
    t: [u32; 3],
    chords: &BorderChords,
    slack: f64,
) -> ProvedFacet<3> {
    let surface = prover.surface;
    let n = t.map(|i| nodes[i]);
    let uv = n.map(|x| x.uv);
    let xyz = n.map(|x| x.place);
    let tolerance = if surface.affine {
        // A flat face has one tolerance. On others it varies from place to place: the tightest of four places is
        // asked for.
        surface.field.loosest()
    } else {
        uv.iter().fold(surface.tolerance((uv[0] + uv[1] + uv[2]) / 3.0), |x, &p| x.min(surface.tolerance(p)))
    };
    let proved = |bound: f64| ProvedFacet { nodes: t, bound, tolerance };
    let limit = tolerance * slack;
    if prover.gives_up() {
        return proved(f64::INFINITY);
    }
    let sides = [0, 1, 2].map(|k| chords.get(&edge_key(t[k], t[(k + 1) % 3])));
    // Poles first: what stands for a facet there is no parameter triangle, so that what follows would be about
    // another piece.
    if let Some(bound) = pole::sector_bound(prover, uv, xyz, sides, limit) {
        return proved(bound);
    }
    if let Some(bound) = pole::collapsed_bound(surface, uv, sides) {
        return proved(bound);
    }
    // What is left with two corners in one place: the two ends of a closed curve are a point too, but the curve between them is not,
    // and must be divided.
    let collapsed = (0..3).any(|k| n[k].position == n[(k + 1) % 3].position);
    let mut worst = 0f64;
    // The border's own deviation, which no smaller facet beside it can mend.
    for chord in sides.iter().flatten() {
        worst = worst.max(chord.bound(prover, xyz, limit));
        if worst > limit {
            return proved(worst);
        }
    }
    // A flat piece and its straight sides are as far off as its corners are, the distance being convex.
    if surface.affine {
        let moved = n.map(|x| (surface.point(x.uv) - x.place).length()).into_iter().fold(0.0, f64::max);
        return proved(worst.max(moved + prover.margin));
    }
    // Inside and sides by one quick look, else each by its own hull. With two corners in one place the linear map has no inverse, and
    // there is no quick look.
    if !collapsed && let Some(bound) = prover.facet_bound(uv, xyz, false, limit) {
        return proved(worst.max(bound));
    }
    for (k, _) in sides.iter().enumerate().filter(|(_, chord)| chord.is_none()) {
        let end = (k + 1) % 3;
        worst = worst.max(prover.side_bound([uv[k], uv[end]], [xyz[k], xyz[end]], limit));
    }
    if worst > limit || collapsed {
        return proved(worst);
    }
    proved(worst.max(prover.triangle_bound(uv, xyz, limit)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Uv, Vector};
    use crate::nurbs::sweep;
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::nodes::{Node, Position};
    use crate::tessellate::settings::{Acceptance, ToleranceField};

    #[test]
    fn a_strip_of_a_cylinder_has_its_closed_form_sag() {
        let s = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 40.0]);
        let surface =
            FaceSurface::new(&s, false, ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0));
        let [a, b] = [0.4, 0.9].map(|phi| crate::nurbs::conic::parameter_of_angle([0.0, 3.0], phi));
        let uv = [Uv::new(a, 0.0), Uv::new(b, 0.0), Uv::new(b, 40.0)];
        let xyz = uv.map(|x| s.evaluate(x));
        let sag = 10.0 * (1.0 - 0.25f64.cos());
        let mut prover = Prover::new(&surface, Acceptance::Proved);
        let bound = prover.triangle_bound(uv, xyz, 1e-3 * sag);
        assert!(bound >= sag * 0.999 && bound < 1.02 * 8.0 * sag, "{bound} {sag}");
        let bound = prover.triangle_bound(uv, xyz, 1.03 * sag);
        assert!(bound >= sag && bound <= 1.03 * sag, "{bound} {sag}");
        let side = prover.side_bound([uv[0], uv[1]], [xyz[0], xyz[1]], 1.03 * sag);
        assert!(side >= sag && side <= 1.03 * sag, "{side} {sag}");
    }

    #[test]
    fn a_corner_moved_off_its_surface_is_in_the_bound_whatever_its_direction() {
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let plane = sweep::plane(&Frame::IDENTITY, [[0.0, 10.0]; 2]);
        let tube = sweep::cylinder(&Frame::IDENTITY, 1000.0, [0.0, 3.0], [0.0, 10.0]);
        for spline in [plane, tube] {
            let surface = FaceSurface::new(&spline, false, field);
            let uv = [Uv::new(0.5, 5.0), Uv::new(0.51, 5.0), Uv::new(0.5, 5.01)];
            let places = uv.map(|x| spline.evaluate(x));
            let d = spline.derivatives(uv[0]);
            // Across the surface, where a small facet stands on edge; along it, away from the facet, and along one of its sides.
            let along = (places[0] - places[1]).normalize();
            for direction in [d.du.cross(d.dv).normalize(), along, (places[0] - places[2]).normalize(), -along] {
                for gap in [0.05, 0.5] {
                    let mut nodes = Nodes::default();
                    for k in 0..3 {
                        let place = places[k] + if k == 0 { gap * direction } else { Vector::ZERO };
                        nodes.push(Node { uv: uv[k], place, position: Position::Own(k as u32) });
                    }
                    let mut prover = Prover::new(&surface, Acceptance::Proved);
                    let facet = prove_triangle(&mut prover, &nodes, [0, 1, 2], &BorderChords::default(), 1.0);
                    // The moved corner's distance to the piece, by samples.
                    let away = |i: i32, j: i32| -> f64 {
                        let at = uv[0]
                            + (uv[1] - uv[0]) * (f64::from(i) / 40.0)
                            + (uv[2] - uv[0]) * (f64::from(j) / 40.0);
                        (spline.evaluate(at) - nodes[0].place).length()
                    };
                    let near = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))).map(|(i, j)| away(i, j));
                    let near: f64 = near.fold(f64::INFINITY, f64::min);
                    assert!(facet.bound >= near - 1e-3 || facet.bound > facet.tolerance, "{} {near}", facet.bound);
                }
            }
        }
    }
}

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

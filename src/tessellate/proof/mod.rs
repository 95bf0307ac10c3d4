//! The proof: an upper bound of the distance between a facet as traced and its piece of the spline, cheap bounds first.
//!
//! `facet.rs` is the entry for triangles, [`prover::Prover::quad_bound`] that for whole cells. The argument stands in `prover.rs`.

pub(in crate::tessellate) mod border_chord;
mod cubic_reduction;
pub(in crate::tessellate) mod deviation;
mod effort;
pub(in crate::tessellate) mod facet;
mod flat_quad;
pub(in crate::tessellate) mod flat_triangle;
mod linear_map;
pub(in crate::tessellate) mod pole;
pub(in crate::tessellate) mod prover;
mod refine;
mod scalar_bezier;
mod scalar_patch;
mod simplex_net;

#[cfg(test)]
mod tests {
    use super::deviation::DeviationBounds;
    use crate::math::{Point, Uv};
    use crate::nurbs::Surface;

    #[test]
    fn the_bound_holds_of_a_line_that_weights_make_uneven() {
        let line = |w: f64| {
            let row = |x: f64, w: f64| [0.0, 1.0].map(|y| (Point::new(x, y, 0.0) * w).extend(w));
            let knots = vec![0.0, 0.0, 1.0, 1.0];
            let points = [row(0.0, 1.0), row(100.0, w)].concat();
            Surface { degree: [1, 1], knots: [knots.clone(), knots], points }
        };
        for w in [4.0f64, 9.0, 25.0] {
            let surface = line(w);
            let corners = [Uv::ZERO, Uv::X, Uv::ONE];
            let at = corners.map(|x| surface.evaluate(x));
            let bound =
                DeviationBounds::default().taylor_bound(surface.bezier_patches().iter(), corners, at).unwrap();
            // 100 mm run unevenly stray from the even run by 100·(√w − 1)/(√w + 1) mm at most.
            let most = 100.0 * (w.sqrt() - 1.0) / (w.sqrt() + 1.0);
            assert!(bound >= most, "weight {w}: {bound} {most}");
        }
    }
}

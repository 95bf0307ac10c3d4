//! Folds of a spline: places where it turns back over a few micrometres, as between knots that nearly coincide.

use super::placed_surface::PlacedSurface;
use crate::math::{Uv, Vector};

/// Of eight ways two may lead along the fold itself.
const MOST: usize = 6;
/// Halvings of the domain that give the first step of a look around: a billionth of it.
const NEAREST_STEP: i32 = 30;

impl PlacedSurface {
    /// Whether of the outward normals at eight places around parameters `uv`, `reach` mm away or at the end of the domain, [`MOST`] look to
    /// the side of `direction`.
    pub(super) fn looks_around(&self, uv: Uv, reach: f64, direction: Vector) -> bool {
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        let extent = Uv::new(u1 - u0, v1 - v0);
        let middle = self.surface.evaluate(uv);
        let looks = |k: &i32| {
            let way = extent * Uv::new(f64::from(k / 3 - 1), f64::from(k % 3 - 1));
            // Doubled until it is far enough: where the surface is folded its speed says nothing.
            let step = |n: i32| self.surface.clamp(uv + way * 0.5f64.powi(n));
            let far = |at: &Uv| self.surface.evaluate(*at).distance(middle) >= reach;
            let at = (0..=NEAREST_STEP).rev().map(step).find(far).unwrap_or(step(0));
            self.normal(at).dot(direction) > 0.0
        };
        (0..9).filter(|k| *k != 4).filter(looks).count() >= MOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Homogeneous;
    use crate::model::{Face, Model, Part, Shell};
    use crate::nurbs::Surface;

    #[test]
    fn a_fold_is_told_by_what_is_around_it() {
        // A strip that goes back by 1e-4 mm at x = 5 and on again.
        let row = |x: f64| [0.0, 5.0].map(|y| Homogeneous::new(x, y, 0.0, 1.0));
        let points = [row(0.0), row(5.0), row(5.0 - 1e-4), row(10.0)].concat();
        let knots = [vec![0.0, 0.0, 1.0, 1.00001, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]];
        let face = Face::whole(Surface { degree: [1, 1], knots, points });
        let shells = vec![Shell { faces: vec![face], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let s = PlacedSurface::new(&model.placed_faces().next().expect("one face")).expect("a surface");
        let inside = Uv::new(1.000005, 0.5);
        assert!(s.normal(inside).z < -0.9 && s.normal(Uv::new(0.5, 0.5)).z > 0.9);
        assert!(s.looks_around(inside, 1e-3, Vector::Z));
        // Nearer than the fold is wide, or on a sheet that looks that way itself, nothing is folded.
        assert!(!s.looks_around(inside, 2e-5, Vector::Z));
        assert!(!s.looks_around(Uv::new(0.5, 0.5), 1e-3, -Vector::Z));
    }
}

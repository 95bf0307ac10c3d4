//! The normal by which light leaves a facet: the interpolated one, or the facet's own where that would send it to the wrong side.

use super::refraction::{reflect, refract_with_cosine};
use crate::math::Vector;

/// Both normals of a hit on a facet, unit vectors to the same side of it.
///
/// Interpolated normals stand for a curved surface on a flat facet: at grazing incidence they may look away from the light, or send it
/// through the facet that reflects it.
#[derive(Clone, Copy, Debug)]
pub struct FacetNormals {
    /// The normal to shade with.
    pub interpolated: Vector,
    /// The facet's own, which distinguishes its sides.
    pub geometric: Vector,
    /// Whether the light goes to and fro in the edge between two facets: interpolated normals, which are alike there, would keep it for
    /// ever.
    pub in_edge: bool,
    /// Times that the facet's own had to be taken.
    pub corrections: u32,
}

impl FacetNormals {
    /// Makes the pair, of which nothing is known yet.
    #[inline(always)]
    pub fn new(interpolated: Vector, geometric: Vector) -> Self {
        Self { interpolated, geometric, in_edge: false, corrections: 0 }
    }

    /// Returns the normal to shade light of direction `d` with and the cosine of incidence, from 0 to 1. An interpolated normal that looks
    /// away from the light is replaced by the facet's own, and counted.
    #[inline(always)]
    pub fn facing(&mut self, d: Vector) -> (Vector, f64) {
        let along = d.dot(self.interpolated);
        let flat = d.dot(self.geometric);
        // Both normals must see the light from one side.
        if along * flat > 0.0 {
            (self.interpolated, along.abs().min(1.0))
        } else {
            self.corrections += 1;
            (self.geometric, flat.abs().min(1.0))
        }
    }

    /// Returns the direction `d` mirrored about `normal`, on the side of the facet that the light came from; about the facet's own normal,
    /// and counted, where `normal` would send it through or it is caught in an edge.
    #[inline(always)]
    pub fn reflected(&mut self, d: Vector, normal: Vector) -> Vector {
        let r = reflect(d, normal);
        // A reflection that points into the facet would meet it again from inside.
        if !self.in_edge && r.dot(self.geometric) * d.dot(self.geometric) < 0.0 {
            return r;
        }
        // On a true surface both normals are one, and nothing is corrected.
        self.corrections += u32::from(normal != self.geometric);
        reflect(d, self.geometric)
    }

    /// Returns the normal to refract light of direction `d` about, the cosine of incidence, and the direction on the far side of the facet
    /// with its cosine; `None` for these two at total reflection. `eta` is the index before the facet over that behind it. About the
    /// facet's own normal, and counted, where the interpolated one would send the light back to the side it came from.
    #[inline(always)]
    pub fn refracted(&mut self, d: Vector, eta: f64) -> (Vector, f64, Option<(Vector, f64)>) {
        let flat = self.geometric;
        let (normal, cos_i) = self.facing(d);
        let transmitted = refract_with_cosine(d, normal, eta);
        if transmitted.is_none_or(|(t, _)| t.dot(flat) * d.dot(flat) > 0.0) {
            return (normal, cos_i, transmitted);
        }
        self.corrections += 1;
        (flat, d.dot(flat).abs().min(1.0), refract_with_cosine(d, flat, eta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The direction so many degrees off z, towards x.
    fn off_z(degrees: f64) -> Vector {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector::new(sin, 0.0, cos)
    }

    fn tilted(degrees: f64) -> FacetNormals {
        FacetNormals::new(off_z(degrees), Vector::Z)
    }

    #[test]
    fn an_interpolated_normal_that_looks_away_is_not_taken() {
        let d = -off_z(80.0);
        let [mut sees, mut looks_away] = [-9.0, -11.0].map(tilted);
        assert_eq!((sees.facing(d).0, sees.corrections), (off_z(-9.0), 0));
        // At 91° to the light.
        assert_eq!((looks_away.facing(d), looks_away.corrections), ((Vector::Z, -d.z), 1));
    }

    #[test]
    fn a_reflection_stays_on_its_side() {
        // From 88° off the facet: mirrored about a normal of 1° to 86°, about one of −3° to 94°, through the facet.
        let d = -off_z(88.0);
        let [mut stays, mut through] = [1.0, -3.0].map(tilted);
        assert!(stays.reflected(d, off_z(1.0)).distance(off_z(-86.0)) < 1e-12 && stays.corrections == 0);
        assert!(through.reflected(d, off_z(-3.0)).distance(off_z(-88.0)) < 1e-12 && through.corrections == 1);
    }

    #[test]
    fn a_refraction_passes_its_facet() {
        // In glass of 1.5 light at 46° to the facet is reflected totally; at 41.7° to its normal it leaves at 86.2° to that, 90.5° to the
        // facet.
        let [mut back, mut passes] = [4.3, 4.3].map(tilted);
        assert_eq!((back.refracted(off_z(46.0), 1.5).2, back.corrections), (None, 1));
        let leaves = 4.3 + (1.5 * 25.7f64.to_radians().sin()).asin().to_degrees();
        let (_, _, transmitted) = passes.refracted(off_z(30.0), 1.5);
        assert!(transmitted.unwrap().0.distance(off_z(leaves)) < 1e-12 && passes.corrections == 0);
    }
}

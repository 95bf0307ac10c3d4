//! Error of the direction in which light leaves a facet.

use crate::intersect::Hit;
use crate::math::Vector;
use crate::optics::{FacetNormals, reflect, refract};
use crate::study::cross_check::angle_deg;

/// Returns how far off, degrees, light of direction `incoming` leaves its hit on facets, by its hit on the spline; `None` where the two are
/// on faces that do not touch back to back, within `apart_mm` along the normal. `index_ratio` is that of [`direction_error_deg`].
pub(super) fn error_of_hit(
    incoming: Vector,
    [facet, spline]: [&Hit; 2],
    apart_mm: f64,
    index_ratio: Option<f64>,
) -> Option<f64> {
    if facet.face == spline.face {
        let normals = FacetNormals::new(facet.normal, facet.geometric_normal);
        return Some(direction_error_deg(incoming, normals, spline.normal, index_ratio));
    }
    // Where two bodies touch, facets may name the face of the one and the spline that of the other, which looks the other way.
    let distance = (facet.t - spline.t) * spline.normal.dot(incoming);
    let touches = facet.normal.dot(spline.normal) < 0.0 && distance.abs() <= apart_mm;
    let seen_back = FacetNormals::new(-facet.normal, -facet.geometric_normal);
    touches.then(|| direction_error_deg(incoming, seen_back, spline.normal, index_ratio))
}

/// Returns the larger of the angles, degrees, between the directions that a facet and the spline's normal send light of direction
/// `incoming` to: mirrored, and refracted where the face lets light through and neither reflects it totally. All are unit vectors,
/// normals outward; light leaves the facet as in a simulation.
///
/// `index_ratio` is the refractive index before the face over that behind it, `None` where no light passes. Just short of total reflection
/// light passes misdirected by many times the error of the normal, mirrored light by twice at most.
fn direction_error_deg(incoming: Vector, mut facet: FacetNormals, spline: Vector, index_ratio: Option<f64>) -> f64 {
    let (normal, refracted) = match index_ratio {
        Some(eta) => {
            let (normal, _, transmitted) = facet.refracted(incoming, eta);
            (normal, transmitted.map(|(direction, _)| direction).zip(refract(incoming, spline, eta)))
        }
        None => (facet.facing(incoming).0, None),
    };
    let mirrored = angle_deg(facet.reflected(incoming, normal), reflect(incoming, spline));
    // What is reflected totally on one side passes on the other with next to no power.
    refracted.map_or(mirrored, |(facet, spline)| mirrored.max(angle_deg(facet, spline)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The direction so many degrees off z, towards x.
    fn off_z(degrees: f64) -> Vector {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector::new(sin, 0.0, cos)
    }

    #[test]
    fn beside_total_reflection_the_refracted_light_errs_most() {
        let error = |light: Vector, index| {
            direction_error_deg(light, FacetNormals::new(off_z(0.01), off_z(0.01)), Vector::Z, index)
        };
        // A mirror turns light by twice what its normal is turned.
        assert!((error(off_z(40.0), None) - 0.02).abs() < 1e-9);
        // asin(1.5 sin 41.5°) = 83.67°, and 83.54° for a normal turned by 0.01°: Snell's law by hand, less the turn itself.
        let leaves = |incidence: f64| (1.5 * incidence.to_radians().sin()).asin().to_degrees();
        let truth = leaves(41.5) - (leaves(41.49) + 0.01);
        assert!(truth > 0.06 && (error(off_z(41.5), Some(1.5)) - truth).abs() < 1e-6);
        // Into the body it is a third of the normal's error, and the mirrored light errs more; beyond the critical angle nothing leaves.
        assert!((error(-off_z(40.0), Some(1.0 / 1.5)) - 0.02).abs() < 1e-9);
        assert!((error(off_z(45.0), Some(1.5)) - 0.02).abs() < 1e-9);
    }

    /// Light at 46° in glass of 1.5 is reflected totally by the facet, but would pass at a normal turned by 4.3°: asin(1.5 sin 41.7°) =
    /// 86.2°, at 90.5° to the facet's own and so back into the glass. The simulation goes by the facet's own then; a mirror does not.
    #[test]
    fn the_facets_own_normal_counts_where_a_simulation_takes_it() {
        let facet = FacetNormals::new(off_z(4.3), Vector::Z);
        let error = |index| direction_error_deg(off_z(46.0), facet, Vector::Z, index);
        assert!((error(None) - 8.6).abs() < 1e-9 && error(Some(1.5)).abs() < 1e-9, "{:?}", error(Some(1.5)));
        // Of light at 88° a normal turned by 3° makes a reflection at 94°, through the facet.
        let grazing =
            |flat| direction_error_deg(-off_z(88.0), FacetNormals::new(off_z(-3.0), flat), Vector::Z, None);
        assert!(grazing(Vector::Z).abs() < 1e-9 && (grazing(off_z(-3.0)) - 6.0).abs() < 1e-9);
    }
}

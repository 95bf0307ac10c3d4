//! Trimming loops as polygons in the parameter plane, for what is drawn or sampled on a face.

use crate::math::Uv;
use crate::math::polygon::{is_inside_sides, polygon_sides};
use crate::model::{EdgeUse, Face, TrimLoop};
use crate::nurbs::UvCurve;

/// Samples along each edge of a loop.
const EDGE_SAMPLES: usize = 24;

/// Returns the trimming loops of a face as polygons in its spline parameters, [`EDGE_SAMPLES`] points an edge; none for an untrimmed face.
pub(crate) fn trim_polygons(face: &Face) -> Vec<Vec<Uv>> {
    let points = |u: &EdgeUse| {
        let [a, b] = u.uv.domain();
        let reversed = u.reversed;
        (0..EDGE_SAMPLES)
            .map(move |i| {
                let s = i as f64 / EDGE_SAMPLES as f64;
                a + (b - a) * if reversed { 1.0 - s } else { s }
            })
            .map(|t| u.uv.evaluate(t))
            .collect::<Vec<_>>()
    };
    face.bounding_loops().iter().map(|l| l.uses.iter().flat_map(points).collect()).collect()
}

/// How far the polygons of a [`TrimRegion`] may be beside their loops, as a share of a loop's extent: of a disc 2e-6 of the area is missed.
const LOOP_SHARE: f64 = 1e-6;
/// Pieces into which a span of a curved edge is divided at first, and at most.
const SPAN_PIECES: [usize; 2] = [8, 1024];
/// Most bands into which a region is divided: a band then has a few sides of a polygon.
const MOST_BANDS: usize = 1024;

/// The inside of a face's trims, for light that starts all over it: loops as fine polygons, in bands of v.
#[derive(Clone, Debug)]
pub(crate) struct TrimRegion {
    /// The sides that each band meets; no band for an untrimmed face.
    bands: Vec<Vec<[Uv; 2]>>,
    low: f64,
    height: f64,
    /// Lower and upper corner of a box around the loops; without a meaning for an untrimmed face.
    bounds: [Uv; 2],
}

impl TrimRegion {
    /// Divides the loops of a face into polygons and these into bands; an untrimmed face gets none.
    pub(crate) fn new(face: &Face) -> Self {
        let polygons: Vec<Vec<Uv>> = face.bounding_loops().iter().map(fine_polygon).collect();
        let sides = || polygons.iter().flat_map(|polygon| polygon_sides(polygon));
        let count = sides().count();
        let bounds =
            polygons.iter().flatten().fold([Uv::MAX, Uv::MIN], |[low, high], p| [low.min(*p), high.max(*p)]);
        let (low, height) = (bounds[0].y, bounds[1].y - bounds[0].y);
        let mut region = Self { bands: vec![Vec::new(); count.div_ceil(2).min(MOST_BANDS)], low, height, bounds };
        for side in sides() {
            let [a, b] = side.map(|p| region.band(p.y));
            region.bands[a.min(b)..=a.max(b)].iter_mut().for_each(|band| band.push(side));
        }
        region
    }

    /// Returns the index of the band that holds parameter `v`, the first or last one beyond the loops; for a trimmed face alone.
    fn band(&self, v: f64) -> usize {
        let last = self.bands.len() - 1;
        // The same arithmetic for sides and points, so that a point's band has every side at its height. A cast cuts what is negative.
        ((((v - self.low) / self.height) * self.bands.len() as f64) as usize).min(last)
    }

    /// Returns lower and upper corner of a box around the loops; `None` without loops.
    pub(crate) fn bounds(&self) -> Option<[Uv; 2]> {
        (!self.bands.is_empty()).then_some(self.bounds)
    }

    /// Whether the box between two corners may hold a point inside the loops; a false positive only costs time.
    pub(crate) fn may_reach(&self, low: Uv, high: Uv) -> bool {
        if self.bands.is_empty() {
            return true;
        }
        let is_near = |[a, b]: &[Uv; 2]| a.min(*b).cmple(high).all() && a.max(*b).cmpge(low).all();
        let bands = &self.bands[self.band(low.y)..=self.band(high.y)];
        // Without a side in it the box is all inside or all outside.
        bands.iter().flatten().any(is_near) || self.contains(0.5 * (low + high))
    }

    /// Whether a parameter point lies inside the loops; without loops every point does.
    pub(crate) fn contains(&self, p: Uv) -> bool {
        self.bands.is_empty() || is_inside_sides(self.bands[self.band(p.y)].iter().copied(), p)
    }
}

/// Returns a loop as a polygon that follows it within [`LOOP_SHARE`] of its extent.
fn fine_polygon(trim: &TrimLoop) -> Vec<Uv> {
    let controls = trim.uses.iter().flat_map(|u| &u.uv.points).map(|c| c.truncate() / c.z);
    let (low, high) = controls.fold((Uv::MAX, Uv::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let tolerance = LOOP_SHARE * (high - low);
    trim.polygon(|span| piece_count(span.curve, span.ends, tolerance))
}

/// Returns into how many pieces to divide a span, so that their chords are beside it by no more than `tolerance` in u and v.
fn piece_count(curve: &UvCurve, [t0, t1]: [f64; 2], tolerance: Uv) -> usize {
    if curve.degree == 1 {
        return 1;
    }
    let [mut n, most] = SPAN_PIECES;
    let at = |share: f64| curve.evaluate(t0 + (t1 - t0) * share);
    while n < most {
        let step = 1.0 / n as f64;
        let is_beside = |k: usize| {
            let first = k as f64 * step;
            let off = at(first + 0.5 * step) - 0.5 * (at(first) + at(first + step));
            off.abs().cmpgt(tolerance).any()
        };
        if !(0..n).any(is_beside) {
            break;
        }
        n *= 2;
    }
    n
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::math::polygon::is_inside_polygons;
    use crate::nurbs::{ControlPoint, conic, sweep};
    use std::f64::consts::TAU;

    /// A plane with a round border, whose parameters are mm.
    pub(crate) fn disc(radius: f64) -> Face {
        let arc = conic::arc(&Frame::IDENTITY, radius, [0.0, TAU]);
        let points = arc.points.iter().map(|p| ControlPoint::weighted(p.position().truncate(), p.w)).collect();
        let uv = UvCurve { degree: arc.degree, knots: arc.knots, points };
        let uses = vec![EdgeUse { edge: None, reversed: false, uv }];
        let plane = sweep::plane(&Frame::IDENTITY, [[-radius, radius]; 2]);
        Face { loops: vec![TrimLoop { uses }], ..Face::whole(plane) }
    }

    #[test]
    fn a_disc_is_round() {
        let region = TrimRegion::new(&disc(10.0));
        for k in 0..1000 {
            // Between the corners of polygons of any number of sides.
            let along = Uv::from_angle(f64::from(k) * 0.0071);
            assert!(region.contains(9.9999 * along) && !region.contains(10.0001 * along), "{along}");
        }
        assert!(
            region.contains(Uv::ZERO)
                && !region.contains(Uv::new(0.0, 11.0))
                && !region.contains(Uv::new(0.0, -11.0))
        );
    }

    #[test]
    fn boxes_that_the_trims_do_not_reach_are_known() {
        let region = TrimRegion::new(&disc(10.0));
        let [low, high] = region.bounds().unwrap();
        assert!((low - Uv::splat(-10.0)).length() < 1e-4 && (high - Uv::splat(10.0)).length() < 1e-4);
        for (corner, reached) in
            [([-1.0, -1.0], true), ([6.5, 6.5], true), ([8.0, 8.0], false), ([-12.0, 0.0], false)]
        {
            let corner = Uv::from(corner);
            assert_eq!(region.may_reach(corner, corner + Uv::ONE), reached, "{corner}");
        }
        let whole = TrimRegion::new(&Face::whole(sweep::plane(&Frame::IDENTITY, [[-1.0, 1.0]; 2])));
        assert!(whole.bounds().is_none() && whole.may_reach(Uv::ZERO, Uv::ONE));
    }

    #[test]
    fn a_hole_alone_leaves_the_rest_of_the_domain() {
        let mut face = disc(10.0);
        face.surface = sweep::plane(&Frame::IDENTITY, [[-20.0, 20.0]; 2]);
        face.loops[0].uses[0].reversed = true;
        let region = TrimRegion::new(&face);
        let polygons = trim_polygons(&face);
        for (place, inside) in [(Uv::ZERO, false), (Uv::new(9.99, 0.0), false), (Uv::new(0.0, -10.01), true)] {
            assert_eq!(region.contains(place), inside, "{place}");
        }
        for (place, inside) in [(Uv::new(15.0, 0.0), true), (Uv::new(19.9, 19.9), true), (Uv::new(1.0, 2.0), false)]
        {
            assert_eq!(region.contains(place), inside, "{place}");
            assert_eq!(is_inside_polygons(&polygons, place), inside, "{place}");
        }
    }
}

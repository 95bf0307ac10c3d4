//! Opaque faces that lie against a luminous face: no light gets out between the two.

use crate::math::{Aabb, Frame, Point, Uv, Vector};
use crate::model::{Face, PlacedFace};
use crate::simulate::face_foot::{FaceSamples, NearestOnFace, PieceBoxes, foot_from};
use crate::simulate::trim_loops::{TrimRegion, trim_polygons};

/// Cosine below which two outward normals look at each other: −60°, as where the kernel asks for faces at one place.
const AGAINST: f64 = -0.5;

/// A face that covers what lies within the glue distance of it.
#[derive(Clone, Debug)]
pub(crate) struct Cover {
    face: Face,
    placement: Frame,
    trims: Trims,
    /// Around the face and what is within the glue distance of it.
    bounds: Aabb,
    /// Whether it has an outside, as faces of closed shells have; a sheet covers what lies on either side.
    one_sided: bool,
    glue_mm: f64,
}

/// The trims of a face, as what looks for a foot on it needs them.
#[derive(Clone, Debug)]
enum Trims {
    /// Of a face of first degree, which needs only inside tests: bands check a few sides for them, polygons all.
    Plane(TrimRegion),
    /// Of any other, with boxes around its pieces: the box around a reflector holds its lamp, which would else have a foot looked for at
    /// each ray.
    Curved(FaceSamples, PieceBoxes),
}

impl Trims {
    fn new(face: &Face) -> Self {
        if face.surface.degree == [1, 1] {
            Self::Plane(TrimRegion::new(face))
        } else {
            Self::Curved(FaceSamples::new(face, trim_polygons(face)), PieceBoxes::new(&face.surface))
        }
    }
}

impl Cover {
    /// Prepares a placed face with a box around it, mm; `None` for a ready mesh, which has no spline.
    pub(crate) fn new(placed: &PlacedFace<'_>, one_sided: bool, bounds: Aabb, glue_mm: f64) -> Option<Self> {
        let face = placed.face?;
        let (trims, bounds) = (Trims::new(face), bounds.grown(glue_mm));
        Some(Self { face: face.clone(), placement: *placed.placement, trims, bounds, one_sided, glue_mm })
    }

    /// Whether boxes leave open that it is within the glue distance of a point, mm, in scene coordinates.
    fn may_touch(&self, point: Point) -> bool {
        if !self.bounds.contains(point) {
            return false;
        }
        match &self.trims {
            Trims::Plane(_) => true,
            Trims::Curved(_, pieces) => {
                pieces.are_within(self.placement.local_point(point), self.glue_mm / self.placement.scale)
            }
        }
    }

    /// Whether it lies against a point (mm, scene coordinates) of a face with this outward normal there.
    pub(crate) fn covers(&self, point: Point, normal: Vector) -> bool {
        if !self.may_touch(point) {
            return false;
        }
        let surface = &self.face.surface;
        let local = self.placement.local_point(point);
        let nearest = match &self.trims {
            // In a plane every way leads to the foot, and no samples are needed to find where to begin.
            Trims::Plane(region) => {
                let [[u0, u1], [v0, v1]] = surface.domain();
                let uv = Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1));
                let inside = region.contains(uv);
                let distance = if inside { surface.evaluate(uv).distance(local) } else { f64::INFINITY };
                Some(foot_from(&self.face, |uv| region.contains(uv), local, NearestOnFace { distance, uv }))
            }
            Trims::Curved(samples, _) => samples.nearest(&self.face, local),
        };
        let near = nearest.filter(|n| n.distance * self.placement.scale <= self.glue_mm);
        // Faces that meet at an edge are as near to each other there, but do not look at each other.
        near.and_then(|n| surface.normal(n.uv)).is_some_and(|n| {
            let along = self.placement.normal(if self.face.reversed { -n } else { n }).dot(normal);
            along < AGAINST || !self.one_sided && along > -AGAINST
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Model, Part, Shell};
    use crate::nurbs::sweep;
    use crate::simulate::trim_loops::tests::disc;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn a_cup_covers_the_half_of_a_ball_that_lies_in_it() {
        let cup = sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, TAU], [-FRAC_PI_2, 0.0]);
        let shell = Shell { faces: vec![Face { reversed: true, ..Face::whole(cup) }], ..Shell::default() };
        let mut model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        let centre = Vector::new(7.0, -3.0, 2.0);
        model.instances[0].placement = Frame { scale: 2.0, ..Frame::translation(centre) };
        let placed = model.placed_faces().next().unwrap();
        let bounds = Aabb::from_points([centre - Vector::splat(10.0), centre + Vector::splat(10.0)]);
        for one_sided in [true, false] {
            let cover = Cover::new(&placed, one_sided, bounds, 1e-3).unwrap();
            for direction in [Vector::new(0.3, -0.5, -0.7), -Vector::Z, Vector::new(1.0, 2.0, -0.1)] {
                let normal = direction.normalize();
                let covers =
                    |radius: f64, normal: Vector| cover.covers(centre + direction.normalize() * radius, normal);
                assert!(covers(10.0, normal) && covers(9.9995, normal) && covers(10.0005, normal));
                assert!(!covers(9.99, normal) && !covers(10.01, normal), "farther than the glue");
                assert_eq!(covers(10.0, -normal), !one_sided, "the cup's own side");
                assert!(!cover.covers(centre - normal * 10.0, -normal), "the open half");
                let lamp = centre + direction.normalize() * 5.0;
                assert!(!cover.may_touch(lamp), "within the cup, 5 mm from its wall: no foot is looked for");
            }
        }
    }

    #[test]
    fn a_disc_covers_all_up_to_its_round_border() {
        let shell = Shell { faces: vec![disc(5.0)], ..Shell::default() };
        let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        let bounds = Aabb::from_points([Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 0.0)]);
        let cover = Cover::new(&model.placed_faces().next().unwrap(), false, bounds, 1e-3).unwrap();
        for k in 0..1000 {
            let (sin, cos) = f64::from(k).sin_cos();
            let way = Vector::new(cos, sin, 0.0);
            assert!(cover.covers(Point::ZERO + way * 4.999, -Vector::Z), "{k}");
            assert!(!cover.covers(Point::ZERO + way * 5.001, -Vector::Z), "{k}");
        }
    }
}

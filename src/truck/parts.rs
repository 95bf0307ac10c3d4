//! Optical parts by a handful of numbers, modelled by truck and exact as rational B-splines: a lens, reflectors.

use super::conic::{Conic, ShapeError, check_value};
use super::import::{Conversion, shell, solid};
use super::modeling::{Curve, Edge, Line, Point3, Rad, Shell, Solid, Vector3, Wire, builder};

/// A full turn for truck, which wants more than one.
const TURN: Rad<f64> = Rad(7.0);

/// Thinnest rim of a lens, mm: truck takes points that are nearer to each other for one.
const THINNEST_RIM: f64 = 1e-6;

/// A lens about the z axis: front vertex at the origin, light along +z meets the front first.
///
/// ```
/// use lampyris::truck::{Conic, Lens};
/// // Plano-convex: flat front, a hyperboloid behind that focuses n = 1.5 without aberration.
/// let lens = Lens { front: Conic::FLAT, back: Conic { radius: -25.0, conic: -2.25 }, thickness: 8.0, half_aperture: 12.0 };
/// let made = lens.model("condenser").unwrap();
/// assert!(made.refused.is_empty());
/// // Front, back and rim, in truck's three sectors.
/// assert_eq!(made.model.placed_face_count(), 9);
/// assert!(made.model.parts[0].shells[0].closed);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The surface at the origin.
    pub front: Conic,
    /// The surface at `thickness`.
    pub back: Conic,
    /// Between the vertices, mm.
    pub thickness: f64,
    /// Radius of the rim, mm.
    pub half_aperture: f64,
}

impl Lens {
    /// Makes the lens as a truck solid, mm: front, back and rim, turned about the z axis.
    ///
    /// # Errors
    /// When the surfaces meet anywhere within the aperture, its rim included, or do not reach it; when a radius is zero, thickness or
    /// aperture is not positive, or a number is not finite.
    pub fn solid(&self) -> Result<Solid, ShapeError> {
        let reach = self.half_aperture;
        let front = self.front.profile(0.0, reach)?;
        let back = self.back.profile(self.thickness, reach)?;
        // Both profiles reach the aperture, or they would have been refused.
        let rim = [self.front.sag(reach), self.back.sag(reach)].map(Option::unwrap_or_default);
        let edge = self.thickness + rim[1] - rim[0];
        check_value("the thickness", self.thickness, self.thickness > 0.0, "positive")?;
        check_value(
            "the thickness at the rim",
            edge,
            edge > THINNEST_RIM,
            "positive: make the lens thicker or the aperture smaller",
        )?;
        // Between axis and rim the thickness is least where the slopes are equal, if anywhere.
        if let Some(h) = self.front.equal_slope(&self.back).filter(|h| *h < reach)
            && let (Some(front), Some(back)) = (self.front.sag(h), self.back.sag(h))
        {
            let inner = self.thickness + back - front;
            check_value(
                "the thickness between axis and rim",
                inner,
                inner > 0.0,
                "positive: make the lens thicker",
            )?;
        }
        let at = |x: f64, z: f64| builder::vertex(Point3::new(x, 0.0, z));
        let vertices =
            [at(0.0, 0.0), at(reach, rim[0]), at(reach, self.thickness + rim[1]), at(0.0, self.thickness)];
        let side = Curve::Line(Line(vertices[1].point(), vertices[2].point()));
        let wire = Wire::from(vec![
            // From the axis outwards, around the rim and back: turned about the axis the wire closes itself.
            Edge::new(&vertices[0], &vertices[1], front),
            Edge::new(&vertices[1], &vertices[2], side),
            Edge::new(&vertices[3], &vertices[2], back).inverse(),
        ]);
        Ok(Solid::new(vec![builder::cone(&wire, Vector3::unit_z(), TURN)]))
    }

    /// Makes the lens as a model, mm, in truck's three sectors.
    ///
    /// # Errors
    /// As [`Lens::solid`].
    pub fn model(&self, name: &str) -> Result<Conversion, ShapeError> {
        Ok(solid(name, &self.solid()?))
    }
}

/// A reflector about the z axis: a conic shell that opens towards +z, its vertex at the origin.
///
/// ```
/// use lampyris::truck::{Conic, Reflector};
/// let dish = Reflector { shape: Conic::paraboloid(25.0), half_aperture: 60.0, hole: 0.0 };
/// assert_eq!(dish.focus(), Some(25.0));
/// assert_eq!(dish.model("dish").unwrap().model.placed_face_count(), 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// The shape; its radius is positive.
    pub shape: Conic,
    /// Radius of the opening, mm.
    pub half_aperture: f64,
    /// Radius of a hole at the vertex, mm; 0 for none.
    pub hole: f64,
}

impl Reflector {
    /// Returns part of an ellipsoid of semi-axes `a` (along z) and `b`, with the vertex at the origin and foci at `a ∓ √(a²−b²)`.
    ///
    /// # Errors
    /// When `b` is not positive, or not below `a`.
    pub fn ellipsoid(a: f64, b: f64, half_aperture: f64) -> Result<Self, ShapeError> {
        check_value("the semi-axis b", b, b > 0.0 && b < a, "positive and below the semi-axis a")?;
        let shape = Conic { radius: b * b / a, conic: b * b / (a * a) - 1.0 };
        Ok(Self { shape, half_aperture, hole: 0.0 })
    }

    /// Returns the height of the focus nearest to the vertex, mm; `None` for conics without one (K above 0).
    pub fn focus(&self) -> Option<f64> {
        // R = a(1 − e²) and K = −e² put the near focus at R/(1 + e).
        (self.shape.conic <= 0.0).then(|| self.shape.radius / (1.0 + (-self.shape.conic).sqrt()))
    }

    /// Makes the reflector as an open truck shell, mm.
    ///
    /// # Errors
    /// When the shape does not reach the aperture, the hole is negative or as large, the radius is zero, or a number is not finite.
    pub fn shell(&self) -> Result<Shell, ShapeError> {
        check_value(
            "the hole",
            self.hole,
            (0.0..self.half_aperture).contains(&self.hole),
            "zero or more, below the aperture",
        )?;
        let mut profile = self.shape.profile(0.0, self.half_aperture)?;
        if self.hole > 0.0 {
            profile = self.cut_hole(profile)?;
        }
        let at = |h: f64| Ok(builder::vertex(Point3::new(h, 0.0, self.shape.sag_within(h)?)));
        let (inner, outer) = (at(self.hole)?, at(self.half_aperture)?);
        let wire = Wire::from(vec![Edge::new(&inner, &outer, profile)]);
        // With a hole the profile ends off the axis, without one on it: truck has a sweep for each.
        Ok(if self.hole > 0.0 {
            builder::rsweep(&wire, Point3::new(0.0, 0.0, 0.0), Vector3::unit_z(), TURN)
        } else {
            builder::cone(&wire, Vector3::unit_z(), TURN)
        })
    }

    /// Cuts the profile at the hole's radius and returns the part outside of it.
    fn cut_hole(&self, mut profile: Curve) -> Result<Curve, ShapeError> {
        use super::modeling::{BoundedCurve, Cut, ParametricCurve};
        let (t0, t1) = profile.range_tuple();
        let off = |t: f64| profile.subs(t).x - self.hole;
        let t = crate::math::safe_newton(|t| (off(t), profile.der(t).x), t0, t1, 0.0);
        let t = t.ok_or(ShapeError { what: "the hole", value: self.hole, allowed: "inside the aperture" })?;
        Ok(profile.cut(t))
    }

    /// Makes the reflector as a model, mm; normals point towards the axis, where the light comes from.
    ///
    /// # Errors
    /// As [`Reflector::shell`].
    pub fn model(&self, name: &str) -> Result<Conversion, ShapeError> {
        let mut made = shell(name, &self.shell()?);
        // Truck's wires decide the side of an open shell; ours is the mirror's front, where the axis is.
        for face in made.model.parts.iter_mut().flat_map(|p| &mut p.shells).flat_map(|s| &mut s.faces) {
            let [[u0, u1], [v0, v1]] = face.surface.domain();
            let uv = crate::math::Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1));
            let p = face.surface.evaluate(uv);
            if let Some(n) = face.surface.normal(uv) {
                face.reversed = n.x * p.x + n.y * p.y > 0.0;
            }
        }
        Ok(made)
    }
}

//! Faces: a surface with trimming loops, or a ready mesh.

use super::edge::EdgeId;
use crate::math::{Frame, Uv};
use crate::mesh::FacetMesh;
use crate::nurbs::{Surface, UvCurve, area_within, least_area_within};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

/// Red, green, blue in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Colour(pub [f64; 3]);

/// As `#rrggbb`, 255 steps a channel; values beyond `[0, 1]` are clamped.
impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.0.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        write!(f, "#{r:02x}{g:02x}{b:02x}")
    }
}

/// What a surface was before it became a spline, kept for closed-form inversion and for users.
///
/// Frames and lengths are in the part's coordinates, mm; parameters follow [`crate::nurbs::sweep`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Analytic {
    /// `frame.origin + u·x + v·y`.
    Plane {
        /// Position.
        frame: Frame,
    },
    /// About the z axis of the frame.
    Cylinder {
        /// Position.
        frame: Frame,
        /// mm.
        radius: f64,
    },
    /// `radius` at height 0, growing by `tan(half_angle)` per mm along z.
    Cone {
        /// Position.
        frame: Frame,
        /// mm.
        radius: f64,
        /// Radians.
        half_angle: f64,
    },
    /// About the frame's origin.
    Sphere {
        /// Position.
        frame: Frame,
        /// mm.
        radius: f64,
    },
    /// About the z axis of the frame.
    Torus {
        /// Position.
        frame: Frame,
        /// mm.
        major: f64,
        /// mm.
        minor: f64,
    },
    /// A curve turned about an axis.
    Revolution,
    /// A curve moved along a direction.
    Extrusion,
    /// Fitted to an offset of another surface.
    Offset,
    /// A B-spline with all weights equal.
    Bspline,
    /// A rational B-spline.
    Rational,
    /// Anything else.
    Other,
}

/// The kind of a face's surface, as the file had it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
#[non_exhaustive]
pub enum SurfaceKind {
    Plane,
    Cylinder,
    Cone,
    Sphere,
    Torus,
    Revolution,
    Extrusion,
    Offset,
    Bspline,
    Rational,
    Tessellated,
    Other,
}

impl SurfaceKind {
    /// All kinds, in the order in which reports list them.
    pub const ALL: [Self; 12] = [
        Self::Plane,
        Self::Cylinder,
        Self::Cone,
        Self::Sphere,
        Self::Torus,
        Self::Revolution,
        Self::Extrusion,
        Self::Offset,
        Self::Bspline,
        Self::Rational,
        Self::Tessellated,
        Self::Other,
    ];

    /// The word for it in reports and selectors, in lower case.
    pub fn word(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::Sphere => "sphere",
            Self::Torus => "torus",
            Self::Revolution => "revolution",
            Self::Extrusion => "extrusion",
            Self::Offset => "offset",
            Self::Bspline => "bspline",
            Self::Rational => "rational",
            Self::Tessellated => "tessellated",
            Self::Other => "other",
        }
    }
}

impl fmt::Display for SurfaceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

impl Analytic {
    /// Its kind, without frames and lengths.
    pub fn kind(&self) -> SurfaceKind {
        match self {
            Self::Plane { .. } => SurfaceKind::Plane,
            Self::Cylinder { .. } => SurfaceKind::Cylinder,
            Self::Cone { .. } => SurfaceKind::Cone,
            Self::Sphere { .. } => SurfaceKind::Sphere,
            Self::Torus { .. } => SurfaceKind::Torus,
            Self::Revolution => SurfaceKind::Revolution,
            Self::Extrusion => SurfaceKind::Extrusion,
            Self::Offset => SurfaceKind::Offset,
            Self::Bspline => SurfaceKind::Bspline,
            Self::Rational => SurfaceKind::Rational,
            Self::Other => SurfaceKind::Other,
        }
    }

    /// Radius of a cylinder or sphere, or of a torus' tube, mm in the part's coordinates; `None` for all others, also for a cone, which has
    /// many.
    pub fn radius(&self) -> Option<f64> {
        match *self {
            Self::Cylinder { radius, .. } | Self::Sphere { radius, .. } => Some(radius),
            Self::Torus { minor, .. } => Some(minor),
            _ => None,
        }
    }
}

/// A trimmed surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Face {
    /// Name in the file, empty when it had none.
    pub name: String,
    /// The `#id` of the face in its file, when it came from one.
    pub entity: Option<u64>,
    /// Colour of the face itself; parts have one too.
    pub colour: Option<Colour>,
    /// Layer of the face, or of the solid that it belongs to.
    pub layer: Option<Arc<str>>,
    /// The surface as a rational B-spline.
    pub surface: Surface,
    /// What it was in the file.
    pub analytic: Analytic,
    /// Whether the outward normal is `-(Su × Sv)`.
    pub reversed: bool,
    /// Trimming loops, within the domain of the surface: outer ones counter-clockwise in its parameters, holes clockwise. Without any the
    /// face is the whole domain, and where there are holes alone it goes on to the border of that.
    pub loops: Vec<TrimLoop>,
    /// Largest measured distance between an edge in space and its uv curve on the surface, mm in the part's coordinates.
    pub gap: f64,
}

/// Corners this near to one plane, as a share of their distances, span one: rounding of a file's twelve digits.
const PLANE: f64 = 1e-10;

impl Face {
    /// Whether it is one bilinear patch in a plane within straight lines, which facets follow to rounding.
    pub fn is_polygon(&self) -> bool {
        let is_straight = self.loops.iter().flat_map(|l| &l.uses).all(|u| u.uv.degree == 1);
        self.surface.degree == [1, 1] && self.surface.points.len() == 4 && is_straight && self.is_plane()
    }

    /// Whether all control points of its surface lie in the plane that the corners of the domain span, so that facets have its normal. A
    /// surface whose corners meet, as those of a disc do, counts as curved.
    pub fn is_plane(&self) -> bool {
        let surface = &self.surface;
        let [[u0, u1], [v0, v1]] = surface.domain();
        let corners =
            [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)].map(|uv| surface.evaluate(uv));
        // Of a quadrangle in a plane the diagonals span that plane.
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b);
        let size = (c - a).length().max((d - b).length());
        let off = PLANE * size * normal.length();
        let in_plane = surface.points.iter().all(|p| (p.truncate() / p.w - a).dot(normal).abs() <= off);
        in_plane && normal.length() > PLANE * size * size
    }

    /// A nameless face that is the whole domain of its surface, with `Su × Sv` outward.
    pub fn whole(surface: Surface) -> Self {
        Self {
            name: String::new(),
            entity: None,
            colour: None,
            layer: None,
            surface,
            analytic: Analytic::Other,
            reversed: false,
            loops: Vec::new(),
            gap: 0.0,
        }
    }

    /// Returns the loops that bound the face: its own, and behind holes alone the border of the domain. Without loops none: the face is the
    /// whole domain.
    pub(crate) fn bounding_loops(&self) -> Cow<'_, [TrimLoop]> {
        if !self.has_holes_alone() {
            return Cow::Borrowed(&self.loops);
        }
        Cow::Owned(self.loops.iter().cloned().chain([self.domain_border()]).collect())
    }

    /// Whether it has loops that only cut holes: all in all they run clockwise.
    pub(crate) fn has_holes_alone(&self) -> bool {
        // Most faces are decided at once: meshing calls this for each of them, and the integral took a twentieth of its time.
        let least = |l: &TrimLoop| least_area_within(l.uses.iter().map(|u| (&u.uv, u.reversed)));
        if self.loops.iter().map(least).sum::<f64>() >= 0.0 {
            return false;
        }
        // The area of a loop like an eight is rounding, whose sign says nothing.
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        self.loops.iter().map(TrimLoop::signed_area).sum::<f64>() < -NO_AREA * (u1 - u0) * (v1 - v0)
    }

    /// Returns a loop counter-clockwise around the domain of the surface, of four uses without edges. On a surface that closes on itself
    /// two of them are the sides of a seam, along which the face goes on; one at a pole is a point in space.
    pub(crate) fn domain_border(&self) -> TrimLoop {
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        let corners = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
        let side = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            let t = if k.is_multiple_of(2) { [u0, u1] } else { [v0, v1] };
            // Opposite sides run over the same parameters, so that a seam's two sides have the same samples.
            let uv = if k < 2 { UvCurve::line(a, b, t) } else { UvCurve::line(b, a, t) };
            EdgeUse { edge: None, reversed: k >= 2, uv }
        };
        TrimLoop { uses: (0..4).map(side).collect() }
    }
}

/// Share of the domain below which the area within loops is rounding.
const NO_AREA: f64 = 1e-12;

/// A closed chain of edge uses in the parameter plane.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TrimLoop {
    /// In order of traversal, each ending where the next begins.
    pub uses: Vec<EdgeUse>,
}

impl TrimLoop {
    /// Returns the loop as a polygon in its own direction, which does not repeat its start at the end: `pieces` says into how many pieces a
    /// span of a use is divided.
    pub(crate) fn polygon(&self, pieces: impl Fn(&UseSpan<'_>) -> usize) -> Vec<Uv> {
        let mut points = Vec::new();
        for u in &self.uses {
            let breaks = u.uv.breakpoints();
            let start = points.len();
            for span in breaks.windows(2) {
                let count = pieces(&UseSpan { curve: &u.uv, ends: [span[0], span[1]], spans: breaks.len() - 1 });
                let share = |k: usize| k as f64 / count as f64;
                points.extend((0..count).map(|k| u.uv.evaluate(span[0] + (span[1] - span[0]) * share(k))));
            }
            points.push(u.uv.evaluate(breaks[breaks.len() - 1]));
            if u.reversed {
                // In the loop's direction, for the polygon to close.
                points[start..].reverse();
            }
            // The next use begins with this point.
            points.pop();
        }
        points
    }

    /// Returns the area within the loop in parameters, positive where it runs counter-clockwise.
    pub(crate) fn signed_area(&self) -> f64 {
        area_within(self.uses.iter().map(|u| (&u.uv, u.reversed)))
    }
}

/// A span of the spline of an edge use.
pub(crate) struct UseSpan<'u> {
    pub(crate) curve: &'u UvCurve,
    /// Its parameters.
    pub(crate) ends: [f64; 2],
    /// How many spans the curve has.
    pub(crate) spans: usize,
}

/// One side of an edge, as a face's loop runs along it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EdgeUse {
    /// The edge; `None` for a pole or a joint of no length, which exists in the parameter plane alone.
    pub edge: Option<EdgeId>,
    /// Whether the loop runs against the edge's parameter.
    pub reversed: bool,
    /// The edge in the parameter plane, over the edge's own parameter interval (never reversed).
    pub uv: UvCurve,
}

impl EdgeUse {
    /// Surface parameters where the loop enters this use.
    pub fn start(&self) -> Uv {
        let [t0, t1] = self.uv.domain();
        self.uv.evaluate(if self.reversed { t1 } else { t0 })
    }

    /// Surface parameters where the loop leaves this use.
    pub fn end(&self) -> Uv {
        let [t0, t1] = self.uv.domain();
        self.uv.evaluate(if self.reversed { t0 } else { t1 })
    }
}

/// A face that the file gives as a ready mesh (AP242 tessellated geometry), without a surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TessellatedFace {
    /// Name in the file, empty when it had none.
    pub name: String,
    /// The `#id` of the face in its file.
    pub entity: Option<u64>,
    /// Colour of the face itself.
    pub colour: Option<Colour>,
    /// Layer of the face.
    pub layer: Option<Arc<str>>,
    /// The facets, all of face 0.
    pub mesh: FacetMesh,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vector;
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn planes_are_told_from_curved_surfaces() {
        let tilted = Frame::from_axis(Vector::new(1e4, -3.0, 7.0), Vector::new(0.3, -0.2, 0.9), None);
        let is_plane = |surface: Surface| Face::whole(surface).is_plane();
        let mut square = sweep::plane(&tilted, [[0.0, 20.0], [0.0, 1.0]]);
        assert!(is_plane(square.clone()));
        // A corner lifted by a millionth of the square bends it; a cylinder closed or open, and a sphere, are none.
        square.points[3] += (1e-5 * tilted.z).extend(0.0);
        assert!(!is_plane(square));
        for angle in [FRAC_PI_2, TAU] {
            assert!(!is_plane(sweep::cylinder(&tilted, 5.0, [0.0, angle], [0.0, 10.0])));
        }
        assert!(!is_plane(sweep::sphere(&tilted, 5.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2])));
    }
}

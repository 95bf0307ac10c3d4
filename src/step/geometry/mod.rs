//! Curves and surfaces of the file, in mm and radians.
//!
//! Source: ISO 10303-42. A curve becomes a closed form where there is one, else a rational spline (`curves`, `composite`, `joints`,
//! `pcurves`), an edge the part of its curve between its vertices (`edges`, `closing`), a surface a chart (`surfaces`, `elementary`,
//! `swept_surfaces`). What cannot be read is a [`Refusal`] that names the entity and the reason. Curves may lie on surfaces and surfaces
//! be swept from curves: the readers call each other as methods of [`GeometryReader`], their types do not depend on each other.

pub(super) mod closing;
pub(super) mod composite;
pub(super) mod curves;
pub(super) mod edges;
mod elementary;
pub(super) mod extent;
mod joints;
mod meridian;
pub(super) mod pcurves;
pub(super) mod surfaces;
mod swept_surfaces;
mod tolerances;
pub(super) mod units;

pub(super) use self::tolerances::EMPTY_EDGE_MM;
use self::tolerances::{PARALLEL_AXIS, UPRIGHT_AXIS};
use self::units::Units;
use crate::math::{Frame, Point, Vector};
use crate::step::part21::{Args, Entity, File};

/// Farthest coordinate, mm: a million kilometres, where doubles are 1e-4 mm apart.
pub(crate) const FARTHEST_MM: f64 = 1e12;

/// Largest components of a direction whose squares neither vanish nor overflow.
const EXACT_LENGTHS: std::ops::Range<f64> = 1e-100..1e100;

/// Why a piece of geometry cannot be converted: the entity and the reason.
#[derive(Clone, Debug)]
pub(crate) struct Refusal {
    /// The `#id` that is to blame.
    pub(crate) id: u64,
    /// Its name in the file.
    pub(crate) entity: String,
    /// What is wrong with it.
    pub(crate) reason: String,
}

/// The entity as read, or why it was refused.
pub(crate) type Outcome<T> = Result<T, Refusal>;

impl Refusal {
    /// Makes the refusal that blames an entity.
    pub(crate) fn new(entity: Entity<'_, '_>, reason: impl Into<String>) -> Self {
        Self { id: entity.id, entity: entity.name(), reason: reason.into() }
    }

    /// Makes the refusal of a list of `e` with an entry, as `$`, that refers to nothing.
    pub(crate) fn no_reference(e: Entity<'_, '_>) -> Self {
        Self::new(e, "an entry of its list is no reference")
    }

    /// Makes the refusal of what is referred to but stands nowhere.
    pub(crate) fn missing(id: u64) -> Self {
        Self { id, entity: "an instance".into(), reason: "is referred to but is not in the file".into() }
    }
}

/// Returns the ids of a list of `e`; refuses one with an entry that is no reference.
pub(crate) fn references(e: Entity<'_, '_>, list: Args<'_, '_>) -> Outcome<Vec<u64>> {
    list.refs().ok_or_else(|| Refusal::no_reference(e))
}

/// Refuses a point, mm, of `e` with a coordinate beyond [`FARTHEST_MM`] or that is no number.
pub(crate) fn within_reach(e: Entity<'_, '_>, point: Point) -> Outcome<Point> {
    if point.abs().max_element() <= FARTHEST_MM {
        return Ok(point);
    }
    Err(Refusal::new(
        e,
        format!("a coordinate is beyond {FARTHEST_MM:e} mm, too far out for double precision to hold a shape"),
    ))
}

/// Reads geometry in mm and radians.
#[derive(Clone, Copy)]
pub(crate) struct GeometryReader<'f, 'a> {
    pub(crate) file: &'f File<'a>,
    pub(crate) units: Units,
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Returns the instance with an id, or a refusal that says that the file has none.
    pub(crate) fn entity(&self, id: u64) -> Outcome<Entity<'f, 'a>> {
        self.file.entity(id).ok_or_else(|| Refusal::missing(id))
    }

    /// Returns the instance #`id`, which `from` refers to. Where there is no id, refuses in `from`'s name that `what` is missing; where the
    /// file has no such instance, in the id's.
    pub(crate) fn resolve(&self, from: Entity<'f, 'a>, id: Option<u64>, what: &str) -> Outcome<Entity<'f, 'a>> {
        match id {
            Some(id) => self.entity(id),
            None => Err(Refusal::new(from, format!("{what} is missing"))),
        }
    }

    /// Reads a list of `e` of references to CARTESIAN_POINTs, mm; refuses what [`point`](Self::point) refuses, and an entry that is no
    /// reference.
    pub(crate) fn points(&self, e: Entity<'f, 'a>, list: Args<'f, 'a>) -> Outcome<Vec<Point>> {
        references(e, list)?.into_iter().map(|id| self.point(id)).collect()
    }

    /// Reads a CARTESIAN_POINT, mm; z is 0 for two coordinates. Refuses coordinates beyond [`FARTHEST_MM`] and other numbers of them.
    pub(crate) fn point(&self, id: u64) -> Outcome<Point> {
        let e = self.entity(id)?;
        let xs = e.attributes("CARTESIAN_POINT", 1).map(|a| a.list(0)).and_then(|l| l.reals());
        let point = match xs.as_deref() {
            Some([x, y, z]) => self.units.length * Point::new(*x, *y, *z),
            Some([x, y]) => self.units.length * Point::new(*x, *y, 0.0),
            _ => return Err(Refusal::new(e, "is no point of two or three coordinates")),
        };
        within_reach(e, point)
    }

    /// Reads the place of a VERTEX_POINT, or of a CARTESIAN_POINT in its place, mm; refuses anything else.
    pub(crate) fn vertex(&self, id: u64) -> Outcome<Point> {
        let e = self.entity(id)?;
        match e.attributes("VERTEX_POINT", 1).and_then(|a| a.id(0)) {
            Some(point) => self.point(point),
            None if e.is_a("CARTESIAN_POINT") => self.point(id),
            None => Err(Refusal::new(e, "is no vertex with a point")),
        }
    }

    /// Reads a DIRECTION of two or three components, of any length that can be squared; `None` when absent, broken or zero.
    pub(crate) fn direction(&self, id: Option<u64>) -> Option<Vector> {
        let e = self.file.entity(id?)?;
        let xs = e.attributes("DIRECTION", 1)?.list(0).reals()?;
        let d = match xs.as_slice() {
            [x, y, z] => Vector::new(*x, *y, *z),
            [x, y] => Vector::new(*x, *y, 0.0),
            _ => return None,
        };
        // Of numbers near the ends of what a double holds the length would be none.
        let largest = d.abs().max_element();
        (d.is_finite() && largest > 0.0).then(|| if EXACT_LENGTHS.contains(&largest) { d } else { d / largest })
    }

    /// Reads a VECTOR with its magnitude, mm; a magnitude of zero or none counts as one unit.
    pub(crate) fn vector(&self, id: u64) -> Outcome<Vector> {
        let e = self.entity(id)?;
        let args = e.attributes("VECTOR", 1);
        let direction = args.and_then(|a| self.direction(a.id(0))).and_then(|d| d.try_normalize());
        // A magnitude of zero, which files hold, would leave no vector: the direction counts then.
        let magnitude = args.and_then(|a| a.real(1)).filter(|m| *m != 0.0).unwrap_or(1.0);
        match direction {
            Some(d) => Ok(d * (magnitude * self.units.length)),
            None => Err(Refusal::new(e, "is no vector with a direction")),
        }
    }

    /// Reads an AXIS1_PLACEMENT, AXIS2_PLACEMENT_2D or AXIS2_PLACEMENT_3D as a right-handed frame, mm. Missing location and axes are those
    /// of the space.
    pub(crate) fn placement(&self, id: u64) -> Outcome<Frame> {
        let e = self.entity(id)?;
        let args = ["AXIS2_PLACEMENT_3D", "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_2D"];
        let Some((name, args)) = args.into_iter().find_map(|n| Some((n, e.attributes(n, 1)?))) else {
            return Err(Refusal::new(e, "is no placement"));
        };
        // In complex form the location belongs to PLACEMENT.
        let separate = e.attributes("PLACEMENT", 1);
        let location = separate.map_or_else(|| args.id(0), |p| p.id(0));
        let first = if separate.is_some() { 0 } else { 1 };
        let origin = match location {
            Some(point) => self.point(point)?,
            None => Point::ZERO,
        };
        Ok(match name {
            "AXIS2_PLACEMENT_2D" => Frame::from_axis(origin, Vector::Z, self.direction(args.id(first))),
            _ => {
                // ISO 10303-42, `build_axes`: without an axis the placement's Z is that of the space.
                let axis = self.direction(args.id(first)).unwrap_or(Vector::Z);
                // There, `first_proj_axis`: without a reference the space's X, projected, wherever it leaves any.
                let reference = self.direction(args.id(first + 1)).unwrap_or(Vector::X);
                Frame::from_axis(origin, axis, Some(reference))
            }
        })
    }

    /// Reads a placement, or a CARTESIAN_TRANSFORMATION_OPERATOR_3D, which may scale and mirror, as a frame, mm: the target of a mapped
    /// item, or what takes one representation into another. A missing origin or scale is that of the space, axes are those of
    /// [`base_axes`]. Refuses scales that are not positive and operators of two dimensions.
    pub(crate) fn transformation(&self, id: u64) -> Outcome<Frame> {
        let e = self.entity(id)?;
        if e.is_a("CARTESIAN_TRANSFORMATION_OPERATOR_2D") {
            return Err(Refusal::new(e, "is an operator of two dimensions"));
        }
        let Some(args) = e.attributes("CARTESIAN_TRANSFORMATION_OPERATOR", 1).or_else(|| {
            // The simple form has its five attributes behind the name of the representation item, and its own name and description.
            let skip = e.args().len().saturating_sub(5).max(1);
            e.attributes("CARTESIAN_TRANSFORMATION_OPERATOR_3D", skip)
        }) else {
            return self.placement(id);
        };
        let origin = match args.id(2) {
            Some(point) => self.point(point)?,
            None => Point::ZERO,
        };
        let scale = args.real(3).unwrap_or(1.0);
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Refusal::new(e, "scale is not positive"));
        }
        let axis3 = if e.keyword().is_empty() {
            e.attributes("CARTESIAN_TRANSFORMATION_OPERATOR_3D", 0).and_then(|a| a.id(0))
        } else {
            args.id(4)
        };
        let axes = [args.id(0), args.id(1), axis3].map(|id| self.direction(id));
        Ok(Frame { scale, ..base_axes(origin, axes) })
    }
}

/// Returns the axes of an operator from its three directions, of any length: a missing one is that of the space, the first is projected
/// across the third and the second across both, so that it may mirror (ISO 10303-42, `base_axis`).
///
/// Where nothing is left of the second, which the standard leaves open, the axes are right-handed. The standard takes the space's Z for a
/// third axis that is not given whatever the first two are, and thereby loses their tilt: where both are given and do not lie in the
/// space's xy plane, it is their product instead, as in OpenCASCADE, so that the second keeps its direction. In that plane the product
/// would be Z or its opposite: there the standard is followed, which may mirror, as OpenCASCADE never does.
fn base_axes(origin: Point, [axis1, axis2, axis3]: [Option<Vector>; 3]) -> Frame {
    let product = axis1.zip(axis2).map(|(x, y)| x.normalize().cross(y.normalize()));
    // Of parallel axes the product is rounding.
    let normal = product.filter(|n| n.length() > PARALLEL_AXIS).and_then(|n| n.try_normalize());
    let tilted = normal.filter(|n| n.cross(Vector::Z).length() > UPRIGHT_AXIS);
    let z = axis3.or(tilted).unwrap_or(Vector::Z);
    let mut frame = Frame::from_axis(origin, z, Some(axis1.unwrap_or(Vector::X)));
    if axis2.unwrap_or(Vector::Y).normalize().dot(frame.y) < -PARALLEL_AXIS {
        frame.y = -frame.y;
    }
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All eight combinations about axes of the space, with each sign that makes a difference.
    #[test]
    fn axes_that_an_operator_lacks_are_those_of_the_standard() {
        let (x, y, z) = (Vector::X, Vector::Y, Vector::Z);
        let (tilted, rounded) = (Vector::new(0.0, 0.6, 0.8), Vector::new(0.0, 1e-8, 1.0));
        for (given, expected) in [
            ([None, None, None], [x, y, z]),
            ([Some(-x), None, None], [-x, y, z]),
            ([None, Some(-y), None], [x, -y, z]),
            ([None, None, Some(-z)], [x, y, -z]),
            ([Some(-x), Some(y), None], [-x, y, z]),
            ([Some(y), Some(x), None], [y, x, z]),
            ([Some(x), None, Some(-z)], [x, y, -z]),
            ([Some(x), None, Some(z)], [x, y, z]),
            ([None, Some(-y), Some(-z)], [x, -y, -z]),
            ([Some(y), Some(z), Some(x)], [y, z, x]),
            ([Some(z), Some(y), Some(x)], [z, y, x]),
            // Nothing is left of the space's Y, or of its Z.
            ([None, None, Some(x)], [y, z, x]),
            ([Some(y), None, Some(z)], [y, -x, z]),
            ([Some(x), Some(z), None], [x, z, -y]),
            // Out of the xy plane by any angle the second axis keeps its direction; rounding of either changes no more than its digits.
            ([Some(x), Some(tilted), None], [x, tilted, Vector::new(0.0, -0.8, 0.6)]),
            ([Some(x), Some(rounded), None], [x, rounded, Vector::new(0.0, -1.0, 1e-8)]),
            ([Some(x), Some(-rounded), None], [x, -rounded, Vector::new(0.0, 1.0, -1e-8)]),
            // The third axis decides where it is given, and parallel axes have no product.
            ([Some(x), Some(tilted), Some(z)], [x, y, z]),
            ([Some(x), Some(x), None], [x, y, z]),
        ] {
            let frame = base_axes(Point::ZERO, given.map(|axis| axis.map(|a| 3.0 * a)));
            let off = [frame.x - expected[0], frame.y - expected[1], frame.z - expected[2]];
            assert!(off.iter().all(|d| d.length() < 1e-15), "{given:?}: {frame:?}");
        }
        // Across each other only after they are projected: z = (0.6, 0, 0.8) leaves (0.8, 0, -0.6) of X and all of Y.
        let frame = base_axes(Point::ZERO, [None, Some(z - y), Some(Vector::new(0.6, 0.0, 0.8))]);
        assert!((frame.x - Vector::new(0.8, 0.0, -0.6)).length() < 1e-15 && (frame.y + y).length() < 1e-15);
    }
}

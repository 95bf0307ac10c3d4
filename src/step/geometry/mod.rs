//! Curves and surfaces of the file, in mm and radians.
//!
//! Source: ISO 10303-42. A curve becomes a closed form where there is one and a rational spline else (`curves`, `composite`,
//! `pcurves`), an edge the part of its curve between its vertices (`edges`), a surface a chart (`surfaces`, `elementary`,
//! `swept_surfaces`). What cannot be had is a [`Refusal`] that names the entity and the reason. Curves may lie on surfaces and surfaces
//! be swept from curves: the readers call each other as methods of [`GeometryReader`], their types do not depend on each other.

pub(super) mod composite;
pub(super) mod curves;
pub(super) mod edges;
mod elementary;
pub(super) mod extent;
mod meridian;
pub(super) mod pcurves;
pub(super) mod surfaces;
mod swept_surfaces;
mod tolerances;
pub(super) mod units;

pub(super) use self::tolerances::EMPTY_EDGE_MM;
use self::units::Units;
use crate::math::{Frame, Point, Vector};
use crate::step::part21::{Args, Entity, File};

/// Farthest coordinate, mm: a million kilometres, where doubles are 1e-4 mm apart.
pub(crate) const FARTHEST_MM: f64 = 1e12;

/// Largest components of a direction whose squares neither vanish nor overflow.
const EXACT_LENGTHS: std::ops::Range<f64> = 1e-100..1e100;

/// Why a piece of geometry cannot be had: the entity and the reason.
#[derive(Clone, Debug)]
pub(crate) struct Refusal {
    /// The `#id` that is to blame.
    pub(crate) id: u64,
    /// Its name in the file.
    pub(crate) entity: String,
    /// What is wrong with it.
    pub(crate) reason: String,
}

/// What was read, or why not.
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
    /// item, or what takes one representation into another. A missing origin, scale or axis is that of the space, the third axis the
    /// product of the first two where both are given. Refuses scales that are not positive and operators of two dimensions.
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
        let axis1 = self.direction(args.id(0));
        let axis2 = self.direction(args.id(1));
        // Without its third axis the operator takes what the other two leave, as OpenCASCADE does; with fewer, the Z of the space, which
        // `base_axis` of ISO 10303-42 would take at once.
        let z = self.direction(axis3).or_else(|| Some(axis1?.cross(axis2?))).unwrap_or(Vector::Z);
        // As of a placement.
        let mut frame = Frame::from_axis(origin, z, Some(axis1.unwrap_or(Vector::X)));
        // An operator may mirror; its second axis says so.
        if axis2.is_some_and(|y| y.dot(frame.y) < 0.0) {
            frame.y = -frame.y;
        }
        Ok(Frame { scale, ..frame })
    }
}

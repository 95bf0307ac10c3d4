//! Bounded curves as splines: trimmed, composite, and whole curves.

use super::curves::{
    COMPOSITES, CurveShape, DirectedCurve, MAX_DEPTH, SPLINES, SURFACE_CURVES, polyline_lengths, space_curve,
};
use super::joints::{JoinedCurve, Joint, join_segments};
use super::tolerances::SEAM_SHARE;
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Aabb, Frame, Point};
use crate::nurbs::Curve;
use crate::step::part21::{Args, Entity};
use rustc_hash::FxHashMap;

/// Most segments of one composite curve, those of its segments counted with them.
const MAX_SEGMENTS: u64 = 100_000;
/// Kinds of entities between a composite curve and the segments of the composite curves in it.
const AROUND_SEGMENTS: [&str; 12] = [
    "COMPOSITE_CURVE",
    "COMPOSITE_CURVE_ON_SURFACE",
    "BOUNDARY_CURVE",
    "OUTER_BOUNDARY_CURVE",
    "COMPOSITE_CURVE_SEGMENT",
    "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT",
    "TRIMMED_CURVE",
    "CURVE_REPLICA",
    "OFFSET_CURVE_3D",
    "SURFACE_CURVE",
    "SEAM_CURVE",
    "INTERSECTION_CURVE",
];

/// Kinds of entities whose parameter is that of the curve which they trim, move or place.
const KEEP_PARAMETER: [&str; 3] = ["TRIMMED_CURVE", "OFFSET_CURVE_3D", "CURVE_REPLICA"];
/// Kinds of entities whose parameter a rational spline has at its knots alone.
const CONICS: [&str; 4] = ["CIRCLE", "ELLIPSE", "HYPERBOLA", "PARABOLA"];

/// A part of a curve.
struct CurvePart {
    /// The curve, and the direction in which its part is run.
    directed: DirectedCurve,
    /// First and last parameter of the part, ascending.
    range: [f64; 2],
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads a bounded curve, mm, as a spline in its own direction; conics that are closed become one turn. Refuses unbounded curves, parts
    /// of composite curves that run over a joint too wide to be bridged, and chains of more than [`MAX_DEPTH`] references, of which `depth`
    /// are behind.
    pub(crate) fn bounded_curve(&self, id: u64, depth: usize) -> Outcome<Curve> {
        let JoinedCurve { curve, joints } = self.joined_part(id, depth)?;
        self.require_joined(&joints)?;
        Ok(curve)
    }

    /// Reads a bounded curve as [`Self::bounded_curve`] does, with the joints that it runs over, of any width.
    pub(super) fn joined_part(&self, id: u64, depth: usize) -> Outcome<JoinedCurve> {
        let CurvePart { directed: DirectedCurve { shape, reversed }, range } = self.curve_part(id, depth)?;
        let [from, to] = range;
        let part = JoinedCurve { curve: shape.segment(from, to), joints: shape.joints_along(range) };
        Ok(if reversed { part.reversed() } else { part })
    }

    /// Refuses a curve that runs over these joints where one of them is too wide to be bridged, in the name of its composite curve.
    pub(super) fn require_joined(&self, joints: &[Joint]) -> Outcome<()> {
        match joints.iter().find(|joint| joint.is_too_wide()) {
            Some(joint) => Err(Refusal::new(self.entity(joint.owner)?, joint.reason())),
            None => Ok(()),
        }
    }

    /// Reads a bounded curve as the part of a curve that it is; see [`Self::bounded_curve`].
    fn curve_part(&self, id: u64, depth: usize) -> Outcome<CurvePart> {
        let e = self.entity(id)?;
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "curves refer to each other too deeply"));
        }
        if let Some(trimmed) = e.attributes("TRIMMED_CURVE", 1) {
            return self.trimmed_part(e, trimmed, depth);
        }
        if e.is_one_of(&SURFACE_CURVES) {
            let basis = self.resolve(e, space_curve(e), "curve_3d of the surface curve")?;
            return self.curve_part(basis.id, depth + 1);
        }
        if let Some(own) = e.attributes("OFFSET_CURVE_3D", 1) {
            let basis = self.resolve(e, own.id(0), "basis curve")?;
            let part = self.curve_part(basis.id, depth + 1)?;
            let directed = self.offset_basis(e, own, part.directed, Some(part.range))?;
            // What was fitted is the part alone.
            let range = match &directed.shape {
                CurveShape::Spline { curve, .. } => curve.domain(),
                _ => part.range,
            };
            return Ok(CurvePart { directed, range });
        }
        if let Some(own) = e.attributes("CURVE_REPLICA", 1) {
            let (parent, placement) = self.replica(e, own)?;
            let CurvePart { directed: DirectedCurve { shape, reversed }, range } =
                self.curve_part(parent.id, depth + 1)?;
            return Ok(CurvePart { directed: DirectedCurve { shape: shape.placed(&placement), reversed }, range });
        }
        let directed = self.curve(id, depth)?;
        let range = match &directed.shape {
            CurveShape::Spline { curve, .. } => Some(curve.domain()),
            shape => shape.period().map(|period| [0.0, period]),
        };
        let range = range.ok_or_else(|| Refusal::new(e, "an unbounded curve where a bounded one is needed"))?;
        Ok(CurvePart { directed, range })
    }

    /// Returns the part of a basis curve between the two trimming values of a TRIMMED_CURVE, whose attributes are `args`. On closed curves
    /// equal values mean once around; elsewhere they are refused.
    fn trimmed_part(&self, e: Entity<'f, 'a>, args: Args<'f, 'a>, depth: usize) -> Outcome<CurvePart> {
        let basis = self.resolve(e, args.id(0), "basis curve")?;
        let DirectedCurve { shape, reversed } = self.curve(basis.id, depth + 1)?;
        let sense = args.flag(3) != Some(false);
        let by_point = args.word(4).as_deref() == Some("CARTESIAN");
        let limit = |list: Args<'f, 'a>| -> Outcome<f64> {
            let point = || (0..list.len()).find_map(|i| self.point(list.id(i)?).ok()).map(|p| shape.parameter(p));
            // The file says which of its two trimming values it means; writers that give only the other are understood too.
            if by_point && let Some(t) = point() {
                return Ok(t);
            }
            let number = (0..list.len()).find_map(|i| list.real(i));
            let number = number.ok_or_else(|| Refusal::new(e, "a trimming value is missing"));
            number.and_then(|x| self.curve_parameter(basis, &shape, x)).or_else(|refusal| point().ok_or(refusal))
        };
        let (t1, t2) = (limit(args.list(1))?, limit(args.list(2))?);
        let (from, mut to) = if sense { (t1, t2) } else { (t2, t1) };
        // On a closed curve the second end lies ahead of the first; both in one place mean once around.
        if let Some(period) = shape.period() {
            to = from + (to - from).rem_euclid(period);
            if to - from <= SEAM_SHARE * period {
                to = from + period;
            }
        }
        if !(to > from) {
            return Err(Refusal::new(e, "trimming values are in the wrong order or equal"));
        }
        Ok(CurvePart { directed: DirectedCurve { shape, reversed: sense == reversed }, range: [from, to] })
    }

    /// Returns the parameter on `shape`, which is what `basis` was read as, for one of the file's: on a conic an angle in the file's unit,
    /// on a POLYLINE a count of points, where ours is its arc length, mm, on a composite curve 0 where ours is that of its first segment.
    /// Refuses parameters that ours does not follow: of conics that became splines, and of composite curves of conics or polylines.
    fn curve_parameter(&self, basis: Entity<'f, 'a>, shape: &CurveShape, x: f64) -> Outcome<f64> {
        let (curve, joints) = match shape {
            CurveShape::Spline { curve, joints, .. } => (curve, joints),
            CurveShape::Ellipse { .. } => return Ok(x * self.units.angle),
            _ => return Ok(x),
        };
        let owner = self.parameter_owner(basis);
        if owner.is_one_of(&CONICS) {
            return Err(Refusal::new(basis, "its parameters cannot be taken over: they are those of a conic"));
        }
        if owner.is_one_of(&COMPOSITES) {
            require_kept_parameter(owner, joints)?;
            return Ok(x + curve.domain()[0]);
        }
        let points = owner.attributes("POLYLINE", 1).and_then(|a| self.points(owner, a.list(0)).ok());
        let Some(lengths) = points.map(|p| polyline_lengths(&p)).filter(|l| l.len() > 1) else { return Ok(x) };
        let last = (lengths.len() - 1) as f64;
        let x = x.clamp(0.0, last);
        let k = x.floor().min(last - 1.0) as usize;
        Ok(lengths[k] + (lengths[k + 1] - lengths[k]) * (x - k as f64))
    }

    /// Returns the curve whose parameter a curve has: what it trims, moves or places in turn, itself where it does not.
    pub(super) fn parameter_owner(&self, curve: Entity<'f, 'a>) -> Entity<'f, 'a> {
        let mut owner = curve;
        for _ in 0..MAX_DEPTH {
            let basis = if owner.is_one_of(&SURFACE_CURVES) {
                space_curve(owner)
            } else {
                KEEP_PARAMETER.into_iter().find_map(|name| owner.attributes(name, 1)).and_then(|a| a.id(0))
            };
            let Some(basis) = basis.and_then(|id| self.file.entity(id)) else { break };
            owner = basis;
        }
        owner
    }

    /// Returns the curve that a curve trims, or has on surfaces, in turn, itself where it does not, and whether it runs against that. A
    /// replica or an offset is a basis curve itself: it stands elsewhere than its parent.
    pub(super) fn basis_curve(&self, curve: Entity<'f, 'a>) -> (Entity<'f, 'a>, bool) {
        let (mut basis, mut is_against) = (curve, false);
        for _ in 0..MAX_DEPTH {
            let trimmed = basis.attributes("TRIMMED_CURVE", 1);
            let inner =
                if basis.is_one_of(&SURFACE_CURVES) { space_curve(basis) } else { trimmed.and_then(|a| a.id(0)) };
            let Some(inner) = inner.and_then(|id| self.file.entity(id)) else { break };
            is_against ^= trimmed.is_some_and(|a| a.flag(3) == Some(false));
            basis = inner;
        }
        (basis, is_against)
    }

    /// Returns the parent curve of a CURVE_REPLICA with attributes `own`, and where it is placed.
    pub(super) fn replica(&self, e: Entity<'f, 'a>, own: Args<'f, 'a>) -> Outcome<(Entity<'f, 'a>, Frame)> {
        let parent = self.resolve(e, own.id(0), "parent curve")?;
        let placement = self.transformation(self.resolve(e, own.id(1), "transformation")?.id)?;
        Ok((parent, placement))
    }

    /// Returns how many segments a composite curve has, also inside of its segments; 1 for any other curve. `known` holds the numbers of
    /// entities that were met; those of a cycle, whose reading ends at [`MAX_DEPTH`], count once.
    fn segment_count(&self, e: Entity<'f, 'a>, depth: usize, known: &mut FxHashMap<u64, u64>) -> u64 {
        // A curve and its segment are two entities, and a trim between them a third.
        if depth > 3 * MAX_DEPTH || !e.is_one_of(&AROUND_SEGMENTS) {
            return 1;
        }
        if let Some(&count) = known.get(&e.id) {
            return count;
        }
        known.insert(e.id, 1);
        let mut inner = Vec::new();
        e.all_args().for_each(|args| args.deep_ids(&mut inner));
        let curves = inner.into_iter().filter_map(|id| self.file.entity(id));
        let curves = curves.filter(|inner| inner.is_one_of(&AROUND_SEGMENTS));
        let count: u64 =
            curves.fold(0, |n: u64, inner| n.saturating_add(self.segment_count(inner, depth + 1, known)));
        known.insert(e.id, count.max(1));
        count.max(1)
    }

    /// Returns the segments of a composite curve, in its order, turned around where that joins them clearly better than the file's own
    /// senses. Gaps stay; a segment that is composite itself is refused where one is too wide to be bridged.
    pub(crate) fn segments(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<Vec<Curve>> {
        let segments = self.joined_segments(e, depth)?;
        segments.iter().try_for_each(|segment| self.require_joined(&segment.joints))?;
        Ok(segments.into_iter().map(|segment| segment.curve).collect())
    }

    /// Returns the segments of a composite curve as [`Self::segments`] does, with joints of any width in them.
    fn joined_segments(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<Vec<JoinedCurve>> {
        let Some(list) = segment_list(e) else { return Err(Refusal::new(e, "composite curve without segments")) };
        // Six lines can name a million segments: they are counted before one is read.
        if self.segment_count(e, 0, &mut FxHashMap::default()) > MAX_SEGMENTS {
            return Err(Refusal::new(e, "composite curve with too many segments"));
        }
        let mut curves: Vec<JoinedCurve> = Vec::with_capacity(list.len());
        for i in 0..list.len() {
            let segment = self.resolve(e, list.id(i), "segment")?;
            let args = segment_attributes(segment);
            let parent = self.resolve(segment, args.id(2), "parent curve")?;
            let curve = if parent.is_one_of(&["COMPOSITE_CURVE", "COMPOSITE_CURVE_ON_SURFACE"]) && depth < MAX_DEPTH
            {
                self.composite_curve(parent, depth + 1)?
            } else {
                self.joined_part(parent.id, depth + 1)?
            };
            curves.push(if args.flag(1) == Some(false) { curve.reversed() } else { curve });
        }
        // Senses are often wrong: turn a segment around when that joins it better.
        let ends = |c: &JoinedCurve| {
            let [a, b] = c.curve.domain();
            (c.curve.evaluate(a), c.curve.evaluate(b))
        };
        if let [first, second, ..] = &curves[..] {
            let (a, b) = ends(second);
            let to = |p: Point| (p - a).length().min((p - b).length());
            let (start, end) = ends(first);
            // Only by a clear margin, and with a third segment to decide: two alone may join either way.
            if to(start) < 0.5 * to(end) && curves.len() > 2 {
                curves[0] = curves[0].reversed();
            }
        }
        for i in 1..curves.len() {
            let end = ends(&curves[i - 1]).1;
            let (a, b) = ends(&curves[i]);
            if (b - end).length() < 0.5 * (a - end).length() {
                curves[i] = curves[i].reversed();
            }
        }
        Ok(curves)
    }

    /// Reads a composite curve, mm, as one spline, of the highest degree of its segments. These are turned around as in [`Self::segments`]
    /// and joined as by [`join_segments`], however far apart they are: its reader checks which joints a part of the curve runs over.
    /// Refuses a curve without segments, one with more than [`MAX_SEGMENTS`], and chains of more than [`MAX_DEPTH`] references, of which
    /// `depth` are behind.
    pub(super) fn composite_curve(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<JoinedCurve> {
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "curves refer to each other too deeply"));
        }
        let segments = self.joined_segments(e, depth)?;
        let bounds = segments.iter().fold(Aabb::EMPTY, |sum, segment| sum.union(segment.curve.bounds()));
        let size = bounds.diagonal();
        join_segments(e.id, segments, self.units.accuracy_on_face(size), self.units.widest_bridge(size))
            .ok_or_else(|| Refusal::new(e, "composite curve without segments"))
    }

    /// Reads a composite curve by the parameter that the file gives it, which runs through its segments' from 0 on; refused where ours is
    /// another: of conics and polylines, and of segments that lie apart.
    pub(super) fn counted_composite(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<Curve> {
        let JoinedCurve { curve, joints } = self.composite_curve(e, depth + 1)?;
        require_kept_parameter(e, &joints)?;
        let [a, b] = curve.domain();
        Ok(curve.reparametrised([0.0, b - a]))
    }
}

/// Refuses a composite curve through which our parameter, but for its start, does not run as the file's, which goes through its segments'
/// from 0 on: one with segments other than of lines and splines, with a parameter of their own, or with `joints`.
fn require_kept_parameter(e: Entity<'_, '_>, joints: &[Joint]) -> Outcome<()> {
    let list = segment_list(e);
    let are_kept = list.is_some_and(|list| (0..list.len()).filter_map(|i| list.entity(i)).all(keeps_parameter));
    if !are_kept {
        return Err(Refusal::new(
            e,
            "its parameters cannot be taken over: they count those of conics or polylines",
        ));
    }
    if !joints.is_empty() {
        return Err(Refusal::new(e, "its parameters cannot be taken over: its segments lie apart"));
    }
    Ok(())
}

/// Returns the list of the segments of a composite curve; `None` of one without any, and of any other curve.
fn segment_list<'f, 'a>(e: Entity<'f, 'a>) -> Option<Args<'f, 'a>> {
    COMPOSITES.into_iter().find_map(|name| e.attributes(name, 1).map(|a| a.list(0)).filter(|list| list.len() > 0))
}

/// Whether the file lets the last segment of a composite curve go on to the first: it does not end it with a discontinuity.
pub(super) fn is_closed_by_file(e: Entity<'_, '_>) -> bool {
    let last = segment_list(e).and_then(|list| list.entity(list.len() - 1));
    last.is_some_and(|segment| segment_attributes(segment).word(0).as_deref() != Some("DISCONTINUOUS"))
}

/// Returns the attributes of a segment of a composite curve: transition, sense and parent curve.
fn segment_attributes<'f, 'a>(segment: Entity<'f, 'a>) -> Args<'f, 'a> {
    segment.attributes("COMPOSITE_CURVE_SEGMENT", 0).unwrap_or_else(|| segment.args())
}

/// Whether a segment of a composite curve has the parameter of its parent curve, and that is ours.
fn keeps_parameter(segment: Entity<'_, '_>) -> bool {
    if segment.is_a("REPARAMETRISED_COMPOSITE_CURVE_SEGMENT") {
        return false;
    }
    segment_attributes(segment).entity(2).is_some_and(|parent| is_part_of_line(parent) || is_part_of_spline(parent))
}

/// Whether a curve is a part of a line of the file.
fn is_part_of_line(curve: Entity<'_, '_>) -> bool {
    curve.attributes("TRIMMED_CURVE", 1).and_then(|a| a.entity(0)).is_some_and(|basis| basis.is_a("LINE"))
}

/// Whether a curve is a B-spline of the file, or a part of one.
pub(super) fn is_part_of_spline(curve: Entity<'_, '_>) -> bool {
    let trimmed = curve.attributes("TRIMMED_CURVE", 1).and_then(|a| a.entity(0));
    trimmed.unwrap_or(curve).keywords().any(|k| SPLINES.contains(&k))
}

/// Whether two points are at most `tolerance`, mm, apart.
pub(crate) fn coincident(a: Point, b: Point, tolerance: f64) -> bool {
    (a - b).length() <= tolerance
}

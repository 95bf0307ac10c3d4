//! Splines put end to end: the segments of composite curves, and closed curves past their seam.
//!
//! Between segments that lie apart runs a straight piece, so that each keeps its shape; where that would double back, what they overlap by
//! is cut off. Each such joint is known by the parameters around it: what is no inaccuracy of a writer is refused where a part of the curve
//! runs over it, and there alone. Known weakness: of segments shorter than their overlap the second one begins where the first ends, which
//! bends it.

use super::tolerances::{
    ACCURACY_MM, BACKWARD_COSINE, EMPTY_SHARE, LIMIT_STEP, LOOSE_VERTEX_MM, OVERLAP_ROOM, SEAM_SHARE,
    SHORTEST_TAIL, STILL_SHARE,
};
use crate::math::{Homogeneous, Point, Vector};
use crate::nurbs::{Curve, project};

/// Where two segments of a composite curve, one behind the other, or both ends of a curve, do not meet within the file's accuracy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint {
    /// The entity of the composite curve.
    pub(super) owner: u64,
    /// Whether the segments overlap, and are cut; a straight piece bridges those that do not.
    pub(super) overlaps: bool,
    /// Whether it joins the end of the curve to its start.
    pub(super) is_closing: bool,
    /// Distance between the ends of the segments, mm.
    pub(super) width: f64,
    /// Largest distance that a writer's inaccuracy explains, mm.
    pub(super) limit: f64,
    /// A part of the curve runs over the joint if it begins before the first of these parameters and ends behind the second.
    pub(super) crossing: [f64; 2],
}

impl Joint {
    /// Whether the segments are too far apart to be joined.
    pub(super) fn is_too_wide(&self) -> bool {
        self.width > self.limit
    }

    /// Returns in words why a part of the curve that runs over it is refused.
    pub(super) fn reason(&self) -> String {
        let Self { width, limit, .. } = self;
        format!("its segments are {width:.3e} mm apart; gaps of more than {limit:.1e} mm are not bridged")
    }

    /// Whether the part of the curve over a range of its parameter runs over the joint.
    fn is_crossed_by(&self, [from, to]: [f64; 2]) -> bool {
        from < self.crossing[0] && to > self.crossing[1]
    }

    /// Returns the joint of the same curve with its parameter moved.
    fn shifted(self, by: f64) -> Self {
        Self { crossing: self.crossing.map(|t| t + by), ..self }
    }
}

/// A spline in space, mm, with the joints of the segments that it was made of.
#[derive(Clone, Debug)]
pub(crate) struct JoinedCurve {
    pub(super) curve: Curve,
    /// None of a curve that is no composite one.
    pub(super) joints: Vec<Joint>,
}

impl JoinedCurve {
    /// Returns the same curve run backwards over the same domain.
    pub(super) fn reversed(&self) -> Self {
        let [a, b] = self.curve.domain();
        let mirrored = |joint: &Joint| {
            let [before, behind] = joint.crossing;
            Joint { crossing: [a + b - behind, a + b - before], ..*joint }
        };
        Self { curve: self.curve.reversed(), joints: self.joints.iter().map(mirrored).collect() }
    }
}

/// Returns those of a curve's joints that its part over `range` runs over, by the parameter of that part. The curve's parameter begins at
/// `start`; that of a closed curve repeats after `period`, and the range may begin in any period and be as long as one: a whole turn runs
/// over all joints, also one on which it begins.
pub(super) fn crossed_joints(joints: &[Joint], start: f64, period: Option<f64>, range: [f64; 2]) -> Vec<Joint> {
    let first = period.map_or(0.0, |period| ((range[0] - start) / period).floor() * period);
    let shifts = std::iter::once(first).chain(period.map(|period| first + period));
    let is_whole = period.is_some_and(|period| range[1] - range[0] > (1.0 - EMPTY_SHARE) * period);
    let mut crossed = Vec::new();
    for joint in joints {
        let known = crossed.len();
        crossed.extend(shifts.clone().map(|shift| joint.shifted(shift)).filter(|joint| joint.is_crossed_by(range)));
        if is_whole && crossed.len() == known {
            crossed.push(joint.shifted(first));
        }
    }
    crossed
}

/// Joins the segments of the composite curve #`owner` to one spline, of the highest degree of them; `None` of none. Ends within `accuracy`,
/// mm, are one, as [`Curve::join`] has it. A straight piece bridges any wider gap but one of `limit`, mm, at most across which it would
/// double back: of that, [`cut_overlap`] leaves nothing or what can be bridged.
pub(super) fn join_segments(
    owner: u64,
    segments: Vec<JoinedCurve>,
    accuracy: f64,
    limit: f64,
) -> Option<JoinedCurve> {
    let mut chain = SegmentChain { owner, accuracy, limit, pieces: Vec::new(), joints: Vec::new(), end: 0.0 };
    segments.into_iter().for_each(|segment| chain.add(segment));
    let SegmentChain { pieces, joints, .. } = chain;
    let degree = pieces.iter().map(|piece| piece.degree).max()?;
    let curve = Curve::join(pieces.iter().map(|piece| elevate_degree(piece, degree)).collect())?;
    Some(JoinedCurve { curve, joints })
}

/// Segments of a composite curve and the pieces between them, up to some segment; see [`join_segments`].
struct SegmentChain {
    owner: u64,
    accuracy: f64,
    limit: f64,
    pieces: Vec<Curve>,
    joints: Vec<Joint>,
    /// The parameter at which the pieces end once they are joined.
    end: f64,
}

impl SegmentChain {
    /// Appends the next segment.
    fn add(&mut self, JoinedCurve { curve: mut segment, joints }: JoinedCurve) {
        match self.pieces.pop() {
            Some(last) => self.meet(last, &mut segment),
            None => self.end = segment.domain()[0],
        }
        let [from, to] = segment.domain();
        let shift = self.end - from;
        self.joints.extend(joints.into_iter().map(|joint| joint.shifted(shift)));
        self.end += to - from;
        self.pieces.push(segment);
    }

    /// Puts the last segment back, and what joins the next one to it; of either is cut off what they have in common.
    fn meet(&mut self, mut last: Curve, next: &mut Curve) {
        let width = step_between(&last, next).length();
        let margin = joint_margin(self.accuracy, width);
        let overlaps = width > ACCURACY_MM[0] && width <= self.limit && doubles_back(&last, next);
        if overlaps {
            self.end -= cut_overlap(&mut last, next, margin);
        }
        if !(width > self.accuracy) {
            self.pieces.push(last);
            return;
        }
        let step = step_between(&last, next).length();
        let is_bridged = !overlaps || step > margin && !doubles_back(&last, next);
        let length = if is_bridged { step } else { 0.0 };
        let crossing = joint_crossing([&last, &*next], overlaps.then_some(width), self.end, length, margin);
        let (owner, limit) = (self.owner, self.limit);
        self.joints.push(Joint { owner, overlaps, is_closing: false, width, limit, crossing });
        let ends = [end_point(&last), start_point(next)];
        self.pieces.push(last);
        if is_bridged {
            self.pieces.push(Curve::line(ends[0], ends[1], [0.0, length]));
            self.end += length;
        }
    }
}

/// Returns how near to a segment's end, mm, a vertex may stand for it at a joint of this width.
pub(super) fn joint_margin(accuracy: f64, width: f64) -> f64 {
    accuracy.max(LOOSE_VERTEX_MM.min(0.5 * width))
}

/// Returns the parameters before and behind which a part that runs over a joint begins and ends: the earlier segment ends at `end`, a
/// straight piece of `length` follows; `overlap` is by how much, mm, the segments overlapped, if they did.
pub(super) fn joint_crossing(
    [earlier, later]: [&Curve; 2],
    overlap: Option<f64>,
    end: f64,
    length: f64,
    margin: f64,
) -> [f64; 2] {
    let Some(width) = overlap else { return [end + length - margin, end + margin] };
    // The vertices of an edge along one segment may lie on the other.
    let room = OVERLAP_ROOM * width;
    let before = parameter_length(earlier, earlier.domain()[1], room);
    let behind = parameter_length(later, later.domain()[0], room);
    [end - before, end + length + behind]
}

/// Cuts off what two segments, of which the later one begins before the end of the earlier, have in common: the later one then begins
/// beside that end and, where a step of more than `margin`, mm, still doubles back, the earlier one ends beside that start. A segment of
/// which nothing would be left stays. Returns by how much the earlier one's parameter ends before.
pub(super) fn cut_overlap(earlier: &mut Curve, later: &mut Curve, margin: f64) -> f64 {
    let [start, end] = later.domain();
    if let Some(t) = inner_foot(later, start, end_point(earlier)) {
        *later = later.restricted(t, end);
    }
    if step_between(earlier, later).length() <= margin || !doubles_back(earlier, later) {
        return 0.0;
    }
    let [start, end] = earlier.domain();
    let Some(t) = inner_foot(earlier, end, start_point(later)) else { return 0.0 };
    *earlier = earlier.restricted(start, t);
    end - t
}

/// Returns the parameter at which a curve, followed from its end at `near`, is nearest to a point; `None` where that is an end of it.
fn inner_foot(curve: &Curve, near: f64, point: Point) -> Option<f64> {
    // Whatever is found from there counts: the curve may come nearer elsewhere.
    let (t, _) = project::nearest_from(curve, point, near, f64::INFINITY);
    let [a, b] = curve.domain();
    let shortest = SHORTEST_TAIL * (b - a);
    (t > a + shortest && t < b - shortest).then_some(t)
}

/// Whether the step from one segment to the next runs against either of them. Behind an acute tip, where they run against each other, any
/// step does: there the one that it runs along more than against the other only lacks its tip.
pub(super) fn doubles_back(earlier: &Curve, later: &Curve) -> bool {
    let step = step_between(earlier, later);
    let [from, to] = [direction(earlier, earlier.domain()[1]), direction(later, later.domain()[0])]
        .map(|along| along / along.length());
    if from.dot(to) < -BACKWARD_COSINE && step.dot(from + to) > 0.0 {
        return false;
    }
    [from, to].into_iter().any(|along| step.dot(along) < -BACKWARD_COSINE * step.length())
}

/// Returns the step from the end of one segment to the start of the next, mm.
pub(super) fn step_between(earlier: &Curve, later: &Curve) -> Vector {
    start_point(later) - end_point(earlier)
}

pub(super) fn start_point(curve: &Curve) -> Point {
    curve.evaluate(curve.domain()[0])
}

pub(super) fn end_point(curve: &Curve) -> Point {
    curve.evaluate(curve.domain()[1])
}

/// Returns how much of a curve's parameter a length along it, mm, takes at its end at `t`; half of all at most.
fn parameter_length(curve: &Curve, t: f64, length: f64) -> f64 {
    let [a, b] = curve.domain();
    (length / direction(curve, t).length()).min(0.5 * (b - a))
}

/// Returns a vector along a curve at `t`: its derivative or, where that vanishes, the one a little nearer to the middle.
pub(super) fn direction(curve: &Curve, t: f64) -> Vector {
    let [a, b] = curve.domain();
    let first = curve.derivatives(t).first;
    if first.length() * (b - a) > STILL_SHARE * curve.bounds().diagonal() {
        return first;
    }
    curve.derivatives(t + LIMIT_STEP * (0.5 * (a + b) - t)).first
}

/// Returns a closed spline over `[s0, s1]`, which may run past the end of its domain by one period.
pub(super) fn segment_over_seam(curve: &Curve, s0: f64, s1: f64) -> Curve {
    let [a, b] = curve.domain();
    let period = b - a;
    if s1 <= b {
        return curve.restricted(s0, s1);
    }
    // A start on the seam: all of the range lies behind it.
    if b - s0 <= SEAM_SHARE * period {
        let end = (s1 - period).max(a + SHORTEST_TAIL * period);
        return curve.restricted(a, end.min(b)).reparametrised([b, b + (end - a)]);
    }
    let head = curve.restricted(s0, b);
    let tail = curve.restricted(a, (s1 - period).clamp(a + SHORTEST_TAIL * period, b));
    head.joined_with(&tail)
}

/// Returns the same curve with a higher degree, piecewise Bézier; `degree` is not below its own.
pub(super) fn elevate_degree(curve: &Curve, degree: usize) -> Curve {
    if curve.degree == degree {
        return curve.clone();
    }
    let mut points: Vec<Homogeneous> = Vec::new();
    for mut piece in curve.bezier_pieces() {
        while piece.len() <= degree {
            let n = piece.len();
            let mut up = vec![piece[0]];
            // Degree elevation: the new points divide the legs of the polygon at i/n.
            up.extend(
                (1..n).map(|i| piece[i - 1] * (i as f64 / n as f64) + piece[i] * (1.0 - i as f64 / n as f64)),
            );
            up.push(piece[n - 1]);
            piece = up;
        }
        // At a joint both pieces have one control point.
        points.extend(&piece[usize::from(!points.is_empty())..]);
    }
    let breaks = curve.breakpoints();
    let mut knots = vec![breaks[0]];
    knots.extend(breaks.iter().flat_map(|&b| std::iter::repeat_n(b, degree)));
    knots.push(breaks[breaks.len() - 1]);
    Curve { degree, knots, points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, distance_to_segment};
    use crate::nurbs::conic;

    #[test]
    fn elevation_keeps_the_curve() {
        let c = conic::arc(&Frame::IDENTITY, 2.0, [0.0, 5.0]);
        let e = elevate_degree(&c, 4);
        assert_eq!(e.knots.len(), e.points.len() + 5);
        for i in 0..=40 {
            let t = 0.125 * f64::from(i);
            assert!((c.evaluate(t) - e.evaluate(t)).length() < 1e-13);
        }
    }

    fn line(from: [f64; 2], to: [f64; 2], range: [f64; 2]) -> JoinedCurve {
        let [a, b] = [from, to].map(|[x, y]| Point::new(x, y, 0.0));
        JoinedCurve { curve: Curve::line(a, b, range), joints: Vec::new() }
    }

    fn are_crossed(curve: &JoinedCurve, range: [f64; 2]) -> bool {
        !crossed_joints(&curve.joints, curve.curve.domain()[0], None, range).is_empty()
    }

    /// Five millimetres over 2 to 7, a gap of one, and four more: the piece between is over 7 to 8, backwards over 6 to 7.
    #[test]
    fn a_part_beside_a_gap_does_not_run_over_it() {
        let segments = vec![line([0.0, 0.0], [5.0, 0.0], [2.0, 7.0]), line([6.0, 0.0], [10.0, 0.0], [0.0, 4.0])];
        let joined = join_segments(1, segments, 1e-6, 0.1).expect("two segments");
        assert_eq!(joined.curve.domain(), [2.0, 12.0]);
        assert!((joined.curve.evaluate(7.5) - Point::new(5.5, 0.0, 0.0)).length() < 1e-12);
        assert!(joined.joints.len() == 1 && joined.joints[0].is_too_wide() && !joined.joints[0].overlaps);
        let back = joined.reversed();
        for (range, expected) in
            [([2.0, 7.0], false), ([8.0, 12.0], false), ([2.0, 7.5], true), ([7.5, 12.0], true), ([7.2, 7.8], true)]
        {
            assert_eq!(are_crossed(&joined, range), expected, "{range:?}");
            assert_eq!(are_crossed(&back, [14.0 - range[1], 14.0 - range[0]]), expected, "{range:?} backwards");
        }
        // Of a closed curve the second turn has the joint at the same place.
        let in_turn = |range: [f64; 2]| crossed_joints(&joined.joints, 2.0, Some(10.0), range).len();
        assert_eq!([[9.0, 16.0], [9.0, 18.0], [18.0, 21.0], [7.5, 17.5]].map(in_turn), [0, 1, 0, 2]);
        // A turn from one end of the joint to it is whole.
        let on_joint = [Joint { crossing: [6.0, 9.0], ..joined.joints[0] }];
        let whole =
            |from: f64, length: f64| crossed_joints(&on_joint, 2.0, Some(10.0), [from, from + length]).len();
        assert_eq!([whole(7.0, 10.0), whole(7.0, 9.5), whole(3.0, 10.0)], [1, 0, 1]);
    }

    #[test]
    fn joints_inside_of_a_segment_move_with_it() {
        let parted = vec![line([3.0, 0.0], [4.0, 0.0], [0.0, 1.0]), line([4.5, 0.0], [6.0, 0.0], [0.0, 1.5])];
        let inner = join_segments(1, parted, 1e-6, 1.0).expect("two segments");
        let joined = join_segments(2, vec![line([0.0, 0.0], [3.0, 0.0], [5.0, 8.0]), inner], 1e-6, 1.0);
        let joined = joined.expect("two segments");
        // Straight over 9 to 9.5.
        assert_eq!(joined.joints.iter().map(|joint| joint.owner).collect::<Vec<_>>(), [1]);
        assert!(!are_crossed(&joined, [5.0, 9.0]) && !are_crossed(&joined, [9.5, 11.0]));
        assert!(are_crossed(&joined, [8.5, 9.7]));
    }

    /// Joins two straight segments that overlap, and compares the result with a path.
    fn assert_joined(segments: [[[f64; 2]; 2]; 2], path: &[[f64; 2]]) {
        let segments = segments.into_iter().map(|[from, to]| line(from, to, [0.0, 1.0])).collect();
        let joined = join_segments(1, segments, 1e-6, 0.1).expect("two segments");
        assert!(joined.joints.len() == 1 && joined.joints[0].overlaps && !joined.joints[0].is_too_wide());
        assert!(are_crossed(&joined, joined.curve.domain()));
        let path: Vec<Point> = path.iter().map(|[x, y]| Point::new(*x, *y, 0.0)).collect();
        let points: Vec<Point> = joined.curve.points.iter().map(|p| p.truncate() / p.w).collect();
        let length = |path: &[Point]| path.windows(2).map(|side| (side[1] - side[0]).length()).sum::<f64>();
        // On the path and as long as it: nothing of it is run twice.
        assert!((length(&points) - length(&path)).abs() < 1e-9, "{points:?}");
        let off = |p: &Point| path.windows(2).map(|s| distance_to_segment(*p, s[0], s[1])).fold(1.0, f64::min);
        assert!(points.iter().all(|p| off(p) < 1e-9), "{points:?}");
    }

    #[test]
    fn overlaps_are_cut_off() {
        // Along a line, past a corner, and side by side.
        assert_joined([[[0.0, 0.0], [5.005, 0.0]], [[5.0, 0.0], [10.0, 0.0]]], &[[0.0, 0.0], [10.0, 0.0]]);
        let corner = [[0.0, 0.0], [5.0, 0.0], [5.0, 4.0]];
        assert_joined([[[0.0, 0.0], [5.004, 0.0]], [[5.0, 0.003], [5.0, 4.0]]], &corner);
        let turn = [[0.0, 0.0], [5.0, 0.0], [5.0, 0.008], [0.0, 0.008]];
        assert_joined([[[0.0, 0.0], [5.0, 0.0]], [[5.004, 0.008], [0.0, 0.008]]], &turn);
        // Past a tip of 37°, by the first segment.
        let tip = [[0.0, 0.0], [5.0, 0.0], [1.0, 3.0]];
        assert_joined([[[0.0, 0.0], [5.01, 0.0]], [[5.0, 0.0], [1.0, 3.0]]], &tip);
    }

    /// A tip of 37° that the second segment lacks, or the first.
    #[test]
    fn a_gap_behind_an_acute_tip_is_bridged() {
        for (end, start) in [([5.0, 0.0], [4.96, 0.03]), ([4.95, 0.0], [5.0, 0.0])] {
            let segments = vec![line([0.0, 0.0], end, [0.0, 1.0]), line(start, [1.0, 3.0], [0.0, 1.0])];
            let joined = join_segments(1, segments, 1e-6, 0.1).expect("two segments");
            assert!(joined.joints.len() == 1 && !joined.joints[0].overlaps, "{end:?}");
            let corners: Vec<Point> = joined.curve.points.iter().map(|p| p.truncate() / p.w).collect();
            let expected = [[0.0, 0.0], end, start, [1.0, 3.0]].map(|[x, y]| Point::new(x, y, 0.0));
            assert!(corners.iter().zip(expected).all(|(p, q)| (*p - q).length() < 1e-12), "{corners:?}");
            assert_eq!(corners.len(), 4);
        }
    }
}

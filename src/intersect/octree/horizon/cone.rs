//! The free cone of a facet: how far from an axis the rays that leave it may run and meet nothing.
//!
//! Rays that start on a set T and meet a set Q run along differences `q − t`. A normal `N` with `N·(q − t) ≤ 0` for all of them, which
//! is that of a plane between the two sets, keeps rays within the angle `asin N·a` of an axis `a` off Q. Such normals are looked
//! for from the cheapest: that of T's plane, those of a ball around both sets, of six lines around T, and at last the very one that
//! is nearest to the axis, which lies across one or two of the differences. Only boxes that may be nearer to the axis than what was
//! found already are opened.
//!
//! Rays that leave the spline start up to a sag off T, and what they might meet lies as far off Q. A start and a goal that are moved by
//! `r` together, from a distance of at least `g`, turn the difference by at most `asin r/g`: a cone wider by that angle that is free for
//! T and Q has a free one within it for all that lies so near to them. What shares a corner with T has no distance, and is judged by its
//! normals ([`Sheet`]).

use super::lines::{BOX_ROOM, LINES, Lines, lines_around};
use super::sheet::Sheet;
use crate::intersect::octree::node::{Link, Target};
use crate::intersect::octree::tree::Tree;
use crate::math::{Aabb, Point, Vector};
use std::f64::consts::FRAC_PI_2;

/// Half an angle below which a cone is of no use.
const LEAST_HALF_ANGLE: f64 = 0.02;
/// Taken off the half angle for the rounding of starts and of queries in f32.
const ANGLE_ROOM: f64 = 1e-3;

/// By how much balls are made larger, for the rounding of distances in f64 and much more.
const BALL_ROOM: f64 = 1e-9;

/// Returns the cosine of half the angle of a free cone of a facet around the unit vector `axis`: half the angle, in radians, is at most
/// `widest`. With a `sag`, mm, it is free for rays that leave the spline over the facet, where all that stands there is spline as near to
/// its facets. `None` where the cone would be too narrow to be of use, or a triangle of the facet has no area.
pub(super) fn cosine_of_free_cone(tree: &Tree, facet: usize, axis: Vector, widest: f64, sag: f64) -> Option<f64> {
    let mesh = tree.surroundings.mesh;
    let [a, b, c, d] = mesh.corners(facet);
    let base = |corners| Base::new(corners, tree.surroundings.reach, 2.0 * sag);
    let first = base([a, b, c])?;
    let bases = if mesh.facets[facet].is_triangle() {
        [Some((first, [a, b, c, c])), None]
    } else {
        let second = base([a, c, d])?;
        // A ray may leave either triangle, and the other one may stand in its way where the facet is folded.
        [Some((first, [a, c, d, d])), Some((second, [a, b, c, c]))]
    };
    let mut limit = Limit::new(axis, widest);
    // A plane of its own lies below the whole cone.
    for (base, _) in bases.iter().flatten() {
        limit.lower(axis.dot(base.normal));
    }
    let sheet = (sag > 0.0).then(|| Sheet::new(mesh, facet));
    if let Some(sheet) = &sheet {
        limit.lower_half_angle(sheet.half_angle(facet, axis));
    }
    for (base, other) in bases.iter().flatten() {
        // The other triangle of a facet is of its sheet.
        if sheet.is_none() {
            base.narrow_to_avoid(other, &mut limit);
        }
        base.narrow_to_avoid_all(tree, facet, sheet.as_ref(), &mut limit);
    }
    let angle = limit.sine.clamp(0.0, 1.0).asin();
    // Too narrow a cone would catch next to no ray, and its test costs each.
    (angle > LEAST_HALF_ANGLE).then(|| (angle - ANGLE_ROOM).cos())
}

/// A cone about `axis`, a unit vector, that is made narrower.
struct Limit {
    axis: Vector,
    /// Of half its angle.
    sine: f64,
    cosine: f64,
}

impl Limit {
    /// The cone of this half angle, radians.
    fn new(axis: Vector, half_angle: f64) -> Self {
        let (sine, cosine) = half_angle.sin_cos();
        Self { axis, sine, cosine }
    }

    /// Narrows the cone to this sine of half its angle; a larger one than it has changes nothing, a negative one counts as zero.
    fn lower(&mut self, sine: f64) {
        if sine < self.sine {
            self.sine = sine.max(0.0);
            self.cosine = (1.0 - self.sine * self.sine).sqrt();
        }
    }

    /// Narrows the cone to this half angle, radians; one that is not positive, or NaN, closes it.
    fn lower_half_angle(&mut self, half_angle: f64) {
        self.lower(if half_angle > 0.0 { half_angle.min(FRAC_PI_2).sin() } else { 0.0 });
    }

    /// The cone with so many radians more of half angle, up to half of all directions.
    fn widened(&self, angle: f64) -> Self {
        Self::new(self.axis, (self.sine.asin() + angle).min(FRAC_PI_2))
    }
}

/// A triangle that rays leave.
struct Base {
    corners: [Point; 3],
    normal: Vector,
    /// Directions in its plane away from it, across its sides and at its corners, and where the lines are.
    lines: Lines,
    /// Middle and radius of a ball around it.
    middle: Point,
    radius: f64,
    /// How far off its triangle a start may lie for rounding, mm.
    reach: f64,
    /// How far start and goal may lie off their facets together, mm.
    room: f64,
}

impl Base {
    /// A triangle with the reach of its starts and the room for start and goal, mm; `None` without area.
    fn new(corners: [Point; 3], reach: f64, room: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let (normal, lines) = lines_around(corners)?;
        let middle = (a + b + c) / 3.0;
        let radius = corners.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
        Some(Self { corners, normal, lines, middle, radius, reach, room })
    }

    /// Height over the plane, mm, up to which nothing stands in the way of a ray: below zero where starts and goals lie off their facets.
    fn floor(&self) -> f64 {
        if self.room > 0.0 { -self.room } else { self.reach }
    }

    /// Narrows `limit` until no ray within the cone meets a facet of the tree but `facet`, its own, and what of its `sheet` the normals
    /// exclude; ends early once the cone is of no use.
    fn narrow_to_avoid_all(&self, tree: &Tree, facet: usize, sheet: Option<&Sheet>, limit: &mut Limit) {
        let mesh = tree.surroundings.mesh;
        let mut open: Vec<Link> = tree.root.into_iter().collect();
        while let Some(link) = open.pop() {
            // Narrower than of use: whatever else stands there does not matter.
            if limit.sine < LEAST_HALF_ANGLE {
                return;
            }
            match link.target() {
                Target::Node(index) => {
                    let node = &tree.nodes[index];
                    for slot in node.slots() {
                        let b = node.child(slot);
                        if self.may_meet(&b, tree.center, limit) {
                            open.push(Link(node.children[slot]));
                        }
                    }
                }
                Target::Block(index, count) => {
                    let block = &tree.blocks[index];
                    // Its own facet is tested separately, triangle by triangle.
                    for k in (0..count).filter(|&k| block.facets[k] as usize != facet) {
                        let other = block.facets[k] as usize;
                        if let Some(sheet) = sheet.filter(|sheet| sheet.holds(other)) {
                            limit.lower_half_angle(sheet.half_angle(other, limit.axis));
                            continue;
                        }
                        self.narrow_to_avoid(&block.positions[k].map(|p| mesh.positions[p as usize]), limit);
                    }
                }
                Target::End => {}
            }
        }
    }

    /// Whether a ray within the cone may meet a box that is given relative to `center`; `true` says nothing.
    fn may_meet(&self, b: &Aabb, center: Point, limit: &Limit) -> bool {
        let (middle, half) = (b.center() + center, 0.5 * b.size());
        let room = BOX_ROOM * half.max_element();
        let height = (middle - self.corners[0]).dot(self.normal) + half.dot(self.normal.abs()) + room;
        height > self.floor() && self.may_meet_ball(middle, half.length() + room, limit)
    }

    /// Whether a ray within the cone may meet a ball, in the mesh's coordinates, mm.
    fn may_meet_ball(&self, middle: Point, radius: f64, limit: &Limit) -> bool {
        let (to, radius) = (middle - self.middle, (self.radius + radius + self.room) * (1.0 + BALL_ROOM));
        let (along, beside) = (to.dot(limit.axis), to.length_squared() - radius * radius);
        // Of the angle to its middle and that which it fills.
        beside <= 0.0 || along > limit.cosine * beside.sqrt() - limit.sine * radius
    }

    /// Narrows `limit` until no ray that leaves this triangle within the cone meets a facet, whose last two corners are one if it is a
    /// triangle. The hull of all four is tried first; only if the cone may reach that are the two triangles judged, each by itself.
    fn narrow_to_avoid(&self, corners: &[Point; 4], limit: &mut Limit) {
        if !self.is_off(corners, limit) {
            let [a, b, c, d] = *corners;
            // The hull of a folded quad is more than the quad: its triangles may be off where the hull is not.
            for triangle in [[a, b, c], [a, c, d]] {
                if !self.is_off(&triangle, limit) {
                    let turn = self.turn(&triangle);
                    limit.lower_half_angle(self.sine_to(&triangle, limit.axis).min(1.0).asin() - turn);
                }
            }
        }
    }

    /// Whether a quick test shows that no ray within the cone meets the hull of these points; `false` says nothing.
    fn is_off(&self, points: &[Point], limit: &Limit) -> bool {
        let heights = |p: &Point| (*p - self.corners[0]).dot(self.normal);
        if points.iter().all(|p| heights(p) <= self.floor()) {
            return true;
        }
        let middle = points.iter().sum::<Point>() / points.len() as f64;
        let radius = points.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
        if !self.may_meet_ball(middle, radius, limit) {
            return true;
        }
        match self.turn(points) {
            0.0 => self.is_beyond_a_line(points, limit),
            turn => self.is_beyond_a_line(points, &limit.widened(turn)),
        }
    }

    /// The angle, radians, by which the room may turn a difference between this triangle and the hull of these points: 0 without room, a
    /// right angle where they are not seen to be farther apart than the room.
    fn turn(&self, points: &[Point]) -> f64 {
        if self.room == 0.0 {
            return 0.0;
        }
        // Planes with the triangle on one side: those through the lines, and its own to both sides.
        let (mut least, mut above, mut below) = ([f64::INFINITY; LINES], f64::INFINITY, f64::INFINITY);
        for p in points {
            let to = *p - self.corners[0];
            let height = to.dot(self.normal);
            (above, below) = (above.min(height), below.min(-height));
            for (least, (across, at)) in least.iter_mut().zip(&self.lines) {
                *least = least.min(to.dot(*across) - at);
            }
        }
        let apart = least.into_iter().fold(above.max(below), f64::max);
        if apart > self.room { (self.room / apart).asin() } else { FRAC_PI_2 }
    }

    /// Whether a plane through one of the lines keeps the points from the whole cone.
    fn is_beyond_a_line(&self, points: &[Point], limit: &Limit) -> bool {
        let upright = self.normal.dot(limit.axis);
        self.lines.iter().any(|(across, at)| {
            // The plane rises as steeply as this over the line.
            let (mut least, mut most) = (0.0f64, f64::INFINITY);
            for p in points {
                let to = *p - self.corners[0];
                let (height, beyond) = (to.dot(self.normal), to.dot(*across) - at);
                if height > self.reach {
                    least = least.max(height / beyond.max(0.0));
                } else if beyond < -self.reach {
                    // The plane must pass above all points beyond the line and below none behind it: between the
                    // two slopes there must be one.
                    most = most.min(height.min(0.0) / beyond);
                }
            }
            least <= most
                && least.is_finite()
                && upright - least * across.dot(limit.axis) >= limit.sine * (1.0 + least * least).sqrt()
        })
    }

    /// The sine of half the widest cone about `axis` that keeps all rays from this triangle off the other; 0 where there is none.
    fn sine_to(&self, points: &[Point; 3], axis: Vector) -> f64 {
        let mut ways = [Vector::ZERO; 9];
        let mut count = 0;
        for q in points {
            // Of two hulls all separating directions come from differences of their corners.
            for t in &self.corners {
                let way = *q - *t;
                // A difference within the reach of a start is the same point, as at a shared edge: no normal is
                // required to keep off that.
                if way.length_squared() > self.reach * self.reach && count < ways.len() {
                    ways[count] = way;
                    count += 1;
                }
            }
        }
        let ways = &ways[..count];
        let mut best = 0.0;
        let mut offer = |normal: Vector| {
            let length = normal.length();
            let sine = normal.dot(axis) / length;
            // NaN is no better.
            if sine > best && ways.iter().all(|w| normal.dot(*w) <= self.reach * length) {
                best = sine;
            }
        };
        offer(axis);
        // The nearest normal to the axis is the axis itself, its part across one difference, or the normal of two.
        for (k, v) in ways.iter().enumerate() {
            offer(axis * v.length_squared() - *v * v.dot(axis));
            for w in &ways[..k] {
                let across = v.cross(*w);
                offer(if across.dot(axis) < 0.0 { -across } else { across });
            }
        }
        best
    }
}

//! The horizon of a facet in sectors: how steeply anything rises over it, to all sides.
//!
//! The horizon of a triangle is bounded, in eight sectors around it, from lines in its plane that have the triangle on one side.
//! A ray of slope `s` that runs at an angle `a` to the normal of such a line is at a height of at most `g·s/cos a` when it is
//! `g` beyond the line. Of points of a convex set at heights `h` and distances `g`, `h/g` is greatest at a corner of the set.
//! So is it bounded for boxes, and only boxes that may stand higher than what was found already are opened.
//!
//! Weakness: eight sectors of one angle each, so that out of a narrow shaft no ray is seen to be free.

use super::lines::{BOX_ROOM, LINES, Lines, lines_around};
use crate::intersect::octree::node::{Link, Target};
use crate::intersect::octree::tree::Tree;
use crate::math::{Aabb, Point, Vector, orthonormal_pair};
use std::f64::consts::FRAC_PI_8;

/// Slope above which a horizon is of no use.
const STEEPEST_OF_USE: f64 = 8.0;
/// Square of the sine to the normal below which a ray counts as upright: its coordinates in the plane are then rounded by 2⁻²⁴ of
/// 1e-3, a ten-thousandth of a sector's width.
const UPRIGHT: f32 = 1e-6;
/// Half a sector is widened by this much, radians, for f32 coordinates at [`UPRIGHT`].
const SECTOR_ROOM: f64 = 1e-3;
/// Relative room on squared slopes for the rounding of queries in f32.
const SLOPE_ROOM: f64 = 1e-4;
/// Absolute room on squared slopes, for slopes near zero.
const UPRIGHT_ROOM: f64 = 1e-6;
/// Sectors around a triangle: a ray is in one by the signs and the order of its two coordinates in the plane.
pub(super) const SECTORS: usize = 8;

/// The sector, below [`SECTORS`], of a ray with these coordinates in the plane.
#[inline(always)]
pub(super) fn sector(x: f32, y: f32) -> usize {
    usize::from(x < 0.0) | usize::from(y < 0.0) << 1 | usize::from(y.abs() > x.abs()) << 2
}

/// What a ray that leaves a facet is tested against, which may do so from either triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Horizon([Skyline; 2]);

/// Whether a ray rises faster over a triangle than anything stands.
#[derive(Clone, Copy, Debug)]
struct Skyline {
    /// The facet's frame: normal, and two directions in its plane between which sectors lie.
    normal: [f32; 3],
    x: [f32; 3],
    y: [f32; 3],
    /// Squared slope in each sector; infinite where no ray is known to meet nothing.
    slope2: [f32; SECTORS],
    /// The greatest of all sectors.
    steepest: f32,
}

impl Skyline {
    const UNKNOWN: Self = {
        let (zero, never) = ([0.0; 3], f32::INFINITY);
        Self { normal: zero, x: zero, y: zero, slope2: [never; SECTORS], steepest: never }
    };

    /// Whether the skyline stays below a unit direction, so that nothing stands in its way; never where it is unknown.
    #[inline(always)]
    fn is_below(&self, d: [f32; 3]) -> bool {
        let dot = |a: [f32; 3]| a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
        let (up, x, y) = (dot(self.normal), dot(self.x), dot(self.y));
        let flat2 = x * x + y * y;
        // Nearly upright the sector is a matter of rounding, and one chosen wrongly would give another's slope: the steepest of all is
        // right for any.
        let upright = flat2 < UPRIGHT;
        let slope2 = if upright { self.steepest } else { self.slope2[sector(x, y)] };
        up > 0.0 && up * up > slope2 * flat2 && slope2 < f32::INFINITY
    }
}

impl Horizon {
    /// Whether a ray of this unit direction that leaves the facet, from either triangle, is known to meet nothing.
    #[inline(always)]
    pub(super) fn is_below(&self, d: Vector) -> bool {
        let d = d.to_array().map(|x| x as f32);
        self.0[0].is_below(d) && self.0[1].is_below(d)
    }
}

/// Finds the horizon of a facet, in each sector no lower than the slope `floor`, the tangent over its plane. A sector with an infinite
/// floor is not searched and lets no ray be known as free.
pub(super) fn of_facet(tree: &Tree, facet: usize, floor: &[f64; SECTORS]) -> Horizon {
    let mesh = tree.surroundings.mesh;
    let [a, b, c, d] = mesh.corners(facet);
    let [first, second] = [[a, b, c], [a, c, d]];
    // What stands highest may be the other triangle of a folded facet, so its rise is where the search begins.
    let skyline_from = |own: [Point; 3], other: [Point; 3]| {
        let base = Base::new(own, tree.surroundings.reach)?;
        let rise = base.rise(&other);
        Some(base.skyline(tree, facet, std::array::from_fn(|s| rise[s].max(floor[s]))))
    };
    let one = skyline_from(first, second).unwrap_or(Skyline::UNKNOWN);
    if mesh.facets[facet].is_triangle() {
        Horizon([one; 2])
    } else {
        Horizon([one, skyline_from(second, first).unwrap_or(Skyline::UNKNOWN)])
    }
}

/// A triangle that rays leave, with the lines in its plane through its sides and corners.
struct Base {
    normal: Vector,
    x: Vector,
    y: Vector,
    origin: Point,
    /// Direction across each line, away from the triangle, and where the line is.
    lines: Lines,
    /// Greatest cosine between the direction across a line and that of a ray in a sector.
    toward: [[f64; SECTORS]; LINES],
    reach: f64,
}

impl Base {
    /// A triangle with the reach of its starts, mm; `None` without area.
    fn new(corners: [Point; 3], reach: f64) -> Option<Self> {
        let (normal, lines) = lines_around(corners)?;
        let (x, y) = orthonormal_pair(normal);
        // Half a sector, and room for the rounding of where a ray belongs.
        let half = FRAC_PI_8 + SECTOR_ROOM;
        let toward = lines.map(|(across, _)| {
            std::array::from_fn(|sector| {
                let middle = if sector & 4 == 0 { FRAC_PI_8 } else { 3.0 * FRAC_PI_8 };
                let sign = |bit: usize| if sector & bit == 0 { 1.0 } else { -1.0 };
                let ray = x * (sign(1) * middle.cos()) + y * (sign(2) * middle.sin());
                let apart = (ray.dot(across).clamp(-1.0, 1.0).acos() - half).max(0.0);
                apart.cos().max(0.0)
            })
        });
        Some(Self { normal, x, y, origin: corners[0], lines, toward, reach })
    }

    /// Finds by sector how steeply anything in the tree but `facet` stands over the plane, seen from the triangle, at least `slopes`.
    fn skyline(&self, tree: &Tree, facet: usize, mut slopes: [f64; SECTORS]) -> Skyline {
        let mesh = tree.surroundings.mesh;
        let higher = |slopes: &[f64; SECTORS], rise: &[f64; SECTORS]| {
            slopes.iter().zip(rise).any(|(slope, rise)| *slope <= STEEPEST_OF_USE && rise > slope)
        };
        let mut open: Vec<Link> = tree.root.into_iter().collect();
        while let Some(link) = open.pop() {
            // Once no sector is of use nothing more is looked for.
            if slopes.iter().all(|s| *s > STEEPEST_OF_USE) {
                return Skyline::UNKNOWN;
            }
            match link.target() {
                Target::Node(index) => {
                    let node = &tree.nodes[index];
                    for slot in node.slots() {
                        let b = node.child(slot);
                        let b = Aabb { min: b.min + tree.center, max: b.max + tree.center };
                        if higher(&slopes, &self.rise_of_box(&b)) {
                            open.push(Link(node.children[slot]));
                        }
                    }
                }
                Target::Block(index, count) => {
                    let block = &tree.blocks[index];
                    for k in (0..count).filter(|&k| block.facets[k] as usize != facet) {
                        let corners = block.positions[k].map(|p| mesh.positions[p as usize]);
                        // The box first: it is cheaper than the corners, and rises no less.
                        if higher(&slopes, &self.rise_of_box(&Aabb::from_points(corners))) {
                            let rise = self.rise(&corners);
                            slopes = std::array::from_fn(|k| slopes[k].max(rise[k]));
                        }
                    }
                }
                Target::End => {}
            }
        }
        // Room for f32.
        let slope2 = slopes.map(|s| {
            if s <= STEEPEST_OF_USE { (s * s * (1.0 + SLOPE_ROOM) + UPRIGHT_ROOM) as f32 } else { f32::INFINITY }
        });
        let [normal, x, y] = [self.normal, self.x, self.y].map(|v| v.to_array().map(|x| x as f32));
        // The squares of slopes are compared, since that saves each ray a root.
        Skyline { normal, x, y, slope2, steepest: slope2.into_iter().fold(0.0, f32::max) }
    }

    /// An upper bound of [`Self::rise`] for what lies in a box, by sector; infinite where it may lie over the triangle.
    fn rise_of_box(&self, b: &Aabb) -> [f64; SECTORS] {
        let (middle, half) = (b.center() - self.origin, 0.5 * b.size());
        let room = BOX_ROOM * half.max_element();
        // No higher than the start may be off: what touches the facet's plane stands in no ray's way.
        let height = middle.dot(self.normal) + half.dot(self.normal.abs()) + room;
        if height <= self.reach {
            return [0.0; SECTORS];
        }
        let mut rise = [f64::INFINITY; SECTORS];
        for ((across, at), toward) in self.lines.iter().zip(&self.toward) {
            let beyond = middle.dot(*across) - half.dot(across.abs()) - at - room;
            if beyond > 0.0 {
                let steepest = height / beyond;
                (0..SECTORS).for_each(|s| rise[s] = rise[s].min(steepest * toward[s]));
            }
        }
        rise
    }

    /// The slopes, by sector, of the steepest rays that can meet the hull of these points: 0 where it lies in or below the plane, infinite
    /// where it may lie over the triangle.
    fn rise(&self, points: &[Point]) -> [f64; SECTORS] {
        let (mut steepest, mut behind, mut above) = ([0.0f64; LINES], [false; LINES], false);
        for p in points {
            let to = *p - self.origin;
            let height = to.dot(self.normal);
            let high = height > self.reach;
            above |= high;
            for (k, (across, at)) in self.lines.iter().enumerate() {
                let beyond = to.dot(*across) - at;
                behind[k] |= beyond < -self.reach;
                if high {
                    steepest[k] = steepest[k].max(height / beyond.max(0.0));
                }
            }
        }
        if !above {
            return [0.0; SECTORS];
        }
        let mut rise = [f64::INFINITY; SECTORS];
        for k in 0..LINES {
            // Where a point is behind the line the hull may lie over the triangle.
            if !behind[k] && steepest[k].is_finite() {
                (0..SECTORS).for_each(|s| rise[s] = rise[s].min(steepest[k] * self.toward[k][s]));
            }
        }
        rise
    }
}

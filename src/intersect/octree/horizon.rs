//! How high above each facet anything else stands: a ray that leaves a facet above its horizon meets nothing.
//!
//! Light leaves a lens, a cover or an open reflector by such rays, one in three to one in five of all, and to find out by walking
//! that nothing is there costs as much as a hit.
//!
//! The horizon of a triangle is bounded, in eight sectors around it, from lines in its plane that have the triangle on one side.
//! A ray of slope `s` that runs at an angle `a` to the normal of such a line is at a height of at most `g·s/cos a` when it is
//! `g` beyond the line; and of points of a convex set at heights `h` and distances `g`, `h/g` is greatest at a corner of the set.
//! So is it bounded for boxes, and only boxes that may stand higher than what was found already are opened.
//!
//! Guarantee: conservative; heights up to the reach of a start, a picometre for a lamp, count as nothing.
//! Weakness: eight sectors of one angle each, so that out of a narrow shaft no ray is seen to be free.

use super::Octree;
use super::node::{Link, Target};
use crate::math::{Aabb, Point, Vector, orthonormal_pair};
use std::f64::consts::FRAC_PI_8;
use std::sync::Mutex;

/// Rays for each facet from which on it pays to know the horizons: to find one takes some 40 µs, and it saves a ray that leaves less
/// than 0.1 µs.
const WORTH: u64 = 1000;
/// Slope above which a horizon is of no use.
const STEEP: f64 = 8.0;
/// Facets whose horizons are found at a time.
const CHUNK: usize = 64;

/// Sectors around a triangle: a ray is in one by the signs and the order of its two coordinates in the plane.
const SECTORS: usize = 8;

/// What is asked of a ray that leaves a facet, which may do so from either triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Horizon([Skyline; 2]);

/// Whether a ray rises faster over a triangle than anything stands.
#[derive(Clone, Copy, Debug)]
struct Skyline {
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

    #[inline(always)]
    fn is_below(&self, d: [f32; 3]) -> bool {
        let dot = |a: [f32; 3]| a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
        let (up, x, y) = (dot(self.normal), dot(self.x), dot(self.y));
        let sector = usize::from(x < 0.0) | usize::from(y < 0.0) << 1 | usize::from(y.abs() > x.abs()) << 2;
        let flat2 = x * x + y * y;
        // Nearly upright the sector is a matter of rounding.
        let upright = flat2 < 1e-6;
        let slope2 = if upright { self.steepest } else { self.slope2[sector] };
        up > 0.0 && up * up > slope2 * flat2 && slope2 < f32::INFINITY
    }
}

impl Horizon {
    const UNKNOWN: Self = Self([Skyline::UNKNOWN; 2]);

    #[inline(always)]
    pub(super) fn is_below(&self, d: Vector) -> bool {
        let d = d.to_array().map(|x| x as f32);
        self.0[0].is_below(d) && self.0[1].is_below(d)
    }
}

/// Whether so many rays are worth the search.
pub(super) fn pays(tree: &Octree, rays: u64) -> bool {
    rays / WORTH >= tree.around.mesh.facets.len() as u64
}

/// The horizons of all facets.
pub(super) fn find(tree: &Octree, threads: usize) -> Vec<Horizon> {
    let mut horizons = vec![Horizon::UNKNOWN; tree.around.mesh.facets.len()];
    let chunks = Mutex::new(horizons.chunks_mut(CHUNK).enumerate());
    let work = || {
        let mut open = Vec::new();
        loop {
            let taken = chunks.lock().unwrap_or_else(|e| e.into_inner()).next();
            let Some((k, chunk)) = taken else { return };
            for (i, horizon) in chunk.iter_mut().enumerate() {
                *horizon = of_facet(tree, k * CHUNK + i, &mut open);
            }
        }
    };
    std::thread::scope(|scope| {
        (1..threads).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    horizons
}

fn of_facet(tree: &Octree, facet: usize, open: &mut Vec<Link>) -> Horizon {
    let mesh = tree.around.mesh;
    let [a, b, c, d] = mesh.corners(facet);
    let [first, second] = [[a, b, c], [a, c, d]];
    let mut of = |own: [Point; 3], other: [Point; 3]| {
        Base::new(own, tree.around.reach).map_or(Skyline::UNKNOWN, |base| base.skyline(tree, facet, other, open))
    };
    let one = of(first, second);
    if mesh.facets[facet].is_triangle() { Horizon([one; 2]) } else { Horizon([one, of(second, first)]) }
}

/// A triangle that rays leave, with the lines in its plane through its sides and corners.
struct Base {
    normal: Vector,
    x: Vector,
    y: Vector,
    origin: Point,
    /// Direction across each line, away from the triangle, and where the line is.
    lines: [(Vector, f64); LINES],
    /// Greatest cosine between the direction across a line and that of a ray in a sector.
    toward: [[f64; SECTORS]; LINES],
    reach: f64,
}

/// Three sides and three corners.
const LINES: usize = 6;

impl Base {
    fn new(corners: [Point; 3], reach: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let mut sides = [Vector::ZERO; 3];
        for k in 0..3 {
            sides[k] = (corners[(k + 1) % 3] - corners[k]).cross(normal).try_normalize()?;
        }
        let mut lines = [(Vector::ZERO, 0.0); LINES];
        for k in 0..3 {
            lines[k] = (sides[k], sides[k].dot(corners[k] - a));
            // At a corner between the sides that meet there.
            let across = (sides[k] + sides[(k + 2) % 3]).try_normalize()?;
            lines[k + 3] = (across, across.dot(corners[k] - a));
        }
        let (x, y) = orthonormal_pair(normal);
        // Half a sector, and room for the rounding of where a ray belongs.
        let half = FRAC_PI_8 + 1e-3;
        let toward = lines.map(|(across, _)| {
            std::array::from_fn(|sector| {
                let middle = if sector & 4 == 0 { FRAC_PI_8 } else { 3.0 * FRAC_PI_8 };
                let sign = |bit: usize| if sector & bit == 0 { 1.0 } else { -1.0 };
                let ray = x * (sign(1) * middle.cos()) + y * (sign(2) * middle.sin());
                let apart = (ray.dot(across).clamp(-1.0, 1.0).acos() - half).max(0.0);
                apart.cos().max(0.0)
            })
        });
        Some(Self { normal, x, y, origin: a, lines, toward, reach })
    }

    /// How steeply anything stands over the plane, seen from the triangle.
    fn skyline(&self, tree: &Octree, facet: usize, other: [Point; 3], open: &mut Vec<Link>) -> Skyline {
        let mesh = tree.around.mesh;
        let mut slopes = self.rise(&other);
        open.clear();
        open.extend(tree.root);
        while let Some(link) = open.pop() {
            if slopes.iter().all(|s| *s > STEEP) {
                return Skyline::UNKNOWN;
            }
            match link.target() {
                Target::Node(index) => {
                    let node = &tree.nodes[index];
                    for slot in (0..8).filter(|k| node.used >> k & 1 == 1) {
                        let b = node.child(slot);
                        let b = Aabb { min: b.min + tree.center, max: b.max + tree.center };
                        let higher = || {
                            let rise = self.rise(&b.corners());
                            (0..SECTORS).any(|k| slopes[k] <= STEEP && rise[k] > slopes[k])
                        };
                        if self.stands_out(&b) && higher() {
                            open.push(Link(node.children[slot]));
                        }
                    }
                }
                Target::Block(index, count) => {
                    let block = &tree.blocks[index];
                    for k in (0..count).filter(|&k| block.facets[k] as usize != facet) {
                        let rise = self.rise(&block.positions[k].map(|p| mesh.positions[p as usize]));
                        slopes = std::array::from_fn(|k| slopes[k].max(rise[k]));
                    }
                }
                Target::End => {}
            }
        }
        // Room for f32.
        let slope2 = slopes.map(|s| if s <= STEEP { (s * s * (1.0 + 1e-4) + 1e-6) as f32 } else { f32::INFINITY });
        let [normal, x, y] = [self.normal, self.x, self.y].map(|v| v.to_array().map(|x| x as f32));
        Skyline { normal, x, y, slope2, steepest: slope2.into_iter().fold(0.0, f32::max) }
    }

    /// Whether anything of a box can lie above the plane.
    fn stands_out(&self, b: &Aabb) -> bool {
        let highest = (b.center() - self.origin).dot(self.normal) + 0.5 * b.size().dot(self.normal.abs());
        highest > -1e-6 * b.size().max_element()
    }

    /// The steepest rays, by sector, that can meet the hull of these points.
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

//! The f64 test of one facet each for eight rays at once, with the arithmetic of [`crate::intersect::line::Line::test_quad`] step by
//! step, so that hits have the same bits as of a ray alone. Written as one loop over the lanes without branches, which compilers turn into
//! whole registers; a test that needs more than the signs of edge functions is left to the caller.

use super::mesh_box::{ordered_max, ordered_min};
use super::quad_edges::margin;
use crate::intersect::facet::FacetRay;
use crate::intersect::facet_hit::{EdgeHit, Nearest};

/// Tests done at once.
pub(super) const LANES: usize = 8;

/// A number for each test.
type Lane = [f64; LANES];

/// What is known of the tests before, and after.
#[repr(C, align(64))]
pub(super) struct FacetLanes {
    /// Of each corner along x, y and z, mm.
    corners: [[Lane; 3]; 4],
    origin: [Lane; 3],
    /// As [`FacetRay::main_axis`].
    main_axis: [u64; LANES],
    /// As [`FacetRay::shear`].
    shear: [Lane; 3],
    t_min: Lane,
    /// The nearest hit of the ray so far, or the end of its range.
    t_max: Lane,
    /// Whether the ray leaves a facet, and whether it is this one: 1 or 0.
    departs: [u64; LANES],
    is_own: [u64; LANES],
    /// Whether this facet is the nearest hit so far, found in another cell: 1 or 0.
    is_known: [u64; LANES],
    /// Triangles that the sieve left: bits 0 and 1.
    triangles: [u64; LANES],
    /// Found: distance and edge functions of a hit, and what is to be done, as [`Verdict`] says.
    t: Lane,
    edges: [Lane; 3],
    verdicts: [u64; LANES],
}

/// What a test has come to: bits of [`FacetLanes::verdict`].
pub(super) struct Verdict;

impl Verdict {
    /// The facet is hit, nearer than all before.
    pub(super) const HIT: u64 = 1;
    /// The hit is on the second triangle.
    pub(super) const SECOND: u64 = 2;
    /// More than the signs of edge functions decides; other bits mean nothing.
    pub(super) const CARE: u64 = 4;
}

impl FacetLanes {
    /// Lanes with numbers that mean nothing.
    pub(super) fn new() -> Self {
        Self {
            corners: [[[0.0; LANES]; 3]; 4],
            origin: [[0.0; LANES]; 3],
            main_axis: [0; LANES],
            shear: [[0.0; LANES]; 3],
            t_min: [0.0; LANES],
            t_max: [0.0; LANES],
            departs: [0; LANES],
            is_own: [0; LANES],
            is_known: [0; LANES],
            triangles: [0; LANES],
            t: [0.0; LANES],
            edges: [[0.0; LANES]; 3],
            verdicts: [0; LANES],
        }
    }

    /// Puts a test in a lane: of these triangles (bits 0 and 1) of a facet with these corners, mm in the order of x, y, z, for a ray and
    /// what it has met so far. `departed` is the facet that the ray leaves, else one that none is.
    #[inline(always)]
    pub(super) fn put(
        &mut self,
        lane: usize,
        (facet, triangles, corners): (u32, u32, [&[f64; 3]; 4]),
        ray: &FacetRay,
        (departed, best): (u32, &Nearest),
    ) {
        let lane = lane % LANES;
        let shear = ray.shear();
        for a in 0..3 {
            for k in 0..4 {
                self.corners[k][a][lane] = corners[k][a];
            }
            self.origin[a][lane] = ray.origin[a];
            self.shear[a][lane] = shear[a];
        }
        self.main_axis[lane] = u64::from(ray.main_axis());
        self.t_min[lane] = ray.t_min;
        self.t_max[lane] = best.t;
        self.departs[lane] = u64::from(departed != u32::MAX);
        self.is_own[lane] = u64::from(departed == facet);
        self.is_known[lane] = u64::from(best.is_on(facet));
        self.triangles[lane] = u64::from(triangles);
    }

    /// Does all tests; a facet is near the start of a ray when its box, grown by `reach` mm, holds it.
    #[inline(always)]
    pub(super) fn test(&mut self, reach: f64) {
        for l in 0..LANES {
            let [ox, oy, oz] = [self.origin[0][l], self.origin[1][l], self.origin[2][l]];
            let [sx, sy, sz] = [self.shear[0][l], self.shear[1][l], self.shear[2][l]];
            let (mut x, mut y, mut z) = ([0.0; 4], [0.0; 4], [0.0; 4]);
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            let (along_x, along_y) = (self.main_axis[l] == 0, self.main_axis[l] == 1);
            for k in 0..4 {
                let [dx, dy, dz] =
                    [self.corners[k][0][l] - ox, self.corners[k][1][l] - oy, self.corners[k][2][l] - oz];
                // In the order of the ray's axes, the main one last.
                let turned = |by_x: f64, by_y: f64, by_z: f64| {
                    let others = if along_y { by_y } else { by_z };
                    if along_x { by_x } else { others }
                };
                let [cx, cy, cz] = [turned(dy, dz, dx), turned(dz, dx, dy), turned(dx, dy, dz)];
                (low, high) = (
                    [ordered_min(low[0], cx), ordered_min(low[1], cy), ordered_min(low[2], cz)],
                    [ordered_max(high[0], cx), ordered_max(high[1], cy), ordered_max(high[2], cz)],
                );
                x[k] = cx - sx * cz;
                y[k] = cy - sy * cz;
                z[k] = cz;
            }
            let edge = |from: usize, to: usize| x[from] * y[to] - y[from] * x[to];
            let (e0, e1, e2, e3) = (edge(1, 0), edge(2, 1), edge(3, 2), edge(0, 3));
            let diagonal = edge(0, 2);
            let lowest = ordered_max(ordered_max(low[0], low[1]), low[2]);
            let highest = ordered_min(ordered_min(high[0], high[1]), high[2]);
            let near = (lowest <= reach) & (highest >= -reach);
            // How far the corners are from the start along an axis, in the larger direction.
            let farthest = ordered_max(
                ordered_max(ordered_max(-low[0], high[0]), ordered_max(-low[1], high[1])),
                ordered_max(-low[2], high[2]),
            );
            let margin = margin(farthest, reach);
            let first = Signs::new([e1, diagonal, e0]);
            let second = Signs::new([e2, e3, -diagonal]);
            let (tests_first, tests_second) = (self.triangles[l] & 1 != 0, self.triangles[l] & 2 != 0);
            let misses_clearly =
                (!tests_first | first.are_opposite(margin)) & (!tests_second | second.are_opposite(margin));
            let by_start = ((self.departs[l] != 0) & near) | (self.is_own[l] != 0);
            let meets_first = tests_first & first.are_one_sided();
            let meets_second = tests_second & second.are_one_sided();
            let is_doubtful =
                (tests_first & first.has_zero) | (tests_second & second.has_zero) | (meets_first & meets_second);
            let pick = |a: f64, b: f64| if meets_second { b } else { a };
            let [u, v, w] = [pick(e1, e2), pick(diagonal, e3), pick(e0, -diagonal)];
            let t = (u * z[0] + v * pick(z[1], z[2]) + w * pick(z[2], z[3])) * sz / (u + v + w);
            let is_hit = (meets_first | meets_second) & (t >= self.t_min[l]);
            let is_tie = is_hit & (t == self.t_max[l]) & (self.is_known[l] == 0);
            let care = (by_start & !misses_clearly) | (!by_start & (is_doubtful | is_tie));
            let hit = !by_start & is_hit & (t < self.t_max[l]);
            self.t[l] = t;
            (self.edges[0][l], self.edges[1][l], self.edges[2][l]) = (u, v, w);
            self.verdicts[l] = u64::from(hit) | u64::from(meets_second) << 1 | u64::from(care) << 2;
        }
    }

    /// The bits of [`Verdict`] of a lane.
    #[inline(always)]
    pub(super) fn verdict(&self, lane: usize) -> u64 {
        self.verdicts[lane % LANES]
    }

    /// The hit of a lane; it means nothing where the verdict says that there is none.
    #[inline(always)]
    pub(super) fn hit(&self, lane: usize, facet: u32) -> EdgeHit {
        let lane = lane % LANES;
        EdgeHit {
            t: self.t[lane],
            facet,
            second: self.verdicts[lane] & Verdict::SECOND != 0,
            edges: self.edges.map(|edge| edge[lane]),
        }
    }
}

/// The signs of the edge functions of a triangle.
struct Signs {
    least: f64,
    most: f64,
    has_zero: bool,
}

impl Signs {
    #[inline(always)]
    fn new([a, b, c]: [f64; 3]) -> Self {
        // Not equal to itself where it is no number: left to the exact test like a zero.
        let is_zero = |e: f64| !((e < 0.0) | (e > 0.0));
        Self {
            least: ordered_min(ordered_min(a, b), c),
            most: ordered_max(ordered_max(a, b), c),
            has_zero: is_zero(a) | is_zero(b) | is_zero(c),
        }
    }

    /// Whether two have opposite signs and both are larger than a margin.
    #[inline(always)]
    fn are_opposite(&self, margin: f64) -> bool {
        (self.least < -margin) & (self.most > margin)
    }

    /// Whether no two have opposite signs; says nothing where one is no number.
    #[inline(always)]
    fn are_one_sided(&self) -> bool {
        !((self.least < 0.0) & (self.most > 0.0))
    }
}

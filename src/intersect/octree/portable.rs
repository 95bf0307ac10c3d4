//! The walk in plain Rust.

use super::lanes::Lanes;
use super::node::{Block, CHILDREN, Link};
use super::ray::{BoxRay, Entry, LEAVE_STRETCH, SieveLimits, SieveRay};

/// Lanes as arrays; compilers vectorise most of it for the baseline of the target.
pub(super) struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn enter(entry: &Entry, ray: &BoxRay, enters: &mut [f32; 16], links: &mut [u32; 16]) -> u32 {
        let Entry { scale, near, far, node, order } = *entry;
        let mut enter = [ray.t_min; 16];
        let mut leave = [ray.t_max; 16];
        for a in 0..3 {
            let [first, last] =
                [ray.rows.near[a], ray.rows.far[a]].map(|place| &node.bounds[usize::from(place) / CHILDREN]);
            for k in 0..16 {
                enter[k] = enter[k].max(f32::from(first[k]) * scale[a] + near[a]);
                leave[k] = leave[k].min(f32::from(last[k]) * scale[a] + far[a]);
            }
        }
        let order = order as usize;
        let mut met = 0;
        let mut count = 0;
        for lane in 0..16 {
            let k = 15 ^ lane ^ order;
            if Link(node.children[k]) != Link::NONE && enter[k] <= leave[k] * LEAVE_STRETCH {
                enters[count] = enter[k];
                links[count] = node.children[k];
                met |= 1 << lane;
                count += 1;
            }
        }
        met
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SieveRay, limits: &SieveLimits, unmet: u32) -> u32 {
        let SieveLimits { to, error, t_min, t_max } = *limits;
        let [kx, ky, kz] = ray.axes.map(usize::from);
        let [sx, sy, sz] = ray.shear;
        let sheared = |row: usize| -> [[f32; 8]; 3] {
            let lane = |a: usize, k: usize| f32::from(block.corners[a][row + k]) * block.step + to[a];
            let z: [f32; 8] = std::array::from_fn(|k| lane(kz, k));
            let x = std::array::from_fn(|k| lane(kx, k) - sx * z[k]);
            let y = std::array::from_fn(|k| lane(ky, k) - sy * z[k]);
            [x, y, z.map(|z| z * sz)]
        };
        let ([ax, ay, at], [bx, by, bt]) = (sheared(0), sheared(8));
        let mut mask = 0;
        for k in 0..8 {
            let (cx, cy, ct) = (ax[k ^ 4], ay[k ^ 4], at[k ^ 4]);
            let u = cx * by[k] - cy * bx[k];
            let v = ax[k] * cy - ay[k] * cx;
            let w = bx[k] * ay[k] - by[k] * ax[k];
            // Not a number is no reason to drop a facet.
            let outside = u.min(v).min(w) < -error && u.max(v).max(w) > error;
            let late = at[k].min(bt[k]).min(ct) > t_max;
            let early = at[k].max(bt[k]).max(ct) < t_min;
            let is_own = block.facets[k & 3] == unmet;
            mask |= u32::from(!(outside | late | early | is_own)) << k;
        }
        mask
    }

    #[inline(always)]
    fn open(enters: &[f32; 16], t_max: f32) -> u32 {
        enters.iter().enumerate().fold(0, |open, (k, &enter)| open | u32::from(enter <= t_max) << k)
    }
}

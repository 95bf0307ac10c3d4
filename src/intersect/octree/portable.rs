//! The walk in plain Rust.

use super::lanes::Lanes;
use super::node::{Block, Node};
use super::ray::{BoxRay, LEAVE_STRETCH, SieveRay, corner_error, edge_error};

/// Eight lanes as arrays; compilers vectorise most of it for the baseline of the target.
pub(super) struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn enter(node: &Node, order: u32, ray: &BoxRay, enters: &mut [f32; 16], links: &mut [u32; 16]) -> u32 {
        let mut enter = [ray.t_min; 16];
        let mut leave = [ray.t_max; 16];
        for a in 0..3 {
            let base = (node.origin[a] - ray.origin[a]) * ray.inverse[a];
            let scale = node.step[a] * ray.inverse[a];
            let (to_low, to_high) = (base - ray.slack[a], base + ray.slack[a]);
            for k in 0..16 {
                let low = f32::from(node.bounds[2 * a][k]) * scale + to_low;
                let high = f32::from(node.bounds[2 * a + 1][k]) * scale + to_high;
                enter[k] = enter[k].max(low.min(high));
                leave[k] = leave[k].min(low.max(high));
            }
        }
        let order = order as usize;
        let mut met = 0;
        let mut count = 0;
        for lane in 0..16 {
            let k = 15 ^ lane ^ order;
            if node.used >> k & 1 == 1 && enter[k] <= leave[k] * LEAVE_STRETCH {
                enters[count] = enter[k];
                links[count] = node.children[k];
                met |= 1 << lane;
                count += 1;
            }
        }
        met
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SieveRay, boxes: &BoxRay, unmet: u32) -> u32 {
        let to: [f32; 3] = std::array::from_fn(|a| (block.origin[a] - ray.high[a]) - ray.low[a]);
        let far = to[0].abs().max(to[1].abs()).max(to[2].abs());
        let corner = corner_error(block.step, far, ray.slack);
        let error = edge_error(block.step, corner);
        let (t_min, t_max) = (boxes.t_min - 2.0 * corner, boxes.t_max + 2.0 * corner);
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

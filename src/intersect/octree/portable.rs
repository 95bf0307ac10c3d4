//! The walk in plain Rust.

use super::engine::Lanes;
use super::node::{Block, Node};
use super::state::{BoxRay, SiftRay, edge_error};

/// Eight lanes as arrays; compilers vectorise most of it for the baseline of the target.
pub(super) struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn enter(node: &Node, ray: &BoxRay) -> (u32, [f32; 8]) {
        let mut enter = [ray.t_min; 8];
        let mut leave = [ray.t_max; 8];
        for a in 0..3 {
            let base = (node.origin[a] - ray.origin[a]) * ray.inverse[a];
            let scale = node.step[a] * ray.inverse[a];
            let (early, late) = (base - ray.slack[a], base + ray.slack[a]);
            let near = ray.near[a] as usize;
            for k in 0..8 {
                enter[k] = enter[k].max(f32::from(node.bounds[near][k]) * scale + early);
                leave[k] = leave[k].min(f32::from(node.bounds[near ^ 1][k]) * scale + late);
            }
        }
        let mut mask = 0;
        for k in 0..8 {
            mask |= u32::from(enter[k] <= leave[k] * (1.0 + 5e-7)) << k;
        }
        (mask & node.used, enter)
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SiftRay) -> u32 {
        let to: [f32; 3] = std::array::from_fn(|a| (block.origin[a] - ray.high[a]) - ray.low[a]);
        let far = to[0].abs().max(to[1].abs()).max(to[2].abs());
        let error = edge_error(block.step, far, ray.slack);
        let [kx, ky, kz] = ray.axes.map(usize::from);
        let [sx, sy] = ray.slopes;
        let sheared = |row: usize| -> ([f32; 8], [f32; 8]) {
            let lane = |a: usize, k: usize| f32::from(block.corners[row + a][k]) * block.step + to[a];
            let z: [f32; 8] = std::array::from_fn(|k| lane(kz, k));
            (std::array::from_fn(|k| lane(kx, k) - sx * z[k]), std::array::from_fn(|k| lane(ky, k) - sy * z[k]))
        };
        let ((ax, ay), (bx, by)) = (sheared(0), sheared(3));
        let mut mask = 0;
        for k in 0..8 {
            let (cx, cy) = (ax[k ^ 4], ay[k ^ 4]);
            let u = cx * by[k] - cy * bx[k];
            let v = ax[k] * cy - ay[k] * cx;
            let w = bx[k] * ay[k] - by[k] * ax[k];
            // Not a number is no reason to drop a facet.
            let outside = u.min(v).min(w) < -error && u.max(v).max(w) > error;
            mask |= u32::from(!outside) << k;
        }
        mask
    }
}

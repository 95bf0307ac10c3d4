//! The hull of distances over a rectangle of parameters, as `scalar_bezier.rs` has it over a segment or a triangle.

use super::refine::halve_net;

/// Buffers reused from cell to cell.
#[derive(Default)]
pub(in crate::tessellate) struct ScalarPatch {
    /// Nets of W·(d − limit) that wait for halving, one after another.
    stack: Vec<f64>,
}

impl ScalarPatch {
    /// Returns a bound of Σ dᵢwᵢBᵢ / Σ wᵢBᵢ over the unit square for pairs (dᵢ, wᵢ) of a net of these degrees; `None` unless within the
    /// limit. Counts down the halvings `left`, and gives up when they are used up.
    pub(super) fn bound(
        &mut self,
        net: impl Iterator<Item = (f64, f64)>,
        [p, q]: [usize; 2],
        limit: f64,
        left: &mut u32,
    ) -> Option<f64> {
        let mut heaviest = 0f64;
        self.stack.clear();
        self.stack.extend(net.map(|(d, w)| {
            heaviest = heaviest.max(w);
            w * (d - limit)
        }));
        let size = self.stack.len();
        let mut most = f64::NEG_INFINITY;
        while !self.stack.is_empty() {
            let start = self.stack.len() - size;
            let net = &self.stack[start..];
            let worst = net.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
            if worst <= 0.0 {
                most = most.max(worst);
                self.stack.truncate(start);
                continue;
            }
            // At corners the value itself is taken.
            if [0, q, p * (q + 1), size - 1].iter().any(|&k| net[k] > 0.0) {
                return None;
            }
            // Of the whole cell's budget: a patch that needs more than its share takes it from the others.
            *left = left.checked_sub(1)?;
            // Halving helps most across the direction in which the coefficients bend most.
            let bend = |i: usize, step: usize| (net[i + 2 * step] - 2.0 * net[i + step] + net[i]).abs();
            let along_u = (0..size.saturating_sub(2 * (q + 1))).map(|i| bend(i, q + 1)).fold(0.0, f64::max);
            let rows = (0..=p).flat_map(|i| (0..q.saturating_sub(1)).map(move |j| i * (q + 1) + j));
            let along_v = rows.map(|i| bend(i, 1)).fold(0.0, f64::max);
            self.stack.extend_from_within(start..);
            let (low, high) = self.stack[start..].split_at_mut(size);
            halve_net(low, high, [p, q], if along_u >= along_v { 0 } else { 1 });
        }
        // As in `ScalarBezier::bound_within`: dividing by the largest weight is on the safe side, for `most` is not positive.
        Some(limit + most / heaviest)
    }
}

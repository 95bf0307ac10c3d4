//! Edges on a surface that touches itself, as the turns of a closed spring do. A place where two sheets meet has parameters on either;
//! an edge that was found on the wrong one is found again from where its loop says that it starts.

use super::fit::{Fit, Overrun};
use super::task::FaceTask;
use super::tolerances::TORN;
use crate::math::Uv;
use crate::nurbs::{Curve, Derivatives};
use crate::step::chart::Kind;
use rustc_hash::FxHashMap;

/// Places in a span of an edge at which it is followed from one end to the other.
const STEPS: usize = 8;

/// A use of an edge in a loop: its number, and whether it is run against its parameter.
type Use = (usize, bool);

impl FaceTask<'_> {
    /// Fits anew the edges whose parameters jump to another sheet, on the way or to the next edge of the loop, where that leaves fewer
    /// jumps. Does nothing on surfaces of closed form, which have no sheets but their periods. Fails when the budget is used up.
    pub(super) fn keep_to_sheets(&self, fits: &mut FxHashMap<usize, Fit>) -> Result<(), Overrun> {
        if matches!(self.chart.kind, Kind::Plane { .. } | Kind::Cone { .. } | Kind::Torus { .. }) {
            return Ok(());
        }
        for uses in &self.loops {
            let mut is_torn = false;
            for k in 0..uses.len() {
                is_torn |= self.keep_to_sheet(uses, k, fits)?;
            }
            // An edge that lies on another sheet from end to end is corrected from a neighbour, which may have been wrong itself.
            for k in (0..uses.len()).filter(|_| is_torn) {
                self.keep_to_sheet(uses, k, fits)?;
            }
        }
        Ok(())
    }

    /// Fits one edge of a loop anew if its parameters jump: from its own end, then from where the neighbours end. Returns whether they did.
    fn keep_to_sheet(&self, uses: &[Use], k: usize, fits: &mut FxHashMap<usize, Fit>) -> Result<bool, Overrun> {
        let jumps = self.jumps(uses, k, fits);
        if jumps == [0, 0] {
            return Ok(false);
        }
        let (edge, reversed) = uses[k];
        let task_edge = self.edges[&edge];
        let curve = task_edge.curve;
        let (before, after) = neighbours(uses, k, fits);
        let (at_start, at_end) = if reversed { (after, before) } else { (before, after) };
        let [own_start, own_end] = [false, true].map(|end| end_of(fits, (edge, false), end));
        let starts = [self.followed_back(curve, own_end)?, at_start, self.followed_back(curve, at_end)?];
        // From the sheet on which it began it would be found as it was.
        for start in starts.into_iter().filter(|start| self.is_torn(own_start, *start)) {
            let Some(first) = fits.insert(edge, self.fit_edge(task_edge, Some(start))?) else { continue };
            if self.jumps(uses, k, fits) < jumps {
                break;
            }
            fits.insert(edge, first);
        }
        Ok(true)
    }

    /// Counts the jumps of use `k` of a loop: within it, which weigh more, and to the uses before and after it. Where two edges begin on a
    /// wrong sheet together, the first that leaves it jumps to the second until that one has left it too.
    fn jumps(&self, uses: &[Use], k: usize, fits: &FxHashMap<usize, Fit>) -> [usize; 2] {
        let fit = &fits[&uses[k].0].curve;
        let inside =
            fit.breakpoints().windows(2).filter(|t| self.is_torn(fit.evaluate(t[0]), fit.evaluate(t[1]))).count();
        let (before, after) = neighbours(uses, k, fits);
        let joints = [(before, end_of(fits, uses[k], false)), (end_of(fits, uses[k], true), after)];
        [inside, joints.iter().filter(|(p, q)| self.is_torn(*p, *q)).count()]
    }

    /// Whether two places of the surface are [`TORN`] times as far apart along it as they are in space.
    fn is_torn(&self, p: Uv, q: Uv) -> bool {
        let q = self.chart.nearest_representative(q, p);
        let (a, b) = (self.chart.derivatives(p), self.chart.derivatives(q));
        let along = |d: &Derivatives| (d.du * (q.x - p.x) + d.dv * (q.y - p.y)).length();
        // At a pole all parameters are one place, whichever end of the step lies there.
        along(&a).min(along(&b)) > TORN * ((a.point - b.point).length() + self.accuracy)
    }

    /// Returns the parameters of the start of an edge whose end has the parameters `end`, by following it back.
    fn followed_back(&self, curve: &Curve, end: Uv) -> Result<Uv, Overrun> {
        let mut uv = end;
        for span in curve.breakpoints().windows(2).rev() {
            for step in (0..STEPS).rev() {
                self.budget.spend()?;
                let t = span[0] + (span[1] - span[0]) * step as f64 / STEPS as f64;
                uv = self.chart.locate(curve.evaluate(t), Some(uv));
            }
        }
        Ok(uv)
    }
}

/// Returns where a use of an edge starts (false) or ends (true) in its loop.
fn end_of(fits: &FxHashMap<usize, Fit>, (edge, reversed): Use, end: bool) -> Uv {
    let curve = &fits[&edge].curve;
    let [a, b] = curve.domain();
    curve.evaluate(if end == reversed { a } else { b })
}

/// Returns where the use before use `k` ends, and where the one after it starts.
fn neighbours(uses: &[Use], k: usize, fits: &FxHashMap<usize, Fit>) -> (Uv, Uv) {
    let n = uses.len();
    (end_of(fits, uses[(k + n - 1) % n], true), end_of(fits, uses[(k + 1) % n], false))
}

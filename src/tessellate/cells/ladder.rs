//! Preferred parameters for the cuts of the tree: samples of border edges that run along parameter lines, or lines spread evenly in
//! curvature.

use super::tree::Cell;
use crate::math::Uv;
use crate::tessellate::border::rings::{Follows, Rings};
use crate::tessellate::sheet::Sheet;

/// Preferred cuts in direction `d`.
pub(in crate::tessellate) fn ladder(sheet: &Sheet<'_>, rings: &Rings, root: Cell, d: usize) -> Vec<f64> {
    let other = 1 - d;
    let (lo, hi) = (root.lo[d], root.hi[d]);
    let flat = 1e-7 * (root.hi[other] - root.lo[other]);
    // Runs of samples along a parameter line, longest first.
    let mut runs: Vec<Vec<f64>> = Vec::new();
    for ring in &rings.rings {
        let n = ring.len();
        let level = |i: usize| {
            let (a, b) = (ring[i % n], ring[(i + 1) % n]);
            a.follows != Follows::Pole && (a.uv[other] - b.uv[other]).abs() <= flat
        };
        let start = (0..n).find(|&i| !level(i)).map_or(0, |i| i + 1);
        let mut run: Vec<f64> = Vec::new();
        for i in start..start + n {
            if level(i) {
                if run.is_empty() {
                    run.push(ring[i % n].uv[d]);
                }
                run.push(ring[(i + 1) % n].uv[d]);
            }
            if !level(i) || i + 1 == start + n {
                if run.len() > 2 {
                    run.sort_by(f64::total_cmp);
                    runs.push(std::mem::take(&mut run));
                }
                run.clear();
            }
        }
    }
    runs.sort_by_key(|r| std::cmp::Reverse(r.len()));
    let mut covered: Vec<[f64; 2]> = Vec::new();
    let mut steps: Vec<f64> = Vec::new();
    for run in runs {
        let fresh = |x: f64| !covered.iter().any(|c| c[0] - 1e-9 <= x && x <= c[1] + 1e-9);
        let new: Vec<f64> = run.iter().copied().filter(|&x| fresh(x)).collect();
        steps.extend(new);
        covered.push([run[0], run[run.len() - 1]]);
    }
    let share: f64 = covered.iter().map(|c| c[1] - c[0]).sum();
    if share < 0.5 * (hi - lo) {
        steps = even(sheet, root, d);
    }
    steps.sort_by(f64::total_cmp);
    // Where a uv curve jumps, the edge has hundreds of samples in one place; columns of cells between them would cross the face.
    steps.dedup_by(|b, a| *b - *a <= 1e-4 * (hi - lo));
    steps.retain(|&x| x > lo && x < hi);
    steps
}

/// Lines spread evenly in `√(curvature / tolerance)`, as many as the sharpest of a few lines needs, times a power of two.
fn even(sheet: &Sheet<'_>, root: Cell, d: usize) -> Vec<f64> {
    if sheet.surface.degree[d] == 1 && sheet.breaks[d].len() == 2 {
        // Straight lines bend nowhere.
        return Vec::new();
    }
    let (n, m) = (32, 5);
    let other = 1 - d;
    let at = |i: usize, j: usize| {
        let mut f = Uv::ZERO;
        f[d] = i as f64 / n as f64;
        f[other] = (j as f64 + 0.5) / m as f64;
        root.lo + f * (root.hi - root.lo)
    };
    let mut density = vec![0f64; n + 1];
    for j in 0..m {
        for (i, slot) in density.iter_mut().enumerate() {
            let uv = at(i, j);
            let der = sheet.second_derivatives(uv);
            let Some(forms) = crate::nurbs::FundamentalForms::new(&der) else { continue };
            let (mut along, mut across) = (Uv::ZERO, Uv::ZERO);
            along[d] = 1.0;
            across[other] = 1.0;
            let (k, c) = (forms.along(along), forms.along(across));
            let wide = if d == 0 { der.dv } else { der.du }.length() * (root.hi[other] - root.lo[other]);
            let xi = sheet.field.at(forms.sharpest());
            let share = if k * c > 0.0 { 1.0 - (c.abs() * wide * wide / (8.0 * xi)).min(0.5) } else { 1.0 };
            let speed = if d == 0 { der.du } else { der.dv }.length();
            *slot = slot.max((k.abs() / (8.0 * xi * share)).sqrt() * speed);
        }
    }
    let step = (root.hi[d] - root.lo[d]) / n as f64;
    let mut sum = vec![0.0];
    for i in 0..n {
        sum.push(sum[i] + 0.5 * (density[i] + density[i + 1]) * step);
    }
    let total = sum[n];
    if !total.is_finite() || total <= 1.0 {
        return Vec::new();
    }
    let count = (total * 1.03).ceil().min(4096.0) as usize;
    (1..count)
        .map(|k| {
            let goal = total * k as f64 / count as f64;
            let i = sum.partition_point(|&s| s <= goal).clamp(1, n) - 1;
            root.lo[d] + step * (i as f64 + ((goal - sum[i]) / (sum[i + 1] - sum[i])).clamp(0.0, 1.0))
        })
        .collect()
}

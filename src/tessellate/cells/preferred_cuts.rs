//! Preferred parameters for the cuts of the tree: samples of border edges that run along parameter lines, or lines spread evenly in
//! curvature.

use super::cell::Cell;
use crate::math::Uv;
use crate::nurbs::FundamentalForms;
use crate::tessellate::border::polygons::{BorderPolygons, BorderSide};
use crate::tessellate::face_surface::FaceSurface;

/// Share of the extent across within which a side runs along a parameter line.
const LEVEL: f64 = 1e-7;
/// Parameters within which a sample lies in the range of a longer run already.
const SAME_SAMPLE: f64 = 1e-9;
/// Share of the extent that runs of samples must cover to decide on the cuts.
const COVERED: f64 = 0.5;
/// Share of the extent within which two cuts are one: where a uv curve jumps, the edge has hundreds of samples in one place, and columns
/// of cells between them would cross the face.
const SAME_CUT: f64 = 1e-4;
/// Places along and across at which curvature is looked at.
const PLACES: [usize; 2] = [32, 5];
/// Most cuts that are spread evenly, and the share by which they are more than the curvature asks for.
const MAX_CUTS: f64 = 4096.0;
const SPARE: f64 = 1.03;
/// Share of the tolerance that bending the other way may take from chords along this one.
const MAX_SHARE_ACROSS: f64 = 0.5;

/// Returns the parameters strictly inside `root`, ascending, at which cells should be cut in direction `d` (0 for u, 1 for v): border
/// samples along parameter lines where these cover half of the range, else lines spread evenly in curvature. May be empty.
pub(in crate::tessellate) fn preferred_cuts(
    surface: &FaceSurface<'_>,
    border: &BorderPolygons,
    root: Cell,
    d: usize,
) -> Vec<f64> {
    let (lo, hi) = (root.lo[d], root.hi[d]);
    // Longest first, so that the densest samples decide.
    let mut runs = sample_runs(border, root, d);
    runs.sort_by_key(|r| std::cmp::Reverse(r.len()));
    let mut covered: Vec<[f64; 2]> = Vec::new();
    let mut cuts: Vec<f64> = Vec::new();
    for run in runs {
        let is_new = |x: f64| !covered.iter().any(|c| c[0] - SAME_SAMPLE <= x && x <= c[1] + SAME_SAMPLE);
        cuts.extend(run.iter().copied().filter(|&x| is_new(x)));
        covered.push([run[0], run[run.len() - 1]]);
    }
    let length: f64 = covered.iter().map(|c| c[1] - c[0]).sum();
    // Samples of the border that say little of the length are no guide: then the curvature is.
    if length < COVERED * (hi - lo) {
        cuts = even_cuts(surface, root, d);
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|b, a| *b - *a <= SAME_CUT * (hi - lo));
    cuts.retain(|&x| x > lo && x < hi);
    cuts
}

/// Lists runs of at least three border samples along lines on which parameter `d` alone changes: the values of `d`, ascending, one list a
/// run. Poles are left out.
fn sample_runs(border: &BorderPolygons, root: Cell, d: usize) -> Vec<Vec<f64>> {
    let other = 1 - d;
    let flat = LEVEL * (root.hi[other] - root.lo[other]);
    let mut runs: Vec<Vec<f64>> = Vec::new();
    for polygon in &border.polygons {
        let n = polygon.len();
        let is_level = |i: usize| {
            // Sides at a pole have samples in parameters that are one point in space.
            let (a, b) = (polygon[i % n], polygon[(i + 1) % n]);
            a.side != BorderSide::Pole && (a.uv[other] - b.uv[other]).abs() <= flat
        };
        // Start behind a side that is none, so that no run is cut in two.
        let start = (0..n).find(|&i| !is_level(i)).map_or(0, |i| i + 1);
        let mut run: Vec<f64> = Vec::new();
        for i in start..start + n {
            if is_level(i) {
                if run.is_empty() {
                    run.push(polygon[i % n].uv[d]);
                }
                run.push(polygon[(i + 1) % n].uv[d]);
            }
            if !is_level(i) || i + 1 == start + n {
                // Two samples are a straight side, which asks for no cuts.
                if run.len() > 2 {
                    run.sort_by(f64::total_cmp);
                    runs.push(std::mem::take(&mut run));
                }
                run.clear();
            }
        }
    }
    runs
}

/// Returns the values of parameter `d` that divide `root` evenly in `√(curvature / tolerance)`, as many as its sharpest line needs; empty
/// where one chord will do.
fn even_cuts(surface: &FaceSurface<'_>, root: Cell, d: usize) -> Vec<f64> {
    if surface.spline.degree[d] == 1 && surface.breaks[d].len() == 2 {
        // Straight lines bend nowhere.
        return Vec::new();
    }
    let [n, _] = PLACES;
    let density = chord_density(surface, root, d);
    let step = (root.hi[d] - root.lo[d]) / n as f64;
    let mut sum = vec![0.0];
    for i in 0..n {
        // Chords up to each place, by the trapezoidal rule.
        sum.push(sum[i] + 0.5 * (density[i] + density[i + 1]) * step);
    }
    let total = sum[n];
    // One chord will do.
    if !total.is_finite() || total <= 1.0 {
        return Vec::new();
    }
    // A few more than asked for, so that no cell just fails.
    let count = (total * SPARE).ceil().min(MAX_CUTS) as usize;
    (1..count)
        .map(|k| {
            let goal = total * k as f64 / count as f64;
            // Where the sum passes the goal, linearly between places.
            let i = sum.partition_point(|&s| s <= goal).clamp(1, n) - 1;
            root.lo[d] + step * (i as f64 + ((goal - sum[i]) / (sum[i + 1] - sum[i])).clamp(0.0, 1.0))
        })
        .collect()
}

/// Returns how many chords to a unit of parameter `d` that curvature asks for, at even places along `root`: the most of a few places
/// across, 0 where nothing bends.
fn chord_density(surface: &FaceSurface<'_>, root: Cell, d: usize) -> Vec<f64> {
    let [n, m] = PLACES;
    let other = 1 - d;
    let mut density = vec![0f64; n + 1];
    for j in 0..m {
        for (i, slot) in density.iter_mut().enumerate() {
            let mut share = Uv::ZERO;
            share[d] = i as f64 / n as f64;
            share[other] = (j as f64 + 0.5) / m as f64;
            let der = surface.second_derivatives(root.lo + share * (root.hi - root.lo));
            let Some(forms) = FundamentalForms::new(&der) else { continue };
            let mut along = Uv::ZERO;
            let mut across = Uv::ZERO;
            along[d] = 1.0;
            across[other] = 1.0;
            let (k, c) = (forms.normal_curvature(along), forms.normal_curvature(across));
            let width = if d == 0 { der.dv } else { der.du }.length() * (root.hi[other] - root.lo[other]);
            let xi = surface.field.tolerance_at(forms.largest_curvature());
            // Where the surface bends the same way across, that takes a share of the tolerance.
            let sag_across = c.abs() * width * width / (8.0 * xi);
            let left = if k * c > 0.0 { 1.0 - sag_across.min(MAX_SHARE_ACROSS) } else { 1.0 };
            let speed = if d == 0 { der.du } else { der.dv }.length();
            // Sag κh²/8 with h = speed × step, solved for steps to a unit of the parameter.
            *slot = slot.max((k.abs() / (8.0 * xi * left)).sqrt() * speed);
        }
    }
    density
}

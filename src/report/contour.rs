//! Lines of equal value through a grid: marching squares over the centres of its cells (Lorensen and Cline 1987, in two dimensions).

use crate::formats::Grid;
use rustc_hash::FxHashMap;

/// A line of equal value, in the grid's coordinates; a closed one ends where it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Isoline {
    /// The value.
    pub level: f64,
    /// Its points.
    pub points: Vec<[f64; 2]>,
}

/// Levels drawn: two decades of the series 1, 2, 5.
const LEVELS: usize = 7;

/// Lines of fewer points are specks of noise.
const FEWEST_POINTS: usize = 6;

/// Returns the seven highest levels of the series 1, 2, 5 below a value, rising; none unless it is positive and finite.
pub(super) fn round_levels(most: f64) -> Vec<f64> {
    if !(most > 0.0 && most.is_finite()) {
        return Vec::new();
    }
    // From three decades below, of which the last levels are kept.
    let decade = most.log10().floor() as i32;
    let all = (decade - 3..=decade).flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(e)));
    let mut levels: Vec<f64> = all.filter(|level| *level < most).collect();
    // Lines crowd towards the dark; the brightest levels are the ones that count.
    levels.drain(..levels.len().saturating_sub(LEVELS));
    levels
}

/// An edge between the centres of two neighbouring cells: the lower cell, and whether it runs along the second axis.
type Edge = (usize, usize, bool);

/// Finds the lines of these levels, through values averaged with their neighbours (1-2-1), so that noise does not tear them. None for a
/// grid of a single row or column; lines of fewer than [`FEWEST_POINTS`] are left out.
pub(super) fn isolines(grid: &Grid, levels: &[f64]) -> Vec<Isoline> {
    let [a, b] = &grid.axes;
    // Marching squares need squares.
    if a.cells < 2 || b.cells < 2 || grid.values.len() != a.cells * b.cells {
        return Vec::new();
    }
    let values = averaged_with_neighbours(&grid.values, a.cells, b.cells);
    let value = |i: usize, j: usize| values[j * a.cells + i];
    let mut lines = Vec::new();
    for &level in levels {
        let links = crossings(&values, [a.cells, b.cells], level);
        let place = |(i, j, second): Edge| {
            let (k, l) = if second { (i, j + 1) } else { (i + 1, j) };
            let (from, to) = (value(i, j), value(k, l));
            let t = ((level - from) / (to - from)).clamp(0.0, 1.0);
            [a.center(i) + t * (a.center(k) - a.center(i)), b.center(j) + t * (b.center(l) - b.center(j))]
        };
        for chain in chains(links) {
            if chain.len() >= FEWEST_POINTS {
                lines.push(Isoline { level, points: chain.into_iter().map(place).collect() });
            }
        }
    }
    lines
}

/// Returns each value averaged with its neighbours, weighed 1-2-1 along both axes; a neighbour beyond the border, or where there is no
/// cell, counts as the cell itself.
fn averaged_with_neighbours(values: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    let along = |values: &[f64], step: usize, place: &dyn Fn(usize) -> usize, count: usize| -> Vec<f64> {
        (0..values.len())
            .map(|k| {
                // At the border the missing neighbour is taken to be like the cell itself.
                let neighbour = |is_there: bool, k: usize| is_there.then(|| values[k]).filter(|v| !v.is_nan());
                let before = neighbour(place(k) > 0, k.wrapping_sub(step)).unwrap_or(values[k]);
                let after = neighbour(place(k) + 1 < count, k + step).unwrap_or(values[k]);
                0.25 * (before + 2.0 * values[k] + after)
            })
            .collect()
    };
    let once = along(values, 1, &|k| k % columns, columns);
    along(&once, columns, &|k| k / columns, rows)
}

/// Finds the edges between cell centres that a line of this level crosses, and returns for each those that it goes on to.
fn crossings(values: &[f64], [columns, rows]: [usize; 2], level: f64) -> FxHashMap<Edge, Vec<Edge>> {
    let mut links: FxHashMap<Edge, Vec<Edge>> = FxHashMap::default();
    let mut join = |p: Edge, q: Edge| {
        links.entry(p).or_default().push(q);
        links.entry(q).or_default().push(p);
    };
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let corner = |di: usize, dj: usize| values[(j + dj) * columns + i + di];
            let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            // No line runs where there is no cell, as beyond the rim of a disc.
            if corners.iter().any(|v| v.is_nan()) {
                continue;
            }
            let above = corners.map(|v| v >= level);
            // Bottom, right, top, left: the edge behind each corner, going round.
            let edges: [Edge; 4] = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
            let crossed: Vec<Edge> = (0..4).filter(|&k| above[k] != above[(k + 1) % 4]).map(|k| edges[k]).collect();
            match crossed[..] {
                [p, q] => join(p, q),
                [p, q, r, s] => {
                    // A saddle: the mean of its corners says which two of them belong together.
                    let middle_above = corners.iter().sum::<f64>() / 4.0 >= level;
                    if middle_above == above[0] {
                        join(p, q);
                        join(r, s);
                    } else {
                        join(p, s);
                        join(q, r);
                    }
                }
                _ => {}
            }
        }
    }
    links
}

/// Joins neighbouring edges to chains: those with an end first, then the closed ones, whose first edge comes again as the last.
fn chains(mut links: FxHashMap<Edge, Vec<Edge>>) -> Vec<Vec<Edge>> {
    // Starts are sorted: a table of hashes has no order, and pictures must not change from run to run.
    let mut starts: Vec<(bool, Edge)> = links.iter().map(|(edge, next)| (next.len() > 1, *edge)).collect();
    starts.sort_unstable();
    let mut chains = Vec::new();
    for (_, start) in starts {
        let mut chain = vec![start];
        let mut at = start;
        while let Some(next) = links.get_mut(&at).and_then(Vec::pop) {
            // Each link is used once, from whichever side the chain comes.
            if let Some(back) = links.get_mut(&next)
                && let Some(k) = back.iter().position(|e| *e == at)
            {
                back.swap_remove(k);
            }
            chain.push(next);
            at = next;
        }
        if chain.len() > 1 {
            chains.push(chain);
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;

    fn grid(cells: usize, value: impl Fn(f64, f64) -> f64) -> Grid {
        let axis = || Axis { label: "x".into(), unit: "mm".into(), range: [-1.0, 1.0], cells };
        let axes = [axis(), axis()];
        let values =
            (0..cells * cells).map(|k| value(axes[0].center(k % cells), axes[1].center(k / cells))).collect();
        let (name, quantity, unit) = (String::new(), String::new(), String::new());
        Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() }
    }

    #[test]
    fn the_lines_of_a_cone_are_circles() {
        let lines = isolines(&grid(100, |x, y| 1.0 - x.hypot(y)), &[0.5]);
        assert_eq!(lines.len(), 1);
        let points = &lines[0].points;
        assert_eq!(points.first(), points.last(), "a circle is closed");
        // Averaging with neighbours moves a cone of slope 1 by 1/8 of the square of a cell over its radius.
        assert!(points.iter().all(|[x, y]| (x.hypot(*y) - 0.5).abs() < 1e-3));
        let length: f64 = points.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum();
        assert!((length / std::f64::consts::PI - 1.0).abs() < 2e-3, "{length}");
    }

    /// On a disc without corners a line goes on into the last cells that there are, where on a square it would.
    #[test]
    fn lines_reach_the_rim_of_a_disc() {
        let disc = isolines(&grid(40, |x, y| if x.hypot(y) > 0.9 { f64::NAN } else { x }), &[0.5]);
        let [line] = &disc[..] else { panic!("{} lines", disc.len()) };
        let top = line.points.iter().map(|p| p[1]).fold(0.0, f64::max);
        // The last cells at x = 0.475 and 0.525 have their centres below √(0.81 − 0.525²) = 0.73: at 0.725.
        assert!((top - 0.725).abs() < 1e-9, "{top}");
        // A neighbour that is missing moves the mean of three by a quarter of a cell.
        assert!(line.points.iter().all(|p| (p[0] - 0.5).abs() < 0.25 * 0.05 + 1e-9));
    }

    #[test]
    fn saddles_and_borders_keep_every_line_apart() {
        let lines = isolines(&grid(40, |x, y| x * y), &[0.1]);
        assert_eq!(lines.len(), 2, "two branches of a hyperbola");
        for line in &lines {
            assert!(line.points.iter().all(|[x, y]| (x * y - 0.1).abs() < 2e-3));
        }
    }

    #[test]
    fn levels_are_round_and_below_the_peak() {
        assert_eq!(round_levels(20_313.0), [200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0]);
        assert_eq!(round_levels(0.0), [0f64; 0]);
    }
}

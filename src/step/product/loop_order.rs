//! Loops whose uses do not follow each other: wrong orientation flags and shuffled lists, corrected by their ends.

use crate::math::Point;
use rustc_hash::FxHashMap;

/// An edge use with the points between which it runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectedUse<T> {
    pub(crate) edge: T,
    pub(crate) reversed: bool,
    pub(crate) from: Point,
    pub(crate) to: Point,
}

impl<T> DirectedUse<T> {
    /// Turns the use to run the other way.
    fn turn(&mut self) {
        self.reversed = !self.reversed;
        std::mem::swap(&mut self.from, &mut self.to);
    }
}

/// Returns the largest step from one use to the next, all around, mm; 0 without uses.
fn largest_gap<T>(uses: &[DirectedUse<T>]) -> f64 {
    let n = uses.len();
    (0..n).map(|i| (uses[(i + 1) % n].from - uses[i].to).length()).fold(0.0, f64::max)
}

/// Makes each use of a loop begin where the one before ends, within `tolerance` mm, and says what was changed. `None` where nothing had to
/// be, and where the loop cannot be closed this way and stays as it was.
pub(crate) fn put_in_order<T: Copy>(uses: &mut Vec<DirectedUse<T>>, tolerance: f64) -> Option<&'static str> {
    if largest_gap(uses) <= tolerance {
        return None;
    }
    // The lesser change first. Left alone, an edge flag of a real file against its neighbours was bridged by a step
    // of 3.5 mm.
    for (mut tried, what) in [
        (turn_misfits(uses, tolerance), "an edge of a loop ran against its neighbours"),
        (chain_from_first(uses, tolerance), "the edges of a loop were not in order"),
    ] {
        if let Some(found) = tried.take() {
            *uses = found;
            return Some(what);
        }
    }
    None
}

/// Turns the fewest uses around with which the loop closes in its order; `None` when none do.
fn turn_misfits<T: Copy>(uses: &[DirectedUse<T>], tolerance: f64) -> Option<Vec<DirectedUse<T>>> {
    let turned = turned_to_follow(uses, tolerance)?;
    let mut out = uses.to_vec();
    out.iter_mut().zip(turned).filter(|(_, turned)| *turned).for_each(|(u, _)| u.turn());
    Some(out)
}

/// Returns which uses are to be turned around, the fewest with which each begins where the one before ends, within `tolerance` mm, in the
/// order they have; `None` when none do.
pub(crate) fn turned_to_follow<T>(uses: &[DirectedUse<T>], tolerance: f64) -> Option<Vec<bool>> {
    let first = uses.first()?;
    let follows = |a: Point, b: Point| (a - b).length() <= tolerance;
    let chained = |is_first_turned: bool| -> Option<Vec<bool>> {
        let (start, mut end) = if is_first_turned { (first.to, first.from) } else { (first.from, first.to) };
        let mut turned = vec![is_first_turned];
        for u in &uses[1..] {
            let is_turned = !follows(end, u.from);
            if is_turned && !follows(end, u.to) {
                return None;
            }
            end = if is_turned { u.from } else { u.to };
            turned.push(is_turned);
        }
        follows(end, start).then_some(turned)
    };
    let count = |turned: &Vec<bool>| turned.iter().filter(|t| **t).count();
    [false, true].into_iter().filter_map(chained).min_by_key(count)
}

/// Chains the uses anew from the first, turned where only their far end fits; `None` when that does not close the loop, or it is too long.
fn chain_from_first<T: Copy>(uses: &[DirectedUse<T>], tolerance: f64) -> Option<Vec<DirectedUse<T>>> {
    // Quadratic in the length: longer loops than this are left alone.
    if uses.len() > 2000 {
        return None;
    }
    let mut left = uses.to_vec();
    let mut out = vec![left.remove(0)];
    while !left.is_empty() {
        let at = out[out.len() - 1].to;
        let near = |p: Point| (p - at).length() <= tolerance;
        // A use that fits as it is goes before one that would be turned.
        let next = left.iter().position(|u| near(u.from)).or_else(|| left.iter().position(|u| near(u.to)))?;
        let mut found = left.remove(next);
        if !near(found.from) {
            found.turn();
        }
        out.push(found);
    }
    (largest_gap(&out) <= tolerance).then_some(out)
}

/// Drops loops that run along the edges of another one in the opposite direction, and that one, where others bound the face: both together
/// enclose nothing, and each fitted by itself they would enclose a sliver. Returns what to say of it.
pub(super) fn drop_opposite_loops(loops: &mut Vec<Vec<(usize, bool)>>) -> Option<&'static str> {
    let before = loops.len();
    let is_opposite = |a: &[(usize, bool)], b: &[(usize, bool)]| {
        let n = a.len();
        // The same cycle from some place on, backwards.
        n == b.len() && (0..n).any(|k| (0..n).all(|i| a[i] == (b[(k + n - i) % n].0, !b[(k + n - i) % n].1)))
    };
    // Both run along the same edges: only loops of the same least edge are compared.
    let least: Vec<Option<usize>> = loops.iter().map(|uses| uses.iter().map(|(edge, _)| *edge).min()).collect();
    let mut of_edge: FxHashMap<Option<usize>, Vec<usize>> = FxHashMap::default();
    for (k, edge) in least.iter().enumerate() {
        of_edge.entry(*edge).or_default().push(k);
    }
    let mut dropped = vec![false; before];
    let mut left = before;
    for (k, edge) in least.iter().enumerate() {
        if dropped[k] || left <= 2 {
            continue;
        }
        let mut others = of_edge[edge].iter().copied().filter(|&l| l > k && !dropped[l]);
        if let Some(l) = others.find(|&l| is_opposite(&loops[k], &loops[l])) {
            dropped[k] = true;
            dropped[l] = true;
            left -= 2;
        }
    }
    let mut is_dropped = dropped.into_iter();
    loops.retain(|_| is_dropped.next() == Some(false));
    (loops.len() < before).then_some("two bounds along the same edges in opposite directions enclose nothing")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<DirectedUse<usize>> {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point::new(x, y, 0.0));
        (0..4)
            .map(|i| DirectedUse { edge: i, reversed: false, from: corners[i], to: corners[(i + 1) % 4] })
            .collect()
    }

    #[test]
    fn a_closed_loop_stays() {
        let mut uses = square();
        assert_eq!(put_in_order(&mut uses, 1e-6), None);
    }

    #[test]
    fn wrong_flags_are_turned() {
        for wrong in [vec![1], vec![0], vec![1, 2], vec![0, 3], vec![0, 2], vec![1, 2, 3]] {
            let mut uses = square();
            wrong.iter().for_each(|&i| uses[i].turn());
            assert!(put_in_order(&mut uses, 1e-6).is_some(), "{wrong:?}");
            assert_eq!(largest_gap(&uses), 0.0);
            // In their order: of a gear's rim, 21 of 24 arcs were wrong and were run backwards.
            assert_eq!(uses.iter().map(|u| u.edge).collect::<Vec<_>>(), [0, 1, 2, 3], "{wrong:?}");
        }
    }

    #[test]
    fn shuffled_edges_are_sorted() {
        let mut uses = square();
        uses.swap(1, 2);
        assert!(put_in_order(&mut uses, 1e-6).is_some());
        assert_eq!(uses.iter().map(|u| u.edge).collect::<Vec<_>>(), [0, 1, 2, 3]);
    }

    #[test]
    fn what_cannot_close_is_left_alone() {
        let mut uses = square();
        uses.remove(2);
        assert_eq!(put_in_order(&mut uses, 1e-6), None);
        assert_eq!(uses.iter().map(|u| u.edge).collect::<Vec<_>>(), [0, 1, 3]);
    }

    #[test]
    fn loops_that_cancel_each_other_go_where_another_is_left() {
        let [there, back] = [vec![(3, false), (4, true), (5, false)], vec![(4, false), (3, true), (5, true)]];
        let other = vec![(7, false), (8, false)];
        let mut loops = vec![there.clone(), other.clone(), back.clone()];
        assert!(drop_opposite_loops(&mut loops).is_some());
        assert_eq!(loops, std::slice::from_ref(&other));
        for kept in [vec![there.clone(), back], vec![there.clone(), there, other]] {
            let mut loops = kept.clone();
            assert!(drop_opposite_loops(&mut loops).is_none() && loops == kept);
        }
    }

    #[test]
    fn pairs_among_many_loops_go_and_the_rest_keep_their_order() {
        let single = |k: usize| vec![(3 * k, false), (3 * k + 1, true)];
        let opposite = |k: usize| vec![(3 * k + 1, false), (3 * k, true)];
        let mut loops: Vec<Vec<(usize, bool)>> = (0..300).map(single).collect();
        loops.extend((0..300).filter(|k| k % 3 == 0).map(opposite));
        assert!(drop_opposite_loops(&mut loops).is_some());
        assert_eq!(loops, (0..300).filter(|k| k % 3 != 0).map(single).collect::<Vec<_>>());
    }
}

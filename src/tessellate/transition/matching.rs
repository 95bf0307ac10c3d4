//! Leaves fewer triangles without a mate: along a path of triangles in which every second pair is made already, the other pairs are
//! made instead, and both ends of the path find one.
//!
//! Source: C. Berge, *Two theorems in graph theory*, PNAS 43 (1957). Paths are searched breadth first through each triangle
//! once, so a few that cross odd rings are missed.

use std::collections::VecDeque;

/// Two triangles that may become a quad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Largest cosine of a corner of the quad; `None` where one of the two has no area and is taken in by the other.
    pub(super) cosine: Option<f64>,
    pub(super) triangles: [usize; 2],
    /// The quad's nodes; the triangles meet along the diagonal from the first to the third.
    pub(super) corners: [u32; 4],
}

/// The candidates of each triangle, as it has three sides.
pub(super) struct TriangleCandidates(Vec<[Option<u32>; 3]>);

impl TriangleCandidates {
    /// Lists, by triangle, of which there are `triangles`, the candidates that pass `filter`; more than three of a triangle are dropped.
    pub(super) fn new(candidates: &[Candidate], triangles: usize, filter: impl Fn(&Candidate) -> bool) -> Self {
        let mut by_triangle = vec![[None; 3]; triangles];
        for (c, candidate) in candidates.iter().enumerate().filter(|(_, c)| filter(c)) {
            for t in candidate.triangles {
                if let Some(slot) = by_triangle[t].iter_mut().find(|s| s.is_none()) {
                    *slot = Some(c as u32);
                }
            }
        }
        Self(by_triangle)
    }

    /// Returns the indices of the candidates of a triangle.
    pub(super) fn of_triangle(&self, triangle: usize) -> impl Iterator<Item = usize> + '_ {
        self.0[triangle].iter().flatten().map(|&c| c as usize)
    }
}

/// Longest path that is looked for, in pairs.
const MAX_PATH: u32 = 200;

/// A matching of triangles under augmentation.
struct Matching<'c> {
    candidates: &'c [Candidate],
    /// The candidates of each triangle.
    by_triangle: TriangleCandidates,
    /// The candidate that a triangle is paired by.
    pair: Vec<Option<usize>>,
    /// Triangles whose pair stays: one of the two has no area.
    fixed: Vec<bool>,
    /// Which search has reached a triangle last.
    reached: Vec<Option<usize>>,
    /// By which candidate, and from which triangle, the search came to the pair that a triangle belongs to.
    via: Vec<(usize, usize)>,
}

/// Returns the indices of pairs, ascending, after all exchanges that `chosen` allows; pairs that take in a triangle without area stay.
pub(super) fn augment(candidates: &[Candidate], triangles: usize, chosen: &[usize]) -> Vec<usize> {
    // Triangles that swallow one without area cannot give it up for another.
    let mut matching = Matching {
        candidates,
        by_triangle: TriangleCandidates::new(candidates, triangles, |c| c.cosine.is_some()),
        pair: vec![None; triangles],
        fixed: vec![false; triangles],
        reached: vec![None; triangles],
        via: vec![(0, 0); triangles],
    };
    for &c in chosen {
        for t in candidates[c].triangles {
            matching.pair[t] = Some(c);
            matching.fixed[t] = candidates[c].cosine.is_none();
        }
    }
    // By Berge's theorem a matching is largest when no path leads from one free triangle to another by turns over free and chosen pairs.
    for start in 0..triangles {
        if matching.pair[start].is_none()
            && let Some((triangle, last)) = matching.path_from(start)
        {
            matching.exchange(start, triangle, last);
        }
    }
    let mut out: Vec<usize> = matching.pair.iter().flatten().copied().collect();
    out.sort_unstable();
    out.dedup();
    out
}

impl Matching<'_> {
    /// Returns the triangle of candidate `c` that is not `t`.
    fn other(&self, c: usize, t: usize) -> usize {
        let [i, j] = self.candidates[c].triangles;
        if i == t { j } else { i }
    }

    /// Searches breadth first, from a triangle without a mate, a path of at most [`MAX_PATH`] made pairs to another one. Returns the last
    /// triangle but one, and the candidate that leads from it to the end; `None` where none is found, though one across an odd ring may
    /// exist. Leaves the way in `via`, which the next search overwrites.
    fn path_from(&mut self, start: usize) -> Option<(usize, usize)> {
        let mut queue = VecDeque::from([(start, 0)]);
        // A mark that no other search leaves, because each start searches once.
        self.reached[start] = Some(start);
        while let Some((t, depth)) = queue.pop_front() {
            let open: Vec<usize> = self.by_triangle.of_triangle(t).collect();
            // Along a free candidate first, back along the chosen pair then: such a path has one free pair more
            // than chosen ones.
            for c in open {
                let a = self.other(c, t);
                // Marked by the start, so that nothing has to be cleared between searches.
                if self.fixed[a] || self.reached[a] == Some(start) {
                    continue;
                }
                self.reached[a] = Some(start);
                match self.pair[a] {
                    None => return Some((t, c)),
                    Some(p) if depth < MAX_PATH => {
                        let b = self.other(p, a);
                        if self.reached[b] != Some(start) {
                            self.reached[b] = Some(start);
                            self.via[b] = (c, t);
                            queue.push_back((b, depth + 1));
                        }
                    }
                    Some(_) => {}
                }
            }
        }
        None
    }

    /// Exchanges pairs along the path that `path_from(start)` has found, back from its last but one triangle `t` and candidate `c`.
    fn exchange(&mut self, start: usize, mut t: usize, mut c: usize) {
        loop {
            for end in self.candidates[c].triangles {
                self.pair[end] = Some(c);
            }
            if t == start {
                return;
            }
            (c, t) = self.via[t];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_of_six_is_paired_wholly() {
        // 0-1-2-3-4-5 with 1-2 and 3-4 made first: both ends are alone until all pairs move by one.
        let candidate = |i| Candidate { cosine: Some(0.1), triangles: [i, i + 1], corners: [0; 4] };
        let candidates: Vec<Candidate> = (0..5).map(candidate).collect();
        assert_eq!(augment(&candidates, 6, &[1, 3]), vec![0, 2, 4]);
    }
}

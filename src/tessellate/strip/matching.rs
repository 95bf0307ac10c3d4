//! Leaves fewer triangles without a mate: along a path of triangles in which every second pair is made already, the other pairs are
//! made instead, and both ends of the path find one.
//!
//! Source: C. Berge, *Two theorems in graph theory*, PNAS 43 (1957). Paths are searched breadth first through each triangle
//! once, so a few that cross odd rings are missed.

use super::pair::Candidate;
use std::collections::VecDeque;

/// Longest path that is looked for, in pairs.
const REACH: u32 = 200;

/// The pairs after all such exchanges; pairs that take in a triangle without area stay.
pub(in crate::tessellate) fn augment(candidates: &[Candidate], triangles: usize, chosen: &[usize]) -> Vec<usize> {
    let mut of: Vec<[u32; 3]> = vec![[u32::MAX; 3]; triangles];
    let mut pair: Vec<Option<u32>> = vec![None; triangles];
    for (c, &(score, i, j, _)) in candidates.iter().enumerate().filter(|(_, c)| c.0 >= 0.0) {
        debug_assert!(score >= 0.0);
        for t in [i, j] {
            if let Some(slot) = of[t].iter_mut().find(|s| **s == u32::MAX) {
                *slot = c as u32;
            }
        }
    }
    let mut fixed = vec![false; triangles];
    for &c in chosen {
        let (score, i, j, _) = candidates[c];
        (pair[i], pair[j]) = (Some(c as u32), Some(c as u32));
        (fixed[i], fixed[j]) = (score < 0.0, score < 0.0);
    }
    let other = |c: u32, t: usize| {
        let (_, i, j, _) = candidates[c as usize];
        if i == t { j } else { i }
    };
    // Which search has seen a triangle; by which candidate it was reached from its pair's other triangle's side.
    let mut seen = vec![u32::MAX; triangles];
    let mut via: Vec<(u32, u32)> = vec![(0, 0); triangles];
    for start in 0..triangles {
        if pair[start].is_some() {
            continue;
        }
        let search = start as u32;
        let mut queue = VecDeque::from([(start, 0)]);
        seen[start] = search;
        while let Some((t, depth)) = queue.pop_front() {
            let mut found = None;
            for &c in of[t].iter().filter(|&&c| c != u32::MAX) {
                let a = other(c, t);
                if fixed[a] || seen[a] == search {
                    continue;
                }
                seen[a] = search;
                match pair[a] {
                    None => {
                        found = Some(c);
                        break;
                    }
                    Some(p) if depth < REACH => {
                        let b = other(p, a);
                        if seen[b] != search {
                            seen[b] = search;
                            via[b] = (c, t as u32);
                            queue.push_back((b, depth + 1));
                        }
                    }
                    Some(_) => {}
                }
            }
            let Some(mut c) = found else { continue };
            let mut t = t;
            loop {
                let (_, i, j, _) = candidates[c as usize];
                (pair[i], pair[j]) = (Some(c), Some(c));
                if t == start {
                    break;
                }
                let (by, from) = via[t];
                (c, t) = (by, from as usize);
            }
            break;
        }
    }
    let mut out: Vec<usize> = pair.iter().flatten().map(|&c| c as usize).collect();
    out.sort_unstable();
    out.dedup();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_of_six_is_paired_wholly() {
        // 0-1-2-3-4-5 with 1-2 and 3-4 made first: both ends are alone until all pairs move by one.
        let candidates: Vec<Candidate> = (0..5).map(|i| (0.1, i, i + 1, [0; 4])).collect();
        assert_eq!(augment(&candidates, 6, &[1, 3]), vec![0, 2, 4]);
    }
}

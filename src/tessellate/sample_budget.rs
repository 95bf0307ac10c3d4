//! Which facets are sampled, where all of a model would take too long.
//!
//! A facet takes some 250 evaluations of its spline, one of a wild surface ten times as many. A first look at some facets of each face
//! tells what one of them takes. If all together take more than [`MOST_WORK`], faces share it: none gets more than a common limit, and of
//! the facets of a face that takes more, those without proof come first and the others are spread evenly. Work is counted, not timed, so
//! that the outcome is the same on any machine.

use super::sample::{Sampled, sample_facets};
use super::tessellation::FacetQuality;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::nurbs::Surface;
use std::ops::Range;

/// Work for one model, in control points that are visited: some fifteen seconds of one core, half a million bicubic facets.
const MOST_WORK: f64 = 5e9;
/// What an evaluation takes besides its control points, in as many of them: spans and basis functions.
const BESIDES: f64 = 20.0;
/// Facets of a face in the first look.
const FIRST_LOOK: usize = 64;

/// The facets of a face, and what they take.
struct FaceWork {
    facets: Range<usize>,
    /// For one facet, on the mean.
    each: f64,
}

impl FaceWork {
    /// The work of all facets.
    fn sum(&self) -> f64 {
        self.each * self.facets.len() as f64
    }
}

/// Samples the facets of a mesh, `None` for those that are left out; `quality` says which are proved.
pub(super) fn sample_within_budget(
    mesh: &FacetMesh,
    model: &Model,
    quality: &[FacetQuality],
) -> Vec<Option<Sampled>> {
    let mut out: Vec<Option<Sampled>> = vec![None; mesh.facets.len()];
    // Facets stand in the order of their faces.
    let ranges: Vec<Range<usize>> = (mesh.facets.chunk_by(|a, b| a.face == b.face))
        .scan(0, |end, facets| {
            let start = std::mem::replace(end, *end + facets.len());
            Some(start..*end)
        })
        .collect();
    let first: Vec<usize> = ranges.iter().flat_map(|r| spread(r.clone().collect(), FIRST_LOOK)).collect();
    fill(&mut out, mesh, model, first);
    let visited: Vec<f64> =
        model.placed_faces().map(|f| f.face.map_or(0.0, |face| points_visited(&face.surface))).collect();
    let work = |facets: Range<usize>| {
        let looked: Vec<u64> = out[facets.clone()].iter().flatten().map(|s| s.evaluations).collect();
        let evaluations = looked.iter().sum::<u64>() as f64 / looked.len() as f64;
        let face = mesh.facets[facets.start].face.index();
        FaceWork { facets, each: evaluations * visited[face] }
    };
    let faces: Vec<FaceWork> = ranges.into_iter().map(work).collect();
    let limit = common_limit(faces.iter().map(FaceWork::sum).collect(), MOST_WORK);
    let chosen = faces.iter().flat_map(|face| {
        let left: Vec<usize> = face.facets.clone().filter(|&f| out[f].is_none()).collect();
        let count = if face.sum() <= limit { left.len() } else { (limit / face.each) as usize };
        let (proved, open): (Vec<usize>, Vec<usize>) = left.into_iter().partition(|&f| quality[f].certified);
        let mut chosen = spread(open, count);
        let rest = count - chosen.len();
        chosen.extend(spread(proved, rest));
        chosen
    });
    let chosen: Vec<usize> = chosen.collect();
    fill(&mut out, mesh, model, chosen);
    out
}

/// Samples these facets into their places.
fn fill(out: &mut [Option<Sampled>], mesh: &FacetMesh, model: &Model, facets: Vec<usize>) {
    let made = sample_facets(mesh, model, &facets);
    facets.into_iter().zip(made).for_each(|(facet, sampled)| out[facet] = Some(sampled));
}

/// Returns `count` of the facets, evenly spread over them; all where there are no more.
fn spread(facets: Vec<usize>, count: usize) -> Vec<usize> {
    let n = facets.len();
    if n <= count { facets } else { (0..count).map(|k| facets[k * n / count]).collect() }
}

/// Returns what one evaluation of a surface takes, in control points.
fn points_visited(surface: &Surface) -> f64 {
    let [p, q] = surface.degree;
    BESIDES + ((p + 1) * (q + 1)) as f64
}

/// Returns the limit to which shares are cut so that they add up to `most`; infinite where they do not exceed it.
fn common_limit(mut shares: Vec<f64>, most: f64) -> f64 {
    shares.sort_by(f64::total_cmp);
    let mut left = most;
    for (k, &share) in shares.iter().enumerate() {
        // What smaller ones leave of their parts goes to the larger.
        let part = left / (shares.len() - k) as f64;
        if share > part {
            return part;
        }
        left -= share;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_cuts_the_largest_shares_only() {
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 14.0), f64::INFINITY);
        // 1 + 3 + 5, and 1 + 2 + 2.
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 9.0), 5.0);
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 5.0), 2.0);
    }

    #[test]
    fn facets_are_spread_evenly() {
        assert_eq!(spread((10..20).collect(), 5), [10, 12, 14, 16, 18]);
        assert_eq!(spread((10..12).collect(), 5), [10, 11]);
        assert!(spread((10..12).collect(), 0).is_empty());
    }
}

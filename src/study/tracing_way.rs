//! Ways to trace a run between facets of the default tolerance and the spline, and which of them counted work foretells to be cheaper than
//! the spline.

use super::counted_work::{FACET, FACET_HIT, MOVED_HIT, SPLINE_HIT, longer_on};
use crate::intersect::NormalMode;

/// The error of interpolated normals and places falls with the tolerance at first order or faster; so much finer to be sure.
const MARGIN: f64 = 1.5;
/// Finer facets are tried up to this many times the error allowed: beyond it they are too many for their work to be foretold.
const MOST_FINER: f64 = 50.0;

/// Intersector and normals of a run on facets, of one whose facet hits are moved to the spline, and of one on the spline.
pub(super) const ON_FACETS: (&str, NormalMode) = ("octree", NormalMode::Bilinear);
const MOVED: (&str, NormalMode) = ("octree", NormalMode::Exact);
pub(super) const ON_SPLINE: (&str, NormalMode) = ("exact", NormalMode::Exact);

/// A way to trace the run between facets of the default tolerance and the spline.
#[derive(Clone, Copy, Debug)]
pub(super) enum Way {
    /// Facets so many times finer.
    Finer(f64),
    /// Hits on the facets moved to the spline.
    Moved,
}

impl Way {
    /// Returns intersector and normals.
    pub(super) fn traced_with(self) -> (&'static str, NormalMode) {
        match self {
            Self::Finer(_) => ON_FACETS,
            Self::Moved => MOVED,
        }
    }

    /// Says why it is taken; what facets of the default tolerance get wrong comes after it.
    pub(super) fn reason(self) -> &'static str {
        match self {
            Self::Finer(_) => "at the default tolerance facets are too coarse",
            Self::Moved => {
                "facets change the answer by more than its statistical error until their hits are moved to the spline"
            }
        }
    }
}

/// Returns the ways that counted work foretells to be cheaper than the spline, the cheapest first. `excess` is by how many standard errors
/// the `facets` of the default tolerance change the worst figure, `hits` are those of the whole run.
pub(super) fn ways_before_spline(excess: f64, facets: usize, hits: f64) -> Vec<Way> {
    let factor = MARGIN * excess;
    // The number of facets goes with the inverse of the tolerance.
    let finer = factor * facets as f64 * FACET + hits * FACET_HIT * longer_on(factor);
    // Only a trial shows for how many moved hits the spline must be queried.
    let mut ways = vec![(Way::Moved, hits * MOVED_HIT)];
    if factor <= MOST_FINER {
        ways.push((Way::Finer(factor), finer));
    }
    ways.retain(|(_, work)| *work < hits * SPLINE_HIT);
    ways.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    ways.into_iter().map(|(way, _)| way).collect()
}

/// Says why moved hits are not taken however little they get wrong; `None` where they may be. `lost` is the light lost by them and by the
/// spline, `asked` the share of hits for which the spline was queried.
pub(super) fn unfit_moved_hits(lost: [f64; 2], asked: f64) -> Option<&'static str> {
    if lost[0] > lost[1] {
        Some("hits moved to the spline lose more light than it")
    } else if MOVED_HIT + asked * SPLINE_HIT >= SPLINE_HIT {
        Some("moving hits would query the spline so often that by counted work it is no cheaper")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_hits_that_lose_more_light_or_ask_too_often_are_unfit() {
        assert_eq!(unfit_moved_hits([0.01, 0.01], 0.1), None);
        assert!(unfit_moved_hits([0.02, 0.01], 0.1).unwrap().contains("lose more light"));
        // Asked about every other hit: 500 ns and half of 850 ns for 850 ns.
        assert!(unfit_moved_hits([0.01, 0.01], 0.5).unwrap().contains("no cheaper"));
    }

    #[test]
    fn finer_facets_are_tried_where_their_work_pays() {
        let finer = |excess: f64, facets: usize, hits: f64| {
            ways_before_spline(excess, facets, hits).iter().any(|way| matches!(way, Way::Finer(_)))
        };
        // Three times as many facets, 45 ms of work, for ten million hits; for ten thousand; and 150 times as many.
        assert!(finer(2.0, 1000, 1e7));
        assert!(!finer(2.0, 1000, 1e4));
        assert!(!finer(100.0, 1000, 1e12));
    }
}

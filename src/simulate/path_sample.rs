//! The recorded paths of a run: all that were asked for, or, where these are so long that they would fill the memory, those of fewer rays.

use super::outcome::PathVertex;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// Most vertices that are kept, 38 MB: 2,000 paths of 262 hits. In milk, or between mirrors, each may have twenty thousand.
const MOST_VERTICES: usize = 1 << 19;

/// Vertices of recorded paths.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathSample {
    vertices: Vec<PathVertex>,
    /// Only rays whose index has none of these bits are kept.
    mask: u64,
    /// Whether all are kept, however many.
    is_whole: bool,
}

impl PathSample {
    /// Makes an empty sample that keeps whatever comes.
    pub(crate) fn whole() -> Self {
        Self { is_whole: true, ..Self::default() }
    }

    /// Makes a sample of these vertices, of which those of other rays than every `mask + 1`-th were left out before.
    pub(crate) fn new(vertices: Vec<PathVertex>, mask: u64) -> Self {
        Self { vertices, mask, is_whole: false }
    }

    /// Returns the bits that the index of a kept ray has not: 0, or one less than a power of two.
    pub(crate) fn mask(&self) -> u64 {
        self.mask
    }

    /// Moves vertices of whole paths into the sample, as far as it keeps them.
    pub(crate) fn append(&mut self, vertices: &mut Vec<PathVertex>) {
        let mask = self.mask;
        self.vertices.extend(vertices.drain(..).filter(|v| v.ray & mask == 0));
        self.thin();
    }

    /// Adds the sample of other rays of the same run.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.mask |= other.mask;
        self.vertices.extend_from_slice(&other.vertices);
        let mask = self.mask;
        self.vertices.retain(|v| v.ray & mask == 0);
        self.thin();
    }

    /// Keeps every second ray, or every fourth …, until there is room. Which rays are left then hangs on what all of them need, and not on
    /// the order in which they came: shards keep at least as many of theirs as the run that they come together to.
    fn thin(&mut self) {
        while self.vertices.len() > MOST_VERTICES && self.mask != u64::MAX && !self.is_whole {
            let mask = 2 * self.mask + 1;
            self.mask = mask;
            self.vertices.retain(|v| v.ray & mask == 0);
        }
    }

    /// Drops the vertices of rays that are not `wanted`.
    pub(crate) fn retain(&mut self, wanted: impl Fn(u64) -> bool) {
        self.vertices.retain(|v| wanted(v.ray));
    }

    /// Sorts by ray, branch, bounce and event.
    pub(crate) fn sort(&mut self) {
        self.vertices.sort_by_key(|v| (v.ray, v.branch, v.bounce, v.event));
    }

    /// Returns the vertices.
    pub(crate) fn into_vertices(self) -> Vec<PathVertex> {
        self.vertices
    }
}

impl Deref for PathSample {
    type Target = [PathVertex];

    fn deref(&self) -> &[PathVertex] {
        &self.vertices
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Point;
    use crate::simulate::outcome::Event;

    /// A path of so many vertices.
    fn path(ray: u64, vertices: u32) -> Vec<PathVertex> {
        let vertex = |bounce| PathVertex {
            ray,
            branch: 0,
            bounce,
            point: Point::ZERO,
            power: 1.0,
            event: Event::Scattered,
            face: None,
            body: 0,
        };
        (0..vertices).map(vertex).collect()
    }

    /// A sample of so long paths of these rays, added in this order.
    fn sample(rays: impl IntoIterator<Item = u64>, vertices: u32) -> PathSample {
        let mut sample = PathSample::default();
        rays.into_iter().for_each(|ray| sample.append(&mut path(ray, vertices)));
        sample.sort();
        sample
    }

    #[test]
    fn long_paths_are_thinned_to_the_same_rays_in_any_order_and_shards() {
        let long = (MOST_VERTICES / 8) as u32;
        // Of 32 rays every fourth leaves eight, which just fit.
        let once = sample(0..32, long);
        assert_eq!((once.mask(), once.len()), (3, MOST_VERTICES));
        assert!(once.iter().all(|v| v.ray % 4 == 0));
        assert!(once == sample((0..32).rev(), long));
        for parts in [[0..7, 7..32], [0..32, 32..32], [0..16, 16..32]] {
            let [mut a, b] = parts.map(|rays| sample(rays, long));
            a.merge(&b);
            a.sort();
            assert!(a == once);
        }
    }

    #[test]
    fn short_paths_and_paths_that_were_asked_for_are_all_kept() {
        assert_eq!(sample(0..1000, 60).len(), 60_000);
        let mut whole = PathSample::whole();
        whole.append(&mut path(5, MOST_VERTICES as u32 + 1));
        assert_eq!(whole.len(), MOST_VERTICES + 1);
    }
}

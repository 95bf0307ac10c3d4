//! How many places of a node the cells in another take, so that the boxes of nodes have the least area together.
//!
//! Rays meet a box about as often as its area says, so that these are the fewest nodes on their ways. Source: Ylitie, Karras, Laine, HPG
//! 2017, section 3.1, for blocks that are given.

use super::node::CHILDREN;

/// The least area of nodes that a cell can be made of, halved, mm², by how many places of the node above it takes: the first is of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeAreas([f32; CHILDREN]);

impl NodeAreas {
    /// Of a block, which no node is made of.
    pub(super) const BLOCK: Self = Self([0.0; CHILDREN]);

    /// Of a cell with others in it, from two to sixteen, and half the area `own` of its box.
    pub(super) fn of_cells<'a>(cells: impl Iterator<Item = &'a Self>, own: f32) -> Self {
        let open = cells.fold(None, Self::sum).unwrap_or(Self::BLOCK);
        // Never nothing, so that of boxes without area too the fewest are taken.
        let closed = own.max(f32::MIN_POSITIVE) + open.0[CHILDREN - 1];
        Self(open.0.map(|area| area.min(closed)))
    }

    /// Whether a cell that takes so many places is better opened than a node of its own, which takes one.
    pub(super) fn is_opened(&self, places: usize) -> bool {
        self.0[places - 1] < self.0[0]
    }

    /// Of cells side by side, those before, if any, and one more.
    fn sum(before: Option<Self>, next: &Self) -> Option<Self> {
        let Some(Self(before)) = before else { return Some(*next) };
        // A block, as most are, takes one place.
        if *next == Self::BLOCK {
            return Some(Self(std::array::from_fn(|k| if k == 0 { f32::INFINITY } else { before[k - 1] })));
        }
        let mut sum = [f32::INFINITY; CHILDREN];
        for (k, mine) in before.iter().enumerate() {
            for (least, theirs) in sum.iter_mut().skip(k + 1).zip(&next.0) {
                let area = mine + theirs;
                *least = if area < *least { area } else { *least };
            }
        }
        Some(Self(sum))
    }
}

/// How many of so many places each cell takes, at least one, for the least area of all.
pub(super) fn shares(cells: &[NodeAreas], places: usize) -> Vec<usize> {
    let sums: Vec<Option<NodeAreas>> = (cells.iter())
        .scan(None, |sum, next| {
            *sum = NodeAreas::sum(*sum, next);
            Some(*sum)
        })
        .collect();
    let mut shares = vec![1; cells.len()];
    let mut left = places;
    for (k, pair) in sums.windows(2).enumerate().rev() {
        let [Some(before), Some(all)] = pair else { continue };
        // Each of the k + 1 before needs one.
        let reaches = |share: &usize| before.0[left - share - 1] + cells[k + 1].0[share - 1] <= all.0[left - 1];
        shares[k + 1] = (1..left - k).find(reaches).unwrap_or(1);
        left -= shares[k + 1];
    }
    if let Some(first) = shares.first_mut() {
        *first = left;
    }
    shares
}

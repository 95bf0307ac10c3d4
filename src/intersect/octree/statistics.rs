//! The shape of a tree, for people.

use std::fmt;

/// Counts over a tree.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Inner nodes.
    pub nodes: usize,
    /// Blocks of up to four facets.
    pub blocks: usize,
    /// Facets in blocks; more than the mesh has, since facets are listed in every cell they meet.
    pub references: usize,
    /// Facets left out because a corner is not finite or beyond 1e12 mm.
    pub left_out: usize,
    /// Blocks by their depth in nodes.
    pub depths: Vec<usize>,
    /// Blocks by their number of facets, from one to four.
    pub fill: [usize; 4],
}

impl Statistics {
    /// Counts a block of one to four facets under `depth` nodes, in all fields but `nodes` and `left_out`.
    pub(super) fn count_block(&mut self, depth: u32, facets: u8) {
        let depth = depth as usize;
        if self.depths.len() <= depth {
            self.depths.resize(depth + 1, 0);
        }
        self.depths[depth] += 1;
        self.blocks += 1;
        self.references += usize::from(facets);
        self.fill[usize::from(facets.clamp(1, 4)) - 1] += 1;
    }

    /// Adds the counts of another part of the tree, depth by depth, but not the facets left out.
    pub(super) fn add(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.blocks += other.blocks;
        self.references += other.references;
        if self.depths.len() < other.depths.len() {
            self.depths.resize(other.depths.len(), 0);
        }
        for (mine, theirs) in self.depths.iter_mut().zip(&other.depths) {
            *mine += theirs;
        }
        for (mine, theirs) in self.fill.iter_mut().zip(&other.fill) {
            *mine += theirs;
        }
    }

    /// Levels of nodes above the deepest block; 0 for an empty tree and for one block alone.
    pub fn depth(&self) -> usize {
        self.depths.len().saturating_sub(1)
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "nodes {}, blocks {}, facets listed {}", self.nodes, self.blocks, self.references)?;
        writeln!(f, "blocks of 1, 2, 3, 4 facets: {:?}", self.fill)?;
        if self.left_out > 0 {
            writeln!(f, "facets left out: {}", self.left_out)?;
        }
        // At least one, so that an empty tree draws no bars.
        let most = self.depths.iter().fold(1, |most, &count| most.max(count));
        for (depth, &count) in self.depths.iter().enumerate().filter(|(_, c)| **c > 0) {
            writeln!(f, "depth {depth:2} {count:9} {}", "#".repeat((count * 50).div_ceil(most)))?;
        }
        Ok(())
    }
}

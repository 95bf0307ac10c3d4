//! Lists of a trim's pieces by the row or cell of its grid that they are near.

/// Pieces by what they are near, a row or a cell, one list behind the other: of a thousand small faces hash tables took a fifth of all.
#[derive(Debug, Default)]
pub(super) struct PieceLists {
    /// Rows or cells that have pieces, rising.
    pub(super) keys: Vec<u32>,
    /// Where the list of each begins, and the end of the last.
    starts: Vec<u32>,
    pieces: Vec<u32>,
}

impl PieceLists {
    /// Sorts pairs of a row or cell and a piece, some of which may be there more than once.
    pub(super) fn new(mut pairs: Vec<(u32, u32)>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let mut lists = Self { pieces: pairs.iter().map(|&(_, piece)| piece).collect(), ..Self::default() };
        let runs = pairs.chunk_by(|a, b| a.0 == b.0);
        let count = runs.clone().count();
        (lists.keys, lists.starts) = (Vec::with_capacity(count), Vec::with_capacity(count + 1));
        lists.starts.push(0);
        let mut end = 0;
        for run in runs {
            end += run.len() as u32;
            lists.keys.push(run[0].0);
            lists.starts.push(end);
        }
        lists
    }

    /// Bytes that the lists hold.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.keys) + size_of_val(&*self.starts) + size_of_val(&*self.pieces)
    }

    /// The pieces of a row or cell, rising; empty where it has none.
    #[inline]
    pub(super) fn pieces_of(&self, key: u32) -> &[u32] {
        match self.keys.binary_search(&key) {
            Ok(k) => &self.pieces[self.starts[k] as usize..self.starts[k + 1] as usize],
            Err(_) => &[],
        }
    }
}

//! A hash of the sums and counts behind the figures of a run, as a fingerprint of a result.

use super::tallies::Tallies;
use super::tally::Sum;

/// FNV-1a with 128 bits (Fowler, Noll, Vo): not meant against forgery, only to show that two results are the same.
pub(crate) struct Fnv(u128);

impl Fnv {
    const START: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;

    /// Returns the hash of these pieces in order; where one ends and the next begins counts.
    pub(crate) fn hash(pieces: &[&[u8]]) -> u128 {
        let mut h = Self::new();
        pieces.iter().for_each(|piece| h.absorb_piece(piece));
        h.0
    }

    /// Begins a hash that has absorbed nothing.
    pub(super) fn new() -> Self {
        Self(Self::START)
    }

    /// Absorbs the length of a piece and then the piece.
    pub(super) fn absorb_piece(&mut self, piece: &[u8]) {
        self.begin_piece(piece.len() as u64);
        self.absorb(piece);
    }

    /// Absorbs the length of a piece that follows in parts: with it two pieces cannot be divided otherwise and hash alike.
    pub(super) fn begin_piece(&mut self, length: u64) {
        self.absorb(&length.to_le_bytes());
    }

    /// The hash of all that was absorbed.
    pub(super) fn finish(self) -> u128 {
        self.0
    }

    /// Absorbs bytes without their number: two calls hash like one with both.
    pub(super) fn absorb(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.0 = (self.0 ^ u128::from(b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013B);
        }
    }

    /// Hashes the number of sums and, with its index, each that is not zero.
    fn absorb_sums(&mut self, sums: &[Sum]) {
        self.absorb(&(sums.len() as u64).to_le_bytes());
        // Most cells are empty; the indices of the others imply them.
        for (i, s) in sums.iter().enumerate().filter(|(_, s)| **s != Sum::default()) {
            self.absorb(&(i as u64).to_le_bytes());
            self.absorb(&s.total.to_le_bytes());
            self.absorb(&s.squares.to_le_bytes());
        }
    }
}

/// Hashes the sums of receivers, faces, media and ends with their spreads, and the counts of rays, segments, corrected normals, losses and
/// cuts, to 32 hexadecimal digits. What passes faces, lost rays, paths, sequences and other counts have no part in it; what instances
/// absorbed is a sum of faces, and needs none.
pub(crate) fn digest(t: &Tallies) -> String {
    let mut h = Fnv::new();
    t.cells.iter().for_each(|c| h.absorb_sums(c));
    h.absorb_sums(&t.receivers);
    h.absorb_sums(&t.faces);
    h.absorb_sums(&t.bulk);
    h.absorb_sums(&t.ends);
    for m in &t.moments {
        m.first.iter().for_each(|x| h.absorb(&x.to_le_bytes()));
        m.second.iter().for_each(|x| h.absorb(&x.to_le_bytes()));
        h.absorb(&m.farthest.to_le_bytes());
    }
    t.spreads.iter().flat_map(|s| s.products.iter().flatten()).for_each(|x| h.absorb(&x.to_le_bytes()));
    t.channels.iter().for_each(|c| h.absorb_sums(c));
    let c = &t.counts;
    [c.rays, c.segments, c.corrected_normals, c.lost, c.cut_off].iter().for_each(|x| h.absorb(&x.to_le_bytes()));
    format!("{:032x}", h.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Published test vector of the 128-bit variant.
        let mut h = Fnv::new();
        h.absorb(b"a");
        assert_eq!(h.finish(), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }

    #[test]
    fn every_tally_counts() {
        let base = Tallies { faces: vec![Sum::default(); 3], ..Tallies::default() };
        let mut other = base.clone();
        other.faces[1].add_replicate(1);
        assert_ne!(digest(&base), digest(&other));
        other = base.clone();
        other.counts.segments = 1;
        assert_ne!(digest(&base), digest(&other));
    }
}

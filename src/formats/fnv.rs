//! A hash that tells whether two things are the same.

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
    pub(crate) fn new() -> Self {
        Self(Self::START)
    }

    /// Absorbs the length of a piece and then the piece.
    pub(crate) fn absorb_piece(&mut self, piece: &[u8]) {
        self.begin_piece(piece.len() as u64);
        self.absorb(piece);
    }

    /// Absorbs the length of a piece that follows in parts: with it two pieces cannot be divided otherwise and hash alike.
    pub(crate) fn begin_piece(&mut self, length: u64) {
        self.absorb(&length.to_le_bytes());
    }

    /// The hash of all that was absorbed.
    pub(crate) fn finish(self) -> u128 {
        self.0
    }

    /// Absorbs bytes that no length tells from those that follow.
    pub(crate) fn absorb(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.0 = (self.0 ^ u128::from(b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013B);
        }
    }
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
}

//! A hash of whatever decides the bits of a run: parts with the same one belong together.

use super::digest::Fnv;
use std::io::{self, Read};

/// A hash of whatever decides the bits of a run, as 32 hexadecimal digits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fingerprint(pub String);

impl Fingerprint {
    /// Hashes these pieces in this order; where one ends and the next begins counts.
    pub fn new(pieces: &[&[u8]]) -> Self {
        Self(format!("{:032x}", Fnv::hash(pieces)))
    }
}

/// A fingerprint in the making, of pieces that need not be in memory together.
pub struct FingerprintHasher(Fnv);

impl Default for FingerprintHasher {
    fn default() -> Self {
        Self(Fnv::new())
    }
}

impl FingerprintHasher {
    /// Adds a piece.
    pub fn add(&mut self, piece: &[u8]) {
        self.0.absorb_piece(piece);
    }

    /// Adds a piece of this length that is read block by block: the same as one that is in memory.
    ///
    /// # Errors
    /// When it cannot be read, or ends before this length.
    pub fn add_read(&mut self, length: u64, from: &mut dyn Read) -> io::Result<()> {
        self.0.begin_piece(length);
        let mut block = vec![0; READ_BLOCK];
        let mut left = length;
        while left > 0 {
            let part = &mut block[..left.min(READ_BLOCK as u64) as usize];
            from.read_exact(part)?;
            self.0.absorb(part);
            left -= part.len() as u64;
        }
        Ok(())
    }

    /// The fingerprint of all pieces, in the order in which they were added.
    pub fn finish(self) -> Fingerprint {
        Fingerprint(format!("{:032x}", self.0.finish()))
    }
}

/// Bytes of a file that are hashed at a time: ray files have gigabytes.
const READ_BLOCK: usize = 1 << 16;

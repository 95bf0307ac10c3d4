//! A checksum as fast as the second cache is read: entries of the cache are hundreds of megabytes, and every shard of a run reads them.
//!
//! Source: Fletcher, *An arithmetic checksum for serial transmissions*, 1982, here of eight lanes of 64-bit words.
//!
//! Guarantee: damage within 64 bytes, and bytes that are missing, are always noticed; other damage but for one in 2⁶⁴. Known weakness: it
//! is no protection against who wants to deceive.

use crate::math::simd::{self, Instructions, Kernel};
use crate::simulate::Fingerprint;

/// Words that are added at once.
const LANES: usize = 8;
/// Bytes of a block, a word for each lane.
const BLOCK: usize = 8 * LANES;

/// The checksum of bytes that come piece by piece.
#[derive(Clone, Debug)]
pub(super) struct Checksum {
    /// Of each lane the sum of its words, and the sum of these sums.
    sums: [[u64; LANES]; 2],
    /// The bytes behind the last whole block, zeros behind them, and how many bytes came in all.
    rest: [u8; BLOCK],
    length: u64,
}

impl Checksum {
    /// Characters of a finished checksum.
    pub(super) const CHARACTERS: usize = 32;

    pub(super) fn new() -> Self {
        Self { sums: [[0; LANES]; 2], rest: [0; BLOCK], length: 0 }
    }

    /// Takes further bytes; where one piece ends and the next begins does not count.
    pub(super) fn add(&mut self, mut bytes: &[u8]) {
        let filled = self.length as usize % BLOCK;
        self.length += bytes.len() as u64;
        if filled > 0 {
            let (head, tail) = bytes.split_at(bytes.len().min(BLOCK - filled));
            self.rest[filled..filled + head.len()].copy_from_slice(head);
            bytes = tail;
            if filled + head.len() < BLOCK {
                return;
            }
            let block = std::mem::replace(&mut self.rest, [0; BLOCK]);
            simd::dispatch(Blocks { sums: &mut self.sums, blocks: &[block] });
        }
        let (blocks, rest) = bytes.as_chunks::<BLOCK>();
        simd::dispatch(Blocks { sums: &mut self.sums, blocks });
        self.rest[..rest.len()].copy_from_slice(rest);
    }

    /// Returns the checksum of all bytes, [`Self::CHARACTERS`] hexadecimal digits.
    pub(super) fn finish(mut self) -> String {
        let rest = self.rest;
        simd::dispatch(Blocks { sums: &mut self.sums, blocks: &[rest] });
        let sums: &[u8] = bytemuck::cast_slice(self.sums.as_flattened());
        Fingerprint::new(&[sums, &self.length.to_le_bytes()]).0
    }
}

/// Adds blocks to the sums.
struct Blocks<'a> {
    sums: &'a mut [[u64; LANES]; 2],
    blocks: &'a [[u8; BLOCK]],
}

impl Kernel for Blocks<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let [mut first, mut second] = *self.sums;
        for block in self.blocks {
            let (words, _) = block.as_chunks::<8>();
            for lane in 0..LANES {
                first[lane] = first[lane].wrapping_add(u64::from_ne_bytes(words[lane]));
                second[lane] = second[lane].wrapping_add(first[lane]);
            }
        }
        *self.sums = [first, second];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree;
    use crate::math::{FaceId, Point, Uv, Vector};
    use crate::mesh::{Facet, FacetMesh, MeshVertex};
    use crate::pipeline::cache::{Cache, CachedFacets};
    use crate::pipeline::monitor::Monitor;
    use std::sync::Mutex;

    /// Keeps what it is warned of.
    #[derive(Default)]
    struct Warnings(Mutex<Vec<String>>);

    impl Monitor for Warnings {
        fn warns(&self, message: &str) {
            self.0.lock().unwrap().push(message.to_owned());
        }
    }

    /// Data that is no tree is rebuilt as damaged data is, even with a correct checksum.
    #[test]
    fn an_octree_that_is_no_tree_is_built_anew_with_a_right_checksum_too() {
        let positions = vec![Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y];
        let vertices = (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
        let square = Facet { vertices: [0, 1, 2, 3], face: FaceId(0) };
        let mesh = FacetMesh { positions, vertices, facets: vec![square; 40], sag: vec![] };
        let folder = tempfile::tempdir().unwrap();
        let (cache, key, monitor) =
            (Cache::new(folder.path()), Fingerprint::new(&[b"squares"]), Warnings::default());
        let kept = CachedFacets { cache: &cache, key: &key, monitor: &monitor };
        let bytes_of = |octree: &octree::Octree| {
            let mut bytes = Vec::new();
            octree.write_arrays(&mut bytes).unwrap();
            bytes
        };
        let settings = octree::Settings::default();
        let whole = bytes_of(&kept.octree(&mesh, &settings));
        let entry = format!("{}.octree", key.0);
        let write = |bytes: &[u8]| cache.keep(&entry, &monitor, |to| to.write_all(bytes));
        // Written by hand, but as it was.
        write(&whole);
        assert_eq!(bytes_of(&kept.octree(&mesh, &settings)), whole);
        assert!(monitor.0.lock().unwrap().is_empty());
        // The number of nodes, behind the length of the first array: without nodes, though there are some.
        let mut forged = whole.clone();
        forged[8..16].fill(0);
        write(&forged);
        assert_eq!(bytes_of(&kept.octree(&mesh, &settings)), whole);
        let warnings = monitor.0.lock().unwrap().join(" ");
        assert!(warnings.contains("no octree of this mesh: built anew"), "{warnings}");
    }

    fn checksum<'p>(pieces: impl IntoIterator<Item = &'p [u8]>) -> String {
        let mut sum = Checksum::new();
        pieces.into_iter().for_each(|piece| sum.add(piece));
        sum.finish()
    }

    #[test]
    fn pieces_do_not_count_and_any_change_does() {
        let bytes: Vec<u8> = (0..1000u32).map(|k| ((k * k) >> 3) as u8).collect();
        let whole = checksum([&bytes[..]]);
        assert_eq!(whole.len(), Checksum::CHARACTERS);
        for size in [1, 7, 63, 64, 65, 130, 999] {
            assert_eq!(checksum(bytes.chunks(size)), whole, "{size}");
        }
        for place in 0..bytes.len() {
            let mut bent = bytes.clone();
            bent[place] ^= 1 << (place % 8);
            assert_ne!(checksum([&bent[..]]), whole, "{place}");
            assert_ne!(checksum([&bytes[..place]]), whole, "{place}");
        }
        // Blocks that changed places, words that did, and zeros that were lost.
        let mut turned = bytes.clone();
        turned.rotate_left(BLOCK);
        assert_ne!(checksum([&turned[..]]), whole);
        turned.copy_from_slice(&bytes);
        turned[8..24].rotate_left(8);
        assert_ne!(checksum([&turned[..]]), whole);
        assert_ne!(checksum([&[0; 100][..]]), checksum([&[0; 101][..]]));
    }
}

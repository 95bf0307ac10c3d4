//! The file of a part of a run.
//!
//! It holds a line that names it, a header of the writer's, the replicates, the sums without their empty cells, and a checksum. Whole
//! numbers are little-endian.

use super::bind::BoundScene;
use super::digest::Fnv;
use super::outcome::{Counts, LostRay, PathVertex};
use super::partial_run::PartialRun;
use super::partial_run_error::PartialRunError;
use super::path_sample::PathSample;
use super::sequence::Sequence;
use super::sequence_sums::SequenceSums;
use super::tallies::Tallies;
use super::tally::{Moments, Sum};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Write};

/// Begins a file of this version.
const MAGIC: &[u8] = b"lampyris tally 12\n";
/// Bytes of the checksum that ends it.
const CHECKSUM_BYTES: usize = 16;

impl PartialRun {
    /// Writes the file, with a header of the caller's, as one block with a checksum.
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub fn write(&self, header: &impl Serialize, to: &mut dyn Write) -> io::Result<()> {
        let mut out = Vec::from(MAGIC);
        let t = &self.tallies;
        append_block(&mut out, &serde_json::to_vec(header)?);
        out.extend(self.replicates.to_le_bytes());
        out.extend(u32::from(self.grows).to_le_bytes());
        out.extend((self.done.len() as u32).to_le_bytes());
        self.done.iter().for_each(|r| out.extend(r.to_le_bytes()));
        out.extend(self.seconds.to_le_bytes());
        out.extend((t.cells.len() as u32).to_le_bytes());
        t.cells.iter().for_each(|c| append_sums(&mut out, c));
        [&t.receivers[..], &t.faces, &t.instances, &t.bulk, &t.ends]
            .into_iter()
            .for_each(|s| append_sums(&mut out, s));
        for m in &t.moments {
            m.first.iter().for_each(|x| out.extend(x.to_le_bytes()));
            m.second.iter().for_each(|x| out.extend(x.to_le_bytes()));
            out.extend(m.farthest.to_le_bytes());
        }
        t.spreads.iter().flat_map(|s| s.products.iter().flatten()).for_each(|x| out.extend(x.to_le_bytes()));
        t.channels.iter().for_each(|c| append_sums(&mut out, c));
        [&t.entered, &t.left].into_iter().for_each(|s| append_sums(&mut out, s));
        let c = &t.counts;
        let [one, other] = c.overlapping.map(u64::from);
        let [source, face] = c.flush_place.map(u64::from);
        let ends = [c.rays, c.segments, c.corrected_normals, c.lost, c.cut_off, c.caught];
        let repairs = [c.overlaps, one, other, c.refused_contacts, c.misplaced_starts];
        let flush = [c.flush_starts, source, face];
        ends.iter().chain(&repairs).chain(&flush).for_each(|x| out.extend(x.to_le_bytes()));
        // Numbers of f64 survive as bits: text would round the last one, and has no word for NaN.
        let zero = crate::math::Point::ZERO;
        let bare = |l: &LostRay| LostRay { origin: zero, direction: zero, ..l.clone() };
        let ledger: Vec<_> =
            t.ledger.iter().map(|l| (bare(l), coordinate_bits(&[l.origin, l.direction]))).collect();
        append_block(&mut out, &serde_json::to_vec(&ledger)?);
        let bare = |v: &PathVertex| PathVertex { point: zero, power: 0.0, ..v.clone() };
        let paths: Vec<_> =
            t.paths.iter().map(|v| (bare(v), coordinate_bits(&[v.point]), v.power.to_bits())).collect();
        out.extend(t.paths.mask().to_le_bytes());
        append_block(&mut out, &serde_json::to_vec(&paths)?);
        out.extend((t.sequences.limit() as u32).to_le_bytes());
        let sequences: Vec<_> = t.sequences.held().collect();
        append_block(&mut out, &serde_json::to_vec(&sequences)?);
        to.write_all(&out)?;
        // The hash over all that stands before: a file that was cut or damaged on its way is refused, not added up.
        to.write_all(&Fnv::hash(&[&out]).to_le_bytes())
    }

    /// Reads the file for a scene, after `check` has found the header good or said why it is not.
    ///
    /// # Errors
    /// When the bytes are no such file or are damaged, `check` refuses the header, or the sums are those of another scene.
    pub fn read<H: DeserializeOwned>(
        bytes: &[u8],
        check: impl FnOnce(&H) -> Result<(), String>,
        bound: &BoundScene,
    ) -> Result<Self, PartialRunError> {
        let (header, r) = open_tally_file::<H>(bytes)?;
        check(&header).map_err(PartialRunError::RefusedHeader)?;
        r.part(Tallies::new(bound))
    }

    /// Reads the file with its header for no scene: it has as many cells, faces and bodies as it says, and other parts of the same run can
    /// be added.
    ///
    /// # Errors
    /// When the bytes are no such file or are damaged, or hold more than any scene has.
    pub fn read_alone<H: DeserializeOwned>(bytes: &[u8]) -> Result<(H, Self), PartialRunError> {
        let (header, r) = open_tally_file(bytes)?;
        let r = Reader { sums_left: Some(MOST_SUMS_ALONE), ..r };
        Ok((header, r.part(Tallies::default())?))
    }

    /// Reads the header of a file alone; the checksum of the whole file is tested.
    ///
    /// # Errors
    /// When the bytes are no such file or are damaged.
    pub fn header<H: DeserializeOwned>(bytes: &[u8]) -> Result<H, PartialRunError> {
        open_tally_file(bytes).map(|(header, _)| header)
    }

    /// Whether these bytes begin such a file and do not end it: it is still being copied, or damaged.
    pub fn is_cut_short(bytes: &[u8]) -> bool {
        MAGIC.starts_with(bytes) || (bytes.starts_with(MAGIC) && !ends_in_checksum(bytes))
    }
}

/// Returns the bits of each coordinate.
fn coordinate_bits(points: &[crate::math::Point]) -> Vec<[u64; 3]> {
    points.iter().map(|p| p.to_array().map(f64::to_bits)).collect()
}

/// Appends the number of bytes, as 64 bits, and the bytes.
fn append_block(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u64).to_le_bytes());
    out.extend(bytes);
}

/// Appends the number of sums, the number of those that are not empty, and these with their index.
fn append_sums(out: &mut Vec<u8>, sums: &[Sum]) {
    out.extend((sums.len() as u64).to_le_bytes());
    let filled = sums.iter().enumerate().filter(|(_, s)| **s != Sum::default());
    out.extend((filled.clone().count() as u64).to_le_bytes());
    for (i, s) in filled {
        out.extend((i as u32).to_le_bytes());
        out.extend(s.total.to_le_bytes());
        out.extend(s.squares.to_le_bytes());
    }
}

/// Checks magic and checksum; returns the header and a reader of what follows.
///
/// # Errors
/// When the bytes are no such file or are damaged.
fn open_tally_file<H: DeserializeOwned>(bytes: &[u8]) -> Result<(H, Reader<'_>), PartialRunError> {
    if MAGIC.starts_with(bytes) {
        return Err(PartialRunError::CutShort);
    }
    let rest = bytes.strip_prefix(MAGIC).ok_or(PartialRunError::NotTallyFile)?;
    let (rest, _) = rest.split_last_chunk::<CHECKSUM_BYTES>().ok_or(PartialRunError::CutShort)?;
    if !ends_in_checksum(bytes) {
        return Err(PartialRunError::WrongChecksum);
    }
    let mut reader = Reader { bytes: rest, sums_left: None };
    let header = reader.json()?;
    Ok((header, reader))
}

/// Whether the last bytes are the checksum of all that stand before them.
fn ends_in_checksum(bytes: &[u8]) -> bool {
    let ending = bytes.split_last_chunk::<CHECKSUM_BYTES>();
    ending.is_some_and(|(before, sum)| Fnv::hash(&[before]) == u128::from_le_bytes(*sum))
}

/// Most sums of a part that is read for no scene: twice what the receivers of one may have, 2 GB.
const MOST_SUMS_ALONE: u64 = 1 << 26;

/// What is left of a file.
struct Reader<'a> {
    bytes: &'a [u8],
    /// How many more sums there may be where the file says how many; `None` where the scene does.
    sums_left: Option<u64>,
}

impl<'a> Reader<'a> {
    /// Takes the next `n` bytes off; an error when there are fewer.
    fn take(&mut self, n: u64) -> Result<&'a [u8], PartialRunError> {
        let n = usize::try_from(n).ok().filter(|n| *n <= self.bytes.len()).ok_or(PartialRunError::CutShort)?;
        let (taken, rest) = self.bytes.split_at(n);
        self.bytes = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], PartialRunError> {
        self.take(N as u64)?.try_into().map_err(|_| PartialRunError::CutShort)
    }

    fn u32(&mut self) -> Result<u32, PartialRunError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, PartialRunError> {
        self.array().map(u64::from_le_bytes)
    }

    /// Takes a part off into sums that are empty.
    fn part(mut self, empty: Tallies) -> Result<PartialRun, PartialRunError> {
        let mut p = PartialRun { replicates: self.u32()?, tallies: empty, ..PartialRun::default() };
        p.grows = self.u32()? != 0;
        let done = self.u32()?;
        if done > p.replicates {
            return Err(PartialRunError::Inconsistent("it has more replicates than its run"));
        }
        p.done = (0..done).map(|_| self.u32()).collect::<Result<_, _>>()?;
        // In order and each once, or `merge` would count a replicate twice.
        if p.done.windows(2).any(|w| w[0] >= w[1]) || p.done.last().is_some_and(|&r| r >= p.replicates) {
            return Err(PartialRunError::Inconsistent("its replicates are out of order"));
        }
        p.seconds = f64::from_le_bytes(self.array()?);
        let t = &mut p.tallies;
        t.replicates = done;
        let receivers = u64::from(self.u32()?);
        self.lists(&mut t.cells, receivers)?;
        self.lists(&mut t.moments, receivers)?;
        self.lists(&mut t.spreads, receivers)?;
        self.lists(&mut t.channels, receivers)?;
        // Empty cells are not in the file: the sums of the scene are filled where it has something.
        for cells in &mut t.cells {
            self.sums(cells)?;
        }
        self.sums(&mut t.receivers)?;
        self.sums(&mut t.faces)?;
        self.sums(&mut t.instances)?;
        self.sums(&mut t.bulk)?;
        if self.u64()? != t.ends.len() as u64 {
            return Err(PartialRunError::Inconsistent("it has other ends of light"));
        }
        self.filled_sums(&mut t.ends)?;
        for m in &mut t.moments {
            *m = Moments {
                first: [i128::from_le_bytes(self.array()?), i128::from_le_bytes(self.array()?)],
                second: [u128::from_le_bytes(self.array()?), u128::from_le_bytes(self.array()?)],
                farthest: self.u64()?,
            };
        }
        for x in t.spreads.iter_mut().flat_map(|s| s.products.iter_mut().flatten()) {
            *x = i128::from_le_bytes(self.array()?);
        }
        for channels in &mut t.channels {
            self.sums(channels)?;
        }
        self.sums(&mut t.entered)?;
        self.sums(&mut t.left)?;
        t.counts = self.counts()?;
        let ledger: Vec<(LostRay, [[u64; 3]; 2])> = self.json()?;
        let mask = self.u64()?;
        let paths: Vec<(PathVertex, [[u64; 3]; 1], u64)> = self.json()?;
        let limit = self.u32()? as usize;
        let sequences: Vec<(Sequence, Sum)> = self.json()?;
        t.sequences = SequenceSums::restored(limit, sequences)
            .ok_or(PartialRunError::Inconsistent("its sequences have no known limit of steps"))?;
        // Bits, not decimals: what was written comes back exactly.
        let point = |bits: [u64; 3]| bits.map(f64::from_bits).into();
        t.ledger = ledger
            .into_iter()
            .map(|(l, [origin, direction])| LostRay { origin: point(origin), direction: point(direction), ..l })
            .collect();
        let vertices = paths
            .into_iter()
            .map(|(v, [place], power)| PathVertex { point: point(place), power: f64::from_bits(power), ..v })
            .collect();
        t.paths = PathSample::new(vertices, mask);
        Ok(p)
    }

    /// Reads the counts of a run, in the order in which they were written.
    fn counts(&mut self) -> Result<Counts, PartialRunError> {
        Ok(Counts {
            rays: self.u64()?,
            segments: self.u64()?,
            corrected_normals: self.u64()?,
            lost: self.u64()?,
            cut_off: self.u64()?,
            caught: self.u64()?,
            overlaps: self.u64()?,
            overlapping: [self.u64()? as u32, self.u64()? as u32],
            refused_contacts: self.u64()?,
            misplaced_starts: self.u64()?,
            flush_starts: self.u64()?,
            flush_place: [self.u64()? as u32, self.u64()? as u32],
        })
    }

    /// Takes the next block off and parses it as JSON.
    fn json<T: DeserializeOwned>(&mut self) -> Result<T, PartialRunError> {
        let n = self.u64()?;
        serde_json::from_slice(self.take(n)?).map_err(|e| PartialRunError::Malformed(e.to_string()))
    }

    /// Takes the number of lists off, which must be that of `into` where the scene says how many there are.
    fn lists<T: Clone + Default>(&mut self, into: &mut Vec<T>, count: u64) -> Result<(), PartialRunError> {
        if let Some(left) = &mut self.sums_left {
            *left =
                left.checked_sub(count).ok_or(PartialRunError::Inconsistent("it has more sums than any scene"))?;
            into.resize(count as usize, T::default());
        }
        if count != into.len() as u64 {
            return Err(PartialRunError::OtherScene);
        }
        Ok(())
    }

    /// Takes sums off and writes those that are not empty into `into`, which must have the length that the file states.
    fn sums(&mut self, into: &mut Vec<Sum>) -> Result<(), PartialRunError> {
        let count = self.u64()?;
        self.lists(into, count)?;
        self.filled_sums(into)
    }

    fn filled_sums(&mut self, into: &mut [Sum]) -> Result<(), PartialRunError> {
        for _ in 0..self.u64()? {
            let i = self.u32()? as usize;
            let sum =
                Sum { total: u128::from_le_bytes(self.array()?), squares: u128::from_le_bytes(self.array()?) };
            *into.get_mut(i).ok_or(PartialRunError::Inconsistent("a cell lies outside its receiver"))? = sum;
        }
        Ok(())
    }
}

//! A hash of the sums and counts behind the figures of a run, as a fingerprint of a result.

use super::tallies::Tallies;
use super::tally::Sum;
use crate::formats::Fnv;

/// Hashes the number of sums and, with its index, each that is not zero.
fn absorb_sums(h: &mut Fnv, sums: &[Sum]) {
    h.absorb(&(sums.len() as u64).to_le_bytes());
    // Empty cells are most, and are told by the indices of the others.
    for (i, s) in sums.iter().enumerate().filter(|(_, s)| **s != Sum::default()) {
        h.absorb(&(i as u64).to_le_bytes());
        h.absorb(&s.total.to_le_bytes());
        h.absorb(&s.squares.to_le_bytes());
    }
}

/// Hashes the sums of receivers, faces, media and ends with their spreads, and the counts of rays, segments, corrected normals, losses and
/// cuts, to 32 hexadecimal digits. What passes faces, lost rays, paths, sequences and other counts have no part in it; what instances
/// absorbed is a sum of faces, and needs none.
pub(crate) fn digest(t: &Tallies) -> String {
    let mut h = Fnv::new();
    t.cells.iter().for_each(|c| absorb_sums(&mut h, c));
    absorb_sums(&mut h, &t.receivers);
    absorb_sums(&mut h, &t.faces);
    absorb_sums(&mut h, &t.bulk);
    absorb_sums(&mut h, &t.ends);
    for m in &t.moments {
        m.first.iter().for_each(|x| h.absorb(&x.to_le_bytes()));
        m.second.iter().for_each(|x| h.absorb(&x.to_le_bytes()));
        h.absorb(&m.farthest.to_le_bytes());
    }
    t.spreads.iter().flat_map(|s| s.products.iter().flatten()).for_each(|x| h.absorb(&x.to_le_bytes()));
    t.channels.iter().for_each(|c| absorb_sums(&mut h, c));
    let c = &t.counts;
    [c.rays, c.segments, c.corrected_normals, c.lost, c.cut_off].iter().for_each(|x| h.absorb(&x.to_le_bytes()));
    format!("{:032x}", h.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

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

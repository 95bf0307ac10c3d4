//! The rays of one source of a run, and what each weighs.

/// The golden ratio, as a share of 2³².
const GOLDEN_RATIO: u32 = 0x9e37_79b9;

/// The rays of one source: in the whole run, or in each replicate of one that can grow.
///
/// Every replicate has the same quanta of it, so that their spread is that of the light alone: where its rays don't divide evenly, those of
/// a replicate with one more weigh less. A source with fewer rays than there are replicates is in some of them alone, another in others:
/// the spread then holds that too, even where all of its light arrives, which a note says of one with much power.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourceShare {
    /// Number of its first ray, and how many it has.
    pub(super) first: u64,
    pub(super) rays: u64,
    /// Rays that each replicate has at least.
    pub(super) fewest: u64,
    /// By how much the bounds between parts are moved, in rays times parts; below their number.
    shift: u32,
    /// Quanta of each ray in a replicate with that many, and with one more.
    pub(super) quanta: [f64; 2],
}

impl SourceShare {
    /// Makes the share of a source, by its number, whose rays have so many quanta in the mean, divided into so many parts.
    pub(super) fn new(source: usize, [first, rays]: [u64; 2], quanta: f64, parts: u32) -> Self {
        let fewest = rays / u64::from(parts);
        let quanta = [fewest, fewest + 1].map(|n| (quanta * weight_among(n, rays, parts)).round().max(1.0));
        // Multiples of the golden ratio lie evenly: without, all sources of as few rays would have them in the same parts.
        let turned = (source as u32).wrapping_mul(GOLDEN_RATIO);
        let shift = ((u64::from(turned) * u64::from(parts)) >> 32) as u32;
        Self { first, rays, fewest, shift, quanta }
    }

    /// Returns the number of its first ray in a part, of so many; past the last one that of the ray behind all.
    pub(super) fn first_in(&self, part: u32, parts: u32) -> u64 {
        let before = u128::from(self.rays) * u128::from(part) + u128::from(self.shift);
        self.first + (before / u128::from(parts)) as u64
    }

    /// Returns the part, of so many, that has its ray of this number: several before it may have none.
    pub(super) fn part_of(&self, ray: u64, parts: u32) -> u32 {
        let up_to_it = u128::from(ray - self.first + 1) * u128::from(parts) - u128::from(self.shift);
        (up_to_it.div_ceil(u128::from(self.rays)) - 1) as u32
    }

    /// Returns the quanta of all its rays, divided into so many parts.
    pub(super) fn all_quanta(&self, parts: u32) -> f64 {
        let parts = u64::from(parts);
        // So many have one ray more.
        let larger = self.rays % parts;
        let rays = [(parts - larger) * self.fewest, larger * (self.fewest + 1)];
        rays[0] as f64 * self.quanta[0] + rays[1] as f64 * self.quanta[1]
    }
}

/// Returns what a ray weighs in a part with so many of a source's rays, over its weight where all parts have the same number: as much as
/// makes all parts alike, up to twice. A source with fewer rays than there are parts cannot be in all of them.
pub(super) fn weight_among(count: u64, rays: u64, parts: u32) -> f64 {
    let mean = rays as f64 / f64::from(parts);
    if mean < 1.0 { 1.0 } else { mean / count as f64 }
}

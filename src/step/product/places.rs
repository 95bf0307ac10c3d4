//! Placements as keys of tables, and placements that are one to rounding.

use crate::math::Frame;
use rustc_hash::FxHashMap;

/// Share of a coordinate, and part of an axis, by which two placements of one thing may differ: of a number that a file prints with seven
/// digits the last is off by 5e-7 of it at most, in either placement. Parts differ by more: 500 mm from the origin, places 0.6 µm apart are
/// two.
const PLACE_ROUNDING: f64 = 1e-6;
/// The same at the origin, mm: with six decimals each number is off by 5e-7, and a way through an assembly adds up several of them.
const PLACE_ROUNDING_MM: f64 = 1e-5;

/// A placement that can be a key: its bits, with one zero.
pub(super) type PlacementKey = [u64; 13];

/// Returns the numbers of a placement as a key.
pub(super) fn placement_key(f: &Frame) -> PlacementKey {
    let numbers = [f.origin, f.x, f.y, f.z].map(|v| v.to_array()).concat();
    let mut key = [0; 13];
    for (k, x) in key.iter_mut().zip(numbers.into_iter().chain([f.scale])) {
        // Adding 0 makes −0 and 0 one.
        *k = (x + 0.0).to_bits();
    }
    key
}

/// Returns how far the origins of two placements may lie apart that are one, mm; `f` is either.
fn origin_tolerance(f: &Frame) -> f64 {
    PLACE_ROUNDING_MM + PLACE_ROUNDING * f.origin.abs().max_element()
}

/// Whether two placements are one to rounding.
pub(super) fn is_one_place(a: &Frame, b: &Frame) -> bool {
    let axes = [(a.x, b.x), (a.y, b.y), (a.z, b.z)];
    (a.origin - b.origin).abs().max_element() <= origin_tolerance(a)
        && axes.iter().all(|(a, b)| (*a - *b).abs().max_element() <= PLACE_ROUNDING)
        && (a.scale - b.scale).abs() <= PLACE_ROUNDING * a.scale
}

/// A list of placements, in which one is found to rounding.
pub(super) struct PlaceList {
    /// Ascending by the x of their origins.
    placements: Vec<Frame>,
}

impl PlaceList {
    /// Sorts placements.
    pub(super) fn new(mut placements: Vec<Frame>) -> Self {
        placements.sort_by(|a, b| a.origin.x.total_cmp(&b.origin.x));
        Self { placements }
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.placements.is_empty()
    }

    /// Whether one of them is this placement, to rounding.
    pub(super) fn holds(&self, placement: &Frame) -> bool {
        let tolerance = origin_tolerance(placement);
        // Of ten thousand places of one screw few have the same x.
        let first = self.placements.partition_point(|f| f.origin.x < placement.origin.x - tolerance);
        let mut near = self.placements[first..].iter().take_while(|f| f.origin.x <= placement.origin.x + tolerance);
        near.any(|f| is_one_place(placement, f))
    }
}

/// Where usages put the representations of the children of a product.
#[derive(Default)]
pub(super) struct UsagePlaces {
    by_representation: FxHashMap<u64, PlaceList>,
}

impl UsagePlaces {
    /// Collects placements by representation.
    pub(super) fn new(placements: FxHashMap<u64, Vec<Frame>>) -> Self {
        let sorted = placements.into_iter().map(|(representation, all)| (representation, PlaceList::new(all)));
        Self { by_representation: sorted.collect() }
    }

    /// Whether a usage puts a representation there, to rounding.
    pub(super) fn holds(&self, representation: u64, placement: &Frame) -> bool {
        self.by_representation.get(&representation).is_some_and(|places| places.holds(placement))
    }
}

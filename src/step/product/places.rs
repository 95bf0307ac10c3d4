//! Places of things, and whether two are one to rounding.
//!
//! Only the digits of the placement within a parent count, wherever the parent stands: in an assembly a kilometre from the origin, things
//! half a millimetre apart are two.
//!
//! Known weakness: of several placements one in the other only the digits of the innermost count. A thing to which two ways lead, by one
//! step and by a large one with a small one in it, may stand twice; with the digits of the outer steps too, two things half a millimetre
//! apart in what a mapped item puts a kilometre out would be one.

use crate::math::Frame;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Share of a coordinate, and part of an axis, by which two placements of one thing may differ: of a number that a file prints with seven
/// digits the last is off by 5e-7 of it at most, in either placement. Parts differ by more: 500 mm from the origin, places 0.6 µm apart are
/// two.
const PLACE_ROUNDING: f64 = 1e-6;
/// The same at the origin, mm: with six decimals each number is off by 5e-7, and a way through an assembly adds up several of them.
const PLACE_ROUNDING_MM: f64 = 1e-5;
/// Share of a coordinate in the whole that is lost where placements are composed: some fifty roundings of a double.
const COMPOSITION_ROUNDING: f64 = 1e-14;
/// What places are sorted along: across it lie no rows of things, as across each axis.
const SORTING_LINE: [f64; 3] = [1.0, 0.618, 0.414];
/// Places of one thing are searched together where the binary exponents of their roundings are in one class of so many: one that stands
/// 1e11 mm out, which is known to 1e5 mm, would otherwise make all others be searched that far. Classes begin at fixed exponents: that of
/// 1e-5 mm, at the origin, ends at 2^-13 mm, 1.22e-4 mm, and no rounding in it is more.
const CLASS_DIGITS: u64 = 10;

/// Returns how far the origins of two placements may lie apart that are one, mm; `f` is either.
fn origin_tolerance(f: &Frame) -> f64 {
    PLACE_ROUNDING_MM + PLACE_ROUNDING * f.origin.abs().max_element()
}

/// Whether two placements are turned and scaled alike, to rounding.
fn are_alike(a: &Frame, b: &Frame) -> bool {
    let axes = [(a.x, b.x), (a.y, b.y), (a.z, b.z)];
    axes.iter().all(|(a, b)| (*a - *b).abs().max_element() <= PLACE_ROUNDING)
        && (a.scale - b.scale).abs() <= PLACE_ROUNDING * a.scale
}

/// Whether two placements in one parent are one to rounding.
pub(super) fn is_one_place(a: &Frame, b: &Frame) -> bool {
    (a.origin - b.origin).abs().max_element() <= origin_tolerance(a) && are_alike(a, b)
}

/// Where a thing stands in the whole, and how well its file says so.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) frame: Frame,
    /// How far the same place may lie off it, mm, for the digits of the placement within its parent.
    pub(super) rounding: f64,
}

impl Place {
    /// The place of what others are placed in, which itself stands there exactly.
    pub(super) fn of_parent(frame: Frame) -> Self {
        Self::rounded(frame, frame.scale * PLACE_ROUNDING_MM)
    }

    /// Returns the place of what stands at `local` in its parent, in the parent's coordinates.
    pub(super) fn in_parent(local: &Frame) -> Self {
        Self::of_parent(Frame::IDENTITY).inner(local)
    }

    /// Returns the place of what stands at `local` in the thing of this place; unmoved it stands in the same parent as that.
    pub(super) fn inner(&self, local: &Frame) -> Self {
        if local.is_identity() {
            return *self;
        }
        Self::rounded(self.frame.compose(local), self.frame.scale * origin_tolerance(local))
    }

    fn rounded(frame: Frame, digits: f64) -> Self {
        Self { frame, rounding: digits + COMPOSITION_ROUNDING * frame.origin.abs().max_element() }
    }

    /// Whether two places are one to rounding.
    fn is_one_with(&self, other: &Self) -> bool {
        let apart = (self.frame.origin - other.frame.origin).abs().max_element();
        apart <= self.rounding.max(other.rounding) && are_alike(&self.frame, &other.frame)
    }

    /// Returns how far along [`SORTING_LINE`] it lies, times the line's length.
    fn sorting_position(&self) -> f64 {
        let origin = self.frame.origin.to_array();
        origin.iter().zip(SORTING_LINE).map(|(x, slope)| x * slope).sum()
    }
}

/// Things, by their ids, in places, of which one is found to rounding.
#[derive(Default)]
pub(super) struct PlaceTable {
    /// By thing, by the class of the rounding, by the position along [`SORTING_LINE`], and by the number of the entry.
    entries: BTreeMap<(u64, u64, i64, usize), Place>,
    /// The classes of roundings that each thing has.
    classes: FxHashMap<u64, Vec<RoundingClass>>,
}

/// Places of one thing whose roundings are of one size.
struct RoundingClass {
    /// The binary exponent of the roundings in steps of [`CLASS_DIGITS`].
    class: u64,
    /// The largest of the roundings, mm.
    widest: f64,
}

impl RoundingClass {
    /// Returns the class of a rounding.
    fn number(rounding: f64) -> u64 {
        (rounding.to_bits() >> (f64::MANTISSA_DIGITS - 1)) / CLASS_DIGITS
    }
}

impl PlaceTable {
    /// Adds a thing in a place; the entries are numbered from 0.
    pub(super) fn insert(&mut self, thing: u64, place: Place) {
        let class = RoundingClass::number(place.rounding);
        self.entries.insert((thing, class, ordered(place.sorting_position()), self.entries.len()), place);
        let classes = self.classes.entry(thing).or_default();
        match classes.iter_mut().find(|known| known.class == class) {
            Some(known) => known.widest = known.widest.max(place.rounding),
            None => classes.push(RoundingClass { class, widest: place.rounding.max(0.0) }),
        }
    }

    /// Returns the number of an entry that has the thing in this place, to rounding; `None` where there is none.
    pub(super) fn find(&self, thing: u64, place: &Place) -> Option<usize> {
        let mut abreast = self.abreast(thing, place)?;
        abreast.find(|(_, other)| place.is_one_with(other)).map(|(number, _)| number)
    }

    /// Returns the entries of a thing, with their numbers, of which one could be the same place: of ten thousand places of one screw few.
    fn abreast(&self, thing: u64, place: &Place) -> Option<impl Iterator<Item = (usize, &Place)>> {
        let classes = self.classes.get(&thing)?;
        // Callers refuse what is too far out for a number.
        let along = Some(place.sorting_position()).filter(|along| along.is_finite())?;
        let rounding = place.rounding;
        Some(classes.iter().flat_map(move |&RoundingClass { class, widest }| {
            let reach = widest.max(rounding) * SORTING_LINE.iter().sum::<f64>();
            let [low, high] = [along - reach, along + reach].map(ordered);
            let near = self.entries.range((thing, class, low, 0)..=(thing, class, high, usize::MAX));
            near.map(|((.., number), other)| (*number, other))
        }))
    }

    /// Whether the thing stands in this place, to rounding.
    pub(super) fn holds(&self, thing: u64, place: &Place) -> bool {
        self.find(thing, place).is_some()
    }
}

/// Returns an integer in the order of [`f64::total_cmp`].
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits().cast_signed();
    // Of a negative number the larger has the smaller amount.
    if bits < 0 { bits ^ i64::MAX } else { bits }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vector;

    fn shift(x: f64) -> Frame {
        Frame::translation(Vector::new(x, 0.0, 0.0))
    }

    #[test]
    fn digits_within_the_parent_count_wherever_that_stands() {
        for far in [0.0, 1e6, -1e6] {
            let parent = Place::of_parent(shift(far));
            let mut table = PlaceTable::default();
            table.insert(7, parent.inner(&shift(12.5)));
            table.insert(7, parent.inner(&shift(1_234.567_84)));
            assert!(!table.holds(7, &parent.inner(&shift(13.0))), "{far}");
            assert_eq!(table.find(7, &parent.inner(&shift(12.500_001))), Some(0), "{far}");
            // Printed with seven digits.
            assert_eq!(table.find(7, &parent.inner(&shift(1234.568))), Some(1), "{far}");
            assert!(!table.holds(8, &parent.inner(&shift(12.5))), "{far}");
        }
        // A parent that takes the coordinates back leaves the rounding of its child's.
        let back = Place::of_parent(shift(-1234.568));
        let mut table = PlaceTable::default();
        table.insert(7, back.inner(&shift(1_234.567_84)));
        assert!(table.holds(7, &back.inner(&shift(1234.568))));
    }

    /// Another thing, and the same.
    #[test]
    fn a_place_far_out_lets_no_others_lie_abreast() {
        for far in [8, 7] {
            let parent = Place::of_parent(Frame::IDENTITY);
            let mut table = PlaceTable::default();
            table.insert(far, parent.inner(&shift(1e11)));
            (0..100).for_each(|k| table.insert(7, parent.inner(&shift(1.5 * f64::from(k)))));
            let place = parent.inner(&shift(15.0));
            assert_eq!(table.abreast(7, &place).map(Iterator::count), Some(1), "{far}");
            assert_eq!(table.find(7, &place), Some(11), "{far}");
            // Out there a place has the digits of its coordinate.
            assert_eq!(table.find(far, &parent.inner(&shift(1e11 + 5e4))), Some(0), "{far}");
        }
    }

    /// What has a place within 1e5 mm may be one with what has it within 1e-5 mm, whichever is asked for.
    #[test]
    fn places_of_unlike_digits_are_one_within_the_wider() {
        let outer = Place::of_parent(shift(-1e11));
        let [exact, wide] = [Place::of_parent(shift(2e4)), outer.inner(&shift(1e11))];
        for [known, asked] in [[exact, wide], [wide, exact]] {
            let mut table = PlaceTable::default();
            table.insert(7, known);
            assert_eq!(table.find(7, &asked), Some(0), "{known:?}");
        }
    }

    #[test]
    fn numbers_are_in_order() {
        let numbers = [f64::NEG_INFINITY, -2.0, -1.0, -1e-300, 0.0, 1e-300, 1.0, 2.0, f64::INFINITY];
        assert!(numbers.map(ordered).is_sorted_by(|a, b| a < b));
    }
}

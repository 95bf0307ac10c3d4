//! Numbers as people write them: `1e6` rays, one length where two may stand.

use serde::Deserializer;
use serde::de::{Error, SeqAccess, Unexpected, Visitor};
use std::fmt;

/// Whole numbers up to this one are exact where they are written as `1e6`: just below 2⁵³.
const LARGEST_COUNT: f64 = 9e15;

/// Reads a whole number from 0, which may be written as `1e6`; such a one must be below [`LARGEST_COUNT`].
pub(super) fn count<'de, D: Deserializer<'de>>(d: D) -> Result<u64, D::Error> {
    d.deserialize_any(Count)
}

/// Reads a whole number, such as `1e6`, of a key that may be missing; a serde default stands for one that is.
pub(super) fn optional_count<'de, D: Deserializer<'de>>(d: D) -> Result<Option<u64>, D::Error> {
    d.deserialize_any(Count).map(Some)
}

/// Reads two numbers, or one for both; their order and sign are not looked at.
pub(super) fn range<'de, D: Deserializer<'de>>(d: D) -> Result<Option<[f64; 2]>, D::Error> {
    d.deserialize_any(Range).map(Some)
}

/// Returns what a schema says of what [`count`] reads.
#[cfg(feature = "schema")]
pub(super) fn count_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({"type": "number", "multipleOf": 1, "minimum": 0, "maximum": LARGEST_COUNT})
}

/// Returns what a schema says of what [`range`] reads.
#[cfg(feature = "schema")]
pub(super) fn range_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let two = <[f64; 2] as schemars::JsonSchema>::json_schema(generator);
    schemars::json_schema!({"anyOf": [{"type": "number"}, two]})
}

/// Reads a whole number.
struct Count;

impl Visitor<'_> for Count {
    type Value = u64;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a whole positive number below 9e15, such as 1_000_000 or 1e6")
    }
    fn visit_i64<E: Error>(self, n: i64) -> Result<u64, E> {
        u64::try_from(n).map_err(|_| E::invalid_value(Unexpected::Signed(n), &self))
    }
    fn visit_u64<E: Error>(self, n: u64) -> Result<u64, E> {
        Ok(n)
    }
    fn visit_f64<E: Error>(self, x: f64) -> Result<u64, E> {
        if x.fract() == 0.0 && (0.0..LARGEST_COUNT).contains(&x) {
            Ok(x as u64)
        } else {
            Err(E::invalid_value(Unexpected::Float(x), &self))
        }
    }
}

/// Reads a pair of numbers, or one for both.
struct Range;

impl<'de> Visitor<'de> for Range {
    type Value = [f64; 2];
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("two lengths, as in [0.05, 0.2], or one")
    }
    fn visit_i64<E: Error>(self, n: i64) -> Result<[f64; 2], E> {
        Ok([n as f64; 2])
    }
    fn visit_f64<E: Error>(self, x: f64) -> Result<[f64; 2], E> {
        Ok([x; 2])
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<[f64; 2], A::Error> {
        // A third number is asked for, so that three are refused and not cut to two.
        let mut next = || seq.next_element::<f64>();
        match (next()?, next()?, next()?) {
            (Some(low), Some(high), None) => Ok([low, high]),
            _ => Err(A::Error::custom("expected two lengths, as in [0.05, 0.2], or one")),
        }
    }
}

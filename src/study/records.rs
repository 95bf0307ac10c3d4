//! Ray files: little-endian `f64` records `ox oy oz dx dy dz t`, `t` infinite for a miss and ignored on reading.
//!
//! From such a file any other program can trace the same rays.

use crate::math::{Point, Ray, Vector};
use std::io::{self, Read, Write};

/// A direction this close to unit length is kept as it is: the file may give six digits.
const UNIT_LENGTH: f64 = 1e-6;

/// Bytes of one record.
pub const RECORD: usize = 56;

/// Writes rays with the distance of their answer (`None` for a miss).
///
/// # Errors
/// Those of the writer.
pub fn write(out: &mut impl Write, rays: impl IntoIterator<Item = (Ray, Option<f64>)>) -> io::Result<()> {
    for (ray, t) in rays {
        let [o, d] = [ray.origin, ray.direction];
        let mut record = [0u8; RECORD];
        for (slot, x) in record.chunks_exact_mut(8).zip([o.x, o.y, o.z, d.x, d.y, d.z, t.unwrap_or(f64::INFINITY)])
        {
            slot.copy_from_slice(&x.to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}

/// Reads rays and the distances beside them.
///
/// A direction whose length is not 1 within 1e-6 is brought to unit length; one that is already is kept bit by bit.
///
/// # Errors
/// Those of the reader; `InvalidData` for a torn last record, a number that is not finite, or a zero direction, with
/// the index of the record.
pub fn read(input: &mut impl Read) -> io::Result<Vec<(Ray, Option<f64>)>> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    let bad = |i: usize, what: &str| io::Error::new(io::ErrorKind::InvalidData, format!("ray record {i}: {what}"));
    // Before anything is made of it: a torn file was cut while it was written.
    if bytes.len() % RECORD != 0 {
        return Err(bad(
            bytes.len() / RECORD,
            "torn: a record is 56 bytes (7 little-endian f64: ox oy oz dx dy dz t)",
        ));
    }
    let record = |(i, bytes): (usize, &[u8])| {
        let mut x = [0.0; 7];
        for (slot, eight) in x.iter_mut().zip(bytes.chunks_exact(8)) {
            let mut le = [0u8; 8];
            le.copy_from_slice(eight);
            *slot = f64::from_le_bytes(le);
        }
        if x[..6].iter().any(|v| !v.is_finite()) {
            return Err(bad(i, "origin and direction must be finite"));
        }
        let given = Vector::new(x[3], x[4], x[5]);
        let direction = if (given.length() - 1.0).abs() < UNIT_LENGTH {
            given
        } else {
            given.try_normalize().ok_or_else(|| bad(i, "the direction is zero"))?
        };
        // A miss is written as infinite.
        Ok((Ray::new(Point::new(x[0], x[1], x[2]), direction), x[6].is_finite().then_some(x[6])))
    };
    bytes.chunks_exact(RECORD).enumerate().map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back_bit_by_bit() {
        let d = Vector::new(0.1, 0.7, -0.3).normalize();
        let rays = vec![(Ray::new(Point::new(1.0, -2.0, 0.1), d), Some(0.3)), (Ray::new(Point::ZERO, d), None)];
        let mut bytes = Vec::new();
        write(&mut bytes, rays.clone()).unwrap();
        assert_eq!(bytes.len(), 2 * RECORD);
        assert_eq!(&bytes[48..56], &0.3f64.to_le_bytes());
        assert_eq!(read(&mut bytes.as_slice()).unwrap(), rays);
    }

    #[test]
    fn broken_records_are_refused_by_number() {
        let mut bytes = Vec::new();
        write(&mut bytes, [(Ray::new(Point::ZERO, Vector::X), None); 2]).unwrap();
        assert!(read(&mut &bytes[..60]).unwrap_err().to_string().contains("record 1"));
        bytes[56..64].copy_from_slice(&f64::NAN.to_le_bytes());
        assert!(read(&mut bytes.as_slice()).unwrap_err().to_string().contains("record 1: origin"));
    }
}

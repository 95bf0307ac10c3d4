//! Arrays of plain numbers as bytes and back, as fast as memory: what is kept from one run to the next is read this way.
//!
//! Numbers have this machine's byte order; a caller that stores them records the kind of machine.

use crate::math::huge_pages;
use bytemuck::{AnyBitPattern, NoUninit};
use std::io::{self, Read, Write};

/// Writes the number of elements as eight bytes, then the elements as this machine has them.
pub(crate) fn write_array<T: NoUninit>(to: &mut dyn Write, array: &[T]) -> io::Result<()> {
    to.write_all(&(array.len() as u64).to_le_bytes())?;
    to.write_all(bytemuck::cast_slice(array))
}

/// Bytes that are read, made or taken apart at a time: they stay in the second cache of a core for all that is done with them, hashing
/// among it.
const CHUNK_BYTES: usize = 1 << 18;

/// Writes the number of elements as eight bytes, then the record that `record` makes of each, as [`write_array`] would all records at once.
pub(crate) fn write_records<T, R: NoUninit>(
    to: &mut dyn Write,
    elements: &[T],
    record: impl Fn(&T) -> R,
) -> io::Result<()> {
    to.write_all(&(elements.len() as u64).to_le_bytes())?;
    let mut records = Vec::new();
    for chunk in elements.chunks(chunk_length::<R>()) {
        records.clear();
        records.extend(chunk.iter().map(&record));
        to.write_all(bytemuck::cast_slice(&records))?;
    }
    Ok(())
}

/// Returns how many elements make a chunk.
const fn chunk_length<T>() -> usize {
    // Of larger ones, and of those without a size, one at a time.
    if size_of::<T>() == 0 || size_of::<T>() > CHUNK_BYTES { 1 } else { CHUNK_BYTES / size_of::<T>() }
}

/// Reads arrays from what holds so many bytes: a length beyond them asks for no memory.
pub(crate) struct ArrayReader<'a> {
    from: &'a mut dyn Read,
    /// Bytes that may still be read.
    left: u64,
}

impl<'a> ArrayReader<'a> {
    /// Reads from `from`, which holds at most `left` bytes.
    pub(crate) fn new(from: &'a mut dyn Read, left: u64) -> Self {
        Self { from, left }
    }

    /// Returns how many elements may still be read, at most: no array can be longer.
    pub(crate) fn most_left<T>(&self) -> usize {
        usize::try_from(self.left / size_of::<T>().max(1) as u64).unwrap_or(usize::MAX)
    }

    /// Reads an array into huge pages where it is large, and calls `look` with all its elements, some after the other.
    ///
    /// # Errors
    /// When it is longer than what is left, or cannot be read.
    pub(crate) fn array_with<T: NoUninit + AnyBitPattern>(
        &mut self,
        mut look: impl FnMut(&mut [T]),
    ) -> io::Result<Vec<T>> {
        let length = self.length(size_of::<T>())?;
        let mut array = huge_pages::with_capacity(length);
        while array.len() < length {
            let first = array.len();
            // Not zeroed as a whole: that took as long as reading it. By a closure, which is one run of zeros and not a copy for each.
            array.resize_with(length.min(first + chunk_length::<T>()), T::zeroed);
            self.from.read_exact(bytemuck::cast_slice_mut(&mut array[first..]))?;
            look(&mut array[first..]);
        }
        Ok(array)
    }

    /// Reads the records that [`write_records`] made of elements whose bytes they are, and calls `look` with all of them, some after the
    /// other.
    ///
    /// # Errors
    /// As [`ArrayReader::array_with`].
    ///
    /// # Panics
    /// When an element has another size or alignment than its record.
    pub(crate) fn records_as<R: NoUninit + AnyBitPattern, T: AnyBitPattern>(
        &mut self,
        look: impl FnMut(&mut [R]),
    ) -> io::Result<Vec<T>> {
        // The same memory under another name: made anew one by one, vertices took a third of the time of reading a mesh.
        self.array_with(look).map(bytemuck::allocation::cast_vec)
    }

    /// Reads the number of elements of an array, each of so many bytes.
    fn length(&mut self, size: usize) -> io::Result<usize> {
        let mut length = [0; 8];
        self.from.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        let bytes = length.checked_mul(size as u64).filter(|n| *n <= self.left.saturating_sub(8));
        let bytes = bytes.ok_or(io::ErrorKind::UnexpectedEof)?;
        self.left -= 8 + bytes;
        Ok(length as usize)
    }

    /// Reads an array.
    ///
    /// # Errors
    /// As [`ArrayReader::array_with`].
    pub(crate) fn array<T: NoUninit + AnyBitPattern>(&mut self) -> io::Result<Vec<T>> {
        self.array_with(|_| ())
    }
}

/// An error of kind `InvalidData` with this message, for bytes that are no arrays of ours.
pub(crate) fn invalid(message: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_come_back_and_false_lengths_are_refused() {
        let mut bytes = Vec::new();
        write_array(&mut bytes, &[1.5f64, f64::NAN]).unwrap();
        write_array::<u32>(&mut bytes, &[]).unwrap();
        let length = bytes.len() as u64;
        let mut from = &bytes[..];
        let mut reader = ArrayReader::new(&mut from, length);
        assert!((2..=length as usize / 8).contains(&reader.most_left::<f64>()));
        let numbers = reader.array::<f64>().unwrap();
        assert!(numbers.len() == 2 && numbers[0] == 1.5 && numbers[1].is_nan());
        assert!(reader.array::<u32>().unwrap().is_empty());
        assert_eq!(reader.most_left::<u32>(), 0);
        assert!(reader.array::<u32>().is_err());
        bytes[7] = 1;
        assert!(ArrayReader::new(&mut &bytes[..], length).array::<f64>().is_err());
    }

    /// No element at the end of a chunk is lost, and each is looked at once.
    #[test]
    fn arrays_of_several_chunks_come_back() {
        let numbers: Vec<u64> = (0..2 * chunk_length::<u64>() as u64 + 3).collect();
        let mut bytes = Vec::new();
        write_array(&mut bytes, &numbers).unwrap();
        write_records(&mut bytes, &numbers, |n| [*n, !n]).unwrap();
        let length = bytes.len() as u64;
        let mut from = &bytes[..];
        let mut reader = ArrayReader::new(&mut from, length);
        let mut seen = Vec::new();
        assert_eq!(reader.array_with(|some: &mut [u64]| seen.extend_from_slice(some)).unwrap(), numbers);
        assert_eq!(seen, numbers);
        let mut looked = 0;
        let pairs: Vec<[i64; 2]> = reader.records_as(|some: &mut [[u64; 2]]| looked += some.len()).unwrap();
        assert_eq!(looked, numbers.len());
        assert!(pairs.iter().zip(&numbers).all(|(&[n, m], &number)| n as u64 == number && m == !n));
    }
}

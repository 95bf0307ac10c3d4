//! Arrays of plain numbers as bytes and back, as fast as memory: what is kept from one run to the next is read this way.
//!
//! Numbers are as this machine has them; whoever keeps them says for which kind of machine.

use bytemuck::{AnyBitPattern, NoUninit};
use std::io::{self, Read, Write};

/// Writes the number of elements as eight bytes, then the elements as this machine has them.
pub(crate) fn write_array<T: NoUninit>(to: &mut dyn Write, array: &[T]) -> io::Result<()> {
    to.write_all(&(array.len() as u64).to_le_bytes())?;
    to.write_all(bytemuck::cast_slice(array))
}

/// Records that are made or taken apart at a time: they stay in the cache of a core.
const RECORDS: usize = 1 << 12;

/// Writes the number of elements as eight bytes, then the record that `record` makes of each, as [`write_array`] would all records at once.
pub(crate) fn write_records<T, R: NoUninit>(
    to: &mut dyn Write,
    elements: &[T],
    record: impl Fn(&T) -> R,
) -> io::Result<()> {
    to.write_all(&(elements.len() as u64).to_le_bytes())?;
    let mut records = Vec::new();
    for chunk in elements.chunks(RECORDS) {
        records.clear();
        records.extend(chunk.iter().map(&record));
        to.write_all(bytemuck::cast_slice(&records))?;
    }
    Ok(())
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

    /// Reads an array into the empty vector that `make` returns for its number of elements, which it may give room.
    ///
    /// # Errors
    /// When it is longer than what is left, or cannot be read.
    pub(crate) fn array_in<T: NoUninit + AnyBitPattern>(
        &mut self,
        make: impl FnOnce(usize) -> Vec<T>,
    ) -> io::Result<Vec<T>> {
        let length = self.length(size_of::<T>())?;
        let mut array = make(length);
        array.resize(length, T::zeroed());
        self.from.read_exact(bytemuck::cast_slice_mut(&mut array))?;
        Ok(array)
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

    /// Reads what [`write_records`] wrote and makes an element of each record.
    ///
    /// # Errors
    /// As [`ArrayReader::array_in`].
    pub(crate) fn records<R: NoUninit + AnyBitPattern, T>(
        &mut self,
        element: impl Fn(&R) -> T,
    ) -> io::Result<Vec<T>> {
        let length = self.length(size_of::<R>())?;
        let mut elements = Vec::with_capacity(length);
        // Never all records beside all elements: half of the time was spent on clean pages for both.
        let mut records = vec![R::zeroed(); length.min(RECORDS)];
        while elements.len() < length {
            let some = &mut records[..(length - elements.len()).min(RECORDS)];
            self.from.read_exact(bytemuck::cast_slice_mut(some))?;
            elements.extend(some.iter().map(&element));
        }
        Ok(elements)
    }

    /// Reads an array.
    ///
    /// # Errors
    /// As [`ArrayReader::array_in`].
    pub(crate) fn array<T: NoUninit + AnyBitPattern>(&mut self) -> io::Result<Vec<T>> {
        self.array_in(Vec::with_capacity)
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
        let numbers = reader.array::<f64>().unwrap();
        assert!(numbers.len() == 2 && numbers[0] == 1.5 && numbers[1].is_nan());
        assert!(reader.array::<u32>().unwrap().is_empty());
        assert!(reader.array::<u32>().is_err());
        bytes[7] = 1;
        assert!(ArrayReader::new(&mut &bytes[..], length).array::<f64>().is_err());
    }
}

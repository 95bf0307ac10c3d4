//! Little-endian fields of a binary file, read in order; an end that comes too early names the byte and the field.

use super::super::input::open_file;
use super::super::{Error, ErrorKind, LightRay};
use super::ray_collector::RayCollector;
use crate::text::count_of;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// Bytes of one read from the disk.
const BUFFER: usize = 1 << 18;

/// A binary file, read from its start.
pub(super) struct ByteReader {
    path: PathBuf,
    file: BufReader<File>,
    position: u64,
    length: u64,
}

impl ByteReader {
    /// Opens an ordinary file and stands at its first byte.
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let unreadable = |e| Error::new(path, ErrorKind::Read(e));
        let file = open_file(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        Ok(Self { path: path.to_owned(), file: BufReader::with_capacity(BUFFER, file), position: 0, length })
    }

    /// Path of the file, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes read so far.
    pub(super) fn position(&self) -> u64 {
        self.position
    }

    /// Bytes of the whole file.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// An error about the content.
    pub(super) fn malformed(&self, message: impl Into<String>) -> Error {
        Error::new(&self.path, ErrorKind::Malformed(message.into()))
    }

    /// An error about the end of the file before that of `field`, which begins at byte `start` and has so many bytes.
    fn cut_short(&self, field: &str, start: u64, bytes: u64) -> Error {
        let there = self.length.saturating_sub(start);
        let place = if there > 0 { "in the middle of" } else { "before" };
        let missing = count_of(bytes.saturating_sub(there), "byte");
        self.malformed(format!(
            "the file ends {place} {field} at byte {start} ({missing} missing): it was cut short"
        ))
    }

    /// Reads as many bytes as `bytes` has; `field` is what they are, for the message when the file ends too soon.
    pub(super) fn fill(&mut self, bytes: &mut [u8], field: &str) -> Result<(), Error> {
        // Kept for the message: it must name where the field began.
        let start = self.position;
        self.file.read_exact(bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => self.cut_short(field, start, bytes.len() as u64),
            _ => Error::new(&self.path, ErrorKind::Read(e)),
        })?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Reads `N` bytes.
    pub(super) fn read_array<const N: usize>(&mut self, field: &str) -> Result<[u8; N], Error> {
        let mut bytes = [0; N];
        self.fill(&mut bytes, field)?;
        Ok(bytes)
    }

    /// Reads a number of bytes that the file itself states; an error, before memory is taken, where fewer are left.
    pub(super) fn read_block(&mut self, bytes: u64, field: &str) -> Result<Vec<u8>, Error> {
        // Before memory is taken: a damaged length may ask for all there is.
        if bytes > self.length.saturating_sub(self.position) {
            return Err(self.malformed(format!(
                "{field} at byte {} would need {bytes} bytes, but the file has {} in all",
                self.position, self.length
            )));
        }
        let mut block = vec![0; bytes as usize];
        self.fill(&mut block, field)?;
        Ok(block)
    }

    pub(super) fn read_i32(&mut self, field: &str) -> Result<i32, Error> {
        Ok(i32::from_le_bytes(self.read_array(field)?))
    }

    pub(super) fn read_u32(&mut self, field: &str) -> Result<u32, Error> {
        Ok(u32::from_le_bytes(self.read_array(field)?))
    }

    pub(super) fn read_u64(&mut self, field: &str) -> Result<u64, Error> {
        Ok(u64::from_le_bytes(self.read_array(field)?))
    }

    pub(super) fn read_f32(&mut self, field: &str) -> Result<f32, Error> {
        Ok(f32::from_le_bytes(self.read_array(field)?))
    }

    /// Reads as many numbers as `row` has; a file that ends within them is an error.
    pub(super) fn read_row(&mut self, row: &mut [f32], field: &str) -> Result<(), Error> {
        for number in row {
            *number = self.read_f32(field)?;
        }
        Ok(())
    }

    /// Reads `count` rows of f32, each made a ray by `ray`, which may refuse it; the error then names the ray, counted from 1.
    pub(super) fn read_rays(
        &mut self,
        count: u64,
        columns: usize,
        rays: &mut RayCollector,
        mut ray: impl FnMut(&[f32]) -> Result<LightRay, String>,
    ) -> Result<(), Error> {
        let mut row = vec![0.0; columns];
        let row_bytes = 4 * columns as u64;
        for index in 0..count {
            // Asked before it is read: the number of the ray that is cut helps, not which of its numbers is the first to be missing.
            if self.length.saturating_sub(self.position) < row_bytes {
                return Err(self.cut_short(&format!("ray {}", index + 1), self.position, row_bytes));
            }
            self.read_row(&mut row, "the rays")?;
            rays.add(ray(&row).map_err(|m| self.malformed(format!("ray {}: {m}", index + 1)))?)?;
        }
        Ok(())
    }

    /// The open file, for reading from any place of it.
    pub(super) fn file_handle(&self) -> Result<File, Error> {
        self.file.get_ref().try_clone().map_err(|e| Error::new(&self.path, ErrorKind::Read(e)))
    }
}

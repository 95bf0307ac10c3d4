//! An NPZ file whose arrays grow row by row, in constant memory.
//!
//! The number of rows stands at the head of every array, so each column waits in a file beside the final one until all rows
//! are known, and is then packed; the disk holds the rows twice for that while.

use super::atomic::{Unfinished, remove_stale, unfinished};
use super::npz::header;
use super::{Error, ErrorKind, write_atomic};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use zip::write::{SimpleFileOptions, ZipWriter};

/// A column of an [`NpzStream`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name of the array, without `.npy`.
    pub name: &'static str,
    /// NumPy's name of its numbers, such as `<f8`, `<u4` or `|u1`.
    pub numbers: &'static str,
    /// Bytes of one number.
    pub bytes: usize,
    /// Numbers in a row.
    pub width: usize,
}

/// An NPZ file in the making; without [`NpzStream::finish`] nothing of it stays.
#[derive(Debug)]
pub struct NpzStream {
    path: PathBuf,
    /// Each with the part that it is written to.
    columns: Vec<(Column, PathBuf, BufWriter<File>)>,
    rows: u64,
    unfinished: Vec<Unfinished>,
}

impl NpzStream {
    /// Begins a file with these columns, each in a part of its own beside `path`.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn create(path: &Path, columns: &[Column]) -> Result<Self, Error> {
        let mut stream = Self { path: path.to_path_buf(), columns: Vec::new(), rows: 0, unfinished: Vec::new() };
        remove_stale(path);
        for column in columns {
            let beside = unfinished(path);
            stream.unfinished.push(Unfinished::register(&beside));
            let file = File::create(&beside).map_err(|e| Error::new(path, ErrorKind::Write(e)))?;
            stream.columns.push((*column, beside, BufWriter::with_capacity(1 << 16, file)));
        }
        Ok(stream)
    }

    /// Adds rows: the bytes of each column, little-endian, in the columns' order.
    ///
    /// # Errors
    /// When the disk is full, after which the stream is of no use, or the columns do not hold so many rows, which adds none.
    pub fn write(&mut self, rows: u64, bytes: &[&[u8]]) -> Result<(), Error> {
        // A column that is short would shift all later rows against the others.
        let fits = |(c, b): (&(Column, PathBuf, BufWriter<File>), &&[u8])| {
            b.len() as u64 == rows * (c.0.bytes * c.0.width) as u64
        };
        if bytes.len() != self.columns.len() || !self.columns.iter().zip(bytes).all(fits) {
            let message = format!("columns that do not hold {rows} rows");
            return Err(Error::new(&self.path, ErrorKind::Malformed(message)));
        }
        for ((_, _, out), bytes) in self.columns.iter_mut().zip(bytes) {
            out.write_all(bytes).map_err(|e| Error::new(&self.path, ErrorKind::Write(e)))?;
        }
        // Rows that were refused are none of the file.
        self.rows += rows;
        Ok(())
    }

    /// Packs the columns into the file, which replaces an older one, and returns the number of rows; there may be none.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn finish(mut self) -> Result<u64, Error> {
        for (_, _, out) in &mut self.columns {
            out.flush().map_err(|e| Error::new(&self.path, ErrorKind::Write(e)))?;
        }
        write_atomic(&self.path, |w| {
            // Without seeking: what is packed goes straight to the disk.
            let mut zip = ZipWriter::new_stream(w);
            let options = SimpleFileOptions::default()
                .compression_method(zip::CompressionMethod::Deflated)
                // The least effort: directions hardly shrink whatever is spent.
                .compression_level(Some(1))
                // Beyond 4 GiB a ZIP file needs longer sizes, which must be announced at the start.
                .large_file(true);
            for (column, beside, _) in &self.columns {
                zip.start_file(format!("{}.npy", column.name), options).map_err(io::Error::other)?;
                let shape = match column.width {
                    // NumPy distinguishes a row of one number from a scalar.
                    1 => vec![self.rows as usize],
                    n => vec![self.rows as usize, n],
                };
                zip.write_all(&header(column.numbers, &shape))?;
                io::copy(&mut File::open(beside)?, &mut zip)?;
            }
            zip.finish().map(|_| ()).map_err(io::Error::other)
        })?;
        Ok(self.rows)
    }
}

impl Drop for NpzStream {
    fn drop(&mut self) {
        // Nothing more can be done when the removal fails.
        self.columns.iter().for_each(|(_, beside, _)| drop(fs::remove_file(beside)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Seek};

    /// An array of a file as an independent reader sees it.
    fn read<T: npyz::Deserialize>(file: &mut (impl Read + Seek), name: &str) -> (Vec<u64>, Vec<T>) {
        let mut zip = zip::ZipArchive::new(file).unwrap();
        let mut bytes = Vec::new();
        zip.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
        let npy = npyz::NpyFile::new(&bytes[..]).unwrap();
        (npy.shape().to_vec(), npy.into_vec().unwrap())
    }

    #[test]
    fn rows_come_back_and_nothing_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.npz");
        let columns = [
            Column { name: "ray", numbers: "<u8", bytes: 8, width: 1 },
            Column { name: "point", numbers: "<f8", bytes: 8, width: 3 },
        ];
        let mut stream = NpzStream::create(&path, &columns).unwrap();
        for k in 0..1000u64 {
            let point: Vec<u8> = [k as f64, 0.1, -1.0 / 3.0].iter().flat_map(|x| x.to_le_bytes()).collect();
            stream.write(1, &[&k.to_le_bytes(), &point]).unwrap();
        }
        assert!(stream.write(2, &[&[0; 8], &[0; 24]]).is_err());
        assert_eq!(stream.finish().unwrap(), 1000);
        let mut file = File::open(&path).unwrap();
        let (shape, rays) = read::<u64>(&mut file, "ray");
        assert_eq!((shape, rays), (vec![1000], (0..1000).collect()));
        let (shape, points) = read::<f64>(&mut file, "point");
        assert_eq!((shape, points[3 * 77], points[3 * 77 + 2]), (vec![1000, 3], 77.0, -1.0 / 3.0));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        // Two at a time write no part of the other's.
        let [mut one, mut other] = [(); 2].map(|()| NpzStream::create(&path, &columns).unwrap());
        one.write(1, &[&[1; 8], &[0; 24]]).unwrap();
        other.write(1, &[&[2; 8], &[0; 24]]).unwrap();
        drop(other);
        assert_eq!(one.finish().unwrap(), 1);
        assert_eq!(read::<u64>(&mut File::open(&path).unwrap(), "ray").1, [u64::from_le_bytes([1; 8])]);
        drop(NpzStream::create(&path, &columns).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

//! NumPy arrays in a ZIP file. The header is NPY 1.0: magic, little-endian length, a Python dictionary padded to 64 bytes.

use super::{Error, ErrorKind, write_atomic};
use std::io::{self, Cursor, Write};
use std::path::Path;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// One `f64` array of an NPZ file, in C order.
#[derive(Clone, Debug)]
pub struct NpyArray<'a> {
    /// Name of the array, without `.npy`.
    pub name: &'a str,
    /// Lengths of the dimensions; their product is the length of `data`.
    pub shape: Vec<usize>,
    /// The values, the last dimension fastest.
    pub data: &'a [f64],
}

/// Writes named `f64` arrays as a compressed NPZ file that `numpy.load` opens.
///
/// # Errors
/// When a shape does not hold its data, and when the file cannot be written.
pub fn write_npz(path: &Path, arrays: &[NpyArray]) -> Result<(), Error> {
    // The least effort: what is dark shrinks all the same, and the digits of what is lit never do.
    let deflated = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    write_packed(path, arrays, deflated.compression_level(Some(1)))
}

/// As [`write_npz`], not compressed: as large as its numbers are, whatever they are.
///
/// # Errors
/// As [`write_npz`].
pub(super) fn write_plain_npz(path: &Path, arrays: &[NpyArray]) -> Result<(), Error> {
    write_packed(path, arrays, SimpleFileOptions::default().compression_method(CompressionMethod::Stored))
}

fn write_packed(path: &Path, arrays: &[NpyArray], options: SimpleFileOptions) -> Result<(), Error> {
    if let Some(wrong) = arrays.iter().find(|a| a.shape.iter().product::<usize>() != a.data.len()) {
        let message = format!("array '{}' of shape {:?} has {} values", wrong.name, wrong.shape, wrong.data.len());
        return Err(Error::new(path, ErrorKind::Malformed(message)));
    }
    // Packed in memory: the ZIP writer seeks back to sizes that it learns late, and grids of receivers are small.
    let pack = || -> Result<Vec<u8>, zip::result::ZipError> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for array in arrays {
            zip.start_file(format!("{}.npy", array.name), options)?;
            zip.write_all(&header("<f8", &array.shape))?;
            let mut bytes = Vec::with_capacity(8 * array.data.len());
            array.data.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            zip.write_all(&bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    };
    let bytes = pack().map_err(|e| Error::new(path, ErrorKind::Write(io::Error::other(e))))?;
    write_atomic(path, |w| w.write_all(&bytes))
}

/// The NPY head of an array; `numbers` is NumPy's name of their type, such as `<f8`.
pub(super) fn header(numbers: &str, shape: &[usize]) -> Vec<u8> {
    // A tuple of one number needs its comma.
    let dims: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut text = format!("{{'descr': '{numbers}', 'fortran_order': False, 'shape': ({}), }}", dims.trim_end());
    // NumPy aligns the data to 64 bytes, so that it may be mapped.
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.bytes());
    bytes
}

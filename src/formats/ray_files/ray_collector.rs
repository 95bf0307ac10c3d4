//! Rays on their way from a file to where a run reads them: memory for short lists, for longer ones rows of the file itself or a file of
//! ours.

use super::ray_file::{Flux, Place, RayFile, RowLayout};
use crate::formats::scratch::ScratchFile;
use crate::formats::{Error, ErrorKind, LightRay};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Bytes that are written to a scratch file at a time.
const SCRATCH_BUFFER: usize = 1 << 18;

/// Takes the rays of a file in their order, each looked at once, and leaves them where they are to be read from.
pub(super) struct RayCollector {
    path: PathBuf,
    /// Rays that are kept in memory.
    most_in_memory: u64,
    /// Where the rays can be read again: file, first byte and layout of its rows.
    rows: Option<(File, u64, RowLayout)>,
    rays: Vec<LightRay>,
    scratch: Option<ScratchFile>,
    /// What the scratch file still lacks.
    unwritten: Vec<u8>,
    count: u64,
    spectral: u64,
    sum: f64,
}

impl RayCollector {
    /// Begins the rays of the file at `path`, which is for messages; of more than `most_in_memory` none is kept in memory.
    pub(super) fn new(path: &Path, most_in_memory: u64) -> Self {
        Self {
            path: path.to_owned(),
            most_in_memory,
            rows: None,
            rays: Vec::new(),
            scratch: None,
            unwritten: Vec::new(),
            count: 0,
            spectral: 0,
            sum: 0.0,
        }
    }

    /// The same for rays that stand in rows of `file` from byte `start` on, where long lists are read again.
    pub(super) fn with_rows(self, file: File, start: u64, layout: RowLayout) -> Self {
        Self { rows: Some((file, start, layout)), ..self }
    }

    /// Takes the next ray. With the first that is too many for memory all go to a scratch file, unless they stand in rows of the file.
    ///
    /// # Errors
    /// When the folder for temporary files does not take it.
    pub(super) fn add(&mut self, ray: LightRay) -> Result<(), Error> {
        self.count += 1;
        self.spectral += u64::from(ray.wavelength_nm.is_some());
        self.sum += ray.power;
        if self.count <= self.most_in_memory {
            self.rays.push(ray);
            return Ok(());
        }
        // One too many: those in memory are written, or found in the file again.
        let before = std::mem::take(&mut self.rays);
        if self.rows.is_none() {
            for ray in before.iter().chain([&ray]) {
                let numbers = ray.numbers().into_iter().chain([ray.wavelength_nm.unwrap_or(f64::NAN)]);
                numbers.for_each(|x| self.unwritten.extend(x.to_le_bytes()));
            }
            if self.unwritten.len() >= SCRATCH_BUFFER || self.scratch.is_none() {
                self.write()?;
            }
        }
        Ok(())
    }

    /// Writes what the scratch file lacks, which is made where there is none.
    fn write(&mut self) -> Result<(), Error> {
        let written = (|| {
            let scratch = match self.scratch.take() {
                Some(scratch) => scratch,
                None => ScratchFile::create()?,
            };
            (&scratch.file).write_all(&self.unwritten)?;
            self.scratch = Some(scratch);
            self.unwritten.clear();
            Ok(())
        })();
        written.map_err(|e: io::Error| {
            let folder = std::env::temp_dir();
            let message = format!(
                "its rays, 64 bytes each, found no place in the folder for temporary files, {}: {e}; set TMPDIR to another",
                folder.display()
            );
            Error::new(&self.path, ErrorKind::Malformed(message))
        })
    }

    /// Ends the list and makes the file of its rays, whose powers are `flux`; not scaled and without notes.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub(super) fn finish(mut self, flux: Option<Flux>) -> Result<RayFile, Error> {
        if self.scratch.is_some() {
            self.write()?;
        }
        let place = match (self.scratch, self.rows) {
            (Some(scratch), _) => Place::Scratch(scratch),
            (None, Some((file, start, layout))) if self.count > self.most_in_memory => {
                Place::Rows { file, start, layout }
            }
            _ => Place::Memory(self.rays),
        };
        Ok(RayFile {
            flux,
            spectrum: None,
            notes: Vec::new(),
            path: self.path,
            place,
            rays: self.count,
            spectral: self.spectral,
            sum: self.sum,
            scale: 1.0,
        })
    }
}

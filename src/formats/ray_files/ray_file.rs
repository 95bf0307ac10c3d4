//! Rays of a file, read on demand in blocks: what a list of 10⁸ rays holds in memory is one block for each who reads.
//!
//! Short lists are kept in memory. Of longer ones the rays stay in the file where its rows are as long as each other; others (text, packed
//! arrays, wavelengths that depend on the rays before) are unpacked once into a file in the folder for temporary files.
//!
//! Guarantee: a ray has the same bits wherever it is kept. Known weakness: a file that is changed while it is in use gives other rays.

use crate::formats::scratch::ScratchFile;
use crate::formats::{Error, ErrorKind, LightRay};
use crate::math::{Point, Vector};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Rays that are kept in memory, 80 bytes each; a list of more is left on the disk.
pub(super) const MOST_IN_MEMORY: u64 = 1 << 17;

/// Numbers of a ray in a scratch file: origin, direction, power, wavelength or NaN.
const SCRATCH_NUMBERS: usize = 8;
const SCRATCH_BYTES: usize = 8 * SCRATCH_NUMBERS;

/// Disagreement of header and rays that single precision explains, relative: rays of f32 added up by their writer in f32.
const TOTAL_ROUNDING: f64 = 1e-4;

/// The quantity that the power of a ray stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flux {
    /// Radiant flux, watts.
    Radiant,
    /// Luminous flux, lumens.
    Luminous,
}

impl std::fmt::Display for Flux {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if *self == Self::Radiant { "watts" } else { "lumens" })
    }
}

/// The rays of a measured source.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// Origin in mm, unit direction, power in the unit of `flux`, wavelength where the file gives one for the ray.
    pub rays: Vec<LightRay>,
    /// What the powers stand for; `None` where the file does not say (CSV and NPZ).
    pub flux: Option<Flux>,
    /// Pairs of nm and relative radiant power per nm that hold for all rays, where the file gives such a table.
    pub spectrum: Option<Vec<[f64; 2]>>,
    /// What the reader changed or supposed, for people.
    pub notes: Vec<String>,
}

/// How a row of f32 becomes a ray: position and direction stand first.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowLayout {
    /// Numbers of a row.
    pub(super) columns: usize,
    /// Length of a unit of the positions, mm.
    pub(super) scale: f64,
    /// Where the power stands.
    pub(super) power: usize,
    pub(super) wavelength: RowWavelength,
}

/// Where the wavelength of a row comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum RowWavelength {
    /// One for all, nm, or none.
    Common(Option<f64>),
    /// A column, and the length of its unit in nm.
    Column(usize, f64),
}

impl RowLayout {
    /// Makes the ray of a row, whose number in a column `cell` returns; an error, for people, as [`LightRay::from_numbers`].
    pub(super) fn ray(&self, cell: impl Fn(usize) -> f32) -> Result<LightRay, String> {
        let wavelength = match self.wavelength {
            RowWavelength::Common(nm) => nm,
            RowWavelength::Column(place, unit) => Some(f64::from(cell(place)) * unit),
        };
        let mut numbers = [0.0; 8];
        for (place, number) in numbers[..7].iter_mut().enumerate() {
            *number = f64::from(cell(if place < 6 { place } else { self.power }));
        }
        for coordinate in &mut numbers[..3] {
            *coordinate *= self.scale;
        }
        match wavelength {
            Some(nm) => {
                numbers[7] = nm;
                LightRay::from_numbers(&numbers)
            }
            None => LightRay::from_numbers(&numbers[..7]),
        }
    }
}

/// Where the rays are.
#[derive(Debug)]
pub(super) enum Place {
    Memory(Vec<LightRay>),
    /// In rows of f32 of the file itself, from a byte on.
    Rows {
        file: File,
        start: u64,
        layout: RowLayout,
    },
    /// In records of f64 of a file of ours.
    Scratch(ScratchFile),
}

/// The rays of a file, each read when it is asked for.
#[derive(Debug)]
pub struct RayFile {
    /// What the powers stand for; `None` where the file does not say (CSV and NPZ).
    pub flux: Option<Flux>,
    /// Pairs of nm and relative radiant power per nm that hold for all rays, where the file gives such a table.
    pub spectrum: Option<Vec<[f64; 2]>>,
    /// What the reader changed or supposed, for people.
    pub notes: Vec<String>,
    pub(super) path: PathBuf,
    pub(super) place: Place,
    pub(super) rays: u64,
    /// How many of them have a wavelength.
    pub(super) spectral: u64,
    /// Sum of the powers as the file lists them.
    pub(super) sum: f64,
    /// What powers are multiplied by.
    pub(super) scale: f64,
}

/// Neighbouring rays of a [`RayFile`] as they are kept there; its memory is used again for the next ones.
#[derive(Clone, Debug, Default)]
pub struct RayBlock {
    first: u64,
    rays: usize,
    /// Empty for rays in memory.
    bytes: Vec<u8>,
}

impl RayBlock {
    /// Number of its rays.
    pub fn len(&self) -> usize {
        self.rays
    }

    /// Whether it has no rays.
    pub fn is_empty(&self) -> bool {
        self.rays == 0
    }
}

impl RayFile {
    /// Makes a file of rays that are in memory already; nothing is known of their flux.
    pub fn from_rays(path: &Path, rays: Vec<LightRay>) -> Self {
        Self {
            flux: None,
            spectrum: None,
            notes: Vec::new(),
            path: path.to_owned(),
            rays: rays.len() as u64,
            spectral: rays.iter().filter(|r| r.wavelength_nm.is_some()).count() as u64,
            sum: rays.iter().map(|r| r.power).sum(),
            scale: 1.0,
            place: Place::Memory(rays),
        }
    }

    /// Number of rays.
    pub fn len(&self) -> u64 {
        self.rays
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.rays == 0
    }

    /// Number of rays that have a wavelength of their own.
    pub fn spectral_rays(&self) -> u64 {
        self.spectral
    }

    /// Puts the rays from `first`, counted from 0, on into `block`, in place of those in it: at most `most`, and none behind the last.
    /// After an error the block is empty.
    ///
    /// # Errors
    /// When the file cannot be read any more.
    pub fn read_block(&self, first: u64, most: usize, block: &mut RayBlock) -> Result<(), Error> {
        block.first = first;
        block.rays = self.rays.saturating_sub(first).min(most as u64) as usize;
        let (file, start, row) = match &self.place {
            Place::Memory(_) => return Ok(()),
            Place::Rows { file, start, layout } => (file, *start, 4 * layout.columns),
            Place::Scratch(scratch) => (&scratch.file, 0, SCRATCH_BYTES),
        };
        block.bytes.resize(block.rays * row, 0);
        let found = read_exact_at(file, &mut block.bytes, start + first * row as u64);
        if found.is_err() {
            block.rays = 0;
        }
        found.map_err(|e| Error::new(&self.path, ErrorKind::Read(e)))
    }

    /// Returns the power of the `k`-th ray of a block that was read from this file; no number where the file was changed since.
    pub fn power(&self, block: &RayBlock, k: usize) -> f64 {
        let power = match &self.place {
            Place::Memory(rays) => rays[block.first as usize + k].power,
            Place::Rows { layout, .. } => f64::from(row_number(&block.bytes, k * layout.columns + layout.power)),
            Place::Scratch(_) => scratch_number(&block.bytes, k * SCRATCH_NUMBERS + 6),
        };
        power * self.scale
    }

    /// Returns the `k`-th ray of a block that was read from this file.
    ///
    /// # Errors
    /// When its numbers make no ray: the file was changed since it was opened.
    pub fn ray(&self, block: &RayBlock, k: usize) -> Result<LightRay, Error> {
        let mut ray = match &self.place {
            Place::Memory(rays) => rays[block.first as usize + k],
            Place::Rows { layout, .. } => {
                // Without a copy of the row: this is done for every ray that is drawn.
                let ray = layout.ray(|column| row_number(&block.bytes, k * layout.columns + column));
                ray.map_err(|m| Error::new(&self.path, ErrorKind::Malformed(format!("it was changed: {m}"))))?
            }
            Place::Scratch(_) => {
                let n = |c: usize| scratch_number(&block.bytes, k * SCRATCH_NUMBERS + c);
                LightRay {
                    origin: Point::new(n(0), n(1), n(2)),
                    direction: Vector::new(n(3), n(4), n(5)),
                    power: n(6),
                    wavelength_nm: Some(n(7)).filter(|nm| !nm.is_nan()),
                }
            }
        };
        ray.power *= self.scale;
        Ok(ray)
    }

    /// Reads all rays into memory.
    ///
    /// # Errors
    /// When the file cannot be read any more.
    pub fn into_set(self) -> Result<RaySet, Error> {
        let mut rays = Vec::with_capacity(self.rays as usize);
        let mut block = RayBlock::default();
        while (rays.len() as u64) < self.rays {
            self.read_block(rays.len() as u64, MOST_IN_MEMORY as usize, &mut block)?;
            for k in 0..block.len() {
                rays.push(self.ray(&block, k)?);
            }
        }
        Ok(RaySet { rays, flux: self.flux, spectrum: self.spectrum, notes: self.notes })
    }

    /// Scales the rays to the total flux that a header states, and adds a note, where they differ by more than rounding; does nothing where
    /// it states none, no positive finite one, or the rays are dark.
    pub(super) fn scale_to(&mut self, stated: Option<f64>) {
        let sum = self.sum;
        let Some(stated) = stated.filter(|s| *s > 0.0 && s.is_finite()) else { return };
        // Dark sets cannot be scaled, and differences of rounding should not be.
        if sum <= 0.0 || (sum / stated - 1.0).abs() <= TOTAL_ROUNDING {
            return;
        }
        self.scale = stated / sum;
        let unit = self.flux.unwrap_or(Flux::Radiant);
        self.notes.push(format!(
            "the header states {stated} {unit} but the rays add up to {sum}: they were scaled to the header"
        ));
    }

    /// Whether the rays were left on the disk.
    #[cfg(test)]
    pub(super) fn is_on_disk(&self) -> bool {
        !matches!(self.place, Place::Memory(_))
    }
}

/// The `place`-th little-endian f32 of some bytes.
fn row_number(bytes: &[u8], place: usize) -> f32 {
    f32::from_le_bytes(std::array::from_fn(|i| bytes[4 * place + i]))
}

/// The `place`-th little-endian f64 of some bytes.
fn scratch_number(bytes: &[u8], place: usize) -> f64 {
    f64::from_le_bytes(std::array::from_fn(|i| bytes[8 * place + i]))
}

/// Reads as many bytes as `bytes` has from a place of a file that several threads read at once.
#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], place: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, place)
}

/// Reads as many bytes as `bytes` has from a place of a file that several threads read at once.
#[cfg(not(unix))]
fn read_exact_at(mut file: &File, bytes: &mut [u8], place: u64) -> io::Result<()> {
    use std::io::{Read, Seek};
    // Threads share the place at which an open file stands.
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(|e| e.into_inner());
    file.seek(io::SeekFrom::Start(place))?;
    file.read_exact(bytes)
}

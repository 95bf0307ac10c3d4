//! The header of an IES TM-25 file, field by field in the order of the file (ANSI/IES TM-25, 4.7.1 to 4.7.6).

use super::bytes::ByteReader;
use crate::formats::Error;

/// The only version whose layout is public.
const VERSION: i32 = 2013;

/// Characters of each of the nine texts that describe the source (4.7.3).
const DESCRIPTION_CHARACTERS: usize = 1000;

/// Texts that describe the source: light source, manufacturer, creators of model and file, equipment, camera, operation, additional
/// information, reference.
const DESCRIPTIONS: usize = 9;

/// Bytes of the name of an additional column (4.7.5).
const COLUMN_NAME_BYTES: u64 = 512;

/// Multiple to which the spectral tables are padded together, bytes.
const PADDING: u64 = 32;

/// Columns that a file may have besides position and direction, and tables that it may list: more than any writer is known to make,
/// few enough that a damaged count takes no memory.
const MAX_ADDITIONAL: i32 = 1000;

/// How a file gives wavelengths (4.7.1.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpectralData {
    /// Not at all.
    None,
    /// One wavelength for all rays.
    Single,
    /// A wavelength per ray.
    PerRay,
    /// One table for all rays.
    Table,
    /// The number of a table per ray.
    TablePerRay,
}

/// Which columns follow position and direction (4.7.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tm25Columns {
    /// Radiant flux, W.
    pub radiant: bool,
    /// Wavelength, nm.
    pub wavelength: bool,
    /// Luminous flux, lm.
    pub luminous: bool,
    /// S1, S2, S3 and the direction of the polarisation ellipse: six columns.
    pub stokes: bool,
    /// X and Z: two columns.
    pub tristimulus: bool,
    /// Number of the spectral table, counted from 1.
    pub spectrum_index: bool,
}

/// Where columns stand in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ColumnPlaces {
    pub(super) radiant: Option<usize>,
    pub(super) wavelength: Option<usize>,
    pub(super) luminous: Option<usize>,
    pub(super) spectrum_index: Option<usize>,
    /// Columns of a row, position and direction counted.
    pub(super) count: usize,
}

impl Tm25Columns {
    /// Where the columns stand in a row, in the order of the file, with so many additional ones at the end; `None` for those that are
    /// absent.
    pub(super) fn places(self, additional: usize) -> ColumnPlaces {
        let mut count = 6;
        let mut place = |present: bool, width: usize| {
            let first = count;
            // Columns stand in this order, and those that are absent take no place.
            count += if present { width } else { 0 };
            present.then_some(first)
        };
        let radiant = place(self.radiant, 1);
        let wavelength = place(self.wavelength, 1);
        let luminous = place(self.luminous, 1);
        place(self.stokes, 6);
        place(self.tristimulus, 2);
        let spectrum_index = place(self.spectrum_index, 1);
        ColumnPlaces { radiant, wavelength, luminous, spectrum_index, count: count + additional }
    }
}

/// The header of a TM-25 file. Numbers keep the bits of the file, not-a-number included; texts are without their padding.
#[derive(Clone, Debug)]
pub struct Tm25Header {
    /// 0 by simulation, 1 by measurement; others are seen.
    pub creation: i32,
    /// Total luminous flux, lm; 0 or not a number where it is unknown.
    pub luminous_flux: f32,
    /// Total radiant flux, W; 0 or not a number where it is unknown.
    pub radiant_flux: f32,
    /// Number of rays.
    pub rays: u64,
    /// Date and time, as written.
    pub date: [u8; 28],
    /// Where rays start, 0 to 7 as the standard lists; 0 unknown.
    pub start_position: i32,
    /// How the file gives wavelengths.
    pub spectral: SpectralData,
    /// Wavelength of [`SpectralData::Single`], lowest and highest wavelength, nm.
    pub wavelengths: [f32; 3],
    /// Which columns a row has.
    pub columns: Tm25Columns,
    /// The nine texts that describe the source.
    pub descriptions: [String; DESCRIPTIONS],
    /// Spectral tables: pairs of nm and relative weight.
    pub spectra: Vec<Vec<[f32; 2]>>,
    /// Names of the additional columns.
    pub column_names: Vec<String>,
    /// The additional text.
    pub text: String,
    /// Bytes of the additional text in the file, a multiple of 32.
    pub(super) text_bytes: u64,
}

impl Tm25Header {
    /// A header for rays of a simulation, with nothing known but their number and columns.
    pub fn of_simulation(rays: u64, columns: Tm25Columns, spectral: SpectralData) -> Self {
        Self {
            creation: 0,
            luminous_flux: f32::NAN,
            radiant_flux: f32::NAN,
            rays,
            date: [0; 28],
            start_position: 0,
            spectral,
            wavelengths: [f32::NAN; 3],
            columns,
            descriptions: Default::default(),
            spectra: Vec::new(),
            column_names: Vec::new(),
            text: String::new(),
            text_bytes: 0,
        }
    }

    /// Where the columns of a row stand, additional ones counted.
    pub(super) fn places(&self) -> ColumnPlaces {
        self.columns.places(self.column_names.len())
    }

    /// Reads the header from the first byte of the file on and leaves the reader at the first ray. What the file leaves out and what is not
    /// kept goes to `notes`; an error for other versions, values that the standard does not know, and where the rays would not end with the
    /// file.
    pub(super) fn read(file: &mut ByteReader, notes: &mut Vec<String>) -> Result<Self, Error> {
        // The mark was read by whoever chose this reader; a caller that did not check gets the error here.
        if &file.read_array::<4>("the mark TM25")? != b"TM25" {
            return Err(file.malformed("not a TM-25 file"));
        }
        let version = file.read_i32("the version")?;
        if version != VERSION {
            let message = format!("version {version} of TM-25; the layout of {VERSION} alone is public and read");
            return Err(file.malformed(message));
        }
        let creation = file.read_i32("the method of creation")?;
        let luminous_flux = file.read_f32("the luminous flux")?;
        let radiant_flux = file.read_f32("the radiant flux")?;
        let rays = file.read_u64("the number of rays")?;
        let date = file.read_array("the date")?;
        let start_position = file.read_i32("the start position")?;
        let spectral = match file.read_i32("the spectral identifier")? {
            0 => SpectralData::None,
            1 => SpectralData::Single,
            2 => SpectralData::PerRay,
            3 => SpectralData::Table,
            4 => SpectralData::TablePerRay,
            other => {
                return Err(file.malformed(format!("spectral identifier {other} at byte 60; 0 to 4 are known")));
            }
        };
        let mut wavelengths = [0.0; 3];
        file.read_row(&mut wavelengths, "the wavelengths")?;
        let tables = read_count(file, "spectral tables")?;
        let additional = read_count(file, "additional columns")?;
        let text_bytes = file.read_i32("the size of the additional text")?;
        let text_bytes = u64::try_from(text_bytes)
            .map_err(|_| file.malformed(format!("an additional text of {text_bytes} bytes at byte 84")))?;
        // Room for later versions: what stands there is not understood, and would be lost in silence.
        if file.read_array::<168>("the reserved bytes")?.iter().any(|b| *b != 0) {
            notes.push("reserved bytes of the header are not zero; they are not kept".to_owned());
        }
        let columns = read_columns(file)?;
        let mut descriptions: [String; DESCRIPTIONS] = Default::default();
        for text in &mut descriptions {
            *text = utf32(&file.read_block(4 * DESCRIPTION_CHARACTERS as u64, "the description")?);
        }
        let spectra = read_spectra(file, tables)?;
        let mut header = Self {
            creation,
            luminous_flux,
            radiant_flux,
            rays,
            date,
            start_position,
            spectral,
            wavelengths,
            columns,
            descriptions,
            spectra,
            column_names: Vec::new(),
            text: String::new(),
            text_bytes,
        };
        // Before the names: their place follows from the columns, which must make sense by then.
        header.check().map_err(|m| file.malformed(m))?;
        header.read_names(file, additional, notes)?;
        header.text = utf32(&file.read_block(text_bytes, "the additional text")?);
        Ok(header)
    }

    /// Reads the names of the additional columns. Some vendors leave them out: then the rays start 512 bytes a column earlier, the names
    /// are empty and a note says so. An error where the rays do not end with the file.
    fn read_names(
        &mut self,
        file: &mut ByteReader,
        additional: usize,
        notes: &mut Vec<String>,
    ) -> Result<(), Error> {
        let row = 4 * self.columns.places(additional).count as u64;
        // Checked in 64 bits: the number of rays is the file's own word.
        let rays = self.rays.checked_mul(row).filter(|bytes| *bytes <= file.length());
        let rays = rays.ok_or_else(|| {
            file.malformed(format!(
                "{} rays of {row} bytes do not fit into a file of {} bytes; it was cut short",
                self.rays,
                file.length()
            ))
        })?;
        // The rays end with the file: where they start shows whether the names are present.
        let before_rays = file.length() - rays;
        let named = file.position() + COLUMN_NAME_BYTES * additional as u64 + self.text_bytes;
        let unnamed = file.position() + self.text_bytes;
        if additional > 0 && before_rays == unnamed {
            notes.push("the names of the additional columns are left out".to_owned());
            self.column_names = vec![String::new(); additional];
            return Ok(());
        }
        if before_rays != named {
            return Err(file.malformed(format!(
                "the header ends at byte {named}, but {} rays of {row} bytes at the end of the file start at byte {before_rays}",
                self.rays
            )));
        }
        for _ in 0..additional {
            self.column_names.push(utf32(&file.read_block(COLUMN_NAME_BYTES, "the name of a column")?));
        }
        Ok(())
    }

    /// Checks what the standard demands of identifiers, columns and tables; the error is for people.
    fn check(&self) -> Result<(), String> {
        let c = self.columns;
        let per_ray = matches!(self.spectral, SpectralData::PerRay | SpectralData::TablePerRay);
        let rules = [
            (c.radiant || c.luminous, "neither radiant nor luminous flux is among the columns"),
            // Wavelengths weigh power; lumens beside them would count the eye twice.
            (!per_ray || (c.radiant && !c.luminous), "wavelengths or tables per ray need the radiant flux alone"),
            (self.spectral != SpectralData::PerRay || c.wavelength, "the column of wavelengths is missing"),
            (
                (self.spectral == SpectralData::TablePerRay) == c.spectrum_index,
                "the column of spectral tables does not go with the spectral identifier",
            ),
            (!c.stokes || c.radiant, "Stokes vectors need the radiant flux"),
            (
                !c.tristimulus || (c.luminous && self.spectral == SpectralData::None),
                "tristimulus values need the luminous flux and no wavelengths",
            ),
            (self.spectral != SpectralData::Table || self.spectra.len() == 1, "one spectral table is needed"),
        ];
        if let Some((_, message)) = rules.iter().find(|(holds, _)| !holds) {
            return Err((*message).to_owned());
        }
        for (number, table) in self.spectra.iter().enumerate() {
            if let Some([nm, weight]) = table.iter().find(|[nm, w]| !(*nm > 0.0 && *w >= 0.0 && w.is_finite())) {
                return Err(format!("spectral table {}: weight {weight} at {nm} nm", number + 1));
            }
        }
        Ok(())
    }

    /// Encodes the header up to the first ray; texts longer than their fields are cut, reserved bytes are zero.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend(b"TM25");
        out.extend(VERSION.to_le_bytes());
        out.extend(self.creation.to_le_bytes());
        out.extend(self.luminous_flux.to_le_bytes());
        out.extend(self.radiant_flux.to_le_bytes());
        out.extend(self.rays.to_le_bytes());
        out.extend(self.date);
        out.extend(self.start_position.to_le_bytes());
        out.extend((self.spectral as i32).to_le_bytes());
        out.extend(self.wavelengths.iter().flat_map(|w| w.to_le_bytes()));
        out.extend((self.spectra.len() as i32).to_le_bytes());
        out.extend((self.column_names.len() as i32).to_le_bytes());
        // The size of a text that was read stays, so that a file is written back byte by byte.
        let text_bytes = self.text_bytes.max((4 * self.text.chars().count() as u64).next_multiple_of(PADDING));
        out.extend((text_bytes as i32).to_le_bytes());
        out.extend([0; 168]);
        let c = self.columns;
        // Position and direction are columns too, and always there.
        let flags = [true, true, c.radiant, c.wavelength, c.luminous, c.stokes, c.tristimulus, c.spectrum_index];
        out.extend(flags.iter().flat_map(|f| i32::from(*f).to_le_bytes()));
        for text in &self.descriptions {
            push_utf32(&mut out, text, 4 * DESCRIPTION_CHARACTERS);
        }
        let start = out.len();
        for table in &self.spectra {
            out.extend((table.len() as i32).to_le_bytes());
            out.extend(table.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        }
        // Tables are padded together, not one by one.
        out.resize(start + (out.len() - start).next_multiple_of(PADDING as usize), 0);
        for name in &self.column_names {
            push_utf32(&mut out, name, COLUMN_NAME_BYTES as usize);
        }
        push_utf32(&mut out, &self.text, text_bytes as usize);
        out
    }
}

/// Reads a count of the header that memory depends on, of what `of` says; an error if it is negative or beyond [`MAX_ADDITIONAL`].
fn read_count(file: &mut ByteReader, of: &str) -> Result<usize, Error> {
    let byte = file.position();
    let count = file.read_i32(of)?;
    if !(0..=MAX_ADDITIONAL).contains(&count) {
        return Err(file.malformed(format!("{count} {of} at byte {byte}; 0 to {MAX_ADDITIONAL} are read")));
    }
    Ok(count as usize)
}

/// Reads the eight flags of the columns that the rays have; an error for a flag beside 0 and 1, or without position and direction.
fn read_columns(file: &mut ByteReader) -> Result<Tm25Columns, Error> {
    let mut flags = [false; 8];
    for (number, flag) in flags.iter_mut().enumerate() {
        *flag = match file.read_i32("the flags of the columns")? {
            0 => false,
            1 => true,
            other => {
                return Err(file.malformed(format!("flag {} of the columns is {other}, not 0 or 1", number + 1)));
            }
        };
    }
    let [position, direction, radiant, wavelength, luminous, stokes, tristimulus, spectrum_index] = flags;
    if !position || !direction {
        return Err(file.malformed("its rays have no position or no direction"));
    }
    Ok(Tm25Columns { radiant, wavelength, luminous, stokes, tristimulus, spectrum_index })
}

/// Reads so many tables of wavelength, nm, and weight, and the padding behind them; an error where one is longer than what is left of the
/// file.
fn read_spectra(file: &mut ByteReader, tables: usize) -> Result<Vec<Vec<[f32; 2]>>, Error> {
    let start = file.position();
    let mut spectra = Vec::with_capacity(tables);
    for _ in 0..tables {
        let pairs = file.read_i32("the length of a spectral table")?;
        let pairs =
            u64::try_from(pairs).map_err(|_| file.malformed(format!("a spectral table of {pairs} pairs")))?;
        let block = file.read_block(8 * pairs, "a spectral table")?;
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        spectra.push(block.chunks_exact(8).map(|pair| [number(&pair[..4]), number(&pair[4..])]).collect());
    }
    // The padding counts from where the tables begin.
    let padding = (file.position() - start).next_multiple_of(PADDING) - (file.position() - start);
    file.read_block(padding, "the padding of the spectral tables")?;
    Ok(spectra)
}

/// Decodes little-endian UTF-32 up to the first NUL; what is no character becomes U+FFFD.
fn utf32(bytes: &[u8]) -> String {
    let codes = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    codes.take_while(|c| *c != 0).map(|c| char::from_u32(c).unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Adds a text in UTF-32 to `out` in exactly so many bytes, cut or padded with NUL.
fn push_utf32(out: &mut Vec<u8>, text: &str, bytes: usize) {
    let end = out.len() + bytes;
    out.extend(text.chars().take(bytes / 4).flat_map(|c| u32::from(c).to_le_bytes()));
    out.resize(end, 0);
}

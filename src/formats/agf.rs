//! Glass catalogues in AGF form, as glass makers publish them: one glass after the other, a line a fact.
//!
//! The lines that count here: `NM` opens a glass with its name and the number of its dispersion formula, `CD` holds the coefficients, `LD`
//! the wavelengths that they hold for, each `IT` an internal transmittance. Wavelengths are µm, thicknesses mm. Lines of any other kind are
//! passed over. Files come in UTF-8, UTF-16 and code pages of old systems.

use super::error::{Error, ErrorKind};
use super::input::read_bytes;
use std::path::Path;

/// A glass of a catalogue.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AgfGlass {
    /// Its name.
    pub name: String,
    /// Number of the dispersion formula: 1 Schott, 2 Sellmeier of three terms, and so on.
    pub formula: u32,
    /// Coefficients of the formula, λ in µm.
    pub coefficients: Vec<f64>,
    /// Lowest and highest wavelength that the formula holds for, µm; `None` where the file does not say.
    pub range_um: Option<[f64; 2]>,
    /// Internal transmittance: wavelength µm, share, thickness mm.
    pub transmittance: Vec<[f64; 3]>,
}

/// Micrometres to nanometres.
const NM_PER_UM: f64 = 1e3;

/// Wavelengths are stated in steps of a millionth of a nanometre: what is left of the conversion from decimals is rounded away.
const STEPS_PER_NM: f64 = 1e6;

impl AgfGlass {
    /// What a transmittance of 0 counts as: sheets print three decimals, so that 0 is anything below 5e-4, and Beer's law has no
    /// coefficient for none at all. A millionth is opaque in any figure of a run, and its logarithm not far from that of what can be
    /// measured.
    pub const LEAST_TRANSMITTANCE: f64 = 1e-6;

    /// Returns the wavelengths that the formula holds for, nm; `None` where the file does not say, or states an empty range.
    pub fn range_nm(&self) -> Option<[f64; 2]> {
        let range = self.range_um?.map(|um| (um * NM_PER_UM * STEPS_PER_NM).round() / STEPS_PER_NM);
        (range[0] < range[1]).then_some(range)
    }

    /// Absorption coefficients by wavelength, `[nm, 1/mm]`, wavelengths rising: Beer's law solved for them. Transmittances below
    /// [`LEAST_TRANSMITTANCE`](Self::LEAST_TRANSMITTANCE), 0 above all, count as that, those above 1 as 1. Of a wavelength that comes
    /// twice the first counts; one without a thickness is skipped.
    pub fn absorption(&self) -> Vec<[f64; 2]> {
        let known = self.transmittance.iter().filter(|[um, _, mm]| *um > 0.0 && *mm > 0.0);
        let coefficient = |share: f64, mm: f64| (-share.clamp(Self::LEAST_TRANSMITTANCE, 1.0).ln() / mm).max(0.0);
        let mut points: Vec<[f64; 2]> =
            known.map(|[um, share, mm]| [um * NM_PER_UM, coefficient(*share, *mm)]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points.dedup_by(|a, b| a[0] == b[0]);
        points
    }
}

/// Reads the glasses of a catalogue, in the file's order.
///
/// # Errors
/// When the file cannot be read, holds no glass, or has a line with a word in place of a finite number; the message names the line.
pub fn read_agf(path: &Path) -> Result<Vec<AgfGlass>, Error> {
    let bytes = read_bytes(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    let mut glasses: Vec<AgfGlass> = Vec::new();
    for (number, line) in decode_text(&bytes).lines().enumerate() {
        let mut words = line.split_whitespace();
        let Some(kind) = words.next() else { continue };
        let fault = |message: String| Error::at_line(path, number + 1, message);
        if kind == "NM" {
            let name = words.next().ok_or_else(|| fault("a glass without a name".into()))?;
            // The number is written as a real one by some; a word in its place becomes no number and is refused below.
            let formula = words.next().and_then(|w| w.parse::<f64>().ok()).unwrap_or(f64::NAN);
            if !(1.0..=99.0).contains(&formula) {
                return Err(fault(format!("{name} has no number of a dispersion formula")));
            }
            glasses.push(AgfGlass { name: name.into(), formula: formula as u32, ..AgfGlass::default() });
            continue;
        }
        // What stands before the first glass is about the catalogue.
        let Some(glass) = glasses.last_mut() else { continue };
        if !matches!(kind, "CD" | "LD" | "IT") {
            continue;
        }
        // A dash stands for a transmittance that was not measured.
        let numbers: Vec<f64> = words
            .filter(|w| *w != "-")
            .map(|w| {
                w.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| fault(format!("'{w}' is no number")))
            })
            .collect::<Result<_, _>>()?;
        match (kind, numbers.as_slice()) {
            ("CD", all) => glass.coefficients = all.to_vec(),
            ("LD", [low, high, ..]) => glass.range_um = Some([*low, *high]),
            ("IT", [um, share, mm, ..]) => glass.transmittance.push([*um, *share, *mm]),
            _ => {}
        }
    }
    if glasses.is_empty() {
        return Err(Error::new(path, ErrorKind::Malformed("it holds no glass: no line begins with NM".into())));
    }
    Ok(glasses)
}

/// Decodes a file by its byte order mark, as UTF-8 without one; bytes that are no character become U+FFFD, which stand in comments alone.
fn decode_text(bytes: &[u8]) -> String {
    let wide = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|c| unit([c[0], c[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)).into_owned(),
    }
}

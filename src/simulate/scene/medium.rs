//! The key `[[medium]]`: transparent media.

use super::{Key, Origin};
use crate::formats::{AgfGlass, read_agf};
use crate::optics::{self, Absorption, BulkScatter, Dispersion, Index, Pole, catalogue};
use crate::simulate::wavelength_text::wavelength_text;
use crate::simulate::{Error, ErrorKind};
use crate::text;
use serde::{Deserialize, Serialize};

/// A transparent medium, with exactly one of the ways to give its index.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Medium {
    /// Name that materials use.
    pub name: String,
    /// Refractive index, the same for every wavelength.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.1, max = 10)))]
    pub index: Option<f64>,
    /// Name in the catalogue: `N-BK7`, `PMMA`, `PC` and others that `lampyris media` lists; or in the one of `file`.
    pub catalogue: Option<String>,
    /// Glass catalogue in AGF form that `catalogue` is a name in, relative to the scene file; all its dispersion formulas but 4 are read.
    /// The glass absorbs by its internal transmittances there unless `absorption_per_mm` says otherwise.
    pub file: Option<String>,
    /// What the file says of the glass; filled in when the scene is read, `None` without a file.
    #[serde(skip)]
    pub(crate) glass: Option<AgfGlass>,
    /// Pairs `[B, C]` of `n² = 1 + Σ B λ²/(λ² − C)`, λ in µm, C in µm².
    pub sellmeier: Option<Vec<[f64; 2]>>,
    /// `[A, B, C, …]` of `n = A + B/λ² + C/λ⁴ + …`, λ in µm.
    pub cauchy: Option<Vec<f64>>,
    /// `[A0, …, A5]` of `n² = A0 + A1 λ² + A2 λ⁻² + A3 λ⁻⁴ + A4 λ⁻⁶ + A5 λ⁻⁸`, λ in µm.
    pub schott: Option<[f64; 6]>,
    /// Pairs `[nm, n]`, linear between.
    pub index_table: Option<Vec<[f64; 2]>>,
    /// Bulk absorption coefficient (natural logarithm), 1/mm: a number, or pairs `[nm, 1/mm]`.
    pub absorption_per_mm: Option<ByWavelength>,
    /// Scattering events per mm of way, at most 10 000: light does not scatter event by event over ways shorter than its wavelength.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 10_000)))]
    pub scatter_per_mm: Option<f64>,
    /// Mean cosine of the scattering angle (Henyey and Greenstein's g), in (−1, 1).
    pub anisotropy: Option<f64>,
}

/// A value, constant or by wavelength.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum ByWavelength {
    /// At every wavelength.
    Constant(f64),
    /// Pairs of wavelength in nm and value, linear between.
    Table(Vec<[f64; 2]>),
}

/// What the numbers of `sellmeier` are.
const SELLMEIER_ROWS: &str = "its rows are [B, C] with C in µm², the square of a resonance's wavelength";

impl Medium {
    /// Returns the medium in the form that the laws of light read.
    ///
    /// # Errors
    /// With the key that is wrong and what is wrong with it, as when there is not exactly one index.
    pub(crate) fn optics(&self) -> Result<optics::Medium, (&'static str, String)> {
        // Without a row its index is that of vacuum: glass that bends nothing, in silence.
        if self.sellmeier.as_ref().is_some_and(Vec::is_empty) {
            return Err(("sellmeier", format!("`sellmeier` is empty: {SELLMEIER_ROWS}")));
        }
        let points = |t: &[[f64; 2]]| t.iter().map(|p| (p[0], p[1])).collect::<Vec<_>>();
        let mut ways = Vec::new();
        ways.extend(self.index.map(Index::Constant));
        if let Some(name) = &self.catalogue {
            let index = match &self.glass {
                Some(glass) => agf_index(glass),
                None => catalogued(name).map(|medium| medium.index),
            };
            ways.push(index.map_err(|e| ("catalogue", e))?);
        }
        ways.extend(self.sellmeier.clone().map(Index::Sellmeier));
        ways.extend(self.cauchy.clone().map(Index::Cauchy));
        ways.extend(self.schott.map(Index::Schott));
        if let Some(t) = &self.index_table {
            ways.push(Index::table(points(t)).map_err(|e| ("index_table", e.to_string()))?);
        }
        // Two indices would leave open which one counts.
        if ways.len() != 1 {
            let given = if ways.is_empty() { "has no index".into() } else { format!("has {} indices", ways.len()) };
            return Err(("name", format!("'{}' {given}; give exactly one", self.name)));
        }
        let mut medium = optics::Medium::clear(self.name.clone(), ways.remove(0));
        medium.absorption = match &self.absorption_per_mm {
            None => self.glass.as_ref().map_or(Ok(Absorption::None), agf_absorption).map_err(|e| ("file", e))?,
            Some(ByWavelength::Constant(a)) => {
                Absorption::per_mm(*a).map_err(|e| ("absorption_per_mm", e.to_string()))?
            }
            Some(ByWavelength::Table(t)) => {
                Absorption::table(points(t)).map_err(|e| ("absorption_per_mm", e.to_string()))?
            }
        };
        if self.anisotropy.is_some() && self.scatter_per_mm.is_none() {
            return Err(("anisotropy", "`anisotropy` needs `scatter_per_mm`".into()));
        }
        // Scattering without a stated preference has none: g = 0 is isotropic.
        let g = self.anisotropy.unwrap_or(0.0);
        if !(g > -1.0 && g < 1.0) {
            return Err(("anisotropy", format!("an `anisotropy` of {g} is not above -1 and below 1")));
        }
        if let Some(s) = self.scatter_per_mm.filter(|s| *s != 0.0) {
            medium.scatter = Some(BulkScatter::new(s, g).map_err(|e| ("scatter_per_mm", e.to_string()))?);
        }
        Ok(medium)
    }

    /// Reads the glass from the catalogue file that the medium names; `None` where it names none. `index` is its place in the scene.
    ///
    /// # Errors
    /// When the file cannot be read, or has no glass of the name, which is compared in any case.
    pub(super) fn read_glass(&self, origin: &Origin, index: usize) -> Result<Option<AgfGlass>, Error> {
        let at = |key| [Key::Name("medium"), Key::Index(index), Key::Name(key)];
        let Some(file) = &self.file else { return Ok(None) };
        let Some(name) = &self.catalogue else {
            let message = "a catalogue's file needs the name of a glass in it";
            let error = origin.error(ErrorKind::Value, &at("file"), message);
            return Err(error.help("add `catalogue = \"N-SF6\"`, say"));
        };
        let all = read_agf(&origin.resolve(file))
            .map_err(|e| origin.error(ErrorKind::Unreadable, &at("file"), e.to_string()))?;
        // Makers write capitals, people do not.
        let Some(glass) = all.iter().find(|g| g.name.eq_ignore_ascii_case(name)) else {
            let message = format!("no glass of {file} is called '{name}'");
            let error = origin.error(ErrorKind::NoMatch, &at("catalogue"), message);
            let advice = text::did_you_mean(name, all.iter().map(|g| g.name.as_str()))
                .unwrap_or_else(|| format!("it has {} glasses, the first {}", all.len(), all[0].name));
            return Err(error.help(advice));
        };
        Ok(Some(glass.clone()))
    }

    /// Refuses a medium without a name, without exactly one index, with values that [`Medium::optics`] refuses, or with an index outside
    /// 0.1 to 10 at `wavelength_nm`, that of the run. The glass of a catalogue file must have been read: without, its name is looked up in
    /// the built-in catalogue. `index` is its place in the scene.
    pub(super) fn check(&self, origin: &Origin, index: usize, wavelength_nm: f64) -> Result<(), Error> {
        let at = |key| [Key::Name("medium"), Key::Index(index), Key::Name(key)];
        if self.name.is_empty() {
            return Err(origin.error(ErrorKind::Value, &at("name"), "this medium has no `name`"));
        }
        if self.index.is_some_and(|n| !Index::RANGE.contains(&n)) {
            return Err(origin.error(ErrorKind::Value, &at("index"), "`index` must be from 0.1 to 10"));
        }
        let medium = self.optics().map_err(|(key, e)| origin.error(ErrorKind::Value, &at(key), e))?;
        // A formula may leave the range where it is used, though its coefficients look well.
        let n = medium.index.value(wavelength_nm);
        let wavelength = wavelength_text(wavelength_nm);
        if !Index::RANGE.contains(&n) {
            let message = format!("the index of '{}' at {wavelength} is {n}, not from 0.1 to 10", self.name);
            let formulas = [
                ("cauchy", self.cauchy.is_some(), "it is `[A, B, C, …]` with B in µm², C in µm⁴ and so on"),
                ("schott", self.schott.is_some(), "its λ is in µm: A1 in µm⁻², A2 in µm² and so on"),
                ("sellmeier", self.sellmeier.is_some(), SELLMEIER_ROWS),
            ];
            let formula = formulas.into_iter().find(|(_, is_given, _)| *is_given);
            let error = origin.error(ErrorKind::Value, &at(formula.map_or("name", |(key, ..)| key)), message);
            // That of [run] is asked for also where all sources have spectra of their own, as in the infrared.
            let elsewhere =
                "where no light is of that wavelength, give `wavelength_nm` of [run] as one of the sources'";
            return Err(match formula {
                Some((_, _, advice)) => error.help(format!("{advice}; {elsewhere}")),
                None => error.help(elsewhere),
            });
        }
        // Constants in nm² leave nearly nothing of each term, with the wrong sign: no light would be bent, in silence.
        if self.sellmeier.is_some() && n < 1.0 {
            let message = format!("`sellmeier` gives an index of {n} at {wavelength}, below 1");
            let error = origin.error(ErrorKind::Value, &at("sellmeier"), message);
            return Err(error.help(SELLMEIER_ROWS));
        }
        Ok(())
    }
}

/// Returns the index of a glass by the formula of its catalogue (OpticStudio's numbers of them).
///
/// # Errors
/// For formula 4, whose last term programs write in two ways, and for numbers that mean none.
fn agf_index(glass: &AgfGlass) -> Result<Index, String> {
    /// Formulas of n² − 1 as a sum of `K λ²/(λ² − L)`: of three, four and five terms.
    const SELLMEIER: [(u32, usize); 3] = [(2, 3), (6, 4), (11, 5)];
    /// Exponents of λ in the extended formulas of n².
    const EXTENDED: [(u32, &[i32]); 3] = [
        (10, &[0, 2, -2, -4, -6, -8, -10, -12]),
        (12, &[0, 2, -2, -4, -6, -8, 4, 6]),
        (13, &[0, 2, 4, -2, -4, -6, -8, -10, -12]),
    ];
    /// The pole of Herzberger's formula, µm².
    const HERZBERGER: f64 = 0.028;
    let AgfGlass { name, formula, coefficients, .. } = glass;
    // Makers leave out the zeros at the end of a line.
    let coefficient = |k: usize| coefficients.get(k).copied().unwrap_or(0.0);
    if let Some((_, terms)) = SELLMEIER.iter().find(|(number, _)| number == formula) {
        let pairs = (0..*terms).map(|k| [coefficient(2 * k), coefficient(2 * k + 1)]);
        return Ok(Index::Sellmeier(pairs.filter(|[k, _]| *k != 0.0).collect()));
    }
    // Extended 2 adds powers to Schott's formula, which most of its glasses leave at 0.
    let is_schott = *formula == 1 || *formula == 12 && coefficient(6) == 0.0 && coefficient(7) == 0.0;
    if is_schott {
        return Ok(Index::Schott(std::array::from_fn(coefficient)));
    }
    if let Some((_, exponents)) = EXTENDED.iter().find(|(number, _)| number == formula) {
        let powers = exponents.iter().enumerate().map(|(k, exponent)| (coefficient(k), 2 * exponent)).collect();
        return Ok(Index::Sum(Dispersion { is_square: true, powers, poles: Vec::new() }));
    }
    let [a, b, c, d, e, f] = std::array::from_fn(coefficient);
    let pole = |strength: f64, power: i32, at: f64| Pole { strength, power, at, order: 1 };
    let (is_square, powers, poles) = match formula {
        // Herzberger: n = A + B L + C L² + D λ² + E λ⁴ + F λ⁶ with L = 1/(λ² − 0.028).
        3 => {
            let second = Pole { order: 2, ..pole(c, 0, HERZBERGER) };
            (false, vec![(a, 0), (d, 4), (e, 8), (f, 12)], vec![pole(b, 0, HERZBERGER), second])
        }
        // Conrady: n = A + B/λ + C/λ^3.5.
        5 => (false, vec![(a, 0), (b, -2), (c, -7)], Vec::new()),
        // Handbook of Optics: n² = A + B/(λ² − C) − D λ², and with B λ² in place of B.
        7 => (true, vec![(a, 0), (-d, 4)], vec![pole(b, 0, c)]),
        8 => (true, vec![(a, 0), (-d, 4)], vec![pole(b, 2, c)]),
        // Sellmeier 4: n² = A + B λ²/(λ² − C) + D λ²/(λ² − E).
        9 => (true, vec![(a, 0)], vec![pole(b, 2, c), pole(d, 2, e)]),
        _ => {
            return Err(format!(
                "'{name}' has dispersion formula {formula}; 1 to 3 and 5 to 13 are read: give its `index_table`"
            ));
        }
    };
    Ok(Index::Sum(Dispersion { is_square, powers, poles }))
}

/// Returns the absorption of a glass from its transmittances: none where none is known, and of a single one the same everywhere.
fn agf_absorption(glass: &AgfGlass) -> Result<Absorption, String> {
    let absorption = match glass.absorption()[..] {
        [] => Ok(Absorption::None),
        [[_, coefficient]] => Absorption::per_mm(coefficient),
        ref points => Absorption::table(points.iter().map(|p| (p[0], p[1]))),
    };
    absorption.map_err(|e| e.to_string())
}

/// Returns a medium of the built-in catalogue.
///
/// # Errors
/// With the nearest name, or all there are, when there is none of this name.
fn catalogued(name: &str) -> Result<optics::Medium, String> {
    catalogue::medium(name).ok_or_else(|| {
        let names: Vec<&str> = catalogue::names().collect();
        let advice = text::did_you_mean(name, names.iter().copied())
            .unwrap_or_else(|| format!("there are: {}", names.join(", ")));
        format!("no medium of the catalogue is called '{name}'; {advice}")
    })
}

/// Returns the medium of a name, of the scene's `media` before the catalogue; `at` is where the name stands, for messages.
///
/// # Errors
/// When there is none of this name, or its index or absorption is wrong.
pub(crate) fn find(media: &[Medium], name: &str, origin: &Origin, at: &[Key<'_>]) -> Result<optics::Medium, Error> {
    // Names of the scene come before those of the catalogue, so that a scene may have a glass of its own.
    if let Some(m) = media.iter().find(|m| m.name == name) {
        return m.optics().map_err(|(_, e)| origin.error(ErrorKind::Value, at, e));
    }
    if let Ok(m) = catalogued(name) {
        return Ok(m);
    }
    let error = origin.error(ErrorKind::NoMatch, at, format!("no medium is called '{name}'"));
    let mut known: Vec<&str> = catalogue::names().collect();
    known.extend(media.iter().map(|m| m.name.as_str()));
    Err(error.help(text::did_you_mean(name, known).unwrap_or_else(|| {
        format!(
            "`lampyris media` lists the catalogue; others are described: [[medium]] with name = \"{name}\" and an `index`, or the `file` of a \
             maker's catalogue"
        )
    })))
}

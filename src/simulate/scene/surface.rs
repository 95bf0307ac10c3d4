//! Materials in the form that the laws of light read: coatings and scatter.

use super::{Key, LobeKind, Material, Medium, Origin, Reflectance, SurfaceOptics, medium};
use crate::optics::fresnel::PowerShares;
use crate::optics::{Abg, Coating, CoatingTable, Lobe, Scatter, Split};
use crate::simulate::{Error, ErrorKind};
use crate::text::typed_number;

/// Sum of both parts of a complex index above which a slip of the decimal point is meant.
const LARGEST_INDEX: f64 = 1e3;

/// Largest standard deviation of a Gaussian lobe, degrees: half a turn, beyond which a slip of the decimal point is meant.
const WIDEST_LOBE_DEG: f64 = 180.0;

impl Material {
    /// Returns the surface as a coating and a scatter; bare where only a medium is given, and without any share for an absorber.
    ///
    /// # Errors
    /// With the key that is wrong, and what is wrong with it.
    pub(crate) fn optics(&self) -> Result<(Coating, Option<Scatter>), (&'static str, String)> {
        // A boundary that says only its medium is a bare one.
        let kind = self.surface.unwrap_or(SurfaceOptics::Interface);
        let coating = match kind {
            SurfaceOptics::Absorber => Coating::ideal(0.0, 0.0).map_err(|e| ("surface", e.to_string())),
            SurfaceOptics::Interface => Ok(Coating::Bare),
            SurfaceOptics::Metal => match self.metal {
                Some([n, k]) if n > 0.0 && k >= 0.0 && n + k < LARGEST_INDEX => Ok(Coating::Metal { n, k }),
                _ => Err((
                    "metal",
                    "a metal needs `metal = [n, k]`, n above 0 and k 0 or more (n + i k), both together below 1000"
                        .into(),
                )),
            },
            SurfaceOptics::Mirror | SurfaceOptics::Diffuse => reflector(self.reflectance.as_ref(), 1.0, 0.0),
            SurfaceOptics::Coating => match &self.coating {
                Some(rows) => coating_from_rows(rows).map_err(|e| ("coating", format!("in `coating`: {e}"))),
                // A coating passes only what it says that it passes; the rest is absorbed.
                None => reflector(self.reflectance.as_ref(), 0.0, self.transmittance.unwrap_or(0.0)),
            },
        }?;
        // The values first: a wrong reflectance is a better message than a key that does not belong.
        self.check_keys(kind)?;
        let scatter = match kind {
            SurfaceOptics::Diffuse => Some(Scatter { share: 1.0, lobe: Lobe::Lambertian }),
            _ => self.scatter().map_err(|e| ("scatter", e))?,
        };
        Ok((coating, scatter))
    }

    /// Checks that every key given belongs to this kind of surface.
    ///
    /// # Errors
    /// With the first that does not.
    fn check_keys(&self, kind: SurfaceOptics) -> Result<(), (&'static str, String)> {
        let mirror = matches!(kind, SurfaceOptics::Mirror | SurfaceOptics::Diffuse);
        let coated = kind == SurfaceOptics::Coating;
        let scatters = !matches!(kind, SurfaceOptics::Diffuse | SurfaceOptics::Absorber);
        // One table for all kinds: a key that is not checked here would be ignored in silence.
        let keys = [
            ("reflectance", self.reflectance.is_some(), mirror || coated, "`surface` mirror, diffuse or coating"),
            ("transmittance", self.transmittance.is_some(), coated, "`surface = \"coating\"`"),
            ("coating", self.coating.is_some(), coated, "`surface = \"coating\"`"),
            ("metal", self.metal.is_some(), kind == SurfaceOptics::Metal, "`surface = \"metal\"`"),
            ("scatter", self.scatter.is_some(), scatters, "a surface that is neither diffuse nor black"),
        ];
        if let Some((key, _, _, owner)) = keys.into_iter().find(|(_, given, allowed, _)| *given && !allowed) {
            return Err((key, format!("`{key}` belongs to {owner}")));
        }
        // The rows give both shares at every angle and wavelength that they have.
        let shares = [("reflectance", self.reflectance.is_some()), ("transmittance", self.transmittance.is_some())];
        match shares.into_iter().find(|(_, given)| *given && self.coating.is_some()) {
            Some((key, _)) => Err((
                key,
                format!("the rows of `coating` say the {key} already: leave out `{key}`, or leave out `coating`"),
            )),
            None => Ok(()),
        }
    }

    /// Returns the scattering that is asked for; `None` where none is.
    ///
    /// # Errors
    /// When the lobe has not just the parameters that it needs.
    fn scatter(&self) -> Result<Option<Scatter>, String> {
        let Some(s) = &self.scatter else { return Ok(None) };
        let lobe = match (s.lobe, s.sigma_deg, s.exponent, s.abg) {
            (LobeKind::Lambertian, None, None, None) => Lobe::Lambertian,
            (LobeKind::Gaussian, Some(sigma), None, None) if sigma > 0.0 && sigma <= WIDEST_LOBE_DEG => {
                Lobe::Gaussian { sigma: sigma.to_radians() }
            }
            // In the unit in which it is written.
            (LobeKind::Gaussian, Some(sigma), None, None) => {
                let sigma = typed_number(sigma);
                return Err(format!("`sigma_deg` is {sigma}, but must be above 0 and at most {WIDEST_LOBE_DEG}"));
            }
            (LobeKind::Cosine, None, Some(exponent), None) => Lobe::Cosine { exponent },
            (LobeKind::Abg, None, None, Some([a, b, g])) => {
                Lobe::Abg(Abg::new(a, b, g).map_err(|e| e.to_string())?)
            }
            // The lobe is known, so what is wrong are its parameters.
            (LobeKind::Lambertian, ..) => return Err("a lambertian lobe has no parameters".into()),
            (LobeKind::Gaussian, ..) => {
                return Err("a gaussian lobe needs `sigma_deg`, and has nothing else".into());
            }
            (LobeKind::Cosine, ..) => return Err("a cosine lobe needs `exponent`, and has nothing else".into()),
            (LobeKind::Abg, ..) => return Err("an abg lobe needs `abg = [A, B, g]`, and has nothing else".into()),
        };
        Scatter::new(s.share.unwrap_or(1.0), lobe).map(Some).map_err(|e| e.to_string())
    }

    /// Refuses a material that says nothing, selects twice, has values that do not go together, or names a colour that is none or a medium
    /// that is neither one of `media` nor of the catalogue; `index` is its place in the scene.
    pub(super) fn check(&self, origin: &Origin, index: usize, media: &[Medium]) -> Result<(), Error> {
        let at = |key| [Key::Name("material"), Key::Index(index), Key::Name(key)];
        if let Some(name) = &self.medium {
            medium::find(media, name, origin, &at("medium"))?;
        }
        if self.medium.is_none() && self.surface.is_none() && self.scatter.is_none() {
            let message = "this material says neither `medium` nor `surface`";
            return Err(origin.error(ErrorKind::Value, &at(""), message).help("add one of them"));
        }
        self.optics().map_err(|(key, message)| origin.error(ErrorKind::Value, &at(key), message))?;
        if self.selects_twice() {
            let error = origin.error(ErrorKind::Value, &at("on"), "this rule has `on` and selectors beside it");
            return Err(error.help("put all of them into `on`"));
        }
        if let Some(colour) = &self.colour {
            colour.check(origin, &at("colour"))?;
        }
        Ok(())
    }
}

/// Makes the coating of a reflectance, `unset` where the scene gives none, and a transmittance that is the same everywhere.
///
/// # Errors
/// With the key they belong to.
fn reflector(r: Option<&Reflectance>, unset: f64, transmittance: f64) -> Result<Coating, (&'static str, String)> {
    let same = |r: f64| Split {
        reflected: PowerShares { rs: r, rp: r },
        transmitted: PowerShares { rs: transmittance, rp: transmittance },
    };
    match r {
        None => Coating::ideal(unset, transmittance).map_err(|e| ("transmittance", e.to_string())),
        Some(Reflectance::Constant(r)) => {
            // A reflectance that would do by itself is not what is wrong.
            let wrong = if Coating::ideal(*r, 0.0).is_ok() { "transmittance" } else { "reflectance" };
            Coating::ideal(*r, transmittance).map_err(|e| (wrong, e.to_string()))
        }
        Some(Reflectance::ByAngle(t)) => {
            let (angles, cells) = t.iter().map(|[a, r]| (*a, same(*r))).unzip();
            // One column: a table without wavelengths holds for all, and which one it names does not matter.
            CoatingTable::new(angles, vec![550.0], cells)
                .map(Coating::Table)
                .map_err(|e| ("reflectance", format!("in `reflectance`: {e}")))
        }
        Some(Reflectance::ByAngleAndWavelength(t)) => {
            coating_from_grid(t.iter().map(|[a, nm, r]| ([*a, *nm], same(*r))))
                .map_err(|e| ("reflectance", format!("in `reflectance`: {e}")))
        }
    }
}

/// Makes a coating from rows of angle (degrees), wavelength (nm), R, T or of angle, wavelength, Rs, Rp, Ts, Tp.
///
/// # Errors
/// When a row has another length, or they make no full grid.
fn coating_from_rows(rows: &[Vec<f64>]) -> Result<Coating, String> {
    let cells = rows.iter().map(|row| match row[..] {
        [a, nm, r, t] => Ok((
            [a, nm],
            Split { reflected: PowerShares { rs: r, rp: r }, transmitted: PowerShares { rs: t, rp: t } },
        )),
        [a, nm, rs, rp, ts, tp] => {
            Ok(([a, nm], Split { reflected: PowerShares { rs, rp }, transmitted: PowerShares { rs: ts, rp: tp } }))
        }
        _ => Err(format!("a row has {} numbers, not 4 or 6", row.len())),
    });
    coating_from_grid(cells.collect::<Result<Vec<_>, _>>()?.into_iter())
}

/// Makes a coating from rows of (angle in degrees, wavelength in nm) that make a full grid, wavelengths fastest.
///
/// # Errors
/// When they do not, or their shares are out of range.
fn coating_from_grid(rows: impl Iterator<Item = ([f64; 2], Split)>) -> Result<Coating, String> {
    let (keys, cells): (Vec<[f64; 2]>, Vec<Split>) = rows.unzip();
    let first = keys.first().ok_or("the table is empty")?[0];
    // The first angle's rows give the wavelengths; the rest must repeat them.
    let columns = keys.iter().take_while(|k| k[0] == first).count();
    let nm: Vec<f64> = keys[..columns].iter().map(|k| k[1]).collect();
    let angles: Vec<f64> = keys.iter().step_by(columns).map(|k| k[0]).collect();
    let full = keys.iter().enumerate().all(|(i, k)| *k == [angles[i / columns], nm[i % columns]]);
    // Without this a missing row would shift all that follow.
    if !full || keys.len() != angles.len() * nm.len() {
        return Err("the rows are no full grid of angles and wavelengths, wavelengths fastest".into());
    }
    CoatingTable::new(angles, nm, cells).map(Coating::Table).map_err(|e| e.to_string())
}

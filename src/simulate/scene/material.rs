use super::{Key, Scene, suggest};
use crate::simulate::{Error, ErrorKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A CAD file and where it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ModelUse {
    /// STEP file, relative to the scene file.
    pub file: String,
    /// Put before the names of its instances, as `name/instance`, when several models are used.
    pub name: String,
    /// Millimetres per length unit of the file, for files whose unit is wrong; the file's own unit otherwise.
    pub unit_mm: Option<f64>,
    /// Where it stands.
    pub placement: Placement,
}

/// A placement: scale, then turn, then shift.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Placement {
    /// Where the file's origin comes to stand, mm.
    pub at: [f64; 3],
    /// Where the file's z axis points.
    pub z: [f64; 3],
    /// Where the file's x axis points, as far as `z` lets it.
    pub x: Option<[f64; 3]>,
    /// Enlargement.
    pub scale: f64,
}

impl Default for Placement {
    fn default() -> Self {
        Self { at: [0.0; 3], z: [0.0, 0.0, 1.0], x: None, scale: 1.0 }
    }
}

/// One value or a list of them.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrMany<T> {
    /// One.
    One(T),
    /// Several.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// All values.
    pub fn as_slice(&self) -> &[T] {
        match self {
            Self::One(x) => std::slice::from_ref(x),
            Self::Many(xs) => xs,
        }
    }
}

/// A transparent medium. Exactly one of the ways to give the index.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Medium {
    /// Name that materials use.
    pub name: String,
    /// Refractive index, the same for every wavelength.
    pub index: Option<f64>,
    /// Bulk absorption coefficient, 1/mm.
    pub absorption_per_mm: f64,
}

/// What the faces that a rule selects are made of. All selectors that are given must hold; `*` in a name stands for anything.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Name of the part.
    pub part: Option<OneOrMany<String>>,
    /// Name of the instance.
    pub instance: Option<OneOrMany<String>>,
    /// Name of the face.
    pub face: Option<OneOrMany<String>>,
    /// Colour that the face shows, red, green, blue in `[0, 1]` or `"#rrggbb"`.
    pub colour: Option<ColourKey>,
    /// `#id` of the face in the STEP file.
    pub entity: Option<OneOrMany<u64>>,
    /// The face nearest to each of these points, mm.
    pub at: Option<OneOrMany<[f64; 3]>>,
    /// Name of the medium inside; its faces become interfaces unless `surface` says otherwise.
    pub medium: Option<String>,
    /// What happens at the surface.
    pub surface: Option<SurfaceKind>,
    /// Share of the power that is reflected, constant or `[[angle_deg, share], …]`; 1 for a mirror unless said otherwise.
    pub reflectance: Option<Reflectance>,
}

/// A colour as three numbers or as `#rrggbb`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ColourKey {
    /// Red, green, blue in `[0, 1]`.
    Rgb([f64; 3]),
    /// `#rrggbb`.
    Hex(String),
}

impl ColourKey {
    /// As three numbers, when it is a colour.
    pub fn rgb(&self) -> Option<[f64; 3]> {
        match self {
            Self::Rgb(c) => Some(*c),
            Self::Hex(s) => {
                let hex = s.strip_prefix('#').filter(|h| h.len() == 6 && h.is_ascii())?;
                let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).ok().map(|b| f64::from(b) / 255.0);
                Some([byte(0)?, byte(2)?, byte(4)?])
            }
        }
    }
}

/// A share of power, constant or by angle of incidence.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Reflectance {
    /// At every angle.
    Constant(f64),
    /// Pairs of angle of incidence in degrees and share, by rising angle; linear between.
    ByAngle(Vec<[f64; 2]>),
}

/// What happens to light at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SurfaceKind {
    /// Light ends here.
    #[default]
    Absorber,
    /// Specular reflection of the share `reflectance`; the rest is absorbed.
    Mirror,
    /// The bare boundary of a medium: refraction and Fresnel reflection.
    Interface,
}

pub(super) fn check(scene: &Scene) -> Result<(), Error> {
    for (i, m) in scene.media.iter().enumerate() {
        let at = |key| [Key::Name("medium"), Key::Index(i), Key::Name(key)];
        if m.name.is_empty() {
            return Err(scene.error(ErrorKind::Value, &at("name"), "this medium has no `name`"));
        }
        if scene.media[..i].iter().any(|o| o.name == m.name) {
            return Err(scene.error(ErrorKind::Value, &at("name"), format!("two media are called '{}'", m.name)));
        }
        match m.index {
            Some(n) if (0.1..=10.0).contains(&n) => {}
            Some(n) => {
                return Err(scene.error(ErrorKind::Value, &at("index"), format!("index {n} is not in 0.1 to 10")));
            }
            None => {
                return Err(scene.error(ErrorKind::Value, &at("name"), format!("'{}' has no index", m.name)));
            }
        }
        if m.absorption_per_mm.is_nan() || m.absorption_per_mm < 0.0 {
            let message = "`absorption_per_mm` must be 0 or more";
            return Err(scene.error(ErrorKind::Value, &at("absorption_per_mm"), message));
        }
    }
    if let Some(name) = &scene.ambient {
        known_medium(scene, name, &[Key::Name("ambient")])?;
    }
    for (i, m) in scene.materials.iter().enumerate() {
        let at = |key| [Key::Name("material"), Key::Index(i), Key::Name(key)];
        if let Some(name) = &m.medium {
            known_medium(scene, name, &at("medium"))?;
        }
        if m.medium.is_none() && m.surface.is_none() {
            let error = scene.error(ErrorKind::Value, &at(""), "this material says neither `medium` nor `surface`");
            return Err(error.help("add one of them"));
        }
        if let Some(r) = &m.reflectance {
            r.check().map_err(|e| scene.error(ErrorKind::Value, &at("reflectance"), e))?;
            if m.surface != Some(SurfaceKind::Mirror) {
                let error = scene.error(ErrorKind::Value, &at("reflectance"), "`reflectance` belongs to a mirror");
                return Err(error.help("add `surface = \"mirror\"`"));
            }
        }
        if m.colour.as_ref().is_some_and(|c| c.rgb().is_none()) {
            return Err(scene
                .error(ErrorKind::Value, &at("colour"), "not a colour")
                .help("write \"#rrggbb\" or [r, g, b]"));
        }
    }
    Ok(())
}

fn known_medium(scene: &Scene, name: &str, at: &[Key<'_>]) -> Result<(), Error> {
    if scene.media.iter().any(|m| m.name == name) {
        return Ok(());
    }
    let error = scene.error(ErrorKind::NoMatch, at, format!("no medium is called '{name}'"));
    Err(match suggest::nearest(name, scene.media.iter().map(|m| m.name.as_str())) {
        Some(near) => error.help(format!("did you mean '{near}'?")),
        None => error.help("add a [[medium]] of that name"),
    })
}

impl Reflectance {
    fn check(&self) -> Result<(), String> {
        let share = |r: f64| (0.0..=1.0).contains(&r);
        match self {
            Self::Constant(r) if share(*r) => Ok(()),
            Self::Constant(r) => Err(format!("a share of {r} is not in 0 to 1")),
            Self::ByAngle(t) if t.is_empty() => Err("the table is empty".into()),
            Self::ByAngle(t) if !t.iter().all(|[a, r]| share(*r) && (0.0..=90.0).contains(a)) => {
                Err("angles must be from 0 to 90 and shares from 0 to 1".into())
            }
            Self::ByAngle(t) if !t.windows(2).all(|w| w[0][0] < w[1][0]) => Err("angles must rise".into()),
            Self::ByAngle(_) => Ok(()),
        }
    }
}

//! Which faces of a model a rule means: by names, numbers, looks, figures and places.

use super::{Key, Origin};
use crate::formats::printable_toml;
use crate::simulate::{Error, ErrorKind};
use serde::{Deserialize, Serialize};

/// One value or a list of them.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum OneOrMany<T> {
    /// One.
    One(T),
    /// Several.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// Returns all values; a list may be empty.
    pub fn as_slice(&self) -> &[T] {
        match self {
            Self::One(x) => std::slice::from_ref(x),
            Self::Many(xs) => xs,
        }
    }
}

/// A solid by its number in the part, or by its name.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum SolidKey {
    /// From 0, in the file's order; ready meshes are one more solid behind the others.
    Number(usize),
    /// The solid's name; `*` stands for anything.
    Name(String),
}

/// Faces of a model. All selectors that are given must hold, each by one of its values where it is a list; `*` in a name stands for
/// anything.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct FaceSelector {
    /// Name of the part.
    pub part: Option<OneOrMany<String>>,
    /// Name of the instance, or its path through the assembly, as `left/led`; `lampyris info FILE --faces` shows both.
    pub instance: Option<OneOrMany<String>>,
    /// Number of the solid in its part, from 0 as `lampyris info FILE --faces` counts, or its name.
    pub solid: Option<OneOrMany<SolidKey>>,
    /// Name of the face.
    pub face: Option<OneOrMany<String>>,
    /// Layer of the face, or of the solid that it belongs to.
    pub layer: Option<OneOrMany<String>>,
    /// Colour that the face shows, red, green, blue in `[0, 1]` or `"#rrggbb"`.
    pub colour: Option<ColourKey>,
    /// Kind of surface: `plane`, `cylinder`, `cone`, `sphere`, `torus`, `revolution`, `extrusion`, `offset`, `bspline`, `rational`,
    /// `tessellated` or `other`.
    pub kind: Option<OneOrMany<String>>,
    /// Radius of a cylinder or sphere, or of a torus' tube, where it stands, mm; within a share of 1e-4.
    pub radius_mm: Option<OneOrMany<f64>>,
    /// `#id` of the face in the STEP file.
    pub entity: Option<OneOrMany<u64>>,
    /// The face nearest to each of these points, mm.
    pub at: Option<OneOrMany<[f64; 3]>>,
}

impl FaceSelector {
    /// Writes it as the key `on` of a rule, source or receiver: `on = { part = "led", entity = 12 }`.
    pub fn as_key(&self) -> String {
        format!("on = {{ {self} }}")
    }
}

/// A colour as three numbers or as `#rrggbb`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum ColourKey {
    /// Red, green, blue in `[0, 1]`.
    Rgb([f64; 3]),
    /// `#rrggbb`.
    Hex(String),
}

impl ColourKey {
    /// Refuses a colour that is none; `at` is its place in the scene.
    pub(crate) fn check(&self, origin: &Origin, at: &[Key<'_>]) -> Result<(), Error> {
        if self.rgb().is_some() {
            return Ok(());
        }
        let error = origin.error(ErrorKind::Value, at, "not a colour");
        Err(error.help("write \"#rrggbb\", or shares of red, green and blue from 0 to 1, as in [0.8, 0.1, 0]"))
    }

    /// Returns it as red, green, blue; `None` for a text that is no `#rrggbb`, and for numbers beyond 0 and 1.
    pub fn rgb(&self) -> Option<[f64; 3]> {
        match self {
            Self::Rgb(c) => c.iter().all(|x| (0.0..=1.0).contains(x)).then_some(*c),
            Self::Hex(s) => {
                // Six ASCII digits: slicing by bytes would else split a character.
                let hex = s.strip_prefix('#').filter(|h| h.len() == 6 && h.is_ascii())?;
                let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).ok().map(|b| f64::from(b) / 255.0);
                Some([byte(0)?, byte(2)?, byte(4)?])
            }
        }
    }
}

/// As the inside of an inline table of a scene file: `part = "led", entity = 12`.
///
/// ```
/// use lampyris::simulate::scene::{FaceSelector, OneOrMany};
/// let part = Some(OneOrMany::One("led \"2\"".to_owned()));
/// let selector = FaceSelector { part, entity: Some(OneOrMany::One(12)), ..FaceSelector::default() };
/// assert_eq!(selector.to_string(), r#"part = "led \"2\"", entity = 12"#);
/// ```
impl std::fmt::Display for FaceSelector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let keys = [
            ("part", toml_text(&self.part)),
            ("instance", toml_text(&self.instance)),
            ("solid", toml_text(&self.solid)),
            ("face", toml_text(&self.face)),
            ("layer", toml_text(&self.layer)),
            ("colour", toml_text(&self.colour)),
            ("kind", toml_text(&self.kind)),
            ("radius_mm", toml_text(&self.radius_mm)),
            ("entity", toml_text(&self.entity)),
            ("at", toml_text(&self.at)),
        ];
        let given: Vec<String> =
            keys.into_iter().filter_map(|(key, text)| Some(format!("{key} = {}", text?))).collect();
        f.write_str(&given.join(", "))
    }
}

/// Writes a value as TOML takes it; `None` for none.
fn toml_text<T: Serialize>(value: &Option<T>) -> Option<String> {
    serde_json::to_string(value.as_ref()?).ok().map(printable_toml)
}

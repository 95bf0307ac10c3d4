//! The keys `[[model]]` and `[[material]]`: CAD files, and what their faces are made of.

use super::selector::{ColourKey, FaceSelector, OneOrMany, SolidKey};
use super::{Key, Origin};
use crate::simulate::{Error, ErrorKind};
use serde::{Deserialize, Serialize};

/// A CAD file and where it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct ModelUse {
    /// STEP file, relative to the scene file.
    pub file: String,
    /// Put before the names of its instances, as `name/instance`.
    pub name: String,
    /// Millimetres per length unit of the file, for files whose unit is wrong; the file's own unit otherwise.
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-9, max = 1e6)))]
    pub unit_mm: Option<f64>,
    /// Most products and shapes that the file's assemblies may place; beyond it the file is refused. A million unless given.
    pub max_placed: Option<u64>,
    /// Where it stands.
    pub placement: Placement,
    /// Faces that are left out, as if the file did not hold them: a list of selectors, as `[{ part = "helper*" }, { solid = 1 }]`, by the
    /// names, numbers and places of the file itself, as `lampyris info FILE --faces` shows them.
    pub without: Vec<FaceSelector>,
}

/// Farthest coordinate of a placement, mm. There a place is known to 15 nm, and a hit to as much: a thousandth of the finest facets.
const FARTHEST_PLACE: f64 = 1e11;
/// Units of files, mm, and scales of placements: from a picometre to a kilometre.
const SCALES: std::ops::RangeInclusive<f64> = 1e-9..=1e6;

impl ModelUse {
    /// Refuses a model without a file, or with a placement or unit that is no number or out of range; `index` is its place in the scene.
    pub(super) fn check(&self, origin: &Origin, index: usize) -> Result<(), Error> {
        let fail = |keys: &[&str], message: &str| {
            let mut at = vec![Key::Name("model"), Key::Index(index)];
            at.extend(keys.iter().map(|k| Key::Name(k)));
            Err(origin.error(ErrorKind::Value, &at, message.to_owned()))
        };
        let finite = |x: &[f64]| x.iter().all(|x| x.is_finite());
        let direction = |x: &[f64; 3]| finite(x) && x.iter().any(|x| *x != 0.0);
        let p = &self.placement;
        match self {
            m if m.file.is_empty() => {
                fail(&["file"], "this model has no `file`: give the STEP file, relative to the scene")
            }
            _ if !finite(&p.at) => fail(&["placement", "at"], "`at` must be a point"),
            _ if p.at.iter().any(|x| x.abs() > FARTHEST_PLACE) => {
                let message =
                    "`at` must lie within 1e11 mm of the origin: farther out, places are rounded by 15 nm and more";
                fail(&["placement", "at"], message)
            }
            _ if !direction(&p.z) => fail(&["placement", "z"], "`z` must be a direction"),
            _ if p.x.is_some_and(|x| !direction(&x)) => fail(&["placement", "x"], "`x` must be a direction"),
            m if m.unit_mm.is_some_and(|u| !SCALES.contains(&u)) => {
                fail(&["unit_mm"], "`unit_mm` must be a length from 1e-9 to 1e6 mm")
            }
            m if !SCALES.contains(&m.placement.scale) => {
                fail(&["placement", "scale"], "`scale` must be a factor from 1e-9 to 1e6")
            }
            _ => Ok(()),
        }
    }
}

/// A placement: scale, then turn, then shift.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Placement {
    /// Where the file's origin comes to stand, mm.
    pub at: [f64; 3],
    /// Where the file's z axis points.
    pub z: [f64; 3],
    /// Where the file's x axis points, as far as `z` lets it; the scene's x axis unless given.
    pub x: Option<[f64; 3]>,
    /// Enlargement, above 0.
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-9, max = 1e6)))]
    pub scale: f64,
}

impl Default for Placement {
    fn default() -> Self {
        Self { at: [0.0; 3], z: [0.0, 0.0, 1.0], x: None, scale: 1.0 }
    }
}

/// What the faces that a rule selects are made of. All selectors that are given must hold, each by one of its values where it is a list;
/// `*` in a name stands for anything.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Material {
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
    /// The same selectors as one value, in place of the keys above: `on = { part = "lens", entity = 12 }`.
    pub on: Option<FaceSelector>,
    /// Name of the medium inside; its faces become interfaces unless `surface` says otherwise.
    pub medium: Option<String>,
    /// What happens at the surface.
    pub surface: Option<SurfaceOptics>,
    /// Share of the power that is reflected: constant, `[[angle_deg, share], …]` or `[[angle_deg, nm, share], …]` over a full
    /// grid. 1 for mirrors and diffuse faces, 0 for coatings unless said otherwise.
    pub reflectance: Option<Reflectance>,
    /// Share of the power that a coating transmits, 0 unless said otherwise; the rest is absorbed.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 1)))]
    pub transmittance: Option<f64>,
    /// Rows of a coating over a full grid: `[angle_deg, nm, R, T]` or `[angle_deg, nm, Rs, Rp, Ts, Tp]`. The angle is that in the
    /// rarer of the two media, for light from either side; between rows shares are linear, beyond them constant, and where
    /// light cannot leave a medium what would be transmitted is reflected.
    pub coating: Option<Vec<Vec<f64>>>,
    /// Complex index `[n, k]` of a metal.
    pub metal: Option<[f64; 2]>,
    /// Light that leaves the surface off the specular direction.
    pub scatter: Option<ScatterKey>,
}

/// Surface scatter.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct ScatterKey {
    /// The lobe.
    pub lobe: LobeKind,
    /// Share of the light that scatters; the rest stays specular. All of it unless said otherwise; of an ABg lobe, a factor of the share
    /// that the lobe gives.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 1)))]
    pub share: Option<f64>,
    /// Standard deviation of a Gaussian lobe in each direction, degrees.
    pub sigma_deg: Option<f64>,
    /// Exponent of a cosine lobe about the specular direction.
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub exponent: Option<f64>,
    /// `[A, B, g]` of an ABg lobe, which give the share that scatters too.
    pub abg: Option<[f64; 3]>,
}

/// The lobes of surface scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LobeKind {
    /// Equally bright from everywhere.
    #[default]
    Lambertian,
    /// Gaussian about the specular direction.
    Gaussian,
    /// cosⁿ about the specular direction.
    Cosine,
    /// Harvey–Shack ABg.
    Abg,
}

impl Material {
    /// Whether the rule selects faces both by keys of its own and by `on`.
    pub(super) fn selects_twice(&self) -> bool {
        self.on.is_some() && self.own_selectors() != FaceSelector::default()
    }

    /// Returns the selector of the rule: `on`, or the keys that stand in the rule itself; all faces where it has neither.
    pub(crate) fn faces(&self) -> FaceSelector {
        // `check` has refused a rule with both, so that none of its selectors is lost here.
        if let Some(on) = &self.on {
            return on.clone();
        }
        self.own_selectors()
    }

    /// Returns the selectors that stand in the rule itself; all faces where there are none.
    fn own_selectors(&self) -> FaceSelector {
        let Self { part, instance, solid, face, layer, colour, kind, radius_mm, entity, at, .. } = self.clone();
        FaceSelector { part, instance, solid, face, layer, colour, kind, radius_mm, entity, at }
    }
}

/// A share of power, constant or by angle of incidence.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Reflectance {
    /// At every angle.
    Constant(f64),
    /// Pairs of angle of incidence in degrees and share, by rising angle; linear between.
    ByAngle(Vec<[f64; 2]>),
    /// Angle in degrees, wavelength in nm and share; angles and wavelengths rising, wavelengths fastest.
    ByAngleAndWavelength(Vec<[f64; 3]>),
}

/// What happens to light at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
// The schema keeps its definition under the old name; `model::SurfaceKind`, the shape, has no part in it.
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "SurfaceKind"))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SurfaceOptics {
    /// Light ends here.
    #[default]
    Absorber,
    /// Specular reflection of the share `reflectance`; the rest is absorbed.
    Mirror,
    /// The bare boundary of a medium: refraction and Fresnel reflection.
    Interface,
    /// Reflects the share `reflectance` by Lambert's law; the rest is absorbed.
    Diffuse,
    /// A boundary with `reflectance` and `transmittance`, or with the rows of `coating`.
    Coating,
    /// A polished metal of the complex index `metal`.
    Metal,
}

//! The keys `[run]` and `[accuracy]`: settings of a run, and how models are faceted and traced.

use super::{Key, Origin, lenient};
use crate::math::units::WAVELENGTHS_NM;
use crate::simulate::{Error, ErrorKind};
use crate::tessellate::LEAST_TOLERANCE_MM;
use crate::text;
use serde::{Deserialize, Serialize};

/// The helium d line, at which catalogues give n_d, nm.
const HELIUM_D_NM: f64 = 587.5618;

/// A kilometre: longer than any path that is not trapped, mm.
const LONGEST_PATH_MM: f64 = 1e9;

/// Share of its first power below which a path is cut off: a thousand such paths are a thousandth of one ray.
const POWER_FLOOR: f64 = 1e-6;

/// Share of its first power below which a ray is no longer split: reflections of reflections of reflections.
const SPLIT_FLOOR: f64 = 1e-3;

/// A micrometre: more than CAD systems leave between faces that touch, less than any gap that is meant.
const GLUE_MM: f64 = 1e-3;

/// Glue distances that may be asked for, mm: from the rounding of places to what would close real gaps.
const GLUES_MM: std::ops::RangeInclusive<f64> = 1e-9..=1.0;

/// Share by which the glue distance reaches beyond the given one, far more than places are rounded by: faces that are drawn exactly so far
/// apart are one for every ray then, and not for those alone that rounding puts nearer.
const GLUE_MARGIN: f64 = 1e-6;

/// Most rays of a run: of one that grows, the 32 bits that number its replicates of 5000 rays hold no more.
pub const MOST_RAYS: u64 = 20_000_000_000_000;

/// Settings of the run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Run {
    /// Number of rays that leave the sources, such as 1_000_000 or 1e6.
    #[serde(deserialize_with = "lenient::count")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "super::lenient::count_schema"))]
    pub rays: u64,
    /// Seed of all random numbers. Two variants of a scene with the same seed use the same random numbers, so that their difference is less
    /// noisy than with two seeds, the more so the less they differ; for a result that is independent of an earlier one, take another seed.
    pub seed: u64,
    /// How places, directions and wavelengths are chosen at the sources.
    pub sampling: Sampling,
    /// What happens to a ray at a partly reflecting interface.
    pub interfaces: Interfaces,
    /// With `interfaces = "split"`: below this share of a ray's first power an interface no longer splits the ray but chooses a side.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 1)))]
    pub split_floor: f64,
    /// Whether the polarisation of each ray is followed; otherwise light is unpolarised at every hit.
    pub polarisation: bool,
    /// Wavelength of sources without a spectrum, nm.
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 1e6)))]
    pub wavelength_nm: f64,
    /// Unit of the sources' powers, and so of all results.
    pub unit: PowerUnit,
    /// Hits after which a path ends and counts as cut off: what is caught in a clear block goes round for ever.
    #[cfg_attr(feature = "schema", schemars(range(min = 1)))]
    pub max_bounces: u32,
    /// Diagonals of a body that light goes in it by total reflection alone before it counts as caught there and is cut off, where the
    /// body absorbs nothing; `inf` for a guide that is wound up on itself.
    #[cfg_attr(feature = "schema", schemars(range(min = 1)))]
    pub caught_after: f64,
    /// Length after which a path ends at the next face and counts as cut off, mm; its way from the last face on is not limited.
    pub max_length_mm: f64,
    /// Share of a ray's first power below which its path ends and counts as cut off.
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    pub power_floor: f64,
    /// Faces of two solids at most this far apart are one interface, mm.
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-9, max = 1)))]
    pub glue_mm: f64,
    /// Independent parts the run is divided into, at least 2; errors are computed from how much they differ. At least 16 rays go into each
    /// where there are 32 or more. With the default, runs of a multiple of 5000 rays from 640,000 on have one for every 5000, so that
    /// further rays can follow.
    #[cfg_attr(feature = "schema", schemars(range(min = 2, max = 65536)))]
    pub replicates: u32,
    /// Group light by the faces it met and what happened there, and list so many of these sequences for each receiver; 0 for none. Each
    /// ray is then traced twice.
    pub sequences: u32,
    /// Count the light that enters and leaves its body through each face, and list so many faces by the power that they absorb and let
    /// out; 0 for none.
    pub faces: u32,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            rays: 1_000_000,
            seed: 1,
            sampling: Sampling::Sobol,
            interfaces: Interfaces::Roulette,
            split_floor: SPLIT_FLOOR,
            polarisation: false,
            wavelength_nm: HELIUM_D_NM,
            unit: PowerUnit::Watt,
            max_bounces: 20_000,
            caught_after: 200.0,
            max_length_mm: LONGEST_PATH_MM,
            power_floor: POWER_FLOOR,
            glue_mm: GLUE_MM,
            replicates: 128,
            sequences: 0,
            faces: 0,
        }
    }
}

/// Unit of power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PowerUnit {
    /// Watts: receivers answer in W/m² and W/sr.
    #[default]
    #[serde(rename = "W")]
    Watt,
    /// Lumens: receivers answer in lx and cd.
    #[serde(rename = "lm")]
    Lumen,
}

impl PowerUnit {
    /// Returns its symbol, `W` or `lm`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Watt => "W",
            Self::Lumen => "lm",
        }
    }
}

/// How a source is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// An Owen-scrambled Sobol net in each replicate, at the sources and for the first surfaces that rays meet: smaller errors, honestly
    /// estimated.
    #[default]
    Sobol,
    /// Independent random numbers.
    Random,
}

/// What happens at a partly reflecting interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Interfaces {
    /// The ray is reflected or transmitted by chance, with its whole power.
    #[default]
    Roulette,
    /// The ray becomes two, each with its share of the power.
    Split,
}

/// How the models are faceted and traced.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Smallest and largest sag of a facet, mm; one number for both. Without any of `tolerance_mm`, `intersector` and `normals` a pilot
    /// chooses all three.
    #[serde(deserialize_with = "lenient::range")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "super::lenient::range_schema"))]
    pub tolerance_mm: Option<[f64; 2]>,
    /// Largest angle between a facet and the surface normals at its corners, degrees; no limit unless given.
    pub angle_deg: Option<f64>,
    /// `octree`, `bvh2`, `cwbvh` or `exact`.
    pub intersector: Option<String>,
    /// `flat`, `nearest`, `bilinear`, `cubic` or `exact`.
    pub normals: Option<String>,
}

impl Accuracy {
    /// Refuses names that are not known, and tolerances and angles out of range.
    pub(super) fn check(&self, origin: &Origin) -> Result<(), Error> {
        let fail = |key: &str, message: &str| {
            let at = [Key::Name("accuracy"), Key::Name(key)];
            Err(origin.error(ErrorKind::Value, &at, format!("`{key}` {message}")))
        };
        let names: [(&str, &Option<String>, &[&str]); 2] = [
            ("intersector", &self.intersector, &["octree", "bvh2", "cwbvh", "exact"]),
            ("normals", &self.normals, &["flat", "nearest", "bilinear", "cubic", "exact"]),
        ];
        for (key, name, known) in names {
            let Some(name) = name.as_ref().filter(|n| !known.iter().any(|k| k.eq_ignore_ascii_case(n))) else {
                continue;
            };
            let at = [Key::Name("accuracy"), Key::Name(key)];
            let error = origin.error(ErrorKind::Value, &at, format!("'{name}' is none of {}", known.join(", ")));
            return Err(match text::did_you_mean(name, known.iter().copied()) {
                Some(advice) => error.help(advice),
                None => error,
            });
        }
        // Written so that what is no number fails.
        match (self.tolerance_mm, self.angle_deg) {
            (Some([low, high]), _) if !(low >= LEAST_TOLERANCE_MM && low <= high && high.is_finite()) => {
                fail("tolerance_mm", "must be two lengths from 1e-7 on, the tighter one first, as in [0.05, 0.2]")
            }
            (_, Some(angle)) if !(angle > 0.0 && angle < 90.0) => fail("angle_deg", "must be above 0 and below 90"),
            _ => Ok(()),
        }
    }
}

impl Run {
    /// Returns the distance up to which faces of two solids are one, mm: `glue_mm` with a margin for rounding.
    pub(crate) fn glue_distance(&self) -> f64 {
        self.glue_mm * (1.0 + GLUE_MARGIN)
    }

    /// Whether a value of `glue_mm` is one that may be asked for.
    pub(crate) fn allows_glue(glue_mm: f64) -> bool {
        GLUES_MM.contains(&glue_mm)
    }

    /// Refuses the first number that is out of range.
    pub(super) fn check(&self, origin: &Origin) -> Result<(), Error> {
        let fail = |key: &str, message: &str| {
            Err(origin.error(ErrorKind::Value, &[Key::Name("run"), Key::Name(key)], format!("`{key}` {message}")))
        };
        match self {
            r if r.rays == 0 || r.rays > MOST_RAYS => fail("rays", "must be from 1 to 2e13"),
            r if r.replicates < 2 || r.replicates > 1 << 16 => fail("replicates", "must be from 2 to 65536"),
            r if !(0.0..1.0).contains(&r.power_floor) => fail("power_floor", "must be in [0, 1)"),
            r if !(0.0..=1.0).contains(&r.split_floor) => fail("split_floor", "must be in [0, 1]"),
            r if r.max_length_mm.is_nan() || r.max_length_mm <= 0.0 => fail("max_length_mm", "must be positive"),
            r if !WAVELENGTHS_NM.contains(&r.wavelength_nm) => {
                fail("wavelength_nm", "must be from 1 to 1e6 nm; 0.55 µm are 550 nm")
            }
            r if !Self::allows_glue(r.glue_mm) => {
                fail("glue_mm", "must be from 1e-9 to 1: faces at the same place are always one interface")
            }
            r if r.caught_after.is_nan() || r.caught_after < 1.0 => fail("caught_after", "must be at least 1"),
            r if r.max_bounces == 0 => fail("max_bounces", "must be at least 1"),
            _ => Ok(()),
        }
    }
}

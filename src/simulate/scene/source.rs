//! The key `[[source]]`: where light comes from.

use super::{FaceSelector, Key, MOST_RAYS, OneOrMany, Origin, PowerUnit, Run, SpectrumKey, lenient};
use crate::simulate::{Error, ErrorKind};
use serde::{Deserialize, Serialize};

/// A source of light.
///
/// It shines from a point, or evenly from a disc (`radius`) or rectangle (`size`) around `at`, square to `direction`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Source {
    /// Name for the report; no two sources have the same.
    pub name: String,
    /// How the light leaves.
    pub kind: SourceKind,
    /// Power, watts (or lumens, as the run says); 1 unless said otherwise, or what the source's file says.
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-30, max = 1e30)))]
    pub power: Option<f64>,
    /// IES LM-63, EULUMDAT, ray file (IES TM-25, Zemax or LightTools binary, CSV or NPZ) or Data_1, relative to the scene file.
    ///
    /// Its main axis points along `direction`, for type C with the plane C 0 along `x` and C 90 to its left as seen by one who looks
    /// along `direction` (counterclockwise in the plan of a luminaire that shines down), for types A and B with upward along `x`
    /// (+y unless said otherwise) and positive H to the right.
    /// A far field's own file is the light it was written from again with that far field's `normal` for `direction` and, for `x`, in
    /// types A and B its `up`, in type C what lies to the right of one who looks along `normal`, the vector product `normal` × `up`:
    /// where `up` is +y, `[-1, 0, 0]` along +z and `[1, 0, 0]` along −z (for a `normal` along y without `up` take +x as `up`). Without
    /// `x` the plane C 0 lies along +x as far as `direction` lets it, for light within 26° of the x axis along +y; along +z that is C 180
    /// of a far field.
    /// Ray lists stand with their origin in `at`.
    /// In CSV a row is a ray, below a head that names the columns `x,y,z,dx,dy,dz,power,wavelength_nm` in any order, or in this one
    /// without a head; the wavelength may be missing. NPZ has the arrays `origin`, `direction`, `power` and, if given, `wavelength_nm`.
    /// Long lists stay on the disk; of CSV and NPZ 64 bytes a ray are unpacked into the folder for temporary files (`TMPDIR`). The TILT
    /// table of an IES file, which is for tilted lamps, is left out.
    pub file: Option<String>,
    /// The faces that shine, outward, instead of `at`, `direction`, `x`, `radius` and `size`. Where an opaque face of another solid lies
    /// against one of them, as a board against a chip, it does not shine: all of the power leaves from the rest, and a note says how much
    /// that is.
    pub on: Option<FaceSelector>,
    /// Instance, part that is placed once, or `name` of a `[[model]]`, in whose own coordinates `at`, `direction`, `x` and `polarised` are
    /// given, and the rays of a list: the source goes where it goes. `*` in a name stands for anything.
    pub frame: Option<String>,
    /// Position or centre, mm.
    pub at: [f64; 3],
    /// Main direction; need not be of unit length.
    pub direction: [f64; 3],
    /// Direction of the first side of `size`, as far as `direction` lets it; of light from an IES or EULUMDAT file it sets the turn about
    /// `direction` too, see `file`.
    pub x: Option<[f64; 3]>,
    /// Radius of a disc, mm; a `frame` that enlarges moves the source and leaves it.
    pub radius: Option<f64>,
    /// Sides of a rectangle, mm.
    pub size: Option<[f64; 2]>,
    /// Half the opening angle of a cone, degrees.
    #[cfg_attr(feature = "schema", schemars(range(max = 180)))]
    pub half_angle_deg: Option<f64>,
    /// Exponent n of a cosⁿ lobe.
    #[cfg_attr(feature = "schema", schemars(range(min = 0, max = 1e6)))]
    pub exponent: Option<f64>,
    /// Names of the instances that the source lies inside of, outermost first; `[]` for none. Within `glue_mm` of a face its light
    /// starts on the side of it where that is true. Without `inside` geometry decides: light that goes into a body and starts within
    /// `glue_mm` of its face, on either side, starts inside, as if glued to it, and a note says so. Faces that shine (`on`) do so outward.
    pub inside: Option<OneOrMany<String>>,
    /// Spectrum, in watts (in a run that counts lumens too: its light is then weighed by what the eye sees of it); the line
    /// `wavelength_nm` of the run unless said otherwise.
    pub spectrum: Option<SpectrumKey>,
    /// Direction of the electric field of linearly polarised light, as far as each ray lets it; unpolarised without. Needs `polarisation =
    /// true` in `[run]`.
    pub polarised: Option<[f64; 3]>,
    /// Number of its rays, which `--rays` does not change; by its share of the power otherwise.
    #[serde(deserialize_with = "lenient::optional_count")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "super::lenient::count_schema"))]
    pub rays: Option<u64>,
}

impl Default for Source {
    fn default() -> Self {
        Self {
            name: String::new(),
            kind: SourceKind::Point,
            power: None,
            file: None,
            on: None,
            frame: None,
            at: [0.0; 3],
            direction: [0.0, 0.0, 1.0],
            x: None,
            radius: None,
            size: None,
            half_angle_deg: None,
            exponent: None,
            inside: None,
            spectrum: None,
            polarised: None,
            rays: None,
        }
    }
}

/// How light leaves a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SourceKind {
    /// The same in every direction.
    Point,
    /// The same in every direction within `half_angle_deg` of `direction`.
    Cone,
    /// All along `direction`.
    Collimated,
    /// Radiant intensity proportional to the cosine to `direction`, on one side.
    Lambertian,
    /// Radiant intensity proportional to cosⁿ, n being `exponent`.
    Cosine,
    /// The intensity of an IES LM-63 file.
    Ies,
    /// The intensity of a EULUMDAT file.
    Eulumdat,
    /// The rays of a TM-25, Zemax binary, LightTools binary, CSV or NPZ file, known by its content.
    Rays,
    /// The rays of a Data_1 file.
    #[serde(rename = "data_1")]
    Data1,
}

impl Source {
    /// Whether its rays are those of a file, one by one.
    pub(crate) fn is_ray_list(&self) -> bool {
        matches!(self.kind, SourceKind::Rays | SourceKind::Data1)
    }

    /// Refuses a source with the first of its faults; `index` is its place in the scene, `all_rays` the sum of the `rays` of all sources.
    pub(super) fn check(&self, origin: &Origin, index: usize, run: &Run, all_rays: u64) -> Result<(), Error> {
        let fault = (self.power_fault())
            .or_else(|| self.file_fault())
            .or_else(|| self.geometry_fault())
            .or_else(|| self.light_fault(run, all_rays))
            .or_else(|| self.lobe_fault());
        if let Some((key, message)) = fault {
            let at = [Key::Name("source"), Key::Index(index), Key::Name(key)];
            return Err(origin.error(ErrorKind::Value, &at, message));
        }
        // Photometric files are in lumens by definition, and their power need not be written.
        let photometric = matches!(self.kind, SourceKind::Ies | SourceKind::Eulumdat);
        if photometric && self.power.is_none() && run.unit != PowerUnit::Lumen {
            let at = [Key::Name("source"), Key::Index(index), Key::Name("file")];
            let error =
                origin.error(ErrorKind::Value, &at, "a photometric file gives lumens, but the run counts watts");
            let advice = "set `unit = \"lm\"` in [run], or give the source's `power` in watts";
            return Err(match self.spectrum {
                Some(_) => error.help(format!("{advice}: its `spectrum` is not used to convert photometric files")),
                None => error.help(advice),
            });
        }
        Ok(())
    }

    /// Returns what is wrong with the power; `None` where none is given or it is within [`POWERS`].
    fn power_fault(&self) -> Fault {
        match self.power {
            Some(power) if POWERS.contains(&power) => None,
            Some(power) if power > 0.0 => {
                Some(("power", format!("a power of {power:e} is not within 1e-30 and 1e30")))
            }
            Some(power) => Some(("power", format!("a power of {power} is not positive"))),
            None => None,
        }
    }

    /// Returns the key and fault where a file is missing or given in vain, or where `on`, `frame`, `radius`, `size` or a place does not go
    /// with such a source or with each other; `None` where nothing is wrong.
    fn file_fault(&self) -> Fault {
        let list = self.is_ray_list();
        let measured = list || matches!(self.kind, SourceKind::Ies | SourceKind::Eulumdat);
        let sized = self.radius.is_some() || self.size.is_some();
        if measured && self.file.is_none() {
            return Some(("file", "this kind of source needs `file`".into()));
        }
        if !measured && self.file.is_some() {
            return Some(("file", "`file` belongs to another kind".into()));
        }
        if self.on.is_some() && measured {
            return Some(("on", "a measured source does not shine from faces".into()));
        }
        if self.on.is_some() && self.frame.is_some() {
            return Some((
                "frame",
                "faces that shine are where they are: `frame` belongs to a source with `at`".into(),
            ));
        }
        if self.on.is_some() && sized {
            return Some(("on", "faces that shine have neither `radius` nor `size`".into()));
        }
        if let Some(key) = self.on.as_ref().and(self.place_key()) {
            return Some((
                key,
                format!("faces that shine do so outward from where they are: leave out `{key}`, or leave out `on`"),
            ));
        }
        if list && sized {
            let key = if self.radius.is_some() { "radius" } else { "size" };
            return Some((
                key,
                format!("a ray list has its own places: `{key}` belongs to another kind of source"),
            ));
        }
        None
    }

    /// Returns the first key that places or turns the source otherwise than a source without any; `None` where none does.
    fn place_key(&self) -> Option<&'static str> {
        let Self { at, direction, .. } = Self::default();
        let keys = [("at", self.at != at), ("direction", self.direction != direction), ("x", self.x.is_some())];
        keys.into_iter().find(|(_, is_given)| *is_given).map(|(key, _)| key)
    }

    /// Returns the first that is wrong with the place, the directions or the extent; `None` where nothing is.
    fn geometry_fault(&self) -> Fault {
        let is_finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let is_direction = |v: &[f64; 3]| is_finite(v) && v.iter().any(|x| *x != 0.0);
        let is_length = |x: &f64| *x > 0.0 && x.is_finite();
        if self.polarised.is_some_and(|p| !is_direction(&p)) {
            return Some(("polarised", "`polarised` must be the direction of the electric field".into()));
        }
        if self.x.is_some_and(|x| !is_direction(&x)) {
            return Some(("x", "`x` must be a direction".into()));
        }
        if !is_finite(&self.at) {
            return Some(("at", "`at` must be three finite numbers, mm".into()));
        }
        if !is_direction(&self.direction) {
            return Some(("direction", "not a direction".into()));
        }
        if self.radius.is_some() && self.size.is_some() {
            return Some(("size", "a source has a `radius` or a `size`, not both".into()));
        }
        if self.radius.is_some_and(|r| !is_length(&r)) {
            return Some(("radius", "`radius` must be positive".into()));
        }
        if self.size.is_some_and(|s| !s.iter().all(is_length)) {
            return Some(("size", "both sides of `size` must be positive".into()));
        }
        None
    }

    /// Returns the first that is wrong with the number of rays, of which all sources name `all_rays`, the spectrum or the polarisation;
    /// `None` where nothing is.
    fn light_fault(&self, run: &Run, all_rays: u64) -> Fault {
        if self.rays.is_some_and(|rays| rays == 0 || all_rays > MOST_RAYS) {
            return Some(("rays", "`rays` must be positive, and those of all sources 2e13 at most".into()));
        }
        if let Some(Err(message)) = self.spectrum.as_ref().map(|s| s.wavelengths(run.unit)) {
            return Some(("spectrum", message));
        }
        if self.polarised.is_some() && !run.polarisation {
            return Some(("polarised", "polarised light needs `polarisation = true` in [run]".into()));
        }
        None
    }

    /// Returns the first key of the lobe that is missing, out of range or of another kind of source; `None` where all are right.
    fn lobe_fault(&self) -> Fault {
        match (self.kind, self.half_angle_deg, self.exponent) {
            (SourceKind::Cone, Some(a), _) if a > 0.0 && a <= 180.0 => {}
            (SourceKind::Cone, ..) => {
                return Some((
                    "half_angle_deg",
                    "a cone needs `half_angle_deg` above 0 and at most 180; for parallel light take `collimated`"
                        .into(),
                ));
            }
            (_, Some(_), _) => return Some(("half_angle_deg", "`half_angle_deg` belongs to a cone".into())),
            _ => {}
        }
        match (self.kind, self.exponent) {
            (SourceKind::Cosine, Some(n)) if (0.0..=LARGEST_EXPONENT).contains(&n) => None,
            (SourceKind::Cosine, _) => Some(("exponent", "a cosine source needs `exponent` in 0 to 1e6".into())),
            (_, Some(_)) => Some(("exponent", "`exponent` belongs to a cosine source".into())),
            _ => None,
        }
    }
}

/// A key with what is wrong with it; `None` where nothing is.
type Fault = Option<(&'static str, String)>;

/// Powers that a source may have, in the unit of the run: sums over rays neither overflow nor vanish.
pub(crate) const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Largest exponent of a cosine lobe: 0.08° wide, below which a collimated source is meant.
const LARGEST_EXPONENT: f64 = 1e6;

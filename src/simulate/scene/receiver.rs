//! The key `[[receiver]]`: where light is counted.

use super::{FaceSelector, Key, OneOrMany, Origin, PowerUnit};
use crate::math::units::{PLACES_MM, WAVELENGTHS_NM};
use crate::simulate::{Error, ErrorKind};
use serde::{Deserialize, Serialize};

/// Sizes and radii of receivers, mm: the area of a cell is a number that figures can be divided by, from atoms to the orbit of the moon.
pub(super) const LENGTHS_MM: std::ops::RangeInclusive<f64> = 1e-9..=1e12;

/// Where light is counted. Planes, discs and spheres stand in space and are no part of a model.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Receiver {
    /// Name, used in reports and file names.
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    pub name: String,
    /// What it is.
    pub kind: ReceiverKind,
    /// Instance, part that is placed once, or `name` of a `[[model]]`, in whose own coordinates `at`, `normal`, `x` and `up` are given: the
    /// receiver goes where it goes. `*` in a name stands for anything.
    pub frame: Option<String>,
    /// Centre of a plane, disc or sphere, mm.
    pub at: [f64; 3],
    /// Normal of a plane or disc; the main direction of a far field or of a sphere's cells: H 0, V 0, or γ 0.
    pub normal: [f64; 3],
    /// Direction of the first side of a plane, or of the cells of a disc, as far as `normal` lets it; the second is `normal` × `x`.
    pub x: Option<[f64; 3]>,
    /// Upward direction of a far field or of a sphere's cells, as far as `normal` lets it; y unless given.
    pub up: Option<[f64; 3]>,
    /// Sides of a plane, mm; a `frame` that enlarges moves the receiver and leaves them.
    pub size: Option<[f64; 2]>,
    /// Radius of a disc or sphere, mm; a `frame` that enlarges moves the receiver and leaves it.
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-9, max = 1e12)))]
    pub radius: Option<f64>,
    /// Number of cells along both sides; of a disc along those of the square around it, whose corners stay empty.
    #[cfg_attr(feature = "schema", schemars(inner(range(min = 1))))]
    pub cells: [u32; 2],
    /// Whether light ends at a plane, disc or sphere; otherwise it is counted and goes on.
    pub absorbs: bool,
    /// Counts light that comes against `normal` only, and lets the other pass unseen.
    pub one_sided: bool,
    /// Counts only light that has interacted exactly this many times: at faces, those that it goes straight through among them, or by
    /// scattering in a medium.
    pub interactions: Option<u32>,
    /// Angles of a far field: for one who looks along `normal`, positive H lies to the right and positive V up; C 0 lies to the right
    /// and C 90 up.
    pub angles: FarFieldType,
    /// First angle of a far field (H, or C), from and to, degrees; −90 to 90 unless given, of C-planes 0 to 360. A sphere counts all
    /// directions.
    pub h_deg: Option<[f64; 2]>,
    /// Second angle of a far field (V, or γ), from and to, degrees; −90 to 90 unless given, of C-planes 0 to 180.
    pub v_deg: Option<[f64; 2]>,
    /// What is counted besides power, where that is in watts.
    pub channels: Option<Channels>,
    /// Edges of spectral bins, rising, nm: power is counted in each. Not beside `channels`, which another receiver there may have.
    #[cfg_attr(feature = "schema", schemars(length(min = 2, max = 1000)))]
    pub bins_nm: Option<Vec<f64>>,
    /// Part whose absorbed flux is counted.
    pub part: Option<OneOrMany<String>>,
    /// Instance whose absorbed flux is counted.
    pub instance: Option<OneOrMany<String>>,
    /// Faces whose absorbed flux is counted, in place of `part` and `instance`.
    pub on: Option<FaceSelector>,
}

impl Default for Receiver {
    fn default() -> Self {
        Self {
            name: String::new(),
            kind: ReceiverKind::Plane,
            frame: None,
            at: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            x: None,
            up: None,
            size: None,
            radius: None,
            cells: [100, 100],
            absorbs: true,
            one_sided: false,
            interactions: None,
            angles: FarFieldType::A,
            h_deg: None,
            v_deg: None,
            channels: None,
            bins_nm: None,
            part: None,
            instance: None,
            on: None,
        }
    }
}

/// The kinds of receivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReceiverKind {
    /// A rectangle in space: power per area.
    Plane,
    /// A round detector in space: power per area.
    Disc,
    /// All light that leaves the scene, by direction: power per solid angle.
    FarField,
    /// A sphere in space, by direction from its centre as angles of type A: power per area; one that light passes counts it on its way in
    /// and out.
    Sphere,
    /// What the faces of a part absorb.
    Absorbed,
}

/// What a receiver counts besides power, for sources in watts with a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Channels {
    /// Lumens: lx and cd.
    Photometric,
    /// CIE 1931 X, Y and Z, Y in lumens.
    Xyz,
}

/// How directions become two angles (CIE 121, IES LM-75).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum FarFieldType {
    /// Vertical polar axis, as for headlamps: V is the elevation above the horizontal plane, H turns about the vertical.
    #[default]
    #[serde(rename = "A")]
    A,
    /// Horizontal polar axis, as for floodlights: H is the elevation out of the vertical plane, V turns about the horizontal.
    #[serde(rename = "B")]
    B,
    /// C-planes about `normal` and γ from it, as for luminaires.
    #[serde(rename = "C")]
    C,
}

impl FarFieldType {
    /// Returns what it is called in a scene.
    const fn letter(self) -> char {
        match self {
            Self::A => 'A',
            Self::B => 'B',
            Self::C => 'C',
        }
    }
}

impl Receiver {
    /// Returns the ranges of both angles, degrees: where one is not given, the half space ahead, and of C-planes all directions.
    pub(crate) fn angles_deg(&self) -> ([f64; 2], [f64; 2]) {
        let (h, v) = match self.angles {
            FarFieldType::A | FarFieldType::B => ([-90.0, 90.0], [-90.0, 90.0]),
            FarFieldType::C => ([0.0, 360.0], [0.0, 180.0]),
        };
        (self.h_deg.unwrap_or(h), self.v_deg.unwrap_or(v))
    }

    /// Returns the upward direction.
    pub(crate) fn up(&self) -> [f64; 3] {
        self.up.unwrap_or([0.0, 1.0, 0.0])
    }

    /// Returns how many sums it keeps at most: its cells for power and once more for each channel or bin. A receiver of absorbed power
    /// keeps one, whatever its cells.
    pub(super) fn sums(&self) -> u64 {
        let cells = match self.kind {
            ReceiverKind::Absorbed => 1,
            _ => u64::from(self.cells[0]) * u64::from(self.cells[1]),
        };
        let channels = match (self.channels, &self.bins_nm) {
            // A bin has a sum, and power one beside them: as many sums as edges.
            (_, Some(edges)) => edges.len() as u64,
            // Power is counted beside the channels.
            (Some(Channels::Xyz), None) => 4,
            (Some(Channels::Photometric), None) => 2,
            (None, None) => 1,
        };
        cells * channels
    }

    /// Returns a key that is given and means nothing for this kind, and the kinds it belongs to; `None` where there is none.
    fn misplaced(&self) -> Option<(&'static str, &'static str)> {
        use ReceiverKind::{Absorbed, Disc, FarField, Plane, Sphere};
        let unset = Self::default();
        // One table for all kinds: a new key that is missing here would be ignored in silence.
        let keys: [(&str, bool, &[ReceiverKind], &str); 16] = [
            ("frame", self.frame.is_some(), &[Plane, Disc, Sphere, FarField], "plane, disc, sphere or far_field"),
            ("at", self.at != unset.at, &[Plane, Disc, Sphere], "plane, disc or sphere"),
            (
                "normal",
                self.normal != unset.normal,
                &[Plane, Disc, Sphere, FarField],
                "plane, disc, sphere or far_field",
            ),
            ("x", self.x.is_some(), &[Plane, Disc], "plane or disc"),
            ("up", self.up.is_some(), &[Sphere, FarField], "sphere or far_field"),
            ("size", self.size.is_some(), &[Plane], "plane"),
            ("radius", self.radius.is_some(), &[Disc, Sphere], "disc or sphere"),
            ("absorbs", !self.absorbs, &[Plane, Disc, Sphere], "plane, disc or sphere"),
            (
                "interactions",
                self.interactions.is_some(),
                &[Plane, Disc, Sphere, FarField],
                "plane, disc, sphere or far_field",
            ),
            ("one_sided", self.one_sided, &[Plane, Disc], "plane or disc"),
            ("angles", self.angles != unset.angles, &[FarField], "far_field"),
            ("h_deg", self.h_deg.is_some(), &[FarField], "far_field"),
            ("v_deg", self.v_deg.is_some(), &[FarField], "far_field"),
            ("part", self.part.is_some(), &[Absorbed], "absorbed"),
            ("instance", self.instance.is_some(), &[Absorbed], "absorbed"),
            ("on", self.on.is_some(), &[Absorbed], "absorbed"),
        ];
        keys.into_iter().find(|(_, given, kinds, _)| *given && !kinds.contains(&self.kind)).map(|k| (k.0, k.3))
    }

    /// Returns what is wrong with the division of the light by wavelength in a run that counts powers in `unit`, and its key.
    fn spectral_fault(&self, unit: PowerUnit) -> Option<(&'static str, &'static str)> {
        if self.channels.is_some() && self.bins_nm.is_some() {
            return Some(("bins_nm", "a receiver has `channels` or `bins_nm`, not both"));
        }
        if self.channels.is_some() && unit == PowerUnit::Lumen {
            return Some(("channels", "this run counts lumens already: `channels` are for powers in watts"));
        }
        if let Some(edges) = &self.bins_nm {
            if edges.len() < 2 || edges.len() > 1000 || !edges.windows(2).all(|w| w[0] < w[1]) {
                return Some(("bins_nm", "`bins_nm` must be 2 to 1000 rising wavelengths"));
            }
            if edges[0] < 0.0 {
                return Some(("bins_nm", "`bins_nm` must begin at 0 nm or above"));
            }
            // Light of the last bin ends there: edges in micrometres lie below all light.
            if edges.last().is_some_and(|last| !WAVELENGTHS_NM.contains(last)) {
                return Some(("bins_nm", "`bins_nm` must end between 1 and 1e6 nm; 0.55 µm are 550 nm"));
            }
        }
        let is_divided = self.channels.is_some() || self.bins_nm.is_some();
        (is_divided && self.kind == ReceiverKind::Absorbed)
            .then_some(("channels", "absorbed flux is counted as power alone"))
    }

    /// Returns what is wrong with the ranges of a far field's angles, and the key of the first that is wrong.
    fn angle_fault(&self) -> Option<(&'static str, String)> {
        let (h, v) = self.angles_deg();
        let [h_range, v_range] = match self.angles {
            // The elevation from the polar axis covers half a turn, the angle about it a whole one.
            FarFieldType::A => [[-180.0, 180.0], [-90.0, 90.0]],
            FarFieldType::B => [[-90.0, 90.0], [-180.0, 180.0]],
            FarFieldType::C => [[0.0, 360.0], [0.0, 180.0]],
        };
        let is_within = |[from, to]: [f64; 2], [low, high]: [f64; 2]| low <= from && from < to && to <= high;
        let ranges = [("h_deg", h, h_range), ("v_deg", v, v_range)];
        let (key, _, [low, high]) = ranges.into_iter().find(|(_, given, range)| !is_within(*given, *range))?;
        let kind = self.angles.letter();
        Some((key, format!("`{key}` must rise and stay within {low} to {high}, the angles of type {kind}")))
    }

    /// Refuses a receiver whose values contradict each other or the unit of the run, or leave it without a place or cells; `index` is its
    /// place in the scene.
    pub(super) fn check(&self, origin: &Origin, index: usize, unit: PowerUnit) -> Result<(), Error> {
        let fail = |key: &str, message: &str| {
            let at = [Key::Name("receiver"), Key::Index(index), Key::Name(key)];
            Err(origin.error(ErrorKind::Value, &at, message))
        };
        if self.name.is_empty() {
            return fail("name", "this receiver has no `name`");
        }
        if let Some((key, whose)) = self.misplaced() {
            let refused = fail(key, &format!("`{key}` belongs to a receiver of kind {whose}"));
            let help = format!("leave `{key}` out, or give the receiver another `kind`");
            return refused.map_err(|error| error.help(help));
        }
        if self.cells.contains(&0) || u64::from(self.cells[0]) * u64::from(self.cells[1]) > 1 << 24 {
            return fail("cells", "`cells` must be at least 1 and at most 16 million in all");
        }
        if !self.at.iter().all(|x| x.is_finite()) {
            return fail("at", "`at` must be a point, of three finite numbers");
        }
        // Farther out distances are no numbers, and the sources would be said to lie too far away.
        if !self.at.iter().all(|x| PLACES_MM.contains(x)) {
            return fail("at", "`at` must lie within 1e30 mm of the origin");
        }
        for (key, direction) in [("normal", Some(self.normal)), ("up", self.up), ("x", self.x)] {
            if direction.is_some_and(|d| !d.iter().all(|x| x.is_finite()) || d == [0.0; 3]) {
                return fail(
                    key,
                    &format!("`{key}` must be a direction, of three finite numbers that are not all 0"),
                );
            }
        }
        if let Some((key, message)) = self.spectral_fault(unit) {
            return fail(key, message);
        }
        match self.kind {
            ReceiverKind::Plane => match self.size {
                Some(s) if s.iter().all(|x| LENGTHS_MM.contains(x)) => Ok(()),
                _ => fail("size", "a plane needs `size`, two lengths from 1e-9 to 1e12"),
            },
            ReceiverKind::Disc | ReceiverKind::Sphere => match self.radius {
                Some(r) if LENGTHS_MM.contains(&r) => Ok(()),
                _ => fail("radius", "a disc or sphere needs a `radius` from 1e-9 to 1e12"),
            },
            ReceiverKind::FarField => match self.angle_fault() {
                Some((key, message)) => fail(key, &message),
                None => Ok(()),
            },
            ReceiverKind::Absorbed if self.part.is_none() && self.instance.is_none() && self.on.is_none() => {
                fail("part", "say whose absorbed flux is meant: `part`, `instance` or `on`")
            }
            ReceiverKind::Absorbed if self.on.is_some() && (self.part.is_some() || self.instance.is_some()) => {
                fail("on", "`on` has its own `part` and `instance`: put them there")
            }
            ReceiverKind::Absorbed => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_receiver_keeps_a_sum_for_each_cell_and_channel_but_of_absorbed_power_one() {
        let sums = |kind, channels| Receiver { kind, channels, cells: [30, 20], ..Receiver::default() }.sums();
        assert_eq!(sums(ReceiverKind::Plane, None), 600);
        assert_eq!(sums(ReceiverKind::Sphere, Some(Channels::Xyz)), 2400);
        assert_eq!(sums(ReceiverKind::Absorbed, None), 1);
    }
}

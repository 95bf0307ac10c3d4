//! What a job is asked for beside its scene: how fine the facets are, what finds the hits, which rays.

use super::error::Error;
use crate::intersect::NormalMode;
use crate::simulate::{Scene, machine_threads};
use crate::study::accuracy_target::TolerancePlan;
use std::fmt;
use std::str::FromStr;

/// Most threads for each that the machine runs at once: more make no run faster, and thousands stop all else.
const MOST_OVERSUBSCRIPTION: usize = 16;

/// How facets are made; what is not said here the scene says, else the defaults of [`crate::tessellate::Settings`].
#[derive(Clone, Debug, Default)]
pub struct MeshingSettings {
    /// Tolerance, mm: the finest, where the surface bends most, and the loosest.
    pub tolerance: Option<[f64; 2]>,
    /// Largest angle between facet and surface normal, degrees.
    pub angle_deg: Option<f64>,
    /// Tolerance of parts by name, mm.
    pub part: Vec<(String, [f64; 2])>,
    /// Tolerance of faces by name, or by `#` and the number of their entity, mm; wins over that of their part.
    pub face: Vec<(String, [f64; 2])>,
    /// Tolerance of all faces of one optical role, mm.
    pub role: Vec<(String, [f64; 2])>,
    /// Local tolerances that an accuracy came to.
    pub plan: Option<TolerancePlan>,
}

/// How rays are traced; the scene decides what is left open here.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TracingSettings {
    /// Rays of the run.
    pub ray_range: Option<RayRange>,
    /// Seed of all random numbers.
    pub seed: Option<u64>,
    /// Threads that trace; as many as the machine has where none are asked for.
    pub threads: Option<usize>,
    /// The intersector.
    pub intersector: Option<IntersectorKind>,
    /// How the normal at a hit is computed.
    pub normals: Option<NormalMode>,
}

impl TracingSettings {
    /// Returns the number of rays that was asked for, those before a range included; `None` where none was.
    pub fn rays(&self) -> Option<u64> {
        self.ray_range.map(|range| range.end)
    }

    /// Returns a sentence about the sources whose rays a number that was asked for does not change, as they have `rays` of their own;
    /// `None` where there are none, and of a range, which such a scene has not.
    ///
    /// # Errors
    /// When there is no other source, so that the number would change nothing.
    pub(super) fn own_rays_note(&self, scene: &Scene) -> Result<Option<String>, Error> {
        let Some(RayRange { first: None, end }) = self.ray_range else { return Ok(None) };
        let own = scene.sources.iter().filter(|source| source.rays.is_some()).count();
        let all = scene.sources.len();
        match own {
            0 => Ok(None),
            _ if own == all => {
                let message = format!(
                    "{end}: every source of the scene has `rays` of its own, and a number for the run changes none"
                );
                Err(Error::setting("rays", message)
                    .help("take `rays` out of the [[source]]s, or ask for no number"))
            }
            _ => Ok(Some(format!(
                "{own} of {all} sources {} `rays` of {} own, which the {end} rays that were asked for do not change: they are shared \
                 out by power, and the others trace their shares",
                if own == 1 { "has" } else { "have" },
                if own == 1 { "its" } else { "their" },
            ))),
        }
    }

    /// Returns the number of threads to trace with: as many as the machine has where none are asked for, 16 times these at most.
    ///
    /// # Errors
    /// When 0 are asked for.
    pub fn thread_count(&self) -> Result<usize, Error> {
        let machine = machine_threads();
        match self.threads {
            None => Ok(machine),
            Some(0) => Err(Error::setting("threads", "0: at least one thread is needed")),
            Some(n) => Ok(n.min(MOST_OVERSUBSCRIPTION * machine)),
        }
    }
}

/// Rays of a run: so many, or those from one up to another of a run that grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayRange {
    /// The first, where a range was given.
    pub first: Option<u64>,
    /// Past the last ray: their number where no first is given.
    pub end: u64,
}

/// The intersector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IntersectorKind {
    /// The octree on facets.
    #[default]
    Octree,
    /// A binary BVH on facets.
    Bvh2,
    /// An eight-wide BVH on facets.
    Cwbvh,
    /// The spline itself.
    Exact,
}

impl IntersectorKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Octree, Self::Bvh2, Self::Cwbvh, Self::Exact];

    /// Returns its name on the command line and in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Octree => "octree",
            Self::Bvh2 => "bvh2",
            Self::Cwbvh => "cwbvh",
            Self::Exact => "exact",
        }
    }

    /// Returns what is built for it, to follow "the".
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Exact => "boxes of the spline",
            facets => facets.name(),
        }
    }
}

impl fmt::Display for IntersectorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for IntersectorKind {
    type Err = Error;

    /// By its name, in any case.
    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(name)).ok_or_else(|| {
            Error::setting("intersector", format!("{name}: it is not known"))
                .help(format!("use one of {}", Self::ALL.map(Self::name).join(", ")))
        })
    }
}

/// Finds the kind of normals of this name, in any case.
///
/// # Errors
/// When there is none.
pub fn normal_mode(name: &str) -> Result<NormalMode, Error> {
    NormalMode::ALL.into_iter().find(|mode| mode.name().eq_ignore_ascii_case(name)).ok_or_else(|| {
        Error::setting("normals", format!("{name}: they are not known"))
            .help(format!("use one of {}", NormalMode::ALL.map(NormalMode::name).join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_number_of_rays_that_sources_do_not_heed_is_told() {
        let note = |own: [&str; 2], ray_range: Option<RayRange>| {
            let sources = own.map(|rays| format!("[[source]]\nkind = 'point'\n{rays}\n")).concat();
            let scene = Scene::parse(&sources, "s.toml", Path::new(".")).unwrap();
            TracingSettings { ray_range, ..TracingSettings::default() }.own_rays_note(&scene)
        };
        let asked = Some(RayRange { first: None, end: 1000 });
        assert!(
            note(["", ""], asked).unwrap().is_none() && note(["rays = 5", "rays = 5"], None).unwrap().is_none()
        );
        let one = note(["rays = 5", ""], asked).unwrap().unwrap();
        assert!(one.starts_with("1 of 2 sources has `rays` of its own, which the 1000 rays"), "{one}");
        let error = note(["rays = 5", "rays = 6"], asked).unwrap_err();
        assert!(error.setting_name() == Some("rays") && error.to_string().contains("every source"), "{error}");
    }
}

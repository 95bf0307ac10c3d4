//! Bodies: what has a medium inside, as the kernel asks for it.

use super::surfaces::SceneLight;
use crate::math::Aabb;
use crate::optics::{self, Absorption, BulkScatter, Index};

/// Body 0: what is around everything.
pub(crate) const AMBIENT: u32 = 0;

/// Something with a medium inside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    /// Index at the wavelength of the scene.
    index: f64,
    /// Index by wavelength, when the scene has several and they differ.
    dispersive: Option<Index>,
    /// Absorption coefficient at the wavelength of the scene, 1/mm.
    absorption: f64,
    /// Absorption by wavelength, when the scene has several and they differ.
    coloured: Option<Absorption>,
    /// Scattering inside; `None` for a clear body.
    pub(crate) scatter: Option<BulkScatter>,
    /// Name of the instance.
    pub(crate) name: String,
    /// Name of the medium.
    pub(crate) medium: String,
    /// Length that light goes by total reflection alone before it is taken to be trapped, mm; infinite where it is absorbed.
    pub(crate) trapped_length: f64,
    /// A box around it, mm.
    pub(crate) bounds: Aabb,
    /// Whether it has faces in no closed shell.
    pub(crate) open: bool,
    /// Largest distance between an edge of the file and a face of this body that it bounds, mm.
    pub(crate) gap: f64,
}

impl Body {
    /// Makes a body of the medium `m` without faces: its box is empty, and light in it is never taken to be trapped.
    pub(crate) fn new(m: optics::Medium, name: String, light: &SceneLight) -> Self {
        Self {
            // In light of one line an index is a number; the formula is kept only where rays have wavelengths of their own.
            index: m.index.value(light.wavelength),
            dispersive: (light.coloured && m.index.is_dispersive()).then_some(m.index),
            absorption: m.absorption.coefficient(light.wavelength),
            coloured: (light.coloured && m.absorption.is_dispersive()).then_some(m.absorption),
            scatter: m.scatter,
            name,
            medium: m.name,
            trapped_length: f64::INFINITY,
            bounds: Aabb::EMPTY,
            open: false,
            gap: 0.0,
        }
    }

    /// Returns the refractive index at `wavelength`, nm; at the scene's for `None`, and where the medium does not depend on it.
    #[inline]
    pub(crate) fn index(&self, wavelength: Option<f64>) -> f64 {
        match (&self.dispersive, wavelength) {
            (Some(index), Some(nm)) => index.value(nm),
            _ => self.index,
        }
    }

    /// Returns the absorption coefficient, 1/mm, at `wavelength`, nm; at the scene's for `None`, and where the medium does not depend on
    /// it.
    #[inline]
    pub(crate) fn absorption(&self, wavelength: Option<f64>) -> f64 {
        match (&self.coloured, wavelength) {
            (Some(absorption), Some(nm)) => absorption.coefficient(nm),
            _ => self.absorption,
        }
    }

    /// Whether index or absorption depends on the wavelength of a ray; never in a scene of one wavelength.
    pub(crate) fn is_dispersive(&self) -> bool {
        self.dispersive.is_some() || self.coloured.is_some()
    }

    /// Whether light may be absorbed inside at any wavelength.
    pub(crate) fn absorbs(&self) -> bool {
        self.absorption > 0.0 || self.coloured.is_some()
    }
}

impl Body {
    /// Whether it is the body of an instance of this name: the whole, or what follows the occurrences that it is placed through.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        let outer = self.name.strip_suffix(name);
        outer.is_some_and(|outer| outer.is_empty() || outer.ends_with('/'))
    }

    /// Whether light of any wavelength crosses from one into the other without being bent.
    pub(crate) fn matches_index(&self, other: &Self) -> bool {
        self.index == other.index && self.dispersive == other.dispersive
    }

    /// Whether the index at the wavelength of the scene is positive and finite.
    pub(crate) fn has_valid_index(&self) -> bool {
        self.index > 0.0 && self.index.is_finite()
    }
}

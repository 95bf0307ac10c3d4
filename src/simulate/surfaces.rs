//! What a scene is to light, as tables that the kernel reads: faces by index, and the surfaces they have.

use crate::optics::{Coating, Scatter};

/// Optics of a placed face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FaceOptics {
    /// Index into the surfaces of the bound scene.
    pub(crate) surface: u16,
    /// The body whose boundary it is; [`AMBIENT`](super::body::AMBIENT) when there is no medium behind it.
    pub(crate) body: u32,
    /// Number of its solid in its part, by which solids of one body are distinguished.
    pub(crate) solid: u32,
    /// Whether it bounds a closed solid that lets no light in.
    pub(crate) opaque_solid: bool,
    /// Whether it may lie on a face of another body.
    pub(crate) touches_body: bool,
    /// Whether it may lie on a face of another solid of the same body.
    pub(crate) touches_sibling: bool,
    /// Whether a medium and an opaque solid touch here, and this is a face of one of both.
    pub(crate) medium_on_opaque: bool,
}

/// A surface's optics, in the form that the kernel reads.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    Absorber,
    /// Reflects a constant share.
    Mirror(f64),
    /// The bare boundary of a medium.
    Interface,
    /// Everything else.
    Coated(Box<Coated>),
}

impl Surface {
    /// Whether no light passes it; `false` for a coating that may transmit at some angle or wavelength.
    pub(crate) fn is_opaque(&self) -> bool {
        match self {
            Self::Absorber | Self::Mirror(_) => true,
            Self::Interface => false,
            Self::Coated(c) => c.opaque,
        }
    }
}

/// A surface with a coating, scatter or both.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coated {
    pub(crate) coating: Coating,
    pub(crate) scatter: Option<Scatter>,
    /// Whether it never transmits.
    pub(crate) opaque: bool,
}

/// The wavelengths of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SceneLight {
    /// The only wavelength, or one of many, nm.
    pub(crate) wavelength: f64,
    /// Whether there are several.
    pub(crate) coloured: bool,
}

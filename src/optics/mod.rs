//! The laws of light at surfaces and inside media: pure functions and small enums, no scene and no ray tracing.
//!
//! Conventions, the same everywhere in the module: `d` is the unit direction light travels in, *towards* the surface;
//! `n` is a unit normal that may point to either side; `cos_i = |d·n|`; `eta = n1/n2`, the refractive index of the
//! side the light comes from over that of the other side. Wavelengths are vacuum wavelengths in nm.
//!
//! Sources: Born & Wolf, *Principles of Optics*, 1.5 (Snell, Fresnel, conductors); Chandrasekhar, *Radiative
//! Transfer*, 1.15 (Stokes vectors); each file names its own.
//! Guarantee: reflected and transmitted shares of a lossless interface add up to 1 to the last bit; every sampled
//! lobe has a density that its samples follow, tested against closed forms.
//! Known weakness: geometrical optics alone. No interference beyond what a coating table states, no fluorescence,
//! no birefringence, no gradient index.

mod abg;
pub mod catalogue;
mod cie_daylight;
mod cie_observer;
mod coating;
mod colour;
mod dispersion;
mod effects;
mod error;
mod facet_normals;
pub mod fresnel;
mod intensity;
mod media;
mod phase;
pub mod polarised;
mod refraction;
pub mod sampling;
mod scatter;
mod spectrum;
mod table;
#[cfg(test)]
mod testing;
mod wavelengths;

pub use abg::Abg;
pub(crate) use cie_observer::observer_range;
pub use cie_observer::{MAX_EFFICACY, observer_peaks, xyz_of_watt};
pub use coating::{Coating, CoatingTable, Split};
pub use colour::{chromaticity, linear_srgb, srgb_byte};
pub use dispersion::{Dispersion, Pole};
pub use effects::{Effect, Effects};
pub use error::{Error, ErrorKind};
pub use facet_normals::FacetNormals;
pub use intensity::IntensitySampler;
pub use media::{Absorption, Index, Medium, line};
pub use phase::BulkScatter;
pub use refraction::{reflect, refract, refract_with_cosine};
pub use scatter::{Lobe, Scatter};
pub use spectrum::{Spectrum, WhiteLed};
pub use table::Table;
pub use wavelengths::Wavelengths;

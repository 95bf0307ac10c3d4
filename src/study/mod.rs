//! The cross-check that explains every disagreement between intersectors, and the studies of what accuracy costs in time.
//!
//! Everything here works on `&dyn Intersector` and returns plain structs that serialise to the rows of the command's
//! JSON; drawing and printing them is the work of `report` and `cli`. Expected figures come from closed forms, from the
//! certified spline intersector, or from published tables, never from the intersector under test.
//!
//! Guarantee: the same seed gives the same rays, verdicts and counts for any number of threads. Times are taken in
//! alternating rounds and given as minimum, median and 90th percentile.
//! Known weakness: a verdict "explained" says that the difference lies inside the band that the facets' sag allows; it
//! does not say that the facets are as good as they could be.

pub mod accuracy;
pub mod accuracy_target;
pub mod arbiter;
pub mod complexity;
mod counted_work;
pub mod cross_check;
pub mod default_accuracy;
pub mod effects;
mod facet_errors;
pub mod figures;
pub mod geometric_error;
mod hit_errors;
pub mod interpolation;
pub mod lamp;
mod lift;
mod mesh_source;
pub mod model_figures;
mod model_mesh_source;
mod quantiles;
mod random;
pub mod rays;
pub mod receivers;
pub mod records;
pub mod sample_models;
mod scene_accuracy;
pub mod stability;
mod stored_choice;
pub mod surface_rays;
mod timing;
mod tolerance_plan;
mod tracing_way;
mod worst_figure;

pub use facet_errors::facet_errors;
#[cfg(feature = "report")]
pub(crate) use hit_errors::slope;
pub use lift::Lift;
pub use mesh_source::{FacetTree, MeasuredMesh, MeshSource};
pub use model_mesh_source::ModelMeshSource;
pub use quantiles::{Quantiles, Summary};
pub use random::Random;
pub use scene_accuracy::scene_accuracy;
pub use timing::{Progress, Rounds, Timing};

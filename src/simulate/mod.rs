//! Light through a scene: sources, media, receivers, the path kernel, random streams and tallies.
//!
//! Forward non-sequential Monte Carlo on any [`Intersector`](crate::intersect::Intersector): wavefronts of rays, unpolarised
//! Fresnel and total internal reflection at interfaces, mirrors, absorbers. A [`Scene`] is read from TOML, bound to a model
//! ([`Scene::bind`]) and simulated ([`simulate()`]).
//!
//! Sources: Philox (Salmon et al., SC 2011); Sobol nets (Joe and Kuo 2008) with hashed Owen scrambling (Burley 2020); laws from
//! [`crate::optics`].
//! Guarantee: the same bits for any number of threads, batch size and shards, and for the smallest kernel that a scene needs as for
//! the one that can do everything; energy closes to the last quantum (9e-13 of a ray); no start offset anywhere; every ray that is
//! lost is kept with its cause.
//! Known weakness: geometrical optics; a path carries at most 7 bodies inside each other.

mod arrivals;
mod assemble;
mod bind;
mod digest;
mod effects;
mod emitter;
mod error;
mod gather;
mod kernel;
mod plan;
mod portion;
pub mod random;
mod receiver;
mod recorder;
mod results;
mod run;
pub mod scene;
mod tally;
mod verify;

pub use arrivals::arrivals;
pub use bind::BoundScene;
pub use effects::{Because, Required};
pub use error::{Error, ErrorKind};
pub use kernel::{Cause, Counts, Event, LostRay, PathSink, PathVertex, Tallies};
pub use portion::{Fingerprint, Portion};
pub use results::{Absorbed, ChannelResult, EffectsUsed, Power, ReceiverResult, Results, Seconds};
pub use run::{
    Hooks, KernelChoice, Progress, RunSettings, Traced, kernel_name, replay, replicates, simulate, trace,
};
pub use scene::Scene;
pub use tally::{Moments, QUANTA, Spread, Sum};
pub use verify::{Verification, verify_pruning};

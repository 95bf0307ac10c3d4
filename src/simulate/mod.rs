//! Light through a scene: sources, media, receivers, the path kernel, random streams and tallies.
//!
//! Forward non-sequential Monte Carlo on any [`Intersector`](crate::intersect::Intersector): wavefronts of rays, refraction, Fresnel and
//! total internal reflection at interfaces, mirrors, coatings, scatter and absorbers, unpolarised unless a scene asks for
//! polarisation. A [`Scene`] is read from TOML, bound to a model ([`Scene::bind`]) and simulated ([`simulate()`]).
//!
//! Sources: Philox (Salmon et al., SC 2011); Sobol nets (Joe and Kuo 2008) with hashed Owen scrambling (Burley 2020); laws from
//! [`crate::optics`].
//! Guarantee: the same bits for any number of threads, batch size and shards, and for the smallest kernel that a scene needs as for
//! the one that can do everything; energy closes to the last quantum (9e-13 of a ray); a ray starts exactly where it left a face, and
//! is moved by the glue distance only where two faces are one; every loss is counted, and the first 1000 lost rays are kept with
//! their cause.
//! Known weakness: geometrical optics; a path carries at most 7 bodies inside each other.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod arrivals;
mod assemble;
mod bind;
mod body;
mod channels;
mod digest;
mod disc_cells;
mod dispatch;
mod effects;
mod emitter;
mod error;
mod face_foot;
mod face_results;
mod far_angles;
mod fingerprint;
mod gather;
mod grid;
mod hooks;
mod kernel;
mod listed_rays;
mod lost_light;
mod outcome;
mod partial_run;
mod partial_run_error;
mod partial_run_file;
mod path_sample;
mod plan;
mod pole_rings;
mod power_scale;
pub mod random;
mod receiver;
mod receiver_results;
mod recorded_ways;
mod recorder;
mod results;
mod run;
mod run_notes;
pub mod scene;
mod seconds;
mod sequence;
mod sequence_recorder;
mod sequence_results;
mod sequence_sums;
mod settings;
mod source_share;
mod surfaces;
mod tallies;
mod tally;
mod trim_loops;
mod verify;
mod wavelength_text;

pub use arrivals::arrivals;
pub use bind::{BoundScene, LeftOut, RuleFaces, face_selectors};
pub use dispatch::kernel_name;
pub use effects::{EffectReason, RequiredEffects};
pub use error::{Error, ErrorKind};
pub use face_results::{FaceResult, FaceResults};
pub use fingerprint::{Fingerprint, FingerprintHasher};
pub use hooks::{Hooks, Progress, ReplicateHook, TracedRun};
pub use kernel::MediaBeside;
pub use listed_rays::{ListedEnd, MOST_LISTED_RAYS, listed_ends, ray_lists};
pub use outcome::{Counts, Event, LostCause, LostRay, PathSink, PathVertex};
pub use partial_run::PartialRun;
pub use partial_run_error::PartialRunError;
pub use path_sample::PathSample;
pub use plan::GROWING_REPLICATE;
// Reports level the rings of their grids too.
#[cfg(feature = "report")]
pub(crate) use pole_rings::PoleRings;
pub use receiver_results::{ChannelResult, ReceiverResult};
pub use recorded_ways::{RecordedWay, recorded_ways};
pub use results::{Absorbed, EffectsUsed, Power, Results};
pub use run::{
    ask_again, grows, rays_of_run, replay, replicate_range, replicates, shard_replicates, simulate, trace,
};
pub use scene::{MOST_RAYS, Scene};
pub use seconds::{MergedSeconds, Seconds};
pub use sequence::{MOST_STEPS, Sequence, SequenceStep};
pub use sequence_results::{ReceiverSequences, SequenceResult};
pub use sequence_sums::SequenceSums;
pub(crate) use settings::machine_threads;
pub use settings::{KernelChoice, RunSettings};
pub use tallies::{ReplicateTally, Tallies};
pub use tally::{MomentSpread, Moments, QUANTA, Sum};
pub use verify::{Verification, verify_pruning};

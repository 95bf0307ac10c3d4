//! The main job: a scene and its models are read, faceted, given tolerance, normals and intersector where none were requested,
//! traced, and every figure comes with both its errors. The command and the Python package run it through here alone.
//!
//! ```no_run
//! use lampyris::pipeline::{PreparedScene, SceneJob, Silent, TraceRequest, read_scene};
//!
//! let (scene, loaded) = read_scene("lamp.toml".as_ref(), &Silent)?;
//! let prepared = PreparedScene::new(SceneJob::new(scene, loaded), &Silent)?;
//! let run = prepared.trace(TraceRequest::default(), &Silent).expect("nothing stops it");
//! for (receiver, figures) in run.results.receivers.iter().zip(run.figures(&prepared)) {
//!     let power = figures.power;
//!     println!("{}: {} ± {} ± {:?}", receiver.name, power.value, power.statistical, power.geometric);
//! }
//! # Ok::<(), lampyris::pipeline::Error>(())
//! ```
//!
//! Guarantee: the same scene, files and settings give the same bits, whoever calls and whichever monitor listens.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod accuracy_target;
mod cache;
mod cached_model;
mod checksum;
mod cross_check;
mod default_accuracy;
mod error;
mod error_target;
mod expected_facets;
mod facets;
mod fingerprint;
mod growing_search;
mod intersectors;
mod loading;
mod monitor;
mod prepared_scene;
mod ray_recorder;
mod scene_job;
mod scene_results;
mod settings;
mod settled_target;
mod turn;
mod verdicts;

pub use accuracy_target::{AccurateSettings, settings_for_accuracy, settings_for_accurate_facets};
pub use cache::{Cache, CacheEntry, PROGRAM};
pub use default_accuracy::is_accuracy_asked;
pub use error::{Error, ErrorKind, Excerpt};
pub use error_target::{ErrorTarget, TargetResult};
pub use facets::{angle_note, mesh_settings, tessellate_by_part, tessellate_model};
pub use growing_search::{GrowingSearch, RunKeeper, Unkept};
pub use intersectors::{IntersectorChoice, in_one_scene, refuse_facet_normals, with_intersector};
pub use loading::{LoadedModel, read_cached_scene, read_models, read_scene, read_scene_models, step_settings};
pub use monitor::{Monitor, Silent, Stage};
pub use prepared_scene::{PreparedScene, TraceRequest};
pub use ray_recorder::RayRecorder;
pub use scene_job::{PartChoice, SceneJob};
pub use scene_results::SceneResults;
pub use settings::{IntersectorKind, MeshingSettings, RayRange, TracingSettings, normal_mode};
pub use settled_target::trace_until_settled;
pub use verdicts::ReceiverVerdict;

//! What commands share: from options and files to facets, intersectors and runs.
//!
//! Inner modules, each of which sees only those before it: `threads`, `input_files`, `facets` and `intersectors` (the
//! ingredients), `output_place`, `ray_sampler`, `path_file`, `shards` and `accuracy_target`, `default_accuracy` and `scene_run`
//! with `cross_check` (the run),
//! `lost_rays`, `results_folder`, `tally_file`, `checkpoint`, `error_target` `paired_receivers` and `contenders` (what is made of it).

pub(super) mod accuracy_target;
pub(super) mod checkpoint;
pub(super) mod contenders;
pub(super) mod cross_check;
pub(super) mod default_accuracy;
pub(super) mod error_target;
pub(super) mod facets;
pub(super) mod input_files;
pub(super) mod intersectors;
pub(super) mod lost_rays;
pub(super) mod output_place;
pub(super) mod paired_receivers;
pub(super) mod path_file;
pub(super) mod ray_sampler;
pub(super) mod results_folder;
pub(super) mod scene_run;
pub(super) mod shards;
pub(super) mod tally_file;
pub(super) mod threads;

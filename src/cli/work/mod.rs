//! What commands share: from options and files to runs, and what is made of these.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

pub(super) mod cache_folder;
pub(super) mod checkpoint;
pub(super) mod contenders;
pub(super) mod end_file;
pub(super) mod input_files;
pub(super) mod input_guard;
pub(super) mod lost_rays;
pub(super) mod output_place;
pub(super) mod paired_receivers;
pub(super) mod part_sum;
pub(super) mod path_file;
pub(super) mod ray_input;
pub(super) mod results_folder;
pub(super) mod run_commands;
pub(super) mod shards;
pub(super) mod tally_file;
pub(super) mod terminal_monitor;
pub(super) mod threads;
pub(super) mod usage;

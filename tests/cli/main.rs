//! The command as a user starts it: every test runs the real binary and judges its output, exit code and files.

mod arguments;
mod cache;
mod check;
mod cluster;
mod demo;
mod documented_keys;
#[path = "../support/files.rs"]
mod files;
mod growing;
mod headlamp;
mod info;
mod left_out;
mod mishaps;
mod names;
mod newcomer;
mod outputs;
mod overrides;
mod race;
mod ray_files;
mod receiver_files;
mod resumed;
mod runs;
mod scene;
mod studies;
mod support;
mod threads;

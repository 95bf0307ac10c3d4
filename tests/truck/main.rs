//! The door to the truck kernel: its solids in, our faces out.

mod export;
#[path = "../support/files.rs"]
mod files;
mod import;

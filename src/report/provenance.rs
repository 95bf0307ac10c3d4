//! Where the numbers of a report come from.

use serde::Serialize;

/// Where numbers come from: everything needed to get them again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// The command as it can be typed again.
    pub command: String,
    /// The commands that traced the parts of a merged run, or of one that went on with their sum, each once; empty for any other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub traced_by: Vec<String>,
    /// When it began, UTC, as ISO 8601 has it.
    pub time: String,
    /// Version of the program.
    pub version: String,
    /// Commit it was built from; `unknown` outside release builds.
    pub commit: String,
    /// Processor, cores, memory, system.
    pub hardware: String,
    /// Threads used.
    pub threads: usize,
    /// Seed of the random numbers, where there were any.
    pub seed: Option<u64>,
}

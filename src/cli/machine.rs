//! What the machine is, as far as the system tells: processor, cores, memory, name.

use crate::formats::file_stem;
use std::fs;

/// As the system counts memory.
const KILOBYTES_PER_GB: f64 = 1_000_000.0;

/// Describes processor, number of cores, memory and system in words, as far as the system tells.
pub(crate) fn hardware() -> String {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let cpu = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| field_value(&text, "model name"));
    // Not every kernel names its processor: then its architecture is said.
    let cpu = cpu.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let memory = fs::read_to_string("/proc/meminfo").ok().and_then(|text| kilobyte_field(&text, "MemTotal"));
    let mut parts = vec![cpu, format!("{cores} cores")];
    parts.extend(memory.map(|kb| format!("{:.0} GB", kb as f64 / KILOBYTES_PER_GB)));
    parts.push(std::env::consts::OS.to_owned());
    parts.join(", ")
}

/// Returns what follows the colon in the first line that begins with the key; `None` without one.
fn field_value(text: &str, key: &str) -> Option<String> {
    let line = text.lines().find(|l| l.starts_with(key))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Returns the number in the line of that key, which counts kilobytes.
fn kilobyte_field(text: &str, key: &str) -> Option<u64> {
    field_value(text, key)?.split_whitespace().next()?.parse().ok()
}

/// The name that the machine has in its network.
#[cfg(unix)]
pub(crate) fn name() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

/// The name that the machine has in its network.
#[cfg(not(unix))]
pub(crate) fn name() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_else(|_| "one machine".into())
}

/// What no other process of any machine of a shared folder is called, safe in a file name.
pub(crate) fn process_name() -> String {
    format!("{}-{}", file_stem(&name()), std::process::id())
}

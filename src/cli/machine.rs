//! The machine, as far as the system reports it: processor, cores, memory, name.

use crate::formats::file_stem;
use crate::simulate::machine_threads;
use crate::text::count_of;
use std::fs;
use std::time::SystemTime;

/// As the system counts memory.
const KILOBYTES_PER_GB: f64 = 1_000_000.0;

/// Describes processor, number of cores, memory and system in words, as far as the system reports them.
pub(crate) fn hardware() -> String {
    let cores = machine_threads();
    let cpu = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| field_value(&text, "model name"));
    // Not every kernel names its processor: then its architecture is said.
    let cpu = cpu.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let memory = fs::read_to_string("/proc/meminfo").ok().and_then(|text| kilobyte_field(&text, "MemTotal"));
    let mut parts = vec![cpu, count_of(cores as u64, "core")];
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

/// Returns a time in UTC as ISO 8601 has it, to the second: `2026-11-22T23:45:00Z`. The start of 1970 stands for a clock before it.
pub(crate) fn utc_text(time: SystemTime) -> String {
    let seconds = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Years that begin on 1 March, in eras of 400 (Hinnant, chrono-Compatible Low-Level Date Algorithms, civil_from_days).
    let (era, day) = ((days + 719_468) / 146_097, (days + 719_468) % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let march = (5 * day + 2) / 153;
    let month = if march < 10 { march + 3 } else { march - 9 };
    let (year, day) = (year + 400 * era + u64::from(month <= 2), day - (153 * march + 2) / 5 + 1);
    let [hour, minute, second] = [second / 3600, second / 60 % 60, second % 60];
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
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

/// Returns a name that no other process of any machine of a shared folder has, safe in a file name.
pub(crate) fn process_name() -> String {
    format!("{}-{}", file_stem(&name()), std::process::id())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By `date -u -d @SECONDS`: a leap day of a century, the ends of a year, and a day of the next century.
    #[test]
    fn times_are_those_of_the_calendar() {
        let times = [
            (0, "1970-01-01T00:00:00Z"),
            (951_827_696, "2000-02-29T12:34:56Z"),
            (1_798_761_599, "2026-12-31T23:59:59Z"),
            (1_798_761_600, "2027-01-01T00:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ];
        for (seconds, text) in times {
            assert_eq!(utc_text(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(seconds)), text);
        }
    }
}

//! Who writes a file: the number of a process says it on one machine alone, and folders are shared.
//!
//! Known weakness: where the system does not identify the machine, two machines that share a folder differ only by their processes'
//! numbers.

use std::fmt;
use std::sync::OnceLock;
use std::time::Duration;

/// What identifies this boot of this machine, and its process numbering: each container of a machine numbers its processes from 1.
const SOURCES: [&str; 2] = ["/proc/sys/kernel/random/boot_id", "/proc/sys/kernel/hostname"];
/// See [`SOURCES`]: a link.
const PROCESS_NUMBERS: &str = "/proc/self/ns/pid";
/// Names of machines where there is no `/proc`.
const VARIABLES: [&str; 2] = ["COMPUTERNAME", "HOSTNAME"];

/// How long a file may have stood still before a writer that cannot be asked is taken for gone.
const STILL: Duration = Duration::from_secs(86_400);

/// A process of a machine, written as `1a2b3c4d.4711`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Writer {
    /// Mark of the machine; of a file that an earlier version wrote none.
    machine: Option<u32>,
    process: u32,
}

impl Writer {
    /// This process.
    pub(super) fn this() -> Self {
        Self { machine: Some(this_machine()), process: std::process::id() }
    }

    /// The writer whose name, or process number alone, a text begins with; `None` where it begins with neither.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let (first, rest) = text.split_once('.')?;
        let number = |text: &str| {
            let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
            text[..end].parse().ok()
        };
        // Eight digits are the mark of a machine, which a process follows.
        match u32::from_str_radix(first, 16).ok().filter(|_| first.len() == 8).zip(number(rest)) {
            Some((machine, process)) => Some(Self { machine: Some(machine), process }),
            None => Some(Self { machine: None, process: number(first)? }),
        }
    }

    /// Whether it is no more, going by its number where that means anything here, else by whether its file has stood still for longer than
    /// [`STILL`].
    pub(super) fn is_gone(&self, still: Option<Duration>) -> bool {
        if self.machine == Some(this_machine())
            && let Some(runs) = runs_here(self.process)
        {
            return !runs;
        }
        still.is_some_and(|still| still > STILL)
    }
}

impl fmt::Display for Writer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(machine) = self.machine {
            write!(f, "{machine:08x}.")?;
        }
        write!(f, "{}", self.process)
    }
}

/// Whether a process of this machine runs; `None` where the system does not report it: only Linux shows processes as folders.
fn runs_here(process: u32) -> Option<bool> {
    let shows = std::fs::exists("/proc/self").ok()?;
    if shows { std::fs::exists(format!("/proc/{process}")).ok() } else { None }
}

/// The mark of this machine: a hash of what identifies it, its boot and its process numbering, computed once.
fn this_machine() -> u32 {
    static MARK: OnceLock<u32> = OnceLock::new();
    *MARK.get_or_init(|| {
        let mut identity: Vec<String> =
            SOURCES.iter().filter_map(|path| std::fs::read_to_string(path).ok()).collect();
        identity.extend(std::fs::read_link(PROCESS_NUMBERS).map(|link| link.to_string_lossy().into_owned()));
        // Shells of one machine need not agree on these.
        if identity.is_empty() {
            identity.extend(VARIABLES.iter().filter_map(|name| std::env::var(name).ok()));
        }
        crc32fast::hash(identity.join("\n").as_bytes())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back() {
        let this = Writer::this();
        assert_eq!(Writer::parse(&format!("{this}-0")), Some(this));
        assert_eq!(Writer::parse(&format!("{this}.point")), Some(this));
        // As earlier versions wrote them: whose machine is not known.
        assert_eq!(Writer::parse("4711-0.part"), Some(Writer { machine: None, process: 4711 }));
        assert_eq!(Writer::parse("12345678.point.part"), Some(Writer { machine: None, process: 12_345_678 }));
        assert_eq!(Writer::parse("notes.txt"), None);
    }

    /// No process has the largest number.
    #[test]
    #[cfg(target_os = "linux")]
    fn processes_of_other_machines_are_not_taken_for_dead() {
        let this = Writer::this();
        let dead = Writer { process: u32::MAX, ..this };
        let [now, long_ago] = [Some(Duration::ZERO), Some(2 * STILL)];
        assert!(!this.is_gone(long_ago) && dead.is_gone(now));
        for machine in [None, Some(this_machine() ^ 1)] {
            let other = Writer { machine, process: u32::MAX };
            assert!(!other.is_gone(now) && !other.is_gone(None) && other.is_gone(long_ago));
        }
    }
}

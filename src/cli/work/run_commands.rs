//! The commands that traced a run: its results name them, and so does the file that it is saved in.

use crate::cli::console::Console;
use crate::report::Provenance;
use crate::text::natural_order;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The commands that traced a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RunCommands {
    /// The one that began the run.
    pub(crate) command: String,
    /// What that one searches for with runs of growing length; `None` where it asks for a single run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    search: Option<String>,
    /// Those that traced the parts of a sum, or of a run that continues one; empty where `command` says all.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    traced_by: BTreeSet<String>,
}

impl RunCommands {
    /// Returns those of a run that the command of this process begins, and what it searches for, if it does.
    pub(crate) fn new(search: Option<String>, console: &Console) -> Self {
        Self { command: console.command.clone(), search, traced_by: BTreeSet::new() }
    }

    /// Returns the same of a sum of parts that these commands traced.
    pub(crate) fn with_parts(self, traced_by: BTreeSet<String>) -> Self {
        Self { traced_by, ..self }
    }

    /// Returns the commands of a run that this command continues and that the `earlier` ones traced so far. The one that began it says
    /// all, except for a sum of parts.
    pub(crate) fn continue_from(self, earlier: &Self) -> Self {
        let mut commands = earlier.clone();
        if !commands.traced_by.is_empty() {
            commands.traced_by.insert(self.command);
        }
        commands
    }

    /// Returns those of a run that the search of this command comes to after a shorter run, which was owed to the `earlier` ones. None of
    /// its rays are theirs: they began it only if they search for the same.
    pub(crate) fn search_on_from(self, earlier: &Self) -> Self {
        if self.search.is_some() && self.search == earlier.search {
            Self { command: earlier.command.clone(), ..self }
        } else {
            self
        }
    }

    /// Returns those that traced what there is of the run.
    pub(crate) fn tracers(&self) -> BTreeSet<String> {
        if self.traced_by.is_empty() { BTreeSet::from([self.command.clone()]) } else { self.traced_by.clone() }
    }

    /// Returns where the numbers of the run come from, which this process writes.
    pub(crate) fn provenance(&self, seed: u64, threads: usize, console: &Console) -> Provenance {
        let mut traced_by: Vec<String> = self.traced_by.iter().cloned().collect();
        // The report shows the first of them: those of the first parts.
        traced_by.sort_by(|a, b| natural_order(a, b));
        Provenance { command: self.command.clone(), traced_by, ..console.provenance(Some(seed), threads) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commands(command: &str, search: Option<&str>, traced_by: &[&str]) -> RunCommands {
        let traced_by = traced_by.iter().map(|&command| command.to_owned()).collect();
        RunCommands { command: command.into(), search: search.map(str::to_owned), traced_by }
    }

    /// However often a run is continued, it is that of the command that began it; parts are named with what traced the rest.
    #[test]
    fn a_run_that_goes_on_is_that_of_its_first_command() {
        let begun = commands("first", None, &[]);
        let second = commands("second", Some("1%"), &[]).continue_from(&begun);
        assert_eq!(commands("third", None, &[]).continue_from(&second), begun);
        let sum = commands("merge", None, &["a", "b"]);
        assert_eq!(commands("last", None, &[]).continue_from(&sum), commands("merge", None, &["a", "b", "last"]));
    }

    /// A longer run has no ray of the one before it: another command than its own comes to it only by the same search.
    #[test]
    fn a_longer_run_is_that_of_the_command_that_began_its_search() {
        let own = || commands("own", Some("1%"), &[]);
        let same = commands("first", Some("1%"), &[]);
        assert_eq!(own().search_on_from(&same), commands("first", Some("1%"), &[]));
        for other in [commands("first", Some("2%"), &[]), commands("first", None, &[])] {
            assert_eq!(own().search_on_from(&other), own());
        }
        assert_eq!(own().search_on_from(&commands("merge", None, &["a", "b"])), own());
        // A search that continues the run of another command did not begin it, and that command does not explain its result.
        let resumed = own().continue_from(&commands("plain", None, &[]));
        assert_eq!(commands("again", Some("1%"), &[]).search_on_from(&resumed), commands("again", Some("1%"), &[]));
    }

    #[test]
    fn parts_are_traced_by_their_own_command_or_those_of_their_parts() {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<BTreeSet<String>>();
        assert_eq!(commands("a", None, &[]).tracers(), names(&["a"]));
        assert_eq!(commands("merge", None, &["a", "b"]).tracers(), names(&["a", "b"]));
    }
}

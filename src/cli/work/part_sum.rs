//! The sum of the parts of a run that are there: each file is read once, though the folder is looked at again and again.

use super::tally_file::TallyHeader;
use super::usage::Usage;
use crate::cli::failure::Failure;
use crate::simulate::{BoundScene, GROWING_REPLICATE, PartialRun, PartialRunError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What shows that a file was rewritten: its length and time of writing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    /// `None` for a file that is not there.
    fn new(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        Some(Self { length: metadata.len(), modified: metadata.modified().ok() })
    }
}

/// What parts of a run must agree with, and how far it is to go.
pub(crate) struct AskedRun {
    /// Header of the first part.
    pub(crate) first: TallyHeader,
    /// Fingerprint of the scene as it is.
    pub(crate) fingerprint: String,
    /// The scene, where the command line names it.
    pub(crate) scene: Option<PathBuf>,
    /// How long a run that grows is to be; `None` for as long as its parts say.
    pub(crate) rays: Option<u64>,
}

/// Why a part cannot be added to the others.
#[derive(Debug)]
pub(crate) enum PartFailure {
    /// Its file has no end, as while it is still being copied.
    CutShort(Failure),
    /// Waiting changes nothing.
    Lasting(Failure),
}

impl PartFailure {
    /// Returns the failure of a file of these bytes.
    fn new(path: &Path, bytes: &[u8], error: &PartialRunError) -> Self {
        let failure = input_failure(path, error);
        if PartialRun::is_cut_short(bytes) { Self::CutShort(failure) } else { Self::Lasting(failure) }
    }
}

impl From<Failure> for PartFailure {
    fn from(failure: Failure) -> Self {
        Self::Lasting(failure)
    }
}

/// Origins of the parts of a sum.
#[derive(Clone, Debug, Default)]
pub(crate) struct PartOrigins {
    /// What they took.
    pub(crate) usage: Usage,
    /// The commands that traced them.
    pub(crate) traced_by: BTreeSet<String>,
}

impl PartOrigins {
    /// Adds those of other parts.
    fn add(&mut self, other: Self) {
        self.usage.add(&other.usage);
        self.traced_by.extend(other.traced_by);
    }
}

/// Parts of a run and their sum.
pub(crate) struct PartSum {
    asked: AskedRun,
    /// The files that are in the sum, as they were when they were read.
    files: BTreeMap<PathBuf, Option<Stamp>>,
    total: PartialRun,
    origins: PartOrigins,
}

impl PartSum {
    pub(crate) fn new(asked: AskedRun) -> Self {
        Self { asked, files: BTreeMap::new(), total: PartialRun::default(), origins: PartOrigins::default() }
    }

    /// Adds those of these files that are not in the sum yet, and returns it; begins anew where one that is has changed or is no longer
    /// among them.
    ///
    /// # Errors
    /// When there is no file, one cannot be read, is of another run or holds what another one does, or the parts reach beyond the rays that
    /// were asked for.
    pub(crate) fn add_new(&mut self, files: &[PathBuf], bound: &BoundScene) -> Result<&PartialRun, PartFailure> {
        // Before they are read: what is written meanwhile is seen the next time.
        let stamped: Vec<(&PathBuf, Option<Stamp>)> = files.iter().map(|file| (file, Stamp::new(file))).collect();
        let present: BTreeMap<&PathBuf, Option<Stamp>> = stamped.iter().copied().collect();
        if self.files.iter().any(|(file, stamp)| stamp.is_none() || present.get(file) != Some(stamp)) {
            // Nothing can be taken out of a sum.
            self.files.clear();
            (self.total, self.origins) = Default::default();
        }
        // A file that is named twice is read twice, and refused.
        let new: Vec<_> = stamped.into_iter().filter(|(file, _)| !self.files.contains_key(*file)).collect();
        for (file, stamp) in new {
            let (part, origins) = self.read(file, bound)?;
            if self.files.is_empty() {
                self.total = part;
            } else {
                self.total.merge(&part).map_err(|error| self.not_merged(file, &error, &part, bound))?;
            }
            self.origins.add(origins);
            self.files.insert(file.clone(), stamp);
        }
        if self.files.is_empty() {
            return Err(Failure::arguments("merge: no parts given").into());
        }
        self.reach_asked_rays()?;
        Ok(&self.total)
    }

    /// Returns the sum, and what made its parts.
    pub(crate) fn into_total(self) -> (PartialRun, PartOrigins) {
        (self.total, self.origins)
    }

    /// Reads a part, and what made it.
    fn read(&self, path: &Path, bound: &BoundScene) -> Result<(PartialRun, PartOrigins), PartFailure> {
        let mut origins = PartOrigins::default();
        let check = |header: &TallyHeader| {
            origins = PartOrigins { usage: header.usage.clone(), traced_by: header.commands.tracers() };
            self.check(header)
        };
        let bytes = read_part(path)?;
        let part =
            PartialRun::read(&bytes, check, bound).map_err(|error| PartFailure::new(path, &bytes, &error))?;
        Ok((part, origins))
    }

    /// Checks that a part is of the run that the first one's header names, traced from the scene as it is.
    fn check(&self, header: &TallyHeader) -> Result<(), String> {
        let AskedRun { first, fingerprint, scene, .. } = &self.asked;
        if header.fingerprint == *fingerprint {
            return Ok(());
        }
        Err(if let Some(other) = header.other_program() {
            format!("it was traced {other}: trace all parts, and merge them, with the same program")
        } else if header.fingerprint == first.fingerprint {
            match scene {
                Some(given) => {
                    format!(
                        "--scene {} is not the scene that this part was traced from, or a file that it names has changed",
                        given.display()
                    )
                }
                None => format!(
                    "the scene {} or a file that it names has changed since this part was traced",
                    header.scene().display()
                ),
            }
        } else if header.accuracy != first.accuracy {
            format!(
                "it is part of another run ({}): traced with {}, the first part with {}; give both the same",
                header.commands.command, header.accuracy, first.accuracy
            )
        } else {
            let difference = header.difference(first).map_or_else(String::new, |words| format!(": traced {words}"));
            format!("it is part of another run ({}) than the first one{difference}", header.commands.command)
        })
    }

    /// Says why a part cannot be added to the others, which are read again, and which of them holds the same.
    fn not_merged(&self, path: &Path, error: &PartialRunError, part: &PartialRun, bound: &BoundScene) -> Failure {
        let shares = |other: &PartialRun| part.done.iter().any(|k| other.done.binary_search(k).is_ok());
        let failure = input_failure(path, error);
        match self.files.keys().find(|file| self.read(file, bound).is_ok_and(|(other, _)| shares(&other))) {
            Some(file) => failure.with_help(format!("{} holds it too: leave one of the two out", file.display())),
            None => failure,
        }
    }

    /// Sets how long a run that grows is to be, where that was asked for.
    fn reach_asked_rays(&mut self) -> Result<(), Failure> {
        let Some(rays) = self.asked.rays else { return Ok(()) };
        // As many whole replicates as hold these rays.
        let replicates = u32::try_from(rays.div_ceil(GROWING_REPLICATE)).unwrap_or(u32::MAX);
        let sum = &mut self.total;
        if !sum.grows || replicates < sum.replicates {
            let there = u64::from(sum.replicates) * GROWING_REPLICATE;
            let (message, help) = if sum.grows {
                (format!("the parts reach to ray {there}"), format!("give {there} or more, or leave --rays out"))
            } else {
                let help = "leave --rays out: parts of `lampyris trace --rays A..B` grow";
                ("the run does not grow".into(), help.into())
            };
            return Err(Failure::arguments(format!("--rays {rays}: {message}")).with_help(help));
        }
        sum.replicates = replicates;
        Ok(())
    }
}

/// Returns the failure of an input file.
pub(crate) fn input_failure(path: &Path, message: impl std::fmt::Display) -> Failure {
    Failure::input(format!("{}: {message}", path.display()))
}

/// Returns the header of a part.
pub(crate) fn read_header(path: &Path) -> Result<TallyHeader, PartFailure> {
    let bytes = read_part(path)?;
    PartialRun::header(&bytes).map_err(|error| PartFailure::new(path, &bytes, &error))
}

/// Returns the bytes of a part.
fn read_part(path: &Path) -> Result<Vec<u8>, Failure> {
    crate::formats::read_bytes(path).map_err(|e| input_failure(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::simulate::{RunSettings, Scene, replicates};

    fn header() -> TallyHeader {
        let fields = serde_json::json!({"fingerprint": "f", "scene": "s", "part": [], "command": "c"});
        serde_json::from_value(fields).unwrap()
    }

    #[test]
    fn a_part_of_another_program_is_refused_by_its_name() {
        let traced = |program: &str| {
            let fields = serde_json::json!({"fingerprint": "other", "scene": "s", "part": [], "command": "c",
                "program": program});
            serde_json::from_value::<TallyHeader>(fields).unwrap()
        };
        let sum = PartSum::new(AskedRun { first: header(), fingerprint: "f".into(), scene: None, rays: None });
        let refused = sum.check(&traced("0.0.1 0123456789ab")).unwrap_err();
        assert!(refused.contains("traced by lampyris 0.0.1 0123456789ab, and this is lampyris "), "{refused}");
        assert!(sum.check(&traced(crate::pipeline::PROGRAM)).unwrap_err().contains("another run"));
        assert!(sum.check(&header()).is_ok());
    }

    #[test]
    fn a_part_of_another_run_is_told_by_what_differs() {
        let sum = PartSum::new(AskedRun { first: header(), fingerprint: "f".into(), scene: None, rays: None });
        let refused = |seed: Option<u64>, rays: u64, scene: &str| {
            let fields = serde_json::json!({"fingerprint": "other", "scene": scene, "part": [], "command": "c",
                "program": crate::pipeline::PROGRAM, "seed": seed, "run_rays": rays});
            sum.check(&serde_json::from_value(fields).unwrap()).unwrap_err()
        };
        for (seed, rays, scene, says) in [
            (Some(9), 0, "s", ": traced with seed 9, the first part with the seed of its scene"),
            (None, 1234, "t", ": traced with 1234 rays, the first part with 0 rays"),
            // Scenes may be copies: where they lie is reported where nothing else differs.
            (None, 0, "t", ": traced with the scene t, the first part with the scene s"),
            // Both grow.
            (None, 10_000, "s", "than the first one"),
        ] {
            let refused = refused(seed, rays, scene);
            assert!(refused.ends_with(says), "{refused}");
        }
    }

    #[test]
    fn a_part_is_read_once_and_anew_where_it_has_changed() {
        let text = "[run]\nrays = 1000\n[[source]]\nkind = 'point'\nat = [0, 0, 0]\n";
        let bound = Scene::parse(text, "s.toml", Path::new(".")).unwrap().bind(&Model::default()).unwrap();
        let of_run = replicates(&bound, &RunSettings::from(&bound.scene().run));
        let folder = tempfile::tempdir().unwrap();
        let files = ["a.tally", "b.tally"].map(|name| folder.path().join(name));
        for (replicate, file) in (0..).zip(&files) {
            let part =
                PartialRun { done: vec![replicate], ..PartialRun::done_elsewhere(&bound, of_run, Vec::new()) };
            part.write(&header(), &mut std::fs::File::create(file).unwrap()).unwrap();
        }
        let asked = AskedRun { first: header(), fingerprint: "f".into(), scene: None, rays: None };
        let mut sum = PartSum::new(asked);
        let done = |sum: &mut PartSum, files: &[PathBuf]| sum.add_new(files, &bound).map(|sum| sum.done.clone());
        assert_eq!(done(&mut sum, &files[..1]).ok(), Some(vec![0]));
        // Of the same length and time it is not read again, even if it was unreadable.
        let length = std::fs::metadata(&files[0]).unwrap().len() as usize;
        let modified = std::fs::metadata(&files[0]).unwrap().modified().unwrap();
        std::fs::write(&files[0], vec![b'x'; length]).unwrap();
        let handle = std::fs::File::options().write(true).open(&files[0]).unwrap();
        handle.set_modified(modified).unwrap();
        assert_eq!(done(&mut sum, &files).ok(), Some(vec![0, 1]));
        // One that is gone is no longer in the sum, and one that has changed is read.
        assert_eq!(done(&mut sum, &files[1..]).ok(), Some(vec![1]));
        assert!(done(&mut sum, &files).is_err());
        // One that is still being copied may be waited for; what is no part of a run is none later either.
        let whole = std::fs::read(&files[1]).unwrap();
        let of_part = |bytes: &[u8]| {
            let file = folder.path().join("c.tally");
            std::fs::write(&file, bytes).unwrap();
            read_header(&file)
        };
        for length in [0, 5, 40, whole.len() - 1] {
            assert!(matches!(of_part(&whole[..length]), Err(PartFailure::CutShort(_))), "{length}");
        }
        assert!(matches!(of_part(b"a text"), Err(PartFailure::Lasting(_))) && of_part(&whole).is_ok());
        // The same file twice would count its rays twice.
        let twice = [files[1].clone(), files[1].clone()];
        assert!(PartSum::new(AskedRun { rays: None, ..sum.asked }).add_new(&twice, &bound).is_err());
    }
}

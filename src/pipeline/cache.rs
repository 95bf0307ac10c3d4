//! What is built or found out once: models, facets, octrees and choices in a folder that runs, processes and machines may share.
//!
//! An entry is named by a hash of all that decides it: program, kind of machine, models, settings of the mesher. It is written under
//! another name and renamed when it is whole; of a hundred processes that start at once one builds, while the others wait for its entry
//! ([`super::turn`]). A checksum at its end notices damage, and what is damaged is removed and built anew. Of too much, what was not used
//! for longest goes.
//!
//! Guarantee: a run has the same bits with and without it. Known weakness: who may write the folder is trusted with results: an entry
//! changed on purpose may change or end them, though no index of it leaves its array, and what is no tree is not taken for an octree.

use super::checksum::Checksum;
use super::monitor::Monitor;
use super::turn::Turn;
use crate::intersect::octree::{self, Octree};
use crate::mesh::FacetMesh;
use crate::mesh::arrays::{ArrayReader, invalid, write_array};
use crate::simulate::{Fingerprint, FingerprintHasher, Scene};
use crate::step::ImportReport;
use crate::study::default_accuracy::TracingChoice;
use crate::tessellate;
use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// The program, by version and commit, by its sources where no commit is known: only results of the same program are kept and added up.
pub const PROGRAM: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("LAMPYRIS_BUILD"));
/// First bytes of an entry.
const MAGIC: &[u8] = b"lampyris cache 5\n";
/// Most bytes of a folder, unless another limit is given: some fifty scenes of a million facets.
const MOST_BYTES: u64 = 20_000_000_000;
/// After so long an entry that was never finished is of a process that is no more.
const STALE: Duration = Duration::from_secs(86_400);
/// Bytes that are gathered before they are written.
const WRITTEN_AT_ONCE: usize = 1 << 20;
/// What follows the hash in the names of entries: of models, of facets, of octrees, and of what was chosen for a run.
pub(super) const MODEL: &str = ".model";
const FACETS: &str = ".facets";
const OCTREE: &str = ".octree";
const CHOICE: &str = ".choice";
const KINDS: [&str; 4] = [MODEL, FACETS, OCTREE, CHOICE];
/// What follows in the names of those that are not whole yet.
const UNFINISHED: &str = ".part";

/// A folder of what is built once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
    most_bytes: u64,
}

/// One thing in the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CacheEntry {
    /// Its file.
    pub file: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// When it was last used.
    pub used: SystemTime,
}

impl Cache {
    /// Uses a folder, which is made when something is first kept.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), most_bytes: MOST_BYTES }
    }

    /// Returns the cache with another limit, in bytes: beyond it, what was not used for longest is removed.
    pub fn with_limit(self, most_bytes: u64) -> Self {
        Self { most_bytes, ..self }
    }

    /// Returns what was chosen for a run, by its fingerprint before the choice; `None` where that is not kept.
    pub(super) fn choice(&self, run: &Fingerprint, monitor: &dyn Monitor) -> Option<TracingChoice> {
        let read =
            |from: &mut ArrayReader| TracingChoice::from_words(&from.array()?).ok_or_else(|| invalid("no choice"));
        self.fetch(&choice_name(run), monitor, read)
    }

    /// As [`Cache::choice`], or the turn to choose: another process that does so is waited for.
    pub(super) fn choice_or_turn(&self, run: &Fingerprint, monitor: &dyn Monitor) -> Result<TracingChoice, Turn> {
        self.fetch_or_turn(&choice_name(run), || self.choice(run, monitor))
    }

    /// Keeps what was chosen for a later run, another shard or range among them; a failure is only reported to the monitor.
    pub(super) fn keep_choice(&self, run: &Fingerprint, chosen: &TracingChoice, monitor: &dyn Monitor) {
        self.keep(&choice_name(run), monitor, |to| write_array(to, &chosen.to_words()));
    }

    /// Returns what `fetch` finds in the entry of this name, which another process may be making and is waited for; the turn to make it
    /// where it is not kept.
    pub(super) fn fetch_or_turn<T>(&self, name: &str, fetch: impl Fn() -> Option<T>) -> Result<T, Turn> {
        if let Some(kept) = fetch() {
            return Ok(kept);
        }
        // As an unfinished entry is: what a killed process left goes as those do.
        let turn = Turn::wait(&self.folder.join(format!(".{name}.turn{UNFINISHED}")));
        // Another process may have made it meanwhile.
        fetch().ok_or(turn)
    }

    /// Returns the folder, which may not exist yet.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Bytes beyond which entries are removed.
    pub fn limit(&self) -> u64 {
        self.most_bytes
    }

    /// Returns the whole entries, what was not used for longest first; none where there is no folder.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn entries(&self) -> io::Result<Vec<CacheEntry>> {
        let mut entries = self.files(|name| KINDS.iter().any(|kind| is_entry(name, kind)))?;
        // By name where times are equal, so that all processes remove the same.
        entries.sort_by(|a, b| (a.used, &a.file).cmp(&(b.used, &b.file)));
        Ok(entries)
    }

    /// Removes all entries, whole or not, with the marks of processes that make one, and returns the number of files; others in the folder
    /// stay. Processes that wait for an entry may then make it twice.
    ///
    /// # Errors
    /// When one cannot be removed.
    pub fn clear(&self) -> io::Result<usize> {
        // Only what bears a name of ours: the folder may hold other files.
        let files = self.files(|name| is_unfinished(name) || KINDS.iter().any(|kind| is_entry(name, kind)))?;
        for entry in &files {
            remove(&entry.file)?;
        }
        Ok(files.len())
    }

    /// Returns the files of the folder with a wanted name; none when there is no folder.
    ///
    /// # Errors
    /// When the folder cannot be read.
    fn files(&self, is_wanted: impl Fn(&str) -> bool) -> io::Result<Vec<CacheEntry>> {
        let folder = match fs::read_dir(&self.folder) {
            Ok(folder) => folder,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(e),
        };
        let mut files = Vec::new();
        for entry in folder {
            let entry = entry?;
            if !entry.file_name().to_str().is_some_and(&is_wanted) {
                continue;
            }
            // Another process may just have removed it.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_file() {
                // An unknown time counts as the oldest.
                let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                files.push(CacheEntry { file: entry.path(), bytes: metadata.len(), used });
            }
        }
        Ok(files)
    }

    /// Reads an entry and marks it as just used; `None` where there is none, or one that is damaged or cannot be read, which is removed and
    /// reported to the monitor.
    pub(super) fn fetch<T>(
        &self,
        name: &str,
        monitor: &dyn Monitor,
        read: impl FnOnce(&mut ArrayReader) -> io::Result<T>,
    ) -> Option<T> {
        let path = self.folder.join(name);
        // A folder or device of that name is no entry.
        let metadata = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?;
        let mut file = File::open(&path).ok()?;
        match read_entry(&mut file, metadata.len(), read) {
            Ok(made) => {
                // Where others own it, it only looks older than it is.
                let _ = file.set_modified(SystemTime::now());
                Some(made)
            }
            Err(e) => {
                monitor.warns(&format!("{}: {e}: built anew", path.display()));
                let _ = fs::remove_file(&path);
                None
            }
        }
    }

    /// Writes an entry and removes entries beyond the limit; a failure is only reported to the monitor.
    pub(super) fn keep(
        &self,
        name: &str,
        monitor: &dyn Monitor,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) {
        // The standard library's seeded hasher is random: no further crate for a name.
        let random = RandomState::new().build_hasher().finish();
        let beside = self.folder.join(format!(".{name}.{random:016x}{UNFINISHED}"));
        let attempt = || {
            fs::create_dir_all(&self.folder)?;
            // A name that no process of any machine has.
            let file = File::options().write(true).create_new(true).open(&beside)?;
            write_entry(file, write)?;
            fs::rename(&beside, self.folder.join(name))
        };
        // Room is made after the entry is whole: one that is larger than the limit removes itself as the last.
        if let Err(e) = attempt().and_then(|()| self.remove_excess()) {
            let _ = fs::remove_file(&beside);
            monitor.warns(&format!("{}: nothing is kept: {e}", self.folder.display()));
        }
    }

    /// Removes entries, those first that were not used for longest, until the limit is kept, and what a process left unfinished a day ago.
    fn remove_excess(&self) -> io::Result<()> {
        for unfinished in self.files(is_unfinished)? {
            if unfinished.used.elapsed().is_ok_and(|age| age > STALE) {
                remove(&unfinished.file)?;
            }
        }
        let entries = self.entries()?;
        let mut total: u64 = entries.iter().map(|e| e.bytes).sum();
        for entry in entries {
            if total <= self.most_bytes {
                break;
            }
            remove(&entry.file)?;
            total -= entry.bytes;
        }
        Ok(())
    }
}

/// The entries of a cache for one scene and one way to mesh it.
#[derive(Clone, Copy)]
pub(super) struct CachedFacets<'a> {
    pub(super) cache: &'a Cache,
    pub(super) key: &'a Fingerprint,
    pub(super) monitor: &'a dyn Monitor,
}

impl CachedFacets<'_> {
    /// Reads the facets of a model of so many placed faces; `None` where they are not kept.
    pub(super) fn mesh(&self, faces: usize) -> Option<FacetMesh> {
        let read = |from: &mut ArrayReader| FacetMesh::read_arrays(from, faces);
        self.cache.fetch(&self.name(FACETS), self.monitor, read)
    }

    /// Returns what `fetch` reads where these facets are kept; where another process is making them, waits until it ends and calls `fetch`
    /// again. An `Err` is the turn: the caller makes them while it holds it.
    pub(super) fn mesh_or_turn<T>(&self, fetch: impl Fn() -> Option<T>) -> Result<T, Turn> {
        self.cache.fetch_or_turn(&self.name(FACETS), fetch)
    }

    /// Keeps the facets for a later run; a failure is only reported to the monitor.
    pub(super) fn keep_mesh(&self, mesh: &FacetMesh) {
        self.cache.keep(&self.name(FACETS), self.monitor, |to| mesh.write_arrays(to));
    }

    /// Returns the octree of the facets, as it was kept, or built and kept now.
    pub(super) fn octree<'m>(&self, mesh: &'m FacetMesh, settings: &octree::Settings) -> Octree<'m> {
        let name = self.name(OCTREE);
        let read = |from: &mut ArrayReader| Octree::read_arrays(mesh, settings, from);
        let _turn = match self.cache.fetch_or_turn(&name, || self.cache.fetch(&name, self.monitor, read)) {
            Ok(octree) => return octree,
            Err(turn) => turn,
        };
        let built = Octree::build(mesh, settings);
        self.cache.keep(&name, self.monitor, |to| built.write_arrays(to));
        built
    }

    /// Returns the name of the file of an entry; `kind` is its ending.
    fn name(&self, kind: &str) -> String {
        format!("{}{kind}", self.key.0)
    }
}

/// Returns the name of the file that keeps what was chosen for a run.
fn choice_name(run: &Fingerprint) -> String {
    format!("{}{}", run.0, CHOICE)
}

/// Hashes all that decides facets and octree but the octree's settings, of which the arrays hold none that is not the program's default;
/// the bytes of the models' files among it, as `reports` gives them.
pub(super) fn facets_key(scene: &Scene, reports: &[ImportReport], mesher: &tessellate::Settings) -> Fingerprint {
    // Entries are raw bytes of numbers: machines of the other order must not share them.
    let machine = if cfg!(target_endian = "big") { "big" } else { "little" };
    // The settings in their debug form: a new field changes the names by itself.
    let words = format!("{PROGRAM} {machine} {mesher:?} {:?}", scene.models);
    let mut hasher = FingerprintHasher::default();
    hasher.add(words.as_bytes());
    // By content, not by date, and as it was read: a file that was replaced, before or after that, must not give the facets of another.
    reports.iter().for_each(|report| hasher.add(&report.hash.to_le_bytes()));
    hasher.finish()
}

/// Returns the cache names of the groups that a model is divided into, by their numbers; a model in one piece keeps its own.
pub(super) fn group_keys(key: &Fingerprint, groups: usize) -> Vec<Fingerprint> {
    if groups == 1 {
        return vec![key.clone()];
    }
    (0..groups).map(|k| Fingerprint::new(&[key.0.as_bytes(), &k.to_le_bytes()])).collect()
}

/// Whether a file's name is a hash with this ending.
fn is_entry(name: &str, kind: &str) -> bool {
    name.strip_suffix(kind).is_some_and(|hash| hash.len() == 32 && hash.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Whether a file's name is that of an entry that is being written.
fn is_unfinished(name: &str) -> bool {
    let entry = name.strip_prefix('.').and_then(|n| n.strip_suffix(UNFINISHED)).and_then(|n| n.rsplit_once('.'));
    entry.is_some_and(|(entry, _)| KINDS.iter().any(|kind| is_entry(entry, kind)))
}

/// Removes a file that another process may have removed already, which is no error.
fn remove(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// Writes what `write` writes to a file, between magic and checksum; an error too where the disk is full.
fn write_entry(file: File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut to = HashingWriter { to: BufWriter::with_capacity(WRITTEN_AT_ONCE, file), sum: Checksum::new() };
    to.write_all(MAGIC)?;
    write(&mut to)?;
    let sum = to.sum.finish();
    to.to.write_all(sum.as_bytes())?;
    // Dropping the buffer would hide that the disk is full.
    to.to.into_inner().map_err(|e| e.into_error())?;
    Ok(())
}

/// Reads an entry of this version between its magic and its checksum; `bytes` is the size of the file.
///
/// # Errors
/// When it is of another version, cut short or damaged, or `read` refuses it.
fn read_entry<T>(
    file: &mut File,
    bytes: u64,
    read: impl FnOnce(&mut ArrayReader) -> io::Result<T>,
) -> io::Result<T> {
    let damaged = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
    let payload = bytes.checked_sub(Checksum::CHARACTERS as u64).ok_or_else(|| damaged("cut short"))?;
    let mut from = HashingReader { from: file, sum: Checksum::new() };
    let mut magic = vec![0; MAGIC.len()];
    from.read_exact(&mut magic)?;
    if magic != MAGIC {
        return Err(damaged("no entry of this version"));
    }
    let made = read(&mut ArrayReader::new(&mut from, payload.saturating_sub(MAGIC.len() as u64)))?;
    // After reading: the sum is one of all that was read, and what follows must be the sum and nothing else.
    let sum = from.sum.finish();
    let mut kept = [0; Checksum::CHARACTERS];
    file.read_exact(&mut kept)?;
    let is_end = file.read(&mut [0])? == 0;
    if kept != sum.as_bytes() || !is_end {
        return Err(damaged("damaged: its checksum is wrong"));
    }
    Ok(made)
}

/// Hashes what it writes.
struct HashingWriter<W> {
    to: W,
    sum: Checksum,
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.sum.add(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Hashes what it reads.
struct HashingReader<'a> {
    from: &'a mut File,
    sum: Checksum,
}

impl Read for HashingReader<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(bytes)?;
        self.sum.add(&bytes[..read]);
        Ok(read)
    }
}

//! The scene file: models, media, materials, sources, receivers and the settings of the run, as TOML.
//!
//! A scene is plain data. [`Scene::parse`] refuses unknown keys with the place and the nearest known key;
//! [`Scene::bind`](crate::simulate::BoundScene) then finds the faces of a model that each rule means. Lengths are mm, angles degrees
//! where the key says `_deg`, wavelengths nm, powers watts (or lumens: the receivers answer in the unit of the sources).

#[cfg(feature = "schema")]
mod conditions;
mod lenient;
mod locate;
mod material;
pub(crate) mod medium;
mod origin;
mod receiver;
mod regulation;
mod run;
mod selector;
mod source;
mod spectrum;
mod strict;
mod surface;

use super::{Error, ErrorKind};
use crate::formats::file_stem;
pub(crate) use locate::Key;
use locate::TableKeys;
pub use material::{LobeKind, Material, ModelUse, Placement, Reflectance, ScatterKey, SurfaceOptics};
pub use medium::{ByWavelength, Medium};
pub use origin::Origin;
pub use receiver::{Channels, FarFieldType, Receiver, ReceiverKind};
pub use regulation::RegulationUse;
pub use run::{Accuracy, Interfaces, MOST_RAYS, PowerUnit, Run, Sampling};
pub use selector::{ColourKey, FaceSelector, OneOrMany, SolidKey};
use serde::{Deserialize, Serialize};
pub(crate) use source::POWERS;
pub use source::{Source, SourceKind};
pub use spectrum::{SpectrumKey, SpectrumName};
use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strict::Strict;

/// A whole scene file.
///
/// ```
/// let text = r#"
///     [[source]]
///     kind = "point"
///     at = [0, 0, 10]
///
///     [[receiver]]
///     name = "wall"
///     kind = "plane"
///     at = [0, 0, 1000]
///     normal = [0, 0, -1]
///     size = [2000, 2000]
///     cells = [200, 200]
/// "#;
/// let scene = lampyris::simulate::Scene::parse(text, "scene.toml", std::path::Path::new("."))?;
/// assert_eq!(scene.receivers[0].name, "wall");
/// let slip = lampyris::simulate::Scene::parse("[run]\nray = 5", "scene.toml", std::path::Path::new(".")).unwrap_err();
/// assert!(slip.to_string().contains("scene.toml:2:1") && slip.to_string().contains("'rays'"), "{slip}");
/// # Ok::<(), lampyris::simulate::Error>(())
/// ```
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// What the scene is, for the report.
    pub title: String,
    /// Settings of the run.
    pub run: Run,
    /// How the models are faceted and traced; the command's options override it.
    pub accuracy: Accuracy,
    /// The CAD models and where they stand.
    #[serde(rename = "model")]
    pub models: Vec<ModelUse>,
    /// Transparent media by name.
    #[serde(rename = "medium")]
    pub media: Vec<Medium>,
    /// What parts and faces are made of; of several rules that meet on a face, the last one counts.
    #[serde(rename = "material")]
    pub materials: Vec<Material>,
    /// What every other face is: `absorber` unless said otherwise. `coating` and `metal`, which need values, are for rules.
    pub default_surface: SurfaceOptics,
    /// Name of the medium around everything; vacuum unless said otherwise.
    pub ambient: Option<String>,
    /// Where light comes from.
    #[serde(rename = "source")]
    pub sources: Vec<Source>,
    /// Where light is counted.
    #[serde(rename = "receiver")]
    pub receivers: Vec<Receiver>,
    /// Regulations that a far field is judged by.
    #[serde(rename = "regulation")]
    pub regulations: Vec<RegulationUse>,
    /// The file it came from, for messages.
    #[serde(skip)]
    pub origin: Origin,
}

impl Scene {
    /// Reads and checks a scene file, and the glass catalogues that it names; paths in it are relative to its folder.
    ///
    /// # Errors
    /// When the file, or a catalogue, cannot be read, or [`Scene::parse`] refuses the text.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let name = path.display().to_string();
        // Through `formats`: a pipe in place of the file would never end.
        let text = crate::formats::read_text(path).map_err(|e| {
            let help = match e.kind() {
                io::ErrorKind::IsADirectory => "name the scene file in it, a .toml",
                io::ErrorKind::InvalidData => "a scene is TOML in UTF-8: save it so, or name the scene file",
                // What it is and what to do about it is said already.
                io::ErrorKind::InvalidInput => "a scene is a TOML file",
                io::ErrorKind::PermissionDenied => "give yourself permission to read it",
                _ => "check the path",
            };
            Error::new(ErrorKind::Unreadable, format!("{name}: cannot read the scene file: {e}")).help(help)
        })?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self::parse(&text, &name, folder)
    }

    /// Parses the text of a scene file and checks every value that can be checked without a model. `file_name` is for messages; `base_dir`
    /// is where relative paths begin, as of glass catalogues, which are read here.
    ///
    /// # Errors
    /// For the first key that is not known, or value that cannot be, with its place in the text.
    pub fn parse(text: &str, file_name: &str, base_dir: &Path) -> Result<Self, Error> {
        let shared: Arc<str> = text.into();
        let mut scene = toml::Deserializer::parse(text)
            .and_then(|document| Self::deserialize(Strict(document)))
            .map_err(|e| locate::syntax_error(&e, file_name, &shared, &table_keys()))?;
        scene.origin = Origin { file: file_name.into(), folder: base_dir.into(), text: Some(shared.clone()) };
        // Written out again, the scene shows what was understood: a list that lost entries on the way was too long.
        let understood = serde_json::to_value(&scene)
            .map_err(|e| Error::new(ErrorKind::Syntax, e.to_string()).located(file_name, &shared, None))?;
        if let Some((span, message)) = locate::unread_entries(text, &understood) {
            return Err(Error::new(ErrorKind::Syntax, message).located(file_name, &shared, Some(span)));
        }
        for (i, medium) in scene.media.iter_mut().enumerate() {
            medium.glass = medium.read_glass(&scene.origin, i)?;
        }
        scene.check()?;
        Ok(scene)
    }

    /// Returns the JSON Schema of a scene file; with the feature `schema`.
    #[cfg(feature = "schema")]
    pub fn schema() -> serde_json::Value {
        let mut schema = schemars::schema_for!(Self).to_value();
        conditions::add_conditions(&mut schema);
        schema
    }

    /// Returns the files that the scene names, as it does: models, then those of sources, then glass catalogues.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let models = self.models.iter().map(|m| m.file.as_str());
        let sources = self.sources.iter().filter_map(|s| s.file.as_deref());
        models.chain(sources).chain(self.media.iter().filter_map(|m| m.file.as_deref()))
    }

    /// Returns a path named in the scene, seen from where the program runs; an absolute one stays as it is.
    pub fn resolve(&self, file: &str) -> PathBuf {
        self.origin.resolve(file)
    }

    /// Returns a source as sentences name it: by its name, or by its number from 1 where it has none.
    pub(crate) fn source_label(&self, source: usize) -> String {
        match self.sources.get(source).map(|s| s.name.as_str()) {
            Some(name) if !name.is_empty() => format!("the source '{name}'"),
            _ => format!("[[source]] {}", source + 1),
        }
    }

    /// Returns for each source whether its text gives it a `kind`; empty for a scene that was not parsed from text.
    pub(crate) fn written_kinds(&self) -> Vec<bool> {
        self.origin.text.as_deref().map_or_else(Vec::new, |text| locate::tables_with(text, "source", "kind"))
    }

    /// Makes an error about the value at `path`, as [`Origin::error`].
    pub(crate) fn error(&self, kind: ErrorKind, path: &[Key<'_>], message: impl Into<String>) -> Error {
        self.origin.error(kind, path, message)
    }

    /// Returns the scene file, its text, and the bytes that name the file of model `index`; `None` for a scene that was not parsed from
    /// text.
    pub fn place_of_model(&self, index: usize) -> Option<(&str, &str, Range<usize>)> {
        let span = self.origin.span(&[Key::Name("model"), Key::Index(index), Key::Name("file")])?;
        Some((&self.origin.file, self.origin.text.as_deref()?, span))
    }

    /// Checks all values, in the order of the file's keys, and that the receivers' cells fit into memory.
    fn check(&self) -> Result<(), Error> {
        // In the order of the file's keys, so that the first fault reported is one near the top.
        let origin = &self.origin;
        self.run.check(origin)?;
        self.accuracy.check(origin)?;
        self.models.iter().enumerate().try_for_each(|(i, m)| m.check(origin, i))?;
        self.media.iter().enumerate().try_for_each(|(i, m)| m.check(origin, i, self.run.wavelength_nm))?;
        self.check_names("medium", "media", self.media.iter().map(|m| m.name.as_str()))?;
        self.check_defaults()?;
        self.materials.iter().enumerate().try_for_each(|(i, m)| m.check(origin, i, &self.media))?;
        let all_rays = self.sources.iter().filter_map(|source| source.rays).fold(0, u64::saturating_add);
        self.sources.iter().enumerate().try_for_each(|(i, s)| s.check(origin, i, &self.run, all_rays))?;
        self.check_names("source", "sources", self.sources.iter().map(|s| s.name.as_str()))?;
        self.receivers.iter().enumerate().try_for_each(|(i, r)| r.check(origin, i, self.run.unit))?;
        self.check_names("receiver", "receivers", self.receivers.iter().map(|r| r.name.as_str()))?;
        self.check_receiver_files()?;
        self.regulations.iter().enumerate().try_for_each(|(i, r)| r.check(self, i))?;
        let sums: u64 = self.receivers.iter().map(Receiver::sums).sum();
        if sums > MOST_SUMS {
            let largest = (0..self.receivers.len()).max_by_key(|&i| self.receivers[i].sums());
            let at = largest.map(|i| [Key::Name("receiver"), Key::Index(i), Key::Name("cells")]);
            let at: &[Key<'_>] = at.as_ref().map_or(&[], |at| at);
            let message = format!("the receivers have {sums} cells with all their channels, more than {MOST_SUMS}");
            return Err(self.error(ErrorKind::Value, at, message).help("use fewer `cells` or fewer `bins_nm`"));
        }
        Ok(())
    }

    /// Refuses surroundings of a medium that is not known, and a default surface that needs values.
    fn check_defaults(&self) -> Result<(), Error> {
        if let Some(name) = &self.ambient {
            medium::find(&self.media, name, &self.origin, &[Key::Name("ambient")])?;
        }
        if matches!(self.default_surface, SurfaceOptics::Coating | SurfaceOptics::Metal) {
            let message = "this surface needs values, which `default_surface` cannot give";
            let error = self.error(ErrorKind::Value, &[Key::Name("default_surface")], message);
            return Err(error.help(
                "write `absorber`, `mirror`, `diffuse` or `interface`, and give other surfaces to faces by a [[material]]",
            ));
        }
        Ok(())
    }

    /// Refuses two entries of one name in the list `key`, which would be ambiguous; several may have none. `kind` is what they
    /// are called in a sentence.
    fn check_names<'a>(&self, key: &str, kind: &str, names: impl Iterator<Item = &'a str>) -> Result<(), Error> {
        let mut known = HashSet::new();
        for (i, name) in names.enumerate().filter(|(_, name)| !name.is_empty()) {
            if !known.insert(name) {
                let at = [Key::Name(key), Key::Index(i), Key::Name("name")];
                let error = self.error(ErrorKind::Value, &at, format!("two {kind} are called '{name}'"));
                return Err(error.help("give each a name of its own"));
            }
        }
        Ok(())
    }

    /// Refuses two receivers whose names make the same file name, with or without what pictures in colours add to it, and one that would
    /// write over lost_rays.csv.
    fn check_receiver_files(&self) -> Result<(), Error> {
        // By the name of the file, not of the receiver: `a b` and `a_b` would write over each other, on some systems `a` and `A` too.
        let mut stems: HashMap<String, &str> = HashMap::new();
        for (i, Receiver { name, channels, .. }) in self.receivers.iter().enumerate() {
            let stem = file_stem(name);
            let colours = (*channels == Some(Channels::Xyz)).then(|| format!("{stem}-colours"));
            for stem in [Some(stem), colours].into_iter().flatten() {
                let file = stem.to_lowercase();
                let message = match stems.get(&file) {
                    _ if file == "lost_rays" => format!("a receiver called '{name}' would overwrite lost_rays.csv"),
                    Some(other) => {
                        format!("the files of the receivers '{other}' and '{name}' would both be called '{stem}'")
                    }
                    None => {
                        stems.insert(file, name);
                        continue;
                    }
                };
                let at = [Key::Name("receiver"), Key::Index(i), Key::Name("name")];
                return Err(self.error(ErrorKind::Value, &at, message).help("give each a name of its own"));
            }
        }
        Ok(())
    }
}

/// Returns the tables of a scene that have keys of their own, with all of these.
fn table_keys() -> Vec<TableKeys> {
    // Written out, an entry shows each of its keys, set or not.
    fn keys<T: Default + Serialize>(table: &'static str) -> TableKeys {
        let entry = serde_json::to_value(T::default()).unwrap_or_default();
        let keys = entry.as_object().map_or_else(Vec::new, |entry| entry.keys().cloned().collect());
        TableKeys { table, keys }
    }
    let head = ["title", "default_surface", "ambient"].map(str::to_owned).to_vec();
    vec![
        TableKeys { table: "the head of the file, above its first table", keys: head },
        keys::<Run>("[run]"),
        keys::<Accuracy>("[accuracy]"),
        keys::<ModelUse>("[[model]]"),
        keys::<Medium>("[[medium]]"),
        keys::<Material>("[[material]]"),
        keys::<Source>("[[source]]"),
        keys::<Receiver>("[[receiver]]"),
        keys::<RegulationUse>("[[regulation]]"),
    ]
}

/// Most sums of all receivers of a scene: a gigabyte.
const MOST_SUMS: u64 = 1 << 25;

//! Where a scene came from, and errors that point into its text.

use super::locate::{self, Key};
use crate::simulate::{Error, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a scene came from.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// Name of the scene file, as the user gave it.
    pub file: String,
    /// Folder that relative paths start from.
    pub folder: PathBuf,
    /// The text, for messages that show the line.
    pub text: Option<Arc<str>>,
}

impl Origin {
    /// Returns a path named in the scene, seen from where the program runs; an absolute one stays as it is. Of a scene that was opened by a
    /// link, what is not beside the link is looked for beside the scene itself.
    pub(super) fn resolve(&self, file: &str) -> PathBuf {
        let beside = self.folder.join(file);
        if beside.exists() {
            return beside;
        }
        // Without a link both places are one, and the file is not there either.
        let scene = Path::new(&self.file).canonicalize().ok();
        let beside_scene = scene.and_then(|scene| Some(scene.parent()?.join(file)));
        beside_scene.filter(|path| path.exists()).unwrap_or(beside)
    }

    /// Returns the bytes of the value at a path, as `locate::span`; `None` for a scene that was not parsed from text.
    pub(super) fn span(&self, path: &[Key<'_>]) -> Option<Range<usize>> {
        locate::span(self.text.as_deref()?, path)
    }

    /// Makes an error about the value at `path`, with its place in the file; without a place for a scene that was not parsed from text.
    pub(super) fn error(&self, kind: ErrorKind, path: &[Key<'_>], message: impl Into<String>) -> Error {
        let error = Error::new(kind, message);
        match &self.text {
            Some(text) => error.located(&self.file, text, self.span(path)),
            None => error,
        }
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_opened_by_a_link_has_its_files_beside_itself() {
        let place = tempfile::tempdir().unwrap();
        let [own, links] = ["own", "links"].map(|name| place.path().join(name));
        for folder in [&own, &links] {
            std::fs::create_dir(folder).unwrap();
        }
        for name in ["s.toml", "lamp.stp"] {
            std::fs::write(own.join(name), "").unwrap();
        }
        let link = links.join("l.toml");
        std::os::unix::fs::symlink(own.join("s.toml"), &link).unwrap();
        let origin = Origin { file: link.display().to_string(), folder: links.clone(), text: None };
        assert_eq!(origin.resolve("lamp.stp"), own.canonicalize().unwrap().join("lamp.stp"));
        // What stands beside the link comes first, and what is nowhere is missed there.
        std::fs::write(links.join("lamp.stp"), "").unwrap();
        assert_eq!(origin.resolve("lamp.stp"), links.join("lamp.stp"));
        assert_eq!(origin.resolve("none.stp"), links.join("none.stp"));
    }
}

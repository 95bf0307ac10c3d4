//! Guards a command's input files against being overwritten by its output.

use super::output_place::folder_of;
use crate::cli::failure::Failure;
use crate::simulate::Scene;
use std::path::{Path, PathBuf};

/// The files that a command reads.
#[derive(Debug)]
pub(crate) struct InputGuard {
    files: Vec<PathBuf>,
}

impl InputGuard {
    /// Guards single files.
    pub(crate) fn new<'a>(files: impl IntoIterator<Item = &'a Path>) -> Self {
        Self { files: files.into_iter().map(Path::to_path_buf).collect() }
    }

    /// Guards the files of a scene too: models, sources, glass catalogues.
    pub(crate) fn with_scene(mut self, scene: &Scene) -> Self {
        self.files.extend(scene.files().map(|file| scene.resolve(file)));
        self
    }

    /// Refuses an output, asked for by `option`, that is one of the files.
    ///
    /// # Errors
    /// When it is.
    pub(crate) fn refuse(&self, option: &str, output: &Path) -> Result<(), Failure> {
        let [named, led_to] = places(output);
        // By both: a link to an input is as much that input as its own name is.
        let is_output = |input: &&PathBuf| {
            let [name, target] = places(input);
            (name.is_some() && name == named) || (target.is_some() && target == led_to)
        };
        let Some(input) = self.files.iter().find(is_output) else { return Ok(()) };
        let message = format!("{option} {}: it would replace {}, which is read", output.display(), input.display());
        Err(Failure::arguments(message).with_help("give the output another name or folder; nothing was written"))
    }

    /// Refuses a folder of results, asked for by `-o`, in which a file of a name that `is_written` has is one of the files. Names are
    /// relative to the folder.
    ///
    /// # Errors
    /// When there is one.
    pub(crate) fn refuse_folder(&self, folder: &Path, is_written: impl Fn(&Path) -> bool) -> Result<(), Failure> {
        let Some(input) = self.files.iter().find(|input| is_inside(input, folder, &is_written)) else {
            return Ok(());
        };
        let message =
            format!("-o {}: the results would replace {}, which is read", folder.display(), input.display());
        Err(Failure::arguments(message).with_help("give another folder with -o; nothing was written"))
    }
}

/// Whether an input lies in the folder, itself or by where it leads, at a path, relative to the folder, that `is_written` accepts. A folder
/// that does not exist holds nothing.
fn is_inside(input: &Path, folder: &Path, is_written: &impl Fn(&Path) -> bool) -> bool {
    let Ok(folder) = folder.canonicalize() else { return false };
    let inside = |place: &PathBuf| place.strip_prefix(&folder).is_ok_and(is_written);
    places(input).iter().flatten().any(inside)
}

/// Returns the path of a file with the links in its folder followed, and with a link at its own name followed too; `None` where the folder,
/// or the file, is not there.
fn places(path: &Path) -> [Option<PathBuf>; 2] {
    let folder = folder_of(path).canonicalize().ok();
    let name = path.file_name();
    [folder.zip(name).map(|(folder, name)| folder.join(name)), path.canonicalize().ok()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_is_an_input_by_whatever_path() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("rays.csv"), "").unwrap();
        let guard = InputGuard::new([at("sub/../rays.csv").as_path()]);
        let refused = guard.refuse("--ends", &at("rays.csv")).unwrap_err().to_string();
        assert!(refused.contains("--ends") && refused.contains("rays.csv, which is read"), "{refused}");
        assert!(guard.refuse("--ends", &at("sub/rays.csv")).is_ok() && guard.refuse("-o", &at("none/a")).is_ok());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("rays.csv"), at("link.csv")).unwrap();
            assert!(guard.refuse("--ends", &at("link.csv")).is_err());
        }
        assert!(guard.refuse_folder(folder.path(), |name| name == Path::new("rays.csv")).is_err());
        assert!(guard.refuse_folder(folder.path(), |name| name == Path::new("wall.csv")).is_ok());
        assert!(guard.refuse_folder(&at("none"), |_| true).is_ok());
    }
}

//! What the name of a file says: its last component as text, its extension.

use std::path::Path;

/// The name of a file without its folder, for people and for names beside it; a path that ends in no name, such as `..`, is given whole.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The extension in lower case, by which formats are recognised; empty where a name has none, which matches no format.
pub fn lower_extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

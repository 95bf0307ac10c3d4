//! Facets to files: the extension decides the format.

use super::facets::Facets;
use super::file_names::lower_extension;
use super::{Error, ErrorKind, data2, glb, obj, ply, stl, vtk};
use std::path::Path;

/// Extensions [`write_facets`] knows, for people.
pub const FACET_EXTENSIONS: &str = ".obj .ply .stl .vtu .glb .data2";

/// Writes facets in the format that the extension names, in any case: one of [`FACET_EXTENSIONS`]. An older file is replaced.
///
/// # Errors
/// For an unknown extension, and when the file cannot be written.
pub fn write_facets(path: &Path, facets: &Facets) -> Result<(), Error> {
    let extension = lower_extension(path);
    match extension.as_str() {
        "obj" => obj::write(path, facets),
        "ply" => ply::write(path, facets),
        "stl" => stl::write(path, facets),
        "vtu" => vtk::write_vtu(path, facets),
        "glb" => glb::write(path, facets),
        "data2" => data2::write(path, facets),
        _ => Err(Error::new(path, ErrorKind::Extension { given: extension, known: FACET_EXTENSIONS })),
    }
}

/// Whether [`write_facets`] knows the extension of this name.
///
/// ```
/// use lampyris::formats::is_facet_file;
/// assert!(is_facet_file("lamp.GLB".as_ref()) && !is_facet_file("lamp.stp".as_ref()));
/// ```
pub fn is_facet_file(path: &Path) -> bool {
    let extension = lower_extension(path);
    // The dot of the list is not part of an extension.
    FACET_EXTENSIONS.split(' ').any(|known| known[1..] == extension)
}

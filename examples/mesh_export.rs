//! A STEP file as facets in the files of other programs: OBJ, STL, PLY, VTU and GLB, chosen by extension.
//!
//! `cargo run --release --example mesh_export [FOLDER]`

use lampyris::formats::{Facets, write_facets};
use lampyris::{step, tessellate};
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(std::env::temp_dir, PathBuf::from);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_asphere_nurbs.stp");
    let model = step::read(&file, &step::Settings::default())?.model;
    let made = tessellate::tessellate(&model, &tessellate::Settings::default());
    assert_eq!(made.report.certified, made.report.facets, "every facet is proved within its tolerance");

    for extension in ["obj", "stl", "ply", "vtu", "glb"] {
        let path = folder.join("lampyris_lens").with_extension(extension);
        write_facets(&path, &Facets::plain(&made.mesh, "lens"))?;
        println!("{} bytes  {}", std::fs::metadata(&path)?.len(), path.display());
    }
    Ok(())
}

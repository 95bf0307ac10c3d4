//! Files of rays that a command is told to ask: records as `check --rays-out` writes them, lists and measured ray sets.

use crate::cli::failure::Failure;
use crate::formats::{lower_extension, open_file, read_ray_paths};
use crate::math::Ray;
use crate::study::records;
use std::io::BufReader;
use std::path::Path;

/// Extensions of lists (CSV, NPZ) and measured ray sets (TM-25, Zemax, LightTools); all others are records.
const RAY_SETS: [&str; 7] = ["csv", "txt", "npz", "tm25ray", "dat", "sdf", "ray"];

/// Reads the rays of a file, mm, in the order they stand there; by its extension a list or measured set, else records. Fails if there are
/// none.
pub(crate) fn read_rays(path: &Path) -> Result<Vec<Ray>, Failure> {
    let rays: Vec<Ray> = if RAY_SETS.contains(&lower_extension(path).as_str()) {
        let rays = read_ray_paths(path).map_err(|e| Failure::input(e.to_string()))?;
        rays.iter().map(|ray| Ray::new(ray.origin, ray.direction)).collect()
    } else {
        let read = open_file(path).and_then(|file| records::read(&mut BufReader::new(file)));
        let unreadable = |e| Failure::input(format!("{}: cannot be read as a file of rays: {e}", path.display()));
        read.map_err(unreadable)?.into_iter().map(|(ray, _)| ray).collect()
    };
    if rays.is_empty() {
        // A benchmark of nothing would divide by it.
        return Err(Failure::input(format!("{}: no rays in it", path.display())));
    }
    Ok(rays)
}

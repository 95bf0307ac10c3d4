//! Files of rays for a command to trace: records as `check --rays-out` writes them, lists and measured ray sets.

use crate::cli::failure::Failure;
use crate::formats::{lower_extension, open_file, read_ray_facets, read_ray_paths};
use crate::math::{Aabb, Departure, Point, Ray, Uv};
use crate::mesh::FacetMesh;
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

/// Rays of a file with the facets that they leave.
pub(crate) struct LeavingRays {
    rays: Vec<Ray>,
    /// The facet of each, below zero for none; empty where the file names none.
    facets: Vec<f64>,
}

/// Reads the rays of a file as [`read_rays`] does, and which facets they leave, where it says so.
pub(crate) fn read_leaving_rays(path: &Path) -> Result<LeavingRays, Failure> {
    let rays = read_rays(path)?;
    let facets = read_ray_facets(path, rays.len()).map_err(|e| Failure::input(e.to_string()))?;
    Ok(LeavingRays { rays, facets })
}

/// Distance from a facet within which a ray starts on it, as a share of the largest coordinate: far above rounding, far below a sag.
const ON_FACET: f64 = 1e-9;

impl LeavingRays {
    /// Returns the rays as they leave the facets of a mesh. One that is not on the facet it names, which is of another mesh, leaves none.
    pub(crate) fn on_mesh(&self, mesh: &FacetMesh) -> Vec<Ray> {
        let mut rays = self.rays.clone();
        for (ray, &facet) in rays.iter_mut().zip(&self.facets) {
            ray.departure = departure(mesh, facet, ray.origin);
        }
        rays
    }
}

/// The departure from the facet of this number; `None` where the point is not on it, or there is none.
fn departure(mesh: &FacetMesh, facet: f64, point: Point) -> Option<Departure> {
    if !(0.0..mesh.facets.len() as f64).contains(&facet) {
        return None;
    }
    let number = facet as usize;
    let corners = mesh.corners(number);
    let room = ON_FACET * corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
    let bounds = Aabb::from_points(corners).grown(room);
    let is_in_plane = |[a, b, c]: [Point; 3]| {
        let normal = (b - a).cross(c - a).try_normalize();
        normal.is_some_and(|normal| normal.dot(point - a).abs() <= room)
    };
    let [a, b, c, d] = corners;
    let is_on = bounds.contains(point) && (is_in_plane([a, b, c]) || is_in_plane([a, c, d]));
    let face = mesh.facets[number].face;
    is_on.then_some(Departure { face, primitive: number as u32, uv: Uv::ZERO, triangle: None })
}

//! How far the interpolated normals of facets are off, and how much the surface bends there, facet by facet: what files and views of
//! facets are coloured by.

use crate::math::Vector;
use crate::mesh::{Facet, FacetMesh};
use crate::model::{Face, Model, PlacedFace};
use crate::nurbs::{FundamentalForms, SecondDerivatives};
use rayon::prelude::*;

/// Returns, for each facet, the largest angle between interpolated and true normal at its middle and the middles of its sides, degrees, and
/// the largest absolute curvature there, 1/mm; NaN for facets of ready meshes. Runs on the current rayon pool.
pub fn facet_errors(model: &Model, mesh: &FacetMesh) -> (Vec<f64>, Vec<f64>) {
    let faces: Vec<PlacedFace> = model.placed_faces().collect();
    let measured = |facet: &Facet| match faces.get(facet.face.index()).and_then(|p| p.face.map(|face| (p, face))) {
        Some((placed, face)) => facet_error(mesh, facet, placed, face),
        // A ready mesh has no surface to err from.
        None => (f64::NAN, f64::NAN),
    };
    mesh.facets.par_iter().map(measured).unzip()
}

/// Returns the angle and the curvature of [`facet_errors`] for a facet of a placed face with a surface.
fn facet_error(mesh: &FacetMesh, facet: &Facet, placed: &PlacedFace<'_>, face: &Face) -> (f64, f64) {
    let corners = facet.vertices.map(|v| mesh.vertices[v as usize]);
    let sides = if facet.is_triangle() { 3 } else { 4 };
    // The middle of each side, then of the facet, by the corners around it.
    let mut places: Vec<Vec<usize>> = (0..sides).map(|k| vec![k, (k + 1) % sides]).collect();
    places.push((0..sides).collect());
    let (mut worst, mut curved) = (0f64, 0f64);
    for place in places {
        let share = 1.0 / place.len() as f64;
        let uv = place.iter().map(|&k| corners[k].uv * share).sum();
        let mixed: Vector = place.iter().map(|&k| corners[k].normal).sum();
        let d = face.surface.second_derivatives(face.surface.clamp(uv));
        // At a pole there is no normal to compare.
        let Some(n) = d.du.cross(d.dv).try_normalize() else { continue };
        let true_normal = placed.placement.normal(if face.reversed { -n } else { n });
        let angle = mixed.cross(true_normal).length().atan2(mixed.dot(true_normal)).to_degrees();
        worst = worst.max(angle);
        curved = curved.max(largest_curvature(&d, n) / placed.placement.scale);
    }
    (worst, curved)
}

/// Returns the largest absolute principal curvature, in the surface's own lengths, at derivatives `d` with unit normal `normal`; NaN where
/// they span no plane. Nearer to poles than [`FundamentalForms::new`] goes.
fn largest_curvature(d: &SecondDerivatives, normal: Vector) -> f64 {
    let first = [d.du.dot(d.du), d.du.dot(d.dv), d.dv.dot(d.dv)];
    if first[0] * first[2] - first[1] * first[1] <= 0.0 {
        return f64::NAN;
    }
    let second = [d.duu.dot(normal), d.duv.dot(normal), d.dvv.dot(normal)];
    FundamentalForms { first, second, normal }.largest_curvature()
}

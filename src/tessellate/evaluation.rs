//! Counts and measures what came out.

use super::placement::Placed;
use super::report::{FailedFace, FailureCause, NotCertified, Percentiles, Report, ToleranceRange};
use super::sample::{self, Sampled};
use super::sample_budget::{MeshSamples, sample_within_budget};
use super::tessellation::{FacetQuality, Tessellation};
use super::{angles, repairs, settings::Settings};
use crate::math::FaceId;
use crate::mesh::{FacetMesh, Topology};
use crate::model::Model;

/// Share of the tolerance, and mm, by which a sample may be above it: one on the very tolerance differs by rounding alone.
const SAMPLE_ROUNDING: [f64; 2] = [1e-9, 1e-10];

/// Returns placed meshes with a report of them filled in, all but the times and the causes of failures; samples are taken only if
/// [`Settings::measure`] says so, but always of what is not certified on repaired faces.
pub(super) fn evaluate(placed: Placed, model: &Model, settings: &Settings) -> Tessellation {
    let Placed { mut made, failed, repairs, originals } = placed;
    let mut report = std::mem::take(&mut made.report);
    let mesh = &made.mesh;
    report.facets = mesh.facets.len();
    report.quads = mesh.quad_count();
    report.triangles = report.facets - report.quads;
    report.vertices = mesh.positions.len();
    let [a, b] = settings.tolerance;
    report.tolerance_mm = ToleranceRange { min: a.min(b), max: a.max(b) };
    // Bounds of facets that are not certified may be anything: only the others have a largest one.
    report.certified = made.quality.iter().filter(|q| q.certified).count();
    report.sag_mm.bound_max = made.quality.iter().filter(|q| q.certified).map(|q| q.bound).fold(0.0, f64::max);
    let areas: Vec<f64> = (0..mesh.facets.len()).map(|f| mesh.facet_area(f)).collect();
    report.area_mm2 = areas.iter().sum();
    let in_quads: f64 = areas.iter().zip(&mesh.facets).filter(|(_, f)| !f.is_triangle()).map(|(a, _)| a).sum();
    report.quad_area_share = if report.area_mm2 > 0.0 { (in_quads / report.area_mm2).abs() } else { 0.0 };
    report.faces.failed = failed.len();
    report.failed = failed_faces(model, &failed);
    report.over_angle = angles::steep_faces(mesh, model, settings);
    report.faces.repaired = repairs.len();
    report.repaired = repairs::repaired_faces(&made, model, &repairs);
    report.faces.meshed = model.placed_face_count() - failed.len();
    name_uncertified(&mut report, &made, model);
    let all_closed = count_shells(&mut report, &made, model);
    report.volume_mm3 = (all_closed && report.facets > 0).then(|| made.mesh.volume());
    if settings.measure {
        let samples = sample_within_budget(&made.mesh, model, &made.quality, &originals);
        fill_in_samples(&mut report, &samples, &made.quality, &areas);
    }
    made.report = report;
    made
}

/// Returns the faces that were not meshed, with their entities and, as yet, the default cause; empty for none.
fn failed_faces(model: &Model, failed: &[FaceId]) -> Vec<FailedFace> {
    // Looked up only where there is something to name: models may have thousands of faces.
    if failed.is_empty() {
        return Vec::new();
    }
    let entities: Vec<Option<u64>> = model.placed_faces().map(|f| f.entity()).collect();
    let named =
        |id: &FaceId| FailedFace { face: id.0, entity: entities[id.index()], cause: FailureCause::default() };
    failed.iter().map(named).collect()
}

/// Adds to the report the faces with facets that are not certified, in the mesh's order of faces, with their entity and the file's gap, mm
/// of the scene.
fn name_uncertified(report: &mut Report, made: &Tessellation, model: &Model) {
    for (facet, _) in made.mesh.facets.iter().zip(&made.quality).filter(|(_, q)| !q.certified) {
        match report.not_certified.last_mut() {
            Some(last) if last.face == facet.face.0 => last.facets += 1,
            _ => {
                report.not_certified.push(NotCertified { face: facet.face.0, entity: None, facets: 1, gap_mm: 0.0 })
            }
        }
    }
    if !report.not_certified.is_empty() {
        let faces: Vec<_> = model.placed_faces().collect();
        for n in &mut report.not_certified {
            let placed = &faces[n.face as usize];
            n.entity = placed.entity();
            n.gap_mm = placed.face.map_or(0.0, |f| f.gap * placed.placement.scale.abs());
        }
    }
}

/// Adds to the report the numbers of open and closed shells, of sheets, which the file calls open, and of edges that are open, touch, are
/// turned, or are shared by more than two facets; returns whether every shell of the model is closed. Sheets are not examined; they, and
/// ready meshes, count as not closed only in what is returned.
fn count_shells(report: &mut Report, made: &Tessellation, model: &Model) -> bool {
    let facets = &made.mesh.facets;
    let mut all = true;
    for (instance, first) in model.instances.iter().zip(model.first_faces()) {
        let mut face = first.0;
        let part = model.part(instance.part);
        for shell in &part.shells {
            let next = face + shell.faces.len() as u32;
            // Facets lie in the order of their faces, and so of the shells.
            let start = facets.partition_point(|f| f.face.0 < face);
            let end = facets.partition_point(|f| f.face.0 < next);
            face = next;
            if !shell.closed {
                report.shells.sheets += 1;
                all = false;
                continue;
            }
            // What bounds no volume by the file's own word is not counted as broken.
            let topology = made.mesh.topology(start..end);
            let Topology { open_edges, nonmanifold_edges, touching_edges, turned_edges } = topology;
            report.open_edges += open_edges;
            report.nonmanifold_edges += nonmanifold_edges + turned_edges;
            report.touching_edges += touching_edges;
            if start < end && topology.is_closed() {
                report.shells.closed += 1;
            } else {
                report.shells.open += 1;
                all = false;
            }
        }
        // A ready mesh has no shell that says whether it is closed.
        all &= part.tessellated.is_empty();
    }
    all
}

/// Fills in what samples show: sag and its excess over the tolerance, mm, and errors of normals, degrees. `areas` are those of the facets,
/// mm².
fn fill_in_samples(report: &mut Report, samples: &MeshSamples, quality: &[FacetQuality], areas: &[f64]) {
    let known = || (0..areas.len()).filter_map(|i| Some((i, samples.facet(i)?)));
    report.unsampled = areas.len() - known().count();
    report.sag_mm.sampled_max = Some(known().map(|(_, s)| s.sag).fold(0.0, f64::max));
    // By area: many small facets would else outweigh a few large ones.
    let area: f64 = known().map(|(i, _)| areas[i]).sum();
    let mean = known().map(|(i, s)| s.mean * areas[i]).sum::<f64>() / area.max(f64::MIN_POSITIVE);
    report.sag_mm.sampled_mean = Some(mean);
    let over =
        |s: &Sampled, q: &FacetQuality| s.sag > q.tolerance * (1.0 + SAMPLE_ROUNDING[0]) + SAMPLE_ROUNDING[1];
    report.over = known().filter(|(i, s)| over(s, &quality[*i])).map(|(i, s)| (i as u32, s.sag)).collect();
    report.over_tolerance = Some(report.over.len());
    let mut errors = samples.normal_errors();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count: u64 = errors.iter().map(|e| e.1).sum();
    // Of equal facets at several places the errors were found once and count as often as there are places.
    let at = |share: f64| {
        let i = (count.saturating_sub(1) as f64 * share) as u64;
        let below = errors.iter().scan(0, |sum, (error, count)| {
            *sum += count;
            Some((*sum, *error))
        });
        let found = below.into_iter().find(|(sum, _)| *sum > i);
        found.map_or(0.0, |(_, error)| f64::from(error).to_degrees())
    };
    report.normal_error_deg = Some(Percentiles { p50: at(0.5), p99: at(0.99), max: at(1.0) });
}

/// Samples how far any mesh of a model lies from its splines: the largest distance and the mean weighted by area, mm.
///
/// Vertices need their `uv`. This is how [`Report::sag_mm`] is sampled, for meshes of others.
///
/// ```
/// use lampyris::math::Frame;
/// use lampyris::model::{Face, Model, Part, Shell};
/// use lampyris::{nurbs::sweep, tessellate};
///
/// let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 20.0]));
/// let model = Model::from_part(Part { shells: vec![Shell { faces: vec![tube], ..Shell::default() }], ..Part::default() });
/// let made = tessellate::tessellate(&model, &tessellate::Settings::uniform(0.05));
/// let [largest, mean] = tessellate::sampled_sag(&made.mesh, &model);
/// assert!(mean < largest && largest <= 0.05);
/// ```
pub fn sampled_sag(mesh: &FacetMesh, model: &Model) -> [f64; 2] {
    let sampled = sample::sample_mesh(mesh, model);
    let areas = (0..mesh.facets.len()).map(|f| mesh.facet_area(f));
    let (sum, area) = sampled.iter().zip(areas).fold((0.0, 0.0), |(s, t), (x, a)| (s + x.mean * a, t + a));
    [sampled.iter().map(|s| s.sag).fold(0.0, f64::max), sum / area.max(f64::MIN_POSITIVE)]
}

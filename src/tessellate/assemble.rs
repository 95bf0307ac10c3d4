//! Parts are meshed once, in parallel over their faces, and copied to where they stand.

use super::border::edges::{self, Division, Side};
use super::face::{self, FaceMesh};
use super::fallback;
use super::repairs::Repair;
use super::settings::{Field, Place, Settings};
use super::sheet::Sheet;
use super::{FacetQuality, Tessellation};
use crate::math::{FaceId, Frame, Point};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{EdgeId, Face, Instance, Model, Part, TessellatedFace};
use rayon::prelude::*;

/// A part's faces, in the order of its shells.
pub(super) struct PartMesh {
    shared: Vec<Point>,
    faces: Vec<Option<FaceMesh>>,
}

/// Times that borders are sampled more densely where they cross or facets beside them are not proved.
const TRIES: usize = 3;

/// Meshes every part that is placed.
pub(super) fn parts(model: &Model, settings: &Settings) -> Vec<Option<PartMesh>> {
    (0..model.parts.len())
        .into_par_iter()
        .map(|p| {
            let uses: Vec<usize> =
                (0..model.instances.len()).filter(|&i| model.instances[i].part.0 as usize == p).collect();
            let scale = uses.iter().map(|&i| model.instances[i].placement.scale.abs()).fold(0.0, f64::max);
            (!uses.is_empty()).then(|| mesh_part(model, &model.parts[p], &uses, scale, settings))
        })
        .collect()
}

fn mesh_part(model: &Model, part: &Part, uses: &[usize], scale: f64, settings: &Settings) -> PartMesh {
    let faces: Vec<&Face> = part.shells.iter().flat_map(|s| &s.faces).collect();
    let firsts: Vec<u32> = uses.iter().map(|&i| model.first_face(i).0).collect();
    let sheets: Vec<Option<Sheet<'_>>> = faces
        .par_iter()
        .enumerate()
        .map(|(k, f)| {
            let placed: Vec<FaceId> = firsts.iter().map(|first| FaceId(first + k as u32)).collect();
            let (tolerance, radii) = tolerance(settings, part, f, &placed);
            usable(f).then(|| {
                let field = Field::new(tolerance, radii, settings.law, scale).with_angle(settings.angle_deg);
                // Faces that were not read from a file have a gap of zero whether it was measured or not.
                let mut sheet = Sheet::new(&f.surface, f.reversed, field);
                sheet.gap = Some(f.gap).filter(|&g| g > 0.0);
                sheet
            })
        })
        .collect();
    let mut denser = vec![0u32; part.edges.len()];
    let mut tries = 0;
    let mut before: Option<Before> = None;
    let mut alone = Vec::new();
    loop {
        let mut sides: Vec<Vec<Side<'_, '_>>> = (0..part.edges.len()).map(|_| Vec::new()).collect();
        for (face, sheet) in faces.iter().zip(&sheets) {
            let Some(sheet) = sheet else { continue };
            for side in face.loops.iter().flat_map(|l| &l.uses) {
                if let Some(list) = side.edge.and_then(|e| sides.get_mut(e.0 as usize)) {
                    list.push(Side { sheet, side });
                }
            }
        }
        let known: Vec<(&Face, &Sheet<'_>)> =
            faces.iter().zip(&sheets).filter_map(|(f, s)| Some((*f, s.as_ref()?))).collect();
        let (divisions, shared) = edges::divide(part, &known, &sides, &denser, &mut alone);
        let mesh = |(face, sheet): (&&Face, &Option<Sheet<'_>>)| {
            one(part, face, sheet.as_ref()?, &divisions, &shared, settings)
        };
        let meshes: Vec<Option<FaceMesh>> = match before.take() {
            None => faces.par_iter().zip(&sheets).map(mesh).collect(),
            Some(before) => {
                // Few edges change: faces whose own did not are as they were, but for the numbers of their corners.
                let moved = before.moved(part, &divisions);
                let again = |(face, mesh): (&&Face, &Option<FaceMesh>)| {
                    mesh.is_none() || face.loops.iter().flat_map(|l| &l.uses).any(|u| moved.has_changed(u.edge))
                };
                let dirty: Vec<bool> = faces.iter().zip(&before.meshes).map(again).collect();
                let all = faces.par_iter().zip(&sheets).zip(before.meshes).zip(dirty);
                all.map(
                    |((x, old), dirty)| if dirty { mesh(x) } else { old.map(|m| moved.renamed(m, shared.len())) },
                )
                .collect()
            }
        };
        let coarse: Vec<usize> = meshes.iter().flatten().flat_map(|m| &m.coarse).map(|e| e.0 as usize).collect();
        if coarse.is_empty() || tries == TRIES {
            return joined(PartMesh { shared, faces: meshes });
        }
        tries += 1;
        for e in coarse {
            denser[e] = tries as u32;
        }
        before = Some(Before { divisions, shared: shared.len(), meshes });
    }
}

/// Gives one number to vertices that a file has twice in one place where loops touch: the face whose loops they are has one corner there, the
/// faces beyond must have the same.
fn joined(mut mesh: PartMesh) -> PartMesh {
    let all: Vec<[u32; 2]> = mesh.faces.iter().flatten().flat_map(|f| f.same.iter().copied()).collect();
    if all.is_empty() {
        return mesh;
    }
    let mut first: Vec<u32> = (0..mesh.shared.len() as u32).collect();
    let find = |first: &[u32], mut p: u32| {
        while first[p as usize] != p {
            p = first[p as usize];
        }
        p
    };
    for [a, b] in all {
        let (a, b) = (find(&first, a), find(&first, b));
        first[a.max(b) as usize] = a.min(b);
    }
    for (p, _, _) in mesh.faces.iter_mut().flatten().flat_map(|f| &mut f.corners) {
        if (*p as usize) < first.len() {
            *p = find(&first, *p);
        }
    }
    mesh
}

/// What a part looked like before some of its edges were sampled more densely.
struct Before {
    divisions: Vec<Division>,
    shared: usize,
    meshes: Vec<Option<FaceMesh>>,
}

/// Where shared positions are now, and which edges have others.
struct Moved {
    changed: Vec<bool>,
    to: Vec<u32>,
}

impl Before {
    fn moved(&self, part: &Part, now: &[Division]) -> Moved {
        let mut to: Vec<u32> = (0..self.shared as u32).collect();
        let mut changed = Vec::with_capacity(part.edges.len());
        for (old, new) in self.divisions.iter().zip(now) {
            changed.push(old.t != new.t);
            if old.t == new.t {
                (0..old.t.len() as u32 - 2).for_each(|k| to[(old.first + k) as usize] = new.first + k);
            }
        }
        Moved { changed, to }
    }
}

impl Moved {
    fn has_changed(&self, edge: Option<EdgeId>) -> bool {
        edge.is_some_and(|e| self.changed.get(e.0 as usize).is_none_or(|&c| c))
    }

    /// The mesh with the numbers that its corners have now.
    fn renamed(&self, mut mesh: FaceMesh, shared: usize) -> FaceMesh {
        for (p, _, _) in &mut mesh.corners {
            let own = (*p as usize).checked_sub(self.to.len());
            *p = own.map_or_else(|| self.to[*p as usize], |own| (shared + own) as u32);
        }
        mesh.same.iter_mut().flatten().for_each(|p| *p = self.to[*p as usize]);
        mesh
    }
}

fn one(
    part: &Part,
    face: &Face,
    sheet: &Sheet<'_>,
    divisions: &[Division],
    shared: &[Point],
    settings: &Settings,
) -> Option<FaceMesh> {
    let known = |e: Option<crate::model::EdgeId>| e.is_none_or(|e| (e.0 as usize) < part.edges.len());
    let complete = face.loops.iter().flat_map(|l| &l.uses).all(|u| known(u.edge));
    if !complete {
        return None;
    }
    let numbers = face.loops.iter().flat_map(|l| &l.uses).all(|u| u.uv.points.iter().all(|p| p.is_finite()));
    let whole = if numbers { face::mesh(part, face, sheet, divisions, shared, settings) } else { None };
    whole.or_else(|| fallback::boundary(part, face, sheet, divisions, shared))
}

/// Whether all numbers of a face are numbers.
fn usable(face: &Face) -> bool {
    let s = &face.surface;
    let [[u0, u1], [v0, v1]] = s.domain();
    let points = s.points.iter().all(|p| p.is_finite() && p.w > 0.0);
    points && u0 < u1 && v0 < v1 && (u1 - u0).is_finite() && (v1 - v0).is_finite()
}

fn tolerance(settings: &Settings, part: &Part, face: &Face, placed: &[FaceId]) -> ([f64; 2], [f64; 2]) {
    let matches = |place: &Place| match place {
        Place::Part(name) => *name == part.name,
        Place::Face(name) => *name == face.name,
        Place::Entity(id) => face.entity == Some(*id),
        Place::Placed(ids) => placed.iter().any(|f| ids.contains(f)),
    };
    let found = settings.overrides.iter().rev().find(|o| matches(&o.place));
    found.map_or((settings.tolerance, settings.radii), |o| (o.tolerance, o.radii.unwrap_or(settings.radii)))
}

/// Puts every instance's facets where they belong.
pub(super) fn place(
    model: &Model,
    parts: &[Option<PartMesh>],
) -> (Tessellation, Vec<FaceId>, Vec<(FaceId, Repair)>) {
    let mut out = Tessellation::default();
    let (mut failed, mut repairs) = (Vec::new(), Vec::new());
    for (i, instance) in model.instances.iter().enumerate() {
        let first = model.first_face(i);
        let part = model.part(instance.part);
        let Some(mesh) = &parts[instance.part.0 as usize] else { continue };
        let shared = out.mesh.positions.len() as u32;
        out.mesh.positions.extend(mesh.shared.iter().map(|&p| instance.placement.point(p)));
        for (k, face) in mesh.faces.iter().enumerate() {
            let id = FaceId(first.0 + k as u32);
            match face {
                Some(face) => {
                    repairs.extend(face.repaired.map(|how| (id, how)));
                    place_face(&mut out, instance, mesh, shared, face, id);
                }
                None => failed.push(id),
            }
        }
        for (k, ready) in part.tessellated.iter().enumerate() {
            place_ready(&mut out, &instance.placement, ready, FaceId(first.0 + (mesh.faces.len() + k) as u32));
        }
    }
    drop_unused(&mut out.mesh);
    (out, failed, repairs)
}

fn place_face(
    out: &mut Tessellation,
    instance: &Instance,
    mesh: &PartMesh,
    shared: u32,
    face: &FaceMesh,
    id: FaceId,
) {
    let (frame, limit) = (&instance.placement, mesh.shared.len() as u32);
    let own = out.mesh.positions.len() as u32;
    out.mesh.positions.extend(face.own.iter().map(|&p| frame.point(p)));
    let corner = out.mesh.vertices.len() as u32;
    out.mesh.vertices.extend(face.corners.iter().map(|&(p, n, uv)| MeshVertex {
        position: if p < limit { shared + p } else { own + p - limit },
        normal: frame.normal(n),
        uv,
    }));
    for ((f, &bound), &tolerance) in face.facets.iter().zip(&face.bounds).zip(&face.tolerances) {
        let vertices = turned(f.map(|c| c + corner), frame);
        out.mesh.facets.push(Facet { vertices, face: id });
        let (bound, tolerance) = (bound * frame.scale, tolerance * frame.scale);
        let proved = bound <= tolerance;
        out.mesh.sag.push(if proved { bound } else { f64::INFINITY });
        out.quality.push(FacetQuality { tolerance, bound, certified: proved });
    }
}

/// A mirrored placement turns facets around, so that they stay counter-clockwise from outside.
fn turned([a, b, c, d]: [u32; 4], frame: &Frame) -> [u32; 4] {
    if !frame.is_mirrored() {
        [a, b, c, d]
    } else if c == d {
        [a, c, b, b]
    } else {
        [a, d, c, b]
    }
}

/// A face that is a mesh in the file is copied as it is: it is its own truth.
fn place_ready(out: &mut Tessellation, frame: &Frame, ready: &TessellatedFace, id: FaceId) {
    let (p, v) = (out.mesh.positions.len() as u32, out.mesh.vertices.len() as u32);
    out.mesh.positions.extend(ready.mesh.positions.iter().map(|&x| frame.point(x)));
    out.mesh.vertices.extend(ready.mesh.vertices.iter().map(|x| MeshVertex {
        position: x.position + p,
        normal: frame.normal(x.normal),
        uv: x.uv,
    }));
    for f in &ready.mesh.facets {
        out.mesh.facets.push(Facet { vertices: turned(f.vertices.map(|c| c + v), frame), face: id });
        out.mesh.sag.push(0.0);
        out.quality.push(FacetQuality { tolerance: 0.0, bound: 0.0, certified: true });
    }
}

/// Removes positions that no facet uses: ends of edges without faces, hanging samples of failed faces.
fn drop_unused(mesh: &mut FacetMesh) {
    let mut name = vec![u32::MAX; mesh.positions.len()];
    for v in mesh.facets.iter().flat_map(|f| f.vertices) {
        name[mesh.vertices[v as usize].position as usize] = 0;
    }
    let mut kept = Vec::new();
    for (slot, &p) in name.iter_mut().zip(&mesh.positions) {
        if *slot == 0 {
            *slot = kept.len() as u32;
            kept.push(p);
        }
    }
    mesh.positions = kept;
    for v in &mut mesh.vertices {
        // A corner without facets can only come with a ready mesh; it may point anywhere.
        v.position = name[v.position as usize].min(mesh.positions.len().saturating_sub(1) as u32);
    }
}

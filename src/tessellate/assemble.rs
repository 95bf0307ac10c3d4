//! Parts are meshed once, in parallel over their faces, and copied to where they stand.

use super::border::edge_chords::EdgeSide;
use super::border::edges::{self, Division, OwnDivision};
use super::face::{self, FaceInput, Unmeshed};
use super::face_mesh::FaceMesh;
use super::face_surface::FaceSurface;
use super::fallback;
use super::nodes::Position;
use super::report::Repair;
use super::settings::{FaceSelector, Settings, ToleranceField};
use super::tessellation::{FacetQuality, Tessellation};
use super::triangulator::guarded;
use crate::math::{FaceId, Frame, Point};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{EdgeId, Face, Instance, Model, Part, PartId, TessellatedFace};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// A part's faces, in the order of its shells.
pub(super) struct PartMesh {
    pub(super) divisions: Vec<Division>,
    pub(super) shared: Vec<Point>,
    pub(super) faces: Vec<Option<FaceMesh>>,
}

/// Times that borders are sampled more densely where they cross or facets beside them are not proved.
const MAX_ROUNDS: u32 = 3;

/// Meshes every part that is placed.
pub(super) fn mesh_parts(model: &Model, settings: &Settings) -> Vec<Option<PartMesh>> {
    let mut placed: Vec<PlacedPart<'_>> =
        model.parts.iter().map(|part| PlacedPart { part, firsts: Vec::new(), scale: 0.0 }).collect();
    for (i, instance) in model.instances.iter().enumerate() {
        let part = &mut placed[instance.part.0 as usize];
        part.firsts.push(model.first_face(i).0);
        part.scale = part.scale.max(instance.placement.scale.abs());
    }
    let mesh = |part: &PlacedPart<'_>| (!part.firsts.is_empty()).then(|| mesh_part(part, settings));
    placed.par_iter().map(mesh).collect()
}

/// A part in its places.
struct PlacedPart<'m> {
    part: &'m Part,
    /// The first placed face of each instance.
    firsts: Vec<u32>,
    /// Largest scale of a placement.
    scale: f64,
}

impl<'m> PlacedPart<'m> {
    fn new(model: &'m Model, part: PartId) -> Self {
        let uses = (0..model.instances.len()).filter(|&i| model.instances[i].part == part);
        let scale = uses.clone().map(|i| model.instances[i].placement.scale.abs()).fold(0.0, f64::max);
        Self { part: model.part(part), firsts: uses.map(|i| model.first_face(i).0).collect(), scale }
    }

    /// The surface of the `k`th face with its tolerance; `None` where it has numbers that are none.
    fn surface(&self, settings: &Settings, k: usize, face: &'m Face) -> Option<FaceSurface<'m>> {
        let placed: Vec<FaceId> = self.firsts.iter().map(|first| FaceId(first + k as u32)).collect();
        let (tolerance, radii) = tolerance(settings, self.part, face, &placed);
        is_finite(face).then(|| {
            let field =
                ToleranceField::new(tolerance, radii, settings.law, self.scale).with_angle(settings.angle_deg);
            // Faces that were not read from a file have a gap of zero whether it was measured or not.
            let mut surface = FaceSurface::new(&face.surface, face.reversed, field);
            surface.gap = Some(face.gap).filter(|&g| g > 0.0);
            surface
        })
    }
}

/// One of a part's faces with its surface.
pub(super) fn face_with_surface<'m>(
    model: &'m Model,
    settings: &Settings,
    part: PartId,
    k: usize,
) -> Option<(&'m Face, FaceSurface<'m>)> {
    let placed = PlacedPart::new(model, part);
    let face = placed.part.shells.iter().flat_map(|s| &s.faces).nth(k)?;
    Some((face, placed.surface(settings, k, face)?))
}

fn mesh_part(placed: &PlacedPart<'_>, settings: &Settings) -> PartMesh {
    let part = placed.part;
    let faces: Vec<&Face> = part.shells.iter().flat_map(|s| &s.faces).collect();
    let with_surface = |(k, face)| (face, placed.surface(settings, k, face));
    let faces: Vec<(&Face, Option<FaceSurface<'_>>)> =
        faces.into_par_iter().enumerate().map(with_surface).collect();
    let known: Vec<(&Face, &FaceSurface<'_>)> =
        faces.iter().filter_map(|(face, surface)| Some((*face, surface.as_ref()?))).collect();
    // The sides of each edge on its faces.
    let mut sides: Vec<Vec<EdgeSide<'_, '_>>> = (0..part.edges.len()).map(|_| Vec::new()).collect();
    for &(face, surface) in &known {
        for edge_use in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(list) = edge_use.edge.and_then(|e| sides.get_mut(e.0 as usize)) {
                list.push(EdgeSide { surface, edge_use });
            }
        }
    }
    let mut denser = vec![0u32; part.edges.len()];
    let mut own: Vec<OwnDivision> = Vec::new();
    let mut before: Option<PreviousRound> = None;
    let mut round = 0;
    loop {
        let (divisions, shared) = edges::divide(part, &known, &sides, &denser, &mut own);
        let mesh = |(face, surface): &(&Face, Option<FaceSurface<'_>>)| {
            let surface = surface.as_ref()?;
            mesh_face(&FaceInput { part, face, surface, divisions: &divisions, shared: &shared, settings })
        };
        let meshes: Vec<Option<FaceMesh>> = match before.take() {
            None => faces.par_iter().map(mesh).collect(),
            Some(before) => {
                // Few edges change: faces whose own did not are as they were, but for the numbers of their corners.
                let renumbering = Renumbering::new(part, (&before.divisions, before.shared), &divisions);
                let again = |((face, _), old): (&(&Face, Option<FaceSurface<'_>>), &Option<FaceMesh>)| {
                    old.is_none()
                        || face.loops.iter().flat_map(|l| &l.uses).any(|u| renumbering.has_changed(u.edge))
                };
                let dirty: Vec<bool> = faces.iter().zip(&before.meshes).map(again).collect();
                let all = faces.par_iter().zip(before.meshes).zip(dirty);
                let renew = |((face, old), dirty)| {
                    if dirty { mesh(face) } else { Option::map(old, |m| renumbering.renumbered(m)) }
                };
                all.map(renew).collect()
            }
        };
        let coarse: Vec<usize> = meshes.iter().flatten().flat_map(|m| &m.coarse).map(|e| e.0 as usize).collect();
        if coarse.is_empty() || round == MAX_ROUNDS {
            return with_coincident_vertices_joined(PartMesh { divisions, shared, faces: meshes });
        }
        round += 1;
        for e in coarse {
            denser[e] = round;
        }
        before = Some(PreviousRound { divisions, shared: shared.len(), meshes });
    }
}

/// Gives one number to vertices that a file has twice in one place where loops touch: the face whose loops they are has one corner there, the
/// faces beyond must have the same.
pub(super) fn with_coincident_vertices_joined(mut mesh: PartMesh) -> PartMesh {
    let pairs: Vec<[u32; 2]> = mesh.faces.iter().flatten().flat_map(|f| f.coincident.iter().copied()).collect();
    if pairs.is_empty() {
        return mesh;
    }
    // Union of sets, each named by its least member.
    let mut parent: Vec<u32> = (0..mesh.shared.len() as u32).collect();
    let root = |parent: &[u32], mut p: u32| {
        while parent[p as usize] != p {
            p = parent[p as usize];
        }
        p
    };
    for [a, b] in pairs {
        let (a, b) = (root(&parent, a), root(&parent, b));
        parent[a.max(b) as usize] = a.min(b);
    }
    for corner in mesh.faces.iter_mut().flatten().flat_map(|f| &mut f.corners) {
        if let Position::Shared(p) = &mut corner.position {
            *p = root(&parent, *p);
        }
    }
    mesh
}

/// What a part looked like before some of its edges were sampled more densely.
struct PreviousRound {
    divisions: Vec<Division>,
    /// How many shared positions there were.
    shared: usize,
    meshes: Vec<Option<FaceMesh>>,
}

/// Where shared positions are now, and which edges have others.
pub(super) struct Renumbering {
    changed: Vec<bool>,
    to: Vec<u32>,
}

impl Renumbering {
    /// From one division of a part's edges, with so many shared positions, to another.
    pub(super) fn new(part: &Part, (before, shared): (&[Division], usize), now: &[Division]) -> Self {
        let mut to: Vec<u32> = (0..shared as u32).collect();
        let mut changed = Vec::with_capacity(part.edges.len());
        for (old, new) in before.iter().zip(now) {
            changed.push(old.t != new.t);
            if old.t == new.t {
                (0..old.t.len() as u32 - 2).for_each(|k| to[(old.first + k) as usize] = new.first + k);
            }
        }
        Self { changed, to }
    }

    pub(super) fn has_changed(&self, edge: Option<EdgeId>) -> bool {
        edge.is_some_and(|e| self.changed.get(e.0 as usize).is_none_or(|&c| c))
    }

    /// The mesh with the numbers that its shared positions have now.
    pub(super) fn renumbered(&self, mut mesh: FaceMesh) -> FaceMesh {
        for corner in &mut mesh.corners {
            if let Position::Shared(p) = &mut corner.position {
                *p = self.to[*p as usize];
            }
        }
        mesh.coincident.iter_mut().flatten().for_each(|p| *p = self.to[*p as usize]);
        mesh
    }
}

/// A face by its cells and transition, or by its border alone; `None` where neither gives facets.
pub(super) fn mesh_face(input: &FaceInput<'_, '_>) -> Option<FaceMesh> {
    let FaceInput { part, face, surface, divisions, shared, .. } = *input;
    let uses = || face.loops.iter().flat_map(|l| &l.uses);
    // Edges and vertices that the part does not have cannot be met.
    let exists = |e: EdgeId| {
        let edge = part.edges.get(e.0 as usize);
        edge.is_some_and(|edge| edge.vertices.iter().all(|v| (v.0 as usize) < part.vertices.len()))
    };
    if !uses().filter_map(|u| u.edge).all(exists) {
        return None;
    }
    let finite = uses().all(|u| u.uv.points.iter().all(|p| p.is_finite()));
    let whole = if finite { face::mesh(input) } else { Err(Unmeshed::Empty) };
    let how = match whole {
        Ok(mesh) => return Some(mesh),
        Err(Unmeshed::Empty) => Repair::BorderOnly,
        Err(Unmeshed::GaveUp) => Repair::TriangulationFailed,
    };
    // The same library may give up on the border too.
    let border = guarded(|| fallback::border_alone(part, face, surface, divisions, shared)).ok().flatten();
    border.map(|mesh| FaceMesh { repaired: Some(how), ..mesh })
}

/// Whether all numbers of a face are numbers.
fn is_finite(face: &Face) -> bool {
    let s = &face.surface;
    let [[u0, u1], [v0, v1]] = s.domain();
    let points = s.points.iter().all(|p| p.is_finite() && p.w > 0.0);
    points && u0 < u1 && v0 < v1 && (u1 - u0).is_finite() && (v1 - v0).is_finite()
}

fn tolerance(settings: &Settings, part: &Part, face: &Face, placed: &[FaceId]) -> ([f64; 2], [f64; 2]) {
    let matches = |place: &FaceSelector| match place {
        FaceSelector::Part(name) => *name == part.name,
        FaceSelector::Face(name) => *name == face.name,
        FaceSelector::Entity(id) => face.entity == Some(*id),
        FaceSelector::Placed(ids) => placed.iter().any(|f| ids.contains(f)),
    };
    let last = settings.overrides.iter().rev().find(|o| matches(&o.place));
    last.map_or((settings.tolerance, settings.radii), |o| (o.tolerance, o.radii.unwrap_or(settings.radii)))
}

/// What placing gives.
pub(super) struct Placed {
    pub(super) made: Tessellation,
    /// Faces without facets.
    pub(super) failed: Vec<FaceId>,
    /// Faces of which something was given up.
    pub(super) repairs: Vec<(FaceId, Repair)>,
}

/// Puts every instance's facets where they belong; `joined` are instances with a mesh of their own.
pub(super) fn place_instances(
    model: &Model,
    parts: &[Option<PartMesh>],
    joined: &FxHashMap<usize, PartMesh>,
) -> Placed {
    let mut out = Placed { made: Tessellation::default(), failed: Vec::new(), repairs: Vec::new() };
    for (i, instance) in model.instances.iter().enumerate() {
        let first = model.first_face(i);
        let part = model.part(instance.part);
        let Some(mesh) = joined.get(&i).or(parts[instance.part.0 as usize].as_ref()) else { continue };
        let shared = out.made.mesh.positions.len() as u32;
        out.made.mesh.positions.extend(mesh.shared.iter().map(|&p| instance.placement.point(p)));
        for (k, face) in mesh.faces.iter().enumerate() {
            let id = FaceId(first.0 + k as u32);
            match face {
                Some(face) => {
                    out.repairs.extend(face.repaired.map(|how| (id, how)));
                    place_face(&mut out.made, instance, shared, face, id);
                }
                None => out.failed.push(id),
            }
        }
        for (k, ready) in part.tessellated.iter().enumerate() {
            let id = FaceId(first.0 + (mesh.faces.len() + k) as u32);
            place_ready(&mut out.made, &instance.placement, ready, id);
        }
    }
    drop_unused(&mut out.made.mesh);
    out
}

/// Adds the facets of a face whose part's shared positions start at `shared`.
fn place_face(out: &mut Tessellation, instance: &Instance, shared: u32, face: &FaceMesh, id: FaceId) {
    let frame = &instance.placement;
    let own = out.mesh.positions.len() as u32;
    out.mesh.positions.extend(face.own.iter().map(|&p| frame.point(p)));
    let first = out.mesh.vertices.len() as u32;
    out.mesh.vertices.extend(face.corners.iter().map(|corner| MeshVertex {
        position: match corner.position {
            Position::Shared(p) => shared + p,
            Position::Own(p) => own + p,
        },
        normal: frame.normal(corner.normal),
        uv: corner.uv,
    }));
    for facet in &face.facets {
        let vertices = turned(facet.corners.map(|c| c + first), frame);
        out.mesh.facets.push(Facet { vertices, face: id });
        let (bound, tolerance) = (facet.bound * frame.scale, facet.tolerance * frame.scale);
        let certified = bound <= tolerance;
        out.mesh.sag.push(if certified { bound } else { f64::INFINITY });
        out.quality.push(FacetQuality { tolerance, bound, certified });
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

//! Parts are meshed once, in parallel over their faces.

use super::border::edge_chords::EdgeSide;
use super::border::edges::{self, Division, OwnDivision};
use super::extent;
use super::face::{self, FaceInput, Unmeshed};
use super::face_mesh::FaceMesh;
use super::face_surface::FaceSurface;
use super::fallback;
use super::limits;
use super::meetings::{MeetingSamples, Meetings};
use super::nodes::Position;
use super::placed_part::PlacedPart;
use super::previous_round::PreviousRound;
use super::remesh_budget::RemeshBudget;
use super::report::{FailureCause, Repair};
use super::settings::Settings;
use super::taken_chords::{NO_CHORDS, TakenChords, doubled_chords};
use super::triangulator::catch_panic;
use crate::math::Point;
use crate::model::{EdgeId, Face, Part};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// The facets of a part, its faces in the order of its shells, in the part's coordinates.
pub(super) struct PartMesh {
    /// Where each edge is divided, by [`EdgeId`].
    pub(super) divisions: Vec<Division>,
    /// Places of vertices and of samples of edges, in the part's coordinates.
    pub(super) shared: Vec<Point>,
    /// `None` for a face that could not be meshed or has no usable surface.
    pub(super) faces: Vec<Option<FaceMesh>>,
    /// Why faces, by their place in the part, have no facets: too many, too much work, or no area. Other failures are not in it.
    pub(super) causes: FxHashMap<usize, FailureCause>,
    /// What each face has given up for the sake of others.
    pub(super) taken: Vec<TakenChords>,
    /// Samples of edges that are one corner where the edges cross.
    pub(super) meetings: Meetings,
}

/// Times that borders are sampled more densely where facets beside them are not proved, and that doubled chords are looked for.
const MAX_ROUNDS: u32 = 3;
/// The same where borders cross or leave nothing: the fourth holds chords to 1/256 of the tolerance. Two rims 2 µm apart cross before it at
/// 0.2 mm; a border that crosses itself in the file gains nothing, and with two more rounds such a face trebled the facets of a turbine.
const MAX_ROUNDS_OF_REPAIRED: u32 = 4;
/// The same with the rounds in which edges whose chords cross take each other's corners: a few near a cusp, each nearer to it.
const MAX_ROUNDS_OF_CROSSING: u32 = MAX_ROUNDS_OF_REPAIRED + 4;
/// Samples of an edge up to which its chords may be the reason that its face has no facets.
const FEW_CHORDS: usize = 500;

/// Meshes every part once, for the largest scale at which it is placed. `None` for a part without an instance; faces that fail are `None`
/// within their part.
pub(super) fn mesh_parts(placed: &[PlacedPart<'_>], settings: &Settings) -> Vec<Option<PartMesh>> {
    let too_large = limits::faces_beyond(placed, settings);
    let mesh = |(i, part): (usize, &PlacedPart<'_>)| {
        part.is_placed().then(|| mesh_part(part, settings, |k| too_large.get(&(i, k)).copied()))
    };
    placed.par_iter().enumerate().map(mesh).collect()
}

/// Returns the `k`-th face of a part, counted through its shells, with its surface; `None` when there is no such face or its surface cannot
/// be used.
pub(super) fn face_with_surface<'m>(
    placed: &PlacedPart<'m>,
    settings: &Settings,
    k: usize,
) -> Option<(&'m Face, FaceSurface<'m>)> {
    let face = placed.part.shells.iter().flat_map(|s| &s.faces).nth(k)?;
    Some((face, placed.surface(settings, k, face)?))
}

/// Meshes a part as [`mesh_with_rounds`], with shorter chords beside turned facets; without where borders come to cross with them.
fn mesh_part(
    placed: &PlacedPart<'_>,
    settings: &Settings,
    too_large: impl Fn(usize) -> Option<f64> + Sync,
) -> PartMesh {
    let (mesh, asked) = mesh_with_rounds(placed, settings, &too_large, true);
    let crossing = |mesh: &PartMesh| {
        mesh.faces.iter().flatten().filter(|m| m.repaired == Some(Repair::CrossingBorder)).count()
    };
    // Between edges that nearly touch, the chords of the one may cross those of the other for it: a turned facet is the lesser evil.
    if asked && crossing(&mesh) > 0 {
        let (without, _) = mesh_with_rounds(placed, settings, &too_large, false);
        return if crossing(&without) < crossing(&mesh) { without } else { mesh };
    }
    mesh
}

/// Divides the edges of a part, meshes its faces, and starts again while faces ask for it: with denser edges, at most
/// [`MAX_ROUNDS_OF_REPAIRED`] times, then with further samples where chords still cross, up to round [`MAX_ROUNDS_OF_CROSSING`]. Last, it
/// meshes anew the faces that share an inner chord. `too_large` gives, for a face to be left out, the cells that it would need;
/// `mends_turned` is whether edges beside turned facets get shorter chords, and what is returned with the mesh whether any did.
fn mesh_with_rounds(
    placed: &PlacedPart<'_>,
    settings: &Settings,
    too_large: &(impl Fn(usize) -> Option<f64> + Sync),
    mends_turned: bool,
) -> (PartMesh, bool) {
    let part = placed.part;
    let faces: Vec<&Face> = part.shells.iter().flat_map(|s| &s.faces).collect();
    let without_area = extent::lone_faces_without_area(&faces);
    let laid_out = |(k, face)| {
        let is_left_out = too_large(k).is_some() || without_area.binary_search(&k).is_ok();
        (face, if is_left_out { None } else { placed.surface(settings, k, face) })
    };
    let faces: Vec<(&Face, Option<FaceSurface<'_>>)> = faces.into_par_iter().enumerate().map(laid_out).collect();
    let known: Vec<_> = faces.iter().filter_map(|(face, surface)| Some((*face, surface.as_ref()?))).collect();
    let sides = edge_sides(part, &known);
    let mut denser = vec![0u32; part.edges.len()];
    let mut further: Vec<Vec<f64>> = vec![Vec::new(); part.edges.len()];
    let mut meetings = Meetings::default();
    // What edges and faces come to by themselves is kept from round to round: few edges change.
    let mut own: Vec<OwnDivision> = Vec::new();
    let mut before: Option<PreviousRound> = None;
    let mut budget = RemeshBudget::new(faces.len(), settings);
    let (mut round, mut asked) = (0, false);
    let (divisions, shared, mut meshes) = loop {
        let (divisions, shared) = edges::divide(part, &known, &sides, (&denser, &further), &mut own);
        let mesh = |(face, surface): &(&Face, Option<FaceSurface<'_>>)| {
            let (surface, taken) = (surface.as_ref()?, &NO_CHORDS);
            let (divisions, shared, meetings) = (&divisions[..], &shared[..], &meetings);
            let untangles = false;
            mesh_face(&FaceInput { part, face, surface, divisions, shared, settings, taken, meetings, untangles })
        };
        let (meshes, is_kept) = match before.take() {
            None => (faces.par_iter().map(mesh).collect(), vec![false; faces.len()]),
            Some(before) => before.meshed_again(part, &faces, &divisions, mesh),
        };
        for (k, mesh) in meshes.iter().enumerate().filter(|(k, _)| !is_kept[*k]) {
            budget.spend(k, mesh.as_ref());
        }
        let settled = budget.edges_of_spent(faces.iter().map(|(face, _)| *face));
        // A last round that asks for more is taken as it is; what does not hold is counted.
        let mut coarse = coarse_edges(&faces, &meshes, &divisions, round);
        let turned = if mends_turned { turned_edges(&meshes, round) } else { vec![] };
        asked |= !turned.is_empty();
        coarse.extend(turned);
        coarse.retain(|e| !settled.contains(e));
        if round < MAX_ROUNDS_OF_REPAIRED && !coarse.is_empty() {
            round += 1;
            coarse.into_iter().for_each(|e| denser[e] = round);
        } else {
            // Where shorter chords still cross, as between arcs that touch, each gets the other's corners.
            let mut facing: Vec<(EdgeId, f64)> = meshes.iter().flatten().flat_map(|m| m.facing.clone()).collect();
            let mut met: Vec<MeetingSamples> = meshes.iter().flatten().flat_map(|m| m.meetings.clone()).collect();
            met.retain(|pair| meetings.insert(*pair));
            facing.extend(met.as_flattened());
            facing.retain(|(edge, _)| !settled.contains(&(edge.0 as usize)));
            if facing.is_empty() || round == MAX_ROUNDS_OF_CROSSING {
                break (divisions, shared, meshes);
            }
            round = round.max(MAX_ROUNDS_OF_REPAIRED) + 1;
            facing.into_iter().for_each(|(edge, t)| further[edge.0 as usize].push(t));
        }
        before = Some(PreviousRound { divisions, shared: shared.len(), meshes });
    };
    let input = |k: usize| {
        let (face, surface) = &faces[k];
        let (divisions, shared, surface) = (&divisions[..], &shared[..], surface.as_ref()?);
        let (taken, meetings, untangles) = (&NO_CHORDS, &meetings, false);
        Some(FaceInput { part, face, surface, divisions, shared, settings, taken, meetings, untangles })
    };
    fill_crossing_borders(&mut meshes, input);
    let again = |k: usize, taken: &TakenChords| mesh_face(&FaceInput { taken, ..input(k)? });
    let taken = take_doubled_chords(part, &mut meshes, &mut budget, again);
    let causes = failure_causes(&faces, &meshes, too_large);
    let mesh = PartMesh { divisions, shared, faces: meshes, causes, taken, meetings };
    (with_coincident_vertices_joined(mesh), asked)
}

/// Replaces, in `meshes`, faces whose borders cross in the parameter plane: by a mesh with their cusps untangled, or else by one of their
/// borders alone, where that lies within the tolerance of the surface: narrow strips, whose neighbours it meets. `input` gives what a face
/// is meshed from, by its index.
fn fill_crossing_borders<'i, 'a: 'i>(
    meshes: &mut [Option<FaceMesh>],
    input: impl Fn(usize) -> Option<FaceInput<'i, 'a>>,
) {
    for (k, mesh) in meshes.iter_mut().enumerate() {
        let Some(mesh) = mesh.as_mut() else { continue };
        let is_border_alone = match mesh.repaired {
            // All of its border is kept, and what it encloses twice is no strip.
            Some(Repair::CrossingBorder) if mesh.meets_itself => continue,
            Some(Repair::CrossingBorder) => false,
            // A strip whose chords cross so often that nothing is left within them.
            Some(Repair::BorderOnly) => true,
            _ => continue,
        };
        let untangled = input(k).and_then(|input| mesh_face(&FaceInput { untangles: true, ..input }));
        let border = || {
            let input = input(k).filter(|_| !is_border_alone)?;
            let border = catch_panic(|| fallback::border_within_tolerance(&input)).ok().flatten()?;
            Some(FaceMesh { repaired: Some(Repair::BorderOnly), ..border })
        };
        if let Some(filled) = untangled.filter(|mesh| mesh.repaired.is_none()).or_else(border) {
            *mesh = filled;
        }
    }
}

/// Replaces, in `meshes`, faces with a diagonal that the shell has as a chord elsewhere too, by what `mesh` makes without it, and counts
/// that in `budget`; [`MAX_ROUNDS`] times at most, as a new mesh may have another such diagonal. Returns the chords taken from each face.
fn take_doubled_chords(
    part: &Part,
    meshes: &mut [Option<FaceMesh>],
    budget: &mut RemeshBudget,
    mesh: impl Fn(usize, &TakenChords) -> Option<FaceMesh>,
) -> Vec<TakenChords> {
    let mut taken: Vec<TakenChords> = vec![TakenChords::default(); meshes.len()];
    for _ in 0..MAX_ROUNDS {
        let shells = part.shells.iter().map(|shell| shell.faces.len());
        for (k, chords) in doubled_chords(shells, meshes, &taken, |k| budget.is_spent(k)) {
            taken[k].extend(chords);
            // A face without a surface has no chords that could be taken.
            meshes[k] = mesh(k, &taken[k]);
            budget.spend(k, meshes[k].as_ref());
        }
    }
    taken
}

/// Returns why faces, by their places, were left without facets: too many cells, of which `too_large` knows the number, too many steps of
/// proofs, or no area.
fn failure_causes(
    faces: &[(&Face, Option<FaceSurface<'_>>)],
    meshes: &[Option<FaceMesh>],
    too_large: impl Fn(usize) -> Option<f64>,
) -> FxHashMap<usize, FailureCause> {
    let cause = |(k, (face, surface)): (usize, &(&Face, Option<FaceSurface<'_>>))| {
        let over_steps = surface.as_ref().is_some_and(|s| s.steps.are_too_many());
        let cells = too_large(k).map(FailureCause::TooManyFacets);
        let limit = cells.or(over_steps.then_some(FailureCause::TooManySteps));
        let has_no_area = || meshes[k].is_none() && extent::has_no_area(&face.surface);
        Some((k, limit.or_else(|| has_no_area().then_some(FailureCause::NoArea))?))
    };
    faces.iter().enumerate().filter_map(cause).collect()
}

/// Returns for each edge its sides on faces with a usable surface: only these have a say in how it is divided.
fn edge_sides<'f, 's>(part: &Part, known: &[(&'f Face, &'f FaceSurface<'s>)]) -> Vec<Vec<EdgeSide<'f, 's>>> {
    let mut sides: Vec<Vec<EdgeSide<'_, '_>>> = (0..part.edges.len()).map(|_| Vec::new()).collect();
    for &(face, surface) in known {
        for edge_use in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(list) = edge_use.edge.and_then(|e| sides.get_mut(e.0 as usize)) {
                list.push(EdgeSide { surface, edge_use });
            }
        }
    }
    sides
}

/// Returns the edges, perhaps twice, that need shorter chords: those that faces ask for, and all edges of at most [`FEW_CHORDS`] samples of
/// a face that has no mesh or only one of its border. `round` counts from 0; from [`MAX_ROUNDS`] on only faces whose borders cross may.
fn coarse_edges(
    faces: &[(&Face, Option<FaceSurface<'_>>)],
    meshes: &[Option<FaceMesh>],
    divisions: &[Division],
    round: u32,
) -> Vec<usize> {
    let mut coarse = Vec::new();
    for ((face, surface), mesh) in faces.iter().zip(meshes) {
        let repaired = mesh.as_ref().map(|m| m.repaired);
        let came_to_little = match repaired {
            None => surface.as_ref().is_some_and(|s| !s.steps.are_too_many()),
            // What it lacks are corners where its edges cross.
            Some(_) if mesh.as_ref().is_some_and(|m| !m.meetings.is_empty()) => false,
            // Of the other repairs shorter chords would mend nothing.
            Some(how) => matches!(how, Some(Repair::BorderOnly | Repair::TriangulationFailed)),
        };
        if came_to_little {
            let edges = face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| Some(u.edge?.0 as usize));
            coarse.extend(edges.filter(|&e| divisions.get(e).is_some_and(|d| d.t.len() <= FEW_CHORDS)));
        }
        let is_repaired = repaired.flatten() == Some(Repair::CrossingBorder);
        if round < MAX_ROUNDS || is_repaired {
            coarse.extend(mesh.iter().flat_map(|m| &m.coarse).map(|e| e.0 as usize));
        }
    }
    coarse
}

/// Returns the edges, perhaps twice, beside facets that look the other way than their surface; none from round [`MAX_ROUNDS`] on.
fn turned_edges(meshes: &[Option<FaceMesh>], round: u32) -> Vec<usize> {
    if round >= MAX_ROUNDS {
        return vec![];
    }
    meshes.iter().flatten().flat_map(|m| &m.turned).map(|e| e.0 as usize).collect()
}

/// Gives vertices that a file has twice in one place, where loops of a face touch, and samples where its edges cross, the least of their
/// numbers, in all faces of the part.
/// Only corners change; the positions left over stay in `shared`.
pub(super) fn with_coincident_vertices_joined(mut mesh: PartMesh) -> PartMesh {
    let pairs: Vec<[u32; 2]> = mesh.faces.iter().flatten().flat_map(|f| f.coincident.iter().copied()).collect();
    if pairs.is_empty() {
        return mesh;
    }
    // The least member names a set, so that the numbers do not depend on the order of the pairs.
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

/// Meshes a face by cells and transition, or else from its border alone, which is marked as repaired. `None` where neither gives facets,
/// where the work is over its limit, and where an edge or vertex does not exist.
pub(super) fn mesh_face(input: &FaceInput<'_, '_>) -> Option<FaceMesh> {
    let FaceInput { part, face, .. } = *input;
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
    // Inside of a point there is nothing but rounding; its border closes what is beside it.
    let is_meshed = finite && !extent::is_point(&face.surface);
    let whole = if is_meshed { face::mesh(input) } else { Err(Unmeshed::Empty) };
    let (how, meetings) = match whole {
        Ok(mesh) => return Some(mesh),
        Err(Unmeshed::Empty) => (Repair::BorderOnly, vec![]),
        Err(Unmeshed::Crossing(meetings)) => (Repair::BorderOnly, meetings),
        Err(Unmeshed::GaveUp) => (Repair::TriangulationFailed, vec![]),
        Err(Unmeshed::TooManySteps) => return None,
    };
    // The same library may give up on the border too.
    let border = catch_panic(|| fallback::border_alone(input)).ok().flatten();
    border.map(|mesh| FaceMesh { repaired: Some(how), meetings, ..mesh })
}

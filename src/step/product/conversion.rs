//! One representation as a part: edges first, then faces, both in parallel, numbered in the order of the file.

use super::face_edges::{FaceEdges, face_edges};
use super::free_surfaces::{Bounded, convert_free_surfaces, convert_trimmed_face, number_boundaries};
use super::numbering::{ConvertedPart, add_face, repair_note};
use super::recipe_parts::convert_recipes;
use super::rims::align_rims;
use super::shells::add_shells;
use super::spikes::{EdgeTable, remove_spikes};
use super::styles::Styles;
use super::swapped_vertices::put_vertices_in_order;
use super::topology::{EdgeKey, FacePlan, ShapeItems, number_edges, read_face};
use super::zero_width::{joined_vertex, remove_faces_without_width, vertex_ids, vertices_of_empty_edges};
use crate::math::Point;
use crate::model::{Edge, EdgeId, Face, Part, VertexId};
use crate::nurbs::{Curve, Surface};
use crate::step::geometry::edges::{EdgeContext, TrimmedEdge};
use crate::step::geometry::extent::FaceExtent;
use crate::step::geometry::units::Units;
use crate::step::geometry::{EMPTY_EDGE_MM, FARTHEST_MM, GeometryReader, Outcome, Refusal};
use crate::step::part21::File;
use crate::step::settings::Settings;
use crate::step::trim::face::build_face;
use crate::step::trim::fit::Budget;
use crate::step::trim::task::{FaceTask, TaskEdge};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Ends of edges this many of their gaps apart are one, up to a gap of [`LARGEST_JOINED_GAP_MM`].
const JOINED_GAPS: f64 = 2.0;
/// See [`JOINED_GAPS`]; mm.
const LARGEST_JOINED_GAP_MM: f64 = 0.05;
/// Edges of a face whose points are asked for where a surface is sized by them.
const ASKED_EDGES: usize = 64;

/// Converts the shapes of a representation into a part, in mm; never fails: faces that cannot be converted are refused one by one.
pub(crate) fn convert(
    file: &File<'_>,
    units: Units,
    items: &ShapeItems,
    styles: &Styles,
    settings: &Settings,
) -> ConvertedPart {
    let geometry = GeometryReader { file, units };
    let (refused, repaired) = (items.refused.clone(), items.repaired.clone());
    let mut out = ConvertedPart { refused, repaired, ..ConvertedPart::default() };
    out.found += items.refused.len();

    // What to convert: a face that occurs in several shells, and an edge that bounds several faces, once.
    let mut seen = FxHashSet::default();
    let mut ids: Vec<u64> =
        items.shells.iter().flat_map(|s| &s.faces).map(|f| f.0).filter(|f| seen.insert(*f)).collect();
    let mut plans: FxHashMap<u64, Outcome<FacePlan>> = ids.iter().map(|&id| (id, read_face(file, id))).collect();
    let in_order = ids.iter().filter_map(|id| plans[id].as_ref().ok());
    let (mut keys, mut index) = number_edges(in_order);

    // Each edge once: faces that share one must get the same bits, or they would not join.
    let single = plans.values().flatten().flat_map(|plan| &plan.loops).filter(|l| l.len() == 1);
    let alone: FxHashSet<EdgeKey> = single.map(|l| l[0].0).collect();
    let entities = keys.iter().filter_map(|key| if let EdgeKey::Entity(id) = key { Some(*id) } else { None });
    let others = geometry.composite_edges(entities);
    let edge = |key: &EdgeKey| {
        let context = EdgeContext { is_alone: alone.contains(key), is_swapped: false, others: &others };
        edge_curve(&geometry, *key, context)
    };
    let mut edges: Vec<Outcome<TrimmedEdge>> = keys.par_iter().map(edge).collect();
    let table = EdgeTable { keys: &mut keys, index: &mut index, edges: &mut edges };
    let swapped = put_vertices_in_order(&geometry, &ids, &mut plans, table);
    let reason = "its vertices are in the wrong order: all loops run it the other way";
    out.repaired.extend(swapped.iter().map(|&id| repair_note(file, id, reason.into())));
    let joined = vertices_of_empty_edges(file, &keys, &edges);
    let mut removed = remove_faces_without_width(&geometry, &ids, &mut plans, (&keys, &index), (&edges, &joined));
    let table = EdgeTable { keys: &mut keys, index: &mut index, edges: &mut edges };
    let spiked = remove_spikes(file, &ids, &mut plans, table, &joined);
    removed.extend(spiked.removed);
    let without = (!removed.is_empty()).then(|| items.without_faces(&removed));
    let items = without.as_ref().unwrap_or(items);
    let reason = "it has no width: it is left out, and the faces beside it meet";
    out.repaired.extend(removed.iter().map(|&id| repair_note(file, id, reason.into())));
    let reason = "its border comes back along itself: what has no width between is left out";
    out.repaired.extend(spiked.trimmed.iter().map(|&id| repair_note(file, id, reason.into())));
    ids.retain(|id| plans.contains_key(id));
    let moved = align_rims(&geometry, &ids, &plans, (&keys, &index), &mut edges);
    out.found += ids.len();
    let convert_one = |id: &u64| {
        let plan = plans[id].as_ref().map_err(Refusal::clone);
        (*id, plan.and_then(|plan| convert_face(&geometry, *id, plan, &edges, &index, settings)))
    };
    let built: Vec<(u64, Outcome<Bounded>)> = ids.par_iter().map(convert_one).collect();

    // Edges move into the part only now: a second copy of them, and of the faces below, took the peak of a 30 MB file
    // from 103 to 117 MiB.
    let mut part = Part::default();
    let numbers = add_edges(&geometry, (&keys, &joined, &moved), edges, &mut part);
    let mut faces: FxHashMap<u64, Face> = FxHashMap::default();
    for (id, outcome) in built {
        match outcome {
            Ok((built, boundaries)) => {
                if !built.repairs.is_empty() {
                    out.repaired.push(repair_note(file, id, built.repairs.join("; ")));
                }
                let name = plans[&id].as_ref().map_or_else(|_| String::new(), |p| p.name.clone());
                // A face that trims of its surface bound has edges of its own.
                let own = number_boundaries(boundaries, &mut part);
                let numbers = if own.is_empty() { &numbers } else { &own };
                faces.insert(id, add_face(built, id, name, &mut part, numbers, styles));
            }
            Err(refusal) => out.refused.push(refusal),
        }
    }
    add_shells(&geometry, items, faces, styles, &mut part, &mut out);
    convert_recipes(&geometry, items, styles, settings, &mut part, &mut out);
    convert_free_surfaces(&geometry, items, styles, settings, &mut part, &mut out);
    out.part = part;
    out
}

/// Moves edges, and the vertices that they share, into the part. Returns the number of each key's edge there, `None` for edges that failed
/// or have no length. Of the latter the two vertices become one, as `joined` says; those in `moved` are where it says.
fn add_edges(
    geometry: &GeometryReader<'_, '_>,
    (keys, joined, moved): (&[EdgeKey], &FxHashMap<u64, u64>, &FxHashMap<u64, Point>),
    edges: Vec<Outcome<TrimmedEdge>>,
    part: &mut Part,
) -> Vec<Option<EdgeId>> {
    let mut vertices: FxHashMap<u64, VertexId> = FxHashMap::default();
    let mut numbers: Vec<Option<EdgeId>> = Vec::with_capacity(keys.len());
    for (key, edge) in keys.iter().zip(edges) {
        let Ok(TrimmedEdge { curve: Some(curve), .. }) = edge else {
            numbers.push(None);
            continue;
        };
        let [a, b] = curve.domain();
        let ends = vertex_ids(geometry.file, *key).map(|id| id.map(|id| joined_vertex(joined, id)));
        let vertices = [(ends[0], a), (ends[1], b)].map(|(id, t)| {
            let mut add = || {
                // The file's own vertex, where it has one: edges that meet there end at the same bits.
                let given = id.and_then(|id| moved.get(&id).copied().or_else(|| geometry.vertex(id).ok()));
                part.vertices.push(given.unwrap_or_else(|| curve.evaluate(t)));
                VertexId(part.vertices.len() as u32 - 1)
            };
            // An end without a name meets no other.
            match id {
                Some(id) => *vertices.entry(id).or_insert_with(add),
                None => add(),
            }
        });
        let entity = match key {
            EdgeKey::Entity(id) | EdgeKey::Part { entity: id, .. } => Some(*id),
            EdgeKey::Straight(..) => None,
        };
        numbers.push(Some(EdgeId(part.edges.len() as u32)));
        part.edges.push(Edge { curve, vertices, entity });
    }
    numbers
}

/// Returns the curve of an edge, mm, or the line between two points of a loop; without one where it has no length.
fn edge_curve(geometry: &GeometryReader<'_, '_>, key: EdgeKey, context: EdgeContext<'_>) -> Outcome<TrimmedEdge> {
    match key {
        // Parts are cut from whole edges, which must be there first.
        EdgeKey::Entity(id) | EdgeKey::Part { entity: id, .. } => geometry.edge(id, context),
        EdgeKey::Straight(a, b) => {
            let (p, q) = (geometry.point(a)?, geometry.point(b)?);
            let length = (q - p).length();
            let curve = (length > EMPTY_EDGE_MM).then(|| Curve::line(p, q, [0.0, length]));
            Ok(TrimmedEdge { curve, ..TrimmedEdge::default() })
        }
    }
}

/// Whether points of the edges are needed to choose the part of a surface that is meant: of every kind but planes, cylinders, cones,
/// spheres and B-splines, by keyword alone.
fn is_sized_by_edges(file: &File<'_>, surface: u64) -> bool {
    let simple = ["PLANE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SPHERICAL_SURFACE", "B_SPLINE_SURFACE"];
    let known = |k: &str| simple.iter().any(|s| k.starts_with(s));
    file.entity(surface).is_some_and(|e| !e.keywords().any(known))
}

/// Whether all of a surface lies within [`FARTHEST_MM`].
fn is_in_reach(surface: &Surface) -> bool {
    let bounds = surface.bounds();
    bounds.min.abs().max(bounds.max.abs()).max_element() <= FARTHEST_MM
}

/// Makes the refusal of a face whose surface reaches beyond the resolution of numbers.
fn beyond_rounding(geometry: &GeometryReader<'_, '_>, id: u64, plan: &FacePlan) -> Refusal {
    let surface = geometry.file.entity_name(plan.surface);
    let reason = format!(
        "#{} {surface}: reaches beyond {FARTHEST_MM:e} mm, too far out for double precision to hold a shape",
        plan.surface
    );
    Refusal { id, entity: geometry.file.entity_name(id), reason }
}

/// Converts one face of a plan: its edges joined to loops, its chart, and the trims on it. `edges` are all of the part, found by `index`;
/// boundaries come with a face that its surface's own trims bound. A refusal names the face and, in its reason, what below it is to blame.
fn convert_face(
    geometry: &GeometryReader<'_, '_>,
    id: u64,
    plan: &FacePlan,
    edges: &[Outcome<TrimmedEdge>],
    index: &FxHashMap<EdgeKey, usize>,
    settings: &Settings,
) -> Outcome<Bounded> {
    let entity = geometry.entity(id)?;
    // What is refused is the face; what is wrong may be an edge far below it.
    let blame = |r: &Refusal| Refusal {
        id,
        entity: entity.name(),
        reason: format!("#{} {}: {}", r.id, r.entity, r.reason),
    };
    let FaceEdges { curves, loops, bounds, gap, repairs } = face_edges(plan, edges, index).map_err(blame)?;

    // Without a loop the face ends where its surface is trimmed.
    let trims = loops.is_empty().then(|| convert_trimmed_face(geometry, plan.surface, plan.same_sense, settings));
    if let Some(bounded) = trims.flatten() {
        let (mut built, boundaries) = bounded.map_err(|r| blame(&r))?;
        if !is_in_reach(&built.surface) {
            return Err(beyond_rounding(geometry, id, plan));
        }
        built.repairs.extend(repairs.into_iter().map(String::from));
        return Ok((built, boundaries));
    }

    // The surface, as much of it as the edges need.
    geometry.entity(plan.surface)?;
    // What sizes itself by the edges asks for their points; of others they would be computed for nothing.
    let asked = if is_sized_by_edges(geometry.file, plan.surface) { ASKED_EDGES } else { 0 };
    let along = |(curve, _): &(&Curve, f64)| {
        let [a, b] = curve.domain();
        [0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9].map(|f| curve.evaluate(a + f * (b - a)))
    };
    let points: Vec<Point> = curves.values().take(asked).flat_map(along).collect();
    let chart = geometry.chart(plan.surface, FaceExtent::from_bounds(bounds, &points), 0).map_err(|r| blame(&r))?;

    // Points are in reach, but a radius or a sweep may not be.
    if !(chart.size <= FARTHEST_MM) {
        return Err(beyond_rounding(geometry, id, plan));
    }

    // Points are one within what the file states, or more where an edge leaves gaps.
    let accuracy = geometry.units.accuracy_on_face(bounds.diagonal());
    let with_gap = |gap: f64| accuracy.max(JOINED_GAPS * gap.min(LARGEST_JOINED_GAP_MM));
    let edges = curves.iter().map(|(&k, &(curve, gap))| (k, TaskEdge { curve, accuracy: with_gap(gap) })).collect();
    let task = FaceTask {
        chart,
        same_sense: plan.same_sense,
        loops,
        edges,
        tolerance: settings.uv_tolerance,
        accuracy: with_gap(gap),
        budget: Budget::new(settings.face_budget),
        implicit_outer: false,
    };
    let mut built = build_face(task).map_err(|reason| {
        let surface = geometry.file.entity_name(plan.surface);
        Refusal { id, entity: entity.name(), reason: format!("#{} {surface}: {reason}", plan.surface) }
    })?;
    // The chart was in reach; the part of it that the edges need may not be.
    if !is_in_reach(&built.surface) {
        return Err(beyond_rounding(geometry, id, plan));
    }
    built.repairs.extend(repairs.into_iter().map(String::from));
    Ok((built, Vec::new()))
}

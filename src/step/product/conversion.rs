//! One representation as a part: edges first, then faces, both in parallel, numbered in the order of the file.

use super::loop_order::{DirectedUse, put_in_order};
use super::orientation::is_inside_out;
use super::styles::Styles;
use super::topology::{EdgeKey, FacePlan, ShapeItems, number_edges, read_face};
use crate::math::{Aabb, Point};
use crate::model::{Edge, EdgeId, Face, Part, Shell, VertexId};
use crate::nurbs::Curve;
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::geometry::extent::FaceExtent;
use crate::step::geometry::units::Units;
use crate::step::geometry::{Geometry, Outcome, Refusal};
use crate::step::part21::File;
use crate::step::settings::Settings;
use crate::step::trim::face::{BuiltFace, build_face, trim_loops};
use crate::step::trim::fit::Budget;
use crate::step::trim::loops::Source;
use crate::step::trim::task::FaceTask;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// A part with the account of its conversion.
#[derive(Debug, Default)]
pub(crate) struct ConvertedPart {
    pub(crate) part: Part,
    /// Faces the file has, distinct.
    pub(crate) found: usize,
    pub(crate) refused: Vec<Refusal>,
    /// Faces that were repaired, and how.
    pub(crate) repaired: Vec<Refusal>,
}

/// Converts the items of a representation.
pub(crate) fn convert(
    file: &File<'_>,
    units: Units,
    items: &ShapeItems,
    styles: &Styles,
    settings: &Settings,
) -> ConvertedPart {
    let geometry = Geometry { file, units };
    let mut out = ConvertedPart { refused: items.refused.clone(), ..ConvertedPart::default() };
    out.found += items.refused.len();
    // A face that occurs in several shells is converted once.
    let mut seen = FxHashSet::default();
    let ids: Vec<u64> =
        items.shells.iter().flat_map(|s| &s.faces).map(|f| f.0).filter(|f| seen.insert(*f)).collect();
    out.found += ids.len();
    let plans: FxHashMap<u64, Outcome<FacePlan>> = ids.iter().map(|&id| (id, read_face(file, id))).collect();
    let in_order = ids.iter().filter_map(|id| plans[id].as_ref().ok());
    let (keys, index) = number_edges(in_order);
    let edges: Vec<Outcome<TrimmedEdge>> = keys.par_iter().map(|&key| edge_curve(&geometry, key)).collect();
    let built: Vec<(u64, Outcome<BuiltFace>)> = ids
        .par_iter()
        .map(|id| {
            let plan = match &plans[id] {
                Ok(plan) => plan,
                Err(refusal) => return (*id, Err(refusal.clone())),
            };
            (*id, convert_face(&geometry, *id, plan, &edges, &index, settings))
        })
        .collect();
    // Edges move into the part only now: a second copy of them, and of the faces below, took the peak of a 30 MB file
    // from 103 to 117 MiB.
    let mut part = Part::default();
    let mut vertices: FxHashMap<u64, VertexId> = FxHashMap::default();
    // Positions of edges in the part; edges without length or that failed have none.
    let mut numbers: Vec<Option<EdgeId>> = Vec::with_capacity(keys.len());
    for (key, edge) in keys.iter().zip(edges) {
        let Ok(TrimmedEdge { curve: Some(curve), .. }) = edge else {
            numbers.push(None);
            continue;
        };
        let [a, b] = curve.domain();
        let ends = vertex_ids(file, *key);
        let vertices = [(ends[0], a), (ends[1], b)].map(|(id, t)| {
            *vertices.entry(id).or_insert_with(|| {
                part.vertices.push(geometry.vertex(id).unwrap_or_else(|_| curve.evaluate(t)));
                VertexId(part.vertices.len() as u32 - 1)
            })
        });
        let entity = if let EdgeKey::Entity(id) = key { Some(*id) } else { None };
        numbers.push(Some(EdgeId(part.edges.len() as u32)));
        part.edges.push(Edge { curve, vertices, entity });
    }
    let mut faces: FxHashMap<u64, Face> = FxHashMap::default();
    for (id, outcome) in built {
        match outcome {
            Ok(built) => {
                if !built.repairs.is_empty() {
                    let entity = file.entity(id).map(|e| e.name()).unwrap_or_default();
                    out.repaired.push(Refusal { id, entity, reason: built.repairs.join("; ") });
                }
                let name = plans[&id].as_ref().map(|p| p.name.clone()).unwrap_or_default();
                faces.insert(id, add_face(built, id, name, &mut part, &numbers, styles));
            }
            Err(refusal) => out.refused.push(refusal),
        }
    }
    let mut left: FxHashMap<u64, usize> = FxHashMap::default();
    items.shells.iter().flat_map(|s| &s.faces).for_each(|f| *left.entry(f.0).or_default() += 1);
    // A void without the shell around it stands alone.
    let mut enclosed = false;
    for plan in &items.shells {
        let layer = plan.owners.iter().find_map(|o| styles.layer(*o));
        let own = plan.faces.iter().filter_map(|(id, flip)| {
            let uses = left.entry(*id).or_default();
            *uses = uses.saturating_sub(1);
            let mut face = if *uses == 0 { faces.remove(id)? } else { faces.get(id)?.clone() };
            face.reversed ^= flip;
            face.layer = face.layer.or_else(|| layer.clone());
            Some(face)
        });
        let mut own: Vec<Face> = own.collect();
        if plan.outer && own.len() == plan.faces.len() && is_inside_out(&own) {
            own.iter_mut().for_each(|face| face.reversed ^= true);
            let id = plan.owners.first().copied().unwrap_or_default();
            let entity = file.entity(id).map(|e| e.name()).unwrap_or_default();
            out.repaired.push(Refusal { id, entity, reason: "the shell of a solid was inside out".into() });
        }
        let shell = Shell {
            faces: own,
            closed: plan.closed,
            void: plan.void && enclosed,
            colour: plan.owners.iter().find_map(|o| styles.colour(*o)),
            name: plan.name.clone(),
        };
        enclosed = if plan.void { enclosed } else { !shell.faces.is_empty() };
        if !shell.faces.is_empty() {
            part.shells.push(shell);
        }
    }
    super::free_surfaces::convert_free_surfaces(&geometry, items, styles, settings, &mut part, &mut out);
    out.part = part;
    out
}

/// Vertex entities of an edge.
fn vertex_ids(file: &File<'_>, key: EdgeKey) -> [u64; 2] {
    match key {
        EdgeKey::Straight(a, b) => [a, b],
        EdgeKey::Entity(id) => {
            let args =
                file.entity(id).and_then(|e| e.attributes("EDGE", 1).or_else(|| e.attributes("EDGE_CURVE", 1)));
            [0, 1].map(|i| args.and_then(|a| a.id(i)).unwrap_or(0))
        }
    }
}

fn edge_curve(geometry: &Geometry<'_, '_>, key: EdgeKey) -> Outcome<TrimmedEdge> {
    match key {
        EdgeKey::Entity(id) => geometry.edge(id),
        EdgeKey::Straight(a, b) => {
            let (p, q) = (geometry.point(a)?, geometry.point(b)?);
            let length = (q - p).length();
            Ok(TrimmedEdge { curve: (length > 1e-9).then(|| Curve::line(p, q, [0.0, length])), gap: 0.0 })
        }
    }
}

fn convert_face(
    geometry: &Geometry<'_, '_>,
    id: u64,
    plan: &FacePlan,
    edges: &[Outcome<TrimmedEdge>],
    index: &FxHashMap<EdgeKey, usize>,
    settings: &Settings,
) -> Outcome<BuiltFace> {
    let entity = geometry.entity(id)?;
    let mut shapes: FxHashMap<usize, &Curve> = FxHashMap::default();
    let mut loops = Vec::with_capacity(plan.loops.len());
    let mut bounds = Aabb::EMPTY;
    let mut edge_gap = 0f64;
    let mut repairs = Vec::new();
    for uses in &plan.loops {
        let mut kept: Vec<DirectedUse<usize>> = Vec::with_capacity(uses.len());
        for (key, reversed) in uses {
            let k = index[key];
            let edge = edges[k].as_ref().map_err(|r| Refusal {
                id,
                entity: entity.name(),
                reason: format!("#{} {}: {}", r.id, r.entity, r.reason),
            })?;
            edge_gap = edge_gap.max(edge.gap);
            let Some(curve) = &edge.curve else { continue };
            bounds = bounds.union(curve.bounds());
            shapes.entry(k).or_insert(curve);
            let [a, b] = curve.domain().map(|t| curve.evaluate(t));
            let (from, to) = if *reversed { (b, a) } else { (a, b) };
            kept.push(DirectedUse { edge: k, reversed: *reversed, from, to });
        }
        // Far above the gaps of real files, far below the length of an edge that is run the wrong way.
        let shortest = kept.iter().map(|u| (u.to - u.from).length()).filter(|l| *l > 1e-9).fold(1.0, f64::min);
        repairs.extend(put_in_order(&mut kept, (0.1 * shortest).max(1e-6)));
        if !kept.is_empty() {
            loops.push(kept.into_iter().map(|u| (u.edge, u.reversed)).collect());
        }
    }
    // Only what may touch its own axis asks where the edges run.
    let simple = ["PLANE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SPHERICAL_SURFACE", "B_SPLINE_SURFACE"];
    let asks = !geometry.entity(plan.surface)?.keywords().any(|k| simple.iter().any(|s| k.starts_with(s)));
    let along = |curve: &&Curve| {
        let [a, b] = curve.domain();
        [0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9].map(|f| curve.evaluate(a + f * (b - a)))
    };
    let points: Vec<Point> = shapes.values().take(if asks { 64 } else { 0 }).flat_map(along).collect();
    let reach = FaceExtent::from_bounds(bounds, &points);
    let chart = geometry.chart(plan.surface, reach, 0).map_err(|r| Refusal {
        id,
        entity: entity.name(),
        reason: format!("#{} {}: {}", r.id, r.entity, r.reason),
    })?;
    let stated = geometry.units.accuracy.unwrap_or(1e-6).clamp(1e-6, 1e-2);
    let task = FaceTask {
        chart,
        same_sense: plan.same_sense,
        loops,
        edges: shapes,
        tolerance: settings.uv_tolerance,
        accuracy: stated.min(1e-3 * bounds.diagonal().max(1e-3)).max(1e-6).max(2.0 * edge_gap.min(0.05)),
        budget: Budget::new(settings.face_budget),
        implicit_outer: false,
    };
    let mut built = build_face(task).map_err(|reason| {
        let surface = geometry.file.entity(plan.surface).map(|s| s.name()).unwrap_or_default();
        Refusal { id, entity: entity.name(), reason: format!("#{} {surface}: {reason}", plan.surface) }
    })?;
    built.repairs.extend(repairs.into_iter().map(String::from));
    Ok(built)
}

/// Numbers a built face's seams and vertices into the part.
pub(crate) fn add_face(
    built: BuiltFace,
    id: u64,
    name: String,
    part: &mut Part,
    numbers: &[Option<EdgeId>],
    styles: &Styles,
) -> Face {
    // Vertices that the face knows; ends of seams are looked up among them.
    let sources =
        built.loops.iter().flatten().filter_map(|u| if let Source::Edge(e) = u.source { numbers[e] } else { None });
    let mut known: Vec<VertexId> = sources.flat_map(|e| part.edges[e.0 as usize].vertices).collect();
    known.sort();
    known.dedup();
    let near = 1e-5 + 4.0 * built.gap.min(0.1);
    let seams: Vec<EdgeId> = built
        .seams
        .into_iter()
        .map(|seam| {
            let vertices = seam.ends.map(|p| {
                let distance = |v: &VertexId| (part.vertices[v.0 as usize] - p).length();
                let found = known.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                match found.filter(|v| distance(v) <= near) {
                    Some(v) => v,
                    None => {
                        part.vertices.push(p);
                        let v = VertexId(part.vertices.len() as u32 - 1);
                        known.push(v);
                        v
                    }
                }
            });
            part.edges.push(Edge { curve: seam.curve, vertices, entity: None });
            EdgeId(part.edges.len() as u32 - 1)
        })
        .collect();
    let loops = trim_loops(built.loops, |source| match source {
        Source::Edge(e) => numbers[e],
        Source::Seam(k) => Some(seams[k]),
        Source::Nothing => None,
    });
    Face {
        name,
        entity: Some(id),
        colour: styles.colour(id),
        layer: styles.layer(id),
        surface: built.surface,
        analytic: built.analytic,
        reversed: built.reversed,
        loops,
        gap: built.gap,
    }
}

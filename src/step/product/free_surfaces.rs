//! Surfaces that no loop of a face bounds (bare, CURVE_BOUNDED_SURFACE, RECTANGULAR_TRIMMED_SURFACE), and ready meshes.

use super::numbering::{ConvertedPart, add_face};
use super::styles::Styles;
use super::tessellated::TessellatedItems;
use super::topology::ShapeItems;
use crate::math::{Aabb, Point};
use crate::model::{Edge, EdgeId, Part, Shell, VertexId};
use crate::nurbs::Curve;
use crate::step::chart::Chart;
use crate::step::geometry::extent::FaceExtent;
use crate::step::geometry::{GeometryReader, Outcome, Refusal, references};
use crate::step::part21::Entity;
use crate::step::settings::Settings;
use crate::step::trim::face::{BuiltFace, build_face};
use crate::step::trim::fit::Budget;
use crate::step::trim::task::{FaceTask, TaskEdge};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Names of surfaces that are parts of others.
const TRIMMED_SURFACES: [&str; 2] = ["CURVE_BOUNDED_SURFACE", "RECTANGULAR_TRIMMED_SURFACE"];
/// Boundaries of geometric sets meet loosely: real files leave 1e-3 mm.
const LOOSE_BOUNDARY_MM: f64 = 1e-3;
/// A rectangle short of a whole period by less than this share of it is whole.
const PERIOD_SLACK: f64 = 1e-9;

/// Trimming parameters beyond a surface's end by no more than this share of its range are at the end: writers round to six digits.
const RANGE_SLACK: f64 = 1e-5;

/// A built face with its boundary curves, loop by loop.
pub(super) type Bounded = (BuiltFace, Vec<Vec<Curve>>);

/// Converts what is not a face of a shell: each surface becomes a shell of one face in the part, and each mesh a tessellated face. Counts
/// and refusals go to `out`.
pub(crate) fn convert_free_surfaces(
    geometry: &GeometryReader<'_, '_>,
    items: &ShapeItems,
    styles: &Styles,
    settings: &Settings,
    part: &mut Part,
    out: &mut ConvertedPart,
) {
    out.found += items.surfaces.len();
    let built: Vec<(u64, Outcome<Bounded>)> =
        items.surfaces.par_iter().map(|&id| (id, convert_surface(geometry, id, settings))).collect();
    for (id, outcome) in built {
        match outcome {
            Ok((built, boundaries)) => {
                let numbers = number_boundaries(boundaries, part);
                // Unnamed where the file gives no text; the entity itself is there, because it was converted.
                let name = geometry.file.entity(id).map(|e| e.args().name(0)).unwrap_or_default();
                let face = add_face(built, id, name, part, &numbers, styles);
                part.shells.push(Shell { faces: vec![face], ..Shell::default() });
            }
            Err(refusal) => out.refused.push(refusal),
        }
    }
    // Meshes hang below each other; the leaves alone are faces.
    let mut leaves = TessellatedItems::default();
    for &id in &items.tessellated {
        geometry.collect_meshes(id, 0, &mut leaves);
    }
    out.found += leaves.faces.len() + leaves.refused.len();
    out.refused.extend(leaves.refused);
    part.tessellated.extend(leaves.faces.into_iter().map(|mut face| {
        face.colour = face.entity.and_then(|e| styles.colour(e));
        face.layer = face.entity.and_then(|e| styles.layer(e));
        face
    }));
}

/// Adds boundary curves to the part as edges; ends that follow on each other in a boundary share a vertex. Returns their numbers, in order.
pub(super) fn number_boundaries(boundaries: Vec<Vec<Curve>>, part: &mut Part) -> Vec<Option<EdgeId>> {
    let mut numbers = Vec::new();
    for boundary in boundaries {
        let first = part.vertices.len() as u32;
        let n = boundary.len() as u32;
        part.vertices.extend(boundary.iter().map(|c| c.evaluate(c.domain()[0])));
        for (k, curve) in boundary.into_iter().enumerate() {
            let k = k as u32;
            numbers.push(Some(EdgeId(part.edges.len() as u32)));
            let vertices = [VertexId(first + k), VertexId(first + (k + 1) % n)];
            part.edges.push(Edge { curve, vertices, entity: None });
        }
    }
    numbers
}

/// Builds a face without a loop of its own on a surface with trims: these bound it. `None` for a surface of another kind.
pub(super) fn convert_trimmed_face(
    geometry: &GeometryReader<'_, '_>,
    surface: u64,
    same_sense: bool,
    settings: &Settings,
) -> Option<Outcome<Bounded>> {
    geometry.file.entity(surface).filter(|e| e.is_one_of(&TRIMMED_SURFACES))?;
    Some(convert_surface(geometry, surface, settings).map(|(mut built, boundaries)| {
        // Trims have the surface on their left about its own normal, whichever way the face looks.
        built.reversed ^= !same_sense;
        (built, boundaries)
    }))
}

/// Builds the face of one surface with its boundaries; without any, of the whole surface or of its rectangle of parameters.
fn convert_surface(geometry: &GeometryReader<'_, '_>, id: u64, settings: &Settings) -> Outcome<Bounded> {
    let e = geometry.entity(id)?;
    let (mut boundaries, mut implicit) = (Vec::new(), false);
    let mut task = if let Some(a) = e.attributes("CURVE_BOUNDED_SURFACE", 1) {
        for boundary in references(e, a.list(1))? {
            boundaries.push(geometry.segments(geometry.entity(boundary)?, 0)?);
        }
        implicit = a.flag(2) == Some(true);
        let basis = geometry.resolve(e, a.id(0), "basis surface")?;
        let hull = boundaries.iter().flatten().fold(Aabb::EMPTY, |b, c: &Curve| b.union(c.bounds()));
        let points: Vec<Point> = boundaries.iter().flatten().map(|c| c.evaluate(c.domain()[0])).collect();
        let reach = FaceExtent::from_bounds(hull, &points);
        face_task(geometry.chart(basis.id, reach, 0)?, &boundaries, settings)
    } else {
        let mut chart = geometry.chart(id, FaceExtent::UNKNOWN, 0)?;
        if e.attributes("RECTANGULAR_TRIMMED_SURFACE", 1).is_some() {
            let range = trim_rectangle(geometry, e, &chart)?;
            for d in 0..2 {
                let [a, b] = range[d];
                // A rectangle of less than a period is open there, and poles count where it ends at them.
                if chart.period[d].is_none_or(|p| b - a < p * (1.0 - PERIOD_SLACK)) {
                    chart.period[d] = None;
                    chart.poles.retain(|pole| pole.fixed != d || pole.parameter == a || pole.parameter == b);
                    chart.range[d] = range[d];
                }
            }
        }
        face_task(chart, &boundaries, settings)
    };
    task.implicit_outer = implicit;
    let built = build_face(task).map_err(|reason| Refusal::new(e, reason))?;
    Ok((built, boundaries))
}

/// Makes the task of trimming a surface by boundaries that belong to it alone: each curve is an edge of its own, numbered through all
/// boundaries.
fn face_task<'e>(chart: Chart, boundaries: &'e [Vec<Curve>], settings: &Settings) -> FaceTask<'e> {
    // Boundaries of free surfaces share no edges: each use has one of its own, and runs along it.
    let mut edges = FxHashMap::default();
    let mut loops = Vec::new();
    for boundary in boundaries {
        let mut uses = Vec::with_capacity(boundary.len());
        for curve in boundary {
            let k = edges.len();
            edges.insert(k, TaskEdge { curve, accuracy: LOOSE_BOUNDARY_MM });
            uses.push((k, false));
        }
        loops.push(uses);
    }
    FaceTask {
        chart,
        same_sense: true,
        loops,
        edges,
        tolerance: settings.uv_tolerance,
        accuracy: LOOSE_BOUNDARY_MM,
        budget: Budget::new(settings.face_budget),
        implicit_outer: false,
    }
}

/// Returns the parameter rectangle of a RECTANGULAR_TRIMMED_SURFACE in the chart's parameters, ascending; over a seam its end lies beyond
/// the period.
fn trim_rectangle(geometry: &GeometryReader<'_, '_>, e: Entity<'_, '_>, chart: &Chart) -> Outcome<[[f64; 2]; 2]> {
    let Some(a) = e.attributes("RECTANGULAR_TRIMMED_SURFACE", 1) else {
        return Err(Refusal::new(e, "is not trimmed"));
    };
    let scale = chart.parameter_scale(geometry.units.length, geometry.units.angle);
    let Some(scale) = scale else {
        return Err(Refusal::new(e, "its parameters cannot be taken over to the surface's closed form"));
    };
    let mut range = [[0.0; 2]; 2];
    for d in 0..2 {
        let (Some(lo), Some(hi)) = (a.real(1 + 2 * d), a.real(2 + 2 * d)) else {
            return Err(Refusal::new(e, "a trimming parameter is missing"));
        };
        let (mut lo, mut hi) = (lo * scale[d], hi * scale[d]);
        // Against the parameter's sense the first value is the end.
        if a.flag(5 + d) == Some(false) {
            (lo, hi) = (hi, lo);
        }
        match chart.period[d] {
            // From 2π back to 0, with the sense, is all of the period and not nothing of it.
            Some(p) if hi < lo => {
                let width = (hi - lo).rem_euclid(p);
                hi = lo + if width < p * PERIOD_SLACK { p } else { width };
            }
            None if hi < lo => (lo, hi) = (hi, lo),
            _ => {}
        }
        if !(lo.is_finite() && hi.is_finite()) {
            return Err(Refusal::new(e, "a trimming parameter is no number"));
        }
        if chart.period[d].is_none() {
            // Beyond its ends a sphere would be wound again and again, and other surfaces have nothing to show.
            let [a, b] = chart.range[d];
            let slack = RANGE_SLACK * (b - a);
            if lo < a - slack || hi > b + slack {
                return Err(Refusal::new(e, "its trimming parameters leave the surface"));
            }
            (lo, hi) = (lo.max(a), hi.min(b));
        }
        range[d] = [lo, hi];
    }
    Ok(range)
}

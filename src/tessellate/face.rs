//! One face from its border and its surface to facets.

use super::Settings;
use super::border::edges::Division;
use super::border::polygons::{self, BorderPolygons, ImprintedPoints};
use super::border_nodes::BorderNodes;
use super::cells::branches;
use super::cells::cell::{Subdivision, parameter_resolution};
use super::cells::cell_facets::GridInput;
use super::cells::grid;
use super::closing::Closing;
use super::crossing_chords::CrossingChords;
use super::detours::with_detours;
use super::emission::Emission;
use super::expected_cells::cells_granted_for_angle;
use super::face_mesh::FaceMesh;
use super::face_surface::FaceSurface;
use super::imprint::{CarrierFacets, Imprint};
use super::limits::face_budget;
use super::lobes::turn_lobes;
use super::meetings::{MeetingSamples, Meetings};
use super::nodes::{Nodes, ProvedFacet, edge_key};
use super::proof::border_chord::BorderChords;
use super::proof::prover::Prover;
use super::report::Repair;
use super::taken_chords::TakenChords;
use super::transition::creases::crease_lines;
use super::transition::pairing::{self, TransitionFacet};
use super::transition::triangulate::{Outline, Transition, triangulate};
use super::triangulator::{GaveUp, catch_panic};
use super::turned_facets::turned_chords;
use crate::math::polygon::{is_inside_sides, polygon_sides, signed_area};
use crate::math::{Point, Uv};
use crate::model::{Face, Part, TrimLoop};
use crate::nurbs::FundamentalForms;
use rustc_hash::{FxHashMap, FxHashSet};
use std::f64::consts::FRAC_PI_2;

/// Cells at the border that are looked at for the scale of parameters, and places along each side of the face where these are few.
const SCALE_CELLS: usize = 64;
const SCALE_PLACES: usize = 5;
const FEW_CELLS: usize = 4;

/// Scale of the parameters of planes, whose triangles may have any shape: corners around a round hole do not stand on one circle then, and
/// exact arithmetic need not find that they do.
const PLANE_SCALE: Uv = Uv::new(1.0, 0.875);

/// By how much what facets cover may differ from what the border bounds: share of it, and of the box around it. Corners of cells are
/// put on corners of the border up to 1e-7 of the box away.
const COVERED: [f64; 2] = [1e-4, 1e-6];
/// Sides of a loop that vote on whether it is a hole: testing all sides of a loop with thousands would take too long.
const VOTES: usize = 8;

/// Why a face has no facets.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Unmeshed {
    /// Its border encloses nothing in the parameter plane, or no facets came of it.
    Empty,
    /// No facets came of it before its edges have these samples, where they cross.
    Crossing(Vec<MeetingSamples>),
    /// The triangulation library gave up on it.
    GaveUp,
    /// Its proofs took more steps than any face may take.
    TooManySteps,
}

impl From<GaveUp> for Unmeshed {
    fn from(_: GaveUp) -> Self {
        Self::GaveUp
    }
}

/// A face and what it is meshed on.
#[derive(Clone, Copy)]
pub(super) struct FaceInput<'i, 'a> {
    pub(super) part: &'i Part,
    pub(super) face: &'i Face,
    pub(super) surface: &'i FaceSurface<'a>,
    pub(super) divisions: &'i [Division],
    /// The part's shared positions.
    pub(super) shared: &'i [Point],
    pub(super) settings: &'i Settings,
    /// Chords between shared positions that other faces have inside, which no side of a facet here may be.
    pub(super) taken: &'i TakenChords,
    /// Samples of the part's edges that are one corner, where edges cross.
    pub(super) meetings: &'i Meetings,
    /// Whether samples beside cusps are moved where edges cross there by next to nothing, and other chords led over corners that they pass
    /// on the wrong side.
    pub(super) untangles: bool,
}

impl FaceInput<'_, '_> {
    /// Returns a polygon for each of the loops that bound the face, with corners at the imprinted points on it and one corner where edges
    /// cross; `None` where they enclose nothing.
    fn border_polygons(&self, loops: &[TrimLoop], imprint: &Imprint) -> Option<BorderPolygons> {
        let imprinted = ImprintedPoints { points: &imprint.points(), near: imprint.near };
        let mut polygons = polygons::build(self.part, loops, self.surface, self.divisions, &imprinted);
        polygons.join_meeting_corners(loops, self.surface, self.shared, self.meetings);
        if self.untangles {
            polygons.untangle_cusps(self.surface);
        }
        (!polygons.enclose_nothing(self.surface.extent())).then_some(polygons)
    }
}

/// Meshes a face by cells and transition. Facets that are not proved are in the mesh, with their bound; errors are as in
/// [`mesh_with_imprint`].
pub(super) fn mesh(input: &FaceInput<'_, '_>) -> Result<FaceMesh, Unmeshed> {
    mesh_with_imprint(input, &Imprint::default()).map(|(mesh, _)| mesh)
}

/// Meshes a face with the lines of `imprint` as sides of facets, and returns its facets by node too; whether the lines were kept is
/// [`CarrierFacets::holds_imprint`].
///
/// Facets that cover another area than the border bounds, or cross it, are kept as a repair, not an error. Fails where nothing is enclosed
/// or made, the triangulation library gives up, or proofs have taken too many steps.
pub(super) fn mesh_with_imprint(
    input: &FaceInput<'_, '_>,
    imprint: &Imprint,
) -> Result<(FaceMesh, CarrierFacets), Unmeshed> {
    let FaceInput { part, face, surface, shared, settings, taken, .. } = *input;
    let loops = polygons::loops(face);
    let polygons = input.border_polygons(&loops, imprint).ok_or(Unmeshed::Empty)?;
    let mut border = BorderNodes::new(part, &loops, surface, &polygons, shared);
    let vertex_nodes = border.add_imprint(surface, imprint);
    let lines: Vec<[Uv; 2]> = border.imprinted.iter().map(|s| s.map(|n| border.nodes[n].uv)).collect();
    let budget = face_budget(face, surface, settings);
    // The tree gets imprinted lines too, which no cell may lie across.
    let cells = split_for_angle(input, &polygons, &lines, budget);
    let mut prover = Prover::new(surface, settings.acceptance);
    // Pairing must not join triangles across a side that neighbours have.
    let kept = border.segments.iter().chain(&border.imprinted);
    let fixed: FxHashSet<[u32; 2]> = kept.map(|s| edge_key(s[0], s[1])).collect();
    let (lo, hi) = polygons.bounds();
    let resolution = parameter_resolution(lo, hi);
    let grid_input = GridInput { nodes: &mut border.nodes, chords: &border.chords, resolution, taken };
    let mut grid = grid::build(&mut prover, &cells, grid_input);
    if surface.steps.are_too_many() {
        return Err(Unmeshed::TooManySteps);
    }
    border.divide_poles(&cells);
    let segments = unmet_segments(&border.segments, &grid.outline);
    let BorderNodes { nodes, chords, followed, imprinted, segments: on_border, .. } = border;
    let lines = (nodes, segments, imprinted);
    let triangulate = || {
        let outline = outline(input, (&polygons, &cells), (&on_border, &chords), lines);
        triangulate(surface, settings.acceptance, outline, budget)
    };
    let mut transition = catch_panic(triangulate)?.ok_or(Unmeshed::Empty)?;
    // Proofs that were not tried any more say nothing: the face is given up whole, whichever thread came how far.
    if surface.steps.are_too_many() {
        return Err(Unmeshed::TooManySteps);
    }
    transition.triangles.extend(&grid.triangles);
    let exhausted = cells.exhausted || transition.exhausted;
    // Where the budget has ended, shorter chords only cost more.
    let unproved = |t: &Transition| if exhausted { vec![] } else { t.unproved_chords(&chords, &followed) };
    // Where chords cross, the area is off for that: facets that hold ask for no shorter ones.
    let crosses_itself = !transition.conflicts.is_empty() || polygons.meets_itself;
    let beside_crossings = crosses_itself.then(|| unproved(&transition));
    let is_covered = prove_area(&mut transition, &mut grid.quads, &polygons);
    let repaired = first_repair(crosses_itself, is_covered, exhausted);
    let unproved = beside_crossings.unwrap_or_else(|| unproved(&transition));
    let refused = [&transition.conflicts[..], &transition.crossed];
    let crossing = CrossingChords::new(part, surface, &transition.nodes, &followed, refused);
    let left_out_mm = crossing.left_out_mm();
    if left_out_mm > 0.0 {
        give_up_proofs(&mut transition.triangles, &mut grid.quads);
    }
    let mut coarse = if exhausted { vec![] } else { crossing.edges_for_sag() };
    coarse.extend(polygons::edges_of_collapsed_loops(&loops, &polygons));
    let (facing, meetings) = (crossing.facing_samples(), crossing.meeting_samples(&loops, surface));
    let mut facets: Vec<TransitionFacet> = grid.quads.iter().copied().map(TransitionFacet::from).collect();
    facets.extend(pairing::pair_triangles(&transition, &fixed, &mut prover));
    let closing = Closing { surface, nodes: &transition.nodes, segments: &on_border, chords: &chords, taken };
    let (made, facets) = emit(&closing, facets, crosses_itself || input.untangles);
    // Conflicts may have cost an imprinted line, so that the guests' facets would not be bounded by it.
    let holds_imprint = transition.holds_imprint && transition.conflicts.is_empty();
    let edges_of =
        |chords: &[[u32; 2]]| chords.iter().filter_map(|s| Some(followed.get(s)?.edge)).collect::<Vec<_>>();
    let turned = if exhausted {
        vec![]
    } else {
        coarse.extend(edges_of(&unproved));
        edges_of(&turned_chords(&made, &facets, surface.is_flipped(), &transition.nodes, &chords))
    };
    let (nodes, own) = transition.nodes.into_parts();
    if made.facets.is_empty() {
        return Err(if meetings.is_empty() { Unmeshed::Empty } else { Unmeshed::Crossing(meetings) });
    }
    let carrier = CarrierFacets { nodes, facets, vertex_nodes, holds_imprint };
    let meets_itself = polygons.meets_itself && transition.conflicts.is_empty();
    let asked = FaceMesh { coarse, turned, facing, meetings, ..made };
    Ok((FaceMesh { own, coincident: polygons.coincident, repaired, left_out_mm, meets_itself, ..asked }, carrier))
}

/// Splits a face as [`branches::split`] for its angle, twice that, and so on, until one does not take more cells than it may, and then for
/// its tolerance alone: where normals turn at a fold no cell is small enough, and the tolerance would be given up with the angle.
fn split_for_angle(
    input: &FaceInput<'_, '_>,
    polygons: &BorderPolygons,
    lines: &[[Uv; 2]],
    budget: usize,
) -> Subdivision {
    let FaceInput { face, surface, settings, .. } = *input;
    let mut angle = surface.field.angle;
    loop {
        let granted = angle.map_or(budget, |angle| budget.min(cells_granted_for_angle(face, surface, angle)));
        let cells = branches::split(surface, settings.acceptance, polygons, lines, granted, angle);
        if !cells.exhausted || angle.is_none() || surface.steps.are_too_many() {
            return cells;
        }
        angle = angle.map(|angle| 2.0 * angle).filter(|angle| *angle < FRAC_PI_2);
    }
}

/// Returns what lies between whole cells and the border: `nodes`, the `segments` around it, and the lines inside that are `imprinted`.
fn outline<'t>(
    input: &FaceInput<'t, '_>,
    (polygons, cells): (&BorderPolygons, &Subdivision),
    (border, chords): (&[[u32; 2]], &'t BorderChords),
    (nodes, segments, imprinted): (Nodes, Vec<[u32; 2]>, Vec<[u32; 2]>),
) -> Outline<'t> {
    let FaceInput { surface, taken, untangles, .. } = *input;
    // Without a transition its scale is not needed, and it costs curvatures.
    let scale = if segments.is_empty() { Uv::ONE } else { parameter_scale(surface, polygons, cells) };
    let creases = crease_lines(surface, &nodes, &segments);
    let outline = Outline { nodes, segments, creases, imprinted, chords, scale, taken };
    if untangles { with_detours(surface, outline, border) } else { outline }
}

/// Closes the face, whose border may cross itself where it `has_lobes`, turns facets of nodes into facets of corners, and returns their
/// nodes too.
fn emit(closing: &Closing<'_, '_>, mut facets: Vec<TransitionFacet>, has_lobes: bool) -> (FaceMesh, Vec<[u32; 4]>) {
    if has_lobes {
        turn_lobes(closing.nodes, closing.segments, &mut facets);
    }
    let added = closing.facets(&facets);
    facets.extend(added.into_iter().map(TransitionFacet::from));
    let mut emission = Emission::new(closing.surface, closing.nodes);
    facets.iter().for_each(|f| emission.add_facet(&f.facet, f.pole));
    (emission.finish(), facets.iter().map(|f| f.facet.nodes).collect())
}

/// Returns the gravest of what was given up: a border that crosses itself, then area, then a budget used up. `None` if nothing was.
fn first_repair(crosses_itself: bool, is_covered: bool, exhausted: bool) -> Option<Repair> {
    if crosses_itself {
        Some(Repair::CrossingBorder)
    } else if !is_covered {
        Some(Repair::AreaOff)
    } else {
        exhausted.then_some(Repair::CoarserCells)
    }
}

/// Returns the segments in the border or the outline but not in both, which the transition has to fill between.
fn unmet_segments(border: &[[u32; 2]], outline: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let all = border.iter().chain(outline);
    // A segment of the border that cells already meet is used twice, and nothing of it is left.
    all.clone().for_each(|s| *uses.entry(edge_key(s[0], s[1])).or_insert(0) += 1);
    all.filter(|s| uses[&edge_key(s[0], s[1])] % 2 == 1).copied().collect()
}

/// Whether facets cover the area that the border bounds, by [`covers_area_of_border`]. Where they do not, none is proved any more: what
/// covers more or less proves nothing, however near to the surface each facet lies.
fn prove_area(transition: &mut Transition, quads: &mut [ProvedFacet<4>], polygons: &BorderPolygons) -> bool {
    let is_covered = covers_area_of_border(transition, quads, polygons);
    if !is_covered {
        give_up_proofs(&mut transition.triangles, quads);
    }
    is_covered
}

/// Makes all facets unproved.
fn give_up_proofs(triangles: &mut [ProvedFacet<3>], quads: &mut [ProvedFacet<4>]) {
    triangles.iter_mut().for_each(|f| f.bound = f64::INFINITY);
    quads.iter_mut().for_each(|f| f.bound = f64::INFINITY);
}

/// Whether facets cover as much of the parameter plane as the border bounds, within [`COVERED`]. More is covered where they overlap or the
/// border crosses itself, less where something is left out; a gap and an overlap of one size cancel unnoticed.
fn covers_area_of_border(transition: &Transition, quads: &[ProvedFacet<4>], polygons: &BorderPolygons) -> bool {
    let uv = |n: u32| transition.nodes[n].uv;
    let triangles = transition.triangles.iter().map(|f| signed_area(&f.nodes.map(uv)).abs());
    let quads = quads.iter().map(|f| signed_area(&f.nodes.map(uv)).abs());
    let covered: f64 = triangles.chain(quads).sum();
    let loops: Vec<Vec<Uv>> = polygons.polygons.iter().map(|p| p.iter().map(|v| v.uv).collect()).collect();
    let (lo, hi) = polygons.bounds();
    let around = (hi - lo).x * (hi - lo).y;
    let is_near = |bounded: f64| (covered - bounded).abs() <= COVERED[0] * bounded + COVERED[1] * around;
    if is_near(loops.iter().map(|p| signed_area(p)).sum::<f64>().abs()) {
        return true;
    }
    // Loops may run either way: one inside an odd number of others is a hole. Loops may touch, so that the middles of its sides vote.
    let sides: Vec<Vec<[Uv; 2]>> = loops.iter().map(|polygon| polygon_sides(polygon).collect()).collect();
    let is_inside_odd = |k: usize, point: Uv| {
        let others = sides.iter().enumerate().filter(|(j, _)| *j != k).flat_map(|(_, sides)| sides);
        is_inside_sides(others.copied(), point)
    };
    let is_hole = |k: usize| {
        // A few sides are enough for a vote; a loop that touches another in a corner misleads one or two.
        let asked: Vec<bool> = (sides[k].iter().step_by(1 + sides[k].len() / VOTES))
            .map(|[a, b]| is_inside_odd(k, (*a + *b) / 2.0))
            .collect();
        2 * asked.iter().filter(|inside| **inside).count() > asked.len()
    };
    let bounded = |k: usize| if is_hole(k) { -signed_area(&loops[k]).abs() } else { signed_area(&loops[k]).abs() };
    is_near((0..loops.len()).map(bounded).sum::<f64>())
}

/// Returns the factors for u and v, the larger one 1, that turn parameter lengths into counts of chords, so that triangles of the
/// transition lie along the direction that bends less. 1 and 1 where curvature decides nothing.
fn parameter_scale(surface: &FaceSurface<'_>, polygons: &BorderPolygons, cells: &Subdivision) -> Uv {
    let (lo, hi) = polygons.bounds();
    let n = if surface.affine { 1 } else { SCALE_PLACES };
    // Middles of a regular grid: none lies on the border, where creases and poles are.
    let grid = |k: usize| lo + (Uv::new((k / n) as f64, (k % n) as f64) + 0.5) / n as f64 * (hi - lo);
    // Cells at the border are where the transition will be.
    let step = cells.border.len() / SCALE_CELLS + 1;
    let mut at: Vec<Uv> = cells.border.iter().step_by(step).map(|c| c.center()).collect();
    if at.len() < FEW_CELLS {
        at.extend((0..n * n).map(grid));
    }
    // Below this curvature the whole face is one chord.
    let diagonal = surface.size.max(f64::MIN_POSITIVE);
    let floor = 8.0 * surface.field.loosest() / (diagonal * diagonal);
    let chords = |k: f64, speed: f64| k.abs().max(floor).sqrt() * speed;
    let mut sum = Uv::ZERO;
    let mut count = 0.0;
    for uv in at {
        let d = surface.second_derivatives(uv);
        let Some(forms) = FundamentalForms::new(&d) else { continue };
        sum.x += chords(forms.normal_curvature(Uv::X), d.du.length());
        sum.y += chords(forms.normal_curvature(Uv::Y), d.dv.length());
        count += 1.0;
    }
    let s = sum / count;
    // The larger one stays as it is: no parameter may overflow.
    let s = if s.is_finite() && s.min_element() > 0.0 { s / s.max_element() } else { Uv::ONE };
    if surface.affine { s * PLANE_SCALE } else { s }
}

//! Between the whole cells and the border: constrained Delaunay in parameters scaled by curvature, refined where a
//! triangle cannot be proved.

use super::delaunay::DelaunayMesh;
use super::sides::Sides;
use crate::math::{Enclosure, Uv};
use crate::model::EdgeId;
use crate::tessellate::crossing_chords::Followed;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::{Nodes, ProvedFacet, edge_key};
use crate::tessellate::proof::border_chord::BorderChords;
use crate::tessellate::proof::facet::prove_triangle;
use crate::tessellate::proof::prover::Prover;
use crate::tessellate::settings::Acceptance;
use crate::tessellate::taken_chords::TakenChords;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use spade::Triangulation;

/// Input of the triangulation.
pub(in crate::tessellate) struct Outline<'t> {
    pub(in crate::tessellate) nodes: Nodes,
    /// Constraint segments, each turning outside into inside.
    pub(in crate::tessellate) segments: Vec<[u32; 2]>,
    /// Lines inside that no triangle crosses; refinement may divide them.
    pub(in crate::tessellate) creases: Vec<[u32; 2]>,
    /// Lines inside that no triangle crosses and nothing divides.
    pub(in crate::tessellate) imprinted: Vec<[u32; 2]>,
    /// How far edges stray from the segments of the border.
    pub(in crate::tessellate) chords: &'t BorderChords,
    /// Multiplies parameters before triangulating.
    pub(in crate::tessellate) scale: Uv,
    /// Chords that no side of a triangle may be, but for those of the border.
    pub(in crate::tessellate) taken: &'t TakenChords,
}

/// Triangles on the outline's nodes; refinement appends some.
pub(in crate::tessellate) struct Transition {
    pub(in crate::tessellate) nodes: Nodes,
    pub(in crate::tessellate) triangles: Vec<ProvedFacet<3>>,
    /// Segments that could not be kept because they cross others, or an end of which was not inserted.
    pub(in crate::tessellate) conflicts: Vec<[u32; 2]>,
    /// Those that are kept, and crossed by them or led over other nodes.
    pub(in crate::tessellate) crossed: Vec<[u32; 2]>,
    /// Whether all imprinted lines are edges of the triangulation.
    pub(in crate::tessellate) holds_imprint: bool,
    /// Whether refinement ended for lack of corners or of work, and some triangles do not hold.
    pub(in crate::tessellate) exhausted: bool,
}

impl Transition {
    /// Returns the chords of the border beside triangles that are not proved, where shorter ones may help: not on edges whose gap in the
    /// file, anywhere along them, takes [`WIDEST_GAP`] of the tolerance. Some come twice. `followed` are the edges by chord.
    pub(in crate::tessellate) fn unproved_chords(
        &self,
        chords: &BorderChords,
        followed: &FxHashMap<[u32; 2], Followed>,
    ) -> Vec<[u32; 2]> {
        let sides = |f: &ProvedFacet<3>| {
            let (t, xi) = (f.nodes, f.tolerance);
            [0, 1, 2].map(|k| (edge_key(t[k], t[(k + 1) % 3]), xi))
        };
        let unproved = self.triangles.iter().filter(|f| f.bound > f.tolerance).flat_map(sides);
        let at_border: Vec<([u32; 2], f64)> = unproved.filter(|(s, _)| chords.contains_key(s)).collect();
        if at_border.is_empty() {
            return Vec::new();
        }
        // By edge of the file, whose gap is the same whichever of its chords fails.
        let mut gaps: FxHashMap<EdgeId, f64> = FxHashMap::default();
        for (side, piece) in followed {
            if let Some(chord) = chords.get(side) {
                let gap = gaps.entry(piece.edge).or_insert(0.0);
                *gap = gap.max(chord.gap);
            }
        }
        let gap =
            |side: &[u32; 2]| followed.get(side).and_then(|f| gaps.get(&f.edge)).copied().unwrap_or(f64::INFINITY);
        // A gap near the tolerance cannot be mended by shorter chords, which follow the edge and not the surface.
        at_border.into_iter().filter(|(side, xi)| gap(side) < WIDEST_GAP * xi).map(|(side, _)| side).collect()
    }
}

/// Share of a tolerance that the file's own gap may take for shorter chords to help.
const WIDEST_GAP: f64 = 0.97;
/// Share of the largest excess from which triangles are refined once the budget has ended.
const WORST: f64 = 0.25;
/// Triangles that all rounds together go through: each looks at all, which on a transition of 500,000 takes most of a second. Rounds are
/// not counted: in a helical groove each divided triangle makes one beside it fail, and 40 rounds left the last few.
const MAX_WORK: usize = 8_000_000;
/// How many corners refinement may make.
struct Limits {
    /// Up to here all that do not hold are refined.
    usual: usize,
    /// Up to here as long as those that do not hold become fewer.
    budget: usize,
}

impl Limits {
    /// `corners` are those at the start; the budget is never below them.
    fn new(corners: usize, budget: usize) -> Self {
        let budget = budget.max(corners);
        // Six times the corners and some for small faces: that is what transitions which end well take.
        Self { usual: (corners * 6 + 4000).min(budget), budget }
    }

    /// Returns how many corners there may be; more if those facets that do not hold become fewer (`falls`).
    fn most_corners(&self, falls: bool) -> usize {
        if falls { self.budget } else { self.usual + self.usual / 4 }
    }
}

/// Triangulates what the outline bounds and refines until all triangles hold, or work or the `budget` of corners is used up; those that do
/// not hold then are in the result. Segments that cross others are left out and named. `None` when nodes have no usable parameters.
pub(in crate::tessellate) fn triangulate(
    surface: &FaceSurface<'_>,
    acceptance: Acceptance,
    outline: Outline<'_>,
    budget: usize,
) -> Option<Transition> {
    let Outline { nodes, segments, creases, imprinted, chords, scale, taken } = outline;
    let mut mesh = DelaunayMesh::new(surface, nodes, scale, taken);
    // All points first: constraints between points that come later would have to be split.
    mesh.insert_nodes(&segments, &imprinted)?;
    let [conflicts, crossed] = mesh.constrain_border(&segments);
    // Twice: for the flood fill a line that is crossed twice bounds nothing.
    let holds_imprint = imprinted.iter().all(|&[a, b]| mesh.constrain(a, b) > 0 && mesh.constrain(a, b) > 0);
    for &[a, b] in &creases {
        mesh.keep_crease(a, b);
    }
    // Where constraints are missing, the flood fill would leak through the gap.
    let uv = |s: &[u32; 2]| s.map(|n| mesh.nodes[n].uv);
    let by_centre = (!conflicts.is_empty()).then(|| Enclosure::new(segments.iter().map(uv).collect()));
    let mut sides = Sides::new(&mesh, by_centre);
    // By corners in order, however a triangle is turned.
    let mut known: FxHashMap<[u32; 3], ProvedFacet<3>> = FxHashMap::default();
    let limits = Limits::new(mesh.cdt.num_vertices(), budget);
    let mut unproved_before = 0;
    let mut round = 0;
    loop {
        // Prove what is new; what was there before stands as it did.
        let triangles = sides.inner_triangles(&mesh);
        let new: Vec<[u32; 3]> =
            triangles.iter().copied().filter(|&t| !known.contains_key(&sorted_nodes(t))).collect();
        let prove =
            |prover: &mut Prover<'_, '_>, &t: &[u32; 3]| prove_triangle(prover, &mesh.nodes, t, chords, 1.0);
        let proved: Vec<ProvedFacet<3>> =
            new.par_iter().with_min_len(16).map_init(|| Prover::new(surface, acceptance), prove).collect();
        known.extend(new.iter().map(|&t| sorted_nodes(t)).zip(proved));
        let triangles: Vec<ProvedFacet<3>> =
            triangles.iter().map(|&nodes| ProvedFacet { nodes, ..known[&sorted_nodes(nodes)] }).collect();
        // For an angle alone a transition does not grow beyond the usual: where a border lies beside its surface, or at a fold, no facet
        // reaches it however small.
        let for_angle = mesh.cdt.num_vertices() < limits.usual;
        let fails = |f: &&ProvedFacet<3>| {
            f.bound > f.tolerance
                || mesh.taken_side(f.nodes).is_some()
                || for_angle && mesh.steep_side(f.nodes).is_some()
        };
        let mut failing: Vec<ProvedFacet<3>> = triangles.iter().filter(fails).copied().collect();
        // Beyond the usual measure only what is about to hold goes on: the flank of a thread of 20 m has no whole cells, and is done after
        // 12 times the corners of its border.
        let corners = mesh.cdt.num_vertices();
        let falls = 5 * failing.len() < 4 * unproved_before;
        unproved_before = failing.len();
        if corners >= limits.usual && !falls {
            // Where all cannot hold, the worst come first.
            let excess = |f: &ProvedFacet<3>| f.bound / f.tolerance;
            let worst = failing.iter().map(excess).fold(0.0, f64::max);
            failing.retain(|f| excess(f) >= WORST * worst);
        }
        // Also when the work of all rounds is used up: what then does not hold is counted as not proved.
        let works_too_long = (round + 1) * triangles.len() > MAX_WORK;
        let ended = failing.is_empty()
            || surface.steps.are_too_many()
            || works_too_long
            || corners >= limits.most_corners(falls);
        let exhausted = !failing.is_empty() && (works_too_long || corners >= limits.budget);
        if ended || !mesh.refine(&failing, chords) {
            return Some(Transition { nodes: mesh.nodes, triangles, conflicts, crossed, holds_imprint, exhausted });
        }
        sides.update(&mesh);
        round += 1;
    }
}

/// Returns the segments of an outline that cannot be kept and those in their way, as [`Transition::conflicts`] and
/// [`Transition::crossed`], without triangles; `None` when nodes have no usable parameters.
pub(in crate::tessellate) fn crossings(
    surface: &FaceSurface<'_>,
    outline: &Outline<'_>,
) -> Option<[Vec<[u32; 2]>; 2]> {
    let Outline { nodes, segments, imprinted, scale, taken, .. } = outline;
    let mut mesh = DelaunayMesh::new(surface, nodes.clone(), *scale, taken);
    mesh.insert_nodes(segments, imprinted)?;
    Some(mesh.constrain_border(segments))
}

/// Returns the three nodes in ascending order.
fn sorted_nodes(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Homogeneous;
    use crate::nurbs::Surface;
    use crate::tessellate::settings::ToleranceField;
    use crate::tessellate::taken_chords::NO_CHORDS;

    /// The saddle z = 10 (2 u − 1)(2 v − 1) mm between the corners of its domain, which two triangles leave by 10 mm along z.
    #[test]
    fn what_ends_for_lack_of_corners_says_so() {
        let points = [-10.0, 10.0].map(|x| [-10.0, 10.0].map(|y| Homogeneous::new(x, y, 0.1 * x * y, 1.0)));
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        let spline =
            Surface { degree: [1, 1], knots: [knots.clone(), knots], points: points.as_flattened().to_vec() };
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(&spline, false, field);
        let chords = BorderChords::default();
        let refined = |budget: usize| {
            let mut nodes = Nodes::default();
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| Uv::new(u, v));
            let corners = corners.map(|uv| nodes.push_own(uv, surface.point(uv)));
            let segments = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect();
            let (creases, imprinted) = (vec![], vec![]);
            let scale = Uv::ONE;
            let outline =
                Outline { nodes, segments, creases, imprinted, chords: &chords, scale, taken: &NO_CHORDS };
            let made = triangulate(&surface, Acceptance::default(), outline, budget).unwrap();
            (made.exhausted, made.triangles.iter().all(|t| t.bound <= t.tolerance))
        };
        assert_eq!((refined(10), refined(100_000)), ((true, false), (false, true)));
    }
}

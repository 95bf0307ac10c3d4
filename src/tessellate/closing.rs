//! Facets that close a face where its others leave its border: between chords that lie on one line in the parameter plane, or cross
//! there for what they stray, no triangle has an area, and yet the neighbours on both sides have different corners.

use super::face_surface::FaceSurface;
use super::nodes::{Nodes, Position, ProvedFacet, edge_key};
use super::proof::border_chord::BorderChords;
use super::proof::flat_triangle::distance_to_chord;
use super::taken_chords::TakenChords;
use super::transition::pairing::TransitionFacet;
use rustc_hash::{FxHashMap, FxHashSet};

/// Open sides of one face, and of one gap, with which a search for triangles begins: more are no gap, but a border in pieces.
const MOST_SIDES: usize = 512;
const MOST_CORNERS: usize = 48;
/// How many tolerances a triangle may be high: two chords that cross are apart by what both stray.
pub(super) const HIGHEST: f64 = 2.0;

/// The border of a face.
pub(super) struct Closing<'c, 'a> {
    pub(super) surface: &'c FaceSurface<'a>,
    pub(super) nodes: &'c Nodes,
    /// Pairs of nodes in the direction of the loops.
    pub(super) segments: &'c [[u32; 2]],
    pub(super) chords: &'c BorderChords,
    pub(super) taken: &'c TakenChords,
}

/// The two positions of a side, in ascending order.
type Side = [Position; 2];

impl Closing<'_, '_> {
    /// Returns triangles that fill the gaps between the border and `facets`, each at most [`HIGHEST`] tolerances high. Wider gaps stay
    /// open.
    pub(super) fn facets(&self, facets: &[TransitionFacet]) -> Vec<ProvedFacet<4>> {
        let all = self.border_sides(facets);
        // How often facets or the border run along each: an even number of times where both agree.
        let mut uses: FxHashMap<Side, u32> = FxHashMap::default();
        all.iter().for_each(|&[a, b]| *uses.entry(self.side(a, b)).or_insert(0) += 1);
        let open = self.open_sides(&all, &uses);
        if open.is_empty() || open.len() > MOST_SIDES {
            return Vec::new();
        }
        let filled = |gap: Vec<u32>| self.filled(&gap, &uses).unwrap_or_default();
        self.gaps(open).into_iter().flat_map(filled).collect()
    }

    /// Returns the sides between positions of the border, those of its segments first, in the direction in which a further facet should run
    /// along them: as the border, and against the facets. All but these are sides of two facets.
    fn border_sides(&self, facets: &[TransitionFacet]) -> Vec<[u32; 2]> {
        let position = |n: u32| self.nodes[n].position;
        let border: FxHashSet<Position> = self.segments.iter().flatten().map(|n| position(*n)).collect();
        let on_border: Vec<bool> = self.nodes.iter().map(|n| border.contains(&n.position)).collect();
        let against = facets.iter().flat_map(TransitionFacet::sides).map(|[a, b]| [b, a]);
        let against = against.filter(|side| side.iter().all(|n| on_border[*n as usize]));
        self.segments.iter().copied().chain(against).collect()
    }

    /// Returns those of `all` sides on which border and facets do not agree, each once.
    fn open_sides(&self, all: &[[u32; 2]], uses: &FxHashMap<Side, u32>) -> Vec<[u32; 2]> {
        let mut open = Vec::new();
        let mut seen = FxHashSet::default();
        for &[a, b] in all {
            let side = self.side(a, b);
            if side[0] != side[1] && uses[&side] % 2 == 1 && seen.insert(side) {
                open.push([a, b]);
            }
        }
        open
    }

    /// Returns closed ways along open sides that come by no position twice, by the nodes at their corners.
    fn gaps(&self, mut open: Vec<[u32; 2]>) -> Vec<Vec<u32>> {
        let position = |n: u32| self.nodes[n].position;
        let mut gaps = Vec::new();
        let mut way: Vec<[u32; 2]> = Vec::new();
        while !open.is_empty() || !way.is_empty() {
            let Some(&[_, at]) = way.last() else {
                way.push(open.remove(0));
                continue;
            };
            if let Some(first) = way.iter().position(|&[a, _]| position(a) == position(at)) {
                gaps.push(way.split_off(first).into_iter().map(|[a, _]| a).collect());
                continue;
            }
            // As the sides run, or else against them.
            let next = open.iter().position(|&[a, _]| position(a) == position(at));
            match next.or_else(|| open.iter().position(|&[_, b]| position(b) == position(at))) {
                Some(k) => {
                    let [a, b] = open.remove(k);
                    way.push(if position(a) == position(at) { [a, b] } else { [b, a] });
                }
                // Odd counts leave no end.
                None => drop(way.pop()),
            }
        }
        gaps
    }

    /// Fills a gap with the triangles of least area in all that have no side in common with others; `None` where one of them would be
    /// higher than [`HIGHEST`] tolerances.
    fn filled(&self, gap: &[u32], uses: &FxHashMap<Side, u32>) -> Option<Vec<ProvedFacet<4>>> {
        let n = gap.len();
        if !(3..=MOST_CORNERS).contains(&n) {
            return None;
        }
        let place = |k: usize| self.nodes[gap[k]].place;
        // Cost of the best triangles between the corners from i to j, and the corner of the one along the chord from i to j.
        let mut best = vec![vec![((0u32, 0.0f64), 0usize); n]; n];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let doubled = u32::from(span + 1 < n && self.is_doubled([gap[i], gap[j]], uses));
                let cost = |k: usize| {
                    let area = (place(k) - place(i)).cross(place(j) - place(i)).length();
                    let (a, b) = (best[i][k].0, best[k][j].0);
                    (a.0 + b.0 + doubled, a.1 + b.1 + area)
                };
                let choices = (i + 1..j).map(|k| (cost(k), k));
                best[i][j] = choices.min_by(|a, b| a.0.0.cmp(&b.0.0).then(a.0.1.total_cmp(&b.0.1)))?;
            }
        }
        let mut triangles = Vec::new();
        let mut open = vec![(0, n - 1)];
        while let Some((i, j)) = open.pop() {
            if j < i + 2 {
                continue;
            }
            let k = best[i][j].1;
            triangles.push(self.low_triangle([gap[i], gap[k], gap[j]])?);
            open.extend([(i, k), (k, j)]);
        }
        Some(triangles)
    }

    /// Whether a diagonal is a side of the face or of another already.
    fn is_doubled(&self, [a, b]: [u32; 2], uses: &FxHashMap<Side, u32>) -> bool {
        let side = self.side(a, b);
        uses.contains_key(&side) || self.taken.contains(side)
    }

    /// Returns a triangle, bounded by what its chords of the border stray and its height; `None` if it is higher than [`HIGHEST`]
    /// tolerances.
    fn low_triangle(&self, t: [u32; 3]) -> Option<ProvedFacet<4>> {
        let place = |k: usize| self.nodes[t[k % 3]].place;
        let tolerance =
            t.map(|n| self.surface.tolerance(self.nodes[n].uv)).into_iter().fold(f64::INFINITY, f64::min);
        let length = |k: &usize| place(*k).distance(place(k + 1));
        let longest = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
        let height = distance_to_chord(place(longest + 2), &[place(longest), place(longest + 1)]);
        if height.is_nan() || height > HIGHEST * tolerance {
            return None;
        }
        // All of it is within its height of its longest side, and of both others together.
        let strays = |k: usize| {
            let chord = self.chords.get(&edge_key(t[k % 3], t[(k + 1) % 3]));
            chord.map_or(f64::INFINITY, |chord| chord.deviation)
        };
        let bound = height + strays(longest).min(strays(longest + 1).max(strays(longest + 2)));
        Some(ProvedFacet { nodes: [t[0], t[1], t[2], t[2]], bound, tolerance })
    }

    fn side(&self, a: u32, b: u32) -> Side {
        let (a, b) = (self.nodes[a].position, self.nodes[b].position);
        [a.min(b), a.max(b)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Uv};
    use crate::nurbs::sweep;
    use crate::tessellate::proof::border_chord::BorderChord;
    use crate::tessellate::settings::ToleranceField;
    use crate::tessellate::taken_chords::NO_CHORDS;

    /// What closes a square of 10 mm, met by one facet, whose first side has further corners of the border at `off` mm from it.
    fn closed(off: &[f64]) -> Vec<ProvedFacet<4>> {
        let plane = sweep::plane(&Frame::IDENTITY, [[-20.0, 20.0]; 2]);
        let surface =
            FaceSurface::new(&plane, false, ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0));
        let between = off.iter().enumerate().map(|(k, y)| [10.0 * (k + 1) as f64 / (off.len() + 1) as f64, *y]);
        let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].into_iter().chain(between);
        let mut nodes = Nodes::default();
        for corner in corners.map(Uv::from_array) {
            nodes.push_own(corner, corner.extend(0.0));
        }
        let last = off.len() as u32;
        let way: Vec<u32> = [0].into_iter().chain(4..4 + last).chain([1, 2, 3]).collect();
        let segments: Vec<[u32; 2]> = (0..way.len()).map(|k| [way[k], way[(k + 1) % way.len()]]).collect();
        let whole = ProvedFacet { nodes: [0, 1, 2, 3], bound: 0.0, tolerance: 0.1 };
        let chord = |s: &[u32; 2]| (edge_key(s[0], s[1]), BorderChord::default());
        let chords: BorderChords = segments.iter().map(chord).collect();
        let (nodes, taken) = (&nodes, &NO_CHORDS);
        Closing { surface: &surface, nodes, segments: &segments, chords: &chords, taken }.facets(&[whole.into()])
    }

    #[test]
    fn a_gap_as_wide_as_two_chords_stray_is_filled() {
        assert!(closed(&[]).is_empty());
        // Along the border, and against the facet; as far off as the corner lies from a chord that strays nowhere.
        let [facet] = closed(&[-0.15])[..] else { panic!("one triangle") };
        let first = facet.nodes.iter().position(|n| *n == 0).expect("the corner at the origin");
        assert_eq!([0, 1, 2].map(|k| facet.nodes[..3][(first + k) % 3]), [0, 4, 1]);
        assert!((facet.bound - 0.15).abs() < 1e-3, "{}", facet.bound);
        assert!(closed(&[-0.25]).is_empty(), "a gap of two and a half tolerances");
        assert_eq!(closed(&[-0.1, 0.1, 0.0, -0.05]).len(), 4);
    }
}

//! Which side of a border places lie on, asked many times.

use super::Uv;
use super::polygon::crosses_ray_from;

/// Sides of one node that are compared one by one: about what a binary search takes twice.
const SIDES_OF_LEAF: usize = 16;

/// The sides of a border in a tree of boxes. A box right of a place counts the sides that cross its height by a binary search, so that few
/// sides are compared: a damaged face with a winding border of thousands of sides spent two thirds of its time comparing.
pub(crate) struct Enclosure {
    /// Each half of a node's sides is a run.
    sides: Vec<[Uv; 2]>,
    /// The root comes first; empty where there are no sides.
    nodes: Vec<Node>,
}

/// Some sides of a border, in a row.
struct Node {
    first: usize,
    count: usize,
    /// Bounds of the sides in parameters.
    low: Uv,
    high: Uv,
    /// `None` on a leaf.
    halves: Option<Halves>,
}

/// What a node has that is no leaf.
struct Halves {
    nodes: [usize; 2],
    /// The v of the ends of all sides, ascending, each with how many more sides rise than fall from there up to the next end.
    ends: Vec<(f64, i32)>,
}

impl Enclosure {
    /// Sorts the sides of a border, in parameters; without sides nothing is enclosed.
    pub(crate) fn new(sides: Vec<[Uv; 2]>) -> Self {
        let mut out = Self { nodes: Vec::with_capacity(4 * sides.len() / SIDES_OF_LEAF + 1), sides };
        if !out.sides.is_empty() {
            let (low, high) = bounds(&out.sides);
            out.add_node(0, out.sides.len(), high - low);
        }
        out
    }

    /// Adds the node of so many sides, and those below it, and returns its index; `extent` is that of all sides.
    fn add_node(&mut self, first: usize, count: usize, extent: Uv) -> usize {
        let sides = &mut self.sides[first..first + count];
        let (low, high) = bounds(sides);
        let index = self.nodes.len();
        self.nodes.push(Node { first, count, low, high, halves: None });
        if count > SIDES_OF_LEAF {
            // Across the direction in which the middles lie farthest apart, as a share of the whole border.
            let middles: Vec<[Uv; 2]> = sides.iter().map(|[a, b]| [*a + *b; 2]).collect();
            let (from, to) = bounds(&middles);
            let spread = to - from;
            let half = count / 2;
            if spread.x * extent.y > spread.y * extent.x {
                sides.select_nth_unstable_by(half, |s, t| (s[0].x + s[1].x).total_cmp(&(t[0].x + t[1].x)));
            } else {
                sides.select_nth_unstable_by(half, |s, t| (s[0].y + s[1].y).total_cmp(&(t[0].y + t[1].y)));
            }
            // What a rising side adds at its lower end it takes away at its upper end; a falling one the other way round.
            let mut ends: Vec<(f64, i32)> = sides.iter().flat_map(|[a, b]| [(a.y, 1), (b.y, -1)]).collect();
            ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut rising = 0;
            for (_, rises) in &mut ends {
                rising += *rises;
                *rises = rising;
            }
            let nodes = [self.add_node(first, half, extent), self.add_node(first + half, count - half, extent)];
            self.nodes[index].halves = Some(Halves { nodes, ends });
        }
        index
    }

    /// Whether `p` lies inside the closed loops of the border, by the parity of their crossings with the ray along +u. On the border either
    /// answer may come.
    pub(crate) fn encloses(&self, p: Uv) -> bool {
        self.winding_number(p) % 2 != 0
    }

    /// Returns how often the border runs around `p`, counter-clockwise less clockwise. On the border any neighbour's answer may come.
    pub(crate) fn winding_number(&self, p: Uv) -> i32 {
        if self.nodes.is_empty() { 0 } else { self.rising_right_of(0, p) }
    }

    /// Returns how many more of a node's sides rise than fall across the ray from `p` along +u.
    fn rising_right_of(&self, node: usize, p: Uv) -> i32 {
        let Node { first, count, low, high, halves } = &self.nodes[node];
        // Half open as the test of a single side.
        if p.y < low.y || p.y >= high.y || p.x > high.x {
            return 0;
        }
        match halves {
            Some(Halves { ends, .. }) if p.x < low.x => {
                let begun = ends.partition_point(|(v, _)| *v <= p.y);
                begun.checked_sub(1).map_or(0, |last| ends[last].1)
            }
            Some(Halves { nodes: [a, b], .. }) => self.rising_right_of(*a, p) + self.rising_right_of(*b, p),
            None => {
                let crossing = self.sides[*first..first + count].iter().filter(|side| crosses_ray_from(p, **side));
                crossing.map(|[a, b]| if a.y < b.y { 1 } else { -1 }).sum()
            }
        }
    }
}

/// Returns the bounds of sides.
fn bounds(sides: &[[Uv; 2]]) -> (Uv, Uv) {
    let ends = || sides.iter().flatten();
    (ends().fold(Uv::INFINITY, |low, p| low.min(*p)), ends().fold(Uv::NEG_INFINITY, |high, p| high.max(*p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::polygon::{is_inside_sides, polygon_sides};
    use std::f64::consts::TAU;

    #[test]
    fn trees_cross_what_all_sides_cross() {
        // A star of 999 corners, and a line along v over all its height.
        let corner =
            |k: usize| Uv::from_angle(k as f64 * 2.4) * (1.0 + 0.5 * (k as f64).sin()) + Uv::new(3.0, -7.0);
        let star: Vec<Uv> = (0..999).map(corner).collect();
        let mut sides: Vec<[Uv; 2]> = polygon_sides(&star).collect();
        sides.push([Uv::new(3.1, -9.0), Uv::new(3.1, -5.0)]);
        let enclosure = Enclosure::new(sides.clone());
        for k in 0..4000 {
            let p = Uv::new(1.0 + 4.0 * ((k * 37) % 101) as f64 / 101.0, -9.5 + 5.0 * (k % 97) as f64 / 97.0);
            assert_eq!(enclosure.encloses(p), is_inside_sides(sides.iter().copied(), p), "{p}");
            // On the height of a corner a side counts once.
            let p = Uv::new(p.x, corner(k % 999).y);
            assert_eq!(enclosure.encloses(p), is_inside_sides(sides.iter().copied(), p), "{p}");
        }
        // All on one height, and none at all.
        assert!(!Enclosure::new(vec![[Uv::ZERO, Uv::X]]).encloses(Uv::new(-1.0, 0.0)));
        assert!(!Enclosure::new(vec![[Uv::ZERO, Uv::X]; 99]).encloses(Uv::new(-1.0, 0.0)));
        assert!(!Enclosure::new(Vec::new()).encloses(Uv::ZERO));
    }

    /// A spiral of three turns, closed along +u, and one of a triangle's size of 40 sides a turn.
    #[test]
    fn winding_numbers_count_turns() {
        for sides in [3, 40] {
            let corner = |k: usize| Uv::from_angle((k as f64 + 0.5) / sides as f64 * TAU) * (3.0 + k as f64);
            let spiral: Vec<Uv> = (0..3 * sides).map(corner).collect();
            let backwards: Vec<Uv> = spiral.iter().rev().copied().collect();
            let [left, right] = [spiral, backwards].map(|p| Enclosure::new(polygon_sides(&p).collect()));
            // Left of all the closing side lies behind: three turns, two, one and none.
            for (radius, turns) in [(0.0, 3), (3.2 + sides as f64, 2), (3.2 + 2.0 * sides as f64, 1), (1e3, 0)] {
                let p = Uv::new(-radius, 0.1);
                assert_eq!((left.winding_number(p), right.winding_number(p)), (turns, -turns), "{sides}: {p}");
            }
        }
    }

    /// A comb whose teeth all cross one height, and one whose teeth lie one above the other.
    #[test]
    fn few_sides_of_a_comb_are_compared() {
        let teeth = 2000;
        let standing: Vec<Uv> = (0..=2 * teeth)
            .map(|k| Uv::new(k as f64, [0.0, 5.0 + (k as f64).sin()][k % 2]))
            .chain([Uv::new(2.0 * teeth as f64, -1.0), Uv::new(0.0, -1.0)])
            .collect();
        let lying: Vec<Uv> = standing.iter().map(|p| Uv::new(p.y, p.x)).collect();
        for comb in [standing, lying] {
            let enclosure = Enclosure::new(polygon_sides(&comb).collect());
            let compared = |p: Uv| {
                let apart = |n: &Node| p.y < n.low.y || p.y >= n.high.y || p.x > n.high.x || p.x < n.low.x;
                enclosure.nodes.iter().filter(|n| n.halves.is_none() && !apart(n)).map(|n| n.count).sum::<usize>()
            };
            for k in 0..1000 {
                let p = (comb[2 * k] + comb[2 * k + 1] + comb[2 * k + 2]) / 3.0;
                assert_eq!(enclosure.encloses(p), is_inside_sides(polygon_sides(&comb), p), "{p}");
                assert!(compared(p) <= comb.len() / 16, "{p}: {}", compared(p));
            }
        }
    }
}

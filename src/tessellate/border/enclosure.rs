//! Which side of a border places lie on, asked many times.

use crate::math::Uv;
use crate::math::polygon::is_inside_sides;

/// Sides of one node that are compared one by one: about what two binary searches take.
const SIDES_OF_LEAF: usize = 16;

/// The sides of a border in a tree of boxes. A box right of a place counts the sides that cross its height by two binary searches, so that
/// few sides are compared: a damaged face with a winding border of thousands of sides spent two thirds of its time comparing.
pub(in crate::tessellate) struct Enclosure {
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
    /// The v of the lower and of the upper ends of all sides, ascending.
    ends: [Vec<f64>; 2],
}

impl Enclosure {
    /// Sorts the sides of a border, in parameters; without sides nothing is enclosed.
    pub(in crate::tessellate) fn new(sides: Vec<[Uv; 2]>) -> Self {
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
            let mut ends =
                [f64::min, f64::max].map(|end| sides.iter().map(|[a, b]| end(a.y, b.y)).collect::<Vec<_>>());
            ends.iter_mut().for_each(|ends| ends.sort_unstable_by(f64::total_cmp));
            let nodes = [self.add_node(first, half, extent), self.add_node(first + half, count - half, extent)];
            self.nodes[index].halves = Some(Halves { nodes, ends });
        }
        index
    }

    /// Whether `p` lies inside the closed loops of the border, by the parity of their crossings with the ray along +u. On the border either
    /// answer may come.
    pub(in crate::tessellate) fn encloses(&self, p: Uv) -> bool {
        !self.nodes.is_empty() && self.crosses_odd_times(0, p)
    }

    /// Whether the ray from `p` along +u crosses an odd number of the sides of a node.
    fn crosses_odd_times(&self, node: usize, p: Uv) -> bool {
        let Node { first, count, low, high, halves } = &self.nodes[node];
        // Half open as the test of a single side.
        if p.y < low.y || p.y >= high.y || p.x > high.x {
            return false;
        }
        match halves {
            Some(Halves { ends, .. }) if p.x < low.x => {
                let [begun, ended] = [0, 1].map(|k| ends[k].partition_point(|v| *v <= p.y));
                begun % 2 != ended % 2
            }
            Some(Halves { nodes: [a, b], .. }) => self.crosses_odd_times(*a, p) != self.crosses_odd_times(*b, p),
            None => is_inside_sides(self.sides[*first..first + count].iter().copied(), p),
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
    use crate::math::polygon::polygon_sides;

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

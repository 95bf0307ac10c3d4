//! Boxes of parameters with the net over them, as clipping cuts and halves them.

use super::clip_hull::range_along;
use super::net::{self, Net, Slopes, V4};

/// Smallest box of parameters: below some hundred ulps halving says nothing.
pub(super) const FINEST: f64 = 1e-13;
/// The least part of a box that a cut leaves, so that it keeps an inside.
const LEAST_CUT: f64 = 1e-15;
/// A side along which the ray's distance changes by a smaller share of what it does along the other is not halved.
const ALIKE: f64 = 1e-6;

/// A box of parameters with the net over it.
pub(super) struct Node {
    pub(super) net: Net,
    /// In the leaf's parameters.
    pub(super) rect: [[f64; 2]; 2],
    /// The least t that its hull leaves.
    pub(super) near: f64,
}

/// Lengths of a box's sides.
#[inline(always)]
pub(super) fn size(rect: &[[f64; 2]; 2]) -> [f64; 2] {
    rect.map(|[lo, hi]| hi - lo)
}

/// The part of a node over `keep`, a rectangle in shares of its sides; `near` is its least t.
#[inline(always)]
pub(super) fn cut(node: &Node, degree: [u8; 2], keep: [[f64; 2]; 2], near: f64) -> Node {
    let mut net = Net::from_slice(&node.net);
    let mut rect = node.rect;
    for d in 0..2 {
        let [low, high] = keep[d];
        // A side that keeps its length is left alone: de Casteljau would only round it.
        if high - low < 1.0 {
            let range = [low, high.max(low + LEAST_CUT)];
            net::restrict(&mut net, degree, d, range);
            let [a, b] = rect[d];
            rect[d] = [a + (b - a) * range[0], a + (b - a) * range[1]];
        }
    }
    Node { net, rect, near }
}

/// Halves a node across its longer side, but across neither one along which next to nothing moves across the ray nor one of [`FINEST`], and
/// puts the nearer half on top of the stack.
#[inline(always)]
pub(super) fn halve(node: &Node, degree: [u8; 2], slopes: &Slopes, stack: &mut Vec<Node>) {
    // The first derivative is as long as its middle and its radius allow: a side is at most that.
    let longest = |m: &V4, r: &V4, count: usize| (0..count).map(|c| m[c].abs() + r[c]).fold(0.0, f64::max);
    let lengths = [longest(&slopes.u, &slopes.ru, 3), longest(&slopes.v, &slopes.rv, 3)];
    let across = [longest(&slopes.u, &slopes.ru, 2), longest(&slopes.v, &slopes.rv, 2)];
    // Where the ray runs along a straight line of the surface, halves of that line are alike.
    let v_alike = across[1] < ALIKE * across[0];
    let u_first = v_alike || (across[0] >= ALIKE * across[1] && lengths[0] >= lengths[1]);
    let [size_u, size_v] = size(&node.rect);
    // A side of the finest size stays: its two halves would no longer differ.
    let direction = if (u_first && size_u > FINEST) || size_v <= FINEST { 0 } else { 1 };
    let [low, high] = net::halves(&node.net, degree, direction);
    let nearest = [range_along(&low).0, range_along(&high).0];
    let middle = 0.5 * (node.rect[direction][0] + node.rect[direction][1]);
    let (mut low_rect, mut high_rect) = (node.rect, node.rect);
    low_rect[direction][1] = middle;
    high_rect[direction][0] = middle;
    let low = Node { net: low, rect: low_rect, near: nearest[0] };
    let high = Node { net: high, rect: high_rect, near: nearest[1] };
    // Taken first, the nearer half may find a root that ends the search of the other.
    if nearest[0] <= nearest[1] {
        stack.push(high);
        stack.push(low);
    } else {
        stack.push(low);
        stack.push(high);
    }
}

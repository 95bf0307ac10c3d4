//! What the one-step test leaves open: Bernstein-hull clipping with bisection, in order of t, under a budget.
//!
//! The leaf's net is seen along the ray: two coordinates across, one along, and the weight. A box of parameters is dropped
//! when the hull misses the ray or when the preconditioned hull shows that no root can lie in it, shrunk when the hull
//! says so, solved by Newton when at most one root is left, and halved otherwise. What comes down to rounding is looked at once more
//! in 32 digits, and what these leave is reported as tangent or uncertified, never dropped.

use super::acceptance::Candidate;
use super::clip_box::{FINEST, Node, cut, halve, size};
use super::clip_hull::{
    Preconditioner, SeenLeaf, determinant, homogeneous_margin, hull, linear_hull, newton, precondition,
    range_along, seen_along, tangent_frame,
};
use super::leaf::Leaf;
use super::net::{self, Net, V4};
use super::patch::project;
use super::query::Query;
use super::settlement;
use super::structure::Exact;
use super::tangency::{self, TANGENCY_WORK};
use super::tolerances::{CONTACT_LENGTH, SAME_PARAMETER, TANGENT};
use crate::intersect::Certainty;
use crate::math::Vector;
use crate::math::simd::{self, Instructions, Kernel};

/// A leaf whose roots count no farther beyond its unit square than this is clipped over that alone: what lies beyond is within
/// the margin of a root.
const BEYOND_UNIT: f64 = 1e-9;
/// Row sums below this leave at most one root, and Newton's method a tenth of each error at worst; what lies above is halved.
const LARGEST_ROW_SUM_OF_BOX: f64 = 0.9;
/// How far beyond its box a root counts beside twice the slack: Newton's method ends within 1e-14.
const ROOT_ROUNDING: f64 = 1e-12;
/// Boxes of this size are a point to Newton's method.
const POINT_BOX: f64 = 1e-7;
/// A box of which the hull leaves less than this share is cut down, others are halved: Nishita, Sederberg and Kakimoto halve above
/// 0.8, but a halving costs half of a cut.
const WORTH_CUTTING: f64 = 0.6;
/// A box of this size that still holds more than one root is tested for tangency: most rays that graze a surface have found theirs.
const TANGENCY_BOX: f64 = 1.0 / 64.0;
/// How far beyond its leaf a net from 32 digits is looked at, as a share of the leaf.
const CRACK: f64 = 1e-8;
/// Clipping steps that a net from 32 digits counts as: fifty microseconds.
const PRECISE_WORK: u32 = 100;
/// Relative error of such a net's coordinates: that of a thousand roundings of 2⁻¹⁰⁴, twenty times over.
const PRECISE_ROUNDING: f64 = 1e-27;
/// Points times degrees of a bicubic net, on which a step takes half a microsecond.
const BICUBIC_WORK: usize = 96;

/// Outcome for a box, for one way to decide it, or for a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Nothing is left to do: it is dropped, its roots are offered, or what is left of it is on the stack.
    Done,
    /// This way does not decide it: the next one is tried.
    Open,
    /// `f64` cannot decide: the leaf must be examined in 32 digits, and the roots it has offered be found again.
    NeedsPrecise,
}

/// State of the clipping of a leaf.
struct Clipping<'a> {
    index: u32,
    leaf: &'a Leaf,
    seen: &'a SeenLeaf,
    /// The point that the ray leaves, in the leaf's parameters.
    departure: Option<[f64; 2]>,
    /// Bound of what a coordinate across the ray is off by rounding, mm.
    noise: f64,
    /// Whether the ray passes a pole: its control points differ by their own rounding, and what 32 digits say of the cracks between them
    /// is not meant.
    at_pole: bool,
}

/// A leaf to be clipped, for [`simd::dispatch`].
struct LeafClipping<'a> {
    exact: &'a Exact,
    query: &'a mut Query,
    leaf: u32,
}

impl Kernel for LeafClipping<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        self.exact.clip_leaf(self.query, self.leaf);
    }
}

/// Looks for every root of the query on a leaf by clipping, and offers them; what its budget leaves undecided is noted in `query`.
#[cold]
pub(super) fn clip(exact: &Exact, query: &mut Query, leaf: u32) {
    simd::dispatch(LeafClipping { exact, query, leaf });
}

/// Directions across a query's ray, and a leaf's net as they and the ray see it: those of the query, but for a leaf that the ray runs
/// along, in whose middle their Jacobian is singular. There they are [`tangent_frame`], by which a hull that lies beside the ray misses
/// it however little: in any other frame only boxes as small as that distance do, and a budget ended on them.
#[inline(always)]
fn seen_leaf(query: &Query, control: &[V4], degree: [u8; 2], oc: Vector) -> ([Vector; 2], Net) {
    let frame = [query.n1, query.n2];
    let net = seen_along(frame, query.d, control, oc);
    let slopes = net::slopes(&net, degree);
    if determinant(&slopes).1 {
        return (frame, net);
    }
    let frame = tangent_frame(&slopes, frame, query.d);
    (frame, seen_along(frame, query.d, control, oc))
}

impl Exact {
    /// Looks for every root of the query on a leaf: in `f64`, and where that cannot decide, again in 32 digits.
    #[inline(always)]
    fn clip_leaf(&self, query: &mut Query, index: u32) {
        query.clips += 1;
        let leaf = &self.leaves[index as usize];
        let oc = query.o - leaf.center;
        let (frame, net) = seen_leaf(query, leaf.net(&self.geometry.nets), leaf.degree, oc);
        let noise = self.noise(leaf, oc);
        let homogeneous_margin = homogeneous_margin(leaf, &net, noise);
        let departure = query.departure.and_then(|own| own.local_to(leaf, query.o, &self.geometry));
        let seen = &SeenLeaf { net, frame, homogeneous_margin, precise: false };
        let patch = || &self.geometry.patches[leaf.patch as usize];
        let at_pole =
            leaf.has_pole && self.geometry.passes_pole(patch(), [query.o, query.d], CONTACT_LENGTH * leaf.contact);
        let clipping = Clipping { index, leaf, seen, departure, noise, at_pole };
        let before = [query.all.len(), query.all_rejected.len()];
        if self.clip_seen(query, &clipping) == Step::NeedsPrecise {
            // In a search for all, what it found is found again.
            query.all.truncate(before[0]);
            query.all_rejected.truncate(before[1]);
            self.clip_precisely(query, clipping);
        }
    }

    /// Looks for every root on a leaf in 32 digits, for rays that run along it or touch it within the rounding of `f64`; takes its work
    /// from the query's budget and leaves there what it finds.
    #[cold]
    fn clip_precisely(&self, query: &mut Query, clipping: Clipping<'_>) {
        query.budget = query.budget.saturating_sub(PRECISE_WORK);
        let Clipping { index, leaf, seen, .. } = clipping;
        let frame = tangent_frame(&net::slopes(&seen.net, leaf.degree), seen.frame, query.d);
        let reference = self.geometry.reference(&self.geometry.patches[leaf.patch as usize]);
        let net = reference.net_along([query.o, query.d], frame, leaf.rect);
        let reach = query.o.abs().max_element() + leaf.center.abs().max_element() + leaf.radius;
        let homogeneous_margin = homogeneous_margin(leaf, &net, PRECISE_ROUNDING * reach);
        let seen = &SeenLeaf { net, frame, homogeneous_margin, precise: true };
        self.clip_seen(query, &Clipping { index, seen, ..clipping });
    }

    /// Looks for every root in what is seen of a leaf: [`Step::Done`] or [`Step::NeedsPrecise`].
    #[inline(always)]
    fn clip_seen(&self, query: &mut Query, clipping: &Clipping<'_>) -> Step {
        let leaf = clipping.leaf;
        let degree = leaf.degree;
        let mut net = Net::from_slice(&clipping.seen.net);
        let mut rect = [[0.0, 1.0]; 2];
        // Only where a trim may run along the border of the surface do roots count beyond the unit square.
        for d in 0..2 {
            let [mut lo, mut hi] = leaf.reach[d];
            if clipping.seen.precise {
                // The two ends of a closed surface leave a crack of their rounding: roots in it are found, and placed later.
                (lo, hi) = (lo - CRACK, hi + CRACK);
            }
            let (below, above) = (lo < -BEYOND_UNIT, hi > 1.0 + BEYOND_UNIT);
            if below || above {
                rect[d] = [if below { lo } else { 0.0 }, if above { hi } else { 1.0 }];
                net::restrict(&mut net, degree, d, rect[d]);
            }
        }
        // A step on a net of many points costs as many of a bicubic one.
        let work = (net.len() * (usize::from(degree[0]) + usize::from(degree[1]))).div_ceil(BICUBIC_WORK) as u32;
        let near = range_along(&net).0;
        let mut node = Node { net, rect, near };
        // Most leaves are done with the first box, and allocate no memory.
        let mut stack = Vec::new();
        loop {
            // Strict, so that a box that starts where the best root lies is not searched again.
            let is_behind = node.near >= query.t_max && query.best.is_some();
            if !is_behind && query.budget == 0 {
                // What the budget cuts off is not dropped: from its nearest point on nothing is decided.
                query.undecided_from = query.undecided_from.min(node.near);
            } else if !is_behind {
                query.budget = query.budget.saturating_sub(work);
                if self.clip_node(query, clipping, &node, &mut stack) == Step::NeedsPrecise {
                    return Step::NeedsPrecise;
                }
            }
            let Some(next) = stack.pop() else { return Step::Done };
            node = next;
        }
    }

    /// Takes one step: drops a box, offers its root, or puts what is left of it on the stack; [`Step::Done`] or [`Step::NeedsPrecise`].
    #[inline(always)]
    fn clip_node(&self, query: &mut Query, clipping: &Clipping<'_>, node: &Node, stack: &mut Vec<Node>) -> Step {
        let (degree, seen) = (clipping.leaf.degree, clipping.seen);
        let Some(hull) = hull(&node.net, seen.homogeneous_margin) else { return Step::Done };
        if hull.near > query.t_max || hull.far < query.from - TANGENT {
            return Step::Done;
        }
        // What the preconditioned hull leaves of the box, and its root where there is one at most.
        let mut keep = [[0.0, 1.0]; 2];
        let slopes = net::slopes(&node.net, degree);
        if let Some(y) = precondition(&slopes, degree, seen.homogeneous_margin) {
            // Wider by what rounding may move a root, so that no cut parts a root from its box.
            keep = linear_hull(&node.net, degree, &y.inverse);
            for k in 0..2 {
                keep[k] = [keep[k][0] - y.slack[k], keep[k][1] + y.slack[k]];
                if keep[k][0] > 1.0 || keep[k][1] < 0.0 {
                    return Step::Done;
                }
                keep[k] = [keep[k][0].max(0.0), keep[k][1].min(1.0)];
            }
            if y.deviation < LARGEST_ROW_SUM_OF_BOX
                && self.take_single_root(query, clipping, node, &y, keep) == Step::Done
            {
                return Step::Done;
            }
        }
        let small = size(&node.rect).into_iter().fold(0.0, f64::max);
        if small <= TANGENCY_BOX && self.take_tangency(query, clipping, node) == Step::Done {
            return Step::Done;
        }
        // At a contact the Jacobian is singular: no box proves itself there, however small, so a small one is taken as it is. What `f64`
        // takes for one is looked at once more in 32 digits, until it is a point or nothing is left of it.
        let is_short = if clipping.at_pole {
            hull.far - hull.near < CONTACT_LENGTH * clipping.leaf.contact || small < POINT_BOX
        } else {
            !seen.precise || hull.far - hull.near < clipping.leaf.contact || small < POINT_BOX
        };
        let touches = hull.across < clipping.leaf.contact && is_short;
        if touches || small < FINEST {
            return self.take_contact(query, clipping, node);
        }
        let kept = keep.map(|[a, b]| b - a);
        // A cut that keeps nearly everything costs what a halving costs and parts no two roots.
        if kept[0] < WORTH_CUTTING || kept[1] < WORTH_CUTTING {
            stack.push(cut(node, degree, keep, hull.near));
        } else {
            halve(node, degree, &slopes, stack);
        }
        Step::Done
    }

    /// Offers or settles the root of a box with one at most, unless the ray leaves it; [`Step::Open`] when Newton's method finds none in
    /// the box.
    #[inline(always)]
    fn take_single_root(
        &self,
        query: &mut Query,
        clipping: &Clipping<'_>,
        node: &Node,
        y: &Preconditioner,
        keep: [[f64; 2]; 2],
    ) -> Step {
        let degree = clipping.leaf.degree;
        let start = keep.map(|[a, b]| 0.5 * (a + b));
        // The method may run off although a root is there; the box is then cut or halved like any other.
        let Some([u, v]) = newton(&node.net, degree, start) else { return Step::Open };
        // By direction: boxes may be as thin as rounding along one and long along the other.
        let box_margin = y.slack.map(|slack| ROOT_ROUNDING + 2.0 * slack);
        let found = [u, v];
        // Beside the box: if it is a root of the leaf, another box holds it, and this one is cut until its hull
        // misses the ray.
        if (0..2).any(|k| !(-box_margin[k]..=1.0 + box_margin[k]).contains(&found[k])) {
            return Step::Open;
        }
        let s = net::evaluate(&node.net, degree, u, v).s;
        let t = s[2] / s[3];
        let sizes = size(&node.rect);
        let local = [0, 1].map(|k: usize| node.rect[k][0] + sizes[k] * found[k]);
        // An origin a little off its surface point moves the root by that much across the ray.
        let off = query.departure.map_or(0.0, |own| own.off);
        let moved = y.inverse.map(|[a, b]| off * (a.abs() + b.abs()));
        // With one root at most in the box, a departure in it is that root. Near the box counts too, for neighbours
        // find a root on their border both.
        let is_departure = |p: [f64; 2]| {
            let is_close =
                (0..2).all(|k| (p[k] - local[k]).abs() <= sizes[k] * (box_margin[k] + moved[k]) + SAME_PARAMETER);
            is_close || (0..2).all(|k| p[k] >= node.rect[k][0] && p[k] <= node.rect[k][1])
        };
        let leaving =
            clipping.departure.is_some_and(is_departure) && query.departure.is_some_and(|own| own.is_root_at(t));
        if !leaving {
            let candidate = Candidate { local, t, certainty: Certainty::Certified, settled: None };
            let margin = [0, 1].map(|k: usize| box_margin[k] * sizes[k]);
            let ill_scaled = self.linearizations[clipping.index as usize].ill_scaled;
            if clipping.seen.precise {
                self.settle(query, clipping.index, candidate, [settlement::LOOSE; 2]);
            } else if ill_scaled || settlement::needs_settling(local, margin) {
                // Where its margin reaches over the leaf's border, or the patch has few digits, `f64` cannot say
                // whose root it is.
                self.settle(query, clipping.index, candidate, margin);
            } else {
                self.offer(query, clipping.index, candidate);
            }
        }
        Step::Done
    }

    /// Offers the roots of a box where the ray touches a surface that bends, none or both; [`Step::Open`] where that is undecided.
    #[cold]
    fn take_tangency(&self, query: &mut Query, clipping: &Clipping<'_>, node: &Node) -> Step {
        // The square around the box, and somewhat more, is what is looked at.
        let side = size(&node.rect).into_iter().fold(0.0, f64::max);
        let is_around =
            |p: [f64; 2]| (0..2).all(|k| (p[k] - 0.5 * (node.rect[k][0] + node.rect[k][1])).abs() <= side);
        // Which of two roots the ray leaves, when its start is off both by rounding, 32 digits do not decide either.
        if clipping.at_pole || clipping.departure.is_some_and(is_around) || query.budget < TANGENCY_WORK {
            return Step::Open;
        }
        let Some(roots) = tangency::roots(self, query, clipping.leaf, clipping.seen, node.rect) else {
            return Step::Open;
        };
        for root in roots {
            self.offer_settled(query, clipping.index, &root, [settlement::LOOSE; 2]);
        }
        Step::Done
    }

    /// Offers the middle of a box that touches the ray within rounding, unless the ray leaves it; [`Step::NeedsPrecise`] where 32 digits
    /// may decide more.
    #[inline(always)]
    fn take_contact(&self, query: &mut Query, clipping: &Clipping<'_>, node: &Node) -> Step {
        let s = net::evaluate(&node.net, clipping.leaf.degree, 0.5, 0.5).s;
        let [size_u, size_v] = size(&node.rect);
        let local = [node.rect[0][0] + 0.5 * size_u, node.rect[1][0] + 0.5 * size_v];
        let t = s[2] / s[3];
        let reach = POINT_BOX + size_u.max(size_v);
        let leaving = clipping.departure.is_some_and(|p| (0..2).all(|k| (p[k] - local[k]).abs() <= reach))
            && query
                .departure
                .is_some_and(|own| own.is_root_at((t.abs() - CONTACT_LENGTH * clipping.leaf.contact).max(0.0)));
        if clipping.seen.precise || clipping.at_pole {
            if !leaving {
                let certainty = self.contact_certainty(clipping.leaf, local, query);
                self.offer(query, clipping.index, Candidate { local, t, certainty, settled: None });
            }
            return Step::Done;
        }
        // A box that touches in `f64` may be long, and hold another root beside the one that the ray leaves.
        if leaving && self.runs_along(query, clipping, node) { Step::Done } else { Step::NeedsPrecise }
    }

    /// Whether the ray, as far as a box reaches, runs along the surface that it leaves: nowhere higher over it than what its start is off
    /// and rounding. The roots there cannot be distinguished from the departure.
    fn runs_along(&self, query: &Query, clipping: &Clipping<'_>, node: &Node) -> bool {
        let Some((own, [u, v])) = query.departure.zip(clipping.departure) else { return false };
        let control = clipping.leaf.net(&self.geometry.nets);
        let (_, du, dv) =
            project(&net::evaluate(control, clipping.leaf.degree, u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)));
        let normal = du.cross(dv).normalize_or_zero();
        let [a, b] = clipping.seen.frame.map(|n| n.dot(normal));
        let bound = own.off + 2.0 * clipping.noise;
        node.net.iter().all(|p| (a * p[0] + b * p[1]).abs() <= bound * p[3])
    }
}

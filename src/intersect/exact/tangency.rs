//! Small boxes in which the ray touches the surface: none, or both of its roots, decided in 32 digits.
//!
//! At a contact the Jacobian is singular and no box proves itself, however small. But where the surface bends along the ray there are two
//! roots at most, and how far the ray passes above or below says which. Let f be the map to the plane across the ray, its components turned
//! so that `h` runs along the longer column of the middle Jacobian and `g` across it, and q the parameter of that column, p the other.
//! Over a box where `h_q` keeps its sign the places of `h = 0` are a curve q(p), whose slope lies in `−h_p/h_q`, and along it
//! `φ(p) = g(p, q(p))` has `φ″ = (g − λh)_ττ` with `λ = g_q/h_q` and `τ = (1, q′)`. All of these are bounded by Bernstein hulls.
//!
//! * Let x̂ be a point of the curve, and x a root in the box. The segment between them has a slope in the range of q′, and Taylor's theorem
//!   for `g − λ̂h` along it says `0 ≥ φ̂ + φ̂′Δp + ½mΔp²` for a lower bound m > 0 of φ″. Where that is positive over the box there is no
//!   root.
//! * Where φ̂ < 0 < m, φ is convex and has two zeros at most: both are found by Newton's method from either side of x̂. The curve between
//!   two roots stays in the box where it strays from its chord by less than the room that is left around them.
//!
//! φ̂ and φ̂′ are computed in 32 digits on the surface as given: they resolve heights of 1e-25 mm.

use super::clip_hull::SeenLeaf;
use super::double_double::DoubleDouble;
use super::leaf::Leaf;
use super::net::{self, Net, Slopes, V4};
use super::query::Query;
use super::reference::{ReferencePatch, SettledRoot};
use super::structure::Exact;
use super::tolerances::contact_distance;
use crate::math::Vector;
use crate::math::simd::{self, Instructions, Kernel};
use smallvec::SmallVec;

/// The box is looked at with as much of its sides more at either end, so that a contact near its border is one inside.
const ROOM: f64 = 0.25;
/// The box itself, as a share of what is looked at.
const BOX: [f64; 2] = [ROOM / (1.0 + 2.0 * ROOM), (1.0 + ROOM) / (1.0 + 2.0 * ROOM)];
/// Roots that are counted lie this far from the border of what is looked at: the curve through them may bulge by as much.
const BULGE: f64 = 0.5 * BOX[0];
/// A root of the box lies in it or beyond by no more than this: its neighbour finds it too.
const SHARED: f64 = 1e-9;
/// φ″ must not vary by more, so that steps by its mean get shorter.
const LEAST_BEND: f64 = 0.1;
/// Steps towards the place where the ray runs along the surface.
const DESCENT_STEPS: usize = 12;
/// Rays that pass a surface farther off than this many contacts and margins are decided by halving, in a tenth of the time.
const NEAR_CONTACTS: f64 = 4.0;
const NEAR_MARGINS: f64 = 1e3;
/// Where the curve is met well enough, as a share of the box: its square is below 32 digits.
const ON_CURVE: f64 = 1e-20;
/// Relative error of a height in 32 digits: a thousand roundings of 2⁻¹⁰⁴, twenty times over.
const HEIGHT_ROUNDING: f64 = 1e-27;

/// Clipping steps that looking for a bend counts as: two microseconds.
const BEND_WORK: u32 = 4;
/// Clipping steps that the search in 32 digits counts as, whether it finds or not: 150 to 300 microseconds.
pub(super) const TANGENCY_WORK: u32 = 400;

type Number = DoubleDouble;
type Range = [f64; 2];

/// How the box is turned, and bounds over it; parameters are shares of what is looked at.
struct Bend {
    /// The parameter that the curve is a function of, and the other.
    p: usize,
    q: usize,
    /// Components of `h` and `g` in the ray's frame.
    along: [f64; 2],
    across: [f64; 2],
    /// Bounds of φ″.
    range: Range,
}

/// `g` and `h` of the module and their derivatives by p and q, as shares of what is looked at; mm times the weight of the point.
struct Heights {
    g: f64,
    h: f64,
    /// By p, then by q.
    dg: [f64; 2],
    dh: [f64; 2],
}

/// The roots in a box where the ray touches the surface; `None` where that is undecided.
///
/// The box is one of a leaf's parameters. What it takes is charged to the query's budget.
pub(super) fn roots(
    exact: &Exact,
    query: &mut Query,
    leaf: &Leaf,
    seen: &SeenLeaf,
    rect: [[f64; 2]; 2],
) -> Option<SmallVec<[SettledRoot; 2]>> {
    query.budget = query.budget.saturating_sub(BEND_WORK);
    // Of a sliver, which cuts leave along the ray, the square around it: the curve needs room to bend.
    let side = rect.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let wide = rect.map(|[low, high]| [-1.0, 1.0].map(|sign| 0.5 * (low + high) + sign * (0.5 + ROOM) * side));
    // From the leaf's own net, since what its points are off grows where a net is drawn out and not where it is cut.
    let mut net = seen.net.clone();
    for d in 0..2 {
        net::restrict(&mut net, leaf.degree, d, wide[d]);
    }
    let beyond = wide.as_flattened().iter().map(|&x| (-x).max(x - 1.0)).fold(0.0, f64::max);
    let steps = 2 * (leaf.degree[0] + leaf.degree[1]);
    let grown = (0..steps).fold(1.0, |grown, _| grown * (1.0 + 2.0 * beyond));
    let margin = seen.homogeneous_margin.map(|m| m * grown);
    let bend = Bend::new(&net, leaf.degree, margin)?;
    let from = leaf.patch_parameters(wide.map(|[low, _]| low));
    let extent = [0, 1].map(|k: usize| (leaf.rect[k][1] - leaf.rect[k][0]) * (wide[k][1] - wide[k][0]));
    let patch = &exact.geometry.patches[leaf.patch as usize];
    let near = NEAR_CONTACTS * contact_distance(patch.size()) + NEAR_MARGINS * margin[0].max(margin[1]);
    if !(bend.lowest(&net, leaf.degree).abs() <= near) {
        return None;
    }
    let reference = exact.geometry.reference(patch);
    query.budget = query.budget.saturating_sub(TANGENCY_WORK);
    simd::dispatch(Search { reference, query, leaf, frame: seen.frame, net: &net, bend: &bend, from, extent })
}

impl Bend {
    /// Bounds the curve and φ″ over a net in the ray's frame with this rounding, in homogeneous units; `None` where the curve or the sign
    /// of φ″ is not certain.
    fn new(net: &[V4], degree: [u8; 2], margin: [f64; 2]) -> Option<Self> {
        let slopes = net::slopes(net, degree);
        let Slopes { u, v, ru, rv } = &slopes;
        let columns = [[u[0], u[1]], [v[0], v[1]]];
        let radii = [[ru[0], ru[1]], [rv[0], rv[1]]];
        let length = columns.map(|[x, y]| x.hypot(y));
        let q = usize::from(length[1] > length[0]);
        let p = 1 - q;
        if !(length[q] > 0.0) {
            return None;
        }
        let along = columns[q].map(|x| x / length[q]);
        let across = [-along[1], along[0]];
        let part = |e: [f64; 2], x: [f64; 2]| e[0] * x[0] + e[1] * x[1];
        let spread = |e: [f64; 2], x: [f64; 2]| e[0].abs() * x[0] + e[1].abs() * x[1];
        // A derivative is n times a difference of two points, a second one n² of four at most.
        let n = f64::from(degree[0].max(degree[1]));
        let margin_along = spread(along, margin);
        let margin_across = spread(across, margin);
        let (first_factor, second_factor) = (2.0 * n, 4.0 * n * n);

        let h_q = length[q] - spread(along, radii[q]) - first_factor * margin_along;
        if !(h_q > 0.5 * length[q]) {
            return None;
        }
        let (h_p, r) = (part(along, columns[p]), spread(along, radii[p]) + first_factor * margin_along);
        let most_h_q = 2.0 * length[q] - h_q;
        let ends = [h_p - r, h_p + r].map(|x| [-x / h_q, -x / most_h_q]);
        let slope = ends.as_flattened().iter().fold([f64::INFINITY, f64::NEG_INFINITY], |a, &x| grown(a, x));
        let lambda = (spread(across, radii[q]) + first_factor * margin_across) / h_q;

        let second = |e: [f64; 2], margin: f64| {
            second_derivatives(net, degree, [p, q], |x| e[0] * x[0] + e[1] * x[1], second_factor * margin)
        };
        let (g2, h2) = (second(across, margin_across), second(along, margin_along));
        let steepest = slope[0].abs().max(slope[1].abs());
        let size = |x: Range| x[0].abs().max(x[1].abs());
        let h_bend = size(h2[0]) + 2.0 * size(h2[1]) * steepest + size(h2[2]) * steepest * steepest;
        // How far the curve strays from a chord, times how fast h changes across it.
        if !(0.125 * h_bend <= BULGE * h_q) {
            return None;
        }
        let mixed = product(g2[1], slope);
        let square = product(g2[2], squared(slope));
        let h_part = lambda * h_bend;
        let range =
            [g2[0][0] + 2.0 * mixed[0] + square[0] - h_part, g2[0][1] + 2.0 * mixed[1] + square[1] + h_part];
        // The side on which φ is convex.
        let (range, across) =
            if range[1] < 0.0 { ([-range[1], -range[0]], across.map(|x| -x)) } else { (range, across) };
        (range[0] > LEAST_BEND * range[1]).then_some(Self { p, q, along, across, range })
    }

    /// Newton's step along p and q towards the lowest point of φ on the curve, ended at the border of what is looked at: of φ that is
    /// lowest beyond, the nearest point says enough.
    #[inline(always)]
    fn step(&self, x: [f64; 2], slope: f64, h: f64, [h_p, h_q]: [f64; 2]) -> [f64; 2] {
        let Self { p, q, range: [least, most], .. } = *self;
        let to = (x[p] - 2.0 * slope / (least + most)).clamp(0.0, 1.0);
        // As differences: the last steps are far below the last bit of a share.
        let step = to - x[p];
        let other = -(h + h_p * step) / h_q;
        if (0.0..=1.0).contains(&(x[q] + other)) {
            return [step, other];
        }
        let inside = (x[q] + other).clamp(0.0, 1.0) - x[q];
        let step = if h_p == 0.0 { step } else { (x[p] - (h + h_q * inside) / h_p).clamp(0.0, 1.0) - x[p] };
        [step, (x[q] - (h + h_p * step) / h_q).clamp(0.0, 1.0) - x[q]]
    }

    /// Value of φ at its lowest point over the net, in `f64` and homogeneous units: how far the ray passes the surface.
    fn lowest(&self, net: &[V4], degree: [u8; 2]) -> f64 {
        let Self { p, q, along, across, .. } = *self;
        let part = |e: [f64; 2], x: &V4| e[0] * x[0] + e[1] * x[1];
        let (mut x, mut height) = ([0.5; 2], f64::INFINITY);
        for _ in 0..DESCENT_STEPS {
            let jet = net::evaluate(net, degree, x[0], x[1]);
            let columns = [&jet.su, &jet.sv];
            let (h_p, h_q) = (part(along, columns[p]), part(along, columns[q]));
            let lambda = part(across, columns[q]) / h_q;
            let (h, before) = (part(along, &jet.s), height);
            height = part(across, &jet.s) - lambda * h;
            let slope = part(across, columns[p]) - lambda * h_p;
            let [step, other] = self.step(x, slope, h, [h_p, h_q]);
            x[p] += step;
            x[q] += other;
            if (height - before).abs() <= 0.1 * height.abs() {
                break;
            }
        }
        height
    }
}

/// The range that holds `x` too.
fn grown([low, high]: Range, x: f64) -> Range {
    [low.min(x), high.max(x)]
}

/// The range of products of two ranges.
fn product(a: Range, b: Range) -> Range {
    [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]].into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], grown)
}

/// The range of squares of a range.
fn squared([low, high]: Range) -> Range {
    let most = low.abs().max(high.abs());
    let least = if low <= 0.0 && high >= 0.0 { 0.0 } else { low.abs().min(high.abs()) };
    [least * least, most * most]
}

/// Ranges over the net of the second derivatives (pp, pq, qq) of a component of it, widened by `margin`; zero for those of degree one.
fn second_derivatives(
    net: &[V4],
    degree: [u8; 2],
    [p, q]: [usize; 2],
    component: impl Fn(&V4) -> f64,
    margin: f64,
) -> [Range; 3] {
    let counts = degree.map(usize::from);
    let at = |i: usize, j: usize| component(&net[i * (counts[1] + 1) + j]);
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let (mut uu, mut uv, mut vv) = (none, none, none);
    for i in 0..=counts[0] {
        for j in 0..=counts[1] {
            if i + 2 <= counts[0] {
                uu = grown(uu, at(i + 2, j) - 2.0 * at(i + 1, j) + at(i, j));
            }
            if j + 2 <= counts[1] {
                vv = grown(vv, at(i, j + 2) - 2.0 * at(i, j + 1) + at(i, j));
            }
            if i < counts[0] && j < counts[1] {
                uv = grown(uv, at(i + 1, j + 1) - at(i + 1, j) - at(i, j + 1) + at(i, j));
            }
        }
    }
    let [n, m] = counts.map(|n| n as f64);
    // Of degree one there is no second difference, and the derivative is zero.
    let scaled = |x: Range, k: f64| if x[0] > x[1] { [0.0; 2] } else { [k * x[0] - margin, k * x[1] + margin] };
    let own = [scaled(uu, n * (n - 1.0)), scaled(vv, m * (m - 1.0))];
    [own[p], scaled(uv, n * m), own[q]]
}

/// The search in 32 digits, for [`simd::dispatch`].
struct Search<'a> {
    reference: ReferencePatch<'a>,
    query: &'a Query,
    leaf: &'a Leaf,
    frame: [Vector; 2],
    /// Over what is looked at.
    net: &'a Net,
    bend: &'a Bend,
    /// What is looked at, in the patch's parameters: low corner and extent.
    from: [f64; 2],
    extent: [f64; 2],
}

impl Kernel for Search<'_> {
    type Output = Option<SmallVec<[SettledRoot; 2]>>;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Self::Output {
        self.search()
    }
}

impl Search<'_> {
    /// What [`roots`] returns, once the bend is known.
    #[inline(always)]
    fn search(&self) -> Option<SmallVec<[SettledRoot; 2]>> {
        let Bend { p, q, range: [least, most], .. } = *self.bend;
        let largest = self.query.o.abs().max_element() + self.leaf.center.abs().max_element() + self.leaf.radius;
        let rounding = HEIGHT_ROUNDING * largest;
        let mut local = [0, 1].map(|k: usize| Number::from(self.from[k]) + (0.5 * self.extent[k]).into());
        for _ in 0..DESCENT_STEPS {
            let x = self.share(&local);
            if !(0.0..=1.0).contains(&x[q]) {
                return None;
            }
            let Heights { g, h, dg, dh } = self.heights(&local, x);
            let lambda = dg[1] / dh[1];
            let height = g - lambda * h;
            let slope = dg[0] - lambda * dh[0];
            if (h / dh[1]).abs() < ON_CURVE {
                // The lowest that φ can be over the box.
                let [low, high] = BOX.map(|end| end - x[p]);
                let way = (-slope / least).clamp(low, high);
                if height + slope * way + 0.5 * least * way * way > rounding {
                    return Some(SmallVec::new());
                }
                let highest = |way: f64| height + slope * way + 0.5 * most * way * way;
                if highest(low).max(highest(high)) < -rounding {
                    return Some(SmallVec::new());
                }
                if height < -rounding && slope * slope < -0.5 * least * height {
                    return self.both_roots(x, height, dh);
                }
            }
            let [step, other] = self.bend.step(x, slope, h, dh);
            local[p] = local[p] + (self.extent[p] * step).into();
            local[q] = local[q] + (self.extent[q] * other).into();
        }
        None
    }

    /// Finds both roots beside the lowest point of φ at `x`, and returns those in the box; `None` where Newton's method does not find both
    /// well inside what is looked at.
    #[inline(always)]
    fn both_roots(&self, x: [f64; 2], height: f64, dh: [f64; 2]) -> Option<SmallVec<[SettledRoot; 2]>> {
        let Bend { p, q, range: [least, most], .. } = *self.bend;
        let way = (-4.0 * height / (least + most)).sqrt();
        let mut found = SmallVec::new();
        for side in [-1.0, 1.0] {
            let mut start = x;
            start[p] += side * way;
            start[q] -= side * way * dh[0] / dh[1];
            let start = [0, 1].map(|k: usize| self.from[k] + self.extent[k] * start[k]);
            let root = self.reference.settle([self.query.o, self.query.d], start)?;
            let at = [0, 1].map(|k: usize| (root.local[k] - self.from[k]) / self.extent[k]);
            let is_counted = at.iter().all(|a| (BULGE..=1.0 - BULGE).contains(a)) && side * (at[p] - x[p]) > 0.0;
            if !is_counted {
                return None;
            }
            if at.iter().all(|a| (BOX[0] - SHARED..=BOX[1] + SHARED).contains(a)) {
                found.push(root);
            }
        }
        Some(found)
    }

    /// Turns local parameters of the patch into shares of what is looked at.
    #[inline(always)]
    fn share(&self, local: &[Number; 2]) -> [f64; 2] {
        [0, 1].map(|k| (local[k] - self.from[k].into()).to_f64() / self.extent[k])
    }

    /// Evaluates `g` and `h` with their first derivatives at one point, given twice: as `local` parameters of the patch in 32 digits, of
    /// which the values are computed, and as shares `x`, which serve for the weight alone.
    #[inline(always)]
    fn heights(&self, local: &[Number; 2], x: [f64; 2]) -> Heights {
        let Bend { p, q, along, across, .. } = *self.bend;
        let seen = self.reference.seen_along([self.query.o, self.query.d], *local);
        let [j, k] = seen.axes;
        let [n1, n2] = self.frame;
        let component = |e: [f64; 2], value: [Number; 2]| {
            let (a, b) = (e[0] * n1[j] + e[1] * n2[j], e[0] * n1[k] + e[1] * n2[k]);
            (value[0] * a.into() + value[1] * b.into()).to_f64()
        };
        let derivative = |e: [f64; 2], d: usize| component(e, seen.derivatives[d]) * self.extent[d];
        let (g, h) = (component(across, seen.value), component(along, seen.value));
        // In homogeneous units, as the bounds are.
        let jet = net::evaluate_inlined(self.net, self.leaf.degree, x[0], x[1]);
        let (w, slopes) = (jet.s[3], [jet.su[3], jet.sv[3]]);
        let weighted = |e: [f64; 2], value: f64| [p, q].map(|d| w * derivative(e, d) + slopes[d] * value);
        Heights { g: w * g, h: w * h, dg: weighted(across, g), dh: weighted(along, h) }
    }
}

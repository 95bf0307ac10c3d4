//! Which way shells and their faces look: faces that contradict their neighbours, shells of solids that are inside out, and which of them
//! may be a void of which.
//!
//! Neighbours run along their common edge in opposite directions. A face whose flag of sense says otherwise is turned, if few do.
//!
//! Some exporters write the shell of a mirrored part so, and its readers turn it. The volume decides, by the divergence theorem over a
//! grid of points on each face. First on few; where that says inside out on more, and of thin walls, whose volume is what is left of
//! larger terms, with a bound on the error face by face. Where that is not met the file is believed.

use crate::math::polygon::{is_inside_polygons, signed_area};
use crate::math::{Aabb, Point, Uv, Vector};
use crate::model::{Analytic, EdgeId, Face};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Points across a face of the first look, of the two that decide, and of one more that thin walls need.
const GRIDS: [usize; 4] = [4, 16, 23, 46];
/// Share of the sum of all terms, whatever their signs, from which on two grids decide: quadrature and polygons for trims are better.
const NOT_THIN: f64 = 0.02;
/// The share of it that is rounding of coordinates and of the sum.
const ROUNDED: f64 = 1e-9;
/// Share of the diagonal of a box by which points in it may lie beside it: far more than files round by.
const BOX_ROUNDING: f64 = 1e-4;
/// Points on each edge of a loop, and for thin walls.
const EDGE: usize = 6;
const EDGE_OF_THIN: usize = 24;

/// Returns the indices of faces, ascending, whose sense contradicts their neighbours'. In each set of faces joined by edges that two of
/// them use, faces fall into two groups that contradict each other along all edges between them; the smaller one is returned. None of a set
/// whose edges give no two groups (a Möbius band) or groups of one size. Whether all look inwards is not decided here.
pub(crate) fn faces_against_neighbours(faces: &[Face]) -> Vec<usize> {
    // For each edge the faces that use it and whether they run along it.
    let mut uses: FxHashMap<EdgeId, Vec<(usize, bool)>> = FxHashMap::default();
    for (k, face) in faces.iter().enumerate() {
        for edge_use in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(edge) = edge_use.edge {
                // A face that looks the other way runs its loops the other way.
                uses.entry(edge).or_default().push((k, edge_use.reversed != face.reversed));
            }
        }
    }
    // Neighbours, and whether they agree; seams are no edges between faces.
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); faces.len()];
    for both in uses.into_values() {
        if let [(a, along_a), (b, along_b)] = both[..]
            && a != b
        {
            // Along one edge two faces that look the same way run against each other.
            neighbours[a].push((b, along_a != along_b));
            neighbours[b].push((a, along_a != along_b));
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    let mut out = Vec::new();
    // Sides spread from face to face: within a group they are known up to a turn of all.
    for first in 0..faces.len() {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        let (mut group, mut next, mut is_consistent) = (vec![(first, false)], 0, true);
        while next < group.len() {
            let (k, own) = group[next];
            for &(other, agrees) in &neighbours[k] {
                let wanted = own == agrees;
                match turned[other] {
                    None => {
                        turned[other] = Some(wanted);
                        group.push((other, wanted));
                    }
                    Some(known) => is_consistent &= known == wanted,
                }
            }
            next += 1;
        }
        let count = group.iter().filter(|(_, turned)| *turned).count();
        // By majority; whether the whole shell looks inwards is decided by its volume.
        if is_consistent && 2 * count != group.len() {
            let fewer = 2 * count < group.len();
            out.extend(group.into_iter().filter(|(_, turned)| *turned == fewer).map(|(k, _)| k));
        }
    }
    out.sort_unstable();
    out
}

/// Whether the faces of a shell of a solid, all of them, certainly look the wrong way: inwards, or away from what a `void` encloses; false
/// where that is not certain.
pub(crate) fn is_inside_out(faces: &[Face], void: bool) -> bool {
    // About the middle of the solid the terms are least, and what cancels between faces with them.
    let around = Aabb::from_points(faces.iter().map(|f| f.surface.evaluate(domain_center(f))));
    if around.is_empty() {
        return false;
    }
    let polygons =
        |count: usize| -> Vec<Vec<Vec<Uv>>> { faces.par_iter().map(|face| loop_polygons(face, count)).collect() };
    let flows = |loops: &[Vec<Vec<Uv>>], grid: usize| -> Vec<Flow> {
        faces.par_iter().zip(loops).map(|(face, loops)| flow(face, loops, around.center(), grid)).collect()
    };
    // The faces of a void look into it, away from the solid: a right one has a negative volume.
    let volume = |flow: &Flow| if void { -flow.volume } else { flow.volume };
    let loops = polygons(EDGE);
    // Most shells are right: a coarse look is enough to leave them.
    let first = volume(&sum(&flows(&loops, GRIDS[0])));
    if first.is_nan() || first >= 0.0 {
        return false;
    }
    let (coarse, fine) = (flows(&loops, GRIDS[1]), flows(&loops, GRIDS[2]));
    let (before, after) = (sum(&coarse), sum(&fine));
    let changed = (volume(&after) - volume(&before)).abs();
    // Negative by more than what a finer grid changed.
    let is_negative = volume(&after) < 0.0 && -volume(&after) > 4.0 * changed;
    if !is_negative {
        return false;
    }
    if -volume(&after) > NOT_THIN * after.whole {
        return true;
    }
    // A sliver of the whole: a flat shell, where errors of faces may cancel by chance, or a twisted one, whose volume depends on the point
    // that it is seen from, stays as it is.
    let finest = flows(&polygons(EDGE_OF_THIN), GRIDS[3]);
    let change = |k: usize| {
        let [a, b, c] = [&coarse, &fine, &finest].map(|flows| flows[k].volume);
        // Two grids may be off alike, where a knot lies between their points.
        (b - a).abs().max((c - b).abs())
    };
    let off: f64 = (0..faces.len()).map(change).sum();
    let last = sum(&finest);
    -volume(&last) > 4.0 * off + last.area.length() * bounds(faces).diagonal() + ROUNDED * last.whole
}

/// Which way the faces of a closed shell look where that is certain: whether inwards.
pub(super) fn looks_inwards(faces: &[Face]) -> Option<bool> {
    if is_inside_out(faces, false) { Some(true) } else { is_inside_out(faces, true).then_some(false) }
}

/// Boxes of a shell: around all that its faces may enclose, and around what they certainly reach.
pub(super) struct FaceBoxes {
    enclosed: Aabb,
    corners: Aabb,
}

impl FaceBoxes {
    pub(super) fn new(faces: &[Face]) -> Self {
        // Surfaces lie within their boxes, and so does all that they enclose; trims may cut off much of one.
        let enclosed = bounds(faces);
        let corners = faces.iter().flat_map(corners).filter(|corner| corner.is_finite());
        Self { enclosed: enclosed.grown(BOX_ROUNDING * enclosed.diagonal()), corners: Aabb::from_points(corners) }
    }

    /// Whether the other shell may lie within this one: no corner of it is certainly outside.
    pub(super) fn may_enclose(&self, other: &Self) -> bool {
        let corners = other.corners;
        corners.is_empty() || (self.enclosed.contains(corners.min) && self.enclosed.contains(corners.max))
    }

    /// Diagonal of the box around all that the faces may enclose, mm.
    pub(super) fn diagonal(&self) -> f64 {
        self.enclosed.diagonal()
    }
}

/// Returns the points at which the edges of a face's loops begin; of a face without a border a point of it.
fn corners(face: &Face) -> Vec<Point> {
    let uses = face.loops.iter().flat_map(|l| &l.uses);
    let mut corners: Vec<Uv> = uses.map(|u| u.start()).collect();
    if corners.is_empty() {
        corners.push(domain_center(face));
    }
    corners.into_iter().map(|uv| face.surface.evaluate(uv)).collect()
}

/// The box around the surfaces of faces, trimmed or not.
fn bounds(faces: &[Face]) -> Aabb {
    faces.iter().fold(Aabb::EMPTY, |all, face| all.union(face.surface.bounds()))
}

fn domain_center(face: &Face) -> Uv {
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1))
}

/// Flux out of a face, or of several.
#[derive(Clone, Copy, Debug, Default)]
struct Flow {
    /// A third of the flow of `p - center`, mm³: by Gauss's theorem, out of a closed surface, its volume.
    volume: f64,
    /// What that would be with all signs alike, mm³.
    whole: f64,
    /// The flow of 1, mm²: nothing, out of a closed surface.
    area: Vector,
}

fn sum(flows: &[Flow]) -> Flow {
    flows.iter().fold(Flow::default(), |a, b| Flow {
        volume: a.volume + b.volume,
        whole: a.whole + b.whole,
        area: a.area + b.area,
    })
}

/// Returns a face's loops as polygons, in parameters: `count` points on each edge, in the direction of the loop.
fn loop_polygons(face: &Face, count: usize) -> Vec<Vec<Uv>> {
    let points = |u: &crate::model::EdgeUse| {
        let ([a, b], reversed) = (u.uv.domain(), u.reversed);
        (0..count)
            .map(|i| i as f64 / count as f64)
            .map(|s| u.uv.evaluate(a + (b - a) * if reversed { 1.0 - s } else { s }))
            .collect::<Vec<_>>()
    };
    face.loops.iter().map(|l| l.uses.iter().flat_map(points).collect()).collect()
}

/// [`flow`] out of a plane, by the area that its loops enclose: the largest less all others, however they run. A grid hits rings of a
/// tenth of a millimetre, the ends of a tube, by chance.
fn flow_of_plane(face: &Face, loops: &[Vec<Uv>], center: Point) -> Flow {
    let areas = loops.iter().map(|polygon| signed_area(polygon).abs());
    let (sum, largest) = areas.fold((0.0, 0.0f64), |(sum, largest), area| (sum + area, largest.max(area)));
    let d = face.surface.derivatives(domain_center(face));
    let area = (2.0 * largest - sum) * outward(face, d.du.cross(d.dv));
    let volume = (d.point - center).dot(area) / 3.0;
    Flow { volume, whole: volume.abs(), area }
}

/// Returns what flows out of a face, by the middles of a grid of `grid` cells each way over what `loops` enclose (none: all); nothing if
/// that has no area.
fn flow(face: &Face, loops: &[Vec<Uv>], center: Point, grid: usize) -> Flow {
    if matches!(face.analytic, Analytic::Plane { .. }) && !loops.is_empty() {
        return flow_of_plane(face, loops, center);
    }
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let (mut low, mut high) = (Uv::new(u0, v0), Uv::new(u1, v1));
    if !loops.is_empty() {
        let points = || loops.iter().flatten();
        // The grid spans what the loops enclose: the surface of a small trim may be large.
        low = low.max(points().fold(Uv::INFINITY, |m, p| m.min(*p)));
        high = high.min(points().fold(Uv::NEG_INFINITY, |m, p| m.max(*p)));
    }
    let step = (high - low) / grid as f64;
    if !(step.x > 0.0 && step.y > 0.0) {
        return Flow::default();
    }
    let mut out = Flow::default();
    for k in 0..grid * grid {
        let uv = low + step * Uv::new((k % grid) as f64 + 0.5, (k / grid) as f64 + 0.5);
        if !is_inside_polygons(loops, uv) {
            continue;
        }
        let d = face.surface.derivatives(uv);
        let area = outward(face, d.du.cross(d.dv)) * (step.x * step.y);
        let volume = (d.point - center).dot(area) / 3.0;
        out = sum(&[out, Flow { volume, whole: volume.abs(), area }]);
    }
    out
}

/// Turns a normal of a face's surface to the side that the face looks to.
fn outward(face: &Face, normal: Vector) -> Vector {
    if face.reversed { -normal } else { normal }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::model::{EdgeUse, TrimLoop};
    use crate::nurbs::UvCurve;
    use crate::nurbs::sweep::{cylinder, plane};
    use std::f64::consts::TAU;

    fn block(size: [f64; 3], reversed: bool) -> Vec<Face> {
        let size = Vector::from_array(size);
        let side = |k: usize| {
            let (axes, sign) = ([Vector::X, Vector::Y, Vector::Z], if k < 3 { 1.0 } else { -1.0 });
            let [z, x, y] = [0, 1, 2].map(|i| axes[(k + i) % 3]);
            let frame = Frame::from_axis(z * (0.5 * sign * size.dot(z)), z * sign, Some(x));
            let [a, b] = [x, y].map(|axis| 0.5 * size.dot(axis));
            Face { reversed, ..Face::whole(plane(&frame, [[-a, a], [-b, b]])) }
        };
        (0..6).map(side).collect()
    }

    #[test]
    fn a_block_is_turned_but_nothing_without_sense() {
        for void in [false, true] {
            assert!(!is_inside_out(&block([1.0, 2.0, 3.0], void), void));
            assert!(is_inside_out(&block([1.0, 2.0, 3.0], !void), void));
            assert!(!is_inside_out(&[], void));
        }
        let mut odd = block([1.0, 1.0, 1.0], true);
        odd.iter_mut().take(3).for_each(|f| f.reversed = false);
        assert!(!is_inside_out(&odd, false), "no sense in it");
    }

    /// A tube of 3.6 mm with a wall of 0.1 mm, whose ends are rings that no grid hits well.
    #[test]
    fn a_thin_tube_is_turned() {
        let (radii, height) = ([3.6, 3.5], 10.0);
        let circle = |radius: f64, turn: f64| {
            let at = |k: usize| Uv::from_angle(turn + TAU * k as f64 / 24.0) * radius;
            let side = |k| EdgeUse { edge: None, reversed: false, uv: UvCurve::line(at(k), at(k + 1), [0.0, 1.0]) };
            TrimLoop { uses: (0..24).map(side).collect() }
        };
        let end = |z: f64| {
            let frame = Frame::translation(Vector::new(1.0, 2.0, z));
            let surface = plane(&frame, [[-5.0, 5.0], [-5.0, 5.0]]);
            let loops = vec![circle(radii[0], 0.1), circle(radii[1], 0.2)];
            Face { analytic: Analytic::Plane { frame }, loops, ..Face::whole(surface) }
        };
        let wall = |radius: f64| {
            let frame = Frame::translation(Vector::new(1.0, 2.0, 0.0));
            Face::whole(cylinder(&frame, radius, [0.0, TAU], [0.0, height]))
        };
        let reversed = |face: Face| Face { reversed: !face.reversed, ..face };
        let tube = vec![wall(radii[0]), reversed(wall(radii[1])), end(height), reversed(end(0.0))];
        let turned: Vec<Face> = tube.iter().cloned().map(reversed).collect();
        assert!(!is_inside_out(&tube, false) && is_inside_out(&turned, false));
        assert!(is_inside_out(&tube, true) && !is_inside_out(&turned, true));
    }

    fn reversed(face: &Face) -> Face {
        Face { reversed: !face.reversed, ..face.clone() }
    }

    /// A frame of 100 mm whose sides are 0.5 mm wide: its volume, 100² − 99² times the height, is 1.5 % of the sum of all terms.
    #[test]
    fn a_thin_frame_is_turned() {
        let height = 2.0;
        let walls = |size: f64, reversed: bool| block([size, size, height], reversed).into_iter();
        // Sides alone: those along z are the third and the last.
        let walls = |size: f64, reversed: bool| walls(size, reversed).enumerate().filter(|(k, _)| k % 3 != 2);
        let square = |size: f64| {
            let corner =
                |k: usize| 0.5 * size * Uv::new([-1.0, 1.0, 1.0, -1.0][k % 4], [-1.0, -1.0, 1.0, 1.0][k % 4]);
            let side = |k| EdgeUse {
                edge: None,
                reversed: false,
                uv: UvCurve::line(corner(k), corner(k + 1), [0.0, 1.0]),
            };
            TrimLoop { uses: (0..4).map(side).collect() }
        };
        let end = |z: f64| {
            let frame = Frame::translation(Vector::new(0.0, 0.0, z));
            let surface = plane(&frame, [[-60.0, 60.0], [-60.0, 60.0]]);
            let loops = vec![square(100.0), square(99.0)];
            Face { analytic: Analytic::Plane { frame }, loops, reversed: z < 0.0, ..Face::whole(surface) }
        };
        let mut frame: Vec<Face> = walls(100.0, false).chain(walls(99.0, true)).map(|(_, face)| face).collect();
        frame.extend([end(0.5 * height), end(-0.5 * height)]);
        let turned: Vec<Face> = frame.iter().map(reversed).collect();
        assert!(!is_inside_out(&frame, false) && is_inside_out(&turned, false));
        assert!(is_inside_out(&frame, true) && !is_inside_out(&turned, true));
        // One side turned alone: of the volume that is left the sign depends on where it is seen from.
        let mut twisted = turned;
        twisted[0] = reversed(&twisted[0]);
        twisted[4] = reversed(&twisted[4]);
        assert!(!is_inside_out(&twisted, false));
    }

    /// Two tubes in one place, one in one piece, the other in three, between which there is nothing.
    #[test]
    fn a_shell_without_thickness_stays_as_it_is() {
        let wall = |from: f64, to: f64| Face::whole(cylinder(&Frame::IDENTITY, 3.6, [from, to], [0.0, 10.0]));
        let pieces = [[0.0, 1.0], [1.0, 2.5], [2.5, TAU]].map(|[from, to]| reversed(&wall(from, to)));
        let shell: Vec<Face> = std::iter::once(wall(0.0, TAU)).chain(pieces).collect();
        let turned: Vec<Face> = shell.iter().map(reversed).collect();
        for void in [false, true] {
            assert!(!is_inside_out(&shell, void) && !is_inside_out(&turned, void));
        }
    }
}

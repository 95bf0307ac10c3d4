//! The model as the tracer sees it: placed faces in world orientation, cut into Bézier patches about centres of their own.

use super::edge::AT_VERTEX;
use super::net::{Jet, Net, V4};
use super::trim::Trim;
use super::uses::gaps_of;
use super::wide;
use crate::math::{FaceId, Frame, Point, Uv, Vector};
use crate::model::{Edge, Face, Model, Part, PlacedFace};
use crate::nurbs::{BezierPatch, Curve};
use rustc_hash::FxHashMap;

/// Gaps of a file wider than this are not bridged, but flagged, mm.
const MOST_GAP: f64 = 0.05;

/// One placed face.
#[derive(Debug)]
pub(super) struct FaceRecord {
    pub(super) id: FaceId,
    /// −1 where the outward normal is `-(Su × Sv)` in the world.
    pub(super) sign: f64,
    /// Index into [`Geometry::trims`].
    pub(super) trim: u32,
    /// First patch; patches of a face lie row by row in u.
    pub(super) first_patch: u32,
    /// Index into [`Geometry::grids`].
    pub(super) grid: u32,
    /// From the part to the world.
    pub(super) placement: Frame,
    /// Index into [`Geometry::edges`].
    pub(super) part: u32,
    /// Distance from a trim within which the side of the shared edge decides, mm.
    pub(super) band: f64,
    /// Largest distance from a trim within which a root is flagged, mm: as far as the faces of the file lie off their edges, and
    /// more for rays that graze them.
    pub(super) flagged: f64,
    /// Instance and shell, of faces of closed shells.
    pub(super) solid: Option<[u32; 2]>,
}

/// Break lines of a surface's patches.
#[derive(Debug)]
pub(super) struct PatchGrid {
    pub(super) breaks: [Vec<f64>; 2],
    /// Whether the surface closes on itself in u and in v.
    pub(super) closed: [bool; 2],
    /// Whether the side at the low and at the high end of u, and of v, is a single point.
    pub(super) poles: [[bool; 2]; 2],
}

/// A rational Bézier patch in world orientation.
#[derive(Debug)]
pub(super) struct Patch {
    /// Index into [`Geometry::faces`].
    pub(super) face: u32,
    pub(super) degree: [u8; 2],
    /// Control points about `center`, weight 1 in the middle of the patch.
    pub(super) net: Net,
    /// Error of the control points, and of derivatives got from them, mm.
    pub(super) rounding: f64,
    pub(super) center: Point,
    /// The rectangle of the surface's domain.
    pub(super) domain: [[f64; 2]; 2],
}

/// Everything but the search structure.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) faces: Vec<FaceRecord>,
    pub(super) patches: Vec<Patch>,
    pub(super) trims: Vec<Trim>,
    pub(super) grids: Vec<PatchGrid>,
    /// Edge curves of each part, in its own coordinates.
    pub(super) edges: Vec<Vec<Curve>>,
    /// The vertices at their ends, and how far from each its sectors decide, mm: beyond all ends that miss it.
    pub(super) ends: Vec<Vec<[(Point, f64); 2]>>,
    /// Smallest distance from a trim that is flagged, mm.
    pub(super) band: f64,
    /// Position in `faces` of each placed face that has a surface.
    pub(super) by_id: FxHashMap<FaceId, u32>,
    /// Placed faces left out: ready meshes, and surfaces with non-finite points or weights that are not positive.
    pub(super) skipped: Vec<FaceId>,
}

impl Geometry {
    pub(super) fn new(model: &Model, band: f64) -> Self {
        let curves = |part: &Part| part.edges.iter().map(|e| e.curve.clone()).collect();
        let mut geometry = Self {
            band,
            edges: model.parts.iter().map(curves).collect(),
            ends: model.parts.iter().map(ends_of).collect(),
            ..Self::default()
        };
        let gaps: Vec<Vec<f64>> = model.parts.iter().map(gaps_of).collect();
        // Instances share the trims and break lines of their part.
        let mut shared: FxHashMap<*const Face, (u32, u32)> = FxHashMap::default();
        for placed in model.placed_faces() {
            match placed.face {
                Some(face) if is_usable(face) => {
                    let (trim, grid) = *shared.entry(face as *const Face).or_insert_with(|| {
                        let grid = PatchGrid::new(face);
                        let gaps = &gaps[placed.part.0 as usize];
                        geometry.trims.push(Trim::new(face, grid.closed, band, gaps));
                        geometry.grids.push(grid);
                        (geometry.trims.len() as u32 - 1, geometry.grids.len() as u32 - 1)
                    });
                    let closed = |s: &usize| model.part(placed.part).shells[*s].closed;
                    let solid = placed.shell.filter(closed).map(|s| [placed.instance as u32, s as u32]);
                    geometry.place(&placed, face, (trim, grid), solid);
                }
                _ => geometry.skipped.push(placed.id),
            }
        }
        geometry
    }

    /// Distance from a trim within which a root is flagged, mm, where the faces along it lie so far off the edge.
    pub(super) fn flagged(&self, gap: f64, placement: &Frame) -> f64 {
        self.band.max(8.0 * gap * placement.scale)
    }

    fn place(&mut self, placed: &PlacedFace<'_>, face: &Face, (trim, grid): (u32, u32), solid: Option<[u32; 2]>) {
        let record = self.faces.len() as u32;
        let sign = if face.reversed != placed.placement.is_mirrored() { -1.0 } else { 1.0 };
        self.by_id.insert(placed.id, record);
        let first_patch = self.patches.len() as u32;
        let placement = *placed.placement;
        // A file's edge may lie off its faces by `gap`: both faces must look that far.
        let band = (self.band).max(2.0 * face.gap.min(MOST_GAP) * placement.scale);
        let flagged = self.flagged(self.trims[trim as usize].widest_gap(), &placement);
        let part = placed.part.0;
        self.faces.push(FaceRecord {
            id: placed.id,
            sign,
            trim,
            first_patch,
            grid,
            placement,
            part,
            band,
            flagged,
            solid,
        });
        self.patches.extend(face.surface.bezier_patches().iter().map(|p| Patch::new(p, record, placed)));
    }

    /// The patch of a face that holds the parameters.
    pub(super) fn patch_at(&self, face: &FaceRecord, uv: Uv) -> u32 {
        let grid = &self.grids[face.grid as usize];
        let span = |d: usize, x: f64| {
            let inner = &grid.breaks[d][1..grid.breaks[d].len() - 1];
            inner.partition_point(|&b| b <= x) as u32
        };
        face.first_patch + span(0, uv.x) * (grid.breaks[1].len() as u32 - 1) + span(1, uv.y)
    }
}

/// The vertices at the ends of a part's edges, with the radii within which their sectors decide.
fn ends_of(part: &Part) -> Vec<[(Point, f64); 2]> {
    let end = |e: &Edge, k: usize| e.curve.evaluate(e.curve.domain()[k]);
    let mut radii = vec![AT_VERTEX; part.vertices.len()];
    for (e, k) in part.edges.iter().flat_map(|e| [(e, 0), (e, 1)]) {
        let vertex = e.vertices[k].0 as usize;
        if let (Some(radius), Some(place)) = (radii.get_mut(vertex), part.vertices.get(vertex)) {
            *radius = radius.max((4.0 * end(e, k).distance(*place)).min(MOST_GAP));
        }
    }
    let place = |e: &Edge, k: usize| {
        let vertex = e.vertices[k].0 as usize;
        part.vertices.get(vertex).map_or((end(e, k), AT_VERTEX), |p| (*p, radii[vertex]))
    };
    part.edges.iter().map(|e| [place(e, 0), place(e, 1)]).collect()
}

/// Whether a surface can be traced at all.
fn is_usable(face: &Face) -> bool {
    let s = &face.surface;
    let [nu, nv] = s.counts();
    let ordered = s.knots.iter().all(|k| k.iter().all(|x| x.is_finite()) && k.is_sorted());
    let [[u0, u1], [v0, v1]] = s.domain();
    s.points.len() == nu * nv
        && s.degree.iter().all(|&d| (1..=crate::nurbs::MAX_DEGREE).contains(&d))
        && ordered
        && u0 < u1
        && v0 < v1
        && s.points.iter().all(|p| p.is_finite() && p.w > 0.0)
}

impl PatchGrid {
    fn new(face: &Face) -> Self {
        let s = &face.surface;
        let counts = s.counts();
        let breaks = [0, 1].map(|d| {
            let mut b = s.knots[d][s.degree[d]..=counts[d]].to_vec();
            b.dedup();
            b
        });
        let domain = s.domain();
        let tolerance = 1e-9 * (1.0 + s.bounds().diagonal());
        // Five points along the side at the low or high end of a parameter.
        let side = |d: usize, end: usize| -> [Point; 5] {
            std::array::from_fn(|k| {
                let along = domain[1 - d][0] + (domain[1 - d][1] - domain[1 - d][0]) * k as f64 / 4.0;
                let x = domain[d][end];
                s.evaluate(if d == 0 { Uv::new(x, along) } else { Uv::new(along, x) })
            })
        };
        let same = |a: &Point, b: &Point| a.distance(*b) <= tolerance;
        let closed = [0, 1].map(|d| side(d, 0).iter().zip(&side(d, 1)).all(|(a, b)| same(a, b)));
        let poles = [0, 1].map(|d| [0, 1].map(|end| side(d, end).iter().all(|p| same(p, &side(d, end)[0]))));
        Self { breaks, closed, poles }
    }
}

impl Patch {
    fn new(patch: &BezierPatch, face: u32, placed: &PlacedFace<'_>) -> Self {
        let middle = patch.homogeneous(Uv::splat(0.5))[0];
        // Shifting to the patch's own centre before placing keeps the shape exact far from the origin.
        let center = middle.project();
        let net: Net = patch
            .points
            .iter()
            .map(|p| {
                let w = p.w / middle.w;
                // Rounded once, so that neighbours still share their border when 1e6 mm are taken off both.
                let shifted = Vector::new(
                    f64::mul_add(-center.x, p.w, p.x),
                    f64::mul_add(-center.y, p.w, p.y),
                    f64::mul_add(-center.z, p.w, p.z),
                );
                let a = placed.placement.vector(shifted / middle.w);
                [a.x, a.y, a.z, w]
            })
            .collect();
        let size = net.iter().map(|p: &V4| p[0].abs().max(p[1].abs()).max(p[2].abs()) / p[3]).fold(0.0, f64::max);
        Self {
            face,
            degree: patch.degree.map(|d| d as u8),
            rounding: 16.0 * f64::EPSILON * size,
            net,
            center: placed.placement.point(center),
            domain: patch.domain,
        }
    }

    /// Local parameters of surface parameters.
    pub(super) fn local(&self, uv: Uv) -> [f64; 2] {
        let [[u0, u1], [v0, v1]] = self.domain;
        [(uv.x - u0) / (u1 - u0), (uv.y - v0) / (v1 - v0)]
    }

    /// Surface parameters of local parameters.
    pub(super) fn uv(&self, [u, v]: [f64; 2]) -> Uv {
        let [[u0, u1], [v0, v1]] = self.domain;
        Uv::new(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v)
    }

    /// Homogeneous point about the centre, and derivatives.
    pub(super) fn jet(&self, [u, v]: [f64; 2]) -> Jet {
        wide::evaluate(&self.net, self.degree, u, v)
    }
}

/// Position about the centre and first derivatives of a homogeneous jet.
#[inline(always)]
pub(super) fn project(jet: &Jet) -> (Vector, Vector, Vector) {
    let inv = 1.0 / jet.s[3];
    let xyz = |a: &V4| Vector::new(a[0], a[1], a[2]);
    let p = xyz(&jet.s) * inv;
    (p, (xyz(&jet.su) - p * jet.su[3]) * inv, (xyz(&jet.sv) - p * jet.sv[3]) * inv)
}

/// Unit normal along `Su × Sv` at local parameters; at a singular point the limit from the middle of the net.
///
/// `rounding` is the error of the net's points. A derivative must be a million times longer to be trusted: 1e-9 mm from
/// the pole of a sphere of radius 50 the normal was off by 1e-5 rad otherwise.
pub(super) fn normal(net: &[V4], degree: [u8; 2], [u, v]: [f64; 2], jet: &Jet, rounding: f64) -> Vector {
    let (_, du, dv) = project(jet);
    let n = du.cross(dv);
    let shortest = 1e6 * rounding;
    let clear = |du: Vector, dv: Vector| du.length_squared().min(dv.length_squared()) > shortest * shortest;
    if clear(du, dv) && n.length_squared() > 1e-18 * du.length_squared() * dv.length_squared() {
        let ratio = du.length_squared() / dv.length_squared();
        if ratio > 1e-18 && ratio < 1e18 {
            return n.normalize();
        }
    }
    // Where a derivative vanishes the normal is the limit; 1e-6 of the net away it is right to about 1e-6 rad.
    for (step, last) in [(1e-6, false), (1e-4, false), (1e-2, false), (1e-2, true)] {
        let toward = |x: f64| x + step * (0.5 - x);
        let (_, du, dv) = project(&wide::evaluate(net, degree, toward(u), toward(v)));
        let n = du.cross(dv);
        if (last || clear(du, dv)) && n.length() > 1e-12 * du.length() * dv.length() {
            return n.normalize();
        }
    }
    Vector::Z
}

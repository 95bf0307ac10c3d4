//! The same question by pure clipping, in code that shares nothing with the fast path: what the fast path is tested against.
//!
//! Every Bézier patch of every face, halved a few times where that makes its boxes smaller, is clipped as in Nishita, Sederberg and
//! Kakimoto, SIGGRAPH 1990: the signed distances of the control points to a line in the projection along the ray bound each parameter by
//! the convex hull of (parameter, distance). What clipping shrinks by less than a fifth is halved, until the box holds a single root or
//! is as small as rounding. Trims are decided by crossings of a half-line towards +v with the uv curves, halved until their hulls decide.
//!
//! Guarantee: none is claimed near tangency, at singular points and within about 1e-9 mm of trims; there it reports what it
//! finds. Where a patch took all of its steps it says from which distance on crossings may be missing. Known weakness: slow,
//! about a hundredth of the fast path's rate.

mod boxes;
mod clip;
mod hit;
mod net;
mod single;

use crate::math::{Aabb, FaceId, Ray, Uv};
use crate::model::{Model, TrimLoop};
use crate::nurbs::BezierPatch;
use boxes::Boxes;
use clip::{PatchClipping, View};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

pub use hit::AuditHit;

/// Share of a face's domain below which the signed area of its loops is rounding.
const NO_AREA: f64 = 1e-12;

/// Every patch of a model, to be clipped against rays.
#[derive(Debug)]
pub struct Audit {
    faces: Vec<AuditFace>,
    /// Pieces of patches, with the position of their face.
    pieces: Vec<(u32, BezierPatch)>,
    boxes: Boxes,
}

/// A face with its trims as Bézier pieces.
#[derive(Debug)]
struct AuditFace {
    id: FaceId,
    domain: [[f64; 2]; 2],
    trims: Vec<TrimPiece>,
    /// Whether the loops run clockwise: holes in a domain that counts otherwise.
    holes_alone: bool,
}

/// A Bézier piece of a uv curve and a box around it.
#[derive(Debug)]
struct TrimPiece {
    lo: DVec2,
    hi: DVec2,
    points: Vec<DVec3>,
}

/// The crossings that clipping found along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditAnswer {
    /// The first crossing in `[t_min, t_max]`.
    pub first: Option<AuditHit>,
    /// Whether the first crossing, or that there is none, is beyond doubt.
    pub decided: bool,
}

/// Distance by which a crossing counts as one with another at most, mm: a tangency of radius 1 mm is a thousandth of it deep.
const CLUSTER: f64 = 1e-4;
/// Crossings nearer than this that are beyond doubt are one, found from two boxes, mm.
const SAME_CROSSING: f64 = 1e-9;
/// Crossings nearer than this are one that rounding smears, or a grazing pair, mm; and one this near to the start is the point that
/// the ray leaves.
const SMEARED: f64 = 1e-7;
/// What halving must leave of a patch's box to be worth it.
const SMALLER: f64 = 0.8;
/// How often a piece of a trim is halved: below an ulp.
const DEEPEST_TRIM: u32 = 48;

impl Audit {
    /// Prepares every placed face that has a surface; ready meshes are left out. Surfaces must be finite and positive in weight.
    pub fn new(model: &Model) -> Self {
        let (mut faces, mut pieces) = (Vec::new(), Vec::new());
        for placed in model.placed_faces() {
            let Some(face) = placed.face else { continue };
            let surface = face.surface.transformed(|p| placed.placement.point(p));
            for patch in surface.bezier_patches() {
                split(patch, faces.len() as u32, &mut pieces);
            }
            let domain = face.surface.domain();
            let domain_area = (domain[0][1] - domain[0][0]) * (domain[1][1] - domain[1][0]);
            faces.push(AuditFace {
                id: placed.id,
                domain,
                trims: trims(&face.loops),
                // Along whole curves, where the tracer goes by its own pieces: a fault in one of the two does not hide in the other.
                // That of lobes that cancel is rounding.
                holes_alone: face.loops.iter().map(TrimLoop::signed_area).sum::<f64>() < -NO_AREA * domain_area,
            });
        }
        let boxes: Vec<Aabb> = pieces.iter().map(|(_, p)| p.bounds()).collect();
        Self { faces, pieces, boxes: Boxes::new(&boxes) }
    }

    /// Finds the first crossing in `[t_min, t_max]`, in the model's coordinates; crossings of the face that the ray leaves within 1e-7 mm
    /// of its origin are left out.
    pub fn first(&self, ray: &Ray) -> AuditAnswer {
        let mut met = Vec::new();
        self.boxes.intersected(ray, &mut met);
        let view = View::new(ray);
        // By face, in order of the boxes in which they were found.
        let mut found: Vec<(u32, SmallVec<[AuditHit; 8]>)> = Vec::new();
        let mut first: Option<AuditHit> = None;
        let mut exhausted = f64::INFINITY;
        // Boxes come in the order in which they are entered: once one begins behind the first crossing, all others
        // do.
        for (near, piece) in met {
            // Nothing beyond is a crossing before the first, nor one with it.
            if first.is_some_and(|f| near > f.t + 2.0 * CLUSTER) {
                break;
            }
            let (face, patch) = &self.pieces[piece as usize];
            let AuditFace { id, domain, .. } = self.faces[*face as usize];
            let mut own: SmallVec<[AuditHit; 8]> = SmallVec::new();
            let unsearched = PatchClipping::new((ray, &view), id, patch, domain).search(&mut own);
            if unsearched <= ray.t_max {
                exhausted = exhausted.min(unsearched);
            }
            // Before crossings are taken for one: a surface of more than one turn covers itself, and its trims choose.
            own.retain(|h| self.faces[*face as usize].holds(h.uv));
            if own.is_empty() {
                continue;
            }
            match found.iter_mut().find(|(f, _)| f == face) {
                Some((_, all)) => all.extend(own),
                None => found.push((*face, own)),
            }
            let firsts = found.iter().filter_map(|(f, all)| self.faces[*f as usize].first(ray, all.clone()));
            first = firsts.min_by(|a, b| a.t.total_cmp(&b.t));
        }
        let decided = match first {
            Some(hit) => !hit.doubtful && hit.t < exhausted,
            None => exhausted == f64::INFINITY,
        };
        AuditAnswer { first, decided }
    }
}

/// Halves a patch as long as its pieces fill boxes much smaller than its own, and adds the pieces to `out` with the index of their face.
fn split(patch: BezierPatch, face: u32, out: &mut Vec<(u32, BezierPatch)>) {
    let mut stack = vec![(patch, 0)];
    while let Some((patch, depth)) = stack.pop() {
        // Looser boxes are met by more rays, and clipping costs far more than one more level.
        let whole = patch.bounds().half_area();
        let smaller = |halves: &[BezierPatch; 2]| halves.iter().map(|h| h.bounds().half_area()).sum::<f64>();
        let best = (depth < DEPTH)
            .then(|| [0, 1].map(|d| patch.halves(d)))
            .and_then(|both| both.into_iter().min_by(|a, b| smaller(a).total_cmp(&smaller(b))));
        match best {
            Some(halves) if smaller(&halves) < SMALLER * whole => stack.extend(halves.map(|h| (h, depth + 1))),
            _ => out.push((face, patch)),
        }
    }
}

/// How often a patch is halved at most before any ray comes.
const DEPTH: u32 = 6;

/// The Bézier pieces of every loop, in homogeneous surface parameters; ends of uses are joined by straight pieces, so that parity has
/// one meaning.
fn trims(loops: &[TrimLoop]) -> Vec<TrimPiece> {
    let mut out = Vec::new();
    let mut add = |points: Vec<DVec3>| {
        let (lo, hi) = hull_corners(&points);
        out.push(TrimPiece { lo, hi, points });
    };
    for l in loops {
        let uses: Vec<(bool, Vec<Vec<DVec3>>)> = l
            .uses
            .iter()
            .map(|u| (u.reversed, u.uv.bezier_pieces().into_iter().map(|p| p.to_vec()).collect()))
            .collect();
        let end = |(reversed, pieces): &(bool, Vec<Vec<DVec3>>), last: bool| {
            let at = if *reversed != last { pieces.last()?.last()? } else { pieces.first()?.first()? };
            Some(at.truncate() / at.z)
        };
        for (k, this) in uses.iter().enumerate() {
            if let (Some(from), Some(to)) = (end(this, true), end(&uses[(k + 1) % uses.len()], false)) {
                add(vec![from.extend(1.0), to.extend(1.0)]);
            }
        }
        uses.into_iter().flat_map(|(_, pieces)| pieces).for_each(&mut add);
    }
    out
}

/// Lower and upper corner of the box around homogeneous control points of a uv curve.
fn hull_corners(points: &[DVec3]) -> (DVec2, DVec2) {
    points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| {
        let at = p.truncate() / p.z;
        (lo.min(at), hi.max(at))
    })
}

impl AuditFace {
    /// The first crossing in the range of the ray of those found on the face, taking those for one that lie close to each other; which then
    /// may be doubtful.
    fn first(&self, ray: &Ray, mut own: SmallVec<[AuditHit; 8]>) -> Option<AuditHit> {
        own.sort_by(|a, b| a.t.total_cmp(&b.t));
        // Boxes that share a border, and clusters around a tangency, find the same crossing several times.
        own.dedup_by(|b, a| {
            let same = b.t - a.t < if a.doubtful || b.doubtful { CLUSTER } else { SAME_CROSSING };
            a.doubtful |= same && b.doubtful;
            same
        });
        // Crossings that come down to boxes side by side are one that rounding smears, or a grazing pair.
        let smeared = |a: &AuditHit, b: &AuditHit| b.t - a.t < SMEARED;
        for k in 1..own.len() {
            if smeared(&own[k - 1], &own[k]) {
                own[k - 1].doubtful = true;
                own[k].doubtful = true;
            }
        }
        own.into_iter().find(|h| {
            let leaving = ray.departure.is_some_and(|f| f.face == h.face && h.t.abs() < SMEARED);
            !leaving && h.t >= ray.t_min && h.t <= ray.t_max
        })
    }

    /// Whether a point of the domain lies inside the trims: an odd number of crossings above it, or an even one where there are holes
    /// alone.
    fn holds(&self, q: Uv) -> bool {
        // Towards +v, where the tracer looks towards +u: a fault in one of the two does not hide in the other.
        if self.trims.is_empty() {
            return true;
        }
        let near = self.trims.iter().filter(|t| q.x >= t.lo.x && q.x < t.hi.x && q.y <= t.hi.y);
        (near.map(|t| crossings_above(&t.points, q, 0)).sum::<u32>() % 2 == 1) != self.holes_alone
    }
}

/// How often a Bézier piece of a uv curve crosses the half-line from `q` towards +v; `depth` counts the halvings so far.
fn crossings_above(points: &[DVec3], q: DVec2, depth: u32) -> u32 {
    let at = |p: &DVec3| p.truncate() / p.z;
    let (first, last) = (at(&points[0]), at(&points[points.len() - 1]));
    let (lo, hi) = hull_corners(points);
    // A half-line upward misses what lies to one side of it or below its start.
    if q.x < lo.x || q.x >= hi.x || q.y > hi.y {
        return 0;
    }
    // Half open in u, so that the joint of two pieces counts for one of them alone.
    let spans = u32::from((first.x <= q.x) != (last.x <= q.x));
    if q.y < lo.y {
        // All of it lies above: only the ends count.
        return spans;
    }
    // So short that its chord stands for it.
    if depth > DEEPEST_TRIM || points.len() == 2 {
        let v = first.y + (last.y - first.y) * (q.x - first.x) / (last.x - first.x);
        return if v > q.y { spans } else { 0 };
    }
    let n = points.len() - 1;
    let (mut low, mut w) = (Vec::with_capacity(n + 1), points.to_vec());
    // De Casteljau at one half: the first entry of every row is the lower half's net, what remains in `w` the upper one's.
    for r in 0..=n {
        low.push(w[0]);
        for k in 0..n - r {
            w[k] = 0.5 * (w[k] + w[k + 1]);
        }
    }
    crossings_above(&low, q, depth + 1) + crossings_above(&w, q, depth + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_crossed_where_it_should_be() {
        // (t, t²) for t in [-1, 1].
        let points = [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(0.0, -1.0, 1.0), DVec3::new(1.0, 1.0, 1.0)];
        assert_eq!(crossings_above(&points, DVec2::new(0.5, 0.2499999999), 0), 1);
        assert_eq!(crossings_above(&points, DVec2::new(0.5, 0.2500000001), 0), 0);
        assert_eq!(crossings_above(&points, DVec2::new(1.5, 0.0), 0), 0);
    }
}

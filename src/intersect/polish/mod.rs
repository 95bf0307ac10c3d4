//! Facet hits moved to the spline: exact position, normal and parameters for a small surcharge.
//!
//! A facet hit carries the parameters of its place on the surface; Newton's method takes three or four steps from there, for eight hits
//! at a time. The root that the ray leaves is recognised by face, parameters and place, and the search goes on behind it.
//!
//! The spline itself is queried where the facets may mislead: for a ray that leaves its surface so flat that its next root hides inside
//! the sag, that starts between a face and its facets, or that is short; for a facet hit without a root nearby, inside
//! the trims and crossed the same way; and for an answer that cannot be, because a ray that goes into a closed solid comes out of it, and
//! the other way round. Without that a rod of 1 × 50 mm lost 8 % of its light and a ring 11 %.
//!
//! Guarantee: a hit marked [`Certainty::Polished`] lies on the spline within 1e-9 mm; any other is the spline's own answer, or of a ready
//! mesh. Known weakness: it starts from the facets, so a silhouette that they miss stays missed: polishing is never a check.

mod batch;
mod clear_start;
mod curved_cells;
mod facet_naming;
mod facet_record;
mod limits;
mod piece;
mod slab_map;
mod slabs;
mod start;

#[cfg(doc)]
use super::Certainty;
use super::exact::{Exact, SurfacePoint};
use super::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::{Departure, Ray};
use crate::mesh::FacetMesh;
use clear_start::ClearStart;
use curved_cells::CurvedCells;
use facet_record::FacetRecord;
use limits::{OWN_POINT, SHORT_OF_SAGS};
use piece::Piece;
use slabs::Slabs;
use std::sync::{PoisonError, RwLock};

/// A root within [`OWN_POINT`] is the point that the ray leaves where it lies this near to it, mm (on patches below a millimetre this share
/// of their size), beside [`OWN_ROUNDING`].
const SAME_POINT: f64 = 1e-7;
/// Ulps of its largest coordinate that a ray's origin may be off.
const OWN_ROUNDING: f64 = 64.0;
/// How many times as far along the ray as across it such an origin moves its own root: it leaves at a sine of at least a thousandth.
const OWN_GRAZING: f64 = 1e3;
/// The primitive of a hit of which no facet is known.
const NO_FACET: u32 = u32::MAX;
/// Sag assumed where none was proved, mm.
const UNPROVED_SAG: f64 = 0.2;
/// Places that a ray leaves by a facet lie up to so many of the largest sags off it, unless it came in flat.
const REACH_OF_SAGS: f64 = 4.0;

/// An intersector whose hits lie on the spline.
///
/// ```
/// use lampyris::intersect::exact::{self, Exact};
/// use lampyris::intersect::octree::{self, Octree};
/// use lampyris::intersect::polish::Polished;
/// use lampyris::intersect::{Cost, Intersector};
/// use lampyris::math::{Frame, Point, Ray, Vector};
/// use lampyris::model::{Face, Model, Part, Shell};
/// use lampyris::{nurbs::sweep, tessellate};
/// use std::f64::consts::PI;
///
/// let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]));
/// let shell = Shell { faces: vec![ball], closed: true, ..Shell::default() };
/// let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
/// let made = tessellate::tessellate(&model, &tessellate::Settings::uniform(0.1));
/// let octree = Octree::build(&made.mesh, &octree::Settings::default());
/// let exact = Exact::build(&model, &exact::Settings::default());
/// let polished = Polished::new(&octree, &made.mesh, &exact);
///
/// // Facets are up to 0.1 mm off the ball, polished hits lie on it.
/// let ray = Ray::new(Point::new(3.0, 4.0, 30.0), -Vector::Z);
/// let truth = 30.0 - (100.0f64 - 25.0).sqrt();
/// let distance = |who: &dyn Intersector| who.intersect(&ray, &mut Cost::default()).unwrap().t;
/// assert!((distance(&octree) - truth).abs() < 0.15 && (distance(&polished) - truth).abs() < 1e-9);
/// ```
pub struct Polished<'a> {
    facets: &'a dyn Intersector,
    mesh: &'a FacetMesh,
    exact: &'a Exact,
    /// Largest sag of any facet, mm: at least [`UNPROVED_SAG`] where one was not proved.
    sag: f64,
    /// Of every facet.
    records: Vec<FacetRecord>,
    /// Of every facet.
    pieces: Vec<Piece>,
    /// Where facets of other faces are near.
    slabs: Slabs,
    /// Where facets off the spline are near.
    curved: CurvedCells,
    /// Of the sources whose rays are expected.
    clear_starts: RwLock<Vec<ClearStart>>,
}

impl<'a> Polished<'a> {
    /// Wraps `facets`, an intersector over `mesh`, which must be made of the model that `exact` was built from: faces are identified by
    /// their number. Its normal mode counts for hits on ready meshes alone.
    pub fn new(facets: &'a dyn Intersector, mesh: &'a FacetMesh, exact: &'a Exact) -> Self {
        let proved = mesh.sag.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let sag = if mesh.sag.iter().any(|s| !s.is_finite()) || mesh.sag.is_empty() {
            proved.max(UNPROVED_SAG)
        } else {
            proved
        };
        let records = FacetRecord::of_mesh(mesh, exact, sag);
        let curved = CurvedCells::of_mesh(mesh, &records, 2.0 * sag);
        let slabs = Slabs::of_mesh(mesh, &records, REACH_OF_SAGS * sag);
        let pieces = (0..mesh.facets.len()).map(|f| Piece::of_facet(mesh, f)).collect();
        Self { facets, mesh, exact, sag, records, pieces, slabs, curved, clear_starts: RwLock::default() }
    }

    /// Answers rays on the spline and on ready meshes, which have none: overwrites `hits`, makes it as long as `rays`, and counts each ray
    /// once. A hit on the spline names its face but no facet ([`NO_FACET`]).
    fn trace_spline(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>, cost: &mut Cost) {
        hits.clear();
        hits.resize(rays.len(), None);
        cost.doubtful += rays.len() as u64;
        match (rays, &mut hits[..]) {
            // The same bits, without the memory of a batch: surfaces that touch are probed ray by ray.
            ([ray], [hit]) => *hit = self.exact.intersect(ray, cost),
            _ => self.exact.intersect_batch(rays, hits, cost),
        }
        hits.iter_mut().flatten().for_each(|hit| hit.primitive = NO_FACET);
        if !self.exact.skipped().is_empty() {
            for (ray, hit) in rays.iter().zip(hits.iter_mut()) {
                let end = hit.map_or(ray.t_max, |hit| hit.t);
                *hit = self.first_on_meshes(&ray.with_range(ray.t_min, end), cost).or(*hit);
            }
        }
    }

    /// The first hit of a ray on a face that the spline leaves out; the ray is not counted.
    fn first_on_meshes(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut own = Cost::default();
        let mut rest = *ray;
        let found = loop {
            let hit = self.facets.intersect(&rest, &mut own);
            match hit {
                // Just past the facet, or it would be found again.
                Some(hit) if self.exact.traces(hit.face) => rest.t_min = hit.t.next_up(),
                found => break found,
            }
        };
        *cost += Cost { rays: 0, ..own };
        found
    }
}

impl Intersector for Polished<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        // As a batch of one: a ray alone and among others has the same bits.
        let mut hit = [None];
        self.polish_batch(std::slice::from_ref(ray), &mut hit, cost);
        hit[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        self.polish_batch(rays, hits, cost);
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        let clear = ClearStart::of_expected(expected, self.mesh, 2.0 * self.sag);
        *self.clear_starts.write().unwrap_or_else(PoisonError::into_inner) = clear;
        self.facets.prepare_for(&ExpectedRays { sag: self.sag, ..*expected });
    }

    #[inline]
    fn escapes(&self, ray: &Ray) -> bool {
        let Some(from) = &ray.departure else { return false };
        let Some(record) = self.records.get(from.primitive as usize).filter(|r| r.face == from.face) else {
            return false;
        };
        // A root lies beside its facet's piece of the spline where the ray that found it came in flat. What would be traced on the spline
        // is left to it, so that how many these are does not depend on what was prepared.
        record.decisive_sine(ray).is_some_and(|sine| sine > 0.0)
            && self.pieces[from.primitive as usize].contains(from.uv)
            && ray.t_max - ray.t_min > SHORT_OF_SAGS * self.sag
            && !self.slabs.meet(self.mesh, from.primitive, [ray.point_at(ray.t_min); 2])
            && self.facets.escapes_spline(ray, self.sag)
    }

    fn footprint(&self) -> Footprint {
        let (a, b) = (self.facets.footprint(), self.exact.footprint());
        Footprint {
            bytes: a.bytes
                + b.bytes
                + size_of_val(&*self.records)
                + size_of_val(&*self.pieces)
                + self.slabs.bytes()
                + self.curved.bytes(),
            primitives: a.primitives,
            build_seconds: a.build_seconds + b.build_seconds,
        }
    }
}

/// Whether a root on the face that the ray leaves is the very point it leaves: no distance along the ray, the same place. That the
/// faces are the same is up to the caller.
fn is_own(exact: &Exact, from: &Departure, ray: &Ray, point: &SurfacePoint) -> bool {
    // Farther away it is another root on patches of any size.
    if point.t.abs() > OWN_POINT {
        return false;
    }
    let Some(size) = exact.patch_size(from.face, from.uv) else { return false };
    // A chord of a tenth of a micrometre is the width of a part of that size.
    let share = size.min(1.0);
    let rounding = OWN_ROUNDING * f64::EPSILON * ray.origin.abs().max_element();
    // By parameters where they are regular, by place across a seam or at a pole.
    point.t.abs() <= share * OWN_POINT + OWN_GRAZING * rounding
        && (exact.distance_at(from.face, from.uv, ray.point_at(point.t)))
            .is_some_and(|d| d <= share * SAME_POINT + rounding)
}

//! Facet hits moved to the spline: exact position, normal and parameters for a small surcharge.
//!
//! A facet hit carries the parameters of its place on the surface; Newton's method takes three or four steps from there, for eight hits
//! at a time, and across patches where a hit is asked alone. What the facets mislead about is put right. A root outside the trims, or
//! none, is sought in a short window of the ray on the exact model. The root that the ray leaves is recognised by face, parameters and
//! place, and the search goes on behind it. A ray that leaves its own surface so flat that its next root hides inside the sag is asked
//! exactly. A ray that goes into a closed solid must come out of it, and the other way round: an answer that says otherwise, as beside an
//! edge where the spline stands out over the facets of both faces, is asked exactly. Without that, and with roots just behind the exact
//! window of a flat ray passed over, a rod of 1 × 50 mm lost 8 % of its light and a ring 11 %.
//!
//! Guarantee: a hit marked [`Certainty::Polished`] lies on the spline within 1e-9 mm. Known weakness: it starts from the
//! facets, so a silhouette that they miss stays missed: polishing is never a check. Hits that find no root fall back to the facet
//! and are counted in [`Cost::fallbacks`].

mod batch;
mod clear_start;
mod curved_cells;
mod facet_record;
mod limits;
mod piece;
mod solids;

use super::exact::{Exact, SurfacePoint};
use super::{Certainty, Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::{Departure, Ray, Vector};
use crate::mesh::FacetMesh;
use clear_start::ClearStart;
use curved_cells::CurvedCells;
use facet_record::FacetRecord;
use limits::{
    HIDDEN_BELOW, LEAST_SLACK_SINE, LEAST_WINDOW_SINE, OWN_POINT, SHORT_OF_SAGS, WINDOW_OF_SAGS, least_window,
    no_sag,
};
use piece::Piece;
use std::sync::{PoisonError, RwLock};

/// Newton steps before the exact window is asked: residual p99 1e-11 after three on a sphere at 0.05 mm.
const STEPS: u32 = 6;
/// Size of a facet that is not known, in sags: of a sphere's facets of a twelfth of its radius.
const UNKNOWN_SIZE: f64 = 10.0;
/// Such a root is sought over so many lengths of the facet.
const HIDDEN_LENGTHS: f64 = 4.0;
/// And it is when it lies this near to it, mm, or by this share of its patch on smaller ones, beside [`OWN_ROUNDING`].
const SAME_POINT: f64 = 1e-7;
/// Ulps of its largest coordinate that a ray's origin may be off.
const OWN_ROUNDING: f64 = 64.0;
/// How many times as far along the ray as across it such an origin moves its own root: it leaves at a sine of at least a thousandth.
const OWN_GRAZING: f64 = 1e3;
/// Facets without a root that a search passes before it gives up.
const MOST_FACETS: usize = 64;
/// Facets that a search from outside passes where the spline has nothing.
const MOST_OUTSIDE: usize = 8;
/// The primitive of a hit that the spline alone knows.
const NO_FACET: u32 = u32::MAX;
/// Sag assumed where none was proved, mm.
const UNPROVED_SAG: f64 = 0.2;

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
    /// Where facets off the spline are near.
    curved: CurvedCells,
    /// Of the sources whose rays are expected.
    clear_starts: RwLock<Vec<ClearStart>>,
}

/// What became of a facet hit.
enum Polishing {
    Hit(Hit),
    /// It is the point that the ray leaves, or out of the ray's range: look behind it.
    Behind,
    /// No root nearby.
    Lost,
}

impl<'a> Polished<'a> {
    /// Wraps `facets`, an intersector over `mesh`, which must be made of the model that `exact` was built from: faces are told by their
    /// number. Its normal mode counts for hits alone that fall back to the facet.
    pub fn new(facets: &'a dyn Intersector, mesh: &'a FacetMesh, exact: &'a Exact) -> Self {
        let proved = mesh.sag.iter().copied().filter(|s| s.is_finite()).fold(0.0, f64::max);
        let sag = if mesh.sag.iter().any(|s| !s.is_finite()) || mesh.sag.is_empty() {
            proved.max(UNPROVED_SAG)
        } else {
            proved
        };
        let records = FacetRecord::of_mesh(mesh, exact, sag);
        let curved = CurvedCells::of_mesh(mesh, &records, 2.0 * sag);
        let pieces = (0..mesh.facets.len()).map(|f| Piece::of_facet(mesh, f)).collect();
        Self { facets, mesh, exact, sag, records, pieces, curved, clear_starts: RwLock::default() }
    }

    /// The proved sag of a facet, mm, or the largest of the mesh where there is none or no such facet.
    fn sag_of(&self, facet: u32) -> f64 {
        self.mesh.sag.get(facet as usize).copied().filter(|s| s.is_finite()).unwrap_or(self.sag)
    }

    /// The distance, mm, up to which the next root of a ray may hide between the surface it leaves and the facets there; `None` where the
    /// ray rises too steeply for that, or the facet lies on the spline. `normal` is the spline's where it leaves.
    ///
    /// On a surface of curvature κ a ray at angle θ stays within `sin²θ / 2κ` of it; a facet of length L has sag κL²/8.
    fn hidden_range(&self, ray: &Ray, from: &Departure, normal: Vector) -> Option<f64> {
        let facet = from.primitive as usize;
        let known = self.mesh.facets.get(facet).is_some_and(|f| f.face == from.face);
        let (length, sag) = if known {
            let [a, b, c, d] = self.mesh.corners(facet);
            let length = a.distance(b).max(b.distance(c)).max(c.distance(d)).max(d.distance(a));
            (length, self.sag_of(from.primitive))
        } else {
            (UNKNOWN_SIZE * self.sag, self.sag)
        };
        let sine = normal.dot(ray.direction).abs();
        (sag > no_sag(length) && sine * length < HIDDEN_BELOW * sag).then_some(HIDDEN_LENGTHS * length)
    }

    /// The distance along the ray, mm, up to which the facet hit may be a neighbour of the one left: twice its longer diagonal.
    fn neighbour_distance(&self, hit: &Hit) -> f64 {
        let [a, b, c, d] = self.mesh.corners(hit.primitive as usize);
        2.0 * a.distance(c).max(b.distance(d))
    }

    /// Moves one facet hit to the spline: by Newton steps from its parameters, or where they do not find the root that the facet stands
    /// for, by the exact model in a window around it.
    fn polish(&self, ray: &Ray, facet_hit: &Hit) -> Polishing {
        let sag = f64::from(self.records[facet_hit.primitive as usize].sag);
        let sine = facet_hit.geometric_normal.dot(ray.direction).abs();
        // A facet lies up to its sag off the spline: along a slanting ray that is sag over sine.
        let window = (WINDOW_OF_SAGS * sag / sine.max(LEAST_WINDOW_SINE)).max(least_window(sag));
        let found = self.exact.converge(ray, facet_hit.face, facet_hit.uv, STEPS);
        let nearby = found.filter(|p| (p.t - facet_hit.t).abs() <= window);
        let own = |p: &SurfacePoint| {
            ray.departure.is_some_and(|f| f.face == facet_hit.face && is_own(self.exact, &f, ray, p))
        };
        // Of two roots close by Newton's method may find the one that the ray crosses the other way.
        let turned =
            |p: &SurfacePoint| p.normal.dot(ray.direction) * facet_hit.geometric_normal.dot(ray.direction) <= 0.0;
        if let Some(point) = nearby.filter(|p| p.inside && (own(p) || !turned(p))) {
            if own(&point) || point.t < ray.t_min || point.t > ray.t_max {
                return Polishing::Behind;
            }
            return Polishing::Hit(Hit {
                t: point.t,
                normal: point.normal,
                geometric_normal: point.normal,
                uv: point.uv,
                certainty: Certainty::Polished,
                ..*facet_hit
            });
        }
        // Over an edge, at a silhouette, or in a corner of several roots: the exact model decides in a window around.
        let around = ray.with_range(ray.t_min.max(facet_hit.t - window), ray.t_max.min(facet_hit.t + window));
        if around.t_min > around.t_max {
            return Polishing::Behind;
        }
        let answer = self.exact.first(&around, &mut Cost::default());
        match answer.hit {
            // It keeps the facet, by which a ray that leaves from here is known.
            Some(hit) => {
                let Hit { primitive, triangle, .. } = *facet_hit;
                Polishing::Hit(Hit { primitive, triangle, certainty: Certainty::Polished, ..hit })
            }
            // A silhouette of the facets that the spline does not have. Where the surface goes on beyond its trims, faces gape.
            None if answer.certainty == Certainty::Certified
                && self.exact.traces(facet_hit.face)
                && nearby.is_none_or(|p| p.t < ray.t_min || turned(&p)) =>
            {
                Polishing::Behind
            }
            None => Polishing::Lost,
        }
    }

    /// The nearest root of a ray that leaves no face. Where it would first come out of a closed solid the spline is asked, and then up to
    /// [`MOST_OUTSIDE`] facets are passed; `None` for a miss or after these. Counts one ray.
    fn search_from_outside(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut answer = self.search_by_facets(ray, None, cost);
        let counted = cost.rays;
        if !self.comes_out(ray, answer.as_ref()) {
            return answer;
        }
        if let Some(hit) = self.ask_spline(ray) {
            return Some(hit);
        }
        // A facet where the spline is not; ready meshes may stand behind it.
        for _ in 0..MOST_OUTSIDE {
            // Just past the facet, or it would be found again.
            let behind = ray.with_range(answer?.t.next_up(), ray.t_max);
            answer = self.search_by_facets(&behind, None, cost);
            // However often facets were asked, it was one ray.
            cost.rays = counted;
            if !self.comes_out(ray, answer.as_ref()) {
                return answer;
            }
        }
        None
    }

    /// Returns the first hit of the spline within the ray's range, apart from the point that the ray leaves; marked
    /// [`Certainty::Polished`] whatever the exact model proved, and not counted in any cost. It names its face but no facet ([`NO_FACET`]),
    /// for a ray that leaves a named facet could not meet it again.
    fn ask_spline(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.exact.first(ray, &mut Cost::default()).hit?;
        Some(Hit { primitive: NO_FACET, certainty: Certainty::Polished, ..hit })
    }

    /// Returns the nearest root that facets along the ray lead to; where a facet leads to none, its own hit, counted in [`Cost::fallbacks`]
    /// unless its face has no spline. `None` for a miss, and after [`MOST_FACETS`] facets without an answer.
    ///
    /// `left` is what the ray leaves and the spline's normal there: a flat start is answered by the exact model first, with
    /// [`NO_FACET`] as its primitive. Whether the answer fits the inside of solids is not asked. Counts one ray.
    fn search_by_facets(&self, ray: &Ray, left: Option<(&Departure, Vector)>, cost: &mut Cost) -> Option<Hit> {
        let mut ray = *ray;
        // The spline may lie ahead of an origin whose facet lies behind it; a facet short of `hidden_range` may lead to a root behind it.
        // Seen flat, facets lie farther from it along the ray: of a short look for a face along the one left, all of them count.
        let sine = left.map_or(1.0, |(_, normal)| normal.dot(ray.direction).abs().max(LEAST_SLACK_SINE));
        let slack = 2.0 * self.sag / sine;
        let mut start = ray.t_min - slack;
        if let Some((from, normal)) = left
            && let Some(reach) = self.hidden_range(&ray, from, normal)
        {
            let end = ray.t_max.min(ray.t_min.max(0.0) + reach);
            if let Some(hit) = self.ask_spline(&ray.with_range(ray.t_min, end)) {
                cost.rays += 1;
                return Some(hit);
            }
            // Nothing on the spline up to there: facets of the surface being left, which a flat ray may still cross, are ghosts.
            ray.t_min = end;
        }
        let ray = &ray;
        let mut rays = 0;
        let mut answer = None;
        for _ in 0..MOST_FACETS {
            let mut own = Cost::default();
            let facet_hit = self.facets.intersect(&ray.with_range(start, ray.t_max + slack), &mut own);
            rays += own.rays;
            *cost += Cost { rays: 0, ..own };
            let Some(facet_hit) = facet_hit else { break };
            match self.polish(ray, &facet_hit) {
                Polishing::Hit(hit) => answer = Some(hit),
                Polishing::Behind => {
                    start = facet_hit.t.next_up();
                    continue;
                }
                // A ready mesh has no spline to go to; that is no failure.
                Polishing::Lost if !self.exact.traces(facet_hit.face) => answer = hit_in_range(ray, facet_hit),
                // The exact model has no point there: a facet of the surface being left.
                Polishing::Lost
                    if ray.departure.is_some_and(|f| {
                        f.face == facet_hit.face && facet_hit.t < self.neighbour_distance(&facet_hit)
                    }) => {}
                Polishing::Lost => {
                    cost.fallbacks += 1;
                    answer = hit_in_range(ray, facet_hit);
                }
            }
            if answer.is_some() {
                break;
            }
            start = facet_hit.t.next_up();
        }
        // However many facets were asked, it was one ray.
        cost.rays += rays.min(1);
        answer
    }
}

/// Whether a root on the face that the ray leaves is the very point it leaves: no distance along the ray, the same place. That the
/// faces are the same is up to the caller.
fn is_own(exact: &Exact, from: &Departure, ray: &Ray, point: &super::exact::SurfacePoint) -> bool {
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

impl Polished<'_> {
    /// The nearest root of one ray, found by facets and, where their answer is doubtful or the ray short, by the exact model.
    fn intersect_alone(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let normal = |f: &Departure| self.exact.normal_at(f.face, f.uv);
        let Some(left) = ray.departure.as_ref().and_then(|f| Some((f, normal(f)?))) else {
            return self.search_from_outside(ray, cost);
        };
        let mut answer = self.search_by_facets(ray, Some(left), cost);
        let asked = (ray.t_max - ray.t_min <= SHORT_OF_SAGS * self.sag).then(|| self.ask_spline(ray));
        answer = answer.into_iter().chain(asked.flatten()).min_by(|a, b| a.t.total_cmp(&b.t));
        if !self.is_doubtful(ray, left, answer.as_ref()) {
            return answer;
        }
        // Beside an edge a ray may start outside all facets and pass between them.
        let exact = asked.unwrap_or_else(|| self.ask_spline(ray));
        if self.is_impossible(ray, left, exact.as_ref()) { answer } else { exact }
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
        // A root lies beside its facet's piece of the spline where the ray that found it came in flat.
        record.decisive_sine(ray).is_some_and(|sine| sine > 0.0)
            && self.pieces[from.primitive as usize].holds(from.uv)
            && self.facets.escapes_spline(ray, self.sag)
    }

    fn footprint(&self) -> Footprint {
        let (a, b) = (self.facets.footprint(), self.exact.footprint());
        Footprint {
            bytes: a.bytes
                + b.bytes
                + size_of_val(&*self.records)
                + size_of_val(&*self.pieces)
                + self.curved.bytes(),
            primitives: a.primitives,
            build_seconds: a.build_seconds + b.build_seconds,
        }
    }
}

/// The hit if it lies within the range of the ray, else `None`.
fn hit_in_range(ray: &Ray, hit: Hit) -> Option<Hit> {
    (hit.t >= ray.t_min && hit.t <= ray.t_max).then_some(hit)
}

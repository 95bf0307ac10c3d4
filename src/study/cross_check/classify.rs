//! Finds the cause of each difference between the hits on facets and on the spline.

use super::face_facets::FaceFacets;
use super::placed_surface::PlacedSurface;
use super::verdict::{Cause, Defect};
use crate::intersect::{Certainty, Hit};
use crate::math::{Aabb, FaceId, Point, Ray, Vector};
use crate::mesh::FacetMesh;
use crate::model::{Model, PlacedFace};
use std::sync::OnceLock;

/// Rounding of a hit, as a share of the reach of the coordinates: 45,000 units in the last place, for grazing rays.
const ROUNDING: f64 = 1e-11;
/// How far foot points may lie from the true ones, as a share of the size of the surface.
const FOOT_POINT: f64 = 1e-9;
/// |cos| of the incidence below which the distance of a hit is no longer held to more digits.
const GRAZING: f64 = 1e-9;
/// Unit normals of one facet from two intersectors agree to this at normal incidence: interpolation at hits that differ by rounding.
const SAME_NORMAL: f64 = 1e-9;
/// |cos| of the incidence below which normals are no longer held to more digits.
const GRAZING_NORMAL: f64 = 1e-6;

/// The later of two hits on different faces, as far as the cause of the earlier one depends on it.
#[derive(Clone, Copy)]
pub(super) struct LaterHit {
    /// mm along the ray.
    pub(super) t: f64,
    /// As [`Classifier::band`] of its face, mm.
    pub(super) band: f64,
}

/// Decides why facets and spline differ: geometry of its own, none of the intersectors'.
pub(super) struct Classifier<'a> {
    mesh: &'a FacetMesh,
    placed: Vec<PlacedFace<'a>>,
    surfaces: Vec<OnceLock<Option<PlacedSurface>>>,
    /// The facets of each face.
    facets: Vec<FaceFacets>,
    /// How far facets without a proof stray from the spline, mm, measured when it is first asked for: the same for all rays.
    measured: Vec<OnceLock<f64>>,
    fallback: f64,
    /// Differences below this are rounding, mm.
    pub(super) rounding: f64,
}

impl<'a> Classifier<'a> {
    /// Makes a classifier for a model and its mesh; `fallback`, mm, stands for the sag of facets that were not proved.
    pub(super) fn new(model: &'a Model, mesh: &'a FacetMesh, fallback: f64) -> Self {
        // Surfaces are moved into place only for faces that differ: most never do.
        let placed: Vec<_> = model.placed_faces().collect();
        let mut facets: Vec<FaceFacets> = placed.iter().map(|_| FaceFacets::default()).collect();
        for (i, facet) in (0u32..).zip(&mesh.facets) {
            if let Some(own) = facets.get_mut(facet.face.index()) {
                own.push(i);
            }
        }
        let surfaces = placed.iter().map(|_| OnceLock::new()).collect();
        let bounds = mesh.bounds();
        // Rounding goes with the numbers that coordinates are, not with the size of the model.
        let reach = Aabb::from_points([bounds.min.abs(), bounds.max.abs()]).max;
        let size = if bounds.is_empty() { 1.0 } else { reach.length() + bounds.diagonal() };
        let measured = mesh.facets.iter().map(|_| OnceLock::new()).collect();
        Self { mesh, placed, surfaces, facets, measured, fallback, rounding: ROUNDING * size }
    }

    /// Returns a face's surface at its place, made when it is first asked for; `None` for a ready mesh or a face that does not exist.
    fn surface(&self, face: FaceId) -> Option<&PlacedSurface> {
        let placed = self.placed.get(face.index())?;
        self.surfaces[face.index()].get_or_init(|| PlacedSurface::new(placed)).as_ref()
    }

    /// Returns the sag of a facet, mm: the proved one, else the fallback.
    fn sag(&self, facet: u32) -> f64 {
        self.proved_sag(facet).unwrap_or(self.fallback)
    }

    /// Returns the proved sag of a facet, mm; `None` where it was not proved.
    fn proved_sag(&self, facet: u32) -> Option<f64> {
        self.mesh.sag.get(facet as usize).copied().filter(|s| s.is_finite())
    }

    /// Returns the gap of a face of the model between its edges and its surface, mm; 0 where it has no surface.
    pub(super) fn gap(&self, face: FaceId) -> f64 {
        self.surface(face).map_or(0.0, |s| s.gap)
    }

    /// Returns the largest sag, mm, of those facets of a face that the ray's line passes within their own sag and `gap`; of all when it
    /// passes none, as beside a border or over a hole.
    pub(super) fn band(&self, face: FaceId, ray: &Ray, gap: f64) -> f64 {
        let Some(facets) = self.facets.get(face.index()) else { return self.fallback };
        facets.largest_sag(self.mesh, ray, gap + self.rounding, |i| self.sag(i))
    }

    /// Measures how far, mm, facets without a proved sag stray from the spline that may be why a ray was answered differently: the facet
    /// that was hit, and those of the face that was hit first which the ray's line passes within as much. 0 without any.
    fn unproved_sag(&self, ray: &Ray, first: &Hit, facet: Option<&Hit>) -> f64 {
        let everywhere = ray.with_range(f64::NEG_INFINITY, f64::INFINITY);
        let of_hit = facet.map(|f| (f.face, f.primitive));
        let of_face = self.facets.get(first.face.index()).into_iter().flat_map(FaceFacets::facets);
        let doubtful = of_hit.into_iter().chain(of_face.map(|&i| (first.face, i)));
        doubtful
            .filter(|(_, i)| self.proved_sag(*i).is_none())
            .filter_map(|(face, i)| {
                let surface = self.surface(face)?;
                let sag = *self.measured[i as usize].get_or_init(|| self.measured_sag(i, surface));
                let bounds = Aabb::from_points(self.mesh.corners(i as usize)).grown(sag + self.rounding);
                bounds.clip(&everywhere).map(|_| sag)
            })
            .fold(0.0, f64::max)
    }

    /// Measures how far, mm, a facet strays from the spline: the farthest of 25 of its points.
    fn measured_sag(&self, facet: u32, surface: &PlacedSurface) -> f64 {
        // A grid over the facet's two triangles, which share the diagonal from a to c.
        let [a, b, c, d] = self.mesh.corners(facet as usize);
        let points = (0..25).map(|k| {
            let (u, v) = (f64::from(k / 5) / 4.0, f64::from(k % 5) / 4.0);
            if u >= v { a + (b - a) * (u - v) + (c - a) * v } else { a + (d - a) * (v - u) + (c - a) * u }
        });
        // Each point is near the one before; which way the surface bends there does not matter.
        let mut guess = surface.nearest_seeds::<1>(a)[0];
        let mut distance = |p: Point| {
            let foot = surface.foot(p, guess, Vector::ZERO);
            guess = foot.uv;
            foot.offset.abs()
        };
        points.map(&mut distance).fold(0.0, f64::max)
    }

    /// Returns why facets and spline answer a ray differently; `None` when the answers agree to rounding. `None` for a hit is a miss.
    pub(super) fn compare(&self, ray: &Ray, facet: Option<&Hit>, exact: Option<&Hit>) -> Option<Cause> {
        let (f, e) = match (facet, exact) {
            (None, None) => return None,
            (Some(f), Some(e)) if f.face == e.face => (f, e),
            _ => return Some(self.explain(ray, facet, exact, None)),
        };
        let apart = (f.t - e.t).abs();
        // Beyond rounding and its own sag the facet has to be explained by what is around it.
        if apart > self.rounding + self.sag(f.primitive) {
            return Some(self.explain(ray, facet, exact, None));
        }
        // The spline passes within `apart` of the facet's hit, so the hit lies within the sag. Only at grazing incidence may facets
        // turn their backs within it.
        let steep = |h: &Hit| h.geometric_normal.dot(ray.direction).abs() > 0.3;
        let opposite = f.geometric_normal.dot(e.geometric_normal) < 0.0 && steep(f) && steep(e);
        if opposite && !self.is_folded(ray, f, e) {
            let is_other = self.is_on_another_sheet(ray, f, e);
            return Some(if is_other { Cause::Coincident } else { Cause::Unexplained(Defect::Orientation) });
        }
        (apart > self.rounding).then_some(Cause::WithinSag)
    }

    /// Whether the spline itself is folded where it is hit, within the facet's sag: its normal there is that of the hit, and all around it
    /// is on the facet's side.
    fn is_folded(&self, ray: &Ray, facet: &Hit, exact: &Hit) -> bool {
        self.surface(facet.face).is_some_and(|surface| {
            let band = self.widest(surface, self.band(facet.face, ray, surface.gap));
            surface.normal(exact.uv).dot(exact.geometric_normal) > 0.0
                && surface.looks_around(exact.uv, band, facet.geometric_normal)
        })
    }

    /// Whether the facet stands for another sheet of the surface than the one that the spline was hit on, as of a spring whose coils touch:
    /// the surface lies within its sag, and at its own parameters it faces as it does.
    fn is_on_another_sheet(&self, ray: &Ray, facet: &Hit, exact: &Hit) -> bool {
        self.surface(facet.face).is_some_and(|surface| {
            let foot = surface.foot(ray.point_at(facet.t), facet.uv, ray.direction);
            foot.offset.abs() <= self.widest(surface, self.sag(facet.primitive))
                && surface.normal(facet.uv).dot(facet.geometric_normal) > 0.0
                && surface.normal(exact.uv).dot(exact.geometric_normal) > 0.0
        })
    }

    /// Returns how far from a surface its facets may lie that stray by `sag`: with the file's gap and rounding, mm.
    fn widest(&self, surface: &PlacedSurface, sag: f64) -> f64 {
        sag + surface.gap + self.rounding + FOOT_POINT * surface.size()
    }

    /// Finds the cause of a difference, from the earlier of the two hits: why did the other not see it? `elsewhere` is the later one where
    /// it lies on another model.
    pub(super) fn explain(
        &self,
        ray: &Ray,
        facet: Option<&Hit>,
        exact: Option<&Hit>,
        elsewhere: Option<LaterHit>,
    ) -> Cause {
        // A touch is no crossing: rounding decides who sees it.
        if exact.is_some_and(|e| e.certainty == Certainty::Tangent) {
            return Cause::Tangent;
        }
        let facet_first = match (facet, exact) {
            // The first hit shows something that the other missed, at a known place.
            (Some(f), Some(e)) => f.t < e.t,
            (f, _) => f.is_some(),
        };
        let (first, other) = if facet_first { (facet, exact) } else { (exact, facet) };
        let Some(first) = first else { return Cause::Unexplained(Defect::Inconclusive) };
        // A face that could not be meshed has no facets to hit.
        if self.facets.get(first.face.index()).is_none_or(|f| f.facets().is_empty()) {
            return Cause::Unmeshed;
        }
        let Some(surface) = self.surface(first.face) else { return Cause::NoSurface };
        let sag = self.band(first.face, ray, surface.gap);
        let same_face = other.filter(|o| o.face == first.face).map(|o| o.t);
        let later = |o: &Hit| LaterHit { t: o.t, band: self.band(o.face, ray, surface.gap) };
        let other_face = other.filter(|o| o.face != first.face).map(later).or(elsewhere);
        let cause = self.cause(ray, first, (same_face, other_face), surface, sag);
        // Facets that the mesher could not prove, and that stray farther than requested: that is measured here.
        if matches!(cause, Cause::Unexplained(_)) {
            let measured = self.unproved_sag(ray, first, facet);
            let others = (same_face, other_face);
            if measured > sag && !matches!(self.cause(ray, first, others, surface, measured), Cause::Unexplained(_))
            {
                return Cause::Unproved;
            }
        }
        cause
    }

    /// Finds the cause when facets may stray from the first hit's face by `sag`, mm, by following the ray through that band. The other hit
    /// is known by its distance where it lies on the same face, mm, or else as a later one.
    fn cause(
        &self,
        ray: &Ray,
        first: &Hit,
        (same_face, other_face): (Option<f64>, Option<LaterHit>),
        surface: &PlacedSurface,
        sag: f64,
    ) -> Cause {
        let band = self.widest(surface, sag);
        let Some(stretch) = surface.stretch(ray, first.t, first.uv, band) else {
            let is_beyond = surface.is_beyond_border(ray, first.t, first.uv, band);
            return if is_beyond { Cause::TrimEdge } else { Cause::Unexplained(Defect::OffTheSurface) };
        };
        let [begin, end] = stretch.range;
        let same_crossing = same_face.is_some_and(|t| (begin..=end).contains(&t));
        // A side of 0: the ray begins or ends while it is near the surface.
        if same_crossing || stretch.sides.contains(&0) {
            return Cause::WithinSag;
        }
        if stretch.border {
            return Cause::TrimEdge;
        }
        if !stretch.complete {
            return Cause::Unexplained(Defect::Inconclusive);
        }
        // The ray comes near and leaves on the side it came from: it grazes the surface.
        if stretch.sides[0] == stretch.sides[1] {
            return Cause::Silhouette;
        }
        // The other face lies within the band too: which of the two comes first is a matter of sag.
        let offset = |o: LaterHit| surface.foot(ray.point_at(o.t), first.uv, ray.direction).offset.abs();
        if other_face.is_some_and(|o| offset(o) <= band + o.band) {
            return Cause::Coincident;
        }
        Cause::Unexplained(Defect::MissedCrossing)
    }

    /// Compares the answers of octree and BVH: `Ok(true)` for a tie between facets, `Ok(false)` for the same answer.
    ///
    /// # Errors
    /// For a defect: one misses, or distances or normals differ by more than rounding.
    pub(super) fn same_facets(&self, ray: &Ray, a: Option<&Hit>, b: Option<&Hit>) -> Result<bool, ()> {
        let (a, b) = match (a, b) {
            (None, None) => return Ok(false),
            (Some(a), Some(b)) => (a, b),
            _ => return Err(()),
        };
        let cos = a.geometric_normal.dot(ray.direction).abs().min(b.geometric_normal.dot(ray.direction).abs());
        // The rounding of a distance goes with the numbers it is made of.
        let scale = ray.origin.length() + a.t.abs() + self.rounding / ROUNDING;
        if (a.t - b.t).abs() > 16.0 * f64::EPSILON * scale / cos.max(GRAZING) {
            return Err(());
        }
        if a.primitive != b.primitive {
            return Ok(true);
        }
        if a.normal.distance(b.normal) > SAME_NORMAL / cos.max(GRAZING_NORMAL) { Err(()) } else { Ok(false) }
    }
}

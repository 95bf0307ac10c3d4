use super::sheet::Sheet;
use super::verdict::{Cause, Defect};
use crate::intersect::{Certainty, Hit};
use crate::math::{Aabb, FaceId, Ray};
use crate::mesh::FacetMesh;
use crate::model::{Model, PlacedFace};
use std::sync::OnceLock;

/// Decides why facets and spline differ: geometry of its own, none of the intersectors'.
pub(super) struct Judge<'a> {
    mesh: &'a FacetMesh,
    placed: Vec<PlacedFace<'a>>,
    sheets: Vec<OnceLock<Option<Sheet>>>,
    /// Largest finite sag of each face's facets, mm; `None` for a face without facets.
    bands: Vec<Option<f64>>,
    fallback: f64,
    /// Differences below this are rounding, mm.
    pub(super) rounding: f64,
}

impl<'a> Judge<'a> {
    pub(super) fn new(model: &'a Model, mesh: &'a FacetMesh, fallback: f64) -> Self {
        let placed: Vec<_> = model.placed_faces().collect();
        let mut bands = vec![None; placed.len()];
        for (i, facet) in mesh.facets.iter().enumerate() {
            let sag = mesh.sag.get(i).copied().filter(|s| s.is_finite()).unwrap_or(fallback);
            if let Some(band) = bands.get_mut(facet.face.index()) {
                *band = Some(f64::max(band.unwrap_or(0.0), sag));
            }
        }
        let sheets = placed.iter().map(|_| OnceLock::new()).collect();
        let bounds = mesh.bounds();
        let reach = Aabb::around([bounds.min.abs(), bounds.max.abs()]).max;
        let size = if bounds.is_empty() { 1.0 } else { reach.length() + bounds.diagonal() };
        Self { mesh, placed, sheets, bands, fallback, rounding: 1e-11 * size }
    }

    fn sheet(&self, face: FaceId) -> Option<&Sheet> {
        let placed = self.placed.get(face.index())?;
        self.sheets[face.index()].get_or_init(|| Sheet::of(placed)).as_ref()
    }

    fn band(&self, face: FaceId) -> f64 {
        let face = self.bands.get(face.index()).copied().flatten();
        face.unwrap_or(self.fallback)
    }

    fn facet_sag(&self, hit: &Hit) -> f64 {
        let own = self.mesh.sag.get(hit.primitive as usize).copied().filter(|s| s.is_finite());
        own.unwrap_or_else(|| self.band(hit.face))
    }

    /// `None` when the answers agree to rounding.
    pub(super) fn compare(&self, ray: &Ray, facet: Option<&Hit>, exact: Option<&Hit>) -> Option<Cause> {
        let (f, e) = match (facet, exact) {
            (None, None) => return None,
            (Some(f), Some(e)) if f.face == e.face => (f, e),
            _ => return Some(self.explain(ray, facet, exact)),
        };
        let apart = (f.t - e.t).abs();
        if apart > self.rounding + self.facet_sag(f) {
            return Some(self.explain(ray, facet, exact));
        }
        // The spline passes within `apart` of the facet's hit, so the hit lies within the sag.
        let steep = |h: &Hit| h.geometric_normal.dot(ray.direction).abs() > 0.3;
        if f.geometric_normal.dot(e.geometric_normal) < 0.0 && steep(f) && steep(e) {
            return Some(Cause::Unexplained(Defect::Orientation));
        }
        (apart > self.rounding).then_some(Cause::WithinSag)
    }

    /// The cause of a difference, from the earlier of the two hits: why did the other not see it?
    fn explain(&self, ray: &Ray, facet: Option<&Hit>, exact: Option<&Hit>) -> Cause {
        if exact.is_some_and(|e| e.certainty == Certainty::Tangent) {
            return Cause::Tangent;
        }
        let facet_first = match (facet, exact) {
            (Some(f), Some(e)) => f.t < e.t,
            (f, _) => f.is_some(),
        };
        let (first, other) = if facet_first { (facet, exact) } else { (exact, facet) };
        let Some(first) = first else { return Cause::Unexplained(Defect::Inconclusive) };
        if self.bands.get(first.face.index()).copied().flatten().is_none() {
            return Cause::Unmeshed;
        }
        let Some(sheet) = self.sheet(first.face) else { return Cause::NoSurface };
        let band = self.band(first.face) + sheet.gap + self.rounding + 1e-9 * sheet.size();
        let Some(stretch) = sheet.stretch(ray, first.t, first.uv, band) else {
            return Cause::Unexplained(Defect::OffTheSurface);
        };
        let [begin, end] = stretch.range;
        let same_crossing = other.is_some_and(|o| o.face == first.face && (begin..=end).contains(&o.t));
        if same_crossing || stretch.sides.contains(&0) {
            return Cause::WithinSag;
        }
        if stretch.border {
            return Cause::TrimEdge;
        }
        if !stretch.complete {
            return Cause::Unexplained(Defect::Inconclusive);
        }
        if stretch.sides[0] == stretch.sides[1] {
            return Cause::Silhouette;
        }
        if let Some(o) = other.filter(|o| o.face != first.face) {
            let both = band + self.band(o.face);
            if sheet.foot(ray.at(o.t), first.uv, ray.direction).offset.abs() <= both {
                return Cause::Coincident;
            }
        }
        Cause::Unexplained(Defect::MissedCrossing)
    }

    /// Octree against BVH: `Ok(true)` for a tie between facets, `Err` for a defect.
    pub(super) fn same_facets(&self, ray: &Ray, a: Option<&Hit>, b: Option<&Hit>) -> Result<bool, ()> {
        let (a, b) = match (a, b) {
            (None, None) => return Ok(false),
            (Some(a), Some(b)) => (a, b),
            _ => return Err(()),
        };
        let cos = a.geometric_normal.dot(ray.direction).abs().min(b.geometric_normal.dot(ray.direction).abs());
        let scale = ray.origin.length() + a.t.abs() + self.rounding * 1e11;
        if (a.t - b.t).abs() > 16.0 * f64::EPSILON * scale / cos.max(1e-9) {
            return Err(());
        }
        if a.primitive != b.primitive {
            return Ok(true);
        }
        if a.normal.distance(b.normal) > 1e-9 / cos.max(1e-6) { Err(()) } else { Ok(false) }
    }
}

//! One placed face, as contacts see it: its trimmed region, and places on it in the model's coordinates.

use super::projector::Projector;
use crate::math::polygon::is_inside_sides;
use crate::math::{Frame, Point, Uv};
use crate::model::{EdgeId, Face, Instance, Part, TrimLoop};
use crate::nurbs::project;
use crate::tessellate::assemble::{PartMesh, face_with_surface};
use crate::tessellate::border::polygons::{self, BorderPolygons, ImprintedPoints, PolygonVertex};
use crate::tessellate::face_mesh::{Corner, MeshedFacet};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::Position;
use crate::tessellate::placed_part::PlacedPart;
use crate::tessellate::settings::{Settings, ToleranceField};

/// Share of the tolerance that a carrier's facets are held to: the guest's proof, over other parameters, has the rest.
pub(super) const CARRIER_SHARE: f64 = 0.8;

/// Steps of the grid over a face whose places inside it are looked at.
const GRID: usize = 9;

/// A face by its instance and its place among the faces of its part's shells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct FaceKey {
    pub(super) instance: usize,
    pub(super) face: usize,
}

/// A placed face that may be in contact with others.
pub(super) struct TrimmedFace<'m> {
    pub(super) key: FaceKey,
    pub(super) part: &'m Part,
    pub(super) face: &'m Face,
    pub(super) frame: &'m Frame,
    /// With its tolerance, which contacts may tighten.
    pub(super) surface: FaceSurface<'m>,
    /// The tolerance that was requested for it.
    pub(super) asked: ToleranceField,
    pub(super) loops: Vec<TrimLoop>,
    pub(super) polygons: BorderPolygons,
    pub(super) projector: Projector<'m>,
    /// Places on its border, then those inside, in the model's coordinates.
    pub(super) samples: Vec<Point>,
    /// How many lie on its border.
    border_samples: usize,
}

impl<'m> TrimmedFace<'m> {
    /// Builds the face's border on the divisions of `mesh` and samples it; `None` where it is no face or its surface cannot be used. `mesh`
    /// and `placed` are of the instance's part.
    pub(super) fn new(
        instance: &'m Instance,
        placed: &PlacedPart<'m>,
        settings: &Settings,
        mesh: &PartMesh,
        key: FaceKey,
    ) -> Option<Self> {
        let part = placed.part;
        let (face, surface) = face_with_surface(placed, settings, key.face)?;
        let loops = polygons::loops(face).into_owned();
        let polygons = polygons::build(part, &loops, &surface, &mesh.divisions, &ImprintedPoints::NONE);
        let mut out = Self {
            key,
            part,
            face,
            frame: &instance.placement,
            projector: Projector::new(&face.surface),
            asked: surface.field,
            surface,
            loops,
            polygons,
            samples: Vec::new(),
            border_samples: 0,
        };
        let border: Vec<Point> = out.vertices().map(|v| out.place_of(v, mesh)).collect();
        let border_samples = border.len();
        let (lo, hi) = out.polygons.bounds();
        // Middles of a grid's cells: none lies on the border, whose vertices are samples already.
        let step = |k: usize| (k as f64 + 0.5) / GRID as f64;
        let grid = (0..GRID * GRID).map(|k| lo + Uv::new(step(k / GRID), step(k % GRID)) * (hi - lo));
        let inside = grid.filter(|&uv| out.contains(uv)).map(|uv| out.surface.point(uv));
        let samples = border.into_iter().chain(inside).map(|p| out.frame.point(p)).collect();
        out.samples = samples;
        out.border_samples = border_samples;
        Some(out)
    }

    /// Returns the tolerance, mm of the part, requested where a facet of this face lies, whatever contacts held it to. `corners` are
    /// those of its mesh.
    pub(super) fn asked_tolerance(&self, facet: &MeshedFacet, corners: &[Corner]) -> f64 {
        let own_share = self.asked.tighter(&self.asked, CARRIER_SHARE);
        if self.surface.field.has_range_of(&own_share) {
            return facet.tolerance / CARRIER_SHARE;
        }
        // The tightest of its corners and its middle, as where facets are proved.
        let [a, b, c, d] = facet.corners.map(|k| corners[k as usize].uv);
        let middle = if facet.corners[2] == facet.corners[3] { (a + b + c) / 3.0 } else { (a + b + c + d) / 4.0 };
        [a, b, c, d, middle]
            .map(|uv| self.surface.tolerance_in(&self.asked, uv))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns all corners of the border.
    pub(super) fn vertices(&self) -> impl Iterator<Item = &PolygonVertex> {
        self.polygons.polygons.iter().flatten()
    }

    /// Returns the place of a border corner in the part's coordinates; `mesh` is the part's.
    pub(super) fn place_of(&self, v: &PolygonVertex, mesh: &PartMesh) -> Point {
        match v.position {
            Position::Shared(p) => mesh.shared[p as usize],
            Position::Own(p) => self.polygons.own[p as usize],
        }
    }

    /// Whether `uv` lies inside the polygons of the border's chords: within a chord's sag of the trim it may say either, which
    /// [`Self::is_at_border`] decides. Periods are not taken into account.
    pub(super) fn contains(&self, uv: Uv) -> bool {
        let sides =
            self.polygons.polygons.iter().flat_map(|p| (0..p.len()).map(|i| [p[i].uv, p[(i + 1) % p.len()].uv]));
        is_inside_sides(sides, uv)
    }

    /// Returns the edges of the face's loops, each once; none for a face without loops.
    pub(super) fn edges(&self) -> Vec<EdgeId> {
        let mut edges: Vec<EdgeId> = self.face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// The edges beyond which other faces lie: seams are not among them.
    pub(super) fn rims(&self) -> Vec<EdgeId> {
        let uses = || self.face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
        let mut edges = self.edges();
        edges.retain(|edge| uses().filter(|used| used == edge).count() == 1);
        edges
    }

    /// Parameter of the point of an edge that is nearest to a place of the model, and how far it is, mm.
    pub(super) fn nearest_on_edge(&self, edge: EdgeId, p: Point) -> (f64, f64) {
        let (t, away) = project::nearest(&self.part.edges[edge.0 as usize].curve, self.frame.local_point(p));
        (t, away * self.frame.scale.abs())
    }

    /// Returns the parameters of the point of the surface that is nearest to a place of the model, and how far it is, mm.
    pub(super) fn project(&self, p: Point) -> (Uv, f64) {
        let (uv, away) = self.projector.project(self.frame.local_point(p));
        (uv, away * self.frame.scale.abs())
    }

    /// Whether all samples of another face lie on this one within `glue` mm; false if it has none.
    pub(super) fn carries(&self, other: &Self, glue: f64) -> bool {
        let edges = self.edges();
        !other.samples.is_empty() && other.samples.iter().all(|&p| self.holds(&edges, p, glue))
    }

    /// Whether a place lies on this face, within `glue` mm; `edges` are the face's own.
    pub(super) fn holds(&self, edges: &[EdgeId], p: Point, glue: f64) -> bool {
        let (uv, away) = self.project(p);
        // Near the border, parameters may fall outside by rounding; distance in space decides there.
        away <= glue && (self.contains(uv) || self.is_at_border(edges, p, glue))
    }

    /// Whether a place lies inside this face, off its border.
    pub(super) fn holds_inside(&self, edges: &[EdgeId], p: Point, glue: f64) -> bool {
        let (uv, away) = self.project(p);
        away <= glue && self.contains(uv) && !self.is_at_border(edges, p, glue)
    }

    /// Whether places inside one of two faces lie inside the other: they have an area in common, and not just a line.
    pub(super) fn overlaps(&self, other: &Self, glue: f64) -> bool {
        let holds = |on: &Self, of: &Self| {
            let edges = on.edges();
            let mut inside = of.samples[of.border_samples..].iter();
            // Most faces whose boxes meet do not touch: the seeds show it before any nearest point is computed.
            inside.any(|&p| !on.is_beyond(p, glue) && on.holds_inside(&edges, p, glue))
        };
        holds(self, other) || holds(other, self)
    }

    /// Whether a place is farther from the surface than this, mm, judged by the seeds of the projector.
    fn is_beyond(&self, p: Point, mm: f64) -> bool {
        self.projector.is_beyond(self.frame.local_point(p), mm / self.frame.scale.abs())
    }

    /// Whether a point lies on one of these edges; without edges, as of a whole sphere, any point counts as one.
    pub(super) fn is_at_border(&self, edges: &[EdgeId], p: Point, glue: f64) -> bool {
        // A face without edges is whole: its border is a seam or a pole.
        edges.is_empty() || edges.iter().any(|&e| self.nearest_on_edge(e, p).1 <= glue)
    }
}

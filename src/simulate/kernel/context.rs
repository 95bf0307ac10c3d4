//! Data that all replicates of a run share.

use super::payload::RayPayload;
use super::receiver_index::ReceiverIndex;
use crate::intersect::Intersector;
use crate::math::Aabb;
use crate::simulate::bind::BoundScene;
use crate::simulate::outcome::PathSink;
use crate::simulate::plan::Plan;
use crate::simulate::receiver::{Receiver, Shape};
use crate::simulate::settings::RunSettings;
use smallvec::SmallVec;

/// Bodies, outermost first.
pub(super) type Bodies = SmallVec<[u32; 4]>;

/// What the rays of a source start in.
#[derive(Clone, Debug)]
pub(super) enum StartingMedia {
    /// All in the same bodies.
    Same(Bodies),
    /// Each must be probed: the source lies on a surface, or reaches into a body.
    PerRay,
    /// The same, and the source may lie on a face of a solid, which its rays must start clear of.
    OnFace,
    /// Those that the scene states, and the source may lie on a face of a solid: its rays must start on the side where that is true.
    Stated,
    /// In an opaque solid: the source lies on a face of it and shines into it alone.
    InSolid,
}

/// Data that all replicates share.
#[derive(Clone)]
pub(crate) struct Context<'a> {
    pub(crate) bound: &'a BoundScene,
    pub(crate) intersector: &'a dyn Intersector,
    pub(crate) settings: &'a RunSettings,
    pub(crate) plan: Plan,
    /// Takes the vertices of all paths as they come; without, a sample is kept.
    pub(crate) paths: Option<PathSink<'a>>,
    /// Receivers that stand among the faces and end light.
    pub(super) blocking: ReceiverIndex,
    /// Receivers that end light and do not meet `region`.
    pub(super) outside: ReceiverIndex,
    /// Receivers that count light passing through.
    pub(super) passing: ReceiverIndex,
    /// Receivers of the far field.
    pub(super) far: Vec<u32>,
    /// A box around all faces and sources; only how fast a path is followed depends on it.
    pub(super) region: Aabb,
    /// What the rays of each source start in.
    pub(super) starting_media: Vec<StartingMedia>,
}

impl<'a> Context<'a> {
    /// Makes a context whose `starting_media` is still empty: which bodies its sources lie in is not yet known.
    pub(super) fn without_media(
        bound: &'a BoundScene,
        intersector: &'a dyn Intersector,
        settings: &'a RunSettings,
    ) -> Self {
        // Receivers are sorted once by how a segment is tested against them, so that the hot loop walks four short lists and tests no kind.
        let all = &bound.receivers[..];
        // A far field counts directions; it cuts no segment.
        let far = |&i: &usize| matches!(all[i].shape, Shape::FarField { .. });
        let region = bound.region;
        // A far field has no place, and faces that receive are found by the hit itself: only planes, discs and spheres cut
        // segments.
        let stands =
            |r: &Receiver| matches!(r.shape, Shape::Plane { .. } | Shape::Disc { .. } | Shape::Sphere { .. });
        Self {
            bound,
            intersector,
            settings,
            plan: Plan::new(bound, settings),
            paths: None,
            // Most receivers stand around the scene: no segment from face to face can reach those, see `clip_outside`.
            blocking: ReceiverIndex::new(all, |r| r.absorbs && stands(r) && r.meets(&region)),
            outside: ReceiverIndex::new(all, |r| r.absorbs && stands(r) && !r.meets(&region)),
            passing: ReceiverIndex::new(all, |r| !r.absorbs && stands(r)),
            far: (0..all.len()).filter(far).map(|i| i as u32).collect(),
            region,
            starting_media: Vec::new(),
        }
    }

    /// Returns the same context for another plan of the same rays.
    pub(crate) fn with_plan(&self, plan: Plan, settings: &'a RunSettings) -> Self {
        Self { plan, settings, ..self.clone() }
    }

    /// Returns the same context without a sink for paths: their vertices stay in the tally.
    pub(crate) fn without_path_sink(self) -> Self {
        Self { paths: None, ..self }
    }

    /// Whether only the ends of rays are needed: no path is recorded, no face is tallied, and no receiver lets light pass, selects by
    /// interactions or has channels.
    pub(crate) fn asks_ends_only(&self) -> bool {
        let extra = |r: &Receiver| r.interactions.is_some() || r.channels.count() > 0;
        self.passing.is_empty()
            && !self.plan.records_any()
            && !self.bound.counts_faces()
            && !self.bound.receivers.iter().any(extra)
    }

    /// Whether the scene asks for the polarisation of rays to be followed.
    #[inline]
    pub(super) fn polarised(&self) -> bool {
        self.bound.scene.run.polarisation
    }

    /// Returns the distance up to which faces of two solids are one, mm.
    #[inline(always)]
    pub(super) fn glue_mm(&self) -> f64 {
        self.bound.scene.run.glue_distance()
    }

    /// Returns the refractive index of a body at the wavelength of a ray, or of the scene where the ray carries none.
    #[inline(always)]
    pub(super) fn index<C: RayPayload>(&self, body: u32, payload: &C) -> f64 {
        self.bound.bodies[body as usize].index(payload.wavelength())
    }
}

//! Books what becomes of a path's power and records its vertices; receivers book their light in `receivers`, sources in `emission`.

use super::context::Context;
use super::path::Path;
use super::payload::RayPayload;
use crate::math::{FaceId, Point, Ray};
use crate::simulate::outcome::{Event, LostCause, LostRay, PathVertex};
use crate::simulate::sequence::{Deposit, DepositPlace};
use crate::simulate::tallies::ReplicateTally;
use crate::simulate::tally::{quanta_as_integer, round_quanta};

/// Follows paths and books where their light ends.
pub(super) struct Tracer<'t, 'a, C> {
    pub(super) context: &'t Context<'a>,
    pub(super) tally: &'t mut ReplicateTally,
    /// Paths that split off and wait for room in the wavefront.
    pub(super) pending: Vec<(Path<C>, Ray)>,
}

/// Returns what so many quanta are after `length`, mm, of an absorption, 1/mm (Beer's law), in whole quanta: what is kept and what is taken
/// add up. All of them where nothing absorbs.
#[inline(always)]
pub(super) fn remaining_quanta(quanta: f64, absorption: f64, length: f64) -> f64 {
    if absorption > 0.0 { round_quanta(quanta * (-absorption * length).exp()) } else { quanta }
}

impl<C: RayPayload> Tracer<'_, '_, C> {
    /// Adds a vertex to the tally if the path of this ray is recorded; `face` is `None` where it is at none.
    #[inline(always)]
    pub(super) fn record(&mut self, path: &Path<C>, point: Point, event: Event, face: Option<FaceId>) {
        // Only sampled paths are recorded, and the check costs next to nothing.
        if !C::ENDS_ONLY && self.context.plan.records(path.ray) {
            let Path { ray, branch, bounce, .. } = *path;
            let (power, face) = (path.quanta / self.context.plan.average_ray, face.map(|f| f.0));
            let body = path.payload.body();
            self.tally.paths.push(PathVertex { ray, branch, bounce, point, power, event, face, body });
        }
    }

    /// Books what a face takes of a path, and leaves the path `kept` quanta.
    #[inline(always)]
    pub(super) fn absorb_in_face(&mut self, path: &mut Path<C>, face: FaceId, kept: f64) {
        self.tally.absorb(face, path.quanta - kept);
        if !C::ENDS_ONLY {
            self.note_deposit(path, DepositPlace::Face(face.0), quanta_as_integer(path.quanta - kept));
        }
        path.quanta = kept;
    }

    /// Notes where light was counted, for those who group it by sequence; nothing where none do, or for no quanta.
    #[inline(always)]
    pub(super) fn note_deposit(&mut self, path: &Path<C>, place: DepositPlace, quanta: u64) {
        if let Some(deposits) = &mut self.tally.deposits
            && quanta > 0
        {
            deposits.push(Deposit { branch: path.branch, bounce: path.bounce, place, quanta });
        }
    }

    /// Returns the absorption of the body that a path is in, at its wavelength, 1/mm.
    #[inline(always)]
    pub(super) fn absorption(&self, path: &Path<C>) -> f64 {
        self.context.bound.bodies[path.payload.body() as usize].absorption(path.payload.wavelength())
    }

    /// Takes from a path, and books, what its body absorbs over `length`, mm (Beer's law), in whole quanta; nothing in a clear body.
    /// `false` where nothing is left.
    #[inline(always)]
    pub(super) fn absorb_in_body(&mut self, path: &mut Path<C>, length: f64) -> bool {
        let alpha = self.absorption(path);
        if alpha > 0.0 && path.quanta > 0.0 {
            let kept = remaining_quanta(path.quanta, alpha, length);
            let taken = path.quanta - kept;
            self.tally.ends.absorbed += quanta_as_integer(taken);
            self.tally.bulk.add(path.payload.body() as usize, taken);
            path.quanta = kept;
            return kept > 0.0;
        }
        true
    }

    /// Books the power that is left of a path as cut off by a limit, and ends its record at `point`; nothing for a path without power.
    #[cold]
    pub(super) fn cut_off(&mut self, path: &Path<C>, point: Point) {
        // A path without power has been booked to the last quantum already.
        if path.quanta > 0.0 {
            self.tally.ends.cut_off += quanta_as_integer(path.quanta);
            self.tally.counts.cut_off += 1;
            self.record(path, point, Event::CutOff, None);
        }
    }

    /// Books the end of a path that goes round in its body for ever: as cut off, and as caught.
    #[cold]
    pub(super) fn cut_off_trapped(&mut self, path: &Path<C>, point: Point) {
        self.tally.counts.caught += u64::from(path.quanta > 0.0);
        self.cut_off(path, point);
    }

    /// Books a path that cannot go on as lost, with its ray and cause; `face` is `None` where it was at none.
    #[cold]
    pub(super) fn lose(&mut self, path: &Path<C>, ray: &Ray, cause: LostCause, face: Option<FaceId>) {
        self.tally.lose(LostRay {
            ray: path.ray,
            branch: path.branch,
            bounce: path.bounce,
            cause,
            quanta: quanta_as_integer(path.quanta),
            origin: ray.origin,
            direction: ray.direction,
            face: face.map(|f| f.0),
            body: path.payload.body(),
        });
    }
}

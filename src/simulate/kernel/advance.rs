//! One step of a path: over its segment, through what it meets, and into the next segment. What a surface or a limit does to its light
//! is booked here alone.

use super::contact::{ContactSurface, FaceHit, LeftContact, contact_surface, end_of_contact, opaque_contact};
use super::interaction::{Division, Interaction, SurfaceInteraction};
use super::media_at::{has_left_by_opening, recover_media};
use super::path::{NO_RECEIVER, Path, SCATTERS};
use super::payload::RayPayload;
use super::receivers::{clip_outside, clip_segment};
use super::surface::interact;
use super::tolerances::way_through_glue;
use super::tracer::Tracer;
use crate::intersect::Hit;
use crate::math::{Ray, Vector};
use crate::optics::polarised::Stokes;
use crate::simulate::body::AMBIENT;
use crate::simulate::outcome::{Event, LostCause};
use crate::simulate::random::Purpose;
use crate::simulate::scene::Interfaces;
use crate::simulate::surfaces::FaceOptics;
use crate::simulate::tally::{quanta_as_integer, round_quanta};

impl<C: RayPayload> Tracer<'_, '_, C> {
    /// Takes a path over its segment to `hit`, or to where a receiver or scattering ends it, and through what it meets; books what light
    /// loses on the way, and sets `path` and `ray` for the next segment. `false` when the path ends; its light is booked then.
    #[inline(always)]
    pub(super) fn advance(&mut self, path: &mut Path<C>, ray: &mut Ray, hit: Option<&Hit>) -> bool {
        let context = self.context;
        let hit = clip_outside(context, path, ray, hit);
        // Receivers that let light through count it, and the medium takes its part, before the surface gets what is left.
        if !self.cover_segment(path, ray, hit) {
            return false;
        }
        let Some(hit) = hit else {
            if C::MEDIA && path.receiver == SCATTERS {
                return self.scatter_in_body(path, ray);
            }
            self.end_without_face(path, ray);
            return false;
        };
        let point = ray.point_at(hit.t);
        // Before the surface has its say: limits of length hold for what has been run.
        path.run(hit.t);
        // An intersector that answers nonsense costs its ray, not the run.
        let face = context.bound.faces.get(hit.face.index());
        let Some(&face) = face.filter(|_| hit.t.is_finite() && hit.normal.is_finite()) else {
            self.lose(path, ray, LostCause::NotANumber, Some(hit.face));
            return false;
        };
        let entering = ray.direction.dot(hit.geometric_normal) < 0.0;
        let mut at = SurfaceInteraction::new(hit, face, entering, point);
        at.normals.in_edge = path.is_caught_in_edge();
        // Of faces at one place another may say what happens.
        let mut partner = None;
        if C::MEDIA && (face.opaque_solid || face.medium_on_opaque || face.touches_body || face.touches_sibling) {
            partner = self.resolve_contact(ray, &mut at);
        }
        if let Some(partner) = &partner {
            at.move_to(partner);
        }
        // From inside an opaque solid nothing can be seen: the ray got in by a gap.
        if at.face.opaque_solid && !at.entering {
            self.record(path, at.point, Event::Lost, Some(at.hit.face));
            self.lose(path, ray, LostCause::InsideSolid, Some(at.hit.face));
            return false;
        }
        if C::MEDIA && at.face.medium_on_opaque && at.face.body == AMBIENT && path.payload.body() != AMBIENT {
            // Light that comes back from an opaque face does not meet the face of its own body on it once more.
            at.skip = context.glue_mm();
        }
        self.apply_surface(path, ray, &mut at)
    }

    /// Counts the light of a segment, up to `hit` or to the end of the clipped `ray`, on receivers that let it pass, then takes from `path`
    /// what the body absorbs. An endless segment is absorbed in the surroundings alone. `false`, and the path ends, where the body took all
    /// of it.
    #[inline(always)]
    fn cover_segment(&mut self, path: &mut Path<C>, ray: &Ray, hit: Option<&Hit>) -> bool {
        let end = hit.map_or(ray.t_max, |h| h.t);
        // Endless segments end in the surroundings; of a body they would take all light that only missed a face by
        // an error.
        let absorbed = C::MEDIA && (end.is_finite() || path.payload.body() == AMBIENT);
        if !C::ENDS_ONLY && !self.context.passing.is_empty() {
            let absorption = if absorbed { self.absorption(path) } else { 0.0 };
            self.count_passing(path, ray, hit, absorption);
        }
        if !absorbed || self.absorb_in_body(path, end) {
            return true;
        }
        // Light that is no more meets nothing: without an end here its path would go on through the face, and end nowhere.
        self.record(path, ray.point_at(end.min(self.context.plan.drawn_length)), Event::Absorbed, None);
        false
    }

    /// Returns the face that says what happens, of several at one place, where that is not the one that was hit; sets `at.entering` and
    /// `at.skip` to match. `None` where the face that was hit does.
    #[inline(always)]
    fn resolve_contact(&self, ray: &Ray, at: &mut SurfaceInteraction<'_>) -> Option<FaceHit> {
        let context = self.context;
        let FaceOptics { opaque_solid, medium_on_opaque, touches_body, touches_sibling, body, .. } = at.face;
        // Light that leaves its body into an opaque face on it meets that face. Light that comes from outside meets the opaque one in
        // any case.
        if !at.entering && (opaque_solid || medium_on_opaque && body != AMBIENT) {
            let opaque = opaque_contact(context, ray, &at.face_hit());
            if opaque.is_some() {
                at.entering = true;
                return opaque;
            }
        }
        // Of two touching bodies, or solids of one, the one with a surface of its own says what happens.
        if context.bound.coated_contacts && (touches_body || touches_sibling) {
            match contact_surface(context, ray, &at.face_hit()) {
                ContactSurface::Bare => {}
                ContactSurface::Own => at.skip = context.glue_mm(),
                ContactSurface::Partner(partner) => {
                    at.entering = !at.entering;
                    at.skip = context.glue_mm();
                    return Some(partner);
                }
            }
        }
        None
    }

    /// Books what the surface does to the light of a path, and sets `path` and `ray` for what goes on; `false` when the path ends.
    #[inline(always)]
    fn apply_surface(&mut self, path: &mut Path<C>, ray: &mut Ray, at: &mut SurfaceInteraction<'_>) -> bool {
        // What the surface does was decided without touching a count; here alone it is booked, so that no power is booked twice or not at
        // all.
        let direction = match interact(self.context, path, ray, at) {
            Interaction::Absorb => {
                self.record(path, at.point, Event::Absorbed, Some(at.hit.face));
                self.absorb_in_face(path, at.hit.face, 0.0);
                None
            }
            Interaction::Pass { payload } => {
                path.payload = payload;
                Some(ray.direction)
            }
            Interaction::Reflect { kept, direction, payload } => {
                path.release();
                // Recorded with what goes on, as where light is divided.
                self.absorb_in_face(path, at.hit.face, kept);
                self.record(path, at.point, Event::Reflected, Some(at.hit.face));
                path.payload = payload;
                Some(direction)
            }
            // Nothing is absorbed and the path is not released: light in a block without end must be seen going round.
            Interaction::ReflectTotally { direction, payload } => {
                self.record(path, at.point, Event::Reflected, Some(at.hit.face));
                path.payload = payload;
                Some(direction)
            }
            Interaction::Divide(division) => Some(self.divide_light(path, ray, at, &division)),
            Interaction::Trap => {
                self.cut_off_trapped(path, at.point);
                None
            }
            Interaction::Lose(cause) => {
                self.record(path, at.point, Event::Lost, Some(at.hit.face));
                self.lose(path, ray, cause, Some(at.hit.face));
                None
            }
        };
        self.tally.counts.corrected_normals += u64::from(at.normals.corrections);
        if C::MEDIA {
            self.tally.counts.refused_contacts += u64::from(at.refused_contact);
        }
        if let Some(pair) = at.overlap {
            self.tally.counts.add_overlap(pair, 1);
        }
        match direction {
            Some(direction) => self.leave_face(path, ray, at, direction),
            None => false,
        }
    }

    /// Sends a path on from a partly reflecting face: one way drawn at random, or, where the run splits and it has power enough,
    /// transmitted with its reflection split off. Books what the face absorbs, and returns the direction to go on in.
    #[inline(always)]
    fn divide_light(
        &mut self,
        path: &mut Path<C>,
        ray: &Ray,
        at: &mut SurfaceInteraction<'_>,
        division: &Division<'_, C>,
    ) -> Vector {
        let context = self.context;
        let settings = context.settings;
        if division.releases {
            path.release();
        }
        // What the coating absorbs goes first: the shares that follow are of what is left.
        if division.kept < path.quanta {
            self.absorb_in_face(path, at.hit.face, division.kept);
        }
        // Both ways are followed while that is worth it; below the floor one is drawn, without which a path would double for ever.
        let splits =
            settings.interfaces == Interfaces::Split && path.quanta > settings.split_floor * path.first_quanta;
        let reflects = if splits {
            !self.split_reflection(path, ray, at, division)
        } else {
            path.key(context).unit(Purpose::Interface) < division.share
        };
        if reflects {
            self.record(path, at.point, Event::Reflected, Some(at.hit.face));
            division.reflect(context, path, ray.direction, at)
        } else {
            self.record(path, at.point, Event::Transmitted, Some(at.hit.face));
            if !C::ENDS_ONLY {
                self.tally.cross(at.hit.face, at.entering, path.quanta);
            }
            division.transmit(context, path, ray.direction, at)
        }
    }

    /// Splits off what is reflected, a whole number of quanta, as a path of its own that waits in `pending`. Returns whether the path
    /// itself is to be transmitted: with less than a quantum to reflect it is, without being split; with all to reflect it is not.
    #[inline(never)]
    fn split_reflection(
        &mut self,
        path: &mut Path<C>,
        ray: &Ray,
        at: &mut SurfaceInteraction<'_>,
        division: &Division<'_, C>,
    ) -> bool {
        // Power is counted in whole quanta: the child gets a whole number and the rest stays, so that the sum is kept to the last one.
        let reflected = round_quanta(path.quanta * division.share);
        if reflected >= 1.0 && reflected < path.quanta {
            // The branch number keys the child's random numbers: its stream is its own, whichever thread traces it and when.
            let mut child = Path { quanta: reflected, branch: path.split_branch(), ..*path };
            let mut child_ray = *ray;
            self.record(&child, at.point, Event::Split, Some(at.hit.face));
            let direction = division.reflect(self.context, &mut child, ray.direction, at);
            if self.leave_face(&mut child, &mut child_ray, at, direction) {
                // Last in, first out, and before new rays: what a ray splits into is finished first, so that little waits.
                self.pending.push((child, child_ray));
            }
            path.quanta -= reflected;
            return true;
        }
        reflected != path.quanta
    }

    /// Starts the next segment of a path at a face, behind both faces of a contact; `false` when a limit cuts the path off.
    #[inline(always)]
    fn leave_face(
        &mut self,
        path: &mut Path<C>,
        ray: &mut Ray,
        at: &SurfaceInteraction<'_>,
        direction: Vector,
    ) -> bool {
        path.bounce += 1;
        let mut next = Ray::new(at.point, direction).with_departure(at.departure());
        // Both faces of a contact were crossed at once: the ray goes on behind the second, which it would meet from the wrong side.
        if C::MEDIA && at.skip > 0.0 {
            let normal = at.hit.geometric_normal;
            let reach = way_through_glue(at.skip, direction.dot(normal));
            let contact = LeftContact { face: at.face, normal, reach, flush_siblings: at.flush_solids > 1 };
            let is_inside = |body| path.payload.cross(body, false).is_some();
            next.t_min = end_of_contact(self.context, &next, &contact, &is_inside);
        }
        self.start_segment(path, ray, next)
    }

    /// Gives a path its next ray, clipped at the next receiver or scattering; `false`, and booked as cut off, when a limit of bounces,
    /// length or power ends it.
    #[inline(always)]
    fn start_segment(&mut self, path: &mut Path<C>, ray: &mut Ray, next: Ray) -> bool {
        let s = self.context.settings;
        // In order of how often they end a path; below one quantum nothing is left that could be counted.
        let exhausted = path.bounce >= s.max_bounces
            || path.length > s.max_length_mm
            || path.quanta <= s.power_floor * path.first_quanta
            || path.quanta < 1.0;
        if exhausted {
            self.cut_off(path, next.origin);
            return false;
        }
        *ray = next;
        clip_segment(self.context, path, ray);
        true
    }

    /// Scatters a path inside its body, at the end of its segment, and starts the next; `false` when a limit cuts the path off.
    #[inline(never)]
    fn scatter_in_body(&mut self, path: &mut Path<C>, ray: &mut Ray) -> bool {
        let context = self.context;
        let body = path.payload.body();
        let Some(scatter) = &context.bound.bodies[body as usize].scatter else {
            debug_assert!(false, "a segment ends at a scattering in a body that does not scatter");
            // Its power is booked all the same: the sums must close.
            self.lose(path, ray, LostCause::NotANumber, None);
            return false;
        };
        let point = ray.point_at(ray.t_max);
        let numbers = path.key(context).pair(Purpose::BulkDirection);
        path.length += ray.t_max;
        path.short_segments = 0;
        // Light that was held by total reflection has another direction now, and may get out.
        path.release();
        // Before it is counted among the hits, as at a face: vertices of a path stand in the order of their hits.
        self.record(path, point, Event::Scattered, None);
        path.bounce += 1;
        let direction = scatter.sample(ray.direction, numbers);
        if let Some(stokes) = path.payload.stokes_mut() {
            *stokes = Stokes::unpolarised(1.0, direction);
        }
        self.start_segment(path, ray, Ray::new(point, direction))
    }

    /// Ends a path whose ray is known to meet no face and books its light; `false`, and nothing done, where it scatters on its way.
    #[inline(always)]
    pub(super) fn finish_escaping(&mut self, path: &mut Path<C>, ray: &mut Ray) -> bool {
        // Light that scatters on its way is not at its end, however free the way is.
        if path.receiver == SCATTERS {
            return false;
        }
        self.tally.counts.segments += 1;
        clip_outside(self.context, path, ray, None);
        if self.cover_segment(path, ray, None) {
            self.end_without_face(path, ray);
        }
        true
    }

    /// Books the end of a path that meets no face: on a receiver, in the far field, escaped, or lost while inside a body.
    #[inline(always)]
    fn end_without_face(&mut self, path: &mut Path<C>, ray: &Ray) {
        let context = self.context;
        if path.receiver != NO_RECEIVER {
            let point = ray.point_at(ray.t_max);
            // Light that reaches a receiver while its payload is still inside a body came out by a gap.
            if C::MEDIA && has_left_by_opening(context, &path.payload, ray, point) {
                self.record(path, point, Event::Lost, None);
                return self.lose(path, ray, LostCause::NoExit, None);
            }
            self.record(path, point, Event::Received, None);
            self.tally.ends.received += quanta_as_integer(path.quanta);
            self.count_at(path, path.quanta, path.receiver, point);
            return;
        }
        if C::MEDIA && path.payload.body() != AMBIENT {
            // To leave the scene inside a medium is possible for an error of crossing alone: if that can be mended, the light escapes.
            match recover_media(context, &path.payload, ray, f64::INFINITY, false) {
                Some(recovered) if recovered.body() == AMBIENT => path.payload = recovered,
                _ => {
                    self.record(path, ray.point_at(1.0), Event::Lost, None);
                    return self.lose(path, ray, LostCause::NoExit, None);
                }
            }
        }
        let received = self.count_far(path, ray);
        self.record(path, ray.point_at(context.plan.drawn_length), Event::Escaped, None);
        let end = if received { &mut self.tally.ends.received } else { &mut self.tally.ends.escaped };
        *end += quanta_as_integer(path.quanta);
    }
}

//! What happens to light at a face, as values that the tracer books.

use super::contact::FaceHit;
use super::context::Context;
use super::path::Path;
use super::payload::RayPayload;
use crate::intersect::Hit;
use crate::math::{Departure, Point, Vector};
use crate::optics::polarised::{Mueller, Stokes};
use crate::optics::{FacetNormals, Scatter, reflect};
use crate::simulate::outcome::LostCause;
use crate::simulate::random::{Key, Purpose};
use crate::simulate::surfaces::FaceOptics;

/// A ray meets a face.
pub(super) struct SurfaceInteraction<'a> {
    pub(super) hit: &'a Hit,
    pub(super) face: FaceOptics,
    /// Whether the ray runs against the outward normal.
    pub(super) entering: bool,
    pub(super) point: Point,
    /// Distance from the face that the next segment passes over, mm: the glue distance at touching faces, else 0.
    pub(super) skip: f64,
    /// Solids of the body of its face that are entered or left here at once.
    pub(super) flush_solids: u32,
    /// Its normals, and how often the facet's own had to be taken.
    pub(super) normals: FacetNormals,
    /// Two bodies that are found to overlap here.
    pub(super) overlap: Option<[u32; 2]>,
    /// Whether another body touches here that light cannot cross into or out of.
    pub(super) refused_contact: bool,
}

/// Interaction of light with a face.
pub(super) enum Interaction<'s, C> {
    /// It ends here.
    Absorb,
    /// It goes straight on: the face is not there for light, or both sides are the same body.
    Pass { payload: C },
    /// So many quanta of it are reflected; the face absorbs the rest.
    Reflect { kept: f64, direction: Vector, payload: C },
    /// All of it is reflected, inside its body.
    ReflectTotally { direction: Vector, payload: C },
    /// It is partly reflected and partly transmitted.
    Divide(Division<'s, C>),
    /// It goes round by total reflection for ever.
    Trap,
    /// It cannot go on.
    Lose(LostCause),
}

/// Both ways on from a partly reflecting face.
pub(super) struct Division<'s, C> {
    /// Quanta that go on, one way or the other; the face absorbs the rest.
    pub(super) kept: f64,
    /// Share of them that is reflected; the rest is transmitted.
    pub(super) share: f64,
    /// What reflection and transmission do to polarisation, where it is carried.
    pub(super) matrices: Option<[Mueller; 2]>,
    /// The normal on which both ways are based.
    pub(super) normal: Vector,
    /// The payload before the face, and the media behind it.
    pub(super) payload: C,
    pub(super) across: C,
    /// Direction of what goes through.
    pub(super) transmitted: Vector,
    pub(super) scatter: Option<&'s Scatter>,
    /// Whether light that is guided by total reflection is released here: not where it passes between bodies of one index.
    pub(super) releases: bool,
}

/// A perfect conductor: s keeps its sign, p changes it, in the convention of [`Stokes`].
pub(super) const CONDUCTOR: Mueller = Mueller { a: 1.0, b: 0.0, c: -1.0, e: 0.0 };

impl<'a> SurfaceInteraction<'a> {
    /// Makes the meeting of a ray with a face at a point, of which nothing is known yet.
    #[inline(always)]
    pub(super) fn new(hit: &'a Hit, face: FaceOptics, entering: bool, point: Point) -> Self {
        let normals = FacetNormals::new(hit.normal, hit.geometric_normal);
        let (skip, flush_solids) = (0.0, 1);
        Self { hit, face, entering, point, skip, flush_solids, normals, overlap: None, refused_contact: false }
    }

    /// Moves the meeting to another face at the same place, which says what happens.
    pub(super) fn move_to(&mut self, other: &'a FaceHit) {
        self.hit = &other.hit;
        self.face = other.face;
        self.point = other.point;
        self.normals =
            FacetNormals { interpolated: other.hit.normal, geometric: other.hit.geometric_normal, ..self.normals };
    }

    /// Returns the place as one that a ray leaves.
    #[inline(always)]
    pub(super) fn departure(&self) -> Departure {
        self.hit.departure()
    }

    /// Returns the hit with its face and point, as the search for other faces at the same place wants it.
    pub(super) fn face_hit(&self) -> FaceHit {
        FaceHit { hit: *self.hit, face: self.face, point: self.point }
    }
}

/// Passes the polarisation of a ray with direction `d` through an interface with normal `n`; its power stays 1. Where the scene does not
/// follow polarisation the frame turns and the light stays unpolarised; a payload without polarisation is left alone.
#[inline(always)]
pub(super) fn turn_polarisation<C: RayPayload>(
    context: &Context<'_>,
    payload: &mut C,
    m: &Mueller,
    d: Vector,
    n: Vector,
) {
    if let Some(stokes) = payload.stokes_mut() {
        let after = stokes.through(m, d, n);
        // Power is kept apart, in quanta: the Stokes vector holds the state alone.
        let unit = if after.i > 0.0 { after.scaled(1.0 / after.i) } else { Stokes::unpolarised(1.0, d) };
        // Where polarisation is not followed the vector still turns with the frame, but each surface sees
        // unpolarised light.
        *stokes = if context.polarised() { unit } else { Stokes { i: 1.0, ..unit.depolarised() } };
    }
}

impl<C: RayPayload> Division<'_, C> {
    /// Gives `path` the payload of what is reflected, and returns its direction, after scatter where the surface is rough.
    #[inline(always)]
    pub(super) fn reflect(
        &self,
        context: &Context<'_>,
        path: &mut Path<C>,
        d: Vector,
        at: &mut SurfaceInteraction<'_>,
    ) -> Vector {
        self.take_payload::<0>(context, path, d);
        let specular = at.normals.reflected(d, self.normal);
        self.scattered_direction(context, path, specular, at)
    }

    /// Gives `path` the payload of what is transmitted, with the media behind the face, and returns its direction, after scatter where the
    /// surface is rough.
    #[inline(always)]
    pub(super) fn transmit(
        &self,
        context: &Context<'_>,
        path: &mut Path<C>,
        d: Vector,
        at: &mut SurfaceInteraction<'_>,
    ) -> Vector {
        self.take_payload::<1>(context, path, d);
        path.payload = path.payload.with_media_of(self.across);
        self.scattered_direction(context, path, self.transmitted, at)
    }

    /// Gives `path` its payload as the interface left it on one of both ways: `WAY` 0 is reflected, 1 transmitted. Media stay those before
    /// it.
    #[inline(always)]
    fn take_payload<const WAY: usize>(&self, context: &Context<'_>, path: &mut Path<C>, d: Vector) {
        path.payload = self.payload;
        if let Some(matrices) = &self.matrices {
            turn_polarisation(context, &mut path.payload, &matrices[WAY], d, self.normal);
        }
    }

    /// Returns the direction after scatter; `specular` where the surface is smooth.
    #[inline(always)]
    fn scattered_direction(
        &self,
        context: &Context<'_>,
        path: &mut Path<C>,
        specular: Vector,
        at: &mut SurfaceInteraction<'_>,
    ) -> Vector {
        match self.scatter {
            Some(scatter) => scatter_at(scatter, path.key(context), &mut path.payload, [specular, self.normal], at),
            None => specular,
        }
    }
}

/// Draws the direction after scatter at a rough surface; `specular` when this light stays specular. What is scattered is unpolarised after;
/// one that dips below the facet is mirrored back and counted.
#[inline(never)]
fn scatter_at<C: RayPayload>(
    scatter: &Scatter,
    key: Key,
    payload: &mut C,
    [specular, normal]: [Vector; 2],
    at: &mut SurfaceInteraction<'_>,
) -> Vector {
    let flat = at.hit.geometric_normal;
    // Both normals on the side that the light leaves to.
    let side = flat * specular.dot(flat).signum();
    let normal = normal * normal.dot(side).signum();
    let [u, v] = key.pair(Purpose::Scatter);
    // `None`: the lobe's share was not drawn, this light stays specular.
    let Some(direction) = scatter.sample(specular, normal, [key.unit(Purpose::Lobe), u, v]) else {
        return specular;
    };
    if let Some(stokes) = payload.stokes_mut() {
        // The model of a rough surface says nothing of phases: what it scatters counts as unpolarised.
        *stokes = Stokes::unpolarised(1.0, direction);
    }
    if direction.dot(side) > 0.0 {
        return direction;
    }
    // The lobe stands about the shading normal and may dip below the surface itself. Mirrored back the power is kept, and the count says
    // how often that was.
    at.normals.corrections += 1;
    reflect(direction, side)
}

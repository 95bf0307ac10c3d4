//! What a ray carries besides place, direction and power: the part of a path that decides which kernel is needed.
//!
//! The six payloads are the six kernels, each of which can do all that the ones before it can: [`Mirror`], [`Opaque`], [`Clear`],
//! [`Nested`], [`Coloured`], [`Full`].

use crate::math::Vector;
use crate::optics::polarised::Stokes;
use crate::simulate::body::AMBIENT;

/// What a ray carries.
pub(crate) trait RayPayload: Copy + Send {
    /// Whether there are media at all; without, a face is opaque and nothing is absorbed on the way.
    const MEDIA: bool;
    /// Whether faces may do more than absorb or reflect a constant share.
    const COATED: bool = true;
    /// Whether only the ends of rays are needed: no path is recorded, no face is tallied, and no receiver lets light pass, selects by
    /// interactions or has channels.
    const ENDS_ONLY: bool = false;
    /// Whether it carries a wavelength.
    const COLOURED: bool = false;
    /// Makes the payload of a ray that is in no body, without a colour of its own.
    fn in_surroundings() -> Self;
    /// Makes the payload of a ray that starts inside these bodies, outermost first; empty for the surroundings. `None` when it cannot carry
    /// so many.
    fn inside(bodies: &[u32]) -> Option<Self>;
    /// Returns the innermost body; [`AMBIENT`] in the surroundings.
    fn body(&self) -> u32;
    /// Returns the same ray on the other side of the boundary of a body. `None` for a crossing that cannot be: out of a body that it is not
    /// in, or into one when it can carry no more.
    fn cross(&self, body: u32, entering: bool) -> Option<Self>;
    /// Returns the same light inside these bodies, outermost first; `None` when it cannot carry so many.
    fn moved_inside(&self, bodies: &[u32]) -> Option<Self> {
        Self::inside(bodies)
    }
    /// Whether it can carry no more bodies.
    fn is_full(&self) -> bool {
        false
    }
    /// Returns the light of this ray in the media of another: after an interface has changed the polarisation, what has crossed it still
    /// has the old one.
    fn with_media_of(&self, other: Self) -> Self {
        other
    }
    /// Returns its wavelength, nm; `None` when it carries none, and has the scene's.
    fn wavelength(&self) -> Option<f64> {
        None
    }
    /// Returns its polarisation, of power 1; `None` when it carries none.
    fn stokes_mut(&mut self) -> Option<&mut Stokes> {
        None
    }
    /// Gives it a colour and a polarisation, where it carries either; what it does not carry is not computed.
    fn set_light(&mut self, _wavelength: Option<f64>, _stokes: impl FnOnce() -> Stokes) {}
}

/// What a ray in a scene without media carries: nothing. Known as [`Mirror`] and, with faces of any kind (`COATED`), as [`Opaque`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoMedia<const COATED: bool>;

/// Power alone, of which faces take a constant share.
pub(crate) type Mirror = NoMedia<false>;
/// Power alone, at faces of any kind.
pub(crate) type Opaque = NoMedia<true>;

impl<const COATED: bool> RayPayload for NoMedia<COATED> {
    const MEDIA: bool = false;
    const COATED: bool = COATED;
    fn in_surroundings() -> Self {
        Self
    }
    fn inside(_: &[u32]) -> Option<Self> {
        Some(Self)
    }
    fn body(&self) -> u32 {
        AMBIENT
    }
    fn cross(&self, _: u32, _: bool) -> Option<Self> {
        // There is no body to enter, so that every crossing of one is impossible.
        None
    }
}

/// The payload `C` of a run that needs only the ends of its rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndsOnly<C>(C);

impl<C: RayPayload> RayPayload for EndsOnly<C> {
    const MEDIA: bool = C::MEDIA;
    const COATED: bool = C::COATED;
    const ENDS_ONLY: bool = true;
    const COLOURED: bool = C::COLOURED;
    fn in_surroundings() -> Self {
        Self(C::in_surroundings())
    }
    fn inside(bodies: &[u32]) -> Option<Self> {
        C::inside(bodies).map(Self)
    }
    #[inline]
    fn body(&self) -> u32 {
        self.0.body()
    }
    #[inline]
    fn cross(&self, body: u32, entering: bool) -> Option<Self> {
        self.0.cross(body, entering).map(Self)
    }
    fn moved_inside(&self, bodies: &[u32]) -> Option<Self> {
        self.0.moved_inside(bodies).map(Self)
    }
    fn is_full(&self) -> bool {
        self.0.is_full()
    }
    #[inline]
    fn with_media_of(&self, other: Self) -> Self {
        Self(self.0.with_media_of(other.0))
    }
    fn wavelength(&self) -> Option<f64> {
        self.0.wavelength()
    }
    fn stokes_mut(&mut self) -> Option<&mut Stokes> {
        self.0.stokes_mut()
    }
    fn set_light(&mut self, wavelength: Option<f64>, stokes: impl FnOnce() -> Stokes) {
        self.0.set_light(wavelength, stokes);
    }
}

/// The one body that a ray is in, for scenes whose bodies neither touch nor nest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clear(u32);

impl RayPayload for Clear {
    const MEDIA: bool = true;
    fn in_surroundings() -> Self {
        Self(AMBIENT)
    }
    fn inside(bodies: &[u32]) -> Option<Self> {
        match bodies {
            [] => Some(Self(AMBIENT)),
            [body] => Some(Self(*body)),
            // Two bodies at once ask for the stack of [`Nested`].
            _ => None,
        }
    }
    #[inline]
    fn body(&self) -> u32 {
        self.0
    }
    #[inline]
    fn cross(&self, body: u32, entering: bool) -> Option<Self> {
        // Into a body from the surroundings alone, and out of the one that it is in: all else is a crossing that
        // cannot be.
        if entering { (self.0 == AMBIENT).then_some(Self(body)) } else { (self.0 == body).then_some(Self(AMBIENT)) }
    }
}

/// Most bodies around a point that a ray can carry: with the depth a stack of 32 bytes.
pub(crate) const DEPTH: usize = 7;

/// The bodies that a ray is in, as a stack, the innermost last. A body may be left from below the top: so overlapping and touching solids
/// hand light over in either order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nested {
    bodies: [u32; DEPTH],
    depth: u32,
}

impl RayPayload for Nested {
    const MEDIA: bool = true;
    fn in_surroundings() -> Self {
        Self { bodies: [AMBIENT; DEPTH], depth: 0 }
    }
    fn is_full(&self) -> bool {
        self.depth as usize == DEPTH
    }
    fn inside(bodies: &[u32]) -> Option<Self> {
        let mut stack = Self { bodies: [AMBIENT; DEPTH], depth: bodies.len() as u32 };
        stack.bodies.get_mut(..bodies.len())?.copy_from_slice(bodies);
        Some(stack)
    }
    #[inline]
    fn body(&self) -> u32 {
        match self.depth {
            0 => AMBIENT,
            n => self.bodies[n as usize - 1],
        }
    }
    #[inline]
    fn cross(&self, body: u32, entering: bool) -> Option<Self> {
        let mut next = *self;
        let n = self.depth as usize;
        if entering {
            *next.bodies.get_mut(n)? = body;
            next.depth += 1;
        } else {
            // Not always the innermost: where bodies overlap, light may leave the outer one first.
            let at = self.bodies[..n].iter().rposition(|b| *b == body)?;
            next.bodies.copy_within(at + 1..n, at);
            next.bodies[n - 1] = AMBIENT;
            next.depth -= 1;
        }
        Some(next)
    }
}

/// The bodies that a ray is in, and its wavelength.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coloured {
    stack: Nested,
    wavelength: Option<f64>,
}

impl RayPayload for Coloured {
    const MEDIA: bool = true;
    const COLOURED: bool = true;
    fn in_surroundings() -> Self {
        Self { stack: Nested::in_surroundings(), wavelength: None }
    }
    fn is_full(&self) -> bool {
        self.stack.is_full()
    }
    fn inside(bodies: &[u32]) -> Option<Self> {
        Some(Self { stack: Nested::inside(bodies)?, wavelength: None })
    }
    fn moved_inside(&self, bodies: &[u32]) -> Option<Self> {
        Some(Self { stack: Nested::inside(bodies)?, ..*self })
    }
    fn body(&self) -> u32 {
        self.stack.body()
    }
    fn cross(&self, body: u32, entering: bool) -> Option<Self> {
        Some(Self { stack: self.stack.cross(body, entering)?, ..*self })
    }
    fn wavelength(&self) -> Option<f64> {
        self.wavelength
    }
    fn set_light(&mut self, wavelength: Option<f64>, _: impl FnOnce() -> Stokes) {
        self.wavelength = wavelength;
    }
}

/// The bodies that a ray is in, its wavelength and its state of polarisation: all that a ray can carry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Full {
    coloured: Coloured,
    stokes: Stokes,
}

impl RayPayload for Full {
    const MEDIA: bool = true;
    const COLOURED: bool = true;
    fn in_surroundings() -> Self {
        Self { coloured: Coloured::in_surroundings(), stokes: Stokes::unpolarised(1.0, Vector::Z) }
    }
    fn is_full(&self) -> bool {
        self.coloured.is_full()
    }
    fn with_media_of(&self, other: Self) -> Self {
        Self { stokes: self.stokes, ..other }
    }
    fn inside(bodies: &[u32]) -> Option<Self> {
        Some(Self { coloured: Coloured::inside(bodies)?, stokes: Stokes::unpolarised(1.0, Vector::Z) })
    }
    fn moved_inside(&self, bodies: &[u32]) -> Option<Self> {
        Some(Self { coloured: self.coloured.moved_inside(bodies)?, ..*self })
    }
    fn body(&self) -> u32 {
        self.coloured.body()
    }
    fn cross(&self, body: u32, entering: bool) -> Option<Self> {
        Some(Self { coloured: self.coloured.cross(body, entering)?, ..*self })
    }
    fn wavelength(&self) -> Option<f64> {
        self.coloured.wavelength
    }
    fn stokes_mut(&mut self) -> Option<&mut Stokes> {
        Some(&mut self.stokes)
    }
    fn set_light(&mut self, wavelength: Option<f64>, stokes: impl FnOnce() -> Stokes) {
        self.coloured.wavelength = wavelength;
        self.stokes = stokes();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_left_in_any_order() {
        let s = Nested::inside(&[]).unwrap().cross(1, true).unwrap().cross(2, true).unwrap();
        assert_eq!(s.body(), 2);
        assert_eq!(s.cross(2, false).unwrap().body(), 1);
        let left = s.cross(1, false).unwrap();
        assert_eq!(left.body(), 2);
        assert_eq!(left.cross(2, false).unwrap().body(), AMBIENT);
        assert!(left.cross(1, false).is_none());
        let mut deep = Nested::inside(&[]).unwrap();
        for _ in 0..DEPTH {
            deep = deep.cross(1, true).unwrap();
        }
        assert!(deep.cross(1, true).is_none());
    }

    #[test]
    fn one_body_agrees_with_a_stack_where_bodies_stand_apart() {
        let (a, s) = (Clear::inside(&[]).unwrap(), Nested::inside(&[]).unwrap());
        for (body, entering) in [(1, true), (2, true), (1, false), (3, false)] {
            let (x, y) = (a.cross(body, entering), s.cross(body, entering));
            assert_eq!(x.map(|c| c.body()), y.map(|c| c.body()));
        }
        assert!(a.cross(1, true).unwrap().cross(2, true).is_none());
    }
}

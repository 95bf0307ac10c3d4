use crate::math::Vector;
use crate::optics::polarised::Stokes;
use crate::simulate::bind::AMBIENT;

/// What a ray carries besides place, direction and power: the part of a path that decides which kernel is needed.
pub(crate) trait Carry: Copy + Send {
    /// Whether there are media at all; without, a face is opaque and nothing is absorbed on the way.
    const MEDIA: bool;
    /// Whether faces may do more than absorb or reflect a constant share.
    const COATED: bool = true;
    /// Whether nothing is asked about a ray on its way but where it ends: no paths are recorded, and no receiver lets light pass,
    /// asks for colours or counts some bounces only.
    const PLAIN: bool = false;
    /// A ray that starts inside these bodies, outermost first; `None` when it cannot carry so many.
    fn inside(bodies: &[u16]) -> Option<Self>;
    /// The innermost body.
    fn body(&self) -> u16;
    /// The same ray on the other side of the boundary of a body; `None` for a crossing that cannot be.
    fn across(&self, body: u16, entering: bool) -> Option<Self>;
    /// The same light inside these bodies.
    fn instead(&self, bodies: &[u16]) -> Option<Self> {
        Self::inside(bodies)
    }
    /// Whether it can carry no more bodies.
    fn is_full(&self) -> bool {
        false
    }
    /// `across` with the light of `self`: after an interface has changed the polarisation, `across` still has the old one.
    fn moved(&self, across: Self) -> Self {
        across
    }
    /// Whether it carries a wavelength.
    const COLOURED: bool = false;
    /// Its wavelength, nm, when it carries one.
    fn wavelength(&self) -> Option<f64> {
        None
    }
    /// Its polarisation, of power 1, when it carries one.
    fn stokes(&mut self) -> Option<&mut Stokes> {
        None
    }
    /// Gives it a colour and a polarisation.
    fn light(&mut self, _wavelength: Option<f64>, _stokes: impl FnOnce() -> Stokes) {}
}

/// No media: faces in empty space, of any kind where `COATED`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Empty<const COATED: bool>;

/// Faces of any kind in empty space.
pub(crate) type Nothing = Empty<true>;
/// Faces that absorb or reflect a constant share, in empty space.
pub(crate) type Mirrors = Empty<false>;

impl<const COATED: bool> Carry for Empty<COATED> {
    const MEDIA: bool = false;
    const COATED: bool = COATED;
    fn inside(_: &[u16]) -> Option<Self> {
        Some(Self)
    }
    fn body(&self) -> u16 {
        AMBIENT
    }
    fn across(&self, _: u16, _: bool) -> Option<Self> {
        None
    }
}

/// The same light where nothing is asked about it but where it ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain<C>(C);

impl<C: Carry> Carry for Plain<C> {
    const MEDIA: bool = C::MEDIA;
    const COATED: bool = C::COATED;
    const PLAIN: bool = true;
    const COLOURED: bool = C::COLOURED;
    fn inside(bodies: &[u16]) -> Option<Self> {
        C::inside(bodies).map(Self)
    }
    #[inline]
    fn body(&self) -> u16 {
        self.0.body()
    }
    #[inline]
    fn across(&self, body: u16, entering: bool) -> Option<Self> {
        self.0.across(body, entering).map(Self)
    }
    fn instead(&self, bodies: &[u16]) -> Option<Self> {
        self.0.instead(bodies).map(Self)
    }
    fn is_full(&self) -> bool {
        self.0.is_full()
    }
    #[inline]
    fn moved(&self, across: Self) -> Self {
        Self(self.0.moved(across.0))
    }
    fn wavelength(&self) -> Option<f64> {
        self.0.wavelength()
    }
    fn stokes(&mut self) -> Option<&mut Stokes> {
        self.0.stokes()
    }
    fn light(&mut self, wavelength: Option<f64>, stokes: impl FnOnce() -> Stokes) {
        self.0.light(wavelength, stokes);
    }
}

/// One body at a time: bodies that neither touch nor nest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OneBody(u16);

impl Carry for OneBody {
    const MEDIA: bool = true;
    fn inside(bodies: &[u16]) -> Option<Self> {
        match bodies {
            [] => Some(Self(AMBIENT)),
            [body] => Some(Self(*body)),
            _ => None,
        }
    }
    #[inline]
    fn body(&self) -> u16 {
        self.0
    }
    #[inline]
    fn across(&self, body: u16, entering: bool) -> Option<Self> {
        match entering {
            true => (self.0 == AMBIENT).then_some(Self(body)),
            false => (self.0 == body).then_some(Self(AMBIENT)),
        }
    }
}

/// Deepest nesting of bodies.
pub(crate) const DEPTH: usize = 7;

/// A stack of bodies, innermost last. A body may be left from below the top: so overlapping and touching solids hand light over
/// in either order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stack {
    bodies: [u16; DEPTH],
    depth: u16,
}

impl Carry for Stack {
    const MEDIA: bool = true;
    fn is_full(&self) -> bool {
        self.depth as usize == DEPTH
    }
    fn inside(bodies: &[u16]) -> Option<Self> {
        let mut stack = Self { bodies: [AMBIENT; DEPTH], depth: bodies.len() as u16 };
        stack.bodies.get_mut(..bodies.len())?.copy_from_slice(bodies);
        Some(stack)
    }
    #[inline]
    fn body(&self) -> u16 {
        match self.depth {
            0 => AMBIENT,
            n => self.bodies[n as usize - 1],
        }
    }
    #[inline]
    fn across(&self, body: u16, entering: bool) -> Option<Self> {
        let mut next = *self;
        let n = self.depth as usize;
        if entering {
            *next.bodies.get_mut(n)? = body;
            next.depth += 1;
        } else {
            let at = self.bodies[..n].iter().rposition(|b| *b == body)?;
            next.bodies.copy_within(at + 1..n, at);
            next.bodies[n - 1] = AMBIENT;
            next.depth -= 1;
        }
        Some(next)
    }
}

/// A stack of bodies and a wavelength.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coloured {
    stack: Stack,
    wavelength: Option<f64>,
}

impl Carry for Coloured {
    const MEDIA: bool = true;
    const COLOURED: bool = true;
    fn is_full(&self) -> bool {
        self.stack.is_full()
    }
    fn inside(bodies: &[u16]) -> Option<Self> {
        Some(Self { stack: Stack::inside(bodies)?, wavelength: None })
    }
    fn instead(&self, bodies: &[u16]) -> Option<Self> {
        Some(Self { stack: Stack::inside(bodies)?, ..*self })
    }
    fn body(&self) -> u16 {
        self.stack.body()
    }
    fn across(&self, body: u16, entering: bool) -> Option<Self> {
        Some(Self { stack: self.stack.across(body, entering)?, ..*self })
    }
    fn wavelength(&self) -> Option<f64> {
        self.wavelength
    }
    fn light(&mut self, wavelength: Option<f64>, _: impl FnOnce() -> Stokes) {
        self.wavelength = wavelength;
    }
}

/// A stack of bodies, a wavelength and a state of polarisation: all there is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Everything {
    coloured: Coloured,
    stokes: Stokes,
}

impl Carry for Everything {
    const MEDIA: bool = true;
    const COLOURED: bool = true;
    fn is_full(&self) -> bool {
        self.coloured.is_full()
    }
    fn moved(&self, across: Self) -> Self {
        Self { stokes: self.stokes, ..across }
    }
    fn inside(bodies: &[u16]) -> Option<Self> {
        Some(Self { coloured: Coloured::inside(bodies)?, stokes: Stokes::unpolarised(1.0, Vector::Z) })
    }
    fn instead(&self, bodies: &[u16]) -> Option<Self> {
        Some(Self { coloured: self.coloured.instead(bodies)?, ..*self })
    }
    fn body(&self) -> u16 {
        self.coloured.body()
    }
    fn across(&self, body: u16, entering: bool) -> Option<Self> {
        Some(Self { coloured: self.coloured.across(body, entering)?, ..*self })
    }
    fn wavelength(&self) -> Option<f64> {
        self.coloured.wavelength
    }
    fn stokes(&mut self) -> Option<&mut Stokes> {
        Some(&mut self.stokes)
    }
    fn light(&mut self, wavelength: Option<f64>, stokes: impl FnOnce() -> Stokes) {
        self.coloured.wavelength = wavelength;
        self.stokes = stokes();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_left_in_any_order() {
        let s = Stack::inside(&[]).unwrap().across(1, true).unwrap().across(2, true).unwrap();
        assert_eq!(s.body(), 2);
        assert_eq!(s.across(2, false).unwrap().body(), 1);
        let left = s.across(1, false).unwrap();
        assert_eq!(left.body(), 2);
        assert_eq!(left.across(2, false).unwrap().body(), AMBIENT);
        assert!(left.across(1, false).is_none());
        let mut deep = Stack::inside(&[]).unwrap();
        for _ in 0..DEPTH {
            deep = deep.across(1, true).unwrap();
        }
        assert!(deep.across(1, true).is_none());
    }

    #[test]
    fn one_body_agrees_with_a_stack_where_bodies_stand_apart() {
        let (a, s) = (OneBody::inside(&[]).unwrap(), Stack::inside(&[]).unwrap());
        for (body, entering) in [(1, true), (2, true), (1, false), (3, false)] {
            let (x, y) = (a.across(body, entering), s.across(body, entering));
            assert_eq!(x.map(|c| c.body()), y.map(|c| c.body()));
        }
        assert!(a.across(1, true).unwrap().across(2, true).is_none());
    }
}

//! Sources in the form that makes rays.

mod area;
mod file;
mod sheaf;
mod stream;
mod wide;

use super::bind::{Body, Light};
use super::scene::{self, Scene, SourceKind};
use super::{Error, ErrorKind};
use crate::formats::PhotometricType;
use crate::intersect::Beam;
use crate::math::{FaceId, Frame, Point, Ray, Vector, orthonormal_pair};
use crate::optics::sampling::sin_cos_turns;
use crate::optics::{IntensitySampler, Spectrum, Wavelengths};
pub(crate) use area::Area;
pub(crate) use file::{Loaded, load};
use smallvec::SmallVec;
pub(crate) use stream::{Stream, Ticket};

/// A source ready to emit.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) power: f64,
    pub(crate) rays: Option<u64>,
    /// Bodies around it, outermost first.
    pub(crate) inside: SmallVec<[u16; 4]>,
    /// Whether the scene says so; geometry tells otherwise.
    pub(crate) stated: bool,
    /// Its spectrum, when the scene has several wavelengths.
    wavelengths: Option<Wavelengths>,
    /// Direction of the electric field of polarised light.
    pub(crate) polarised: Option<Vector>,
    frame: Frame,
    shape: Shape,
    lobe: Lobe,
}

#[derive(Clone, Debug)]
enum Shape {
    Point,
    Faces(Area),
    /// Origins and directions of measured rays.
    List(file::RayList),
    Disc(f64),
    Rectangle([f64; 2]),
}

#[derive(Clone, Debug)]
enum Lobe {
    Measured(IntensitySampler),
    /// Even within a cone of that cosine; -1 for all directions.
    Cone(f64),
    Collimated,
    /// Intensity ∝ cosⁿ; `1/(n+1)` is kept.
    Cosine(f64),
}

/// What a ray has besides itself as it leaves its source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaving {
    /// The face it leaves, with the face's outward normal there.
    pub(crate) from: Option<(FaceId, Vector)>,
    /// Wavelength, nm; absent when the scene has but one.
    pub(crate) wavelength: Option<f64>,
}

impl Emitter {
    pub(crate) fn new(
        scene: &Scene,
        i: usize,
        bodies: &[Body],
        light: &Light,
        loaded: Option<Loaded>,
        area: Option<Area>,
    ) -> Result<Self, Error> {
        let s = &scene.sources[i];
        let (direction, at) = (Vector::from_array(s.direction), Point::from_array(s.at));
        let mut shape = match (s.radius, s.size) {
            (Some(r), _) => Shape::Disc(r),
            (None, Some([a, b])) => Shape::Rectangle([0.5 * a, 0.5 * b]),
            (None, None) => Shape::Point,
        };
        if let Some(area) = area {
            shape = Shape::Faces(area);
        }
        let mut frame = Frame::from_axis(at, direction, s.x.map(Vector::from_array));
        let mut lobe = match s.kind {
            SourceKind::Cone => Lobe::Cone(s.half_angle_deg.unwrap_or(180.0).to_radians().cos()),
            SourceKind::Collimated => Lobe::Collimated,
            SourceKind::Lambertian => Lobe::Cosine(0.5),
            SourceKind::Cosine => Lobe::Cosine(1.0 / (s.exponent.unwrap_or(1.0) + 1.0)),
            _ => Lobe::Cone(-1.0),
        };
        let mut own_power = 1.0;
        let mut coloured_list = false;
        match loaded {
            Some(Loaded::Intensity(sampler, kind, flux)) => {
                if kind == PhotometricType::C {
                    // C runs counterclockwise for one who looks along the light: the plan of a luminaire that shines down.
                    frame.y = -frame.y;
                } else {
                    // To positive H, to positive V, forward: as far fields have it.
                    frame = super::receiver::far_axes(at, direction, s.x.map_or(Vector::Y, Vector::from_array));
                }
                (lobe, own_power) = (Lobe::Measured(sampler), flux);
            }
            Some(Loaded::Rays(list)) => {
                own_power = list.power();
                coloured_list = list.rays.iter().any(|r| r.wavelength_nm.is_some());
                shape = Shape::List(list);
            }
            None => {}
        }
        let mut inside = SmallVec::new();
        for instance in s.inside.iter().flat_map(|n| n.as_slice()) {
            let Some(body) = bodies.iter().skip(1).position(|b| b.name == *instance) else {
                let at = [scene::Key::Name("source"), scene::Key::Index(i), scene::Key::Name("inside")];
                let message = format!("no instance called '{instance}' has a medium");
                let names: Vec<&str> = bodies.iter().skip(1).map(|b| b.name.as_str()).collect();
                let advice = match names.is_empty() {
                    true => "no instance has a `medium`; leave `inside` out".into(),
                    false => scene::suggest::any(instance, &names),
                };
                return Err(scene.error(ErrorKind::NoMatch, &at, message).help(advice));
            };
            inside.push(body as u16 + 1);
        }
        let wavelengths = match (&s.spectrum, light.coloured) {
            (_, false) => None,
            (None, true) if coloured_list => None,
            (None, true) => Spectrum::line(scene.run.wavelength_nm).sampler().ok(),
            (Some(key), true) => key.wavelengths(scene.run.unit).ok(),
        };
        let polarised = s.polarised.map(Vector::from_array);
        let power = s.power.unwrap_or(own_power);
        Ok(Self {
            wavelengths,
            polarised,
            power,
            rays: s.rays,
            inside,
            stated: s.inside.is_some(),
            frame,
            shape,
            lobe,
        })
    }

    /// Which pairs of numbers it asks for.
    pub(crate) fn pairs(&self) -> [bool; 3] {
        let (list, point) = (matches!(self.shape, Shape::List(_)), matches!(self.shape, Shape::Point));
        [!(list || point), !(list || matches!(self.lobe, Lobe::Collimated)), self.wavelengths.is_some()]
    }

    /// What its rays have in common.
    pub(crate) fn beam(&self) -> Option<Beam> {
        let (origin, direction) = (self.frame.origin, self.frame.z);
        match (&self.shape, &self.lobe) {
            (Shape::Point, _) => Some(Beam::Point(origin)),
            (Shape::Disc(_) | Shape::Rectangle(_), Lobe::Collimated) => {
                Some(Beam::Collimated { origin, direction })
            }
            _ => None,
        }
    }

    /// Points around the places it shines from, faces and lists of rays left out.
    pub(crate) fn reach(&self) -> [Point; 2] {
        let size = match &self.shape {
            Shape::Disc(radius) => *radius,
            Shape::Rectangle([a, b]) => a.hypot(*b),
            Shape::Point | Shape::Faces(_) | Shape::List(_) => 0.0,
        };
        [self.frame.origin - Vector::splat(size), self.frame.origin + Vector::splat(size)]
    }

    /// Puts the ray to start after `started` others of this source and replicate into `ray`; the first of them has the number `first`
    /// in the run. By reference: a whole ray that is written in pieces and copied at once was waited for, 15 % of the kernel's time.
    #[inline(always)]
    pub(crate) fn next(&self, stream: &mut Stream, first: u64, started: u32, ray: &mut Ray) -> (Ticket, Leaving) {
        let index = stream.prepare(self, started);
        let ticket = Ticket { ray: first + u64::from(index), index };
        let Some((origin, direction)) = stream.ready(started) else {
            return (ticket, self.emit(stream, ticket, ray));
        };
        *ray = Ray::new(origin, direction);
        (ticket, Leaving { from: None, wavelength: self.wavelength(stream, ticket) })
    }

    /// Puts the ray of an index in this source and replicate, the one ray that is started, into `ray`.
    pub(crate) fn alone(&self, stream: &mut Stream, first: u64, index: u32, ray: &mut Ray) -> (Ticket, Leaving) {
        let ticket = Ticket { ray: first + u64::from(index), index: stream.prepare_alone(index) };
        (ticket, self.emit(stream, ticket, ray))
    }

    #[inline(always)]
    fn wavelength(&self, stream: &Stream, ticket: Ticket) -> Option<f64> {
        let wavelengths = self.wavelengths.as_ref()?;
        Some(wavelengths.sample(stream.pair(ticket, 2)[0]))
    }

    /// A ray of this source.
    #[inline(never)]
    fn emit(&self, stream: &Stream, ticket: Ticket, ray: &mut Ray) -> Leaving {
        let f = &self.frame;
        let mut leaving = Leaving { from: None, wavelength: self.wavelength(stream, ticket) };
        *ray = Ray::new(f.origin, f.z);
        let mut axes = [f.x, f.y, f.z];
        match &self.shape {
            Shape::Point => {}
            Shape::Disc(radius) => {
                let [u, v] = stream.pair(ticket, 0);
                let (r, (sin, cos)) = (radius_on_disc(*radius, u), sin_cos_turns(v));
                ray.origin = f.origin + f.x * (r * cos) + f.y * (r * sin);
            }
            Shape::Rectangle(half) => {
                let [x, y] = on_rectangle(*half, stream.pair(ticket, 0));
                ray.origin = f.origin + f.x * x + f.y * y;
            }
            Shape::Faces(area) => {
                let (point, normal, face) = area.point(stream, ticket);
                let (x, y) = orthonormal_pair(normal);
                ray.origin = point;
                leaving.from = Some((face, normal));
                axes = [x, y, normal];
            }
            Shape::List(list) => {
                let r = list.at(stream.systematic(ticket));
                *ray = Ray::new(f.point(r.origin), f.direction(r.direction));
                leaving.wavelength = leaving.wavelength.or(r.wavelength_nm);
                return leaving;
            }
        }
        ray.direction = match &self.lobe {
            Lobe::Collimated => axes[2],
            Lobe::Cone(limit) => {
                let [u, v] = stream.pair(ticket, 1);
                turned(axes, cosine_of_cone(*limit, u), v)
            }
            Lobe::Cosine(exponent) => {
                let [u, v] = stream.pair(ticket, 1);
                let u = 1.0 - u;
                turned(axes, if *exponent == 0.5 { u.sqrt() } else { u.powf(*exponent) }, v)
            }
            Lobe::Measured(sampler) => f.direction(sampler.sample(stream.pair(ticket, 1))),
        };
        leaving
    }
}

/// How far from its middle a point of a disc lies.
#[inline(always)]
fn radius_on_disc(radius: f64, u: f64) -> f64 {
    radius * u.sqrt()
}

/// The coordinates of a point of a rectangle, from half its sides.
#[inline(always)]
fn on_rectangle([a, b]: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    [a * (2.0 * u - 1.0), b * (2.0 * v - 1.0)]
}

/// Cosine to the axis of a cone whose rim has the cosine `limit`.
#[inline(always)]
fn cosine_of_cone(limit: f64, u: f64) -> f64 {
    1.0 - u * (1.0 - limit)
}

#[inline(always)]
fn sine_of(cosine: f64) -> f64 {
    ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt()
}

/// The direction with this cosine to the last of three axes, turned around it by a share `v` of a whole turn.
fn turned(axes: [Vector; 3], cos_theta: f64, v: f64) -> Vector {
    let (sin_theta, (sin, cos)) = (sine_of(cos_theta), sin_cos_turns(v));
    axes[0] * (sin_theta * cos) + axes[1] * (sin_theta * sin) + axes[2] * cos_theta
}

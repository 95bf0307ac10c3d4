//! Sources in the form that makes rays.

use super::bind::{Body, Light};
use super::random::{self, Key, Purpose};
use super::scene::{self, Sampling, Scene, SourceKind};
use super::{Error, ErrorKind};
use crate::math::{Frame, Point, Ray, Vector};
use crate::model::Model;
use crate::optics::{Spectrum, Wavelengths};
use smallvec::SmallVec;
use std::f64::consts::TAU;

/// A source ready to emit.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) power: f64,
    pub(crate) rays: Option<u64>,
    /// Bodies around it, outermost first.
    pub(crate) inside: SmallVec<[u16; 4]>,
    /// Its spectrum, when the scene has several wavelengths.
    wavelengths: Option<Wavelengths>,
    /// Direction of the electric field of polarised light.
    pub(crate) polarised: Option<Vector>,
    frame: Frame,
    shape: Shape,
    lobe: Lobe,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Point,
    Disc(f64),
    Rectangle([f64; 2]),
}

#[derive(Clone, Copy, Debug)]
enum Lobe {
    /// Even within a cone of that cosine; -1 for all directions.
    Cone(f64),
    Collimated,
    /// Intensity ∝ cosⁿ; `1/(n+1)` is kept.
    Cosine(f64),
}

/// Where the numbers of one source in one replicate come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stream {
    pub(crate) seed: u64,
    pub(crate) sampling: Sampling,
    /// Scrambles of the dimensions of the net.
    scrambles: [u32; random::DIMENSIONS],
}

impl Stream {
    pub(crate) fn new(seed: u64, sampling: Sampling, replicate: u32, source: u32) -> Self {
        let key = Key { seed, ray: u64::from(replicate), branch: source, bounce: 0 };
        let (a, b) = (key.words(Purpose::Scramble), Key { bounce: 1, ..key }.words(Purpose::Scramble));
        let all = [a[0], a[1], a[2], a[3], b[0], b[1]];
        Self { seed, sampling, scrambles: all }
    }

    /// Two numbers in `[0, 1)`, the `pair`-th pair of ray `ray`, which is the `index`-th of its source and replicate.
    #[inline]
    fn pair(&self, ray: u64, index: u32, pair: u32) -> [f64; 2] {
        match self.sampling {
            Sampling::Random => Key { seed: self.seed, ray, branch: 0, bounce: pair }.pair(Purpose::Source),
            Sampling::Sobol => {
                let number = |d: usize| {
                    (f64::from(random::scrambled(index, d, self.scrambles[d])) + 0.5) * (1.0 / 4_294_967_296.0)
                };
                let d = 2 * pair as usize;
                [number(d), number(d + 1)]
            }
        }
    }
}

impl Emitter {
    pub(crate) fn new(
        scene: &Scene,
        i: usize,
        s: &scene::Source,
        model: &Model,
        bodies: &[Body],
        light: &Light,
    ) -> Result<Self, Error> {
        let (direction, at) = (Vector::from_array(s.direction), Point::from_array(s.at));
        let shape = match (s.radius, s.size) {
            (Some(r), _) => Shape::Disc(r),
            (None, Some([a, b])) => Shape::Rectangle([0.5 * a, 0.5 * b]),
            (None, None) => Shape::Point,
        };
        let lobe = match s.kind {
            SourceKind::Point => Lobe::Cone(-1.0),
            SourceKind::Cone => Lobe::Cone(s.half_angle_deg.unwrap_or(180.0).to_radians().cos()),
            SourceKind::Collimated => Lobe::Collimated,
            SourceKind::Lambertian => Lobe::Cosine(0.5),
            SourceKind::Cosine => Lobe::Cosine(1.0 / (s.exponent.unwrap_or(1.0) + 1.0)),
        };

        let mut inside = SmallVec::new();
        for instance in s.inside.iter().flat_map(|n| n.as_slice()) {
            let Some(body) = bodies.iter().skip(1).position(|b| b.name == *instance) else {
                let at = [scene::Key::Name("source"), scene::Key::Index(i), scene::Key::Name("inside")];
                let known = model.instances.iter().any(|x| x.name == *instance);
                let what = if known { "has no medium" } else { "is no instance of the model" };
                return Err(scene.error(ErrorKind::NoMatch, &at, format!("'{instance}' {what}")));
            };
            inside.push(body as u16 + 1);
        }
        let x = s.x.map(Vector::from_array);
        let wavelengths = match (&s.spectrum, light.coloured) {
            (_, false) => None,
            (None, true) => Spectrum::line(scene.run.wavelength_nm).sampler().ok(),
            (Some(key), true) => key.optics().ok().and_then(|s| s.sampler().ok()),
        };
        let polarised = s.polarised.map(Vector::from_array);
        Ok(Self {
            wavelengths,
            polarised,
            power: s.power,
            rays: s.rays,
            inside,
            frame: Frame::from_axis(at, direction, x),
            shape,
            lobe,
        })
    }

    /// Wavelength of a ray, nm; absent when the scene has but one.
    pub(crate) fn wavelength(&self, stream: &Stream, ray: u64, index: u32) -> Option<f64> {
        self.wavelengths.as_ref().map(|w| w.sample(stream.pair(ray, index, 2)[0]))
    }

    /// Ray `ray` of the run, the `index`-th of this source and replicate.
    #[inline]
    pub(crate) fn emit(&self, stream: &Stream, ray: u64, index: u32) -> Ray {
        let f = &self.frame;
        let origin = match self.shape {
            Shape::Point => f.origin,
            Shape::Disc(radius) => {
                let [u, v] = stream.pair(ray, index, 0);
                let (sin, cos) = (TAU * v).sin_cos();
                let r = radius * u.sqrt();
                f.origin + f.x * (r * cos) + f.y * (r * sin)
            }
            Shape::Rectangle([a, b]) => {
                let [u, v] = stream.pair(ray, index, 0);
                f.origin + f.x * (a * (2.0 * u - 1.0)) + f.y * (b * (2.0 * v - 1.0))
            }
        };
        let turned = |cos_theta: f64, v: f64| {
            let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
            let (sin, cos) = (TAU * v).sin_cos();
            f.x * (sin_theta * cos) + f.y * (sin_theta * sin) + f.z * cos_theta
        };
        let direction = match self.lobe {
            Lobe::Collimated => f.z,
            Lobe::Cone(limit) => {
                let [u, v] = stream.pair(ray, index, 1);
                turned(1.0 - u * (1.0 - limit), v)
            }
            Lobe::Cosine(exponent) => {
                let [u, v] = stream.pair(ray, index, 1);
                let u = 1.0 - u;
                turned(if exponent == 0.5 { u.sqrt() } else { u.powf(exponent) }, v)
            }
        };
        Ray::new(origin, direction)
    }
}

//! Sources in the form from which rays are sampled.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod area;
mod cover;
mod far;
mod flux_conversion;
mod measured;
mod mixed_packet;
mod near_start;
mod own_wavelengths;
mod packet;
mod ray_list;
mod running_sums;
mod sampler;
mod shape;
mod simd_dispatch;
mod stream;

use super::body::Body;
use super::far_angles::far_axes;
use super::scene::{self, Scene, Source, SourceKind};
use super::surfaces::SceneLight;
use super::{Error, ErrorKind};
use crate::formats::{LightRay, PhotometricType};
use crate::intersect::Beam;
use crate::math::{Aabb, FaceId, Frame, Point, Ray, Vector, orthonormal_pair};
use crate::optics::sampling::sin_cos_turns;
use crate::optics::{Spectrum, Wavelengths};
use crate::text;
pub(crate) use area::{Area, CoveredArea};
pub(crate) use cover::Cover;
pub(crate) use measured::{Loaded, load};
pub(crate) use mixed_packet::{MixedPacket, MixedRay};
use near_start::NearStart;
pub(crate) use ray_list::{ListCursor, RayList};
pub(crate) use sampler::RaySampler;
use shape::{
    LAMBERTIAN, Lobe, Shape, cosine_of_power, direction_about_axis, point_on_rectangle, radius_on_disc,
    sine_from_cosine, sine_from_versine, versine, versine_in_cone,
};
use smallvec::SmallVec;
use std::f64::consts::PI;
use stream::Stream;
pub(crate) use stream::{Portion, RayIndex};

/// A source ready to emit.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    /// Its power, in the unit of the run.
    pub(crate) power: f64,
    /// Number of its rays, where the scene gives one.
    pub(crate) rays: Option<u64>,
    /// Bodies that the scene states around it, outermost first; empty where it states none.
    pub(crate) inside: SmallVec<[u32; 4]>,
    /// Whether the scene states what it lies in; else geometry decides.
    pub(crate) media_stated: bool,
    /// What wavelengths are drawn from; `None` where the scene has but one, or its rays have their own.
    wavelengths: Option<Wavelengths>,
    /// Direction of the electric field of polarised light, of any length; `None` for unpolarised light.
    pub(crate) polarised: Option<Vector>,
    frame: Frame,
    shape: Shape,
    lobe: Lobe,
    /// Where the rays of a far source start; `None` for a source that is near, or was moved as a whole.
    near_start: Option<NearStart>,
}

/// Data of a ray, besides its geometry, as it leaves its source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emission {
    /// The face it leaves, with the face's outward normal there.
    pub(crate) from: Option<(FaceId, Vector)>,
    /// Wavelength, nm; absent when the scene has but one.
    pub(crate) wavelength: Option<f64>,
    /// Whether there is no such ray: the file that lists it was changed or went while it was in use.
    pub(crate) failed: bool,
}

impl Emitter {
    /// Makes the emitter of source `i`, from what its file held (`loaded`) and the faces that it glows from (`area`), if any.
    ///
    /// # Errors
    /// When its power is not within `scene::POWERS`, or `inside` names no instance with a medium.
    pub(crate) fn new(
        scene: &Scene,
        i: usize,
        bodies: &[Body],
        light: &SceneLight,
        loaded: Option<Loaded>,
        area: Option<Area>,
    ) -> Result<Self, Error> {
        let s = &scene.sources[i];
        let (direction, at) = (Vector::from_array(s.direction), Point::from_array(s.at));
        let mut shape = drawn_shape(s, area);
        let mut frame = Frame::from_axis(at, direction, s.x.map(Vector::from_array));
        let mut lobe = lobe_of_kind(s);
        let mut own_power = 1.0;
        // Drawn where the scene gives no spectrum; without, by the rays' own wavelengths or the run's.
        let mut list_spectrum = None;
        let mut coloured_list = false;
        match loaded {
            Some(Loaded::Intensity { sampler, kind, flux, .. }) => {
                frame = intensity_frame(kind, frame, direction, s.x.map(Vector::from_array));
                // The key `x` is upward there, the second axis; the first side lies along it all the same.
                if kind != PhotometricType::C && s.x.is_some() {
                    shape = shape.with_sides_swapped();
                }
                (lobe, own_power) = (Lobe::Measured(sampler), flux);
            }
            Some(Loaded::Rays(list)) => {
                own_power = list.power();
                coloured_list = list.is_coloured();
                list_spectrum = list.spectrum.clone();
                shape = Shape::List(list);
            }
            None => {}
        }
        // In a scene of one line rays carry no wavelength; a list that has its own keeps them.
        let wavelengths = match (&s.spectrum, light.coloured) {
            (_, false) => None,
            (None, true) if coloured_list => None,
            (None, true) if list_spectrum.is_some() => list_spectrum,
            (None, true) => Spectrum::line(scene.run.wavelength_nm).sampler().ok(),
            (Some(key), true) => key.wavelengths(scene.run.unit).ok(),
        };
        let polarised = s.polarised.map(Vector::from_array);
        let power = s.power.unwrap_or(own_power);
        if !scene::POWERS.contains(&power) {
            let at = [scene::Key::Name("source"), scene::Key::Index(i), scene::Key::Name("file")];
            let message = format!("the power of this file, {power:e}, is not within 1e-30 and 1e30");
            return Err(scene
                .error(ErrorKind::Value, &at, message)
                .help("mend the file, or give the source's `power`"));
        }
        Ok(Self {
            wavelengths,
            polarised,
            power,
            rays: s.rays,
            inside: stated_media(scene, i, bodies)?,
            media_stated: s.inside.is_some(),
            frame,
            shape,
            lobe,
            near_start: None,
        })
    }

    /// Returns the emitter where a placement puts it: turned and moved with it, its place scaled, but not its size.
    pub(crate) fn placed(mut self, placement: &Frame) -> Self {
        self.frame = placement.carry(&self.frame);
        if !placement.is_identity() {
            self.polarised = self.polarised.map(|field| placement.direction(field));
        }
        self
    }

    /// Returns which pairs of numbers it draws from the net: for the place, the direction, the wavelength.
    fn needed_pairs(&self) -> [bool; 3] {
        let list = matches!(self.shape, Shape::List(_));
        let collimated = matches!(self.lobe, Lobe::Collimated);
        [self.shape.is_extended(), !(list || collimated), self.wavelengths.is_some()]
    }

    /// Returns the point or the direction that all its rays have, to the bit; `None` where they have neither.
    pub(crate) fn beam(&self) -> Option<Beam> {
        // A beam is promised only where all rays have the very point or direction: an intersector relies on it to the bit.
        let (origin, direction) = (self.frame.origin, self.frame.z);
        match (&self.shape, &self.lobe) {
            // Their starts are moved, each along its own direction.
            _ if self.near_start.is_some() => None,
            (Shape::Point, _) => Some(Beam::Point(origin)),
            (Shape::Disc(_) | Shape::Rectangle(_), Lobe::Collimated) => {
                Some(Beam::Collimated { origin, direction })
            }
            _ => None,
        }
    }

    /// Returns the distance from its middle to the farthest place it shines from, mm; 0 for faces and lists of rays.
    fn bounding_radius(&self) -> f64 {
        match &self.shape {
            Shape::Disc(radius) => *radius,
            Shape::Rectangle([a, b]) => a.hypot(*b),
            Shape::Point | Shape::Faces(_) | Shape::List(_) => 0.0,
        }
    }

    /// Returns a box around the places it shines from, mm; for faces and lists of rays around the source's `at` alone, empty for a source
    /// that is far away.
    pub(crate) fn extent(&self) -> Aabb {
        if self.near_start.is_some() {
            return Aabb::EMPTY;
        }
        let size = Vector::splat(self.bounding_radius());
        Aabb::from_points([self.frame.origin - size, self.frame.origin + size])
    }

    /// Returns a box around the starts of all its rays, mm; `None` where they are not known beforehand, as of faces, lists of rays and
    /// sources that are far away.
    pub(crate) fn starts(&self) -> Option<Aabb> {
        let simple = matches!(self.shape, Shape::Point | Shape::Disc(_) | Shape::Rectangle(_));
        (simple && self.near_start.is_none()).then(|| self.extent())
    }

    /// Moves the start of a ray of a far source to beside the scene.
    #[inline(always)]
    fn bring_near(&self, ray: &mut Ray) {
        if let Some(near_start) = &self.near_start {
            near_start.bring_near(ray);
        }
    }

    /// Draws the ray's wavelength, nm; `None` where the emitter has no spectrum to draw from.
    #[inline(always)]
    fn wavelength(&self, stream: &Stream, index: RayIndex) -> Option<f64> {
        let wavelengths = self.wavelengths.as_ref()?;
        Some(wavelengths.sample(stream.pair(index, 2)[0]))
    }

    /// Returns the measured rays of this source; `None` where it has no list.
    pub(crate) fn list(&self) -> Option<&RayList> {
        match &self.shape {
            Shape::List(list) => Some(list),
            _ => None,
        }
    }

    /// Writes a ray of the list, by its place there, to `ray`, and returns its emission, as [`Self::emit_measured`]; reading may move
    /// `cursor` to another block.
    fn emit_listed(
        &self,
        stream: &Stream,
        index: RayIndex,
        listed: u64,
        cursor: &mut ListCursor,
        ray: &mut Ray,
    ) -> Emission {
        let measured = self.list().and_then(|list| list.ray(listed, cursor));
        self.emit_measured(measured, self.wavelength(stream, index), ray)
    }

    /// Writes a measured ray, moved to the scene, to `ray`, and returns its emission, with the wavelength that was `drawn`, else its own.
    /// Of a ray that could not be read the emission is `failed`, and `ray` starts at the source along its axis.
    fn emit_measured(&self, measured: Option<LightRay>, drawn: Option<f64>, ray: &mut Ray) -> Emission {
        let Some(measured) = measured else {
            *ray = Ray::new(self.frame.origin, self.frame.z);
            return Emission { from: None, wavelength: drawn, failed: true };
        };
        *ray = self.in_scene(&measured);
        Emission { from: None, wavelength: drawn.or(measured.wavelength_nm), failed: false }
    }

    /// Returns a measured ray, whose coordinates are the source's, in those of the scene.
    pub(crate) fn in_scene(&self, measured: &LightRay) -> Ray {
        Ray::new(self.frame.point(measured.origin), self.frame.direction(measured.direction))
    }

    /// Returns where a ray starts, mm in scene coordinates, for the uniform numbers that `pair` draws: on a point, disc or rectangle,
    /// else at the source's `at`. `sin_cos` takes turns.
    #[inline(always)]
    fn start(&self, pair: impl FnOnce() -> [f64; 2], sin_cos: impl FnOnce(f64) -> (f64, f64)) -> Point {
        let f = &self.frame;
        match self.shape {
            Shape::Disc(radius) => {
                let [u, v] = pair();
                let r = radius_on_disc(radius, u);
                let (sin, cos) = sin_cos(v);
                f.origin + f.x * (r * cos) + f.y * (r * sin)
            }
            Shape::Rectangle(half) => {
                let [x, y] = point_on_rectangle(half, pair());
                f.origin + f.x * x + f.y * y
            }
            Shape::Point | Shape::Faces(_) | Shape::List(_) => f.origin,
        }
    }

    /// Returns the unit direction of a ray in the scene about the last of three axes, for the uniform numbers that `pair` draws; of a
    /// measured lobe about the source's own. `sin_cos` takes turns.
    #[inline(always)]
    fn direction(
        &self,
        axes: [Vector; 3],
        pair: impl FnOnce() -> [f64; 2],
        sin_cos: impl FnOnce(f64) -> (f64, f64),
    ) -> Vector {
        match &self.lobe {
            Lobe::Collimated => axes[2],
            Lobe::Cone(rim) => {
                let [u, v] = pair();
                let versine = versine_in_cone(*rim, u);
                direction_about_axis(axes, [1.0 - versine, sine_from_versine(versine)], sin_cos(v))
            }
            Lobe::Cosine(exponent) => {
                let [u, v] = pair();
                let cosine = cosine_of_power(*exponent, u);
                direction_about_axis(axes, [cosine, sine_from_cosine(cosine)], sin_cos(v))
            }
            Lobe::Measured(sampler) => self.frame.direction(sampler.sample(pair())),
        }
    }

    /// Draws the ray with this index, writes its start and direction in the scene to `ray`, and returns its face, wavelength and whether it
    /// failed. `stream` must hold its numbers; `cursor` is for sources with a list.
    #[inline(never)]
    fn emit(&self, stream: &Stream, index: RayIndex, cursor: &mut ListCursor, ray: &mut Ray) -> Emission {
        let f = &self.frame;
        let mut emission = Emission { from: None, wavelength: self.wavelength(stream, index), failed: false };
        let (origin, axes) = match &self.shape {
            Shape::Point | Shape::Disc(_) | Shape::Rectangle(_) => {
                (self.start(|| stream.pair(index, 0), sin_cos_turns), [f.x, f.y, f.z])
            }
            Shape::Faces(area) => {
                let (point, normal, face) = area.point(stream, index);
                let (x, y) = orthonormal_pair(normal);
                emission.from = Some((face, normal));
                (point, [x, y, normal])
            }
            // A measured ray has a place and a direction of its own, and perhaps a wavelength. Systematic sampling: shares evenly
            // spaced over the list take from every part what it has.
            Shape::List(list) => {
                let measured = list.ray_at_share(stream.systematic(index), cursor);
                return self.emit_measured(measured, emission.wavelength, ray);
            }
        };
        *ray = Ray::new(origin, self.direction(axes, || stream.pair(index, 1), sin_cos_turns));
        emission
    }
}

/// Returns what the places of a source's rays are drawn from: the faces that it glows from (`area`), else a disc, a rectangle or a point.
fn drawn_shape(source: &Source, area: Option<Area>) -> Shape {
    match (area, source.radius, source.size) {
        (Some(area), _, _) => Shape::Faces(area),
        (None, Some(r), _) => Shape::Disc(r),
        (None, None, Some([a, b])) => Shape::Rectangle([0.5 * a, 0.5 * b]),
        (None, None, None) => Shape::Point,
    }
}

/// Returns what the directions of a source's rays are drawn from; of a kind whose directions are in a file, all alike.
fn lobe_of_kind(source: &Source) -> Lobe {
    match source.kind {
        SourceKind::Cone => Lobe::Cone(versine(source.half_angle_deg.unwrap_or(180.0).to_radians())),
        SourceKind::Collimated => Lobe::Collimated,
        SourceKind::Lambertian => Lobe::Cosine(LAMBERTIAN),
        // The power that inverts cosⁿ is kept in place of n: one root or power a ray.
        SourceKind::Cosine => Lobe::Cosine(1.0 / (source.exponent.unwrap_or(1.0) + 1.0)),
        _ => Lobe::Cone(versine(PI)),
    }
}

/// Returns the frame in which the directions of a measured intensity have the components of [`PhotometricType::direction`], of a source
/// with this `frame`, whose first axis lies along the key `x`, if that is given.
fn intensity_frame(kind: PhotometricType, frame: Frame, direction: Vector, x: Option<Vector>) -> Frame {
    match kind {
        // C runs counterclockwise for one who looks along the light: the plan of a luminaire that shines down.
        PhotometricType::C => Frame { y: -frame.y, ..frame },
        // To positive H, to positive V, forward: as far fields have it.
        PhotometricType::A | PhotometricType::B => far_axes(frame.origin, direction, x.unwrap_or(Vector::Y)),
    }
}

/// Returns the bodies that a source is stated to lie in, outermost first; empty where the scene does not say.
///
/// # Errors
/// When `inside` names no instance that has a medium.
fn stated_media(scene: &Scene, source: usize, bodies: &[Body]) -> Result<SmallVec<[u32; 4]>, Error> {
    let mut media = SmallVec::new();
    for instance in scene.sources[source].inside.iter().flat_map(|n| n.as_slice()) {
        let Some(body) = bodies.iter().skip(1).position(|b| b.is_called(instance)) else {
            let at = [scene::Key::Name("source"), scene::Key::Index(source), scene::Key::Name("inside")];
            let message = format!("no instance called '{instance}' has a medium");
            let names = bodies.iter().skip(1).map(|b| b.name.as_str());
            let advice = text::nearest_or_listed(instance, names)
                .unwrap_or_else(|| "no instance has a `medium`; leave `inside` out".into());
            return Err(scene.error(ErrorKind::NoMatch, &at, message).help(advice));
        };
        // Body 0 are the surroundings.
        media.push(body as u32 + 1);
    }
    Ok(media)
}

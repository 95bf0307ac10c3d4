use super::nearest::{Nearest, bounds};
use super::{AMBIENT, Chosen, Light};
use crate::math::{Aabb, Point, Uv};
use crate::model::{Model, PlacedFace};
use crate::optics::{self, Absorption, BulkScatter, Index};
use crate::simulate::scene::{Key, Scene, medium};
use crate::simulate::{Error, ErrorKind};
use std::collections::HashMap;

/// Something with a medium inside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    /// Index at the wavelength of the scene.
    index: f64,
    /// Index by wavelength, when the scene has several and they differ.
    dispersive: Option<Index>,
    /// Absorption coefficient at the wavelength of the scene, 1/mm.
    absorption: f64,
    /// Absorption by wavelength, when the scene has several and they differ.
    coloured: Option<Absorption>,
    /// Scattering inside.
    pub(crate) scatter: Option<BulkScatter>,
    /// Instance name.
    pub(crate) name: String,
    /// Name of the medium.
    pub(crate) medium: String,
    /// Length that light goes by total reflection alone before it is taken to be caught, mm; without end where it is absorbed.
    pub(crate) patience: f64,
    /// A box around it, mm.
    pub(crate) bounds: Aabb,
    /// Whether it has faces in no closed shell.
    pub(crate) open: bool,
}

impl Body {
    fn new(m: optics::Medium, name: String, light: &Light) -> Self {
        Self {
            index: m.index.value(light.wavelength),
            dispersive: (light.coloured && m.index.is_dispersive()).then_some(m.index),
            absorption: m.absorption.coefficient(light.wavelength),
            coloured: (light.coloured && m.absorption.is_dispersive()).then_some(m.absorption),
            scatter: m.scatter,
            name,
            medium: m.name,
            patience: f64::INFINITY,
            bounds: Aabb::EMPTY,
            open: false,
        }
    }

    /// Refractive index; `wavelength` is absent where it does not matter.
    #[inline]
    pub(crate) fn index(&self, wavelength: Option<f64>) -> f64 {
        match (&self.dispersive, wavelength) {
            (Some(index), Some(nm)) => index.value(nm),
            _ => self.index,
        }
    }

    /// Absorption coefficient, 1/mm.
    #[inline]
    pub(crate) fn absorption(&self, wavelength: Option<f64>) -> f64 {
        match (&self.coloured, wavelength) {
            (Some(absorption), Some(nm)) => absorption.coefficient(nm),
            _ => self.absorption,
        }
    }

    /// Whether anything depends on the wavelength of a ray.
    pub(crate) fn is_dispersive(&self) -> bool {
        self.dispersive.is_some() || self.coloured.is_some()
    }

    /// Whether light is absorbed inside.
    pub(crate) fn absorbs(&self) -> bool {
        self.absorption > 0.0 || self.coloured.is_some()
    }
}

/// The bodies (one for each instance and medium), the body of each face, and whether bodies may touch or nest.
///
/// An instance with two media, given by face, makes two bodies. Bodies whose boxes are farther apart than the glue distance
/// can neither touch nor nest.
pub(super) fn find(
    scene: &Scene,
    model: &Model,
    chosen: &Chosen,
    light: &Light,
) -> Result<(Vec<Body>, Vec<u16>, bool), Error> {
    let ambient = match &scene.ambient {
        Some(name) => medium::find(scene, name, &[Key::Name("ambient")])?,
        None => optics::Medium::vacuum(),
    };
    let mut bodies = vec![Body::new(ambient, "surroundings".into(), light)];
    let mut places: HashMap<(usize, &str), usize> = HashMap::new();
    let mut of_face = vec![AMBIENT; chosen.len()];
    for (f, &(_, rule)) in model.placed_faces().zip(chosen) {
        let Some((rule, name)) = rule.and_then(|r| Some((r, scene.materials[r].medium.as_deref()?))) else {
            continue;
        };
        let body = match places.get(&(f.instance, name)) {
            Some(&body) => body,
            None => {
                let at = [Key::Name("material"), Key::Index(rule), Key::Name("medium")];
                let instance = model.label(f.instance);
                let body = Body::new(medium::find(scene, name, &at)?, instance, light);
                if !(body.index > 0.0 && body.index.is_finite()) {
                    let message = format!("'{name}' has no index at {} nm", light.wavelength);
                    return Err(scene.error(ErrorKind::Value, &at, message));
                }
                places.insert((f.instance, name), bodies.len());
                bodies.push(body);
                bodies.len() - 1
            }
        };
        bodies[body].open |= super::notes::is_open(&f, model);
        bodies[body].bounds = bodies[body].bounds.union(bounds(&f));
        of_face[f.id.index()] = body as u16;
    }
    if bodies.len() > usize::from(u16::MAX) {
        let message = format!("{} bodies with media; at most 65534 are possible", bodies.len());
        return Err(scene.error(ErrorKind::Model, &[Key::Name("material")], message));
    }
    let mut order: Vec<Aabb> = bodies[1..].iter().map(|b| b.bounds.grown(scene.run.glue_mm)).collect();
    order.sort_by(|a, b| a.min.x.total_cmp(&b.min.x));
    let meets = |(i, a): (usize, &Aabb)| {
        order[i + 1..].iter().take_while(|b| b.min.x <= a.max.x).any(|b| !a.intersection(*b).is_empty())
    };
    let nested = order.iter().enumerate().any(meets);
    Ok((bodies, of_face, nested))
}

/// Says of each body how long light may go in it by total reflection alone. Bodies of one index that may touch (by pairs) are one
/// body to light, and as long as the box around them all.
pub(super) fn give_patience(scene: &Scene, bodies: &mut [Body], pairs: &[[u16; 2]]) {
    let mut united: Vec<u16> = (0..bodies.len() as u16).collect();
    fn first(united: &mut [u16], mut body: u16) -> u16 {
        while united[body as usize] != body {
            united[body as usize] = united[united[body as usize] as usize];
            body = united[body as usize];
        }
        body
    }
    for &[a, b] in pairs {
        let [one, other] = [a, b].map(|k| &bodies[k as usize]);
        if one.index == other.index && one.dispersive == other.dispersive {
            let [a, b] = [a, b].map(|k| first(&mut united, k));
            united[a.max(b) as usize] = a.min(b);
        }
    }
    let mut whole = vec![(Aabb::EMPTY, false); bodies.len()];
    let of_body: Vec<usize> = (0..bodies.len() as u16).map(|k| first(&mut united, k) as usize).collect();
    for (body, &k) in bodies.iter().zip(&of_body).skip(1) {
        whole[k] = (whole[k].0.union(body.bounds), whole[k].1 | body.absorbs());
    }
    for (body, &k) in bodies.iter_mut().zip(&of_body).skip(1) {
        let (bounds, absorbs) = whole[k];
        // Where the body absorbs, a path ends by its power.
        if !(absorbs || bounds.is_empty()) {
            body.patience = scene.run.caught_after * bounds.diagonal();
        }
    }
}

/// Faces whose box comes within the glue distance of a face of another body: there, two solids may touch. And the pairs of bodies.
pub(super) fn touching(scene: &Scene, model: &Model, of_face: &[u16]) -> (Vec<bool>, Vec<[u16; 2]>) {
    let boxed = |f: crate::model::PlacedFace<'_>| (f.id.index(), bounds(&f).grown(0.5 * scene.run.glue_mm));
    let mut faces: Vec<(usize, Aabb)> =
        model.placed_faces().filter(|f| of_face[f.id.index()] != AMBIENT).map(boxed).collect();
    faces.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
    let (mut touching, mut pairs) = (vec![false; of_face.len()], Vec::new());
    for (i, (a, box_a)) in faces.iter().enumerate() {
        for (b, box_b) in faces[i + 1..].iter().take_while(|(_, b)| b.min.x <= box_a.max.x) {
            if of_face[*a] != of_face[*b] && !box_a.intersection(*box_b).is_empty() {
                (touching[*a], touching[*b]) = (true, true);
                pairs.push([of_face[*a], of_face[*b]]);
            }
        }
        pairs.dedup();
    }
    (touching, pairs)
}

/// Faces whose box comes within the glue distance of a face of another shell of the same body: solids of one part that touch.
pub(super) fn twins(scene: &Scene, model: &Model, of_face: &[u16]) -> Vec<bool> {
    let mut twins = vec![false; of_face.len()];
    let mut faces: Vec<(usize, Option<usize>, PlacedFace<'_>)> = (model.placed_faces())
        .filter(|f| of_face[f.id.index()] != AMBIENT && model.part(f.part).shells.len() > 1)
        .map(|f| (f.id.index(), f.shell, f))
        .collect();
    faces.sort_by_key(|(id, ..)| of_face[*id]);
    for body in faces.chunk_by(|a, b| of_face[a.0] == of_face[b.0]) {
        let boxed = |f: &PlacedFace<'_>| bounds(f).grown(0.5 * scene.run.glue_mm);
        let mut body: Vec<(usize, Option<usize>, Aabb)> = body.iter().map(|(i, s, f)| (*i, *s, boxed(f))).collect();
        body.sort_by(|a, b| a.2.min.x.total_cmp(&b.2.min.x));
        for (i, (a, shell, box_a)) in body.iter().enumerate() {
            for (b, other, box_b) in body[i + 1..].iter().take_while(|(.., b)| b.min.x <= box_a.max.x) {
                if shell != other && !box_a.intersection(*box_b).is_empty() {
                    (twins[*a], twins[*b]) = (true, true);
                }
            }
        }
    }
    twins
}

/// Questions of distance after which faces whose boxes meet are taken to touch: some seconds of work.
const MOST_ASKED: usize = 50_000;
/// Samples across a face in each parameter.
const SAMPLES: usize = 5;

/// Faces of bodies and of opaque solids that touch each other: where a point inside one lies within the glue distance of the other.
pub(super) fn against(scene: &Scene, model: &Model, of_face: &[u16], opaque: &[bool]) -> Vec<bool> {
    let mut against = vec![false; of_face.len()];
    if of_face.iter().all(|b| *b == AMBIENT) || !opaque.contains(&true) {
        return against;
    }
    let placed: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    let glue = scene.run.glue_mm;
    let box_of = |f: &PlacedFace<'_>| bounds(f).grown(0.5 * glue);
    let mut faces: Vec<(usize, Aabb)> = (placed.iter())
        .filter(|f| of_face[f.id.index()] != AMBIENT || opaque[f.id.index()])
        .map(|f| (f.id.index(), box_of(f)))
        .collect();
    faces.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
    let mut nearest = Nearest::new(model);
    let mut samples: Vec<Option<Vec<Point>>> = vec![None; placed.len()];
    let mut asked = 0;
    for (i, (a, box_a)) in faces.iter().enumerate() {
        for (b, box_b) in faces[i + 1..].iter().take_while(|(_, b)| b.min.x <= box_a.max.x) {
            let mixed = (of_face[*a] == AMBIENT) != (of_face[*b] == AMBIENT);
            if !mixed || (against[*a] && against[*b]) || box_a.intersection(*box_b).is_empty() {
                continue;
            }
            let mut touch = false;
            for (one, other, around) in [(*a, *b, box_b), (*b, *a, box_a)] {
                let points = samples[one].get_or_insert_with(|| inner_points(&placed[one]));
                let near = around.grown(glue);
                for p in points.iter().filter(|p| near.contains(**p)) {
                    asked += 1;
                    touch |= asked > MOST_ASKED || nearest.distance(other, *p) <= glue;
                    if touch {
                        break;
                    }
                }
            }
            if touch {
                (against[*a], against[*b]) = (true, true);
            }
        }
    }
    against
}

/// Points inside the loops of a face, mm.
fn inner_points(f: &PlacedFace<'_>) -> Vec<Point> {
    let Some(face) = f.face else { return Vec::new() };
    let loops = super::polygons(face);
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let at = |k: usize, a: f64, b: f64| a + (b - a) * (k as f64 + 0.5) / SAMPLES as f64;
    (0..SAMPLES * SAMPLES)
        .map(|k| Uv::new(at(k / SAMPLES, u0, u1), at(k % SAMPLES, v0, v1)))
        .filter(|&uv| super::inside(&loops, uv))
        .map(|uv| f.placement.point(face.surface.evaluate(uv)))
        .collect()
}

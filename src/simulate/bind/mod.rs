//! A scene bound to a model: what every placed face does to light, as tables indexed by [`FaceId`](crate::math::FaceId).

mod bodies;
mod nearest;
mod select;

use super::emitter::Emitter;
use super::receiver::Receiver;
use super::scene::{Material, OneOrMany, ReceiverKind, Reflectance, Scene, SurfaceKind};
use super::{Error, ErrorKind};
use crate::model::Model;
use crate::simulate::scene::Key;
use nearest::Nearest;

/// What a placed face is to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FaceOptics {
    /// Index into [`BoundScene::surfaces`].
    pub(crate) surface: u16,
    /// The body whose boundary it is; [`AMBIENT`] when there is no medium behind it.
    pub(crate) body: u16,
    /// Whether it bounds a closed solid that lets no light in.
    pub(crate) sealed: bool,
}

/// The body around everything.
pub(crate) const AMBIENT: u16 = 0;

/// Something with a medium inside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    /// Refractive index.
    pub(crate) index: f64,
    /// Absorption coefficient, 1/mm.
    pub(crate) absorption: f64,
    /// Instance name, for messages.
    pub(crate) name: String,
    /// Name of the medium.
    pub(crate) medium: String,
}

/// What happens at a surface, in the form the kernel reads.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    Absorber,
    Mirror(Share),
    Interface,
}

/// A share of power, constant or by the cosine of incidence.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Share {
    Constant(f64),
    /// Pairs of angle in radians and share, by rising angle.
    ByAngle(Vec<[f64; 2]>),
}

impl Share {
    fn of(r: Option<&Reflectance>) -> Self {
        match r {
            None => Self::Constant(1.0),
            Some(Reflectance::Constant(r)) => Self::Constant(*r),
            Some(Reflectance::ByAngle(t)) => Self::ByAngle(t.iter().map(|[a, r]| [a.to_radians(), *r]).collect()),
        }
    }

    /// The share at an angle of incidence; beyond the ends of a table, that of its ends.
    #[inline]
    pub(crate) fn at(&self, cos_i: f64) -> f64 {
        match self {
            Self::Constant(r) => *r,
            Self::ByAngle(t) => {
                let angle = cos_i.clamp(0.0, 1.0).acos();
                let k = t.partition_point(|[a, _]| *a <= angle);
                match (k.checked_sub(1).map(|i| t[i]), t.get(k)) {
                    (Some([a, r]), Some([b, s])) => r + (s - r) * (angle - a) / (b - a),
                    (Some([_, r]), None) => r,
                    (None, Some([_, s])) => *s,
                    (None, None) => 0.0,
                }
            }
        }
    }
}

/// A scene whose rules have found their faces: everything a simulation needs but the intersector.
#[derive(Clone, Debug)]
pub struct BoundScene {
    pub(crate) scene: Scene,
    pub(crate) faces: Vec<FaceOptics>,
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) bodies: Vec<Body>,
    /// Whether bodies may touch or lie inside each other, so that paths need a stack of media.
    pub(crate) nested: bool,
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) receivers: Vec<Receiver>,
    /// Names of the instances, and the instance of each face.
    pub(crate) instances: Vec<String>,
    pub(crate) instance_of_face: Vec<u32>,
}

impl Scene {
    /// Finds what every rule of the scene means in a model (all its models assembled into one, see [`Scene::assemble`]).
    pub fn bind(&self, model: &Model) -> Result<BoundScene, Error> {
        if self.sources.is_empty() {
            let error = self.error(ErrorKind::Value, &[], "the scene has no source");
            return Err(error.help("add a [[source]]"));
        }
        let chosen = chosen_rules(self, model)?;
        let mut surfaces = vec![Surface::Absorber, Surface::Interface];
        let default = surface_index(&mut surfaces, &surface(self.default_surface, None));
        let (bodies, body_of_face, nested) = bodies::find(self, model, &chosen)?;
        let faces = model
            .placed_faces()
            .zip(&chosen)
            .zip(&body_of_face)
            .map(|((f, (surface_rule, _)), &body)| {
                let surface = match surface_rule.map(|r| &self.materials[r]) {
                    Some(rule) => {
                        surface(rule.surface.unwrap_or(SurfaceKind::Interface), rule.reflectance.as_ref())
                    }
                    None if body != AMBIENT => Surface::Interface,
                    None => surfaces[default as usize].clone(),
                };
                let closed = f.shell.is_some_and(|s| model.part(f.part).shells[s].closed);
                FaceOptics {
                    surface: surface_index(&mut surfaces, &surface),
                    body,
                    sealed: closed && body == AMBIENT && surface != Surface::Interface,
                }
            })
            .collect();
        let emitters = self.sources.iter().enumerate().map(|(i, s)| Emitter::new(self, i, s, model, &bodies));
        let emitters = emitters.collect::<Result<_, _>>()?;
        let mut receivers = Vec::new();
        for (i, r) in self.receivers.iter().enumerate() {
            let faces = match r.kind {
                ReceiverKind::Absorbed => absorbing_faces(self, i, &r.part, &r.instance, model)?,
                _ => Vec::new(),
            };
            receivers.push(Receiver::new(r, faces));
        }
        Ok(BoundScene {
            scene: self.clone(),
            faces,
            surfaces,
            bodies,
            nested,
            emitters,
            receivers,
            instances: model.instances.iter().map(|i| i.name.clone()).collect(),
            instance_of_face: model.placed_faces().map(|f| f.instance as u32).collect(),
        })
    }
}

/// For each face the last rule that gives its surface, and the last that gives its medium.
type Chosen = Vec<(Option<usize>, Option<usize>)>;

fn chosen_rules(scene: &Scene, model: &Model) -> Result<Chosen, Error> {
    let mut chosen = vec![(None, None); model.placed_face_count()];
    let mut nearest = Nearest::new(model);
    for (i, rule) in scene.materials.iter().enumerate() {
        for face in select::faces(scene, i, rule, model, &mut nearest)? {
            if rule.surface.is_some() {
                chosen[face].0 = Some(i);
            }
            if rule.medium.is_some() {
                chosen[face].1 = Some(i);
            }
        }
    }
    Ok(chosen)
}

fn surface(kind: SurfaceKind, reflectance: Option<&Reflectance>) -> Surface {
    match kind {
        SurfaceKind::Absorber => Surface::Absorber,
        SurfaceKind::Mirror => Surface::Mirror(Share::of(reflectance)),
        SurfaceKind::Interface => Surface::Interface,
    }
}

fn surface_index(surfaces: &mut Vec<Surface>, surface: &Surface) -> u16 {
    let found = surfaces.iter().position(|s| s == surface).unwrap_or_else(|| {
        surfaces.push(surface.clone());
        surfaces.len() - 1
    });
    found as u16
}

fn absorbing_faces(
    scene: &Scene,
    index: usize,
    part: &Option<OneOrMany<String>>,
    instance: &Option<OneOrMany<String>>,
    model: &Model,
) -> Result<Vec<u32>, Error> {
    let rule = Material { part: part.clone(), instance: instance.clone(), ..Material::default() };
    let fits = |patterns: &Option<OneOrMany<String>>, name: &str| {
        patterns.as_ref().is_none_or(|p| p.as_slice().iter().any(|p| select::fits(p, name)))
    };
    let faces: Vec<u32> = model
        .placed_faces()
        .filter(|f| fits(&rule.part, &model.part(f.part).name))
        .filter(|f| fits(&rule.instance, &model.instances[f.instance].name))
        .map(|f| f.id.0)
        .collect();
    if faces.is_empty() {
        let at = [Key::Name("receiver"), Key::Index(index)];
        let error = scene.error(ErrorKind::NoMatch, &at, "this receiver matches no face of the model");
        let names = model.instances.iter().flat_map(|i| [model.part(i.part).name.as_str(), i.name.as_str()]);
        return Err(error.help(select::advice("", names.collect())));
    }
    Ok(faces)
}

impl BoundScene {
    /// The scene as it was read.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether any face lets light into a medium.
    pub(crate) fn has_media(&self) -> bool {
        self.faces.iter().any(|f| f.body != AMBIENT && self.surfaces[f.surface as usize] == Surface::Interface)
            || self.emitters.iter().any(|e| !e.inside.is_empty())
    }

    /// Name of the instance that a face belongs to.
    pub fn instance_of(&self, face: crate::math::FaceId) -> &str {
        self.instance_of_face.get(face.index()).map_or("", |&i| &self.instances[i as usize])
    }
}

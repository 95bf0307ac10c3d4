//! A scene bound to a model: what every placed face does to light, as tables indexed by [`FaceId`](crate::math::FaceId).

mod bodies;
mod nearest;
mod notes;
mod role;
mod select;

use super::emitter::{self, Area, Emitter, Loaded};
use super::receiver::Receiver;
use super::scene::{FaceSelector, Material, OneOrMany, ReceiverKind, Scene, SurfaceKind};
use super::{Error, ErrorKind};
use crate::math::Aabb;
use crate::model::{Model, PlacedFace};
use crate::optics::{Coating, Scatter};
use crate::simulate::scene::Key;
pub(crate) use bodies::Body;
use nearest::Nearest;
pub(crate) use nearest::{inside, polygons};
use std::collections::HashMap;

/// What a placed face is to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FaceOptics {
    /// Index into [`BoundScene::surfaces`].
    pub(crate) surface: u16,
    /// The body whose boundary it is; [`AMBIENT`] when there is no medium behind it.
    pub(crate) body: u16,
    /// Whether it bounds a closed solid that lets no light in.
    pub(crate) sealed: bool,
    /// Whether it may lie on a face of another body.
    pub(crate) touching: bool,
    /// Whether it may lie on a face of another solid of the same body.
    pub(crate) twin: bool,
    /// Whether a medium and an opaque solid touch here, and this is a face of one of both.
    pub(crate) against: bool,
}

/// The body around everything.
pub(crate) const AMBIENT: u16 = 0;

/// What happens at a surface, in the form the kernel reads.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surface {
    Absorber,
    /// Reflects a constant share.
    Mirror(f64),
    /// The bare boundary of a medium.
    Interface,
    /// Everything else.
    Coated(Box<Coated>),
}

/// A surface with a coating, scatter or both.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coated {
    pub(crate) coating: Coating,
    pub(crate) scatter: Option<Scatter>,
    /// Whether it never transmits.
    pub(crate) opaque: bool,
}

/// The wavelengths of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Light {
    /// The only wavelength, or one of many, nm.
    pub(crate) wavelength: f64,
    /// Whether there are several.
    pub(crate) coloured: bool,
}

/// A scene whose rules have found their faces: everything a simulation needs but the intersector.
#[derive(Clone, Debug)]
pub struct BoundScene {
    pub(crate) scene: Scene,
    pub(crate) faces: Vec<FaceOptics>,
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) bodies: Vec<Body>,
    pub(crate) light: Light,
    /// Whether bodies may touch or lie inside each other, so that paths need a stack of media.
    pub(crate) nested: bool,
    /// Whether a face that may lie on one of another body has a surface of its own.
    pub(crate) dressed: bool,
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) receivers: Vec<Receiver>,
    /// Around all faces and the places of the sources, with room to spare.
    pub(crate) region: Aabb,
    /// Names of the instances, and the instance of each face.
    pub(crate) instances: Vec<String>,
    pub(crate) instance_of_face: Vec<u32>,
    /// Sentences about what in the scene is open or beyond its tables.
    pub(crate) notes: Vec<String>,
}

impl Scene {
    /// Finds what every rule of the scene means in a model (all its models assembled into one, see [`Scene::assemble`]).
    pub fn bind(&self, model: &Model) -> Result<BoundScene, Error> {
        if self.sources.is_empty() {
            let error = self.error(ErrorKind::Value, &[], "the scene has no source");
            return Err(error.help("add a [[source]]"));
        }
        let loaded: Vec<Option<Loaded>> =
            self.sources.iter().enumerate().map(|(i, s)| emitter::load(self, i, s)).collect::<Result<_, _>>()?;
        let light = light(self, &loaded);
        let spectra = notes::wavelengths(self, &loaded);
        let chosen = chosen_rules(self, model)?;
        let mut surfaces = vec![Surface::Absorber, Surface::Interface];
        let default = Material { surface: Some(self.default_surface), ..Material::default() };
        let (mut bodies, body_of_face, nested) = bodies::find(self, model, &chosen, &light)?;
        bare_interfaces(self, model, &chosen, &body_of_face)?;
        check_indices(self, &loaded, &bodies)?;
        let (touching, pairs) = match nested {
            true => bodies::touching(self, model, &body_of_face),
            false => (vec![false; chosen.len()], Vec::new()),
        };
        bodies::give_patience(self, &mut bodies, &pairs);
        let twins = bodies::twins(self, model, &body_of_face);
        let nested = nested || twins.contains(&true);
        let (mut faces, mut opaques) = (Vec::with_capacity(chosen.len()), Vec::with_capacity(chosen.len()));
        for ((f, (rule, _)), &body) in model.placed_faces().zip(&chosen).zip(&body_of_face) {
            let surface = match rule.map(|r| &self.materials[r]) {
                Some(rule) => surface(self, rule)?,
                None if body != AMBIENT => Surface::Interface,
                None => surface(self, &default)?,
            };
            let closed = f.shell.is_some_and(|s| model.part(f.part).shells[s].closed);
            let opaque = match &surface {
                Surface::Absorber | Surface::Mirror(_) => true,
                Surface::Interface => false,
                Surface::Coated(c) => c.opaque,
            };
            let sealed = closed && body == AMBIENT && opaque;
            let touching = touching[f.id.index()];
            let surface = surface_index(&mut surfaces, surface);
            opaques.push(opaque && body == AMBIENT);
            let twin = twins[f.id.index()];
            faces.push(FaceOptics { surface, body, sealed, touching, twin, against: false });
        }
        let against = bodies::against(self, model, &body_of_face, &opaques);
        faces.iter_mut().zip(against).for_each(|(f, against): (&mut FaceOptics, bool)| f.against = against);
        let dressed = faces.iter().any(|f| f.touching && surfaces[f.surface as usize] != Surface::Interface);
        let mut emitters = Vec::new();
        for (i, loaded) in loaded.into_iter().enumerate() {
            let area = shining(self, i, model)?;
            emitters.push(Emitter::new(self, i, &bodies, &light, loaded, area)?);
        }
        let mut receivers = Vec::new();
        for (i, r) in self.receivers.iter().enumerate() {
            let faces = match r.kind {
                ReceiverKind::Absorbed => absorbing_faces(self, i, &r.part, &r.instance, model)?,
                _ => Vec::new(),
            };
            receivers.push(Receiver::new(r, faces));
        }
        let notes = notes::beyond_tables(self, &chosen, &spectra);
        let faces_box = model.placed_faces().map(|f| nearest::bounds(&f)).fold(Aabb::EMPTY, Aabb::union);
        let region = faces_box.union(Aabb::from_points(emitters.iter().flat_map(Emitter::reach)));
        let region = if region.is_empty() { region } else { region.grown(1e-3 * region.diagonal()) };
        let mut bound = BoundScene {
            scene: self.clone(),
            faces,
            surfaces,
            bodies,
            light,
            nested,
            dressed,
            emitters,
            receivers,
            region,
            instances: (0..model.instances.len()).map(|k| model.label(k)).collect(),
            instance_of_face: model.placed_faces().map(|f| f.instance as u32).collect(),
            notes,
        };
        bound.notes.extend(notes::openings(&bound, model));
        bound.notes.extend(notes::films(&bound));
        Ok(bound)
    }
}

impl BoundScene {
    /// The instance and the medium of a body, as lost rays name it.
    pub fn body(&self, body: u16) -> Option<[&str; 2]> {
        self.bodies.get(usize::from(body)).map(|b| [b.name.as_str(), b.medium.as_str()])
    }

    /// What someone who reads the results must know: bodies that are open, light beyond the wavelengths of a table.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The instance of a face, by the face's index in the model.
    pub fn instance(&self, face: u32) -> Option<&str> {
        let instance = *self.instance_of_face.get(face as usize)?;
        self.instances.get(instance as usize).map(String::as_str)
    }
}

/// For each face the last rule that gives its surface, and the last that gives its medium.
type Chosen = Vec<(Option<usize>, Option<usize>)>;

fn chosen_rules(scene: &Scene, model: &Model) -> Result<Chosen, Error> {
    let mut chosen = vec![(None, None); model.placed_face_count()];
    let mut nearest = Nearest::new(model);
    for (i, rule) in scene.materials.iter().enumerate() {
        let base = [Key::Name("material"), Key::Index(i)];
        for face in select::faces(scene, &base, &rule.faces(), model, &mut nearest)? {
            if rule.surface.is_some() || rule.scatter.is_some() {
                chosen[face].0 = Some(i);
            }
            if rule.medium.is_some() {
                chosen[face].1 = Some(i);
            }
        }
    }
    fill_solids(scene, model, &mut chosen);
    Ok(chosen)
}

/// A medium that was given to some faces of a solid is that of the whole solid, unless others of its faces have another.
fn fill_solids(scene: &Scene, model: &Model, chosen: &mut Chosen) {
    let medium = |rule: Option<usize>| rule.and_then(|r| scene.materials[r].medium.as_deref());
    let mut solids: HashMap<(usize, usize), Option<usize>> = HashMap::new();
    let key = |f: &PlacedFace<'_>| Some((f.instance, f.shell?));
    for (f, (_, rule)) in model.placed_faces().zip(chosen.iter()) {
        let (Some(key), Some(rule)) = (key(&f), *rule) else { continue };
        let one = solids.entry(key).or_insert(Some(rule));
        if medium(*one) != medium(Some(rule)) {
            *one = None;
        }
    }
    for (f, (_, rule)) in model.placed_faces().zip(chosen.iter_mut()) {
        if let (Some(key), None) = (key(&f), *rule) {
            *rule = solids.get(&key).copied().flatten();
        }
    }
}

/// Faces that a rule calls interfaces need a medium behind them.
fn bare_interfaces(scene: &Scene, model: &Model, chosen: &Chosen, bodies: &[u16]) -> Result<(), Error> {
    for ((f, (rule, _)), &body) in model.placed_faces().zip(chosen).zip(bodies) {
        let Some(i) = rule.filter(|&r| scene.materials[r].surface == Some(SurfaceKind::Interface)) else {
            continue;
        };
        if body == AMBIENT {
            let at = [Key::Name("material"), Key::Index(i), Key::Name("surface")];
            let part = &model.part(f.part).name;
            let error =
                scene.error(ErrorKind::Value, &at, format!("an interface of '{part}', which has no medium"));
            return Err(error.help("add `medium` to this rule, or to another one for the part"));
        }
    }
    Ok(())
}

/// Every medium must have an index at every wavelength of the sources.
fn check_indices(scene: &Scene, loaded: &[Option<Loaded>], bodies: &[Body]) -> Result<(), Error> {
    for (i, (source, loaded)) in scene.sources.iter().zip(loaded).enumerate() {
        let mut wavelengths: Vec<f64> = match (&source.spectrum, loaded) {
            (Some(key), _) => {
                let sampler = key.wavelengths(scene.run.unit).ok();
                sampler.map(|s| (0..=64).map(|k| s.sample(f64::from(k) / 64.001)).collect()).unwrap_or_default()
            }
            (None, Some(Loaded::Rays(list))) => list.rays.iter().filter_map(|r| r.wavelength_nm).collect(),
            _ => vec![scene.run.wavelength_nm],
        };
        wavelengths.sort_by(f64::total_cmp);
        wavelengths.dedup();
        for nm in wavelengths {
            let wrong = bodies.iter().find(|b| !(0.1..=10.0).contains(&b.index(Some(nm))));
            if let Some(body) = wrong {
                let message = format!("'{}' has no index at {nm} nm, a wavelength of this source", body.medium);
                let at = [Key::Name("source"), Key::Index(i), Key::Name("spectrum")];
                let error = scene.error(ErrorKind::Value, &at, message);
                return Err(error.help("give the medium an index there, or cut the spectrum"));
            }
        }
    }
    Ok(())
}

/// The faces that a source shines from.
fn shining(scene: &Scene, index: usize, model: &Model) -> Result<Option<Area>, Error> {
    let Some(on) = &scene.sources[index].on else { return Ok(None) };
    let base = [Key::Name("source"), Key::Index(index), Key::Name("on")];
    let chosen = select::faces(scene, &base, on, model, &mut Nearest::new(model))?;
    match Area::new(model, &chosen) {
        Some(area) => Ok(Some(area)),
        None => Err(scene.error(ErrorKind::NoMatch, &base, "these faces have no area to shine from")),
    }
}

/// The wavelengths of all sources.
fn light(scene: &Scene, loaded: &[Option<Loaded>]) -> Light {
    let lines = scene.sources.iter().zip(loaded).flat_map(|(s, loaded)| match (&s.spectrum, loaded) {
        (Some(key), _) => vec![key.optics().ok().and_then(|s| s.single_line())],
        (None, Some(Loaded::Rays(list))) => {
            let mut all: Vec<f64> = list.rays.iter().filter_map(|r| r.wavelength_nm).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            match all[..] {
                [] => vec![Some(scene.run.wavelength_nm)],
                [one] => vec![Some(one)],
                _ => vec![None],
            }
        }
        _ => vec![Some(scene.run.wavelength_nm)],
    });
    let lines: Vec<Option<f64>> = lines.collect();
    let first = lines.first().copied().flatten();
    let coloured = first.is_none() || lines.iter().any(|l| *l != first);
    Light { wavelength: first.unwrap_or(scene.run.wavelength_nm), coloured }
}

fn surface(scene: &Scene, rule: &Material) -> Result<Surface, Error> {
    let (coating, scatter) = rule.optics().map_err(|(_, e)| scene.error(ErrorKind::Value, &[], e))?;
    let kind = rule.surface.unwrap_or(SurfaceKind::Interface);
    // What scatters nothing and reflects nothing is named neither rough nor a mirror.
    let scatter = scatter.filter(Scatter::scatters);
    Ok(match (kind, coating, scatter) {
        (SurfaceKind::Absorber, ..) => Surface::Absorber,
        (SurfaceKind::Mirror | SurfaceKind::Diffuse, Coating::Ideal { reflectance: 0.0, .. }, _) => {
            Surface::Absorber
        }
        (_, Coating::Bare, None) => Surface::Interface,
        (SurfaceKind::Mirror, Coating::Ideal { reflectance, .. }, None) => Surface::Mirror(reflectance),
        (_, coating, scatter) => {
            let opaque = coating.is_opaque();
            Surface::Coated(Box::new(Coated { coating, scatter, opaque }))
        }
    })
}

fn surface_index(surfaces: &mut Vec<Surface>, surface: Surface) -> u16 {
    let found = surfaces.iter().position(|s| *s == surface).unwrap_or_else(|| {
        surfaces.push(surface);
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
    let part_and_instance =
        FaceSelector { part: part.clone(), instance: instance.clone(), ..FaceSelector::default() };
    select::each_name_means_something(
        scene,
        &[Key::Name("receiver"), Key::Index(index)],
        &part_and_instance,
        model,
    )?;
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
        let lets_in = |f: &FaceOptics| match &self.surfaces[f.surface as usize] {
            Surface::Interface => f.body != AMBIENT,
            Surface::Coated(c) => f.body != AMBIENT && !c.opaque,
            _ => false,
        };
        let ambient = &self.bodies[AMBIENT as usize];
        self.faces.iter().any(lets_in)
            || self.emitters.iter().any(|e| !e.inside.is_empty())
            || ambient.absorbs()
            || ambient.scatter.is_some()
    }

    /// Name of the instance that a face belongs to.
    pub fn instance_of(&self, face: crate::math::FaceId) -> &str {
        self.instance_of_face.get(face.index()).map_or("", |&i| &self.instances[i as usize])
    }
}

//! The model: parts where they stand, and their faces in the order of their ids.

use super::{Colour, Face, Part, PartId, SurfaceKind, TessellatedFace};
use crate::math::{Aabb, FaceId, Frame};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// A CAD model: distinct parts, and where they stand.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Model {
    /// Name of the model or file.
    pub name: String,
    /// Distinct shapes.
    pub parts: Vec<Part>,
    /// Placed uses of the parts; a part without an instance is not in the scene.
    pub instances: Vec<Instance>,
}

/// One placed use of a part.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Instance {
    /// Name of the occurrence; the part's name when it had none.
    pub name: String,
    /// Names of the occurrences that it is placed through, from the outermost down to its own, as `left/led`; alike ones are numbered.
    /// Empty where no file says.
    pub path: String,
    /// The part that is placed.
    pub part: PartId,
    /// From the part's coordinates to the model's.
    pub placement: Frame,
    /// Colour given to this occurrence.
    pub colour: Option<Colour>,
}

impl Instance {
    /// Returns what a selector may call it: its name, and its path where it has one.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.name.as_str()).chain((!self.path.is_empty()).then_some(self.path.as_str()))
    }
}

/// Returns for each of these names whether another of them is the same.
pub(crate) fn are_shared<'n>(names: impl Iterator<Item = &'n str> + Clone) -> Vec<bool> {
    let mut uses: FxHashMap<&str, u32> = FxHashMap::default();
    for name in names.clone() {
        *uses.entry(name).or_insert(0) += 1;
    }
    names.map(|name| uses[name] > 1).collect()
}

/// A face where it stands. Either `face` (a surface) or `tessellated` (a ready mesh) is given.
#[derive(Clone, Copy, Debug)]
pub struct PlacedFace<'a> {
    /// Position in [`Model::placed_faces`].
    pub id: FaceId,
    /// Index into [`Model::instances`].
    pub instance: usize,
    /// The part.
    pub part: PartId,
    /// Number of its solid or sheet in the part, as in [`Part::solids`].
    pub solid: usize,
    /// Index into [`Part::shells`]; `None` for a tessellated face.
    pub shell: Option<usize>,
    /// The trimmed surface, in the part's coordinates.
    pub face: Option<&'a Face>,
    /// The ready mesh, in the part's coordinates.
    pub tessellated: Option<&'a TessellatedFace>,
    /// From the part's coordinates to the model's.
    pub placement: &'a Frame,
}

impl PlacedFace<'_> {
    /// Returns a box around it in the model's coordinates, mm: of its whole surface, trims left out; empty for a face without geometry.
    pub fn bounds(&self) -> Aabb {
        let local = match (self.face, self.tessellated) {
            (Some(face), _) => face.surface.bounds(),
            (None, Some(ready)) => ready.mesh.bounds(),
            (None, None) => Aabb::EMPTY,
        };
        local.placed(self.placement)
    }
}

impl Model {
    /// Returns a box around the surfaces of all placed faces, mm, trims left out; [`Model::bounds`] is that of the faces themselves.
    pub fn surface_bounds(&self) -> Aabb {
        self.placed_faces().map(|face| face.bounds()).fold(Aabb::EMPTY, Aabb::union)
    }

    /// A model of one part that stands where it is, with the part's name for both model and instance.
    pub fn from_part(part: Part) -> Self {
        let name = part.name.clone();
        let instance = Instance {
            name: name.clone(),
            path: String::new(),
            part: PartId(0),
            placement: Frame::IDENTITY,
            colour: None,
        };
        Self { name, parts: vec![part], instances: vec![instance] }
    }

    /// The part with this id.
    ///
    /// # Panics
    /// When the model has no such part.
    pub fn part(&self, id: PartId) -> &Part {
        &self.parts[id.0 as usize]
    }

    /// Returns what to call each instance: its own name, its part's where some program made one up (`=>[0:1:1:2]`) or gave none, or `part`
    /// and its number from 1; its path where several would be called alike.
    pub fn labels(&self) -> Vec<String> {
        let mut labels: Vec<String> = (0..self.instances.len()).map(|k| self.own_label(k)).collect();
        let shared = are_shared(labels.iter().map(String::as_str));
        for ((label, instance), is_shared) in labels.iter_mut().zip(&self.instances).zip(shared) {
            if is_shared && !instance.path.is_empty() {
                label.clone_from(&instance.path);
            }
        }
        labels
    }

    /// Returns for each part with faces, the parts of [`Model::account`], what to call each of its instances: [`Model::labels`] by parts.
    pub fn labels_of_parts(&self) -> Vec<Vec<String>> {
        let mut places = vec![Vec::new(); self.parts.len()];
        for (instance, label) in self.instances.iter().zip(self.labels()) {
            places[instance.part.0 as usize].push(label);
        }
        let with_faces = self.parts.iter().zip(places).filter(|(part, _)| part.face_count() > 0);
        with_faces.map(|(_, places)| places).collect()
    }

    /// What to call an instance, by its index, whatever others are called.
    fn own_label(&self, instance: usize) -> String {
        let own = &self.instances[instance].name;
        let part = &self.part(self.instances[instance].part).name;
        // `=>[0:1:1:2]` is a label of OpenCASCADE's document, not a name.
        match (own.is_empty() || own.starts_with("=>["), part.is_empty()) {
            (false, _) => own.clone(),
            (true, false) => part.clone(),
            (true, true) => format!("part {}", instance + 1),
        }
    }

    /// Every placed face in the order that defines [`FaceId`]: instance by instance, in each the faces shell by shell,
    /// then the tessellated faces.
    pub fn placed_faces(&self) -> impl Iterator<Item = PlacedFace<'_>> {
        let instances = self.instances.iter().enumerate();
        let faces = instances.flat_map(move |(i, instance)| {
            let part = self.part(instance.part);
            let placed = PlacedFace {
                id: FaceId(0),
                instance: i,
                part: instance.part,
                solid: 0,
                shell: None,
                face: None,
                tessellated: None,
                placement: &instance.placement,
            };
            // Every shell but that of a void begins a solid; ready meshes are one more behind them.
            let mut solids = 0;
            let mut surfaces = Vec::with_capacity(part.shells.len());
            for (s, shell) in part.shells.iter().enumerate() {
                // A first shell that claims to be a void has no solid before it.
                solids += usize::from(!shell.void || s == 0);
                surfaces.push(PlacedFace { solid: solids - 1, shell: Some(s), ..placed });
            }
            let surfaces = surfaces.into_iter().zip(&part.shells);
            let surfaces =
                surfaces.flat_map(|(p, shell)| shell.faces.iter().map(move |f| PlacedFace { face: Some(f), ..p }));
            let ready = part.tessellated.iter();
            surfaces.chain(ready.map(move |t| PlacedFace { solid: solids, tessellated: Some(t), ..placed }))
        });
        faces.enumerate().map(|(id, placed)| PlacedFace { id: FaceId(id as u32), ..placed })
    }

    /// Number of placed faces.
    pub fn placed_face_count(&self) -> usize {
        self.instances.iter().map(|i| self.part(i.part).face_count()).sum()
    }

    /// The id of the first face of every instance; of an instance without faces that of the next one's.
    pub fn first_faces(&self) -> Vec<FaceId> {
        // Counted once a part: a thousand lenses are one.
        let counts: Vec<u32> = self.parts.iter().map(|p| p.face_count() as u32).collect();
        let mut next = 0;
        let step = |i: &Instance| {
            let first = next;
            next += counts[i.part.0 as usize];
            FaceId(first)
        };
        self.instances.iter().map(step).collect()
    }

    /// The id of the first face of one instance; [`Model::first_faces`] returns those of all instances at once.
    pub fn first_face(&self, instance: usize) -> FaceId {
        FaceId(self.instances[..instance].iter().map(|i| self.part(i.part).face_count()).sum::<usize>() as u32)
    }
}

impl<'a> PlacedFace<'a> {
    /// Name of the face, empty when it had none.
    pub fn name(&self) -> &'a str {
        self.face.map(|f| f.name.as_str()).or(self.tessellated.map(|t| t.name.as_str())).unwrap_or("")
    }

    /// The `#id` of the face in its file; `None` when it came from none.
    pub fn entity(&self) -> Option<u64> {
        self.face.and_then(|f| f.entity).or(self.tessellated.and_then(|t| t.entity))
    }

    /// Layer of the face, if it has one.
    pub fn layer(&self) -> Option<&'a str> {
        self.face.and_then(|f| f.layer.as_deref()).or(self.tessellated.and_then(|t| t.layer.as_deref()))
    }

    /// The kind of its surface.
    pub fn kind(&self) -> SurfaceKind {
        self.face.map_or(SurfaceKind::Tessellated, |f| f.analytic.kind())
    }

    /// Radius of a cylinder or sphere, or of a torus' tube, where it stands, mm; `None` for all others.
    pub fn radius(&self) -> Option<f64> {
        Some(self.face?.analytic.radius()? * self.placement.scale)
    }

    /// The colour that shows: of the face, the shell, the instance or the part, the first that is given; `None` where none is. `model` must
    /// be the one that it is a face of.
    pub fn colour(&self, model: &Model) -> Option<Colour> {
        let part = model.part(self.part);
        let own = self.face.and_then(|f| f.colour).or(self.tessellated.and_then(|t| t.colour));
        let shell = self.shell.and_then(|s| part.shells[s].colour);
        own.or(shell).or(model.instances[self.instance].colour).or(part.colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::model::{Analytic, Shell};
    use crate::nurbs::sweep;

    fn square(name: &str) -> Face {
        Face {
            name: name.into(),
            analytic: Analytic::Plane { frame: Frame::IDENTITY },
            ..Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 1.0], [0.0, 1.0]]))
        }
    }

    #[test]
    fn face_ids_run_through_the_instances() {
        let shell = Shell { faces: vec![square("a"), square("b")], ..Shell::default() };
        let mut model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
        model.instances.push(Instance {
            name: "second".into(),
            path: String::new(),
            part: PartId(0),
            placement: Frame::translation(Vector::Z),
            colour: Some(Colour([1.0, 0.0, 0.0])),
        });
        let faces: Vec<_> = model.placed_faces().collect();
        assert_eq!(faces.len(), model.placed_face_count());
        assert_eq!(faces[3].id, FaceId(3));
        assert_eq!(faces[3].name(), "b");
        assert_eq!(faces[3].placement.point(Point::ZERO), Point::Z);
        assert_eq!(faces[3].colour(&model), Some(Colour([1.0, 0.0, 0.0])));
        assert_eq!(model.first_face(1), FaceId(2));
        assert_eq!(model.first_faces(), [FaceId(0), FaceId(2)]);
    }
}

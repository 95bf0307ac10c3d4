//! Several models in one.

use super::bind::LeftOut;
use super::scene::{Key, ModelUse, Placement, Scene};
use super::{Error, ErrorKind};
use crate::math::{Frame, Point, Vector};
use crate::model::{Model, Part, PartId};

impl Placement {
    /// Returns the frame that takes the model's coordinates, mm, to the scene's. `z` and `x` may have any length; without `x`, the x axis
    /// is taken as near to the scene's as `z` allows.
    pub fn frame(&self) -> Frame {
        let z = Vector::from_array(self.z);
        let x = self.x.map(Vector::from_array).unwrap_or(Vector::X);
        Frame { scale: self.scale, ..Frame::from_axis(Point::from_array(self.at), z, Some(x)) }
    }
}

impl Scene {
    /// Makes one model of the scene's models, given in the order of its `[[model]]` entries, each at its placement and without the faces
    /// that its entry leaves out ([`Scene::left_out`]).
    ///
    /// Entries with the same file, unit, scale and left-out faces share parts: those of the later model are dropped if their names and
    /// numbers of faces are those of the first. Instances of an entry with a name are called `entry/instance`.
    ///
    /// # Errors
    /// Where there are more or fewer models than entries, a scale is not positive and finite, or a selector of what is left out means no
    /// face.
    pub fn assemble(&self, models: Vec<Model>) -> Result<Model, Error> {
        if models.len() != self.models.len() {
            let message = format!("{} models for {} [[model]] entries", models.len(), self.models.len());
            return Err(self.error(ErrorKind::Model, &[Key::Name("model")], message));
        }
        let mut whole = Model { name: self.title.clone(), ..Model::default() };
        let mut firsts: Vec<u32> = Vec::new();
        for (i, (mut model, entry)) in models.into_iter().zip(&self.models).enumerate() {
            let placement = entry.placement.frame();
            if !(entry.placement.scale > 0.0 && entry.placement.scale.is_finite()) {
                let at = [Key::Name("model"), Key::Index(i), Key::Name("placement")];
                return Err(self.error(ErrorKind::Value, &at, "`scale` must be positive"));
            }
            let left_out = self.left_out(i, &model)?;
            remove_left_out(&mut model, &left_out);
            // What stands in several places is one part with several instances: meshed once.
            let same = |e: &ModelUse| {
                (&e.file, e.unit_mm, e.placement.scale, &e.without)
                    == (&entry.file, entry.unit_mm, entry.placement.scale, &entry.without)
            };
            let alike = self.models[..i].iter().position(same).map(|k| firsts[k]);
            let like = |(a, b): (&Part, &Part)| (&a.name, a.face_count()) == (&b.name, b.face_count());
            // A caller may hand in another model for the same file: parts must agree, not names of files alone.
            let known = |first: &u32| {
                let there = &whole.parts[*first as usize..];
                there.len() >= model.parts.len() && there.iter().zip(&model.parts).all(like)
            };
            let first = alike.filter(known).unwrap_or(whole.parts.len() as u32);
            // Parts that are there already are not added again: their instances refer to the first.
            if first as usize == whole.parts.len() {
                whole.parts.append(&mut model.parts);
            }
            firsts.push(first);
            for mut instance in model.instances {
                instance.part = PartId(first + instance.part.0);
                if !placement.is_identity() {
                    instance.placement = placement.compose(&instance.placement);
                }
                if !entry.name.is_empty() {
                    instance.name = format!("{}/{}", entry.name, instance.name);
                    if !instance.path.is_empty() {
                        instance.path = format!("{}/{}", entry.name, instance.path);
                    }
                }
                whole.instances.push(instance);
            }
        }
        Ok(whole)
    }
}

/// Removes from a model the faces that its entry leaves out.
fn remove_left_out(model: &mut Model, left_out: &[LeftOut]) {
    if left_out.is_empty() {
        return;
    }
    let mut is_gone = vec![false; model.placed_face_count()];
    left_out.iter().flat_map(|entry| &entry.faces).for_each(|face| is_gone[*face as usize] = true);
    model.remove_faces(&is_gone);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn models_are_named_and_placed() {
        let text = "[[model]]\nfile = 'a.stp'\n[[model]]\nfile = 'a.stp'\nname = 'b'\nplacement = { at = [1, 2, 3], scale = 2 }";
        let scene = Scene::parse(text, "s.toml", Path::new(".")).unwrap();
        let model = || Model::from_part(Part { name: "p".into(), ..Part::default() });
        let whole = scene.assemble(vec![model(), model()]).unwrap();
        assert_eq!(whole.instances[1].name, "b/p");
        // Not of one scale, and so not meshed alike.
        assert_eq!(whole.instances[1].part, PartId(1));
        assert_eq!(whole.instances[1].placement.point(Point::ONE), Point::new(3.0, 4.0, 5.0));
        assert!(whole.instances[0].placement.is_identity());
        assert!(scene.assemble(vec![model()]).is_err());
        let other = Model::from_part(Part { name: "q".into(), ..Part::default() });
        let text = "[[model]]\nfile = 'a.stp'\n[[model]]\nfile = 'a.stp'\nplacement = { at = [1, 2, 3] }";
        let scene = Scene::parse(text, "s.toml", Path::new(".")).unwrap();
        assert_eq!(scene.assemble(vec![model(), model()]).unwrap().parts.len(), 1);
        assert_eq!(scene.assemble(vec![model(), other]).unwrap().parts.len(), 2);
    }
}

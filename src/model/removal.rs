//! Faces taken out of a model.

use super::{Instance, Model, Part, PartId};
use std::collections::HashMap;
use std::mem;

impl Model {
    /// Removes the placed faces for which `is_gone`, by [`FaceId`](crate::math::FaceId), is set; faces beyond its end stay. Instances that
    /// lose all their faces go, with the parts that are then placed nowhere; one that loses some gets a part of its own where other places
    /// keep them. The solids of a part keep their numbers, and a shell that lost some of its faces is open.
    pub fn remove_faces(&mut self, is_gone: &[bool]) {
        let counts: Vec<usize> = self.parts.iter().map(Part::face_count).collect();
        let was_placed = self.placed_parts();
        let mut changed: HashMap<(PartId, &[bool]), PartId> = HashMap::new();
        let mut rest = is_gone;
        let mut kept: Vec<Instance> = Vec::with_capacity(self.instances.len());
        for mut instance in mem::take(&mut self.instances) {
            let count = counts[instance.part.0 as usize];
            let own;
            (own, rest) = rest.split_at(count.min(rest.len()));
            let lost = own.iter().filter(|gone| **gone).count();
            if lost > 0 && lost == count {
                continue;
            }
            if lost > 0 {
                let source = instance.part;
                instance.part = *changed.entry((source, own)).or_insert_with(|| {
                    let part = self.parts[source.0 as usize].without_faces(own);
                    self.parts.push(part);
                    PartId(self.parts.len() as u32 - 1)
                });
            }
            kept.push(instance);
        }
        self.instances = kept;
        self.drop_parts(&was_placed);
    }

    /// Whether each part is placed.
    fn placed_parts(&self) -> Vec<bool> {
        let mut placed = vec![false; self.parts.len()];
        self.instances.iter().for_each(|i| placed[i.part.0 as usize] = true);
        placed
    }

    /// Drops the parts that `was_placed` names and that are placed nowhere now; parts beyond its end stay.
    fn drop_parts(&mut self, was_placed: &[bool]) {
        let is_placed = self.placed_parts();
        let stays = |k: usize| is_placed[k] || !was_placed.get(k).is_some_and(|was| *was);
        let mut next = 0;
        let mut numbers = Vec::with_capacity(self.parts.len());
        for k in 0..self.parts.len() {
            numbers.push(PartId(next));
            next += u32::from(stays(k));
        }
        let mut k = 0;
        self.parts.retain(|_| {
            k += 1;
            stays(k - 1)
        });
        self.instances.iter_mut().for_each(|i| i.part = numbers[i.part.0 as usize]);
    }
}

impl Part {
    /// Returns the part without the faces that are set, in the order of their ids.
    fn without_faces(&self, is_gone: &[bool]) -> Self {
        let mut part = self.clone();
        let mut gone = is_gone.iter().copied();
        for shell in &mut part.shells {
            let before = shell.faces.len();
            shell.faces.retain(|_| !gone.next().unwrap_or(false));
            // An emptied shell keeps its place, and so the solids behind it their numbers.
            shell.closed &= shell.faces.len() == before;
        }
        part.tessellated.retain(|_| !gone.next().unwrap_or(false));
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::model::{Face, Shell};
    use crate::nurbs::sweep;

    fn shell(names: &[&str]) -> Shell {
        let face = |name: &&str| Face {
            name: (*name).into(),
            ..Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 1.0], [0.0, 1.0]]))
        };
        Shell { faces: names.iter().map(face).collect(), closed: true, ..Shell::default() }
    }

    /// A part of two solids that stands twice, one that stands once, and one that stands nowhere.
    fn model() -> Model {
        let part = |name: &str, shells| Part { name: name.into(), shells, ..Part::default() };
        let mut model = Model::from_part(part("pair", vec![shell(&["a", "b"]), shell(&["c"])]));
        model.parts.push(part("helper", vec![shell(&["d"])]));
        model.parts.push(part("spare", vec![shell(&["e"])]));
        let instance = |part| Instance { part: PartId(part), ..model.instances[0].clone() };
        let more = [instance(1), instance(0)];
        model.instances.extend(more);
        model
    }

    fn names(model: &Model) -> Vec<(&str, usize)> {
        model.placed_faces().map(|f| (f.name(), f.solid)).collect()
    }

    #[test]
    fn what_loses_all_its_faces_goes_with_its_part() {
        let mut model = model();
        model.remove_faces(&[false, false, false, true, false, false, false]);
        assert_eq!(names(&model), [("a", 0), ("b", 0), ("c", 1), ("a", 0), ("b", 0), ("c", 1)]);
        let parts: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(parts, ["pair", "spare"]);
    }

    #[test]
    fn one_place_of_a_part_may_lose_what_the_other_keeps() {
        let mut model = model();
        model.remove_faces(&[true, true, false, false, false, true, false]);
        assert_eq!(names(&model), [("c", 1), ("d", 0), ("a", 0), ("c", 1)]);
        let closed: Vec<bool> =
            model.placed_faces().map(|f| model.part(f.part).shells[f.shell.unwrap()].closed).collect();
        assert_eq!(closed, [true, true, false, true], "'a' lost its neighbour");
        assert_eq!(model.parts.len(), 4, "helper, spare, and both remains of the pair");
    }

    #[test]
    fn what_all_places_lose_is_one_part() {
        let mut model = model();
        model.remove_faces(&[false, false, true, false, false, false, true]);
        assert_eq!(names(&model), [("a", 0), ("b", 0), ("d", 0), ("a", 0), ("b", 0)]);
        assert_eq!(model.instances[0].part, model.instances[2].part);
        model.remove_faces(&[]);
        assert_eq!(model.placed_face_count(), 5);
    }
}

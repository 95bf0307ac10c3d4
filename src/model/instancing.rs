//! Parts that are placed often, to be traced once in their own coordinates: a model in groups, and the places of each.
//!
//! The first group is what stands once, as it stands. Every other group is one part in one scale, at the origin, with its placements.
//! An instance on whose curved faces another one may lie stays in the first group: only in common coordinates can the mesher give both
//! the same facets.

use super::near_parts::near_another;
use super::{Instance, Model, Part, PartId};
use crate::math::{Aabb, FaceId, Frame, Ray};
use rustc_hash::FxHashMap;

/// A part that is placed so often is traced in its own coordinates. Of fewer, one structure over all of them answers up to twice as
/// fast and takes little room: facets and tree of 64 lenses of 200 facets are 3 MB.
const FEWEST: usize = 64;

/// A model in groups of which each has coordinates of its own.
#[derive(Clone, Debug, Default)]
pub struct Instancing {
    /// What stands once, then each part that is placed often, alone and at the origin.
    pub groups: Vec<Model>,
    /// Where the groups behind the first stand, in the order of the model's instances.
    pub placements: Vec<Placement>,
    /// Whose faces the model's are, by rising first face.
    runs: Vec<FaceRun>,
    /// The runs of the first group, in its own order.
    single: Vec<u32>,
}

/// One place of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Index into [`Instancing::groups`].
    pub group: u32,
    /// From the group's coordinates to the model's: it turns and shifts, so that lengths stay as they are.
    pub frame: Frame,
    /// Around what stands there, mm: the spline, its edges and the facets between their points, with room for rounding.
    pub bounds: Aabb,
    /// Its first face in the model; the group's others follow.
    pub first_face: FaceId,
}

impl Placement {
    /// Moves a ray of the scene into the group's coordinates. It is not normalised anew, so that a point at t is the same point. Its
    /// departure keeps the scene's face id.
    #[inline]
    pub fn local_ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.frame.local_point(ray.origin),
            direction: self.frame.local_direction(ray.direction),
            ..*ray
        }
    }
}

/// Faces of the model that follow each other in a group too.
#[derive(Clone, Copy, Debug)]
struct FaceRun {
    /// The first one in the model.
    first: u32,
    /// The same in its group.
    local: u32,
    /// Index into the placements; `u32::MAX` for what stands once.
    placement: u32,
}

/// In [`FaceRun::placement`]: the first group, where it stands.
const SINGLE: u32 = u32::MAX;

impl Instancing {
    /// Divides a model into groups; `None` where no part is placed 64 times and more in one scale. Instances whose curved faces come within
    /// `glue_mm` of another's stay in the first group; at 0 or less none is kept for that.
    pub fn new(model: &Model, glue_mm: f64) -> Option<Self> {
        let kind = |i: &Instance| (i.part, i.placement.scale.to_bits());
        let mut counts: FxHashMap<(PartId, u64), usize> = FxHashMap::default();
        model.instances.iter().for_each(|i| *counts.entry(kind(i)).or_default() += 1);
        if counts.values().all(|&n| n < FEWEST) {
            return None;
        }
        let mut often = vec![false; model.parts.len()];
        for ((part, _), _) in counts.iter().filter(|(_, n)| **n >= FEWEST) {
            often[part.0 as usize] = true;
        }
        let near = near_another(model, &often, glue_mm);
        for (i, _) in model.instances.iter().zip(&near).filter(|(_, near)| **near) {
            counts.entry(kind(i)).and_modify(|n| *n -= 1);
        }
        let mut instancing =
            Self { groups: vec![Model { name: model.name.clone(), ..Model::default() }], ..Self::default() };
        let mut group_of: FxHashMap<(PartId, u64), u32> = FxHashMap::default();
        let mut part_of_single: FxHashMap<PartId, PartId> = FxHashMap::default();
        let mut boxes: Vec<Aabb> = vec![Aabb::EMPTY];
        let mut single_faces = 0;
        for ((instance, first), is_near) in model.instances.iter().zip(model.first_faces()).zip(near) {
            let part = model.part(instance.part);
            let has_faces = part.face_count() > 0;
            let (local, placement) = if is_near || !has_faces || counts[&kind(instance)] < FEWEST {
                let single = &mut instancing.groups[0];
                let own = *part_of_single.entry(instance.part).or_insert_with(|| {
                    single.parts.push(part.clone());
                    PartId(single.parts.len() as u32 - 1)
                });
                single.instances.push(Instance { part: own, ..instance.clone() });
                let local = single_faces;
                single_faces += part.face_count() as u32;
                instancing.single.push(instancing.runs.len() as u32);
                (local, SINGLE)
            } else {
                let group = *group_of.entry(kind(instance)).or_insert_with(|| {
                    let (alone, bounds) = lone_part(part, instance.placement.scale);
                    instancing.groups.push(alone);
                    boxes.push(bounds);
                    boxes.len() as u32 - 1
                });
                let frame = Frame { scale: 1.0, ..instance.placement };
                let bounds = boxes[group as usize].placed(&frame).with_room();
                instancing.placements.push(Placement { group, frame, bounds, first_face: first });
                (0, instancing.placements.len() as u32 - 1)
            };
            if has_faces {
                instancing.runs.push(FaceRun { first: first.0, local, placement });
            } else {
                instancing.single.pop();
            }
        }
        (!instancing.placements.is_empty()).then_some(instancing)
    }

    /// Joins groups and placements that were made elsewhere; placements are in the order of their first faces. Nothing stands once: the
    /// first group is empty, and placements name the others, from 1 on.
    pub fn from_placements(groups: Vec<Model>, placements: Vec<Placement>) -> Self {
        let run = |(k, p): (usize, &Placement)| FaceRun { first: p.first_face.0, local: 0, placement: k as u32 };
        let runs = placements.iter().enumerate().map(run).collect();
        Self { groups, placements, runs, single: Vec::new() }
    }

    /// Finds where a face of the model is: the index into the placements, `None` for what stands once, and the face in its group.
    #[inline]
    pub fn locate(&self, face: FaceId) -> (Option<usize>, FaceId) {
        let Some(&run) = self.run(face) else { return (None, face) };
        let placement = (run.placement != SINGLE).then_some(run.placement as usize);
        (placement, FaceId(face.0 - run.first + run.local))
    }

    /// Returns the run of consecutive faces that a face is in; `None` for one beyond the model.
    #[inline]
    fn run(&self, face: FaceId) -> Option<&FaceRun> {
        // Where most of a model is one part, its runs are as long as each other and this is the one: searching among a hundred thousand
        // took as long as a part's octree.
        let last = self.runs.last()?;
        let guess = u64::from(face.0) * (self.runs.len() as u64 - 1) / u64::from(last.first.max(1));
        let is_run = |k: usize| {
            self.runs.get(k).is_some_and(|r| r.first <= face.0)
                && self.runs.get(k + 1).is_none_or(|r| r.first > face.0)
        };
        let index = if is_run(guess as usize) {
            guess as usize
        } else {
            self.runs.partition_point(|r| r.first <= face.0).checked_sub(1)?
        };
        self.runs.get(index)
    }

    /// The face of the model that a face of the first group is.
    #[inline]
    pub fn single_face(&self, local: FaceId) -> FaceId {
        let run = |k: &u32| &self.runs[*k as usize];
        match self.single.partition_point(|k| run(k).local <= local.0).checked_sub(1).map(|k| run(&self.single[k]))
        {
            Some(run) => FaceId(local.0 - run.local + run.first),
            None => local,
        }
    }

    /// The largest coordinate, in size, of what is placed from a group, mm in the model's coordinates; 0 for the first group.
    pub fn reach(&self, group: usize) -> f64 {
        let placed = self.placements.iter().filter(|p| p.group as usize == group);
        placed.map(|p| p.bounds.min.abs().max(p.bounds.max.abs()).max_element()).fold(0.0, f64::max)
    }

    /// How often each group stands; the first one once, even if it has no faces.
    pub fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.groups.len()];
        if let Some(first) = counts.first_mut() {
            *first = 1;
        }
        self.placements.iter().for_each(|p| counts[p.group as usize] += 1);
        counts
    }
}

/// A model of a part alone, at the origin in this scale, and the box around it, which holds its edges and vertices too.
fn lone_part(part: &Part, scale: f64) -> (Model, Aabb) {
    let placement = Frame { scale, ..Frame::IDENTITY };
    let instance =
        Instance { name: part.name.clone(), path: String::new(), part: PartId(0), placement, colour: None };
    let model = Model { name: part.name.clone(), parts: vec![part.clone()], instances: vec![instance] };
    (model, part.tight_box(scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::model::{Face, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::{PI, TAU};

    fn ball(name: &str, radius: f64, faces: usize) -> Part {
        let surface = sweep::sphere(&Frame::IDENTITY, radius, [0.0, TAU], [-PI / 2.0, PI / 2.0]);
        let shell = Shell { faces: vec![Face::whole(surface); faces], ..Shell::default() };
        Part { name: name.into(), shells: vec![shell], ..Part::default() }
    }

    /// Balls of radius 1 in a row, every third of them followed by a large one of two faces.
    fn row(count: usize, pitch: f64) -> Model {
        let mut model = Model { parts: vec![ball("small", 1.0, 1), ball("large", 2.0, 2)], ..Model::default() };
        for k in 0..count {
            let mut place = |part: u32, y: f64| {
                let placement =
                    Frame { z: -Vector::Z, ..Frame::translation(Vector::new(pitch * k as f64, y, 0.0)) };
                model.instances.push(Instance {
                    name: String::new(),
                    path: String::new(),
                    part: PartId(part),
                    placement,
                    colour: None,
                });
            };
            place(0, 0.0);
            if k % 3 == 0 {
                place(1, 50.0);
            }
        }
        model
    }

    #[test]
    fn faces_keep_their_ids_in_groups() {
        let model = row(100, 5.0);
        let instancing = Instancing::new(&model, 1e-3).unwrap();
        assert_eq!((instancing.groups.len(), instancing.placements.len()), (2, 100));
        assert_eq!(instancing.counts(), [1, 100]);
        assert_eq!(instancing.groups[0].instances.len(), 34);
        for placed in model.placed_faces() {
            let (placement, local) = instancing.locate(placed.id);
            match placement {
                Some(k) => {
                    let p = &instancing.placements[k];
                    assert_eq!((placed.part, p.first_face.0 + local.0), (PartId(0), placed.id.0));
                    assert!(p.bounds.contains(placed.placement.point(Point::ZERO)));
                    assert!(p.frame.is_mirrored());
                }
                None => {
                    assert_eq!(instancing.single_face(local), placed.id);
                    let same = instancing.groups[0].placed_faces().nth(local.index()).unwrap();
                    assert_eq!((placed.part, same.placement), (PartId(1), placed.placement));
                }
            }
        }
        assert!((instancing.reach(1) - 496.0).abs() < 0.2);
    }

    #[test]
    fn nothing_has_no_groups() {
        assert!(Instancing::default().counts().is_empty());
    }

    #[test]
    fn few_and_touching_parts_stand_where_they_are() {
        assert!(Instancing::new(&row(63, 5.0), 1e-3).is_none());
        assert!(Instancing::new(&row(100, 2.0), 1e-3).is_none());
        assert!(Instancing::new(&row(100, 2.0), 0.0).is_some(), "nothing is glued");
        // One that touches leaves the others as they are.
        let mut model = row(100, 5.0);
        model.instances[0].placement.origin.x += 3.0;
        let instancing = Instancing::new(&model, 1e-3).unwrap();
        assert_eq!((instancing.placements.len(), instancing.groups[0].instances.len()), (98, 36));
    }

    #[test]
    fn a_cover_takes_what_it_touches_alone() {
        // Its box holds all; between balls it touches none, and with 245 mm it goes through those at 5 and 495 mm.
        for (radius, kept) in [(242.5, 100), (245.0, 98)] {
            let mut model = row(100, 5.0);
            model.parts.push(ball("cover", radius, 1));
            let placement = Frame::translation(250.0 * Vector::X);
            model.instances.push(Instance {
                name: String::new(),
                path: String::new(),
                part: PartId(2),
                placement,
                colour: None,
            });
            let instancing = Instancing::new(&model, 1e-3).unwrap();
            assert_eq!(instancing.placements.len(), kept);
        }
    }
}

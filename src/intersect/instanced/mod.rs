//! Parts that are placed often: one structure for each, and a tree of boxes over their places.
//!
//! A ray is moved into the coordinates of every part whose box it crosses, and the hit back. Frames turn and shift, so that a distance
//! along the ray is the same in all of them. Rays of a batch that reach placements of one part are traced there together, wherever these
//! are.
//!
//! A ray that leaves a placement is traced there first: where its box meets no other's, a hit in it is the nearest.
//!
//! Guarantee: the nearest hit of all groups, of equal ones that of the first group, then of the first placement; the same bits for a
//! single ray and a batch. A hit depends on ray, part and place alone, not on what else the scene holds, but for its certainty: none is
//! certified where another placement that the ray was traced in fell back. Inside a part nothing changes: a ray is moved once, so that
//! facets which meet there meet here, and what it leaves is known by part and place.
//! Known weakness: nothing is worked out about expected rays of what is placed; and a start that is computed in the scene is rounded there,
//! so that the structures of parts must know how far away they stand (`farthest_start` of their settings).

mod walk;

use super::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::{Aabb, BoxTree, Departure, FaceId, Ray};
use crate::model::{Instancing, Placement};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::time::Instant;
use walk::{OwnDeparture, Query, Walk, Workspace, leaving};

/// Rays that are under way at a time: with as many the structures of parts have enough to interleave, and their walks stay in the second
/// cache.
const BATCH: usize = 512;

/// The structures of all groups of a model, in their places.
///
/// ```
/// use lampyris::intersect::exact::{Exact, Settings};
/// use lampyris::intersect::instanced::Instanced;
/// use lampyris::intersect::{Cost, Intersector};
/// use lampyris::math::{Frame, Point, Ray, Vector};
/// use lampyris::model::{Face, Instance, Instancing, Model, Part, PartId, Shell};
/// use lampyris::nurbs::sweep;
/// # use std::f64::consts::{FRAC_PI_2, PI};
/// let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]));
/// let part = Part { shells: vec![Shell { faces: vec![ball], ..Shell::default() }], ..Part::default() };
/// let place = |k: u32| Frame::translation(3.0 * f64::from(k) * Vector::X);
/// let ball = |k| Instance { name: String::new(), path: String::new(), part: PartId(0), placement: place(k), colour: None };
/// let model = Model { name: String::new(), parts: vec![part], instances: (0..1000).map(ball).collect() };
///
/// let instancing = Instancing::new(&model, 0.0).unwrap();
/// let exact = |group| Box::new(Exact::build(group, &Settings::default())) as Box<dyn Intersector>;
/// let balls = Instanced::new(&instancing, instancing.groups.iter().map(exact).collect());
/// let hit = balls.intersect(&Ray::new(Point::new(1500.0, 0.0, 9.0), -Vector::Z), &mut Cost::default()).unwrap();
/// assert_eq!(hit.face.0, 500);
/// assert!((hit.t - 8.0).abs() < 1e-12);
/// ```
pub struct Instanced<'a> {
    instancing: &'a Instancing,
    /// Structures in the order of its groups.
    groups: Vec<Box<dyn Intersector + 'a>>,
    /// Over the boxes of placements, by their index.
    tree: BoxTree,
    /// Of each placement, whether its box meets no other's.
    stands_alone: Vec<bool>,
    /// Whether the first group holds anything.
    has_single: bool,
    build_seconds: f64,
}

impl<'a> Instanced<'a> {
    /// Wraps one structure for each of `instancing.groups`, in that order, each built in its group's own coordinates.
    pub fn new(instancing: &'a Instancing, groups: Vec<Box<dyn Intersector + 'a>>) -> Self {
        let started = Instant::now();
        let boxes: Vec<Aabb> = instancing.placements.iter().map(|p| p.bounds).collect();
        let tree = BoxTree::new(&boxes);
        let is_alone = |(k, bounds): (usize, &Aabb)| !tree.any_meeting(bounds, |other| other as usize != k);
        let stands_alone = boxes.par_iter().enumerate().map(is_alone).collect();
        let has_single = instancing.groups.first().is_some_and(|group| !group.instances.is_empty());
        let build_seconds = started.elapsed().as_secs_f64();
        Self { instancing, groups, tree, stands_alone, has_single, build_seconds }
    }

    /// Answers rays in the scene's coordinates, at most as many as `work` has room for: overwrites `hits` and counts each ray once.
    fn intersect_chunk<'t>(
        &'t self,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
        work: &mut Workspace<'t>,
        cost: &mut Cost,
    ) {
        let before = *cost;
        let Workspace { walks, open, .. } = work;
        let walks = &mut walks[..rays.len()];
        walks.iter_mut().zip(rays).for_each(|(walk, ray)| self.depart(walk, ray));
        if self.has_single {
            work.local.clear();
            work.local.extend(walks.iter().map(|walk| walk.local_ray(None)));
            let fell_back = self.query_group(0, &work.local, hits, cost);
            walks.iter_mut().zip(hits.iter()).for_each(|(walk, hit)| walk.take(None, *hit));
            fell_back.iter().for_each(|&k| walks[k].fell_back = true);
        }
        // Light that leaves a surface mostly meets its own part next, and where no other stands in that one's box nothing can be nearer.
        open.clear();
        open.extend(0..rays.len());
        self.query_next(work, cost);
        work.walks[..rays.len()].iter_mut().for_each(|walk| self.enter_boxes(walk));
        loop {
            work.advance();
            if work.open.is_empty() {
                break;
            }
            self.query_next(work, cost);
        }
        // A ray counts once, wherever it was traced.
        let walks = &work.walks[..rays.len()];
        cost.rays = before.rays + rays.len() as u64;
        cost.fallbacks = before.fallbacks + walks.iter().filter(|walk| walk.fell_back).count() as u64;
        for (walk, hit) in walks.iter().zip(hits) {
            *hit = walk.best.map(|(place, found)| self.in_scene(place, walk.qualified(found)));
        }
    }

    /// Traces rays in the coordinates of a group, overwrites `found`, adds to `cost`, and returns the indices of those on which the group
    /// fell back.
    fn query_group(
        &self,
        group: usize,
        rays: &[Ray],
        found: &mut [Option<Hit>],
        cost: &mut Cost,
    ) -> SmallVec<[usize; BATCH]> {
        let before = cost.fallbacks;
        self.groups[group].intersect_batch(rays, found, cost);
        if cost.fallbacks == before {
            return SmallVec::new();
        }
        // Rare, and a miss does not say which ray it was: each is traced once more, by itself.
        let falls_back = |ray: &Ray| {
            let mut cost = Cost::default();
            self.groups[group].intersect(ray, &mut cost);
            cost.fallbacks > 0
        };
        (0..rays.len()).filter(|&k| falls_back(&rays[k])).collect()
    }

    /// What a ray leaves, as its owner knows it.
    fn own_departure(&self, ray: &Ray) -> Option<OwnDeparture> {
        ray.departure.map(|from| {
            let (place, face) = self.instancing.locate(from.face);
            OwnDeparture { place: place.map(|k| k as u32), departure: Departure { face, ..from } }
        })
    }

    /// Sets a walk to a new ray, with the placement that the ray leaves as the first to query, unless it is known to be free of it.
    fn depart(&self, walk: &mut Walk, ray: &Ray) {
        (walk.ray, walk.departure, walk.best, walk.fell_back) = (*ray, self.own_departure(ray), None, false);
        walk.boxes.end();
        let own = walk.departure.and_then(|from| from.place);
        walk.next = own.filter(|&k| !self.is_free_of(ray, walk.departure, k));
    }

    /// Whether a ray is known to meet nothing of the placement that it leaves.
    fn is_free_of(&self, ray: &Ray, departure: Option<OwnDeparture>, place: u32) -> bool {
        let placement = self.placement(place);
        self.groups[placement.group as usize].escapes(&placement.local_ray(&leaving(ray, departure, Some(place))))
    }

    /// Traces the open walks at their next placement, those of one group together, and keeps the hits that are nearer; passes over walks
    /// without one.
    fn query_next(&self, work: &mut Workspace<'_>, cost: &mut Cost) {
        let Workspace { walks, open, queries, local, found } = work;
        let next_query = |&walk: &usize| {
            let place = walks[walk].next?;
            Some(Query { group: self.placement(place).group as usize, place, walk })
        };
        queries.clear();
        queries.extend(open.iter().filter_map(next_query));
        queries.sort_by_key(|query| query.group);
        for together in queries.chunk_by(|a, b| a.group == b.group) {
            local.clear();
            local.extend(together.iter().map(|q| self.moved(&walks[q.walk], q.place)));
            found.clear();
            found.resize(local.len(), None);
            let fell_back = self.query_group(together[0].group, local, found, cost);
            for (query, hit) in together.iter().zip(found.iter()) {
                walks[query.walk].take(Some(query.place), *hit);
            }
            fell_back.iter().for_each(|&k| walks[together[k].walk].fell_back = true);
        }
    }

    /// The ray of a walk in the coordinates of a placement.
    fn moved(&self, walk: &Walk, place: u32) -> Ray {
        self.placement(place).local_ray(&walk.local_ray(Some(place)))
    }

    /// Begins with the boxes that a ray may enter once what it leaves has been queried; with none where it ends, at its hit or its range,
    /// inside the box of that placement and no other's meets this.
    fn enter_boxes(&self, walk: &mut Walk) {
        let Some(own) = walk.departure.and_then(|from| from.place).filter(|&k| self.is_alone(k, &walk.ray)) else {
            walk.boxes.restart(&walk.ray);
            return;
        };
        // Boxes have room: nothing of others is found before the ray is out of a box that meets none of theirs, nor at its very end.
        let end = self.placement(own).bounds.exit(&walk.ray);
        if walk.ray.t_max > end {
            walk.boxes.restart(&Ray { t_min: walk.ray.t_min.max(end.next_up()), ..walk.ray });
        }
    }

    /// Whether a ray starts in the box of a placement that meets no other's.
    fn is_alone(&self, place: u32, ray: &Ray) -> bool {
        self.stands_alone[place as usize] && self.placement(place).bounds.contains(ray.origin)
    }

    fn placement(&self, index: u32) -> &Placement {
        &self.instancing.placements[index as usize]
    }

    /// A hit in its group's coordinates as one in the scene's.
    fn in_scene(&self, place: Option<u32>, hit: Hit) -> Hit {
        let Some(place) = place else { return Hit { face: self.instancing.single_face(hit.face), ..hit } };
        let Placement { frame, first_face, .. } = self.placement(place);
        Hit {
            normal: frame.normal(hit.normal),
            geometric_normal: frame.normal(hit.geometric_normal),
            face: FaceId(first_face.0 + hit.face.0),
            ..hit
        }
    }
}

impl Intersector for Instanced<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut hit = [None];
        self.intersect_batch(std::slice::from_ref(ray), &mut hit, cost);
        hit[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let mut work = Workspace::new(&self.tree, rays.len().min(BATCH));
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.intersect_chunk(rays, hits, &mut work, cost);
        }
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        let Some((single, placed)) = self.groups.split_first() else { return };
        single.prepare_for(expected);
        // What is placed is not seen from the source as its part would be, but what leaves its facets is free of it in every place.
        placed.iter().for_each(|group| group.prepare_for(&ExpectedRays { beams: &[], ..*expected }));
    }

    /// Of rays that leave the box of their placement where they leave the box around all.
    fn escapes(&self, ray: &Ray) -> bool {
        if self.has_single {
            return false;
        }
        let departure = self.own_departure(ray);
        departure.and_then(|from| from.place).is_some_and(|k| {
            self.is_free_of(ray, departure, k)
                && self.is_alone(k, ray)
                && self.placement(k).bounds.exit(ray) >= self.tree.bounds().exit(ray)
        })
    }

    fn footprint(&self) -> Footprint {
        let own = Footprint {
            bytes: self.tree.bytes() + size_of_val(&*self.instancing.placements) + self.stands_alone.len(),
            primitives: 0,
            build_seconds: self.build_seconds,
        };
        self.groups.iter().map(|g| g.footprint()).fold(own, |sum, f| sum + f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::Certainty;
    use crate::math::{Frame, Point, Uv, Vector};
    use crate::model::{Face, Instance, Model, Part, PartId, Shell};
    use crate::nurbs::sweep::sphere;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// Finds one hit, at so many mm, and is sure of it; without one it misses and is not sure.
    struct Scripted(Option<f64>);

    impl Intersector for Scripted {
        fn intersect(&self, _: &Ray, cost: &mut Cost) -> Option<Hit> {
            cost.rays += 1;
            cost.fallbacks += u64::from(self.0.is_none());
            self.0.map(|t| Hit {
                t,
                normal: Vector::Z,
                geometric_normal: Vector::Z,
                face: FaceId(0),
                primitive: 0,
                triangle: None,
                uv: Uv::ZERO,
                certainty: Certainty::Certified,
            })
        }

        fn footprint(&self) -> Footprint {
            Footprint::default()
        }
    }

    /// A row of balls before the surface of one that stands alone: what the balls cannot prove to be missed may hide it.
    #[test]
    fn a_hit_behind_an_unproved_miss_is_not_certified() {
        let ball = || Part {
            shells: vec![Shell {
                faces: vec![Face::whole(sphere(&Frame::IDENTITY, 1.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]))],
                ..Shell::default()
            }],
            ..Part::default()
        };
        let instance = |part: u32, x: f64| Instance {
            name: String::new(),
            path: String::new(),
            part: PartId(part),
            placement: Frame::translation(x * Vector::X),
            colour: None,
        };
        let row = (0..100).map(|k| instance(0, 3.0 * f64::from(k)));
        let model = Model {
            name: String::new(),
            parts: vec![ball(), ball()],
            instances: row.chain([instance(1, 400.0)]).collect(),
        };
        let instancing = Instancing::new(&model, 0.0).unwrap();
        let ray = Ray::new(Point::new(-5.0, 0.0, 0.0), Vector::X);
        let query = |row: Option<f64>| {
            let groups: Vec<Box<dyn Intersector>> = vec![Box::new(Scripted(Some(404.0))), Box::new(Scripted(row))];
            let mut cost = Cost::default();
            let hit = Instanced::new(&instancing, groups).intersect(&ray, &mut cost).unwrap();
            (hit.t, hit.certainty, cost.rays, cost.fallbacks)
        };
        assert_eq!(query(None), (404.0, Certainty::Uncertified, 1, 1));
        assert_eq!(query(Some(4.0)), (4.0, Certainty::Certified, 1, 0));
    }

    #[test]
    fn nothing_is_met_where_there_are_no_groups() {
        let nothing = Instancing::default();
        let empty = Instanced::new(&nothing, Vec::new());
        empty.prepare_for(&ExpectedRays { rays: 1, threads: 1, beams: &[], sag: 0.0 });
        let ray = Ray::new(Point::ZERO, Vector::X);
        assert!(empty.intersect(&ray, &mut Cost::default()).is_none() && !empty.escapes(&ray));
    }
}

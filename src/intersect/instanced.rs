//! Parts that are placed often: one structure for each, and a tree of boxes over their places.
//!
//! A ray is moved into the coordinates of every part whose box it crosses, and the hit back. Frames turn and shift, so that a distance
//! along the ray is the same in all of them. Rays of a batch that come to places of one part are asked there together, wherever these are.
//!
//! Guarantee: the nearest hit of all groups, of equal ones that of the first group, then of the first placement; the same bits for a
//! single ray and a batch. A hit depends on ray, part and place alone, not on what else the scene holds. Inside a part nothing changes:
//! a ray is moved once, so that facets which meet there meet here, and what it leaves is known by part and place.
//! Known weakness: nothing is worked out about expected rays of what is placed; and a start that is computed in the scene is rounded there,
//! so that the structures of parts must know how far away they stand (`farthest_start` of their settings).

use super::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::{Aabb, BoxTree, BoxWalk, Departure, FaceId, Ray};
use crate::model::{Instancing, Placement};
use smallvec::SmallVec;
use std::time::Instant;

/// Rays that are under way at a time: as many as their walks take half of the first cache.
const BATCH: usize = 32;

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
/// let ball = |k| Instance { name: String::new(), part: PartId(0), placement: place(k), colour: None };
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
    groups: Vec<Box<dyn Intersector + 'a>>,
    tree: BoxTree,
    /// Whether the first group holds anything.
    has_single: bool,
    build_seconds: f64,
}

/// A ray under way.
struct Walk<'t> {
    /// The ray, up to the nearest hit so far.
    ray: Ray,
    boxes: BoxWalk<'t>,
    /// Of the first group, or of a placement.
    best: Option<(Option<u32>, Hit)>,
    /// Where the ray is asked next.
    next: Option<u32>,
}

impl<'a> Instanced<'a> {
    /// Of a structure for each group, in the group's own coordinates.
    pub fn new(instancing: &'a Instancing, groups: Vec<Box<dyn Intersector + 'a>>) -> Self {
        let started = Instant::now();
        let boxes: Vec<Aabb> = instancing.placements.iter().map(|p| p.bounds).collect();
        let tree = BoxTree::new(&boxes);
        let has_single = instancing.groups.first().is_some_and(|group| !group.instances.is_empty());
        Self { instancing, groups, tree, has_single, build_seconds: started.elapsed().as_secs_f64() }
    }

    /// At most [`BATCH`] rays.
    fn intersect_chunk(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let rays_before = cost.rays;
        if self.has_single {
            let single: SmallVec<[Ray; BATCH]> = rays.iter().map(|ray| self.left_by(ray, None)).collect();
            self.groups[0].intersect_batch(&single, hits, cost);
        } else {
            hits.fill(None);
        }
        let mut walks: SmallVec<[Walk; BATCH]> = (rays.iter().zip(hits.iter_mut()))
            .map(|(ray, hit)| {
                let ray = Ray { t_max: hit.map_or(ray.t_max, |h| h.t), ..*ray };
                Walk { ray, boxes: self.tree.walk(&ray), best: hit.take().map(|h| (None, h)), next: None }
            })
            .collect();
        let mut asked: SmallVec<[usize; BATCH]> = SmallVec::new();
        let mut local: SmallVec<[Ray; BATCH]> = SmallVec::new();
        let mut found: SmallVec<[Option<Hit>; BATCH]> = SmallVec::new();
        loop {
            for walk in &mut walks {
                walk.next = walk.boxes.next(walk.ray.t_max);
            }
            if walks.iter().all(|w| w.next.is_none()) {
                break;
            }
            for group in 1..self.groups.len() {
                let is_here = |w: &Walk| w.next.is_some_and(|k| self.placement(k).group as usize == group);
                asked.clear();
                asked.extend((0..walks.len()).filter(|&i| is_here(&walks[i])));
                local.clear();
                local.extend(asked.iter().map(|&i| self.moved(&walks[i])));
                found.clear();
                found.resize(local.len(), None);
                self.groups[group].intersect_batch(&local, &mut found, cost);
                for (&i, hit) in asked.iter().zip(&found) {
                    walks[i].take(*hit);
                }
            }
        }
        cost.rays = rays_before + rays.len() as u64;
        for (walk, hit) in walks.into_iter().zip(hits) {
            *hit = walk.best.map(|(place, found)| self.in_scene(place, found));
        }
    }

    fn placement(&self, index: u32) -> &Placement {
        &self.instancing.placements[index as usize]
    }

    /// A ray in the coordinates of where it is asked next.
    fn moved(&self, walk: &Walk) -> Ray {
        let Some(next) = walk.next else { return walk.ray };
        self.placement(next).local_ray(&self.left_by(&walk.ray, Some(next as usize)))
    }

    /// The ray as it leaves what stands once or one placement: where its face is of another, it leaves none.
    fn left_by(&self, ray: &Ray, place: Option<usize>) -> Ray {
        let departure = ray.departure.and_then(|from| {
            let (owner, face) = self.instancing.locate(from.face);
            (owner == place).then_some(Departure { face, ..from })
        });
        Ray { departure, ..*ray }
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

impl Walk<'_> {
    /// Keeps the nearer hit, of equal ones that of the first group or placement.
    fn take(&mut self, hit: Option<Hit>) {
        let Some(hit) = hit else { return };
        let is_nearer =
            self.best.is_none_or(|(place, best)| hit.t < best.t || (hit.t == best.t && self.next < place));
        if is_nearer {
            self.ray.t_max = hit.t;
            self.best = Some((self.next, hit));
        }
    }
}

impl Intersector for Instanced<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut hit = [None];
        self.intersect_chunk(std::slice::from_ref(ray), &mut hit, cost);
        hit[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.intersect_chunk(rays, hits, cost);
        }
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        // What is placed is not seen from the source as its part would be.
        self.groups[0].prepare_for(expected);
    }

    fn footprint(&self) -> Footprint {
        let own = Footprint {
            bytes: self.tree.bytes() + size_of_val(&*self.instancing.placements),
            primitives: 0,
            build_seconds: self.build_seconds,
        };
        self.groups.iter().map(|g| g.footprint()).fold(own, |sum, f| Footprint {
            bytes: sum.bytes + f.bytes,
            primitives: sum.primitives + f.primitives,
            build_seconds: sum.build_seconds + f.build_seconds,
        })
    }
}

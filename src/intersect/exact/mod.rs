//! Rays against the trimmed rational B-splines themselves, with a certificate.
//!
//! Every placed face is cut into Bézier patches, and these into leaves so flat that a single step of Krawczyk's operator
//! mostly decides: no root, or one at most, which Newton's method then finds. What stays open goes to Bernstein-hull
//! clipping with bisection in order of t, under a budget.
//!
//! Sources: Barth, Lieger and Schindler, *Ray tracing general parametric surfaces using interval arithmetic*, The Visual
//! Computer 1994 (exclusion and uniqueness); Krawczyk 1969; Nishita, Sederberg and Kakimoto, SIGGRAPH 1990 (clipping).
//!
//! Guarantee: a hit marked [`Certainty::Certified`] is the first one on the spline as given in `f64`, with margins counted
//! operation by operation, up to 1e-6 mm along trims, where the side of the edge shared by two faces decides for both.
//! Contact closer than 1e-9 mm is [`Certainty::Tangent`]; what the budget or a singular point left open is
//! [`Certainty::Uncertified`].
//!
//! Known weakness: at collapsed edges (poles) no single step can decide, and rays within about 1e-9 mm of one stay uncertified.

// Comparisons are negated so that NaN falls on the careful side.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod audit;
mod clip;
mod edge;
mod geometry;
mod leaf;
mod net;
mod newton;
mod piece;
mod query;
mod trace;
pub mod traditional;
mod tree;
mod trim;
mod uses;
mod wide;

use super::{Certainty, Cost, Footprint, Hit, Intersector};
use crate::math::{Aabb, FaceId, Ray, Uv, Vector};
use crate::model::Model;
use clip::TANGENT;
use geometry::Geometry;
use leaf::{Cutting, Leaf};
use query::{Query, Root};
use rayon::prelude::*;
use std::time::Instant;
use tree::Tree;

pub use newton::SurfacePoint;

/// How the search structure is cut and how hard it tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How far a leaf's Jacobian may vary, relative to its middle, seen along the normal. Smaller makes more leaves and
    /// fewer rays that need clipping; 0.25 was fastest on spheres, tori and freeform surfaces.
    pub flatness: f64,
    /// How often a patch may be halved at most.
    pub depth: u32,
    /// Clipping steps a ray may take before its answer is left uncertified; a step takes about half a microsecond.
    pub budget: u32,
    /// Distance from a trim that is flagged, mm.
    pub trim_band: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { flatness: 0.25, depth: 12, budget: 8000, trim_band: 1e-6 }
    }
}

/// The exact model, ready for rays.
///
/// ```
/// use lampyris::intersect::{Certainty, Cost, Intersector, exact::{Exact, Settings}};
/// use lampyris::math::{Frame, Point, Ray, Vector};
/// use lampyris::model::{Analytic, Face, Model, Part, Shell};
/// use lampyris::nurbs::sweep;
/// # use std::f64::consts::{FRAC_PI_2, PI};
/// let surface = sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
/// let analytic = Analytic::Sphere { frame: Frame::IDENTITY, radius: 50.0 };
/// let face = Face { name: String::new(), entity: None, colour: None, surface, analytic, reversed: false, loops: vec![], gap: 0.0 };
/// let part = Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() };
/// let exact = Exact::build(&Model::from_part(part), &Settings::default());
/// let hit = exact.intersect(&Ray::new(Point::new(-150.0, 3.0, 4.0), Vector::X), &mut Cost::default()).unwrap();
/// assert!((hit.t - (150.0 - (2500f64 - 25.0).sqrt())).abs() < 1e-12);
/// assert_eq!(hit.certainty, Certainty::Certified);
/// ```
#[derive(Debug)]
pub struct Exact {
    geometry: Geometry,
    leaves: Vec<Leaf>,
    pool: Vec<net::V4>,
    tree: Tree,
    settings: Settings,
    build_seconds: f64,
}

/// The first hit with everything that is known about it; also a miss has a certainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The first hit.
    pub hit: Option<Hit>,
    /// Of the hit or of the miss.
    pub certainty: Certainty,
    /// Whether a trim lies within the band of the hit, or of a nearer root that the trim turned away.
    pub near_trim: bool,
}

impl Exact {
    /// Cuts every placed face that has a surface; a hit's [`Hit::primitive`] is the patch.
    ///
    /// Ready meshes and surfaces that are not finite or not positive in weight are left out: [`Exact::skipped`].
    pub fn build(model: &Model, settings: &Settings) -> Self {
        let start = Instant::now();
        let geometry = Geometry::new(model, settings.trim_band);
        let cutting = Cutting { flatness: settings.flatness, depth: settings.depth };
        let cut: Vec<leaf::Leaves> =
            (0..geometry.patches.len() as u32).into_par_iter().map(|p| leaf::cut(&geometry, p, cutting)).collect();
        let (mut leaves, mut pool) = (Vec::new(), Vec::new());
        for part in cut {
            let shift = pool.len() as u32;
            leaves.extend(part.leaves.into_iter().map(|l| Leaf { net: l.net + shift, ..l }));
            pool.extend(part.pool);
        }
        let boxes: Vec<Aabb> = leaves.iter().map(|l: &Leaf| Aabb { min: l.lo, max: l.hi }).collect();
        let tree = Tree::build(&boxes);
        let build_seconds = start.elapsed().as_secs_f64();
        Self { geometry, leaves, pool, tree, settings: *settings, build_seconds }
    }

    /// Placed faces that are not traced: ready meshes, and surfaces that are not usable.
    pub fn skipped(&self) -> &[FaceId] {
        &self.geometry.skipped
    }

    /// Number of Bézier patches.
    pub fn patch_count(&self) -> usize {
        self.geometry.patches.len()
    }

    /// Number of leaves that the patches were cut into.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    /// The first hit, with its certificate, also for a miss.
    pub fn first(&self, ray: &Ray, cost: &mut Cost) -> Answer {
        let mut q = Query::new(ray, &self.geometry, self.tree.center, self.settings.budget);
        if is_sound(ray) {
            self.search(&mut q);
        }
        cost.rays += 1;
        cost.nodes += u64::from(q.nodes);
        cost.tests += u64::from(q.leaves_tested);
        let t = q.best.map_or(f64::INFINITY, |r| r.t);
        let mut certainty = q.best.map_or(Certainty::Certified, |r| r.certainty);
        if q.doubt <= t && q.doubt < f64::INFINITY || !is_sound(ray) {
            certainty = Certainty::Uncertified;
        }
        cost.fallbacks += u64::from(certainty == Certainty::Uncertified);
        let near_trim = q.best.is_some_and(|r| r.near_trim) || q.turned_away <= t && q.turned_away < f64::INFINITY;
        let hit = q.best.map(|root| Hit { certainty, ..self.hit(&q, &root) });
        Answer { hit, certainty, near_trim }
    }

    /// Every crossing in order of t, each once. A crossing found from both sides of a patch border counts once.
    pub fn crossings(&self, ray: &Ray, cost: &mut Cost) -> Vec<Hit> {
        let mut q = Query::new(ray, &self.geometry, self.tree.center, self.settings.budget.saturating_mul(4));
        q.all = Some(Vec::new());
        if is_sound(ray) {
            self.search(&mut q);
        }
        cost.rays += 1;
        cost.nodes += u64::from(q.nodes);
        cost.tests += u64::from(q.leaves_tested);
        let mut roots = q.all.take().unwrap_or_default();
        roots.sort_by(|a, b| a.t.total_cmp(&b.t));
        let mut hits: Vec<Hit> = Vec::new();
        for root in roots {
            let mut hit = self.hit(&q, &root);
            if hit.t >= q.doubt {
                hit.certainty = Certainty::Uncertified;
            }
            // The same face at the same place with the same side towards the ray is the same crossing. At a pole clipping
            // ends on boxes TANGENT wide across the ray, as often as patches meet there: along the ray they differ by
            // that over the sine.
            let close = 1e-9 + 1e-13 * hit.t.abs();
            let sine = hit.geometric_normal.dot(ray.direction).abs();
            let far = close + (2.0 * TANGENT / sine).min(1e3 * TANGENT);
            let open = |c: Certainty| c == Certainty::Uncertified;
            let twin = hits.iter().rev().take_while(|h| hit.t - h.t <= far).any(|h| {
                h.face == hit.face
                    && (hit.t - h.t <= close || open(root.certainty) && open(h.certainty))
                    && (h.geometric_normal.dot(ray.direction) > 0.0)
                        == (hit.geometric_normal.dot(ray.direction) > 0.0)
            });
            if !twin {
                hits.push(hit);
            }
        }
        hits
    }

    fn hit(&self, q: &Query, root: &Root) -> Hit {
        let leaf = &self.leaves[root.leaf as usize];
        let face = &self.geometry.faces[leaf.face as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let inside = root.local.map(|x| x.clamp(0.0, 1.0));
        let net = leaf.net(&self.pool);
        let jet = wide::evaluate(net, leaf.degree, root.local[0], root.local[1]);
        let normal: Vector = face.sign * geometry::normal(net, leaf.degree, inside, &jet, patch.rounding);
        let uv: Uv = patch.uv(leaf.in_patch(inside));
        let (t, certainty) = (root.t, root.certainty);
        debug_assert!(q.d.is_finite());
        Hit { t, normal, geometric_normal: normal, face: face.id, primitive: leaf.patch, uv, certainty }
    }
}

/// Whether a ray has finite coordinates and a direction.
fn is_sound(ray: &Ray) -> bool {
    ray.origin.is_finite() && ray.direction.is_finite() && ray.direction.length_squared() > 0.0
}

impl Intersector for Exact {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.first(ray, cost).hit
    }

    fn footprint(&self) -> Footprint {
        let nets: usize = self.geometry.patches.iter().map(|p| size_of_val(p) + size_of_val(&*p.net)).sum();
        let bytes = size_of_val(&*self.leaves) + size_of_val(&*self.pool) + size_of_val(&*self.tree.nodes) + nets;
        Footprint { bytes, primitives: self.geometry.patches.len(), build_seconds: self.build_seconds }
    }
}

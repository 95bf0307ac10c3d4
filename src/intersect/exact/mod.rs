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
mod batch;
mod clip;
mod cut;
mod edge;
mod geometry;
mod leaf;
mod net;
mod newton;
mod piece;
mod probe;
mod query;
mod slabs;
mod trace;
pub mod traditional;
mod tree;
mod trim;
mod uses;
mod wide;

use super::{Certainty, Cost, Footprint, Hit, Intersector};
use crate::math::{Aabb, FaceId, Ray, Vector};
use crate::model::Model;
use clip::TANGENT;
use cut::Cutting;
use geometry::Geometry;
use leaf::Leaf;
use probe::{Label, Probe};
use query::{Query, Root};
use std::time::Instant;
use tree::Tree;

pub use newton::SurfacePoint;

/// How the search structure is cut and how hard it tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How far a leaf's Jacobian may vary, relative to its middle, seen along the normal. Smaller makes more leaves and
    /// fewer rays that need clipping; 0.25 was fastest on spheres, tori and freeform surfaces of hundreds of patches.
    pub flatness: f64,
    /// Models with fewer leaves are cut finer, down to a fifth of `flatness`: as long as all leaves stay in the first caches
    /// more of them cost nothing. One bicubic patch in 264 leaves instead of 11 answers twice as many rays.
    pub leaves: usize,
    /// How often a patch may be halved at most.
    pub depth: u32,
    /// Clipping steps a ray may take before its answer is left uncertified; a step takes about half a microsecond.
    pub budget: u32,
    /// Distance from a trim that is flagged, mm.
    pub trim_band: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { flatness: 0.25, leaves: 250, depth: 12, budget: 8000, trim_band: 1e-6 }
    }
}

impl Settings {
    /// For some thousands of rays, where building costs more than asking: leaves four times less flat. Of a thousand lenses the
    /// structure takes 1.4 s and 0.24 GB instead of 11 s and 2.3 GB, and certifies the same rays.
    pub fn for_few_rays() -> Self {
        Self { flatness: 1.0, ..Self::default() }
    }
}

/// The exact model, ready for rays.
///
/// ```
/// use lampyris::intersect::{Certainty, Cost, Intersector, exact::{Exact, Settings}};
/// use lampyris::math::{Frame, Point, Ray, Vector};
/// use lampyris::model::{Face, Model, Part, Shell};
/// use lampyris::nurbs::sweep;
/// # use std::f64::consts::{FRAC_PI_2, PI};
/// let surface = sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
/// let part = Part { shells: vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }], ..Part::default() };
/// let exact = Exact::build(&Model::from_part(part), &Settings::default());
/// let hit = exact.intersect(&Ray::new(Point::new(-150.0, 3.0, 4.0), Vector::X), &mut Cost::default()).unwrap();
/// assert!((hit.t - (150.0 - (2500f64 - 25.0).sqrt())).abs() < 1e-12);
/// assert_eq!(hit.certainty, Certainty::Certified);
/// ```
#[derive(Debug)]
pub struct Exact {
    geometry: Geometry,
    leaves: Vec<Leaf>,
    /// Of each leaf.
    probes: Vec<Probe>,
    /// Of each leaf.
    labels: Vec<Label>,
    pool: Vec<net::V4>,
    /// First control point of each leaf, and the pool's length.
    starts: Vec<u32>,
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

/// What a ray crosses all along its way.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// The crossings in order of t.
    pub crossings: Vec<Hit>,
    /// The t, in order, of crossings with a trim within its band, and of those that such a trim turned away.
    pub near_trims: Vec<f64>,
}

impl Exact {
    /// Cuts every placed face that has a surface; a hit's [`Hit::primitive`] is the patch.
    ///
    /// Ready meshes and surfaces that are not finite or not positive in weight are left out: [`Exact::skipped`].
    pub fn build(model: &Model, settings: &Settings) -> Self {
        let start = Instant::now();
        let geometry = Geometry::new(model, settings.trim_band);
        let mut cutting = Cutting { flatness: settings.flatness, depth: settings.depth };
        let mut cut = cut::cut_all(&geometry, cutting);
        let count = |cut: &[cut::Leaves]| cut.iter().map(|c| c.leaves.len()).sum::<usize>();
        while count(&cut) < settings.leaves && cutting.flatness > 0.21 * settings.flatness {
            cutting.flatness = (0.6 * cutting.flatness).max(0.2 * settings.flatness);
            cut = cut::cut_all(&geometry, cutting);
        }
        let (mut leaves, mut probes, mut pool) = (Vec::new(), Vec::new(), Vec::new());
        for part in cut {
            let shift = pool.len() as u32;
            leaves.extend(part.leaves.into_iter().map(|l| Leaf { net: l.net + shift, ..l }));
            probes.extend(part.probes.into_iter().map(|p| p.shifted(shift)));
            pool.extend(part.pool);
        }
        let mut starts: Vec<u32> = leaves.iter().map(|l| l.net).collect();
        starts.push(pool.len() as u32);
        let labels = leaves.iter().map(|l| Label::new(l, &geometry)).collect();
        let boxes: Vec<Aabb> = leaves.iter().map(Leaf::bounds).collect();
        let tree = Tree::build(&boxes);
        let build_seconds = start.elapsed().as_secs_f64();
        Self { geometry, leaves, probes, labels, pool, starts, tree, settings: *settings, build_seconds }
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
        let mut q = Query::IDLE;
        self.restart(&mut q, ray, self.settings.budget);
        self.search(&mut q);
        self.answer(&q, cost)
    }

    /// Takes up a ray.
    #[inline(always)]
    fn restart(&self, q: &mut Query, ray: &Ray, budget: u32) {
        q.restart(ray, &self.geometry, &self.tree, budget);
        if !is_sound(ray) {
            (q.slabs.misses, q.doubt) = (true, f64::NEG_INFINITY);
        }
    }

    /// What a search has found.
    #[inline(always)]
    fn answer(&self, q: &Query, cost: &mut Cost) -> Answer {
        cost.rays += 1;
        cost.nodes += u64::from(q.nodes);
        cost.tests += u64::from(q.leaves_tested);
        let Some(root) = &q.best else {
            let certainty = if q.doubt < f64::INFINITY { Certainty::Uncertified } else { Certainty::Certified };
            cost.fallbacks += u64::from(certainty == Certainty::Uncertified);
            return Answer { hit: None, certainty, near_trim: q.turned_away < f64::INFINITY };
        };
        let certainty = if q.doubt <= root.t { Certainty::Uncertified } else { root.certainty };
        cost.fallbacks += u64::from(certainty == Certainty::Uncertified);
        let near_trim = root.near_trim || q.turned_away <= root.t;
        let hit = Some(Hit { certainty, ..self.hit(q, root) });
        Answer { hit, certainty, near_trim }
    }

    /// Every crossing in order of t, each once. A crossing found from both sides of a patch border counts once.
    pub fn crossings(&self, ray: &Ray, cost: &mut Cost) -> Vec<Hit> {
        self.passage(ray, cost).crossings
    }

    /// Every crossing in order of t, and where trims were near.
    pub fn passage(&self, ray: &Ray, cost: &mut Cost) -> Passage {
        let mut q = Query::IDLE;
        self.restart(&mut q, ray, self.settings.budget.saturating_mul(4));
        q.all = Some(Vec::new());
        self.search(&mut q);
        cost.rays += 1;
        cost.nodes += u64::from(q.nodes);
        cost.tests += u64::from(q.leaves_tested);
        let mut roots = q.all.take().unwrap_or_default();
        roots.sort_by(|a, b| a.t.total_cmp(&b.t));
        let mut near_trims = q.all_turned_away.clone();
        near_trims.extend(roots.iter().filter(|r| r.near_trim).map(|r| r.t));
        near_trims.sort_by(f64::total_cmp);
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
        Passage { crossings: hits, near_trims }
    }

    /// Names a root, after the steps of Newton's method that the search left to do.
    #[inline(always)]
    fn hit(&self, q: &Query, root: &Root) -> Hit {
        let (probe, label) = (&self.probes[root.leaf as usize], &self.labels[root.leaf as usize]);
        let net = probe.net(&self.pool);
        let (mut t, mut local) = (root.t, root.local);
        let mut jet = wide::evaluate(net, probe.degree, local[0], local[1]);
        if root.certainty == Certainty::Certified {
            let oc = q.o - probe.center;
            for _ in 0..4 {
                let (step, at) = trace::corrected(q, oc, &jet);
                if !(step[0].abs().max(step[1].abs()) < 1e-6) {
                    // Where the search went by the net in the ray's frame rounding may say otherwise: its word stands.
                    break;
                }
                (t, local) = (at, [local[0] - step[0], local[1] - step[1]]);
                // The normal is that of the point before the step.
                if step[0].abs().max(step[1].abs()) < 2.0 * trace::CLOSE {
                    break;
                }
                jet = wide::evaluate(net, probe.degree, local[0], local[1]);
            }
            t = t.clamp(q.t_min, q.limit);
        }
        let inside = local.map(|x| x.clamp(0.0, 1.0));
        let normal: Vector = label.sign * geometry::normal(net, probe.degree, inside, &jet, label.rounding);
        let (uv, certainty) = (label.uv(inside), root.certainty);
        Hit { t, normal, geometric_normal: normal, face: label.face, primitive: label.patch, uv, certainty }
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

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        self.search_batch(rays, hits, cost);
    }

    fn footprint(&self) -> Footprint {
        let nets: usize = self.geometry.patches.iter().map(|p| size_of_val(p) + size_of_val(&*p.net)).sum();
        let probes = size_of_val(&*self.probes) + size_of_val(&*self.labels);
        let leaves = size_of_val(&*self.leaves) + size_of_val(&*self.pool) + probes;
        let bytes = leaves + size_of_val(&*self.tree.nodes) + nets;
        Footprint { bytes, primitives: self.geometry.patches.len(), build_seconds: self.build_seconds }
    }
}

//! The search structure: leaves, what tests them, and the hierarchy over them.

use super::geometry::Geometry;
use super::leaf::{Leaf, NetPlace};
use super::linearization::{HitLabel, Linearization};
use super::subdivision::{self, Flatness, PatchLeaves};
use super::tree::Tree;
use super::trim::Trim;
use crate::math::FaceId;
use crate::model::Model;
use std::time::Instant;

/// How the search structure is cut and how hard it tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How far a leaf's Jacobian may vary, relative to its middle, seen along the normal. Smaller makes more leaves and
    /// fewer rays that need clipping; 0.25 was fastest on spheres, tori and freeform surfaces of hundreds of patches.
    pub flatness: f64,
    /// Models with fewer leaves are cut finer, down to a fifth of `flatness`: as long as all leaves stay in the first caches
    /// more of them cost nothing. One bicubic patch in 264 leaves instead of 11 answers twice as many rays.
    pub leaves: usize,
    /// How often a patch may be halved for flatness; large loose leaves are halved up to eight times more for their boxes.
    pub depth: u32,
    /// Clipping steps on a bicubic net that a ray may take before its answer is left uncertified: half a microsecond each. Nets of
    /// higher degree count as many as they take longer.
    pub budget: u32,
    /// Distance from a trim that is flagged, mm.
    pub trim_band: f64,
    /// Largest coordinate that starts were rounded at, mm, where that is not the model's own: of a part in its own coordinates that
    /// stands far away. 0 otherwise.
    pub farthest_start: f64,
    /// Most leaves: a model that takes more is cut into leaves four times less flat, each patch halved so often that its share of them is
    /// used, between two and eight times. `None` for any number.
    pub most_leaves: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            flatness: 0.25,
            leaves: 250,
            depth: 12,
            budget: 8000,
            trim_band: 1e-6,
            farthest_start: 0.0,
            most_leaves: None,
        }
    }
}

impl Settings {
    /// Chooses by the number of rays to come: the default with one leaf for every sixteen of them at most. Of a thousand lenses the
    /// structure for thousands of rays takes 1.4 s and 0.24 GB instead of 11 s and 2.3 GB, and certifies the same rays. A face that is
    /// folded where it was offset took 35,000 leaves of 416 patches otherwise, 40 MB, and no ray was answered sooner.
    pub fn for_rays(rays: u64) -> Self {
        Self { most_leaves: Some((rays / RAYS_OF_LEAF) as usize), ..Self::default() }
    }

    /// For so many patches that are to have `most` leaves, where the default makes more.
    fn shallow(patches: usize, most: usize) -> Self {
        let share = (most / patches.max(1)).max(1);
        let depth = share.ilog2().clamp(FEWEST_HALVINGS, MOST_HALVINGS);
        Self { flatness: LOOSE_FLATNESS, depth, ..Self::default() }
    }
}

/// [`Settings::flatness`] for few rays, where building costs more than tracing.
const LOOSE_FLATNESS: f64 = 1.0;
/// Halvings of a patch for few rays: with none a ray takes up to four times as long on nacelles and spheres, with two half as long again;
/// and beside poles leaves stay as steep as they are however often they are halved.
const FEWEST_HALVINGS: u32 = 2;
const MOST_HALVINGS: u32 = 8;
/// Rays that a leaf more must be worth: it takes 4 µs to cut and a kilobyte, and all of them spare a ray a quarter of a microsecond.
const RAYS_OF_LEAF: u64 = 16;

/// Flattest leaves that a model of few is cut into, as a share of [`Settings::flatness`].
const FLATTEST: f64 = 0.2;
/// Step in which leaves of a model of few are made flatter.
const FLATTER: f64 = 0.6;

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
    pub(super) geometry: Geometry,
    pub(super) leaves: Vec<Leaf>,
    /// Of each leaf.
    pub(super) linearizations: Vec<Linearization>,
    /// Of each leaf.
    pub(super) labels: Vec<HitLabel>,
    /// Of each leaf.
    pub(super) net_places: Vec<NetPlace>,
    pub(super) tree: Tree,
    pub(super) settings: Settings,
    /// Whether [`Settings::most_leaves`] made it coarser.
    is_shallow: bool,
    pub(super) build_seconds: f64,
}

impl Exact {
    /// Cuts every placed face that has a surface, in the current rayon pool; a hit's [`Hit::primitive`](crate::intersect::Hit::primitive)
    /// is the patch.
    ///
    /// Ready meshes and surfaces that are not finite or not positive in weight are left out: [`Exact::skipped`].
    pub fn build(model: &Model, settings: &Settings) -> Self {
        let start = Instant::now();
        let mut geometry = Geometry::new(model, settings.trim_band, settings.farthest_start);
        let (cut, is_shallow) = subdivide(&geometry, settings);
        let PatchLeaves { leaves, linearizations, boxes, nets } = cut;
        geometry.nets.reserve_exact(nets.len());
        geometry.nets.extend(nets);
        geometry.nets.shrink_to_fit();
        let tree = Tree::build(&boxes);
        let net_places = leaves.iter().map(NetPlace::new).collect();
        let labels = leaves.iter().map(|l| HitLabel::new(l, &geometry)).collect();
        let build_seconds = start.elapsed().as_secs_f64();
        Self {
            geometry,
            leaves,
            linearizations,
            labels,
            net_places,
            tree,
            settings: *settings,
            is_shallow,
            build_seconds,
        }
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

    /// Whether it is coarser than without [`Settings::most_leaves`].
    pub(crate) fn is_shallow(&self) -> bool {
        self.is_shallow
    }

    /// Bytes of patches, leaves, hierarchy and trims, without copies of the model's surfaces and edges.
    pub(super) fn bytes(&self) -> usize {
        let patches = size_of_val(&*self.geometry.patches) + size_of_val(&*self.geometry.nets);
        let tested = size_of_val(&*self.linearizations) + size_of_val(&*self.labels);
        let leaves = size_of_val(&*self.leaves) + size_of_val(&*self.net_places) + tested;
        let trims: usize = self.geometry.trims.iter().map(Trim::bytes).sum();
        leaves + size_of_val(&*self.tree.nodes) + patches + trims
    }
}

/// Cuts all patches into leaves of `settings.flatness`, or of down to [`FLATTEST`] of it while they are fewer than `settings.leaves`, or
/// as for few rays where there would be more than `settings.most_leaves`; returns whether that was so.
fn subdivide(geometry: &Geometry, settings: &Settings) -> (PatchLeaves, bool) {
    let mut flatness = Flatness { deviation: settings.flatness, depth: settings.depth };
    let most = settings.most_leaves.unwrap_or(usize::MAX);
    // A patch in two leaves is the least that flatness could require.
    let hopeless = geometry.patches.len().saturating_mul(2) > most;
    let cut = if hopeless { None } else { subdivision::subdivide_up_to(geometry, flatness, most) };
    let Some(mut cut) = cut else {
        let shallow = Settings::shallow(geometry.patches.len(), most);
        let loose = Flatness { deviation: shallow.flatness, depth: shallow.depth.min(settings.depth) };
        return (subdivision::subdivide_all(geometry, loose), true);
    };
    let flattest = FLATTEST * settings.flatness;
    // Five per cent over the flattest: a further round would change next to nothing.
    while cut.leaves.len() < settings.leaves && flatness.deviation > 1.05 * flattest {
        flatness.deviation = (FLATTER * flatness.deviation).max(flattest);
        let Some(finer) = subdivision::subdivide_up_to(geometry, flatness, most) else { break };
        cut = finer;
    }
    (cut, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Homogeneous, Point};
    use crate::model::{Face, Part, Shell};
    use crate::nurbs::Surface;

    #[test]
    fn boxes_of_leaves_hold_the_corners_of_their_face() {
        // Corners are control points: no rounding comes before the leaf's own. Their coordinates have finer digits than its centre.
        for k in 0..100 {
            let odd = |n: usize| ((k * 16 + n) as f64 * 12.9898).sin();
            let corner = |i: usize| i == 0 || i == 3;
            let points: Vec<Homogeneous> = (0..16)
                .map(|n| {
                    let (i, j) = (n / 4, n % 4);
                    let bend = if corner(i) && corner(j) { 0.0 } else { 3.0 * odd(n) };
                    (Point::new(33.0 * i as f64, 33.0 * j as f64, bend) + Point::splat(0.1 * odd(n))).extend(1.0)
                })
                .collect();
            let corners = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[u, v]| ([u, v], points[12 * u + 3 * v].project()));
            let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
            let face = Face::whole(Surface { degree: [3, 3], knots: [knots.clone(), knots], points });
            let shells = vec![Shell { faces: vec![face], ..Shell::default() }];
            let model = Model::from_part(Part { shells, ..Part::default() });
            let (cut, _) = subdivide(&Geometry::new(&model, 1e-6, 0.0), &Settings::default());
            for (ends, corner) in corners {
                let is_at_corner = |leaf: &Leaf| (0..2).all(|d| leaf.rect[d][ends[d]] == ends[d] as f64);
                let k = cut.leaves.iter().position(is_at_corner).unwrap();
                assert!(cut.boxes[k].contains(corner), "{corner} in {:?}", cut.boxes[k]);
            }
        }
    }

    #[test]
    fn leaves_that_are_whole_patches_take_their_nets() {
        use crate::math::Frame;
        let frame = Frame { origin: Point::new(0.1, 0.7, 1.3), ..Frame::IDENTITY };
        let plane = crate::nurbs::sweep::plane(&frame, [[0.0, 10.0]; 2]);
        // Rational, and so flat that neither its bend nor its box requires halves.
        let tube = crate::nurbs::sweep::cylinder(&frame, 100.0, [0.0, 0.05], [0.0, 5.0]);
        for surface in [plane, tube] {
            let shells = vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }];
            let settings = Settings { leaves: 0, depth: 0, ..Settings::default() };
            let exact = Exact::build(&Model::from_part(Part { shells, ..Part::default() }), &settings);
            let taken = |leaf: &&Leaf| leaf.net == exact.geometry.patches[leaf.patch as usize].net;
            let taken = exact.leaves.iter().filter(taken).count();
            assert_eq!((taken, exact.leaf_count()), (exact.patch_count(), exact.patch_count()));
            let of_patches: usize = exact.geometry.patches.iter().map(super::super::patch::Patch::net_len).sum();
            assert_eq!(exact.geometry.nets.len(), of_patches);
        }
    }

    #[test]
    fn a_model_of_too_many_leaves_is_cut_as_for_few_rays() {
        use crate::intersect::{Cost, Intersector};
        use crate::math::{Frame, Ray, Vector};
        use std::f64::consts::{FRAC_PI_2, PI};
        let ball = crate::nurbs::sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
        let shells = vec![Shell { faces: vec![Face::whole(ball)], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let fine = Settings { leaves: 0, ..Settings::default() };
        let build = |most_leaves| Exact::build(&model, &Settings { most_leaves, ..fine });
        let all = build(None).leaf_count();
        let enough = build(Some(all));
        assert_eq!((enough.leaf_count(), enough.is_shallow()), (all, false));
        let few = build(Some(all - 1));
        assert!(few.is_shallow());
        let loose = Settings { leaves: 0, ..Settings::shallow(few.patch_count(), all - 1) };
        assert_eq!(few.leaf_count(), Exact::build(&model, &loose).leaf_count());
        assert!(2 * few.leaf_count() < all, "{} of {all}", few.leaf_count());
        let ray = Ray::new(Point::new(-150.0, 3.0, 4.0), Vector::X);
        let hit = few.intersect(&ray, &mut Cost::default()).unwrap();
        assert!((hit.t - (150.0 - (2500f64 - 25.0).sqrt())).abs() < 1e-12);
    }

    #[test]
    fn patches_of_many_spheres_are_halved_twice_for_few_rays() {
        use crate::math::{Frame, Vector};
        use std::f64::consts::{FRAC_PI_2, PI};
        // Beside their poles leaves stay steep however often they are halved.
        let ball = crate::nurbs::sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
        let shells = vec![Shell { faces: vec![Face::whole(ball)], ..Shell::default() }];
        let mut model = Model::from_part(Part { shells, ..Part::default() });
        let first = model.instances[0].clone();
        model.instances = (0..64)
            .map(|k| {
                let origin = first.placement.origin
                    + 50.0 * Vector::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64);
                crate::model::Instance { placement: Frame { origin, ..first.placement }, ..first.clone() }
            })
            .collect();
        let exact = Exact::build(&model, &Settings::for_rays(10_000));
        assert!(exact.leaf_count() <= 4 * exact.patch_count(), "{} of {}", exact.leaf_count(), exact.patch_count());
    }
}

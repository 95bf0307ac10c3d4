//! Newton's method for many rays, eight at a time: each lane has a ray, a patch and a place of its own.
//!
//! A lane keeps to its patch and ends by the rules of [`Exact::converge`]; what leaves its patch, does not end soon or meets a singular
//! point has no answer here, and its caller traces them one by one. Grouped by the degree of their patches alone:
//! eight nets are transposed into registers at a tenth of the cost of the steps, so that neighbours need not lie on one patch.
//!
//! Guarantee: the answer of a ray is the same bits whatever rays it is traced with and whatever the instruction set.

use super::geometry::Geometry;
use super::net::{self, V4};
use super::newton::{STALLED, SurfacePoint};
use super::newton_lanes::{Ends, Starts, iterate, iterate_fixed};
use super::patch::TRUSTED;
use super::structure::Exact;
use super::tolerances::TANGENT;
use super::trim::Region;
use crate::intersect::prefetch::{prefetch, prefetch_range};
use crate::math::simd::f64x8::{Array, F64x8, LANES};
#[cfg(target_arch = "x86_64")]
use crate::math::simd::f64x8::{Avx2Pair, Avx512Register};
use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Ray, Uv, Vector};

/// Degrees above which rays are traced one by one.
const LARGEST_DEGREE: usize = 5;
/// Control points of the largest net.
const LARGEST_NET: usize = (LARGEST_DEGREE + 1) * (LARGEST_DEGREE + 1);
/// Share of a patch by which a root may lie beyond its border, and is taken back to it: a hundredth of [`TANGENT`] on a patch of 10 mm.
const BEYOND: f64 = 1e-12;
/// Seeds ahead of which a patch is prefetched, and the cell of a trim: a group is worked off in between.
const PATCHES_AHEAD: usize = 24;
const CELLS_AHEAD: usize = 12;
/// Patches that stay in the cache of the first level without being prefetched.
const FEW_PATCHES: usize = 32;
/// Groups that are open at a time, one for each pair of degrees; with more the first is worked off early.
const GROUPS: usize = 8;

/// A ray and where its search begins.
#[derive(Clone, Copy, Debug)]
pub(in crate::intersect) struct Seed {
    /// Which of the rays.
    pub(in crate::intersect) ray: u32,
    /// A patch, by [`Exact::patch_at`].
    pub(in crate::intersect) patch: u32,
    /// Parameters on the surface.
    pub(in crate::intersect) uv: Uv,
}

impl Exact {
    /// Follows Newton's method from each seed on its patch and overwrites `points`, which is as long as `seeds`: `None` where it does not
    /// converge, ends beyond the patch or at a singular point, or the patch is of a degree above [`LARGEST_DEGREE`]. The range of a ray
    /// does not count.
    pub(in crate::intersect) fn converge_batch(
        &self,
        rays: &[Ray],
        seeds: &[Seed],
        points: &mut [Option<SurfacePoint>],
    ) {
        simd::dispatch_widest(Convergence { geometry: &self.geometry, rays, seeds, points });
    }
}

/// The search from all seeds, for [`simd::dispatch_widest`].
struct Convergence<'a> {
    geometry: &'a Geometry,
    rays: &'a [Ray],
    seeds: &'a [Seed],
    points: &'a mut [Option<SurfacePoint>],
}

impl Kernel for Convergence<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        #[cfg(target_arch = "x86_64")]
        if I::AVX512 {
            return self.converge::<Avx512Register>();
        } else if I::AVX2 {
            return self.converge::<Avx2Pair>();
        }
        self.converge::<Array>();
    }
}

/// Seeds on patches of one degree that wait for a full register.
#[derive(Clone, Copy)]
struct Group {
    degree: [u8; 2],
    count: usize,
    seeds: [u32; LANES],
}

impl Convergence<'_> {
    /// Solves for all seeds, as many of one degree at a time as a register has lanes.
    #[inline(always)]
    fn converge<V: F64x8>(self) {
        let mut net = [[V::splat(0.0); 4]; LARGEST_NET];
        let mut groups = [Group { degree: [0; 2], count: 0, seeds: [0; LANES] }; GROUPS];
        let mut next = 0;
        let fetches = self.geometry.patches.len() > FEW_PATCHES;
        let seeds = self.seeds.len();
        // After the last seed each group is worked off as it is. All in one place: without optimisation each place where the steps
        // stand takes 0.8 MB of stack, of which a thread has 2 MB.
        for index in 0..seeds + GROUPS {
            let ready = if index >= seeds {
                groups[index - seeds]
            } else {
                if fetches {
                    self.fetch_ahead(index);
                }
                self.points[index] = None;
                let degree = self.geometry.patches[self.seeds[index].patch as usize].degree;
                // The array of nets side by side has no room for these; rays on them are traced one by one.
                if usize::from(degree[0].max(degree[1])) > LARGEST_DEGREE {
                    continue;
                }
                let Some(ready) = add_seed(&mut groups, &mut next, degree, index as u32) else { continue };
                ready
            };
            solve_group::<V>(&mut net, self.geometry, self.rays, self.seeds, &ready, self.points);
        }
    }

    /// Prefetches what the seeds after the `index`-th need: first their patches, then the nets of these and the cells of trims in which
    /// they begin and mostly end.
    #[inline(always)]
    fn fetch_ahead(&self, index: usize) {
        if let Some(seed) = self.seeds.get(index + PATCHES_AHEAD) {
            prefetch(&self.geometry.patches, seed.patch as usize);
        }
        if let Some(seed) = self.seeds.get(index + CELLS_AHEAD) {
            let patch = &self.geometry.patches[seed.patch as usize];
            prefetch_range(&self.geometry.nets, patch.net as usize, patch.net_len());
            self.geometry.trims[self.geometry.faces[patch.face as usize].trim as usize].fetch_cell(seed.uv);
        }
    }
}

/// Lets a seed wait in the group of its degree. Returns the group that is to be solved now: the one that this fills, or that had to make
/// room for a new degree; `next` is whose turn that is.
#[inline(always)]
fn add_seed(groups: &mut [Group; GROUPS], next: &mut usize, degree: [u8; 2], seed: u32) -> Option<Group> {
    let mut k = 0;
    while k < GROUPS && !(groups[k].count > 0 && groups[k].degree == degree) {
        k += 1;
    }
    // No group has this degree: it takes over the next in turn, whose seeds are worked off half full.
    let mut displaced = None;
    if k == GROUPS {
        k = *next;
        *next = (*next + 1) % GROUPS;
        displaced = Some(std::mem::replace(&mut groups[k], Group { degree, count: 0, seeds: [0; LANES] }));
    }
    let group = &mut groups[k];
    group.seeds[group.count] = seed;
    group.count += 1;
    if group.count < LANES {
        return displaced;
    }
    // A group that has just taken over holds one seed: it is never full.
    let full = *group;
    group.count = 0;
    Some(full)
}

/// Follows Newton's method from all seeds of a group and writes the points at their indices; `net` is room to work in.
#[inline(always)]
fn solve_group<V: F64x8>(
    net: &mut [[V; 4]; LARGEST_NET],
    geometry: &Geometry,
    rays: &[Ray],
    seeds: &[Seed],
    group: &Group,
    points: &mut [Option<SurfacePoint>],
) {
    if group.count == 0 {
        return;
    }
    let mut starts = Starts {
        origin: [[0.0; LANES]; 3],
        direction: [[0.0; LANES]; 3],
        local: [[0.0; LANES]; 2],
        near: [0.0; LANES],
        trusted: [0.0; LANES],
    };
    let first = &geometry.patches[seeds[group.seeds[0] as usize].patch as usize];
    let mut nets = [geometry.net(first); LANES];
    for lane in 0..LANES {
        // Idle lanes repeat the first, so that they end when it does and divide by nothing that it does not.
        let index = if lane < group.count { group.seeds[lane] } else { group.seeds[0] };
        let seed = &seeds[index as usize];
        let (ray, patch) = (&rays[seed.ray as usize], &geometry.patches[seed.patch as usize]);
        nets[lane] = geometry.net(patch);
        let (origin, local) = (ray.origin - patch.center, patch.local(seed.uv));
        for c in 0..3 {
            starts.origin[c][lane] = origin[c];
            starts.direction[c][lane] = ray.direction[c];
        }
        starts.local[0][lane] = local[0];
        starts.local[1][lane] = local[1];
        starts.near[lane] = TANGENT.min(STALLED * patch.size());
        let shortest = TRUSTED * patch.rounding;
        starts.trusted[lane] = shortest * shortest;
    }
    // Control points side by side: those of eight patches in a register.
    let count = net::len(group.degree);
    for k in 0..count {
        let mut rows: [&V4; LANES] = [&nets[0][k]; LANES];
        for lane in 0..LANES {
            rows[lane] = &nets[lane][k];
        }
        net[k] = V::transpose(rows);
    }
    let net = &net[..count];
    // Degrees that are known at compile time need no loops over them; any others share a step written for the
    // largest.
    let ends = match group.degree {
        [1, 1] => iterate_fixed::<V, 2, 2>(net, &starts),
        [2, 2] => iterate_fixed::<V, 3, 3>(net, &starts),
        [3, 3] => iterate_fixed::<V, 4, 4>(net, &starts),
        [2, 1] => iterate_fixed::<V, 3, 2>(net, &starts),
        [1, 2] => iterate_fixed::<V, 2, 3>(net, &starts),
        [3, 1] => iterate_fixed::<V, 4, 2>(net, &starts),
        [1, 3] => iterate_fixed::<V, 2, 4>(net, &starts),
        [2, 3] => iterate_fixed::<V, 3, 4>(net, &starts),
        [3, 2] => iterate_fixed::<V, 4, 3>(net, &starts),
        degree => iterate::<V, { LARGEST_DEGREE + 1 }, { LARGEST_DEGREE + 1 }>(net, degree, &starts),
    };
    for lane in 0..group.count {
        let index = group.seeds[lane] as usize;
        points[index] = point(&ends, lane, geometry, seeds[index].patch);
    }
}

/// The point that a lane found on the patch `index`; `None` where it found none, or one beyond the patch.
#[inline(always)]
fn point(ends: &Ends, lane: usize, geometry: &Geometry, index: u32) -> Option<SurfacePoint> {
    let [u, v] = [ends.local[0][lane], ends.local[1][lane]];
    let within = -BEYOND..=1.0 + BEYOND;
    if ends.regular >> lane & 1 == 0 || !within.contains(&u) || !within.contains(&v) {
        return None;
    }
    let patch = &geometry.patches[index as usize];
    let record = &geometry.faces[patch.face as usize];
    let local = [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)];
    let uv = patch.uv(local);
    let trim = &geometry.trims[record.trim as usize];
    let inside = match trim.cell_at(uv) {
        Region::Inside => true,
        Region::Outside => false,
        Region::Border => trim.is_inside(uv),
    };
    let normal = record.sign * Vector::new(ends.normal[0][lane], ends.normal[1][lane], ends.normal[2][lane]);
    Some(SurfacePoint { t: ends.t[lane], uv, normal, residual: ends.residual[lane], inside, patch: index })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::Settings;
    use crate::math::{FaceId, Frame, Point};
    use crate::model::{Face, Model, Part, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// A sphere of radius 50 about the origin, a torus beside it, and a bilinear plate: three pairs of degrees.
    fn model() -> Model {
        let beside = Frame::translation(Vector::new(200.0, 0.0, 0.0));
        let far = Frame::translation(Vector::new(0.0, 0.0, -300.0));
        let faces = vec![
            Face::whole(sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2])),
            Face::whole(sweep::torus(&beside, 50.0, 15.0, [0.0, TAU], [0.0, TAU])),
            Face::whole(sweep::plane(&far, [[-90.0, 90.0], [-90.0, 90.0]])),
        ];
        Model::from_part(Part { shells: vec![Shell { faces, ..Shell::default() }], ..Part::default() })
    }

    /// Rays through points of the faces, and seeds that are some hundredths of the domain beside them.
    fn rays_and_seeds(exact: &Exact) -> (Vec<Ray>, Vec<Seed>, Vec<FaceId>) {
        let unit = |k: usize, m: f64| (k as f64 * m).fract();
        let (mut rays, mut seeds, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..301 {
            let face = FaceId((k * 7 % 3) as u32);
            let surface = &exact.geometry.surfaces[face.index()];
            let [[u0, u1], [v0, v1]] = surface.domain();
            let place = |s: f64, t: f64| Uv::new(u0 + (u1 - u0) * s, v0 + (v1 - v0) * t);
            let (s, t) = (0.05 + 0.9 * unit(k, 0.618), 0.05 + 0.9 * unit(k, 0.755));
            let target = surface.evaluate(place(s, t));
            let origin = target + Vector::new(unit(k, 0.31) - 0.5, unit(k, 0.57) - 0.5, 1.2) * 80.0;
            rays.extend(Ray::from_points(origin, target));
            let uv = place(s + 0.02 * unit(k, 0.43), t - 0.02 * unit(k, 0.87));
            let patch = exact.patch_at(face, uv).unwrap();
            seeds.push(Seed { ray: k as u32, patch, uv });
            faces.push(face);
        }
        (rays, seeds, faces)
    }

    fn bits(points: &[Option<SurfacePoint>]) -> Vec<Option<[u64; 6]>> {
        let of = |p: &SurfacePoint| [p.t, p.uv.x, p.uv.y, p.normal.x, p.normal.y, p.normal.z].map(f64::to_bits);
        points.iter().map(|p| p.as_ref().map(of)).collect()
    }

    #[test]
    fn lanes_know_nothing_of_each_other_nor_of_the_processor() {
        let exact = Exact::build(&model(), &Settings::default());
        let (rays, seeds, _) = rays_and_seeds(&exact);
        let mut all = vec![None; seeds.len()];
        exact.converge_batch(&rays, &seeds, &mut all);
        let mut portable = vec![None; seeds.len()];
        simd::run_portable(Convergence {
            geometry: &exact.geometry,
            rays: &rays,
            seeds: &seeds,
            points: &mut portable,
        });
        assert_eq!(bits(&all), bits(&portable));
        let mut avx2 = vec![None; seeds.len()];
        simd::dispatch(Convergence { geometry: &exact.geometry, rays: &rays, seeds: &seeds, points: &mut avx2 });
        assert_eq!(bits(&all), bits(&avx2));
        for (k, seed) in seeds.iter().enumerate() {
            let mut alone = [None];
            exact.converge_batch(&rays, std::slice::from_ref(seed), &mut alone);
            assert_eq!(bits(&alone)[0], bits(&all)[k]);
        }
    }

    /// Where a ray meets a sphere and a plate is known; where it is a torus the distance to its circle is.
    #[test]
    fn points_lie_on_the_ray_and_on_the_surface() {
        let exact = Exact::build(&model(), &Settings::default());
        let (rays, seeds, faces) = rays_and_seeds(&exact);
        let mut points = vec![None; seeds.len()];
        exact.converge_batch(&rays, &seeds, &mut points);
        assert!(points.iter().flatten().count() > 280, "{} of 301", points.iter().flatten().count());
        for (k, found) in points.iter().enumerate() {
            let Some(found) = found else { continue };
            let place = rays[k].point_at(found.t);
            let (off, normal) = match faces[k].0 {
                0 => (place.length() - 50.0, place.normalize()),
                1 => {
                    let from = place - Point::new(200.0, 0.0, 0.0);
                    let tube = from - from.with_z(0.0).normalize() * 50.0;
                    (tube.length() - 15.0, tube.normalize())
                }
                _ => (place.z + 300.0, Vector::Z),
            };
            assert!(
                off.abs() < 1e-10 && (found.normal - normal).length() < 1e-11,
                "{k}: {off:e} {}",
                found.normal - normal
            );
        }
    }
}

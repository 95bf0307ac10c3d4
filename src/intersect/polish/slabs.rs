//! Places on the spline of one face that lie between the spline of another face and its facets.
//!
//! Facets leave the spline by up to their sag. A ray that starts between another face and that one's facets is, for these, already behind
//! the face: beside the wall of a bore light that rises from the mirror below it went on between the wall and its facets, all along it,
//! and into what stands behind. The facets of the face itself are sorted out by the side to which the ray leaves.
//!
//! Guarantee: a start that is in no slab of its facet is on the same side of the facets of all other faces as of their splines, where
//! the sags are proved.

use super::curved_cells::FLAT_SAG;
use super::facet_record::FacetRecord;
use super::slab_map::SlabMap;
use crate::intersect::prefetch;
use crate::math::{Aabb, BoxTree, FaceId, Point, Vector};
use crate::mesh::FacetMesh;
use rayon::prelude::*;
use smallvec::SmallVec;

/// A facet with more slabs near it has a map of them, which costs as much as testing so many.
const MOST_WITHOUT_MAP: usize = 2;
/// One with more, as of a plate with many holes, has no list of them and looks for them in the tree.
const MOST_LISTED: usize = 12;
/// Slabs that are looked at for the map of one facet; one with more around it, as a long strip across everything, always looks in the tree.
const MOST_MAPPED: usize = 4096;
/// Slabs that are looked at for all maps of a mesh: a tenth of a second. Of 56,000 facets that all lie across each other maps took 5 s.
const MOST_MAPPED_OF_MESH: usize = 1 << 22;
/// Slabs that are looked at to find out whether a facet needs more than a list, those of its own face too.
const MOST_LOOKED_AT: usize = 256;
/// Room for what rounds a place, mm, and as a share of its coordinates: a million roundings.
const ROOM: f64 = 1e-9;

/// Slabs of other faces near a facet, by their index in [`Slabs::all`].
type Listed = SmallVec<[u32; MOST_LISTED]>;

/// What lies within the sag of a facet: a box around it, rounded outward, and that sag, mm.
#[derive(Clone, Copy, Debug)]
struct Slab {
    low: [f32; 3],
    high: [f32; 3],
    facet: u32,
    sag: f32,
}

/// What is near a facet.
#[derive(Clone, Copy, Debug)]
struct Nearby {
    /// Its slabs, by their place in [`Slabs::listed`]; none where there is nothing, or too much to list.
    first: u32,
    count: u32,
    /// Its map, in [`Slabs::maps`]; [`NO_MAP`] for a facet without.
    map: u32,
}

/// In [`Nearby::map`].
const NO_MAP: u32 = u32::MAX;

/// For each facet the slabs of other faces' facets that its piece of the spline comes near to.
pub(super) struct Slabs {
    /// Of all facets that are not flat, and a tree of their boxes.
    all: Vec<Slab>,
    tree: BoxTree,
    /// Of each facet.
    nearby: Vec<Nearby>,
    listed: Vec<Slab>,
    /// Of facets with more than a few.
    maps: Vec<SlabMap>,
    /// How far from a facet, mm, a place that rays leave by it may lie.
    reach: f64,
}

impl Slabs {
    /// Finds them for all facets of the mesh that `records` are of, for places up to `reach`, mm, off their facet; in the current rayon
    /// pool.
    pub(super) fn of_mesh(mesh: &FacetMesh, records: &[FacetRecord], reach: f64) -> Self {
        let curved = (0..mesh.facets.len() as u32).filter(|&f| records[f as usize].sag > FLAT_SAG);
        let all: Vec<Slab> = curved.map(|f| Slab::of_facet(mesh, f, records[f as usize].sag)).collect();
        let tree = BoxTree::new(&all.iter().map(Slab::bounds).collect::<Vec<Aabb>>());
        // The slabs of other faces near a facet, and whether there are more that were not looked at.
        let near = |f: usize, most_listed: usize, most_looked_at: usize| {
            let surroundings = Surroundings::of_facet(mesh, f, reach);
            let mut near = Listed::new();
            let mut looked_at = 0;
            let are_more = tree.any_meeting(&surroundings.bounds, |k| {
                looked_at += 1;
                let slab = &all[k as usize];
                let is_foreign = mesh.facets[slab.facet as usize].face != mesh.facets[f].face;
                near.extend((is_foreign && surroundings.may_meet(mesh, slab)).then_some(k));
                near.len() > most_listed || looked_at > most_looked_at
            });
            (near, are_more)
        };
        let few = |f: usize| {
            let (near, are_more) = near(f, MOST_LISTED, MOST_LOOKED_AT);
            (!are_more).then_some(near)
        };
        let lists: Vec<_> = (0..mesh.facets.len()).into_par_iter().map(few).collect();
        let crowded = lists.iter().filter(|list| list.is_none()).count();
        let most = (MOST_MAPPED_OF_MESH / crowded.max(1)).min(MOST_MAPPED);
        let list_and_map = |(f, list): (usize, Option<Listed>)| {
            let (near, are_more) = list.map_or_else(|| near(f, most, most), |list| (list, false));
            if !are_more && near.len() <= MOST_WITHOUT_MAP {
                return (near, None);
            }
            let bounds = Aabb::from_points(mesh.corners(f)).grown(reach);
            let mut map = SlabMap::new(bounds);
            if are_more {
                map.mark(&bounds);
            } else {
                near.iter().for_each(|&k| map.mark(&all[k as usize].bounds()));
            }
            let is_listed = !are_more && near.len() <= MOST_LISTED;
            (if is_listed { near } else { Listed::new() }, Some(map))
        };
        let of_facets: Vec<_> = lists.into_par_iter().enumerate().map(list_and_map).collect();
        let (mut nearby, mut listed, mut maps) = (Vec::with_capacity(of_facets.len()), Vec::new(), Vec::new());
        for (near, map) in of_facets {
            let index = map.as_ref().map_or(NO_MAP, |_| maps.len() as u32);
            nearby.push(Nearby { first: listed.len() as u32, count: near.len() as u32, map: index });
            maps.extend(map);
            listed.extend(near.iter().map(|&k| all[k as usize]));
        }
        Self { all, tree, nearby, listed, maps, reach }
    }

    /// Prefetches what [`Self::meet`] looks at first for a facet.
    #[inline(always)]
    pub(super) fn fetch(&self, facet: u32) {
        // Without a map an address that is never read.
        let map = self.nearby.get(facet as usize).map_or(NO_MAP, |near| near.map);
        prefetch(&self.maps, map as usize);
    }

    /// Whether the way between two places within reach of this facet touches a slab; both may be the same.
    #[inline(always)]
    pub(super) fn meet(&self, mesh: &FacetMesh, facet: u32, way: [Point; 2]) -> bool {
        let near = self.nearby[facet as usize];
        let may_meet =
            if near.map == NO_MAP { near.count > 0 } else { self.maps[near.map as usize].may_touch(way) };
        may_meet && self.any_nearby_meets(mesh, facet, way)
    }

    /// [`Self::meet`] of a facet that has slabs near it.
    fn any_nearby_meets(&self, mesh: &FacetMesh, facet: u32, way: [Point; 2]) -> bool {
        let Nearby { first, count, .. } = self.nearby[facet as usize];
        if count == 0 {
            return self.any_meets(mesh, Some(mesh.facets[facet as usize].face), way);
        }
        self.listed[first as usize..(first + count) as usize].iter().any(|slab| slab.meets(mesh, way))
    }

    /// Whether a place lies in the slab of any facet.
    pub(super) fn hold(&self, mesh: &FacetMesh, place: Point) -> bool {
        self.any_meets(mesh, None, [place; 2])
    }

    /// Whether a way touches a slab of any face but this one.
    fn any_meets(&self, mesh: &FacetMesh, but: Option<FaceId>, way: [Point; 2]) -> bool {
        self.tree.any_meeting(&Aabb::from_points(way), |k| {
            let slab = &self.all[k as usize];
            Some(mesh.facets[slab.facet as usize].face) != but && slab.meets(mesh, way)
        })
    }

    /// How far from its facet, mm, a place may lie of which [`Self::meet`] speaks.
    #[inline(always)]
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.all)
            + self.tree.bytes()
            + size_of_val(&*self.nearby)
            + size_of_val(&*self.listed)
            + size_of_val(&*self.maps)
    }
}

impl Slab {
    /// The slab of a facet of this sag, mm.
    fn of_facet(mesh: &FacetMesh, facet: u32, sag: f32) -> Self {
        let corners = mesh.corners(facet as usize);
        let bounds = Aabb::from_points(corners);
        let room = ROOM * (1.0 + bounds.min.abs().max(bounds.max.abs()).max_element());
        let sag = (f64::from(sag) + room) as f32;
        let Aabb { min, max } = bounds.grown(f64::from(sag));
        let [low, high] = [min, max].map(|p| p.to_array().map(|x| x as f32));
        Self { low: low.map(f32::next_down), high: high.map(f32::next_up), facet, sag: sag.next_up() }
    }

    /// The box around it.
    fn bounds(&self) -> Aabb {
        let [min, max] = [self.low, self.high].map(|p| Point::from_array(p.map(f64::from)));
        Aabb { min, max }
    }

    /// Whether a way touches the box and comes within the sag of the plane of one of the facet's triangles, as far as the box around it
    /// and its ends show.
    #[inline(always)]
    fn meets(&self, mesh: &FacetMesh, [a, b]: [Point; 2]) -> bool {
        let (low, high) = (a.min(b), a.max(b));
        let touches = (0..3).all(|k| high[k] >= f64::from(self.low[k]) && low[k] <= f64::from(self.high[k]));
        touches && self.comes_near_plane(mesh, [a, b], 0.0)
    }

    /// Whether what lies within `reach`, mm, of the hull of these places comes within the sag of the plane of one of the facet's
    /// triangles.
    fn comes_near_plane<const N: usize>(&self, mesh: &FacetMesh, places: [Point; N], reach: f64) -> bool {
        let [a, b, c, d] = mesh.corners(self.facet as usize);
        let comes_near = |across: Vector| {
            let room = (f64::from(self.sag) + reach) * across.length();
            let [low, high] = range_along(across, a, places);
            low <= room && high >= -room
        };
        comes_near((b - a).cross(c - a)) || comes_near((c - a).cross(d - a))
    }
}

/// The least and the largest of the products of an axis with the ways from `origin` to these places.
#[inline(always)]
fn range_along<const N: usize>(axis: Vector, origin: Point, places: [Point; N]) -> [f64; 2] {
    let along = places.map(|place| (place - origin).dot(axis));
    [along.into_iter().fold(f64::INFINITY, f64::min), along.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

/// All places within a reach of a facet, for finding the slabs that no way between such places touches.
struct Surroundings {
    corners: [Point; 4],
    reach: f64,
    bounds: Aabb,
    /// Along the normal of the facet's first triangle from its first corner, as the range of all these places; a normal of zero says
    /// nothing.
    normal: Vector,
    range: [f64; 2],
}

impl Surroundings {
    /// Of this facet, as far as `reach`, mm.
    fn of_facet(mesh: &FacetMesh, facet: usize, reach: f64) -> Self {
        let corners = mesh.corners(facet);
        let [a, b, c, _] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let [low, high] = range_along(normal, a, corners);
        let bounds = Aabb::from_points(corners).grown(reach);
        Self { corners, reach, bounds, normal, range: [low - reach, high + reach] }
    }

    /// Whether a way between such places may touch this slab: `false` where the slab's box lies beside them along the facet's normal, or
    /// they lie beyond the slab's planes.
    fn may_meet(&self, mesh: &FacetMesh, slab: &Slab) -> bool {
        let bounds = slab.bounds();
        let middle = (bounds.center() - self.corners[0]).dot(self.normal);
        let half = 0.5 * bounds.size().dot(self.normal.abs());
        middle - half <= self.range[1]
            && middle + half >= self.range[0]
            && slab.comes_near_plane(mesh, self.corners, self.reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::{Exact, Settings};
    use crate::math::{Frame, Uv};
    use crate::mesh::{Facet, MeshVertex};
    use crate::model::{Face, Model, Part, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::TAU;

    /// One facet of 20 × 20 mm, upon which a wall of 40 strips stands in a circle of radius 6 mm.
    fn plate_with_a_wall() -> FacetMesh {
        let on_circle = |k: u32, z: f64| {
            let (y, x) = (TAU * f64::from(k) / 40.0).sin_cos();
            Point::new(6.0 * x, 6.0 * y, z)
        };
        let corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0) * 10.0);
        let strips =
            (0..40).map(|k| [(k, 0.0), (k + 1, 0.0), (k + 1, 5.0), (k, 5.0)].map(|(k, z)| on_circle(k, z)));
        let positions: Vec<Point> = std::iter::once(corners).chain(strips).flatten().collect();
        let vertex = |position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO };
        let facet = |f: u32| Facet { vertices: [0, 1, 2, 3].map(|k| 4 * f + k), face: FaceId(f.min(1)) };
        FacetMesh {
            vertices: (0..positions.len() as u32).map(vertex).collect(),
            positions,
            facets: (0..41).map(facet).collect(),
            sag: vec![],
        }
    }

    /// What a map and a tree find is what testing every slab finds.
    #[test]
    fn no_slab_is_hidden_by_the_map_of_a_facet() {
        let plate = sweep::plane(&Frame::IDENTITY, [[-10.0, 10.0]; 2]);
        let wall = sweep::cylinder(&Frame::IDENTITY, 6.0, [0.0, TAU], [0.0, 5.0]);
        let faces = [plate, wall].map(Face::whole).into();
        let model = Model::from_part(Part { shells: vec![Shell { faces, ..Shell::default() }], ..Part::default() });
        let exact = Exact::build(&model, &Settings::default());
        let mesh = plate_with_a_wall();
        let slabs = Slabs::of_mesh(&mesh, &FacetRecord::of_mesh(&mesh, &exact, 0.05), 0.2);
        assert_eq!(slabs.maps.len(), 1);
        let mut met = 0;
        for k in 0..20_000u32 {
            let unit = |m: f64| (f64::from(k) * m).fract();
            let place = Point::new(20.0 * unit(0.618) - 10.0, 20.0 * unit(0.755) - 10.0, 0.1 * unit(0.569));
            let way = [place + 0.2 * Vector::new(unit(0.31) - 0.5, unit(0.57) - 0.5, 0.0), place];
            let meets = slabs.all.iter().any(|slab| slab.facet != 0 && slab.meets(&mesh, way));
            assert_eq!(slabs.meet(&mesh, 0, way), meets, "{way:?}");
            met += u32::from(meets);
        }
        // A ring 0.1 mm wide and as much as ways reach beyond, of 400 mm²: some hundreds.
        assert!((200..2_000).contains(&met), "{met}");
    }

    /// Of facets across one another, in all directions: what is found beforehand to be far from a facet is far from every way near it.
    #[test]
    fn no_way_near_a_facet_touches_a_slab_that_was_left_out() {
        let unit = |k: u32, m: f64| (f64::from(k) * m).fract();
        let point = |k: u32| Point::new(unit(k, 0.618_034), unit(k, 0.754_878), unit(k, 0.569_84)) * 10.0;
        let positions: Vec<Point> = (0..40)
            .flat_map(|f| [0, 1, 2, 3].map(|k| (f, k)))
            .map(|(f, k)| point(f) + 0.4 * point(97 * f + 13 * k))
            .collect();
        let vertex = |position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO };
        let facet = |f: u32| Facet { vertices: [0, 1, 2, 3].map(|k| 4 * f + k), face: FaceId(f) };
        let mesh = FacetMesh {
            vertices: (0..positions.len() as u32).map(vertex).collect(),
            positions,
            facets: (0..40).map(facet).collect(),
            sag: vec![],
        };
        let exact = Exact::build(&Model::default(), &Settings::default());
        let slabs = Slabs::of_mesh(&mesh, &FacetRecord::of_mesh(&mesh, &exact, 0.02), 0.1);
        let boxes_meet = |f: usize, slab: &Slab| {
            !Aabb::from_points(mesh.corners(f)).grown(0.1).intersection(slab.bounds()).is_empty()
        };
        let in_boxes: usize =
            (0..40).map(|f| slabs.all.iter().filter(|slab| boxes_meet(f, slab)).count() - 1).sum();
        assert!(4 * slabs.listed.len() < 3 * in_boxes, "{} of {in_boxes}", slabs.listed.len());
        let mut met = 0;
        for k in 0..40_000u32 {
            let f = k % 40;
            let [a, b, c, _] = mesh.corners(f as usize);
            let (s, t) = (unit(k, 0.445), unit(k, 0.7247));
            let on_facet = a + (b - a) * s.min(t) + (c - b) * (s.min(t) * s.max(t));
            let aside = Vector::new(unit(k, 0.31) - 0.5, unit(k, 0.57) - 0.5, unit(k, 0.83) - 0.5).normalize();
            let way = [on_facet, on_facet + 0.1 * unit(k, 0.177) * aside];
            let meets = slabs.all.iter().any(|slab| slab.facet != f && slab.meets(&mesh, way));
            assert_eq!(slabs.meet(&mesh, f, way), meets, "{f} {way:?}");
            met += u32::from(meets);
        }
        assert!((300..30_000).contains(&met), "{met}");
    }
}

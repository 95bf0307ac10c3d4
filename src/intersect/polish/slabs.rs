//! Places on the spline of one face that lie between the spline of another face and its facets.
//!
//! Facets leave the spline by up to their sag. A ray that starts between another face and that one's facets is, for these, already behind
//! the face: beside the wall of a bore light that rises from the mirror below it went on between the wall and its facets, all along it,
//! and into what stands behind. The facets of the face itself are told by the side to which the ray leaves.
//!
//! Guarantee: a start that is in no slab of its facet is on the same side of the facets of all other faces as of their splines, where
//! the sags are proved.

use super::curved_cells::FLAT_SAG;
use super::facet_record::FacetRecord;
use super::slab_map::SlabMap;
use crate::math::{Aabb, BoxTree, Point};
use crate::mesh::FacetMesh;
use rayon::prelude::*;
use smallvec::SmallVec;

/// A facet with more slabs near it, as of a plate with many holes, has a map of them and looks for them in a tree.
const MOST_LISTED: usize = 12;
/// Slabs that are looked at for the map of one facet; one with more around it, as a long strip across everything, always looks in the tree.
const MOST_MAPPED: usize = 4096;
/// And for all maps of a mesh: a tenth of a second. Of 56,000 facets that all lie across each other maps took 5 s.
const MOST_MAPPED_OF_MESH: usize = 1 << 22;
/// Slabs that are looked at to find out whether a facet needs a map, those of its own face too.
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

/// For each facet the slabs of other faces' facets that its piece of the spline comes near to.
pub(super) struct Slabs {
    /// Of all facets that are not flat, and a tree of their boxes.
    all: Vec<Slab>,
    tree: BoxTree,
    /// Of each facet its first slab in `listed`, and one more for the end of the last.
    starts: Vec<u32>,
    listed: Vec<Slab>,
    /// Of facets with too many to be listed.
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
        let box_of = |f: usize| Aabb::from_points(mesh.corners(f)).grown(reach);
        // The slabs of other faces near a facet, and whether there are more that were not looked at.
        let near = |f: usize, most_listed: usize, most_looked_at: usize| {
            let mut near = Listed::new();
            let mut looked_at = 0;
            let are_more = tree.any_meeting(&box_of(f), |k| {
                looked_at += 1;
                let is_foreign = mesh.facets[all[k as usize].facet as usize].face != mesh.facets[f].face;
                near.extend(is_foreign.then_some(k));
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
        let list_or_map = |(f, list): (usize, Option<Listed>)| {
            if let Some(near) = list {
                return (near, None);
            }
            let (near, are_more) = near(f, most, most);
            if !are_more && near.len() <= MOST_LISTED {
                return (near, None);
            }
            let mut map = SlabMap::new(box_of(f));
            if are_more {
                map.mark(&box_of(f));
            } else {
                near.iter().for_each(|&k| map.mark(&all[k as usize].bounds()));
            }
            (Listed::new(), Some(map))
        };
        let of_facets: Vec<_> = lists.into_par_iter().enumerate().map(list_or_map).collect();
        let (mut starts, mut listed, mut maps) = (vec![0], Vec::new(), Vec::new());
        for (near, map) in of_facets {
            listed.extend(near.iter().map(|&k| all[k as usize]));
            listed.extend(map.is_some().then(|| Slab::mapped(maps.len())));
            maps.extend(map);
            starts.push(listed.len() as u32);
        }
        Self { all, tree, starts, listed, maps, reach }
    }

    /// Whether the way between two places, of which the second is one of this facet's, touches a slab; both may be the same.
    #[inline(always)]
    pub(super) fn meet(&self, mesh: &FacetMesh, facet: u32, way: [Point; 2]) -> bool {
        let range = self.starts[facet as usize] as usize..self.starts[facet as usize + 1] as usize;
        self.listed[range].iter().any(|slab| match slab.map() {
            Some(map) => self.maps[map].may_touch(way) && self.any_meets(mesh, facet, way),
            None => slab.meets(mesh, way),
        })
    }

    /// Whether a way touches a slab of another face than this facet's.
    fn any_meets(&self, mesh: &FacetMesh, facet: u32, way: [Point; 2]) -> bool {
        self.tree.any_meeting(&Aabb::from_points(way), |k| {
            let slab = &self.all[k as usize];
            mesh.facets[slab.facet as usize].face != mesh.facets[facet as usize].face && slab.meets(mesh, way)
        })
    }

    /// Whether a place is so near to this facet that [`Self::meet`] speaks of it.
    #[inline]
    pub(super) fn reach(&self, mesh: &FacetMesh, facet: u32, place: Point) -> bool {
        Aabb::from_points(mesh.corners(facet as usize)).grown(self.reach).contains(place)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.all)
            + self.tree.bytes()
            + size_of_val(&*self.starts)
            + size_of_val(&*self.listed)
            + size_of_val(&*self.maps)
    }
}

/// In [`Slab::facet`]: stands for all slabs near a facet, of which the other bits name the map. A mesh has fewer facets.
const MAPPED: u32 = 1 << 31;

impl Slab {
    /// What is listed for a facet with too many slabs: its map, by its index.
    fn mapped(index: usize) -> Self {
        Self { low: [0.0; 3], high: [0.0; 3], facet: MAPPED | index as u32, sag: 0.0 }
    }

    /// The map that it stands for, if any.
    #[inline(always)]
    fn map(&self) -> Option<usize> {
        (self.facet & MAPPED != 0).then_some((self.facet & !MAPPED) as usize)
    }

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
    /// and its ends tell.
    #[inline(always)]
    fn meets(&self, mesh: &FacetMesh, [a, b]: [Point; 2]) -> bool {
        let (low, high) = (a.min(b), a.max(b));
        let touches = (0..3).all(|k| high[k] >= f64::from(self.low[k]) && low[k] <= f64::from(self.high[k]));
        touches && self.comes_near_plane(mesh, [a, b])
    }

    /// Whether a way comes within the sag of the plane of one of the facet's triangles.
    fn comes_near_plane(&self, mesh: &FacetMesh, way: [Point; 2]) -> bool {
        let [a, b, c, d] = mesh.corners(self.facet as usize);
        let comes_near = |across: Point| {
            let reach = f64::from(self.sag) * across.length();
            let [from, to] = way.map(|place| (place - a).dot(across));
            from.min(to) <= reach && from.max(to) >= -reach
        };
        comes_near((b - a).cross(c - a)) || comes_near((c - a).cross(d - a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::{Exact, Settings};
    use crate::math::{FaceId, Frame, Uv, Vector};
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

    /// What a map and a tree find is what asking every slab finds.
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
}

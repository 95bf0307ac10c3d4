//! The model as the tracer sees it: placed faces in world orientation, cut into Bézier patches about centres of their own.

use super::edge_use::edge_gaps;
use super::net::{self, Jet, V4};
use super::patch::{Patch, PatchGrid, is_ill_scaled, project};
use super::reference::{self, ReferencePatch};
use super::tolerances::{FLAGGED_OF_GAP, TANGENT};
use super::trim::Trim;
use crate::math::{FaceId, Frame, Point, Uv, Vector};
use crate::model::{Edge, Face, Model, Part, PlacedFace};
use crate::nurbs::{Curve, Surface};
use rustc_hash::FxHashMap;

/// Gaps wider than this where the part stands are not bridged, but flagged, mm: solids with wider ones are not closed to any reader.
pub(super) const WIDEST_GAP: f64 = 0.05;
/// A file's edge may lie off its faces by their gap: each of the two faces must look that far, and as far again for the other's.
pub(super) const DECIDING_OF_GAP: f64 = 2.0;
/// A vertex decides by its sectors as far off as this many times the distance by which an edge's end misses it.
const RADIUS_OF_MISS: f64 = 4.0;

/// One placed face.
#[derive(Debug)]
pub(super) struct FaceRecord {
    pub(super) id: FaceId,
    /// −1 where the outward normal is `-(Su × Sv)` in the world.
    pub(super) sign: f64,
    /// Index into [`Geometry::trims`].
    pub(super) trim: u32,
    /// First patch; patches of a face follow each other, v fastest.
    pub(super) first_patch: u32,
    /// Index into [`Geometry::grids`].
    pub(super) grid: u32,
    /// From the part to the world.
    pub(super) placement: Frame,
    /// Index into [`Geometry::edges`].
    pub(super) part: u32,
    /// Distance from a trim within which the side of the shared edge decides, mm.
    pub(super) deciding_distance: f64,
    /// Largest distance from a trim within which a root is flagged, mm: as far as the faces of the file lie off their edges, and
    /// more for rays that graze them. That of one edge is [`Geometry::flagging_distance`].
    pub(super) flagging_distance: f64,
    /// Instance and shell, of faces of closed shells.
    pub(super) solid: Option<[u32; 2]>,
    /// Whether a closed shell gapes at one of its edges by more than rounding.
    pub(super) gapes: bool,
}

/// Everything but the search structure.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) faces: Vec<FaceRecord>,
    pub(super) patches: Vec<Patch>,
    /// Control points of all patches, and behind them of the leaves whose nets are not their patches'.
    pub(super) nets: Vec<V4>,
    pub(super) trims: Vec<Trim>,
    pub(super) grids: Vec<PatchGrid>,
    /// The surfaces as given, in the order of `grids`.
    pub(super) surfaces: Vec<Surface>,
    /// Edge curves of each part, in its own coordinates.
    pub(super) edges: Vec<Vec<Curve>>,
    /// The vertices at their ends, and [`RADIUS_OF_MISS`] times the farthest that an end misses each, in the part's coordinates and units.
    pub(super) ends: Vec<Vec<[(Point, f64); 2]>>,
    /// Smallest distance from a trim that is flagged, mm of the world.
    pub(super) world_band: f64,
    /// Largest coordinate that starts were rounded at elsewhere, mm; 0 where they are the model's own.
    pub(super) farthest_start: f64,
    /// Position in `faces` of each placed face that has a surface.
    pub(super) by_id: FxHashMap<FaceId, u32>,
    /// Placed faces left out: ready meshes, and surfaces with non-finite points or weights that are not positive.
    pub(super) skipped: Vec<FaceId>,
}

impl Geometry {
    /// Prepares all placed faces of a model: surfaces and trims once a part, patches once a place. `world_band` is the least distance from
    /// a trim that is flagged, `farthest_start` the largest coordinate that starts were rounded at elsewhere, mm.
    pub(super) fn new(model: &Model, world_band: f64, farthest_start: f64) -> Self {
        let curves = |part: &Part| part.edges.iter().map(|e| e.curve.clone()).collect();
        let mut geometry = Self {
            world_band,
            farthest_start,
            edges: model.parts.iter().map(curves).collect(),
            ends: model.parts.iter().map(edge_ends).collect(),
            ..Self::default()
        };
        let gaps: Vec<Vec<f64>> = model.parts.iter().map(edge_gaps).collect();
        // A band is a length of the world: in the units of a part that is made smaller it is longer.
        let mut least_scale = vec![f64::INFINITY; model.parts.len()];
        for instance in &model.instances {
            let least = &mut least_scale[instance.part.0 as usize];
            *least = least.min(instance.placement.scale);
        }
        // Instances share the trims and break lines of their part: found by the face's address, which names it for as long as the model
        // is borrowed.
        let mut shared: FxHashMap<*const Face, (u32, u32)> = FxHashMap::default();
        let [mut patches, mut points] = [0; 2];
        for placed in model.placed_faces() {
            match placed.face {
                Some(face) if is_usable(face) => {
                    let (_, grid) = *shared.entry(face as *const Face).or_insert_with(|| {
                        let grid = PatchGrid::new(face);
                        let gaps = &gaps[placed.part.0 as usize];
                        let part_band = world_band / least_scale[placed.part.0 as usize];
                        geometry.trims.push(Trim::new(face, grid.closed, part_band, gaps));
                        geometry.grids.push(grid);
                        geometry.surfaces.push(face.surface.clone());
                        (geometry.trims.len() as u32 - 1, geometry.grids.len() as u32 - 1)
                    });
                    let count = geometry.grids[grid as usize].patch_count();
                    patches += count;
                    points += count * net::len(face.surface.degree.map(|d| d as u8));
                }
                _ => geometry.skipped.push(placed.id),
            }
        }
        geometry.patches.reserve_exact(patches);
        geometry.nets.reserve_exact(points);
        for placed in model.placed_faces() {
            let Some((face, &place)) = placed.face.and_then(|f| Some((f, shared.get(&(f as *const Face))?))) else {
                continue;
            };
            let closed = |s: &usize| model.part(placed.part).shells[*s].closed;
            let solid = placed.shell.filter(closed).map(|s| [placed.instance as u32, s as u32]);
            geometry.add_face(&placed, face, place, solid);
        }
        geometry
    }

    /// The control points of a patch, about its centre.
    #[inline(always)]
    pub(super) fn net(&self, patch: &Patch) -> &[V4] {
        &self.nets[patch.net as usize..patch.net as usize + patch.net_len()]
    }

    /// The homogeneous point of a patch about its centre at local parameters, and derivatives by these.
    pub(super) fn jet(&self, patch: &Patch, [u, v]: [f64; 2]) -> Jet {
        net::evaluate(self.net(patch), patch.degree, u, v)
    }

    /// Distance from a trim, mm, within which a root is flagged where the faces along it lie `gap`, in the units of the part, off the edge.
    pub(super) fn flagging_distance(&self, gap: f64, placement: &Frame) -> f64 {
        self.world_band.max(FLAGGED_OF_GAP * gap * placement.scale)
    }

    /// Adds a face at its place, with patches that are placed there; `trim` and `grid` are those of its part.
    fn add_face(
        &mut self,
        placed: &PlacedFace<'_>,
        face: &Face,
        (trim, grid): (u32, u32),
        solid: Option<[u32; 2]>,
    ) {
        let record = self.faces.len() as u32;
        // Mirroring turns a normal over once more.
        let sign = if face.reversed != placed.placement.is_mirrored() { -1.0 } else { 1.0 };
        self.by_id.insert(placed.id, record);
        let first_patch = self.patches.len() as u32;
        let placement = *placed.placement;
        let deciding_distance = self.world_band.max(DECIDING_OF_GAP * bridged_gap(face.gap, &placement));
        let widest_gap = self.trims[trim as usize].widest_gap();
        let flagging_distance = self.flagging_distance(widest_gap, &placement);
        let part = placed.part.0;
        self.faces.push(FaceRecord {
            id: placed.id,
            sign,
            trim,
            first_patch,
            grid,
            placement,
            part,
            deciding_distance,
            flagging_distance,
            solid,
            gapes: solid.is_some() && widest_gap * placement.scale > TANGENT,
        });
        for mut patch in face.surface.bezier_patches() {
            // Knot insertion in double precision would lose what such a patch's small side has of digits.
            if is_ill_scaled(&patch) {
                reference::extract(&face.surface, &mut patch);
            }
            self.patches.push(Patch::new(&patch, record, placed, &mut self.nets));
        }
    }

    /// A patch as it was given, for computing in 32 digits.
    pub(super) fn reference(&self, patch: &Patch) -> ReferencePatch<'_> {
        let face = &self.faces[patch.face as usize];
        let surface = &self.surfaces[face.grid as usize];
        ReferencePatch { surface, placement: &face.placement, domain: patch.domain }
    }

    /// Whether a point of the world is a pole of the patch's surface, within `distance` mm.
    pub(super) fn is_pole(&self, patch: &Patch, point: Point, distance: f64) -> bool {
        let sides = self.pole_sides(patch);
        (0..2).any(|d| {
            (0..2).any(|end| {
                // All points of a collapsed side are one, so any of them will do.
                let mut local = [0.5; 2];
                local[d] = end as f64;
                sides[d][end] && project(&self.jet(patch, local)).0.distance(point - patch.center) <= distance
            })
        })
    }

    /// Whether a ray (origin, direction) passes a pole of the patch's surface within `distance` mm.
    pub(super) fn passes_pole(&self, patch: &Patch, [o, d]: [Vector; 2], distance: f64) -> bool {
        let near = |pole: Point| (pole - (o - patch.center)).cross(d).length() <= distance;
        let sides = self.pole_sides(patch);
        (0..2).any(|k| {
            (0..2).any(|end| {
                let mut local = [0.5; 2];
                local[k] = end as f64;
                sides[k][end] && near(project(&self.jet(patch, local)).0)
            })
        })
    }

    /// Whether a side of the patch is a pole of its surface.
    pub(super) fn has_pole(&self, patch: &Patch) -> bool {
        self.pole_sides(patch).as_flattened().contains(&true)
    }

    /// Which sides of a patch, low and high in u and in v, are a pole of its surface.
    fn pole_sides(&self, patch: &Patch) -> [[bool; 2]; 2] {
        let grid = &self.grids[self.faces[patch.face as usize].grid as usize];
        [0, 1].map(|d: usize| {
            let ends = [grid.breaks[d][0], grid.breaks[d][grid.breaks[d].len() - 1]];
            [0, 1].map(|end| grid.poles[d][end] && patch.domain[d][end] == ends[end])
        })
    }

    /// The trimming of a patch's face.
    pub(super) fn trim_of(&self, patch: &Patch) -> &Trim {
        &self.trims[self.faces[patch.face as usize].trim as usize]
    }

    /// The patch of a face that holds the parameters; the outermost one where they lie beyond the domain.
    pub(super) fn patch_at(&self, face: &FaceRecord, uv: Uv) -> u32 {
        // Inner breaks alone: parameters on an end, or beyond it by rounding, belong to the outermost patch.
        let grid = &self.grids[face.grid as usize];
        let span = |d: usize, x: f64| {
            let inner = &grid.breaks[d][1..grid.breaks[d].len() - 1];
            inner.partition_point(|&b| b <= x) as u32
        };
        face.first_patch + span(0, uv.x) * (grid.breaks[1].len() as u32 - 1) + span(1, uv.y)
    }

    /// A number with the sign of `(Su × Sv) · direction` at parameters of a face, in the world.
    pub(super) fn facing(&self, face: &FaceRecord, uv: Uv, direction: Vector) -> f64 {
        let patch = &self.patches[self.patch_at(face, uv) as usize];
        let (_, du, dv) = project(&self.jet(patch, patch.local(uv)));
        du.cross(dv).dot(direction)
    }
}

/// How much of a gap, in the units of the part, is bridged where the part stands, mm.
pub(super) fn bridged_gap(gap: f64, placement: &Frame) -> f64 {
    (gap * placement.scale).min(WIDEST_GAP)
}

/// Makes room for `more` items in a list that grows by an eighth at a time: patches and leaves are half a kilobyte each, and of lists that
/// double in length half would often stay empty.
pub(super) fn make_room<T>(list: &mut Vec<T>, more: usize) {
    if list.capacity() - list.len() < more {
        list.reserve_exact(more.max(list.len() / 8));
    }
}

/// The vertices at start and end of each of a part's edges, with [`RADIUS_OF_MISS`] times what edges miss them by, in the units of the
/// part; where the part has no such vertex, the end of the curve.
fn edge_ends(part: &Part) -> Vec<[(Point, f64); 2]> {
    let end = |e: &Edge, k: usize| e.curve.evaluate(e.curve.domain()[k]);
    // One radius a vertex, not one an edge: the faces around it must agree on when its sectors decide, or two would
    // claim a ray.
    let mut radii = vec![0f64; part.vertices.len()];
    for (e, k) in part.edges.iter().flat_map(|e| [(e, 0), (e, 1)]) {
        let vertex = e.vertices[k].0 as usize;
        if let (Some(radius), Some(place)) = (radii.get_mut(vertex), part.vertices.get(vertex)) {
            *radius = radius.max(RADIUS_OF_MISS * end(e, k).distance(*place));
        }
    }
    let place = |e: &Edge, k: usize| {
        let vertex = e.vertices[k].0 as usize;
        part.vertices.get(vertex).map_or((end(e, k), 0.0), |p| (*p, radii[vertex]))
    };
    part.edges.iter().map(|e| [place(e, 0), place(e, 1)]).collect()
}

/// Whether a face's surface can be traced: whole arrays, degrees in bounds, finite rising knots, finite points of positive weight.
fn is_usable(face: &Face) -> bool {
    let s = &face.surface;
    let [nu, nv] = s.counts();
    let ordered = s.knots.iter().all(|k| k.iter().all(|x| x.is_finite()) && k.is_sorted());
    let [[u0, u1], [v0, v1]] = s.domain();
    s.points.len() == nu * nv
        && s.degree.iter().all(|&d| (1..=crate::nurbs::MAX_DEGREE).contains(&d))
        && ordered
        && u0 < u1
        && v0 < v1
        && s.points.iter().all(|p| p.is_finite() && p.w > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Instance, PartId, Shell};
    use crate::nurbs::sweep;

    #[test]
    fn gaps_are_as_wide_as_where_their_part_stands() {
        let plane = sweep::plane(&Frame::IDENTITY, [[0.0, 10.0]; 2]);
        let face = Face { gap: 0.5, ..Face::whole(plane) };
        let part = Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() };
        let mut model = Model::from_part(part);
        let smaller = Frame { scale: 0.01, ..Frame::IDENTITY };
        model.instances.push(Instance { part: PartId(0), placement: smaller, ..model.instances[0].clone() });
        let geometry = Geometry::new(&model, 1e-6, 0.0);
        // Half a unit is wider than what is bridged, and 5 µm where a unit is 10 µm.
        let distances: Vec<f64> = geometry.faces.iter().map(|f| f.deciding_distance).collect();
        assert_eq!(distances, [2.0 * WIDEST_GAP, 2.0 * 0.005]);
    }
}

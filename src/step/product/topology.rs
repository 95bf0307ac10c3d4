//! Shells, faces and loops of a representation as lists of ids, before any geometry is computed.

use crate::step::geometry::{Outcome, Refusal, references};
use crate::step::part21::{Args, Entity, File};
use rustc_hash::{FxHashMap, FxHashSet};

/// Names of solids that hold no faces but a recipe.
const RECIPES: [&str; 22] = [
    "CSG_SOLID",
    "BOOLEAN_RESULT",
    "EXTRUDED_AREA_SOLID",
    "REVOLVED_AREA_SOLID",
    "EXTRUDED_FACE_SOLID",
    "REVOLVED_FACE_SOLID",
    "SURFACE_CURVE_SWEPT_AREA_SOLID",
    "SWEPT_DISK_SOLID",
    "HALF_SPACE_SOLID",
    "BLOCK",
    "SPHERE",
    "RIGHT_CIRCULAR_CYLINDER",
    "RIGHT_CIRCULAR_CONE",
    "TORUS",
    "RIGHT_ANGULAR_WEDGE",
    "ELLIPSOID",
    "ECCENTRIC_CONE",
    "RECTANGULAR_PYRAMID",
    "FACETED_PRIMITIVE",
    "CONVEX_HEXAHEDRON",
    "CYCLIDE_SEGMENT_SOLID",
    "SOLID_REPLICA",
];

/// Names of faces.
pub(super) const FACES: [&str; 3] = ["ADVANCED_FACE", "FACE_SURFACE", "SUBFACE"];
/// Longest chain of faces that are parts of faces.
const MAX_PARENTS: usize = 4;
/// Times that an edge may bound a face: a seam does so from both sides.
const MAX_USES: u32 = 2;

/// A shell to be converted, with the styles and names around it.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShellPlan {
    pub(crate) name: String,
    pub(crate) closed: bool,
    /// Whether a solid lies inside of it, and no void.
    pub(crate) outer: bool,
    /// Whether it bounds a void of the solid whose shell comes before it.
    pub(crate) void: bool,
    /// Faces, and whether the shell turns them around.
    pub(crate) faces: Vec<(u64, bool)>,
    /// Whether these are all that it lists.
    pub(crate) whole: bool,
    /// Entities whose style the shell inherits, the nearest first.
    pub(crate) owners: Vec<u64>,
}

/// An edge as loops name it, the same from both faces beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum EdgeKey {
    /// An EDGE_CURVE.
    Entity(u64),
    /// The straight line between two points of POLY_LOOPs, the smaller id first.
    Straight(u64, u64),
    /// A part of an EDGE_CURVE, between two vertices in the order of the edge.
    Part { entity: u64, ends: [u64; 2] },
}

/// A face's topology: ids of its surface and edges, without geometry.
#[derive(Clone, Debug)]
pub(crate) struct FacePlan {
    pub(crate) name: String,
    pub(crate) surface: u64,
    /// Whether the face looks along the surface's normal.
    pub(crate) same_sense: bool,
    /// For each bound the edges in its order, and whether it runs against them; bounds without edges are left out.
    pub(crate) loops: Vec<Vec<(EdgeKey, bool)>>,
}

/// The shapes in the items of a representation.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShapeItems {
    pub(crate) shells: Vec<ShellPlan>,
    /// Surfaces without a face: CURVE_BOUNDED_SURFACE and bare surfaces of geometric sets.
    pub(crate) surfaces: Vec<u64>,
    /// The same as a set, to find what is listed again: a set of 200,000 took seven seconds to search.
    listed_surfaces: FxHashSet<u64>,
    /// Solids given as a recipe.
    pub(crate) recipes: Vec<u64>,
    /// Tessellated solids, shells and faces.
    pub(crate) tessellated: Vec<u64>,
    pub(crate) refused: Vec<Refusal>,
    /// What is listed more than once and stands once.
    pub(crate) repaired: Vec<Refusal>,
    /// Shells that bound a solid from outside.
    outer: FxHashSet<u64>,
}

impl ShapeItems {
    /// Whether there is nothing to convert or to refuse.
    pub(crate) fn is_empty(&self) -> bool {
        self.shells.is_empty()
            && self.surfaces.is_empty()
            && self.recipes.is_empty()
            && self.tessellated.is_empty()
            && self.refused.is_empty()
    }

    /// Returns the same shapes without some faces.
    pub(super) fn without_faces(&self, faces: &[u64]) -> Self {
        let faces: FxHashSet<u64> = faces.iter().copied().collect();
        let mut rest = self.clone();
        rest.shells.iter_mut().for_each(|shell| shell.faces.retain(|(id, _)| !faces.contains(id)));
        rest
    }

    /// Sorts an item of a representation in; what is no shape, or not in the file, is left out.
    pub(crate) fn add(&mut self, file: &File<'_>, id: u64) {
        let Some(e) = file.entity(id) else { return };
        let name = e.attributes("REPRESENTATION_ITEM", 0).unwrap_or_else(|| e.args()).name(0);
        if let Some(a) = e.attributes("MANIFOLD_SOLID_BREP", 1).or_else(|| e.attributes("FACETED_BREP", 1)) {
            if a.id(0).is_some_and(|shell| !self.outer.insert(shell)) {
                self.repaired.push(Refusal::new(e, "its shell bounds another solid already: both are one"));
                return;
            }
            self.add_shell(file, a.id(0), &name, &[id], true, e);
            // Of a complex instance the voids are attributes of their own; of a simple one they stand behind the shell.
            if let Some(v) = e.attributes("BREP_WITH_VOIDS", 2) {
                self.add_voids(file, e, v.list(0), &name);
            }
        } else if let Some(a) = e.attributes("BREP_WITH_VOIDS", 1) {
            self.add_shell(file, a.id(0), &name, &[id], true, e);
            self.add_voids(file, e, a.list(1), &name);
        } else if let Some(a) =
            e.attributes("SHELL_BASED_SURFACE_MODEL", 1).or_else(|| e.attributes("FACE_BASED_SURFACE_MODEL", 1))
        {
            for shell in self.listed(e, a.list(0)) {
                self.add_shell(file, Some(shell), &name, &[id], false, e);
            }
        } else if e.is_one_of(&[
            "OPEN_SHELL",
            "CLOSED_SHELL",
            "CONNECTED_FACE_SET",
            "ORIENTED_OPEN_SHELL",
            "ORIENTED_CLOSED_SHELL",
        ]) {
            self.add_shell(file, Some(id), &name, &[], false, e);
        } else if e.is_one_of(&FACES) {
            // A face alone is an open shell of one face.
            let faces = vec![(id, false)];
            self.shells.push(ShellPlan { name, faces, whole: true, ..ShellPlan::default() });
        } else if let Some(a) = e.attributes("GEOMETRIC_SET", 1) {
            // Elements of other kinds are no shapes.
            let elements = self.listed(e, a.list(0)).into_iter();
            elements.filter(|id| file.entity(*id).is_some_and(is_surface)).for_each(|id| self.add_surface(id));
        } else if e.keywords().any(is_tessellated) {
            self.tessellated.push(id);
        } else if e.is_one_of(&RECIPES) {
            self.recipes.push(id);
        } else if is_surface(e) {
            self.add_surface(id);
        } else if e.keywords().any(is_unsupported_shape) {
            self.refused.push(Refusal::new(e, "this kind of shape is not converted"));
        }
    }

    /// Returns the ids of a list of `e`; entries that are no references are refused once, in `e`'s name.
    fn listed(&mut self, e: Entity<'_, '_>, list: Args<'_, '_>) -> Vec<u64> {
        list.refs().unwrap_or_else(|| {
            self.refused.push(Refusal::no_reference(e));
            list.ids()
        })
    }

    /// Adds a surface without a face, once.
    fn add_surface(&mut self, id: u64) {
        if self.listed_surfaces.insert(id) {
            self.surfaces.push(id);
        }
    }

    /// Adds a shell for each void of the solid `e`.
    fn add_voids(&mut self, file: &File<'_>, e: Entity<'_, '_>, shells: Args<'_, '_>, name: &str) {
        for shell in self.listed(e, shells) {
            let before = self.shells.len();
            // An oriented shell may become several plans; what was added now bounds the void.
            self.add_shell(file, Some(shell), name, &[e.id], true, e);
            for shell in self.shells.iter_mut().skip(before) {
                shell.outer = false;
                shell.void = true;
            }
        }
    }

    /// Adds the plan of the shell `id`: its faces, and for each whether an odd number of oriented shells and faces around it turns it.
    /// `name` is that of the representation item, `owners` are the entities around the shell whose style it inherits, nearest first.
    /// `solid`: it bounds a solid, is closed whatever it calls itself, and outer until a caller says that it is a void. A missing shell is
    /// refused in `owner`'s name.
    fn add_shell(
        &mut self,
        file: &File<'_>,
        id: Option<u64>,
        name: &str,
        owners: &[u64],
        solid: bool,
        owner: Entity<'_, '_>,
    ) {
        let Some(mut e) = id.and_then(|id| file.entity(id)) else {
            self.refused.push(Refusal::new(owner, "its shell is missing"));
            return;
        };
        let mut owners = [&[e.id], owners].concat();
        // Turned twice is not turned: only the parity of the senses counts.
        let mut flip = false;
        // Oriented shells refer to a shell; a chain of them must end.
        for _ in 0..4 {
            let Some(a) =
                e.attributes("ORIENTED_CLOSED_SHELL", 2).or_else(|| e.attributes("ORIENTED_OPEN_SHELL", 2))
            else {
                break;
            };
            flip ^= a.flag(1) == Some(false);
            let Some(inner) = a.entity(0) else { break };
            e = inner;
            owners.insert(0, e.id);
        }
        // In a complex instance the faces are the set's only attribute; in a simple one they stand behind the name.
        let own = e
            .attributes("CONNECTED_FACE_SET", 1)
            .or_else(|| Some(e.args()).filter(|_| e.keyword() != ""))
            .map(|a| if e.keyword().is_empty() { a.list(0) } else { e.args().list(1) });
        let (mut faces, mut listed) = (Vec::new(), FxHashSet::default());
        let mut repeated = 0usize;
        let ids = own.map_or_else(Vec::new, |list| self.listed(e, list));
        let whole = own.is_none_or(|list| list.len() == ids.len());
        for face in ids {
            let mut turned = flip;
            let mut face = face;
            for _ in 0..4 {
                let Some(a) = file.entity(face).and_then(|f| f.attributes("ORIENTED_FACE", 2)) else { break };
                turned ^= a.flag(1) == Some(false);
                let Some(inner) = a.id(0) else { break };
                face = inner;
            }
            // Faces of a shell are a set: a list of a million times the same one is that one.
            if listed.insert(face) { faces.push((face, turned)) } else { repeated += 1 }
        }
        if repeated > 0 {
            self.repaired.push(Refusal::new(e, format!("lists faces again, {repeated} times: each stands once")));
        }
        // A solid is closed whatever its shell calls itself.
        let closed = solid || e.is_a("CLOSED_SHELL");
        let name = name.to_string();
        self.shells.push(ShellPlan { name, closed, outer: solid, void: false, faces, whole, owners });
    }
}

/// Whether a keyword is that of a tessellated solid, shell, face or set.
pub(super) fn is_tessellated(keyword: &str) -> bool {
    matches!(
        keyword,
        "TESSELLATED_SOLID"
            | "TESSELLATED_SHELL"
            | "TRIANGULATED_FACE"
            | "COMPLEX_TRIANGULATED_FACE"
            | "TRIANGULATED_SURFACE_SET"
            | "COMPLEX_TRIANGULATED_SURFACE_SET"
            | "TESSELLATED_GEOMETRIC_SET"
    )
}

/// Whether a keyword is that of a shape which light could meet, of a kind that is not read.
fn is_unsupported_shape(keyword: &str) -> bool {
    // By the ends of names: schemas add solids and volumes with each edition.
    ["_SOLID", "_VOLUME", "HALF_SPACE"].iter().any(|end| keyword.ends_with(end))
        || matches!(
            keyword,
            "SURFACE_REPLICA" | "SURFACE_PATCH" | "ORIENTED_FACE" | "REPOSITIONED_TESSELLATED_ITEM"
        )
        || keyword.contains("TRIANGULATED")
}

/// Whether an entity is a surface, by its keyword.
pub(crate) fn is_surface(e: Entity<'_, '_>) -> bool {
    e.keywords().any(|k| {
        k.ends_with("_SURFACE")
            || k.starts_with("SURFACE_OF_")
            || k == "PLANE"
            || k == "B_SPLINE_SURFACE_WITH_KNOTS"
    })
}

/// Reads the surface, sense and bounds of a face, without geometry. Refused where a bound, its loop or an edge is missing.
pub(crate) fn read_face(file: &File<'_>, id: u64) -> Outcome<FacePlan> {
    let Some(e) = file.entity(id) else {
        return Err(Refusal::missing(id));
    };
    // A complex instance has no place for inherited names before its attributes.
    let complex = e.keyword().is_empty();
    let bounds = if complex { e.attributes("FACE", 0).map(|a| a.list(0)) } else { Some(e.args().list(1)) };
    // A part of a face has bounds of its own on its parent's surface.
    let mut owner = e;
    for _ in 0..MAX_PARENTS {
        let Some(parent) = owner.attributes("SUBFACE", 2).and_then(|a| a.entity(0)) else { break };
        owner = parent;
    }
    // The sense stands where the surface is named, which for a part of a face is its parent.
    let (surface, sense) = if owner.keyword().is_empty() {
        let own = owner.attributes("FACE_SURFACE", 0);
        (own.and_then(|a| a.id(0)), own.and_then(|a| a.flag(1)))
    } else if owner.is_one_of(&["ADVANCED_FACE", "FACE_SURFACE"]) {
        (owner.args().id(2), owner.args().flag(3))
    } else {
        let why =
            if owner.is_a("ORIENTED_FACE") { "its face is missing" } else { "this kind of face is not supported" };
        return Err(Refusal::new(e, why));
    };
    let Some(surface) = surface else { return Err(Refusal::new(e, "its surface is missing")) };
    let mut loops = Vec::new();
    let mut uses: FxHashMap<EdgeKey, u32> = FxHashMap::default();
    let listed = bounds.map_or(0, |b| b.len());
    for bound in bounds.iter().flat_map(|b| (0..listed).map(|i| b.entity(i))) {
        // Without it the face would have no hole there, or no end.
        let Some(bound) = bound else { return Err(Refusal::new(e, "a bound of it is missing")) };
        let a = bound
            .attributes("FACE_BOUND", 1)
            .or_else(|| bound.attributes("FACE_OUTER_BOUND", 1))
            .unwrap_or_else(|| bound.args());
        let Some(border) = a.entity(0) else { return Err(Refusal::new(bound, "its loop is missing")) };
        let mut edges = edge_loop(border)?;
        // A bound against its loop is run backwards: order and senses turn both.
        if a.flag(1) == Some(false) {
            edges.reverse();
            edges.iter_mut().for_each(|x| x.1 = !x.1);
        }
        // One by one: thousands of bounds may have the same long loop.
        for (key, _) in &edges {
            let times = uses.entry(*key).or_insert(0);
            *times += 1;
            if *times > MAX_USES {
                return Err(Refusal::new(e, format!("one of its edges bounds it more than {MAX_USES} times")));
            }
        }
        if !edges.is_empty() {
            loops.push(edges);
        }
    }
    let name = if complex { String::new() } else { e.args().name(0) };
    // Without a sense, as some writers leave it, the surface's own normal counts.
    Ok(FacePlan { name, surface, same_sense: sense != Some(false), loops })
}

/// Returns the edges of a loop in its order, and whether it runs against them; none for a VERTEX_LOOP. Refuses missing edges and points,
/// and other kinds of loops.
fn edge_loop(e: Entity<'_, '_>) -> Outcome<Vec<(EdgeKey, bool)>> {
    if e.is_a("VERTEX_LOOP") {
        return Ok(Vec::new());
    }
    if let Some(a) = e.attributes("POLY_LOOP", 1) {
        let points = references(e, a.list(0))?;
        let n = points.len();
        return Ok((0..n)
            .map(|i| (points[i], points[(i + 1) % n]))
            // A corner given twice has no edge between.
            .filter(|(a, b)| a != b)
            // Named by its ends in order, so that both faces beside it find the same edge.
            .map(|(a, b)| (EdgeKey::Straight(a.min(b), a.max(b)), a > b))
            .collect());
    }
    let list = e.attributes("EDGE_LOOP", 1).or_else(|| e.attributes("PATH", 1)).map(|a| a.list(0));
    let Some(list) = list else { return Err(Refusal::new(e, "this kind of loop is not supported")) };
    let mut edges = Vec::with_capacity(list.len());
    for i in 0..list.len() {
        let Some(mut edge) = list.entity(i) else { return Err(Refusal::new(e, "an edge of the loop is missing")) };
        let mut reversed = false;
        // Oriented edges may be oriented again; a chain of them must end.
        for _ in 0..4 {
            let Some(a) = edge.attributes("ORIENTED_EDGE", 3) else { break };
            reversed ^= a.flag(1) == Some(false);
            let Some(inner) = a.entity(0) else { return Err(Refusal::new(edge, "its edge is missing")) };
            edge = inner;
        }
        edges.push((EdgeKey::Entity(edge.id), reversed));
    }
    Ok(edges)
}

/// Numbers the edges of faces in the order of first use, each once; returns them in that order, and the number of each.
pub(crate) fn number_edges<'p>(
    faces: impl Iterator<Item = &'p FacePlan>,
) -> (Vec<EdgeKey>, FxHashMap<EdgeKey, usize>) {
    let (mut keys, mut index) = (Vec::new(), FxHashMap::default());
    // In the order of the file, not of a table: two runs must number edges alike.
    for (key, _) in faces.flat_map(|f| f.loops.iter().flatten()) {
        index.entry(*key).or_insert_with(|| {
            keys.push(*key);
            keys.len() - 1
        });
    }
    (keys, index)
}

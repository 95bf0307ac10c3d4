//! Which curved face of one solid lies on a face of another, wholly or in part.

use super::trimmed::{CARRIER_SHARE, FaceKey, TrimmedFace};
use crate::math::{Aabb, BoxTree};
use crate::model::{Analytic, Model};
use crate::tessellate::assemble::PartMesh;
use crate::tessellate::placed_part::PlacedPart;
use crate::tessellate::settings::Settings;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// How much of a guest lies on its carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Extent {
    /// All of it.
    Whole,
    /// An area, but not all of it.
    Part,
}

/// A face that lies on another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Contact {
    /// The face whose facets both have.
    pub(super) carrier: FaceKey,
    /// The face that lies on it.
    pub(super) guest: FaceKey,
    /// How much of it does.
    pub(super) extent: Extent,
}

/// A curved face with its box in the model's coordinates, grown by half of the glue distance.
struct BoxedFace {
    key: FaceKey,
    shell: usize,
    bounds: Aabb,
}

/// Finds the faces of one solid that lie on a face of another, wholly or in part, within [`Settings::glue_mm`]. Returns the contacts,
/// sorted, and the faces in them, carriers with a tightened tolerance.
///
/// A face is either carrier or guest; what lies wholly on its carrier has no other. Of faces that touch in a circle of odd length a pair is
/// left out. Planes are, because their facets coincide as they are.
pub(super) fn contacts<'m>(
    model: &'m Model,
    places: &[PlacedPart<'m>],
    settings: &Settings,
    parts: &[Option<PartMesh>],
) -> (Vec<Contact>, FxHashMap<FaceKey, TrimmedFace<'m>>) {
    let glue = settings.glue_mm;
    let faces = curved_face_boxes(model, parts, glue);
    let boxes: Vec<Aabb> = faces.iter().map(|f| f.bounds).collect();
    let mut pairs: Vec<[FaceKey; 2]> = Vec::new();
    for meeting in BoxTree::meeting_pairs(&boxes) {
        let [a, b] = meeting.map(|k| &faces[k]);
        let other_solid = a.key.instance != b.key.instance || a.shell != b.shell;
        if other_solid {
            pairs.push([a.key.min(b.key), a.key.max(b.key)]);
        }
    }
    pairs.sort_unstable();
    let mut keys: Vec<FaceKey> = pairs.iter().flatten().copied().collect();
    keys.sort_unstable();
    keys.dedup();
    let trimmed = |&key: &FaceKey| {
        let instance = &model.instances[key.instance];
        let part = instance.part.0 as usize;
        Some((key, TrimmedFace::new(instance, &places[part], settings, parts[part].as_ref()?, key)?))
    };
    let mut trimmed: FxHashMap<FaceKey, TrimmedFace<'m>> = keys.par_iter().filter_map(trimmed).collect();
    let carried = |&[a, b]: &[FaceKey; 2]| {
        // The face with the lower key comes first, so that the carrier does not depend on chance.
        let (x, y) = (trimmed.get(&a)?, trimmed.get(&b)?);
        if x.carries(y, glue) {
            Some(Contact { carrier: a, guest: b, extent: Extent::Whole })
        } else if y.carries(x, glue) {
            Some(Contact { carrier: b, guest: a, extent: Extent::Whole })
        } else {
            x.overlaps(y, glue).then_some(Contact { carrier: a, guest: b, extent: Extent::Part })
        }
    };
    let mut out = with_one_role_each(pairs.par_iter().filter_map(carried).collect());
    out.sort_unstable();
    // Tighter than requested, so that the guest's own proof, over other parameters, has a share left.
    for c in &out {
        // Guests prove the carrier's facets over parameters of their own.
        if let Some(field) = trimmed.get(&c.guest).map(|guest| guest.surface.field)
            && let Some(carrier) = trimmed.get_mut(&c.carrier)
        {
            // Of all its guests: each proves its own.
            let own_share = carrier.surface.field.tighter(&carrier.asked, CARRIER_SHARE);
            carrier.surface.field = own_share.tighter(&field, CARRIER_SHARE);
        }
    }
    let concerned: FxHashSet<FaceKey> = out.iter().flat_map(|c| [c.carrier, c.guest]).collect();
    trimmed.retain(|key, _| concerned.contains(key));
    (out, trimmed)
}

/// A face in a tree of contacts, in which carriers and guests take turns.
#[derive(Clone, Copy)]
struct Turn {
    /// The face above it in the tree, or itself.
    above: usize,
    /// Whether it has the other role than that.
    differs: bool,
    /// Faces of the tree, where it is the root.
    count: usize,
}

/// Returns the root of the tree of face `k`, and whether the face has the other role than the root.
fn root_of(turns: &[Turn], mut k: usize) -> (usize, bool) {
    let mut differs = false;
    while turns[k].above != k {
        differs ^= turns[k].differs;
        k = turns[k].above;
    }
    (k, differs)
}

/// Drops contacts until no face is both carrier and guest, and what lies wholly on its carrier has no other; those in whole come first. A
/// guest that carried another would hand on facets that are not its own.
///
/// Either of two faces may carry: of a chain, where each touches the next, every other one does. What lies wholly on a guest becomes its
/// carrier, in part.
fn with_one_role_each(mut all: Vec<Contact>) -> Vec<Contact> {
    all.sort_unstable_by_key(|c| (c.extent, c.carrier, c.guest));
    let mut keys: Vec<FaceKey> = all.iter().flat_map(|c| [c.carrier, c.guest]).collect();
    keys.sort_unstable();
    keys.dedup();
    let index: FxHashMap<FaceKey, usize> = keys.iter().enumerate().map(|(k, &key)| (key, k)).collect();
    let ends = |c: &Contact| [index[&c.carrier], index[&c.guest]];
    let mut turns: Vec<Turn> = (0..keys.len()).map(|k| Turn { above: k, differs: false, count: 1 }).collect();
    all.retain(|c| {
        let [(a, a_differs), (b, b_differs)] = ends(c).map(|k| root_of(&turns, k));
        if a != b {
            // The smaller below the larger: no way to a root is long.
            let (low, high) = if turns[a].count < turns[b].count { (a, b) } else { (b, a) };
            let count = turns[low].count + turns[high].count;
            turns[low] = Turn { above: high, differs: a_differs == b_differs, ..turns[low] };
            turns[high].count = count;
        }
        a != b || a_differs != b_differs
    });
    let roles: Vec<(usize, bool)> = (0..keys.len()).map(|k| root_of(&turns, k)).collect();
    // What speaks for the root of each tree as a carrier, less what speaks against: contacts in whole that stay so; then faces that touch
    // several, because a carrier's facets are made once; then the order of the faces, so that nothing depends on chance.
    let mut degree = vec![0i64; keys.len()];
    all.iter().flat_map(ends).for_each(|k| degree[k] += 1);
    let mut votes = vec![[0i64; 3]; keys.len()];
    for c in &all {
        let [carrier, guest] = ends(c);
        let (root, carrier_differs) = roles[carrier];
        let sign = if carrier_differs { -1 } else { 1 };
        votes[root][0] += if c.extent == Extent::Whole { sign } else { 0 };
        votes[root][1] += sign * (degree[carrier] - degree[guest]);
        votes[root][2] += sign;
    }
    let carries = |k: usize| (votes[roles[k].0] >= [0; 3]) != roles[k].1;
    let turned = |c: Contact| Contact { carrier: c.guest, guest: c.carrier, extent: Extent::Part };
    let mut out: Vec<Contact> = all.into_iter().map(|c| if carries(ends(&c)[0]) { c } else { turned(c) }).collect();
    out.sort_unstable_by_key(|c| (c.extent, c.carrier, c.guest));
    let mut whole: FxHashSet<FaceKey> = FxHashSet::default();
    out.retain(|c| if c.extent == Extent::Whole { whole.insert(c.guest) } else { !whole.contains(&c.guest) });
    out
}

/// Returns the boxes of the curved faces of all instances that may share facets, meshed and not repaired ones: in the model's coordinates,
/// grown by half of `glue`, mm, and in the order of instances and faces.
fn curved_face_boxes(model: &Model, parts: &[Option<PartMesh>], glue: f64) -> Vec<BoxedFace> {
    let mut out = Vec::new();
    for (i, instance) in model.instances.iter().enumerate() {
        let Some(mesh) = &parts[instance.part.0 as usize] else { continue };
        let shells = model.part(instance.part).shells.iter().enumerate();
        let faces = shells.flat_map(|(s, shell)| shell.faces.iter().map(move |face| (s, face)));
        for (k, (shell, face)) in faces.enumerate() {
            let plain = mesh.faces[k].as_ref().is_some_and(|m| m.repaired.is_none());
            // Planes have one triangulation in space whatever their parameters; repaired faces have no facets that
            // could be shared.
            if matches!(face.analytic, Analytic::Plane { .. }) || !plain {
                continue;
            }
            let corners = face.surface.bounds().corners().map(|p| instance.placement.point(p));
            // By half of the glue distance each, two boxes meet when the faces may.
            let bounds = Aabb::from_points(corners).grown(0.5 * glue);
            out.push(BoxedFace { key: FaceKey { instance: i, face: k }, shell, bounds });
        }
    }
    out
}

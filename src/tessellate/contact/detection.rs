//! Which curved face of one solid lies on a face of another, wholly or in part.

use super::trimmed::{CARRIER_SHARE, FaceKey, TrimmedFace};
use crate::math::Aabb;
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
/// A face is either carrier or guest, and a guest has one carrier: the rest of a chain is left out. Planes are, for their facets coincide
/// as they are.
pub(super) fn contacts<'m>(
    model: &'m Model,
    places: &[PlacedPart<'m>],
    settings: &Settings,
    parts: &[Option<PartMesh>],
) -> (Vec<Contact>, FxHashMap<FaceKey, TrimmedFace<'m>>) {
    let glue = settings.glue_mm;
    let faces = curved_face_boxes(model, parts, glue);
    let mut pairs: Vec<[FaceKey; 2]> = Vec::new();
    // Sorted along x: from the first box that begins behind this one on, none meets it.
    for (i, a) in faces.iter().enumerate() {
        for b in faces[i + 1..].iter().take_while(|b| b.bounds.min.x <= a.bounds.max.x) {
            let other_solid = a.key.instance != b.key.instance || a.shell != b.shell;
            if other_solid && !a.bounds.intersection(b.bounds).is_empty() {
                pairs.push([a.key.min(b.key), a.key.max(b.key)]);
            }
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
        // The face with the lower key is asked first, so that the carrier does not depend on chance.
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
    // Tighter than asked, so that the guest's own proof, over other parameters, has a share left.
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

/// Drops contacts until no face is both guest and carrier, or the guest of two; those in whole come first, and of one in part guest and
/// carrier may change places. A guest that carried another would hand on facets that are not its own.
fn with_one_role_each(all: Vec<Contact>) -> Vec<Contact> {
    let mut carriers: FxHashSet<FaceKey> = FxHashSet::default();
    let mut guests: FxHashSet<FaceKey> = FxHashSet::default();
    let mut out = Vec::new();
    let (whole, part): (Vec<Contact>, Vec<Contact>) = all.into_iter().partition(|c| c.extent == Extent::Whole);
    let mut contacts_in_part: FxHashMap<FaceKey, usize> = FxHashMap::default();
    part.iter().flat_map(|c| [c.carrier, c.guest]).for_each(|key| *contacts_in_part.entry(key).or_default() += 1);
    for c in whole.into_iter().chain(part) {
        let turned = Contact { carrier: c.guest, guest: c.carrier, ..c };
        // Of two that share a part either may carry: the one that touches more others, which each can have one carrier only.
        let prefers_turned = contacts_in_part.get(&c.guest) > contacts_in_part.get(&c.carrier);
        let ways = match c.extent {
            Extent::Whole => vec![c],
            Extent::Part if prefers_turned => vec![turned, c],
            Extent::Part => vec![c, turned],
        };
        let is_free = |c: &Contact| {
            !guests.contains(&c.carrier) && !carriers.contains(&c.guest) && !guests.contains(&c.guest)
        };
        if let Some(c) = ways.into_iter().find(is_free) {
            guests.insert(c.guest);
            carriers.insert(c.carrier);
            out.push(c);
        }
    }
    out
}

/// Returns the boxes of the curved faces of all instances that may share facets, meshed and not repaired ones: in the model's coordinates,
/// grown by half of `glue`, mm, and sorted by their lower x.
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
    out.sort_by(|a, b| a.bounds.min.x.total_cmp(&b.bounds.min.x));
    out
}

//! Which rule of the scene gives each face its surface, and which its medium.

use super::select::{FaceSearch, select_faces};
use crate::model::{Model, PlacedFace};
use crate::simulate::Error;
use crate::simulate::scene::{Key, Scene};
use std::collections::HashMap;

/// The rules that decide a placed face, as indices in `scene.materials`; `None` where no rule does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FaceRules {
    /// The last rule that gives its surface or scatter.
    pub(super) surface: Option<usize>,
    /// The last rule that gives its medium.
    pub(super) medium: Option<usize>,
}

/// Finds for each placed face the rules that give its surface and its medium; later rules override earlier ones. A medium given to a
/// part of a solid's faces goes to all of them.
///
/// # Errors
/// When the selector of a rule means no face.
pub(super) fn find_rules(scene: &Scene, model: &Model) -> Result<Vec<FaceRules>, Error> {
    let mut rules = vec![FaceRules::default(); model.placed_face_count()];
    let mut search = FaceSearch::new(model);
    for (i, rule) in scene.materials.iter().enumerate() {
        let base = [Key::Name("material"), Key::Index(i), Key::Name("on")];
        let base = if rule.on.is_some() { &base[..] } else { &base[..2] };
        for face in select_faces(scene, base, &rule.faces(), &mut search)? {
            // A later rule overrides an earlier one, separately for surfaces and media.
            if rule.surface.is_some() || rule.scatter.is_some() {
                rules[face].surface = Some(i);
            }
            if rule.medium.is_some() {
                rules[face].medium = Some(i);
            }
        }
    }
    spread_media_over_solids(scene, model, &mut rules);
    Ok(rules)
}

/// Gives the faces without a medium the rule of the other faces of their solid; not where those name two media, and not to faces of no
/// shell.
fn spread_media_over_solids(scene: &Scene, model: &Model, rules: &mut [FaceRules]) {
    let medium = |rule: Option<usize>| rule.and_then(|r| scene.materials[r].medium.as_deref());
    let mut solids: HashMap<(usize, usize), Option<usize>> = HashMap::new();
    let key = |f: &PlacedFace<'_>| Some((f.instance, f.shell?));
    for (f, FaceRules { medium: rule, .. }) in model.placed_faces().zip(rules.iter()) {
        let (Some(key), Some(rule)) = (key(&f), *rule) else { continue };
        let one = solids.entry(key).or_insert(Some(rule));
        // Two media on one solid: which of its other faces has which is not for us to guess.
        if medium(*one) != medium(Some(rule)) {
            *one = None;
        }
    }
    for (f, FaceRules { medium: rule, .. }) in model.placed_faces().zip(rules.iter_mut()) {
        if let (Some(key), None) = (key(&f), *rule) {
            *rule = solids.get(&key).copied().flatten();
        }
    }
}

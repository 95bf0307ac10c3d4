//! Which effects a scene calls for, why, and which kernel that needs.

use super::bind::BoundScene;
use super::body::{AMBIENT, Body};
use super::surfaces::{Coated, FaceOptics, Surface};
use super::wavelength_text::wavelength_text;
use crate::optics::{Coating, Effect, Effects};
use crate::text::count_of;
use serde::Serialize;

/// An effect, and why a run simulates it or leaves it out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectReason {
    /// The effect.
    pub effect: Effect,
    /// The reason, in words.
    pub because: String,
}

/// The effects that a scene calls for, each with its reason, and the kernel that has them.
#[derive(Clone, Debug, PartialEq)]
pub struct RequiredEffects {
    /// The effects that it calls for.
    pub effects: Effects,
    /// Those effects, each with the reason.
    pub simulated: Vec<EffectReason>,
    /// All other effects, each with the reason.
    pub not_simulated: Vec<EffectReason>,
    pub(crate) kernel: KernelKind,
}

/// The kernels, by what a ray carries; each can do all that the ones before it can.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum KernelKind {
    /// Power alone, of which faces take a constant share.
    Mirror,
    /// Power alone, at faces of any kind.
    Opaque,
    /// Power and the one body that the ray is in.
    Clear,
    /// Power and a stack of bodies.
    Nested,
    /// Power, a stack of bodies and a wavelength.
    Coloured,
    /// All of these and a state of polarisation.
    Full,
}

impl KernelKind {
    /// Returns the smallest kernel that can do these effects where bodies neither touch nor nest; `Nested` is never the answer.
    pub(crate) fn for_effects(effects: Effects) -> Self {
        let media = [Effect::Refraction, Effect::Fresnel, Effect::BulkAbsorption, Effect::BulkScatter];
        let faces = [Effect::SurfaceScatter, Effect::Coating];
        // Every kernel can do what the ones below can: the first that is asked for decides.
        if effects.contains(Effect::Polarisation) {
            Self::Full
        } else if effects.contains(Effect::Dispersion) {
            Self::Coloured
        } else if media.iter().any(|e| effects.contains(*e)) {
            Self::Clear
        } else if faces.iter().any(|e| effects.contains(*e)) {
            Self::Opaque
        } else {
            Self::Mirror
        }
    }

    /// Returns its name in results and messages, in lower case.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mirror => "mirror",
            Self::Opaque => "opaque",
            Self::Clear => "clear",
            Self::Nested => "nested",
            Self::Coloured => "coloured",
            Self::Full => "full",
        }
    }
}

impl Effects {
    /// Returns the effects that a bound scene calls for, by its faces, media, sources and receivers.
    pub fn required_by(scene: &BoundScene) -> Self {
        RequiredEffects::new(scene).effects
    }
}

impl RequiredEffects {
    /// Finds which effects a bound scene calls for, each with the reason, and the smallest kernel that has them; runs nothing.
    pub fn new(scene: &BoundScene) -> Self {
        required(scene)
    }
}

/// Finds the effects that the scene needs, the reason for or against each, and the smallest kernel that has them all.
fn required(bound: &BoundScene) -> RequiredEffects {
    let used = |wanted: &dyn Fn(&Surface) -> bool| {
        bound.faces.iter().filter(|f| wanted(&bound.surfaces[f.surface as usize])).count()
    };
    let coated = |wanted: &dyn Fn(&Coated) -> bool| used(&|s| matches!(s, Surface::Coated(c) if wanted(c)));
    let mirrors = used(&|s| matches!(s, Surface::Mirror(_)));
    let lets_in = |f: &&FaceOptics| f.body != AMBIENT && !bound.surfaces[f.surface as usize].is_opaque();
    let interfaces = bound.faces.iter().filter(lets_in).count();
    // A bare face counts where it bounds a medium: without one it is not there for light.
    let is_bare = |f: &&FaceOptics| f.body != AMBIENT && bound.surfaces[f.surface as usize] == Surface::Interface;
    let bare = bound.faces.iter().filter(is_bare).count() + coated(&|c| c.coating == Coating::Bare);
    let metals = coated(&|c| matches!(c.coating, Coating::Metal { .. }));
    let in_medium =
        |wanted: &dyn Fn(&Body) -> bool| bound.bodies.iter().find(|b| wanted(b)).map(|b| b.medium.as_str());
    let medium = |name: Option<&str>, does: &str, none: &str| match name {
        Some(name) => (true, format!("the medium '{name}' {does}")),
        None => (false, none.to_string()),
    };
    let mut required = RequiredEffects {
        effects: Effects::NONE,
        simulated: Vec::new(),
        not_simulated: Vec::new(),
        kernel: KernelKind::Mirror,
    };
    for effect in Effect::ALL {
        let (wanted, because) = match effect {
            Effect::Reflection => {
                let n = mirrors + coated(&|c| !c.coating.is_reflectionless());
                (n > 0, counted_or(n, "reflecting face", "no face is a mirror"))
            }
            Effect::Refraction => {
                (interfaces > 0, counted_or(interfaces, "interface face", "no face lets light into a medium"))
            }
            Effect::Fresnel => {
                let n = bare + metals;
                (n > 0, counted_or(n, "bare or metal face", "no face is a bare interface or a metal"))
            }
            Effect::BulkAbsorption => medium(in_medium(&Body::absorbs), "absorbs", "no medium absorbs"),
            Effect::BulkScatter => medium(in_medium(&|b| b.scatter.is_some()), "scatters", "no medium scatters"),
            Effect::Polarisation if bound.scene.run.polarisation => (true, "the scene asks for it".into()),
            Effect::Polarisation => (false, "the scene does not ask for it".into()),
            Effect::Dispersion => needs_wavelength(bound, in_medium(&Body::is_dispersive)),
            Effect::SurfaceScatter => {
                let n = coated(&|c| c.scatter.is_some());
                (n > 0, counted_or(n, "rough or diffuse face", "no face scatters"))
            }
            Effect::Coating => {
                let n = coated(&|c| match c.coating {
                    Coating::Bare | Coating::Metal { .. } => false,
                    // A rough mirror or a diffuse wall.
                    Coating::Ideal { transmittance, .. } => transmittance > 0.0 || c.scatter.is_none(),
                    Coating::Table(_) => true,
                });
                (n > 0, counted_or(n, "coated face", "no face is coated"))
            }
        };
        let list = if wanted { &mut required.simulated } else { &mut required.not_simulated };
        list.push(EffectReason { effect, because });
        if wanted {
            required.effects.insert(effect);
        }
    }
    let nested = bound.nested || bound.emitters.iter().any(|e| e.inside.len() > 1);
    // Without media only the faces decide; nested bodies need a stack, whatever the effects.
    let media = match (bound.has_media(), nested) {
        (false, _) if coated(&|_| true) == 0 => KernelKind::Mirror,
        (false, _) => KernelKind::Opaque,
        (true, false) => KernelKind::Clear,
        (true, true) => KernelKind::Nested,
    };
    required.kernel = KernelKind::for_effects(required.effects).max(media);
    required
}

/// Returns whether rays must carry a wavelength, and the reason in words. Never where all light has one; else where a receiver asks for the
/// spectrum, or where a coating or `medium` depends on it, the name of one whose index or absorption does.
fn needs_wavelength(bound: &BoundScene, medium: Option<&str>) -> (bool, String) {
    if !bound.light.coloured {
        return (false, format!("all light has {}", wavelength_text(bound.light.wavelength)));
    }
    if let Some(r) = bound.receivers.iter().find(|r| r.channels.count() > 0) {
        return (true, format!("the receiver '{}' asks for the spectrum", r.name));
    }
    if let Some(name) = medium {
        return (true, format!("the index or absorption of '{name}' depends on wavelength"));
    }
    let coloured = |s: &Surface| matches!(s, Surface::Coated(c) if c.coating.is_dispersive());
    if bound.faces.iter().any(|f| coloured(&bound.surfaces[f.surface as usize])) {
        (true, "a coating depends on wavelength".into())
    } else {
        (false, "no index, absorption or coating depends on wavelength".into())
    }
}

/// Returns the number with its noun, for 0 the words `none`.
fn counted_or(n: usize, noun: &str, none: &str) -> String {
    if n == 0 { none.into() } else { count_of(n as u64, noun) }
}

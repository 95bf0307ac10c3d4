//! Which effects a scene calls for, why, and which kernel that needs.

use super::bind::{BoundScene, Surface};
use crate::optics::{Effect, Effects};
use serde::Serialize;

/// An effect with the reason why it is, or is not, simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Because {
    /// The effect.
    pub effect: Effect,
    /// Why.
    pub because: String,
}

/// What a scene calls for.
#[derive(Clone, Debug, PartialEq)]
pub struct Required {
    /// The effects.
    pub effects: Effects,
    /// Those effects, each with the reason.
    pub simulated: Vec<Because>,
    /// All other effects, each with the reason.
    pub not_simulated: Vec<Because>,
    pub(crate) kernel: KernelKind,
}

/// The kernels, by what a ray carries; each can do all that the ones before it can.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum KernelKind {
    /// Power alone.
    Opaque,
    /// And the body it is in.
    Clear,
    /// And a stack of bodies.
    Full,
}

impl KernelKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Opaque => "opaque",
            Self::Clear => "clear",
            Self::Full => "full",
        }
    }
}

impl Effects {
    /// The effects that a scene calls for, from its materials on faces in use, its sources and its receivers.
    pub fn required_by(scene: &BoundScene) -> Self {
        required(scene).effects
    }
}

pub(crate) fn required(bound: &BoundScene) -> Required {
    let used = |wanted: fn(&Surface) -> bool| {
        bound.faces.iter().filter(|f| wanted(&bound.surfaces[f.surface as usize])).count()
    };
    let mirrors = used(|s| matches!(s, Surface::Mirror(_)));
    let interfaces = if bound.has_media() { used(|s| matches!(s, Surface::Interface)) } else { 0 };
    let absorbing: Vec<&str> =
        bound.bodies.iter().filter(|b| b.absorption > 0.0).map(|b| b.medium.as_str()).collect();
    let mut required = Required {
        effects: Effects::NONE,
        simulated: Vec::new(),
        not_simulated: Vec::new(),
        kernel: KernelKind::Opaque,
    };
    for effect in Effect::ALL {
        let (wanted, because) = match effect {
            Effect::Reflection => (mirrors > 0, plural(mirrors, "mirror face", "no face is a mirror")),
            Effect::Refraction | Effect::Fresnel => {
                (interfaces > 0, plural(interfaces, "interface face", "no face lets light into a medium"))
            }
            Effect::BulkAbsorption => match absorbing.first() {
                Some(name) => (true, format!("the medium '{name}' absorbs")),
                None => (false, "no medium absorbs".into()),
            },
            Effect::Polarisation => (false, "the scene does not ask for it".into()),
            Effect::Dispersion => (false, "no index depends on wavelength".into()),
            Effect::SurfaceScatter => (false, "no face scatters".into()),
            Effect::Coating => (false, "no face is coated".into()),
            Effect::BulkScatter => (false, "no medium scatters".into()),
        };
        let list = if wanted { &mut required.simulated } else { &mut required.not_simulated };
        list.push(Because { effect, because });
        if wanted {
            required.effects.insert(effect);
        }
    }
    let media = bound.has_media() || bound.bodies[0].absorption > 0.0;
    required.kernel = match (media, bound.nested || bound.emitters.iter().any(|e| e.inside.len() > 1)) {
        (false, _) => KernelKind::Opaque,
        (true, false) => KernelKind::Clear,
        (true, true) => KernelKind::Full,
    };
    required
}

fn plural(n: usize, noun: &str, none: &str) -> String {
    match n {
        0 => none.into(),
        1 => format!("1 {noun}"),
        n => format!("{n} {noun}s"),
    }
}

//! The things light can do, and sets of them: what a scene needs and a kernel offers.

use std::fmt;
use std::ops::{BitOr, BitOrAssign, Sub};

/// One thing light can do, named as reports and scene files name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Effect {
    /// Mirror-like reflection by a stated share.
    Reflection,
    /// Snell's law, with total internal reflection.
    Refraction,
    /// The share reflected at a dielectric or metal by Fresnel's equations.
    Fresnel,
    /// Stokes vectors carried along every ray.
    Polarisation,
    /// Absorption along the way inside a medium (Beer–Lambert).
    BulkAbsorption,
    /// Indices, reflectances or absorptions that depend on wavelength.
    Dispersion,
    /// Reflection or transmission off the specular direction.
    SurfaceScatter,
    /// Reflectance and transmittance from a table over angle and wavelength.
    Coating,
    /// Scattering inside a medium.
    BulkScatter,
}

impl Effect {
    /// Every effect, in the order of reports.
    pub const ALL: [Self; 9] = [
        Self::Reflection,
        Self::Refraction,
        Self::Fresnel,
        Self::Polarisation,
        Self::BulkAbsorption,
        Self::Dispersion,
        Self::SurfaceScatter,
        Self::Coating,
        Self::BulkScatter,
    ];

    /// The name in reports and scene files, lower case with underscores.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reflection => "reflection",
            Self::Refraction => "refraction",
            Self::Fresnel => "fresnel",
            Self::Polarisation => "polarisation",
            Self::BulkAbsorption => "bulk_absorption",
            Self::Dispersion => "dispersion",
            Self::SurfaceScatter => "surface_scatter",
            Self::Coating => "coating",
            Self::BulkScatter => "bulk_scatter",
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of effects.
///
/// ```
/// use lampyris::optics::{Effect, Effects};
/// let lens = Effects::from([Effect::Refraction, Effect::Fresnel]);
/// assert!(lens.contains(Effect::Fresnel) && !lens.contains(Effect::Dispersion));
/// assert_eq!(lens.to_string(), "refraction, fresnel");
/// assert_eq!((Effects::ALL - lens).len(), 7);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Effects(u16);

impl Effects {
    /// No effect: light goes straight and every surface swallows it.
    pub const NONE: Self = Self(0);
    /// Every effect there is.
    pub const ALL: Self = Self((1 << Effect::ALL.len()) - 1);

    /// The set with one more effect.
    pub const fn with_effect(self, effect: Effect) -> Self {
        Self(self.0 | 1 << effect as u16)
    }

    /// Adds an effect.
    pub fn insert(&mut self, effect: Effect) {
        *self = self.with_effect(effect);
    }

    /// Whether the effect is in the set.
    pub const fn contains(self, effect: Effect) -> bool {
        self.0 & 1 << effect as u16 != 0
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Number of effects.
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The effects in the order of [`Effect::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |&e| self.contains(e))
    }
}

impl<const N: usize> From<[Effect; N]> for Effects {
    fn from(effects: [Effect; N]) -> Self {
        effects.into_iter().collect()
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        effects.into_iter().fold(Self::NONE, Self::with_effect)
    }
}

impl BitOr for Effects {
    type Output = Self;
    fn bitor(self, o: Self) -> Self {
        Self(self.0 | o.0)
    }
}

impl BitOrAssign for Effects {
    fn bitor_assign(&mut self, o: Self) {
        self.0 |= o.0;
    }
}

impl Sub for Effects {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self(self.0 & !o.0)
    }
}

impl fmt::Display for Effects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, effect) in self.iter().enumerate() {
            write!(f, "{}{effect}", if i > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_documents() {
        for (i, effect) in Effect::ALL.into_iter().enumerate() {
            assert_eq!(effect as usize, i, "the order is the order of the bits");
            assert_eq!(serde_json::to_value(effect).unwrap(), effect.name());
        }
        assert_eq!(Effects::ALL.len(), Effect::ALL.len());
    }

    #[test]
    fn sets_add_and_subtract() {
        let a = Effects::from([Effect::Reflection, Effect::Coating]);
        let b = Effects::NONE.with_effect(Effect::Coating);
        assert_eq!(a - b, Effects::from([Effect::Reflection]));
        assert_eq!(b | Effects::from([Effect::Reflection]), a);
        assert_eq!(a - b - Effects::from([Effect::Reflection]), Effects::default());
    }
}

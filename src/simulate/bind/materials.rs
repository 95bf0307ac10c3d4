//! Surfaces from the rules of the scene.

use super::face_rules::FaceRules;
use crate::model::Model;
use crate::optics::{Coating, Scatter};
use crate::simulate::body::AMBIENT;
use crate::simulate::scene::{Key, Material, Scene, SurfaceOptics};
use crate::simulate::surfaces::{Coated, Surface};
use crate::simulate::{Error, ErrorKind};

/// Index in a [`SurfaceTable`] of the bare boundary of a medium.
pub(super) const BARE_INTERFACE: u16 = 1;

/// The distinct surfaces of a scene, which faces name by index. That of a rule is made once, when the first face asks for it: a lobe is
/// tabulated in hundreds of rings.
pub(super) struct SurfaceTable<'s> {
    scene: &'s Scene,
    surfaces: Vec<Surface>,
    /// The index of each rule's surface, and last of `default_surface`; `None` where no face needed it: the values of a rule that decides
    /// no face need not go together.
    of_rules: Vec<Option<u16>>,
}

impl<'s> SurfaceTable<'s> {
    pub(super) fn new(scene: &'s Scene) -> Self {
        // These two come first, in places that nothing else takes: most scenes use them.
        let surfaces = vec![Surface::Absorber, Surface::Interface];
        Self { scene, surfaces, of_rules: vec![None; scene.materials.len() + 1] }
    }

    /// Returns the index of the surface that a rule gives, by its index in `scene.materials`; of the scene's `default_surface` without one.
    ///
    /// # Errors
    /// When the rule gives a surface of values that do not go together, or there are more surfaces than can be distinguished.
    pub(super) fn index(&mut self, rule: Option<usize>) -> Result<u16, Error> {
        let scene = self.scene;
        let place = rule.unwrap_or(scene.materials.len());
        if let Some(index) = self.of_rules[place] {
            return Ok(index);
        }
        let made = match rule {
            Some(rule) => surface(scene, &scene.materials[rule])?,
            None => surface(scene, &Material { surface: Some(scene.default_surface), ..Material::default() })?,
        };
        let index = surface_index(&mut self.surfaces, made).ok_or_else(|| {
            let at = [Key::Name("material")];
            let error = scene.error(ErrorKind::Value, &at, "more than 65,536 different surfaces");
            error.help("give faces that are to behave alike the same values")
        })?;
        self.of_rules[place] = Some(index);
        Ok(index)
    }

    /// Whether no light passes the surface with this index.
    pub(super) fn is_opaque(&self, index: u16) -> bool {
        self.surfaces[usize::from(index)].is_opaque()
    }

    /// Returns the surfaces, by index.
    pub(super) fn into_surfaces(self) -> Vec<Surface> {
        self.surfaces
    }
}

/// Returns the surface that a rule gives, an interface where it names none. A mirror or diffuse face that reflects nothing is an absorber.
///
/// # Errors
/// When the rule's optical values do not go together or are out of range.
fn surface(scene: &Scene, rule: &Material) -> Result<Surface, Error> {
    let (coating, scatter) = rule.optics().map_err(|(_, e)| scene.error(ErrorKind::Value, &[], e))?;
    let kind = rule.surface.unwrap_or(SurfaceOptics::Interface);
    // What scatters nothing and reflects nothing is named neither rough nor a mirror.
    let scatter = scatter.filter(Scatter::scatters);
    Ok(match (kind, coating, scatter) {
        (SurfaceOptics::Absorber, ..) => Surface::Absorber,
        (SurfaceOptics::Mirror | SurfaceOptics::Diffuse, Coating::Ideal { reflectance: 0.0, .. }, _) => {
            Surface::Absorber
        }
        (_, Coating::Bare, None) => Surface::Interface,
        (SurfaceOptics::Mirror, Coating::Ideal { reflectance, .. }, None) => Surface::Mirror(reflectance),
        (_, coating, scatter) => {
            let opaque = coating.is_opaque();
            Surface::Coated(Box::new(Coated { coating, scatter, opaque }))
        }
    })
}

/// Returns the index of a surface in the table, appending it where it is not there yet; `None` where there are as many as an index can
/// name.
fn surface_index(surfaces: &mut Vec<Surface>, surface: Surface) -> Option<u16> {
    // Few surfaces are used by many faces: the table stays so short that a linear look is fastest.
    let found = surfaces.iter().position(|s| *s == surface).unwrap_or_else(|| {
        surfaces.push(surface);
        surfaces.len() - 1
    });
    u16::try_from(found).ok()
}

/// Checks that every face which its rule makes an interface, by name or by scatter alone, has a medium behind it (`bodies`, by placed
/// face).
///
/// # Errors
/// For the first face that has none.
pub(super) fn check_interfaces(
    scene: &Scene,
    model: &Model,
    rules: &[FaceRules],
    bodies: &[u32],
) -> Result<(), Error> {
    for ((f, FaceRules { surface: rule, .. }), &body) in model.placed_faces().zip(rules).zip(bodies) {
        let Some(i) = rule.filter(|_| body == AMBIENT) else { continue };
        let part = &model.part(f.part).name;
        let error = |key, message, help: &str| {
            let at = [Key::Name("material"), Key::Index(i), Key::Name(key)];
            Err(scene.error(ErrorKind::Value, &at, message).help(help))
        };
        match scene.materials[i].surface {
            Some(SurfaceOptics::Interface) => {
                let message = format!("an interface of '{part}', which has no medium");
                return error("surface", message, "add `medium` to this rule, or to another one for the part");
            }
            // Scatter without a surface would let all light through, also where an earlier rule gave a mirror.
            None => {
                let message = format!("without `surface` an interface scatters, but '{part}' has no medium");
                let help = "add the `surface` that scatters, such as \"mirror\", to this rule, or a `medium` to a rule for the part";
                return error("scatter", message, help);
            }
            Some(_) => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_beyond_the_last_index_has_none() {
        let mut surfaces = vec![Surface::Interface; usize::from(u16::MAX)];
        assert_eq!(surface_index(&mut surfaces, Surface::Mirror(0.5)), Some(u16::MAX));
        assert_eq!(surface_index(&mut surfaces, Surface::Mirror(0.25)), None);
        assert_eq!(surface_index(&mut surfaces, Surface::Mirror(0.5)), Some(u16::MAX));
    }
}

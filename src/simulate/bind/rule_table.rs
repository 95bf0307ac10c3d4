//! Which faces each rule of a scene decides, and which none does.

use super::bound_scene::RuleFaces;
use super::face_rules::FaceRules;
use crate::simulate::scene::{Scene, SurfaceOptics};

/// Returns one entry for each rule, in the order of the scene and with faces or without, and a last one for the faces that no rule names,
/// if there are any. A face whose surface and medium come from two rules stands in both entries.
pub(super) fn rule_table(scene: &Scene, face_rules: &[FaceRules]) -> Vec<RuleFaces> {
    let mut table: Vec<RuleFaces> = (scene.materials.iter().enumerate())
        .map(|(k, material)| {
            let medium = material.medium.as_ref().map(|m| format!("medium {m}"));
            let surface = material.surface.map(|s| format!("surface {}", surface_word(s)));
            let scatter = material.scatter.as_ref().map(|_| "scatter".to_owned());
            let gives: Vec<String> = [medium, surface, scatter].into_iter().flatten().collect();
            RuleFaces {
                rule: Some(k + 1),
                selects: material.faces().to_string(),
                gives: gives.join(", "),
                faces: Vec::new(),
            }
        })
        .collect();
    let mut unnamed = Vec::new();
    for (face, FaceRules { surface, medium }) in face_rules.iter().enumerate() {
        let rules = [*surface, medium.filter(|m| Some(*m) != *surface)];
        // A rule that gives both surface and medium lists its face once.
        for rule in rules.into_iter().flatten() {
            table[rule].faces.push(face as u32);
        }
        if rules == [None; 2] {
            unnamed.push(face as u32);
        }
    }
    if !unnamed.is_empty() {
        let gives = match scene.default_surface {
            SurfaceOptics::Absorber => "surface absorber: light that meets them ends there".to_owned(),
            other => format!("surface {}, the scene's default_surface", surface_word(other)),
        };
        let selects = "no rule names them".to_owned();
        table.push(RuleFaces { rule: None, selects, gives, faces: unnamed });
    }
    table
}

/// Returns the word that the scene file has for a surface.
fn surface_word(kind: SurfaceOptics) -> &'static str {
    match kind {
        SurfaceOptics::Absorber => "absorber",
        SurfaceOptics::Mirror => "mirror",
        SurfaceOptics::Interface => "interface",
        SurfaceOptics::Diffuse => "diffuse",
        SurfaceOptics::Coating => "coating",
        SurfaceOptics::Metal => "metal",
    }
}

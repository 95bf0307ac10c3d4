//! How a model is shown: parts as groups, in the colours of the file or of a palette, media clear.

use crate::formats::{Facets, Group};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::simulate::Scene;

/// Calm colours for parts without one, as displayed.
const PALETTE: [[f64; 3]; 8] = [
    [0.36, 0.42, 0.50],
    [0.72, 0.76, 0.80],
    [0.87, 0.63, 0.32],
    [0.38, 0.60, 0.80],
    [0.55, 0.70, 0.46],
    [0.74, 0.48, 0.48],
    [0.60, 0.53, 0.75],
    [0.80, 0.72, 0.48],
];

/// The mesh with a group for every instance.
pub(crate) fn grouped_facets<'a>(model: &Model, mesh: &'a FacetMesh, scene: Option<&Scene>) -> Facets<'a> {
    let colours: Vec<_> = {
        // The first colour that a face of the instance shows stands for all of it.
        let mut first = vec![None; model.instances.len()];
        for face in model.placed_faces() {
            let slot = &mut first[face.instance];
            *slot = slot.or(face.colour(model));
        }
        first
    };
    let groups = (model.instances.iter().enumerate())
        .map(|(k, instance)| {
            let part = &model.part(instance.part).name;
            let colour = colours[k].map_or(PALETTE[k % PALETTE.len()], |c| c.0);
            let name = model.label(k);
            match scene.and_then(|s| medium_index(s, part, &instance.name)) {
                Some(index) => {
                    Group { opacity: 0.2, index_ratio: 1.0 / index, ..Group::solid(&name, [0.62, 0.80, 0.95]) }
                }
                None => Group::solid(&name, colour),
            }
        })
        .collect::<Vec<_>>();
    let group_of_face = model.placed_faces().map(|f| f.instance as u32).collect();
    let mut facets = Facets { group_of_face, ..Facets::plain(mesh, &model.name) };
    if !groups.is_empty() {
        facets.groups = groups;
    }
    facets
}

/// Index of the medium that a rule of the scene gives a part or instance by its very name; 1.5 for one without a constant index.
fn medium_index(scene: &Scene, part: &str, instance: &str) -> Option<f64> {
    let named = |list: &Option<crate::simulate::scene::OneOrMany<String>>, name: &str| {
        list.as_ref().is_some_and(|l| l.as_slice().iter().any(|n| n == name))
    };
    let rule = (scene.materials.iter())
        // The last rule that names it, as in the simulation.
        .rfind(|m| m.medium.is_some() && (named(&m.part, part) || named(&m.instance, instance)))?;
    let name = rule.medium.as_deref()?;
    Some(scene.media.iter().find(|m| m.name == name).and_then(|m| m.index).unwrap_or(1.5))
}

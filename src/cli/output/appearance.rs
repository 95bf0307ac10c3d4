//! How a model is shown: parts as groups, in the colours of the file or of a palette, media clear.

use crate::formats::{Facets, Group};
use crate::mesh::FacetMesh;
use crate::model::{Colour, Model};
use crate::simulate::BoundScene;
use std::collections::HashMap;

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

/// How media look: pale blue, with what lies behind them shining through.
const CLEAR: [f64; 3] = [0.62, 0.80, 0.95];
const CLEAR_OPACITY: f64 = 0.2;

/// What a group shows: of an instance, by its index, either the faces of one colour, as the file writes it, or those that let light into a
/// body.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Look {
    Coloured(usize, Option<String>),
    Clear(usize, u32),
}

/// Returns the mesh with a group for every instance and look; faces that let light into a medium of `bound`, whatever selected them, are
/// clear. Without a scene none is. Parts without a colour get one of the palette.
pub(crate) fn grouped_facets<'a>(model: &Model, mesh: &'a FacetMesh, bound: Option<&BoundScene>) -> Facets<'a> {
    let mut places: HashMap<Look, u32> = HashMap::new();
    let mut looks: Vec<(Look, Option<Colour>)> = Vec::new();
    let mut looks_of_instance = vec![0; model.instances.len()];
    let mut group_of_face = Vec::with_capacity(model.placed_face_count());
    for face in model.placed_faces() {
        let colour = face.colour(model);
        let look = match bound.and_then(|b| b.entered_body(face.id)) {
            Some(body) => Look::Clear(face.instance, body),
            None => Look::Coloured(face.instance, colour.map(|c| c.to_string())),
        };
        group_of_face.push(*places.entry(look.clone()).or_insert_with(|| {
            looks_of_instance[face.instance] += 1;
            looks.push((look, colour));
            looks.len() as u32 - 1
        }));
    }
    let labels = model.labels();
    // A part of several looks has several entries in a legend, which must differ.
    let name = |instance: usize, look: &str| match (looks_of_instance[instance], look) {
        (1, _) | (_, "") => labels[instance].clone(),
        _ => format!("{}, {look}", labels[instance]),
    };
    let groups: Vec<Group> = (looks.iter())
        .map(|(look, colour)| match look {
            Look::Coloured(instance, text) => {
                let shown = colour.map_or(PALETTE[instance % PALETTE.len()], |c| c.0);
                Group::solid(&name(*instance, text.as_deref().unwrap_or_default()), shown)
            }
            Look::Clear(instance, body) => {
                let medium = bound.and_then(|b| b.body_names(*body)).map_or("", |[_, medium]| medium);
                let index_ratio = bound.map_or(1.0, |b| b.relative_index(*body)).recip();
                Group { opacity: CLEAR_OPACITY, index_ratio, ..Group::solid(&name(*instance, medium), CLEAR) }
            }
        })
        .collect();
    let mut facets = Facets { group_of_face, ..Facets::plain(mesh, &model.name) };
    if !groups.is_empty() {
        facets.groups = groups;
    }
    facets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Scene;
    use crate::{step, tessellate};

    #[test]
    fn glass_is_clear_whichever_selector_named_it() {
        let scene = Scene::read("fixtures/headlamp/low_beam.toml".as_ref()).unwrap();
        let model =
            step::read("fixtures/headlamp/low_beam.stp".as_ref(), &step::Settings::default()).unwrap().model;
        let mesh = tessellate::tessellate(&model, &tessellate::Settings::default()).mesh;
        // The rule is `on = { solid = "lens" }`; another makes the lens's edge black.
        let bound = scene.bind(&model).unwrap();
        let facets = grouped_facets(&model, &mesh, Some(&bound));
        let clear = |name: &str| {
            let face = model.placed_faces().find(|f| f.name() == name).unwrap();
            let group = &facets.groups[facets.group_of_face[face.id.index()] as usize];
            assert!(group.opacity == 1.0 || (1.49 * group.index_ratio - 1.0).abs() < 1e-12, "{group:?}");
            group.opacity < 1.0
        };
        assert_eq!(["entry", "exit", "edge", "stop", "hot"].map(clear), [true, true, false, false, false]);
        assert!(grouped_facets(&model, &mesh, None).groups.iter().all(|g| g.opacity == 1.0));
    }
}

use super::nearest::bounds;
use super::{AMBIENT, Body, Chosen};
use crate::math::Aabb;
use crate::model::Model;
use crate::simulate::scene::{Key, Scene};
use crate::simulate::{Error, ErrorKind};

/// The bodies (one for each instance and medium), the body of each face, and whether bodies may touch or nest.
///
/// An instance with two media, given by face, makes two bodies. Bodies whose boxes are farther apart than the glue distance
/// can neither touch nor nest.
pub(super) fn find(scene: &Scene, model: &Model, chosen: &Chosen) -> Result<(Vec<Body>, Vec<u16>, bool), Error> {
    let medium = |name: &str| scene.media.iter().find(|m| m.name == name);
    let ambient = scene.ambient.as_deref().and_then(medium);
    let mut bodies = vec![Body {
        index: ambient.and_then(|m| m.index).unwrap_or(1.0),
        absorption: ambient.map_or(0.0, |m| m.absorption_per_mm),
        name: "surroundings".into(),
        medium: scene.ambient.clone().unwrap_or_else(|| "vacuum".into()),
    }];
    let mut keys: Vec<Option<(usize, &str)>> = vec![None];
    let mut boxes = vec![Aabb::EMPTY];
    let mut of_face = vec![AMBIENT; chosen.len()];
    for (f, &(_, rule)) in model.placed_faces().zip(chosen) {
        let Some(m) = rule.and_then(|r| scene.materials[r].medium.as_deref()).and_then(medium) else { continue };
        let key = Some((f.instance, m.name.as_str()));
        let body = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
            keys.push(key);
            boxes.push(Aabb::EMPTY);
            bodies.push(Body {
                index: m.index.unwrap_or(1.0),
                absorption: m.absorption_per_mm,
                name: model.instances[f.instance].name.clone(),
                medium: m.name.clone(),
            });
            keys.len() - 1
        });
        boxes[body] = boxes[body].union(bounds(&f));
        of_face[f.id.index()] = body as u16;
    }
    if bodies.len() > usize::from(u16::MAX) {
        let message = format!("{} bodies with media; at most 65534 are possible", bodies.len());
        return Err(scene.error(ErrorKind::Model, &[Key::Name("material")], message));
    }
    let mut order: Vec<Aabb> = boxes[1..].iter().map(|b| b.grown(scene.run.glue_mm)).collect();
    order.sort_by(|a, b| a.min.x.total_cmp(&b.min.x));
    let meets = |(i, a): (usize, &Aabb)| {
        order[i + 1..].iter().take_while(|b| b.min.x <= a.max.x).any(|b| !a.intersection(*b).is_empty())
    };
    let nested = order.iter().enumerate().any(meets);
    Ok((bodies, of_face, nested))
}

//! The frames of instances and models, in which sources and receivers may be given.

use super::select::{advice, matches_pattern};
use crate::math::Frame;
use crate::model::{Instance, Model};
use crate::simulate::scene::{Key, Scene};
use crate::simulate::{Error, ErrorKind};

/// Returns the placement of the instance that `name` fits, of the only instance of a part that it fits, or of the `[[model]]` entry called
/// so; the identity without a name. `of` is the place in the scene of the entry with the key `frame`, for messages.
///
/// # Errors
/// When nothing is called so, or several are.
pub(super) fn frame(scene: &Scene, model: &Model, of: [Key<'_>; 2], name: Option<&str>) -> Result<Frame, Error> {
    let Some(name) = name else { return Ok(Frame::IDENTITY) };
    let at = [of[0], of[1], Key::Name("frame")];
    let part_name = |i: &Instance| model.part(i.part).name.as_str();
    let instances = |fits: &dyn Fn(&Instance) -> bool| -> Vec<(Frame, &str)> {
        model.instances.iter().filter(|i| fits(i)).map(|i| (i.placement, i.path.as_str())).collect()
    };
    // An instance says which of several is meant, so that its name comes first.
    let mut named = instances(&|i| i.names().any(|own| matches_pattern(name, own)));
    if named.is_empty() {
        named = instances(&|i| matches_pattern(name, part_name(i)));
    }
    if named.is_empty() && !name.is_empty() {
        let entries = scene.models.iter().filter(|entry| entry.name == name);
        named = entries.map(|entry| (entry.placement.frame(), "")).collect();
    }
    match named[..] {
        [(placement, _)] => Ok(placement),
        [] => {
            let parts = model.instances.iter().flat_map(|i| [part_name(i), i.name.as_str()]);
            let entries = scene.models.iter().map(|entry| entry.name.as_str()).filter(|name| !name.is_empty());
            let message = format!("no instance, part or model is called '{name}'");
            Err(scene.error(ErrorKind::NoMatch, &at, message).help(advice(
                name,
                parts.chain(entries),
                "frame",
                scene,
                model,
            )))
        }
        _ => {
            let message = format!("'{name}' is placed {} times, each with a frame of its own", named.len());
            let help = match named.iter().find(|(_, path)| !path.is_empty()) {
                None => "name an instance that there is once".to_owned(),
                Some((_, path)) => {
                    format!("name one by its path, as '{path}'; `lampyris info FILE --faces` lists them")
                }
            };
            Err(scene.error(ErrorKind::NoMatch, &at, message).help(help))
        }
    }
}

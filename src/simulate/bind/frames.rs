//! The frames of parts, in which sources and receivers may be given.

use super::select::advice;
use crate::math::Frame;
use crate::model::Model;
use crate::simulate::scene::{Key, Scene};
use crate::simulate::{Error, ErrorKind};

/// Returns the placement of the instance called `name`, or of the only instance of a part of this name; the identity without a name. `of`
/// is the place in the scene of whoever has the key `frame`, for messages.
///
/// # Errors
/// When nothing is called so, or several instances are.
pub(super) fn frame(scene: &Scene, model: &Model, of: [Key<'_>; 2], name: Option<&str>) -> Result<Frame, Error> {
    let Some(name) = name else { return Ok(Frame::IDENTITY) };
    let at = [of[0], of[1], Key::Name("frame")];
    // An instance says which of several is meant, so that its name comes first.
    let mut named: Vec<_> = model.instances.iter().filter(|i| i.names().any(|own| own == name)).collect();
    if named.is_empty() {
        named = model.instances.iter().filter(|i| model.part(i.part).name == name).collect();
    }
    match named[..] {
        [instance] => Ok(instance.placement),
        [] => {
            let names = model.instances.iter().flat_map(|i| [model.part(i.part).name.as_str(), i.name.as_str()]);
            let error = scene.error(ErrorKind::NoMatch, &at, format!("no instance or part is called '{name}'"));
            Err(error.help(advice(name, names.collect())))
        }
        _ => {
            let message = format!("'{name}' is placed {} times, each with a frame of its own", named.len());
            let paths: Vec<&str> = named.iter().map(|i| i.path.as_str()).filter(|p| !p.is_empty()).collect();
            let help = match paths[..] {
                [] => "name an instance that there is once".to_owned(),
                [first, ..] => format!("name one by its path, as '{first}'; `lampyris info --faces` lists them"),
            };
            Err(scene.error(ErrorKind::NoMatch, &at, message).help(help))
        }
    }
}

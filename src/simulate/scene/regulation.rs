//! The key `[[regulation]]`: by which tables a far field of the run is judged.

use super::{FarFieldType, Key, PowerUnit, Receiver, ReceiverKind, Scene};
use crate::regulation::{Regulation, plain};
use crate::simulate::{Error, ErrorKind};
use crate::text::did_you_mean;
use serde::{Deserialize, Serialize};

/// A regulation whose verdict is printed with the run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct RegulationUse {
    /// The regulation and function, as `lampyris assess --list` names them: `UN R112 B passing`.
    pub id: String,
    /// Name of the far field over H and V; the only one there is unless said otherwise.
    pub receiver: Option<String>,
    /// Left-hand traffic: the tables mirrored.
    pub left_hand: bool,
    /// Measures the lamp as it was placed, without the regulation's aiming.
    pub as_placed: bool,
}

impl RegulationUse {
    /// Returns the far field that is judged, as an index into the scene's receivers; `None` where no receiver, or more than one, can be
    /// meant.
    pub fn receiver_index(&self, scene: &Scene) -> Option<usize> {
        let fits = |r: &Receiver| match &self.receiver {
            Some(name) => r.name == *name,
            None => r.kind == ReceiverKind::FarField && r.angles == FarFieldType::A,
        };
        let mut found = scene.receivers.iter().enumerate().filter(|(_, r)| fits(r)).map(|(k, _)| k);
        let first = found.next();
        // Only one receiver can be meant; of several the file must say which.
        if found.next().is_some() { None } else { first }
    }

    /// Refuses a regulation that is not known, that stands in the scene before, or that has no far field which could answer it.
    pub(super) fn check(&self, scene: &Scene, index: usize) -> Result<(), Error> {
        let fail = |key: &str, message: String, help: &str| {
            let at = [Key::Name("regulation"), Key::Index(index), Key::Name(key)];
            Err(scene.error(ErrorKind::Value, &at, message).help(help))
        };
        let regulation = match Regulation::find(&self.id) {
            Ok(regulation) => regulation,
            Err(error) => {
                let at = [Key::Name("regulation"), Key::Index(index), Key::Name("id")];
                return Err(scene.error(ErrorKind::Value, &at, error.to_string()));
            }
        };
        // However its name is written, and whether the only far field is named. Tables are read for names that may mean it alone.
        let is_same = |other: &Self| {
            (other.left_hand, other.as_placed) == (self.left_hand, self.as_placed)
                && other.receiver_index(scene) == self.receiver_index(scene)
                && plain(&regulation.id).starts_with(&plain(&other.id))
                && Regulation::find(&other.id).is_ok_and(|found| found.id == regulation.id)
        };
        if scene.regulations[..index].iter().any(is_same) {
            let message = format!("'{}' stands above already, about the same far field", self.id);
            return fail("id", message, "leave one of them out");
        }
        if scene.run.unit != PowerUnit::Lumen {
            let message = "a regulation asks for candela, but the run counts watts".into();
            return fail("id", message, "set `unit = \"lm\"` in [run]");
        }
        let Some(receiver) = self.receiver_index(scene) else {
            let message = match &self.receiver {
                Some(name) => format!("the scene has no receiver '{name}', or several"),
                None => "the scene has no far field over H and V (`angles = \"A\"`), or several".into(),
            };
            let names = scene.receivers.iter().map(|receiver| receiver.name.as_str());
            let advice = self.receiver.as_ref().and_then(|name| did_you_mean(name, names));
            let help =
                advice.unwrap_or_else(|| "name a receiver of `kind = \"far_field\"` with `angles = \"A\"`".into());
            return fail("receiver", message, &help);
        };
        let receiver = &scene.receivers[receiver];
        if receiver.kind != ReceiverKind::FarField || receiver.angles != FarFieldType::A {
            let message = format!("'{}' is no far field over H and V", receiver.name);
            return fail("receiver", message, "a verdict needs `kind = \"far_field\"` with `angles = \"A\"`");
        }
        let (h, v) = receiver.angles_deg();
        let [columns, rows] = receiver.cells.map(f64::from);
        if let Err(error) = regulation.check_cells(f64::max((h[1] - h[0]) / columns, (v[1] - v[0]) / rows)) {
            let enough = |[from, to]: [f64; 2]| ((to - from) / regulation.coarsest_cells_deg()).ceil();
            let help = format!("`cells = [{}, {}]` are enough over these angles", enough(h), enough(v));
            return fail("receiver", error.to_string(), &help);
        }
        Ok(())
    }
}

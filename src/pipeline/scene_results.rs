//! What a traced scene hands back: its figures with both errors, and the document that says it all.

use super::prepared_scene::PreparedScene;
use super::settings::IntersectorKind;
use crate::simulate::{ChannelResult, PartialRun, ReceiverResult, Results, Verification};
use crate::study::cross_check::CrossCheck;
use crate::study::figures::{self, ReceiverFigures, TracedGeometry};
use crate::study::geometric_error::GeometricError;
use crate::study::model_figures::{PowerFigures, power_figures};
use serde_json::Value;

/// The results of a run with what else was found out about it.
#[derive(Clone, Debug)]
pub struct SceneResults {
    /// What was counted.
    pub results: Results,
    /// The check of some of the rays on BVH and spline; `None` where none could be.
    pub check: Option<CrossCheck>,
    /// What the facets change of the light, where the run was on facets.
    pub geometric: Option<GeometricError>,
    /// The pruned kernel against the full one, when asked for.
    pub verification: Option<Verification>,
    /// The sums that the results were made of but for their cells, which the results have; none of a verified run.
    pub(super) sums_without_cells: Option<PartialRun>,
}

impl SceneResults {
    /// Returns the sums that the results were made of, to be saved where the results cannot be written; none of a verified run.
    pub fn sums(&self) -> Option<PartialRun> {
        let mut sums = self.sums_without_cells.clone()?;
        sums.tallies.cells.clone_from(&self.results.tallies.cells);
        Some(sums)
    }

    /// Returns the figures of every receiver with both their errors; the geometric one is absent where facets were not compared.
    pub fn figures(&self, prepared: &PreparedScene) -> Vec<ReceiverFigures> {
        figures::figures(&self.results, self.geometry(prepared), prepared.power_unit())
    }

    /// Returns the powers by where light ended and those that bodies and media took, with both their errors.
    pub fn power_figures(&self, prepared: &PreparedScene) -> PowerFigures {
        power_figures(&self.results, self.geometry(prepared), prepared.power_unit())
    }

    /// Returns what the run was traced on: the spline, or facets with what they change where that was measured.
    fn geometry(&self, prepared: &PreparedScene) -> TracedGeometry<'_> {
        match (prepared.choice.intersector, &self.geometric) {
            (IntersectorKind::Exact, _) => TracedGeometry::Spline,
            (_, Some(error)) => TracedGeometry::Facets(error),
            (_, None) => TracedGeometry::Unmeasured,
        }
    }

    /// Returns the errors of a receiver's cells from the facets, in its unit, with what rarer rays than those that compared may change of
    /// each, and with light that was lost; on the spline of lost light alone, `None` where they are not known, empty where there were too
    /// many cells to compare.
    pub fn geometric_cells(&self, prepared: &PreparedScene, receiver: usize) -> Option<Vec<f64>> {
        // On the true surfaces the error is known, and it is none.
        let none = vec![0.0; self.results.receivers[receiver].cells.len()];
        let of_facets = match (prepared.choice.intersector, &self.geometric) {
            (IntersectorKind::Exact, _) => Some(none),
            // Facets that are the surface itself were not compared cell by cell.
            (_, Some(error)) if error.rays == 0 => Some(none),
            (_, measured) => {
                let errors = &measured.as_ref()?.receivers.get(receiver)?.cells;
                self.with_unseen_rays(receiver, errors, &self.results.receivers[receiver].cells)
            }
        };
        of_facets.map(|errors| self.with_lost_light(receiver, errors, &self.results.receivers[receiver].cells, 1.0))
    }

    /// Adds to errors of a receiver's cells, or of those of one of its channels, which counts `worth` of a watt, what lost light might have
    /// brought them: a share of their own, and, as it need not have come where other light did, as much as each cell has of all of it
    /// where it is spread over the whole receiver.
    fn with_lost_light(&self, receiver: usize, errors: Vec<f64>, cells: &[f64], worth: f64) -> Vec<f64> {
        let (r, power) = (&self.results.receivers[receiver], &self.results.power);
        if power.lost <= 0.0 {
            return errors;
        }
        // Off a disc there are no cells, and a ray adds nothing.
        let is_on = |k: usize| r.ray_cells[k] > 0.0;
        let (share, even) = (power.lost / power.emitted, worth * power.lost / r.whole_lit_measure());
        let lost = |k: usize| if is_on(k) { even.hypot(share * cells[k]) } else { 0.0 };
        errors.into_iter().enumerate().map(|(k, error)| error.hypot(lost(k))).collect()
    }

    /// Adds to errors of cells of a receiver what rays may change of them that are too rare to be among those that compared facets and
    /// spline, where these were compared.
    fn with_unseen_rays(&self, receiver: usize, errors: &[f64], cells: &[f64]) -> Option<Vec<f64>> {
        let share = self.geometric.as_ref()?.unseen_share(receiver, self.results.power.emitted);
        Some(errors.iter().zip(cells).map(|(error, cell)| error.hypot(share * cell)).collect())
    }

    /// Returns for each further channel of a receiver the errors of its cells from the facets, in its unit, as
    /// [`Self::geometric_cells`] does; `None` where they are not known.
    pub fn geometric_channel_cells(&self, prepared: &PreparedScene, receiver: usize) -> Vec<Option<Vec<f64>>> {
        let none = Some(vec![0.0; self.results.receivers[receiver].cells.len()]);
        let of_channel = |c: usize| match (prepared.choice.intersector, &self.geometric) {
            (IntersectorKind::Exact, _) => none.clone(),
            (_, Some(error)) if error.rays == 0 => none.clone(),
            (_, measured) => {
                let errors = &measured.as_ref()?.receivers.get(receiver)?.channels.get(c)?.cells;
                self.with_unseen_rays(receiver, errors, &self.results.receivers[receiver].channels[c].cells)
            }
        };
        let r = &self.results.receivers[receiver];
        let with_lost = |(c, channel): (usize, &ChannelResult)| {
            of_channel(c).map(|errors| {
                self.with_lost_light(receiver, errors, &channel.cells, figures::channel_worth(r, channel))
            })
        };
        r.channels.iter().enumerate().map(with_lost).collect()
    }

    /// Returns for each face that the results list the errors from the facets of what it absorbed, let in and let out, in the unit of the
    /// sources; `None` where they are not known: facets were not compared, or no ray of the comparison met the face. The power of lost rays
    /// is part of each, and all of it on the spline.
    pub fn geometric_face_errors(&self, prepared: &PreparedScene) -> Vec<Option<[f64; 3]>> {
        let lost = self.results.power.lost;
        let error = |face: u32| match (prepared.choice.intersector, &self.geometric) {
            (IntersectorKind::Exact, _) => Some([lost; 3]),
            (_, Some(error)) if error.rays == 0 => Some([lost; 3]),
            (_, Some(error)) => {
                let k = error.faces.binary_search_by_key(&face, |e| e.face).ok()?;
                Some(error.faces[k].geometric(lost))
            }
            (_, None) => None,
        };
        self.results.faces.iter().flat_map(|found| &found.first).map(|f| error(f.face)).collect()
    }

    /// Makes the document of `results.json`, without what only its writer knows: files and where the numbers come from.
    ///
    /// # Errors
    /// When a piece cannot be written as JSON.
    pub fn document(&self, prepared: &PreparedScene) -> serde_json::Result<Value> {
        let mut document = serde_json::to_value(&self.results)?;
        if let Some(verification) = &self.verification {
            document["pruning"] = serde_json::to_value(verification)?;
        }
        if let Some(check) = &self.check {
            document["check"] = serde_json::to_value(check)?;
        }
        for (k, receiver) in self.results.receivers.iter().enumerate() {
            clear_places(&mut document["receivers"][k], receiver);
        }
        for (k, figures) in self.figures(prepared).iter().enumerate() {
            document["receivers"][k]["figures"] = serde_json::to_value(figures)?;
        }
        let power = self.power_figures(prepared);
        document["power_figures"] = serde_json::to_value(&power)?;
        for (k, figure) in power.by_body.iter().enumerate() {
            document["absorbed"][k]["figure"] = serde_json::to_value(figure)?;
        }
        for (k, errors) in self.geometric_face_errors(prepared).into_iter().enumerate() {
            for (key, place) in [("absorbed_geometric", 0), ("entered_geometric", 1), ("left_geometric", 2)] {
                document["faces"]["first"][k][key] = serde_json::to_value(errors.map(|e| e[place]))?;
            }
        }
        document["halving"] = serde_json::to_value(figures::halving(&self.results, self.geometric.as_ref()))?;
        document["tolerance_mm"] = serde_json::to_value(prepared.tolerance_mm())?;
        if let Some(chosen) = &prepared.chosen {
            document["chosen"] = serde_json::to_value(chosen)?;
        }
        if let Some(geometric) = self.geometric.as_ref().filter(|g| g.rays > 0) {
            document["faceting"] = serde_json::to_value(geometric)?;
            for (k, receiver) in self.results.receivers.iter().enumerate() {
                clear_compared_places(&mut document["faceting"]["receivers"][k], receiver);
            }
        }
        if let Some(accuracy) = &prepared.job.accuracy {
            document["accuracy"] = serde_json::to_value(accuracy)?;
        }
        Ok(document)
    }
}

/// Puts `null` in place of what means nothing among the places of a receiver in `results.json`: 0 would be a place.
fn clear_places(document: &mut Value, receiver: &ReceiverResult) {
    for key in ["centroid", "centroid_error", "rms", "rms_error"] {
        // Light that did not come has no place.
        if receiver.power == 0.0 {
            document[key] = Value::Null;
        } else {
            clear_cyclic(&mut document[key], receiver);
        }
    }
}

/// Does the same to what facets change of these places.
fn clear_compared_places(document: &mut Value, receiver: &ReceiverResult) {
    for key in ["centroid", "rms", "width"] {
        clear_cyclic(&mut document[key], receiver);
    }
    for key in ["centroid", "rms"] {
        clear_cyclic(&mut document["statistical"][key], receiver);
    }
}

/// Puts `null` in place of the value along an axis of a receiver that is cyclic; `pair` has one for each axis.
fn clear_cyclic(pair: &mut Value, receiver: &ReceiverResult) {
    for axis in (0..2).filter(|&axis| receiver.is_cyclic(axis)) {
        if let Some(value) = pair.get_mut(axis) {
            *value = Value::Null;
        }
    }
}

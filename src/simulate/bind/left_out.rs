//! What `without` of a `[[model]]` leaves out.

use super::select::{FaceSearch, select_faces};
use crate::model::Model;
use crate::simulate::Error;
use crate::simulate::scene::{Key, Scene};
use std::collections::BTreeSet;

/// What one selector of a model's `without` leaves out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Number of the `[[model]]`, from 1.
    pub model: usize,
    /// The selector.
    pub selects: String,
    /// The faces, by their ids in the model as its file has it.
    pub faces: Vec<u32>,
    /// What the instances are called that lose faces.
    pub instances: Vec<String>,
}

impl Scene {
    /// Returns what each selector of `without` of the `[[model]]` with this index leaves out of its model, which is as its file has it:
    /// all its faces there, and not placed. A face may stand in several.
    ///
    /// # Errors
    /// When a selector means no face of the model.
    ///
    /// # Panics
    /// When the scene has no such `[[model]]`.
    pub fn left_out(&self, index: usize, model: &Model) -> Result<Vec<LeftOut>, Error> {
        let selectors = &self.models[index].without;
        if selectors.is_empty() {
            return Ok(Vec::new());
        }
        let mut search = FaceSearch::new(model);
        let labels = model.labels();
        let instance_of_face: Vec<usize> = model.placed_faces().map(|f| f.instance).collect();
        let left_out = |(k, selector)| {
            let base = [Key::Name("model"), Key::Index(index), Key::Name("without"), Key::Index(k)];
            let mut faces = select_faces(self, &base, selector, &mut search)?;
            // Two points may mean one face.
            faces.sort_unstable();
            faces.dedup();
            let instances: BTreeSet<usize> = faces.iter().map(|&f| instance_of_face[f]).collect();
            Ok(LeftOut {
                model: index + 1,
                selects: selector.to_string(),
                faces: faces.into_iter().map(|f| f as u32).collect(),
                instances: instances.into_iter().map(|i| labels[i].clone()).collect(),
            })
        };
        selectors.iter().enumerate().map(left_out).collect()
    }
}

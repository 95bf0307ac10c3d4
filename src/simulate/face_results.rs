//! What each face did to the power that met it, in the units of the scene.

use super::bind::BoundScene;
use super::power_scale::PowerScale;
use super::tallies::Tallies;
use serde::Serialize;

/// Power at one face, in the unit of the sources; errors are standard errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FaceResult {
    /// The placed face.
    pub face: u32,
    /// Power that it absorbed.
    pub absorbed: f64,
    /// Its error.
    pub absorbed_error: f64,
    /// Power that entered its body through it. What goes in and out several times counts each time.
    pub entered: f64,
    /// Its error.
    pub entered_error: f64,
    /// Power that left its body through it, counted likewise. Between two bodies that touch, light passes the face of either: the one
    /// that it met first.
    pub left: f64,
    /// Its error.
    pub left_error: f64,
}

/// The faces of a run that absorbed light or let it through.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FaceResults {
    /// How many there are.
    pub count: usize,
    /// Those that absorbed and let out most, most first.
    pub first: Vec<FaceResult>,
    /// Power that all others absorbed.
    pub rest_absorbed: f64,
    /// Power that left bodies through all others.
    pub rest_left: f64,
}

impl FaceResults {
    /// The faces of most power, as many as the scene asks for.
    pub(crate) fn new(bound: &BoundScene, tallies: &Tallies, scale: &PowerScale) -> Self {
        let sums = |face: u32| {
            let k = face as usize;
            [&tallies.faces[k], &tallies.entered[k], &tallies.left[k]]
        };
        let mut lit: Vec<u32> =
            (0..tallies.left.len() as u32).filter(|&face| sums(face).iter().any(|s| s.total > 0)).collect();
        // Stable, so that faces of equal power stay in the order of the model.
        lit.sort_by_key(|&face| {
            let [absorbed, _, left] = sums(face);
            std::cmp::Reverse(absorbed.total + left.total)
        });
        let result = |&face: &u32| {
            let [absorbed, entered, left] = sums(face);
            FaceResult {
                face,
                absorbed: scale.power(absorbed),
                absorbed_error: scale.error(absorbed),
                entered: scale.power(entered),
                entered_error: scale.error(entered),
                left: scale.power(left),
                left_error: scale.error(left),
            }
        };
        let listed = lit.len().min(bound.scene.run.faces as usize);
        // Whole quanta first: a sum of no floating-point numbers is −0.
        let rest =
            |k: usize| lit[listed..].iter().map(|&face| sums(face)[k].total).sum::<u128>() as f64 * scale.quantum;
        Self {
            count: lit.len(),
            first: lit[..listed].iter().map(result).collect(),
            rest_absorbed: rest(0),
            rest_left: rest(2),
        }
    }
}

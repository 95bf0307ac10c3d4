//! Changes by facets of the powers that bodies and media absorbed.

use super::cells::{Cell, paired_cells};
use super::paired::Paired;
use super::replicates::ReplicatedRun;
use crate::simulate::BoundScene;
use serde::Serialize;

/// What facets change of the power that the faces of an instance, or the medium of a body, took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AbsorbedError {
    /// The instance, or the one that holds the medium.
    pub name: String,
    /// `faces` or the name of the medium.
    pub r#in: String,
    /// Power.
    pub power: Paired,
    /// Standard error of that on the spline, from these rays alone.
    pub statistical: f64,
    /// Its place in [`Tallies::model_sums`](crate::simulate::Tallies::model_sums).
    #[serde(skip)]
    pub index: usize,
}

/// Compares what bodies and media took in both runs; what neither lit is left out.
pub(super) fn absorbed_errors(bound: &BoundScene, runs: [&ReplicatedRun; 2]) -> Vec<AbsorbedError> {
    let pairs = runs[0].model_quanta.iter().zip(&runs[1].model_quanta).map(|(a, b)| [a.as_slice(), b.as_slice()]);
    let places = runs[1].results.tallies.model_sums().count();
    let cells = paired_cells(places, &pairs.collect::<Vec<_>>());
    let instances = bound.instances.iter().map(|name| [name.as_str(), "faces"]);
    let names = instances.chain((0..).map_while(|body| bound.body_names(body)));
    let lit = names.zip(cells).enumerate().filter(|(_, (_, cell))| cell.facets > 0.0 || cell.spline > 0.0);
    let quantum = runs[1].results.quantum;
    let compared = |(index, ([name, r#in], cell)): (usize, ([&str; 2], Cell))| {
        let [facets, spline] = [cell.facets, cell.spline].map(|quanta| quanta * quantum);
        let [error, statistical] = [cell.difference_variance, cell.spline_variance].map(|v| v.sqrt() * quantum);
        AbsorbedError {
            name: name.into(),
            r#in: r#in.into(),
            power: Paired { facets, spline, error },
            statistical,
            index,
        }
    };
    lit.map(compared).collect()
}

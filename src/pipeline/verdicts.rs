//! Verdicts of the regulations that a scene names, about the far fields of its run.

use super::error::Error;
use super::prepared_scene::PreparedScene;
use super::scene_results::SceneResults;
use crate::regulation::{
    Assessment, Assumptions, IntensityMap, RaySample, Regulation, Traffic, assess, even_edges,
};
use crate::simulate::scene::RegulationUse;
use crate::simulate::{ReceiverResult, Results};
use crate::study::figures::cell_errors;

/// A regulation's answer about a receiver.
#[derive(Clone, Debug)]
pub struct ReceiverVerdict {
    /// Index of the receiver in the results.
    pub receiver: usize,
    /// The answer.
    pub assessment: Assessment,
}

/// Makes the map of intensities, cd, of a far field over H and V, with both errors as they are printed; geometric ones are zero for `None`,
/// and not known where there is not one for every cell. `rays` are those of the run.
///
/// # Errors
/// When a value or an error is no finite number.
fn intensities(
    receiver: &ReceiverResult,
    geometric: Option<&[f64]>,
    rays: RaySample,
) -> Result<IntensityMap, Error> {
    let edges = |k: usize| even_edges(receiver.middle[k], receiver.half[k], receiver.grid[k]);
    let known = geometric.filter(|errors| errors.len() == receiver.cells.len());
    let cells = (receiver.cells.iter().zip(cell_errors(receiver)).enumerate())
        .map(|(k, (value, statistical))| [*value, statistical, known.map_or(0.0, |errors| errors[k])])
        .collect();
    let map = IntensityMap::new(edges(0), edges(1), cells)?.with_rays(rays);
    // Where cells were too many to be compared one by one, only rays are known to be enough or not.
    Ok(if geometric.is_some() && known.is_none() { map.without_geometric_errors() } else { map })
}

/// Judges a run's results by one regulation; `geometric` returns the errors of a receiver's cells from the facets.
///
/// # Errors
/// When the far field cannot be judged; the message says why.
pub(super) fn verdict(
    wanted: &RegulationUse,
    prepared: &PreparedScene,
    results: &Results,
    geometric: impl Fn(usize) -> Option<Vec<f64>>,
) -> Result<ReceiverVerdict, Error> {
    let regulation = Regulation::find(&wanted.id)?;
    let receiver = wanted
        .receiver_index(&prepared.job.scene)
        .ok_or_else(|| Error::request("the scene has no such far field"))?;
    let errors = geometric(receiver);
    let rays = RaySample { heaviest_flux: results.heaviest_ray, replicates: results.replicates };
    let map = intensities(&results.receivers[receiver], errors.as_deref(), rays)?;
    let assumptions = Assumptions {
        traffic: if wanted.left_hand { Traffic::Left } else { Traffic::Right },
        as_placed: wanted.as_placed,
        rays: results.rays,
        // The coarser end: it is what facets err by where they are largest.
        tolerance_mm: prepared.tolerance_mm().map(|[_, high]| high),
    };
    Ok(ReceiverVerdict { receiver, assessment: assess(&map, &regulation, &assumptions)? })
}

impl SceneResults {
    /// Returns the verdict of one regulation about a far field of the run, be it named by the scene or not.
    ///
    /// # Errors
    /// When the regulation is not known, or the far field cannot be judged; the message says why.
    pub fn verdict(&self, prepared: &PreparedScene, wanted: &RegulationUse) -> Result<ReceiverVerdict, Error> {
        verdict(wanted, prepared, &self.results, |k| self.geometric_cells(prepared, k))
    }

    /// Returns the verdicts of the scene's regulations, in its order.
    ///
    /// # Errors
    /// When a far field cannot be judged; the message says why.
    pub fn verdicts(&self, prepared: &PreparedScene) -> Result<Vec<ReceiverVerdict>, Error> {
        prepared.job.scene.regulations.iter().map(|wanted| self.verdict(prepared, wanted)).collect()
    }
}

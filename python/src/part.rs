//! Parts of runs: what was traced of one, to be kept, sent, added up and gone on from.

use crate::background::locked;
use crate::errors::Defect;
use lampyris::pipeline::{PreparedScene, RunKeeper, TraceRequest};
use lampyris::simulate::{PartialRun, shard_replicates};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What stands at the head of the bytes of a part.
#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct PartHeader {
    pub(crate) fingerprint: String,
    /// What wrote it, for messages.
    command: String,
    /// The number of rays of the whole run, where it was found by tracing.
    rays: Option<u64>,
    /// The number of rays of the whole run.
    run_rays: u64,
}

impl PartHeader {
    pub(crate) fn new(fingerprint: String, scene: &PreparedScene) -> Self {
        let command = format!("lampyris {} in Python", env!("CARGO_PKG_VERSION"));
        Self { fingerprint, command, rays: scene.rays, run_rays: scene.run_settings().rays }
    }
}

/// The replicates of a run that are done, and their sums.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Part {
    pub(crate) run: PartialRun,
    pub(crate) header: PartHeader,
    /// `None` for one that was read by itself.
    pub(crate) of: Option<PreparedRun>,
}

/// The run that a part is of.
#[derive(Clone)]
pub(crate) struct PreparedRun {
    /// With the number of rays, where it was found by tracing.
    pub(crate) scene: Arc<PreparedScene>,
    /// The fingerprint of what it was asked of: another one where the number of rays was found by tracing.
    pub(crate) asked: String,
}

impl Part {
    pub(crate) fn bytes(&self) -> PyResult<Vec<u8>> {
        let mut bytes = Vec::new();
        self.run.write(&self.header, &mut bytes).map_err(|e| Defect::new_err(e.to_string()))?;
        Ok(bytes)
    }
}

/// The number of rays of the run that the bytes are a part of, where it was found by tracing.
///
/// # Errors
/// `ValueError` when the bytes are none of a part.
pub(crate) fn rays_found(bytes: &[u8]) -> PyResult<Option<u64>> {
    Ok(PartialRun::header::<PartHeader>(bytes).map_err(unusable)?.rays)
}

/// The sums in the bytes of a part of the run with this fingerprint.
///
/// # Errors
/// `ValueError` when they are damaged or of another run.
pub(crate) fn read(bytes: &[u8], fingerprint: &str, scene: &PreparedScene) -> PyResult<PartialRun> {
    let check = |header: &PartHeader| {
        if header.fingerprint == fingerprint {
            return Ok(());
        }
        Err(format!(
            "it is a part of another run (of {}); the scene, its files, the settings and the version must be the same",
            header.command
        ))
    };
    PartialRun::read(bytes, check, &scene.bound).map_err(unusable)
}

fn unusable(e: impl Display) -> PyErr {
    PyValueError::new_err(format!("the part cannot be used: {e}"))
}

/// The last run that was traced in full, kept while it is checked, so that whatever stops the check loses nothing.
#[derive(Default)]
pub(crate) struct KeptRun {
    whole: Mutex<Option<(PartialRun, Arc<PreparedScene>)>>,
    /// What is done of the first run of a search.
    done: Mutex<Option<PartialRun>>,
}

impl KeptRun {
    /// For a search that goes on from these sums.
    pub(crate) fn starting_from(done: Option<PartialRun>) -> Self {
        Self { done: Mutex::new(done), ..Self::default() }
    }

    /// Keeps a run of this scene if it is whole.
    pub(crate) fn keep(&self, run: &PartialRun, scene: &Arc<PreparedScene>) {
        if run.is_whole() {
            *locked(&self.whole) = Some((run.clone(), scene.clone()));
        }
    }

    /// What was kept.
    pub(crate) fn take(&self) -> Option<(PartialRun, Arc<PreparedScene>)> {
        locked(&self.whole).take()
    }
}

impl RunKeeper for KeptRun {
    fn keep(&self, prepared: &PreparedScene, trace: &mut dyn FnMut(TraceRequest<'_>)) {
        let from = locked(&self.done).take();
        let scene = Arc::new(prepared.clone());
        let keep = |run: &PartialRun| self.keep(run, &scene);
        trace(TraceRequest { from, ..keeping(&keep) });
    }
}

/// A request that tells of the run at the end of each thread.
pub(crate) fn keeping(keep: &(dyn Fn(&PartialRun) + Sync)) -> TraceRequest<'_> {
    TraceRequest { finished: Some(keep), every: Duration::MAX, ..TraceRequest::default() }
}

#[pymethods]
impl Part {
    /// A part from its bytes, of whatever run.
    ///
    /// Raises `ValueError` when they are damaged.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let (header, run) = PartialRun::read_alone(bytes).map_err(unusable)?;
        Ok(Self { run, header, of: None })
    }

    /// Adds another part of the same run, and gives the sum.
    fn merged(&self, other: &Self) -> PyResult<Self> {
        if self.header.fingerprint != other.header.fingerprint {
            return Err(PyValueError::new_err(
                "the parts are of different runs; trace them with the same scene and settings",
            ));
        }
        let mut run = self.run.clone();
        run.merge(&other.run).map_err(|e| PyValueError::new_err(e.to_string()))?;
        let of = self.of.as_ref().or(other.of.as_ref()).cloned();
        Ok(Self { run, header: self.header.clone(), of })
    }

    /// The part as bytes, for a file or another machine.
    fn to_bytes(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes()?).unbind())
    }

    /// Rays of the whole run.
    #[getter]
    fn run_rays(&self) -> u64 {
        self.header.run_rays
    }

    /// Replicates that are done.
    #[getter]
    fn done(&self) -> usize {
        self.run.done.len()
    }

    /// Replicates of the whole run.
    #[getter]
    fn replicates(&self) -> u32 {
        self.run.replicates
    }

    /// Rays that are done.
    #[getter]
    fn rays(&self) -> u64 {
        self.run.tallies.counts.rays
    }

    /// Whether every replicate is done.
    #[getter]
    fn is_whole(&self) -> bool {
        self.run.is_whole()
    }

    /// Of the parts 0 to `count` - 1 of the run those that are not done: the index, and the replicates of it that are.
    fn undone(&self, count: u32) -> Vec<(u32, Vec<u32>)> {
        let parts = (0..count).map(|index| {
            let range = shard_replicates(0..self.run.replicates, [index, count]);
            let [first, end] = [range.start, range.end].map(|r| self.run.done.partition_point(|done| *done < r));
            (index, range.len(), self.run.done[first..end].to_vec())
        });
        parts
            .filter(|(_, replicates, done)| done.len() < *replicates)
            .map(|(index, _, done)| (index, done))
            .collect()
    }

    /// A hash of all that decides the bits of the run.
    #[getter]
    fn fingerprint(&self) -> &str {
        &self.header.fingerprint
    }

    fn __repr__(&self) -> String {
        format!(
            "<lampyris.Part: {} of {} replicates, {} rays>",
            self.run.done.len(),
            self.run.replicates,
            self.rays()
        )
    }
}

//! `--paths FILE.npz`: every vertex of every path of a run.

use crate::cli::failure::Failure;
use crate::formats::{Column, Error, NpzStream, lower_extension};
use crate::simulate::PathVertex;
use std::path::Path;
use std::sync::Mutex;

/// The arrays of the file, one row per vertex.
const COLUMNS: [Column; 6] = [
    Column { name: "ray", numbers: "<u8", bytes: 8, width: 1 },
    Column { name: "branch", numbers: "<u4", bytes: 4, width: 1 },
    Column { name: "bounce", numbers: "<u4", bytes: 4, width: 1 },
    Column { name: "event", numbers: "|u1", bytes: 1, width: 1 },
    Column { name: "point", numbers: "<f8", bytes: 8, width: 3 },
    Column { name: "power", numbers: "<f8", bytes: 8, width: 1 },
];

/// The file in the making, and the first failure to write it.
pub(crate) struct PathFile {
    state: Mutex<(NpzStream, Option<Error>)>,
}

impl PathFile {
    /// Refuses a name that does not end in `.npz`.
    pub(crate) fn check_name(path: &Path) -> Result<(), Failure> {
        if lower_extension(path) != "npz" {
            let message = format!("--paths {}: ray paths are written as .npz alone", path.display());
            return Err(Failure::arguments(message).with_help("write --paths paths.npz"));
        }
        Ok(())
    }

    /// Begins the file of ray paths; fails where it cannot be written.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        Ok(Self { state: Mutex::new((NpzStream::create(path, &COLUMNS)?, None)) })
    }

    /// Appends vertices, from any thread; after a failure no more.
    pub(crate) fn append(&self, vertices: &[PathVertex]) {
        // Packed before the lock is taken: threads wait for the file alone.
        let mut columns: [Vec<u8>; 6] = Default::default();
        for v in vertices {
            columns[0].extend(v.ray.to_le_bytes());
            columns[1].extend(v.branch.to_le_bytes());
            columns[2].extend(v.bounce.to_le_bytes());
            columns[3].push(v.event as u8);
            v.point.to_array().iter().for_each(|x| columns[4].extend(x.to_le_bytes()));
            columns[5].extend(v.power.to_le_bytes());
        }
        let mut state = self.state.lock().unwrap_or_else(|e| e.into_inner());
        // Only the first failure is reported.
        if state.1.is_none() {
            let slices: Vec<&[u8]> = columns.iter().map(Vec::as_slice).collect();
            state.1 = state.0.write(vertices.len() as u64, &slices).err();
        }
    }

    /// Whether writing has failed, so that tracing on is of no use.
    pub(crate) fn has_failed(&self) -> bool {
        self.state.lock().unwrap_or_else(|e| e.into_inner()).1.is_some()
    }

    /// Returns the first failure to write, if there was one, and leaves nothing of the file: the paths of a part of a run are not the
    /// run's.
    pub(crate) fn failure(self) -> Option<Error> {
        self.state.into_inner().unwrap_or_else(|e| e.into_inner()).1
    }

    /// Completes the file and returns the number of vertices; fails with the first failure to write, and leaves an older file of that name
    /// alone then.
    pub(crate) fn finish(self) -> Result<u64, Failure> {
        match self.state.into_inner().unwrap_or_else(|e| e.into_inner()) {
            (stream, None) => Ok(stream.finish()?),
            (_, Some(e)) => Err(e.into()),
        }
    }
}

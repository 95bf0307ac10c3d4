//! Errors of reading a file as a whole.

use std::path::PathBuf;

/// Why a file could not be read at all. Faces and records that cannot be converted are no errors: they are
/// listed in [`super::ImportReport`].
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct Error(#[from] ErrorKind);

/// What kind of [`Error`] it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The operating system does not give the file.
    #[error("{path}: cannot be read: {source}; check the path and its permissions")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// There are no bytes.
    #[error("{file}: the file is empty; export the model as STEP once more")]
    Empty {
        /// Name of the file.
        file: String,
    },
    /// The bytes are no Part 21 text.
    #[error(
        "{file}: line 1: 'ISO-10303-21;' is missing, this is not a STEP file (Part 21 clear text in ASCII or UTF-8); export the model as STEP"
    )]
    NotStep {
        /// Name of the file.
        file: String,
    },
    /// Assemblies that place more than the settings allow.
    #[error(
        "{file}: its assemblies place {count} products and shapes or more, beyond {limit}; raise the limit if that is meant, or export fewer"
    )]
    TooManyPlaced {
        /// Name of the file.
        file: String,
        /// How many, up to the largest 64-bit number.
        count: u64,
        /// Most that are placed.
        limit: u64,
    },
    /// Longer than 4 GiB.
    #[error("{file}: longer than 4 GiB; split the assembly into several files")]
    TooLarge {
        /// Name of the file.
        file: String,
    },
}

impl Error {
    pub(super) fn new(kind: ErrorKind) -> Self {
        Self(kind)
    }

    /// Returns what kind of error it is.
    pub fn kind(&self) -> &ErrorKind {
        &self.0
    }
}

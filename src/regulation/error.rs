//! Why there is no verdict.

/// Kinds of errors of regulations and far fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// No regulation has the name.
    UnknownName,
    /// Several regulations have a name that begins so.
    AmbiguousName,
    /// The text is not that of a far field over H and V in candela.
    Malformed,
    /// Edges that do not rise, another number of cells, or values that are not finite.
    InvalidMap,
    /// The cells of the far field are coarser than the regulation's photometer.
    CoarseCells,
}

/// Why a far field cannot be judged: the message names the regulation, line or cells at fault, and what to do.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    kind: ErrorKind,
    message: String,
}

impl Error {
    /// Makes an error.
    pub(super) fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// Makes an error about the text of a far field.
    pub(super) fn malformed(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Malformed, message)
    }

    /// Makes an error about the edges and values of a map.
    pub(super) fn invalid_map(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::InvalidMap, message)
    }

    /// Returns what kind of error it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

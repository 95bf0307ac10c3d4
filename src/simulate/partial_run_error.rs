//! Why a part of a run cannot be read from its file or added to another.

/// What is wrong with the file of a part of a run, or with adding it to another part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartialRunError {
    /// The bytes do not begin as a tally file of this version does.
    #[error("not a tally file of this version")]
    NotTallyFile,
    /// The header or a list cannot be parsed; with the reason.
    #[error("not a tally file of this version: {0}")]
    Malformed(String),
    /// The bytes end too early, as while the file is still being copied.
    #[error("the file is cut short")]
    CutShort,
    /// The bytes are not those that were written.
    #[error("the file is damaged or cut short: its checksum is wrong")]
    WrongChecksum,
    /// Numbers in the file contradict each other; with what is wrong.
    #[error("{0}")]
    Inconsistent(&'static str),
    /// The sums are those of another scene.
    #[error("it has other receivers or faces than the scene")]
    OtherScene,
    /// The caller refuses the header; with the caller's reason.
    #[error("{0}")]
    RefusedHeader(String),
    /// Parts of different runs cannot be added.
    #[error("it is part of another run")]
    OtherRun,
    /// Both parts hold this replicate.
    #[error("its replicate {0} is in an earlier part already; each part counts once")]
    RepeatedReplicate(u32),
}

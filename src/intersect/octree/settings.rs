//! How an octree is built and walked.

use crate::intersect::NormalMode;
use crate::math::simd::Level;

/// How the tree is built and walked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// T: a box is split while more facets than this meet it. 256 is up to 3 % faster on lamps, and takes 1.2 to 1.6 times as long on
    /// long thin facets; 8 without `collapse` is the textbook tree.
    pub threshold: usize,
    /// Depth at which splitting ends; more than 32 is taken as 32. Uneven scenes need 20 and more.
    pub max_depth: u32,
    /// Merge cells into nodes of up to sixteen children.
    pub collapse: bool,
    /// A box is no longer split once its facets have been duplicated this often on the way to it, so that memory stays bounded.
    pub max_duplication: f64,
    /// Instructions to walk with; the hits are the same.
    pub instruction_set: InstructionSet,
    /// How the normal at a hit is got.
    pub normals: NormalMode,
    /// Largest coordinate that starts were rounded at, mm, where that is not the mesh's own: of a part in its own coordinates that
    /// stands far away. 0 otherwise.
    pub farthest_start: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threshold: 128,
            max_depth: 24,
            collapse: true,
            max_duplication: 16.0,
            instruction_set: InstructionSet::Fastest,
            normals: NormalMode::default(),
            farthest_start: 0.0,
        }
    }
}

impl Settings {
    /// The octree of textbooks: T = 8, every octant its own child.
    ///
    /// ```
    /// use lampyris::intersect::octree::Settings;
    ///
    /// let textbook = Settings::textbook();
    /// assert!(textbook.threshold < Settings::default().threshold && !textbook.collapse);
    /// ```
    pub fn textbook() -> Self {
        Self { threshold: 8, collapse: false, ..Self::default() }
    }
}

/// Instructions to walk the tree with; all find the same hits, bit for bit.
///
/// ```
/// use lampyris::intersect::octree::{InstructionSet, Settings};
///
/// let portable = Settings { instruction_set: InstructionSet::Portable, ..Settings::default() };
/// assert_ne!(portable, Settings::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum InstructionSet {
    /// The widest that the processor offers, detected at run time.
    #[default]
    Fastest,
    /// AVX2 where the processor has it, else plain Rust.
    Avx2,
    /// Plain Rust.
    Portable,
}

impl InstructionSet {
    /// The widest of the allowed instructions that the processor has.
    pub(super) fn level(self) -> Level {
        match self {
            Self::Fastest => Level::widest(),
            Self::Avx2 => Level::avx2(),
            Self::Portable => Level::PORTABLE,
        }
    }
}

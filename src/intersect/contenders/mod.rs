//! Hierarchies of other authors behind [`Intersector`](super::Intersector), for those who compare: each as it is shipped, traced one ray
//! after the other, over the triangles of the facets.
//!
//! | | arithmetic | tree | of its own defects |
//! |---|---|---|---|
//! | [`BinaryBvh`] | f64 | binary, surface-area heuristic | none that were found; visits boxes in order by a heap |
//! | [`Parry`] | f32 | binary, binned | hits are off by 1e-7 of the mesh's size, rays through edges may leak |
//! | [`Embree`] | f32 | by Embree's own choice | as Parry; watertight only with its robust mode, which is on |
//!
//! None of them knows what a ray leaves: [`BinaryBvh`] and [`Parry`] pass over the facet that a ray starts on, for [`Embree`] such a
//! ray begins 1e-5 of the mesh's size later.

mod binary;
mod embree;
mod embree_library;
mod parry;

pub use binary::BinaryBvh;
pub use embree::{Embree, Primitives};
pub use embree_library::{EmbreeError, EmbreeLibrary};
pub use parry::Parry;

//! From records to parts, and to where they stand.
//!
//! Source: ISO 10303-43/44. An assembly places representations (`assembly`); a representation is shells of faces (`topology`, with
//! loops put in order by `order` and shells turned by `outward`), surfaces without a face and ready meshes (`loose`, `tessellated`);
//! all of it with its colours (`styles`) becomes one part (`part`).

pub(super) mod assembly;
mod loose;
mod order;
mod outward;
pub(super) mod part;
pub(super) mod styles;
mod tessellated;
pub(super) mod topology;

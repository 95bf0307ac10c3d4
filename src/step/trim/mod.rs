//! From the loops of a face to one trimmed spline.
//!
//! Every edge is located in the parameters of the face's surface (`fit`, `task`, `touching`); the loops are chained and unwrapped (`loops`,
//! `lobes`), joined and closed over poles and by seams (`boundary`), which go past holes (`seam_path`, `way_search`, `visibility`,
//! `clearance`, `obstacles`, `segment`); the rectangle that they cover becomes one rational B-spline (`region`), in whose parameters the
//! seams and edges are found anew (`seams`, `face`). Of `tolerances`, `fit`, `loops`, `task`, `touching`, `segment`, `obstacles`,
//! `clearance`, `visibility`, `way_search`, `seam_path`, `lobes`, `boundary`, `region`, `seams` and `face` each sees only those before it.

mod boundary;
mod clearance;
pub(super) mod face;
pub(super) mod fit;
mod holes;
mod lobes;
pub(super) mod loops;
mod obstacles;
mod region;
mod seam_path;
mod seams;
mod segment;
pub(super) mod task;
mod tolerances;
mod touching;
mod visibility;
mod way_search;

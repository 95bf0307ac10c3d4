//! From the loops of a face to one trimmed spline.
//!
//! Every edge is located in the parameters of the face's surface (`fit`); the loops are chained and unwrapped (`loops`), joined and
//! closed over seams and poles (`boundary`, `seams`); the rectangle that they cover becomes one rational B-spline (`face`).

mod boundary;
pub(super) mod face;
mod fit;
pub(super) mod loops;
mod seams;

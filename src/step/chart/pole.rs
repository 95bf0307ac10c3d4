//! Places at which a surface contracts to a point.

use crate::math::Point;

/// A parameter value at which the surface contracts to a point.
#[derive(Clone, Copy, Debug)]
pub(in crate::step) struct Pole {
    /// Which parameter is constant there: 0 for u, 1 for v.
    pub(in crate::step) fixed: usize,
    /// Its value.
    pub(in crate::step) parameter: f64,
    /// Where the pole is, mm.
    pub(in crate::step) point: Point,
}

//! What a regulation says of a lamp, row by row, and where in the far field it was read.

use super::aim::Aim;
use super::judgement::{Settles, Verdict};
use super::map::Reading;
use super::row::Row;
use super::table::{Regulation, Traffic};

/// A row with what was measured.
#[derive(Clone, Debug)]
pub struct RowVerdict {
    /// The row of the table.
    pub row: Row,
    /// The reading that decides; for a relative row, its difference from the multiple of the other. `None` outside the far field.
    pub reading: Option<Reading>,
    /// Where it was read, degrees of the table; of a sum the first of its points.
    pub direction: Option<[f64; 2]>,
    /// `None` where the row requires nothing that is measured here: notes, and rows under a condition.
    pub verdict: Option<Verdict>,
    /// What would settle it, if it is unsure by every aim that the errors leave open.
    pub settles: Option<Settles>,
    /// Directions that it needs and that lie outside the far field, 1 for a zone of which any part does, and for a brightest direction
    /// that may: with any, no rays settle it.
    pub unseen: usize,
}

/// A lamp measured by a regulation.
#[derive(Clone, Debug)]
pub struct Assessment {
    /// The regulation.
    pub regulation: Regulation,
    /// The side of the road. For left-hand traffic `aim` and the rows' directions are those of the tables, as they are written for the
    /// other side: the lamp was mirrored.
    pub traffic: Traffic,
    /// How the lamp was aimed.
    pub aim: Aim,
    /// The photometer's opening, from side to side, degrees.
    pub sensor_deg: f64,
    /// Row by row.
    pub rows: Vec<RowVerdict>,
    /// The worst of all rows, without sums of groups that stand in for their points; pass where no row has a verdict.
    pub verdict: Verdict,
}

impl Assessment {
    /// Returns where a direction of the tables was read in the far field as it was placed, degrees: moved by the aim, and for left-hand
    /// traffic mirrored back.
    pub fn placed_direction(&self, [h_deg, v_deg]: [f64; 2]) -> [f64; 2] {
        let [h, v] = [h_deg + self.aim.h_deg, v_deg + self.aim.v_deg];
        match self.traffic {
            Traffic::Right => [h, v],
            Traffic::Left => [-h, v],
        }
    }

    /// Returns how much farther right and up than a direction of the road the far field was read, degrees.
    pub fn placed_aim(&self) -> [f64; 2] {
        self.placed_direction([0.0, 0.0])
    }
}

/// What is known of the run and the lamp besides the map.
#[derive(Clone, Copy, Debug, Default)]
pub struct Assumptions {
    /// The side of the road.
    pub traffic: Traffic,
    /// Measure the lamp as it was placed, whatever the regulation says of aiming.
    pub as_placed: bool,
    /// Rays of the run; 0 where they are not known: then nothing says what settles a row.
    pub rays: u64,
    /// Tolerance of the run's facets, mm, where it had any.
    pub tolerance_mm: Option<f64>,
}

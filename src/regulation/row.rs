//! One requirement of a regulation: what is required, where, and the source of the figure.

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize};

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RowKind {
    /// One direction.
    Point,
    /// All directions of a line.
    Line,
    /// All directions of a zone.
    Zone,
    /// The sum of several directions.
    Sum,
    /// A direction or zone against a multiple of another reading.
    Relative,
    /// The brightest direction of the lamp, which the far field must hold: its rim is darker than half of its brightest.
    Imax,
    /// A direction whose figure follows from a distribution in per cent.
    DistributionPoint,
    /// The sum of a group of points.
    GroupSum,
    /// Text: nothing that is measured.
    Note,
}

/// Which side of a limit a relative row asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// At least so much.
    Min,
    /// At most so much.
    Max,
}

/// One requirement.
// A key that nothing here reads would be a rule that is not kept.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// What it is about.
    #[serde(deserialize_with = "row_kind")]
    pub kind: RowKind,
    /// Its name in the table.
    pub id: String,
    /// Direction, degrees to the right.
    pub h: Option<f64>,
    /// Direction, degrees up.
    pub v: Option<f64>,
    /// Ends of a line, degrees.
    pub(super) h0: Option<f64>,
    pub(super) v0: Option<f64>,
    pub(super) h1: Option<f64>,
    pub(super) v1: Option<f64>,
    /// Corners of a zone, degrees.
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Directions of a sum, degrees.
    pub(super) points: Option<Vec<[f64; 2]>>,
    /// Least intensity, candela.
    pub min: Option<f64>,
    /// Greatest intensity, candela.
    pub max: Option<f64>,
    /// Of the greatest intensity of a zone: the radius of a spot, degrees, that may be brighter.
    pub(super) spot_radius_deg: Option<f64>,
    /// Of a relative row: which side of its limit is asked for.
    #[serde(default, deserialize_with = "bound")]
    pub bound: Option<Bound>,
    /// Of a relative row: its limit, as a multiple of the reading of `of`.
    pub factor: Option<f64>,
    /// Of a relative row: the id of the row that its limit is a multiple of, or `imax`.
    pub of: Option<String>,
    /// Rows of one group are weighed together.
    pub(super) group: Option<u32>,
    /// The condition under which the row holds.
    pub when: Option<String>,
    /// A remark on the row.
    pub note: Option<String>,
    /// Where the figure comes from.
    pub source: String,
    /// `two` where a second source was compared, `one` otherwise.
    pub evidence: String,
    /// How a minimum came about, how a zone is walked and what a note requires: words of the tables that are not measured.
    #[serde(rename = "percent")]
    pub(super) _percent: Option<IgnoredAny>,
    #[serde(rename = "measure")]
    pub(super) _measure: Option<IgnoredAny>,
    #[serde(rename = "text")]
    pub(super) _text: Option<IgnoredAny>,
}

fn row_kind<'de, D: Deserializer<'de>>(value: D) -> Result<RowKind, D::Error> {
    with_key("kind", RowKind::deserialize(value))
}

fn bound<'de, D: Deserializer<'de>>(value: D) -> Result<Option<Bound>, D::Error> {
    with_key("bound", Option::deserialize(value))
}

/// Puts the key before a message, which names the known words alone.
pub(super) fn with_key<T, E: serde::de::Error>(key: &str, value: Result<T, E>) -> Result<T, E> {
    value.map_err(|e| E::custom(format!("{key}: {e}")))
}

impl Row {
    /// Checks that it says all that its kind needs; `rows` are those of its function.
    pub(super) fn check(&self, rows: &[Self]) -> Result<(), String> {
        let has_place = |row: &Self| row.h.is_some() && row.v.is_some();
        let has_limit = self.min.is_some() || self.max.is_some();
        let has_ends = [self.h0, self.v0, self.h1, self.v1].iter().all(Option::is_some);
        let refers = |of: &str| of == "imax" || rows.iter().any(|r| r.id == of && has_place(r));
        let (complete, needs) = match self.kind {
            RowKind::Point | RowKind::DistributionPoint => (has_place(self) && has_limit, "h, v and min or max"),
            RowKind::Line => (has_ends && has_limit, "h0, v0, h1, v1 and min or max"),
            RowKind::Zone => (self.polygon.is_some() && has_limit, "polygon and min or max"),
            RowKind::Imax => (has_limit, "min or max"),
            RowKind::Sum | RowKind::GroupSum => {
                let has_points = self.points.as_ref().is_some_and(|points| !points.is_empty());
                (has_points && self.min.is_some() && self.max.is_none(), "points, min and no max")
            }
            RowKind::Relative => {
                let is_placed = self.polygon.is_some() || has_place(self);
                let compares =
                    self.bound.is_some() && self.factor.is_some() && self.of.as_deref().is_some_and(refers);
                (is_placed && compares, "bound, factor, polygon or h and v, and of: imax or the id of a point")
            }
            RowKind::Note => (!has_limit && self.factor.is_none(), "nothing that is measured"),
        };
        let may_have_spots = self.kind == RowKind::Zone && self.max.is_some();
        if !self.spot_radius_deg.is_none_or(|radius| may_have_spots && radius > 0.0) {
            return Err(format!("row {}: a spot_radius_deg above 0 belongs to the max of a zone", self.id));
        }
        if complete { Ok(()) } else { Err(format!("row {}: {:?} needs {needs}", self.id, self.kind)) }
    }

    /// Whether many directions are measured for it, and not a few.
    pub(super) fn is_extended(&self) -> bool {
        match self.kind {
            RowKind::Line | RowKind::Zone | RowKind::Imax | RowKind::Relative => true,
            RowKind::Point | RowKind::DistributionPoint | RowKind::Sum | RowKind::GroupSum | RowKind::Note => false,
        }
    }

    /// Adds a remark behind what there is.
    pub(super) fn add_note(&mut self, remark: &str) {
        self.note = Some(self.note.take().map_or_else(|| remark.to_owned(), |note| format!("{note}; {remark}")));
    }
}

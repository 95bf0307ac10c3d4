//! The loops of a face as polygons of its parameter plane: what is inside, for boxes and for points on the face.

use super::Face;
use super::face::UseSpan;
use crate::math::polygon::{polygon_sides, row_crossing};
use crate::math::{Enclosure, Uv};
use std::cell::OnceCell;

/// Points on a curved edge use at least; a span of its spline has four at least.
const POINTS_PER_USE: usize = 24;
/// See [`POINTS_PER_USE`].
const POINTS_PER_SPAN: usize = 4;
/// Rows, as shares of the height of the outline, on which a point inside is looked for; the first that holds one serves.
const ROWS: [f64; 7] = [0.5, 0.37, 0.63, 0.21, 0.79, 0.09, 0.91];

/// A face in the parameter plane of its surface, as polygons. Without any it is the whole domain.
pub(super) struct Outline {
    /// One for each loop, which closes by itself.
    pub(super) polygons: Vec<Vec<Uv>>,
    domain: [[f64; 2]; 2],
    /// Of the polygons, built on first use: some thousand places of a thread, each compared with all sides of its border, took ten seconds.
    enclosure: OnceCell<Enclosure>,
}

impl Outline {
    /// Follows every loop by a polygon, fine enough to separate inside from outside except near the trims.
    pub(super) fn new(face: &Face) -> Self {
        // A straight use is its two ends.
        let pieces = |span: &UseSpan<'_>| match span.curve.degree {
            1 => 1,
            _ => POINTS_PER_USE.div_ceil(span.spans).max(POINTS_PER_SPAN),
        };
        Self {
            polygons: face.bounding_loops().iter().map(|l| l.polygon(pieces)).collect(),
            domain: face.surface.domain(),
            enclosure: OnceCell::new(),
        }
    }

    /// Lower and upper corner of the polygons, or of the domain without any, in surface parameters.
    pub(super) fn corners(&self) -> [Uv; 2] {
        if self.polygons.is_empty() {
            let [[u0, u1], [v0, v1]] = self.domain;
            return [Uv::new(u0, v0), Uv::new(u1, v1)];
        }
        let points = self.polygons.iter().flatten();
        points.fold([Uv::INFINITY, Uv::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)])
    }

    /// Whether surface parameters lie inside the trims; without polygons all do.
    pub(super) fn contains(&self, p: Uv) -> bool {
        let sides = || self.polygons.iter().flat_map(|polygon| polygon_sides(polygon)).collect();
        self.polygons.is_empty() || self.enclosure.get_or_init(|| Enclosure::new(sides())).encloses(p)
    }

    /// Surface parameters well inside: the middle of the longest stretch of one of a few rows; `None` when no row is crossed.
    pub(super) fn inner_point(&self) -> Option<Uv> {
        let [lo, hi] = self.corners();
        if self.polygons.is_empty() {
            return Some(0.5 * (lo + hi));
        }
        ROWS.iter().find_map(|share| {
            let v = lo.y + share * (hi.y - lo.y);
            let mut crossings: Vec<f64> = Vec::new();
            for polygon in &self.polygons {
                let crossed = polygon_sides(polygon).filter(|[a, b]| (a.y > v) != (b.y > v));
                crossings.extend(crossed.map(|side| row_crossing(side, v)));
            }
            crossings.sort_by(f64::total_cmp);
            let stretches = crossings.chunks_exact(2).filter(|s| s[1] > s[0]);
            // The longest stretch has the most room around its middle.
            let longest = stretches.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
            Some(Uv::new(0.5 * (longest[0] + longest[1]), v))
        })
    }
}

//! Lobes of loops that cross themselves: what a loop encloses by the even–odd rule, however much of it cancels in its signed area.
//!
//! A loop like an eight of equal lobes has the signed area 0 of an edge run forth and back, and encloses both lobes.

use super::loops::Chain;
use super::obstacles::bounds;
use super::tolerances::{CANCELLED_SHARE, EMPTY_LOBES_SHARE, EMPTY_LOOP_SHARE};
use crate::math::Uv;
use crate::math::polygon::{polygon_sides, row_crossing, signed_area};
use crate::step::chart::Chart;

/// Rows along which lobes are measured: a lobe between two of them is a thirtieth of its loop's size or less.
const ROWS: usize = 64;

/// Returns the loops that enclose something, and their polygons. The others are left out: their signed area is nothing beside the largest
/// one, and so are their lobes.
pub(super) fn loops_with_extent(loops: Vec<Chain>, chart: &Chart) -> (Vec<Chain>, Vec<Vec<Uv>>) {
    let polygons: Vec<Vec<Uv>> = loops.iter().map(Chain::polygon).collect();
    let areas: Vec<f64> = polygons.iter().map(|polygon| signed_area(polygon).abs()).collect();
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let all = loops.into_iter().zip(polygons).zip(areas);
    let has_extent = |polygon: &[Uv], area: f64| area > EMPTY_LOOP_SHARE * largest || has_lobes(polygon, chart);
    all.filter(|((_, polygon), area)| has_extent(polygon, *area)).map(|(kept, _)| kept).unzip()
}

/// Returns what a loop of this polygon encloses where its signed area is rounding beside that; `None` for any other loop.
pub(super) fn cancelling_lobes(chain: &Chain, polygon: &[Uv]) -> Option<f64> {
    let area = chain.area().abs();
    let [lo, hi] = bounds(polygon);
    let around = (hi - lo).element_product();
    // Most loops are classified at once.
    if area > CANCELLED_SHARE * around {
        return None;
    }
    let enclosed = enclosed_area(polygon);
    (area < CANCELLED_SHARE * enclosed && enclosed > EMPTY_LOBES_SHARE * around).then_some(enclosed)
}

/// Whether a polygon in the parameters of a chart encloses more than rounding.
fn has_lobes(polygon: &[Uv], chart: &Chart) -> bool {
    let Some(&first) = polygon.first() else { return false };
    // As if in mm: an angle and a length have no size together.
    let speeds = polygon.iter().map(|p| {
        let d = chart.derivatives(*p);
        Uv::new(d.du.length(), d.dv.length())
    });
    let speed = speeds.fold(Uv::ZERO, Uv::max);
    let scaled: Vec<Uv> = polygon.iter().map(|p| (*p - first) * speed).collect();
    let [lo, hi] = bounds(&scaled);
    enclosed_area(&scaled) > EMPTY_LOBES_SHARE * (hi - lo).length_squared()
}

/// Returns the area that a polygon encloses by the even–odd rule, as the sum over [`ROWS`] rows.
fn enclosed_area(polygon: &[Uv]) -> f64 {
    let [lo, hi] = bounds(polygon);
    let height = (hi.y - lo.y) / ROWS as f64;
    let width = |row: usize| {
        let v = lo.y + (row as f64 + 0.5) * height;
        let crossed = polygon_sides(polygon).filter(|[a, b]| (a.y > v) != (b.y > v));
        let mut crossings: Vec<f64> = crossed.map(|side| row_crossing(side, v)).collect();
        crossings.sort_unstable_by(f64::total_cmp);
        crossings.chunks_exact(2).map(|pair| pair[1] - pair[0]).sum::<f64>()
    };
    (0..ROWS).map(width).sum::<f64>() * height
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::trim::loops::Piece;

    fn chain(corners: &[[f64; 2]]) -> Chain {
        let next = |k: usize| corners[(k + 1) % corners.len()];
        Chain::closed((0..corners.len()).map(|k| Piece::straight(corners[k].into(), next(k).into())).collect())
    }

    /// An eight of two triangles of base 10 and height 5; an edge run forth and back, and a square, are none.
    #[test]
    fn lobes_count_where_their_signed_areas_cancel() {
        let lobes = |corners: &[[f64; 2]]| {
            let chain = chain(corners);
            cancelling_lobes(&chain, &chain.polygon())
        };
        let eight = lobes(&[[0.0, 0.0], [10.0, 10.0], [0.0, 10.0], [10.0, 0.0]]).expect("an eight");
        assert!((eight - 50.0).abs() < 1e-9, "{eight}");
        assert_eq!(lobes(&[[0.0, 0.0], [10.0, 3.0]]), None);
        assert_eq!(lobes(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]), None);
    }
}

//! The width over which values along a line through the peak stay above half of it, and its error.

use std::iter::once;

/// A width at half of the peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfWidth {
    /// The width, in cells.
    pub cells: f64,
    /// Its standard error from those of the values, in cells; `None` without these, and where they leave open whether the line falls below
    /// half at all.
    pub error: Option<f64>,
}

/// Returns the distance of the first value from where the values fall below `level`, linear between two of them; `None` where all are
/// above.
fn distance_to(level: f64, values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut inner = f64::INFINITY;
    for (k, value) in values.enumerate() {
        if value < level {
            return Some((k as f64 - 1.0 + (inner - level) / (inner - value)).max(0.0));
        }
        inner = value;
    }
    None
}

/// Returns the width of a line of values, each with its error where these are known, over which it stays above half of the largest; `None`
/// where that reaches the end on a side.
pub(super) fn half_width(values: &[f64], errors: Option<&[f64]>) -> Option<HalfWidth> {
    let peak = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]))?;
    let half = 0.5 * values[peak];
    let side = |right: bool, level: f64, moved: f64| {
        let value = |k: usize| values[k] + moved * errors.map_or(0.0, |errors| errors[k]);
        // The peak itself stands: its noise moves the level.
        let first = once(values[peak]);
        if right {
            distance_to(level, first.chain((peak + 1..values.len()).map(value)))
        } else {
            distance_to(level, first.chain((0..peak).rev().map(value)))
        }
    };
    let width = |level: f64| Some(side(false, level, 0.0)? + side(true, level, 0.0)?);
    let error = || {
        // Noise of the cells moves both ends apart from each other, that of the peak both alike. Values a standard error up or down, and
        // not their slope where the line crosses: a cell between that fell below half by its noise ends the width too.
        let spread = |right: bool| Some(0.5 * (side(right, half, 1.0)? - side(right, half, -1.0)?));
        let of_level = 0.5 * errors?[peak];
        let of_peak = 0.5 * (width(half - of_level)? - width(half + of_level)?);
        Some(spread(false)?.hypot(spread(true)?).hypot(of_peak))
    };
    Some(HalfWidth { cells: width(half)?, error: error() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_at_half_are_those_of_the_curve() {
        // A triangle of half width 10 steps falls to half after 5.
        let triangle: Vec<f64> = (0..41).map(|k| 10.0 - (f64::from(k) - 20.0).abs().min(10.0)).collect();
        assert!((half_width(&triangle, None).unwrap().cells - 10.0).abs() < 1e-12);
        assert_eq!(half_width(&triangle, None).unwrap().error, None);
        assert_eq!(half_width(&[1.0, 2.0, 1.5], None), None, "no end within the grid");
    }

    /// With ± 0.3 everywhere and a slope of 1 a cell, each end moves by 0.3, and both by 0.15 with the level: √(0.3² + 0.3² + 0.3²).
    #[test]
    fn errors_of_the_values_move_the_ends() {
        let triangle: Vec<f64> = (0..41).map(|k| 10.0 - (f64::from(k) - 20.0).abs().min(10.0)).collect();
        let width = half_width(&triangle, Some(&[0.3; 41])).unwrap();
        assert!((width.error.unwrap() - 0.27f64.sqrt()).abs() < 1e-12, "{width:?}");
    }

    /// A plateau with a cell that noise may have taken below half: the width may as well be that of the plateau.
    #[test]
    fn a_gap_of_noise_leaves_the_width_open() {
        let mut line = vec![10.0; 21];
        line.extend([4.9, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0]);
        line.splice(0..0, [0.0, 0.0]);
        let errors: Vec<f64> = line.iter().map(|v| if *v == 4.9 { 0.5 } else { 0.0 }).collect();
        let width = half_width(&line, Some(&errors)).unwrap();
        assert!(width.error.unwrap() > 2.0, "{width:?}");
    }
}

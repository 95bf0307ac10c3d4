//! Axes of plotly's figures.

use super::chart::AxisStyle;
use crate::text::figures;
use serde_json::{Value, json};

/// Decades up to which a logarithmic axis has marks at 1, 2 and 5 of each, and up to which at each decade.
const FEW_DECADES: f64 = 1.5;
const SOME_DECADES: f64 = 4.0;

/// Returns plotly's axis over these values. On a logarithmic one plotly names every digit of a decade, which overlap where there are more
/// than two, and without their power where no whole decade is in sight.
pub(super) fn axis(style: &AxisStyle, values: impl Iterator<Item = f64>) -> Value {
    let good = values.filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = good.fold((f64::INFINITY, 0f64), |(a, b), v| (a.min(v), b.max(v)));
    let decades = (high / low).log10();
    let mut axis = json!({"title": {"text": style.title()}, "type": if style.log { "log" } else { "linear" },
        "automargin": true, "exponentformat": if style.log { "power" } else { "none" }});
    // Where plotly's own steps are good it is left to them.
    if style.log && decades.is_finite() && decades <= SOME_DECADES {
        if decades > FEW_DECADES {
            axis["dtick"] = json!(1);
        } else {
            let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
            let marks: Vec<f64> = powers.flat_map(|p| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(p))).collect();
            axis["tickvals"] = json!(marks);
            axis["ticktext"] = json!(marks.iter().map(|mark| figures(*mark, 1)).collect::<Vec<_>>());
        }
    }
    axis
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within a decade that begins at no power of ten marks are still whole numbers.
    #[test]
    fn a_short_logarithmic_axis_has_marks() {
        let axis = axis(&AxisStyle::log("time", "s"), [0.16, 0.9].into_iter());
        let names: Vec<&str> = axis["ticktext"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        assert_eq!(names, ["0.1", "0.2", "0.5", "1", "2", "5"]);
        assert_eq!(axis["tickvals"].as_array().unwrap().len(), 6);
    }
}

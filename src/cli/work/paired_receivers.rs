//! What facets change of each receiver of a scene, from the same rays on facets and on the spline.

use crate::cli::console::Console;
use crate::intersect::Intersector;
use crate::pipeline::TracingSettings;
use crate::report::{Cell, Table};
use crate::simulate::scene::PowerUnit;
use crate::simulate::{BoundScene, RunSettings, Scene};
use crate::study::receivers::{PowerComparison, compare_power};
use crate::text::figures;

/// Rays at most: a second or two on the spline of a lamp.
const MOST_RAYS: u64 = 100_000;

/// Traces the scene on facets and on the spline with the same rays, at most [`MOST_RAYS`]; returns what changes at each receiver. Shows a
/// spinner.
pub(crate) fn trace_both(
    scene: &Scene,
    bound: &BoundScene,
    [facets, exact]: [&dyn Intersector; 2],
    tracing: &TracingSettings,
    console: &Console,
) -> Vec<PowerComparison> {
    let of_scene = RunSettings::from(&scene.run);
    let settings = RunSettings {
        rays: tracing.rays().unwrap_or(scene.run.rays).min(MOST_RAYS),
        seed: tracing.seed.unwrap_or(scene.run.seed),
        threads: tracing.threads.unwrap_or(of_scene.threads),
        ..of_scene
    };
    let spinner = console.spinner("tracing the scene on facets and on the spline");
    let found = compare_power(bound, facets, exact, &settings);
    spinner.finish_and_clear();
    found
}

/// Makes the report's table of what facets change of every receiver, in per cent of its power on the spline; `unit` is that of powers.
pub(crate) fn table(pairs: &[PowerComparison], unit: PowerUnit) -> Table {
    let columns = [
        ("receiver", ""),
        ("power on the spline", unit.symbol()),
        ("changed by facets", "%"),
        ("± (1σ, same rays)", "%"),
        ("± (1σ, alone)", "%"),
    ];
    let mut table = Table::new("receivers", "What facets change of the light", &columns)
        .caption("The same rays are traced on facets and on the spline, so that most of the noise cancels in the difference.");
    for p in pairs {
        let mut row = vec![p.name.as_str().into(), Cell::Number(p.power_exact, 5)];
        if p.power_exact > 0.0 {
            let shares = [p.difference, p.difference_error, p.power_error].map(|x| x / p.power_exact);
            row.extend(shares.map(|share| Cell::Number(100.0 * share, 2)));
        } else {
            // A share of darkness is no share.
            row.extend(["dark".into(), Cell::Empty, Cell::Empty]);
        }
        table.row(row);
    }
    table
}

/// Returns what facets change of every receiver, a line each; dark receivers are left out.
pub(crate) fn summary(pairs: &[PowerComparison]) -> String {
    let mut text = String::new();
    for p in pairs.iter().filter(|p| p.power_exact > 0.0) {
        let percent = |x: f64| figures(100.0 * x / p.power_exact, 2);
        text += &format!(
            "  {:<12} facets change the power by {} ± {} % (same rays on both; alone it is known to {} %)\n",
            p.name,
            percent(p.difference),
            percent(p.difference_error),
            percent(p.power_error)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn darkness_on_the_spline_has_no_share() {
        let lit_by_facets_alone = PowerComparison {
            name: "wall".into(),
            power_facets: 1e-3,
            difference: 1e-3,
            ..PowerComparison::default()
        };
        let table = table(&[lit_by_facets_alone], PowerUnit::Lumen);
        assert_eq!(table.rows[0][2..], [Cell::Text("dark".into()), Cell::Empty, Cell::Empty]);
    }
}

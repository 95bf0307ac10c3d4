//! All promises of meshing on random closed shells of trimmed rational faces, looked at by sampling that shares nothing with the bound.
//!
//! Degrees 1 to 5, weights from 1e-2 to 1e2, inner knots up to full multiplicity, holes, cuts that leave slivers, sizes from a
//! micrometre to a hundred metres, up to a thousand sizes off the origin. `PROPTEST_CASES` asks for more models, `SEED` for one.

use crate::support::{config, judge, rounds, seeded, seeds, shells};
use lampyris::model::Model;
use lampyris::tessellate::{Settings, Tessellation, tessellate};
use proptest::prelude::*;

/// Whether one thread makes the same bits.
fn same_alone(model: &Model, settings: &Settings, made: &Tessellation) -> bool {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one.install(|| tessellate(model, settings));
    alone.mesh == made.mesh && alone.quality == made.quality
}

/// All promises on the shell that a seed makes.
fn trimmed_shell(seed: u64) -> Result<(), TestCaseError> {
    let ((sheets, cuts), fine, range) =
        seeded((shells::sheets(), 0.0015f64..0.03, prop_oneof![Just(1f64), 1f64..8.0]), seed);
    let size = sheets[0].bounds().diagonal();
    let tolerance = fine * size;
    let (model, gap) = shells::pillow(&sheets, &cuts, 1e-4 * tolerance);
    // What it strays between places that were looked at is no more than that.
    let gap = 2.0 * gap;
    let radii = [0.05 * size, 2.0 * size];
    let settings =
        Settings { tolerance: [tolerance, range * tolerance], radii, budget: 1500, ..Settings::default() };
    let made = tessellate(&model, &settings);
    let found = judge::judge(&model, &made, gap);
    prop_assert!(found.is_ok(), "{}", found.unwrap_err());
    prop_assert!(same_alone(&model, &settings, &made));
    for q in &made.quality {
        prop_assert!(q.tolerance >= tolerance * (1.0 - 1e-12) && q.tolerance <= range * tolerance * (1.0 + 1e-12));
    }
    Ok(())
}

/// Corners one rounding apart on a crease: facets without width stood between them.
#[test]
fn corners_on_a_crease_are_one() {
    trimmed_shell(2_629_141_982).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 0, ..config(12) })]

    #[test]
    fn trimmed_shells_keep_all_promises(seed in seeds()) {
        trimmed_shell(seed)?;
    }

    #[test]
    fn trimmed_rounds_keep_all_promises(seed in seeds()) {
        let (round, fine, range) = seeded((rounds::rounds(), -3.5f64..-0.5, prop_oneof![Just(1f64), 1f64..8.0]), seed);
        let tolerance = 10f64.powf(fine) * round.size();
        let (model, gap) = round.model(1e-4 * tolerance);
        let gap = 2.0 * gap;
        let radii = [0.05 * round.size(), 2.0 * round.size()];
        let settings = Settings { tolerance: [tolerance, range * tolerance], radii, budget: 20_000, ..Settings::default() };
        let made = tessellate(&model, &settings);
        let found = judge::judge(&model, &made, gap);
        prop_assert!(found.is_ok(), "{}", found.unwrap_err());
        prop_assert!(found.unwrap().proved == made.mesh.facets.len());
        prop_assert!(same_alone(&model, &settings, &made));
    }
}

//! Two random rational sheets over one rim.

use lampyris::math::Point;
use lampyris::nurbs::Surface;

/// Sheets of 30 × 20 mm whose control points and weights agree on the border and nowhere else; the first lies above. Weights go from
/// 1e-2 to 1e2 between a sheet's own points and from `10^-rim` to `10^rim` on the rim, where they set its shape alone.
pub(crate) fn two_sheets(
    [p, q]: [usize; 2],
    knots: &[Vec<f64>; 2],
    noise: &[(f64, f64, f64, f64)],
    rim: f64,
    placed: impl Fn(Point) -> Point,
) -> [Surface; 2] {
    let [n, m] = [knots[0].len() - p - 1, knots[1].len() - q - 1];
    let sheet = |lift: f64, from: usize| {
        let point = |k: usize| {
            let (i, j) = (k / m, k % m);
            let border = i == 0 || j == 0 || i == n - 1 || j == m - 1;
            let (a, b, c, e) = noise[if border { k } else { k + from } % noise.len()];
            let step = [30.0 / (n - 1) as f64, 20.0 / (m - 1) as f64];
            let z = if border { 0.5 * c } else { lift + 2.0 * c };
            let at = placed(Point::new(step[0] * (i as f64 + 0.2 * a), step[1] * (j as f64 + 0.2 * b), z));
            let w = 10f64.powf(if border { rim * e } else { 2.0 * e });
            (at * w).extend(w)
        };
        Surface { degree: [p, q], knots: knots.clone(), points: (0..n * m).map(point).collect() }
    };
    [sheet(5.0, 128), sheet(-5.0, 256)]
}

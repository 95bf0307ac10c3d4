//! Values over one variable, linear between points.

use super::error::{Error, ErrorKind, require};

/// A function of wavelength (or of an angle) given at points, linear between them, constant beyond the ends.
///
/// ```
/// use lampyris::optics::Table;
/// let table = Table::new("index", [(400.0, 1.6), (600.0, 1.5)])?;
/// assert_eq!((table.value(500.0), table.value(700.0)), (1.55, 1.5));
/// # Ok::<(), lampyris::optics::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Table {
    /// A table from points `(x, y)`; `what` it holds is for messages.
    ///
    /// # Errors
    /// When there is no point, x does not increase strictly, or a number is not finite.
    pub fn new(what: &'static str, points: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, Error> {
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        if x.is_empty() {
            return Err(ErrorKind::EmptyTable { what }.into());
        }
        check_increasing(what, &x)?;
        for &value in &y {
            require(what, value, true, "a finite number")?;
        }
        Ok(Self { x, y })
    }

    /// Samples a smooth function over `[a, b]` at `intervals + 1` even steps; the caller vouches for `a < b`, an interval and finite
    /// values.
    pub(super) fn sampled([a, b]: [f64; 2], intervals: usize, f: impl Fn(f64) -> f64) -> Self {
        let x: Vec<f64> = (0..=intervals).map(|i| a + (b - a) * i as f64 / intervals as f64).collect();
        let y = x.iter().map(|&x| f(x)).collect();
        Self { x, y }
    }

    /// The value at `x`, that of the nearer end beyond the points.
    pub fn value(&self, x: f64) -> f64 {
        let (i, s) = bracket(&self.x, x);
        if s == 0.0 { self.y[i] } else { self.y[i] + s * (self.y[i + 1] - self.y[i]) }
    }

    /// First and last abscissa.
    pub fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Whether the value is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.y.iter().all(|&y| y == self.y[0])
    }

    /// The points.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.x.iter().copied().zip(self.y.iter().copied())
    }

    /// Smallest and largest value.
    pub fn extremes(&self) -> [f64; 2] {
        let low = self.y.iter().copied().fold(f64::INFINITY, f64::min);
        [low, self.y.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }
}

/// Refuses values that are not finite or do not increase strictly, by their row; there may be none.
pub(super) fn check_increasing(what: &'static str, x: &[f64]) -> Result<(), Error> {
    for (i, &value) in x.iter().enumerate() {
        require(what, value, true, "a finite number")?;
        if i > 0 && value <= x[i - 1] {
            return Err(ErrorKind::NotIncreasing { what, row: i + 1 }.into());
        }
    }
    Ok(())
}

/// Index and fraction in `[0, 1)` of `x` among increasing values, at least one, clamped to the ends; a fraction of 0 needs no next value.
pub(super) fn bracket(values: &[f64], x: f64) -> (usize, f64) {
    let i = values.partition_point(|&v| v <= x);
    if i == 0 {
        (0, 0.0)
    } else if i == values.len() {
        (i - 1, 0.0)
    } else {
        (i - 1, (x - values[i - 1]) / (values[i] - values[i - 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_inside_and_constant_beyond() {
        let t = Table::new("index", [(400.0, 1.5), (500.0, 1.4), (700.0, 1.2)]).unwrap();
        assert_eq!((t.value(300.0), t.value(400.0), t.value(900.0)), (1.5, 1.5, 1.2));
        assert!((t.value(450.0) - 1.45).abs() < 1e-15 && (t.value(600.0) - 1.3).abs() < 1e-15);
        assert_eq!(t.range(), [400.0, 700.0]);
        assert!(!t.is_constant() && Table::new("x", [(1.0, 2.0)]).unwrap().is_constant());
    }

    #[test]
    fn refusals_say_which_row() {
        let e = Table::new("index", [(400.0, 1.5), (400.0, 1.4)]).unwrap_err();
        assert!(e.to_string().starts_with("row 2 of the index table"), "{e}");
        assert_eq!(Table::new("index", []).unwrap_err().kind(), &ErrorKind::EmptyTable { what: "index" });
        assert!(Table::new("index", [(1.0, f64::NAN)]).is_err());
    }
}

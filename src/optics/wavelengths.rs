//! Wavelengths drawn in proportion to the power of a spectrum.

use super::cie_observer::{observer_range, xyz_of_watt};
use super::error::{Error, ErrorKind, require, require_wavelength};
use super::intensity::linear_quantile;
use super::table::Table;

/// Range of wavelengths that is divided into even steps of at most 1 nm.
pub(super) const MOST_EVEN_NM: f64 = 4000.0;

/// Number of even steps over a range of wavelengths of at most [`MOST_EVEN_NM`]: of at most 1 nm, but no fewer than 64.
pub(super) fn steps(range_nm: f64) -> usize {
    (range_nm.ceil() as usize).clamp(64, MOST_EVEN_NM as usize)
}

/// A spectrum normalised to power 1, ready to draw wavelengths from by inversion.
#[derive(Clone, Debug, PartialEq)]
pub struct Wavelengths {
    kind: Kind,
    /// Power up to and including each line, or up to each point of the table; the last is the whole, before normalisation.
    sums: Vec<f64>,
}

/// Wavelengths of lines, nm; or points of wavelength, nm, and power between which it is linear.
#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Lines(Vec<f64>),
    Continuous(Vec<[f64; 2]>),
}

impl Wavelengths {
    /// The spectrum of lines, each a wavelength, nm, and a relative power; refused unless these are positive, and powers 0 or more.
    pub(super) fn lines(lines: &[[f64; 2]]) -> Result<Self, Error> {
        let mut sum = 0.0;
        let mut sums = Vec::with_capacity(lines.len());
        for &[nm, power] in lines {
            require_wavelength("a wavelength", nm)?;
            sum += require("the power of a line", power, power >= 0.0, "zero or more")?;
            sums.push(sum);
        }
        Self::with_power(Kind::Lines(lines.iter().map(|l| l[0]).collect()), sums)
    }

    /// The spectrum of a table of wavelength, nm, and relative power, linear between its points; refused without power, as with one point,
    /// or with a wavelength that is not positive or a negative power.
    pub(super) fn continuous(table: Table) -> Result<Self, Error> {
        let points: Vec<[f64; 2]> = table.points().map(|(x, y)| [x, y]).collect();
        let [low, _] = table.extremes();
        require("the power of a spectrum", low, low >= 0.0, "zero or more at every wavelength")?;
        require_wavelength("the first wavelength", points[0][0])?;
        require_wavelength("the last wavelength", points[points.len() - 1][0])?;
        let mut sums = vec![0.0];
        for p in points.windows(2) {
            // Linear between its points, so that trapezia are exact.
            sums.push(sums[sums.len() - 1] + 0.5 * (p[1][0] - p[0][0]) * (p[0][1] + p[1][1]));
        }
        Self::with_power(Kind::Continuous(points), sums)
    }

    /// Joins both; refuses sums that are none, or end in no power or not in a finite one.
    fn with_power(kind: Kind, sums: Vec<f64>) -> Result<Self, Error> {
        match sums.last() {
            Some(&total) if total > 0.0 && total.is_finite() => Ok(Self { kind, sums }),
            _ => Err(ErrorKind::NoPower { what: "the spectrum" }.into()),
        }
    }

    /// Power of the whole, before normalisation.
    pub(super) fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// Draws a wavelength in nm in proportion to power; `u` uniform in `[0, 1)`. It rises with `u`, for lines where these ascend.
    pub fn sample(&self, u: f64) -> f64 {
        // Below the whole, so that rounding never ends in a piece without power.
        let wanted = (u * self.total()).min(self.total().next_down());
        let i = self.sums.partition_point(|&s| s <= wanted);
        match &self.kind {
            Kind::Lines(nm) => nm[i.min(nm.len() - 1)],
            Kind::Continuous(points) => {
                let i = i.clamp(1, points.len() - 1);
                let ([x0, y0], [x1, y1]) = (points[i - 1], points[i]);
                let share = (wanted - self.sums[i - 1]) / (self.sums[i] - self.sums[i - 1]);
                x0 + (x1 - x0) * linear_quantile(y0, y1, share)
            }
        }
    }

    /// Wavelengths, nm, of the lines that have power; `None` for a continuous spectrum.
    pub(crate) fn lit_lines(&self) -> Option<Vec<f64>> {
        let Kind::Lines(nm) = &self.kind else { return None };
        let is_lit = |&i: &usize| self.sums[i] > i.checked_sub(1).map_or(0.0, |before| self.sums[before]);
        Some((0..nm.len()).filter(is_lit).map(|i| nm[i]).collect())
    }

    /// Share of power per nm at a wavelength; zero beyond the table, and for lines, whose density is not a function.
    pub fn density(&self, wavelength_nm: f64) -> f64 {
        match &self.kind {
            Kind::Lines(_) => 0.0,
            Kind::Continuous(points) => {
                let i = points.partition_point(|p| p[0] <= wavelength_nm);
                if i == 0 || wavelength_nm > points[points.len() - 1][0] {
                    return 0.0;
                }
                let ([x0, y0], [x1, y1]) = (points[i - 1], points[i.min(points.len() - 1)]);
                let s = if x1 > x0 { (wavelength_nm - x0) / (x1 - x0) } else { 0.0 };
                (y0 + s * (y1 - y0)) / self.total()
            }
        }
    }

    /// Least and greatest wavelength of its lines or points, nm, also where these carry no power.
    pub fn range_nm(&self) -> [f64; 2] {
        match &self.kind {
            Kind::Lines(nm) => nm.iter().fold([f64::INFINITY, 0.0], |[a, b], &x| [a.min(x), b.max(x)]),
            Kind::Continuous(points) => [points[0][0], points[points.len() - 1][0]],
        }
    }

    /// CIE XYZ of one watt of this light, Y in lumens; zero where the eye sees nothing of it.
    pub fn xyz(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |nm: f64, weight: f64| {
            for (s, v) in sum.iter_mut().zip(xyz_of_watt(nm)) {
                *s += weight * v;
            }
        };
        match &self.kind {
            Kind::Lines(lines) => {
                let mut before = 0.0;
                for (&nm, &s) in lines.iter().zip(&self.sums) {
                    add(nm, (s - before) / self.total());
                    before = s;
                }
            }
            Kind::Continuous(points) => {
                // Between two of these spectrum and observer are linear both: for their product Simpson's rule is exact.
                for ends in bends(points).windows(2) {
                    let (middle, sixth) = (0.5 * (ends[0] + ends[1]), (ends[1] - ends[0]) / 6.0);
                    for (nm, weight) in [(ends[0], sixth), (middle, 4.0 * sixth), (ends[1], sixth)] {
                        add(nm, weight * self.density(nm));
                    }
                }
            }
        }
        sum
    }

    /// The same light by its lumens in place of its watts: what wavelengths are drawn from where power is counted in lumens. The product
    /// with V(λ) is taken every nanometre and at every point of the spectrum.
    ///
    /// # Errors
    /// When the eye sees nothing of it.
    pub fn photometric(&self) -> Result<Self, Error> {
        match &self.kind {
            Kind::Lines(nm) => {
                // Powers of lines are kept as running sums, from which they are recovered.
                let before = std::iter::once(0.0).chain(self.sums.iter().copied());
                let watts = self.sums.iter().zip(before).map(|(s, before)| s - before);
                Self::lines(&nm.iter().zip(watts).map(|(&nm, w)| [nm, w * xyz_of_watt(nm)[1]]).collect::<Vec<_>>())
            }
            Kind::Continuous(points) => {
                // Between its own points the spectrum is linear: with these and every nanometre the product is followed closely.
                let lumens = |nm: f64| (nm, self.density(nm) * xyz_of_watt(nm)[1]);
                Self::continuous(Table::new("spectrum", bends(points).into_iter().map(lumens))?)
            }
        }
    }

    /// Lumens per watt.
    pub fn efficacy(&self) -> f64 {
        self.xyz()[1]
    }
}

/// Returns, rising, the wavelengths, nm, between which a table of wavelength and power, and what the eye sees, are both linear: its
/// own points and every whole nanometre, as far as table and observer reach; none where they have no wavelength in common.
fn bends(points: &[[f64; 2]]) -> Vec<f64> {
    let [first, last] = observer_range();
    let seen = points[0][0].max(first)..=points[points.len() - 1][0].min(last);
    let whole = (first as u32..=last as u32).map(f64::from);
    let own = points.iter().map(|p| p[0]);
    let mut nm: Vec<f64> = whole.chain(own).filter(|nm| seen.contains(nm)).collect();
    nm.sort_by(f64::total_cmp);
    nm.dedup();
    nm
}

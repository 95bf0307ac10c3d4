//! The far field of a run, read back from its files.

use super::error::Error;
use super::few_rays::RaySample;
use super::map::IntensityMap;
use std::collections::BTreeMap;

/// Names under which a column may hold an error.
const STATISTICAL: [&str; 2] = ["statistical", "standard_error"];
const GEOMETRIC: &str = "geometric";

/// Columns of luminous intensity as runs write them: by itself, and as the Y of CIE values.
const LUMINOUS: [&str; 2] = ["luminous_intensity_cd", "Y_cd"];

/// Digits to which coordinates of cells are one: centres of neighbours differ by far more.
const SAME_CENTRE_DEG: f64 = 1e-7;

/// The lines of a CSV file that hold something, by their number from 0, the header first.
fn lines_of_cells(text: &str) -> impl Iterator<Item = (usize, &str)> {
    // Comments are allowed, as in other CSV files that the program reads.
    text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'))
}

/// Where the columns of a far field are.
struct Columns {
    /// How many the file has.
    names: usize,
    h: usize,
    v: usize,
    intensity: usize,
    statistical: usize,
    geometric: Option<usize>,
}

impl Columns {
    /// Finds the columns that a header names.
    ///
    /// # Errors
    /// When one but that of geometric errors is missing, or several may be the intensity.
    fn new(header: &str) -> Result<Self, Error> {
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let place = |wanted: &dyn Fn(&str) -> bool| names.iter().position(|n| wanted(n));
        let needed = |place: Option<usize>, name: &str| {
            place.ok_or_else(|| {
                Error::malformed(format!("no column {name}; a far field over H and V (angles A) is needed"))
            })
        };
        let h = needed(place(&|n| n == "H_deg"), "H_deg")?;
        let v = needed(place(&|n| n == "V_deg"), "V_deg")?;
        let intensity = place_of_intensity(&names)?;
        // Of a run in watts the intensity is a channel, with errors of its own beside those of the power.
        let own = |error: &str| place(&|n| n.strip_prefix(names[intensity]).is_some_and(|rest| rest == error));
        let of_channel = own("_standard_error");
        let statistical = of_channel.or_else(|| place(&|n| STATISTICAL.contains(&n)));
        let statistical = needed(statistical, "of standard errors")?;
        let geometric = if of_channel.is_some() { own("_geometric") } else { place(&|n| n == GEOMETRIC) };
        Ok(Self { names: names.len(), h, v, intensity, statistical, geometric })
    }
}

/// Returns the place of the column of luminous intensity among these: one that is named as runs name it, else the only one of candela.
///
/// # Errors
/// When there is none, or there are several.
fn place_of_intensity(names: &[&str]) -> Result<usize, Error> {
    let known = LUMINOUS.iter().find_map(|known| names.iter().position(|name| name == known));
    let candela: Vec<usize> = (0..names.len()).filter(|&k| names[k].ends_with("_cd")).collect();
    match (known, &candela[..]) {
        (Some(place), _) | (None, &[place]) => Ok(place),
        (None, []) => Err(Error::malformed("no column of candela: set `unit = \"lm\"` in [run] and trace again")),
        (None, several) => {
            let several: Vec<&str> = several.iter().map(|&k| names[k]).collect();
            Err(Error::malformed(format!(
                "the columns {} are all in candela: call the luminous intensity {}",
                several.join(", "),
                LUMINOUS[0]
            )))
        }
    }
}

impl IntensityMap {
    /// Makes a map of the text of a far-field receiver's CSV file: columns `H_deg`, `V_deg`, an intensity in cd and its standard error, and
    /// if there is one, its geometric error; a cell a line, in any order. Without that column nothing is known of what facets change: see
    /// [`Self::of_spline`]. Of several columns in cd `luminous_intensity_cd` is read, or else `Y_cd`.
    ///
    /// Angles are taken for those of type A, as regulations have them. Those of a receiver with `angles = "B"` stand under the same names:
    /// the file does not distinguish them.
    ///
    /// `rays` are those of the run, where they are known: what few of them leave open.
    ///
    /// # Errors
    /// When a column is missing, several may be the intensity, a cell stands twice or the cells make no regular grid; the message names the
    /// line where one is at fault.
    pub fn from_csv(text: &str, rays: Option<RaySample>) -> Result<Self, Error> {
        Self::from_csv_over(text, None, rays)
    }

    /// Makes the map of [`Self::from_csv`] with edges, where the results say where the far field lies, that are the run's own to the last
    /// bit: `axes` are middle and half width, degrees, over H and over V. The file has the centres of cells alone, and what is worked out
    /// from these differs by rounding.
    ///
    /// # Errors
    /// As [`Self::from_csv`].
    pub fn from_csv_over(text: &str, axes: Option<[[f64; 2]; 2]>, rays: Option<RaySample>) -> Result<Self, Error> {
        let mut lines = lines_of_cells(text);
        let (_, header) = lines.next().ok_or_else(|| Error::malformed("the file is empty"))?;
        let Columns { names, h, v, intensity, statistical, geometric } = Columns::new(header)?;
        let mut cells: BTreeMap<(i64, i64), [f64; 3]> = BTreeMap::new();
        let [mut columns, mut rows] = [BTreeMap::new(), BTreeMap::new()];
        // Centres as whole numbers: decimals that were written and read must still be equal to be keys.
        let key = |x: f64| (x / SAME_CENTRE_DEG).round() as i64;
        for (number, line) in lines {
            let values: Vec<&str> = line.split(',').map(str::trim).collect();
            let value = |place: usize| -> Result<f64, Error> {
                let text = values.get(place).ok_or_else(|| {
                    let (line, count) = (number + 1, values.len());
                    Error::malformed(format!("line {line}: {count} values, where the header names {names}"))
                })?;
                text.parse().map_err(|_| Error::malformed(format!("line {}: '{text}' is not a number", number + 1)))
            };
            let (centre_h, centre_v) = (value(h)?, value(v)?);
            columns.insert(key(centre_h), centre_h);
            rows.insert(key(centre_v), centre_v);
            let of_facets = geometric.map_or(Ok(0.0), value)?;
            let cell = [value(intensity)?, value(statistical)?, of_facets];
            // Which of two values holds, the file does not say.
            if cells.insert((key(centre_v), key(centre_h)), cell).is_some() {
                let line = number + 1;
                let message = format!("line {line}: the cell at H {centre_h}, V {centre_v} stands twice");
                return Err(Error::malformed(message));
            }
        }
        if cells.is_empty() {
            return Err(Error::malformed("the file has a header and no cells"));
        }
        // A cell that is missing makes the count wrong.
        if cells.len() != columns.len() * rows.len() {
            let needed = columns.len() * rows.len();
            return Err(Error::malformed(format!(
                "the file has {} cells where its {} values of H and {} of V need {needed}: rows are missing, write it anew",
                cells.len(),
                columns.len(),
                rows.len()
            )));
        }
        let edges =
            |axis, centres: BTreeMap<i64, f64>| edges_between(axis, &centres.into_values().collect::<Vec<_>>());
        let mut of_file = [edges("H", columns)?, edges("V", rows)?];
        for (edges, [middle, half]) in of_file.iter_mut().zip(axes.into_iter().flatten()) {
            let stated = even_edges(middle, half, edges.len() - 1);
            // Where they are others, the file is another's: it has the word.
            let agrees = stated.iter().zip(&*edges).all(|(a, b)| (a - b).abs() < 10.0 * SAME_CENTRE_DEG);
            if agrees {
                *edges = stated;
            }
        }
        let [h_edges, v_edges] = of_file;
        let map = Self::new(h_edges, v_edges, cells.into_values().collect())?;
        let map = if geometric.is_some() { map } else { map.without_geometric_errors() };
        Ok(rays.into_iter().fold(map, Self::with_rays))
    }
}

/// Returns the edges of so many cells of equal width, at least one, about a middle.
pub(crate) fn even_edges(middle: f64, half: f64, cells: usize) -> Vec<f64> {
    let step = 2.0 * half / cells as f64;
    (0..=cells).map(|i| middle - half + step * i as f64).collect()
}

/// The edges of cells of equal width from their rising centres, degrees; an error for fewer than two or unequal steps.
fn edges_between(axis: &str, centres: &[f64]) -> Result<Vec<f64>, Error> {
    let [first, .., last] = centres else {
        let message = format!("{axis} has one value: a far field needs at least two cells each way");
        return Err(Error::malformed(message));
    };
    // The mean step: single differences carry the rounding of two decimals.
    let step = (last - first) / (centres.len() - 1) as f64;
    if let Some(c) = centres.windows(2).find(|c| (c[1] - c[0] - step).abs() > 10.0 * SAME_CENTRE_DEG) {
        return Err(Error::malformed(format!(
            "the cells along {axis} are not of equal width: {step:.3}° on average, but {:.3}° from {} to {}; trace a far field with one \
             width of cells",
            c[1] - c[0],
            c[0],
            c[1]
        )));
    }
    Ok((0..=centres.len()).map(|k| first + step * (k as f64 - 0.5)).collect())
}

#[cfg(test)]
mod tests {
    use super::super::opening::Sensor;
    use super::*;

    #[test]
    fn the_file_of_a_receiver_is_read_in_any_order() {
        let text = "H_deg,V_deg,luminous_intensity_cd,standard_error,geometric\n\
                    0.05,0.05,4,0.4,0.04\n-0.05,0.05,3,0.3,0.03\n-0.05,-0.05,1,0.1,0.01\n0.05,-0.05,2,0.2,0.02\n";
        let map = IntensityMap::from_csv(text, None).unwrap();
        let cell = |h: f64, v: f64| map.read(&map.measure(Sensor { half_deg: 0.04, round: false }, h, v).unwrap());
        assert_eq!(
            (cell(0.05, -0.05).value, cell(-0.05, 0.05).statistical, cell(0.05, 0.05).geometric),
            (2.0, 0.3, Some(0.04))
        );
        // Without their column nothing is known of what facets change, but on the spline.
        let unknown: String = text.lines().map(|l| l.rsplit_once(',').unwrap().0.to_owned() + "\n").collect();
        let unknown = IntensityMap::from_csv(&unknown, None).unwrap();
        let geometric = |map: IntensityMap| {
            map.read(&map.measure(Sensor { half_deg: 0.04, round: false }, 0.05, 0.05).unwrap()).geometric
        };
        assert_eq!((geometric(unknown.clone()), geometric(unknown.of_spline())), (None, Some(0.0)));
        // A ray of 1e-6 lm is 0.33 cd in a cell of (0.1°)², of which 6.7 may not have come.
        let dark = text.replace("-0.05,-0.05,1,0.1", "-0.05,-0.05,0,0.4");
        let rays = RaySample { heaviest_flux: 1e-6, replicates: 200 };
        let dark = IntensityMap::from_csv(&dark, Some(rays)).unwrap();
        let weights = dark.measure(Sensor { half_deg: 0.04, round: false }, -0.05, -0.05).unwrap();
        let reach = dark.noise(&weights, 1.0, 1e-3, 3.0).reach(3.0, 1.0);
        assert!((reach / (6.74 * 1e-6 / 0.1f64.to_radians().powi(2)) - 1.0).abs() < 1e-2, "{reach}");
        assert_eq!(dark.read(&weights).statistical, 0.0);
    }

    /// Of 135 cells over 20° the centres are no round numbers: edges worked out from them alone differ in their last digits.
    #[test]
    fn edges_are_those_of_the_run_to_the_last_bit() {
        let axes = [[0.25, 10.0], [0.0, 7.0]];
        let stated = axes.map(|[middle, half]| even_edges(middle, half, 135));
        let centre = |k: usize, i: usize| 0.5 * (stated[k][i] + stated[k][i + 1]);
        let mut text = "H_deg,V_deg,luminous_intensity_cd,standard_error\n".to_owned();
        for (i, j) in (0..135).flat_map(|j| (0..135).map(move |i| (i, j))) {
            text += &format!("{},{},{},0.1\n", centre(0, i), centre(1, j), i + j);
        }
        let [h, v] = stated.clone();
        let cells = (0..135).flat_map(|j| (0..135).map(move |i| [(i + j) as f64, 0.1, 0.0])).collect();
        let own = IntensityMap::new(h, v, cells).unwrap();
        let read = |map: &IntensityMap| {
            map.read(&map.measure(Sensor { half_deg: 0.3, round: true }, 1.234, -2.345).unwrap()).value
        };
        let again = IntensityMap::from_csv_over(&text, Some(axes), None).unwrap();
        assert_eq!((again.extent(), read(&again)), (own.extent(), read(&own)));
        // Of a place that is not the file's nothing is taken.
        let elsewhere = IntensityMap::from_csv_over(&text, Some([[3.0, 10.0], [0.0, 7.0]]), None).unwrap();
        assert!((elsewhere.extent()[0][0] + 9.75).abs() < 1e-9);
    }

    #[test]
    fn a_channel_is_read_with_its_own_errors() {
        let header = "H_deg,V_deg,radiant_intensity_W_per_sr,standard_error,luminous_intensity_cd,\
                      luminous_intensity_cd_standard_error,statistical,geometric,luminous_intensity_cd_geometric\n";
        let cells = ["0,0", "1,0", "0,1", "1,1"].map(|at| format!("{at},0.5,0.05,300,30,0.05,0.01,6\n")).concat();
        let map = IntensityMap::from_csv(&format!("{header}{cells}"), None).unwrap();
        let read = map.read(&map.measure(Sensor { half_deg: 0.2, round: false }, 0.0, 0.0).unwrap());
        // One cell alone: its weight is 1 to rounding.
        for (found, expected) in [(read.value, 300.0), (read.statistical, 30.0), (read.geometric.unwrap(), 6.0)] {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    /// Of CIE values Y is the luminous intensity, and X stands first.
    #[test]
    fn of_cie_values_the_second_is_read() {
        let header = "H_deg,V_deg,radiant_intensity_W_per_sr,standard_error,X_cd,X_cd_standard_error,Y_cd,Y_cd_standard_error,Z_cd,\
                      Z_cd_standard_error\n";
        let cells = ["0,0", "1,0", "0,1", "1,1"].map(|at| format!("{at},0.5,0.05,100,10,300,30,900,90\n")).concat();
        let map = IntensityMap::from_csv(&format!("{header}{cells}"), None).unwrap();
        let read = map.read(&map.measure(Sensor { half_deg: 0.2, round: false }, 0.0, 0.0).unwrap());
        assert!((read.value - 300.0).abs() < 1e-9 && (read.statistical - 30.0).abs() < 1e-9, "{}", read.value);
    }

    #[test]
    fn what_is_no_far_field_is_refused() {
        for (text, message) in [
            ("", "empty"),
            ("x_mm,y_mm,illuminance_lx,standard_error\n1,2,3,4\n", "H_deg"),
            ("H_deg,V_deg,luminous_intensity_cd,standard_error\n0,0,1,x\n", "line 2"),
            (
                "H_deg,V_deg,luminous_intensity_cd,standard_error\n0,0,1,1\n1,0,1,1\n0,1,1,1\n",
                "3 cells where its 2 values of H and 2 of V need 4",
            ),
            ("H_deg,V_deg,i_cd,standard_error\n0,0,1,1\n1,0,1,1\n0,1,1,1\n1,1,1,1\n1,0,2,1\n", "line 6"),
            (
                "H_deg,V_deg,i_cd,standard_error\n0,0,1,1\n1,0,1,1\n3,0,1,1\n0,1,1,1\n1,1,1,1\n3,1,1,1\n",
                "along H are not of equal width: 1.500° on average, but 1.000° from 0 to 1",
            ),
            ("H_deg,V_deg,i_cd,standard_error\n0,0,1,1\n1,0,1,1\n", "V has one value"),
            ("H_deg,V_deg,radiant_intensity_W_per_sr,standard_error\n0,0,1,1\n", "unit = \"lm\""),
            ("H_deg,V_deg,i_cd,standard_error\n", "no cells"),
            ("H_deg,V_deg,a_cd,b_cd,standard_error\n0,0,1,1,1\n", "a_cd, b_cd are all in candela"),
            ("H_deg,V_deg,i_cd,standard_error\n0,0,1,1\n1,0,NaN,1\n0,1,1,1\n1,1,1,1\n", "finite"),
        ] {
            let error = IntensityMap::from_csv(text, None).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }
}

//! Luminous intensity in the EULUMDAT format (`.ldt`), by the `eulumdat` crate.

use super::input::read_bytes;
use super::photometry::SAME_ANGLE_DEG;
use super::{Error, ErrorKind, PhotometricType, Photometry, write_atomic};
use eulumdat::{Eulumdat, LampSet, Symmetry, TypeIndicator};
use std::ops::Range;
use std::path::Path;

/// Reads an EULUMDAT file. Intensities become candela by the flux of the first set of lamps and the file's conversion factor.
///
/// # Errors
/// When the file cannot be read or is not EULUMDAT.
pub fn read_eulumdat(path: &Path) -> Result<Photometry, Error> {
    // Old files hold Latin-1 in their names; the numbers are ASCII in any case.
    let bytes = read_bytes(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    parse_eulumdat(path, &String::from_utf8_lossy(&bytes))
}

/// Lines of a file, from 0, that hold numbers which a luminaire may lack: dimensions, shares of the flux, conversion factor, tilt.
const OPTIONAL_NUMBERS: Range<usize> = 12..25;

/// Returns the text with 0 on those of its lines of [`OPTIONAL_NUMBERS`] that are blank, as some programs leave them.
fn fill_blank_numbers(text: &str) -> String {
    let number = |(k, line)| if OPTIONAL_NUMBERS.contains(&k) && str::trim(line).is_empty() { "0" } else { line };
    text.lines().enumerate().map(number).collect::<Vec<_>>().join("\n")
}

/// Returns the error of text that the `eulumdat` crate cannot read, at the line that its message names.
fn parse_error(path: &Path, message: &str) -> Error {
    let place = message.strip_prefix("Parse error at line ").and_then(|m| m.split_once(": "));
    match place.and_then(|(line, said)| Some((line.parse::<usize>().ok()?, said))) {
        // The crate counts lines from 0.
        Some((line, said)) => Error::at_line(path, line + 1, format!("not EULUMDAT: {said}")),
        None => Error::new(path, ErrorKind::Malformed(format!("not EULUMDAT: {message}"))),
    }
}

/// Returns the C-planes that a file holds, degrees, in its order; for the plane C90–C270 it starts at C270.
///
/// # Errors
/// When they do not fit the symmetry, in words.
fn stored_planes(ldt: &Eulumdat) -> Result<Vec<f64>, &'static str> {
    let count = ldt.intensities.len();
    let stored: Vec<f64> = match ldt.symmetry {
        Symmetry::VerticalAxis => vec![0.0],
        Symmetry::PlaneC90C270 => {
            let first = ldt.c_angles.iter().position(|c| (c - 270.0).abs() < SAME_ANGLE_DEG);
            let first = first.ok_or("no C-plane is at 270°, where symmetry 3 begins")?;
            // From −90 (C270) through C0 to C90, behind the last plane going on with the first.
            let planes = ldt.c_angles.iter().cycle().skip(first).take(count);
            planes.map(|&c| if c > 180.0 { c - 360.0 } else { c }).collect()
        }
        _ => ldt.c_angles.iter().copied().take(count).collect(),
    };
    if stored.len() != count || stored.iter().chain(&ldt.g_angles).any(|a| !a.is_finite()) {
        return Err("the C-planes do not fit the symmetry the file states");
    }
    Ok(stored)
}

/// Reads EULUMDAT text; `path` is for messages alone.
///
/// # Errors
/// As [`read_eulumdat`].
pub fn parse_eulumdat(path: &Path, text: &str) -> Result<Photometry, Error> {
    let malformed = |m: String| Error::new(path, ErrorKind::Malformed(m));
    let ldt = Eulumdat::parse(&fill_blank_numbers(text)).map_err(|e| parse_error(path, &e.to_string()))?;
    let (n, rows) = (ldt.num_c_planes, ldt.g_angles.len());
    if n == 0 || rows < 2 || ldt.intensities.is_empty() {
        return Err(malformed("the file holds no intensities; check the numbers of C-planes and γ angles".into()));
    }
    let stored = stored_planes(&ldt).map_err(|m| malformed(m.into()))?;
    let first = ldt.lamp_sets.first();
    if let Some(flux) = first.map(|s| s.total_luminous_flux).filter(|flux| *flux < 0.0) {
        return Err(malformed(format!("its lamps have a flux of {flux} lm, which must be zero or more")));
    }
    // Zero lumens stand in files without a lamp; intensities then are taken for a lamp of 1000 lm, which leaves
    // them as written.
    let lumens = first.map(|s| s.total_luminous_flux).filter(|f| *f > 0.0);
    // A negative number of lamps marks absolute photometry, whose flux is that of the luminaire.
    let absolute = first.is_some_and(|s| s.num_lamps < 0);
    // Intensities are in candela per kilolumen of the lamps.
    let to_candela =
        lumens.unwrap_or(1000.0) / 1000.0 * if ldt.conversion_factor > 0.0 { ldt.conversion_factor } else { 1.0 };
    let mut planes: Vec<(f64, &[f64])> =
        stored.iter().copied().zip(ldt.intensities.iter().map(Vec::as_slice)).collect();
    if ldt.symmetry == Symmetry::PlaneC90C270 {
        // As LM-63 has it: from C90 through C180 to C270, mirrored in the plane.
        planes.iter_mut().for_each(|p| p.0 = 180.0 - p.0);
        planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let ascending = |a: &[f64]| a.windows(2).all(|p| p[0] < p[1]);
    let horizontal_deg: Vec<f64> = planes.iter().map(|p| p.0).collect();
    // Interpolation divides by the step between neighbours.
    if !ascending(&horizontal_deg) || !ascending(&ldt.g_angles) {
        return Err(malformed("C-planes and γ angles must ascend".into()));
    }
    let candela: Vec<f64> = planes.iter().flat_map(|p| p.1).map(|c| c * to_candela).collect();
    if let Some(bad) = candela.iter().find(|c| !(**c >= 0.0 && c.is_finite())) {
        return Err(malformed(format!("an intensity of {bad} cd; intensities must be zero or more")));
    }
    let keyword =
        |name: &str, value: &str| (!value.trim().is_empty()).then(|| (name.to_owned(), value.trim().to_owned()));
    let keywords = [
        keyword("MANUFAC", &ldt.identification),
        keyword("TEST", &ldt.measurement_report_number),
        keyword("LUMINAIRE", &ldt.luminaire_name),
        keyword("LUMCAT", &ldt.luminaire_number),
        keyword("ISSUEDATE", &ldt.date_user),
    ];
    Ok(Photometry {
        kind: PhotometricType::C,
        horizontal_deg,
        vertical_deg: ldt.g_angles,
        candela,
        lamp_lumens: if absolute { None } else { lumens },
        watts: first.map_or(0.0, |s| s.wattage_with_ballast),
        opening_mm: [ldt.luminous_area_width, ldt.luminous_area_length, ldt.height_c0],
        keywords: keywords.into_iter().flatten().collect(),
    })
}

/// Writes an EULUMDAT file: all C-planes, without symmetry, or the one plane of a rotational distribution.
///
/// Numbers have six decimals. Absolute photometry is written with the flux of the distribution itself and −1 lamps.
///
/// # Errors
/// When the photometry is not of type C, has no planes, does not cover whole turns, or the file cannot be written.
pub fn write_eulumdat(path: &Path, p: &Photometry) -> Result<(), Error> {
    let malformed = |m: &str| Error::new(path, ErrorKind::Malformed(m.into()));
    if p.kind != PhotometricType::C {
        return Err(malformed("EULUMDAT holds type C photometry alone; write types A and B as .ies"));
    }
    if p.horizontal_deg.is_empty() {
        return Err(malformed("there are no planes to write"));
    }
    // One plane is rotational already; to expand it would write the same plane twice.
    let all = if p.horizontal_deg.len() == 1 { p.clone() } else { p.expanded() };
    let rows = all.vertical_deg.len();
    let rotational = all.horizontal_deg.len() == 1;
    if !rotational && (all.horizontal_deg[0] != 0.0 || all.horizontal_deg[all.horizontal_deg.len() - 1] != 360.0) {
        return Err(malformed("EULUMDAT needs C-planes over the whole turn, from 0 to 360 degrees"));
    }
    if all.candela.len() != rows * all.horizontal_deg.len() || rows < 2 {
        return Err(malformed("the intensities do not fill the planes"));
    }
    // A reader would take `NaN` or `inf` for text.
    let numbers = all.vertical_deg.iter().chain(&all.horizontal_deg).chain(&all.candela);
    if numbers.chain(p.opening_mm.iter()).chain([&p.watts]).chain(&p.lamp_lumens).any(|x| !x.is_finite()) {
        return Err(malformed(
            "an intensity, angle, lumen, watt or length is no finite number; EULUMDAT holds none such",
        ));
    }
    // The format ends lines as DOS does.
    let text = eulumdat_of(p, &all).to_ldt().replace('\n', "\r\n");
    write_atomic(path, |w| w.write_all(text.as_bytes()))
}

/// Returns photometry as the format has it; `all` are its intensities over the whole turn, or in the one plane of a rotational one.
fn eulumdat_of(p: &Photometry, all: &Photometry) -> Eulumdat {
    let rows = all.vertical_deg.len();
    let rotational = all.horizontal_deg.len() == 1;
    // The last plane, at 360°, is the first one again.
    let planes = if rotational { 1 } else { all.horizontal_deg.len() - 1 };
    let lumens = p.lamp_lumens.unwrap_or_else(|| p.flux());
    // Dark luminaires have no flux to refer to.
    let per_klm = if lumens > 0.0 { 1000.0 / lumens } else { 1.0 };
    // The format has a field for the step of the angles, zero where they are uneven.
    let even = |a: &[f64]| {
        let step = a[1] - a[0];
        if a.windows(2).all(|p| (p[1] - p[0] - step).abs() < SAME_ANGLE_DEG) { step } else { 0.0 }
    };
    let find = |name: &str| {
        // A line end in a name would shift all lines that follow: the format counts them.
        all.keywords.iter().find(|k| k.0 == name).map_or(String::new(), |k| k.1.replace(['\n', '\r'], " "))
    };
    let mut ldt = Eulumdat::new();
    ldt.identification = find("MANUFAC");
    ldt.type_indicator =
        if rotational { TypeIndicator::PointSourceSymmetric } else { TypeIndicator::PointSourceOther };
    ldt.symmetry = if rotational { Symmetry::VerticalAxis } else { Symmetry::None };
    ldt.num_c_planes = planes;
    ldt.c_plane_distance = if rotational { 0.0 } else { even(&all.horizontal_deg) };
    ldt.num_g_planes = rows;
    ldt.g_plane_distance = even(&all.vertical_deg);
    ldt.measurement_report_number = find("TEST");
    ldt.luminaire_name = find("LUMINAIRE");
    ldt.luminaire_number = find("LUMCAT");
    ldt.date_user = find("ISSUEDATE");
    let [width, length, height] = all.opening_mm.map(f64::abs);
    (ldt.luminous_area_width, ldt.luminous_area_length, ldt.height_c0) = (width, length, height);
    // The size of the luminaire is not known; that of its opening stands in for it.
    (ldt.width, ldt.length, ldt.height) = (width, length, height);
    // Of a dark luminaire neither share has a meaning; the format has no word for that.
    let share = |part: f64, whole: f64| if whole > 0.0 { 100.0 * part / whole } else { 100.0 };
    ldt.light_output_ratio = share(p.flux(), lumens);
    ldt.downward_flux_fraction = share(p.downward_flux(), p.flux());
    ldt.conversion_factor = 1.0;
    ldt.lamp_sets = vec![LampSet {
        num_lamps: if p.lamp_lumens.is_some() { 1 } else { -1 },
        lamp_type: "lamp".into(),
        total_luminous_flux: lumens,
        wattage_with_ballast: p.watts,
        ..LampSet::default()
    }];
    ldt.c_angles = all.horizontal_deg[..planes].to_vec();
    ldt.g_angles = all.vertical_deg.clone();
    ldt.intensities =
        all.candela.chunks(rows).take(planes).map(|r| r.iter().map(|c| c * per_klm).collect()).collect();
    ldt
}

#[cfg(test)]
mod tests {
    use super::super::photometry::tests::{photometry_of, steps};
    use super::*;

    fn round_trip(p: &Photometry) -> Photometry {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ldt");
        write_eulumdat(&path, p).unwrap();
        read_eulumdat(&path).unwrap()
    }

    #[test]
    fn photometry_without_planes_is_refused() {
        let none = Photometry {
            horizontal_deg: vec![],
            candela: vec![],
            ..photometry_of(PhotometricType::C, &[0.0], &[0.0, 90.0], |_, _| 1.0)
        };
        let folder = tempfile::tempdir().unwrap();
        let error = write_eulumdat(&folder.path().join("a.ldt"), &none).unwrap_err();
        assert!(error.to_string().contains("no planes"), "{error}");
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let good = photometry_of(PhotometricType::C, &[0.0], &[0.0, 90.0], |_, _| 1.0);
        for bad in [f64::NAN, f64::INFINITY] {
            for wrong in [
                Photometry { candela: vec![1.0, bad], ..good.clone() },
                Photometry { watts: bad, ..good.clone() },
                Photometry { lamp_lumens: Some(bad), ..good.clone() },
                Photometry { opening_mm: [0.0, bad, 0.0], ..good.clone() },
            ] {
                for name in ["a.ldt", "a.ies"] {
                    let path = folder.path().join(name);
                    let write = if name == "a.ldt" { write_eulumdat } else { crate::formats::write_ies };
                    let error = write(&path, &wrong).unwrap_err().to_string();
                    assert!(error.contains("finite") && !path.exists(), "{name}: {error}");
                }
            }
        }
    }

    #[test]
    fn intensities_survive_to_the_formats_precision() {
        let cases = [
            Photometry {
                lamp_lumens: Some(2500.0),
                ..photometry_of(PhotometricType::C, &steps(0.0, 360.0, 24), &steps(0.0, 90.0, 18), |h, v| {
                    500.0 + (h - 180.0).abs() - v
                })
            },
            photometry_of(PhotometricType::C, &steps(0.0, 90.0, 6), &steps(0.0, 180.0, 36), |h, v| 500.0 + h - v),
            photometry_of(PhotometricType::C, &[0.0], &steps(0.0, 90.0, 18), |_, v| 800.0 - v),
        ];
        for p in &cases {
            let back = round_trip(p);
            let (a, b) = (p.expanded(), back.expanded());
            assert_eq!((&a.horizontal_deg, &a.vertical_deg), (&b.horizontal_deg, &b.vertical_deg));
            let worst = a.candela.iter().zip(&b.candela).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            // Half a unit of the sixth decimal of cd/klm, and the same of the flux.
            assert!(worst < 1e-6 * p.flux().max(2500.0) / 1000.0, "{worst}");
            assert_eq!(back.lamp_lumens.is_some(), p.lamp_lumens.is_some());
            assert!((back.flux() / p.flux() - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn the_plane_c90_c270_is_mirrored_as_the_format_means_it() {
        // Eight planes, even or not; C270 to C90 through C0 are stored: intensities 100 + index.
        let parse = |planes: [i32; 8]| {
            let mut lines: Vec<String> =
                ["x", "3", "3", "8", "45", "2", "90", "", "", "", "", ""].map(String::from).into();
            lines.extend((0..9).map(|_| "0".into()));
            lines.extend(["100", "100", "1", "0", "1", "1", "lamp", "1000", "", "", "10"].map(String::from));
            lines.extend((0..10).map(|_| "1".into()));
            lines.extend(planes.map(|c| c.to_string()));
            lines.extend(["0", "90"].map(String::from));
            for i in 0..5 {
                lines.extend([(100 + i).to_string(), "0".into()]);
            }
            parse_eulumdat(Path::new("a.ldt"), &lines.join("\n"))
        };
        for step in [30, 45] {
            let p = parse([0, step, 90, 180 - step, 180, 180 + step, 270, 360 - step]).unwrap().expanded();
            let at = |c: i32| p.candela[2 * p.horizontal_deg.iter().position(|&h| h == f64::from(c)).unwrap()];
            assert_eq!([270, 360 - step, 0, step, 90].map(at), [100.0, 101.0, 102.0, 103.0, 104.0]);
            assert_eq!([180 + step, 180, 180 - step].map(at), [101.0, 102.0, 103.0]);
        }
        assert!(parse([0, 1, 2, 3, 4, 5, 6, 7]).unwrap_err().to_string().contains("270"));
    }

    #[test]
    fn blank_numbers_are_zero_and_faults_name_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ldt");
        let p = photometry_of(PhotometricType::C, &[0.0], &steps(0.0, 90.0, 3), |_, v| 800.0 - v);
        write_eulumdat(&path, &p).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let with = |line: usize, put: &str| {
            let lines = text.lines().enumerate().map(|(k, l)| if k + 1 == line { put } else { l });
            parse_eulumdat(&path, &lines.collect::<Vec<_>>().join("\n"))
        };
        for optional in [13, 25] {
            assert_eq!(with(optional, "").unwrap().candela, with(optional, "0").unwrap().candela);
        }
        for line in [2, 23] {
            let error = with(line, "wide").unwrap_err().to_string();
            assert!(error.contains(&format!("a.ldt:{line}: ")) && error.contains("'wide'"), "{error}");
        }
        let error = with(29, "-500").unwrap_err().to_string();
        assert!(error.contains("-500 lm"), "{error}");
    }

    /// Of equal light everywhere half goes down, of a lamp of twice the flux half comes out.
    #[test]
    fn shares_of_the_flux_are_those_of_the_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ldt");
        // With a row at the horizontal plane, and with rows on both sides of it.
        for rows in [4, 5] {
            for planes in [vec![0.0], steps(0.0, 360.0, 4)] {
                let p = photometry_of(PhotometricType::C, &planes, &steps(0.0, 180.0, rows), |_, _| 100.0);
                let twice = Photometry { lamp_lumens: Some(2.0 * p.flux()), ..p };
                write_eulumdat(&path, &twice).unwrap();
                let text = std::fs::read_to_string(&path).unwrap();
                assert_eq!(text.matches('\n').count(), text.matches("\r\n").count());
                let ldt = Eulumdat::parse(&text).unwrap();
                let [down, out] = [ldt.downward_flux_fraction, ldt.light_output_ratio];
                assert!((down - 50.0).abs() < 0.01 && (out - 50.0).abs() < 0.01, "{rows}: {down} {out}");
            }
        }
        let below = photometry_of(PhotometricType::C, &[0.0], &steps(0.0, 90.0, 5), |_, v| 100.0 - v);
        assert!((below.downward_flux() / below.flux() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_said_is_refused() {
        let path = Path::new("/tmp/x.ldt");
        let beam = photometry_of(PhotometricType::A, &[-1.0, 1.0], &[-1.0, 1.0], |_, _| 1.0);
        assert!(write_eulumdat(path, &beam).unwrap_err().to_string().contains("type C"));
        let part = photometry_of(PhotometricType::C, &[10.0, 20.0], &[0.0, 90.0], |_, _| 1.0);
        assert!(write_eulumdat(path, &part).unwrap_err().to_string().contains("whole turn"));
        for text in ["", "x\n1\n1\n-5\n0\n-7\n", "a\n1\n1\n1e30\n0\n1e30\n0\n"] {
            assert!(parse_eulumdat(path, text).is_err());
        }
    }

    #[test]
    fn damaged_files_are_refused_or_read_but_never_panic() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ldt");
        write_eulumdat(
            &path,
            &photometry_of(PhotometricType::C, &steps(0.0, 360.0, 4), &[0.0, 90.0], |_, v| 90.0 - v),
        )
        .unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        for cut in 0..text.len() {
            let _ = parse_eulumdat(&path, &text[..cut]);
            for byte in ["-", "9", "e", ".", "\n", "\u{0}"] {
                let changed = format!("{}{byte}{}", &text[..cut], &text[cut + 1..]);
                if let Ok(p) = parse_eulumdat(&path, &changed) {
                    let _ = (p.expanded(), p.flux());
                }
            }
        }
    }
}

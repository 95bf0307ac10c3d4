//! Glass catalogues in AGF form: what a data sheet says comes out of a scene.

use crate::support::World;
use lampyris::math::{Point, Vector};
use lampyris::simulate::Scene;
use std::path::Path;

/// Two glasses of Schott's in the layout of the form, one with the older formula, and one of a formula that is not read.
const CATALOGUE: &str = "CC a catalogue of three glasses\n\
    NM N-BK7 2 517642.251 1.5168 64.17 0 1\n\
    ED 7.1 8.3 2.51 -0.0009 0\n\
    CD 1.03961212E+000 6.00069867E-003 2.31792344E-001 2.00179144E-002 1.01046945E+000 1.03560653E+002\n\
    LD 3.0000E-001 2.5000E+000\n\
    IT 4.00000E-001 9.97000E-001 1.00000E+001\n\
    IT 7.00000E-001 9.98000E-001 1.00000E+001\n\
    NM BK7 1 517642.251 1.5168 64.17 0 1\n\
    CD 2.2718929E+000 -1.0108077E-002 1.0592509E-002 2.0816965E-004 -7.6472538E-006 4.9240991E-007\n\
    LD 3.6500E-001 1.0140E+000\n\
    NM ODD 4 0 1.5 60\n\
    CD 1.5 0.01 0.0005\n";

fn scene(medium: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("glasses.agf"), CATALOGUE).unwrap();
    let text = format!("[[medium]]\nname = 'glass'\nfile = 'glasses.agf'\n{medium}\n");
    Scene::parse(&text, "test.toml", folder.path()).map_err(|e| e.to_string())
}

/// R = ((n − 1)/(n + 1))² at both faces of a plate 10 mm thick, T = 0.997 inside at 400 nm: the first way through brings (1 − R)² T.
#[test]
fn a_plate_of_a_catalogue_transmits_what_its_data_sheet_says() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("glasses.agf"), CATALOGUE).unwrap();
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 10.0));
    // n at 400 nm by the data sheet's coefficients, worked out beside this program.
    for (name, nm, n, inside) in [("n-bk7", 400.0, 1.530849, 0.997), ("BK7", 587.5618, 1.516800, 1.0)] {
        let text = format!(
            "[run]\nrays = 2000\nwavelength_nm = {nm}\ninterfaces = 'split'\nsplit_floor = 0\nsequences = 1\n\
             [[medium]]\nname = 'glass'\nfile = '{}'\ncatalogue = '{name}'\n[[material]]\npart = 'plate'\nmedium = 'glass'\n\
             [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\ndirection = [0, 0, 1]\nradius = 2\n\
             [[receiver]]\nname = 'behind'\nat = [0, 0, 20]\nsize = [9, 9]\n",
            folder.path().join("glasses.agf").display()
        );
        let found = world.run(&text, |_| ());
        let r = ((n - 1.0) / (n + 1.0f64)).powi(2);
        let power = found.sequences[0].first[0].power;
        assert!((power - (1.0 - r).powi(2) * inside).abs() < 2e-6, "{name}: {power}");
    }
}

/// Sheets print 0 for glass that lets nothing through; one line of transmittance holds for all light.
#[test]
fn glass_absorbs_by_whatever_its_sheet_says() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("g.agf");
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 10.0));
    for (lines, inside) in [
        ("IT 0.4 0 25\nIT 0.7 0 25\n", 0.0),
        ("IT 0.4 0.9 25\nIT 0.55 0 25\nIT 0.7 0.9 25\n", 0.0),
        ("IT 0.4 0 25\n", 0.0),
        // Half of it over 5 mm is a quarter over 10.
        ("IT 0.4 0.5 5\n", 0.25),
        ("", 1.0),
    ] {
        // n = 1.5 by Conrady's formula of one term.
        std::fs::write(&file, format!("NM G 5 0 1.5 60\nCD 1.5\n{lines}")).unwrap();
        let text = format!(
            "[run]\nrays = 2000\nwavelength_nm = 550\ninterfaces = 'split'\nsplit_floor = 0\n\
             [[medium]]\nname = 'glass'\nfile = '{}'\ncatalogue = 'G'\n[[material]]\npart = 'plate'\nmedium = 'glass'\n\
             [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\ndirection = [0, 0, 1]\nradius = 2\n\
             [[receiver]]\nname = 'behind'\nat = [0, 0, 20]\nsize = [9, 9]\n",
            file.display()
        );
        let power = world.run(&text, |_| ()).receivers[0].power;
        // Light that is reflected to and fro in the plate sums up as a geometric series.
        let (r, t): (f64, f64) = (0.04, inside);
        let expected = (1.0 - r).powi(2) * t / (1.0 - (r * t).powi(2));
        // A millionth over 25 mm is 4e-3 over 10, which a zero may leave.
        let slack = if inside == 0.0 { 5e-3 } else { 1e-6 };
        assert!((power - expected).abs() < slack, "{lines}: {power} for {expected}");
    }
    std::fs::write(&file, "NM G 5 0 1.5 60\nCD 1.5\nIT 0.4 nan 25\n").unwrap();
    let text = format!("[[medium]]\nname = 'g'\nfile = '{}'\ncatalogue = 'G'\n", file.display());
    let message = Scene::parse(&text, "t.toml", Path::new(".")).unwrap_err().to_string();
    assert!(message.contains("'nan' is no number"), "{message}");
}

/// A file's own range counts, its `LD` line: 365 to 1014 nm of the older glass.
#[test]
fn light_beyond_the_range_of_a_glass_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("glasses.agf"), CATALOGUE).unwrap();
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 10.0));
    let notes = |nm: f64| {
        let text = format!(
            "[run]\nwavelength_nm = {nm}\n[[medium]]\nname = 'glass'\nfile = 'glasses.agf'\ncatalogue = 'BK7'\n\
             [[material]]\npart = 'plate'\nmedium = 'glass'\n[[source]]\nkind = 'collimated'\nat = [0, 0, -5]\n"
        );
        Scene::parse(&text, "test.toml", folder.path()).unwrap().bind(&world.model).unwrap().notes().to_vec()
    };
    assert!(notes(1000.0).is_empty(), "{:?}", notes(1000.0));
    let beyond = notes(1064.0).join("\n");
    assert!(beyond.contains("'BK7' is known for 365 to 1014 nm") && beyond.contains("1064 nm"), "{beyond}");
}

/// N-BK7 of the file has its transmittance at 400 and 700 nm, its index from 300 to 2500 nm.
#[test]
fn light_beyond_the_transmittances_of_a_glass_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("glasses.agf"), CATALOGUE).unwrap();
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 10.0));
    let notes = |nm: f64, absorption: &str| {
        let text = format!(
            "[run]\nwavelength_nm = {nm}\n[[medium]]\nname = 'glass'\nfile = 'glasses.agf'\ncatalogue = 'N-BK7'\n{absorption}\n\
             [[material]]\npart = 'plate'\nmedium = 'glass'\n[[source]]\nkind = 'collimated'\nat = [0, 0, -5]\n"
        );
        Scene::parse(&text, "test.toml", folder.path()).unwrap().bind(&world.model).unwrap().notes().join("\n")
    };
    let beyond = notes(850.0, "");
    let said = "the transmittance of 'N-BK7' is known for 400 to 700 nm";
    assert!(beyond.contains(said) && beyond.contains("850 nm") && beyond.lines().count() == 1, "{beyond}");
    assert_eq!((notes(650.0, ""), notes(850.0, "absorption_per_mm = 0.001")), (String::new(), String::new()));
}

/// Eight tables that light goes beyond are named; beyond them only the number is given.
#[test]
fn many_ranges_that_light_goes_beyond_are_counted() {
    for (count, rest) in [(8, None), (9, Some("beyond 1 more range of")), (10, Some("beyond 2 more ranges of"))] {
        let mut world = World::default();
        let mut text = "[run]\nwavelength_nm = 700\n[[source]]\nkind = 'collimated'\nat = [0, 0, -5]\n".to_owned();
        for k in 0..count {
            let low = Point::new(20.0 * f64::from(k), 0.0, 0.0);
            world.cuboid(&format!("p{k}"), low, low + Vector::splat(10.0));
            text += &format!("[[medium]]\nname = 'm{k}'\nindex_table = [[500, 1.5], [600, 1.49]]\n");
            text += &format!("[[material]]\npart = 'p{k}'\nmedium = 'm{k}'\n");
        }
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let notes = scene.bind(&world.model).unwrap().notes().to_vec();
        assert_eq!(notes.iter().filter(|note| note.contains("is known for 500 to 600 nm")).count(), 8, "{notes:?}");
        assert_eq!(notes.len(), 8 + rest.iter().count(), "{notes:?}");
        assert!(rest.is_none_or(|rest| notes[8].contains(rest)), "{notes:?}");
    }
}

#[test]
fn what_a_catalogue_does_not_hold_is_named() {
    assert!(scene("catalogue = 'N-BK7'").is_ok());
    for (medium, words) in [
        ("catalogue = 'N-BK8'", "N-BK7"),
        ("", "the name of a glass"),
        ("catalogue = 'ODD'", "dispersion formula 4"),
    ] {
        let message = scene(medium).unwrap_err();
        assert!(message.contains(words), "{message}");
    }
    let missing = Scene::parse("[[medium]]\nname = 'x'\nfile = 'none.agf'\ncatalogue = 'y'\n", "t", Path::new("."));
    assert!(missing.unwrap_err().to_string().contains("none.agf"));
}

/// The formulas that whole catalogues of other makers use, with made-up coefficients; n at 500 nm by an evaluation beside this program.
#[test]
fn every_formula_gives_its_index() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("g.agf");
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 10.0));
    for (formula, coefficients, n) in [
        (3, "1.9 0.02 0.003 -0.004 0.0002 -1e-05", 2.049974116),
        (5, "1.5 0.01 0.0005", 1.525656854),
        (7, "2.7 0.02 0.015 0.01", 1.668114619),
        (8, "1.3 1.2 0.012 0.008", 1.599532495),
        (9, "1.5 0.9 0.01 0.8 90", 1.560535673),
        (10, "2.2 -0.01 0.011 0.0002 -7e-06 5e-07 2e-08 -1e-09", 1.498130964),
        (12, "2.2 -0.01 0.011 0.0002 -7e-06 5e-07 -0.0003 2e-05", 1.498119342),
        (13, "2.2 -0.01 -0.0002 0.011 0.0002 -7e-06 5e-07 2e-08 -1e-09", 1.498126792),
    ] {
        std::fs::write(&file, format!("NM G {formula} 0 1.5 60\nCD {coefficients}\n")).unwrap();
        let text = format!(
            "[run]\nrays = 100\nwavelength_nm = 500\ninterfaces = 'split'\nsplit_floor = 0\nsequences = 1\n\
             [[medium]]\nname = 'glass'\nfile = '{}'\ncatalogue = 'G'\n[[material]]\npart = 'plate'\nmedium = 'glass'\n\
             [[source]]\nkind = 'collimated'\nat = [0, 0, -5]\ndirection = [0, 0, 1]\nradius = 2\n\
             [[receiver]]\nname = 'behind'\nat = [0, 0, 20]\nsize = [9, 9]\n",
            file.display()
        );
        let power = world.run(&text, |_| ()).sequences[0].first[0].power;
        let once = (1.0 - ((n - 1.0) / (n + 1.0f64)).powi(2)).powi(2);
        assert!((power - once).abs() < 1e-8, "{formula}: {power} {once}");
    }
}

//! What a scene file says wrong is refused with its line, and what it says of a model is obeyed.

use crate::files::fixture;
use lampyris::simulate::Scene;
use lampyris::step;
use std::path::Path;

const REST: &str = r#"
    [[source]]
    kind = "point"
    at = [0, 0, 0]
    power = 1
"#;

fn refusal(head: &str) -> String {
    let text = format!("{head}\n{REST}");
    Scene::parse(&text, "scene.toml", Path::new(".")).expect_err(head).to_string()
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    for (head, key) in [
        ("[accuracy]\ntolerance_mm = [-0.1, 0.2]", "tolerance_mm"),
        ("[accuracy]\ntolerance_mm = [0.2, 0.05]", "tolerance_mm"),
        ("[accuracy]\ntolerance_mm = 1e-160", "1e-7"),
        ("[accuracy]\nangle_deg = 95", "angle_deg"),
        ("[[receiver]]\nname = 'r'\nsize = [200, 1e-308]", "1e-9"),
        ("[[receiver]]\nname = 'r'\nkind = 'disc'\nradius = 1e308", "1e12"),
        ("[[model]]\nfile = \"x.stp\"\nunit_mm = 0", "unit_mm"),
        ("[[model]]\nfile = \"x.stp\"\nunit_mm = 1e-300", "1e-9"),
        ("[[model]]\nfile = \"x.stp\"\nplacement = { scale = 1e20 }", "1e6"),
        ("[[model]]\nfile = \"x.stp\"\nplacement = { scale = -1 }", "scale"),
        ("[run]\nrays = 0", "rays"),
        ("[run]\nrays = 3e13", "2e13"),
        ("[[source]]\nrays = 30_000_000_000_000", "2e13"),
        ("[[source]]\nrays = 15_000_000_000_000\n[[source]]\nrays = 15_000_000_000_000", "all sources"),
        ("[[receiver]]\nname = 'r'\nat = [nan, 0, 0]\nsize = [1, 1]", "`at` must"),
        ("[[receiver]]\nname = 'r'\nkind = 'far_field'\nup = [0, 0, 0]", "`up` must"),
        ("[[receiver]]\nname = 'r'\nx = [0, inf, 0]\nsize = [1, 1]", "`x` must"),
        ("[[receiver]]\nname = 'r'\nsize = [1, 1]\n[[receiver]]\nname = 'R'\nsize = [1, 1]", "both be called 'R'"),
        ("[run]\nray = 10", "ray"),
        ("[[material]]\nentity = '#39'\nsurface = 'absorber'", "without its `#`"),
    ] {
        let said = refusal(head);
        assert!(said.contains(key), "{head}: {said}");
        assert!(said.contains("scene.toml"), "{head}: {said}");
    }
}

#[test]
fn two_of_one_name_are_refused_alike() {
    for (table, kind, keys) in [
        ("medium", "media", "index = 1.5"),
        ("source", "sources", "kind = 'point'"),
        ("receiver", "receivers", "size = [1, 1]"),
    ] {
        let said = refusal(&format!("[[{table}]]\nname = 'twin'\n{keys}\n").repeat(2));
        let sentence = format!("two {kind} are called 'twin'; give each a name of its own");
        assert!(said.starts_with("scene.toml:5:") && said.ends_with(&sentence), "{said}");
    }
}

#[test]
fn a_key_that_stands_elsewhere_is_told_where() {
    for (key, meant) in
        [("wavelength_nm = 550", "spectrum = {"), ("wavelength = 550", "[run]"), ("flux_lm = 5", "unit = \"lm\"")]
    {
        let text = format!("{REST}{key}\n{PLANE}");
        let error = Scene::parse(&text, "scene.toml", Path::new(".")).expect_err(key);
        assert!(error.to_string().contains(meant), "{key}: {error}");
    }
}

#[test]
fn a_unit_given_by_the_user_replaces_that_of_the_file() {
    let file = fixture("step/lens_planoconvex_nurbs.stp");
    let box_of = |unit: Option<f64>| {
        let settings = step::Settings { length_unit_mm: unit, ..step::Settings::default() };
        step::read(&file, &settings).expect("the lens reads").report.bbox_mm.expect("a box")
    };
    let (own, inches) = (box_of(None), box_of(Some(25.4)));
    for corner in 0..2 {
        for axis in 0..3 {
            assert!((inches[corner][axis] - 25.4 * own[corner][axis]).abs() < 1e-6);
        }
    }
}

const PLANE: &str = "[[receiver]]\nname = 'r'\nsize = [1, 1]\n";

/// A list with more entries than belong there is no list that means something else.
#[test]
fn lists_that_are_too_long_are_refused() {
    for (head, line) in [
        ("[[receiver]]\nname = 'r'\nsize = [1, 1]\ncells = [3, 4, 5]", 4),
        ("[[receiver]]\nname = 'r'\nsize = [1, 1]\nat = [0, 0, 10, 5]", 4),
        ("[[medium]]\nname = 'g'\nschott = [2.2, 0, 0, 0, 0, 0, 7]", 3),
        ("[[medium]]\nname = 'g'\nindex_table = [[400, 1.5], [500, 1.4, 1.3]]", 3),
        ("[[model]]\nfile = 'x.stp'\nplacement = { at = [0, 0, 0, 0] }", 3),
    ] {
        let said = refusal(head);
        assert!(said.contains("values where") && said.contains(&format!("scene.toml:{line}:")), "{head}: {said}");
    }
}

/// An empty list is no table without keys, which would be a Lambertian scatterer of all the light, and no list is a table by the order of
/// its entries; a table is no name.
#[test]
fn lists_are_no_tables_and_tables_no_names() {
    let material = |scatter: &str| format!("[[material]]\npart = 'x'\nsurface = 'mirror'\nscatter = {scatter}");
    let lamp = |keys: &str| format!("[[source]]\n{keys}");
    let names = "a table, expected one of point, cone, collimated";
    for (head, words, line) in [
        (material("[]"), "a list, expected a table; write it as in scatter = { lobe", 4),
        (material("['lambertian', 0.5]"), "write it as in scatter = {", 4),
        (material("[{ part = '*' }]"), "write it as in scatter = {", 4),
        ("[[material]]\nsurface = 'mirror'\non = ['*']".into(), "write it as in on = {", 3),
        ("run = [1000, 5]".into(), "write it as in [run]", 1),
        ("accuracy = [[0, 0, 0]]".into(), "write it as in [accuracy]", 1),
        ("medium = [['g', 1.5]]".into(), "write it as in [[medium]]", 1),
        ("model = [['x.stp']]".into(), "write it as in [[model]]", 1),
        ("[[model]]\nfile = 'x.stp'\nplacement = []".into(), "write it as in placement = {", 3),
        ("[[model]]\nfile = 'x.stp'\nwithout = [['x']]".into(), "a list, expected a table; write a list of", 3),
        (lamp("spectrum = ['d65']"), "write it as in spectrum = {", 2),
        (lamp("kind = { point = {} }"), names, 2),
        (lamp("kind = ['point']"), "a list, expected one of point, cone, collimated", 2),
        (lamp("kind = 3"), "integer `3`, expected one of point, cone, collimated", 2),
    ] {
        let text = if head.contains("[[source]]") { head.clone() } else { format!("{head}\n{REST}") };
        let e = Scene::parse(&text, "scene.toml", Path::new(".")).expect_err(&head);
        let said = e.to_string();
        assert!(said.contains(words), "{head}: {said}");
        assert_eq!(e.line_and_column().map(|l| l.0), Some(line), "{head}: {said}");
    }
}

/// The lists of a scene may be written as arrays of inline tables.
#[test]
fn lists_of_tables_may_stand_in_line() {
    let text = "medium = [{ name = 'g', index = 1.5 }]\n\
        material = [{ on = { part = 'x', at = [[0, 0, 1], [0, 0, 2]] }, medium = 'g', scatter = { share = 0.5 } }]\n\
        model = [{ file = 'x.stp', without = [{ solid = [0, 'y'] }] }]\n\
        run = { rays = 1e3 }\naccuracy = { tolerance_mm = 0.1 }\n\
        source = [{ kind = 'collimated', spectrum = { kind = 'd65' } }]\nreceiver = [{ name = 'r', size = [1, 1] }]";
    let scene = Scene::parse(text, "scene.toml", Path::new(".")).unwrap();
    assert_eq!((scene.run.rays, scene.media.len(), scene.materials.len()), (1000, 1, 1));
    assert_eq!(scene.materials[0].scatter.as_ref().and_then(|s| s.share), Some(0.5));
    assert_eq!((scene.models[0].without.len(), scene.sources.len(), scene.receivers.len()), (1, 1, 1));
    assert_eq!(scene.accuracy.tolerance_mm, Some([0.1, 0.1]));
}

/// Lumens of lumens are nothing, and no lumens come from light that the eye does not see.
#[test]
fn lumens_are_not_weighed_twice() {
    let lumens = "[run]\nunit = 'lm'\n";
    assert!(refusal(&format!("{lumens}{PLANE}channels = 'xyz'")).contains("scene.toml:6:"));
    let dark = "[[source]]\nspectrum = { kind = 'lines', values = [[900, 1], [950, 1]] }";
    assert!(refusal(&format!("{lumens}{dark}")).contains("sees nothing"));
    for key in ["graded_index", "index_extraordinary"] {
        let said = refusal(&format!("[[medium]]\nname = 'g'\nindex = 1.5\n{key} = 1"));
        assert!(said.contains("is not simulated"), "{said}");
    }
}

/// Whatever is written must mean something, or be refused by its name and line.
#[test]
fn what_means_nothing_is_refused_by_name() {
    for (head, key, line) in [
        (format!("{PLANE}radius = 3"), "radius", 4),
        (format!("{PLANE}h_deg = [-5, 5]"), "h_deg", 4),
        (format!("{PLANE}up = [0, 1, 0]"), "up", 4),
        ("[[receiver]]\nname = 'r'\nkind = 'sphere'\nradius = 1\nh_deg = [-90, 90]".into(), "h_deg", 5),
        ("[[receiver]]\nname = 'r'\nkind = 'far_field'\nangles = 'C'\nh_deg = [-90, 90]".into(), "h_deg", 5),
        (format!("{PLANE}instance = 'x'"), "instance", 4),
        ("[[receiver]]\nname = 'r'\nkind = 'far_field'\nsize = [1, 1]".into(), "size", 4),
        (
            "[[receiver]]\nname = 'r'\nkind = 'sphere'\nradius = 1\none_sided = true".into(),
            "leave `one_sided` out",
            5,
        ),
        ("[[receiver]]\nname = 'r'\nkind = 'far_field'\nabsorbs = false".into(), "absorbs", 4),
        ("[[receiver]]\nname = 'r'\nkind = 'absorbed'\npart = 'x'\ninteractions = 7".into(), "interactions", 5),
        (format!("{PLANE}cells = [4000, 4000]\nbins_nm = [400, 500, 600, 700]"), "cells", 4),
        ("[[model]]\nname = 'x'".into(), "file", 1),
        ("[[model]]\nfile = 'x.stp'\nplacement = { z = [0, 0, 0] }".into(), "z", 3),
        ("[[model]]\nfile = 'x.stp'\nplacement = { at = [nan, 0, 0] }".into(), "at", 3),
        ("[run]\nrays = 1.5".into(), "1e6", 2),
        ("[run]\nglue_mm = 0".into(), "glue_mm", 2),
        ("[run]\nmax_bounces = 0".into(), "max_bounces", 2),
        ("[run]\nmax_bounces = -1".into(), "expected a whole number, 0 or more", 2),
        (format!("{PLANE}cells = [-1, 5]"), "expected a whole number, 0 or more", 4),
        (format!("{PLANE}cells = [10]"), "write cells = […, …]", 4),
        ("title = 'x'\ndefault_surface = 'metal'".into(), "`default_surface` cannot give", 2),
        ("default_surface = 'coating'".into(), "write `absorber`, `mirror`, `diffuse` or `interface`", 1),
        ("medium = [1]".into(), "[[medium]]", 1),
        ("receiver = [1]".into(), "[[receiver]]", 1),
        ("[accuracy]\nintersector = 'otree'".into(), "octree", 2),
        ("[accuracy]\nnormals = 'smooth'".into(), "bilinear", 2),
        ("[[medium]]\nname = 'g'\nindex = 1.5\nscatter_per_mm = 1\nanisotropy = 1.5".into(), "anisotropy", 5),
        ("[[medium]]\nname = 'g'\nindex = 1.5\nabsorption_per_mm = -1".into(), "absorption", 4),
        ("[[source]]\nkind = 'point'\npower = 1e-300".into(), "power", 3),
        ("[[source]]\nkind = 'point'\nspectrum = 'd65'".into(), "spectrum = { kind", 3),
        ("[[source]]\nkind = 'point'\nx = [0, 0, 0]".into(), "x", 3),
        ("[[source]]\nkind = 'ies'\nfile = 'a.ies'".into(), "lumens", 3),
        ("[[source]]\non = { part = 'led' }\nat = [0, 0, 1]".into(), "leave out `at`", 3),
        ("[[source]]\non = { part = 'led' }\ndirection = [0, 0, -1]".into(), "leave out `direction`", 3),
        ("[[source]]\non = { part = 'led' }\nx = [1, 0, 0]".into(), "leave out `x`", 3),
        (
            "[[material]]\npart = 'x'\nsurface = 'coating'\ncoating = [[0, 550, 0.1, 0.8]]\nreflectance = 0.5"
                .into(),
            "leave out `reflectance`",
            5,
        ),
        (
            "[[material]]\npart = 'x'\nsurface = 'coating'\ntransmittance = 0.5\ncoating = [[0, 550, 0.1, 0.8]]"
                .into(),
            "leave out `transmittance`",
            4,
        ),
        ("[[source]]\nkind = 'rays'\nfile = 'a.csv'\nradius = 3".into(), "radius", 4),
        ("[source]\nkind = 'point'".into(), "[[source]]", 1),
        (
            "[[material]]\npart = 'x'\nsurface = 'coating'\ncoating = 'ideal'".into(),
            "`transmittance` in its place",
            4,
        ),
        ("[[material]]\npart = 'x'\nscatter = { lobe = 'abg', abg = 0.1 }".into(), "A, B and g", 3),
        ("[[material]]\npart = 'x'\nmetal = ['gold', 1]".into(), "expected a number", 3),
        ("[[medium]]\nname = 'g'\nindex_table = 1.5".into(), "index_table = [[450", 3),
        ("[[medium]]\nname = 'g'\nindex_table = [[450, 1.5], 3]".into(), "index_table = [[450", 3),
        ("[[medium]]\nname = 'g'\ngradient_index = [1, 2]".into(), "gradient index is not simulated", 3),
        ("[[medium]]\nname = 'g'\nindex = 1.5\nGRIN = 0.1".into(), "gradient index is not simulated", 4),
        ("[[medium]]\nname = 'g'\nextraordinary_index = 1.5".into(), "birefringence is not simulated", 3),
        (
            "[[medium]]\nname = 'g'\nfluorescence = { quantum_yield = 0.9 }".into(),
            "fluorescence is not simulated",
            3,
        ),
        ("[[fluorescence]]\nmedium = 'g'".into(), "fluorescence is not simulated", 1),
        ("[[material]]\npart = 'x'\nsurface = 'fluorescent'".into(), "fluorescence is not simulated", 3),
        ("[[material]]\npart = 'x'\nsurface = 'grating'".into(), "diffraction is not simulated", 3),
    ] {
        let text = if head.contains("[source]") && !head.contains("[[") {
            head.clone()
        } else {
            format!("{head}\n{REST}")
        };
        let e = Scene::parse(&text, "scene.toml", Path::new(".")).expect_err(&head);
        let said = e.to_string();
        assert!(said.contains(key), "{head}: {said}");
        assert_eq!(e.line_and_column().map(|l| l.0), Some(line), "{head}: {said}");
    }
    let text = "[run]\npolarisation = true\n[[source]]\nkind = 'point'\npolarised = [0, 0, 0]";
    let said = Scene::parse(text, "scene.toml", Path::new(".")).unwrap_err().to_string();
    assert!(said.contains("scene.toml:5"), "{said}");
}

#[test]
fn numbers_may_be_written_as_people_write_them() {
    let text = format!("[run]\nrays = 1e6\n[accuracy]\ntolerance_mm = 0.1\n{REST}");
    let scene = Scene::parse(&text, "scene.toml", Path::new(".")).unwrap();
    assert_eq!((scene.run.rays, scene.accuracy.tolerance_mm), (1_000_000, Some([0.1, 0.1])));
}

#[test]
fn rules_that_do_not_fit_the_model_are_refused_with_advice() {
    let file = fixture("step/lens_planoconvex_nurbs.stp");
    let model = step::read(&file, &step::Settings::default()).unwrap().model;
    let part = model.parts[0].name.clone();
    let glass = format!("[[material]]\npart = '{part}'\nmedium = 'N-BK7'\n");
    for (text, says) in [
        (format!("[[material]]\npart = '{part}'\nsurface = 'interface'\n{REST}"), "no medium"),
        // What an earlier rule made a mirror would let all light through.
        (
            format!(
                "[[material]]\npart = '{part}'\nsurface = 'mirror'\n[[material]]\npart = '{part}'\nscatter = {{ share = 1 }}\n{REST}"
            ),
            "without `surface` an interface scatters",
        ),
        (format!("[[material]]\nat = [1e5, 0, 0]\nmedium = 'N-BK7'\n{REST}"), "mm from the nearest face"),
        (format!("{glass}{REST}    inside = 'no such'\n"), "there are:"),
        (format!("{glass}[[receiver]]\nname = 'a'\nkind = 'absorbed'\npart = 'housing'\n{REST}"), "'housing'"),
        (
            format!(
                "[[medium]]\nname = 'g'\nsellmeier = [[1.2, 0.16]]\n[[material]]\npart = '{part}'\nmedium = 'g'\n{REST}    spectrum = {{ values = [[395, 1], [600, 1]] }}\n"
            ),
            "has no index at 395 nm",
        ),
        // Of a line's power nothing follows for the medium: that of a thousandth must have an index too.
        (
            format!(
                "[[medium]]\nname = 'g'\nsellmeier = [[1.0, 0.25]]\n[[material]]\npart = '{part}'\nmedium = 'g'\n{REST}    spectrum = {{ values = [[600, 1], [500, 0.001], [700, 0.5]] }}\n"
            ),
            "has no index at 500 nm",
        ),
        // 395.3 as single precision has it.
        (
            format!(
                "[[medium]]\nname = 'g'\nsellmeier = [[1.2, 0.16]]\n[[material]]\npart = '{part}'\nmedium = 'g'\n{REST}    spectrum = {{ values = [[395.2999877929688, 1], [600, 1]] }}\n"
            ),
            "has no index at 395.3 nm",
        ),
    ] {
        let scene = Scene::parse(&text, "scene.toml", Path::new(".")).expect(&text);
        let e = scene.bind(&model).expect_err(&text);
        assert!(e.to_string().contains(says) && e.line_and_column().is_some(), "{text}: {e}");
    }
}

/// N-BK7 with its constants in nm² bends next to nothing: 0.999 97 for 1.5168.
#[test]
fn constants_of_a_glass_in_square_nanometres_are_refused() {
    let glass = |unit: f64| {
        let rows =
            [[1.039_612_12, 0.006_000_698_67], [0.231_792_344, 0.020_017_914_4], [1.010_469_45, 103.560_653]];
        let rows = rows.map(|[b, c]| format!("[{b}, {}]", c * unit)).join(", ");
        Scene::parse(&format!("[[medium]]\nname = 'g'\nsellmeier = [{rows}]\n"), "scene.toml", Path::new("."))
    };
    assert!(glass(1.0).is_ok());
    let e = glass(1e6).unwrap_err();
    let said = e.to_string();
    assert!(said.contains("below 1") && said.contains("C in µm²") && e.line_and_column().is_some(), "{said}");
}

/// Wavelengths in micrometres are below all light in nanometres, in every table; and coefficients in nm² are no index.
#[test]
fn tables_over_micrometres_are_refused() {
    let medium = |keys: &str| format!("[[medium]]\nname = 'g'\n{keys}");
    let coating = |keys: &str| format!("[[material]]\npart = 'x'\nsurface = 'coating'\n{keys}");
    for (head, words, line) in [
        (medium("index_table = [[0.4, 1.5], [0.7, 1.51]]"), "a wavelength is 0.4, but must be from 1 to 1e6 nm", 3),
        (medium("index = 1.5\nabsorption_per_mm = [[0.4, 0.1], [0.7, 0.2]]"), "0.55 µm are 550 nm", 4),
        (format!("{PLANE}bins_nm = [-180, 180]"), "`bins_nm` must begin at 0 nm or above", 4),
        (medium("cauchy = [1.5, 4200]"), "`[A, B, C, …]` with B in µm²", 3),
        (coating("reflectance = [[0, 0.4, 0.9], [0, 0.7, 0.8]]"), "in `reflectance`: a wavelength is 0.4", 4),
        (coating("coating = [[0, 0.55, 0.1, 0.8]]"), "in `coating`: a wavelength is 0.55", 4),
        (
            "[[material]]\npart = 'x'\nsurface = 'mirror'\nreflectance = [[90, 0.9], [0, 0.8]]".into(),
            "in `reflectance`: row 2 of the angle table",
            4,
        ),
    ] {
        let e = Scene::parse(&format!("{head}\n{REST}"), "scene.toml", Path::new(".")).expect_err(&head);
        let said = e.to_string();
        assert!(said.contains(words), "{head}: {said}");
        assert_eq!(e.line_and_column().map(|l| l.0), Some(line), "{head}: {said}");
    }
}

/// What is refused is named as it is written, with its limits and what to write in its place.
#[test]
fn refusals_say_what_would_be_right() {
    let coat = |keys: &str| format!("[[material]]\npart = 'x'\n{keys}");
    let lamp = |keys: &str| format!("[[source]]\n{keys}");
    for (head, words) in [
        (coat("scatter = { lobe = 'gaussian', sigma_deg = -1 }"), "`sigma_deg` is -1, but must be above 0"),
        (
            coat("scatter = { lobe = 'gaussian', sigma_deg = 1e16 }"),
            "`sigma_deg` is 1e16, but must be above 0 and at most 180",
        ),
        (coat("scatter = { share = -1e300 }"), "is -1e300, but must be"),
        (format!("{PLANE}one_sided = 1e300"), "floating point `1e300`, expected a boolean"),
        (
            "[run]\nseed = 18446744073709551616".into(),
            "the whole number 18446744073709551616 has more than 64 bits",
        ),
        (lamp("spectrum = { kind = 'black_body', kelvin = 1e-300 }"), "a black body of 1e-300 K has no light"),
        ("[[medium]]\nname = 'g'\nsellmeier = []".into(), "`sellmeier` is empty: its rows are [B, C]"),
        (coat("surface = 'metal'\nmetal = [0.2, -3]"), "n above 0 and k 0 or more (n + i k)"),
        (
            lamp("spectrum = { kind = 'table', values = [[550, 1]] }"),
            "a table of one wavelength has no width: give two, or `kind = \"lines\"`",
        ),
        (
            lamp("spectrum = { kind = 'black_body', kelvin = 1 }"),
            "a black body of 1 K has no light in 360 to 830 nm",
        ),
        (
            lamp("kind = 'cone'\nhalf_angle_deg = 0"),
            "above 0 and at most 180; for parallel light take `collimated`",
        ),
        (
            lamp("kind = 'ies'\nfile = 'a.ies'\nspectrum = { kind = 'd65' }"),
            "its `spectrum` is not used to convert photometric files",
        ),
        (format!("{PLANE}rays = 1000"), "`rays` is a key of [run] and [[source]]"),
        ("[run]\nambient = 'water'".into(), "`ambient` is a key of the head of the file"),
        ("[run]\nhalf_angle_deg = 3".into(), "`half_angle_deg` is a key of [[source]]"),
        (format!("{PLANE}cells = [1000000000000, 10]"), "expected a whole number from 0 to 4294967295"),
        (format!("{PLANE}cells = [1000000000000, 10]"), "from 1 to 16 million cells in all"),
        (
            "[[receiver]]\nname = 'r'\nkind = 'far_field'\nangles = 'C'\nh_deg = [-90, 90]".into(),
            "`h_deg` must rise and stay within 0 to 360, the angles of type C",
        ),
        (
            "[[receiver]]\nname = 'r'\nkind = 'far_field'\nv_deg = [-90, 91]".into(),
            "`v_deg` must rise and stay within -90 to 90, the angles of type A",
        ),
    ] {
        let said = refusal(&head);
        assert!(said.contains(words), "{head}: {said}");
    }
}

/// Light of wavelengths that a table or a formula was not made for is used at the table's ends, and this is said by name.
#[test]
fn light_beyond_a_table_is_named() {
    let file = fixture("step/lens_planoconvex_nurbs.stp");
    let model = step::read(&file, &step::Settings::default()).unwrap().model;
    let index = "index_table = [[420, 1.53], [700, 1.51]]";
    let clear = "index = 1.5\nabsorption_per_mm = [[420, 0.01], [700, 0.02]]";
    let coat = |from: f64| {
        format!("coating = [[0, {from:?}, 0.1, 0.8], [0, 700, 0.1, 0.8], [90, {from:?}, 1, 0], [90, 700, 1, 0]]")
    };
    for (medium, coating, spectrum, says) in [
        (index, String::new(), "kind = 'lines', values = [[450, 1], [650, 1]]", &[][..]),
        (index, String::new(), "kind = 'lines', values = [[450, 1], [750, 1]]", &["index_table", "750"]),
        (clear, String::new(), "kind = 'd65'", &["absorption_per_mm", "360 to 830"]),
        ("index = 1.5", coat(400.0), "kind = 'white_led'", &["coating", "400 to 700", "380 to 780"]),
        ("index = 1.5", coat(400.0), "kind = 'table', values = [[400, 1], [700, 2]]", &[]),
        (
            "index = 1.5",
            "reflectance = [[0, 500, 0.5], [0, 600, 0.7]]".into(),
            "kind = 'black_body', kelvin = 3000",
            &["reflectance"],
        ),
        ("catalogue = 'PMMA'", String::new(), "values = [[405, 1]]", &["'PMMA'", "436.8", "405 nm", "formula"]),
        ("catalogue = 'fused silica'", String::new(), "values = [[405, 1]]", &[]),
    ] {
        let surface = if coating.is_empty() { String::new() } else { format!("surface = 'coating'\n{coating}\n") };
        let text = format!(
            "[[medium]]\nname = 'g'\n{medium}\n[[material]]\npart = '*'\nmedium = 'g'\n{surface}{REST}    name = 'lamp'\n    spectrum = {{ {spectrum} }}\n"
        );
        let scene = Scene::parse(&text, "scene.toml", Path::new(".")).expect(&text);
        let notes = scene.bind(&model).expect(&text).notes().join("; ");
        assert_eq!(notes.is_empty(), says.is_empty(), "{text}: {notes}");
        assert!(says.iter().all(|word| notes.contains(word)), "{text}: {notes}");
    }
}

/// The schema's conditions name keys that exist, and require those without which the reader refuses an entry.
#[test]
#[cfg(feature = "schema")]
fn the_schema_asks_for_what_the_reader_asks_for() {
    fn required<'a>(value: &'a serde_json::Value, into: &mut Vec<&'a str>) {
        match value {
            serde_json::Value::Object(map) => map.iter().for_each(|(key, v)| match (key.as_str(), v) {
                ("required", serde_json::Value::Array(keys)) => into.extend(keys.iter().filter_map(|k| k.as_str())),
                _ => required(v, into),
            }),
            serde_json::Value::Array(list) => list.iter().for_each(|v| required(v, into)),
            _ => {}
        }
    }
    let schema = Scene::schema();
    assert_eq!(schema["required"][0], "source");
    for (name, wanted) in [
        ("Medium", "name"),
        ("Receiver", "name"),
        ("Receiver", "size"),
        ("Source", "half_angle_deg"),
        ("SpectrumKey", "kelvin"),
        ("Material", "surface"),
    ] {
        let definition = &schema["$defs"][name];
        let mut keys = Vec::new();
        required(definition, &mut keys);
        assert!(keys.contains(&wanted), "{name}: {keys:?}");
        assert!(keys.iter().all(|k| definition["properties"].get(k).is_some()), "{name}: {keys:?}");
    }
    for owner in ["Material", "FaceSelector"] {
        let kind = &schema["$defs"][owner]["properties"]["kind"];
        assert!(
            kind["pattern"].as_str().unwrap().contains("|cylinder|") && kind["pattern"] == kind["items"]["pattern"]
        );
    }
    let material = &schema["$defs"]["Material"]["properties"];
    assert!(["reflectance", "transmittance"].iter().all(|key| material[key]["maximum"] == 1));
    assert!(schema["$defs"]["Accuracy"]["properties"]["normals"]["pattern"].as_str().unwrap().contains("[fF][lL]"));
}

#[test]
fn a_regulation_that_stands_twice_is_refused() {
    let head = "[run]\nunit = 'lm'\n[[source]]\nkind = 'point'\n\
        [[receiver]]\nname = 'road'\nkind = 'far_field'\nh_deg = [-12, 12]\nv_deg = [-6, 6]\ncells = [240, 120]\n";
    let once = "[[regulation]]\nid = 'UN R112 B passing'\n";
    let read = |regulations: &str| Scene::parse(&format!("{head}{regulations}"), "scene.toml", Path::new("."));
    assert!(read(once).is_ok() && read(&format!("{once}{once}left_hand = true\n")).is_ok());
    for twice in [once.repeat(2), format!("{once}[[regulation]]\nid = 'un r112  B passing'\nreceiver = 'road'\n")] {
        let error = read(&twice).unwrap_err().to_string();
        assert!(error.contains("stands above already"), "{error}");
    }
}

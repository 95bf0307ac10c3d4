//! Ranges that the JSON Schema states are those that the reader of scenes keeps.

use lampyris::simulate::Scene;
use std::path::Path;

/// A bound as the schema states it, and a scene that has a value beyond it or within it in the place of `$`.
struct Bound {
    owner: &'static str,
    /// The key, and `items` where the bound is that of each number of a list.
    key: &'static str,
    keyword: &'static str,
    value: f64,
    beyond: &'static str,
    within: &'static str,
    scene: &'static str,
}

/// Makes a bound of these, in the order of its fields.
const fn bound(
    [owner, key, keyword]: [&'static str; 3],
    value: f64,
    [beyond, within]: [&'static str; 2],
    scene: &'static str,
) -> Bound {
    Bound { owner, key, keyword, value, beyond, within, scene }
}

/// Scenes to which a source is added where they have none.
const BOUNDS: [Bound; 24] = [
    bound(["Accuracy", "tolerance_mm", "minimum"], 1e-7, ["9e-8", "1e-7"], "[accuracy]\ntolerance_mm = $"),
    bound(
        ["Accuracy", "tolerance_mm/items", "minimum"],
        1e-7,
        ["[9e-8, 1]", "[1e-7, 1]"],
        "[accuracy]\ntolerance_mm = $",
    ),
    bound(["Run", "rays", "minimum"], 1.0, ["0", "1"], "[run]\nrays = $"),
    bound(["Run", "rays", "maximum"], 2e13, ["3e13", "2e13"], "[run]\nrays = $"),
    bound(["Run", "max_length_mm", "exclusiveMinimum"], 0.0, ["0", "1"], "[run]\nmax_length_mm = $"),
    bound(["Run", "power_floor", "exclusiveMaximum"], 1.0, ["1", "0.9"], "[run]\npower_floor = $"),
    bound(["ModelUse", "unit_mm", "minimum"], 1e-9, ["9e-10", "1e-9"], "[[model]]\nfile = 'm.stp'\nunit_mm = $"),
    bound(["ModelUse", "unit_mm", "maximum"], 1e6, ["1.1e6", "1e6"], "[[model]]\nfile = 'm.stp'\nunit_mm = $"),
    bound(["Placement", "scale", "minimum"], 1e-9, ["0", "1e-9"], "[[model]]\nfile = 'm.stp'\nplacement.scale = $"),
    bound(
        ["Medium", "absorption_per_mm", "minimum"],
        0.0,
        ["-1", "0"],
        "[[medium]]\nname = 'g'\nindex = 1.5\nabsorption_per_mm = $",
    ),
    bound(
        ["Medium", "anisotropy", "exclusiveMaximum"],
        1.0,
        ["1", "0.9"],
        "[[medium]]\nname = 'g'\nindex = 1.5\nscatter_per_mm = 1\nanisotropy = $",
    ),
    bound(
        ["Medium", "anisotropy", "exclusiveMinimum"],
        -1.0,
        ["-1", "-0.9"],
        "[[medium]]\nname = 'g'\nindex = 1.5\nscatter_per_mm = 1\nanisotropy = $",
    ),
    bound(
        ["ScatterKey", "sigma_deg", "exclusiveMinimum"],
        0.0,
        ["0", "1"],
        "[[material]]\npart = '*'\nsurface = 'mirror'\nscatter = { lobe = 'gaussian', sigma_deg = $ }",
    ),
    bound(
        ["ScatterKey", "exponent", "minimum"],
        0.0,
        ["-1", "0"],
        "[[material]]\npart = '*'\nsurface = 'mirror'\nscatter = { lobe = 'cosine', exponent = $ }",
    ),
    bound(["Source", "rays", "minimum"], 1.0, ["0", "1"], "[[source]]\nrays = $"),
    bound(["Source", "radius", "exclusiveMinimum"], 0.0, ["0", "1"], "[[source]]\nradius = $"),
    bound(["Source", "size/items", "exclusiveMinimum"], 0.0, ["[1, 0]", "[1, 1]"], "[[source]]\nsize = $"),
    bound(
        ["Source", "half_angle_deg", "exclusiveMinimum"],
        0.0,
        ["0", "1"],
        "[[source]]\nkind = 'cone'\nhalf_angle_deg = $",
    ),
    bound(
        ["SpectrumKey", "kelvin", "exclusiveMinimum"],
        0.0,
        ["0", "3000"],
        "[[source]]\nspectrum = { kind = 'black_body', kelvin = $ }",
    ),
    bound(
        ["SpectrumKey", "phosphor_nm", "maximum"],
        780.0,
        ["781", "780"],
        "[[source]]\nspectrum = { kind = 'white_led', phosphor_nm = $ }",
    ),
    bound(
        ["SpectrumKey", "blue_share", "maximum"],
        1.0,
        ["1.1", "1"],
        "[[source]]\nspectrum = { kind = 'white_led', blue_share = $ }",
    ),
    bound(
        ["Receiver", "radius", "minimum"],
        1e-9,
        ["0", "1e-9"],
        "[[receiver]]\nname = 'r'\nkind = 'disc'\nradius = $",
    ),
    bound(
        ["Receiver", "size/items", "maximum"],
        1e12,
        ["[1, 2e12]", "[1, 1e12]"],
        "[[receiver]]\nname = 'r'\nsize = $",
    ),
    bound(
        ["Receiver", "bins_nm", "minItems"],
        2.0,
        ["[500]", "[500, 600]"],
        "[[receiver]]\nname = 'r'\nsize = [1, 1]\nbins_nm = $",
    ),
];

#[test]
fn the_schema_states_the_ranges_that_the_reader_keeps() {
    let schema = Scene::schema();
    for Bound { owner, key, keyword, value, beyond, within, scene } in BOUNDS {
        let stated = schema.pointer(&format!("/$defs/{owner}/properties/{key}/{keyword}"));
        assert_eq!(stated.and_then(serde_json::Value::as_f64), Some(value), "{owner} {key} {keyword}");
        let source = if scene.contains("[[source]]") { "" } else { "[[source]]\n" };
        let read = |number: &str| {
            let text = format!("{}\n{source}", scene.replace('$', number));
            Scene::parse(&text, "scene.toml", Path::new(".")).map(|_| ())
        };
        assert!(read(beyond).is_err() && read(within).is_ok(), "{owner} {key}: {:?}", read(within));
    }
}

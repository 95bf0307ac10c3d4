//! What stands in the files of a receiver: every channel cell by cell, the flux of IES files, the rays of Data_3; and what a run says
//! its facets did to the light. The readers here are the tests' own.

use crate::files::fixture;
use crate::support::lampyris_in;
use lampyris::formats::read_tm25;
use serde_json::Value;
use std::path::Path;

/// A tilted cos² lobe of white light and a narrow cone, one scene for watts and one for lumens.
fn trace(unit: &str, receivers: &str) -> (tempfile::TempDir, Value) {
    let folder = tempfile::tempdir().unwrap();
    let sources = "[[source]]\nkind = 'cosine'\nexponent = 2\ndirection = [0.2, 0.3, 1]\npower = 10\n\
        spectrum = { kind = 'white_led' }\n\
        [[source]]\nkind = 'cone'\nhalf_angle_deg = 20\ndirection = [-0.3, 0.1, 1]\npower = 3\nspectrum = { kind = 'd65' }\n";
    let scene = format!("[run]\nrays = 40_000\nunit = '{unit}'\n{sources}{receivers}");
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, out, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "--json"]);
    assert_eq!(code, 0, "{err}");
    (folder, serde_json::from_str(&out).unwrap())
}

/// The columns of a CSV file.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',');
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|n| (n.to_owned(), Vec::new())).collect();
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
        assert_eq!(cells.len(), columns.len());
        columns.iter_mut().zip(cells).for_each(|((_, column), x)| column.push(x));
    }
    columns
}

#[test]
fn every_channel_stands_in_the_files_cell_by_cell() {
    let (folder, found) = trace(
        "W",
        "[[receiver]]\nname = 'lumens'\nkind = 'far_field'\ncells = [18, 9]\nchannels = 'photometric'\n\
         [[receiver]]\nname = 'colour'\nkind = 'far_field'\nangles = 'C'\ncells = [18, 9]\nchannels = 'xyz'\n\
         [[receiver]]\nname = 'bins'\nat = [0, 0, 900]\nsize = [3000, 2000]\ncells = [6, 4]\nabsorbs = false\n\
         bins_nm = [380, 480, 580.5, 780]\n",
    );
    // Beside a flux in lumens the efficiency says of what it is a share.
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("of the watts that the sources emit") && !page.contains("of what the sources emit"));
    let (rad, step) = (|deg: f64| deg.to_radians(), [10.0f64, 20.0]);
    for (k, name, names) in [
        (0, "lumens", vec!["luminous_intensity_cd"]),
        (1, "colour", vec!["X_cd", "Y_cd", "Z_cd"]),
        (2, "bins", vec!["380-480_nm_W_per_m2", "480-580.5_nm_W_per_m2", "580.5-780_nm_W_per_m2"]),
    ] {
        let columns = columns(&folder.path().join(format!("out/{name}.csv")));
        let measure = |row: usize| match k {
            0 => {
                rad(step[0])
                    * (rad(columns[1].1[row] + 0.5 * step[1]).sin() - rad(columns[1].1[row] - 0.5 * step[1]).sin())
            }
            1 => rad(20.0) * (rad(columns[1].1[row] - 10.0).cos() - rad(columns[1].1[row] + 10.0).cos()),
            _ => 0.5 * 0.5,
        };
        for (c, wanted) in names.iter().enumerate() {
            let [values, errors] = [&columns[4 + 2 * c], &columns[5 + 2 * c]];
            assert_eq!((values.0.as_str(), errors.0.as_str()), (*wanted, &*format!("{wanted}_standard_error")));
            let sum: f64 = values.1.iter().enumerate().map(|(row, v)| v * measure(row)).sum();
            let total = found["receivers"][k]["channels"][c]["total"].as_f64().unwrap();
            assert!(total > 0.1 && (sum / total - 1.0).abs() < 1e-12, "{name} {wanted}: {sum} {total}");
            assert!(errors.1.iter().any(|e| *e > 0.0));
            // No facet is in the way of this light, and that is said of every figure and cell.
            let figure = &found["receivers"][k]["figures"]["channels"][c];
            assert_eq!(figure["value"], found["receivers"][k]["channels"][c]["total"]);
            let (_, geometric) = columns.iter().find(|(n, _)| *n == format!("{wanted}_geometric")).unwrap();
            let unit = match *wanted {
                "X_cd" | "Z_cd" => "",
                "Y_cd" | "luminous_intensity_cd" => "lm",
                _ => "W",
            };
            assert_eq!(figure["unit"], unit, "{wanted}");
            assert_eq!((figure["geometric"].as_f64(), geometric.iter().all(|g| *g == 0.0)), (Some(0.0), true));
        }
    }
    let mut zip = zip::ZipArchive::new(std::fs::File::open(folder.path().join("out/colour.npz")).unwrap()).unwrap();
    let y: Vec<f64> = npyz::NpyFile::new(zip.by_name("Y_cd.npy").unwrap()).unwrap().into_vec().unwrap();
    assert_eq!(y, columns(&folder.path().join("out/colour.csv"))[6].1);
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("lumens: luminous intensity (cd)"));
}

/// Type, angles and candela of an LM-63 file, plane by plane.
fn ies(path: &Path) -> (f64, [Vec<f64>; 2], Vec<f64>) {
    let text = std::fs::read_to_string(path).unwrap();
    for key in ["[TEST]", "[TESTLAB]", "[ISSUEDATE]", "[MANUFAC]"] {
        assert!(text.contains(&format!("\r\n{key} ")), "LM-63-2002 wants {key}");
    }
    let (_, body) = text.split_once("TILT=NONE\r\n").unwrap();
    let numbers: Vec<f64> = body.split_whitespace().map(|w| w.parse().unwrap()).collect();
    let (rows, planes) = (numbers[3] as usize, numbers[4] as usize);
    let (v, rest) = numbers[13..].split_at(rows);
    let (h, candela) = rest.split_at(planes);
    assert_eq!(candela.len(), rows * planes);
    (numbers[5], [h.to_vec(), v.to_vec()], candela.to_vec())
}

/// Lumens of candela that are bilinear between their angles, by the midpoint rule with 40 × 40 points in each field.
fn flux(kind: f64, [h, v]: &[Vec<f64>; 2], candela: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (i, hs) in h.windows(2).enumerate() {
        for (j, vs) in v.windows(2).enumerate() {
            let at = |i: usize, j: usize| candela[i * v.len() + j];
            for k in 0..1600 {
                let (a, b) = ((f64::from(k % 40) + 0.5) / 40.0, (f64::from(k / 40) + 0.5) / 40.0);
                let value = (at(i, j) * (1.0 - a) + at(i + 1, j) * a) * (1.0 - b)
                    + (at(i, j + 1) * (1.0 - a) + at(i + 1, j + 1) * a) * b;
                let (x, y) = (hs[0] + a * (hs[1] - hs[0]), vs[0] + b * (vs[1] - vs[0]));
                let weight = match kind {
                    1.0 => y.to_radians().sin(),
                    2.0 => x.to_radians().cos(),
                    _ => y.to_radians().cos(),
                };
                sum += value * weight * (hs[1] - hs[0]).to_radians() * (vs[1] - vs[0]).to_radians() / 1600.0;
            }
        }
    }
    sum
}

/// Whether all values of a plane of an LM-63 file are one.
fn same_plane(candela: &[f64]) -> bool {
    candela.iter().all(|c| *c == candela[0])
}

#[test]
fn the_flux_of_an_ies_file_is_that_of_its_receiver() {
    let far = "[[receiver]]\nname = 'A'\nkind = 'far_field'\ncells = [20, 20]\n\
        [[receiver]]\nname = 'B'\nkind = 'far_field'\nangles = 'B'\ncells = [15, 30]\n\
        [[receiver]]\nname = 'C'\nkind = 'far_field'\nangles = 'C'\ncells = [24, 20]\n";
    let (lumens, found) = trace("lm", far);
    for (k, name) in ["A", "B", "C"].iter().enumerate() {
        let (kind, angles, candela) = ies(&lumens.path().join(format!("out/{name}.ies")));
        let expected = found["receivers"][k]["power"].as_f64().unwrap();
        let flux = flux(kind, &angles, &candela);
        assert!((flux / expected - 1.0).abs() < 1e-4, "{name}: {flux} lm of {expected}");
        // All planes meet in the poles, and so do their values.
        let rows = angles[1].len();
        let same = |first: usize, step: usize| candela[first..].iter().step_by(step).all(|c| *c == candela[first]);
        match kind {
            2.0 => assert!(candela[..rows].iter().all(|c| *c == candela[0])),
            _ => assert!(same(0, rows) && same(rows - 1, rows)),
        }
        // The cells beside a pole are slivers of one direction: few rays in one of them are no beam.
        match kind {
            2.0 => {
                let planes = angles[0].len();
                assert!([1, planes - 2].iter().all(|i| same_plane(&candela[i * rows..(i + 1) * rows])));
            }
            _ => assert!(same(1, rows) && same(rows - 2, rows)),
        }
    }
    let (watts, found) = trace("W", &far.replace("cells", "channels = 'xyz'\ncells"));
    let (kind, angles, candela) = ies(&watts.path().join("out/C.ies"));
    let expected = found["receivers"][2]["channels"][1]["total"].as_f64().unwrap();
    assert!((flux(kind, &angles, &candela) / expected - 1.0).abs() < 1e-4);
}

/// A luminaire that shines down has no upper half: γ ends at 90, where every plane has a value of its own.
#[test]
fn half_a_distribution_is_written_for_luminaires() {
    let far = "[[receiver]]\nname = 'down'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 90]\ncells = [24, 20]\n\
        [[receiver]]\nname = 'up'\nkind = 'far_field'\nangles = 'C'\nv_deg = [90, 180]\ncells = [24, 20]\n\
        [[receiver]]\nname = 'part'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 60]\ncells = [24, 20]\n";
    let (folder, found) = trace("lm", far);
    for (k, name, ends) in [(0, "down", [0.0, 90.0]), (1, "up", [90.0, 180.0])] {
        let expected = found["receivers"][k]["power"].as_f64().unwrap();
        let (kind, angles, candela) = ies(&folder.path().join(format!("out/{name}.ies")));
        assert_eq!([angles[1][0], angles[1][angles[1].len() - 1]], ends);
        if expected == 0.0 {
            continue;
        }
        let flux = flux(kind, &angles, &candela);
        assert!((flux / expected - 1.0).abs() < 1e-4, "{name}: {flux} lm of {expected}");
        let ldt = lampyris::formats::read_eulumdat(&folder.path().join(format!("out/{name}.ldt"))).unwrap();
        // Six decimals of candela per kilolumen.
        assert!((ldt.flux() / expected - 1.0).abs() < 1e-4, "{name}: {} lm of {expected}", ldt.flux());
    }
    assert!(!folder.path().join("out/part.ies").exists() && !folder.path().join("out/part.ldt").exists());
}

#[test]
fn the_rays_of_data_3_are_those_that_arrived() {
    let (folder, found) = trace(
        "lm",
        "[[receiver]]\nname = 'near'\nat = [0, 0, 100]\nsize = [300, 200]\ncells = [3, 2]\nabsorbs = false\n\
         [[receiver]]\nname = 'far'\nat = [0, 0, 40_000]\nsize = [80_000, 30_000]\ncells = [3, 2]\n",
    );
    for (k, name, z, half) in [(0, "near", 100.0, [150.0, 100.0]), (1, "far", 40_000.0, [40_000.0, 15_000.0])] {
        let text = std::fs::read_to_string(folder.path().join(format!("out/{name}.data3"))).unwrap();
        let lines: Vec<Vec<f64>> =
            text.lines().map(|l| l.split_whitespace().map(|w| w.parse().unwrap()).collect()).collect();
        assert_eq!((&lines[0][..], lines[1].len(), lines[3][0] as usize), (&[2.0, 3.0][..], 3, lines.len() - 4));
        let mut power = 0.0;
        for ray in &lines[4..] {
            assert!((ray[2] - z).abs() < 1e-6 && ray[0].abs() <= half[0] && ray[1].abs() <= half[1], "{ray:?}");
            // All light starts in the origin.
            assert!((ray[0] * ray[5] - ray[3] * ray[2]).abs() < 1e-6 * z);
            power += ray[6];
        }
        let expected = found["receivers"][k]["power"].as_f64().unwrap();
        assert!((power / expected - 1.0).abs() < 0.05, "{name}: {power} lm of {expected}");
        // The same rays for other programs, in single precision, with the power of the receiver in place of the sample's.
        let file = read_tm25(&folder.path().join(format!("out/{name}.tm25ray"))).unwrap();
        assert_eq!(file.header.rays as usize, lines.len() - 4);
        assert!((f64::from(file.header.luminous_flux) / expected - 1.0).abs() < 1e-6);
        for (row, ray) in file.rows.chunks(7).zip(&lines[4..]) {
            let mut ray = ray.clone();
            ray[6] *= expected / power;
            assert!(
                row.iter().zip(&ray).all(|(a, b)| (f64::from(*a) - b).abs() <= 1e-6 * b.abs().max(1.0)),
                "{row:?}"
            );
        }
    }
}

/// One cell is no map, but rays came there all the same.
#[test]
fn a_receiver_of_one_cell_has_files_of_its_rays() {
    let (folder, found) = trace(
        "lm",
        "[[receiver]]\nname = 'plane'\nat = [0, 0, 100]\nsize = [300, 200]\ncells = [1, 1]\nabsorbs = false\n\
         [[receiver]]\nname = 'disc'\nkind = 'disc'\nat = [0, 0, 200]\nradius = 300\ncells = [1, 1]\n",
    );
    for (k, files) in [&["plane.tm25ray", "plane.data3"][..], &["disc.tm25ray"]].into_iter().enumerate() {
        let receiver = &found["receivers"][k];
        assert_eq!(receiver["files"], serde_json::json!(files));
        let file = read_tm25(&folder.path().join("out").join(files[0])).unwrap();
        let expected = receiver["power"].as_f64().unwrap();
        assert!(file.header.rays > 100 && (f64::from(file.header.luminous_flux) / expected - 1.0).abs() < 1e-6);
    }
}

/// What a far field wrote as LM-63 is the same light again as a source, the right way round.
#[test]
fn an_ies_file_read_as_a_source_is_the_light_it_was_written_from() {
    let far = "[[receiver]]\nname = 'A'\nkind = 'far_field'\ncells = [18, 18]\n\
        [[receiver]]\nname = 'B'\nkind = 'far_field'\nangles = 'B'\ncells = [18, 18]\n\
        [[receiver]]\nname = 'C'\nkind = 'far_field'\nangles = 'C'\ncells = [24, 24]\n";
    let (first, _) = trace("lm", far);
    // Right of one who looks along +z with +y up is −x: there lies C 0.
    for (name, x) in [("A", "[0, 1, 0]"), ("B", "[0, 1, 0]"), ("C", "[-1, 0, 0]")] {
        let file = first.path().join(format!("out/{name}.ies"));
        let scene = format!(
            "[run]\nrays = 100_000\nunit = 'lm'\n[[source]]\nkind = 'ies'\nfile = '{}'\nx = {x}\n{far}",
            file.display()
        );
        std::fs::write(first.path().join("again.toml"), scene).unwrap();
        let (code, _, err) = lampyris_in(first.path(), &["trace", "again.toml", "-o", "again", "-q"]);
        assert_eq!(code, 0, "{err}");
        let [before, after] = ["out", "again"].map(|folder| {
            let columns = columns(&first.path().join(format!("{folder}/{name}.csv")));
            columns[2].1.clone()
        });
        let difference: f64 = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).sum();
        // Cells of 10° and what lies between their middles; the mirror image differs by 0.4 and more.
        let share = difference / before.iter().sum::<f64>();
        assert!(share < 0.12, "{name}: {share}");
    }
}

/// A spot that the facets widen is said to be so where people look; on the spline there is nothing to say.
#[test]
fn a_trace_says_where_its_facets_show() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fixture("scenes/s1_lens.toml").display().to_string();
    let trace = |extra: &[&str]| {
        let arguments: Vec<&str> = [&["trace", &scene, "-o", "out", "--rays", "20000"], extra].concat();
        let (code, _, err) = lampyris_in(folder.path(), &arguments);
        assert_eq!(code, 0, "{err}");
        let text = std::fs::read_to_string(folder.path().join("out/results.json")).unwrap();
        let said = err.split_whitespace().collect::<Vec<_>>().join(" ").contains("The facets limit this answer");
        (said, serde_json::from_str::<Value>(&text).unwrap())
    };
    let (said, flat) = trace(&["--normals", "flat"]);
    // A row for each figure: fifteen columns did not fit on paper.
    let table = std::fs::read_to_string(folder.path().join("out/tables/faceting.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0].len(), 6, "{table}");
    let figures: Vec<&str> = rows[1..].iter().map(|row| row[1].split_whitespace().next().unwrap()).collect();
    assert_eq!(figures, ["power", "max", "width", "width"], "{table}");
    let width = &flat["faceting"]["receivers"][0]["width"][1];
    assert!(said && width[0].as_f64() > width[1].as_f64(), "{width}");
    let rms = &flat["receivers"][0]["figures"]["rms_1"];
    assert!(rms["limited_by"] == "geometry" && rms["geometric"].as_f64() > rms["statistical"].as_f64(), "{rms}");
    assert!(flat.get("chosen").is_none(), "normals were asked for");
    assert_eq!(flat["check"]["octree_vs_bvh"]["disagree"], 0, "both carry the flat normals that were asked for");
    let (said, exact) = trace(&["--intersector", "exact"]);
    assert!(!said && exact.get("faceting").is_none());
    assert_eq!(exact["receivers"][0]["figures"]["rms_1"]["geometric"], 0.0);
    // Neither tolerance nor normals nor intersector: the spot of this lens is far too sharp for facets of 0.05 mm.
    let (said, default) = trace(&[]);
    assert!(!said && default["chosen"]["intersector"] == "exact", "{}", default["chosen"]);
    assert_eq!(default["digest"], exact["digest"]);
}

/// The brightest direction comes with an error that holds the facets' part, and every map with both layers.
#[test]
fn figures_and_maps_carry_both_errors() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fixture("scenes/demo.toml").display().to_string();
    let arguments = ["trace", &scene, "-o", "out", "--rays", "20000", "--tolerance", "0.05..0.2"];
    let (code, _, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let err = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(err.contains("from the facets) cd") || err.contains("from the facets)"), "{err}");
    let text = std::fs::read_to_string(folder.path().join("out/results.json")).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    for receiver in document["receivers"].as_array().unwrap() {
        for name in ["power", "max", "rms_1", "rms_2", "centroid_1", "centroid_2"] {
            let figure = &receiver["figures"][name];
            for key in ["value", "statistical", "geometric"] {
                assert!(figure[key].is_number(), "{name} {key}: {figure}");
            }
            assert!(figure["unit"].is_string() && figure["limited_by"].is_string(), "{figure}");
        }
        let file = receiver["files"][0].as_str().unwrap();
        let csv = std::fs::read_to_string(folder.path().join("out").join(file)).unwrap();
        assert!(csv.lines().next().unwrap().ends_with("statistical,geometric"), "{file}");
        // Facets that changed no cell of the comparing rays may change it of rarer ones: no lit cell is without error.
        for line in csv.lines().skip(1) {
            let numbers: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
            assert!(numbers[2] == 0.0 || numbers[numbers.len() - 1] > 0.0, "{file}: {line}");
        }
    }
}

/// A spot of 8 mm on a wall of 400 mm, in cells of 1 mm: its cuts go as far as its map, not from end to end of the wall.
#[test]
fn cuts_show_the_part_that_is_lit() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[run]\nrays = 20_000\n[[source]]\nkind = 'collimated'\nradius = 4
        [[receiver]]\nname = 'wall'\nat = [0, 0, 9]\nsize = [400, 400]\ncells = [400, 400]\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "-q"]);
    assert_eq!(code, 0, "{err}");
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    let data = page.split("data-for=\"fig-wall-cuts\">").nth(1).unwrap().split("</script>").next().unwrap();
    let figure: Value = serde_json::from_str(data).unwrap();
    for trace in figure["data"].as_array().unwrap() {
        // Four characters stand for three bytes of numbers of eight.
        let points = trace["x"]["bdata"].as_str().unwrap().len() * 3 / 4 / 8;
        assert!((8..60).contains(&points), "{points} points");
    }
}

/// Without a model there are ray paths to look at all the same, and no empty arrays, which glTF forbids.
#[test]
fn a_scene_without_a_model_is_drawn() {
    let (folder, _) = trace("lm", "[[receiver]]\nname = 'near'\nat = [0, 0, 100]\nsize = [300, 200]\n");
    let bytes = std::fs::read(folder.path().join("out/facets.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let accessors = document["accessors"].as_array().unwrap();
    assert!(accessors.len() == 2 && accessors.iter().all(|a| a["count"].as_u64() > Some(100)), "{accessors:?}");
}

/// D65 on a round wall that counts X, Y, Z: white in the middle of the picture, and a chart of it in the report.
#[test]
fn a_receiver_of_colours_has_a_picture_in_them() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[run]\nrays = 60_000\n[[source]]\nkind = 'collimated'\nradius = 4\nspectrum = { kind = 'd65' }
        [[receiver]]\nname = 'wall'\nkind = 'disc'\nat = [0, 0, 9]\nradius = 5\ncells = [8, 8]\nchannels = 'xyz'\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "-q"]);
    assert_eq!(code, 0, "{err}");
    let file = std::fs::File::open(folder.path().join("out/wall-colours.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height), (800, 800));
    let pixel = |x: usize, y: usize| [0, 1, 2].map(|c| bytes[3 * (y * 800 + x) + c]);
    // The brightest of all cells is full; by their noise, some per cent, the others are a little darker.
    assert!(pixel(350, 450).iter().all(|byte| *byte > 215), "{:?}", pixel(350, 450));
    assert_eq!(pixel(1, 1), [128; 3], "off the disc there is no cell");
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("wall: colours") && page.contains("white is D65"));
    assert!(folder.path().join("out/figures/wall-colours.png").exists());
}

/// The faces of a lens with what goes through them: as much enters one side as leaves the other, but for Fresnel's share.
#[test]
fn faces_are_listed_with_their_power() {
    let folder = tempfile::tempdir().unwrap();
    let scene = fixture("scenes/s1_lens.toml").display().to_string();
    let arguments = ["trace", &scene, "-o", "out", "--rays", "20000", "--tolerance", "1", "--faces", "2", "--json"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let faces = &document["faces"];
    let first = faces["first"].as_array().unwrap();
    assert!(first.len() <= 2 && faces["count"].as_u64() >= Some(first.len() as u64), "{faces}");
    let of = |key: &str| first.iter().map(|f| f[key].as_f64().unwrap()).fold(0.0, f64::max);
    let (entered, left) = (of("entered"), of("left"));
    assert!(left > 0.8 * entered && left < entered, "{faces}");
    assert!(first.iter().all(|f| !f["selector"].as_str().unwrap().is_empty()), "{faces}");
    let table = std::fs::read_to_string(folder.path().join("out/tables/faces.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + first.len());
    // Facets of 1 mm change what leaves the lens by some 1e-3 of it, and say so.
    let geometric = |key: &str| first.iter().map(|f| f[key].as_f64().unwrap()).fold(0.0, f64::max);
    let error = geometric("left_geometric");
    assert!(error > 0.0 && error < 0.01 * left, "{faces}");

    // On the spline there is no such error but what was lost.
    let arguments =
        ["trace", &scene, "-o", "exact", "--rays", "2000", "--intersector", "exact", "--faces", "2", "--json"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(document["faces"]["first"][0]["left_geometric"], document["power"]["lost"]);
}

/// A point shines evenly: over the whole sphere its light has its mean at γ 90°, over a quarter of the planes C at 45° too. Over all planes
/// C has no mean, and neither figure nor error.
#[test]
fn planes_all_around_have_no_mean() {
    let folder = tempfile::tempdir().unwrap();
    let far = |name: &str, h: &str| {
        format!("[[receiver]]\nname = '{name}'\nkind = 'far_field'\nangles = 'C'\ncells = [8, 6]\n{h}\n")
    };
    let receivers = far("all", "") + &far("quarter", "h_deg = [0, 90]");
    std::fs::write(folder.path().join("scene.toml"), format!("[run]\nrays = 20_000\n[[source]]\n{receivers}"))
        .unwrap();
    let (code, text, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "--json"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&text).unwrap();
    let [all, quarter] = [0, 1].map(|k| &found["receivers"][k]);
    for key in ["centroid", "centroid_error", "rms", "rms_error"] {
        assert!(all[key][0].is_null() && all[key][1].is_number(), "{key}: {}", all[key]);
        assert!(quarter[key][0].is_number() && quarter[key][1].is_number(), "{key}: {}", quarter[key]);
    }
    let figures = all["figures"].as_object().unwrap();
    assert!(!figures.contains_key("centroid_1") && !figures.contains_key("rms_1"), "{figures:?}");
    for (figure, expected) in [
        (&all["figures"]["centroid_2"], 90.0),
        (&quarter["figures"]["centroid_1"], 45.0),
        (&quarter["figures"]["centroid_2"], 90.0),
    ] {
        let [value, error] = ["value", "statistical"].map(|key| figure[key].as_f64().unwrap());
        assert!(error > 0.0 && (value - expected).abs() < 4.0 * error, "{figure}");
    }
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("Along an angle that goes all around there is no mean position"));
}

/// A beam against the normal lies where H of type A and of spheres, and V of type B, begin and end. Along the other angle its mean is 0,
/// and its mean square, of an even cone of the half angle a = 5° about a direction on the equator, a²/4: 2.5°, up to terms of a⁴.
#[test]
fn an_angle_of_type_a_or_b_all_around_has_no_mean() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[run]\nrays = 20_000\n[[source]]\nkind = 'cone'\nhalf_angle_deg = 5\ndirection = [0, 0, -1]\n\
        [[receiver]]\nname = 'A'\nkind = 'far_field'\nh_deg = [-180, 180]\n\
        [[receiver]]\nname = 'B'\nkind = 'far_field'\nangles = 'B'\nv_deg = [-180, 180]\n\
        [[receiver]]\nname = 'ball'\nkind = 'sphere'\nradius = 9\nabsorbs = false\n\
        [[receiver]]\nname = 'behind'\nkind = 'far_field'\nnormal = [0, 0, -1]\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, text, err) =
        lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "--json", "--no-report"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&text).unwrap();
    for (k, cyclic) in [(0, 0), (1, 1), (2, 0)] {
        let receiver = &found["receivers"][k];
        let other = 1 - cyclic;
        for key in ["centroid", "centroid_error", "rms", "rms_error"] {
            let pair = &receiver[key];
            assert!(pair[cyclic].is_null() && pair[other].is_number(), "{} {key}: {pair}", receiver["name"]);
        }
        let figures = receiver["figures"].as_object().unwrap();
        for name in ["centroid", "rms"] {
            assert!(!figures.contains_key(&format!("{name}_{}", cyclic + 1)), "{figures:?}");
        }
        let [mean, width] = ["centroid", "rms"].map(|key| receiver[key][other].as_f64().unwrap());
        assert!(mean.abs() < 0.1 && (width - 2.5).abs() < 0.05, "{}: {mean} {width}", receiver["name"]);
    }
    // Half a space has its ends apart.
    let behind = &found["receivers"][3];
    assert!(behind["centroid"][0].is_number() && behind["rms"][1].is_number(), "{behind}");
}

/// A beam aside passes one of two planes across each other, one about the pole both. Against the normal planes end within the beam.
#[test]
fn the_width_at_half_is_told_in_planes_that_have_the_peak() {
    for (direction, widths) in [("[-0.3, 0.1, 1]", 1), ("[0, 0, 1]", 2), ("[0, 0, -1]", 0)] {
        let folder = tempfile::tempdir().unwrap();
        let scene = format!(
            "[run]\nrays = 20_000\nunit = 'lm'\n[[source]]\nkind = 'cosine'\nexponent = 200\ndirection = {direction}\n\
            [[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 36]\n\
            [[receiver]]\nname = 'half'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 90]\ncells = [36, 18]\n"
        );
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "-q"]);
        assert_eq!(code, 0, "{err}");
        let table = std::fs::read_to_string(folder.path().join("out/tables/far-lamp.csv")).unwrap();
        assert_eq!(table.matches("width at half").count(), widths, "{table}");
        // What is dark is brightest nowhere.
        let half = std::fs::read_to_string(folder.path().join("out/tables/half-lamp.csv")).unwrap();
        let brightest = half.lines().find(|line| line.starts_with("Imax,")).unwrap();
        assert_eq!(brightest.starts_with("Imax,0,") && brightest.ends_with(",cd,"), widths == 0, "{half}");
    }
}

/// Light that did not come has no place: neither 0 nor any other.
#[test]
fn a_receiver_without_light_has_no_centroid() {
    let collimated = |receivers: &str| {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("[run]\nrays = 2000\n[[source]]\nkind = 'collimated'\n{receivers}");
        std::fs::write(folder.path().join("scene.toml"), text).unwrap();
        let args = ["trace", "scene.toml", "-o", "out", "--json", "--no-report"];
        let (code, text, err) = lampyris_in(folder.path(), &args);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let plane =
        |z: f64| format!("[[receiver]]\nname = 'at {z}'\nat = [0, 0, {z}]\nsize = [4, 4]\ncells = [2, 2]\n");
    let found = collimated(&(plane(9.0) + &plane(-9.0)));
    for key in ["centroid", "centroid_error", "rms", "rms_error"] {
        assert!(found["receivers"][0][key].is_array(), "{key}");
        assert!(found["receivers"][1][key].is_null(), "{key}");
    }
}

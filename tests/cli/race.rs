//! `study bvh` with the real binary: rows, pictures, the octree's shape as text and as boxes to turn around.

use crate::files::fixture;
use crate::support::lampyris;
use serde_json::Value;
use std::path::Path;

#[test]
fn the_race_writes_rows_pictures_and_the_octree() {
    let folder = tempfile::tempdir().unwrap();
    let model = fixture("step/lens_planoconvex_nurbs.stp").display().to_string();
    let path = folder.path().display().to_string();
    let options = ["--json", "--tolerance", "0.01", "--rays", "600", "--threads", "2", "-o", &path, &model];
    let (code, out, err) = lampyris(&[&["study", "bvh"][..], &options].concat());
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let rows = document["rows"].as_array().unwrap();
    // Eight contenders, four kinds of rays; batch and single on one thread, batch on two.
    assert_eq!(rows.len(), 8 * 4 * 3);
    for row in rows {
        assert!(row["mrays_per_s_median"].as_f64().unwrap() > 0.0, "{row}");
        assert!(row["facets"].as_u64().unwrap() > 100, "{row}");
        // These three work in f32, or take starts on facets for what they are, rounded.
        let as_shipped = ["cwbvh as shipped", "parry3d", "bvh"].iter().any(|name| row["intersector"] == *name);
        if !as_shipped {
            assert_eq!((&row["wrong"], &row["undecided"]), (&Value::from(0), &Value::from(0)), "{row}");
            assert_eq!(row["differs"], 0, "{row}");
        }
    }
    for threads in [1, 2] {
        assert!(rows.iter().any(|r| r["threads"] == threads && r["rays_kind"] == "adversarial"));
    }
    let surface: Vec<_> = rows.iter().filter(|r| r["rays_kind"] == "surface").collect();
    assert_eq!(surface.len(), 8 * 3);
    assert!(surface.iter().all(|r| r["hits"].as_u64() > Some(0) && r["hits"].as_u64() <= r["rays"].as_u64()));
    ask_again(folder.path(), &model, surface[0]);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let text = String::from_utf8(read("octree.txt")).unwrap();
    for part in ["depth", "listed", "bytes a facet", "incoherent rays:", "nodes and", "blocks of 1, 2, 3, 4 facets"]
    {
        assert!(text.contains(part), "{part} in {text}");
    }
    let csv = String::from_utf8(read("tables/bvh-rows.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + rows.len());
    for file in [
        "report.html",
        "study.json",
        "tables/octree.csv",
        "figures/rates-incoherent.svg",
        "figures/octree-depths.svg",
    ] {
        assert!(!read(file).is_empty());
    }
    // Rates of two kinds of call: the headline says which is whose.
    let page = String::from_utf8(read("report.html")).unwrap();
    assert!(page.contains("queried in batches") && page.contains("by the faster of its two calls"));
    boxes_are_closed_and_hold_the_lens(folder.path());
}

/// Rays that leave facets are the same question when they are read again: without the facets they would meet those that they start on.
fn ask_again(folder: &Path, model: &str, first: &Value) {
    let list = folder.join(format!("rays/surface-{}.npz", first["facets"])).display().to_string();
    let path = folder.join("again").display().to_string();
    let options = ["--json", "--tolerance", "0.01", "--rays-in", &list, "--threads", "1", "-o", &path, model];
    let (code, out, err) = lampyris(&[&["study", "bvh"][..], &options].concat());
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let row = document["rows"].as_array().unwrap().iter().find(|row| row["intersector"] == first["intersector"]);
    let row = row.unwrap();
    assert_eq!((&row["rays"], &row["hits"]), (&first["rays"], &first["hits"]), "{row}");
}

#[test]
fn the_race_asks_the_rays_of_a_file_and_keeps_them() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("rays.csv");
    // Down the axis of the lens and beside it, and one that leaves everything behind it.
    std::fs::write(&list, "x,y,z,dx,dy,dz,power\n0,0,50,0,0,-1,1\n1,2,50,0,0,-1,1\n0,0,50,0,0,1,1\n").unwrap();
    let model = fixture("step/lens_planoconvex_nurbs.stp").display().to_string();
    let path = folder.path().join("out").display().to_string();
    let list = list.display().to_string();
    let options = ["--json", "--tolerance", "0.05", "--rays-in", &list, "--threads", "1", "-o", &path, &model];
    let (code, out, err) = lampyris(&[&["study", "bvh"][..], &options].concat());
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let rows = document["rows"].as_array().unwrap();
    // Eight contenders, batch and single.
    assert_eq!(rows.len(), 8 * 2);
    for row in rows {
        assert_eq!(
            (&row["rays_kind"], &row["rays"], &row["hits"]),
            (&"given".into(), &3.into(), &2.into()),
            "{row}"
        );
    }
    let kept = Path::new(&path).join(format!("rays/given-{}.npz", rows[0]["facets"]));
    let mut zip = zip::ZipArchive::new(std::fs::File::open(&kept).unwrap()).unwrap();
    let mut array = |name: &str| -> Vec<f64> {
        npyz::NpyFile::new(zip.by_name(&format!("{name}.npy")).unwrap()).unwrap().into_vec().unwrap()
    };
    assert_eq!(array("origin"), [0.0, 0.0, 50.0, 1.0, 2.0, 50.0, 0.0, 0.0, 50.0]);
    assert_eq!(array("direction"), [0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0]);
    assert_eq!(array("facet"), [-1.0; 3]);
    // What was kept, without powers, is the same question.
    let (list, path) = (kept.display().to_string(), folder.path().join("again").display().to_string());
    let options = ["--json", "--tolerance", "0.05", "--rays-in", &list, "--threads", "1", "-o", &path, &model];
    let (code, out, err) = lampyris(&[&["study", "bvh"][..], &options].concat());
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    for row in document["rows"].as_array().unwrap() {
        assert_eq!((&row["rays"], &row["hits"]), (&3.into(), &2.into()), "{row}");
    }
}

/// Boxes as other programs read them: six quads each, inside the lens' own box grown by a step of the nodes.
fn boxes_are_closed_and_hold_the_lens(folder: &Path) {
    let vtk = vtkio::Vtk::import(folder.join("octree.vtu")).unwrap();
    let vtkio::model::DataSet::UnstructuredGrid { pieces, .. } = vtk.data else { panic!("no grid") };
    let vtkio::model::Piece::Inline(piece) = &pieces[0] else { panic!("no piece") };
    let cells = piece.cells.types.len();
    assert!(cells > 0 && cells % 6 == 0, "{cells}");
    let (document, buffers, _) = gltf::import(folder.join("octree.glb")).unwrap();
    assert!(document.meshes().count() > 0 && !buffers.is_empty());
    let names: Vec<_> = document.nodes().filter_map(|n| n.name().map(str::to_owned)).collect();
    assert!(names.iter().any(|n| n.starts_with("depth ")), "{names:?}");
}

//! `check` with the real binary: rays that were answered differently can be written out and traced again.

use crate::files::fixture;
use crate::support::lampyris;
use serde_json::Value;

fn check(arguments: &[&str]) -> Value {
    let file = fixture("step/reflector_freeform_trimmed.stp").display().to_string();
    let (code, out, err) = lampyris(&[&["check", &file, "--json"], arguments].concat());
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

fn count(document: &Value, path: &str) -> u64 {
    document.pointer(path).and_then(Value::as_u64).unwrap_or_else(|| panic!("{path} is missing"))
}

#[test]
fn what_was_answered_differently_is_so_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("odd.rays").display().to_string();
    let first = check(&["--rays", "9000", "--disagreements", &file]);
    assert_eq!(count(&first, "/rays"), 9000);
    assert_eq!(count(&first, "/facets_vs_exact/unexplained"), 0);
    assert_eq!(count(&first, "/octree_vs_bvh/disagree"), 0);
    // Seven little-endian numbers a ray.
    let written = std::fs::metadata(&file).unwrap().len() / 56;
    assert!(written > 0, "facets and spline must differ somewhere at silhouettes and trims");
    let again = check(&["--replay", &file]);
    assert_eq!(count(&again, "/rays"), written);
    for path in [
        "/facets_vs_exact/hit_miss",
        "/facets_vs_exact/other_face",
        "/facets_vs_exact/explained/silhouette",
        "/facets_vs_exact/explained/trim_edge",
        "/facets_vs_exact/explained/coincident",
    ] {
        assert_eq!(count(&first, path), count(&again, path), "{path}");
    }
    let differ = count(&again, "/facets_vs_exact/hit_miss") + count(&again, "/facets_vs_exact/other_face");
    assert!(differ > 0 && differ <= written, "{again}");
}

#[test]
fn the_report_of_a_check_shows_the_disagreeing_rays() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().display().to_string();
    let found = check(&["--rays", "9000", "-o", &output]);
    assert_eq!(found["normals"], "bilinear");
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Rays that are answered differently") && page.contains("trim edge"), "{}", &page[..500]);
    assert!(folder.path().join("figures/disagreeing.png").is_file());
    let rays = std::fs::read_to_string(folder.path().join("tables/odd-rays.csv")).unwrap();
    let listed = rays.lines().count() as u64 - 1;
    let differ = count(&found, "/facets_vs_exact/hit_miss") + count(&found, "/facets_vs_exact/other_face");
    assert!(listed >= differ.min(500) && differ > 0, "{listed} of {differ}");
    let causes = std::fs::read_to_string(folder.path().join("tables/causes.csv")).unwrap();
    let trim = count(&found, "/facets_vs_exact/explained/trim_edge");
    assert!(causes.lines().any(|l| l.starts_with(&format!("trim edge,{trim},"))), "{causes}");
    let kept = std::fs::read_to_string(folder.path().join("check.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&kept).unwrap()["facets_vs_exact"], found["facets_vs_exact"]);
}

#[test]
fn normals_that_an_accuracy_chose_are_those_that_are_measured() {
    let found = check(&["--rays", "6000", "--accuracy", "0.0001deg"]);
    assert_eq!((&found["normals"], &found["accuracy"]["normals"]), (&"exact".into(), &"exact".into()));
    // Facets of this tolerance alone err by tenths of a degree.
    let p99 = found.pointer("/facets_vs_exact/normal_error_deg/p99").and_then(Value::as_f64).unwrap();
    assert!(p99 < 1e-4, "{p99}");
}

/// The file of a lens, placed so often, 45 mm from each other along x: an assembly around the lens' own product and shape.
fn row_of_lenses(count: usize) -> String {
    let lens = std::fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    let mut lines = "#9000=PRODUCT_DEFINITION('','',$,#9);\n#9001=SHAPE_REPRESENTATION('',(#11),#185);\n\
                     #9002=PRODUCT_DEFINITION_SHAPE('','',#9000);\n#9003=SHAPE_DEFINITION_REPRESENTATION(#9002,#9001);\n"
        .to_owned();
    for k in 0..count {
        let [point, axes, moved, related, usage, shape, placed] = std::array::from_fn(|i| 10_000 + 10 * k + i);
        lines += &format!(
            "#{point}=CARTESIAN_POINT('',({:?},0.,0.));\n#{axes}=AXIS2_PLACEMENT_3D('',#{point},#13,#14);\n\
             #{moved}=ITEM_DEFINED_TRANSFORMATION('','',#11,#{axes});\n\
             #{related}=(REPRESENTATION_RELATIONSHIP('','',#10,#9001)\
             REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{moved})SHAPE_REPRESENTATION_RELATIONSHIP());\n\
             #{usage}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('','','',#9000,#5,$);\n\
             #{shape}=PRODUCT_DEFINITION_SHAPE('','',#{usage});\n\
             #{placed}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{related},#{shape});\n",
            45.0 * k as f64
        );
    }
    let end = lens.rfind("ENDSEC;").unwrap();
    format!("{}{lines}{}", &lens[..end], &lens[end..])
}

#[test]
fn parts_that_are_placed_often_are_built_once() {
    let folder = tempfile::tempdir().unwrap();
    let found = [1, 70].map(|count| {
        let path = folder.path().join(format!("{count}.stp"));
        std::fs::write(&path, row_of_lenses(count)).unwrap();
        let (code, out, err) = lampyris(&["check", &path.display().to_string(), "--json", "--rays", "9000"]);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str::<Value>(&out).unwrap()
    });
    let [one, many] = &found;
    assert_eq!(count(many, "/scene/facets"), 70 * count(one, "/scene/facets"));
    assert_eq!(count(many, "/scene/patches"), count(one, "/scene/patches"));
    // Some hundred rays, because the row is thin beside its length, and each is answered as the spline answers it.
    assert!(count(many, "/hits") > 500);
    assert_eq!([count(many, "/facets_vs_exact/unexplained"), count(many, "/octree_vs_bvh/disagree")], [0, 0]);
}

/// Rays within a lens that is thinner than what keeps them clear of coarse facets are traced within it.
#[test]
fn rays_within_a_thin_wall_start_within_it() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!(
        "[[model]]\nfile = '{}'\n[[medium]]\nname = 'glass'\nindex = 1.5168\n[[material]]\npart = '*'\nmedium = 'glass'\n\
         [[source]]\nkind = 'collimated'\nat = [0, 0, -10]\nradius = 10\n\
         [[receiver]]\nname = 'focus'\nat = [0, 0, 107.026853]\nsize = [40, 40]\ncells = [20, 20]\n",
        fixture("step/lens_planoconvex_nurbs.stp").display()
    );
    let path = folder.path().join("lens.toml");
    std::fs::write(&path, scene).unwrap();
    let file = path.display().to_string();
    let (code, out, err) = lampyris(&["check", &file, "--json", "--rays", "3000", "--tolerance", "3"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(count(&found, "/rays"), 3000);
    // A third come from the source, a third begin within the lens, 7 mm thick, and meet its other side; 12 mm off their side they would
    // not.
    assert!(count(&found, "/hits") > 1900, "{found}");
    assert!(count(&found, "/facets_vs_exact/hit_miss") < 30, "{}", found["facets_vs_exact"]);
}

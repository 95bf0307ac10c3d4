//! The report form: one self-contained page that a real browser draws, static twins and CSV beside it.

use lampyris::formats::{Axis, ColourMap, Facets, Grid, Group, Polylines};
use lampyris::math::{FaceId, Point, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use lampyris::report::{AxisStyle, Chart, Content, Provenance, Report, Section, Series, SeriesStyle, Table, View};
use std::path::Path;
use std::process::Command;

/// A saddle of quads over ±50 mm.
fn saddle(n: u32) -> FacetMesh {
    let at = |k: u32| 100.0 * f64::from(k) / f64::from(n) - 50.0;
    let grid = || (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let positions: Vec<Point> = grid().map(|(i, j)| Point::new(at(i), at(j), at(i) * at(j) / 60.0)).collect();
    let normal = |(i, j)| Vector::new(-at(j) / 60.0, -at(i) / 60.0, 1.0).normalize();
    let vertices =
        grid().enumerate().map(|(k, ij)| MeshVertex { position: k as u32, normal: normal(ij), uv: Uv::ZERO });
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let facets = (0..n * n).map(|k| {
        let (i, j) = (k % n, k / n);
        let vertices = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        Facet { vertices, face: FaceId(i * 2 / n) }
    });
    FacetMesh {
        positions,
        vertices: vertices.collect(),
        facets: facets.collect(),
        sag: vec![0.1; (n * n) as usize],
    }
}

fn sample(n: u32) -> Report {
    let mesh = saddle(n);
    let facets = Facets {
        groups: vec![Group::solid("left </script><b>", [0.2, 0.5, 0.9]), Group::solid("right", [0.9, 0.6, 0.2])],
        group_of_face: vec![0, 1],
        ..Facets::plain(&mesh, "")
    };
    let mut paths = Polylines::default();
    paths.push([Point::new(0.0, 0.0, 80.0), Point::ZERO, Point::new(1e6, 0.0, 1e6)]);
    let error: Vec<f64> = (0..mesh.facets.len()).map(|k| k as f64).collect();
    let axis = |label: &str| Axis { label: label.into(), unit: "deg".into(), range: [-3.0, 3.0], cells: 30 };
    let bump =
        |k: usize| (-((k % 30) as f64 - 15.0).powi(2) / 40.0 - ((k / 30) as f64 - 12.0).powi(2) / 20.0).exp();
    let grid = Grid {
        name: "far".into(),
        quantity: "luminous intensity".into(),
        unit: "cd".into(),
        axes: [axis("H"), axis("V")],
        values: (0..900).map(|k| 1200.0 * bump(k)).collect(),
        error: None,
        geometric: None,
        layers: Vec::new(),
    };
    let line = |name: &str, style, power: i32| Series {
        name: name.into(),
        points: (1..8).map(|k| [f64::from(k), f64::from(k).powi(power)]).collect(),
        style,
        ..Series::default()
    };
    let axes = [AxisStyle::log("tolerance", "mm"), AxisStyle::log("error", "deg")];
    let series = vec![line("measured", SeriesStyle::LineAndPoints, 2), line("theory", SeriesStyle::Dashed, 1)];
    let mut table = Table::new("times", "Times", &[("step", ""), ("time", "s"), ("rays", "")]);
    table.row(["read".into(), 0.25.into(), 1_000_000usize.into()]);
    table.row(["trace".into(), 1.5.into(), 7usize.into()]);
    let bars = Chart {
        content: Content::Bars {
            categories: vec!["octree".into(), "bvh".into()],
            layers: vec![("build".into(), vec![Some(1.0), None]), ("trace".into(), vec![Some(3.0), Some(1.0)])],
            stacked: true,
        },
        ..Chart::series(
            "bars",
            "Where time goes",
            "Stacked.",
            [AxisStyle::default(), AxisStyle::linear("time", "s")],
            vec![],
        )
    };
    Report {
        title: "A sample".into(),
        answer: "The answer is **42 cd** & no <more>.".into(),
        sections: vec![
            Section::new("Light")
                .with_block(Chart::map("far", "Far field", "Straight ahead is 0, 0.", grid))
                .with_block(View::of_facets("facets", "Facets", &facets).lines(
                    "rays",
                    &paths.inside(&mesh.bounds().grown(20.0)),
                    [1.0, 0.7, 0.1],
                )),
            Section::new("Cost")
                .with_block(Chart::series("front", "Front", "Lower left is better.", axes, series))
                .with_block(bars)
                .with_block(View::of_values("error", "Error", &facets, "error (deg)", &error, ColourMap::Viridis))
                .with_block(table)
                .with_block("Some **words**."),
        ],
        provenance: Provenance { command: "lampyris demo".into(), seed: Some(1), ..Provenance::default() },
    }
}

#[test]
fn the_page_stands_alone_and_its_parts_lie_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let written = sample(40).write(folder.path()).unwrap();
    let names: Vec<String> = (written.iter())
        .map(|p| p.strip_prefix(folder.path()).unwrap().to_string_lossy().replace('\\', "/"))
        .collect();
    assert_eq!(
        names,
        [
            "report.html",
            "figures/far.svg",
            "figures/far.png",
            "figures/facets.png",
            "figures/front.svg",
            "figures/front.png",
            "figures/bars.svg",
            "figures/bars.png",
            "figures/error.png",
            "tables/times.csv"
        ]
    );
    let page = std::fs::read_to_string(&written[0]).unwrap();
    assert!(page.len() < 15_000_000, "{} bytes", page.len());
    assert!(page.contains("default-src 'none'"), "the browser itself is told to load nothing");
    // plotly.js names addresses in texts that it never shows here.
    let ours: Vec<&str> = page.split("<script").filter(|piece| piece.len() < 2_000_000).collect();
    let ours = ours.concat().replace("http://www.w3.org/2000/svg", "the name of a language, not an address");
    assert!(!ours.contains("http://") && !ours.contains("https://"), "an address in the page");
    assert!(page.contains("<strong>42\u{a0}cd</strong> &amp; no &lt;more&gt;"));
    // Of narrow triangles too: by its default plotly gives those no normal, and they stand black in a flat face.
    assert!(ours.contains("\"facenormalsepsilon\":0.0"), "every triangle has its normal");
    assert!(!page.contains("left </script>"), "a name may not end a script");
    assert_eq!(
        std::fs::read_to_string(&written[9]).unwrap(),
        "step,time (s),rays\nread,0.25,1000000\ntrace,1.5,7\n"
    );
    let picture = image::open(&written[3]).unwrap().to_rgb8();
    let lit = picture.pixels().filter(|p| p.0[2] > 120 && p.0[0] < 100).count();
    assert!(lit > 20_000, "the blue half of the saddle covers {lit} pixels");
    // The map's picture and the chart's words, on white.
    for chart in [2, 5] {
        let picture = image::open(&written[chart]).unwrap().to_rgb8();
        let dark = picture.pixels().filter(|p| p.0.iter().all(|c| *c < 90)).count();
        assert_eq!(picture.get_pixel(2, 2).0, [255; 3]);
        assert!(dark > 1500, "{} has {dark} dark pixels", names[chart]);
    }
}

#[test]
fn a_large_mesh_is_simplified_for_showing_and_says_so() {
    let page = sample(400).to_html();
    assert!(page.len() < 15_000_000, "{} bytes", page.len());
    assert!(page.contains("Shown simplified"));
}

/// Where a Chromium is installed, if it is.
fn chromium() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome", "/usr/bin/chromium"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success()))
}

/// The page after its scripts have run.
fn browsed(browser: &str, page: &Path) -> String {
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_browser_draws_every_picture() {
    let Some(browser) = chromium() else {
        eprintln!("SKIPPED: no Chromium is installed, the page was not opened in a browser");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let written = sample(20).write(folder.path()).unwrap();
    let dom = browsed(browser, &written[0]);
    let ready = dom.split("data-ready=\"").nth(1).and_then(|rest| rest.split('"').next());
    // The 3-D views may fall back to their static picture where there is no WebGL; the three charts may not.
    let drawn: usize = ready
        .and_then(|n| n.parse().ok())
        .unwrap_or_else(|| panic!("the script did not end: {}", &dom[..400.min(dom.len())]));
    assert!(drawn >= 3, "{drawn} of 5 pictures drawn");
    for chart in ["fig-far", "fig-front", "fig-bars"] {
        let tag = dom.split(&format!("id=\"{chart}\"")).nth(1).unwrap().split('>').next().unwrap();
        assert!(tag.contains("data-drawn=\"yes\""), "{chart}: {tag}");
    }
}

/// The page may run its own scripts alone, by their hash, and turn no text into code.
#[test]
fn scripts_run_by_their_hash_alone() {
    let page = sample(20).to_html();
    let policy = page.split("Content-Security-Policy\" content=\"").nth(1).unwrap().split('"').next().unwrap();
    let scripts = policy.split(';').find(|p| p.trim().starts_with("script-src")).unwrap();
    assert!(scripts.contains("'sha256-") && !scripts.contains("unsafe"), "{scripts}");
    assert_eq!(scripts.matches("'sha256-").count(), page.matches("<script>").count());
    // A script that got into the page all the same does not run.
    let Some(browser) = chromium() else {
        eprintln!("SKIPPED: no Chromium is installed, the page was not opened in a browser");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    let smuggled = page.replacen("<main>", "<main><script>document.title = 'run'</script>", 1);
    std::fs::write(&path, smuggled).unwrap();
    let dom = browsed(browser, &path);
    assert!(dom.contains("data-ready") && !dom.contains("<title>run</title>"), "{}", &dom[..400.min(dom.len())]);
}

#[test]
#[ignore = "writes the sample report to LAMPYRIS_SAMPLE for people to look at"]
fn sample_for_people() {
    if let Some(folder) = std::env::var_os("LAMPYRIS_SAMPLE") {
        sample(60).write(Path::new(&folder)).unwrap();
    }
}

//! Every facet file opens in a reader that others wrote, with the numbers that went in.

use lampyris::formats::{Facets, Group, Polylines, is_facet_file, is_unprintable, read_data2, write_facets};
use lampyris::math::{FaceId, Point, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

/// Two faces at a right angle along the y axis: a quad in the plane z = 0 and a triangle in the plane x = 0.
fn corner_mesh() -> FacetMesh {
    let positions = vec![
        Point::ZERO,
        Point::new(2.1, 0.0, 0.0),
        Point::new(2.1, 1.0 / 3.0, 0.0),
        Point::new(0.0, 1.0 / 3.0, 0.0),
        Point::new(0.0, 0.1, 0.7),
    ];
    let vertex = |position, normal| MeshVertex { position, normal, uv: Uv::new(f64::from(position), 0.5) };
    let mut vertices: Vec<MeshVertex> = (0..4).map(|p| vertex(p, Vector::Z)).collect();
    vertices.extend([0, 3, 4].map(|p| vertex(p, Vector::X)));
    let facets =
        vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }, Facet { vertices: [4, 5, 6, 6], face: FaceId(1) }];
    FacetMesh { positions, vertices, facets, sag: vec![0.015, 0.03] }
}

fn two_parts(mesh: &FacetMesh) -> Facets<'_> {
    let group = |name: &str, colour, index_ratio| Group { index_ratio, ..Group::solid(name, colour) };
    Facets {
        groups: vec![group("clear cover", [0.2, 0.5, 1.0], 1.0 / 1.4906), group("housing", [1.0, 0.0, 0.0], 1.0)],
        group_of_face: vec![0, 1],
        normal_error_deg: vec![0.5, 0.25],
        curvature_per_mm: vec![0.0, 0.125],
        ..Facets::plain(mesh, "")
    }
}

fn written(name: &str, facets: &Facets) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write_facets(&path, facets).unwrap();
    (folder, path)
}

#[test]
fn obj_opens_in_tobj() {
    let mesh = corner_mesh();
    let (_folder, path) = written("a.obj", &two_parts(&mesh));
    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).unwrap();
    assert_eq!(models.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["clear_cover", "housing"]);
    let [quad, triangle] = [&models[0].mesh, &models[1].mesh];
    assert_eq!((quad.indices.len(), triangle.indices.len()), (4, 3));
    assert_eq!(quad.face_arities, [4]);
    let positions: Vec<f32> = mesh.positions[..4].iter().flat_map(|p| p.as_vec3().to_array()).collect();
    assert_eq!(quad.positions, positions);
    assert_eq!(triangle.normals[..3], [1.0, 0.0, 0.0]);
}

#[test]
fn ply_opens_in_ply_rs() {
    use ply_rs_bw::ply::{DefaultElement, Property};
    let mesh = corner_mesh();
    let (_folder, path) = written("a.ply", &two_parts(&mesh));
    let parser = ply_rs_bw::parser::Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut BufReader::new(File::open(path).unwrap())).unwrap();
    let payload = |element: &str| &ply.payload[element];
    assert_eq!(payload("vertex").len(), 7);
    assert_eq!(payload("vertex")[2]["y"], Property::Double(1.0 / 3.0));
    assert_eq!(payload("vertex")[5]["nx"], Property::Double(1.0));
    assert_eq!(payload("face")[0]["vertex_indices"], Property::ListUInt(vec![0, 1, 2, 3]));
    assert_eq!(payload("face")[1]["vertex_indices"], Property::ListUInt(vec![4, 5, 6]));
    assert_eq!(payload("face")[1]["part"], Property::UInt(1));
    assert_eq!(payload("face")[1]["sag"], Property::Double(0.03));
}

#[test]
fn stl_opens_in_stl_io() {
    let mesh = corner_mesh();
    let (_folder, path) = written("a.stl", &two_parts(&mesh));
    let stl = stl_io::read_stl(&mut File::open(path).unwrap()).unwrap();
    assert_eq!(stl.faces.len(), 3, "a quad is two triangles, a triangle one");
    let corner = |face: usize| stl.faces[face].vertices.map(|v| glam::Vec3::from_array(stl.vertices[v].0));
    let single = |list: [usize; 3]| list.map(|p| mesh.positions[p].as_vec3());
    assert_eq!([0, 1, 2].map(corner), [[0, 1, 2], [0, 2, 3], [0, 3, 4]].map(single));
    let area: f32 = (stl.faces.iter())
        .map(|f| {
            let [a, b, c] = f.vertices.map(|v| glam::Vec3::from_array(stl.vertices[v].0));
            assert!((b - a).cross(c - a).dot(glam::Vec3::from_array(f.normal.0)) > 0.0);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    // 2.1 · 1/3 and ½ · 1/3 · 0.7.
    assert!((area - (0.7 + 0.35 / 3.0)).abs() < 1e-6, "{area}");
}

#[test]
fn vtu_opens_in_vtkio() {
    use vtkio::model::{Attribute, CellType, UnstructuredGridPiece, Vtk};
    let mesh = corner_mesh();
    let (_folder, path) = written("a.vtu", &two_parts(&mesh));
    let vtk = Vtk::import(path).unwrap();
    let piece: UnstructuredGridPiece = vtk.data.try_into().unwrap();
    assert_eq!(piece.cells.types, [CellType::Quad, CellType::Triangle]);
    assert_eq!(piece.cells.cell_verts.into_xml(), (vec![0, 1, 2, 3, 4, 5, 6], vec![4, 7]));
    assert_eq!(piece.points.cast_into::<f64>().unwrap()[..3], [0.0; 3]);
    let cell = |name: &str| {
        let found = piece.data.cell.iter().find(|a| a.name() == name).unwrap_or_else(|| panic!("no {name}"));
        let Attribute::DataArray(array) = found else { panic!("{name} is a field") };
        array.data.cast_into::<f64>().unwrap()
    };
    assert_eq!(cell("sag_mm"), [0.015, 0.03]);
    assert_eq!(cell("normal_error_deg"), [0.5, 0.25]);
    assert_eq!(cell("curvature_per_mm"), [0.0, 0.125]);
    assert_eq!(cell("face_id"), [0.0, 1.0]);
    assert_eq!(cell("part"), [0.0, 1.0]);
}

#[test]
fn glb_opens_in_gltf() {
    let mesh = corner_mesh();
    let mut paths = Polylines::default();
    paths.push([Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0)]);
    let facets = Facets { paths: Some(&paths), ..two_parts(&mesh) };
    let (_folder, path) = written("a.glb", &facets);
    let (document, buffers, _) = gltf::import(path).unwrap();
    let names: Vec<_> = document.nodes().filter(|n| n.mesh().is_some()).map(|n| n.name().unwrap()).collect();
    assert_eq!(names, ["clear cover", "housing", "ray paths"]);
    let root = document.default_scene().unwrap().nodes().next().unwrap();
    let matrix = glam::Mat4::from_cols_array_2d(&root.transform().matrix());
    let clear = document.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(clear.material().pbr_metallic_roughness().base_color_factor()[2], 1.0);
    let reader = clear.reader(|b| Some(&buffers[b.index()]));
    let positions: Vec<_> = reader.read_positions().unwrap().collect();
    // (2.1, 0, 0) mm with z up is (0.0021, 0, 0) m with y up; (x, y, 0) goes to (x, 0, −y).
    let far = matrix.transform_point3(positions[2].into());
    assert!((far - glam::Vec3::new(2.1e-3, 0.0, -1e-3 / 3.0)).length() < 1e-9, "{far}");
    assert_eq!(reader.read_indices().unwrap().into_u32().collect::<Vec<_>>(), [0, 1, 2, 0, 2, 3]);
    let housing = document.meshes().nth(1).unwrap().primitives().next().unwrap();
    let reader = housing.reader(|b| Some(&buffers[b.index()]));
    assert_eq!(reader.read_indices().unwrap().into_u32().collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!(reader.read_normals().unwrap().collect::<Vec<_>>(), [[1.0, 0.0, 0.0]; 3]);
    for (p, at) in reader.read_positions().unwrap().zip([0, 3, 4]) {
        let p = matrix.transform_point3(p.into()).as_dvec3();
        let Point { x, y, z } = mesh.positions[at];
        assert!((p - 1e-3 * Vector::new(x, z, -y)).length() < 1e-9, "{p}");
    }
    let lines = document.meshes().nth(2).unwrap().primitives().next().unwrap();
    assert_eq!(lines.mode(), gltf::mesh::Mode::Lines);
    let reader = lines.reader(|b| Some(&buffers[b.index()]));
    assert_eq!(reader.read_indices().unwrap().into_u32().collect::<Vec<_>>(), [0, 1, 1, 2]);
}

#[test]
fn glb_of_nothing_is_still_a_glb() {
    let mesh = FacetMesh::default();
    let (_folder, path) = written("a.glb", &Facets::plain(&mesh, "empty"));
    assert_eq!(gltf::import(path).unwrap().0.meshes().count(), 0);
}

/// Names are escaped where JSON lets them stand as they are, and read back unchanged.
#[test]
fn names_in_glb_hold_no_terminal_codes() {
    let mesh = corner_mesh();
    let mut facets = two_parts(&mesh);
    facets.groups[0].name = "\u{1b}[31m\u{9b}2J\u{202e}\u{7f}end".into();
    let (_folder, path) = written("a.glb", &facets);
    let bytes = std::fs::read(&path).unwrap();
    // The JSON chunk comes first: its length stands behind the head of 12 bytes.
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let text = std::str::from_utf8(&bytes[20..20 + length]).unwrap();
    assert_eq!(text.find(is_unprintable), None);
    let (document, _, _) = gltf::import(path).unwrap();
    assert_eq!(document.materials().next().unwrap().name(), Some(facets.groups[0].name.as_str()));
}

#[test]
fn data2_is_a_count_and_sixteen_numbers_a_facet() {
    let mesh = corner_mesh();
    let (_folder, path) = written("a.data2", &two_parts(&mesh));
    let text = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "2");
    let first: Vec<f64> = lines[1].split(' ').map(|w| w.parse().unwrap()).collect();
    let third = 1.0 / 3.0;
    let layout = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.1, 0.0, 0.0, 2.1, third, 0.0, 0.0, third, 0.0, 1.0 / 1.4906];
    assert_eq!(first, layout, "normal, four corners, index ratio");
    assert_eq!(lines.len(), 3, "a line a facet");
    assert_eq!(lines[2].split(' ').count(), 16, "a triangle repeats its last corner");
    let facets = read_data2(&path).unwrap();
    assert_eq!(facets[1].corners[2], facets[1].corners[3]);
    assert_eq!(facets[1].normal, Vector::X);
    assert_eq!(facets[0].corners[1], Point::new(2.1, 0.0, 0.0));
}

#[test]
fn a_damaged_data2_names_the_line() {
    let folder = tempfile::tempdir().unwrap();
    for (text, at) in
        [("", ":1:"), ("2\n0 0 1\n", ":2:"), ("1\n", ":1:"), ("1\n0 0 nan 1 1 1 1 1 1 1 1 1 1 1 1 1\n", ":2:")]
    {
        let path = folder.path().join("bad.data2");
        std::fs::write(&path, text).unwrap();
        let message = read_data2(&path).unwrap_err().to_string();
        assert!(message.contains(at), "{text:?}: {message}");
    }
}

#[test]
fn an_unknown_extension_is_refused_with_the_known_ones() {
    let mesh = corner_mesh();
    let path = PathBuf::from("mesh.xyz");
    assert!(!is_facet_file(&path) && is_facet_file(&PathBuf::from("A.STL")));
    let message = write_facets(&path, &Facets::plain(&mesh, "")).unwrap_err().to_string();
    assert!(message.contains("'xyz'") && message.contains(".glb"), "{message}");
}

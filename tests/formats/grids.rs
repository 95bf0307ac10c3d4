//! Grids and polylines open in readers that others wrote, with the numbers that went in.

use lampyris::formats::{
    Axis, ColourMap, Grid, Layer, NpyArray, Picture, Polylines, write_grid_csv, write_grid_npz, write_grid_png,
    write_npz, write_vti, write_vtp,
};
use lampyris::math::Point;
use npyz::NpyFile;
use std::fs::File;
use std::io::Read;

fn grid() -> Grid {
    let axis = |label: &str, range, cells| Axis { label: label.into(), unit: "deg".into(), range, cells };
    Grid {
        name: "far field".into(),
        quantity: "luminous intensity".into(),
        unit: "cd".into(),
        axes: [axis("H", [-3.0, 3.0], 3), axis("V", [0.0, 1.0], 2)],
        values: vec![0.0, 1.0 / 3.0, 2.0, 3.0, 4.0, 5e-324],
        error: Some(vec![0.5; 6]),
        geometric: None,
        layers: vec![],
    }
}

#[test]
fn csv_holds_centres_values_and_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.csv");
    write_grid_csv(&path, &grid()).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "H_deg,V_deg,luminous_intensity_cd,standard_error");
    assert_eq!(lines.len(), 7);
    let row = |n: usize| -> Vec<f64> { lines[n].split(',').map(|c| c.parse().unwrap()).collect() };
    assert_eq!(row(2), [0.0, 0.25, 1.0 / 3.0, 0.5]);
    assert_eq!(row(6), [2.0, 0.75, 5e-324, 0.5]);
}

#[test]
fn npz_opens_in_npyz() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.npz");
    write_grid_npz(&path, &grid()).unwrap();
    let mut zip = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut array = |name: &str| {
        let mut bytes = Vec::new();
        zip.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
        let npy = NpyFile::new(&bytes[..]).unwrap();
        (npy.shape().to_vec(), npy.into_vec::<f64>().unwrap())
    };
    assert_eq!(array("values.npy"), (vec![2, 3], grid().values));
    assert_eq!(array("error.npy").0, [2, 3]);
    assert_eq!(array("H_deg_edges.npy"), (vec![4], vec![-3.0, -1.0, 1.0, 3.0]));
    assert_eq!(array("V_deg_edges.npy"), (vec![3], vec![0.0, 0.5, 1.0]));
}

/// Readers of VTK take a value that is missing for damage, or the next array for this one.
#[test]
fn vtp_refuses_values_that_are_not_one_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.vtp");
    let mut lines = Polylines::default();
    lines.push([Point::ZERO, Point::X]);
    lines.push([Point::ZERO, Point::Y]);
    lines.values.push(("power_lm".into(), vec![1.0]));
    let refusal = write_vtp(&path, &lines).unwrap_err().to_string();
    assert!(refusal.contains("1 values of power_lm for 2 lines") && !path.exists(), "{refusal}");
}

/// A picture has at most as many pixels as 32 bits count, whatever the axes claim.
#[test]
fn png_refuses_axes_of_more_cells_than_it_has_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let mut empty = Grid { values: vec![], error: None, ..grid() };
    (empty.axes[0].cells, empty.axes[1].cells) = (1 << 32, 0);
    let refusal = write_grid_png(&folder.path().join("g.png"), &empty).unwrap_err().to_string();
    assert!(refusal.contains("pixels"), "{refusal}");
}

#[test]
fn npz_refuses_a_shape_that_does_not_hold_its_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.npz");
    let array = NpyArray { name: "a", shape: vec![2, 2], data: &[1.0] };
    assert!(write_npz(&path, &[array]).unwrap_err().to_string().contains("[2, 2]"));
    assert!(!path.exists());
}

#[test]
fn values_that_do_not_fill_the_grid_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g");
    let layer =
        Layer { quantity: "X".into(), unit: "cd".into(), values: vec![1.0], error: vec![0.1; 6], geometric: None };
    for wrong in [
        Grid { values: vec![1.0; 5], ..grid() },
        Grid { error: Some(vec![0.5; 2]), ..grid() },
        Grid { geometric: Some(Vec::new()), ..grid() },
        Grid { layers: vec![layer], ..grid() },
    ] {
        for write in [write_grid_csv, write_grid_png, write_vti] {
            assert!(write(&path, &wrong).unwrap_err().to_string().contains("do not fill"));
            assert!(!path.exists());
        }
        // A picture by itself has no way to refuse: what is not there is grey.
        assert_eq!(Picture::of_grid(&wrong, ColourMap::Inferno, 1, 1.0).rgb.len(), 18);
    }
}

#[test]
fn png_opens_in_image_with_the_second_axis_upward() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.png");
    write_grid_png(&path, &grid()).unwrap();
    let picture = image::open(path).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (801, 534));
    // The largest value, 4, is the middle cell of the upper row.
    assert_eq!(picture.get_pixel(400, 10).0, ColourMap::Inferno.colour(1.0));
    assert_eq!(picture.get_pixel(10, 530).0, ColourMap::Inferno.colour(0.0));
    assert!(Picture { width: 0, height: 0, rgb: Vec::new() }.to_png().is_err());
}

#[test]
fn vti_opens_in_vtkio() {
    use vtkio::model::{Attribute, DataSet, Extent, ImageDataPiece, Vtk};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("g.vti");
    write_vti(&path, &grid()).unwrap();
    let vtk = Vtk::import(path).unwrap();
    let DataSet::ImageData { origin, spacing, extent, .. } = &vtk.data else { panic!("no image data") };
    assert_eq!((*origin, *spacing), ([-3.0, 0.0, 0.0], [2.0, 0.5, 1.0]));
    let Extent::Ranges(ranges) = extent else { panic!("no ranges") };
    assert_eq!(ranges.clone().map(|r| *r.end()), [3, 2, 1]);
    let piece: ImageDataPiece = vtk.data.try_into().unwrap();
    let Attribute::DataArray(values) = &piece.data.cell[0] else { panic!("a field") };
    assert_eq!(values.name, "luminous_intensity_cd");
    assert_eq!(values.data.cast_into::<f64>().unwrap(), grid().values);
}

#[test]
fn vtp_opens_in_vtkio() {
    use vtkio::model::{Attribute, PolyDataPiece, Vtk};
    let mut lines = Polylines::default();
    lines.push([Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.1)]);
    lines.push([Point::Y, Point::Z]);
    lines.values.push(("power_W".into(), vec![0.25, 1.0]));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rays.vtp");
    write_vtp(&path, &lines).unwrap();
    let piece: PolyDataPiece = Vtk::import(path).unwrap().data.try_into().unwrap();
    assert_eq!(piece.points.cast_into::<f64>().unwrap()[6..9], [1.0, 1.0, 0.1]);
    assert_eq!(piece.lines.unwrap().into_xml(), (vec![0, 1, 2, 3, 4], vec![3, 5]));
    let Attribute::DataArray(power) = &piece.data.cell[0] else { panic!("a field") };
    assert_eq!(power.data.cast_into::<f64>().unwrap(), [0.25, 1.0]);
    assert_eq!(lines.lines().map(<[Point]>::len).collect::<Vec<_>>(), [3, 2]);
}

//! The files of one receiver: CSV, NPZ, PNG, VTI for every grid, Data_3 for planes, IES LM-63 for whole far fields in candela.

use crate::cli::Failure;
use crate::formats::{
    Data3, Grid, LightRay, PhotometricType, Photometry, write_data3, write_grid_csv, write_grid_npz,
    write_grid_png, write_ies, write_vti,
};
use crate::report::{file_stem, path_lines, receiver_grid};
use crate::simulate::scene::FarFieldType;
use crate::simulate::{Event, ReceiverResult, Results};
use std::path::Path;

/// Writes all files of a receiver and gives their names.
pub(crate) fn write(folder: &Path, receiver: &ReceiverResult, rays: &[LightRay]) -> Result<Vec<String>, Failure> {
    let Some(grid) = receiver_grid(receiver) else { return Ok(Vec::new()) };
    let stem = file_stem(&receiver.name);
    type Writer = fn(&Path, &Grid) -> Result<(), crate::formats::Error>;
    let writers: [(&str, Writer); 4] =
        [("csv", write_grid_csv), ("npz", write_grid_npz), ("png", write_grid_png), ("vti", write_vti)];
    let mut names = Vec::new();
    for (extension, write) in writers {
        names.push(format!("{stem}.{extension}"));
        write(&folder.join(format!("{stem}.{extension}")), &grid)?;
    }
    if receiver.kind == "plane" {
        names.push(format!("{stem}.data3"));
        let size = [receiver.grid[1], receiver.grid[0]];
        let data = Data3 { size, results: receiver.cells.clone(), rays: rays.to_vec() };
        write_data3(&folder.join(format!("{stem}.data3")), &data)?;
    }
    if let Some(photometry) = photometry(receiver, &grid) {
        names.push(format!("{stem}.ies"));
        write_ies(&folder.join(format!("{stem}.ies")), &photometry)?;
    }
    Ok(names)
}

/// The last segments of the recorded paths that leave the scene or end on a receiver: the sampled ray list of Data_3.
pub(crate) fn arriving(results: &Results) -> Vec<LightRay> {
    let (lines, ends) = path_lines(&results.paths);
    let average = results.power.emitted / results.rays.max(1) as f64;
    let shares = lines.values.first().map(|(_, v)| v.clone()).unwrap_or_default();
    (lines.lines().zip(&ends).zip(&shares))
        .filter(|((_, end), _)| matches!(end, Event::Received | Event::Escaped))
        .filter_map(|((line, _), share)| {
            let [.., a, b] = line else { return None };
            let direction = (*b - *a).try_normalize()?;
            Some(LightRay { origin: *a, direction, power: share * average, wavelength_nm: None })
        })
        .collect()
}

/// A far field in candela over all its directions, with the ends of both ranges that LM-63 wants: values there are those
/// of the nearest cells.
fn photometry(receiver: &ReceiverResult, grid: &Grid) -> Option<Photometry> {
    let (kind, whole) = match receiver.angles.filter(|_| receiver.unit == "cd")? {
        FarFieldType::A => (PhotometricType::A, [[-90.0, 90.0], [-90.0, 90.0]]),
        FarFieldType::B => (PhotometricType::B, [[-90.0, 90.0], [-90.0, 90.0]]),
        FarFieldType::C => (PhotometricType::C, [[0.0, 360.0], [0.0, 180.0]]),
    };
    let same = |k: usize| (0..2).all(|e| (grid.axes[k].range[e] - whole[k][e]).abs() < 1e-9);
    if !same(0) || !same(1) {
        return None;
    }
    let [h, v] = &grid.axes;
    let ends = |k: usize, axis: &crate::formats::Axis| -> Vec<f64> {
        let middle = (0..axis.cells).map(|i| axis.center(i));
        std::iter::once(whole[k][0]).chain(middle).chain([whole[k][1]]).collect()
    };
    // Index of the cell behind each angle: the ends repeat their neighbours.
    let cell = |i: usize, n: usize| i.saturating_sub(1).min(n - 1);
    let value = |i: usize, j: usize| grid.values[cell(j, v.cells) * h.cells + cell(i, h.cells)];
    // C 0 and C 360 are one plane, between the first and the last cell.
    let wrapped = |i: usize, j: usize| match kind {
        PhotometricType::C if i == 0 || i == h.cells + 1 => 0.5 * (value(1, j) + value(h.cells, j)),
        _ => value(i, j),
    };
    let candela = (0..h.cells + 2).flat_map(|i| (0..v.cells + 2).map(move |j| (i, j))).map(|(i, j)| wrapped(i, j));
    Some(Photometry {
        kind,
        horizontal_deg: ends(0, h),
        vertical_deg: ends(1, v),
        candela: candela.collect(),
        lamp_lumens: None,
        watts: 0.0,
        opening_mm: [0.0; 3],
        keywords: vec![
            ("TEST".into(), format!("lampyris {}", env!("CARGO_PKG_VERSION"))),
            ("LUMINAIRE".into(), receiver.name.clone()),
        ],
    })
}

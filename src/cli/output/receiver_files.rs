//! The files of one receiver: CSV, NPZ, PNG, VTI for every grid, TM-25 for planes and discs, Data_3 for planes, IES LM-63 for whole far
//! fields in candela.

use crate::cli::failure::Failure;
use crate::formats::{
    Data3, Flux, Grid, LightRay, PhotometricType, Photometry, SpectralData, Tm25, printable_line, write_data3,
    write_eulumdat, write_grid_csv, write_grid_npz, write_grid_png, write_ies, write_png, write_tm25, write_vti,
};
use crate::report::{colour_picture, file_stem, on_receiver, photometric_grid, receiver_grid, with_even_poles};
use crate::simulate::ReceiverResult;
use crate::simulate::scene::{FarFieldType, Receiver, ReceiverKind};
use crate::text::figures;
use std::path::Path;

/// A far field whose ends are this near to those of all directions holds all of them, degrees.
const WHOLE_RANGE_DEG: f64 = 1e-9;

/// Rays that a receiver counted.
pub(crate) struct SampledRays {
    /// Each with its wavelength where the light of the run has several.
    pub(crate) rays: Vec<LightRay>,
    /// The only wavelength of the run's light, nm, where it is known.
    pub(crate) wavelength_nm: Option<f64>,
}

/// Writes all files of a receiver into a folder and returns their names: those of its cells where it has several, and those of its rays.
/// `geometric` are the errors of its cells from the facets, where they are known, and those of its further channels; `sample` are rays
/// that it counted.
pub(crate) fn write(
    folder: &Path,
    receiver: &ReceiverResult,
    geometric: Vec<Option<Vec<f64>>>,
    sample: SampledRays,
) -> Result<Vec<String>, Failure> {
    let mut names = match receiver_grid(receiver) {
        Some(grid) => write_grid(folder, receiver, grid, geometric)?,
        None => Vec::new(),
    };
    names.extend(write_rays(folder, receiver, sample)?);
    Ok(names)
}

/// Writes the cells of a receiver, and the distribution of a far field as lamp files have it; returns the names of the files.
fn write_grid(
    folder: &Path,
    receiver: &ReceiverResult,
    mut grid: Grid,
    geometric: Vec<Option<Vec<f64>>>,
) -> Result<Vec<String>, Failure> {
    // The first layer is that of the grid itself, the others are those of its channels.
    let mut layers = geometric.into_iter().map(|layer| {
        let full = layer.filter(|g| g.len() == grid.values.len());
        full.map(|g| on_receiver(receiver, &g))
    });
    grid.geometric = layers.next().flatten();
    for (layer, geometric) in grid.layers.iter_mut().zip(layers) {
        layer.geometric = geometric;
    }
    let stem = file_stem(&receiver.name);
    type Writer = fn(&Path, &Grid) -> Result<(), crate::formats::Error>;
    // A sliver at a pole would outshine a picture by the luck of its few rays.
    let rings = receiver.pole_rings();
    let pictured = with_even_poles(&grid, &rings);
    let writers: [(&str, Writer, &Grid); 4] = [
        ("csv", write_grid_csv, &grid),
        ("npz", write_grid_npz, &grid),
        ("png", write_grid_png, &pictured),
        ("vti", write_vti, &grid),
    ];
    let mut names = Vec::new();
    for (extension, write, grid) in writers {
        names.push(format!("{stem}.{extension}"));
        write(&folder.join(format!("{stem}.{extension}")), grid)?;
    }
    if let Some(picture) = colour_picture(&pictured) {
        names.push(format!("{stem}-colours.png"));
        write_png(&folder.join(format!("{stem}-colours.png")), &picture)?;
    }
    // Both formats hold whole distributions alone, and those of half a sphere.
    let photometry = match receiver.unit {
        "cd" => photometry(receiver, &pictured, receiver.power),
        _ => photometric_grid(receiver)
            .zip(receiver.photometric())
            .and_then(|(grid, channel)| photometry(receiver, &with_even_poles(&grid, &rings), channel.total)),
    };
    // Of millions of cells they take as much memory as what follows.
    drop(pictured);
    drop(grid);
    if let Some(photometry) = photometry {
        names.push(format!("{stem}.ies"));
        write_ies(&folder.join(format!("{stem}.ies")), &photometry)?;
        if photometry.kind == PhotometricType::C {
            names.push(format!("{stem}.ldt"));
            write_eulumdat(&folder.join(format!("{stem}.ldt")), &photometry)?;
        }
    }
    Ok(names)
}

/// Writes the sampled rays of a plane or disc; returns the names of the files.
fn write_rays(folder: &Path, receiver: &ReceiverResult, mut sample: SampledRays) -> Result<Vec<String>, Failure> {
    let stem = file_stem(&receiver.name);
    let mut names = Vec::new();
    let total: f64 = sample.rays.iter().map(|ray| ray.power).sum();
    // A sample has its own chance: its rays are to carry what the receiver counted, which all rays of the run found.
    let share = if total > 0.0 { receiver.power / total } else { 1.0 };
    sample.rays.iter_mut().for_each(|ray| ray.power *= share);
    if matches!(receiver.kind, "plane" | "disc") {
        names.push(format!("{stem}.tm25ray"));
        write_tm25(&folder.join(format!("{stem}.tm25ray")), &sampled_rays(receiver, &sample))?;
    }
    // A Data_3 holds a rectangle.
    if receiver.kind == "plane" {
        names.push(format!("{stem}.data3"));
        // Data_3 gives rows first.
        let size = [receiver.grid[1], receiver.grid[0]];
        let data = Data3 { size, results: receiver.cells.clone(), rays: sample.rays };
        write_data3(&folder.join(format!("{stem}.data3")), &data)?;
    }
    Ok(names)
}

/// Returns the names of all files that [`write`] may make for a receiver of the scene.
pub(crate) fn names(receiver: &Receiver) -> Vec<String> {
    let stem = file_stem(&receiver.name);
    let own: &[&str] = match receiver.kind {
        ReceiverKind::Plane => &[".tm25ray", ".data3"],
        ReceiverKind::Disc => &[".tm25ray"],
        ReceiverKind::FarField => &[".ies", ".ldt"],
        _ => &[],
    };
    let common = [".csv", ".npz", ".png", ".vti", "-colours.png"];
    common.iter().chain(own).map(|ending| format!("{stem}{ending}")).collect()
}

/// Makes a TM-25 file of the sampled rays of a plane or disc, whose powers are scaled already.
fn sampled_rays(receiver: &ReceiverResult, sample: &SampledRays) -> Tm25 {
    let flux = if receiver.unit == "lx" { Flux::Luminous } else { Flux::Radiant };
    let mut file = Tm25::from_rays(&sample.rays, flux);
    if let Some(nm) = sample.wavelength_nm {
        // One for all: the columns of the rays have none then.
        file.header.spectral = SpectralData::Single;
        file.header.wavelengths[0] = nm as f32;
    }
    file.header.descriptions[SOFTWARE] = concat!("lampyris ", env!("CARGO_PKG_VERSION")).into();
    file.header.descriptions[ADDITIONAL] =
        "a sample of the rays of a simulation where they met the receiver; each stands for many".into();
    file
}

/// Places of two of the nine texts of a TM-25 header (4.7.3): equipment or software, additional information.
const SOFTWARE: usize = 4;
const ADDITIONAL: usize = 7;

/// Returns what LM-63 calls the angles of a far field, and the ranges of a whole luminaire, degrees, that its grid covers; `None` where it
/// covers others.
fn luminaire_range(angles: FarFieldType, grid: &Grid) -> Option<(PhotometricType, [[f64; 2]; 2])> {
    let half_turn = [-90.0, 90.0];
    // Light of a luminaire may go up or down alone (LM-63-2002, 5.11).
    let (kind, wholes) = match angles {
        FarFieldType::A => (PhotometricType::A, vec![[half_turn; 2]]),
        FarFieldType::B => (PhotometricType::B, vec![[half_turn; 2]]),
        FarFieldType::C => {
            (PhotometricType::C, [[0.0, 180.0], [0.0, 90.0], [90.0, 180.0]].map(|v| [[0.0, 360.0], v]).to_vec())
        }
    };
    let near = |a: f64, b: f64| (a - b).abs() < WHOLE_RANGE_DEG;
    // Any other part of a far field has no flux that a file of a luminaire could claim.
    let whole = wholes
        .into_iter()
        .find(|whole| (0..2).all(|k| (0..2).all(|e| near(grid.axes[k].range[e], whole[k][e]))))?;
    Some((kind, whole))
}

/// Returns the keywords of the file of a luminaire, which has the name of its receiver.
fn luminaire_keywords(name: &str) -> Vec<(String, String)> {
    [
        // LM-63-2002 requires these four in every file.
        ("TEST", name),
        ("TESTLAB", concat!("lampyris ", env!("CARGO_PKG_VERSION"), ", a simulation")),
        ("ISSUEDATE", "see results.json"),
        ("MANUFAC", "see results.json"),
        ("LUMINAIRE", name),
    ]
    .map(|(key, value)| (key.to_owned(), printable_line(value).into_owned()))
    .into()
}

/// Returns a far field as LM-63 has it, in candela over all its directions, with the ends of both ranges: values there are those of the
/// nearest cells, at a pole the mean of its ring, which `grid` has in all cells of the ring. `None` for other receivers, and where its
/// ranges are not those of a whole luminaire.
///
/// A cell holds a mean, LM-63 values between which readers interpolate: all are scaled by one factor, within some thousandths of
/// 1 and stated in the file, so that their flux is `lumens`.
fn photometry(receiver: &ReceiverResult, grid: &Grid, lumens: f64) -> Option<Photometry> {
    let (kind, whole) = luminaire_range(receiver.angles?, grid)?;
    let [h, v] = &grid.axes;
    let ends = |k: usize, axis: &crate::formats::Axis| -> Vec<f64> {
        let middle = (0..axis.cells).map(|i| axis.center(i));
        std::iter::once(whole[k][0]).chain(middle).chain([whole[k][1]]).collect()
    };
    // Index of the cell behind each angle: the ends repeat their neighbours.
    let cell = |i: usize, n: usize| i.saturating_sub(1).min(n - 1);
    let is_end = |i: usize, n: usize| i == 0 || i == n + 1;
    // All planes meet at 0° and 180° of γ, and at 90° up and down; not on the horizon of a luminaire.
    let is_pole = |j: usize| {
        let angle = whole[1][usize::from(j > 0)];
        is_end(j, v.cells) && !(kind == PhotometricType::C && angle == 90.0)
    };
    let cells = |i: usize, j: usize| grid.values[cell(j, v.cells) * h.cells + cell(i, h.cells)];
    let mean = |of: &mut dyn Iterator<Item = f64>, n: usize| of.sum::<f64>() / n as f64;
    let value = |i: usize, j: usize| match kind {
        PhotometricType::B if is_end(i, h.cells) => mean(&mut (1..=v.cells).map(|j| cells(i, j)), v.cells),
        PhotometricType::A | PhotometricType::C if is_pole(j) => {
            mean(&mut (1..=h.cells).map(|i| cells(i, j)), h.cells)
        }
        // C 0 and C 360 are one plane, between the first and the last cell.
        PhotometricType::C if is_end(i, h.cells) => 0.5 * (cells(1, j) + cells(h.cells, j)),
        _ => cells(i, j),
    };
    let candela = (0..h.cells + 2).flat_map(|i| (0..v.cells + 2).map(move |j| (i, j))).map(|(i, j)| value(i, j));
    let mut photometry = Photometry {
        kind,
        horizontal_deg: ends(0, h),
        vertical_deg: ends(1, v),
        candela: candela.collect(),
        lamp_lumens: None,
        watts: 0.0,
        opening_mm: [0.0; 3],
        keywords: luminaire_keywords(&receiver.name),
    };
    let factor = lumens / photometry.flux();
    // A dark far field has no flux to be scaled to.
    if factor.is_finite() {
        photometry.candela.iter_mut().for_each(|c| *c *= factor);
        let said = format!(
            "cell values times {}: the flux interpolated between them is that of the receiver",
            figures(factor, 5)
        );
        photometry.keywords.push(("OTHER".to_owned(), said));
    }
    Some(photometry)
}

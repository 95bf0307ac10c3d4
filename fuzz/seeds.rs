//! Writes files that the corpora of `rays` and `photometry` start from: `cargo run --bin seeds FOLDER` makes `FOLDER/rays` and
//! `FOLDER/photometry`. The other targets start from `fixtures`, or make their own.

use lampyris::formats::{
    Data3, Facets, Flux, LightRay, PhotometricType, Photometry, Tm25, write_data1, write_data3, write_eulumdat,
    write_facets, write_ies, write_rays, write_tm25,
};
use lampyris::math::{FaceId, Point, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("seeds FOLDER")?;
    let [photometry, rays] = ["photometry", "rays"].map(|name| Path::new(&folder).join(name));
    std::fs::create_dir_all(&photometry)?;
    std::fs::create_dir_all(&rays)?;
    write_ies(&photometry.join("lamp.ies"), &lamp())?;
    write_eulumdat(&photometry.join("lamp.ldt"), &lamp())?;
    write_rays(&rays.join("0.csv"), &light())?;
    write_rays(&rays.join("1.npz"), &light())?;
    for (name, flux) in [("2-radiant.tm25ray", Flux::Radiant), ("2-luminous.tm25ray", Flux::Luminous)] {
        write_tm25(&rays.join(name), &Tm25::from_rays(&light(), flux))?;
    }
    std::fs::write(rays.join("2-zemax.dat"), zemax())?;
    std::fs::write(rays.join("2-lighttools.ray"), lighttools())?;
    write_data1(&rays.join("3.data1"), &light())?;
    write_facets(&rays.join("4.data2"), &Facets::plain(&square(), "square"))?;
    write_data3(&rays.join("5.data3"), &Data3 { size: [3, 4], results: vec![1.5; 12], rays: light() })?;
    // The target's first byte says which reader gets the rest; it stands first in the names.
    for entry in std::fs::read_dir(&rays)? {
        let path = entry?.path();
        let kind = path.file_name().and_then(|n| n.to_str()).and_then(|n| n.bytes().next()).ok_or("a name")? - b'0';
        let content = std::fs::read(&path)?;
        std::fs::write(&path, [&[kind], content.as_slice()].concat())?;
    }
    Ok(())
}

fn light() -> Vec<LightRay> {
    (0..5)
        .map(|k| LightRay {
            origin: Point::new(f64::from(k), 0.0, 0.0),
            direction: Vector::Z,
            power: 0.5,
            wavelength_nm: Some(550.0 + f64::from(k)),
        })
        .collect()
}

/// The numbers of the rays, a row each: place, direction, flux and wavelength, nm times `nm`.
fn rows(nm: f64) -> Vec<u8> {
    let row = |ray: &LightRay| {
        let wavelength = ray.wavelength_nm.expect("light of known wavelengths") * nm;
        [&ray.origin.to_array()[..], &ray.direction.to_array(), &[ray.power, wavelength]].concat()
    };
    light().iter().flat_map(row).flat_map(|x| (x as f32).to_le_bytes()).collect()
}

/// A Zemax binary source file: identifier, number of rays, description, fluxes, wavelength and angles, mm, placement, rays with
/// wavelengths in µm, watts.
fn zemax() -> Vec<u8> {
    let count = light().len() as u32;
    let flux = light().iter().map(|ray| ray.power).sum::<f64>() as f32;
    let mut bytes = [1010i32.to_le_bytes(), count.to_le_bytes()].concat();
    bytes.extend([0; 100]);
    bytes.extend([flux, flux, 0.0, 0.0, 0.0, 0.0, 0.0].iter().flat_map(|x: &f32| x.to_le_bytes()));
    bytes.extend(4u32.to_le_bytes());
    bytes.extend([0; 52]);
    bytes.extend([2i32, 0, 0, 0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(rows(1e-3));
    bytes
}

/// A LightTools binary ray data file of version 3: watts, places, wavelengths, mm, the origin, the flux, no polarisation.
fn lighttools() -> Vec<u8> {
    let mut bytes = b"LTRF".to_vec();
    bytes.extend([3u32, 0, 0, 0, 2, 1].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0.0, 0.0, 0.0, 2.5].iter().flat_map(|x: &f32| x.to_le_bytes()));
    bytes.extend(0u32.to_le_bytes());
    bytes.extend(rows(1.0));
    bytes.extend(b"LTRFEND");
    bytes
}

fn lamp() -> Photometry {
    Photometry {
        kind: PhotometricType::C,
        horizontal_deg: vec![0.0, 90.0, 180.0, 270.0, 360.0],
        vertical_deg: vec![0.0, 45.0, 90.0],
        candela: (0..15).map(f64::from).collect(),
        lamp_lumens: Some(1000.0),
        watts: 10.0,
        opening_mm: [100.0, 50.0, 10.0],
        keywords: vec![("MANUFAC".into(), "nobody".into()), ("LUMINAIRE".into(), "a lamp".into())],
    }
}

fn square() -> FacetMesh {
    let vertex = |position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO };
    FacetMesh {
        positions: vec![Point::ZERO, Point::X, Point::X + Point::Y, Point::Y],
        vertices: (0..4).map(vertex).collect(),
        facets: vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }],
        ..Default::default()
    }
}

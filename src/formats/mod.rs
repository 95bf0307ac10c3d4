//! Other people's file formats as plain structs, read and written; knows points and facets, nothing of simulation.
//!
//! Facets go out as Wavefront OBJ, Stanford PLY, STL, VTK's VTU, glTF 2.0 (GLB) and Data_2; grids as CSV, NPZ, PNG and VTI; polylines
//! as VTP. Intensities are read and written as IES LM-63 and EULUMDAT, lists of rays as CSV, NPZ and Data_1, results as Data_3; ray
//! sets of measured sources and glass catalogues (AGF) are read. Data_1 to Data_3 are the files of the seed paper (Dong, Xue, Zhao).
//!
//! Guarantee: every file is written beside its final name and renamed when complete ([`write_atomic`]), so a reader
//! never sees half of one; `f64` values survive CSV, NPZ, VTU, VTP, VTI, PLY and OBJ bit for bit (shortest text that reads back
//! the same, or raw little-endian). Known weakness: STL and GLB are single precision by their own definition.

mod agf;
mod atomic;
mod base64;
mod data1;
mod data2;
mod data3;
mod error;
mod eulumdat;
mod export;
mod facets;
mod file_names;
mod glb;
mod grid;
mod ies;
mod input;
mod npz;
mod obj;
mod photometry;
mod ply;
mod png;
mod polylines;
mod printable;
mod ray_csv;
mod ray_files;
mod ray_npz;
mod rays;
mod scratch;
mod stl;
mod stream;
mod vtk;
mod writer;

pub use agf::{AgfGlass, read_agf};
pub use atomic::{file_stem, remove_stale, remove_unfinished_files, try_write, write_atomic};
pub use base64::base64;
pub use data1::{read_data1, write_data1};
pub use data2::{Data2Facet, read_data2};
pub use data3::{Data3, read_data3, write_data3};
pub use error::{Error, ErrorKind};
pub use eulumdat::{parse_eulumdat, read_eulumdat, write_eulumdat};
pub use export::{FACET_EXTENSIONS, is_facet_file, write_facets};
pub use facets::{Facets, Group};
pub use file_names::{file_name, lower_extension};
pub use grid::{Axis, Grid, Layer, write_grid_csv, write_grid_npz};
pub use ies::{parse_ies, read_ies, write_ies};
pub use input::{open_file, read_bytes, read_text};
pub use npz::{NpyArray, write_npz};
pub use photometry::{PhotometricType, Photometry};
pub use png::{ColourMap, Picture, write_grid_png, write_png};
pub use polylines::Polylines;
pub use printable::{
    csv_quoted_text, csv_text, is_unprintable, printable, printable_in_place, printable_json, printable_line,
    printable_toml,
};
pub use ray_files::{
    Flux, RayBlock, RayFile, RaySet, SpectralData, Tm25, Tm25Columns, Tm25Header, Tm25Reader, read_ray_facets,
    read_ray_paths, read_ray_set, read_rays, read_tm25, write_tm25,
};
pub use rays::{LightRay, write_rays};
pub use stream::{Column, NpzStream};
pub use vtk::{write_vti, write_vtp};

//! Sources that were measured: luminous intensities and lists of rays, read from files.

use super::ray_list::RayList;
use crate::formats::{Flux, PhotometricType, RayFile, read_data1, read_eulumdat, read_ies};
use crate::optics::IntensitySampler;
use crate::simulate::scene::{Key, PowerUnit, Scene, Source, SourceKind};
use crate::simulate::{Error, ErrorKind};

/// The contents of a source's file.
#[derive(Clone, Debug)]
pub(crate) enum Loaded {
    /// A measured intensity, the type of its angles, its flux in the file's unit, and what was supposed of it.
    Intensity {
        sampler: IntensitySampler,
        kind: PhotometricType,
        flux: f64,
        note: Option<String>,
    },
    Rays(RayList),
}

/// Reads the file of source `index`; `None` when it names none, or its kind takes none.
///
/// # Errors
/// When the file cannot be read, its light is no finite power, or its rays do not suit the unit of the run.
pub(crate) fn load(scene: &Scene, index: usize, source: &Source) -> Result<Option<Loaded>, Error> {
    let Some(file) = &source.file else { return Ok(None) };
    let at = [Key::Name("source"), Key::Index(index), Key::Name("file")];
    let path = scene.resolve(file);
    let unreadable = |e: crate::formats::Error| scene.error(ErrorKind::Unreadable, &at, e.to_string());
    let intensity = |p: crate::formats::Photometry| {
        let sampler = IntensitySampler::new(&p).map_err(|e| scene.error(ErrorKind::Value, &at, e.to_string()))?;
        let flux = sampler.flux();
        if !(flux > 0.0 && flux.is_finite()) {
            return Err(scene.error(
                ErrorKind::Value,
                &at,
                format!("the light of this file is no finite power: {flux}"),
            ));
        }
        Ok(Some(Loaded::Intensity { sampler, kind: p.kind, flux, note: p.open_turn() }))
    };
    let list = |file: RayFile| match RayList::new(file, source, scene.run.unit) {
        Ok(list) => Ok(Some(Loaded::Rays(list))),
        Err(fault) => Err(scene.error(ErrorKind::Value, &at, fault.message).help(fault.help)),
    };
    let flux = match scene.run.unit {
        PowerUnit::Watt => Flux::Radiant,
        PowerUnit::Lumen => Flux::Luminous,
    };
    match source.kind {
        SourceKind::Ies => intensity(read_ies(&path).map_err(unreadable)?),
        SourceKind::Eulumdat => intensity(read_eulumdat(&path).map_err(unreadable)?),
        SourceKind::Rays => list(RayFile::open(&path, flux).map_err(unreadable)?),
        SourceKind::Data1 => {
            let rays = read_data1(&path).map_err(unreadable)?;
            list(RayFile::from_rays(&path, rays))
        }
        _ => Ok(None),
    }
}

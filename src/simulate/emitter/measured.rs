//! Sources that were measured: luminous intensities and lists of rays, read from files.

use crate::formats::{LightRay, PhotometricType, read_data1, read_eulumdat, read_ies, read_rays};
use crate::optics::IntensitySampler;
use crate::simulate::scene::{Key, Scene, Source, SourceKind};
use crate::simulate::{Error, ErrorKind};

/// What the file of a source holds.
#[derive(Clone, Debug)]
pub(crate) enum Loaded {
    /// A measured intensity, the type of its angles and its flux.
    Intensity(IntensitySampler, PhotometricType, f64),
    Rays(RayList),
}

/// Measured rays, to be drawn in proportion to their power; at least one, and one with power.
#[derive(Clone, Debug)]
pub(crate) struct RayList {
    pub(crate) rays: Vec<LightRay>,
    /// Power up to and including each ray.
    sums: Vec<f64>,
}

impl RayList {
    pub(crate) fn power(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// The ray at a share of the summed power.
    pub(crate) fn ray_at_share(&self, share: f64) -> &LightRay {
        let at = share * self.power();
        &self.rays[self.sums.partition_point(|s| *s <= at).min(self.rays.len() - 1)]
    }
}

/// Reads the file of a source, when it has one.
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
        Ok(Some(Loaded::Intensity(sampler, p.kind, flux)))
    };
    let list = |rays: Vec<LightRay>| {
        let mut sum = 0.0;
        let add = |r: &LightRay| {
            sum += r.power;
            sum
        };
        let sums: Vec<f64> = rays.iter().map(add).collect();
        if !sum.is_finite() {
            let error = scene.error(ErrorKind::Value, &at, "the powers of this list add up to no finite number");
            return Err(error.help("give powers in the unit of the run"));
        }
        if sum > 0.0 {
            Ok(Some(Loaded::Rays(RayList { rays, sums })))
        } else {
            Err(scene.error(ErrorKind::Value, &at, "the rays of this list carry no power"))
        }
    };
    match source.kind {
        SourceKind::Ies => intensity(read_ies(&path).map_err(unreadable)?),
        SourceKind::Eulumdat => intensity(read_eulumdat(&path).map_err(unreadable)?),
        SourceKind::Rays => list(read_rays(&path).map_err(unreadable)?),
        SourceKind::Data1 => list(read_data1(&path).map_err(unreadable)?),
        _ => Ok(None),
    }
}

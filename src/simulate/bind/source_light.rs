//! The wavelengths of the sources, and whether every medium has an index there.

use crate::optics::{Index, Wavelengths};
use crate::simulate::body::Body;
use crate::simulate::emitter::{Loaded, RayList};
use crate::simulate::scene::{Key, Scene};
use crate::simulate::surfaces::SceneLight;
use crate::simulate::wavelength_text::wavelength_text;
use crate::simulate::{Error, ErrorKind};

/// Wavelengths of a continuous spectrum at which the index of each medium is looked at.
const PROBES: u32 = 64;
/// The last of them falls just short of the whole spectrum, whose end is drawn by no random number.
const LAST_PROBE: f64 = 64.001;

/// Returns the wavelength of the scene, nm, and whether it has several. With several, that is the line of the first source, or the run's
/// wavelength where the first source has a spectrum.
pub(super) fn scene_light(scene: &Scene, loaded: &[Option<Loaded>]) -> SceneLight {
    let lines = scene.sources.iter().zip(loaded).flat_map(|(s, loaded)| match (&s.spectrum, loaded) {
        (Some(key), _) => vec![key.optics().ok().and_then(|s| s.single_line())],
        (None, Some(Loaded::Rays(list))) => vec![single_wavelength(list, scene)],
        _ => vec![Some(scene.run.wavelength_nm)],
    });
    let lines: Vec<Option<f64>> = lines.collect();
    let first = lines.first().copied().flatten();
    // One line for all sources needs no wavelength on the ray: media are evaluated once, and the kernel carries none.
    let coloured = first.is_none() || lines.iter().any(|l| *l != first);
    SceneLight { wavelength: first.unwrap_or(scene.run.wavelength_nm), coloured }
}

/// Returns the only wavelength of a list of rays, nm, the run's where the list gives none; `None` where it has several.
fn single_wavelength(list: &RayList, scene: &Scene) -> Option<f64> {
    if let Some(spectrum) = &list.spectrum {
        let [first, last] = spectrum.range_nm();
        return (first == last).then_some(first);
    }
    match list.own_wavelengths.ascending()[..] {
        [] => Some(scene.run.wavelength_nm),
        [one] => Some(one),
        _ => None,
    }
}

/// Returns first and last wavelength of each source, nm; the run's wavelength for a source that gives none.
pub(super) fn source_ranges(scene: &Scene, loaded: &[Option<Loaded>]) -> Vec<[f64; 2]> {
    let run = [scene.run.wavelength_nm; 2];
    (scene.sources.iter().zip(loaded))
        .map(|(source, loaded)| match (&source.spectrum, loaded) {
            (Some(key), _) => key.wavelengths(scene.run.unit).map_or(run, |s| s.range_nm()),
            (None, Some(Loaded::Rays(RayList { spectrum: Some(spectrum), .. }))) => spectrum.range_nm(),
            (None, Some(Loaded::Rays(list))) => list.range_nm(run[0]),
            _ => run,
        })
        .collect()
}

/// Returns wavelengths, nm, that stand for a spectrum: all lines that have power, or some in even steps of power from end to end.
fn probes(spectrum: &Wavelengths) -> Vec<f64> {
    let even_steps = || (0..=PROBES).map(|k| spectrum.sample(f64::from(k) / LAST_PROBE)).collect();
    spectrum.lit_lines().unwrap_or_else(even_steps)
}

/// Checks that every medium in use, the surroundings too, has an index from 0.1 to 10 at every wavelength of the sources; a continuous
/// spectrum is sampled at 65 places, in even steps of power, and one that cannot be read is passed over.
///
/// # Errors
/// For the first wavelength and medium that fail, at the source.
pub(super) fn check_indices(scene: &Scene, loaded: &[Option<Loaded>], bodies: &[Body]) -> Result<(), Error> {
    for (i, (source, loaded)) in scene.sources.iter().zip(loaded).enumerate() {
        let mut wavelengths: Vec<f64> = match (&source.spectrum, loaded) {
            (Some(key), _) => {
                key.wavelengths(scene.run.unit).map_or_else(|_| Vec::new(), |spectrum| probes(&spectrum))
            }
            (None, Some(Loaded::Rays(RayList { spectrum: Some(spectrum), .. }))) => probes(spectrum),
            // Rays that have none of their own have the run's.
            (None, Some(Loaded::Rays(list))) => {
                let run = (!list.is_all_coloured()).then_some(scene.run.wavelength_nm);
                list.own_wavelengths.ascending().into_iter().chain(run).collect()
            }
            _ => vec![scene.run.wavelength_nm],
        };
        wavelengths.sort_by(f64::total_cmp);
        wavelengths.dedup();
        // A dispersion formula may fail in the middle of a spectrum, so that its ends do not suffice.
        for nm in wavelengths {
            let wrong = bodies.iter().find(|b| !Index::RANGE.contains(&b.index(Some(nm))));
            if let Some(body) = wrong {
                let wavelength = wavelength_text(nm);
                let message =
                    format!("'{}' has no index at {wavelength}, a wavelength of this source", body.medium);
                let at = [Key::Name("source"), Key::Index(i), Key::Name("spectrum")];
                let error = scene.error(ErrorKind::Value, &at, message);
                return Err(error.help("give the medium an index there, or cut the spectrum"));
            }
        }
    }
    Ok(())
}

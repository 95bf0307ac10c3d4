//! Measured rays as a source draws them, in the unit that the run counts.

use super::flux_conversion::{
    Conversion, Fault, GIVE_POWER, conversion, file_spectrum, unseen_light, unseen_lumens,
};
use super::own_wavelengths::OwnWavelengths;
use super::running_sums::RunningSums;
use crate::formats::{self, Flux, LightRay, RayBlock, RayFile};
use crate::math::Aabb;
use crate::optics::{Wavelengths, xyz_of_watt};
use crate::simulate::scene::{PowerUnit, Source};
use std::sync::Arc;

/// Fewest rays whose powers are summed together: to draw a ray, as many are read. To read fewer from the disk would take no less time.
const SMALLEST_BLOCK: u64 = 32;

/// Most sums that a list holds in memory, 16 MB; of longer lists the blocks are larger.
const MOST_SUMS: u64 = 1 << 21;

/// Rays that are read at a time when the whole list is, in the order of the file.
const SURVEYED: usize = 4096;

/// Returns how many rays of a list of this many are summed together, a power of two. A run of as many rays as the list draws in each of its
/// replicates one ray in thousands: each draw reads a block of its own, and its time is that of its block.
fn block_rays(rays: u64) -> usize {
    rays.div_ceil(MOST_SUMS).next_power_of_two().max(SMALLEST_BLOCK) as usize
}

/// Measured rays, to be drawn in proportion to their power; at least one, and one with power.
#[derive(Clone, Debug)]
pub(crate) struct RayList {
    file: Arc<RayFile>,
    /// Converts power from the file's unit to the run's.
    conversion: Conversion,
    /// Spectrum that the file gives for all its rays, in the unit of the run; no ray has a wavelength of its own then.
    pub(crate) spectrum: Option<Wavelengths>,
    /// What the reader changed or supposed, for people.
    pub(crate) notes: Vec<String>,
    /// Rays of a block, [`block_rays`].
    block: usize,
    /// Power up to the end of each block.
    sums: Arc<RunningSums>,
    /// As [`Self::even_rays`].
    even_rays: f64,
    /// Box around the origins, mm, in the source's frame.
    pub(crate) origins: Aabb,
    /// Wavelengths, nm, that single rays have of their own.
    pub(crate) own_wavelengths: Arc<OwnWavelengths>,
}

/// The block of a [`RayList`] that was read last, for one who draws rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct ListCursor {
    /// Its number; `None` before the first and after a failure.
    number: Option<usize>,
    block: RayBlock,
    /// Power of the list up to and including each ray of the block.
    sums: Vec<f64>,
}

impl RayList {
    /// Makes the rays of a file the source of a run that counts in `unit`.
    ///
    /// Watts become lumens, and lumens watts, where the file or the scene gives wavelengths; a note says so.
    ///
    /// # Errors
    /// When the unit cannot be converted and the scene does not give the source's power (with it, the file's powers are relative), when the
    /// eye sees nothing of the light of a run that counts lumens, or when the powers add up to 0 or to no finite number.
    pub(super) fn new(mut file: RayFile, source: &Source, unit: PowerUnit) -> Result<Self, Fault> {
        let notes = std::mem::take(&mut file.notes);
        let table = file_spectrum(&file)?;
        let is_other = matches!(
            (file.flux, unit),
            (Some(Flux::Radiant), PowerUnit::Lumen) | (Some(Flux::Luminous), PowerUnit::Watt)
        );
        let converted = if is_other { conversion(&file, table.as_ref(), source, unit)? } else { None };
        let (conversion, mut note) = converted.unzip();
        let spectrum = match unit {
            PowerUnit::Watt => table,
            PowerUnit::Lumen => table.map(|t| t.photometric()).transpose().map_err(|_| {
                let message = "this run counts lumens, and the eye sees nothing of the spectrum of this file";
                Fault::new(message, "set `unit = \"W\"` in [run]")
            })?,
        };
        let mut list = Self {
            block: block_rays(file.len()),
            file: Arc::new(file),
            conversion: conversion.unwrap_or(Conversion::Factor(1.0)),
            spectrum,
            notes,
            sums: Arc::default(),
            even_rays: 1.0,
            origins: Aabb::EMPTY,
            own_wavelengths: Arc::default(),
        };
        if let Some(nm) = list.survey()? {
            let is_of_one_wavelength = list.own_wavelengths.range() == Some([nm; 2]);
            if !is_of_one_wavelength {
                let way_out = "leave such rays out of the file";
                return Err(unseen_lumens("the light of one of its rays", [nm; 2], way_out));
            }
            if source.power.is_none() {
                return Err(unseen_lumens("the light of its rays", [nm; 2], GIVE_POWER));
            }
            // One wavelength for all leaves the proportions as they are.
            list.conversion = Conversion::Factor(1.0);
            note = None;
            list.survey()?;
        }
        list.notes.extend(note);
        let sum = list.power();
        if !sum.is_finite() {
            let message = "the powers of this list add up to no finite number";
            return Err(Fault::new(message, "give powers in the unit of the run"));
        }
        if sum <= 0.0 {
            return Err(list.why_no_power());
        }
        Ok(list)
    }

    /// Returns why a list whose powers add up to 0 is refused.
    fn why_no_power(&self) -> Fault {
        let is_unseen = |nm: &f64| xyz_of_watt(*nm)[1] == 0.0;
        match self.own_wavelengths.range() {
            Some(range)
                if matches!(self.conversion, Conversion::LumensOfEachRay)
                    && self.own_wavelengths.ascending().iter().all(is_unseen) =>
            {
                let light = unseen_light("the light of this list", range);
                Fault::new(format!("this run counts lumens, and {light}"), "set `unit = \"W\"` in [run]")
            }
            _ => Fault::new("the rays of this list carry no power", "give another file"),
        }
    }

    /// Reads the whole list once: adds up its powers, and notes where the rays start and which wavelengths they have. Returns the
    /// wavelength, nm, of the first ray whose lumens cannot be made watts, as the eye sees nothing of it; `None` where there is none.
    ///
    /// # Errors
    /// When the file cannot be read.
    fn survey(&mut self) -> Result<Option<f64>, Fault> {
        let changed = |e: formats::Error| Fault::new(e.to_string(), "leave the file as it is while it is in use");
        let mut sums = Vec::new();
        let mut wavelengths = OwnWavelengths::default();
        let mut block = RayBlock::default();
        let [mut sum, mut squares] = [0.0; 2];
        let mut unseen = None;
        for first in (0..self.len()).step_by(SURVEYED) {
            self.file.read_block(first, SURVEYED, &mut block).map_err(changed)?;
            for k in 0..block.len() {
                let ray = self.file.ray(&block, k).map_err(changed)?;
                let power = self.power_of(&block, k);
                if power.is_infinite() && matches!(self.conversion, Conversion::WattsOfEachRay) {
                    unseen = unseen.or(ray.wavelength_nm.filter(|nm| xyz_of_watt(*nm)[1] == 0.0));
                }
                sum += power;
                squares += power * power;
                self.origins = self.origins.union(Aabb::from_points([ray.origin]));
                ray.wavelength_nm.into_iter().for_each(|nm| wavelengths.add(nm));
                let read = first + k as u64 + 1;
                if read.is_multiple_of(self.block as u64) || read == self.len() {
                    sums.push(sum);
                }
            }
        }
        self.sums = Arc::new(RunningSums::new(sums));
        // From one ray to all of them, also where squares are beyond numbers.
        self.even_rays = (sum / squares * sum).max(1.0).min(self.len() as f64);
        self.own_wavelengths = Arc::new(wavelengths);
        Ok(unseen)
    }

    /// Number of rays.
    pub(crate) fn len(&self) -> u64 {
        self.file.len()
    }

    /// Returns how many rays of equal power leave as little open as these, as a sample of their light: (Σ w)²/Σ w² of their powers w (Kish,
    /// *Survey Sampling*, 1965).
    pub(crate) fn even_rays(&self) -> f64 {
        self.even_rays
    }

    /// Returns the power of all rays, in the unit of the run.
    pub(crate) fn power(&self) -> f64 {
        self.sums.total()
    }

    /// Whether rays have wavelengths of their own.
    pub(crate) fn is_coloured(&self) -> bool {
        self.file.spectral_rays() > 0
    }

    /// Whether every ray has a wavelength of its own.
    pub(crate) fn is_all_coloured(&self) -> bool {
        self.file.spectral_rays() >= self.len()
    }

    /// Returns the first and the last of the rays' wavelengths, nm, where one without takes `other`.
    pub(crate) fn range_nm(&self, other: f64) -> [f64; 2] {
        let own = self.own_wavelengths.range();
        match own {
            Some([a, b]) if !self.is_all_coloured() => [a.min(other), b.max(other)],
            Some(range) => range,
            None => [other; 2],
        }
    }

    /// The power of a ray of a block in the unit of the run.
    fn power_of(&self, block: &RayBlock, k: usize) -> f64 {
        let power = self.file.power(block, k);
        match self.conversion {
            Conversion::Factor(factor) => power * factor,
            // No power at all is none in any unit, also where the eye sees nothing.
            _ if power == 0.0 => 0.0,
            Conversion::LumensOfEachRay => power * self.lumens_of_watt(block, k),
            Conversion::WattsOfEachRay => power / self.lumens_of_watt(block, k),
        }
    }

    /// The lumens of a watt at the wavelength of a ray of a block; 0 for one without.
    fn lumens_of_watt(&self, block: &RayBlock, k: usize) -> f64 {
        let nm = self.file.ray(block, k).ok().and_then(|ray| ray.wavelength_nm);
        nm.map_or(0.0, |nm| xyz_of_watt(nm)[1])
    }

    /// Reads a block, and its sums, if it is not the cursor's already; `false` when the file cannot be read any more.
    fn go_to(&self, number: usize, cursor: &mut ListCursor) -> bool {
        if cursor.number == Some(number) {
            return true;
        }
        cursor.number = None;
        if self.file.read_block((number * self.block) as u64, self.block, &mut cursor.block).is_err() {
            return false;
        }
        // Added in the same order as when the list was opened: the sums are those to the bit.
        let mut sum = self.sums.sum_before(number);
        cursor.sums.clear();
        for k in 0..cursor.block.len() {
            sum += self.power_of(&cursor.block, k);
            cursor.sums.push(sum);
        }
        cursor.number = Some(number);
        true
    }

    /// Returns a ray of the cursor's block, its power in the unit of the run; `None` when the file was changed.
    fn ray_of_block(&self, k: usize, cursor: &ListCursor) -> Option<LightRay> {
        let power = self.power_of(&cursor.block, k);
        Some(LightRay { power, ..self.file.ray(&cursor.block, k).ok()? })
    }

    /// Returns the ray at which the running sum of powers passes `share`, from 0 to 1, of the whole; `None` when the file cannot be read
    /// any more or was changed.
    pub(crate) fn ray_at_share(&self, share: f64, cursor: &mut ListCursor) -> Option<LightRay> {
        // The running sum is searched: each ray is drawn in proportion to its power.
        let at = share * self.power();
        if !self.go_to(self.sums.place(at), cursor) {
            return None;
        }
        let last = cursor.block.len().checked_sub(1)?;
        self.ray_of_block(cursor.sums.partition_point(|s| *s <= at).min(last), cursor)
    }

    /// Returns the ray at this place of the list; `None` behind its end and when the file cannot be read any more.
    pub(crate) fn ray(&self, place: u64, cursor: &mut ListCursor) -> Option<LightRay> {
        let block = self.block as u64;
        let found = place < self.len() && self.go_to((place / block) as usize, cursor);
        if found { self.ray_of_block((place % block) as usize, cursor) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::write_rays;
    use crate::math::{Point, Vector};

    /// A lumen of deep blue is many watts: V(λ) of 1924 is 0.038 at 450 nm and 1.000 at 555 nm. With the source's power too they keep
    /// their proportion.
    #[test]
    fn lumens_with_wavelengths_are_watts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rays.csv");
        let ray = |nm| LightRay { origin: Point::ZERO, direction: Vector::Z, power: 1.0, wavelength_nm: Some(nm) };
        write_rays(&path, &[ray(450.0), ray(555.0)]).unwrap();
        for power in [None, Some(3.0)] {
            let mut file = RayFile::open(&path, Flux::Radiant).unwrap();
            file.flux = Some(Flux::Luminous);
            let source = Source { power, ..Source::default() };
            let list =
                RayList::new(file, &source, PowerUnit::Watt).unwrap_or_else(|fault| panic!("{}", fault.message));
            let mut cursor = ListCursor::default();
            let [blue, green] = [0, 1].map(|k| list.ray(k, &mut cursor).unwrap().power);
            assert!(
                (683.0 * green - 1.0).abs() < 1e-3 && (blue / green * 0.038 - 1.0).abs() < 5e-3,
                "{blue} {green}"
            );
            assert!(list.notes[0].contains("each ray by its wavelength"), "{:?}", list.notes);
        }
    }

    /// No watts can be made of lumens that the eye sees nothing of: with the source's power they are proportions, without they are refused.
    #[test]
    fn lumens_that_the_eye_does_not_see_are_proportions_where_all_have_one_spectrum() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rays.csv");
        let list = |own: [Option<f64>; 2], spectrum: Option<[f64; 2]>, power: Option<f64>, unit: PowerUnit| {
            let ray =
                |wavelength_nm| LightRay { origin: Point::ZERO, direction: Vector::Z, power: 1.0, wavelength_nm };
            write_rays(&path, &own.map(ray)).unwrap();
            let mut file = RayFile::open(&path, Flux::Radiant).unwrap();
            file.flux = Some(if unit == PowerUnit::Watt { Flux::Luminous } else { Flux::Radiant });
            file.spectrum = spectrum.map(|line| vec![line]);
            RayList::new(file, &Source { power, ..Source::default() }, unit)
        };
        let mixed = [Some(555.0), Some(940.0)];
        for power in [None, Some(3.0)] {
            let fault = list(mixed, None, power, PowerUnit::Watt).unwrap_err();
            assert!(
                fault.message.contains("940 nm") && fault.help.contains("leave such rays out"),
                "{}",
                fault.help
            );
        }
        for (own, spectrum) in [([Some(940.0); 2], None), ([None; 2], Some([940.0, 1.0]))] {
            let fault = list(own, spectrum, None, PowerUnit::Watt).unwrap_err();
            assert!(fault.message.contains("940 nm") && fault.help.contains("`power`"), "{}", fault.message);
            let list =
                list(own, spectrum, Some(3.0), PowerUnit::Watt).unwrap_or_else(|fault| panic!("{}", fault.message));
            let mut cursor = ListCursor::default();
            assert_eq!([0, 1].map(|k| list.ray(k, &mut cursor).unwrap().power), [1.0; 2]);
            assert!(list.notes.is_empty(), "{:?}", list.notes);
        }
        let dark = list([Some(940.0); 2], None, None, PowerUnit::Lumen).unwrap_err();
        assert!(dark.message.contains("940 nm"), "{}", dark.message);
    }

    /// The ray at a share is the first whose running sum of powers, added from the first ray on, passes it, in whichever order shares are
    /// asked for and wherever the list is kept: 140,000 rays are more than memory takes.
    #[test]
    fn a_share_finds_the_ray_that_the_sums_of_all_find() {
        let folder = tempfile::tempdir().unwrap();
        let source = Source::default();
        for n in [1, 32, 33, 140_000] {
            let ray = |k: usize| LightRay {
                origin: Point::new(k as f64, 0.0, 0.0),
                direction: Vector::Z,
                power: if k.is_multiple_of(3) { 0.0 } else { 0.1 + (k % 7) as f64 / 3.0 },
                wavelength_nm: None,
            };
            let mut rays: Vec<LightRay> = (0..n).map(ray).collect();
            rays[0].power = 0.7;
            let path = folder.path().join("rays.csv");
            write_rays(&path, &rays).unwrap();
            let file = RayFile::open(&path, Flux::Radiant).unwrap();
            let list =
                RayList::new(file, &source, PowerUnit::Watt).unwrap_or_else(|fault| panic!("{}", fault.message));
            let mut sums = Vec::new();
            let mut sum = 0.0;
            for ray in &rays {
                sum += ray.power;
                sums.push(sum);
            }
            assert_eq!((list.power(), list.len()), (sum, n as u64));
            let mut cursor = ListCursor::default();
            for k in [0, 999, 500, 501, 1, 250, 750] {
                let share = f64::from(k) / 1000.0;
                let expected = sums.iter().position(|s| *s > share * sum).unwrap();
                assert_eq!(list.ray_at_share(share, &mut cursor), Some(rays[expected]), "{share} of {n}");
            }
            assert_eq!(list.ray_at_share(1.0, &mut cursor), Some(rays[n - 1]));
            assert_eq!(list.ray(n as u64 - 1, &mut cursor), Some(rays[n - 1]));
            assert_eq!(list.ray(n as u64, &mut cursor), None);
        }
    }
}

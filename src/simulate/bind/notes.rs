//! What someone who reads the results must know about the scene: bodies that are open or too thin, and light of wavelengths that a table or a
//! formula was not made for.

use super::{AMBIENT, BoundScene, Chosen, Loaded};
use crate::model::{Model, PlacedFace};
use crate::optics::catalogue;
use crate::simulate::kernel::{Cause, Counts, LostRay};
use crate::simulate::scene::{ByWavelength, Material, Reflectance, Scene, medium};
use std::collections::{BTreeMap, BTreeSet};

/// First and last wavelength of each source, nm.
pub(super) fn wavelengths(scene: &Scene, loaded: &[Option<Loaded>]) -> Vec<[f64; 2]> {
    let run = [scene.run.wavelength_nm; 2];
    let range = |i: &f64| [*i, *i];
    (scene.sources.iter().zip(loaded))
        .map(|(source, loaded)| match (&source.spectrum, loaded) {
            (Some(key), _) => key.wavelengths(scene.run.unit).map_or(run, |s| s.range_nm()),
            (None, Some(Loaded::Rays(list))) => {
                let all = list.rays.iter().map(|r| r.wavelength_nm.unwrap_or(run[0]));
                all.fold(None, |r: Option<[f64; 2]>, nm| {
                    r.map_or(Some(range(&nm)), |[a, b]| Some([a.min(nm), b.max(nm)]))
                })
                .unwrap_or(run)
            }
            _ => run,
        })
        .collect()
}

/// Something that is known between two wavelengths alone.
struct Known {
    what: String,
    range: [f64; 2],
    /// What is taken beyond them.
    beyond: &'static str,
}

const ENDS: &str = "its first and last values are used there";
const FORMULA: &str = "the formula is used all the same there";

/// One sentence for each table in use that some source's light lies outside of.
pub(super) fn beyond_tables(scene: &Scene, chosen: &Chosen, light: &[[f64; 2]]) -> Vec<String> {
    let media = chosen.iter().filter_map(|(_, rule)| scene.materials.get((*rule)?)?.medium.as_deref());
    let media: BTreeSet<&str> = media.chain(scene.ambient.as_deref()).collect();
    let surfaces: BTreeSet<usize> = chosen.iter().filter_map(|(rule, _)| *rule).collect();
    let mut known: Vec<Known> = media.iter().flat_map(|name| of_medium(scene, name)).collect();
    for rule in surfaces {
        let Some(material) = scene.materials.get(rule) else { continue };
        known.extend(of_surface(material).map(|(key, range)| Known {
            what: format!("`{key}` of [[material]] {}", rule + 1),
            range,
            beyond: ENDS,
        }));
    }
    known.iter().filter_map(|k| sentence(scene, k, light)).collect()
}

fn sentence(scene: &Scene, known: &Known, light: &[[f64; 2]]) -> Option<String> {
    let [from, to] = known.range;
    let outside = |[a, b]: &[f64; 2]| *a < from * (1.0 - 1e-9) || *b > to * (1.0 + 1e-9);
    let (source, [a, b]) = light.iter().enumerate().find(|(_, range)| outside(range))?;
    let whose = match scene.sources.get(source).map(|s| s.name.as_str()) {
        Some(name) if !name.is_empty() => format!("the source '{name}'"),
        _ => format!("[[source]] {}", source + 1),
    };
    let light = if a == b { format!("{a} nm") } else { format!("{a} to {b} nm") };
    let known_for = if from == to { format!("{from} nm alone") } else { format!("{from} to {to} nm") };
    Some(format!("{} is known for {known_for}, but {whose} has light of {light}: {}", known.what, known.beyond))
}

fn ends<'a>(mut nm: impl Iterator<Item = f64> + 'a) -> Option<[f64; 2]> {
    let first = nm.next()?;
    Some(nm.fold([first, first], |[a, b], x| [a.min(x), b.max(x)]))
}

fn of_medium(scene: &Scene, name: &str) -> Vec<Known> {
    let mut known = Vec::new();
    let mut add = |what: String, range: Option<[f64; 2]>, beyond| {
        known.extend(range.map(|range| Known { what, range, beyond }))
    };
    let own = scene.media.iter().find(|m| m.name == name);
    let entry = own.map_or(Some(name), |m| m.catalogue.as_deref());
    if let Some(entry) = entry {
        add(format!("the index of '{entry}'"), catalogue::range_nm(entry), FORMULA);
    }
    if let Some(medium::Medium { index_table, absorption_per_mm, .. }) = own {
        // A single point is a constant.
        let range = |t: &Vec<[f64; 2]>| if t.len() > 1 { ends(t.iter().map(|p| p[0])) } else { None };
        add(format!("`index_table` of the medium '{name}'"), index_table.as_ref().and_then(range), ENDS);
        if let Some(ByWavelength::Table(t)) = absorption_per_mm {
            add(format!("`absorption_per_mm` of the medium '{name}'"), range(t), ENDS);
        }
    }
    known
}

fn of_surface(m: &Material) -> impl Iterator<Item = (&'static str, [f64; 2])> {
    let coating = m.coating.as_ref().and_then(|rows| ends(rows.iter().filter_map(|r| r.get(1).copied())));
    let reflectance = match &m.reflectance {
        Some(Reflectance::ByAngleAndWavelength(rows)) => ends(rows.iter().map(|r| r[1])),
        _ => None,
    };
    [("coating", coating), ("reflectance", reflectance)].into_iter().filter_map(|(key, range)| Some((key, range?)))
}

/// Whether a face is one of no closed shell. Of ready meshes nothing is known.
pub(super) fn is_open(f: &PlacedFace<'_>, model: &Model) -> bool {
    f.face.is_some() && f.shell.is_none_or(|s| !model.part(f.part).shells[s].closed)
}

/// One sentence about the bodies that have faces in no closed shell.
pub(super) fn openings(bound: &BoundScene, model: &Model) -> Option<String> {
    let open = |f: &PlacedFace<'_>| {
        is_open(f, model) && bound.faces.get(f.id.index()).is_some_and(|optics| optics.body != AMBIENT)
    };
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().filter(open).collect();
    let first = faces.first()?;
    let [instance, medium] = bound.body(bound.faces[first.id.index()].body)?;
    let bodies: BTreeSet<u16> = faces.iter().map(|f| bound.faces[f.id.index()].body).collect();
    let others = if bodies.len() > 1 { format!(" (and {} more)", bodies.len() - 1) } else { String::new() };
    let sheet = match (first.name(), first.entity()) {
        ("", Some(entity)) => format!(" (face #{entity})"),
        ("", None) => String::new(),
        (name, Some(entity)) => format!(" (face '{name}', #{entity})"),
        (name, None) => format!(" (face '{name}')"),
    };
    Some(format!(
        "'{instance}'{others} has the medium '{medium}' but no closed shell{sheet}: light that passes its opening is lost; close it in \
         the model, or give it a surface instead of a medium"
    ))
}

/// One sentence about the thinnest body that touches others and is hardly thicker than the glue, along an axis.
pub(super) fn films(bound: &BoundScene) -> Option<String> {
    let glue = bound.scene.run.glue_mm;
    let thickness = |k: u16| bound.bodies[usize::from(k)].bounds.size().min_element();
    let touching: BTreeSet<u16> = bound.faces.iter().filter(|f| f.touching).map(|f| f.body).collect();
    let thin = touching.into_iter().filter(|&k| k != AMBIENT && thickness(k) < 2.0 * glue);
    let film = thin.min_by(|a, b| thickness(*a).total_cmp(&thickness(*b)))?;
    let [name, medium] = bound.body(film)?;
    let thick = thickness(film);
    Some(format!(
        "'{name}' ({medium}) is {thick:.1e} mm thick, hardly more than [run] glue_mm = {glue:e}, within which faces of touching bodies \
         are one: light may pass it by or be lost; set glue_mm to {:.0e}",
        0.1 * thick
    ))
}

impl BoundScene {
    /// One sentence about bodies of different media that a run found to overlap.
    pub(crate) fn overlap_note(&self, counts: &Counts) -> Option<String> {
        let [[a, medium_a], [b, medium_b]] = [self.body(counts.overlapping[0])?, self.body(counts.overlapping[1])?];
        let times = counts.overlaps;
        // Beside edges where bodies touch rounding may pass for it: in one scene once in 10^6 segments.
        (times > counts.segments / 10_000).then(|| {
            format!(
                "'{a}' ({medium_a}) and '{b}' ({medium_b}) overlap farther than [run] glue_mm, met {times} times by light; there it is \
                 taken to be in the body that it came into last, so what is right depends on its way: cut one out of the other in the \
                 model, or give finer facets where solids touch in curved faces"
            )
        })
    }

    /// One sentence about lost light: where most of it was, and why.
    pub(crate) fn lost_note(&self, lost: u64, ledger: &[LostRay]) -> Option<String> {
        let mut places: BTreeMap<(u16, Option<&str>, Cause), usize> = BTreeMap::new();
        for l in ledger {
            let at = l.face.and_then(|f| self.instance(f));
            *places.entry((l.body, at, l.cause)).or_default() += 1;
        }
        let ((body, at, cause), number) = places.into_iter().rev().max_by_key(|(_, number)| *number)?;
        let why = match cause {
            Cause::NoExit => {
                "it left the scene inside a body, by a gap between faces, an open mesh or a missing face"
            }
            Cause::ImpossibleMedium => {
                "it came to a face from the wrong side, as where a mesh gapes or is turned, or bodies overlap"
            }
            Cause::InsideSolid => "it came to a closed opaque solid from inside, as from a source that lies in it",
            Cause::TooDeep => "more bodies lie in each other than a ray can carry",
            Cause::NotANumber => "its place or direction is no number",
        };
        let place = match (self.body(body).filter(|_| body != AMBIENT), at) {
            (Some([name, medium]), _) => format!("in '{name}' ({medium})"),
            (None, Some(name)) => format!("at '{name}'"),
            (None, None) => "outside all bodies".into(),
        };
        Some(format!(
            "{lost} paths were lost; {number} of the {} on record {place}: {why}; `trace --replay lost_rays.csv` shows their ways",
            ledger.len()
        ))
    }
}

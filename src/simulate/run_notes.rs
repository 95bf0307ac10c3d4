//! What someone who reads the results must know about a run: light that was lost, bodies that overlap.

use super::bind::BoundScene;
use super::outcome::{Counts, LostRay};
use super::plan::Plan;
use super::receiver::{NAMED_RECEIVERS, Receiver, Shape};
use super::tally::Sum;
use crate::text::{count_of, figures, first_sentences, grouped};

/// Segments per meeting of an overlap below which a note reports it. Beside edges where bodies touch rounding may pass for an overlap: in
/// one scene once in 10^6 segments.
const OVERLAP_SEGMENTS: u64 = 10_000;
/// Rays of a source per ray that starts in a face and shines into it, below which a note says so: rarer ones start by chance within
/// the glue distance of a face that a source stands across.
const FLUSH_RAYS: u64 = 10_000;
/// Rays of a source below which next to nothing is known of its light.
const SCARCE_RAYS: u64 = 64;
/// Power of a ray over that of the mean one above which a note says that a source has few rays.
const HEAVY: f64 = 10.0;
/// Chance that all rays of a source miss a place, below which it is neglected: errors are to hold in 95 % of runs.
const UNLIKELY: f64 = 0.05;
/// Draws of each ray of a list, were all of equal power, from which on its own scatter is more than theirs.
const DRAWN_OFTEN: f64 = 2.0;
/// Share of a list's light that arrives where the list's uncertainty is greatest, for which that uncertainty is reported.
const MOST_OPEN_SHARE: f64 = 0.5;
/// Share of a list's rays below which a note says how many of equal power would have the same uncertainty.
const UNEVEN: f64 = 0.9;
/// Share of a source's power above which the change by rounding is reported.
const ROUNDED: f64 = 1e-5;
/// Share of the mean power of a source below which a note reports it: of thousands alike each has few rays, and all together enough.
const WEAK: f64 = 0.1;

impl BoundScene {
    /// Returns one sentence about bodies of different media that a run found to overlap; `None` where that was rarer than once in
    /// [`OVERLAP_SEGMENTS`] segments.
    pub(crate) fn overlap_note(&self, counts: &Counts) -> Option<String> {
        let [[a, medium_a], [b, medium_b]] =
            [self.body_names(counts.overlapping[0])?, self.body_names(counts.overlapping[1])?];
        let times = counts.overlaps;
        // Rare meetings are the rounding of edges, and not worth alarming anybody.
        (times > counts.segments / OVERLAP_SEGMENTS).then(|| {
            format!(
                "'{a}' ({medium_a}) and '{b}' ({medium_b}) overlap farther than [run] glue_mm, met {} by light; there it is \
                 taken to be in the body that it came into last, so what is right depends on its way: cut one out of the other in the \
                 model, or give finer facets where solids touch in curved faces",
                count_of(times, "time")
            )
        })
    }

    /// Returns sentences about places where the kernel did less than the scene requests, each where it was more frequent than once
    /// in [`OVERLAP_SEGMENTS`] segments or rays.
    pub(crate) fn repair_notes(&self, counts: &Counts) -> impl Iterator<Item = String> + use<> {
        let contacts = (counts.refused_contacts > counts.segments / OVERLAP_SEGMENTS).then(|| {
            format!(
                "light met two touching faces of which the second bounds no body that it was in or could enter, as of an open or \
                 overlapping part, and crossed the first alone: {}",
                count_of(counts.refused_contacts, "time")
            )
        });
        let starts = (counts.misplaced_starts > counts.rays / OVERLAP_SEGMENTS).then(|| {
            format!(
                "where no facet of a luminous face lies within 1 mm, its light started on the spline and may have met the face itself: \
                 {}; take a finer tolerance for it",
                count_of(counts.misplaced_starts, "ray")
            )
        });
        contacts.into_iter().chain(starts)
    }

    /// Returns one sentence about sources that lie in the face of a body and shine into it, where the scene does not say what they are in,
    /// naming the first; `None` where fewer start so than one in [`FLUSH_RAYS`] of the rays that it has in the replicates that are `done`.
    pub(crate) fn flush_sources_note(&self, counts: &Counts, plan: &Plan, done: &[u32]) -> Option<String> {
        let [source, face] = counts.flush_place;
        if counts.flush_starts == 0 || counts.flush_starts <= plan.rays_in(source as usize, done) / FLUSH_RAYS {
            return None;
        }
        let body = self.faces.get(face as usize)?.body;
        let [name, medium] = self.body_names(body)?;
        Some(format!(
            "{} lies in {} and shines into it: light that starts so, {} in all, is taken to start inside of the body, here '{name}' \
             ({medium}), as if glued to it, and loses nothing in its face; move the source off by more than [run] glue_mm = {:e}, as \
             behind a gap of air, or say by `inside` which bodies it lies in, outermost first",
            self.scene.source_label(source as usize),
            self.face_label(face),
            count_of(counts.flush_starts, "ray"),
            self.scene.run.glue_mm
        ))
    }

    /// Returns one sentence about sources so weak beside the others that they send next to no rays; `None` where there are none.
    pub(crate) fn scarce_sources_note(&self, plan: &Plan) -> Option<String> {
        let even_share = plan.emitted / self.emitters.len() as f64;
        let is_scarce = |source: &usize| {
            let emitter = &self.emitters[*source];
            plan.rays_of_source(*source) < SCARCE_RAYS
                && emitter.rays.is_none()
                && emitter.power < WEAK * even_share
        };
        let scarce: Vec<usize> = (0..self.emitters.len()).filter(is_scarce).collect();
        let &first = scarce.iter().min_by_key(|source| plan.rays_of_source(**source))?;
        let name = self.scene.source_label(first);
        let (rays, percent) = (plan.rays_of_source(first), 100.0 * self.emitters[first].power / plan.emitted);
        let others =
            if scarce.len() > 1 { format!(" ({} sources have so few)", scarce.len()) } else { String::new() };
        Some(format!(
            "{name} sends {rays} of the {} rays, as it has {percent:.1e} % of the power{others}: what it lights alone is not known; give it \
             `rays` of its own",
            grouped(plan.rays)
        ))
    }

    /// Returns one sentence about sources whose `rays` are so few beside their power that the spread of replicates may give too small or
    /// too large an error of their light, and by how much; `None` where there are none. Rays count in the replicates that are `done`: where
    /// none is, as in a replay, no error is reported.
    pub(crate) fn heavy_rays_note(&self, plan: &Plan, done: &[u32]) -> Option<String> {
        if done.is_empty() {
            return None;
        }
        let share = |source: usize| self.emitters[source].power / plan.emitted;
        // Of a ray among the power of all, against what a ray carries in the mean.
        let weight = |source: usize| share(source) / plan.rays_of_source(source) as f64 * plan.rays as f64;
        let is_heavy = |source: &usize| {
            // Their own scatter is above that of a run whose rays all weigh alike.
            let scatters = weight(*source) > HEAVY && weight(*source) * share(*source) > 1.0;
            let scarce = SCARCE_RAYS.max(done.len() as u64);
            self.emitters[*source].rays.is_some() && scatters && plan.rays_in(*source, done) < scarce
        };
        let first = (0..self.emitters.len()).filter(is_heavy).max_by(|a, b| weight(*a).total_cmp(&weight(*b)))?;
        let rays = plan.rays_in(first, done);
        // Of independent rays at least one meets a place that gets a larger share of their light, but in one run of twenty.
        let missed = 1.0 - UNLIKELY.powf(1.0 / rays as f64);
        let too_large = replicate_scatter(rays, done.len()).map_or_else(String::new, |scatter| {
            format!(
                ", and too large by up to {} % where all arrive, as they lie in {rays} of {} replicates alone",
                figures(100.0 * scatter * share(first), 2),
                done.len()
            )
        });
        Some(format!(
            "{} has {} % of the power in {}: printed errors may be too small, as where none of them arrives up to {} % of the power may be \
             missing{too_large}; give it more `rays`",
            self.scene.source_label(first),
            figures(100.0 * share(first), 2),
            count_of(rays, "ray"),
            figures(100.0 * missed * share(first), 2)
        ))
    }

    /// Returns one sentence about ray lists of which each ray, were all of equal power, is drawn twice or more: what a list leaves open, as
    /// a sample of its light, is then more than the scatter of the draws, which alone is in the errors. `None` where there are none.
    pub(crate) fn short_lists_note(&self, plan: &Plan, done: &[u32]) -> Option<String> {
        let short_list = |source: usize| {
            let even = self.emitters[source].list()?.even_rays();
            (plan.rays_in(source, done) as f64 >= DRAWN_OFTEN * even).then_some((source, even))
        };
        let short: Vec<(usize, f64)> = (0..self.emitters.len()).filter_map(short_list).collect();
        let &(first, even) = short.iter().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let listed = self.emitters[first].list()?.len();
        let as_good = if even < UNEVEN * listed as f64 {
            format!(", as good as {} of equal power", figures(even, 3))
        } else {
            String::new()
        };
        let others = if short.len() > 1 {
            format!(" ({} lists are drawn from so often)", short.len())
        } else {
            String::new()
        };
        // What arrives of independent rays is binomial.
        let open = MOST_OPEN_SHARE * (1.0 - MOST_OPEN_SHARE);
        Some(format!(
            "{} draws {} from a list of {}{as_good}{others}: printed errors are those of the draws; what the list itself leaves open, about \
             {} % of its light where half of it arrives, is in none of them",
            self.scene.source_label(first),
            count_of(plan.rays_in(first, done), "ray"),
            grouped(listed),
            figures(100.0 * (open / even).sqrt(), 2)
        ))
    }

    /// Returns one sentence about sources so weak beside the others that the rounding of their rays' power to whole quanta shows; `None`
    /// where there are none.
    pub(crate) fn rounded_sources_note(&self, plan: &Plan) -> Option<String> {
        let rounding = |&source: &usize| (plan.counted_power(source) / self.emitters[source].power - 1.0).abs();
        let first = (0..self.emitters.len()).max_by(|a, b| rounding(a).total_cmp(&rounding(b)))?;
        (rounding(&first) > ROUNDED).then(|| {
            format!(
                "the light of {} is counted as {} instead of {}: its rays weigh so little beside those of other sources that they are \
                 rounded; trace it in a run of its own, without those",
                self.scene.source_label(first),
                figures(plan.counted_power(first), 4),
                figures(self.emitters[first].power, 4)
            )
        })
    }

    /// Returns sentences about receivers that end light but count that of so many interactions alone, and got none: `counted` says what
    /// each got. Mostly light met them on the way to where it was to interact. One for each of the first, and one that counts the others.
    pub(crate) fn uncounted_light_notes(&self, counted: &[Sum]) -> Vec<String> {
        let ends_light =
            |r: &Receiver| r.absorbs && !matches!(r.shape, Shape::FarField { .. } | Shape::Absorbed { .. });
        let dark = self.receivers.iter().zip(counted).filter(|(r, sum)| ends_light(r) && sum.total == 0);
        let sentences = dark.filter_map(|(r, _)| {
            let n = r.interactions.filter(|&n| n > 0)?;
            Some(format!(
                "'{}' counts light after exactly {} alone, and none came: what meets it before ends there uncounted, \
                 unless it has `absorbs = false`",
                r.name,
                count_of(n.into(), "interaction")
            ))
        });
        first_sentences(sentences, NAMED_RECEIVERS, |further| {
            format!("the same holds for {}", count_of(further as u64, "more receiver"))
        })
    }

    /// Returns one sentence about lost light: where most of it was, and why; `None` where the ledger is empty. `lost` counts those beyond
    /// it.
    pub(crate) fn lost_note(&self, lost: u64, ledger: &[LostRay]) -> Option<String> {
        let first = self.loss_reasons(ledger).into_iter().next()?;
        let recorded = ledger.len() as u64;
        let verb = if lost == 1 { "was" } else { "were" };
        let of = if recorded < lost { format!("; of the first {}", grouped(recorded)) } else { String::new() };
        Some(format!(
            "{} {verb} lost{of}, {first}; `trace --replay lost_rays.csv` shows the paths",
            count_of(lost, "path")
        ))
    }
}

/// Returns the relative error of the power of so few rays by the spread of so many replicates, though all of them arrive:
/// one replicate has a ray, another none. `None` where each has one, and where none has.
fn replicate_scatter(rays: u64, replicates: usize) -> Option<f64> {
    let (rays, replicates) = (rays as f64, replicates as f64);
    let some_have_none = rays > 0.0 && rays < replicates;
    // Of n rays in n of N replicates the squares about the mean add up to n (1 − n/N).
    some_have_none.then(|| ((1.0 - rays / replicates) / rays * replicates / (replicates - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::model::Model;
    use crate::simulate::outcome::LostCause;
    use crate::simulate::{RunSettings, Scene};
    use std::path::Path;

    #[test]
    fn lost_paths_are_counted_as_people_count() {
        let scene = Scene::parse("[[source]]\nkind = 'point'\n", "s.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let ray = LostRay {
            ray: 0,
            branch: 0,
            bounce: 0,
            cause: LostCause::NotANumber,
            quanta: 1,
            origin: Point::ZERO,
            direction: Vector::Z,
            face: None,
            body: 0,
        };
        let note = |lost, ledger: &[LostRay]| bound.lost_note(lost, ledger).unwrap();
        let one = note(1, std::slice::from_ref(&ray));
        assert!(one.starts_with("1 path was lost, 1 outside all bodies: "), "{one}");
        let many = note(3000, &[ray.clone(), ray]);
        assert!(many.starts_with("3000 paths were lost; of the first 2, 2 outside all bodies: "), "{many}");
        assert_eq!(bound.lost_note(0, &[]), None);
    }

    /// The 32 rays of half the power lie in every fourth of 128 replicates, from the fourth on. n of them all miss 1 − 0.05^(1/n) of their
    /// light in one run of twenty: 0.0894 of 32, 0.1708 of 16, and all of it of none. Where n of N replicates have a ray, N/4 here, their
    /// spread is √(3/4 / n · N/(N − 1)) of it: 0.1537 of 32 and 0.2182 of 16.
    #[test]
    fn heavy_rays_are_counted_in_the_replicates_that_are_done() {
        let text =
            "[[source]]\nname = 'few'\nkind = 'point'\nrays = 32\n[[source]]\nkind = 'point'\nrays = 50_000\n";
        let bound = Scene::parse(text, "s.toml", Path::new(".")).unwrap().bind(&Model::default()).unwrap();
        let plan = Plan::new(&bound, &RunSettings::default());
        let note = |replicates: u32| bound.heavy_rays_note(&plan, &(0..replicates).collect::<Vec<u32>>());
        let runs = [(128, 32, "4.5", Some("7.7")), (64, 16, "8.5", Some("11")), (3, 0, "50", None)];
        for (replicates, rays, missing, too_large) in runs {
            let note = note(replicates).unwrap();
            let scatter = too_large.map(|percent| format!("too large by up to {percent} % where all arrive"));
            assert_eq!(note.contains("too large"), scatter.is_some(), "{note}");
            assert!(scatter.is_none_or(|scatter| note.contains(&scatter)), "{note}");
            let counted = note.starts_with(&format!("the source 'few' has 50 % of the power in {rays} rays: "));
            assert!(counted && note.contains(&format!("up to {missing} % of the power may be missing")), "{note}");
        }
        assert_eq!(note(0), None);
    }
}

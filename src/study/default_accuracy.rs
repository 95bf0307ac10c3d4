//! Tolerance, normals and intersector of a run that asks for none: what keeps the error from the facets below that from the number
//! of rays on every figure that is printed.
//!
//! A pilot traces a few per cent of the run's rays on facets and on the spline ([`super::geometric_error`]) and foretells the
//! standard errors of the whole run. Facets are taken where their error stays below these on every figure, else finer ones or facets whose
//! hits are moved to the spline, where by counted work these are cheaper than the spline and they pass a pilot of their own, else the
//! spline.
//!
//! Guarantee: the choice follows from model, scene, seed, number of rays and counted work, never from a clock, so that every
//! machine, number of threads and shard makes the same one, and so does every range of a run that grows.
//! Known weakness: errors that the pilot is too short to distinguish from none count as large, so that the spline is taken where facets
//! might have done.

use super::geometric_error::{GeometricError, MOST_CELLS, ReplicatedRun, compare, trace_replicates};
use super::tracing_way::{ON_FACETS, ON_SPLINE, Way, unfit_moved_hits, ways_before_spline};
use super::worst_figure::{Worst, worst_figure};
use crate::intersect::{Intersector, NormalMode};
use crate::model::{Face, Model};
use crate::simulate::{BoundScene, RunSettings};
use crate::tessellate::GroupedFacets;
use crate::text::grouped;
use serde::Serialize;
use std::time::Instant;

/// The pilot traces one ray in so many.
const SHARE: u64 = 32;
/// Least and most rays of a pilot: fewer resolve no map, more would only show differences too small to matter.
const PILOT_RAYS: [u64; 2] = [4096, 65_536];
/// Runs of at most so many rays take the spline at once: a pilot would cost much of what facets could save.
const SHORT_RUN: u64 = 32_768;
/// A run that grows is judged as of so many rays, whichever of them are asked for: all its ranges take the same settings, so that they
/// merge, and what it took holds until it has grown so far.
const GROWN_RAYS: u64 = 100_000_000;
/// Replicates of a pilot, which give the standard error of a difference within 9 %.
const REPLICATES: u32 = 64;
/// Share of the light that the spline may lose beyond what facets do before facets are taken all the same.
const LOST: f64 = 1e-3;

/// Why facets are the surface itself: with ready meshes among the faces, and without.
const READY_OR_FLAT: &str = "all faces are ready meshes or flat, so that facets are the surface that was given; how far a ready mesh is \
    from its own original is not known";
const FLAT: &str = "all faces are flat, so that facets are the surface itself";

/// Why nothing can be met: without a face, and where no face has facets.
const NO_MODEL: &str = "there is no model";
const NO_FACETS: &str = "no face has facets";

/// The tolerance, normals and intersector that a run is traced with, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracingChoice {
    /// Smallest and largest tolerance of the facets, mm; of those that are drawn, where the run is on the spline.
    pub tolerance_mm: [f64; 2],
    /// Normals at the hits.
    #[serde(serialize_with = "by_name")]
    pub normals: NormalMode,
    /// `octree`, or `exact` for the spline.
    pub intersector: &'static str,
    /// Why it was chosen, as the end of a sentence.
    pub because: String,
    /// Whether there is nothing that light could meet, so that it is traced on neither facets nor spline; [`Self::because`] says why.
    #[serde(skip)]
    pub has_no_surface: bool,
    /// Rays of the pilot; 0 where none was needed.
    pub pilot_rays: u64,
    /// Seconds of the pilot.
    pub pilot_seconds: f64,
    /// Everything that was measured, the choice among it.
    pub alternatives: Vec<Alternative>,
    /// What the facets that were taken change of the figures; `None` on the spline.
    #[serde(skip)]
    pub geometric: Option<GeometricError>,
}

/// One way to trace the run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    /// Smallest and largest tolerance of the facets, mm.
    pub tolerance_mm: [f64; 2],
    /// Normals at the hits.
    #[serde(serialize_with = "by_name")]
    pub normals: NormalMode,
    /// `octree` or `exact`.
    pub intersector: &'static str,
    /// Seconds of tracing the whole run so, or 10⁸ rays of one that grows, from those of the pilot.
    pub seconds: f64,
    /// What it gets wrong of the figure that it gets most wrong, as a share of that figure; absent where it is 0 on the spline, as the
    /// width of a perfect focus is.
    pub geometric_share: Option<f64>,
    /// The same in standard errors of the whole run; up to 1 is allowed.
    pub geometric_to_statistical: f64,
    /// That figure, as in `focus: rms_1`.
    pub figure: String,
}

/// Writes normals by their name.
fn by_name<S: serde::Serializer>(n: &NormalMode, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(n.name())
}

/// Facets with the seconds that they took.
#[derive(Clone, Debug)]
pub struct TimedFacets {
    /// Of the model in one piece or in groups.
    pub facets: GroupedFacets,
    /// Seconds to make them.
    pub seconds: f64,
}

/// Makes what a pilot compares.
pub trait PilotSource {
    /// Makes facets within a tolerance `[min, max]`, mm.
    fn facets(&self, tolerance: [f64; 2]) -> TimedFacets;
    /// Builds the octree over facets, with bilinear normals.
    fn octree<'f>(&'f self, facets: &'f GroupedFacets) -> Box<dyn Intersector + 'f>;
    /// Builds the octree over facets with hits moved to the spline, and calls `work` with it.
    fn with_moved_hits(&self, facets: &GroupedFacets, work: &mut dyn FnMut(&dyn Intersector));
    /// Returns the intersector of the certified spline; ready meshes, which have no spline, answer with their facets.
    fn exact(&self) -> &dyn Intersector;
}

/// A run whose tolerance, normals and intersector are still to be chosen.
#[derive(Clone, Copy)]
pub struct UndecidedRun<'a> {
    /// The models of its groups; of a model in one piece that one.
    pub models: &'a [Model],
    /// The scene.
    pub bound: &'a BoundScene,
    /// Its settings: seed and rays decide, of a run that grows not how many; threads and shard do not.
    pub run: &'a RunSettings,
    /// Makes finer facets and the spline.
    pub source: &'a dyn PilotSource,
    /// Facets of the tolerance below.
    pub facets: &'a GroupedFacets,
    /// Smallest and largest tolerance of these facets, mm: the default, or a coarser one where that would make too many.
    pub tolerance: [f64; 2],
}

/// Chooses facets or spline, by a pilot unless [`UndecidedRun::needs_pilot`] says no; returns finer facets too where the choice is those
/// that it made.
pub fn choose(undecided: &UndecidedRun<'_>) -> (TracingChoice, Option<TimedFacets>) {
    let start = Instant::now();
    let UndecidedRun { bound, tolerance, .. } = *undecided;
    if let Some(chosen) = undecided.without_pilot() {
        return (chosen, None);
    }
    let settings = undecided.pilot_settings();
    // Standard errors are foretold for as many rays as the run has, or will have grown to.
    let scale = undecided.judged_rays() as f64 / settings.rays as f64;
    let judged = undecided.judged_note();
    let spline = trace_replicates(bound, undecided.source.exact(), &settings);
    let emitted = spline.results.power.emitted;
    let on_facets = trace_replicates(bound, &*undecided.source.octree(undecided.facets), &settings);
    let error = compare(bound, [&on_facets, &spline]);
    let ends = &spline.results.power_errors;
    let worst = worst_figure(bound, (&error, ends), &settings, scale);
    let mut alternatives = vec![
        alternative(tolerance, ON_FACETS, &worst, error.seconds[0] * scale),
        alternative(tolerance, ON_SPLINE, &Worst::default(), error.seconds[1] * scale),
    ];
    let chosen =
        |(intersector, normals), tolerance_mm, because, alternatives, geometric: Option<GeometricError>| {
            TracingChoice {
                tolerance_mm,
                normals,
                intersector,
                because,
                has_no_surface: false,
                pilot_rays: settings.rays,
                pilot_seconds: start.elapsed().as_secs_f64(),
                alternatives,
                geometric: geometric.map(|error| error.with_unseen_rays(emitted)),
            }
        };
    let unjudged = error.unjudged(scale, emitted).map(|name| name.to_owned());
    if worst.ratio <= 1.0 && unjudged.is_none() {
        let because = undecided.unchanged_reason(&worst);
        return (chosen(ON_FACETS, tolerance, because, alternatives, Some(error)), None);
    }
    // What the spline loses is an error too, and one that more rays do not mend.
    if error.lost[1] > error.lost[0] + LOST {
        let because = "the spline loses more light than facets do".to_owned();
        return (chosen(ON_FACETS, tolerance, because, alternatives, Some(error)), None);
    }
    if let Some(name) = unjudged {
        let because = format!("too few of the pilot's rays reach {name} to judge what facets change there");
        return (chosen(ON_SPLINE, tolerance, because, alternatives, None), None);
    }
    // The cheapest first; each must pass a pilot of its own.
    let mut unfit = None;
    let hits = error.segments_per_ray * undecided.judged_rays() as f64;
    for way in ways_before_spline(worst.ratio, undecided.made_facets(), hits) {
        let tried = undecided.try_way(way, &settings, &spline);
        let tried_worst = match way {
            Way::Finer(_) => worst_figure(bound, (&tried.error, ends), &settings, scale),
            // Moved hits are mostly the spline's own: no difference at all is not none.
            Way::Moved => {
                // Of all light what is seen is enough: of most scenes its errors are next to none.
                let power = tried.error.power;
                let error = GeometricError { power, ..tried.error.clone().with_unseen_rays(emitted) };
                worst_figure(bound, (&error, ends), &settings, scale)
            }
        };
        let seconds = tried.error.seconds[0] * scale + tried.finer.as_ref().map_or(0.0, |finer| finer.seconds);
        // Between the two that are always there.
        let record = alternative(tried.tolerance_mm, way.traced_with(), &tried_worst, seconds);
        alternatives.insert(alternatives.len() - 1, record);
        let passes = tried_worst.ratio <= 1.0;
        if passes && tried.unfit.is_none() {
            let because = format!("{} ({}{judged})", way.reason(), worst.in_words());
            let chosen = chosen(way.traced_with(), tried.tolerance_mm, because, alternatives, Some(tried.error));
            return (chosen, tried.finer);
        }
        unfit = unfit.or(tried.unfit.filter(|_| passes));
    }
    let worst = worst.in_words();
    let unfit = unfit.map(|why| format!("; {why}")).unwrap_or_default();
    let because = format!("facets change the answer by more than its statistical error ({worst}{judged}){unfit}");
    (chosen(ON_SPLINE, tolerance, because, alternatives, None), None)
}

/// What came of the pilot of a [`Way`].
struct TriedWay {
    tolerance_mm: [f64; 2],
    error: GeometricError,
    /// Why it is not taken however little it gets wrong.
    unfit: Option<&'static str>,
    /// Facets finer than the default ones.
    finer: Option<TimedFacets>,
}

/// Makes the record of a way to trace the run: its tolerance `[min, max]`, mm, the seconds of the whole run, and the figure that it gets
/// most wrong.
fn alternative(
    tolerance_mm: [f64; 2],
    (intersector, normals): (&'static str, NormalMode),
    worst: &Worst,
    seconds: f64,
) -> Alternative {
    Alternative {
        tolerance_mm,
        normals,
        intersector,
        seconds,
        geometric_share: worst.share,
        geometric_to_statistical: worst.ratio,
        figure: worst.figure.clone(),
    }
}

impl UndecidedRun<'_> {
    /// Whether it takes a pilot to choose.
    pub fn needs_pilot(&self) -> bool {
        self.without_pilot().is_none()
    }

    /// Chooses facets or spline by what is known without tracing, as for flat faces, ready meshes alone and short runs; `None` where a
    /// pilot is needed.
    fn without_pilot(&self) -> Option<TracingChoice> {
        // Cheap checks come first.
        let has_no_surface = self.facets.is_empty();
        let ((intersector, normals), because) = if has_no_surface {
            (ON_FACETS, if self.faces().next().is_none() { NO_MODEL } else { NO_FACETS })
        } else if self.is_flat() {
            let has_mesh = self.faces().any(|face| face.is_none());
            (ON_FACETS, if has_mesh { READY_OR_FLAT } else { FLAT })
        } else if self.judged_rays() <= SHORT_RUN {
            (ON_SPLINE, "the run has so few rays that a pilot would cost much of what facets could save")
        } else if self.bound.emitters.iter().any(|e| e.rays.is_some_and(|n| n > self.judged_rays() / SHARE)) {
            (ON_SPLINE, "a source has so many rays of its own that a pilot would trace most of the run")
        } else if self.has_huge_map() {
            (ON_SPLINE, "a map of so many cells takes longer to compare than the spline to trace")
        } else {
            return None;
        };
        let because = because.to_owned();
        Some(TracingChoice {
            tolerance_mm: self.tolerance,
            normals,
            intersector,
            because,
            has_no_surface,
            pilot_rays: 0,
            pilot_seconds: 0.0,
            alternatives: Vec::new(),
            // On flat faces nothing is changed, and that needs no rays to know.
            geometric: (intersector == ON_FACETS.0).then(|| GeometricError::of_exact_facets(self.bound)),
        })
    }

    /// Whether a receiver has so many cells that a pilot does not keep them apart.
    fn has_huge_map(&self) -> bool {
        self.bound.receivers.iter().any(|r| r.cell_count() > MOST_CELLS)
    }

    /// Iterates over the faces of all groups, those of a part that is placed often once; `None` for one of a ready mesh.
    fn faces(&self) -> impl Iterator<Item = Option<&Face>> {
        self.models.iter().flat_map(|model| model.placed_faces()).map(|placed| placed.face)
    }

    /// Whether every face is a polygon in a plane or a ready mesh.
    fn is_flat(&self) -> bool {
        self.faces().flatten().all(Face::is_polygon)
    }

    /// Returns how many facets of the default tolerance were made: those of a part that is placed often count once.
    fn made_facets(&self) -> usize {
        self.facets.meshes().map(|mesh| mesh.facets.len()).sum()
    }

    /// Returns the number of rays whose statistical error facets must stay below.
    fn judged_rays(&self) -> u64 {
        if self.run.grows { GROWN_RAYS } else { self.run.rays }
    }

    /// Writes for how many rays the run is judged: those of the errors that a reason states, which may be more than were traced in the end.
    fn judged_note(&self) -> String {
        if self.run.grows {
            return "; a run that grows is judged as one of 10⁸ rays".into();
        }
        format!("; judged for a run of {} rays", grouped(self.run.rays))
    }

    /// Says why facets are taken that change no figure of the pilot by much: printed errors from the facets are larger all the same, for
    /// they hold what rarer rays than the pilot's may meet.
    fn unchanged_reason(&self, worst: &Worst) -> String {
        format!(
            "on the pilot's {} rays facets change no figure by more than its statistical error ({}{}); what so few may have missed \
             is in the errors from the facets",
            grouped(self.pilot_settings().rays),
            worst.in_words(),
            self.judged_note()
        )
    }

    /// Returns the run's settings with the pilot's number of rays, from the first one on, its own replicates and no shard.
    fn pilot_settings(&self) -> RunSettings {
        let rays = (self.judged_rays() / SHARE).clamp(PILOT_RAYS[0], PILOT_RAYS[1]).min(self.judged_rays());
        // The first rays, whichever are asked for: every range of a run that grows must choose alike.
        RunSettings {
            rays,
            first_ray: 0,
            grows: false,
            replicates: REPLICATES,
            path_samples: 0,
            shard: [0, 1],
            ..self.run.clone()
        }
    }

    /// Traces the pilot so, and compares it with that on the spline.
    fn try_way(&self, way: Way, settings: &RunSettings, spline: &ReplicatedRun) -> TriedWay {
        let compared = |run: &ReplicatedRun| compare(self.bound, [run, spline]);
        match way {
            Way::Finer(factor) => {
                let tolerance_mm = self.tolerance.map(|t| t / factor);
                let finer = self.source.facets(tolerance_mm);
                let error = compared(&trace_replicates(self.bound, &*self.source.octree(&finer.facets), settings));
                TriedWay { tolerance_mm, error, unfit: None, finer: Some(finer) }
            }
            Way::Moved => {
                let mut run = None;
                self.source.with_moved_hits(self.facets, &mut |moved| {
                    run = Some(trace_replicates(self.bound, moved, settings));
                });
                let run = run.expect("the source calls what it is given");
                let asked = run.results.cost.doubtful as f64 / run.results.segments.max(1) as f64;
                let error = compared(&run);
                let unfit = unfit_moved_hits(error.lost, asked);
                TriedWay { tolerance_mm: self.tolerance, error, unfit, finer: None }
            }
        }
    }
}

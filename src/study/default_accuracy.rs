//! Tolerance, normals and intersector of a run that asks for none: what keeps the error from the facets below that from the number
//! of rays on every figure that is printed.
//!
//! A pilot traces a few per cent of the run's rays on facets and on the spline ([`super::geometric_error`]) and foretells the
//! standard errors of the whole run. Facets are taken where their error stays below these on every figure, else finer ones where
//! they are cheaper than the spline by counted work and pass a pilot of their own, else the spline.
//!
//! Guarantee: the choice follows from model, scene, seed, number of rays and counted work, never from a clock, so that every
//! machine, number of threads and shard makes the same one, and so does every range of a run that grows.
//! Known weakness: errors that the pilot is too short to tell from none count as large, so that the spline is taken where facets
//! might have done.

use super::geometric_error::{GeometricError, MOST_CELLS, ReceiverError, ReplicatedRun, compare, trace_replicates};
use super::mesh_source::{FacetTree, MeasuredMesh, MeshSource};
use crate::intersect::NormalMode;
use crate::math::Uv;
use crate::mesh::FacetMesh;
use crate::model::{Face, Model};
use crate::simulate::scene::Sampling;
use crate::simulate::{BoundScene, RunSettings};
use serde::Serialize;
use std::time::Instant;

/// The pilot traces one ray in so many.
const SHARE: u64 = 32;
/// Least and most rays of a pilot: fewer tell nothing of a map, more would only show what is far below what people look at.
const PILOT_RAYS: [u64; 2] = [4096, 65_536];
/// Runs of at most so many rays take the spline at once: a pilot would cost a good part of what facets could save.
const SHORT_RUN: u64 = 32_768;
/// A run that grows is judged as of so many rays, whichever of them are asked for: all its ranges take the same settings, so that they
/// merge, and what it took holds until it has grown so far.
const GROWN_RAYS: u64 = 100_000_000;
/// Replicates of a pilot, which tell the standard error of a difference within 9 %.
const REPLICATES: u32 = 64;
/// Standard errors of sums over a scrambled net fall with the number of rays to this power: 0.52 to 0.68 for power, positions and
/// widths on the three scenes of the fixtures from 2¹⁴ to 2²⁰ rays.
const NET_ORDER: f64 = 0.6;
/// The same of independent random numbers, and of cells, each of which few rays reach.
const RANDOM_ORDER: f64 = 0.5;
/// Share of the light that the spline may lose beyond what facets do before facets are taken all the same.
const LOST: f64 = 1e-3;
/// Errors below this share of a figure are nobody's concern.
const NEGLIGIBLE: f64 = 1e-6;
/// Corners this near to one plane, as a share of their distances, span one: rounding of a file's twelve digits.
const PLANE: f64 = 1e-10;
/// Finer facets are tried up to this many times the error allowed: beyond it they are too many for their work to be foretold.
const MOST_FINER: f64 = 50.0;
/// The error of interpolated normals and places falls with the tolerance at first order or faster; so much finer to be sure.
const MARGIN: f64 = 1.5;
/// Work of one nearest hit on facets with the rest of its path, ns on one thread of an x86-64 of 2021 (AMD EPYC); measured on the
/// three scenes of the fixtures, as are the others.
const FACET_HIT: f64 = 350.0;
/// The same on the spline.
const SPLINE_HIT: f64 = 850.0;
/// Work of making one facet and sorting it into the octree.
const FACET: f64 = 15_000.0;

/// What a run is traced with, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chosen {
    /// Smallest and largest tolerance of the facets, mm; of those that are drawn, where the run is on the spline.
    pub tolerance_mm: [f64; 2],
    /// Normals at the hits.
    #[serde(serialize_with = "by_name")]
    pub normals: NormalMode,
    /// `octree`, or `exact` for the spline.
    pub intersector: &'static str,
    /// One sentence.
    pub because: String,
    /// Rays of the pilot; 0 where none was needed.
    pub pilot_rays: u64,
    /// Seconds of the pilot.
    pub pilot_seconds: f64,
    /// Everything that was measured, the chosen among it.
    pub alternatives: Vec<Alternative>,
    /// What the facets that were taken change of the figures.
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
    /// Seconds of tracing the whole run so, from those of the pilot.
    pub seconds: f64,
    /// What it gets wrong of the figure that it gets most wrong, as a share of that figure;
    /// absent where it is 0 on the spline, as the width of a perfect focus is.
    pub geometric_share: Option<f64>,
    /// The same in standard errors of the whole run; up to 1 is allowed.
    pub geometric_to_statistical: f64,
    /// That figure, as in `focus: rms_1`.
    pub figure: String,
}

fn by_name<S: serde::Serializer>(n: &NormalMode, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(n.name())
}

/// A run that has to be given tolerance, normals and intersector.
#[derive(Clone, Copy)]
pub struct Undecided<'a> {
    /// Its model.
    pub model: &'a Model,
    /// The scene.
    pub bound: &'a BoundScene,
    /// Its settings: seed and rays decide, of a run that grows not how many; threads and shard do not.
    pub run: &'a RunSettings,
    /// Makes finer facets and the spline.
    pub source: &'a dyn MeshSource,
    /// Facets of the default tolerance.
    pub facets: &'a FacetMesh,
    /// That tolerance, mm.
    pub tolerance: [f64; 2],
}

/// The figure that facets get most wrong.
#[derive(Clone, Debug, Default)]
struct Worst {
    /// Geometric over allowed error.
    ratio: f64,
    share: Option<f64>,
    figure: String,
}

/// Chooses; with the finer facets, where these are taken.
pub fn choose(undecided: &Undecided<'_>) -> (Chosen, Option<MeasuredMesh>) {
    let start = Instant::now();
    let Undecided { bound, facets, tolerance, .. } = *undecided;
    if let Some(chosen) = undecided.without_pilot() {
        return (chosen, None);
    }
    let settings = undecided.pilot_settings();
    // Standard errors are foretold for as many rays as the run has, or will have grown to.
    let scale = undecided.judged_rays() as f64 / settings.rays as f64;
    // Once: both facets and finer facets are compared with the same rays of the spline.
    let spline = trace_replicates(bound, undecided.source.exact(), &settings);
    let error = undecided.measure(facets, &settings, &spline);
    let worst = worst_figure(&error, &settings, scale);
    let mut alternatives = vec![
        alternative(tolerance, "octree", &worst, error.seconds[0] * scale),
        alternative(tolerance, "exact", &Worst::default(), error.seconds[1] * scale),
    ];
    let chosen = |intersector, tolerance_mm, because, alternatives, geometric| Chosen {
        tolerance_mm,
        normals: normals_of(intersector),
        intersector,
        because,
        pilot_rays: settings.rays,
        pilot_seconds: start.elapsed().as_secs_f64(),
        alternatives,
        geometric,
    };
    // Facets go first wherever they are good enough: they are faster.
    if worst.ratio <= 1.0 {
        let because = format!("facets change no figure by more than its statistical error ({})", worst.in_words());
        return (chosen("octree", tolerance, because, alternatives, Some(error)), None);
    }
    // What the spline loses is an error too, and one that more rays do not mend.
    if error.lost[1] > error.lost[0] + LOST {
        let because = "the spline loses more light than facets do".to_owned();
        return (chosen("octree", tolerance, because, alternatives, Some(error)), None);
    }
    if let Some(factor) = undecided.finer(&worst, &error) {
        let finer = tolerance.map(|t| t / factor);
        let meshed = undecided.source.mesh(finer);
        let error = undecided.measure(&meshed.mesh, &settings, &spline);
        let finer_worst = worst_figure(&error, &settings, scale);
        // Between the two that are always there, in the order of accuracy.
        alternatives
            .insert(1, alternative(finer, "octree", &finer_worst, error.seconds[0] * scale + meshed.seconds));
        if finer_worst.ratio <= 1.0 {
            let because = format!("at the default tolerance facets are too coarse ({})", worst.in_words());
            return (chosen("octree", finer, because, alternatives, Some(error)), Some(meshed));
        }
    }
    let because = format!("facets change the answer by more than its statistical error ({})", worst.in_words());
    (chosen("exact", tolerance, because, alternatives, None), None)
}

fn normals_of(intersector: &str) -> NormalMode {
    if intersector == "exact" { NormalMode::Exact } else { NormalMode::Bilinear }
}

/// What was tried, with the worst that facets changed of any figure.
fn alternative(tolerance_mm: [f64; 2], intersector: &'static str, worst: &Worst, seconds: f64) -> Alternative {
    Alternative {
        tolerance_mm,
        normals: normals_of(intersector),
        intersector,
        seconds,
        geometric_share: worst.share,
        geometric_to_statistical: worst.ratio,
        figure: worst.figure.clone(),
    }
}

impl Undecided<'_> {
    /// What can be said without a pilot.
    fn without_pilot(&self) -> Option<Chosen> {
        // What is cheap to ask comes first.
        let (intersector, because) = if self.facets.facets.is_empty() {
            ("octree", "there is no surface to meet")
        } else if self.model.placed_faces().any(|p| p.face.is_none()) {
            ("octree", "the model holds ready meshes, which have no true surface")
        } else if self.is_flat() {
            ("octree", "all faces are flat, so that facets are the surface itself")
        } else if self.judged_rays() <= SHORT_RUN {
            ("exact", "the run is so short that the spline costs less than to find out whether facets do")
        } else if self.bound.emitters.iter().any(|e| e.rays.is_some_and(|n| n > self.judged_rays() / SHARE)) {
            ("exact", "a source has so many rays of its own that a pilot would trace most of the run")
        } else if self.has_huge_map() {
            ("exact", "a map of so many cells takes longer to compare than the spline to trace")
        } else {
            return None;
        };
        let because = because.to_owned();
        Some(Chosen {
            tolerance_mm: self.tolerance,
            normals: normals_of(intersector),
            intersector,
            because,
            pilot_rays: 0,
            pilot_seconds: 0.0,
            alternatives: Vec::new(),
            // On flat faces nothing is changed, and that needs no rays to know.
            geometric: (intersector == "octree").then(|| GeometricError::of_exact_facets(self.bound)),
        })
    }

    /// Whether a receiver has so many cells that a pilot does not keep them apart.
    fn has_huge_map(&self) -> bool {
        self.bound.receivers.iter().any(|r| r.cell_count() > MOST_CELLS)
    }

    /// Whether every face is a polygon in a plane.
    fn is_flat(&self) -> bool {
        self.model.placed_faces().filter_map(|p| p.face).all(is_polygon)
    }

    /// The number of rays whose statistical error facets must stay below.
    fn judged_rays(&self) -> u64 {
        if self.run.grows { GROWN_RAYS } else { self.run.rays }
    }

    /// The run's settings with the pilot's few rays.
    fn pilot_settings(&self) -> RunSettings {
        // No more rays than the run itself has.
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

    /// Compares facets with the spline's run of the same rays.
    fn measure(&self, mesh: &FacetMesh, settings: &RunSettings, spline: &ReplicatedRun) -> GeometricError {
        let octree = self.source.build(mesh, FacetTree::Octree, NormalMode::Bilinear);
        let facets = trace_replicates(self.bound, &*octree, settings);
        compare(self.bound, [&facets, spline])
    }

    /// How much finer facets would have to be, where they would be cheaper than the spline.
    fn finer(&self, worst: &Worst, error: &GeometricError) -> Option<f64> {
        let factor = MARGIN * worst.ratio;
        let hits = error.segments_per_ray * self.judged_rays() as f64;
        // Tracing on finer facets takes about a tenth longer for each halving of the tolerance.
        let saved = hits * (SPLINE_HIT - FACET_HIT * (1.0 + 0.1 * factor.log2()));
        // The number of facets goes with the inverse of the tolerance.
        let spent = factor * self.facets.facets.len() as f64 * FACET;
        (factor <= MOST_FINER && spent < saved).then_some(factor)
    }
}

/// Whether a face is one bilinear patch in a plane within straight lines, which facets follow to rounding.
fn is_polygon(face: &Face) -> bool {
    let surface = &face.surface;
    let [[u0, u1], [v0, v1]] = surface.domain();
    let corners =
        [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)].map(|uv| surface.evaluate(uv));
    // Of a quadrangle in a plane the diagonals span that plane.
    let [a, b, c, d] = corners;
    let normal = (c - a).cross(d - b);
    let size = (c - a).length().max((d - b).length());
    let is_plane = (b - a).dot(normal).abs() <= PLANE * size * normal.length();
    let is_straight = face.loops.iter().flat_map(|l| &l.uses).all(|u| u.uv.degree == 1);
    surface.degree == [1, 1] && surface.points.len() == 4 && is_plane && is_straight
}

/// The figure whose geometric error is largest against the statistical one that a run of `scale` times the rays will have.
fn worst_figure(error: &GeometricError, settings: &RunSettings, scale: f64) -> Worst {
    let order = if settings.sampling == Sampling::Sobol { NET_ORDER } else { RANDOM_ORDER };
    let mut worst = Worst::default();
    for r in &error.receivers {
        let mut weigh = |figure: &str, geometric: f64, allowed: f64, value: f64| {
            // No figure is asked for beyond a millionth of itself.
            let ratio = geometric / allowed.max(NEGLIGIBLE * value.abs()).max(f64::MIN_POSITIVE);
            if ratio > worst.ratio {
                let share = (value != 0.0).then(|| geometric / value.abs());
                worst = Worst { ratio, share, figure: format!("{}: {figure}", r.name) };
            }
        };
        each_figure(r, [scale.powf(-order), scale.powf(-RANDOM_ORDER)], &mut weigh);
    }
    worst
}

/// Hands every figure of a receiver to `weigh`: its name, its geometric error, the statistical one of the whole run, its value.
fn each_figure(r: &ReceiverError, [sums, cells]: [f64; 2], weigh: &mut dyn FnMut(&str, f64, f64, f64)) {
    let s = &r.statistical;
    weigh("power", r.power.geometric(), s.power * sums, r.power.spline);
    for c in &r.channels {
        weigh(&c.name, c.total.geometric(), c.statistical * sums, c.total.spline);
    }
    // Without a unit there are no cells: absorbed power alone is counted.
    if r.unit.is_empty() {
        return;
    }
    let size = r.rms[0].spline.hypot(r.rms[1].spline);
    for (axis, name) in ["1", "2"].into_iter().enumerate() {
        let (rms, centroid) = (&r.rms[axis], &r.centroid[axis]);
        weigh(&format!("rms_{name}"), rms.geometric(), s.rms[axis] * sums, rms.spline);
        // A position has no size of its own: what is negligible goes by that of the light.
        weigh(&format!("centroid_{name}"), centroid.geometric(), s.centroid[axis] * sums, size);
    }
    // One cell of the whole run, whose error falls with its own rays.
    weigh("max", r.peak.geometric(), s.peak * cells, r.peak.spline);
    weigh("cells", r.map.geometric.hypot(r.map.noise), s.map * cells, 1.0);
}

impl Worst {
    /// What facets change at the worst, in words.
    fn in_words(&self) -> String {
        if self.figure.is_empty() {
            return "not at all".into();
        }
        let by = self.share.map_or_else(|| "where it is 0".into(), |s| format!("by {s:.1e} of it"));
        format!("{} {by}, {:.2} of its standard error", self.figure, self.ratio)
    }
}

//! The cross-check, for people: octree against BVH against spline, every cause in words, the disagreeing rays in 3-D.

use super::{AxisStyle, Cell, Chart, Content, Provenance, Report, Section, Table, View};
use crate::formats::{Facets, Polylines};
use crate::math::{Point, Vector};
use crate::study::cross_check::{Cause, CrossCheck, Disagreement};
use crate::text::{count_of, figures, grouped};
use std::collections::BTreeSet;

/// Everything that the report of a check speaks of.
pub struct CheckReport<'a> {
    /// Name of what was checked.
    pub title: String,
    /// What was found.
    pub check: &'a CrossCheck,
    /// The facets in their groups.
    pub facets: &'a Facets<'a>,
    /// Whose normals were measured: `bilinear`, `exact` and so on.
    pub normals: &'a str,
    /// More tables.
    pub tables: Vec<Table>,
    /// More sentences for the answer.
    pub also: Vec<String>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// Most rays drawn of each cause.
const DRAWN: usize = 200;
/// Most rays listed.
const LISTED: usize = 500;

/// A cause with its count, colour and meaning.
struct Kind {
    name: &'static str,
    count: u64,
    colour: [f64; 3],
    meaning: &'static str,
}

/// Lists the causes of differences with their counts, colours and what they mean.
fn kinds(check: &CrossCheck) -> Vec<Kind> {
    let e = &check.facets_vs_exact.explained;
    let kind = |name, count, colour, meaning| Kind { name, count, colour, meaning };
    vec![
        kind(
            "within sag",
            e.within_sag,
            [0.45, 0.50, 0.55],
            "Both hit the same place: along the normal, not along the ray, no farther apart than the facets' proved distance from the spline.",
        ),
        kind(
            "silhouette",
            e.silhouette,
            [0.25, 0.55, 0.95],
            "The ray only grazes: it comes nearer to the surface than the facets' distance from it and leaves again on the same side.",
        ),
        kind(
            "trim edge",
            e.trim_edge,
            [0.95, 0.62, 0.15],
            "The ray passes the border of a face, where facets and trim curve differ by up to the tolerance.",
        ),
        kind(
            "coincident",
            e.coincident,
            [0.10, 0.70, 0.50],
            "Two faces lie closer together than the facets' distance from them, so that either may be met first.",
        ),
        kind("tangent", e.tangent, [0.60, 0.40, 0.95], "The ray touches the spline without crossing it."),
        kind(
            "unproved facet",
            e.unproved,
            [0.85, 0.45, 0.70],
            "The mesher could not prove this facet within the tolerance, and measured again it strays farther.",
        ),
        kind("unmeshed", e.unmeshed, [0.55, 0.35, 0.20], "The face has no facets."),
        kind("no surface", e.no_surface, [0.35, 0.55, 0.60], "The face is a ready-made mesh: there is no spline."),
        kind(
            "unexplained",
            check.facets_vs_exact.unexplained,
            [0.95, 0.10, 0.10],
            "None of these: a defect of the mesher or of an intersector.",
        ),
        kind(
            "octree and BVH differ",
            check.octree_vs_bvh.disagree,
            [1.0, 0.0, 0.75],
            "The same facets, two answers: a defect of one of the two.",
        ),
    ]
}

/// Returns the kind that a ray belongs to, as named in [`kinds`].
fn kind_of(d: &Disagreement) -> &'static str {
    match d.cause {
        // A difference between two trees over the same facets is graver than any between facets and spline.
        _ if d.facets_differ => "octree and BVH differ",
        Some(cause) => cause.name(),
        None => "within sag",
    }
}

/// Writes in a sentence whether octree and BVH agree, and how many differences from the spline are unexplained.
pub fn verdict(check: &CrossCheck) -> String {
    if check.scene.facets == 0 {
        return "Nothing was checked: there are no facets.".into();
    }
    format!("Of {} ray segments checked, {}.", grouped(check.rays), findings(check))
}

/// Writes the verdict on segments of a run; one that was traced `on_spline` used no facets.
pub(super) fn run_verdict(check: &CrossCheck, on_spline: bool) -> String {
    if on_spline && check.scene.facets > 0 {
        return format!(
            "{} ray segments were traced again on facets, which the run did not use: {}.",
            grouped(check.rays),
            findings(check)
        );
    }
    verdict(check)
}

/// Writes whether octree and BVH agree, and how many differences from the spline are unexplained.
fn findings(check: &CrossCheck) -> String {
    let f = &check.facets_vs_exact;
    let between = match check.octree_vs_bvh.disagree {
        0 => "octree and BVH agree on every one".to_owned(),
        n => format!("octree and BVH **disagree on {}**", grouped(n)),
    };
    let beyond = f.explained.unproved + f.explained.unmeshed + f.explained.no_surface;
    let beside = match f.unexplained {
        0 if beyond == 0 => {
            "every difference from the exact spline is explained by the facets' small distance from it".to_owned()
        }
        0 => format!(
            "every difference from the exact spline is explained: but for {} at facets without a proof, or faces without facets or \
             surface, by the facets' small distance from it",
            grouped(beyond)
        ),
        _ => format!("**{}**", unexplained(check)),
    };
    format!("{between}, and {beside}")
}

/// Writes how many differences from the spline are unexplained, at least one, and what is wrong with those that were kept.
pub fn unexplained(check: &CrossCheck) -> String {
    let defect_of = |d: &Disagreement| match d.cause {
        Some(Cause::Unexplained(defect)) => Some(defect.name()),
        _ => None,
    };
    let defects: BTreeSet<&str> = check.disagreements.iter().filter_map(defect_of).collect();
    let defects: Vec<&str> = defects.into_iter().collect();
    let what = if defects.is_empty() { String::new() } else { format!(" ({})", defects.join(", ")) };
    match check.facets_vs_exact.unexplained {
        1 => format!("1 difference from the exact spline is unexplained{what}"),
        n => format!("{} differences from the exact spline are unexplained{what}", grouped(n)),
    }
}

/// Makes a table of all counts of ray segments: checked, hit, answered differently, explained by which cause, proved.
pub(super) fn count_table(check: &CrossCheck) -> Table {
    let (f, e) = (&check.facets_vs_exact, &check.facets_vs_exact.explained);
    let mut table =
        Table::new("cross-check", "The same ray segments, three intersectors", &[("", ""), ("ray segments", "")]);
    for (name, count) in [
        ("asked", check.rays),
        ("hit the facets", check.hits),
        ("octree and BVH disagree", check.octree_vs_bvh.disagree),
        ("facets hit, spline misses, or the reverse", f.hit_miss),
        ("facets and spline name another face", f.other_face),
        ("explained: within the facets' sag", e.within_sag),
        ("explained: silhouette", e.silhouette),
        ("explained: trim edge", e.trim_edge),
        ("explained: coincident faces", e.coincident),
        ("explained: tangent", e.tangent),
        ("explained: a facet whose distance was not proved", e.unproved),
        ("explained: a face that has no facets or no surface", e.unmeshed + e.no_surface),
        ("unexplained", f.unexplained),
        ("spline hits proved to be the first", check.exact.certified),
        ("spline hits not proved", check.exact.uncertified),
    ] {
        table.row([name.into(), Cell::from(count)]);
    }
    table
}

/// What rounding leaves of no distance or angle at coordinates of some metres, mm and degrees.
const ROUNDING: f64 = 1e-10;

/// Makes a table of how far hits and normals of `subject` are off, where both hit the same face within the sag.
pub(super) fn error_table(check: &CrossCheck, subject: &str) -> Table {
    let f = &check.facets_vs_exact;
    let columns = [("", ""), ("median", ""), ("99 %", ""), ("largest", ""), ("unit", "")];
    let title = format!("How far the {subject} are from the spline, where both hit the same face within the sag");
    let mut table = Table::new("facet-errors", &title, &columns).caption(
        "Along a ray that grazes the two hits may be far apart, and their normals turned: within the sag they are along the normal.",
    );
    for (name, s, unit) in [("distance along the ray", &f.t_error_mm, "mm"), ("normal", &f.normal_error_deg, "°")]
    {
        let [median, most, largest] = [s.p50, s.p99, s.max].map(|x| Cell::Known(x, ROUNDING, 4));
        table.row([name.into(), median, most, largest, unit.into()]);
    }
    table
}

/// Draws facets and rays that facets and spline answer differently, at most [`DRAWN`] of each cause; `None` where there are none, or no
/// facets.
pub(super) fn odd_rays(check: &CrossCheck, facets: &Facets) -> Option<View> {
    let diagonal = facets.mesh.bounds().diagonal();
    if check.disagreements.is_empty() || facets.mesh.facets.is_empty() {
        return None;
    }
    let mut view = View::of_facets("disagreeing", "Rays that are answered differently", facets).faded(0.35);
    let mut shown = 0;
    for kind in kinds(check) {
        let own: Vec<&Disagreement> = check.disagreements.iter().filter(|d| kind_of(d) == kind.name).collect();
        let (mut lines, mut places) = (Polylines::default(), Vec::new());
        // Evenly over all, for rays come source by source.
        for d in own.iter().step_by(own.len().div_ceil(DRAWN).max(1)) {
            let hits = || [d.octree, d.bvh, d.exact].into_iter().flatten().map(|h| h.t);
            let (first, last) = hits().fold((f64::INFINITY, 0f64), |(a, b), t| (a.min(t), b.max(t)));
            if !first.is_finite() {
                continue;
            }
            // The stretch around the place: whole rays from far outside would bury the model.
            let range = [(first - 0.15 * diagonal).max(0.0), last + 0.04 * diagonal];
            lines.push(range.map(|t| d.ray.point_at(t)));
            places.push(d.ray.point_at(first));
            shown += 1;
        }
        let name = format!("{} ({})", kind.name, grouped(kind.count));
        view = view.lines(&name, &lines, kind.colour).points(
            &format!("{}, first hit", kind.name),
            &places,
            kind.colour,
        );
    }
    Some(view.caption(&format!(
        "{}, at most {DRAWN} of each cause, each from shortly before its first hit to behind its last; a dot is the first hit. \
         Click a name in the legend to hide or show it.",
        count_of(shown, "ray")
    )))
}

impl CheckReport<'_> {
    /// Writes the answer in a paragraph: the verdict, how many rays differ, the p99 errors of hits (mm) and normals (degrees), and `also`.
    pub fn answer(&self) -> String {
        let (c, f) = (self.check, &self.check.facets_vs_exact);
        let differ = f.hit_miss + f.other_face;
        let mut text = verdict(c);
        text += &match differ {
            0 => " Facets and spline name the same face for every ray.".to_owned(),
            n => format!(
                " Facets and spline name different faces, or only one of them is hit, for **{}** ({} %).",
                count_of(n, "ray"),
                figures(100.0 * n as f64 / c.rays.max(1) as f64, 2)
            ),
        };
        text += &format!(
            " Where both hit the same face within the sag, 99 % of the hits are within **{} mm** along the ray and 99 % of the {} normals within \
             **{}°** of the spline's.",
            figures(f.t_error_mm.p99, 2),
            self.normals,
            figures(f.normal_error_deg.p99, 2)
        );
        for sentence in &self.also {
            text += &format!(" {sentence}");
        }
        text
    }

    /// Makes the whole report.
    pub fn report(&self) -> Report {
        let sections = vec![self.rays(), self.distance(), self.speed()];
        let title = format!("Check of {}", self.title);
        Report { title, answer: self.answer(), sections, provenance: self.provenance.clone() }
    }

    /// Makes the section on rays answered differently.
    fn rays(&self) -> Section {
        let mut table = Table::new(
            "causes",
            "Why facets and spline differ",
            &[("cause", ""), ("rays", ""), ("of all", "%"), ("meaning", "")],
        );
        for kind in kinds(self.check) {
            let share = 100.0 * kind.count as f64 / self.check.rays.max(1) as f64;
            table.row([kind.name.into(), kind.count.into(), Cell::Number(share, 2), kind.meaning.into()]);
        }
        let section = Section::new("Rays answered differently");
        let section = match odd_rays(self.check, self.facets) {
            Some(view) => section.with_block(view),
            None => {
                section.with_block("Facets and spline answered every ray alike, up to the facets' proved distance.")
            }
        };
        let section = section.with_block(table);
        if self.check.disagreements.is_empty() { section } else { section.with_block(self.list()) }
    }

    /// Makes a table of the rays themselves, at most [`LISTED`], evenly over all.
    fn list(&self) -> Table {
        let all = &self.check.disagreements;
        let mut columns = vec![("ray", ""), ("cause", ""), ("facets: face", ""), ("facets: t", "mm")];
        columns.extend([("spline: face", ""), ("spline: t", "mm")]);
        columns.extend(["origin x", "origin y", "origin z"].map(|c| (c, "mm")));
        columns.extend(["direction x", "direction y", "direction z"].map(|c| (c, "")));
        let listed = if all.len() > LISTED {
            format!("{LISTED} of {} rays, evenly over all", grouped(all.len() as u64))
        } else {
            "All of these rays".to_owned()
        };
        let caption = format!(
            "{listed}; t is the distance from the ray's origin. --disagreements FILE writes all of them, --replay FILE asks them again."
        );
        let mut table = Table::new("odd-rays", "The rays themselves", &columns).caption(caption);
        for d in all.iter().step_by(all.len().div_ceil(LISTED).max(1)) {
            let place = |p: Vector| p.to_array().map(|x| Cell::Number(x, 6));
            let face = |h: Option<crate::intersect::Hit>| {
                h.map_or(Cell::Text("missed".into()), |h| u64::from(h.face.0).into())
            };
            let far = |h: Option<crate::intersect::Hit>| h.map_or(Cell::Empty, |h| Cell::Number(h.t, 6));
            let mut row: Vec<Cell> = vec![d.index.into(), kind_of(d).into()];
            row.extend([face(d.octree), far(d.octree), face(d.exact), far(d.exact)]);
            let origin: Point = d.ray.origin;
            row.extend(place(origin).into_iter().chain(place(d.ray.direction)));
            table.row(row);
        }
        table
    }

    /// Makes the section on errors of facets and of the normals on them.
    fn distance(&self) -> Section {
        let subject = if self.normals == "exact" { "facets' hits, moved to the spline," } else { "facets" };
        let section = Section::new("Facets against the spline")
            .with_block(error_table(self.check, subject))
            .with_block(count_table(self.check));
        self.tables.iter().cloned().fold(section, |s, t| s.with_block(t))
    }

    /// Makes the section on rates, building times and memory.
    fn speed(&self) -> Section {
        let c = self.check;
        let (m, b, s) = (&c.mrays_per_s, &c.build_seconds, &c.bytes_per_facet);
        let columns =
            [("", ""), ("rate, one thread", "million rays/s"), ("build", "s"), ("memory", "bytes per facet")];
        let mut table = Table::new("rates", "How fast each answers", &columns)
            .caption("Median of alternating rounds on the rays of this check.");
        let mut bars: Vec<(&str, f64)> = Vec::new();
        for (((name, rate), (_, build)), (_, size)) in m.named().into_iter().zip(b.named()).zip(s.named()) {
            let cell = |x: Option<f64>, digits| x.map_or(Cell::Empty, |x| Cell::Number(x, digits));
            table.row([name.into(), cell(rate, 3), cell(build, 2), cell(size, 3)]);
            bars.extend(rate.map(|r| (name, r)));
        }
        let content = Content::Bars {
            categories: bars.iter().map(|b| b.0.to_owned()).collect(),
            layers: vec![("rate".into(), bars.iter().map(|b| Some(b.1)).collect())],
            stacked: true,
        };
        let axes = [AxisStyle::linear("", ""), AxisStyle::linear("rate", "million rays/s")];
        let caption = "One thread; longer is better.";
        let chart = Chart { content, ..Chart::series("rates", "Rates", caption, axes, Vec::new()) };
        Section::new("Speed").with_block(chart).with_block(table)
    }
}

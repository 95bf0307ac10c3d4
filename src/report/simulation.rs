//! The report of a traced scene: where the light went, how it looks, what was checked, what was left out and why.

use super::cross_check::{self, run_verdict};
use super::even_poles::{brightest_direction, with_joined_slivers};
use super::geometric_cause::GeometricCause;
use super::lamp_figures::Counted;
use super::maps::{cuts, grids, receiver_grid};
use super::number::counted;
use super::verdicts::{self, verdict_sentence};
use super::{Block, Cell, Provenance, Report, Section, Table, View};
use super::{error_tables, errors, receiver_blocks, seconds};
use crate::formats::{Facets, Polylines};
use crate::regulation::Assessment;
use crate::simulate::{Event, PathVertex, Results};
use crate::study::figures::ReceiverFigures;
use crate::study::model_figures::PowerFigures;
use crate::study::{cross_check::CrossCheck, default_accuracy::TracingChoice, geometric_error::GeometricError};
use crate::text::{count_of, figures, grouped};

/// Share of the power from which on light that limits cut off is spoken of: below it no figure of four digits changes.
const WORTH_A_SENTENCE: f64 = 1e-4;

/// Share of the power from which on lost light leads the answer, and from which on it is all of it.
const MOSTLY_LOST: f64 = 0.5;
const ALL: f64 = 0.9995;

/// Paths drawn that leave the model, and those that end inside, which would hide the others.
const DRAWN_LEAVING: usize = 250;
const DRAWN_ENDING: usize = 60;
/// Statistical error of the brightest cell, as a share of it, beyond which no direction is called the brightest.
const MOST_UNCERTAIN_PEAK: f64 = 0.3;

/// Everything that the report of a traced scene speaks of.
pub struct SimulationReport<'a> {
    /// Title of the scene.
    pub title: String,
    /// What the simulation found.
    pub results: &'a Results,
    /// The traced facets in their groups.
    pub facets: &'a Facets<'a>,
    /// Facets that were traced: more than those drawn where parts are placed often.
    pub facet_count: usize,
    /// Whether the run was traced on the true surfaces, and not on these facets.
    pub on_spline: bool,
    /// What the view of the facets shows.
    pub drawn: String,
    /// Unit of powers: `W` or `lm`.
    pub unit: &'static str,
    /// The cross-check: the same rays on octree, BVH and spline.
    pub check: Option<&'a CrossCheck>,
    /// Every receiver's figures with both their errors.
    pub figures: &'a [ReceiverFigures],
    /// Some of the rays on facets and on the spline, where the run was on facets.
    pub geometric: Option<&'a GeometricError>,
    /// Where the power went, with both errors.
    pub power: &'a PowerFigures,
    /// Why the run was traced as it was, where it was not asked for.
    pub chosen: Option<&'a TracingChoice>,
    /// What regulations say of receivers, by their index.
    pub verdicts: &'a [(usize, Assessment)],
    /// More sections, after that of the light.
    pub sections: Vec<Section>,
    /// More 3-D views: of the facets, of the octree.
    pub views: Vec<View>,
    /// More tables: of the model, of the facets.
    pub tables: Vec<Table>,
    /// Sentences that compare with figures from elsewhere.
    pub comparison: Vec<String>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// Makes recorded paths polylines with the power at their start, as a share of an average ray's, and the number of their ray; the second
/// value is how each of them ends.
pub fn path_lines(paths: &[PathVertex]) -> (Polylines, Vec<Event>) {
    let mut lines = Polylines::default();
    let (mut power, mut rays, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    // A ray that was split has branches, and each is a line.
    for path in paths.chunk_by(|a, b| (a.ray, a.branch) == (b.ray, b.branch)) {
        lines.push(path.iter().map(|v| v.point));
        power.push(path[0].power);
        rays.push(path[0].ray as f64);
        ends.push(path[path.len() - 1].event);
    }
    lines.values = vec![("power_share".into(), power), ("ray".into(), rays)];
    (lines, ends)
}

/// Keeps at most `most` of the lines whose end is `wanted`, evenly over the run, for rays come source by source; their values are left out.
fn lines_ending(lines: &Polylines, ends: &[Event], wanted: impl Fn(Event) -> bool, most: usize) -> Polylines {
    let mut kept = Polylines::default();
    let all: Vec<_> = lines.lines().zip(ends).filter(|(_, e)| wanted(**e)).collect();
    for (line, _) in all.iter().step_by(all.len().div_ceil(most).max(1)) {
        kept.push(line.iter().copied());
    }
    kept
}

impl SimulationReport<'_> {
    /// Returns the report with these 3-D views in place of any it had.
    pub fn with_views(self, views: Vec<View>) -> Self {
        Self { views, ..self }
    }

    /// Whether so much light was lost that the figures say nothing of the lamp.
    fn is_mostly_lost(&self) -> bool {
        self.results.power.lost > MOSTLY_LOST * self.results.power.emitted
    }

    /// Returns a sentence in Markdown, a space behind it, that most light was lost; empty where it was not.
    fn lost_sentence(&self) -> String {
        let r = self.results;
        if !self.is_mostly_lost() {
            return String::new();
        }
        let share = if r.power.lost >= ALL * r.power.emitted {
            "All light".to_owned()
        } else {
            format!("{} of the light", self.share(r.power.lost))
        };
        format!(
            "**{share} was lost** ({}): what follows says nothing of the lamp; the notes say where that happened and why. ",
            count_of(r.lost_rays, "path")
        )
    }

    /// Writes a power as per cent of what was emitted.
    fn share(&self, power: f64) -> String {
        format!("{} %", figures(100.0 * power / self.results.power.emitted, 4))
    }

    /// Writes the answer in a paragraph: power on each receiver with errors, speed, losses, verdicts, what limits it.
    pub fn answer(&self) -> String {
        let r = self.results;
        let cause = GeometricCause::new(r, self.geometric);
        let mut text =
            self.lost_sentence() + &format!("Of **{} {}** emitted, ", figures(r.power.emitted, 4), self.unit);
        // Parted by semicolons: what passes a receiver is counted by the next one too, so that shares need not add up.
        let parts: Vec<String> = (r.receivers.iter().zip(self.figures))
            .map(|(x, f)| {
                let power = errors::with_errors(&f.power, 4, cause, Some(r.power.emitted));
                let channels = errors::channel_totals(f, cause);
                format!("**{power}** ({}) reach {}{channels}", self.share(x.power), x.name)
            })
            .collect();
        text += &if parts.is_empty() {
            "none is counted: **the scene has no receiver**; add a [[receiver]]".into()
        } else {
            parts.join("; ")
        };
        text += ". ";
        let directions = r.receivers.iter().zip(self.figures).filter(|(x, _)| x.kind == "far_field");
        let brightest: Vec<_> =
            directions.filter_map(|(x, f)| Some((receiver_grid(x)?, x.pole_rings(), f.max.as_ref()?))).collect();
        let several = brightest.len() > 1;
        // The largest of many cells that few rays met says nothing of the lamp.
        for (grid, rings, max) in
            brightest.into_iter().filter(|(_, _, max)| max.statistical < MOST_UNCERTAIN_PEAK * max.value)
        {
            if let Some((direction, _)) = brightest_direction(&with_joined_slivers(&grid, &rings), &rings) {
                let of = if several { format!(" of {}", grid.name) } else { String::new() };
                let value = errors::with_errors(max, 3, cause, None);
                text += &format!("The brightest direction{of} is {direction} with **{value}**. ");
            }
        }
        text += &format!(
            "**{} rays** of {} each took **{}** {}; {} lost. ",
            grouped(r.rays),
            counted(r.segments as f64 / r.rays.max(1) as f64, "segment"),
            seconds(r.seconds.trace),
            match &r.seconds.merged {
                // Parts that ran side by side took less, and one after the other no less.
                Some(merged) => format!("in all, in {}", counted(f64::from(merged.parts), "part")),
                None => {
                    let threads = counted(r.threads as f64, "thread");
                    format!("on {threads}, {} million rays/s", figures(r.mrays_per_s, 3))
                }
            },
            match r.lost_rays {
                0 => "none was".into(),
                1 => "one was".into(),
                n => format!("{} were", grouped(n)),
            }
        );
        text += &self.verdicts.iter().map(|(_, a)| verdict_sentence(a)).collect::<String>();
        text += &self.cut_off_sentence();
        text.extend(
            self.geometric.map(|g| errors::facet_limits(g, self.results, self.figures, &self.power.by_body)),
        );
        // How well nothing is known is no news.
        if self.is_mostly_lost() {
            return text;
        }
        text.extend(self.chosen.map(errors::choice_sentence));
        if let Some(check) = self.check.filter(|check| check.scene.facets > 0) {
            text += &run_verdict(check, self.on_spline);
        }
        text
    }

    /// Returns a sentence in Markdown, a space behind it, on the power that limits of [run] took; empty below [`WORTH_A_SENTENCE`].
    fn cut_off_sentence(&self) -> String {
        let r = self.results;
        let share = r.power.cut_off / r.power.emitted;
        if share < WORTH_A_SENTENCE {
            return String::new();
        }
        let why = match (r.caught_rays, r.cut_off_rays - r.caught_rays) {
            (0, _) => "at a limit of [run]: max_bounces, max_length_mm or power_floor".into(),
            (caught, 0) => format!(
                "because {} went round in a clear body by total reflection without end ([run] caught_after); a medium that \
                 absorbs, as all real ones do, says where this light ends",
                count_of(caught, "path")
            ),
            (caught, others) => format!(
                "{} that went round in a clear body by total reflection without end ([run] caught_after), {} at \
                 another limit: max_bounces, max_length_mm or power_floor",
                count_of(caught, "path"),
                grouped(others)
            ),
        };
        format!(
            "**{}** ({}) were cut off, {why}. ",
            errors::with_errors(&self.power.cut_off, 4, GeometricCause::new(r, self.geometric), None),
            self.share(r.power.cut_off)
        )
    }

    /// Makes the whole report.
    pub fn report(&self) -> Report {
        let mut sections = vec![self.light()];
        sections.extend(self.sections.iter().cloned());
        let grid_of = |receiver: usize| self.results.receivers.get(receiver).and_then(receiver_grid);
        sections.extend(verdicts::sections(self.verdicts, grid_of));
        sections.push(self.energy());
        if let Some(check) = self.check {
            sections.push(self.cross_check(check));
        }
        sections.extend([self.effects(), self.cost()]);
        let (title, provenance) = (self.title.clone(), self.provenance.clone());
        // Receivers have names of the user's choice, which may be those of the report's own blocks.
        Report { title, answer: self.answer(), sections, provenance }.with_distinct_names()
    }

    /// Makes the section on light: notes, the map of each receiver, and facets with ray paths.
    fn light(&self) -> Section {
        let notes = self.results.notes.iter().map(|note| format!("**Note:** {note}."));
        let mut section = notes.fold(Section::new("Light"), |s, note| s.with_block(note.as_str()));
        let mut maps = grids(self.results, self.geometric);
        // Directions first: what a lamp is judged by.
        maps.sort_by_key(|(k, _)| self.results.receivers[*k].kind != "far_field");
        let (lines, ends) = path_lines(&self.results.paths);
        let lines = lines.near(&self.facets.mesh.bounds());
        let out = lines_ending(&lines, &ends, |e| matches!(e, Event::Received | Event::Escaped), DRAWN_LEAVING);
        let stay = lines_ending(&lines, &ends, |e| !matches!(e, Event::Received | Event::Escaped), DRAWN_ENDING);
        let mut view = Some(
            View::of_facets("facets", "Facets and ray paths", self.facets)
                .lines("rays that leave", &out, [1.0, 0.72, 0.12])
                .lines("rays that end inside", &stay, [0.85, 0.30, 0.30])
                .caption(&self.drawn),
        );
        for (k, grid) in maps {
            let grid = with_joined_slivers(&grid, &self.results.receivers[k].pole_rings());
            let shown = Counted { receiver: &self.results.receivers[k], figures: &self.figures[k], grid: &grid };
            section = section.with_block(receiver_blocks::framed_map(&shown));
            // The map that matters most stands beside the facets and has its cuts drawn.
            if let Some(view) = view.take() {
                section = section.with_block(view);
                if let Some(cuts) = cuts(&grid) {
                    section = section.with_block(cuts);
                }
            }
            let judged = self.verdicts.iter().find(|(receiver, _)| *receiver == k).map(|(_, a)| a);
            section.blocks.extend(receiver_blocks::trade_figures(&shown, self.results, judged));
        }
        if let Some(view) = view {
            section = section.with_block(view);
        }
        for sentence in &self.comparison {
            section = section.with_block(sentence.as_str());
        }
        section
    }

    /// Makes the section on where the power went: emitted to lost, each receiver, and all figures with both errors.
    fn energy(&self) -> Section {
        let cause = GeometricCause::new(self.results, self.geometric);
        let power = error_tables::power_table(self.results, self.power, self.unit, cause);
        let receivers = error_tables::receiver_table(self.results, self.figures, self.unit);
        let section = Section::new("Energy").with_block(power).with_block(receivers);
        let section = section.with_block(error_tables::figure_table(self.results, self.figures, cause));
        let halving = errors::halving_cost(self.results, self.geometric, self.figures, self.power);
        let section =
            if self.is_mostly_lost() || halving.is_empty() { section } else { section.with_block(halving) };
        let measured = self.geometric.filter(|g| g.rays > 0);
        let measured = measured.map(|g| error_tables::change_table(g, self.results, self.unit)).into_iter();
        let tried = self.chosen.filter(|c| !c.alternatives.is_empty());
        let tried = tried.map(|c| error_tables::alternative_table(c, self.results));
        let section = measured.chain(tried).fold(section, |s, table| s.with_block(table));
        if self.results.receivers.iter().any(|r| !r.channels.is_empty()) {
            section.with_block(error_tables::channel_table(self.results, self.figures, self.unit, cause))
        } else {
            section
        }
    }

    /// Makes the section on rays of this run that all intersectors traced.
    fn cross_check(&self, check: &CrossCheck) -> Section {
        let text = "A sample of the very ray segments of this run, traced again by the octree, by obvhs' BVH over the same facets and by \
            the certified spline intersector. A ray that left a surface starts a few times the tolerance above it, so that all three \
            get the same query.";
        let section = Section::new("Cross-check")
            .with_block(text)
            .with_block(cross_check::count_table(check))
            .with_block(cross_check::error_table(check, "facets"));
        match cross_check::odd_rays(check, self.facets) {
            Some(view) => section.with_block(view),
            None => section,
        }
    }

    /// Makes the section on which effects were simulated, which not, and why.
    fn effects(&self) -> Section {
        let used = &self.results.effects;
        let mut table = Table::new("effects", "Effects", &[("effect", ""), ("simulated", ""), ("because", "")])
            .caption(format!(
                "The kernel '{}' is the leanest that can simulate these effects; leaving the others out changes no bit of the result.",
                used.kernel
            ));
        for (list, word) in [(&used.simulated, "yes"), (&used.not_simulated, "no")] {
            for b in list {
                let effect = b.effect.name().replace('_', " ");
                table.row([effect.into(), word.into(), b.because.as_str().into()]);
            }
        }
        Section::new("What was simulated, what not, and why").with_block(table)
    }

    /// Makes the section on the model, its facets and the seconds of each stage.
    fn cost(&self) -> Section {
        let s = &self.results.seconds;
        let mut table = Table::new("times", "Times", &[("step", ""), ("time", "s"), ("what", "")]);
        for (name, time, what) in [
            ("read", s.read, "STEP files to trimmed splines".to_owned()),
            ("tessellate", s.tessellate, format!("{} facets", grouped(self.facet_count as u64))),
            ("build", s.build, "the intersector".to_owned()),
            (
                "trace",
                s.trace,
                format!(
                    "{} million rays/s, {} million segments/s, {} segments a ray",
                    figures(self.results.mrays_per_s, 3),
                    figures(self.results.msegments_per_s, 3),
                    figures(self.results.segments as f64 / self.results.rays as f64, 4)
                ),
            ),
            ("check", s.check, "some of its rays traced again by BVH and spline".to_owned()),
        ] {
            table.row([name.into(), Cell::Number(time, 3), what.into()]);
        }
        let section = Section::new("Model, facets and times");
        let section = self.views.iter().cloned().fold(section, |s, v| s.with_block(v)).with_block(table);
        self.tables.iter().cloned().fold(section, |s, t| s.with_block(Block::Table(t)))
    }
}

//! What one receiver counted, in the units of the scene.

use super::pole_rings::{PoleRings, is_whole_turn};
use super::power_scale::PowerScale;
use super::receiver::{NAMED_RECEIVERS, Receiver, Shape};
use super::scene::{FarFieldType, PowerUnit};
use super::tallies::Tallies;
use super::tally::{Moments, Sum};
use crate::math::units::SQUARE_METRE;
use crate::text::{count_of, first_sentences};
use serde::Serialize;
use std::borrow::Cow;

/// What one receiver counted.
#[derive(Clone, Debug, Serialize)]
pub struct ReceiverResult {
    /// Its name.
    pub name: String,
    /// `plane`, `disc`, `far_field`, `sphere` or `absorbed`.
    pub kind: &'static str,
    /// Power that it counted.
    pub power: f64,
    /// Standard error of `power`.
    pub power_error: f64,
    /// Cells along both sides.
    pub grid: [usize; 2],
    /// Largest cell, in `unit`; of angles with each ring of cells at a pole at its mean, see [`Self::cells_with_even_poles`].
    pub max: f64,
    /// Smallest cell, in `unit`.
    pub min: f64,
    /// Unit of the cells: `W/m2` or `W/sr` for sources in watts, `lx` or `cd` for sources in lumens.
    pub unit: &'static str,
    /// Mean position of the light: mm on a plane or disc, degrees in angles; like `rms` without a meaning along an axis that
    /// [`Self::has_place`] denies.
    pub centroid: [f64; 2],
    /// Its standard error.
    pub centroid_error: [f64; 2],
    /// Root mean square about the receiver's centre, in the same units.
    pub rms: [f64; 2],
    /// Its standard error.
    pub rms_error: [f64; 2],
    /// Largest distance from the centre, in the same units.
    pub farthest: f64,
    /// Files written for it; filled in by the writer.
    pub files: Vec<String>,
    /// Half sides: mm of a plane, degrees of angles; of a disc its radius, twice.
    pub half: [f64; 2],
    /// Middle of the ranges of angles, degrees; 0 for planes.
    pub middle: [f64; 2],
    /// Type of the angles of a far field.
    pub angles: Option<FarFieldType>,
    /// Power, lumens or CIE values of each further channel.
    pub channels: Vec<ChannelResult>,
    /// Cells row by row, the first coordinate running fastest, in `unit`; 0 for those off a disc.
    #[serde(skip)]
    pub cells: Vec<f64>,
    /// Standard error of each cell, in `unit`.
    #[serde(skip)]
    pub errors: Vec<f64>,
    /// Standard errors of `centroid` and of `rms` as the spread of the replicates alone has them, which few rays leave too small.
    #[serde(skip)]
    pub spread_errors: [[f64; 2]; 2],
    /// What one ray, as it leaves the source whose rays weigh most, adds to `power`.
    #[serde(skip)]
    pub ray_power: f64,
    /// The same in each cell, in `unit`.
    #[serde(skip)]
    pub ray_cells: Vec<f64>,
    /// The cells that lie off a disc, rising; other receivers have none.
    #[serde(skip)]
    pub off: Vec<usize>,
}

/// A further channel of a receiver.
#[derive(Clone, Debug, Serialize)]
pub struct ChannelResult {
    /// `lm`, `X`, `Y`, `Z`, or the wavelengths of a bin.
    pub name: String,
    /// Unit of its cells: `lx` or `cd` of lumens and CIE values, the receiver's own of a bin.
    pub unit: &'static str,
    /// Sum over the receiver: lumens, CIE values with Y in lumens, or watts of a bin.
    pub total: f64,
    /// Its standard error.
    pub error: f64,
    /// Cells as those of the receiver, per m² or sr.
    #[serde(skip)]
    pub cells: Vec<f64>,
    /// Standard error of each cell.
    #[serde(skip)]
    pub errors: Vec<f64>,
}

impl ChannelResult {
    /// Unit of the total: that of powers, `W` or `lm`, for a bin, lumens for those and Y, none (empty) for X and Z, of which the CIE has
    /// none.
    pub fn total_unit<'u>(&self, power: &'u str) -> &'u str {
        match self.name.as_str() {
            "X" | "Z" => "",
            "lm" | "Y" => "lm",
            _ => power,
        }
    }

    /// The figures of channel `c` from the sums of its total and its cells; `scale` and `per` make power and density of a power, the
    /// latter by the cell.
    fn new(
        r: &Receiver,
        (c, total, sums): (usize, &Sum, &[Sum]),
        (scale, per): (&PowerScale, &[f64]),
        unit: &'static str,
    ) -> Self {
        let worth = r.channels.worth();
        Self {
            name: r.channels.name(c),
            unit,
            total: scale.power(total) * worth,
            error: scale.error(total) * worth,
            cells: sums.iter().enumerate().map(|(k, s)| scale.power(s) * per[k] * worth).collect(),
            errors: sums.iter().enumerate().map(|(k, s)| scale.error(s) * per[k] * worth).collect(),
        }
    }
}

/// The units and extents in which the figures of a receiver are stated, by its shape.
struct ShapeUnits {
    /// As [`ReceiverResult::kind`].
    kind: &'static str,
    /// Unit of the cells.
    unit: &'static str,
    /// Factor from power over the measure of a cell to `unit`.
    scale: f64,
    /// As [`ReceiverResult::half`].
    half: [f64; 2],
    /// As [`ReceiverResult::middle`].
    middle: [f64; 2],
    /// Type of the angles of a far field.
    angles: Option<FarFieldType>,
}

impl ShapeUnits {
    /// Returns those of a shape, for sources in this unit of power. `half` and `middle` are in mm for a plane and a disc, in degrees for a
    /// sphere and a far field; absorbed power has half sides of 1.
    fn new(shape: &Shape, unit: PowerUnit) -> Self {
        let is_lumen = unit == PowerUnit::Lumen;
        let per_area = if is_lumen { "lx" } else { "W/m2" };
        let on_area =
            |kind, half| Self { kind, unit: per_area, scale: SQUARE_METRE, half, middle: [0.0; 2], angles: None };
        match shape {
            Shape::Plane { half, .. } => on_area("plane", *half),
            Shape::Disc { radius, .. } => on_area("disc", [*radius; 2]),
            Shape::Sphere { .. } => on_area("sphere", [180.0, 90.0]),
            Shape::FarField { angles, low, high, .. } => Self {
                kind: "far_field",
                unit: if is_lumen { "cd" } else { "W/sr" },
                scale: 1.0,
                half: [0, 1].map(|a| 0.5 * (high[a] - low[a]).to_degrees()),
                middle: [0, 1].map(|a| 0.5 * (high[a] + low[a]).to_degrees()),
                angles: Some(*angles),
            },
            Shape::Absorbed { .. } => {
                let unit = if is_lumen { "lm" } else { "W" };
                Self { kind: "absorbed", unit, scale: 1.0, half: [1.0; 2], middle: [0.0; 2], angles: None }
            }
        }
    }
}

impl ReceiverResult {
    /// The figures of receiver `i`: sums of quanta turned into densities and their errors by `power_scale`; `ray` is the most quanta of a
    /// ray.
    pub(super) fn new(
        r: &Receiver,
        i: usize,
        tallies: &Tallies,
        (power_scale, ray): (&PowerScale, f64),
        unit: PowerUnit,
    ) -> Self {
        let grid = r.cells.map(|n| n as usize);
        let ShapeUnits { kind, unit, scale, half, middle, angles } = ShapeUnits::new(&r.shape, unit);
        // Power of a cell to its mean density: per area, or per solid angle for a far field.
        let measures: Vec<f64> = (0..r.cell_count()).map(|k| r.measure(k % grid[0], k / grid[0])).collect();
        let off: Vec<usize> = (0..measures.len()).filter(|&k| measures[k] == 0.0).collect();
        // No light is counted off a disc: nothing over nothing stays nothing.
        let density = |&measure: &f64| if measure > 0.0 { scale / measure } else { 0.0 };
        let per: Vec<f64> = measures.iter().map(density).collect();
        let (sums, further) = tallies.cells[i].split_at(r.cell_count());
        let photometric = if scale == 1.0 { "cd" } else { "lx" };
        let channel_unit = if r.channels.worth() == 1.0 { unit } else { photometric };
        let channel = |(c, sums)| {
            ChannelResult::new(r, (c, &tallies.channels[i][c], sums), (power_scale, &per[..]), channel_unit)
        };
        let channels = further.chunks(r.cell_count()).enumerate().map(channel).collect();
        let cells: Vec<f64> = sums.iter().enumerate().map(|(k, s)| power_scale.power(s) * per[k]).collect();
        let errors = sums.iter().enumerate().map(|(k, s)| power_scale.error(s) * per[k]).collect();
        let total = &tallies.receivers[i];
        let means = tallies.moments[i].means(total.total);
        // A mean square is no less than the square of the mean, by whatever units both are counted in.
        let means = means.map(|[mean, square]| [mean, square.max(mean * mean)]);
        let of_means = tallies.spreads[i].errors(total, &tallies.moments[i], tallies.replicates);
        let rays = ray_count(total, tallies.replicates, ray);
        let of_spread = [0, 1].map(|a| mean_and_rms_errors(means[a], [of_means[a], of_means[2 + a]]));
        // Distances are counted in units of the longer half side, in which a circle stays one.
        let largest = half[0].max(half[1]);
        let farthest = tallies.moments[i].farthest();
        let of_place = [0, 1].map(|a| {
            let of_rays = place_errors(means[a], of_spread[a], rays);
            let of_units = unit_errors(means[a], farthest * largest / half[a]);
            [0, 1].map(|k| of_rays[k].hypot(of_units[k]))
        });
        let along_axes = |errors: [[f64; 2]; 2], k: usize| [0, 1].map(|a| half[a] * errors[a][k]);
        let mut result = Self {
            name: r.name.clone(),
            kind,
            power: power_scale.power(total),
            power_error: power_scale.error(total),
            grid,
            max: 0.0,
            min: least_on_receiver(&cells, &off),
            unit,
            centroid: [0, 1].map(|a| middle[a] + half[a] * means[a][0]),
            centroid_error: along_axes(of_place, 0),
            rms: [0, 1].map(|a| half[a] * means[a][1].sqrt()),
            rms_error: along_axes(of_place, 1),
            spread_errors: [along_axes(of_spread, 0), along_axes(of_spread, 1)],
            farthest: largest * farthest,
            files: Vec::new(),
            half,
            middle,
            angles,
            channels,
            cells,
            errors,
            ray_power: ray * power_scale.quantum,
            ray_cells: per.iter().map(|per| ray * power_scale.quantum * per).collect(),
            off,
        };
        result.max = result.cells_with_even_poles()[0].iter().copied().fold(0.0, f64::max);
        result
    }

    /// The area or solid angle of a cell that counted light, with those parts of its neighbours that it counts for: what its density is
    /// multiplied by to be its power.
    pub fn lit_measure(&self, cell: usize) -> f64 {
        // A ray adds the same power everywhere.
        self.ray_power / self.ray_cells[cell]
    }

    /// [`Self::lit_measure`] of all cells together; off a disc there are none, and a ray adds nothing.
    pub fn whole_lit_measure(&self) -> f64 {
        (0..self.cells.len()).filter(|&k| self.ray_cells[k] > 0.0).map(|k| self.lit_measure(k)).sum()
    }

    /// Returns the cells and their errors with each ring of cells at a pole at its mean: these are slivers of one direction. Poles are γ 0°
    /// and 180° of planes C all around, V ±90° of type A and of spheres and H ±90° of type B over half a turn or more. Beside a pole, and
    /// at one where cells are taller than 15°, neighbours of a ring whose standard errors are above 3 % of them are joined to their mean
    /// too, at most as many as have the solid angle of a cell on the equator together. The error of joined cells stands at the last of
    /// them; the others, which are no rivals of it, have none.
    pub fn cells_with_even_poles(&self) -> [Cow<'_, [f64]>; 2] {
        let mut even = [Cow::Borrowed(self.cells.as_slice()), Cow::Borrowed(self.errors.as_slice())];
        let rings = self.pole_rings();
        if !rings.is_empty() {
            let joined = rings.joined_cells(&self.cells, Some(&self.errors));
            joined.level_errors(&self.cells, even[1].to_mut());
            joined.level(even[0].to_mut());
            let [cells, errors] = &mut even;
            rings.clear_rivals(cells, errors.to_mut());
        }
        even
    }

    /// Returns values of the cells with the mean of each group that [`Self::cells_with_even_poles`] joins.
    pub(crate) fn with_joined_cells<'v>(&self, values: &'v [f64]) -> Cow<'v, [f64]> {
        let rings = self.pole_rings();
        let mut joined = Cow::Borrowed(values);
        if !rings.is_empty() && values.len() == self.cells.len() {
            rings.joined_cells(&self.cells, Some(&self.errors)).level(joined.to_mut());
        }
        joined
    }

    /// Returns the rings of cells at and beside the poles, as far as the map reaches them; none of receivers without angles.
    pub(crate) fn pole_rings(&self) -> PoleRings {
        // A sphere is reported in angles of type A.
        let angles = if self.kind == "sphere" { Some(FarFieldType::A) } else { self.angles };
        let Some(angles) = angles else { return PoleRings::default() };
        PoleRings::new(angles, self.grid, [self.bounds(0), self.bounds(1)])
    }

    /// Returns between which values a coordinate lies: mm, or degrees of angles.
    fn bounds(&self, axis: usize) -> [f64; 2] {
        [self.middle[axis] - self.half[axis], self.middle[axis] + self.half[axis]]
    }

    /// Whether an axis (0 or 1) is an angle that goes all around: C, H of type A and of spheres, V of type B. Both ends of its range are
    /// one direction: a beam about it would have its mean in the opposite one, so that mean position and root mean square mean nothing.
    pub fn is_cyclic(&self, axis: usize) -> bool {
        matches!(self.kind, "far_field" | "sphere") && is_whole_turn(self.bounds(axis))
    }

    /// Whether mean position and root mean square along an axis (0 or 1) mean anything: not without light, nor along one that is cyclic.
    pub fn has_place(&self, axis: usize) -> bool {
        self.power > 0.0 && !self.is_cyclic(axis)
    }

    /// Returns one sentence where light came and none of it is of wavelengths that its channels count; `None` where it has none.
    fn unseen_light_note(&self) -> Option<String> {
        let is_unseen =
            self.power > 0.0 && !self.channels.is_empty() && self.channels.iter().all(|c| c.total == 0.0);
        is_unseen.then(|| {
            format!(
                "no light that came to '{}' is of wavelengths that it counts: `bins_nm` hold none of them, or they lie beyond the eye's 360 to \
                 830 nm",
                self.name
            )
        })
    }

    /// Returns the channel in lumens, `lm` or the Y of CIE values; `None` for a receiver that counts power alone or bins.
    pub fn photometric(&self) -> Option<&ChannelResult> {
        self.channels.iter().find(|c| matches!(c.name.as_str(), "lm" | "Y"))
    }

    /// Returns the value of cell `(i, j)`, in `unit`: the `i`-th along the first side, the `j`-th along the second.
    pub fn cell(&self, i: usize, j: usize) -> f64 {
        self.cells[j * self.grid[0] + i]
    }
}

/// Returns sentences about receivers to which light came of which none is of wavelengths that their channels count: one for each of the
/// first, and one that counts the others.
pub(super) fn unseen_light_notes(receivers: &[ReceiverResult]) -> Vec<String> {
    first_sentences(receivers.iter().filter_map(ReceiverResult::unseen_light_note), NAMED_RECEIVERS, |further| {
        format!("the same holds for {}", count_of(further as u64, "more receiver"))
    })
}

/// Number of rays from which on their own spread shows how well a mean place is known.
const TELLING_RAYS: f64 = 64.0;
/// Mean square and mean fourth power of the coordinate of a ray that may fall anywhere, in half sides: those of an even distribution.
const ANYWHERE: [f64; 2] = [1.0 / 3.0, 1.0 / 5.0];

/// Estimates how many rays brought a power, of which the heaviest has `heaviest` quanta.
fn ray_count(power: &Sum, replicates: u32, heaviest: f64) -> f64 {
    let total = power.total as f64;
    let at_least = total / heaviest.max(1.0);
    // Independent rays spread by the root of their number: 10^6 rays of a millionth each are no single ray. Few replicates may be equal by
    // chance.
    let by_spread = (total / power.error(replicates).max(f64::MIN_POSITIVE)).powi(2);
    if f64::from(replicates) < TELLING_RAYS { at_least } else { at_least.max(by_spread) }
}

/// Returns the standard errors of mean and root mean square about the receiver's middle, to first order, from [mean, mean square] along an
/// axis and their standard errors by the spread of replicates; all lengths in half sides. Of a mean square of 0 the second is 0, or
/// infinite where that has an error.
fn mean_and_rms_errors([_, square]: [f64; 2], [of_mean, of_square]: [f64; 2]) -> [f64; 2] {
    // Of a square root, to first order.
    [of_mean, 0.5 * of_square / square.sqrt().max(f64::MIN_POSITIVE)]
}

/// Adds to the standard errors of mean place and root mean square, in half sides, what few rays cannot show: one has no spread at all, and
/// the spread of two or three is often far too small by chance.
///
/// The mean that deviations are taken from is that of the same rays, which makes their squares smaller by (n − 1)/n. Beside that, one ray
/// more might have come, anywhere on the receiver: it moves the mean by (x − mean)/n, and the mean square by (x² − square)/n. Of rays that
/// fall evenly on a receiver, or on a part of it, 2 % of figures lie beyond three such errors for 2 to 10 of them, less for others.
fn place_errors([mean, square]: [f64; 2], [of_mean, of_rms]: [f64; 2], rays: f64) -> [f64; 2] {
    if rays <= 0.0 || rays >= TELLING_RAYS {
        return [of_mean, of_rms];
    }
    let same_rays = (rays.max(2.0) / (rays.max(2.0) - 1.0)).sqrt();
    // Fading, so that a figure's error does not jump where one ray more came.
    let more = (1.0 - rays / TELLING_RAYS) / rays.max(1.0);
    let of_place = more * (ANYWHERE[0] + mean * mean).sqrt();
    let of_square = more * (ANYWHERE[1] - 2.0 * square * ANYWHERE[0] + square * square).sqrt();
    // No first order: the square may be nothing beside what the ray adds to it.
    let wider = (square + of_square).sqrt() - square.sqrt();
    [(same_rays * of_mean).hypot(of_place), (same_rays * of_rms).hypot(wider)]
}

/// Returns what the units that places are counted in leave open of mean place and root mean square, in half sides: half a unit of a
/// coordinate, and of its square. `farthest` is the largest distance of light from the centre.
fn unit_errors([mean, square]: [f64; 2], farthest: f64) -> [f64; 2] {
    let half_unit = 0.5 / Moments::GRAIN;
    // Near the centre squares are far below their unit: the mean and the farthest light, counted finer, say more.
    let least = (square - half_unit).max((mean.abs() - half_unit).max(0.0).powi(2));
    let most = (square + half_unit).min((farthest + Moments::FARTHEST_UNIT).powi(2)).max(square);
    let of_rms = (most.sqrt() - square.sqrt()).max(square.sqrt() - least.sqrt());
    [half_unit, of_rms]
}

/// Returns the smallest of `cells` but for those whose indices are in `off`, rising; infinite where none is left.
fn least_on_receiver(cells: &[f64], off: &[usize]) -> f64 {
    let mut off = off.iter().peekable();
    let on = |k: &usize| off.next_if_eq(&k).is_none();
    (0..cells.len()).filter(on).map(|k| cells[k]).fold(f64::INFINITY, f64::min)
}

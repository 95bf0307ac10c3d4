//! Receivers in the form that the kernel needs: where a ray meets them, and which cell counts it.

use super::channels::Channels;
use super::disc_cells::DiscCells;
use super::far_angles::{far_axes, solid_angle, to_angles};
use super::scene::{self, FarFieldType, ReceiverKind};
use crate::math::{Aabb, Frame, Point, Ray, Vector};
use std::f64::consts::TAU;

/// Receivers named in a note about equal ones; beyond them it gives only the number.
pub(super) const NAMED_RECEIVERS: usize = 3;

/// Share of a flat receiver's half side, and sine of an angle to its plane, below which another surface lies in that plane.
pub(crate) const FLUSH: f64 = 1e-9;

/// A receiver in the form that the kernel needs.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    pub(crate) name: String,
    pub(crate) cells: [u32; 2],
    /// Whether light ends here.
    pub(crate) absorbs: bool,
    /// Counts light after so many bounces alone.
    pub(crate) interactions: Option<u32>,
    pub(crate) shape: Shape,
    pub(crate) channels: Channels,
}

/// Where a receiver stands; lengths in mm, `half` are half sides.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    Plane {
        frame: Frame,
        half: [f64; 2],
        one_sided: bool,
    },
    Disc {
        frame: Frame,
        radius: f64,
        one_sided: bool,
        cells: DiscCells,
    },
    Sphere {
        frame: Frame,
        radius: f64,
    },
    /// Axes right, up, forward; both ranges of angles in radians.
    FarField {
        frame: Frame,
        angles: FarFieldType,
        low: [f64; 2],
        high: [f64; 2],
    },
    /// Faces whose absorbed power counts, ascending.
    Absorbed {
        faces: Vec<u32>,
    },
}

/// A plane or disc, as the rectangle that holds it; `half` are half sides, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlatShape<'r> {
    pub(crate) frame: &'r Frame,
    pub(crate) half: [f64; 2],
    /// Whether it is a disc.
    pub(crate) is_round: bool,
    pub(crate) is_one_sided: bool,
}

impl FlatShape<'_> {
    /// Corners of the rectangle.
    pub(crate) fn corners(&self) -> [Point; 4] {
        let Self { frame, half: [a, b], .. } = *self;
        [[-a, -b], [-a, b], [a, -b], [a, b]].map(|[x, y]| frame.origin + frame.x * x + frame.y * y)
    }

    /// Returns the distance, mm, below which others are in its plane or touch it along a border alone.
    pub(crate) fn near(&self) -> f64 {
        FLUSH * self.half[0].max(self.half[1])
    }
}

/// Where light meets a receiver: the cell, and the coordinates in units of the half sides, each from −1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    pub(crate) cell: usize,
    pub(crate) at: [f64; 2],
    /// Squared distance from the centre in units of the larger half side, or of the larger half range of angles.
    pub(crate) radius2: f64,
}

impl Receiver {
    /// Makes the receiver of a checked scene; `faces` are those of an absorbing one, which has a single cell.
    pub(crate) fn new(r: &scene::Receiver, faces: Vec<u32>) -> Self {
        let (at, n) = (Point::from_array(r.at), Vector::from_array(r.normal));
        let shape = match r.kind {
            ReceiverKind::Plane => {
                let [a, b] = r.size.unwrap_or([1.0, 1.0]);
                let frame = Frame::from_axis(at, n, r.x.map(Vector::from_array));
                Shape::Plane { frame, half: [0.5 * a, 0.5 * b], one_sided: r.one_sided }
            }
            ReceiverKind::Disc => Shape::Disc {
                frame: Frame::from_axis(at, n, r.x.map(Vector::from_array)),
                radius: r.radius.unwrap_or(1.0),
                one_sided: r.one_sided,
                cells: DiscCells::new(r.cells),
            },
            ReceiverKind::Sphere => Shape::Sphere {
                frame: far_axes(at, n, Vector::from_array(r.up())),
                radius: r.radius.unwrap_or(1.0),
            },
            ReceiverKind::FarField => {
                let (h, v) = r.angles_deg();
                let frame = far_axes(Point::ZERO, n, Vector::from_array(r.up()));
                let rad = |x: [f64; 2], y: [f64; 2], i: usize| [x[i].to_radians(), y[i].to_radians()];
                Shape::FarField { frame, angles: r.angles, low: rad(h, v, 0), high: rad(h, v, 1) }
            }
            ReceiverKind::Absorbed => Shape::Absorbed { faces },
        };
        let cells = if r.kind == ReceiverKind::Absorbed { [1, 1] } else { r.cells };
        Self {
            name: r.name.clone(),
            cells,
            absorbs: r.absorbs,
            interactions: r.interactions,
            shape,
            channels: Channels::new(r),
        }
    }

    /// Returns the receiver where a placement puts it: turned and moved with it, and its place scaled, but not its size, which is given in
    /// mm. Faces stay as they are.
    pub(crate) fn placed(mut self, placement: &Frame) -> Self {
        match &mut self.shape {
            Shape::Plane { frame, .. }
            | Shape::Disc { frame, .. }
            | Shape::Sphere { frame, .. }
            | Shape::FarField { frame, .. } => *frame = placement.carry(frame),
            Shape::Absorbed { .. } => {}
        }
        self
    }

    /// Cells of one channel.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells[0] as usize * self.cells[1] as usize
    }

    /// Returns the number of sums to keep: the cells of power, then those of each channel.
    pub(crate) fn sum_count(&self) -> usize {
        self.cell_count() * (1 + self.channels.count())
    }

    /// Returns a plane or disc as its rectangle; `None` for any other shape.
    pub(crate) fn flat(&self) -> Option<FlatShape<'_>> {
        match &self.shape {
            Shape::Plane { frame, half, one_sided } => {
                Some(FlatShape { frame, half: *half, is_round: false, is_one_sided: *one_sided })
            }
            Shape::Disc { frame, radius, one_sided, .. } => {
                Some(FlatShape { frame, half: [*radius; 2], is_round: true, is_one_sided: *one_sided })
            }
            Shape::Sphere { .. } | Shape::FarField { .. } | Shape::Absorbed { .. } => None,
        }
    }

    /// A box around what stands in space; empty for what stands nowhere.
    pub(crate) fn bounds(&self) -> Aabb {
        // Of a disc that of the square around it: a box that is too large costs a test, no light.
        if let Some(flat) = self.flat() {
            return Aabb::from_points(flat.corners());
        }
        let Shape::Sphere { frame, radius } = &self.shape else { return Aabb::EMPTY };
        let reach = Vector::splat(*radius);
        Aabb::from_points([frame.origin - reach, frame.origin + reach])
    }

    /// Whether it may have a point in common with a box; a false positive only costs time. Always `false` for far fields and absorbed
    /// power, which stand nowhere.
    pub(crate) fn meets(&self, region: &Aabb) -> bool {
        match &self.shape {
            Shape::Plane { frame, .. } | Shape::Disc { frame, .. } => {
                let apart = |box_corners: [Point; 8]| {
                    let sides = box_corners.map(|c| (c - frame.origin).dot(frame.z));
                    // All corners on one side of the plane: the box lies before it or behind.
                    sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
                };
                !(self.bounds().intersection(*region).is_empty() || apart(region.corners()))
            }
            Shape::Sphere { frame, radius } => {
                // A box meets the shell of a ball where it reaches out of it and into it.
                let far = region.corners().map(|c| (c - frame.origin).length()).into_iter().fold(0.0, f64::max);
                let nearest = frame.origin.clamp(region.min, region.max);
                far >= *radius && (nearest - frame.origin).length() <= *radius
            }
            Shape::FarField { .. } | Shape::Absorbed { .. } => false,
        }
    }

    /// Returns the nearest crossing of a plane, disc or sphere in `(after, before)`, mm along a ray; `None` where there is none, from
    /// behind what is one-sided, and for receivers that do not stand in space.
    #[inline(always)]
    pub(crate) fn crossing(&self, ray: &Ray, after: f64, before: f64) -> Option<f64> {
        match &self.shape {
            Shape::Plane { frame, half, one_sided } => {
                let t = plane_crossing(frame, *one_sided, ray, after, before)?;
                let p = ray.point_at(t) - frame.origin;
                (p.dot(frame.x).abs() <= half[0] && p.dot(frame.y).abs() <= half[1]).then_some(t)
            }
            Shape::Disc { frame, radius, one_sided, .. } => {
                let t = plane_crossing(frame, *one_sided, ray, after, before)?;
                let p = ray.point_at(t) - frame.origin;
                (p.dot(frame.x).hypot(p.dot(frame.y)) <= *radius).then_some(t)
            }
            Shape::Sphere { frame, radius } => {
                let o = ray.origin - frame.origin;
                let b = o.dot(ray.direction);
                // Distance of the ray from the centre by the foot of the perpendicular: no cancellation for far origins.
                let foot = o - ray.direction * b;
                let d2 = radius * radius - foot.length_squared();
                if d2 < 0.0 {
                    return None;
                }
                let root = d2.sqrt();
                [-b - root, -b + root].into_iter().find(|&t| t > after && t < before)
            }
            Shape::FarField { .. } | Shape::Absorbed { .. } => None,
        }
    }

    /// Returns the cell and coordinates of a point, in scene coordinates, on a plane, disc or sphere; `None` for any other receiver. That
    /// the point lies on it is not checked.
    #[inline(always)]
    pub(crate) fn spot(&self, p: Point) -> Option<Spot> {
        match &self.shape {
            Shape::Plane { frame, half, .. } => {
                let local = p - frame.origin;
                let (x, y) = (local.dot(frame.x), local.dot(frame.y));
                // A point on the very border may be rounded over it.
                let at = [(x / half[0]).clamp(-1.0, 1.0), (y / half[1]).clamp(-1.0, 1.0)];
                let largest = half[0].max(half[1]);
                Some(self.spot_at(at, (x * x + y * y) / (largest * largest)))
            }
            Shape::Disc { frame, radius, cells, .. } => {
                let local = p - frame.origin;
                let at = [local.dot(frame.x) / radius, local.dot(frame.y) / radius];
                let spot = self.spot_at(at.map(|x| x.clamp(-1.0, 1.0)), at[0] * at[0] + at[1] * at[1]);
                // A cell whose middle lies beyond the rim leaves its light to the next one inwards.
                Some(Spot { cell: cells.home(spot.cell), ..spot })
            }
            Shape::Sphere { frame, .. } => {
                let d = frame.local_direction(p - frame.origin).normalize();
                self.angular_spot(d, FarFieldType::A, [-0.5 * TAU, -0.25 * TAU], [0.5 * TAU, 0.25 * TAU])
            }
            Shape::FarField { .. } | Shape::Absorbed { .. } => None,
        }
    }

    /// Returns the cell and coordinates of a unit direction in a far field; `None` outside its ranges, and for any other receiver.
    #[inline]
    pub(crate) fn direction(&self, d: Vector) -> Option<Spot> {
        match &self.shape {
            Shape::FarField { frame, angles, low, high } => {
                self.angular_spot(frame.local_direction(d), *angles, *low, *high)
            }
            _ => None,
        }
    }

    /// Returns the spot of a direction given as (right, up, forward) in a field from `low` to `high`, rad; `None` outside.
    fn angular_spot(&self, d: Vector, angles: FarFieldType, low: [f64; 2], high: [f64; 2]) -> Option<Spot> {
        let [h, v] = to_angles(d, angles);
        if !(low[0] <= h && h <= high[0] && low[1] <= v && v <= high[1]) {
            return None;
        }
        let part = |a: f64, i: usize| (2.0 * (a - low[i]) / (high[i] - low[i]) - 1.0).clamp(-1.0, 1.0);
        let at = [part(h, 0), part(v, 1)];
        // In units of the longer half range, in which distances are reported: a degree is as long along both.
        let range = [high[0] - low[0], high[1] - low[1]];
        let longest = range[0].max(range[1]);
        let [x, y] = [at[0] * (range[0] / longest), at[1] * (range[1] / longest)];
        Some(self.spot_at(at, x * x + y * y))
    }

    /// Returns the spot at a place given in half sides, from −1 to 1, with its cell; the upper border belongs to the last cell.
    fn spot_at(&self, at: [f64; 2], radius2: f64) -> Spot {
        let index = |x: f64, n: u32| ((0.5 * (x + 1.0) * f64::from(n)) as u32).min(n - 1) as usize;
        let cell = index(at[1], self.cells[1]) * self.cells[0] as usize + index(at[0], self.cells[0]);
        Spot { cell, at, radius2 }
    }

    /// Returns the area (mm²) or solid angle (sr) of a cell; 0 for one that lies off a disc, where no light is counted, and 1 for absorbed
    /// power, which is no density.
    pub(crate) fn measure(&self, column: usize, row: usize) -> f64 {
        let n = self.cells.map(f64::from);
        match &self.shape {
            Shape::Plane { half, .. } => 4.0 * half[0] * half[1] / (n[0] * n[1]),
            Shape::Disc { radius, cells, .. } => {
                radius * radius * cells.measure(row * self.cells[0] as usize + column)
            }
            Shape::Sphere { radius, .. } => {
                let [h, v] = [[-0.5 * TAU, 0.5 * TAU], [-0.25 * TAU, 0.25 * TAU]];
                radius * radius * solid_angle(FarFieldType::A, [h[0], v[0]], [h[1], v[1]], self.cells, [0, row])
            }
            Shape::FarField { angles, low, high, .. } => {
                solid_angle(*angles, *low, *high, self.cells, [column, row])
            }
            Shape::Absorbed { .. } => 1.0,
        }
    }
}

/// Returns the distance along a ray, mm, at which it crosses the x–y plane of a frame, if in `(after, before)`; `None` for a parallel ray
/// and, where `one_sided`, for one that runs along the frame's z axis and not against it.
#[inline(always)]
fn plane_crossing(frame: &Frame, one_sided: bool, ray: &Ray, after: f64, before: f64) -> Option<f64> {
    let along = ray.direction.dot(frame.z);
    // A one-sided receiver counts what comes against its normal.
    if along == 0.0 || one_sided && along > 0.0 {
        return None;
    }
    let t = (frame.origin - ray.origin).dot(frame.z) / along;
    // Refuses NaN too, as of a ray without direction.
    (t > after && t < before).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn far(angles: FarFieldType, h: [f64; 2], v: [f64; 2], cells: [u32; 2]) -> Receiver {
        let kind = ReceiverKind::FarField;
        Receiver::new(
            &scene::Receiver { kind, angles, h_deg: Some(h), v_deg: Some(v), cells, ..Default::default() },
            Vec::new(),
        )
    }

    #[test]
    fn the_cells_of_a_whole_sphere_make_four_pi() {
        for (angles, h, v) in [
            (FarFieldType::A, [-180.0, 180.0], [-90.0, 90.0]),
            (FarFieldType::B, [-90.0, 90.0], [-180.0, 180.0]),
            (FarFieldType::C, [0.0, 360.0], [0.0, 180.0]),
        ] {
            let r = far(angles, h, v, [12, 7]);
            let sum: f64 = (0..12).flat_map(|i| (0..7).map(move |j| (i, j))).map(|(i, j)| r.measure(i, j)).sum();
            assert!((sum - 2.0 * TAU).abs() < 1e-12, "{angles:?} {sum}");
        }
    }

    #[test]
    fn right_is_positive_h_and_up_is_positive_v() {
        // Looking along +z with y up, right is −x.
        for angles in [FarFieldType::A, FarFieldType::B] {
            let r = far(angles, [-90.0, 90.0], [-90.0, 90.0], [2, 2]);
            assert_eq!(r.direction(Vector::new(-0.1, 0.1, 1.0).normalize()).unwrap().cell, 3);
            assert_eq!(r.direction(Vector::new(0.1, -0.1, 1.0).normalize()).unwrap().cell, 0);
        }
    }

    #[test]
    fn distances_in_a_far_field_are_in_units_of_its_longer_half_range() {
        let r = far(FarFieldType::A, [-90.0, 90.0], [-20.0, 20.0], [9, 2]);
        for [h, v] in [[0.0, 18.0], [-45.0, 0.0], [30.0, -10.0f64]] {
            let (h_rad, v_rad) = (h.to_radians(), v.to_radians());
            let to = Vector::new(-h_rad.sin() * v_rad.cos(), v_rad.sin(), h_rad.cos() * v_rad.cos());
            let distance = 90.0 * r.direction(to).unwrap().radius2.sqrt();
            assert!((distance - h.hypot(v)).abs() < 1e-9, "{h} {v}: {distance}");
        }
    }

    #[test]
    fn a_plane_is_crossed_inside_its_sides() {
        let r =
            scene::Receiver { at: [0.0, 0.0, 5.0], size: Some([2.0, 4.0]), cells: [2, 2], ..Default::default() };
        let r = Receiver::new(&r, Vec::new());
        let ray = |x: f64, y: f64| Ray::new(Point::new(x, y, 0.0), Vector::Z);
        assert_eq!(r.crossing(&ray(0.9, 1.9), 0.0, 1e9), Some(5.0));
        assert_eq!(r.crossing(&ray(1.1, 0.0), 0.0, 1e9), None);
        assert_eq!(r.crossing(&ray(0.9, 1.9), 0.0, 4.0), None);
        assert_eq!(r.crossing(&ray(0.9, 1.9), 5.0, 9.0), None);
        let spot = r.spot(Point::new(0.5, -1.0, 5.0)).unwrap();
        assert_eq!((spot.at, spot.radius2), ([0.5, -0.5], 1.25 / 4.0));
    }
}

use super::stream::{Stream, Ticket};
use crate::math::{FaceId, Frame, Point, Uv, Vector};
use crate::model::{Face, Model};
use crate::simulate::bind::{inside, polygons};

/// Cells across a face in each parameter.
const CELLS: usize = 32;

/// Faces of a model that shine evenly: points are drawn by area on the spline, inside the trims.
///
/// A cell is drawn by a bound of its area, a point in it by rejection. The bound is 1.2 times the largest of 9 samples of
/// the area element; where a surface bends more than that inside 1/32 of a face, the density is too low by the excess.
#[derive(Clone, Debug)]
pub(crate) struct Area {
    faces: Vec<Shining>,
    /// Bounds of area up to and including each cell, face by face.
    sums: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Shining {
    id: FaceId,
    face: Face,
    placement: Frame,
    loops: Vec<Vec<Uv>>,
    /// Bound of `|Su × Sv|` in each cell.
    bounds: Vec<f64>,
}

impl Shining {
    fn cell(&self, k: usize) -> [Uv; 2] {
        let [[u0, u1], [v0, v1]] = self.face.surface.domain();
        let size = Uv::new(u1 - u0, v1 - v0) / CELLS as f64;
        [Uv::new(u0, v0) + size * Uv::new((k / CELLS) as f64, (k % CELLS) as f64), size]
    }

    fn element(&self, uv: Uv) -> f64 {
        let d = self.face.surface.derivatives(uv);
        d.du.cross(d.dv).length() * self.placement.scale.powi(2)
    }
}

impl Area {
    /// Prepares faces; `None` when none of them has a surface with area.
    pub(crate) fn new(model: &Model, chosen: &[usize]) -> Option<Self> {
        let (mut faces, mut sums, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for f in model.placed_faces().filter(|f| chosen.contains(&f.id.index())) {
            let Some(face) = f.face else { continue };
            let (id, placement, loops) = (f.id, *f.placement, polygons(face));
            let mut shining = Shining { id, face: face.clone(), placement, loops, bounds: Vec::new() };
            for k in 0..CELLS * CELLS {
                let [low, size] = shining.cell(k);
                let samples = (0..9).map(|i| Uv::new((i / 3) as f64, (i % 3) as f64) * 0.5);
                let largest = samples.map(|s| shining.element(low + size * s)).fold(0.0, f64::max);
                shining.bounds.push(1.2 * largest);
                sum += 1.2 * largest * size.x * size.y;
                sums.push(sum);
            }
            faces.push(shining);
        }
        (sum > 0.0 && sum.is_finite()).then_some(Self { faces, sums })
    }

    /// A point, its outward normal and its face.
    pub(crate) fn point(&self, stream: &Stream, ticket: Ticket) -> (Point, Vector, FaceId) {
        let whole = self.sums[self.sums.len() - 1];
        let mut last = None;
        // A face of which less than 1/1000 lies inside its trims would be a sliver.
        for attempt in 0..10_000 {
            let [u, v] =
                if attempt == 0 { stream.pair(ticket, 0) } else { stream.random(ticket, 2 * attempt + 10) };
            let at = u * whole;
            let cell = self.sums.partition_point(|s| *s <= at).min(self.sums.len() - 1);
            let low = if cell == 0 { 0.0 } else { self.sums[cell - 1] };
            let shining = &self.faces[cell / (CELLS * CELLS)];
            let [corner, size] = shining.cell(cell % (CELLS * CELLS));
            let s = ((at - low) / (self.sums[cell] - low)).clamp(0.0, 1.0);
            let uv = corner + size * Uv::new(s, v);
            last = Some((shining, uv));
            let [keep, _] = stream.random(ticket, 2 * attempt + 11);
            let bound = shining.bounds[cell % (CELLS * CELLS)];
            if inside(&shining.loops, uv) && keep * bound <= shining.element(uv) {
                break;
            }
        }
        let Some((shining, uv)) = last else { return (Point::ZERO, Vector::Z, FaceId(0)) };
        let normal = shining.face.surface.normal(uv).unwrap_or(Vector::Z);
        let outward = if shining.face.reversed { -normal } else { normal };
        let place = &shining.placement;
        (place.point(shining.face.surface.evaluate(uv)), place.normal(outward).normalize(), shining.id)
    }
}

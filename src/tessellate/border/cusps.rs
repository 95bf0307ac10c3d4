//! Cusps of a border whose two edges cross by less than the tolerance beside the corner, as real files have them where a round runs out
//! into a line, and of strips between two edges that are narrower than that: in this face's parameters, samples move to the side of the
//! other edge on which they belong.

use super::polygons::{BorderPolygons, BorderSide, PolygonVertex};
use crate::math::Uv;
use crate::math::polygon::nearest_on_side;
use crate::tessellate::face_surface::FaceSurface;

/// Least cosine between two edges that meet in a cusp.
const CUSP: f64 = 0.9;
/// Share of the tolerance by which samples are moved at most: what is left goes to the facets.
const FARTHEST: f64 = 0.25;
/// Share of that by which moved samples lie beside the other edge.
const BESIDE: f64 = 1e-2;

impl BorderPolygons {
    /// Moves samples beside cusps, in parameters alone, so that the chords of the two edges no longer cross. Places stay, which lie beside
    /// the surface's points at the parameters by [`FARTHEST`] of the tolerance at most; vertices stay too.
    pub(in crate::tessellate) fn untangle_cusps(&mut self, surface: &FaceSurface<'_>) {
        // Of a hole it would be the other way round.
        let is_alone = self.polygons.len() == 1;
        for polygon in &mut self.polygons {
            for corner in 0..polygon.len() {
                let uv = polygon[corner].uv;
                let d = surface.spline.derivatives(uv);
                let scale = Uv::new(d.du.length(), d.dv.length());
                if scale.min_element() > 0.0 {
                    untangle(polygon, corner, scale, FARTHEST * surface.tolerance(uv), is_alone);
                }
            }
            for v in polygon {
                v.uv = surface.spline.clamp(v.uv);
            }
        }
    }
}

/// Moves the samples of the two edges that meet at a corner by up to `limit` mm; does nothing where they meet in no cusp, or are nowhere
/// farther apart than that, unless they are the whole border: `is_alone` is whether there is no other polygon. `scale` is the length in mm
/// of a unit of each parameter.
fn untangle(polygon: &mut [PolygonVertex], corner: usize, scale: Uv, limit: f64, is_alone: bool) {
    let origin = polygon[corner].uv;
    let sides = [true, false].map(|ahead| side_from(polygon, corner, ahead));
    let [mut ahead, mut back] =
        [0, 1].map(|k| sides[k].iter().map(|&i| (polygon[i].uv - origin) * scale).collect::<Vec<Uv>>());
    if ahead.len() < 2 || back.len() < 2 || sides[0][1] == sides[1][1] {
        return;
    }
    if ahead[1].dot(back[1]) <= CUSP * ahead[1].length() * back[1].length() {
        return;
    }
    // Where they are clearly apart, the side of the other on which each belongs is known.
    let apart = |line: &[Uv], points: &[Uv]| {
        points.iter().map(|&p| Foot::on_line(p, line).away).find(|away| away.abs() > limit)
    };
    let left = apart(&back, &ahead).or_else(|| apart(&ahead, &back).map(|away| -away));
    // A strip that is nowhere wide lies to the left of the way around it.
    let is_strip = is_alone && ahead.len() + back.len() == polygon.len() + 2;
    let Some(sign) = left.map(f64::signum).or(is_strip.then_some(-1.0)) else { return };
    part(&mut ahead, &back, sign, limit);
    part(&mut back, &ahead, -sign, limit);
    for (side, points) in sides.iter().zip([ahead, back]) {
        for (&i, p) in side.iter().zip(points).take(side.len() - 1).skip(1) {
            polygon[i].uv = origin + p / scale;
        }
    }
}

/// Returns the vertices of a polygon from a corner to the end of the edge that runs ahead or back from it, both ends included; the corner
/// alone where no edge of the part does, or none begins or ends there.
fn side_from(polygon: &[PolygonVertex], corner: usize, ahead: bool) -> Vec<usize> {
    let n = polygon.len();
    let edge_use = |segment: usize| match polygon[segment].side {
        BorderSide::Edge { edge_use, .. } => Some(edge_use),
        _ => None,
    };
    let (before, after) = (edge_use((corner + n - 1) % n), edge_use(corner));
    let along = if ahead { after } else { before };
    if before == after || along.is_none() {
        return vec![corner];
    }
    let vertex = |step: usize| (if ahead { corner + step } else { corner + n - step }) % n;
    // A segment has the number of the vertex where it starts.
    let segment = |step: usize| vertex(if ahead { step - 1 } else { step });
    let others = (1..n).take_while(|&step| edge_use(segment(step)) == along).map(vertex);
    std::iter::once(corner).chain(others).collect()
}

/// Moves points to the side `sign` of a line, as far as they are within `limit` of it; the first and the last stay.
fn part(points: &mut [Uv], line: &[Uv], sign: f64, limit: f64) {
    let inner = points.len() - 1;
    for p in &mut points[1..inner] {
        let foot = Foot::on_line(*p, line);
        if foot.away.abs() > limit {
            break;
        }
        if foot.away * sign < BESIDE * limit {
            *p = foot.place + foot.left * (sign * BESIDE * limit);
        }
    }
}

/// The place of a line that is nearest to a point.
struct Foot {
    place: Uv,
    /// Unit vector to the left of the line there.
    left: Uv,
    /// Distance of the point, positive to the left, mm.
    away: f64,
}

impl Foot {
    /// Finds the foot of a point on a line of two points or more; of a line without length it is the point.
    fn on_line(p: Uv, line: &[Uv]) -> Self {
        let foot = |s: &[Uv]| (nearest_on_side([s[0], s[1]], p), (s[1] - s[0]).perp().normalize_or_zero());
        let feet = line.windows(2).filter(|s| s[0] != s[1]).map(foot);
        let nearest = feet.min_by(|a, b| (a.0 - p).length_squared().total_cmp(&(b.0 - p).length_squared()));
        let Some((place, left)) = nearest else { return Self { place: p, left: Uv::ZERO, away: 0.0 } };
        let away = p - place;
        Self { place, left, away: away.length().copysign(away.dot(left)) }
    }
}
